!> Nested levels: what must be kept. Constant velocity and constant stress through edges, mass and momentum of
!> a block that travels and spins through a fine region, energy where one leaves it, a level without
!> particles, a model and its mirror image, and a force that the momentum must show.
!test: ranks 2
!test: limit 120
program levels
   use m_kinds, only: wp
   use m_constants, only: short_of, pi, block_size
   use m_errors, only: error_t
   use m_communicator, only: communicator_t
   use m_scene, only: scene_t
   use m_side_kinds, only: boundary_symmetry, boundary_roller
   use m_domain_kinds, only: domain_stretch, domain_corners
   use m_model, only: model_t
   use m_energy, only: sums_t, measure
   use m_assertions, only: assertions_t
   use m_chance, only: keep_worst
   use m_nested
   implicit none
   type(communicator_t) :: comm
   type(assertions_t) :: test
   type(manner_t) :: manners(7), uniform
   real(wp) :: kept_by_one(2, 2) !< energy at the end over that at the start on one level: affine or not, flip
                                 !< 1 or not
   integer :: i
   call comm%start()
   call test%start(comm, 'levels')
   manners = [manner_t(), manner_t(affine=.false.), manner_t(flip=0.98_wp), &
              manner_t(affine=.false., flip=0.98_wp), manner_t(subcycle=.false.), manner_t(levels=3), &
              manner_t(levels=3, subcycle=.false.)]
   if (comm%is_root()) print '(3x,a)', 'constant velocity: largest change over |v|, stress over E |v|/c'
   do i = 1, size(manners)
      call constant_velocity(manners(i))
   end do
   if (comm%is_root()) &
      print '(3x,a)', 'constant stress at rest: largest speed over stress/(density c), change of stress'
   do i = 1, size(manners)
      call constant_stress(manners(i), [2, 2, 2], [6, 6, 6], 'inside')
      call constant_stress(manners(i), [0, 0, 0], [4, 4, 4], 'at a corner')
      call constant_stress(manners(i), [2, 0, 2], [6, 4, 6], 'at a symmetry plane')
      call constant_stress(manners(i), [2, 0, 0], [6, 8, 8], 'across')
   end do
   if (comm%is_root()) &
      print '(3x,a)', &
      'constant stress, lattice anywhere: largest acceleration inside over stress/(density cell)'
   do i = 1, 27
      if (i == 1 .or. i == 8 .or. i == 27) call inner_forces(i)
   end do
   if (comm%is_root()) print '(3x,2a)', 'a block travels and spins through a region: mass, momentum, ', &
      'energy/start (last, lowest, highest), angular momentum, particles at most, merged'
   do i = 1, 4
      uniform = manners(i)
      uniform%levels = 1
      call crossing(uniform)
   end do
   call crossing_all_fine()
   do i = 1, size(manners)
      call crossing(manners(i))
   end do
   call crossing_with(domain_stretch, 'stretch')
   call crossing_with(domain_corners, 'corners')
   if (comm%is_root()) &
      print '(3x,a)', 'a short bar leaves a region at half the speed of sound: energy/start, highest and last'
   call leaving(manner_t(levels=1))
   do i = 1, size(manners)
      call leaving(manners(i))
   end do
   do i = 0, 2
      call first_step(1.0_wp*i)
   end do
   call without_particles()
   call mirrored(manner_t())
   call mirrored(manner_t(affine=.false., levels=3))
   call mirrored(manner_t(subcycle=.false., flip=0.98_wp))
   call planted(0.0_wp)
   call planted(1.0e-9_wp)
   call planted(1.0e-2_wp)
   call test%finish()

contains

   !> The levels of the blocks that travel: a region in the way, its corner first, and one in it.
   subroutine nest(scene, manner)
      type(scene_t), intent(inout) :: scene
      type(manner_t), intent(in) :: manner
      if (manner%levels > 1) call add_level(scene, [8, 7, 6], [16, 15, 14])
      if (manner%levels > 2) call add_level(scene, [11, 10, 9], [13, 12, 11])
   end subroutine nest

   pure subroutine even_motion(x, level, v, l, s)
      real(wp), intent(in) :: x(3)
      integer, intent(in) :: level
      real(wp), intent(out) :: v(3), l(3, 3), s(6)
      v = [7.0_wp, 6.1_wp, 3.7_wp]
      l = 0.0_wp
      s = 0.0_wp
   end subroutine even_motion

   !> A block flies through the region: no particle is faster or slower, none is strained.
   subroutine constant_velocity(manner)
      type(manner_t), intent(in) :: manner
      type(scene_t) :: scene
      type(model_t) :: model
      type(error_t) :: error
      real(wp), allocatable :: all(:, :)
      real(wp) :: v(3), l(3, 3), s(6), off(3)
      integer :: p, steps
      scene = empty_scene([28, 24, 20], manner)
      call add_box(scene, [3.1_wp, 3.0_wp, 3.2_wp], [6.1_wp, 6.0_wp, 6.2_wp], 8)
      call nest(scene, manner)
      call model%build(comm, scene, error)
      call set_motion(model, even_motion)
      call even_motion([0.0_wp, 0.0_wp, 0.0_wp], 1, v, l, s)
      steps = nint(13.0_wp*cell/v(1)/manner%step_of(0.4_wp))
      call run_steps(model, steps/2, manner%step_of(0.4_wp), error)
      call test%check(particles_on(model, manner%levels) > 216, &
                      'constant velocity: the block is on the finest level')
      call run_steps(model, steps - steps/2, manner%step_of(0.4_wp), error)
      call test%check(.not. error%happened(), 'constant velocity: goes on')
      all = all_particles(model)
      off = 0.0_wp
      do p = 1, size(all, 2)
         call keep_worst(off(1), maxval(abs(all(4:6, p) - v))/norm2(v))
      end do
      call keep_worst(off(2), maxval(abs(all(9:14, :)))/(young*norm2(v)/wave))
      off(3) = sum(all(at_mass, :))/(density*27*cell**3) - 1.0_wp
      call test%check(size(all, 2) > 216, 'constant velocity: particles have been split')
      if (comm%is_root()) print '(6x,a40,2es10.2,i8,a)', manner%text(), off(1:2), size(all, 2), ' particles'
      call test%check_close(off(1:2), [0.0_wp, 0.0_wp], 1.0e-12_wp, 'constant velocity, '//manner%text())
      call test%check_close(off(3), 0.0_wp, 1.0e-14_wp, 'constant velocity: mass')
      call model%release()
   end subroutine constant_velocity

   pure subroutine even_pressure(x, level, v, l, s)
      real(wp), intent(in) :: x(3)
      integer, intent(in) :: level
      real(wp), intent(out) :: v(3), l(3, 3), s(6)
      v = 0.0_wp
      l = 0.0_wp
      s = [1.0e4_wp, -0.4e4_wp, 0.7e4_wp, 0.0_wp, 0.0_wp, 0.0_wp]
   end subroutine even_pressure

   !> A body fills a grid with symmetry planes all round, under different pressures along x, y, z: nothing
   !> moves.
   subroutine constant_stress(manner, lower, upper, where)
      type(manner_t), intent(in) :: manner
      integer, intent(in) :: lower(3), upper(3)
      character(len=*), intent(in) :: where
      type(scene_t) :: scene
      type(model_t) :: model
      type(error_t) :: error
      real(wp), allocatable :: all(:, :)
      real(wp) :: off(2), v(3), l(3, 3), s(6)
      integer :: axis, low(3), high(3)
      scene = empty_scene([8, 8, 8], manner)
      scene%grid%boundary = boundary_symmetry
      call add_box(scene, [0.0_wp, 0.0_wp, 0.0_wp], [8.0_wp, 8.0_wp, 8.0_wp], 8)
      call add_level(scene, lower, upper)
      low = lower
      high = upper
      do axis = 1, 3
         if (lower(axis) > 0) low(axis) = low(axis) + 1
         if (upper(axis) < 8) high(axis) = high(axis) - 1
      end do
      if (manner%levels > 2) call add_level(scene, low, high)
      call model%build(comm, scene, error)
      call set_motion(model, even_pressure)
      call run_steps(model, 20, manner%step_of(0.4_wp), error)
      call test%check(.not. error%happened(), 'constant stress: goes on')
      call even_pressure([0.0_wp, 0.0_wp, 0.0_wp], 1, v, l, s)
      all = all_particles(model)
      off = [maxval(abs(all(4:6, :)))/(s(1)/(density*wave)), &
             maxval(abs(all(9:14, :) - spread(s, 2, size(all, 2))))/s(1)]
      if (comm%is_root()) print '(6x,a40,1x,a20,2es10.2)', manner%text(), where, off
      call test%check_close(off, [0.0_wp, 0.0_wp], 1.0e-12_wp, 'constant stress '//where//', '//manner%text())
      call test%check_close(sum(all(at_mass, :)), density*(8*cell)**3, 1.0e-12_wp*density*(8*cell)**3, &
                            'constant stress: mass')
      call model%release()
   end subroutine constant_stress

   pure subroutine even_shear(x, level, v, l, s)
      real(wp), intent(in) :: x(3)
      integer, intent(in) :: level
      real(wp), intent(out) :: v(3), l(3, 3), s(6)
      v = 0.0_wp
      l = 0.0_wp
      s = 1.0e4_wp*[1.0_wp, -0.4_wp, 0.7_wp, 0.3_wp, 0.8_wp, -0.6_wp]
   end subroutine even_shear

   !> A free body whose lattice does not fit the grid, under one stress: no force on any node four cells or
   !> more inside it, of either level.
   subroutine inner_forces(per_cell)
      integer, intent(in) :: per_cell
      real(wp), parameter :: low(3) = [3.137_wp, 3.71_wp, 2.29_wp], high = 14.0_wp, deep = 4.0_wp
      type(scene_t) :: scene
      type(model_t) :: model
      type(error_t) :: error
      real(wp) :: x(3), worst(2)
      integer :: n, b, i, j, k, at(3), looked(2)
      scene = empty_scene([20, 20, 20], manner_t())
      call add_box(scene, low, low + high, per_cell)
      call add_level(scene, [8, 6, 8], [12, 20, 12])
      call model%build(comm, scene, error)
      model%works_ahead = .false. ! nodes are looked at after a step
      call set_motion(model, even_shear)
      call run_steps(model, 2, 1.0e-6_wp*cell/wave, error) ! the first makes new blocks, and all tiles anew
      call test%check(.not. error%happened(), 'inner forces: goes on')
      worst = 0.0_wp
      looked = 0
      do n = 1, 2
         associate (level => model%levels(n))
            do b = 1, size(level%blocks)
               do k = 1, block_size
                  do j = 1, block_size
                     do i = 1, block_size
                        at = block_size*level%blocks(b)%place + [i, j, k] - 1
                        x = at*level%grid%cell/cell
                        if (any(x < low + deep) .or. any(x > low + high - deep)) cycle
                        if (.not. level%nodes(1, i, j, k, b) > 0.0_wp) cycle
                        looked(n) = looked(n) + 1
                        call keep_worst(worst(n), &
                                        maxval(abs(level%nodes(5:7, i, j, k, b)))/(1.0e4_wp/(density*cell)))
                     end do
                  end do
               end do
            end do
         end associate
      end do
      looked = [int(comm%sum_count(int(looked(1), 8))), int(comm%sum_count(int(looked(2), 8)))]
      worst = [comm%maximum(worst(1)), comm%maximum(worst(2))]
      if (comm%is_root()) print '(6x,i3,a,2(i6,a,es9.2))', per_cell, ' particles a cell:', looked(1), &
         ' coarse nodes', worst(1), looked(2), ' fine nodes', worst(2)
      call test%check(all(looked > 50), 'inner forces: nodes were looked at')
      ! up to the hair by which half sizes are shorter than the cubes that fill the body
      call test%check_close(worst, [0.0_wp, 0.0_wp], 1.0e-11_wp + (1.0_wp - short_of), 'inner forces vanish')
      call model%release()
   end subroutine inner_forces

   !> A block of 4 cells an edge spins and flies.
   pure subroutine spinning(x, level, v, l, s)
      real(wp), intent(in) :: x(3)
      integer, intent(in) :: level
      real(wp), intent(out) :: v(3), l(3, 3), s(6)
      real(wp), parameter :: w(3) = [4.0_wp, -9.0_wp, 12.0_wp], middle(3) = [5.0_wp, 5.0_wp, 5.5_wp]*cell
      real(wp) :: r(3)
      r = x - middle
      v = [7.0_wp, 6.1_wp, 3.7_wp] + [w(2)*r(3) - w(3)*r(2), w(3)*r(1) - w(1)*r(3), w(1)*r(2) - w(2)*r(1)]
      l = reshape([0.0_wp, w(3), -w(2), -w(3), 0.0_wp, w(1), w(2), -w(1), 0.0_wp], [3, 3])
      s = 0.0_wp
   end subroutine spinning

   subroutine crossing(manner)
      type(manner_t), intent(in) :: manner
      type(scene_t) :: scene
      scene = empty_scene([28, 24, 20], manner)
      call cross(scene, manner, manner%text())
   end subroutine crossing

   !> A level that fills the grid: a finer grid without edges.
   subroutine crossing_all_fine()
      type(scene_t) :: scene
      scene = empty_scene([28, 24, 20], manner_t())
      call add_level(scene, [0, 0, 0], [28, 24, 20])
      call cross(scene, manner_t(levels=1), 'a level everywhere')
   end subroutine crossing_all_fine

   subroutine crossing_with(domain, name)
      integer, intent(in) :: domain
      character(len=*), intent(in) :: name
      type(scene_t) :: scene
      scene = empty_scene([28, 24, 20], manner_t())
      scene%time%domain = domain
      call cross(scene, manner_t(), name)
   end subroutine crossing_with

   !> It flies into the region over a corner and out of it again.
   subroutine cross(scene, manner, name)
      type(scene_t), intent(inout) :: scene
      type(manner_t), intent(in) :: manner
      character(len=*), intent(in) :: name
      type(model_t) :: model
      type(error_t) :: error
      type(sums_t) :: start, now
      real(wp) :: low, high, off(2), turned(3), one
      integer :: s, steps, most, merges
      call add_box(scene, [3.0_wp, 3.0_wp, 3.5_wp], [7.0_wp, 7.0_wp, 7.5_wp], 8)
      call nest(scene, manner)
      call model%build(comm, scene, error)
      call set_motion(model, spinning)
      start = measure(model)
      low = start%energy()
      high = low
      off = 0.0_wp
      most = 0
      steps = nint(15.0_wp*cell/7.0_wp/manner%step_of(0.4_wp))
      do s = 1, steps
         call run_steps(model, 1, manner%step_of(0.4_wp), error)
         if (error%happened()) exit
         now = measure(model)
         low = min(low, now%energy())
         high = max(high, now%energy())
         call keep_worst(off(1), now%mass/start%mass - 1.0_wp)
         call keep_worst(off(2), norm2(now%momentum - start%momentum)/norm2(start%momentum))
         most = max(most, int(comm%sum_count(model%particle_count())))
      end do
      turned = now%angular_momentum - start%angular_momentum
      merges = int(comm%sum_count(model%merges))
      call test%check(.not. error%happened(), 'crossing: goes on, '//name)
      ! of the spin: that of the centre of mass about the origin is kept with the momentum
      if (comm%is_root()) print '(6x,a40,2es9.1,3f9.5,es9.1,2i8)', name, off, now%energy()/start%energy(), &
         low/start%energy(), high/start%energy(), norm2(turned)/norm2(spin(start)), most, merges
      call test%check_close(off(1), 0.0_wp, 1.0e-13_wp, 'crossing: mass, '//name)
      call test%check_close(off(2), 0.0_wp, 1.0e-12_wp, 'crossing: momentum, '//name)
      one = kept_by_one(merge(1, 2, manner%affine), merge(1, 2, manner%flip > 0.999_wp))
      if (size(model%levels) == 1) one = low/start%energy()
      kept_by_one(merge(1, 2, manner%affine), merge(1, 2, manner%flip > 0.999_wp)) = one
      call test%check(low > (one - 0.03_wp)*start%energy() .and. high < 1.03_wp*start%energy(), &
                      'crossing: energy within 3 % of that on one level, '//name)
      if (manner%levels > 1) call test%check(most > 1000, 'crossing: particles were split')
      if (manner%levels > 1 .and. scene%time%domain /= domain_stretch) & ! parts turn, and the boxes do not
         call test%check(merges > 100, 'crossing: particles merged, '//name)
      call model%release()
   end subroutine cross

   !> Angular momentum about the middle of the block at the start, where its centre of mass is.
   pure function spin(sums) result(l)
      type(sums_t), intent(in) :: sums
      real(wp) :: l(3)
      real(wp), parameter :: x(3) = [5.0_wp, 5.0_wp, 5.5_wp]*cell
      associate (p => sums%momentum)
         l = sums%angular_momentum - [x(2)*p(3) - x(3)*p(2), x(3)*p(1) - x(1)*p(3), x(1)*p(2) - x(2)*p(1)]
      end associate
   end function spin

   !> A short bar rings and flies out of the region at half the speed of sound: free surfaces at coarse nodes
   !> that had no mass.
   subroutine leaving(manner)
      type(manner_t), intent(in) :: manner
      real(wp), parameter :: safety = 0.3_wp
      type(scene_t) :: scene
      type(model_t) :: model
      type(error_t) :: error
      type(sums_t) :: start, now
      real(wp) :: moving, first, inner, high, off
      integer :: s, steps
      scene = empty_scene([40, 8, 8], manner)
      call add_box(scene, [6.0_wp, 3.0_wp, 3.0_wp], [16.0_wp, 5.0_wp, 5.0_wp], 8)
      if (manner%levels > 1) call add_level(scene, [0, 0, 0], [20, 8, 8])
      if (manner%levels > 2) call add_level(scene, [0, 0, 0], [17, 8, 8])
      call model%build(comm, scene, error)
      call set_motion(model, bar_that_leaves)
      start = measure(model)
      moving = 0.5_wp*sum(start%momentum**2)/start%mass
      first = start%energy() - moving
      high = 0.0_wp
      off = 0.0_wp
      inner = 0.0_wp
      steps = nint(20.0_wp*cell/(0.5_wp*wave)/manner%step_of(safety))
      do s = 1, steps
         call run_steps(model, 1, manner%step_of(safety), error)
         if (error%happened()) exit
         now = measure(model)
         inner = now%energy() - 0.5_wp*sum(now%momentum**2)/now%mass
         high = max(high, inner)
         call keep_worst(off, norm2(now%momentum - start%momentum)/norm2(start%momentum))
      end do
      call test%check(.not. error%happened(), 'leaving: goes on, '//manner%text())
      if (comm%is_root()) print '(6x,a40,2f9.4,es9.1)', manner%text(), high/first, inner/first, off
      call test%check_close(off, 0.0_wp, 1.0e-12_wp, 'leaving: momentum, '//manner%text())
      call test%check(high < 1.15_wp*first, 'leaving: no energy beyond that of the start, '//manner%text())
      call model%release()
   end subroutine leaving

   pure subroutine bar_that_leaves(x, level, v, l, s)
      real(wp), intent(in) :: x(3)
      integer, intent(in) :: level
      real(wp), intent(out) :: v(3), l(3, 3), s(6)
      real(wp), parameter :: k = pi/(10.0_wp*cell), speed = 0.01_wp*wave
      v = [0.5_wp*wave + speed*cos(k*(x(1) - 6.0_wp*cell)), 0.0_wp, 0.0_wp]
      l = 0.0_wp
      l(1, 1) = -speed*k*sin(k*(x(1) - 6.0_wp*cell))
      s = 0.0_wp
   end subroutine bar_that_leaves

   !> Particles that enter another block, or another level, in the first step of all.
   subroutine first_step(shift)
      real(wp), intent(in) :: shift
      type(scene_t) :: scene
      type(model_t) :: model
      type(error_t) :: error
      scene = empty_scene([28, 24, 20], manner_t())
      call add_box(scene, [3.2_wp, 4.2_wp, 4.0_wp] - shift, [7.7_wp, 7.0_wp, 6.0_wp] - shift, 8)
      call add_level(scene, [8, 7, 6], [16, 15, 14])
      call model%build(comm, scene, error)
      call set_motion(model, even_motion)
      call run_steps(model, 1, manner_step(), error)
      call test%check(.not. error%happened(), 'first step: particles enter blocks that did not exist')
      call model%release()
   end subroutine first_step

   pure real(wp) function manner_step()
      type(manner_t) :: manner
      manner_step = manner%step_of(0.45_wp)
   end function manner_step

   !> A level that nothing comes near changes nothing.
   subroutine without_particles()
      type(scene_t) :: scene
      type(model_t), allocatable :: model
      type(error_t) :: error
      real(wp), allocatable :: with(:, :), without(:, :)
      real(wp) :: off(5)
      integer :: n
      do n = 1, 3
         allocate (model)
         scene = empty_scene([24, 16, 16], manner_t())
         call add_box(scene, [3.0_wp, 3.0_wp, 3.5_wp], [7.0_wp, 7.0_wp, 7.5_wp], 8)
         if (n > 1) call add_level(scene, [16, 4, 4], [24, 12, 12])
         if (n > 2) call add_level(scene, [20, 6, 6], [24, 10, 10])
         call model%build(comm, scene, error)
         call set_motion(model, spinning)
         call run_steps(model, 30, manner_step(), error)
         call test%check(.not. error%happened(), 'without particles: goes on')
         if (n == 1) without = all_particles(model)
         with = all_particles(model)
         call test%check(size(with, 2) == size(without, 2), 'without particles: no particle is split')
         off = worst_difference(with, without)/[cell, 7.0_wp, 1.0e4_wp, 1.0_wp, 1.0_wp]
         if (comm%is_root() .and. n > 1) print '(3x,a,i2,a,5es9.1)', 'a level without particles', n, &
            ' levels: off by', off
         call test%check_close(off, spread(0.0_wp, 1, 5), 0.0_wp, 'without particles: the same particles')
         call model%release()
         deallocate (model)
      end do
   end subroutine without_particles

   pure subroutine thrown(x, level, v, l, s)
      real(wp), intent(in) :: x(3)
      integer, intent(in) :: level
      real(wp), intent(out) :: v(3), l(3, 3), s(6)
      v = [-2.0_wp*sin(3.0_wp*x(1)), -1.0_wp*sin(4.0_wp*x(2)), 0.5_wp + 2.0_wp*x(3)]
      l = 0.0_wp
      l(1, 1) = -6.0_wp*cos(3.0_wp*x(1))
      l(2, 2) = -4.0_wp*cos(4.0_wp*x(2))
      l(3, 3) = 2.0_wp
      s = 0.0_wp
   end subroutine thrown

   !> A quarter behind two symmetry planes, which cut the levels, moves as the whole does.
   subroutine mirrored(manner)
      type(manner_t), intent(in) :: manner
      integer, parameter :: wide = 9, high = 10
      type(scene_t) :: scene
      type(model_t), allocatable :: model
      type(error_t) :: error
      real(wp), allocatable :: part(:, :), whole(:, :)
      real(wp) :: off(5), low, scale
      integer :: n
      do n = 0, 1
         allocate (model)
         scene = empty_scene([wide*(1 + n), wide*(1 + n), high], manner)
         if (n == 0) scene%grid%boundary([1, 3]) = boundary_symmetry
         scene%grid%boundary(5) = boundary_roller
         scene%grid%lower = cell*[-n*wide, -n*wide, 0]
         scene%grid%upper = cell*[wide, wide, high]
         low = real(-4*n, wp)
         call add_box(scene, [low, low, 0.0_wp], [4.0_wp, 4.0_wp, 6.0_wp], 8)
         call add_level(scene, [(wide - 4)*n, (wide - 4)*n, 2], [wide*n + 4, wide*n + 3, 6])
         if (n == 1) scene%levels(1)%lower(2) = -3.0_wp*cell
         if (manner%levels > 2) &
            call add_level(scene, [(wide - 2)*n, (wide - 2)*n, 3], [wide*n + 2, wide*n + 2, 5])
         call model%build(comm, scene, error)
         call set_motion(model, thrown)
         call run_steps(model, 60, manner%step_of(0.4_wp), error)
         call test%check(.not. error%happened(), 'mirrored: goes on')
         if (n == 0) part = all_particles(model)
         if (n == 1) whole = all_particles(model)
         call model%release()
         deallocate (model)
      end do
      scale = maxval(abs(whole(9:14, :)))
      call test%check_equal(4*size(part, 2), size(whole, 2), 'mirrored: four times as many particles')
      call test%check(scale > 1.0e4_wp, 'mirrored: there is stress')
      off = worst_difference(part, whole)/[8.0_wp*cell, 2.0_wp, scale, 1.0_wp, 1.0_wp]
      if (comm%is_root()) print '(3x,2a,i6,a,5es9.1)', 'a quarter and the whole, '//manner%text(), ',', &
         size(part, 2), ' particles: off by', off
      call test%check_close(off, spread(0.0_wp, 1, 5), 1.0e-11_wp, &
                            'mirrored: a quarter moves as the whole does, '//manner%text())
   end subroutine mirrored

   !> A force on a constrained node of the edge, `share` of the momentum over the run: it goes up to the
   !> coarse nodes and from there to the particles, once; and what conserves momentum to 1e-12 sees one of
   !> 1e-9.
   subroutine planted(share)
      real(wp), intent(in) :: share
      integer, parameter :: steps = 40
      type(scene_t) :: scene
      type(model_t) :: model
      type(error_t) :: error
      type(sums_t) :: start, now
      real(wp) :: impulse(3), change
      real(wp), parameter :: way(3) = [2.0_wp, -1.0_wp, 2.0_wp]/3.0_wp
      type(manner_t) :: manner
      scene = empty_scene([20, 20, 20], manner)
      call add_box(scene, [4.0_wp, 5.0_wp, 5.0_wp], [12.0_wp, 13.0_wp, 13.0_wp], 8)
      call add_level(scene, [8, 7, 7], [14, 14, 14])
      impulse = share*density*512*cell**3*norm2([7.0_wp, 6.1_wp, 3.7_wp])*0.01_wp*way
      allocate (model%effects(1))
      allocate (model%effects(1)%effect, &
                source=kick_t(name='kick', force=impulse/(steps*manner%step_of(0.3_wp)), &
                                                       cell=0.5_wp*cell, node=[16, 19, 21]))
      call model%build(comm, scene, error)
      call set_motion(model, slow)
      start = measure(model)
      call run_steps(model, steps, manner%step_of(0.3_wp), error)
      call test%check(.not. error%happened(), 'planted: goes on')
      now = measure(model)
      change = norm2(now%momentum - start%momentum)/norm2(start%momentum)
      if (comm%is_root()) print '(3x,a,es9.2,a,es10.3,a,es9.1)', 'a force on a constrained,', share, &
         ' of the momentum: momentum changes by', change, ', other than the impulse', &
         norm2(now%momentum - start%momentum - impulse)/norm2(start%momentum)
      if (share <= 0.0_wp) &
         call test%check_close(change, 0.0_wp, 1.0e-12_wp, 'planted: nothing without a force')
      if (share > 0.0_wp) call test%check(change > 1.0e-12_wp, 'planted: the momentum shows it')
      call test%check_close(norm2(now%momentum - start%momentum - impulse)/norm2(start%momentum), 0.0_wp, &
                            1.0e-12_wp, 'planted: momentum grows by the impulse')
      call model%release()
   end subroutine planted

   pure subroutine slow(x, level, v, l, s)
      real(wp), intent(in) :: x(3)
      integer, intent(in) :: level
      real(wp), intent(out) :: v(3), l(3, 3), s(6)
      call even_motion(x, level, v, l, s)
      v = 0.01_wp*v
   end subroutine slow

end program levels
