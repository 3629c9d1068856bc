!> The list of effects: one line an effect.
module m_effects
   use m_offer, only: catalogue_t, offer
   use m_effect, only: effect_t
   implicit none
   private
   public :: known_effects

contains

   !> Add all effects to a catalogue. They act in this order. One line an effect, with its own `use`.
   subroutine known_effects(catalogue)
      type(catalogue_t), intent(inout) :: catalogue
      allocate (catalogue%effects(0))
      block; use m_gravity, only: gravity_t; call add('gravity', gravity_t()); end block
      block; use m_damping, only: damping_t; call add('damping', damping_t()); end block
      block; use m_pressure, only: pressure_t; call add('pressure', pressure_t(repeats=.true.)); end block
      block; use m_bulk_viscosity, only: bulk_viscosity_t; call add('bulk_viscosity', &
         bulk_viscosity_t()); end block
      block; use m_damage, only: damage_t; call add('damage', damage_t()); end block
      block; use m_anti_locking, only: anti_locking_t; call add('anti_locking', anti_locking_t()); end block
      block; use m_grains, only: grains_t; call add('grains', grains_t(repeats=.true.)); end block
      block; use m_atoms, only: atoms_t; call add('atoms', atoms_t()); end block
   contains
      subroutine add(name, effect)
         character(len=*), intent(in) :: name
         class(effect_t), intent(in) :: effect
         call offer(catalogue%effects, name, effect)
      end subroutine add
   end subroutine known_effects

end module m_effects
