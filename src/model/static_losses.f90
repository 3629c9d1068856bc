!> What implicit steps take of the energy besides what contact and effects do (theory.md, Quasi-static steps,
!> Balance of energy).
module m_static_losses
   use m_kinds, only: wp
   implicit none
   private

   !> Sums since the start, J.
   type, public :: static_losses_t
      real(wp) :: ghost_penalty = 0.0_wp !< taken by the ghost penalty,
      real(wp) :: theta = 0.0_wp         !< by a theta above one half,
      real(wp) :: impact = 0.0_wp        !< by points that touch within a step that has inertia
      real(wp) :: held = 0.0_wp          !< by the ghost penalty at the end of the last step without inertia
      real(wp) :: uncertainty = 0.0_wp   !< of the balance, for loads count with the mean of a step's ends
      real(wp) :: in_flow = 0.0_wp       !< not taken, but done by loads beyond that mean where material flows
   contains
      procedure :: total
   end type static_losses_t

contains

   !> All that is taken, J.
   pure real(wp) function total(self)
      class(static_losses_t), intent(in) :: self
      total = self%ghost_penalty + self%theta + self%impact
   end function total

end module m_static_losses
