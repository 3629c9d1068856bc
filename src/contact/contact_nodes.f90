!> The nodes of the rows of a contact problem: their numbers, and those shared with rows of other ranks.
module m_contact_nodes
   use m_kinds, only: wp, i8
   use m_near_ranks, only: near_ranks_t
   use m_communicator, only: communicator_t
   implicit none
   private
   public :: contact_nodes_t, nodal_forces_t

   !> Forces of one rank's rows on nodes.
   type :: nodal_forces_t
      integer(i8), allocatable :: node(:)  !< in the grid, rising
      real(wp), allocatable :: force(:, :) !< (4, :), N; the last component is unused
   end type nodal_forces_t

   type :: contact_nodes_t
      integer :: count = 0
      integer :: extent(4) = 0                 !< nodes of the grid along each axis, from -1 on; fields
      integer(i8), allocatable :: grid_node(:) !< (count): number in the grid, from 1, x fastest; rising
      type(near_ranks_t), private :: near
      integer, private :: rank = 0                     !< this rank
      integer(i8), allocatable, private :: theirs(:)   !< nodes in the grid used by rows of near ranks, rank
                                                       !< by rank, rising
      integer, allocatable, private :: their_count(:)  !< (near ranks): number of these nodes
      integer, allocatable, private :: shared(:)       !< those used by local rows too: local numbers
      integer, allocatable, private :: shared_count(:) !< (near ranks)
   contains
      procedure :: number_all
      procedure :: place_of
      procedure :: field_of
      procedure :: connect
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
      integer, allocatable :: x(:), y(:), z(:)                ! the coordinates along each axis that occur,
                                                              ! rising
      integer, allocatable :: x_rank(:), y_rank(:), z_rank(:) ! index of a coordinate in these lists
      integer, allocatable :: number(:)
      integer :: entries, i, j, k, n, p
      call list_places(place(:, 1, :), last, x, x_rank)
      call list_places(place(:, 2, :), last, y, y_rank)
      call list_places(place(:, 3, :), last, z, z_rank)
      entries = 0
      do p = 1, size(last) ! first index the nodes in the bounding box of all coordinates
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

   !> The coordinates along an axis that occur, rising, and the index of each; 0 if it does not occur.
   pure subroutine list_places(at, last, places, rank)
      integer, intent(in) :: at(0:, :) !< (0:2, rows)
      integer, intent(in) :: last(:)   !< (rows): index of the last node
      integer, allocatable, intent(out) :: places(:)
      integer, allocatable, intent(out) :: rank(:) !< from the lowest coordinate to the highest
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

   !> Number of a field's node in the grid, from 1, x fastest: it may exceed 2**31.
   pure integer(i8) function grid_number(extent, place, field)
      integer, intent(in) :: extent(4), place(3), field !< places from -1 on
      grid_number = place(1) + 2 + extent(1)*(place(2) + 1 + extent(2)*(place(3) + 1_i8 &
         + extent(3)*(field - 1_i8)))
   end function grid_number

   !> Coordinates in the grid, from -1 on, of a node by its number.
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

   !> Collective among near ranks: find the nodes shared with their rows.
   subroutine connect(self, communicator, near)
      class(contact_nodes_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      type(near_ranks_t), intent(in) :: near
      integer, allocatable :: places(:)
      integer :: first, r
      self%rank = communicator%rank
      self%near = near
      associate (n => size(near%ranks))
         if (allocated(self%theirs)) deallocate (self%theirs, self%their_count, self%shared_count)
         allocate (self%their_count(n), self%shared_count(n))
         call near%swap_counts([(self%count, r=1, n)], self%their_count)
         allocate (self%theirs(sum(self%their_count)))
         call near%swap_longs([(self%grid_node, r=1, n)], [(self%count, r=1, n)], self%theirs, &
                              self%their_count)
         self%shared = [integer ::]
         first = 1
         do r = 1, n
            places = common(self%grid_node, self%theirs(first:first + self%their_count(r) - 1))
            self%shared = [self%shared, places]
            self%shared_count(r) = size(places)
            first = first + self%their_count(r)
         end do
      end associate
   end subroutine connect

   !> Indices in `ours` of the values that are in `theirs` too; both rise.
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

   !> Collective among near ranks: add the values of other ranks' rows to nodal values of this rank's rows.
   subroutine add_up(self, values)
      class(contact_nodes_t), intent(in) :: self
      real(wp), intent(inout), contiguous :: values(:, :) !< (3 or more, nodes)
      real(wp), dimension(3, size(self%shared)) :: given, taken
      integer :: n
      if (size(self%near%ranks) == 0) return
      do n = 1, size(self%shared)
         given(:, n) = values(1:3, self%shared(n))
      end do
      call self%near%swap_reals(given, 3*self%shared_count, taken, 3*self%shared_count)
      do n = 1, size(self%shared)
         values(1:3, self%shared(n)) = values(1:3, self%shared(n)) + taken(:, n)
      end do
   end subroutine add_up

   !> Collective among near ranks: exchange the forces of the rows of each of them and of this one on nodes,
   !> by rising rank.
   subroutine exchange(self, force, parts)
      class(contact_nodes_t), intent(in) :: self
      real(wp), intent(in) :: force(:, :) !< (4, nodes) of this rank's rows, N
      type(nodal_forces_t), allocatable, intent(out) :: parts(:)
      real(wp) :: taken(size(force, 1), size(self%theirs))
      integer :: first, last, own, r
      associate (n => size(self%near%ranks), width => size(force, 1))
         own = 1 + count(self%near%ranks < self%rank)
         allocate (parts(n + 1))
         parts(own)%node = self%grid_node
         parts(own)%force = force(:, :self%count)
         call self%near%swap_reals([(parts(own)%force, r=1, n)], [(width*self%count, r=1, n)], taken, &
                             width*self%their_count)
         last = 0
         do r = 1, n
            first = last + 1
            last = last + self%their_count(r)
            associate (part => parts(merge(r, r + 1, r < own)))
               part%node = self%theirs(first:last)
               part%force = taken(:, first:last)
            end associate
         end do
      end associate
   end subroutine exchange

   !> Lists of the nodes of this rank's rows, and of each near rank's, for contributions of local particles,
   !> which `give_back` returns.
   subroutine list_all(self, lists)
      class(contact_nodes_t), intent(in) :: self
      type(nodal_forces_t), allocatable, intent(out) :: lists(:)
      integer :: last, r
      allocate (lists(size(self%near%ranks) + 1))
      lists(1)%node = self%grid_node
      last = 0
      do r = 1, size(self%near%ranks)
         lists(r + 1)%node = self%theirs(last + 1:last + self%their_count(r))
         last = last + self%their_count(r)
      end do
   end subroutine list_all

   !> Collective among near ranks: sum over ranks their contributions to the nodes of the others' rows.
   subroutine give_back(self, lists, total)
      class(contact_nodes_t), intent(in) :: self
      type(nodal_forces_t), intent(in) :: lists(:) !< as of list_all, with values, three a node
      real(wp), intent(out) :: total(:, :)         !< (3, nodes)
      real(wp) :: given(3, size(self%theirs)), taken(3, self%count, size(self%near%ranks))
      integer :: last, r
      last = 0
      do r = 1, size(self%near%ranks)
         given(:, last + 1:last + self%their_count(r)) = lists(r + 1)%force
         last = last + self%their_count(r)
      end do
      call self%near%swap_reals(given, 3*self%their_count, taken, &
                                [(3*self%count, r=1, size(self%near%ranks))])
      total = lists(1)%force
      do r = 1, size(self%near%ranks)
         total = total + taken(:, :, r)
      end do
   end subroutine give_back

end module m_contact_nodes
