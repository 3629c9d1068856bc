!> OBJ files (Wavefront) from their bytes: `v` and `f` lines; others are skipped.
module m_obj_file
   use m_kinds, only: wp
   use m_number_text, only: read_integer
   use m_polygons, only: cut_ears
   use m_stl_file, only: read_corner
   use m_text, only: to_text
   use m_text_lines, only: lines_t
   use m_triangle_list, only: triangle_list_t
   implicit none
   private
   public :: is_obj, read_obj

   integer, parameter :: max_words = 64 !< per face

contains

   !> An OBJ file has a line that begins with `v`, and before it only comments and other keywords of OBJ.
   logical function is_obj(bytes)
      character(len=*), intent(in) :: bytes
      type(lines_t) :: lines
      integer :: at, to
      is_obj = .false.
      lines%joins = .true.
      do while (lines%next_line(bytes))
         if (.not. lines%next_word(bytes, at, to)) cycle
         is_obj = bytes(at:to) == 'v'
         if (is_obj) return
         if (bytes(at:at) == '#') cycle
         select case (bytes(at:to))
         case ('mtllib', 'usemtl', 'o', 'g', 's', 'vn', 'vt', 'vp', 'l', 'p', 'f')
         case default
            return
         end select
      end do
   end function is_obj

   !> `v x y z` and `f a b c ...` (as a, a/t, a/t/n or a//n; negative numbers count from the last `v` above).
   !> Faces may stand above their corners: these are read first.
   subroutine read_obj(bytes, found, fault)
      character(len=*), intent(in) :: bytes
      type(triangle_list_t), intent(inout) :: found
      character(len=:), allocatable, intent(inout) :: fault
      type(lines_t) :: lines
      real(wp) :: corner(3)
      integer :: at, to, above
      lines%joins = .true.
      do while (lines%next_line(bytes) .and. fault == '')
         if (.not. lines%next_word(bytes, at, to)) cycle
         if (bytes(at:to) /= 'v') cycle
         call read_corner(bytes, lines, corner, fault)
         if (fault == '') call found%add_corner(corner)
      end do
      lines = lines_t(joins=.true.)
      above = 0
      do while (lines%next_line(bytes) .and. fault == '')
         if (.not. lines%next_word(bytes, at, to)) cycle
         if (bytes(at:to) == 'v') above = above + 1
         if (bytes(at:to) == 'f') call read_face(bytes, lines, above, found, fault)
      end do
   end subroutine read_obj

   !> The rest of an `f` line.
   subroutine read_face(bytes, lines, above, found, fault)
      character(len=*), intent(in) :: bytes
      type(lines_t), intent(inout) :: lines
      integer, intent(in) :: above !< number of `v` lines above it
      type(triangle_list_t), intent(inout) :: found
      character(len=:), allocatable, intent(inout) :: fault
      integer :: at, to, k, corners, number(max_words), triangle(3, max_words), slash
      logical :: good
      corners = 0
      do while (lines%next_word(bytes, at, to))
         if (bytes(at:at) == '#') exit
         slash = index(bytes(at:to), '/')
         if (slash > 0) to = at + slash - 2
         corners = corners + 1
         good = corners <= max_words
         if (good) call read_integer(bytes(at:to), number(corners), good)
         if (good .and. number(corners) < 0) number(corners) = above + 1 + number(corners)
         if (good) good = number(corners) >= 1 .and. number(corners) <= found%corners
         if (good) cycle
         fault = 'line '//to_text(lines%line)//': '''//bytes(at:min(to, at + 19))// &
                 ''' is not the number of a vertex; allowed: 1 to '//to_text(found%corners)
         if (above > 0) fault = fault//', or -1 to -'//to_text(above)//' for those above'
         if (corners > max_words) fault = 'line '//to_text(lines%line)//': a face has more than '// &
                                           to_text(max_words)//' corners'
         return
      end do
      if (corners < 3) return ! a line or a point has no area
      call cut_ears(found%place(:, number(:corners)), triangle(:, :corners - 2), good)
      if (.not. good) then
         fault = 'line '//to_text(lines%line)//': the face intersects itself'
         return
      end if
      do k = 1, corners - 2
         call found%add_triangle(number(triangle(:, k)))
      end do
   end subroutine read_face

end module m_obj_file
