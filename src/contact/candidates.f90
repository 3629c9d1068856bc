!> The particles that a tool may touch in a step, and what the nodes say at their contact points (theory.md,
!> eqs contact-gap, contact-candidates).
module m_candidates
   use m_kinds, only: wp
   use m_node_values, only: node_values, v_x, v_z
   use m_vectors, only: tangents
   use m_tool, only: tool_t
   use m_level, only: level_t
   use m_block, only: block_t
   use m_contact_columns, only: contact_columns_t
   use m_half_edges, only: fitted_edges
   use m_scene_materials, only: materials_t
   use m_stencil, only: bin_place
   use m_face_weights, only: find_face, cube_span, flattening
   use m_face_gap, only: near_tool, list_near, deform, thickest, fastest
   use m_rim_cut, only: find_point, is_beside_rim
   use m_friction_law, only: has_friction
   use m_half_spaces, only: half_spaces_t
   use m_contact_point, only: candidate_t, partner_t, no_candidate, drift_of, set_face, point_velocity, &
                              place_of, overlap_rate, margin
   implicit none
   private
   public :: candidates_t, carry_on, ahead_of

   !> Those of this rank.
   type, extends(contact_columns_t) :: candidates_t
      type(candidate_t), allocatable :: list(:)   !< first those of tools, then those between bodies
      type(partner_t), allocatable :: partners(:) !< other bodies of the latter
      integer :: count = 0
      integer :: paired = 0       !< of them between bodies
      integer :: frictional = 0   !< of them with friction
      type(half_spaces_t) :: half_spaces
      real(wp), allocatable :: deepest(:)  !< (tools): the largest pressure of the last step, of all ranks,
                                           !< times that compliance, m
      integer, allocatable :: before(:) !< each block's, candidates of the blocks before it; of tools
      integer, allocatable :: pairs_before(:) !< the same, of those between bodies
      real(wp) :: drift = 0.0_wp !< largest difference yet between a carried gap and that of the particle's
                                 !< place and shape, m
   contains
      procedure :: find
      procedure :: settle
      procedure :: add_pair
      procedure :: order_pairs
      procedure :: pressed
      procedure :: make_point
      procedure, private :: search
      procedure, private :: consider
      procedure, private :: take
      procedure, private :: shift_pressure_history
      procedure, private :: width_ahead
   end type candidates_t

   real(wp), parameter :: largest_face = 4.0_wp !< squared cells: of what is drawn out flat, along its face
   real(wp), parameter :: widest_gap = 0.25_wp !< nothing is carried on across a gap of so many thicknesses:
                                               !< the face is another's, of a particle that has been split
   real(wp), parameter :: farthest_ahead = 0.25_wp !< edges: no candidate has a wider gap

contains

   !> The candidates of a step: contact points (centres moved towards the tool by penetration_factor of the
   !> present thickness along the normal) that the free motion would carry into a tool, or almost. Their last
   !> two pressures become the start of the solve.
   subroutine find(self, tools, level, materials, time_step, overlap, again)
      class(candidates_t), intent(inout) :: self
      type(tool_t), intent(in) :: tools(:)
      type(level_t), intent(inout) :: level
      type(materials_t), intent(in) :: materials
      real(wp), intent(in) :: time_step
      real(wp), intent(out) :: overlap(:) !< (tools): deepest place of a contact point inside, m
      logical, intent(in), optional :: again !< the last step's pressures, friction and gaps stay: candidates
                                             !< are found again for it
      logical :: turns
      integer :: b, t
      self%count = 0
      self%paired = 0
      self%frictional = 0
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
         do t = 1, size(tools)
            if (near_tool(tools(t), level, level%blocks(b), fastest*level%grid%cell)) &
               call self%search(tools(t), level, materials, time_step, b, t, overlap(t))
         end do
         if (turns .and. level%blocks(b)%pressed) &
            call self%shift_pressure_history(self%slots(size(self%slots)), level%blocks(b)%particles%count, &
                                             level%blocks(b)%particles%column, level%blocks(b)%pressed)
      end do
      self%before(size(self%before)) = self%count
   end subroutine find

   !> After the motion of a block's particles: those that are pressed go along the normal to where their own
   !> face is the one that the tool has pressed (theory.md, eq. carried-gap), by at most so much in a step as
   !> an overlap is taken back. Velocity, stress and shape stay as they are.
   pure subroutine settle(self, level, b, x)
      class(candidates_t), intent(in) :: self
      type(level_t), intent(inout) :: level
      integer, intent(in) :: b
      integer, intent(in) :: x !< first column of the centres at the end of the step
      integer :: n
      do n = self%before(b) + 1, self%before(b + 1)
         associate (c => self%list(n))
            associate (centre => level%blocks(b)%particles%column(c%particle, x:x + 2))
               centre = centre + drift_of(c)*c%normal
            end associate
         end associate
      end do
      if (.not. allocated(self%pairs_before)) return
      do n = self%pairs_before(b) + 1, self%pairs_before(b + 1)
         associate (c => self%list(n)) ! both sides have candidates: each goes half the way
            associate (centre => level%blocks(b)%particles%column(c%particle, x:x + 2))
               centre = centre + 0.5_wp*drift_of(c)*c%normal
            end associate
         end associate
      end do
   end subroutine settle

   !> Consider the particles of a block that may be near enough to a tool: those of bins that are surely too
   !> far away are not looked at, for no node of the block is fast enough to carry them to the tool in this
   !> step.
   subroutine search(self, tool, level, materials, time_step, b, t, overlap)
      class(candidates_t), intent(inout) :: self
      type(tool_t), intent(in) :: tool
      type(level_t), intent(inout) :: level
      type(materials_t), intent(in) :: materials
      real(wp), intent(in) :: time_step
      integer, intent(in) :: b, t !< numbers of the block and the tool
      real(wp), intent(inout) :: overlap
      real(wp) :: reach !< no candidate's contact point is further from the tool, m
      integer, allocatable :: near(:)
      integer :: n, sheet
      reach = min(fastest*level%grid%cell, &
                  self%width_ahead(t, thickest(level)) &
                  + time_step*(fastest_node(level%nodes(:, :, :, :, b), level%grid%rows) &
                               + tool%surface_speed()))
      call list_near(tool, level, b, reach, near)
      do n = 1, size(near)
         do sheet = 1, self%slots(t + 1) - self%slots(t)
            call self%consider(tool, level, materials, time_step, [b, near(n), t], sheet, reach, overlap)
         end do
      end do
   end subroutine search

   !> How far before they touch a tool points are candidates: those that the surface below the cells lets
   !> touch first count too, but not those of a second layer, m.
   pure real(wp) function width_ahead(self, t, edge) result(width)
      class(candidates_t), intent(in) :: self
      integer, intent(in) :: t     !< number of the tool
      real(wp), intent(in) :: edge !< of the particle, m
      width = margin*edge
      if (self%deflected > 0) width = ahead_of(edge, self%deepest(t))
   end function width_ahead

   !> The same with a deflection (m) below the cells of some point: as wide, but not to a second layer, m.
   pure real(wp) function ahead_of(edge, deepest) result(width)
      real(wp), intent(in) :: edge, deepest !< of the particle; m
      width = min(margin*edge + deepest, max(margin, farthest_ahead)*edge)
   end function ahead_of

   !> No node of a tile is faster, m/s.
   pure real(wp) function fastest_node(tile, rows)
      real(wp), intent(in), contiguous :: tile(:, :, :, :) !< (node_values, nodes, nodes, nodes), solved
      integer, intent(in) :: rows(2) !< first and last place along y that anything reaches, from 0
      real(wp) :: largest(node_values) ! all of a node, so that it is one of vectors
      integer :: i, j, k
      largest = 0.0_wp
      do k = 1, size(tile, 4)
         do j = rows(1) + 1, rows(2) + 1
            do i = 1, size(tile, 2)
               largest = max(largest, abs(tile(:, i, j, k)))
            end do
         end do
      end do
      fastest_node = norm2(largest(v_x:v_z))
   end function fastest_node

   !> The last pressures of a block's particles become the earlier ones; friction and carried gaps are 0 until
   !> they are found again. Where there was none of them, all is 0 and stays so.
   pure subroutine shift_pressure_history(self, slots, count, column, pressed)
      class(candidates_t), intent(in) :: self
      integer, intent(in) :: slots, count !< how many sheets of tools, and particles
      real(wp), intent(inout), contiguous :: column(:, :)
      logical, intent(out) :: pressed !< some particle was
      integer :: p
      associate (gaps => column(:count, self%carried:self%carried + slots - 1))
         pressed = any(abs(gaps) > 0.0_wp)
         if (pressed) gaps = 0.0_wp
      end associate
      if (pressed .and. self%deflected > 0) column(:count, self%deflected:self%deflected + slots - 1) = 0.0_wp
      if (.not. pressed) pressed = any(column(:count, self%pressure) > 0.0_wp &
                                       .or. column(:count, self%earlier) > 0.0_wp)
      if (pressed) then
         !$omp simd
         do p = 1, count
            column(p, self%earlier) = column(p, self%pressure)
            column(p, self%pressure) = 0.0_wp
         end do
      end if
      if (self%own > 0) column(:count, self%own:self%own + self%own_width*slots - 1) = 0.0_wp
      if (self%traction > 0) column(:count, self%traction:self%traction + 2) = 0.0_wp
      if (self%dragged > 0) column(:count, self%dragged:self%dragged + 2) = 0.0_wp
   end subroutine shift_pressure_history

   !> Number of particles of a block that a tool pressed in the last step.
   pure integer function pressed(self, block)
      class(candidates_t), intent(in) :: self
      type(block_t), intent(in) :: block
      pressed = 0
      if (block%particles%count > 0) pressed = count(block%particles%column(:block%particles%count, &
            self%pressure) > 0.0_wp)
   end function pressed

   !> Look at a particle of a bin: whether its contact point is near enough to a sheet of a tool to get there
   !> in a step.
   subroutine consider(self, tool, level, materials, time_step, number, sheet, reach, overlap)
      class(candidates_t), intent(inout) :: self
      type(tool_t), intent(in) :: tool
      type(level_t), intent(in) :: level
      type(materials_t), intent(in) :: materials
      real(wp), intent(in) :: time_step
      integer, intent(in) :: number(3) !< of the block, the particle and the tool
      integer, intent(in) :: sheet
      real(wp), intent(in) :: reach    !< contact points that are further away do not get there, m
      real(wp), intent(inout) :: overlap
      type(candidate_t) :: new
      real(wp) :: edge, thickness
      logical :: held
      integer :: p
      p = number(2)
      associate (column => level%blocks(number(1))%particles%column)
         new = no_candidate
         call self%set_slot(number(3), sheet, new)
         call find_point(tool, level, materials, number(1), p, reach, &
                         self%half_spaces%compliance_of(level, materials, number(1), p) > 0.0_wp, &
                         new, edge, thickness)
         if (new%gap > reach) return
         if (is_beside_rim(new, edge, column(p, self%carried + new%slot))) return
         if (self%deflected > 0) new%deflection = column(p, self%deflected + new%slot)
         held = self%deflected > 0 .and. column(p, self%pressure) > 0.0_wp
         overlap = max(overlap, -new%gap - new%deflection)
         call carry_on(column(p, self%carried + new%slot), thickness, held, new%gap, new%carried, &
                       new%drift)
         self%drift = max(self%drift, abs(new%drift))
         call self%take(tool, level, materials, time_step, number, new, edge, thickness)
      end associate
   end subroutine consider

   !> The gap of a point that a tool has pressed goes on from where the nodes have left it, for only so do the
   !> forces that hold it do no work of their own (theory.md, eq. carried-gap). It is that of the particle's
   !> place and shape again where the point has come free of the tool by that measure too.
   pure subroutine carry_on(last, thickness, held, gap, carried, drift)
      real(wp), intent(in) :: last      !< gap that the last step has left, m; 0: none
      real(wp), intent(in) :: thickness !< of the particle, m
      logical, intent(in) :: held       !< it is pressed across an open gap, below the cells
      real(wp), intent(inout) :: gap    !< by place and shape; then the one that counts, m
      logical, intent(out) :: carried
      real(wp), intent(out) :: drift    !< what counts less what was, m
      drift = last - gap
      carried = abs(last) > 0.0_wp .and. gap <= widest_gap*thickness
      if (.not. held) carried = carried .and. gap <= max(overlap_rate*thickness, abs(drift))
      ! inside when it is met, after a split say: drawn out, not pushed
      if (.not. carried) drift = max(0.0_wp, -gap)
      gap = gap + drift
   end subroutine carry_on

   !> Keep a candidate if the free motion would carry its contact point into the tool, or almost.
   subroutine take(self, tool, level, materials, time_step, number, new, edge, thickness)
      class(candidates_t), intent(inout) :: self
      type(tool_t), intent(in) :: tool
      type(level_t), intent(in) :: level
      type(materials_t), intent(in) :: materials
      real(wp), intent(in) :: time_step
      integer, intent(in) :: number(3)        !< as in consider
      type(candidate_t), intent(in) :: new    !< with its gap and normal
      real(wp), intent(in) :: edge, thickness !< of the particle, m
      integer :: p
      call make_room(self)
      p = number(2)
      associate (column => level%blocks(number(1))%particles%column, c => self%list(self%count + 1))
         c = new
         call self%make_point(level, materials, number, edge, thickness, c)
         c%speed = dot_product(c%normal, point_velocity(level, c))
         c%opposite = tool%velocity_at(place_of(c))
         if (c%gap + time_step*(c%speed - dot_product(c%normal, c%opposite)) &
             > self%width_ahead(c%tool, edge) .and. .not. c%carried) return
         c%force = expected(column(p, self%pressure), column(p, self%earlier))*c%area
         c%has_friction = has_friction(tool%spec%friction)
         if (c%has_friction) then
            self%frictional = self%frictional + 1
            c%frictional = self%frictional
            c%last_tangential_force = column(p, self%traction:self%traction + 2)*c%area
            if (self%dragged > 0) c%shear_deflection = column(p, self%dragged:self%dragged + 2)
            c%tangent = tangents(c%normal)
         end if
         self%count = self%count + 1
      end associate
   end subroutine take

   !> The contact point of a particle that meets a tool along a normal, in steps of any kind: its face, the
   !> nodes there and their weights, its area, and what the half-space gives way by below it.
   subroutine make_point(self, level, materials, number, edge, thickness, c)
      class(candidates_t), intent(in) :: self
      type(level_t), intent(in) :: level
      type(materials_t), intent(in) :: materials
      integer, intent(in) :: number(3)        !< of the block, the particle and the tool
      real(wp), intent(in) :: edge, thickness !< of the particle, m
      type(candidate_t), intent(inout) :: c   !< with its normal
      real(wp) :: to_face, span(3, 3)
      integer :: p
      p = number(2)
      associate (block => level%blocks(number(1)), column => level%blocks(number(1))%particles%column, &
                 at => level%layout)
         c%block = number(1)
         c%particle = p
         c%tool = number(3)
         c%from = column(p, at%position:at%position + 2)
         c%mass = column(p, at%mass)
         if (deform(level)) then
            associate (r => fitted_edges(column(p, :), at, level%grid%cell))
               call find_face(r, c%normal, norm2(matmul(c%normal, r)), to_face, span)
            end associate
         else
            to_face = 0.5_wp*edge*min(1.0_wp, thickness/edge + flattening)
            span = cube_span(0.5_wp*edge, c%normal)
         end if
         c%arm = c%aside - to_face*c%normal
         call set_face(c, level%grid, block%place, bin_place(int(block%cells%bin(p))), at%domain > 0, &
                       (c%from + c%arm - block%origin)*level%grid%per_cell, &
                       span*spread(c%spans, 1, 3)*level%grid%per_cell)
         call set_area(c, level, edge, thickness, column(p, at%volume))
         c%subcell = self%half_spaces%compliance_of(level, materials, number(1), p)
         c%relaxing = self%half_spaces%relaxing(level, materials, number(1), p, 0)
         c%area = c%share*c%area
      end associate
   end subroutine make_point

   !> Area of the face of a candidate whose place is known.
   pure subroutine set_area(c, level, edge, thickness, volume)
      type(candidate_t), intent(inout) :: c
      type(level_t), intent(in) :: level
      real(wp), intent(in) :: edge, thickness, volume !< of the particle, m and m3
      c%area = edge**2
      if (deform(level)) c%area = min(volume/thickness, largest_face*level%grid%cell**2)
      if (.not. level%grid%section%is_flat()) return
      c%depth = level%grid%section%depth(c%from(1) + c%aside(1))
      c%area = edge*c%depth
      if (deform(level)) c%area = min(volume/thickness, sqrt(largest_face)*level%grid%cell*c%depth)
   end subroutine set_area

   !> Those between bodies are all there, from `first` on, block by block: which are whose.
   subroutine order_pairs(self, blocks, first)
      class(candidates_t), intent(inout) :: self
      integer, intent(in) :: blocks, first
      integer :: b, n
      if (allocated(self%pairs_before)) deallocate (self%pairs_before)
      allocate (self%pairs_before(blocks + 1))
      n = first - 1
      do b = 1, blocks
         self%pairs_before(b) = n
         do while (n < self%count)
            if (self%list(n + 1)%block > b) exit
            n = n + 1
         end do
      end do
      self%pairs_before(blocks + 1) = n
   end subroutine order_pairs

   !> Append a candidate between bodies and its partner.
   subroutine add_pair(self, c, partner)
      class(candidates_t), intent(inout) :: self
      type(candidate_t), intent(in) :: c
      type(partner_t), intent(in) :: partner
      type(partner_t), allocatable :: more(:)
      if (self%paired == size(self%partners)) then
         allocate (more(2*self%paired))
         more(:self%paired) = self%partners
         call move_alloc(more, self%partners)
      end if
      self%paired = self%paired + 1
      self%partners(self%paired) = partner
      call make_room(self)
      self%count = self%count + 1
      associate (new => self%list(self%count))
         new = c
         new%partner = self%paired
         if (.not. (c%has_friction .or. c%shear_strength > 0.0_wp)) return
         self%frictional = self%frictional + 1
         new%frictional = self%frictional
         new%tangent = tangents(c%normal)
      end associate
   end subroutine add_pair

   !> The pressure that follows two others: what has begun goes on.
   pure real(wp) function expected(last, earlier)
      real(wp), intent(in) :: last, earlier !< Pa, of the last step and the one before
      expected = last
      if (last > 0.0_wp .and. earlier > 0.0_wp) expected = max(0.0_wp, last + (last - earlier))
   end function expected

   !> Room for one candidate more.
   pure subroutine make_room(self)
      class(candidates_t), intent(inout) :: self
      type(candidate_t), allocatable :: more(:)
      if (self%count < size(self%list)) return
      allocate (more(2*self%count))
      more(:self%count) = self%list
      call move_alloc(more, self%list)
   end subroutine make_room

end module m_candidates
