!> One step of the model: every level takes its step inside that of the next coarser one (theory.md, eqs half-steps, labels).
module m_advance
   use mpi_f08
   use m_kinds, only: wp, i8
   use m_errors, only: error_t
   use m_timers
   use m_node_values, only: node_values, tile_last
   use m_scene, only: update_usl, update_usf, update_musl
   use m_model, only: model_t, bounds_t
   use m_migration, only: entered
   use m_node_exchange, only: sum_tiles
   use m_residence, only: change_pair
   use m_move_regions, only: move_regions
   use m_pressed_speeds, only: find_pressed, keep_pressed_speeds
   use m_contact_complaints, only: forbid_contact
   use m_complaints, only: check_missing
   use m_node_step, only: clock_t, to_nodes, solve
   use m_particle_step, only: to_particles, strain, take_next_position, pack_emigrants, prepare_next_p2g
   implicit none
   private
   public :: advance

contains

   !> Collective: advance the model by one step of its coarsest level.
   subroutine advance(model, time_step, error)
      type(model_t), intent(inout) :: model
      real(wp), intent(in) :: time_step !< s
      type(error_t), intent(inout) :: error
      model%unseen = model%share_of_unseen(time_step)
      model%last_step = time_step
      if (model%follows_speeds) model%bounds = bounds_t()
      if (model%method%stress_update == update_usf) then
         call p2g_levels(model, 1, model%time, time_step)
         call solve(model, 1, clock_t(model%time))
         call meet_tools(model, 1, clock_t(model%time, time_step), .true.)
         call strain(model, 1, time_step, error)                       ! 6, first
      end if
      call p2g_levels(model, 1, model%time, time_step)              ! 1, 2, 3
      call advance_level(model, 1, clock_t(model%time, time_step), error)
      if (error%happened()) return
      model%time = model%time + time_step
      model%step = model%step + 1
      call model%timers%on_level(0)
      if (size(model%levels) == 1) return
      call model%timers%enter(model%levels_row)
      call model%prepare_blocks()
      call move_regions(model, error)
      call model%timers%leave()
   end subroutine advance

   !> 1, 2, 3 on a level and all finer ones, the finest first: each restricts what its constrained nodes were given.
   subroutine p2g_levels(model, first, time, time_step)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: first      !< 1, or the level that begins its second step within one of its parent
      real(wp), intent(in) :: time      !< s
      real(wp), intent(in) :: time_step !< of level `first`, s
      real(wp) :: own_step
      integer :: l
      do l = size(model%levels), first, -1
         call model%timers%on_level(l)
         call to_nodes(model, l, time)
         if (l == 1) cycle
         call model%timers%enter(model%levels_row)
         own_step = 0.0_wp
         if (model%method%subcycle) own_step = 0.5_wp**(l - first)*time_step
         if (l == first) then
            call model%composite(l)%restrict_change(model%communicator, model%levels(l))
         else
            call model%composite(l)%restrict(model%communicator, model%levels(l), own_step)
         end if
      end do
   end subroutine p2g_levels

   !> Collective: one step of a level, whose nodes hold the sums of its beginning, and within it the steps of the finer levels.
   recursive subroutine advance_level(model, l, clock, error)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l
      type(clock_t), intent(in) :: clock
      type(error_t), intent(inout) :: error
      integer :: update
      logical :: all_solved !< for the motion of all nodes, before particles move
      update = model%method%stress_update
      call model%timers%on_level(l)
      all_solved = model%contact%active() .or. size(model%levels) > 1
      if (all_solved) call solve(model, l, clock)                           ! 3 ends
      if (model%contact%active()) then                                 ! 4
         call model%timers%enter(phase_contact)
         if (l == size(model%levels)) then
            call model%contact%apply(model%communicator, model%levels(l), model%materials, model%exchange(l)%ranks, clock%time, &
                                    clock%step, error)
         else
            call forbid_contact(model%contact%tools, model%levels(l), model%levels(size(model%levels)), error)
         end if
      end if
      if (l < size(model%levels)) then
         call advance_finer(model, l, clock, error)
         if (error%happened()) return ! on all ranks: they have agreed
         call model%timers%on_level(l)
      end if
      call to_particles(model, l, clock, with_stress=update == update_usl, solved=all_solved, error=error) ! 3 if not yet, 5, 6, 7
      if (update == update_musl) then
         call to_nodes(model, l, clock%time)
         call solve(model, l, clock_t(clock%time))
         call meet_tools(model, l, clock, .false.)
         call strain(model, l, clock%step, error)                      ! 6, last
         call take_next_position(model, l, clock, error)               ! 7, late
      end if
      call model%timers%enter(phase_control)
      if (model%contact%active() .and. l == size(model%levels)) &
         call model%contact%finish_step(model%communicator, model%levels(l), clock%time + clock%step, clock%step, error)
      call move_particles(model, l, clock, error)
   end subroutine advance_level

   !> Collective: the nodes that only the stress is made from go with the points that tools press.
   subroutine meet_tools(model, l, clock, first)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l
      type(clock_t), intent(in) :: clock
      logical, intent(in) :: first !< before the step's own contact
      if (.not. model%contact%active()) return
      call model%timers%enter(phase_contact)
      if (first) call find_pressed(model%contact, model%communicator, model%levels(l), model%materials, model%exchange(l)%ranks, &
                                   clock%time, clock%step)
      call keep_pressed_speeds(model%contact, model%levels(l), clock%step)
   end subroutine meet_tools

   !> Collective: the steps of the next finer level within one of level l: two, between which level l is corrected by what the
   !> first really gave and the second will give; or one, where all levels have one time step.
   recursive subroutine advance_finer(model, l, clock, error)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l
      type(clock_t), intent(in) :: clock
      type(error_t), intent(inout) :: error
      real(wp) :: half, ahead
      call model%timers%on_level(l + 1)
      call model%timers%enter(model%levels_row)
      if (model%composite(l + 1)%labelled) call sum_grown(model, l)
      call model%composite(l + 1)%prolong(model%levels(l))
      call model%composite(l + 1)%send_prolonged(model%communicator)
      if (.not. model%method%subcycle) then
         call advance_level(model, l + 1, clock_t(clock%time, clock%step, ends=clock%ends), error)
         return
      end if
      half = 0.5_wp*clock%step
      ahead = 0.5_wp*half
      if (model%mixes()) ahead = 0.0_wp ! eq. labels: not with PIC
      call advance_level(model, l + 1, clock_t(clock%time, half, half - ahead, ends=.false.), error)
      if (error%happened()) return
      call p2g_levels(model, l + 1, clock%time + half, half)
      call model%timers%on_level(l + 1)
      call correct(model, l, clock)
      call advance_level(model, l + 1, clock_t(clock%time + half, half, -ahead, ends=clock%ends), error)
   end subroutine advance_finer

   !> Collective: the finer level's force that has grown, on the nodes of level l (theory.md, eq. lead).
   subroutine sum_grown(model, l)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l
      integer :: b
      associate (level => model%levels(l), composite => model%composite(l + 1))
         call composite%collect_grown(level)
         call sum_restricted(model, l)
         do b = 1, size(level%blocks)
            if (composite%receives(b)) call composite%keep_grown(b, level%restricted(:, :, :, :, b))
         end do
      end associate
   end subroutine sum_grown

   !> Collective: sums over blocks and ranks of what the next finer level has restricted up to level l, where constrained nodes
   !> depend on them.
   subroutine sum_restricted(model, l)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l
      call model%timers%enter(phase_exchange)
      associate (level => model%levels(l))
         call model%exchange(l)%start(model%communicator, level%restricted)
         call model%exchange(l)%wait(level%restricted)
         call model%timers%enter(model%levels_row)
         call sum_tiles(level%blocks, level%interior_first, level%restricted, wanted=model%composite(l + 1)%receives)
      end associate
   end subroutine sum_restricted

   !> Collective: the solved nodes of level l take what its own step does not know of the two steps of the finer level.
   subroutine correct(model, l, clock)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l
      type(clock_t), intent(in) :: clock
      real(wp) :: change(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      integer :: b
      associate (level => model%levels(l), composite => model%composite(l + 1))
         call composite%collect_change(level)
         call sum_restricted(model, l)
         do b = 1, size(level%blocks)
            if (.not. composite%receives(b)) cycle
            change = level%restricted(:, :, :, :, b)
            call composite%correct(level, b, clock%step, model%unseen*model%method%flip_fraction, change)
         end do
         call composite%send_prolonged(model%communicator)
      end associate
   end subroutine correct

   !> Collective: the particles of level l go to the blocks, and with those of the next finer level to the levels, where they are
   !> now.
   subroutine move_particles(model, l, clock, error)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l
      type(clock_t), intent(in) :: clock
      type(error_t), intent(inout) :: error
      logical :: new_blocks
      integer :: b
      call model%migration(l)%send(model%communicator, model%exchange(l)%ranks)
      call agree(model, l, new_blocks, error)
      call model%timers%enter(phase_migration)
      associate (migration => model%migration(l), communicator => model%communicator)
         call migration%receive(communicator, model%exchange(l)%ranks)
         if (error%happened()) return
         if (new_blocks) then
            call model%create_blocks()
            do b = 1, size(model%levels(l)%blocks) ! whose particles had no place to go to: with the order that they would have by
                                                   ! now
               if (model%levels(l)%blocks(b)%emigrant_count == 0) cycle
               call pack_emigrants(model, l, b)
               call prepare_next_p2g(model, l, b, clock, .false., error)
            end do
            call model%timers%enter(phase_migration)
            call migration%send(communicator, model%exchange(l)%ranks)
            call migration%receive(communicator, model%exchange(l)%ranks)
         end if
         call migration%settle(model%levels(l))
      end associate
      model%particle_steps = model%particle_steps + model%levels(l)%particle_count()
      model%level_steps(l) = model%level_steps(l) + model%levels(l)%particle_count()
      if (l < size(model%levels)) call change_pair(model, l, error)
      call model%timers%leave()
   end subroutine move_particles

   !> Collective, one reduction: largest speeds for the next time step, whether blocks are missing, whether a rank failed, and what
   !> ranks ask of the run.
   subroutine agree(model, l, new_blocks, error)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l
      logical, intent(out) :: new_blocks
      type(error_t), intent(inout) :: error
      real(wp) :: bounds(5)
      integer :: b
      bounds = [model%bounds%wave_speed, model%bounds%particle_speed, 0.0_wp, 0.0_wp, real(model%requested_action, wp)]
      if (error%happened()) then
         bounds(4) = 1.0_wp
      else if (any_missing(model, l)) then
         bounds(3) = 1.0_wp
      end if
      call MPI_Allreduce(MPI_IN_PLACE, bounds, size(bounds), MPI_DOUBLE_PRECISION, MPI_MAX, model%communicator%comm)
      model%bounds%wave_speed = bounds(1)
      model%bounds%particle_speed = bounds(2)
      new_blocks = bounds(3) > 0.0_wp
      model%requested_action = nint(bounds(5))
      if (new_blocks .and. size(model%levels) > 1) then
         do b = 1, size(model%levels(l)%blocks)
            call check_missing(model, l, b, error)
         end do
         bounds(4) = 1.0_wp
      end if
      if (bounds(4) > 0.0_wp) call model%communicator%agree(error)
   end subroutine agree

   !> True when a particle has left its block for one that does not exist.
   pure logical function any_missing(model, l)
      type(model_t), intent(in) :: model
      integer, intent(in) :: l
      integer :: b, m
      any_missing = .false.
      associate (level => model%levels(l))
         do b = 1, size(level%blocks)
            do m = 1, level%blocks(b)%emigrant_count
               any_missing = any_missing .or. level%owner_at(entered(level, level%blocks(b), int(level%blocks(b)%emigrants(m)))) < 0
            end do
         end do
      end associate
   end function any_missing

end module m_advance
