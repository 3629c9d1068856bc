!> Weights of up to eight particles of one bin on the 27 nodes around it, and where a block's arrays stand.
module m_stencil
   use m_kinds, only: wp, i4
   use m_gimp_weight, only: gimp_weights
   implicit none
   private
   public :: stencil_t, frame_t, set_stencil

   integer, parameter, public :: batch = 8 !< particles handled together

   !> Where a block stands and how large its cells are.
   type :: frame_t
      real(wp) :: origin(3) !< place of the block's first node, m
      real(wp) :: cell      !< m
      real(wp) :: per_cell  !< 1/m
   end type frame_t

   !> Weights (1) and slopes (1/m), by particle, node (-1, 0, 1) and axis; and the offset from the nearest node (m).
   type :: stencil_t
      real(wp) :: weight(batch, -1:1, 3)
      real(wp) :: slope(batch, -1:1, 3)
      real(wp) :: offset(batch, 3)
   end type stencil_t

contains

   !> Fill the stencil of the particles listed, all of the bin (i,j,k), counted from 0.
   pure subroutine set_stencil(stencil, members, position, half_size, frame, bin)
      type(stencil_t), intent(inout) :: stencil
      integer(i4), intent(in) :: members(:)                 !< at most `batch` particles
      real(wp), intent(in), contiguous :: position(:, :)    !< (:, 3), m
      real(wp), intent(in), contiguous :: half_size(:)      !< m
      type(frame_t), intent(in) :: frame
      integer, intent(in) :: bin(3)
      real(wp) :: offset(batch), half(batch), node
      integer :: axis, n, p
      n = size(members)
      half = 0.25_wp
      do p = 1, n
         half(p) = half_size(members(p))*frame%per_cell
      end do
      offset = 0.0_wp
      do axis = 1, 3
         node = real(bin(axis), wp)
         do p = 1, n
            offset(p) = (position(members(p), axis) - frame%origin(axis))*frame%per_cell - node
         end do
         !$omp simd
         do p = 1, batch
            call gimp_weights(offset(p), half(p), stencil%weight(p, -1, axis), stencil%weight(p, 0, axis), &
                              stencil%weight(p, 1, axis), stencil%slope(p, -1, axis), stencil%slope(p, 1, axis))
            stencil%slope(p, -1, axis) = stencil%slope(p, -1, axis)*frame%per_cell
            stencil%slope(p, 1, axis) = stencil%slope(p, 1, axis)*frame%per_cell
            stencil%slope(p, 0, axis) = -(stencil%slope(p, -1, axis) + stencil%slope(p, 1, axis))
            stencil%offset(p, axis) = offset(p)*frame%cell
         end do
      end do
   end subroutine set_stencil

end module m_stencil
