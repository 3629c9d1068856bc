!> Time integrator of a model. Extended by explicit_t (advance.f90), quasi_static_t (quasi_static.f90).
module m_integrator
   use m_kinds, only: wp, i8
   use m_errors, only: error_t
   use m_called_off, only: called_off_t
   use m_scene, only: scene_t
   use m_model, only: model_t
   use m_time_step, only: next_time_step
   implicit none
   private

   type, abstract, public :: integrator_t
   contains
      procedure :: start
      procedure :: next_step
      procedure :: look_ahead
      procedure(step), deferred :: step
      procedure :: end_by
      procedure :: was_called_off
      procedure :: keeps_state
      procedure :: messages
      procedure :: summary
      procedure :: counts
      procedure :: release
      procedure :: finish
   end type integrator_t

   abstract interface
      !> Collective: advance the model by one step of its coarsest level. Shared stages: P2G and shared sums
      !> give the internal force of a state (grid_stages.f90), by_blocks advances it (schedule.f90),
      !> saved_state_t stores and restores it.
      subroutine step(self, model, time_step, error)
         import :: integrator_t, model_t, wp, error_t
         class(integrator_t), intent(inout) :: self
         type(model_t), intent(inout) :: model
         real(wp), intent(in) :: time_step !< wanted step, s; an integrator with its own step control may take
                                           !< less
         type(error_t), intent(inout) :: error
      end subroutine step
   end interface

contains

   !> Collective: initialise when the model is in the run's initial state.
   subroutine start(self, scene, model)
      class(integrator_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(model_t), intent(inout) :: model
   end subroutine start

   !> Collective: the step (s) to be taken now.
   real(wp) function next_step(self, scene, model, share) result(time_step)
      class(integrator_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(model_t), intent(in) :: model
      real(wp), intent(in) :: share !< factor on the given step, after an error
      time_step = next_time_step(scene, model, share)
   end function next_step

   !> Collective: from now on `next_step` is called for future times with unknown states: criteria that depend
   !> on the state are ignored. `longest`: what they allow at the present state, of a time, s.
   subroutine look_ahead(self, model, time, longest)
      class(integrator_t), intent(inout) :: self
      type(model_t), intent(in) :: model
      real(wp), intent(in) :: time !< s
      real(wp), intent(out) :: longest
      longest = time
   end subroutine look_ahead

   !> Set the condition that may end the run within the following steps.
   subroutine end_by(self, called_off)
      class(integrator_t), intent(inout) :: self
      type(called_off_t), intent(in) :: called_off
   end subroutine end_by

   !> True when the last step was abandoned for that reason, and the model restored to its beginning; the
   !> model holds the request of all ranks.
   pure logical function was_called_off(self)
      class(integrator_t), intent(in) :: self
      was_called_off = .false.
   end function was_called_off

   !> True when a failed step has left the model unchanged.
   pure logical function keeps_state(self)
      class(integrator_t), intent(in) :: self
      keeps_state = .false.
   end function keeps_state

   !> Lines about the last step, each ended by new_line; returned once.
   function messages(self) result(text)
      class(integrator_t), intent(inout) :: self
      character(len=:), allocatable :: text
      text = ''
   end function messages

   !> A line for the closing summary; empty for none.
   function summary(self) result(text)
      class(integrator_t), intent(in) :: self
      character(len=:), allocatable :: text
      text = ''
   end function summary

   !> Numbers of implicit steps, their Newton iterations, linear solves and products, and times that a step
   !> was halved.
   pure function counts(self) result(values)
      class(integrator_t), intent(in) :: self
      integer(i8) :: values(5)
      values = 0
   end function counts

   !> Collective: free PETSc objects.
   subroutine release(self)
      class(integrator_t), intent(inout) :: self
   end subroutine release

   !> Collective: finalise PETSc, after all objects have been freed.
   subroutine finish(self)
      class(integrator_t), intent(inout) :: self
   end subroutine finish

end module m_integrator
