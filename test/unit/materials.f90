!> Material laws against closed forms: turning, small strains, large strains, and that the stress is what the
!> energy says; and laws whose columns do not tell how thick a particle is say so.
program materials
   use m_kinds, only: wp
   use m_constants, only: pi
   use m_communicator, only: communicator_t
   use m_scene, only: scene_t
   use m_field_table, only: field_table_t, layout_t
   use m_isotropic, only: isotropic_t
   use m_material, only: material_t
   use m_maxwell, only: maxwell_t
   use m_drucker_prager, only: drucker_prager_t
   use m_mie_grueneisen, only: mie_grueneisen_t
   use m_j2, only: j2_t
   use m_materials, only: material_of
   use m_scene_materials, only: materials_t, make_materials
   use m_deform, only: advance_volume, fastest
   use m_assertions, only: assertions_t
   use m_chance, only: chance_t, keep_worst, say
   implicit none
   real(wp), parameter :: young = 70.0e9_wp, poisson = 0.33_wp
   real(wp), parameter :: shear = young/(2.0_wp*(1.0_wp + poisson)), &
      bulk = young/(3.0_wp*(1.0_wp - 2.0_wp*poisson))
   real(wp), parameter :: lame = bulk - 2.0_wp*shear/3.0_wp
   integer, parameter :: n = 19, elastic = 1, neo_hookean = 2
   type(communicator_t) :: comm
   type(assertions_t) :: test
   type(chance_t) :: chance
   type(materials_t) :: laws
   type(layout_t) :: layout
   real(wp), allocatable :: column(:, :), gradient(:, :)
   call comm%start()
   call test%start(comm, 'materials')
   call make_laws()
   call moduli()
   call turning_alone()
   call turning_elastic()
   call turning_neo_hookean()
   call small_strain(elastic)
   call small_strain(neo_hookean)
   call closed_forms()
   call stress_power_neo_hookean()
   call stress_power_elastic()
   call volumes()
   call only_its_own()
   call thickness()
   call test%finish()

contains

   subroutine make_laws()
      type(scene_t) :: scene
      type(field_table_t) :: table
      allocate (scene%bodies(0), scene%materials(2), scene%tools(0), scene%probes(0))
      scene%materials(1) = material_of('one', 'elastic', 2710.0_wp, young, poisson)
      scene%materials(2) = material_of('two', 'neo_hookean', 2710.0_wp, young, poisson)
      laws = make_materials(scene)
      call declare_usual(table)
      call laws%slots(elastic)%law%declare(table, has_tools=.false.)
      call test%check_equal(table%columns, 11, 'the elastic law needs no field of its own')
      call laws%slots(neo_hookean)%law%declare(table, has_tools=.false.)
      call test%check_equal(table%column('deformation_gradient'), 12, &
                            'the neo-Hookean law has a deformation gradient')
      layout = table%layout()
      allocate (column(n, table%columns), gradient(n, 9))
   end subroutine make_laws

   !> The fields of every level.
   subroutine declare_usual(table)
      type(field_table_t), intent(inout) :: table
      call table%declare('mass', 1, 'kg', .true.)
      call table%declare('volume', 1, 'm3', .true.)
      call table%declare('stress', 6, 'Pa', .true.)
      call table%declare('velocity', 3, 'm/s', .true.)
   end subroutine declare_usual

   !> Undeformed, with volumes of about 1.
   subroutine reset()
      column = 0.0_wp
      call laws%slots(neo_hookean)%law%initial(column, layout, 1, n)
      column(:, layout%volume) = chance%several(n, 0.5_wp, 1.5_wp)
      column(:, layout%mass) = 1.0_wp
   end subroutine reset

   pure function tensor(p) result(sigma)
      integer, intent(in) :: p
      real(wp) :: sigma(3, 3)
      associate (s => column(p, layout%stress:layout%stress + 5))
         sigma = reshape([s(1), s(6), s(5), s(6), s(2), s(4), s(5), s(4), s(3)], [3, 3])
      end associate
   end function tensor

   pure function invariants(p) result(three)
      integer, intent(in) :: p
      real(wp) :: three(3), s(3, 3)
      s = tensor(p)
      three = [s(1, 1) + s(2, 2) + s(3, 3), sum(s*s)/2.0_wp, sum(matmul(s, s)*s)/3.0_wp]
   end function invariants

   pure function identity()
      real(wp) :: identity(3, 3)
      identity = 0.0_wp
      identity(1, 1) = 1.0_wp
      identity(2, 2) = 1.0_wp
      identity(3, 3) = 1.0_wp
   end function identity

   !> Rotation about an axis (Rodrigues).
   pure function rotation(axis, angle) result(r)
      real(wp), intent(in) :: axis(3), angle
      real(wp) :: r(3, 3), u(3), w(3, 3)
      u = axis/norm2(axis)
      w = reshape([0.0_wp, u(3), -u(2), -u(3), 0.0_wp, u(1), u(2), -u(1), 0.0_wp], [3, 3])
      r = identity() + sin(angle)*w + 2.0_wp*sin(0.5_wp*angle)**2*matmul(w, w)
   end function rotation

   !> One step with the increment A = dt L, for every particle.
   subroutine step(law, increment, dt)
      integer, intent(in) :: law
      real(wp), intent(in) :: increment(3, 3), dt
      real(wp) :: smallest
      integer :: p
      do p = 1, n
         gradient(p, :) = reshape(increment/dt, [9])
      end do
      call laws%slots(law)%law%update(column, layout, gradient, dt, 1, n)
      call advance_volume(n, gradient, dt, column(:, layout%volume), smallest)
   end subroutine step

   subroutine moduli()
      real(wp), parameter :: pull(6) = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
      real(wp), parameter :: slip(6) = [0.0_wp, 0.0_wp, 0.0_wp, sqrt(1.0_wp/3.0_wp), 0.0_wp, 0.0_wp]
      select type (law => laws%slots(1)%law)
      class is (isotropic_t)
         call test%check_close([law%lame, law%shear]/young, [lame, shear]/young, 1.0e-14_wp, &
                               'Lame''s constants from Young''s modulus and Poisson''s ratio')
         call test%check_close(law%von_mises_modulus(), 0.5_wp/law%complementary_energy(slip), &
                               1.0e-14_wp*young, 'von Mises modulus and energy of shear')
      end select
      call test%check_close(laws%slots(1)%law%p_wave_modulus()/young, (lame + 2.0_wp*shear)/young, &
                            1.0e-14_wp, 'modulus of a plane wave')
      call test%check_close(laws%slots(1)%law%complementary_energy(3.0_wp*pull)*young, 4.5_wp, 1.0e-14_wp, &
                            'energy of a pull')
   end subroutine moduli

   !> The turning part alone (a law without stiffness): 10 turns about a skew axis change no invariant.
   subroutine turning_alone()
      real(wp) :: before(3, n), drift, lame_was, shear_was
      integer, parameter :: steps = 1000
      integer :: p, t
      call reset()
      do p = 1, n
         column(p, layout%stress:layout%stress + 5) = chance%several(6, -1.0e8_wp, 1.0e8_wp)
         before(:, p) = invariants(p)
      end do
      select type (law => laws%slots(elastic)%law)
      class is (isotropic_t)
         lame_was = law%lame
         shear_was = law%shear
         law%lame = 0.0_wp
         law%shear = 0.0_wp
         do t = 1, steps
            call step(elastic, rotation([1.0_wp, -2.0_wp, 0.5_wp], 20.0_wp*pi/steps) - identity(), 1.0e-6_wp)
         end do
         law%lame = lame_was
         law%shear = shear_was
      end select
      drift = 0.0_wp
      do p = 1, n
         call keep_worst(drift, maxval(abs(invariants(p) - before(:, p))/[1.0e8_wp, 1.0e16_wp, 1.0e24_wp]))
      end do
      call say('elastic, 10 turns without stiffness: drift of invariants', drift)
      call test%check_close(drift, 0.0_wp, 1.0e-12_wp, 'turning alone changes no invariant of the stress')
   end subroutine turning_alone

   !> With stiffness, x -> R x in small steps: the strain that A - A^2/2 sees is of order 4 in the angle of a
   !> step, so that over given turns the drift falls with the third power of the step; and the stress comes
   !> round to where it was.
   subroutine turning_elastic()
      real(wp) :: drift(2), after(2), start(3, 3, n), angle
      integer :: steps, k, p, t
      do k = 1, 2
         steps = 1000*10*k
         call reset()
         do p = 1, n
            column(p, layout%stress:layout%stress + 5) = chance%several(6, -1.0e8_wp, 1.0e8_wp)
            start(:, :, p) = tensor(p)
         end do
         do t = 1, steps
            call step(elastic, rotation([1.0_wp, -2.0_wp, 0.5_wp], 20.0_wp*pi/steps) - identity(), 1.0e-6_wp)
         end do
         drift(k) = 0.0_wp
         after(k) = 0.0_wp
         do p = 1, n
            associate (s => tensor(p))
               call keep_worst(drift(k), (s(1, 1) + s(2, 2) + s(3, 3) - start(1, 1, p) - start(2, 2, p) &
                                          - start(3, 3, p))/young)
               call keep_worst(after(k), maxval(abs(s - start(:, :, p)))/1.0e8_wp)
            end associate
         end do
      end do
      call say('elastic, 10 turns of 1000 steps: drift of the trace over E', drift(1))
      call say('the same, 2000 steps a turn', drift(2))
      call say('stress after whole turns, relative, 1000 steps a turn', after(1))
      call say('the same, 2000 steps a turn', after(2))
      ! A = R - 1, so that the middle of A - A^2/2 is -angle^4/4 in both directions across the axis
      angle = 2.0_wp*pi/1000.0_wp
      call test%check_close(drift(1)/(10000.0_wp*0.5_wp*angle**4*3.0_wp*bulk/young), 1.0_wp, 0.02_wp, &
                            'turning strains the elastic law by angle^4/4 a step, no more')
      call test%check(drift(2) < 0.14_wp*drift(1), 'the drift falls with the third power of the step')
      call test%check(after(2) < 0.3_wp*after(1) .and. after(1) < 1.0e-2_wp, &
                      'the stress turns with the body, to second order')
   end subroutine turning_elastic

   !> The deformation gradient forgets nothing: exact but for round-off, and the stress is R sigma R^T.
   subroutine turning_neo_hookean()
      real(wp) :: before(3, n), start(3, 3, n), drift, turned, r(3, 3), volume(n)
      integer, parameter :: steps = 2000
      integer :: p, t
      call reset()
      do p = 1, n
         gradient(p, :) = chance%several(9, -0.2_wp, 0.2_wp)
      end do
      call laws%slots(neo_hookean)%law%update(column, layout, gradient, 1.0_wp, 1, n)
      do p = 1, n
         before(:, p) = invariants(p)
         start(:, :, p) = tensor(p)
      end do
      volume = column(:, layout%volume)
      do t = 1, steps
         call step(neo_hookean, rotation([1.0_wp, -2.0_wp, 0.5_wp], 20.3_wp*pi/steps) - identity(), 1.0e-6_wp)
      end do
      r = rotation([1.0_wp, -2.0_wp, 0.5_wp], 20.3_wp*pi)
      drift = 0.0_wp
      turned = 0.0_wp
      do p = 1, n
         call keep_worst(drift, maxval(abs(invariants(p) - before(:, p))/[young, young**2, young**3]))
         call keep_worst(turned, &
                         maxval(abs(tensor(p) - matmul(r, matmul(start(:, :, p), transpose(r)))))/young)
      end do
      call say('neo-Hookean, 10 turns: drift of invariants', drift)
      call say('neo-Hookean: stress against R sigma R^T, over E', turned)
      call test%check_close(drift, 0.0_wp, 1.0e-12_wp, &
                            'turning a neo-Hookean body changes no invariant of its stress')
      call test%check_close(turned, 0.0_wp, 1.0e-11_wp, 'turning a neo-Hookean body turns its stress')
      call test%check_close(column(:, layout%volume), volume, 1.0e-11_wp, 'turning changes no volume')
   end subroutine turning_neo_hookean

   !> Hooke's law where strains are of size e: what is left is of order e.
   subroutine small_strain(law)
      integer, intent(in) :: law
      real(wp), parameter :: e = 1.0e-7_wp
      real(wp) :: l(3, 3), strain(3, 3), off
      integer :: p
      character(len=:), allocatable :: name
      name = trim(merge('elastic    ', 'neo_hookean', law == elastic))
      call reset()
      do p = 1, n
         gradient(p, :) = chance%several(9, -1.0_wp, 1.0_wp)
      end do
      call laws%slots(law)%law%update(column, layout, gradient, e, 1, n)
      off = 0.0_wp
      do p = 1, n
         l = e*reshape(gradient(p, :), [3, 3])
         strain = 0.5_wp*(l + transpose(l))
         call keep_worst(off, maxval(abs(tensor(p) &
                                         - lame*(strain(1, 1) + strain(2, 2) + strain(3, 3))*identity() &
                                         - 2.0_wp*shear*strain))/(young*e))
      end do
      call say(name//': off Hooke''s law at strains of 1e-7, relative', off)
      call test%check_close(off, 0.0_wp, 2.0e-6_wp, name//': Hooke''s law at small strain')
   end subroutine small_strain

   !> Uniaxial stretch and simple shear, in one step and in many.
   subroutine closed_forms()
      real(wp) :: stretch, j, expected(6), off, f(3, 3)
      integer :: k, steps, t
      off = 0.0_wp
      do k = 1, 20
         stretch = 0.4_wp + 0.1_wp*k
         call reset()
         steps = 1 + mod(k, 3)*25
         do t = 1, steps
            call step(neo_hookean, &
                      (stretch**(1.0_wp/steps) - 1.0_wp) &
                      *reshape([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp], &
                                                                               [3, 3]), 0.1_wp)
         end do
         j = stretch
         expected = 0.0_wp
         expected(1) = shear*j**(-5.0_wp/3.0_wp)*2.0_wp/3.0_wp*(stretch**2 - 1.0_wp) + bulk*(j - 1.0_wp)
         expected(2:3) = -shear*j**(-5.0_wp/3.0_wp)/3.0_wp*(stretch**2 - 1.0_wp) + bulk*(j - 1.0_wp)
         call keep_worst(off, maxval(abs(column(n, layout%stress:layout%stress + 5) - expected))/young)
         call reset()
         f = 0.0_wp
         f(1, 3) = (stretch - 1.0_wp)/steps ! x sheared along z
         do t = 1, steps
            call step(neo_hookean, f, 0.1_wp)
         end do
         expected(1) = 2.0_wp/3.0_wp*shear*(stretch - 1.0_wp)**2
         expected(2:3) = -shear*(stretch - 1.0_wp)**2/3.0_wp
         expected(4:6) = [0.0_wp, shear*(stretch - 1.0_wp), 0.0_wp]
         call keep_worst(off, maxval(abs(column(1, layout%stress:layout%stress + 5) - expected))/young)
      end do
      call say('neo-Hookean uniaxial (0.5 to 2.4) and simple shear, over E', off)
      call test%check_close(off, 0.0_wp, 1.0e-13_wp, &
                            'neo-Hookean stress in uniaxial stretch and simple shear')
   end subroutine closed_forms

   !> dU/dt = V sigma : L, by central differences about random deformed states.
   subroutine stress_power_neo_hookean()
      real(wp), allocatable :: state(:, :)
      real(wp) :: l(3, 3), energy(2), power, off, e, smallest
      integer :: round, side, p
      off = 0.0_wp
      e = 1.0e-5_wp
      do round = 1, 20
         call reset()
         do p = 1, n
            gradient(p, :) = chance%several(9, -0.3_wp, 0.3_wp)
         end do
         call laws%slots(neo_hookean)%law%update(column, layout, gradient, 1.0_wp, 1, n)
         call advance_volume(n, gradient, 1.0_wp, column(:, layout%volume), smallest)
         l = reshape(chance%several(9, -1.0_wp, 1.0_wp), [3, 3])
         power = 0.0_wp
         do p = 1, n
            power = power + column(p, layout%volume)*sum(tensor(p)*l)
         end do
         state = column
         do side = 1, 2
            column = state
            call step(neo_hookean, real(2*side - 3, wp)*e*l, 1.0_wp)
            energy(side) = laws%slots(neo_hookean)%law%strain_energy(column, layout, 1, n)
         end do
         call keep_worst(off, ((energy(2) - energy(1))/(2.0_wp*e) - power)/(young*n))
      end do
      call say('neo-Hookean: energy rate against stress power, over E V', off)
      call test%check_close(off, 0.0_wp, 1.0e-9_wp, 'neo-Hookean: the energy changes by the stress power')
   end subroutine stress_power_neo_hookean

   !> The same for the rate form, which has an energy at small strain only.
   subroutine stress_power_elastic()
      real(wp) :: before(3, 3, n), l(3, 3), energy(2), work, off
      real(wp), parameter :: e = 1.0e-7_wp
      integer :: round, p
      off = 0.0_wp
      do round = 1, 20
         call reset()
         do p = 1, n
            gradient(p, :) = chance%several(9, -1.0_wp, 1.0_wp)
         end do
         call laws%slots(elastic)%law%update(column, layout, gradient, e, 1, n)
         do p = 1, n
            before(:, :, p) = tensor(p)
         end do
         energy(1) = laws%slots(elastic)%law%strain_energy(column, layout, 1, n)
         l = e*reshape(chance%several(9, -1.0_wp, 1.0_wp), [3, 3])
         call step(elastic, l, 1.0_wp)
         energy(2) = laws%slots(elastic)%law%strain_energy(column, layout, 1, n)
         work = 0.0_wp
         do p = 1, n
            work = work + column(p, layout%volume)*sum(0.5_wp*(before(:, :, p) + tensor(p))*l)
         end do
         call keep_worst(off, (energy(2) - energy(1) - work)/energy(2))
         call test%check(energy(1) > 0.0_wp, 'elastic: strain takes energy')
      end do
      call say('elastic at strains of 1e-7: energy against work, relative', off)
      call test%check_close(off, 0.0_wp, 1.0e-5_wp, 'elastic: the energy changes by the work of the stress')
   end subroutine stress_power_elastic

   !> V det(I + dt L), the smallest determinant, and the bounds of speed.
   subroutine volumes()
      real(wp) :: f(3, 3), expected(n), det(n), smallest, speed_squared, specific_volume
      integer :: p
      call reset()
      do p = 1, n
         gradient(p, :) = chance%several(9, -3.0_wp, 3.0_wp)
         f = identity() + 0.1_wp*reshape(gradient(p, :), [3, 3])
         det(p) = f(1, 1)*(f(2, 2)*f(3, 3) - f(2, 3)*f(3, 2)) + f(1, 2)*(f(2, 3)*f(3, 1) - f(2, 1)*f(3, 3)) &
                  + f(1, 3)*(f(2, 1)*f(3, 2) - f(2, 2)*f(3, 1))
         column(p, layout%velocity:layout%velocity + 2) = chance%several(3, -5.0_wp, 5.0_wp)
      end do
      expected = column(:, layout%volume)*det
      call advance_volume(n - 2, gradient, 0.1_wp, column(:, layout%volume), smallest)
      expected(n - 1:) = column(n - 1:, layout%volume)
      call test%check_close(column(:, layout%volume), expected, 1.0e-14_wp, 'volumes')
      call test%check_close(smallest, minval(expected(:n - 2)), 1.0e-14_wp, 'smallest volume')
      call fastest(column(:, layout%velocity:layout%velocity + 2), column(:, layout%mass), &
                   column(:, layout%volume), 3, n - 1, speed_squared, specific_volume)
      call test%check_close([speed_squared, specific_volume], &
                            [maxval(sum(column(3:n - 1, layout%velocity:layout%velocity + 2)**2, &
                            dim=2)), maxval(column(3:n - 1, layout%volume)/column(3:n - 1, layout%mass))], &
                            1.0e-13_wp, 'largest speed and specific volume of a run')
   end subroutine volumes

   !> A law touches the particles first to last and no other, and the energy is theirs alone.
   subroutine only_its_own()
      real(wp), allocatable :: before(:, :)
      real(wp) :: parts
      integer :: law, p
      do law = 1, 2
         call reset()
         do p = 1, n
            gradient(p, :) = chance%several(9, -1.0_wp, 1.0_wp)
         end do
         before = column
         call laws%slots(law)%law%update(column, layout, gradient, 1.0e-3_wp, 4, n - 5)
         call test%check(all(abs(column(:3, :) - before(:3, :)) <= 0.0_wp) .and. &
                         all(abs(column(n - 4:, :) - before(n - 4:, :)) <= 0.0_wp), &
                         'a law leaves other particles alone')
         parts = 0.0_wp
         do p = 1, n
            parts = parts + laws%slots(law)%law%strain_energy(column, layout, p, p)
         end do
         call test%check_close(laws%slots(law)%law%strain_energy(column, layout, 1, n)/parts, 1.0_wp, &
                               1.0e-13_wp, 'the energy of all is the sum of each')
         call test%check_close(laws%slots(law)%law%strain_energy(column, layout, 1, 3), 0.0_wp, 0.0_wp, &
                               'no strain, no energy')
      end do
   end subroutine only_its_own

   !> Laws that follow the shape of a particle only where there are tools: twice as long along x by their
   !> columns, or nothing to tell. All other columns hold 0.09, which must not be read.
   subroutine thickness()
      type(maxwell_t) :: maxwell
      type(mie_grueneisen_t) :: fluid
      type(drucker_prager_t) :: sand
      type(j2_t) :: metal
      maxwell%relaxation_times = [1.0_wp]
      call look(maxwell)
      call look(sand)
      call look(metal)
      fluid%strength = 2
      call look(fluid)
      fluid%strength = 3
      call look(fluid)
   end subroutine thickness

   subroutine look(law)
      class(material_t), intent(inout) :: law
      real(wp), parameter :: along(3) = [1.0_wp, 0.0_wp, 0.0_wp]
      type(field_table_t) :: table
      real(wp), allocatable :: values(:)
      integer :: first
      call declare_usual(table)
      call law%declare(table, has_tools=.false.)
      allocate (values(table%columns), source=0.09_wp)
      call test%check(.not. law%stretch(values, table%layout(), along) < huge(1.0_wp), &
                      'without tools nothing tells the thickness')
      call law%declare(table, has_tools=.true.)
      deallocate (values)
      allocate (values(table%columns), source=0.09_wp)
      first = table%column('left_cauchy_green')
      values(first:first + 5) = [4.0_wp, 1.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
      call test%check_close(law%stretch(values, table%layout(), along), 2.0_wp, 1.0e-14_wp, 'thickness')
   end subroutine look

end program materials
