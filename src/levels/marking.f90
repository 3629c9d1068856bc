!> Which cells levels refine that the estimated error places: where it would be largest, as many as the budget
!> allows, with what tools touch, a margin, and the distance to the edge of the level above (theory.md, eq.
!> level-error).
module m_marking
   use m_kinds, only: wp, i8
   use m_grid_level, only: grid_level_t
   use m_region, only: region_t, make_region
   use m_region_parts, only: leave_no_strip
   implicit none
   private
   public :: choose_region, needed_above

   integer, parameter :: classes = 48           !< of errors, each smaller by a factor
   real(wp), parameter :: factor = 0.8_wp
   real(wp), parameter :: kept = 1.5_wp**2      !< what is refined now stays until its error is so much lower
   real(wp), parameter :: too_many = 1.2_wp     !< a region stays until it has so many more cells than it should

contains

   !> The region of a level from the errors (J/m3) of the cells of the level above, as they would be if these were
   !> not refined, and the least that counts; `touched`, where tools are or what the next finer level needs, is
   !> always in it. `needs`: cells of the level where touched alone is over the budget, else 0. The region stays
   !> as it is where it has all that is wanted and not many more.
   pure subroutine choose_region(grid, error, least, touched, may, max_cells, region, needs)
      type(grid_level_t), intent(in) :: grid            !< the level's
      real(wp), intent(in) :: error(0:, 0:, 0:), least
      logical, intent(in) :: touched(0:, 0:, 0:)        !< with their margin
      logical, intent(in) :: may(0:, 0:, 0:)            !< far enough from the edge of the level above
      integer, intent(in) :: max_cells
      type(region_t), intent(inout) :: region           !< on entry as it is
      integer(i8), intent(out) :: needs
      logical, allocatable :: chosen(:, :, :), tried(:, :, :)
      real(wp), allocatable :: weighed(:, :, :)
      real(wp) :: largest
      integer :: i, j, k, low, high, middle, most(3)
      weighed = error
      do k = 0, size(error, 3) - 1
         do j = 0, size(error, 2) - 1
            do i = 0, size(error, 1) - 1
               if (region%has_all([i, j, k], [i, j, k])) weighed(i, j, k) = kept*error(i, j, k)
            end do
         end do
      end do
      where (.not. may) weighed = 0.0_wp
      needs = 0
      chosen = closed(grid, touched)
      if (8_i8*count(chosen, kind=i8) > max_cells) then
         needs = 8_i8*count(chosen, kind=i8)
         return
      end if
      largest = maxval(weighed)
      low = 0
      high = 0
      if (largest > least) high = min(classes, ceiling(log(least/largest)/log(factor)))
      do while (low < high) ! the lowest class that the budget allows
         middle = (low + high + 1)/2
         tried = closed(grid, touched .or. spread_out(weighed >= max(least, largest*factor**middle)) .and. may)
         if (8_i8*count(tried, kind=i8) <= max_cells) then
            low = middle
            chosen = tried
         else
            high = middle - 1
         end if
      end do
      if (.not. any(chosen)) then ! as few as may be
         most = maxloc(weighed)
         allocate (tried(size(error, 1), size(error, 2), size(error, 3)), source=.false.)
         if (largest > 0.0_wp) tried(most(1), most(2), most(3)) = .true.
         chosen = closed(grid, spread_out(tried) .and. may)
         if (.not. any(chosen)) return
      end if
      if (stays(region, chosen)) return
      region = make_region(grid, [0, 0, 0], chosen)
   end subroutine choose_region

   !> Some cells and those around them.
   pure function spread_out(cells) result(more)
      logical, intent(in) :: cells(:, :, :)
      logical :: more(size(cells, 1), size(cells, 2), size(cells, 3))
      integer :: n
      more = cells
      n = size(cells, 1)
      more(:n - 1, :, :) = more(:n - 1, :, :) .or. cells(2:, :, :)
      more(2:, :, :) = more(2:, :, :) .or. cells(:n - 1, :, :)
      call along_y(more)
      call along_z(more)
   contains
      pure subroutine along_y(cells)
         logical, intent(inout) :: cells(:, :, :)
         logical :: before(size(cells, 1), size(cells, 2), size(cells, 3))
         integer :: n
         before = cells
         n = size(cells, 2)
         cells(:, :n - 1, :) = cells(:, :n - 1, :) .or. before(:, 2:, :)
         cells(:, 2:, :) = cells(:, 2:, :) .or. before(:, :n - 1, :)
      end subroutine along_y
      pure subroutine along_z(cells)
         logical, intent(inout) :: cells(:, :, :)
         logical :: before(size(cells, 1), size(cells, 2), size(cells, 3))
         integer :: n
         before = cells
         n = size(cells, 3)
         cells(:, :, :n - 1) = cells(:, :, :n - 1) .or. before(:, :, 2:)
         cells(:, :, 2:) = cells(:, :, 2:) .or. before(:, :, :n - 1)
      end subroutine along_z
   end function spread_out

   !> With no strip of one cell at a side of the grid.
   pure function closed(grid, cells) result(filled)
      type(grid_level_t), intent(in) :: grid
      logical, intent(in) :: cells(:, :, :)
      logical, allocatable :: filled(:, :, :)
      filled = cells
      call leave_no_strip(grid, [0, 0, 0], filled)
   end function closed

   !> True when a region has all chosen cells and not too many others.
   pure logical function stays(region, chosen)
      type(region_t), intent(in) :: region
      logical, intent(in) :: chosen(0:, 0:, 0:)
      integer :: i, j, k
      stays = region%cells() <= too_many*8.0_wp*count(chosen, kind=i8)
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

   !> The cells two levels above that a region needs refined around it, to keep its distance from their edge.
   pure function needed_above(region, cells) result(needed)
      type(region_t), intent(in) :: region
      integer, intent(in) :: cells(3) !< of that grid
      logical, allocatable :: needed(:, :, :)
      integer :: low(3), high(3), a(3), z(3), i, j, k
      allocate (needed(0:cells(1) - 1, 0:cells(2) - 1, 0:cells(3) - 1), source=.false.)
      call region%node_box(low, high)
      do k = low(3)/2, high(3)/2 - 1
         do j = low(2)/2, high(2)/2 - 1
            do i = low(1)/2, high(1)/2 - 1
               if (.not. region%has_all([i, j, k], [i, j, k])) cycle
               a = max([i, j, k] - 2, 0)/2
               z = min(([i, j, k] + 2)/2, cells - 1)
               needed(a(1):z(1), a(2):z(2), a(3):z(3)) = .true.
            end do
         end do
      end do
   end function needed_above

end module m_marking
