!> Contact points of faces crossed by the sharp rim of a flat tool: only the part under the tool counts
!> (theory.md, eq. rim-cut).
module m_rim_cut
   use m_kinds, only: wp
   use m_tool, only: tool_t
   use m_half_edges, only: fitted_edges
   use m_level, only: level_t
   use m_scene_materials, only: materials_t
   use m_face_gap, only: find_gap, find_thickness, deform, thickest
   use m_contact_point, only: candidate_t, margin
   implicit none
   private
   public :: find_point, is_beside_rim

   integer, parameter :: samples = 8            !< along each edge of a face; squared, along that of a section
   real(wp), parameter :: first_layer = 1.5_wp  !< half edges: upper bound of the distance of centres of
                                                !< touched faces

contains

   !> Gap and normal of a particle's contact point with the candidate's sheet of a tool, as find_gap; if the
   !> rim crosses its face, those of the middle of the part under the tool, with that part.
   subroutine find_point(tool, level, materials, b, p, reach, may_cut, c, edge, thickness)
      type(tool_t), intent(in) :: tool
      type(level_t), intent(in) :: level
      type(materials_t), intent(in) :: materials
      integer, intent(in) :: b, p              !< numbers of the block and the particle
      real(wp), intent(in) :: reach            !< m
      logical, intent(in) :: may_cut           !< areas of points are used (eq. subcell)
      type(candidate_t), intent(inout) :: c    !< with initial values
      real(wp), intent(out) :: edge, thickness !< of the particle, m
      if (may_cut .and. tool%spec%shape%end_radius() > 0.0_wp) then
         call cut(tool, level, b, p, c)
         if (c%share < 1.0_wp) then
            associate (column => level%blocks(b)%particles%column, at => level%layout%position)
               call tool%gap_and_normal(column(p, at:at + 2) + c%aside, c%gap, c%normal)
            end associate
            call find_thickness(level, materials, b, p, c%normal, edge, thickness)
            c%gap = c%gap - tool%spec%penetration_factor*thickness
            return
         end if
      end if
      call find_gap(tool, level, materials, b, p, reach, c%gap, c%normal, edge, thickness, c%sheet)
   end subroutine find_point

   !> True of a face that is met with a part of it under the flat end, but stands higher than that: it is
   !> beside the rim, and meets the wall.
   pure logical function is_beside_rim(c, edge, last)
      type(candidate_t), intent(in) :: c !< with its share and gap
      real(wp), intent(in) :: edge       !< of the particle, m
      real(wp), intent(in) :: last       !< gap that the last step has left, m; 0: none
      is_beside_rim = c%share < 1.0_wp .and. c%gap < -margin*edge .and. .not. abs(last) > 0.0_wp
   end function is_beside_rim

   !> The part of a particle's face under the flat end of a tool, by sampling: its share, its middle relative
   !> to that of the face, and its extents in half edges. The whole face counts if the rim is not near, or if
   !> no part of it is under the tool: then it can only meet the wall.
   pure subroutine cut(tool, level, b, p, c)
      type(tool_t), intent(in) :: tool
      type(level_t), intent(in) :: level
      integer, intent(in) :: b, p
      type(candidate_t), intent(inout) :: c
      real(wp) :: axis(3), across(3), before, centre(3), place(2), r(3, 3), squares(2), sums(2)
      integer :: edges(2), i, j, k, many(2), n
      centre = level%blocks(b)%particles%column(p, level%layout%position:level%layout%position + 2)
      axis = tool%spec%shape%axis
      if (tool%pivot > 0) axis = matmul(tool%rotation, axis)
      before = dot_product(centre - tool%tip, axis)
      across = centre - tool%tip - before*axis
      if (abs(norm2(across) - tool%spec%shape%end_radius()) > thickest(level)) return
      if (deform(level)) then
         r = fitted_edges(level%blocks(b)%particles%column(p, :), level%layout, level%grid%cell)
      else
         r = level%blocks(b)%particles%column(p, level%layout%half_size) &
             *reshape([1, 0, 0, 0, 1, 0, 0, 0, 1], [3, 3])
      end if
      k = maxloc(abs(matmul(axis, r)), dim=1)
      if (before < 0.0_wp .or. before > first_layer*norm2(r(:, k))) return
      edges = [mod(k, 3) + 1, mod(k + 1, 3) + 1]
      many = samples
      if (level%grid%section%is_flat()) then ! one sample along y
         r(2, :) = 0.0_wp
         many = merge(samples**2, 1, norm2(r(:, edges), dim=1) > 0.0_wp)
      end if
      if (abs(norm2(across) - tool%spec%shape%end_radius()) > sum(norm2(r(:, edges), dim=1))) return
      n = 0
      sums = 0.0_wp
      squares = 0.0_wp
      do j = 1, many(2)
         do i = 1, many(1)
            place = (2*[i, j] - many - 1)/real(many, wp)
            if (.not. is_under(across + matmul(r(:, edges), place))) cycle
            n = n + 1
            sums = sums + place
            squares = squares + place**2
         end do
      end do
      if (n == 0 .or. n == product(many)) return
      sums = sums/n
      c%share = n/real(product(many), wp)
      c%aside = matmul(r(:, edges), sums)
      c%aside = c%aside - dot_product(c%aside, axis)*axis
      c%spans = 1.0_wp
      c%spans(edges) = min(1.0_wp, sqrt(3.0_wp*max(0.0_wp, squares/n - sums**2)))
   contains
      pure logical function is_under(place)
         real(wp), intent(in) :: place(3) !< from the axis, m
         is_under = norm2(place - dot_product(place, axis)*axis) < tool%spec%shape%end_radius()
      end function is_under
   end subroutine cut

end module m_rim_cut
