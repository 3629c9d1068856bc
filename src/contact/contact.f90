!> Contact of the bodies with rigid tools: candidates, contact forces, their effect on the nodes (theory.md, eqs contact-*).
module m_contact
   use mpi_f08
   use m_kinds, only: wp, i8
   use m_constants, only: exit_numerical, block_size
   use m_errors, only: error_t, fail
   use m_text, only: to_text
   use m_scene, only: tool_spec_t, contact_spec_t, boundary_symmetry
   use m_tool, only: tool_t, make_tool
   use m_communicator, only: communicator_t
   use m_field_table, only: field_table_t
   use m_level, only: level_t
   use m_materials, only: materials_t
   use m_grid_level, only: grid_level_t
   use m_boundary, only: held_components, constrain_nodes
   use m_stencil, only: bin_place, hat_weights
   use m_contact_system, only: contact_system_t, nodal_forces_t, cell_nodes
   use m_petsc_solver, only: petsc_solver_t
   implicit none
   private
   public :: contact_t, tool_state_t

   !> What one tool felt in the last step, over all ranks.
   type :: tool_state_t
      real(wp) :: load(3) = 0.0_wp      !< on the tool, N, for the modelled part of the body
      real(wp) :: area = 0.0_wp         !< faces of the particles that touch the tool, m2
      real(wp) :: overlap = 0.0_wp      !< deepest place of a contact point inside the tool at the start of the step, m
      real(wp) :: work = 0.0_wp         !< done by the tool since the start, J
   end type tool_state_t

   !> A particle that would end the step inside a tool, or within a margin of it.
   type :: candidate_t
      integer :: block = 0, particle = 0, tool = 0
      integer :: corner(3) = 0            !< lowest node of the cell that holds its contact point, in the block, from 0
      real(wp) :: weight(0:1, 3) = 0.0_wp !< of its contact point on the nodes of that cell, by axis
      real(wp) :: normal(3) = 0.0_wp      !< outward from the tool
      real(wp) :: facing(3) = 0.0_wp      !< the same, mirrored where the contact point has been folded back at a symmetry plane
      real(wp) :: gap = 0.0_wp   !< of its contact point now, m
      real(wp) :: area = 0.0_wp  !< m2
      real(wp) :: mass = 1.0_wp  !< kg
      real(wp) :: force = 0.0_wp !< N
      logical :: touches = .false. !< its contact point ends the step on the tool
   end type candidate_t

   type :: contact_t
      type(tool_t), allocatable :: tools(:)
      type(tool_state_t), allocatable :: states(:)
      type(contact_spec_t) :: spec
      type(contact_system_t) :: system
      type(petsc_solver_t) :: solver
      type(candidate_t), allocatable :: candidates(:)
      integer :: count = 0
      integer :: pressure = 0               !< column of the contact pressure
      integer(i8) :: solves = 0, iterations = 0, unsolved = 0
      integer(i8) :: largest = 0            !< most candidates in a step, over all ranks
      real(wp) :: worst_residual = 0.0_wp   !< relative
      real(wp) :: worst_overlap = 0.0_wp    !< m
      real(wp) :: worst_bridge = 0.0_wp     !< largest force that acts across a gap, times the gap: over largest force and cell
   contains
      procedure :: build
      procedure :: declare
      procedure :: active
      procedure :: push
      procedure :: release
      procedure, private :: find
      procedure, private :: assemble
      procedure, private :: solve
      procedure, private :: move_nodes
      procedure, private :: sum_up
   end type contact_t

   real(wp), parameter :: fastest = 0.4_wp        !< no contact point comes nearer by more cells in a step: the largest safety
   real(wp), parameter :: margin = 0.05_wp        !< candidates come in this far before they touch, in particle edges
   real(wp), parameter :: recovery = 0.01_wp      !< overlap is taken back by at most this much a step, in particle edges
   real(wp), parameter :: touching = 1.0e-4_wp    !< a smaller gap counts as contact, in particle edges
   real(wp), parameter :: hopeless = 1.0e-3_wp    !< a relative residual above this stops the run

contains

   !> Tools at their start.
   subroutine build(self, tools, spec)
      class(contact_t), intent(inout) :: self
      type(tool_spec_t), intent(in) :: tools(:)
      type(contact_spec_t), intent(in) :: spec
      integer :: t
      self%tools = [(make_tool(tools(t)), t=1, size(tools))]
      allocate (self%states(size(tools)), self%candidates(64))
      self%spec = spec
   end subroutine build

   !> The field that contact adds; it is also where the next solve starts from.
   pure subroutine declare(self, table)
      class(contact_t), intent(inout) :: self
      type(field_table_t), intent(inout) :: table
      call table%declare('contact_pressure', 1, 'Pa', written=.true.)
      self%pressure = table%column('contact_pressure')
   end subroutine declare

   !> True when the scene has tools.
   pure logical function active(self)
      class(contact_t), intent(in) :: self
      active = size(self%tools) > 0
   end function active

   !> Collective: add the contact forces of one step to the solved nodes. On entry `solved` holds what the nodes would do
   !> without contact; tools stand where they are at `time`, and on return where they are at time + time_step.
   subroutine push(self, communicator, level, materials, neighbours, time, time_step, error)
      class(contact_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(inout) :: level
      type(materials_t), intent(in) :: materials
      integer, intent(in) :: neighbours(:)    !< ranks, rising
      real(wp), intent(in) :: time, time_step !< s
      type(error_t), intent(inout) :: error
      integer :: t, needs(2)
      do t = 1, size(self%tools)
         self%tools(t)%speed = self%tools(t)%travel_between(time, time + time_step)/time_step
      end do
      call self%find(level, materials, time_step)
      needs = [self%count, merge(1, 0, self%count > self%solver%capacity)]
      call MPI_Allreduce(MPI_IN_PLACE, needs, 2, MPI_INTEGER, MPI_SUM, communicator%comm)
      if (needs(1) > 0) then
         self%largest = max(self%largest, int(needs(1), i8))
         if (needs(2) > 0) call self%solver%fit(communicator%comm%MPI_VAL, 64*((3*self%count/2)/64 + 1))
         call self%assemble(communicator, level, neighbours, time_step)
         call self%solve(level, time_step, error)
         call self%move_nodes(level, time_step)
      end if
      call self%sum_up(communicator, time_step)
      do t = 1, size(self%tools)
         self%tools(t)%travel = self%tools(t)%travel_between(0.0_wp, time + time_step)
      end do
   end subroutine push

   !> Candidates: contact points (centres moved towards the tool by penetration_factor of the particle's present thickness
   !> along the normal) that the free motion would carry into a tool, or almost. Their last pressures become the start of the solve.
   subroutine find(self, level, materials, time_step)
      class(contact_t), intent(inout) :: self
      type(level_t), intent(inout) :: level
      type(materials_t), intent(in) :: materials
      real(wp), intent(in) :: time_step
      real(wp) :: middle(3), gap, normal(3), reach, edge
      integer :: b, bin, l, n, t
      self%count = 0
      self%states%overlap = 0.0_wp
      reach = (0.5_wp*sqrt(3.0_wp) + fastest)*level%grid%cell
      do b = 1, size(level%blocks)
         if (level%blocks(b)%particles%count == 0) cycle
         if (.not. near_tool(self%tools, level, level%blocks(b)%place)) cycle
         associate (block => level%blocks(b))
            edge = 2.0_wp*maxval(block%particles%column(:block%particles%count, level%layout%half_size))
            do t = 1, size(self%tools)
               do bin = 1, size(block%cells%first) - 1
                  if (block%cells%first(bin) == block%cells%first(bin + 1)) cycle
                  middle = block%origin + bin_place(bin)*level%grid%cell
                  call self%tools(t)%gap_and_normal(middle, gap, normal)
                  if (gap > reach + edge) cycle
                  do l = block%cells%first(bin), block%cells%first(bin + 1) - 1
                     call consider(self, level, materials, time_step, b, int(block%cells%order(l)), bin, t)
                  end do
               end do
            end do
            n = block%particles%count
            block%particles%column(:n, self%pressure) = 0.0_wp
         end associate
      end do
   end subroutine find

   !> Keep a particle of a bin as a candidate if the free motion would carry it into the tool, or almost.
   subroutine consider(self, level, materials, time_step, b, p, bin, tool)
      class(contact_t), intent(inout) :: self
      type(level_t), intent(in) :: level
      type(materials_t), intent(in) :: materials
      real(wp), intent(in) :: time_step
      integer, intent(in) :: b, p, bin, tool
      type(candidate_t) :: c
      real(wp) :: edge, thickness, position(3)
      integer :: m
      associate (block => level%blocks(b), column => level%blocks(b)%particles%column, at => level%layout)
         position = column(p, at%position:at%position + 2)
         call self%tools(tool)%gap_and_normal(position, c%gap, c%normal)
         edge = 2.0_wp*column(p, at%half_size)
         if (c%gap > edge + fastest*level%grid%cell) return
         m = materials%of_body(block%particles%body(p))
         thickness = edge*materials%slots(m)%law%stretch(column(p, :), at, c%normal)
         c%gap = c%gap - self%tools(tool)%spec%penetration_factor*thickness
         if (c%gap > fastest*level%grid%cell) return
         self%states(tool)%overlap = max(self%states(tool)%overlap, -c%gap)
         c%block = b
         c%particle = p
         c%tool = tool
         position = position - self%tools(tool)%spec%penetration_factor*thickness*c%normal
         call set_cell(c, level%grid, block%place, bin_place(bin), (position - block%origin)*level%grid%per_cell)
         if (c%gap + time_step*(normal_speed(level, c) - dot_product(c%normal, self%tools(tool)%velocity())) > margin*edge) return
         c%area = edge**2
         c%mass = column(p, at%mass)
         c%force = column(p, self%pressure)*c%area
         call keep(self, c)
      end associate
   end subroutine consider

   !> Append a candidate to the list.
   subroutine keep(self, candidate)
      class(contact_t), intent(inout) :: self
      type(candidate_t), intent(in) :: candidate
      type(candidate_t), allocatable :: more(:)
      if (self%count == size(self%candidates)) then
         allocate (more(2*self%count))
         more(:self%count) = self%candidates
         call move_alloc(more, self%candidates)
      end if
      self%count = self%count + 1
      self%candidates(self%count) = candidate
   end subroutine keep

   !> True when a bin of the block at a place can hold a candidate. The same on every rank.
   pure logical function near_tool(tools, level, place)
      type(tool_t), intent(in) :: tools(:)
      type(level_t), intent(in) :: level
      integer, intent(in) :: place(3)
      real(wp) :: centre(3), gap, normal(3), reach
      integer :: t
      near_tool = .false.
      centre = level%grid%block_origin(place) + 0.5_wp*(block_size - 1)*level%grid%cell
      reach = (0.5_wp*block_size*sqrt(3.0_wp) + 1.5_wp)*level%grid%cell
      do t = 1, size(tools)
         call tools(t)%gap_and_normal(centre, gap, normal)
         if (gap < reach) near_tool = .true.
      end do
   end function near_tool

   !> The cell around a contact point and the hat functions of its nodes there. The traction acts at the contact point, on the
   !> face of the particle: its nodes are those of a point there, not of the particle's volume. A uniform pressure then makes a
   !> uniform stress, wherever the surface stands in its cell (theory.md, eq. contact-nodes). A point beyond a symmetry plane is
   !> the mirror image of one inside, with the mirrored normal.
   pure subroutine set_cell(c, grid, block, node, place)
      type(candidate_t), intent(inout) :: c
      type(grid_level_t), intent(in) :: grid
      integer, intent(in) :: block(3)  !< place of the block
      integer, intent(in) :: node(3)   !< in the middle of the particle's bin, from 0
      real(wp), intent(in) :: place(3) !< of the contact point, in cells from the block's first node
      real(wp) :: folded(3), beyond
      integer :: axis, side
      c%facing = c%normal
      folded = place
      do axis = 1, 3
         do side = 1, 2
            if (grid%boundary(side, axis) /= boundary_symmetry) cycle
            beyond = place(axis) + block_size*block(axis) - merge(0, grid%cells(axis), side == 1)
            if (merge(beyond >= 0.0_wp, beyond <= 0.0_wp, side == 1)) cycle
            folded(axis) = place(axis) - 2.0_wp*beyond
            c%facing(axis) = -c%normal(axis)
         end do
      end do
      call hat_weights(node, folded, c%corner, c%weight)
   end subroutine set_cell

   !> Speed along the normal that a contact point gets from the solved nodes, m/s.
   pure real(wp) function normal_speed(level, c) result(speed)
      type(level_t), intent(in) :: level
      type(candidate_t), intent(in) :: c
      real(wp) :: weight
      integer :: i, j, k
      speed = 0.0_wp
      do k = 0, 1
         do j = 0, 1
            do i = 0, 1
               weight = c%weight(i, 1)*c%weight(j, 2)*c%weight(k, 3)
               speed = speed + weight*dot_product(c%facing, level%solved(2:4, c%corner(1) + 1 + i, c%corner(2) + 1 + j, &
                                                                         c%corner(3) + 1 + k, c%block))
            end do
         end do
      end do
   end function normal_speed

   !> The operator of this step's candidates.
   subroutine assemble(self, communicator, level, neighbours, time_step)
      class(contact_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(in) :: level
      integer, intent(in) :: neighbours(:)
      real(wp), intent(in) :: time_step
      integer :: c, i, j, k, s, node(cell_nodes), at(3)
      real(wp) :: weight(cell_nodes), mass
      logical :: held(3)
      call self%system%begin(communicator)
      do c = 1, self%count
         s = 0
         do k = 0, 1
            do j = 0, 1
               do i = 0, 1
                  s = s + 1
                  call image_node(level, self%candidates(c), [i, j, k], node(s), at, held)
                  associate (it => self%candidates(c))
                     weight(s) = it%weight(i, 1)*it%weight(j, 2)*it%weight(k, 3)
                  end associate
               end do
            end do
         end do
         call self%system%add_candidate(node, weight, self%candidates(c)%facing)
      end do
      call self%system%number_nodes()
      do c = 1, self%count
         s = 0
         do k = 0, 1
            do j = 0, 1
               do i = 0, 1
                  s = s + 1
                  call image_node(level, self%candidates(c), [i, j, k], node(s), at, held)
                  mass = level%solved(1, at(1), at(2), at(3), self%candidates(c)%block)
                  self%system%mobility(:, self%system%node(s, c)) = 0.0_wp
                  if (mass > 0.0_wp) self%system%mobility(:3, self%system%node(s, c)) = merge(0.0_wp, time_step/mass, held)
               end do
            end do
         end do
      end do
      call self%system%connect(neighbours)
      call self%system%set_scale(self%spec%compliance*time_step/self%candidates(:self%count)%mass)
   end subroutine assemble

   !> The node that stands for a candidate's node: itself, or its mirror inside a symmetry plane where the contact point lies on
   !> the plane and the node beyond has no weight. `node` is its number in the grid (nodes from -1 to cells + 1), `at` its place in
   !> the block's tile.
   pure subroutine image_node(level, c, offset, node, at, held)
      type(level_t), intent(in) :: level
      type(candidate_t), intent(in) :: c
      integer, intent(in) :: offset(3)
      integer, intent(out) :: node, at(3)
      logical, intent(out) :: held(3)
      integer :: place(3), image(3)
      logical :: turned(3)
      place = block_size*level%blocks(c%block)%place + c%corner + offset
      call held_components(level%grid, place, held, turned, image)
      at = image - block_size*level%blocks(c%block)%place + 1
      associate (n => level%grid%cells + 3)
         node = image(1) + 2 + n(1)*(image(2) + 1 + n(2)*(image(3) + 1))
      end associate
   end subroutine image_node

   !> Place in the grid of a node that image_node has numbered.
   pure function node_place(level, node) result(place)
      type(level_t), intent(in) :: level
      integer, intent(in) :: node
      integer :: place(3)
      associate (n => level%grid%cells + 3)
         place = [mod(node - 1, n(1)), mod((node - 1)/n(1), n(2)), (node - 1)/(n(1)*n(2))] - 1
      end associate
   end function node_place

   !> Forces of the candidates: no tension, no pressure across a gap, no way into the tool.
   subroutine solve(self, level, time_step, error)
      class(contact_t), intent(inout) :: self
      type(level_t), intent(inout) :: level
      real(wp), intent(in) :: time_step
      type(error_t), intent(inout) :: error
      real(wp) :: b(self%count), x(self%count), w(self%count), residual, gap, strongest
      integer :: c, iterations
      do c = 1, self%count
         associate (it => self%candidates(c))
            b(c) = dot_product(it%normal, self%tools(it%tool)%velocity()) - normal_speed(level, it) &
                   - max(it%gap, -recovery*sqrt(it%area))/time_step
            b(c) = b(c)*self%system%scale(c)
            x(c) = 0.0_wp
            if (self%system%scale(c) > 0.0_wp) x(c) = it%force/self%system%scale(c)
         end associate
      end do
      call self%solver%solve(self%system, b, x, self%spec%tolerance, self%spec%max_iterations, iterations, residual)
      self%solves = self%solves + 1
      self%iterations = self%iterations + iterations
      self%worst_residual = max(self%worst_residual, residual)
      if (residual > self%spec%tolerance) self%unsolved = self%unsolved + 1
      if (.not. residual <= hopeless) call fail(error, exit_numerical, 'the contact problem was not solved: relative residual '// &
                to_text(residual)//' after '//to_text(iterations)//' iterations; try a larger max_iterations or a smaller safety')
      call self%system%multiply(x, w)
      strongest = self%system%communicator%maximum(maxval([0.0_wp, x*self%system%scale(:self%count)]))
      do c = 1, self%count
         associate (it => self%candidates(c))
            it%force = x(c)*self%system%scale(c)
            gap = 0.0_wp
            if (self%system%scale(c) > 0.0_wp) gap = max(0.0_wp, (w(c) - b(c))/self%system%scale(c)*time_step)
            it%touches = gap < touching*sqrt(it%area)
            if (it%force > 0.0_wp) self%worst_bridge = max(self%worst_bridge, it%force*gap/(strongest*level%grid%cell))
            level%blocks(it%block)%particles%column(it%particle, self%pressure) = it%force/it%area
         end associate
      end do
   end subroutine solve

   !> Collective among neighbours: change velocity and acceleration of the nodes that contact forces act on, in every tile here that
   !> has them, and then of their mirror images.
   subroutine move_nodes(self, level, time_step)
      class(contact_t), intent(inout) :: self
      type(level_t), intent(inout) :: level
      real(wp), intent(in) :: time_step
      type(nodal_forces_t), allocatable :: parts(:)
      logical :: changed(size(level%blocks))
      integer :: b, n, r
      call self%system%nodal_forces(self%candidates(:self%count)%force, parts)
      changed = .false.
      do r = 1, size(parts)
         do n = 1, size(parts(r)%node)
            call push_node(level, node_place(level, parts(r)%node(n)), parts(r)%force(:3, n), time_step, changed)
         end do
      end do
      do b = 1, size(level%blocks)
         if (changed(b)) call constrain_nodes(level%grid, level%blocks(b)%place, level%solved(:, :, :, :, b))
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
               associate (node => level%solved(:, at(1), at(2), at(3), slot))
                  if (node(1) <= 0.0_wp) cycle
                  node(5:7) = node(5:7) + force/node(1)
                  node(2:4) = node(2:4) + time_step*force/node(1)
               end associate
               changed(slot) = .true.
            end do
         end do
      end do
   end subroutine push_node

   !> Collective: loads, areas, overlaps and work of the tools.
   subroutine sum_up(self, communicator, time_step)
      class(contact_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      real(wp), intent(in) :: time_step
      real(wp) :: sums(4, size(self%tools)), deepest(size(self%tools))
      integer :: c, t
      sums = 0.0_wp
      do c = 1, self%count
         associate (it => self%candidates(c))
            sums(1:3, it%tool) = sums(1:3, it%tool) - it%force*it%normal
            if (it%touches) sums(4, it%tool) = sums(4, it%tool) + it%area
         end associate
      end do
      deepest = self%states%overlap
      call MPI_Allreduce(MPI_IN_PLACE, sums, size(sums), MPI_DOUBLE_PRECISION, MPI_SUM, communicator%comm)
      call MPI_Allreduce(MPI_IN_PLACE, deepest, size(deepest), MPI_DOUBLE_PRECISION, MPI_MAX, communicator%comm)
      do t = 1, size(self%tools)
         associate (state => self%states(t))
            state%load = sums(1:3, t)
            state%area = sums(4, t)
            state%overlap = deepest(t)
            state%work = state%work - time_step*dot_product(state%load, self%tools(t)%velocity())
         end associate
      end do
      self%worst_overlap = max(self%worst_overlap, maxval(deepest))
   end subroutine sum_up

   !> Collective: free what PETSc holds.
   subroutine release(self)
      class(contact_t), intent(inout) :: self
      call self%solver%release()
   end subroutine release

end module m_contact
