!> Sums of node values across blocks and ranks.
!>
!> Every block's tile overlaps its neighbours' by two node layers. Each rank takes the overlapping parts of its remote neighbours'
!> tiles into ghost slots: a neighbour puts them into its outbox and says where they are, in one message. On the same machine they
!> are fetched from there; to another machine the message takes them along.
!> Then all tiles here that hold a node take, in place of what they have, the sum over them and the ghosts, in the order of their
!> block indices: they get the same bits, on any number of ranks, and nothing has to be sent back.
module m_node_exchange
   use mpi_f08
   use m_kinds, only: wp, i8
   use m_constants, only: block_size
   use m_node_values, only: node_values, tile_last
   use m_communicator, only: communicator_t
   use m_outbox, only: outbox_t
   use m_block, only: block_t, directions
   use m_level, only: level_t
   implicit none
   private
   public :: node_exchange_t, sum_tiles, given_by_ranks

   !> Runs of values that follow each other in a pool of tiles, and what goes from one rank to another one after the other.
   type :: runs_t
      integer(i8), allocatable :: before(:) !< values of the pool before each run
      integer, allocatable :: length(:)
      integer(i8) :: values = 0             !< of all
   end type runs_t

   !> The messages of one decomposition of a level.
   type :: node_exchange_t
      integer, allocatable :: ranks(:)                  !< neighbour ranks, rising
      integer(i8) :: bytes_each = 0                     !< given by this rank in one exchange
      integer(i8) :: messages = 0, bytes = 0            !< given by this rank over the run
      type(runs_t), allocatable, private :: give(:), take(:)
      type(outbox_t), private :: outbox                 !< two halves, used in turn: a neighbour may still read what it was given
                                                        !< last, but not what was given before that
      real(wp), allocatable, private :: inbox(:)        !< what comes from ranks on other machines
      integer(i8), allocatable, private :: given(:) !< values in the outbox before those for each neighbour; on this machine that is
                                                    !< the message
      integer(i8), allocatable, private :: found(:)     !< values in each neighbour's outbox, or in the inbox, before those for this
      logical, allocatable, private :: near(:)          !< neighbours on this machine
      integer(i8), private :: turn = 0                  !< exchanges that have begun
      type(MPI_Request), allocatable, private :: requests(:)
   contains
      procedure :: build
      procedure :: open
      procedure :: start
      procedure :: progress
      procedure :: wait
      procedure :: held
      procedure :: release
   end type node_exchange_t

   integer, parameter :: width = tile_last + 1 !< of a tile
   integer(i8), parameter :: bytes_per_value = storage_size(1.0_wp)/8

   !> A tile that holds nodes that blocks share.
   type :: holder_t
      integer :: slot = 0
      integer(i8) :: start = 0 !< place in the pool of node (0, 0, 0) of the tile of the block that asks, were it there
      integer :: first(3) = 0, last(3) = 0 !< of these nodes those that it reaches: indices in that tile
   end type holder_t

contains

   !> Whom this rank gives what of the level's tiles, and what it takes from whom.
   subroutine build(self, communicator, level)
      class(node_exchange_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(in) :: level
      logical :: neighbour(0:communicator%ranks - 1)
      integer :: m, n, r, place(3)
      neighbour = .false.
      do m = 1, size(level%ghost_index)
         place = level%grid%block_place(level%ghost_index(m))
         neighbour(level%owner_at(place)) = .true.
      end do
      self%ranks = pack([(r, r=0, communicator%ranks - 1)], neighbour)
      n = size(self%ranks)
      if (allocated(self%give)) deallocate (self%give, self%take)
      allocate (self%give(n), self%take(n))
      do r = 1, n
         call find_shared(level, communicator%rank, self%ranks(r), self%give(r))
         call find_shared(level, self%ranks(r), communicator%rank, self%take(r))
      end do
      self%bytes_each = bytes_per_value*sum(self%give%values)
   end subroutine build

   !> Collective, after `build`: places in outboxes, and room there.
   subroutine open(self, communicator, level)
      class(node_exchange_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(in) :: level
      integer(i8) :: far
      integer :: n, r
      n = size(self%ranks)
      if (communicator%ranks > 1) call self%outbox%reserve(communicator, 2*given_by_ranks(level, communicator%ranks))
      self%near = [(self%outbox%reads(self%ranks(r)), r=1, n)]
      self%given = [(0_i8, r=1, n)]
      self%found = [(sum(self%take(:r - 1)%values, .not. self%near(:r - 1)), r=1, n)]
      if (allocated(self%requests)) deallocate (self%requests)
      allocate (self%requests(2*n))
      far = sum(self%take%values, .not. self%near)
      if (allocated(self%inbox)) then
         if (size(self%inbox, kind=i8) >= far) return
         deallocate (self%inbox)
      end if
      allocate (self%inbox(far))
   end subroutine open

   !> Values that each rank gives in one exchange.
   pure function given_by_ranks(level, ranks) result(values)
      type(level_t), intent(in) :: level
      integer, intent(in) :: ranks
      integer(i8) :: values(0:ranks - 1)
      integer :: around(27), index, n, owner, place(3), takers
      values = 0
      do index = 1, size(level%owner)
         place = level%grid%block_place(index)
         owner = level%owner_at(place)
         if (owner < 0) cycle
         do n = 1, 27
            around(n) = level%owner_at(place + directions(:, n))
         end do
         if (all(around == owner .or. around < 0)) cycle
         do n = 1, 27
            takers = other_ranks(around, directions(:, n))
            if (takers == 0) cycle
            values(owner) = values(owner) + takers*node_values*product(shared_last(directions(:, n)) &
                                                                       - shared_first(directions(:, n)) + 1)
         end do
      end do
   end function given_by_ranks

   !> How many ranks other than the block's own have blocks between it and one direction.
   pure integer function other_ranks(around, direction) result(others)
      integer, intent(in) :: around(-1:1, -1:1, -1:1) !< owners of the 27 blocks around, -1 where there is none
      integer, intent(in) :: direction(3)
      integer :: seen(8), x, y, z
      others = 0
      do z = min(0, direction(3)), max(0, direction(3))
         do y = min(0, direction(2)), max(0, direction(2))
            do x = min(0, direction(1)), max(0, direction(1))
               associate (rank => around(x, y, z))
                  if (rank < 0 .or. rank == around(0, 0, 0) .or. any(seen(:others) == rank)) cycle
                  others = others + 1
                  seen(others) = rank
               end associate
            end do
         end do
      end do
   end function other_ranks

   !> The runs of all tiles of rank `from` that rank `to` needs; in the same order on both ranks.
   subroutine find_shared(level, from, to, runs)
      type(level_t), intent(in) :: level
      integer, intent(in) :: from, to
      type(runs_t), intent(out) :: runs
      logical :: shared(0:tile_last, 0:tile_last, 0:tile_last)
      integer :: count, index, place(3), slot
      allocate (runs%length(2*width**2), runs%before(2*width**2))
      count = 0
      do index = 1, product(level%grid%blocks)
         place = level%grid%block_place(index)
         if (level%owner_at(place) /= from) cycle
         slot = level%slot(place(1), place(2), place(3))
         if (slot == 0) cycle
         shared = shared_nodes(level, place, to)
         if (any(shared)) call add_runs(shared, slot, count, runs)
      end do
      runs%length = runs%length(:count)
      runs%before = runs%before(:count)
      runs%values = sum(int(runs%length, i8))
   end subroutine find_shared

   !> The nodes of a block's tile that blocks of rank `to` also have.
   pure function shared_nodes(level, place, to) result(shared)
      type(level_t), intent(in) :: level
      integer, intent(in) :: place(3), to
      logical :: shared(0:tile_last, 0:tile_last, 0:tile_last)
      integer :: direction(3), n
      shared = .false.
      do n = 1, 27
         direction = directions(:, n)
         if (n == 14 .or. level%owner_at(place + direction) /= to) cycle
         associate (a => overlap_first(direction), b => overlap_last(direction))
            shared(a(1):b(1), a(2):b(2), a(3):b(3)) = .true.
         end associate
      end do
   end function shared_nodes

   !> Append the runs of the marked nodes of one slot to the first `count`. Rows along x have at most two, which begin or end at a
   !> side.
   subroutine add_runs(shared, slot, count, runs)
      logical, intent(in) :: shared(0:tile_last, 0:tile_last, 0:tile_last)
      integer, intent(in) :: slot
      integer, intent(inout) :: count
      type(runs_t), intent(inout) :: runs
      integer(i8) :: before, behind
      integer :: i, j, k
      if (size(runs%length) < count + 2*width**2) then
         runs%length = [runs%length, spread(0, 1, count + 2*width**2)]
         runs%before = [runs%before, spread(0_i8, 1, count + 2*width**2)]
      end if
      behind = -1
      do k = 0, tile_last
         do j = 0, tile_last
            if (.not. any(shared(:, j, k))) cycle
            do i = 0, tile_last
               if (.not. shared(i, j, k)) cycle
               before = node_values*(i + width*(j + width*(k + width*(slot - 1_i8))))
               if (before /= behind) then
                  count = count + 1
                  runs%before(count) = before
                  runs%length(count) = 0
               end if
               runs%length(count) = runs%length(count) + node_values
               behind = before + node_values
            end do
         end do
      end do
   end subroutine add_runs

   !> Begin to exchange the tiles of shared blocks; they must be complete, and may be changed from here on.
   subroutine start(self, communicator, tiles)
      class(node_exchange_t), intent(inout), asynchronous :: self
      type(communicator_t), intent(in) :: communicator
      real(wp), intent(in), contiguous :: tiles(:, :, :, :, :)
      integer :: r, n
      n = size(self%ranks)
      if (n == 0) return
      do r = 1, n
         associate (give => self%give(r), take => self%take(r), rank => self%ranks(r))
            self%given(r) = sum(self%give(:r - 1)%values) + mod(self%turn, 2_i8)*sum(self%give%values)
            call put(give, tiles, self%outbox%own(self%given(r) + 1:self%given(r) + give%values))
         end associate
      end do
      call self%outbox%set_in_order()
      do r = 1, n
         associate (give => self%give(r), take => self%take(r), rank => self%ranks(r))
            if (self%near(r)) then
               call MPI_Irecv(self%found(r), 1, MPI_INTEGER8, rank, 1, communicator%comm, self%requests(r))
               call MPI_Isend(self%given(r), 1, MPI_INTEGER8, rank, 1, communicator%comm, self%requests(n + r))
            else
               call MPI_Irecv(self%inbox(self%found(r) + 1:), int(take%values), MPI_DOUBLE_PRECISION, rank, 1, &
                              communicator%comm, self%requests(r))
               call MPI_Isend(self%outbox%own(self%given(r) + 1:), int(give%values), MPI_DOUBLE_PRECISION, rank, 1, &
                              communicator%comm, self%requests(n + r))
            end if
         end associate
      end do
      self%turn = self%turn + 1
      self%messages = self%messages + n
      self%bytes = self%bytes + self%bytes_each
   end subroutine start

   !> Between two blocks' work: let MPI see to large messages, which move only when both ranks look after them.
   subroutine progress(self)
      class(node_exchange_t), intent(inout), asynchronous :: self
      logical :: done
      if (all(self%near)) return
      call MPI_Testall(size(self%requests), self%requests, done, MPI_STATUSES_IGNORE)
      if (.not. MPI_ASYNC_PROTECTS_NONBLOCKING) call MPI_F_sync_reg(self%inbox)
   end subroutine progress

   !> Wait until the neighbours have given, and fill the ghosts.
   subroutine wait(self, tiles)
      class(node_exchange_t), intent(inout), asynchronous :: self
      real(wp), intent(inout), contiguous :: tiles(:, :, :, :, :)
      integer :: r
      if (size(self%ranks) == 0) return
      call MPI_Waitall(size(self%requests), self%requests, MPI_STATUSES_IGNORE)
      if (.not. MPI_ASYNC_PROTECTS_NONBLOCKING) then
         call MPI_F_sync_reg(self%inbox)
         call MPI_F_sync_reg(self%found)
      end if
      call self%outbox%set_in_order()
      do r = 1, size(self%ranks)
         associate (take => self%take(r), found => self%found(r))
            if (self%near(r)) then
               call take_out(take, self%outbox%values_of(self%ranks(r), found, take%values), tiles)
            else
               call take_out(take, self%inbox(found + 1:found + take%values), tiles)
            end if
         end associate
      end do
   end subroutine wait

   !> Runs of a pool, one after the other, as values.
   pure subroutine put(runs, pool, values)
      type(runs_t), intent(in) :: runs
      real(wp), intent(in) :: pool(*)
      real(wp), intent(inout) :: values(*)
      integer(i8) :: at
      integer :: r, v
      at = 0
      do r = 1, size(runs%length)
         do v = 1, runs%length(r)
            values(at + v) = pool(runs%before(r) + v)
         end do
         at = at + runs%length(r)
      end do
   end subroutine put

   !> Values to the runs of a pool.
   pure subroutine take_out(runs, values, pool)
      type(runs_t), intent(in) :: runs
      real(wp), intent(in) :: values(*)
      real(wp), intent(inout) :: pool(*)
      integer(i8) :: at
      integer :: r, v
      at = 0
      do r = 1, size(runs%length)
         do v = 1, runs%length(r)
            pool(runs%before(r) + v) = values(at + v)
         end do
         at = at + runs%length(r)
      end do
   end subroutine take_out

   !> Memory held by messages (bytes).
   elemental integer(i8) function held(self)
      class(node_exchange_t), intent(in) :: self
      held = self%outbox%bytes()
      if (allocated(self%inbox)) held = held + bytes_per_value*size(self%inbox, kind=i8)
   end function held

   !> Collective: free what the ranks of a machine share.
   subroutine release(self)
      class(node_exchange_t), intent(inout) :: self
      call self%outbox%release()
   end subroutine release

   !> In place of what the tiles hold of the nodes that blocks share: the sums over all tiles that hold them, in the order of their
   !> block indices. Each node's are made once, for all tiles here that hold it, by the first of these blocks in the order
   !> `interior_first` of the level, so that those without remote neighbours need no message, and nobody asks for their tiles after
   !> that.
   pure subroutine sum_tiles(blocks, adders, tiles, extent, wanted)
      type(block_t), intent(in) :: blocks(:)
      integer, intent(in) :: adders(:) !< whose sums are made: those of either part of `interior_first`, or of both
      real(wp), intent(inout) :: tiles(node_values, 0:tile_last, 0:tile_last, 0:tile_last, *) !< by slots
      integer, intent(in), optional :: extent(2, 3, *) !< by slots: only what tiles extent is added, and changed
      logical, intent(in), optional :: wanted(:)      !< by own blocks: only nodes that one of these has
      type(holder_t) :: holder(8)
      integer :: a, n, held
      do a = 1, size(adders)
         do n = 1, 27
            if (.not. blocks(adders(a))%owns_shared_sum(n)) cycle
            call find_holders(blocks(adders(a))%neighbour, directions(:, n), extent, holder, held)
            if (held < 2) cycle
            if (present(wanted)) then
               if (.not. any(is_wanted(holder(:held)%slot))) cycle
            end if
            if (held == 2 .and. all(holder(:2)%slot <= size(blocks)) .and. all(holder(1)%first == holder(2)%first) &
                .and. all(holder(1)%last == holder(2)%last)) then
               call sum_two(holder(1), holder(2), tiles)
            else
               call sum_some(holder(:held), size(blocks), tiles)
            end if
         end do
      end do
   contains
      pure elemental logical function is_wanted(slot)
         integer, intent(in) :: slot
         is_wanted = .false.
         if (slot <= size(blocks)) is_wanted = wanted(slot)
      end function is_wanted
   end subroutine sum_tiles

   !> The tiles that hold the nodes that a block shares with all its neighbours between it and one direction, and with no other: by
   !> rising block index, without those that do not extent any.
   pure subroutine find_holders(neighbour, direction, extent, holder, held)
      integer, intent(in) :: neighbour(27) !< slots around the block, 0 where there is none
      integer, intent(in) :: direction(3)
      integer, intent(in), optional :: extent(2, 3, *)
      type(holder_t), intent(out) :: holder(8)
      integer, intent(out) :: held
      integer :: x, y, z, shift(3)
      held = 0
      do z = min(0, direction(3)), max(0, direction(3))
         do y = min(0, direction(2)), max(0, direction(2))
            do x = min(0, direction(1)), max(0, direction(1))
               associate (slot => neighbour(14 + x + 3*y + 9*z), new => holder(held + 1))
                  if (slot == 0) cycle
                  shift = block_size*[x, y, z]
                  new%slot = slot
                  new%start = node_values*(width**3*(slot - 1_i8) - shift(1) - width*(shift(2) + width*shift(3)))
                  new%first = shared_first(direction)
                  new%last = shared_last(direction)
                  if (present(extent)) then
                     new%first = max(new%first, extent(1, :, slot) + shift)
                     new%last = min(new%last, extent(2, :, slot) + shift)
                  end if
                  if (all(new%first <= new%last)) held = held + 1
               end associate
            end do
         end do
      end do
   end subroutine find_holders

   !> What most nodes take part in: two blocks here share a face.
   pure subroutine sum_two(one, two, tiles)
      type(holder_t), intent(in) :: one, two !< of the same nodes
      real(wp), intent(inout) :: tiles(*)
      real(wp) :: total
      integer :: j, k, q
      integer(i8) :: p, r
      do k = one%first(3), one%last(3)
         do j = one%first(2), one%last(2)
            p = one%start + node_values*width*(j + width*k)
            r = two%start + node_values*width*(j + width*k)
            !$omp simd private(total)
            do q = node_values*one%first(1) + 1, node_values*(one%last(1) + 1)
               total = tiles(p + q) + tiles(r + q)
               tiles(p + q) = total
               tiles(r + q) = total
            end do
         end do
      end do
   end subroutine sum_two

   !> Any number of blocks, each with what it reaches.
   pure subroutine sum_some(holder, own, tiles)
      type(holder_t), intent(in) :: holder(:)
      integer, intent(in) :: own !< slots up to here are of blocks here, the others of ghosts
      real(wp), intent(inout) :: tiles(*)
      real(wp) :: total(node_values*width)
      integer :: h, j, k, q
      integer(i8) :: p
      do k = minval(holder%first(3)), maxval(holder%last(3))
         do j = minval(holder%first(2)), maxval(holder%last(2))
            total = 0.0_wp
            do h = 1, size(holder)
               if (.not. has_row(holder(h), j, k)) cycle
               p = holder(h)%start + node_values*width*(j + width*k)
               !$omp simd
               do q = node_values*holder(h)%first(1) + 1, node_values*(holder(h)%last(1) + 1)
                  total(q) = total(q) + tiles(p + q)
               end do
            end do
            do h = 1, size(holder)
               if (holder(h)%slot > own .or. .not. has_row(holder(h), j, k)) cycle
               p = holder(h)%start + node_values*width*(j + width*k)
               !$omp simd
               do q = node_values*holder(h)%first(1) + 1, node_values*(holder(h)%last(1) + 1)
                  tiles(p + q) = total(q)
               end do
            end do
         end do
      end do
   end subroutine sum_some

   pure logical function has_row(holder, j, k)
      type(holder_t), intent(in) :: holder
      integer, intent(in) :: j, k
      has_row = j >= holder%first(2) .and. j <= holder%last(2) .and. k >= holder%first(3) .and. k <= holder%last(3)
   end function has_row

   !> First and last tile index, along an axis, of what a block shares with all neighbours between it and a direction alone.
   pure elemental integer function shared_first(direction)
      integer, intent(in) :: direction
      shared_first = merge(tile_last - 1, merge(0, 2, direction == -1), direction == 1)
   end function shared_first

   pure elemental integer function shared_last(direction)
      integer, intent(in) :: direction
      shared_last = merge(1, merge(tile_last, tile_last - 2, direction == 1), direction == -1)
   end function shared_last

   !> First and last tile index, along each axis, that a block shares with its neighbour in a direction.
   pure elemental integer function overlap_first(direction)
      integer, intent(in) :: direction
      overlap_first = merge(tile_last - 1, 0, direction == 1)
   end function overlap_first

   pure elemental integer function overlap_last(direction)
      integer, intent(in) :: direction
      overlap_last = merge(1, tile_last, direction == -1)
   end function overlap_last

end module m_node_exchange
