!> Particles that change block move house; blocks that change rank move with all their particles.
module m_migration
   use mpi_f08
   use m_kinds, only: wp, i4, i8
   use m_constants, only: block_size
   use m_sorting, only: sorted_order
   use m_communicator, only: communicator_t
   use m_level, only: level_t
   use m_block, only: block_t
   use m_stencil, only: frame_t
   use m_locate, only: bin_of
   implicit none
   private
   public :: migration_t, frame_of, entered, take_out

   integer, parameter :: extra = 6 !< after a particle's columns a record holds: id's bits, body, block index, bin (0: not known),
                                   !< disorder of the block if the particle moves with it, `arrives` if it arrives there, and its
                                   !< run_breaks
   real(wp), parameter :: arrives = -1.0_wp

   integer, parameter :: first_tag = 16 !< of messages that are not asked for: this and the number of the level
   integer, parameter :: at_once = 3500 !< bytes; MPI sends larger messages only once the other rank has asked for them (Open MPI,
                                        !< between ranks of a machine: above 4096)
   integer, parameter :: fewest = 64 !< records that there is room for, where there is any

   !> Records of particles under way: one column a particle.
   type :: parcel_t
      integer :: count = 0
      real(wp), allocatable :: records(:, :)
   contains
      procedure :: add
   end type parcel_t

   type :: migration_t
      type(parcel_t), allocatable :: outgoing(:) !< one a rank, from 0
      type(parcel_t) :: incoming
      type(MPI_Datatype) :: record = MPI_DATATYPE_NULL
      type(MPI_Request), allocatable, private :: sent_off(:) !< messages under way
      integer(i8) :: moved = 0      !< particles that changed block on this rank
      integer(i8) :: sent = 0       !< of those, to other ranks
   contains
      procedure :: prepare
      procedure :: pack_emigrants
      procedure :: send
      procedure :: receive
      procedure :: settle
      procedure :: move_emigrants
      procedure :: move_blocks
      procedure :: give_away
      procedure :: deliver
      procedure :: unload
      procedure :: release
   end type migration_t

contains

   !> Where a block stands, for the kernels.
   pure type(frame_t) function frame_of(level, block)
      type(level_t), intent(in) :: level
      type(block_t), intent(in) :: block
      frame_of = frame_t(block%origin, level%grid%cell, level%grid%per_cell)
   end function frame_of

   !> After `prepare`: the particles that a block lists as emigrants leave it for the blocks that they have entered. Where one of
   !> these does not exist, all stay, listed.
   subroutine pack_emigrants(self, communicator, level, b)
      class(migration_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(inout) :: level
      integer, intent(in) :: b
      integer :: l, p, place(3)
      associate (block => level%blocks(b))
         do l = 1, block%emigrant_count
            if (level%owner_at(entered(level, block, int(block%emigrants(l)))) < 0) return
         end do
         do l = 1, block%emigrant_count
            p = block%emigrants(l)
            place = entered(level, block, p)
            call hand_over(self, communicator%rank, level%owner_at(place), block%particles%column(p, :), block%particles%id(p), &
                      block%particles%body(p), level%grid%block_index(place))
         end do
         if (block%emigrant_count > 0) call take_out(block)
      end associate
   end subroutine pack_emigrants

   !> All emigrants go to the blocks that they have entered, which must exist.
   subroutine move_emigrants(self, communicator, level, neighbours)
      class(migration_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(inout) :: level
      integer, intent(in) :: neighbours(:) !< neighbour ranks, rising
      integer :: b
      do b = 1, size(level%blocks)
         call self%pack_emigrants(communicator, level, b)
      end do
      call self%send(communicator, neighbours)
      call self%receive(communicator, neighbours)
      call self%settle(level)
   end subroutine move_emigrants

   !> Those that have been seen off go to their ranks; until `receive` nobody else may be. In messages that are so small that they
   !> are on their way at once, whatever this rank does then: the last to each neighbour has room to spare.
   subroutine send(self, communicator, neighbours)
      class(migration_t), intent(inout), asynchronous :: self
      type(communicator_t), intent(in) :: communicator
      integer, intent(in) :: neighbours(:)
      integer :: m, messages, most, n, r
      most = most_records(self)
      messages = sum(self%outgoing(neighbours)%count/most + 1)
      if (allocated(self%sent_off)) then
         if (size(self%sent_off) < messages) deallocate (self%sent_off)
      end if
      if (.not. allocated(self%sent_off)) allocate (self%sent_off(2*messages))
      self%sent_off = MPI_REQUEST_NULL
      m = 0
      do n = 1, size(neighbours)
         associate (parcel => self%outgoing(neighbours(n)))
            do r = 0, parcel%count, most
               m = m + 1
               call MPI_Isend(parcel%records(:, r + 1:), min(most, parcel%count - r), self%record, neighbours(n), 2, &
                              communicator%comm, self%sent_off(m))
            end do
         end associate
      end do
   end subroutine send

   !> What each neighbour sends is added to `incoming`.
   subroutine receive(self, communicator, neighbours)
      class(migration_t), intent(inout), asynchronous :: self
      type(communicator_t), intent(in) :: communicator
      integer, intent(in) :: neighbours(:)
      type(MPI_Status) :: status
      integer :: n, count, most
      most = most_records(self)
      do n = 1, size(neighbours)
         do
            call make_room(self%incoming, most)
            associate (before => self%incoming%count)
               call MPI_Recv(self%incoming%records(:, before + 1:before + most), most, self%record, neighbours(n), 2, &
                             communicator%comm, status)
            end associate
            call MPI_Get_count(status, self%record, count)
            self%incoming%count = self%incoming%count + count
            if (count < most) exit
         end do
      end do
      call MPI_Waitall(size(self%sent_off), self%sent_off, MPI_STATUSES_IGNORE)
      self%outgoing%count = 0
   end subroutine receive

   !> Records in a message that takes no part of the other rank's time.
   pure integer function most_records(self)
      class(migration_t), intent(in) :: self
      most_records = max(1, at_once/(size(self%incoming%records, 1)*storage_size(1.0_wp)/8))
   end function most_records

   !> A particle on its way to a block of a rank.
   subroutine hand_over(self, here, rank, values, id, body, index)
      class(migration_t), intent(inout) :: self
      integer, intent(in) :: here, rank, index
      real(wp), intent(in) :: values(:)
      integer(i8), intent(in) :: id
      integer(i4), intent(in) :: body
      self%moved = self%moved + 1
      if (rank == here) then
         call self%incoming%add(values, id, body, index, 0_i4, arrives, 0.0_wp)
      else
         self%sent = self%sent + 1
         call self%outgoing(rank)%add(values, id, body, index, 0_i4, arrives, 0.0_wp)
      end if
   end subroutine hand_over

   !> After `prepare`, before `deliver`: a particle for the block of the level in which its centre lies, and which must exist.
   subroutine give_away(self, communicator, level, values, id, body)
      class(migration_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(in) :: level
      real(wp), intent(in) :: values(:)
      integer(i8), intent(in) :: id
      integer(i4), intent(in) :: body
      integer :: place(3)
      associate (x => level%layout%position)
         place = level%grid%block_of(values(x:x + 2))
      end associate
      call hand_over(self, communicator%rank, level%owner_at(place), values, id, body, level%grid%block_index(place))
   end subroutine give_away

   !> Collective: what was given away arrives, in the order of ids.
   subroutine deliver(self, communicator, level)
      class(migration_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(inout) :: level
      call exchange_unasked(self, communicator, first_tag + level%number)
      call self%settle(level)
   end subroutine deliver

   !> The block that a leaver has entered.
   pure function entered(level, block, p) result(place)
      type(level_t), intent(in) :: level
      type(block_t), intent(in) :: block
      integer, intent(in) :: p
      integer :: place(3), node(3)
      associate (x => level%layout%position)
         node = floor((block%particles%column(p, x:x + 2) - block%origin)*level%grid%per_cell + 0.5_wp)
      end associate
      place = block%place + merge(-1, merge(1, 0, node >= block_size), node < 0)
   end function entered

   !> Remove the emigrants from their block: what has been made of its particles does not hold.
   subroutine take_out(block)
      type(block_t), intent(inout) :: block
      integer :: l, last
      last = block%particles%count
      do l = block%emigrant_count, 1, -1
         block%cells%bin(block%emigrants(l)) = block%cells%bin(last)
         last = last - 1
      end do
      call block%particles%remove(block%emigrants(:block%emigrant_count))
      block%emigrant_count = 0
      block%arrived = 0
      block%cells%current = .false.
      call block%invalidate()
   end subroutine take_out

   !> Collective: what this rank has for others goes to them, who need not know that anything comes; what comes in is added to
   !> `incoming`. All is there when every rank has been told that its messages have been received (nonblocking consensus: Hoefler,
   !> Siebert and Lumsdaine 2010). A rank may leave while another is still asked: exchanges in a row need different tags.
   subroutine exchange_unasked(self, communicator, tag)
      class(migration_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      integer, intent(in) :: tag
      type(MPI_Request) :: requests(communicator%ranks), all_done
      type(MPI_Status) :: status
      type(MPI_Message) :: message
      logical :: comes, received, over
      integer :: count, n, r
      n = 0
      do r = 0, communicator%ranks - 1
         if (self%outgoing(r)%count == 0) cycle
         n = n + 1
         call MPI_Issend(self%outgoing(r)%records, self%outgoing(r)%count, self%record, r, tag, communicator%comm, requests(n))
      end do
      received = .false.
      over = .false.
      do while (.not. over)
         call MPI_Improbe(MPI_ANY_SOURCE, tag, communicator%comm, comes, message, status)
         if (comes) then
            call MPI_Get_count(status, self%record, count)
            call make_room(self%incoming, count)
            call MPI_Mrecv(self%incoming%records(:, self%incoming%count + 1:self%incoming%count + count), count, self%record, &
                           message, MPI_STATUS_IGNORE)
            self%incoming%count = self%incoming%count + count
         end if
         if (received) then
            call MPI_Test(all_done, over, MPI_STATUS_IGNORE)
         else
            call MPI_Testall(n, requests, received, MPI_STATUSES_IGNORE)
            if (received) call MPI_Ibarrier(communicator%comm, all_done)
         end if
      end do
   end subroutine exchange_unasked

   !> Store what has come in, sorted by block and id, so that the order of arrivals does not depend on the ranks.
   subroutine settle(self, level)
      class(migration_t), intent(in) :: self
      type(level_t), intent(inout) :: level
      integer :: order(self%incoming%count), columns, r, place(3)
      columns = level%table%columns
      associate (records => self%incoming%records, count => self%incoming%count)
         order = sorted_order(int(records(columns + 3, :count), i8), transfer(records(columns + 1, :count), [0_i8]))
         do r = 1, count
            place = level%grid%block_place(int(records(columns + 3, order(r))))
            call store(records(:, order(r)), level, level%blocks(level%slot(place(1), place(2), place(3))))
         end do
      end associate
      if (self%incoming%count > 0) call level%size_work()
   end subroutine settle

   !> Append one record to its block.
   subroutine store(record, level, block)
      real(wp), intent(in) :: record(:)
      type(level_t), intent(in) :: level
      type(block_t), intent(inout) :: block
      integer :: n
      n = level%table%columns
      call block%reserve(block%particles%count + 1, n)
      call block%particles%append(record(:n), transfer(record(n + 1), 0_i8), int(record(n + 2), i4))
      associate (x => level%layout%position)
         block%cells%bin(block%particles%count) = bin_of(record(x:x + 2), frame_of(level, block))
         call block%include_place(record(x:x + 2))
      end associate
      if (record(n + 4) > 0.0_wp) block%cells%bin(block%particles%count) = int(record(n + 4), i4)
      if (record(n + 5) < 0.0_wp) then
         block%arrived = block%arrived + 1
      else
         block%disorder = record(n + 5)
         block%run_breaks = record(n + 6)
      end if
      block%pressed = .true.
      block%at_rest = .false.
      block%sums_are_valid = .false.
   end subroutine store

   !> Collective: take the particles of the blocks whose owner changes out of this rank and send them; returns when all
   !> records are here. Then the level settles into its new owners, and `unload` puts the records into their blocks.
   subroutine move_blocks(self, communicator, level, new_owner)
      class(migration_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(inout) :: level
      integer, intent(in) :: new_owner(0:, 0:, 0:)
      integer :: b, p, rank
      call self%prepare(communicator, level)
      do b = 1, size(level%blocks)
         associate (block => level%blocks(b))
            rank = new_owner(block%place(1), block%place(2), block%place(3))
            if (rank == communicator%rank) cycle
            do p = 1, block%particles%count
               call self%outgoing(rank)%add(block%particles%column(p, :), block%particles%id(p), block%particles%body(p), &
                                            block%index, block%cells%bin(p), &
                                            merge(arrives, block%disorder, p > block%particles%count - block%arrived), &
                                            block%run_breaks)
            end do
            block%particles%count = 0
         end associate
      end do
      call exchange_unasked(self, communicator, first_tag + level%number)
   end subroutine move_blocks

   !> Store the blocks that have come in, their particles in the order in which they were stored before.
   subroutine unload(self, level)
      class(migration_t), intent(inout) :: self
      type(level_t), intent(inout) :: level
      integer :: r, place(3)
      do r = 1, self%incoming%count
         place = level%grid%block_place(int(self%incoming%records(level%table%columns + 3, r)))
         call store(self%incoming%records(:, r), level, level%blocks(level%slot(place(1), place(2), place(3))))
      end do
      call level%size_work()
   end subroutine unload

   !> Begin to move particles: nothing is under way.
   subroutine prepare(self, communicator, level)
      class(migration_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(in) :: level
      integer :: r, width
      width = level%table%columns + extra
      if (self%record == MPI_DATATYPE_NULL) then
         call MPI_Type_contiguous(width, MPI_DOUBLE_PRECISION, self%record)
         call MPI_Type_commit(self%record)
         allocate (self%incoming%records(width, 64))
      end if
      if (.not. allocated(self%outgoing)) then
         allocate (self%outgoing(0:communicator%ranks - 1))
         do r = 0, communicator%ranks - 1
            allocate (self%outgoing(r)%records(width, 0))
         end do
      end if
      self%outgoing%count = 0
      self%incoming%count = 0
   end subroutine prepare

   !> Append a particle, bound for the block `index` and, where `bin` is not 0, for a bin there.
   subroutine add(self, values, id, body, index, bin, disorder, run_breaks)
      class(parcel_t), intent(inout) :: self
      real(wp), intent(in) :: values(:)
      integer(i8), intent(in) :: id
      integer(i4), intent(in) :: body, bin
      integer, intent(in) :: index
      real(wp), intent(in) :: disorder !< of the block with which it moves, or `arrives`
      real(wp), intent(in) :: run_breaks    !< of that block
      integer :: columns
      columns = size(values)
      call make_room(self, 1)
      self%count = self%count + 1
      self%records(:columns, self%count) = values
      self%records(columns + 1:, self%count) = [transfer(id, 1.0_wp), real(body, wp), real(index, wp), real(bin, wp), &
                                                 disorder, run_breaks]
   end subroutine add

   !> Room for `more` records; grows by half.
   subroutine make_room(parcel, more)
      type(parcel_t), intent(inout) :: parcel
      integer, intent(in) :: more
      real(wp), allocatable :: larger(:, :)
      if (parcel%count + more <= size(parcel%records, 2)) return
      allocate (larger(size(parcel%records, 1), max(fewest, (3*(parcel%count + more))/2)))
      larger(:, :parcel%count) = parcel%records(:, :parcel%count)
      call move_alloc(larger, parcel%records)
   end subroutine make_room

   !> Free the datatype.
   subroutine release(self)
      class(migration_t), intent(inout) :: self
      if (self%record /= MPI_DATATYPE_NULL) call MPI_Type_free(self%record)
   end subroutine release

end module m_migration
