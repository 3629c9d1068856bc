!> Points between bodies of different contact groups in a quasi-static step, found as in the explicit step,
!> and their accumulated values when the step has its equilibrium (theory.md, eq. static-pairs).
module m_static_meetings
   use m_kinds, only: wp
   use m_vectors, only: tangents
   use m_communicator, only: communicator_t
   use m_level, only: level_t
   use m_scene_materials, only: materials_t
   use m_contact_point, only: candidate_t, partner_t, width_of, margin
   use m_candidates, only: candidates_t
   use m_subcell, only: beside_subcell
   use m_half_spaces, only: young_modulus
   use m_partner_point, only: place_partner
   use m_pair_reactions, only: pair_of
   use m_body_pairs, only: body_pairs_t
   use m_static_contact, only: static_contact_t, touches
   use m_static_point, only: static_point_t
   implicit none
   private
   public :: find_meeting_points, accumulate_meetings

contains

   !> Collective: add the points at which bodies meet. `again`: the step is repeated with a
   !> shorter length, from the same state.
   subroutine find_meeting_points(contact, communicator, level, materials, candidates, bodies, time, &
                                  compliance, again)
      type(static_contact_t), intent(inout) :: contact
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(inout) :: level !< with the masses of the nodes
      type(materials_t), intent(in) :: materials
      type(candidates_t), intent(in) :: candidates !< of explicit steps, for data of materials
      type(body_pairs_t), intent(inout) :: bodies
      real(wp), intent(in) :: time       !< of the step's end, s
      real(wp), intent(in) :: compliance !< of a point: gap over cell under a pressure of Young's modulus
      logical, intent(in) :: again
      type(partner_t), allocatable :: partners(:)
      type(static_point_t) :: new
      integer :: first, m
      logical :: held
      contact%pairs%active = .true.
      bodies%time = time
      bodies%overlap = 0.0_wp
      if (.not. again) call bodies%meet(communicator, level)
      allocate (partners(bodies%met))
      do m = 1, bodies%met
         call place_partner(bodies%elements, level, bodies%meetings(m), partners(m))
      end do
      call contact%pairs%connect(level, partners)
      first = contact%count + 1
      do m = 1, bodies%met
         associate (meeting => bodies%meetings(m), it => new%point)
            new = static_point_t()
            call bodies%place_candidate(candidates, level, materials, meeting, it)
            call bodies%hold_candidate(level, meeting, it, contact%pairs%partners(m), held)
            if (.not. held) cycle
            it%partner = m
            bodies%overlap(it%pair) = max(bodies%overlap(it%pair), -it%gap - it%deflection)
            call set_compliances(new, contact%share, compliance, meeting%field, level, materials, candidates)
            call start_from_last_step(new, contact%share, touches*level%grid%cell)
            call contact%add(new)
         end associate
      end do
      call guess_first_contact(contact, first, communicator, level, size(bodies%specs))
   end subroutine find_meeting_points

   !> Set the compliances of a point at which a body meets those of another velocity field.
   subroutine set_compliances(new, share, compliance, field, level, materials, candidates)
      type(static_point_t), intent(inout) :: new
      real(wp), intent(in) :: share      !< of the solver's forces that acts in the mean of the step
      real(wp), intent(in) :: compliance !< of a point: gap over cell under a pressure of Young's modulus
      integer, intent(in) :: field       !< velocity field of the bodies that the point meets
      type(level_t), intent(in) :: level
      type(materials_t), intent(in) :: materials
      type(candidates_t), intent(in) :: candidates !< of explicit steps, for data of materials
      real(wp) :: young, subcell !< of the softest body that it meets, Pa and m/Pa
      integer :: body
      associate (it => new%point)
         young = modulus_of(int(level%blocks(it%block)%particles%body(it%particle)))
         subcell = 0.0_wp
         do body = 1, size(materials%of_body)
            if (level%field_of_body(body) /= field) cycle
            young = min(young, modulus_of(body))
            subcell = max(subcell, candidates%half_spaces%compliance(level, materials, body))
         end do
         ! both sides of a contact have points, and each bears half
         new%contact_compliance = 2.0_wp*share*compliance*level%grid%cell/(young*it%area)
         if (it%subcell + subcell > 0.0_wp) then ! of both bodies, each point with half of its area
            new%subcell_compliance = 2.0_wp*share*(it%subcell + subcell)/it%area
            new%contact_compliance = beside_subcell*new%contact_compliance + new%subcell_compliance
         end if
      end associate
   contains
      real(wp) function modulus_of(body)
         integer, intent(in) :: body
         modulus_of = young_modulus(materials%slots(materials%of_body(body))%law)
      end function modulus_of
   end subroutine set_compliances

   !> Forces that the point had at the end of the last step, as a first guess.
   subroutine start_from_last_step(new, share, touching)
      type(static_point_t), intent(inout) :: new
      real(wp), intent(in) :: share    !< of the solver's forces that acts in the mean of the step
      real(wp), intent(in) :: touching !< gap below which a point is guessed to press, m
      associate (it => new%point)
         new%force = it%force/share
         new%force_before = new%force
         new%pressed = new%force > 0.0_wp .or. it%gap <= touching
         if (it%has_friction) then
            new%friction_force = it%last_tangential_force/share
            new%friction_before = new%friction_force
            new%kept = -(new%contact_compliance - new%subcell_compliance)*new%friction_force &
                       - it%shear_deflection
         end if
      end associate
   end subroutine start_from_last_step

   !> Collective: for a pair without contact, assume contact at the points that almost touch: without it, a
   !> body with no other support has no equilibrium.
   subroutine guess_first_contact(contact, first, communicator, level, pairs)
      type(static_contact_t), intent(inout) :: contact
      integer, intent(in) :: first, pairs !< first point; number of pairs
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(in) :: level
      real(wp) :: presses(pairs), found
      integer :: n
      presses = 0.0_wp
      found = 0.0_wp
      do n = first, contact%count
         associate (it => contact%list(n))
            if (it%pressed) presses(pair_at(it%point)) = 1.0_wp
         end associate
      end do
      do n = 1, pairs
         presses(n) = communicator%maximum(presses(n))
      end do
      do n = first, contact%count
         associate (it => contact%list(n))
            if (presses(pair_at(it%point)) > 0.5_wp) cycle
            it%pressed = it%point%gap <= margin*width_of(it%point)
            if (it%pressed) found = 1.0_wp
         end associate
      end do
      contact%meets_first = communicator%maximum(found) > 0.5_wp
   contains
      pure integer function pair_at(c)
         type(candidate_t), intent(in) :: c
         pair_at = pair_of(level%blocks(c%block)%field, contact%pairs%partners(c%partner)%field)
      end function pair_at
   end subroutine guess_first_contact

   !> Collective: transfer forces, gaps and slips of the equilibrium to the particles and to the sums of the
   !> pairs.
   subroutine accumulate_meetings(contact, communicator, level, materials, bodies, time_step, over_step, &
                                  pressure)
      type(static_contact_t), intent(in) :: contact
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(inout) :: level
      type(materials_t), intent(in) :: materials
      type(body_pairs_t), intent(inout) :: bodies
      real(wp), intent(in) :: time_step !< s
      logical, intent(in) :: over_step  !< forces are means over the step
      integer, intent(in) :: pressure   !< column of the contact pressure
      type(candidates_t) :: accumulated
      real(wp), dimension(size(bodies%states)) :: stored, relaxed
      integer :: n
      stored = bodies%states%stored
      relaxed = bodies%states%relaxed
      accumulated%partners = contact%pairs%partners
      allocate (accumulated%list(contact%pairs%count))
      do n = 1, contact%count
         associate (it => contact%list(n))
            if (it%point%partner == 0) cycle
            accumulated%count = accumulated%count + 1
            associate (c => accumulated%list(accumulated%count), &
                       partner => accumulated%partners(it%point%partner))
               c = it%point
               c%force = contact%share*it%force
               c%mean_force = contact%share*merge(it%force, 0.5_wp*(it%force_before + it%force), over_step)
               ! of the surface, whose gap stays closed; that of the nodes does not while the surface is
               ! deflected
               c%opening = (it%node_gap() + dot_product(it%normal, it%deflection) - it%point%gap &
                            - it%point%deflection)/time_step
               c%gap = it%point%gap + it%point%deflection - dot_product(it%normal, it%deflection)
               c%deflection = dot_product(it%normal, it%deflection)
               c%shear_deflection = it%deflection - c%deflection*it%normal
               c%relaxed = contact%share*it%relaxed()
               if (.not. c%has_friction) cycle
               c%limit = contact%share*contact%limit(n, it%force)
               c%frictional = 1
               c%tangent = tangents(c%normal)
               c%tangential_force = contact%share*matmul(it%friction_force, c%tangent)
               partner%slip = matmul(it%slip + it%contact_compliance*it%friction_force, c%tangent)/time_step
            end associate
         end associate
      end do
      bodies%first = 1
      bodies%time = bodies%time - time_step ! the gaps were those at the step's end
      call bodies%keep(level, materials, accumulated, time_step, pressure)
      call bodies%add_up(communicator)
      bodies%states%work = bodies%states%work - (bodies%states%stored - stored) &
                           - (bodies%states%relaxed - relaxed)
   end subroutine accumulate_meetings

end module m_static_meetings
