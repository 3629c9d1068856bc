!> Levels whose region is no box, an L and a ball of cells: what must be exact is. Constant velocity and
!> constant stress through their edges, mass and momentum of a block that spins and flies through them; also
!> with means over cells, which are joined at the edges.
!test: ranks 1 2
!test: long
!test: limit 120
program any_region
   use m_kinds, only: wp
   use m_errors, only: error_t
   use m_communicator, only: communicator_t
   use m_scene, only: scene_t
   use m_side_kinds, only: boundary_symmetry
   use m_region, only: make_region
   use m_model, only: model_t
   use m_move_regions, only: settle_particles
   use m_energy, only: sums_t, measure
   use m_anti_locking, only: anti_locking_t
   use m_assertions, only: assertions_t
   use m_chance, only: keep_worst
   use m_nested
   implicit none
   real(wp), parameter :: flight(3) = [7.0_wp, 4.1_wp, 0.7_wp]                         !< m/s
   real(wp), parameter :: pressure(6) = 1.0e4_wp*[1.0_wp, -0.4_wp, 0.7_wp, 0.0_wp, 0.0_wp, 0.0_wp] !< Pa
   type(communicator_t) :: comm
   type(assertions_t) :: test
   type(manner_t) :: manners(3)
   character(len=4), parameter :: forms(2) = ['L   ', 'ball']
   logical :: locks_not = .false. !< with anti-locking
   integer :: f, i
   call comm%start()
   call test%start(comm, 'any_region')
   manners = [manner_t(), manner_t(affine=.false., flip=0.98_wp), manner_t(subcycle=.false.)]
   do f = 1, size(forms)
      do i = 1, size(manners)
         call at_rest(trim(forms(f)), manners(i))
         call in_flight(trim(forms(f)), manners(i), even, 'straight on')
         call in_flight(trim(forms(f)), manners(i), spinning, 'spinning')
      end do
      locks_not = .true.
      call at_rest(trim(forms(f)), manner_t())
      call in_flight(trim(forms(f)), manner_t(), even, 'straight on')
      call in_flight(trim(forms(f)), manner_t(), spinning, 'spinning')
      locks_not = .false.
   end do
   call test%finish()

contains

   !> The model of a scene.
   subroutine make(model, scene, error)
      type(model_t), intent(inout) :: model
      type(scene_t), intent(in) :: scene
      type(error_t), intent(inout) :: error
      if (locks_not) then
         allocate (model%effects(1))
         allocate (model%effects(1)%effect, source=anti_locking_t())
         model%effects(1)%effect%name = 'anti_locking'
      end if
      call model%build(comm, scene, error)
      call test%check(allocated(model%levels(2)%layer) .eqv. locks_not, 'a layer where means are taken')
   end subroutine make

   !> Give level 2, whose region is a box, another one within that box.
   subroutine reform(model, form, error)
      type(model_t), intent(inout) :: model
      character(len=*), intent(in) :: form
      type(error_t), intent(inout) :: error
      logical, allocatable :: chosen(:, :, :)
      integer :: low(3), high(3), n(3), i, j, k
      call model%levels(2)%region%node_box(low, high)
      n = (high - low)/2
      allocate (chosen(n(1), n(2), n(3)))
      do k = 1, n(3)
         do j = 1, n(2)
            do i = 1, n(1)
               if (form == 'L') chosen(i, j, k) = 2*i <= n(1) .or. 2*j <= n(2)
               if (form == 'ball') chosen(i, j, k) = norm2((2*[i, j, k] - 1.0_wp)/n - 1.0_wp) < 1.0_wp
            end do
         end do
      end do
      model%levels(2)%region = make_region(model%levels(2)%grid, low, chosen)
      call test%check(int(model%levels(2)%region%cells()) == 8*count(chosen) .and. .not. all(chosen), form// &
                      ': the form')
      call settle_particles(model, error)
   end subroutine reform

   pure subroutine still(x, level, v, l, s)
      real(wp), intent(in) :: x(3)
      integer, intent(in) :: level
      real(wp), intent(out) :: v(3), l(3, 3), s(6)
      associate (unused => x, unneeded => level); end associate
      v = 0.0_wp
      l = 0.0_wp
      s = pressure
   end subroutine still

   pure subroutine even(x, level, v, l, s)
      real(wp), intent(in) :: x(3)
      integer, intent(in) :: level
      real(wp), intent(out) :: v(3), l(3, 3), s(6)
      associate (unused => x, unneeded => level); end associate
      v = flight
      l = 0.0_wp
      s = 0.0_wp
   end subroutine even

   pure subroutine spinning(x, level, v, l, s)
      real(wp), intent(in) :: x(3)
      integer, intent(in) :: level
      real(wp), intent(out) :: v(3), l(3, 3), s(6)
      real(wp), parameter :: w(3) = [4.0_wp, -9.0_wp, 12.0_wp], middle(3) = [4.0_wp, 5.0_wp, 5.0_wp]*cell
      real(wp) :: r(3)
      associate (unneeded => level); end associate
      r = x - middle
      v = flight + [w(2)*r(3) - w(3)*r(2), w(3)*r(1) - w(1)*r(3), w(1)*r(2) - w(2)*r(1)]
      l = reshape([0.0_wp, w(3), -w(2), -w(3), 0.0_wp, w(1), w(2), -w(1), 0.0_wp], [3, 3])
      s = 0.0_wp
   end subroutine spinning

   !> A body fills a grid with symmetry planes all round, under different pressures along x, y, z: nothing
   !> moves.
   subroutine at_rest(form, manner)
      character(len=*), intent(in) :: form
      type(manner_t), intent(in) :: manner
      type(scene_t) :: scene
      type(model_t) :: model
      type(error_t) :: error
      real(wp), allocatable :: all(:, :)
      real(wp) :: off(2)
      scene = empty_scene([8, 8, 8], manner)
      scene%grid%boundary = boundary_symmetry
      call add_box(scene, [0.0_wp, 0.0_wp, 0.0_wp], [8.0_wp, 8.0_wp, 8.0_wp], 8)
      call add_level(scene, [2, 2, 0], [8, 8, 6])
      call make(model, scene, error)
      call reform(model, form, error)
      call set_motion(model, still)
      call run_steps(model, 10, manner%step_of(0.4_wp), error)
      call test%check(.not. error%happened(), form//' at rest: goes on')
      all = all_particles(model)
      off = [maxval(abs(all(4:6, :)))*density*wave/pressure(1), &
             maxval(abs(all(9:14, :) - spread(pressure, 2, size(all, 2))))/pressure(1)]
      if (comm%is_root()) print '(3x,a40,1x,a16,2es10.2)', manner%text(), form//' at rest', off
      call test%check_close(off, [0.0_wp, 0.0_wp], 1.0e-12_wp, form//' at rest: speed, stress, '// &
                            manner%text())
      call test%check_close(sum(all(at_mass, :)), density*(8*cell)**3, 1.0e-12_wp*density*(8*cell)**3, &
                            form//' at rest: mass')
      call model%release()
   end subroutine at_rest

   !> A block flies through the region: mass and momentum stay; where it does not spin no particle is faster
   !> or slower or strained.
   subroutine in_flight(form, manner, state, name)
      character(len=*), intent(in) :: form, name
      type(manner_t), intent(in) :: manner
      procedure(state_interface) :: state
      type(scene_t) :: scene
      type(model_t) :: model
      type(error_t) :: error
      type(sums_t) :: start, now
      real(wp), allocatable :: all(:, :)
      real(wp) :: off(5)
      integer :: most, s
      scene = empty_scene([18, 14, 10], manner)
      call add_box(scene, [2.5_wp, 3.5_wp, 3.5_wp], [5.5_wp, 6.5_wp, 6.5_wp], 8)
      call add_level(scene, [6, 4, 2], [14, 12, 8])
      call make(model, scene, error)
      call reform(model, form, error)
      call set_motion(model, state)
      start = measure(model)
      off = 0.0_wp
      most = 0
      do s = 1, nint(9.0_wp*cell/flight(1)/manner%step_of(0.4_wp))
         call run_steps(model, 1, manner%step_of(0.4_wp), error)
         if (error%happened()) exit
         most = max(most, particles_on(model, 2))
         now = measure(model)
         call keep_worst(off(1), now%mass/start%mass - 1.0_wp)
         call keep_worst(off(2), norm2(now%momentum - start%momentum)/norm2(start%momentum))
      end do
      call test%check(.not. error%happened(), form//', '//name//': goes on')
      call test%check(most > 216, form//', '//name//': particles were split')
      off(3) = now%energy()/start%energy() - 1.0_wp
      all = all_particles(model)
      off(4) = maxval(abs(all(4:6, :) - spread(flight, 2, size(all, 2))))/norm2(flight)
      off(5) = maxval(abs(all(9:14, :)))/(young*norm2(flight)/wave)
      if (comm%is_root()) print '(3x,a40,1x,a16,3es10.2,2i6)', manner%text(), form//' '//name, off(1:3), &
         most, size(all, 2)
      call test%check_close(off(:2), [0.0_wp, 0.0_wp], 1.0e-12_wp, form//', '//name//': mass, momentum, '// &
                            manner%text())
      ! PIC takes energy on one level too
      if (manner%flip > 0.999_wp) call test%check_close(off(3), 0.0_wp, 0.03_wp, &
                                                        form//', '//name//': energy within 3 %, '// &
                                                           manner%text())
      if (name /= 'spinning') call test%check_close(off(4:5), [0.0_wp, 0.0_wp], 1.0e-12_wp, &
                                                     form//', '//name//': velocity, stress, '//manner%text())
      call model%release()
   end subroutine in_flight

end program any_region
