!> The slip of one crystal in one step: power law on all systems with hardening, solved implicitly together
!> with the stress (theory.md, eqs crystal-flow, crystal-solve). Components are along the lattice's axes.
module m_crystal_flow
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use m_kinds, only: wp
   use m_polar, only: cofactors, determinant
   use m_slip_rates, only: crystal_constants_t, rates_t, max_systems, fastest, find_rates, harden, resolve
   use m_slip_systems, only: schmid_columns, schmid_tensor
   implicit none
   private
   public :: slip_t, flow

   integer, parameter, public :: iteration_limit = 60 !< of a minimisation
   integer, parameter, public :: max_rounds = 30     !< of a solve
   integer, parameter, public :: max_parts = 64      !< into which a step is divided where solves fail
   real(wp), parameter, public :: tolerance = 1.0e-7_wp !< of stress and resistances, in the smallest of these
   real(wp), parameter :: near = 3.0e-2_wp        !< the same, below which Newton's method needs no safeguard
   real(wp), parameter :: looser = 1.0e-2_wp      !< tolerance of a minimisation, relative to the residual of
                                                  !< the outer iteration
   real(wp), parameter :: falls = 0.8_wp          !< required reduction of that residual per iteration
   real(wp), parameter, public :: tiny_slip = 1.0e-4_wp   !< in a step
   real(wp), parameter :: max_slope = 0.9_wp      !< largest slope after a step, relative to that before it
   real(wp), parameter, public :: growth = 30.0_wp !< largest growth of the fastest slip in an iteration

   !> Input and result of the flow of one crystal.
   type :: slip_t
      real(wp) :: stretch(3, 3) = 0.0_wp   !< elastic, at the step's beginning
      real(wp) :: increment(3, 3) = 0.0_wp !< dt L
      real(wp), allocatable :: resistance(:) !< (width), Pa; updated
      real(wp), allocatable :: modulus(:)  !< (width): hardening moduli of this step, Pa
      real(wp) :: slip = 0.0_wp            !< of the step, sum over all systems
      real(wp) :: work = 0.0_wp            !< of slip, per volume before elastic deformation, J/m3
      real(wp) :: strain = 0.0_wp          !< equivalent plastic strain of the step
      real(wp) :: elastic(3, 3) = 0.0_wp   !< elastic deformation gradient at the step's end
      integer :: iterations = 0            !< evaluations of the flow law
      logical :: found = .false.           !< if false, the other results are undefined
   end type slip_t

contains

   !> A step by one solve; where that fails, in 2, 4, ... parts.
   pure subroutine flow(constants, time_step, threshold, one)
      type(crystal_constants_t), intent(in) :: constants
      real(wp), intent(in) :: time_step !< s
      real(wp), intent(in) :: threshold
      type(slip_t), intent(inout) :: one
      real(wp) :: way(3, 3), back(3, 3), flown(3, 3), stress(8), resistance(max_systems)
      integer :: part, parts
      one%iterations = 0
      resistance(:constants%width) = one%resistance
      parts = 1
      do
         back = unit()
         one%slip = 0.0_wp
         one%work = 0.0_wp
         one%strain = 0.0_wp
         one%resistance = resistance(:constants%width)
         do part = 1, parts
            way = one%stretch + (real(part, wp)/parts)*matmul(one%increment, one%stretch)
            call solve(constants, constants%width, time_step/parts, threshold, matmul(way, back), part == 1, &
                       stress, one, flown)
            if (.not. one%found) exit
            back = matmul(back, flown)
         end do
         if (one%found .or. parts == max_parts) exit
         parts = 2*parts
      end do
      one%elastic = matmul(way, back)
   end subroutine flow

   pure function unit() result(a)
      real(wp) :: a(3, 3)
      a = 0.0_wp
      a(1, 1) = 1.0_wp
      a(2, 2) = 1.0_wp
      a(3, 3) = 1.0_wp
   end function unit

   !> One solve for stress and slip. With fixed resistances, skew part of the stress and terms beyond small
   !> strain, the deviator of the stress is the minimum of a convex function (`minimise`). These are updated
   !> near the solution with each Newton step; else, and where that converges slowly, from minimum to minimum,
   !> which converges by a factor of about the strain.
   pure subroutine solve(constants, width, time_step, threshold, trial, is_first, stress, one, flown)
      type(crystal_constants_t), intent(in) :: constants
      integer, intent(in) :: width
      real(wp), intent(in) :: time_step, threshold
      real(wp), intent(in) :: trial(3, 3)  !< elastic deformation gradient for zero slip
      logical, intent(in) :: is_first      !< first part of the step: the old stress is that of the stretch
      real(wp), intent(inout) :: stress(8) !< Mandel stress, before and after
      type(slip_t), intent(inout) :: one
      real(wp), intent(out) :: flown(3, 3) !< inverse of the plastic deformation gradient of the step
      real(wp), dimension(max_systems) :: resistance, harder
      real(wp) :: c(3, 3), now(8), change(8), target(5), reach, wrong, before, smallest
      type(rates_t) :: rates
      logical :: guarded
      integer :: n
      c = matmul(transpose(trial), trial)
      now = mandel(constants, c)
      flown = unit()
      one%found = fastest(width, constants%schmid, now, one%resistance) <= threshold
      if (one%found) stress = now
      if (one%found) return
      if (is_first) stress = mandel(constants, matmul(one%stretch, one%stretch))
      reach = max(threshold, fastest(width, constants%schmid, stress, one%resistance), &
                  (strain_of(one%increment)/(time_step*constants%reference_rate))**constants%sensitivity)
      change = now - stress
      resistance(:width) = one%resistance
      stress = stress + step_share(width, constants%schmid, stress, change, reach, resistance)*change
      smallest = minval(resistance(:constants%systems))
      target = now(:5)
      wrong = smallest
      guarded = .true.
      do n = 1, max_rounds
         if (guarded) then
            call minimise(constants, width, time_step, threshold, target, resistance, reach, &
                          max(tolerance*smallest, looser*wrong), stress, rates, one)
         else
            call find_rates(constants, width, time_step, threshold, stress, resistance, rates)
            one%iterations = one%iterations + 1
         end if
         if (.not. one%found) return
         flown = inverse_of(rates%together)
         now = mandel(constants, matmul(transpose(flown), matmul(c, flown)))
         call harden(constants%systems, width, constants%latent, one%modulus, rates%slips, harder)
         harder(:width) = one%resistance + harder(:width)
         before = wrong
         wrong = max(maxval(abs(stress - now)), maxval(abs(harder(:width) - resistance(:width))))
         if (wrong <= tolerance*smallest) then
            one%resistance = harder(:width)
            one%slip = one%slip + rates%slip
            one%work = one%work + rates%work
            one%strain = one%strain + sqrt(2.0_wp/3.0_wp)*norm2(rates%together(:5))
            return
         end if
         if (.not. ieee_is_finite(wrong)) exit
         guarded = wrong > near*smallest .or. (wrong > falls*before .and. .not. guarded)
         if (guarded) target = now(:5) + rates%together(:5)/constants%compliance
         call take_newton_step(constants, width, guarded, reach, now, harder, rates, stress, resistance)
      end do
      one%found = .false.
   end subroutine solve

   !> One Newton step for stress and resistances; if guarded, limited by the growth of slip rates.
   pure subroutine take_newton_step(constants, width, guarded, reach, now, harder, rates, stress, resistance)
      type(crystal_constants_t), intent(in) :: constants
      integer, intent(in) :: width
      logical, intent(in) :: guarded
      real(wp), intent(in) :: reach, now(8), harder(max_systems)
      type(rates_t), intent(in) :: rates
      real(wp), intent(inout) :: stress(8), resistance(max_systems)
      real(wp) :: change(8), share
      change(6:) = now(6:) - stress(6:)
      call newton_step(constants%compliance, rates%squares, constants%compliance*(stress(:5) - now(:5)) &
                       + follow_slip(constants%systems, width, constants%by_system, &
                                     1.0_wp/constants%sensitivity, rates, resistance, harder, change(6:)), &
                       change(:5))
      share = 1.0_wp
      if (guarded) share = step_share(width, constants%schmid, stress, change, &
                                      max(reach, rates%fastest)*growth**constants%sensitivity, harder)
      stress = stress + share*change
      resistance(:width) = harder(:width)
   end subroutine take_newton_step

   !> First-order change of the slip by the growth of resistances and a change of the skew part of the stress,
   !> in the five deviators.
   pure function follow_slip(systems, width, by_system, exponent, rates, resistance, harder, &
                             skew) result(more)
      integer, intent(in) :: systems, width
      real(wp), intent(in) :: by_system(8, width), exponent
      type(rates_t), intent(in) :: rates
      real(wp), intent(in) :: resistance(width), harder(width) !< before and after, Pa
      real(wp), intent(in) :: skew(3)                          !< its change, Pa
      real(wp) :: more(5), together(8), change
      integer :: a
      together = 0.0_wp
      do a = 1, systems
         if (.not. rates%rises(a) > 0.0_wp) cycle
         change = rates%rises(a)*(by_system(6, a)*skew(1) + by_system(7, a)*skew(2) &
                                  + by_system(8, a)*skew(3)) &
                  - exponent*rates%slips(a)*(harder(a)/resistance(a) - 1.0_wp)
         together = together + change*by_system(:, a)
      end do
      more = together(:5)
   end function follow_slip

   !> The deviator of the stress with compliance (stress - target) + slip P = 0, the gradient of a convex
   !> function of the deviator. Newton's method; steps in which the fastest slip would grow by more than
   !> `growth` are cut, and halved where they overshoot the minimum along them.
   pure subroutine minimise(constants, width, time_step, threshold, target, resistance, reach, &
                            enough, stress, rates, one)
      type(crystal_constants_t), intent(in) :: constants
      integer, intent(in) :: width
      real(wp), intent(in) :: time_step, threshold
      real(wp), intent(in) :: target(5)         !< Pa
      real(wp), intent(in) :: resistance(width) !< Pa
      real(wp), intent(in) :: reach         !< ratio of stress to resistance at which slip is expected
      real(wp), intent(in) :: enough        !< tolerance of the residual, Pa
      real(wp), intent(inout) :: stress(8)  !< Pa; the skew part is fixed
      type(rates_t), intent(out) :: rates
      type(slip_t), intent(inout) :: one    !< found and iterations are updated
      real(wp) :: from(8), change(8), off(5), share, slope, ratio
      integer :: n
      slope = huge(slope)
      share = 0.0_wp
      change = 0.0_wp
      from = stress
      one%found = .false.
      do n = 1, iteration_limit
         one%iterations = one%iterations + 1
         call find_rates(constants, width, time_step, threshold, stress, resistance, rates)
         off = constants%compliance*(stress(:5) - target) + rates%together(:5)
         one%found = maxval(abs(off/constants%compliance)) <= enough
         if (one%found) return
         if (.not. dot_product(off, change(:5)) <= max_slope*slope) then
            share = 0.5_wp*share
         else
            call newton_step(constants%compliance, rates%squares, off, change(:5))
            slope = -dot_product(off, change(:5))
            from = stress
            ratio = max(reach, rates%fastest)*growth**constants%sensitivity
            share = step_share(width, constants%schmid, stress, change, ratio, resistance)
         end if
         stress = from + share*change
      end do
   end subroutine minimise

   !> Mandel stress C S of an elastic deformation with C = F^T F, in the components of m_slip_systems, Pa: (C
   !> T + T C^-1)/2 with T = K : (C - C^-1)/4.
   pure function mandel(constants, c) result(stress)
      type(crystal_constants_t), intent(in) :: constants
      real(wp), intent(in) :: c(3, 3)
      real(wp) :: stress(8), inverse(3, 3), t(3, 3), volume
      inverse = cofactors(c)
      inverse = inverse/(c(1, 1)*inverse(1, 1) + c(1, 2)*inverse(1, 2) + c(1, 3)*inverse(1, 3))
      t = (0.5_wp*constants%c44)*(c - inverse)
      volume = 0.25_wp*constants%c12*(c(1, 1) - inverse(1, 1) + c(2, 2) - inverse(2, 2) + c(3, 3) &
                                      - inverse(3, 3))
      t(1, 1) = volume + 0.25_wp*(constants%c11 - constants%c12)*(c(1, 1) - inverse(1, 1))
      t(2, 2) = volume + 0.25_wp*(constants%c11 - constants%c12)*(c(2, 2) - inverse(2, 2))
      t(3, 3) = volume + 0.25_wp*(constants%c11 - constants%c12)*(c(3, 3) - inverse(3, 3))
      stress = schmid_columns(0.5_wp*(matmul(c, t) + matmul(t, inverse)))
   end function mandel

   !> exp(-X) of a traceless slip X, with determinant 1: up to the third power, then scaled to determinant 1.
   pure function inverse_of(together) result(flown)
      real(wp), intent(in) :: together(8)
      real(wp) :: flown(3, 3), x(3, 3), square(3, 3), rest
      x = schmid_tensor(together)
      square = matmul(x, x)
      flown = unit() - x + 0.5_wp*square - matmul(square, x)/6.0_wp
      if (maxval(abs(together)) < tiny_slip) return ! its fourth power is negligible
      rest = determinant(flown) - 1.0_wp
      flown = flown*(1.0_wp - rest/3.0_wp*(1.0_wp - 2.0_wp*rest/3.0_wp))
   end function inverse_of

   !> (K^-1 + sum of rise P P) change = -off, in the five deviators; positive definite: L D L^T.
   pure subroutine newton_step(compliance, squares, off, change)
      real(wp), intent(in) :: compliance(5) !< 1/Pa
      real(wp), intent(in) :: squares(16)   !< lower triangle by columns, 1/Pa
      real(wp), intent(in) :: off(5)        !< strain
      real(wp), intent(out) :: change(5)    !< Pa
      real(wp) :: a(5, 5), inverse(5), factor
      integer :: i, j, k
      k = 0
      do j = 1, 5
         do i = j, 5
            k = k + 1
            a(i, j) = squares(k)
         end do
         a(j, j) = a(j, j) + compliance(j)
      end do
      change = -off
      do j = 1, 5
         inverse(j) = 1.0_wp/a(j, j)
         do i = j + 1, 5
            factor = a(i, j)*inverse(j)
            change(i) = change(i) - factor*change(j)
            do k = i, 5
               a(k, i) = a(k, i) - factor*a(k, j)
            end do
         end do
      end do
      do j = 5, 1, -1
         do i = j + 1, 5
            change(j) = change(j) - a(i, j)*change(i)
         end do
         change(j) = change(j)*inverse(j)
      end do
   end subroutine newton_step

   !> The largest share, at most 1, of a change for which no resolved shear stress exceeds `ratio` times the
   !> resistance, or none that does grows.
   pure real(wp) function step_share(width, schmid, stress, change, ratio, resistance) result(share)
      integer, intent(in) :: width
      real(wp), intent(in) :: schmid(width, 8), stress(8), change(8)
      real(wp), intent(in) :: ratio
      real(wp), intent(in) :: resistance(width) !< Pa
      real(wp), dimension(max_systems) :: from, way
      integer :: a
      call resolve(width, schmid, stress, from)
      call resolve(width, schmid, change, way)
      share = 1.0_wp
      if (maxval(abs(from(:width) + way(:width))/resistance) <= ratio) return
      do a = 1, width
         if (abs(from(a) + share*way(a)) <= ratio*resistance(a)) cycle
         share = max(0.0_wp, min(share, (ratio*resistance(a) - sign(1.0_wp, way(a))*from(a))/abs(way(a))))
      end do
   end function step_share

   !> Norm of the symmetric deviator of a velocity gradient's increment.
   pure real(wp) function strain_of(increment) result(strain)
      real(wp), intent(in) :: increment(3, 3)
      real(wp) :: c(8)
      c = schmid_columns(increment)
      strain = norm2(c(:5))
   end function strain_of

end module m_crystal_flow
