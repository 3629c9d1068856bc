!> Named options of a scene: a material law (`model='...'` of &material) or an effect (a group of its own).
module m_offer
   use m_kinds, only: wp
   use m_text, only: to_text
   use m_group_reader, only: group_reader_t, name_length
   use m_section, only: section_t
   implicit none
   private
   public :: offer, offered_names, offered, know_others

   !> Something with a name and variables of its own: the parent type of laws and effects.
   type, abstract, public :: offer_t
      character(len=:), allocatable :: name
      logical :: repeats = .false. !< a scene may have several groups of this effect
      integer :: line = 0          !< of the scene, where its group begins; 0: not read
   contains
      procedure :: group_text
      procedure :: for_large_strains
      procedure :: default_effect
      procedure :: is_oriented
      procedure :: declined
      procedure :: take_section
      procedure :: against_section
      procedure :: hollow
      procedure(variables_interface), deferred :: variables
   end type offer_t

   !> Holder for offers of different types.
   type, public :: offer_slot_t
      class(offer_t), allocatable :: it
   end type offer_slot_t

   !> All offers. These are prototypes: a scene gets a copy with its own values.
   type, public :: catalogue_t
      type(offer_slot_t), allocatable :: models(:)  !< material laws
      type(offer_slot_t), allocatable :: effects(:) !< optional groups
      character(len=name_length), allocatable :: formats(:) !< of snapshots, the default first
   end type catalogue_t

   abstract interface
      !> Look up each variable once, in the order of the documentation. The same procedure reads a group,
      !> lists the names that it knows, and writes case.nml (then `group` takes the values): the values on
      !> entry are the defaults.
      subroutine variables_interface(self, group)
         import :: offer_t, group_reader_t
         class(offer_t), intent(inout) :: self
         type(group_reader_t), intent(inout) :: group
      end subroutine variables_interface
   end interface

contains

   !> Beginning of a message about its group: `line 7, &name`.
   pure function group_text(self) result(text)
      class(offer_t), intent(in) :: self
      character(len=:), allocatable :: text
      text = '&'//self%name
      if (self%line > 0) text = 'line '//to_text(self%line)//', '//text
   end function group_text

   !> True for a law for large strains: domains of particles follow the deformation by default.
   pure logical function for_large_strains(self)
      class(offer_t), intent(in) :: self
      for_large_strains = .false.
   end function for_large_strains

   !> The effect that is on by default for this law; empty: none.
   pure function default_effect(self) result(name)
      class(offer_t), intent(in) :: self
      character(len=:), allocatable :: name
      name = ''
   end function default_effect

   !> True for a law with material axes, set by a body's `orientation`.
   pure logical function is_oriented(self)
      class(offer_t), intent(in) :: self
      is_oriented = .false.
   end function is_oriented

   !> True for an effect that its group turns off.
   pure logical function declined(self)
      class(offer_t), intent(in) :: self
      declined = .false.
   end function declined

   !> A box that the offer removes from the body around it.
   pure subroutine hollow(self, lower, upper, there_is)
      class(offer_t), intent(in) :: self
      real(wp), intent(out) :: lower(3), upper(3) !< m
      logical, intent(out) :: there_is
      there_is = .false.
      lower = 0.0_wp
      upper = 0.0_wp
   end subroutine hollow

   !> Convert to the section of a scene given by one. `why`: the reason if that is impossible, as the end of a
   !> message; empty: converted. The law of an isotropic material is the same in any section.
   subroutine take_section(self, section, why)
      class(offer_t), intent(inout) :: self
      type(section_t), intent(in) :: section
      character(len=:), allocatable, intent(out) :: why
      why = ''
      if (self%is_oriented()) why = 'has directions of its own; allowed in 3D, or a law without them'
   end subroutine take_section

   !> Why what a scene in three dimensions asks for is not that of its section; empty where it is.
   pure function against_section(self, lower, upper, is_round) result(why)
      class(offer_t), intent(in) :: self
      real(wp), intent(in) :: lower(3), upper(3) !< of the grid, m
      logical, intent(in) :: is_round            !< the section is of a body of revolution
      character(len=:), allocatable :: why
      why = ''
   end function against_section

   !> Append an offer with a name (lower case).
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

   !> Register the variables of the offers that were not chosen: known, but not to be used.
   subroutine know_others(group, offers, chosen)
      type(group_reader_t), intent(inout) :: group
      type(offer_slot_t), intent(in) :: offers(:)
      integer, intent(in) :: chosen !< 0: unknown, which is the error to report, not its consequences
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
