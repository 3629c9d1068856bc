!> Vectors of three.
module m_vectors
   use m_kinds, only: wp
   implicit none
   private
   public :: cross, tangents

contains

   !> a x b.
   pure function cross(a, b) result(c)
      real(wp), intent(in) :: a(3), b(3)
      real(wp) :: c(3)
      c = [a(2)*b(3) - a(3)*b(2), a(3)*b(1) - a(1)*b(3), a(1)*b(2) - a(2)*b(1)]
   end function cross

   !> Two unit vectors across a unit vector and each other, which make a right-restricted system with it.
   pure function tangents(normal) result(t)
      real(wp), intent(in) :: normal(3)
      real(wp) :: t(3, 2)
      t(:, 1) = 0.0_wp
      t(minloc(abs(normal), dim=1), 1) = 1.0_wp
      t(:, 1) = t(:, 1) - dot_product(t(:, 1), normal)*normal
      t(:, 1) = t(:, 1)/norm2(t(:, 1))
      t(:, 2) = cross(normal, t(:, 1))
   end function tangents

end module m_vectors
