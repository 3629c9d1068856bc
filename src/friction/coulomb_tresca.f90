!> Friction of metal forming (Orowan): Coulomb's, with a limit of the shear stress on the surface, at which
!> the material below it shears off. With a large coefficient only the limit acts (Tresca friction, tau_max =
!> m k with the shear factor m and the shear flow stress k).
module m_coulomb_tresca
   use m_kinds, only: wp
   use m_text, only: to_text
   use m_group_reader, only: group_reader_t
   use m_value_range, only: at_least, above
   use m_friction_law, only: friction_law_t
   use m_coulomb, only: largest_friction
   implicit none
   private

   type, extends(friction_law_t), public :: coulomb_tresca_t
      real(wp) :: coefficient = 0.0_wp
      real(wp) :: tau_max = 0.0_wp !< Pa
   contains
      procedure :: variables
      procedure :: limit
      procedure :: acts
      procedure :: text
   end type coulomb_tresca_t

contains

   subroutine variables(self, group)
      class(coulomb_tresca_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      call group%get('friction', self%coefficient, at_least(0.0_wp, '', at_most=largest_friction))
      call group%get('tau_max', self%tau_max, above(0.0_wp, 'Pa'), required=.true.)
   end subroutine variables

   pure real(wp) function limit(self, pressing, area)
      class(coulomb_tresca_t), intent(in) :: self
      real(wp), intent(in) :: pressing, area
      limit = min(self%coefficient*pressing, self%tau_max*area)
   end function limit

   pure logical function acts(self)
      class(coulomb_tresca_t), intent(in) :: self
      acts = self%coefficient > 0.0_wp
   end function acts

   pure function text(self)
      class(coulomb_tresca_t), intent(in) :: self
      character(len=:), allocatable :: text
      text = 'friction '//to_text(self%coefficient)//' up to a shear stress of '//to_text(self%tau_max)//' Pa'
   end function text

end module m_coulomb_tresca
