!> Sums of node values across blocks and ranks.
!>
!> Every block's tile overlaps its neighbours' by two node layers. Each rank receives the overlapping parts of its remote
!> neighbours' tiles into mirror slots, one message a neighbour rank, described by a derived datatype over the pool of tiles.
!> Then all tiles here that hold a node take, in place of what they have, the sum over them and the mirrors, in the order of their
!> block indices: they get the same bits, on any number of ranks, and nothing has to be sent back.
module m_node_exchange
   use mpi_f08
   use m_kinds, only: wp, i8
   use m_constants, only: block_size
   use m_communicator, only: communicator_t
   use m_block, only: block_t, direction_of
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

   integer, parameter :: width = tile_last + 1 !< of a tile

   !> A tile that holds nodes that blocks share.
   type :: holder_t
      integer :: slot = 0
      integer(i8) :: start = 0 !< place in the pool of node (0, 0, 0) of the tile of the block that asks, were it there
      integer :: first(3) = 0, last(3) = 0 !< of these nodes those that it reaches: indices in that tile
   end type holder_t

contains

   !> Build the datatypes for the level's blocks and mirrors, whose pool of tiles must be allocated.
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
      logical :: shared(0:tile_last, 0:tile_last, 0:tile_last)
      integer :: index, place(3), runs, slot
      allocate (lengths(2*width**2), places(2*width**2))
      runs = 0
      do index = 1, product(level%grid%blocks)
         place = level%grid%block_place(index)
         if (level%owner_at(place) /= from) cycle
         slot = level%slot(place(1), place(2), place(3))
         if (slot == 0) cycle
         shared = shared_nodes(level, place, to)
         if (any(shared)) call add_runs(shared, slot, runs, lengths, places)
      end do
      lengths = lengths(:runs)
      places = places(:runs)
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

   !> Append the runs along x of the marked nodes of one slot to the first `runs`: at most two a row, for they begin or end at a side.
   subroutine add_runs(shared, slot, runs, lengths, places)
      logical, intent(in) :: shared(0:tile_last, 0:tile_last, 0:tile_last)
      integer, intent(in) :: slot
      integer, intent(inout) :: runs
      integer, allocatable, intent(inout) :: lengths(:)
      integer(MPI_ADDRESS_KIND), allocatable, intent(inout) :: places(:)
      integer, parameter :: bytes_a_node = node_values*storage_size(1.0_wp)/8
      integer :: i, j, k, first
      if (size(lengths) < runs + 2*width**2) then
         lengths = [lengths, spread(0, 1, runs + 2*width**2)]
         places = [places, spread(0_MPI_ADDRESS_KIND, 1, runs + 2*width**2)]
      end if
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
                  lengths(runs) = node_values*(i - first + 1)
                  places(runs) = bytes_a_node*(first + width*(j + width*(k + width*(slot - 1_MPI_ADDRESS_KIND))))
               end if
               i = i + 1
            end do
         end do
      end do
   end subroutine add_runs

   subroutine make_type(lengths, places, datatype)
      integer, intent(in) :: lengths(:)
      integer(MPI_ADDRESS_KIND), intent(in) :: places(:)
      type(MPI_Datatype), intent(out) :: datatype
      call MPI_Type_create_hindexed(size(lengths), lengths, places, MPI_DOUBLE_PRECISION, datatype)
      call MPI_Type_commit(datatype)
   end subroutine make_type

   !> Begin to exchange the tiles of shared blocks; they must be complete. Other blocks may still be worked on.
   subroutine start(self, communicator, tiles)
      class(node_exchange_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      real(wp), intent(inout), contiguous, asynchronous :: tiles(:, :, :, :, :)
      integer :: r, n
      n = size(self%ranks)
      do r = 1, n
         call MPI_Irecv(tiles, 1, self%take(r), self%ranks(r), 1, communicator%comm, self%requests(r))
      end do
      do r = 1, n
         call MPI_Isend(tiles, 1, self%give(r), self%ranks(r), 1, communicator%comm, self%requests(n + r))
      end do
      self%messages = self%messages + n
      self%bytes = self%bytes + self%bytes_each
   end subroutine start

   !> Between two blocks' work: let MPI see to messages that are on their way; large ones move only when both ranks look after them.
   subroutine progress(self, tiles)
      class(node_exchange_t), intent(inout) :: self
      real(wp), intent(inout), contiguous, asynchronous :: tiles(:, :, :, :, :)
      logical :: done
      call MPI_Testall(size(self%requests), self%requests, done, MPI_STATUSES_IGNORE)
      if (.not. MPI_ASYNC_PROTECTS_NONBLOCKING) call MPI_F_sync_reg(tiles)
   end subroutine progress

   !> Wait until the mirrors are filled and the own tiles may be written again.
   subroutine wait(self, tiles)
      class(node_exchange_t), intent(inout) :: self
      real(wp), intent(inout), contiguous, asynchronous :: tiles(:, :, :, :, :)
      call MPI_Waitall(size(self%requests), self%requests, MPI_STATUSES_IGNORE)
      if (.not. MPI_ASYNC_PROTECTS_NONBLOCKING) call MPI_F_sync_reg(tiles)
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

   !> In place of what the tiles hold of the nodes that blocks share: the sums over all tiles that hold them, in the order of their
   !> block indices. Each node's are made once, for all tiles here that hold it, by the first of these blocks in the order
   !> `inner_first` of the level, so that those without remote neighbours need no message, and nobody asks for their tiles after
   !> that.
   pure subroutine sum_tiles(blocks, adders, tiles, reach, wanted)
      type(block_t), intent(in) :: blocks(:)
      integer, intent(in) :: adders(:) !< whose sums are made: those of either part of `inner_first`, or of both
      real(wp), intent(inout) :: tiles(node_values, 0:tile_last, 0:tile_last, 0:tile_last, *) !< by slots
      integer, intent(in), optional :: reach(2, 3, *) !< by slots: only what tiles reach is added, and changed
      logical, intent(in), optional :: wanted(:)      !< by own blocks: only nodes that one of these has
      type(holder_t) :: holder(8)
      integer :: a, n, held
      do a = 1, size(adders)
         do n = 1, 27
            if (.not. blocks(adders(a))%adds_up(n)) cycle
            call find_holders(blocks(adders(a))%neighbour, direction_of(n), reach, holder, held)
            if (held < 2) cycle
            if (present(wanted)) then
               if (.not. any(is_wanted(holder(:held)%slot))) cycle
            end if
            if (held == 2 .and. all(holder(:2)%slot <= size(blocks)) .and. all(holder(1)%first == holder(2)%first) &
                .and. all(holder(1)%last == holder(2)%last)) then
               call sum_two(holder(1), holder(2), tiles)
            else
               call sum_some(holder(:held), size(blocks), tiles)
            end if
         end do
      end do
   contains
      pure elemental logical function is_wanted(slot)
         integer, intent(in) :: slot
         is_wanted = .false.
         if (slot <= size(blocks)) is_wanted = wanted(slot)
      end function is_wanted
   end subroutine sum_tiles

   !> The tiles that hold the nodes that a block shares with all its neighbours between it and one direction, and with no other: by
   !> rising block index, without those that do not reach any.
   pure subroutine find_holders(neighbour, direction, reach, holder, held)
      integer, intent(in) :: neighbour(27) !< slots around the block, 0 where there is none
      integer, intent(in) :: direction(3)
      integer, intent(in), optional :: reach(2, 3, *)
      type(holder_t), intent(out) :: holder(8)
      integer, intent(out) :: held
      integer :: x, y, z, shift(3)
      held = 0
      do z = min(0, direction(3)), max(0, direction(3))
         do y = min(0, direction(2)), max(0, direction(2))
            do x = min(0, direction(1)), max(0, direction(1))
               associate (slot => neighbour(14 + x + 3*y + 9*z), new => holder(held + 1))
                  if (slot == 0) cycle
                  shift = block_size*[x, y, z]
                  new%slot = slot
                  new%start = node_values*(width**3*(slot - 1_i8) - shift(1) - width*(shift(2) + width*shift(3)))
                  new%first = shared_first(direction)
                  new%last = shared_last(direction)
                  if (present(reach)) then
                     new%first = max(new%first, reach(1, :, slot) + shift)
                     new%last = min(new%last, reach(2, :, slot) + shift)
                  end if
                  if (all(new%first <= new%last)) held = held + 1
               end associate
            end do
         end do
      end do
   end subroutine find_holders

   !> What most nodes take part in: two blocks here share a face.
   pure subroutine sum_two(one, two, tiles)
      type(holder_t), intent(in) :: one, two !< of the same nodes
      real(wp), intent(inout) :: tiles(*)
      real(wp) :: total
      integer :: j, k, q
      integer(i8) :: p, r
      do k = one%first(3), one%last(3)
         do j = one%first(2), one%last(2)
            p = one%start + node_values*width*(j + width*k)
            r = two%start + node_values*width*(j + width*k)
            !$omp simd private(total)
            do q = node_values*one%first(1) + 1, node_values*(one%last(1) + 1)
               total = tiles(p + q) + tiles(r + q)
               tiles(p + q) = total
               tiles(r + q) = total
            end do
         end do
      end do
   end subroutine sum_two

   !> Any number of blocks, each with what it reaches.
   pure subroutine sum_some(holder, own, tiles)
      type(holder_t), intent(in) :: holder(:)
      integer, intent(in) :: own !< slots up to here are of blocks here, the others of mirrors
      real(wp), intent(inout) :: tiles(*)
      real(wp) :: total(node_values*width)
      integer :: h, j, k, q
      integer(i8) :: p
      do k = minval(holder%first(3)), maxval(holder%last(3))
         do j = minval(holder%first(2)), maxval(holder%last(2))
            total = 0.0_wp
            do h = 1, size(holder)
               if (.not. has_row(holder(h), j, k)) cycle
               p = holder(h)%start + node_values*width*(j + width*k)
               !$omp simd
               do q = node_values*holder(h)%first(1) + 1, node_values*(holder(h)%last(1) + 1)
                  total(q) = total(q) + tiles(p + q)
               end do
            end do
            do h = 1, size(holder)
               if (holder(h)%slot > own .or. .not. has_row(holder(h), j, k)) cycle
               p = holder(h)%start + node_values*width*(j + width*k)
               !$omp simd
               do q = node_values*holder(h)%first(1) + 1, node_values*(holder(h)%last(1) + 1)
                  tiles(p + q) = total(q)
               end do
            end do
         end do
      end do
   end subroutine sum_some

   pure logical function has_row(holder, j, k)
      type(holder_t), intent(in) :: holder
      integer, intent(in) :: j, k
      has_row = j >= holder%first(2) .and. j <= holder%last(2) .and. k >= holder%first(3) .and. k <= holder%last(3)
   end function has_row

   !> First and last tile index, along an axis, of what a block shares with all neighbours between it and a direction alone.
   pure elemental integer function shared_first(direction)
      integer, intent(in) :: direction
      shared_first = merge(tile_last - 1, merge(0, 2, direction == -1), direction == 1)
   end function shared_first

   pure elemental integer function shared_last(direction)
      integer, intent(in) :: direction
      shared_last = merge(1, merge(tile_last, tile_last - 2, direction == 1), direction == -1)
   end function shared_last

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
