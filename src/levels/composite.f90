!> One composite space of two levels: the nodes of the finer one that are not inside its region are slaves of the nodes of the
!> coarser one (theory.md, eqs constrained, restriction, half-steps).
!>
!> Between an edge block (m_edge) and its parent travels one cube of nodes each way: up what the slaves were given, down how they
!> move. Ranks exchange one message a neighbour and way.
module m_composite
   use mpi_f08
   use m_kinds, only: wp, i8
   use m_constants, only: block_size
   use m_sorting, only: sorted_order
   use m_communicator, only: communicator_t
   use m_level, only: level_t, fit_pool, tile_last, node_values
   use m_boundary, only: constrain_nodes
   use m_edge, only: edge_t, has_slaves, list_slaves, gather_slaves, take_lead, take_cube, take_leads, set_motion, set_leads, &
                     cube_last, lead_first, lead_last
   implicit none
   private
   public :: composite_t, clear_covered

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
      logical :: labelled = .false.         !< particles at the edge have been pushed to different times, and carry velocity
                                            !< gradients
      integer, private :: values = node_values !< of a node of a cube; 3 more where there are labels
      integer, allocatable, private :: by_index(:) !< edges with their parent here, by rising index of the block: the order in which
                                                   !< a parent adds
      real(wp), allocatable, private :: up(:, :, :, :, :), down(:, :, :, :, :) !< (values, 0:5, 0:5, 0:5, edges)
      real(wp), allocatable, private :: first(:, :, :, :, :) !< what was handed up in the first of two steps, of the own edges
      real(wp), allocatable :: pushed(:, :, :, :, :) !< what effects on nodes add to the acceleration of the coarser ones, where
                                                     !< there are any: (3, 0:9, 0:9, 0:9, blocks), m/s2
      integer, allocatable, private :: receiver(:) !< number of a block among those that receive, 0 for others
      real(wp), allocatable, private :: grown(:, :, :, :, :) !< eq. lead, of the nodes of these: force of the finer level that has
                                                             !< grown, N, (3, 0:9, 0:9, 0:9, receivers)
      real(wp), allocatable, private :: ahead(:, :, :, :, :) !< and the velocity that gradients of coarser particles are ahead by,
                                                             !< m/s
      real(wp), allocatable, private :: own_mass(:, :, :, :) !< of the nodes of blocks that add to sums of what is handed up,
                                                             !< without that: (0:9, 0:9, 0:9, blocks)
      integer, allocatable, private :: ranks(:)
      type(MPI_Datatype), allocatable, private :: of_blocks(:), of_parents(:) !< cubes shared with each rank: of own blocks, own
                                                                              !< parents
      integer, allocatable, private :: cubes(:, :) !< how many these are: (2, ranks)
   contains
      procedure :: build
      procedure :: restrict
      procedure :: restrict_change
      procedure :: add_to_parents
      procedure :: hand_up_change
      procedure :: hand_up_grown
      procedure :: keep_grown
      procedure :: lead_slaves
      procedure :: lead_masters
      procedure :: hand_down
      procedure :: correct
      procedure :: send_down
      procedure :: set_slaves
      procedure :: release
      procedure, private :: exchange
   end type composite_t

contains

   !> Edges, cubes and messages of the blocks as they are.
   subroutine build(self, communicator, coarse, fine)
      class(composite_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(inout) :: coarse !< gets tiles for what is handed up
      type(level_t), intent(in) :: fine
      integer :: index, n, pass, place(3), parent(3), b
      call self%release()
      self%labelled = fine%layout%labels_gradients()
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
      self%receiver = merge([(count(self%receives(:b)), b=1, size(self%receives))], 0, self%receives)
      n = merge(count(self%receives), 0, self%labelled)
      allocate (self%grown(3, 0:tile_last, 0:tile_last, 0:tile_last, n), source=0.0_wp)
      allocate (self%ahead(3, 0:tile_last, 0:tile_last, 0:tile_last, n), source=0.0_wp)
      allocate (self%own_mass(0:tile_last, 0:tile_last, 0:tile_last, size(coarse%blocks)))
      call fit_pool(coarse%handed, size(coarse%blocks) + size(coarse%mirror_index))
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

   !> Nodes of the coarser level inside the region have no particles; what a particle that touches the edge gives them by rounding
   !> is dropped. It would be a node of hardly any mass, with an acceleration without bound.
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
                  if (fine%region%is_inner(2*(first + [i, j, k]))) coarse%nodes(:, i, j, k, b) = 0.0_wp
               end do
            end do
         end do
      end do
   end subroutine clear_covered

   !> What the slaves were given, to the cubes: mass, momentum less what it is ahead by, force, with the weights of eq. constrained.
   !> `nodes` of the finer level holds sums. Kept as that of a first step.
   subroutine restrict(self, communicator, fine, half)
      class(composite_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(inout) :: fine !< a work list of it is used
      real(wp), intent(in) :: half !< the finer step, s
      integer :: e
      do e = 1, self%own
         call gather_slaves(self%edges(e), fine%grid, fine%blocks(self%edges(e)%block)%place, &
                            fine%nodes(:, :, :, :, self%edges(e)%block), fine%layout%gradient > 0, self%up(:, :, :, :, e))
      end do
      self%first = self%up(:, :, :, :, :self%own)
      if (fine%layout%edge_stress > 0) then
         do e = 1, self%own
            call take_lead(self%edges(e), fine, half, self%up(:, :, :, :, e))
         end do
      end if
      call self%exchange(communicator, self%up, upwards=.true.)
   end subroutine restrict

   !> The same in the second of two steps: mass (1 and 8), momentum (2 to 4), the change of force since the first (5 to 7).
   subroutine restrict_change(self, communicator, fine)
      class(composite_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(in) :: fine
      integer :: e
      do e = 1, self%own
         associate (up => self%up(:, :, :, :, e), first => self%first(:, :, :, :, e))
            call gather_slaves(self%edges(e), fine%grid, fine%blocks(self%edges(e)%block)%place, &
                               fine%nodes(:, :, :, :, self%edges(e)%block), fine%layout%gradient > 0, up)
            up(8, :, :, :) = up(1, :, :, :)
            up(5:7, :, :, :) = up(5:7, :, :, :) - first(5:7, :, :, :)
         end associate
      end do
      call self%exchange(communicator, self%up, upwards=.true.)
   end subroutine restrict_change

   !> Before the sum over blocks of the coarser level: add the cubes to what its own particles gave.
   subroutine add_to_parents(self, coarse)
      class(composite_t), intent(inout) :: self
      type(level_t), intent(inout) :: coarse
      integer :: b
      do b = 1, size(coarse%blocks)
         if (self%adds(b)) self%own_mass(:, :, :, b) = coarse%nodes(1, :, :, :, b)
      end do
      call add_cubes(self, coarse%nodes)
   end subroutine add_to_parents

   subroutine add_cubes(self, tiles)
      class(composite_t), intent(in) :: self
      real(wp), intent(inout) :: tiles(node_values, 0:tile_last, 0:tile_last, 0:tile_last, *)
      integer :: c, e
      do c = 1, size(self%by_index)
         e = self%by_index(c)
         associate (a => self%edges(e)%corner, z => self%edges(e)%corner + cube_last, b => self%edges(e)%parent)
            tiles(:, a(1):z(1), a(2):z(2), a(3):z(3), b) = tiles(:, a(1):z(1), a(2):z(2), a(3):z(3), b) &
                                                           + self%up(:node_values, :, :, :, e)
         end associate
      end do
   end subroutine add_cubes

   !> In the second of two finer steps: the mass that the particles of the coarser level gave, and the cubes, as `handed`.
   subroutine hand_up_change(self, coarse)
      class(composite_t), intent(in) :: self
      type(level_t), intent(inout) :: coarse
      integer :: b
      do b = 1, size(coarse%blocks)
         if (.not. self%adds(b)) cycle
         coarse%handed(1, :, :, :, b) = self%own_mass(:, :, :, b)
         coarse%handed(2:, :, :, :, b) = 0.0_wp
      end do
      call add_cubes(self, coarse%handed)
   end subroutine hand_up_change

   !> Between the two sums of a coarser step a third, where there are labels: the forces that have grown, in place of momenta, as
   !> `handed`.
   subroutine hand_up_grown(self, coarse)
      class(composite_t), intent(in) :: self
      type(level_t), intent(inout) :: coarse
      integer :: b, c, e
      do b = 1, size(coarse%blocks)
         if (self%adds(b)) coarse%handed(:, :, :, :, b) = 0.0_wp
      end do
      do c = 1, size(self%by_index)
         e = self%by_index(c)
         associate (a => self%edges(e)%corner, z => self%edges(e)%corner + cube_last, b => self%edges(e)%parent)
            coarse%handed(2:4, a(1):z(1), a(2):z(2), a(3):z(3), b) = coarse%handed(2:4, a(1):z(1), a(2):z(2), a(3):z(3), b) &
                                                                     + self%up(lead_first:lead_last, :, :, :, e)
         end associate
      end do
   end subroutine hand_up_grown

   !> The sum of that over blocks and ranks, for block b, which receives.
   subroutine keep_grown(self, b, sums)
      class(composite_t), intent(inout) :: self
      integer, intent(in) :: b
      real(wp), intent(in) :: sums(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      self%grown(:, :, :, :, self%receiver(b)) = sums(2:4, :, :, :)
   end subroutine keep_grown

   !> What velocity gradients of slaves are to know of the forces on the nodes of a parent, as an acceleration in the places of a
   !> velocity, inside the boundary conditions: of the finer level's force what has grown, and what effects push all nodes with.
   pure subroutine known_to_gradients(self, coarse, b, mass, growth, tile)
      class(composite_t), intent(in) :: self
      type(level_t), intent(in) :: coarse
      integer, intent(in) :: b
      real(wp), intent(in) :: mass(0:tile_last, 0:tile_last, 0:tile_last)      !< kg
      real(wp), intent(in) :: growth(3, 0:tile_last, 0:tile_last, 0:tile_last) !< of the force until it will be taken back, N
      real(wp), intent(out) :: tile(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      integer :: i, j, k
      tile = 0.0_wp
      do k = 0, tile_last
         do j = 0, tile_last
            do i = 0, tile_last
               if (.not. mass(i, j, k) > 0.0_wp) cycle
               tile(2:4, i, j, k) = (self%grown(:, i, j, k, self%receiver(b)) + growth(:, i, j, k))/mass(i, j, k)
               if (allocated(self%pushed)) tile(2:4, i, j, k) = tile(2:4, i, j, k) + self%pushed(:, i, j, k, b)
            end do
         end do
      end do
      call constrain_nodes(coarse%grid, coarse%blocks(b)%place, tile)
   end subroutine known_to_gradients

   !> Set the velocity by which gradients are ahead of the motion (eq. lead) on the slaves of block b of the finer level, which has
   !> some.
   pure subroutine lead_slaves(self, b, time_step, asked, tile)
      class(composite_t), intent(in) :: self
      integer, intent(in) :: b
      real(wp), intent(in) :: time_step  !< of the finer level, s
      integer, intent(in) :: asked(2, 3) !< first and last index along each axis of what is asked for
      real(wp), intent(inout) :: tile(node_values, 0:tile_last, 0:tile_last, 0:tile_last) !< in the places of the velocity
      call set_leads(self%edges(self%edge_of(b)), self%down(:, :, :, :, self%edge_of(b)), time_step, asked, tile)
   end subroutine lead_slaves

   !> Add the same on the nodes of block b of the coarser level, which receives.
   pure subroutine lead_masters(self, b, tile)
      class(composite_t), intent(in) :: self
      integer, intent(in) :: b
      real(wp), intent(inout) :: tile(node_values, 0:tile_last, 0:tile_last, 0:tile_last) !< in the places of the velocity
      tile(2:4, :, :, :) = tile(2:4, :, :, :) + self%ahead(:, :, :, :, self%receiver(b))
   end subroutine lead_masters

   !> The motion of the coarser nodes to the cubes: velocity at the end of their step, acceleration.
   subroutine hand_down(self, coarse)
      class(composite_t), intent(inout) :: self
      type(level_t), intent(in) :: coarse
      real(wp) :: known(node_values, 0:tile_last, 0:tile_last, 0:tile_last), growth(3, 0:tile_last, 0:tile_last, 0:tile_last)
      integer :: b
      growth = 0.0_wp
      do b = 1, size(coarse%blocks)
         if (.not. self%is_parent(b)) cycle
         if (self%labelled) call known_to_gradients(self, coarse, b, coarse%nodes(1, :, :, :, b), growth, known)
         call take_cubes(self, b, coarse%nodes(:, :, :, :, b), known)
      end do
   end subroutine hand_down

   !> Cubes of all children of a parent.
   pure subroutine take_cubes(self, b, tile, known)
      class(composite_t), intent(inout) :: self
      integer, intent(in) :: b
      real(wp), intent(in) :: tile(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      real(wp), intent(in) :: known(node_values, 0:tile_last, 0:tile_last, 0:tile_last) !< to gradients; used where there are labels
      integer :: e
      do e = 1, size(self%edges)
         if (self%edges(e)%parent /= b) cycle
         call take_cube(self%edges(e), tile, self%down(:, :, :, :, e))
         if (self%labelled) call take_leads(self%edges(e), known, self%down(:, :, :, :, e))
      end do
   end subroutine take_cubes

   !> Correct the solved nodes of block b of the coarser level by what the two finer steps really gave the slaves, and hand the
   !> corrected motion down (theory.md, eq. half-steps). `change` is the sum over blocks of hand_up_change: mass, momentum and
   !> change of force of the slaves, mass of the slaves alone. A node whose mass has more than doubled begins anew with what it
   !> carries now.
   subroutine correct(self, coarse, b, time_step, flip_fraction, change)
      class(composite_t), intent(inout) :: self
      type(level_t), intent(inout) :: coarse
      integer, intent(in) :: b
      real(wp), intent(in) :: time_step !< of the coarser level, s
      real(wp), intent(in) :: flip_fraction
      real(wp), intent(inout) :: change(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      real(wp) :: half, mixed, begun(3), start(3), later(3), carried(3), pushed(3)
      real(wp) :: known(node_values, 0:tile_last, 0:tile_last, 0:tile_last), growth(3, 0:tile_last, 0:tile_last, 0:tile_last)
      integer :: i, j, k
      half = 0.5_wp*time_step
      mixed = 1.0_wp - flip_fraction
      growth = change(5:7, :, :, :)
      if (self%labelled .and. self%is_parent(b)) &
         call known_to_gradients(self, coarse, b, change(1, :, :, :), 2.0_wp*growth, known)
      do k = 0, tile_last
         do j = 0, tile_last
            do i = 0, tile_last
               associate (given => change(:, i, j, k), node => coarse%nodes(:, i, j, k, b))
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
      do k = 0, tile_last
         do j = 0, tile_last
            do i = 0, tile_last
               associate (given => change(:, i, j, k), node => coarse%nodes(:, i, j, k, b))
                  pushed = given(5:7)/time_step
                  node(2:4) = node(2:4) + given(2:4)
                  node(5:7) = node(5:7) + pushed
                  given(2:4) = node(2:4)
                  given(5:7) = node(5:7) + pushed ! that of the second half
               end associate
            end do
         end do
      end do
      if (self%is_parent(b)) call take_cubes(self, b, change, known)
      if (self%labelled) call put_ahead(self, b, growth, change(1, :, :, :), half)
   end subroutine correct

   !> The gradients of the coarser particles of block b: half a finer step of what the finer level's force has grown to.
   pure subroutine put_ahead(self, b, growth, mass, half)
      class(composite_t), intent(inout) :: self
      integer, intent(in) :: b
      real(wp), intent(in) :: growth(3, 0:tile_last, 0:tile_last, 0:tile_last) !< of the force in the first of two steps, N
      real(wp), intent(in) :: mass(0:tile_last, 0:tile_last, 0:tile_last)      !< kg
      real(wp), intent(in) :: half                                             !< the finer step, s
      integer :: i, j, k, r
      r = self%receiver(b)
      do k = 0, tile_last
         do j = 0, tile_last
            do i = 0, tile_last
               if (mass(i, j, k) > 0.0_wp) then
                  self%ahead(:, i, j, k, r) = 0.5_wp*half*(self%grown(:, i, j, k, r) + growth(:, i, j, k))/mass(i, j, k)
               else
                  self%ahead(:, i, j, k, r) = 0.0_wp
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
      call set_motion(self%edges(self%edge_of(b)), self%down(:, :, :, :, self%edge_of(b)), remaining, tile)
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
                  self%first, self%receiver, self%grown, self%ahead, self%own_mass, self%ranks, self%of_blocks, self%of_parents, &
                  self%cubes)
   end subroutine release

end module m_composite
