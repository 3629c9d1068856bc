!> Grids of heights with a header: ESRI's ASCII grid (`ncols 4 ...`) and Surfer's (`DSAA`).
module m_height_grids
   use m_kinds, only: wp
   use m_height_map, only: height_map_t, row_at_bottom, row_at_top
   use m_number_text, only: read_real, number_good
   use m_text, only: to_text
   use m_text_lines, only: lines_t, rows_t, read_rows
   use m_words, only: lower_case
   implicit none
   private
   public :: is_esri_grid, is_surfer_grid, read_esri_grid, read_surfer_grid

   real(wp), parameter :: surfer_blank = 1.0e38_wp !< larger values are missing ones
   character(len=12), parameter :: esri_words(9) = [character(len=12) :: 'ncols', 'nrows', 'cellsize', &
      'nodata_value', 'xllcorner', 'yllcorner', 'xllcenter', 'yllcenter', 'dx']

contains

   pure logical function is_esri_grid(bytes)
      character(len=*), intent(in) :: bytes
      character(len=min(len(bytes), 64)) :: head
      head = adjustl(lower_case(bytes(:len(head))))
      is_esri_grid = index(head, 'ncols') == 1 .or. index(head, 'nrows') == 1
   end function is_esri_grid

   pure logical function is_surfer_grid(bytes)
      character(len=*), intent(in) :: bytes
      is_surfer_grid = index(bytes, 'DSAA') == 1
   end function is_surfer_grid

   !> Keywords and their values, then the rows from the north (the top) on.
   subroutine read_esri_grid(bytes, map, fault)
      character(len=*), intent(in) :: bytes
      type(height_map_t), intent(inout) :: map
      character(len=:), allocatable, intent(inout) :: fault
      type(lines_t) :: lines, before
      real(wp) :: value(9)
      logical :: given(9)
      integer :: at, to, word, status
      given = .false.
      value = 0.0_wp
      before = lines
      do while (lines%next_line(bytes))
         if (.not. lines%next_word(bytes, at, to)) cycle
         word = findloc(esri_words == lower_case(bytes(at:to)), .true., dim=1)
         if (word == 0) exit
         status = 1
         if (lines%next_word(bytes, at, to)) call read_real(bytes(at:to), value(word), status)
         given(word) = .true.
         if (status /= number_good) then
            fault = 'line '//to_text(lines%line)//': '//trim(esri_words(word))//' must have a number'
            return
         end if
         before = lines
      end do
      if (.not. all(given(1:3))) then
         fault = 'begins as an ESRI grid and lacks one of ncols, nrows, cellsize'
         return
      end if
      call take_values(bytes, before, value(1:2), map, fault)
      if (fault /= '') return
      map%spacing = value(3)
      map%first_row = row_at_top
      if (.not. value(3) > 0.0_wp) fault = 'has a cellsize of '//to_text(value(3))//'; allowed: above 0'
      if (given(4)) call refuse_blanks(abs(map%height - value(4)) <= 0.0_wp, map%height, fault)
   end subroutine read_esri_grid

   !> DSAA, numbers of points along x and y, ranges of x, y and z, then the rows from the bottom on.
   subroutine read_surfer_grid(bytes, map, fault)
      character(len=*), intent(in) :: bytes
      type(height_map_t), intent(inout) :: map
      character(len=:), allocatable, intent(inout) :: fault
      type(lines_t) :: lines
      real(wp) :: value(8)
      integer :: at, to, n, status
      n = 0
      if (lines%next_line(bytes)) continue ! DSAA
      do while (n < 8)
         if (.not. lines%next_line(bytes)) exit
         do while (lines%next_word(bytes, at, to))
            n = n + 1
            status = 1
            if (n <= 8) call read_real(bytes(at:to), value(n), status)
            if (status == number_good) cycle
            fault = 'line '//to_text(lines%line)//': '''//bytes(at:min(to, at + 19))// &
                    ''' does not belong into the header of a Surfer grid'
            return
         end do
      end do
      if (n < 8) then
         fault = 'ends within the header of a Surfer grid'
         return
      end if
      call take_values(bytes, lines, value(1:2), map, fault)
      if (fault /= '') return
      map%spacing = [value(4) - value(3), value(6) - value(5)]/max(1.0_wp, value(1:2) - 1.0_wp)
      map%first_row = row_at_bottom
      if (.not. all(map%spacing > 0.0_wp)) fault = 'is a Surfer grid that has no extent along x or y'
      call refuse_blanks(map%height >= surfer_blank, map%height, fault)
   end subroutine read_surfer_grid

   !> The numbers after a header, as many as it declares; lines may break anywhere.
   subroutine take_values(bytes, lines, counts, map, fault)
      character(len=*), intent(in) :: bytes
      type(lines_t), intent(in) :: lines
      real(wp), intent(in) :: counts(2)
      type(height_map_t), intent(inout) :: map
      character(len=:), allocatable, intent(inout) :: fault
      type(rows_t) :: rows
      call read_rows(bytes, lines, rows, fault)
      if (fault /= '') return
      if (any(counts < 1.0_wp) .or. any(abs(counts - anint(counts)) > 0.0_wp) &
          .or. abs(product(counts) - size(rows%value)) > 0.0_wp) then
         fault = 'says it has '//to_text(counts(1))//' by '//to_text(counts(2))//' heights; it has '// &
                 to_text(size(rows%value))
         return
      end if
      map%height = reshape(rows%value, nint(counts))
   end subroutine take_values

   subroutine refuse_blanks(blank, height, fault)
      logical, intent(in) :: blank(:, :)
      real(wp), intent(in) :: height(:, :)
      character(len=:), allocatable, intent(inout) :: fault
      integer :: at(2)
      if (fault /= '' .or. .not. any(blank)) return
      at = findloc(blank, .true.)
      fault = 'holds '//to_text(height(at(1), at(2)))//' at place '//to_text(at(1))//' of row '// &
              to_text(at(2))//' ('//to_text(count(blank))//' in all), which marks a missing value. Fill '// &
                 'it by its neighbours'
   end subroutine refuse_blanks

end module m_height_grids
