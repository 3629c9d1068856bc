!> The region of a nested level: a set of cells of the level above, of any shape (theory.md, Levels).
!>
!> A cell on a side of the grid is extended beyond it: the region has no edge there. Where the cells fill
!> their bounding box, queries use the sides of that box; else the number of cells of the region in a box,
!> which takes eight look-ups for any size.
module m_region
   use m_kinds, only: wp, i8
   use m_grid_level, only: grid_level_t
   implicit none
   private
   public :: region_t, make_region, unpack_region

   real(wp), parameter :: entry_margin = 0.25_wp !< distance, in its cells, at which a box counts as reaching
                                                 !< in: a lattice that ends at an edge must not change level
                                                 !< with the first motion, or by round-off

   type :: region_t
      private
      type(grid_level_t) :: grid           !< the level's
      integer :: low(3) = 0, high(3) = 0   !< sides of the bounding box of the cells, in nodes of that grid
      real(wp) :: lower(3) = -huge(1.0_wp) !< the same, m; -huge where the box reaches a side of the grid
      real(wp) :: upper(3) = huge(1.0_wp)  !< m
      integer :: first(3) = -huge(1)       !< nodes strictly inside that box: first to last
      integer :: last(3) = huge(1)
      real(wp) :: near = 0.0_wp            !< entry_margin in m
      integer, allocatable :: below(:, :, :) !< where the box has gaps: number of cells of the region among
                                             !< its first i, j, k cells
   contains
      procedure :: overlaps
      procedure :: holds
      procedure :: is_inner
      procedure :: any_outer
      procedure :: clear_of_edge
      procedure :: holds_box
      procedure :: has_all, has_some
      procedure :: clip
      procedure :: same_as
      procedure :: shifted
      procedure :: cells
      procedure :: node_box
      procedure :: bounding_box
      procedure :: outline
      procedure :: packed
   end type region_t

   interface make_region
      module procedure region_of_box, region_of_cells
   end interface make_region

contains

   !> The region between two nodes of a level's grid.
   pure type(region_t) function region_of_box(grid, low, high) result(region)
      type(grid_level_t), intent(in) :: grid
      integer, intent(in) :: low(3), high(3) !< even: nodes of the level above
      integer :: axis
      region%grid = grid
      region%near = entry_margin*grid%cell
      region%low = low
      region%high = high
      do axis = 1, 3
         if (low(axis) > 0) then
            region%lower(axis) = grid%lower(axis) + low(axis)*grid%cell
            region%first(axis) = low(axis) + 1
         end if
         if (high(axis) < grid%cells(axis)) then
            region%upper(axis) = grid%lower(axis) + high(axis)*grid%cell
            region%last(axis) = high(axis) - 1
         end if
      end do
   end function region_of_box

   !> The region of the chosen cells of the level above; `chosen` begins at a node of the level's grid.
   pure type(region_t) function region_of_cells(grid, low, chosen) result(region)
      type(grid_level_t), intent(in) :: grid
      integer, intent(in) :: low(3) !< even
      logical, intent(in) :: chosen(:, :, :)
      integer :: a(3), z(3), i, j, k
      a = [findloc(any(any(chosen, 3), 2), .true., 1), findloc(any(any(chosen, 3), 1), .true., 1), &
           findloc(any(any(chosen, 2), 1), .true., 1)]
      z = [findloc(any(any(chosen, 3), 2), .true., 1, back=.true.), findloc(any(any(chosen, 3), 1), .true., &
         1, back=.true.), findloc(any(any(chosen, 2), 1), .true., 1, back=.true.)]
      if (.not. any(chosen)) a = 1
      region = region_of_box(grid, low + 2*(a - 1), low + 2*z)
      if (any(chosen) .and. all(chosen(a(1):z(1), a(2):z(2), a(3):z(3)))) return
      z = z - a + 1
      allocate (region%below(0:z(1), 0:z(2), 0:z(3)), source=0)
      associate (n => region%below)
         do k = 1, z(3)
            do j = 1, z(2)
               do i = 1, z(1)
                  n(i, j, k) = merge(1, 0, chosen(a(1) + i - 1, a(2) + j - 1, a(3) + k - 1)) &
                               + n(i - 1, j - 1, k - 1) + (n(i - 1, j, k) - n(i - 1, j - 1, k)) &
                               + (n(i, j - 1, k) - n(i, j - 1, k - 1)) + (n(i, j, k - 1) - n(i - 1, j, k - 1))
               end do
            end do
         end do
      end associate
   end function region_of_cells

   !> True when a box reaches into the region, or comes near it.
   pure logical function overlaps(self, low, high)
      class(region_t), intent(in) :: self
      real(wp), intent(in) :: low(3), high(3) !< m
      integer :: first(3), last(3)
      overlaps = all(high > self%lower - self%near .and. low < self%upper + self%near)
      if (.not. (overlaps .and. allocated(self%below))) return
      call cells_near(self, low, high, self%near, first, last)
      overlaps = count_of(self, first, last) > 0
   end function overlaps

   !> True when a position lies inside, not on an edge.
   pure logical function holds(self, place)
      class(region_t), intent(in) :: self
      real(wp), intent(in) :: place(3) !< m
      integer :: first(3), last(3)
      holds = all(place > self%lower .and. place < self%upper)
      if (.not. (holds .and. allocated(self%below))) return
      ! all cells that touch the position
      call cells_near(self, nearest(place, -1.0_wp), nearest(place, 1.0_wp), 0.0_wp, first, last)
      holds = all_of(self, first, last)
   end function holds

   !> True when a node (indices in the level's grid) is an unknown of the level; all others are constrained
   !> nodes of the level above.
   pure logical function is_inner(self, node)
      class(region_t), intent(in) :: self
      integer, intent(in) :: node(3)
      is_inner = .not. any_outer(self, node, node)
   end function is_inner

   !> True when a node in the range first to last, along each axis, is no unknown of the level.
   pure logical function any_outer(self, first, last)
      class(region_t), intent(in) :: self
      integer, intent(in) :: first(3), last(3)
      any_outer = .not. all(first >= self%first .and. last <= self%last)
      if (any_outer .or. .not. allocated(self%below)) return
      ! all cells that touch the nodes
      any_outer = .not. all_of(self, in_grid(self, (first - 1)/2), in_grid(self, last/2))
   end function any_outer

   !> True when no point of a box is less than `width` away from an edge.
   pure logical function clear_of_edge(self, low, high, width)
      class(region_t), intent(in) :: self
      real(wp), intent(in) :: low(3), high(3), width !< m; width must be above 0
      integer :: first(3), last(3)
      clear_of_edge = any(high <= self%lower - width .or. low >= self%upper + width)
      if (clear_of_edge) return
      clear_of_edge = holds_box(self, low, high, width)
      if (clear_of_edge .or. .not. allocated(self%below)) return
      call cells_near(self, low, high, width, first, last)
      clear_of_edge = count_of(self, first, last) == 0
   end function clear_of_edge

   !> True when a box lies inside, at least `width` away from all edges.
   pure logical function holds_box(self, low, high, width)
      class(region_t), intent(in) :: self
      real(wp), intent(in) :: low(3), high(3), width !< m; width must be above 0
      integer :: first(3), last(3)
      holds_box = all(low >= self%lower + width .and. high <= self%upper - width)
      if (.not. (holds_box .and. allocated(self%below))) return
      call cells_near(self, low, high, width, first, last)
      holds_box = all_of(self, first, last)
   end function holds_box

   !> True when all cells of the level above from first to last along each axis belong to the region. A cell
   !> beyond a side of the grid counts as the one on that side.
   pure logical function has_all(self, first, last)
      class(region_t), intent(in) :: self
      integer, intent(in) :: first(3), last(3)
      integer :: a(3), z(3)
      a = in_grid(self, first)
      z = in_grid(self, last)
      has_all = all(2*a >= self%low .and. 2*(z + 1) <= self%high)
      if (has_all .and. allocated(self%below)) has_all = all_of(self, a, z)
   end function has_all

   !> True when at least one of these cells does.
   pure logical function has_some(self, first, last)
      class(region_t), intent(in) :: self
      integer, intent(in) :: first(3), last(3)
      integer :: a(3), z(3)
      a = in_grid(self, first)
      z = in_grid(self, last)
      has_some = all(2*(z + 1) > self%low .and. 2*a < self%high)
      if (has_some .and. allocated(self%below)) has_some = count_of(self, a, z) > 0
   end function has_some

   !> Clip a box to the points less than `margin` away from the bounding box of the region.
   pure subroutine clip(self, margin, low, high)
      class(region_t), intent(in) :: self
      real(wp), intent(in) :: margin                !< m
      real(wp), intent(inout) :: low(3), high(3) !< m
      low = max(low, self%lower - margin)
      high = min(high, self%upper + margin)
   end subroutine clip

   !> True when two regions of one grid have the same cells.
   pure logical function same_as(self, other)
      class(region_t), intent(in) :: self
      type(region_t), intent(in) :: other
      same_as = all(self%low == other%low .and. self%high == other%high) .and. &
                (allocated(self%below) .eqv. allocated(other%below))
      if (same_as .and. allocated(self%below)) same_as = all(self%below == other%below)
   end function same_as

   !> The region shifted, clipped to the grid. An extension beyond a side of the grid is applied before the
   !> shift.
   pure type(region_t) function shifted(self, shift) result(region)
      class(region_t), intent(in) :: self
      integer, intent(in) :: shift(3) !< in nodes of the level's grid; even
      logical, allocatable :: chosen(:, :, :)
      integer :: low(3), high(3), from(3), i, j, k
      low = merge(0, min(max(self%low + shift, 0), self%grid%cells), self%low == 0)
      associate (most => self%grid%cells)
         high = merge(most, min(max(self%high + shift, 0), most), self%high == most)
      end associate
      if (.not. allocated(self%below)) then
         region = region_of_box(self%grid, low, high)
         return
      end if
      allocate (chosen((high(1) - low(1))/2, (high(2) - low(2))/2, (high(3) - low(3))/2))
      do k = 1, size(chosen, 3)
         do j = 1, size(chosen, 2)
            do i = 1, size(chosen, 1)
               from = in_grid(self, (low - shift)/2 + [i, j, k] - 1)
               chosen(i, j, k) = all_of(self, from, from)
            end do
         end do
      end do
      region = region_of_cells(self%grid, low, chosen)
   end function shifted

   !> Number of the level's cells in the region; for a section those of its plane.
   pure integer(i8) function cells(self)
      class(region_t), intent(in) :: self
      cells = product(int(self%high - self%low, i8))
      if (allocated(self%below)) cells = 8_i8*count_of(self, self%low/2, self%high/2 - 1)
      if (self%grid%section%is_flat()) cells = cells/self%grid%cells(2)
   end function cells

   !> The sides of its bounding box, in nodes of the level's grid.
   pure subroutine node_box(self, low, high)
      class(region_t), intent(in) :: self
      integer, intent(out) :: low(3), high(3)
      low = self%low
      high = self%high
   end subroutine node_box

   !> The corners of its bounding box, m.
   pure subroutine bounding_box(self, lower, upper)
      class(region_t), intent(in) :: self
      real(wp), intent(out) :: lower(3), upper(3)
      lower = place_of(self, self%low)
      upper = place_of(self, self%high)
   end subroutine bounding_box

   !> The straight edges of its surface, by their end points, m: (3, 2, lines).
   pure function outline(self) result(ends)
      class(region_t), intent(in) :: self
      real(wp), allocatable :: ends(:, :, :)
      integer :: step(3), cells(3), at(3), from, axis, u, v, i, j, k, n, pass
      step = self%high - self%low
      if (allocated(self%below)) step = 2
      cells = (self%high - self%low)/step
      do pass = 1, 2 ! count, then list
         n = 0
         do axis = 1, 3
            u = modulo(axis, 3) + 1
            v = modulo(axis + 1, 3) + 1
            do k = 0, cells(v)
               do j = 0, cells(u)
                  from = -1
                  at([u, v]) = [j, k]
                  do i = 0, cells(axis)
                     at(axis) = i
                     if (bent(at, axis, u, v)) then
                        if (from < 0) from = i
                        cycle
                     end if
                     if (from < 0) cycle
                     n = n + 1
                     if (pass == 2) ends(:, 2, n) = place_of(self, self%low + step*at)
                     at(axis) = from
                     if (pass == 2) ends(:, 1, n) = place_of(self, self%low + step*at)
                     from = -1
                  end do
               end do
            end do
         end do
         if (pass == 1) allocate (ends(3, 2, n))
      end do
   contains
      !> True when the cell edge in direction `axis` from a corner, shared by four cells, is an edge of the
      !> surface.
      pure logical function bent(at, axis, u, v)
         integer, intent(in) :: at(3), axis, u, v
         logical :: here(4)
         integer :: c, cell(3)
         do c = 1, 4
            cell = at
            cell(u) = cell(u) - merge(1, 0, c == 1 .or. c == 3)
            cell(v) = cell(v) - merge(1, 0, c <= 2)
            here(c) = all(cell >= 0 .and. cell < cells)
            if (here(c) .and. allocated(self%below)) &
               here(c) = all_of(self, self%low/2 + cell, self%low/2 + cell)
         end do
         bent = modulo(count(here), 2) == 1 .or. (count(here) == 2 .and. (here(1) .eqv. here(4)))
      end function bent
   end function outline

   !> The region as numbers for unpack_region: its box, the number of further numbers, and where the box has
   !> gaps a 1 or a 0 for each of its cells, x fastest.
   pure function packed(self) result(numbers)
      class(region_t), intent(in) :: self
      integer(i8), allocatable :: numbers(:)
      integer :: n(3), i, j, k
      n = 0
      if (allocated(self%below)) n = (self%high - self%low)/2
      associate (a => self%low/2)
         numbers = [int([self%low, self%high, product(n)], i8), [(((merge(1_i8, 0_i8, &
            all_of(self, a + [i, j, k], a + [i, j, k])), i=0, n(1) - 1), j=0, n(2) - 1), k=0, n(3) - 1)]]
      end associate
   end function packed

   !> Read a region of a level from a list of numbers. `next` advances from its first number to the one behind
   !> its last; `good` is false if they describe no region of this grid.
   pure subroutine unpack_region(grid, numbers, next, region, good)
      type(grid_level_t), intent(in) :: grid
      integer(i8), intent(in) :: numbers(:)
      integer, intent(inout) :: next
      type(region_t), intent(out) :: region
      logical, intent(out) :: good
      integer :: low(3), high(3), behind
      good = .false.
      if (next + 6 > size(numbers)) return
      associate (a => numbers(next:next + 2), z => numbers(next + 3:next + 5), listed => numbers(next + 6))
         if (any(a < 0 .or. a >= z .or. z > grid%cells .or. modulo(a, 2_i8) /= 0 &
                 .or. modulo(z, 2_i8) /= 0)) return
         if (listed /= 0 .and. (listed /= product((z - a)/2) .or. listed > size(numbers) - next - 6)) return
         low = int(a)
         high = int(z)
         behind = next + 7 + int(listed)
      end associate
      region = region_of_box(grid, low, high)
      if (behind > next + 7) region = region_of_cells(grid, low, &
            reshape(numbers(next + 7:behind - 1) == 1_i8, (high - low)/2))
      next = behind
      good = region%cells() > 0
   end subroutine unpack_region

   !> The position of a node, m.
   pure function place_of(self, node) result(place)
      class(region_t), intent(in) :: self
      integer, intent(in) :: node(3)
      real(wp) :: place(3)
      place = merge(self%grid%upper, self%grid%lower + node*self%grid%cell, node == self%grid%cells)
   end function place_of

   !> The range of cells of the level above, along each axis, that are less than `width` away from a box.
   !> Cells on a side of the grid represent what lies beyond it.
   pure subroutine cells_near(self, low, high, width, first, last)
      class(region_t), intent(in) :: self
      real(wp), intent(in) :: low(3), high(3), width !< m
      integer, intent(out) :: first(3), last(3)
      real(wp) :: across(3)
      integer :: axis, c, most
      across = real(self%grid%cells/2, wp)
      ! up to round-off, which the loop below corrects
      first = int(min(max(0.5_wp*(low - width - self%grid%lower)*self%grid%per_cell, 0.0_wp), across))
      last = int(min(max(0.5_wp*(high + width - self%grid%lower)*self%grid%per_cell, 0.0_wp), across))
      do axis = 1, 3
         most = self%grid%cells(axis)/2 - 1
         do c = max(first(axis) - 1, 0), most - 1
            if (low(axis) < side(axis, c + 1) + width) exit
         end do
         first(axis) = c
         do c = min(last(axis) + 1, most), 1, -1
            if (high(axis) > side(axis, c) - width) exit
         end do
         last(axis) = c
      end do
   contains
      !> Position of the lower side of a cell, m.
      pure real(wp) function side(axis, c)
         integer, intent(in) :: axis, c
         side = self%grid%lower(axis) + 2*c*self%grid%cell
      end function side
   end subroutine cells_near

   !> The nearest cell of the level above that is in the grid.
   pure function in_grid(self, cell) result(nearest_cell)
      class(region_t), intent(in) :: self
      integer, intent(in) :: cell(3)
      integer :: nearest_cell(3)
      nearest_cell = min(max(cell, 0), self%grid%cells/2 - 1)
   end function in_grid

   !> True when all cells of the level above from first to last along each axis, in the grid, belong to the
   !> region.
   pure logical function all_of(self, first, last)
      class(region_t), intent(in) :: self
      integer, intent(in) :: first(3), last(3)
      all_of = count_of(self, first, last) == product(last - first + 1)
   end function all_of

   !> The number of these cells that do, where the bounding box has gaps.
   pure integer function count_of(self, first, last) result(n)
      class(region_t), intent(in) :: self
      integer, intent(in) :: first(3), last(3)
      integer :: a(3), z(3)
      a = min(max(first - self%low/2, 0), (self%high - self%low)/2)
      z = min(max(last + 1 - self%low/2, 0), (self%high - self%low)/2)
      associate (m => self%below)
         n = (m(z(1), z(2), z(3)) - m(a(1), z(2), z(3))) - (m(z(1), a(2), z(3)) - m(a(1), a(2), z(3))) &
             - (m(z(1), z(2), a(3)) - m(a(1), z(2), a(3))) + (m(z(1), a(2), a(3)) - m(a(1), a(2), a(3)))
      end associate
   end function count_of

end module m_region
