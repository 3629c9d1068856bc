!test: ranks 1 2 4
!test: limit 240
module m_coupled
   use mpi_f08
   use m_kinds, only: wp
   use m_communicator, only: communicator_t
   use m_petsc_operator, only: petsc_operator_t
   implicit none
   private
   public :: coupled_t

   !> M = little I + U U', of which a rank has some rows of U.
   type, extends(petsc_operator_t) :: coupled_t
      type(communicator_t) :: communicator
      real(wp) :: little = 0.05_wp
      real(wp), allocatable :: rows(:, :) !< (unknowns here, rank of U)
      logical, allocatable :: free(:)
      logical :: strays = .false. !< was asked for the product of something that is not free
   contains
      procedure :: multiply
      procedure :: set_free
      procedure :: multiply_free
   end type coupled_t

contains

   !> to = M from, at idle unknowns a copy.
   subroutine multiply(self, from, to)
      class(coupled_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: from(:)
      real(wp), intent(out), contiguous :: to(:)
      real(wp) :: along(size(self%rows, 2))
      integer :: own
      own = size(self%rows, 1)
      along = matmul(from(:own), self%rows)
      call MPI_Allreduce(MPI_IN_PLACE, along, size(along), MPI_DOUBLE_PRECISION, MPI_SUM, &
                         self%communicator%comm)
      to(:own) = self%little*from(:own) + matmul(self%rows, along)
      to(own + 1:) = from(own + 1:)
   end subroutine multiply

   !> These are free from now on.
   subroutine set_free(self, free)
      class(coupled_t), intent(inout) :: self
      logical, intent(in) :: free(:)
      self%free = free
   end subroutine set_free

   !> The product between them.
   subroutine multiply_free(self, from, to)
      class(coupled_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: from(:)
      real(wp), intent(out), contiguous :: to(:)
      self%strays = self%strays .or. any(abs(from) > 0.0_wp .and. .not. self%free)
      call self%multiply(from, to)
      to = merge(to, 0.0_wp, self%free)
   end subroutine multiply_free

end module m_coupled

!> The solver of bound-constrained problems: guesses which unknowns are free, gradient projection alone, and
!> what gradient projection makes of a bad guess end at the same point, which fulfils the conditions of the
!> problem. Unknowns are coupled across ranks, strongly and with either sign.
program bounded
   use mpi_f08
   use m_kinds, only: wp, i8
   use m_communicator, only: communicator_t
   use m_petsc_solver, only: petsc_solver_t
   use m_assertions, only: assertions_t
   use m_chance, only: chance_t, keep_worst
   use m_coupled, only: coupled_t
   implicit none

   integer, parameter :: unknowns = 48, problems = 16
   integer, parameter :: ways(3) = [8, 1, 0] !< guesses
   real(wp), parameter :: tolerance = 1.0e-9_wp
   type(communicator_t) :: comm
   type(assertions_t) :: test
   type(petsc_solver_t) :: solver
   type(coupled_t) :: operator
   type(chance_t) :: chance
   real(wp), allocatable :: b(:), x(:, :), w(:)
   real(wp) :: u(unknowns), residual, off, scale, worst_residual, worst_off, worst_apart
   integer :: first, i, iterations, last, n, problem
   integer(i8) :: projected(size(ways))
   call comm%start()
   call test%start(comm, 'bounded')
   first = comm%rank*unknowns/comm%ranks + 1
   last = (comm%rank + 1)*unknowns/comm%ranks
   n = last - first + 1
   operator%communicator = comm
   allocate (b(n), w(n), x(n, size(ways)))
   call solver%fit(comm%comm%MPI_VAL, n + 5) ! some idle
   projected = 0
   worst_residual = 0.0_wp
   worst_off = 0.0_wp
   worst_apart = 0.0_wp
   do problem = 1, problems
      operator%little = merge(0.05_wp, 20.0_wp, problem <= problems/2)
      if (allocated(operator%rows)) deallocate (operator%rows)
      allocate (operator%rows(n, unknowns/2))
      do i = 1, unknowns/2
         u = chance%several(unknowns, -1.0_wp, 1.0_wp)
         operator%rows(:, i) = u(first:last)
      end do
      u = chance%several(unknowns, -1.0_wp, 1.0_wp)
      b = u(first:last)
      u = chance%several(unknowns, -1.0_wp, 1.0_wp)
      scale = sqrt(squares_of(b))
      do i = 1, size(ways)
         x(:, i) = merge(u(first:last), 0.0_wp, mod(problem, 2) == 0) ! from a start that says nothing, or
                                                                      ! from none
         solver%guesses = ways(i)
         projected(i) = projected(i) - solver%projected
         call solver%solve(operator, b, x(:, i), tolerance, 1000, iterations, residual)
         projected(i) = projected(i) + solver%projected
         call keep_worst(worst_residual, residual)
         call operator%multiply(x(:, i), w)
         off = sqrt(squares_of(merge(w - b, min(w - b, 0.0_wp), x(:, i) > 0.0_wp)))/scale
         if (any(x(:, i) < 0.0_wp)) off = huge(off)
         call keep_worst(worst_off, off)
         call keep_worst(worst_apart, sqrt(squares_of(x(:, i) - x(:, 1))/squares_of(x(:, 1))))
      end do
   end do
   call test%check(worst_residual <= tolerance, 'the solver says that every problem is solved')
   call test%check(worst_off <= 1.01_wp*tolerance, &
                   'forces, gaps and their products are what the problem asks for')
   call test%check(worst_apart <= 1.0e-6_wp, 'all ways end at the same point')
   call test%check_equal(projected(3), int(problems, i8), &
                         'without guesses all problems are for gradient projection')
   call test%check(projected(2) > problems/2, 'one guess is mostly wrong')
   call test%check(projected(1) > 0, 'where the coupling is strong, eight may be too')
   call test%check(projected(1) <= problems/2, 'where it is not, eight are enough')
   if (comm%is_root()) print '(3x,a,3i4,a,es8.1)', 'left to gradient projection with 8, 1 and 0 guesses:', &
      projected, '; furthest apart', worst_apart
   call solver%release()
   call test%check(.not. operator%strays, 'products between free unknowns are asked of no others')
   call test%finish()
contains

   !> Sum of the squares of all ranks' values.
   real(wp) function squares_of(values)
      real(wp), intent(in) :: values(:)
      squares_of = sum(values**2)
      call MPI_Allreduce(MPI_IN_PLACE, squares_of, 1, MPI_DOUBLE_PRECISION, MPI_SUM, comm%comm)
   end function squares_of

end program bounded
