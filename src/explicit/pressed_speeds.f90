!> Contact velocities for schemes with a separate solution for the stress ('usf', 'musl'): its nodes have the
!> particles' momenta but lack contact. Points pressed by a tool are given the velocities of the last contact
!> solution (theory.md, eq. pressed-speeds).
module m_pressed_speeds
   use m_kinds, only: wp
   use m_text, only: to_text
   use m_communicator, only: communicator_t
   use m_level, only: level_t
   use m_scene_materials, only: materials_t
   use m_contact_point, only: point_velocity, place_of
   use m_vectors, only: cross
   use m_tool, only: tool_t
   use m_contact_rows, only: assemble, move_nodes
   use m_contact, only: contact_t
   implicit none
   private
   public :: find_pressed, keep_pressed_speeds


contains

   !> Collective, at the beginning of a step: find the points pressed by tools in the last step, and their
   !> velocities after it, relative to the tools' present motion.
   subroutine find_pressed(contact, communicator, level, materials, time, time_step)
      type(contact_t), intent(inout) :: contact
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(inout) :: level
      type(materials_t), intent(in) :: materials
      real(wp), intent(in) :: time, time_step !< s
      real(wp) :: overlap(size(contact%tools))
      integer :: c, t
      do t = 1, size(contact%tools)
         call contact%tools(t)%begin_step(time, time_step, have_pushed=.true.) ! loads act once a step
         contact%given(:, t) = given_motion(contact%tools(t))
      end do
      call contact%candidates%half_spaces%renew(communicator, level, materials, contact%candidates%pressure)
      call contact%candidates%find(contact%tools, level, materials, time_step, overlap, again=.true.)
      call contact%make_room(communicator)
      if (.not. contact%has_problem) return
      do c = 1, contact%candidates%count
         associate (it => contact%candidates%list(c))
            associate (column => level%blocks(it%block)%particles%column, left => contact%candidates%left)
               it%velocity = column(it%particle, left:left + 2) + contact%given(:3, it%tool) &
                             + cross(contact%given(4:, it%tool), place_of(it))
               it%force = 0.0_wp
               if (it%carried) it%force = column(it%particle, contact%candidates%pressure)*it%area
            end associate
         end associate
      end do
      call assemble(contact%system, communicator, contact%tools, contact%candidates, level, &
                    contact%spec%compliance, time_step, subcell=.false.)
   end subroutine find_pressed

   !> Velocity of a tool at the origin (m/s) and its spin (rad/s); 0 for a load-driven one, whose own velocity
   !> is that of the step before.
   pure function given_motion(tool) result(motion)
      type(tool_t), intent(in) :: tool
      real(wp) :: motion(6)
      motion = 0.0_wp
      if (tool%is_pushed()) return
      motion(:3) = tool%velocity
      if (tool%pivot == 0) return
      motion(4:) = tool%spin
      motion(:3) = motion(:3) - cross(tool%spin, tool%point)
   end function given_motion

   !> Collective: the smallest change of the nodes' velocities that gives pressed points their velocities.
   subroutine keep_pressed_speeds(contact, communicator, level, time_step)
      type(contact_t), intent(inout) :: contact
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(inout) :: level
      real(wp), intent(in) :: time_step !< s
      real(wp), allocatable :: lacks(:), x(:), give_way(:)
      logical, allocatable :: held(:)
      real(wp) :: residual, missing(3)
      integer :: c, last, t
      if (.not. contact%has_problem) return
      if (contact%system%has_subcell) & ! it is for the step's own contact; these nodes must get the exact
                                        ! velocities
         call assemble(contact%system, communicator, contact%tools, contact%candidates, level, &
                       contact%spec%compliance, time_step, subcell=.false.)
      associate (system => contact%system, n => contact%candidates%count)
         allocate (lacks(system%rows), x(system%rows), source=0.0_wp)
         allocate (held(system%rows), source=.false.)
         do c = 1, n
            associate (it => contact%candidates%list(c))
               if (.not. it%force > 0.0_wp) cycle
               missing = it%velocity - point_velocity(level, it)
               held(c) = system%scale(c) > 0.0_wp
               lacks(c) = dot_product(it%normal, missing)*system%scale(c)
               if (it%frictional == 0) cycle
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
