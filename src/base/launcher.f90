!> Detection of the launcher by the environment: a launcher of another MPI starts each rank as a separate run.
module m_launcher
   use mpi_f08
   use m_constants, only: exit_input
   use m_errors, only: error_t, fail
   use m_communicator, only: communicator_t
   use m_text, only: to_text
   implicit none
   private
   public :: check_launch, tasks_of_job

   integer, parameter :: name_length = 20

   !> Variables with the number of launched ranks, by launchers of MPI: Open MPI; MPICH, Intel MPI and Slurm's
   !> PMI; MVAPICH.
   character(len=name_length), &
      parameter :: by_mpi(*) = [character(len=name_length) :: 'OMPI_COMM_WORLD_SIZE', 'PMI_SIZE', &
      'MV2_COMM_WORLD_SIZE']
   !> The same by batch systems for a step that they have launched themselves: srun of Slurm, Flux, jsrun.
   character(len=name_length), &
      parameter :: by_system(*) = [character(len=name_length) :: 'SLURM_STEP_NUM_TASKS', 'FLUX_JOB_SIZE', &
      'JSM_NAMESPACE_SIZE']

contains

   !> Refuse to start as one of several runs of a scene where one run on several ranks was intended.
   subroutine check_launch(communicator, error)
      type(communicator_t), intent(in) :: communicator
      type(error_t), intent(inout) :: error
      integer :: n
      if (communicator%ranks > 1) return
      do n = 1, size(by_mpi)
         call refuse(by_mpi(n), error)
      end do
      do n = 1, size(by_mpi)
         if (number_in(by_mpi(n)) == 1) return ! as intended, within a larger step
      end do
      do n = 1, size(by_system)
         call refuse(by_system(n), error)
      end do
   end subroutine check_launch

   !> An error if a variable of the launcher gives more than the one rank of this run.
   subroutine refuse(name, error)
      character(len=*), intent(in) :: name
      type(error_t), intent(inout) :: error
      character(len=MPI_MAX_LIBRARY_VERSION_STRING) :: library
      integer :: length
      if (number_in(name) <= 1) return
      call MPI_Get_library_version(library, length)
      length = scan(library(:length)//',', ','//achar(10)//achar(0)) - 1
      call fail(error, exit_input, 'launched as '//to_text(number_in(name))//' ranks ('//trim(name)// &
                '), but MPI sees each as a separate run; use the mpirun, or the --mpi of srun, of the '// &
                'MPI that this '// &
                'program was built with ('//library(:length)//'); for a single rank unset '//trim(name))
   end subroutine refuse

   !> Tasks of this job in Slurm; 0 if there is no such job.
   integer function tasks_of_job()
      tasks_of_job = number_in('SLURM_NTASKS')
   end function tasks_of_job

   !> The integer in an environment variable; 0 if there is none.
   integer function number_in(name) result(number)
      character(len=*), intent(in) :: name
      character(len=32) :: text
      integer :: status
      number = 0
      call get_environment_variable(trim(name), text, status=status)
      if (status /= 0 .or. verify(trim(text), '0123456789') > 0 .or. text == '') return
      read (text, *, iostat=status) number
      if (status /= 0) number = 0
   end function number_in

end module m_launcher
