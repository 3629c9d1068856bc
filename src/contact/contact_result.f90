!> Results of a step's contact problem for its candidates: forces, and carried gaps (theory.md, eqs
!> contact-condition, carried-gap, subcell).
module m_contact_result
   use m_kinds, only: wp
   use m_level, only: level_t
   use m_contact_point, only: candidate_t, width_of, overlap_rate
   use m_candidates, only: candidates_t
   use m_contact_system, only: contact_system_t
   use m_subcell, only: find_deflection
   implicit none
   private
   public :: keep_solution, held_gap

contains

   !> Store the solution in the list of candidates and in the columns of their particles.
   subroutine keep_solution(system, candidates, level, time_step, b, x, w, friction, bridge)
      type(contact_system_t), intent(inout) :: system
      type(candidates_t), intent(inout) :: candidates
      type(level_t), intent(inout) :: level
      real(wp), intent(in) :: time_step        !< s
      real(wp), intent(in) :: b(:), x(:), w(:) !< right-hand side, solution, product, scaled
      real(wp), intent(in) :: friction(:)      !< of the rows of friction, scaled
      real(wp), intent(inout) :: bridge        !< largest force across a gap, times the gap, so far
      real(wp) :: deflection(system%rows), gap, strongest, subcell(size(x))
      integer :: c, last
      call find_deflection(system, [x, friction], time_step, deflection)
      candidates%deepest = 0.0_wp
      subcell = 0.0_wp
      if (system%has_subcell) subcell = system%subcell_rows(:size(x))
      strongest = system%communicator%maximum(maxval([0.0_wp, x*system%scale(:size(x))]))
      do c = 1, size(x)
         associate (it => candidates%list(c), scale => system%scale(c), &
                    first => candidates%traction, &
                    column => level%blocks(candidates%list(c)%block)%particles%column)
            it%force = x(c)*scale - it%adhesive_tension
            it%mean_force = it%force
            gap = 0.0_wp
            if (scale > 0.0_wp) gap = max(0.0_wp, (w(c) - b(c))/scale*time_step)
            if (it%force > 0.0_wp) bridge = max(bridge, it%force*gap/(strongest*level%grid%cell))
            if ((it%force > 0.0_wp .or. it%carried .or. it%partner > 0) .and. scale > 0.0_wp) &
               call leave_gap(candidates, level, it, time_step, deflection(c), &
                              (w(c) - b(c))/scale - (system%softness(c)/scale**2 - subcell(c))*it%force)
            last = size(x) + 2*it%frictional
            if (it%frictional > 0) it%shear_deflection = matmul(it%tangent, deflection(last - 1:last))
            it%relaxed = 0.5_wp*it%relaxing*(it%force*it%deflection + dot_product( &
                                             matmul(it%tangent, it%tangential_force), it%shear_deflection))
            if (it%tool == 0) cycle ! body_pairs keeps it
            associate (pressure => column(it%particle, candidates%pressure)) ! the largest of a tool's sheets
               pressure = max(merge(pressure, 0.0_wp, it%sheet > 1), it%force/it%area)
            end associate
            associate (deepest => candidates%deepest(it%tool))
               deepest = max(deepest, it%subcell*it%force/it%area)
            end associate
            call candidates%keep_own(column(it%particle, :), it, it%force/it%area, &
                                     matmul(it%tangent, it%tangential_force)/it%area)
            if (it%frictional == 0) cycle
            column(it%particle, first:first + 2) = matmul(it%tangent, it%tangential_force)/it%area
            if (candidates%dragged > 0) &
               column(it%particle, candidates%dragged:candidates%dragged + 2) = it%shear_deflection
         end associate
      end do
   end subroutine keep_solution

   !> The gap that the condition enforces, without the deflection below the cells: an overlap is reduced by at
   !> most the allowed rate per step, m.
   pure real(wp) function held_gap(c)
      type(candidate_t), intent(in) :: c
      held_gap = max(c%gap + c%deflection, -overlap_rate*width_of(c)) - c%deflection
   end function held_gap

   !> Store the gap of a point that is or was pressed, as left by the nodes: it is carried to the next step.
   subroutine leave_gap(candidates, level, c, time_step, deflection, speed)
      type(candidates_t), intent(in) :: candidates
      type(level_t), intent(inout) :: level
      type(candidate_t), intent(inout) :: c
      real(wp), intent(in) :: time_step  !< s
      real(wp), intent(in) :: deflection !< deflection below the cells at the end of the step, m
      real(wp), intent(in) :: speed      !< opening speed of the enforced gap, including the compliance below
                                         !< the cells, m/s
      c%opening = speed - (held_gap(c) + deflection)/time_step
      c%deflection = deflection
      if (c%tool == 0) return ! faces of bodies follow the material
      associate (column => level%blocks(c%block)%particles%column)
         if (candidates%deflected > 0) column(c%particle, candidates%deflected + c%slot) = deflection
      end associate
      associate (gap => level%blocks(c%block)%particles%column(c%particle, candidates%carried + c%slot))
         gap = c%gap + time_step*c%opening
         if (.not. abs(gap) > 0.0_wp) gap = tiny(gap) ! 0 would mean that no gap is carried
      end associate
      level%blocks(c%block)%pressed = .true.
   end subroutine leave_gap

end module m_contact_result
