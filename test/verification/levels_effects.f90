!> Effects on nested levels: gravity in free fall, viscous damping, a pressure over an edge, PIC mixed in,
!> anti-locking and bulk viscosity.
!test: limit 120
program levels_effects
   use m_kinds, only: wp
   use m_constants, only: pi
   use m_errors, only: error_t
   use m_communicator, only: communicator_t
   use m_scene, only: scene_t
   use m_effect, only: effect_t
   use m_gravity, only: gravity_t
   use m_damping, only: damping_t
   use m_pressure, only: pressure_t
   use m_anti_locking, only: anti_locking_t
   use m_bulk_viscosity, only: bulk_viscosity_t
   use m_materials, only: material_of
   use m_model, only: model_t
   use m_energy, only: balance_t
   use m_assertions, only: assertions_t
   use m_test_effects, only: body_force_t, tile_force_t
   use m_nested
   implicit none
   integer, parameter :: local = 1, viscous = 2
   real(wp), parameter :: field(3) = [1.0_wp, -2.0_wp, -9.81_wp], begin_velocity(3) = [5.0_wp, 3.9_wp, 3.3_wp]
   type(communicator_t) :: comm
   type(assertions_t) :: test
   type(manner_t) :: manners(6)
   integer :: i
   call comm%start()
   call test%start(comm, 'levels_effects')
   manners = [manner_t(), manner_t(affine=.false.), manner_t(flip=0.98_wp), manner_t(subcycle=.false.), &
              manner_t(levels=3), manner_t(levels=1)]
   if (comm%is_root()) &
      print '(3x,a)', 'free fall through levels: velocity, place, stress, momentum, work, energy balance'
   do i = 1, size(manners)
      call free_fall(gravity_t(name='gravity', field=field), manners(i), 'gravity')
   end do
   call free_fall(body_force_t(name='body force', field=field), manners(1), 'body force')
   call free_fall(body_force_t(name='body force', field=field), manners(3), 'body force')
   call free_fall(tile_force_t(name='tile force', field=field), manners(1), 'force on tiles')
   if (comm%is_root()) &
      print '(3x,a)', 'ringing bar, damped: kinetic, strain, damped, excess over the energy of the start'
   call damped(damping_t(name='damping', kind=viscous, coefficient=20.0_wp), 'viscous')
   call damped(damping_t(name='damping', kind=local, coefficient=0.1_wp), 'local')
   call damped(bulk_viscosity_t(name='bulk'), 'bulk viscosity')
   call damped(anti_locking_t(name='anti'), 'anti-locking')
   if (comm%is_root()) print '(3x,a)', 'pressure on a patch over edges: momentum over p A t, less 1; sideways'
   do i = 1, size(manners)
      call pushed(manners(i))
   end do
   if (comm%is_root()) &
      print '(3x,a)', &
      'a spinning block across edges with effects: momentum, energy/start, damped/start, excess'
   call spun(bulk_viscosity_t(name='bulk'), manners(1), 'bulk viscosity')
   call spun(bulk_viscosity_t(name='bulk'), manners(6), 'bulk viscosity')
   call spun(anti_locking_t(name='anti'), manners(1), 'anti-locking')
   call spun(anti_locking_t(name='anti'), manners(2), 'anti-locking')
   call spun(anti_locking_t(name='anti'), manners(6), 'anti-locking')
   call test%finish()

contains

   subroutine set_effect(model, effect)
      type(model_t), intent(inout) :: model
      class(effect_t), intent(in) :: effect
      allocate (model%effects(1))
      allocate (model%effects(1)%effect, source=effect)
   end subroutine set_effect

   pure subroutine thrown(x, level, v, l, s)
      real(wp), intent(in) :: x(3)
      integer, intent(in) :: level
      real(wp), intent(out) :: v(3), l(3, 3), s(6)
      v = begin_velocity
      l = 0.0_wp
      s = 0.0_wp
   end subroutine thrown

   !> A block is thrown through the region: all particles, of whatever level, have v0 + g t; the block stays
   !> without stress.
   subroutine free_fall(effect, manner, name)
      class(effect_t), intent(in) :: effect
      type(manner_t), intent(in) :: manner
      character(len=*), intent(in) :: name
      type(scene_t) :: scene
      type(model_t) :: model
      type(error_t) :: error
      type(balance_t) :: balance
      real(wp) :: near
      real(wp), allocatable :: all(:, :)
      real(wp) :: velocity(3), off(6), mass, gained, time_step, center(3), way(3)
      integer :: steps, axis
      scene = empty_scene([24, 24, 20], manner)
      call add_box(scene, [3.1_wp, 3.0_wp, 6.2_wp], [6.1_wp, 6.0_wp, 9.2_wp], 8)
      if (manner%levels > 1) call add_level(scene, [8, 7, 6], [14, 13, 12])
      if (manner%levels > 2) call add_level(scene, [10, 9, 8], [12, 11, 10])
      call set_effect(model, effect)
      call model%build(comm, scene, error)
      call set_motion(model, thrown)
      call balance%begin(model)
      time_step = manner%step_of(0.4_wp)
      steps = nint(0.22_wp/time_step)
      call run_steps(model, steps, time_step, error)
      call test%check(.not. error%happened(), 'free fall: goes on')
      call balance%follow(model)
      all = all_particles(model)
      velocity = begin_velocity + field*steps*time_step
      mass = density*27*cell**3
      center = cell*[4.6_wp, 4.5_wp, 7.7_wp]
      way = begin_velocity*steps*time_step ! + g dt^2 n (n + 1)/2 on one level; other levels have other n and
                                           ! dt
      way = way + 0.5_wp*field*(steps*time_step)**2
      do axis = 1, 3
         off(axis) = abs(sum(all(axis, :)*all(at_mass, :))/mass - center(axis) - way(axis))
      end do
      off = [maxval(abs(all(4:6, :) - spread(velocity, 2, size(all, 2))))/norm2(velocity), &
             norm2(off(1:3))/norm2(way), maxval(abs(all(9:14, :)))/(young*norm2(velocity)/wave), &
             norm2(balance%now%momentum - mass*velocity)/(mass*norm2(velocity)), 0.0_wp, balance%error()]
      gained = 0.5_wp*mass*(sum(velocity**2) - sum(begin_velocity**2))
      off(5) = (balance%external_work - gained)/balance%now%kinetic
      if (comm%is_root()) print '(6x,a15,a40,6es9.1,i7,a)', name, manner%text(), off, size(all, 2), &
         ' particles'
      if (manner%levels > 1) &
         call test%check(comm%sum_count(model%splits) > 0, 'free fall: particles were split')
      ! all velocities are given for one time, but those of two levels stand at two: with subcycling a force
      ! that is there from the start moves them apart by a quarter of the coarse step's change (theory.md, eq.
      ! time-levels)
      near = merge(1.0e-3_wp, 1.0e-12_wp, manner%subcycle .and. manner%levels > 1)
      call test%check_close(off(1), 0.0_wp, near, 'free fall: velocity of every particle, '//name//', '// &
                            manner%text())
      call test%check(off(2) < 0.01_wp, 'free fall: way')
      call test%check_close(off(3), 0.0_wp, near, 'free fall: no stress, '//name//', '//manner%text())
      call test%check_close(off(4), 0.0_wp, 1.0e-13_wp, 'free fall: momentum, '//name//', '//manner%text())
      call test%check_close(off(5:6), [0.0_wp, 0.0_wp], near, 'free fall: work and balance, '//name//', '// &
                            manner%text())
      call model%release()
   end subroutine free_fall

   pure subroutine bar_state(x, level, v, l, s)
      real(wp), intent(in) :: x(3)
      integer, intent(in) :: level
      real(wp), intent(out) :: v(3), l(3, 3), s(6)
      real(wp), parameter :: k = pi/(24.0_wp*cell), speed = 0.005_wp*bar_wave
      v = [speed*cos(k*(x(1) - 4.0_wp*cell)), 0.0_wp, 0.0_wp]
      l = 0.0_wp
      l(1, 1) = -speed*k*sin(k*(x(1) - 4.0_wp*cell))
      s = 0.0_wp
   end subroutine bar_state

   !> The balance of energy closes with levels as it does without.
   subroutine damped(effect, name)
      class(effect_t), intent(in) :: effect
      character(len=*), intent(in) :: name
      type(manner_t) :: kinds(4)
      type(scene_t) :: scene
      type(model_t), allocatable :: model
      type(error_t) :: error
      type(balance_t) :: balance
      real(wp) :: uniform, taken, now(4)
      integer :: kind
      kinds = [manner_t(levels=1), manner_t(), manner_t(subcycle=.false.), manner_t(levels=3)]
      uniform = 0.0_wp
      taken = 0.0_wp
      do kind = 1, merge(4, 3, name == 'viscous') ! three levels once
         allocate (model)
         scene = ringing_bar(kinds(kind), 24)
         call set_effect(model, effect)
         call model%build(comm, scene, error)
         call set_motion(model, bar_state)
         balance = balance_t()
         call balance%begin(model)
         call run_steps(model, nint(223.0_wp*cell/wave/kinds(kind)%step_of(1.0_wp)), &
                        kinds(kind)%step_of(0.25_wp), error)
         call test%check(.not. error%happened(), 'damped: goes on, '//name)
         call balance%follow(model)
         now = [balance%now%kinetic, balance%now%strain, balance%damped, balance%excess()] &
               /balance%start%kinetic
         if (comm%is_root()) print '(6x,a15,a40,4f10.6)', name, kinds(kind)%text(), now
         if (kind == 1) uniform = now(4)
         if (kind == 1) taken = now(3)
         call test%check_close(now(4), uniform, 0.005_wp, 'damped: the balance closes as on one level, '// &
                               name)
         call test%check_close(now(3), taken, 0.02_wp, 'damped: as much as on one level, '//name)
         call model%release()
         deallocate (model)
      end do
   end subroutine damped

   !> So weak a pressure that nothing moves by more than round-off: momentum is p A t. The patch lies over all
   !> sides of the region that reach the face, and over corners.
   subroutine pushed(manner)
      type(manner_t), intent(in) :: manner
      real(wp), parameter :: pressure = 1.0e-8_wp, lower(3) = [5.33_wp, 6.0_wp, 14.0_wp]*cell, &
                             upper(3) = [12.9_wp, 11.17_wp, 14.0_wp]*cell
      integer, parameter :: steps = 40
      type(scene_t) :: scene
      type(model_t) :: model
      type(error_t) :: error
      type(balance_t) :: balance
      real(wp) :: exact
      scene = empty_scene([20, 20, 18], manner)
      call add_box(scene, [4.0_wp, 5.0_wp, 8.0_wp], [14.0_wp, 13.0_wp, 14.0_wp], 8)
      if (manner%levels > 1) call add_level(scene, [8, 7, 6], [16, 20, 18])
      if (manner%levels > 2) call add_level(scene, [10, 9, 12], [12, 11, 18])
      call set_effect(model, pressure_t(name='pressure', lower=lower, upper=upper, times=[0.0_wp], &
                                        values=[pressure]))
      call model%build(comm, scene, error)
      call balance%begin(model)
      call run_steps(model, steps, manner%step_of(0.4_wp), error)
      call test%check(.not. error%happened(), 'pressure: goes on')
      call balance%follow(model)
      exact = -pressure*(upper(1) - lower(1))*(upper(2) - lower(2))*steps*manner%step_of(0.4_wp)
      if (comm%is_root()) print '(6x,a40,2es9.1,a,es10.2)', manner%text(), balance%now%momentum(3)/exact &
         - 1.0_wp, norm2(balance%now%momentum(1:2))/abs(exact), ' balance', balance%error()
      call test%check_close(balance%now%momentum(3)/exact, 1.0_wp, 1.0e-12_wp, 'pressure: p A t, '// &
                            manner%text())
      call test%check_close(norm2(balance%now%momentum(1:2))/exact, 0.0_wp, 1.0e-12_wp, &
                            'pressure: not sideways, '//manner%text())
      call test%check(abs(balance%error()) < 0.05_wp, 'pressure: energy balance, '//manner%text())
      call model%release()
   end subroutine pushed

   pure subroutine spinning(x, level, v, l, s)
      real(wp), intent(in) :: x(3)
      integer, intent(in) :: level
      real(wp), intent(out) :: v(3), l(3, 3), s(6)
      real(wp), parameter :: w(3) = [4.0_wp, -9.0_wp, 12.0_wp], middle(3) = [7.5_wp, 7.0_wp, 6.5_wp]*cell
      real(wp) :: r(3)
      r = x - middle
      v = [4.0_wp, 3.1_wp, 2.7_wp] + [w(2)*r(3) - w(3)*r(2), w(3)*r(1) - w(1)*r(3), w(1)*r(2) - w(2)*r(1)]
      l = reshape([0.0_wp, w(3), -w(2), -w(3), 0.0_wp, w(1), w(2), -w(1), 0.0_wp], [3, 3])
      s = 0.0_wp
   end subroutine spinning

   subroutine spun(effect, manner, name)
      class(effect_t), intent(in) :: effect
      type(manner_t), intent(in) :: manner
      character(len=*), intent(in) :: name
      type(scene_t) :: scene
      type(model_t) :: model
      type(error_t) :: error
      type(balance_t) :: balance
      real(wp) :: off
      scene = empty_scene([20, 20, 18], manner)
      scene%materials(1) = material_of('soft', 'elastic', density, young, 0.45_wp)
      call add_box(scene, [5.0_wp, 5.0_wp, 4.0_wp], [10.0_wp, 9.0_wp, 9.0_wp], 8)
      if (manner%levels > 1) call add_level(scene, [8, 7, 6], [14, 13, 12])
      call set_effect(model, effect)
      call model%build(comm, scene, error)
      call set_motion(model, spinning)
      call balance%begin(model)
      call run_steps(model, 120, 0.6_wp*manner%step_of(0.4_wp), error) ! the wave is faster here
      call test%check(.not. error%happened(), 'spun: goes on')
      call balance%follow(model)
      off = norm2(balance%now%momentum - balance%start%momentum)/norm2(balance%start%momentum)
      if (comm%is_root()) print '(6x,a15,a40,es9.1,3f9.5)', name, manner%text(), off, &
         [balance%now%energy(), balance%damped, balance%excess()]/balance%start%energy()
      call test%check_close(off, 0.0_wp, 1.0e-12_wp, 'spun: momentum, '//name)
      call test%check(abs(balance%error()) < 0.03_wp, 'spun: energy balance, '//name)
      call model%release()
   end subroutine spun

end program levels_effects
