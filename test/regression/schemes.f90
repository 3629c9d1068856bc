!test: check
!> A bar that vibrates along its axis, 50 steps with every stress update, velocity update and transfer:
!> energy, momentum, and the time that the motion takes to turn.
program schemes
   use m_kinds, only: wp
   use m_constants, only: pi
   use m_errors, only: error_t
   use m_communicator, only: communicator_t
   use m_box, only: box_t
   use m_scene, only: scene_t, grid_spec_t, update_usl, update_usf, update_musl
   use m_materials, only: material_of
   use m_model, only: model_t
   use m_advance, only: advance
   use m_energy, only: sums_t, measure
   use m_assertions, only: assertions_t
   implicit none
   character(len=4), parameter :: updates(3) = ['usl ', 'usf ', 'musl']
   integer, parameter :: codes(3) = [update_usl, update_usf, update_musl], cells = 16, steps = 50
   real(wp), parameter :: young = 1.0e6_wp, density = 1000.0_wp, cell = 0.125_wp, length = cells*cell, &
      speed = 0.1_wp
   type(communicator_t) :: comm
   type(assertions_t) :: test
   real(wp) :: kept
   integer :: u
   call comm%start()
   call test%start(comm, 'schemes')
   print '(3x,a)', 'update transfer flip  energy: least    largest     last   strain at most  momentum'
   do u = 1, 3
      call vibrate(u, 1.0_wp, affine=.true.)
      call vibrate(u, 0.95_wp, affine=.true.)
      call vibrate(u, 1.0_wp, affine=.false.)
      call vibrate(u, 0.95_wp, affine=.false.)
   end do
   call test%finish()

contains

   subroutine vibrate(u, flip, affine)
      integer, intent(in) :: u
      real(wp), intent(in) :: flip
      logical, intent(in) :: affine
      type(model_t) :: model
      type(error_t) :: error
      type(sums_t) :: start, now
      real(wp) :: kinetic(0:steps), strain(0:steps), energy(steps - 1), momentum
      character(len=:), allocatable :: name
      integer :: step, other
      name = trim(updates(u))//' '//trim(merge('affine', 'plain ', affine))
      call model%build(comm, bar(codes(u), flip, affine), error)
      call test%check(.not. error%happened(), 'the bar is built')
      call set_motion(model)
      start = measure(model)
      momentum = 0.0_wp
      do step = 0, steps
         if (step > 0) call advance(model, 0.5_wp*cell/sqrt(young/density), error)
         call test%check(.not. error%happened(), 'the bar goes on')
         now = measure(model)
         kinetic(step) = now%kinetic/start%kinetic
         strain(step) = now%strain/start%kinetic
         momentum = max(momentum, norm2(now%momentum - start%momentum)/sqrt(2.0_wp*start%mass*start%kinetic))
         call test%check(abs(now%mass - start%mass) <= 1.0e-14_wp*start%mass, 'mass')
      end do
      ! velocities stand half a step before the strain (usl, musl) or after it (usf)
      other = merge(-1, 1, codes(u) == update_usf)
      do step = 1, steps - 1
         energy(step) = strain(step) + 0.5_wp*(kinetic(step) + kinetic(step + other))
      end do
      print '(3x,a6,1x,a6,f8.2,4f11.5,es11.1)', updates(u), merge('affine', 'plain ', affine), flip, &
         minval(energy), maxval(energy), energy(steps - 1), maxval(strain), momentum
      call test%check(momentum <= 1.0e-13_wp, 'momentum')
      ! a quarter of the period is 8 cells at half a cell a step: after 16 steps, and 48, all is strain
      call test%check(maxval(strain(:32)) > 0.97_wp .and. abs(maxloc(strain(:32), dim=1) - 17) <= 1, &
                      name//': all motion turns into strain when it should')
      if (flip >= 1.0_wp) then
         call test%check(minval(energy) > 0.97_wp .and. maxval(energy) < 1.02_wp, name// &
                         ': FLIP keeps the energy within 3 %')
         kept = energy(steps - 1)
      else
         call test%check(maxval(energy) < 1.02_wp .and. energy(steps - 1) < kept .and. &
                         minval(energy) > 0.9_wp, name//': PIC takes some energy, and not much')
      end if
      call model%release()
   end subroutine vibrate

   function bar(update, flip, affine) result(scene)
      integer, intent(in) :: update
      real(wp), intent(in) :: flip
      logical, intent(in) :: affine
      type(scene_t) :: scene
      scene%title = 'bar'
      scene%end_time = 1.0_wp
      scene%grid = grid_spec_t(upper=cell*[24, 8, 8], cell_size=cell, cells=[24, 8, 8])
      scene%time%stress_update = update
      scene%time%flip_fraction = flip
      scene%time%affine = affine
      allocate (scene%materials(1), scene%bodies(1), scene%tools(0), scene%probes(0))
      scene%materials(1) = material_of('soft', 'elastic', density, young, 0.0_wp)
      scene%bodies(1)%name = 'bar'
      scene%bodies(1)%material = 1
      scene%bodies(1)%shape = box_t(lower=cell*[4, 3, 3], upper=cell*[20, 5, 5])
   end function bar

   !> The first mode of a free bar: v = speed cos(pi x/length).
   subroutine set_motion(model)
      type(model_t), intent(inout) :: model
      real(wp) :: x
      integer :: b, p
      do b = 1, size(model%levels(1)%blocks)
         associate (particles => model%levels(1)%blocks(b)%particles, at => model%levels(1)%layout)
            do p = 1, particles%count
               x = (particles%column(p, at%position) - 4.0_wp*cell)/length
               particles%column(p, at%velocity) = speed*cos(pi*x)
               if (at%gradient > 0) particles%column(p, at%gradient) = -speed*pi/length*sin(pi*x)
            end do
         end associate
      end do
   end subroutine set_motion

end program schemes
