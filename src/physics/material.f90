!> What a material law must offer. One law is one file that extends material_t, and one line in materials.f90.
module m_material
   use m_kinds, only: wp
   use m_field_table, only: field_table_t, layout_t
   use m_group_reader, only: group_reader_t
   use m_offer, only: offer_t
   implicit none
   private
   public :: material_t

   type, abstract, extends(offer_t) :: material_t
      real(wp) :: density = 0.0_wp !< of the undeformed material, kg/m3
      real(wp) :: lame = 0.0_wp    !< first Lame constant, Pa
      real(wp) :: shear = 0.0_wp   !< shear modulus, Pa
   contains
      procedure :: variables
      procedure :: declare
      procedure :: initial
      procedure :: stiffest
      procedure :: plastic_energy
      procedure(update_interface), deferred :: update
      procedure(energy_interface), deferred :: strain_energy
      procedure(stretch_interface), deferred :: stretch
   end type material_t

   abstract interface
      !> Advance the stress of particles first..last (all of this material) by dt times their velocity gradient.
      !> gradient(:, 9), 1/s: d v_i / d x_j at 3 (j-1) + i. The volume has not been advanced yet.
      pure subroutine update_interface(self, column, layout, gradient, time_step, first, last)
         import :: material_t, layout_t, wp
         class(material_t), intent(in) :: self
         real(wp), intent(inout), contiguous :: column(:, :)
         type(layout_t), intent(in) :: layout
         real(wp), intent(in), contiguous :: gradient(:, :)
         real(wp), intent(in) :: time_step
         integer, intent(in) :: first, last
      end subroutine update_interface

      !> Strain energy of particles first..last together (all of this material), J.
      pure real(wp) function energy_interface(self, column, layout, first, last)
         import :: material_t, layout_t, wp
         class(material_t), intent(in) :: self
         real(wp), intent(in), contiguous :: column(:, :)
         type(layout_t), intent(in) :: layout
         integer, intent(in) :: first, last
      end function energy_interface

      !> How much thicker or thinner a particle has become across a face with this normal: current over first thickness.
      pure real(wp) function stretch_interface(self, values, layout, direction)
         import :: material_t, layout_t, wp
         class(material_t), intent(in) :: self
         real(wp), intent(in) :: values(:)    !< the particle's columns
         type(layout_t), intent(in) :: layout
         real(wp), intent(in) :: direction(3) !< unit vector
      end function stretch_interface
   end interface

contains

   !> Read or write the variables of the law beyond density, young and poisson; most have none.
   subroutine variables(self, group)
      class(material_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      associate (unused => self%density, unchanged => group); end associate
   end subroutine variables

   !> Add the fields that the law needs beyond stress, and remember their columns; most need none.
   pure subroutine declare(self, table)
      class(material_t), intent(inout) :: self
      type(field_table_t), intent(inout) :: table
      associate (unchanged => self%density, unused => table%columns); end associate
   end subroutine declare

   !> First values of the law's own fields for the new particles first..last; those that start at zero need none.
   pure subroutine initial(self, column, layout, first, last)
      class(material_t), intent(in) :: self
      real(wp), intent(inout), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: first, last
      associate (unused => self%density, unchanged => column, here => layout%stress, from => first, to => last); end associate
   end subroutine initial

   !> Plastic work of particles first..last since the start (all of this material), J; a law without plastic flow has none.
   pure real(wp) function plastic_energy(self, column, first, last)
      class(material_t), intent(in) :: self
      real(wp), intent(in), contiguous :: column(:, :)
      integer, intent(in) :: first, last
      associate (unused => self%density, unread => column, from => first, to => last); end associate
      plastic_energy = 0.0_wp
   end function plastic_energy

   !> Largest modulus of a plane wave relative to the current volume, Pa: c = sqrt(stiffest V/m).
   pure real(wp) function stiffest(self)
      class(material_t), intent(in) :: self
      stiffest = self%lame + 2.0_wp*self%shear
   end function stiffest

end module m_material
