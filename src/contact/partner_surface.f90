!> The surface of another body as an element meets it: gap, normal and where the force acts there, by moving
!> least squares over that body's elements (theory.md, eqs partner-gap, partner-normal; implicit moving least
!> squares: Shen, O'Brien and Shewchuk 2004).
module m_partner_surface
   use m_kinds, only: wp
   use m_surface_elements, only: element_t, surface_elements_t
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
   integer, parameter :: sharpness = 8 !< power of the flatness with which the flatter body gives the normal

   !> What an element sees of one field.
   type :: view_t
      real(wp) :: weight = 0.0_wp, normal(3) = 0.0_wp, gap = 0.0_wp, force_gap = 0.0_wp, mass = 0.0_wp
      real(wp) :: velocity(3) = 0.0_wp
      real(wp) :: lateral = huge(1.0_wp) !< to the nearest element, in its length
   end type view_t

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
      real(wp) :: apart(3), cosine, share, away, lateral(3)
      integer :: field, n
      associate (here => elements%list(e))
         do n = 1, size(numbers)
            associate (there => elements%list(numbers(n)))
               field = elements%field(numbers(n))
               cosine = dot_product(here%normal, there%normal)
               if (field == elements%field(e)) cosine = -cosine
               if (cosine > -facing) cycle
               apart = here%face - there%face
               share = 1.0_wp - dot_product(apart, apart)/(reach_of*max(here%edge, there%edge))**2
               if (share <= 0.0_wp) cycle
               share = share**4*there%area
               away = dot_product(there%normal, apart)
               lateral = apart - away*there%normal
               associate (view => views(field))
                  view%weight = view%weight + share
                  view%normal = view%normal + share*there%normal
                  view%gap = view%gap + share*away
                  view%force_gap = view%force_gap + share*dot_product(there%normal, here%face - there%point)
                  view%mass = view%mass + share*there%mass
                  view%velocity = view%velocity + share*there%velocity
                  view%lateral = min(view%lateral, sqrt(dot_product(lateral, lateral)/there%area))
               end associate
            end associate
         end do
      end associate
   end subroutine look

   !> Gap, normal and point of the force of a meeting, if there is one.
   pure subroutine meet(here, own, other, meeting, meets)
      type(element_t), intent(in) :: here
      type(view_t), intent(in) :: own, other !< its own field and another
      type(meeting_t), intent(inout) :: meeting
      logical, intent(out) :: meets
      real(wp) :: flatness(2), length(2)
      length = [norm2(own%normal), norm2(other%normal)]
      meets = all(length > 0.0_wp) .and. other%weight > 0.0_wp
      if (.not. meets) return
      flatness = length/[own%weight, other%weight]
      meeting%gap = other%gap/other%weight
      meeting%normal = flatness(2)**sharpness*other%normal/length(2) &
                       - flatness(1)**sharpness*own%normal/length(1)
      meets = norm2(meeting%normal) > epsilon(1.0_wp) .and. abs(meeting%gap) < farthest_gap*here%edge
      if (.not. meets) return
      meeting%normal = meeting%normal/norm2(meeting%normal)
      meeting%point = here%face - other%force_gap/other%weight*meeting%normal
      meeting%mass = other%mass/other%weight
      meeting%velocity = other%velocity/other%weight
   end subroutine meet

end module m_partner_surface
