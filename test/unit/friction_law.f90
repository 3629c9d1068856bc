!> drucker_prager, one particle: Mohr and Coulomb's strength in triaxial compression, dilation, the apex,
!> grains that part and meet, the cap and its hardening.
program friction_law
   use m_kinds, only: wp
   use m_constants, only: pi
   use m_communicator, only: communicator_t
   use m_drucker_prager, only: drucker_prager_t
   use m_material_point, only: material_point_t, read_law
   use m_assertions, only: assertions_t
   use m_chance, only: chance_t, say
   implicit none
   real(wp), parameter :: density = 2000.0_wp, young = 100.0e6_wp, poisson = 0.25_wp
   real(wp), parameter :: bulk = young/(3.0_wp*(1.0_wp - 2.0_wp*poisson)), &
      shear = young/(2.0_wp*(1.0_wp + poisson))
   character(len=*), parameter :: soil = 'young=100e6, poisson=0.25'
   type(communicator_t) :: comm
   type(assertions_t) :: test
   call comm%start()
   call test%start(comm, 'friction_law')
   call triaxial()
   call dilation()
   call growing()
   call apex()
   call grains()
   call crushing()
   call random_paths()
   call all_laws_do()
   call refusals()
   call test%finish()

contains

   subroutine law_of(law, text)
      type(drucker_prager_t), intent(out) :: law
      character(len=*), intent(in) :: text
      character(len=:), allocatable :: complaint
      call read_law(law, text, complaint)
      call test%check(complaint == '', 'read', complaint)
   end subroutine law_of

   pure function p_and_q(point) result(pq)
      type(material_point_t), intent(in) :: point
      real(wp) :: pq(2)
      associate (a => point%layout%stress)
         pq = [-(point%column(1, a) + point%column(1, a + 1) + point%column(1, a + 2))/3.0_wp, point%mises(1)]
      end associate
   end function p_and_q

   !> Uniaxial compression: strength 2 c cos/(1 - sin), as Mohr and Coulomb's.
   subroutine triaxial()
      type(drucker_prager_t) :: law
      type(material_point_t) :: point
      real(wp), parameter :: angle = 30.0_wp*pi/180.0_wp, c = 20.0e3_wp
      real(wp) :: strength
      integer :: k
      call law_of(law, soil//', friction_angle=30, cohesion=20e3')
      call point%ready(law, density)
      do k = 1, 200
         call point%pull(law, -1.0e-5_wp, 1.0_wp)
      end do
      strength = 2.0_wp*c*cos(angle)/(1.0_wp - sin(angle))
      call say('strength in compression, relative error', -point%column(1, point%layout%stress)/strength &
               - 1.0_wp)
      call test%check_close(-point%column(1, point%layout%stress)/strength, 1.0_wp, 1.0e-9_wp, &
                            'strength of Mohr and Coulomb')
      call test%check_close(point%field('plastic_strain'), 0.002_wp - strength/young, 1.0e-5_wp, &
                            'what is not elastic is plastic')
   end subroutine triaxial

   !> Shear at constant volume without and with dilation: the pressure stays, or rises on the cone.
   subroutine dilation()
      type(drucker_prager_t) :: law
      type(material_point_t) :: point
      real(wp) :: m(3, 3), pq(2), b, d, expected
      integer :: k, with
      do with = 0, 1
         if (with == 0) call law_of(law, soil//', friction_angle=35, cohesion=10e3')
         if (with == 1) call law_of(law, soil//', friction_angle=35, cohesion=10e3, dilation_angle=10')
         call point%ready(law, density)
         call point%stretch_by(law, -50.0e3_wp/(3.0_wp*bulk)*[1.0_wp, 1.0_wp, 1.0_wp], 1, 1.0_wp)
         m = 0.0_wp
         m(1, 2) = 1.0e-6_wp
         do k = 1, 5000
            call point%strain_by(law, m, 1.0_wp)
         end do
         pq = p_and_q(point)
         b = 6.0_wp*sin(35.0_wp*pi/180.0_wp)/(3.0_wp - sin(35.0_wp*pi/180.0_wp))
         d = with*6.0_wp*sin(10.0_wp*pi/180.0_wp)/(3.0_wp - sin(10.0_wp*pi/180.0_wp))
         ! q = sqrt(3) mu gamma until the cone, then both go on by the flow: q - q0 = b (p - p0) and p - p0 =
         ! K d times flow
         expected = sqrt(3.0_wp)*shear*5.0e-3_wp - (b*50.0e3_wp + law%a)
         expected = 50.0e3_wp + bulk*d*expected/(3.0_wp*shear + bulk*b*d)
         call test%check_close(pq(1)/expected, 1.0_wp, 2.0e-4_wp, 'pressure in shear at constant volume')
         call test%check_close(pq(2)/(law%a + b*pq(1)), 1.0_wp, 1.0e-12_wp, 'on the cone')
         call check_books(law, point, 'shear at constant volume')
      end do
   end subroutine dilation

   !> What was put in is stored or dissipated: also where plastic strain changes the volume, with which the
   !> stored energy grows.
   subroutine check_books(law, point, name)
      type(drucker_prager_t), intent(in) :: law
      type(material_point_t), intent(in) :: point
      character(len=*), intent(in) :: name
      real(wp) :: there
      there = law%strain_energy(point%column, point%layout, 1, 1) + law%plastic_energy(point%column, 1, 1)
      call say(name//': energy missing, of the work', 1.0_wp - there/point%work)
      call test%check_close(there/point%work, 1.0_wp, 2.0e-4_wp, name//': energy is as the work')
   end subroutine check_books

   !> Strong material that dilates by a tenth under a pressure that strains it elastically by a hundredth.
   subroutine growing()
      type(drucker_prager_t) :: law
      type(material_point_t) :: point
      real(wp) :: m(3, 3)
      integer :: k
      call law_of(law, 'young=3e9, poisson=0.3, friction_angle=36.87, cohesion=22.5e6, dilation_angle=36.87')
      call point%ready(law, density)
      m = 0.0_wp
      m(1, 1) = -5.0e-5_wp
      m(2, 2) = -1.9_wp*m(1, 1) ! with 2 the pressure would stay
      m(3, 3) = m(2, 2)
      do k = 1, 1000
         call point%strain_by(law, m, 1.0_wp)
      end do
      call test%check(point%column(1, point%layout%volume) > 1.1_wp, 'it has dilated')
      call check_books(law, point, 'dilation')
   end subroutine growing

   !> Tension ends at the apex.
   subroutine apex()
      type(drucker_prager_t) :: law
      type(material_point_t) :: point
      call law_of(law, soil//', friction_angle=30, cohesion=20e3, dilation_angle=5')
      call point%ready(law, density)
      call point%stretch_by(law, [2.0e-3_wp, 1.0e-3_wp, 1.0e-3_wp], 50, 1.0_wp)
      call test%check_close(p_and_q(point), [-20.0e3_wp/tan(30.0_wp*pi/180.0_wp), 0.0_wp], 1.0e-6_wp, &
                            'tension ends at c/tan')
   end subroutine apex

   !> Sand bears no tension, and pressure only when its grains meet again.
   subroutine grains()
      type(drucker_prager_t) :: law
      type(material_point_t) :: point
      call law_of(law, soil//', friction_angle=30, cohesion=0')
      call point%ready(law, density)
      call point%stretch_by(law, [0.01_wp, 0.0_wp, 0.0_wp], 20, 1.0_wp)
      call test%check_close(p_and_q(point), [0.0_wp, 0.0_wp], 1.0e-9_wp, 'sand bears no tension')
      call point%stretch_by(law, [0.0_wp, -0.009_wp, 0.0_wp], 20, 1.0_wp)
      call test%check_close(p_and_q(point), [0.0_wp, 0.0_wp], 1.0e-9_wp, 'and nothing while it is apart')
      call point%stretch_by(law, -0.002_wp/3.0_wp*[1.0_wp, 1.0_wp, 1.0_wp], 20, 1.0_wp)
      call test%check_close(p_and_q(point), [bulk*0.001_wp, 0.0_wp], 1.0e-3_wp*bulk*0.001_wp, &
                            'then pressure again')
   end subroutine grains

   !> Pressure alone: elastic to the cap, then compaction against its hardening, dp = K H/(K + H) de. With
   !> shear: on the ellipse.
   subroutine crushing()
      type(drucker_prager_t) :: law
      type(material_point_t) :: point
      real(wp), parameter :: h = 20.0e6_wp, first = 200.0e3_wp, e = 0.02_wp
      real(wp) :: expected, pq(2), begin, axis
      call law_of(law, soil//', friction_angle=30, cohesion=10e3, cap_pressure=200e3, cap_ratio=0.6, '// &
                  'cap_hardening=20e6')
      call point%ready(law, density)
      call point%stretch_by(law, -e/3.0_wp*[1.0_wp, 1.0_wp, 1.0_wp], 400, 1.0_wp)
      expected = first + bulk*h/(bulk + h)*(e - first/bulk)
      pq = p_and_q(point)
      call say('cap under pressure alone: relative error', pq(1)/expected - 1.0_wp)
      call test%check_close(pq(1)/expected, 1.0_wp, 1.0e-4_wp, 'compaction by pressure')
      call test%check_close(point%field('compaction'), e - expected/bulk, 1.0e-6_wp, 'the compaction')
      call point%stretch_by(law, [-0.005_wp, 0.0_wp, 0.0_wp], 200, 1.0_wp)
      pq = p_and_q(point)
      begin = (first + h*point%field('compaction') - 0.6_wp*law%a)/(1.0_wp + 0.6_wp*law%b)
      axis = 0.6_wp*(law%a + law%b*begin)
      call test%check(pq(2) > 10.0e3_wp .and. pq(1) > begin, 'shear beside it')
      call test%check_close(sqrt((pq(1) - begin)**2 + (0.6_wp*pq(2))**2)/axis, 1.0_wp, 1.0e-11_wp, &
                            'on the ellipse')
   end subroutine crushing

   !> 10^4 particles: none outside, the yield function computed anew.
   subroutine random_paths()
      type(drucker_prager_t) :: law
      type(material_point_t) :: point
      type(chance_t) :: chance
      real(wp) :: outside, begin, p, q, axis
      real(wp) :: e(3, 3)
      integer :: i, k, t, on_cone, on_cap
      call law_of(law, soil//', friction_angle=30, cohesion=10e3, dilation_angle=8, cap_pressure=200e3, '// &
                  'cap_ratio=0.6, cap_hardening=20e6')
      outside = -1.0_wp
      on_cone = 0
      on_cap = 0
      do k = 1, 2000
         call point%ready(law, density)
         do t = 1, 20
            e = reshape(chance%several(9, -1.0_wp, 1.0_wp)*10.0_wp**chance%between(-5.0_wp, -2.0_wp), [3, 3])
            call point%strain_by(law, e, 1.0_wp)
            p = p_of(point)
            q = point%mises(1)
            begin = (200.0e3_wp + 20.0e6_wp*point%field('compaction') - 0.6_wp*law%a)/(1.0_wp + 0.6_wp*law%b)
            axis = 0.6_wp*(law%a + law%b*begin)
            outside = max(outside, (q - law%a - law%b*p)/axis)
            if (p > begin) outside = max(outside, sqrt((p - begin)**2 + (0.6_wp*q)**2)/axis - 1.0_wp)
            if (p < begin .and. abs(q - law%a - law%b*p) < 1.0e-10_wp*axis) on_cone = on_cone + 1
            if (p > begin .and. abs(sqrt((p - begin)**2 + (0.6_wp*q)**2)/axis - 1.0_wp) < 1.0e-10_wp) &
               on_cap = on_cap + 1
         end do
      end do
      i = min(on_cone, on_cap)
      call say('random paths: furthest outside, relative', outside)
      call test%check(outside < 1.0e-10_wp, 'random paths stay inside')
      call test%check(i > 1000, 'and come to cone and cap')
   end subroutine random_paths

   pure real(wp) function p_of(point)
      type(material_point_t), intent(in) :: point
      real(wp) :: pq(2)
      pq = p_and_q(point)
      p_of = pq(1)
   end function p_of

   subroutine all_laws_do()
      type(drucker_prager_t) :: law
      type(material_point_t) :: point
      call law_of(law, soil//', friction_angle=30, cohesion=10e3, dilation_angle=8, cap_pressure=200e3, '// &
                  'cap_ratio=0.6, cap_hardening=20e6')
      call point%follows_turns(law, density, 0.005_wp, 1.0_wp, 'drucker_prager', test)
      call point%dissipates(law, density, 10000, 1.0_wp, 'drucker_prager', test)
      call law_of(law, soil//', friction_angle=30, cohesion=0')
      call point%dissipates(law, density, 10000, 1.0_wp, 'sand', test)
   end subroutine all_laws_do

   subroutine refusals()
      call refused('friction_angle=30', 'cohesion: missing')
      call refused('friction_angle=0, cohesion=0', 'must be above 0 where friction_angle is 0')
      call refused('friction_angle=20, cohesion=1, dilation_angle=30', 'must be at most friction_angle')
      call refused('friction_angle=20, cohesion=1e6, cap_pressure=1e3', 'must be 0, or above cap_ratio')
   end subroutine refusals

   subroutine refused(text, sentence)
      character(len=*), intent(in) :: text, sentence
      type(drucker_prager_t) :: law
      character(len=:), allocatable :: complaint
      call read_law(law, soil//', '//text, complaint)
      call test%check(index(complaint, sentence) > 0, 'refused: '//sentence, complaint)
   end subroutine refused

end program friction_law
