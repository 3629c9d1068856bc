!> Vectors of three components.
module m_vectors
   use m_kinds, only: wp
   implicit none
   private
   public :: cross, tangents, part_across, split_along

contains

   !> a x b.
   pure function cross(a, b) result(c)
      real(wp), intent(in) :: a(3), b(3)
      real(wp) :: c(3)
      c = [a(2)*b(3) - a(3)*b(2), a(3)*b(1) - a(1)*b(3), a(1)*b(2) - a(2)*b(1)]
   end function cross

   !> Two orthogonal unit vectors normal to a unit vector, which form a right-handed system with it.
   pure function tangents(normal) result(t)
      real(wp), intent(in) :: normal(3)
      real(wp) :: t(3, 2)
      t(:, 1) = 0.0_wp
      t(minloc(abs(normal), dim=1), 1) = 1.0_wp
      t(:, 1) = t(:, 1) - dot_product(t(:, 1), normal)*normal
      t(:, 1) = t(:, 1)/norm2(t(:, 1))
      t(:, 2) = cross(normal, t(:, 1))
   end function tangents

   !> The direction of a vector's component normal to a unit vector; 0 if there is none.
   pure function part_across(a, axis) result(part)
      real(wp), intent(in) :: a(3), axis(3)
      real(wp) :: part(3)
      part = a - dot_product(a, axis)*axis
      if (norm2(part) > 0.0_wp) part = part/norm2(part)
   end function part_across

   !> Split a vector into its components against and normal to a unit vector: their lengths, and the direction
   !> of the second, which is 0 if there is none.
   pure subroutine split_along(axis, a, height, radius, radial)
      real(wp), intent(in) :: axis(3), a(3)
      real(wp), intent(out) :: height, radius, radial(3)
      height = -dot_product(a, axis)
      radial = a + height*axis
      radius = sqrt(dot_product(radial, radial)) ! norm2 guards against overflow, at several times the cost
      if (radius > 0.0_wp) radial = (1.0_wp/radius)*radial
   end subroutine split_along

end module m_vectors
