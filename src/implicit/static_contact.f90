!> Contact in a quasi-static step: points that a tool or another body may press, their gaps under a trial
!> displacement, and their forces on the nodes (theory.md, eqs static-contact, static-pairs).
module m_static_contact
   use m_kinds, only: wp
   use m_communicator, only: communicator_t
   use m_mixing, only: mixing_t
   use m_node_values, only: v_x, v_z, f_x, f_z
   use m_level, only: level_t
   use m_scene_materials, only: materials_t
   use m_face_gap, only: find_thickness, list_near
   use m_rim_cut, only: find_point, is_beside_rim
   use m_candidates, only: candidates_t
   use m_static_tools, only: static_tools_t
   use m_static_pairs, only: static_pairs_t
   use m_scene, only: body_contact_spec_t
   use m_friction_law, only: has_friction
   use m_subcell, only: beside_subcell
   use m_half_spaces, only: young_modulus
   use m_contact_point, only: candidate_t, place_of, friction_limit
   use m_static_point, only: static_point_t, across
   implicit none
   private
   public :: static_contact_t, touches

   type :: static_contact_t
      type(static_point_t), allocatable :: list(:)
      integer :: count = 0
      type(static_tools_t) :: tools
      type(static_pairs_t) :: pairs         !< far sides of the points between bodies
      type(body_contact_spec_t), allocatable :: pair_specs(:) !< contact between their bodies
      type(mixing_t), private :: mixing !< of the deflections below the cells
      real(wp) :: lag = 0.0_wp !< last change of the deflections below the cells, relative to the largest
      logical :: is_frictional = .false.             !< some tool or pair has friction
      logical :: meets_first = .false. !< bodies without contact are assumed to be in contact where they
                                       !< almost touch
      real(wp) :: share = 1.0_wp !< share of the forces here that acts in the mean of a step: theta with
                                 !< inertia,
      logical :: over_step = .false. !< and they act over the whole step
   contains
      procedure :: find
      procedure :: add => append
      procedure :: move
      procedure :: deflect
      procedure :: curve
      procedure :: way
      procedure :: limit
      procedure :: misfit
      procedure :: stiffness_of_ways
      procedure :: add_force_at
      procedure :: add_diagonal
   end type static_contact_t

   real(wp), parameter :: far = 1.0e30_wp       !< m: gap of a point that is not pressed
   real(wp), parameter :: touches = 1.0e-6_wp   !< cells: points so near a tool are initially assumed to be
                                                !< pressed
   real(wp), parameter :: sharpest = 1.5_wp !< limit of the rotation of the normal times the distance for
                                            !< convex shapes
   real(wp), parameter :: probe = 1.0e-3_wp !< cells: distance over which the rotation of the normal is
                                            !< evaluated

contains

   !> Find the points within `reach` of the tools at the step's end; forces start from the last step.
   subroutine find(self, level, materials, candidates, reach, compliance)
      class(static_contact_t), intent(inout) :: self
      type(level_t), intent(inout) :: level
      type(materials_t), intent(in) :: materials
      type(candidates_t), intent(inout) :: candidates !< of the explicit steps, for their stored data
      real(wp), intent(in) :: reach      !< m
      real(wp), intent(in) :: compliance !< of a point: gap over cell under a pressure of Young's modulus
      integer, allocatable :: near(:)
      integer :: b, n, sheet, t
      self%count = 0
      if (.not. allocated(self%list)) allocate (self%list(64))
      do b = 1, size(level%blocks)
         do t = 1, size(self%tools%now)
            call list_near(self%tools%now(t), level, b, reach, near)
            do n = 1, size(near)
               do sheet = 1, candidates%slots(t + 1) - candidates%slots(t)
                  call consider(self, level, materials, candidates, [b, near(n), t], sheet, reach, compliance)
               end do
            end do
         end do
      end do
   end subroutine find

   !> Take a particle's point if it is near enough to a sheet of a tool.
   subroutine consider(self, level, materials, candidates, number, sheet, reach, compliance)
      class(static_contact_t), intent(inout) :: self
      type(level_t), intent(in) :: level
      type(materials_t), intent(in) :: materials
      type(candidates_t), intent(in) :: candidates
      integer, intent(in) :: number(3)  !< of the block, the particle, the tool
      integer, intent(in) :: sheet
      real(wp), intent(in) :: reach, compliance
      type(static_point_t) :: new
      real(wp) :: before(4) ! pressure and friction of the last step, Pa
      real(wp) :: edge, thickness, young
      associate (c => new%point, b => number(1), p => number(2), t => number(3), &
                 block => level%blocks(number(1)), column => level%blocks(number(1))%particles%column)
         call candidates%set_slot(t, sheet, c)
         call find_point(self%tools%now(t), level, materials, b, p, reach, &
                         candidates%half_spaces%compliance_of(level, materials, b, p) > 0.0_wp, c, &
                         edge, thickness)
         if (.not. c%gap <= reach) return
         if (is_beside_rim(c, edge, column(p, candidates%carried + c%slot))) return
         call out_of_tool(c%gap, c%normal)
         call candidates%make_point(level, materials, number, edge, thickness, c)
         c%from = c%from + c%aside ! the gap is that of this position
         c%arm = c%arm - c%aside
         new%natural = self%tools%now(t)%spec%penetration_factor*thickness
         young = young_modulus(materials%slots(materials%of_body(block%particles%body(p)))%law)
         new%contact_compliance = self%share*compliance*level%grid%cell/(young*c%area)
         new%subcell_compliance = self%share*c%subcell/c%area
         if (c%subcell > 0.0_wp) &
            new%contact_compliance = beside_subcell*new%contact_compliance + new%subcell_compliance
         new%barred = self%tools%away(t)
         before = candidates%before_of(column(p, :), c)
         if (.not. new%barred) new%force = before(1)*c%area/self%share
         call begin_where_left()
         new%pressed = (new%force > 0.0_wp .or. c%gap <= touches*level%grid%cell) .and. .not. new%barred
         c%has_friction = has_friction(self%tools%now(t)%spec%friction)
         if (c%has_friction) then
            new%friction_force = before(2:)*c%area/self%share
            new%kept = -(new%contact_compliance - new%subcell_compliance)*new%friction_force
            new%friction_before = new%friction_force
            if (candidates%dragged > 0) &
               new%kept = new%kept - column(p, candidates%dragged:candidates%dragged + 2)
         end if
      end associate
      call append(self, new)
   contains
      !> For a centre that the tool has passed over in the step, the gap and the face from outside.
      subroutine out_of_tool(gap, normal)
         real(wp), intent(inout) :: gap, normal(3)
         real(wp) :: centre(3)
         associate (b => number(1), p => number(2), t => number(3), at => level%layout%position, &
                    factor => self%tools%now(number(3))%spec%penetration_factor)
            new%outward = normal
            if (.not. gap + factor*thickness < 0.0_wp) return
            centre = level%blocks(b)%particles%column(p, at:at + 2)
            new%outward = self%tools%outward_at(t, new%point%sheet, centre)
            call self%tools%gap_and_normal(t, new%point%sheet, centre, new%outward, gap, normal)
            call find_thickness(level, materials, b, p, normal, edge, thickness)
            gap = gap - factor*thickness
         end associate
      end subroutine out_of_tool

      !> Force and gap from the last step: the nodes' gap is without the compliance of the point.
      subroutine begin_where_left()
         real(wp) :: left
         associate (p => number(2), t => number(3), slot => new%point%slot, &
                    column => level%blocks(number(1))%particles%column)
            left = column(p, candidates%carried + slot)
            if (abs(left) > 0.0_wp) new%force_before = new%force
            if (new%force_before > 0.0_wp) &
               left = -(new%contact_compliance - new%subcell_compliance)*new%force_before
            if (candidates%deflected > 0) left = left - column(p, candidates%deflected + slot)
            new%depth = self%tools%depth_of(t, new%point%sheet, new%point%from, new%natural, left)
         end associate
      end subroutine begin_where_left
   end subroutine consider

   !> Append a point.
   subroutine append(self, new)
      class(static_contact_t), intent(inout) :: self
      type(static_point_t), intent(in) :: new
      type(static_point_t), allocatable :: more(:)
      if (self%count == size(self%list)) then
         allocate (more(2*self%count))
         more(:self%count) = self%list
         call move_alloc(more, self%list)
      end if
      self%count = self%count + 1
      self%list(self%count) = new
   end subroutine append

   !> Displacement of a point by that of the nodes, as seen by the tool, or relative to the other body, m.
   pure function way(self, n, motion) result(u)
      class(static_contact_t), intent(in) :: self
      integer, intent(in) :: n
      real(wp), intent(in), contiguous :: motion(:, 0:, 0:, 0:, :) !< in v_x to v_z, m
      real(wp) :: u(3)
      integer :: i, j, k
      u = 0.0_wp
      associate (c => self%list(n)%point)
         do k = 0, c%face%last
            do j = 0, c%face%last
               do i = 0, c%face%last
                  u = u + c%face%weight(i, j, k)*motion(v_x:v_z, c%face%corner(1) + 1 + i, &
                                                        c%face%corner(2) + 1 + j, c%face%corner(3) + 1 + k, &
                                                        c%block)
               end do
            end do
         end do
         u = c%reflection*u
         if (c%partner > 0) u = u - self%pairs%way(c%partner)
      end associate
   end function way

   !> Gaps, normals and slips under the displacements of the nodes, with the tools at their trial positions.
   subroutine move(self, motion)
      class(static_contact_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: motion(:, 0:, 0:, 0:, :)
      real(wp) :: u(3), gap
      integer :: n
      do n = 1, self%count
         associate (it => self%list(n), t => self%list(n)%point%tool)
            u = self%way(n, motion)
            it%place = place_of(it%point) + u
            if (t == 0) then ! the other body's surface at the step's beginning
               it%normal = it%point%normal
               it%gap = it%point%gap + dot_product(it%normal, u + it%beside)
               it%slip = across(it%normal, it%kept + u + it%beside)
               cycle
            end if
            call self%tools%gap_and_normal(t, it%point%sheet, it%point%from + u, it%outward, it%gap, &
                                           it%normal)
            it%gap = it%gap - it%depth + dot_product(it%normal, it%beside)
            it%centre = it%point%from + u
            if (self%over_step) then ! the work of the force is by the change of the gap (eq. middle-normal)
               it%centre = it%centre - 0.5_wp*(u - self%tools%material_way(t, it%place))
               call self%tools%gap_and_normal(t, it%point%sheet, it%centre, it%outward, gap, it%normal)
            end if
            if (it%barred) it%gap = far
            if (.not. it%point%has_friction) cycle
            it%slip = across(it%normal, it%kept + u + it%beside - self%tools%material_way(t, it%place))
         end associate
      end do
   end subroutine move

   !> Collective: gaps and slips with the deflections below the cells by the points' forces, mixed with those
   !> of the last iterations.
   subroutine deflect(self, communicator, begins)
      class(static_contact_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      logical, intent(in) :: begins !< no earlier iteration has solved for them
      real(wp), dimension(3, self%count) :: beside, change
      integer :: n
      self%lag = 0.0_wp
      do n = 1, self%count
         associate (it => self%list(n))
            beside(:, n) = it%beside
            change(:, n) = it%deflection - it%beside &
                           - it%subcell_compliance*(it%force*it%normal + it%friction_force)
            self%lag = max(self%lag, norm2(change(:, n)))
         end associate
      end do
      if (begins) call self%mixing%begin(size(change))
      call self%mixing%mix(communicator, size(change), beside, change)
      do n = 1, self%count
         associate (it => self%list(n))
            it%beside = it%beside + change(:, n)
            if (it%barred) cycle
            it%gap = it%gap + dot_product(it%normal, change(:, n))
            it%slip = it%slip + across(it%normal, change(:, n))
         end associate
      end do
   end subroutine deflect

   !> Largest friction of a point at a pressing force, N.
   pure real(wp) function limit(self, n, pressing)
      class(static_contact_t), intent(in) :: self
      integer, intent(in) :: n
      real(wp), intent(in) :: pressing !< N
      limit = friction_limit(self%list(n)%point, self%tools%now, self%pair_specs, self%share*pressing) &
              /self%share
   end function limit

   !> Inconsistency of a point's forces and its position: gaps and slips, m.
   pure real(wp) function misfit(self, n)
      class(static_contact_t), intent(in) :: self
      integer, intent(in) :: n
      real(wp) :: pressing, friction_force(3)
      associate (it => self%list(n))
         if (it%force > 0.0_wp) then
            misfit = abs(it%gap + it%contact_compliance*it%force)
         else
            misfit = max(0.0_wp, -it%gap)
         end if
         if (.not. it%point%has_friction) return
         call it%law([0.0_wp, 0.0_wp, 0.0_wp], self%limit(n, it%force), pressing, friction_force)
         misfit = max(misfit, it%contact_compliance*norm2(friction_force - it%friction_force))
      end associate
   end function misfit

   !> Rotation of the normals of pressed points, by finite differences about their positions.
   subroutine curve(self, cell)
      class(static_contact_t), intent(inout) :: self
      real(wp), intent(in) :: cell !< m
      real(wp) :: most
      integer :: n
      do n = 1, self%count
         associate (it => self%list(n))
            it%turning = 0.0_wp
            if (.not. it%force > 0.0_wp .or. it%point%tool == 0) cycle
            it%turning = self%tools%turning_at(it%point%tool, it%point%sheet, it%centre, it%outward, &
                                               probe*cell)
            if (self%over_step) it%turning = 0.5_wp*it%turning
            most = 1.0_wp/cell
            if (it%depth > 0.0_wp .and. it%node_gap() > -0.5_wp*it%depth) &
               most = max(most, sharpest/(it%node_gap() + it%depth))
            if (norm2(it%turning) > most) it%turning = 0.0_wp ! at an edge that it has passed
         end associate
      end do
   end subroutine curve

   !> Add a force on point n to the forces of its block's tile; parts outside symmetry planes are mirrored
   !> later. The reaction on another body is stored until `pairs%give`.
   pure subroutine add_force_at(self, n, force, tiles)
      class(static_contact_t), intent(inout) :: self
      integer, intent(in) :: n
      real(wp), intent(in) :: force(3) !< as the tool sees it, N
      real(wp), intent(inout), contiguous :: tiles(:, 0:, 0:, 0:, :)
      associate (c => self%list(n)%point)
         call scatter(c, c%face%weight, c%reflection*force, tiles(f_x:f_z, :, :, :, c%block))
         if (c%partner > 0) call self%pairs%push(c%partner, -force, 1)
      end associate
   end subroutine add_force_at

   !> Add the pressed points' part of the diagonal, with the weights to the power of 2; as add_force_at.
   pure subroutine add_diagonal(self, tiles, power)
      class(static_contact_t), intent(inout) :: self
      real(wp), intent(inout), contiguous :: tiles(:, 0:, 0:, 0:, :)
      integer, intent(in) :: power !< 1: resistance to uniform motion
      integer :: n
      do n = 1, self%count
         if (.not. self%list(n)%pressed) cycle
         associate (c => self%list(n)%point, stiffness => self%list(n)%self_stiffness())
            call scatter(c, c%face%weight**power, stiffness, tiles(f_x:f_z, :, :, :, c%block))
            if (c%partner > 0) call self%pairs%push(c%partner, stiffness, power)
         end associate
      end do
   end subroutine add_diagonal

   !> Add a value by weights to the nodes of a point in the tile of its block.
   pure subroutine scatter(c, weight, value, tile)
      type(candidate_t), intent(in) :: c
      real(wp), intent(in) :: weight(0:, 0:, 0:), value(3)
      real(wp), intent(inout) :: tile(:, 0:, 0:, 0:)
      integer :: i, j, k
      do k = 0, c%face%last
         do j = 0, c%face%last
            do i = 0, c%face%last
               associate (at => tile(:, c%face%corner(1) + 1 + i, c%face%corner(2) + 1 + j, &
                                     c%face%corner(3) + 1 + k))
                  at = at + weight(i, j, k)*value
               end associate
            end do
         end do
      end do
   end subroutine scatter

   !> Stiffness of pressed points against the displacements of load-driven freedoms, and its value if they
   !> resisted all directions, N/m.
   pure subroutine stiffness_of_ways(self, sums, most)
      class(static_contact_t), intent(in) :: self
      real(wp), intent(out) :: sums(:), most(:)
      real(wp) :: one(3)
      integer :: k, n
      sums = 0.0_wp
      most = 0.0_wp
      do k = 1, self%tools%count
         do n = 1, self%count
            associate (it => self%list(n), freedom => self%tools%freedom(k))
               if (it%point%tool /= self%tools%tool(k) .or. .not. it%pressed) cycle
               one = self%tools%now(it%point%tool)%freedoms(freedom)%velocity_at(it%place)/self%tools%reach(k)
               sums(k) = sums(k) + dot_product(one, it%resist(one))
               most(k) = most(k) + dot_product(one, one)/it%contact_compliance
            end associate
         end do
      end do
   end subroutine stiffness_of_ways

end module m_static_contact
