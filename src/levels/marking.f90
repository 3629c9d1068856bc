!> Choice of the cells to refine by the estimated error of the stress: those with the largest error, within
!> the budget, with the contact zone, a margin, and the distance to the edge of the level above (theory.md,
!> eq. level-error).
module m_marking
   use m_kinds, only: wp, i8
   use m_grid_level, only: grid_level_t
   use m_region, only: region_t, make_region
   use m_region_parts, only: leave_no_strip
   implicit none
   private
   public :: marks_t, choose_regions, closed, needed_above, touch

   integer, parameter :: classes = 48           !< of errors, in a geometric sequence
   real(wp), parameter :: factor = 0.8_wp
   real(wp), parameter :: kept = 1.5_wp**2      !< a refined cell stays refined until its error is lower by
                                                !< this factor
   real(wp), parameter :: too_many = 1.2_wp     !< a region stays until it has this ratio of cells to those
                                                !< needed

   !> Data of the cells of the level above that a level may refine: the largest error (J/m3) of the stress if
   !> they were not refined, whether they are near contact, with a margin, and whether they are far enough
   !> from the edge of that level.
   type :: marks_t
      real(wp), allocatable :: error(:, :, :)
      logical, allocatable :: touched(:, :, :)
      logical, allocatable :: may(:, :, :)
      real(wp) :: least = 0.0_wp !< smaller errors are ignored, J/m3
      integer(i8) :: budget = 0  !< cells of the level and of all finer ones together
   end type marks_t

   type :: cells_t
      logical, allocatable :: of(:, :, :)
   end type cells_t

contains

   !> Set the regions of the levels placed by the error, the coarsest first: the cells of all levels whose
   !> error is above one bound, the lowest that the budgets allow. The contact zone, and the cells needed
   !> around the next finer level, are always included. `short`: the level whose budget they alone exceed, and
   !> `needs`: their number; else 0. `bound`: the budgets exclude cells with a relevant error. A region is
   !> kept where it has all cells needed and not many more.
   pure subroutine choose_regions(grids, marks, regions, short, needs, bound)
      type(grid_level_t), intent(in) :: grids(:)        !< of the levels
      type(marks_t), intent(in) :: marks(:)
      type(region_t), intent(inout) :: regions(:)       !< on entry the present ones
      integer, intent(out) :: short
      integer(i8), intent(out) :: needs
      logical, intent(out) :: bound
      type(marks_t) :: weighed(size(marks))
      type(cells_t) :: chosen(size(marks)), tried(size(marks))
      type(region_t) :: as_they_are(size(regions))
      real(wp) :: largest
      integer :: low, high, lowest, middle, l
      logical :: stay
      bound = .false.
      call weigh(marks, regions, weighed)
      call choose(grids, weighed, huge(1.0_wp), chosen)
      call find_short(grids, chosen, marks%budget, short, needs)
      if (short > 0) return
      largest = maxval([(maxval(weighed(l)%error), l=1, size(marks))])
      lowest = 0
      if (largest > minval(marks%least)) &
         lowest = min(classes, ceiling(log(minval(marks%least)/largest)/log(factor)))
      low = -1
      high = lowest
      do while (low < high) ! find the lowest class that the budgets allow
         middle = (low + high + 1)/2
         call choose(grids, weighed, largest*factor**middle, tried)
         if (within(grids, tried, marks%budget)) then
            low = middle
            chosen = tried
         else
            high = middle - 1
         end if
      end do
      bound = low < lowest
      as_they_are = regions
      do l = 1, 2
         stay = l == 1
         regions = as_they_are
         call set_regions(grids, weighed, chosen, stay, regions)
         if (sum_within(regions, marks%budget)) return
      end do
   end subroutine choose_regions

   !> Weight errors up in present regions, and set them to 0 where no region is allowed.
   pure subroutine weigh(marks, regions, weighed)
      type(marks_t), intent(in) :: marks(:)
      type(region_t), intent(in) :: regions(:)
      type(marks_t), intent(out) :: weighed(:)
      integer :: i, j, k, l
      weighed = marks
      do l = 1, size(marks)
         associate (error => weighed(l)%error)
            do k = 0, ubound(error, 3)
               do j = 0, ubound(error, 2)
                  do i = 0, ubound(error, 1)
                     if (regions(l)%has_all([i, j, k], [i, j, k])) error(i, j, k) = kept*error(i, j, k)
                  end do
               end do
            end do
            where (.not. marks(l)%may) error = 0.0_wp
         end associate
      end do
   end subroutine weigh

   !> Choose the cells to refine for a bound of the errors; the finest level first, each coarser one with the
   !> cells needed around it.
   pure subroutine choose(grids, marks, least, chosen)
      type(grid_level_t), intent(in) :: grids(:)
      type(marks_t), intent(in) :: marks(:)
      real(wp), intent(in) :: least
      type(cells_t), intent(inout) :: chosen(:)
      integer :: l
      do l = size(marks), 1, -1
         associate (it => marks(l))
            chosen(l)%of = it%touched
            if (any(it%error >= max(least, it%least) .and. it%error > 0.0_wp)) then
               where (spread_out(it%error >= max(least, it%least) .and. it%error > 0.0_wp) .and. it%may) &
                  chosen(l)%of = .true.
            end if
            if (l < size(marks)) then
               where (above_cells(chosen(l + 1)%of, shape(it%touched))) chosen(l)%of = .true.
            end if
            chosen(l)%of = closed(grids(l), chosen(l)%of)
         end associate
      end do
   end subroutine choose

   !> Find the finest level whose budget is exceeded, and the number of cells of it and the finer ones; 0:
   !> none.
   pure subroutine find_short(grids, chosen, budget, short, needs)
      type(grid_level_t), intent(in) :: grids(:)
      type(cells_t), intent(in) :: chosen(:)
      integer(i8), intent(in) :: budget(:)
      integer, intent(out) :: short
      integer(i8), intent(out) :: needs
      needs = 0
      do short = size(chosen), 1, -1
         needs = needs + cells_in(grids(short), chosen(short)%of)
         if (needs > budget(short)) return
      end do
      needs = 0
   end subroutine find_short

   !> Number of a level's cells in some cells of the level above; for a section those of its plane.
   pure integer(i8) function cells_in(grid, chosen)
      type(grid_level_t), intent(in) :: grid
      logical, intent(in) :: chosen(:, :, :)
      cells_in = 8_i8*count(chosen, kind=i8)
      if (grid%section%is_flat()) cells_in = cells_in/grid%cells(2)
   end function cells_in

   !> True when the cells fit all budgets.
   pure logical function within(grids, chosen, budget)
      type(grid_level_t), intent(in) :: grids(:)
      type(cells_t), intent(in) :: chosen(:)
      integer(i8), intent(in) :: budget(:)
      integer(i8) :: needs
      integer :: short
      call find_short(grids, chosen, budget, short, needs)
      within = short == 0
   end function within

   !> The same for regions.
   pure logical function sum_within(regions, budget)
      type(region_t), intent(in) :: regions(:)
      integer(i8), intent(in) :: budget(:)
      integer(i8) :: all
      integer :: l
      all = 0
      sum_within = .true.
      do l = size(regions), 1, -1
         all = all + regions(l)%cells()
         sum_within = sum_within .and. all <= budget(l)
      end do
   end function sum_within

   !> Set the regions from the chosen cells, or keep present ones that are good enough. If no cell was chosen:
   !> the cell with the largest error, and those around it.
   pure subroutine set_regions(grids, marks, chosen, stay, regions)
      type(grid_level_t), intent(in) :: grids(:)
      type(marks_t), intent(in) :: marks(:)
      type(cells_t), intent(in) :: chosen(:)
      logical, intent(in) :: stay
      type(region_t), intent(inout) :: regions(:)
      logical, allocatable :: cells(:, :, :)
      integer :: l
      do l = size(regions), 1, -1
         cells = chosen(l)%of
         if (l < size(regions)) then
            where (needed_above(regions(l + 1), shape(cells))) cells = .true.
            cells = closed(grids(l), cells)
         end if
         if (.not. any(cells)) then
            if (.not. any(marks(l)%error > 0.0_wp)) cycle
            cells = closed(grids(l), spread_out(only(maxloc(marks(l)%error), shape(cells))) .and. &
                           marks(l)%may)
         end if
         if (stay) then
            if (stays(regions(l), grids(l), cells)) cycle
         end if
         regions(l) = make_region(grids(l), [0, 0, 0], cells)
      end do
   end subroutine set_regions

   !> A single cell.
   pure function only(cell, cells)
      integer, intent(in) :: cell(3), cells(3)
      logical :: only(cells(1), cells(2), cells(3))
      only = .false.
      only(cell(1), cell(2), cell(3)) = .true.
   end function only

   !> Some cells and those around them.
   pure function spread_out(cells) result(more)
      logical, intent(in) :: cells(:, :, :)
      logical, dimension(size(cells, 1), size(cells, 2), size(cells, 3)) :: more, before
      integer :: axis
      more = cells
      do axis = 1, 3
         before = more
         where (eoshift(before, 1, dim=axis)) more = .true.
         where (eoshift(before, -1, dim=axis)) more = .true.
      end do
   end function spread_out

   !> Fill strips of one cell at a side of the grid; for a section over its whole thickness.
   pure function closed(grid, cells) result(filled)
      type(grid_level_t), intent(in) :: grid
      logical, intent(in) :: cells(:, :, :)
      logical, allocatable :: filled(:, :, :)
      filled = cells
      if (grid%section%is_flat()) filled = spread(any(cells, 2), 2, size(cells, 2))
      call leave_no_strip(grid, [0, 0, 0], filled)
   end function closed

   !> True when a region has all chosen cells and not too many others.
   pure logical function stays(region, grid, chosen)
      type(region_t), intent(in) :: region
      type(grid_level_t), intent(in) :: grid !< of its level
      logical, intent(in) :: chosen(0:, 0:, 0:)
      integer :: i, j, k
      stays = region%cells() <= too_many*cells_in(grid, chosen)
      if (.not. stays) return
      do k = 0, size(chosen, 3) - 1
         do j = 0, size(chosen, 2) - 1
            do i = 0, size(chosen, 1) - 1
               if (.not. chosen(i, j, k)) cycle
               stays = region%has_all([i, j, k], [i, j, k])
               if (.not. stays) return
            end do
         end do
      end do
   end function stays

   !> The cells two levels above that must be refined around a region, to keep its distance from their edge.
   pure function needed_above(region, cells) result(needed)
      type(region_t), intent(in) :: region
      integer, intent(in) :: cells(3) !< of that grid
      logical, allocatable :: needed(:, :, :), own(:, :, :)
      integer :: low(3), high(3), i, j, k
      allocate (own(0:2*cells(1) - 1, 0:2*cells(2) - 1, 0:2*cells(3) - 1), source=.false.)
      call region%node_box(low, high)
      do k = low(3)/2, high(3)/2 - 1
         do j = low(2)/2, high(2)/2 - 1
            do i = low(1)/2, high(1)/2 - 1
               own(i, j, k) = region%has_all([i, j, k], [i, j, k])
            end do
         end do
      end do
      needed = above_cells(own, cells)
   end function needed_above

   !> The same for cells of the level above.
   pure function above_cells(own, cells) result(needed)
      logical, intent(in) :: own(0:, 0:, 0:)
      integer, intent(in) :: cells(3)
      logical, allocatable :: needed(:, :, :)
      integer :: a(3), z(3), i, j, k
      allocate (needed(0:cells(1) - 1, 0:cells(2) - 1, 0:cells(3) - 1), source=.false.)
      do k = 0, ubound(own, 3)
         do j = 0, ubound(own, 2)
            do i = 0, ubound(own, 1)
               if (.not. own(i, j, k)) cycle
               a = max([i, j, k] - 2, 0)/2
               z = min(([i, j, k] + 2)/2, cells - 1)
               needed(a(1):z(1), a(2):z(2), a(3):z(3)) = .true.
            end do
         end do
      end do
   end function above_cells

   !> Mark the cells of a grid that a box intersects, and those around them.
   pure subroutine touch(grid, low, high, touched)
      type(grid_level_t), intent(in) :: grid
      real(wp), intent(in) :: low(3), high(3) !< m
      logical, intent(inout) :: touched(0:, 0:, 0:)
      integer :: a(3), z(3)
      call grid%cells_of_box(low, high, a, z)
      a = max(a - 1, 0)
      z = min(z + 1, grid%cells - 1)
      touched(a(1):z(1), a(2):z(2), a(3):z(3)) = .true.
   end subroutine touch

end module m_marking
