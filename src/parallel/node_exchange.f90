!> Sums of node values across blocks and ranks.
!>
!> Every block's tile overlaps its neighbours' by two node layers. Each rank receives the overlapping parts of
!> its remote neighbours' tiles into ghost slots. Then each local tile that holds a node gets the sum over all
!> these tiles and ghosts, in the order of their block indices: all get the same bits, on any number of ranks,
!> and nothing has to be sent back.
module m_node_exchange
   use m_kinds, only: wp, i8
   use m_constants, only: block_size
   use m_node_values, only: node_values, tile_last
   use m_communicator, only: communicator_t
   use m_halo_runs, only: runs_t, find_neighbours, find_shared
   use m_halo, only: halo_t
   use m_block, only: block_t, directions
   use m_level, only: level_t
   implicit none
   private
   public :: node_exchange_t, sum_tiles

   !> The messages of one decomposition of a level.
   type :: node_exchange_t
      integer, allocatable :: ranks(:)           !< neighbour ranks, rising
      integer(i8) :: bytes_each = 0              !< sent by this rank in one exchange
      integer(i8) :: messages = 0, bytes = 0     !< sent by this rank during the run
      type(halo_t), private :: halo
   contains
      procedure :: build
      procedure :: start
      procedure :: wait
      procedure :: held
      procedure :: release
   end type node_exchange_t

   integer, parameter :: width = tile_last + 1 !< of a tile

   !> A tile that holds shared nodes.
   type :: holder_t
      integer :: slot = 0
      integer(i8) :: start = 0 !< offset in the pool of node (0, 0, 0) of the summing block's tile, if that
                               !< were stored in this tile's slot
      integer :: first(3) = 0, last(3) = 0 !< range of these nodes that it contributes to: indices in that
                                           !< tile
   end type holder_t

contains

   !> Collective: set up the messages of this rank with the level's tiles.
   subroutine build(self, communicator, level)
      class(node_exchange_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(in) :: level
      type(runs_t), allocatable :: send(:), receive(:)
      integer :: r
      self%ranks = find_neighbours(level, communicator%ranks)
      allocate (send(size(self%ranks)), receive(size(self%ranks)))
      do r = 1, size(self%ranks)
         call find_shared(level, communicator%rank, self%ranks(r), send(r))
         call find_shared(level, self%ranks(r), communicator%rank, receive(r))
      end do
      self%bytes_each = sum(send%values)*(storage_size(1.0_wp)/8)
      call self%halo%connect(communicator, self%ranks, send, receive)
   end subroutine build

   !> Start the exchange of the tiles of shared blocks, which must be complete. Until `wait` the parts shared
   !> with other ranks must not be changed, and ghosts must not be read.
   subroutine start(self, tiles)
      class(node_exchange_t), intent(inout) :: self
      real(wp), intent(inout), contiguous, asynchronous :: tiles(:, :, :, :, :)
      if (size(self%ranks) == 0) return
      call self%halo%start(tiles)
      self%messages = self%messages + size(self%ranks)
      self%bytes = self%bytes + self%bytes_each
   end subroutine start

   !> Wait until the ghosts of the same tiles have arrived.
   subroutine wait(self, tiles)
      class(node_exchange_t), intent(inout) :: self
      real(wp), intent(inout), contiguous, asynchronous :: tiles(:, :, :, :, :)
      if (size(self%ranks) > 0) call self%halo%wait(tiles)
   end subroutine wait

   !> Memory held by messages (bytes).
   elemental integer(i8) function held(self)
      class(node_exchange_t), intent(in) :: self
      held = self%halo%held
   end function held

   !> Collective: free the messages.
   subroutine release(self)
      class(node_exchange_t), intent(inout) :: self
      call self%halo%release()
   end subroutine release

   !> Replace the values of shared nodes by the sums over all tiles that hold them, in the order of their
   !> block indices. Each node's sum is computed once, for all local tiles that hold it, by the first of these
   !> blocks in the order `interior_first` of the level: blocks without remote neighbours need no message, and
   !> their tiles are not read after that.
   pure subroutine sum_tiles(blocks, adders, tiles, extent)
      type(block_t), intent(in) :: blocks(:)
      integer, intent(in) :: adders(:) !< blocks that compute the sums: either part of `interior_first`, or
                                       !< both
      real(wp), intent(inout) :: tiles(node_values, 0:tile_last, 0:tile_last, 0:tile_last, *) !< by slots
      integer, intent(in), optional :: extent(2, 3, *) !< by slots: only the part within a tile's extent is
                                                       !< added and changed
      type(holder_t) :: holder(8)
      integer :: a, n, held
      do a = 1, size(adders)
         do n = 1, 27
            if (.not. blocks(adders(a))%owns_shared_sum(n)) cycle
            call find_holders(blocks(adders(a))%neighbour, directions(:, n), extent, holder, held)
            if (held < 2) cycle
            if (held == 2 .and. all(holder(:2)%slot <= size(blocks)) .and. all(holder(1)%first &
               == holder(2)%first) .and. all(holder(1)%last == holder(2)%last)) then
               call sum_two(holder(1), holder(2), tiles)
            else
               call sum_some(holder(:held), size(blocks), tiles)
            end if
         end do
      end do
   end subroutine sum_tiles

   !> The tiles that hold the nodes that a block shares with all its neighbours between it and one direction,
   !> and with no other: by rising block index, without those whose extent does not reach any.
   pure subroutine find_holders(neighbour, direction, extent, holder, held)
      integer, intent(in) :: neighbour(27) !< slots around the block, 0 where there is none
      integer, intent(in) :: direction(3)
      integer, intent(in), optional :: extent(2, 3, *)
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
                  new%start = node_values*(width**3*(slot - 1_i8) - shift(1) &
                                           - width*(shift(2) + width*shift(3)))
                  new%first = shared_first(direction)
                  new%last = shared_last(direction)
                  if (present(extent)) then
                     new%first = max(new%first, extent(1, :, slot) + shift)
                     new%last = min(new%last, extent(2, :, slot) + shift)
                  end if
                  if (all(new%first <= new%last)) held = held + 1
               end associate
            end do
         end do
      end do
   end subroutine find_holders

   !> The most frequent case: two local blocks share a face.
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

   !> Any number of blocks, each with its own extent.
   pure subroutine sum_some(holder, own, tiles)
      type(holder_t), intent(in) :: holder(:)
      integer, intent(in) :: own !< slots up to here are local blocks, the others ghosts
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
      has_row = j >= holder%first(2) .and. j <= holder%last(2) .and. k >= holder%first(3) &
                .and. k <= holder%last(3)
   end function has_row

   !> First and last tile index, along an axis, of the nodes that a block shares only with the neighbours
   !> between it and a direction.
   pure elemental integer function shared_first(direction)
      integer, intent(in) :: direction
      shared_first = merge(tile_last - 1, merge(0, 2, direction == -1), direction == 1)
   end function shared_first

   pure elemental integer function shared_last(direction)
      integer, intent(in) :: direction
      shared_last = merge(1, merge(tile_last, tile_last - 2, direction == 1), direction == -1)
   end function shared_last

end module m_node_exchange
