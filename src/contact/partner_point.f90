!> The other body's side of a candidate between bodies: the point of the force there, its nodes, and their
!> masses (theory.md, eqs partner-point, capped).
module m_partner_point
   use m_kinds, only: wp
   use m_level, only: level_t
   use m_grid_level, only: grid_level_t
   use m_boundary, only: inside
   use m_face_weights, only: face_weights_t
   use m_surface_elements, only: surface_elements_t
   use m_partner_surface, only: meeting_t
   use m_partner_nodes, only: wanted_nodes_t
   use m_contact_point, only: partner_t, place_face, spread_inward
   implicit none
   private
   public :: at_contact, place_partner, want_nodes, take_mass, mean_velocity, cap

   real(wp), parameter :: max_weight = 1.5_wp !< limit of a node's weight, times the root of its mass over the
                                              !< particle's: a node
                                               !< of almost no mass gets almost no force
   real(wp), parameter :: hair = 1.0e-6_wp !< of the weights: a face so near to a plane of nodes is on it. The
                                           !< node beyond has a weight and a mass of round-off, whose ratio is
                                           !< undefined
   real(wp), parameter :: no_mass = 1.0e-6_wp !< relative mass of a node below which it bears less and less
   real(wp), parameter :: min_held = 0.2_wp  !< of the weights that must remain

contains

   !> A meeting whose forces act where the surfaces meet: faces of bodies that press each other overlap by
   !> what they give way by below the cells (m), and each goes back by half of it (theory.md, eq.
   !> meeting-place).
   pure type(meeting_t) function at_contact(meeting, deflection)
      type(meeting_t), intent(in) :: meeting
      real(wp), intent(in) :: deflection
      at_contact = meeting
      at_contact%to_contact = 0.5_wp*max(0.0_wp, deflection)*meeting%normal
   end function at_contact

   !> Nodes and weights of the other body of a meeting: averaged over the same face as on the element's body,
   !> on the other side of the gap, and spread inward like the forces of its own elements.
   pure subroutine place_partner(elements, level, meeting, partner)
      type(surface_elements_t), intent(in) :: elements
      type(level_t), intent(in) :: level
      type(meeting_t), intent(in) :: meeting
      type(partner_t), intent(out) :: partner
      real(wp) :: place(3), centre(3), span(3, 3), share
      integer :: k, node(3)
      partner%field = meeting%field
      partner%element = elements%element(meeting%element)
      associate (grid => level%grid, turns => level%layout%domain > 0)
         place = (meeting%point - meeting%to_contact - grid%lower)*grid%per_cell
         centre = (meeting%centre - grid%lower)*grid%per_cell
         span = elements%span(:, :, meeting%element)*grid%per_cell
         do k = 1, 3 ! the extent of the element's own domain along the normal does not matter to the other
                     ! body
            span(:, k) = span(:, k) - dot_product(meeting%normal, span(:, k))*meeting%normal
         end do
         share = meeting%share
         if (any(abs(place - nint(centre)) > 1.0_wp)) share = 1.0_wp ! all of the force is within reach
         node = merge(nint(centre), nint(place), share < 1.0_wp)
         call place_face(partner%face, partner%reflection, grid, [0, 0, 0], node, turns, place, span)
         call spread_inward(partner%face, partner%reflection, grid, [0, 0, 0], node, turns, centre, span, &
                            share)
      end associate
   end subroutine place_partner

   !> Request the values of a partner's nodes; a node outside a symmetry plane is replaced by its mirror image
   !> inside.
   subroutine want_nodes(grid, partner, wanted)
      type(grid_level_t), intent(in) :: grid
      type(partner_t), intent(in) :: partner
      type(wanted_nodes_t), intent(inout) :: wanted
      integer :: axis, i, j, k
      do k = 0, partner%face%last
         do j = 0, partner%face%last
            do i = 0, partner%face%last
               associate (node => partner%face%corner + [i, j, k])
                  call wanted%want([(inside(grid, axis, node(axis)), axis=1, 3)], partner%field)
               end associate
            end do
         end do
      end do
   end subroutine want_nodes

   !> Masses of a partner's nodes, from the fetched values.
   pure subroutine take_mass(wanted, first, partner)
      type(wanted_nodes_t), intent(in) :: wanted
      integer, intent(in) :: first
      type(partner_t), intent(inout) :: partner
      integer :: i, j, k, n
      n = first
      do k = 0, partner%face%last
         do j = 0, partner%face%last
            do i = 0, partner%face%last
               partner%mass(i, j, k) = wanted%values(1, n)
               n = n + 1
            end do
         end do
      end do
   end subroutine take_mass

   !> Velocity of a point from fetched nodes, m/s.
   pure function mean_velocity(wanted, first, face) result(velocity)
      type(wanted_nodes_t), intent(in) :: wanted
      integer, intent(in) :: first
      type(face_weights_t), intent(in) :: face
      real(wp) :: velocity(3)
      integer :: i, j, k, n
      n = first
      velocity = 0.0_wp
      do k = 0, face%last
         do j = 0, face%last
            do i = 0, face%last
               velocity = velocity + face%weight(i, j, k)*wanted%values(2:4, n)
               n = n + 1
            end do
         end do
      end do
   end function mean_velocity

   !> Limit the force on a node to what its mass can bear; the others get the rest (theory.md, eq. capped). If
   !> hardly any node has mass the force is not `held`.
   pure subroutine cap(face, mass, particle_mass, held)
      type(face_weights_t), intent(inout) :: face
      real(wp), intent(in) :: mass(0:, 0:, 0:)  !< of the nodes, kg
      real(wp), intent(in) :: particle_mass     !< kg
      logical, intent(out) :: held
      real(wp) :: total
      integer :: n
      n = face%last
      associate (weight => face%weight(0:n, 0:n, 0:n))
         where (weight < hair) weight = 0.0_wp
         weight = min(weight, max_weight*bearable(mass(0:n, 0:n, 0:n)/particle_mass))
         total = sum(weight)
         held = total > min_held
         if (held) weight = weight/total
      end associate
   end subroutine cap

   !> Weight that a node can bear, by its mass relative to the particle's. The square root alone would keep
   !> weight squared over mass, by which a force moves the point, whatever the mass: a node of round-off would
   !> make the point as soft as a node of the particle.
   pure elemental real(wp) function bearable(mass)
      real(wp), intent(in) :: mass
      bearable = sqrt(mass)*min(1.0_wp, mass/no_mass)
   end function bearable

end module m_partner_point
