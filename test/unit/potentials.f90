!> Crystals by the potential between their atoms: moduli against lattice sums of the closed formulas, stress
!> against differences of the energy, files of three formats; and, where LAMMPS is installed, stress and
!> energy of deformed crystals against LAMMPS.
program potentials
   use mpi_f08, only: MPI_COMM_SELF
   use m_kinds, only: wp
   use m_communicator, only: communicator_t
   use m_bravais, only: bravais_t, basis_of
   use m_cauchy_born, only: cauchy_born_t
   use m_lammps, only: lammps_t, usual_library
   use m_material, only: material_t
   use m_potential, only: potential_t
   use m_potential_file, only: joule_per_ev
   use m_rotations, only: from_euler, matrix_of
   use m_assertions, only: assertions_t
   use m_chance, only: chance_t, keep_worst, say
   use m_metal, only: cut, phi, rho, write_metal
   use m_point, only: identity, law_of, point_t
   implicit none
   character(len=*), parameter :: usual_place = '/usr/share/lammps/potentials/'
   character(len=:), allocatable :: own
   type(communicator_t) :: comm
   type(assertions_t) :: test
   type(chance_t) :: chance
   call comm%start()
   call test%start(comm, 'potentials')
   own = 'build/test_potentials.eam.alloy'
   call write_metal(own)
   call moduli_by_sums()
   call energy_and_stress()
   call turned_law()
   call against_lammps()
   call test%finish()

contains

   function crystal_of(variables) result(crystal)
      character(len=*), intent(in) :: variables
      type(bravais_t) :: crystal
      class(material_t), allocatable :: law
      law = law_of('cauchy_born', variables)
      select type (law)
      type is (cauchy_born_t)
         crystal = law%crystal
      end select
   end function crystal_of

   !> The closed formulas for the crystal at rest: no pressure, and c11, c12, c44 as sums over the lattice of
   !> second derivatives (the first vanish, but for what pairs and density share).
   subroutine moduli_by_sums()
      type(bravais_t) :: crystal
      real(wp) :: a, r(3), d, p(0:2), q(0:2), density, pressure, v(3), c(3), f(2)
      real(wp), allocatable :: points(:, :)
      integer :: i, j, k, b, pass
      crystal = crystal_of("potential='"//own//"', style='eam/alloy', element='Xx'")
      a = crystal%constant*1.0e10_wp
      points = basis_of(1)
      density = 0.0_wp
      do pass = 1, 2
         if (pass == 2) f = [-1.5_wp/sqrt(density), 0.75_wp/density**1.5_wp]
         pressure = 0.0_wp
         c = 0.0_wp
         v = 0.0_wp
         do k = -3, 3
            do j = -3, 3
               do i = -3, 3
                  do b = 1, 4
                     r = a*(points(:, b) + real([i, j, k], wp))
                     d = norm2(r)
                     if (d < 0.1_wp .or. d >= cut) cycle
                     p = phi(d)
                     q = rho(d)
                     if (pass == 1) density = density + q(0)
                     if (pass == 1) cycle
                     pressure = pressure + (0.5_wp*p(1) + f(1)*q(1))*d
                     associate (second => 0.5_wp*(p(2) - p(1)/d) + f(1)*(q(2) - q(1)/d))
                        c = c + second/d**2*[r(1)**4, r(1)**2*r(2)**2, r(1)**2*r(2)**2]
                     end associate
                     v = v + q(1)/d*r**2
                  end do
               end do
            end do
         end do
      end do
      c(1) = c(1) + f(2)*v(1)**2
      c(2) = c(2) + f(2)*v(1)*v(2)
      c = c*4.0_wp/a**3*joule_per_ev*1.0e30_wp
      call say('invented metal: pressure at rest, of c11', pressure*4.0_wp/a**3*joule_per_ev*1.0e30_wp/c(1))
      call say('invented metal: c11, relative', crystal%c11/c(1) - 1.0_wp)
      call say('invented metal: c12, relative', crystal%c12/c(2) - 1.0_wp)
      call say('invented metal: c44, relative', crystal%c44/c(3) - 1.0_wp)
      call test%check(abs(pressure*4.0_wp/a**3*joule_per_ev*1.0e30_wp) < 1.0e-8_wp*c(1), &
                      'no pressure at rest')
      call test%check(maxval(abs([crystal%c11, crystal%c12, crystal%c44]/c - 1.0_wp)) < 1.0e-5_wp, &
                      'moduli are the sums over the lattice')
      call test%check(abs(c(2)/c(3) - 1.0_wp) > 0.1_wp, 'the density breaks Cauchy''s relation')
   end subroutine moduli_by_sums

   !> Piola's stress is the derivative of the energy by F.
   subroutine energy_and_stress()
      type(bravais_t) :: crystal
      real(wp) :: f(3, 3), up(3, 3), down(3, 3), cauchy(3, 3), p(3, 3), jacobian, worst
      real(wp), parameter :: h = 1.0e-5_wp
      integer :: n, i, j
      crystal = crystal_of("style='lj/smooth/linear', epsilon=1e-19, sigma=2.3e-10, "// &
                           "cutoff=6e-10, constant=3.5e-10")
      worst = 0.0_wp
      do n = 1, 20
         f = identity() + 0.05_wp*reshape(chance%several(9, -1.0_wp, 1.0_wp), [3, 3])
         cauchy = crystal%stress(f)
         do j = 1, 3
            do i = 1, 3
               up = f
               down = f
               up(i, j) = up(i, j) + h
               down(i, j) = down(i, j) - h
               p(i, j) = (crystal%energy(up) - crystal%energy(down))/(2.0_wp*h*crystal%volume)
            end do
         end do
         jacobian = f(1, 1)*(f(2, 2)*f(3, 3) - f(2, 3)*f(3, 2)) &
                    + f(1, 2)*(f(2, 3)*f(3, 1) - f(2, 1)*f(3, 3)) &
                    + f(1, 3)*(f(2, 1)*f(3, 2) - f(2, 2)*f(3, 1))
         call keep_worst(worst, maxval(abs(matmul(p, transpose(f))/jacobian - cauchy))/maxval(abs(cauchy)))
      end do
      call say('stress against differences of the energy', worst)
      call test%check(worst < 1.0e-6_wp, 'stress is the derivative of the energy')
      call test%check(all(abs(crystal%stress(identity())) <= 0.0_wp), 'no stress at rest, to the bit')
   end subroutine energy_and_stress

   !> Material and strain turned together by 30 degrees turn the stress; a turn alone makes none.
   subroutine turned_law()
      type(point_t) :: point, turned
      class(material_t), allocatable :: law
      real(wp) :: r(3, 3), e(3, 3), stress(3, 3)
      law = law_of('cauchy_born', "potential='"//own//"', style='eam/alloy', element='Xx'")
      e = 0.01_wp*reshape([1.0_wp, 0.3_wp, -0.4_wp, 0.2_wp, -0.6_wp, 0.5_wp, 0.1_wp, 0.7_wp, 0.8_wp], [3, 3])
      call point%ready(law, 1)
      call point%strain_by(e, 1.0_wp)
      stress = point%stress_of(1)
      r = matrix_of(from_euler([0.5_wp, 0.2_wp, 0.9_wp]))
      call turned%ready(law, 1)
      call turned%strain_by(r - identity(), 1.0_wp)
      call test%check(maxval(abs(turned%stress_of(1))) < 1.0e-6_wp*point%law%p_wave_modulus(), &
                      'a turn makes no stress')
      call turned%strain_by(matmul(r, matmul(e, transpose(r))), 1.0_wp)
      call test%check(maxval(abs(turned%stress_of(1) - matmul(r, matmul(stress, transpose(r))))) &
                      < 1.0e-9_wp*maxval(abs(stress)), 'stress turns with the material')
   end subroutine turned_law

   !> Crystals of published potentials, deformed by up to 5 %, in LAMMPS.
   subroutine against_lammps()
      type(lammps_t) :: lammps
      character(len=:), allocatable :: complaint
      call lammps%load(usual_library, complaint)
      if (complaint /= '') then
         print '(a)', '  left out, LAMMPS is not there: stress of deformed crystals against LAMMPS'
         return
      end if
      print '(a,i0)', '  LAMMPS of ', version_of(lammps)
      call compare(lammps, 'Xx', "potential='"//own//"', style='eam/alloy', element='Xx'", 'fcc', &
                   'eam/alloy', own//' Xx')
      call compare(lammps, 'lj', "style='lj/cut', epsilon=6.5e-20, sigma=2.3e-10, cutoff=6e-10, "// &
                   "constant=3.6e-10", 'fcc', 'lj/cut 6.0', number(6.5e-20_wp/joule_per_ev)//' 2.3')
      call compare(lammps, 'lj smooth', "style='lj/smooth/linear', epsilon=6.5e-20, sigma=2.3e-10, "// &
                   "cutoff=6e-10, constant=3.6e-10", 'fcc', 'lj/smooth/linear 6.0', &
                   number(6.5e-20_wp/joule_per_ev)//' 2.3')
      call with_file(lammps, 'Cu_mishin1.eam.alloy', 'eam/alloy', 'Cu', 'fcc')
      call with_file(lammps, 'Cu_u3.eam', 'eam', '', 'fcc')
      call with_file(lammps, 'Fe_mm.eam.fs', 'eam/fs', 'Fe', 'bcc')
      call with_file(lammps, 'NiAlH_jea.eam.fs', 'eam/fs', 'Al', 'fcc')
   end subroutine against_lammps

   integer function version_of(lammps) result(version)
      type(lammps_t), intent(inout) :: lammps
      call lammps%start(MPI_COMM_SELF)
      version = lammps%version()
      call lammps%finish()
   end function version_of

   subroutine with_file(lammps, file, style, element, lattice)
      type(lammps_t), intent(inout) :: lammps
      character(len=*), intent(in) :: file, style, element, lattice
      logical :: there
      inquire (file=usual_place//file, exist=there)
      if (.not. there) then
         print '(a)', '  left out, not installed: '//file
         return
      end if
      if (element == '') then
         call compare(lammps, file, "potential='"//file//"', style='eam'", lattice, style, usual_place//file)
      else
         call compare(lammps, file, "potential='"//file//"', style='"//style//"', element='"//element// &
                      "', lattice='"//lattice//"'", lattice, style, usual_place//file//' '//element)
      end if
   end subroutine with_file

   subroutine compare(lammps, name, variables, lattice, style, coefficients)
      type(lammps_t), intent(inout) :: lammps
      character(len=*), intent(in) :: name, variables, lattice, style, coefficients
      character(len=*), parameter :: components(6) = ['pxx', 'pyy', 'pzz', 'pyz', 'pxz', 'pxy']
      type(bravais_t) :: crystal
      real(wp) :: f(3, 3), t(3, 3), found(6), energy, length, first_energy, worst, worst_energy
      integer :: n, k, at(2, 6)
      at = reshape([1, 1, 2, 2, 3, 3, 2, 3, 1, 3, 1, 2], [2, 6])
      crystal = crystal_of(variables)
      print '(a,3f9.3,a,f9.6,a)', '  '//name//': c11, c12, c44', crystal%c11/1e9_wp, crystal%c12/1e9_wp, &
         crystal%c44/1e9_wp, ' GPa, constant', crystal%constant*1e10_wp, ' angstrom'
      length = 2*crystal%constant*1.0e10_wp
      worst = 0.0_wp
      worst_energy = 0.0_wp
      do n = 0, 3
         f = identity()
         if (n > 0) f = f + 0.05_wp*reshape(chance%several(9, -1.0_wp, 1.0_wp), [3, 3])
         f(2, 1) = 0.0_wp; f(3, 1) = 0.0_wp; f(3, 2) = 0.0_wp
         call lammps%start(MPI_COMM_SELF)
         call lammps%command('units metal')
         call lammps%command('lattice '//lattice//' '//number(0.5_wp*length))
         call lammps%command('region all block 0 2 0 2 0 2 units lattice')
         call lammps%command('create_box 1 all')
         call lammps%command('create_atoms 1 box')
         call lammps%command('mass 1 60.0')
         call lammps%command('pair_style '//style)
         call lammps%command('pair_coeff * * '//coefficients)
         call lammps%command('change_box all triclinic')
         call lammps%command('change_box all x final 0 '//number(f(1, 1)*length)//' y final 0 '// &
                             number(f(2, 2)*length)//' z final 0 '//number(f(3, 3)*length)//' xy final '// &
                             number(f(1, 2)*length)//' xz final '//number(f(1, 3)*length)//' yz final '// &
                             number(f(2, 3)*length)//' remap units box')
         call lammps%command('thermo_style custom step pe pxx pyy pzz pyz pxz pxy')
         call lammps%command('run 0')
         call test%check(lammps%fault == '', name//': LAMMPS takes the commands', lammps%fault)
         if (lammps%fault /= '') return
         do k = 1, 6
            found(k) = -1.0e5_wp*lammps%thermo(components(k))
         end do
         energy = lammps%thermo('pe')*joule_per_ev/(8*size(basis_of(crystal%lattice), 2))
         call lammps%finish()
         if (n == 0) first_energy = energy
         t = crystal%stress(f)
         do k = 1, 6
            call keep_worst(worst, (found(k) - t(at(1, k), at(2, k)))/maxval(abs(t) + 1.0e6_wp))
         end do
         if (n > 0) call keep_worst(worst_energy, (energy - first_energy)/crystal%energy(f) - 1.0_wp)
      end do
      call say(name//': stress against LAMMPS, relative', worst)
      call say(name//': energy against LAMMPS, relative', worst_energy)
      call test%check(worst < 2.0e-7_wp, name//': stress is LAMMPS''s')
      call test%check(worst_energy < 2.0e-7_wp, name//': energy is LAMMPS''s')
   end subroutine compare

   function number(x) result(text)
      real(wp), intent(in) :: x
      character(len=:), allocatable :: text
      character(len=32) :: buffer
      write (buffer, '(es25.17)') x
      text = trim(adjustl(buffer))
   end function number

end program potentials
