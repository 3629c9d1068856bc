!> Polar decomposition of 3 x 3 matrices, with cofactors and logarithm.
module m_polar
   use m_kinds, only: wp
   implicit none
   private
   public :: polar, determinant, cofactors, logarithm

   integer, parameter :: iteration_limit = 60 !< four suffice for small strains
   real(wp), parameter :: settled = 4.0_wp*epsilon(1.0_wp)

contains

   pure real(wp) function determinant(a)
      real(wp), intent(in) :: a(3, 3)
      determinant = a(1, 1)*(a(2, 2)*a(3, 3) - a(2, 3)*a(3, 2)) + &
         a(1, 2)*(a(2, 3)*a(3, 1) - a(2, 1)*a(3, 3)) + a(1, 3)*(a(2, 1)*a(3, 2) - a(2, 2)*a(3, 1))
   end function determinant

   !> Cofactors of a matrix: divided by its determinant they are the transpose of its inverse.
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
      real(wp), intent(in) :: f(3, 3) !< determinant above 0
      real(wp), intent(out) :: r(3, 3), u(3, 3)
      real(wp) :: c(3, 3), next(3, 3), change
      integer :: n
      r = f
      do n = 1, iteration_limit
         c = cofactors(r)
         next = 0.5_wp*(r + c/(r(1, 1)*c(1, 1) + r(1, 2)*c(1, 2) + r(1, 3)*c(1, 3)))
         change = maxval(abs(next - r))
         r = next
         if (.not. change > settled) exit
      end do
      u = matmul(transpose(r), f)
      u = 0.5_wp*(u + transpose(u))
   end subroutine polar

   !> ln A of a symmetric positive definite matrix, by Jacobi's rotations. ln I = 0 to the bit.
   pure function logarithm(a) result(l)
      real(wp), intent(in) :: a(3, 3)
      real(wp) :: l(3, 3), d(3, 3), v(3, 3), g(3, 3), ratio, t
      integer :: i, j, k, sweep
      d = a
      v = reshape([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [3, 3])
      do sweep = 1, iteration_limit
         k = 0
         do i = 1, 2
            do j = i + 1, 3
               if (abs(d(i, j)) <= 0.25_wp*settled*sqrt(d(i, i)*d(j, j))) cycle
               k = k + 1
               ratio = (d(j, j) - d(i, i))/(2.0_wp*d(i, j))
               t = sign(1.0_wp, ratio)/(abs(ratio) + sqrt(ratio**2 + 1.0_wp))
               g = 0.0_wp
               g(6 - i - j, 6 - i - j) = 1.0_wp
               g(i, i) = 1.0_wp/sqrt(t**2 + 1.0_wp)
               g(j, j) = g(i, i)
               g(i, j) = t*g(i, i)
               g(j, i) = -g(i, j)
               d = matmul(transpose(g), matmul(d, g))
               v = matmul(v, g)
            end do
         end do
         if (k == 0) exit
      end do
      l = 0.0_wp
      do k = 1, 3
         l = l + log(d(k, k))*spread(v(:, k), 2, 3)*spread(v(:, k), 1, 3)
      end do
   end function logarithm

end module m_polar
