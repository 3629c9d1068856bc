!> Change between explicit and quasi-static steps at given times of the scene.
module m_changing
   use m_kinds, only: wp, i8
   use m_errors, only: error_t
   use m_called_off, only: called_off_t
   use m_text, only: si
   use m_scene, only: scene_t, quasi_static_spec_t
   use m_model, only: model_t
   use m_integrator, only: integrator_t
   use m_advance, only: advance
   use m_time_step, only: next_time_step
   use m_speed_bounds, only: bound_speeds
   use m_quasi_static, only: quasi_static_t
   implicit none
   private
   public :: changing_t

   type, extends(integrator_t) :: changing_t
      private
      type(quasi_static_spec_t) :: spec
      type(quasi_static_t) :: statics
      logical :: holds = .false. !< steps are quasi-static at present
      character(len=:), allocatable :: run_log
   contains
      procedure :: start
      procedure :: next_step
      procedure :: look_ahead
      procedure :: step
      procedure, private :: kind
      procedure :: end_by
      procedure :: was_called_off
      procedure :: keeps_state
      procedure :: messages
      procedure :: summary
      procedure :: counts
      procedure :: release
      procedure :: finish
   end type changing_t

contains

   !> Collective: initialise when the model is in the run's initial state.
   subroutine start(self, scene, model)
      class(changing_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(model_t), intent(inout) :: model
      self%spec = scene%quasi_static
      self%run_log = ''
      call self%statics%start(scene, model)
      self%holds = self%spec%holds_at(model%time)
   end subroutine start

   !> Collective: the step (s) to be taken now; first change the kind of steps, if it is time.
   real(wp) function next_step(self, scene, model, share) result(time_step)
      class(changing_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(model_t), intent(in) :: model
      real(wp), intent(in) :: share
      if (self%spec%holds_at(model%time)) then
         time_step = self%statics%next_step(scene, model, share)
      else
         time_step = next_time_step(scene, model, share)
      end if
   end function next_step

   subroutine look_ahead(self, model, time, longest)
      class(changing_t), intent(inout) :: self
      type(model_t), intent(in) :: model
      real(wp), intent(in) :: time !< s
      real(wp), intent(out) :: longest
      call self%statics%look_ahead(model, time, longest)
   end subroutine look_ahead

   !> Collective: one step of either kind.
   subroutine step(self, model, time_step, error)
      class(changing_t), intent(inout) :: self
      type(model_t), intent(inout) :: model
      real(wp), intent(in) :: time_step
      type(error_t), intent(inout) :: error
      if (self%spec%holds_at(model%time) .neqv. self%holds) then
         self%holds = .not. self%holds
         call self%statics%change(model, self%holds)
         self%run_log = self%run_log//'steps      from time '//si(model%time, 's')//' on they are '// &
                     trim(merge(self%kind(), 'explicit    ', self%holds))//new_line('a')
      end if
      if (self%holds) then
         call self%statics%step(model, time_step, error)
      else
         call advance(model, time_step, error)
      end if
      if (self%was_called_off()) return
      if (.not. self%holds .or. self%spec%holds_at(model%time)) return
      call self%statics%change(model, .false.) ! the next step is explicit: start at rest, with the step
                                               ! limited by waves
      self%holds = .false.
      self%run_log = self%run_log//'steps      from time '//si(model%time, 's')//' on they are explicit'// &
                  new_line('a')
      call bound_speeds(model)
   end subroutine step

   !> Name of the implicit steps.
   pure character(len=12) function kind(self)
      class(changing_t), intent(in) :: self
      kind = merge('implicit    ', 'quasi-static', self%spec%has_inertia())
   end function kind

   subroutine end_by(self, called_off)
      class(changing_t), intent(inout) :: self
      type(called_off_t), intent(in) :: called_off
      call self%statics%end_by(called_off)
   end subroutine end_by

   pure logical function was_called_off(self)
      class(changing_t), intent(in) :: self
      was_called_off = self%holds .and. self%statics%was_called_off()
   end function was_called_off

   pure logical function keeps_state(self)
      class(changing_t), intent(in) :: self
      keeps_state = self%holds .and. self%statics%keeps_state()
   end function keeps_state

   function messages(self) result(text)
      class(changing_t), intent(inout) :: self
      character(len=:), allocatable :: text
      text = self%run_log//self%statics%messages()
      self%run_log = ''
   end function messages

   pure function counts(self) result(values)
      class(changing_t), intent(in) :: self
      integer(i8) :: values(5)
      values = self%statics%counts()
   end function counts

   function summary(self) result(text)
      class(changing_t), intent(in) :: self
      character(len=:), allocatable :: text
      text = self%statics%summary()
   end function summary

   subroutine release(self)
      class(changing_t), intent(inout) :: self
      call self%statics%release()
   end subroutine release

   subroutine finish(self)
      class(changing_t), intent(inout) :: self
      call self%statics%finish()
   end subroutine finish

end module m_changing
