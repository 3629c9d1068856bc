!> The largest speeds of a model, which limit its time step.
module m_speed_bounds
   use mpi_f08
   use m_kinds, only: wp
   use m_field_table, only: layout_t
   use m_block, only: block_t
   use m_scene_materials, only: materials_t
   use m_model, only: model_t, bounds_t
   use m_deform, only: fastest
   implicit none
   private
   public :: bound_speeds, include_speeds

contains

   !> Collective: compute the largest speeds of the present model.
   subroutine bound_speeds(model)
      type(model_t), intent(inout) :: model
      real(wp) :: bounds(2)
      integer :: b, l
      model%bounds = bounds_t()
      do l = 1, size(model%levels)
         do b = 1, size(model%levels(l)%blocks)
            call include_speeds(model%bounds, model%materials, model%levels(l)%layout, &
                                model%levels(l)%blocks(b))
         end do
      end do
      bounds = [model%bounds%wave_speed, model%bounds%particle_speed]
      call MPI_Allreduce(MPI_IN_PLACE, bounds, 2, MPI_DOUBLE_PRECISION, MPI_MAX, model%communicator%comm)
      model%bounds%wave_speed = bounds(1)
      model%bounds%particle_speed = bounds(2)
   end subroutine bound_speeds

   !> Update the wave speed of a block; raise the bounds to it and to the speed of its fastest particle.
   subroutine include_speeds(bounds, materials, at, block)
      type(bounds_t), intent(inout) :: bounds
      type(materials_t), intent(in) :: materials
      type(layout_t), intent(in) :: at
      type(block_t), intent(inout) :: block
      real(wp) :: speed_squared, specific_volume
      integer :: first, last, m
      block%wave_speed = 0.0_wp
      first = 1
      associate (particles => block%particles)
         do while (first <= particles%count)
            last = particles%run_end(first)
            call fastest(particles%column(:, at%velocity:at%velocity + 2), particles%column(:, at%mass), &
                         particles%column(:, at%volume), first, last, speed_squared, specific_volume)
            m = materials%of_body(particles%body(first))
            block%wave_speed = max(block%wave_speed, &
                                   sqrt(materials%slots(m)%law%squared_speed(particles%column, at, first, &
                                                                             last, specific_volume)))
            bounds%particle_speed = max(bounds%particle_speed, sqrt(speed_squared))
            first = last + 1
         end do
      end associate
      bounds%wave_speed = max(bounds%wave_speed, block%wave_speed)
   end subroutine include_speeds

end module m_speed_bounds
