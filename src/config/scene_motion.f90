!> The motion of tools: &motion groups, the tables of &tool itself, and checks between them.
module m_scene_motion
   use m_kinds, only: wp
   use m_constants, only: exit_input
   use m_errors, only: error_t, fail
   use m_group_reader, only: group_reader_t, name_length
   use m_namelist_text, only: namelist_text_t
   use m_scene, only: scene_t, tool_spec_t, motion_spec_t
   use m_scene_words, only: motion_words
   use m_shape_variables, only: make_unit
   use m_text, only: to_text
   use m_value_range, only: above, any_value
   implicit none
   private
   public :: read_tool_motion, describe_motion, motions_of, find_motion, check_motions

   real(wp), parameter :: square = 1.0e-9_wp !< largest scalar product of directions that count as orthogonal
   real(wp), parameter :: apart = 1.0e-6_wp  !< cells: points further apart are different

contains

   !> Motion of a tool along its axis: by speeds, or by loads on its mass. Not required for a tool that a
   !> &motion moves.
   subroutine read_tool_motion(group, tool, may_stand)
      type(group_reader_t), intent(inout) :: group
      type(tool_spec_t), intent(inout) :: tool
      logical, intent(in) :: may_stand !< a &motion may name it
      logical :: given
      given = group%is_given('times') .or. group%is_given('speeds') .or. group%is_given('loads')
      call group%get_list('times', tool%times, any_value('s'), required=given .or. .not. may_stand)
      call group%get_list('speeds', tool%speeds, any_value('m/s'))
      call group%get_list('loads', tool%loads, any_value('N'))
      if (.not. (given .or. group%is_writing()) .and. may_stand) then
         tool%times = [0.0_wp]
         tool%speeds = [0.0_wp]
         tool%stands = .true.
      end if
      call check_tables(group, tool%times, tool%speeds, tool%loads, 'm/s')
      if (group%is_writing() .and. .not. allocated(tool%loads)) return
      call group%get('mass', tool%mass, above(0.0_wp, 'kg'), required=allocated(tool%loads))
      call group%get('initial_speed', tool%initial_speed, any_value('m/s'))
      if (.not. allocated(tool%loads)) call only_with_loads(group, ['mass         ', 'initial_speed'])
   end subroutine read_tool_motion

   !> A degree of freedom of a tool.
   subroutine describe_motion(group, tools, motion, tool)
      type(group_reader_t), intent(inout) :: group
      type(tool_spec_t), intent(in) :: tools(:)
      type(motion_spec_t), intent(inout) :: motion
      integer, intent(inout) :: tool !< number of its tool
      character(len=name_length) :: tool_names(size(tools))
      integer :: i, kind
      logical :: pushed
      do i = 1, size(tools)
         tool_names(i) = tools(i)%name
      end do
      call group%get_choice('tool', tool, tool_names, required=.true.)
      kind = merge(2, 1, motion%turns)
      call group%get_choice('kind', kind, motion_words, required=.true.)
      motion%turns = kind == 2
      call group%get('axis', motion%axis, any_value(''), required=.true.)
      call make_unit(group, motion%axis)
      call group%get('point', motion%point, any_value('m'), required=motion%turns, used=motion%turns)
      call group%get_list('times', motion%times, any_value('s'), required=.true.)
      if (motion%turns) then
         call group%get_list('speeds', motion%speeds, any_value('rad/s'))
         call group%get_list('loads', motion%loads, any_value('N m'))
      else
         call group%get_list('speeds', motion%speeds, any_value('m/s'))
         call group%get_list('loads', motion%loads, any_value('N'))
      end if
      call check_tables(group, motion%times, motion%speeds, motion%loads, &
                        trim(merge('rad/s', 'm/s  ', motion%turns)))
      pushed = allocated(motion%loads)
      if (group%is_writing() .and. .not. pushed) return
      call group%get('mass', motion%mass, above(0.0_wp, 'kg'), required=pushed .and. .not. motion%turns, &
                     used=.not. motion%turns)
      call group%get('inertia', motion%mass, above(0.0_wp, 'kg m2'), required=pushed .and. motion%turns, &
                     used=motion%turns)
      if (motion%turns) then
         call group%get('initial_speed', motion%initial_speed, any_value('rad/s'))
      else
         call group%get('initial_speed', motion%initial_speed, any_value('m/s'))
      end if
      if (.not. pushed) call only_with_loads(group, ['mass         ', 'inertia      ', 'initial_speed'])
   end subroutine describe_motion

   !> Times rise, and there are as many speeds or loads as times.
   subroutine check_tables(group, times, speeds, loads, unit)
      type(group_reader_t), intent(inout) :: group
      real(wp), allocatable, intent(in) :: times(:), speeds(:), loads(:)
      character(len=*), intent(in) :: unit !< of speeds
      if (allocated(times)) then
         if (any(times(2:) <= times(:size(times) - 1))) call group%refuse('times', 'must rise strictly')
      end if
      if (allocated(loads) .and. allocated(speeds)) then
         call group%refuse('loads', 'not together with speeds; a tool is driven by one of the two')
      else if (allocated(loads)) then
         call check_count('loads', size(loads))
      else if (allocated(speeds)) then
         call check_count('speeds', size(speeds))
      else
         call group%refuse('speeds', 'missing; must be numbers in '//unit//', or loads must be given')
      end if
   contains
      subroutine check_count(name, count)
         character(len=*), intent(in) :: name
         integer, intent(in) :: count
         if (.not. allocated(times)) return
         if (size(times) /= count) call group%refuse(name, 'must be as many numbers as times, '// &
                                                     to_text(size(times))//'; '//to_text(count)//' given')
      end subroutine check_count
   end subroutine check_tables

   !> These variables belong to tools driven by loads.
   subroutine only_with_loads(group, names)
      type(group_reader_t), intent(inout) :: group
      character(len=*), intent(in) :: names(:)
      integer :: n
      do n = 1, size(names)
         if (group%is_given(trim(names(n)))) call group%refuse(trim(names(n)), 'only with loads')
      end do
   end subroutine only_with_loads

   !> Number of &motion groups of a scene.
   pure integer function motions_of(tools) result(count)
      type(tool_spec_t), intent(in) :: tools(:)
      integer :: t
      count = 0
      do t = 1, size(tools)
         if (allocated(tools(t)%motions)) count = count + size(tools(t)%motions)
      end do
   end function motions_of

   !> The number-th of them, counted tool by tool, and its tool; 0 if there is none.
   pure subroutine find_motion(tools, number, motion, tool)
      type(tool_spec_t), intent(in) :: tools(:)
      integer, intent(in) :: number
      type(motion_spec_t), intent(out) :: motion
      integer, intent(out) :: tool
      integer :: before
      before = 0
      do tool = 1, size(tools)
         if (.not. allocated(tools(tool)%motions)) cycle
         if (number <= before + size(tools(tool)%motions)) then
            motion = tools(tool)%motions(number - before)
            return
         end if
         before = before + size(tools(tool)%motions)
      end do
      tool = 0
   end subroutine find_motion

   !> Every tool has a motion; a load-driven freedom is orthogonal to the tool's other freedoms, so that each
   !> has one mass.
   subroutine check_motions(text, scene, error)
      type(namelist_text_t), intent(in) :: text
      type(scene_t), intent(in) :: scene
      type(error_t), intent(inout) :: error
      type(motion_spec_t), allocatable :: all(:)
      integer :: i, k, t
      do t = 1, size(scene%tools)
         associate (tool => scene%tools(t))
            if (tool%stands .and. .not. allocated(tool%motions)) then
               call fail(error, exit_input, text%place('tool', t, 'times')// &
                         ': missing; must be numbers in s, or a &motion must name the tool')
               return
            end if
            if (.not. allocated(tool%motions)) cycle
            all = [axial(tool), tool%motions]
            do i = 2, size(all)
               do k = 1, i - 1
                  call check_pair(text, all(i), all(k), apart*scene%grid%cell_size, error)
                  if (error%happened()) return
               end do
            end do
         end associate
      end do
   end subroutine check_motions

   !> The motion along the tool's axis given in the &tool itself.
   pure type(motion_spec_t) function axial(tool) result(motion)
      type(tool_spec_t), intent(in) :: tool
      motion%axis = tool%axis
      motion%times = tool%times
      if (allocated(tool%speeds)) motion%speeds = tool%speeds
      if (allocated(tool%loads)) motion%loads = tool%loads
   end function axial

   !> Check two motions of a tool.
   subroutine check_pair(text, later, earlier, near, error)
      type(namelist_text_t), intent(in) :: text
      type(motion_spec_t), intent(in) :: later, earlier
      real(wp), intent(in) :: near !< m
      type(error_t), intent(inout) :: error
      character(len=:), allocatable :: other
      if (later%turns .neqv. earlier%turns) return
      if (is_held(later) .or. is_held(earlier)) return
      if (.not. (allocated(later%loads) .or. allocated(earlier%loads))) return
      other = 'the motion along the axis of its &tool'
      if (earlier%number > 0) other = 'the &motion on '//text%line_of('motion', earlier%number)
      if (abs(dot_product(later%axis, earlier%axis)) > square) then
         call fail(error, exit_input, text%place('motion', later%number, 'axis')// &
                   ': must be at right angles to '//other//', where loads push one of the two')
      else if (later%turns .and. norm2(later%point - earlier%point) > near) then
         call fail(error, exit_input, text%place('motion', later%number, 'point')// &
                   ': must be that of '//other//', where loads push one of the two')
      end if
   end subroutine check_pair

   !> True if it never moves.
   pure logical function is_held(motion)
      type(motion_spec_t), intent(in) :: motion
      is_held = allocated(motion%speeds)
      if (is_held) is_held = .not. any(abs(motion%speeds) > 0.0_wp)
   end function is_held

end module m_scene_motion
