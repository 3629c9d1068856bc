!> P2G and G2P for particles of a section and the nodes of its plane (theory.md, Sections): as p2g_boxes and
!> g2p_boxes, with nine nodes a particle and none along y.
module m_plane_transfer
   use m_kinds, only: wp
   use m_node_values, only: node_values, tile_last, plane_row
   use m_field_table, only: layout_t
   use m_cell_list, only: cell_list_t
   use m_stencil, only: frame_t, chunk
   use m_plane_weights, only: plane_weights_t, set_plane_weights
   use m_p2g_boxes, only: load_t, half, set_load
   use m_g2p_boxes, only: motion_t, fastest_t, taken_t, move, find_fastest
   implicit none
   private
   public :: p2g_plane, g2p_plane, add_plane_force

   integer, parameter :: group = 4 !< particles of a bin processed together; lanes beyond the last get
                                   !< meaningless values, which are overwritten later

contains

   !> Add the contributions of the listed particles to a block's node tile.
   pure subroutine p2g_plane(cells, column, layout, frame, tile)
      type(cell_list_t), intent(in) :: cells
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      type(frame_t), intent(in) :: frame
      real(wp), intent(inout) :: tile(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      type(plane_weights_t) :: weights
      type(load_t) :: load
      integer :: first, r
      do first = 1, cells%count, chunk
         call set_plane_weights(weights, cells, first, column, layout, frame)
         associate (list => weights%list)
            call set_load(load, list, column, layout, frame%cell)
            do r = 1, list%runs
               call add_plane_momentum(load, weights, list%run_first(r), list%run_first(r + 1) - 1, &
                                       list%run_place(1, r), list%run_place(3, r), tile)
            end do
            call add_plane_force(load, weights, tile)
         end associate
      end do
   end subroutine p2g_plane

   !> Mass and momentum of a run of particles of one bin: one lane a node quantity, the nine sums in
   !> registers.
   pure subroutine add_plane_momentum(load, weights, first, last, i, k, tile)
      type(load_t), intent(in) :: load
      type(plane_weights_t), intent(in) :: weights
      integer, intent(in) :: first, last, i, k
      real(wp), intent(inout) :: tile(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      real(wp) :: s1, s2, s3, s4, s5, s6, s7, s8, s9, low, middle, high, x
      integer :: p, q
      associate (w => weights%weight, j => plane_row)
         !$omp simd private(s1, s2, s3, s4, s5, s6, s7, s8, s9, low, middle, high, x)
         do q = 1, half
            s1 = tile(q, i, j, k)
            s2 = tile(q, i + 1, j, k)
            s3 = tile(q, i + 2, j, k)
            s4 = tile(q, i, j, k + 1)
            s5 = tile(q, i + 1, j, k + 1)
            s6 = tile(q, i + 2, j, k + 1)
            s7 = tile(q, i, j, k + 2)
            s8 = tile(q, i + 1, j, k + 2)
            s9 = tile(q, i + 2, j, k + 2)
            do p = first, max(first, last) ! at least one, so that the loop over lanes is vectorised
               middle = load%momentum(q, 0, p)
               x = load%momentum(q, 1, p)
               low = middle - load%momentum(q, 3, p)
               high = middle + load%momentum(q, 3, p)
               s1 = s1 + w(p, 1)*(low - x)
               s2 = s2 + w(p, 2)*low
               s3 = s3 + w(p, 3)*(low + x)
               s4 = s4 + w(p, 4)*(middle - x)
               s5 = s5 + w(p, 5)*middle
               s6 = s6 + w(p, 6)*(middle + x)
               s7 = s7 + w(p, 7)*(high - x)
               s8 = s8 + w(p, 8)*high
               s9 = s9 + w(p, 9)*(high + x)
            end do
            tile(q, i, j, k) = s1
            tile(q, i + 1, j, k) = s2
            tile(q, i + 2, j, k) = s3
            tile(q, i, j, k + 1) = s4
            tile(q, i + 1, j, k + 1) = s5
            tile(q, i + 2, j, k + 1) = s6
            tile(q, i, j, k + 2) = s7
            tile(q, i + 1, j, k + 2) = s8
            tile(q, i + 2, j, k + 2) = s9
         end do
      end associate
   end subroutine add_plane_momentum

   !> Forces of a chunk of particles: columns 1 and 3 of the load with the gradients along x and z, column 2,
   !> the hoop force, with the weight over the radius.
   pure subroutine add_plane_force(load, weights, tile)
      type(load_t), intent(inout) :: load !< column 2 is divided by the radius
      type(plane_weights_t), intent(in) :: weights
      real(wp), intent(inout) :: tile(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      integer :: p, r
      associate (list => weights%list)
         do p = 1, list%count
            load%force(:, 2, p) = weights%per_radius(p)*load%force(:, 2, p)
         end do
         do r = 1, list%runs
            call add_run(load, weights, list%run_first(r), list%run_first(r + 1) - 1, list%run_place(1, r), &
                         list%run_place(3, r), tile)
         end do
      end associate
   end subroutine add_plane_force

   !> For a run of particles of one bin, as add_plane_momentum.
   pure subroutine add_run(load, weights, first, last, i, k, tile)
      type(load_t), intent(in) :: load
      type(plane_weights_t), intent(in) :: weights
      integer, intent(in) :: first, last, i, k
      real(wp), intent(inout) :: tile(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      real(wp) :: s1, s2, s3, s4, s5, s6, s7, s8, s9, x, y, z
      integer :: p, q
      associate (w => weights%weight, u => weights%slope, j => plane_row)
         !$omp simd private(s1, s2, s3, s4, s5, s6, s7, s8, s9, x, y, z)
         do q = 1, half
            s1 = tile(half + q, i, j, k)
            s2 = tile(half + q, i + 1, j, k)
            s3 = tile(half + q, i + 2, j, k)
            s4 = tile(half + q, i, j, k + 1)
            s5 = tile(half + q, i + 1, j, k + 1)
            s6 = tile(half + q, i + 2, j, k + 1)
            s7 = tile(half + q, i, j, k + 2)
            s8 = tile(half + q, i + 1, j, k + 2)
            s9 = tile(half + q, i + 2, j, k + 2)
            do p = first, max(first, last) ! at least one, so that the loop over lanes is vectorised
               x = load%force(q, 1, p)
               y = load%force(q, 2, p)
               z = load%force(q, 3, p)
               s1 = s1 + (u(p, 1, 1)*x + w(p, 1)*y + u(p, 1, 2)*z)
               s2 = s2 + (u(p, 2, 1)*x + w(p, 2)*y + u(p, 2, 2)*z)
               s3 = s3 + (u(p, 3, 1)*x + w(p, 3)*y + u(p, 3, 2)*z)
               s4 = s4 + (u(p, 4, 1)*x + w(p, 4)*y + u(p, 4, 2)*z)
               s5 = s5 + (u(p, 5, 1)*x + w(p, 5)*y + u(p, 5, 2)*z)
               s6 = s6 + (u(p, 6, 1)*x + w(p, 6)*y + u(p, 6, 2)*z)
               s7 = s7 + (u(p, 7, 1)*x + w(p, 7)*y + u(p, 7, 2)*z)
               s8 = s8 + (u(p, 8, 1)*x + w(p, 8)*y + u(p, 8, 2)*z)
               s9 = s9 + (u(p, 9, 1)*x + w(p, 9)*y + u(p, 9, 2)*z)
            end do
            tile(half + q, i, j, k) = s1
            tile(half + q, i + 1, j, k) = s2
            tile(half + q, i + 2, j, k) = s3
            tile(half + q, i, j, k + 1) = s4
            tile(half + q, i + 1, j, k + 1) = s5
            tile(half + q, i + 2, j, k + 1) = s6
            tile(half + q, i, j, k + 2) = s7
            tile(half + q, i + 1, j, k + 2) = s8
            tile(half + q, i + 2, j, k + 2) = s9
         end do
      end associate
   end subroutine add_run

   !> Move a block's particles with its node tile and store their velocity gradients, d v_i / d x_j at 3 (j-1)
   !> + i.
   pure subroutine g2p_plane(cells, tile, layout, frame, motion, column, gradient, fastest)
      type(cell_list_t), intent(in) :: cells
      real(wp), intent(in) :: tile(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      type(layout_t), intent(in) :: layout
      type(frame_t), intent(in) :: frame
      type(motion_t), intent(in) :: motion
      real(wp), intent(inout), contiguous :: column(:, :)
      real(wp), intent(inout), contiguous :: gradient(:, :) !< (:, 9), 1/s
      type(fastest_t), intent(inout), optional :: fastest
      type(plane_weights_t) :: weights
      type(taken_t) :: taken
      integer :: first, n, p, r
      do first = 1, cells%count, chunk
         call set_plane_weights(weights, cells, first, column, layout, frame)
         associate (list => weights%list)
            do r = 1, list%runs
               do p = list%run_first(r), list%run_first(r + 1) - 1, group
                  call take_group(weights, p, list%run_place(1, r), list%run_place(3, r), tile, taken)
               end do
            end do
            n = list%count
            taken%motion(:n, [2, 5]) = 0.0_wp
            taken%gradient(:n, [2, 5, 6, 8]) = 0.0_wp
            taken%gradient(:n, 4) = taken%motion(:n, 1)*weights%per_radius(:n) ! `move` uses it as the hoop
                                                                               ! rate
            call move(list, taken, layout, motion, column, gradient)
            if (present(fastest)) call find_fastest(list, taken, fastest)
         end associate
      end do
   end subroutine g2p_plane

   !> Interpolate for particle `first` and the next ones: one lane a particle.
   pure subroutine take_group(weights, first, i, k, tile, taken)
      type(plane_weights_t), intent(in) :: weights
      integer, intent(in) :: first, i, k
      real(wp), intent(in) :: tile(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      type(taken_t), intent(inout) :: taken
      real(wp) :: value, x, z, node
      integer :: a, c, m, q
      do q = 1, 3, 2
         !$omp simd private(value, x, z, node)
         do m = first, first + group - 1
            value = 0.0_wp
            x = 0.0_wp
            z = 0.0_wp
            do c = 0, 2
               do a = 0, 2
                  node = tile(1 + q, i + a, plane_row, k + c)
                  value = value + weights%weight(m, 1 + a + 3*c)*node
                  x = x + weights%slope(m, 1 + a + 3*c, 1)*node
                  z = z + weights%slope(m, 1 + a + 3*c, 2)*node
               end do
            end do
            taken%motion(m, q) = value
            taken%gradient(m, q) = x
            taken%gradient(m, 6 + q) = z
         end do
         !$omp simd private(value)
         do m = first, first + group - 1
            value = 0.0_wp
            do c = 0, 2
               do a = 0, 2
                  value = value + weights%weight(m, 1 + a + 3*c)*tile(4 + q, i + a, plane_row, k + c)
               end do
            end do
            taken%motion(m, 3 + q) = value
         end do
      end do
   end subroutine take_group

end module m_plane_transfer
