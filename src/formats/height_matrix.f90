!> Heights as a text matrix: a line a row (rows along y, numbers in a row along x). The comments that Gwyddion
!> writes before it give its width and unit.
module m_height_matrix
   use m_kinds, only: wp
   use m_height_map, only: height_map_t, row_at_top
   use m_length_units, only: length_unit, units_of_length
   use m_number_text, only: read_real, number_good
   use m_text, only: to_text
   use m_text_lines, only: rows_t
   implicit none
   private
   public :: take_matrix

   integer, parameter :: max_narrow = 64 !< maximum number of rows of a map of width three
   integer, parameter :: min_numbered = 5 !< lines from which a list may be numbered

contains

   !> Rows of equal width as a map.
   subroutine take_matrix(rows, map, fault)
      type(rows_t), intent(in) :: rows
      type(height_map_t), intent(inout) :: map
      character(len=:), allocatable, intent(inout) :: fault
      integer :: r
      do r = 2, size(rows%width)
         if (rows%width(r) == rows%width(1)) cycle
         fault = 'line '//to_text(rows%line(r))//': has '//to_text(rows%width(r))// &
                 ' numbers, the first row '//to_text(rows%width(1))
         return
      end do
      if (size(rows%width) > max_narrow .and. rows%width(1) == 3) then
         fault = 'holds '//to_text(size(rows%width))//' lines of three numbers whose first two are no '// &
                 'places of a complete grid; allowed: a line a row of heights, or lines x y z, one for '// &
                 'each place of a grid along x and y'
         return
      end if
      if (are_numbered(rows)) then
         fault = 'numbers its lines in the first column, as lists of nodes and points do; allowed: a '// &
                 'line a row of heights, or lines x y z'
         return
      end if
      map%height = reshape(rows%value, [rows%width(1), size(rows%width)])
      call take_header(rows%header, map, fault)
   end subroutine take_matrix

   !> True when the first column numbers the lines: it counts up while the others are not all integers.
   pure logical function are_numbered(rows)
      type(rows_t), intent(in) :: rows
      integer :: n, width
      width = rows%width(1)
      are_numbered = .false.
      if (size(rows%width) < min_numbered .or. width < 3) return
      associate (first => rows%value(1::width))
         are_numbered = any(abs(first(1) - [0.0_wp, 1.0_wp]) <= 0.0_wp) .and. &
                        all(abs(first - first(1) - [(real(n, wp), n=0, size(first) - 1)]) <= 0.0_wp) .and. &
                        any(abs(rows%value - anint(rows%value)) > 0.0_wp)
      end associate
   end function are_numbered

   !> `# Width: 5.00 um`, `# Height: 5.00 um`, `# Value units: m`: then the first row is the top of the
   !> picture, and widths are those of all pixels.
   subroutine take_header(header, map, fault)
      character(len=*), intent(in) :: header
      type(height_map_t), intent(inout) :: map
      character(len=:), allocatable, intent(inout) :: fault
      real(wp) :: extent(2), unit
      integer :: axis
      character(len=:), allocatable :: text
      extent = 0.0_wp
      do axis = 1, 2
         text = said(header, merge('# Width:  ', '# Height: ', axis == 1))
         if (text == '') return
         call read_length(text, extent(axis), fault)
         if (fault /= '') return
      end do
      map%first_row = row_at_top
      map%spacing = extent/shape(map%height)
      map%spacing_in_m = .true.
      text = said(header, '# Value units:')
      if (text == '') return
      unit = length_unit(text)
      map%scale = unit
      if (.not. unit > 0.0_wp) fault = 'says its values are in '''//text// &
         ''', which is no length; allowed: heights in '//units_of_length
   end subroutine take_header

   !> The text after a word of a header, to the end of the line; empty if absent.
   pure function said(header, word) result(text)
      character(len=*), intent(in) :: header, word
      character(len=:), allocatable :: text
      integer :: at, length
      text = ''
      at = index(header, trim(word))
      if (at == 0) return
      at = at + len_trim(word)
      length = scan(header(at:)//new_line('a'), new_line('a')//achar(13)) - 1
      text = trim(adjustl(header(at:at + length - 1)))
   end function said

   !> Read a number with its unit, in m.
   subroutine read_length(text, length, fault)
      character(len=*), intent(in) :: text
      real(wp), intent(out) :: length
      character(len=:), allocatable, intent(inout) :: fault
      character(len=len(text)) :: plain
      real(wp) :: unit
      integer :: at, status, comma
      plain = text
      comma = index(plain, ',')
      if (comma > 0) plain(comma:comma) = '.'
      at = index(plain, ' ')
      unit = 0.0_wp
      status = 1
      length = 0.0_wp
      if (at > 1) call read_real(plain(:at - 1), length, status)
      if (at > 1) unit = length_unit(trim(adjustl(plain(at:))))
      if (status /= number_good .or. .not. (unit > 0.0_wp .and. length > 0.0_wp)) &
         fault = 'has a header with the extent '''//text// &
                 '''; allowed: a number above 0 and '//units_of_length
      length = length*unit
   end subroutine read_length

end module m_height_matrix
