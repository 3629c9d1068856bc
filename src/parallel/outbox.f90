!> Memory of each rank that the other ranks of its machine read: what one of them wants from another is not sent but fetched.
!> (Messages between processes of a machine are copied into shared memory and out of it again, piece by piece, while both look
!> after them.)
module m_outbox
   use, intrinsic :: iso_c_binding, only: c_ptr, c_f_pointer
   use mpi_f08
   use m_kinds, only: wp, i8
   use m_communicator, only: communicator_t
   implicit none
   private
   public :: outbox_t

   integer, parameter :: line = 8 !< values in a cache line

   type :: values_t
      real(wp), pointer, contiguous :: value(:) => null()
   end type values_t

   !> Without other ranks on the machine it is memory of the rank alone.
   type :: outbox_t
      real(wp), pointer, contiguous :: own(:) => null() !< what others may read
      type(values_t), allocatable, private :: of(:)     !< outboxes of the machine's ranks, from 0; none where there are no others
      integer, allocatable, private :: number(:)        !< of the communicator's ranks, from 0, on this machine; -1 elsewhere
      type(MPI_Win), private :: window = MPI_WIN_NULL
   contains
      procedure :: reserve
      procedure :: reads
      procedure :: values_of
      procedure :: set_in_order
      procedure :: bytes
      procedure :: release
   end type outbox_t

contains

   !> Collective: make room for so many values on each rank. What is there may get lost; nobody may be reading. Nobody waits for
   !> anybody where there is room already.
   subroutine reserve(self, communicator, values)
      class(outbox_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      integer(i8), intent(in) :: values(0:) !< of all ranks, the same everywhere
      integer(i8) :: wanted
      if (.not. allocated(self%number)) call find_neighbourhood(self, communicator)
      wanted = maxval(values, self%number >= 0)
      if (associated(self%own)) then
         if (size(self%own, kind=i8) >= wanted) return
      end if
      if (count(self%number >= 0) > 1) then
         call open_window(self, communicator%machine, roomy(wanted))
      else
         if (associated(self%own)) deallocate (self%own)
         allocate (self%own(roomy(wanted)))
      end if
   end subroutine reserve

   !> With room to spare, in whole cache lines.
   pure integer(i8) function roomy(values)
      integer(i8), intent(in) :: values
      roomy = line*((values + values/4)/line + 1)
   end function roomy

   !> Which ranks are on this machine.
   subroutine find_neighbourhood(self, communicator)
      type(outbox_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      type(MPI_Group) :: all, here
      integer :: r
      allocate (self%number(0:communicator%ranks - 1), source=-1)
      self%number(communicator%rank) = 0
      if (communicator%machine == MPI_COMM_NULL) return
      call MPI_Comm_group(communicator%comm, all)
      call MPI_Comm_group(communicator%machine, here)
      call MPI_Group_translate_ranks(all, communicator%ranks, [(r, r=0, communicator%ranks - 1)], here, self%number)
      where (self%number == MPI_UNDEFINED) self%number = -1
      call MPI_Group_free(all)
      call MPI_Group_free(here)
   end subroutine find_neighbourhood

   !> Collective over the ranks of a machine: room for so many values on each of them.
   subroutine open_window(self, machine, room)
      type(outbox_t), intent(inout) :: self
      type(MPI_Comm), intent(in) :: machine
      integer(i8), intent(in) :: room
      integer(MPI_ADDRESS_KIND) :: bytes
      type(c_ptr) :: base
      integer :: r, ranks, unit
      call close_window(self)
      bytes = room*(storage_size(1.0_wp)/8)
      call MPI_Win_allocate_shared(bytes, 1, MPI_INFO_NULL, machine, base, self%window)
      call MPI_Win_lock_all(MPI_MODE_NOCHECK, self%window)
      call c_f_pointer(base, self%own, [room])
      call MPI_Comm_size(machine, ranks)
      allocate (self%of(0:ranks - 1))
      do r = 0, ranks - 1
         call MPI_Win_shared_query(self%window, r, bytes, unit, base)
         call c_f_pointer(base, self%of(r)%value, [room])
      end do
   end subroutine open_window

   !> Collective over the ranks of the machine, where there is a window.
   subroutine close_window(self)
      type(outbox_t), intent(inout) :: self
      if (self%window == MPI_WIN_NULL) return
      call MPI_Win_unlock_all(self%window)
      call MPI_Win_free(self%window)
      nullify (self%own)
      deallocate (self%of)
   end subroutine close_window

   !> True when this rank can read what another has in its outbox.
   pure logical function reads(self, rank)
      class(outbox_t), intent(in) :: self
      integer, intent(in) :: rank
      reads = allocated(self%of)
      if (reads) reads = self%number(rank) >= 0
   end function reads

   !> Values in the outbox of a rank that this one can read.
   function values_of(self, rank, before, count) result(values)
      class(outbox_t), intent(in) :: self
      integer, intent(in) :: rank
      integer(i8), intent(in) :: before !< how many there are before them
      integer(i8), intent(in) :: count
      real(wp), pointer, contiguous :: values(:)
      values => self%of(self%number(rank))%value(before + 1:before + count)
   end function values_of

   !> What has been written is there for others who hear of it after this; what others wrote, of whom this rank has heard, is there.
   subroutine set_in_order(self)
      class(outbox_t), intent(in) :: self
      if (self%window /= MPI_WIN_NULL) call MPI_Win_sync(self%window)
   end subroutine set_in_order

   !> Memory held (bytes).
   elemental integer(i8) function bytes(self)
      class(outbox_t), intent(in) :: self
      bytes = 0
      if (associated(self%own)) bytes = size(self%own, kind=i8)*(storage_size(1.0_wp)/8)
   end function bytes

   !> Collective.
   subroutine release(self)
      class(outbox_t), intent(inout) :: self
      if (self%window /= MPI_WIN_NULL) then
         call close_window(self)
      else if (associated(self%own)) then
         deallocate (self%own)
      end if
      if (allocated(self%number)) deallocate (self%number)
   end subroutine release

end module m_outbox
