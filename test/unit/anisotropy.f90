!> Cubic and orthotropic elasticity against the exact: modulus over angle, at rest and turned with the body,
!> objectivity, energy.
program anisotropy
   use m_kinds, only: wp
   use m_constants, only: pi
   use m_communicator, only: communicator_t
   use m_material, only: material_t
   use m_rotations, only: from_euler, matrix_of
   use m_assertions, only: assertions_t
   use m_chance, only: chance_t, keep_worst, say
   use m_point, only: point_t, law_of, identity, rotation
   implicit none
   character(len=*), parameter :: copper = 'c11=170e9, c12=124e9, c44=75e9'
   character(len=*), &
      parameter :: composite = 'young_moduli=140e9,10e9,12e9, poisson_ratios=0.3,0.25,0.4, '// &
                                  'shear_moduli=5e9,6e9,3e9'
   type(communicator_t) :: comm
   type(assertions_t) :: test
   type(chance_t) :: chance
   call comm%start()
   call test%start(comm, 'anisotropy')
   call euler_angles()
   call off_axis('cubic', copper)
   call off_axis('orthotropic', composite)
   call waves()
   call turning('cubic', copper)
   call turning('orthotropic', composite)
   call energy('cubic', copper)
   call energy('orthotropic', composite)
   call at_rest()
   call of_isotropic()
   call test%finish()

contains

   !> Bunge's matrix g takes sample components to crystal components; ours is its transpose.
   subroutine euler_angles()
      real(wp) :: a(3), g(3, 3), r(3, 3)
      a = [0.3_wp, 1.1_wp, 2.0_wp]
      associate (c1 => cos(a(1)), s1 => sin(a(1)), c => cos(a(2)), s => sin(a(2)), c2 => cos(a(3)), &
                 s2 => sin(a(3)))
         g(1, :) = [c1*c2 - s1*s2*c, s1*c2 + c1*s2*c, s2*s]
         g(2, :) = [-c1*s2 - s1*c2*c, -s1*s2 + c1*c2*c, c2*s]
         g(3, :) = [s1*s, -c1*s, c]
      end associate
      r = matrix_of(from_euler(a))
      call test%check(maxval(abs(r - transpose(g))) < 1.0e-15_wp, 'Bunge''s matrix')
   end subroutine euler_angles

   !> 1/E along a direction, by the law's name: of the engineering constants above, or of cubic moduli.
   real(wp) function modulus_along(model, d)
      character(len=*), intent(in) :: model
      real(wp), intent(in) :: d(3) !< along the axes of the material
      real(wp), parameter :: c11 = 170e9_wp, c12 = 124e9_wp, c44 = 75e9_wp
      real(wp) :: s11, s12, s44, inverse
      if (model == 'cubic') then
         s11 = (c11 + c12)/((c11 - c12)*(c11 + 2.0_wp*c12))
         s12 = -c12/((c11 - c12)*(c11 + 2.0_wp*c12))
         s44 = 1.0_wp/c44
         inverse = s11 - 2.0_wp*(s11 - s12 - 0.5_wp*s44)*((d(1)*d(2))**2 + (d(2)*d(3))**2 + (d(3)*d(1))**2)
      else
         inverse = d(1)**4/140e9_wp + d(2)**4/10e9_wp + d(3)**4/12e9_wp + (d(1)*d(2))**2 &
                   *(1/5e9_wp - 0.6_wp/140e9_wp) &
                   + (d(1)*d(3))**2*(1/6e9_wp - 0.5_wp/140e9_wp) + (d(2)*d(3))**2*(1/3e9_wp - 0.8_wp/10e9_wp)
      end if
      modulus_along = 1.0_wp/inverse
   end function modulus_along

   !> A pull along x by 1e-5 with the material's axes at angles of 0 to 90 degrees about z, and in 30
   !> directions at random; then with the body turned, by a superposed rotation of 70 degrees about z in 50
   !> steps, before it is pulled.
   subroutine off_axis(model, variables)
      character(len=*), intent(in) :: model, variables
      type(point_t) :: point
      class(material_t), allocatable :: law
      real(wp), parameter :: strain = 1.0e-5_wp, turn = 70.0_wp*pi/180.0_wp
      real(wp) :: worst, worst_turned, least_change, left, angles(3), d(3), r(3, 3), found, exact, expected
      integer :: n, t
      law = law_of(model, variables)
      worst = 0.0_wp
      worst_turned = 0.0_wp
      least_change = 0.0_wp
      do n = 0, 48
         angles = [5.0_wp*n*pi/180.0_wp, 0.0_wp, 0.0_wp]
         if (n > 18) angles = chance%several(3, 0.0_wp, pi)
         call point%ready(law, 1, reshape(from_euler(angles), [4, 1]))
         r = matrix_of(from_euler(angles))
         call point%pull(strain, 1.0_wp, left)
         d = r(1, :)
         exact = modulus_along(model, d)
         found = point%column(1, point%layout%stress)/strain
         call keep_worst(worst, found/exact - 1.0_wp)
         call point%ready(law, 1, reshape(from_euler(angles), [4, 1]))
         do t = 1, 50
            call point%strain_by(rotation([0.0_wp, 0.0_wp, 1.0_wp], turn/50) - identity(), 1.0_wp)
         end do
         call point%pull(strain, 1.0_wp, left)
         d = matmul(rotation([0.0_wp, 0.0_wp, 1.0_wp], -turn), [1.0_wp, 0.0_wp, 0.0_wp])
         expected = modulus_along(model, matmul(d, r))
         found = point%column(1, point%layout%stress)/strain
         call keep_worst(worst_turned, found/expected - 1.0_wp)
         call keep_worst(least_change, expected/exact - 1.0_wp)
      end do
      call say(model//': modulus over angle, relative error', worst)
      call say(model//': the same, turned with the body', worst_turned)
      call test%check(worst < 1.0e-4_wp, model//': modulus over angle')
      call test%check(worst_turned < 1.0e-4_wp, model//': modulus of the turned body')
      call test%check(least_change > 0.1_wp, model//': the turn changes the modulus')
   end subroutine off_axis

   !> The fastest wave of a cubic crystal goes along an axis, or a face's or the cube's diagonal.
   subroutine waves()
      class(material_t), allocatable :: law
      law = law_of('cubic', copper)
      call test%check_close(law%p_wave_modulus()/1e9_wp, (170 + 2*124 + 4*75)/3.0_wp, 1.0e-9_wp, &
                            'copper: along the diagonal')
      law = law_of('cubic', 'c11=100e9, c12=20e9, c44=20e9')
      call test%check_close(law%p_wave_modulus()/1e9_wp, 100.0_wp, 1.0e-9_wp, &
                            'along an edge where that is stiffest')
      law = law_of('cubic', 'c11=100e9, c12=-40e9, c44=200e9')
      call test%check_close(law%p_wave_modulus()/1e9_wp, (100 - 80 + 800)/3.0_wp, 1.0e-9_wp, &
                            'along the diagonal of an odd one')
   end subroutine waves

   !> A path with a rotation on top: the stress is the same, turned, and the energy the same.
   subroutine turning(model, variables)
      character(len=*), intent(in) :: model, variables
      type(point_t) :: still, turned
      class(material_t), allocatable :: law
      integer, parameter :: steps = 60
      real(wp) :: f(3, 3), next(3, 3), q(3, 3), q_next(3, 3), worst, increment(3, 3), orientation(4, 1), &
         energies(2)
      integer :: t
      law = law_of(model, variables)
      orientation(:, 1) = from_euler([0.4_wp, 0.9_wp, 0.2_wp])
      call still%ready(law, 1, orientation)
      call turned%ready(law, 1, orientation)
      f = identity()
      q = identity()
      worst = 0.0_wp
      do t = 1, steps
         increment = reshape(chance%several(9, -4.0e-3_wp, 4.0e-3_wp), [3, 3])
         next = f + matmul(increment, f)
         q_next = matmul(rotation(chance%several(3, -1.0_wp, 1.0_wp), 0.7_wp), q)
         call still%strain_by(increment, 1.0_wp)
         call turned%strain_by(matmul(q_next, matmul(identity() + increment, transpose(q))) &
                               - identity(), 1.0_wp)
         f = next
         q = q_next
         call keep_worst(worst, &
                         maxval(abs(turned%stress_of(1) &
                                    - matmul(q, matmul(still%stress_of(1), transpose(q))))) &
                         /maxval(abs(still%stress_of(1))))
      end do
      energies = [still%law%strain_energy(still%column, still%layout, 1, 1), &
                  turned%law%strain_energy(turned%column, turned%layout, 1, 1)]
      call keep_worst(worst, energies(2)/energies(1) - 1.0_wp)
      call say(model//': superposed rotation, relative error', worst)
      call test%check(worst < 1.0e-10_wp, model//': superposed rotation')
   end subroutine turning

   !> Strains of 20 %: the work of the stress is the energy, and a closed path takes none; the error falls
   !> with the square of the step.
   subroutine energy(model, variables)
      character(len=*), intent(in) :: model, variables
      real(wp) :: coarse, fine, closed
      call walk(model, variables, 100, coarse, closed)
      call walk(model, variables, 200, fine, closed)
      call say(model//': work less energy on a path, relative', fine)
      call say(model//': energy left after a closed path, relative', closed)
      call test%check(abs(fine) < 2.0e-3_wp .and. abs(coarse/fine) > 3.5_wp, model// &
                      ': the work is the energy, to second order')
      call test%check(abs(closed) < 1.0e-12_wp, model//': nothing is left after a closed path')
   end subroutine energy

   subroutine walk(model, variables, steps, off, closed)
      character(len=*), intent(in) :: model, variables
      integer, intent(in) :: steps
      real(wp), intent(out) :: off    !< work over energy less 1 at the end of the first half
      real(wp), intent(out) :: closed !< energy at the end over that in the middle
      type(point_t) :: point
      real(wp) :: a(3, 3), f(3, 3), next(3, 3), before(3, 3), increment(3, 3), inverse(3, 3), work, &
         stored, volume
      integer :: t
      call point%ready(law_of(model, variables), 1, reshape(from_euler([0.4_wp, 0.9_wp, 0.2_wp]), [4, 1]))
      a = reshape([0.15_wp, 0.02_wp, -0.1_wp, 0.2_wp, -0.1_wp, 0.05_wp, 0.0_wp, 0.1_wp, 0.1_wp], [3, 3])
      work = 0.0_wp
      stored = 0.0_wp
      f = identity()
      do t = 1, 2*steps
         next = identity() + a*sin(pi*real(t, wp)/(2*steps))**2
         if (t == 2*steps) next = identity()
         inverse = inverse_of(f)
         increment = matmul(next - f, inverse)
         before = point%stress_of(1)
         volume = point%column(1, point%layout%volume)
         call point%strain_by(increment, 1.0_wp)
         ! first Piola-Kirchhoff: its mean on the way times the change of F
         work = work + 0.5_wp*sum((volume*matmul(before, transpose(inverse)) &
                    + point%column(1, point%layout%volume) &
                                   *matmul(point%stress_of(1), transpose(inverse_of(next))))*(next - f))
         f = next
         if (t == steps) stored = point%law%strain_energy(point%column, point%layout, 1, 1)
         if (t == steps) off = work/stored - 1.0_wp
      end do
      closed = point%law%strain_energy(point%column, point%layout, 1, 1)/stored
   end subroutine walk

   pure function inverse_of(f) result(inverse)
      real(wp), intent(in) :: f(3, 3)
      real(wp) :: inverse(3, 3), volume
      integer :: i, j
      do i = 1, 3
         do j = 1, 3
            inverse(j, i) = f(mod(i, 3) + 1, mod(j, 3) + 1)*f(mod(i + 1, 3) + 1, mod(j + 1, 3) + 1) &
                            - f(mod(i, 3) + 1, mod(j + 1, 3) + 1)*f(mod(i + 1, 3) + 1, mod(j, 3) + 1)
         end do
      end do
      volume = dot_product(f(1, :), inverse(:, 1))
      inverse = inverse/volume
   end function inverse_of

   !> What does not move has no stress, to the bit, whatever its orientation.
   subroutine at_rest()
      type(point_t) :: point
      integer :: t
      call point%ready(law_of('cubic', copper), 1, reshape(from_euler([0.4_wp, 0.9_wp, 0.2_wp]), [4, 1]))
      do t = 1, 3
         call point%strain_by(0.0_wp*identity(), 1.0_wp)
      end do
      call test%check(all(abs(point%stress_of(1)) <= 0.0_wp), 'no stress without strain')
   end subroutine at_rest

   !> With isotropic moduli the energy of a stress is that of the isotropic law, and the axes do not matter.
   subroutine of_isotropic()
      type(point_t) :: point, other
      real(wp) :: stress(6)
      class(material_t), allocatable :: law
      call other%ready(law_of('elastic', 'young=200e9, poisson=0.25'), 1)
      law = law_of('cubic', 'c11=240e9, c12=80e9, c44=80e9')
      call point%ready(law, 1, reshape(from_euler([0.4_wp, 0.9_wp, 0.2_wp]), [4, 1]))
      stress = [1.0_wp, 2.0_wp, -0.5_wp, 0.3_wp, 0.7_wp, -0.2_wp]*1e8_wp
      call test%check_close(point%law%energy_of_stress(point%column(1, :), point%layout, stress), &
                            other%law%complementary_energy(stress), 1.0e-6_wp, 'energy of a stress')
      call test%check_close(point%law%von_mises_modulus()/1e9_wp, other%law%von_mises_modulus()/1e9_wp, &
                            1.0e-9_wp, 'von Mises modulus')
      call point%strain_by(1.0e-6_wp*reshape([1.0_wp, 2.0_wp, 3.0_wp, -4.0_wp, 5.0_wp, 6.0_wp, 0.0_wp, &
                                              1.0_wp, 2.0_wp], [3, 3]), 1.0_wp)
      call other%strain_by(1.0e-6_wp*reshape([1.0_wp, 2.0_wp, 3.0_wp, -4.0_wp, 5.0_wp, 6.0_wp, 0.0_wp, &
                                              1.0_wp, 2.0_wp], [3, 3]), 1.0_wp)
      call test%check(maxval(abs(point%stress_of(1) - other%stress_of(1))) < &
                      1.0e-4_wp*maxval(abs(other%stress_of(1))), 'stress of small strains')
   end subroutine of_isotropic

end program anisotropy
