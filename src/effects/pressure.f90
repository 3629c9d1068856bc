!> A pressure on a patch of a body's face, or on all surface within a box, that follows the surface; or a
!> traction in any direction, fixed or rotating with the face (theory.md, eqs pressure, traction).
module m_pressure
   use m_kinds, only: wp
   use m_constants, only: exit_input
   use m_errors, only: error_t, fail
   use m_text, only: to_text
   use m_piecewise, only: value_at, integral
   use m_node_values, only: f_x, f_z
   use m_communicator, only: communicator_t
   use m_group_reader, only: group_reader_t
   use m_value_range, only: any_value
   use m_grid_level, only: grid_level_t
   use m_field_table, only: field_table_t, layout_t
   use m_particle_store, only: particle_store_t
   use m_scene, only: body_spec_t
   use m_cut_cell, only: cells_of_particle, find_surface, cell_limit
   use m_block, only: block_t
   use m_level, only: level_t
   use m_stencil, only: bin_place
   use m_face_weights, only: face_weights_t, fit_share, weigh, add_to_nodes
   use m_half_edges, only: fitted_edges
   use m_carried_face, only: carry_faces, carried_area, area_before
   use m_effect, only: effect_t, hooks_t
   use m_section, only: section_t
   use m_vectors, only: cross
   implicit none
   private
   public :: pressure_t

   real(wp), parameter :: hair = 1.0e-9_wp !< cells: a face so near to a node is on it; nodes beyond have
                                           !< negligible mass
   real(wp), parameter :: touching = 1.0e-6_wp !< distance of a face from the patch's plane, in particle
                                               !< edges, up to which it lies on it
   real(wp), parameter :: endless = 1.0e30_wp  !< m: half width of a patch along y in a section; a number that
                                               !< case.nml can contain
   real(wp), parameter :: covered = 1.0e-6_wp  !< tolerated share of the patch without a face

   type, extends(effect_t) :: pressure_t
      real(wp) :: lower(3) = 0.0_wp, upper(3) = 0.0_wp !< of the patch, m: equal along one axis; or of the box
      real(wp), allocatable :: times(:)  !< s, rising
      real(wp), allocatable :: values(:) !< Pa
      real(wp) :: traction(3) = 0.0_wp !< direction of the traction on the surface, times the values; 0: a
                                       !< pressure
      logical :: follows = .false.     !< it rotates with the normal of the face
      integer :: side = 0 !< column: side of the patch's plane that is outside, -1 or 1
      integer :: area = 0 !< first column of the particle's share of the patch, an outward vector, m2
      type(section_t), private :: section !< of the scene
      integer :: arm = 0  !< first column of the vector from the particle's centre to the middle of its share,
                          !< m
   contains
      procedure :: variables
      procedure :: take_section
      procedure :: against_section
      procedure :: hooks
      procedure :: declare
      procedure :: initialise
      procedure :: cover
      procedure :: is_box
      procedure :: verify
      procedure :: add_forces
      procedure :: face_of
      procedure :: force_after
      procedure :: pushed
      procedure :: particle_work
      procedure :: on_stress
      procedure :: turning_times
      procedure, private :: mean_value
      procedure, private :: pull
      procedure, private :: push
   end type pressure_t

contains

   pure function turning_times(self) result(times)
      class(pressure_t), intent(in) :: self
      real(wp), allocatable :: times(:)
      times = self%times
   end function turning_times

   subroutine variables(self, group)
      class(pressure_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      call group%get('lower', self%lower, any_value('m'), required=.true.)
      call group%get('upper', self%upper, any_value('m'), required=.true.)
      if (count(self%upper > self%lower) < 2 .or. any(self%upper < self%lower)) &
         call group%refuse('upper', 'must be above lower along two axes, and along the third equal to it '// &
                                    '(a patch of a face) or above it (a box, for all surface in it)')
      call group%get_list('times', self%times, any_value('s'), required=.true.)
      call group%get_list('values', self%values, any_value('Pa'), required=.true.)
      if (any(abs(self%traction) > 0.0_wp) .or. .not. group%is_writing()) then
         call group%get('traction', self%traction, any_value(''))
         call group%get('follows', self%follows)
      end if
      if (self%follows .and. .not. any(abs(self%traction) > 0.0_wp)) &
         call group%refuse('follows', 'only with traction; a pressure always acts along the normal of '// &
            'the surface')
      if (self%follows .and. self%is_box()) &
         call group%refuse('follows', 'only on a patch, whose normal is known; in a box a traction keeps '// &
            'its direction')
      if (.not. (allocated(self%times) .and. allocated(self%values))) return
      if (any(self%times(2:) <= self%times(:size(self%times) - 1))) &
         call group%refuse('times', 'must rise strictly')
      if (size(self%times) /= size(self%values)) &
         call group%refuse('values', 'must be as many numbers as times, '//to_text(size(self%times))//'; '// &
                           to_text(size(self%values))//' given')
   end subroutine variables

   !> A patch normal to x or z, unbounded along y.
   subroutine take_section(self, section, why)
      class(pressure_t), intent(inout) :: self
      type(section_t), intent(in) :: section
      character(len=:), allocatable, intent(out) :: why
      why = ''
      self%section = section
      self%lower(2) = -endless
      self%upper(2) = endless
      if (abs(self%traction(2)) > 0.0_wp) why = 'has a traction along y; allowed in a section: along x and z'
      if (count(self%upper([1, 3]) > self%lower([1, 3])) /= 1) &
         why = 'with geometry='''//section%word()//''' a patch lies across x or z, equal in lower and upper'
   end subroutine take_section

   !> A patch along the grid is no ring or disc; in plane strain it goes through the slice.
   pure function against_section(self, lower, upper, is_round) result(why)
      class(pressure_t), intent(in) :: self
      real(wp), intent(in) :: lower(3), upper(3)
      logical, intent(in) :: is_round
      character(len=:), allocatable :: why
      why = ''
      if (is_round) then
         why = 'has a rectangle, which is no part of a body of revolution; write the scene by its '// &
               'section, with geometry=''axisymmetric'''
      else if (self%lower(2) > lower(2) + hair*(upper(2) - lower(2)) .or. &
               self%upper(2) < upper(2) - hair*(upper(2) - lower(2))) then
         why = 'must go from side to side in y'
      end if
   end function against_section

   pure type(hooks_t) function hooks(self)
      class(pressure_t), intent(in) :: self
      hooks = hooks_t(add_forces=.true., on_stress=.true., follows_particles=.true.)
   end function hooks

   !> Two vectors a particle. Each patch has its own columns, so that a particle may be under several.
   subroutine declare(self, table)
      class(pressure_t), intent(inout) :: self
      type(field_table_t), intent(inout) :: table
      integer :: patch
      patch = 1
      do while (table%column('pressure_area_'//to_text(patch)) > 0)
         patch = patch + 1
      end do
      call table%declare('pressure_area_'//to_text(patch), 3, 'm2', written=.false., extensive=.true.)
      self%area = table%column('pressure_area_'//to_text(patch))
      call table%declare('pressure_arm_'//to_text(patch), 3, 'm', written=.false., arm_to=self%area)
      self%arm = table%column('pressure_arm_'//to_text(patch))
      if (.not. self%follows) return
      call table%declare('pressure_side_'//to_text(patch), 1, '1', written=.false.)
      self%side = table%column('pressure_side_'//to_text(patch))
   end subroutine declare

   !> True for all surface within a box, false for a patch of a plane.
   pure logical function is_box(self)
      class(pressure_t), intent(in) :: self
      is_box = all(self%upper > self%lower)
   end function is_box

   !> Assign to particles the surface of their body that lies within the box, in their lattice sites and those
   !> merged into them; not where another body touches it.
   subroutine cover(self, particles, first, bodies, body, cells, layout, grid)
      class(pressure_t), intent(in) :: self
      type(particle_store_t), intent(inout) :: particles
      integer, intent(in) :: first
      type(body_spec_t), intent(in) :: bodies(:)
      integer, intent(in) :: body
      real(wp), intent(in) :: cells(:, :)
      type(layout_t), intent(in) :: layout
      type(grid_level_t), intent(in) :: grid
      real(wp) :: middle(3), area(3), size_of, weighted(3), places(3, cell_limit)
      integer :: c, count, p
      if (.not. self%is_box()) return
      do p = 1, size(cells, 2)
         middle = cells(1:3, p)
         associate (half => cells(4, p), column => particles%column(first + p - 1, :))
            if (any(middle + 3.0_wp*half < self%lower) .or. any(middle - 3.0_wp*half > self%upper)) cycle
            call cells_of_particle(bodies(body)%shape, middle, half, .false., places, count)
            area = 0.0_wp
            size_of = 0.0_wp
            weighted = 0.0_wp
            do c = 1, count
               call find_surface(bodies(body)%shape, places(:, c), half, grid%lower, grid%upper, self%lower, &
                                 self%upper, area, size_of, weighted, bodies, body)
            end do
            if (.not. norm2(area) > 0.0_wp) cycle
            column(self%area:self%area + 2) = area
            column(self%arm:self%arm + 2) = weighted/size_of - column(layout%position:layout%position + 2)
         end associate
      end do
   end subroutine cover

   !> Assign to particles with a face on the plane of the patch the part of that face within the patch:
   !> together exactly its area.
   subroutine initialise(self, particles, table, layout, grid)
      class(pressure_t), intent(in) :: self
      type(particle_store_t), intent(inout) :: particles
      type(field_table_t), intent(in) :: table
      type(layout_t), intent(in) :: layout
      type(grid_level_t), intent(in) :: grid
      real(wp) :: position(3), half, from(3), to(3), outward
      integer :: axis, p
      if (self%is_box()) return
      axis = minloc(self%upper - self%lower, dim=1)
      do p = 1, particles%count
         position = particles%column(p, layout%position:layout%position + 2)
         half = 0.5_wp*particles%column(p, layout%volume)**(1.0_wp/3.0_wp) ! a cube at the start
         if (self%section%is_flat()) & ! or a square
            half = 0.5_wp*sqrt(particles%column(p, layout%volume)/self%section%depth(position(1)))
         outward = sign(1.0_wp, self%lower(axis) - position(axis))
         if (abs(position(axis) + outward*half - self%lower(axis)) > touching*half) cycle
         from = max(position - half, self%lower)
         to = min(position + half, self%upper)
         from(axis) = 0.0_wp
         to(axis) = 1.0_wp
         if (any(to <= from)) cycle
         if (self%section%is_flat()) then ! the whole extent normal to the section
            from(2) = 0.0_wp
            to(2) = self%section%depth(merge(self%lower(1), 0.5_wp*(from(1) + to(1)), axis == 1))
         end if
         particles%column(p, self%area + axis - 1) = outward*product(to - from)
         if (self%side > 0) particles%column(p, self%side) = outward
         ! the particle's own face, as the plane may differ by round-off
         from(axis) = position(axis) + outward*half
         to(axis) = from(axis)
         if (self%section%is_flat()) from(2) = -to(2)
         particles%column(p, self%arm:self%arm + 2) = 0.5_wp*(from + to) - position
      end do
   end subroutine initialise

   !> Collective: all of the patch must be covered by faces, on one side of its plane. Inside a body there are
   !> faces on both sides, which cancel.
   subroutine verify(self, communicator, levels, tools, error)
      class(pressure_t), intent(in) :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(in) :: levels(:)
      integer, intent(in) :: tools !< number of tools in the scene
      type(error_t), intent(inout) :: error
      real(wp) :: found, patch
      integer :: axis, b, l
      axis = self%area + minloc(self%upper - self%lower, dim=1) - 1
      found = 0.0_wp
      if (self%is_box()) axis = self%area
      do l = 1, size(levels)
         do b = 1, size(levels(l)%blocks)
            associate (particles => levels(l)%blocks(b)%particles)
               if (self%is_box()) then
                  found = found + sum(norm2(particles%column(:particles%count, axis:axis + 2), dim=2))
               else
                  found = found + sum(particles%column(:particles%count, axis))
               end if
            end associate
         end do
      end do
      found = abs(communicator%sum_real(found))
      if (self%is_box()) then
         if (.not. found > 0.0_wp) call fail(error, exit_input, self%group_text()// &
            ': no surface of a body lies within the box; allowed: a box that holds some')
         return
      end if
      if (self%section%is_flat()) then
         patch = sum(self%upper([1, 3]) - self%lower([1, 3]))*self%section%depth(0.5_wp*(self%lower(1) &
                                                                                         + self%upper(1)))
      else
         patch = product(pack(self%upper - self%lower, self%upper > self%lower))
      end if
      if (abs(found - patch) <= covered*patch) return
      call fail(error, exit_input, self%group_text()//': '//to_text(found, 6)//' m2 of the patch of '// &
                to_text(patch, 6)// &
                ' m2 lie on faces of bodies; allowed: a patch that lies wholly on faces of whole '// &
                'particles, along the grid, or a box around the surface (upper above lower along each axis)')
   end subroutine verify

   !> Add -p A of each particle's share, by the hat functions of the grid, as for a tool's contact force: a
   !> uniform pressure gives a uniform stress.
   pure subroutine add_forces(self, block, table, layout, grid, time, window, tile)
      class(pressure_t), intent(in) :: self
      type(block_t), intent(in) :: block
      type(field_table_t), intent(in) :: table
      type(layout_t), intent(in) :: layout
      type(grid_level_t), intent(in) :: grid
      real(wp), intent(in) :: time, window
      real(wp), intent(inout), contiguous :: tile(:, 0:, 0:, 0:)
      real(wp) :: force(3), now
      integer :: p
      now = self%mean_value(time, window)
      if (abs(now) <= 0.0_wp) return
      do p = 1, block%particles%count
         force = now*self%pull(block%particles%column(p, :))
         if (any(abs(force) > 0.0_wp)) call self%push(block, p, layout, grid, force, tile)
      end do
   end subroutine add_forces

   !> Mean of the given values over a window (s) from a time on, so that a table gives its whole impulse
   !> however long the steps are; without a window the value at that time.
   pure real(wp) function mean_value(self, time, window)
      class(pressure_t), intent(in) :: self
      real(wp), intent(in) :: time, window
      if (window > 0.0_wp) then
         mean_value = integral(self%times, self%values, time, time + window)/window
      else
         mean_value = value_at(self%times, self%values, time)
      end if
   end function mean_value

   !> -p A of a particle's share after displacements with a gradient, which turn and stretch the area.
   pure function force_after(self, column, gradient, time) result(force)
      class(pressure_t), intent(in) :: self
      real(wp), intent(in) :: column(:), gradient(9), time
      real(wp) :: after(size(column)), force(3)
      after = column
      associate (area => after(self%area:self%area + 2))
         area = carried_area(area, gradient)
      end associate
      force = value_at(self%times, self%values, time)*self%pull(after)
   end function force_after

   !> Add a force on the share of a particle to the tile.
   pure subroutine push(self, block, p, layout, grid, force, tile)
      class(pressure_t), intent(in) :: self
      type(block_t), intent(in) :: block
      integer, intent(in) :: p
      type(layout_t), intent(in) :: layout
      type(grid_level_t), intent(in) :: grid
      real(wp), intent(in) :: force(3) !< N
      real(wp), intent(inout), contiguous :: tile(:, 0:, 0:, 0:)
      call add_to_nodes(self%face_of(block, p, layout, grid), force, tile(f_x:f_z, :, :, :))
   end subroutine push

   !> Weights of the nodes on the share of a particle.
   pure type(face_weights_t) function face_of(self, block, p, layout, grid) result(face)
      class(pressure_t), intent(in) :: self
      type(block_t), intent(in) :: block
      integer, intent(in) :: p
      type(layout_t), intent(in) :: layout
      type(grid_level_t), intent(in) :: grid
      real(wp) :: middle(3), place(3), span(3, 3)
      associate (column => block%particles%column, turns => layout%domain > 0)
         call fit_share(fitted_edges(column(p, :), layout, grid%cell), column(p, self%arm:self%arm + 2), &
                        column(p, self%area:self%area + 2), grid%cell, &
                        .not. (turns .or. layout%half_sizes), middle, span)
         place = (column(p, layout%position:layout%position + 2) + middle - block%origin)*grid%per_cell
         where (abs(place - nint(place)) < hair) place = nint(place)
         if (self%section%is_flat()) span(2, :) = 0.0_wp
         call weigh(face, bin_place(int(block%cells%bin(p))), place, span*grid%per_cell, turns)
      end associate
   end function face_of

   !> The force on a particle's share per unit value: -A for a pressure; else the traction times the present
   !> area, if it follows rotated as the normal is from its initial direction (Rodrigues).
   pure function pull(self, column) result(force)
      class(pressure_t), intent(in) :: self
      real(wp), intent(in) :: column(:) !< of the particle
      real(wp) :: force(3)
      real(wp) :: area(3), before(3), spin(3)
      area = column(self%area:self%area + 2)
      force = -area
      if (.not. any(abs(self%traction) > 0.0_wp)) return
      force = self%traction*norm2(area)
      if (.not. self%follows .or. .not. norm2(area) > 0.0_wp) return
      before = 0.0_wp
      before(minloc(self%upper - self%lower, dim=1)) = sign(1.0_wp, column(self%side))
      spin = cross(before, area/norm2(area))
      force = force + cross(spin, force) + cross(spin, cross(spin, force)) &
              /max(1.0_wp + dot_product(before, area)/norm2(area), epsilon(1.0_wp))
   end function pull

   !> Particles with a share of the patch.
   pure function pushed(self, particles) result(which)
      class(pressure_t), intent(in) :: self
      type(particle_store_t), intent(in) :: particles
      integer, allocatable :: which(:)
      integer :: list(particles%count), found, p
      found = 0
      associate (column => particles%column, a => self%area)
         do p = 1, particles%count
            if (.not. abs(column(p, a)) + abs(column(p, a + 1)) + abs(column(p, a + 2)) > 0.0_wp) cycle
            found = found + 1
            list(found) = p
         end do
      end associate
      which = list(:found)
   end function pushed

   !> -p A, the mean of the step's ends, times the displacement of the middle of each share: that of the
   !> centre, and dt L arm.
   pure function particle_work(self, particles, which, layout, gradient, from, way_to, time, time_step, &
                               window) result(work)
      class(pressure_t), intent(in) :: self
      type(particle_store_t), intent(in) :: particles
      integer, intent(in) :: which(:)
      type(layout_t), intent(in) :: layout
      real(wp), intent(in), contiguous :: gradient(:, :), from(:, :)
      integer, intent(in) :: way_to
      real(wp), intent(in) :: time, time_step, window
      real(wp) :: before(size(particles%column, 2)), swept(2), way(3), work(2)
      integer :: i
      swept = 0.0_wp
      do i = 1, size(which)
         associate (column => particles%column, p => which(i), a => self%area)
            way = column(p, way_to:way_to + 2) - from(:, i) &
                  + time_step*matmul(reshape(gradient(p, :), [3, 3]), column(p, self%arm:self%arm + 2))
            before = column(p, :)
            before(a:a + 2) = area_before(column(p, a:a + 2), time_step*gradient(p, :))
            swept = swept + [dot_product(self%pull(before), way), dot_product(self%pull(column(p, :)), way)]
         end associate
      end do
      work(2) = 0.5_wp*self%mean_value(time + time_step, window)*swept(2)
      work(1) = work(2) + 0.5_wp*self%mean_value(time, window)*swept(1)
   end function particle_work

   pure subroutine on_stress(self, particles, layout, gradient, cell, time_step)
      class(pressure_t), intent(in) :: self
      type(particle_store_t), intent(inout) :: particles
      type(layout_t), intent(in) :: layout
      real(wp), intent(in), contiguous :: gradient(:, :)
      real(wp), intent(in) :: cell, time_step
      call carry_faces(particles%column, particles%count, self%area, self%arm, gradient, time_step)
   end subroutine on_stress

end module m_pressure
