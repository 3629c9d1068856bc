!test: ranks 1 2 4
!> Writes snapshots in both formats below the directory given as argument (read_back.py checks them) and tries
!> what must fail.
program snapshots
   use, intrinsic :: iso_c_binding, only: c_int, c_long
   use m_constants, only: exit_files, exit_numerical
   use m_errors, only: error_t
   use m_communicator, only: communicator_t
   use m_filesystem, only: make_directory
   use m_snapshot, only: snapshot_t, snapshot_file_name
   use m_hdf5_snapshot, only: write_hdf5_snapshot
   use m_tecplot_snapshot, only: write_tecplot_snapshot
   use m_xdmf_index, only: xdmf_index_t
   use m_xdmf_entry, only: particles_entry, levels_entry
   use m_assertions, only: assertions_t
   use m_made_up, only: made_up_snapshot, add_levels
   implicit none

   interface
      integer(c_int) function c_setrlimit(resource, limits) bind(c, name='setrlimit')
         import :: c_int, c_long
         integer(c_int), value :: resource
         integer(c_long), intent(in) :: limits(2)
      end function c_setrlimit
      integer(c_long) function c_signal(number, handler) bind(c, name='signal')
         import :: c_int, c_long
         integer(c_int), value :: number
         integer(c_long), value :: handler
      end function c_signal
   end interface

   type(communicator_t) :: comm
   type(assertions_t) :: test
   character(len=512) :: argument
   character(len=:), allocatable :: top
   logical :: ok
   call get_command_argument(1, argument)
   top = 'build/test_io'
   if (len_trim(argument) > 0) top = trim(argument)
   call comm%start()
   call test%start(comm, 'snapshots')
   call make_directory(top//'/run', ok)
   call make_directory(top//'/empty', ok)
   call make_directory(top//'/levels', ok)
   call write_run('run', with_levels=.false.)
   call write_run('levels', with_levels=.true.)
   call write_nothing()
   call wrong_runs()
   call no_directory()
   call name_taken()
   call disk_full() ! the last: it keeps its limit
   call test%finish()

contains

   !> Four times, on all ranks and with ranks to spare; the indices taken up again as after a restart.
   subroutine write_run(name, with_levels)
      character(len=*), intent(in) :: name
      logical, intent(in) :: with_levels
      type(xdmf_index_t) :: particles, levels
      type(error_t) :: error
      type(snapshot_t) :: snapshot
      integer :: n
      integer, parameter :: steps(5) = [0, 10, 25, 20, 30]
      call particles%start(comm, top//'/'//name, 'particles', error, series=.true.)
      call levels%start(comm, top//'/'//name, 'levels', error)
      do n = 1, 5
         if (n == 4) then ! the run went as far as 25, then from 10 again
            call particles%start(comm, top//'/'//name, 'particles', error, resume_step=10, series=.true.)
            call levels%start(comm, top//'/'//name, 'levels', error, resume_step=10)
         end if
         snapshot = made_up_snapshot(comm, steps(n), modulo(n, 2), .true.)
         if (with_levels) call add_levels(snapshot)
         call write_hdf5_snapshot(comm, snapshot, top//'/'//name, error)
         call write_tecplot_snapshot(comm, snapshot, top//'/'//name, error)
         call particles%add(comm, snapshot%step, particles_entry(snapshot), error)
         if (with_levels) call levels%add(comm, snapshot%step, levels_entry(snapshot), error)
         call test%check(.not. error%happened(), 'snapshots are written', message_of(error))
      end do
   end subroutine write_run

   subroutine write_nothing()
      type(error_t) :: error
      type(snapshot_t) :: snapshot
      snapshot = made_up_snapshot(comm, 7, 0, .false.)
      call write_hdf5_snapshot(comm, snapshot, top//'/empty', error)
      call write_tecplot_snapshot(comm, snapshot, top//'/empty', error)
      call test%check(.not. error%happened(), 'a snapshot without particles is written', message_of(error))
   end subroutine write_nothing

   !> Runs that overlap, and particles that no run or no level holds.
   subroutine wrong_runs()
      type(error_t) :: error, other, third
      type(snapshot_t) :: snapshot
      snapshot = made_up_snapshot(comm, 99, 0, .true.)
      if (comm%is_root()) snapshot%run_offset(1) = snapshot%run_offset(1) - 1
      call write_hdf5_snapshot(comm, snapshot, top//'/run', error)
      call test%check(error%status == exit_numerical, 'overlapping runs are refused', message_of(error))
      snapshot = made_up_snapshot(comm, 99, 0, .true.)
      snapshot%n_total = snapshot%n_total + 1
      call write_tecplot_snapshot(comm, snapshot, top//'/run', other)
      call test%check(other%status == exit_numerical, 'missing particles are refused', message_of(other))
      snapshot = made_up_snapshot(comm, 99, 0, .true.)
      call add_levels(snapshot)
      snapshot%levels(2)%particles = 1
      call write_tecplot_snapshot(comm, snapshot, top//'/run', third)
      call test%check(third%status == exit_numerical, 'particles that are on no level are refused', &
                      message_of(third))
      call test%check(.not. is_there(top//'/run/'//snapshot_file_name(99, 'hdf')), &
                      'nothing is left of a refused snapshot')
   end subroutine wrong_runs

   subroutine no_directory()
      call both_fail(top//'/no/such/directory', 98, 'No such file')
   end subroutine no_directory

   !> Where the file should go there is a directory: it is written, but cannot get its name.
   subroutine name_taken()
      call make_directory(top//'/run/'//snapshot_file_name(97, 'hdf'), ok)
      call make_directory(top//'/run/'//snapshot_file_name(97, 'dat'), ok)
      call both_fail(top//'/run', 97, 'renamed')
   end subroutine name_taken

   !> A disk that takes only the first bytes of a file.
   subroutine disk_full()
      integer(c_long) :: limits(2)
      integer(c_long), parameter :: ignore = 1, bytes = 20000
      integer(c_int), parameter :: file_size = 1, file_size_signal = 25
      limits = bytes
      limits(1) = c_signal(file_size_signal, ignore)
      limits = bytes
      call test%check(c_setrlimit(file_size, limits) == 0, 'the size of files can be limited')
      call both_fail(top//'/run', 96, 'cannot write')
   end subroutine disk_full

   !> Both formats give exit_files and a sentence with the path, on all ranks, and leave nothing.
   subroutine both_fail(directory, step, part)
      character(len=*), intent(in) :: directory, part
      integer, intent(in) :: step
      type(error_t) :: error(2)
      type(snapshot_t) :: snapshot
      integer :: n
      character(len=3), parameter :: extensions(2) = ['hdf', 'dat']
      character(len=:), allocatable :: path
      snapshot = made_up_snapshot(comm, step, 0, .true.)
      call write_hdf5_snapshot(comm, snapshot, directory, error(1))
      call write_tecplot_snapshot(comm, snapshot, directory, error(2))
      do n = 1, 2
         path = directory//'/'//snapshot_file_name(step, trim(extensions(n)))
         call test%check(error(n)%status == exit_files, part//': exit status of '//extensions(n), &
                         message_of(error(n)))
         call test%check(index(message_of(error(n)), path) > 0 .and. index(message_of(error(n)), part) > 0, &
                         part//': sentence of '//extensions(n), message_of(error(n)))
         call test%check(.not. is_there(path//'.part'), part//': no part is left of '//extensions(n))
         if (step /= 97) call test%check(.not. is_there(path), part//': no file is left of '//extensions(n))
      end do
   end subroutine both_fail

   logical function is_there(path)
      character(len=*), intent(in) :: path
      inquire (file=path, exist=is_there)
   end function is_there

   function message_of(error) result(text)
      type(error_t), intent(in) :: error
      character(len=:), allocatable :: text
      text = 'no error'
      if (allocated(error%message)) text = error%message
   end function message_of

end program snapshots
