!> Grains as lines of text: an orientation, or x y z and an orientation, each.
module m_grain_lines
   use m_kinds, only: wp
   use m_grain_list, only: grain_list_t
   use m_number_text, only: read_real, number_good
   use m_text, only: to_text
   use m_text_lines, only: lines_t, with_decimal_points
   implicit none
   private
   public :: read_grain_lines

   integer, parameter :: widths(6) = [3, 4, 9, 6, 7, 12] !< the last three begin with a place
   integer, parameter :: max_width = 13

contains

   !> A line a grain; what follows # or ! is not read. `fault` says what is wrong; empty: nothing.
   subroutine read_grain_lines(bytes, list, fault)
      character(len=:), allocatable, intent(inout) :: bytes
      type(grain_list_t), intent(inout) :: list
      character(len=:), allocatable, intent(inout) :: fault
      type(lines_t) :: lines
      real(wp), allocatable :: rows(:, :), more(:, :)
      real(wp) :: row(max_width)
      integer :: n, width, count
      logical :: ok
      call with_decimal_points(bytes, fault)
      if (fault /= '') return
      allocate (rows(max_width, 64))
      width = 0
      count = 0
      do while (lines%next_line(bytes))
         call read_row(bytes, lines, row, n, ok)
         if (ok .and. n == 0) cycle
         if (width == 0) width = n
         if (.not. ok .or. n /= width .or. .not. any(width == widths)) then
            fault = 'line '//to_text(lines%line)//' of it must be an orientation (3 angles, or as angles '// &
                    'says 3, 4 or 9 numbers), or 3 coordinates and an orientation, as in all its lines'
            return
         end if
         if (count == size(rows, 2)) then
            allocate (more(max_width, 2*count))
            more(:, :count) = rows
            call move_alloc(more, rows)
         end if
         count = count + 1
         rows(:, count) = row
      end do
      if (count == 0) then
         fault = 'has no grains; allowed: a line each'
         return
      end if
      n = 0
      if (any(width == widths(4:))) n = 3
      list%numbers = width - n
      list%orientations = reshape(rows(n + 1:width, :count), [list%numbers*count])
      if (n > 0) list%positions = reshape(rows(:3, :count), [3*count])
   end subroutine read_grain_lines

   !> The numbers of a line, none where it is empty.
   subroutine read_row(bytes, lines, row, n, ok)
      character(len=*), intent(in) :: bytes
      type(lines_t), intent(inout) :: lines
      real(wp), intent(out) :: row(:)
      integer, intent(out) :: n
      logical, intent(out) :: ok
      integer :: at, to, status
      n = 0
      row = 0.0_wp
      ok = .true.
      do while (ok .and. lines%next_word(bytes, at, to))
         if (scan(bytes(at:at), '#!') > 0) exit
         if (scan(bytes(at:to), '#!') > 0) to = at + scan(bytes(at:to), '#!') - 2
         if (n < size(row)) n = n + 1
         call read_real(bytes(at:to), row(n), status)
         ok = status == number_good
         if (scan(bytes(to + 1:min(to + 1, len(bytes))), '#!') > 0) exit
      end do
   end subroutine read_row

end module m_grain_lines
