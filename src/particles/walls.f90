!> Particles beyond a side of the grid that the material cannot pass (parts of split particles, or particles
!> pushed there): a domain may reach over the side, a centre may not (theory.md, Splitting).
module m_walls
   use m_kinds, only: wp
   use m_side_kinds, only: side_kinds
   use m_field_table, only: layout_t, shares_t
   use m_grid_level, only: grid_level_t
   implicit none
   private
   public :: keep_inside

contains

   !> Replace a particle beyond a closed side by its mirror image: at a symmetry side both are the same
   !> material. The mirror reverses components of position, velocity and its gradient, stress, deformation,
   !> domain and carried faces; other state of laws is nearly even there.
   pure subroutine keep_inside(values, layout, shares, grid)
      real(wp), intent(inout) :: values(:) !< columns of one particle
      type(layout_t), intent(in) :: layout
      type(shares_t), intent(in) :: shares
      type(grid_level_t), intent(in) :: grid
      real(wp) :: side
      integer :: axis, f, k
      do axis = 1, 3
         associate (x => values(layout%position + axis - 1))
            if (x < grid%lower(axis) .and. side_kinds(grid%boundary(1, axis))%closed) then
               side = grid%lower(axis)
            else if (x > grid%upper(axis) .and. side_kinds(grid%boundary(2, axis))%closed) then
               side = grid%upper(axis)
            else
               cycle
            end if
            x = 2.0_wp*side - x
         end associate
         if (layout%start > 0) values(layout%start + axis - 1) = 2.0_wp*side - values(layout%start + axis - 1)
         if (layout%motion > 0) call turn_tensor(values(layout%motion:layout%motion + 8), axis)
         call turn(values(layout%velocity:layout%velocity + 2), axis)
         ! the edge along the axis is reversed too: a domain is symmetric
         if (layout%domain > 0) call turn_tensor(values(layout%domain:layout%domain + 8), axis)
         if (layout%gradient > 0) call turn_tensor(values(layout%gradient:layout%gradient + 8), axis)
         if (layout%deformation > 0) call turn_tensor(values(layout%deformation:layout%deformation + 8), axis)
         do k = 1, 3 ! yz xz xy
            if (k == axis) cycle
            values(layout%stress + 2 + k) = -values(layout%stress + 2 + k)
            if (layout%edge_stress > 0) values(layout%edge_stress + 2 + k) = &
               -values(layout%edge_stress + 2 + k)
         end do
         do f = 1, size(shares%faces, 2)
            do k = 1, 2
               call turn(values(shares%faces(k, f):shares%faces(k, f) + 2), axis)
            end do
         end do
      end do
   end subroutine keep_inside

   pure subroutine turn(vector, axis)
      real(wp), intent(inout) :: vector(3)
      integer, intent(in) :: axis
      vector(axis) = -vector(axis)
   end subroutine turn

   !> Reverse the components that have the axis once.
   pure subroutine turn_tensor(tensor, axis)
      real(wp), intent(inout) :: tensor(3, 3)
      integer, intent(in) :: axis
      tensor(axis, :) = -tensor(axis, :)
      tensor(:, axis) = -tensor(:, axis)
   end subroutine turn_tensor

end module m_walls
