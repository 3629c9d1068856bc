!> A contact point: the face of a particle that a tool may press in a step, the nodes on which its force acts,
!> and the results of the step (theory.md, eqs contact-gap, carried-gap).
module m_contact_point
   use m_kinds, only: wp
   use m_constants, only: block_size
   use m_node_values, only: v_x, v_z
   use m_side_kinds, only: boundary_symmetry
   use m_level, only: level_t
   use m_scene, only: body_contact_spec_t
   use m_tool, only: tool_t
   use m_grid_level, only: grid_level_t
   use m_face_weights, only: face_weights_t, weigh, mix
   implicit none
   private
   public :: candidate_t, no_candidate, partner_t, drift_of, width_of, set_face, place_face, spread_inward, &
             point_velocity, tool_velocity, place_of, overlap_rate, margin, sliding, friction_limit

   !> A particle that would end the step inside a tool or another body, or within a margin of it.
   type :: candidate_t
      integer :: block = 0, particle = 0
      integer :: tool = 0                 !< number of the tool; 0: another body,
      integer :: sheet = 0                !< sheet of the tool's surface that it meets; 0: there is one alone
      integer :: slot = 0                 !< index from 0 of its column among those of the tools' sheets
      integer :: partner = 0              !< number in the list of partners
      type(face_weights_t) :: face        !< where its force acts: nodes and their weights
      real(wp) :: normal(3) = 0.0_wp !< outward from the tool or the other body
      real(wp) :: reflected_normal(3) = 0.0_wp !< the same, mirrored if the contact point was mirrored at a
                                               !< symmetry plane
      real(wp) :: reflection(3) = 1.0_wp !< -1 for the components in which the two differ
      real(wp) :: gap = 0.0_wp   !< present gap of its contact point, m
      logical :: carried = .false. !< the gap is carried from the last step by the nodes (eq. carried-gap)
      real(wp) :: allowed = 0.0_wp !< overlap excluded from the gap, m
      real(wp) :: subcell = 0.0_wp !< compliance of the half-space below a cell, m/Pa (eq. subcell)
      real(wp) :: deflection = 0.0_wp !< deflection of its surface by pressures that vary within a cell, m,
      real(wp) :: shear_deflection(3) = 0.0_wp !< and tangential deflection by friction, m
      real(wp) :: relaxing = 0.0_wp !< share of its deflection by relaxation of the material in this step
      real(wp) :: relaxed = 0.0_wp  !< energy dissipated in that, J
      real(wp) :: drift = 0.0_wp !< carried gap minus that by the particle's position and shape, m
      real(wp) :: speed = 0.0_wp !< speed of its contact point along the normal, from the nodes without
                                 !< contact, m/s
      real(wp) :: opposite(3) = 0.0_wp !< velocity of the tool or the other body there without contact, m/s
      real(wp) :: area = 0.0_wp  !< m2
      real(wp) :: depth = 0.0_wp !< of a section: extent of the face normal to it, m; 0: no section
      real(wp) :: mass = 1.0_wp  !< kg
      real(wp) :: force = 0.0_wp !< N, at the end of an implicit step,
      real(wp) :: mean_force = 0.0_wp !< and in the mean of the step, N
      real(wp) :: opening = 0.0_wp !< speed at which its gap opens with that force, m/s
      real(wp) :: adhesive_tension = 0.0_wp  !< largest tension that adhesion bears, N
      real(wp) :: shear_strength = 0.0_wp  !< tangential force that it bears in addition to friction, N
      integer :: pair = 0           !< pair of contact groups, for candidates between bodies
      logical :: has_friction = .false.
      real(wp) :: limit = 0.0_wp    !< largest friction at its force, N
      integer :: frictional = 0     !< index among the candidates with friction; 0 without
      real(wp) :: tangent(3, 2) = 0.0_wp !< normal to `normal`, as seen by the tool
      real(wp) :: tangential_force(2) = 0.0_wp !< friction on the body along the tangents, N
      real(wp) :: last_tangential_force(3) = 0.0_wp  !< the same in the last step, N
      real(wp) :: from(3) = 0.0_wp       !< the particle's centre at the beginning of the step, m
      real(wp) :: arm(3) = 0.0_wp        !< from there to the contact point, m
      real(wp) :: share = 1.0_wp         !< share of its face under a tool with a rim (eq. rim-cut),
      real(wp) :: aside(3) = 0.0_wp      !< vector from the middle of the face to that of this part, m,
      real(wp) :: spans(3) = 1.0_wp      !< and its extents in half edges
      real(wp) :: velocity(3) = 0.0_wp !< of the contact point after the step, m/s; only where the stress
                                       !< needs it
   end type candidate_t

   !> The other body of a candidate, where the candidate's force acts on it.
   type :: partner_t
      integer :: field = 0                !< its velocity field
      integer :: element = 0              !< element of the candidate's particle that meets it
      type(face_weights_t) :: face        !< nodes and their weights; the lowest node in the grid, from 0
      real(wp) :: reflection(3) = 1.0_wp  !< as for the candidate
      real(wp) :: mass(0:2, 0:2, 0:2) = 0.0_wp !< of the nodes, kg
      real(wp) :: point(3) = 0.0_wp       !< where the force acts on the candidate's body, m
      real(wp) :: slip(2) = 0.0_wp        !< along the tangents, after the step, m/s
      real(wp) :: deflected(3) = 0.0_wp   !< shear deflection of the candidate in the last step, m
   end type partner_t

   type(candidate_t), parameter :: no_candidate = candidate_t() !< initial values
   real(wp), parameter :: sliding = 0.999_wp !< of the largest friction: above this share a point slides
   real(wp), parameter :: margin = 0.05_wp !< gap up to which candidates are included, in particle edges
   real(wp), parameter :: overlap_rate = 0.01_wp !< rate at which overlap is removed per step, in particle
                                                 !< edges

contains

   !> Displacement of a pressed particle along the normal after its motion, m.
   pure real(wp) function drift_of(c) result(drift)
      type(candidate_t), intent(in) :: c
      drift = 0.0_wp
      if (.not. (c%force > 0.0_wp .or. c%partner > 0)) return
      associate (most => overlap_rate*width_of(c))
         drift = min(max(c%drift, -most), most)
      end associate
   end function drift_of

   !> Edge of its face, m.
   pure real(wp) function width_of(c)
      type(candidate_t), intent(in) :: c
      if (c%depth > 0.0_wp) then
         width_of = c%area/c%depth
      else
         width_of = sqrt(c%area)
      end if
   end function width_of

   !> Set the nodes of a contact point and their weights. The traction acts on the face of the particle, not
   !> in its volume: a uniform pressure then gives a uniform stress, wherever the surface is in its cell
   !> (theory.md, eqs contact-nodes, face-mean). A point beyond a symmetry plane is the mirror image of one
   !> inside, with the mirrored normal, and no face extends beyond the plane.
   pure subroutine set_face(c, grid, block, node, turns, place, span)
      type(candidate_t), intent(inout) :: c
      type(grid_level_t), intent(in) :: grid
      integer, intent(in) :: block(3), node(3) !< as in place_face
      logical, intent(in) :: turns
      real(wp), intent(in) :: place(3), span(3, 3)
      call place_face(c%face, c%reflection, grid, block, node, turns, place, span)
      c%reflected_normal = c%reflection*c%normal
   end subroutine set_face

   !> The same for any face.
   pure subroutine place_face(face, reflection, grid, block, node, turns, place, span)
      type(face_weights_t), intent(inout) :: face
      real(wp), intent(inout) :: reflection(3) !< set to -1 where the face is mirrored
      type(grid_level_t), intent(in) :: grid
      integer, intent(in) :: block(3)    !< place of the block
      integer, intent(in) :: node(3)     !< node of the particle's bin, from 0
      logical, intent(in) :: turns       !< the domain's edges rotate
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
            reflection(axis) = -1.0_wp
         end do
      end do
      if (grid%section%is_flat()) halves(2, :) = 0.0_wp ! all on its plane
      call weigh(face, node, folded, halves, turns)
   end subroutine place_face

   !> Keep a share of a force at its point and apply the rest at the particle's centre, so that the centre of
   !> the force is on the face of the material (theory.md, eq. element-share). Not if one of them is mirrored
   !> at a symmetry plane.
   pure subroutine spread_inward(face, reflection, grid, block, node, turns, centre, span, share)
      type(face_weights_t), intent(inout) :: face
      real(wp), intent(in) :: reflection(3)
      type(grid_level_t), intent(in) :: grid
      integer, intent(in) :: block(3), node(3) !< as in place_face
      logical, intent(in) :: turns
      real(wp), intent(in) :: centre(3)  !< in cells from the block's first node
      real(wp), intent(in) :: span(3, 3)
      real(wp), intent(inout) :: share   !< set to 1 where all of it stays
      type(face_weights_t) :: inner
      real(wp) :: turned(3)
      if (.not. share < 1.0_wp) return
      turned = reflection
      if (all(turned > 0.0_wp)) call place_face(inner, turned, grid, block, node, turns, centre, span)
      if (any(turned < 0.0_wp)) then
         share = 1.0_wp
      else
         call mix(face, share, inner, node)
      end if
   end subroutine spread_inward

   !> Velocity (m/s) of a contact point from the solved nodes, as seen by the tool.
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
                  velocity = velocity + c%face%weight(i, j, k)*level%nodes(v_x:v_z, at(1), at(2), at(3), &
                        c%block)
               end associate
            end do
         end do
      end do
      velocity = c%reflection*velocity
   end function point_velocity

   !> Its position at the beginning of the step, m.
   pure function place_of(c) result(place)
      type(candidate_t), intent(in) :: c
      real(wp) :: place(3)
      place = c%from + c%arm
   end function place_of

   !> Velocity (m/s) of its tool at its position.
   pure function tool_velocity(tools, c) result(velocity)
      type(tool_t), intent(in) :: tools(:)
      type(candidate_t), intent(in) :: c
      real(wp) :: velocity(3)
      velocity = tools(c%tool)%velocity_at(place_of(c))
   end function tool_velocity

   !> Largest tangential force (N) of a point at a pressing force; the strength of a bond is added.
   pure real(wp) function friction_limit(c, tools, pairs, pressing) result(limit)
      type(candidate_t), intent(in) :: c
      type(tool_t), intent(in) :: tools(:)
      type(body_contact_spec_t), intent(in) :: pairs(:)
      real(wp), intent(in) :: pressing !< N, without the adhesive tension
      if (c%tool > 0) then
         limit = tools(c%tool)%spec%friction%limit(pressing, c%area)
      else ! both sides of the contact have points: each bears half
         limit = pairs(c%pair)%friction%limit(pressing, 0.5_wp*c%area) + c%shear_strength
      end if
   end function friction_limit

end module m_contact_point
