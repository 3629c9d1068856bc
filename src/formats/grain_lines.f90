!> Grains as lines of text: each an orientation, or x y z and an orientation; or named columns.
module m_grain_lines
   use m_kinds, only: wp
   use m_column_names, only: columns_t, read_columns, max_columns
   use m_grain_list, only: grain_list_t
   use m_length_units, only: length_unit, units_of_length
   use m_number_text, only: read_real, number_good
   use m_orientations, only: bunge_degrees, bunge_radians, rodrigues, quaternion, matrix
   use m_text, only: to_text
   use m_text_lines, only: lines_t, with_decimal_points, is_comment, comments
   use m_words, only: lower_case
   implicit none
   private
   public :: read_grain_lines

   integer, parameter :: widths(6) = [3, 4, 9, 6, 7, 12] !< the last three begin with a position
   integer, parameter :: max_width = 13
   !> Column names of orientations, one form a column of the array.
   character(len=16), parameter :: bunge_names(3, 5) = reshape([character(len=16) :: 'phi1', 'phi', 'phi2', &
      'euler1', 'euler2', 'euler3', 'eulerangles0', 'eulerangles1', 'eulerangles2', &
      'avgeulerangles0', 'avgeulerangles1', 'avgeulerangles2', 'e1', 'e2', 'e3'], [3, 5])
   character(len=2), parameter :: rodrigues_names(3, 2) = reshape([character(len=2) :: 'r1', &
      'r2', 'r3', 'rx', 'ry', 'rz'], [3, 2])
   character(len=2), parameter :: quaternion_names(4, 2) = reshape([character(len=2) :: 'q0', 'q1', 'q2', &
      'q3', 'qw', 'qx', 'qy', 'qz'], [4, 2])
   character(len=3), parameter :: matrix_names(9) = [character(len=3) :: 'g11', 'g12', 'g13', 'g21', 'g22', &
      'g23', 'g31', 'g32', 'g33']

contains

   !> A line a grain; text after #, ! or % is ignored. `fault` is a message; empty: no error.
   subroutine read_grain_lines(bytes, list, fault)
      character(len=:), allocatable, intent(inout) :: bytes
      type(grain_list_t), intent(inout) :: list
      character(len=:), allocatable, intent(inout) :: fault
      type(lines_t) :: lines
      real(wp), allocatable :: rows(:, :), more(:, :)
      type(columns_t) :: columns
      real(wp) :: row(max_columns), factor(3)
      integer, allocatable :: order(:)
      integer :: n, width, count
      logical :: ok
      call with_decimal_points(bytes, fault)
      if (fault /= '') return
      factor = 1.0_wp
      call read_columns(bytes, lines, columns, counted=.true.)
      if (columns%line > 0) call choose_columns(columns, order, factor, list, fault)
      if (fault /= '') return
      allocate (rows(max_width, 64))
      width = 0
      count = 0
      do while (lines%next_line(bytes))
         if (allocated(order) .and. columns%rows > 0 .and. count == columns%rows) exit ! other tables follow
         call read_row(bytes, lines, row, n, ok)
         if (ok .and. n == 0) cycle
         if (allocated(order)) then
            ok = ok .and. n == size(columns%name)
            if (ok) row(:size(order)) = row(order)
            n = size(order)
         end if
         if (width == 0) width = n
         if (.not. ok .and. allocated(order)) then
            fault = 'line '//to_text(lines%line)//' must be '//to_text(size(columns%name))// &
                    ' numbers, one for each column that line '//to_text(columns%line)//' names'
            return
         else if (.not. ok .or. n /= width .or. .not. any(width == widths)) then
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
         rows(:, count) = row(:max_width)
      end do
      if (count == 0) then
         fault = 'has no grains; allowed: a line each'
      else if (allocated(order) .and. count < columns%rows) then
         fault = 'has '//to_text(count)//' rows and says '//to_text(columns%rows)//' above its names'
      end if
      if (fault /= '') return
      n = 0
      if (any(width == widths(4:))) n = 3
      list%numbers = width - n
      list%orientations = reshape(rows(n + 1:width, :count), [list%numbers*count])
      if (n > 0) list%positions = reshape(spread(factor, 2, count)*rows(:3, :count), [3*count])
   end subroutine read_grain_lines

   !> Find the columns of position and orientation, their units, and the form of orientation that is named.
   subroutine choose_columns(columns, order, factor, list, fault)
      type(columns_t), intent(in) :: columns
      integer, allocatable, intent(out) :: order(:)
      real(wp), intent(inout) :: factor(3) !< m, units of x, y and z
      type(grain_list_t), intent(inout) :: list
      character(len=:), allocatable, intent(inout) :: fault
      integer, allocatable :: place(:)
      integer :: n
      place = [columns%find([character(len=10) :: 'x', 'xpos', 'posx', 'centroidx', 'centroids0']), &
               columns%find([character(len=10) :: 'y', 'ypos', 'posy', 'centroidy', 'centroids1']), &
               columns%find([character(len=10) :: 'z', 'zpos', 'posz', 'centroidz', 'centroids2'])]
      do n = 1, size(bunge_names, 2) + size(rodrigues_names, 2) + size(quaternion_names, 2) + 1
         if (n <= 5) then
            order = columns_of(columns, bunge_names(:, n))
            list%named = bunge_degrees
         else if (n <= 7) then
            order = columns_of(columns, rodrigues_names(:, n - 5))
            list%named = rodrigues
         else if (n <= 9) then
            order = columns_of(columns, quaternion_names(:, n - 7))
            list%named = quaternion
         else
            order = columns_of(columns, matrix_names)
            list%named = matrix
         end if
         if (all(order > 0)) exit
      end do
      if (.not. all(order > 0) .or. (any(place > 0) .and. any(place == 0))) then
         fault = columns%sentence('x y z or none of them, and phi1 Phi phi2, r1 r2 r3, qw qx qy qz or '// &
                                  'g11 to g33')
         return
      end if
      if (list%named == bunge_degrees) call take_unit_of_angles(columns, order, list, fault)
      if (all(place == 0)) return
      order = [place, order]
      call take_units_of_places(columns, place, factor, fault)
   end subroutine choose_columns

   !> Degrees or radians, the same for the three angles; no unit says nothing.
   subroutine take_unit_of_angles(columns, order, list, fault)
      type(columns_t), intent(in) :: columns
      integer, intent(in) :: order(3)
      type(grain_list_t), intent(inout) :: list
      character(len=:), allocatable, intent(inout) :: fault
      integer :: k, form(3)
      form = 0
      do k = 1, 3
         select case (lower_case(trim(columns%unit(order(k)))))
         case ('')
         case ('deg', 'degree', 'degrees', char(194)//char(176), char(176)); form(k) = bunge_degrees
         case ('rad', 'radian', 'radians'); form(k) = bunge_radians
         case default; form(k) = -1
         end select
      end do
      if (any(form < 0) .or. any(form /= form(1) .and. form > 0 .and. form(1) > 0)) then
         fault = columns%sentence('deg or rad as the unit of all three angles')
      else
         list%form = maxval(form)
      end if
   end subroutine take_unit_of_angles

   !> A unit for each of x, y and z. Columns without one take that of the others, if these have the same.
   subroutine take_units_of_places(columns, place, factor, fault)
      type(columns_t), intent(in) :: columns
      integer, intent(in) :: place(3)
      real(wp), intent(inout) :: factor(3)
      character(len=:), allocatable, intent(inout) :: fault
      logical :: given(3)
      real(wp) :: unit(3)
      integer :: k
      unit = [(length_unit(trim(columns%unit(place(k)))), k=1, 3)]
      given = columns%unit(place) /= ''
      if (.not. any(given)) return
      if (any(given .and. unit <= 0.0_wp)) then
         fault = columns%sentence(units_of_length//' as units of x, y and z')
      else if (.not. all(given) .and. minval(unit, mask=given) < maxval(unit)) then
         fault = columns%sentence('a unit for each of x, y and z, or none')
      else
         factor = merge(unit, maxval(unit), given)
      end if
   end subroutine take_units_of_places

   pure function columns_of(columns, names) result(order)
      type(columns_t), intent(in) :: columns
      character(len=*), intent(in) :: names(:)
      integer :: order(size(names)), n
      order = [(columns%find(names(n:n)), n=1, size(names))]
   end function columns_of

   !> The numbers of a line, none if it is empty.
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
         if (is_comment(bytes(at:at))) exit
         if (scan(bytes(at:to), comments) > 0) to = at + scan(bytes(at:to), comments) - 2
         if (n < size(row)) n = n + 1
         call read_real(bytes(at:to), row(n), status)
         ok = status == number_good
         if (scan(bytes(to + 1:min(to + 1, len(bytes))), comments) > 0) exit
      end do
   end subroutine read_row

end module m_grain_lines
