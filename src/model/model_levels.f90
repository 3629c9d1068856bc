!> The grids of the levels, and the regions that they refine.
submodule (m_model) m_model_levels
   use m_text, only: si, to_text
   use m_number_text, only: reals_text
   use m_constants, only: block_size, exit_input
   use m_errors, only: fail
   use m_grid_level, only: make_grid_level
   use m_field_table, only: bytes_per_column
   use m_level, only: tile_bytes
   use m_particle_store, only: bytes_besides, spare_room
   use m_scene, only: level_sphere, criterion_error, min_cells
   use m_first_touch, only: touched_at_start
   use m_marking, only: needed_above, closed
   use m_region, only: make_region
   use m_region_parts, only: unite, make_ball, first_too_near, smallest_gap
   implicit none

   real(wp), parameter :: first_radius = 4.0_wp !< cells: radius of the initial ball of a level placed by the
                                                !< error

contains

   module procedure make_levels
      integer :: l, n, part, t
      n = scene%depth()
      if (n > 1) self%level_specs = scene%levels
      allocate (self%levels(n), self%effect_step(n), self%exchange(n), self%migration(n), &
                self%composite(n + 1))
      allocate (self%level_steps(n), source=0_i8)
      do l = 1, n
         self%levels(l)%number = l
         self%levels(l)%grid = make_grid_level(scene%grid, l)
         self%levels(l)%grid%fields = scene%fields()
         self%levels(l)%field_of_body = scene%bodies%field
         self%levels(l)%region = make_region(self%levels(l)%grid, [0, 0, 0], self%levels(l)%grid%cells)
      end do
      if (n == 1) return
      allocate (self%first_parts(size(scene%levels)))
      do part = 1, size(scene%levels)
         associate (spec => scene%levels(part), grid => self%levels(scene%levels(part)%of + 1)%grid)
            if (spec%shape == level_sphere) then
               self%first_parts(part) = make_ball(grid, spec%center, spec%radius, spec%inner_radius)
            else if (.not. spec%has_box .and. size(scene%tools) > 0) then
               self%first_parts(part) = unite(grid, &
                                              [(make_ball(grid, min(max(scene%tools(t)%tip, grid%lower), &
                  grid%upper), 2.0_wp*first_radius*grid%cell, 0.0_wp), t=1, size(scene%tools))])
            else if (.not. spec%has_box) then
               self%first_parts(part) = make_ball(grid, between_bodies(scene), &
                                                  2.0_wp*first_radius*grid%cell, 0.0_wp)
            else
               self%first_parts(part) = make_region(grid, 2*nint(0.5_wp*(spec%lower &
                     - grid%lower)*grid%per_cell), &
                                                    2*nint(0.5_wp*(spec%upper - grid%lower)*grid%per_cell))
            end if
         end associate
      end do
      do l = n, 2, -1
         part = findloc(scene%levels%of == l - 1 .and. scene%levels%criterion == criterion_error, &
                        .true., dim=1)
         if (part > 0) call add_touched(self, scene, l, part)
         self%levels(l)%region = unite(self%levels(l)%grid, pack(self%first_parts, scene%levels%of == l - 1))
      end do
   end procedure make_levels

   !> A level placed by the error starts in the contact zone, in the given box or else, without contact yet,
   !> around the tips of tools; and includes the cells needed around the next finer level.
   subroutine add_touched(self, scene, l, part)
      type(model_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: l, part
      logical, allocatable :: cells(:, :, :)
      integer :: i, j, k
      logical :: keep
      associate (n => self%levels(l - 1)%grid%cells, region => self%first_parts(part))
         allocate (cells(0:n(1) - 1, 0:n(2) - 1, 0:n(3) - 1))
         cells(:, :, :) = touched_at_start(scene, self%levels(l - 1)%grid) ! keeps the bounds of the array
         keep = scene%levels(part)%has_box .or. .not. any(cells)
         if (keep) then
            do k = 1, n(3)
               do j = 1, n(2)
                  do i = 1, n(1)
                     cells(i - 1, j - 1, k - 1) = cells(i - 1, j - 1, k - 1) .or. &
                                                  region%has_all([i, j, k] - 1, [i, j, k] - 1)
                  end do
               end do
            end do
         end if
         if (l < size(self%levels)) then
            where (needed_above(self%levels(l + 1)%region, n)) cells = .true.
         end if
         region = make_region(self%levels(l)%grid, [0, 0, 0], closed(self%levels(l)%grid, cells))
      end associate
   end subroutine add_touched

   module procedure check_nests
      integer :: cell(3), l, part
      do l = 3, size(self%levels)
         do part = 1, size(scene%levels)
            if (scene%levels(part)%of /= l - 1) cycle
            cell = first_too_near(self%levels(l - 1)%region, self%first_parts(part))
            if (all(cell < 0)) cycle
            associate (grid => self%levels(l - 1)%grid)
               call fail(error, exit_input, scene%place('level', part)//': the level reaches ('// &
                         reals_text(grid%lower + (cell + 0.5_wp)*grid%cell, 6)//') m, less than '// &
                         to_text(smallest_gap)//' cells of '//si(grid%cell, 'm')// &
                         ' inside the edge of level '//to_text(l - 1)// &
                         ', which it refines; allowed: at least '//to_text(smallest_gap))
            end associate
            return
         end do
      end do
   end procedure check_nests

   module procedure set_budgets
      real(wp) :: a_cell
      integer :: part
      if (size(self%levels) == 1) return
      a_cell = (1.0_wp + spare_room)*maxval(scene%bodies%particles_per_cell) &
               *(bytes_per_column*self%levels(1)%table%columns + bytes_besides) &
               + real(tile_bytes, wp)/block_size**3
      if (scene%grid%section%is_flat()) &
         a_cell = (1.0_wp + spare_room)*maxval(real(scene%bodies%particles_per_cell, wp))**(2.0_wp/3.0_wp) &
                  *(bytes_per_column*self%levels(1)%table%columns + bytes_besides) &
                  + real(tile_bytes, wp)/block_size**2
      do part = 1, size(self%level_specs)
         associate (spec => self%level_specs(part))
            if (.not. spec%max_memory > 0.0_wp) cycle
            if (spec%max_memory < min_cells*a_cell) then
               call fail(error, exit_input, scene%place('level', part)//' max_memory='// &
                         to_text(spec%max_memory)//': a cell of it takes '//si(a_cell, 'B')// &
                         ', with its particles; allowed: at least '//si(min_cells*a_cell, 'B')// &
                         ', for '//to_text(min_cells)//' cells')
               return
            end if
            if (spec%max_memory/a_cell >= spec%max_cells) cycle
            spec%max_cells = int(spec%max_memory/a_cell)
            spec%bytes_a_cell = a_cell
         end associate
      end do
      call check_budgets(self, scene, error)
   end procedure set_budgets

   !> The mean of the centres of the bodies, m.
   pure function between_bodies(scene) result(place)
      type(scene_t), intent(in) :: scene
      real(wp) :: place(3), lower(3), upper(3)
      integer :: e
      place = 0.0_wp
      do e = 1, size(scene%bodies)
         call scene%bodies(e)%shape%bounding_box(lower, upper)
         place = place + 0.5_wp*(lower + upper)/size(scene%bodies)
      end do
      place = min(max(place, scene%grid%lower), scene%grid%upper)
   end function between_bodies

   !> Levels that start in the contact zone must be within their budgets.
   subroutine check_budgets(self, scene, error)
      type(model_t), intent(in) :: self
      type(scene_t), intent(in) :: scene
      type(error_t), intent(inout) :: error
      integer(i8) :: needs
      integer :: l, part
      needs = 0
      do l = size(self%levels), 2, -1
         part = findloc(scene%levels%of == l - 1 .and. scene%levels%criterion == criterion_error, &
                        .true., dim=1)
         if (part == 0) return
         needs = needs + self%levels(l)%region%cells()
         associate (spec => self%level_specs(part))
            if (needs <= spec%max_cells .or. spec%has_box) cycle
            call fail(error, exit_input, scene%place('level', part)//' '//spec%budget()// &
                      ': the contact at the start needs '//spec%in_budget(needs)//' of the level'// &
                      trim(merge(' and of finer ones', '                  ', l < size(self%levels)))// &
                      '; allowed: at least so many')
         end associate
         return
      end do
   end subroutine check_budgets

end submodule m_model_levels
