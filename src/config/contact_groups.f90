!> Contact groups: bodies of one group are bonded where they touch, those of two groups interact by contact.
!> The groups of a scene's bodies, and the variables of &body_contact.
module m_contact_groups
   use m_kinds, only: wp
   use m_group_reader, only: group_reader_t, name_length
   use m_scene, only: scene_t, body_contact_spec_t, start_as_is
   use m_friction_laws, only: describe_friction
   use m_scene_words, only: start_words
   use m_value_range, only: at_least
   use m_text, only: to_text
   use m_words, only: lower_case
   implicit none
   private
   public :: number_groups, describe_body_contact

contains

   !> Number the groups in the order in which bodies name them, ignoring case.
   subroutine number_groups(scene)
      type(scene_t), intent(inout) :: scene
      character(len=name_length) :: names(size(scene%bodies))
      integer :: b, count
      count = 0
      do b = 1, size(scene%bodies)
         associate (body => scene%bodies(b))
            if (.not. allocated(body%contact_group)) body%contact_group = ''
            body%field = findloc(names(:count) == lower_case(body%contact_group), .true., dim=1)
            if (body%field > 0) cycle
            count = count + 1
            names(count) = lower_case(body%contact_group)
            body%field = count
         end associate
      end do
      scene%contact_groups = names(:count)
   end subroutine number_groups

   !> Contact between bodies of two groups, or of all.
   subroutine describe_body_contact(group, scene, contact, number)
      type(group_reader_t), intent(inout) :: group
      type(scene_t), intent(in) :: scene
      type(body_contact_spec_t), intent(inout) :: contact
      integer, intent(in) :: number !< of the &body_contact
      character(len=name_length), allocatable :: names(:)
      integer :: g
      allocate (names(0))
      if (allocated(scene%contact_groups)) names = [character(len=name_length) :: &
                                                    (scene%group_label(g), g=1, size(scene%contact_groups))]
      if (size(names) < 2 .and. .not. group%is_writing()) call group%refuse('groups', &
         'all bodies are in one contact group, so there is no contact; '// &
         'allowed where bodies have different contact_group')
      if (any(contact%groups > 0) .or. .not. group%is_writing()) &
         call group%get_choices('groups', contact%groups, names)
      if (contact%groups(1) > 0 .and. contact%groups(1) == contact%groups(2)) &
         call group%refuse('groups', 'must be two different groups: bodies of one group are bonded')
      if (group%is_reading()) call check_given_once(group, scene, contact, number)
      call describe_friction(group, contact%friction)
      call group%get('adhesion', contact%adhesion, at_least(0.0_wp, 'J/m2'))
      call group%get('cohesive_range', contact%cohesive_range, at_least(0.0_wp, 'm'))
      call group%get('bond_strength', contact%bond_strength, at_least(0.0_wp, 'Pa'))
      call group%get_choice('start', contact%start, start_words)
      call group%get('press_fit', contact%press_fit, at_least(0.0_wp, 's'))
      call check_adhesion(group, contact)
   end subroutine describe_body_contact

   !> Check that no other &body_contact is for the same two groups, in either order, or for all.
   subroutine check_given_once(group, scene, contact, number)
      type(group_reader_t), intent(inout) :: group
      type(scene_t), intent(in) :: scene
      type(body_contact_spec_t), intent(in) :: contact
      integer, intent(in) :: number
      integer :: n
      do n = 1, number - 1
         associate (before => scene%body_contacts(n)%groups)
            if (.not. (all(before == contact%groups) .or. all(before == contact%groups([2, 1])))) cycle
            call group%refuse('groups', 'the pair was given before (&body_contact number '// &
                              to_text(n)//'); allowed: once')
            return
         end associate
      end do
   end subroutine check_given_once

   !> A law of adhesion needs two numbers.
   subroutine check_adhesion(group, contact)
      type(group_reader_t), intent(inout) :: group
      type(body_contact_spec_t), intent(in) :: contact
      if (contact%bond_strength > 0.0_wp) then
         if (.not. contact%adhesion > 0.0_wp) &
            call group%refuse('bond_strength', &
                              'needs adhesion, the work per area that breaks the bond, in J/m2')
         if (contact%cohesive_range > 0.0_wp) &
            call group%refuse('cohesive_range', &
                              'not together with bond_strength: a bond opens by 2 adhesion/bond_strength')
      else if ((contact%adhesion > 0.0_wp) .neqv. (contact%cohesive_range > 0.0_wp)) then
         call group%refuse(trim(merge('cohesive_range', 'adhesion      ', contact%adhesion > 0.0_wp)), &
                           'adhesion (J/m2) and cohesive_range (m) must both be given')
      end if
      if (contact%press_fit > 0.0_wp .and. contact%start /= start_as_is) &
         call group%refuse('press_fit', &
            'only with start=''as_is'': without an initial interference there is nothing to ramp down')
   end subroutine check_adhesion

end module m_contact_groups
