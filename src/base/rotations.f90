!> Rotations as unit quaternions (w, x, y, z) and as matrices, and the polar decomposition that finds them.
module m_rotations
   use m_kinds, only: wp
   implicit none
   private
   public :: from_euler, matrix_of, quaternion_of, product_of, angle_between, polar, determinant, cofactors

   integer, parameter :: most_iterations = 60 !< of the polar decomposition; four do where strains are small
   real(wp), parameter :: settled = 4.0_wp*epsilon(1.0_wp)

contains

   !> Quaternion of Bunge's Euler angles (phi1, Phi, phi2; radians): it turns the axes of a crystal, which lie
   !> along the sample's at first, about z, then x, then z, each as they have been turned. Its matrix takes
   !> components along the crystal's axes to components along the sample's: the transpose of Bunge's g.
   pure function from_euler(angles) result(q)
      real(wp), intent(in) :: angles(3)
      real(wp) :: q(4), half(3)
      half = 0.5_wp*angles
      q = product_of(product_of([cos(half(1)), 0.0_wp, 0.0_wp, sin(half(1))], &
                                [cos(half(2)), sin(half(2)), 0.0_wp, 0.0_wp]), &
                     [cos(half(3)), 0.0_wp, 0.0_wp, sin(half(3))])
   end function from_euler

   !> The matrix of a quaternion, which need not have the length 1.
   pure function matrix_of(q) result(r)
      real(wp), intent(in) :: q(4)
      real(wp) :: r(3, 3), s
      s = 2.0_wp/(q(1)**2 + q(2)**2 + q(3)**2 + q(4)**2)
      r(1, 1) = 1.0_wp - s*(q(3)**2 + q(4)**2)
      r(2, 2) = 1.0_wp - s*(q(2)**2 + q(4)**2)
      r(3, 3) = 1.0_wp - s*(q(2)**2 + q(3)**2)
      r(1, 2) = s*(q(2)*q(3) - q(1)*q(4))
      r(2, 1) = s*(q(2)*q(3) + q(1)*q(4))
      r(1, 3) = s*(q(2)*q(4) + q(1)*q(3))
      r(3, 1) = s*(q(2)*q(4) - q(1)*q(3))
      r(2, 3) = s*(q(3)*q(4) - q(1)*q(2))
      r(3, 2) = s*(q(3)*q(4) + q(1)*q(2))
   end function matrix_of

   !> The quaternion of a rotation matrix, with w not below 0 where the angle is below 120 degrees (Shepperd
   !> 1978: from the largest of the four).
   pure function quaternion_of(r) result(q)
      real(wp), intent(in) :: r(3, 3)
      real(wp) :: q(4), trace
      integer :: i, j, k
      trace = r(1, 1) + r(2, 2) + r(3, 3)
      if (trace > 0.0_wp) then
         q(1) = 1.0_wp + trace
         q(2:4) = [r(3, 2) - r(2, 3), r(1, 3) - r(3, 1), r(2, 1) - r(1, 2)]
      else
         i = maxloc([r(1, 1), r(2, 2), r(3, 3)], dim=1)
         j = 1 + mod(i, 3)
         k = 1 + mod(j, 3)
         q(1) = r(k, j) - r(j, k)
         q(1 + i) = 1.0_wp + r(i, i) - r(j, j) - r(k, k)
         q(1 + j) = r(j, i) + r(i, j)
         q(1 + k) = r(k, i) + r(i, k)
      end if
      q = q/norm2(q)
   end function quaternion_of

   !> First b, then a.
   pure function product_of(a, b) result(q)
      real(wp), intent(in) :: a(4), b(4)
      real(wp) :: q(4)
      q(1) = a(1)*b(1) - a(2)*b(2) - a(3)*b(3) - a(4)*b(4)
      q(2) = a(1)*b(2) + a(2)*b(1) + a(3)*b(4) - a(4)*b(3)
      q(3) = a(1)*b(3) + a(3)*b(1) + a(4)*b(2) - a(2)*b(4)
      q(4) = a(1)*b(4) + a(4)*b(1) + a(2)*b(3) - a(3)*b(2)
   end function product_of

   !> The angle of the rotation that takes one to the other, radians, 0 to pi.
   pure real(wp) function angle_between(a, b) result(angle)
      real(wp), intent(in) :: a(4), b(4) !< of length 1
      real(wp) :: q(4)
      q = product_of(a, [b(1), -b(2), -b(3), -b(4)])
      angle = 2.0_wp*atan2(norm2(q(2:4)), abs(q(1)))
   end function angle_between

   pure real(wp) function determinant(a)
      real(wp), intent(in) :: a(3, 3)
      determinant = a(1, 1)*(a(2, 2)*a(3, 3) - a(2, 3)*a(3, 2)) + a(1, 2)*(a(2, 3)*a(3, 1) - a(2, 1)*a(3, 3)) &
                    + a(1, 3)*(a(2, 1)*a(3, 2) - a(2, 2)*a(3, 1))
   end function determinant

   !> Those of a matrix: over its determinant they are the transpose of its inverse.
   pure function cofactors(a) result(c)
      real(wp), intent(in) :: a(3, 3)
      real(wp) :: c(3, 3)
      c(1, 1) = a(2, 2)*a(3, 3) - a(2, 3)*a(3, 2)
      c(1, 2) = a(2, 3)*a(3, 1) - a(2, 1)*a(3, 3)
      c(1, 3) = a(2, 1)*a(3, 2) - a(2, 2)*a(3, 1)
      c(2, 1) = a(3, 2)*a(1, 3) - a(3, 3)*a(1, 2)
      c(2, 2) = a(3, 3)*a(1, 1) - a(3, 1)*a(1, 3)
      c(2, 3) = a(3, 1)*a(1, 2) - a(3, 2)*a(1, 1)
      c(3, 1) = a(1, 2)*a(2, 3) - a(1, 3)*a(2, 2)
      c(3, 2) = a(1, 3)*a(2, 1) - a(1, 1)*a(2, 3)
      c(3, 3) = a(1, 1)*a(2, 2) - a(1, 2)*a(2, 1)
   end function cofactors

   !> F = R U by Newton's iteration (Higham 1986), X <- (X + X^-T)/2. F = I gives R = U = I to the bit.
   pure subroutine polar(f, r, u)
      real(wp), intent(in) :: f(3, 3) !< of determinant above 0
      real(wp), intent(out) :: r(3, 3), u(3, 3)
      real(wp) :: c(3, 3), next(3, 3), change
      integer :: n
      r = f
      do n = 1, most_iterations
         c = cofactors(r)
         next = 0.5_wp*(r + c/(r(1, 1)*c(1, 1) + r(1, 2)*c(1, 2) + r(1, 3)*c(1, 3)))
         change = maxval(abs(next - r))
         r = next
         if (.not. change > settled) exit
      end do
      u = matmul(transpose(r), f)
      u = 0.5_wp*(u + transpose(u))
   end subroutine polar

end module m_rotations
