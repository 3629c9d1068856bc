!> Contact groups: bodies of one group are bonded where they touch, bodies of two meet in contact. The groups
!> of a scene's bodies, and what &body_contact may say.
module m_contact_groups
   use m_kinds, only: wp
   use m_group_reader, only: group_reader_t, name_length
   use m_scene, only: scene_t, body_contact_spec_t
   use m_scene_words, only: start_words
   use m_value_range, only: at_least
   use m_words, only: lower_case
   implicit none
   private
   public :: number_groups, describe_body_contact

   real(wp), parameter :: largest_friction = 10.0_wp

contains

   !> Number the groups in the order in which bodies name them, capitals not counted.
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

   !> What holds between bodies of two groups, or of all.
   subroutine describe_body_contact(group, scene, contact)
      type(group_reader_t), intent(inout) :: group
      type(scene_t), intent(in) :: scene
      type(body_contact_spec_t), intent(inout) :: contact
      character(len=name_length), allocatable :: names(:)
      integer :: groups(2)
      allocate (names(0))
      if (allocated(scene%contact_groups)) names = pack(scene%contact_groups, scene%contact_groups /= '')
      if (size(names) == 0 .and. group%is_given('groups')) then
         call group%refuse('groups', 'no &body has a contact_group')
      else if (any(contact%groups > 0) .or. .not. group%is_writing()) then
         groups = 0
         if (group%is_writing()) groups = [findloc(names == scene%contact_groups(contact%groups(1)), .true., &
            dim=1), findloc(names == scene%contact_groups(contact%groups(2)), .true., dim=1)]
         call group%get_choices('groups', groups, names)
         if (all(groups > 0) .and. .not. group%is_writing()) then
            contact%groups = [findloc(scene%contact_groups == names(groups(1)), .true., dim=1), &
                              findloc(scene%contact_groups == names(groups(2)), .true., dim=1)]
            if (groups(1) == groups(2)) call group%refuse('groups', 'must be two different groups: bodies of one are bonded')
         end if
      end if
      if (.not. group%is_writing() .and. size(scene%bodies) > 0) then
         if (scene%fields() < 2) call group%refuse('groups', &
            'all bodies are of one contact group: nothing is in contact; allowed where bodies have different contact_group')
      end if
      call group%get('friction', contact%friction, at_least(0.0_wp, '', at_most=largest_friction))
      call group%get_choice('start', contact%start, start_words)
   end subroutine describe_body_contact

end module m_contact_groups
