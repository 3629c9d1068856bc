!> Masses and velocities of the nodes that forces on other bodies act on, wherever their tiles are.
module m_partner_nodes
   use mpi_f08
   use m_kinds, only: wp
   use m_constants, only: block_size
   use m_node_values, only: mass_, v_x, v_z
   use m_communicator, only: communicator_t
   use m_level, only: level_t
   implicit none
   private
   public :: wanted_nodes_t, numbers_each, may_hold, tile_here

   integer, parameter :: numbers_each = 4 !< of a node: its place in the grid and its field
   integer, parameter :: values_each = 4  !< mass (kg), velocity (m/s)
   integer, parameter :: asks = 7, answers = 8 !< tags

   !> Nodes whose values are wanted, in any order; the same may be there more than once.
   type :: wanted_nodes_t
      integer :: count = 0
      integer, allocatable :: node(:, :)    !< (4, nodes): place from -1 on, field
      real(wp), allocatable :: values(:, :) !< (4, nodes); of a node that no block has 0
   contains
      procedure :: clear
      procedure :: want
      procedure :: fetch
   end type wanted_nodes_t

contains

   subroutine clear(self)
      class(wanted_nodes_t), intent(inout) :: self
      self%count = 0
      if (.not. allocated(self%node)) allocate (self%node(numbers_each, 256))
   end subroutine clear

   !> Ask for one more node; it has the number `count` then.
   subroutine want(self, place, field)
      class(wanted_nodes_t), intent(inout) :: self
      integer, intent(in) :: place(3), field
      integer, allocatable :: more(:, :)
      if (self%count == size(self%node, 2)) then
         allocate (more(numbers_each, 2*self%count))
         more(:, :self%count) = self%node
         call move_alloc(more, self%node)
      end if
      self%count = self%count + 1
      self%node(:, self%count) = [place, field]
   end subroutine want

   !> Collective among near ranks: the values of all nodes, from tiles here, else of the lowest rank that has
   !> them. A tile may not reach as far as a node that its neighbour's does: all ranks that may have it are
   !> asked.
   subroutine fetch(self, communicator, level)
      class(wanted_nodes_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(in) :: level
      integer :: n
      if (allocated(self%values)) deallocate (self%values)
      allocate (self%values(values_each, self%count), source=0.0_wp)
      do n = 1, self%count
         self%values(:, n) = values_here(level, self%node(:, n))
      end do
      if (size(level%near_ranks) > 0) call ask_others(self, communicator, level)
   end subroutine fetch

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

   !> What a tile here has of a node.
   pure function values_here(level, node) result(values)
      type(level_t), intent(in) :: level
      integer, intent(in) :: node(numbers_each)
      real(wp) :: values(values_each)
      integer :: tile(4)
      values = 0.0_wp
      tile = tile_here(level, node)
      if (tile(4) == 0) return
      associate (it => level%nodes(:, tile(1), tile(2), tile(3), tile(4)))
         values = [it(mass_), it(v_x:v_z)]
      end associate
   end function values_here

   !> Ask each near rank for the nodes that it may hold, and answer what it asks for.
   subroutine ask_others(self, communicator, level)
      class(wanted_nodes_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(in) :: level
      type :: parcel_t
         integer, allocatable :: mine(:), asked(:, :), theirs(:, :)
         real(wp), allocatable :: given(:, :), taken(:, :)
      end type parcel_t
      type(parcel_t) :: parcels(size(level%near_ranks))
      type(MPI_Request) :: requests(3*size(level%near_ranks))
      type(MPI_Message) :: message
      type(MPI_Status) :: status
      integer :: count, n, r
      associate (ranks => level%near_ranks, comm => communicator%comm)
         do r = 1, size(ranks)
            associate (it => parcels(r))
               it%mine = pack([(n, n=1, self%count)], [(.not. self%values(1, n) > 0.0_wp .and. &
                  may_hold(level, ranks(r), self%node(:, n)), n=1, self%count)])
               it%asked = self%node(:, it%mine)
               allocate (it%taken(values_each, size(it%mine)))
               call MPI_Irecv(it%taken, size(it%taken), MPI_DOUBLE_PRECISION, ranks(r), answers, comm, &
                              requests(3*r - 2))
               call MPI_Isend(it%asked, size(it%asked), MPI_INTEGER, ranks(r), asks, comm, requests(3*r - 1))
            end associate
         end do
         do r = 1, size(ranks)
            associate (it => parcels(r))
               call MPI_Mprobe(ranks(r), asks, comm, message, status)
               call MPI_Get_count(status, MPI_INTEGER, count)
               allocate (it%theirs(numbers_each, count/numbers_each))
               call MPI_Mrecv(it%theirs, count, MPI_INTEGER, message, MPI_STATUS_IGNORE)
               allocate (it%given(values_each, size(it%theirs, 2)))
               do n = 1, size(it%theirs, 2)
                  it%given(:, n) = values_here(level, it%theirs(:, n))
               end do
               call MPI_Isend(it%given, size(it%given), MPI_DOUBLE_PRECISION, ranks(r), answers, comm, &
                              requests(3*r))
            end associate
         end do
         call MPI_Waitall(size(requests), requests, MPI_STATUSES_IGNORE)
         do r = 1, size(ranks)
            do n = 1, size(parcels(r)%mine)
               associate (it => self%values(:, parcels(r)%mine(n)))
                  if (.not. it(1) > 0.0_wp) it = parcels(r)%taken(:, n)
               end associate
            end do
         end do
      end associate
   end subroutine ask_others

end module m_partner_nodes
