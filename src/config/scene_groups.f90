!> The groups of a scene: their variables, with defaults and allowed values. doc/user/input.md is the same as
!> a table. Each describe_* both reads and writes its group (see m_group_reader): it passes the present values
!> to the reader.
module m_scene_groups
   use m_side_kinds, only: boundary_symmetry
   use m_domain_kinds, only: domain_by_law
   use m_kinds, only: wp
   use m_constants, only: exit_input
   use m_errors, only: error_t, fail
   use m_group_reader, only: group_reader_t, name_length
   use m_contact_groups, only: number_groups, describe_body_contact
   use m_namelist_text, only: namelist_text_t
   use m_offer, only: catalogue_t, offer_t, offer_slot_t, offered_names
   use m_text, only: to_text
   use m_scene
   use m_scene_level, only: describe_level
   use m_scene_bodies, only: describe_material, describe_body, describe_cut, describe_tool, &
      describe_nth_motion
   use m_scene_static, only: describe_quasi_static, brings_in_statics
   use m_scene_words
   use m_section, only: geometry_words
   use m_value_range, only: above, at_least, any_value
   use m_words, only: advice, joined, lower_case
   implicit none
   private
   public :: read_groups, describe_group, known_variables

   integer, parameter :: longest_title = 200, longest_path = 1000
   integer, parameter :: max_retries = 20 ! a millionth of the time step
   real(wp), parameter :: default_every_wall = 600.0_wp !< s

contains

   !> Fill a scene from its groups; relations across groups are not checked here.
   subroutine read_groups(text, catalogue, scene, error)
      type(namelist_text_t), intent(in) :: text
      type(catalogue_t), intent(in) :: catalogue
      type(scene_t), intent(inout) :: scene
      type(error_t), intent(inout) :: error
      type(group_reader_t) :: group
      character(len=name_length), allocatable :: material_names(:)
      integer :: kind, number
      call check_group_names(text, catalogue%effects, error)
      if (error%happened()) return
      allocate (scene%materials(text%count_groups('material')), scene%bodies(text%count_groups('body')))
      allocate (scene%tools(text%count_groups('tool')), scene%probes(text%count_groups('probe')))
      allocate (scene%levels(text%count_groups('level')))
      allocate (scene%cuts(text%count_groups('cut')))
      allocate (scene%body_contacts(text%count_groups('body_contact')))
      allocate (material_names(size(scene%materials)))
      scene%output%present = text%count_groups('output') > 0
      scene%checkpoint%present = text%count_groups('checkpoint') > 0
      scene%quasi_static%present = text%count_groups('quasi_static') > 0
      scene%has_motions = text%count_groups('motion') > 0
      scene%time%domain = domain_by_law ! until the scene sets it
      do kind = 1, size(group_words)
         do number = 1, text%count_groups(trim(group_words(kind)))
            call group%begin(text%groups(text%find_group(trim(group_words(kind)), number)))
            call describe_group(trim(group_words(kind)), group, number, material_names, catalogue, scene)
            call group%finish(error)
            if (error%happened()) return
            call check_name(text, scene, trim(group_words(kind)), number, error)
            if (error%happened()) return
            if (group_words(kind) == 'material') material_names(number) = scene%materials(number)%name
         end do
         if (group_words(kind) == 'body') call number_groups(scene)
      end do
      call read_effects(text, catalogue%effects, scene, error)
      if (error%happened() .or. .not. scene%quasi_static%has_inertia()) return
      if (text%count_groups('contact') > 0) then
         call group%begin(text%groups(text%find_group('contact', 1)))
         if (group%is_given('subcell') .and. scene%contact%subcell > 0.0_wp) &
            call fail(error, exit_input, text%place('contact', 1, 'subcell')//': allowed: 0 with mode='// &
                      '''newmark'' of &quasi_static, whose steps lack the compliance below a cell')
      end if
      scene%contact%subcell = 0.0_wp ! one contact law for all steps of a run
   end subroutine read_groups

   !> True when an effect is on by default for a law: if a body of the law has more than one particle a cell,
   !> as a single one does not lock.
   logical function is_brought(scene, name)
      type(scene_t), intent(in) :: scene
      character(len=*), intent(in) :: name
      integer :: b
      is_brought = .false.
      do b = 1, size(scene%bodies)
         if (scene%bodies(b)%particles_per_cell == 1) cycle
         if (scene%materials(scene%bodies(b)%material)%law%default_effect() == name) is_brought = .true.
      end do
   end function is_brought

   !> The effects of the scene: each a copy of its prototype with the values of its group; and the default
   !> effects of laws where the scene has no such group.
   subroutine read_effects(text, offers, scene, error)
      type(namelist_text_t), intent(in) :: text
      type(offer_slot_t), intent(in) :: offers(:)
      type(scene_t), intent(inout) :: scene
      type(error_t), intent(inout) :: error
      type(offer_slot_t), allocatable :: effects(:)
      type(group_reader_t) :: group
      logical :: brought(size(offers))
      integer :: e, number, n
      n = 0
      brought = [(is_brought(scene, offers(e)%it%name) .and. text%count_groups(offers(e)%it%name) == 0, e=1, &
                  size(offers))]
      if (scene%quasi_static%present) &
         brought = brought .and. [(brings_in_statics(offers(e)%it%name, scene%quasi_static), &
                                   e=1, size(offers))]
      scene%brought = joined(pack(offered_names(offers), brought))
      allocate (effects(sum([(text%count_groups(offers(e)%it%name), e=1, size(offers))]) + count(brought)))
      do e = 1, size(offers)
         if (brought(e)) then
            n = n + 1
            allocate (effects(n)%it, source=offers(e)%it)
         end if
         do number = 1, text%count_groups(offers(e)%it%name)
            n = n + 1
            allocate (effects(n)%it, source=offers(e)%it)
            associate (found => text%groups(text%find_group(offers(e)%it%name, number)))
               effects(n)%it%line = found%line
               call group%begin(found)
            end associate
            call effects(n)%it%variables(group)
            call group%finish(error)
            if (error%happened()) return
         end do
      end do
      call move_alloc(effects, scene%effects)
   end subroutine read_effects

   !> Every group is known, available in this build, present if required, and not repeated unless it may be.
   subroutine check_group_names(text, effects, error)
      type(namelist_text_t), intent(in) :: text
      type(offer_slot_t), intent(in) :: effects(:)
      type(error_t), intent(inout) :: error
      character(len=name_length) :: words(size(group_words) + size(effects))
      character(len=:), allocatable :: start
      logical :: repeats(size(words))
      integer :: i, e, kind
      words(:size(group_words)) = group_words
      words(size(group_words) + 1:) = offered_names(effects)
      repeats = [group_repeats, (effects(e)%it%repeats, e=1, size(effects))]
      do i = 1, size(text%groups)
         associate (group => text%groups(i))
            start = 'line '//to_text(group%line)//', &'//group%name
            kind = findloc(words == group%name, .true., dim=1)
            if (kind == 0) then
               call fail(error, exit_input, start//': unknown group'//advice(group%name, words))
            else if (.not. repeats(kind) .and. text%find_group(group%name, 1) /= i) then
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

   !> Names of one kind must differ, ignoring case: they become names of files.
   subroutine check_name(text, scene, kind, number, error)
      type(namelist_text_t), intent(in) :: text
      type(scene_t), intent(in) :: scene
      character(len=*), intent(in) :: kind
      integer, intent(in) :: number
      type(error_t), intent(inout) :: error
      integer :: i
      if (any(kind == [character(len=12) :: 'level', 'motion', 'body_contact', 'cut'])) return ! have no names
      do i = 1, number - 1
         if (name_of(scene, kind, i) /= name_of(scene, kind, number)) cycle
         call fail(error, exit_input, text%place(kind, number, 'name')//': the name '// &
                   name_of(scene, kind, number)//' is taken by the &'//kind//' on '//text%line_of(kind, i))
      end do
   end subroutine check_name

   !> The name in lower case.
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

   !> `group variable`, a line each, of all variables.
   function known_variables(catalogue) result(text)
      type(catalogue_t), intent(in) :: catalogue
      character(len=:), allocatable :: text
      type(group_reader_t) :: group
      type(scene_t) :: scene
      class(offer_t), allocatable :: effect
      character(len=name_length) :: material_names(0)
      integer :: kind
      allocate (scene%materials(1), scene%bodies(1), scene%tools(1), scene%levels(1), scene%probes(1))
      allocate (scene%body_contacts(1), scene%cuts(1))
      text = ''
      do kind = 1, size(group_words)
         call group%begin()
         call describe_group(trim(group_words(kind)), group, 1, material_names, catalogue, scene)
         text = text//listed(trim(group_words(kind)), group%names())
      end do
      do kind = 1, size(catalogue%effects)
         call group%begin()
         allocate (effect, source=catalogue%effects(kind)%it)
         call effect%variables(group)
         text = text//listed(effect%name, group%names())
         deallocate (effect)
      end do
   contains
      function listed(kind, names) result(lines)
         character(len=*), intent(in) :: kind, names(:)
         character(len=:), allocatable :: lines
         integer :: i
         lines = ''
         do i = 1, size(names)
            lines = lines//kind//' '//trim(names(i))//new_line('a')
         end do
      end function listed
   end function known_variables

   !> Read or write the number-th group of its kind.
   subroutine describe_group(kind, group, number, material_names, catalogue, scene)
      character(len=*), intent(in) :: kind
      type(group_reader_t), intent(inout) :: group
      integer, intent(in) :: number
      character(len=*), intent(in) :: material_names(:)
      type(catalogue_t), intent(in) :: catalogue
      type(scene_t), intent(inout) :: scene
      select case (kind)
      case ('scene')
         call describe_scene(group, scene)
      case ('grid')
         call describe_grid(group, scene%grid)
      case ('time')
         call describe_time(group, scene%time)
      case ('material')
         call describe_material(group, catalogue%models, scene%materials(number))
      case ('body')
         if (.not. allocated(scene%bodies(number)%name)) scene%bodies(number)%name = 'body'//to_text(number)
         call describe_body(group, material_names, scene%materials, scene%bodies(number))
      case ('cut')
         call describe_cut(group, scene%bodies, scene%cuts(number))
      case ('body_contact')
         call describe_body_contact(group, scene, scene%body_contacts(number), number)
      case ('tool')
         if (.not. allocated(scene%tools(number)%name)) scene%tools(number)%name = 'tool'//to_text(number)
         call describe_tool(group, scene%has_motions, scene%tools(number))
      case ('motion')
         call describe_nth_motion(group, number, scene%tools)
      case ('level')
         if (number > 1 .and. group%is_reading()) scene%levels(number)%of = scene%levels(number - 1)%of + 1
         call describe_level(group, scene, scene%levels(number))
      case ('probe')
         if (.not. allocated(scene%probes(number)%name)) scene%probes(number)%name = 'probe'//to_text(number)
         call group%get_name('name', scene%probes(number)%name)
         call group%get('position', scene%probes(number)%position, any_value('m'), required=.true.)
      case ('contact')
         call group%get('tolerance', scene%contact%tolerance, above(0.0_wp, '', at_most=hopeless_residual))
         call group%get('max_iterations', scene%contact%max_iterations, least=1)
         call group%get('compliance', scene%contact%compliance, above(0.0_wp, '', at_most=1.0_wp))
         call group%get('subcell', scene%contact%subcell, at_least(0.0_wp, '', at_most=1.0_wp))
      case ('quasi_static')
         call describe_quasi_static(group, scene%quasi_static)
      case ('guard')
         call describe_guard(group, scene%guard)
      case ('output')
         call describe_output(group, catalogue%formats, scene%output)
      case ('checkpoint')
         call describe_checkpoint(group, scene%checkpoint)
         if (scene%checkpoint%present .and. .not. scene%output%present) &
            call group%refuse('every', &
                              'a &checkpoint needs an &output, in whose directory checkpoints are written')
      end select
   end subroutine describe_group

   subroutine describe_scene(group, scene)
      type(group_reader_t), intent(inout) :: group
      type(scene_t), intent(inout) :: scene
      integer :: mode
      if (.not. allocated(scene%title)) scene%title = 'untitled'
      call group%get_text('title', scene%title, longest_title)
      call group%get('end_time', scene%end_time, above(0.0_wp, 's'), required=.true.)
      if (.not. group%is_writing()) then ! case.nml describes a run
         mode = merge(2, 1, scene%plans)
         call group%get_choice('mode', mode, mode_words)
         scene%plans = mode == 2
      end if
      if (.not. allocated(scene%restart)) scene%restart = ''
      ! case.nml describes the whole run
      if (.not. group%is_writing()) call group%get_text('restart', scene%restart, longest_path)
      if (scene%plans .and. scene%restart /= '') &
         call group%refuse('mode', 'a plan needs a whole run and cannot start from a checkpoint; allowed '// &
                           'without restart')
   end subroutine describe_scene

   subroutine describe_grid(group, grid)
      type(group_reader_t), intent(inout) :: group
      type(grid_spec_t), intent(inout) :: grid
      integer :: choices(6), sides(4)
      if (grid%section%is_flat() .or. .not. group%is_writing()) &
         call group%get_choice('geometry', grid%section%geometry, geometry_words)
      call get_corner(group, 'lower', grid, grid%lower)
      call get_corner(group, 'upper', grid, grid%upper)
      call group%get('cell_size', grid%cell_size, above(0.0_wp, 'm'), required=.true.)
      if (grid%section%is_flat() .and. group%values_given('upper') == 2) grid%upper(2) = grid%cell_size
      choices = grid%boundary + 1
      if (grid%section%is_flat() .and. group%values_given('boundary') == 4) then
         sides = choices([1, 2, 5, 6])
         call group%get_choices('boundary', sides, boundary_words)
         choices([1, 2, 5, 6]) = sides
         choices(3:4) = boundary_symmetry + 1
      else if (grid%section%is_flat() .and. group%is_reading() .and. .not. group%is_given('boundary')) then
         choices(3:4) = boundary_symmetry + 1
      else
         group%fewer = 4
         call group%get_choices('boundary', choices, boundary_words)
      end if
      grid%boundary = max(choices, 1) - 1
   end subroutine describe_grid

   !> A corner of the grid; for a section x and z are enough.
   subroutine get_corner(group, name, grid, corner)
      type(group_reader_t), intent(inout) :: group
      character(len=*), intent(in) :: name
      type(grid_spec_t), intent(in) :: grid
      real(wp), intent(inout) :: corner(3)
      real(wp) :: pair(2)
      if (grid%section%is_flat() .and. group%values_given(name) == 2) then
         pair = 0.0_wp
         call group%get(name, pair, any_value('m'), required=.true.)
         corner = [pair(1), 0.0_wp, pair(2)]
      else
         group%fewer = 2
         call group%get(name, corner, any_value('m'), required=.true.)
      end if
   end subroutine get_corner

   subroutine describe_time(group, time)
      type(group_reader_t), intent(inout) :: group
      type(time_spec_t), intent(inout) :: time
      integer :: velocity_update, transfer
      logical :: flip
      call group%get('safety', time%safety, above(0.0_wp, '', at_most=maxval(safety_allowed)))
      if (.not. group%is_writing()) & ! the same under its other name
         call group%get('cfl', time%safety, above(0.0_wp, '', at_most=maxval(safety_allowed)))
      if (group%is_given('cfl') .and. group%is_given('safety')) &
         call group%refuse('cfl', 'is a synonym of safety; give one of the two')
      call group%get('time_step', time%time_step, at_least(0.0_wp, 's'))
      call group%get_choice('stress_update', time%stress_update, stress_update_words)
      transfer = merge(1, 2, time%affine)
      call group%get_choice('transfer', transfer, transfer_words)
      time%affine = transfer == 1
      call group%get_choice('domain', time%domain, domain_words)
      call group%get('subcycle', time%subcycle)
      velocity_update = 1
      call group%get_choice('velocity_update', velocity_update, velocity_update_words)
      flip = velocity_update /= 2
      call group%get('flip_fraction', time%flip_fraction, at_least(0.0_wp, '', at_most=1.0_wp), used=flip)
      if (.not. flip) time%flip_fraction = 0.0_wp
   end subroutine describe_time

   subroutine describe_guard(group, guard)
      type(group_reader_t), intent(inout) :: group
      type(guard_spec_t), intent(inout) :: guard
      call group%get('retries', guard%retries, least=0)
      if (guard%retries > max_retries) call group%refuse('retries', 'must be at most '// &
                                                          to_text(max_retries))
      call group%get('save_every', guard%save_every, least=1)
      call group%get('memory', guard%memory, at_least(0.0_wp, 'bytes'))
      call group%get('energy_limit', guard%energy_limit, at_least(0.0_wp, '', at_most=1.0_wp))
      call group%get('work_limit', guard%work_limit, at_least(0.0_wp, ''))
      call group%get('step_limit', guard%step_limit, at_least(0.0_wp, '', at_most=0.5_wp))
   end subroutine describe_guard

   subroutine describe_output(group, formats, output)
      type(group_reader_t), intent(inout) :: group
      character(len=name_length), intent(in) :: formats(:) !< available ones, the default first
      type(output_spec_t), intent(inout) :: output
      logical :: chosen(size(formats) + 1), fields(4)
      integer :: f
      if (.not. allocated(output%directory)) output%directory = ''
      call group%get_text('directory', output%directory, longest_path, required=.true.)
      call group%get('every', output%every, at_least(0.0_wp, 's'))
      call group%get('history_every', output%history_every, at_least(0.0_wp, 's'))
      if (.not. allocated(output%formats)) output%formats = formats(:1)
      associate (n => size(formats))
         chosen(:n) = [(output%writes(formats(f)), f=1, n)]
         chosen(n + 1) = .not. any(chosen(:n))
         call group%get_set('formats', chosen, [formats, [character(len=name_length) :: 'none']])
         if (chosen(n + 1) .and. any(chosen(:n))) call group%refuse('formats', 'none must stand alone')
         output%formats = pack(formats, chosen(:n))
      end associate
      fields = [output%displacement, output%strain, output%gradient, .false.]
      fields(4) = .not. any(fields)
      call group%get_set('fields', fields, field_words)
      if (fields(4) .and. any(fields(1:3))) call group%refuse('fields', 'none must stand alone')
      output%displacement = fields(1)
      output%strain = fields(2)
      output%gradient = fields(3)
   end subroutine describe_output

   !> Without other settings, checkpoints are made by wall-clock time.
   subroutine describe_checkpoint(group, checkpoint)
      type(group_reader_t), intent(inout) :: group
      type(checkpoint_spec_t), intent(inout) :: checkpoint
      if (.not. (group%is_writing() .or. group%is_given('every') .or. group%is_given('every_steps'))) &
         checkpoint%every_wall = default_every_wall
      call group%get('every', checkpoint%every, at_least(0.0_wp, 's'))
      call group%get('every_wall', checkpoint%every_wall, at_least(0.0_wp, 's'))
      call group%get('every_steps', checkpoint%every_steps, least=0)
      call group%get('wall_limit', checkpoint%wall_limit, at_least(0.0_wp, 's'))
   end subroutine describe_checkpoint

end module m_scene_groups
