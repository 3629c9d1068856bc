!> The nodes of the coarser of two levels on which constrained nodes depend (theory.md, eq. constrained), in
!> the tiles of this rank's blocks, and the change of their motion in the middle of a step. What the two
!> levels exchange concerns these nodes alone.
module m_edge_nodes
   use m_kinds, only: wp
   use m_constants, only: block_size
   use m_node_values, only: node_values, tile_last, mass_, p_x, p_z, v_x, v_z, f_x, f_z, a_x, a_z, spare_
   use m_level, only: level_t
   use m_boundary, only: apply_boundary
   use m_edge, only: has_constrained, patch_last
   implicit none
   private
   public :: edge_nodes_t, list_edge_nodes, find_change

   type :: edge_nodes_t
      integer, allocatable :: at(:, :)        !< tile indices (3) of each node and its block's number, by
                                              !< rising block
      integer, allocatable :: first(:)        !< of each block: its first node in the list
      integer, allocatable :: last(:)         !< its last one; first - 1 where it has none
      integer, allocatable :: extent(:, :, :) !< (2, 3, slots): range of these nodes in the tile of a block or
                                              !< ghost, empty where it has none
   end type edge_nodes_t

contains

   !> List the nodes for the present blocks.
   subroutine list_edge_nodes(coarse, fine, nodes)
      type(level_t), intent(in) :: coarse, fine
      type(edge_nodes_t), intent(out) :: nodes
      integer :: b, g, own
      logical :: listed(0:tile_last, 0:tile_last, 0:tile_last)
      own = size(coarse%blocks)
      allocate (nodes%at(4, 0), nodes%first(own), nodes%last(own))
      allocate (nodes%extent(2, 3, own + size(coarse%ghost_index)))
      do b = 1, own
         call mark_nodes(coarse, fine, coarse%blocks(b)%place, coarse%blocks(b)%field, listed)
         nodes%first(b) = size(nodes%at, 2) + 1
         if (any(listed)) nodes%at = reshape([nodes%at, positions(listed, b)], &
                                             [4, size(nodes%at, 2) + count(listed)])
         nodes%last(b) = size(nodes%at, 2)
         nodes%extent(:, :, b) = extent_of(listed)
      end do
      do g = 1, size(coarse%ghost_index)
         associate (index => coarse%ghost_index(g))
            call mark_nodes(coarse, fine, coarse%grid%block_place(index), coarse%grid%block_field(index), &
                            listed)
         end associate
         nodes%extent(:, :, own + g) = extent_of(listed)
      end do
   end subroutine list_edge_nodes

   !> Mark the nodes in the tile of the coarser level's block at a place.
   subroutine mark_nodes(coarse, fine, place, field, listed)
      type(level_t), intent(in) :: coarse, fine
      integer, intent(in) :: place(3), field
      logical, intent(out) :: listed(0:tile_last, 0:tile_last, 0:tile_last)
      integer :: child(3), low(3), high(3), first(3), node(3), i, j, k, x, y, z
      listed = .false.
      first = block_size*place - 1
      do z = 2*place(3) - 2, 2*place(3) + 3
         do y = 2*place(2) - 2, 2*place(2) + 3
            do x = 2*place(1) - 2, 2*place(1) + 3
               child = [x, y, z]
               if (fine%owner_at(child, field) < 0) cycle
               if (.not. has_constrained(fine%region, child)) cycle
               low = max(block_size/2*child - 1 - first, 0) ! of its patch, which begins there
               high = min(block_size/2*child - 1 + patch_last - first, tile_last)
               low(2) = max(low(2), coarse%grid%rows(1))
               high(2) = min(high(2), coarse%grid%rows(2))
               listed(low(1):high(1), low(2):high(2), low(3):high(3)) = .true.
            end do
         end do
      end do
      do k = 0, tile_last
         do j = coarse%grid%rows(1), coarse%grid%rows(2)
            do i = 0, tile_last
               node = 2*(first + [i, j, k])
               if (listed(i, j, k)) listed(i, j, k) = fine%region%any_outer(node - 1, node + 1)
            end do
         end do
      end do
   end subroutine mark_nodes

   !> Tile indices of the listed nodes, and the block's number.
   pure function positions(listed, b) result(at)
      logical, intent(in) :: listed(0:tile_last, 0:tile_last, 0:tile_last)
      integer, intent(in) :: b
      integer :: at(4*count(listed))
      integer :: i, j, k, n
      n = 0
      do k = 0, tile_last
         do j = 0, tile_last
            do i = 0, tile_last
               if (.not. listed(i, j, k)) cycle
               at(n + 1:n + 4) = [i, j, k, b]
               n = n + 4
            end do
         end do
      end do
   end function positions

   pure function extent_of(listed) result(extent)
      logical, intent(in) :: listed(0:tile_last, 0:tile_last, 0:tile_last)
      integer :: extent(2, 3)
      extent(1, :) = tile_last + 1
      extent(2, :) = -1
      if (.not. any(listed)) return
      extent(:, 1) = range_of(any(any(listed, 3), 2))
      extent(:, 2) = range_of(any(any(listed, 3), 1))
      extent(:, 3) = range_of(any(any(listed, 2), 1))
   end function extent_of

   pure function range_of(listed) result(range)
      logical, intent(in) :: listed(0:tile_last)
      integer :: range(2)
      range = [findloc(listed, .true., 1) - 1, findloc(listed, .true., 1, back=.true.) - 1]
   end function range_of

   !> Changes of the velocity and of half of the acceleration of a block's nodes by the actual
   !> contributions of constrained nodes over two finer steps (theory.md, eq. half-steps), with boundary
   !> conditions applied. `coarse%restricted` holds the sums over blocks: the mass of coarser particles and
   !> constrained nodes, and of constrained nodes alone the momentum, the change of force, and the mass (as
   !> `spare`). A node whose mass has more than doubled starts the second half step with its momentum at that
   !> time.
   pure subroutine find_change(nodes, coarse, b, pushed, time_step, flip_fraction, change)
      type(edge_nodes_t), intent(in) :: nodes
      type(level_t), intent(in) :: coarse
      integer, intent(in) :: b
      real(wp), intent(in) :: pushed(:, :) !< acceleration of the listed nodes by effects, (3, nodes), m/s2
      real(wp), intent(in) :: time_step    !< of the coarser level, s
      real(wp), intent(in) :: flip_fraction
      real(wp), intent(out) :: change(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      real(wp) :: half, mixed, middle(3), momentum(3), start(3), force(3)
      integer :: n
      half = 0.5_wp*time_step
      mixed = 1.0_wp - flip_fraction ! PIC share of the particles' velocities
      change(:, :, coarse%grid%rows(1):coarse%grid%rows(2), :) = 0.0_wp
      do n = nodes%first(b), nodes%last(b)
         associate (i => nodes%at(1, n), j => nodes%at(2, n), k => nodes%at(3, n))
            associate (node => coarse%nodes(:, i, j, k, b), sums => coarse%restricted(:, i, j, k, b), &
                       velocity => change(v_x:v_z, i, j, k), kick => change(a_x:a_z, i, j, k), &
                       push => pushed(:, n))
               if (.not. (sums(mass_) > 0.0_wp .and. &
                          abs(sums(spare_)) + abs(sums(mass_) - node(mass_)) > 0.0_wp)) cycle
               middle = node(v_x:v_z) - half*node(a_x:a_z) ! velocity after the first half step
               momentum = (sums(mass_) - sums(spare_))*middle + sums(p_x:p_z)
               start = middle
               if (node(mass_) < 0.5_wp*sums(mass_)) start = momentum/sums(mass_)
               force = node(mass_)*(node(a_x:a_z) - push) + sums(mass_)*push + sums(f_x:f_z)
               if (mixed > 0.0_wp) force = force + mixed/half*(momentum - sums(mass_)*start)
               kick = half*(force/sums(mass_) - node(a_x:a_z)) ! beyond the first half step
               velocity = start - middle + merge(1.0_wp, 0.5_wp, mixed > 0.0_wp)*kick
               kick = kick/time_step ! half of the acceleration's change
            end associate
         end associate
      end do
      call apply_boundary(coarse%grid, coarse%blocks(b)%place, change)
   end subroutine find_change

end module m_edge_nodes
