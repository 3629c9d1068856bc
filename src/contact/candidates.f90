!> The particles that a tool may touch in a step, and what the nodes say at their contact points (theory.md, eqs contact-gap,
!> contact-candidates).
module m_candidates
   use m_kinds, only: wp
   use m_constants, only: block_size
   use m_scene, only: boundary_symmetry, safety_allowed
   use m_vectors, only: tangents
   use m_tool, only: tool_t
   use m_level, only: level_t, node_values
   use m_block, only: block_t
   use m_cell_list, only: bins
   use m_split, only: longest, fitted_edges
   use m_field_table, only: layout_t
   use m_material, only: material_t
   use m_materials, only: materials_t
   use m_grid_level, only: grid_level_t
   use m_locate, only: find_bounds
   use m_stencil, only: bin_place
   use m_face_weights, only: face_weights_t, find_face, cube_span, weigh, flattening
   implicit none
   private
   public :: candidate_t, candidates_t, drift_of, first_inside, touches, point_velocity, fastest, recovery

   !> A particle that would end the step inside a tool, or within a margin of it.
   type :: candidate_t
      integer :: block = 0, particle = 0, tool = 0
      type(face_weights_t) :: face        !< where its force acts: nodes and their weights
      real(wp) :: normal(3) = 0.0_wp !< outward from the tool
      real(wp) :: facing(3) = 0.0_wp !< the same, mirrored where the contact point has been folded back at a symmetry plane
      real(wp) :: mirror(3) = 1.0_wp !< -1 for the components in which the two differ
      real(wp) :: gap = 0.0_wp   !< of its contact point now, m
      logical :: carried = .false. !< the gap is the one that the nodes have carried on from the last step (eq. carried-gap)
      real(wp) :: drift = 0.0_wp !< that less the gap by the particle's place and shape, m
      real(wp) :: speed = 0.0_wp !< of its contact point along the normal as the nodes have it without contact, m/s
      real(wp) :: area = 0.0_wp  !< m2
      real(wp) :: mass = 1.0_wp  !< kg
      real(wp) :: force = 0.0_wp !< N
      real(wp) :: opening = 0.0_wp !< speed at which its gap opens with that force, m/s
      integer :: rubbing = 0     !< place among the candidates with friction; 0 without
      real(wp) :: tangent(3, 2) = 0.0_wp !< across the normal, as the tool sees them
      real(wp) :: drag(2) = 0.0_wp       !< friction on the body along the tangents, N
      real(wp) :: last_drag(3) = 0.0_wp  !< the same in the last step, N
      real(wp) :: from(3) = 0.0_wp       !< the particle's centre at the beginning of the step, m
      real(wp) :: arm(3) = 0.0_wp        !< from there to the contact point, m
      real(wp) :: velocity(3) = 0.0_wp   !< of the contact point as the step leaves the nodes; where the stress asks for it, m/s
      logical :: slides = .false.  !< nothing is known of that velocity across the normal
      logical :: touches = .false. !< its face ends the step on the tool (eq. contact-area)
   end type candidate_t

   !> Those of this rank.
   type :: candidates_t
      type(candidate_t), allocatable :: list(:)
      integer :: count = 0
      integer :: rubbing = 0   !< of them with friction
      integer :: pressure = 0  !< column of the contact pressure
      integer :: earlier = 0   !< column of what it was a step before
      integer :: traction = 0  !< first column of the friction; 0 where no tool has any
      integer :: carried = 0   !< first column of the gaps that are carried on, one for each tool
      integer, allocatable :: before(:) !< each block's, candidates of the blocks before it
      real(wp) :: drift = 0.0_wp !< largest difference yet between a carried gap and that of the particle's place and shape, m
   contains
      procedure :: find
      procedure :: settle
      procedure :: pressed
      procedure, private :: search
      procedure, private :: consider
      procedure, private :: take
      procedure, private :: carry_on
      procedure, private :: turn_page
   end type candidates_t

   real(wp), parameter :: fastest = maxval(safety_allowed) !< no contact point comes nearer by more cells in a step
   real(wp), parameter :: margin = 0.05_wp        !< candidates come in this far before they touch, in particle edges
   real(wp), parameter :: touching = 1.0e-4_wp    !< a smaller gap is none, in particle edges
   real(wp), parameter :: longest_thickness = 2.0_wp*sqrt(3.0_wp)*longest !< of domains that deform, in cells
   real(wp), parameter :: recovery = 0.01_wp      !< overlap is taken back by at most this much a step, in particle edges
   real(wp), parameter :: widest_gap = 0.25_wp    !< nothing is carried on across a gap of so many thicknesses: the face is another's, of
                                                  !< a particle that has been split
   type(candidate_t), parameter :: unknown = candidate_t() !< before anything is said of it

contains

   !> The candidates of a step: contact points (centres moved towards the tool by penetration_factor of the present thickness
   !> along the normal) that the free motion would carry into a tool, or almost. Their last two pressures become the start of the
   !> solve.
   subroutine find(self, tools, level, materials, time_step, overlap, again)
      class(candidates_t), intent(inout) :: self
      type(tool_t), intent(in) :: tools(:)
      type(level_t), intent(inout) :: level
      type(materials_t), intent(in) :: materials
      real(wp), intent(in) :: time_step
      real(wp), intent(out) :: overlap(:) !< (tools): deepest place of a contact point inside, m
      logical, intent(in), optional :: again !< the last step's pressures, friction and gaps stay: candidates are found again for it
      logical :: turns
      real(wp) :: thick !< no particle of a block is thicker, m
      integer :: b, t
      self%count = 0
      self%rubbing = 0
      overlap = 0.0_wp
      turns = .true.
      if (present(again)) turns = .not. again
      if (allocated(self%before)) then
         if (size(self%before) /= size(level%blocks) + 1) deallocate (self%before)
      end if
      if (.not. allocated(self%before)) allocate (self%before(size(level%blocks) + 1))
      do b = 1, size(level%blocks)
         self%before(b) = self%count
         if (level%blocks(b)%particles%count == 0) cycle
         thick = 0.0_wp
         do t = 1, size(tools)
            if (.not. can_touch(tools(t), level, level%blocks(b))) cycle
            if (.not. thick > 0.0_wp) thick = thickest(level, level%blocks(b))
            call self%search(tools(t), level, materials, time_step, b, t, thick, overlap(t))
         end do
         if (turns .and. level%blocks(b)%pressed) call self%turn_page(size(tools), level%blocks(b)%particles%count, &
                                                                    level%blocks(b)%particles%column, level%blocks(b)%pressed)
      end do
      self%before(size(self%before)) = self%count
   end subroutine find

   !> After the motion of a block's particles: those that are pressed go along the normal to where their own face is the one that the
   !> tool has pressed (theory.md, eq. carried-gap), by at most so much in a step as an overlap is taken back. Velocity, stress and
   !> shape stay as they are.
   pure subroutine settle(self, level, b, x)
      class(candidates_t), intent(in) :: self
      type(level_t), intent(inout) :: level
      integer, intent(in) :: b
      integer, intent(in) :: x !< first column of the centres at the end of the step
      integer :: n
      do n = self%before(b) + 1, self%before(b + 1)
         associate (c => self%list(n))
            level%blocks(b)%particles%column(c%particle, x:x + 2) = level%blocks(b)%particles%column(c%particle, x:x + 2) &
                                                                    + drift_of(c)*c%normal
         end associate
      end do
   end subroutine settle

   !> How far a pressed particle goes along the normal after its motion, m.
   pure real(wp) function drift_of(c) result(drift)
      type(candidate_t), intent(in) :: c
      drift = 0.0_wp
      if (.not. c%force > 0.0_wp) return
      associate (most => recovery*sqrt(c%area))
         drift = min(max(c%drift, -most), most)
      end associate
   end function drift_of

   !> Consider the particles of a block that may be near enough to a tool: those of rows of bins and of bins that are surely too far
   !> away are not looked at, for no node of the block is fast enough to carry them to the tool in this step.
   subroutine search(self, tool, level, materials, time_step, b, t, thick, overlap)
      class(candidates_t), intent(inout) :: self
      type(tool_t), intent(in) :: tool
      type(level_t), intent(in) :: level
      type(materials_t), intent(in) :: materials
      real(wp), intent(in) :: time_step
      integer, intent(in) :: b, t !< numbers of the block and the tool
      real(wp), intent(in) :: thick !< no particle of the block is thicker, m
      real(wp), intent(inout) :: overlap
      real(wp) :: reach      !< no candidate's contact point is further from the tool, m
      real(wp) :: far        !< no candidate's centre is, as long as a fixed domain's contact point is no edge away from it, m
      real(wp) :: gap(bins), normal(3, bins), middle(3, bins) !< the middle of a bin that is near, m; the tool from there
      logical :: holds(bins), is_near(bins)  !< a bin has particles; and some may be near enough
      real(wp) :: centre(3), gap_centre, normal_centre(3), half_diagonal, half_row
      integer :: bin, first, p
      reach = min(fastest*level%grid%cell, &
                  margin*thick + time_step*(fastest_node(level%nodes(:, :, :, :, b)) + norm2(tool%velocity())))
      far = merge(tool%spec%penetration_factor, 1.0_wp, deform(level))*thick + reach
      half_diagonal = 0.5_wp*sqrt(3.0_wp)*level%grid%cell
      half_row = 0.5_wp*(block_size - 1)*level%grid%cell
      associate (block => level%blocks(b))
         centre = block%origin + half_row
         call tool%gap_and_normal(centre, gap_centre, normal_centre)
         do first = 1, bins, block_size ! of a row along x
            middle(:, first) = block%origin + bin_place(first)*level%grid%cell
            is_near(first:first + block_size - 1) = &
               .not. surely_beyond(far + half_diagonal + abs(normal_centre(1))*half_row, gap_centre, normal_centre, &
                                   middle(:, first) + [half_row, 0.0_wp, 0.0_wp] - centre)
         end do
         if (.not. any(is_near)) return
         holds = .false.
         do p = 1, block%particles%count
            holds(block%cells%bin(p)) = .true.
         end do
         do bin = 1, bins
            is_near(bin) = is_near(bin) .and. holds(bin)
            if (.not. is_near(bin)) cycle
            middle(:, bin) = block%origin + bin_place(bin)*level%grid%cell
            is_near(bin) = .not. surely_beyond(far + half_diagonal, gap_centre, normal_centre, middle(:, bin) - centre)
            if (.not. is_near(bin)) cycle
            call tool%gap_and_normal(middle(:, bin), gap(bin), normal(:, bin))
            is_near(bin) = .not. gap(bin) > far + half_diagonal ! also where it is not a number
         end do
         if (.not. any(is_near)) return
         do p = 1, block%particles%count
            bin = block%cells%bin(p)
            if (.not. is_near(bin)) cycle
            associate (x => level%layout%position)
               if (surely_beyond(far, gap(bin), normal(:, bin), block%particles%column(p, x:x + 2) - middle(:, bin))) cycle
            end associate
            call self%consider(tool, level, materials, time_step, [b, p, bin, t], reach, overlap)
         end do
      end associate
   end subroutine search

   !> True when domains have edges of their own; else they are cubes.
   pure logical function deform(level)
      type(level_t), intent(in) :: level
      deform = level%layout%domain > 0 .or. level%layout%half_sizes
   end function deform

   !> No node of a tile is faster, m/s.
   pure real(wp) function fastest_node(tile)
      real(wp), intent(in), contiguous :: tile(:, :, :, :) !< (node_values, nodes, nodes, nodes), solved
      real(wp) :: largest(node_values) ! all of a node, so that it is one of vectors
      integer :: i, j, k
      largest = 0.0_wp
      do k = 1, size(tile, 4)
         do j = 1, size(tile, 3)
            do i = 1, size(tile, 2)
               largest = max(largest, abs(tile(:, i, j, k)))
            end do
         end do
      end do
      fastest_node = norm2(largest(2:4))
   end function fastest_node

   !> The last pressures of a block's particles become the earlier ones; friction and carried gaps are 0 until they are found again.
   !> Where there was none of them, all is 0 and stays so.
   pure subroutine turn_page(self, tools, count, column, pressed)
      class(candidates_t), intent(in) :: self
      integer, intent(in) :: tools, count !< how many tools and particles
      real(wp), intent(inout), contiguous :: column(:, :)
      logical, intent(out) :: pressed !< some particle was
      integer :: p
      associate (gaps => column(:count, self%carried:self%carried + tools - 1))
         pressed = any(abs(gaps) > 0.0_wp)
         if (pressed) gaps = 0.0_wp
      end associate
      if (.not. pressed) pressed = any(column(:count, self%pressure) > 0.0_wp .or. column(:count, self%earlier) > 0.0_wp)
      if (pressed) then
         !$omp simd
         do p = 1, count
            column(p, self%earlier) = column(p, self%pressure)
            column(p, self%pressure) = 0.0_wp
         end do
      end if
      if (self%traction > 0) column(:count, self%traction:self%traction + 2) = 0.0_wp
   end subroutine turn_page

   !> False when all particles of a block are surely too far from a tool to touch it in this step: by the box of their centres, and
   !> the thickest domains that there can be.
   pure logical function can_touch(tool, level, block)
      type(tool_t), intent(in) :: tool
      type(level_t), intent(in) :: level
      type(block_t), intent(in) :: block
      real(wp) :: centre(3), gap, normal(3), widest
      widest = level%grid%cell ! weights allow no wider domain
      if (deform(level)) widest = longest_thickness*level%grid%cell
      centre = 0.5_wp*(block%lowest + block%highest)
      call tool%gap_and_normal(centre, gap, normal)
      can_touch = .not. surely_beyond(widest + fastest*level%grid%cell, gap, normal, &
                                      -sign(0.5_wp*(block%highest - block%lowest), normal))
   end function can_touch

   !> True where the gap at a place outside a tool and its normal tell that the gap is above a limit some way off: tools are convex,
   !> so a gap is nowhere smaller than it is foretold so. Most bins of a block and most particles of a bin need not be asked then.
   pure logical function surely_beyond(limit, gap, normal, way)
      real(wp), intent(in) :: limit, gap, normal(3), way(3) !< m
      surely_beyond = gap > 0.0_wp .and. gap + dot_product(normal, way) > limit
   end function surely_beyond

   !> Number of particles of a block that a tool pressed in the last step.
   pure integer function pressed(self, block)
      class(candidates_t), intent(in) :: self
      type(block_t), intent(in) :: block
      pressed = 0
      if (block%particles%count > 0) pressed = count(block%particles%column(:block%particles%count, self%pressure) > 0.0_wp)
   end function pressed

   !> No particle of a block is thicker than this in any direction, m: with domains that deform, the length at which they are split.
   pure real(wp) function thickest(level, block)
      type(level_t), intent(in) :: level
      type(block_t), intent(in) :: block
      real(wp) :: smallest, largest
      if (deform(level)) then
         thickest = longest_thickness*level%grid%cell
      else
         call find_bounds(block%particles%count, block%particles%column(:, level%layout%half_size), smallest, largest)
         thickest = 2.0_wp*largest
      end if
   end function thickest

   !> Look at a particle of a bin: whether its contact point is near enough to a tool to get there in a step.
   subroutine consider(self, tool, level, materials, time_step, number, reach, overlap)
      class(candidates_t), intent(inout) :: self
      type(tool_t), intent(in) :: tool
      type(level_t), intent(in) :: level
      type(materials_t), intent(in) :: materials
      real(wp), intent(in) :: time_step
      integer, intent(in) :: number(4) !< of the block, the particle, the bin and the tool
      real(wp), intent(in) :: reach    !< contact points that are further away do not get there, m
      real(wp), intent(inout) :: overlap
      real(wp) :: edge, gap, drift, normal(3), thickness
      logical :: carried
      integer :: m, p
      p = number(2)
      associate (block => level%blocks(number(1)), column => level%blocks(number(1))%particles%column, at => level%layout)
         call tool%gap_and_normal(column(p, at%position:at%position + 2), gap, normal)
         m = materials%of_body(block%particles%body(p))
         if (at%half_sizes) then
            edge = (column(p, at%volume))**(1.0_wp/3.0_wp)
            thickness = box_thickness(materials%slots(m)%law, column(p, :), at, normal)
         else if (deform(level)) then
            edge = (column(p, at%volume))**(1.0_wp/3.0_wp)
            thickness = level%thickness(column(p, :), normal)
         else
            edge = 2.0_wp*column(p, at%half_size)
            if (gap > edge + reach) return
            thickness = edge*materials%slots(m)%law%stretch(column(p, :), at, normal)
         end if
         gap = gap - tool%spec%penetration_factor*thickness
         if (gap > reach) return
         overlap = max(overlap, -gap)
         call self%carry_on(column(p, self%carried + number(4) - 1), thickness, gap, carried, drift)
         call self%take(tool, level, time_step, number, gap, carried, drift, normal, edge, thickness)
      end associate
   end subroutine consider

   !> Thickness (m) of a box that stretches along its axes, across a normal: its edges do not know of shear, but the
   !> material's own stretch does; along an axis it is the edge (theory.md, eq. box-thickness).
   pure real(wp) function box_thickness(law, values, at, normal) result(thickness)
      class(material_t), intent(in) :: law
      real(wp), intent(in) :: values(:) !< the particle's columns
      type(layout_t), intent(in) :: at
      real(wp), intent(in) :: normal(3)
      real(wp) :: axis(3), undeformed(3)
      integer :: k
      do k = 1, 3
         axis = 0.0_wp
         axis(k) = 1.0_wp
         undeformed(k) = values(at%half_size + k - 1)/law%stretch(values, at, axis)
      end do
      thickness = 2.0_wp*norm2(undeformed*normal)*law%stretch(values, at, normal)
   end function box_thickness

   !> The gap of a point that a tool has pressed goes on from where the nodes have left it, for only so do the forces that hold it
   !> do no work of their own (theory.md, eq. carried-gap). It is that of the particle's place and shape again where the point has
   !> come free of the tool by that measure too.
   pure subroutine carry_on(self, last, thickness, gap, carried, drift)
      class(candidates_t), intent(inout) :: self
      real(wp), intent(in) :: last      !< gap that the last step has left, m; 0: none
      real(wp), intent(in) :: thickness !< of the particle, m
      real(wp), intent(inout) :: gap    !< by place and shape; then the one that counts, m
      logical, intent(out) :: carried
      real(wp), intent(out) :: drift    !< what counts less what was, m
      drift = last - gap
      carried = abs(last) > 0.0_wp .and. gap <= min(max(recovery*thickness, abs(drift)), widest_gap*thickness)
      if (.not. carried) drift = max(0.0_wp, -gap) ! inside when it is met, after a split say: drawn out, not pushed
      self%drift = max(self%drift, abs(drift))
      gap = gap + drift
   end subroutine carry_on

   !> Keep a candidate if the free motion would carry its contact point into the tool, or almost.
   subroutine take(self, tool, level, time_step, number, gap, carried, drift, normal, edge, thickness)
      class(candidates_t), intent(inout) :: self
      type(tool_t), intent(in) :: tool
      type(level_t), intent(in) :: level
      real(wp), intent(in) :: time_step
      integer, intent(in) :: number(4)        !< as in consider
      real(wp), intent(in) :: gap, normal(3)  !< of the contact point
      logical, intent(in) :: carried          !< the gap is
      real(wp), intent(in) :: drift           !< of it, m
      real(wp), intent(in) :: edge, thickness !< of the particle, m
      real(wp) :: to_face, span(3, 3), position(3)
      integer :: p
      call make_room(self)
      p = number(2)
      associate (block => level%blocks(number(1)), column => level%blocks(number(1))%particles%column, at => level%layout, &
                 c => self%list(self%count + 1))
         c = unknown
         c%block = number(1)
         c%particle = p
         c%tool = number(4)
         c%gap = gap
         c%carried = carried
         c%drift = drift
         c%normal = normal
         position = column(p, at%position:at%position + 2)
         if (deform(level)) then
            associate (r => fitted_edges(column(p, :), at, level%grid%cell))
               call find_face(r, c%normal, level%grid%cell, at%domain > 0, norm2(matmul(c%normal, r)), to_face, span)
            end associate
         else
            to_face = 0.5_wp*edge*min(1.0_wp, thickness/edge + flattening)
            span = cube_span(0.5_wp*edge, c%normal, level%grid%cell)
         end if
         call set_face(c, level%grid, block%place, bin_place(number(3)), at%domain > 0, &
                       (position - to_face*c%normal - block%origin)*level%grid%per_cell, span*level%grid%per_cell)
         c%from = position
         c%arm = -to_face*c%normal
         c%speed = dot_product(c%normal, point_velocity(level, c))
         if (c%gap + time_step*(c%speed - dot_product(c%normal, tool%velocity())) > margin*edge .and. .not. carried) return
         c%area = edge**2
         if (deform(level)) c%area = column(p, at%volume)/thickness
         c%mass = column(p, at%mass)
         c%force = expected(column(p, self%pressure), column(p, self%earlier))*c%area
         if (tool%spec%friction > 0.0_wp) then
            self%rubbing = self%rubbing + 1
            c%rubbing = self%rubbing
            c%last_drag = column(p, self%traction:self%traction + 2)*c%area
            c%tangent = tangents(c%normal)
         end if
         self%count = self%count + 1
      end associate
   end subroutine take

   !> The pressure that follows two others: what has begun goes on.
   pure real(wp) function expected(last, earlier)
      real(wp), intent(in) :: last, earlier !< Pa, of the last step and the one before
      expected = last
      if (last > 0.0_wp .and. earlier > 0.0_wp) expected = max(0.0_wp, last + (last - earlier))
   end function expected

   !> The first particle of a block whose contact point lies inside a tool, and the tool; 0 where there is none.
   pure subroutine first_inside(tools, level, b, particle, tool)
      type(tool_t), intent(in) :: tools(:)
      type(level_t), intent(in) :: level
      integer, intent(in) :: b
      integer, intent(out) :: particle, tool
      real(wp) :: gap, normal(3)
      particle = 0
      if (level%blocks(b)%particles%count == 0) return
      if (.not. near_tool(tools, level, level%blocks(b)%place)) return
      associate (column => level%blocks(b)%particles%column, x => level%layout%position)
         do tool = 1, size(tools)
            do particle = 1, level%blocks(b)%particles%count
               call tools(tool)%gap_and_normal(column(particle, x:x + 2), gap, normal)
               if (gap < tools(tool)%spec%penetration_factor*level%thickness(column(particle, :), normal)) return
            end do
         end do
      end associate
      particle = 0
   end subroutine first_inside

   !> True when a candidate that ends the step at a gap (m) counts as touching: where the gap is none, and where it is no wider than
   !> the tool's surface bends over a cell, which the nodes cannot follow (eq. contact-area).
   pure logical function touches(c, tools, level, gap)
      type(candidate_t), intent(in) :: c
      type(tool_t), intent(in) :: tools(:)
      type(level_t), intent(in) :: level
      real(wp), intent(in) :: gap
      touches = gap < touching*sqrt(c%area)
      if (touches .or. gap > margin*sqrt(c%area)) return
      associate (column => level%blocks(c%block)%particles%column, x => level%layout%position)
         touches = gap < tools(c%tool)%sagitta(column(c%particle, x:x + 2), c%normal, level%grid%cell)
      end associate
   end function touches

   !> Room for one candidate more.
   pure subroutine make_room(self)
      class(candidates_t), intent(inout) :: self
      type(candidate_t), allocatable :: more(:)
      if (self%count < size(self%list)) return
      allocate (more(2*self%count))
      more(:self%count) = self%list
      call move_alloc(more, self%list)
   end subroutine make_room

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

   !> The nodes of a contact point and their weights. The traction acts on the face of the particle, not in its volume: a uniform
   !> pressure then makes a uniform stress, wherever the surface stands in its cell (theory.md, eqs contact-nodes, face-mean). A
   !> point beyond a symmetry plane is the mirror image of one inside, with the mirrored normal, and no face reaches beyond the
   !> plane.
   pure subroutine set_face(c, grid, block, node, turns, place, span)
      type(candidate_t), intent(inout) :: c
      type(grid_level_t), intent(in) :: grid
      integer, intent(in) :: block(3)    !< place of the block
      integer, intent(in) :: node(3)     !< in the middle of the particle's bin, from 0
      logical, intent(in) :: turns       !< the domain's edges do
      real(wp), intent(in) :: place(3)   !< of the contact point, in cells from the block's first node
      real(wp), intent(in) :: span(3, 3) !< of the face around it, cells
      real(wp) :: folded(3), halves(3, 3), beyond, reach
      integer :: axis, side
      folded = place
      halves = span
      do axis = 1, 3
         do side = 1, 2
            if (grid%boundary(side, axis) /= boundary_symmetry) cycle
            beyond = place(axis) + block_size*block(axis) - merge(0, grid%cells(axis), side == 1)
            reach = sum(abs(span(axis, :)))
            if (reach > abs(beyond)) halves(axis, :) = span(axis, :)*abs(beyond)/reach
            if (merge(beyond >= 0.0_wp, beyond <= 0.0_wp, side == 1)) cycle
            folded(axis) = place(axis) - 2.0_wp*beyond
            c%mirror(axis) = -1.0_wp
         end do
      end do
      c%facing = c%mirror*c%normal
      call weigh(c%face, node, folded, halves, turns)
   end subroutine set_face

   !> Velocity (m/s) that a contact point gets from the solved nodes, as the tool sees it.
   pure function point_velocity(level, c) result(velocity)
      type(level_t), intent(in) :: level
      type(candidate_t), intent(in) :: c
      real(wp) :: velocity(3)
      integer :: i, j, k
      velocity = 0.0_wp
      do k = 0, c%face%last
         do j = 0, c%face%last
            do i = 0, c%face%last
               associate (at => c%face%corner + 1 + [i, j, k])
                  velocity = velocity + c%face%weight(i, j, k)*level%nodes(2:4, at(1), at(2), at(3), c%block)
               end associate
            end do
         end do
      end do
      velocity = c%mirror*velocity
   end function point_velocity

end module m_candidates
