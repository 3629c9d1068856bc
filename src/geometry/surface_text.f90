!> What the bytes of a surface's file say: triangles of an STL (binary or text) or OBJ file, or the heights of
!> a grid as text. No file is opened here.
module m_surface_text
   use, intrinsic :: iso_fortran_env, only: int32, real32
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use m_kinds, only: wp, i8
   use m_number_text, only: read_real, read_integer, number_good, find_decimal_comma
   use m_text, only: to_text
   use m_words, only: lower_case
   use m_polygons, only: cut_ears
   implicit none
   private
   public :: read_triangles, read_heights, is_heights

   integer, parameter :: header = 80, first_triangle = 85, triangle_bytes = 50 !< of a binary STL file
   integer, parameter :: max_words = 64      !< of a line of an OBJ file
   integer, parameter :: max_triangles = 20000000

   !> Goes through a text line by line, and through a line word by word.
   type :: lines_t
      integer :: at = 1     !< where the next line begins
      integer :: first = 1, last = 0 !< of the present line, without its end
      integer :: line = 0   !< its number
   contains
      procedure :: next_line
      procedure :: next_word
   end type lines_t

   !> Corners and triangles while their number is not known.
   type :: growing_t
      integer :: corners = 0, triangles = 0
      real(wp), allocatable :: place(:, :)
      integer, allocatable :: of(:, :)
   contains
      procedure :: add_corner
      procedure :: add_triangle
   end type growing_t

contains

   !> Corners (as they stand, so with doubles) and triangles. `fault` says what is wrong; empty: nothing.
   subroutine read_triangles(bytes, place, of, fault)
      character(len=*), intent(in) :: bytes
      real(wp), allocatable, intent(out) :: place(:, :) !< (3, corners), in the unit of the file
      integer, allocatable, intent(out) :: of(:, :)     !< (3, triangles)
      character(len=:), allocatable, intent(out) :: fault
      type(growing_t) :: found
      fault = ''
      allocate (found%place(3, 1024), found%of(3, 1024))
      if (is_binary(bytes)) then
         call read_binary(bytes, found, fault)
      else if (index(adjustl(lower_case(bytes(:min(200, len(bytes))))), 'solid') == 1) then
         call read_text(bytes, found, fault)
      else if (is_obj(bytes)) then
         call read_obj(bytes, found, fault)
      else
         fault = 'is no STL (binary or text) and no OBJ file'
      end if
      if (fault == '' .and. found%triangles == 0) fault = 'has no triangles'
      place = found%place(:, :found%corners)
      of = found%of(:, :found%triangles)
   end subroutine read_triangles

   !> A binary STL file has no line that begins with `facet` after its first one; what it says of its length
   !> need not be true.
   pure logical function is_binary(bytes)
      character(len=*), intent(in) :: bytes
      integer :: n
      is_binary = .false.
      if (len(bytes) < first_triangle - 1) return
      if (int(triangles_said(bytes), i8)*triangle_bytes + first_triangle - 1 == len(bytes)) then
         is_binary = .true.
         return
      end if
      do n = 1, min(len(bytes), 1000)
         associate (code => iachar(bytes(n:n)))
            if (code < 9 .or. (code > 13 .and. code < 32)) is_binary = .true.
         end associate
      end do
      if (bytes(:4) == achar(137)//'HDF') is_binary = .false.
   end function is_binary

   pure integer function triangles_said(bytes)
      character(len=*), intent(in) :: bytes
      triangles_said = int(transfer(bytes(header + 1:header + 4), 0_int32))
   end function triangles_said

   pure subroutine read_binary(bytes, found, fault)
      character(len=*), intent(in) :: bytes
      type(growing_t), intent(inout) :: found
      character(len=:), allocatable, intent(inout) :: fault
      integer :: n, t, k, first
      real(real32) :: values(9)
      n = triangles_said(bytes)
      if (n < 0 .or. n > max_triangles) then
         fault = 'says it has '//to_text(iand(int(n, i8), 4294967295_i8))//' triangles; allowed: 1 to '// &
                 to_text(max_triangles)
      else if (int(n, i8)*triangle_bytes + first_triangle - 1 /= len(bytes)) then
         fault = 'says it has '//to_text(n)//' triangles, which are '// &
                 to_text(int(n, i8)*triangle_bytes + first_triangle - 1)// &
                 ' bytes of a binary STL file; it has '//to_text(len(bytes))
      end if
      if (fault /= '') return
      do t = 1, n
         first = first_triangle + triangle_bytes*(t - 1) + 12 ! after the normal, which corners give
         values = transfer(bytes(first:first + 35), values)
         if (.not. all(ieee_is_finite(values))) then
            fault = 'has a corner of triangle '//to_text(t)//' that is not a finite number'
            return
         end if
         do k = 1, 3
            call found%add_corner(real(values(3*k - 2:3*k), wp))
         end do
         call found%add_triangle([3*t - 2, 3*t - 1, 3*t])
      end do
   end subroutine read_binary

   !> `vertex x y z`, three to a facet.
   subroutine read_text(bytes, found, fault)
      character(len=*), intent(in) :: bytes
      type(growing_t), intent(inout) :: found
      character(len=:), allocatable, intent(inout) :: fault
      type(lines_t) :: lines
      real(wp) :: corner(3)
      integer :: at, to, in_facet
      logical :: ended
      in_facet = 0
      ended = .false.
      do while (lines%next_line(bytes))
         if (.not. lines%next_word(bytes, at, to)) cycle
         select case (lower_case(bytes(at:to)))
         case ('vertex')
            call read_corner(bytes, lines, corner, fault)
            if (fault /= '') return
            call found%add_corner(corner)
            in_facet = in_facet + 1
         case ('endfacet')
            if (in_facet /= 3) then
               fault = 'line '//to_text(lines%line)//': a facet has '//to_text(in_facet)// &
                       ' corners; allowed: 3'
               return
            end if
            call found%add_triangle(found%corners + [-2, -1, 0])
            in_facet = 0
         case ('endsolid')
            ended = .true.
         case ('solid', 'facet', 'outer', 'endloop')
         case default
            fault = 'line '//to_text(lines%line)//': unknown word '''// &
                    bytes(at:min(to, at + 19))//'''; allowed: those of an STL file'
            return
         end select
      end do
      if (in_facet /= 0 .or. .not. ended) fault = 'ends within its triangles: the last line must be endsolid'
   end subroutine read_text

   !> A comma parts numbers, and so 1,5 would be two.
   subroutine refuse_decimal_comma(bytes, lines, fault)
      character(len=*), intent(in) :: bytes
      type(lines_t), intent(in) :: lines
      character(len=:), allocatable, intent(inout) :: fault
      integer :: at, to
      associate (line => bytes(lines%first:lines%last))
         call find_decimal_comma(line, at, to)
         if (at > 0) fault = 'line '//to_text(lines%line)//': '''//line(at:to)// &
                             ''' has a decimal comma; allowed: decimal points'
      end associate
   end subroutine refuse_decimal_comma

   !> The three numbers that follow in a line.
   subroutine read_corner(bytes, lines, corner, fault)
      character(len=*), intent(in) :: bytes
      type(lines_t), intent(inout) :: lines
      real(wp), intent(out) :: corner(3)
      character(len=:), allocatable, intent(inout) :: fault
      integer :: k, at, to, status
      corner = 0.0_wp
      call refuse_decimal_comma(bytes, lines, fault)
      if (fault /= '') return
      do k = 1, 3
         status = 1
         if (lines%next_word(bytes, at, to)) call read_real(bytes(at:to), corner(k), status)
         if (status == number_good) cycle
         fault = 'line '//to_text(lines%line)//': must have three numbers'
         return
      end do
   end subroutine read_corner

   !> An OBJ file has a line that begins with `v`, and before it only comments and words that it may have.
   logical function is_obj(bytes)
      character(len=*), intent(in) :: bytes
      type(lines_t) :: lines
      integer :: at, to
      is_obj = .false.
      do while (lines%next_line(bytes))
         if (.not. lines%next_word(bytes, at, to)) cycle
         is_obj = bytes(at:to) == 'v'
         if (is_obj) return
         if (bytes(at:at) == '#') cycle
         select case (bytes(at:to))
         case ('mtllib', 'usemtl', 'o', 'g', 's')
         case default
            return
         end select
      end do
   end function is_obj

   !> `v x y z` and `f a b c ...` (as a, a/t, a/t/n or a//n; negative numbers count from the last one).
   subroutine read_obj(bytes, found, fault)
      character(len=*), intent(in) :: bytes
      type(growing_t), intent(inout) :: found
      character(len=:), allocatable, intent(inout) :: fault
      type(lines_t) :: lines
      real(wp) :: corner(3)
      integer :: at, to, k, corners, number(max_words), triangle(3, max_words), slash
      logical :: good
      do while (lines%next_line(bytes))
         if (.not. lines%next_word(bytes, at, to)) cycle
         if (bytes(at:to) == 'v') then
            call read_corner(bytes, lines, corner, fault)
            if (fault /= '') return
            call found%add_corner(corner)
         else if (bytes(at:to) == 'f') then
            corners = 0
            do while (lines%next_word(bytes, at, to))
               slash = index(bytes(at:to), '/')
               if (slash > 0) to = at + slash - 2
               corners = corners + 1
               good = corners <= max_words
               if (good) call read_integer(bytes(at:to), number(corners), good)
               if (good .and. number(corners) < 0) number(corners) = found%corners + 1 + number(corners)
               if (good) good = number(corners) >= 1 .and. number(corners) <= found%corners
               if (good) cycle
               fault = 'line '//to_text(lines%line)//': '''//bytes(at:min(to, at + 19))// &
                       ''' is no number of a corner above'
               if (corners > max_words) fault = 'line '//to_text(lines%line)//': a face has more than '// &
                                                 to_text(max_words)//' corners'
               return
            end do
            if (corners < 3) cycle ! a line or a point has no surface
            call cut_ears(found%place(:, number(:corners)), triangle(:, :corners - 2), good)
            if (.not. good) then
               fault = 'line '//to_text(lines%line)//': the face crosses itself'
               return
            end if
            do k = 1, corners - 2
               call found%add_triangle(number(triangle(:, k)))
            end do
         end if
      end do
   end subroutine read_obj

   !> True of a text whose first line that is no comment begins with a number.
   logical function is_heights(bytes)
      character(len=*), intent(in) :: bytes
      type(lines_t) :: lines
      real(wp) :: value
      integer :: at, to, status
      is_heights = .false.
      do while (lines%next_line(bytes))
         if (.not. lines%next_word(bytes, at, to)) cycle
         if (bytes(at:at) == '#') cycle
         call read_real(bytes(at:to), value, status)
         is_heights = status == number_good
         return
      end do
   end function is_heights

   !> A matrix of heights: a line a row (rows follow each other along y, numbers in a row along x), # begins a
   !> comment.
   subroutine read_heights(bytes, height, fault)
      character(len=*), intent(in) :: bytes
      real(wp), allocatable, intent(out) :: height(:, :) !< (along x, along y)
      character(len=:), allocatable, intent(out) :: fault
      type(lines_t) :: lines
      real(wp), allocatable :: all_of_them(:), more(:)
      integer :: at, to, status, columns, rows, n, in_row
      fault = ''
      columns = 0
      rows = 0
      n = 0
      allocate (all_of_them(4096))
      do while (lines%next_line(bytes))
         in_row = 0
         call refuse_decimal_comma(bytes, lines, fault)
         if (fault /= '') return
         do while (lines%next_word(bytes, at, to))
            if (bytes(at:at) == '#') exit
            if (n == size(all_of_them)) then
               allocate (more(2*n))
               more(:n) = all_of_them
               call move_alloc(more, all_of_them)
            end if
            n = n + 1
            in_row = in_row + 1
            call read_real(bytes(at:to), all_of_them(n), status)
            if (status == number_good) cycle
            fault = 'line '//to_text(lines%line)//': '''//bytes(at:min(to, at + 19))//''' is no number'
            return
         end do
         if (in_row == 0) cycle
         rows = rows + 1
         if (rows == 1) columns = in_row
         if (in_row == columns) cycle
         fault = 'line '//to_text(lines%line)//': has '//to_text(in_row)//' numbers, the first row '// &
                 to_text(columns)
         return
      end do
      allocate (height(columns, rows))
      height = reshape(all_of_them(:n), [columns, rows])
   end subroutine read_heights

   !> Step to the next line; false where there is none.
   logical function next_line(self, bytes)
      class(lines_t), intent(inout) :: self
      character(len=*), intent(in) :: bytes
      integer :: length
      next_line = self%at <= len(bytes)
      if (.not. next_line) return
      self%line = self%line + 1
      self%first = self%at
      length = index(bytes(self%at:), new_line('a')) - 1
      if (length < 0) length = len(bytes) - self%at + 1
      self%last = self%at + length - 1
      self%at = self%at + length + 1
   end function next_line

   !> Step to the next word of the line, which blanks, tabs and commas end.
   logical function next_word(self, bytes, at, to)
      class(lines_t), intent(inout) :: self
      character(len=*), intent(in) :: bytes
      integer, intent(out) :: at, to !< where it begins and ends
      at = self%first
      do while (at <= self%last)
         if (.not. is_blank(bytes(at:at))) exit
         at = at + 1
      end do
      next_word = at <= self%last
      to = at - 1
      do while (to < self%last)
         if (is_blank(bytes(to + 1:to + 1))) exit
         to = to + 1
      end do
      self%first = to + 1
   end function next_word

   pure logical function is_blank(letter)
      character(len=1), intent(in) :: letter
      is_blank = letter == ' ' .or. letter == ',' .or. letter == ';' .or. letter == achar(9) &
                 .or. letter == achar(13)
   end function is_blank

   pure subroutine add_corner(self, place)
      class(growing_t), intent(inout) :: self
      real(wp), intent(in) :: place(3)
      real(wp), allocatable :: more(:, :)
      if (self%corners == size(self%place, 2)) then
         allocate (more(3, 2*self%corners))
         more(:, :self%corners) = self%place
         call move_alloc(more, self%place)
      end if
      self%corners = self%corners + 1
      self%place(:, self%corners) = place
   end subroutine add_corner

   pure subroutine add_triangle(self, corners)
      class(growing_t), intent(inout) :: self
      integer, intent(in) :: corners(3)
      integer, allocatable :: more(:, :)
      if (self%triangles == size(self%of, 2)) then
         allocate (more(3, 2*self%triangles))
         more(:, :self%triangles) = self%of
         call move_alloc(more, self%of)
      end if
      self%triangles = self%triangles + 1
      self%of(:, self%triangles) = corners
   end subroutine add_triangle

end module m_surface_text
