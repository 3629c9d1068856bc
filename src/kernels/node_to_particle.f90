!> Particles take velocity, acceleration and velocity gradient from their nodes (theory.md, eq. to-particles).
module m_node_to_particle
   use m_kinds, only: wp, i4
   use m_constants, only: block_size
   use m_field_table, only: layout_t
   use m_cell_list, only: cell_list_t
   use m_stencil, only: stencil_t, frame_t, batch, set_stencil
   implicit none
   private
   public :: scatter_to_particles, motion_t

   integer, parameter :: lanes = 8 !< values a node: mass, velocity (3), acceleration (3), spare

   !> How the particles move: x += dt v_grid, v = flip (v + dt a) + (1 - flip) v_grid.
   type :: motion_t
      real(wp) :: time_step     !< s; with 0 and flip 1 only the velocity gradient is taken
      real(wp) :: flip_fraction
      integer :: position       !< first column of where the new position goes
   end type motion_t

contains

   !> Move a block's particles with its node tile and store their velocity gradients, d v_i / d x_j at 3 (j-1) + i.
   pure subroutine scatter_to_particles(cells, tile, layout, frame, motion, column, gradient)
      type(cell_list_t), intent(in) :: cells
      real(wp), intent(in) :: tile(lanes, 0:block_size + 1, 0:block_size + 1, 0:block_size + 1)
      type(layout_t), intent(in) :: layout
      type(frame_t), intent(in) :: frame
      type(motion_t), intent(in) :: motion
      real(wp), intent(inout), contiguous :: column(:, :)
      real(wp), intent(inout), contiguous :: gradient(:, :) !< (:, 9), 1/s
      type(stencil_t) :: stencil
      integer :: i, j, k, bin, first, last
      bin = 0
      do k = 0, block_size - 1
         do j = 0, block_size - 1
            do i = 0, block_size - 1
               bin = bin + 1
               do first = cells%first(bin), cells%first(bin + 1) - 1, batch
                  last = min(first + batch, cells%first(bin + 1)) - 1
                  call set_stencil(stencil, cells%order(first:last), column(:, layout%position:layout%position + 2), &
                                   column(:, layout%half_size), frame, [i, j, k])
                  call take(cells%order(first:last), stencil, tile(:, i:i + 2, j:j + 2, k:k + 2), layout, motion, column, gradient)
               end do
            end do
         end do
      end do
   end subroutine scatter_to_particles

   !> One bin: lane = node quantity, so that a bin with one particle costs no more a particle than a full one.
   pure subroutine take(members, stencil, nodes, layout, motion, column, gradient)
      integer(i4), intent(in) :: members(:)
      type(stencil_t), intent(in) :: stencil
      real(wp), intent(in) :: nodes(lanes, -1:1, -1:1, -1:1)
      type(layout_t), intent(in) :: layout
      type(motion_t), intent(in) :: motion
      real(wp), intent(inout), contiguous :: column(:, :), gradient(:, :)
      real(wp), dimension(lanes) :: value, slope_x, slope_y, slope_z, even, odd
      real(wp) :: wyz, syz, wsz
      integer :: axis, j, k, m, p, q
      do m = 1, size(members)
         value = 0.0_wp
         slope_x = 0.0_wp
         slope_y = 0.0_wp
         slope_z = 0.0_wp
         do k = -1, 1
            do j = -1, 1
               wyz = stencil%weight(m, j, 2)*stencil%weight(m, k, 3)
               syz = stencil%slope(m, j, 2)*stencil%weight(m, k, 3)
               wsz = stencil%weight(m, j, 2)*stencil%slope(m, k, 3)
               !$omp simd
               do q = 1, lanes
                  even(q) = stencil%weight(m, -1, 1)*nodes(q, -1, j, k) + stencil%weight(m, 0, 1)*nodes(q, 0, j, k) &
                            + stencil%weight(m, 1, 1)*nodes(q, 1, j, k)
                  odd(q) = stencil%slope(m, -1, 1)*nodes(q, -1, j, k) + stencil%slope(m, 0, 1)*nodes(q, 0, j, k) &
                           + stencil%slope(m, 1, 1)*nodes(q, 1, j, k)
                  value(q) = value(q) + wyz*even(q)
                  slope_x(q) = slope_x(q) + wyz*odd(q)
                  slope_y(q) = slope_y(q) + syz*even(q)
                  slope_z(q) = slope_z(q) + wsz*even(q)
               end do
            end do
         end do
         p = members(m)
         do axis = 0, 2
            column(p, motion%position + axis) = column(p, layout%position + axis) + motion%time_step*value(2 + axis)
            column(p, layout%velocity + axis) = motion%flip_fraction*(column(p, layout%velocity + axis) &
                                              + motion%time_step*value(5 + axis)) + (1.0_wp - motion%flip_fraction)*value(2 + axis)
            gradient(p, 1 + axis) = slope_x(2 + axis)
            gradient(p, 4 + axis) = slope_y(2 + axis)
            gradient(p, 7 + axis) = slope_z(2 + axis)
         end do
      end do
   end subroutine take

end module m_node_to_particle
