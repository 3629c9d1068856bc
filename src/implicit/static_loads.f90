!> Contact of a quasi-static step with the tools of the model and between its bodies, on the finest level:
!> where tools go, and what is booked when the step has its equilibrium.
module m_static_loads
   use m_kinds, only: wp, i8
   use m_friction_law, only: has_friction
   use m_vectors, only: cross
   use m_model, only: model_t
   use m_static_contact, only: static_contact_t
   use m_static_meetings, only: find_meeting_points, book_meetings
   use m_face_gap, only: find_gap, thickest
   use m_tool_reactions, only: reaction_t, close_ring, add_up
   implicit none
   private
   public :: find_contact, book_contact, any_friction

   integer, parameter :: max_checks = 50        !< for where a tool touches
   real(wp), parameter :: reach = 1.0_wp        !< cells: no point comes to a tool from further away in a step
   real(wp), parameter :: touches = 1.0e-7_wp   !< cells: a tool so near touches

contains

   !> Collective: points that the tools, where given speeds bring them by the end of a step, may press, and
   !> points at which bodies meet. A tool that a load moves along its axis, and that presses nothing, stands
   !> where it just touches at first. `again`: the step is tried once more, shorter.
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
            if (gap > 0.5_wp*huge(gap)) exit ! nothing is there
            call contact%tools%shift(t, gap)
            if (abs(gap) <= touches*model%levels(size(model%levels))%grid%cell) exit
         end do
      end do
      associate (finest => model%levels(size(model%levels)))
         call contact%find(finest, model%materials, reach*finest%grid%cell, compliance, &
                           model%contact%candidates%pressure, model%contact%candidates%traction)
         if (model%contact%pairs%active()) &
            call find_meeting_points(contact, model%communicator, finest, model%materials, &
                                     model%contact%pairs, model%time + time_step, compliance, again)
      end associate
   end subroutine find_contact

   !> True when some tool or pair of the model has friction.
   pure logical function any_friction(model)
      type(model_t), intent(in) :: model
      integer :: t
      any_friction = any([(has_friction(model%contact%tools(t)%spec%friction), &
                           t=1, size(model%contact%tools))]) .or. model%contact%pairs%is_frictional()
   end function any_friction

   !> Collective: true of a tool that pressed something in the last step.
   logical function presses(model, t)
      type(model_t), intent(in) :: model
      integer, intent(in) :: t
      integer :: b
      presses = .false.
      associate (at => model%contact%candidates%carried + t - 1)
         do b = 1, size(model%levels(size(model%levels))%blocks)
            associate (particles => model%levels(size(model%levels))%blocks(b)%particles)
               if (particles%count == 0) cycle
               presses = presses .or. any(abs(particles%column(:particles%count, at)) > 0.0_wp)
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

   !> Collective: loads, works and pressures of the equilibrium, of which the nodes hold the displacements;
   !> tools go to the step's end. Work is that of the mean of the loads at both ends; with inertia loads are
   !> means over the step themselves.
   subroutine book_contact(contact, model, time_step, over_step)
      type(static_contact_t), intent(in) :: contact
      type(model_t), intent(inout) :: model
      real(wp), intent(in) :: time_step !< s
      logical, intent(in) :: over_step  !< loads are means over the step
      type(reaction_t) :: reactions(size(contact%tools%now))
      real(wp) :: load(3), moment(3), change
      integer :: t
      if (.not. model%contact%active()) return
      call keep_pressures(contact, model)
      reactions = reaction_t()
      model%contact%states%overlap = 0.0_wp
      call gather(contact, model, reactions)
      model%contact%candidates%deepest = 0.0_wp
      call add_up(model%communicator, reactions, model%contact%states%overlap, &
                  model%contact%candidates%deepest)
      do t = 1, size(reactions)
         associate (tool => model%contact%tools(t), state => model%contact%states(t))
            load = state%load
            moment = state%moment
            tool = contact%tools%now(t)
            call state%accumulate(reactions(t), tool, [0.0_wp, 0.0_wp, 0.0_wp], [0.0_wp, 0.0_wp, 0.0_wp], &
                                  time_step)
            if (over_step) cycle
            change = 0.5_wp*time_step*dot_product(state%load - load, tool%velocity)
            if (tool%pivot > 0) &
               change = change + 0.5_wp*time_step*dot_product(state%moment - moment, tool%spin)
            state%work = state%work + change
            model%static_doubt = model%static_doubt + abs(change)
         end associate
      end do
      if (model%contact%pairs%active()) &
         call book_meetings(contact, model%communicator, model%levels(size(model%levels)), model%materials, &
                            model%contact%pairs, time_step, model%contact%candidates%pressure)
      model%contact%worst_overlap = maxval([model%contact%worst_overlap, model%contact%states%overlap, &
                                            model%contact%pairs%overlap])
      associate (candidates => nint(sum(reactions%candidates) + sum(model%contact%pairs%step%candidates), i8))
         model%contact%largest = max(model%contact%largest, candidates)
         model%contact%handled = model%contact%handled + candidates
      end associate
   end subroutine book_contact

   !> Reactions of the tools to the points of this rank. Friction makes heat by what slips.
   subroutine gather(contact, model, reactions)
      type(static_contact_t), intent(in) :: contact
      type(model_t), intent(inout) :: model
      type(reaction_t), intent(inout) :: reactions(:) !< (tools)
      real(wp) :: force(3)
      integer :: n
      do n = 1, contact%count
         if (contact%list(n)%point%tool == 0) cycle
         associate (it => contact%list(n), sums => reactions(contact%list(n)%point%tool), &
                    state => model%contact%states(contact%list(n)%point%tool))
            sums%candidates = sums%candidates + 1.0_wp
            if (it%barred) cycle
            state%overlap = max(state%overlap, -it%gap)
            if (.not. it%force > 0.0_wp) cycle
            force = contact%share*(it%force*it%normal + it%friction_force)
            sums%load = sums%load - force
            sums%moment = sums%moment - cross(it%place - contact%tools%now(it%point%tool)%point, force)
            sums%heat = sums%heat - contact%share &
                        *dot_product(it%friction_force, it%slip + it%contact_compliance*it%friction_force)
         end associate
      end do
      call close_ring(reactions, model%levels(1)%grid%section)
   end subroutine gather

   !> Pressures of the points into the columns of their particles; and gaps: those that are pressed touch,
   !> whatever they yield, and no 0 says so.
   subroutine keep_pressures(contact, model)
      type(static_contact_t), intent(in) :: contact
      type(model_t), intent(inout) :: model
      integer :: b, n, tools
      tools = size(contact%tools%now)
      associate (level => model%levels(size(model%levels)), at => model%contact%candidates)
         do b = 1, size(level%blocks)
            associate (block => level%blocks(b), last => level%blocks(b)%particles%count)
               block%pressed = .false.
               if (last == 0) cycle
               block%particles%column(:last, at%earlier) = block%particles%column(:last, at%pressure)
               block%particles%column(:last, at%pressure) = 0.0_wp
               block%particles%column(:last, at%carried:at%carried + tools - 1) = 0.0_wp
               if (at%deflected > 0) &
                  block%particles%column(:last, at%deflected:at%deflected + tools - 1) = 0.0_wp
               if (at%dragged > 0) block%particles%column(:last, at%dragged:at%dragged + 2) = 0.0_wp
               if (at%traction > 0) &
                  block%particles%column(:last, at%traction:at%traction + 2) = 0.0_wp
            end associate
         end do
         do n = 1, contact%count
            associate (it => contact%list(n), block => level%blocks(contact%list(n)%point%block))
               if (.not. it%force > 0.0_wp .or. it%point%tool == 0) cycle
               block%pressed = .true.
               associate (column => block%particles%column, p => it%point%particle)
                  column(p, at%pressure) = column(p, at%pressure) + contact%share*it%force/it%point%area
                  column(p, at%carried + it%point%tool - 1) = tiny(1.0_wp)
                  if (it%point%has_friction) column(p, at%traction:at%traction + 2) &
                     = column(p, at%traction:at%traction + 2) + contact%share*it%friction_force/it%point%area
               end associate
            end associate
         end do
      end associate
   end subroutine keep_pressures

end module m_static_loads
