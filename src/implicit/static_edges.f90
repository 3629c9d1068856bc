!> The map of a composite space where nothing is staggered in time, as in quasi-static steps: constrained
!> nodes take their displacements from the coarser level, and hand forces up to it (theory.md, eqs
!> constrained, static-levels).
module m_static_edges
   use m_kinds, only: wp
   use m_node_values, only: node_values, tile_last, v_x, v_z, f_x, f_z
   use m_communicator, only: communicator_t
   use m_edge, only: edge_t, prolong_motion, coarse_nodes, add_patches, patch_last
   use m_composite, only: composite_t
   implicit none
   private
   public :: prolong_to, set_hanging, restrict_to, take_up

contains

   !> Collective: what moves the nodes of the coarser level, in the tiles of its own blocks, to the patches.
   subroutine prolong_to(composite, communicator, tiles)
      class(composite_t), intent(inout) :: composite
      type(communicator_t), intent(in) :: communicator
      real(wp), intent(in), contiguous :: tiles(:, 0:, 0:, 0:, :)
      integer :: c
      associate (r => composite%rows)
         composite%down(:, :, r(1):min(r(2), patch_last), :, :) = 0.0_wp
         composite%lag_velocity(:, :, r(1):r(2), :, :) = 0.0_wp ! gradients are ahead of nothing here
      end associate
      do c = 1, size(composite%by_index)
         associate (edge => composite%edges(composite%by_index(c)))
            call prolong_motion(edge, tiles(:, :, :, :, edge%parent), &
                                composite%down(:, :, :, :, composite%by_index(c)))
         end associate
      end do
      call composite%exchange%exchange(communicator, composite%down, upwards=.false.)
   end subroutine prolong_to

   !> The constrained nodes of all own blocks of the finer level move as the patches say.
   pure subroutine set_hanging(composite, tiles)
      class(composite_t), intent(in) :: composite
      real(wp), intent(inout), contiguous :: tiles(:, 0:, 0:, 0:, :)
      integer :: a, e, low(3), high(3), i, j, k, s
      real(wp) :: share, motion(3)
      do e = 1, composite%own
         associate (edge => composite%edges(e))
            do s = 1, size(edge%constrained, 2)
               call coarse_nodes(edge%constrained(:3, s), low, high, share)
               motion = 0.0_wp
               do k = low(3), high(3)
                  do j = low(2), high(2)
                     do i = low(1), high(1)
                        motion = motion + share*composite%down(v_x:v_z, i, j, k, e)
                     end do
                  end do
               end do
               associate (at => edge%constrained(:3, s))
                  do a = 1, 3
                     tiles(v_x + a - 1, at(1), at(2), at(3), edge%block) = motion(a)
                  end do
               end associate
            end do
         end associate
      end do
   end subroutine set_hanging

   !> Collective: forces that constrained nodes have been given to the patches; `tiles` of the finer level
   !> hold sums. `diagonal`: they are a diagonal of the stiffness, which weights enter twice.
   subroutine restrict_to(composite, communicator, tiles, diagonal)
      class(composite_t), intent(inout) :: composite
      type(communicator_t), intent(in) :: communicator
      real(wp), intent(in), contiguous :: tiles(:, 0:, 0:, 0:, :)
      logical, intent(in) :: diagonal
      integer :: e
      do e = 1, composite%own
         associate (edge => composite%edges(e))
            call hand_up_edge(edge, tiles(:, :, :, :, edge%block), diagonal, composite%up(:, :, :, :, e))
         end associate
      end do
      call composite%exchange%exchange(communicator, composite%up, upwards=.true.)
   end subroutine restrict_to

   pure subroutine hand_up_edge(edge, tile, diagonal, patch)
      type(edge_t), intent(in) :: edge
      real(wp), intent(in) :: tile(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      logical, intent(in) :: diagonal
      real(wp), intent(inout), contiguous :: patch(:, 0:, 0:, 0:)
      integer :: low(3), high(3), i, j, k, s
      real(wp) :: share, force(3)
      patch(:, :, edge%rows(1):edge%rows(2), :) = 0.0_wp
      do s = 1, size(edge%constrained, 2)
         if (edge%constrained(4, s) == 0) cycle
         associate (at => edge%constrained(:3, s))
            call coarse_nodes(at, low, high, share)
            if (diagonal) share = share**2
            force = share*tile(f_x:f_z, at(1), at(2), at(3))
         end associate
         do k = low(3), high(3)
            do j = low(2), high(2)
               do i = low(1), high(1)
                  patch(f_x:f_z, i, j, k) = patch(f_x:f_z, i, j, k) + force
               end do
            end do
         end do
      end do
   end subroutine hand_up_edge

   !> The patches to the forces in own tiles of the coarser level, before their sum over blocks.
   pure subroutine take_up(composite, tiles)
      class(composite_t), intent(in) :: composite
      real(wp), intent(inout), contiguous :: tiles(:, 0:, 0:, 0:, :)
      call add_patches(composite%edges, composite%by_index, composite%up, tiles, f_x, f_x, 3)
   end subroutine take_up

end module m_static_edges
