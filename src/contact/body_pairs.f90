!> Contact between bodies of different groups: the contact points, as candidates of the contact problem
!> (theory.md, Contact between bodies), and the results for each pair.
module m_body_pairs
   use m_kinds, only: wp
   use m_constants, only: exit_input, exit_numerical
   use m_errors, only: error_t, fail
   use m_text, only: to_text, si
   use m_scene, only: scene_t, body_contact_spec_t, start_as_is
   use m_friction_law, only: has_friction
   use m_communicator, only: communicator_t
   use m_field_table, only: field_table_t
   use m_level, only: level_t
   use m_scene_materials, only: materials_t
   use m_stencil, only: bin_place
   use m_surface_elements, only: surface_elements_t, surface_columns_t, find_columns, share_at
   use m_partner_surface, only: meeting_t, find_meetings, reach_of
   use m_partner_nodes, only: wanted_nodes_t
   use m_partner_point, only: at_contact, place_partner, want_nodes, take_mass, mean_velocity, cap
   use m_start_gap, only: has_file, gap_of_shapes
   use m_pair_law, only: range_of, overlap_left, find_adhesion
   use m_pair_reactions, only: pair_state_t, pair_of, press_element, add_reaction, close_rings, &
                                add_up_pairs
   use m_contact_point, only: candidate_t, partner_t, no_candidate, set_face, spread_inward, &
                              point_velocity, margin
   use m_contact_rows, only: masses_of, places_of
   use m_contact_complaints, only: allowed_text
   use m_candidates, only: candidates_t, carry_on, ahead_of
   implicit none
   private
   public :: body_pairs_t

   real(wp), parameter :: longest_edge = 1.5_wp !< of a particle, in cells: longer ones have been split
   real(wp), parameter :: early = 0.25_wp      !< edges: gap below which the nodes' velocities are checked

   type :: body_pairs_t
      integer :: fields = 1
      type(body_contact_spec_t), allocatable :: specs(:) !< (pairs)
      logical, allocatable :: exact(:) !< (pairs): gaps are corrected by those of the shapes at the start
      type(pair_state_t), allocatable :: states(:) !< (pairs): of the last step; heat and work since the start
      type(pair_state_t), allocatable :: step(:)   !< (pairs): of this step
      real(wp), allocatable :: overlap(:)                !< (pairs): largest in the last step, m
      real(wp), allocatable :: deflection(:) !< (pairs): largest deflection of surfaces below the cells, m
      type(surface_columns_t) :: at
      type(surface_elements_t) :: elements
      type(meeting_t), allocatable :: meetings(:)
      integer :: met = 0         !< number of meetings
      type(wanted_nodes_t) :: wanted
      integer :: first = 1       !< first candidate between bodies; those before are of tools
      real(wp) :: subcell = 0.0_wp !< factor of the compliance below a cell; 0: none
      real(wp) :: deepest = 0.0_wp !< largest deflection by the pressures of the last step, of all ranks, m
      real(wp) :: time = 0.0_wp  !< s
   contains
      procedure :: build
      procedure :: declare
      procedure :: active
      procedure :: adheres
      procedure :: is_frictional
      procedure :: begin
      procedure :: find
      procedure :: forbid
      procedure :: keep
      procedure :: add_up
      procedure :: meet
      procedure :: gap_of
      procedure :: place_candidate
      procedure :: hold_candidate
      procedure, private :: make_candidate
      procedure, private :: may_touch
      procedure, private :: deepest_of
      procedure, private :: set_adhesion
   end type body_pairs_t

contains

   !> The pairs of a scene's groups.
   subroutine build(self, scene)
      class(body_pairs_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      integer :: g, h
      self%fields = scene%fields()
      allocate (self%specs(0), self%exact(0))
      do h = 2, self%fields
         do g = 1, h - 1
            self%specs = [self%specs, scene%contact_of(g, h)]
            self%exact = [self%exact, has_file(scene, g) .or. has_file(scene, h)]
         end do
      end do
      allocate (self%states(size(self%specs)), self%step(size(self%specs)))
      allocate (self%overlap(size(self%specs)), self%deflection(size(self%specs)), source=0.0_wp)
   end subroutine build

   !> True when a scene has bodies that may come into contact.
   pure logical function active(self)
      class(body_pairs_t), intent(in) :: self
      active = self%fields > 1
   end function active

   !> True when some pair adheres or is bonded.
   pure logical function adheres(self)
      class(body_pairs_t), intent(in) :: self
      adheres = any(self%specs%adhesion > 0.0_wp)
   end function adheres

   !> True when some pair has tangential forces.
   pure logical function is_frictional(self)
      class(body_pairs_t), intent(in) :: self
      is_frictional = any(has_friction(self%specs%friction)) .or. any(self%specs%bond_strength > 0.0_wp)
   end function is_frictional

   !> Declare the forces of the last step at each element, from which the next solve starts. The elements
   !> themselves have been declared.
   subroutine declare(self, table)
      class(body_pairs_t), intent(inout) :: self
      type(field_table_t), intent(inout) :: table
      integer :: e
      self%at = find_columns(table)
      do e = 1, self%at%elements
         call table%declare('surface_pressure_'//to_text(e), 1, 'Pa', written=.false.)
         self%at%pressure(e) = table%column('surface_pressure_'//to_text(e))
         call table%declare('surface_gap_'//to_text(e), 2, 'm', written=.false.)
         self%at%gap(e) = table%column('surface_gap_'//to_text(e))
         if (self%subcell > 0.0_wp) then
            call table%declare('surface_deflection_'//to_text(e), 4, 'm', written=.false.)
            self%at%deflection(e) = table%column('surface_deflection_'//to_text(e))
         end if
         if (any(self%specs%start == start_as_is)) then
            call table%declare('surface_overlap_'//to_text(e), 1, 'm', written=.false.)
            self%at%overlap(e) = table%column('surface_overlap_'//to_text(e))
         end if
         if (any(self%exact)) call table%declare('surface_offset_'//to_text(e), 1, 'm', written=.false.)
         self%at%offset(e) = table%column('surface_offset_'//to_text(e))
         if (any(self%specs%bond_strength > 0.0_wp)) then
            call table%declare('surface_bond_'//to_text(e), 4, '1', written=.false.)
            self%at%bond(e) = table%column('surface_bond_'//to_text(e))
         end if
         if (.not. self%is_frictional()) cycle
         call table%declare('surface_friction_'//to_text(e), 3, 'Pa', written=.false.)
         self%at%friction(e) = table%column('surface_friction_'//to_text(e))
      end do
   end subroutine declare

   !> Collective: append the candidates of a step between bodies after those of tools: points where the free
   !> motion would carry an element into another body, or almost.
   subroutine find(self, communicator, level, materials, time, time_step, candidates)
      class(body_pairs_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(inout) :: level
      type(materials_t), intent(in) :: materials
      real(wp), intent(in) :: time, time_step !< s
      type(candidates_t), intent(inout) :: candidates
      integer, allocatable :: first_wanted(:)
      type(partner_t), allocatable :: partners(:)
      integer :: m, n
      self%first = candidates%count + 1
      self%time = time
      self%overlap = 0.0_wp
      call self%meet(communicator, level)
      if (self%subcell > 0.0_wp) &
         self%deepest = communicator%maximum(self%deepest_of(candidates, level, materials))
      allocate (first_wanted(self%met), partners(self%met))
      call self%wanted%clear()
      n = 0
      do m = 1, self%met
         if (.not. self%may_touch(level, self%meetings(m), time_step)) cycle
         n = n + 1
         self%meetings(n) = at_contact(self%meetings(m), self%elements%last(7, self%meetings(m)%element))
         first_wanted(n) = self%wanted%count + 1
         call place_partner(self%elements, level, self%meetings(n), partners(n))
         call want_nodes(level%grid, partners(n), self%wanted)
      end do
      call self%wanted%fetch(level)
      if (.not. allocated(candidates%partners)) allocate (candidates%partners(64))
      candidates%paired = 0
      do m = 1, n
         call self%make_candidate(level, materials, time_step, self%meetings(m), first_wanted(m), &
                                  partners(m), candidates)
      end do
      call candidates%order_pairs(size(level%blocks), self%first)
   end subroutine find

   !> Collective: find the meetings of the elements of a level's particles. Their pressures are taken out of
   !> the particles' columns.
   subroutine meet(self, communicator, level)
      class(body_pairs_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(inout) :: level
      real(wp) :: reach
      reach = reach_of*longest_edge*level%grid%cell
      call self%elements%gather(communicator, level, self%at, reach_of)
      call self%elements%exchange(level, reach)
      call self%elements%mirror(level%grid, reach)
      call self%elements%sort(self%fields, reach_of*max(self%elements%longest, tiny(reach)))
      call find_meetings(self%elements, self%meetings, self%met)
   end subroutine meet

   !> True when a meeting may become contact in a step, by the particles' velocities.
   pure logical function may_touch(self, level, meeting, time_step)
      class(body_pairs_t), intent(in) :: self
      type(level_t), intent(in) :: level
      type(meeting_t), intent(in) :: meeting
      real(wp), intent(in) :: time_step
      associate (e => self%elements%list(meeting%element))
         may_touch = self%gap_of(level, meeting) - 2.0_wp*time_step*norm2(e%velocity - meeting%velocity) &
                     < max(early*e%edge, range_of(self%specs(pair_of(nint(e%field), meeting%field))))
      end associate
   end function may_touch

   !> Gap of a meeting (m), including the allowed overlap and the correction from the start.
   pure real(wp) function gap_of(self, level, meeting) result(gap)
      class(body_pairs_t), intent(in) :: self
      type(level_t), intent(in) :: level
      type(meeting_t), intent(in) :: meeting
      gap = meeting%gap
      associate (n => meeting%element, elements => self%elements)
         associate (pair => pair_of(nint(elements%list(n)%field), meeting%field), e => elements%element(n), &
                    column => level%blocks(elements%block(n))%particles%column, p => elements%particle(n))
            if (self%exact(pair)) gap = gap + column(p, self%at%offset(e))
            if (self%specs(pair)%start == start_as_is) &
               gap = gap + overlap_left(self%specs(pair), self%time)*column(p, self%at%overlap(e))
         end associate
      end associate
   end function gap_of

   !> Set the tension and shear strength by adhesion at a candidate.
   pure subroutine set_adhesion(self, level, spec, element, c)
      class(body_pairs_t), intent(in) :: self
      type(level_t), intent(in) :: level
      type(body_contact_spec_t), intent(in) :: spec
      integer, intent(in) :: element !< of the particle
      type(candidate_t), intent(inout) :: c
      real(wp) :: left
      left = 0.0_wp
      if (spec%bond_strength > 0.0_wp) left = level%blocks(c%block)%particles%column(c%particle, &
            self%at%bond(element))
      call find_adhesion(spec, c%gap, c%area, left, c%adhesive_tension, c%shear_strength)
   end subroutine set_adhesion

   !> Collective, when all bodies are filled: record corrections, allowed overlaps and bonds.
   subroutine begin(self, communicator, scene, level, error)
      class(body_pairs_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      type(scene_t), intent(in) :: scene
      type(level_t), intent(inout) :: level
      type(error_t), intent(inout) :: error
      real(wp) :: gap
      integer :: m, pair
      do pair = 1, size(self%specs)
         if (range_of(self%specs(pair)) > 0.5_wp*level%grid%cell) call fail(error, exit_input, &
            '&body_contact: adhesion acts up to a gap of '//si(range_of(self%specs(pair)), 'm')// &
            ' here, more than half a cell of the finest level, '//si(0.5_wp*level%grid%cell, 'm')// &
            '; allowed: a smaller cohesive_range, or a larger bond_strength')
      end do
      if (error%happened()) return
      call self%meet(communicator, level)
      do m = 1, self%met
         associate (meeting => self%meetings(m), it => self%elements%list(self%meetings(m)%element), &
                    element => self%elements%element(self%meetings(m)%element), &
                    particles => level%blocks(self%elements%block(self%meetings(m)%element))%particles, &
                    p => self%elements%particle(self%meetings(m)%element))
            pair = pair_of(nint(it%field), meeting%field)
            gap = meeting%gap
            if (self%exact(pair)) then
               gap = gap_of_shapes(scene, self%specs(pair), meeting, it, int(particles%body(p)))
               particles%column(p, self%at%offset(element)) = gap - meeting%gap
            end if
            if (self%specs(pair)%start == start_as_is) &
               particles%column(p, self%at%overlap(element)) = max(0.0_wp, -gap)
            if (self%at%bond(element) > 0 .and. gap <= margin*it%edge) &
               particles%column(p, self%at%bond(element)) = 1.0_wp
         end associate
      end do
   end subroutine begin

   !> The largest deflection of an element by its own pressure in the last step, as if both bodies were its
   !> own, m.
   pure real(wp) function deepest_of(self, candidates, level, materials) result(deepest)
      class(body_pairs_t), intent(in) :: self
      type(candidates_t), intent(in) :: candidates
      type(level_t), intent(in) :: level
      type(materials_t), intent(in) :: materials
      integer :: n
      deepest = 0.0_wp
      do n = 1, self%elements%own
         deepest = max(deepest, 4.0_wp*self%elements%last(1, n)*candidates%half_spaces%compliance_of(level, &
            materials, self%elements%block(n), self%elements%particle(n)))
      end do
   end function deepest_of

   !> Set the force point of a meeting on its element's own body, and the closed share of its gap.
   subroutine place_candidate(self, candidates, level, materials, meeting, c)
      class(body_pairs_t), intent(in) :: self
      type(candidates_t), intent(in) :: candidates !< provides data of materials
      type(level_t), intent(in) :: level
      type(materials_t), intent(in) :: materials
      type(meeting_t), intent(in) :: meeting
      type(candidate_t), intent(out) :: c
      real(wp) :: share, point(3)
      c = no_candidate
      associate (element => self%elements%list(meeting%element), &
                 span => self%elements%span(:, :, meeting%element), &
                 last => self%elements%last(:, meeting%element), turns => level%layout%domain > 0, &
                 below => candidates%half_spaces, block => level%blocks(self%elements%block(meeting%element)))
         point = element%point + meeting%to_contact
         c%gap = self%gap_of(level, meeting)
         c%allowed = c%gap - meeting%gap
         c%block = self%elements%block(meeting%element)
         c%particle = self%elements%particle(meeting%element)
         c%normal = meeting%normal
         c%mass = 1.0_wp/(1.0_wp/element%mass + 1.0_wp/meeting%mass)
         c%area = element%area
         if (level%grid%section%is_flat()) then
            c%depth = level%grid%section%depth(element%face(1))
            c%area = element%area/element%edge*c%depth
         end if
         call set_face(c, level%grid, block%place, bin_place(int(block%cells%bin(c%particle))), &
                       turns, (point - block%origin)*level%grid%per_cell, span*level%grid%per_cell)
         share = share_at(norm2(element%face - element%centre), norm2(element%point - element%centre))
         call spread_inward(c%face, c%reflection, level%grid, block%place, &
                            bin_place(int(block%cells%bin(c%particle))), turns, &
                            (element%centre - block%origin)*level%grid%per_cell, &
                            span*level%grid%per_cell, share)
         c%from = element%centre
         c%arm = share*(point - element%centre)
         c%force = last(1)*c%area
         c%last_tangential_force = last(2:4)*c%area
         c%deflection = last(7)
         c%shear_deflection = last(8:10)
         c%pair = pair_of(nint(element%field), meeting%field)
         ! adhesion has its own length at the edge of contact (eq. cohesive-zone)
         if (.not. self%specs(c%pair)%adhesion > 0.0_wp) &
            c%subcell = below%compliance_of(level, materials, c%block, c%particle)
         c%relaxing = below%relaxing(level, materials, c%block, c%particle, meeting%field)
         c%has_friction = has_friction(self%specs(c%pair)%friction)
      end associate
   end subroutine place_candidate

   !> Limit the force on a node of either body to what its mass can bear; `held`: enough nodes remain.
   subroutine hold_candidate(self, level, meeting, c, partner, held)
      class(body_pairs_t), intent(in) :: self
      type(level_t), intent(in) :: level
      type(meeting_t), intent(in) :: meeting
      type(candidate_t), intent(inout) :: c
      type(partner_t), intent(inout) :: partner !< including the masses of its nodes
      logical, intent(out) :: held
      logical :: of_both(2)
      call cap(c%face, masses_of(level, c, places_of(level, c)), self%elements%list(meeting%element)%mass, &
               of_both(1))
      call cap(partner%face, partner%mass, meeting%mass, of_both(2))
      partner%point = c%from + c%arm
      held = all(of_both)
   end subroutine hold_candidate

   !> Keep a meeting as a candidate if the free motion of the nodes would close its gap, or almost.
   subroutine make_candidate(self, level, materials, time_step, meeting, first_wanted, partner, candidates)
      class(body_pairs_t), intent(inout) :: self
      type(level_t), intent(in) :: level
      type(materials_t), intent(in) :: materials
      real(wp), intent(in) :: time_step
      type(meeting_t), intent(in) :: meeting
      integer, intent(in) :: first_wanted !< of the partner's nodes
      type(partner_t), intent(inout) :: partner
      type(candidates_t), intent(inout) :: candidates
      type(candidate_t) :: c
      logical :: held
      call self%place_candidate(candidates, level, materials, meeting, c)
      partner%deflected = c%shear_deflection
      associate (element => self%elements%list(meeting%element), &
                 last => self%elements%last(:, meeting%element), &
                 pair => pair_of(nint(self%elements%list(meeting%element)%field), meeting%field))
         call carry_on(merge(last(5) + c%allowed, 0.0_wp, nint(last(6)) == meeting%field), element%edge, &
                       self%subcell > 0.0_wp .and. last(1) > 0.0_wp, c%gap, c%carried, c%drift)
         if (.not. c%carried .and. self%specs(pair)%press_fit > 0.0_wp) then ! pushed out, not drawn
            c%gap = c%gap - c%drift
            c%drift = 0.0_wp
         end if
         self%overlap(pair) = max(self%overlap(pair), -c%gap - c%deflection)
         call take_mass(self%wanted, first_wanted, partner)
         call self%hold_candidate(level, meeting, c, partner, held)
         if (.not. held) return
         c%opposite = partner%reflection*mean_velocity(self%wanted, first_wanted, partner%face)
         c%speed = dot_product(c%normal, point_velocity(level, c))
         call self%set_adhesion(level, self%specs(pair), partner%element, c)
         if (c%gap + time_step*(c%speed - dot_product(c%normal, c%opposite)) > ahead_of(element%edge, &
             self%deepest) &
             .and. .not. (c%carried .or. c%adhesive_tension > 0.0_wp)) return
      end associate
      call candidates%add_pair(c, partner)
   end subroutine make_candidate

   !> Transfer the solution for candidates between bodies to their particles and to the sums of the pairs on
   !> this rank.
   subroutine keep(self, level, materials, candidates, time_step, pressure)
      class(body_pairs_t), intent(inout) :: self
      type(level_t), intent(inout) :: level
      type(materials_t), intent(in) :: materials
      type(candidates_t), intent(in) :: candidates
      real(wp), intent(in) :: time_step !< s
      integer, intent(in) :: pressure   !< column of the contact pressure
      real(wp) :: overlap
      integer :: n, pair
      self%step = pair_state_t()
      self%deflection = 0.0_wp
      do n = self%first, candidates%count
         associate (c => candidates%list(n), partner => candidates%partners(candidates%list(n)%partner), &
                    block => level%blocks(candidates%list(n)%block))
            pair = pair_of(block%field, partner%field)
            self%deflection(pair) = max(self%deflection(pair), c%deflection)
            overlap = 0.0_wp
            if (self%at%overlap(partner%element) > 0) overlap = block%particles%column(c%particle, &
                  self%at%overlap(partner%element))
            call add_reaction(self%step(pair), self%specs(pair), block%field, c, partner, overlap, &
                              self%time, time_step)
            call press_element(level, materials, self%at, self%specs(pair), c, partner, time_step, pressure)
         end associate
      end do
      if (level%grid%section%is_round()) call close_rings(self%step)
   end subroutine keep

   !> Collective: add the sums of all ranks to the states of the pairs.
   subroutine add_up(self, communicator)
      class(body_pairs_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      call add_up_pairs(communicator, self%step, self%states, self%overlap, self%deflection)
   end subroutine add_up

   !> Collective: an error if bodies meet on a coarser level than the finest, which alone supports contact.
   subroutine forbid(self, communicator, level, finest, error)
      class(body_pairs_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(inout) :: level
      type(level_t), intent(in) :: finest
      type(error_t), intent(inout) :: error
      integer :: m
      call self%meet(communicator, level)
      do m = 1, self%met
         associate (meeting => self%meetings(m), it => self%elements%list(self%meetings(m)%element), &
                    p => self%elements%particle(self%meetings(m)%element), &
                    block => level%blocks(self%elements%block(self%meetings(m)%element)))
            if (meeting%gap > margin*it%edge) cycle
            call fail(error, exit_numerical, 'particle '//to_text(block%particles%id(p))//' of body '// &
                      to_text(int(block%particles%body(p)))// &
                      ' touches a body of another contact group at ('//to_text(it%face(1))//', '// &
                      to_text(it%face(2))//', '//to_text(it%face(3))//') m, on level '// &
                      to_text(level%number)//'; '//allowed_text(finest))
            return
         end associate
      end do
   end subroutine forbid

end module m_body_pairs
