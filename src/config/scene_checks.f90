!> Checks across the groups of a scene: geometry and numerics.
module m_scene_checks
   use m_side_kinds, only: side_kinds
   use m_kinds, only: wp
   use m_constants, only: exit_input
   use m_errors, only: error_t, fail
   use m_namelist_text, only: namelist_text_t
   use m_number_text, only: reals_text
   use m_text, only: exact_text, to_text
   use m_scene
   use m_scene_level_checks, only: check_levels
   use m_scene_motion, only: check_motions
   use m_scene_static, only: check_quasi_static
   use m_shape, only: shape_t
   use m_overlap, only: overlap, deepest
   implicit none
   private
   public :: check_scene

   real(wp), parameter :: whole = 1.0e-9_wp     !< relative tolerance for a whole number of cells
   real(wp), parameter :: touching = 1.0e-6_wp !< overlap by less than this share of a cell is touching
   real(wp), parameter :: resolved = 2.0e-2_wp !< the same where a shape is not convex
   real(wp), parameter :: cell_limit = 2.0e9_wp
   integer, parameter :: max_attempts = 100000    !< cell sizes tried to find those that divide the grid
   integer, parameter :: shown_digits = 10

contains

   !> All checks; sets the cells of the grid. `text` is the source of the scene, for the position in messages.
   subroutine check_scene(text, scene, error)
      type(namelist_text_t), intent(in) :: text
      type(scene_t), intent(inout) :: scene
      type(error_t), intent(inout) :: error
      integer :: i
      call check_grid(text, scene%grid, error)
      if (error%happened()) return
      call check_levels(text, scene, error)
      if (error%happened()) return
      do i = 1, size(scene%bodies)
         call check_body(text, scene, i, error)
         call check_safety(text, scene, i, error)
      end do
      if (error%happened()) return
      call check_motions(text, scene, error)
      if (error%happened()) return
      call check_groups(text, scene, error)
      call check_quasi_static(text, scene, error)
      call check_overlaps(text, scene, error)
      call check_probes(text, scene, error)
   end subroutine check_scene

   !> The grid has a size, and whole cells, of which there are not too many.
   subroutine check_grid(text, grid, error)
      type(namelist_text_t), intent(in) :: text
      type(grid_spec_t), intent(inout) :: grid
      type(error_t), intent(inout) :: error
      real(wp) :: length(3), smaller, larger
      character(len=:), allocatable :: advice
      length = grid%upper - grid%lower
      if (any(length <= 0.0_wp)) then
         call fail(error, exit_input, text%place('grid', 1, 'upper')//': must be above lower='// &
                   reals_text(grid%lower)//' in every direction')
      else if (any(length/grid%cell_size > cell_limit) .or. product(length/grid%cell_size) > cell_limit) then
         call fail(error, exit_input, text%place('grid', 1, 'cell_size')//': makes '// &
                   to_text(product(length/grid%cell_size), 3)//' cells; allowed: at most '// &
                   exact_text(cell_limit))
      else if (.not. divides(grid%cell_size, length)) then
         call nearest_sizes(grid%cell_size, length, smaller, larger)
         advice = ''
         if (smaller > 0.0_wp) advice = to_text(smaller, shown_digits)
         if (smaller > 0.0_wp .and. larger > 0.0_wp) advice = advice//' and '
         if (larger > 0.0_wp) advice = advice//to_text(larger, shown_digits)
         if (advice /= '') advice = '; nearest that do: '//advice
         call fail(error, exit_input, text%place('grid', 1, 'cell_size')// &
                   ': must divide all lengths of the grid, '//reals_text(length, 6)//' m'//advice)
      end if
      if (.not. error%happened()) grid%cells = nint(length/grid%cell_size)
   end subroutine check_grid

   !> True when every length is a whole number of cells.
   pure logical function divides(cell_size, length)
      real(wp), intent(in) :: cell_size, length(3)
      real(wp) :: cells(3)
      cells = length/cell_size
      divides = all(anint(cells) >= 1.0_wp) .and. all(abs(cells - anint(cells)) <= whole*cells)
   end function divides

   !> The nearest smaller and larger cell sizes that divide all lengths; 0 where none is near.
   pure subroutine nearest_sizes(cell_size, length, smaller, larger)
      real(wp), intent(in) :: cell_size, length(3)
      real(wp), intent(out) :: smaller, larger
      integer :: start, cells
      start = int(minval(length)/cell_size)
      smaller = 0.0_wp
      larger = 0.0_wp
      do cells = start, max(1, start - max_attempts), -1
         larger = minval(length)/cells
         if (larger > cell_size .and. divides(larger, length)) exit
         larger = 0.0_wp
      end do
      do cells = start + 1, start + max_attempts
         smaller = minval(length)/cells
         if (product(length/smaller) > cell_limit) smaller = 0.0_wp
         if (smaller <= 0.0_wp) exit
         if (divides(smaller, length)) exit
         smaller = 0.0_wp
      end do
   end subroutine nearest_sizes

   !> A body has a size, lies inside the grid and is not thinner than a particle.
   subroutine check_body(text, scene, i, error)
      type(namelist_text_t), intent(in) :: text
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: i
      type(error_t), intent(inout) :: error
      real(wp) :: lower(3), upper(3), inner_lower(3), inner_upper(3), slack, particle, thickness
      character(len=:), allocatable :: variable
      associate (body => scene%bodies(i), shape => scene%bodies(i)%shape, grid => scene%grid)
         call shape%bounding_box(lower, upper)
         if (grid%section%is_flat()) then ! the section covers the whole thickness
            lower(2) = grid%lower(2)
            upper(2) = grid%upper(2)
         end if
         inner_lower = lower
         inner_upper = upper
         if (.not. shape%is_lattice()) then ! a symmetry plane may cut it
            where (side_kinds(grid%boundary(1:5:2))%mirrors) inner_lower = max(lower, min(grid%lower, upper))
            where (side_kinds(grid%boundary(2:6:2))%mirrors) inner_upper = min(upper, max(grid%upper, lower))
         end if
         slack = touching*grid%cell_size
         if (any(inner_lower < grid%lower - slack) .or. any(inner_upper > grid%upper + slack)) then
            variable = shape%place_name(down=any(lower < grid%lower - slack))
            call fail(error, exit_input, text%place('body', i, variable)//': the body spans '// &
                      reals_text(lower, 6)//' to '//reals_text(upper, 6)//' m; allowed: inside the grid, '// &
                      reals_text(grid%lower, 6)//' to '//reals_text(grid%upper, 6)//' m')
         end if
         particle = grid%cell_size/nint(body%particles_per_cell**(1.0_wp/3.0_wp))
         call shape%thinnest(thickness, variable)
         if (shape%is_lattice()) &
            call check_whole_particles(text%place('body', i, variable), lower, upper, particle, &
                                       scene%grid%section%is_flat(), error)
         if (thickness >= particle*(1.0_wp - whole)) return
         call fail(error, exit_input, text%place('body', i, variable)//': the body is '// &
                   to_text(thickness, 6)// &
                   ' m thick; allowed: at least one particle, '//to_text(particle, 6)//' m')
      end associate
   end subroutine check_body

   !> The edges of a box are whole numbers of particles, so that its mass is exact.
   subroutine check_whole_particles(place, lower, upper, particle, flat, error)
      character(len=*), intent(in) :: place !< line, group and variable
      real(wp), intent(in) :: lower(3), upper(3)
      real(wp), intent(in) :: particle      !< edge of a particle, m
      logical, intent(in) :: flat           !< of a section: y is ignored
      type(error_t), intent(inout) :: error
      character(len=1), parameter :: axes(3) = ['x', 'y', 'z']
      real(wp) :: count
      integer :: axis
      do axis = 1, 3
         count = (upper(axis) - lower(axis))/particle
         if (flat .and. axis == 2) cycle
         if (count < 1.0_wp .or. abs(count - anint(count)) <= 1.0e-6_wp*count) cycle
         call fail(error, exit_input, place//': the box is '//to_text(count, 6)//' particles of '// &
                   to_text(particle, 6)//' m long in '//axes(axis)//'; allowed: a whole number, nearest '// &
                   axes(axis)//'='//to_text(lower(axis) + anint(count)*particle, 9))
         return
      end do
   end subroutine check_whole_particles

   !> The safety factor is within the limit for the body's particles.
   subroutine check_safety(text, scene, i, error)
      type(namelist_text_t), intent(in) :: text
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: i
      type(error_t), intent(inout) :: error
      real(wp) :: largest
      largest = largest_safety(scene%bodies(i)%particles_per_cell)
      if (scene%time%safety <= largest .or. text%count_groups('time') == 0) return
      call fail(error, exit_input, text%place('time', 1, 'safety')//': must be at most '// &
                exact_text(largest)//' with particles_per_cell='// &
                to_text(scene%bodies(i)%particles_per_cell)//' of the &body on '//text%line_of('body', i))
   end subroutine check_safety

   !> No body overlaps another, no tool starts inside a body.
   subroutine check_overlaps(text, scene, error)
      type(namelist_text_t), intent(in) :: text
      type(scene_t), intent(in) :: scene
      type(error_t), intent(inout) :: error
      class(shape_t), allocatable :: shape
      real(wp), parameter :: here(3) = 0.0_wp
      real(wp) :: allowed, thin, coarse, there(3), deep
      integer :: i, k
      thin = touching*scene%grid%cell_size
      coarse = resolved*scene%grid%cell_size
      do i = 1, size(scene%bodies)
         do k = 1, i - 1
            if (.not. overlap(scene%bodies(i)%shape, scene%bodies(k)%shape, here, thin, coarse)) cycle
            call deepest(scene%bodies(k)%shape, scene%bodies(i)%shape, here, there, deep)
            allowed = overlap_allowed(scene, i, k)
            if (allowed > 0.0_wp .and. deep <= allowed) cycle
            call fail(error, exit_input, &
                      text%place('body', i, scene%bodies(i)%shape%place_name(down=.true.))//': the body '// &
                      scene%bodies(i)%name//' overlaps the body '//scene%bodies(k)%name//' on '// &
                      text%line_of('body', k)//' by about '//to_text(deep, 2)//' m, at '// &
                      reals_text(there, 3)//'; allowed: '//allowed_text(allowed))
            return
         end do
      end do
      do i = 1, size(scene%tools)
         if (allocated(shape)) deallocate (shape)
         allocate (shape, source=scene%tools(i)%shape)
         call shape%prepare(scene%tools(i)%axis)
         do k = 1, size(scene%bodies)
            if (.not. overlap(scene%bodies(k)%shape, shape, scene%tools(i)%tip, thin, coarse)) cycle
            call deepest(scene%bodies(k)%shape, shape, scene%tools(i)%tip, there, deep)
            call fail(error, exit_input, text%place('tool', i, 'tip')//': the tool '//scene%tools(i)%name// &
                      ' starts inside the body '//scene%bodies(k)%name//' on '//text%line_of('body', k)// &
                      ' and reaches about '//to_text(deep, 2)//' m into it, at '//reals_text(there, 3)// &
                      '; a tool must start outside every body')
            return
         end do
      end do
   end subroutine check_overlaps

   !> Allowed initial overlap of two bodies, m: for two contact groups with start='as_is' the edge of a
   !> particle of the finest level, as surfaces further apart do not find each other; else 0.
   pure real(wp) function overlap_allowed(scene, one, other) result(allowed)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: one, other
      type(body_contact_spec_t) :: spec
      integer :: per_cell
      allowed = 0.0_wp
      if (scene%bodies(one)%field == scene%bodies(other)%field) return
      spec = scene%contact_of(scene%bodies(one)%field, scene%bodies(other)%field)
      if (spec%start /= start_as_is) return
      per_cell = max(scene%bodies(one)%particles_per_cell, scene%bodies(other)%particles_per_cell)
      allowed = scene%grid%cell_size/2**(scene%depth() - 1)/nint(per_cell**(1.0_wp/3.0_wp))*(1.0_wp + whole)
   end function overlap_allowed

   !> The same, as text for a message.
   pure function allowed_text(allowed) result(text)
      real(wp), intent(in) :: allowed !< m
      character(len=:), allocatable :: text
      text = 'bodies that touch'
      if (allowed > 0.0_wp) text = text//', or overlap by no more than a particle, '//to_text(allowed, 3)// &
         ' m'
   end function allowed_text

   !> Contact between bodies is solved once a step: the stress must be updated with the same nodal solution.
   subroutine check_groups(text, scene, error)
      type(namelist_text_t), intent(in) :: text
      type(scene_t), intent(in) :: scene
      type(error_t), intent(inout) :: error
      if (scene%fields() > 1 .and. scene%time%stress_update /= update_usl) &
         call fail(error, exit_input, text%place('time', 1, 'stress_update')//': with more than one '// &
                   'contact_group only ''usl'' is allowed')
   end subroutine check_groups

   !> A probe needs material at its position.
   subroutine check_probes(text, scene, error)
      type(namelist_text_t), intent(in) :: text
      type(scene_t), intent(in) :: scene
      type(error_t), intent(inout) :: error
      integer :: i, k
      do i = 1, size(scene%probes)
         if (any([(scene%bodies(k)%shape%distance(scene%probes(i)%position) <= &
                   touching*scene%grid%cell_size, k=1, size(scene%bodies))])) cycle
         call fail(error, exit_input, text%place('probe', i, 'position')//': must lie inside a body')
      end do
   end subroutine check_probes

end module m_scene_checks
