!> Nodes turn what they were given into velocity and acceleration (theory.md, eq. nodes).
module m_node_solve
   use m_kinds, only: wp
   use m_constants, only: block_size
   implicit none
   private
   public :: solve_nodes

   integer, parameter :: lanes = 8 !< values a node: mass, momentum or velocity (3), force or acceleration (3), spare

contains

   !> In place: mass, momentum p, force f become mass, velocity p/m + dt f/m, acceleration f/m. Nodes without mass become zero.
   !> There is no mass threshold: weights and their slopes vanish together, so what a particle takes back stays bounded.
   pure subroutine solve_nodes(tile, time_step, reach)
      real(wp), intent(inout) :: tile(lanes, 0:block_size + 1, 0:block_size + 1, 0:block_size + 1)
      real(wp), intent(in) :: time_step !< s
      integer, intent(in), optional :: reach(2, 3) !< first and last index along each axis of the nodes with mass
      real(wp) :: per_mass
      integer :: i, j, k, low(3), high(3)
      low = 0
      high = block_size + 1
      if (present(reach)) low = reach(1, :)
      if (present(reach)) high = reach(2, :)
      do k = low(3), high(3)
         do j = low(2), high(2)
            do i = low(1), high(1)
               if (tile(1, i, j, k) > 0.0_wp) then
                  per_mass = 1.0_wp/tile(1, i, j, k)
               else
                  per_mass = 0.0_wp
               end if
               tile(5:7, i, j, k) = tile(5:7, i, j, k)*per_mass
               tile(2:4, i, j, k) = tile(2:4, i, j, k)*per_mass + time_step*tile(5:7, i, j, k)
            end do
         end do
      end do
   end subroutine solve_nodes

end module m_node_solve
