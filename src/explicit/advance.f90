!> One step of the model, explicit in time: every level takes its step inside that of the next coarser one
!> (theory.md, eqs half-steps, time-levels).
module m_advance
   use mpi_f08
   use m_kinds, only: wp
   use m_errors, only: error_t
   use m_timers
   use m_scene, only: update_usl, update_usf, update_musl
   use m_clock, only: clock_t
   use m_model, only: model_t, bounds_t
   use m_integrator, only: integrator_t
   use m_node_exchange, only: sum_tiles
   use m_residence, only: change_pair
   use m_pressed_speeds, only: find_pressed, keep_pressed_speeds
   use m_contact_complaints, only: forbid_contact
   use m_complaints, only: report_homeless
   use m_grid_stages, only: particles_to_grid
   use m_schedule, only: by_blocks, shared_sums, nodal_solve, grid_to_particles, velocity_gradient, stress, &
                         cells
   implicit none
   private
   public :: explicit_t, advance, migrate

   !> The explicit step: momentum on the nodes, leapfrog in time.
   type, extends(integrator_t) :: explicit_t
   contains
      procedure :: step => step_explicit
   end type explicit_t

contains

   !> Collective: as `advance`.
   subroutine step_explicit(self, model, time_step, error)
      class(explicit_t), intent(inout) :: self
      type(model_t), intent(inout) :: model
      real(wp), intent(in) :: time_step
      type(error_t), intent(inout) :: error
      call advance(model, time_step, error)
   end subroutine step_explicit

   !> Collective: advance the model by one step of its coarsest level.
   subroutine advance(model, time_step, error)
      type(model_t), intent(inout) :: model
      real(wp), intent(in) :: time_step !< s
      type(error_t), intent(inout) :: error
      type(clock_t) :: clock
      clock = clock_t(model%time, time_step)
      model%null_space_share = model%share_of_unseen(time_step)
      model%last_step = time_step
      model%bounds = bounds_t()
      call model%uncovered%clear()
      if (model%method%stress_update == update_usf) call stress_first(model, clock, error)
      call p2g_levels(model, 1, clock, error)
      call advance_level(model, 1, clock, error)
      if (error%happened()) return
      if (model%contact%pairs%active() .and. any(model%effect_step%erodes)) &
         call model%uncovered%give(model%communicator, model%levels)
      model%time = model%time + time_step
      model%step = model%step + 1
      call model%timers%on_level(0)
      if (size(model%levels) == 1) return
      call model%timers%enter(model%levels_row)
      call model%prepare_blocks()
      call model%timers%leave()
   end subroutine advance

   !> Collective: one step of a level, after P2G of its particles and those of all finer levels, and within it
   !> the steps of the finer levels.
   recursive subroutine advance_level(model, l, clock, error)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l
      type(clock_t), intent(in) :: clock
      type(error_t), intent(inout) :: error
      call model%timers%on_level(l)
      if (asks_for_all(model)) then
         call by_blocks(model, l, clock, [shared_sums, nodal_solve], error)
         if (allocated(model%atoms)) call couple_atoms(model, l, clock, error)
         if (error%happened()) return ! on all ranks
         call apply_contact(model, l, clock, error)
         if (l < size(model%levels)) call advance_finer(model, l, clock, error)
         if (error%happened() .and. l < size(model%levels)) return ! on all ranks, which have the same error
         call model%timers%on_level(l)
         call by_blocks(model, l, clock, particle_stages(model), error)
      else
         call by_blocks(model, l, clock, [shared_sums, nodal_solve, particle_stages(model)], error)
      end if
      if (model%method%stress_update == update_musl) call stress_last(model, l, clock, error)
      call finish_contact(model, l, clock, error)
      call migrate(model, l, error)
   end subroutine advance_level

   !> True when the motion of all nodes must be complete before the G2P of any particle.
   pure logical function asks_for_all(model)
      type(model_t), intent(in) :: model
      asks_for_all = model%contact%active() .or. size(model%levels) > 1 .or. allocated(model%atoms)
   end function asks_for_all

   !> Collective: advance the atoms, which are in the finest level, through its step.
   subroutine couple_atoms(model, l, clock, error)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l
      type(clock_t), intent(in) :: clock
      type(error_t), intent(inout) :: error
      if (l < size(model%levels)) return
      call model%timers%enter(model%atoms%timer)
      call model%atoms%couple(model%communicator, model%levels(l), l > 1, model%contact%tools, clock%time, &
                              clock%step, error)
   end subroutine couple_atoms

   !> The particle stages of the main part of a step, by the stress update scheme.
   pure function particle_stages(model) result(stages)
      type(model_t), intent(in) :: model
      integer, allocatable :: stages(:)
      select case (model%method%stress_update)
      case (update_usl); stages = [grid_to_particles, stress, cells]
      case (update_usf); stages = [grid_to_particles, cells]
      case default; stages = [grid_to_particles]
      end select
   end function particle_stages

   !> USF: the stress is updated first, from the particles' present velocities. (One level.)
   subroutine stress_first(model, clock, error)
      type(model_t), intent(inout) :: model
      type(clock_t), intent(in) :: clock
      type(error_t), intent(inout) :: error
      call p2g_levels(model, 1, clock, error)
      call by_blocks(model, 1, clock_t(clock%time), [shared_sums, nodal_solve], error)
      call meet_tools(model, 1, clock, .true.)
      call by_blocks(model, 1, clock, [velocity_gradient, stress], error)
   end subroutine stress_first

   !> MUSL: the stress is updated last, from the particles' new velocities; then they move. (One level.)
   subroutine stress_last(model, l, clock, error)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l
      type(clock_t), intent(in) :: clock
      type(error_t), intent(inout) :: error
      call particles_to_grid(model, l, clock%time, clock%step)
      call by_blocks(model, l, clock_t(clock%time), [shared_sums, nodal_solve], error)
      call meet_tools(model, l, clock, .false.)
      call by_blocks(model, l, clock, [velocity_gradient, stress], error)
      call by_blocks(model, l, clock, [cells], error)
   end subroutine stress_last

   !> P2G of a level and all finer ones, the finest first: each restricts the sums of its constrained nodes to
   !> the next. Levels exchange sums, so with several levels these are made here.
   subroutine p2g_levels(model, first, clock, error)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: first !< 1, or the level that starts its second step within one of its parent
      type(clock_t), intent(in) :: clock !< of that level
      type(error_t), intent(inout) :: error
      real(wp) :: own_step
      integer :: l
      do l = size(model%levels), first, -1
         call model%timers%on_level(l)
         own_step = clock%step
         if (model%method%subcycle) own_step = 0.5_wp**(l - first)*clock%step
         call particles_to_grid(model, l, clock%time, own_step)
         if (size(model%levels) > 1) call by_blocks(model, l, clock, [shared_sums], error)
         if (l == 1) cycle
         call model%timers%enter(model%levels_row)
         if (l == first) then
            call model%composite(l)%restrict_change(model%communicator, model%levels(l))
         else
            call model%composite(l)%restrict(model%communicator, model%levels(l), &
                                             merge(own_step, 0.0_wp, model%method%subcycle))
         end if
      end do
   end subroutine p2g_levels

   !> Collective: apply contact to the nodes of the finest level; on other levels contact is an error.
   subroutine apply_contact(model, l, clock, error)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l
      type(clock_t), intent(in) :: clock
      type(error_t), intent(inout) :: error
      if (.not. model%contact%active()) return
      call model%timers%enter(phase_contact)
      if (l == size(model%levels)) then
         call model%contact%apply(model%communicator, model%levels(l), model%materials, &
                                  clock%time, clock%step, error)
         if (.not. allocated(model%atoms)) return
         call model%atoms%push_tools(model%contact%reactions, clock%step)
         call model%atoms%follow_contact(model%communicator, model%levels(l), model%contact%has_problem)
      else
         call forbid_contact(model%contact%tools, model%levels(l), model%levels(size(model%levels)), error)
         if (model%contact%pairs%active()) &
            call model%contact%pairs%forbid(model%communicator, model%levels(l), &
                                            model%levels(size(model%levels)), error)
         call model%communicator%agree(error) ! else one rank alone would leave the steps of finer levels
      end if
   end subroutine apply_contact

   !> Collective: loads, work and reports of the contact solution, at the end of a step of the finest level.
   subroutine finish_contact(model, l, clock, error)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l
      type(clock_t), intent(in) :: clock
      type(error_t), intent(inout) :: error
      call model%timers%enter(phase_control)
      if (.not. model%contact%active() .or. l < size(model%levels)) return
      call model%contact%finish_step(model%communicator, model%levels(l), clock%time + clock%step, &
                                     clock%step, error)
      if (allocated(model%atoms)) call model%atoms%accumulate(model%contact%tools)
   end subroutine finish_contact

   !> Collective: apply the contact velocities of pressed points to the nodes of a separate stress solution.
   subroutine meet_tools(model, l, clock, first)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l
      type(clock_t), intent(in) :: clock
      logical, intent(in) :: first !< before the step's own contact
      if (.not. model%contact%active()) return
      call model%timers%enter(phase_contact)
      if (first) &
         call find_pressed(model%contact, model%communicator, model%levels(l), model%materials, &
                           clock%time, clock%step)
      call keep_pressed_speeds(model%contact, model%communicator, model%levels(l), clock%step)
   end subroutine meet_tools

   !> Collective: the steps of the next finer level within one of level l: two, between which level l is
   !> corrected by the actual contributions of the first and those of the second; or one, if all levels have
   !> one time step.
   recursive subroutine advance_finer(model, l, clock, error)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l
      type(clock_t), intent(in) :: clock
      type(error_t), intent(inout) :: error
      real(wp) :: half, ahead
      call model%timers%on_level(l + 1)
      call model%timers%enter(model%levels_row)
      if (model%composite(l + 1)%corrects_lag) call sum_lag_force(model, l)
      call model%composite(l + 1)%prolong(model%communicator, model%levels(l))
      if (.not. model%method%subcycle) then
         call advance_level(model, l + 1, clock_t(clock%time, clock%step, ends=clock%ends), error)
         return
      end if
      half = 0.5_wp*clock%step
      ahead = 0.5_wp*half
      if (model%mixes()) ahead = 0.0_wp ! eq. time-levels: not with PIC
      call advance_level(model, l + 1, clock_t(clock%time, half, half - ahead, ends=.false.), error)
      if (error%happened()) return
      call p2g_levels(model, l + 1, clock_t(clock%time + half, half), error)
      call model%timers%on_level(l + 1)
      call correct(model, l, clock)
      call advance_level(model, l + 1, clock_t(clock%time + half, half, -ahead, ends=clock%ends), error)
   end subroutine advance_finer

   !> Collective: sum the finer level's force of the accumulated stress on the nodes of level l (theory.md,
   !> eq. lag).
   subroutine sum_lag_force(model, l)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l
      associate (level => model%levels(l), composite => model%composite(l + 1))
         call composite%collect_lag_force(level)
         call sum_restricted(model, l)
         call composite%keep_lag_force(level)
      end associate
   end subroutine sum_lag_force

   !> Collective: sum over blocks and ranks the values restricted by the next finer level to level l, where
   !> constrained nodes depend on them.
   subroutine sum_restricted(model, l)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l
      call model%timers%enter(phase_exchange)
      associate (level => model%levels(l))
         call model%exchange(l)%start(level%restricted)
         call model%exchange(l)%wait(level%restricted)
         call model%timers%enter(model%levels_row)
         call sum_tiles(level%blocks, level%interior_first, level%restricted, &
                        model%composite(l + 1)%depended%extent)
      end associate
   end subroutine sum_restricted

   !> Collective: correct the solved nodes of level l by the two steps of the finer level.
   subroutine correct(model, l, clock)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l
      type(clock_t), intent(in) :: clock
      associate (level => model%levels(l), composite => model%composite(l + 1))
         call composite%collect_change(level)
         call sum_restricted(model, l)
         call composite%correct(model%communicator, level, clock%step, &
                                model%null_space_share*model%method%flip_fraction)
      end associate
   end subroutine correct

   !> Collective: move particles to their present blocks, and those of the next finer level to their levels.
   subroutine migrate(model, l, error)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l
      type(error_t), intent(inout) :: error
      logical :: blocks_missing
      call agree(model, l, blocks_missing, error)
      if (error%happened()) return
      call model%timers%enter(phase_migration)
      if (blocks_missing) then
         call model%create_blocks()
         call model%migration(l)%assign_to_blocks(model%communicator, model%levels(l))
      end if
      call model%migration(l)%exchange(model%communicator, model%levels(l), model%exchange(l)%ranks)
      model%particle_steps = model%particle_steps + model%levels(l)%particle_count()
      model%level_steps(l) = model%level_steps(l) + model%levels(l)%particle_count()
      if (l < size(model%levels)) call change_pair(model, l, error)
      call model%timers%leave()
   end subroutine migrate

   !> Collective, one reduction: largest speeds for the next time step, whether blocks are missing, whether a
   !> rank failed, and requests to the run. With several levels blocks are created before particles can reach
   !> them: one is missing if a particle has moved too far.
   subroutine agree(model, l, blocks_missing, error)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l
      logical, intent(out) :: blocks_missing
      type(error_t), intent(inout) :: error
      integer, parameter :: wave = 1, particle = 2, missing = 3, failed = 4, requested = 5
      real(wp) :: largest(5)
      largest(wave) = model%bounds%wave_speed
      largest(particle) = model%bounds%particle_speed
      largest(missing) = merge(1.0_wp, 0.0_wp, model%migration(l)%unassigned%count > 0)
      largest(failed) = merge(1.0_wp, 0.0_wp, error%happened())
      largest(requested) = real(model%requested_action, wp)
      call MPI_Allreduce(MPI_IN_PLACE, largest, size(largest), MPI_DOUBLE_PRECISION, MPI_MAX, &
                         model%communicator%comm)
      model%bounds%wave_speed = largest(wave)
      model%bounds%particle_speed = largest(particle)
      model%requested_action = nint(largest(requested))
      blocks_missing = largest(missing) > 0.0_wp
      if (blocks_missing .and. size(model%levels) > 1) then
         call report_homeless(model, l, error)
         largest(failed) = 1.0_wp
      end if
      if (largest(failed) > 0.0_wp) call model%communicator%agree(error)
   end subroutine agree

end module m_advance
