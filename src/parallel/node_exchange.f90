!> Sums of node values across blocks and ranks.
!>
!> Every block's tile overlaps its neighbours' by two node layers. Each rank receives the overlapping parts of its remote
!> neighbours' tiles into mirror slots, one message a neighbour rank, described by a derived datatype over the pool of tiles.
!> Then every block sums all the tiles that hold its nodes, in the order of their block indices: blocks that share a node
!> get the same bits, on any number of ranks, and nothing has to be sent back.
module m_node_exchange
   use mpi_f08
   use m_kinds, only: wp, i8
   use m_communicator, only: communicator_t
   use m_level, only: level_t, tile_last, node_values
   implicit none
   private
   public :: node_exchange_t, sum_tiles

   !> The messages of one decomposition of a level.
   type :: node_exchange_t
      integer, allocatable :: ranks(:)                  !< neighbour ranks, rising
      type(MPI_Datatype), allocatable :: give(:), take(:)
      type(MPI_Request), allocatable, private :: requests(:)
      integer(i8) :: bytes_each = 0                     !< sent by this rank in one exchange
      integer(i8) :: messages = 0, bytes = 0            !< sent by this rank over the run
   contains
      procedure :: build
      procedure :: start
      procedure :: progress
      procedure :: wait
      procedure :: release
   end type node_exchange_t

contains

   !> Build the datatypes for the level's blocks and mirrors, whose pool `gathered` must be allocated.
   subroutine build(self, communicator, level)
      class(node_exchange_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(in) :: level
      logical :: neighbour(0:communicator%ranks - 1)
      integer, allocatable :: lengths(:)
      integer(MPI_ADDRESS_KIND), allocatable :: places(:)
      integer :: m, n, r, place(3)
      call self%release()
      neighbour = .false.
      do m = 1, size(level%mirror_index)
         place = level%grid%block_place(level%mirror_index(m))
         neighbour(level%owner_at(place)) = .true.
      end do
      self%ranks = pack([(r, r=0, communicator%ranks - 1)], neighbour)
      n = size(self%ranks)
      allocate (self%give(n), self%take(n), self%requests(2*n))
      self%bytes_each = 0
      do r = 1, n
         call shared_runs(level, communicator%rank, self%ranks(r), lengths, places)
         call make_type(lengths, places, self%give(r))
         self%bytes_each = self%bytes_each + 8_i8*sum(lengths)
         call shared_runs(level, self%ranks(r), communicator%rank, lengths, places)
         call make_type(lengths, places, self%take(r))
      end do
   end subroutine build

   !> The runs of values of all tiles of rank `from` that rank `to` needs, and where in the pool each begins (bytes); the same order
   !> on both ranks.
   subroutine shared_runs(level, from, to, lengths, places)
      type(level_t), intent(in) :: level
      integer, intent(in) :: from, to
      integer, allocatable, intent(out) :: lengths(:)
      integer(MPI_ADDRESS_KIND), allocatable, intent(out) :: places(:)
      integer :: index, place(3), slot
      allocate (lengths(0), places(0))
      do index = 1, product(level%grid%blocks)
         place = level%grid%block_place(index)
         if (level%owner_at(place) /= from) cycle
         slot = level%slot(place(1), place(2), place(3))
         if (slot == 0) cycle
         call add_runs(shared_nodes(level, place, to), slot, lengths, places)
      end do
   end subroutine shared_runs

   !> The nodes of a block's tile that blocks of rank `to` also have.
   pure function shared_nodes(level, place, to) result(shared)
      type(level_t), intent(in) :: level
      integer, intent(in) :: place(3), to
      logical :: shared(0:tile_last, 0:tile_last, 0:tile_last)
      integer :: direction(3), n
      shared = .false.
      do n = 1, 27
         direction = direction_of(n)
         if (n == 14 .or. level%owner_at(place + direction) /= to) cycle
         associate (a => overlap_first(direction), b => overlap_last(direction))
            shared(a(1):b(1), a(2):b(2), a(3):b(3)) = .true.
         end associate
      end do
   end function shared_nodes

   !> Append the runs along x of the marked nodes of one slot.
   subroutine add_runs(shared, slot, lengths, places)
      logical, intent(in) :: shared(0:tile_last, 0:tile_last, 0:tile_last)
      integer, intent(in) :: slot
      integer, allocatable, intent(inout) :: lengths(:)
      integer(MPI_ADDRESS_KIND), allocatable, intent(inout) :: places(:)
      integer, parameter :: width = tile_last + 1, bytes_a_node = node_values*storage_size(1.0_wp)/8
      integer :: i, j, k, first, run_length(width*width*width), runs
      integer(MPI_ADDRESS_KIND) :: run_place(width*width*width)
      runs = 0
      do k = 0, tile_last
         do j = 0, tile_last
            i = 0
            do while (i <= tile_last)
               if (shared(i, j, k)) then
                  first = i
                  do while (i < tile_last)
                     if (.not. shared(i + 1, j, k)) exit
                     i = i + 1
                  end do
                  runs = runs + 1
                  run_length(runs) = node_values*(i - first + 1)
                  run_place(runs) = bytes_a_node*(first + width*(j + width*(k + width*(slot - 1_MPI_ADDRESS_KIND))))
               end if
               i = i + 1
            end do
         end do
      end do
      lengths = [lengths, run_length(:runs)]
      places = [places, run_place(:runs)]
   end subroutine add_runs

   subroutine make_type(lengths, places, datatype)
      integer, intent(in) :: lengths(:)
      integer(MPI_ADDRESS_KIND), intent(in) :: places(:)
      type(MPI_Datatype), intent(out) :: datatype
      call MPI_Type_create_hindexed(size(lengths), lengths, places, MPI_DOUBLE_PRECISION, datatype)
      call MPI_Type_commit(datatype)
   end subroutine make_type

   !> Begin to exchange the tiles of shared blocks; they must be complete. Other blocks may still be worked on.
   subroutine start(self, communicator, gathered)
      class(node_exchange_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      real(wp), intent(inout), contiguous, asynchronous :: gathered(:, :, :, :, :)
      integer :: r, n
      n = size(self%ranks)
      do r = 1, n
         call MPI_Irecv(gathered, 1, self%take(r), self%ranks(r), 1, communicator%comm, self%requests(r))
      end do
      do r = 1, n
         call MPI_Isend(gathered, 1, self%give(r), self%ranks(r), 1, communicator%comm, self%requests(n + r))
      end do
      self%messages = self%messages + n
      self%bytes = self%bytes + self%bytes_each
   end subroutine start

   !> Between two blocks' work: let MPI see to messages that are on their way; large ones move only when both ranks look after them.
   subroutine progress(self, gathered)
      class(node_exchange_t), intent(inout) :: self
      real(wp), intent(inout), contiguous, asynchronous :: gathered(:, :, :, :, :)
      logical :: done
      call MPI_Testall(size(self%requests), self%requests, done, MPI_STATUSES_IGNORE)
      if (.not. MPI_ASYNC_PROTECTS_NONBLOCKING) call MPI_F_sync_reg(gathered)
   end subroutine progress

   !> Wait until the mirrors are filled and the own tiles may be written again.
   subroutine wait(self, gathered)
      class(node_exchange_t), intent(inout) :: self
      real(wp), intent(inout), contiguous, asynchronous :: gathered(:, :, :, :, :)
      call MPI_Waitall(size(self%requests), self%requests, MPI_STATUSES_IGNORE)
      if (.not. MPI_ASYNC_PROTECTS_NONBLOCKING) call MPI_F_sync_reg(gathered)
   end subroutine wait

   !> Free the datatypes.
   subroutine release(self)
      class(node_exchange_t), intent(inout) :: self
      integer :: r
      if (.not. allocated(self%ranks)) return
      do r = 1, size(self%ranks)
         call MPI_Type_free(self%give(r))
         call MPI_Type_free(self%take(r))
      end do
      deallocate (self%ranks, self%give, self%take, self%requests)
   end subroutine release

   !> Sum over all tiles that hold the nodes of a block, in the order of their block indices; with `reach`, only what the tiles
   !> reach, and only where the block's own does: the rest of `total` is left as it is.
   pure subroutine sum_tiles(neighbour, gathered, total, reach)
      integer, intent(in) :: neighbour(27) !< slots around the block, 0 where there is none to be added
      real(wp), intent(in) :: gathered(node_values, 0:tile_last, 0:tile_last, 0:tile_last, *)
      real(wp), intent(inout) :: total(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      integer, intent(in), optional :: reach(2, 3, *) !< by slots, as in the level
      integer :: a(3), b(3), c(3), low(3), high(3), direction(3), n, i, j, k, q
      low = 0
      high = tile_last
      if (present(reach)) low = reach(1, :, neighbour(14))
      if (present(reach)) high = reach(2, :, neighbour(14))
      total(:, low(1):high(1), low(2):high(2), low(3):high(3)) = 0.0_wp
      do n = 1, 27
         if (neighbour(n) == 0) cycle
         direction = direction_of(n)
         c = overlap_first(-direction) - overlap_first(direction)
         a = max(low, overlap_first(direction))
         b = min(high, overlap_last(direction))
         if (present(reach)) a = max(a, reach(1, :, neighbour(n)) - c)
         if (present(reach)) b = min(b, reach(2, :, neighbour(n)) - c)
         do k = a(3), b(3)
            do j = a(2), b(2)
               do i = a(1), b(1)
                  !$omp simd
                  do q = 1, node_values
                     total(q, i, j, k) = total(q, i, j, k) + gathered(q, i + c(1), j + c(2), k + c(3), neighbour(n))
                  end do
               end do
            end do
         end do
      end do
   end subroutine sum_tiles

   !> Direction -1, 0, 1 along each axis of the n-th of the 27 blocks around a block.
   pure function direction_of(n) result(direction)
      integer, intent(in) :: n
      integer :: direction(3)
      direction = [mod(n - 1, 3), mod((n - 1)/3, 3), (n - 1)/9] - 1
   end function direction_of

   !> First and last tile index, along each axis, that a block shares with its neighbour in a direction.
   pure elemental integer function overlap_first(direction)
      integer, intent(in) :: direction
      overlap_first = merge(tile_last - 1, 0, direction == 1)
   end function overlap_first

   pure elemental integer function overlap_last(direction)
      integer, intent(in) :: direction
      overlap_last = merge(1, tile_last, direction == -1)
   end function overlap_last

end module m_node_exchange
