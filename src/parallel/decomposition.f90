!> The blocks of a rank: those it owns, ghosts of its neighbours' next to them, and how all of them are
!> numbered.
module m_decomposition
   use m_kinds, only: wp
   use m_node_values, only: tile_last
   use m_level, only: level_t, fit_pool
   use m_block, only: block_t, directions
   implicit none
   private
   public :: set_owners, all_owners, settle_blocks, blocks_before

contains

   !> Number of the block of level l with index 1 among the blocks of all levels, minus 1: levels one after
   !> the other.
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

   !> Make this rank's blocks, ghosts, slots and pools fit the owners. Blocks that stay keep their particles;
   !> blocks that are new here are empty; the particles of blocks that went elsewhere must have been taken out
   !> before.
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
         if (old(b) > 0) call blocks(b)%take_contents(level%blocks(old(b)))
      end do
      call move_alloc(blocks, level%blocks)
      do b = 1, size(level%blocks)
         call level%blocks(b)%reserve(1, level%table%columns)
      end do
      call find_ghosts(level, rank)
      call make_pools(level, old)
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

   !> Tiles for all slots: those that hold go with their blocks, others may hold anything, everywhere.
   subroutine make_pools(level, old)
      type(level_t), intent(inout) :: level
      integer, intent(in) :: old(:) !< places of the blocks' tiles before, rising; or 0
      integer, allocatable :: extent(:, :, :)
      logical :: holds(size(level%blocks))
      integer :: b, slots
      slots = size(level%blocks) + size(level%ghost_index)
      allocate (extent(2, 3, slots))
      extent(1, :, :) = 0
      extent(2, :, :) = tile_last
      do b = 1, size(level%blocks)
         holds(b) = level%blocks(b)%in_tile() > 0
         if (holds(b)) extent(:, :, b) = level%extent(:, :, old(b))
      end do
      call move_alloc(extent, level%extent)
      call fit_pool(level%nodes, slots)
      call move_tiles(level%nodes, old, holds)
   end subroutine make_pools

   !> Tiles that hold go from their old places to those of their blocks. Both rise, so that none is in the way
   !> of another: first all that go down, from the lowest on, then all that go up, from the highest on.
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

   !> Of the own blocks from a block to its neighbour in the n-th of 27 directions, both included, the one
   !> whose turn comes first: those without remote neighbours go first, each part by rising index.
   pure integer function first_between(blocks, neighbour, n) result(first)
      type(block_t), intent(in) :: blocks(:)
      integer, intent(in) :: neighbour(27), n !< slots
      integer :: x, y, z, far(3)
      far = directions(:, n)
      first = 0
      do z = min(0, far(3)), max(0, far(3))
         do y = min(0, far(2)), max(0, far(2))
            do x = min(0, far(1)), max(0, far(1))
               associate (slot => neighbour(14 + x + 3*y + 9*z))
                  if (slot == 0 .or. slot > size(blocks)) cycle
                  if (first == 0) then
                     first = slot
                  else if (blocks(first)%shared .and. .not. blocks(slot)%shared) then
                     first = slot
                  end if
               end associate
            end do
         end do
      end do
   end function first_between

   !> Ghosts of the remote neighbours, slots of all, each block's table of neighbours, and the order in which
   !> blocks are gone through where messages are on their way.
   subroutine find_ghosts(level, rank)
      type(level_t), intent(inout) :: level
      integer, intent(in) :: rank
      integer :: b, index, m, n, place(3), other(3)
      if (.not. allocated(level%slot)) &
         allocate (level%slot(0:level%grid%blocks(1) - 1, 0:level%grid%blocks(2) - 1, &
                              0:level%grid%blocks(3) - 1))
      level%slot = 0
      do b = 1, size(level%blocks)
         place = level%blocks(b)%place
         level%slot(place(1), place(2), place(3)) = b
      end do
      if (allocated(level%ghost_index)) deallocate (level%ghost_index)
      allocate (level%ghost_index(0))
      m = size(level%blocks)
      do index = 1, size(level%owner)
         place = level%grid%block_place(index)
         if (level%owner_at(place) < 0 .or. level%owner_at(place) == rank) cycle
         if (.not. touches(place)) cycle
         m = m + 1
         level%slot(place(1), place(2), place(3)) = m
         level%ghost_index = [level%ghost_index, index]
      end do
      do b = 1, size(level%blocks)
         level%blocks(b)%shared = .false.
         do n = 1, 27
            other = level%blocks(b)%place + directions(:, n)
            level%blocks(b)%neighbour(n) = 0
            if (level%owner_at(other) < 0) cycle
            level%blocks(b)%neighbour(n) = level%slot(other(1), other(2), other(3))
            if (level%owner_at(other) /= rank) level%blocks(b)%shared = .true.
         end do
      end do
      do b = 1, size(level%blocks)
         do n = 1, 27
            level%blocks(b)%owns_shared_sum(n) = n /= 14 .and. b == first_between(level%blocks, &
                  level%blocks(b)%neighbour, n)
         end do
      end do
      level%interior_first = [pack([(b, b=1, size(level%blocks))], .not. level%blocks%shared), &
                           pack([(b, b=1, size(level%blocks))], level%blocks%shared)]
      level%part_end = [0, count(.not. level%blocks%shared), size(level%blocks)]
   contains
      !> True when one of this rank's blocks is next to a place.
      pure logical function touches(place)
         integer, intent(in) :: place(3)
         integer :: a(3), z(3)
         a = max(place - 1, 0)
         z = min(place + 1, level%grid%blocks - 1)
         touches = any(level%owner(a(1):z(1), a(2):z(2), a(3):z(3)) == rank)
      end function touches
   end subroutine find_ghosts

end module m_decomposition
