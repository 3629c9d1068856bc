!> Particles whose domains are parallelepipeds take velocity, acceleration and velocity gradient from their nodes (theory.md, eqs
!> to-particles, corners).
module m_corner_to_particle
   use m_kinds, only: wp
   use m_constants, only: block_size
   use m_field_table, only: layout_t
   use m_cell_list, only: cell_list_t
   use m_stencil, only: frame_t, batch, chunk, bin_place
   use m_corner_stencil, only: corner_stencil_t, corner_weights_t, set_corners, set_corner_weights
   use m_node_to_particle, only: motion_t, taken_t, move
   implicit none
   private
   public :: scatter_to_corners

   integer, parameter :: lanes = 8 !< values a node: mass, velocity (3), acceleration (3), spare

contains

   !> Move a block's particles with its node tile and store their velocity gradients; as scatter_to_particles.
   pure subroutine scatter_to_corners(cells, tile, layout, frame, motion, column, gradient)
      type(cell_list_t), intent(in) :: cells
      real(wp), intent(in) :: tile(lanes, 0:block_size + 1, 0:block_size + 1, 0:block_size + 1)
      type(layout_t), intent(in) :: layout
      type(frame_t), intent(in) :: frame
      type(motion_t), intent(in) :: motion
      real(wp), intent(inout), contiguous :: column(:, :)
      real(wp), intent(inout), contiguous :: gradient(:, :) !< (:, 9), 1/s
      type(corner_stencil_t) :: corners
      type(corner_weights_t) :: weights
      type(taken_t) :: taken
      integer :: first, m, p
      do first = 1, cells%first(size(cells%first)) - 1, chunk
         call set_corners(corners, cells, first, column, layout, frame)
         do m = 1, corners%list%count
            p = 1 + mod(m - 1, batch)
            if (p == 1) call set_corner_weights(weights, corners, m, frame%per_cell)
            call take(weights, m, p, bin_place(int(cells%bin(corners%list%member(m)))), tile, taken)
         end do
         call move(corners%list, taken, layout, motion, column, gradient)
      end do
   end subroutine scatter_to_corners

   !> Particle m of the chunk, p of the batch, from the nodes from `place` in the tile on: one lane a node quantity.
   pure subroutine take(weights, m, p, place, tile, taken)
      type(corner_weights_t), intent(in) :: weights
      integer, intent(in) :: m, p, place(3)
      real(wp), intent(in) :: tile(lanes, 0:block_size + 1, 0:block_size + 1, 0:block_size + 1)
      type(taken_t), intent(inout) :: taken
      real(wp), dimension(lanes) :: value, x, y, z
      integer :: a, b, c, n, q
      value = 0.0_wp
      x = 0.0_wp
      y = 0.0_wp
      z = 0.0_wp
      n = 0
      do c = 0, 2
         do b = 0, 2
            do a = 0, 2
               n = n + 1
               !$omp simd
               do q = 1, lanes
                  value(q) = value(q) + weights%weight(p, n)*tile(q, place(1) + a, place(2) + b, place(3) + c)
                  x(q) = x(q) + weights%slope(p, n, 1)*tile(q, place(1) + a, place(2) + b, place(3) + c)
                  y(q) = y(q) + weights%slope(p, n, 2)*tile(q, place(1) + a, place(2) + b, place(3) + c)
                  z(q) = z(q) + weights%slope(p, n, 3)*tile(q, place(1) + a, place(2) + b, place(3) + c)
               end do
            end do
         end do
      end do
      do q = 1, 3
         taken%motion(m, q) = value(1 + q)
         taken%motion(m, 3 + q) = value(4 + q)
         taken%gradient(m, q) = x(1 + q)
         taken%gradient(m, 3 + q) = y(1 + q)
         taken%gradient(m, 6 + q) = z(1 + q)
      end do
   end subroutine take

end module m_corner_to_particle
