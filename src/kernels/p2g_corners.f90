!> P2G for parallelepipeds: mass, momentum and force from particles to nodes (theory.md, eqs to-nodes,
!> corners). The weights are not products over the axes; the particles of a run are added to their 27 nodes
!> together, one lane a node quantity.
module m_p2g_corners
   use m_kinds, only: wp
   use m_constants, only: block_size
   use m_node_values, only: node_values, f_x, f_z
   use m_field_table, only: layout_t
   use m_cell_list, only: cell_list_t
   use m_stencil, only: frame_t, batch, chunk, set_places
   use m_corner_stencil, only: corner_stencil_t, corner_weights_t, set_corners, set_corner_weights, batch_end
   use m_p2g_boxes, only: load_t, half, set_load
   implicit none
   private
   public :: p2g_corners, add_corners_body_force, add_corners_force, turn_force

contains

   !> Add the contributions of the listed particles to a block's node tile; as p2g_boxes.
   pure subroutine p2g_corners(cells, column, layout, frame, tile)
      type(cell_list_t), intent(in) :: cells
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      type(frame_t), intent(in) :: frame
      real(wp), intent(inout) :: tile(node_values, 0:block_size + 1, 0:block_size + 1, 0:block_size + 1)
      type(corner_stencil_t) :: corners
      type(corner_weights_t) :: weights
      type(load_t) :: load
      integer :: first, last, m, r
      do first = 1, cells%count, chunk
         call set_corners(corners, cells, first, column, layout, frame)
         call set_load(load, corners%list, column, layout, frame%cell)
         call turn_force(load, corners, frame%per_cell)
         do r = 1, corners%list%runs
            m = corners%list%run_first(r)
            do while (m < corners%list%run_first(r + 1))
               if (mod(m, batch) == 1) call set_corner_weights(weights, corners, m)
               last = batch_end(corners%list, r, m)
               associate (place => corners%list%run_place(:, r))
                  call add_momentum(load, weights, m, last, place(1), place(2), place(3), tile)
                  call add_corners_force(load, weights, m, last, place(1), place(2), place(3), tile)
               end associate
               m = last + 1
            end do
         end do
      end do
   end subroutine p2g_corners

   !> Forces are multiplied by gradients, which are differences along the half edges times the inverse of
   !> these: so the product of inverse and force, computed once a particle, is multiplied by the differences.
   pure subroutine turn_force(load, corners, per_cell)
      type(load_t), intent(inout) :: load
      type(corner_stencil_t), intent(in) :: corners
      real(wp), intent(in) :: per_cell !< 1/m
      real(wp) :: x, y, z
      integer :: k, m, q
      do m = 1, corners%list%count
         !$omp simd private(x, y, z)
         do q = 1, half
            x = per_cell*load%force(q, 1, m)
            y = per_cell*load%force(q, 2, m)
            z = per_cell*load%force(q, 3, m)
            do k = 1, 3
               load%force(q, k, m) = corners%inverse(m, 3*k - 2)*x + corners%inverse(m, 3*k - 1)*y &
                                     + corners%inverse(m, 3*k)*z
            end do
         end do
      end do
   end subroutine turn_force

   !> Add mass and momentum of particles of one run and one batch of the chunk to the 27 nodes around their
   !> bin. One lane a node quantity; plane by plane, with the plane's nine sums in registers over the
   !> particles.
   pure subroutine add_momentum(load, weights, first, last, i, j, k, tile)
      type(load_t), intent(in) :: load
      type(corner_weights_t), intent(in) :: weights
      integer, intent(in) :: first, last, i, j, k
      real(wp), intent(inout) :: tile(node_values, 0:block_size + 1, 0:block_size + 1, 0:block_size + 1)
      real(wp) :: s11, s21, s31, s12, s22, s32, s13, s23, s33, middle, row, y, z
      integer :: a, before, m, p, q
      before = first - 1 - mod(first - 1, batch) ! the batch
      do a = -1, 1
         !$omp simd private(s11, s21, s31, s12, s22, s32, s13, s23, s33, middle, row, y, z, p)
         do q = 1, half
            s11 = tile(q, i + 1 + a, j, k)
            s21 = tile(q, i + 1 + a, j + 1, k)
            s31 = tile(q, i + 1 + a, j + 2, k)
            s12 = tile(q, i + 1 + a, j, k + 1)
            s22 = tile(q, i + 1 + a, j + 1, k + 1)
            s32 = tile(q, i + 1 + a, j + 2, k + 1)
            s13 = tile(q, i + 1 + a, j, k + 2)
            s23 = tile(q, i + 1 + a, j + 1, k + 2)
            s33 = tile(q, i + 1 + a, j + 2, k + 2)
            do m = first, max(first, last) ! at least one, so that the loop over lanes is vectorised
               p = m - before
               middle = load%momentum(q, 0, m) + a*load%momentum(q, 1, m)
               y = load%momentum(q, 2, m)
               z = load%momentum(q, 3, m)
               row = middle - y
               s11 = s11 + weights%weight(p, 2 + a)*(row - z)
               s12 = s12 + weights%weight(p, 11 + a)*row
               s13 = s13 + weights%weight(p, 20 + a)*(row + z)
               s21 = s21 + weights%weight(p, 5 + a)*(middle - z)
               s22 = s22 + weights%weight(p, 14 + a)*middle
               s23 = s23 + weights%weight(p, 23 + a)*(middle + z)
               row = middle + y
               s31 = s31 + weights%weight(p, 8 + a)*(row - z)
               s32 = s32 + weights%weight(p, 17 + a)*row
               s33 = s33 + weights%weight(p, 26 + a)*(row + z)
            end do
            tile(q, i + 1 + a, j, k) = s11
            tile(q, i + 1 + a, j + 1, k) = s21
            tile(q, i + 1 + a, j + 2, k) = s31
            tile(q, i + 1 + a, j, k + 1) = s12
            tile(q, i + 1 + a, j + 1, k + 1) = s22
            tile(q, i + 1 + a, j + 2, k + 1) = s32
            tile(q, i + 1 + a, j, k + 2) = s13
            tile(q, i + 1 + a, j + 1, k + 2) = s23
            tile(q, i + 1 + a, j + 2, k + 2) = s33
         end do
      end do
   end subroutine add_momentum

   !> The same for forces after turn_force.
   pure subroutine add_corners_force(load, weights, first, last, i, j, k, tile)
      type(load_t), intent(in) :: load
      type(corner_weights_t), intent(in) :: weights
      integer, intent(in) :: first, last, i, j, k
      real(wp), intent(inout) :: tile(node_values, 0:block_size + 1, 0:block_size + 1, 0:block_size + 1)
      real(wp) :: s11, s21, s31, s12, s22, s32, s13, s23, s33, x, y, z
      integer :: a, before, m, p, q
      before = first - 1 - mod(first - 1, batch) ! the batch
      do a = -1, 1
         !$omp simd private(s11, s21, s31, s12, s22, s32, s13, s23, s33, x, y, z, p)
         do q = 1, half
            s11 = tile(half + q, i + 1 + a, j, k)
            s21 = tile(half + q, i + 1 + a, j + 1, k)
            s31 = tile(half + q, i + 1 + a, j + 2, k)
            s12 = tile(half + q, i + 1 + a, j, k + 1)
            s22 = tile(half + q, i + 1 + a, j + 1, k + 1)
            s32 = tile(half + q, i + 1 + a, j + 2, k + 1)
            s13 = tile(half + q, i + 1 + a, j, k + 2)
            s23 = tile(half + q, i + 1 + a, j + 1, k + 2)
            s33 = tile(half + q, i + 1 + a, j + 2, k + 2)
            do m = first, max(first, last)
               p = m - before
               x = load%force(q, 1, m)
               y = load%force(q, 2, m)
               z = load%force(q, 3, m)
               s11 = s11 + weights%along(p, 2 + a, 1)*x + weights%along(p, 2 + a, 2)*y &
                     + weights%along(p, 2 + a, 3)*z
               s21 = s21 + weights%along(p, 5 + a, 1)*x + weights%along(p, 5 + a, 2)*y &
                     + weights%along(p, 5 + a, 3)*z
               s31 = s31 + weights%along(p, 8 + a, 1)*x + weights%along(p, 8 + a, 2)*y &
                     + weights%along(p, 8 + a, 3)*z
               s12 = s12 + weights%along(p, 11 + a, 1)*x + weights%along(p, 11 + a, 2)*y &
                     + weights%along(p, 11 + a, 3)*z
               s22 = s22 + weights%along(p, 14 + a, 1)*x + weights%along(p, 14 + a, 2)*y &
                     + weights%along(p, 14 + a, 3)*z
               s32 = s32 + weights%along(p, 17 + a, 1)*x + weights%along(p, 17 + a, 2)*y &
                     + weights%along(p, 17 + a, 3)*z
               s13 = s13 + weights%along(p, 20 + a, 1)*x + weights%along(p, 20 + a, 2)*y &
                     + weights%along(p, 20 + a, 3)*z
               s23 = s23 + weights%along(p, 23 + a, 1)*x + weights%along(p, 23 + a, 2)*y &
                     + weights%along(p, 23 + a, 3)*z
               s33 = s33 + weights%along(p, 26 + a, 1)*x + weights%along(p, 26 + a, 2)*y &
                     + weights%along(p, 26 + a, 3)*z
            end do
            tile(half + q, i + 1 + a, j, k) = s11
            tile(half + q, i + 1 + a, j + 1, k) = s21
            tile(half + q, i + 1 + a, j + 2, k) = s31
            tile(half + q, i + 1 + a, j, k + 1) = s12
            tile(half + q, i + 1 + a, j + 1, k + 1) = s22
            tile(half + q, i + 1 + a, j + 2, k + 1) = s32
            tile(half + q, i + 1 + a, j, k + 2) = s13
            tile(half + q, i + 1 + a, j + 1, k + 2) = s23
            tile(half + q, i + 1 + a, j + 2, k + 2) = s33
         end do
      end do
   end subroutine add_corners_force

   !> Add m S b to the force of a block's node tile; as add_body_force.
   pure subroutine add_corners_body_force(cells, column, layout, frame, acceleration, tile)
      type(cell_list_t), intent(in) :: cells
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      type(frame_t), intent(in) :: frame
      real(wp), intent(in), contiguous :: acceleration(:, :) !< (:, 3), m/s2
      real(wp), intent(inout) :: tile(node_values, 0:block_size + 1, 0:block_size + 1, 0:block_size + 1)
      type(corner_stencil_t) :: corners
      type(corner_weights_t) :: weights
      real(wp) :: force(3)
      integer :: first, m, n, p, particle, node(3), place(3, chunk)
      do first = 1, cells%count, chunk
         call set_corners(corners, cells, first, column, layout, frame)
         call set_places(corners%list, place)
         do m = 1, corners%list%count
            p = 1 + mod(m - 1, batch)
            if (p == 1) call set_corner_weights(weights, corners, m)
            particle = corners%list%member(m)
            force = column(particle, layout%mass)*acceleration(particle, :)
            do n = 1, 27
               node = place(:, m) + [mod(n - 1, 3), mod((n - 1)/3, 3), (n - 1)/9]
               tile(f_x:f_z, node(1), node(2), node(3)) = tile(f_x:f_z, node(1), node(2), node(3)) &
                                                          + weights%weight(p, n)*force
            end do
         end do
      end do
   end subroutine add_corners_body_force

end module m_p2g_corners
