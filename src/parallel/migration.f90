!> Migration of particles between blocks, and of blocks with all their particles between ranks.
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
   public :: migration_t, parcel_t, frame_of, take_out

   !> Contents of a record after a particle's columns.
   integer, parameter :: at_id = 1       !< the bits of its id
   integer, parameter :: at_body = 2
   integer, parameter :: at_block = 3 !< index of the destination block. If the block moves as a whole, of
                                      !< that block:
   integer, parameter :: at_breaks = 4   !< run_breaks
   integer, parameter :: at_disorder = 5 !< disorder
   integer, parameter :: at_mean = 6     !< mean_breaks
   integer, parameter :: extra = 6

   integer, parameter :: neighbours_tag = 2 !< of messages with emigrants
   integer, parameter :: first_tag = 16 !< of messages that the receiver does not expect: this plus the number
                                        !< of the level
   integer, parameter :: fewest = 64        !< smallest capacity, in records

   !> Records of particles in transit: one column a particle.
   type :: parcel_t
      integer :: count = 0
      real(wp), allocatable :: records(:, :)
   contains
      procedure :: add
   end type parcel_t

   type :: migration_t
      type(parcel_t), allocatable :: outgoing(:) !< by rank, from 0
      type(parcel_t) :: incoming
      type(parcel_t) :: unassigned                 !< emigrants to blocks that do not exist yet
      type(MPI_Datatype) :: record = MPI_DATATYPE_NULL
      integer(i8) :: moved = 0      !< particles that changed block on this rank
      integer(i8) :: sent = 0       !< of those, to other ranks
   contains
      procedure :: prepare
      procedure :: clear
      procedure :: emigrate
      procedure :: assign_to_blocks
      procedure :: identify
      procedure :: missing
      procedure :: exchange
      procedure :: send_to_level
      procedure :: exchange_levels
      procedure :: move_blocks
      procedure :: unpack_blocks
      procedure :: release
   end type migration_t

contains

   !> Position and cell size of a block, for the kernels.
   pure type(frame_t) function frame_of(level, block)
      type(level_t), intent(in) :: level
      type(block_t), intent(in) :: block
      frame_of = frame_t(block%origin, level%grid%cell, level%grid%per_cell)
   end function frame_of

   !> Move the particles that a block lists as emigrants to the records of the blocks that they have entered.
   subroutine emigrate(self, communicator, level, b)
      class(migration_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(inout) :: level
      integer, intent(in) :: b
      integer :: m, p, place(3)
      associate (block => level%blocks(b))
         if (block%emigrant_count == 0) return
         self%moved = self%moved + block%emigrant_count
         do m = 1, block%emigrant_count
            p = block%emigrants(m)
            place = entered(level, block, p)
            call address(self, communicator%rank, level%owner_at(place, block%field), &
                         block%particles%column(p, :), block%particles%id(p), block%particles%body(p), &
                         level%grid%block_index(place, block%field))
         end do
         call take_out(block)
      end associate
   end subroutine emigrate

   !> Send on the emigrants whose blocks did not exist and do now.
   subroutine assign_to_blocks(self, communicator, level)
      class(migration_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(in) :: level
      integer :: index, n, r
      n = level%table%columns
      do r = 1, self%unassigned%count
         associate (record => self%unassigned%records(:, r))
            index = int(record(n + at_block))
            call address(self, communicator%rank, level%owner(index), record(:n), &
                         transfer(record(n + at_id), 0_i8), int(record(n + at_body), i4), index)
         end associate
      end do
      self%unassigned%count = 0
   end subroutine assign_to_blocks

   !> Identify a particle without a destination block.
   pure subroutine identify(self, level, r, id, body, place)
      class(migration_t), intent(in) :: self
      type(level_t), intent(in) :: level
      integer, intent(in) :: r          !< number of its record
      integer(i8), intent(out) :: id
      integer, intent(out) :: body
      real(wp), intent(out) :: place(3) !< of its centre, m
      associate (record => self%unassigned%records(:, r), n => level%table%columns, &
                 x => level%layout%position)
         id = transfer(record(n + at_id), 0_i8)
         body = int(record(n + at_body))
         place = record(x:x + 2)
      end associate
   end subroutine identify

   !> Indices of the blocks that emigrants have entered and that do not exist.
   pure function missing(self, level) result(index)
      class(migration_t), intent(in) :: self
      type(level_t), intent(in) :: level
      integer :: index(self%unassigned%count)
      index = int(self%unassigned%records(level%table%columns + at_block, :self%unassigned%count))
   end function missing

   !> Collective among neighbours: exchange emigrants, one message a neighbour, and store them in the order of
   !> their ids.
   subroutine exchange(self, communicator, level, neighbours)
      class(migration_t), intent(inout), asynchronous :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(inout) :: level
      integer, intent(in) :: neighbours(:) !< neighbour ranks, rising
      type(MPI_Request) :: requests(size(neighbours))
      type(MPI_Message) :: message
      type(MPI_Status) :: status
      integer :: n
      do n = 1, size(neighbours)
         associate (parcel => self%outgoing(neighbours(n)))
            call MPI_Isend(parcel%records, parcel%count, self%record, neighbours(n), neighbours_tag, &
                           communicator%comm, requests(n))
         end associate
      end do
      do n = 1, size(neighbours)
         call MPI_Mprobe(neighbours(n), neighbours_tag, communicator%comm, message, status)
         call receive(self, message, status)
      end do
      call MPI_Waitall(size(neighbours), requests, MPI_STATUSES_IGNORE)
      call insert(self, level)
   end subroutine exchange

   !> Append a probed message to `incoming`.
   subroutine receive(self, message, status)
      class(migration_t), intent(inout) :: self
      type(MPI_Message), intent(inout) :: message
      type(MPI_Status), intent(in) :: status
      integer :: count
      call MPI_Get_count(status, self%record, count)
      call make_room(self%incoming, count)
      call MPI_Mrecv(self%incoming%records(:, self%incoming%count + 1:self%incoming%count + count), count, &
                     self%record, message, MPI_STATUS_IGNORE)
      self%incoming%count = self%incoming%count + count
   end subroutine receive

   !> Queue a particle for a block of a rank, or for a block that does not exist yet.
   subroutine address(self, here, rank, values, id, body, index)
      class(migration_t), intent(inout) :: self
      integer, intent(in) :: here, rank, index
      real(wp), intent(in) :: values(:)
      integer(i8), intent(in) :: id
      integer(i4), intent(in) :: body
      if (rank < 0) then
         call self%unassigned%add(values, id, body, index)
      else if (rank == here) then
         call self%incoming%add(values, id, body, index)
      else
         self%sent = self%sent + 1
         call self%outgoing(rank)%add(values, id, body, index)
      end if
   end subroutine address

   !> Queue a particle that changes level for the block of this level that contains its centre, which must
   !> exist.
   subroutine send_to_level(self, communicator, level, values, id, body)
      class(migration_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(in) :: level
      real(wp), intent(in) :: values(:)
      integer(i8), intent(in) :: id
      integer(i4), intent(in) :: body
      integer :: index, place(3)
      associate (x => level%layout%position)
         place = level%grid%block_of(values(x:x + 2))
      end associate
      self%moved = self%moved + 1
      index = level%grid%block_index(place, level%field_of_body(body))
      call address(self, communicator%rank, level%owner(index), values, id, body, index)
   end subroutine send_to_level

   !> Collective: receive the particles sent to this level, stored in the order of ids.
   subroutine exchange_levels(self, communicator, level)
      class(migration_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(inout) :: level
      call exchange_unasked(self, communicator, first_tag + level%number)
      call insert(self, level)
   end subroutine exchange_levels

   !> The block that an emigrant has entered.
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

   !> Remove the emigrants from their block.
   subroutine take_out(block)
      type(block_t), intent(inout) :: block
      integer :: last, m
      last = block%particles%count
      do m = block%emigrant_count, 1, -1
         block%cells%bin(block%emigrants(m)) = block%cells%bin(last)
         last = last - 1
      end do
      call block%particles%remove(block%emigrants(:block%emigrant_count))
      block%emigrant_count = 0
      call block%cells%outdate()
   end subroutine take_out

   !> Collective: send this rank's records to others, which need not know that any are coming; those received
   !> are appended to `incoming`. The exchange is complete when every rank knows that its messages have been
   !> received (nonblocking consensus: Hoefler, Siebert and Lumsdaine 2010). A rank may leave before the
   !> others do: successive exchanges need different tags.
   subroutine exchange_unasked(self, communicator, tag)
      class(migration_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      integer, intent(in) :: tag
      type(MPI_Request) :: requests(communicator%ranks), all_done
      type(MPI_Status) :: status
      type(MPI_Message) :: message
      logical :: comes, received, over
      integer :: n, r
      n = 0
      do r = 0, communicator%ranks - 1
         if (self%outgoing(r)%count == 0) cycle
         n = n + 1
         call MPI_Issend(self%outgoing(r)%records, self%outgoing(r)%count, self%record, r, tag, &
                         communicator%comm, requests(n))
      end do
      received = .false.
      over = .false.
      do while (.not. over)
         call MPI_Improbe(MPI_ANY_SOURCE, tag, communicator%comm, comes, message, status)
         if (comes) call receive(self, message, status)
         if (received) then
            call MPI_Test(all_done, over, MPI_STATUS_IGNORE)
         else
            call MPI_Testall(n, requests, received, MPI_STATUSES_IGNORE)
            if (received) call MPI_Ibarrier(communicator%comm, all_done)
         end if
      end do
   end subroutine exchange_unasked

   !> Store the received records, sorted by block and id, so that the order does not depend on ranks or on the
   !> order of arrival.
   subroutine insert(self, level)
      class(migration_t), intent(inout) :: self
      type(level_t), intent(inout) :: level
      integer :: order(self%incoming%count), n, r
      n = level%table%columns
      associate (records => self%incoming%records, count => self%incoming%count)
         order = sorted_order(int(records(n + at_block, :count), i8), &
                              transfer(records(n + at_id, :count), [0_i8]))
         do r = 1, count
            call store(records(:, order(r)), level, level%blocks(slot_of(level, &
                  records(n + at_block, order(r)))))
         end do
      end associate
      if (self%incoming%count > 0) call level%size_work()
      self%incoming%count = 0
      self%outgoing%count = 0
   end subroutine insert

   !> Slot of a block by the index in a record.
   pure integer function slot_of(level, index)
      type(level_t), intent(in) :: level
      real(wp), intent(in) :: index
      slot_of = level%slot(int(index))
   end function slot_of

   !> Append one record to its block.
   subroutine store(record, level, block)
      real(wp), intent(in) :: record(:)
      type(level_t), intent(in) :: level
      type(block_t), intent(inout) :: block
      integer :: n, p
      n = level%table%columns
      call block%reserve(block%particles%count + 1, n)
      call block%particles%append(record(:n), transfer(record(n + at_id), 0_i8), int(record(n + at_body), i4))
      p = block%particles%count
      associate (x => level%layout%position)
         block%cells%bin(p) = bin_of(record(x:x + 2), frame_of(level, block))
         call block%include_place(record(x:x + 2))
      end associate
      call block%cells%link_in(p)
      block%pressed = .true.
   end subroutine store

   !> Collective: take the particles of blocks with a new owner out of this rank and send them; returns when
   !> all records have arrived. The level must then be adapted to the new owners, before `unpack_blocks`
   !> stores the records in their blocks.
   subroutine move_blocks(self, communicator, level, new_owner)
      class(migration_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(inout) :: level
      integer, intent(in) :: new_owner(:) !< (blocks, by number)
      integer :: b, p, rank
      do b = 1, size(level%blocks)
         associate (block => level%blocks(b))
            rank = new_owner(block%index)
            if (rank == communicator%rank) cycle
            do p = 1, block%particles%count
               call self%outgoing(rank)%add(block%particles%column(p, :), block%particles%id(p), &
                                            block%particles%body(p), block%index, block)
            end do
            block%particles%count = 0
            call block%particles%changed()
         end associate
      end do
      call exchange_unasked(self, communicator, first_tag + level%number)
   end subroutine move_blocks

   !> Store the received blocks, with their particles in their old order.
   subroutine unpack_blocks(self, level)
      class(migration_t), intent(inout) :: self
      type(level_t), intent(inout) :: level
      integer :: b, n, r
      n = level%table%columns
      do r = 1, self%incoming%count
         associate (record => self%incoming%records(:, r))
            b = slot_of(level, record(n + at_block))
            call store(record, level, level%blocks(b))
            if (r < self%incoming%count) then
               if (nint(self%incoming%records(n + at_block, r + 1)) == nint(record(n + at_block))) cycle
            end if
            associate (block => level%blocks(b)) ! the block of the last record
               call block%cells%outdate()
               block%run_breaks = nint(record(n + at_breaks))
               block%disorder = record(n + at_disorder)
               block%mean_breaks = record(n + at_mean)
            end associate
         end associate
      end do
      call level%size_work()
      self%incoming%count = 0
      self%outgoing%count = 0
   end subroutine unpack_blocks

   !> Allocate buffers.
   subroutine prepare(self, communicator, columns)
      class(migration_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      integer, intent(in) :: columns
      integer :: r
      call MPI_Type_contiguous(columns + extra, MPI_DOUBLE_PRECISION, self%record)
      call MPI_Type_commit(self%record)
      allocate (self%outgoing(0:communicator%ranks - 1))
      do r = 0, communicator%ranks - 1
         allocate (self%outgoing(r)%records(columns + extra, 0))
      end do
      allocate (self%incoming%records(columns + extra, fewest), self%unassigned%records(columns + extra, 0))
   end subroutine prepare

   !> Empty all buffers.
   subroutine clear(self)
      class(migration_t), intent(inout) :: self
      self%incoming%count = 0
      self%outgoing%count = 0
      self%unassigned%count = 0
   end subroutine clear

   !> Append a particle for the block `index`; with its block's data, if that moves as a whole.
   subroutine add(self, values, id, body, index, block)
      class(parcel_t), intent(inout) :: self
      real(wp), intent(in) :: values(:)
      integer(i8), intent(in) :: id
      integer(i4), intent(in) :: body
      integer, intent(in) :: index
      type(block_t), intent(in), optional :: block
      integer :: columns
      columns = size(values)
      call make_room(self, 1)
      self%count = self%count + 1
      associate (record => self%records(:, self%count))
         record(:columns) = values
         record(columns + 1:) = 0.0_wp
         record(columns + at_id) = transfer(id, 1.0_wp)
         record(columns + at_body) = real(body, wp)
         record(columns + at_block) = real(index, wp)
         if (.not. present(block)) return
         record(columns + at_breaks) = real(block%run_breaks, wp)
         record(columns + at_disorder) = block%disorder
         record(columns + at_mean) = block%mean_breaks
      end associate
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
