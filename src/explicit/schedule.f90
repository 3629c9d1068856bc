!> The schedule behind the stages of a step: which blocks are gone through when. All stages of a list are
!> carried out on a block while it is in the cache; inner blocks go first, while the halo is on its way; and
!> P2G of the next step follows at once.
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

   !> Stages, in the order that they have in a step.
   integer, parameter, public :: shared_sums = 1 !< sums over the nodes that blocks share; of a level that has
                                                 !< them: nothing
   integer, parameter, public :: nodal_solve = 2
   integer, parameter, public :: grid_to_particles = 3 !< velocities, places, velocity gradients
   integer, parameter, public :: velocity_gradient = 4 !< in its place where only the stress is wanted:
                                                       !< particles stand still
   integer, parameter, public :: stress = 5
   integer, parameter, public :: cells = 6

contains

   !> Collective: carry out stages on all blocks of a level. Where effects want means over cells, which blocks
   !> share, all blocks have their velocity gradients before the first gets its stress.
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

   !> The stages on one block. What does not move is left out.
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
            call leave_out(model, l, b)
            if (is_idle(model, l, b)) return
            call measure_work(model, l, b, clock%step)
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

   !> A block whose particles stay at rest is left out from here on; its cells still get its volume.
   subroutine leave_out(model, l, b)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b
      model%levels(l)%blocks(b)%left_out = stays_at_rest(model, l, b)
      if (.not. model%levels(l)%blocks(b)%left_out) return
      call model%timers%enter(phase_g2p)
      if (size(model%effect_step(l)%on_cells) > 0) call give_at_rest(model, l, b)
   end subroutine leave_out

   !> A block that was left out takes part again where cells that it shares are of material that moves. So far
   !> nothing has been missed: its nodes do not move.
   subroutine wake(model, l, b)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b
      if (size(model%effect_step(l)%on_cells) == 0) return
      if (.not. model%levels(l)%blocks(b)%left_out) return
      if (is_woken(model, l, b)) model%levels(l)%blocks(b)%left_out = .false.
   end subroutine wake

   !> A step of a block that was left out to its end: the time step goes by its wave speed too.
   subroutine count_left_out(model, block)
      type(model_t), intent(inout) :: model
      type(block_t), intent(in) :: block
      if (block%particles%count == 0) return ! its wave speed is that of particles that have left it
      model%bounds%wave_speed = max(model%bounds%wave_speed, block%wave_speed)
      model%particle_steps_at_rest = model%particle_steps_at_rest + block%particles%count
   end subroutine count_left_out

   !> The work of effects on the nodes of a block, by their motion; of a parent without particles on what is
   !> restricted to it.
   subroutine measure_work(model, l, b, time_step)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b
      real(wp), intent(in) :: time_step !< s
      if (.not. model%effect_step(l)%acts_on_nodes) return
      call model%timers%enter(phase_nodes)
      call model%effect_step(l)%measure(model%levels(l), b, time_step)
   end subroutine measure_work

   !> Particles that tools press go to their faces, while they still have the numbers that contact knows.
   subroutine go_to_faces(model, l, b)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b
      associate (at => model%levels(l)%layout)
         if (model%contact%active() .and. l == size(model%levels)) call model%contact%candidates%settle( &
            model%levels(l), b, merge(at%next_position, at%position, at%next_position > 0))
      end associate
   end subroutine go_to_faces

   !> While the particles of a block, which have the stress of the end of the step, are in the cache: what
   !> histories will ask of them, and P2G of the next step. What comes to the block later gives after them.
   subroutine look_ahead(model, l, b, step_ends)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b
      logical, intent(in) :: step_ends !< that of the coarsest level
      if (model%levels(l)%blocks(b)%particles%count == 0) return
      if (model%wants_sums .and. step_ends) then
         call model%timers%on_level(0) ! as all output
         call model%timers%enter(phase_output)
         call take_sums(model, l, b)
         call model%timers%on_level(l)
      end if
      if (.not. model%works_ahead) return
      ! Parents must wait for what the finer level gives to their nodes. The other blocks wait with them: a
      ! rank with more parents than others would be waited for at the sums, and would wait here.
      if (l < size(model%levels)) return
      call p2g_block(model, l, b)
   end subroutine look_ahead

end module m_schedule
