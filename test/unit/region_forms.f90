!> Regions of any form against plain loops over the cells of the level above.
!test: helper
module m_region_forms
   use m_kinds, only: wp, i8
   use m_scene, only: grid_spec_t
   use m_grid_level, only: grid_level_t, make_grid_level
   use m_region, only: region_t, make_region, unpack_region
   use m_assertions, only: assertions_t
   use m_chance, only: chance_t
   implicit none
   private
   public :: check_forms, check_outlines

   real(wp), parameter :: cell = 0.1_wp

contains

   subroutine check_forms(test, chance)
      type(assertions_t), intent(inout) :: test
      type(chance_t), intent(inout) :: chance
      call any_form(test, chance, 'two boxes', 12)
      call any_form(test, chance, 'ball', 12)
      call any_form(test, chance, 'anything', 4)
   end subroutine check_forms

   integer function dice(chance, low, high)
      type(chance_t), intent(inout) :: chance
      integer, intent(in) :: low, high
      dice = min(high, low + int(chance%between(0.0_wp, real(high - low + 1, wp))))
   end function dice

   !> Regions of any form, in the grid and at its sides: every answer against plain loops over the cells of
   !> the level above, those at the sides of the grid without end. Half of the places lie on planes between
   !> cells.
   subroutine any_form(test, chance, form, regions)
      type(assertions_t), intent(inout) :: test
      type(chance_t), intent(inout) :: chance
      character(len=*), intent(in) :: form
      integer, intent(in) :: regions !< to be tried
      integer, parameter :: n = 12
      logical :: chosen(0:n - 1, 0:n - 1, 0:n - 1)
      type(grid_level_t) :: grid
      type(region_t) :: region, again
      real(wp) :: x(3), a(3), z(3), width
      integer :: trial, r, node(3), last(3), in_reach, out_of_reach
      integer(i8), allocatable :: numbers(:)
      logical :: good
      grid = make_grid_level(grid_spec_t(lower=[-0.3_wp, 0.2_wp, 0.0_wp], upper=[-0.3_wp, 0.2_wp, 0.0_wp] &
                                         + n*cell, &
                                         cell_size=cell, cells=[n, n, n]), 2)
      do r = 1, regions
         call choose(chance, form, chosen)
         region = make_region(grid, [0, 0, 0], chosen)
         call test%check(int(region%cells()) == 8*count(chosen), form//': cells')
         do trial = 1, 150
            node = [dice(chance, -1, 2*n), dice(chance, -1, 2*n), dice(chance, -1, 2*n)]
            last = node + dice(chance, 0, 3)*[1, 1, 0] + dice(chance, 0, 9)*[0, 0, 1]
            call test%check(region%is_inner(node) .eqv. all_inner(node, node), form//': inner nodes')
            call test%check(region%any_outer(node, last) .neqv. all_inner(node, last), form// &
                            ': nodes some of which are outer')
            x = [a_place(1), a_place(2), a_place(3)]
            call look(x, x, -1.0_wp, in_reach, out_of_reach)
            call test%check(region%holds(x) .eqv. out_of_reach == 0, form//': places inside')
            a = [a_place(1), a_place(2), a_place(3)]
            z = max(a, x)
            a = min(a, x)
            if (modulo(trial, 3) == 0) z = a
            call look(a, z, 0.25_wp*grid%cell, in_reach, out_of_reach)
            call test%check(region%overlaps(a, z) .eqv. in_reach > 0, form//': boxes that reach in')
            width = chance%between(0.01_wp, 0.2_wp)
            if (modulo(trial, 2) == 0) width = dice(chance, 1, 3)*grid%cell
            call look(a, z, width, in_reach, out_of_reach)
            call test%check(region%holds_box(a, z, width) .eqv. out_of_reach == 0, form//': boxes inside')
            call test%check(region%clear_of_edge(a, z, width) .eqv. (in_reach == 0 .or. out_of_reach == 0), &
                            form//': boxes clear of the edge')
         end do
         trial = 2
         call unpack_region(grid, [0_i8, region%packed(), 7_i8], trial, again, good)
         call test%check(good .and. trial == size(region%packed()) + 2 .and. region%same_as(again), form// &
                         ': packed and unpacked')
         numbers = region%packed()
         numbers(7) = numbers(7) - 1
         trial = 1
         call unpack_region(grid, numbers, trial, again, good)
         call test%check(.not. good, form//': what is no region is not unpacked')
         call shift_it()
      end do
   contains
      !> A place along an axis, near the grid.
      real(wp) function a_place(axis)
         integer, intent(in) :: axis
         a_place = chance%between(grid%lower(axis) - 0.1_wp, grid%upper(axis) + 0.1_wp)
         if (dice(chance, 0, 1) == 1) a_place = grid%lower(axis) + 2*dice(chance, 0, n)*grid%cell
      end function a_place

      !> How many cells of the region, and others, are less than a width away from a box; or touch it where
      !> that is -1.
      subroutine look(a, z, width, in_reach, out_of_reach)
         real(wp), intent(in) :: a(3), z(3), width
         integer, intent(out) :: in_reach, out_of_reach
         real(wp) :: low(3), high(3)
         integer :: i, j, k
         in_reach = 0
         out_of_reach = 0
         do k = 0, n - 1
            do j = 0, n - 1
               do i = 0, n - 1
                  low = grid%lower + 2*[i, j, k]*grid%cell
                  high = grid%lower + 2*([i, j, k] + 1)*grid%cell
                  where ([i, j, k] == 0) low = -1.0e9_wp
                  where ([i, j, k] == n - 1) high = 1.0e9_wp
                  if (width < 0.0_wp) then
                     if (any(z < low .or. a > high)) cycle
                  else
                     if (.not. all(z > low - width .and. a < high + width)) cycle
                  end if
                  if (chosen(i, j, k)) in_reach = in_reach + 1
                  if (.not. chosen(i, j, k)) out_of_reach = out_of_reach + 1
               end do
            end do
         end do
      end subroutine look

      !> True when all cells that touch one of the nodes belong to the region.
      logical function all_inner(first, last)
         integer, intent(in) :: first(3), last(3)
         integer :: c(3), i, j, k, x, y, z
         all_inner = .true.
         do k = first(3), last(3)
            do j = first(2), last(2)
               do i = first(1), last(1)
                  do z = -1, 0
                     do y = -1, 0
                        do x = -1, 0 ! cells of the level itself
                           c = min(max(([i, j, k] + [x, y, z])/2, 0), n - 1)
                           all_inner = all_inner .and. chosen(c(1), c(2), c(3))
                        end do
                     end do
                  end do
               end do
            end do
         end do
      end function all_inner

      !> The region somewhere else, against its cells moved, those at the sides of the grid standing for what
      !> is beyond.
      subroutine shift_it()
         logical :: moved(0:n - 1, 0:n - 1, 0:n - 1)
         integer :: shift(3), c(3), i, j, k
         shift = [dice(chance, -3, 3), dice(chance, -3, 3), dice(chance, -3, 3)]
         do k = 0, n - 1
            do j = 0, n - 1
               do i = 0, n - 1
                  c = min(max([i, j, k] - shift, 0), n - 1)
                  moved(i, j, k) = chosen(c(1), c(2), c(3))
               end do
            end do
         end do
         again = region%shifted(2*shift)
         if (any(moved)) call test%check(again%same_as(make_region(grid, [0, 0, 0], moved)), form//': moved')
         call test%check(int(again%cells()) == 8*count(moved), form//': cells when it has moved')
      end subroutine shift_it
   end subroutine any_form

   !> Cells of a form, somewhere among others.
   subroutine choose(chance, form, chosen)
      type(chance_t), intent(inout) :: chance
      character(len=*), intent(in) :: form
      logical, intent(out) :: chosen(0:, 0:, 0:)
      real(wp) :: middle(3), radius
      integer :: i, j, k, n, a(3), z(3)
      n = size(chosen, 1)
      chosen = .false.
      middle = chance%several(3, 0.0_wp, real(n, wp))
      radius = chance%between(1.5_wp, 5.0_wp)
      do k = 0, n - 1
         do j = 0, n - 1
            do i = 0, n - 1
               if (form == 'ball') chosen(i, j, k) = norm2([i, j, k] + 0.5_wp - middle) < radius
               if (form == 'anything') chosen(i, j, k) = chance%between(0.0_wp, 1.0_wp) < 0.8_wp
            end do
         end do
      end do
      if (form == 'two boxes') then ! with one corner
         a = [dice(chance, 0, 6), dice(chance, 0, 6), dice(chance, 0, 6)]
         z = min(n - 1, a + [dice(chance, 2, 6), dice(chance, 1, 3), dice(chance, 1, 6)])
         chosen(a(1):z(1), a(2):z(2), a(3):z(3)) = .true.
         z = min(n - 1, a + [dice(chance, 1, 3), dice(chance, 2, 6), dice(chance, 1, 6)])
         chosen(a(1):z(1), a(2):z(2), a(3):z(3)) = .true.
      end if
      chosen(n/2, n/2, n/2) = .true.
   end subroutine choose

   !> The lines that the surface of a region is bent along: how many, and how long they are together.
   subroutine check_outlines(test)
      type(assertions_t), intent(inout) :: test
      logical :: chosen(4, 4, 4)
      type(grid_level_t) :: grid
      type(region_t) :: region
      real(wp), allocatable :: ends(:, :, :)
      real(wp) :: lower(3), upper(3)
      grid = make_grid_level(grid_spec_t(upper=cell*[8, 8, 8], cell_size=cell, cells=[8, 8, 8]), 2)
      chosen = .true.
      call see(12, 12*4, 'a box')
      chosen(3:, 3:, :) = .false.
      call see(18, 2*(4*4) + 6*4, 'an L')
      chosen(:, :, 3:) = .false.
      chosen(3:, 3:, 3:) = .true.
      chosen(:2, :2, :) = .true.
      call see(27, 78, 'a block of blocks, two of which meet at an edge')
      region = make_region(grid, [2, 0, 4], chosen)
      call region%bounding_box(lower, upper)
      ends = region%outline()
      call test%check_close(lower, [minval(ends(1, :, :)), minval(ends(2, :, :)), minval(ends(3, :, :))], &
                            0.0_wp, 'outline: lower')
      call test%check_close(upper, [maxval(ends(1, :, :)), maxval(ends(2, :, :)), maxval(ends(3, :, :))], &
                            0.0_wp, 'outline: upper')
   contains
      subroutine see(lines, length, name)
         integer, intent(in) :: lines, length !< in cells of the level above
         character(len=*), intent(in) :: name
         region = make_region(grid, [2, 0, 4], chosen)
         ends = region%outline()
         call test%check_equal(size(ends, 3), lines, 'outline of '//name//': lines')
         call test%check_close(sum(norm2(ends(:, 2, :) - ends(:, 1, :), dim=1)), length*cell, 1.0e-12_wp, &
                               'outline of '//name//': length')
      end subroutine see
   end subroutine check_outlines

end module m_region_forms
