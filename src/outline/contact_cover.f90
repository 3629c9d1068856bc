!> The area that a contact covers between its points, and its part inside mirrors (theory.md, eq.
!> contact-edge); for a section, whose points are all on one line, its area.
module m_contact_cover
   use m_kinds, only: wp
   use m_section, only: section_t
   use m_surface_points, only: surface_point_t, squares_t, find_neighbours
   use m_contact_edge, only: edges_t, find_edges
   implicit none
   private
   public :: mirror_t, beyond_mirror, share_inside, covers, between, area_of_section

   !> A plane of symmetry parallel to the axis: a line, with `normal` . position >= `from` inside.
   type :: mirror_t
      real(wp) :: normal(2) = 0.0_wp, from = 0.0_wp
   end type mirror_t

   real(wp), parameter, public :: beside = 0.75_wp !< edges, in the projection
   integer, parameter :: on_line = 64       !< steps per edge for the area of a section

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

   !> True when the contact covers a position.
   logical function covers(points, squares, in_contact, edges, edge, place, near)
      type(surface_point_t), intent(in) :: points(:)
      type(squares_t), intent(in) :: squares
      logical, intent(in) :: in_contact(:)
      type(edges_t), intent(in) :: edges
      real(wp), intent(in) :: edge     !< of the particles, m
      real(wp), intent(in) :: place(2) !< m
      integer, intent(inout) :: near(:) !< work
      real(wp) :: distance, nearest, nearest_out
      integer :: found, m, p, out
      call find_neighbours(points, squares, place, max(edge, edges%farthest), near, found)
      covers = .false.
      out = 0
      nearest = huge(nearest)
      nearest_out = huge(nearest)
      do m = 1, found
         p = near(m)
         distance = norm2(points(p)%place - place)
         if (distance < nearest) covers = in_contact(p) .and. distance < beside*edge
         nearest = min(nearest, distance)
         if (.not. edges%known(p) .or. distance >= min(nearest_out, edges%sight(p))) cycle
         nearest_out = distance
         out = p
      end do
      if (out > 0) covers = nearest < edge .and. dot_product(points(out)%place - place, &
                                                             edges%outwards(:, out)) > edges%back(out)
   end function covers

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
      integer :: i, near(size(points)), steps
      edges = find_edges(points, squares, in_contact, cell)
      along = 0.0_wp ! the points lie along it; the other direction is normal to the section
      along(maxloc([maxval(abs(points%place(1))), maxval(abs(points%place(2)))], dim=1)) = 1.0_wp
      edge = sum(points%edge, mask=in_contact)/count(in_contact)
      low = minval(along(1)*points%place(1) + along(2)*points%place(2), mask=in_contact) - edge
      high = maxval(along(1)*points%place(1) + along(2)*points%place(2), mask=in_contact) + edge
      steps = ceiling((high - low)/edge*on_line)
      width = (high - low)/steps
      area = 0.0_wp
      do i = 0, steps - 1
         at = low + width*(i + 0.5_wp)
         if (beyond_mirror(mirrors, at*along)) cycle
         if (covers(points, squares, in_contact, edges, edge, at*along, near)) &
            area = area + width*section%depth(abs(at))
      end do
   end function area_of_section

end module m_contact_cover
