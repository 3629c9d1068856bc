!> Crystal plasticity at points against exact curves: single crystals in tension, Taylor's factor, superposed
!> rotation, random paths.
!test: limit 120
program crystal
   use m_kinds, only: wp
   use m_constants, only: pi
   use m_communicator, only: communicator_t
   use m_material, only: material_t
   use m_crystal, only: crystal_t
   use m_crystal_flow, only: flow, slip_t
   use m_crystal_lanes, only: crystals_t, deform_elastically, let_slip
   use m_lane_tensors, only: lanes
   use m_polar, only: polar
   use m_slip_rates, only: slip_threshold
   use m_rotations, only: from_euler, matrix_of, quaternion_of
   use m_slip_systems, only: make_slip_systems, slip_words
   use m_assertions, only: assertions_t
   use m_chance, only: chance_t, keep_worst, say
   use m_point, only: point_t, law_of, identity, rotation
   implicit none
   character(len=*), parameter :: copper = 'c11=170e9, c12=124e9, c44=75e9, reference_rate=1e-3, '
   character(len=*), parameter :: perfect = copper//'rate_sensitivity=0.02, tau0=16e6, tau_s=16e6, h0=0, q=1'
   character(len=*), parameter :: voce = copper// &
      'rate_sensitivity=0.04, tau0=16e6, tau_s=148e6, h0=180e6, q=1.4, '// &
                                  'hardening=''kalidindi'', hardening_exponent=2.25'
   character(len=*), parameter :: peirce = copper// &
      'rate_sensitivity=0.02, tau0=16e6, tau_s=60e6, h0=300e6, q=1.4'
   type(communicator_t) :: comm
   type(assertions_t) :: test
   type(chance_t) :: chance
   call comm%start()
   call test%start(comm, 'crystal')
   call systems()
   call multiple_slip([0.0_wp, 0.0_wp, 1.0_wp], 8, 1/sqrt(6.0_wp), '[001]')
   call multiple_slip([1.0_wp, 1.0_wp, 1.0_wp], 6, 2/(3*sqrt(6.0_wp)), '[111]')
   call multiple_slip([0.0_wp, 1.0_wp, 1.0_wp], 4, 1/sqrt(6.0_wp), '[011]')
   call bcc_slip(2)
   call bcc_slip(3)
   call single_slip()
   call hardening_peirce()
   call hardening_kalidindi()
   call taylor_factor()
   call turning()
   call random_paths('fcc', 10000)
   call random_paths('bcc24', 1000)
   call random_paths('bcc48', 1000)
   call in_lanes()
   call against_guarded()
   call at_rest()
   call balance()
   call test%finish()

contains

   !> 12, 24 and 48 systems; directions lie in their planes; all differ.
   subroutine systems()
      real(wp), allocatable :: normals(:, :), directions(:, :)
      integer, parameter :: counts(3) = [12, 24, 48]
      integer :: kind, a, b, twins
      do kind = 1, 3
         call make_slip_systems(kind, normals, directions)
         call test%check_equal(size(normals, 2), counts(kind), 'number of slip systems')
         call test%check_close(maxval(abs(sum(normals*directions, dim=1))), 0.0_wp, 1.0e-15_wp, &
                               'directions lie in planes')
         twins = 0
         do a = 1, counts(kind)
            do b = 1, a - 1
               if (abs(dot_product(normals(:, a), normals(:, b))*dot_product(directions(:, a), &
                  directions(:, b))) > 0.999_wp) twins = twins + 1
            end do
         end do
         call test%check_equal(twins, 0, 'all differ')
      end do
   end subroutine systems

   !> The rotation that takes a direction of the crystal to x, as a quaternion.
   function along_x(direction) result(q)
      real(wp), intent(in) :: direction(3)
      real(wp) :: q(4), d(3), axis(3), angle
      d = direction/norm2(direction)
      axis = [0.0_wp, d(3), -d(2)] ! d x e_x
      angle = acos(max(-1.0_wp, min(1.0_wp, d(1))))
      if (.not. norm2(axis) > 0.0_wp) axis = [0.0_wp, 0.0_wp, 1.0_wp]
      q = quaternion_of(rotation(axis, angle))
   end function along_x

   !> Tension along a direction of high symmetry: so many systems slip alike, the axis keeps its direction,
   !> and the stress is tau/schmid with tau of the rate of each.
   subroutine multiple_slip(direction, active, schmid, name)
      real(wp), intent(in) :: direction(3), schmid
      integer, intent(in) :: active
      character(len=*), intent(in) :: name
      type(point_t) :: point
      real(wp), parameter :: strain = 5.0e-5_wp, dt = 5.0e-2_wp
      real(wp) :: left, worst, expected, stress, slip_before, slip_rate, q(4), axis(3), total
      integer :: t
      integer, parameter :: steps = 400
      q = along_x(direction)
      call point%ready(law_of('crystal', perfect), 1, reshape(q, [4, 1]))
      worst = 0.0_wp
      slip_before = 0.0_wp
      slip_rate = 0.0_wp
      do t = 1, steps
         total = column_of(point, 'slip')
         call point%pull(strain, dt, left)
         call keep_worst(worst, left)
         slip_before = total
      end do
      slip_rate = (column_of(point, 'slip') - slip_before)/dt
      stress = point%column(1, point%layout%stress)
      expected = 16.0e6_wp/schmid*((strain/dt)/(active*schmid)/1.0e-3_wp)**0.02_wp
      axis = matmul(direction/norm2(direction), transpose(matrix_of(orientation_of(point))))
      call say(name//': stress over the exact less 1', stress/expected - 1.0_wp)
      call say(name//': slip per strain over the exact less 1', slip_rate*dt/strain*schmid - 1.0_wp)
      call say(name//': the axis has turned, degrees', 180.0_wp/pi*acos(min(1.0_wp, axis(1))))
      call test%check(worst < 1.0e-6_wp, name//': uniaxial stress')
      call test%check(abs(stress/expected - 1.0_wp) < 5.0e-4_wp, name// &
                      ': stress by Schmid''s factor and the rate')
      call test%check(abs(slip_rate*dt/strain*schmid - 1.0_wp) < 2.0e-4_wp, name// &
                      ': slip by Schmid''s factor')
      call test%check(acos(min(1.0_wp, axis(1))) < 1.0e-4_wp, name//': the axis keeps its direction')
   end subroutine multiple_slip

   !> Tension of a BCC crystal along [001], where systems of several Schmid factors m slip: the strain rate is
   !> the sum of m times a (stress m/tau0)^n, which says the stress.
   subroutine bcc_slip(kind)
      integer, intent(in) :: kind !< of slip_words
      type(point_t) :: point
      real(wp), parameter :: strain = 5.0e-5_wp, dt = 5.0e-2_wp, n = 50.0_wp
      real(wp), allocatable :: normals(:, :), directions(:, :), m(:)
      real(wp) :: left, expected, before, stress, slip
      integer :: t
      call make_slip_systems(kind, normals, directions)
      m = abs(normals(3, :)*directions(3, :))
      call point%ready(law_of('crystal', perfect//', slip_systems='''//trim(slip_words(kind))//''''), 1, &
                       reshape(along_x([0.0_wp, 0.0_wp, 1.0_wp]), [4, 1]))
      before = 0.0_wp
      do t = 1, 400
         before = column_of(point, 'slip')
         call point%pull(strain, dt, left)
      end do
      stress = point%column(1, point%layout%stress)
      slip = (column_of(point, 'slip') - before)/strain
      expected = 16.0e6_wp*(strain/dt/(1.0e-3_wp*sum(m**(n + 1.0_wp))))**(1.0_wp/n)
      call say(trim(slip_words(kind))//' along [001]: stress over the exact less 1', stress/expected - 1.0_wp)
      call test%check(abs(stress/expected - 1.0_wp) < 5.0e-4_wp, &
                      'BCC: stress by all Schmid''s factors and the rate')
      call test%check(abs(slip*sum(m**(n + 1.0_wp))/sum(m**n) - 1.0_wp) < 5.0e-4_wp, &
                      'BCC: slip by all Schmid''s factors')
   end subroutine bcc_slip

   real(wp) function column_of(point, name)
      type(point_t), intent(in) :: point
      character(len=*), intent(in) :: name
      column_of = point%column(1, point%table%column(name))
   end function column_of

   function orientation_of(point) result(q)
      type(point_t), intent(in) :: point
      real(wp) :: q(4)
      associate (o => point%table%column('orientation'))
         q = point%column(1, o:o + 3)
      end associate
   end function orientation_of

   !> Tension along [123]: one system slips, with Schmid's factor 8/(7 sqrt(6)), and the lattice turns so that
   !> the slip direction comes nearer to the axis: sin(angle) times the length stays (Schmid and Boas).
   subroutine single_slip()
      type(point_t) :: point
      real(wp), parameter :: dt = 0.2_wp
      real(wp), allocatable :: normals(:, :), directions(:, :), factors(:)
      real(wp) :: left, worst, d(3), q(4), axis(3), length, first, now, expected, strain, stress, schmid, &
         worst_turn, rate, turned(3, 3)
      integer :: t, a
      integer, parameter :: steps = 400
      d = [1.0_wp, 2.0_wp, 3.0_wp]/sqrt(14.0_wp)
      call make_slip_systems(1, normals, directions)
      factors = abs(matmul(d, normals)*matmul(d, directions))
      a = maxloc(factors, dim=1)
      call test%check_close(factors(a), 8/(7*sqrt(6.0_wp)), 1.0e-12_wp, '[123]: the largest Schmid factor')
      q = along_x(d)
      call point%ready(law_of('crystal', perfect), 1, reshape(q, [4, 1]))
      length = 1.0_wp
      worst = 0.0_wp
      worst_turn = 0.0_wp
      first = acos(abs(dot_product(d, directions(:, a))))
      do t = 1, steps
         strain = 2.0e-4_wp
         call point%pull(strain, dt, left)
         call keep_worst(worst, left)
         length = length*(1.0_wp + strain)
         axis = matmul([1.0_wp, 0.0_wp, 0.0_wp], matrix_of(orientation_of(point))) ! of the pull, along the
                                                                                   ! lattice's axes
         now = acos(abs(dot_product(axis, directions(:, a))))
         stress = point%column(1, point%layout%stress)
         if (t < 50) cycle
         schmid = abs(dot_product(axis, normals(:, a))*dot_product(axis, directions(:, a)))
         rate = strain/dt/schmid
         expected = asin(sin(first)/(length*(1.0_wp - stress/modulus(d))))
         call keep_worst(worst_turn, (now - expected)/(first - expected))
      end do
      expected = 16.0e6_wp/schmid*(rate/1.0e-3_wp)**0.02_wp
      call say('[123]: stress over the exact less 1, at 8 %', stress/expected - 1.0_wp)
      call say('[123]: turn of the lattice, degrees', column_of(point, 'lattice_rotation'))
      call say('[123]: turn against Schmid and Boas, relative', worst_turn)
      call test%check(worst < 1.0e-6_wp, '[123]: uniaxial stress')
      call test%check(abs(stress/expected - 1.0_wp) < 2.0e-4_wp, '[123]: stress by Schmid''s factor')
      call test%check(worst_turn < 1.0e-4_wp, '[123]: the lattice turns as by Schmid and Boas')
      turned = matmul(matrix_of(orientation_of(point)), transpose(matrix_of(q)))
      call test%check_close(column_of(point, 'lattice_rotation'), &
                            180.0_wp/pi*acos(0.5_wp*(turned(1, 1) + turned(2, 2) + turned(3, 3) - 1.0_wp)), &
                            1.0e-6_wp, '[123]: lattice_rotation is the angle from the first orientation')
   end subroutine single_slip

   !> Young's modulus of the copper above along a direction.
   real(wp) function modulus(d)
      real(wp), intent(in) :: d(3)
      real(wp), parameter :: c11 = 170e9_wp, c12 = 124e9_wp, c44 = 75e9_wp
      real(wp) :: s11, s12
      s11 = (c11 + c12)/((c11 - c12)*(c11 + 2.0_wp*c12))
      s12 = -c12/((c11 - c12)*(c11 + 2.0_wp*c12))
      modulus = 1.0_wp/(s11 - 2.0_wp*(s11 - s12 - 0.5_wp/c44)*((d(1)*d(2))**2 + (d(2)*d(3))**2 &
                + (d(3)*d(1))**2))
   end function modulus

   !> [001] with Peirce's hardening: each of 8 systems is hardened by itself and 7 others, the other 4 by 8.
   !> g = tau0 + (tau_s - tau0) (1 + 7 q)/8 tanh(h0 gamma/(tau_s - tau0)).
   subroutine hardening_peirce()
      type(point_t) :: point
      real(wp) :: left, slip, g(12), expected(2), grown
      integer :: t
      call point%ready(law_of('crystal', peirce), 1, reshape(along_x([0.0_wp, 0.0_wp, 1.0_wp]), [4, 1]))
      do t = 1, 600
         call point%pull(1.0e-4_wp, 0.1_wp, left)
      end do
      slip = column_of(point, 'slip')
      associate (r => point%table%column('slip_resistance'))
         g = point%column(1, r:r + 11)
      end associate
      grown = 44.0e6_wp*tanh(300.0_wp*slip/44.0_wp)
      expected = 16.0e6_wp + grown*[(1.0_wp + 7.0_wp*1.4_wp)/8.0_wp, 1.4_wp]
      call say('Peirce: resistance over the exact less 1, active', minval(g)/expected(1) - 1.0_wp)
      call say('Peirce: resistance over the exact less 1, latent', maxval(g)/expected(2) - 1.0_wp)
      call test%check(abs(minval(g)/expected(1) - 1.0_wp) < 2.0e-3_wp, &
                      'Peirce: active systems harden as they should')
      call test%check(abs(maxval(g)/expected(2) - 1.0_wp) < 2.0e-3_wp, &
                      'Peirce: latent systems harden as they should')
      call test%check(count(g < sum(expected)/2) == 8, 'Peirce: 8 systems are active')
   end subroutine hardening_peirce

   !> [001] with Kalidindi's: 4 planes of 2 active systems; dg/dgamma = h0 (1 - g/tau_s)^a (2 + 6 q) by the
   !> slip of one.
   subroutine hardening_kalidindi()
      type(point_t) :: point
      real(wp), parameter :: a = 2.25_wp
      real(wp) :: left, slip, g(12), expected
      integer :: t
      call point%ready(law_of('crystal', voce), 1, reshape(along_x([0.0_wp, 0.0_wp, 1.0_wp]), [4, 1]))
      do t = 1, 600
         call point%pull(1.0e-4_wp, 0.1_wp, left)
      end do
      slip = column_of(point, 'slip')/8.0_wp
      associate (r => point%table%column('slip_resistance'))
         g = point%column(1, r:r + 11)
      end associate
      expected = 148.0e6_wp*(1.0_wp - ((1.0_wp - 16.0_wp/148.0_wp)**(1.0_wp - a) &
                                       + (a - 1.0_wp)*180.0_wp/148.0_wp*(2.0_wp + 6.0_wp*1.4_wp) &
                                       *slip)**(1.0_wp/(1.0_wp - a)))
      call say('Kalidindi: resistance over the exact less 1, active', minval(g)/expected - 1.0_wp)
      call test%check(abs(minval(g)/expected - 1.0_wp) < 3.0e-3_wp, &
                      'Kalidindi: active systems harden as they should')
   end subroutine hardening_kalidindi

   !> Orientations at random, all alike likely (Shoemake 1992).
   function random_rotations(n) result(q)
      integer, intent(in) :: n
      real(wp) :: q(4, n), u(3)
      integer :: i
      do i = 1, n
         u = chance%several(3, 0.0_wp, 1.0_wp)
         q(:, i) = [sqrt(1.0_wp - u(1))*sin(2*pi*u(2)), sqrt(1.0_wp - u(1))*cos(2*pi*u(2)), &
                    sqrt(u(1))*sin(2*pi*u(3)), sqrt(u(1))*cos(2*pi*u(3))]
      end do
   end function random_rotations

   !> 500 grains that all have the strain of the whole, isochoric and uniaxial: slip over strain, and work
   !> over tau0 times strain. Taylor's (1938) 3.06; of 12 {111}<110> systems by Bishop and Hill 3.067. Low
   !> rate sensitivity.
   subroutine taylor_factor()
      type(point_t) :: point
      integer, parameter :: grains = 500, steps = 300
      real(wp), parameter :: strain = 1.0e-4_wp, dt = 0.1_wp
      real(wp) :: increment(3, 3), before, factor, stress(3, 3), by_work
      integer :: t, p
      call point%ready(law_of('crystal', copper// &
                              'rate_sensitivity=0.005, tau0=16e6, tau_s=16e6, h0=0, q=1'), grains, &
                       random_rotations(grains))
      increment = 0.0_wp
      increment(1, 1) = strain
      increment(2, 2) = 1.0_wp/sqrt(1.0_wp + strain) - 1.0_wp
      increment(3, 3) = increment(2, 2)
      before = 0.0_wp
      do t = 1, steps
         if (t == steps/2 + 1) before = sum(point%column(:, point%table%column('slip')))/grains
         call point%strain_by(increment, dt)
      end do
      factor = (sum(point%column(:, point%table%column('slip')))/grains - before)/(strain*(steps/2))
      stress = 0.0_wp
      do p = 1, grains
         stress = stress + point%stress_of(p)/grains
      end do
      by_work = (stress(1, 1) - 0.5_wp*(stress(2, 2) + stress(3, 3)))/16.0e6_wp
      call say('Taylor factor of 500 grains, by slip', factor)
      call say('Taylor factor of 500 grains, by stress', by_work)
      call test%check(abs(factor/3.06_wp - 1.0_wp) < 0.03_wp, 'Taylor factor by slip')
      call test%check(abs(by_work/3.06_wp - 1.0_wp) < 0.03_wp, 'Taylor factor by stress')
   end subroutine taylor_factor

   !> A path with flow and a rotation on top: the same stress, turned, the same resistances, slip and work;
   !> the lattice turns with.
   subroutine turning()
      type(point_t) :: still, turned
      real(wp) :: q(3, 3), next(3, 3), increment(3, 3), worst, last
      integer :: t
      call still%ready(law_of('crystal', voce), 1, reshape(from_euler([0.4_wp, 0.9_wp, 0.2_wp]), [4, 1]))
      call turned%ready(law_of('crystal', voce), 1, reshape(from_euler([0.4_wp, 0.9_wp, 0.2_wp]), [4, 1]))
      q = identity()
      worst = 0.0_wp
      do t = 1, 100
         increment = reshape(chance%several(9, -2.0e-3_wp, 2.0e-3_wp), [3, 3])
         next = matmul(rotation(chance%several(3, -1.0_wp, 1.0_wp), 0.5_wp), q)
         call still%strain_by(increment, 1.0_wp)
         call turned%strain_by(matmul(next, matmul(identity() + increment, transpose(q))) &
                               - identity(), 1.0_wp)
         q = next
         call keep_worst(worst, &
                         maxval(abs(turned%stress_of(1) &
                                    - matmul(q, matmul(still%stress_of(1), transpose(q)))))/16.0e6_wp)
      end do
      call keep_worst(worst, column_of(turned, 'slip')/column_of(still, 'slip') - 1.0_wp)
      call keep_worst(worst, column_of(turned, 'plastic_work')/column_of(still, 'plastic_work') - 1.0_wp)
      last = maxval(abs(matrix_of(orientation_of(turned)) - matmul(q, matrix_of(orientation_of(still)))))
      call say('superposed rotation, relative error of stress, slip, work', worst)
      call say('superposed rotation, error of the orientation', last)
      call test%check(column_of(still, 'slip') > 0.1_wp, 'the path has flow')
      call test%check(worst < 1.0e-5_wp, 'superposed rotation: stress, slip, work')
      call test%check(last < 1.0e-8_wp, 'superposed rotation: orientation')
   end subroutine turning

   !> What a particle does is the same, to the bit, with others beside it in the vector and alone.
   subroutine in_lanes()
      integer, parameter :: count = 19
      type(point_t) :: together, alone
      real(wp), parameter :: dt = 1.0e-6_wp
      real(wp) :: size_of, worst
      integer :: p, t
      call together%ready(law_of('crystal', voce), count, random_rotations(count))
      alone = together
      do t = 1, 30
         do p = 1, count
            size_of = 10.0_wp**(-2.0_wp - 0.15_wp*p)
            together%gradient(p, :) = size_of*chance%several(9, -1.0_wp, 1.0_wp)/dt
         end do
         alone%gradient = together%gradient
         call together%law%update(together%column, together%layout, together%gradient, dt, 1, count)
         do p = 1, count
            call alone%law%update(alone%column, alone%layout, alone%gradient, dt, p, p)
         end do
      end do
      worst = maxval(abs(together%column - alone%column))
      call say('lanes: largest difference of a field, together or alone', worst)
      call test%check(worst <= 0.0_wp, 'lanes: none depends on the others')
      associate (slip => together%column(:, together%table%column('slip')))
         call test%check(any(slip > 0.01_wp), 'lanes: the paths have flow')
      end associate
   end subroutine in_lanes

   !> The solve in lanes finds what the guarded solve finds, within the tolerance of both; on paths of
   !> explicit steps it finds nearly all.
   subroutine against_guarded()
      class(material_t), allocatable :: law
      type(crystals_t) :: some
      type(slip_t) :: one
      real(wp), parameter :: dt = 1.0e-3_wp
      real(wp) :: rate(lanes, 9), turn(3, 3), slip, worst
      integer :: found, p, slipping, t
      law = law_of('crystal', voce)
      select type (law)
      class is (crystal_t)
         associate (c => law%constants)
            allocate (one%resistance(c%width), one%modulus(c%width))
            some%resistance = 16.0e6_wp
            some%modulus = 180.0e6_wp
            do p = 1, lanes
               some%stretch(p, :, :) = identity()
               rate(p, :) = chance%several(9, -1.0_wp, 1.0_wp)
            end do
            worst = 0.0_wp
            found = 0
            slipping = 0
            do t = 1, 200
               do p = 1, lanes
                  some%increment(p, :, :) = 1.0e-4_wp*reshape(rate(p, :), [3, 3])
                  some%increment(p, 3, 3) = -some%increment(p, 1, 1) - some%increment(p, 2, 2)
               end do
               call deform_elastically(c, slip_threshold(c, dt), some)
               slipping = slipping + count(.not. some%found)
               found = found - count(some%found)
               one%stretch = some%stretch(1, :, :)
               one%increment = some%increment(1, :, :)
               one%resistance = some%resistance(1, :c%width)
               one%modulus = some%modulus(1, :c%width)
               call flow(c, dt, slip_threshold(c, dt), one)
               if (.not. all(some%found)) call let_slip(c, dt, slip_threshold(c, dt), some)
               found = found + count(some%found)
               slip = max(some%slip(1), 1.0e-6_wp)
               if (some%found(1)) worst = max(worst, abs(one%slip - some%slip(1))/slip, &
                                              maxval(abs(one%elastic - some%elastic(1, :, :)))/slip)
               some%modulus = 180.0e6_wp
               do p = 1, lanes
                  call polar(some%elastic(p, :, :), turn, one%stretch)
                  some%stretch(p, :, :) = one%stretch
               end do
            end do
         end associate
      end select
      call say('lanes: difference to the guarded solve, of the slip of a step', worst)
      call say('lanes: share of slips that they find', real(found, wp)/max(1, slipping))
      call test%check(worst < 1.0e-4_wp, 'lanes: as the guarded solve')
      call test%check(slipping > 1000, 'lanes: there is slip')
      call test%check(found > 0.95_wp*slipping, 'lanes: nearly all are found in lanes')
   end subroutine against_guarded

   !> Random orientations, increments from 1e-6 to 3e-2, rates from 1e-3 to 1e6 1/s, holds and reversals: a
   !> solution is found in each step, work never falls, the stress agrees with the slip by the law, volume is
   !> kept by slip.
   subroutine random_paths(systems, count)
      character(len=*), intent(in) :: systems
      integer, intent(in) :: count
      type(point_t) :: point
      class(material_t), allocatable :: law
      real(wp), allocatable :: work(:), size_of(:), rate(:)
      real(wp) :: least, volume, dt
      integer :: t, p, lost
      if (systems == 'fcc') law = law_of('crystal', voce//', slip_systems=''fcc''')
      if (systems /= 'fcc') law = law_of('crystal', peirce//', slip_systems='''//systems//'''')
      call point%ready(law, count, random_rotations(count))
      allocate (work(count), source=0.0_wp)
      size_of = 10.0_wp**chance%several(count, -6.0_wp, -1.5_wp)
      least = huge(least)
      volume = 0.0_wp
      lost = 0
      do t = 1, 20
         dt = 10.0_wp**chance%between(-9.0_wp, 0.0_wp)
         do p = 1, count
            rate = merge(0.0_wp, 1.0_wp, chance%between(0.0_wp, 1.0_wp) < 0.1_wp) &
                   *chance%several(9, -1.0_wp, 1.0_wp)
            point%gradient(p, :) = size_of(p)*rate/dt
            point%gradient(p, [1, 5, 9]) = point%gradient(p, [1, 5, 9]) &
               - 0.9_wp*sum(point%gradient(p, [1, 5, 9]))/3.0_wp
         end do
         call point%each_by(dt)
         associate (s => point%column(:, point%layout%stress:point%layout%stress + 5), &
                    w => point%column(:, point%table%column('plastic_work')))
            do p = 1, count
               if (.not. all(abs(s(p, :)) < 1.0e12_wp)) lost = lost + 1
            end do
            least = min(least, minval(w - work))
            work = w
         end associate
      end do
      do p = 1, count
         call keep_worst(volume, elastic_volume(point, p)/point%column(p, point%layout%volume) - 1.0_wp)
      end do
      call say(systems//': random paths, least work of a step, J/m3', least)
      call say(systems//': random paths, volume that slip has changed', volume)
      call test%check_equal(lost, 0, systems//': a solution in every step')
      call test%check(least >= 0.0_wp, systems//': dissipation is never negative')
      call test%check(volume < 1.0e-10_wp, systems//': slip keeps the volume')
   end subroutine random_paths

   real(wp) function elastic_volume(point, p)
      type(point_t), intent(in) :: point
      integer, intent(in) :: p
      real(wp) :: u(6)
      associate (e => point%table%column('elastic_stretch'))
         u = point%column(p, e:e + 5)
      end associate
      elastic_volume = u(1)*(u(2)*u(3) - u(4)**2) - u(6)*(u(6)*u(3) - u(4)*u(5)) &
                       + u(5)*(u(6)*u(4) - u(2)*u(5))
   end function elastic_volume

   !> What does not move has no stress, to the bit.
   subroutine at_rest()
      type(point_t) :: point
      call point%ready(law_of('crystal', voce), 1, reshape(from_euler([0.4_wp, 0.9_wp, 0.2_wp]), [4, 1]))
      call point%strain_by(0.0_wp*identity(), 1.0_wp)
      call test%check(all(abs(point%stress_of(1)) <= 0.0_wp), 'no stress without strain')
   end subroutine at_rest

   !> Work of the stress on a path with flow, turns and a reversal: it is in the strain energy and the plastic
   !> work; what is missing falls with the step.
   subroutine balance()
      real(wp) :: coarse, fine
      call walk(400, coarse)
      call walk(800, fine)
      call say('work on a path less energy and plastic work, relative', fine)
      call test%check(abs(fine) < 2.0e-3_wp, 'energy is kept')
      call test%check(abs(coarse/fine) > 1.8_wp, 'what is missing falls with the step')
   end subroutine balance

   subroutine walk(steps, off)
      integer, intent(in) :: steps
      real(wp), intent(out) :: off
      type(point_t) :: point
      real(wp) :: l(3, 3), before(3, 3), work, volume, whole
      integer :: t
      call point%ready(law_of('crystal', voce), 1, reshape(from_euler([0.4_wp, 0.9_wp, 0.2_wp]), [4, 1]))
      l = reshape([0.08_wp, 0.05_wp, -0.03_wp, 0.0_wp, -0.03_wp, 0.1_wp, 0.02_wp, 0.0_wp, -0.049_wp], [3, 3])
      work = 0.0_wp
      whole = 0.0_wp
      do t = 1, steps
         if (t == 2*steps/3) l = -l
         before = point%stress_of(1)
         volume = point%column(1, point%layout%volume)
         call point%strain_by(l/steps, 1.0_wp/steps)
         work = work + 0.5_wp*(volume + point%column(1, point%layout%volume))*0.5_wp &
                *sum((before + point%stress_of(1))*l)/steps
         whole = point%law%strain_energy(point%column, point%layout, 1, 1) &
                 + point%law%plastic_energy(point%column, 1, 1)
      end do
      off = whole/work - 1.0_wp
   end subroutine walk

end program crystal
