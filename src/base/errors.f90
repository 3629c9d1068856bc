!> Errors travel up as values; only the application prints one and leaves.
module m_errors
   use m_constants, only: exit_finished
   implicit none
   private
   public :: error_t, fail

   !> What went wrong: the exit status of the program and one sentence for the user.
   type :: error_t
      integer :: status = exit_finished         !< one of the exit statuses of m_constants
      character(len=:), allocatable :: message  !< one sentence; not allocated when nothing failed
      logical :: recoverable = .false.             !< smaller time steps may do what this one could not
   contains
      procedure :: happened
   end type error_t

contains

   !> True when this error value holds a failure.
   pure logical function happened(self)
      class(error_t), intent(in) :: self
      happened = self%status /= exit_finished
   end function happened

   !> Set an error, unless an earlier one stands (the first cause is the one to report).
   pure subroutine fail(error, status, message, recoverable)
      type(error_t), intent(inout) :: error
      integer, intent(in) :: status !< exit status, from m_constants
      character(len=*), intent(in) :: message
      logical, intent(in), optional :: recoverable !< with smaller time steps
      if (error%happened()) return
      error%status = status
      error%message = message
      error%recoverable = .false.
      if (present(recoverable)) error%recoverable = recoverable
   end subroutine fail

end module m_errors
