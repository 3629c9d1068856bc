!> What takes a model from one time to the next. Kinds of it: explicit_t (advance.f90), quasi_static_t
!> (quasi_static.f90).
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
      !> Collective: advance the model by one step of its coarsest level. Stages that kinds share: P2G and
      !> shared sums give the internal force of a state (grid_stages.f90), by_blocks moves it on
      !> (schedule.f90), saved_state_t keeps it and takes it back.
      subroutine step(self, model, time_step, error)
         import :: integrator_t, model_t, wp, error_t
         class(integrator_t), intent(inout) :: self
         type(model_t), intent(inout) :: model
         real(wp), intent(in) :: time_step !< that is wanted, s; a kind that finds its own may take less
         type(error_t), intent(inout) :: error
      end subroutine step
   end interface

contains

   !> Collective: when the model stands as the run begins.
   subroutine start(self, scene, model)
      class(integrator_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(model_t), intent(inout) :: model
   end subroutine start

   !> Collective: the step (s) that is to be taken now.
   real(wp) function next_step(self, scene, model, share) result(time_step)
      class(integrator_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(model_t), intent(in) :: model
      real(wp), intent(in) :: share !< of the given one, after a fault
      time_step = next_time_step(scene, model, share)
   end function next_step

   !> From now on `next_step` is asked of times to come, whose state is not known: what hangs on the state
   !> does not count.
   subroutine look_ahead(self)
      class(integrator_t), intent(inout) :: self
   end subroutine look_ahead

   !> What may end the run in the middle of the steps that follow.
   subroutine end_by(self, called_off)
      class(integrator_t), intent(inout) :: self
      type(called_off_t), intent(in) :: called_off
   end subroutine end_by

   !> True when the last step was left for that, and the model is as it was before; it holds what all ranks
   !> ask of the run.
   pure logical function was_called_off(self)
      class(integrator_t), intent(in) :: self
      was_called_off = .false.
   end function was_called_off

   !> True when a step that has failed has left the model as it was.
   pure logical function keeps_state(self)
      class(integrator_t), intent(in) :: self
      keeps_state = .false.
   end function keeps_state

   !> Lines about the last step, each ended by new_line; they are told once.
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

   !> Implicit steps done, their Newton iterations, linear solves and products, and times that a step was
   !> halved.
   pure function counts(self) result(values)
      class(integrator_t), intent(in) :: self
      integer(i8) :: values(5)
      values = 0
   end function counts

   !> Collective: free what PETSc holds.
   subroutine release(self)
      class(integrator_t), intent(inout) :: self
   end subroutine release

   !> Collective: end PETSc, when all has been freed.
   subroutine finish(self)
      class(integrator_t), intent(inout) :: self
   end subroutine finish

end module m_integrator
