!> What a run expects of itself: time and memory to its end, told from its first steps. The closing summary says how far off it was.
module m_expectation
   use m_kinds, only: wp, i8
   use m_memory, only: peak_memory
   use m_timers, only: timers_t, phase_output
   use m_scene, only: scene_t
   use m_model, only: model_t
   use m_particle_store, only: spare_room
   use m_forecast, only: rates_t, prospect_t, rates_of, look_ahead, contact_steps
   implicit none
   private

   real(wp), parameter :: enough_share = 0.05_wp   !< of the scene, or
   real(wp), parameter :: enough_seconds = 5.0_wp  !< of steps, of which there must be at least
   integer, parameter :: fewest_steps = 10
   integer, parameter :: enough_points = 50        !< contact points in a step on average, for their cost to be told from that

   type, public :: expectation_t
      logical :: made = .false.
      integer(i8) :: step = 0                !< when it was made
      real(wp) :: elapsed = 0.0_wp           !< wall-clock time then, s
      real(wp) :: total = 0.0_wp             !< expected to the end of the run, s
      real(wp) :: memory = 0.0_wp            !< expected, of all ranks, B
      type(timers_t), private :: before
      integer(i8), private :: first_step = 0, particle_steps = 0, at_rest = 0, handled = 0, next_look = fewest_steps
      real(wp), private :: began = 0.0_wp, first_time = 0.0_wp
   contains
      procedure :: start
      procedure :: look
   end type expectation_t

contains

   !> Before the first step.
   subroutine start(self, model, elapsed)
      class(expectation_t), intent(inout) :: self
      type(model_t), intent(in) :: model
      real(wp), intent(in) :: elapsed !< s since the program began
      self%before = model%timers
      self%first_step = model%step
      self%first_time = model%time
      self%particle_steps = model%particle_steps
      self%at_rest = model%particle_steps_at_rest
      self%handled = model%contact%handled
      self%began = elapsed
   end subroutine start

   !> Collective, after a step: when enough has been seen, tell the rest from it.
   subroutine look(self, scene, model, elapsed)
      class(expectation_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(model_t), intent(in) :: model
      real(wp), intent(in) :: elapsed !< s since the program began
      integer(i8) :: done
      logical :: far
      if (self%made) return
      done = model%step - self%first_step
      far = model%time - self%first_time >= enough_share*(scene%end_time - self%first_time)
      if (done < fewest_steps .or. .not. (far .or. done >= self%next_look)) return
      self%next_look = 2*done
      if (.not. far) far = model%communicator%maximum(elapsed - self%began) >= enough_seconds
      if (far) call make(self, scene, model, elapsed, real(done, wp))
   end subroutine look

   !> Collective: the steps so far go on, with blocks that wake and, where contact has begun, more of it.
   subroutine make(self, scene, model, elapsed, done)
      type(expectation_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(model_t), intent(in) :: model
      real(wp), intent(in) :: elapsed
      real(wp), intent(in) :: done !< steps
      type(rates_t) :: rates
      type(prospect_t) :: prospect
      real(wp) :: points, seconds(5), spent, steps, resting, written, held
      integer :: b, l
      spent = model%communicator%maximum(elapsed - self%began)
      steps = real(model%communicator%sum_count(model%particle_steps - self%particle_steps), wp)
      resting = real(model%communicator%sum_count(model%particle_steps_at_rest - self%at_rest), wp)
      written = model%communicator%maximum(model%timers%seconds(phase_output) - self%before%seconds(phase_output))
      call rates_of(rates, model, self%before, done, spent, 1.0_wp - resting/max(steps, 1.0_wp))
      rates%step = rates%step + written/done
      rates%snapshot = model%communicator%maximum(self%before%seconds(phase_output))
      points = (model%contact%handled - self%handled)/(done*contact_steps(model))
      if (points >= enough_points) then
         rates%contact_point = rates%contact/points
         rates%contact = 0.0_wp
      end if
      call look_ahead(prospect, scene, model)
      seconds = prospect%seconds(rates, model%timers%names)
      self%made = .true.
      self%step = model%step
      self%elapsed = model%communicator%maximum(elapsed)
      self%total = self%elapsed + seconds(1)
      held = 0.0_wp
      do l = 1, size(model%levels)
         do b = 1, size(model%levels(l)%blocks)
            held = held + real(model%levels(l)%blocks(b)%bytes(), wp)
         end do
      end do
      self%memory = model%communicator%sum_real(real(peak_memory(), wp) + spare_room*held)
   end subroutine make

end module m_expectation
