!> Transfer between nodes and particles in implicit steps, with means over cells (theory.md, eq.
!> static-means): one condition on the volume per cell. Each particle belongs to the cell that contains it at
!> the step's beginning. Without an effect that needs means there are none.
module m_static_means
   use m_kinds, only: wp
   use m_migration, only: frame_of
   use m_static_transfer, only: p2g_stress
   use m_cell_mean, only: give_values, take_mean_values, pressure, set_trace
   use m_model, only: model_t
   use m_static_levels, only: static_level_t
   use m_static_tiles, only: sum_up, take_gradients
   implicit none
   private
   public :: take_trial_gradients, push_nodes, multiply_tangents, mean_pressures

contains

   !> Collective: gradients of a level's nodal displacements at its particles.
   subroutine take_trial_gradients(mine, model, l)
      type(static_level_t), intent(inout) :: mine
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l
      integer :: b
      associate (level => model%levels(l))
         do b = 1, size(level%blocks)
            if (level%blocks(b)%particles%count == 0) cycle
            call take_gradients(level, b, mine%trial(b)%gradient)
         end do
      end associate
      call mean_gradients(mine, model, l)
   end subroutine take_trial_gradients

   !> Collective: add the acting forces of particles to the nodes of a level.
   subroutine push_nodes(mine, model, l)
      type(static_level_t), intent(inout) :: mine
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l
      integer :: b
      call mean_forces(mine, model, l)
      do b = 1, size(model%levels(l)%blocks)
         call push_block(mine, model, l, b)
      end do
   end subroutine push_nodes

   subroutine push_block(mine, model, l, b)
      type(static_level_t), intent(inout) :: mine
      type(model_t), intent(in) :: model
      integer, intent(in) :: l, b
      associate (level => model%levels(l), block => model%levels(l)%blocks(b))
         if (block%particles%count == 0) return
         call p2g_stress(block%cells, block%particles%column, level%layout, frame_of(level, block), &
                         mine%trial(b)%acting, mine%forces(:, :, :, :, b))
      end associate
   end subroutine push_block

   !> Collective: multiply the tangents by displacements of a level's nodes, to forces on them; without means
   !> block by block, while its particles are in the cache.
   subroutine multiply_tangents(mine, model, l)
      type(static_level_t), intent(inout) :: mine
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l
      logical :: by_block
      integer :: b
      by_block = .not. allocated(mine%sums)
      if (.not. by_block) call take_trial_gradients(mine, model, l)
      do b = 1, size(mine%trial)
         associate (n => model%levels(l)%blocks(b)%particles%count)
            if (n == 0) cycle
            if (by_block) call take_gradients(model%levels(l), b, mine%trial(b)%gradient)
            call mine%trial(b)%multiply(n)
            call mine%followers(b)%multiply(mine%trial(b)%gradient, mine%forces(:, :, :, :, b))
            if (by_block) call push_block(mine, model, l, b)
         end associate
      end do
      if (.not. by_block) call push_nodes(mine, model, l)
   end subroutine multiply_tangents

   !> Collective: replace the trace of each particle's gradient by the mean of its cell.
   subroutine mean_gradients(mine, model, l)
      type(static_level_t), intent(inout) :: mine
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l
      integer :: b
      if (.not. allocated(mine%sums)) return
      do b = 1, size(mine%trial)
         associate (trial => mine%trial(b), n => model%levels(l)%blocks(b)%particles%count)
            trial%value = trial%gradient(:n, 1) + trial%gradient(:n, 5) + trial%gradient(:n, 9)
         end associate
      end do
      call average(mine, model, l)
      do b = 1, size(mine%trial)
         associate (trial => mine%trial(b), n => model%levels(l)%blocks(b)%particles%count)
            call set_trace(trial%value, trial%gradient(:n, 1), trial%gradient(:n, 5), &
                           trial%gradient(:n, 9))
         end associate
      end do
   end subroutine mean_gradients

   !> Collective: the transpose of that for the forces on nodes: the trace of each, over the particle's
   !> volume, is replaced by the mean of its cell. So their work is that of the stress by the mean gradients.
   subroutine mean_forces(mine, model, l)
      type(static_level_t), intent(inout) :: mine
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l
      integer :: b
      if (.not. allocated(mine%sums)) return
      do b = 1, size(mine%trial)
         associate (trial => mine%trial(b), particles => model%levels(l)%blocks(b)%particles, &
                    n => model%levels(l)%blocks(b)%particles%count, v => model%levels(l)%layout%volume)
            trial%value = (trial%acting(:n, 1) + trial%acting(:n, 5) + trial%acting(:n, 9)) &
                          /particles%column(:n, v)
         end associate
      end do
      call average(mine, model, l)
      do b = 1, size(mine%trial)
         associate (trial => mine%trial(b), particles => model%levels(l)%blocks(b)%particles, &
                    n => model%levels(l)%blocks(b)%particles%count, v => model%levels(l)%layout%volume)
            call set_trace(trial%value*particles%column(:n, v), trial%acting(:n, 1), trial%acting(:n, 5), &
                           trial%acting(:n, 9))
         end associate
      end do
   end subroutine mean_forces

   !> Collective: pressure of the cell minus that of each particle, for explicit P2G; after the step's stress,
   !> before particles change their place in memory.
   subroutine mean_pressures(mine, model, l)
      type(static_level_t), intent(inout) :: mine
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l
      integer :: b
      if (.not. allocated(mine%sums)) return
      do b = 1, size(mine%trial)
         associate (particles => model%levels(l)%blocks(b)%particles)
            mine%trial(b)%value = pressures(particles%column, particles%count, model%levels(l)%layout%stress)
         end associate
      end do
      call average(mine, model, l)
      do b = 1, size(mine%trial)
         associate (particles => model%levels(l)%blocks(b)%particles, at => model%levels(l)%layout)
            particles%column(:particles%count, at%pressure_shift) = mine%trial(b)%value &
               - pressures(particles%column, particles%count, at%stress)
            call particles%changed()
         end associate
      end do
   end subroutine mean_pressures

   pure function pressures(column, count, s) result(of)
      real(wp), intent(in) :: column(:, :)
      integer, intent(in) :: count, s !< first column of the stress
      real(wp) :: of(count)           !< Pa
      of = pressure(column(:count, s), column(:count, s + 1), column(:count, s + 2))
   end function pressures

   !> Collective: replace the value of each particle by the mean of its cell, weighted by volume.
   subroutine average(mine, model, l)
      type(static_level_t), intent(inout) :: mine
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l
      integer :: b
      associate (level => model%levels(l))
         do b = 1, size(mine%trial)
            associate (particles => level%blocks(b)%particles, trial => mine%trial(b))
               call give_values(trial%cell, particles%column(:particles%count, level%layout%volume), &
                                trial%value, mine%rows, mine%sums(:, :, :, :, b))
            end associate
         end do
         call sum_up(model, l, mine%sums)
         do b = 1, size(mine%trial)
            call take_mean_values(mine%trial(b)%cell, mine%sums(:, :, :, :, b), mine%trial(b)%value)
         end do
      end associate
   end subroutine average

end module m_static_means
