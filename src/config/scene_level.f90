!> &level: the boxes and balls that levels are made of, and their motion.
module m_scene_level
   use m_kinds, only: wp
   use m_group_reader, only: group_reader_t, name_length
   use m_scene, only: scene_t, level_spec_t, level_box, level_sphere, criterion_none, criterion_error, &
                      min_cells
   use m_scene_words, only: level_shape_words, criterion_words
   use m_value_range, only: above, at_least, any_value
   implicit none
   private
   public :: describe_level

contains

   !> The box or sphere of a level and what it moves with, if anything.
   subroutine describe_level(group, scene, level)
      type(group_reader_t), intent(inout) :: group
      type(scene_t), intent(in) :: scene
      type(level_spec_t), intent(inout) :: level
      character(len=name_length), allocatable :: leaders(:)
      integer :: choice
      leaders = scene%leaders()
      call group%get('of', level%of, least=1)
      call group%get_choice('shape', level%shape, level_shape_words)
      call describe_form(group, level)
      if (group%is_given('follow') .and. size(leaders) == 0) &
         call group%refuse('follow', 'the scene has neither a &tool nor two contact groups, of which a '// &
                           'level could follow one')
      if (level%follow > 0 .or. .not. group%is_writing()) &
         call group%get_choice('follow', level%follow, leaders)
      if (level%shape == level_sphere .and. level%follow > 0 .and. group%is_reading() &
          .and. .not. group%is_given('center')) then
         if (level%follow > size(scene%tools)) then
            call group%refuse('follow', 'needs a center, because it names no &tool')
         else
            level%center = scene%tools(level%follow)%tip
         end if
      end if
      choice = level%criterion + 1
      call group%get_choice('criterion', choice, criterion_words)
      level%criterion = max(choice, 1) - 1
      if (level%follow > 0 .and. level%criterion /= criterion_none) &
         call group%refuse('criterion', 'not together with follow; a level is moved by one of the two')
      call describe_place(group, scene, level)
      if (level%criterion == criterion_none .and. group%is_writing()) return
      call group%get('max_cells', level%max_cells, least=min_cells)
      if (level%criterion == criterion_none .and. group%is_given('max_cells')) &
         call group%refuse('max_cells', 'only with criterion=''stress'' or ''strain'' or ''error''')
      if (level%criterion /= criterion_error .and. group%is_writing()) return
      call group%get('tolerance', level%tolerance, above(0.0_wp, ''))
      if (level%criterion /= criterion_error .and. group%is_given('tolerance')) &
         call group%refuse('tolerance', 'only with criterion=''error''')
      if (group%is_writing() .and. .not. level%max_memory > 0.0_wp) return
      call group%get('max_memory', level%max_memory, above(0.0_wp, 'bytes'))
      if (level%criterion /= criterion_error .and. group%is_given('max_memory')) &
         call group%refuse('max_memory', 'only with criterion=''error''')
   end subroutine describe_level

   !> A box is required, except where the error places cells: then the level may start around tools and
   !> contact groups.
   subroutine describe_place(group, scene, level)
      type(group_reader_t), intent(inout) :: group
      type(scene_t), intent(in) :: scene
      type(level_spec_t), intent(inout) :: level
      if (group%is_writing()) return
      level%has_box = group%is_given('lower') .and. group%is_given('upper')
      if (level%has_box .or. level%shape /= level_box) return
      if (level%criterion == criterion_error .and. size(scene%leaders()) > 0 .and. &
          .not. (group%is_given('lower') .or. group%is_given('upper'))) return
      call group%refuse(trim(merge('upper', 'lower', group%is_given('lower'))), &
                        'missing; must be 3 numbers in m')
   end subroutine describe_place

   !> The position and size of a level's box or ball.
   subroutine describe_form(group, level)
      type(group_reader_t), intent(inout) :: group
      type(level_spec_t), intent(inout) :: level
      logical :: ball
      ball = level%shape == level_sphere
      if (.not. ((ball .or. .not. level%has_box) .and. group%is_writing())) then
         call group%get('lower', level%lower, any_value('m'), &
                        required=.not. (ball .or. group%is_given('criterion')))
         call group%get('upper', level%upper, any_value('m'), &
                        required=.not. (ball .or. group%is_given('criterion')))
      end if
      if (ball .or. .not. group%is_writing()) then
         call group%get('center', level%center, any_value('m'), required=ball .and. &
                        .not. group%is_given('follow'))
         call group%get('radius', level%radius, above(0.0_wp, 'm'), required=ball)
         call group%get('inner_radius', level%inner_radius, at_least(0.0_wp, 'm'))
      end if
      call keep_to('lower', level_sphere)
      call keep_to('upper', level_sphere)
      call keep_to('center', level_box)
      call keep_to('radius', level_box)
      call keep_to('inner_radius', level_box)
      if (ball .and. level%inner_radius >= level%radius) &
         call group%refuse('inner_radius', 'must be below radius')
   contains
      !> Refuse variables that do not belong to a shape.
      subroutine keep_to(name, shape)
         character(len=*), intent(in) :: name
         integer, intent(in) :: shape
         if (level%shape == shape .and. group%is_given(name)) &
            call group%refuse(name, "not with shape='"//trim(level_shape_words(shape))//"'")
      end subroutine keep_to
   end subroutine describe_form

end module m_scene_level
