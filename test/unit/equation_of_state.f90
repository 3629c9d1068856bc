!> mie_grueneisen, one particle: the Hugoniot curve, the isentrope, tension, the speed of sound, energy,
!> strength beside it.
program equation_of_state
   use m_kinds, only: wp
   use m_communicator, only: communicator_t
   use m_mie_grueneisen, only: mie_grueneisen_t
   use m_material_point, only: material_point_t, read_law
   use m_assertions, only: assertions_t
   use m_chance, only: say
   implicit none
   real(wp), parameter :: density = 8930.0_wp, c0 = 3940.0_wp, s = 1.489_wp, gamma = 1.99_wp
   character(len=*), parameter :: copper = 'sound_speed=3940, hugoniot_slope=1.489, grueneisen=1.99'
   character(len=*), parameter :: strength = ', young=124e9, poisson=0.34, yield_stress=200e6, '// &
      'hardening_modulus=1e9'
   character(len=*), parameter :: cook = ', young=124e9, poisson=0.34, yield_stress=90e6, '// &
      'hardening_modulus=292e6, '// &
                                  'hardening_exponent=0.31, rate_coefficient=0.025, '// &
                                  'thermal_exponent=1.09, melting_temperature=1356, specific_heat=383'
   type(communicator_t) :: comm
   type(assertions_t) :: test
   call comm%start()
   call test%start(comm, 'equation_of_state')
   call hugoniot()
   call isentrope()
   call sound()
   call of_two()
   call with_strength()
   call temperature()
   call all_laws_do()
   call refusals()
   call test%finish()

contains

   subroutine law_of(law, text)
      type(mie_grueneisen_t), intent(out) :: law
      character(len=*), intent(in) :: text
      character(len=:), allocatable :: complaint
      call read_law(law, text, complaint)
      call test%check(complaint == '', 'read', complaint)
   end subroutine law_of

   pure real(wp) function pressure(point)
      type(material_point_t), intent(in) :: point
      associate (a => point%layout%stress)
         pressure = -(point%column(1, a) + point%column(1, a + 1) + point%column(1, a + 2))/3.0_wp
      end associate
   end function pressure

   !> One step to a compression is a shock: its work is that of the mean pressure, so that p = rho0 Us up and
   !> e = up^2/2.
   subroutine hugoniot()
      type(mie_grueneisen_t) :: law
      type(material_point_t) :: point
      real(wp), parameter :: speeds(4) = [100.0_wp, 500.0_wp, 1000.0_wp, 3000.0_wp]
      real(wp) :: shock, m(3, 3), off(2)
      integer :: k
      call law_of(law, copper)
      off = 0.0_wp
      do k = 1, size(speeds)
         shock = c0 + s*speeds(k)
         call point%ready(law, density)
         m = 0.0_wp
         m(1, 1) = -speeds(k)/shock
         call point%strain_by(law, m, 1.0_wp)
         off = max(off, abs([pressure(point)/(density*shock*speeds(k)), &
               point%field('internal_energy')/(0.5_wp*speeds(k)**2)] - 1.0_wp))
      end do
      call say('Hugoniot curve of copper, 100 to 3000 m/s: pressure, relative error', off(1))
      call say('the same: energy', off(2))
      call test%check_close(off, [0.0_wp, 0.0_wp], 1.0e-12_wp, 'a jump is on the Hugoniot curve')
   end subroutine hugoniot

   !> Slowly there and back: nothing is left; on the way the energy is the integral of p, and p that of dp/de
   !> and dp/deta.
   subroutine isentrope()
      type(mie_grueneisen_t) :: law
      type(material_point_t) :: point
      real(wp) :: e, eta, p, h, k(4)
      integer :: n, stage
      integer, parameter :: steps = 2000
      real(wp), parameter :: most = 0.2_wp, weight(4) = [1.0_wp, 2.0_wp, 2.0_wp, 1.0_wp]/6.0_wp, &
         at(4) = [0.0_wp, 0.5_wp, 0.5_wp, 1.0_wp]
      call law_of(law, copper)
      call point%ready(law, density)
      call point%stretch_by(law, log(1.0_wp - most)*[1.0_wp, 0.0_wp, 0.0_wp], steps, 1.0_wp)
      e = 0.0_wp
      h = most/steps
      do n = 1, steps ! Runge and Kutta: de/deta = p/rho0
         do stage = 1, 4
            eta = (n - 1 + at(stage))*h
            p = e
            if (stage > 1) p = e + at(stage)*h*k(stage - 1)
            k(stage) = (density*c0**2*eta*(1.0_wp - 0.5_wp*gamma*eta)/(1.0_wp - s*eta)**2 + gamma*density*p) &
                       /density
         end do
         e = e + h*sum(weight*k)
      end do
      call say('isentrope to eta = 0.2, 2000 steps: energy, relative error', &
               point%field('internal_energy')/e - 1.0_wp)
      call test%check_close(point%field('internal_energy')/e, 1.0_wp, 1.0e-5_wp, 'isentrope')
      call test%check_close(law%strain_energy(point%column, point%layout, 1, 1)/(density*e), 1.0_wp, &
                            1.0e-5_wp, 'its energy')
      call point%stretch_by(law, -log(1.0_wp - most)*[0.0_wp, 1.0_wp, 0.0_wp], steps, 1.0_wp)
      call test%check_close([pressure(point)/(density*c0**2), point%field('internal_energy')/e], &
                            [0.0_wp, 0.0_wp], 1.0e-6_wp, 'there and back nothing is left')
      call point%stretch_by(law, [1.0e-3_wp, 0.0_wp, 0.0_wp], 10, 1.0_wp)
      call test%check_close(-pressure(point)/(density*c0**2*1.0e-3_wp), 1.0_wp, 3.0e-3_wp, 'tension')
   end subroutine isentrope

   !> The modulus of waves against the change of pressure in a small step, compressed, hot and in tension.
   subroutine sound()
      type(mie_grueneisen_t) :: law
      type(material_point_t) :: point
      real(wp), parameter :: changes(3) = [-0.1_wp, -0.25_wp, 0.01_wp]
      real(wp) :: before, modulus, off, h, m(3, 3)
      integer :: k
      call law_of(law, copper)
      off = 0.0_wp
      do k = 1, 3
         call point%ready(law, density)
         m = 0.0_wp
         m(1, 1) = changes(k)
         call point%strain_by(law, m, 1.0_wp)
         modulus = modulus_of(law, point)
         before = pressure(point)
         h = 1.0e-6_wp
         m(1, 1) = -h
         call point%strain_by(law, m, 1.0_wp)
         off = max(off, abs((pressure(point) - before)/h/modulus - 1.0_wp))
      end do
      call say('modulus of waves, by a small step: relative error', off)
      call test%check_close(off, 0.0_wp, 1.0e-5_wp, 'speed of sound')
      call point%ready(law, density)
      call test%check_close(modulus_of(law, point)/law%p_wave_modulus(), &
                            1.0_wp, 1.0e-14_wp, 'at first it is that of the start')
   end subroutine sound

   !> Modulus of waves in a point of one particle.
   pure real(wp) function modulus_of(law, point)
      type(mie_grueneisen_t), intent(in) :: law
      type(material_point_t), intent(in) :: point
      modulus_of = law%squared_speed(point%column, point%layout, 1, 1, 0.0_wp)*point%column(1, &
         point%layout%mass)/point%column(1, point%layout%volume)
   end function modulus_of

   !> The fastest wave in two particles, one compressed and one expanded, is the faster one of the two.
   subroutine of_two()
      type(mie_grueneisen_t) :: law
      type(material_point_t) :: both
      real(wp) :: speeds(2), volumes(2)
      call law_of(law, copper//", strength='j2'"//strength)
      call both%ready(law, density, 2)
      both%gradient(:, 1) = [-0.1_wp, 0.02_wp]
      call law%update(both%column, both%layout, both%gradient, 1.0_wp, 1, 2)
      both%column(:, both%layout%volume) = both%column(:, both%layout%volume)*(1.0_wp + both%gradient(:, 1))
      volumes = both%column(:, both%layout%volume)/both%column(:, both%layout%mass)
      speeds = [law%squared_speed(both%column, both%layout, 1, 1, volumes(1)), &
                law%squared_speed(both%column, both%layout, 2, 2, volumes(2))]
      call test%check_close(law%squared_speed(both%column, both%layout, 1, 2, maxval(volumes)) &
                            /maxval(speeds), 1.0_wp, 1.0e-14_wp, 'the faster of two particles')
   end subroutine of_two

   !> The deviator is that of the law of strength, the pressure that without it but for the heat of flow.
   subroutine with_strength()
      type(mie_grueneisen_t) :: law, fluid
      type(material_point_t) :: point, alone
      real(wp) :: heat
      call law_of(fluid, copper)
      call alone%ready(fluid, density)
      call alone%stretch_by(fluid, [-0.05_wp, 0.0_wp, 0.0_wp], 200, 1.0e-5_wp)
      call law_of(law, copper//", strength='j2'"//strength)
      call point%ready(law, density)
      call point%stretch_by(law, [-0.05_wp, 0.0_wp, 0.0_wp], 200, 1.0e-5_wp)
      call test%check_close(point%mises(1)/(200.0e6_wp + 1.0e9_wp*point%field('plastic_strain')), 1.0_wp, &
                            1.0e-10_wp, 'the deviator is on the yield surface')
      heat = law%plastic_energy(point%column, 1, 1)
      call test%check(heat > 1.0e6_wp, 'it flows')
      call test%check_close((pressure(point) - pressure(alone))/(gamma*heat), 1.0_wp, 0.1_wp, &
                            'plastic work heats')
      call test%check_close((law%plastic_energy(point%column, 1, 1) &
                             + law%strain_energy(point%column, point%layout, 1, 1)) &
                            /point%work, 1.0_wp, 2.0e-3_wp, 'work is stored or dissipated')
      call law_of(law, copper//", strength='j2'"//strength//', kinematic_modulus=20e9')
      call point%ready(law, density)
      call point%stretch_by(law, [-0.05_wp, 0.0_wp, 0.0_wp], 200, 1.0e-5_wp)
      call test%check_close((law%plastic_energy(point%column, 1, 1) &
                             + law%strain_energy(point%column, point%layout, 1, 1)) &
                            /point%work, 1.0_wp, 2.0e-3_wp, 'also in back stresses')
      call law_of(law, copper//", strength='johnson_cook'"//cook)
      call point%ready(law, density)
      call point%stretch_by(law, [-0.05_wp, 0.0_wp, 0.0_wp], 200, 1.0e-5_wp)
      call test%check(point%field('temperature') > 294.0_wp, 'with Johnson and Cook''s it warms')
   end subroutine with_strength

   !> Along the isentrope T = T0 exp(Gamma0 eta), there and back.
   subroutine temperature()
      type(mie_grueneisen_t) :: law
      type(material_point_t) :: point
      real(wp), parameter :: eta = 0.2_wp
      call law_of(law, copper//", strength='johnson_cook', young=124e9, poisson=0.34, yield_stress=1, "// &
                       'hardening_modulus=0, hardening_exponent=1, rate_coefficient=0, '// &
                       'thermal_exponent=1, room_temperature=294, melting_temperature=1356, '// &
                       'specific_heat=383')
      call point%ready(law, density)
      call point%stretch_by(law, log(1.0_wp - eta)/3.0_wp*[1.0_wp, 1.0_wp, 1.0_wp], 2000, 1.0_wp)
      call test%check_close(point%field('temperature')/(294.0_wp*exp(gamma*eta)), 1.0_wp, 1.0e-6_wp, &
                            'compression warms')
      call point%stretch_by(law, -log(1.0_wp - eta)/3.0_wp*[1.0_wp, 1.0_wp, 1.0_wp], 2000, 1.0_wp)
      call test%check_close(point%field('temperature')/294.0_wp, 1.0_wp, 1.0e-6_wp, 'and release cools')
   end subroutine temperature

   subroutine all_laws_do()
      type(mie_grueneisen_t) :: law
      type(material_point_t) :: point
      call law_of(law, copper//", strength='j2'"//strength)
      call point%follows_turns(law, density, 0.01_wp, 1.0_wp, 'mie_grueneisen', test)
      call point%dissipates(law, density, 10000, 1.0_wp, 'mie_grueneisen', test)
   end subroutine all_laws_do

   subroutine refusals()
      type(mie_grueneisen_t) :: law
      character(len=:), allocatable :: complaint
      call read_law(law, 'sound_speed=3940, hugoniot_slope=1.489', complaint)
      call test%check(index(complaint, 'grueneisen: missing') > 0, 'grueneisen is required', complaint)
      law = mie_grueneisen_t()
      call read_law(law, copper//", strength='j3'", complaint)
      call test%check(index(complaint, 'strength=''j3'': unknown strength') > 0, 'unknown strength', &
                      complaint)
      law = mie_grueneisen_t()
      call read_law(law, copper//", strength='j2', young=1e9", complaint)
      call test%check(index(complaint, 'missing') > 0, 'strength needs its constants', complaint)
   end subroutine refusals

end program equation_of_state
