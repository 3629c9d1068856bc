!> The grids of the levels, and the regions that they refine.
submodule (m_model) m_model_levels
   use m_text, only: si
   use m_number_text, only: reals_text
   use m_scene, only: level_sphere
   use m_region, only: make_region
   use m_region_parts, only: unite, make_ball, first_too_near, smallest_gap
   implicit none

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
            else if (.not. spec%has_box) then
               self%first_parts(part) = unite(grid, [(make_ball(grid, min(max(scene%tools(t)%tip, grid%lower), &
                  grid%upper), 2.0_wp*first_radius*grid%cell, 0.0_wp), t=1, size(scene%tools))])
            else
               self%first_parts(part) = make_region(grid, 2*nint(0.5_wp*(spec%lower &
                     - grid%lower)*grid%per_cell), &
                                                    2*nint(0.5_wp*(spec%upper - grid%lower)*grid%per_cell))
            end if
         end associate
      end do
      do l = 2, n
         self%levels(l)%region = unite(self%levels(l)%grid, pack(self%first_parts, scene%levels%of == l - 1))
      end do
   end procedure make_levels

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
                         ' inside the edge of level '//to_text(l - 1)//', which it refines; allowed: at least '// &
                         to_text(smallest_gap))
            end associate
            return
         end do
      end do
   end procedure check_nests

end submodule m_model_levels
