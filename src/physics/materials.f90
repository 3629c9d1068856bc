!> The list of material laws: one line a law.
module m_materials
   use m_kinds, only: wp
   use m_scene, only: scene_t, material_spec_t
   use m_material, only: material_t
   use m_elastic, only: elastic_t
   use m_neo_hookean, only: neo_hookean_t
   use m_j2, only: j2_t
   use m_johnson_cook, only: johnson_cook_t
   implicit none
   private
   public :: materials_t, make_materials

   !> One material of a scene; an array of laws of different type.
   type :: material_slot_t
      class(material_t), allocatable :: law
   end type material_slot_t

   !> The materials of a scene, and which body is made of which.
   type :: materials_t
      type(material_slot_t), allocatable :: slots(:)
      integer, allocatable :: of_body(:)
   end type materials_t

contains

   !> The materials of a scene.
   function make_materials(scene) result(materials)
      type(scene_t), intent(in) :: scene
      type(materials_t) :: materials
      integer :: m
      materials%slots = [(make_material(scene%materials(m)), m=1, size(scene%materials))]
      materials%of_body = scene%bodies%material
   end function make_materials

   !> The law that a material group names. The name has been checked by the reader.
   function make_material(spec) result(slot)
      type(material_spec_t), intent(in) :: spec
      type(material_slot_t) :: slot
      select case (spec%model)
      case ('elastic'); allocate (elastic_t :: slot%law)
      case ('neo_hookean'); allocate (neo_hookean_t :: slot%law)
      case ('j2'); allocate (j2_t :: slot%law)
      case ('johnson_cook'); allocate (johnson_cook_t :: slot%law)
      end select
      slot%law%density = spec%density
      slot%law%lame = spec%young*spec%poisson/((1.0_wp + spec%poisson)*(1.0_wp - 2.0_wp*spec%poisson))
      slot%law%shear = spec%young/(2.0_wp*(1.0_wp + spec%poisson))
   end function make_material

end module m_materials
