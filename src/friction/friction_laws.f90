!> The list of laws of friction: one line a law.
module m_friction_laws
   use m_offer, only: offer, offer_slot_t, offered, offered_names, know_others
   use m_group_reader, only: group_reader_t
   use m_friction_law, only: friction_law_t, surface_friction_t
   implicit none
   private
   public :: describe_friction

contains

   !> The laws for &tool and &body_contact, the default first. One line a law, with its own `use`.
   subroutine known_friction_laws(laws)
      type(offer_slot_t), allocatable, intent(out) :: laws(:)
      block; use m_coulomb, only: coulomb_t; call offer(laws, 'coulomb', coulomb_t()); end block
      block; use m_coulomb_tresca, only: coulomb_tresca_t; call offer(laws, 'coulomb_tresca', &
         coulomb_tresca_t()); end block
   end subroutine known_friction_laws

   !> Read or write `friction_law` of a group, and the variables of the law that it names.
   subroutine describe_friction(group, surface)
      type(group_reader_t), intent(inout) :: group
      type(surface_friction_t), intent(inout) :: surface
      type(offer_slot_t), allocatable :: laws(:)
      integer :: choice
      call known_friction_laws(laws)
      choice = 1
      if (allocated(surface%law)) choice = offered(laws, surface%law%name)
      if (choice > 1 .or. .not. group%is_writing()) &
         call group%get_choice('friction_law', choice, offered_names(laws))
      if (choice > 0) then
         if (.not. allocated(surface%law)) then
            select type (known => laws(choice)%it)
            class is (friction_law_t)
               allocate (surface%law, source=known)
            end select
         end if
         call surface%law%variables(group)
      end if
      call know_others(group, laws, choice)
   end subroutine describe_friction

end module m_friction_laws
