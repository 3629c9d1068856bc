!> One composite space of two levels: the nodes of the finer one that are not inside its region are slaves of the nodes of the
!> coarser one (theory.md, eqs slaves, hand-up, half-steps).
!>
!> A block of the finer level whose tile holds slaves is an edge block. All its slaves depend on 6 x 6 x 6 nodes of the coarser
!> level, which lie in the tile of one block there, its parent. Between the two travels one such cube of nodes each way: up what
!> the slaves were given, down how they move. Ranks exchange one message a neighbour and way.
module m_composite
   use mpi_f08
   use m_kinds, only: wp, i8
   use m_constants, only: block_size
   use m_sorting, only: sorted_order
   use m_communicator, only: communicator_t
   use m_grid_level, only: grid_level_t
   use m_region, only: region_t
   use m_level, only: level_t, tile_last, node_values
   use m_boundary, only: constrain_nodes, fold_symmetry, motion_parity
   use m_field_table, only: layout_t
   use m_particle_to_node, only: gather_to_nodes
   use m_corner_to_node, only: gather_corners_to_nodes
   use m_migration, only: frame_of
   implicit none
   private
   public :: composite_t, has_slaves, clear_covered

   integer, parameter :: cube_last = 5         !< cubes run from 0 to here
   integer, parameter :: lead_first = node_values + 1, lead_last = node_values + 3 !< values of a cube's node where there are labels
   real(wp), parameter :: barely = 1.0e-9_wp    !< a node with this share of the mass of the next has none

   !> A block of the finer level with slaves, seen from the rank of the block or of its parent.
   type :: edge_t
      integer :: block = 0     !< its number here, 0 where only its parent is
      integer :: index = 0     !< its number on the finer level
      integer :: parent = 0    !< number of its parent here, 0 where only the block is
      integer :: corner(3) = 0 !< of the cube in the parent's tile
      integer, allocatable :: slave(:, :) !< places (3) of the slaves in the tile, and 1 where this block hands the slave up, else 0
   end type edge_t

   type :: composite_t
      type(edge_t), allocatable :: edges(:) !< of this rank's blocks by rising index, then those of others with their parent here
      integer :: own = 0                    !< of them, how many are of this rank's blocks
      integer, allocatable :: edge_of(:)    !< edge of each of this rank's blocks of the finer level, 0 without slaves
      logical, allocatable :: is_parent(:)  !< of this rank's blocks of the coarser level
      logical, allocatable :: receives(:)   !< they hold nodes on which slaves depend: parents and the blocks next to them
      logical, allocatable, private :: adds(:) !< blocks next to those
      integer :: messages_each(2) = 0       !< sent by this rank in one exchange, up and down
      integer(i8) :: bytes_each(2) = 0
      integer(i8) :: messages = 0, bytes = 0 !< sent by this rank over the run
      logical :: labelled = .false.         !< particles at the edge have been pushed to different times, and carry velocity gradients
      integer, private :: values = node_values !< of a node of a cube; 3 more where there are labels
      integer, allocatable, private :: by_index(:) !< edges with their parent here, by rising index of the block: the order in which a
                                                   !< parent adds
      real(wp), allocatable, private :: up(:, :, :, :, :), down(:, :, :, :, :) !< (values, 0:5, 0:5, 0:5, edges)
      real(wp), allocatable, private :: first(:, :, :, :, :) !< what was handed up in the first of two steps, of the own edges
      real(wp), allocatable :: pushed(:, :, :, :, :) !< what effects on nodes add to the acceleration of the coarser ones, where there
                                                     !< are any: (3, 0:9, 0:9, 0:9, blocks), m/s2
      real(wp), allocatable, private :: lead(:, :, :, :, :) !< of the nodes of blocks that receive, eq. lead: force of the finer level that
                                                            !< has grown, N; after the first of two steps the velocity that its
                                                            !< gradients are ahead by, m/s: (3, 0:9, 0:9, 0:9, blocks)
      real(wp), allocatable, private :: own_mass(:, :, :, :) !< of the nodes of parents, without what is handed up: (0:9, 0:9, 0:9, blocks)
      integer, allocatable, private :: ranks(:)
      type(MPI_Datatype), allocatable, private :: of_blocks(:), of_parents(:) !< cubes shared with each rank: of own blocks, own parents
      integer, allocatable, private :: cubes(:, :) !< how many these are: (2, ranks)
   contains
      procedure :: build
      procedure :: restrict
      procedure :: restrict_change
      procedure :: add_to_parents
      procedure :: replace_in_parents
      procedure :: add_leads
      procedure :: keep_leads
      procedure :: leads_in
      procedure :: lead_of_nodes
      procedure :: hand_down
      procedure :: correct
      procedure :: send_down
      procedure :: set_slaves
      procedure :: release
      procedure, private :: exchange
   end type composite_t

contains

   !> True when the tile of a block holds nodes that are not inside the region.
   pure logical function has_slaves(region, place)
      type(region_t), intent(in) :: region
      integer, intent(in) :: place(3) !< of the block
      has_slaves = .not. (region%is_inner(block_size*place - 1) .and. region%is_inner(block_size*(place + 1)))
   end function has_slaves

   !> Edges, cubes and messages of the blocks as they are.
   subroutine build(self, communicator, coarse, fine)
      class(composite_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(in) :: coarse, fine
      integer :: index, n, pass, place(3), parent(3), b
      call self%release()
      self%labelled = fine%layout%edge_stress > 0 .and. fine%layout%gradient > 0
      self%values = merge(lead_last, node_values, self%labelled)
      allocate (self%edge_of(size(fine%blocks)), source=0)
      associate (n => size(coarse%blocks))
         allocate (self%is_parent(n), self%receives(n), self%adds(n), source=.false.)
      end associate
      do pass = 1, 2 ! count, then list
         n = 0
         do b = 1, size(fine%blocks)
            if (.not. has_slaves(fine%region, fine%blocks(b)%place)) cycle
            n = n + 1
            if (pass == 2) call fill_edge(self%edges(n), fine%blocks(b)%index, b)
            if (pass == 2) self%edge_of(b) = n
         end do
         self%own = n
         do index = 1, product(fine%grid%blocks)
            place = fine%grid%block_place(index)
            if (fine%owner_at(place) < 0) cycle
            if (.not. has_slaves(fine%region, place)) cycle
            parent = place/2
            do b = 1, size(coarse%blocks)
               associate (distance => maxval(abs(coarse%blocks(b)%place - parent)))
                  if (distance == 0) self%is_parent(b) = .true.
                  if (distance <= 1) self%receives(b) = .true.
                  if (distance <= 2) self%adds(b) = .true.
               end associate
            end do
            if (fine%owner_at(place) == communicator%rank .or. coarse%owner_at(parent) /= communicator%rank) cycle
            n = n + 1
            if (pass == 2) call fill_edge(self%edges(n), index, 0)
         end do
         if (pass == 1) allocate (self%edges(n))
      end do
      self%by_index = pack([(n, n=1, size(self%edges))], self%edges%parent > 0)
      self%by_index = self%by_index(sorted_order(int(self%edges(self%by_index)%index, i8), int(self%by_index, i8)))
      n = size(self%edges)
      allocate (self%up(self%values, 0:cube_last, 0:cube_last, 0:cube_last, n), source=0.0_wp)
      allocate (self%down(self%values, 0:cube_last, 0:cube_last, 0:cube_last, n), source=0.0_wp)
      allocate (self%first(self%values, 0:cube_last, 0:cube_last, 0:cube_last, self%own), source=0.0_wp)
      n = merge(size(coarse%blocks), 0, self%labelled)
      allocate (self%lead(3, 0:tile_last, 0:tile_last, 0:tile_last, n), source=0.0_wp)
      allocate (self%own_mass(0:tile_last, 0:tile_last, 0:tile_last, size(coarse%blocks)))
      call make_messages(self, communicator, coarse, fine)
   contains
      subroutine fill_edge(edge, index, b)
         type(edge_t), intent(inout) :: edge
         integer, intent(in) :: index, b
         integer :: place(3), home(3)
         place = fine%grid%block_place(index)
         home = place/2
         edge%index = index
         edge%block = b
         if (coarse%owner_at(home) == communicator%rank) edge%parent = coarse%slot(home(1), home(2), home(3))
         edge%corner = block_size/2*modulo(place, 2)
         if (b > 0) call list_slaves(edge, fine, place)
      end subroutine fill_edge
   end subroutine build

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

   !> Which cubes go to and come from which rank.
   subroutine make_messages(self, communicator, coarse, fine)
      class(composite_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(in) :: coarse, fine
      integer :: other(size(self%edges)), e, r, n
      do e = 1, size(self%edges)
         if (e > self%own) then
            other(e) = fine%owner_at(fine%grid%block_place(self%edges(e)%index))
         else
            other(e) = coarse%owner_at(fine%grid%block_place(self%edges(e)%index)/2)
            if (other(e) == communicator%rank) other(e) = -1
         end if
      end do
      self%ranks = pack([(r, r=0, communicator%ranks - 1)], [(any(other == r), r=0, communicator%ranks - 1)])
      n = size(self%ranks)
      allocate (self%of_blocks(n), self%of_parents(n), self%cubes(2, n))
      do r = 1, n
         call make_type(pack([(e - 1, e=1, self%own)], other(:self%own) == self%ranks(r)), self%values, self%of_blocks(r), &
                        self%cubes(1, r))
         call make_type(pack([(e - 1, e=self%own + 1, size(other))], other(self%own + 1:) == self%ranks(r)), self%values, &
                        self%of_parents(r), self%cubes(2, r))
      end do
      self%messages_each = count(self%cubes > 0, dim=2)
      self%bytes_each = 8_i8*self%values*(cube_last + 1)**3*sum(self%cubes, dim=2)
   end subroutine make_messages

   !> The datatype of some cubes of a pool.
   subroutine make_type(numbers, values_of_node, datatype, cubes)
      integer, intent(in) :: numbers(:) !< of the cubes, from 0
      integer, intent(in) :: values_of_node
      type(MPI_Datatype), intent(out) :: datatype
      integer, intent(out) :: cubes
      integer :: values
      values = values_of_node*(cube_last + 1)**3
      cubes = size(numbers)
      call MPI_Type_create_indexed_block(cubes, values, values*numbers, MPI_DOUBLE_PRECISION, datatype)
      call MPI_Type_commit(datatype)
   end subroutine make_type

   !> Nodes of the coarser level inside the region have no particles; what a particle that touches the edge gives them by rounding is
   !> dropped. It would be a node of hardly any mass, with an acceleration without bound.
   pure subroutine clear_covered(coarse, fine)
      type(level_t), intent(inout) :: coarse
      type(level_t), intent(in) :: fine
      integer :: b, i, j, k, first(3)
      do b = 1, size(coarse%blocks)
         first = block_size*coarse%blocks(b)%place - 1
         if (.not. fine%region%overlaps(coarse%blocks(b)%origin - coarse%grid%cell, &
                                        coarse%blocks(b)%origin + (block_size + 1)*coarse%grid%cell)) cycle
         do k = 0, tile_last
            do j = 0, tile_last
               do i = 0, tile_last
                  if (fine%region%is_inner(2*(first + [i, j, k]))) coarse%solved(:, i, j, k, b) = 0.0_wp
               end do
            end do
         end do
      end do
   end subroutine clear_covered

   !> What the slaves were given, to the cubes: mass, momentum less what it is ahead by, force, with the weights of eq. slaves.
   !> `solved` of the finer level holds sums. Kept as that of a first step.
   subroutine restrict(self, communicator, fine, half)
      class(composite_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(in) :: fine
      real(wp), intent(in) :: half !< the finer step, s
      integer :: e
      do e = 1, self%own
         call gather_slaves(self%edges(e), fine%grid, fine%blocks(self%edges(e)%block)%place, &
                            fine%solved(:, :, :, :, self%edges(e)%block), fine%layout%gradient > 0, self%up(:, :, :, :, e))
      end do
      self%first = self%up(:, :, :, :, :self%own)
      if (fine%layout%edge_stress > 0) then
         do e = 1, self%own
            call take_lead(self%edges(e), fine, half, self%up(:, :, :, :, e))
         end do
      end if
      call self%exchange(communicator, self%up, upwards=.true.)
   end subroutine restrict

   !> What a block's particles have been given of the forces of the finer level before its time (theory.md, eq. labels): half a step of
   !> the force of the stress that has grown while the edge was there. Every block takes that of its own particles out of its cube, and
   !> hands that force up for the gradients.
   subroutine take_lead(edge, fine, half, cube)
      type(edge_t), intent(in) :: edge
      type(level_t), intent(in) :: fine
      real(wp), intent(in) :: half
      real(wp), intent(inout) :: cube(:, 0:, 0:, 0:)
      real(wp) :: tile(node_values, 0:tile_last, 0:tile_last, 0:tile_last), share
      type(layout_t) :: layout
      integer :: s, at(3), low(3), high(3), i, j, k
      associate (block => fine%blocks(edge%block))
         if (block%particles%count == 0) return
         layout = fine%layout
         layout%stress = layout%edge_stress
         layout%viscous_pressure = 0
         layout%pressure_shift = 0
         if (layout%domain > 0) then
            call gather_corners_to_nodes(block%cells, block%particles%column, layout, frame_of(fine, block), tile)
         else
            call gather_to_nodes(block%cells, block%particles%column, layout, frame_of(fine, block), tile)
         end if
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

   !> The same in the second of two steps: mass (1 and 8), momentum (2 to 4), the change of force since the first (5 to 7).
   subroutine restrict_change(self, communicator, fine)
      class(composite_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(in) :: fine
      integer :: e
      do e = 1, self%own
         associate (up => self%up(:, :, :, :, e), first => self%first(:, :, :, :, e))
            call gather_slaves(self%edges(e), fine%grid, fine%blocks(self%edges(e)%block)%place, &
                               fine%solved(:, :, :, :, self%edges(e)%block), fine%layout%gradient > 0, up)
            up(8, :, :, :) = up(1, :, :, :)
            up(5:7, :, :, :) = up(5:7, :, :, :) - first(5:7, :, :, :)
         end associate
      end do
      call self%exchange(communicator, self%up, upwards=.true.)
   end subroutine restrict_change

   !> One block's slaves to its cube. With affine transfer the momentum is made for the place of the coarser node, with the slope of
   !> the slaves' velocities along the edge (theory.md, eq. affine-edge).
   subroutine gather_slaves(edge, grid, place, tile, affine, cube)
      type(edge_t), intent(in) :: edge
      type(grid_level_t), intent(in) :: grid
      integer, intent(in) :: place(3) !< of the block
      real(wp), intent(in) :: tile(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      logical, intent(in) :: affine
      real(wp), intent(out) :: cube(:, 0:, 0:, 0:)
      real(wp) :: held(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      integer :: s, at(3), low(3), high(3), i, j, k
      real(wp) :: share, change(3, 3)
      cube = 0.0_wp
      change = 0.0_wp
      if (affine) then ! with what is held, and with the mirror images outside symmetry planes
         held = tile
         call constrain_nodes(grid, place, held)
      end if
      do s = 1, size(edge%slave, 2)
         if (edge%slave(4, s) == 0) cycle
         at = edge%slave(:3, s)
         if (.not. tile(1, at(1), at(2), at(3)) > 0.0_wp) cycle
         call masters(at, low, high, share)
         if (affine) call change_of_momentum(held, at, high > low, change)
         do k = low(3), high(3)
            do j = low(2), high(2)
               do i = low(1), high(1)
                  cube(:node_values, i, j, k) = cube(:node_values, i, j, k) + share*tile(:, at(1), at(2), at(3))
                  if (affine) cube(2:4, i, j, k) = cube(2:4, i, j, k) &
                                                   + share*matmul(change, real(2*[i, j, k] - low - high, wp))
               end do
            end do
         end do
      end do
   end subroutine gather_slaves

   !> By how much the momentum of a slave's mass changes from it to the next node along each of some axes: from the velocities of the
   !> nodes on both sides, or of one where the other has no mass, but for rounding. Columns are axes.
   pure subroutine change_of_momentum(tile, at, along, change)
      real(wp), intent(in) :: tile(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      integer, intent(in) :: at(3)
      logical, intent(in) :: along(3)
      real(wp), intent(out) :: change(3, 3)
      real(wp) :: here(3)
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
               change(:, axis) = change(:, axis) + side*(tile(2:4, to(1), to(2), to(3))/tile(1, to(1), to(2), to(3)) - here)
            end do
            if (found > 0) change(:, axis) = mass*change(:, axis)/found
         end do
      end associate
   end subroutine change_of_momentum

   !> The nodes of a cube that a node of the block's tile depends on: low to high, all with one weight, 1, 1/2, 1/4 or 1/8.
   pure subroutine masters(at, low, high, share)
      integer, intent(in) :: at(3)
      integer, intent(out) :: low(3), high(3)
      real(wp), intent(out) :: share
      high = 1 + at/2          ! tile node t is node 8 a + t - 1 of the grid, cube node c is node 4 a + c - 1 of the coarser one
      low = (at + 1)/2
      share = 1.0_wp/product(high - low + 1)
   end subroutine masters

   !> Before the sum over blocks of the coarser level: add the cubes to what its own particles gave.
   subroutine add_to_parents(self, coarse)
      class(composite_t), intent(inout) :: self
      type(level_t), intent(inout) :: coarse
      integer :: c, e
      do c = 1, size(self%by_index)
         associate (b => self%edges(self%by_index(c))%parent)
            self%own_mass(:, :, :, b) = coarse%gathered(1, :, :, :, b)
         end associate
      end do
      call add_cubes(self, coarse)
   end subroutine add_to_parents

   subroutine add_cubes(self, coarse)
      class(composite_t), intent(in) :: self
      type(level_t), intent(inout) :: coarse
      integer :: c, e
      do c = 1, size(self%by_index)
         e = self%by_index(c)
         associate (a => self%edges(e)%corner, z => self%edges(e)%corner + cube_last, b => self%edges(e)%parent)
            coarse%gathered(:, a(1):z(1), a(2):z(2), a(3):z(3), b) = coarse%gathered(:, a(1):z(1), a(2):z(2), a(3):z(3), b) &
                                                                     + self%up(:node_values, :, :, :, e)
         end associate
      end do
   end subroutine add_cubes

   !> In the second of two finer steps: the mass that the particles of the coarser level gave, and the cubes.
   subroutine replace_in_parents(self, coarse)
      class(composite_t), intent(inout) :: self
      type(level_t), intent(inout) :: coarse
      integer :: b, c
      do c = 1, size(self%by_index)
         b = self%edges(self%by_index(c))%parent
         coarse%gathered(1, :, :, :, b) = self%own_mass(:, :, :, b)
      end do
      do b = 1, size(coarse%blocks)
         if (self%adds(b)) coarse%gathered(2:, :, :, :, b) = 0.0_wp
      end do
      call add_cubes(self, coarse)
   end subroutine replace_in_parents

   !> Between the two sums of a coarser step a third, where there are labels: the forces that have grown, in place of momenta.
   subroutine add_leads(self, coarse)
      class(composite_t), intent(in) :: self
      type(level_t), intent(inout) :: coarse
      integer :: b, c, e
      do b = 1, size(coarse%blocks)
         if (self%adds(b)) coarse%gathered(2:, :, :, :, b) = 0.0_wp
      end do
      do c = 1, size(self%by_index)
         e = self%by_index(c)
         associate (a => self%edges(e)%corner, z => self%edges(e)%corner + cube_last, b => self%edges(e)%parent)
            coarse%gathered(2:4, a(1):z(1), a(2):z(2), a(3):z(3), b) = coarse%gathered(2:4, a(1):z(1), a(2):z(2), a(3):z(3), b) &
                                                                       + self%up(lead_first:lead_last, :, :, :, e)
         end associate
      end do
   end subroutine add_leads

   !> The sum of that over blocks and ranks, for block b.
   subroutine keep_leads(self, b, sums)
      class(composite_t), intent(inout) :: self
      integer, intent(in) :: b
      real(wp), intent(in) :: sums(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      self%lead(:, :, :, :, b) = sums(2:4, :, :, :)
   end subroutine keep_leads

   !> What velocity gradients of slaves are to know of the forces on a node of the coarser level, as an acceleration (eq. lead): of the
   !> finer level's force what has grown, and what effects push all nodes with. In the places of a velocity, inside the boundary conditions.
   pure subroutine lead_of_forces(self, coarse, b, mass, later, tile)
      class(composite_t), intent(in) :: self
      type(level_t), intent(in) :: coarse
      integer, intent(in) :: b
      real(wp), intent(in) :: mass(0:tile_last, 0:tile_last, 0:tile_last)
      real(wp), intent(in) :: later(3, 0:tile_last, 0:tile_last, 0:tile_last) !< what the force will be more, N
      real(wp), intent(out) :: tile(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      integer :: i, j, k
      tile = 0.0_wp
      do k = 0, tile_last
         do j = 0, tile_last
            do i = 0, tile_last
               if (.not. mass(i, j, k) > 0.0_wp) cycle
               tile(2:4, i, j, k) = (self%lead(:, i, j, k, b) + later(:, i, j, k))/mass(i, j, k)
               if (allocated(self%pushed)) tile(2:4, i, j, k) = tile(2:4, i, j, k) + self%pushed(:, i, j, k, b)
            end do
         end do
      end do
      call constrain_nodes(coarse%grid, coarse%blocks(b)%place, tile)
   end subroutine lead_of_forces

   !> True when particles of block b of the finer (or else of the coarser) level carry gradients that are ahead.
   pure logical function leads_in(self, b, finer)
      class(composite_t), intent(in) :: self
      integer, intent(in) :: b
      logical, intent(in) :: finer
      leads_in = self%labelled
      if (.not. leads_in) return
      if (finer) then
         leads_in = self%edge_of(b) > 0
      else
         leads_in = self%receives(b)
      end if
   end function leads_in

   !> Add to the nodes of a block the velocity by which gradients are ahead of the motion (eq. lead): of slaves on the finer level, of
   !> the nodes that they depend on on the coarser one.
   pure subroutine lead_of_nodes(self, b, finer, time_step, tile)
      class(composite_t), intent(in) :: self
      integer, intent(in) :: b          !< the block's number here
      logical, intent(in) :: finer      !< it is one of the finer level
      real(wp), intent(in) :: time_step !< of the block's level, s
      real(wp), intent(inout) :: tile(node_values, 0:tile_last, 0:tile_last, 0:tile_last) !< in the places of the velocity
      real(wp) :: lead(3), share
      integer :: e, s, at(3), low(3), high(3), i, j, k
      if (.not. finer) then
         tile(2:4, :, :, :) = tile(2:4, :, :, :) + self%lead(:, :, :, :, b)
         return
      end if
      e = self%edge_of(b)
      do s = 1, size(self%edges(e)%slave, 2)
         at = self%edges(e)%slave(:3, s)
         call masters(at, low, high, share)
         lead = 0.0_wp
         do k = low(3), high(3)
            do j = low(2), high(2)
               do i = low(1), high(1)
                  lead = lead + self%down(lead_first:lead_last, i, j, k, e) - self%down(5:7, i, j, k, e)
               end do
            end do
         end do
         tile(2:4, at(1), at(2), at(3)) = tile(2:4, at(1), at(2), at(3)) + 0.5_wp*time_step*share*lead
      end do
   end subroutine lead_of_nodes

   !> The motion of the coarser nodes to the cubes: velocity at the end of their step, acceleration.
   subroutine hand_down(self, coarse)
      class(composite_t), intent(inout) :: self
      type(level_t), intent(in) :: coarse
      real(wp) :: lead(node_values, 0:tile_last, 0:tile_last, 0:tile_last), later(3, 0:tile_last, 0:tile_last, 0:tile_last)
      integer :: e
      later = 0.0_wp
      do e = 1, size(self%edges)
         associate (b => self%edges(e)%parent)
            if (b == 0) cycle
            if (self%labelled) call lead_of_forces(self, coarse, b, coarse%solved(1, :, :, :, b), later, lead)
            call take_cube(self%edges(e), coarse%solved(:, :, :, :, b), lead, self%down(:, :, :, :, e))
         end associate
      end do
   end subroutine hand_down

   pure subroutine take_cube(edge, tile, lead, cube)
      type(edge_t), intent(in) :: edge
      real(wp), intent(in) :: tile(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      real(wp), intent(in) :: lead(node_values, 0:tile_last, 0:tile_last, 0:tile_last) !< in the places of the velocity
      real(wp), intent(out) :: cube(:, 0:, 0:, 0:)
      associate (a => edge%corner, z => edge%corner + cube_last)
         cube(:node_values, :, :, :) = tile(:, a(1):z(1), a(2):z(2), a(3):z(3))
         if (size(cube, 1) > node_values) cube(lead_first:lead_last, :, :, :) = lead(2:4, a(1):z(1), a(2):z(2), a(3):z(3))
      end associate
   end subroutine take_cube

   !> Correct the solved nodes of block b of the coarser level by what the two finer steps really gave the slaves, and hand the
   !> corrected motion down (theory.md, eq. half-steps). `change` is the sum over blocks of replace_in_parents: mass, momentum and change
   !> of force of the slaves, mass of the slaves alone. A node whose mass has more than doubled begins anew with what it carries now.
   subroutine correct(self, coarse, b, time_step, flip_fraction, change)
      class(composite_t), intent(inout) :: self
      type(level_t), intent(inout) :: coarse
      integer, intent(in) :: b
      real(wp), intent(in) :: time_step !< of the coarser level, s
      real(wp), intent(in) :: flip_fraction
      real(wp), intent(inout) :: change(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      real(wp) :: half, mixed, begun(3), start(3), later(3), carried(3), pushed(3)
      real(wp) :: lead(node_values, 0:tile_last, 0:tile_last, 0:tile_last), growth(3, 0:tile_last, 0:tile_last, 0:tile_last)
      integer :: e, i, j, k
      half = 0.5_wp*time_step
      mixed = 1.0_wp - flip_fraction
      growth = change(5:7, :, :, :)
      if (self%labelled .and. self%is_parent(b)) &
         call lead_of_forces(self, coarse, b, change(1, :, :, :), 2.0_wp*growth, lead)
      do k = 0, tile_last
         do j = 0, tile_last
            do i = 0, tile_last
               associate (given => change(:, i, j, k), node => coarse%solved(:, i, j, k, b))
                  if (.not. (given(1) > 0.0_wp .and. abs(given(8)) + abs(given(1) - node(1)) > 0.0_wp)) then
                     given(2:7) = 0.0_wp ! no slaves, at neither time
                     cycle
                  end if
                  pushed = 0.0_wp
                  if (allocated(self%pushed)) pushed = self%pushed(:, i, j, k, b)
                  begun = node(2:4) - half*node(5:7)     ! velocity after the first half
                  carried = (given(1) - given(8))*begun + given(2:4)
                  start = begun
                  if (node(1) < 0.5_wp*given(1)) start = carried/given(1)
                  later = node(1)*(node(5:7) - pushed) + given(1)*pushed + given(5:7) ! force of the second half
                  if (mixed > 0.0_wp) later = later + mixed/half*(carried - given(1)*start)
                  given(5:7) = half*(later/given(1) - node(5:7))
                  given(2:4) = start - begun + merge(1.0_wp, 0.5_wp, mixed > 0.0_wp)*given(5:7)
               end associate
            end do
         end do
      end do
      call constrain_nodes(coarse%grid, coarse%blocks(b)%place, change)
      coarse%solved(2:4, :, :, :, b) = coarse%solved(2:4, :, :, :, b) + change(2:4, :, :, :)
      change(2:4, :, :, :) = coarse%solved(2:4, :, :, :, b)
      coarse%solved(5:7, :, :, :, b) = coarse%solved(5:7, :, :, :, b) + change(5:7, :, :, :)/time_step
      change(5:7, :, :, :) = coarse%solved(5:7, :, :, :, b) + change(5:7, :, :, :)/time_step ! that of the second half
      do e = 1, size(self%edges)
         if (self%edges(e)%parent == b) call take_cube(self%edges(e), change, lead, self%down(:, :, :, :, e))
      end do
      if (self%labelled) call put_ahead(self, b, growth, change(1, :, :, :), half)
   end subroutine correct

   !> The gradients of the coarser particles of block b: half a finer step of what the finer level's force has grown to.
   pure subroutine put_ahead(self, b, growth, mass, half)
      class(composite_t), intent(inout) :: self
      integer, intent(in) :: b
      real(wp), intent(in) :: growth(3, 0:tile_last, 0:tile_last, 0:tile_last) !< of the force in the first of two steps, N
      real(wp), intent(in) :: mass(0:tile_last, 0:tile_last, 0:tile_last)      !< kg
      real(wp), intent(in) :: half                                             !< the finer step, s
      integer :: i, j, k
      do k = 0, tile_last
         do j = 0, tile_last
            do i = 0, tile_last
               if (mass(i, j, k) > 0.0_wp) then
                  self%lead(:, i, j, k, b) = 0.5_wp*half*(self%lead(:, i, j, k, b) + growth(:, i, j, k))/mass(i, j, k)
               else
                  self%lead(:, i, j, k, b) = 0.0_wp
               end if
            end do
         end do
      end do
   end subroutine put_ahead

   !> The cubes from the ranks of the parents to those of the blocks.
   subroutine send_down(self, communicator)
      class(composite_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      call self%exchange(communicator, self%down, upwards=.false.)
   end subroutine send_down

   !> The slaves of a block move with the nodes that they depend on, linearly in time (theory.md, eq. half-steps).
   pure subroutine set_slaves(self, b, remaining, tile)
      class(composite_t), intent(in) :: self
      integer, intent(in) :: b              !< the block's number here
      real(wp), intent(in) :: remaining     !< time from where velocities of this step stand to where those of the coarser one do, s
      real(wp), intent(inout) :: tile(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      real(wp) :: motion(6), share
      integer :: e, s, at(3), low(3), high(3), i, j, k
      e = self%edge_of(b)
      if (e == 0) return
      do s = 1, size(self%edges(e)%slave, 2)
         at = self%edges(e)%slave(:3, s)
         call masters(at, low, high, share)
         motion = 0.0_wp
         do k = low(3), high(3)
            do j = low(2), high(2)
               do i = low(1), high(1)
                  motion = motion + self%down(2:7, i, j, k, e)
               end do
            end do
         end do
         tile(2:4, at(1), at(2), at(3)) = share*(motion(1:3) - remaining*motion(4:6))
         tile(5:7, at(1), at(2), at(3)) = share*motion(4:6)
      end do
   end subroutine set_slaves

   !> One message to and from each rank that shares edges: cubes of own blocks and own parents.
   subroutine exchange(self, communicator, pool, upwards)
      class(composite_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      real(wp), intent(inout), contiguous, asynchronous :: pool(:, :, :, :, :)
      logical, intent(in) :: upwards
      type(MPI_Request) :: requests(2*size(self%ranks))
      type(MPI_Datatype) :: given, taken
      integer :: n, r, sends(size(self%ranks)), receives(size(self%ranks))
      sends = self%cubes(merge(1, 2, upwards), :)
      receives = self%cubes(merge(2, 1, upwards), :)
      n = 0
      do r = 1, size(self%ranks)
         given = self%of_parents(r)
         taken = self%of_blocks(r)
         if (upwards) given = self%of_blocks(r)
         if (upwards) taken = self%of_parents(r)
         if (receives(r) > 0) then
            n = n + 1
            call MPI_Irecv(pool, 1, taken, self%ranks(r), 3, communicator%comm, requests(n))
         end if
         if (sends(r) > 0) then
            n = n + 1
            call MPI_Isend(pool, 1, given, self%ranks(r), 3, communicator%comm, requests(n))
            self%messages = self%messages + 1
            self%bytes = self%bytes + 8_i8*sends(r)*self%values*(cube_last + 1)**3
         end if
      end do
      call MPI_Waitall(n, requests, MPI_STATUSES_IGNORE)
      if (.not. MPI_ASYNC_PROTECTS_NONBLOCKING) call MPI_F_sync_reg(pool)
   end subroutine exchange

   !> Free the datatypes, and the edges.
   subroutine release(self)
      class(composite_t), intent(inout) :: self
      integer :: r
      if (allocated(self%pushed)) deallocate (self%pushed)
      if (.not. allocated(self%edges)) return
      do r = 1, size(self%ranks)
         call MPI_Type_free(self%of_blocks(r))
         call MPI_Type_free(self%of_parents(r))
      end do
      deallocate (self%edges, self%edge_of, self%is_parent, self%receives, self%adds, self%up, self%down, &
                  self%first, self%lead, self%own_mass, self%ranks, self%of_blocks, self%of_parents, self%cubes)
   end subroutine release

end module m_composite
