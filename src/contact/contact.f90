!> Contact of the bodies with rigid tools and with each other: candidates, contact forces, and their effect on
!> the nodes (theory.md, eqs contact-*).
module m_contact
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use mpi_f08
   use m_kinds, only: wp, i8
   use m_constants, only: exit_numerical
   use m_errors, only: error_t, fail
   use m_text, only: to_text
   use m_scene, only: scene_t, contact_spec_t, hopeless_residual
   use m_tool, only: tool_t, make_tool
   use m_communicator, only: communicator_t
   use m_field_table, only: field_table_t
   use m_level, only: level_t
   use m_scene_materials, only: materials_t
   use m_contact_complaints, only: check_nodes, candidate_text
   use m_face_gap, only: fastest
   use m_candidates, only: candidates_t
   use m_body_pairs, only: body_pairs_t
   use m_pair_reactions, only: find_slip
   use m_contact_point, only: point_velocity, place_of, friction_limit
   use m_vectors, only: cross
   use m_contact_result, only: keep_solution, held_gap
   use m_friction_law, only: has_friction
   use m_friction, only: friction_t
   use m_tool_reactions, only: reaction_t, tool_state_t, accumulate_reactions, add_particle_work, add_up
   use m_contact_system, only: contact_system_t
   use m_contact_rows, only: assemble, move_nodes
   use m_petsc_solver, only: petsc_solver_t
   implicit none
   private
   public :: contact_t

   type :: contact_t
      type(tool_t), allocatable :: tools(:)
      type(tool_state_t), allocatable :: states(:)
      type(contact_spec_t) :: spec
      logical :: strains_apart = .false.    !< the stress has a separate nodal solution ('usf', 'musl'),
      logical :: is_implicit = .false.      !< some steps are
      logical :: strains_next = .false.     !< computed at the beginning of the next step ('usf')
      real(wp), allocatable :: given(:, :)  !< (6, tools): velocities at the origin and spins of the tools in
                                            !< the step, where the stress is updated first; 0 for load-driven
                                            !< ones; m/s, rad/s
      real(wp), allocatable, private :: before(:, :) !< (6, tools): velocities and spins of the tools before
                                                     !< the step, m/s, rad/s
      logical :: has_problem = .false.      !< some rank has candidates in this step
      logical :: followed = .false.         !< the work of the tools is also known from the particles' motion
      type(contact_system_t) :: system
      type(petsc_solver_t) :: solver
      type(candidates_t) :: candidates
      type(body_pairs_t) :: pairs           !< bodies of different groups
      type(friction_t) :: friction
      integer(i8) :: solves = 0, iterations = 0, unsolved = 0
      integer(i8) :: unsolved_in_row = 0    !< consecutive steps with a residual far above the tolerance
      real(wp) :: time = 0.0_wp             !< at which the step began, s
      real(wp) :: step_residual = 0.0_wp    !< largest of a step's problems, relative
      character(len=:), allocatable :: effort !< description of the last solution
      integer(i8) :: largest = 0            !< largest number of candidates in a step, over all ranks
      integer(i8) :: handled = 0            !< candidates of all ranks, over all steps of the program
      real(wp) :: worst_residual = 0.0_wp   !< relative
      real(wp) :: worst_overlap = 0.0_wp    !< m
      real(wp) :: worst_bridge = 0.0_wp !< largest force across a gap, times the gap, over largest force and
                                        !< cell
      type(reaction_t), allocatable :: reactions(:) !< (tools): of a step, on this rank
   contains
      procedure :: build
      procedure :: declare
      procedure :: active
      procedure :: relaxed
      procedure :: apply
      procedure :: follow
      procedure :: finish_step
      procedure :: release
      procedure, private :: solve
      procedure, private :: pose
      procedure, private :: add_adhesion
      procedure, private :: sweep
      procedure, private :: solve_normal
      procedure :: check_convergence
      procedure, private :: check_solution
      procedure :: make_room
   end type contact_t

   real(wp), parameter :: far_above = 100.0_wp !< multiple of the tolerance: above it for this many
                                               !< consecutive steps is an error:
   integer, parameter :: max_unsolved = 10
   integer, parameter :: max_sweeps = 50         !< maximum of alternations between normal forces and friction
                                                 !< in a step
   integer, parameter :: products = 20 !< products of the friction problem for each allowed iteration of the
                                       !< other

contains

   !> Set up the tools at their start, and the pairs of bodies.
   subroutine build(self, scene)
      class(contact_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      integer :: t
      associate (n => size(scene%tools))
         allocate (self%tools(n), self%states(n), self%reactions(n), self%candidates%list(64))
      end associate
      do t = 1, size(scene%tools)
         self%tools(t) = make_tool(scene%tools(t), reshape([scene%grid%lower, scene%grid%upper], [3, 2]))
      end do
      self%spec = scene%contact
      self%is_implicit = scene%quasi_static%present
      allocate (self%candidates%deepest(size(scene%tools)), source=0.0_wp)
      call self%candidates%half_spaces%build(scene)
      allocate (self%given(6, size(scene%tools)), self%before(6, size(scene%tools)), source=0.0_wp)
      call self%pairs%build(scene)
      self%pairs%subcell = scene%contact%subcell
      self%friction%present = any(has_friction(scene%tools%friction)) .or. self%pairs%is_frictional()
   end subroutine build

   !> Declare the fields of contact, which also give the start of the next solve.
   pure subroutine declare(self, table)
      class(contact_t), intent(inout) :: self
      type(field_table_t), intent(inout) :: table
      call table%declare('contact_pressure', 1, 'Pa', written=.true.)
      self%candidates%pressure = table%column('contact_pressure')
      call table%declare('last_contact_pressure', 1, 'Pa', written=.false.)
      self%candidates%earlier = table%column('last_contact_pressure')
      self%candidates%slots = [0]
      if (size(self%tools) == 0) return
      call self%candidates%declare_sheets(self%tools, table, self%is_implicit, self%spec%subcell > 0.0_wp)
      if (self%strains_next) then
         call table%declare('contact_velocity', 3, 'm/s', written=.false.)
         self%candidates%left = table%column('contact_velocity')
      end if
      if (.not. any(has_friction(self%tools%spec%friction))) return
      call table%declare('contact_friction', 3, 'Pa', written=.true.)
      self%candidates%traction = table%column('contact_friction')
      if (self%candidates%deflected == 0) return
      call table%declare('contact_shear_deflection', 3, 'm', written=.false.)
      self%candidates%dragged = table%column('contact_shear_deflection')
   end subroutine declare

   !> True when the scene has tools, or bodies that may come into contact.
   pure logical function active(self)
      class(contact_t), intent(in) :: self
      active = size(self%tools) > 0 .or. self%pairs%active()
   end function active

   !> Energy that laws which relax have dissipated below the cells since the start, J.
   pure real(wp) function relaxed(self)
      class(contact_t), intent(in) :: self
      relaxed = sum(self%states%relaxed) + sum(self%pairs%states%relaxed)
   end function relaxed

   !> Collective: add the contact forces of one step to the solved nodes. On entry `nodes` holds the motion
   !> without contact; tools are at their positions at `time`, until `finish_step`.
   subroutine apply(self, communicator, level, materials, time, time_step, error)
      class(contact_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(inout) :: level
      type(materials_t), intent(in) :: materials
      real(wp), intent(in) :: time, time_step !< s
      type(error_t), intent(inout) :: error
      real(wp), allocatable :: forces(:)
      integer :: c, t
      self%time = time
      do t = 1, size(self%tools)
         self%before(:, t) = [self%tools(t)%velocity, self%tools(t)%spin]
         call self%tools(t)%begin_step(time, time_step)
      end do
      call self%candidates%half_spaces%renew(communicator, level, materials, self%candidates%pressure)
      call self%candidates%find(self%tools, level, materials, time_step, self%states%overlap)
      if (self%pairs%active()) &
         call self%pairs%find(communicator, level, materials, time, time_step, self%candidates)
      call self%make_room(communicator)
      if (.not. self%has_problem) self%candidates%deepest = 0.0_wp
      if (self%has_problem) then
         call assemble(self%system, communicator, self%tools, self%candidates, level, &
                       self%spec%compliance, time_step, &
                       self%spec%subcell > 0.0_wp .and. any(self%candidates%half_spaces%modulus > 0.0_wp))
         call self%solve(level, time_step, error)
         call check_nodes(self%candidates, self%tools, level, error)
         allocate (forces(self%system%rows))
         forces(:self%candidates%count) = self%candidates%list(:self%candidates%count)%force
         do c = 1, self%candidates%count
            associate (it => self%candidates%list(c), last => self%candidates%count &
                       + 2*self%candidates%list(c)%frictional)
               if (it%frictional > 0) forces(last - 1:last) = it%tangential_force
            end associate
         end do
         if (self%pairs%is_frictional()) &
            call find_slip(self%candidates, self%pairs%first, self%system, level, time_step, forces)
         call move_nodes(self%system, level, time_step, forces)
         if (self%strains_apart) call keep_velocities(self%candidates, self%given, level)
      end if
      call accumulate_reactions(self%reactions, self%candidates, self%tools, level, time_step)
      if (self%pairs%active()) &
         call self%pairs%keep(level, materials, self%candidates, time_step, self%candidates%pressure)
   end subroutine apply

   !> Store the velocities of the contact points after a step, for a later stress solution; in the next step
   !> relative to the given velocities of the tools, which may have changed.
   subroutine keep_velocities(candidates, given, level)
      type(candidates_t), intent(inout) :: candidates
      real(wp), intent(in) :: given(:, :) !< (6, tools)
      type(level_t), intent(inout) :: level
      integer :: c
      do c = 1, candidates%count
         associate (it => candidates%list(c), first => candidates%left)
            it%velocity = point_velocity(level, it)
            if (first == 0 .or. it%tool == 0 .or. .not. it%force > 0.0_wp) cycle
            level%blocks(it%block)%particles%column(it%particle, first:first + 2) &
               = it%velocity - given(:3, it%tool) - cross(given(4:, it%tool), place_of(it))
         end associate
      end do
   end subroutine keep_velocities

   !> Collective: whether there is a problem to solve; allocates the solver.
   subroutine make_room(self, communicator)
      class(contact_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      integer :: most(2), unknowns
      unknowns = self%candidates%count
      if (self%strains_apart) unknowns = unknowns + 2*self%candidates%frictional ! all at once
      most = [unknowns, merge(1, 0, unknowns > self%solver%capacity)]
      call MPI_Allreduce(MPI_IN_PLACE, most, size(most), MPI_INTEGER, MPI_MAX, communicator%comm)
      self%has_problem = most(1) > 0
      if (self%has_problem .and. most(2) > 0) &
         call self%solver%fit(communicator%comm%MPI_VAL, 64*((9*unknowns/8)/64 + 1))
   end subroutine make_room

   !> Solve for the forces of the candidates: no tension, no pressure across a gap, no penetration of the
   !> tool; friction where a tool has any.
   subroutine solve(self, level, time_step, error)
      class(contact_t), intent(inout) :: self
      type(level_t), intent(inout) :: level
      real(wp), intent(in) :: time_step
      type(error_t), intent(inout) :: error
      real(wp), dimension(self%candidates%count) :: b, x, w, limit
      integer :: iterations
      logical :: settled
      call self%system%activate(1, self%candidates%count)
      call self%pose(level, time_step, b, x, error)
      call self%add_adhesion(b, x, limit)
      settled = .true.
      self%step_residual = 0.0_wp
      if (self%friction%present) then
         call self%sweep(level, time_step, limit, b, x, settled)
      else
         call self%solve_normal(b, x, iterations)
      end if
      self%solves = self%solves + 1
      if (.not. (settled .and. self%step_residual <= self%spec%tolerance)) self%unsolved = self%unsolved + 1
      call self%system%multiply(x, w)
      call self%check_solution(level, b, x, w, error)
      call keep_solution(self%system, self%candidates, level, time_step, b, x, w, &
                         self%friction%forces_of(self%system), self%worst_bridge)
   end subroutine solve

   !> Adhesion bears a tension up to a limit. The unknowns become forces relative to that limit, which are not
   !> below 0 (theory.md, eq. adhesion); the effect of the limit itself moves to the right-hand side.
   subroutine add_adhesion(self, b, x, limit)
      class(contact_t), intent(inout) :: self
      real(wp), intent(inout) :: b(:), x(:)
      real(wp), intent(out) :: limit(:) !< scaled
      real(wp) :: pulled(size(limit))
      limit = 0.0_wp
      if (.not. self%pairs%adheres()) return
      associate (scale => self%system%scale(:size(limit)))
         where (scale > 0.0_wp) limit = self%candidates%list(:size(limit))%adhesive_tension/scale
      end associate
      call self%system%multiply(limit, pulled)
      b = b + pulled
      x = max(0.0_wp, x + limit)
   end subroutine add_adhesion

   !> Set up the scaled problem of the normal forces: its right-hand side, and the initial forces.
   subroutine pose(self, level, time_step, b, x, error)
      class(contact_t), intent(in) :: self
      type(level_t), intent(in) :: level
      real(wp), intent(in) :: time_step
      real(wp), intent(out) :: b(:), x(:)
      type(error_t), intent(inout) :: error
      integer :: c
      do c = 1, size(b)
         associate (it => self%candidates%list(c), scale => self%system%scale(c))
            b(c) = dot_product(it%normal, it%opposite) - it%speed - held_gap(it)/time_step
            b(c) = b(c)*scale
            x(c) = 0.0_wp
            if (scale > 0.0_wp) x(c) = it%force/scale
            if (ieee_is_finite(b(c)) .and. ieee_is_finite(x(c))) cycle
            b(c) = huge(1.0_wp) ! makes the error visible to all ranks
            x(c) = 0.0_wp
            call fail(error, exit_numerical, candidate_text(it, self%tools, level, self%time)// &
                      ' has a speed or force that is not a number; try a smaller safety', recoverable=.true.)
         end associate
      end do
   end subroutine pose

   !> Solve the problem of the normal forces, and update the statistics.
   subroutine solve_normal(self, b, x, iterations)
      class(contact_t), intent(inout) :: self
      real(wp), intent(in) :: b(:)
      real(wp), intent(inout) :: x(:)
      integer, intent(out) :: iterations
      real(wp) :: residual
      call self%solver%solve(self%system, b, x, self%spec%tolerance, self%spec%max_iterations, iterations, &
                             residual)
      self%iterations = self%iterations + iterations
      call self%check_convergence(residual, to_text(iterations)//' iterations')
   end subroutine solve_normal

   !> Count a problem that did not converge to the tolerance.
   subroutine check_convergence(self, residual, effort)
      class(contact_t), intent(inout) :: self
      real(wp), intent(in) :: residual
      character(len=*), intent(in) :: effort
      self%worst_residual = max(self%worst_residual, residual)
      if (residual <= self%step_residual) return
      self%step_residual = residual
      if (residual > self%spec%tolerance) self%effort = effort
   end subroutine check_convergence

   !> Collective: check that a step's contact forces solve its problem: a hopeless residual is an error at
   !> once, one far above the tolerance if it persists. The message names the point with the largest error.
   subroutine check_solution(self, level, b, x, w, error)
      class(contact_t), intent(inout) :: self
      type(level_t), intent(in) :: level
      real(wp), intent(in) :: b(:), x(:), w(:) !< right-hand side, unknowns, compliance times unknowns; scaled
      type(error_t), intent(inout) :: error
      real(wp) :: off(size(b)), worst
      character(len=:), allocatable :: limit
      self%unsolved_in_row = merge(self%unsolved_in_row + 1, 0_i8, &
                                   self%step_residual > far_above*self%spec%tolerance)
      if (self%step_residual <= hopeless_residual .and. self%unsolved_in_row < max_unsolved) return
      limit = to_text(hopeless_residual)//' is allowed'
      if (self%step_residual <= hopeless_residual) &
         limit = to_text(far_above)//' times the tolerance, '//to_text(self%spec%tolerance)// &
                 ', is allowed in '//to_text(max_unsolved)//' steps running'
      off = merge(abs(w - b), max(0.0_wp, b - w), x > 0.0_wp)
      worst = maxval([-1.0_wp, off])
      if (worst >= self%system%communicator%maximum(worst) .and. size(off) > 0) &
         call fail(error, exit_numerical, &
                   candidate_text(self%candidates%list(maxloc(off, dim=1)), self%tools, level, self%time)// &
                   ': the contact problem was not solved, relative residual '// &
                   to_text(self%step_residual, 3)//' after '//self%effort//', at most '//limit// &
                   '; try a larger max_iterations or a smaller safety', recoverable=.true.)
      call self%system%communicator%agree(error)
   end subroutine check_solution

   !> Alternate between normal forces with fixed friction and friction with fixed normal forces until the
   !> normal problem is solved with the friction that belongs to it (theory.md, eq. friction-sweeps). On
   !> return b includes the effect of friction.
   subroutine sweep(self, level, time_step, limit, b, x, settled)
      class(contact_t), intent(inout) :: self
      type(level_t), intent(in) :: level
      real(wp), intent(in) :: time_step !< s
      real(wp), intent(in) :: limit(:) !< of adhesion, scaled: forces are x minus this
      real(wp), intent(inout) :: b(:), x(:)
      logical, intent(out) :: settled !< converged within the allowed rounds
      real(wp) :: free(size(b)), dragged(size(b)), residual
      real(wp) :: pushed(2*self%candidates%frictional), radius(self%candidates%frictional)
      integer :: c, iterations, n, round, rows
      n = self%candidates%count
      rows = self%system%rows
      free = b
      associate (list => self%candidates%list(:n), scale => self%system%scale)
         call self%friction%begin(self%system, list, level, time_step)
         do round = 1, max_sweeps
            call self%system%respond([n + 1, rows], self%friction%force, [1, n], dragged)
            b = free - dragged
            call self%solve_normal(b, x, iterations)
            if (.not. self%step_residual <= hopeless_residual .or. (round > 1 .and. iterations == 0)) exit
            self%friction%sweeps = self%friction%sweeps + 1
            do c = 1, n
               if (list(c)%frictional == 0) cycle
               list(c)%limit = friction_limit(list(c), self%tools, self%pairs%specs, x(c)*scale(c))
               radius(list(c)%frictional) = merge(list(c)%limit/max(scale(n + 2*list(c)%frictional), &
                  tiny(1.0_wp)), 0.0_wp, scale(n + 2*list(c)%frictional) > 0.0_wp)
            end do
            call self%system%respond([1, n], x - limit, [n + 1, rows], pushed)
            call self%friction%solve(self%system, radius, pushed, self%spec%tolerance, &
                                     products*self%spec%max_iterations, residual)
            call self%check_convergence(residual, to_text(products*self%spec%max_iterations)// &
                                        ' products for friction')
            if (.not. self%step_residual <= hopeless_residual) exit
         end do
         call self%system%activate(1, n)
         settled = round <= max_sweeps
         call self%friction%hand_out(self%system, list)
      end associate
   end subroutine sweep

   !> Add the work of the step's contact forces on the particles of a block pressed by tools, by the
   !> particles' motion in the step.
   pure subroutine follow(self, level, b, gradient, way_to, time_step)
      class(contact_t), intent(inout) :: self
      type(level_t), intent(in) :: level
      integer, intent(in) :: b      !< number of the block
      real(wp), intent(in), contiguous :: gradient(:, :) !< (:, 9), 1/s: L
      integer, intent(in) :: way_to !< first column of the centres at the end of the step
      real(wp), intent(in) :: time_step
      associate (first => self%candidates%before(b) + 1, last => self%candidates%before(b + 1))
         call add_particle_work(self%reactions, self%candidates%list(first:last), &
                                level%blocks(b)%particles%column, gradient, way_to, time_step)
      end associate
   end subroutine follow

   !> Collective, at the end of a step: loads, overlaps and work of the tools; load-driven tools are moved. On
   !> return tools are at their positions at `time`, that of the end.
   subroutine finish_step(self, communicator, level, time, time_step, error)
      class(contact_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(in) :: level
      real(wp), intent(in) :: time, time_step !< s
      type(error_t), intent(inout) :: error
      real(wp) :: velocity(3), spin(3)
      integer(i8) :: candidates
      integer :: t
      call add_up(communicator, self%reactions, self%states%overlap, self%candidates%deepest)
      do t = 1, size(self%tools)
         associate (tool => self%tools(t), now => self%reactions(t))
            velocity = tool%velocity
            spin = tool%spin
            call tool%react(now%load, now%moment, time_step)
            call self%states(t)%accumulate(now, tool, tool%velocity - velocity, tool%spin - spin, time_step)
            if (tool%is_pushed()) call self%states(t)%count_mean_motion(tool, self%before(:, t), time_step)
         end associate
      end do
      if (self%pairs%active()) call self%pairs%add_up(communicator)
      call self%candidates%half_spaces%end_step()
      self%worst_overlap = maxval([self%worst_overlap, self%states%overlap, self%pairs%overlap])
      candidates = nint(sum(self%reactions%candidates) + sum(self%pairs%step%candidates), i8)
      self%largest = max(self%largest, candidates)
      self%handled = self%handled + candidates
      do t = 1, size(self%tools)
         call self%tools(t)%end_step(time, time_step)
         if (.not. self%tools(t)%surface_speed()*time_step <= fastest*level%grid%cell) &
            call fail(error, exit_numerical, 'time '//to_text(time)//' s: the tool '// &
                      self%tools(t)%spec%name//' moves by more than '//to_text(fastest)// &
                      ' cells in a step; try '//trim(merge('a larger mass or smaller loads ', &
                      'a smaller step or slower speeds', self%tools(t)%is_pushed())), recoverable=.true.)
      end do
   end subroutine finish_step

   !> Collective: free PETSc objects.
   subroutine release(self)
      class(contact_t), intent(inout) :: self
      call self%solver%release()
   end subroutine release

end module m_contact
