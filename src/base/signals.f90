!> Requests to a run by signals. A handler may do little more than set a flag: the flags are module variables.
module m_signals
   use, intrinsic :: iso_c_binding, only: c_int, c_intptr_t, c_funptr, c_funloc, c_null_funptr
   implicit none
   private
   public :: catch_signals, ignore_closed_pipes, signal_caught, forget_checkpoint_signal

   integer(c_int), parameter, public :: signal_interrupt = 2, signal_user = 10, signal_terminate = 15
                                                        !< of Linux
   integer(c_int), parameter :: signal_pipe = 13, signal_file_size = 25
   integer(c_intptr_t), parameter :: to_ignore = 1 !< SIG_IGN
   integer(c_int), volatile, protected, bind(c, name='gimp3d_stop_signal') :: stop_signal = 0
   integer(c_int), volatile, protected, bind(c, name='gimp3d_user_signal') :: user_signal = 0

   interface
      type(c_funptr) function c_signal(number, handler) bind(c, name='signal')
         import :: c_int, c_funptr
         integer(c_int), value :: number
         type(c_funptr), value :: handler
      end function c_signal
   end interface

contains

   !> From here on SIGUSR1, SIGINT and SIGTERM are only recorded. A file that grows beyond its size limit
   !> gives a write error instead of a signal.
   subroutine catch_signals()
      type(c_funptr) :: ignored
      ignored = c_signal(signal_user, c_funloc(note_signal))
      ignored = c_signal(signal_interrupt, c_funloc(note_signal))
      ignored = c_signal(signal_terminate, c_funloc(note_signal))
      ignored = c_signal(signal_file_size, transfer(to_ignore, c_null_funptr))
      call ignore_closed_pipes()
   end subroutine catch_signals

   !> A pipe that nobody reads any more gives a write error instead of a signal: a run goes on without its
   !> console, its log has all.
   subroutine ignore_closed_pipes()
      type(c_funptr) :: ignored
      ignored = c_signal(signal_pipe, transfer(to_ignore, c_null_funptr))
   end subroutine ignore_closed_pipes

   !> The signal received by this rank: one that ends the run has priority over one that does not; 0 if none.
   integer function signal_caught()
      signal_caught = stop_signal
      if (signal_caught == 0) signal_caught = user_signal
   end function signal_caught

   !> Clear the request for a checkpoint, which has been written.
   subroutine forget_checkpoint_signal()
      user_signal = 0
   end subroutine forget_checkpoint_signal

   subroutine note_signal(number) bind(c, name='gimp3d_note_signal')
      integer(c_int), value :: number
      if (number == signal_user) then
         user_signal = number
      else
         stop_signal = number
      end if
   end subroutine note_signal

end module m_signals
