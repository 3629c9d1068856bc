!> A block of the finer of two levels whose tile holds constrained nodes: the list of these, their restriction
!> to the nodes that they depend on, and their motion with them (theory.md, eqs constrained, restriction,
!> affine-edge, lag).
!>
!> All constrained nodes of a block depend on 6 x 6 x 6 nodes of the coarser level, a patch, which lies in the
!> tile of one block there, its parent. A node of a patch has the values of a node of a tile; where the lag of
!> gradients is corrected, three more.
!>
!> There is one map: `restrict_node` adds shares of a constrained node's values to the patch, `interpolate`
!> computes values of a constrained node from the patch. All other procedures here select values and nodes.
module m_edge
   use m_kinds, only: wp
   use m_constants, only: block_size
   use m_node_values, only: node_values, tile_last, mass_, p_x, p_z, v_x, v_z, f_x, f_z, a_x, a_z
   use m_grid_level, only: grid_level_t
   use m_region, only: region_t
   use m_level, only: level_t
   use m_boundary, only: apply_boundary, has_boundary, fold_symmetry, motion_parity
   use m_cell_list, only: bins_at
   use m_field_table, only: layout_t
   use m_particle_transfer, only: p2g
   use m_migration, only: frame_of
   implicit none
   private
   public :: edge_t, has_constrained, make_edge, clear_covered, restrict_sums, restrict_lag, prolong_motion, &
             prolong_lag, interpolate_motion, interpolate_lag, restrict, restrict_arms, prolong, add_patches

   integer, parameter, public :: patch_last = 5 !< patches run from 0 to here
   !> Up: the force of the accumulated stress, down: the lead of gradients.
   integer, parameter, public :: lag_first = node_values + 1, lag_last = node_values + 3
   real(wp), parameter :: shares(0:3) = [1.0_wp, 0.5_wp, 0.25_wp, 0.125_wp] !< of a constrained node that lies
                                                                            !< between nodes along 0, 1, 2 or
                                                                            !< 3 axes
   real(wp), parameter :: barely = 1.0e-9_wp    !< a node with no more than this share of its neighbour's mass
                                                !< counts as empty

   !> A block of the finer level with constrained nodes, as stored on the rank of the block or of its parent.
   type :: edge_t
      integer :: block = 0     !< its number here, 0 where only its parent is local
      integer :: index = 0     !< its number on the finer level
      integer :: parent = 0    !< number of its parent here, 0 where only the block is local
      integer :: rank_beyond = -1 !< rank of the parent, or where only that is local the rank of the block
      integer :: corner(3) = 0 !< of the patch in the parent's tile
      integer :: rows(2) = [0, patch_last] !< first and last index along y in a patch
      integer, allocatable :: constrained(:, :) !< tile indices (3) of the constrained nodes, and 1 where this
                                                !< block restricts the node, else 0
   end type edge_t

contains

   !> True when the tile of a block holds nodes that are not inside the region.
   pure logical function has_constrained(region, place)
      type(region_t), intent(in) :: region
      integer, intent(in) :: place(3) !< of the block
      has_constrained = region%any_outer(block_size*place - 1, block_size*(place + 1))
   end function has_constrained

   !> The edge of a block of the finer level.
   type(edge_t) function make_edge(coarse, fine, rank, index, b) result(edge)
      type(level_t), intent(in) :: coarse, fine
      integer, intent(in) :: rank, index !< this one; the block's
      integer, intent(in) :: b           !< its number here, 0 where only its parent is local
      integer :: home(3), place(3), field
      place = fine%grid%block_place(index)
      field = fine%grid%block_field(index)
      home = place/2
      edge%index = index
      edge%block = b
      edge%rank_beyond = merge(coarse%owner_at(home, field), fine%owner(index), b > 0)
      if (coarse%owner_at(home, field) == rank) edge%parent = coarse%slot_at(home, field)
      edge%corner = block_size/2*modulo(place, 2)
      edge%rows = min(fine%grid%rows, patch_last)
      if (b > 0) call list_constrained(edge, fine, place, field)
   end function make_edge

   !> List the constrained nodes in the tile of a block. Of the blocks whose tiles hold a constrained node,
   !> the one that owns it restricts it, or if that does not exist the one with the lowest index.
   subroutine list_constrained(edge, fine, place, field)
      type(edge_t), intent(inout) :: edge
      type(level_t), intent(in) :: fine
      integer, intent(in) :: place(3), field
      integer :: found(4, (tile_last + 1)**3), i, j, k, n
      n = 0
      do k = 0, tile_last
         do j = fine%grid%rows(1), fine%grid%rows(2)
            do i = 0, tile_last
               if (fine%region%is_inner(block_size*place + [i, j, k] - 1)) cycle
               n = n + 1
               found(:, n) = [i, j, k, merge(1, 0, restricts_here(block_size*place + [i, j, k] - 1))]
            end do
         end do
      end do
      edge%constrained = found(:, :n)
   contains
      !> True when this block restricts the node.
      logical function restricts_here(node)
         integer, intent(in) :: node(3)
         integer :: home(3), low(3), high(3), x, y, z
         home = (node - modulo(node, block_size))/block_size
         restricts_here = all(home == place)
         if (restricts_here .or. fine%owner_at(home, field) >= 0) return
         low = home - merge(1, 0, modulo(node, block_size) == 0)
         high = home + merge(1, 0, modulo(node, block_size) == block_size - 1)
         do z = low(3), high(3)
            do y = low(2), high(2)
               do x = low(1), high(1)
                  if (fine%owner_at([x, y, z], field) < 0) cycle
                  restricts_here = all([x, y, z] == place)
                  return
               end do
            end do
         end do
      end function restricts_here
   end subroutine list_constrained

   !> Clear the nodes of the coarser level inside the region. They have no particles, but round-off in
   !> particles that touch the edge may give them a tiny mass, and so an unbounded acceleration.
   pure subroutine clear_covered(coarse, fine)
      type(level_t), intent(inout) :: coarse
      type(level_t), intent(in) :: fine
      integer :: b, i, j, k, first(3)
      do b = 1, size(coarse%blocks)
         first = block_size*coarse%blocks(b)%place - 1
         if (.not. fine%region%overlaps(coarse%blocks(b)%origin - coarse%grid%cell, &
                                        coarse%blocks(b)%origin + (block_size + 1)*coarse%grid%cell)) cycle
         do k = 0, tile_last
            do j = coarse%grid%rows(1), coarse%grid%rows(2)
               do i = 0, tile_last
                  if (fine%region%is_inner(2*(first + [i, j, k]))) coarse%nodes(:, i, j, k, b) = 0.0_wp
               end do
            end do
         end do
      end do
   end subroutine clear_covered

   !> Restrict one block's constrained nodes to its patch. With affine transfer the momentum is evaluated at
   !> the coarser node, with the gradient of the constrained nodes' velocities along the edge (theory.md, eq.
   !> affine-edge).
   subroutine restrict_sums(edge, grid, place, tile, affine, patch)
      type(edge_t), intent(in) :: edge
      type(grid_level_t), intent(in) :: grid
      integer, intent(in) :: place(3) !< of the block
      real(wp), intent(in) :: tile(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      logical, intent(in) :: affine
      real(wp), intent(inout), contiguous :: patch(:, 0:, edge%rows(1):, 0:)
      real(wp) :: held(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      ! gradients are taken with boundary conditions applied, including the mirror images outside
      if (affine .and. has_boundary(grid, place)) then
         held(:, :, grid%rows(1):grid%rows(2), :) = tile(:, :, grid%rows(1):grid%rows(2), :)
         call apply_boundary(grid, place, held)
         call restrict_tile(edge, tile, held, affine, patch)
      else
         call restrict_tile(edge, tile, tile, affine, patch)
      end if
   end subroutine restrict_sums

   !> The same with a separate tile for the velocity gradients, which may be `tile` itself.
   pure subroutine restrict_tile(edge, tile, held, affine, patch)
      type(edge_t), intent(in) :: edge
      real(wp), dimension(node_values, 0:tile_last, 0:tile_last, 0:tile_last), intent(in) :: tile, held
      logical, intent(in) :: affine
      real(wp), intent(inout), contiguous :: patch(:, 0:, edge%rows(1):, 0:)
      integer :: s, at(3), low(3), high(3)
      ! changes of momentum, and of all values, along the axes
      real(wp) :: share, change(3, 3), along(node_values, 3)
      patch = 0.0_wp
      along = 0.0_wp
      do s = 1, size(edge%constrained, 2)
         if (edge%constrained(4, s) == 0) cycle
         at = edge%constrained(:3, s)
         if (.not. tile(mass_, at(1), at(2), at(3)) > 0.0_wp) cycle
         if (affine) then
            call coarse_nodes(at, low, high, share)
            call change_of_momentum(held, at, high > low, change)
            along(v_x:v_z, :) = change
         end if
         call restrict_node(edge, at, 1, node_values, tile(:, at(1), at(2), at(3)), along, patch)
      end do
   end subroutine restrict_tile

   !> Add to the nodes of a patch that a constrained node depends on their shares of its values, and of the
   !> change of these along each axis from the constrained node to the next one.
   pure subroutine restrict_node(edge, at, first, number, given, along, patch)
      type(edge_t), intent(in) :: edge
      integer, intent(in) :: at(3)         !< tile index of the constrained node
      integer, intent(in) :: first, number !< of the values in the patch
      real(wp), intent(in) :: given(number), along(number, 3)
      real(wp), intent(inout), contiguous :: patch(:, 0:, edge%rows(1):, 0:)
      real(wp) :: share
      integer :: low(3), high(3), c, i, j, k, q
      call coarse_nodes(at, low, high, share)
      do k = low(3), high(3)
         do j = low(2), high(2)
            do i = low(1), high(1)
               !$omp simd private(c)
               do q = 1, number
                  c = first - 1 + q
                  patch(c, i, j, k) = patch(c, i, j, k) + share*(given(q) &
                                                                 + along(q, 1)*(2*i - low(1) - high(1)) &
                                                                 + along(q, 2)*(2*j - low(2) - high(2)) &
                                                                 + along(q, 3)*(2*k - low(3) - high(3)))
               end do
            end do
         end do
      end do
   end subroutine restrict_node

   !> Change of the momentum of a constrained node's mass from it to the next node along each of some axes:
   !> from the velocities of the nodes on both sides, or of one where the other has no mass (up to round-off).
   !> Columns are axes.
   pure subroutine change_of_momentum(tile, at, along, change)
      real(wp), intent(in) :: tile(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      integer, intent(in) :: at(3)
      logical, intent(in) :: along(3)
      real(wp), intent(out) :: change(3, 3)
      real(wp) :: here(3), per_mass
      integer :: axis, found, side, to(3)
      change = 0.0_wp
      associate (mass => tile(mass_, at(1), at(2), at(3)))
         here = tile(p_x:p_z, at(1), at(2), at(3))/mass
         do axis = 1, 3
            if (.not. along(axis)) cycle
            found = 0
            do side = -1, 1, 2
               to = at
               to(axis) = at(axis) + side
               if (to(axis) < 0 .or. to(axis) > tile_last) cycle
               if (.not. tile(mass_, to(1), to(2), to(3)) > barely*mass) cycle
               found = found + 1
               per_mass = 1.0_wp/tile(mass_, to(1), to(2), to(3))
               change(:, axis) = change(:, axis) + side*(per_mass*tile(p_x:p_z, to(1), to(2), to(3)) - here)
            end do
            if (found > 0) change(:, axis) = mass*change(:, axis)/found
         end do
      end associate
   end subroutine change_of_momentum

   !> Momentum that a block's particles have received from forces of the finer level ahead of time (theory.md,
   !> eq. time-levels): half a step of the force of the stress accumulated since the edge exists. Every block
   !> subtracts that of its own particles from its patch, and restricts that force for the gradients.
   subroutine restrict_lag(edge, fine, half, patch)
      type(edge_t), intent(in) :: edge
      type(level_t), intent(inout) :: fine !< one of its work lists is used
      real(wp), intent(in) :: half
      real(wp), intent(inout), contiguous :: patch(:, 0:, edge%rows(1):, 0:)
      real(wp) :: tile(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      real(wp), parameter :: level_along(3, 3) = 0.0_wp
      type(layout_t) :: layout
      integer :: s, at(3)
      logical :: is_constrained(0:tile_last, 0:tile_last, 0:tile_last)
      associate (block => fine%blocks(edge%block), rows => fine%grid%rows)
         if (block%particles%count == 0) return
         is_constrained(:, rows(1):rows(2), :) = .false.
         do s = 1, size(edge%constrained, 2)
            is_constrained(edge%constrained(1, s), edge%constrained(2, s), edge%constrained(3, s)) = .true.
         end do
         call fine%at_edge%take_bins(block%cells, bins_at(is_constrained, rows))
         layout = fine%layout
         layout%stress = layout%edge_stress
         layout%gradient = 0 ! only forces, and the mass to find the nodes
         layout%viscous_pressure = 0
         layout%pressure_shift = 0
         tile(:, :, rows(1):rows(2), :) = 0.0_wp
         call p2g(fine%at_edge, block%particles%column, layout, frame_of(fine, block), tile)
         call fold_symmetry(fine%grid, block%place, tile, motion_parity)
      end associate
      do s = 1, size(edge%constrained, 2)
         at = edge%constrained(:3, s)
         if (.not. tile(mass_, at(1), at(2), at(3)) > 0.0_wp) cycle
         associate (force => tile(f_x:f_z, at(1), at(2), at(3)))
            call restrict_node(edge, at, p_x, 3, -0.5_wp*half*force, level_along, patch)
            if (size(patch, 1) > node_values) &
               call restrict_node(edge, at, lag_first, 3, 1.0_wp*force, level_along, patch)
         end associate
      end do
   end subroutine restrict_lag

   !> Add some values of the nodes of patches to those of the parents' tiles, in the given order.
   pure subroutine add_patches(edges, order, patches, tiles, to, from, values)
      type(edge_t), intent(in) :: edges(:)
      integer, intent(in) :: order(:)        !< numbers of edges whose parent is here
      real(wp), intent(in), contiguous :: patches(:, :, :, :, :)
      real(wp), intent(inout) :: tiles(node_values, 0:tile_last, 0:tile_last, 0:tile_last, *)
      integer, intent(in) :: to, from, values !< first value in a tile and in a patch, and number of values
      integer :: c, e
      do c = 1, size(order)
         e = order(c)
         associate (a => edges(e)%corner, z => edges(e)%corner + patch_last, &
                    y => edges(e)%corner(2) + edges(e)%rows, b => edges(e)%parent)
            tiles(to:to + values - 1, a(1):z(1), y(1):y(2), a(3):z(3), b) = tiles(to:to + values - 1, &
               a(1):z(1), y(1):y(2), a(3):z(3), b) + patches(from:from + values - 1, :, :, :, e)
         end associate
      end do
   end subroutine add_patches

   !> Copy the motion of the nodes of the parent's tile that the constrained nodes depend on to the patch.
   pure subroutine prolong_motion(edge, tile, patch)
      type(edge_t), intent(in) :: edge
      real(wp), intent(in) :: tile(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      real(wp), intent(inout), contiguous :: patch(:, 0:, edge%rows(1):, 0:)
      associate (a => edge%corner, z => edge%corner + patch_last, r => edge%rows)
         patch(:node_values, :, :, :) = tile(:, a(1):z(1), a(2) + r(1):a(2) + r(2), a(3):z(3))
      end associate
   end subroutine prolong_motion

   !> Also copy the rate at which gradients are to lead that motion: their acceleration (stored in place of a
   !> velocity) less that of the motion (theory.md, eq. lag).
   pure subroutine prolong_lag(edge, known, patch)
      type(edge_t), intent(in) :: edge
      real(wp), intent(in) :: known(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      real(wp), intent(inout), contiguous :: patch(:, 0:, edge%rows(1):, 0:)
      associate (a => edge%corner, z => edge%corner + patch_last, r => edge%rows)
         patch(lag_first:lag_last, :, :, :) = &
            known(v_x:v_z, a(1):z(1), a(2) + r(1):a(2) + r(2), a(3):z(3)) - patch(a_x:a_z, :, :, :)
      end associate
   end subroutine prolong_lag

   !> Move the constrained nodes with the nodes that they depend on, linearly in time (theory.md, eq.
   !> half-steps). Those without mass are skipped.
   pure subroutine interpolate_motion(edge, patch, remaining, tile)
      type(edge_t), intent(in) :: edge
      real(wp), intent(in), contiguous :: patch(:, 0:, edge%rows(1):, 0:)
      real(wp), intent(in) :: remaining !< time from the velocities of this step to those of the coarser one,
                                        !< s
      real(wp), intent(inout) :: tile(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      real(wp) :: node(node_values)
      integer :: at(3), s
      do s = 1, size(edge%constrained, 2)
         at = edge%constrained(:3, s)
         if (.not. tile(mass_, at(1), at(2), at(3)) > 0.0_wp) cycle
         call interpolate(edge, patch, at, 1, node)
         tile(v_x:v_z, at(1), at(2), at(3)) = node(v_x:v_z) - remaining*node(a_x:a_z)
         tile(a_x:a_z, at(1), at(2), at(3)) = node(a_x:a_z)
      end do
   end subroutine interpolate_motion

   !> Replace the motion of the requested nodes by the velocity by which gradients are ahead of it (theory.md,
   !> eq. lag).
   pure subroutine interpolate_lag(edge, patch, time_step, asked, tile)
      type(edge_t), intent(in) :: edge
      real(wp), intent(in), contiguous :: patch(:, 0:, edge%rows(1):, 0:)
      real(wp), intent(in) :: time_step  !< of the finer level, s
      integer, intent(in) :: asked(2, 3) !< first and last index along each axis of the requested nodes
      real(wp), intent(inout) :: tile(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      real(wp) :: values(node_values)
      integer :: at(3), s
      do s = 1, size(edge%constrained, 2)
         at = edge%constrained(:3, s)
         if (any(at < asked(1, :) .or. at > asked(2, :))) cycle
         call interpolate(edge, patch, at, lag_last - node_values + 1, values)
         tile(v_x:v_z, at(1), at(2), at(3)) = 0.5_wp*time_step*values(node_values - 2:)
      end do
   end subroutine interpolate_lag

   !> Add to a patch some values of the constrained nodes that a block restricts, by their shares to a power:
   !> 1 for sums, 2 for a diagonal of the stiffness, which contains shares twice.
   pure subroutine restrict(edge, tile, first, last, power, patch)
      type(edge_t), intent(in) :: edge
      real(wp), intent(in) :: tile(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      integer, intent(in) :: first, last, power
      real(wp), intent(inout), contiguous :: patch(:, 0:, edge%rows(1):, 0:)
      real(wp) :: along(node_values, 3), share
      integer :: at(3), low(3), high(3), s
      along = 0.0_wp
      do s = 1, size(edge%constrained, 2)
         if (edge%constrained(4, s) == 0) cycle
         at = edge%constrained(:3, s)
         call coarse_nodes(at, low, high, share)
         call restrict_node(edge, at, first, last - first + 1, &
                            share**(power - 1)*tile(first:last, at(1), at(2), at(3)), &
                            along(:last - first + 1, :), patch)
      end do
   end subroutine restrict

   !> Correction after `restrict` where values 2 to 4 are value 1 times a position relative to the node, as
   !> the nodes of the patch have other positions.
   pure subroutine restrict_arms(edge, tile, cell, patch)
      type(edge_t), intent(in) :: edge
      real(wp), intent(in) :: tile(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      real(wp), intent(in) :: cell !< of the tile, m
      real(wp), intent(inout), contiguous :: patch(:, 0:, edge%rows(1):, 0:)
      real(wp), parameter :: nothing(3) = 0.0_wp
      real(wp) :: along(3, 3)
      integer :: a, at(3), s
      along = 0.0_wp
      do s = 1, size(edge%constrained, 2)
         if (edge%constrained(4, s) == 0) cycle
         at = edge%constrained(:3, s)
         do a = 1, 3
            along(a, a) = -tile(1, at(1), at(2), at(3))*cell
         end do
         call restrict_node(edge, at, 2, 3, nothing, along, patch)
      end do
   end subroutine restrict_arms

   !> Compute some values of all constrained nodes of a tile from those of the nodes that they depend on.
   pure subroutine prolong(edge, patch, first, last, tile)
      type(edge_t), intent(in) :: edge
      real(wp), intent(in), contiguous :: patch(:, 0:, edge%rows(1):, 0:)
      integer, intent(in) :: first, last
      real(wp), intent(inout) :: tile(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      real(wp) :: node(node_values)
      integer :: at(3), q, s
      do s = 1, size(edge%constrained, 2)
         at = edge%constrained(:3, s)
         call interpolate(edge, patch, at, 1, node)
         do q = first, last
            tile(q, at(1), at(2), at(3)) = node(q)
         end do
      end do
   end subroutine prolong

   !> Compute some values of a constrained node, as many as `values` has room for, from those of the nodes
   !> that it depends on (theory.md, eq. constrained): along each axis half of each of two, which coincide
   !> where it lies on a coarser node.
   pure subroutine interpolate(edge, patch, at, first, values)
      type(edge_t), intent(in) :: edge
      real(wp), intent(in), contiguous :: patch(:, 0:, edge%rows(1):, 0:)
      integer, intent(in) :: at(3) !< tile index of the constrained node
      integer, intent(in) :: first !< of the values in the patch
      real(wp), intent(out) :: values(node_values)
      real(wp) :: share
      integer :: low(3), high(3), c, q
      call coarse_nodes(at, low, high, share)
      associate (i => low(1), j => low(2), k => low(3), x => high(1), y => high(2), z => high(3))
         !$omp simd private(c)
         do q = 1, node_values
            c = first - 1 + q
            values(q) = 0.125_wp*(((patch(c, i, j, k) + patch(c, x, j, k)) &
                                   + (patch(c, i, y, k) + patch(c, x, y, k))) &
                                   + ((patch(c, i, j, z) + patch(c, x, j, z)) &
                                   + (patch(c, i, y, z) + patch(c, x, y, z))))
         end do
      end associate
   end subroutine interpolate

   !> The nodes of a patch that a node of the block's tile depends on: low to high, all with one weight, 1,
   !> 1/2, 1/4 or 1/8.
   pure subroutine coarse_nodes(at, low, high, share)
      integer, intent(in) :: at(3)
      integer, intent(out) :: low(3), high(3)
      real(wp), intent(out) :: share
      ! tile node t is node 8 a + t - 1 of the grid, patch node c is node 4 a + c - 1 of the coarser one
      high = 1 + at/2
      low = (at + 1)/2
      share = shares(sum(high - low))
   end subroutine coarse_nodes

end module m_edge
