!> Gaps at the start by the shapes themselves, which are exact (theory.md, eq. start-gap): between bodies of
!> which one has its surface from a file, where surfaces fitted to elements at other places of the same facets
!> are off by some 1e-3 of an edge either way; and of tools that touch faces oblique to the grid, beyond which
!> domains along the axes stand.
module m_start_gap
   use m_kinds, only: wp
   use m_scene, only: scene_t, body_contact_spec_t, start_as_is
   use m_surface_elements, only: element_t
   use m_partner_surface, only: meeting_t
   use m_tool, only: tool_t
   use m_level, only: level_t
   use m_scene_materials, only: materials_t
   use m_face_gap, only: find_gap, list_near
   implicit none
   private
   public :: has_file, gap_of_shapes, touch_at_start

   real(wp), parameter :: alike = 0.9_wp !< cosine between the normals of shapes and elements that correspond
   real(wp), parameter :: largest = 0.1_wp !< difference between the gaps of shapes and elements, in particle
                                           !< edges: with a larger one they are of different places
   real(wp), parameter :: none = 1.0e-6_wp !< cells: a smaller gap of the shapes is none

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

   !> Where a tool and the shape of a body touch at the start, the gap that is carried on is none, whatever
   !> the domain of the particle says.
   subroutine touch_at_start(scene, tool, level, materials, carried)
      type(scene_t), intent(in) :: scene
      type(tool_t), intent(in) :: tool
      type(level_t), intent(inout) :: level !< the finest; its lists of cells are updated
      type(materials_t), intent(in) :: materials
      integer, intent(in) :: carried !< column of the gap that is carried on
      integer, allocatable :: near(:)
      integer :: b, n
      real(wp) :: edge, face(3), gap, normal(3), own, outward(3), thickness
      do b = 1, size(level%blocks)
         associate (column => level%blocks(b)%particles%column, x => level%layout%position)
            call list_near(tool, level, b, largest*level%grid%cell, near)
            do n = 1, size(near)
               associate (p => near(n), body => int(level%blocks(b)%particles%body(near(n))))
                  call find_gap(tool, level, materials, b, p, largest*level%grid%cell, gap, normal, edge, &
                                thickness)
                  if (abs(gap) > largest*level%grid%cell .or. abs(gap) <= none*level%grid%cell) cycle
                  face = column(p, x:x + 2) - tool%spec%penetration_factor*thickness*normal
                  call scene%bodies(body)%shape%distance_and_normal(face, own, outward)
                  if (dot_product(outward, normal) > -alike) cycle
                  call tool%gap_and_normal(face, gap, normal)
                  if (abs(own + gap) > none*level%grid%cell) cycle
                  column(p, carried) = tiny(gap) ! 0 would be none carried
                  level%blocks(b)%pressed = .true.
               end associate
            end do
         end associate
      end do
   end subroutine touch_at_start

end module m_start_gap
