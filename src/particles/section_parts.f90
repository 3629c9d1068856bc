!> Parts of particles, and how the parts of a particle on a section share its values: rings have more where
!> the radius is larger (theory.md, Sections).
module m_section_parts
   use m_kinds, only: wp
   use m_section, only: section_t
   use m_vectors, only: cross
   use m_field_table, only: layout_t, shares_t
   use m_half_edges, only: half_edges, set_half_edges
   implicit none
   private
   public :: octant_of, octants_of, split_in_four, share_of_ring, beside_axis, carried, share_faces, &
             share_start

   real(wp), parameter :: farthest_inward = 0.8_wp !< of the radius: parts of rings lie no nearer to the axis
   real(wp), parameter :: at_end = 1.0e-3_wp !< a carried face so near to the end of its domain, in half
                                             !< edges, lies on it

contains

   !> Signs of the vector from the centre of a particle to that of its octant (0 to 7).
   pure function octant_of(octant) result(signs)
      integer, intent(in) :: octant
      real(wp) :: signs(3)
      signs = real(2*[ibits(octant, 0, 1), ibits(octant, 1, 1), ibits(octant, 2, 1)] - 1, wp)
   end function octant_of

   !> Octants into which a particle is split: all, or those of a section's plane.
   pure function octants_of(section) result(octants)
      type(section_t), intent(in) :: section
      integer, allocatable :: octants(:)
      if (section%is_flat()) then
         octants = [0, 1, 4, 5]
      else
         octants = [0, 1, 2, 3, 4, 5, 6, 7]
      end if
   end function octants_of

   !> The parts of a particle on a section: halved along its two in-plane edges.
   pure subroutine split_in_four(values, layout, shares, parts)
      real(wp), intent(in) :: values(:)
      type(layout_t), intent(in) :: layout
      type(shares_t), intent(in) :: shares
      real(wp), intent(out) :: parts(:, 0:)
      real(wp) :: r(3, 3), l(3, 3), shift(3, 4), slip, side(3)
      integer :: n, octants(4)
      parts = 0.0_wp
      octants = octants_of(layout%section)
      r = 0.5_wp*half_edges(values, layout)
      l = 0.0_wp
      if (layout%gradient > 0) l = reshape(values(layout%gradient:layout%gradient + 8), [3, 3])
      do n = 1, 4
         side = octant_of(octants(n))
         side(2) = 0.0_wp
         shift(:, n) = beside_axis(values, layout, matmul(r, side))
      end do
      slip = 0.0_wp
      do n = 1, 4
         slip = slip + 0.25_wp*share_of_ring(values, layout, shift(:, n))*dot_product(l(3, :), shift(:, n))
      end do
      do n = 1, 4
         associate (part => parts(:, octants(n)), v => layout%velocity)
            part = merge(0.25_wp*share_of_ring(values, layout, shift(:, n))*values, values, shares%extensive)
            part(carried(shares)) = values(carried(shares))
            side = octant_of(octants(n))
            call share_faces(part, shares, layout, values(layout%position), 2.0_wp*r, 1, side(1))
            call share_faces(part, shares, layout, values(layout%position) + side(1)*r(1, 1), 2.0_wp*r, 3, &
                             side(3))
            part(layout%position:layout%position + 2) = values(layout%position:layout%position + 2) &
                                                        + shift(:, n)
            part(v:v + 2) = values(v:v + 2) + matmul(l, shift(:, n))
            part(v + 2) = part(v + 2) - slip
            part(v + 1) = 0.0_wp
            call set_half_edges(part, layout, r)
            side(2) = 0.0_wp
            call share_start(part, values, layout, 0.5_wp*side, shift(:, n))
            part(layout%generation) = values(layout%generation) + 3.0_wp
            part(layout%refinement) = values(layout%refinement) + 1.0_wp
         end associate
      end do
   end subroutine split_in_four

   !> The share of a part as a ring, relative to its share by area: more where the radius is larger
   !> (theory.md, Sections).
   pure real(wp) function share_of_ring(values, layout, shift) result(share)
      real(wp), intent(in) :: values(:) !< of the whole
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: shift(3)  !< from the whole's centre to the part's, m
      share = 1.0_wp
      if (layout%section%is_round()) share = 1.0_wp + shift(1)/values(layout%position)
   end function share_of_ring

   !> The vector to a part, shortened so that the part does not lie on the axis or beyond.
   pure function beside_axis(values, layout, shift) result(way)
      real(wp), intent(in) :: values(:) !< of the whole
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: shift(3)  !< m
      real(wp) :: way(3)
      way = shift
      if (layout%section%is_round() .and. abs(shift(1)) > farthest_inward*values(layout%position)) &
         way = shift*farthest_inward*values(layout%position)/abs(shift(1))
   end function beside_axis

   !> Initial position of a part of a particle: in the whole's initial domain, which lay along the axes. Where
   !> domains do not follow the deformation, as far from the whole as now.
   pure subroutine share_start(part, whole, layout, place, shift)
      real(wp), intent(inout) :: part(:)     !< its columns
      real(wp), intent(in) :: whole(:)       !< those of the whole
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: place(3) !< of its centre in the whole, in half edges; 0 along those not halved
      real(wp), intent(in) :: shift(3) !< the same, m
      if (layout%start == 0) return
      associate (x => layout%start, h => layout%start_edges)
         if (h == 0) then
            part(x:x + 2) = whole(x:x + 2) + shift
            return
         end if
         part(x:x + 2) = whole(x:x + 2) + place*whole(h:h + 2)
         part(h:h + 2) = whole(h:h + 2)*(1.0_wp - abs(place))
      end associate
   end subroutine share_start

   !> Columns of the areas and arms of faces that particles carry.
   pure function carried(shares) result(columns)
      type(shares_t), intent(in) :: shares
      integer, allocatable :: columns(:)
      integer :: c, f
      columns = [((shares%faces(1, f) + c, shares%faces(2, f) + c, c=0, 2), f=1, size(shares%faces, 2))]
   end function carried

   !> Share the faces that a particle carries with one of its halves. Along edge k the middle of a face is at
   !> s r_k from the centre, and the face reaches from there to the nearer end of the domain and as far the
   !> other way: a face at an end belongs to that half alone, one that lies along the edge is shared.
   pure subroutine share_faces(values, shares, layout, radius, r, k, side)
      real(wp), intent(inout) :: values(:) !< columns of the half, with area and arm of the whole
      type(shares_t), intent(in) :: shares
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: radius       !< radius of the whole's centre, for rings, m
      real(wp), intent(in) :: r(3, 3)      !< half edges of the whole, columns, m
      integer, intent(in) :: k             !< the edge that is halved
      real(wp), intent(in) :: side         !< -1 lower half, 1 upper
      real(wp) :: across(3), area(3), arm(3), s, w, from, to, share
      integer :: f
      across = cross(r(:, mod(k, 3) + 1), r(:, mod(k + 1, 3) + 1))
      do f = 1, size(shares%faces, 2)
         associate (a => shares%faces(1, f), b => shares%faces(2, f))
            area = values(a:a + 2)
            arm = values(b:b + 2)
            if (.not. any(abs(area) > 0.0_wp)) cycle
            s = min(max(dot_product(arm, across)/dot_product(r(:, k), across), -1.0_wp), 1.0_wp)
            w = 1.0_wp - abs(s)
            if (w > at_end) then
               from = max(side*s - w, 0.0_wp) ! in the direction of this half
               to = max(side*s + w, 0.0_wp)
               share = 0.5_wp*(to - from)/w
            else
               from = side*s
               to = from
               share = merge(1.0_wp, 0.0_wp, from > 0.0_wp)
            end if
            values(a:a + 2) = share*area
            values(b:b + 2) = arm + (0.5_wp*side*(from + to) - s - 0.5_wp*side)*r(:, k)
            if (layout%section%is_round()) & ! the ring at its own middle
               values(a:a + 2) = values(a:a + 2)*(radius + arm(1) + (0.5_wp*side*(from + to) - s)*r(1, k)) &
                                 /(radius + arm(1))
            if (.not. share > 0.0_wp) values(b:b + 2) = 0.0_wp
         end associate
      end do
   end subroutine share_faces

end module m_section_parts
