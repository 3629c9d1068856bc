!> Calls of foreign code: a law in its user's library, LAMMPS. If such code ends the program by STOP, exit or
!> abort, or crashes, one message names it. Data for signal handlers are module variables.
module m_foreign_call
   use, intrinsic :: iso_c_binding, only: c_char, c_funloc, c_funptr, c_int, c_intptr_t, c_new_line, c_size_t
   use mpi_f08
   use m_text, only: to_text
   implicit none
   private
   public :: name_foreign_code, describe_foreign_code, begin_foreign_call, end_foreign_call

   integer, parameter :: longest_name = 1024, max_names = 64
   !> abort, illegal instruction, bus error, arithmetic, address; of Linux
   integer(c_int), parameter :: deadly(5) = [6, 4, 7, 8, 11]
   character(len=longest_name), protected :: names(max_names) = '', subjects(max_names) = ''
   integer, protected :: named = 0
   integer(c_int), volatile :: inside = 0, status_then = 0 !< number of the library being called, 0: none
   type(c_funptr), protected :: handler_before(32)

   interface
      integer(c_int) function c_atexit(handler) bind(c, name='atexit')
         import :: c_int, c_funptr
         type(c_funptr), value :: handler
      end function c_atexit
      type(c_funptr) function c_signal(number, handler) bind(c, name='signal')
         import :: c_int, c_funptr
         integer(c_int), value :: number
         type(c_funptr), value :: handler
      end function c_signal
      integer(c_int) function c_raise(number) bind(c, name='raise')
         import :: c_int
         integer(c_int), value :: number
      end function c_raise
      integer(c_intptr_t) function c_write(descriptor, text, count) bind(c, name='write')
         import :: c_char, c_int, c_intptr_t, c_size_t
         integer(c_int), value :: descriptor
         character(kind=c_char), intent(in) :: text(*)
         integer(c_size_t), value :: count
      end function c_write
      subroutine c_abort() bind(c, name='abort')
      end subroutine c_abort
      integer(c_int) function c_sleep(seconds) bind(c, name='sleep')
         import :: c_int
         integer(c_int), value :: seconds
      end function c_sleep
      subroutine c_exit(status) bind(c, name='_exit')
         import :: c_int
         integer(c_int), value :: status
      end subroutine c_exit
      !> Mark the begin of a call: of the library that name_foreign_code gave this number, with an exit status
      !> for errors. Declared pure, as the calls are.
      pure subroutine begin_foreign_call(number, status) bind(c, name='gimp3d_begin_foreign_call')
         import :: c_int
         integer(c_int), value, intent(in) :: number, status
      end subroutine begin_foreign_call
      pure subroutine end_foreign_call() bind(c, name='gimp3d_end_foreign_call')
      end subroutine end_foreign_call
   end interface

contains

   !> Register a library under a number; the first registration installs the handlers for ends of the program.
   integer(c_int) function name_foreign_code(name) result(number)
      character(len=*), intent(in) :: name !< of the library
      integer(c_int) :: ignored
      integer :: n
      if (named == 0) then
         ignored = c_atexit(c_funloc(at_exit))
         do n = 1, size(deadly)
            handler_before(deadly(n)) = c_signal(deadly(n), c_funloc(at_signal))
         end do
      end if
      number = findloc(names(:named), name, dim=1)
      if (number > 0) return
      named = min(named + 1, max_names)
      names(named) = name
      number = named
   end function name_foreign_code

   !> Set the beginning of the message for code that is not a law, with its activity.
   subroutine describe_foreign_code(number, subject)
      integer(c_int), intent(in) :: number
      character(len=*), intent(in) :: subject
      subjects(number) = subject
   end subroutine describe_foreign_code

   subroutine begin_call(number, status) bind(c, name='gimp3d_begin_foreign_call')
      integer(c_int), value :: number, status
      status_then = status
      inside = number
   end subroutine begin_call

   subroutine end_call() bind(c, name='gimp3d_end_foreign_call')
      inside = 0
   end subroutine end_call

   subroutine at_exit() bind(c, name='gimp3d_foreign_exit')
      if (inside > 0) call end_all('has ended the program (STOP or exit)')
   end subroutine at_exit

   !> Replacement for CALL ABORT: gfortran's own abort hides the signal from handlers.
   subroutine at_abort() bind(c, name='_gfortran_abort')
      if (inside > 0) call end_all('has ended the program (abort)')
      call c_abort()
   end subroutine at_abort

   !> A signal raised by the code; other signals get their default action.
   subroutine at_signal(number) bind(c, name='gimp3d_foreign_signal')
      integer(c_int), value :: number
      type(c_funptr) :: ignored
      if (inside > 0 .and. number == deadly(1)) call end_all('has ended the program (abort)')
      if (inside > 0) call end_all('has crashed (signal '//to_text(int(number))//')')
      ignored = c_signal(number, handler_before(number))
      number = c_raise(number)
   end subroutine at_signal

   !> Print the message and end all ranks.
   subroutine end_all(what)
      character(len=*), intent(in) :: what
      character(len=:), allocatable :: sentence
      integer(c_intptr_t) :: ignored
      integer :: ranks, rank, number
      logical :: finalised
      number = inside
      inside = 0
      ranks = 1
      rank = 0
      call MPI_Finalized(finalised)
      if (.not. finalised) call MPI_Comm_size(MPI_COMM_WORLD, ranks)
      if (.not. finalised) call MPI_Comm_rank(MPI_COMM_WORLD, rank)
      if (rank > 0) ignored = c_sleep(1_c_int) ! another rank may be about to print it
      sentence = 'gimp3d: the law of library='''//trim(names(number))//''' '//what// &
                 '; a law that cannot go on gives a stress that is not a number, and the run says for '// &
                 'which particle'//c_new_line
      if (subjects(number) /= '') sentence = 'gimp3d: '//trim(subjects(number))//' '//what//c_new_line
      ignored = c_write(2_c_int, sentence, len(sentence, c_size_t))
      if (ranks > 1) call MPI_Abort(MPI_COMM_WORLD, int(status_then))
      call c_exit(status_then)
   end subroutine end_all

end module m_foreign_call
