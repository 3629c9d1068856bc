!> What stands behind the program's name on the command line.
module m_arguments
   use m_constants, only: exit_input
   use m_errors, only: error_t, fail
   implicit none
   private
   public :: read_arguments

   character(len=*), parameter :: usage = 'usage: gimp3d < scene.nml, or gimp3d --restart DIRECTORY'

contains

   !> The directory of the run that is to go on; empty without arguments. All ranks have the same ones.
   subroutine read_arguments(restart, error)
      character(len=:), allocatable, intent(out) :: restart
      type(error_t), intent(inout) :: error
      restart = ''
      if (command_argument_count() == 0) return
      if (argument(1) /= '--restart') then
         call fail(error, exit_input, 'unknown argument '//argument(1)//'; '//usage)
      else if (command_argument_count() /= 2) then
         call fail(error, exit_input, '--restart needs one directory; '//usage)
      else
         restart = argument(2)
         do while (len(restart) > 1 .and. restart(len(restart):) == '/')
            restart = restart(:len(restart) - 1)
         end do
         if (restart == '') call fail(error, exit_input, '--restart needs one directory; '//usage)
      end if
   end subroutine read_arguments

   function argument(number) result(text)
      integer, intent(in) :: number
      character(len=:), allocatable :: text
      integer :: length
      call get_command_argument(number, length=length)
      allocate (character(len=length) :: text)
      call get_command_argument(number, text)
   end function argument

end module m_arguments
