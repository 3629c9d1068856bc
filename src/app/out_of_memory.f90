!> Failed memory allocation. When an ALLOCATE fails, gfortran's library calls a procedure that prints a
!> backtrace and exits; the procedure here has its name and takes its place at link time.
module m_out_of_memory
   use, intrinsic :: iso_c_binding, only: c_char, c_int, c_intptr_t, c_ptr, c_size_t
   use mpi_f08
   use m_constants, only: exit_numerical
   use m_output_lock, only: drop_lock
   implicit none
   private

   character(kind=c_char, len=*), &
      parameter :: sentence = 'gimp3d: there is no memory for what the run needs next: take more '// &
      'machines, larger cells or fewer particles_per_cell, memory=0 in &guard, or a higher limit '// &
      '(ulimit -v, that of the batch system)'//achar(10)

contains

   !> Print one message and end all ranks. Must not allocate memory.
   subroutine end_for_want_of_memory(place, message) bind(c, name='_gfortran_os_error_at')
      type(c_ptr), value :: place, message !< position in the source, and gfortran's message
      interface
         integer(c_intptr_t) function c_write(descriptor, text, count) bind(c, name='write')
            import :: c_char, c_int, c_intptr_t, c_size_t
            integer(c_int), value :: descriptor
            character(kind=c_char), intent(in) :: text(*)
            integer(c_size_t), value :: count
         end function c_write
         subroutine c_exit(status) bind(c, name='_exit')
            import :: c_int
            integer(c_int), value :: status
         end subroutine c_exit
      end interface
      integer(c_intptr_t) :: ignored
      integer :: ranks
      call drop_lock()
      ignored = c_write(2_c_int, sentence, len(sentence, c_size_t))
      call MPI_Comm_size(MPI_COMM_WORLD, ranks)
      if (ranks > 1) call MPI_Abort(MPI_COMM_WORLD, exit_numerical)
      call c_exit(int(exit_numerical, c_int))
   end subroutine end_for_want_of_memory

end module m_out_of_memory
