!> The materials of a scene. A step calls the law of each by the interface of laws (m_material); the list of
!> laws is in materials.f90.
module m_scene_materials
   use m_scene, only: scene_t, material_spec_t
   use m_material, only: material_t
   use m_field_table, only: layout_t
   use m_particle_store, only: particle_store_t
   implicit none
   private
   public :: materials_t, make_materials

   !> One material of a scene; an array of laws of different type.
   type :: material_slot_t
      class(material_t), allocatable :: law
   end type material_slot_t

   !> The materials of a scene, and the material of each body.
   type :: materials_t
      type(material_slot_t), allocatable :: slots(:)
      integer, allocatable :: of_body(:)
   contains
      procedure :: are_at_rest
   end type materials_t

contains

   !> True when no law changes any of the particles, which bear no stress, as long as they do not move.
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

   !> Create the law of a material group, with the density that all laws have.
   subroutine make_material(spec, law)
      type(material_spec_t), intent(in) :: spec
      class(material_t), allocatable, intent(out) :: law
      select type (known => spec%law)
      class is (material_t)
         allocate (law, source=known)
      end select
      law%density = spec%density
   end subroutine make_material

end module m_scene_materials
