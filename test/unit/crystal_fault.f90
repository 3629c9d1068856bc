!test: ranks 1 2
!> A crystal whose slip cannot be found is a fault that names the particle and that smaller steps may heal.
program crystal_fault
   use m_kinds, only: wp
   use m_errors, only: error_t
   use m_communicator, only: communicator_t
   use m_box, only: box_t
   use m_scene, only: scene_t
   use m_model, only: model_t
   use m_advance, only: advance
   use m_speed_bounds, only: bound_speeds
   use m_text, only: to_text
   use m_assertions, only: assertions_t
   use m_point, only: law_of
   implicit none
   real(wp), parameter :: cell = 1.0e-3_wp, step = 1.0e-8_wp
   type(communicator_t) :: comm
   type(assertions_t) :: test
   type(scene_t) :: scene
   type(model_t) :: model
   type(error_t) :: error
   integer :: b, p, r
   call comm%start()
   call test%start(comm, 'crystal_fault')
   scene%title = 'block'
   scene%grid%cells = 10
   scene%grid%upper = 10.0_wp*cell
   scene%grid%cell_size = cell
   allocate (scene%materials(1), scene%bodies(1), scene%tools(0), scene%probes(0))
   scene%materials(1)%name = 'copper'
   scene%materials(1)%density = 8960.0_wp
   allocate (scene%materials(1)%law, &
             source=law_of('crystal', 'c11=170e9, c12=124e9, c44=75e9, reference_rate=1, '// &
                                                   'rate_sensitivity=0.02, tau0=16e6, tau_s=60e6, '// &
                                                   'h0=300e6, q=1.4'))
   scene%bodies(1)%name = 'block'
   scene%bodies(1)%material = 1
   scene%bodies(1)%shape = box_t(lower=[2.0_wp, 2.0_wp, 2.0_wp]*cell, upper=[7.0_wp, 7.0_wp, 7.0_wp]*cell)
   scene%bodies(1)%angular_velocity = [0.0_wp, 0.0_wp, 1.0e4_wp]
   call model%build(comm, scene, error)
   call test%check(.not. error%happened(), 'a model is built')
   call bound_speeds(model)
   call advance(model, step, error)
   call test%check(.not. error%happened(), 'a step')
   r = model%levels(1)%table%column('slip_resistance')
   do b = 1, size(model%levels(1)%blocks)
      associate (particles => model%levels(1)%blocks(b)%particles)
         do p = 1, particles%count
            if (particles%id(p) == 17) particles%column(p, r:r + 11) = 1.0e-3_wp ! no metal has that
         end do
      end associate
   end do
   call advance(model, step, error)
   call comm%agree(error)
   call test%check(error%happened() .and. error%recoverable, 'a fault that smaller steps may heal')
   if (error%happened()) then
      call test%check(index(error%message, 'particle '//to_text(17)//' of body 1') > 0, &
                      'names the particle', error%message)
      call test%check(index(error%message, 'the local solve for the slip rates did not converge') > 0, &
                      'says why', &
                      error%message)
      if (comm%is_root()) print '(3x,a)', error%message
   end if
   call model%release()
   call test%finish()
end program crystal_fault
