!> The length of the next step, and the number of steps to come.
module m_time_step
   use m_kinds, only: wp, i8
   use m_constants, only: exit_input
   use m_errors, only: error_t, fail
   use m_text, only: to_text
   use m_scene, only: scene_t, safety_limit
   use m_model, only: model_t
   implicit none
   private
   public :: next_time_step, longest_step, steps_between, check_time_step

contains

   !> Check that a given time step can be stable with the explicit scheme, and that the scene ends after a
   !> possible number of steps.
   subroutine check_time_step(scene, model, error)
      type(scene_t), intent(in) :: scene
      type(model_t), intent(in) :: model
      type(error_t), intent(inout) :: error
      real(wp), parameter :: max_steps = 1.0e15_wp
      real(wp) :: speed
      integer :: e, t
      speed = model%bounds%particle_speed
      do t = 1, size(model%contact%tools)
         speed = max(speed, model%contact%tools(t)%fastest(model%time, scene%end_time))
      end do
      call allow(safety_limit(scene)*model%stepped_cell()/(model%wave_speed() + speed), &
                 to_text(safety_limit(scene))// &
                 ' cells over the speed of sound plus that of the fastest particle or tool')
      do e = 1, size(model%effects)
         call allow(model%effects(e)%effect%longest_step(), 'the longest that '// &
                    model%effects(e)%effect%group_text()//' allows')
      end do
      if (scene%end_time > max_steps*longest_step(scene, model, model%time)) &
         call fail(error, exit_input, scene%place('end_time')//': would take more than '// &
                   to_text(max_steps)//' steps of '//to_text(longest_step(scene, model, model%time))//' s')
   contains
      subroutine allow(limit, reason)
         real(wp), intent(in) :: limit !< s
         character(len=*), intent(in) :: reason
         if (scene%time%time_step > limit) call fail(error, exit_input, scene%place('time_step')// &
             ': must be at most '//to_text(limit)//' s, '//reason)
      end subroutine allow
   end subroutine check_time_step

   !> Time step (s) that the scene's effects allow.
   pure real(wp) function allowed_by_effects(model) result(allowed)
      type(model_t), intent(in) :: model
      integer :: e
      allowed = huge(1.0_wp)
      do e = 1, size(model%effects)
         allowed = min(allowed, model%effects(e)%effect%longest_step())
      end do
   end function allowed_by_effects

   !> Time step (s) of the coarsest level: safety cell / (c + |v|) with the present c and |v|, or the limit of
   !> effects; or the given one. Shortened slightly, so that a whole number of such steps ends at the end
   !> time: a short last step would show in the contact load.
   pure real(wp) function next_time_step(scene, model, share) result(time_step)
      type(scene_t), intent(in) :: scene
      type(model_t), intent(in) :: model
      real(wp), intent(in), optional :: share !< factor on it, after an error; 1 if absent
      real(wp) :: remaining
      time_step = longest_step(scene, model, model%time)
      if (present(share)) time_step = share*time_step
      remaining = scene%end_time - model%time
      if (scene%quasi_static%present .and. model%time < scene%quasi_static%from) &
         remaining = min(remaining, scene%quasi_static%from - model%time)
      time_step = remaining/max(1_i8, ceiling(remaining/time_step - 1.0e-6_wp, i8))
   end function next_time_step

   !> The same (s) before the shortening, with the tools' speeds at a time (s).
   pure real(wp) function longest_step(scene, model, time) result(time_step)
      type(scene_t), intent(in) :: scene
      type(model_t), intent(in) :: model
      real(wp), intent(in) :: time
      real(wp) :: speed
      integer :: t
      time_step = scene%time%time_step
      if (scene%quasi_static%holds_at(time)) time_step = scene%quasi_static%step
      if (time_step > 0.0_wp) return
      speed = model%bounds%particle_speed
      do t = 1, size(model%contact%tools)
         speed = max(speed, model%contact%tools(t)%speed_at(time))
      end do
      time_step = min(scene%time%safety*model%stepped_cell()/(model%wave_speed() + speed), &
                      allowed_by_effects(model))
   end function longest_step

   !> Steps of the coarsest level between two times (s), with the present wave and particle speeds and the
   !> tools' future ones.
   pure real(wp) function steps_between(scene, model, from, to) result(steps)
      type(scene_t), intent(in) :: scene
      type(model_t), intent(in) :: model
      real(wp), intent(in) :: from, to
      integer, parameter :: parts = 20
      integer :: n
      steps = 0.0_wp
      do n = 1, parts
         steps = steps + (to - from)/parts/longest_step(scene, model, from + (n - 0.5_wp)*(to - from)/parts)
      end do
   end function steps_between

end module m_time_step
