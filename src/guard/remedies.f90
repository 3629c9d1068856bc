!> Settings to try when the work of loads differs from that on particles, or energy is lost or made: of those
!> that help, what the scene does not have.
module m_remedies
   use m_domain_kinds, only: domain_kinds
   use m_scene, only: scene_t
   use m_model, only: model_t
   implicit none
   private
   public :: remedy

contains

   function remedy(scene, model) result(text)
      type(scene_t), intent(in) :: scene
      type(model_t), intent(in) :: model
      character(len=:), allocatable :: text
      text = 'try smaller cells there'
      if (any(scene%bodies%particles_per_cell == 1)) text = text//', particles_per_cell=8'
      associate (domain => domain_kinds(scene%time%domain))
         if (.not. domain%deforms .or. (.not. domain%turns .and. size(scene%tools) > 0)) &
            text = text//', domain=''corners'''
      end associate
      ! failed material that stays bears pressure alone, and nodes throw it about
      if (model%levels(1)%layout%damage > 0 .and. .not. any(model%effect_step%erodes)) &
         text = text//', erode=.true. in &damage'
   end function remedy

end module m_remedies
