!> The nodes of a rank's tiles that another rank needs, as runs of values in the pool of tiles.
module m_halo_runs
   use m_kinds, only: i8
   use m_node_values, only: node_values, tile_last
   use m_block, only: directions
   use m_level, only: level_t
   implicit none
   private
   public :: runs_t, find_neighbours, find_shared

   !> Runs of consecutive values in a pool of tiles: the contents of a message.
   type :: runs_t
      integer(i8), allocatable :: before(:) !< values of the pool before each run
      integer, allocatable :: length(:)     !< values in each run
      integer(i8) :: values = 0             !< in all runs
   end type runs_t

   integer, parameter :: width = tile_last + 1 !< of a tile

contains

   !> The ranks, rising, that own blocks next to those here: the owners of the level's ghosts. `ranks` is the
   !> number of all ranks.
   pure function find_neighbours(level, ranks) result(neighbours)
      type(level_t), intent(in) :: level
      integer, intent(in) :: ranks
      integer, allocatable :: neighbours(:)
      logical :: neighbour(0:ranks - 1)
      integer :: m, r
      neighbour = .false.
      do m = 1, size(level%ghost_index)
         neighbour(level%owner(level%ghost_index(m))) = .true.
      end do
      neighbours = pack([(r, r=0, ranks - 1)], neighbour)
   end function find_neighbours

   !> The runs of all tiles of rank `from` that rank `to` needs; in the same order on both ranks.
   subroutine find_shared(level, from, to, runs)
      type(level_t), intent(in) :: level
      integer, intent(in) :: from, to
      type(runs_t), intent(out) :: runs
      logical :: shared(0:tile_last, 0:tile_last, 0:tile_last)
      integer :: count, index, slot
      allocate (runs%length(2*width**2), runs%before(2*width**2))
      count = 0
      do index = 1, size(level%owner)
         if (level%owner(index) /= from) cycle
         slot = level%slot(index)
         if (slot == 0) cycle
         shared = shared_nodes(level, level%grid%block_place(index), level%grid%block_field(index), to)
         if (any(shared)) call add_runs(shared, slot, count, runs)
      end do
      runs%length = runs%length(:count)
      runs%before = runs%before(:count)
      runs%values = sum(int(runs%length, i8))
   end subroutine find_shared

   !> The nodes of a block's tile that blocks of rank `to` also have.
   pure function shared_nodes(level, place, field, to) result(shared)
      type(level_t), intent(in) :: level
      integer, intent(in) :: place(3), field, to
      logical :: shared(0:tile_last, 0:tile_last, 0:tile_last)
      integer :: direction(3), n
      shared = .false.
      do n = 1, 27
         direction = directions(:, n)
         if (n == 14 .or. level%owner_at(place + direction, field) /= to) cycle
         associate (a => overlap_first(direction), b => overlap_last(direction))
            shared(a(1):b(1), a(2):b(2), a(3):b(3)) = .true.
         end associate
      end do
   end function shared_nodes

   !> Append the runs of the marked nodes of one slot to the first `count`. Rows along x have at most two,
   !> which begin or end at a side.
   subroutine add_runs(shared, slot, count, runs)
      logical, intent(in) :: shared(0:tile_last, 0:tile_last, 0:tile_last)
      integer, intent(in) :: slot
      integer, intent(inout) :: count
      type(runs_t), intent(inout) :: runs
      integer(i8) :: before, behind
      integer :: i, j, k
      if (size(runs%length) < count + 2*width**2) then
         runs%length = [runs%length, spread(0, 1, count + 2*width**2)]
         runs%before = [runs%before, spread(0_i8, 1, count + 2*width**2)]
      end if
      behind = -1
      do k = 0, tile_last
         do j = 0, tile_last
            if (.not. any(shared(:, j, k))) cycle
            do i = 0, tile_last
               if (.not. shared(i, j, k)) cycle
               before = node_values*(i + width*(j + width*(k + width*(slot - 1_i8))))
               if (before /= behind) then
                  count = count + 1
                  runs%before(count) = before
                  runs%length(count) = 0
               end if
               runs%length(count) = runs%length(count) + node_values
               behind = before + node_values
            end do
         end do
      end do
   end subroutine add_runs

   !> First and last tile index, along each axis, that a block shares with its neighbour in a direction.
   pure elemental integer function overlap_first(direction)
      integer, intent(in) :: direction
      overlap_first = merge(tile_last - 1, 0, direction == 1)
   end function overlap_first

   pure elemental integer function overlap_last(direction)
      integer, intent(in) :: direction
      overlap_last = merge(1, tile_last, direction == -1)
   end function overlap_last

end module m_halo_runs
