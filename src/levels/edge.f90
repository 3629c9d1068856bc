!> A block of the finer level of two whose tile holds slaves: which these are, what they give to the nodes that they depend on, and
!> how they follow them (theory.md, eqs constrained, restriction, affine-edge, lead).
!>
!> All slaves of a block depend on 6 x 6 x 6 nodes of the coarser level, a cube, which lies in the tile of one block there, its
!> parent. The values of a node in a cube are those of a node in a tile; where there are labels and gradients, three more.
module m_edge
   use m_kinds, only: wp
   use m_constants, only: block_size
   use m_grid_level, only: grid_level_t
   use m_region, only: region_t
   use m_level, only: level_t, tile_last, node_values
   use m_boundary, only: constrain_nodes, is_constrained, fold_symmetry, motion_parity
   use m_cell_list, only: bins_at
   use m_field_table, only: layout_t
   use m_particle_transfer, only: particles_to_nodes
   use m_migration, only: frame_of
   implicit none
   private
   public :: edge_t, has_slaves, list_slaves, gather_slaves, take_lead, take_cube, take_leads, set_motion, set_leads

   integer, parameter, public :: cube_last = 5 !< cubes run from 0 to here
   integer, parameter, public :: lead_first = node_values + 1, lead_last = node_values + 3 !< going up the force that has grown,
                                                                                           !< down how far gradients are to be ahead
   real(wp), parameter :: shares(0:3) = [1.0_wp, 0.5_wp, 0.25_wp, 0.125_wp] !< of a slave that lies between nodes along so many axes
   real(wp), parameter :: barely = 1.0e-9_wp    !< a node with this share of the mass of the next has none

   !> A block of the finer level with slaves, seen from the rank of the block or of its parent.
   type :: edge_t
      integer :: block = 0     !< its number here, 0 where only its parent is
      integer :: index = 0     !< its number on the finer level
      integer :: parent = 0    !< number of its parent here, 0 where only the block is
      integer :: corner(3) = 0 !< of the cube in the parent's tile
      integer, allocatable :: slave(:, :) !< places (3) of the slaves in the tile, and 1 where this block hands the slave up, else 0
   end type edge_t

contains

   !> True when the tile of a block holds nodes that are not inside the region.
   pure logical function has_slaves(region, place)
      type(region_t), intent(in) :: region
      integer, intent(in) :: place(3) !< of the block
      has_slaves = .not. (region%is_inner(block_size*place - 1) .and. region%is_inner(block_size*(place + 1)))
   end function has_slaves

   !> The slaves in the tile of a block. Of the blocks whose tiles hold a slave, the one that it belongs to hands it up, or if that
   !> does not exist the one with the lowest index.
   subroutine list_slaves(edge, fine, place)
      type(edge_t), intent(inout) :: edge
      type(level_t), intent(in) :: fine
      integer, intent(in) :: place(3)
      integer :: all_slaves(4, (tile_last + 1)**3), i, j, k, n
      n = 0
      do k = 0, tile_last
         do j = 0, tile_last
            do i = 0, tile_last
               if (fine%region%is_inner(block_size*place + [i, j, k] - 1)) cycle
               n = n + 1
               all_slaves(:, n) = [i, j, k, merge(1, 0, hands_up(block_size*place + [i, j, k] - 1))]
            end do
         end do
      end do
      edge%slave = all_slaves(:, :n)
   contains
      !> True when this block is the one that hands the node up.
      logical function hands_up(node)
         integer, intent(in) :: node(3)
         integer :: home(3), low(3), high(3), x, y, z
         home = (node - modulo(node, block_size))/block_size
         hands_up = all(home == place)
         if (hands_up .or. fine%owner_at(home) >= 0) return
         low = home - merge(1, 0, modulo(node, block_size) == 0)
         high = home + merge(1, 0, modulo(node, block_size) == block_size - 1)
         do z = low(3), high(3)
            do y = low(2), high(2)
               do x = low(1), high(1)
                  if (fine%owner_at([x, y, z]) < 0) cycle
                  hands_up = all([x, y, z] == place)
                  return
               end do
            end do
         end do
      end function hands_up
   end subroutine list_slaves

   !> One block's slaves to its cube. With affine transfer the momentum is made for the place of the coarser node, with the slope of
   !> the slaves' velocities along the edge (theory.md, eq. affine-edge).
   subroutine gather_slaves(edge, grid, place, tile, affine, cube)
      type(edge_t), intent(in) :: edge
      type(grid_level_t), intent(in) :: grid
      integer, intent(in) :: place(3) !< of the block
      real(wp), intent(in) :: tile(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      logical, intent(in) :: affine
      real(wp), intent(out), contiguous :: cube(:, 0:, 0:, 0:)
      real(wp) :: held(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      if (affine .and. is_constrained(grid, place)) then ! slopes are taken with what is held, and with the mirror images outside
         held = tile
         call constrain_nodes(grid, place, held)
         call add_slaves(edge, tile, held, affine, cube)
      else
         call add_slaves(edge, tile, tile, affine, cube)
      end if
   end subroutine gather_slaves

   !> The same with the tile whose velocities make the slopes, which may be `tile` itself.
   pure subroutine add_slaves(edge, tile, held, affine, cube)
      type(edge_t), intent(in) :: edge
      real(wp), dimension(node_values, 0:tile_last, 0:tile_last, 0:tile_last), intent(in) :: tile, held
      logical, intent(in) :: affine
      real(wp), intent(out), contiguous :: cube(:, 0:, 0:, 0:)
      integer :: s, at(3), low(3), high(3), i, j, k, q
      real(wp) :: share, given(node_values), change(3, 3), along(node_values, 3) ! what is given, and what it changes by along the
                                                                                 ! axes
      cube = 0.0_wp
      along = 0.0_wp
      do s = 1, size(edge%slave, 2)
         if (edge%slave(4, s) == 0) cycle
         at = edge%slave(:3, s)
         if (.not. tile(1, at(1), at(2), at(3)) > 0.0_wp) cycle
         call masters(at, low, high, share)
         given = share*tile(:, at(1), at(2), at(3))
         if (affine) then
            call change_of_momentum(held, at, high > low, change)
            along(2:4, :) = share*change
         end if
         do k = low(3), high(3)
            do j = low(2), high(2)
               do i = low(1), high(1)
                  !$omp simd
                  do q = 1, node_values
                     cube(q, i, j, k) = cube(q, i, j, k) &
                                        + (given(q) + along(q, 1)*(2*i - low(1) - high(1)) + along(q, 2)*(2*j - low(2) - high(2)) &
                                           + along(q, 3)*(2*k - low(3) - high(3)))
                  end do
               end do
            end do
         end do
      end do
   end subroutine add_slaves

   !> By how much the momentum of a slave's mass changes from it to the next node along each of some axes: from the velocities of
   !> the nodes on both sides, or of one where the other has no mass, but for rounding. Columns are axes.
   pure subroutine change_of_momentum(tile, at, along, change)
      real(wp), intent(in) :: tile(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      integer, intent(in) :: at(3)
      logical, intent(in) :: along(3)
      real(wp), intent(out) :: change(3, 3)
      real(wp) :: here(3), per_mass
      integer :: axis, found, side, to(3)
      change = 0.0_wp
      associate (mass => tile(1, at(1), at(2), at(3)))
         here = tile(2:4, at(1), at(2), at(3))/mass
         do axis = 1, 3
            if (.not. along(axis)) cycle
            found = 0
            do side = -1, 1, 2
               to = at
               to(axis) = at(axis) + side
               if (to(axis) < 0 .or. to(axis) > tile_last) cycle
               if (.not. tile(1, to(1), to(2), to(3)) > barely*mass) cycle
               found = found + 1
               per_mass = 1.0_wp/tile(1, to(1), to(2), to(3))
               change(:, axis) = change(:, axis) + side*(per_mass*tile(2:4, to(1), to(2), to(3)) - here)
            end do
            if (found > 0) change(:, axis) = mass*change(:, axis)/found
         end do
      end associate
   end subroutine change_of_momentum

   !> What a block's particles have been given of the forces of the finer level before its time (theory.md, eq. labels): half a step
   !> of the force of the stress that has grown while the edge was there. Every block takes that of its own particles out of its
   !> cube, and hands that force up for the gradients.
   subroutine take_lead(edge, fine, half, cube)
      type(edge_t), intent(in) :: edge
      type(level_t), intent(inout) :: fine !< its work list is used
      real(wp), intent(in) :: half
      real(wp), intent(inout), contiguous :: cube(:, 0:, 0:, 0:)
      real(wp) :: tile(node_values, 0:tile_last, 0:tile_last, 0:tile_last), share
      type(layout_t) :: layout
      integer :: s, at(3), low(3), high(3), i, j, k
      logical :: is_slave(0:tile_last, 0:tile_last, 0:tile_last)
      associate (block => fine%blocks(edge%block))
         if (block%particles%count == 0) return
         is_slave = .false.
         do s = 1, size(edge%slave, 2)
            is_slave(edge%slave(1, s), edge%slave(2, s), edge%slave(3, s)) = .true.
         end do
         call fine%at_edge%take_bins(block%cells, bins_at(is_slave))
         layout = fine%layout
         layout%stress = layout%edge_stress
         layout%gradient = 0 ! only forces are wanted, and where there is mass
         layout%viscous_pressure = 0
         layout%pressure_shift = 0
         tile = 0.0_wp
         call particles_to_nodes(fine%at_edge, block%particles%column, layout, frame_of(fine, block), tile)
         call fold_symmetry(fine%grid, block%place, tile, motion_parity)
      end associate
      do s = 1, size(edge%slave, 2)
         at = edge%slave(:3, s)
         if (.not. tile(1, at(1), at(2), at(3)) > 0.0_wp) cycle
         call masters(at, low, high, share)
         do k = low(3), high(3)
            do j = low(2), high(2)
               do i = low(1), high(1)
                  cube(2:4, i, j, k) = cube(2:4, i, j, k) - 0.5_wp*half*share*tile(5:7, at(1), at(2), at(3))
                  if (size(cube, 1) > node_values) cube(lead_first:lead_last, i, j, k) = &
                     cube(lead_first:lead_last, i, j, k) + share*tile(5:7, at(1), at(2), at(3))
               end do
            end do
         end do
      end do
   end subroutine take_lead

   !> The motion of the nodes of the parent's tile that the slaves depend on, to the cube.
   pure subroutine take_cube(edge, tile, cube)
      type(edge_t), intent(in) :: edge
      real(wp), intent(in) :: tile(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      real(wp), intent(inout), contiguous :: cube(:, 0:, 0:, 0:)
      associate (a => edge%corner, z => edge%corner + cube_last)
         cube(:node_values, :, :, :) = tile(:, a(1):z(1), a(2):z(2), a(3):z(3))
      end associate
   end subroutine take_cube

   !> Beside that motion, how far gradients are to be ahead of it, for each second: the acceleration that they are to know of (in
   !> the places of a velocity) less that of the motion (theory.md, eq. lead).
   pure subroutine take_leads(edge, known, cube)
      type(edge_t), intent(in) :: edge
      real(wp), intent(in) :: known(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      real(wp), intent(inout), contiguous :: cube(:, 0:, 0:, 0:)
      associate (a => edge%corner, z => edge%corner + cube_last)
         cube(lead_first:lead_last, :, :, :) = known(2:4, a(1):z(1), a(2):z(2), a(3):z(3)) - cube(5:7, :, :, :)
      end associate
   end subroutine take_leads

   !> The slaves move with the nodes that they depend on, linearly in time (theory.md, eq. half-steps). One without mass moves
   !> nobody.
   pure subroutine set_motion(edge, cube, remaining, tile)
      type(edge_t), intent(in) :: edge
      real(wp), intent(in), contiguous :: cube(:, 0:, 0:, 0:)
      real(wp), intent(in) :: remaining !< time from where velocities of this step stand to where those of the coarser one do, s
      real(wp), intent(inout) :: tile(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      real(wp) :: node(node_values)
      integer :: at(3), s
      do s = 1, size(edge%slave, 2)
         at = edge%slave(:3, s)
         if (.not. tile(1, at(1), at(2), at(3)) > 0.0_wp) cycle
         call follow(cube, at, 1, node)
         tile(2:4, at(1), at(2), at(3)) = node(2:4) - remaining*node(5:7)
         tile(5:7, at(1), at(2), at(3)) = node(5:7)
      end do
   end subroutine set_motion

   !> In place of the motion of those that are asked for the velocity by which gradients are ahead of it (theory.md, eq. lead).
   pure subroutine set_leads(edge, cube, time_step, asked, tile)
      type(edge_t), intent(in) :: edge
      real(wp), intent(in), contiguous :: cube(:, 0:, 0:, 0:)
      real(wp), intent(in) :: time_step  !< of the finer level, s
      integer, intent(in) :: asked(2, 3) !< first and last index along each axis of what is asked for
      real(wp), intent(inout) :: tile(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      real(wp) :: values(node_values)
      integer :: at(3), s
      do s = 1, size(edge%slave, 2)
         at = edge%slave(:3, s)
         if (any(at < asked(1, :) .or. at > asked(2, :))) cycle
         call follow(cube, at, lead_last - node_values + 1, values)
         tile(2:4, at(1), at(2), at(3)) = 0.5_wp*time_step*values(node_values - 2:)
      end do
   end subroutine set_leads

   !> Some values of a slave, as many as a node has, from those of the nodes that it depends on (theory.md, eq. constrained): half of
   !> each of two along each axis, which are the same one where it lies on it.
   pure subroutine follow(cube, at, first, values)
      real(wp), intent(in), contiguous :: cube(:, 0:, 0:, 0:)
      integer, intent(in) :: at(3) !< the slave's place in the tile
      integer, intent(in) :: first !< of the values in the cube
      real(wp), intent(out) :: values(node_values)
      real(wp) :: share
      integer :: low(3), high(3), c, q
      call masters(at, low, high, share)
      associate (i => low(1), j => low(2), k => low(3), x => high(1), y => high(2), z => high(3))
         !$omp simd private(c)
         do q = 1, node_values
            c = first - 1 + q
            values(q) = 0.125_wp*(((cube(c, i, j, k) + cube(c, x, j, k)) + (cube(c, i, y, k) + cube(c, x, y, k))) &
                                  + ((cube(c, i, j, z) + cube(c, x, j, z)) + (cube(c, i, y, z) + cube(c, x, y, z))))
         end do
      end associate
   end subroutine follow

   !> The nodes of a cube that a node of the block's tile depends on: low to high, all with one weight, 1, 1/2, 1/4 or 1/8.
   pure subroutine masters(at, low, high, share)
      integer, intent(in) :: at(3)
      integer, intent(out) :: low(3), high(3)
      real(wp), intent(out) :: share
      high = 1 + at/2          ! tile node t is node 8 a + t - 1 of the grid, cube node c is node 4 a + c - 1 of the coarser one
      low = (at + 1)/2
      share = shares(sum(high - low))
   end subroutine masters

end module m_edge
