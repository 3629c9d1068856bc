!> The map of a composite space without staggering in time, as in quasi-static steps: displacements of
!> constrained nodes are prolonged from the coarser level, and their forces are restricted to it (theory.md,
!> eqs constrained, static-levels).
module m_static_edges
   use m_kinds, only: wp
   use m_node_values, only: v_x, v_z, f_x, f_z
   use m_communicator, only: communicator_t
   use m_edge, only: prolong_motion, prolong, restrict, add_patches
   use m_composite, only: composite_t
   implicit none
   private
   public :: prolong_to, set_hanging, restrict_to, take_up

contains

   !> Collective: copy the motion of the coarser level's nodes, from the tiles of its own blocks, to the
   !> patches.
   subroutine prolong_to(composite, communicator, tiles)
      class(composite_t), intent(inout) :: composite
      type(communicator_t), intent(in) :: communicator
      real(wp), intent(in), contiguous :: tiles(:, 0:, 0:, 0:, :)
      integer :: c
      composite%down = 0.0_wp
      composite%lag_velocity = 0.0_wp ! gradients have no lead here
      do c = 1, size(composite%by_index)
         associate (edge => composite%edges(composite%by_index(c)))
            call prolong_motion(edge, tiles(:, :, :, :, edge%parent), &
                                composite%down(:, :, :, :, composite%by_index(c)))
         end associate
      end do
      call composite%exchange%exchange(communicator, composite%down, upwards=.false.)
   end subroutine prolong_to

   !> Set the motion of the constrained nodes of all own blocks of the finer level from the patches.
   pure subroutine set_hanging(composite, tiles)
      class(composite_t), intent(in) :: composite
      real(wp), intent(inout), contiguous :: tiles(:, 0:, 0:, 0:, :)
      integer :: e
      do e = 1, composite%own
         associate (edge => composite%edges(e))
            call prolong(edge, composite%down(:, :, :, :, e), v_x, v_z, tiles(:, :, :, :, edge%block))
         end associate
      end do
   end subroutine set_hanging

   !> Collective: restrict forces on constrained nodes to the patches; `tiles` of the finer level hold sums.
   !> `diagonal`: they are a diagonal of the stiffness, which contains weights twice.
   subroutine restrict_to(composite, communicator, tiles, diagonal)
      class(composite_t), intent(inout) :: composite
      type(communicator_t), intent(in) :: communicator
      real(wp), intent(in), contiguous :: tiles(:, 0:, 0:, 0:, :)
      logical, intent(in) :: diagonal
      integer :: e
      do e = 1, composite%own
         associate (edge => composite%edges(e))
            composite%up(:, :, :, :, e) = 0.0_wp
            call restrict(edge, tiles(:, :, :, :, edge%block), f_x, f_z, merge(2, 1, diagonal), &
                          composite%up(:, :, :, :, e))
         end associate
      end do
      call composite%exchange%exchange(communicator, composite%up, upwards=.true.)
   end subroutine restrict_to

   !> Add the patches to the forces in own tiles of the coarser level, before their sum over blocks.
   pure subroutine take_up(composite, tiles)
      class(composite_t), intent(in) :: composite
      real(wp), intent(inout), contiguous :: tiles(:, 0:, 0:, 0:, :)
      call add_patches(composite%edges, composite%by_index, composite%up, tiles, f_x, f_x, 3)
   end subroutine take_up

end module m_static_edges
