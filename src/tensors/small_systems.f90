!> Small symmetric positive definite systems (Cholesky), for laws that solve one a particle.
module m_small_systems
   use m_kinds, only: wp
   implicit none
   private
   public :: solve_definite, invert_definite

contains

   !> Solve A x = b by A = L L^T; the upper triangle of A is not read. If not `definite`, x is undefined.
   pure subroutine solve_definite(n, a, b, x, definite)
      integer, intent(in) :: n
      real(wp), intent(in) :: a(n, n), b(n)
      real(wp), intent(out) :: x(n)
      logical, intent(out) :: definite
      real(wp) :: l(n, n), inverse(n), rest
      integer :: i, j, k
      definite = .false.
      do j = 1, n
         rest = a(j, j)
         do k = 1, j - 1
            rest = rest - l(j, k)**2
         end do
         if (.not. rest > 0.0_wp) return
         inverse(j) = 1.0_wp/sqrt(rest)
         do i = j + 1, n
            rest = a(i, j)
            do k = 1, j - 1
               rest = rest - l(i, k)*l(j, k)
            end do
            l(i, j) = rest*inverse(j)
         end do
      end do
      definite = .true.
      do i = 1, n
         rest = b(i)
         do k = 1, i - 1
            rest = rest - l(i, k)*x(k)
         end do
         x(i) = rest*inverse(i)
      end do
      do i = n, 1, -1
         rest = x(i)
         do k = i + 1, n
            rest = rest - l(k, i)*x(k)
         end do
         x(i) = rest*inverse(i)
      end do
   end subroutine solve_definite

   !> The inverse of a symmetric matrix, column by column; undefined if not `definite`.
   pure subroutine invert_definite(a, inverse, definite)
      real(wp), intent(in) :: a(:, :)
      real(wp), intent(out) :: inverse(:, :)
      logical, intent(out) :: definite
      real(wp) :: unit(size(a, 1))
      integer :: j
      do j = 1, size(a, 1)
         unit = 0.0_wp
         unit(j) = 1.0_wp
         call solve_definite(size(a, 1), a, unit, inverse(:, j), definite)
         if (.not. definite) return
      end do
   end subroutine invert_definite

end module m_small_systems
