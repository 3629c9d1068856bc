!> The contact problem of one step: its rows (a contact point and a direction), the nodes they touch, and the operator that turns
!> contact forces into velocities through those nodes and through tools that give way (theory.md, eq. contact-operator). No rank
!> holds the whole of it. Products take the active rows only: those of the normal forces, or those of friction.
module m_contact_system
   use mpi_f08
   use m_kinds, only: wp, i8
   use m_communicator, only: communicator_t
   use m_petsc_operator, only: petsc_operator_t
   use m_cell_rows, only: cell_rows_t, width
   implicit none
   private
   public :: contact_system_t, nodal_forces_t

   !> Nodes that this rank's rows touch and that rows of another rank touch too.
   type :: shared_nodes_t
      integer :: rank = -1
      integer, allocatable :: nodes(:)  !< local numbers, in the order of the grid
      integer(i8), allocatable :: theirs(:) !< nodes in the grid that its rows touch, rising
      real(wp), allocatable :: given(:, :), taken(:, :) !< (3, :), N
   end type shared_nodes_t

   !> Forces that the rows of one rank give to nodes.
   type :: nodal_forces_t
      integer(i8), allocatable :: node(:)  !< in the grid, rising
      real(wp), allocatable :: force(:, :) !< (4, :), N; the last is idle
   end type nodal_forces_t

   type, extends(petsc_operator_t) :: contact_system_t
      type(communicator_t) :: communicator
      integer :: rows = 0
      integer :: first = 1, last = 0             !< the active rows: of the normal forces, of friction, or both
      integer :: normal = 0                      !< rows of normal forces; those of friction follow
      integer :: nodes = 0
      logical :: gives_way = .false.             !< some tool does
      integer(i8) :: products = 0                !< times the operator was applied, over the run
      integer :: extent(3) = 0                   !< nodes of the grid along each axis, from -1 on
      integer, allocatable :: begins(:)          !< (rows + 1): first entry of each row; an entry is one of its nodes
      integer, allocatable :: place(:, :)        !< (3, entries): node in the grid, from -1
      integer, allocatable :: node(:)            !< (entries): the same, local number
      real(wp), allocatable :: weight(:)         !< (entries): of the contact point on the node
      real(wp), allocatable :: direction(:, :)   !< (4, rows): in which a force acts; the last is 0
      type(cell_rows_t) :: normal_rows, friction_rows !< as products take them
      integer, allocatable :: tool(:)            !< (rows)
      real(wp), allocatable :: along(:)          !< (rows): what of the direction is along the tool's axis
      real(wp), allocatable :: tool_mobility(:)  !< (tools): along their axes, s/kg; 0 for those that do not give way
      real(wp), allocatable :: tool_push(:)      !< (tools): forces along the axes, work
      real(wp), allocatable :: mobility(:, :)    !< (4, nodes): dt/m, 0 for held components, s/kg
      real(wp), allocatable :: force(:, :)       !< (4, nodes): work
      real(wp), allocatable :: scale(:)          !< (rows): makes the diagonal 1
      real(wp), allocatable :: softness(:)       !< (rows): what the compliance adds to the diagonal
      integer(i8), allocatable :: grid_node(:)   !< (nodes): number in the grid, from 1, x fastest; rising
      type(shared_nodes_t), allocatable :: shared(:)
   contains
      procedure :: begin
      procedure :: activate
      procedure :: add_row
      procedure :: number_nodes
      procedure :: connect
      procedure :: multiply
      procedure :: respond
      procedure :: nodal_forces
      procedure :: place_of
      procedure :: set_scale
      procedure :: pair_scales
      procedure, private :: make_room
      procedure, private :: spread
      procedure, private :: share
      procedure, private :: collect
   end type contact_system_t

contains

   !> Start an empty system.
   subroutine begin(self, communicator, cells, tool_mobility)
      class(contact_system_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      integer, intent(in) :: cells(3)          !< of the grid
      real(wp), intent(in) :: tool_mobility(:) !< (tools), the same on all ranks, s/kg
      self%communicator = communicator
      self%rows = 0
      self%nodes = 0
      self%extent = cells + 3
      self%tool_mobility = tool_mobility
      self%tool_push = 0.0_wp*tool_mobility
      self%gives_way = any(tool_mobility > 0.0_wp)
      if (.not. allocated(self%place)) allocate (self%place(3, 512), self%weight(512), self%begins(65), &
                                                 self%direction(width, 64), self%tool(64), self%along(64))
      self%begins(1) = 1
   end subroutine begin

   !> Add a row: the nodes of its contact point in the grid, their weights, the direction in which its force acts; the tool that
   !> the force acts on in turn, and what of it is along the tool's axis.
   subroutine add_row(self, place, weight, direction, tool, along)
      class(contact_system_t), intent(inout) :: self
      integer, intent(in) :: place(:, :), tool !< (3, nodes), as many as rows of cells or bins have
      real(wp), intent(in) :: weight(:), direction(3), along
      integer :: last, n
      n = self%rows + 1
      last = self%begins(n) + size(weight) - 1
      call self%make_room(n, last)
      self%rows = n
      self%begins(n + 1) = last + 1
      self%place(:, self%begins(n):last) = place
      self%weight(self%begins(n):last) = weight
      self%direction(:, n) = [direction, 0.0_wp]
      self%tool(n) = tool
      self%along(n) = along
   end subroutine add_row

   !> Room for so many rows and entries.
   subroutine make_room(self, rows, entries)
      class(contact_system_t), intent(inout) :: self
      integer, intent(in) :: rows, entries
      integer, allocatable :: more_places(:, :), more_begins(:), more_tools(:)
      real(wp), allocatable :: more_weights(:), more_directions(:, :), more_along(:)
      integer :: n
      n = size(self%weight)
      if (entries > n) then
         allocate (more_places(3, 2*n + entries), more_weights(2*n + entries))
         more_places(:, :n) = self%place
         more_weights(:n) = self%weight
         call move_alloc(more_places, self%place)
         call move_alloc(more_weights, self%weight)
      end if
      n = size(self%tool)
      if (rows > n) then
         allocate (more_begins(2*n + 1), more_directions(width, 2*n), more_tools(2*n), more_along(2*n))
         more_begins(:n + 1) = self%begins
         more_directions(:, :n) = self%direction
         more_tools(:n) = self%tool
         more_along(:n) = self%along
         call move_alloc(more_begins, self%begins)
         call move_alloc(more_directions, self%direction)
         call move_alloc(more_tools, self%tool)
         call move_alloc(more_along, self%along)
      end if
   end subroutine make_room

   !> Choose the rows that products take and give: those of the normal forces, those of friction, or all.
   pure subroutine activate(self, first, last)
      class(contact_system_t), intent(inout) :: self
      integer, intent(in) :: first, last
      self%first = first
      self%last = last
   end subroutine activate

   !> All rows are there: number the nodes that they touch, in the order of the grid, and put the rows of a cell together.
   subroutine number_nodes(self, normal)
      class(contact_system_t), intent(inout) :: self
      integer, intent(in) :: normal !< rows of normal forces, the first ones
      integer, allocatable :: x(:), y(:), z(:)                   ! the places along each axis that occur, rising
      integer, allocatable :: x_rank(:), y_rank(:), z_rank(:)    ! which of them a place is
      integer, allocatable :: number(:, :, :)
      integer :: entries, i, j, k, s
      entries = self%begins(self%rows + 1) - 1
      call list_places(self%place(1, :entries), x, x_rank)
      call list_places(self%place(2, :entries), y, y_rank)
      call list_places(self%place(3, :entries), z, z_rank)
      allocate (number(size(x), size(y), size(z)), source=0)
      do s = 1, entries
         associate (at => self%place(:, s))
            number(x_rank(at(1)), y_rank(at(2)), z_rank(at(3))) = 1
         end associate
      end do
      self%nodes = count(number > 0)
      if (allocated(self%grid_node)) deallocate (self%grid_node)
      allocate (self%grid_node(self%nodes))
      s = 0
      do k = 1, size(z)
         do j = 1, size(y)
            do i = 1, size(x)
               if (number(i, j, k) == 0) cycle
               s = s + 1
               number(i, j, k) = s
               self%grid_node(s) = grid_number(self%extent, [x(i), y(j), z(k)])
            end do
         end do
      end do
      if (allocated(self%node)) then
         if (size(self%node) < entries) deallocate (self%node)
      end if
      if (.not. allocated(self%node)) allocate (self%node(size(self%weight)))
      do s = 1, entries
         associate (at => self%place(:, s))
            self%node(s) = number(x_rank(at(1)), y_rank(at(2)), z_rank(at(3)))
         end associate
      end do
      self%normal = normal
      call self%normal_rows%sort(self%nodes, self%begins(:normal + 1), self%node, self%weight, self%direction(:, :normal))
      call self%friction_rows%sort(self%nodes, self%begins(normal + 1:self%rows + 1), self%node, self%weight, &
                                   self%direction(:, normal + 1:self%rows))
      if (allocated(self%force)) then
         if (size(self%force, 2) >= self%nodes) return
         deallocate (self%force, self%mobility)
      end if
      allocate (self%force(width, self%nodes + self%nodes/2), &
                self%mobility(width, self%nodes + self%nodes/2), source=0.0_wp)
   end subroutine number_nodes

   !> The places along an axis that occur, rising, and which of them a place is; 0 where it does not occur.
   pure subroutine list_places(at, places, rank)
      integer, intent(in) :: at(:)
      integer, allocatable, intent(out) :: places(:)
      integer, allocatable, intent(out) :: rank(:) !< from the lowest place to the highest
      integer :: i, p
      allocate (rank(minval(at):maxval(at)), source=0)
      do i = 1, size(at)
         rank(at(i)) = 1
      end do
      allocate (places(sum(rank)))
      i = 0
      do p = lbound(rank, 1), ubound(rank, 1)
         if (rank(p) == 0) cycle
         i = i + 1
         rank(p) = i
         places(i) = p
      end do
   end subroutine list_places

   !> Number of a node in the grid, from 1, x fastest: there may be more than 2**31.
   pure integer(i8) function grid_number(extent, place)
      integer, intent(in) :: extent(3), place(3) !< places from -1 on
      grid_number = place(1) + 2 + extent(1)*(place(2) + 1 + extent(2)*(place(3) + 1_i8))
   end function grid_number

   !> Place in the grid, from -1 on, of a node by its number.
   pure function place_of(self, number) result(place)
      class(contact_system_t), intent(in) :: self
      integer(i8), intent(in) :: number
      integer :: place(3)
      integer(i8) :: n(3)
      n = self%extent
      place = int([mod(number - 1, n(1)), mod((number - 1)/n(1), n(2)), (number - 1)/(n(1)*n(2))] - 1)
   end function place_of

   !> Learn which nodes the neighbour ranks' rows touch too. Collective among neighbours.
   subroutine connect(self, neighbours)
      class(contact_system_t), intent(inout) :: self
      integer, intent(in) :: neighbours(:)
      type(MPI_Request) :: requests(size(neighbours))
      type(MPI_Status) :: status
      type(MPI_Message) :: message
      integer(i8), allocatable :: theirs(:)
      integer :: count, n
      if (allocated(self%shared)) deallocate (self%shared)
      allocate (self%shared(size(neighbours)))
      do n = 1, size(neighbours)
         call MPI_Isend(self%grid_node, self%nodes, MPI_INTEGER8, neighbours(n), 3, self%communicator%comm, requests(n))
      end do
      do n = 1, size(neighbours)
         call MPI_Mprobe(neighbours(n), 3, self%communicator%comm, message, status)
         call MPI_Get_count(status, MPI_INTEGER8, count)
         allocate (theirs(count))
         call MPI_Mrecv(theirs, count, MPI_INTEGER8, message, MPI_STATUS_IGNORE)
         self%shared(n)%rank = neighbours(n)
         self%shared(n)%nodes = common(self%grid_node, theirs)
         count = size(self%shared(n)%nodes)
         allocate (self%shared(n)%given(3, count), self%shared(n)%taken(3, count))
         call move_alloc(theirs, self%shared(n)%theirs)
      end do
      call MPI_Waitall(size(neighbours), requests, MPI_STATUSES_IGNORE)
   end subroutine connect

   !> Places in `ours` of the values that stand in `theirs` too; both rise.
   pure function common(ours, theirs) result(places)
      integer(i8), intent(in) :: ours(:), theirs(:)
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

   !> to = M from: velocities of the active rows under their forces, both scaled so that the diagonal of M is 1. Values beyond them
   !> are idle and copied.
   subroutine multiply(self, from, to)
      class(contact_system_t), intent(inout) :: self
      real(wp), intent(in) :: from(:)
      real(wp), intent(out) :: to(:)
      real(wp) :: push(self%last - self%first + 1)
      integer :: n
      n = size(push)
      self%products = self%products + 1
      push = from(:n)*self%scale(self%first:self%last)
      call self%share(push)
      call self%collect(push)
      to(:n) = push + self%softness(self%first:self%last)*from(:n)
      to(n + 1:) = from(n + 1:)
   end subroutine multiply

   !> Collective: velocities that the forces of some rows give to others, both scaled. The others stay active.
   subroutine respond(self, pushed, from, asked, to)
      class(contact_system_t), intent(inout) :: self
      integer, intent(in) :: pushed(2), asked(2) !< first and last row
      real(wp), intent(in) :: from(:)
      real(wp), intent(out) :: to(:)
      self%products = self%products + 1
      call self%activate(pushed(1), pushed(2))
      call self%share(from*self%scale(self%first:self%last))
      call self%activate(asked(1), asked(2))
      call self%collect(to)
   end subroutine respond

   !> Contact forces of this rank's active rows to their nodes and tools.
   subroutine spread(self, forces)
      class(contact_system_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: forces(:) !< (active rows), N
      integer :: c
      self%force(:, :self%nodes) = 0.0_wp
      if (self%first <= self%normal) call self%normal_rows%spread(forces, self%force)
      if (self%last > self%normal) call self%friction_rows%spread(forces(self%normal - self%first + 2:), self%force)
      if (.not. self%gives_way) return
      self%tool_push = 0.0_wp
      do c = self%first, self%last
         self%tool_push(self%tool(c)) = self%tool_push(self%tool(c)) + self%along(c)*forces(c - self%first + 1)
      end do
   end subroutine spread

   !> Collective among neighbours: what the active rows' forces (N) give to nodes, a part for each neighbour rank and this one, by
   !> rising rank, so that all ranks that know a node add up its force in one order. Once after each `connect`: it takes its lists.
   subroutine nodal_forces(self, forces, parts)
      class(contact_system_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: forces(:) !< (rows), N
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

   !> Collective: contact forces of the active rows of all ranks to the nodes that this one's rows touch, and to tools that give
   !> way. Messages find their receives there when they come.
   subroutine share(self, forces)
      class(contact_system_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: forces(:) !< of this rank's, N
      type(MPI_Request) :: requests(2*size(self%shared))
      integer :: i, last, n
      last = 0
      do i = 1, size(self%shared)
         associate (it => self%shared(i))
            if (size(it%nodes) == 0) cycle
            last = last + 1
            call MPI_Irecv(it%taken, size(it%taken), MPI_DOUBLE_PRECISION, it%rank, 4, self%communicator%comm, requests(last))
         end associate
      end do
      call self%spread(forces)
      do i = 1, size(self%shared)
         associate (it => self%shared(i))
            if (size(it%nodes) == 0) cycle
            do n = 1, size(it%nodes)
               it%given(1:3, n) = self%force(1:3, it%nodes(n))
            end do
            last = last + 1
            call MPI_Isend(it%given, size(it%given), MPI_DOUBLE_PRECISION, it%rank, 4, self%communicator%comm, requests(last))
         end associate
      end do
      if (self%gives_way) call MPI_Allreduce(MPI_IN_PLACE, self%tool_push, size(self%tool_push), MPI_DOUBLE_PRECISION, MPI_SUM, &
                                             self%communicator%comm)
      if (last == 0) return
      call MPI_Waitall(last, requests, MPI_STATUSES_IGNORE)
      do i = 1, size(self%shared)
         associate (it => self%shared(i))
            do n = 1, size(it%nodes)
               self%force(1:3, it%nodes(n)) = self%force(1:3, it%nodes(n)) + it%taken(1:3, n)
            end do
         end associate
      end do
   end subroutine share

   !> Velocities of the active rows from the forces on their nodes, and relative to tools that give way, scaled.
   subroutine collect(self, y)
      class(contact_system_t), intent(inout) :: self
      real(wp), intent(inout), contiguous :: y(:) !< (active rows)
      integer :: c, n
      do n = 1, self%nodes
         do c = 1, width
            self%force(c, n) = self%force(c, n)*self%mobility(c, n)
         end do
      end do
      if (self%first <= self%normal) call self%normal_rows%collect(self%force, y)
      if (self%last > self%normal) call self%friction_rows%collect(self%force, y(self%normal - self%first + 2:))
      y = y*self%scale(self%first:self%last)
      if (.not. self%gives_way) return
      self%tool_push = self%tool_push*self%tool_mobility
      do c = self%first, self%last
         y(c - self%first + 1) = y(c - self%first + 1) + self%along(c)*self%tool_push(self%tool(c))*self%scale(c)
      end do
   end subroutine collect

   !> Scale unknowns so that the diagonal is 1 before the compliance is added; needs numbers and mobilities.
   subroutine set_scale(self, compliance)
      class(contact_system_t), intent(inout) :: self
      real(wp), intent(in) :: compliance(:) !< (rows): of each contact point, s/kg
      real(wp) :: diagonal
      integer :: c, s
      if (allocated(self%scale)) then
         if (size(self%scale) < self%rows) deallocate (self%scale, self%softness)
      end if
      if (.not. allocated(self%scale)) allocate (self%scale(2*self%rows + 8), self%softness(2*self%rows + 8))
      do c = 1, self%rows
         diagonal = 0.0_wp
         do s = self%begins(c), self%begins(c + 1) - 1
            diagonal = diagonal + self%weight(s)**2*sum(self%direction(:, c)**2*self%mobility(:, self%node(s)))
         end do
         if (self%gives_way) diagonal = diagonal + self%along(c)**2*self%tool_mobility(self%tool(c))
         self%scale(c) = 0.0_wp
         if (diagonal > 0.0_wp) self%scale(c) = 1.0_wp/sqrt(diagonal)
         self%softness(c) = compliance(c)*self%scale(c)**2
      end do
   end subroutine set_scale

   !> Give the rows from `first` on, two by two, one scale: what is round stays round.
   pure subroutine pair_scales(self, first)
      class(contact_system_t), intent(inout) :: self
      integer, intent(in) :: first
      integer :: r
      do r = first, self%rows - 1, 2
         associate (scale => self%scale(r:r + 1), softness => self%softness(r:r + 1))
            if (all(scale > 0.0_wp)) then ! a direction in which all is held has scale 0
               softness = minval(softness)
               scale = minval(scale)
            else
               softness = maxval(softness)
               scale = maxval(scale)
            end if
         end associate
      end do
   end subroutine pair_scales

end module m_contact_system
