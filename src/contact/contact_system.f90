!> The contact problem of one step: candidates, the nodes they touch, and the operator that turns contact forces into
!> normal velocities through those nodes (theory.md, eq. contact-operator). No rank holds the whole of it.
module m_contact_system
   use mpi_f08
   use m_kinds, only: wp, i8
   use m_communicator, only: communicator_t
   use m_petsc_operator, only: petsc_operator_t
   implicit none
   private
   public :: contact_system_t

   integer, parameter, public :: cell_nodes = 8 !< nodes of the cell around a contact point
   integer, parameter :: width = 4 !< three components and a spare one: one vector register
   !> Compliance of a contact point, relative to what its own nodes give way: makes the forces unique where more candidates than
   !> nodes share a face. It changes the load by some 1e-4 and leaves an overlap of some 1e-3 cells (doc/accuracy.md).
   real(wp), parameter :: compliance = 5.0e-3_wp

   integer, parameter :: chebyshev_steps = 2           !< of the preconditioner
   real(wp), parameter :: chebyshev_range = 6.0_wp    !< it works on eigenvalues from the bound down to this part of it

   !> Nodes that this rank's candidates touch and that candidates of another rank touch too.
   type :: shared_nodes_t
      integer :: rank = -1
      integer, allocatable :: nodes(:) !< local numbers, in the order of the grid
      real(wp), allocatable :: given(:, :), taken(:, :)
   end type shared_nodes_t

   type, extends(petsc_operator_t) :: contact_system_t
      type(communicator_t) :: communicator
      integer :: candidates = 0
      integer :: nodes = 0
      integer(i8) :: products = 0                !< times the operator was applied, over the run
      integer, allocatable :: node(:, :)         !< (8, candidates): node in the grid, counted from 1; then its local number
      real(wp), allocatable :: direction(:, :, :) !< (4, 8, candidates): weight times normal, as that node sees it
      real(wp), allocatable :: mobility(:, :)    !< (4, nodes): dt/m, 0 for held components, s/kg
      real(wp), allocatable :: force(:, :)       !< (4, nodes): work
      real(wp), allocatable :: scale(:)          !< (candidates): makes the diagonal 1
      real(wp) :: bound = 1.0_wp                 !< no eigenvalue of M is larger
      integer, allocatable :: grid_node(:)       !< (nodes): node in the grid
      type(shared_nodes_t), allocatable :: shared(:)
   contains
      procedure :: begin
      procedure :: add_candidate
      procedure :: number_nodes
      procedure :: connect
      procedure :: multiply
      procedure :: precondition
      procedure :: set_scale
      procedure, private :: bound_rows
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
      if (.not. allocated(self%node)) allocate (self%node(cell_nodes, 64), self%direction(width, cell_nodes, 64))
   end subroutine begin

   !> Add a candidate: its nodes in the grid and the vectors that go with them.
   subroutine add_candidate(self, node, direction)
      class(contact_system_t), intent(inout) :: self
      integer, intent(in) :: node(cell_nodes)
      real(wp), intent(in) :: direction(3, cell_nodes) !< weight times normal, as each node sees it
      integer, allocatable :: more_nodes(:, :)
      real(wp), allocatable :: more_directions(:, :, :)
      integer :: n
      n = self%candidates
      if (n == size(self%node, 2)) then
         allocate (more_nodes(cell_nodes, 2*n), more_directions(width, cell_nodes, 2*n))
         more_nodes(:, :n) = self%node
         more_directions(:, :, :n) = self%direction
         call move_alloc(more_nodes, self%node)
         call move_alloc(more_directions, self%direction)
      end if
      self%candidates = n + 1
      self%node(:, n + 1) = node
      self%direction(:3, :, n + 1) = direction
      self%direction(width, :, n + 1) = 0.0_wp
   end subroutine add_candidate

   !> Number the nodes that candidates touch, in the order of the grid, over the box around them.
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
         deallocate (theirs)
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
      call self%spread(from)
      call self%exchange()
      call self%collect(to)
      to(:self%candidates) = to(:self%candidates) + compliance*from(:self%candidates)
      to(self%candidates + 1:) = from(self%candidates + 1:)
   end subroutine multiply

   !> A few steps of Chebyshev's iteration for M to = from on the unknowns where `from` is not exactly 0: fewer steps of the outer
   !> solver, whose own cost and sums over ranks outweigh a product with M.
   subroutine precondition(self, from, to)
      class(contact_system_t), intent(inout) :: self
      real(wp), intent(in) :: from(:)
      real(wp), intent(out) :: to(:)
      real(wp), dimension(self%candidates) :: left, change, product
      real(wp) :: middle, half_width, ratio, next
      integer :: n, s
      n = self%candidates
      middle = 0.5_wp*self%bound*(1.0_wp + 1.0_wp/chebyshev_range)
      half_width = 0.5_wp*self%bound*(1.0_wp - 1.0_wp/chebyshev_range)
      ratio = half_width/middle
      to(n + 1:) = from(n + 1:)
      left = from(:n)
      change = left/middle
      to(:n) = change
      do s = 2, chebyshev_steps
         call self%multiply(change, product)
         left = merge(left - product, 0.0_wp, abs(from(:n)) > 0.0_wp)
         next = 1.0_wp/(2.0_wp*middle/half_width - ratio)
         change = next*ratio*change + (2.0_wp*next/half_width)*left
         to(:n) = to(:n) + change
         ratio = next
      end do
   end subroutine precondition

   !> Contact forces of this rank's candidates to their nodes.
   subroutine spread(self, x)
      class(contact_system_t), intent(inout) :: self
      real(wp), intent(in) :: x(:)
      real(wp) :: f
      integer :: c, i, n, s
      self%force(:, :self%nodes) = 0.0_wp
      do c = 1, self%candidates
         f = x(c)*self%scale(c)
         if (f == 0.0_wp) cycle
         do s = 1, cell_nodes
            n = self%node(s, c)
            !$omp simd
            do i = 1, width
               self%force(i, n) = self%force(i, n) + f*self%direction(i, s, c)
            end do
         end do
      end do
   end subroutine spread

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
               total(i) = total(i) + self%direction(i, s, c)*self%force(i, n)
            end do
         end do
         y(c) = sum(total)*self%scale(c)
      end do
   end subroutine collect

   !> Collective: scale unknowns so that the diagonal is 1 before the compliance is added; needs numbers, mobilities and neighbours.
   subroutine set_scale(self)
      class(contact_system_t), intent(inout) :: self
      real(wp) :: diagonal
      integer :: c, s
      if (allocated(self%scale)) then
         if (size(self%scale) < self%candidates) deallocate (self%scale)
      end if
      if (.not. allocated(self%scale)) allocate (self%scale(2*self%candidates + 8))
      do c = 1, self%candidates
         diagonal = 0.0_wp
         do s = 1, cell_nodes
            diagonal = diagonal + sum(self%direction(:, s, c)**2*self%mobility(:, self%node(s, c)))
         end do
         self%scale(c) = 0.0_wp
         if (diagonal > 0.0_wp) self%scale(c) = 1.0_wp/sqrt(diagonal)
      end do
      call self%bound_rows()
   end subroutine set_scale

   !> Collective: the largest sum of magnitudes over a row of M (Gershgorin), with the magnitudes of weights and the largest of a
   !> node's mobilities.
   subroutine bound_rows(self)
      class(contact_system_t), intent(inout) :: self
      real(wp) :: row
      integer :: c, s
      self%force(:, :self%nodes) = 0.0_wp
      do c = 1, self%candidates
         do s = 1, cell_nodes
            associate (node => self%node(s, c))
               self%force(1, node) = self%force(1, node) + self%scale(c)*norm2(self%direction(:3, s, c))
            end associate
         end do
      end do
      call self%exchange()
      self%bound = 0.0_wp
      do c = 1, self%candidates
         row = 0.0_wp
         do s = 1, cell_nodes
            associate (node => self%node(s, c))
               row = row + norm2(self%direction(:3, s, c))*maxval(self%mobility(:3, node))*self%force(1, node)
            end associate
         end do
         self%bound = max(self%bound, self%scale(c)*row)
      end do
      self%bound = self%communicator%maximum(self%bound) + compliance
   end subroutine bound_rows

end module m_contact_system
