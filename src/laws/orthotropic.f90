!> Orthotropic elasticity, with axes that rotate with the material, by engineering constants (theory.md, eq.
!> orthotropic).
module m_orthotropic
   use m_kinds, only: wp
   use m_group_reader, only: group_reader_t
   use m_lattice, only: lattice_t
   use m_small_systems, only: invert_definite
   use m_value_range, only: above, any_value
   implicit none
   private
   public :: orthotropic_t

   !> Order of the pairs of axes: 12 13 23, as in Abaqus.
   type, extends(lattice_t) :: orthotropic_t
      real(wp) :: young_moduli(3) = 0.0_wp   !< along the axes, Pa
      real(wp) :: poisson_ratios(3) = 0.0_wp !< nu_ij: contraction along j under tension along i
      real(wp) :: shear_moduli(3) = 0.0_wp   !< Pa
   contains
      procedure :: variables
   end type orthotropic_t

contains

   subroutine variables(self, group)
      class(orthotropic_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      real(wp) :: compliance(6, 6), stiffness(6, 6)
      integer, parameter :: first(3) = [1, 1, 2], second(3) = [2, 3, 3]
      logical :: definite
      integer :: k
      call group%get('young_moduli', self%young_moduli, above(0.0_wp, 'Pa'), required=.true.)
      call group%get('poisson_ratios', self%poisson_ratios, any_value(''), required=.true.)
      call group%get('shear_moduli', self%shear_moduli, above(0.0_wp, 'Pa'), required=.true.)
      if (.not. all([self%young_moduli, self%shear_moduli] > 0.0_wp)) return ! missing values are reported
                                                                             ! already
      compliance = 0.0_wp
      do k = 1, 3
         compliance(k, k) = 1.0_wp/self%young_moduli(k)
         compliance(first(k), second(k)) = -self%poisson_ratios(k)/self%young_moduli(first(k))
         compliance(second(k), first(k)) = compliance(first(k), second(k))
         compliance(7 - k, 7 - k) = 1.0_wp/self%shear_moduli(k)
      end do
      call invert_definite(compliance, stiffness, definite)
      if (.not. definite) stiffness = 0.0_wp
      call self%set_stiffness(group, 'poisson_ratios', stiffness)
   end subroutine variables

end module m_orthotropic
