!> The contact system of a step's candidates: rows, weights, mobilities of nodes (theory.md, eq.
!> contact-operator); and the effect of its forces on the nodes.
module m_contact_rows
   use m_kinds, only: wp
   use m_constants, only: block_size
   use m_node_values, only: mass_, v_x, v_z, a_x, a_z
   use m_communicator, only: communicator_t
   use m_tool, only: tool_t
   use m_level, only: level_t
   use m_boundary, only: apply_boundary, held_components, inside
   use m_contact_point, only: candidate_t, place_of
   use m_candidates, only: candidates_t
   use m_contact_nodes, only: nodal_forces_t
   use m_contact_system, only: contact_system_t
   use m_subcell, only: set_subcell
   implicit none
   private
   public :: assemble, move_nodes, places_of, masses_of, inside_of

   real(wp), parameter :: stick_compliance = 10.0_wp !< compliance of sticking points, relative to that of the
                                                     !< normal forces; it acts on changes only

contains

   !> Coordinates in the grid (from -1 on) of a candidate's lowest node.
   pure function first_node(level, c) result(place)
      type(level_t), intent(in) :: level
      type(candidate_t), intent(in) :: c
      integer :: place(3)
      place = block_size*level%blocks(c%block)%place + c%face%corner
   end function first_node

   !> Collective among neighbours: the operator of a step's candidates: a row for each normal force, then two
   !> for each friction.
   subroutine assemble(system, communicator, tools, candidates, level, softness, time_step, subcell, at_rest)
      type(contact_system_t), intent(inout) :: system
      type(communicator_t), intent(in) :: communicator
      type(tool_t), intent(in) :: tools(:)
      type(candidates_t), intent(in) :: candidates
      type(level_t), intent(in) :: level
      real(wp), intent(in) :: softness                 !< of the normal forces, in the mobilities of particles
      real(wp), intent(in) :: time_step                !< s
      logical, intent(in) :: subcell                   !< include the compliance of the half-space below cells
                                                       !< (eq. subcell)
      logical, intent(in), optional :: at_rest !< masses are not used, and the nodes do not have them
      real(wp), dimension(candidates%count + 2*candidates%frictional) :: below, compliance
      integer :: c, n, place(0:2, 3), t
      real(wp) :: mass(0:2, 0:2, 0:2)
      logical, allocatable :: done(:)
      mass = 1.0_wp
      associate (list => candidates%list(:candidates%count))
         call system%begin(communicator, level%grid%cells, level%grid%fields, &
                           [(size(tools(t)%pushed), t=1, size(tools))], &
                           [(tools(t)%mobilities(time_step), t=1, size(tools))])
         do c = 1, size(list)
            call add_row(list(c), list(c)%normal)
         end do
         compliance(:size(list)) = softness*time_step/list%mass
         do c = 1, size(list)
            if (list(c)%frictional == 0) cycle
            do t = 1, 2
               call add_row(list(c), list(c)%tangent(:, t))
               compliance(system%rows) = stick_compliance*compliance(c)
            end do
         end do
         call system%number_nodes(size(list))
         done = [(.false., n=1, system%nodes%count)]
         n = 0
         do c = 1, size(list)
            n = n + 1
            place = system%place(:, :, n)
            if (.not. present(at_rest)) mass = masses_of(level, list(c), place)
            call set_mobility(system, level, n, list(c)%face%last, place, mass, time_step, done)
            if (list(c)%partner == 0) cycle
            n = n + 1
            associate (other => candidates%partners(list(c)%partner))
               if (.not. present(at_rest)) mass = other%mass
               call set_mobility(system, level, n, other%face%last, system%place(:, :, n), mass, time_step, &
                                 done)
            end associate
         end do
      end associate
      call system%nodes%connect(communicator, level%near)
      system%has_subcell = subcell
      below = 0.0_wp
      if (subcell) call set_subcell(system, level, candidates%list(:candidates%count), time_step, &
                                    compliance, below)
      call system%set_scale(compliance, below)
      call system%pair_scales(candidates%count + 1)
      call system%group_rows()
   contains
      !> A force of a candidate along a direction, against a tool or another body.
      subroutine add_row(c, direction)
         type(candidate_t), intent(in) :: c
         real(wp), intent(in) :: direction(3)
         associate (place => places_of(level, c), across => c%reflection*direction, &
                    field => level%blocks(c%block)%field)
            if (c%tool > 0 .and. system%gives_way) then
               call system%add_row(c%face%last, place, c%face%weight, across, field, c%tool, &
                                   tools(c%tool)%along(place_of(c), direction))
            else
               call system%add_row(c%face%last, place, c%face%weight, across, field, c%tool)
            end if
         end associate
         if (c%partner == 0) return
         associate (other => candidates%partners(c%partner))
            call system%add_part(other%face%last, inside_of(level, other%face%corner), other%face%weight, &
                                 -other%reflection*direction, other%field)
         end associate
      end subroutine add_row
   end subroutine assemble

   !> Coordinates in the grid of a candidate's nodes along each axis. A node outside a symmetry plane has no
   !> weight: it is replaced by its mirror image inside.
   pure function places_of(level, c) result(place)
      type(level_t), intent(in) :: level
      type(candidate_t), intent(in) :: c
      integer :: place(0:2, 3) !< (nodes, axes), from -1; of a cell's nodes 0:1 count
      place = inside_of(level, first_node(level, c))
   end function places_of

   !> The same for the nodes starting from a grid node.
   pure function inside_of(level, first) result(place)
      type(level_t), intent(in) :: level
      integer, intent(in) :: first(3)
      integer :: place(0:2, 3), axis, i
      do axis = 1, 3
         do i = 0, 2
            place(i, axis) = inside(level%grid, axis, first(axis) + i)
         end do
      end do
   end function inside_of

   !> Masses of the nodes of a candidate, kg.
   pure function masses_of(level, c, place) result(mass)
      type(level_t), intent(in) :: level
      type(candidate_t), intent(in) :: c
      integer, intent(in) :: place(0:2, 3) !< of them, as from places_of
      real(wp) :: mass(0:2, 0:2, 0:2)
      integer :: i, j, k, at(0:2, 3), axis
      do axis = 1, 3
         at(:, axis) = place(:, axis) - block_size*level%blocks(c%block)%place(axis) + 1
      end do
      do k = 0, c%face%last
         do j = 0, c%face%last
            do i = 0, c%face%last
               mass(i, j, k) = level%nodes(mass_, at(i, 1), at(j, 2), at(k, 3), c%block)
            end do
         end do
      end do
   end function masses_of

   !> Set the mobilities of the nodes of a part of the system's rows that are not set yet.
   pure subroutine set_mobility(system, level, part, last, place, mass, time_step, done)
      type(contact_system_t), intent(inout) :: system
      type(level_t), intent(in) :: level
      integer, intent(in) :: part, last, place(0:2, 3)   !< its number and nodes, as in add_part
      real(wp), intent(in) :: mass(0:2, 0:2, 0:2)        !< of them, kg
      real(wp), intent(in) :: time_step                  !< s
      logical, intent(inout) :: done(:) !< (nodes)
      integer :: i, j, k, n, s, node(3)
      s = system%begins(part) - 1
      do k = 0, last
         do j = 0, last
            do i = 0, last
               s = s + 1
               n = system%node(s)
               if (done(n)) cycle
               done(n) = .true.
               node = [place(i, 1), place(j, 2), place(k, 3)]
               system%mobility(:, n) = 0.0_wp
               if (mass(i, j, k) > 0.0_wp) system%mobility(:3, n) = merge(0.0_wp, time_step/mass(i, j, k), &
                     held_components(level%grid, node))
            end do
         end do
      end do
   end subroutine set_mobility

   !> Collective among neighbours: change velocity and acceleration of the nodes with contact forces, in every
   !> local tile that has them, and of their mirror images.
   subroutine move_nodes(system, level, time_step, forces)
      type(contact_system_t), intent(inout) :: system
      type(level_t), intent(inout) :: level
      real(wp), intent(in) :: time_step
      real(wp), intent(in) :: forces(:) !< (rows of the system), N
      type(nodal_forces_t), allocatable :: parts(:)
      logical :: changed(size(level%blocks))
      integer :: b, n, r
      call system%activate(1, system%rows)
      call system%nodal_forces(forces, parts)
      changed = .false.
      do r = 1, size(parts)
         do n = 1, size(parts(r)%node)
            call add_force(level, system%nodes%place_of(parts(r)%node(n)), &
                           system%nodes%field_of(parts(r)%node(n)), parts(r)%force(:3, n), time_step, &
                           changed)
         end do
      end do
      do b = 1, size(level%blocks)
         if (changed(b)) call apply_boundary(level%grid, level%blocks(b)%place, level%nodes(:, :, :, :, b))
      end do
   end subroutine move_nodes

   !> Add a force to a node in all local tiles that have it: its block's, and those of neighbouring blocks if
   !> it is on their rim.
   pure subroutine add_force(level, place, field, force, time_step, changed)
      type(level_t), intent(inout) :: level
      integer, intent(in) :: place(3), field
      real(wp), intent(in) :: force(3), time_step
      logical, intent(inout) :: changed(:)
      integer :: at(3), block(3), home(3), i, j, k, low(3), high(3), slot
      home = (place - modulo(place, block_size))/block_size
      low = home - merge(1, 0, modulo(place, block_size) == 0)
      high = home + merge(1, 0, modulo(place, block_size) == block_size - 1)
      do k = low(3), high(3)
         do j = low(2), high(2)
            do i = low(1), high(1)
               block = [i, j, k]
               slot = level%slot_at(block, field)
               if (slot == 0 .or. slot > size(level%blocks)) cycle
               at = place - block_size*block + 1
               associate (node => level%nodes(:, at(1), at(2), at(3), slot))
                  if (node(mass_) <= 0.0_wp) cycle
                  node(a_x:a_z) = node(a_x:a_z) + force/node(mass_)
                  node(v_x:v_z) = node(v_x:v_z) + time_step*force/node(mass_)
               end associate
               changed(slot) = .true.
            end do
         end do
      end do
   end subroutine add_force

end module m_contact_rows
