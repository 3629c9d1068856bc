!> Conditions on the six sides of the grid, applied to node tiles (theory.md, eq. boundary).
!>
!> symmetry  the body continues beyond the plane as its mirror image: the contributions of particles to the
!> node row outside are, mirrored, those of the image to the row inside. So a half model gives the result of
!> the full one.
!> roller    nodes on the plane and outside do not move along its normal.
!> fixed     these nodes do not move at all.
module m_boundary
   use m_kinds, only: wp
   use m_constants, only: block_size
   use m_side_kinds, only: side_kinds
   use m_grid_level, only: grid_level_t
   implicit none
   private
   public :: fold_symmetry, apply_boundary, has_boundary, held_components, inside, mirror_means, &
             motion_parity, stress_parity

   integer, parameter :: last = block_size + 1 ! tiles run from 0 to here
   integer, parameter :: first_vector = 2, second_vector = 5 !< index of the first component of the two
                                                             !< vectors of a node (momentum, force)
   !> Parity of node values under reflection in each axis: mass, momentum, force, spare (and so volume, volume
   !> times position); and volume, the six components of volume times stress, spare.
   real(wp), parameter :: motion_parity(8, 3) = &
      reshape([1, -1, 1, 1, -1, 1, 1, 1, 1, 1, -1, 1, 1, -1, 1, 1, 1, 1, 1, -1, 1, 1, -1, 1], [8, 3])
   real(wp), parameter :: stress_parity(8, 3) = &
      reshape([1, 1, 1, 1, 1, -1, -1, 1, 1, 1, 1, 1, -1, 1, -1, 1, 1, 1, 1, 1, -1, -1, 1, 1], [8, 3])

contains

   !> Before the sum over blocks: add the values of nodes outside a symmetry plane to their mirror nodes
   !> inside.
   pure subroutine fold_symmetry(grid, place, tile, parity)
      type(grid_level_t), intent(in) :: grid
      integer, intent(in) :: place(3)
      real(wp), intent(inout), contiguous :: tile(:, 0:, 0:, 0:)
      real(wp), intent(in) :: parity(:, :) !< motion_parity or stress_parity
      integer :: axis, side, plane, out(3), in(3), u, v
      do axis = 1, 3
         do side = 1, 2
            if (.not. side_kinds(grid%boundary(side, axis))%mirrors) cycle
            plane = grid%plane(place, side, axis)
            if (plane < 1 .or. plane > last - 1) cycle
            do v = first_v(grid, axis), last_v(grid, axis)
               do u = first_u(grid, axis), last_u(grid, axis)
                  out = row_node(axis, plane + outward(side), u, v)
                  in = row_node(axis, plane - outward(side), u, v)
                  tile(:, in(1), in(2), in(3)) = tile(:, in(1), in(2), in(3)) &
                                                 + parity(:, axis)*tile(:, out(1), out(2), out(3))
                  tile(:, out(1), out(2), out(3)) = 0.0_wp
               end do
            end do
         end do
      end do
   end subroutine fold_symmetry

   !> After the nodal solve: fix the constrained components, then set the row outside a symmetry plane to the
   !> mirror of the row inside, which is on the opposite side of a grid of one cell.
   pure subroutine apply_boundary(grid, place, tile)
      type(grid_level_t), intent(in) :: grid
      integer, intent(in) :: place(3)
      real(wp), intent(inout), contiguous :: tile(:, 0:, 0:, 0:)
      integer :: axis, side, plane, on(3), out(3), u, v
      logical :: has_outside
      do axis = 1, 3
         do side = 1, 2
            plane = grid%plane(place, side, axis)
            if (plane < 0) cycle
            has_outside = plane + outward(side) >= 0 .and. plane + outward(side) <= last &
                          .and. .not. side_kinds(grid%boundary(side, axis))%mirrors
            do v = first_v(grid, axis), last_v(grid, axis)
               do u = first_u(grid, axis), last_u(grid, axis)
                  on = row_node(axis, plane, u, v)
                  call hold(grid%boundary(side, axis), axis, tile(:, on(1), on(2), on(3)))
                  if (.not. has_outside) cycle
                  out = row_node(axis, plane + outward(side), u, v)
                  call hold(grid%boundary(side, axis), axis, tile(:, out(1), out(2), out(3)))
               end do
            end do
         end do
         call mirror_rows(grid, place, axis, motion_parity(:, axis), tile)
      end do
   end subroutine apply_boundary

   !> Set the rows outside of symmetry planes across an axis to the mirror images of the rows inside.
   pure subroutine mirror_rows(grid, place, axis, parity, tile)
      type(grid_level_t), intent(in) :: grid
      integer, intent(in) :: place(3), axis
      real(wp), intent(in) :: parity(:) !< across the axis
      real(wp), intent(inout), contiguous :: tile(:, 0:, 0:, 0:)
      integer :: side, plane, out(3), in(3), u, v
      do side = 1, 2
         if (.not. side_kinds(grid%boundary(side, axis))%mirrors) cycle
         plane = grid%plane(place, side, axis)
         if (plane < 1 .or. plane > last - 1) cycle
         do v = first_v(grid, axis), last_v(grid, axis)
            do u = first_u(grid, axis), last_u(grid, axis)
               out = row_node(axis, plane + outward(side), u, v)
               in = row_node(axis, plane - outward(side), u, v)
               tile(:, out(1), out(2), out(3)) = parity*tile(:, in(1), in(2), in(3))
            end do
         end do
      end do
   end subroutine mirror_rows

   !> True when apply_boundary would change the tile of a block.
   pure logical function has_boundary(grid, place)
      type(grid_level_t), intent(in) :: grid
      integer, intent(in) :: place(3)
      integer :: axis, side
      has_boundary = .false.
      do axis = 1, 3
         do side = 1, 2
            has_boundary = has_boundary .or. grid%plane(place, side, axis) >= 0
         end do
      end do
   end function has_boundary

   !> After the sum: shear across a symmetry plane vanishes on it, and the row outside is the mirror of the
   !> row inside.
   pure subroutine mirror_means(grid, place, tile, parity)
      type(grid_level_t), intent(in) :: grid
      integer, intent(in) :: place(3)
      real(wp), intent(inout), contiguous :: tile(:, 0:, 0:, 0:)
      real(wp), intent(in) :: parity(:, :) !< motion_parity or stress_parity
      integer :: axis, side, plane, on(3), u, v
      do axis = 1, 3
         do side = 1, 2
            if (.not. side_kinds(grid%boundary(side, axis))%mirrors) cycle
            plane = grid%plane(place, side, axis)
            if (plane < 0) cycle
            do v = first_v(grid, axis), last_v(grid, axis)
               do u = first_u(grid, axis), last_u(grid, axis)
                  on = row_node(axis, plane, u, v)
                  tile(:, on(1), on(2), on(3)) = 0.5_wp*(1.0_wp + parity(:, axis)) &
                     *tile(:, on(1), on(2), on(3))
               end do
            end do
         end do
         call mirror_rows(grid, place, axis, parity(:, axis), tile)
      end do
   end subroutine mirror_means

   !> Range of (u, v) in `row_node`: for a section's tile one row along y.
   pure integer function first_u(grid, axis)
      type(grid_level_t), intent(in) :: grid
      integer, intent(in) :: axis
      first_u = merge(grid%rows(1), 0, axis == 1)
   end function first_u

   pure integer function last_u(grid, axis)
      type(grid_level_t), intent(in) :: grid
      integer, intent(in) :: axis
      last_u = merge(grid%rows(2), last, axis == 1)
   end function last_u

   pure integer function first_v(grid, axis)
      type(grid_level_t), intent(in) :: grid
      integer, intent(in) :: axis
      first_v = merge(grid%rows(1), 0, axis == 3)
   end function first_v

   pure integer function last_v(grid, axis)
      type(grid_level_t), intent(in) :: grid
      integer, intent(in) :: axis
      last_v = merge(grid%rows(2), last, axis == 3)
   end function last_v

   !> -1 on the lower side of an axis, 1 on the upper.
   pure integer function outward(side)
      integer, intent(in) :: side
      outward = 2*side - 3
   end function outward

   !> Tile indices of node (u, v) of the row `row` across an axis.
   pure function row_node(axis, row, u, v) result(node)
      integer, intent(in) :: axis, row, u, v
      integer :: node(3)
      select case (axis)
      case (1); node = [row, u, v]
      case (2); node = [u, row, v]
      case default; node = [u, v, row]
      end select
   end function row_node

   !> Fix a node: along the axis, or in all components where the side is fixed.
   pure subroutine hold(boundary, axis, values)
      integer, intent(in) :: boundary, axis
      real(wp), intent(inout) :: values(:)
      if (side_kinds(boundary)%holds_all) then
         values(first_vector:first_vector + 2) = 0.0_wp
         values(second_vector:second_vector + 2) = 0.0_wp
      else
         values(first_vector + axis - 1) = 0.0_wp
         values(second_vector + axis - 1) = 0.0_wp
      end if
   end subroutine hold

   !> Index along an axis (in the whole grid) of the node that represents a node: its mirror image inside
   !> where the node is outside a symmetry plane, else itself.
   pure integer function inside(grid, axis, node)
      type(grid_level_t), intent(in) :: grid
      integer, intent(in) :: axis, node
      integer :: cells
      cells = grid%cells(axis)
      inside = node
      if (node < 0 .and. side_kinds(grid%boundary(1, axis))%mirrors) inside = -node
      if (node > cells .and. side_kinds(grid%boundary(2, axis))%mirrors) inside = 2*cells - node
   end function inside

   !> The fixed components of a node (indices in the whole grid).
   pure function held_components(grid, node) result(held)
      type(grid_level_t), intent(in) :: grid
      integer, intent(in) :: node(3)
      logical :: held(3)
      integer :: axis, side, plane
      held = .false.
      held(2) = grid%section%is_flat() ! no motion across a section
      do axis = 1, 3
         do side = 1, 2
            plane = merge(0, grid%cells(axis), side == 1)
            associate (kind => side_kinds(grid%boundary(side, axis)))
               if (.not. kind%closed) cycle
               if (kind%mirrors) then
                  if (node(axis) == plane) held(axis) = .true.
               else if (merge(node(axis) <= plane, node(axis) >= plane, side == 1)) then
                  held(axis) = .true.
                  if (kind%holds_all) held = .true.
               end if
            end associate
         end do
      end do
   end function held_components

end module m_boundary
