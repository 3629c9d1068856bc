!> Nested levels: pulses through an edge, straight and at 45 degrees, and bodies that ring, beside the same on
!> one level.
!>
!> A pulse v = h exp(-(s/w)^2), w = 6 coarse cells, of plane strain. The velocity is that of half a step
!> before the stress, as leapfrog wants it: else a wave of 1.4 % goes back from the start. What is left behind
!> the pulse may be at most 1 % of its height above what the uniform coarse grid leaves there.
!test: long
!test: limit 120
program levels_waves
   use m_kinds, only: wp
   use m_errors, only: error_t
   use m_communicator, only: communicator_t
   use m_scene, only: scene_t
   use m_side_kinds, only: boundary_symmetry
   use m_model, only: model_t
   use m_energy, only: sums_t, measure
   use m_assertions, only: assertions_t
   use m_nested
   implicit none
   real(wp), parameter :: width = 6.0_wp*cell, height = 1.0e-3_wp*wave, safety = 0.4_wp
   type(communicator_t) :: comm
   type(assertions_t) :: test
   !> Of the pulse: direction, middle at the start, half a step's way on levels. Saved, so that `pulse` need
   !> not find them on a stack.
   real(wp), save :: way(3), begun, lag(2)
   logical :: affine
   integer :: a
   call comm%start()
   call test%start(comm, 'levels_waves')
   if (comm%is_root()) &
      print '(3x,a)', &
      'a pulse: height it has left over that of the start, left behind over that, energy, momentum'
   do a = 1, 2
      affine = a == 1
      call straight()
   end do
   affine = .true.
   call oblique()
   if (comm%is_root()) print '(3x,a)', &
      'ringing: safety, periods, energy/start (last, lowest, highest mean, highest), momentum'
   call rings(24)
   call rings(0)
   call test%finish()

contains

   pure real(wp) function bell(s)
      real(wp), intent(in) :: s
      bell = exp(-(s/width)**2)
   end function bell

   !> The pulse travels along `way` (a unit vector) from where s = begun.
   subroutine set_pulse(model, manner)
      type(model_t), intent(inout) :: model
      type(manner_t), intent(in) :: manner
      lag = 0.5_wp*wave*manner%step_of(safety)*[1.0_wp, merge(0.5_wp, 1.0_wp, manner%subcycle)]
      call set_motion(model, pulse)
   end subroutine set_pulse

   pure subroutine pulse(x, level, v, l, s)
      real(wp), intent(in) :: x(3)
      integer, intent(in) :: level
      real(wp), intent(out) :: v(3), l(3, 3), s(6)
      real(wp) :: along, strain, n(3, 3)
      along = dot_product(x, way) - begun
      strain = -height/wave*bell(along)
      n = spread(way, 2, 3)*spread(way, 1, 3)
      along = along + lag(min(level, 2))
      v = height*bell(along)*way
      l = -2.0_wp*along/width**2*height*bell(along)*n
      s = strain*2.0_wp*shear*[n(1, 1), n(2, 2), n(3, 3), n(2, 3), n(1, 3), n(1, 2)]
      s(1:3) = s(1:3) + strain*lambda
   end subroutine pulse

   !> Along a bar of 78 x 2 x 2 cells between symmetry planes, from coarse to fine, from fine to coarse, and
   !> without an edge.
   subroutine straight()
      real(wp) :: left(5), high(5)
      character(len=14), parameter :: names(5) = ['one level     ', 'coarse to fine', 'fine to coarse', &
                                                  'lockstep      ', 'three levels  ']
      type(model_t), allocatable :: model
      type(scene_t) :: scene
      type(error_t) :: error
      type(manner_t) :: manner
      type(sums_t) :: start, now
      real(wp), allocatable :: all(:, :)
      integer :: kind, steps
      way = [1.0_wp, 0.0_wp, 0.0_wp]
      begun = 20.0_wp*cell
      do kind = 1, merge(5, 3, affine)
         manner = manner_t(affine=affine, subcycle=kind /= 4, levels=merge(1, 2, kind == 1))
         if (kind == 5) manner%levels = 3
         allocate (model)
         scene = empty_scene([78, 2, 2], manner)
         scene%grid%boundary(3:6) = boundary_symmetry
         call add_box(scene, [0.0_wp, 0.0_wp, 0.0_wp], [78.0_wp, 2.0_wp, 2.0_wp], 8)
         select case (kind)
         case (2, 4); call add_level(scene, [42, 0, 0], [78, 2, 2])
         case (3); call add_level(scene, [0, 0, 0], [42, 2, 2])
         case (5)
            call add_level(scene, [42, 0, 0], [56, 2, 2]) ! the pulse has passed them when it is measured:
                                                          ! particles that touch an
            call add_level(scene, [46, 0, 0], [52, 2, 2]) ! edge have impulses of the finer side ahead of time
                                                          ! (theory.md, eq. time-levels)
         end select
         call model%build(comm, scene, error)
         call set_pulse(model, manner)
         start = measure(model)
         steps = nint(42.0_wp*cell/wave/manner%step_of(safety))
         call run_steps(model, steps, manner%step_of(safety), error)
         call test%check(.not. error%happened(), 'pulse: goes on')
         now = measure(model)
         all = all_particles(model)
         high(kind) = maxval(all(4, :), mask=all(1, :) > 45.0_wp*cell)/height
         left(kind) = maxval(abs(all(4, :)), mask=all(1, :) > 2.0_wp*cell .and. all(1, :) < 45.0_wp*cell) &
                      /height
         if (comm%is_root()) print '(6x,a7,a15,2f9.5,f9.5,es9.1)', merge('affine ', 'plain  ', affine), &
            names(kind), high(kind), left(kind), now%energy()/start%energy(), &
            abs(now%momentum(1) - start%momentum(1))/start%momentum(1)
         call test%check_close(now%momentum(1), start%momentum(1), 1.0e-12_wp*start%momentum(1), &
                               'pulse: momentum')
         if (kind > 1) &
            call test%check(left(kind) < left(1) + 0.01_wp, 'pulse: what the edge leaves behind, '// &
                            names(kind))
         if (kind > 1) call test%check(high(kind) > high(1) - 0.01_wp .and. high(kind) < 1.03_wp, &
                                       'pulse: its height, '//names(kind))
         call model%release()
         deallocate (model)
      end do
   end subroutine straight

   !> At 45 degrees through a fine box, in a sheet one cell thick: against the same on the coarse grid,
   !> particle by particle, behind the pulse. So what comes from the sides of the sheet, where the pulse does
   !> not fit, drops out; what remains is what the box throws back.
   subroutine oblique()
      integer, parameter :: n = 72, half = 6
      type(model_t), allocatable :: model
      type(scene_t) :: scene
      type(error_t) :: error
      type(manner_t) :: manner
      real(wp), allocatable :: all(:, :), first(:, :)
      real(wp) :: high(2), thrown_back
      logical, allocatable :: looked_at(:), ahead(:)
      integer :: kind, steps, p
      way = [sqrt(0.5_wp), sqrt(0.5_wp), 0.0_wp]
      begun = (sqrt(0.5_wp)*n - 15.0_wp)*cell
      do kind = 1, 2
         manner = manner_t(affine=affine, levels=kind)
         allocate (model)
         scene = empty_scene([n, n, 1], manner)
         scene%grid%boundary(5:6) = boundary_symmetry
         call add_box(scene, [0.0_wp, 0.0_wp, 0.0_wp], real([n, n, 1], wp), 8)
         if (kind == 2) call add_level(scene, [n/2 - half, n/2 - half, 0], [n/2 + half, n/2 + half, 1])
         call model%build(comm, scene, error)
         call set_pulse(model, manner)
         steps = nint(31.0_wp*cell/wave/manner%step_of(safety))
         call run_steps(model, steps, manner%step_of(safety), error)
         call test%check(.not. error%happened(), 'oblique: goes on')
         all = all_particles(model)
         call choose(all, n, half, looked_at, ahead)
         high(kind) = sqrt(maxval(all(4, :)**2 + all(5, :)**2, mask=ahead))/height
         all = all(:, pack([(p, p=1, size(all, 2))], looked_at))
         if (kind == 1) first = all
         call model%release()
         deallocate (model)
      end do
      thrown_back = 0.0_wp
      call test%check_equal(size(all, 2), size(first, 2), 'oblique: particles looked at')
      do p = 1, size(all, 2)
         thrown_back = max(thrown_back, norm2(all(4:6, p) - first(4:6, nearest(first, all(1:3, p))))/height)
      end do
      if (comm%is_root()) print '(6x,a,2f9.5,a,f9.5,a,i6,a)', 'oblique: height on one level, with the box', &
         high, '; the box throws back', thrown_back, ' seen by', size(all, 2), ' particles'
      call test%check(thrown_back < 0.01_wp, 'oblique: what the edges throw back')
      call test%check(high(2) > high(1) - 0.01_wp .and. high(2) < 1.03_wp, 'oblique: its height')
   end subroutine oblique

   !> Particles behind the pulse, outside the box by two cells (nearer ones may live on the finer level, whose
   !> velocities stand at another time) and inside the sheet; particles where the pulse is.
   subroutine choose(all, n, half, behind, ahead)
      real(wp), intent(in) :: all(:, :)
      integer, intent(in) :: n, half !< edge of the sheet, half the box's, cells
      logical, allocatable, intent(out) :: behind(:), ahead(:)
      real(wp) :: x(2), s
      integer :: q
      allocate (behind(size(all, 2)), ahead(size(all, 2)))
      do q = 1, size(all, 2)
         x = all(1:2, q)/cell - 0.5_wp*n
         s = sqrt(0.5_wp)*sum(x)
         ahead(q) = s > 8.0_wp .and. abs(x(1) - x(2)) < 4.0_wp
         behind(q) = s < 2.0_wp .and. s > -10.0_wp .and. maxval(abs(x)) > half + 2 .and. maxval(abs(x)) < &
                     0.5_wp*n - 4.0_wp
      end do
   end subroutine choose

   !> About 500 coarse steps of a bar or block; levels_long has more.
   subroutine rings(long)
      integer, intent(in) :: long !< cells of a bar; 0 is a block
      integer, parameter :: kinds = 6
      type(manner_t) :: manners(kinds)
      type(ringing_t) :: ringing, subcycled
      type(scene_t) :: scene
      real(wp) :: off(5), uniform(2)
      integer :: kind, half
      manners = [manner_t(levels=1), manner_t(affine=.false., levels=1), manner_t(), &
                 manner_t(affine=.false.), manner_t(subcycle=.false.), manner_t(levels=3)]
      do half = merge(1, 2, long > 0), 2
         do kind = 1, merge(kinds, 4, half == 2)
            if (long > 0) scene = ringing_bar(manners(kind), long)
            if (long == 0) scene = ringing_block(manners(kind))
            ringing = ring(comm, scene, manners(kind), 0.25_wp*half, &
                           nint(500.0_wp/half*manner_steps(manners(kind))), long)
            if (comm%is_root()) print '(6x,a,a40,f6.2,i4,4f9.5,2es9.1,i7,f7.1,a)', &
               merge('bar  ', 'block', long > 0), manners(kind)%text(), 0.25_wp*half, ringing%periods, &
               ringing%last, ringing%lowest, ringing%highest, ringing%largest, ringing%momentum, &
               ringing%mass, ringing%particles, ringing%seconds, ' s'
            if (kind <= 2) uniform(kind) = ringing%lowest
            call test%check(.not. ringing%failed, 'ringing: goes on')
            call test%check(ringing%highest < 1.01_wp, 'ringing: no more energy, '//manners(kind)%text())
            call test%check(ringing%lowest > min(0.97_wp, uniform(merge(1, 2, manners(kind)%affine)) &
                                                 - 0.01_wp), &
                            'ringing: no less energy, '//manners(kind)%text())
            call test%check_close(ringing%momentum, 0.0_wp, 1.0e-12_wp, 'ringing: momentum')
            call test%check_close(ringing%mass, 0.0_wp, 1.0e-14_wp, 'ringing: mass')
            if (half == 2 .and. kind == 3) subcycled = ringing
            if (kind == 5 .and. .not. ringing%failed) then
               off = worst_difference(ringing%all, subcycled%all)/[cell, 0.005_wp*bar_wave, 0.005_wp*young, &
                     1.0_wp, 1.0_wp]
               if (comm%is_root()) &
                  print '(6x,a,4es9.1)', '   lockstep and subcycled differ: place, speed, stress, volume', &
                  off([1, 2, 3, 5])
               call test%check(off(1) < 0.02_wp .and. off(2) < 0.1_wp, &
                               'ringing: subcycled or not, much the same')
            end if
         end do
      end do
   end subroutine rings

   pure real(wp) function manner_steps(manner)
      type(manner_t), intent(in) :: manner
      manner_steps = manner%step_of(1.0_wp)
      manner_steps = cell/wave/manner_steps
   end function manner_steps

end program levels_waves
