!> Nodes that forces on other bodies act on, in tiles of this rank or of near ones: their values are read, and
!> forces are added to them, as often as a solver asks, by lists that are made once.
module m_partner_exchange
   use mpi_f08
   use m_kinds, only: wp
   use m_constants, only: block_size
   use m_node_values, only: mass_
   use m_communicator, only: communicator_t
   use m_level, only: level_t
   implicit none
   private
   public :: partner_exchange_t, numbers_each

   integer, parameter :: counts_tag = 21, asks_tag = 22, finds_tag = 23, values_tag = 24
   integer, parameter :: numbers_each = 4 !< of a node: its place in the grid and its velocity field

   !> What this rank and a near one have to do with each other.
   type :: parcel_t
      integer, allocatable :: mine(:)    !< numbers of nodes that are in a tile there
      integer, allocatable :: tile(:, :) !< (4, nodes of the other rank): place in a tile here, and block
      real(wp), allocatable :: given(:, :), taken(:, :) !< (values, nodes), of a message
   contains
      procedure :: start
   end type parcel_t

   type :: partner_exchange_t
      private
      integer, public :: count = 0
      integer, allocatable :: tile(:, :) !< (4, count): place in a tile here, and block; 0: of another rank
      type(communicator_t) :: communicator
      integer, allocatable :: ranks(:)         !< near ones, rising
      type(parcel_t), allocatable :: parcels(:) !< (near ranks)
   contains
      procedure :: build
      procedure :: read => read_values
      procedure :: add
      procedure, private :: agree_with
   end type partner_exchange_t

contains

   !> Collective among near ranks: find out who has which node in a tile. The level's nodes have their masses.
   !> A node that several near ranks have is asked of the lowest; of one that nobody has all is 0.
   subroutine build(self, communicator, level, node)
      class(partner_exchange_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(in) :: level
      integer, intent(in) :: node(:, :) !< (4, nodes): place in the grid, from -1; velocity field
      logical :: had(size(node, 2))
      integer :: n, r
      self%communicator = communicator
      self%count = size(node, 2)
      self%ranks = level%near_ranks
      if (allocated(self%tile)) deallocate (self%tile)
      allocate (self%tile(4, self%count))
      do n = 1, self%count
         self%tile(:, n) = tile_here(level, node(:, n))
      end do
      had = self%tile(4, :) > 0
      if (allocated(self%parcels)) deallocate (self%parcels)
      allocate (self%parcels(size(self%ranks)))
      do r = 1, size(self%ranks)
         call self%agree_with(level, r, node, had)
      end do
   end subroutine build

   !> Of the nodes that nobody has been found to have yet: which a near rank has, here and there. Every rank
   !> goes through its near ranks by rising number, so that none waits for another in a circle.
   subroutine agree_with(self, level, r, node, had)
      class(partner_exchange_t), intent(inout) :: self
      type(level_t), intent(in) :: level
      integer, intent(in) :: r, node(:, :)
      logical, intent(inout) :: had(:)
      integer, allocatable :: asked(:), wanted(:, :), theirs(:, :), found(:), there(:)
      integer :: count, k, n
      associate (rank => self%ranks(r), comm => self%communicator%comm, it => self%parcels(r))
         asked = pack([(n, n=1, self%count)], &
                      [(.not. had(n) .and. may_hold(level, rank, node(:, n)), n=1, self%count)])
         call MPI_Sendrecv(size(asked), 1, MPI_INTEGER, rank, counts_tag, count, 1, MPI_INTEGER, rank, &
                           counts_tag, comm, MPI_STATUS_IGNORE)
         allocate (theirs(numbers_each, count), found(count), there(size(asked)))
         wanted = node(:, asked)
         call MPI_Sendrecv(wanted, size(wanted), MPI_INTEGER, rank, asks_tag, theirs, size(theirs), &
                           MPI_INTEGER, rank, asks_tag, comm, MPI_STATUS_IGNORE)
         allocate (it%tile(4, count))
         do k = 1, count
            it%tile(:, k) = tile_here(level, theirs(:, k))
         end do
         found = merge(1, 0, it%tile(4, :) > 0)
         call MPI_Sendrecv(found, count, MPI_INTEGER, rank, finds_tag, there, size(there), MPI_INTEGER, &
                           rank, finds_tag, comm, MPI_STATUS_IGNORE)
         it%mine = pack(asked, there > 0)
         had(it%mine) = .true.
         it%tile = it%tile(:, pack([(k, k=1, count)], found > 0))
      end associate
   end subroutine agree_with

   !> Begin to send what is given, and to take so many nodes' values.
   subroutine start(self, communicator, rank, takes, requests)
      class(parcel_t), intent(inout), target :: self
      type(communicator_t), intent(in) :: communicator
      integer, intent(in) :: rank, takes
      type(MPI_Request), intent(out) :: requests(2)
      if (allocated(self%taken)) deallocate (self%taken)
      allocate (self%taken(size(self%given, 1), takes))
      call MPI_Irecv(self%taken, size(self%taken), MPI_DOUBLE_PRECISION, rank, values_tag, &
                     communicator%comm, requests(1))
      call MPI_Isend(self%given, size(self%given), MPI_DOUBLE_PRECISION, rank, values_tag, &
                     communicator%comm, requests(2))
   end subroutine start

   !> Collective among near ranks: values of the nodes.
   subroutine read_values(self, tiles, place, values)
      class(partner_exchange_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: tiles(:, 0:, 0:, 0:, :)
      integer, intent(in) :: place(:)       !< of the values in a tile's node
      real(wp), intent(out) :: values(:, :) !< (size of place, count)
      type(MPI_Request) :: requests(2*size(self%ranks))
      integer :: k, n, r
      values = 0.0_wp
      do n = 1, self%count
         if (self%tile(4, n) > 0) values(:, n) = tiles(place, self%tile(1, n), self%tile(2, n), &
                                                       self%tile(3, n), self%tile(4, n))
      end do
      do r = 1, size(self%ranks)
         associate (it => self%parcels(r))
            if (allocated(it%given)) deallocate (it%given)
            allocate (it%given(size(place), size(it%tile, 2)))
            do k = 1, size(it%tile, 2)
               it%given(:, k) = tiles(place, it%tile(1, k), it%tile(2, k), it%tile(3, k), it%tile(4, k))
            end do
         end associate
         call self%parcels(r)%start(self%communicator, self%ranks(r), size(self%parcels(r)%mine), &
                                    requests(2*r - 1:2*r))
      end do
      call MPI_Waitall(size(requests), requests, MPI_STATUSES_IGNORE)
      do r = 1, size(self%ranks)
         values(:, self%parcels(r)%mine) = self%parcels(r)%taken
      end do
   end subroutine read_values

   !> Collective among near ranks: add values of the nodes to one tile that has them.
   subroutine add(self, values, place, tiles)
      class(partner_exchange_t), intent(inout) :: self
      real(wp), intent(in) :: values(:, :) !< (size of place, count)
      integer, intent(in) :: place(:)      !< of the values in a tile's node
      real(wp), intent(inout), contiguous :: tiles(:, 0:, 0:, 0:, :)
      type(MPI_Request) :: requests(2*size(self%ranks))
      integer :: n, r
      do r = 1, size(self%ranks)
         self%parcels(r)%given = values(:, self%parcels(r)%mine)
         call self%parcels(r)%start(self%communicator, self%ranks(r), size(self%parcels(r)%tile, 2), &
                                    requests(2*r - 1:2*r))
      end do
      do n = 1, self%count
         if (self%tile(4, n) > 0) call add_to(self%tile(:, n), values(:, n))
      end do
      call MPI_Waitall(size(requests), requests, MPI_STATUSES_IGNORE)
      do r = 1, size(self%ranks)
         do n = 1, size(self%parcels(r)%tile, 2)
            call add_to(self%parcels(r)%tile(:, n), self%parcels(r)%taken(:, n))
         end do
      end do
   contains
      subroutine add_to(at, more)
         integer, intent(in) :: at(4)
         real(wp), intent(in) :: more(:)
         tiles(place, at(1), at(2), at(3), at(4)) = tiles(place, at(1), at(2), at(3), at(4)) + more
      end subroutine add_to
   end subroutine add

   !> True when a rank has a block of which a tile may hold a node.
   pure logical function may_hold(level, rank, node)
      type(level_t), intent(in) :: level
      integer, intent(in) :: rank, node(numbers_each)
      integer :: low(3), high(3), x, y, z
      call blocks_around(node(:3), low, high)
      may_hold = .false.
      do z = low(3), high(3)
         do y = low(2), high(2)
            do x = low(1), high(1)
               may_hold = may_hold .or. level%owner_at([x, y, z], node(4)) == rank
            end do
         end do
      end do
   end function may_hold

   !> Places of the blocks whose tiles hold a node.
   pure subroutine blocks_around(node, low, high)
      integer, intent(in) :: node(3)
      integer, intent(out) :: low(3), high(3)
      integer :: home(3)
      home = (node - modulo(node, block_size))/block_size
      low = home - merge(1, 0, modulo(node, block_size) == 0)
      high = home + merge(1, 0, modulo(node, block_size) == block_size - 1)
   end subroutine blocks_around

   !> Where a node with mass is in a tile here: its place there and the block, 0: nowhere. Of a block with
   !> particles: nobody solves the nodes of one without.
   pure function tile_here(level, node) result(tile)
      type(level_t), intent(in) :: level
      integer, intent(in) :: node(numbers_each)
      integer :: tile(4)
      integer :: low(3), high(3), x, y, z, slot, at(3)
      call blocks_around(node(:3), low, high)
      do z = low(3), high(3)
         do y = low(2), high(2)
            do x = low(1), high(1)
               slot = level%slot_at([x, y, z], node(4))
               if (slot == 0 .or. slot > size(level%blocks)) cycle
               if (level%blocks(slot)%particles%count == 0) cycle
               at = node(:3) - block_size*[x, y, z] + 1
               tile = [at, slot]
               if (level%nodes(mass_, at(1), at(2), at(3), slot) > 0.0_wp) return
            end do
         end do
      end do
      tile = 0
   end function tile_here

end module m_partner_exchange
