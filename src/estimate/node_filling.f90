!> How much of the volume around nodes is filled by particles. Nodes at free surfaces lack some of it: there
!> the recovered stress uses even weights (theory.md, eq. even).
module m_node_filling
   use m_kinds, only: wp
   use m_constants, only: block_size
   use m_node_values, only: tile_last
   use m_grid_level, only: grid_level_t
   use m_side_kinds, only: side_kinds
   implicit none
   private
   public :: even_share

   real(wp), parameter :: whole = 0.99_wp !< from this filling on a node counts as filled, with a margin for
                                          !< domains that do not tile the body exactly
   real(wp), parameter :: cut = 0.97_wp   !< below it even weights alone count

contains

   !> Share of even weights in the means of a block's nodes: 0 where the cells around the node are filled, 1
   !> at free surfaces, and 0 where there is no particle.
   pure function even_share(grid, place, volume) result(share)
      type(grid_level_t), intent(in) :: grid !< with the mirrors valid for the stress
      integer, intent(in) :: place(3)        !< of the block
      real(wp), intent(in) :: volume(0:, 0:, 0:) !< sums over all particles, m3
      real(wp) :: share(0:tile_last, 0:tile_last, 0:tile_last)
      real(wp) :: along(0:tile_last, 3), filling
      integer :: axis, i, j, k, side, plane
      along = grid%cell
      if (grid%section%is_flat()) then
         along(:, 2) = 1.0_wp
         along(:, 1) = along(:, 1)*depth_at(grid, place(1))
      end if
      do axis = 1, 3
         do side = 1, 2
            if (.not. side_kinds(grid%boundary(side, axis))%mirrors) cycle
            plane = grid%plane(place, side, axis)
            if (plane < 0) cycle
            along(plane, axis) = 0.5_wp*along(plane, axis) ! the other half is in the mirror image
         end do
      end do
      do k = 0, tile_last
         do j = 0, tile_last
            do i = 0, tile_last
               filling = volume(i, j, k)/(along(i, 1)*along(j, 2)*along(k, 3))
               share(i, j, k) = min(max((whole - filling)/(whole - cut), 0.0_wp), 1.0_wp)
               if (.not. volume(i, j, k) > 0.0_wp) share(i, j, k) = 0.0_wp
            end do
         end do
      end do
      if (.not. grid%section%is_round()) return
      plane = grid%plane(place, 1, 1)
      if (plane >= 0 .and. plane < tile_last) share(plane, :, :) = share(plane + 1, :, :) ! on the axis: the
                                                  ! sum over particles is not near enough to the volume there
   end function even_share

   !> Extent normal to a section at the nodes along x, m.
   pure function depth_at(grid, first) result(depth)
      type(grid_level_t), intent(in) :: grid
      integer, intent(in) :: first !< of the block along x
      real(wp) :: depth(0:tile_last)
      integer :: i
      depth = [(grid%section%depth(grid%lower(1) + (block_size*first - 1 + i)*grid%cell), i=0, tile_last)]
      if (grid%section%is_round()) depth = max(depth, grid%section%depth(grid%cell)) ! no 0 on the axis
   end function depth_at

end module m_node_filling
