!> Sorting by keys.
module m_sorting
   use m_kinds, only: i8
   implicit none
   private
   public :: sorted_order

contains

   !> Permutation that sorts pairs (first, second) in rising order, first key first: bottom-up merge sort,
   !> stable.
   pure function sorted_order(first, second) result(order)
      integer(i8), intent(in) :: first(:), second(:) !< the same size
      integer :: order(size(first))
      integer :: other(size(first)), n, width, low, middle, high, a, b, k
      n = size(first)
      order = [(k, k=1, n)]
      width = 1
      do while (width < n)
         do low = 1, n, 2*width
            middle = min(low + width, n + 1)
            high = min(low + 2*width, n + 1)
            a = low
            b = middle
            do k = low, high - 1
               if (b >= high) then
                  other(k) = order(a); a = a + 1
               else if (a >= middle) then
                  other(k) = order(b); b = b + 1
               else if (precedes(order(b), order(a))) then
                  other(k) = order(b); b = b + 1
               else
                  other(k) = order(a); a = a + 1
               end if
            end do
         end do
         order = other
         width = 2*width
      end do
   contains
      !> Strictly before, by both keys.
      pure logical function precedes(i, j)
         integer, intent(in) :: i, j
         precedes = first(i) < first(j)
         if (first(i) == first(j)) precedes = second(i) < second(j)
      end function precedes
   end function sorted_order

end module m_sorting
