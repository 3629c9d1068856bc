!> The edge of a tool's contact, as points on the tool (theory.md, eq. contact-edge).
module m_contact_outline
   use m_kinds, only: wp, i8
   use m_constants, only: pi
   use m_sorting, only: sorted_order
   use m_communicator, only: communicator_t
   use m_vectors, only: tangents
   use m_tool, only: tool_t
   use m_scene_materials, only: materials_t
   use m_level, only: level_t
   use m_contact_edge, only: edges_t, find_edges
   use m_candidates, only: candidates_t
   use m_contact_area, only: patch_t, patch_under
   implicit none
   private
   public :: outline_under, outline_of

   real(wp), parameter :: steps_of_angle = 1.0e12_wp !< per radian: sort keys are integers
   real(wp), parameter :: near = 1.0e-6_wp  !< cells: distance at which the tool's surface is reached
   real(wp), parameter :: far = 100.0_wp    !< cells: no part of a tool is further ahead of its point
   integer, parameter :: max_steps = 1000  !< maximum number of steps towards it

contains

   !> Collective: the points (3, :) of the outline of a tool's contact, m, of the modelled part, in order
   !> around its middle; none where there is no contact. Arguments as of projected_area.
   function outline_under(communicator, tool, level, materials, candidates, number) result(outline)
      type(communicator_t), intent(in) :: communicator
      type(tool_t), intent(in) :: tool
      type(level_t), intent(inout) :: level
      type(materials_t), intent(in) :: materials
      type(candidates_t), intent(in) :: candidates
      integer, intent(in) :: number
      real(wp), allocatable :: outline(:, :)
      real(wp), allocatable :: edge(:, :)
      real(wp) :: across(3, 2)
      integer :: n
      across = tangents(tool%spec%axis)
      edge = outline_of(patch_under(communicator, tool, level, materials, candidates, number), &
                        level%grid%cell)
      allocate (outline(3, size(edge, 2)))
      do n = 1, size(edge, 2)
         outline(:, n) = on_tool(tool, matmul(across, edge(:, n)), level%grid%cell)
      end do
   end function outline_under

   !> The points (2, :) in the projection, m, of the edge as found from the points beside a patch, inside the
   !> mirrors.
   function outline_of(patch, cell) result(edge)
      type(patch_t), intent(in) :: patch
      real(wp), intent(in) :: cell !< m
      real(wp), allocatable :: edge(:, :)
      type(edges_t) :: edges
      real(wp) :: middle(2)
      integer :: k, m, n, p
      allocate (edge(2, 0))
      if (.not. any(patch%in_contact)) return
      edges = find_edges(patch%points, patch%squares, patch%in_contact, cell)
      edge = reshape([(patch%points(p)%place - edges%back(p)*edges%outwards(:, p), p=1, size(edges%known))], &
                     [2, size(edges%known)])
      do k = 1, size(patch%mirrors)
         associate (mirror => patch%mirrors(k))
            edges%known = edges%known .and. matmul(mirror%normal, edge) > mirror%from
         end associate
      end do
      n = count(edges%known)
      edge = reshape(pack(edge, spread(edges%known, 1, 2)), [2, n])
      do m = 1, 2
         middle(m) = sum(patch%points%place(m), mask=patch%in_contact)/count(patch%in_contact)
      end do
      edge = edge(:, around(edge, middle))
   end function outline_of

   !> The order of points by their angle about a middle, starting after the widest gap.
   pure function around(edge, middle) result(order)
      real(wp), intent(in) :: edge(:, :), middle(2)
      integer :: order(size(edge, 2))
      real(wp) :: angle(size(edge, 2)), gap(size(edge, 2))
      integer :: i, n
      n = size(order)
      if (n == 0) return
      angle = atan2(edge(2, :) - middle(2), edge(1, :) - middle(1))
      order = sorted_order(nint(steps_of_angle*angle, i8), [(int(i, i8), i=1, n)])
      gap = [angle(order(1)) - angle(order(n)) + 2.0_wp*pi, angle(order(2:)) - angle(order(:n - 1))]
      order = cshift(order, maxloc(gap, dim=1) - 1)
   end function around

   !> The point of a tool's surface on the line along its axis through a position: from ahead of it, by steps
   !> as long as the gap. If the line misses the tool, the nearest point after the maximum of steps.
   function on_tool(tool, place, cell) result(point)
      type(tool_t), intent(in) :: tool
      real(wp), intent(in) :: place(3), cell !< m
      real(wp) :: point(3)
      real(wp) :: gap, normal(3)
      integer :: step
      associate (axis => tool%spec%axis)
         point = place + (dot_product(tool%point - place, axis) + far*cell)*axis
         do step = 1, max_steps
            call tool%gap_and_normal(point, gap, normal)
            if (gap < near*cell) return
            point = point - gap*axis
         end do
      end associate
   end function on_tool

end module m_contact_outline
