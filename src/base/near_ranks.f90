!> The ranks with blocks next to this rank's blocks, and messages between them: one to and one from each, by
!> MPI's neighbourhood collectives.
module m_near_ranks
   use mpi_f08
   use m_kinds, only: wp, i8
   use m_communicator, only: communicator_t
   implicit none
   private

   type, public :: near_ranks_t
      integer, allocatable :: ranks(:) !< other ranks, rising; the relation is symmetric
      type(MPI_Comm), private :: graph = MPI_COMM_NULL
   contains
      procedure :: connect
      procedure :: swap_counts
      procedure :: swap_reals
      procedure :: swap_integers
      procedure :: swap_longs
   end type near_ranks_t

contains

   !> Collective over all ranks, when `ranks` is set: create the graph communicator for one message per pair.
   subroutine connect(self, communicator)
      class(near_ranks_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      integer :: weights(size(self%ranks))
      if (self%graph /= MPI_COMM_NULL) call MPI_Comm_free(self%graph)
      if (communicator%ranks == 1) return
      weights = 1
      call MPI_Dist_graph_create_adjacent(communicator%comm, size(weights), self%ranks, weights, &
                                          size(weights), self%ranks, weights, MPI_INFO_NULL, .false., &
                                          self%graph)
   end subroutine connect

   !> Collective among them: send a number to each, and receive one from each.
   subroutine swap_counts(self, given, taken)
      class(near_ranks_t), intent(in) :: self
      integer, intent(in) :: given(:)  !< (ranks)
      integer, intent(out) :: taken(:) !< (ranks)
      if (size(given) == 0) return
      call MPI_Neighbor_alltoall(given, 1, MPI_INTEGER, taken, 1, MPI_INTEGER, self%graph)
   end subroutine swap_counts

   !> Collective among them: send `counts` values to each, and receive values from each, rank by rank.
   subroutine swap_reals(self, given, counts_given, taken, counts_taken)
      class(near_ranks_t), intent(in) :: self
      real(wp), intent(in) :: given(*)
      real(wp), intent(inout) :: taken(*)
      integer, intent(in) :: counts_given(:), counts_taken(:) !< (ranks)
      if (size(counts_given) == 0) return
      call MPI_Neighbor_alltoallv(given, counts_given, starts(counts_given), MPI_DOUBLE_PRECISION, taken, &
                                  counts_taken, starts(counts_taken), MPI_DOUBLE_PRECISION, self%graph)
   end subroutine swap_reals

   subroutine swap_integers(self, given, counts_given, taken, counts_taken)
      class(near_ranks_t), intent(in) :: self
      integer, intent(in) :: given(*)
      integer, intent(inout) :: taken(*)
      integer, intent(in) :: counts_given(:), counts_taken(:) !< (ranks)
      if (size(counts_given) == 0) return
      call MPI_Neighbor_alltoallv(given, counts_given, starts(counts_given), MPI_INTEGER, taken, &
                                  counts_taken, starts(counts_taken), MPI_INTEGER, self%graph)
   end subroutine swap_integers

   subroutine swap_longs(self, given, counts_given, taken, counts_taken)
      class(near_ranks_t), intent(in) :: self
      integer(i8), intent(in) :: given(*)
      integer(i8), intent(inout) :: taken(*)
      integer, intent(in) :: counts_given(:), counts_taken(:) !< (ranks)
      if (size(counts_given) == 0) return
      call MPI_Neighbor_alltoallv(given, counts_given, starts(counts_given), MPI_INTEGER8, taken, &
                                  counts_taken, starts(counts_taken), MPI_INTEGER8, self%graph)
   end subroutine swap_longs

   !> Number of values before those of each rank.
   pure function starts(counts)
      integer, intent(in) :: counts(:)
      integer :: starts(size(counts)), r
      starts = [(sum(counts(:r - 1)), r=1, size(counts))]
   end function starts

end module m_near_ranks
