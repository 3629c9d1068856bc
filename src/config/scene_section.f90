!> Checks of a scene given by a section (theory.md, Sections), and the list of unsupported features: one
!> message each.
module m_scene_section
   use m_side_kinds, only: side_kinds
   use m_kinds, only: wp
   use m_constants, only: exit_input
   use m_errors, only: error_t, fail
   use m_namelist_text, only: namelist_text_t
   use m_scene
   use m_section, only: section_t
   use m_shape, only: runs_along
   use m_text, only: to_text
   implicit none
   private
   public :: take_sections

   real(wp), parameter :: near = 1.0e-9_wp !< cells: a side so near to a position counts as on it

contains

   !> Convert bodies, cuts, tools, laws and effects to the section; an error names the first one that cannot
   !> be converted.
   subroutine take_sections(text, scene, error)
      type(namelist_text_t), intent(in) :: text
      type(scene_t), intent(inout) :: scene
      type(error_t), intent(inout) :: error
      character(len=:), allocatable :: why
      integer :: i
      if (.not. scene%grid%section%is_flat()) return
      call check_plane(text, scene%grid, error)
      if (scene%grid%section%is_round()) call check_axis(text, scene%grid, error)
      if (error%happened()) return
      do i = 1, size(scene%materials)
         call scene%materials(i)%law%take_section(scene%grid%section, why)
         call answer('material', i, 'model', 'the law '//why, why)
      end do
      do i = 1, size(scene%bodies)
         call scene%bodies(i)%shape%take_section(scene%grid%section, why)
         call answer('body', i, 'shape', 'the body '//scene%bodies(i)%name//' '//why, why)
         scene%bodies(i)%section = scene%grid%section
         call check_body(text, scene%bodies(i), i, scene%grid%section, error)
      end do
      do i = 1, size(scene%levels) ! over the whole thickness of the section
         scene%levels(i)%lower(2) = scene%grid%lower(2)
         scene%levels(i)%upper(2) = scene%grid%upper(2)
         scene%levels(i)%center(2) = scene%grid%lower(2)
      end do
      do i = 1, size(scene%cuts)
         call scene%cuts(i)%shape%take_section(scene%grid%section, why)
         call answer('cut', i, 'shape', 'the cut '//why, why)
      end do
      do i = 1, size(scene%tools)
         call scene%tools(i)%shape%take_section(scene%grid%section, why)
         call answer('tool', i, 'shape', 'the tool '//scene%tools(i)%name//' '//why, why)
         call check_tool(text, scene%tools(i), i, scene%grid%section, error)
      end do
      do i = 1, size(scene%effects)
         call scene%effects(i)%it%take_section(scene%grid%section, why)
         if (why /= '') call fail(error, exit_input, scene%effects(i)%it%group_text()//': '//why)
      end do
      call check_absent(text, scene, error)
   contains
      subroutine answer(group, number, variable, sentence, why)
         character(len=*), intent(in) :: group, variable, sentence, why
         integer, intent(in) :: number
         if (why == '') return
         call fail(error, exit_input, text%place(group, number, variable)//': with geometry='''// &
                   scene%grid%section%word()//''' '//sentence)
      end subroutine answer
   end subroutine take_sections

   !> The section is the plane y = 0, the lower side of one layer of cells.
   subroutine check_plane(text, grid, error)
      type(namelist_text_t), intent(in) :: text
      type(grid_spec_t), intent(in) :: grid
      type(error_t), intent(inout) :: error
      if (abs(grid%lower(2)) > 0.0_wp) then
         call fail(error, exit_input, text%place('grid', 1, 'lower')//': with geometry='''// &
                   grid%section%word()//''' y must be 0, where the section is')
      else if (abs(grid%upper(2) - grid%cell_size) > near*grid%cell_size) then
         call fail(error, exit_input, text%place('grid', 1, 'upper')//': with geometry='''// &
                   grid%section%word()//''' y must be cell_size, '//to_text(grid%cell_size, 9)//' m')
      else if (any(.not. side_kinds(grid%boundary(3:4))%mirrors)) then
         call fail(error, exit_input, text%place('grid', 1, 'boundary')//': with geometry='''// &
                   grid%section%word()//''' both sides in y must be symmetry')
      end if
   end subroutine check_plane

   !> The lower side in x is the axis, with the mirror image beyond it, or a bore.
   subroutine check_axis(text, grid, error)
      type(namelist_text_t), intent(in) :: text
      type(grid_spec_t), intent(in) :: grid
      type(error_t), intent(inout) :: error
      character(len=:), allocatable :: start
      start = ': with geometry='''//grid%section%word()//''' '
      if (grid%lower(1) < 0.0_wp) then
         call fail(error, exit_input, text%place('grid', 1, 'lower')//start// &
                   'x is a radius; allowed: at least 0')
      else if (grid%lower(1) > 0.0_wp .eqv. side_kinds(grid%boundary(1))%mirrors) then
         call fail(error, exit_input, text%place('grid', 1, 'boundary')//start// &
                   'the lower side in x must be symmetry at x=0, the axis, and free, roller or fixed '// &
                   'elsewhere')
      else if (side_kinds(grid%boundary(2))%mirrors) then
         call fail(error, exit_input, text%place('grid', 1, 'boundary')//start//'the upper side in x is '// &
                   'round and no mirror; allowed: free, roller, fixed')
      end if
   end subroutine check_axis

   !> A body moves within the section, and bears no shear across it at the start.
   subroutine check_body(text, body, i, section, error)
      type(namelist_text_t), intent(in) :: text
      type(body_spec_t), intent(in) :: body
      integer, intent(in) :: i
      type(section_t), intent(in) :: section
      type(error_t), intent(inout) :: error
      character(len=:), allocatable :: start
      start = ': with geometry='''//section%word()//''' '
      if (abs(body%velocity(2)) > 0.0_wp) &
         call fail(error, exit_input, text%place('body', i, 'velocity')//start//'y must be 0')
      if (any(abs(body%angular_velocity([1, 3])) > 0.0_wp) &
          .or. (section%is_round() .and. abs(body%angular_velocity(2)) > 0.0_wp)) &
         call fail(error, exit_input, text%place('body', i, 'angular_velocity')//start//'must be '// &
                   trim(merge('0,0,0          ', '0 but for its y', section%is_round())))
      if (any(abs(body%stress([4, 6])) > 0.0_wp)) &
         call fail(error, exit_input, text%place('body', i, 'stress')//start//'yz and xy must be 0')
   end subroutine check_body

   !> A tool is on the axis and moves along it, or is uniform along y.
   subroutine check_tool(text, tool, i, section, error)
      type(namelist_text_t), intent(in) :: text
      type(tool_spec_t), intent(in) :: tool
      integer, intent(in) :: i
      type(section_t), intent(in) :: section
      type(error_t), intent(inout) :: error
      character(len=:), allocatable :: start
      integer :: m
      start = ': with geometry='''//section%word()//''' '
      if (section%is_round() .and. any(abs(tool%tip(1:2)) > 0.0_wp)) then
         call fail(error, exit_input, text%place('tool', i, 'tip')//start//'must be at x = y = 0, the axis')
      else if (section%is_round() .and. .not. runs_along(tool%axis, 3)) then
         call fail(error, exit_input, text%place('tool', i, 'axis')//start//'must be 0,0,1 or 0,0,-1')
      else if (abs(tool%axis(2)) > 0.0_wp) then
         call fail(error, exit_input, text%place('tool', i, 'axis')//start//'y must be 0')
      end if
      if (.not. allocated(tool%motions)) return
      do m = 1, size(tool%motions)
         associate (motion => tool%motions(m))
            if (motion%turns .and. .not. section%is_round() .and. runs_along(motion%axis, 2)) cycle
            if (.not. motion%turns .and. section%is_round() .and. runs_along(motion%axis, 3)) cycle
            if (.not. (motion%turns .or. section%is_round() .or. abs(motion%axis(2)) > 0.0_wp)) cycle
            call fail(error, exit_input, text%place('motion', motion%number, 'axis')//start//'a tool may '// &
                      trim(merge('slide along z                  ', 'slide in x and z, turn about y ', &
                                 section%is_round())))
         end associate
      end do
   end subroutine check_tool

   !> Features not supported in a section.
   subroutine check_absent(text, scene, error)
      type(namelist_text_t), intent(in) :: text
      type(scene_t), intent(in) :: scene
      type(error_t), intent(inout) :: error
      character(len=:), allocatable :: start
      integer :: l
      start = 'with geometry='''//scene%grid%section%word()//''' '
      do l = 1, size(scene%probes)
         if (abs(scene%probes(l)%position(2)) > 0.0_wp) &
            call fail(error, exit_input, text%place('probe', l, 'position')//': '//start//'y must be 0')
      end do
   end subroutine check_absent

end module m_scene_section
