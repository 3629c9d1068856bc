!> Particles whose domains are parallelepipeds take velocity, acceleration and velocity gradient from their
!> nodes (theory.md, eqs to-particles, corners).
module m_g2p_corners
   use m_kinds, only: wp
   use m_constants, only: block_size
   use m_node_values, only: node_values
   use m_field_table, only: layout_t
   use m_cell_list, only: cell_list_t
   use m_stencil, only: frame_t, batch, chunk
   use m_corner_stencil, only: corner_stencil_t, corner_weights_t, set_corners, set_corner_weights
   use m_g2p_boxes, only: motion_t, fastest_t, taken_t, move, find_fastest
   implicit none
   private
   public :: g2p_corners


contains

   !> Move a block's particles with its node tile and store their velocity gradients; as g2p_boxes.
   pure subroutine g2p_corners(cells, tile, layout, frame, motion, column, gradient, fastest)
      type(cell_list_t), intent(in) :: cells
      real(wp), intent(in) :: tile(node_values, 0:block_size + 1, 0:block_size + 1, 0:block_size + 1)
      type(layout_t), intent(in) :: layout
      type(frame_t), intent(in) :: frame
      type(motion_t), intent(in) :: motion
      real(wp), intent(inout), contiguous :: column(:, :)
      real(wp), intent(inout), contiguous :: gradient(:, :) !< (:, 9), 1/s
      type(fastest_t), intent(inout), optional :: fastest
      type(corner_stencil_t) :: corners
      type(corner_weights_t) :: weights
      type(taken_t) :: taken
      integer :: first, m, p
      do first = 1, cells%count, chunk
         call set_corners(corners, cells, first, column, layout, frame)
         do m = 1, corners%list%count
            p = 1 + mod(m - 1, batch)
            if (p == 1) call set_corner_weights(weights, corners, m, frame%per_cell)
            call take(weights, m, p, corners%place(:, m), tile, taken)
         end do
         call move(corners%list, taken, layout, motion, column, gradient)
         if (present(fastest)) call find_fastest(corners%list, taken, fastest)
      end do
   end subroutine g2p_corners

   !> Particle m of the chunk, p of the batch, from the nodes from `place` in the tile on: one lane a node
   !> quantity.
   pure subroutine take(weights, m, p, place, tile, taken)
      type(corner_weights_t), intent(in) :: weights
      integer, intent(in) :: m, p, place(3)
      real(wp), intent(in) :: tile(node_values, 0:block_size + 1, 0:block_size + 1, 0:block_size + 1)
      type(taken_t), intent(inout) :: taken
      real(wp), dimension(node_values) :: motion, slope_x, slope_y, slope_z
      real(wp) :: value, x, y, z
      integer :: b, c, i, j, k, n, q
      i = place(1)
      !$omp simd private(value, x, y, z)
      do q = 1, node_values
         value = 0.0_wp
         x = 0.0_wp
         y = 0.0_wp
         z = 0.0_wp
         do c = 0, 2
            k = place(3) + c
            do b = 0, 2
               j = place(2) + b
               n = 1 + 3*(b + 3*c)
               value = value + (weights%weight(p, n)*tile(q, i, j, k) &
                                + weights%weight(p, n + 1)*tile(q, i + 1, j, k) &
                                + weights%weight(p, n + 2)*tile(q, i + 2, j, k))
               x = x + (weights%slope(p, n, 1)*tile(q, i, j, k) + weights%slope(p, n + 1, 1)*tile(q, i + 1, &
                  j, k) + weights%slope(p, n + 2, 1)*tile(q, i + 2, j, k))
               y = y + (weights%slope(p, n, 2)*tile(q, i, j, k) + weights%slope(p, n + 1, 2)*tile(q, i + 1, &
                  j, k) + weights%slope(p, n + 2, 2)*tile(q, i + 2, j, k))
               z = z + (weights%slope(p, n, 3)*tile(q, i, j, k) + weights%slope(p, n + 1, 3)*tile(q, i + 1, &
                  j, k) + weights%slope(p, n + 2, 3)*tile(q, i + 2, j, k))
            end do
         end do
         motion(q) = value
         slope_x(q) = x
         slope_y(q) = y
         slope_z(q) = z
      end do
      do q = 1, 3
         taken%motion(m, q) = motion(1 + q)
         taken%motion(m, 3 + q) = motion(4 + q)
         taken%gradient(m, q) = slope_x(1 + q)
         taken%gradient(m, 3 + q) = slope_y(1 + q)
         taken%gradient(m, 6 + q) = slope_z(1 + q)
      end do
   end subroutine take

end module m_g2p_corners
