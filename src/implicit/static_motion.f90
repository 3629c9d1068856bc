!> Update of the particles after an implicit step has found its displacements (theory.md, Quasi-static steps).
module m_static_motion
   use m_kinds, only: wp
   use m_errors, only: error_t
   use m_node_values, only: v_x, v_z, a_x, a_z
   use m_g2p_boxes, only: motion_t
   use m_model, only: model_t
   use m_g2p_stage, only: g2p_block, follow_loads
   use m_stress_stage, only: update_stress
   use m_cells_stage, only: cells_block
   use m_static_tiles, only: take_gradients
   use m_static_levels, only: static_level_t
   use m_static_means, only: mean_pressures
   use m_trial_state, only: part_of_gradient
   implicit none
   private
   public :: take_along

contains

   !> Move the particles of a level with its nodes, which hold the displacements of a step. Without inertia
   !> their velocities are these over the step; with it velocities grow by mean accelerations, and the stored
   !> gradients are those of the step's end.
   subroutine take_along(model, l, time_step, parts, mine, error, share)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, parts
      real(wp), intent(in) :: time_step !< s
      type(static_level_t), intent(inout) :: mine !< with the gradients of the equilibrium; with inertia,
                                                  !< forces contain mean accelerations in v_x to v_z
      type(error_t), intent(inout) :: error
      real(wp), intent(in), optional :: share !< weight of the step's end in mean velocities, with inertia
      type(motion_t) :: motion
      real(wp), allocatable :: at_end(:, :)
      integer :: b, first, n
      associate (level => model%levels(l))
         motion = motion_t(time_step, 0.0_wp, level%layout%position)
         if (present(share)) motion%flip_fraction = model%method%flip_fraction
         first = level%layout%gradient
         do b = 1, size(level%blocks)
            level%nodes(v_x:v_z, :, :, :, b) = level%nodes(v_x:v_z, :, :, :, b)/time_step
            call level%blocks(b)%count_disorder()
            if (model%effect_step(l)%acts_on_nodes) call model%effect_step(l)%measure(level, b, time_step)
            n = level%blocks(b)%particles%count
            if (n > 0) then
               if (present(share)) then
                  level%nodes(a_x:a_z, :, :, :, b) = mine%forces(v_x:v_z, :, :, :, b)
                  if (first > 0) call take_ends(model, l, b, (1.0_wp - share)*time_step, at_end)
               end if
               call g2p_block(model, l, b, motion, model%time, error)
               if (present(share) .and. first > 0) &
                  level%blocks(b)%particles%column(:n, first:first + 8) = at_end(:n, :)
               if (allocated(mine%sums)) level%gradient(:n, :) = mine%trial(b)%gradient(:n, :)/time_step
               call stress_in_parts(model, l, b, parts, time_step, error)
               call follow_loads(model, l, b, motion, model%time, tools=.false.)
            end if
         end do
         call mean_pressures(mine, model, l)
         do b = 1, size(level%blocks)
            call cells_block(model, l, b, error)
            level%blocks(b)%deposited = 0
         end do
         level%sums_wait = .false.
      end associate
   end subroutine take_along

   !> The velocity gradients of the step's end at the particles of a block: from the mean velocities, and
   !> accelerations over the remaining time.
   subroutine take_ends(model, l, b, left, gradient)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b
      real(wp), intent(in) :: left !< s
      real(wp), allocatable, intent(inout) :: gradient(:, :) !< (:, 9), 1/s
      real(wp), allocatable :: mean(:, :, :, :)
      associate (level => model%levels(l), nodes => model%levels(l)%nodes)
         if (allocated(gradient)) then
            if (size(gradient, 1) < size(level%gradient, 1)) deallocate (gradient)
         end if
         if (.not. allocated(gradient)) allocate (gradient(size(level%gradient, 1), 9))
         mean = nodes(v_x:v_z, :, :, :, b)
         nodes(v_x:v_z, :, :, :, b) = mean + left*nodes(a_x:a_z, :, :, :, b)
         call take_gradients(level, b, gradient)
         nodes(v_x:v_z, :, :, :, b) = mean
      end associate
   end subroutine take_ends

   !> Update stress, volumes and domains of a block, in the same number of parts as in the trials.
   subroutine stress_in_parts(model, l, b, parts, time_step, error)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b, parts
      real(wp), intent(in) :: time_step !< the whole, s
      type(error_t), intent(inout) :: error
      real(wp), allocatable :: whole(:, :)
      integer :: k, n
      n = model%levels(l)%blocks(b)%particles%count
      if (parts > 1) whole = time_step*model%levels(l)%gradient(:n, :)
      do k = 1, parts
         if (k > 1) call part_of_gradient(n, whole, k, parts, time_step, model%levels(l)%gradient)
         call update_stress(model, l, b, time_step/parts, error)
      end do
      if (parts > 1) model%levels(l)%gradient(:n, :) = whole/time_step
   end subroutine stress_in_parts

end module m_static_motion
