!> &damage on one particle: the strain at which it fails against Johnson and Cook's formula, and what is left
!> then.
program damage
   use m_kinds, only: wp, i8
   use m_communicator, only: communicator_t
   use m_grid_level, only: grid_level_t
   use m_material, only: material_t
   use m_scene_materials, only: materials_t
   use m_j2, only: j2_t
   use m_johnson_cook, only: johnson_cook_t
   use m_elastic, only: elastic_t
   use m_particle_store, only: particle_store_t
   use m_damage, only: damage_t
   use m_material_point, only: material_point_t, read_law
   use m_assertions, only: assertions_t
   use m_chance, only: say
   implicit none
   real(wp), parameter :: density = 8960.0_wp
   character(len=*), &
      parameter :: metal = 'young=124e9, poisson=0.34, yield_stress=200e6, hardening_modulus=500e6'
   type(communicator_t) :: comm
   type(assertions_t) :: test
   type(particle_store_t) :: store
   call comm%start()
   call test%start(comm, 'damage')
   call strains_to_failure()
   call warm()
   call opening_and_closing()
   call back_stresses()
   call test%finish()

contains

   !> The effect on the point's law, and the point with its fields.
   subroutine ready(effect, law, point)
      type(damage_t), intent(inout) :: effect
      class(material_t), intent(inout) :: law
      type(material_point_t), intent(inout) :: point
      type(materials_t) :: materials
      type(grid_level_t) :: grid
      real(wp), allocatable :: column(:, :)
      call point%ready(law, density)
      column = point%column
      call effect%declare(point%table)
      deallocate (point%column)
      allocate (point%column(1, point%table%columns), source=0.0_wp)
      point%column(:, :size(column, 2)) = column
      allocate (materials%slots(1))
      allocate (materials%slots(1)%law, source=law)
      materials%of_body = [1]
      call effect%prepare(grid, materials)
      store = particle_store_t()
      call store%reserve(1, point%table%columns)
      call store%append(point%column(1, :), 1_i8, 1)
   end subroutine ready

   subroutine act(effect, point, dt)
      type(damage_t), intent(in) :: effect
      type(material_point_t), intent(inout) :: point
      real(wp), intent(in) :: dt
      store%column(1, :size(point%column, 2)) = point%column(1, :)
      call effect%on_stress(store, point%layout, point%gradient, 1.0_wp, dt)
      point%column(1, :) = store%column(1, :size(point%column, 2))
   end subroutine act

   !> Tension, compression and shear at two rates.
   subroutine strains_to_failure()
      type(damage_t) :: effect
      type(j2_t) :: law
      type(material_point_t) :: point
      character(len=:), allocatable :: complaint
      real(wp) :: m(3, 3), expected, off, triaxiality, rate, dt
      real(wp), parameter :: d(5) = [0.02_wp, 0.1_wp, -2.0_wp, 0.01_wp, 0.0_wp], step = 1.0e-4_wp
      integer :: way, fast, k
      off = 0.0_wp
      do way = 1, 3
         do fast = 1, 2
            rate = merge(1.0_wp, 1.0e4_wp, fast == 1)
            dt = step/rate
            law = j2_t()
            call read_law(law, metal, complaint)
            effect = damage_t(constants=d)
            call ready(effect, law, point)
            triaxiality = (2 - way)/3.0_wp
            do k = 1, 5000
               select case (way)
               case (1); call point%pull(law, step, dt)
               case (2)
                  m = 0.0_wp
                  m(1, 2) = step*sqrt(3.0_wp)
                  call point%strain_by(law, m, dt)
               case default; call point%pull(law, -step, dt)
               end select
               call act(effect, point, dt)
               if (point%field('damage') >= 1.0_wp) exit
            end do
            expected = (d(1) + d(2)*exp(d(3)*triaxiality))*(1.0_wp + d(4)*log(max(rate, 1.0_wp)))
            off = max(off, abs(point%field('plastic_strain') - expected)/expected)
            call test%check(point%field('damage') >= 1.0_wp, 'it fails')
            call test%check_close(point%mises(1), 0.0_wp, 0.0_wp, 'what has failed bears no shear')
            call test%check((way == 3) .eqv. (point%column(1, point%layout%stress) < -1.0e6_wp), &
                            'pressure stays, tension goes')
            call test%check(effect%dissipated(point%column, 1, 1) > 0.0_wp, &
                            'the energy of what was lost is booked')
         end do
      end do
      call say('tension, shear, compression, two rates: strain to failure, relative error', off)
      ! a step of strain, and the elastic part of the rate
      call test%check_close(off, 0.0_wp, 0.01_wp, 'strain to failure by Johnson and Cook''s formula')
   end subroutine strains_to_failure

   !> Heat makes tougher: D5.
   subroutine warm()
      type(damage_t) :: effect
      type(johnson_cook_t) :: law
      type(material_point_t) :: point
      character(len=:), allocatable :: complaint
      real(wp) :: strains(2)
      integer :: k, hot
      do hot = 1, 2
         law = johnson_cook_t()
         call read_law(law, &
                       'young=124e9, poisson=0.34, yield_stress=90e6, hardening_modulus=0, '// &
                       'hardening_exponent=1, '// &
                       'rate_coefficient=0, thermal_exponent=1, melting_temperature=1300, '// &
                       'room_temperature=300, specific_heat=383, heat_fraction=0', complaint)
         effect = damage_t(constants=[0.1_wp, 0.0_wp, 0.0_wp, 0.0_wp, 2.0_wp])
         call ready(effect, law, point)
         if (hot == 2) point%column(1, point%table%column('temperature')) = 800.0_wp
         do k = 1, 5000
            call point%pull(law, 1.0e-4_wp, 1.0_wp)
            call act(effect, point, 1.0_wp)
            if (point%field('damage') >= 1.0_wp) exit
         end do
         strains(hot) = point%field('plastic_strain')
      end do
      call test%check_close(strains, [0.1_wp, 0.2_wp], 3.0e-4_wp, &
                            'half way to melting it takes 1 + D5/2 times the strain')
   end subroutine warm

   !> The limit of tension on an elastic law: the gap that opens closes before pressure comes again.
   subroutine opening_and_closing()
      type(damage_t) :: effect
      type(elastic_t) :: law
      type(material_point_t) :: point
      character(len=:), allocatable :: complaint
      real(wp) :: opened, m(3, 3)
      integer :: k
      law = elastic_t()
      call read_law(law, 'young=124e9, poisson=0.34', complaint)
      effect = damage_t(tension_limit=1.0e9_wp)
      call ready(effect, law, point)
      m = 0.0_wp
      m(1, 1) = 1.0e-4_wp
      opened = 0.0_wp
      do k = 1, 200
         call point%strain_by(law, m, 1.0_wp)
         if (point%field('damage') < 1.0_wp) opened = max(opened, sum(point%column(1, &
               point%layout%stress:point%layout%stress + 2))/3)
         call act(effect, point, 1.0_wp)
      end do
      call test%check(point%field('damage') >= 1.0_wp .and. opened > 0.98e9_wp, 'it fails at the limit')
      call test%check(all(abs(point%column(1, point%layout%stress:point%layout%stress + 5)) <= 0.0_wp), &
                      'and bears no tension')
      m = -m
      do k = 1, 190
         call point%strain_by(law, m, 1.0_wp)
         call act(effect, point, 1.0_wp)
      end do
      call test%check(all(abs(point%column(1, point%layout%stress:point%layout%stress + 5)) <= 0.0_wp), &
            'what has opened must close first')
      do k = 1, 20
         call point%strain_by(law, m, 1.0_wp)
         call act(effect, point, 1.0_wp)
      end do
      call test%check(point%column(1, point%layout%stress) < -5.0e7_wp, 'closed, it bears pressure')
      call test%check_close(point%column(1, point%layout%stress), point%column(1, point%layout%stress + 1), &
                            1.0_wp, 'and no shear')
   end subroutine opening_and_closing

   !> What back stresses store is lost with the stress.
   subroutine back_stresses()
      type(damage_t) :: effect
      type(j2_t) :: law
      type(material_point_t) :: point
      character(len=:), allocatable :: complaint
      real(wp) :: before, m(3, 3)
      integer :: k
      law = j2_t()
      call read_law(law, 'young=124e9, poisson=0.34, yield_stress=200e6, kinematic_modulus=20e9', complaint)
      effect = damage_t(constants=[0.02_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp])
      call ready(effect, law, point)
      m = 0.0_wp
      m(1, 1) = 1.0e-4_wp
      do k = 1, 400
         call point%strain_by(law, m, 1.0_wp)
         before = law%strain_energy(point%column, point%layout, 1, 1)
         call act(effect, point, 1.0_wp)
         if (point%field('damage') >= 1.0_wp) exit
      end do
      call test%check(k < 400 .and. before > 0.0_wp, 'it fails')
      call test%check_close(law%strain_energy(point%column, point%layout, 1, 1)/before, 0.0_wp, 1.0e-12_wp, &
                            'nothing is stored')
      call test%check_close(effect%dissipated(point%column, 1, 1)/before, 1.0_wp, 1.0e-12_wp, 'all is lost')
   end subroutine back_stresses

end program damage
