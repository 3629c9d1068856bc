!> Contact of a quasi-static step with the tools of the model and between its bodies, on the finest level:
!> positions of tools, and the accumulated loads and energies when the step has its equilibrium (theory.md,
!> Quasi-static steps, Balance of energy).
module m_static_loads
   use m_kinds, only: wp, i8
   use m_friction_law, only: has_friction
   use m_vectors, only: cross
   use m_model, only: model_t
   use m_boundary, only: motion_parity
   use m_static_contact, only: static_contact_t
   use m_static_point, only: static_point_t
   use m_static_levels, only: collect
   use m_ghost_penalty, only: work_of_faces
   use m_static_losses, only: face_reals
   use m_static_system, only: static_system_t
   use m_static_meetings, only: find_meeting_points, accumulate_meetings
   use m_face_gap, only: find_gap, thickest
   use m_tool_reactions, only: reaction_t, close_ring, add_up
   implicit none
   private
   public :: find_contact, accumulate_contact, accumulate_losses, any_friction

   integer, parameter :: max_checks = 50        !< limit of the search for the position in which a tool
                                                !< touches
   real(wp), parameter :: reach = 1.0_wp        !< cells: largest distance from which a point can reach a tool
                                                !< in a step
   integer, parameter :: voigt(9) = [1, 6, 5, 6, 2, 4, 5, 4, 3] !< column of the stress of component ij
   real(wp), parameter :: free = 0.02_wp        !< of half a thickness: gap of a point that has separated
   real(wp), parameter :: touches = 1.0e-7_wp   !< cells: a tool so near is in contact

contains

   !> Collective: find the points that the tools may press at their positions by given speeds at the step's
   !> end, and points at which bodies meet. A tool driven by a load along its axis, without contact so far,
   !> first moves to where it just touches. `again`: the step is repeated with a shorter length.
   subroutine find_contact(contact, model, compliance, time_step, again)
      type(static_contact_t), intent(inout) :: contact
      type(model_t), intent(inout) :: model
      real(wp), intent(in) :: compliance
      real(wp), intent(in) :: time_step !< s
      logical, intent(in) :: again
      real(wp) :: gap
      integer :: t, try
      contact%pair_specs = model%contact%pairs%specs
      do t = 1, size(contact%tools%now)
         if (.not. contact%tools%is_driven(t) .or. contact%tools%away(t)) cycle
         if (presses(model, t)) cycle
         do try = 1, max_checks
            gap = min_gap(contact, model, t)
            if (gap > 0.5_wp*huge(gap)) exit ! nothing within reach
            call contact%tools%shift(t, gap)
            if (abs(gap) <= touches*model%levels(size(model%levels))%grid%cell) exit
         end do
      end do
      associate (finest => model%levels(size(model%levels)))
         call model%contact%candidates%half_spaces%renew(model%communicator, finest, model%materials, &
                                                         model%contact%candidates%pressure)
         call contact%find(finest, model%materials, model%contact%candidates, reach*finest%grid%cell, &
                           compliance)
         if (model%contact%pairs%active()) &
            call find_meeting_points(contact, model%communicator, finest, model%materials, &
                                     model%contact%candidates, model%contact%pairs, model%time + time_step, &
                                     compliance, again)
      end associate
   end subroutine find_contact

   !> True when some tool or pair of the model has friction.
   pure logical function any_friction(model)
      type(model_t), intent(in) :: model
      integer :: t
      any_friction = any([(has_friction(model%contact%tools(t)%spec%friction), &
                           t=1, size(model%contact%tools))]) .or. model%contact%pairs%is_frictional()
   end function any_friction

   !> Collective: true for a tool that pressed anything in the last step.
   logical function presses(model, t)
      type(model_t), intent(in) :: model
      integer, intent(in) :: t
      integer :: b
      presses = .false.
      associate (first => model%contact%candidates%carried + model%contact%candidates%slots(t), &
                 last => model%contact%candidates%carried + model%contact%candidates%slots(t + 1) - 1)
         do b = 1, size(model%levels(size(model%levels))%blocks)
            associate (particles => model%levels(size(model%levels))%blocks(b)%particles)
               if (particles%count == 0) cycle
               presses = presses .or. any(abs(particles%column(:particles%count, first:last)) > 0.0_wp)
            end associate
         end do
      end associate
      presses = model%communicator%maximum(merge(1.0_wp, 0.0_wp, presses)) > 0.5_wp
   end function presses

   !> Collective: the smallest gap of the points to a tool, m.
   real(wp) function min_gap(contact, model, t) result(least)
      type(static_contact_t), intent(in) :: contact
      type(model_t), intent(in) :: model
      integer, intent(in) :: t
      real(wp) :: gap, normal(3), edge, thickness
      integer :: b, p
      least = huge(least)
      associate (level => model%levels(size(model%levels)))
         do b = 1, size(level%blocks)
            do p = 1, level%blocks(b)%particles%count
               if (contact%tools%now(t)%min_gap(level%blocks(b)%particles%column(p, &
                   level%layout%position:level%layout%position + 2)) > least + thickest(level)) cycle
               call find_gap(contact%tools%now(t), level, model%materials, b, p, huge(1.0_wp), gap, normal, &
                             edge, thickness)
               least = min(least, gap)
            end do
         end do
      end associate
      least = model%communicator%minimum(least)
   end function min_gap

   !> Collective: accumulate loads, work and pressures of the equilibrium, whose displacements are in the
   !> nodes; move tools to the step's end. Work is that of the mean of the loads at both ends, for each point
   !> over the displacement with contact; with inertia loads are means over the step themselves.
   subroutine accumulate_contact(contact, model, time_step, over_step)
      type(static_contact_t), intent(in) :: contact
      type(model_t), intent(inout) :: model
      real(wp), intent(in) :: time_step !< s
      logical, intent(in) :: over_step  !< loads are means over the step
      type(reaction_t) :: reactions(size(contact%tools%now))
      real(wp) :: load(3), moment(3), change, constraint, apart(size(contact%tools%now)), taken
      integer :: t
      if (.not. model%contact%active()) return
      call keep_pressures(contact, model)
      reactions = reaction_t()
      model%contact%states%overlap = 0.0_wp
      call gather(contact, model, over_step, reactions, apart, taken)
      model%static_losses%impact = model%static_losses%impact + model%communicator%sum_real(taken)
      call add_up(model%communicator, reactions, model%contact%states%overlap, &
                  model%contact%candidates%deepest)
      do t = 1, size(reactions)
         associate (tool => model%contact%tools(t), state => model%contact%states(t))
            load = state%load
            moment = state%moment
            tool = contact%tools%now(t)
            constraint = state%constraint_work
            ! heat is that of the surface, not of the nodes
            reactions(t)%heat = reactions(t)%heat + (reactions(t)%stored_shear - state%stored_shear)
            call state%accumulate(reactions(t), tool, [0.0_wp, 0.0_wp, 0.0_wp], [0.0_wp, 0.0_wp, 0.0_wp], &
                                  time_step)
            state%constraint_work = constraint
            if (over_step) cycle
            change = 0.5_wp*time_step*dot_product(state%load - load, tool%velocity)
            if (tool%pivot > 0) &
               change = change + 0.5_wp*time_step*dot_product(state%moment - moment, tool%spin)
            change = change + model%communicator%sum_real(apart(t))
            state%work = state%work + change
            if (model%step == 0) &
               model%static_losses%uncertainty = model%static_losses%uncertainty + abs(change)
         end associate
      end do
      if (model%contact%pairs%active()) &
         call accumulate_meetings(contact, model%communicator, model%levels(size(model%levels)), &
                                  model%materials, model%contact%pairs, time_step, over_step, &
                                  model%contact%candidates%pressure)
      model%contact%worst_overlap = maxval([model%contact%worst_overlap, model%contact%states%overlap, &
                                            model%contact%pairs%overlap])
      call model%contact%candidates%half_spaces%end_step()
      associate (candidates => nint(sum(reactions%candidates) + sum(model%contact%pairs%step%candidates), i8))
         model%contact%largest = max(model%contact%largest, candidates)
         model%contact%handled = model%contact%handled + candidates
      end associate
   end subroutine accumulate_contact

   !> Reactions of the tools to the points of this rank.
   subroutine gather(contact, model, over_step, reactions, apart, taken)
      type(static_contact_t), intent(in) :: contact
      type(model_t), intent(inout) :: model
      logical, intent(in) :: over_step
      type(reaction_t), intent(inout) :: reactions(:) !< (tools)
      real(wp), intent(out) :: apart(:) !< (tools): work minus that of the mean loads, J
      real(wp), intent(out) :: taken    !< by points that come into contact within the step, J
      real(wp) :: force(3)
      integer :: n
      apart = 0.0_wp
      taken = 0.0_wp
      model%contact%candidates%deepest = 0.0_wp
      do n = 1, contact%count
         if (contact%list(n)%point%tool == 0) cycle
         associate (it => contact%list(n), sums => reactions(contact%list(n)%point%tool), &
                    state => model%contact%states(contact%list(n)%point%tool))
            sums%candidates = sums%candidates + 1.0_wp
            if (it%barred) cycle
            call accumulate_point(contact, n, model%levels(size(model%levels))%nodes, over_step, sums, &
                                  apart(it%point%tool), taken)
            state%overlap = max(state%overlap, -it%gap - it%subcell_compliance*it%force)
            if (.not. it%force > 0.0_wp) cycle
            force = contact%share*(it%force*it%normal + it%friction_force)
            associate (deepest => model%contact%candidates%deepest(it%point%tool))
               deepest = max(deepest, it%point%subcell*contact%share*it%force/it%point%area)
            end associate
            sums%load = sums%load - force
            sums%moment = sums%moment - cross(it%place - contact%tools%now(it%point%tool)%point, force)
         end associate
      end do
      call close_ring(reactions, model%levels(1)%grid%section)
   end subroutine gather

   !> True when the gap of a point that is no longer pressed is carried: until it has separated by the
   !> particle's shape too.
   pure logical function is_carried(it)
      type(static_point_t), intent(in) :: it
      associate (drift => it%depth - it%natural)
         is_carried = .not. it%barred .and. abs(drift) > 0.0_wp &
                      .and. it%gap + drift <= max(free*it%natural, abs(drift))
      end associate
   end function is_carried

   !> Store pressures of the points in the columns of their particles; and gaps: a pressed point has its gap
   !> closed whatever its compliance, except for the deflection below the cells, and 0 would mean no carried
   !> gap.
   subroutine keep_pressures(contact, model)
      type(static_contact_t), intent(in) :: contact
      type(model_t), intent(inout) :: model
      real(wp) :: way !< m
      integer :: b, n, slots
      slots = model%contact%candidates%slots(size(model%contact%candidates%slots))
      associate (level => model%levels(size(model%levels)), at => model%contact%candidates)
         do b = 1, size(level%blocks)
            associate (block => level%blocks(b), last => level%blocks(b)%particles%count)
               block%pressed = .false.
               if (last == 0) cycle
               block%particles%column(:last, at%earlier) = block%particles%column(:last, at%pressure)
               block%particles%column(:last, at%pressure) = 0.0_wp
               block%particles%column(:last, at%carried:at%carried + slots - 1) = 0.0_wp
               if (at%deflected > 0) &
                  block%particles%column(:last, at%deflected:at%deflected + slots - 1) = 0.0_wp
               if (at%own > 0) &
                  block%particles%column(:last, at%own:at%own + at%own_width*slots - 1) = 0.0_wp
               if (at%dragged > 0) block%particles%column(:last, at%dragged:at%dragged + 2) = 0.0_wp
               if (at%traction > 0) &
                  block%particles%column(:last, at%traction:at%traction + 2) = 0.0_wp
            end associate
         end do
         do n = 1, contact%count
            associate (it => contact%list(n), block => level%blocks(contact%list(n)%point%block))
               if (it%point%tool == 0) cycle
               if (.not. it%force > 0.0_wp) then
                  if (is_carried(it)) &
                     block%particles%column(it%point%particle, at%carried + it%point%slot) = it%node_gap()
                  cycle
               end if
               block%pressed = .true.
               associate (column => block%particles%column, p => it%point%particle)
                  column(p, at%pressure) = column(p, at%pressure) + contact%share*it%force/it%point%area
                  call at%keep_own(column(p, :), it%point, contact%share*it%force/it%point%area, &
                                   contact%share*it%friction_force/it%point%area)
                  way = dot_product(it%point%normal, it%deflection)
                  column(p, at%carried + it%point%slot) = merge(-way, tiny(1.0_wp), abs(way) > 0.0_wp)
                  if (at%deflected > 0) column(p, at%deflected + it%point%slot) = way
                  if (at%dragged > 0) column(p, at%dragged:at%dragged + 2) = it%deflection &
                     - way*it%point%normal
                  if (it%point%has_friction) column(p, at%traction:at%traction + 2) &
                     = column(p, at%traction:at%traction + 2) + contact%share*it%friction_force/it%point%area
               end associate
            end associate
         end do
      end associate
   end subroutine keep_pressures

   !> Accumulate a point of a tool in equilibrium. Its force grows over the displacement with contact: the
   !> closing of an initial gap, or a final opening, does no work. With inertia the force acts from the step's
   !> beginning, and its work across the gap is lost. Friction heat is by the slip.
   subroutine accumulate_point(contact, n, motion, over_step, sums, apart, taken)
      type(static_contact_t), intent(in) :: contact
      integer, intent(in) :: n
      real(wp), intent(in), contiguous :: motion(:, 0:, 0:, 0:, :) !< displacements of the nodes, m
      logical, intent(in) :: over_step         !< forces are means over the step
      type(reaction_t), intent(inout) :: sums  !< of the tool
      real(wp), intent(inout) :: apart         !< work minus that of the mean of the loads at both ends, J
      real(wp), intent(inout) :: taken         !< J
      real(wp) :: across, before(3), force(3), heat, own, rubs, slip(3)
      associate (it => contact%list(n), share => contact%share)
         if (.not. max(it%force, it%force_before) > 0.0_wp) return
         call begin_of(contact, n, before, across)
         force = 0.0_wp
         if (it%force > 0.0_wp) force = it%force*it%normal + it%friction_force
         if (over_step) then
            taken = taken + share*it%force*across
            sums%particle_work = sums%particle_work + share*it%force*across
            before = force
         else if (it%force > 0.0_wp) then
            apart = apart - 0.5_wp*share*it%force*across
         else
            apart = apart + 0.5_wp*share*it%force_before*max(0.0_wp, it%gap)
         end if
         sums%particle_work = sums%particle_work &
                              + 0.5_wp*share*dot_product(before + force, contact%way(n, motion))
         if (.not. it%force > 0.0_wp) return
         rubs = norm2(it%friction_force)
         own = it%contact_compliance - it%subcell_compliance
         sums%stored = sums%stored + 0.5_wp*share*(own*(it%force**2 + rubs**2) &
                                                   + it%force*dot_product(it%normal, it%deflection))
         sums%stored_shear = sums%stored_shear + 0.5_wp*share*dot_product(it%friction_force, it%deflection)
         sums%relaxed = sums%relaxed + share*it%relaxed()
         if (.not. rubs > 0.0_wp) return
         slip = it%slip + it%contact_compliance*it%friction_force
         heat = -dot_product(it%friction_force, slip)
         if (.not. over_step) apart = apart + share*(heat + 0.5_wp*dot_product(it%friction_force &
                                                                               + it%friction_before, slip))
         sums%heat = sums%heat + share*heat
      end associate
   end subroutine accumulate_point

   !> Force of a point on its body at the step's beginning (N), and the gap (m) of its nodes to be closed
   !> then: the deflection of its surface below the cells is stored; 0 if it is pressed.
   subroutine begin_of(contact, n, force, across)
      type(static_contact_t), intent(in) :: contact
      integer, intent(in) :: n
      real(wp), intent(out) :: force(3), across
      real(wp) :: gap, normal(3)
      force = 0.0_wp
      across = 0.0_wp
      associate (it => contact%list(n))
         if (it%point%tool > 0) then
            call contact%tools%gap_before(it%point%tool, it%point%sheet, it%point%from, gap, normal)
            gap = gap - it%depth
         else
            gap = it%point%gap
            normal = it%point%normal
         end if
         if (it%force_before > 0.0_wp) then
            force = it%force_before*normal
            if (it%point%has_friction) force = force + it%friction_before
         else
            across = max(0.0_wp, gap)
         end if
      end associate
   end subroutine begin_of

   !> Collective: accumulate the dissipation of a step with these displacements by the ghost penalty and by
   !> theta, and the uncertainty of the energy balance: the work of effects' loads is by the mean of both
   !> ends, as if they grew along the displacement, which those of the first step need not. The work beyond it
   !> where material flows is known from its stress; with inertia it is no loss by theta. The last trial must
   !> have been with these displacements.
   subroutine accumulate_losses(system, z)
      type(static_system_t), intent(inout) :: system
      real(wp), intent(in) :: z(:) !< m
      real(wp) :: held(size(z)), flow, ghost, theta
      integer :: l
      flow = system%model%communicator%sum_real(work_in_flow(system))
      call system%set_motion(z)
      call system%clear_forces()
      do l = 1, size(system%levels)
         call system%levels(l)%ghost%add_forces(system%model%levels(l)%nodes, 1.0_wp, system%levels(l)%forces)
      end do
      held = 0.0_wp
      call collect(system%levels, system%model, motion_parity, held)
      ghost = system%dot(held, z)
      associate (model => system%model, losses => system%model%static_losses)
         if (.not. system%inertia%acts) then
            losses%in_flow = losses%in_flow + flow
            losses%ghost_penalty = losses%ghost_penalty + 0.5_wp*(ghost + released_by_faces(system))
            held(:system%nodal) = system%load(:system%nodal) - system%load_before(:system%nodal)
            held(system%nodal + 1:) = 0.0_wp
            if (model%step == 0) losses%uncertainty = losses%uncertainty + 0.5_wp*abs(system%dot(held, z))
            return
         end if
         theta = system%inertia%share
         losses%ghost_penalty = losses%ghost_penalty + theta*ghost
         if (.not. abs(theta - 0.5_wp) > 0.0_wp) return
         associate (jump => system%time_step*system%inertia%mean_acceleration(z, system%time_step))
            held = system%inertia%stiffness*(theta*system%time_step)**2*jump
            losses%theta = losses%theta + max(0.0_wp, (theta - 0.5_wp)*(system%dot(held, jump) &
                           + model%communicator%sum_real(work_of_stress(system, -1.0_wp, 1.0_wp))) - flow)
         end associate
      end associate
   end subroutine accumulate_losses

   !> Work of the stress of this rank's particles that may flow in the step, beyond the mean of its ends, J.
   real(wp) function work_in_flow(system) result(work)
      type(static_system_t), intent(in) :: system
      integer :: b, l
      work = 0.0_wp
      do l = 1, size(system%levels)
         associate (level => system%model%levels(l))
            do b = 1, size(level%blocks)
               if (level%blocks(b)%particles%count > 0) &
                  work = work + system%levels(l)%trial(b)%work_in_flow(level%blocks(b)%particles, &
                                system%model%materials, level%layout, system%time_step)
            end do
         end associate
      end do
   end function work_in_flow

   !> Collective: work of the ghost penalty's forces of the last step, which are released, in this one, J;
   !> they are replaced by those of this step.
   real(wp) function released_by_faces(system) result(released)
      type(static_system_t), intent(inout) :: system
      real(wp), allocatable :: faces(:, :)
      integer :: l
      released = 0.0_wp
      associate (model => system%model, losses => system%model%static_losses)
         allocate (faces(face_reals, 0))
         do l = 1, size(model%levels)
            associate (level => model%levels(l), ghost => system%levels(l)%ghost)
               if (allocated(losses%faces)) &
                  released = released + work_of_faces(losses%faces, level, level%nodes)
               faces = reshape([faces, ghost%forces_of_faces(level, level%nodes)], &
                               [face_reals, size(faces, 2) + ghost%count])
            end associate
         end do
         call move_alloc(faces, losses%faces)
         released = model%communicator%sum_real(released)
      end associate
   end function released_by_faces

   !> Work of shares of the stress at the step's beginning and end along its displacement, on this rank, J.
   real(wp) function work_of_stress(system, before, after) result(work)
      type(static_system_t), intent(in) :: system
      real(wp), intent(in) :: before, after
      integer :: b, c, l
      work = 0.0_wp
      do l = 1, size(system%levels)
         do b = 1, size(system%model%levels(l)%blocks)
            associate (particles => system%model%levels(l)%blocks(b)%particles, &
                       at => system%model%levels(l)%layout, trial => system%levels(l)%trial(b), &
                       n => system%model%levels(l)%blocks(b)%particles%count)
               if (n == 0) cycle
               do c = 1, 9
                  work = work + sum((before*particles%column(:n, at%volume) &
                                     *particles%column(:n, at%stress + voigt(c) - 1) &
                                     - after*trial%force(:n, c))*trial%gradient(:n, c))
               end do
            end associate
         end do
      end do
   end function work_of_stress

end module m_static_loads
