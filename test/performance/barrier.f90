!> What waiting for each other costs two ranks of equal work on this machine: every rank does arithmetic on an
!> array of its own for a millisecond or two and then waits for the others, again and again. Prints a line for
!> each size of the array, one that stays in the cache and one as large as what a rank of E2 goes through in a
!> step: megabytes, milliseconds of one piece of work, and the share of the pace that the barriers leave (mean
!> of the work over mean of the slowest rank's). What it takes from a program that does nothing else is taken
!> from every program that waits as often. usage: mpirun -n RANKS barrier
program barrier
   use mpi_f08
   use m_kinds, only: wp
   implicit none
   integer, parameter :: rounds = 1500
   call MPI_Init()
   call wait_often(400000, sweeps=4)
   call wait_often(2000000, sweeps=1)
   call MPI_Finalize()

contains

   !> Collective: so many values a rank, swept through so often between two barriers.
   subroutine wait_often(n, sweeps)
      integer, intent(in) :: n, sweeps
      real(wp) :: values(n), begun, took, slowest, own, waited
      integer :: i, r, rank, ranks, s
      call MPI_Comm_rank(MPI_COMM_WORLD, rank)
      call MPI_Comm_size(MPI_COMM_WORLD, ranks)
      values = 0.5_wp
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
      if (rank == 0) print '(*(a,f0.3))', 'MB ', 8.0e-6_wp*n, ' ms ', 1.0e3_wp*own/ranks/rounds, ' pace ', &
         own/ranks/waited
   end subroutine wait_often

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
