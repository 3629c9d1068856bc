!> Exchange of patches of nodes between the ranks of edge blocks and those of their parents: one message a
!> neighbour and direction, by an MPI datatype over the pool of patches.
module m_patch_exchange
   use mpi_f08
   use m_kinds, only: wp, i8
   use m_communicator, only: communicator_t
   implicit none
   private

   type, public :: patch_exchange_t
      integer :: messages_each(2) = 0        !< sent by this rank in one exchange, up and down
      integer(i8) :: bytes_each(2) = 0
      integer(i8) :: messages = 0, bytes = 0 !< sent by this rank during the run
      integer, allocatable, private :: ranks(:)
      type(MPI_Datatype), allocatable, private :: datatypes(:, :) !< (2, ranks): the patches of own blocks,
                                                                  !< and of own parents, shared with a rank
      integer, allocatable, private :: patches(:, :) !< number of these patches
      integer, private :: values = 0                 !< values of a patch
   contains
      procedure :: build
      procedure :: exchange
      procedure :: release
   end type patch_exchange_t

contains

   !> Set up the patches sent to and received from each rank.
   subroutine build(self, rank_beyond, own, communicator, values)
      class(patch_exchange_t), intent(inout) :: self
      integer, intent(in) :: rank_beyond(:) !< for each patch of the pool
      integer, intent(in) :: own            !< number of patches of own blocks, which come first; the others
                                            !< are of own parents
      type(communicator_t), intent(in) :: communicator
      integer, intent(in) :: values         !< values of a patch
      integer :: e, r, side
      logical :: is_own(size(rank_beyond))
      self%values = values
      self%ranks = pack([(r, r=0, communicator%ranks - 1)], &
                        [(any(rank_beyond == r) .and. r /= communicator%rank, r=0, communicator%ranks - 1)])
      is_own = [(e <= own, e=1, size(rank_beyond))]
      allocate (self%datatypes(2, size(self%ranks)), self%patches(2, size(self%ranks)))
      do r = 1, size(self%ranks)
         do side = 1, 2
            associate (numbers => pack([(e - 1, e=1, size(rank_beyond))], &
                                       rank_beyond == self%ranks(r) .and. (is_own .eqv. side == 1)))
               self%patches(side, r) = size(numbers)
               call MPI_Type_create_indexed_block(size(numbers), values, values*numbers, &
                                                  MPI_DOUBLE_PRECISION, self%datatypes(side, r))
            end associate
            call MPI_Type_commit(self%datatypes(side, r))
         end do
      end do
      self%messages_each = count(self%patches > 0, dim=2)
      self%bytes_each = 8_i8*values*sum(self%patches, dim=2)
   end subroutine build

   !> Collective: send upwards from own blocks to the ranks of their parents, or down from own parents to the
   !> ranks of the blocks.
   subroutine exchange(self, communicator, pool, upwards)
      class(patch_exchange_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      real(wp), intent(inout), contiguous, asynchronous :: pool(:, :, :, :, :)
      logical, intent(in) :: upwards
      type(MPI_Request) :: requests(2*size(self%ranks))
      integer :: n, r, from, to
      from = merge(1, 2, upwards)
      to = 3 - from
      n = 0
      do r = 1, size(self%ranks)
         if (self%patches(to, r) > 0) then
            n = n + 1
            call MPI_Irecv(pool, 1, self%datatypes(to, r), self%ranks(r), 3, communicator%comm, requests(n))
         end if
         if (self%patches(from, r) > 0) then
            n = n + 1
            call MPI_Isend(pool, 1, self%datatypes(from, r), self%ranks(r), 3, communicator%comm, requests(n))
         end if
      end do
      self%messages = self%messages + self%messages_each(from)
      self%bytes = self%bytes + self%bytes_each(from)
      call MPI_Waitall(n, requests, MPI_STATUSES_IGNORE)
      if (.not. MPI_ASYNC_PROTECTS_NONBLOCKING) call MPI_F_sync_reg(pool)
   end subroutine exchange

   !> Free the datatypes.
   subroutine release(self)
      class(patch_exchange_t), intent(inout) :: self
      integer :: r, side
      do r = 1, size(self%ranks)
         do side = 1, 2
            call MPI_Type_free(self%datatypes(side, r))
         end do
      end do
      deallocate (self%ranks, self%datatypes, self%patches)
   end subroutine release

end module m_patch_exchange
