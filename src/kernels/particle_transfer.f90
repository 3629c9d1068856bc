!> Between particles and nodes, by the kernels that serve the domains the particles have: boxes along the axes, whose weights are
!> products, or parallelepipeds (theory.md, eqs weights, corners). Another kind of domain is another branch in each of these three.
module m_particle_transfer
   use m_kinds, only: wp
   use m_constants, only: block_size
   use m_field_table, only: layout_t
   use m_cell_list, only: cell_list_t
   use m_stencil, only: frame_t
   use m_particle_to_node, only: add_to_nodes, gather_body_force
   use m_node_to_particle, only: scatter_to_particles, motion_t, longest_t
   use m_corner_to_node, only: add_corners_to_nodes, gather_corners_body_force
   use m_corner_to_particle, only: scatter_to_corners
   implicit none
   private
   public :: particles_to_nodes, body_force_to_nodes, nodes_to_particles

   integer, parameter :: lanes = 8 !< values a node: mass, momentum or velocity (3), force or acceleration (3), spare

contains

   !> Add to a block's node tile what the listed particles give: mass, momentum, force (eq. to-nodes).
   pure subroutine particles_to_nodes(cells, column, layout, frame, tile)
      type(cell_list_t), intent(in) :: cells
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      type(frame_t), intent(in) :: frame
      real(wp), intent(inout) :: tile(lanes, 0:block_size + 1, 0:block_size + 1, 0:block_size + 1)
      if (layout%domain > 0) then
         call add_corners_to_nodes(cells, column, layout, frame, tile)
      else
         call add_to_nodes(cells, column, layout, frame, tile)
      end if
   end subroutine particles_to_nodes

   !> Add to the forces of a block's node tile a body force per mass of each listed particle.
   pure subroutine body_force_to_nodes(cells, column, layout, frame, acceleration, tile)
      type(cell_list_t), intent(in) :: cells
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      type(frame_t), intent(in) :: frame
      real(wp), intent(in), contiguous :: acceleration(:, :) !< (:, 3), m/s2
      real(wp), intent(inout) :: tile(lanes, 0:block_size + 1, 0:block_size + 1, 0:block_size + 1)
      if (layout%domain > 0) then
         call gather_corners_body_force(cells, column, layout, frame, acceleration, tile)
      else
         call gather_body_force(cells, column, layout, frame, acceleration, tile)
      end if
   end subroutine body_force_to_nodes

   !> Move the listed particles with a node tile; their velocity gradients go into `gradient`, d v_i / d x_j at 3 (j-1) + i (eq.
   !> to-particles).
   pure subroutine nodes_to_particles(cells, tile, layout, frame, motion, column, gradient, longest)
      type(cell_list_t), intent(in) :: cells
      real(wp), intent(in) :: tile(lanes, 0:block_size + 1, 0:block_size + 1, 0:block_size + 1)
      type(layout_t), intent(in) :: layout
      type(frame_t), intent(in) :: frame
      type(motion_t), intent(in) :: motion
      real(wp), intent(inout), contiguous :: column(:, :), gradient(:, :)
      type(longest_t), intent(inout), optional :: longest
      if (layout%domain > 0) then
         call scatter_to_corners(cells, tile, layout, frame, motion, column, gradient, longest)
      else
         call scatter_to_particles(cells, tile, layout, frame, motion, column, gradient, longest)
      end if
   end subroutine nodes_to_particles

end module m_particle_transfer
