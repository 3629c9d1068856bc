!> The contact problem of one step: candidates, the nodes they touch, and the operator that turns contact forces into
!> normal velocities through those nodes (theory.md, eq. contact-operator). No rank holds the whole of it.
module m_contact_system
   use mpi_f08
   use m_kinds, only: wp, i8
   use m_communicator, only: communicator_t
   use m_petsc_operator, only: petsc_operator_t
   implicit none
   private
   public :: contact_system_t, nodal_forces_t

   integer, parameter, public :: cell_nodes = 8 !< nodes of the cell around a contact point
   integer, parameter :: width = 4 !< three components and a spare one: one vector register

   !> Nodes that this rank's candidates touch and that candidates of another rank touch too.
   type :: shared_nodes_t
      integer :: rank = -1
      integer, allocatable :: nodes(:)  !< local numbers, in the order of the grid
      integer, allocatable :: theirs(:) !< nodes in the grid that its candidates touch, rising
      real(wp), allocatable :: given(:, :), taken(:, :)
   end type shared_nodes_t

   !> Forces that the candidates of one rank give to nodes.
   type :: nodal_forces_t
      integer, allocatable :: node(:)      !< in the grid, rising
      real(wp), allocatable :: force(:, :) !< (4, :), N; the last is idle
   end type nodal_forces_t

   type, extends(petsc_operator_t) :: contact_system_t
      type(communicator_t) :: communicator
      integer :: candidates = 0
      integer :: nodes = 0
      integer(i8) :: products = 0                !< times the operator was applied, over the run
      integer, allocatable :: node(:, :)         !< (8, candidates): node in the grid, counted from 1; then its local number
      real(wp), allocatable :: weight(:, :)      !< (8, candidates): of the contact point on its nodes
      real(wp), allocatable :: normal(:, :)      !< (4, candidates): the direction in which a force acts; the last is 0
      real(wp), allocatable :: mobility(:, :)    !< (4, nodes): dt/m, 0 for held components, s/kg
      real(wp), allocatable :: force(:, :)       !< (4, nodes): work
      real(wp), allocatable :: scale(:)          !< (candidates): makes the diagonal 1
      real(wp), allocatable :: softness(:)       !< (candidates): what the compliance adds to the diagonal
      integer, allocatable :: grid_node(:)       !< (nodes): node in the grid
      type(shared_nodes_t), allocatable :: shared(:)
   contains
      procedure :: begin
      procedure :: add_candidate
      procedure :: number_nodes
      procedure :: connect
      procedure :: multiply
      procedure :: nodal_forces
      procedure :: set_scale
      procedure, private :: spread
      procedure, private :: exchange
      procedure, private :: collect
   end type contact_system_t

contains

   !> Start an empty system.
   subroutine begin(self, communicator)
      class(contact_system_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      self%communicator = communicator
      self%candidates = 0
      self%nodes = 0
      if (.not. allocated(self%node)) allocate (self%node(cell_nodes, 64), self%weight(cell_nodes, 64), &
                                                   self%normal(width, 64))
   end subroutine begin

   !> Add a candidate: its nodes in the grid, their weights, and the direction in which its force acts.
   subroutine add_candidate(self, node, weight, normal)
      class(contact_system_t), intent(inout) :: self
      integer, intent(in) :: node(cell_nodes)
      real(wp), intent(in) :: weight(cell_nodes), normal(3)
      integer, allocatable :: more_nodes(:, :)
      real(wp), allocatable :: more_weights(:, :), more_normals(:, :)
      integer :: n
      n = self%candidates
      if (n == size(self%node, 2)) then
         allocate (more_nodes(cell_nodes, 2*n), more_weights(cell_nodes, 2*n), more_normals(width, 2*n))
         more_nodes(:, :n) = self%node
         more_weights(:, :n) = self%weight
         more_normals(:, :n) = self%normal
         call move_alloc(more_nodes, self%node)
         call move_alloc(more_weights, self%weight)
         call move_alloc(more_normals, self%normal)
      end if
      self%candidates = n + 1
      self%node(:, n + 1) = node
      self%weight(:, n + 1) = weight
      self%normal(:, n + 1) = [normal, 0.0_wp]
   end subroutine add_candidate

   !> Number the nodes that candidates touch, in the order of the grid, over the range of their numbers.
   subroutine number_nodes(self)
      class(contact_system_t), intent(inout) :: self
      integer, allocatable :: number(:)
      integer :: c, first, last, n
      n = self%candidates
      if (allocated(self%grid_node)) deallocate (self%grid_node)
      if (n == 0) then
         allocate (self%grid_node(0))
      else
         first = minval(self%node(:, :n))
         last = maxval(self%node(:, :n))
         allocate (number(first:last), source=0)
         do c = 1, n
            number(self%node(:, c)) = 1
         end do
         self%nodes = 0
         do c = first, last
            if (number(c) == 0) cycle
            self%nodes = self%nodes + 1
            number(c) = self%nodes
         end do
         allocate (self%grid_node(self%nodes))
         do c = first, last
            if (number(c) > 0) self%grid_node(number(c)) = c
         end do
         do c = 1, n
            self%node(:, c) = number(self%node(:, c))
         end do
      end if
      if (allocated(self%force)) then
         if (size(self%force, 2) >= self%nodes) return
         deallocate (self%force, self%mobility)
      end if
      allocate (self%force(width, self%nodes + self%nodes/2), &
                self%mobility(width, self%nodes + self%nodes/2), source=0.0_wp)
   end subroutine number_nodes

   !> Learn which nodes the neighbour ranks' candidates touch too. Collective among neighbours.
   subroutine connect(self, neighbours)
      class(contact_system_t), intent(inout) :: self
      integer, intent(in) :: neighbours(:)
      type(MPI_Request) :: requests(size(neighbours))
      type(MPI_Status) :: status
      type(MPI_Message) :: message
      integer, allocatable :: theirs(:)
      integer :: count, n
      if (allocated(self%shared)) deallocate (self%shared)
      allocate (self%shared(size(neighbours)))
      do n = 1, size(neighbours)
         call MPI_Isend(self%grid_node, self%nodes, MPI_INTEGER, neighbours(n), 3, self%communicator%comm, requests(n))
      end do
      do n = 1, size(neighbours)
         call MPI_Mprobe(neighbours(n), 3, self%communicator%comm, message, status)
         call MPI_Get_count(status, MPI_INTEGER, count)
         allocate (theirs(count))
         call MPI_Mrecv(theirs, count, MPI_INTEGER, message, MPI_STATUS_IGNORE)
         self%shared(n)%rank = neighbours(n)
         self%shared(n)%nodes = common(self%grid_node, theirs)
         count = size(self%shared(n)%nodes)
         allocate (self%shared(n)%given(width, count), self%shared(n)%taken(width, count))
         call move_alloc(theirs, self%shared(n)%theirs)
      end do
      call MPI_Waitall(size(neighbours), requests, MPI_STATUSES_IGNORE)
   end subroutine connect

   !> Places in `ours` of the values that stand in `theirs` too; both rise.
   pure function common(ours, theirs) result(places)
      integer, intent(in) :: ours(:), theirs(:)
      integer, allocatable :: places(:)
      integer :: found(min(size(ours), size(theirs))), n, a, b
      n = 0
      b = 1
      do a = 1, size(ours)
         do while (b <= size(theirs))
            if (theirs(b) >= ours(a)) exit
            b = b + 1
         end do
         if (b > size(theirs)) exit
         if (theirs(b) /= ours(a)) cycle
         n = n + 1
         found(n) = a
      end do
      places = found(:n)
   end function common

   !> to = M from: normal velocities of the candidates under contact forces, both scaled so that the diagonal of M is 1.
   !> Values beyond the candidates are idle and copied.
   subroutine multiply(self, from, to)
      class(contact_system_t), intent(inout) :: self
      real(wp), intent(in) :: from(:)
      real(wp), intent(out) :: to(:)
      self%products = self%products + 1
      call self%spread(from(:self%candidates)*self%scale(:self%candidates))
      call self%exchange()
      call self%collect(to)
      to(:self%candidates) = to(:self%candidates) + self%softness(:self%candidates)*from(:self%candidates)
      to(self%candidates + 1:) = from(self%candidates + 1:)
   end subroutine multiply

   !> Contact forces of this rank's candidates to their nodes.
   subroutine spread(self, forces)
      class(contact_system_t), intent(inout) :: self
      real(wp), intent(in) :: forces(:) !< (candidates), N
      real(wp) :: f(width)
      integer :: c, i, n, s
      self%force(:, :self%nodes) = 0.0_wp
      do c = 1, self%candidates
         if (abs(forces(c)) <= 0.0_wp) cycle
         f = forces(c)*self%normal(:, c)
         do s = 1, cell_nodes
            n = self%node(s, c)
            !$omp simd
            do i = 1, width
               self%force(i, n) = self%force(i, n) + self%weight(s, c)*f(i)
            end do
         end do
      end do
   end subroutine spread

   !> Collective among neighbours: what the candidates' forces (N) give to nodes, a part for each neighbour rank and this one, by rising
   !> rank, so that all ranks that know a node add up its force in one order. Once after each `connect`, whose lists it takes.
   subroutine nodal_forces(self, forces, parts)
      class(contact_system_t), intent(inout) :: self
      real(wp), intent(in) :: forces(:) !< (candidates), N
      type(nodal_forces_t), allocatable, intent(out) :: parts(:)
      type(MPI_Request) :: requests(2*size(self%shared))
      integer :: n, own, r
      call self%spread(forces)
      own = 1 + count(self%shared%rank < self%communicator%rank)
      allocate (parts(size(self%shared) + 1))
      parts(own)%node = self%grid_node(:self%nodes)
      parts(own)%force = self%force(:, :self%nodes)
      do r = 1, size(self%shared)
         associate (shared => self%shared(r), part => parts(merge(r, r + 1, r < own)))
            call move_alloc(shared%theirs, part%node)
            n = size(part%node)
            allocate (part%force(width, n))
            call MPI_Irecv(part%force, width*n, MPI_DOUBLE_PRECISION, shared%rank, 5, self%communicator%comm, requests(2*r - 1))
            call MPI_Isend(parts(own)%force, width*self%nodes, MPI_DOUBLE_PRECISION, shared%rank, 5, self%communicator%comm, &
                           requests(2*r))
         end associate
      end do
      call MPI_Waitall(size(requests), requests, MPI_STATUSES_IGNORE)
   end subroutine nodal_forces

   !> Add what other ranks' candidates give to the nodes that are shared with them.
   subroutine exchange(self)
      class(contact_system_t), intent(inout) :: self
      type(MPI_Request) :: requests(2*size(self%shared))
      integer :: i, n, count
      n = 0
      do i = 1, size(self%shared)
         associate (shared => self%shared(i))
            count = size(shared%nodes)
            if (count == 0) cycle
            shared%given = self%force(:, shared%nodes)
            call MPI_Irecv(shared%taken, width*count, MPI_DOUBLE_PRECISION, shared%rank, 4, self%communicator%comm, requests(n + 1))
            call MPI_Isend(shared%given, width*count, MPI_DOUBLE_PRECISION, shared%rank, 4, self%communicator%comm, requests(n + 2))
            n = n + 2
         end associate
      end do
      if (n == 0) return
      call MPI_Waitall(n, requests, MPI_STATUSES_IGNORE)
      do i = 1, size(self%shared)
         associate (shared => self%shared(i))
            if (size(shared%nodes) > 0) self%force(:, shared%nodes) = self%force(:, shared%nodes) + shared%taken
         end associate
      end do
   end subroutine exchange

   !> Normal velocities of the candidates from the forces on their nodes.
   subroutine collect(self, y)
      class(contact_system_t), intent(inout) :: self
      real(wp), intent(out) :: y(:)
      real(wp) :: total(width)
      integer :: c, i, n, s
      self%force(:, :self%nodes) = self%force(:, :self%nodes)*self%mobility(:, :self%nodes)
      do c = 1, self%candidates
         total = 0.0_wp
         do s = 1, cell_nodes
            n = self%node(s, c)
            !$omp simd
            do i = 1, width
               total(i) = total(i) + self%weight(s, c)*self%force(i, n)
            end do
         end do
         y(c) = sum(total*self%normal(:, c))*self%scale(c)
      end do
   end subroutine collect

   !> Scale unknowns so that the diagonal is 1 before the compliance is added; needs numbers and mobilities.
   subroutine set_scale(self, compliance)
      class(contact_system_t), intent(inout) :: self
      real(wp), intent(in) :: compliance(:) !< (candidates): of each contact point, s/kg
      real(wp) :: diagonal
      integer :: c, s
      if (allocated(self%scale)) then
         if (size(self%scale) < self%candidates) deallocate (self%scale, self%softness)
      end if
      if (.not. allocated(self%scale)) allocate (self%scale(2*self%candidates + 8), self%softness(2*self%candidates + 8))
      do c = 1, self%candidates
         diagonal = 0.0_wp
         do s = 1, cell_nodes
            diagonal = diagonal + self%weight(s, c)**2*sum(self%normal(:, c)**2*self%mobility(:, self%node(s, c)))
         end do
         self%scale(c) = 0.0_wp
         if (diagonal > 0.0_wp) self%scale(c) = 1.0_wp/sqrt(diagonal)
         self%softness(c) = compliance(c)*self%scale(c)**2
      end do
   end subroutine set_scale

end module m_contact_system
