!> The compliance of the half-space below a cell in a quasi-static step (theory.md, eq. static-subcell): the
!> same term as in explicit steps, with the same rows. A point's own share is part of its compliance; the
!> effect of its neighbours is that of the last iteration's forces.
module m_static_subcell
   use m_kinds, only: wp
   use m_vectors, only: tangents
   use m_model, only: model_t
   use m_tool, only: tool_t
   use m_contact_point, only: width_of
   use m_candidates, only: candidates_t, ahead_of
   use m_contact_system, only: contact_system_t
   use m_contact_rows, only: assemble
   use m_subcell, only: find_deflection
   use m_static_contact, only: static_contact_t
   implicit none
   private
   public :: renew_deflections

   real(wp), parameter :: hair = 1.0e-5_wp !< cells: accuracy needed for deflections

contains

   !> Collective among near ranks: deflection of the surface at each point by the forces of all, and the
   !> resulting gap and slip; and the own part of each, for the linear problem.
   subroutine renew_deflections(contact, model, begins)
      type(static_contact_t), intent(inout) :: contact
      type(model_t), intent(inout) :: model
      logical, intent(in) :: begins !< no earlier iteration of the step has solved for the forces
      type(candidates_t) :: points
      type(contact_system_t) :: system
      type(tool_t) :: none(0)
      real(wp), allocatable :: forces(:), deflection(:)
      real(wp) :: own !< m/N
      real(wp) :: deepest
      integer :: number(contact%count), c, last, n
      contact%lag = 0.0_wp
      if (.not. model%contact%candidates%half_spaces%factor > 0.0_wp) return
      deepest = model%communicator%maximum(deepest_of(contact))
      if (.not. deepest > 0.0_wp) return
      call choose_points(contact, deepest, points, number)
      associate (finest => model%levels(size(model%levels)))
         call assemble(system, model%communicator, none, points, finest, 0.0_wp, 1.0_wp, subcell=.true., &
                       at_rest=.true.)
      end associate
      allocate (forces(system%rows), deflection(system%rows))
      do c = 1, points%count
         associate (it => contact%list(number(c)), point => points%list(c))
            forces(c) = contact%share*it%force
            last = points%count + 2*point%frictional
            if (point%frictional > 0) &
               forces(last - 1:last) = contact%share*matmul(it%friction_force, point%tangent)
         end associate
      end do
      associate (scale => system%scale(:system%rows))
         where (scale > 0.0_wp) forces = forces/scale
      end associate
      call find_deflection(system, forces, 1.0_wp, deflection)
      do n = 1, contact%count
         contact%list(n)%deflection = 0.0_wp
      end do
      do c = 1, points%count
         associate (it => contact%list(number(c)), point => points%list(c))
            own = contact%share*system%subcell_rows(c) ! with its nodes' materials, as all deflections
            it%contact_compliance = it%contact_compliance + (own - it%subcell_compliance)
            it%subcell_compliance = own
            it%deflection = deflection(c)*point%normal
            last = points%count + 2*point%frictional
            if (point%frictional > 0) &
               it%deflection = it%deflection + matmul(point%tangent, deflection(last - 1:last))
         end associate
      end do
      call contact%deflect(model%communicator, begins)
      contact%lag = model%communicator%maximum(contact%lag) &
                    /max(deepest, hair*model%levels(size(model%levels))%grid%cell)
   end subroutine renew_deflections

   !> The largest deflection of a point by its own pressure, m: tiny before anything is pressed, 0 if nothing
   !> below is compliant.
   pure real(wp) function deepest_of(contact) result(deepest)
      type(static_contact_t), intent(in) :: contact
      integer :: n
      deepest = 0.0_wp
      do n = 1, contact%count
         associate (it => contact%list(n))
            if (it%subcell_compliance > 0.0_wp) &
               deepest = max(deepest, tiny(deepest), it%subcell_compliance*it%force)
         end associate
      end do
   end function deepest_of

   !> The points that are pressed, or may be, given the compliance below the cells.
   subroutine choose_points(contact, deepest, points, number)
      type(static_contact_t), intent(in) :: contact
      real(wp), intent(in) :: deepest !< m
      type(candidates_t), intent(inout) :: points
      integer, intent(out) :: number(:) !< index of each chosen point in the list of all
      integer :: n
      allocate (points%list(contact%count))
      if (allocated(contact%pairs%partners)) points%partners = contact%pairs%partners
      do n = 1, contact%count
         associate (it => contact%list(n))
            if (it%barred) cycle
            if (.not. (it%force > 0.0_wp .or. it%node_gap() <= ahead_of(width_of(it%point), deepest))) cycle
            points%count = points%count + 1
            number(points%count) = n
            associate (c => points%list(points%count))
               c = it%point
               c%force = contact%share*it%force
               c%tool = 0 ! its tool's own motion does not matter here
               c%frictional = 0
               if (.not. c%has_friction) cycle
               points%frictional = points%frictional + 1
               c%frictional = points%frictional
               c%tangent = tangents(c%normal)
            end associate
         end associate
      end do
   end subroutine choose_points

end module m_static_subcell
