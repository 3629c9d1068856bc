!> Error messages about contact: which particle, where, on which level, at which tool.
module m_contact_complaints
   use m_kinds, only: wp
   use m_constants, only: exit_numerical, block_size
   use m_errors, only: error_t, fail
   use m_text, only: to_text
   use m_tool, only: tool_t
   use m_level, only: level_t
   use m_contact_point, only: candidate_t
   use m_face_gap, only: near_tool, thickest, fastest
   use m_candidates, only: candidates_t
   implicit none
   private
   public :: forbid_contact, check_nodes, candidate_text, allowed_text

contains

   !> An error if a tool reaches a particle of a coarser level than the finest, which alone supports contact.
   subroutine forbid_contact(tools, level, finest, error)
      type(tool_t), intent(in) :: tools(:)
      type(level_t), intent(in) :: level, finest
      type(error_t), intent(inout) :: error
      real(wp) :: place(3)
      integer :: b, p, t
      do b = 1, size(level%blocks)
         call first_inside(tools, level, b, p, t)
         if (p == 0) cycle
         associate (x => level%layout%position)
            place = level%blocks(b)%particles%column(p, x:x + 2)
         end associate
         call fail(error, exit_numerical, 'the tool '//tools(t)%spec%name//' touches particle '// &
                   to_text(level%blocks(b)%particles%id(p))//' at ('//to_text(place(1))//', '// &
                      to_text(place(2))//', '// &
                   to_text(place(3))//') m, on level '//to_text(level%number)//'; '//allowed_text(finest))
      end do
   end subroutine forbid_contact

   !> The first particle of a block whose contact point lies inside a tool, and the tool; 0 if there is none.
   pure subroutine first_inside(tools, level, b, particle, tool)
      type(tool_t), intent(in) :: tools(:)
      type(level_t), intent(in) :: level
      integer, intent(in) :: b
      integer, intent(out) :: particle, tool
      real(wp) :: gap, limit, normal(3)
      associate (column => level%blocks(b)%particles%column, x => level%layout%position)
         do tool = 1, size(tools)
            if (.not. near_tool(tools(tool), level, level%blocks(b), fastest*level%grid%cell)) cycle
            limit = tools(tool)%spec%penetration_factor*thickest(level)
            do particle = 1, level%blocks(b)%particles%count
               ! few particles are so near that their thickness is needed
               call tools(tool)%gap_within(column(particle, x:x + 2), limit, gap, normal)
               if (.not. gap < limit) cycle
               if (gap <= -limit) return
               if (gap < tools(tool)%spec%penetration_factor*level%thickness(column(particle, :), &
                     normal)) return
            end do
         end do
      end associate
      particle = 0
   end subroutine first_inside

   !> The region where contact is allowed, as text for a message.
   function allowed_text(finest) result(text)
      type(level_t), intent(in) :: finest
      character(len=:), allocatable :: text
      real(wp) :: low(3), high(3)
      call finest%region%bounding_box(low, high)
      text = 'contact is allowed inside the finest level, ('//to_text(low(1))//', '//to_text(low(2))//', '// &
             to_text(low(3))//') to ('//to_text(high(1))//', '//to_text(high(2))//', '//to_text(high(3))// &
             ') m: try a larger &level, '//'or one that follows'
   end function allowed_text

   !> A contact force must not act on a node that is no unknown of the level.
   subroutine check_nodes(candidates, tools, level, error)
      type(candidates_t), intent(in) :: candidates
      type(tool_t), intent(in) :: tools(:)
      type(level_t), intent(in) :: level
      type(error_t), intent(inout) :: error
      real(wp) :: place(3)
      integer :: c
      if (level%number == 1) return
      do c = 1, candidates%count
         associate (it => candidates%list(c))
            if (.not. it%force > 0.0_wp) cycle
            if (acts_inside(level, it)) cycle
            associate (x => level%layout%position)
               place = level%blocks(it%block)%particles%column(it%particle, x:x + 2)
            end associate
            call fail(error, exit_numerical, opponent(it, tools)//' presses on particle '// &
                      to_text(level%blocks(it%block)%particles%id(it%particle))//' at ('// &
                      to_text(place(1))// &
                      ', '//to_text(place(2))//', '//to_text(place(3))//') m, at the edge of level '// &
                      to_text(level%number)//'; '//allowed_text(level))
            return
         end associate
      end do
   end subroutine check_nodes

   !> All nodes that a candidate's force acts on are unknowns of the level.
   pure logical function acts_inside(level, it)
      type(level_t), intent(in) :: level
      type(candidate_t), intent(in) :: it
      integer :: i, j, k
      acts_inside = .true.
      associate (node => block_size*level%blocks(it%block)%place + it%face%corner)
         do k = 0, it%face%last
            do j = 0, it%face%last
               do i = 0, it%face%last
                  if (it%face%weight(i, j, k) > 0.0_wp) acts_inside = acts_inside &
                        .and. level%region%is_inner(node + [i, j, k])
               end do
            end do
         end do
      end associate
   end function acts_inside

   !> Particle, tool, time, position and level, as text for a message.
   function candidate_text(it, tools, level, time) result(text)
      type(candidate_t), intent(in) :: it
      type(tool_t), intent(in) :: tools(:)
      type(level_t), intent(in) :: level
      real(wp), intent(in) :: time !< s
      character(len=:), allocatable :: text
      real(wp) :: place(3)
      associate (x => level%layout%position)
         associate (particles => level%blocks(it%block)%particles)
            place = particles%column(it%particle, x:x + 2)
            text = 'time '//to_text(time)//' s: particle '//to_text(particles%id(it%particle))// &
                   ' of body '// &
                   to_text(int(particles%body(it%particle)))// &
                   ' at ('//to_text(place(1))//', '//to_text(place(2))//', '//to_text(place(3))// &
                      ') m on level '// &
                   to_text(level%number)//' at '//opponent(it, tools)
         end associate
      end associate
   end function candidate_text

   !> The opponent of a candidate, as text for a message.
   pure function opponent(it, tools) result(text)
      type(candidate_t), intent(in) :: it
      type(tool_t), intent(in) :: tools(:)
      character(len=:), allocatable :: text
      text = 'another body'
      if (it%tool > 0) text = 'the tool '//tools(it%tool)%spec%name
   end function opponent

end module m_contact_complaints
