!> Weights of particles on the 27 nodes around their bins, in chunks of the traversed particles; position of a
!> block.
module m_stencil
   use m_kinds, only: wp, i4
   use m_constants, only: block_size, short_of
   use m_field_table, only: layout_t
   use m_cell_list, only: cell_list_t
   use m_section_weights, only: set_plane, add_ring_slopes
   implicit none
   private
   public :: stencil_t, frame_t, set_stencil, set_section_axes, list_chunk, fetch, bin_place, set_places, &
             hat_weights, gimp_weights

   integer, parameter, public :: batch = 8    !< particles in one vector
   integer, parameter, public :: chunk = 64 !< particles processed together: their weights stay in the
                                            !< first-level cache

   !> Position of a block and the size of its cells.
   type :: frame_t
      real(wp) :: origin(3) !< position of the block's first node, m
      real(wp) :: cell      !< m
      real(wp) :: per_cell  !< 1/m
   end type frame_t

   !> Up to `chunk` consecutive particles, of any bins: weights (1) and gradients (1/m), by particle, node
   !> (-1, 0, 1) and axis; and the offset from the nearest node (cells). Vectors may read up to `batch` - 1
   !> entries beyond the last, which hold old values: kernels keep their stencils from call to call
   !> (Makefile). There are no default values, as they would be set again in every call.
   type :: stencil_t
      real(wp) :: weight(chunk + batch, -1:1, 3)
      real(wp) :: slope(chunk + batch, -1:1, 3)
      real(wp) :: offset(chunk + batch, 3)
      integer :: count
      integer(i4) :: member(chunk)            !< number of the particle in the block
      logical :: in_order                     !< the particles are consecutive in memory too
      integer :: runs                         !< runs of particles of one bin
      integer :: run_place(3, chunk)     !< indices of their bins in the block, from 0: also the lowest of the
                                         !< 27 nodes in the tile
      integer(i4) :: run_first(chunk + 1)     !< first particle of each run in the chunk; run r ends before
                                              !< run_first(r + 1)
   end type stencil_t

contains

   !> Set the stencil for the traversed particles from the `first` on.
   pure subroutine set_stencil(stencil, cells, first, column, layout, frame)
      type(stencil_t), intent(inout) :: stencil
      type(cell_list_t), intent(in) :: cells
      integer, intent(in) :: first
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      type(frame_t), intent(in) :: frame
      real(wp) :: place(chunk), half(chunk), node(chunk, 3), per_half
      integer :: axis, from, to
      call list_chunk(stencil, cells, first, node)
      if (layout%section%is_flat()) then
         call set_section(stencil, column, layout, frame, node)
         return
      end if
      from = stencil%member(1)
      to = from + stencil%count - 1
      if (.not. layout%half_sizes) call fetch(stencil, column(:, layout%half_size), half)
      per_half = merge(1.0_wp, short_of, layout%half_sizes)*frame%per_cell
      do axis = 1, 3
         if (layout%half_sizes) then
            call fetch(stencil, column(:, layout%half_size + axis - 1), half)
            ! a longer one will be split
            half(:stencil%count) = min(short_of*half(:stencil%count), 0.5_wp*frame%cell)
         end if
         if (stencil%in_order) then
            call set_axis(stencil, axis, column(from:to, layout%position + axis - 1), half, per_half, &
                          node(:, axis), frame)
         else
            call fetch(stencil, column(:, layout%position + axis - 1), place)
            call set_axis(stencil, axis, place(:stencil%count), half, per_half, node(:, axis), frame)
         end if
      end do
   end subroutine set_stencil

   !> The same for a section.
   pure subroutine set_section(stencil, column, layout, frame, node)
      type(stencil_t), intent(inout) :: stencil
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      type(frame_t), intent(in) :: frame
      real(wp), intent(in) :: node(chunk, 3)
      real(wp) :: radius(chunk)
      call set_section_axes(stencil, column, layout, frame, node)
      stencil%offset(:, 2) = 0.0_wp
      if (layout%section%is_round()) then
         call fetch(stencil, column(:, layout%position), radius)
         call set_plane(stencil%count, stencil%weight(:, :, 2), stencil%slope(:, :, 2), radius)
      else
         call set_plane(stencil%count, stencil%weight(:, :, 2), stencil%slope(:, :, 2))
      end if
   end subroutine set_section

   !> For a section, along the axes of its plane.
   pure subroutine set_section_axes(stencil, column, layout, frame, node)
      type(stencil_t), intent(inout) :: stencil
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      type(frame_t), intent(in) :: frame
      real(wp), intent(in) :: node(chunk, 3)
      real(wp) :: place(chunk), half(chunk)
      integer :: axis, n
      n = stencil%count
      do axis = 1, 3, 2
         call fetch(stencil, column(:, layout%half_size + merge(axis - 1, 0, layout%half_sizes)), half)
         half(:n) = short_of*half(:n)
         if (layout%half_sizes) half(:n) = min(half(:n), 0.5_wp*frame%cell)
         call fetch(stencil, column(:, layout%position + axis - 1), place)
         if (axis == 1 .and. layout%section%is_round()) half(:n) = min(half(:n), place(:n)) ! not beyond the
                                                                                            ! axis
         call set_axis(stencil, axis, place(:n), half, frame%per_cell, node(:, axis), frame)
         if (axis == 1 .and. layout%section%is_round()) &
            call add_ring_slopes(n, stencil%offset(:, 1), half, place, frame%per_cell, stencil%slope(:, :, 1))
      end do
   end subroutine set_section_axes

   !> Weights, gradients and offsets along one axis.
   pure subroutine set_axis(stencil, axis, place, half, per_half, node, frame)
      type(stencil_t), intent(inout) :: stencil
      integer, intent(in) :: axis
      real(wp), intent(in), contiguous :: place(:) !< of the chunk's particles along the axis, m
      real(wp), intent(in) :: half(chunk)          !< their half sizes, m
      real(wp), intent(in) :: per_half             !< 1/cell, or a hair less to shorten them, 1/m
      real(wp), intent(in) :: node(chunk) !< position of the nodes of their bins, in cells
      type(frame_t), intent(in) :: frame
      real(wp) :: offset
      integer :: p
      !$omp simd private(offset)
      do p = 1, stencil%count
         offset = (place(p) - frame%origin(axis))*frame%per_cell - node(p)
         call gimp_weights(offset, half(p)*per_half, stencil%weight(p, -1, axis), &
                           stencil%weight(p, 0, axis), &
                           stencil%weight(p, 1, axis), stencil%slope(p, -1, axis), stencil%slope(p, 1, axis))
         stencil%slope(p, -1, axis) = stencil%slope(p, -1, axis)*frame%per_cell
         stencil%slope(p, 1, axis) = stencil%slope(p, 1, axis)*frame%per_cell
         stencil%slope(p, 0, axis) = -(stencil%slope(p, -1, axis) + stencil%slope(p, 1, axis))
         stencil%offset(p, axis) = offset
      end do
   end subroutine set_axis

   !> List the traversed particles from the `first` on, their runs, and the node of each one's bin; no
   !> weights.
   pure subroutine list_chunk(stencil, cells, first, node)
      type(stencil_t), intent(inout) :: stencil
      type(cell_list_t), intent(in) :: cells
      integer, intent(in) :: first
      real(wp), intent(inout) :: node(chunk, 3)
      integer(i4) :: bin(chunk)
      integer :: before, p, r
      stencil%count = min(chunk, cells%count - first + 1)
      stencil%in_order = .not. cells%chosen
      if (stencil%in_order) then
         before = cells%start + first - 2
         do p = 1, stencil%count
            stencil%member(p) = before + p
            bin(p) = cells%bin(before + p)
         end do
      else
         do p = 1, stencil%count
            stencil%member(p) = cells%order(first + p - 1)
            bin(p) = cells%bin(stencil%member(p))
         end do
      end if
      !$omp simd
      do p = 1, stencil%count
         node(p, 1) = iand(bin(p) - 1, block_size - 1)
         node(p, 2) = iand((bin(p) - 1)/block_size, block_size - 1)
         node(p, 3) = (bin(p) - 1)/block_size**2
      end do
      r = 1
      stencil%run_first(1) = 1
      do p = 2, stencil%count ! without a branch: runs are of any length
         stencil%run_first(r + 1) = p
         r = r + merge(1, 0, bin(p) /= bin(p - 1))
      end do
      stencil%runs = r
      stencil%run_first(r + 1) = stencil%count + 1
      do r = 1, stencil%runs
         stencil%run_place(:, r) = bin_place(bin(stencil%run_first(r)))
      end do
   end subroutine list_chunk

   !> For each particle of the chunk the lowest of the 27 nodes in the block's tile.
   pure subroutine set_places(stencil, place)
      type(stencil_t), intent(in) :: stencil
      integer, intent(inout) :: place(3, chunk)
      integer :: m, r
      do r = 1, stencil%runs
         do m = stencil%run_first(r), stencil%run_first(r + 1) - 1
            place(:, m) = stencil%run_place(:, r)
         end do
      end do
   end subroutine set_places

   !> One column of the chunk's particles.
   pure subroutine fetch(stencil, column, values)
      type(stencil_t), intent(in) :: stencil
      real(wp), intent(in), contiguous :: column(:)
      real(wp), intent(inout) :: values(chunk)
      integer :: before, p
      if (stencil%in_order) then
         before = stencil%member(1) - 1
         do p = 1, stencil%count
            values(p) = column(before + p)
         end do
      else
         do p = 1, stencil%count
            values(p) = column(stencil%member(p))
         end do
      end if
   end subroutine fetch

   !> Index of a bin (from 1) in its block, from 0: also the lowest of the 27 nodes in the block's tile.
   pure function bin_place(bin) result(place)
      integer, intent(in) :: bin
      integer :: place(3)
      place = [iand(bin - 1, block_size - 1), iand((bin - 1)/block_size, block_size - 1), &
              (bin - 1)/block_size**2]
   end function bin_place

   !> The cell around a point and the hat functions of its nodes there. The point belongs to a particle of the
   !> bin around `node`, and is moved into the cells around that node, however far the particle has been
   !> stretched.
   pure subroutine hat_weights(node, place, corner, weight)
      integer, intent(in) :: node(3)           !< node of the bin, in its block, from 0
      real(wp), intent(in) :: place(3)         !< of the point, in cells from the block's first node
      integer, intent(out) :: corner(3)        !< lowest node of the cell, in the block, from 0
      real(wp), intent(out) :: weight(0:1, 3)  !< by axis
      real(wp) :: offset(3)
      offset = min(max(place - node, -1.0_wp), 1.0_wp)
      corner = node - merge(1, 0, offset < 0.0_wp)
      weight(1, :) = offset - (corner - node)
      weight(0, :) = 1.0_wp - weight(1, :)
   end subroutine hat_weights

   !> Weights and gradients on the nodes at -1, 0, +1 cells from the nearest node, without branches.
   !> Bardenhagen and Kober (2004), integrated for a hat function and a particle of half size not above half a
   !> cell.
   pure elemental subroutine gimp_weights(offset, half_size, lower, middle, upper, slope_lower, slope_upper)
      real(wp), intent(in) :: offset    !< position relative to the nearest node, in cells
      real(wp), intent(in) :: half_size !< half the edge, in cells, above 0, |offset| + half_size <= 1
      real(wp), intent(out) :: lower, middle, upper     !< weights
      real(wp), intent(out) :: slope_lower, slope_upper !< d weight / d position, 1/cell; the middle one is
                                                        !< minus their sum
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

end module m_stencil
