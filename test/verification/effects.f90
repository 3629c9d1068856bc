!> Effects against exact answers: free fall, viscous decay, a bar and a column brought to rest, and what every
!> hook does.
!test: check
!test: ranks 1 2 4
!test: limit 120
program effects
   use m_kinds, only: wp, i8
   use m_constants, only: pi
   use m_errors, only: error_t
   use m_communicator, only: communicator_t
   use m_timers, only: phases
   use m_offer, only: catalogue_t, offered
   use m_box, only: box_t
   use m_scene, only: scene_t, grid_spec_t, update_usl, update_usf, update_musl
   use m_side_kinds, only: boundary_roller
   use m_materials, only: material_of
   use m_effect, only: effect_t, effect_slot_t
   use m_effects, only: known_effects
   use m_snapshot_formats, only: known_formats
   use m_gravity, only: gravity_t
   use m_damping, only: damping_t
   use m_model, only: model_t
   use m_advance, only: advance
   use m_inner_motion, only: inner_motion
   use m_energy, only: balance_t
   use m_assertions, only: assertions_t
   use m_chance, only: keep_worst, chance_of
   use m_test_effects, only: body_force_t, tile_force_t, rigid_t, counter_t
   implicit none
   integer, parameter :: viscous = 2, local = 1
   real(wp), parameter :: cell = 0.1_wp, density = 1000.0_wp, young = 1.0e6_wp, time_step = 0.3_wp*cell &
      /sqrt(1.4_wp*young/density)
   real(wp), parameter :: field(3) = [1.0_wp, -2.0_wp, -9.81_wp], start_velocity(3) = [1.3_wp, 2.2_wp, 0.7_wp]
   type(communicator_t) :: comm
   type(assertions_t) :: test
   call comm%start()
   call test%start(comm, 'effects')
   call free_fall(gravity_t(name='gravity', field=field), update_usl, 'gravity')
   call free_fall(gravity_t(name='gravity', field=field), update_usf, 'gravity, usf')
   call free_fall(gravity_t(name='gravity', field=field), update_musl, 'gravity, musl')
   call free_fall(body_force_t(name='body force', field=field), update_usl, 'the same as a body force')
   call free_fall(tile_force_t(name='tile force', field=field), update_usl, 'the same as forces on tiles')
   call viscous_decay()
   call noise_decays(.true., 'noise, affine')
   call noise_decays(.false., 'noise, plain')
   call turning_decays()
   call damping_that_drives()
   call bar_to_rest()
   call column_to_rest()
   call hooks_on_particles()
   call absent_is_free()
   call test%finish()

contains

   subroutine set_effects(model, first, second)
      type(model_t), intent(inout) :: model
      class(effect_t), intent(in) :: first
      class(effect_t), intent(in), optional :: second
      allocate (model%effects(merge(2, 1, present(second))))
      allocate (model%effects(1)%effect, source=first)
      if (present(second)) allocate (model%effects(2)%effect, source=second)
   end subroutine set_effects

   !> A box that flies free, over the borders of blocks.
   function flying(update) result(scene)
      integer, intent(in) :: update
      type(scene_t) :: scene
      scene%title = 'flying'
      scene%end_time = 1.0_wp
      scene%grid = grid_spec_t(upper=cell*[24, 24, 24], cell_size=cell, cells=[24, 24, 24])
      scene%time%stress_update = update
      allocate (scene%materials(1), scene%bodies(1), scene%tools(0), scene%probes(0))
      scene%materials(1) = material_of('soft', 'elastic', density, young, 0.3_wp)
      scene%bodies(1)%name = 'box'
      scene%bodies(1)%material = 1
      scene%bodies(1)%shape = box_t(lower=cell*[5, 4, 12], upper=cell*[11, 9, 16])
      scene%bodies(1)%velocity = start_velocity
   end function flying

   !> v = v0 + g n dt, x = x0 + n dt v0 + g dt^2 n (n+1)/2: every particle, momentum, and work.
   subroutine free_fall(effect, update, name)
      class(effect_t), intent(in) :: effect
      integer, intent(in) :: update
      character(len=*), intent(in) :: name
      integer, parameter :: steps = 220
      type(model_t) :: model
      type(error_t) :: error
      type(balance_t) :: balance
      real(wp) :: velocity(3), way(3), off(2), place(3), mass, gained
      integer :: step, b, p
      call set_effects(model, effect)
      call model%build(comm, flying(update), error)
      call balance%begin(model)
      do step = 1, steps
         call advance(model, time_step, error)
         if (mod(step, 50) == 0) call model%effect_step(1)%reduce_accumulated(comm)
      end do
      call test%check(.not. error%happened(), name//': goes on')
      if (error%happened()) return
      call balance%follow(model)
      velocity = start_velocity + field*steps*time_step
      way = steps*time_step*start_velocity + field*time_step**2*(0.5_wp*steps*(steps + 1))
      off = 0.0_wp
      do b = 1, size(model%levels(1)%blocks)
         associate (particles => model%levels(1)%blocks(b)%particles, at => model%levels(1)%layout)
            do p = 1, particles%count
               call keep_worst(off(1), &
                               maxval(abs(particles%column(p, at%velocity:at%velocity + 2) - velocity)) &
                               /norm2(velocity))
               ! of the lattice
               place = (particles%column(p, at%position:at%position + 2) - way)/(0.5_wp*cell) - 0.5_wp
               call keep_worst(off(2), maxval(abs(place - anint(place)))*0.5_wp*cell/norm2(way))
            end do
         end associate
      end do
      call test%check(norm2(way) > 4.0_wp*cell, name//': falls over several cells')
      call test%check_close(off, [0.0_wp, 0.0_wp], 1.0e-12_wp, name//': every particle falls as it must')
      mass = density*120*cell**3
      call test%check_close(balance%now%momentum, mass*velocity, 1.0e-12_wp*mass*norm2(velocity), name// &
                            ': momentum')
      gained = 0.5_wp*mass*(sum(velocity**2) - sum(start_velocity**2))
      call test%check_close(balance%external_work, gained, 1.0e-12_wp*balance%now%kinetic, name//': work')
      call test%check_close(balance%error(), 0.0_wp, 1.0e-12_wp, name//': energy balance')
      call test%check_close(balance%damped, 0.0_wp, 0.0_wp, name//': nothing is damped')
      call model%release()
   end subroutine free_fall

   !> v = v0 (1 - c dt)^n.
   subroutine viscous_decay()
      integer, parameter :: steps = 60
      real(wp), parameter :: coefficient = 20.0_wp
      type(model_t) :: model
      type(error_t) :: error
      type(balance_t) :: balance
      real(wp) :: velocity(3), off, mass
      integer :: step, b, p
      call set_effects(model, damping_t(name='damping', kind=viscous, coefficient=coefficient))
      call model%build(comm, flying(update_usl), error)
      call balance%begin(model)
      do step = 1, steps
         call advance(model, time_step, error)
      end do
      call test%check(.not. error%happened(), 'viscous: goes on')
      if (error%happened()) return
      call balance%follow(model)
      velocity = start_velocity*(1.0_wp - coefficient*time_step)**steps
      off = 0.0_wp
      do b = 1, size(model%levels(1)%blocks)
         associate (particles => model%levels(1)%blocks(b)%particles, at => model%levels(1)%layout)
            do p = 1, particles%count
               call keep_worst(off, &
                               maxval(abs(particles%column(p, at%velocity:at%velocity + 2) - velocity)) &
                               /norm2(start_velocity))
            end do
         end associate
      end do
      call test%check(norm2(velocity) < 0.5_wp*norm2(start_velocity), 'viscous: much is damped')
      call test%check_close(off, 0.0_wp, 1.0e-12_wp, 'viscous: every particle decays as it must')
      mass = density*120*cell**3
      call test%check_close(balance%damped, 0.5_wp*mass*(sum(start_velocity**2) - sum(velocity**2)), &
                            1.0e-12_wp*balance%start%kinetic, 'viscous: damped energy')
      call test%check_close(balance%error(), 0.0_wp, 1.0e-12_wp, 'viscous: energy balance')
      call test%check_close(balance%external_work, 0.0_wp, 0.0_wp, 'viscous: no external work')
      call model%release()
   end subroutine viscous_decay

   !> Every particle's velocity decays as v = v0 (1 - c dt)^n, also where it differs from its neighbours' by
   !> what nodes do not see, which else would stay for ever.
   subroutine noise_decays(affine, name)
      logical, intent(in) :: affine
      character(len=*), intent(in) :: name
      integer, parameter :: steps = 60
      real(wp), parameter :: coefficient = 20.0_wp
      type(model_t) :: model
      type(scene_t) :: scene
      type(error_t) :: error
      type(balance_t) :: balance
      real(wp) :: off, share, inner
      integer :: step, b, p, axis
      call set_effects(model, damping_t(name='damping', kind=viscous, coefficient=coefficient))
      scene = flying(update_usl)
      scene%materials(1) = material_of('without', 'elastic', density, 1.0e-18_wp*young, 0.3_wp)
      scene%time%affine = affine
      call model%build(comm, scene, error)
      do b = 1, size(model%levels(1)%blocks)
         associate (particles => model%levels(1)%blocks(b)%particles, at => model%levels(1)%layout)
            do p = 1, particles%count
               do axis = 1, 3
                  particles%column(p, at%velocity + axis - 1) = noise(int(particles%id(p)), axis)
               end do
            end do
         end associate
      end do
      call balance%begin(model)
      do step = 1, steps
         call advance(model, time_step, error)
      end do
      call test%check(.not. error%happened(), name//': goes on')
      if (error%happened()) return
      call balance%follow(model)
      share = (1.0_wp - coefficient*time_step)**steps
      off = 0.0_wp
      do b = 1, size(model%levels(1)%blocks)
         associate (particles => model%levels(1)%blocks(b)%particles, at => model%levels(1)%layout)
            do p = 1, particles%count
               do axis = 1, 3
                  call keep_worst(off, abs(particles%column(p, at%velocity + axis - 1) &
                                           - share*noise(int(particles%id(p)), axis)))
               end do
            end do
         end associate
      end do
      call test%check(share < 0.5_wp, name//': much is damped')
      call test%check_close(off, 0.0_wp, 1.0e-12_wp, name//': every particle decays as it must') ! m/s
      inner = inner_energy(model)
      call test%check_close(balance%now%kinetic - inner, share**2*balance%start%kinetic, &
                            1.0e-12_wp*balance%start%kinetic, name//': energy')
      call test%check(inner < 0.02_wp*balance%now%kinetic, name//': what nodes make of noise is little')
      ! of first order in c dt
      if (.not. affine) call test%check_close(balance%error(), 0.0_wp, 0.01_wp, name//': energy balance')
      if (comm%is_root()) print '(3x,a,5es11.3)', name// &
         ': kinetic energy at the start and at the end, that within particles, '// &
         'damped, balance error / J', balance%start%kinetic, balance%now%kinetic, inner, balance%damped, &
         balance%excess()
      call model%release()
   end subroutine noise_decays

   !> A box that turns so slowly that it hardly moves: its velocity is a linear field, all of it decays as (1
   !> - c dt)^n, that within particles too. Nodes have what lumping adds (theory.md, eq. inner-motion): with
   !> halves of a cell on a lattice along the grid they see 3/16 h^2 of each particle along an axis, where its
   !> domain has 1/48 h^2. It is damped and booked as the rest.
   subroutine turning_decays()
      integer, parameter :: steps = 60
      real(wp), parameter :: coefficient = 20.0_wp, lumped = 9.0_wp
      type(model_t) :: model
      type(scene_t) :: scene
      type(error_t) :: error
      type(balance_t) :: balance
      real(wp) :: share, inner
      integer :: step
      call set_effects(model, damping_t(name='damping', kind=viscous, coefficient=coefficient))
      scene = flying(update_usl)
      scene%materials(1) = material_of('without', 'elastic', density, 1.0e-18_wp*young, 0.3_wp)
      scene%bodies(1)%velocity = 0.0_wp
      scene%bodies(1)%angular_velocity = 1.0e-8_wp*[3.0_wp, -4.0_wp, 5.0_wp]
      call model%build(comm, scene, error)
      call balance%begin(model)
      inner = inner_energy(model)
      do step = 1, steps
         call advance(model, time_step, error)
      end do
      call test%check(.not. error%happened(), 'turning: goes on')
      if (error%happened()) return
      call balance%follow(model)
      share = (1.0_wp - coefficient*time_step)**steps
      call test%check_close([balance%now%kinetic, inner_energy(model)], &
                            share**2*[balance%start%kinetic, inner], 1.0e-6_wp*inner, &
                            'turning: energy, and that within particles')
      call test%check_close(balance%damped, (1.0_wp - share**2)*(balance%start%kinetic &
         + (lumped - 1.0_wp)*inner), 1.0e-6_wp*inner, 'turning: damped is what nodes had')
      call model%release()
   end subroutine turning_decays

   !> Kinetic energy within particles of all ranks, J.
   real(wp) function inner_energy(model) result(energy)
      type(model_t), intent(in) :: model
      real(wp) :: kinetic, angular(3)
      integer :: b
      energy = 0.0_wp
      do b = 1, size(model%levels(1)%blocks)
         associate (particles => model%levels(1)%blocks(b)%particles)
            if (particles%count == 0) cycle
            call inner_motion(particles%column, 1, particles%count, model%levels(1)%layout, kinetic, angular)
            energy = energy + kinetic
         end associate
      end do
      energy = comm%sum_real(energy)
   end function inner_energy

   pure real(wp) function noise(id, axis)
      integer, intent(in) :: id, axis
      noise = chance_of(int(id, i8), axis) - 0.5_wp ! m/s
   end function noise

   !> v = v0 (1 - c dt)^n with c dt = 2.4, which a scene may not have: what damping has put in is energy from
   !> nowhere.
   subroutine damping_that_drives()
      integer, parameter :: steps = 6
      type(model_t) :: model
      type(error_t) :: error
      type(balance_t) :: balance, seen
      integer :: step
      call set_effects(model, damping_t(name='damping', kind=viscous, coefficient=2.4_wp/time_step))
      call model%build(comm, flying(update_usl), error)
      call balance%begin(model)
      do step = 1, steps
         call advance(model, time_step, error)
      end do
      seen = balance%glance(model)
      call balance%follow(model)
      call test%check_close(balance%now%kinetic, 1.4_wp**(2*steps)*balance%start%kinetic, &
                            1.0e-12_wp*balance%now%kinetic, 'driven: kinetic energy')
      call test%check_close(seen%excess(), balance%now%kinetic - balance%start%kinetic, &
                            1.0e-12_wp*balance%now%kinetic, 'driven: a glance sees what came from nowhere')
      call test%check_close(balance%excess(), seen%excess(), 1.0e-12_wp*balance%now%kinetic, &
                            'driven: so does the balance')
      call test%check(balance%error() > 0.9_wp, 'driven: which is off')
      call model%release()
   end subroutine damping_that_drives

   !> A bar along z of 2 x 2 x `high` cells, without cross contraction.
   function bar(high, on_roller) result(scene)
      integer, intent(in) :: high
      logical, intent(in) :: on_roller
      type(scene_t) :: scene
      scene%title = 'bar'
      scene%end_time = 1.0_wp
      scene%grid = grid_spec_t(upper=cell*[8, 8, 24], cell_size=cell, cells=[8, 8, 24])
      if (on_roller) scene%grid%boundary(5) = boundary_roller
      allocate (scene%materials(1), scene%bodies(1), scene%tools(0), scene%probes(0))
      scene%materials(1) = material_of('soft', 'elastic', density, young, 0.0_wp)
      scene%bodies(1)%name = 'bar'
      scene%bodies(1)%material = 1
      scene%bodies(1)%shape = box_t(lower=cell*[3, 3, merge(0, 4, on_roller)], &
                                    upper=cell*[5, 5, merge(0, 4, on_roller) + high])
   end function bar

   !> A bar that rings in its first mode: local damping takes all of its energy, and the balance knows where
   !> it went.
   subroutine bar_to_rest()
      integer, parameter :: high = 16, steps = 1500
      real(wp), parameter :: speed = 0.1_wp
      type(model_t) :: model
      type(error_t) :: error
      type(balance_t) :: balance
      real(wp) :: z
      integer :: step, b, p
      call set_effects(model, damping_t(name='damping', kind=local, coefficient=0.4_wp))
      call model%build(comm, bar(high, on_roller=.false.), error)
      do b = 1, size(model%levels(1)%blocks)
         associate (particles => model%levels(1)%blocks(b)%particles, at => model%levels(1)%layout)
            do p = 1, particles%count
               z = (particles%column(p, at%position + 2)/cell - 4.0_wp)/high
               particles%column(p, at%velocity + 2) = speed*cos(pi*z)
               particles%column(p, at%gradient + 8) = -speed*pi/(high*cell)*sin(pi*z)
            end do
         end associate
      end do
      call balance%begin(model)
      do step = 1, steps
         call advance(model, time_step, error)
         if (error%happened()) exit
      end do
      call test%check(.not. error%happened(), 'local: goes on')
      if (error%happened()) return
      call balance%follow(model)
      if (comm%is_root()) print '(3x,a,4es11.3)', 'bar: start, kinetic, strain, damped / J', &
         balance%start%kinetic, balance%now%kinetic, balance%now%strain, balance%damped
      call test%check(balance%now%kinetic + balance%now%strain < 1.0e-4_wp*balance%start%kinetic, &
                      'local: the bar comes to rest')
      call test%check(balance%damped > 0.95_wp*balance%start%kinetic, 'local: most energy was damped')
      call test%check_close(balance%error(), 0.0_wp, 0.03_wp, 'local: energy balance')
      call model%release()
   end subroutine bar_to_rest

   !> A column on a roller under its weight. At rest gravity has done the work (density g)^2 H^3 A/(3 E); half
   !> of it is strain energy, half was damped. What holds the column does no work.
   subroutine column_to_rest()
      integer, parameter :: high = 16, steps = 2500
      real(wp), parameter :: weight = 2.0_wp, height = high*cell
      type(model_t) :: model
      type(error_t) :: error
      type(balance_t) :: balance
      real(wp) :: work
      integer :: step
      call set_effects(model, gravity_t(name='gravity', field=[0.0_wp, 0.0_wp, -weight]), &
                       damping_t(name='damping', kind=viscous, coefficient=30.0_wp))
      call model%build(comm, bar(high, on_roller=.true.), error)
      call balance%begin(model)
      do step = 1, steps
         call advance(model, time_step, error)
         if (error%happened()) exit
      end do
      call test%check(.not. error%happened(), 'column: goes on')
      if (error%happened()) return
      call balance%follow(model)
      work = (density*weight)**2*height**3*(2.0_wp*cell)**2/(3.0_wp*young)
      if (comm%is_root()) print '(3x,a,4f9.5)', &
         'column: external, strain, damped, error over the exact work', &
         [balance%external_work, balance%now%strain, balance%damped, balance%excess()]/work
      call test%check(balance%now%kinetic < 1.0e-6_wp*work, 'column: comes to rest')
      call test%check_close([balance%external_work, balance%now%strain, balance%damped]/work, &
                            [1.0_wp, 0.5_wp, 0.5_wp], 0.02_wp, 'column: work and where it went')
      call test%check_close(balance%error(), 0.0_wp, 0.02_wp, 'column: energy balance')
      call model%release()
   end subroutine column_to_rest

   !> What changes gradient and stress: a turning block whose effect makes it rigid has no stress; a counter
   !> counts.
   subroutine hooks_on_particles()
      integer, parameter :: steps = 7
      type(model_t) :: model
      type(scene_t) :: scene
      type(error_t) :: error
      real(wp) :: largest, off
      integer :: step, b, c
      scene = flying(update_usl)
      scene%bodies(1)%angular_velocity = [0.0_wp, 3.0_wp, 5.0_wp]
      call set_effects(model, rigid_t(name='rigid'), counter_t(name='counter'))
      call model%build(comm, scene, error)
      do step = 1, steps
         call advance(model, time_step, error)
      end do
      call test%check(.not. error%happened(), 'hooks: goes on')
      c = model%levels(1)%table%column('count_of_the_tests')
      largest = 0.0_wp
      off = 0.0_wp
      do b = 1, size(model%levels(1)%blocks)
         associate (particles => model%levels(1)%blocks(b)%particles, at => model%levels(1)%layout)
            if (particles%count == 0) cycle
            largest = max(largest, maxval(abs(particles%column(:particles%count, at%stress:at%stress + 5))))
            call keep_worst(off, maxval(abs(particles%column(:particles%count, c) - (5.0_wp + steps))))
            call test%check(maxval(abs(particles%column(:particles%count, at%gradient:at%gradient + 8))) > &
                            1.0_wp, 'hooks: the gradient for the transfer is kept')
         end associate
      end do
      call test%check_close(largest, 0.0_wp, 0.0_wp, 'hooks: no gradient, no stress')
      call test%check_close(off, 0.0_wp, 0.0_wp, 'hooks: counted from where it began')
      call test%check_equal(model%effects(1)%columns, 0, 'hooks: columns of none')
      call test%check_equal(model%effects(2)%columns, 1, 'hooks: columns of one')
      call test%check_equal(size(model%timers%names), phases + 2, 'hooks: a row each')
      call test%check_equal(comm%sum_count(model%timers%calls(model%effects(1)%row)), &
                            7_8*comm%sum_count(int(size( &
                            model%levels(1)%blocks), 8)), 'hooks: called once a block and step')
      call model%release()
   end subroutine hooks_on_particles

   !> A scene without effects has no rows, no lists and no fields of theirs; the catalogue's names are what
   !> scenes say.
   subroutine absent_is_free()
      type(model_t) :: model
      type(error_t) :: error
      type(catalogue_t) :: catalogue
      call known_effects(catalogue)
      call known_formats(catalogue)
      call test%check(offered(catalogue%effects, 'gravity') > 0 .and. &
                      offered(catalogue%effects, 'damping') > 0, 'absent: the catalogue')
      call model%build(comm, flying(update_usl), error)
      call advance(model, time_step, error)
      call test%check(.not. error%happened(), 'absent: goes on')
      call test%check_equal(size(model%effects), 0, 'absent: no effects')
      call test%check_equal(size(model%timers%names), phases, 'absent: no rows')
      call test%check_equal(model%levels(1)%table%columns, 24, 'absent: no fields')
      call test%check(.not. model%effect_step(1)%acts_on_nodes, 'absent: no work')
      call model%release()
   end subroutine absent_is_free

end program effects
