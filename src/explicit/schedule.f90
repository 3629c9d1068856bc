!> The schedule of the stages of a step: the order in which blocks are processed. All stages of a list are
!> carried out on a block while it is in the cache; inner blocks first, while the halo exchange is under way;
!> and P2G of the next step follows immediately.
module m_schedule
   use m_kinds, only: wp
   use m_errors, only: error_t
   use m_timers
   use m_scene, only: update_usl
   use m_clock, only: clock_t
   use m_block, only: block_t
   use m_model, only: model_t
   use m_grid_stages, only: p2g_block, sum_shared_nodes, end_sums, solve_block, sum_cells, is_idle
   use m_g2p_stage, only: motion_of, still, g2p_block, follow_loads, stays_at_rest, give_at_rest, &
                          is_woken
   use m_stress_stage, only: stress_block
   use m_cells_stage, only: cells_block
   use m_energy, only: take_sums
   implicit none
   private
   public :: by_blocks

   !> Stages, in their order within a step.
   integer, parameter, public :: shared_sums = 1 !< sums over the nodes that blocks share; no action on a
                                                 !< level that has them
   integer, parameter, public :: nodal_solve = 2
   integer, parameter, public :: grid_to_particles = 3 !< velocities, positions, velocity gradients
   integer, parameter, public :: velocity_gradient = 4 !< in its place if only the stress is needed: particles
                                                       !< do not move
   integer, parameter, public :: stress = 5
   integer, parameter, public :: cells = 6

contains

   !> Collective: carry out stages on all blocks of a level. If effects need means over cells, which blocks
   !> share, all blocks get their velocity gradients before the first gets its stress.
   subroutine by_blocks(model, l, clock, stages, error)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, stages(:)
      type(clock_t), intent(in) :: clock
      type(error_t), intent(inout) :: error
      integer :: before
      before = size(stages)
      if (size(model%effect_step(l)%on_cells) > 0 .and. any(stages == stress)) &
         before = findloc(stages, stress, dim=1) - 1
      call go_through(model, l, clock, stages(:before), error)
      if (before == size(stages)) return
      call sum_cells(model, l)
      call go_through(model, l, clock, stages(before + 1:), error)
   end subroutine by_blocks

   subroutine go_through(model, l, clock, stages, error)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, stages(:)
      type(clock_t), intent(in) :: clock
      type(error_t), intent(inout) :: error
      integer :: n, part
      do part = 1, 2
         if (any(stages == shared_sums)) call sum_shared_nodes(model, l, part)
         if (all(stages == shared_sums)) cycle
         do n = model%levels(l)%part_end(part - 1) + 1, model%levels(l)%part_end(part)
            call carry_out(model, l, model%levels(l)%interior_first(n), clock, stages, error)
         end do
      end do
      if (any(stages == shared_sums)) call end_sums(model, l)
   end subroutine go_through

   !> Carry out the stages on one block. Blocks at rest are skipped.
   subroutine carry_out(model, l, b, clock, stages, error)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b, stages(:)
      type(clock_t), intent(in) :: clock
      type(error_t), intent(inout) :: error
      integer :: s
      do s = 1, size(stages)
         select case (stages(s))
         case (nodal_solve)
            call solve_block(model, l, b, clock)
         case (grid_to_particles)
            call measure_work(model, l, b, clock%step)
            call leave_out(model, l, b)
            if (is_idle(model, l, b)) return
            if (model%levels(l)%blocks(b)%left_out) cycle
            call g2p_block(model, l, b, motion_of(model, l, clock%step), clock%time, error)
            if (model%method%stress_update /= update_usl) call go_to_faces(model, l, b)
         case (velocity_gradient)
            call leave_out(model, l, b)
            if (model%levels(l)%blocks(b)%left_out) cycle
            call g2p_block(model, l, b, still(model, l), clock%time, error)
         case (stress)
            call wake(model, l, b)
            if (model%levels(l)%blocks(b)%left_out) cycle
            call stress_block(model, l, b, clock%step, error)
            if (model%method%stress_update /= update_usl) cycle
            call follow_loads(model, l, b, motion_of(model, l, clock%step), clock%time, .true.)
            call go_to_faces(model, l, b)
         case (cells)
            if (model%levels(l)%blocks(b)%left_out) then
               call count_left_out(model, model%levels(l)%blocks(b))
               return
            end if
            call cells_block(model, l, b, error)
            if (model%method%stress_update == update_usl &
                .and. .not. error%happened()) call look_ahead(model, l, b, clock%ends)
         end select
      end do
   end subroutine carry_out

   !> Skip a block whose particles stay at rest from here on; its volume is still added to the cells.
   subroutine leave_out(model, l, b)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b
      model%levels(l)%blocks(b)%left_out = stays_at_rest(model, l, b)
      if (.not. model%levels(l)%blocks(b)%left_out) return
      call model%timers%enter(phase_g2p)
      if (size(model%effect_step(l)%on_cells) > 0) call give_at_rest(model, l, b)
   end subroutine leave_out

   !> Stop skipping a block if cells that it shares contain moving material. Nothing has been missed: its
   !> nodes do not move.
   subroutine wake(model, l, b)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b
      if (size(model%effect_step(l)%on_cells) == 0) return
      if (.not. model%levels(l)%blocks(b)%left_out) return
      if (is_woken(model, l, b)) model%levels(l)%blocks(b)%left_out = .false.
   end subroutine wake

   !> Finish the step of a skipped block: its wave speed counts for the time step.
   subroutine count_left_out(model, block)
      type(model_t), intent(inout) :: model
      type(block_t), intent(in) :: block
      if (block%particles%count == 0) return ! its wave speed is that of particles that have left
      model%bounds%wave_speed = max(model%bounds%wave_speed, block%wave_speed)
      model%particle_steps_at_rest = model%particle_steps_at_rest + block%particles%count
   end subroutine count_left_out

   !> Work of effects on the nodes of a block, by their motion; for a parent without particles, on the
   !> restricted forces. Before blocks are left out, whose volume may replace the nodes.
   subroutine measure_work(model, l, b, time_step)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b
      real(wp), intent(in) :: time_step !< s
      if (is_idle(model, l, b) .or. .not. model%effect_step(l)%acts_on_nodes) return
      call model%timers%enter(phase_nodes)
      call model%effect_step(l)%measure(model%levels(l), b, time_step)
   end subroutine measure_work

   !> Move particles pressed by tools to the tools' faces, while their numbers are still those of the contact
   !> candidates.
   subroutine go_to_faces(model, l, b)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b
      associate (at => model%levels(l)%layout)
         if (model%contact%active() .and. l == size(model%levels)) call model%contact%candidates%settle( &
            model%levels(l), b, merge(at%next_position, at%position, at%next_position > 0))
      end associate
   end subroutine go_to_faces

   !> While the particles of a block, with the stress of the step's end, are in the cache: compute the sums
   !> for histories, and P2G of the next step. Particles that arrive later are added after them.
   subroutine look_ahead(model, l, b, step_ends)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b
      logical, intent(in) :: step_ends !< the coarsest level's step ends too
      if (model%levels(l)%blocks(b)%particles%count == 0) return
      if (model%wants_sums .and. step_ends) then
         call model%timers%on_level(0) ! as all output
         call model%timers%enter(phase_output)
         call take_sums(model, l, b)
         call model%timers%on_level(l)
      end if
      if (.not. model%works_ahead) return
      ! Parents must wait for the restricted values of the finer level. The other blocks wait with them: else
      ! ranks with more parents would be waited for at the sums, and others would wait here.
      if (l < size(model%levels)) return
      call p2g_block(model, l, b)
   end subroutine look_ahead

end module m_schedule
