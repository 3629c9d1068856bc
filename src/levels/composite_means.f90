!> Means of what particles carry on the nodes of all levels together (theory.md, eq. recovered): the
!> constrained nodes of an edge hand up what they were given, and have the means of the nodes that they depend
!> on.
module m_composite_means
   use m_kinds, only: wp
   use m_node_values, only: node_values, tile_last
   use m_communicator, only: communicator_t
   use m_level, only: level_t
   use m_composite, only: composite_t
   use m_edge, only: restrict_to, take_means, patch_last
   implicit none
   private
   public :: add_from_finer, take_from_coarser

contains

   !> Collective: add to the tiles of the coarser level of two, before its sums over blocks, what the
   !> constrained nodes of the finer one hold.
   subroutine add_from_finer(composite, communicator, fine, sums, arm, tiles)
      type(composite_t), intent(inout) :: composite !< of the two levels
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(in) :: fine
      real(wp), intent(in) :: sums(node_values, 0:tile_last, 0:tile_last, 0:tile_last, *) !< of the finer one
      real(wp), intent(in) :: arm !< as in `restrict_to`, m
      real(wp), intent(inout) :: tiles(node_values, 0:tile_last, 0:tile_last, 0:tile_last, *)
      real(wp), allocatable :: patches(:, :, :, :, :)
      integer :: c, e
      associate (edges => composite%edges)
         allocate (patches(composite%values, 0:patch_last, 0:patch_last, 0:patch_last, size(edges)), &
                   source=0.0_wp)
         do e = 1, composite%own
            call restrict_to(edges(e), sums(:, :, :, :, edges(e)%block), arm, patches(:, :, :, :, e))
         end do
         call composite%exchange%exchange(communicator, patches, upwards=.true.)
         do c = 1, size(composite%by_index)
            e = composite%by_index(c)
            associate (a => edges(e)%corner, z => edges(e)%corner + patch_last, b => edges(e)%parent)
               tiles(:, a(1):z(1), a(2):z(2), a(3):z(3), b) = tiles(:, a(1):z(1), a(2):z(2), a(3):z(3), b) &
                                                              + patches(:node_values, :, :, :, e)
            end associate
         end do
      end associate
   end subroutine add_from_finer

   !> Collective: the constrained nodes of the finer level of two have the means of the coarser level's nodes.
   subroutine take_from_coarser(composite, communicator, means, tiles)
      type(composite_t), intent(inout) :: composite !< of the two levels
      type(communicator_t), intent(in) :: communicator
      real(wp), intent(in) :: means(node_values, 0:tile_last, 0:tile_last, 0:tile_last, *) !< of the coarser
      real(wp), intent(inout) :: tiles(node_values, 0:tile_last, 0:tile_last, 0:tile_last, *) !< means, of the
                                                                                            !< finer level
      real(wp), allocatable :: patches(:, :, :, :, :)
      integer :: e
      associate (edges => composite%edges)
         allocate (patches(composite%values, 0:patch_last, 0:patch_last, 0:patch_last, size(edges)), &
                   source=0.0_wp)
         do e = 1, size(edges)
            if (edges(e)%parent == 0) cycle
            associate (a => edges(e)%corner, z => edges(e)%corner + patch_last)
               patches(:node_values, :, :, :, e) = means(:, a(1):z(1), a(2):z(2), a(3):z(3), edges(e)%parent)
            end associate
         end do
         call composite%exchange%exchange(communicator, patches, upwards=.false.)
         do e = 1, composite%own
            call take_means(edges(e), patches(:, :, :, :, e), tiles(:, :, :, :, edges(e)%block))
         end do
      end associate
   end subroutine take_from_coarser

end module m_composite_means
