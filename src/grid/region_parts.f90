!> Regions made of parts: the union of regions of one level, balls of cells; and the check that a region keeps
!> its distance from the edge of another (theory.md, Levels).
module m_region_parts
   use m_kinds, only: wp
   use m_grid_level, only: grid_level_t
   use m_region, only: region_t, make_region
   implicit none
   private
   public :: unite, make_ball, first_too_near, leave_no_strip

   integer, parameter, public :: smallest_gap = 2 !< between an edge and that of the coarser level, in the
                                                  !< coarser level's cells

contains

   !> The union of some regions of one level.
   pure type(region_t) function unite(grid, parts) result(region)
      type(grid_level_t), intent(in) :: grid !< the level's
      type(region_t), intent(in) :: parts(:) !< at least one
      logical, allocatable :: chosen(:, :, :)
      integer :: low(3), high(3), a(3), z(3), cell(3), i, j, k, n
      region = parts(1)
      if (size(parts) == 1) return
      low = huge(1)
      high = 0
      do n = 1, size(parts)
         call parts(n)%node_box(a, z)
         low = min(low, a/2)
         high = max(high, z/2)
      end do
      allocate (chosen(high(1) - low(1), high(2) - low(2), high(3) - low(3)), source=.false.)
      do n = 1, size(parts)
         call parts(n)%node_box(a, z)
         do k = a(3)/2, z(3)/2 - 1
            do j = a(2)/2, z(2)/2 - 1
               do i = a(1)/2, z(1)/2 - 1
                  cell = [i, j, k]
                  if (parts(n)%has_all(cell, cell)) &
                     chosen(i - low(1) + 1, j - low(2) + 1, k - low(3) + 1) = .true.
               end do
            end do
         end do
      end do
      call leave_no_strip(grid, low, chosen)
      region = make_region(grid, 2*low, chosen)
   end function unite

   !> The cells of the level above that intersect a ball and, for a shell, are not all inside the inner ball;
   !> for a section over its whole thickness.
   pure type(region_t) function make_ball(grid, center, radius, inner_radius) result(region)
      type(grid_level_t), intent(in) :: grid !< the level's
      real(wp), intent(in) :: center(3)      !< in the grid, m
      real(wp), intent(in) :: radius, inner_radius !< m
      logical, allocatable :: chosen(:, :, :)
      real(wp) :: middle(3), cell, half(3)
      integer :: low(3), high(3), i, j, k
      half = 0.5_wp
      cell = 2.0_wp*grid%cell
      middle = (center - grid%lower)/cell
      low = floor(max(middle - radius/cell, 0.0_wp))
      high = ceiling(min(middle + radius/cell, real(grid%cells/2, wp)))
      ! so that cells next to a side of the grid can be filled
      where (low == 1) low = 0
      where (high == grid%cells/2 - 1) high = grid%cells/2
      if (grid%section%is_flat()) then
         low(2) = 0
         high(2) = grid%cells(2)/2
         half(2) = 0.0_wp
      end if
      allocate (chosen(high(1) - low(1), high(2) - low(2), high(3) - low(3)))
      do k = 1, size(chosen, 3)
         do j = 1, size(chosen, 2)
            do i = 1, size(chosen, 1)
               associate (off => merge(low + [i, j, k] - 0.5_wp - middle, 0.0_wp, half > 0.0_wp))
                  chosen(i, j, k) = norm2(max(abs(off) - half, 0.0_wp)) < radius/cell .and. &
                                    norm2(abs(off) + half) > inner_radius/cell
               end associate
            end do
         end do
      end do
      call leave_no_strip(grid, low, chosen)
      region = make_region(grid, 2*low, chosen)
   end function make_ball

   !> Choose also a single cell between chosen ones and a side of the grid.
   pure subroutine leave_no_strip(grid, low, chosen)
      type(grid_level_t), intent(in) :: grid
      integer, intent(in) :: low(3) !< of the first of the cells
      logical, intent(inout) :: chosen(:, :, :)
      integer :: n(3)
      n = shape(chosen)
      if (low(1) == 0 .and. n(1) > 1) call join(chosen(1, :, :), chosen(2, :, :))
      if (low(2) == 0 .and. n(2) > 1) call join(chosen(:, 1, :), chosen(:, 2, :))
      if (low(3) == 0 .and. n(3) > 1) call join(chosen(:, :, 1), chosen(:, :, 2))
      associate (last => grid%cells/2 - low)
         if (n(1) == last(1) .and. n(1) > 1) call join(chosen(n(1), :, :), chosen(n(1) - 1, :, :))
         if (n(2) == last(2) .and. n(2) > 1) call join(chosen(:, n(2), :), chosen(:, n(2) - 1, :))
         if (n(3) == last(3) .and. n(3) > 1) call join(chosen(:, :, n(3)), chosen(:, :, n(3) - 1))
      end associate
   contains
      pure subroutine join(cells, inner)
         logical, intent(inout) :: cells(:, :)
         logical, intent(in) :: inner(:, :)
         where (inner) cells = .true.
      end subroutine join
   end subroutine leave_no_strip

   !> The first cell of the level above (from 0) in a region that is too near the edge of that level's region;
   !> -1 if there is none.
   pure function first_too_near(above, region) result(cell)
      type(region_t), intent(in) :: above, region
      integer :: cell(3), low(3), high(3), i, j, k
      call region%node_box(low, high)
      do k = low(3)/2, high(3)/2 - 1
         do j = low(2)/2, high(2)/2 - 1
            do i = low(1)/2, high(1)/2 - 1
               cell = [i, j, k]
               if (.not. region%has_all(cell, cell)) cycle
               if (above%any_outer(cell - smallest_gap + 1, cell + smallest_gap)) return
            end do
         end do
      end do
      cell = -1
   end function first_too_near

end module m_region_parts
