!> Weights of particles on the 27 nodes around their bins, in chunks of a block's list, and where a block's arrays stand.
module m_stencil
   use m_kinds, only: wp, i4
   use m_constants, only: block_size
   use m_field_table, only: layout_t
   use m_cell_list, only: cell_list_t
   implicit none
   private
   public :: stencil_t, frame_t, set_stencil, bin_place, gimp_weights

   integer, parameter, public :: batch = 8    !< particles in one vector
   integer, parameter, public :: chunk = 32   !< particles of the list handled together: their weights stay in the first-level cache

   !> Where a block stands and how large its cells are.
   type :: frame_t
      real(wp) :: origin(3) !< place of the block's first node, m
      real(wp) :: cell      !< m
      real(wp) :: per_cell  !< 1/m
   end type frame_t

   !> Up to `chunk` particles that follow each other in a block's list, whatever their bins: weights (1) and slopes (1/m), by
   !> particle, node (-1, 0, 1) and axis; and the offset from the nearest node (m). Vectors may read `batch` - 1 beyond the last.
   type :: stencil_t
      real(wp) :: weight(chunk + batch, -1:1, 3) = 0.0_wp
      real(wp) :: slope(chunk + batch, -1:1, 3) = 0.0_wp
      real(wp) :: offset(chunk + batch, 3) = 0.0_wp
      integer :: count = 0
      integer(i4) :: member(chunk) = 0        !< number of the particle in the block
      logical :: in_order = .false.           !< the particles follow each other in memory too
      integer :: runs = 0                     !< runs of particles of one bin
      integer(i4) :: run_bin(chunk) = 0
      integer(i4) :: run_first(chunk + 1) = 1 !< of the chunk's particles; run r ends before run_first(r + 1)
   end type stencil_t

contains

   !> Fill the stencil with the particles from place `first` of the list on.
   pure subroutine set_stencil(stencil, cells, first, column, layout, frame)
      type(stencil_t), intent(inout) :: stencil
      type(cell_list_t), intent(in) :: cells
      integer, intent(in) :: first
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      type(frame_t), intent(in) :: frame
      real(wp) :: place(chunk, 3), half(chunk)
      integer(i4) :: bin(chunk), node(chunk, 3)
      integer :: axis, begin, n, p, padded
      n = min(chunk, cells%first(size(cells%first)) - first)
      padded = batch*((n + batch - 1)/batch)
      stencil%count = n
      stencil%member(:n) = cells%order(first:first + n - 1)
      begin = stencil%member(1)
      stencil%in_order = .true.
      do p = 1, n
         stencil%in_order = stencil%in_order .and. stencil%member(p) == begin + p - 1
      end do
      if (stencil%in_order) then
         half(:n) = column(begin:begin + n - 1, layout%half_size)
         do axis = 1, 3
            place(:n, axis) = column(begin:begin + n - 1, layout%position + axis - 1)
         end do
      else
         do p = 1, n
            half(p) = column(stencil%member(p), layout%half_size)
            place(p, :) = column(stencil%member(p), layout%position:layout%position + 2)
         end do
      end if
      half(n + 1:padded) = 0.25_wp*frame%cell
      call find_runs(stencil, cells, first)
      do p = 1, n
         bin(p) = cells%bin(stencil%member(p)) - 1
      end do
      bin(n + 1:padded) = 0
      !$omp simd
      do p = 1, padded
         node(p, 1) = iand(bin(p), block_size - 1)
         node(p, 2) = iand(bin(p)/block_size, block_size - 1)
         node(p, 3) = bin(p)/block_size**2
      end do
      do axis = 1, 3
         place(n + 1:padded, axis) = frame%origin(axis)
         !$omp simd
         do p = 1, padded
            place(p, axis) = (place(p, axis) - frame%origin(axis))*frame%per_cell - real(node(p, axis), wp)
            call gimp_weights(place(p, axis), half(p)*frame%per_cell, stencil%weight(p, -1, axis), stencil%weight(p, 0, axis), &
                              stencil%weight(p, 1, axis), stencil%slope(p, -1, axis), stencil%slope(p, 1, axis))
            stencil%slope(p, -1, axis) = stencil%slope(p, -1, axis)*frame%per_cell
            stencil%slope(p, 1, axis) = stencil%slope(p, 1, axis)*frame%per_cell
            stencil%slope(p, 0, axis) = -(stencil%slope(p, -1, axis) + stencil%slope(p, 1, axis))
            stencil%offset(p, axis) = place(p, axis)*frame%cell
         end do
      end do
   end subroutine set_stencil

   !> Weights and slopes on the nodes at -1, 0, +1 cells from the nearest node, without branches.
   !> Bardenhagen and Kober (2004), integrated for a hat function and a particle of half size not above half a cell.
   pure elemental subroutine gimp_weights(offset, half_size, lower, middle, upper, slope_lower, slope_upper)
      real(wp), intent(in) :: offset    !< place relative to the nearest node, in cells, |offset| <= 1/2
      real(wp), intent(in) :: half_size !< half the particle's edge, in cells, above 0 and at most 1/2
      real(wp), intent(out) :: lower, middle, upper     !< weights
      real(wp), intent(out) :: slope_lower, slope_upper !< d weight / d place, 1/cell; the middle one is minus their sum
      real(wp) :: reach, overlap, per_edge
      per_edge = 0.5_wp/half_size
      reach = max(0.0_wp, half_size - offset)
      overlap = min(reach, 2.0_wp*half_size)
      lower = 0.5_wp*per_edge*overlap*overlap + (reach - overlap)
      slope_lower = -overlap*per_edge
      reach = max(0.0_wp, half_size + offset)
      overlap = min(reach, 2.0_wp*half_size)
      upper = 0.5_wp*per_edge*overlap*overlap + (reach - overlap)
      slope_upper = overlap*per_edge
      middle = 1.0_wp - lower - upper
   end subroutine gimp_weights

   !> The runs of particles of one bin.
   pure subroutine find_runs(stencil, cells, first)
      type(stencil_t), intent(inout) :: stencil
      type(cell_list_t), intent(in) :: cells
      integer, intent(in) :: first
      integer :: p
      stencil%runs = 0
      p = 1
      do while (p <= stencil%count)
         stencil%runs = stencil%runs + 1
         stencil%run_first(stencil%runs) = p
         stencil%run_bin(stencil%runs) = cells%bin(stencil%member(p))
         p = min(stencil%count, cells%first(stencil%run_bin(stencil%runs) + 1) - first) + 1
      end do
      stencil%run_first(stencil%runs + 1) = p
   end subroutine find_runs

   !> Place of a bin (from 1) in its block, from 0: also the lowest node of its 27 in the block's tile.
   pure function bin_place(bin) result(place)
      integer(i4), intent(in) :: bin
      integer :: place(3)
      place = [iand(bin - 1, block_size - 1), iand((bin - 1)/block_size, block_size - 1), (bin - 1)/block_size**2]
   end function bin_place

end module m_stencil
