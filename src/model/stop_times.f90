!> Times at which quasi-static steps must end: changes of the loading by tools or pressures, output, and the
!> end.
module m_stop_times
   use m_kinds, only: wp
   use m_scene, only: scene_t
   use m_effect, only: effect_t
   use m_multiples, only: times_passed
   use m_model, only: model_t
   implicit none
   private
   public :: next_stop

   real(wp), parameter :: hair = 1.0e-9_wp !< relative tolerance: a time so near is not in the future

contains

   !> The next of these times, s.
   real(wp) function next_stop(scene, model) result(stop_at)
      type(scene_t), intent(in) :: scene
      type(model_t), intent(in) :: model
      integer :: i, k
      stop_at = scene%end_time
      associate (every => scene%output%every)
         if (scene%output%present .and. every > 0.0_wp) &
            call take([every*(times_passed(every, model%time*(1.0_wp + hair)) + 1.0_wp)])
      end associate
      call take([scene%quasi_static%ramp, scene%quasi_static%from, scene%quasi_static%to])
      if (allocated(scene%body_contacts)) call take(scene%body_contacts%press_fit)
      do i = 1, size(scene%tools)
         if (allocated(scene%tools(i)%times)) call take(scene%tools(i)%times)
         if (.not. allocated(scene%tools(i)%motions)) cycle
         do k = 1, size(scene%tools(i)%motions)
            call take(scene%tools(i)%motions(k)%times)
         end do
      end do
      do i = 1, size(scene%effects)
         select type (effect => scene%effects(i)%it)
         class is (effect_t)
            call take(effect%turning_times())
         end select
      end do
   contains
      subroutine take(times)
         real(wp), intent(in) :: times(:)
         integer :: n
         do n = 1, size(times)
            if (times(n) > model%time*(1.0_wp + hair)) stop_at = min(stop_at, times(n))
         end do
      end subroutine take
   end function next_stop

end module m_stop_times
