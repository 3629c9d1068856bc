!> Halo exchange by coarrays (Fortran 2008), in place of m_halo of halo_mpi.f90: `make HALO=coarray`. A rank
!> gathers the values that a neighbour needs and puts them into the neighbour's inbox, which all images have
!> allocated with the same shape. Image i is rank i - 1.
module m_halo
   use mpi_f08, only: MPI_Sendrecv, MPI_INTEGER8, MPI_STATUS_IGNORE
   use m_kinds, only: wp, i8
   use m_communicator, only: communicator_t
   use m_halo_runs, only: runs_t
   implicit none
   private
   public :: halo_t

   !> Values received from neighbours: two columns each halo, used in turn, since a neighbour may still be
   !> reading its last values, but has synchronised since it read the ones before.
   real(wp), allocatable :: inbox(:, :)[:]
   logical, allocatable :: taken(:) !< by halo number

   type :: halo_t
      integer(i8) :: held = 0                       !< memory of send and receive buffers (bytes)
      integer, private :: number = 0                !< it uses columns 2 number - 1 and 2 number of the inbox;
                                                    !< 0: none
      integer, private :: turn = 0                  !< exchanges started
      integer, allocatable, private :: images(:)    !< neighbours
      type(runs_t), allocatable, private :: send(:), receive(:)
      integer(i8), allocatable, private :: place(:) !< offset of this rank's values in each neighbour's inbox
      real(wp), allocatable, private :: gathered(:) !< for one neighbour
   contains
      procedure :: connect
      procedure :: start
      procedure :: wait
      procedure :: release
   end type halo_t

contains

   !> Collective: set the messages to and from some neighbours, replacing the old ones. A model of one rank
   !> takes no part.
   subroutine connect(self, communicator, ranks, send, receive)
      class(halo_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      integer, intent(in) :: ranks(:)
      type(runs_t), intent(in) :: send(:), receive(:) !< by neighbour
      integer(i8) :: before
      integer :: r
      if (communicator%ranks == 1) return
      self%images = ranks + 1
      self%send = send
      self%receive = receive
      self%turn = 0
      if (self%number == 0) call take_number(self%number)
      call make_room(nint(communicator%maximum(real(sum(receive%values), wp)), i8))
      if (allocated(self%place)) deallocate (self%place, self%gathered)
      allocate (self%place(size(ranks)), self%gathered(maxval([0_i8, send%values])))
      before = 0
      do r = 1, size(ranks)
         call MPI_Sendrecv(before, 1, MPI_INTEGER8, ranks(r), 1, self%place(r), 1, MPI_INTEGER8, ranks(r), &
                           1, &
                           communicator%comm, MPI_STATUS_IGNORE)
         before = before + receive(r)%values
      end do
      self%held = (2*size(inbox, 1, kind=i8) + size(self%gathered, kind=i8))*(storage_size(1.0_wp)/8)
   end subroutine connect

   !> The lowest number not used by a halo; the same on all images.
   subroutine take_number(number)
      integer, intent(out) :: number
      if (.not. allocated(taken)) allocate (taken(0))
      do number = 1, size(taken)
         if (.not. taken(number)) exit
      end do
      if (number > size(taken)) taken = [taken, .true.]
      taken(number) = .true.
   end subroutine take_number

   !> Collective: allocate an inbox of `rows` rows for all halos; its old contents are lost.
   subroutine make_room(rows)
      integer(i8), intent(in) :: rows !< the same on all images
      integer(i8) :: wanted
      wanted = rows
      if (allocated(inbox)) then
         if (size(inbox, 1, kind=i8) >= rows .and. size(inbox, 2) >= 2*size(taken)) return
         wanted = max(rows + rows/4, size(inbox, 1, kind=i8))
         deallocate (inbox)
      end if
      allocate (inbox(wanted, 2*size(taken))[*])
   end subroutine make_room

   !> Start an exchange. The values have been sent on return; received values must not be read before `wait`.
   subroutine start(self, tiles)
      class(halo_t), intent(inout) :: self
      real(wp), intent(inout), contiguous :: tiles(:, :, :, :, :)
      integer :: r
      self%turn = self%turn + 1
      do r = 1, size(self%images)
         call gather(self%send(r), tiles, self%gathered)
         associate (first => self%place(r) + 1, last => self%place(r) + self%send(r)%values)
            inbox(first:last, column_of(self))[self%images(r)] = self%gathered(:self%send(r)%values)
         end associate
      end do
   end subroutine start

   !> Wait for the neighbours' values and copy them to their tiles.
   subroutine wait(self, tiles)
      class(halo_t), intent(inout) :: self
      real(wp), intent(inout), contiguous :: tiles(:, :, :, :, :)
      integer(i8) :: before
      integer :: r
      sync images (self%images)
      before = 0
      do r = 1, size(self%images)
         associate (receive => self%receive(r))
            call scatter(receive, inbox(before + 1:before + receive%values, column_of(self)), tiles)
            before = before + receive%values
         end associate
      end do
   end subroutine wait

   !> Column of the inbox for the exchange started last.
   pure integer function column_of(self)
      type(halo_t), intent(in) :: self
      column_of = 2*self%number - mod(self%turn, 2)
   end function column_of

   !> Gather runs of a pool of tiles, one after the other, in an array.
   pure subroutine gather(runs, pool, values)
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
   end subroutine gather

   !> Scatter an array to the runs of a pool.
   pure subroutine scatter(runs, values, pool)
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
   end subroutine scatter

   !> Collective: release the columns; the inbox too when no halo uses it.
   subroutine release(self)
      class(halo_t), intent(inout) :: self
      if (self%number == 0) return
      taken(self%number) = .false.
      self%number = 0
      deallocate (self%images, self%send, self%receive, self%place, self%gathered)
      if (.not. any(taken)) deallocate (inbox, taken)
   end subroutine release

end module m_halo
