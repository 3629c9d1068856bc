!> Rows of a contact problem grouped by the nodes that they share: those of the cell around a contact point,
!> or of the bin of a particle whose whole face counts (theory.md, eq. face-mean). The two halves of a product
!> load the nodes once for all their rows.
module m_cell_rows
   use m_kinds, only: wp
   implicit none
   private
   public :: cell_rows_t, cell_nodes, bin_nodes, width

   integer, parameter :: cell_nodes = 8 !< nodes of the cell around a contact point
   integer, parameter :: bin_nodes = 27 !< nodes around a particle's bin
   integer, parameter :: third = bin_nodes/3
   integer, parameter :: width = 4      !< three components and an unused one: one vector register

   !> Parts of rows with the same number of nodes; those of one cell, or of one bin, form a group. A row
   !> between two bodies has a part on the nodes of each.
   type :: grouped_rows_t
      integer :: rows = 0, groups = 0
      integer, allocatable :: first(:)         !< (groups + 1): first index of each group
      integer, allocatable :: node(:, :)       !< (nodes, groups)
      integer, allocatable :: row(:)           !< (places): the part's row
      real(wp), allocatable :: weight(:, :)    !< (nodes, places)
      real(wp), allocatable :: direction(:, :) !< (4, places)
      real(wp), allocatable :: push(:)         !< (places): work
      real(wp), allocatable :: lane(:, :)      !< (4, places): work
   end type grouped_rows_t

   type :: cell_rows_t
      private
      type(grouped_rows_t) :: of_cells, of_bins
   contains
      procedure, public :: sort
      procedure, public :: choose
      procedure, public :: spread
      procedure, public :: collect
   end type cell_rows_t

contains

   !> Sort the parts of the rows of a problem, given in any order.
   pure subroutine sort(self, nodes, row, first, node, weight, direction)
      class(cell_rows_t), intent(inout) :: self
      integer, intent(in) :: nodes             !< number of nodes
      integer, intent(in) :: row(:)            !< (parts): row of each part
      integer, intent(in) :: first(:) !< (parts + 1): of the entries of each part, as many as a cell or a bin
                                      !< has nodes
      integer, intent(in) :: node(:)           !< (entries)
      real(wp), intent(in) :: weight(:)        !< (entries): of the contact point on its nodes
      real(wp), intent(in) :: direction(:, :)  !< (4, parts): in which a row's unknown acts; the last is 0
      call group(self%of_cells, cell_nodes, nodes, row, first, node, weight, direction)
      call group(self%of_bins, bin_nodes, nodes, row, first, node, weight, direction)
   end subroutine sort

   !> Select the wanted rows of another list; they keep their numbers.
   pure subroutine choose(self, others, wanted)
      class(cell_rows_t), intent(inout) :: self
      type(cell_rows_t), intent(in) :: others
      logical, intent(in) :: wanted(:) !< (rows)
      call choose_of(self%of_cells, others%of_cells, cell_nodes, wanted)
      call choose_of(self%of_bins, others%of_bins, bin_nodes, wanted)
   end subroutine choose

   !> Allocate a number of rows with a number of nodes each.
   pure subroutine make_room(self, each, rows)
      type(grouped_rows_t), intent(inout) :: self
      integer, intent(in) :: each, rows
      integer :: room
      if (allocated(self%row)) then
         if (size(self%row) >= rows) return
         deallocate (self%first, self%node, self%row, self%weight, self%direction, self%push, self%lane)
      end if
      room = rows + rows/2 + 1
      allocate (self%first(room + 1), self%node(each, room), self%row(room), self%weight(each, room), &
                self%direction(width, room), self%push(room), self%lane(width, room))
   end subroutine make_room

   !> Group the parts with a given number of nodes.
   pure subroutine group(self, each, nodes, row, first, node, weight, direction)
      type(grouped_rows_t), intent(inout) :: self
      integer, intent(in) :: each, nodes, row(:), first(:), node(:)
      real(wp), intent(in) :: weight(:), direction(:, :)
      integer :: next(nodes + 1), at, c
      self%rows = count(first(2:) - first(:size(first) - 1) == each)
      self%groups = 0
      call make_room(self, each, self%rows)
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
         if (at > 1) then ! at a symmetry plane different cells can have the same first node
            if (all(node(first(c):first(c + 1) - 1) == self%node(:, self%groups))) cycle
         end if
         self%groups = self%groups + 1
         self%first(self%groups) = at
         self%node(:, self%groups) = node(first(c):first(c + 1) - 1)
      end do
      self%row(:self%rows) = row(self%row(:self%rows))
      self%first(self%groups + 1) = self%rows + 1
   end subroutine group

   !> Select the wanted rows with a given number of nodes of another list.
   pure subroutine choose_of(self, others, each, wanted)
      type(grouped_rows_t), intent(inout) :: self
      type(grouped_rows_t), intent(in) :: others
      integer, intent(in) :: each
      logical, intent(in) :: wanted(:) !< (rows)
      integer :: c, g
      call make_room(self, each, others%rows)
      self%rows = 0
      self%groups = 0
      do g = 1, others%groups
         self%first(self%groups + 1) = self%rows + 1
         do c = others%first(g), others%first(g + 1) - 1
            if (.not. wanted(others%row(c))) cycle
            self%rows = self%rows + 1
            self%row(self%rows) = others%row(c)
            self%weight(:, self%rows) = others%weight(:, c)
            self%direction(:, self%rows) = others%direction(:, c)
         end do
         if (self%rows < self%first(self%groups + 1)) cycle
         self%groups = self%groups + 1
         self%node(:, self%groups) = others%node(:, g)
      end do
      self%first(self%groups + 1) = self%rows + 1
   end subroutine choose_of

   !> Add the rows' forces to those of the nodes.
   pure subroutine spread(self, push, force)
      class(cell_rows_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: push(:)        !< (rows): forces along their directions
      real(wp), intent(inout), contiguous :: force(:, :) !< (4, nodes), N
      associate (it => self%of_cells)
         call in_order(it%rows, it%row, push, it%push)
         call spread_cells(it%groups, it%first, it%node, it%weight, it%direction, it%push, force)
      end associate
      associate (it => self%of_bins)
         call in_order(it%rows, it%row, push, it%push)
         call spread_bins(it%groups, it%first, it%node, it%weight, it%direction, it%push, force)
      end associate
   end subroutine spread

   !> Values of rows in the order of the groups.
   pure subroutine in_order(rows, row, from, to)
      integer, intent(in) :: rows, row(rows)
      real(wp), intent(in) :: from(*)     !< by rows
      real(wp), intent(inout) :: to(rows) !< by places
      integer :: at
      do at = 1, rows
         to(at) = from(row(at))
      end do
   end subroutine in_order

   !> Add the nodes' velocities at the rows' contact points, along their directions.
   pure subroutine collect(self, velocity, along)
      class(cell_rows_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: velocity(:, :) !< (4, nodes), m/s
      real(wp), intent(inout), contiguous :: along(:)    !< (rows)
      associate (it => self%of_cells)
         call collect_cells(it%groups, it%first, it%node, it%weight, it%direction, velocity, it%lane)
         call add_lanes(it%rows, it%row, it%lane, along)
      end associate
      associate (it => self%of_bins)
         call collect_bins(it%groups, it%first, it%node, it%weight, it%direction, velocity, it%lane)
         call add_lanes(it%rows, it%row, it%lane, along)
      end associate
   end subroutine collect

   !> Add up the lanes of rows after all are complete: done one by one, this would not be vectorised.
   pure subroutine add_lanes(rows, row, lane, along)
      integer, intent(in) :: rows, row(rows)
      real(wp), intent(in) :: lane(width, rows) !< by places
      real(wp), intent(inout) :: along(*)       !< by rows
      integer :: at
      do at = 1, rows
         along(row(at)) = along(row(at)) + (lane(1, at) + lane(2, at) + lane(3, at))
      end do
   end subroutine add_lanes

   !> One lane per component; a cell's eight nodes in registers over its rows.
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
            ! at least one, so that the loop over lanes is vectorised
            do c = first(g), max(first(g), first(g + 1) - 1)
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

   !> The lanes of rows, one per component, with a cell's eight nodes in registers over its rows.
   pure subroutine collect_cells(cells, first, node, weight, direction, velocity, lane)
      integer, intent(in) :: cells, first(cells + 1), node(cell_nodes, cells)
      real(wp), intent(in) :: weight(cell_nodes, *), direction(width, *), velocity(width, *)
      real(wp), intent(inout) :: lane(width, *)
      real(wp) :: v1, v2, v3, v4, v5, v6, v7, v8
      integer :: c, g, q
      do g = 1, cells
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
            do c = first(g), max(first(g), first(g + 1) - 1)
               lane(q, c) = direction(q, c)*( &
                  ((weight(1, c)*v1 + weight(2, c)*v2) + (weight(3, c)*v3 + weight(4, c)*v4)) + &
                  ((weight(5, c)*v5 + weight(6, c)*v6) + (weight(7, c)*v7 + weight(8, c)*v8)))
            end do
         end do
      end do
   end subroutine collect_cells

   !> The same as spread_cells, for bins: nine nodes at a time, a third of those of a bin. At a symmetry plane
   !> a node also represents its mirror image, so sums are added one by one.
   pure subroutine spread_bins(bins, first, node, weight, direction, push, force)
      integer, intent(in) :: bins, first(bins + 1), node(bin_nodes, bins)
      real(wp), intent(in) :: weight(bin_nodes, *), direction(width, *), push(*)
      real(wp), intent(inout) :: force(width, *)
      real(wp) :: s1, s2, s3, s4, s5, s6, s7, s8, s9, f
      integer :: c, from, g, q
      do g = 1, bins
         do from = 0, 2*third, third
            !$omp simd private(s1, s2, s3, s4, s5, s6, s7, s8, s9, f)
            do q = 1, width
               s1 = 0.0_wp
               s2 = 0.0_wp
               s3 = 0.0_wp
               s4 = 0.0_wp
               s5 = 0.0_wp
               s6 = 0.0_wp
               s7 = 0.0_wp
               s8 = 0.0_wp
               s9 = 0.0_wp
               do c = first(g), max(first(g), first(g + 1) - 1)
                  f = push(c)*direction(q, c)
                  s1 = s1 + weight(1 + from, c)*f
                  s2 = s2 + weight(2 + from, c)*f
                  s3 = s3 + weight(3 + from, c)*f
                  s4 = s4 + weight(4 + from, c)*f
                  s5 = s5 + weight(5 + from, c)*f
                  s6 = s6 + weight(6 + from, c)*f
                  s7 = s7 + weight(7 + from, c)*f
                  s8 = s8 + weight(8 + from, c)*f
                  s9 = s9 + weight(9 + from, c)*f
               end do
               force(q, node(1 + from, g)) = force(q, node(1 + from, g)) + s1
               force(q, node(2 + from, g)) = force(q, node(2 + from, g)) + s2
               force(q, node(3 + from, g)) = force(q, node(3 + from, g)) + s3
               force(q, node(4 + from, g)) = force(q, node(4 + from, g)) + s4
               force(q, node(5 + from, g)) = force(q, node(5 + from, g)) + s5
               force(q, node(6 + from, g)) = force(q, node(6 + from, g)) + s6
               force(q, node(7 + from, g)) = force(q, node(7 + from, g)) + s7
               force(q, node(8 + from, g)) = force(q, node(8 + from, g)) + s8
               force(q, node(9 + from, g)) = force(q, node(9 + from, g)) + s9
            end do
         end do
      end do
   end subroutine spread_bins

   !> The same as collect_cells, for bins.
   pure subroutine collect_bins(bins, first, node, weight, direction, velocity, lane)
      integer, intent(in) :: bins, first(bins + 1), node(bin_nodes, bins)
      real(wp), intent(in) :: weight(bin_nodes, *), direction(width, *), velocity(width, *)
      real(wp), intent(inout) :: lane(width, *)
      real(wp) :: v1, v2, v3, v4, v5, v6, v7, v8, v9
      integer :: c, from, g, q
      do g = 1, bins
         lane(:width, first(g):first(g + 1) - 1) = 0.0_wp
         do from = 0, 2*third, third
            !$omp simd private(v1, v2, v3, v4, v5, v6, v7, v8, v9)
            do q = 1, width
               v1 = velocity(q, node(1 + from, g))
               v2 = velocity(q, node(2 + from, g))
               v3 = velocity(q, node(3 + from, g))
               v4 = velocity(q, node(4 + from, g))
               v5 = velocity(q, node(5 + from, g))
               v6 = velocity(q, node(6 + from, g))
               v7 = velocity(q, node(7 + from, g))
               v8 = velocity(q, node(8 + from, g))
               v9 = velocity(q, node(9 + from, g))
               do c = first(g), max(first(g), first(g + 1) - 1)
                  lane(q, c) = lane(q, c) + direction(q, c)*( &
                     ((weight(1 + from, c)*v1 + weight(2 + from, c)*v2) &
                      + (weight(3 + from, c)*v3 + weight(4 + from, c)*v4)) + &
                     ((weight(5 + from, c)*v5 + weight(6 + from, c)*v6) &
                      + (weight(7 + from, c)*v7 + weight(8 + from, c)*v8)) + weight(9 + from, c)*v9)
               end do
            end do
         end do
      end do
   end subroutine collect_bins

end module m_cell_rows
