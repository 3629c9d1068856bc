!> G2P for parallelepipeds: velocity, acceleration and velocity gradient from nodes to particles (theory.md,
!> eqs to-particles, corners).
module m_g2p_corners
   use m_kinds, only: wp
   use m_constants, only: block_size
   use m_node_values, only: node_values
   use m_field_table, only: layout_t
   use m_cell_list, only: cell_list_t
   use m_stencil, only: frame_t, batch, chunk
   use m_corner_stencil, only: corner_stencil_t, corner_weights_t, set_corners, set_corner_weights, &
                               batch_end
   use m_g2p_boxes, only: motion_t, fastest_t, taken_t, move, find_fastest
   implicit none
   private
   public :: g2p_corners

   integer, parameter :: alone = 2 !< up to this number, particles of a bin are processed one by one

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
      integer :: first, last, m, n, r
      do first = 1, cells%count, chunk
         call set_corners(corners, cells, first, column, layout, frame)
         do r = 1, corners%list%runs
            m = corners%list%run_first(r)
            do while (m < corners%list%run_first(r + 1))
               if (mod(m, batch) == 1) call set_corner_weights(weights, corners, m)
               last = batch_end(corners%list, r, m)
               associate (place => corners%list%run_place(:, r))
                  if (last - m + 1 > alone) then
                     call take_together(weights, m, last, place, tile, taken)
                  else
                     do n = m, last
                        call take_one(weights, n, place, tile, taken)
                     end do
                  end if
               end associate
               m = last + 1
            end do
         end do
         call turn_gradient(corners, frame%per_cell, taken)
         call move(corners%list, taken, layout, motion, column, gradient)
         if (present(fastest)) call find_fastest(corners%list, taken, fastest)
      end do
   end subroutine g2p_corners

   !> Interpolate from the 27 nodes around their bin for particles of one run and one batch of the chunk: one
   !> lane a particle, all sums in registers. The gradient is along each half edge. Lanes of the batch that
   !> are not of the run are discarded.
   pure subroutine take_together(weights, first, last, place, tile, taken)
      type(corner_weights_t), intent(in) :: weights
      integer, intent(in) :: first, last, place(3)
      real(wp), intent(in) :: tile(node_values, 0:block_size + 1, 0:block_size + 1, 0:block_size + 1)
      type(taken_t), intent(inout) :: taken
      real(wp) :: near(node_values, 27), sums(batch, 15)
      real(wp) :: w, x, y, z, v1, v2, v3, a1, a2, a3, &
                  x1, x2, x3, y1, y2, y3, z1, z2, z3
      integer :: b, c, lane, n, p, q
      do c = 0, 2
         do b = 0, 2
            n = 1 + 3*(b + 3*c)
            near(:, n:n + 2) = tile(:, place(1):place(1) + 2, place(2) + b, place(3) + c)
         end do
      end do
      !$omp simd private(w, x, y, z, v1, v2, v3, a1, a2, a3, x1, x2, x3, y1, y2, y3, z1, z2, z3)
      do p = 1, batch
         v1 = 0.0_wp; v2 = 0.0_wp; v3 = 0.0_wp
         a1 = 0.0_wp; a2 = 0.0_wp; a3 = 0.0_wp
         x1 = 0.0_wp; x2 = 0.0_wp; x3 = 0.0_wp
         y1 = 0.0_wp; y2 = 0.0_wp; y3 = 0.0_wp
         z1 = 0.0_wp; z2 = 0.0_wp; z3 = 0.0_wp
         !GCC$ unroll 1
         do n = 1, 27
            w = weights%weight(p, n)
            x = weights%along(p, n, 1)
            y = weights%along(p, n, 2)
            z = weights%along(p, n, 3)
            v1 = v1 + w*near(2, n); v2 = v2 + w*near(3, n); v3 = v3 + w*near(4, n)
            a1 = a1 + w*near(5, n); a2 = a2 + w*near(6, n); a3 = a3 + w*near(7, n)
            x1 = x1 + x*near(2, n); x2 = x2 + x*near(3, n); x3 = x3 + x*near(4, n)
            y1 = y1 + y*near(2, n); y2 = y2 + y*near(3, n); y3 = y3 + y*near(4, n)
            z1 = z1 + z*near(2, n); z2 = z2 + z*near(3, n); z3 = z3 + z*near(4, n)
         end do
         sums(p, 1) = v1; sums(p, 2) = v2; sums(p, 3) = v3
         sums(p, 4) = a1; sums(p, 5) = a2; sums(p, 6) = a3
         sums(p, 7) = x1; sums(p, 8) = x2; sums(p, 9) = x3
         sums(p, 10) = y1; sums(p, 11) = y2; sums(p, 12) = y3
         sums(p, 13) = z1; sums(p, 14) = z2; sums(p, 15) = z3
      end do
      lane = 1 + mod(first - 1, batch)
      do q = 1, 6
         taken%motion(first:last, q) = sums(lane:lane + last - first, q)
      end do
      do q = 1, 9
         taken%gradient(first:last, q) = sums(lane:lane + last - first, 6 + q)
      end do
   end subroutine take_together

   !> Particle m of the chunk alone: one lane a node quantity.
   pure subroutine take_one(weights, m, place, tile, taken)
      type(corner_weights_t), intent(in) :: weights
      integer, intent(in) :: m, place(3)
      real(wp), intent(in) :: tile(node_values, 0:block_size + 1, 0:block_size + 1, 0:block_size + 1)
      type(taken_t), intent(inout) :: taken
      real(wp) :: sums(node_values, 0:3), w, x, y, z
      integer :: a, b, c, n, p, q
      p = 1 + mod(m - 1, batch)
      !$omp simd private(w, x, y, z)
      do q = 1, node_values
         w = 0.0_wp
         x = 0.0_wp
         y = 0.0_wp
         z = 0.0_wp
         do c = 0, 2
            do b = 0, 2
               do a = 0, 2
                  n = 1 + a + 3*(b + 3*c)
                  w = w + weights%weight(p, n)*tile(q, place(1) + a, place(2) + b, place(3) + c)
                  x = x + weights%along(p, n, 1)*tile(q, place(1) + a, place(2) + b, place(3) + c)
                  y = y + weights%along(p, n, 2)*tile(q, place(1) + a, place(2) + b, place(3) + c)
                  z = z + weights%along(p, n, 3)*tile(q, place(1) + a, place(2) + b, place(3) + c)
               end do
            end do
         end do
         sums(q, 0) = w
         sums(q, 1) = x
         sums(q, 2) = y
         sums(q, 3) = z
      end do
      taken%motion(m, :) = sums(2:7, 0)
      taken%gradient(m, 1:3) = sums(2:4, 1)
      taken%gradient(m, 4:6) = sums(2:4, 2)
      taken%gradient(m, 7:9) = sums(2:4, 3)
   end subroutine take_one

   !> Convert derivatives along the half edges to derivatives along the axes.
   pure subroutine turn_gradient(corners, per_cell, taken)
      type(corner_stencil_t), intent(in) :: corners
      real(wp), intent(in) :: per_cell !< 1/m
      type(taken_t), intent(inout) :: taken
      real(wp) :: x, y, z
      integer :: k, m, q
      do q = 1, 3
         !$omp simd private(x, y, z)
         do m = 1, corners%list%count
            x = per_cell*taken%gradient(m, q)
            y = per_cell*taken%gradient(m, 3 + q)
            z = per_cell*taken%gradient(m, 6 + q)
            do k = 1, 3
               taken%gradient(m, 3*k - 3 + q) = corners%inverse(m, k)*x + corners%inverse(m, 3 + k)*y &
                                                + corners%inverse(m, 6 + k)*z
            end do
         end do
      end do
   end subroutine turn_gradient

end module m_g2p_corners
