!test: ranks 1 2
!> The lock on an output directory (m_output_lock): it is touched, made again where it was removed, and lost
!> to another run.
program output_lock
   use m_kinds, only: i8
   use m_errors, only: error_t
   use m_communicator, only: communicator_t
   use m_filesystem, only: read_file, time_of_file, remove_file
   use m_output_lock, only: output_lock_t
   use m_process, only: process_t, this_process
   use m_text, only: to_text
   use m_assertions, only: assertions_t
   implicit none
   type(communicator_t) :: comm
   type(assertions_t) :: test
   type(output_lock_t) :: lock
   type(error_t) :: error
   type(process_t) :: own, other
   character(len=:), allocatable :: path, text, again
   logical :: ok, root
   call comm%start()
   call test%start(comm, 'output_lock')
   root = comm%is_root()
   path = 'build/test_lock_'//to_text(comm%ranks)//'/run.lock'
   if (root) call execute_command_line('rm -rf build/test_lock_'//to_text(comm%ranks))

   call lock%take(comm, path(:len(path) - 9), error)
   call test%check(.not. error%happened(), 'the lock of a directory that was not there')
   call lock%take(comm, path(:len(path) - 9), error)
   call test%check(.not. error%happened() .and. .not. allocated(lock%note), 'once more: nothing happens')
   call test%check(.not. lock%is_lost(), 'not looked at before its time')
   lock%touch_every = 0.0
   if (root) then
      call read_file(path, 1000, text, ok)
      call execute_command_line('touch -d "20 minutes ago" '//path)
      call test%check(time_of_file(path) < now() - 1000, 'an old one')
   end if
   call test%check(.not. lock%is_lost(), 'it is not lost')
   if (root) then
      call test%check(abs(time_of_file(path) - now()) < 100, 'but touched')
      call remove_file(path, ok)
   end if
   call test%check(.not. lock%is_lost(), 'nor where somebody has removed it')
   if (root) then
      call read_file(path, 1000, again, ok)
      call test%check(ok .and. again == text, 'it is there again')
      call execute_command_line('sed -i "s/^process .*/process 1/" '//path)
      call test%check(lock%is_lost(), 'it is lost to another run')
      call test%check(.not. lock%is_lost(), 'and that is said once')
      call lock%release()
      call test%check(time_of_file(path) >= 0, 'what is another run''s stays')
   end if

   own = this_process()
   other = own
   call test%check(own%runs() .and. own%neighbours(other), 'this process runs')
   other%start = '1'
   call test%check(.not. other%runs(), 'one that had its id before does not')
   other%start = '0'
   call test%check(other%runs(), 'where the system does not tell when it began, it is believed')
   other%id = 99999999
   call test%check(.not. other%runs(), 'an id that is not in use')
   other%system = 'another'
   call test%check(.not. own%neighbours(other), 'another start of the machine')
   call test%finish()

contains

   !> By the clock of the file system, s.
   integer(i8) function now()
      call execute_command_line('touch '//path//'.now')
      now = time_of_file(path//'.now')
   end function now

end program output_lock
