!> The ranks that solve the contact problem: those that own a block whose tile holds a node which contact may push. The others go on
!> with their particles meanwhile (design.md, Contact on some ranks).
module m_partners
   use mpi_f08
   use m_constants, only: block_size
   use m_communicator, only: communicator_t
   use m_level, only: level_t
   implicit none
   private
   public :: partners_t, owners_of

   type :: partners_t
      logical, allocatable :: member(:)     !< (from rank 0): the same on every rank
      type(communicator_t) :: communicator  !< of the members, by rising rank; none on other ranks
   contains
      procedure :: form
      procedure :: dissolve
      procedure :: has
      procedure :: numbered
   end type partners_t

contains

   !> Collective: these ranks are the members from here on.
   subroutine form(self, everyone, member)
      class(partners_t), intent(inout) :: self
      type(communicator_t), intent(in) :: everyone
      logical, intent(in) :: member(0:) !< the same on every rank
      call self%dissolve()
      if (allocated(self%member)) deallocate (self%member)
      allocate (self%member(0:everyone%ranks - 1))
      self%member = member
      call MPI_Comm_split(everyone%comm, merge(0, MPI_UNDEFINED, member(everyone%rank)), everyone%rank, self%communicator%comm)
      if (.not. member(everyone%rank)) return
      call MPI_Comm_rank(self%communicator%comm, self%communicator%rank)
      call MPI_Comm_size(self%communicator%comm, self%communicator%ranks)
   end subroutine form

   !> Collective: no rank is a member.
   subroutine dissolve(self)
      class(partners_t), intent(inout) :: self
      if (allocated(self%member)) self%member = .false.
      if (self%communicator%comm /= MPI_COMM_NULL) call MPI_Comm_free(self%communicator%comm)
   end subroutine dissolve

   !> True when a rank, by its number among all, is a member.
   pure logical function has(self, rank)
      class(partners_t), intent(in) :: self
      integer, intent(in) :: rank
      has = .false.
      if (allocated(self%member)) has = self%member(rank)
   end function has

   !> Those of some ranks that are members, by their numbers among the members.
   pure function numbered(self, ranks)
      class(partners_t), intent(in) :: self
      integer, intent(in) :: ranks(:) !< among all
      integer, allocatable :: numbered(:)
      integer :: r
      numbered = pack([(count(self%member(:ranks(r) - 1)), r=1, size(ranks))], [(self%member(ranks(r)), r=1, size(ranks))])
   end function numbered

   !> The ranks that own a block whose tile holds one of the nodes of some boxes. The same on every rank.
   pure function owners_of(level, ranks, low, high) result(owns)
      type(level_t), intent(in) :: level
      integer, intent(in) :: ranks
      integer, intent(in) :: low(:, :), high(:, :) !< (3, boxes): corners, nodes of the grid; of an empty one, low above high
      logical :: owns(0:ranks - 1)
      integer :: box, i, j, k, first(3), last(3)
      owns = .false.
      do box = 1, size(low, 2)
         if (any(low(:, box) > high(:, box))) cycle
         first = max(0, block_at(low(:, box) - 1))                     ! whose tile ends with the first node of the next block
         last = min(level%grid%blocks - 1, block_at(high(:, box) + 1)) ! whose tile begins one node before its own
         do k = first(3), last(3)
            do j = first(2), last(2)
               do i = first(1), last(1)
                  if (level%owner(i, j, k) >= 0) owns(level%owner(i, j, k)) = .true.
               end do
            end do
         end do
      end do
   contains
      !> The place of the block that has a node.
      elemental integer function block_at(node)
         integer, intent(in) :: node !< along an axis, from -1
         block_at = (node - modulo(node, block_size))/block_size
      end function block_at
   end function owners_of

end module m_partners
