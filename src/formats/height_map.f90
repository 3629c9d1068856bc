!> A height map as given in a file, with the file's metadata.
module m_height_map
   use m_kinds, only: wp
   use m_text, only: to_text
   implicit none
   private
   public :: agree_on, first_row_words, row_at_bottom, row_at_top

   character(len=6), parameter :: first_row_words(2) = ['bottom', 'top   ']
   integer, parameter :: row_at_bottom = 1, row_at_top = 2
   real(wp), parameter :: alike = 0.01_wp !< relative tolerance between spacings of scene and file

   type, public :: height_map_t
      real(wp), allocatable :: height(:, :) !< (along x, along y), in the file's unit
      real(wp) :: spacing(2) = 0.0_wp       !< along x and y, m or the file's unit; 0: not given
      logical :: spacing_in_m = .false.
      real(wp) :: scale = 0.0_wp            !< m, the file's unit of heights; 0: not given
      integer :: first_row = 0              !< position of its first row; 0: not given
   end type height_map_t

contains

   !> Check that scene and file agree, and merge their data. Rows from the top are reversed. On return
   !> `spacing` and `scale` are those of the map; `fault` is a message.
   subroutine agree_on(map, spacing, scale, scale_is_given, first_row, fault)
      type(height_map_t), intent(inout) :: map
      real(wp), intent(inout) :: spacing(2)  !< as given in the scene, m; 0: not given
      real(wp), intent(inout) :: scale       !< as given in the scene, m
      logical, intent(in) :: scale_is_given
      integer, intent(in) :: first_row       !< as given in the scene; 0: not given
      character(len=:), allocatable, intent(inout) :: fault
      real(wp) :: said(2)
      integer :: row
      if (map%scale > 0.0_wp .and. scale_is_given .and. abs(map%scale - scale) > alike*scale) then
         fault = 'says its heights are in units of '//to_text(map%scale)//' m, and scale is '// &
                 to_text(scale)//'; allowed: without scale, or with the same'
      else if (map%first_row > 0 .and. first_row > 0 .and. map%first_row /= first_row) then
         fault = 'has its first row at the '//trim(first_row_words(map%first_row))// &
                 ' by its kind; allowed: without first_row, or with that'
      end if
      if (fault /= '') return
      if (map%scale > 0.0_wp) scale = map%scale
      said = map%spacing
      if (.not. map%spacing_in_m) said = scale*said
      if (all(map%spacing > 0.0_wp) .and. all(spacing > 0.0_wp)) then
         if (.not. map%spacing_in_m) said = said*sqrt(product(spacing/said)) ! lengths may be in another unit
         if (any(abs(said - spacing) > alike*spacing)) &
            fault = 'says that its heights are '//to_text(map%spacing(1), 4)//' and '// &
                    to_text(map%spacing(2), 4)//' apart along x and y'// &
                    trim(merge(' m', '  ', map%spacing_in_m))// &
                    ', and spacing is '//to_text(spacing(1), 4)//', '//to_text(spacing(2), 4)// &
                    ' m; allowed: without spacing, or with the same'
      else if (all(map%spacing > 0.0_wp)) then
         spacing = said
      end if
      row = max(map%first_row, first_row)
      if (row == row_at_top) map%height = map%height(:, size(map%height, 2):1:-1)
   end subroutine agree_on

end module m_height_map
