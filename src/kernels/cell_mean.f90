!> Means over the cells of the grid: contributions of a block's particles to the cells, and interpolation of
!> the sums over blocks back to particles (theory.md, eq. anti-locking). A cell is stored in a tile at the
!> index of its lowest node, or at an edge of levels where `standing` says: so nodal sums over blocks also sum
!> cells.
module m_cell_mean
   use m_kinds, only: wp, i4
   use m_constants, only: block_size
   use m_node_values, only: plane_row
   use m_field_table, only: layout_t
   use m_stencil, only: frame_t
   implicit none
   private
   public :: give_to_cells, take_means, cells_of, give_values, take_mean_values, pressure, set_trace

   integer, parameter :: values = 8 !< per entry of a tile; here 1 volume, m3, 2 volume times tr L, m3/s, 3
                                    !< volume times pressure, J
   integer, parameter :: width = block_size + 2 !< of a tile
   integer, parameter :: places = width**3
   integer, parameter :: chunk = 64             !< particles at once

contains

   !> The sums over a block's particles of volume, volume times tr L and volume times pressure, on its own
   !> tile.
   pure subroutine give_to_cells(count, bin, column, layout, frame, gradient, tile, standing)
      integer, intent(in) :: count
      integer(i4), intent(in), contiguous :: bin(:)
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      type(frame_t), intent(in) :: frame
      real(wp), intent(in), contiguous :: gradient(:, :) !< (:, 9), 1/s
      real(wp), intent(inout) :: tile(values, 0:places - 1)
      integer(i4), intent(in), optional :: standing(0:places - 1) !< as in a cell_list_t
      integer :: place(chunk), first, k, last, p, s
      if (layout%section%is_flat()) then ! one layer of cells
         do k = plane_row*width, places - 1, width**2
            tile(:, k:k + width - 1) = 0.0_wp
         end do
      else
         tile = 0.0_wp
      end if
      s = layout%stress
      do first = 1, count, chunk
         last = min(first + chunk - 1, count)
         call find_cells(bin(first:last), column(first:last, layout%position), &
                         column(first:last, layout%position + 1), &
                         column(first:last, layout%position + 2), frame, place, standing)
         do p = first, last
            associate (volume => column(p, layout%volume), cell => tile(:, place(p - first + 1)))
               cell(1) = cell(1) + volume
               cell(2) = cell(2) + volume*(gradient(p, 1) + gradient(p, 5) + gradient(p, 9))
               cell(3) = cell(3) + volume*pressure(column(p, s), column(p, s + 1), column(p, s + 2))
            end associate
         end do
      end do
   end subroutine give_to_cells

   !> Replace tr L of each particle by the mean of its cell. The pressure is not changed: the field
   !> `pressure_shift` gets the mean minus the pressure.
   pure subroutine take_means(count, bin, layout, frame, tile, column, gradient, standing)
      integer, intent(in) :: count
      integer(i4), intent(in), contiguous :: bin(:)
      type(layout_t), intent(in) :: layout
      type(frame_t), intent(in) :: frame
      real(wp), intent(in) :: tile(values, 0:places - 1) !< sums over all blocks
      real(wp), intent(inout), contiguous :: column(:, :)
      real(wp), intent(inout), contiguous :: gradient(:, :) !< (:, 9), 1/s
      integer(i4), intent(in), optional :: standing(0:places - 1) !< as in a cell_list_t
      real(wp) :: rate(chunk), mean(chunk)
      integer :: place(chunk), first, last, p, s
      s = layout%stress
      do first = 1, count, chunk
         last = min(first + chunk - 1, count)
         call find_cells(bin(first:last), column(first:last, layout%position), &
                         column(first:last, layout%position + 1), &
                         column(first:last, layout%position + 2), frame, place, standing)
         do p = 1, last - first + 1
            rate(p) = tile(2, place(p))/tile(1, place(p))
            mean(p) = tile(3, place(p))/tile(1, place(p))
         end do
         !$omp simd
         do p = first, last
            call set_trace(rate(p - first + 1), gradient(p, 1), gradient(p, 5), gradient(p, 9))
            column(p, layout%pressure_shift) = mean(p - first + 1) &
                                               - pressure(column(p, s), column(p, s + 1), column(p, s + 2))
         end do
      end do
   end subroutine take_means

   !> Tile indices of the cells of a block's particles, valid until these move.
   pure subroutine cells_of(count, bin, column, layout, frame, place, standing)
      integer, intent(in) :: count
      integer(i4), intent(in), contiguous :: bin(:)
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      type(frame_t), intent(in) :: frame
      integer, intent(inout), contiguous :: place(:)
      integer(i4), intent(in), optional :: standing(0:places - 1) !< as in a cell_list_t
      call find_cells(bin(:count), column(:count, layout%position), column(:count, layout%position + 1), &
                      column(:count, layout%position + 2), frame, place(:count), standing)
   end subroutine cells_of

   !> The sums over a block's particles of volume and of volume times a value, on its own tile.
   pure subroutine give_values(place, volume, value, rows, tile)
      integer, intent(in) :: place(:)                !< as from cells_of
      integer, intent(in) :: rows(2)                 !< first and last index along y in use
      real(wp), intent(in) :: volume(:), value(:)    !< m3; any unit
      real(wp), intent(inout) :: tile(values, 0:places - 1)
      integer :: k, p
      do k = 0, places - 1, width**2
         tile(:2, k + width*rows(1):k + width*rows(2) + width - 1) = 0.0_wp
      end do
      do p = 1, size(place)
         tile(1, place(p)) = tile(1, place(p)) + volume(p)
         tile(2, place(p)) = tile(2, place(p)) + volume(p)*value(p)
      end do
   end subroutine give_values

   !> Replace each value by the mean of its cell.
   pure subroutine take_mean_values(place, tile, value)
      integer, intent(in) :: place(:)
      real(wp), intent(in) :: tile(values, 0:places - 1) !< sums over all blocks
      real(wp), intent(inout) :: value(:)
      integer :: p
      do p = 1, size(place)
         value(p) = tile(2, place(p))/tile(1, place(p))
      end do
   end subroutine take_mean_values

   pure elemental real(wp) function pressure(xx, yy, zz)
      real(wp), intent(in) :: xx, yy, zz
      pressure = -(xx + yy + zz)/3.0_wp
   end function pressure

   pure elemental subroutine set_trace(trace, xx, yy, zz)
      real(wp), intent(in) :: trace
      real(wp), intent(inout) :: xx, yy, zz
      real(wp) :: change
      change = (trace - (xx + yy + zz))/3.0_wp
      xx = xx + change
      yy = yy + change
      zz = zz + change
   end subroutine set_trace

   !> Tile indices of the cells of a few particles.
   pure subroutine find_cells(bin, x, y, z, frame, place, standing)
      integer(i4), intent(in), contiguous :: bin(:)
      real(wp), intent(in), contiguous :: x(:), y(:), z(:)
      type(frame_t), intent(in) :: frame
      integer, intent(out), contiguous :: place(:)
      integer(i4), intent(in), optional :: standing(0:places - 1)
      integer :: p
      !$omp simd
      do p = 1, size(bin)
         place(p) = cell_place(bin(p) - 1, (x(p) - frame%origin(1))*frame%per_cell, &
                               (y(p) - frame%origin(2))*frame%per_cell, &
                               (z(p) - frame%origin(3))*frame%per_cell)
      end do
      if (.not. present(standing)) return
      do p = 1, size(bin)
         if (standing(place(p)) < 0) place(p) = nearest_cell(bin(p) - 1, ([x(p), y(p), z(p)] &
               - frame%origin)*frame%per_cell, standing, place(p))
         if (standing(place(p)) >= 0) place(p) = standing(place(p))
      end do
   end subroutine find_cells

   !> Of the eight cells around the node of a particle's bin, the nearest in which its level has particles;
   !> its own cell if there is none.
   pure integer function nearest_cell(bin, x, standing, own) result(place)
      integer(i4), intent(in) :: bin !< from 0
      real(wp), intent(in) :: x(3)   !< position in cells, from the block's first node
      integer(i4), intent(in) :: standing(0:places - 1)
      integer, intent(in) :: own     !< tile index of the cell that contains it
      real(wp) :: off(3), least
      integer :: node(3), side(3), n, tried
      node = [iand(bin, block_size - 1), iand(bin/block_size, block_size - 1), bin/block_size**2]
      place = own
      least = huge(1.0_wp)
      do n = 0, 7
         side = [ibits(n, 0, 1), ibits(n, 1, 1), ibits(n, 2, 1)]
         tried = node(1) + side(1) + width*(node(2) + side(2) + width*(node(3) + side(3)))
         off = merge(0.0_wp, x - node, (x >= node) .eqv. (side == 1))
         if (standing(tried) < 0 .or. .not. sum(off**2) < least) cycle
         least = sum(off**2)
         place = tried
      end do
   end function nearest_cell

   !> One of the eight cells around the node of the particle's bin. A bin from before the step's motion is
   !> enough: a particle that has just left its bin is still in one of these cells.
   pure elemental integer function cell_place(bin, x, y, z) result(place)
      integer(i4), intent(in) :: bin    !< from 0
      real(wp), intent(in) :: x, y, z   !< position in cells, from the block's first node
      integer :: i, j, k
      i = iand(bin, block_size - 1)
      j = iand(bin/block_size, block_size - 1)
      k = bin/block_size**2
      place = i + merge(1, 0, x >= i) + width*(j + merge(1, 0, y >= j) + width*(k + merge(1, 0, z >= k)))
   end function cell_place

end module m_cell_mean
