!> The blocks of a rank: own blocks, ghosts of neighbouring blocks of other ranks, and their numbering.
module m_decomposition
   use m_kinds, only: wp, i8
   use m_node_values, only: tile_last
   use m_field_table, only: bytes_per_column
   use m_particle_store, only: bytes_besides
   use m_level, only: level_t, fit_pool, tile_bytes
   use m_block, only: block_t, directions
   implicit none
   private
   public :: set_owners, all_owners, bytes_of_blocks, settle_blocks, blocks_before

contains

   !> Offset of level l in the numbering of all blocks, level after level: the number of the block with index
   !> 1, minus 1.
   pure integer function blocks_before(levels, l) result(before)
      type(level_t), intent(in) :: levels(:)
      integer, intent(in) :: l
      integer :: m
      before = 0
      do m = 1, l - 1
         before = before + levels(m)%grid%block_count()
      end do
   end function blocks_before

   !> Set the owners of the blocks of every level from those of all.
   subroutine set_owners(levels, owner)
      type(level_t), intent(inout) :: levels(:)
      integer, intent(in) :: owner(:) !< by the numbers of the blocks; -1 where there is no block
      integer :: l
      do l = 1, size(levels)
         levels(l)%owner = owner(blocks_before(levels, l) + 1:blocks_before(levels, l + 1))
      end do
   end subroutine set_owners

   !> Memory of the particles and tiles of a rank's blocks, bytes.
   pure integer(i8) function bytes_of_blocks(levels, counts, owner, rank) result(bytes)
      type(level_t), intent(in) :: levels(:)
      integer, intent(in) :: counts(:), owner(:) !< particles and owners of blocks, by their numbers
      integer, intent(in) :: rank
      bytes = count(owner == rank)*tile_bytes &
              + sum(int(max(counts, 0), i8), mask=owner == rank) &
              *(bytes_per_column*levels(1)%table%columns + bytes_besides)
   end function bytes_of_blocks

   !> The owners of the blocks of all levels.
   pure function all_owners(levels) result(owner)
      type(level_t), intent(in) :: levels(:)
      integer :: owner(blocks_before(levels, size(levels) + 1)), l
      do l = 1, size(levels)
         owner(blocks_before(levels, l) + 1:blocks_before(levels, l + 1)) = levels(l)%owner
      end do
   end function all_owners

   !> Adapt this rank's blocks, ghosts, slots and pools to the owners. Blocks that stay keep their particles;
   !> new blocks are empty; the particles of blocks that moved away must have been taken out before.
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

   !> The position of each block in the old list, both lists by rising index; 0 where it is new.
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

   !> Tiles for all slots: tiles in use move with their blocks, the others have undefined contents.
   subroutine make_pools(level, old)
      type(level_t), intent(inout) :: level
      integer, intent(in) :: old(:) !< old positions of the blocks' tiles, rising; or 0
      integer, allocatable :: extent(:, :, :)
      logical :: holds(size(level%blocks))
      integer :: b, slots
      slots = size(level%blocks) + size(level%ghost_index)
      allocate (extent(2, 3, slots))
      extent(1, :, :) = 0
      extent(2, :, :) = tile_last
      do b = size(level%blocks) + 1, slots
         extent(:, 2, b) = level%grid%rows ! of ghosts
      end do
      do b = 1, size(level%blocks)
         holds(b) = level%blocks(b)%in_tile() > 0
         if (holds(b)) extent(:, :, b) = level%extent(:, :, old(b))
      end do
      call move_alloc(extent, level%extent)
      call fit_pool(level%nodes, slots)
      call move_tiles(level%nodes, old, holds)
   end subroutine make_pools

   !> Move tiles in use from their old positions to those of their blocks. Both rise, so no tile overwrites
   !> another: first all that move down, from the lowest on, then all that move up, from the highest on.
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
         if (level%owner(index) /= rank) cycle
         b = b + 1
         place = level%grid%block_place(index)
         blocks(b)%place = place
         blocks(b)%field = level%grid%block_field(index)
         blocks(b)%index = index
         blocks(b)%origin = level%grid%block_origin(place)
      end do
   end subroutine find_own

   !> Of the own blocks from a block to its neighbour in the n-th of 27 directions, both included, the one
   !> that is processed first: those without remote neighbours first, each part by rising index.
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

   !> Set up ghosts of the remote neighbours, slots of all, each block's table of neighbours, and the order in
   !> which blocks are processed while messages are under way.
   subroutine find_ghosts(level, rank)
      type(level_t), intent(inout) :: level
      integer, intent(in) :: rank
      integer :: b, index, m, n
      if (.not. allocated(level%slot)) allocate (level%slot(size(level%owner)))
      level%slot = 0
      do b = 1, size(level%blocks)
         level%slot(level%blocks(b)%index) = b
      end do
      if (allocated(level%ghost_index)) deallocate (level%ghost_index)
      allocate (level%ghost_index(0))
      m = size(level%blocks)
      do index = 1, size(level%owner)
         if (level%owner(index) < 0 .or. level%owner(index) == rank) cycle
         if (.not. any(owners_around(level, level%grid%block_place(index), level%grid%block_field(index)) &
                       == rank)) cycle
         m = m + 1
         level%slot(index) = m
         level%ghost_index = [level%ghost_index, index]
      end do
      do b = 1, size(level%blocks)
         level%blocks(b)%shared = .false.
         do n = 1, 27
            associate (block => level%blocks(b), other => level%blocks(b)%place + directions(:, n))
               block%neighbour(n) = level%slot_at(other, block%field)
               if (block%neighbour(n) > size(level%blocks)) block%shared = .true.
            end associate
         end do
      end do
      do b = 1, size(level%blocks)
         do n = 1, 27
            level%blocks(b)%owns_shared_sum(n) = n /= 14 .and. b == first_between(level%blocks, &
                  level%blocks(b)%neighbour, n)
         end do
         if (level%grid%section%is_flat()) & ! the plane's nodes are those shared with the block below
            level%blocks(b)%owns_shared_sum = level%blocks(b)%owns_shared_sum .and. directions(2, :) == -1
      end do
      level%interior_first = [pack([(b, b=1, size(level%blocks))], .not. level%blocks%shared), &
                           pack([(b, b=1, size(level%blocks))], level%blocks%shared)]
      level%part_end = [0, count(.not. level%blocks%shared), size(level%blocks)]
      level%near%ranks = find_near_ranks(level, rank)
   end subroutine find_ghosts

   !> Owners of a field's blocks around a block position, in the 27 directions; -1 where there is none.
   pure function owners_around(level, place, field) result(owners)
      type(level_t), intent(in) :: level
      integer, intent(in) :: place(3), field
      integer :: owners(27), n
      do n = 1, 27
         owners(n) = level%owner_at(place + directions(:, n), field)
      end do
   end function owners_around

   !> Other ranks, rising, that own blocks of any field at the positions of this rank's blocks or next to
   !> them.
   pure function find_near_ranks(level, rank) result(near)
      type(level_t), intent(in) :: level
      integer, intent(in) :: rank
      integer, allocatable :: near(:)
      logical :: is_near(-1:max(rank, maxval(level%owner)))
      integer :: b, field, r
      is_near = .false.
      do b = 1, size(level%blocks)
         if (level%grid%fields == 1 .and. .not. level%blocks(b)%shared) cycle
         do field = 1, level%grid%fields
            is_near(owners_around(level, level%blocks(b)%place, field)) = .true.
         end do
      end do
      is_near([-1, rank]) = .false.
      near = pack([(r, r=0, ubound(is_near, 1))], is_near(0:))
   end function find_near_ranks

end module m_decomposition
