!> Coulomb friction: the tangential force is at most the coefficient times the normal force.
module m_coulomb
   use m_kinds, only: wp
   use m_text, only: to_text
   use m_group_reader, only: group_reader_t
   use m_value_range, only: at_least
   use m_friction_law, only: friction_law_t, surface_friction_t
   implicit none
   private
   public :: coulomb_friction

   real(wp), parameter, public :: largest_friction = 10.0_wp !< coefficient

   type, extends(friction_law_t), public :: coulomb_t
      real(wp) :: coefficient = 0.0_wp
   contains
      procedure :: variables
      procedure :: limit
      procedure :: acts
      procedure :: text
   end type coulomb_t

contains

   !> A surface with this law.
   type(surface_friction_t) function coulomb_friction(coefficient) result(surface)
      real(wp), intent(in) :: coefficient
      allocate (surface%law, source=coulomb_t(coefficient=coefficient))
      surface%law%name = 'coulomb'
   end function coulomb_friction

   subroutine variables(self, group)
      class(coulomb_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      call group%get('friction', self%coefficient, at_least(0.0_wp, '', at_most=largest_friction))
   end subroutine variables

   pure real(wp) function limit(self, pressing, area)
      class(coulomb_t), intent(in) :: self
      real(wp), intent(in) :: pressing, area
      limit = self%coefficient*pressing
   end function limit

   pure logical function acts(self)
      class(coulomb_t), intent(in) :: self
      acts = self%coefficient > 0.0_wp
   end function acts

   pure function text(self)
      class(coulomb_t), intent(in) :: self
      character(len=:), allocatable :: text
      text = 'friction '//to_text(self%coefficient)
   end function text

end module m_coulomb
