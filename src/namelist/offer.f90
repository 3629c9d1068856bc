!> What a scene may call for by name: a material law (`model='...'` of &material) or an effect (a group of its
!> own).
module m_offer
   use m_kinds, only: wp
   use m_text, only: to_text
   use m_group_reader, only: group_reader_t, name_length
   use m_section, only: section_t
   implicit none
   private
   public :: offer, offered_names, offered, know_others

   !> Something with a name and variables of its own. Laws and effects extend it.
   type, abstract, public :: offer_t
      character(len=:), allocatable :: name
      logical :: repeats = .false. !< an effect's group may stand in a scene more than once
      integer :: line = 0          !< of the scene, on which its group begins; 0: it was not read
   contains
      procedure :: group_text
      procedure :: for_large_strains
      procedure :: default_effect
      procedure :: is_oriented
      procedure :: declined
      procedure :: take_section
      procedure :: hollow
      procedure(variables_interface), deferred :: variables
   end type offer_t

   !> One of several offers of different type.
   type, public :: offer_slot_t
      class(offer_t), allocatable :: it
   end type offer_slot_t

   !> All that scenes may call for. Prototypes: what a scene gets is a copy with its own values.
   type, public :: catalogue_t
      type(offer_slot_t), allocatable :: models(:)  !< material laws
      type(offer_slot_t), allocatable :: effects(:) !< optional groups
      character(len=name_length), allocatable :: formats(:) !< of snapshots, the default first
   end type catalogue_t

   abstract interface
      !> Ask for each variable once, in the order of the documentation. The same procedure reads a group,
      !> tells which names it knows, and writes case.nml (then `group` takes the values): the values that come
      !> in are the defaults.
      subroutine variables_interface(self, group)
         import :: offer_t, group_reader_t
         class(offer_t), intent(inout) :: self
         type(group_reader_t), intent(inout) :: group
      end subroutine variables_interface
   end interface

contains

   !> How a sentence about its group begins: `line 7, &name`.
   pure function group_text(self) result(text)
      class(offer_t), intent(in) :: self
      character(len=:), allocatable :: text
      text = '&'//self%name
      if (self%line > 0) text = 'line '//to_text(self%line)//', '//text
   end function group_text

   !> True of a law that is made for large strains: domains of particles follow the material where the scene
   !> does not say.
   pure logical function for_large_strains(self)
      class(offer_t), intent(in) :: self
      for_large_strains = .false.
   end function for_large_strains

   !> The effect that a scene with this law gets where it does not say; empty: none.
   pure function default_effect(self) result(name)
      class(offer_t), intent(in) :: self
      character(len=:), allocatable :: name
      name = ''
   end function default_effect

   !> True of a law with axes of its own, which a body's `orientation` turns.
   pure logical function is_oriented(self)
      class(offer_t), intent(in) :: self
      is_oriented = .false.
   end function is_oriented

   !> True of an effect whose group says that it is not to be there.
   pure logical function declined(self)
      class(offer_t), intent(in) :: self
      declined = .false.
   end function declined

   !> A box that what is offered takes out of the body around it.
   pure subroutine hollow(self, lower, upper, there_is)
      class(offer_t), intent(in) :: self
      real(wp), intent(out) :: lower(3), upper(3) !< m
      logical, intent(out) :: there_is
      there_is = .false.
      lower = 0.0_wp
      upper = 0.0_wp
   end subroutine hollow

   !> Become what it is in a scene that is given by a section. `why`: it cannot, as the end of a sentence
   !> about it; empty: it can. A law of a material without directions is the same in any.
   subroutine take_section(self, section, why)
      class(offer_t), intent(inout) :: self
      type(section_t), intent(in) :: section
      character(len=:), allocatable, intent(out) :: why
      why = ''
      if (self%is_oriented()) why = 'has directions of its own; allowed in 3D, or a law without them'
   end subroutine take_section

   !> Append an offer under a name (lower case).
   subroutine offer(slots, name, it)
      type(offer_slot_t), allocatable, intent(inout) :: slots(:)
      character(len=*), intent(in) :: name
      class(offer_t), intent(in) :: it
      type(offer_slot_t), allocatable :: longer(:)
      integer :: s, n
      n = 0
      if (allocated(slots)) n = size(slots)
      allocate (longer(n + 1))
      do s = 1, n
         call move_alloc(slots(s)%it, longer(s)%it)
      end do
      allocate (longer(n + 1)%it, source=it)
      longer(n + 1)%it%name = name
      call move_alloc(longer, slots)
   end subroutine offer

   !> The names, in order.
   function offered_names(slots) result(names)
      type(offer_slot_t), intent(in) :: slots(:)
      character(len=name_length) :: names(size(slots))
      integer :: s
      do s = 1, size(slots)
         names(s) = slots(s)%it%name
      end do
   end function offered_names

   !> Index of the offer with a name, 0 if there is none.
   integer function offered(slots, name) result(found)
      type(offer_slot_t), intent(in) :: slots(:)
      character(len=*), intent(in) :: name
      do found = size(slots), 1, -1
         if (slots(found)%it%name == name) return
      end do
   end function offered

   !> Variables of the offers that were not chosen are known, but may not be used.
   subroutine know_others(group, offers, chosen)
      type(group_reader_t), intent(inout) :: group
      type(offer_slot_t), intent(in) :: offers(:)
      integer, intent(in) :: chosen !< 0: an unknown one, which is the fault then, not what comes with it
      class(offer_t), allocatable :: other
      integer :: n
      do n = 1, size(offers)
         if (n == chosen) cycle
         allocate (other, source=offers(n)%it)
         call group%others(set_aside=chosen > 0, name=other%name)
         call other%variables(group)
         call group%others(set_aside=.false.)
         deallocate (other)
      end do
   end subroutine know_others

end module m_offer
