!> &quasi_static: its variables, and checks of a scene with it.
module m_scene_static
   use m_kinds, only: wp
   use m_constants, only: exit_input
   use m_errors, only: error_t, fail
   use m_group_reader, only: group_reader_t
   use m_namelist_text, only: namelist_text_t
   use m_scene, only: scene_t, quasi_static_spec_t, update_usl, criterion_none, preconditioner_gamg
   use m_scene_words, only: static_mode_words, preconditioner_words
   use m_value_range, only: above, at_least
   use m_words, only: joined
   implicit none
   private
   public :: describe_quasi_static, check_quasi_static, brings_in_statics

   !> Laws whose update from the beginning of a step is valid for any step length, and effects that are only
   !> forces or means over cells.
   character(len=*), parameter :: laws(6) = [character(len=11) :: 'elastic', 'neo_hookean', 'j2', 'norton', &
                                             'maxwell', 'umat']
   character(len=*), parameter :: effects(3) = [character(len=12) :: 'gravity', 'pressure', 'anti_locking']
   real(wp), parameter :: min_tolerance = 1.0e-12_wp, largest_tolerance = 1.0e-2_wp
   character(len=*), parameter :: no_inertia = ': not with &quasi_static from the start, which has no '// &
                                  'inertia; leave it out, or take mode=''newmark'' or a later from'

contains

   subroutine describe_quasi_static(group, spec)
      type(group_reader_t), intent(inout) :: group
      type(quasi_static_spec_t), intent(inout) :: spec
      call group%get_choice('mode', spec%mode, static_mode_words)
      call group%get('step', spec%step, above(0.0_wp, 's'), required=.true.)
      call group%get('max_step', spec%max_step, at_least(0.0_wp, 's'))
      call group%get('from', spec%from, at_least(0.0_wp, 's'))
      if (group%is_given('to') .or. spec%to < huge(1.0_wp) .or. .not. group%is_writing()) &
         call group%get('to', spec%to, above(0.0_wp, 's'))
      if (spec%to <= spec%from) call group%refuse('to', 'must be above from')
      call group%get('ramp', spec%ramp, at_least(0.0_wp, 's'))
      call group%get('tolerance', spec%tolerance, at_least(min_tolerance, '', at_most=largest_tolerance))
      call group%get('creep_limit', spec%creep_limit, above(0.0_wp, '', at_most=0.5_wp))
      call group%get('stabilisation', spec%stabilisation, at_least(0.0_wp, '', at_most=1.0_wp))
      call group%get('iterations', spec%iterations)
      call group%get_choice('preconditioner', spec%preconditioner, preconditioner_words)
      if (group%is_given('theta') .and. .not. spec%has_inertia()) &
         call group%refuse('theta', 'is for mode=''newmark''; leave it out')
      if (spec%has_inertia() .or. .not. group%is_writing()) &
         call group%get('theta', spec%theta, at_least(0.5_wp, '', at_most=1.0_wp))
      if (spec%has_inertia() .and. spec%ramp > 0.0_wp) &
         call group%refuse('ramp', 'not with mode=''newmark'', whose loads follow their own times')
      if (spec%max_step > 0.0_wp .and. spec%max_step < spec%step) &
         call group%refuse('max_step', 'must not be below step; 0 for no limit')
   end subroutine describe_quasi_static

   !> True for an effect that is on by default for a law, also in quasi-static steps.
   pure logical function brings_in_statics(name, spec)
      character(len=*), intent(in) :: name
      type(quasi_static_spec_t), intent(in) :: spec
      brings_in_statics = any(effects == name) .and. &
                          .not. (name == 'anti_locking' .and. spec%preconditioner == preconditioner_gamg)
   end function brings_in_statics

   !> Refuse what quasi-static steps do not support.
   subroutine check_quasi_static(text, scene, error)
      type(namelist_text_t), intent(in) :: text
      type(scene_t), intent(in) :: scene
      type(error_t), intent(inout) :: error
      integer :: i
      if (.not. scene%quasi_static%present) return
      do i = 1, size(scene%materials)
         if (.not. any(laws == scene%materials(i)%law%name)) &
            call fail(error, exit_input, text%place('material', i, 'model')//': not supported with '// &
               '&quasi_static, whose laws are '//joined(laws)//'; use one of these, or the explicit scheme')
      end do
      do i = 1, size(scene%effects)
         associate (it => scene%effects(i)%it)
            if (.not. any(effects == it%name)) &
               call fail(error, exit_input, it%group_text()//': not supported with &quasi_static, whose '// &
                         'effects are '//joined(effects)//'; leave it out, or use the explicit scheme')
            if (it%name == 'anti_locking' .and. .not. it%declined() &
                .and. scene%quasi_static%preconditioner == preconditioner_gamg) &
               call fail(error, exit_input, it%group_text()//': not with preconditioner=''gamg'' of '// &
                         '&quasi_static, which stagnates in plastic flow with it; use bpx, or leave '// &
                         'it out')
         end associate
      end do
      i = findloc(scene%levels%criterion /= criterion_none, .true., dim=1)
      if (i > 0) &
         call fail(error, exit_input, text%place('level', i, 'criterion')//': not supported with '// &
            '&quasi_static, whose levels stay or follow; give the level a box or a sphere, or use the '// &
                   'explicit scheme')
      if (scene%quasi_static%preconditioner == preconditioner_gamg .and. size(scene%levels) > 0) &
         call fail(error, exit_input, text%place('quasi_static', 1, 'preconditioner')//': gamg does not '// &
                   'support &level, because its elements are those of one grid; use bpx')
      if (scene%fields() > 1) call check_groups(text, scene, error)
      if (scene%time%stress_update /= update_usl) &
         call fail(error, exit_input, text%place('time', 1, 'stress_update')//': with &quasi_static only '// &
                   '''usl'' is allowed')
      if (scene%time%time_step > 0.0_wp) &
         call fail(error, exit_input, text%place('time', 1, 'time_step')//': not supported with '// &
            '&quasi_static, whose own step is used; leave it out')
      if (scene%quasi_static%has_inertia()) call check_inertia(text, scene, error)
      call check_times(text, scene, error)
   end subroutine check_quasi_static

   !> Times are within the run; no initial speed of bodies without inertia.
   subroutine check_times(text, scene, error)
      type(namelist_text_t), intent(in) :: text
      type(scene_t), intent(in) :: scene
      type(error_t), intent(inout) :: error
      integer :: i
      associate (spec => scene%quasi_static)
         if (spec%from >= scene%end_time) &
            call fail(error, exit_input, text%place('quasi_static', 1, 'from')//': must be below end_time')
         if (spec%has_inertia() .or. spec%from > 0.0_wp) return
      end associate
      do i = 1, size(scene%bodies)
         if (norm2(scene%bodies(i)%velocity) > 0.0_wp) &
            call fail(error, exit_input, text%place('body', i, 'velocity')//no_inertia)
         if (norm2(scene%bodies(i)%angular_velocity) > 0.0_wp) &
            call fail(error, exit_input, text%place('body', i, 'angular_velocity')//no_inertia)
      end do
   end subroutine check_times

   !> Between contact groups only pressure and friction are supported, without inertia.
   subroutine check_groups(text, scene, error)
      type(namelist_text_t), intent(in) :: text
      type(scene_t), intent(in) :: scene
      type(error_t), intent(inout) :: error
      integer :: i
      if (scene%quasi_static%has_inertia()) &
         call fail(error, exit_input, text%place('quasi_static', 1, 'mode')//': newmark does not support '// &
            'more than one contact_group; leave contact_group out, so that bodies are bonded where '// &
                   'they touch, or use the explicit scheme')
      if (scene%quasi_static%preconditioner == preconditioner_gamg) &
         call fail(error, exit_input, text%place('quasi_static', 1, 'preconditioner')//': gamg does not '// &
                   'support several contact groups, because its elements are those of one body; use bpx')
      if (.not. allocated(scene%body_contacts)) return
      do i = 1, size(scene%body_contacts)
         associate (it => scene%body_contacts(i))
            if (it%adhesion > 0.0_wp) call fail(error, exit_input, &
               text%place('body_contact', i, 'adhesion')//': not supported with &quasi_static, '// &
               'whose contact has pressure and friction only; leave it out, or use the explicit scheme')
            if (it%bond_strength > 0.0_wp) call fail(error, exit_input, &
               text%place('body_contact', i, 'bond_strength')//': not supported with '// &
               '&quasi_static, whose contact has pressure and friction only; leave contact_group out, so '// &
               'that bodies are bonded where '// &
               'they touch, or use the explicit scheme')
         end associate
      end do
   end subroutine check_groups

   !> Load-driven tools have no mass in implicit steps.
   subroutine check_inertia(text, scene, error)
      type(namelist_text_t), intent(in) :: text
      type(scene_t), intent(in) :: scene
      type(error_t), intent(inout) :: error
      integer :: i
      do i = 1, size(scene%tools)
         if (pushed(i)) &
            call fail(error, exit_input, text%line_of('tool', i)//', &tool: loads are not supported with '// &
               'mode=''newmark'' of &quasi_static, whose tools have no mass; give speeds, or use the '// &
                      'explicit scheme')
      end do
   contains
      pure logical function pushed(i)
         integer, intent(in) :: i
         integer :: k
         pushed = allocated(scene%tools(i)%loads)
         if (pushed .or. .not. allocated(scene%tools(i)%motions)) return
         do k = 1, size(scene%tools(i)%motions)
            pushed = pushed .or. allocated(scene%tools(i)%motions(k)%loads)
         end do
      end function pushed
   end subroutine check_inertia

end module m_scene_static
