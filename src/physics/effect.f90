!> What an optional effect must offer. One effect is one file that extends effect_t; a scene without it pays nothing.
module m_effect
   use m_kinds, only: wp
   use m_field_table, only: field_table_t, layout_t
   use m_particle_store, only: particle_store_t
   implicit none
   private
   public :: effect_t, effect_slot_t

   type, abstract :: effect_t
   contains
      procedure(declare_interface), deferred :: declare
      procedure(acceleration_interface), deferred :: acceleration
   end type effect_t

   !> One effect of a scene; an array of effects of different type.
   type :: effect_slot_t
      class(effect_t), allocatable :: effect
   end type effect_slot_t

   abstract interface
      !> Add the particle fields that the effect needs.
      pure subroutine declare_interface(self, table)
         import :: effect_t, field_table_t
         class(effect_t), intent(in) :: self
         type(field_table_t), intent(inout) :: table
      end subroutine declare_interface

      !> Add to the body force per mass (m/s2) of the block's particles at a time (s).
      pure subroutine acceleration_interface(self, particles, table, layout, time, acceleration)
         import :: effect_t, field_table_t, layout_t, particle_store_t, wp
         class(effect_t), intent(in) :: self
         type(particle_store_t), intent(in) :: particles
         type(field_table_t), intent(in) :: table
         type(layout_t), intent(in) :: layout
         real(wp), intent(in) :: time
         real(wp), intent(inout) :: acceleration(:, :) !< (:, 3)
      end subroutine acceleration_interface
   end interface

end module m_effect
