!> The expected time and memory of a run to its end, from its first steps. The closing summary compares them
!> with the actual values.
module m_expectation
   use m_kinds, only: wp, i8
   use m_machine, only: peak_memory
   use m_timers, only: timers_t, phase_output
   use m_scene, only: scene_t
   use m_model, only: model_t
   use m_guard, only: guard_t
   use m_recovered_stress, only: recovery_bytes
   use m_particle_store, only: spare_room
   use m_forecast, only: rates_t, prospect_t, rates_of, predict_costs, contact_steps, model_bytes
   implicit none
   private

   real(wp), parameter :: enough_share = 0.05_wp   !< of the scene, or
   real(wp), parameter :: enough_seconds = 5.0_wp  !< of steps, in which
   real(wp), parameter :: enough_awake = 0.7_wp    !< this share of the particle-steps was active; or, when
   real(wp), parameter :: late_share = 0.2_wp      !< this share of the scene is over,
   real(wp), parameter :: some_awake = 0.1_wp      !< at least this share: fewer are not representative
   integer, parameter :: min_steps = 10
   integer, parameter :: enough_points = 50 !< contact points in a step on average that suffice to determine
                                            !< their cost

   type, public :: expectation_t
      logical :: made = .false.
      integer(i8) :: step = 0                !< when the estimate was made
      real(wp) :: elapsed = 0.0_wp           !< wall-clock time then, s
      real(wp) :: total = 0.0_wp             !< expected to the end of the run, s
      real(wp) :: memory = 0.0_wp            !< expected, of all ranks, B
      type(timers_t), private :: before
      integer(i8), private :: window_step = 0, particle_steps = 0, at_rest = 0, handled = 0, first_step = 0, &
                              next_look = 0
      real(wp), private :: began = 0.0_wp, first_time = 0.0_wp, first_output = 0.0_wp
   contains
      procedure :: start
      procedure :: update
      procedure, private :: open_window
   end type expectation_t

contains

   !> Initialise before the first step.
   subroutine start(self, model, elapsed)
      class(expectation_t), intent(inout) :: self
      type(model_t), intent(in) :: model
      real(wp), intent(in) :: elapsed !< s since the program started
      self%first_step = model%step
      self%first_time = model%time
      self%first_output = model%timers%seconds(phase_output)
      self%next_look = self%first_step + min_steps
      call self%open_window(model, elapsed)
   end subroutine start

   !> Start the measurement window.
   subroutine open_window(self, model, elapsed)
      class(expectation_t), intent(inout) :: self
      type(model_t), intent(in) :: model
      real(wp), intent(in) :: elapsed
      self%before = model%timers
      self%window_step = model%step
      self%particle_steps = model%particle_steps
      self%at_rest = model%particle_steps_at_rest
      self%handled = model%contact%handled
      self%began = elapsed
   end subroutine open_window

   !> Collective, after a step: when enough has been measured, estimate the remaining time. Steps with most of
   !> the material at rest are not representative, and are discarded.
   subroutine update(self, scene, model, guard, elapsed)
      class(expectation_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(model_t), intent(in) :: model
      type(guard_t), intent(in) :: guard
      real(wp), intent(in) :: elapsed !< s since the program started
      real(wp) :: share, seen, resting, awake
      if (self%made) return
      if (model%step < self%window_step) call self%open_window(model, elapsed) ! the guard has rolled back
      if (model%step < self%next_look .or. model%step == self%window_step) return
      self%next_look = max(model%step + min_steps, self%first_step + 6*(model%step - self%first_step)/5)
      seen = real(model%communicator%sum_count(model%particle_steps - self%particle_steps), wp)
      resting = real(model%communicator%sum_count(model%particle_steps_at_rest - self%at_rest), wp)
      awake = 1.0_wp - resting/max(seen, 1.0_wp)
      share = (model%time - self%first_time)/(scene%end_time - self%first_time)
      if (awake < merge(enough_awake, some_awake, share < late_share)) then
         call self%open_window(model, elapsed)
      else if (share >= enough_share .or. model%communicator%maximum(elapsed &
            - self%began) >= enough_seconds) then
         call make(self, scene, model, guard, elapsed, awake)
      end if
   end subroutine update

   !> Collective: extrapolate the steps so far, with blocks that start to move and, where contact has begun,
   !> more of it.
   subroutine make(self, scene, model, guard, elapsed, awake)
      type(expectation_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(model_t), intent(in) :: model
      type(guard_t), intent(in) :: guard
      real(wp), intent(in) :: elapsed
      real(wp), intent(in) :: awake !< active share of the particle-steps
      type(rates_t) :: rates
      type(prospect_t) :: prospect
      real(wp) :: points, seconds(5), spent, done, written, bytes(2), recovery
      spent = model%communicator%maximum(elapsed - self%began)
      done = real(model%step - self%window_step, wp)
      written = model%communicator%maximum(model%timers%seconds(phase_output) &
                                           - self%before%seconds(phase_output))
      call rates_of(rates, model, self%before, done, spent, awake)
      rates%step = rates%step + written/done
      rates%snapshot = model%communicator%maximum(self%first_output)
      points = (model%contact%handled - self%handled)/(done*contact_steps(model))
      if (points >= enough_points) then
         rates%contact_point = rates%contact/points
         rates%contact = 0.0_wp
      end if
      call predict_costs(prospect, scene, model)
      seconds = prospect%seconds(rates, model%timers%names)
      self%made = .true.
      self%step = model%step
      self%elapsed = model%communicator%maximum(elapsed)
      self%total = self%elapsed + seconds(1)
      bytes = model_bytes(model)
      recovery = real(model%communicator%sum_count(recovery_bytes(model)), wp)
      associate (flight => prospect%flight)
         self%memory = model%communicator%sum_real(real(peak_memory(), wp)) &
                       + ((1.0_wp + spare_room)*flight%max_particles/flight%particles - 1.0_wp)*bytes(1) &
                       + (flight%max_blocks/flight%blocks - 1.0_wp)*(bytes(2) + recovery)
      end associate
      ! a later snapshot is made beside the guard's copy, which does not exist yet at the first
      if (prospect%snapshots > 0.0_wp) &
         self%memory = self%memory + min(guard%kept_bytes(model), bytes(1) + recovery)
   end subroutine make

end module m_expectation
