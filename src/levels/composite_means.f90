!> Means of particle values on the nodes of all levels together (theory.md, eq. recovered): the sums of
!> constrained nodes at an edge are restricted, and their means are prolonged from the nodes that they depend
!> on.
module m_composite_means
   use m_kinds, only: wp
   use m_node_values, only: node_values, tile_last
   use m_communicator, only: communicator_t
   use m_level, only: level_t
   use m_composite, only: composite_t
   use m_edge, only: restrict, restrict_arms, prolong, prolong_motion, add_patches
   implicit none
   private
   public :: add_from_finer, take_from_coarser

contains

   !> Collective: add the sums of the constrained nodes of the finer of two levels to the tiles of the coarser
   !> one, before its sums over blocks.
   subroutine add_from_finer(composite, communicator, fine, sums, arm, tiles)
      type(composite_t), intent(inout) :: composite !< of the two levels
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(in) :: fine
      real(wp), intent(in) :: sums(node_values, 0:tile_last, 0:tile_last, 0:tile_last, *) !< of the finer one
      real(wp), intent(in) :: arm !< the finer cell size (m) where values 2 to 4 are volume times a position
                                  !< relative to the node; else 0
      real(wp), intent(inout) :: tiles(node_values, 0:tile_last, 0:tile_last, 0:tile_last, *)
      real(wp), allocatable :: patches(:, :, :, :, :)
      integer :: e
      associate (edges => composite%edges)
         allocate (patches, mold=composite%up)
         patches = 0.0_wp
         do e = 1, composite%own
            call restrict(edges(e), sums(:, :, :, :, edges(e)%block), 1, node_values, 1, &
                          patches(:, :, :, :, e))
            if (arm > 0.0_wp) &
               call restrict_arms(edges(e), sums(:, :, :, :, edges(e)%block), arm, patches(:, :, :, :, e))
         end do
         call composite%exchange%exchange(communicator, patches, upwards=.true.)
         call add_patches(edges, composite%by_index, patches, tiles, 1, 1, node_values)
      end associate
   end subroutine add_from_finer

   !> Collective: set the means of the constrained nodes of the finer of two levels from the means of the
   !> coarser level's nodes.
   subroutine take_from_coarser(composite, communicator, means, tiles)
      type(composite_t), intent(inout) :: composite !< of the two levels
      type(communicator_t), intent(in) :: communicator
      real(wp), intent(in) :: means(node_values, 0:tile_last, 0:tile_last, 0:tile_last, *) !< of the coarser
      real(wp), intent(inout) :: tiles(node_values, 0:tile_last, 0:tile_last, 0:tile_last, *) !< means, of the
                                                                                            !< finer level
      real(wp), allocatable :: patches(:, :, :, :, :)
      integer :: e
      associate (edges => composite%edges)
         allocate (patches, mold=composite%up)
         patches = 0.0_wp
         do e = 1, size(edges)
            if (edges(e)%parent == 0) cycle
            call prolong_motion(edges(e), means(:, :, :, :, edges(e)%parent), patches(:, :, :, :, e))
         end do
         call composite%exchange%exchange(communicator, patches, upwards=.false.)
         do e = 1, composite%own
            call prolong(edges(e), patches(:, :, :, :, e), 2, node_values, tiles(:, :, :, :, edges(e)%block))
         end do
      end associate
   end subroutine take_from_coarser

end module m_composite_means
