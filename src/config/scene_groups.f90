!> What each group of a scene may say: its variables, their defaults and what is allowed. doc/input.md is the same as a table.
module m_scene_groups
   use m_kinds, only: wp
   use m_constants, only: pi, exit_input
   use m_errors, only: error_t, fail
   use m_group_reader, only: group_reader_t, name_length
   use m_namelist_text, only: namelist_text_t
   use m_text, only: to_text
   use m_scene
   use m_scene_words
   use m_value_range, only: above, at_least, any_value
   use m_words, only: advice, joined, lower_case
   implicit none
   private
   public :: read_groups, known_variables

   integer, parameter :: longest_title = 200, longest_path = 1000
   real(wp), parameter :: largest_penetration_factor = 0.5_wp
   real(wp), parameter :: largest_friction = 10.0_wp
   real(wp), parameter :: berkovich_angle = 65.27_wp !< degrees between axis and face
   real(wp), parameter :: parallel = 1.0e-12_wp      !< one minus the cosine of directions that are taken for one

contains

   !> Fill a scene from its groups; what goes across groups is not checked here.
   subroutine read_groups(text, scene, error)
      type(namelist_text_t), intent(in) :: text
      type(scene_t), intent(inout) :: scene
      type(error_t), intent(inout) :: error
      type(group_reader_t) :: group
      character(len=name_length), allocatable :: material_names(:)
      integer :: kind, number
      call check_group_names(text, error)
      if (error%happened()) return
      allocate (scene%materials(text%count_groups('material')), scene%bodies(text%count_groups('body')))
      allocate (scene%tools(text%count_groups('tool')), scene%probes(text%count_groups('probe')))
      allocate (material_names(size(scene%materials)))
      scene%output%present = text%count_groups('output') > 0
      do kind = 1, size(group_words)
         do number = 1, text%count_groups(trim(group_words(kind)))
            call group%begin(text%groups(text%find_group(trim(group_words(kind)), number)))
            call read_group(trim(group_words(kind)), group, number, material_names, scene)
            call group%finish(error)
            if (error%happened()) return
            call check_name(text, scene, trim(group_words(kind)), number, error)
            if (error%happened()) return
            if (group_words(kind) == 'material') material_names(number) = scene%materials(number)%name
         end do
      end do
   end subroutine read_groups

   !> Every group is known, built, there when it must be, and once when it may be there only once.
   subroutine check_group_names(text, error)
      type(namelist_text_t), intent(in) :: text
      type(error_t), intent(inout) :: error
      character(len=:), allocatable :: start
      integer :: i, kind
      do i = 1, size(text%groups)
         associate (group => text%groups(i))
            start = 'line '//to_text(group%line)//', &'//group%name
            kind = findloc(group_words == group%name, .true., dim=1)
            if (any(later_groups == group%name)) then
               call fail(error, exit_input, start//': not available in this version; allowed: '//joined(group_words))
            else if (kind == 0) then
               call fail(error, exit_input, start//': unknown group'//advice(group%name, group_words))
            else if (.not. group_repeats(kind) .and. text%find_group(group%name, 1) /= i) then
               call fail(error, exit_input, start//': given twice; first on '//text%line_of(group%name, 1))
            end if
         end associate
      end do
      do kind = 1, size(group_words)
         if (.not. group_required(kind) .or. text%count_groups(trim(group_words(kind))) > 0) cycle
         call fail(error, exit_input, 'the scene has no group &'//trim(group_words(kind))//'; required: '// &
                   joined(pack(group_words, group_required)))
      end do
   end subroutine check_group_names

   !> Names of one kind differ, capitals not counted: they become names of files.
   subroutine check_name(text, scene, kind, number, error)
      type(namelist_text_t), intent(in) :: text
      type(scene_t), intent(in) :: scene
      character(len=*), intent(in) :: kind
      integer, intent(in) :: number
      type(error_t), intent(inout) :: error
      integer :: i
      do i = 1, number - 1
         if (name_of(scene, kind, i) /= name_of(scene, kind, number)) cycle
         call fail(error, exit_input, text%place(kind, number, 'name')//': the name '//name_of(scene, kind, number)// &
                   ' is taken by the &'//kind//' on '//text%line_of(kind, i))
      end do
   end subroutine check_name

   !> In lower case.
   function name_of(scene, kind, number) result(name)
      type(scene_t), intent(in) :: scene
      character(len=*), intent(in) :: kind
      integer, intent(in) :: number
      character(len=:), allocatable :: name
      select case (kind)
      case ('material')
         name = lower_case(scene%materials(number)%name)
      case ('body')
         name = lower_case(scene%bodies(number)%name)
      case ('tool')
         name = lower_case(scene%tools(number)%name)
      case default
         name = lower_case(scene%probes(number)%name)
      end select
   end function name_of

   !> `group variable`, a line each, of all that can be read.
   function known_variables() result(text)
      character(len=:), allocatable :: text
      type(group_reader_t) :: group
      type(scene_t) :: scene
      character(len=name_length) :: material_names(0)
      character(len=name_length), allocatable :: names(:)
      integer :: kind, i
      allocate (scene%materials(1), scene%bodies(1), scene%tools(1), scene%probes(1))
      text = ''
      do kind = 1, size(group_words)
         call group%begin()
         call read_group(trim(group_words(kind)), group, 1, material_names, scene)
         names = group%names()
         do i = 1, size(names)
            text = text//trim(group_words(kind))//' '//trim(names(i))//new_line('a')
         end do
      end do
   end function known_variables

   !> The number-th group of its kind.
   subroutine read_group(kind, group, number, material_names, scene)
      character(len=*), intent(in) :: kind
      type(group_reader_t), intent(inout) :: group
      integer, intent(in) :: number
      character(len=*), intent(in) :: material_names(:)
      type(scene_t), intent(inout) :: scene
      select case (kind)
      case ('scene')
         scene%title = 'untitled'
         call group%get_text('title', scene%title, longest_title)
         call group%get('end_time', scene%end_time, above(0.0_wp, 's'), required=.true.)
      case ('grid')
         call read_grid(group, scene%grid)
      case ('time')
         call read_time(group, scene%time)
      case ('material')
         call read_material(group, scene%materials(number))
      case ('body')
         scene%bodies(number)%name = 'body'//to_text(number)
         call read_body(group, material_names, scene%bodies(number))
      case ('tool')
         scene%tools(number)%name = 'tool'//to_text(number)
         call read_tool(group, scene%tools(number))
      case ('probe')
         scene%probes(number)%name = 'probe'//to_text(number)
         call group%get_name('name', scene%probes(number)%name)
         call group%get('position', scene%probes(number)%position, any_value('m'), required=.true.)
      case ('contact')
         call group%get('tolerance', scene%contact%tolerance, above(0.0_wp, '', below=1.0_wp))
         call group%get('max_iterations', scene%contact%max_iterations, least=1)
         call group%get('compliance', scene%contact%compliance, above(0.0_wp, '', at_most=1.0_wp))
      case ('output')
         call read_output(group, scene%output)
      end select
   end subroutine read_group

   subroutine read_grid(group, grid)
      type(group_reader_t), intent(inout) :: group
      type(grid_spec_t), intent(inout) :: grid
      integer :: choices(6)
      call group%get('lower', grid%lower, any_value('m'), required=.true.)
      call group%get('upper', grid%upper, any_value('m'), required=.true.)
      call group%get('cell_size', grid%cell_size, above(0.0_wp, 'm'), required=.true.)
      choices = 1
      call group%get_choices('boundary', choices, boundary_words)
      grid%boundary = boundary_codes(max(choices, 1))
   end subroutine read_grid

   subroutine read_time(group, time)
      type(group_reader_t), intent(inout) :: group
      type(time_spec_t), intent(inout) :: time
      integer :: velocity_update, transfer
      logical :: flip
      call group%get('safety', time%safety, above(0.0_wp, '', at_most=1.0_wp))
      call group%get('time_step', time%time_step, at_least(0.0_wp, 's'))
      call group%get_choice('stress_update', time%stress_update, stress_update_words)
      transfer = 1
      call group%get_choice('transfer', transfer, transfer_words)
      time%affine = transfer == 1
      velocity_update = 1
      call group%get_choice('velocity_update', velocity_update, velocity_update_words)
      flip = velocity_update /= 2
      call group%get('flip_fraction', time%flip_fraction, at_least(0.0_wp, '', at_most=1.0_wp), used=flip)
      if (.not. flip) time%flip_fraction = 0.0_wp
   end subroutine read_time

   subroutine read_material(group, material)
      type(group_reader_t), intent(inout) :: group
      type(material_spec_t), intent(inout) :: material
      integer :: model
      material%name = ''
      call group%get_name('name', material%name, required=.true.)
      model = 1
      call group%get_choice('model', model, model_words, required=.true.)
      material%model = trim(model_words(max(model, 1)))
      call group%get('density', material%density, above(0.0_wp, 'kg/m3'), required=.true.)
      call group%get('young', material%young, above(0.0_wp, 'Pa'), required=.true.)
      call group%get('poisson', material%poisson, above(-1.0_wp, '', below=0.5_wp), required=.true.)
   end subroutine read_material

   subroutine read_body(group, material_names, body)
      type(group_reader_t), intent(inout) :: group
      character(len=*), intent(in) :: material_names(:)
      type(body_spec_t), intent(inout) :: body
      logical :: box, sphere, cylinder
      call group%get_name('name', body%name)
      call group%get_choice('material', body%material, material_names, required=.true.)
      call group%get_choice('shape', body%shape, body_shape_words, required=.true.)
      box = body%shape == shape_box .or. body%shape == 0 ! an unknown shape is the fault, not what comes with it
      sphere = body%shape == shape_sphere .or. body%shape == 0
      cylinder = body%shape == shape_cylinder .or. body%shape == 0
      call group%get('lower', body%lower, any_value('m'), required=.true., used=box)
      call group%get('upper', body%upper, any_value('m'), required=.true., used=box)
      call group%get('center', body%center, any_value('m'), required=.true., used=sphere .or. cylinder)
      call group%get('radius', body%radius, above(0.0_wp, 'm'), required=.true., used=sphere .or. cylinder)
      call group%get('height', body%height, above(0.0_wp, 'm'), required=.true., used=cylinder)
      call group%get('axis', body%axis, any_value(''), used=cylinder)
      call make_unit(group, body%axis)
      call group%get_option('particles_per_cell', body%particles_per_cell, [1, 8, 27])
      call group%get('velocity', body%velocity, any_value('m/s'))
      call group%get('angular_velocity', body%angular_velocity, any_value('rad/s'))
   end subroutine read_body

   subroutine read_tool(group, tool)
      type(group_reader_t), intent(inout) :: group
      type(tool_spec_t), intent(inout) :: tool
      real(wp) :: degrees
      logical :: any_shape
      call group%get_name('name', tool%name)
      call group%get_choice('shape', tool%shape, tool_shape_words, required=.true.)
      any_shape = tool%shape == 0 ! an unknown shape is the fault, not what comes with it
      degrees = merge(berkovich_angle, 0.0_wp, tool%shape == tool_berkovich)
      call group%get('half_angle', degrees, above(0.0_wp, 'degrees', below=90.0_wp), required=tool%shape /= tool_berkovich, &
                     used=any(tool%shape == tool_pointed) .or. any_shape)
      tool%half_angle = degrees*(pi/180.0_wp)
      call group%get('radius', tool%radius, above(0.0_wp, 'm'), required=.true., &
                     used=any(tool%shape == tool_round) .or. any_shape)
      call group%get('tip', tool%tip, any_value('m'), required=.true.)
      call group%get('axis', tool%axis, any_value(''))
      call make_unit(group, tool%axis)
      if (abs(tool%axis(1)) > 1.0_wp - parallel) tool%edge = [0.0_wp, 1.0_wp, 0.0_wp]
      call group%get('edge', tool%edge, any_value(''), used=any(tool%shape == tool_edged) .or. any_shape)
      if (norm2(tool%edge - dot_product(tool%edge, tool%axis)*tool%axis) <= sqrt(2.0_wp*parallel)*norm2(tool%edge)) &
         call group%refuse('edge', 'must not be 0,0,0 or parallel to the axis')
      call read_tool_motion(group, tool)
      call group%get('penetration_factor', tool%penetration_factor, at_least(0.0_wp, '', at_most=largest_penetration_factor))
      call group%get('friction', tool%friction, at_least(0.0_wp, '', at_most=largest_friction))
   end subroutine read_tool

   !> What moves a tool: speeds, or loads on its mass.
   subroutine read_tool_motion(group, tool)
      type(group_reader_t), intent(inout) :: group
      type(tool_spec_t), intent(inout) :: tool
      call group%get_list('times', tool%times, any_value('s'), required=.true.)
      if (allocated(tool%times)) then
         if (any(tool%times(2:) <= tool%times(:size(tool%times) - 1))) call group%refuse('times', 'must rise strictly')
      end if
      call group%get_list('speeds', tool%speeds, any_value('m/s'))
      call group%get_list('loads', tool%loads, any_value('N'))
      if (allocated(tool%loads) .and. allocated(tool%speeds)) then
         call group%refuse('loads', 'not together with speeds; a tool moves by one or the other')
      else if (allocated(tool%loads)) then
         call check_table(group, 'loads', size(tool%loads), tool%times)
      else if (allocated(tool%speeds)) then
         call check_table(group, 'speeds', size(tool%speeds), tool%times)
      else
         call group%refuse('speeds', 'missing; must be numbers in m/s, or loads must be given')
      end if
      call group%get('mass', tool%mass, above(0.0_wp, 'kg'), required=allocated(tool%loads))
      call group%get('initial_speed', tool%initial_speed, any_value('m/s'))
      if (allocated(tool%loads)) return
      if (group%is_given('mass')) call group%refuse('mass', 'only with loads')
      if (group%is_given('initial_speed')) call group%refuse('initial_speed', 'only with loads')
   end subroutine read_tool_motion

   !> As many values as times.
   subroutine check_table(group, name, count, times)
      type(group_reader_t), intent(inout) :: group
      character(len=*), intent(in) :: name
      integer, intent(in) :: count
      real(wp), allocatable, intent(in) :: times(:)
      if (.not. allocated(times)) return
      if (size(times) /= count) call group%refuse(name, 'must be as many numbers as times, '//to_text(size(times))//'; '// &
                                                  to_text(count)//' given')
   end subroutine check_table

   !> Give an axis the length 1. One that has it keeps its bits, so that what is written reads back the same.
   subroutine make_unit(group, axis)
      type(group_reader_t), intent(inout) :: group
      real(wp), intent(inout) :: axis(3)
      if (maxval(abs(axis)) <= 0.0_wp) then
         call group%refuse('axis', 'must not be 0,0,0')
      else if (abs(sum(axis**2) - 1.0_wp) > 8.0_wp*epsilon(1.0_wp)) then
         axis = axis/maxval(abs(axis))
         axis = axis/norm2(axis)
      end if
   end subroutine make_unit

   subroutine read_output(group, output)
      type(group_reader_t), intent(inout) :: group
      type(output_spec_t), intent(inout) :: output
      logical :: formats(3)
      output%directory = ''
      call group%get_text('directory', output%directory, longest_path, required=.true.)
      call group%get('every', output%every, at_least(0.0_wp, 's'))
      call group%get('history_every', output%history_every, at_least(0.0_wp, 's'))
      formats = [.true., .false., .false.]
      call group%get_set('formats', formats, format_words)
      if (formats(3) .and. any(formats(1:2))) call group%refuse('formats', 'none must stand alone')
      output%hdf5 = formats(1)
      output%tecplot = formats(2)
   end subroutine read_output

end module m_scene_groups
