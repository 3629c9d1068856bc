!> Gaps at the start between bodies of which one has its surface from a file. A surface fitted to elements at
!> other places of the same facets is off by some 1e-3 of an edge either way; the shapes themselves are exact
!> (theory.md, eq. start-gap).
module m_start_gap
   use m_kinds, only: wp
   use m_scene, only: scene_t, body_contact_spec_t, start_as_is
   use m_surface_elements, only: element_t
   use m_partner_surface, only: meeting_t
   implicit none
   private
   public :: has_file, gap_of_shapes

   real(wp), parameter :: alike = 0.9_wp !< cosine between the normals of shapes and elements that correspond
   real(wp), parameter :: largest = 0.1_wp !< difference between the gaps of shapes and elements, in particle
                                           !< edges: with a larger one they are of different places

contains

   !> True where the surface of a body of a group comes from a file.
   pure logical function has_file(scene, field)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: field
      integer :: b
      has_file = .false.
      do b = 1, size(scene%bodies)
         if (scene%bodies(b)%field == field) has_file = has_file .or. scene%bodies(b)%shape%is_searched()
      end do
   end function has_file

   !> Gap (m) between a body and those of another group at an element of the first: the sum of the distances
   !> of the element's middle from both surfaces. Where the element's normal is not theirs, at edges and
   !> corners, the fitted gap. Shapes that may not overlap do not, so that what is below 0 then is an error.
   pure real(wp) function gap_of_shapes(scene, spec, meeting, element, body) result(gap)
      type(scene_t), intent(in) :: scene
      type(body_contact_spec_t), intent(in) :: spec !< of the pair
      type(meeting_t), intent(in) :: meeting
      type(element_t), intent(in) :: element
      integer, intent(in) :: body !< of the element
      real(wp) :: own, other, nearest, normals(3, 2), normal(3), limit
      integer :: b
      gap = meeting%gap
      if (spec%start /= start_as_is) gap = max(gap, 0.0_wp)
      limit = 2.0_wp*element%edge
      call scene%bodies(body)%shape%distance_within(element%face, limit, own, normals(:, 1))
      if (abs(own) >= limit) return
      nearest = limit
      do b = 1, size(scene%bodies)
         if (scene%bodies(b)%field /= meeting%field) cycle
         call scene%bodies(b)%shape%distance_within(element%face, limit, other, normal)
         if (other >= nearest) cycle
         nearest = other
         normals(:, 2) = normal
      end do
      if (abs(nearest) >= limit) return
      if (dot_product(element%normal, normals(:, 1)) < alike) return
      if (dot_product(element%normal, normals(:, 2)) > -alike) return
      if (abs(own + nearest - meeting%gap) > largest*element%edge) return
      gap = own + nearest
      if (spec%start /= start_as_is) gap = max(gap, 0.0_wp)
   end function gap_of_shapes

end module m_start_gap
