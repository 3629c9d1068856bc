!> Columns of particles into the cache ahead of their use. A block's particles lie in some 25 columns: too many streams for the
!> hardware's own prefetching. The Makefile compiles this file with the compiler's prefetching of loops switched on: then the
!> loop below asks for a line some 200 particles ahead each time it reads one. Without that it only reads.
module m_prefetch
   use m_kinds, only: wp
   implicit none
   private
   public :: prefetch_columns

   integer, parameter :: line = 8 !< values in a cache line

contains

   !> Read one value a cache line of rows first..last of all columns. `sum` is their sum, of no meaning.
   pure subroutine prefetch_columns(column, first, last, sum)
      real(wp), intent(in), contiguous :: column(:, :)
      integer, intent(in) :: first, last
      real(wp), intent(inout) :: sum
      integer :: c, p
      do c = 1, size(column, 2)
         do p = first, last, line
            sum = sum + column(p, c)
         end do
      end do
   end subroutine prefetch_columns

end module m_prefetch
