!> The nodes that the rows of a contact problem touch: their numbers, and which of them rows of other ranks
!> touch too.
module m_contact_nodes
   use mpi_f08
   use m_kinds, only: wp, i8
   use m_communicator, only: communicator_t
   implicit none
   private
   public :: contact_nodes_t, nodal_forces_t

   !> Nodes that this rank's rows touch and that rows of another rank touch too.
   type :: shared_nodes_t
      integer :: rank = -1
      integer, allocatable :: nodes(:)      !< local numbers, in the order of the grid
      integer(i8), allocatable :: theirs(:) !< nodes in the grid that its rows touch, rising
      real(wp), allocatable :: given(:, :), taken(:, :) !< (3, :), N
      type(MPI_Request) :: sends, receives  !< of the two
   end type shared_nodes_t

   !> Forces that the rows of one rank give to nodes.
   type :: nodal_forces_t
      integer(i8), allocatable :: node(:)  !< in the grid, rising
      real(wp), allocatable :: force(:, :) !< (4, :), N; the last is idle
   end type nodal_forces_t

   type :: contact_nodes_t
      integer :: count = 0
      integer :: extent(4) = 0                 !< nodes of the grid along each axis, from -1 on; fields
      integer(i8), allocatable :: grid_node(:) !< (count): number in the grid, from 1, x fastest; rising
      type(communicator_t), private :: communicator
      type(shared_nodes_t), allocatable, private :: shared(:)
   contains
      procedure :: number_all
      procedure :: place_of
      procedure :: field_of
      procedure :: connect
      procedure :: expect
      procedure :: send
      procedure :: add_received
      procedure :: exchange
      procedure :: add_up
      procedure :: list_all
      procedure :: give_back
   end type contact_nodes_t

contains

   !> Number the nodes of some contact points in the order of the grid.
   subroutine number_all(self, place, last, field, node)
      class(contact_nodes_t), intent(inout) :: self
      integer, intent(in) :: place(0:, :, :) !< (0:2, 3, points): nodes in the grid along each axis, from -1
      integer, intent(in) :: last(:)         !< (points): nodes along each axis are from 0 to here
      integer, intent(in) :: field(:)        !< (points): velocity field, from 1
      integer, intent(inout) :: node(:)      !< on return its first entries are the points' nodes, x fastest
      integer, allocatable :: x(:), y(:), z(:)                ! the places along each axis that occur, rising
      integer, allocatable :: x_rank(:), y_rank(:), z_rank(:) ! which of them a place is
      integer, allocatable :: number(:)
      integer :: entries, i, j, k, n, p
      call list_places(place(:, 1, :), last, x, x_rank)
      call list_places(place(:, 2, :), last, y, y_rank)
      call list_places(place(:, 3, :), last, z, z_rank)
      entries = 0
      do p = 1, size(last) ! first the places of the nodes in the box of all places that occur
         associate (at => place(:, :, p))
            do k = 1, last(p) + 1
               do j = 1, last(p) + 1
                  do i = 1, last(p) + 1
                     entries = entries + 1
                     node(entries) = x_rank(at(i, 1)) + size(x)*(y_rank(at(j, 2)) - 1 &
                           + size(y)*(z_rank(at(k, 3)) - 1 + size(z)*(field(p) - 1)))
                  end do
               end do
            end do
         end associate
      end do
      allocate (number(size(x)*size(y)*size(z)*maxval([1, field])), source=0)
      do n = 1, entries
         number(node(n)) = 1
      end do
      if (allocated(self%grid_node)) deallocate (self%grid_node)
      allocate (self%grid_node(sum(number)))
      self%count = 0
      do n = 1, size(number)
         if (number(n) == 0) cycle
         self%count = self%count + 1
         number(n) = self%count
         self%grid_node(self%count) = grid_number(self%extent, [x(1 + mod(n - 1, size(x))), &
                                                                y(1 + mod((n - 1)/size(x), size(y))), &
                                                                z(1 + mod((n - 1)/(size(x)*size(y)), &
                                                                          size(z)))], &
                                                1 + (n - 1)/(size(x)*size(y)*size(z)))
      end do
      node(:entries) = number(node(:entries))
   end subroutine number_all

   !> The places along an axis that occur, rising, and which of them a place is; 0 where it does not occur.
   pure subroutine list_places(at, last, places, rank)
      integer, intent(in) :: at(0:, :) !< (0:2, rows)
      integer, intent(in) :: last(:)   !< (rows): they count up to here
      integer, allocatable, intent(out) :: places(:)
      integer, allocatable, intent(out) :: rank(:) !< from the lowest place to the highest
      integer :: i, p
      allocate (rank(minval(at):maxval(at)), source=0)
      do i = 1, size(last)
         do p = 0, last(i)
            rank(at(p, i)) = 1
         end do
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

   !> Number of a field's node in the grid, from 1, x fastest: there may be more than 2**31.
   pure integer(i8) function grid_number(extent, place, field)
      integer, intent(in) :: extent(4), place(3), field !< places from -1 on
      grid_number = place(1) + 2 + extent(1)*(place(2) + 1 + extent(2)*(place(3) + 1_i8 &
         + extent(3)*(field - 1_i8)))
   end function grid_number

   !> Place in the grid, from -1 on, of a node by its number there.
   pure function place_of(self, number) result(place)
      class(contact_nodes_t), intent(in) :: self
      integer(i8), intent(in) :: number
      integer :: place(3)
      integer(i8) :: n(4)
      n = self%extent
      place = int([mod(number - 1, n(1)), mod((number - 1)/n(1), n(2)), &
                   mod((number - 1)/(n(1)*n(2)), n(3))] - 1)
   end function place_of

   !> Velocity field of a node by its number in the grid.
   pure integer function field_of(self, number)
      class(contact_nodes_t), intent(in) :: self
      integer(i8), intent(in) :: number
      field_of = 1 + int((number - 1)/product(int(self%extent(:3), i8)))
   end function field_of

   !> Learn which nodes the neighbour ranks' rows touch too. Collective among neighbours.
   subroutine connect(self, communicator, neighbours)
      class(contact_nodes_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      integer, intent(in) :: neighbours(:)
      type(MPI_Request) :: requests(size(neighbours))
      type(MPI_Status) :: status
      type(MPI_Message) :: message
      integer(i8), allocatable :: theirs(:)
      integer :: count, n
      self%communicator = communicator
      if (allocated(self%shared)) deallocate (self%shared)
      allocate (self%shared(size(neighbours)))
      do n = 1, size(neighbours)
         call MPI_Isend(self%grid_node, self%count, MPI_INTEGER8, neighbours(n), 3, communicator%comm, &
                        requests(n))
      end do
      do n = 1, size(neighbours)
         call MPI_Mprobe(neighbours(n), 3, communicator%comm, message, status)
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

   !> Receives for what other ranks will `send`, there before messages come.
   subroutine expect(self)
      class(contact_nodes_t), intent(inout) :: self
      integer :: i
      do i = 1, size(self%shared)
         associate (it => self%shared(i))
            if (size(it%nodes) > 0) &
               call MPI_Irecv(it%taken, size(it%taken), MPI_DOUBLE_PRECISION, it%rank, 4, &
                              self%communicator%comm, it%receives)
         end associate
      end do
   end subroutine expect

   !> Send the forces of this rank's rows on nodes that other ranks' rows touch too.
   subroutine send(self, force)
      class(contact_nodes_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: force(:, :) !< (4, nodes), N
      integer :: i, n
      do i = 1, size(self%shared)
         associate (it => self%shared(i))
            if (size(it%nodes) == 0) cycle
            do n = 1, size(it%nodes)
               it%given(1:3, n) = force(1:3, it%nodes(n))
            end do
            call MPI_Isend(it%given, size(it%given), MPI_DOUBLE_PRECISION, it%rank, 4, &
                           self%communicator%comm, it%sends)
         end associate
      end do
   end subroutine send

   !> Add the forces that other ranks have sent.
   subroutine add_received(self, force)
      class(contact_nodes_t), intent(inout) :: self
      real(wp), intent(inout), contiguous :: force(:, :) !< (4, nodes), N
      integer :: i, n
      do i = 1, size(self%shared)
         associate (it => self%shared(i))
            if (size(it%nodes) == 0) cycle
            call MPI_Wait(it%receives, MPI_STATUS_IGNORE)
            do n = 1, size(it%nodes)
               force(1:3, it%nodes(n)) = force(1:3, it%nodes(n)) + it%taken(1:3, n)
            end do
            call MPI_Wait(it%sends, MPI_STATUS_IGNORE)
         end associate
      end do
   end subroutine add_received

   !> Collective among neighbours: the forces that the rows of each neighbour rank and of this one give to
   !> nodes, by rising rank.
   subroutine exchange(self, force, parts)
      class(contact_nodes_t), intent(inout) :: self
      real(wp), intent(in) :: force(:, :) !< (4, nodes) of this rank's rows, N
      type(nodal_forces_t), allocatable, intent(out) :: parts(:)
      type(MPI_Request) :: requests(2*size(self%shared))
      integer :: own, r
      own = 1 + count(self%shared%rank < self%communicator%rank)
      allocate (parts(size(self%shared) + 1))
      parts(own)%node = self%grid_node
      parts(own)%force = force(:, :self%count)
      do r = 1, size(self%shared)
         associate (shared => self%shared(r), part => parts(merge(r, r + 1, r < own)))
            part%node = shared%theirs
            allocate (part%force(size(force, 1), size(part%node)))
            call MPI_Irecv(part%force, size(part%force), MPI_DOUBLE_PRECISION, shared%rank, 5, &
                           self%communicator%comm, requests(2*r - 1))
            call MPI_Isend(parts(own)%force, size(parts(own)%force), MPI_DOUBLE_PRECISION, shared%rank, 5, &
                           self%communicator%comm, requests(2*r))
         end associate
      end do
      call MPI_Waitall(size(requests), requests, MPI_STATUSES_IGNORE)
   end subroutine exchange

   !> Collective among neighbours: to values of nodes by this rank's rows, add those by other ranks' rows.
   subroutine add_up(self, values)
      class(contact_nodes_t), intent(inout) :: self
      real(wp), intent(inout), contiguous :: values(:, :) !< (3 or more, nodes)
      call self%expect()
      call self%send(values)
      call self%add_received(values)
   end subroutine add_up

   !> The nodes of this rank's rows, and of each neighbour rank's: what particles here give to them is then
   !> given back.
   subroutine list_all(self, lists)
      class(contact_nodes_t), intent(in) :: self
      type(nodal_forces_t), allocatable, intent(out) :: lists(:)
      integer :: r
      allocate (lists(size(self%shared) + 1))
      lists(1)%node = self%grid_node
      do r = 1, size(self%shared)
         lists(r + 1)%node = self%shared(r)%theirs
      end do
   end subroutine list_all

   !> Collective among neighbours: sums over ranks of what each has for the nodes of the others' rows.
   subroutine give_back(self, lists, total)
      class(contact_nodes_t), intent(in) :: self
      type(nodal_forces_t), intent(in) :: lists(:) !< as of list_all, with values, three a node
      real(wp), intent(out) :: total(:, :)         !< (3, nodes)
      real(wp), allocatable :: taken(:, :, :)
      type(MPI_Request) :: requests(2*size(self%shared))
      integer :: r
      allocate (taken(3, self%count, size(self%shared)))
      do r = 1, size(self%shared)
         call MPI_Irecv(taken(:, :, r), 3*self%count, MPI_DOUBLE_PRECISION, self%shared(r)%rank, 6, &
                        self%communicator%comm, requests(2*r - 1))
         call MPI_Isend(lists(r + 1)%force, size(lists(r + 1)%force), MPI_DOUBLE_PRECISION, &
                        self%shared(r)%rank, 6, self%communicator%comm, requests(2*r))
      end do
      call MPI_Waitall(size(requests), requests, MPI_STATUSES_IGNORE)
      total = lists(1)%force
      do r = 1, size(self%shared)
         total = total + taken(:, :, r)
      end do
   end subroutine give_back

end module m_contact_nodes
