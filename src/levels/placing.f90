!> Placement of moving levels: with a tool, or where stress or strain change most from cell to cell
!> (theory.md, eqs level-follow, level-criterion).
module m_placing
   use mpi_f08
   use m_kinds, only: wp
   use m_communicator, only: communicator_t
   use m_grid_level, only: grid_level_t
   use m_region, only: region_t, make_region
   use m_region_parts, only: smallest_gap
   use m_level, only: level_t
   use m_material, only: material_t
   use m_scene_materials, only: materials_t
   use m_scene, only: criterion_stress
   implicit none
   private
   public :: judge_region, smallest_width

   integer, parameter :: smallest_width = 4 !< of a region, in cells of the coarser level
   integer, parameter :: margin = 1 !< around the cells that a criterion chooses, in cells of the coarser
                                    !< level
   integer, parameter :: classes = 48       !< of changes, in a geometric sequence
   real(wp), parameter :: factor = 0.8_wp

contains

   !> Collective: the region of the level `fine` that is the smallest box around the cells of the coarser
   !> level in which von Mises stress (or strain) changes most, as many as the budget allows. `found` is false
   !> where nothing changes, or where the budget does not allow even the smallest box.
   subroutine judge_region(communicator, levels, fine, materials, criterion, max_cells, found, region)
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(in) :: levels(:)
      integer, intent(in) :: fine                 !< number of the level to be placed
      type(materials_t), intent(in) :: materials
      integer, intent(in) :: criterion, max_cells !< maximum number of cells of the placed level
      logical, intent(out) :: found
      type(region_t), intent(out) :: region
      real(wp), allocatable :: value(:, :, :), change(:, :, :)
      integer :: first(3, classes), last(3, classes), a(3), z(3), i, j, k, r
      type(region_t) :: tried
      logical :: allowed
      real(wp) :: largest
      call cell_peaks(communicator, levels, levels(fine - 1)%grid, materials, criterion, value)
      call changes(value, change)
      largest = maxval(change)
      found = largest > 0.0_wp
      if (.not. found) return
      first = huge(1)
      last = -1
      do k = 0, size(change, 3) - 1
         do j = 0, size(change, 2) - 1
            do i = 0, size(change, 1) - 1
               if (change(i, j, k) <= largest*factor**classes) cycle
               r = min(classes, 1 + int(log(change(i, j, k)/largest)/log(factor)))
               first(:, r) = min(first(:, r), [i, j, k])
               last(:, r) = max(last(:, r), [i, j, k])
            end do
         end do
      end do
      a = huge(1)
      z = -1
      do r = 1, classes
         a = min(a, first(:, r))
         z = max(z, last(:, r))
         call box_around(levels, fine, a, z, max_cells, tried, allowed)
         if (.not. allowed) then
            if (r > 1) exit
            a = maxloc(change) - 1 ! only the first of the largest
            call box_around(levels, fine, a, a, max_cells, region, found)
            exit
         end if
         region = tried
      end do
   end subroutine judge_region

   !> The box of the placed level around cells a to z of the coarser one: with a margin and a minimum width,
   !> inside the bounding box of the coarser region. It is allowed if it is within the budget and inside that
   !> region.
   pure subroutine box_around(levels, fine, a, z, max_cells, region, allowed)
      type(level_t), intent(in) :: levels(:)
      integer, intent(in) :: fine, a(3), z(3), max_cells
      type(region_t), intent(out) :: region
      logical, intent(out) :: allowed
      integer :: low(3), high(3), above_low(3), above_high(3), axis, lowest, highest, missing
      call levels(fine - 1)%region%node_box(above_low, above_high)
      low = a - margin
      high = z + 1 + margin
      do axis = 1, 3
         associate (above => levels(fine - 1))
            lowest = 0
            highest = above%grid%cells(axis)
            if (above_low(axis) > lowest) lowest = above_low(axis) + smallest_gap
            if (above_high(axis) < highest) highest = above_high(axis) - smallest_gap
            missing = max(0, smallest_width - (high(axis) - low(axis)))
            low(axis) = low(axis) - missing/2
            high(axis) = high(axis) + missing - missing/2
            if (low(axis) < lowest) high(axis) = max(high(axis), lowest + smallest_width)
            low(axis) = max(low(axis), lowest)
            if (high(axis) > highest) low(axis) = min(low(axis), highest - smallest_width)
            high(axis) = min(high(axis), highest)
            ! leave no strip of less than two cells outside
            if (low(axis) < smallest_gap) low(axis) = merge(0, low(axis), lowest == 0)
            if (highest == above%grid%cells(axis) .and. high(axis) > highest &
                - smallest_gap) high(axis) = highest
         end associate
      end do
      if (levels(fine)%grid%section%is_flat()) then ! over the whole thickness
         low(2) = 0
         high(2) = levels(fine - 1)%grid%cells(2)
      end if
      region = make_region(levels(fine)%grid, 2*low, 2*high)
      allowed = region%cells() <= max_cells .and. &
                .not. levels(fine - 1)%region%any_outer(low - smallest_gap + 1, high + smallest_gap - 1)
   end subroutine box_around

   !> Collective: the largest value in each cell of a grid; -1 where there is no material. The same bits on
   !> any number of ranks.
   subroutine cell_peaks(communicator, levels, grid, materials, criterion, value)
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(in) :: levels(:)
      type(grid_level_t), intent(in) :: grid
      type(materials_t), intent(in) :: materials
      integer, intent(in) :: criterion
      real(wp), allocatable, intent(out) :: value(:, :, :)
      integer :: b, l, p, cell(3)
      associate (n => grid%cells)
         allocate (value(0:n(1) - 1, 0:n(2) - 1, 0:n(3) - 1), source=-1.0_wp)
      end associate
      do l = 1, size(levels)
         do b = 1, size(levels(l)%blocks)
            associate (particles => levels(l)%blocks(b)%particles, x => levels(l)%layout%position)
               do p = 1, particles%count
                  cell = min(max(int((particles%column(p, x:x + 2) - grid%lower)*grid%per_cell), 0), &
                             grid%cells - 1)
                  associate (peak => value(cell(1), cell(2), cell(3)))
                     peak = max(peak, quantity(levels(l), particles%column(p, :), criterion, &
                                               materials%slots(materials%of_body(particles%body(p)))%law))
                  end associate
               end do
            end associate
         end do
      end do
      call MPI_Allreduce(MPI_IN_PLACE, value, size(value), MPI_DOUBLE_PRECISION, MPI_MAX, communicator%comm)
   end subroutine cell_peaks

   !> Von Mises stress (Pa), or equivalent strain: the elastic one of that stress plus the plastic one.
   pure real(wp) function quantity(level, values, criterion, law)
      type(level_t), intent(in) :: level
      real(wp), intent(in) :: values(:)
      integer, intent(in) :: criterion
      class(material_t), intent(in) :: law
      real(wp) :: s(6)
      s = values(level%layout%stress:level%layout%stress + 5)
      quantity = sqrt(0.5_wp*((s(1) - s(2))**2 + (s(2) - s(3))**2 + (s(3) - s(1))**2) + 3.0_wp*sum(s(4:6)**2))
      if (criterion == criterion_stress) return
      quantity = quantity/law%von_mises_modulus() + law%equivalent_plastic_strain(values)
   end function quantity

   !> Largest difference between a cell and the six around it that contain material.
   pure subroutine changes(value, change)
      real(wp), intent(in) :: value(0:, 0:, 0:)
      real(wp), allocatable, intent(out) :: change(:, :, :)
      integer :: axis, i, j, k, n(3), next(3)
      n = shape(value)
      allocate (change(0:n(1) - 1, 0:n(2) - 1, 0:n(3) - 1), source=0.0_wp)
      do k = 0, n(3) - 1
         do j = 0, n(2) - 1
            do i = 0, n(1) - 1
               do axis = 1, 3
                  next = [i, j, k]
                  next(axis) = next(axis) + 1
                  if (next(axis) == n(axis)) cycle
                  associate (here => value(i, j, k), there => value(next(1), next(2), next(3)))
                     if (here < 0.0_wp .or. there < 0.0_wp) cycle
                     change(i, j, k) = max(change(i, j, k), abs(here - there))
                     change(next(1), next(2), next(3)) = max(change(next(1), next(2), next(3)), &
                           abs(here - there))
                  end associate
               end do
            end do
         end do
      end do
   end subroutine changes

end module m_placing
