!> The cells of anti-locking at an edge of levels (theory.md, Cells of anti-locking at an edge): outside the
!> region those of the coarser level, for the finer level's particles too; inside, the finer level's, of which
!> those that touch the edge are joined along it.
module m_joined_cells
   use m_kinds, only: i4
   use m_constants, only: block_size
   use m_node_values, only: tile_last
   use m_region, only: region_t
   use m_level, only: level_t
   implicit none
   private
   public :: join_cells

   integer, parameter :: width = tile_last + 1 !< of a tile

contains

   !> Set the tile index of the cells of all blocks of a level (block%cells%standing): a single cell has the
   !> index of its lowest node, a joined one that of the middle node of its coarser cell along the axes of
   !> joining. So indices are unique, and within the tiles of all blocks concerned. -1: the level has no
   !> particles there, except those about to leave it. Not allocated where all cells are single.
   subroutine join_cells(level)
      type(level_t), intent(inout) :: level
      integer :: b
      do b = 1, size(level%blocks)
         associate (block => level%blocks(b))
            if (allocated(block%cells%standing)) deallocate (block%cells%standing)
            ! the coarser cells that contain its cells, and those around them
            if (level%region%has_all(block_size/2*block%place - 2, block_size/2*(block%place + 1))) cycle
            allocate (block%cells%standing(0:width**3 - 1), source=-1_i4)
            call set_standing(level%region, level%grid%rows, block%place, block%cells%standing)
         end associate
      end do
   end subroutine join_cells

   !> The same of one block.
   pure subroutine set_standing(region, rows, place, standing)
      type(region_t), intent(in) :: region
      integer, intent(in) :: rows(2)  !< first and last index along y in use; one for a section
      integer, intent(in) :: place(3) !< of the block
      integer(i4), intent(inout) :: standing(0:)
      integer :: at(3), cell(3), coarse(3), i, j, k
      logical :: along(3)
      do k = 0, tile_last - 1
         do j = rows(1), min(rows(2), tile_last - 1)
            do i = 0, tile_last - 1
               at = [i, j, k]
               cell = block_size*place + at - 1
               coarse = (cell - modulo(cell, 2))/2
               if (.not. region%has_some(coarse - 1, coarse + 1)) cycle
               along = joined(region, coarse, cell - 2*coarse)
               if (rows(1) == rows(2)) along(2) = .false.
               at = merge(at + 2*coarse + 1 - cell, at, along)
               standing(i + width*(j + width*k)) = int(at(1) + width*(at(2) + width*at(3)), i4)
            end do
         end do
      end do
   end subroutine set_standing

   !> Axes along which a cell is joined with the other half of its coarser cell.
   pure function joined(region, coarse, half) result(along)
      type(region_t), intent(in) :: region
      integer, intent(in) :: coarse(3), half(3) !< the coarser cell, and the half of it along each axis: 0, 1
      logical :: along(3), outside(-1:1, 3)     !< the next coarser cell along each axis is outside
      integer :: axis, side, to(3)
      along = .true.
      if (.not. region%has_all(coarse, coarse)) return
      do axis = 1, 3
         do side = -1, 1
            to = coarse
            to(axis) = coarse(axis) + side
            outside(side, axis) = .not. region%has_all(to, to)
         end do
      end do
      if (count(any(outside, dim=1)) >= 2) return ! at an edge or a corner of the region
      if (.not. any(outside)) then
         along = touches_line(region, coarse) ! where the region covers three of four sides
         return
      end if
      axis = findloc(any(outside, dim=1), .true., dim=1)
      along = outside(2*half(axis) - 1, axis) ! the half at the edge
      along(axis) = .false.
   end function joined

   !> True when a coarser cell that no edge touches on a face touches one along one of its twelve sides.
   pure logical function touches_line(region, coarse)
      type(region_t), intent(in) :: region
      integer, intent(in) :: coarse(3)
      integer :: axis, reach(3)
      touches_line = .false.
      do axis = 1, 3
         reach = 1
         reach(axis) = 0
         touches_line = touches_line .or. .not. region%has_all(coarse - reach, coarse + reach)
      end do
   end function touches_line

end module m_joined_cells
