!> Errors are passed up as values; only the application prints one and exits.
module m_errors
   use m_constants, only: exit_finished
   implicit none
   private
   public :: error_t, fail

   !> An error: the exit status of the program and one message for the user.
   type :: error_t
      integer :: status = exit_finished         !< one of the exit statuses of m_constants
      character(len=:), allocatable :: message  !< one sentence; not allocated without an error
      logical :: recoverable = .false.             !< smaller time steps may succeed
   contains
      procedure :: happened
   end type error_t

contains

   !> True when this value holds an error.
   pure logical function happened(self)
      class(error_t), intent(in) :: self
      happened = self%status /= exit_finished
   end function happened

   !> Set an error, unless one is set already (the first cause is the one to report).
   pure subroutine fail(error, status, message, recoverable)
      type(error_t), intent(inout) :: error
      integer, intent(in) :: status !< exit status, from m_constants
      character(len=*), intent(in) :: message
      logical, intent(in), optional :: recoverable !< smaller time steps may succeed
      if (error%happened()) return
      error%status = status
      error%message = message
      error%recoverable = .false.
      if (present(recoverable)) error%recoverable = recoverable
   end subroutine fail

end module m_errors
