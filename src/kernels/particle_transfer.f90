!> P2G and G2P with the kernels for the scene's kind of domain: boxes along the axes, whose weights are
!> products, or parallelepipeds (theory.md, eqs weights, corners); or for the nine nodes of a section's plane.
!> Another kind of domain is another branch in each of these three.
module m_particle_transfer
   use m_kinds, only: wp
   use m_constants, only: block_size
   use m_node_values, only: node_values
   use m_field_table, only: layout_t
   use m_cell_list, only: cell_list_t
   use m_stencil, only: frame_t
   use m_p2g_boxes, only: p2g_boxes, add_body_force
   use m_g2p_boxes, only: g2p_boxes, motion_t, fastest_t
   use m_p2g_corners, only: p2g_corners, add_corners_body_force
   use m_g2p_corners, only: g2p_corners
   use m_plane_transfer, only: p2g_plane, g2p_plane
   implicit none
   private
   public :: p2g, p2g_body_force, g2p


contains

   !> Add mass, momentum and force of the listed particles to a block's node tile (eq. to-nodes).
   pure subroutine p2g(cells, column, layout, frame, tile)
      type(cell_list_t), intent(in) :: cells
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      type(frame_t), intent(in) :: frame
      real(wp), intent(inout) :: tile(node_values, 0:block_size + 1, 0:block_size + 1, 0:block_size + 1)
      if (layout%section%is_flat()) then
         call p2g_plane(cells, column, layout, frame, tile)
      else if (layout%domain > 0) then
         call p2g_corners(cells, column, layout, frame, tile)
      else
         call p2g_boxes(cells, column, layout, frame, tile)
      end if
   end subroutine p2g

   !> Add a body force per mass of each listed particle to the forces of a block's node tile.
   pure subroutine p2g_body_force(cells, column, layout, frame, acceleration, tile)
      type(cell_list_t), intent(in) :: cells
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      type(frame_t), intent(in) :: frame
      real(wp), intent(in), contiguous :: acceleration(:, :) !< (:, 3), m/s2
      real(wp), intent(inout) :: tile(node_values, 0:block_size + 1, 0:block_size + 1, 0:block_size + 1)
      if (layout%domain > 0) then
         call add_corners_body_force(cells, column, layout, frame, acceleration, tile)
      else
         call add_body_force(cells, column, layout, frame, acceleration, tile)
      end if
   end subroutine p2g_body_force

   !> Move the listed particles with a node tile; their velocity gradients go into `gradient`, d v_i / d x_j
   !> at 3 (j-1) + i (eq. to-particles).
   pure subroutine g2p(cells, tile, layout, frame, motion, column, gradient, fastest)
      type(cell_list_t), intent(in) :: cells
      real(wp), intent(in) :: tile(node_values, 0:block_size + 1, 0:block_size + 1, 0:block_size + 1)
      type(layout_t), intent(in) :: layout
      type(frame_t), intent(in) :: frame
      type(motion_t), intent(in) :: motion
      real(wp), intent(inout), contiguous :: column(:, :), gradient(:, :)
      type(fastest_t), intent(inout), optional :: fastest
      if (layout%section%is_flat()) then
         call g2p_plane(cells, tile, layout, frame, motion, column, gradient, fastest)
      else if (layout%domain > 0) then
         call g2p_corners(cells, tile, layout, frame, motion, column, gradient, fastest)
      else
         call g2p_boxes(cells, tile, layout, frame, motion, column, gradient, fastest)
      end if
   end subroutine g2p

end module m_particle_transfer
