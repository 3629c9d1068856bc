!> The surface of another body near an element: gap, normal and the point of the force there, by moving least
!> squares over that body's elements (theory.md, eqs partner-gap, partner-foot, partner-normal; implicit
!> moving least squares: Shen, O'Brien and Shewchuk 2004).
module m_partner_surface
   use m_kinds, only: wp
   use m_vectors, only: tangents
   use m_surface_elements, only: element_t, surface_elements_t, share_at
   implicit none
   private
   public :: meeting_t, find_meetings, reach_of, farthest_gap

   !> An element and another body near it.
   type :: meeting_t
      integer :: element = 0          !< its number among the elements
      integer :: field = 0            !< of the other body
      real(wp) :: gap = 0.0_wp        !< m
      real(wp) :: normal(3) = 0.0_wp  !< outward from the other body
      real(wp) :: point(3) = 0.0_wp   !< point of the force on the other body, m
      real(wp) :: centre(3) = 0.0_wp  !< mean centre of its particles behind that point, m
      real(wp) :: share = 1.0_wp      !< share of the force at the point; the rest acts at the centre
      real(wp) :: to_contact(3) = 0.0_wp !< from the element's face to where the surfaces meet, m
      real(wp) :: mass = 0.0_wp       !< of the other body's particles there, kg
      real(wp) :: velocity(3) = 0.0_wp !< of them, m/s
   end type meeting_t

   real(wp), parameter :: reach_of = 2.0_wp     !< of the weights, in particle edges
   real(wp), parameter :: farthest_gap = 1.2_wp !< largest gap considered, in particle edges
   real(wp), parameter :: facing = 0.3_wp       !< cosine between normals: of elements on one side, or on two
                                                !< sides that face each other
   real(wp), parameter :: across = 0.55_wp*sqrt(2.0_wp) !< end of a surface from the middle of its last
                                                        !< element, in its length: slightly more than half a
                                                        !< diagonal
   real(wp), parameter :: alone = 1.0e-10_wp !< spread of a single element, relative to its squared distance:
                                             !< round-off without information on curvature
   integer, parameter :: sharpness = 8 !< exponent of the flatness in weighting the normal towards the flatter
                                       !< body
   real(wp), parameter :: corner = 0.2_wp !< share of the normals' differences not explained by curvatures
                                          !< from which on there is a corner
   real(wp), parameter :: tight(2) = [0.5_wp, 0.75_wp] !< curvature times edge: up to the first a surface may
                                                       !< be smooth, from the second on it has a corner
   real(wp), parameter :: one_line = 0.02_wp !< determinant of the spread of positions over its trace squared:
                                             !< below it they are collinear, with one curvature

   !> Weighted sums (m2) over the elements of one field near an element. Positions are relative to its own
   !> face.
   type :: view_t
      real(wp) :: weight = 0.0_wp, normal(3) = 0.0_wp, mass = 0.0_wp
      real(wp) :: velocity(3) = 0.0_wp
      real(wp), dimension(3) :: place = 0.0_wp, force_place = 0.0_wp, centre_place = 0.0_wp !< of faces, of
                                                                       !< force points, of particles
      real(wp) :: along = 0.0_wp, force_along = 0.0_wp, centre_along = 0.0_wp !< of these, along each normal
      real(wp), dimension(3, 3) :: spread = 0.0_wp !< second moments of the faces' positions,
      real(wp), dimension(3, 3) :: turn = 0.0_wp   !< of the normals with these
      real(wp), dimension(3, 3) :: tilt = 0.0_wp   !< and of the normals with themselves
      real(wp) :: edge = 0.0_wp                        !< of the particles
      real(wp) :: lateral = huge(1.0_wp)               !< distance to the nearest element, in its length
   end type view_t

   !> A surface at the foot point of an element.
   type :: foot_t
      logical :: exists = .false.
      real(wp) :: normal(3) = 0.0_wp
      real(wp) :: share = 0.0_wp !< 1 where it is flat, almost 0 at a corner
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
         if (.not. elements%has_company(elements%field(e), elements%list(e)%face, &
                                        reach_of*elements%longest)) cycle
         call elements%near(e, bin, found, numbers)
         call find_views(elements, e, numbers(:found), views)
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

   !> Collect the sums over all fields for an element: of its own field the surface around it, of others the
   !> elements facing it.
   pure subroutine find_views(elements, e, numbers, views)
      type(surface_elements_t), intent(in) :: elements
      integer, intent(in) :: e, numbers(:)
      type(view_t), intent(out) :: views(:) !< (fields)
      real(wp) :: apart(3), square, farthest, cosine, share, away, lateral(3), to_point(3), to_centre(3)
      integer :: field, j, n
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
                  do j = 1, 3
                     view%spread(:, j) = view%spread(:, j) + (share*apart(j))*apart
                     view%turn(:, j) = view%turn(:, j) + (share*apart(j))*there%normal
                     view%tilt(:, j) = view%tilt(:, j) + (share*there%normal(j))*there%normal
                  end do
                  view%force_place = view%force_place + share*to_point
                  view%force_along = view%force_along + share*dot_product(there%normal, to_point)
                  view%centre_place = view%centre_place + share*to_centre
                  view%centre_along = view%centre_along + share*dot_product(there%normal, to_centre)
                  view%edge = view%edge + share*there%edge
                  view%mass = view%mass + share*there%mass
                  view%velocity = view%velocity + share*there%velocity
                  view%lateral = min(view%lateral, sqrt(dot_product(lateral, lateral)/there%area))
               end associate
            end associate
         end do
      end associate
   end subroutine find_views

   !> The normal of a surface at the foot point of an element: the mean of the surrounding ones, rotated by
   !> the surface's curvatures from their middle to the foot point. The curvatures are those that best fit the
   !> normals, along two tangents; the residual indicates a corner. Exact on spheres, cylinders and planes.
   pure type(foot_t) function foot_of(view) result(foot)
      type(view_t), intent(in) :: view
      real(wp) :: axes(3, 2), axis(3), places(2, 2), normals(2, 2), curvature(2, 2), scatter, left
      real(wp) :: mean_place(3), mean_normal(3), determinant, rough, across(2)
      foot%exists = norm2(view%normal) > 0.0_wp
      if (.not. foot%exists) return
      mean_normal = view%normal/view%weight
      mean_place = view%place/view%weight
      axis = view%normal/norm2(view%normal)
      axes = tangents(axis)
      places = along_axes(view%spread/view%weight - outer(mean_place, mean_place))
      normals = along_axes(view%turn/view%weight - outer(mean_normal, mean_place))
      determinant = places(1, 1)*places(2, 2) - places(1, 2)*places(2, 1)
      if (trace(places) <= alone*trace(along_axes(view%spread))/view%weight) then
         curvature = 0.0_wp
      else if (determinant > one_line*trace(places)**2) then
         curvature = matmul(normals, reshape([places(2, 2), -places(2, 1), -places(1, 2), places(1, 1)], &
                                             [2, 2]))/determinant
      else
         curvature = trace(normals)/trace(places)*reshape([1.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [2, 2])
      end if
      ! differences of the normals: in total, and not explained by curvature
      scatter = max(0.0_wp, 1.0_wp - dot_product(mean_normal, mean_normal))
      left = trace(along_axes(view%tilt/view%weight - outer(mean_normal, mean_normal))) &
             - sum(curvature*normals)
      rough = max((norm2(curvature)*view%edge/view%weight - tight(1))/(tight(2) - tight(1)), 0.0_wp)
      if (scatter > epsilon(1.0_wp)) rough = max(rough, left/(corner*scatter))
      foot%share = (1.0_wp - scatter*min(1.0_wp, rough))**(sharpness/2)
      across = -foot%share*matmul(curvature, matmul(mean_place, axes))
      foot%normal = matmul(axes, across) + sqrt(max(0.25_wp, 1.0_wp - dot_product(across, across)))*axis
      foot%normal = foot%normal/norm2(foot%normal)
   contains
      pure function along_axes(tensor) result(plane)
         real(wp), intent(in) :: tensor(3, 3)
         real(wp) :: plane(2, 2)
         plane = matmul(transpose(axes), matmul(tensor, axes))
      end function along_axes

      pure function outer(a, b) result(tensor)
         real(wp), intent(in) :: a(3), b(3)
         real(wp) :: tensor(3, 3)
         tensor = spread(a, 2, 3)*spread(b, 1, 3)
      end function outer

      pure real(wp) function trace(plane)
         real(wp), intent(in) :: plane(2, 2)
         trace = plane(1, 1) + plane(2, 2)
      end function trace
   end function foot_of

   !> Distance of a surface from the face of an element (m), by positions on it or by force points: along the
   !> middle between each normal and that at the foot point where the surface is smooth, along each normal at
   !> corners.
   pure real(wp) function gap_to(view, foot, along, place) result(gap)
      type(view_t), intent(in) :: view
      type(foot_t), intent(in) :: foot
      real(wp), intent(in) :: along, place(3) !< sums
      gap = -foot%share*(along + dot_product(foot%normal, place)) &
            /(view%weight + dot_product(foot%normal, view%normal)) - (1.0_wp - foot%share)*along/view%weight
   end function gap_to

   !> Gap, normal and force point of a meeting, if there is one.
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
