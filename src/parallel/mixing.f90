!> Mixing of the iterates of a fixed point, x = g(x), by least squares over the last few of them (Anderson
!> 1965; Walker, Ni 2011). For a linear g it is GMRES: it also finds fixed points that plain iteration departs
!> from.
module m_mixing
   use mpi_f08
   use m_kinds, only: wp
   use m_communicator, only: communicator_t
   use m_small_systems, only: solve_definite
   implicit none
   private

   integer, parameter :: depth = 3 !< changes of the iterates that are mixed
   real(wp), parameter :: round_off = 1.0e-12_wp !< relative, squared: so much of a change is its own

   type, public :: mixing_t
      private
      integer :: count = -1 !< of changes kept; -1: no iterate yet
      real(wp), allocatable :: x(:), step(:)            !< the last iterate, and g(x) - x there
      real(wp), allocatable :: moves(:, :), steps(:, :) !< (size, depth): changes of both, the latest first
   contains
      procedure :: begin
      procedure :: mix
   end type mixing_t

contains

   !> Forget earlier iterates.
   subroutine begin(self, size)
      class(mixing_t), intent(inout) :: self
      integer, intent(in) :: size !< of this rank's part of x
      self%count = -1
      if (allocated(self%x)) deallocate (self%x, self%step, self%moves, self%steps)
      allocate (self%x(size), self%step(size), self%moves(size, depth), self%steps(size, depth))
   end subroutine begin

   !> Collective: replace the step of plain iteration, g(x) - x, by the one to the next iterate.
   subroutine mix(self, communicator, size, x, step)
      class(mixing_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      integer, intent(in) :: size !< as of `begin`
      real(wp), intent(in) :: x(size)
      real(wp), intent(inout) :: step(size)
      real(wp) :: products(depth, depth + 1), shares(depth)
      logical :: definite
      integer :: i, j
      if (self%count >= 0) then
         self%moves = eoshift(self%moves, -1, dim=2)
         self%steps = eoshift(self%steps, -1, dim=2)
         self%moves(:, 1) = x - self%x
         self%steps(:, 1) = step - self%step
      end if
      self%count = min(depth, self%count + 1)
      self%x = x
      self%step = step
      products = 0.0_wp
      do j = 1, self%count
         do i = 1, self%count
            products(i, j) = dot_product(self%steps(:, i), self%steps(:, j))
         end do
         products(j, depth + 1) = dot_product(self%steps(:, j), step)
      end do
      call MPI_Allreduce(MPI_IN_PLACE, products, depth*(depth + 1), MPI_DOUBLE_PRECISION, MPI_SUM, &
                         communicator%comm)
      do j = 1, self%count
         products(j, j) = (1.0_wp + round_off)*products(j, j)
      end do
      call solve_definite(self%count, products(:self%count, :self%count), products(:self%count, depth + 1), &
                          shares(:self%count), definite)
      if (.not. definite) return ! the last steps were all the same: plain iteration
      do i = 1, self%count
         step = step - shares(i)*(self%moves(:, i) + self%steps(:, i))
      end do
   end subroutine mix

end module m_mixing
