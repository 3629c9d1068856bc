!> Kinematic hardening of J2, one particle: loops and ratchetting of Armstrong and Frederick against closed
!> forms, linear hardening, no back stress.
program cyclic
   use m_kinds, only: wp
   use m_communicator, only: communicator_t
   use m_j2, only: j2_t
   use m_material_point, only: material_point_t, read_law
   use m_assertions, only: assertions_t
   use m_chance, only: say
   implicit none
   real(wp), parameter :: young = 200.0e9_wp, density = 7850.0_wp, yield = 200.0e6_wp, dt = 1.0e-6_wp
   character(len=*), parameter :: steel = 'young=200e9, poisson=0.3, yield_stress=200e6'
   type(communicator_t) :: comm
   type(assertions_t) :: test
   call comm%start()
   call test%start(comm, 'cyclic')
   call stabilised_loop()
   call linear_loop()
   call ratchetting()
   call several()
   call all_laws_do()
   call refusals()
   call test%finish()

contains

   subroutine law_of(text, law)
      character(len=*), intent(in) :: text
      type(j2_t), intent(out) :: law
      character(len=:), allocatable :: complaint
      call read_law(law, text, complaint)
      call test%check(complaint == '', 'read: '//complaint)
   end subroutine law_of

   !> Uniaxial tension and compression between strains of +-a: the stress at the tips of the stabilised loop
   !> is yield + X with X = C/gamma tanh(gamma da_p/2), da_p half the width of plastic strain, which both
   !> ends' elastic strains leave.
   subroutine stabilised_loop()
      type(j2_t) :: law
      type(material_point_t) :: point
      real(wp), parameter :: c = 60.0e9_wp, gamma = 400.0_wp, a = 0.006_wp
      real(wp) :: tip, half_width, low, high
      integer :: cycle_number, k
      integer, parameter :: steps = 400
      call law_of(steel//', kinematic_modulus=60e9, kinematic_recovery=400', law)
      call point%ready(law, density)
      do k = 1, steps
         call point%pull(law, a/steps, dt)
      end do
      do cycle_number = 1, 6
         do k = 1, 2*steps
            call point%pull(law, -a/steps, dt)
         end do
         do k = 1, 2*steps
            call point%pull(law, a/steps, dt)
         end do
      end do
      low = yield
      high = yield + c/gamma
      do k = 1, 200 ! tip = yield + C/gamma tanh(gamma (a - tip/E))
         tip = 0.5_wp*(low + high)
         half_width = a - tip/young
         if (tip < yield + c/gamma*tanh(gamma*half_width)) then
            low = tip
         else
            high = tip
         end if
      end do
      call say('Armstrong-Frederick, stabilised loop: stress at the tip, relative error', &
               abs(point%column(1, point%layout%stress)/tip - 1.0_wp))
      call test%check_close(point%column(1, point%layout%stress)/tip, 1.0_wp, 1.0e-3_wp, &
                            'stabilised loop of Armstrong and Frederick')
      call test%check(tip > yield + 0.5_wp*c/gamma, 'the loop is wide')
      call test%check_close((law%plastic_energy(point%column, 1, 1) &
                             + law%strain_energy(point%column, point%layout, 1, 1)) &
                            /point%work, 1.0_wp, 2.0e-3_wp, 'work is stored or dissipated')
   end subroutine stabilised_loop

   !> Linear: the stress falls by twice the yield stress before it yields in reverse, and the slope is E C/(E
   !> + C).
   subroutine linear_loop()
      type(j2_t) :: law
      type(material_point_t) :: point
      real(wp), parameter :: c = 10.0e9_wp, a = 0.01_wp
      real(wp) :: expected
      integer :: k
      call law_of(steel//', kinematic_modulus=10e9', law)
      call point%ready(law, density)
      do k = 1, 200
         call point%pull(law, a/200, dt)
      end do
      expected = yield + young*c/(young + c)*(a - yield/young)
      call test%check_close(point%column(1, point%layout%stress)/expected, 1.0_wp, 1.0e-5_wp, &
                            'linear: stress of extension')
      do k = 1, 400
         call point%pull(law, -a/200, dt)
      end do
      expected = expected - 2.0_wp*yield - young*c/(young + c)*(2.0_wp*a - 2.0_wp*yield/young)
      call test%check_close(point%column(1, point%layout%stress)/expected, 1.0_wp, 1.0e-5_wp, &
                            'linear: stress after reversal')
   end subroutine linear_loop

   !> Between two stresses with a mean: plastic strain of each cycle is 1/gamma ln(((C/gamma)^2 -
   !> Xlow^2)/((C/gamma)^2 - Xhigh^2)).
   subroutine ratchetting()
      type(j2_t) :: law
      type(material_point_t) :: point
      real(wp), parameter :: c = 60.0e9_wp, gamma = 400.0_wp, top = 320.0e6_wp, bottom = -260.0e6_wp
      real(wp) :: expected, before, rate
      integer :: cycle_number, k
      integer, parameter :: steps = 60
      call law_of(steel//', kinematic_modulus=60e9, kinematic_recovery=400', law)
      call point%ready(law, density)
      rate = 0.0_wp
      do k = 1, steps
         call point%stress_to(law, top*k/steps, dt)
      end do
      do cycle_number = 1, 3
         before = point%axial
         do k = 1, 2*steps
            call point%stress_to(law, top + (bottom - top)*k/(2*steps), dt)
         end do
         do k = 1, 2*steps
            call point%stress_to(law, bottom + (top - bottom)*k/(2*steps), dt)
         end do
         rate = point%axial - before
      end do
      expected = log(((c/gamma)**2 - (bottom + yield)**2)/((c/gamma)**2 - (top - yield)**2))/gamma
      call say('ratchetting: strain a cycle', rate)
      call say('the same, relative error', abs(rate/expected - 1.0_wp))
      call test%check_close(rate/expected, 1.0_wp, 1.0e-3_wp, 'ratchetting rate of Armstrong and Frederick')
   end subroutine ratchetting

   !> Several back stresses and a table beside them, in extension: each by its closed form; they stay
   !> deviators.
   subroutine several()
      type(j2_t) :: law
      type(material_point_t) :: point
      real(wp) :: flowed, expected
      integer :: k
      call law_of('young=200e9, poisson=0.3, hardening_strain=0,0.01,0.05, '// &
                  'hardening_stress=200e6,260e6,300e6, '// &
                  'kinematic_modulus=100e9,20e9,2e9, kinematic_recovery=2000,200,0', law)
      call point%ready(law, density)
      do k = 1, 300
         call point%pull(law, 0.03_wp/300, dt)
      end do
      flowed = point%field('plastic_strain')
      expected = 260.0e6_wp + 40.0e6_wp*(flowed - 0.01_wp)/0.04_wp &
                 + 50.0e6_wp*(1.0_wp - exp(-2000.0_wp*flowed)) &
                 + 100.0e6_wp*(1.0_wp - exp(-200.0_wp*flowed)) + 2.0e9_wp*flowed
      call test%check(flowed > 0.025_wp, 'several: it flows')
      call test%check_close(point%column(1, point%layout%stress)/expected, 1.0_wp, 1.0e-9_wp, &
                            'several back stresses and a table: stress over plastic strain')
      call test%check_close(point%axial - point%column(1, point%layout%stress)/young, flowed, 1.0e-6_wp, &
                            'several: strains add up')
      associate (back => law%kinematic%back)
         call test%check_close(point%field('back_stress_1')/(2.0_wp/3.0_wp*50.0e6_wp), 1.0_wp, 1.0e-9_wp, &
                               'the first is saturated')
         call test%check_close(sum(point%column(1, back(2):back(2) + 2))/50.0e6_wp, 0.0_wp, 1.0e-12_wp, &
                               'back stresses are deviators')
      end associate
   end subroutine several

   subroutine all_laws_do()
      type(j2_t) :: law
      type(material_point_t) :: point
      call law_of(steel//', kinematic_modulus=100e9,20e9, kinematic_recovery=800,50', law)
      call point%follows_turns(law, density, 0.01_wp, 1.0_wp, 'kinematic', test)
      call point%dissipates(law, density, 10000, 1.0_wp, 'kinematic', test)
   end subroutine all_laws_do

   subroutine refusals()
      type(j2_t) :: law
      character(len=:), allocatable :: complaint
      call read_law(law, steel//', kinematic_recovery=400', complaint)
      call test%check(index(complaint, 'kinematic_modulus: missing') > 0, 'recovery needs a modulus: '// &
                      complaint)
      law = j2_t()
      call read_law(law, steel//', kinematic_modulus=1e9,1e9, kinematic_recovery=400', complaint)
      call test%check(index(complaint, 'must have as many numbers as kinematic_modulus') > 0, &
                      'as many of both: '//complaint)
   end subroutine refusals

end program cyclic
