!> Velocity and acceleration of nodes from their mass, momentum and force (theory.md, eq. nodes).
module m_node_solve
   use m_kinds, only: wp
   use m_constants, only: block_size
   use m_node_values, only: node_values, mass_, p_x, p_z, v_x, v_z, f_x, f_z, a_x, a_z
   implicit none
   private
   public :: solve_nodes


contains

   !> In place: mass, momentum p, force f become mass, velocity p/m + dt f/m, acceleration f/m. Nodes without
   !> mass become zero. There is no mass threshold: weights and their gradients vanish together, so
   !> interpolated values stay bounded.
   pure subroutine solve_nodes(tile, time_step, extent)
      real(wp), intent(inout) :: tile(node_values, 0:block_size + 1, 0:block_size + 1, 0:block_size + 1)
      real(wp), intent(in) :: time_step !< s
      integer, intent(in), optional :: extent(2, 3) !< first and last index along each axis of the nodes with
                                                    !< mass
      real(wp) :: per_mass
      integer :: i, j, k, low(3), high(3)
      low = 0
      high = block_size + 1
      if (present(extent)) low = extent(1, :)
      if (present(extent)) high = extent(2, :)
      do k = low(3), high(3)
         do j = low(2), high(2)
            do i = low(1), high(1)
               if (tile(mass_, i, j, k) > 0.0_wp) then
                  per_mass = 1.0_wp/tile(mass_, i, j, k)
               else
                  per_mass = 0.0_wp
               end if
               tile(a_x:a_z, i, j, k) = tile(f_x:f_z, i, j, k)*per_mass
               tile(v_x:v_z, i, j, k) = tile(p_x:p_z, i, j, k)*per_mass + time_step*tile(a_x:a_z, i, j, k)
            end do
         end do
      end do
   end subroutine solve_nodes

end module m_node_solve
