!> Exit from the program.
module m_leaving
   use, intrinsic :: iso_c_binding, only: c_int
   use, intrinsic :: iso_fortran_env, only: output_unit, error_unit
   use mpi_f08, only: MPI_Finalize, MPI_Finalized
   implicit none
   private
   public :: leave

contains

   !> End with an exit status, without messages of the runtime, and without the clean-up of libraries that MPI
   !> has already unloaded (without mpirun that is a race which can crash). MPI is finalised here where that
   !> was left to the runtime of coarrays, which would do it at the end of the main program.
   subroutine leave(status)
      integer, intent(in) :: status
      interface
         subroutine c_exit(status) bind(c, name='_exit')
            import :: c_int
            integer(c_int), value :: status
         end subroutine c_exit
      end interface
      integer :: ignored
      logical :: done
      flush (output_unit, iostat=ignored)
      flush (error_unit, iostat=ignored)
      call MPI_Finalized(done)
      if (.not. done) call MPI_Finalize()
      call c_exit(int(status, c_int))
   end subroutine leave

end module m_leaving
