!> The list of material laws: one line a law.
module m_materials
   use m_kinds, only: wp
   use m_offer, only: catalogue_t, offer, offered
   use m_scene, only: scene_t, material_spec_t
   use m_isotropic, only: isotropic_t
   use m_material, only: material_t
   use m_field_table, only: layout_t
   use m_particle_store, only: particle_store_t
   implicit none
   private
   public :: materials_t, known_materials, make_materials, material_of

   !> One material of a scene; an array of laws of different type.
   type :: material_slot_t
      class(material_t), allocatable :: law
   end type material_slot_t

   !> The materials of a scene, and which body is made of which.
   type :: materials_t
      type(material_slot_t), allocatable :: slots(:)
      integer, allocatable :: of_body(:)
   contains
      procedure :: are_at_rest
   end type materials_t

contains

   !> Add all laws to a catalogue. One line a law: it brings its own `use`.
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

   !> True when no law changes one of the particles by itself, as long as they do not move; they bear no
   !> stress.
   pure logical function are_at_rest(self, particles, layout)
      class(materials_t), intent(in) :: self
      type(particle_store_t), intent(in) :: particles
      type(layout_t), intent(in) :: layout
      integer :: first, last
      are_at_rest = .true.
      last = 0
      do while (are_at_rest .and. last < particles%count)
         first = last + 1
         last = particles%run_end(first)
         associate (law => self%slots(self%of_body(particles%body(first)))%law)
            are_at_rest = law%is_at_rest(particles%column, layout, first, last)
         end associate
      end do
   end function are_at_rest

   !> The materials of a scene.
   function make_materials(scene) result(materials)
      type(scene_t), intent(in) :: scene
      type(materials_t) :: materials
      integer :: m
      allocate (materials%slots(size(scene%materials)))
      do m = 1, size(scene%materials)
         call make_material(scene%materials(m), materials%slots(m)%law)
      end do
      materials%of_body = scene%bodies%material
   end function make_materials

   !> The law of a material group, with the density that all laws have.
   subroutine make_material(spec, law)
      type(material_spec_t), intent(in) :: spec
      class(material_t), allocatable, intent(out) :: law
      select type (known => spec%law)
      class is (material_t)
         allocate (law, source=known)
      end select
      law%density = spec%density
   end subroutine make_material

   !> A material group of an isotropic law for programs that make a scene themselves. Variables of the law's
   !> own keep their defaults.
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
