!> Particles whose domains are parallelepipeds give mass, momentum and force to their nodes (theory.md, eqs
!> to-nodes, corners). The weights are no products of one an axis, so each particle goes to its 27 nodes by
!> itself, one lane a node quantity.
module m_p2g_corners
   use m_kinds, only: wp
   use m_constants, only: block_size
   use m_node_values, only: node_values, f_x, f_z
   use m_field_table, only: layout_t
   use m_cell_list, only: cell_list_t
   use m_stencil, only: frame_t, batch, chunk
   use m_corner_stencil, only: corner_stencil_t, corner_weights_t, set_corners, set_corner_weights
   use m_p2g_boxes, only: load_t, half, set_load
   implicit none
   private
   public :: p2g_corners, add_corners_body_force, add_corners_load


contains

   !> Add to a block's node tile what the listed particles give; as p2g_boxes.
   pure subroutine p2g_corners(cells, column, layout, frame, tile)
      type(cell_list_t), intent(in) :: cells
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      type(frame_t), intent(in) :: frame
      real(wp), intent(inout) :: tile(node_values, 0:block_size + 1, 0:block_size + 1, 0:block_size + 1)
      type(corner_stencil_t) :: corners
      type(corner_weights_t) :: weights
      type(load_t) :: load
      integer :: first, m, p
      do first = 1, cells%count, chunk
         call set_corners(corners, cells, first, column, layout, frame)
         call set_load(load, corners%list, column, layout, frame%cell)
         do m = 1, corners%list%count
            p = 1 + mod(m - 1, batch)
            if (p == 1) call set_corner_weights(weights, corners, m, frame%per_cell)
            call add_corners_load(load, weights, m, p, corners%place(:, m), tile)
         end do
      end do
   end subroutine p2g_corners

   !> Add particle m of the chunk, p of the batch, to the nodes from `place` in the tile on.
   pure subroutine add_corners_load(load, weights, m, p, place, tile)
      type(load_t), intent(in) :: load
      type(corner_weights_t), intent(in) :: weights
      integer, intent(in) :: m, p, place(3)
      real(wp), intent(inout) :: tile(node_values, 0:block_size + 1, 0:block_size + 1, 0:block_size + 1)
      real(wp), dimension(half) :: plane, row
      integer :: a, b, c, i, j, k, n, q
      n = 0
      do c = -1, 1
         k = place(3) + 1 + c
         plane = load%momentum(:, 0, m) + c*load%momentum(:, 3, m)
         do b = -1, 1
            j = place(2) + 1 + b
            row = plane + b*load%momentum(:, 2, m)
            do a = -1, 1
               i = place(1) + 1 + a
               n = n + 1
               !$omp simd
               do q = 1, half
                  tile(q, i, j, k) = tile(q, i, j, k) + weights%weight(p, n)*(row(q) &
                        + a*load%momentum(q, 1, m))
               end do
               !$omp simd
               do q = 1, half
                  tile(half + q, i, j, k) = tile(half + q, i, j, k) + (weights%slope(p, n, 1)*load%force(q, &
                     1, m) + (weights%slope(p, n, 2)*load%force(q, 2, m) &
                     + weights%slope(p, n, 3)*load%force(q, 3, m)))
               end do
            end do
         end do
      end do
   end subroutine add_corners_load

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
      integer :: first, m, n, p, particle, node(3)
      do first = 1, cells%count, chunk
         call set_corners(corners, cells, first, column, layout, frame)
         do m = 1, corners%list%count
            p = 1 + mod(m - 1, batch)
            if (p == 1) call set_corner_weights(weights, corners, m, frame%per_cell)
            particle = corners%list%member(m)
            force = column(particle, layout%mass)*acceleration(particle, :)
            do n = 1, 27
               node = corners%place(:, m) + [mod(n - 1, 3), mod((n - 1)/3, 3), (n - 1)/9]
               tile(f_x:f_z, node(1), node(2), node(3)) = tile(f_x:f_z, node(1), node(2), node(3)) &
                                                          + weights%weight(p, n)*force
            end do
         end do
      end do
   end subroutine add_corners_body_force

end module m_p2g_corners
