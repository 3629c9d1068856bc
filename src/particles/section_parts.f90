!> Parts of particles, and how those of a section share what the whole has: rings have more where the radius
!> is larger (theory.md, Sections).
module m_section_parts
   use m_kinds, only: wp
   use m_section, only: section_t
   use m_field_table, only: layout_t, shares_t
   use m_half_edges, only: half_edges, set_half_edges
   implicit none
   private
   public :: octant_of, octants_of, split_in_four, share_of_ring, beside_axis

   real(wp), parameter :: farthest_inward = 0.8_wp !< of the radius: parts of rings lie no nearer to the axis

contains

   !> Signs of the way from the centre of a particle to that of its octant (0 to 7).
   pure function octant_of(octant) result(signs)
      integer, intent(in) :: octant
      real(wp) :: signs(3)
      signs = real(2*[ibits(octant, 0, 1), ibits(octant, 1, 1), ibits(octant, 2, 1)] - 1, wp)
   end function octant_of

   !> Into which octants a particle is split: into all, or those of a section's plane.
   pure function octants_of(section) result(octants)
      type(section_t), intent(in) :: section
      integer, allocatable :: octants(:)
      if (section%is_flat()) then
         octants = [0, 1, 4, 5]
      else
         octants = [0, 1, 2, 3, 4, 5, 6, 7]
      end if
   end function octants_of

   !> The same of a section: halved along the two edges that lie in it.
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
            part(layout%position:layout%position + 2) = values(layout%position:layout%position + 2) &
                                                        + shift(:, n)
            part(v:v + 2) = values(v:v + 2) + matmul(l, shift(:, n))
            part(v + 2) = part(v + 2) - slip
            part(v + 1) = 0.0_wp
            call set_half_edges(part, layout, r)
            part(layout%generation) = values(layout%generation) + 3.0_wp
            part(layout%refinement) = values(layout%refinement) + 1.0_wp
         end associate
      end do
   end subroutine split_in_four

   !> Of what a part of a particle has by its area, what it has as a ring: more where the radius is larger
   !> (theory.md, Sections).
   pure real(wp) function share_of_ring(values, layout, shift) result(share)
      real(wp), intent(in) :: values(:) !< of the whole
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: shift(3)  !< from there to the part, m
      share = 1.0_wp
      if (layout%section%is_round()) share = 1.0_wp + shift(1)/values(layout%position)
   end function share_of_ring

   !> The way to a part, not so far that it would be on the axis or beyond.
   pure function beside_axis(values, layout, shift) result(way)
      real(wp), intent(in) :: values(:) !< of the whole
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: shift(3)  !< m
      real(wp) :: way(3)
      way = shift
      if (layout%section%is_round() .and. abs(shift(1)) > farthest_inward*values(layout%position)) &
         way = shift*farthest_inward*values(layout%position)/abs(shift(1))
   end function beside_axis

end module m_section_parts
