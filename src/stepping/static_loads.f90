!> Contact of a quasi-static step with the tools of the model: where they go, and what is booked when the step
!> has its equilibrium.
module m_static_loads
   use m_kinds, only: wp, i8
   use m_vectors, only: cross
   use m_model, only: model_t
   use m_static_contact, only: static_contact_t
   use m_tool_reactions, only: reaction_t, add_up
   implicit none
   private
   public :: find_contact, book_contact

contains

   !> Points that the tools, where they are at the end of a step, may press.
   subroutine find_contact(contact, model, time_step, reach, compliance)
      type(static_contact_t), intent(inout) :: contact
      type(model_t), intent(inout) :: model
      real(wp), intent(in) :: time_step, reach, compliance !< s, m, 1
      integer :: t
      if (allocated(contact%tools)) deallocate (contact%tools)
      contact%tools = model%contact%tools
      do t = 1, size(contact%tools)
         call contact%tools(t)%begin_step(model%time, time_step)
         call contact%tools(t)%end_step(model%time + time_step, time_step)
      end do
      call contact%find(model%levels(1), model%materials, reach, compliance, &
                        model%contact%candidates%pressure)
   end subroutine find_contact

   !> Collective: loads, works and pressures of the equilibrium, of which the nodes hold the displacements;
   !> tools go to the step's end. Work is that of the mean of the loads at both ends.
   subroutine book_contact(contact, model, time_step)
      type(static_contact_t), intent(in) :: contact
      type(model_t), intent(inout) :: model
      real(wp), intent(in) :: time_step !< s
      type(reaction_t) :: reactions(size(contact%tools))
      real(wp) :: load(3), moment(3), arm(3)
      integer :: n, t
      if (size(contact%tools) == 0) return
      call keep_pressures(contact, model)
      reactions = reaction_t()
      model%contact%states%overlap = 0.0_wp
      do n = 1, contact%count
         associate (it => contact%list(n), sums => reactions(contact%list(n)%point%tool), &
                    state => model%contact%states(contact%list(n)%point%tool))
            state%overlap = max(state%overlap, -it%gap)
            sums%candidates = sums%candidates + 1.0_wp
            if (.not. it%force > 0.0_wp) cycle
            arm = it%start + contact%way(n, model%levels(1)%nodes) - contact%tools(it%point%tool)%point
            sums%load = sums%load - it%force*it%normal
            sums%moment = sums%moment - it%force*cross(arm, it%normal)
         end associate
      end do
      call add_up(model%communicator, reactions, model%contact%states%overlap)
      do t = 1, size(reactions)
         associate (tool => model%contact%tools(t), state => model%contact%states(t))
            load = state%load
            moment = state%moment
            call tool%begin_step(model%time, time_step)
            call state%book(reactions(t), tool, [0.0_wp, 0.0_wp, 0.0_wp], [0.0_wp, 0.0_wp, 0.0_wp], time_step)
            state%work = state%work + 0.5_wp*time_step*dot_product(state%load - load, tool%velocity)
            if (tool%pivot > 0) &
               state%work = state%work + 0.5_wp*time_step*dot_product(state%moment - moment, tool%spin)
            call tool%end_step(model%time + time_step, time_step)
         end associate
      end do
      model%contact%worst_overlap = maxval([model%contact%worst_overlap, model%contact%states%overlap])
      associate (candidates => nint(sum(reactions%candidates), i8))
         model%contact%largest = max(model%contact%largest, candidates)
         model%contact%handled = model%contact%handled + candidates
      end associate
   end subroutine book_contact

   !> Pressures of the points into the columns of their particles; and gaps: those that are pressed touch, whatever
   !> they yield, and no 0 says so.
   subroutine keep_pressures(contact, model)
      type(static_contact_t), intent(in) :: contact
      type(model_t), intent(inout) :: model
      integer :: b, n, tools
      tools = size(contact%tools)
      associate (level => model%levels(1), at => model%contact%candidates)
         do b = 1, size(level%blocks)
            associate (block => level%blocks(b), last => level%blocks(b)%particles%count)
               block%pressed = .false.
               if (last == 0) cycle
               block%particles%column(:last, at%earlier) = block%particles%column(:last, at%pressure)
               block%particles%column(:last, at%pressure) = 0.0_wp
               block%particles%column(:last, at%carried:at%carried + tools - 1) = 0.0_wp
            end associate
         end do
         do n = 1, contact%count
            associate (it => contact%list(n), block => level%blocks(contact%list(n)%point%block))
               if (.not. it%force > 0.0_wp) cycle
               block%pressed = .true.
               associate (column => block%particles%column, p => it%point%particle)
                  column(p, at%pressure) = column(p, at%pressure) + it%force/it%point%area
                  column(p, at%carried + it%point%tool - 1) = tiny(1.0_wp)
               end associate
            end associate
         end do
      end associate
   end subroutine keep_pressures

end module m_static_loads
