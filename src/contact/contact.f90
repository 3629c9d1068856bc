!> Contact of the bodies with rigid tools: candidates, contact forces, their effect on the nodes (theory.md, eqs contact-*).
module m_contact
   use mpi_f08
   use m_kinds, only: wp, i8
   use m_constants, only: exit_numerical, block_size
   use m_errors, only: error_t, fail
   use m_text, only: to_text
   use m_scene, only: tool_spec_t, contact_spec_t, hopeless_residual
   use m_tool, only: tool_t, make_tool
   use m_communicator, only: communicator_t
   use m_field_table, only: field_table_t
   use m_level, only: level_t
   use m_materials, only: materials_t
   use m_boundary, only: constrain_nodes
   use m_contact_complaints, only: check_nodes, candidate_text
   use m_candidates, only: candidate_t, candidates_t, drift_of, touches, point_velocity, fastest, recovery
   use m_friction, only: friction_t
   use m_contact_system, only: contact_system_t, nodal_forces_t
   use m_contact_rows, only: assemble, touched_nodes
   use m_petsc_solver, only: petsc_solver_t
   use m_partners, only: partners_t, owners_of
   implicit none
   private
   public :: contact_t, tool_state_t

   !> What one tool felt in the last step, over all ranks.
   type :: tool_state_t
      real(wp) :: load(3) = 0.0_wp      !< on the tool, N, for the modelled part of the body
      real(wp) :: area = 0.0_wp         !< faces of the particles that touch the tool, m2
      real(wp) :: overlap = 0.0_wp      !< deepest place of a contact point inside the tool at the start of the step, m
      real(wp) :: work = 0.0_wp         !< done by the tool since the start, J
      real(wp) :: heat = 0.0_wp         !< made by friction since the start, J
      real(wp) :: constraint_work = 0.0_wp !< done on the bodies by the condition itself, beyond the tool's own, since the start, J
      real(wp) :: particle_work = 0.0_wp !< done on the particles by their own motion since the start, J: work less heat
      real(wp) :: impulse(3) = 0.0_wp   !< given to the bodies since the program began, N s
   end type tool_state_t

   type :: contact_t
      type(tool_t), allocatable :: tools(:)
      type(tool_state_t), allocatable :: states(:)
      type(contact_spec_t) :: spec
      logical :: strains_apart = .false.    !< the stress has a solve of its own ('usf', 'musl')
      logical :: takes_part = .false.       !< this rank does in the step's problem
      logical :: followed = .false.         !< the work of the tools is known by the particles' motion too
      type(contact_system_t) :: system
      type(petsc_solver_t) :: solver
      type(partners_t) :: partners          !< the ranks that solve
      type(candidates_t) :: candidates
      type(friction_t) :: friction
      integer(i8) :: solves = 0, iterations = 0, unsolved = 0
      integer(i8) :: unsolved_in_row = 0    !< steps up to now whose residual was far above the tolerance
      real(wp) :: time = 0.0_wp             !< at which the step began, s
      real(wp) :: step_residual = 0.0_wp    !< largest of a step's problems, relative
      character(len=:), allocatable :: effort !< that was made of the last problem
      integer(i8) :: largest = 0            !< most candidates in a step, over all ranks
      integer(i8) :: handled = 0            !< candidates of all ranks, over all steps since the program began
      real(wp) :: worst_residual = 0.0_wp   !< relative
      real(wp) :: worst_overlap = 0.0_wp    !< m
      real(wp) :: worst_bridge = 0.0_wp     !< largest force that acts across a gap, times the gap: over largest force and cell
      real(wp), allocatable :: felt(:, :)   !< (parts_felt, tools) of a step on this rank: load, N; area, m2; heat, J; candidates;
                                            !< work by the particles' motion, J; work of the constraint, J
   contains
      procedure :: build
      procedure :: declare
      procedure :: active
      procedure :: push
      procedure :: follow
      procedure :: conclude
      procedure :: part
      procedure :: release
      procedure, private :: solve
      procedure, private :: sweep
      procedure, private :: solve_normal
      procedure, private :: leave_gap
      procedure :: judge
      procedure, private :: check_solution
      procedure :: move_nodes
      procedure :: call_partners
      procedure, private :: feel
      procedure, private :: efforts
      procedure, private :: take_efforts
   end type contact_t

   real(wp), parameter :: far_above = 100.0_wp    !< times the tolerance: a residual that is a fault in so many steps running:
   integer, parameter :: most_unsolved = 10
   integer, parameter :: most_sweeps = 50         !< over normal forces and friction in a step
   integer, parameter :: products = 20            !< of the problem of friction, for each iteration that the other is allowed
   integer, parameter :: parts_felt = 8, parts_of_effort = 10

contains

   !> Tools at their start.
   subroutine build(self, tools, spec)
      class(contact_t), intent(inout) :: self
      type(tool_spec_t), intent(in) :: tools(:)
      type(contact_spec_t), intent(in) :: spec
      integer :: t
      allocate (self%tools(size(tools)), self%states(size(tools)), self%felt(parts_felt, size(tools)), &
                self%candidates%list(64))
      do t = 1, size(tools)
         self%tools(t) = make_tool(tools(t))
      end do
      self%spec = spec
      self%friction%present = any(tools%friction > 0.0_wp)
   end subroutine build

   !> The fields that contact adds; they are also where the next solve starts from.
   pure subroutine declare(self, table)
      class(contact_t), intent(inout) :: self
      type(field_table_t), intent(inout) :: table
      call table%declare('contact_pressure', 1, 'Pa', written=.true.)
      self%candidates%pressure = table%column('contact_pressure')
      call table%declare('last_contact_pressure', 1, 'Pa', written=.false.)
      self%candidates%earlier = table%column('last_contact_pressure')
      call table%declare('contact_gap', size(self%tools), 'm', written=.false.)
      self%candidates%carried = table%column('contact_gap')
      if (.not. self%friction%present) return
      call table%declare('contact_friction', 3, 'Pa', written=.true.)
      self%candidates%traction = table%column('contact_friction')
   end subroutine declare

   !> True when the scene has tools.
   pure logical function active(self)
      class(contact_t), intent(in) :: self
      active = size(self%tools) > 0
   end function active

   !> Collective: add the contact forces of one step to the solved nodes. On entry `nodes` holds what they would do
   !> without contact; tools stand where they are at `time`, until `conclude`. Ranks whose nodes no force can reach return at once.
   subroutine push(self, communicator, level, materials, neighbours, time, time_step, error)
      class(contact_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(inout) :: level
      type(materials_t), intent(in) :: materials
      integer, intent(in) :: neighbours(:)    !< ranks, rising
      real(wp), intent(in) :: time, time_step !< s
      type(error_t), intent(inout) :: error
      real(wp), allocatable :: forces(:)
      integer :: c, t
      self%time = time
      do t = 1, size(self%tools)
         call self%tools(t)%begin_step(time, time_step)
      end do
      call self%candidates%find(self%tools, level, materials, time_step, self%states%overlap)
      call self%call_partners(communicator, level, self%takes_part)
      if (self%takes_part) then
         call assemble(self%system, self%partners%communicator, self%partners%numbered(neighbours), self%tools, self%candidates, &
                       level, self%spec%compliance, time_step)
         call self%solve(level, time_step, error)
         call check_nodes(self%candidates, self%tools, level, error)
         allocate (forces(self%system%rows))
         forces(:self%candidates%count) = self%candidates%list(:self%candidates%count)%force
         do c = 1, self%candidates%count
            associate (it => self%candidates%list(c), last => self%candidates%count + 2*self%candidates%list(c)%rubbing)
               if (it%rubbing > 0) forces(last - 1:last) = it%drag
            end associate
         end do
         call self%move_nodes(level, time_step, forces)
      end if
      call self%feel(level, time_step)
   end subroutine push

   !> Collective: whether this rank takes part in the step's problem. It does where contact can push nodes of its tiles, and from
   !> then on until `part`: partners cost more to find than an empty share of the problem.
   subroutine call_partners(self, communicator, level, solves)
      class(contact_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(in) :: level
      logical, intent(out) :: solves
      integer :: bounds(3, 2, size(self%tools)), lacks_room, r
      logical :: needed(0:communicator%ranks - 1)
      integer, allocatable :: most(:)
      call touched_nodes(self%candidates, level, bounds)
      lacks_room = merge(1, 0, self%candidates%count > max(0, self%solver%capacity))
      most = [lacks_room, bounds]
      call MPI_Allreduce(MPI_IN_PLACE, most, size(most), MPI_INTEGER, MPI_MAX, communicator%comm)
      bounds = reshape(most(2:), shape(bounds))
      solves = .false.
      if (all(bounds(:, 2, :) == -huge(bounds))) return
      needed = owners_of(level, communicator%ranks, -bounds(:, 1, :), bounds(:, 2, :))
      if (allocated(self%partners%member)) needed = needed .or. self%partners%member
      if (any(needed .and. .not. [(self%partners%has(r), r=0, communicator%ranks - 1)])) then
         call self%solver%initialise(communicator%comm%MPI_VAL)
         call self%part()
         call self%partners%form(communicator, needed)
      end if
      solves = self%partners%has(communicator%rank)
      if (.not. solves) return
      if (most(1) > 0 .or. self%solver%capacity < 0) &
         call self%solver%fit(self%partners%communicator%comm%MPI_VAL, 64*((9*self%candidates%count/8)/64 + 1))
   end subroutine call_partners

   !> Collective: those who solve are called anew in the next step with contact.
   subroutine part(self)
      class(contact_t), intent(inout) :: self
      call self%solver%dismiss()
      call self%partners%dissolve()
   end subroutine part

   !> Forces of the candidates: no tension, no pressure across a gap, no way into the tool; friction where a tool has any.
   subroutine solve(self, level, time_step, error)
      class(contact_t), intent(inout) :: self
      type(level_t), intent(inout) :: level
      real(wp), intent(in) :: time_step
      type(error_t), intent(inout) :: error
      real(wp), dimension(self%candidates%count) :: b, x, w
      real(wp) :: gap, strongest
      integer :: c, iterations
      logical :: settled
      call self%system%activate(1, self%candidates%count)
      do c = 1, self%candidates%count
         associate (it => self%candidates%list(c))
            b(c) = dot_product(it%normal, self%tools(it%tool)%velocity()) - it%speed &
                   - held_gap(it)/time_step
            b(c) = b(c)*self%system%scale(c)
            x(c) = 0.0_wp
            if (self%system%scale(c) > 0.0_wp) x(c) = it%force/self%system%scale(c)
            if (abs(b(c)) <= huge(1.0_wp) .and. abs(x(c)) <= huge(1.0_wp)) cycle
            b(c) = huge(1.0_wp) ! for all ranks to see
            x(c) = 0.0_wp
            call fail(error, exit_numerical, candidate_text(it, self%tools, level, self%time)// &
                      ' has a speed or force that is not a number; try a smaller safety', may_heal=.true.)
         end associate
      end do
      settled = .true.
      self%step_residual = 0.0_wp
      if (self%friction%present) then
         call self%sweep(level, b, x, settled)
      else
         call self%solve_normal(b, x, iterations)
      end if
      self%solves = self%solves + 1
      if (.not. (settled .and. self%step_residual <= self%spec%tolerance)) self%unsolved = self%unsolved + 1
      call self%system%multiply(x, w)
      call self%check_solution(level, b, x, w, error)
      strongest = self%system%communicator%maximum(maxval([0.0_wp, x*self%system%scale(:size(x))]))
      do c = 1, self%candidates%count
         associate (it => self%candidates%list(c))
            it%force = x(c)*self%system%scale(c)
            gap = 0.0_wp
            if (self%system%scale(c) > 0.0_wp) gap = max(0.0_wp, (w(c) - b(c))/self%system%scale(c)*time_step)
            it%touches = max(x(c), w(c)) > 0.0_wp .and. touches(it, self%tools, level, gap) ! no force, no touch
            if (it%force > 0.0_wp) self%worst_bridge = max(self%worst_bridge, it%force*gap/(strongest*level%grid%cell))
            level%blocks(it%block)%particles%column(it%particle, self%candidates%pressure) = it%force/it%area
            if ((it%force > 0.0_wp .or. it%carried) .and. self%system%scale(c) > 0.0_wp) &
               call self%leave_gap(level, it, time_step, (w(c) - b(c))/self%system%scale(c))
            if (it%rubbing > 0) then
               associate (first => self%candidates%traction)
                  level%blocks(it%block)%particles%column(it%particle, first:first + 2) = matmul(it%tangent, it%drag)/it%area
               end associate
            end if
         end associate
      end do
   end subroutine solve

   !> The gap that the condition holds open: of an overlap no more than is taken back in a step, m.
   pure real(wp) function held_gap(c)
      type(candidate_t), intent(in) :: c
      held_gap = max(c%gap, -recovery*sqrt(c%area))
   end function held_gap

   !> Where the nodes leave a point that is pressed, or was: its gap is carried on from there.
   subroutine leave_gap(self, level, c, time_step, speed)
      class(contact_t), intent(in) :: self
      type(level_t), intent(inout) :: level
      type(candidate_t), intent(inout) :: c
      real(wp), intent(in) :: time_step !< s
      real(wp), intent(in) :: speed     !< at which the gap that is held opens, with the give of the compliance, m/s
      c%opening = speed - self%spec%compliance*time_step/c%mass*c%force - held_gap(c)/time_step
      associate (gap => level%blocks(c%block)%particles%column(c%particle, self%candidates%carried + c%tool - 1))
         gap = c%gap + time_step*c%opening
         if (.not. abs(gap) > 0.0_wp) gap = tiny(gap) ! 0 says that none is carried
      end associate
      level%blocks(c%block)%pressed = .true.
   end subroutine leave_gap

   !> The problem of the normal forces, and its share of the statistics.
   subroutine solve_normal(self, b, x, iterations)
      class(contact_t), intent(inout) :: self
      real(wp), intent(in) :: b(:)
      real(wp), intent(inout) :: x(:)
      integer, intent(out) :: iterations
      real(wp) :: residual
      call self%solver%solve(self%system, b, x, self%spec%tolerance, self%spec%max_iterations, iterations, residual)
      self%iterations = self%iterations + iterations
      call self%judge(residual, to_text(iterations)//' iterations')
   end subroutine solve_normal

   !> Count a problem that did not come below the tolerance.
   subroutine judge(self, residual, effort)
      class(contact_t), intent(inout) :: self
      real(wp), intent(in) :: residual
      character(len=*), intent(in) :: effort
      self%worst_residual = max(self%worst_residual, residual)
      if (residual <= self%step_residual) return
      self%step_residual = residual
      if (residual > self%spec%tolerance) self%effort = effort
   end subroutine judge

   !> Collective: a step's contact forces must solve its problem: a residual without hope is a fault at once, one far above the
   !> tolerance when it lasts. Names where the forces are furthest from the solution.
   subroutine check_solution(self, level, b, x, w, error)
      class(contact_t), intent(inout) :: self
      type(level_t), intent(in) :: level
      real(wp), intent(in) :: b(:), x(:), w(:) !< right-hand side, unknowns, compliance times unknowns; scaled
      type(error_t), intent(inout) :: error
      real(wp) :: off(size(b)), worst
      character(len=:), allocatable :: limit
      self%unsolved_in_row = merge(self%unsolved_in_row + 1, 0_i8, self%step_residual > far_above*self%spec%tolerance)
      if (self%step_residual <= hopeless_residual .and. self%unsolved_in_row < most_unsolved) return
      limit = to_text(hopeless_residual)//' is allowed'
      if (self%step_residual <= hopeless_residual) &
         limit = to_text(far_above)//' times the tolerance, '//to_text(self%spec%tolerance)//', is allowed in '// &
                 to_text(most_unsolved)//' steps running'
      off = merge(abs(w - b), max(0.0_wp, b - w), x > 0.0_wp)
      worst = maxval([-1.0_wp, off])
      if (worst >= self%system%communicator%maximum(worst) .and. size(off) > 0) &
         call fail(error, exit_numerical, &
                   candidate_text(self%candidates%list(maxloc(off, dim=1)), self%tools, level, self%time)// &
                   ': the contact problem was not solved, relative residual '//to_text(self%step_residual, 3)//' after '// &
                   self%effort//', at most '//limit//'; try a larger max_iterations or a smaller safety', may_heal=.true.)
      call self%system%communicator%agree(error)
   end subroutine check_solution

   !> Normal forces with the friction held, and friction with the normal forces held, in turn until the normal problem is solved
   !> with the friction that belongs to it (theory.md, eq. friction-sweeps). On return b holds what the friction does to it.
   subroutine sweep(self, level, b, x, settled)
      class(contact_t), intent(inout) :: self
      type(level_t), intent(in) :: level
      real(wp), intent(inout) :: b(:), x(:)
      logical, intent(out) :: settled !< in as many rounds as are allowed
      real(wp) :: free(size(b)), dragged(size(b)), pushed(2*self%candidates%rubbing), radius(self%candidates%rubbing), residual
      integer :: c, iterations, n, round, rows
      n = self%candidates%count
      rows = self%system%rows
      free = b
      associate (list => self%candidates%list(:n), scale => self%system%scale)
         call self%friction%begin(self%system, list, self%tools, level)
         do round = 1, most_sweeps
            call self%system%respond([n + 1, rows], self%friction%force, [1, n], dragged)
            b = free - dragged
            call self%solve_normal(b, x, iterations)
            if (.not. self%step_residual <= hopeless_residual .or. (round > 1 .and. iterations == 0)) exit
            self%friction%sweeps = self%friction%sweeps + 1
            do c = 1, n
               if (list(c)%rubbing == 0) cycle
               radius(list(c)%rubbing) = 0.0_wp
               if (scale(n + 2*list(c)%rubbing) > 0.0_wp) radius(list(c)%rubbing) = &
                  self%tools(list(c)%tool)%spec%friction*x(c)*scale(c)/scale(n + 2*list(c)%rubbing)
            end do
            call self%system%respond([1, n], x, [n + 1, rows], pushed)
            call self%friction%solve(self%system, radius, pushed, self%spec%tolerance, products*self%spec%max_iterations, residual)
            call self%judge(residual, to_text(products*self%spec%max_iterations)//' products for friction')
            if (.not. self%step_residual <= hopeless_residual) exit
         end do
         call self%system%activate(1, n)
         settled = round <= most_sweeps
         call self%friction%hand_out(self%system, list)
      end associate
   end subroutine sweep

   !> Collective among neighbours: change velocity and acceleration of the nodes that contact forces act on, in every tile here that
   !> has them, and then of their mirror images.
   subroutine move_nodes(self, level, time_step, forces)
      class(contact_t), intent(inout) :: self
      type(level_t), intent(inout) :: level
      real(wp), intent(in) :: time_step
      real(wp), intent(in) :: forces(:) !< (rows of the system), N
      type(nodal_forces_t), allocatable :: parts(:)
      logical :: changed(size(level%blocks))
      integer :: b, n, r
      call self%system%activate(1, self%system%rows)
      call self%system%nodal_forces(forces, parts)
      changed = .false.
      do r = 1, size(parts)
         do n = 1, size(parts(r)%node)
            call push_node(level, self%system%place_of(parts(r)%node(n)), parts(r)%force(:3, n), time_step, changed)
         end do
      end do
      do b = 1, size(level%blocks)
         if (changed(b)) call constrain_nodes(level%grid, level%blocks(b)%place, level%nodes(:, :, :, :, b))
      end do
   end subroutine move_nodes

   !> Add a force to a node in all tiles here that have it: its block's, and those of the blocks next to it if it is on their rim.
   pure subroutine push_node(level, place, force, time_step, changed)
      type(level_t), intent(inout) :: level
      integer, intent(in) :: place(3)
      real(wp), intent(in) :: force(3), time_step
      logical, intent(inout) :: changed(:)
      integer :: at(3), block(3), home(3), i, j, k, low(3), high(3), slot
      home = (place - modulo(place, block_size))/block_size
      low = home - merge(1, 0, modulo(place, block_size) == 0)
      high = home + merge(1, 0, modulo(place, block_size) == block_size - 1)
      do k = low(3), high(3)
         do j = low(2), high(2)
            do i = low(1), high(1)
               block = [i, j, k]
               if (any(block < 0) .or. any(block >= level%grid%blocks)) cycle
               slot = level%slot(i, j, k)
               if (slot == 0 .or. slot > size(level%blocks)) cycle
               at = place - block_size*block + 1
               associate (node => level%nodes(:, at(1), at(2), at(3), slot))
                  if (node(1) <= 0.0_wp) cycle
                  node(5:7) = node(5:7) + force/node(1)
                  node(2:4) = node(2:4) + time_step*force/node(1)
               end associate
               changed(slot) = .true.
            end do
         end do
      end do
   end subroutine push_node

   !> What the tools feel of this rank's candidates, and what friction takes from the motion by how the contact points slip at the
   !> step's end.
   subroutine feel(self, level, time_step)
      class(contact_t), intent(inout) :: self
      type(level_t), intent(in) :: level
      real(wp), intent(in) :: time_step
      integer :: c
      self%felt = 0.0_wp
      do c = 1, self%candidates%count
         associate (it => self%candidates%list(c), felt => self%felt(:, self%candidates%list(c)%tool))
            felt(1:3) = felt(1:3) - it%force*it%normal
            if (it%touches) felt(4) = felt(4) + it%area
            felt(6) = felt(6) + 1.0_wp
            felt(8) = felt(8) + time_step*it%force*it%opening
            if (self%strains_apart) it%velocity = point_velocity(level, it)
            if (it%rubbing == 0) cycle
            felt(1:3) = felt(1:3) - matmul(it%tangent, it%drag)
            felt(5) = felt(5) - time_step*dot_product(matmul(it%tangent, it%drag), &
                                                      point_velocity(level, it) - self%tools(it%tool)%velocity())
         end associate
      end do
   end subroutine feel

   !> What the forces of the step do on the particles of a block that the tools press, by the motion that these have just made: that of
   !> the centre, and dt L arm.
   pure subroutine follow(self, level, b, gradient, way_to, time_step)
      class(contact_t), intent(inout) :: self
      type(level_t), intent(in) :: level
      integer, intent(in) :: b      !< number of the block
      real(wp), intent(in), contiguous :: gradient(:, :) !< (:, 9), 1/s: L
      integer, intent(in) :: way_to !< first column of the centres at the end of the step
      real(wp), intent(in) :: time_step
      real(wp) :: force(3), way(3)
      integer :: c
      do c = self%candidates%before(b) + 1, self%candidates%before(b + 1)
         associate (it => self%candidates%list(c), column => level%blocks(b)%particles%column)
            force = it%force*it%normal
            if (it%rubbing > 0) force = force + matmul(it%tangent, it%drag)
            way = column(it%particle, way_to:way_to + 2) - it%from + drift_of(it)*it%normal &
                  + time_step*matmul(reshape(gradient(it%particle, :), [3, 3]), it%arm)
            self%felt(7, it%tool) = self%felt(7, it%tool) + dot_product(force, way)
         end associate
      end do
   end subroutine follow

   !> Collective, at the end of a step: loads, areas, overlaps and work of the tools; loads move those that are pushed. On return
   !> tools stand where they are at `time`, that of the end.
   subroutine conclude(self, communicator, level, time, time_step, error)
      class(contact_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(in) :: level
      real(wp), intent(in) :: time, time_step !< s
      type(error_t), intent(inout) :: error
      real(wp) :: sums(parts_felt, size(self%tools)), deepest(size(self%tools)), told(parts_of_effort)
      real(wp), allocatable :: both(:)
      integer :: t
      deepest = self%states%overlap
      told = 0.0_wp
      if (self%partners%has(communicator%rank) .and. self%partners%communicator%is_root()) told = self%efforts()
      both = [self%felt, told]
      call MPI_Allreduce(MPI_IN_PLACE, both, size(both), MPI_DOUBLE_PRECISION, MPI_SUM, communicator%comm)
      call MPI_Allreduce(MPI_IN_PLACE, deepest, size(deepest), MPI_DOUBLE_PRECISION, MPI_MAX, communicator%comm)
      sums = reshape(both(:size(sums)), shape(sums))
      do t = 1, size(self%tools)
         associate (state => self%states(t))
            state%load = sums(1:3, t)
            state%area = sums(4, t)
            state%overlap = deepest(t)
            state%heat = state%heat + sums(5, t)
            state%particle_work = state%particle_work + sums(7, t)
            state%constraint_work = state%constraint_work + sums(8, t)
            call self%tools(t)%react(state%load, time_step)
            state%work = state%work - time_step*dot_product(state%load, self%tools(t)%velocity())
            state%impulse = state%impulse - time_step*state%load
         end associate
      end do
      self%worst_overlap = max(self%worst_overlap, maxval(deepest))
      self%largest = max(self%largest, nint(sum(sums(6, :)), i8))
      self%handled = self%handled + nint(sum(sums(6, :)), i8)
      if (any(sums(6, :) > 0.0_wp)) call self%take_efforts(both(size(sums) + 1:))
      do t = 1, size(self%tools)
         call self%tools(t)%end_step(time, time_step)
         if (.not. abs(self%tools(t)%speed)*time_step <= fastest*level%grid%cell) &
            call fail(error, exit_numerical, 'time '//to_text(time)//' s: the tool '//self%tools(t)%spec%name// &
                      ' moves by more than '//to_text(fastest)//' cells in a step; try '// &
                      trim(merge('a larger mass or smaller loads ', 'a smaller step or slower speeds', &
                                 self%tools(t)%is_pushed())), may_heal=.true.)
      end do
   end subroutine conclude

   !> How many problems there were and what they took, as one of those who solve knows it, for those who did not.
   pure function efforts(self)
      class(contact_t), intent(in) :: self
      real(wp) :: efforts(parts_of_effort)
      efforts(:7) = real([self%solves, self%iterations, self%unsolved, self%unsolved_in_row, self%system%products, &
                          self%friction%sweeps, self%friction%iterations], wp)
      efforts(8:) = [self%step_residual, self%worst_residual, self%friction%steepest]
   end function efforts

   !> Take what `efforts` says.
   pure subroutine take_efforts(self, efforts)
      class(contact_t), intent(inout) :: self
      real(wp), intent(in) :: efforts(parts_of_effort)
      self%solves = nint(efforts(1), i8)
      self%iterations = nint(efforts(2), i8)
      self%unsolved = nint(efforts(3), i8)
      self%unsolved_in_row = nint(efforts(4), i8)
      self%system%products = nint(efforts(5), i8)
      self%friction%sweeps = nint(efforts(6), i8)
      self%friction%iterations = nint(efforts(7), i8)
      self%step_residual = efforts(8)
      self%worst_residual = efforts(9)
      self%friction%steepest = efforts(10)
   end subroutine take_efforts

   !> Collective: free what PETSc holds.
   subroutine release(self)
      class(contact_t), intent(inout) :: self
      call self%solver%release()
      call self%partners%dissolve()
   end subroutine release

end module m_contact
