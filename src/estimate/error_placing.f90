!> Placement of levels by the estimated error of the stress and by contact (theory.md, eq. level-error).
module m_error_placing
   use mpi_f08
   use m_kinds, only: wp, i8
   use m_constants, only: exit_numerical
   use m_errors, only: error_t, fail
   use m_text, only: to_text
   use m_scene, only: criterion_error
   use m_model, only: model_t
   use m_region, only: region_t
   use m_half_edges, only: extents, longest_half_edge
   use m_marking, only: marks_t, choose_regions, touch
   use m_first_touch, only: reach, near_tool, mark_neighbours
   use m_recovered_stress, only: block_stress_t, level_stress_t, recover_stress
   implicit none
   private
   public :: place_by_error, is_due

   integer, parameter :: between(4) = [50, 25, 5, 1] !< steps of the coarsest level between two updates: each
                                                     !< divides the one before, so that a shorter interval is
                                                     !< used as soon as it is needed
   real(wp), parameter :: furthest = 0.5_wp  !< travel allowed between two updates, in the smallest refined
                                             !< cells

contains

   !> True when an update is due: this depends on the state alone, so that a continued run updates at the same
   !> times.
   pure logical function is_due(model)
      type(model_t), intent(in) :: model
      real(wp) :: way, ahead
      integer :: every, t
      is_due = any(model%level_specs%criterion == criterion_error)
      if (.not. is_due) return
      way = 0.0_wp ! of a tool, per step
      ahead = model%time + between(1)*model%last_step
      do t = 1, size(model%contact%tools)
         associate (tool => model%contact%tools(t))
            way = max(way, model%last_step*max(tool%surface_speed(), tool%fastest(model%time, ahead)))
         end associate
      end do
      if (size(model%contact%tools) > 0) way = way + model%last_step*model%bounds%particle_speed
      if (model%levels(1)%grid%fields > 1) way = max(way, 2.0_wp*model%last_step*model%bounds%particle_speed)
      associate (cell => model%levels(size(model%levels) - 1)%grid%cell)
         every = between(min(size(between), 1 + count(way*between > furthest*cell)))
      end associate
      is_due = mod(model%step, int(every, i8)) == 0
   end function is_due

   !> Collective: set the regions of all levels placed by the error. The same on any number of ranks: only
   !> maxima and minima are reduced over ranks.
   subroutine place_by_error(model, regions, error)
      type(model_t), intent(inout) :: model
      type(region_t), intent(inout) :: regions(:) !< of all levels
      type(error_t), intent(inout) :: error
      type(level_stress_t), allocatable :: recovered(:)
      type(marks_t), allocatable :: marks(:)
      real(wp) :: largest
      integer(i8) :: needs
      integer :: first, l, part, short
      logical :: bound
      first = 1 + minval(model%level_specs%of, mask=model%level_specs%criterion == criterion_error)
      allocate (marks(first:size(regions)))
      do l = first, size(regions)
         associate (n => model%levels(l - 1)%grid%cells)
            allocate (marks(l)%error(0:n(1) - 1, 0:n(2) - 1, 0:n(3) - 1), source=0.0_wp)
            allocate (marks(l)%touched(0:n(1) - 1, 0:n(2) - 1, 0:n(3) - 1), source=.false.)
         end associate
      end do
      largest = 0.0_wp
      call recover_stress(model, recovered)
      do l = 1, size(regions)
         call mark(model, l, recovered(l)%blocks, first, marks, largest)
      end do
      call MPI_Allreduce(MPI_IN_PLACE, largest, 1, MPI_DOUBLE_PRECISION, MPI_MAX, model%communicator%comm)
      do l = first, size(regions)
         if (model%levels(l)%grid%fields > 1) call mark_groups(model, l, marks(l)%touched)
         call share(model, marks(l))
         call set_free(model, l, first, marks(l))
         part = findloc(model%level_specs%of, l - 1, dim=1)
         marks(l)%least = model%level_specs(part)%tolerance**2*largest
         marks(l)%budget = model%level_specs(part)%max_cells
         if (.not. any(marks(l)%touched .and. .not. marks(l)%may)) cycle
         call fail(error, exit_numerical, 'time '//to_text(model%time)// &
                   ' s: the contact is too near to the edge of level '//to_text(l - 1)// &
                   ', which level '//to_text(l)//' refines; try a larger one')
         return
      end do
      call choose_regions(model%levels(first:)%grid, marks, regions(first:), short, needs, bound)
      model%placings = model%placings + 1
      if (bound) model%bound_placings = model%bound_placings + 1
      if (short == 0) return
      l = first - 1 + short
      part = findloc(model%level_specs%of, l - 1, dim=1)
      call fail(error, exit_numerical, 'time '//to_text(model%time)//' s: level '//to_text(l)//' needs '// &
                model%level_specs(part)%in_budget(needs)// &
                ', with those of finer levels, where tools are near, more than its '// &
                model%level_specs(part)%budget()//'; try a larger one')
   end subroutine place_by_error

   !> Collective: combine the marks of all ranks.
   subroutine share(model, marks)
      type(model_t), intent(in) :: model
      type(marks_t), intent(inout) :: marks
      call MPI_Allreduce(MPI_IN_PLACE, marks%error, size(marks%error), MPI_DOUBLE_PRECISION, MPI_MAX, &
                         model%communicator%comm)
      call MPI_Allreduce(MPI_IN_PLACE, marks%touched, size(marks%touched), MPI_LOGICAL, MPI_LOR, &
                         model%communicator%comm)
   end subroutine share

   !> Add the particles of a level to the marks. The error of a particle is of first order: on a coarser level
   !> it would be twice as large, its energy four times.
   subroutine mark(model, l, recovered, first, marks, largest)
      type(model_t), intent(in) :: model
      integer, intent(in) :: l, first
      type(block_stress_t), intent(in) :: recovered(:)
      type(marks_t), intent(inout) :: marks(first:)
      real(wp), intent(inout) :: largest !< energy of a stress, J/m3
      real(wp) :: difference, half, own(6)
      real(wp) :: x(3), e(3) ! copies: gfortran 12 passes the name of a strided section incorrectly
      integer :: b, cell(3), m, p
      associate (level => model%levels(l), at => model%levels(l)%layout)
         do b = 1, size(level%blocks)
            associate (particles => level%blocks(b)%particles)
               do p = 1, particles%count
                  x = particles%column(p, at%position:at%position + 2)
                  e = extents(particles%column(p, :), at)
                  half = longest_half_edge(particles%column(p, :), at)
                  own = particles%column(p, at%stress:at%stress + 5)
                  associate (law => model%materials%slots(model%materials%of_body(particles%body(p)))%law)
                     largest = max(largest, law%energy_of_stress(particles%column(p, :), at, own))
                     difference = law%energy_of_stress(particles%column(p, :), at, &
                                                       recovered(b)%of(:, p) - own)
                  end associate
                  do m = first, ubound(marks, 1)
                     associate (grid => model%levels(m - 1)%grid)
                        cell = min(max(int((x - grid%lower)*grid%per_cell), 0), grid%cells - 1)
                        associate (error => marks(m)%error(cell(1), cell(2), cell(3)))
                           error = max(error, difference*4.0_wp**(l - m + 1))
                        end associate
                        if (near_tool(model%contact%tools, x, half + reach*grid%cell)) &
                           call touch(grid, x - e, x + e, marks(m)%touched)
                     end associate
                  end do
               end do
            end associate
         end do
      end associate
   end subroutine mark

   !> Collective: mark the cells where bodies of different contact groups are near each other.
   subroutine mark_groups(model, l, touched)
      type(model_t), intent(in) :: model
      integer, intent(in) :: l
      logical, intent(inout) :: touched(0:, 0:, 0:)
      integer, allocatable, dimension(:, :, :) :: lowest, highest ! group in a cell of the level above
      real(wp) :: x(3), e(3)
      integer :: a(3), z(3), b, m, p
      allocate (lowest(0:ubound(touched, 1), 0:ubound(touched, 2), 0:ubound(touched, 3)), source=huge(1))
      allocate (highest(0:ubound(touched, 1), 0:ubound(touched, 2), 0:ubound(touched, 3)), source=0)
      associate (grid => model%levels(l - 1)%grid)
         do m = 1, size(model%levels)
            do b = 1, size(model%levels(m)%blocks)
               associate (block => model%levels(m)%blocks(b), at => model%levels(m)%layout)
                  do p = 1, block%particles%count
                     x = block%particles%column(p, at%position:at%position + 2)
                     e = extents(block%particles%column(p, :), at)
                     call grid%cells_of_box(x - e, x + e, a, z)
                     associate (low => lowest(a(1):z(1), a(2):z(2), a(3):z(3)), &
                                high => highest(a(1):z(1), a(2):z(2), a(3):z(3)))
                        low = min(low, block%field)
                        high = max(high, block%field)
                     end associate
                  end do
               end associate
            end do
         end do
      end associate
      call MPI_Allreduce(MPI_IN_PLACE, lowest, size(lowest), MPI_INTEGER, MPI_MIN, model%communicator%comm)
      call MPI_Allreduce(MPI_IN_PLACE, highest, size(highest), MPI_INTEGER, MPI_MAX, model%communicator%comm)
      call mark_neighbours(lowest, highest, touched)
   end subroutine mark_groups

   !> Set the cells that a level may refine: all, if the level above is placed by the error too and will
   !> follow; else those far enough from its edge.
   subroutine set_free(model, l, first, marks)
      type(model_t), intent(in) :: model
      integer, intent(in) :: l, first
      type(marks_t), intent(inout) :: marks
      integer :: i, j, k
      associate (n => model%levels(l - 1)%grid%cells, above => model%levels(l - 1)%region)
         allocate (marks%may(0:n(1) - 1, 0:n(2) - 1, 0:n(3) - 1), source=.true.)
         if (l > first .or. l == 2) return
         do k = 0, n(3) - 1
            do j = 0, n(2) - 1
               do i = 0, n(1) - 1
                  marks%may(i, j, k) = .not. above%any_outer([i, j, k] - 1, [i, j, k] + 2)
               end do
            end do
         end do
      end associate
   end subroutine set_free

end module m_error_placing
