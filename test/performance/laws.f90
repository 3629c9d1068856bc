!> What material laws take, by themselves: nanoseconds a particle of an update and of the strain energy,
!> blocks of 512 particles that stay in the cache. Strains go to and fro, below yield and beyond it. A line a
!> law: name, update below yield, update while it flows, strain energy. usage: laws
program laws
   use mpi_f08
   use m_kinds, only: wp
   use m_errors, only: error_t
   use m_field_table, only: field_table_t, layout_t
   use m_namelist_text, only: namelist_text_t
   use m_group_reader, only: group_reader_t
   use m_material, only: material_t
   use m_elastic, only: elastic_t
   use m_neo_hookean, only: neo_hookean_t
   use m_j2, only: j2_t
   use m_johnson_cook, only: johnson_cook_t
   use m_norton, only: norton_t
   use m_maxwell, only: maxwell_t
   use m_drucker_prager, only: drucker_prager_t
   use m_mie_grueneisen, only: mie_grueneisen_t
   implicit none
   integer, parameter :: n = 512
   character(len=*), parameter :: elastic = 'young=200e9, poisson=0.3', &
      yield = ', yield_stress=300e6, hardening_modulus=1e9'
   character(len=*), parameter :: cook = elastic// &
      ', yield_stress=300e6, hardening_modulus=300e6, hardening_exponent=0.3, '// &
                                  'rate_coefficient=0.02, thermal_exponent=1.1, '// &
                                  'melting_temperature=1800, specific_heat=450'
   character(len=*), parameter :: state = ', sound_speed=4500, hugoniot_slope=1.5, grueneisen=2'
   call MPI_Init()
   call measure('elastic', elastic_t(), elastic)
   call measure('neo_hookean', neo_hookean_t(), elastic)
   call measure('j2', j2_t(), elastic//yield)
   call measure('j2, one back stress', j2_t(), elastic//yield// &
                ', kinematic_modulus=1e10, kinematic_recovery=100')
   call measure('johnson_cook', johnson_cook_t(), cook)
   call measure('norton', norton_t(), elastic//yield//', creep_stress=1e8, creep_rate=1e-3, creep_exponent=4')
   call measure('maxwell, one branch', maxwell_t(), elastic//', relaxation_times=1, shear_ratios=0.5')
   call measure('maxwell, four branches', maxwell_t(), elastic// &
                ', relaxation_times=1,2,3,4, shear_ratios=0.1,0.1,0.1,0.1')
   call measure('drucker_prager', drucker_prager_t(), elastic//', friction_angle=20, cohesion=1e8')
   call measure('mie_grueneisen', mie_grueneisen_t(), 'density=7850'//state)
   call measure('mie_grueneisen, j2', mie_grueneisen_t(), elastic//yield//state//', strength=''j2''')
   call MPI_Finalize()

contains

   subroutine measure(name, prototype, text)
      character(len=*), intent(in) :: name, text
      class(material_t), intent(in) :: prototype
      class(material_t), allocatable :: law
      type(namelist_text_t) :: parsed
      type(group_reader_t) :: group
      type(error_t) :: error
      type(field_table_t) :: table
      type(layout_t) :: layout
      real(wp), allocatable :: start(:, :), column(:, :)
      real(wp) :: strain(n, 9), took(3)
      integer :: p
      allocate (law, source=prototype)
      call parsed%parse('&material '//text//' /'//new_line('a'), error)
      call group%begin(parsed%groups(1))
      call law%variables(group)
      law%density = 7850.0_wp
      call table%declare('mass', 1, 'kg', .true.)
      call table%declare('volume', 1, 'm3', .true.)
      call table%declare('stress', 6, 'Pa', .true.)
      call law%declare(table, has_tools=.false.)
      layout = table%layout()
      allocate (start(n, table%columns), source=0.0_wp)
      start(:, layout%volume) = 1.0_wp
      start(:, layout%mass) = law%density
      call law%initial(start, layout, 1, n)
      do p = 1, n
         strain(p, :) = 1.0e-4_wp*[1.0_wp, 0.3_wp, 0.0_wp, 0.2_wp, -0.5_wp, 0.1_wp, -0.1_wp, 0.2_wp, &
                                   -0.5_wp]*(1.0_wp + 1.0e-3_wp*p)
      end do
      column = start
      took(1) = time_of(law, column, layout, strain)
      column = start
      took(2) = time_of(law, column, layout, 100.0_wp*strain)
      took(3) = time_of_energy(law, column, layout)
      print '(a,*(1x,f0.2))', '"'//name//'"', took
   end subroutine measure

   !> Least of many tries, of one step there and one back.
   real(wp) function time_of(law, column, layout, strain) result(least)
      class(material_t), intent(in) :: law
      real(wp), intent(inout), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: strain(:, :)
      real(wp) :: back(n, 9), begun
      integer :: k
      back = -strain
      least = huge(least)
      do k = 1, 400
         begun = MPI_Wtime()
         call law%update(column, layout, strain, 1.0_wp, 1, n)
         call law%update(column, layout, back, 1.0_wp, 1, n)
         least = min(least, MPI_Wtime() - begun)
      end do
      least = 1.0e9_wp*least/(2*n)
   end function time_of

   real(wp) function time_of_energy(law, column, layout) result(least)
      class(material_t), intent(in) :: law
      real(wp), intent(inout), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      real(wp) :: begun, energy
      integer :: k
      least = huge(least)
      energy = 0.0_wp
      do k = 1, 400
         begun = MPI_Wtime()
         energy = energy + law%strain_energy(column, layout, 1, n)
         least = min(least, MPI_Wtime() - begun)
      end do
      if (energy < -huge(energy)) print *, 'never'
      least = 1.0e9_wp*least/n
   end function time_of_energy

end program laws
