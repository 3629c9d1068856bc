!> The introduction of a run or a plan: the model built from the scene.
module m_introduction
   use, intrinsic :: iso_fortran_env, only: compiler_version
   use m_kinds, only: wp, i8
   use m_text, only: to_text, si
   use m_constants, only: program_version
   use m_machine, only: date_text, find_crowd
   use m_launcher, only: tasks_of_job
   use m_material, only: material_t
   use m_domain_kinds, only: domain_kinds
   use m_scene, only: scene_t, body_contact_spec_t, criterion_error, start_as_is, &
                      because_law, because_surface, preconditioner_gamg
   use m_offer, only: catalogue_t
   use m_field_table, only: field_table_t, bytes_per_column
   use m_level, only: level_t
   use m_model, only: model_t
   use m_time_step, only: next_time_step
   use m_console, only: console_t
   use m_fill_report, only: introduce_shares
   use m_grain_report, only: introduce_grains
   implicit none
   private
   public :: introduce, own_bytes, own_blocks

   real(wp), parameter :: min_zone_cells = 3.0_wp !< of a cohesive zone

contains

   !> Memory (bytes) of a level's blocks on this rank.
   elemental integer(i8) function own_bytes(level)
      type(level_t), intent(in) :: level
      own_bytes = level%bytes()
   end function own_bytes

   elemental integer function own_blocks(level)
      type(level_t), intent(in) :: level
      own_blocks = size(level%blocks)
   end function own_blocks

   !> Collective: print the introduction.
   subroutine introduce(console, scene, catalogue, model, particles, memory)
      type(console_t), intent(inout) :: console
      type(scene_t), intent(in) :: scene
      type(catalogue_t), intent(in) :: catalogue
      type(model_t), intent(in) :: model
      integer(i8), intent(in) :: particles !< of all ranks
      real(wp), intent(out) :: memory      !< of particles and node tiles, bytes
      integer(i8) :: bytes, blocks
      integer :: cores, ranks
      real(wp) :: time_step
      bytes = model%communicator%sum_count(sum(own_bytes(model%levels) + model%exchange%held()))
      blocks = model%communicator%sum_count(int(sum(own_blocks(model%levels)), i8))
      memory = real(bytes, wp)
      time_step = next_time_step(scene, model)
      associate (grid => model%levels(1)%grid)
         call console%line('gimp3d: '//scene%title)
         call console%line('program    gimp3d '//program_version//', '//compiler_version()//', began '// &
                           date_text())
         call console%line('grid       '//to_text(grid%cells(1))//' x '//to_text(grid%cells(2))//' x '// &
                                to_text(grid%cells(3))//' cells of '//si(grid%cell, 'm')//', '// &
                                to_text(blocks)//' blocks with material')
         if (size(model%levels) > 1) call introduce_levels(console, model, time_step)
         call console%line('particles  '//to_text(particles)//' on '//to_text(model%communicator%ranks)// &
                           ' rank(s), '//si(real(bytes, wp), 'B')//' in all, '// &
                           to_text(real(bytes, wp)/particles, 3)//' B a particle')
         call introduce_shares(console, scene, model)
         call introduce_grains(console, scene, model)
         if (model%time < scene%end_time .and. scene%quasi_static%holds_at(model%time)) then
            call console%line('time       '//si(scene%end_time, 's')//' in quasi-static steps, the first '// &
                              'of '//si(time_step, 's'))
         else if (model%time < scene%end_time) then
            call console%line('time       '//si(scene%end_time, 's')//' in steps of '//si(time_step, 's')// &
                              ', about '//to_text(ceiling(scene%end_time/time_step, i8))//' steps')
         else
            call console%line('time       '//si(scene%end_time, 's')// &
                              ': the run has reached its end; nothing is left to do')
         end if
         call console%line('fields     '//fields_text(model%levels(1)%table))
         if (scene%fields() > 1) call introduce_groups(console, scene, model)
         call console%line('effects    '//effects_text(scene, catalogue, model))
         call introduce_choices(console, scene)
      end associate
      if (.not. (scene%output%present .or. scene%plans)) &
         call console%line('warning    no &output: this run writes no files')
      call find_crowd(model%communicator, ranks, cores)
      if (ranks > cores) &
         call console%line('warning    '//to_text(ranks)//' ranks share '//to_text(cores)// &
                           ' core(s) of a machine: cores are '// &
                           'oversubscribed; use at most as many ranks as cores')
      if (model%communicator%ranks == 1 .and. tasks_of_job() > 1) &
         call console%line('warning    one rank in a job of '//to_text(tasks_of_job())// &
                           ' tasks (SLURM_NTASKS); '//'start it by mpirun or srun to use all')
      if (allocated(model%atoms)) call console%line(model%atoms%note)
   end subroutine introduce

   !> The contact groups, and the contact between them.
   subroutine introduce_groups(console, scene, model)
      type(console_t), intent(inout) :: console
      type(scene_t), intent(in) :: scene
      type(model_t), intent(in) :: model
      type(body_contact_spec_t) :: spec
      real(wp) :: zone
      integer :: g, h
      do h = 2, scene%fields()
         do g = 1, h - 1
            spec = scene%contact_of(g, h)
            call console%line('contact    '//scene%group_label(g)//' and '//scene%group_label(h)// &
                              ': '//spec%friction%text()//adhesion_text(spec))
            if (.not. spec%adhesion > 0.0_wp) cycle
            zone = cohesive_zone(scene, model, spec)/model%levels(size(model%levels))%grid%cell
            if (zone < min_zone_cells) call console%line('coarse     cohesive zone under-resolved: '// &
               'adhesion between '// &
               scene%group_label(g)//' and '//scene%group_label(h)//' acts over a zone of about '// &
               to_text(zone, 2)//' cells at the edge of contact; below '//to_text(min_zone_cells)// &
               ' the pull-off force is overestimated; use smaller cells, or a weaker adhesion over a '// &
               'longer range')
         end do
      end do
   end subroutine introduce_groups

   !> Length (m) of the cohesive zone at the edge of contact, pi/8 E* work/stress**2 (theory.md, eq.
   !> cohesive-zone), with the stiffness of the softer body.
   real(wp) function cohesive_zone(scene, model, spec) result(length)
      type(scene_t), intent(in) :: scene
      type(model_t), intent(in) :: model
      type(body_contact_spec_t), intent(in) :: spec
      real(wp), parameter :: plane = 0.4_wp !< E* of two equal bodies over their P-wave modulus, at a
                                            !< Poisson's ratio of 0.3
      real(wp) :: stress
      stress = spec%bond_strength
      if (.not. stress > 0.0_wp) stress = spec%adhesion/spec%cohesive_range
      length = 0.3927_wp*plane*minval(model%stuff%modulus, mask=scene%bodies%field == spec%groups(1) &
                                      .or. scene%bodies%field == spec%groups(2))*spec%adhesion/stress**2
   end function cohesive_zone

   pure function adhesion_text(spec) result(text)
      type(body_contact_spec_t), intent(in) :: spec
      character(len=:), allocatable :: text
      text = ''
      if (spec%bond_strength > 0.0_wp) then
         text = ', bonded up to '//si(spec%bond_strength, 'Pa')//' and '//si(spec%adhesion, 'J/m2')
      else if (spec%adhesion > 0.0_wp) then
         text = ', adhesion '//si(spec%adhesion, 'J/m2')//' over '//si(spec%cohesive_range, 'm')
      end if
      if (spec%start == start_as_is) text = text//', may overlap at the start'
      if (spec%press_fit > 0.0_wp) text = text//', which is pressed out in '//si(spec%press_fit, 's')
   end function adhesion_text

   !> The program's choices where the scene leaves them open, their cost, and the setting that turns them off.
   subroutine introduce_choices(console, scene)
      type(console_t), intent(inout) :: console
      type(scene_t), intent(in) :: scene
      character(len=:), allocatable :: cure, why
      if (scene%chose_domain > 0) then
         select case (scene%chose_domain)
         case (because_law); why = 'because the law is made for large strains'
         case (because_surface); why = 'because a pressed surface may cut particles'
         case default; why = 'because a tool may penetrate far with one particle a cell'
         end select
         if (scene%quasi_static%present) then
            call console%line("chosen     domain='stretch', "//why)
         else
            call console%line("chosen     domain='corners', "//why//"; 1.5 to 3 times the time of 'fixed'")
         end if
      end if
      if (.not. allocated(scene%brought)) return
      if (scene%brought /= '') &
         call console%line('chosen     '//scene%brought//', against locking in plastic flow; up to a '// &
                           'quarter more time; &'//scene%brought//" kind='none' / switches it off")
      if (.not. may_lock(scene)) return
      cure = '&anti_locking removes both for up to a quarter more time'
      if (scene%quasi_static%preconditioner == preconditioner_gamg) &
         cure = "it needs preconditioner='bpx', not 'gamg'"
      call console%line('may lock   nearly incompressible or plastic material without &anti_locking: '// &
                        'expect volumetric locking (too stiff) and pressure oscillations; '//cure)
   end subroutine introduce_choices

   !> True when a body with several particles a cell is nearly incompressible, by plastic flow or a Poisson's
   !> ratio above 0.45, without a remedy against locking.
   pure logical function may_lock(scene)
      type(scene_t), intent(in) :: scene
      real(wp), parameter :: modulus_ratio = 11.0_wp/3.0_wp !< plane-wave modulus over von Mises stress at
                                                            !< 0.45
      integer :: b, e
      may_lock = .false.
      do b = 1, size(scene%bodies)
         if (scene%bodies(b)%particles_per_cell == 1) cycle
         select type (law => scene%materials(scene%bodies(b)%material)%law)
         class is (material_t)
            may_lock = may_lock .or. law%default_effect() == 'anti_locking' &
                       .or. (law%von_mises_modulus() > 0.0_wp .and. law%p_wave_modulus() &
                             > modulus_ratio*law%von_mises_modulus()*(1.0_wp + 1.0e-9_wp))
         end select
      end do
      do e = 1, size(scene%effects)
         if (scene%effects(e)%it%name == 'anti_locking' .and. .not. scene%effects(e)%it%declined()) &
            may_lock = .false.
      end do
   end function may_lock

   !> Collective: a line a level, and the cells of all levels beside those of a uniform grid as fine.
   subroutine introduce_levels(console, model, time_step)
      type(console_t), intent(inout) :: console
      type(model_t), intent(in) :: model
      real(wp), intent(in) :: time_step !< of the coarsest level, s
      real(wp) :: lower(3), upper(3), step
      integer(i8) :: blocks, cells, finest, own(size(model%levels)), particles
      integer :: l, n, part
      n = size(model%levels)
      step = time_step
      do l = 1, n
         associate (level => model%levels(l), grid => model%levels(l)%grid)
            call level%region%bounding_box(lower, upper)
            if (l > 1 .and. model%method%subcycle) step = 0.5_wp*step
            own(l) = level%region%cells()
            if (l < n) own(l) = own(l) - model%levels(l + 1)%region%cells() &
                                /merge(4, 8, grid%section%is_flat())
            blocks = model%communicator%sum_count(int(size(level%blocks), i8))
            particles = model%communicator%sum_count(level%particle_count())
            call console%line('level '//to_text(l)//'    '//place_text(lower)//' to '//place_text(upper)// &
                              ', '//to_text(level%region%cells())//' cells of '//si(grid%cell, 'm')//', '// &
                              to_text(blocks)//' blocks, '//to_text(particles)//' particles, steps of '// &
                              si(step, 's'))
         end associate
      end do
      associate (specs => model%level_specs, by_error => model%level_specs%criterion == criterion_error)
         if (any(by_error)) then
            part = findloc(by_error, .true., dim=1)
            call console%line('budget     '//to_text(specs(part)%max_cells)// &
                              ' cells of all levels that the error '// &
                              'places together, '//to_text(sum([(model%levels(l)%region%cells(), &
                                                                 l=specs(part)%of + 1, n)]))//' at the start')
         end if
      end associate
      cells = sum(own)
      finest = product(int(model%levels(n)%grid%cells, i8))
      if (model%levels(n)%grid%section%is_flat()) finest = finest/model%levels(n)%grid%cells(2)
      call console%line('cells      '//to_text(cells)//' on all levels, '// &
                        to_text(100.0_wp*cells/finest, 3)//' % of the '// &
                             to_text(finest)//' of a grid as fine as level '//to_text(n)//' everywhere')
   end subroutine introduce_levels

   function place_text(place) result(text)
      real(wp), intent(in) :: place(3) !< m
      character(len=:), allocatable :: text
      text = '('//to_text(place(1))//', '//to_text(place(2))//', '//to_text(place(3))//')'
   end function place_text

   !> The fields of a particle, with their numbers of columns.
   function fields_text(table) result(text)
      type(field_table_t), intent(in) :: table
      character(len=:), allocatable :: text
      integer :: f
      text = ''
      do f = 1, size(table%fields)
         text = text//table%fields(f)%name//' '//to_text(table%fields(f)%components)//', '
      end do
      text = text//'together '//to_text(bytes_per_column*table%columns)//' B a particle'
   end function fields_text

   !> The effects of the scene, with the bytes a particle that they add, and the other available ones.
   function effects_text(scene, catalogue, model) result(text)
      type(scene_t), intent(in) :: scene
      type(catalogue_t), intent(in) :: catalogue
      type(model_t), intent(in) :: model
      character(len=:), allocatable :: text, off
      integer :: e, k
      text = ''
      off = ''
      associate (table => model%levels(1)%table, effects => model%effects)
         call add(scene%time%affine, 'affine transfer', table%bytes_of('velocity_gradient'))
         call add(domain_kinds(scene%time%domain)%deforms, 'deforming domains', &
                  table%bytes_of('domain') + table%bytes_of('half_size') + table%bytes_of('generation') &
                  - bytes_per_column)
         call add(size(scene%tools) > 0, 'tool contact', table%bytes_of('contact_pressure') &
                  + table%bytes_of('last_contact_pressure') + table%bytes_of('contact_gap') &
                  + table%bytes_of('contact_deflection') + table%bytes_of('contact_velocity'))
         call add(scene%fields() > 1, 'contact between bodies', table%bytes_with('surface_'))
         call add(model%contact%friction%present, 'friction', table%bytes_of('contact_friction') &
                  + table%bytes_of('contact_shear_deflection'))
         call add(size(scene%probes) > 0, 'probes', 0)
         do k = 1, size(catalogue%effects)
            associate (name => catalogue%effects(k)%it%name)
               if (all([(effects(e)%effect%name /= name, e=1, size(effects))])) call add(.false., name, 0)
               do e = 1, size(effects)
                  if (effects(e)%effect%name == name) &
                     call add(.true., name, bytes_per_column*effects(e)%columns)
               end do
            end associate
         end do
      end associate
      if (text == '') text = 'none'
      if (off /= '') text = text//'; left out: '//off
   contains
      subroutine add(on, name, bytes)
         logical, intent(in) :: on
         character(len=*), intent(in) :: name
         integer, intent(in) :: bytes !< per particle
         if (on) then
            if (text /= '') text = text//', '
            text = text//name//' ('//to_text(bytes)//' B a particle)'
         else
            if (off /= '') off = off//', '
            off = off//name
         end if
      end subroutine add
   end function effects_text

end module m_introduction
