!> Inertia in implicit steps: the lumped masses of the nodes, and their initial velocities in a step
!> (theory.md, eqs newmark, newmark-residual).
module m_static_inertia
   use m_kinds, only: wp
   use m_node_values, only: mass_
   use m_model, only: model_t
   use m_static_levels, only: static_level_t
   implicit none
   private
   public :: static_inertia_t

   !> With `share` theta, displacements u of a step and velocities v at its beginning: inertia adds the forces
   !> `steady` - `stiffness` u to the unknowns.
   type :: static_inertia_t
      logical :: acts = .false.
      real(wp) :: share = 1.0_wp             !< weight of the step's end in its mean forces and velocities
      real(wp), allocatable :: stiffness(:)  !< (unknowns): mass over (theta dt)^2, N/m
      real(wp), allocatable :: steady(:)     !< (unknowns), N
      real(wp), allocatable :: velocity(:)   !< (unknowns): at the step's beginning, m/s
   contains
      procedure :: begin
      procedure :: mean_acceleration
   end type static_inertia_t

contains

   !> Set the masses, after put_loads at the step's beginning.
   subroutine begin(self, levels, model, time_step, velocity, force)
      class(static_inertia_t), intent(inout) :: self
      type(static_level_t), intent(in) :: levels(:)
      type(model_t), intent(in) :: model
      real(wp), intent(in) :: time_step
      real(wp), intent(in) :: velocity(:) !< of the unknowns at the step's beginning, m/s
      real(wp), intent(in) :: force(:)    !< on them at that time, by stress and effects, N
      integer :: l, n
      if (allocated(self%stiffness)) deallocate (self%stiffness)
      allocate (self%stiffness(size(velocity)))
      do l = 1, size(levels)
         associate (unknowns => levels(l)%unknowns, nodes => model%levels(l)%nodes)
            do n = 1, unknowns%count
               associate (at => unknowns%at(:, n))
                  self%stiffness(levels(l)%before + n) = nodes(mass_, at(2), at(3), at(4), at(5)) &
                                                         /(self%share*time_step)**2
               end associate
            end do
         end associate
      end do
      self%velocity = velocity
      self%steady = (1.0_wp - self%share)/self%share*force + self%stiffness*time_step*velocity
   end subroutine begin

   !> The mean acceleration of the unknowns in a step, m/s2.
   pure function mean_acceleration(self, z, time_step) result(acceleration)
      class(static_inertia_t), intent(in) :: self
      real(wp), intent(in) :: z(:) !< displacements, m
      real(wp), intent(in) :: time_step
      real(wp) :: acceleration(size(z))
      acceleration = (z/time_step - self%velocity)/(self%share*time_step)
   end function mean_acceleration

end module m_static_inertia
