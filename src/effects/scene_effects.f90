!> The effects of a scene. A step calls each by the interface of effects (m_effect); the list of effects is in
!> effects.f90.
module m_scene_effects
   use m_scene, only: scene_t
   use m_effect, only: effect_t, effect_slot_t
   implicit none
   private
   public :: make_effects, add_effect

contains

   !> Create the effects of a scene, in order, except declined ones.
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

   !> Append an effect that has no group in the scene.
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

end module m_scene_effects
