!> The list of effects: one line an effect.
module m_effects
   use m_offer, only: catalogue_t, offer
   use m_scene, only: scene_t
   use m_effect, only: effect_t, effect_slot_t
   implicit none
   private
   public :: known_effects, make_effects, add_effect

contains

   !> Add all effects to a catalogue. They act in this order. One line an effect: it brings its own `use`.
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

   !> The effects that a scene calls for, in order, without those that it declines; none when it does not say.
   subroutine make_effects(scene, effects)
      type(scene_t), intent(in) :: scene
      type(effect_slot_t), allocatable, intent(out) :: effects(:)
      integer :: e, n
      n = 0
      if (allocated(scene%effects)) n = count([(.not. scene%effects(e)%it%declined(), e=1, &
                                                size(scene%effects))])
      allocate (effects(n))
      if (n == 0) return
      n = 0
      do e = 1, size(scene%effects)
         if (scene%effects(e)%it%declined()) cycle
         n = n + 1
         select type (it => scene%effects(e)%it)
         class is (effect_t)
            allocate (effects(n)%effect, source=it)
         end select
      end do
   end subroutine make_effects

   !> Append an effect that no group of a scene asks for.
   subroutine add_effect(effects, effect)
      type(effect_slot_t), allocatable, intent(inout) :: effects(:)
      class(effect_t), intent(in) :: effect
      type(effect_slot_t), allocatable :: more(:)
      integer :: e
      allocate (more(size(effects) + 1))
      do e = 1, size(effects)
         call move_alloc(effects(e)%effect, more(e)%effect)
      end do
      allocate (more(size(more))%effect, source=effect)
      call move_alloc(more, effects)
   end subroutine add_effect

end module m_effects
