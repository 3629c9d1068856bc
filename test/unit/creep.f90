!> Creep and relaxation of one particle against closed forms: norton (secondary, primary, table) and maxwell
!> (Prony series).
program creep
   use m_kinds, only: wp
   use m_communicator, only: communicator_t
   use m_material, only: material_t
   use m_norton, only: norton_t
   use m_maxwell, only: maxwell_t
   use m_material_point, only: material_point_t, read_law, identity
   use m_assertions, only: assertions_t
   use m_chance, only: say
   implicit none
   real(wp), parameter :: young = 150.0e9_wp, density = 7850.0_wp
   character(len=*), &
      parameter :: steel = 'young=150e9, poisson=0.3, creep_stress=100e6, creep_rate=1e-6, creep_exponent=5'
   character(len=*), parameter :: polymer = 'young=3e9, poisson=0.35, relaxation_times=0.1,2,30'
   type(communicator_t) :: comm
   type(assertions_t) :: test
   call comm%start()
   call test%start(comm, 'creep')
   call constant_stress()
   call relaxation()
   call fast_creep()
   call primary()
   call table()
   call with_plasticity()
   call shear_and_bulk()
   call creep_of_maxwell()
   call at_rest()
   call all_laws_do()
   call refusals()
   call test%finish()

contains

   subroutine law_of(law, text)
      class(material_t), intent(inout) :: law
      character(len=*), intent(in) :: text
      character(len=:), allocatable :: complaint
      call read_law(law, text, complaint)
      call test%check(complaint == '', 'read', complaint)
   end subroutine law_of

   !> 200 MPa for 100 s: the strain grows by 2^5 1e-6 a second, beside the elastic one; the volume is the
   !> elastic one.
   subroutine constant_stress()
      type(norton_t) :: law
      type(material_point_t) :: point
      real(wp), parameter :: stress = 200.0e6_wp, time = 100.0_wp
      integer :: k
      call law_of(law, steel)
      call point%ready(law, density)
      do k = 1, 10
         call point%stress_to(law, stress*k/10, 1.0e-9_wp)
      end do
      do k = 1, 1000
         call point%stress_to(law, stress, time/1000)
      end do
      call say('Norton at constant stress: strain, relative error', &
               point%axial/(stress/young + 32.0e-6_wp*time) - 1.0_wp)
      call test%check_close(point%axial/(stress/young + 32.0e-6_wp*time), 1.0_wp, 1.0e-6_wp, &
                            'Norton: strain at constant stress')
      call test%check_close(point%field('creep_strain')/(32.0e-6_wp*time), 1.0_wp, 1.0e-6_wp, &
                            'Norton: the creep strain')
      call test%check_close(point%axial + 2.0_wp*point%lateral, stress*(1.0_wp - 2.0_wp*0.3_wp)/young, &
                            1.0e-9_wp, 'creep keeps the volume')
      call test%check_close((law%plastic_energy(point%column, 1, 1) &
                             + law%strain_energy(point%column, point%layout, 1, 1)) &
                            /point%work, 1.0_wp, 2.0e-3_wp, 'Norton: work is stored or dissipated')
   end subroutine constant_stress

   !> Held: s^-4 = s0^-4 + 4 E A t/sc^5.
   subroutine relaxation()
      type(norton_t) :: law
      type(material_point_t) :: point
      real(wp), parameter :: stress = 300.0e6_wp
      real(wp) :: expected, off(3)
      integer :: half, k, steps
      call law_of(law, steel)
      expected = (stress**(-4) + 4.0_wp*young*1.0e-6_wp*50.0_wp/100.0e6_wp**5)**(-0.25_wp)
      do half = 1, 3
         steps = merge(1, 500*half, half == 3)
         call point%ready(law, density)
         call point%stress_to(law, stress, 1.0e-9_wp)
         do k = 1, steps
            call point%pull(law, 0.0_wp, 50.0_wp/steps)
         end do
         off(half) = abs(point%column(1, point%layout%stress)/expected - 1.0_wp)
      end do
      call say('Norton, relaxation in 500 steps: stress, relative error', off(1))
      call say('the same in one step', off(3))
      call test%check(expected < 0.6_wp*stress, 'it relaxes much')
      call test%check(off(1) < 5.0e-3_wp .and. off(2) < 0.52_wp*off(1), &
                      'Norton: relaxation, first order in the step')
      call test%check(off(3) < 0.5_wp, 'Norton: one large step is stable')
   end subroutine relaxation

   !> Strained at a constant rate, in steps that by elasticity alone would bring many times the stress: the
   !> work of creep against the differential equation s' = E (e' - A (s/sc)^n), and against the work done. The
   !> trial stress in place of the one before the step, which also gives a balance at slow creep, does not.
   subroutine fast_creep()
      type(norton_t) :: law
      type(material_point_t) :: point
      real(wp), parameter :: rate = 1.0e-3_wp, span = 20.0_wp, shear = young/2.6_wp
      real(wp) :: stress, exact, by_trial, before, off(3), small, now, crept
      integer :: k, turn, steps
      call law_of(law, 'young=150e9, poisson=0.3, creep_stress=100e6, creep_rate=1e-5, creep_exponent=5')
      stress = 0.0_wp
      exact = 0.0_wp
      small = 1.0e-5_wp
      do k = 1, nint(span/small)
         now = stress + 0.5_wp*small*young*(rate - 1.0e-5_wp*(stress/100.0e6_wp)**5)
         crept = small*1.0e-5_wp*(now/100.0e6_wp)**5
         exact = exact + now*crept
         stress = stress + young*(small*rate - crept)
      end do
      do turn = 1, 2
         steps = 20*turn
         call point%ready(law, density)
         by_trial = 0.0_wp
         do k = 1, steps
            before = point%field('creep_strain')
            call point%pull(law, rate*span/steps, span/steps)
            crept = point%field('creep_strain') - before
            by_trial = by_trial + crept*(point%mises(1) + 1.5_wp*shear*crept)
         end do
         off(turn) = law%plastic_energy(point%column, 1, 1)/exact - 1.0_wp
         off(3) = (law%plastic_energy(point%column, 1, 1) &
                   + law%strain_energy(point%column, point%layout, 1, 1))/point%work - 1.0_wp
         call test%check_close(off(3), 0.0_wp, 1.0e-3_wp, 'Norton, fast: work is stored or dissipated')
         call test%check(by_trial/exact - 1.0_wp > 10.0_wp*abs(off(turn)), &
                         'Norton, fast: the trial stress would book too much')
      end do
      call say('Norton, fast: work of creep, relative error in 20 steps', off(1))
      call say('the same in 40 steps', off(2))
      call say('the same with the trial stress', by_trial/exact - 1.0_wp)
      call test%check(abs(off(1)) < 0.02_wp .and. abs(off(2)) < 0.6_wp*abs(off(1)), &
                      'Norton, fast: work of creep by the differential equation')
   end subroutine fast_creep

   !> Primary creep by a power of time at constant stress, exact whatever the step, and strain hardening at a
   !> jump.
   subroutine primary()
      type(norton_t) :: law
      type(material_point_t) :: point
      real(wp) :: expected, clock
      integer :: k
      call law_of(law, steel//', primary_strain=2e-4, primary_time=10, primary_exponent=0.4')
      call point%ready(law, density)
      call point%stress_to(law, 100.0e6_wp, 1.0e-9_wp)
      do k = 1, 20
         call point%stress_to(law, 100.0e6_wp, 1.0_wp)
      end do
      expected = 2.0e-4_wp*2.0_wp**0.4_wp + 1.0e-6_wp*20.0_wp
      call test%check_close(point%field('creep_strain')/expected, 1.0_wp, 1.0e-4_wp, &
                            'primary creep: a power of time')
      do k = 1, 20
         call point%stress_to(law, 150.0e6_wp, 1.0_wp)
      end do
      clock = 20.0_wp/1.5_wp**(5.0_wp/0.4_wp) ! that the strain would have taken at the higher stress
      expected = 1.5_wp**5*2.0e-4_wp*((clock + 20.0_wp)/10.0_wp)**0.4_wp &
                 + 1.0e-6_wp*(20.0_wp + 1.5_wp**5*20.0_wp)
      call say('primary creep after a jump of stress: relative error', point%field('creep_strain')/expected &
               - 1.0_wp)
      call test%check_close(point%field('creep_strain')/expected, 1.0_wp, 1.0e-4_wp, &
                            'primary creep: strain hardening')
   end subroutine primary

   !> A table: its points, between them and beyond them.
   subroutine table()
      type(norton_t) :: law
      type(material_point_t) :: point
      real(wp), parameter :: stresses(4) = [50.0e6_wp, 100.0e6_wp, sqrt(2.0_wp)*100.0e6_wp, 400.0e6_wp]
      real(wp), parameter :: rates(4) = [1.0e-8_wp, 1.0e-6_wp, 8.0e-6_wp, 64.0_wp*64.0e-6_wp]
      real(wp) :: grown
      integer :: k
      call law_of(law, 'young=150e9, poisson=0.3, creep_stress=50e6,100e6,200e6, creep_rate=1e-8,1e-6,64e-6')
      do k = 1, 4
         call point%ready(law, density)
         call point%stress_to(law, stresses(k), 1.0e-9_wp)
         grown = point%field('creep_strain')
         call point%stress_to(law, stresses(k), 1.0_wp)
         grown = point%field('creep_strain') - grown
         call test%check_close(grown/rates(k), 1.0_wp, 1.0e-6_wp, 'creep by a table')
      end do
   end subroutine table

   !> With a yield stress: beyond it flow at once, below it creep alone.
   subroutine with_plasticity()
      type(norton_t) :: law
      type(material_point_t) :: point
      integer :: k
      call law_of(law, steel//', yield_stress=200e6, hardening_modulus=20e9')
      call point%ready(law, density)
      do k = 1, 30
         call point%stress_to(law, 300.0e6_wp*k/30, 1.0e-6_wp)
      end do
      call test%check_close(point%field('plastic_strain'), 100.0e6_wp/20.0e9_wp, 1.0e-8_wp, &
            'norton: flow beyond the yield stress')
      do k = 1, 10
         call point%stress_to(law, 300.0e6_wp, 1.0_wp)
      end do
      call test%check_close(point%field('plastic_strain'), 100.0e6_wp/20.0e9_wp, 1.0e-8_wp, &
                            'norton: creep does not harden')
      call test%check_close(point%field('creep_strain')/(3.0_wp**5*1.0e-6_wp*10.0_wp), 1.0_wp, 1.0e-4_wp, &
            'norton: creep beside flow')
   end subroutine with_plasticity

   !> Strain at once, then held: shear and bulk modulus fall by their series; a long step ends where many
   !> short ones do.
   subroutine shear_and_bulk()
      type(maxwell_t) :: law
      type(material_point_t) :: point
      real(wp), parameter :: g(3) = [0.3_wp, 0.2_wp, 0.1_wp], b(3) = [0.1_wp, 0.0_wp, 0.2_wp], &
         tau(3) = [0.1_wp, 2.0_wp, 30.0_wp]
      real(wp), parameter :: e = 1.0e-4_wp, times(4) = [0.05_wp, 0.5_wp, 5.0_wp, 60.0_wp]
      real(wp) :: shear, bulk, m(3, 3), s(3, 3), off
      integer :: k, n
      call law_of(law, polymer//', shear_ratios=0.3,0.2,0.1, bulk_ratios=0.1,0,0.2')
      off = 0.0_wp
      do k = 1, size(times)
         do n = 1, 50, 49
            shear = 3.0e9_wp/2.7_wp*(1.0_wp - sum(g*(1.0_wp - exp(-times(k)/tau))))
            bulk = 3.0e9_wp/0.9_wp*(1.0_wp - sum(b*(1.0_wp - exp(-times(k)/tau))))
            call point%ready(law, density)
            m = 0.0_wp
            m(1, 2) = e
            m(2, 1) = e
            m(3, 3) = e
            call point%strain_by(law, m, 1.0e-9_wp)
            call hold(point, law, times(k), n)
            s = point%stress()
            off = max(off, abs(s(1, 2)/(2.0_wp*shear*e) - 1.0_wp), &
                      abs((s(1, 1) + s(2, 2) + s(3, 3))/(3.0_wp*bulk*e) - 1.0_wp), &
                      abs((s(3, 3) - s(1, 1))/(2.0_wp*shear*e) - 1.0_wp))
            call test%check_close((law%plastic_energy(point%column, 1, 1) &
                                   + law%strain_energy(point%column, point%layout, 1, 1))/point%work, &
                                   1.0_wp, 1.0e-3_wp, 'maxwell: what relaxes is dissipated')
         end do
      end do
      call say('maxwell, relaxation of shear and bulk: relative error', off)
      call test%check_close(off, 0.0_wp, 1.0e-3_wp, 'maxwell: relaxation by the series')
   end subroutine shear_and_bulk

   subroutine hold(point, law, time, steps)
      type(material_point_t), intent(inout) :: point
      class(material_t), intent(in) :: law
      real(wp), intent(in) :: time
      integer, intent(in) :: steps
      integer :: k
      do k = 1, steps
         call point%strain_by(law, 0.0_wp*identity(), time/steps)
      end do
   end subroutine hold

   !> Shear and bulk alike: a standard solid in tension, J(t) = 1/Ei - (1/Ei - 1/E) exp(-t/tau'), tau' = tau
   !> E/Ei.
   subroutine creep_of_maxwell()
      type(maxwell_t) :: law
      type(material_point_t) :: point
      real(wp), parameter :: stress = 1.0e6_wp, at_last = 1.2e9_wp
      real(wp) :: off, expected
      integer :: k
      call law_of(law, 'young=3e9, poisson=0.35, relaxation_times=2, shear_ratios=0.6, bulk_ratios=0.6')
      call point%ready(law, density)
      call point%stress_to(law, stress, 1.0e-9_wp)
      off = 0.0_wp
      do k = 1, 500
         call point%stress_to(law, stress, 0.02_wp)
         expected = stress*(1.0_wp/at_last - (1.0_wp/at_last - 1.0_wp/3.0e9_wp) &
                            *exp(-0.02_wp*k/(2.0_wp*3.0e9_wp/at_last)))
         off = max(off, abs(point%axial/expected - 1.0_wp))
      end do
      call say('maxwell at constant stress: strain, relative error', off)
      call test%check_close(off, 0.0_wp, 1.0e-3_wp, 'maxwell: creep of a standard solid')
   end subroutine creep_of_maxwell

   !> Branches that bear stress against each other are not at rest.
   subroutine at_rest()
      type(maxwell_t) :: law
      type(norton_t) :: metal
      type(material_point_t) :: point
      call law_of(law, polymer//', shear_ratios=0.3,0.2,0.1')
      call point%ready(law, density)
      call test%check(law%is_at_rest(point%column, point%layout, 1, 1), 'maxwell: at rest at the start')
      point%column(1, law%branch(2) + 3) = 1.0_wp
      point%column(1, law%branch(3) + 3) = -1.0_wp
      call test%check(.not. law%is_at_rest(point%column, point%layout, 1, 1), &
                      'maxwell: what relaxes is not at rest')
      call law_of(metal, steel)
      call point%ready(metal, density)
      call test%check(metal%is_at_rest(point%column, point%layout, 1, 1), &
                      'norton: without stress nothing creeps')
   end subroutine at_rest

   subroutine all_laws_do()
      type(norton_t) :: metal
      type(maxwell_t) :: law
      type(material_point_t) :: point
      call law_of(metal, steel//', yield_stress=200e6, hardening_modulus=1e9, primary_strain=1e-4')
      call point%follows_turns(metal, density, 0.001_wp, 10.0_wp, 'norton', test)
      call point%dissipates(metal, density, 2000, 1.0_wp, 'norton', test)
      call law_of(law, polymer//', shear_ratios=0.3,0.2,0.1, bulk_ratios=0.1,0,0.2')
      call point%follows_turns(law, density, 0.01_wp, 3.0_wp, 'maxwell', test)
      call point%dissipates(law, density, 10000, 0.05_wp, 'maxwell', test)
      call point%dissipates(law, density, 2000, 5.0_wp, 'maxwell, long steps', test)
   end subroutine all_laws_do

   subroutine refusals()
      call refused('young=1e9, poisson=0.3, relaxation_times=1', &
                   'one of shear_ratios and bulk_ratios must be there')
      call refused('young=1e9, poisson=0.3, relaxation_times=1,2, shear_ratios=0.5', &
            'must have as many numbers as relaxation_times')
      call refused('young=1e9, poisson=0.3, relaxation_times=1,2, shear_ratios=0.5,0.6', &
                   'must be at most 1 together')
      call refused_metal('young=1e9, poisson=0.3, creep_stress=1e6, creep_rate=1e-6', &
                         'creep_exponent: missing')
      call refused_metal('young=1e9, poisson=0.3, creep_stress=1e6,2e6, creep_rate=1e-6', &
            'must have as many numbers as creep_stress')
      call refused_metal('young=1e9, poisson=0.3, creep_stress=2e6,1e6, creep_rate=1e-6,1e-5', 'must rise')
   end subroutine refusals

   subroutine refused(text, sentence)
      character(len=*), intent(in) :: text, sentence
      type(maxwell_t) :: law
      character(len=:), allocatable :: complaint
      call read_law(law, text, complaint)
      call test%check(index(complaint, sentence) > 0, 'refused: '//sentence, complaint)
   end subroutine refused

   subroutine refused_metal(text, sentence)
      character(len=*), intent(in) :: text, sentence
      type(norton_t) :: law
      character(len=:), allocatable :: complaint
      call read_law(law, text, complaint)
      call test%check(index(complaint, sentence) > 0, 'refused: '//sentence, complaint)
   end subroutine refused_metal

end program creep
