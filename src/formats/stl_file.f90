!> STL files, binary and text, from their bytes.
module m_stl_file
   use, intrinsic :: iso_fortran_env, only: int32, real32
   use m_kinds, only: wp, i8
   use m_number_text, only: read_real, number_good, find_decimal_comma
   use m_text, only: to_text
   use m_text_lines, only: lines_t
   use m_triangle_list, only: triangle_list_t, max_triangles
   use m_words, only: lower_case
   implicit none
   private
   public :: is_binary_stl, is_text_stl, may_be_stl, read_binary_stl, read_text_stl, read_corner

   integer, parameter :: header = 80, first_triangle = 85, triangle_bytes = 50 !< of a binary STL file
   integer, parameter :: looked_at = 1000 !< bytes used to detect the kind

contains

   !> True when it begins with `solid`, and is text up to its first facet or its end.
   pure logical function is_text_stl(bytes)
      character(len=*), intent(in) :: bytes
      character(len=min(len(bytes), looked_at)) :: head
      integer :: first
      head = adjustl(lower_case(bytes(:len(head))))
      first = max(index(head, 'facet'), index(head, 'endsolid'))
      if (index(head, 'facet') > 0 .and. index(head, 'endsolid') > 0) &
         first = min(index(head, 'facet'), index(head, 'endsolid'))
      is_text_stl = index(head, 'solid') == 1 .and. first > 0 .and. .not. has_controls(head(:max(first, 0)))
   end function is_text_stl

   !> True when the length of a binary STL file matches its number of triangles.
   pure logical function is_binary_stl(bytes)
      character(len=*), intent(in) :: bytes
      is_binary_stl = .false.
      if (len(bytes) < first_triangle - 1) return
      is_binary_stl = int(triangles_said(bytes), i8)*triangle_bytes + first_triangle - 1 == len(bytes)
   end function is_binary_stl

   !> True for a file that is not text, at least as long as the header of a binary STL file; its number of
   !> triangles may be wrong.
   pure logical function may_be_stl(bytes)
      character(len=*), intent(in) :: bytes
      may_be_stl = len(bytes) >= first_triangle - 1 .and. has_controls(bytes(:min(len(bytes), looked_at)))
   end function may_be_stl

   pure logical function has_controls(bytes)
      character(len=*), intent(in) :: bytes
      integer :: n
      has_controls = any([(iachar(bytes(n:n)) < 9 .or. (iachar(bytes(n:n)) > 13 &
                                                          .and. iachar(bytes(n:n)) < 32), n=1, len(bytes))])
   end function has_controls

   pure integer function triangles_said(bytes)
      character(len=*), intent(in) :: bytes
      triangles_said = int(transfer(bytes(header + 1:header + 4), 0_int32))
   end function triangles_said

   !> Bytes after the triangles are ignored if they are fewer than those of the triangles: some programs
   !> append data.
   pure subroutine read_binary_stl(bytes, found, fault)
      character(len=*), intent(in) :: bytes
      type(triangle_list_t), intent(inout) :: found
      character(len=:), allocatable, intent(inout) :: fault
      integer(i8) :: needed
      integer :: n, t, k, first
      integer(int32), parameter :: exponent = int(z'7F800000', int32) !< all of its bits: not a finite number
      real(real32) :: values(9)
      integer(int32) :: bits(9)
      n = triangles_said(bytes)
      needed = int(n, i8)*triangle_bytes + first_triangle - 1
      if (n < 0 .or. n > max_triangles) then
         fault = 'says it has '//to_text(iand(int(n, i8), 4294967295_i8))//' triangles; allowed: 1 to '// &
                 to_text(max_triangles)
      else if (needed > len(bytes) .or. 2*needed <= len(bytes)) then
         fault = 'says it has '//to_text(n)//' triangles, which are '//to_text(needed)// &
                 ' bytes of a binary STL file; it has '//to_text(len(bytes))
      end if
      if (fault /= '') return
      do t = 1, n
         first = first_triangle + triangle_bytes*(t - 1) + 12 ! skip the normal, which the corners determine
         bits = transfer(bytes(first:first + 35), bits)
         if (any(iand(bits, exponent) == exponent)) then
            fault = 'has a corner of triangle '//to_text(t)//' that is not a finite number'
            return
         end if
         values = transfer(bits, values)
         do k = 1, 3
            call found%add_corner(real(values(3*k - 2:3*k), wp))
         end do
         call found%add_triangle([3*t - 2, 3*t - 1, 3*t])
      end do
   end subroutine read_binary_stl

   !> `vertex x y z`, three to a facet; any number of solids.
   subroutine read_text_stl(bytes, found, fault)
      character(len=*), intent(in) :: bytes
      type(triangle_list_t), intent(inout) :: found
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
            if (bytes(at:at) == '#') cycle
            fault = 'line '//to_text(lines%line)//': unknown word '''// &
                    bytes(at:min(to, at + 19))//'''; allowed: those of an STL file'
            return
         end select
      end do
      if (in_facet /= 0 .or. .not. ended) fault = 'ends within its triangles: the last line must be endsolid'
   end subroutine read_text_stl

   !> The next three numbers of a line, of an STL or OBJ file. A comma separates numbers, so 1,5 would be two.
   subroutine read_corner(bytes, lines, corner, fault)
      character(len=*), intent(in) :: bytes
      type(lines_t), intent(inout) :: lines
      real(wp), intent(out) :: corner(3)
      character(len=:), allocatable, intent(inout) :: fault
      integer :: k, at, to, status
      corner = 0.0_wp
      associate (line => bytes(lines%first:lines%last))
         call find_decimal_comma(line, at, to)
         if (at > 0) fault = 'line '//to_text(lines%line)//': '''//line(at:to)// &
                             ''' has a decimal comma; allowed: decimal points'
      end associate
      if (fault /= '') return
      do k = 1, 3
         status = 1
         if (lines%next_word(bytes, at, to)) call read_real(bytes(at:to), corner(k), status)
         if (status == number_good) cycle
         fault = 'line '//to_text(lines%line)//': must have three numbers'
         return
      end do
   end subroutine read_corner

end module m_stl_file
