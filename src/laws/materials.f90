!> The list of material laws: one line a law.
module m_materials
   use m_kinds, only: wp
   use m_offer, only: catalogue_t, offer, offered
   use m_scene, only: material_spec_t
   use m_isotropic, only: isotropic_t
   use m_material, only: material_t
   implicit none
   private
   public :: known_materials, material_of

contains

   !> Add all laws to a catalogue. One line a law, with its own `use`.
   subroutine known_materials(catalogue)
      type(catalogue_t), intent(inout) :: catalogue
      block; use m_elastic, only: elastic_t; call add('elastic', elastic_t()); end block
      block; use m_neo_hookean, only: neo_hookean_t; call add('neo_hookean', neo_hookean_t()); end block
      block; use m_j2, only: j2_t; call add('j2', j2_t()); end block
      block; use m_johnson_cook, only: johnson_cook_t; call add('johnson_cook', johnson_cook_t()); end block
      block; use m_mie_grueneisen, only: mie_grueneisen_t; call add('mie_grueneisen', mie_grueneisen_t())
      end block
      block; use m_norton, only: norton_t; call add('norton', norton_t()); end block
      block; use m_drucker_prager, only: drucker_prager_t; call add('drucker_prager', drucker_prager_t())
      end block
      block; use m_maxwell, only: maxwell_t; call add('maxwell', maxwell_t()); end block
      block; use m_vumat, only: vumat_t; call add('vumat', vumat_t()); end block
      block; use m_umat, only: umat_t; call add('umat', umat_t()); end block
      block; use m_c_law, only: c_law_t; call add('c_law', c_law_t()); end block
      block; use m_cubic, only: cubic_t; call add('cubic', cubic_t()); end block
      block; use m_orthotropic, only: orthotropic_t; call add('orthotropic', orthotropic_t()); end block
      block; use m_crystal, only: crystal_t; call add('crystal', crystal_t()); end block
      block; use m_cauchy_born, only: cauchy_born_t; call add('cauchy_born', cauchy_born_t()); end block
   contains
      subroutine add(name, law)
         character(len=*), intent(in) :: name
         class(material_t), intent(in) :: law
         call offer(catalogue%models, name, law)
      end subroutine add
   end subroutine known_materials

   !> A material group of an isotropic law for programs that create scenes. Variables of the law's own keep
   !> their defaults.
   function material_of(name, model, density, young, poisson) result(spec)
      character(len=*), intent(in) :: name, model !< `model` as in a scene
      real(wp), intent(in) :: density             !< kg/m3
      real(wp), intent(in) :: young               !< Pa
      real(wp), intent(in) :: poisson
      type(material_spec_t) :: spec
      type(catalogue_t) :: catalogue
      call known_materials(catalogue)
      spec%name = name
      spec%density = density
      allocate (spec%law, source=catalogue%models(offered(catalogue%models, model))%it)
      select type (law => spec%law)
      class is (isotropic_t)
         call law%set_moduli(young, poisson)
      end select
   end function material_of

end module m_materials
