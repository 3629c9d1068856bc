!> Polar decomposition of 3 x 3 matrices, and what it is made of.
module m_polar
   use m_kinds, only: wp
   implicit none
   private
   public :: polar, determinant, cofactors

   integer, parameter :: most_iterations = 60 !< four do where strains are small
   real(wp), parameter :: settled = 4.0_wp*epsilon(1.0_wp)

contains

   pure real(wp) function determinant(a)
      real(wp), intent(in) :: a(3, 3)
      determinant = a(1, 1)*(a(2, 2)*a(3, 3) - a(2, 3)*a(3, 2)) + &
         a(1, 2)*(a(2, 3)*a(3, 1) - a(2, 1)*a(3, 3)) + a(1, 3)*(a(2, 1)*a(3, 2) - a(2, 2)*a(3, 1))
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

end module m_polar
