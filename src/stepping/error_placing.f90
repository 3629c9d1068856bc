!> Levels that the estimated error of the stress places, and what tools are near (theory.md, eq. level-error).
module m_error_placing
   use mpi_f08
   use m_kinds, only: wp, i8
   use m_constants, only: exit_numerical
   use m_errors, only: error_t, fail
   use m_text, only: to_text
   use m_scene, only: criterion_error
   use m_model, only: model_t
   use m_region, only: region_t
   use m_marking, only: choose_region, needed_above
   use m_recovered_stress, only: block_stress_t, recover_stress
   implicit none
   private
   public :: place_by_error, is_due

   integer, parameter :: judged_every = 50   !< steps of the coarsest level between two looks,
   real(wp), parameter :: furthest = 0.5_wp  !< and way of a tool between them, in the smallest cells refined
   real(wp), parameter :: reach = 1.5_wp !< of a tool: what is nearer, in the cells that are refined, is touched

   !> Of the cells of a level: the largest error (J/m3) that the stress would have if they were not refined, and
   !> whether a tool is near.
   type :: marks_t
      real(wp), allocatable :: error(:, :, :)
      logical, allocatable :: touched(:, :, :)
   end type marks_t

contains

   !> True when it is time to look: it follows from the state alone, so that a run that goes on looks at the same
   !> times.
   pure logical function is_due(model)
      type(model_t), intent(in) :: model
      real(wp) :: way
      integer :: every, t
      is_due = any(model%level_specs%criterion == criterion_error)
      if (.not. is_due) return
      way = 0.0_wp ! in a step
      do t = 1, size(model%contact%tools)
         associate (tool => model%contact%tools(t))
            way = max(way, model%last_step*max(norm2(tool%velocity), tool%fastest(model%time, model%time &
                                                                       + judged_every*model%last_step)))
         end associate
      end do
      every = judged_every
      associate (cell => model%levels(size(model%levels) - 1)%grid%cell)
         if (way*judged_every > furthest*cell) every = max(1, int(furthest*cell/way))
      end associate
      is_due = mod(model%step, int(every, i8)) == 0
   end function is_due

   !> Collective: set the regions of all levels that the error places, the finest first, each with what the next
   !> finer one needs around it. The same on any number of ranks: only maxima are taken over ranks.
   subroutine place_by_error(model, regions, error)
      type(model_t), intent(inout) :: model
      type(region_t), intent(inout) :: regions(:) !< of all levels
      type(error_t), intent(inout) :: error
      type(block_stress_t), allocatable :: recovered(:)
      type(marks_t) :: marks(size(regions))
      logical, allocatable :: may(:, :, :)
      real(wp) :: largest
      integer(i8) :: needs
      integer :: first, l, part
      first = 1 + minval(model%level_specs%of, mask=model%level_specs%criterion == criterion_error)
      do l = first, size(regions)
         associate (n => model%levels(l - 1)%grid%cells)
            allocate (marks(l)%error(0:n(1) - 1, 0:n(2) - 1, 0:n(3) - 1), source=0.0_wp)
            allocate (marks(l)%touched(0:n(1) - 1, 0:n(2) - 1, 0:n(3) - 1), source=.false.)
         end associate
      end do
      largest = 0.0_wp
      do l = 1, size(regions)
         call recover_stress(model, l, recovered)
         call mark(model, l, recovered, first, marks, largest)
      end do
      call MPI_Allreduce(MPI_IN_PLACE, largest, 1, MPI_DOUBLE_PRECISION, MPI_MAX, model%communicator%comm)
      do l = size(regions), first, -1
         call MPI_Allreduce(MPI_IN_PLACE, marks(l)%error, size(marks(l)%error), MPI_DOUBLE_PRECISION, MPI_MAX, &
                            model%communicator%comm)
         call MPI_Allreduce(MPI_IN_PLACE, marks(l)%touched, size(marks(l)%touched), MPI_LOGICAL, MPI_LOR, &
                            model%communicator%comm)
         if (l < size(regions)) marks(l)%touched = marks(l)%touched .or. &
                                                   needed_above(regions(l + 1), shape(marks(l)%touched))
         may = free_cells(model, l, first)
         part = findloc(model%level_specs%of, l - 1, dim=1)
         associate (spec => model%level_specs(part))
            call choose_region(model%levels(l)%grid, marks(l)%error, spec%tolerance**2*largest, &
                               marks(l)%touched, may, spec%max_cells, regions(l), needs)
            if (needs == 0) cycle
            call fail(error, exit_numerical, 'time '//to_text(model%time)//' s: level '//to_text(l)//' needs '// &
                      to_text(needs)//' cells where tools are near and finer levels are, more than its max_cells='// &
                      to_text(spec%max_cells)//'; try a larger one')
            return
         end associate
      end do
   end subroutine place_by_error

   !> Add the particles of a level to the marks. The error of a particle is of first order: on a coarser level it
   !> would be twice as large, its energy four times.
   subroutine mark(model, l, recovered, first, marks, largest)
      type(model_t), intent(in) :: model
      integer, intent(in) :: l, first
      type(block_stress_t), intent(in) :: recovered(:)
      type(marks_t), intent(inout) :: marks(:)
      real(wp), intent(inout) :: largest !< energy of a stress, J/m3
      real(wp) :: difference, own(6), x(3) ! x is a copy: gfortran 12 hands on the name of a strided section wrongly
      integer :: b, cell(3), m, p
      associate (level => model%levels(l), at => model%levels(l)%layout)
         do b = 1, size(level%blocks)
            associate (particles => level%blocks(b)%particles)
               do p = 1, particles%count
                  x = particles%column(p, at%position:at%position + 2)
                  associate (law => model%materials%slots(model%materials%of_body(particles%body(p)))%law)
                     own = particles%column(p, at%stress:at%stress + 5)
                     largest = max(largest, law%energy_of_stress(particles%column(p, :), at, own))
                     difference = law%energy_of_stress(particles%column(p, :), at, recovered(b)%of(:, p) - own)
                     do m = first, size(marks)
                        associate (grid => model%levels(m - 1)%grid)
                           cell = min(max(int((x - grid%lower)*grid%per_cell), 0), grid%cells - 1)
                           associate (error => marks(m)%error(cell(1), cell(2), cell(3)))
                              error = max(error, difference*4.0_wp**(l - m + 1))
                           end associate
                           if (near_tool(model, x, reach*grid%cell)) call touch(marks(m)%touched, cell)
                        end associate
                     end do
                  end associate
               end do
            end associate
         end do
      end associate
   end subroutine mark

   !> A cell and those around it are wanted.
   pure subroutine touch(touched, cell)
      logical, intent(inout) :: touched(0:, 0:, 0:)
      integer, intent(in) :: cell(3)
      integer :: a(3), z(3)
      a = max(cell - 1, 0)
      z = min(cell + 1, shape(touched) - 1)
      touched(a(1):z(1), a(2):z(2), a(3):z(3)) = .true.
   end subroutine touch

   !> True when a place is less than `width` (m) away from a tool.
   logical function near_tool(model, x, width)
      type(model_t), intent(in) :: model
      real(wp), intent(in) :: x(3), width
      real(wp) :: gap, normal(3)
      integer :: t
      near_tool = .false.
      do t = 1, size(model%contact%tools)
         call model%contact%tools(t)%gap_and_normal(x, gap, normal)
         near_tool = near_tool .or. gap < width
      end do
   end function near_tool

   !> The cells that a level may refine: all, where the level above is placed by the error too and follows; else
   !> those far enough from its edge.
   function free_cells(model, l, first) result(may)
      type(model_t), intent(in) :: model
      integer, intent(in) :: l, first
      logical, allocatable :: may(:, :, :)
      integer :: i, j, k
      associate (n => model%levels(l - 1)%grid%cells, above => model%levels(l - 1)%region)
         allocate (may(0:n(1) - 1, 0:n(2) - 1, 0:n(3) - 1), source=.true.)
         if (l > first .or. l == 2) return
         do k = 0, n(3) - 1
            do j = 0, n(2) - 1
               do i = 0, n(1) - 1
                  may(i, j, k) = .not. above%any_outer([i, j, k] - 1, [i, j, k] + 2)
               end do
            end do
         end do
      end associate
   end function free_cells

end module m_error_placing
