!> The area that a contact covers between its points, and its part inside mirrors (theory.md, eq.
!> contact-edge); for a section, whose points are all on one line, its area.
module m_contact_cover
   use m_kinds, only: wp
   use m_section, only: section_t
   use m_surface_points, only: surface_point_t, squares_t, sorted_near
   use m_contact_edge, only: edges_t, find_edges
   implicit none
   private
   public :: mirror_t, share_inside, find_inside, find_covered, between, area_of_section

   !> A plane of symmetry parallel to the axis: a line, with `normal` . position >= `from` inside.
   type :: mirror_t
      real(wp) :: normal(2) = 0.0_wp, from = 0.0_wp
   end type mirror_t

   real(wp), parameter, public :: beside = 0.75_wp !< edges, in the projection
   real(wp), parameter :: wider = 1.06_wp   !< a domain covers a circle around it, wider by this: .75 edges
                                            !< for one along the axes
   integer, parameter :: on_line = 64       !< steps per edge for the area of a section
   real(wp), parameter :: crosses = 0.01_wp !< cosine: rows below it hardly cross a mirror

contains

   !> True when a position is the mirror image of one inside.
   pure logical function beyond_mirror(mirrors, place)
      type(mirror_t), intent(in) :: mirrors(:)
      real(wp), intent(in) :: place(2)
      integer :: m
      beyond_mirror = any([(dot_product(mirrors(m)%normal, place) < mirrors(m)%from, m=1, size(mirrors))])
   end function beyond_mirror

   !> Part of a small square that is no mirror image: mirrors cut squares anywhere.
   pure real(wp) function share_inside(mirrors, place, width) result(share)
      type(mirror_t), intent(in) :: mirrors(:)
      real(wp), intent(in) :: place(2), width !< its centre and width, m
      integer :: m
      share = 1.0_wp
      do m = 1, size(mirrors)
         share = share*min(1.0_wp, max(0.0_wp, 0.5_wp + (dot_product(mirrors(m)%normal, place) &
                                                        - mirrors(m)%from)/width))
      end do
   end function share_inside

   !> The squares of a row along the first direction beyond which all are mirror images: first and last, from
   !> 0.
   pure subroutine find_inside(mirrors, start, width, squares, first, last)
      type(mirror_t), intent(in) :: mirrors(:)
      real(wp), intent(in) :: start(2), width !< middle of the row's left edge; width of a square, m
      integer, intent(in) :: squares          !< in the row
      integer, intent(out) :: first, last
      real(wp) :: into !< of the row's left end into a mirror's inside, where half a square still counts, m
      integer :: m
      first = 0
      last = squares - 1
      do m = 1, size(mirrors)
         associate (along => mirrors(m)%normal(1))
            into = dot_product(mirrors(m)%normal, start) - mirrors(m)%from + width
            if (along > crosses) then
               first = max(first, floor(-into/(along*width)))
            else if (along < -crosses) then
               last = min(last, ceiling(-into/(along*width)))
            else if (into + crosses*width*squares < 0.0_wp) then
               last = -1
            end if
         end associate
      end do
   end subroutine find_inside

   !> Which positions of a row the contact covers: those at start + along (i + 1/2) width, from i = first on.
   !> Each point is asked for the positions that it reaches: the nearest point counts, and before it the edge
   !> of the nearest point that has found one. Where that is the end of the body, domains beyond it count.
   pure subroutine find_covered(points, squares, in_contact, edges, edge, along, start, width, first, covered)
      type(surface_point_t), intent(in) :: points(:)
      type(squares_t), intent(in) :: squares
      logical, intent(in) :: in_contact(:)
      type(edges_t), intent(in) :: edges
      real(wp), intent(in) :: edge !< of the particles, m
      real(wp), intent(in) :: along(2), start(2), width !< unit vector; m
      integer, intent(in) :: first
      logical, intent(out) :: covered(first:)
      real(wp), dimension(first:ubound(covered, 1)) :: nearest, nearest_out !< squared distances, m2
      integer, dimension(first:ubound(covered, 1)) :: out
      logical, dimension(first:ubound(covered, 1)) :: within
      real(wp) :: half, middle, near, reach, square, widest
      integer :: i, n, of_row(2), p
      covered = .false.
      nearest = huge(edge)
      nearest_out = huge(edge)
      out = 0
      within = .false.
      widest = wider*sqrt(maxval(points%half(1)**2 + points%half(2)**2))
      of_row = sorted_near(squares, start, start + along*width*(first + size(covered)), &
                           max(edge, widest, edges%farthest))
      do n = of_row(1), of_row(2)
         p = squares%point(n)
         near = max(beside*edge, wider*norm2(points(p)%half))
         reach = max(edge, near)
         if (edges%known(p)) reach = max(reach, edges%sight(p))
         middle = dot_product(along, points(p)%place - start)/width - 0.5_wp
         half = reach**2 - (along(1)*(points(p)%place(2) - start(2)) - along(2)*(points(p)%place(1) &
                                                                               - start(1)))**2
         if (half < 0.0_wp) cycle
         half = sqrt(half)/width + 0.01_wp ! whatever the rounding
         do i = max(first, ceiling(middle - half)), min(ubound(covered, 1), floor(middle + half))
            square = sum((points(p)%place - position(i))**2)
            if (square < nearest(i)) then
               nearest(i) = square
               covered(i) = in_contact(p) .and. square < near**2
            end if
            if (in_contact(p)) &
               within(i) = within(i) .or. all(abs(points(p)%place - position(i)) < points(p)%half)
            if (.not. edges%known(p) .or. square >= min(nearest_out(i), edges%sight(p)**2)) cycle
            nearest_out(i) = square
            out(i) = p
         end do
      end do
      do i = first, ubound(covered, 1)
         if (out(i) == 0) cycle
         associate (towards => dot_product(points(out(i))%place - position(i), edges%outwards(:, out(i))))
            if (in_contact(out(i))) then
               covered(i) = nearest(i) < edge**2 .and. (towards > 0.0_wp .or. within(i))
            else
               covered(i) = nearest(i) < edge**2 .and. towards > edges%back(out(i))
            end if
         end associate
      end do
   contains
      pure function position(i)
         integer, intent(in) :: i
         real(wp) :: position(2)
         position = start + along*(width*(i + 0.5_wp))
      end function position
   end subroutine find_covered

   !> The points on the line of a section with others in contact near on both sides.
   pure function between(points, in_contact, distance)
      type(surface_point_t), intent(in) :: points(:)
      logical, intent(in) :: in_contact(:)
      real(wp), intent(in) :: distance !< m
      logical :: between(size(points))
      real(wp) :: along(size(points))
      integer :: p
      along = sum_of_places(points)
      do p = 1, size(points)
         between(p) = .not. in_contact(p) .and. points(p)%gap <= points(p)%edge &
                      .and. any(in_contact .and. along > along(p) .and. along < along(p) + distance) &
                      .and. any(in_contact .and. along < along(p) .and. along > along(p) - distance)
      end do
   end function between

   !> Coordinates along the line of a section, m: normal to it they are 0.
   pure elemental real(wp) function sum_of_places(point)
      type(surface_point_t), intent(in) :: point
      sum_of_places = point%place(1) + point%place(2)
   end function sum_of_places

   !> Area (m2) of the contact represented by a section: covered steps of a line, each once around the axis,
   !> or for a metre. The same on every rank.
   real(wp) function area_of_section(points, squares, in_contact, mirrors, section, cell) result(area)
      type(surface_point_t), intent(in) :: points(:)
      type(squares_t), intent(in) :: squares
      logical, intent(in) :: in_contact(:)
      type(mirror_t), intent(in) :: mirrors(:)
      type(section_t), intent(in) :: section
      real(wp), intent(in) :: cell !< m
      real(wp) :: along(2), low, high, edge, width, at
      type(edges_t) :: edges
      integer :: i, steps
      logical, allocatable :: covered(:)
      edges = find_edges(points, squares, in_contact, cell)
      along = 0.0_wp ! the points lie along it; the other direction is normal to the section
      along(maxloc([maxval(abs(points%place(1))), maxval(abs(points%place(2)))], dim=1)) = 1.0_wp
      edge = sum(points%edge, mask=in_contact)/count(in_contact)
      low = minval(along(1)*points%place(1) + along(2)*points%place(2), mask=in_contact) - edge
      high = maxval(along(1)*points%place(1) + along(2)*points%place(2), mask=in_contact) + edge
      steps = ceiling((high - low)/edge*on_line)
      width = (high - low)/steps
      allocate (covered(0:steps - 1))
      call find_covered(points, squares, in_contact, edges, edge, along, low*along, width, 0, covered)
      area = 0.0_wp
      do i = 0, steps - 1
         at = low + width*(i + 0.5_wp)
         if (covered(i) .and. .not. beyond_mirror(mirrors, at*along)) &
            area = area + width*section%depth(abs(at))
      end do
   end function area_of_section

end module m_contact_cover
