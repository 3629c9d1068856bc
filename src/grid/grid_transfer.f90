!> Nested grids, each with every other node of the one before, and restriction and prolongation between two of
!> them by hat functions of the coarser grid.
module m_grid_transfer
   use m_kinds, only: wp
   implicit none
   private
   public :: lattice_t, restrict_to, prolong_from

   !> A box of nodes, x fastest, once for each velocity field. Its nodes are numbered among those of all
   !> grids.
   type :: lattice_t
      integer :: low(3) = 0, count(3) = 0
      integer :: fields = 1
      integer :: first = 1, last = 0 !< numbers of its nodes
      integer :: from = 1, to = 0    !< positions of its values, three a node
      logical :: halves(3) = .true. !< the next grid has every other node along the axis; if false all of them
   contains
      procedure :: fit
      procedure :: place
      procedure :: node
      procedure :: take_even
   end type lattice_t

contains

   !> Set the box from its lowest nodes and minus its highest; `nodes` is the number of nodes of other grids
   !> before it. An empty box has one node.
   pure subroutine fit(self, box, fields, halves, nodes)
      class(lattice_t), intent(inout) :: self
      integer, intent(in) :: box(6), fields
      logical, intent(in) :: halves(3)
      integer, intent(inout) :: nodes
      self%fields = fields
      self%halves = halves
      self%low = 0
      self%count = 1
      if (all(-box(4:) >= box(:3))) then
         self%low = box(:3)
         self%count = 1 - box(4:) - box(:3)
      end if
      self%first = nodes + 1
      self%last = nodes + product(self%count)*fields
      nodes = self%last
      self%from = 3*self%first - 2
      self%to = 3*self%last
   end subroutine fit

   !> Number of a node of a field.
   pure integer function place(self, node, field)
      class(lattice_t), intent(in) :: self
      integer, intent(in) :: node(3), field
      associate (at => node - self%low, n => self%count)
         place = self%first + at(1) + n(1)*(at(2) + n(2)*(at(3) + n(3)*(field - 1)))
      end associate
   end function place

   !> The inverse of `place`.
   pure function node(self, number)
      class(lattice_t), intent(in) :: self
      integer, intent(in) :: number
      integer :: node(3)
      associate (m => number - self%first, n => self%count)
         node = self%low + [mod(m, n(1)), mod(m/n(1), n(2)), mod(m/(n(1)*n(2)), n(3))]
      end associate
   end function node

   !> Set the first value of a node to 1 where it is positive at the same node of the finer grid.
   pure subroutine take_even(self, finer, values)
      class(lattice_t), intent(in) :: self
      type(lattice_t), intent(in) :: finer
      real(wp), intent(inout) :: values(:) !< (3 a node, all grids)
      integer :: at(3), field, n
      do n = self%first, self%last
         at = self%node(n)
         where (self%halves) at = 2*at
         if (any(at < finer%low .or. at >= finer%low + finer%count)) cycle
         field = 1 + (n - self%first)/product(self%count)
         if (values(3*finer%place(at, field) - 2) > 0.0_wp) values(3*n - 2) = 1.0_wp
      end do
   end subroutine take_even

   !> Add the finer grid's values to those of the coarser: the full value where a node is in both, the share
   !> `beside` of a neighbour's.
   subroutine restrict_to(coarser, finer, beside, from, to)
      type(lattice_t), intent(in) :: coarser, finer
      real(wp), intent(in) :: beside
      real(wp), intent(in), contiguous :: from(:)  !< three a node of the finer grid
      real(wp), intent(inout), contiguous :: to(:) !< of the coarser one
      real(wp), allocatable :: now(:), next(:)
      integer :: axis, n(3)
      n = finer%count
      now = from
      do axis = 1, 3
         if (finer%halves(axis)) then
            allocate (next(3*product(n)/n(axis)*coarser%count(axis)*finer%fields), source=0.0_wp)
            call gather(3*product(n(:axis - 1)), n(axis), coarser%count(axis), &
                        product(n(axis + 1:))*finer%fields, finer%low(axis) - 2*coarser%low(axis), beside, &
                        now, next)
            n(axis) = coarser%count(axis)
            call move_alloc(next, now)
         end if
      end do
      to = to + now
   end subroutine restrict_to

   !> Along the middle axis.
   pure subroutine gather(before, n, m, after, offset, beside, from, to)
      integer, intent(in) :: before, n, m, after, offset
      real(wp), intent(in) :: beside
      real(wp), intent(in) :: from(before, 0:n - 1, after)
      real(wp), intent(inout) :: to(before, 0:m - 1, after)
      integer :: at, i, j
      do j = 1, after
         do i = 0, n - 1
            at = (i + offset)/2
            if (modulo(i + offset, 2) == 0) then
               to(:, at, j) = to(:, at, j) + from(:, i, j)
            else
               to(:, at, j) = to(:, at, j) + beside*from(:, i, j)
               to(:, at + 1, j) = to(:, at + 1, j) + beside*from(:, i, j)
            end if
         end do
      end do
   end subroutine gather

   !> Add the coarser grid's hats to the finer grid's values, times a factor.
   subroutine prolong_from(coarser, finer, from, to, factor)
      type(lattice_t), intent(in) :: coarser, finer
      real(wp), intent(in), contiguous :: from(:)  !< three a node of the coarser grid
      real(wp), intent(inout), contiguous :: to(:) !< of the finer one
      real(wp), intent(in), contiguous, optional :: factor(:)
      real(wp), allocatable :: now(:), next(:)
      integer :: axis, n(3)
      n = coarser%count
      now = from
      do axis = 1, 3
         if (finer%halves(axis)) then
            allocate (next(3*product(n)/n(axis)*finer%count(axis)*finer%fields))
            call scatter(3*product(n(:axis - 1)), finer%count(axis), n(axis), &
                         product(n(axis + 1:))*finer%fields, finer%low(axis) - 2*coarser%low(axis), now, next)
            n(axis) = finer%count(axis)
            call move_alloc(next, now)
         end if
      end do
      if (present(factor)) now = now*factor
      to = to + now
   end subroutine prolong_from

   !> Along the middle axis.
   pure subroutine scatter(before, n, m, after, offset, from, to)
      integer, intent(in) :: before, n, m, after, offset
      real(wp), intent(in) :: from(before, 0:m - 1, after)
      real(wp), intent(out) :: to(before, 0:n - 1, after)
      integer :: at, i, j
      do j = 1, after
         do i = 0, n - 1
            at = (i + offset)/2
            if (modulo(i + offset, 2) == 0) then
               to(:, i, j) = from(:, at, j)
            else
               to(:, i, j) = 0.5_wp*(from(:, at, j) + from(:, at + 1, j))
            end if
         end do
      end do
   end subroutine scatter

end module m_grid_transfer
