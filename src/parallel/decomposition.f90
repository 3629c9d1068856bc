!> The blocks of a rank: those it owns, mirrors of its neighbours' next to them, and how all of them are numbered.
module m_decomposition
   use m_kinds, only: wp
   use m_level, only: level_t, tile_last, node_values
   use m_block, only: block_t
   implicit none
   private
   public :: set_owners, all_owners, settle_blocks, blocks_before

contains

   !> Number of the block of level l with index 1 among the blocks of all levels, minus 1: levels one after the other.
   pure integer function blocks_before(levels, l) result(before)
      type(level_t), intent(in) :: levels(:)
      integer, intent(in) :: l
      integer :: m
      before = 0
      do m = 1, l - 1
         before = before + product(levels(m)%grid%blocks)
      end do
   end function blocks_before

   !> The owners of the blocks of every level from those of all.
   subroutine set_owners(levels, owner)
      type(level_t), intent(inout) :: levels(:)
      integer, intent(in) :: owner(:) !< by the numbers of the blocks; -1 where there is none
      integer :: before, l, n(3)
      do l = 1, size(levels)
         before = blocks_before(levels, l)
         n = levels(l)%grid%blocks
         if (.not. allocated(levels(l)%owner)) allocate (levels(l)%owner(0:n(1) - 1, 0:n(2) - 1, 0:n(3) - 1))
         levels(l)%owner(:, :, :) = reshape(owner(before + 1:before + product(n)), n)
      end do
   end subroutine set_owners

   !> The owners of the blocks of all levels.
   pure function all_owners(levels) result(owner)
      type(level_t), intent(in) :: levels(:)
      integer :: owner(blocks_before(levels, size(levels) + 1)), before, l
      do l = 1, size(levels)
         before = blocks_before(levels, l)
         owner(before + 1:before + size(levels(l)%owner)) = reshape(levels(l)%owner, [size(levels(l)%owner)])
      end do
   end function all_owners

   !> Make this rank's blocks, mirrors, slots and pools fit the owners. Blocks that stay keep their particles; blocks that
   !> are new here are empty; the particles of blocks that went elsewhere must have been taken out before.
   subroutine settle_blocks(level, rank)
      type(level_t), intent(inout) :: level
      integer, intent(in) :: rank
      type(block_t), allocatable :: blocks(:)
      integer, allocatable :: old(:)
      integer :: b
      call find_own(level, rank, blocks)
      allocate (old(size(blocks)), source=0)
      if (allocated(level%blocks)) call find_old(level%blocks, blocks, old)
      do b = 1, size(blocks)
         if (old(b) > 0) call take_over(level%blocks(old(b)), blocks(b))
      end do
      call move_alloc(blocks, level%blocks)
      call find_mirrors(level, rank)
      call make_pools(level, old)
      do b = 1, size(level%blocks)
         call level%blocks(b)%reserve(1, level%table%columns)
      end do
      call level%size_work()
   end subroutine settle_blocks

   !> The place of each block among those that were there before, both by rising index; 0 where it was not.
   pure subroutine find_old(before, blocks, old)
      type(block_t), intent(in) :: before(:), blocks(:)
      integer, intent(inout) :: old(:)
      integer :: b, at
      at = 1
      do b = 1, size(blocks)
         do while (at <= size(before))
            if (before(at)%index >= blocks(b)%index) exit
            at = at + 1
         end do
         if (at > size(before)) exit
         if (before(at)%index == blocks(b)%index) old(b) = at
      end do
   end subroutine find_old

   !> Tiles for all slots: those that hold go with their blocks, others may hold anything and reach everywhere. Pools that must grow
   !> get room to spare, but the first: most scenes make no blocks. They do not shrink.
   subroutine make_pools(level, old)
      type(level_t), intent(inout) :: level
      integer, intent(in) :: old(:) !< places of the blocks' tiles before, rising; or 0
      integer, allocatable :: reach(:, :, :)
      integer :: b, slots
      slots = size(level%blocks) + size(level%mirror_index)
      allocate (reach(2, 3, slots))
      reach(1, :, :) = 0
      reach(2, :, :) = tile_last
      do b = 1, size(level%blocks)
         if (level%blocks(b)%tile_holds) reach(:, :, b) = level%reach(:, :, old(b))
      end do
      call move_alloc(reach, level%reach)
      level%solved_reach = spread(spread([0, tile_last], 2, 3), 3, size(level%blocks))
      call fit_pool(level%gathered, slots)
      call fit_pool(level%solved, size(level%blocks))
      call move_tiles(level%gathered, old, level%blocks%tile_holds)
   end subroutine make_pools

   !> Room in a pool for so many tiles; what it holds stays.
   subroutine fit_pool(pool, tiles)
      real(wp), allocatable, intent(inout) :: pool(:, :, :, :, :)
      integer, intent(in) :: tiles
      real(wp), allocatable :: larger(:, :, :, :, :)
      integer :: room
      room = tiles
      if (allocated(pool)) then
         if (size(pool, 5) >= tiles) return
         room = tiles + tiles/8
      end if
      allocate (larger(node_values, 0:tile_last, 0:tile_last, 0:tile_last, room), source=0.0_wp)
      if (allocated(pool)) larger(:, :, :, :, :size(pool, 5)) = pool
      call move_alloc(larger, pool)
   end subroutine fit_pool

   !> Tiles that hold go from their old places to those of their blocks. Both rise, so that none is in the way of another: first all
   !> that go down, from the lowest on, then all that go up, from the highest on.
   pure subroutine move_tiles(pool, old, holds)
      real(wp), intent(inout), contiguous :: pool(:, :, :, :, :)
      integer, intent(in) :: old(:)
      logical, intent(in) :: holds(:)
      integer :: b
      do b = 1, size(old)
         if (holds(b) .and. old(b) > b) pool(:, :, :, :, b) = pool(:, :, :, :, old(b))
      end do
      do b = size(old), 1, -1
         if (holds(b) .and. old(b) < b) pool(:, :, :, :, b) = pool(:, :, :, :, old(b))
      end do
   end subroutine move_tiles

   !> The blocks that this rank owns, by rising index.
   subroutine find_own(level, rank, blocks)
      type(level_t), intent(in) :: level
      integer, intent(in) :: rank
      type(block_t), allocatable, intent(out) :: blocks(:)
      integer :: b, index, place(3)
      allocate (blocks(count(level%owner == rank)))
      b = 0
      do index = 1, size(level%owner)
         place = level%grid%block_place(index)
         if (level%owner_at(place) /= rank) cycle
         b = b + 1
         blocks(b)%place = place
         blocks(b)%index = index
         blocks(b)%origin = level%grid%block_origin(place)
      end do
   end subroutine find_own

   !> Move particles and lists from a block to its successor.
   subroutine take_over(old, new)
      type(block_t), intent(inout) :: old, new
      new%particles%count = old%particles%count
      call move_alloc(old%particles%column, new%particles%column)
      call move_alloc(old%particles%id, new%particles%id)
      call move_alloc(old%particles%body, new%particles%body)
      new%particles%one_body = old%particles%one_body
      new%arrived = old%arrived
      call old%cells%hand_over(new%cells)
      new%jumps = old%jumps
      new%disorder = old%disorder
      call move_alloc(old%leavers, new%leavers)
      new%leaver_count = old%leaver_count
      new%pressed = old%pressed
      new%at_rest = old%at_rest
      new%tile_holds = old%tile_holds
      new%sums_hold = old%sums_hold
      new%sums = old%sums
      new%wave_speed = old%wave_speed
      new%lowest = old%lowest
      new%highest = old%highest
   end subroutine take_over

   !> Mirrors of the remote neighbours, slots of all, and each block's table of neighbours.
   subroutine find_mirrors(level, rank)
      type(level_t), intent(inout) :: level
      integer, intent(in) :: rank
      integer :: b, index, m, n, place(3), other(3)
      if (.not. allocated(level%slot)) allocate (level%slot(0:level%grid%blocks(1) - 1, 0:level%grid%blocks(2) - 1, &
                                                      0:level%grid%blocks(3) - 1))
      level%slot = 0
      do b = 1, size(level%blocks)
         place = level%blocks(b)%place
         level%slot(place(1), place(2), place(3)) = b
      end do
      if (allocated(level%mirror_index)) deallocate (level%mirror_index)
      allocate (level%mirror_index(0))
      m = size(level%blocks)
      do index = 1, size(level%owner)
         place = level%grid%block_place(index)
         if (level%owner_at(place) < 0 .or. level%owner_at(place) == rank) cycle
         if (.not. touches(place)) cycle
         m = m + 1
         level%slot(place(1), place(2), place(3)) = m
         level%mirror_index = [level%mirror_index, index]
      end do
      do b = 1, size(level%blocks)
         level%blocks(b)%shared = .false.
         do n = 1, 27
            other = level%blocks(b)%place + [mod(n - 1, 3), mod((n - 1)/3, 3), (n - 1)/9] - 1
            level%blocks(b)%neighbour(n) = 0
            if (level%owner_at(other) < 0) cycle
            level%blocks(b)%neighbour(n) = level%slot(other(1), other(2), other(3))
            if (level%owner_at(other) /= rank) level%blocks(b)%shared = .true.
         end do
      end do
   contains
      !> True when one of this rank's blocks is next to a place.
      pure logical function touches(place)
         integer, intent(in) :: place(3)
         integer :: a(3), z(3)
         a = max(place - 1, 0)
         z = min(place + 1, level%grid%blocks - 1)
         touches = any(level%owner(a(1):z(1), a(2):z(2), a(3):z(3)) == rank)
      end function touches
   end subroutine find_mirrors

end module m_decomposition
