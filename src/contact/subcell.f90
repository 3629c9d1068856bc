!> The compliance of the half-space below a cell (theory.md, eq. subcell): the surface of a grid cannot deform
!> within a cell, so that pressures which vary there cause no deflection. This module computes the term for a
!> step's contact points and nodes, and its effect on their forces.
module m_subcell
   use m_kinds, only: wp
   use m_level, only: level_t
   use m_boundary, only: held_components
   use m_contact_point, only: candidate_t, margin, width_of
   use m_contact_system, only: contact_system_t
   use m_surface_area, only: find_surface_area
   implicit none
   private
   public :: set_subcell, find_deflection, beside_subcell

   real(wp), parameter :: counted_area = 0.9_wp !< share of a node's surface, by its particles, that counts
                                                !< beyond the contact's rim
   real(wp), parameter :: covered = 0.75_wp !< share of the surface around a point that others press, from
                                            !< which on it is of a layer below
   real(wp), parameter :: least_area = 1.0e-3_wp !< of that of a node's points: below it the node has no term
   real(wp), parameter :: one_face = 0.95_wp !< mean normal of a node's points, above which bodies meet on one
                                             !< face there: at a corner an area has no single direction
   real(wp), parameter :: huge_stiffness = 1.0e250_wp !< over area, of a rigid material, N/m3:
   real(wp), parameter :: rigid = 1.0e150_wp !< N/m: some of a node's points are rigid
   real(wp), parameter :: beside_subcell = 0.1_wp !< of the compliance of points that makes the term unique

contains

   !> Collective among neighbours: the term for a step's rows and nodes, after nodes are numbered and shared.
   !> A node's area is that of its points, or the surface that its particles have towards the tool if larger;
   !> its modulus is the mean over its own body's points. The term only dissipates.
   subroutine set_subcell(system, level, list, time_step, compliance, below)
      type(contact_system_t), intent(inout) :: system
      type(level_t), intent(in) :: level
      type(candidate_t), intent(in) :: list(:)
      real(wp), intent(in) :: time_step !< s
      real(wp), intent(inout) :: compliance(:) !< (rows): of points, s/kg
      real(wp), intent(inout) :: below(:)      !< (rows): contribution of the term to the diagonal, s/kg;
                                               !< -1 of rows that take no part
      real(wp), dimension(3, system%nodes%count) :: ahead, normal, sums, surface, paired
      real(wp), dimension(system%nodes%count) :: area, of_node, towards
      logical :: held(3, system%nodes%count), hidden(size(list)), without(system%nodes%count)
      real(wp) :: way(4)
      integer :: c, n, s
      call add_up_points(system, list, normal, sums, paired)
      call find_surface_area(level, system%nodes, surface)
      do n = 1, system%nodes%count
         without(n) = .not. sums(3, n) > 0.0_wp .or. sums(2, n) >= rigid &
                      .or. (paired(1, n) > 0.0_wp .and. norm2(normal(:, n)) < one_face*sums(1, n))
         held(:, n) = held_components(level%grid, system%nodes%place_of(system%nodes%grid_node(n)))
         where (held(:, n)) normal(:, n) = 0.0_wp ! at a symmetry plane the mirror image has the opposite one
         towards(n) = -dot_product(normal(:, n), surface(:, n))/max(norm2(normal(:, n)), tiny(way))
         if (.not. sums(1, n) > 0.0_wp) towards(n) = norm2(merge(0.0_wp, surface(:, n), held(:, n)))
      end do
      call add_up_points_ahead(system, list, sums(1, :), towards, ahead, hidden)
      area = max(sums(1, :) + ahead(1, :), counted_area*towards)
      system%subcell_nodes(:, :size(area)) = 0.0_wp
      of_node = 0.0_wp
      do n = 1, system%nodes%count
         if (without(n)) cycle
         of_node(n) = sums(3, n)/(sums(2, n)*time_step)
         if (area(n) > least_area*sums(3, n)) &
            system%subcell_nodes(:3, n) = merge(0.0_wp, of_node(n)/area(n), held(:, n))
      end do
      call set_rows(system, list, of_node)
      below = system%subcell_rows
      do n = 1, system%parts
         c = system%row(n)
         do s = system%begins(n), system%begins(n + 1) - 1
            way = system%direction(:, n)**2*system%subcell_nodes(:, system%node(s))
            below(c) = below(c) - system%weight(s)**2*sum(way)
         end do
      end do
      below = max(0.0_wp, below)
      do c = 1, size(list)
         if (.not. hidden(c)) cycle ! J takes energy from any forces as long as these have none
         below(c) = -1.0_wp
         n = size(list) + 2*list(c)%frictional
         if (list(c)%frictional > 0) below(n - 1:n) = -1.0_wp
      end do
      where (system%subcell_rows > 0.0_wp) compliance = beside_subcell*compliance
      compliance = compliance + system%subcell_rows
   end subroutine set_subcell

   !> The compliance of a point is that of its nodes, by their weights: a uniform pressure then causes no
   !> deflection, for any materials.
   subroutine set_rows(system, list, of_node)
      type(contact_system_t), intent(inout) :: system
      type(candidate_t), intent(in) :: list(:)
      real(wp), intent(in) :: of_node(:) !< (nodes): over the time step, m/(Pa s)
      integer :: c, n, s
      if (allocated(system%subcell_rows)) deallocate (system%subcell_rows)
      allocate (system%subcell_rows(system%rows), source=0.0_wp)
      do n = 1, system%parts
         c = system%row(n)
         if (c > size(list)) exit
         do s = system%begins(n), system%begins(n + 1) - 1
            system%subcell_rows(c) = system%subcell_rows(c) + system%weight(s)*of_node(system%node(s))
         end do
      end do
      system%subcell_rows(:size(list)) = system%subcell_rows(:size(list))/share_of(list)
      do c = 1, size(list)
         n = size(list) + 2*list(c)%frictional
         if (list(c)%frictional > 0) system%subcell_rows(n - 1:n) = system%subcell_rows(c)
      end do
   end subroutine set_rows

   !> Collective among neighbours: deflection of the surface below the cells by the forces of all rows, in the
   !> directions of the rows, m.
   subroutine find_deflection(system, forces, time_step, deflection)
      type(contact_system_t), intent(inout) :: system
      real(wp), intent(in), contiguous :: forces(:)      !< (rows), scaled
      real(wp), intent(in) :: time_step                  !< s
      real(wp), intent(out), contiguous :: deflection(:) !< (rows)
      deflection = 0.0_wp
      if (.not. system%has_subcell) return
      system%products = system%products + 1
      associate (nodes => system%nodes%count, n => system%normal, scale => system%scale(:system%rows))
         system%force(:, :nodes) = 0.0_wp
         call system%normal_rows%spread(forces(:n), system%force)
         call system%friction_rows%spread(forces(n + 1:), system%force)
         call system%nodes%add_up(system%force)
         system%force(:, :nodes) = system%subcell_nodes(:, :nodes)*system%force(:, :nodes)
         call system%normal_rows%collect(system%force, deflection(:n))
         call system%friction_rows%collect(system%force, deflection(n + 1:))
         where (scale > 0.0_wp)
            deflection = time_step*(system%subcell_rows*scale*forces - deflection/scale)
         elsewhere
            deflection = 0.0_wp
         end where
      end associate
   end subroutine find_deflection

   !> Collective among neighbours: areas of the points ahead of those that touch, where they are of the
   !> surface. Those of a layer below have the area of the points above them, which press: it must not count
   !> twice.
   subroutine add_up_points_ahead(system, list, pressed, towards, ahead, hidden)
      type(contact_system_t), intent(inout) :: system
      type(candidate_t), intent(in) :: list(:)
      real(wp), intent(in) :: pressed(:), towards(:) !< (nodes): of points that touch, of all particles, m2
      real(wp), intent(out) :: ahead(:, :)           !< (3, nodes): m2, the first of three
      logical, intent(out) :: hidden(:)              !< (points): below the surface
      real(wp) :: cover
      integer :: c, n, node, s
      ahead = 0.0_wp
      hidden = .false.
      do n = 1, system%parts
         c = system%row(n)
         if (c > size(list)) exit
         if (touches(list(c)) .or. hidden(c)) cycle
         cover = 0.0_wp
         do s = system%begins(n), system%begins(n + 1) - 1
            node = system%node(s)
            cover = cover + system%weight(s) &
                    *(min(1.0_wp, pressed(node)/max(towards(node), tiny(cover))) - covered)
         end do
         hidden(c) = cover > 0.0_wp
         if (hidden(c)) cycle
         do s = system%begins(n), system%begins(n + 1) - 1
            ahead(1, system%node(s)) = ahead(1, system%node(s)) + system%weight(s)*share_of(list(c))
         end do
      end do
      call system%nodes%add_up(ahead)
   end subroutine add_up_points_ahead

   !> True of a point that pressed in the last step, or is about to.
   pure logical function touches(c)
      type(candidate_t), intent(in) :: c
      touches = c%force > 0.0_wp .or. c%carried .or. c%gap <= margin*width_of(c)
   end function touches

   !> Surface represented by a point, m2: between bodies both sides have points.
   pure elemental real(wp) function share_of(c) result(area)
      type(candidate_t), intent(in) :: c
      area = merge(0.5_wp, 1.0_wp, c%partner > 0)*c%area
   end function share_of

   !> Collective among neighbours: areas of points by their weights on nodes: times the normal and alone, of
   !> those that touch; of all points of the node's own body over the compliance and alone.
   subroutine add_up_points(system, list, normal, sums, paired)
      type(contact_system_t), intent(inout) :: system
      type(candidate_t), intent(in) :: list(:)
      real(wp), intent(out) :: normal(:, :), sums(:, :) !< (3, nodes): m2; m2, N/m and m2
      real(wp), intent(out) :: paired(:, :)             !< (3, nodes): m2, of points between bodies
      real(wp) :: share(3), area
      integer :: before, c, n, s
      normal = 0.0_wp
      sums = 0.0_wp
      paired = 0.0_wp
      before = 0
      do n = 1, system%parts
         c = system%row(n)
         if (c > size(list)) exit
         share = [merge(1.0_wp, 0.0_wp, touches(list(c))), huge_stiffness, 1.0_wp]
         if (list(c)%subcell > 0.0_wp) share(2) = 1.0_wp/list(c)%subcell
         if (c == before) share(2:) = 0.0_wp ! the other body's points have its modulus
         before = c
         do s = system%begins(n), system%begins(n + 1) - 1
            area = system%weight(s)*share_of(list(c))
            associate (node => system%node(s))
               normal(:, node) = normal(:, node) + area*share(1)*system%direction(:3, n)
               sums(:, node) = sums(:, node) + area*share
               if (list(c)%partner > 0) paired(1, node) = paired(1, node) + area
            end associate
         end do
      end do
      call system%nodes%add_up(normal)
      call system%nodes%add_up(sums)
      if (system%nodes%extent(4) > 1) call system%nodes%add_up(paired)
   end subroutine add_up_points

end module m_subcell
