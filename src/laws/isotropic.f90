!> Shared by laws of isotropic elasticity: Young's modulus, Poisson's ratio, and derived moduli.
module m_isotropic
   use m_kinds, only: wp
   use m_group_reader, only: group_reader_t
   use m_material, only: material_t
   use m_value_range, only: above
   implicit none
   private
   public :: isotropic_t

   type, abstract, extends(material_t) :: isotropic_t
      real(wp) :: young = 0.0_wp, poisson = 0.0_wp !< Pa; 1
      real(wp) :: lame = 0.0_wp                    !< first Lame constant, Pa
      real(wp) :: shear = 0.0_wp                   !< shear modulus, Pa
   contains
      procedure :: variables => elastic_variables
      procedure :: set_moduli
      procedure :: p_wave_modulus
      procedure :: complementary_energy
      procedure :: von_mises_modulus
      procedure, non_overridable :: elastic_variables
   end type isotropic_t

contains

   !> The moduli. A law with variables of its own calls this first.
   subroutine elastic_variables(self, group)
      class(isotropic_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      call group%get('young', self%young, above(0.0_wp, 'Pa'), required=.true.)
      call group%get('poisson', self%poisson, above(-1.0_wp, '', below=0.5_wp), required=.true.)
      call self%set_moduli(self%young, self%poisson)
   end subroutine elastic_variables

   pure subroutine set_moduli(self, young, poisson)
      class(isotropic_t), intent(inout) :: self
      real(wp), intent(in) :: young !< Pa
      real(wp), intent(in) :: poisson
      self%young = young
      self%poisson = poisson
      self%lame = young*poisson/((1.0_wp + poisson)*(1.0_wp - 2.0_wp*poisson))
      self%shear = young/(2.0_wp*(1.0_wp + poisson))
   end subroutine set_moduli

   pure real(wp) function p_wave_modulus(self)
      class(isotropic_t), intent(in) :: self
      p_wave_modulus = self%lame + 2.0_wp*self%shear
   end function p_wave_modulus

   pure real(wp) function complementary_energy(self, stress) result(energy)
      class(isotropic_t), intent(in) :: self
      real(wp), intent(in) :: stress(6)
      energy = (sum(stress(1:3)**2) + 2.0_wp*sum(stress(4:6)**2) &
                - self%lame/(3.0_wp*self%lame + 2.0_wp*self%shear)*sum(stress(1:3))**2)/(4.0_wp*self%shear)
   end function complementary_energy

   pure real(wp) function von_mises_modulus(self) result(modulus)
      class(isotropic_t), intent(in) :: self
      modulus = 3.0_wp*self%shear
   end function von_mises_modulus

end module m_isotropic
