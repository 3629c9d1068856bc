!> What takes a model from one time to the next. Kinds of it: explicit_t (advance.f90).
module m_integrator
   use m_kinds, only: wp
   use m_errors, only: error_t
   use m_model, only: model_t
   implicit none
   private

   type, abstract, public :: integrator_t
   contains
      procedure(step), nopass, deferred :: step
   end type integrator_t

   abstract interface
      !> Collective: advance the model by one step of its coarsest level. Stages that kinds share: P2G and
      !> shared sums give the internal force of a state (grid_stages.f90), by_blocks moves it on
      !> (schedule.f90), saved_state_t keeps it and takes it back.
      subroutine step(model, time_step, error)
         import :: model_t, wp, error_t
         type(model_t), intent(inout) :: model
         real(wp), intent(in) :: time_step !< s
         type(error_t), intent(inout) :: error
      end subroutine step
   end interface

end module m_integrator
