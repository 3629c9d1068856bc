!> What waiting for each other costs two ranks of equal work on this machine: every rank does arithmetic on an array in the cache for a
!> millisecond or two and then waits for the others, again and again. Prints one line: milliseconds of one piece of work, and
!> the share of the pace that the barriers leave (mean of the work over mean of the slowest rank's). What
!> it takes from a program that does nothing else is taken from every program that waits as often.
!> usage: mpirun -n RANKS barrier
program barrier
   use mpi_f08
   use m_kinds, only: wp
   implicit none
   integer, parameter :: n = 400000, sweeps = 4, rounds = 1500
   real(wp), allocatable :: values(:)
   real(wp) :: begun, took, slowest, own, waited
   integer :: i, r, rank, ranks, s
   call MPI_Init()
   call MPI_Comm_rank(MPI_COMM_WORLD, rank)
   call MPI_Comm_size(MPI_COMM_WORLD, ranks)
   allocate (values(n), source=0.5_wp)
   own = 0.0_wp
   waited = 0.0_wp
   do r = -50, rounds
      call MPI_Barrier(MPI_COMM_WORLD)
      begun = MPI_Wtime()
      do s = 1, sweeps
         do i = 1, n
            values(i) = chain(values(i))
         end do
      end do
      took = MPI_Wtime() - begun
      call MPI_Allreduce(took, slowest, 1, MPI_DOUBLE_PRECISION, MPI_MAX, MPI_COMM_WORLD)
      if (r < 1) cycle
      own = own + took
      waited = waited + slowest
   end do
   if (any(values < 0.0_wp)) print *, 'never'
   call MPI_Allreduce(MPI_IN_PLACE, own, 1, MPI_DOUBLE_PRECISION, MPI_SUM, MPI_COMM_WORLD)
   if (rank == 0) print '(a,f8.3,a,f8.3)', 'ms ', 1.0e3_wp*own/ranks/rounds, ' pace ', own/ranks/waited
   call MPI_Finalize()

contains

   !> Sixteen multiply-adds, one after the other.
   pure elemental real(wp) function chain(x) result(y)
      real(wp), intent(in) :: x
      integer :: k
      y = x
      do k = 1, 16
         y = 0.999_wp*y + 1.0e-3_wp
      end do
   end function chain

end program barrier
