!> Laws of plastic flow, one particle at a time, against closed forms: curves, reversal, kinks, random paths,
!> turning, heat.
!test: limit 120
program plasticity
   use m_kinds, only: wp
   use m_communicator, only: communicator_t
   use m_field_table, only: field_table_t, layout_t
   use m_isotropic, only: isotropic_t
   use m_material, only: material_t
   use m_elastic, only: elastic_t
   use m_plastic, only: plastic_t
   use m_j2, only: j2_t
   use m_johnson_cook, only: johnson_cook_t
   use m_deform, only: advance_volume
   use m_assertions, only: assertions_t
   use m_chance, only: chance_t, keep_worst, say
   implicit none
   real(wp), parameter :: young = 124.0e9_wp, poisson = 0.34_wp, density = 8960.0_wp
   real(wp), parameter :: shear = young/(2.0_wp*(1.0_wp + poisson)), &
      bulk = young/(3.0_wp*(1.0_wp - 2.0_wp*poisson))
   real(wp), parameter :: lame = bulk - 2.0_wp*shear/3.0_wp
   real(wp), parameter :: yield = 200.0e6_wp
   real(wp), parameter :: kinks(4) = [0.0_wp, 0.003_wp, 0.01_wp, 0.05_wp]
   real(wp), parameter :: levels(4) = [1.0_wp, 1.6_wp, 1.7_wp, 2.4_wp]*yield
   integer, parameter :: many = 10000
   type(communicator_t) :: comm
   type(assertions_t) :: test
   type(chance_t) :: chance
   type(layout_t) :: layout
   real(wp), allocatable :: column(:, :), gradient(:, :)
   call comm%start()
   call test%start(comm, 'plasticity')
   call below_yield()
   call extension()
   call uniaxial_strain()
   call simple_shear()
   call reversal()
   call across_kinks()
   call random_paths()
   call turning()
   call rate_and_warmth()
   call heating()
   call thickness()
   call test%finish()

contains

   !> A law with n particles of 1 m3 ready to be strained.
   subroutine ready(law, n)
      class(isotropic_t), intent(inout) :: law
      integer, intent(in) :: n
      type(field_table_t) :: table
      law%density = density
      law%lame = lame
      law%shear = shear
      call table%declare('mass', 1, 'kg', .true.)
      call table%declare('volume', 1, 'm3', .true.)
      call table%declare('stress', 6, 'Pa', .true.)
      call law%declare(table, has_tools=.true.)
      layout = table%layout()
      if (allocated(column)) deallocate (column, gradient)
      allocate (column(n, table%columns), gradient(n, 9), source=0.0_wp)
      column(:, layout%volume) = 1.0_wp
      column(:, layout%mass) = density
      call law%initial(column, layout, 1, n)
   end subroutine ready

   !> One step of all particles with what stands in `gradient`.
   subroutine advance(law, dt)
      class(material_t), intent(in) :: law
      real(wp), intent(in) :: dt
      real(wp) :: smallest
      integer :: n
      n = size(column, 1)
      call law%update(column, layout, gradient, dt, 1, n)
      call advance_volume(n, gradient, dt, column(:, layout%volume), smallest)
   end subroutine advance

   !> One step of all particles with the deformation gradient I + increment.
   subroutine strain_by(law, increment, dt)
      class(material_t), intent(in) :: law
      real(wp), intent(in) :: increment(3, 3), dt
      integer :: p
      do p = 1, size(column, 1)
         gradient(p, :) = reshape(increment/dt, [9])
      end do
      call advance(law, dt)
   end subroutine strain_by

   !> `steps` steps that add up to the logarithmic strains e along x, y, z in `duration` seconds.
   subroutine stretch_by(law, e, steps, duration)
      class(material_t), intent(in) :: law
      real(wp), intent(in) :: e(3), duration
      integer, intent(in) :: steps
      integer :: t
      do t = 1, steps
         call strain_by(law, diagonal(exp(e/steps) - 1.0_wp), duration/steps)
      end do
   end subroutine stretch_by

   pure function diagonal(d)
      real(wp), intent(in) :: d(3)
      real(wp) :: diagonal(3, 3)
      diagonal = 0.0_wp
      diagonal(1, 1) = d(1)
      diagonal(2, 2) = d(2)
      diagonal(3, 3) = d(3)
   end function diagonal

   pure real(wp) function mises(p)
      integer, intent(in) :: p
      associate (s => column(p, layout%stress:layout%stress + 5))
         mises = sqrt(1.5_wp*sum((s(1:3) - sum(s(1:3))/3.0_wp)**2) + 3.0_wp*sum(s(4:6)**2))
      end associate
   end function mises

   type(j2_t) function linear(modulus)
      real(wp), intent(in) :: modulus
      linear%yield_stress = yield
      linear%hardening_modulus = modulus
   end function linear

   type(j2_t) function table_law()
      table_law%yield_stress = levels(1)
      table_law%hardening_strain = kinks
      table_law%hardening_stress = levels
   end function table_law

   !> Copper's numbers of Johnson and Cook (1983).
   type(johnson_cook_t) function copper()
      copper%yield_stress = 90.0e6_wp
      copper%hardening_modulus = 292.0e6_wp
      copper%hardening_exponent = 0.31_wp
      copper%rate_coefficient = 0.025_wp
      copper%thermal_exponent = 1.09_wp
      copper%room_temperature = 294.0_wp
      copper%melting_temperature = 1356.0_wp
      copper%specific_heat = 383.0_wp
   end function copper

   !> The yield stress of the table, by interpolation written in another way than the law's.
   pure real(wp) function table_stress(strain)
      real(wp), intent(in) :: strain
      integer :: k
      k = count(kinks <= strain)
      table_stress = levels(4)
      if (k < 4) table_stress = (levels(k)*(kinks(k + 1) - strain) + levels(k + 1)*(strain - kinks(k))) &
         /(kinks(k + 1) - kinks(k))
   end function table_stress

   !> Below yield the laws are the elastic one to the bit, and above it they are not.
   subroutine below_yield()
      type(j2_t) :: j2
      type(johnson_cook_t) :: jc
      j2 = linear(1.0e9_wp)
      jc = copper()
      call compare(j2, 'j2')
      call compare(jc, 'Johnson-Cook')
   end subroutine below_yield

   subroutine compare(law, name)
      class(plastic_t), intent(inout) :: law
      character(len=*), intent(in) :: name
      type(elastic_t) :: plain
      real(wp), allocatable :: strains(:, :), expected(:, :)
      integer :: p, t
      allocate (strains(301, 9))
      do p = 1, size(strains, 1)
         strains(p, :) = chance%several(9, -4.0e-5_wp, 4.0e-5_wp)
      end do
      call ready(plain, size(strains, 1))
      gradient = strains
      do t = 1, 4
         call advance(plain, 1.0_wp)
      end do
      expected = column(:, layout%stress:layout%stress + 5)
      call ready(law, size(strains, 1))
      gradient = strains
      do t = 1, 4
         call advance(law, 1.0_wp)
      end do
      call test%check(all(abs(column(:, layout%stress:layout%stress + 5) - expected) <= 0.0_wp), &
                      name//': below yield the bits of the elastic law')
      call test%check(maxval(expected) > 5.0e6_wp .and. all(abs(column(:, law%strain)) <= 0.0_wp) &
                      .and. law%plastic_energy(column, 1, size(strains, 1)) <= 0.0_wp, name// &
                      ': below yield nothing flows')
      gradient = 50.0_wp*strains
      call advance(law, 1.0_wp)
      call test%check(count(column(:, law%strain) > 0.0_wp) > 250, name//': above yield it does')
   end subroutine compare

   !> Isochoric extension e, -e/2, -e/2: q = 3 mu e, then q = yield + H (e - q/(3 mu)). The error is that of A
   !> - A^2/2 against the logarithm: second order in the step. The work done is stored or dissipated.
   subroutine extension()
      type(j2_t) :: law
      real(wp), parameter :: moduli(3) = [0.0_wp, 1.0e9_wp, 20.0e9_wp], e = 0.1_wp
      real(wp) :: expected, off(2), work
      integer :: k, half
      do k = 1, size(moduli)
         law = linear(moduli(k))
         expected = (e - yield/(3.0_wp*shear))/(1.0_wp + moduli(k)/(3.0_wp*shear))
         do half = 1, 2
            call ready(law, 1)
            call stretch_by(law, e*[1.0_wp, -0.5_wp, -0.5_wp], 500*half, 1.0_wp)
            off(half) = abs(column(1, law%strain)/expected - 1.0_wp)
         end do
         call say('j2 extension by 0.1, 500 steps: plastic strain, relative error', off(1))
         call test%check(off(2) < 0.27_wp*off(1) .and. off(1) < 1.0e-5_wp, &
                         'j2: extension, second order in the step')
         call test%check_close(mises(1)/(yield + moduli(k)*expected), 1.0_wp, 1.0e-5_wp, &
                               'j2: stress of extension')
         work = yield*expected + 0.5_wp*moduli(k)*expected**2
         call test%check_close(law%plastic_energy(column, 1, 1)/work, 1.0_wp, 1.0e-5_wp, &
                               'j2: plastic work of extension')
         call test%check_close(law%strain_energy(column, layout, 1, &
                                                 1)/((yield + moduli(k)*expected)**2/(6.0_wp*shear)), &
                                                 1.0_wp, 1.0e-5_wp, 'j2: strain energy of extension')
      end do
      law = table_law()
      call ready(law, 1)
      call stretch_by(law, e*[1.0_wp, -0.5_wp, -0.5_wp], 500, 1.0_wp)
      call test%check_close(column(1, law%strain)/(e - levels(4)/(3.0_wp*shear)), 1.0_wp, 1.0e-5_wp, &
                            'j2: extension by a table, held after its last point')
      work = sum(0.5_wp*(levels(2:) + levels(:3))*(kinks(2:) - kinks(:3))) &
             + levels(4)*(column(1, law%strain) - kinks(4))
      call test%check_close(law%plastic_energy(column, 1, 1)/work, 1.0_wp, 1.0e-12_wp, &
                            'j2: plastic work, area under the table')
   end subroutine extension

   !> Strain along x alone: q = 2 mu e until yield, then plastic strain (2 mu e - yield)/(3 mu + H); axial
   !> stress K e + 2/3 q.
   subroutine uniaxial_strain()
      type(j2_t) :: law
      real(wp), parameter :: h = 2.0e9_wp, e = -0.02_wp
      real(wp) :: flowed, axial, off(2)
      integer :: half
      law = linear(h)
      flowed = (2.0_wp*shear*abs(e) - yield)/(3.0_wp*shear + h)
      axial = bulk*e - 2.0_wp/3.0_wp*(yield + h*flowed)
      do half = 1, 2
         call ready(law, 1)
         call stretch_by(law, [e, 0.0_wp, 0.0_wp], 100*half, 1.0_wp)
         off(half) = abs(column(1, layout%stress)/axial - 1.0_wp)
      end do
      call say('j2 uniaxial strain -0.02, 100 steps: axial stress, relative error', off(1))
      call test%check(off(2) < 0.27_wp*off(1) .and. off(1) < 1.0e-6_wp, &
                      'j2: uniaxial strain, second order in the step')
      call test%check_close(column(1, law%strain)/flowed, 1.0_wp, 1.0e-6_wp, &
                            'j2: plastic strain of uniaxial strain')
   end subroutine uniaxial_strain

   !> Simple shear without hardening, with the turning of the objective rate. The stress turns on its circle
   !> of radius k = yield/sqrt(3) by d(theta)/d(gamma) = 1 - a sin(theta), a = mu/k: from gamma/2 at yield (2
   !> mu sin(gamma/2) = k) towards sin(theta) = 1/a; the plastic strain is the integral of cos(theta)/sqrt(3).
   !> A soft material makes the angles large.
   subroutine simple_shear()
      type(j2_t) :: law
      real(wp) :: a, k, root, start, gamma, ratio, t, theta, flowed, off(2), off_strain(2), increment(3, 3)
      integer :: half, step, steps
      law%yield_stress = 0.2_wp*sqrt(3.0_wp)*shear
      k = 0.2_wp*shear
      a = 5.0_wp
      start = 2.0_wp*asin(0.5_wp/a)
      gamma = 0.5_wp
      root = sqrt(a**2 - 1.0_wp)
      t = tan(0.25_wp*start)
      ratio = (t - a - root)/(t - a + root)*exp(root*(gamma - start))
      t = (a + root - ratio*(a - root))/(1.0_wp - ratio)
      theta = 2.0_wp*atan(t)
      flowed = log((1.0_wp - a*sin(0.5_wp*start))/(1.0_wp - a*sin(theta)))/(a*sqrt(3.0_wp))
      do half = 1, 2
         steps = 2000*half
         call ready(law, 1)
         increment = 0.0_wp
         increment(1, 2) = gamma/steps
         do step = 1, steps
            call strain_by(law, increment, 1.0_wp)
         end do
         off(half) = abs(column(1, layout%stress + 5)/(k*cos(theta)) - 1.0_wp) &
                     + abs(column(1, layout%stress)/(k*sin(theta)) - 1.0_wp) &
                     + abs(column(1, layout%stress + 1)/(k*sin(theta)) + 1.0_wp)
         off_strain(half) = abs(column(1, law%strain)/flowed - 1.0_wp)
      end do
      call say('j2 simple shear 0.5, 2000 steps: stress, relative error', off(1))
      call say('the same: plastic strain', off_strain(1))
      call test%check(off(2) < 0.55_wp*off(1) .and. off(1) < 2.0e-3_wp, &
                      'j2: simple shear, first order in the step')
      call test%check(off_strain(2) < 0.55_wp*off_strain(1) .and. off_strain(1) < 2.0e-3_wp, &
                      'j2: plastic strain of simple shear')
   end subroutine simple_shear

   !> Extension, then back: the second yield comes at the largest stress so far, twice its elastic strain
   !> away.
   subroutine reversal()
      type(j2_t) :: law
      real(wp), parameter :: h = 10.0e9_wp, e = 0.01_wp
      real(wp) :: top, flowed, back
      integer :: k
      law = linear(h)
      call ready(law, 1)
      call stretch_by(law, e*[1.0_wp, -0.5_wp, -0.5_wp], 200, 1.0_wp)
      top = mises(1)
      flowed = column(1, law%strain)
      back = -2.0_wp*top/(3.0_wp*shear)
      call stretch_by(law, 0.999_wp*back*[1.0_wp, -0.5_wp, -0.5_wp], 100, 1.0_wp)
      call test%check(column(1, law%strain) <= flowed, &
                      'j2: reversed loading is elastic up to the stress of reversal')
      call stretch_by(law, 0.002_wp*back*[1.0_wp, -0.5_wp, -0.5_wp], 1, 1.0_wp)
      call test%check(column(1, law%strain) > flowed, 'j2: reversed loading yields at the stress of reversal')
      call stretch_by(law, (-e - 0.001_wp*back)*[1.0_wp, -0.5_wp, -0.5_wp], 200, 1.0_wp)
      k = layout%stress
      call test%check_close(column(1, k)/(-2.0_wp/3.0_wp*(top + h*e/(1.0_wp + h/(3.0_wp*shear)))), 1.0_wp, &
                            1.0e-6_wp, 'j2: stress after reversed flow')
   end subroutine reversal

   !> One big step over all kinks: the trial stress is 2 mu dev(A - A^2/2); the answer is sought by bisection
   !> on the table.
   subroutine across_kinks()
      type(j2_t) :: law
      real(wp) :: a, trial, low, high, middle, off
      integer :: k, n
      law = table_law()
      off = 0.0_wp
      do k = 3, 60 ! below, some steps stay elastic
         call ready(law, 1)
         column(1, law%strain) = 0.0004_wp*mod(k, 7)
         a = 0.001_wp*k
         call strain_by(law, diagonal(a*[1.0_wp, -0.5_wp, -0.5_wp]), 1.0_wp)
         trial = 2.0_wp*shear*((a - 0.5_wp*a**2) - (-0.5_wp*a - 0.125_wp*a**2))
         low = 0.0004_wp*mod(k, 7)
         high = low + trial/(3.0_wp*shear)
         do n = 1, 100
            middle = 0.5_wp*(low + high)
            if (trial - 3.0_wp*shear*(middle - 0.0004_wp*mod(k, 7)) > table_stress(middle)) then
               low = middle
            else
               high = middle
            end if
         end do
         call keep_worst(off, (column(1, law%strain) - low)/0.01_wp)
         call keep_worst(off, mises(1)/table_stress(low) - 1.0_wp)
      end do
      call say('j2 table, one step over up to 3 kinks: relative error', off)
      call test%check_close(off, 0.0_wp, 1.0e-12_wp, 'j2: kinks of the table within one step are met exactly')
   end subroutine across_kinks

   !> 10^4 random paths of 40 steps: outside the yield surface never, plastic strain and work never fall. The
   !> yield function is that of the law, computed here anew.
   subroutine random_paths()
      type(j2_t) :: j2
      type(johnson_cook_t) :: jc
      j2 = table_law()
      jc = copper()
      call follow(j2, 'j2')
      call follow(jc, 'Johnson-Cook')
   end subroutine random_paths

   subroutine follow(law, name)
      class(plastic_t), intent(inout) :: law
      character(len=*), intent(in) :: name
      real(wp), allocatable :: strain(:), work(:), temperature(:)
      real(wp) :: outside, least, left, strength, dt
      integer :: p, t, flowing, hot
      call ready(law, many)
      outside = -1.0_wp
      left = 0.0_wp
      least = 0.0_wp
      flowing = 0
      dt = 1.0e-7_wp
      hot = law%strain
      select type (law)
      type is (johnson_cook_t)
         hot = law%temperature
      end select
      do t = 1, 40
         strain = column(:, law%strain)
         work = column(:, law%work)
         temperature = column(:, hot)
         do p = 1, many
            gradient(p, :) = chance%several(9, -1.0_wp, 1.0_wp)*10.0_wp**chance%between(-5.0_wp, -1.5_wp)/dt
         end do
         call advance(law, dt)
         do p = 1, many
            if (hot == law%strain) then ! the law has no temperature
               strength = table_stress(column(p, law%strain))
            else
               strength = copper_stress(column(p, law%strain), (column(p, law%strain) - strain(p))/dt, &
                                        temperature(p))
            end if
            outside = max(outside, mises(p)/strength - 1.0_wp)
            if (column(p, law%strain) > strain(p)) call keep_worst(left, mises(p)/strength - 1.0_wp)
         end do
         flowing = flowing + count(column(:, law%strain) > strain)
         least = min(least, minval(column(:, law%strain) - strain), minval(column(:, law%work) - work))
      end do
      call say(name//', 10^4 random paths: furthest outside the yield surface', outside)
      call say('the same, off the yield surface where it flows', left)
      call test%check(outside <= 1.0e-10_wp .and. outside >= -1.0_wp, name// &
                      ': random paths stay within the yield surface')
      call test%check_close(left, 0.0_wp, 1.0e-10_wp, name//': flow is on the yield surface')
      call test%check(least >= 0.0_wp, name//': plastic strain and plastic work never fall')
      call test%check(flowing > 10*many .and. flowing < 39*many, name//': random paths flow and unload')
   end subroutine follow

   !> The formula, with copper's numbers.
   pure real(wp) function copper_stress(strain, rate, temperature)
      real(wp), intent(in) :: strain, rate, temperature
      real(wp) :: theta
      theta = min(max((temperature - 294.0_wp)/(1356.0_wp - 294.0_wp), 0.0_wp), 1.0_wp)
      copper_stress = (90.0e6_wp + 292.0e6_wp*strain**0.31_wp)*(1.0_wp - theta**1.09_wp)
      if (rate > 1.0_wp) copper_stress = copper_stress*(1.0_wp + 0.025_wp*log(rate))
   end function copper_stress

   !> The same path with a rigid turn of one radian on top: the invariants come closer with the square of the
   !> step.
   subroutine turning()
      real(wp) :: still(3), turned(3), off(2)
      integer :: half
      do half = 1, 2
         call run_turned(200*half, 0.0_wp, still)
         call run_turned(200*half, 1.0_wp, turned)
         off(half) = maxval(abs(turned/still - 1.0_wp))
      end do
      call say('j2, turned by 1 rad in 200 steps: invariants, relative difference', off(1))
      call test%check(off(2) < 0.3_wp*off(1) .and. off(1) < 1.0e-3_wp, &
                      'j2: a turn on top, second order in the step')
   end subroutine turning

   !> The path in `steps` steps with a turn by `angle`: trace, von Mises stress, plastic strain at the end.
   subroutine run_turned(steps, angle, three)
      integer, intent(in) :: steps
      real(wp), intent(in) :: angle
      real(wp), intent(out) :: three(3)
      type(j2_t) :: law
      real(wp) :: path(3, 3), before(3, 3), after(3, 3)
      integer :: k
      law = linear(5.0e9_wp)
      call ready(law, 1)
      path = reshape([0.02_wp, 0.0_wp, 0.0_wp, 0.01_wp, -0.005_wp, 0.0_wp, 0.0_wp, 0.0_wp, -0.01_wp], &
                     [3, 3])/steps
      do k = 1, steps
         before = about_axis(angle*(k - 1)/steps)
         after = about_axis(angle*k/steps)
         call strain_by(law, matmul(after, matmul(identity() + path, transpose(before))) - identity(), 1.0_wp)
      end do
      three = [sum(column(1, layout%stress:layout%stress + 2)), mises(1), column(1, law%strain)]
   end subroutine run_turned

   pure function identity()
      real(wp) :: identity(3, 3)
      identity = diagonal([1.0_wp, 1.0_wp, 1.0_wp])
   end function identity

   !> Rotation about (1, -2, 0.5) (Rodrigues).
   pure function about_axis(angle) result(r)
      real(wp), intent(in) :: angle
      real(wp) :: r(3, 3), u(3), w(3, 3)
      u = [1.0_wp, -2.0_wp, 0.5_wp]/norm2([1.0_wp, -2.0_wp, 0.5_wp])
      w = reshape([0.0_wp, u(3), -u(2), -u(3), 0.0_wp, u(1), u(2), -u(1), 0.0_wp], [3, 3])
      r = identity() + sin(angle)*w + 2.0_wp*sin(0.5_wp*angle)**2*matmul(w, w)
   end function about_axis

   !> Without hardening and heat the rate of flow becomes that of the extension: yield A (1 + C ln rate)(1 -
   !> T*^m). With hardening but no rate, e = ep + (A + B ep^n)/(3 mu).
   subroutine rate_and_warmth()
      type(johnson_cook_t) :: law
      real(wp), parameter :: rates(4) = [0.01_wp, 1.0_wp, 1.0e3_wp, 1.0e6_wp], &
         warmth(3) = [294.0_wp, 600.0_wp, 1200.0_wp]
      real(wp) :: expected, off, flowed
      integer :: r, w
      off = 0.0_wp
      do r = 1, size(rates)
         do w = 1, size(warmth)
            law = copper()
            law%hardening_modulus = 0.0_wp
            law%heat_fraction = 0.0_wp
            call ready(law, 1)
            column(1, law%temperature) = warmth(w)
            call stretch_by(law, 0.05_wp*[1.0_wp, -0.5_wp, -0.5_wp], 2000, 0.05_wp/rates(r))
            expected = 90.0e6_wp*(1.0_wp + 0.025_wp*log(max(1.0_wp, rates(r)))) &
                       *(1.0_wp - ((warmth(w) - 294.0_wp)/1062.0_wp)**1.09_wp)
            call keep_worst(off, mises(1)/expected - 1.0_wp)
         end do
      end do
      call say('Johnson-Cook at given rate and temperature: stress, relative error', off)
      call test%check_close(off, 0.0_wp, 1.0e-9_wp, 'Johnson-Cook: rate and temperature')
      law = copper()
      law%rate_coefficient = 0.0_wp
      law%heat_fraction = 0.0_wp
      call ready(law, 1)
      call stretch_by(law, 0.1_wp*[1.0_wp, -0.5_wp, -0.5_wp], 500, 1.0_wp)
      flowed = column(1, law%strain)
      call test%check_close((flowed + (90.0e6_wp + 292.0e6_wp*flowed**0.31_wp)/(3.0_wp*shear))/0.1_wp, &
                            1.0_wp, 1.0e-5_wp, 'Johnson-Cook: hardening')
      call ready(law, 1)
      column(1, law%temperature) = law%melting_temperature
      call stretch_by(law, 0.1_wp*[1.0_wp, -0.5_wp, -0.5_wp], 5, 1.0_wp)
      call test%check(mises(1) < 1.0_wp .and. column(1, law%plastic_t%strain) > 0.0999_wp, &
                      'Johnson-Cook: molten material bears no shear')
   end subroutine rate_and_warmth

   !> Adiabatic, without hardening and rate, m = 1: the stress falls as A exp(-beta A ep/(rho c (T_melt -
   !> T_room))). The heat of a particle is its share of its plastic work, whatever else is on.
   subroutine heating()
      type(johnson_cook_t) :: law
      real(wp) :: off(2), expected
      integer :: half
      do half = 1, 2
         law = copper()
         law%yield_stress = 500.0e6_wp
         law%hardening_modulus = 0.0_wp
         law%rate_coefficient = 0.0_wp
         law%thermal_exponent = 1.0_wp
         call ready(law, 1)
         call stretch_by(law, 1.0_wp*[1.0_wp, -0.5_wp, -0.5_wp], 1000*half, 1.0e-4_wp)
         expected = 500.0e6_wp*exp(-0.9_wp*500.0e6_wp*column(1, law%strain)/(density*383.0_wp*1062.0_wp))
         off(half) = abs(mises(1)/expected - 1.0_wp)
      end do
      call say('Johnson-Cook, adiabatic extension by 1, 1000 steps: relative error', off(1))
      call test%check(off(2) < 0.55_wp*off(1) .and. off(1) < 1.0e-3_wp, &
                      'Johnson-Cook: adiabatic, first order in the step')
      law = copper()
      call ready(law, 1)
      call stretch_by(law, [0.3_wp, -0.1_wp, -0.22_wp], 300, 1.0e-4_wp)
      expected = 0.9_wp*law%plastic_energy(column, 1, 1)/(density*383.0_wp)
      call test%check_close((column(1, law%temperature) - 294.0_wp)/expected, 1.0_wp, 1.0e-12_wp, &
                            'Johnson-Cook: the temperature rises by beta of the plastic work over m c')
      call test%check(expected > 10.0_wp, 'Johnson-Cook: plastic work heats')
   end subroutine heating

   !> The thickness that contact asks for follows the whole deformation; nothing is carried where there are no
   !> tools.
   subroutine thickness()
      type(j2_t) :: law
      type(field_table_t) :: table
      real(wp) :: f(3, 3), a(3, 3), n(3)
      integer :: k
      law = linear(1.0e9_wp)
      call ready(law, 1)
      f = identity()
      do k = 1, 30
         a = 0.02_wp*reshape(chance%several(9, -1.0_wp, 1.0_wp), [3, 3])
         f = matmul(identity() + a, f)
         call strain_by(law, a, 1.0_wp)
      end do
      n = [0.6_wp, -0.64_wp, 0.48_wp]
      call test%check_close(law%stretch(column(1, :), layout, n), norm2(matmul(n, f)), 1.0e-13_wp, &
                            'j2: thickness follows the deformation')
      call test%check(column(1, law%strain) > 0.05_wp, 'j2: thickness of a particle that has flowed')
      law = linear(1.0e9_wp)
      call law%declare(table, has_tools=.false.)
      call test%check_equal(table%columns, 2, 'j2: two columns in a scene without tools')
   end subroutine thickness

end program plasticity
