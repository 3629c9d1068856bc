!> Friction at contact points with known normal forces: each force lies in a disc normal to the contact
!> normal, with the radius given by the friction law, and minimises the slip (theory.md, eqs friction,
!> friction-problem). Nesterov's accelerated gradients with projection on the discs: for sliding points,
!> forces lie on the rims, and a solver for boxes needed ten times the products.
module m_friction
   use mpi_f08
   use m_kinds, only: wp, i8
   use m_level, only: level_t
   use m_contact_point, only: candidate_t, point_velocity
   use m_contact_system, only: contact_system_t
   implicit none
   private
   public :: friction_t

   !> Rows come in pairs: two directions normal to the contact normal of each candidate with friction.
   type :: friction_t
      logical :: present = .false.           !< at least one tool has friction
      real(wp), allocatable :: force(:)      !< (rows of friction), scaled
      real(wp), allocatable :: free(:) !< slip due to the tool's motion, without contact forces, scaled
      real(wp), allocatable :: memory(:) !< compliance times the force of the last step: only changes of the
                                         !< force are compliant
      real(wp) :: steepest = 1.0_wp          !< largest curvature of the problems so far
      integer(i8) :: sweeps = 0, iterations = 0 !< over the run
   contains
      procedure :: begin
      procedure :: solve
      procedure :: hand_out
      procedure :: forces_of
   end type friction_t

contains

   !> Start from the friction of the last step. The rows of the system have been scaled.
   subroutine begin(self, system, list, level, time_step)
      class(friction_t), intent(inout) :: self
      type(contact_system_t), intent(in) :: system
      type(candidate_t), intent(in) :: list(:)
      type(level_t), intent(in) :: level
      real(wp), intent(in) :: time_step !< s
      real(wp) :: velocity(3)
      integer :: c, k, n, r
      n = size(list)
      if (allocated(self%force)) deallocate (self%force, self%free)
      allocate (self%force(system%rows - n), self%free(system%rows - n), source=0.0_wp)
      do c = 1, n
         if (list(c)%frictional == 0) cycle
         velocity = list(c)%opposite - point_velocity(level, list(c))
         do k = 1, 2
            r = 2*list(c)%frictional - 2 + k
            if (system%scale(n + r) > 0.0_wp) &
               self%force(r) = dot_product(list(c)%tangent(:, k), &
                                           list(c)%last_tangential_force)/system%scale(n + r)
            self%free(r) = dot_product(list(c)%tangent(:, k), velocity)*system%scale(n + r)
         end do
      end do
      self%memory = system%softness(n + 1:system%rows)*self%force
      if (system%has_subcell) call remember_deflection(self, system, list, time_step)
   end subroutine begin

   !> The deflection below the cells is remembered as such, not by the force of the point alone.
   subroutine remember_deflection(self, system, list, time_step)
      type(friction_t), intent(inout) :: self
      type(contact_system_t), intent(in) :: system
      type(candidate_t), intent(in) :: list(:)
      real(wp), intent(in) :: time_step !< s
      integer :: c, k, n, r
      n = size(list)
      do c = 1, n
         if (list(c)%frictional == 0) cycle
         do k = 1, 2
            r = 2*list(c)%frictional - 2 + k
            associate (scale => system%scale(n + r))
               self%memory(r) = self%memory(r) - system%subcell_rows(n + r)*scale**2*self%force(r) &
                                + dot_product(list(c)%tangent(:, k), list(c)%shear_deflection)*scale/time_step
            end associate
         end do
      end do
   end subroutine remember_deflection

   !> Collective: the friction for given normal forces. Its rows are the active ones.
   subroutine solve(self, system, radius, pushed, tolerance, limit, residual)
      class(friction_t), intent(inout) :: self
      type(contact_system_t), intent(inout) :: system
      real(wp), intent(in) :: radius(:) !< (pairs): the largest friction, scaled
      real(wp), intent(in) :: pushed(:) !< (rows of friction): slip due to the normal forces, scaled
      real(wp), intent(in) :: tolerance
      integer, intent(in) :: limit      !< products
      real(wp), intent(out) :: residual !< of the projected gradient, relative to the right-hand side
      real(wp), dimension(size(pushed)) :: b, m_force, y, m_y, next, m_next, step
      real(wp) :: pace, quicker, size_of_b, sums(3)
      integer :: k
      b = self%free + self%memory - pushed
      call keep_in_discs(radius, self%force)
      call system%multiply(self%force, m_force)
      sums = [dot_product(b, b), 0.0_wp, 0.0_wp]
      call MPI_Allreduce(MPI_IN_PLACE, sums, 3, MPI_DOUBLE_PRECISION, MPI_SUM, system%communicator%comm)
      size_of_b = max(sqrt(sums(1)), tiny(size_of_b))
      residual = huge(residual)
      quicker = 1.0_wp
      y = self%force
      m_y = m_force
      do k = 1, limit
         self%iterations = self%iterations + 1
         next = y - (m_y - b)/self%steepest
         call keep_in_discs(radius, next)
         call system%multiply(next, m_next)
         step = next - y
         sums = [dot_product(step, m_next - m_y), dot_product(step, step), &
                -dot_product(step, next - self%force)]
         call MPI_Allreduce(MPI_IN_PLACE, sums, 3, MPI_DOUBLE_PRECISION, MPI_SUM, system%communicator%comm)
         if (sums(1) > self%steepest*sums(2)) then ! the step is too long for this curvature
            self%steepest = 1.1_wp*sums(1)/sums(2)
            cycle
         end if
         residual = self%steepest*sqrt(sums(2))/size_of_b
         pace = quicker
         quicker = 0.5_wp*(1.0_wp + sqrt(1.0_wp + 4.0_wp*pace**2))
         if (sums(3) > 0.0_wp) then ! uphill: restart the acceleration
            quicker = 1.0_wp
            pace = 1.0_wp
         end if
         y = next + (pace - 1.0_wp)/quicker*(next - self%force)
         m_y = m_next + (pace - 1.0_wp)/quicker*(m_next - m_force)
         self%force = next
         m_force = m_next
         if (residual <= tolerance) exit
      end do
   end subroutine solve

   !> Project forces on their discs.
   pure subroutine keep_in_discs(radius, force)
      real(wp), intent(in) :: radius(:)
      real(wp), intent(inout) :: force(:)
      real(wp) :: length
      integer :: c
      do c = 1, size(radius)
         length = norm2(force(2*c - 1:2*c))
         if (length > radius(c)) force(2*c - 1:2*c) = force(2*c - 1:2*c)*(radius(c)/length)
      end do
   end subroutine keep_in_discs

   !> Store the friction in the candidates.
   subroutine hand_out(self, system, list)
      class(friction_t), intent(in) :: self
      type(contact_system_t), intent(in) :: system
      type(candidate_t), intent(inout) :: list(:)
      integer :: c, r
      do c = 1, size(list)
         r = 2*list(c)%frictional
         if (r > 0) list(c)%tangential_force = self%force(r - 1:r)*system%scale(size(list) + r &
               - 1:size(list) + r)
      end do
   end subroutine hand_out

   !> The friction of a system's rows, scaled; none if no tool has friction.
   pure function forces_of(self, system) result(forces)
      class(friction_t), intent(in) :: self
      type(contact_system_t), intent(in) :: system
      real(wp) :: forces(system%rows - system%normal)
      forces = 0.0_wp
      if (size(forces) > 0) forces = self%force
   end function forces_of

end module m_friction
