!> Where the stress has a solve of its own ('usf', 'musl'), its nodes have the particles' momenta but have not
!> met the tools. At the points that a tool presses they are given the speeds that the step's contact has
!> left, or the tool's (theory.md, eq. pressed-speeds).
module m_pressed_speeds
   use m_kinds, only: wp
   use m_text, only: to_text
   use m_communicator, only: communicator_t
   use m_level, only: level_t
   use m_materials, only: materials_t
   use m_contact_point, only: point_velocity, tool_velocity, sliding
   use m_friction_limit, only: friction_limit
   use m_contact_rows, only: assemble, move_nodes
   use m_contact, only: contact_t
   implicit none
   private
   public :: find_pressed, keep_pressed_speeds


contains

   !> Collective, at the beginning of a step: the points that tools press since the last one, and the
   !> velocities of the tools there.
   subroutine find_pressed(contact, communicator, level, materials, time, time_step)
      type(contact_t), intent(inout) :: contact
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(inout) :: level
      type(materials_t), intent(in) :: materials
      real(wp), intent(in) :: time, time_step !< s
      real(wp) :: overlap(size(contact%tools))
      integer :: c, t
      do t = 1, size(contact%tools)
         call contact%tools(t)%begin_step(time, time_step, have_pushed=.true.) ! loads push once a step
      end do
      call contact%candidates%find(contact%tools, level, materials, time_step, overlap, again=.true.)
      call contact%make_room(communicator)
      if (.not. contact%has_problem) return
      do c = 1, contact%candidates%count
         associate (it => contact%candidates%list(c))
            it%velocity = tool_velocity(contact%tools, it)
            it%force = 0.0_wp
            if (it%carried) it%force = level%blocks(it%block)%particles%column(it%particle, &
                  contact%candidates%pressure)*it%area
            it%slides = norm2(it%last_tangential_force) > sliding*friction_limit(it, contact%tools, &
                  contact%pairs%specs, it%force)
         end associate
      end do
      call assemble(contact%system, communicator, contact%tools, contact%candidates, level, &
                    contact%spec%compliance, time_step, subcell=.false.)
   end subroutine find_pressed

   !> Collective: the smallest change of the nodes' velocities with which pressed points have theirs.
   subroutine keep_pressed_speeds(contact, level, time_step)
      type(contact_t), intent(inout) :: contact
      type(level_t), intent(inout) :: level
      real(wp), intent(in) :: time_step !< s
      real(wp), allocatable :: lacks(:), x(:), give_way(:)
      logical, allocatable :: held(:)
      real(wp) :: residual, missing(3)
      integer :: c, last, t
      if (.not. contact%has_problem) return
      associate (system => contact%system, n => contact%candidates%count)
         allocate (lacks(system%rows), x(system%rows), source=0.0_wp)
         allocate (held(system%rows), source=.false.)
         do c = 1, n
            associate (it => contact%candidates%list(c))
               if (.not. it%force > 0.0_wp) cycle
               missing = it%velocity - point_velocity(level, it)
               held(c) = system%scale(c) > 0.0_wp
               lacks(c) = dot_product(it%normal, missing)*system%scale(c)
               if (it%frictional == 0 .or. it%slides) cycle
               last = n + 2*it%frictional
               held(last - 1:last) = system%scale(last - 1:last) > 0.0_wp
               do t = 1, 2
                  lacks(last - 2 + t) = dot_product(it%tangent(:, t), missing)*system%scale(last - 2 + t)
               end do
            end associate
         end do
         give_way = system%freedom_mobility
         system%freedom_mobility = 0.0_wp ! a tool's own motion is known
         call system%activate(1, system%rows)
         call contact%solver%solve_among(system, held, lacks, x, contact%spec%tolerance, &
                                         contact%spec%max_iterations, residual)
         system%freedom_mobility = give_way
         call contact%check_convergence(residual, to_text(contact%spec%max_iterations)// &
                                        ' products for the stress')
         call move_nodes(system, level, time_step, x*system%scale(:system%rows))
      end associate
   end subroutine keep_pressed_speeds

end module m_pressed_speeds
