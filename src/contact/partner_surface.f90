!> The surface of another body as an element meets it: gap, normal and where the force acts there, by moving
!> least squares over that body's elements (theory.md, eqs partner-gap, partner-foot, partner-normal; implicit
!> moving least squares: Shen, O'Brien and Shewchuk 2004; curvature by a fitted sphere: Guennebaud and Gross
!> 2007).
module m_partner_surface
   use m_kinds, only: wp
   use m_surface_elements, only: element_t, surface_elements_t, share_at
   implicit none
   private
   public :: meeting_t, find_meetings, reach_of, farthest_gap

   !> An element and another body that it is near.
   type :: meeting_t
      integer :: element = 0          !< its number among the elements
      integer :: field = 0            !< of the other body
      real(wp) :: gap = 0.0_wp        !< m
      real(wp) :: normal(3) = 0.0_wp  !< outward from the other body
      real(wp) :: point(3) = 0.0_wp   !< where the force acts on the other body, m
      real(wp) :: centre(3) = 0.0_wp  !< of its particles behind that point, m
      real(wp) :: share = 1.0_wp      !< of the force that acts at the point; the rest does at the centre
      real(wp) :: mass = 0.0_wp       !< of the other body's particles there, kg
      real(wp) :: velocity(3) = 0.0_wp !< of them, m/s
   end type meeting_t

   real(wp), parameter :: reach_of = 2.0_wp     !< of the weights, in particle edges
   real(wp), parameter :: farthest_gap = 1.2_wp !< that is looked at, in particle edges
   real(wp), parameter :: facing = 0.3_wp       !< cosine between normals: elements of one side, or of two
                                                !< sides that face each other
   real(wp), parameter :: across = 0.55_wp*sqrt(2.0_wp) !< a surface ends so far from the middle of its last
                                                        !< element, in its length: half a diagonal and
                                                        !< a little
   real(wp), parameter :: alone = 1.0e-10_wp !< spread of a single element, of its squared distance:
                                             !< round-off, that tells no curvature
   integer, parameter :: sharpness = 8 !< power of the flatness with which the flatter body gives the normal

   !> What an element sees of one field: sums with weights (m2). Places are those from its own face.
   type :: view_t
      real(wp) :: weight = 0.0_wp, normal(3) = 0.0_wp, mass = 0.0_wp
      real(wp) :: velocity(3) = 0.0_wp
      real(wp), dimension(3) :: place = 0.0_wp, force_place = 0.0_wp, centre_place = 0.0_wp !< of faces, of
                                                                       !< force points, of particles
      real(wp) :: along = 0.0_wp, force_along = 0.0_wp, centre_along = 0.0_wp !< of these, along each normal
      real(wp) :: square = 0.0_wp                      !< of the faces' distances
      real(wp) :: lateral = huge(1.0_wp)               !< to the nearest element, in its length
   end type view_t

   !> A surface where an element meets it.
   type :: foot_t
      logical :: exists = .false.
      real(wp) :: normal(3) = 0.0_wp
      real(wp) :: share = 0.0_wp !< 1 where it is flat, next to nothing at a corner
   end type foot_t

contains

   !> Meetings of this rank's elements with other bodies.
   subroutine find_meetings(elements, meetings, count)
      type(surface_elements_t), intent(in) :: elements
      type(meeting_t), allocatable, intent(inout) :: meetings(:)
      integer, intent(out) :: count
      type(view_t) :: views(size(elements%low, 2))
      type(meeting_t), allocatable :: more(:)
      integer, allocatable :: numbers(:)
      integer :: bin(3), e, field, found
      logical :: meets
      count = 0
      found = 0
      bin = 0
      if (.not. allocated(meetings)) allocate (meetings(64))
      do e = 1, elements%own
         if (.not. has_company(elements, e)) cycle
         call elements%near(e, bin, found, numbers)
         call look(elements, e, numbers(:found), views)
         do field = 1, size(views)
            if (field == elements%field(e)) cycle
            if (views(field)%lateral > across) cycle
            if (count == size(meetings)) then
               allocate (more(2*count))
               more(:count) = meetings
               call move_alloc(more, meetings)
            end if
            call meet(elements%list(e), views(elements%field(e)), views(field), &
                      meetings(count + 1), meets)
            if (.not. meets) cycle
            count = count + 1
            meetings(count)%element = e
            meetings(count)%field = field
         end do
      end do
   end subroutine find_meetings

   !> True when another field's elements may be near.
   pure logical function has_company(elements, e)
      type(surface_elements_t), intent(in) :: elements
      integer, intent(in) :: e
      real(wp) :: reach
      integer :: field
      reach = reach_of*elements%longest
      has_company = .false.
      do field = 1, size(elements%low, 2)
         if (field == elements%field(e)) cycle
         has_company = has_company .or. (all(elements%list(e)%face > elements%low(:, field) - reach) &
                                         .and. all(elements%list(e)%face < elements%high(:, field) + reach))
      end do
   end function has_company

   !> What an element sees of all fields: of its own the surface around it, of others what faces it.
   pure subroutine look(elements, e, numbers, views)
      type(surface_elements_t), intent(in) :: elements
      integer, intent(in) :: e, numbers(:)
      type(view_t), intent(out) :: views(:) !< (fields)
      real(wp) :: apart(3), square, farthest, cosine, share, away, lateral(3), to_point(3), to_centre(3)
      integer :: field, n
      farthest = (reach_of*elements%longest)**2
      associate (here => elements%list(e))
         do n = 1, size(numbers)
            associate (there => elements%list(numbers(n)))
               apart = there%face - here%face
               square = dot_product(apart, apart)
               if (square >= farthest) cycle
               field = elements%field(numbers(n))
               cosine = dot_product(here%normal, there%normal)
               if (field == elements%field(e)) cosine = -cosine
               if (cosine > -facing) cycle
               share = 1.0_wp - square/(reach_of*max(here%edge, there%edge))**2
               if (share <= 0.0_wp) cycle
               share = share**4*there%area
               away = dot_product(there%normal, apart)
               lateral = apart - away*there%normal
               to_point = there%point - here%face
               to_centre = there%centre - here%face
               associate (view => views(field))
                  view%weight = view%weight + share
                  view%normal = view%normal + share*there%normal
                  view%place = view%place + share*apart
                  view%along = view%along + share*away
                  view%square = view%square + share*square
                  view%force_place = view%force_place + share*to_point
                  view%force_along = view%force_along + share*dot_product(there%normal, to_point)
                  view%centre_place = view%centre_place + share*to_centre
                  view%centre_along = view%centre_along + share*dot_product(there%normal, to_centre)
                  view%mass = view%mass + share*there%mass
                  view%velocity = view%velocity + share*there%velocity
                  view%lateral = min(view%lateral, sqrt(dot_product(lateral, lateral)/there%area))
               end associate
            end associate
         end do
      end associate
   end subroutine look

   !> The normal of a surface where an element meets it: the mean of those around, turned by the surface's
   !> curvature from their middle to the foot of the element. Exact on spheres.
   pure type(foot_t) function foot_of(view) result(foot)
      type(view_t), intent(in) :: view
      real(wp) :: length, spread_of, curvature
      length = norm2(view%normal)
      foot%exists = length > 0.0_wp
      if (.not. foot%exists) return
      foot%share = (length/view%weight)**sharpness
      spread_of = view%square - dot_product(view%place, view%place)/view%weight
      curvature = 0.0_wp
      if (spread_of > alone*view%square) curvature = foot%share &
         *(view%along - dot_product(view%normal, view%place)/view%weight)/spread_of
      foot%normal = view%normal - curvature*view%place
      foot%exists = norm2(foot%normal) > 0.0_wp
      if (foot%exists) foot%normal = foot%normal/norm2(foot%normal)
   end function foot_of

   !> How far a surface is from the face of the element that meets it (m), by places on it or by force points:
   !> along the middle between each normal and that at the foot where the surface is smooth, along each normal
   !> at corners.
   pure real(wp) function gap_to(view, foot, along, place) result(gap)
      type(view_t), intent(in) :: view
      type(foot_t), intent(in) :: foot
      real(wp), intent(in) :: along, place(3) !< sums
      gap = -foot%share*(along + dot_product(foot%normal, place)) &
            /(view%weight + dot_product(foot%normal, view%normal)) - (1.0_wp - foot%share)*along/view%weight
   end function gap_to

   !> Gap, normal and point of the force of a meeting, if there is one.
   pure subroutine meet(here, own, other, meeting, meets)
      type(element_t), intent(in) :: here
      type(view_t), intent(in) :: own, other !< its own field and another
      type(meeting_t), intent(inout) :: meeting
      logical, intent(out) :: meets
      type(foot_t) :: feet(2)
      real(wp) :: to_point, to_centre
      feet = [foot_of(own), foot_of(other)]
      meets = all(feet%exists)
      if (.not. meets) return
      meeting%gap = gap_to(other, feet(2), other%along, other%place)
      meeting%normal = feet(2)%share*feet(2)%normal - feet(1)%share*feet(1)%normal
      meets = norm2(meeting%normal) > epsilon(1.0_wp) .and. abs(meeting%gap) < farthest_gap*here%edge
      if (.not. meets) return
      meeting%normal = meeting%normal/norm2(meeting%normal)
      to_point = gap_to(other, feet(2), other%force_along, other%force_place)
      to_centre = gap_to(other, feet(2), other%centre_along, other%centre_place)
      meeting%point = here%face - to_point*meeting%normal
      meeting%centre = here%face - to_centre*meeting%normal
      meeting%share = share_at(to_centre - meeting%gap, to_centre - to_point)
      meeting%mass = other%mass/other%weight
      meeting%velocity = other%velocity/other%weight
   end subroutine meet

end module m_partner_surface
