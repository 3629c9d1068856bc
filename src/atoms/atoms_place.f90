!> Where a box of atoms may be: the body around it, and what the scene must not have beside it.
module m_atoms_place
   use m_kinds, only: wp
   use m_constants, only: exit_input
   use m_errors, only: error_t, fail
   use m_atoms, only: atoms_t
   use m_box, only: box_t
   use m_carved, only: uncarve
   use m_domain_kinds, only: domain_corners
   use m_pressure, only: pressure_t
   use m_scene, only: scene_t, update_usl
   use m_shape, only: shape_t
   use m_text, only: si, to_text
   implicit none
   private
   public :: refuse_others, find_host, check_box, particle_width

   real(wp), parameter :: whole = 1.0e-6_wp   !< of a constant: edges of the box are whole numbers of it

contains

   !> What does not go with atoms yet.
   subroutine refuse_others(spec, scene, error)
      type(atoms_t), intent(in) :: spec
      type(scene_t), intent(in) :: scene
      type(error_t), intent(inout) :: error
      character(len=:), allocatable :: what
      integer :: e
      what = ''
      do e = 1, size(scene%effects)
         select type (other => scene%effects(e)%it)
         type is (pressure_t)
            if (all(other%lower <= spec%upper .and. other%upper >= spec%lower)) &
               what = 'a &pressure on the box'
         end select
      end do
      if (scene%fields() > 1) what = 'several contact groups'
      if (scene%time%stress_update /= update_usl) what = 'a stress_update other than ''usl'''
      if (scene%time%domain /= domain_corners) what = 'a domain other than ''corners'''
      if (what /= '') &
         call fail(error, exit_input, spec%group_text()//': not with '//what//' yet; leave it out')
   end subroutine refuse_others

   !> The body in which the box is, as it is without the box; and the box within it.
   subroutine find_host(spec, scene, host, body, lower, upper, error)
      type(atoms_t), intent(in) :: spec
      type(scene_t), intent(in) :: scene
      integer, intent(out) :: host
      class(shape_t), allocatable, intent(out) :: body
      real(wp), intent(out) :: lower(3), upper(3)
      type(error_t), intent(inout) :: error
      real(wp) :: low(3), high(3)
      integer :: b
      host = 0
      do b = 1, size(scene%bodies)
         call scene%bodies(b)%shape%bounding_box(low, high)
         if (any(spec%lower >= high) .or. any(spec%upper <= low)) cycle
         if (host > 0) call fail(error, exit_input, spec%group_text()//': the box overlaps several '// &
                                 'bodies; allowed: one')
         host = b
         lower = max(spec%lower, low)
         upper = min(spec%upper, high)
      end do
      if (host == 0) call fail(error, exit_input, spec%group_text()//': the box lies outside all bodies')
      if (error%happened()) return
      allocate (body, source=scene%bodies(host)%shape)
      call uncarve(body)
      select type (body)
      type is (box_t)
         continue
      class default
         call fail(error, exit_input, spec%group_text()//': the body around it must be of shape=''box'' yet')
      end select
      if (any(abs(scene%bodies(host)%turned_axes() - [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]) > 1.0e-12_wp)) &
         call fail(error, exit_input, spec%group_text()// &
                   ': the body around it must have orientation=0,0,0 yet')
      if (any(abs(scene%bodies(host)%angular_velocity) > 0.0_wp) &
          .or. any(abs(scene%bodies(host)%stress) > 0.0_wp)) &
         call fail(error, exit_input, spec%group_text()//': the body around it must have neither stress '// &
                   'nor angular_velocity at the start')
   end subroutine find_host

   !> Of the particles of a body on the finest level, m.
   pure real(wp) function particle_width(scene, host) result(width)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: host
      width = scene%grid%cell_size/(2**size(scene%levels))/nint(scene%bodies(host)%particles_per_cell &
                                                                **(1.0_wp/3.0_wp))
   end function particle_width

   !> Edges of whole lattice constants, faces between particles, pads within the body.
   subroutine check_box(spec, scene, lower, upper, host, error)
      type(atoms_t), intent(in) :: spec
      type(scene_t), intent(in) :: scene
      real(wp), intent(in) :: lower(3), upper(3)
      integer, intent(in) :: host
      type(error_t), intent(inout) :: error
      real(wp) :: low(3), high(3), particle, pad, edge
      integer :: k
      call scene%bodies(host)%shape%bounding_box(low, high)
      particle = particle_width(scene, host)
      pad = spec%pad_width()
      associate (a => spec%crystal%constant)
         do k = 1, 3
            edge = (upper(k) - lower(k))/a
            if (abs(edge - anint(edge)) > whole*edge) &
               call fail(error, exit_input, spec%group_text()//': the edge along '//'xyz'(k:k)//' is '// &
                         to_text(edge, 9)//' constants of the lattice ('// &
                         to_text(a, 12)//' m); allowed: whole numbers, to a millionth')
            if (off_lattice(lower(k) - low(k)) .or. off_lattice(upper(k) - low(k))) &
               call fail(error, exit_input, spec%group_text()//': a face across '//'xyz'(k:k)//' does '// &
                         'not lie between particles, which are '//to_text(particle, 9)//' m wide; '// &
                         'allowed: whole numbers of them from the body''s lower corner')
            if ((lower(k) > low(k) .and. lower(k) - pad < low(k)) .or. &
                (upper(k) < high(k) .and. upper(k) + pad > high(k))) &
               call fail(error, exit_input, spec%group_text()//': the box must leave '//si(pad, 'm')// &
                         ' of the body around it, for pads, or reach out of it')
            if (error%happened()) return
         end do
      end associate
   contains
      pure logical function off_lattice(way)
         real(wp), intent(in) :: way
         off_lattice = abs(way/particle - anint(way/particle)) > 1.0e-6_wp*max(1.0_wp, way/particle)
      end function off_lattice
   end subroutine check_box

end module m_atoms_place
