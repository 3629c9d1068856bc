!> The list of effects: one line an effect.
module m_effects
   use m_offer, only: catalogue_t, offer
   use m_scene, only: scene_t
   use m_effect, only: effect_t, effect_slot_t
   use m_gravity, only: gravity_t
   use m_damping, only: damping_t
   use m_pressure, only: pressure_t
   use m_bulk_viscosity, only: bulk_viscosity_t
   use m_anti_locking, only: anti_locking_t
   implicit none
   private
   public :: known_effects, make_effects

contains

   !> Add all effects to a catalogue. They act in this order.
   subroutine known_effects(catalogue)
      type(catalogue_t), intent(inout) :: catalogue
      call offer(catalogue%effects, 'gravity', gravity_t())
      call offer(catalogue%effects, 'damping', damping_t())
      call offer(catalogue%effects, 'pressure', pressure_t(repeats=.true.))
      call offer(catalogue%effects, 'bulk_viscosity', bulk_viscosity_t())
      call offer(catalogue%effects, 'anti_locking', anti_locking_t())
   end subroutine known_effects

   !> The effects that a scene calls for, in order; none when it does not say.
   subroutine make_effects(scene, effects)
      type(scene_t), intent(in) :: scene
      type(effect_slot_t), allocatable, intent(out) :: effects(:)
      integer :: e, n
      n = 0
      if (allocated(scene%effects)) n = size(scene%effects)
      allocate (effects(n))
      do e = 1, n
         select type (it => scene%effects(e)%it)
         class is (effect_t)
            allocate (effects(e)%effect, source=it)
         end select
      end do
   end subroutine make_effects

end module m_effects
