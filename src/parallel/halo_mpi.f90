!> Halo exchange by MPI: one message to and from each neighbour rank, directly from and into the pool of
!> tiles. The nodes of a message are an MPI derived datatype, built once per decomposition.
module m_halo
   use mpi_f08
   use m_kinds, only: wp, i8
   use m_communicator, only: communicator_t
   use m_halo_runs, only: runs_t
   implicit none
   private
   public :: halo_t

   type :: halo_t
      integer(i8) :: held = 0 !< memory of send and receive buffers (bytes): none, values go from tile to tile
      type(MPI_Comm), private :: comm = MPI_COMM_NULL
      integer, allocatable, private :: ranks(:)               !< neighbours
      type(MPI_Datatype), allocatable, private :: sent(:)     !< by neighbour: nodes of own tiles
      type(MPI_Datatype), allocatable, private :: received(:) !< by neighbour: nodes of ghosts
      type(MPI_Request), allocatable, private :: requests(:)
   contains
      procedure :: connect
      procedure :: start
      procedure :: wait
      procedure :: release
   end type halo_t

contains

   !> Set the messages to and from some neighbours, replacing the old ones.
   subroutine connect(self, communicator, ranks, send, receive)
      class(halo_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      integer, intent(in) :: ranks(:)
      type(runs_t), intent(in) :: send(:), receive(:) !< by neighbour
      integer :: r
      call self%release()
      self%comm = communicator%comm
      self%ranks = ranks
      self%sent = [(datatype(send(r)), r=1, size(ranks))]
      self%received = [(datatype(receive(r)), r=1, size(ranks))]
      allocate (self%requests(2*size(ranks)))
   end subroutine connect

   !> MPI datatype of runs of a pool of tiles.
   type(MPI_Datatype) function datatype(runs)
      type(runs_t), intent(in) :: runs
      integer(MPI_ADDRESS_KIND) :: bytes_before(size(runs%before))
      bytes_before = runs%before*(storage_size(1.0_wp)/8)
      call MPI_Type_create_hindexed(size(runs%length), runs%length, bytes_before, MPI_DOUBLE_PRECISION, &
                                    datatype)
      call MPI_Type_commit(datatype)
   end function datatype

   !> Start an exchange. Until `wait` the values sent must not be changed, and those received must not be
   !> read.
   subroutine start(self, tiles)
      class(halo_t), intent(inout) :: self
      real(wp), intent(inout), contiguous, asynchronous :: tiles(:, :, :, :, :)
      integer :: n, r
      n = size(self%ranks)
      do r = 1, n
         call MPI_Irecv(tiles, 1, self%received(r), self%ranks(r), 1, self%comm, self%requests(r))
      end do
      do r = 1, n
         call MPI_Isend(tiles, 1, self%sent(r), self%ranks(r), 1, self%comm, self%requests(n + r))
      end do
   end subroutine start

   !> Wait for the exchange started last.
   subroutine wait(self, tiles)
      class(halo_t), intent(inout) :: self
      real(wp), intent(inout), contiguous, asynchronous :: tiles(:, :, :, :, :)
      call MPI_Waitall(size(self%requests), self%requests, MPI_STATUSES_IGNORE)
      if (.not. MPI_ASYNC_PROTECTS_NONBLOCKING) call MPI_F_sync_reg(tiles)
   end subroutine wait

   !> Free the datatypes.
   subroutine release(self)
      class(halo_t), intent(inout) :: self
      integer :: r
      if (.not. allocated(self%ranks)) return
      do r = 1, size(self%ranks)
         call MPI_Type_free(self%sent(r))
         call MPI_Type_free(self%received(r))
      end do
      deallocate (self%ranks, self%sent, self%received, self%requests)
   end subroutine release

end module m_halo
