!> The kind of surface in the bytes of a file, and its triangles or heights. A further format is a file of its
!> own, and a line here.
module m_surface_file
   use m_kinds, only: wp
   use m_column_names, only: columns_t, read_columns
   use m_foreign_files, only: foreign_map
   use m_height_grids, only: is_esri_grid, is_surfer_grid, read_esri_grid, read_surfer_grid
   use m_height_map, only: height_map_t
   use m_height_matrix, only: take_matrix
   use m_height_places, only: take_places, take_named
   use m_number_text, only: read_real, number_none
   use m_obj_file, only: is_obj, read_obj
   use m_stl_file, only: is_binary_stl, is_text_stl, may_be_stl, read_binary_stl, read_text_stl
   use m_text_lines, only: lines_t, rows_t, read_rows, with_decimal_points, is_comment
   use m_triangle_list, only: triangle_list_t
   implicit none
   private
   public :: read_surface

contains

   !> Triangles, with duplicate corners as in the file; or a map of heights (`is_map`). `fault` is a message;
   !> empty: no error.
   subroutine read_surface(bytes, is_map, place, of, map, fault)
      character(len=:), allocatable, intent(inout) :: bytes
      logical, intent(out) :: is_map
      real(wp), allocatable, intent(out) :: place(:, :) !< (3, corners), in the unit of the file
      integer, allocatable, intent(out) :: of(:, :)     !< (3, triangles)
      type(height_map_t), intent(out) :: map
      character(len=:), allocatable, intent(inout) :: fault
      type(triangle_list_t) :: found
      fault = ''
      if (.not. is_binary_stl(bytes)) fault = foreign_map(bytes) ! its header may hold any text
      is_map = .false.
      if (fault /= '') return
      call found%begin()
      if (is_binary_stl(bytes)) then
         call read_binary_stl(bytes, found, fault)
      else if (is_text_stl(bytes)) then
         call read_text_stl(bytes, found, fault)
      else if (is_obj(bytes)) then
         call read_obj(bytes, found, fault)
      else if (is_esri_grid(bytes) .or. is_surfer_grid(bytes) .or. is_heights(bytes)) then
         is_map = .true.
         call read_map(bytes, map, fault)
         return
      else if (may_be_stl(bytes)) then
         call read_binary_stl(bytes, found, fault)
      else
         fault = 'is neither STL (binary or text), nor OBJ, nor a height map; convert it to one of these'
      end if
      if (fault == '' .and. found%triangles == 0) fault = 'has no triangles'
      place = found%place(:, :found%corners)
      of = found%of(:, :found%triangles)
   end subroutine read_surface

   subroutine read_map(bytes, map, fault)
      character(len=:), allocatable, intent(inout) :: bytes
      type(height_map_t), intent(inout) :: map
      character(len=:), allocatable, intent(inout) :: fault
      type(rows_t) :: rows
      type(lines_t) :: start
      type(columns_t) :: columns
      logical :: is_list
      call with_decimal_points(bytes, fault)
      if (fault /= '') return
      if (is_esri_grid(bytes)) then
         call read_esri_grid(bytes, map, fault)
      else if (is_surfer_grid(bytes)) then
         call read_surfer_grid(bytes, map, fault)
      else
         call read_columns(bytes, start, columns)
         call read_rows(bytes, start, rows, fault)
         if (fault /= '') return
         is_list = columns%line > 0
         if (is_list) then
            call take_named(columns, rows, map, fault)
         else
            call take_places(rows, map, is_list, fault)
         end if
         if (.not. is_list) call take_matrix(rows, map, fault)
      end if
   end subroutine read_map

   !> True for a text whose first line that is no comment begins with a number, also one with a decimal comma,
   !> or has column names.
   logical function is_heights(bytes)
      character(len=*), intent(in) :: bytes
      type(lines_t) :: lines
      type(columns_t) :: columns
      real(wp) :: value
      integer :: at, to, status
      call read_columns(bytes, lines, columns)
      is_heights = columns%line > 0
      if (is_heights) return
      do while (lines%next_line(bytes))
         if (.not. lines%next_word(bytes, at, to)) cycle
         if (is_comment(bytes(at:at))) cycle
         call read_real(bytes(at:to), value, status)
         is_heights = status /= number_none
         return
      end do
   end function is_heights

end module m_surface_file
