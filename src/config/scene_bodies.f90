!> The variables of materials, bodies, cuts, tools and their motions. Each describe_* both reads and writes
!> its group, as in m_scene_groups.
module m_scene_bodies
   use m_kinds, only: wp
   use m_vectors, only: cross
   use m_group_reader, only: group_reader_t, name_length
   use m_friction_laws, only: describe_friction
   use m_offer, only: offer_slot_t, offered, offered_names, know_others
   use m_scene
   use m_scene_motion, only: read_tool_motion, describe_motion, find_motion
   use m_scene_words, only: fill_words
   use m_shape, only: shape_t
   use m_shape_variables, only: make_unit
   use m_shapes, only: known_shapes
   use m_value_range, only: above, at_least, any_value
   use m_words, only: lower_case
   implicit none
   private
   public :: describe_material, describe_body, describe_cut, describe_tool, describe_nth_motion

   real(wp), parameter :: largest_penetration_factor = 0.5_wp

contains

   !> Common variables of materials, then those of the law.
   subroutine describe_material(group, models, material)
      type(group_reader_t), intent(inout) :: group
      type(offer_slot_t), intent(in) :: models(:)
      type(material_spec_t), intent(inout) :: material
      integer :: model
      if (.not. allocated(material%name)) material%name = ''
      call group%get_name('name', material%name, required=.true.)
      model = 0
      if (allocated(material%law)) model = offered(models, material%law%name)
      call group%get_choice('model', model, offered_names(models), required=.true.)
      call group%get('density', material%density, above(0.0_wp, 'kg/m3'), required=.true.)
      if (model > 0) then
         if (.not. allocated(material%law)) allocate (material%law, source=models(model)%it)
         call material%law%variables(group)
      end if
      call know_others(group, models, model)
   end subroutine describe_material

   subroutine describe_body(group, material_names, materials, body)
      type(group_reader_t), intent(inout) :: group
      character(len=*), intent(in) :: material_names(:)
      type(material_spec_t), intent(in) :: materials(:)
      type(body_spec_t), intent(inout) :: body
      type(offer_slot_t), allocatable :: bodies(:), tools(:)
      integer :: choice
      call known_shapes(bodies, tools)
      call group%get_name('name', body%name)
      call group%get_choice('material', body%material, material_names, required=.true.)
      call describe_orientation(group, materials, body)
      call choose_shape(group, bodies, body%shape, choice)
      if (choice > 0) call body%shape%variables(group)
      call know_others(group, bodies, choice)
      call group%get_option('particles_per_cell', body%particles_per_cell, [1, 8, 27])
      call group%get('velocity', body%velocity, any_value('m/s'))
      call group%get('angular_velocity', body%angular_velocity, any_value('rad/s'))
      call group%get('stress', body%stress, any_value('Pa'))
      if (body%fill > 0 .or. .not. group%is_writing()) call group%get_choice('fill', body%fill, fill_words)
      if (.not. allocated(body%contact_group)) body%contact_group = ''
      if (body%contact_group /= '' .or. .not. group%is_writing()) &
         call group%get_name('contact_group', body%contact_group)
      if (lower_case(body%contact_group) == rest_group) &
         call group%refuse('contact_group', 'must not be '//rest_group// &
                           ', the group of bodies that name none')
   end subroutine describe_body

   !> `orientation` of a body whose material has axes.
   subroutine describe_orientation(group, materials, body)
      type(group_reader_t), intent(inout) :: group
      type(material_spec_t), intent(in) :: materials(:)
      type(body_spec_t), intent(inout) :: body
      real(wp), parameter :: square = 1.0e-4_wp
      real(wp) :: axes(3, 3), off(3, 3)
      logical :: has_axes
      integer :: k
      has_axes = body%material == 0 ! an unknown material is the error to report, not its consequences
      if (body%material > 0) then
         if (allocated(materials(body%material)%law)) has_axes = materials(body%material)%law%is_oriented()
      end if
      call group%get_list('orientation', body%orientation, any_value(''), used=has_axes)
      if (.not. allocated(body%orientation)) then
         if (has_axes .and. body%material > 0) body%orientation = [0.0_wp, 0.0_wp, 0.0_wp]
      else if (size(body%orientation) == 9) then
         axes = reshape(body%orientation, [3, 3])
         off = matmul(transpose(axes), axes)
         do k = 1, 3
            off(k, k) = off(k, k) - 1.0_wp
         end do
         if (maxval(abs(off)) > square &
             .or. .not. dot_product(cross(axes(:, 1), axes(:, 2)), axes(:, 3)) > 0.0_wp) &
            call group%refuse('orientation', 'nine numbers must be three axes, of length 1, '// &
                              'at right angles (within 1e-4) and right-handed')
      else if (size(body%orientation) /= 3) then
         call group%refuse('orientation', 'must be three angles in degrees, '// &
                           'or the nine components of three axes')
      end if
   end subroutine describe_orientation

   !> A shape that is subtracted from a body.
   subroutine describe_cut(group, bodies, cut)
      type(group_reader_t), intent(inout) :: group
      type(body_spec_t), intent(in) :: bodies(:)
      type(cut_spec_t), intent(inout) :: cut
      type(offer_slot_t), allocatable :: shapes(:), tools(:)
      character(len=name_length) :: body_names(size(bodies))
      integer :: choice, i
      do i = 1, size(bodies)
         body_names(i) = bodies(i)%name
      end do
      call known_shapes(shapes, tools)
      call group%get_choice('body', cut%body, body_names, required=.true.)
      call choose_shape(group, shapes, cut%shape, choice)
      if (choice > 0) call cut%shape%variables(group)
      call know_others(group, shapes, choice)
   end subroutine describe_cut

   subroutine describe_tool(group, may_stand, tool)
      type(group_reader_t), intent(inout) :: group
      logical, intent(in) :: may_stand !< it may have no motion of its own
      type(tool_spec_t), intent(inout) :: tool
      type(offer_slot_t), allocatable :: bodies(:), tools(:)
      integer :: choice
      call known_shapes(bodies, tools)
      call group%get_name('name', tool%name)
      call choose_shape(group, tools, tool%shape, choice)
      call group%get('tip', tool%tip, any_value('m'), required=.true.)
      call group%get('axis', tool%axis, any_value(''))
      call make_unit(group, tool%axis)
      if (choice > 0) then
         tool%shape%axis = tool%axis
         call tool%shape%variables(group)
      end if
      call know_others(group, tools, choice)
      call read_tool_motion(group, tool, may_stand)
      call group%get('penetration_factor', tool%penetration_factor, &
                     at_least(0.0_wp, '', at_most=largest_penetration_factor))
      call describe_friction(group, tool%friction)
   end subroutine describe_tool

   !> The number-th &motion; when read it is added to its tool.
   subroutine describe_nth_motion(group, number, tools)
      type(group_reader_t), intent(inout) :: group
      integer, intent(in) :: number
      type(tool_spec_t), intent(inout) :: tools(:)
      type(motion_spec_t) :: motion
      integer :: tool
      tool = 0
      if (group%is_writing()) call find_motion(tools, number, motion, tool)
      motion%number = number
      call describe_motion(group, tools, motion, tool)
      if (group%is_writing() .or. tool == 0) return
      if (.not. allocated(tools(tool)%motions)) allocate (tools(tool)%motions(0))
      tools(tool)%motions = [tools(tool)%motions, motion]
   end subroutine describe_nth_motion

   !> Choose one of the shapes; 0: unknown.
   subroutine choose_shape(group, shapes, shape, choice)
      type(group_reader_t), intent(inout) :: group
      type(offer_slot_t), intent(in) :: shapes(:)
      class(shape_t), allocatable, intent(inout) :: shape
      integer, intent(out) :: choice
      integer :: s
      choice = 0
      if (allocated(shape)) choice = findloc([(same_type_as(shapes(s)%it, shape), s=1, size(shapes))], &
                                             .true., dim=1)
      call group%get_choice('shape', choice, offered_names(shapes), required=.true.)
      if (choice == 0 .or. allocated(shape)) return
      select type (known => shapes(choice)%it)
      class is (shape_t)
         allocate (shape, source=known)
      end select
   end subroutine choose_shape

end module m_scene_bodies
