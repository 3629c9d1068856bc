!> Rows of a contact problem by the cell that holds their contact points: the rows of a cell share its eight nodes, which the two
!> halves of a product load once for all of them.
module m_cell_rows
   use m_kinds, only: wp
   implicit none
   private
   public :: cell_rows_t, cell_nodes, width

   integer, parameter :: cell_nodes = 8 !< nodes of the cell around a contact point
   integer, parameter :: width = 4      !< three components and a spare one: one vector register
   integer, parameter :: at_once = 64   !< rows whose lanes wait to be added up

   type :: cell_rows_t
      private
      integer :: rows = 0, cells = 0
      integer, allocatable :: first(:)         !< (cells + 1): first place of each cell
      integer, allocatable :: node(:, :)       !< (8, cells)
      integer, allocatable :: row(:)           !< (places): the row
      real(wp), allocatable :: weight(:, :)    !< (8, places)
      real(wp), allocatable :: direction(:, :) !< (4, places)
   contains
      procedure, public :: sort
      procedure, public :: spread
      procedure, public :: collect
   end type cell_rows_t

contains

   !> Take the rows of a problem, in any order.
   pure subroutine sort(self, nodes, node, weight, direction)
      class(cell_rows_t), intent(inout) :: self
      integer, intent(in) :: nodes             !< how many there are
      integer, intent(in) :: node(:, :)        !< (8, rows)
      real(wp), intent(in) :: weight(:, :)     !< (8, rows): of the contact point on its nodes
      real(wp), intent(in) :: direction(:, :)  !< (4, rows): in which a force acts; the last is 0
      integer :: next(nodes + 1), at, c
      self%rows = size(node, 2)
      self%cells = 0
      if (allocated(self%row)) then
         if (size(self%row) < self%rows) deallocate (self%first, self%node, self%row, self%weight, self%direction)
      end if
      if (.not. allocated(self%row)) then
         at = self%rows + self%rows/2 + 1
         allocate (self%first(at + 1), self%node(cell_nodes, at), self%row(at), self%weight(cell_nodes, at), &
                   self%direction(width, at))
      end if
      next = 0
      do c = 1, self%rows
         next(node(1, c) + 1) = next(node(1, c) + 1) + 1
      end do
      next(1) = 1
      do c = 2, nodes
         next(c) = next(c) + next(c - 1)
      end do
      do c = 1, self%rows
         at = next(node(1, c))
         next(node(1, c)) = at + 1
         self%row(at) = c
      end do
      do at = 1, self%rows
         c = self%row(at)
         self%weight(:, at) = weight(:, c)
         self%direction(:, at) = direction(:, c)
         if (at > 1) then ! beside a symmetry plane, cells that differ can begin with one node
            if (all(node(:, c) == self%node(:, self%cells))) cycle
         end if
         self%cells = self%cells + 1
         self%first(self%cells) = at
         self%node(:, self%cells) = node(:, c)
      end do
      self%first(self%cells + 1) = self%rows + 1
   end subroutine sort

   !> Add the rows' forces to those of the nodes.
   pure subroutine spread(self, push, force)
      class(cell_rows_t), intent(in) :: self
      real(wp), intent(in), contiguous :: push(:)        !< (rows), N
      real(wp), intent(inout), contiguous :: force(:, :) !< (4, nodes), N
      call spread_cells(self%cells, self%first, self%node, self%weight, self%direction, push(self%row(:self%rows)), force)
   end subroutine spread

   !> The nodes' velocities at the rows' contact points, along their directions.
   pure subroutine collect(self, velocity, along)
      class(cell_rows_t), intent(in) :: self
      real(wp), intent(in), contiguous :: velocity(:, :) !< (4, nodes), m/s
      real(wp), intent(inout), contiguous :: along(:)    !< (rows), m/s
      call collect_cells(self%cells, self%first, self%node, self%row, self%weight, self%direction, velocity, along)
   end subroutine collect

   !> One lane a component; a cell's eight nodes in registers over its rows.
   pure subroutine spread_cells(cells, first, node, weight, direction, push, force)
      integer, intent(in) :: cells, first(cells + 1), node(cell_nodes, cells)
      real(wp), intent(in) :: weight(cell_nodes, *), direction(width, *), push(*)
      real(wp), intent(inout) :: force(width, *)
      real(wp) :: s1, s2, s3, s4, s5, s6, s7, s8, f
      integer :: c, g, q
      do g = 1, cells
         !$omp simd private(s1, s2, s3, s4, s5, s6, s7, s8, f)
         do q = 1, width
            s1 = force(q, node(1, g))
            s2 = force(q, node(2, g))
            s3 = force(q, node(3, g))
            s4 = force(q, node(4, g))
            s5 = force(q, node(5, g))
            s6 = force(q, node(6, g))
            s7 = force(q, node(7, g))
            s8 = force(q, node(8, g))
            do c = first(g), max(first(g), first(g + 1) - 1) ! at least one, so that the loop over lanes can become vectors
               f = push(c)*direction(q, c)
               s1 = s1 + weight(1, c)*f
               s2 = s2 + weight(2, c)*f
               s3 = s3 + weight(3, c)*f
               s4 = s4 + weight(4, c)*f
               s5 = s5 + weight(5, c)*f
               s6 = s6 + weight(6, c)*f
               s7 = s7 + weight(7, c)*f
               s8 = s8 + weight(8, c)*f
            end do
            force(q, node(1, g)) = s1
            force(q, node(2, g)) = s2
            force(q, node(3, g)) = s3
            force(q, node(4, g)) = s4
            force(q, node(5, g)) = s5
            force(q, node(6, g)) = s6
            force(q, node(7, g)) = s7
            force(q, node(8, g)) = s8
         end do
      end do
   end subroutine spread_cells

   !> One lane a component until all of a cell's rows are done: adding up lanes in between would leave the vectors.
   pure subroutine collect_cells(cells, first, node, row, weight, direction, velocity, along)
      integer, intent(in) :: cells, first(cells + 1), node(cell_nodes, cells), row(*)
      real(wp), intent(in) :: weight(cell_nodes, *), direction(width, *), velocity(width, *)
      real(wp), intent(inout) :: along(*)
      real(wp) :: v1, v2, v3, v4, v5, v6, v7, v8, lane(width, at_once)
      integer :: c, g, q, start, last
      do g = 1, cells
         do start = first(g), first(g + 1) - 1, at_once
            last = min(start + at_once, first(g + 1)) - 1
            !$omp simd private(v1, v2, v3, v4, v5, v6, v7, v8)
            do q = 1, width
               v1 = velocity(q, node(1, g))
               v2 = velocity(q, node(2, g))
               v3 = velocity(q, node(3, g))
               v4 = velocity(q, node(4, g))
               v5 = velocity(q, node(5, g))
               v6 = velocity(q, node(6, g))
               v7 = velocity(q, node(7, g))
               v8 = velocity(q, node(8, g))
               do c = start, max(start, last)
                  lane(q, c - start + 1) = direction(q, c)*( &
                     ((weight(1, c)*v1 + weight(2, c)*v2) + (weight(3, c)*v3 + weight(4, c)*v4)) + &
                     ((weight(5, c)*v5 + weight(6, c)*v6) + (weight(7, c)*v7 + weight(8, c)*v8)))
               end do
            end do
            do c = start, last
               along(row(c)) = lane(1, c - start + 1) + lane(2, c - start + 1) + lane(3, c - start + 1)
            end do
         end do
      end do
   end subroutine collect_cells

end module m_cell_rows
