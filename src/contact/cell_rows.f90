!> Rows of a contact problem by the nodes that they share: those of the cell around a contact point, or of the bin of a particle
!> whose whole face counts (theory.md, eq. face-mean). The two halves of a product load them once for all of their rows.
module m_cell_rows
   use m_kinds, only: wp
   implicit none
   private
   public :: cell_rows_t, cell_nodes, bin_nodes, width

   integer, parameter :: cell_nodes = 8 !< nodes of the cell around a contact point
   integer, parameter :: bin_nodes = 27 !< nodes around a particle's bin
   integer, parameter :: width = 4      !< three components and a spare one: one vector register
   integer, parameter :: at_once = 64   !< rows whose lanes wait to be added up

   !> Rows with the same number of nodes; those of one cell, or of one bin, are a group.
   type :: grouped_rows_t
      integer :: rows = 0, groups = 0
      integer, allocatable :: first(:)         !< (groups + 1): first place of each group
      integer, allocatable :: node(:, :)       !< (nodes, groups)
      integer, allocatable :: row(:)           !< (places): the row
      real(wp), allocatable :: weight(:, :)    !< (nodes, places)
      real(wp), allocatable :: direction(:, :) !< (4, places)
   end type grouped_rows_t

   type :: cell_rows_t
      private
      type(grouped_rows_t) :: of_cells, of_bins
   contains
      procedure, public :: sort
      procedure, public :: spread
      procedure, public :: collect
   end type cell_rows_t

contains

   !> Take the rows of a problem, in any order.
   pure subroutine sort(self, nodes, first, node, weight, direction)
      class(cell_rows_t), intent(inout) :: self
      integer, intent(in) :: nodes             !< how many there are
      integer, intent(in) :: first(:)          !< (rows + 1): of the entries of each row, as many as a cell or a bin has nodes
      integer, intent(in) :: node(:)           !< (entries)
      real(wp), intent(in) :: weight(:)        !< (entries): of the contact point on its nodes
      real(wp), intent(in) :: direction(:, :)  !< (4, rows): in which a force acts; the last is 0
      call group(self%of_cells, cell_nodes, nodes, first, node, weight, direction)
      call group(self%of_bins, bin_nodes, nodes, first, node, weight, direction)
   end subroutine sort

   !> Take the rows with so many nodes.
   pure subroutine group(self, each, nodes, first, node, weight, direction)
      type(grouped_rows_t), intent(inout) :: self
      integer, intent(in) :: each, nodes, first(:), node(:)
      real(wp), intent(in) :: weight(:), direction(:, :)
      integer :: next(nodes + 1), at, c
      self%rows = count(first(2:) - first(:size(first) - 1) == each)
      self%groups = 0
      if (allocated(self%row)) then
         if (size(self%row) < self%rows) deallocate (self%first, self%node, self%row, self%weight, self%direction)
      end if
      if (.not. allocated(self%row)) then
         at = self%rows + self%rows/2 + 1
         allocate (self%first(at + 1), self%node(each, at), self%row(at), self%weight(each, at), self%direction(width, at))
      end if
      next = 0
      do c = 1, size(first) - 1
         if (first(c + 1) - first(c) == each) next(node(first(c)) + 1) = next(node(first(c)) + 1) + 1
      end do
      next(1) = 1
      do c = 2, nodes
         next(c) = next(c) + next(c - 1)
      end do
      do c = 1, size(first) - 1
         if (first(c + 1) - first(c) /= each) cycle
         at = next(node(first(c)))
         next(node(first(c))) = at + 1
         self%row(at) = c
      end do
      do at = 1, self%rows
         c = self%row(at)
         self%weight(:, at) = weight(first(c):first(c + 1) - 1)
         self%direction(:, at) = direction(:, c)
         if (at > 1) then ! beside a symmetry plane, cells that differ can begin with one node
            if (all(node(first(c):first(c + 1) - 1) == self%node(:, self%groups))) cycle
         end if
         self%groups = self%groups + 1
         self%first(self%groups) = at
         self%node(:, self%groups) = node(first(c):first(c + 1) - 1)
      end do
      self%first(self%groups + 1) = self%rows + 1
   end subroutine group

   !> Add the rows' forces to those of the nodes.
   pure subroutine spread(self, push, force)
      class(cell_rows_t), intent(in) :: self
      real(wp), intent(in), contiguous :: push(:)        !< (rows), N
      real(wp), intent(inout), contiguous :: force(:, :) !< (4, nodes), N
      associate (it => self%of_cells)
         call spread_cells(it%groups, it%first, it%node, it%weight, it%direction, push(it%row(:it%rows)), force)
      end associate
      associate (it => self%of_bins)
         call spread_bins(it%groups, it%first, it%node, it%weight, it%direction, push(it%row(:it%rows)), force)
      end associate
   end subroutine spread

   !> The nodes' velocities at the rows' contact points, along their directions.
   pure subroutine collect(self, velocity, along)
      class(cell_rows_t), intent(in) :: self
      real(wp), intent(in), contiguous :: velocity(:, :) !< (4, nodes), m/s
      real(wp), intent(inout), contiguous :: along(:)    !< (rows), m/s
      associate (it => self%of_cells)
         call collect_cells(it%groups, it%first, it%node, it%row, it%weight, it%direction, velocity, along)
      end associate
      associate (it => self%of_bins)
         call collect_bins(it%groups, it%first, it%node, it%row, it%weight, it%direction, velocity, along)
      end associate
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

   !> The same as spread_cells, for bins.
   pure subroutine spread_bins(bins, first, node, weight, direction, push, force)
      integer, intent(in) :: bins, first(bins + 1), node(bin_nodes, bins)
      real(wp), intent(in) :: weight(bin_nodes, *), direction(width, *), push(*)
      real(wp), intent(inout) :: force(width, *)
      real(wp) :: sums(width, bin_nodes)
      integer :: c, g, n
      do g = 1, bins
         sums = 0.0_wp
         do c = first(g), first(g + 1) - 1
            do n = 1, bin_nodes
               sums(:, n) = sums(:, n) + weight(n, c)*(push(c)*direction(:width, c))
            end do
         end do
         do n = 1, bin_nodes
            force(:width, node(n, g)) = force(:width, node(n, g)) + sums(:, n)
         end do
      end do
   end subroutine spread_bins

   !> The same as collect_cells, for bins.
   pure subroutine collect_bins(bins, first, node, row, weight, direction, velocity, along)
      integer, intent(in) :: bins, first(bins + 1), node(bin_nodes, bins), row(*)
      real(wp), intent(in) :: weight(bin_nodes, *), direction(width, *), velocity(width, *)
      real(wp), intent(inout) :: along(*)
      real(wp) :: at(width, bin_nodes), v(width)
      integer :: c, g, n
      do g = 1, bins
         do n = 1, bin_nodes
            at(:, n) = velocity(:width, node(n, g))
         end do
         do c = first(g), first(g + 1) - 1
            v = 0.0_wp
            do n = 1, bin_nodes
               v = v + weight(n, c)*at(:, n)
            end do
            v = v*direction(:width, c)
            along(row(c)) = v(1) + v(2) + v(3)
         end do
      end do
   end subroutine collect_bins

end module m_cell_rows
