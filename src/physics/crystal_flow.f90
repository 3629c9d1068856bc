!> The slip of one crystal in one step: power law on all systems with hardening, solved together with the
!> stress, implicitly (theory.md, eqs crystal-flow, crystal-solve). Everything stands along the lattice's axes.
module m_crystal_flow
   use m_kinds, only: wp
   use m_rotations, only: cofactors
   use m_slip_systems, only: schmid_columns, schmid_tensor
   use m_small_systems, only: solve_definite
   implicit none
   private
   public :: crystal_constants_t, slip_t, flow, slip_threshold

   integer, parameter, public :: most_iterations = 60 !< of a minimisation
   integer, parameter, public :: most_rounds = 30     !< of a solve
   integer, parameter, public :: most_parts = 64      !< that a step is cut into where solves fail
   real(wp), parameter :: tolerance = 1.0e-9_wp   !< of stress and resistances, in the smallest resistance
   real(wp), parameter :: looser = 1.0e-2_wp      !< of a minimisation, than what is wrong around it
   real(wp), parameter :: negligible = 1.0e-18_wp !< slip of a step that is none
   real(wp), parameter :: most_slope = 0.9_wp     !< behind a step, in that before it
   real(wp), parameter :: growth = 30.0_wp        !< largest growth of the fastest slip in an iteration

   !> What does not change from particle to particle.
   type :: crystal_constants_t
      integer :: systems = 0
      real(wp), allocatable :: schmid(:, :) !< (systems, 8), m_slip_systems
      real(wp), allocatable :: latent(:, :) !< (systems, systems): hardening of a system by slip on another
      real(wp) :: c11 = 0.0_wp, c12 = 0.0_wp, c44 = 0.0_wp !< Pa
      real(wp) :: reference_rate = 0.0_wp   !< 1/s
      real(wp) :: sensitivity = 0.0_wp      !< m
      integer :: power = 0                  !< 1/m where that is a whole number, else 0
   end type crystal_constants_t

   !> One crystal: what flow is given, and what it finds.
   type :: slip_t
      real(wp) :: stretch(3, 3)   = 0.0_wp      !< elastic, at the step's beginning
      real(wp) :: increment(3, 3) = 0.0_wp      !< dt L
      real(wp), allocatable :: resistance(:)    !< (systems), Pa; advanced
      real(wp), allocatable :: modulus(:)       !< (systems): of hardening in this step, Pa
      real(wp), allocatable :: slip(:)          !< (systems): of the step, without sign
      real(wp) :: work = 0.0_wp                 !< of slip, per volume before elastic deformation, J/m3
      real(wp) :: strain = 0.0_wp               !< equivalent plastic strain of the step
      real(wp) :: elastic(3, 3) = 0.0_wp        !< elastic deformation gradient at the step's end
      integer :: iterations = 0                 !< of Newton's method
      logical :: found = .false.                !< else nothing here is of use
   end type slip_t

contains

   !> Resolved shear stress over resistance below which a step of dt has no slip.
   pure real(wp) function slip_threshold(constants, time_step) result(threshold)
      type(crystal_constants_t), intent(in) :: constants
      real(wp), intent(in) :: time_step !< s
      threshold = (negligible/(time_step*constants%reference_rate))**constants%sensitivity
   end function slip_threshold

   !> A step in one solve; where that fails in 2, 4, ... parts.
   pure subroutine flow(constants, time_step, threshold, one)
      type(crystal_constants_t), intent(in) :: constants
      real(wp), intent(in) :: time_step !< s
      real(wp), intent(in) :: threshold
      type(slip_t), intent(inout) :: one
      real(wp) :: way(3, 3), back(3, 3), flown(3, 3), stress(8), resistance(constants%systems)
      integer :: part, parts
      one%iterations = 0
      resistance = one%resistance
      parts = 1
      do
         back = unit()
         one%slip = 0.0_wp
         one%work = 0.0_wp
         one%strain = 0.0_wp
         one%resistance = resistance
         stress = mandel(constants, matmul(one%stretch, one%stretch))
         do part = 1, parts
            way = one%stretch + (real(part, wp)/parts)*matmul(one%increment, one%stretch)
            call solve(constants, time_step/parts, threshold, matmul(way, back), stress, one, flown)
            if (.not. one%found) exit
            back = matmul(back, flown)
         end do
         if (one%found .or. parts == most_parts) exit
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

   !> One solve: the stress and the slip that it drives, so that both agree. With resistances, the skew part of
   !> the stress and what small strains leave out held, the deviator of the stress is the minimum of a convex
   !> function (`minimise`); these follow, and so on, which converges by a factor of about the strain.
   pure subroutine solve(constants, time_step, threshold, trial, stress, one, flown)
      type(crystal_constants_t), intent(in) :: constants
      real(wp), intent(in) :: time_step, threshold
      real(wp), intent(in) :: trial(3, 3)  !< elastic deformation gradient, were there no slip
      real(wp), intent(inout) :: stress(8) !< Mandel's, before and after
      type(slip_t), intent(inout) :: one
      real(wp), intent(out) :: flown(3, 3) !< inverse of the plastic deformation gradient of the step
      real(wp) :: tau(constants%systems), slip(constants%systems), resistance(constants%systems), &
                  harder(constants%systems)
      real(wp) :: c(3, 3), now(8), change(8), target(5), compliance(5), together(8), reach, wrong, smallest
      integer :: n
      c = matmul(transpose(trial), trial)
      now = mandel(constants, c)
      flown = unit()
      one%found = all(abs(matmul(constants%schmid, now)) <= threshold*one%resistance)
      if (one%found) then
         stress = now
         return
      end if
      compliance(:2) = 1.0_wp/(constants%c11 - constants%c12)
      compliance(3:) = 0.5_wp/constants%c44
      reach = max(threshold, maxval(abs(matmul(constants%schmid, stress))/one%resistance), &
                  (strain_of(one%increment)/(time_step*constants%reference_rate))**constants%sensitivity)
      change = now - stress
      stress = stress + step_share(constants, stress, change, reach*one%resistance)*change
      resistance = one%resistance
      smallest = minval(resistance)
      target = now(:5)
      wrong = smallest
      do n = 1, most_rounds
         call minimise(constants, time_step, threshold, compliance, target, resistance, reach, &
                       max(tolerance*smallest, looser*wrong), stress, tau, slip, one)
         if (.not. one%found) exit
         together = matmul(slip, constants%schmid)
         flown = inverse_of(together)
         now = mandel(constants, matmul(transpose(flown), matmul(c, flown)))
         harder = one%resistance + matmul(constants%latent, one%modulus*abs(slip))
         wrong = max(maxval(abs(stress - now)), maxval(abs(harder - resistance)))
         if (wrong <= tolerance*smallest) then
            one%resistance = harder
            one%slip = one%slip + abs(slip)
            one%work = one%work + dot_product(tau, slip)
            one%strain = one%strain + sqrt(2.0_wp/3.0_wp)*norm2(together(:5))
            return
         end if
         if (.not. wrong <= huge(wrong)) exit
         target = now(:5) + together(:5)/compliance
         ! what resists more takes more stress for the same slip
         stress(:5) = stress(:5)*(maxval(abs(tau)/resistance)/maxval(abs(tau)/harder))
         stress(6:) = now(6:)
         resistance = harder
      end do
      one%found = .false.
   end subroutine solve

   !> The deviator of the stress where compliance (stress - target) + slip P = 0, the slope of a convex function
   !> of the deviator. Newton's method; steps in which the fastest slip would grow by more than `growth` are
   !> cut, and halved where they lead well beyond the minimum along them.
   pure subroutine minimise(constants, time_step, threshold, compliance, target, resistance, reach, enough, &
                            stress, tau, slip, one)
      type(crystal_constants_t), intent(in) :: constants
      real(wp), intent(in) :: time_step, threshold
      real(wp), intent(in) :: compliance(5)  !< 1/Pa
      real(wp), intent(in) :: target(5)      !< Pa
      real(wp), intent(in) :: resistance(:)  !< (systems), Pa
      real(wp), intent(in) :: reach          !< ratio of stress to resistance that slip is expected at
      real(wp), intent(in) :: enough         !< of the residual, Pa
      real(wp), intent(inout) :: stress(8)   !< Pa; the skew part is held
      real(wp), intent(out) :: tau(:), slip(:)
      type(slip_t), intent(inout) :: one     !< found, iterations
      real(wp) :: rise(constants%systems), from(8), change(8), off(5), share, slope, ratio
      logical :: definite
      integer :: n
      slope = huge(slope)
      share = 0.0_wp
      change = 0.0_wp
      from = stress
      one%found = .false.
      do n = 1, most_iterations
         one%iterations = one%iterations + 1
         tau = matmul(constants%schmid, stress)
         call slip_rates(constants, time_step, threshold, tau, resistance, slip, rise)
         off = compliance*(stress(:5) - target) + matmul(slip, constants%schmid(:, :5))
         one%found = maxval(abs(off/compliance)) <= enough
         if (one%found) return
         if (.not. dot_product(off, change(:5)) <= most_slope*slope) then
            share = 0.5_wp*share
         else
            call newton_step(compliance, constants%schmid, rise, off, change(:5), definite)
            if (.not. definite) return
            slope = -dot_product(off, change(:5))
            from = stress
            ratio = max(reach, maxval(abs(tau)/resistance))*growth**constants%sensitivity
            share = step_share(constants, stress, change, ratio*resistance)
         end if
         stress = from + share*change
      end do
   end subroutine minimise

   !> Mandel's stress C S of an elastic deformation with C = F^T F, as m_slip_systems has it, Pa: (C T + T
   !> C^-1)/2 with T = K : (C - C^-1)/4.
   pure function mandel(constants, c) result(stress)
      type(crystal_constants_t), intent(in) :: constants
      real(wp), intent(in) :: c(3, 3)
      real(wp) :: stress(8), inverse(3, 3), t(3, 3), volume
      inverse = cofactors(c)
      inverse = inverse/(c(1, 1)*inverse(1, 1) + c(1, 2)*inverse(1, 2) + c(1, 3)*inverse(1, 3))
      t = (0.5_wp*constants%c44)*(c - inverse)
      volume = 0.25_wp*constants%c12*(c(1, 1) - inverse(1, 1) + c(2, 2) - inverse(2, 2) + c(3, 3) - inverse(3, 3))
      t(1, 1) = volume + 0.25_wp*(constants%c11 - constants%c12)*(c(1, 1) - inverse(1, 1))
      t(2, 2) = volume + 0.25_wp*(constants%c11 - constants%c12)*(c(2, 2) - inverse(2, 2))
      t(3, 3) = volume + 0.25_wp*(constants%c11 - constants%c12)*(c(3, 3) - inverse(3, 3))
      stress = schmid_columns(0.5_wp*(matmul(c, t) + matmul(t, inverse)))
   end function mandel

   !> The slip of a step by the power law, and its derivative by the resolved shear stress.
   pure subroutine slip_rates(constants, time_step, threshold, tau, resistance, slip, rise)
      type(crystal_constants_t), intent(in) :: constants
      real(wp), intent(in) :: time_step, threshold
      real(wp), intent(in) :: tau(:), resistance(:) !< Pa
      real(wp), intent(out) :: slip(:), rise(:)     !< rise: 1/Pa
      real(wp) :: ratio, most
      integer :: a
      most = time_step*constants%reference_rate
      do a = 1, constants%systems
         slip(a) = 0.0_wp
         rise(a) = 0.0_wp
         ratio = abs(tau(a))/resistance(a)
         if (.not. ratio > threshold) cycle
         if (constants%power > 0) then
            slip(a) = sign(most*ratio**constants%power, tau(a))
         else
            slip(a) = sign(most*ratio**(1.0_wp/constants%sensitivity), tau(a))
         end if
         rise(a) = slip(a)/(constants%sensitivity*tau(a))
      end do
   end subroutine slip_rates

   !> exp(-X) of a slip X without trace, of determinant 1: to the third power, and the rest of the determinant
   !> taken off.
   pure function inverse_of(together) result(flown)
      real(wp), intent(in) :: together(8)
      real(wp) :: flown(3, 3), x(3, 3), square(3, 3), cofactor(3, 3), rest
      x = schmid_tensor(together)
      square = matmul(x, x)
      flown = unit() - x + 0.5_wp*square - matmul(square, x)/6.0_wp
      cofactor = cofactors(flown)
      rest = flown(1, 1)*cofactor(1, 1) + flown(1, 2)*cofactor(1, 2) + flown(1, 3)*cofactor(1, 3) - 1.0_wp
      flown = flown*(1.0_wp - rest/3.0_wp*(1.0_wp - 2.0_wp*rest/3.0_wp))
   end function inverse_of

   !> (K^-1 + sum of rise P P) change = -off, in the five deviators.
   pure subroutine newton_step(compliance, schmid, rise, off, change, definite)
      real(wp), intent(in) :: compliance(5) !< 1/Pa
      real(wp), intent(in), contiguous :: schmid(:, :)
      real(wp), intent(in) :: rise(:)       !< 1/Pa
      real(wp), intent(in) :: off(5)        !< strain
      real(wp), intent(out) :: change(5)    !< Pa
      logical, intent(out) :: definite
      real(wp) :: matrix(5, 5), weighted(size(rise))
      integer :: i, j
      do j = 1, 5
         weighted = rise*schmid(:, j)
         do i = j, 5
            matrix(i, j) = dot_product(weighted, schmid(:, i))
         end do
         matrix(j, j) = matrix(j, j) + compliance(j)
      end do
      call solve_definite(5, matrix, -off, change, definite)
   end subroutine newton_step

   !> The largest share, at most 1, of a change that leaves all resolved shear stresses within a limit, or
   !> brings none further out.
   pure real(wp) function step_share(constants, stress, change, limit) result(share)
      type(crystal_constants_t), intent(in) :: constants
      real(wp), intent(in) :: stress(8), change(8)
      real(wp), intent(in) :: limit(:) !< (systems), Pa
      real(wp) :: from(constants%systems), way(constants%systems)
      integer :: a
      from = matmul(constants%schmid, stress)
      way = matmul(constants%schmid, change)
      share = 1.0_wp
      do a = 1, constants%systems
         if (abs(from(a) + share*way(a)) <= limit(a)) cycle
         share = max(0.0_wp, min(share, (limit(a) - sign(1.0_wp, way(a))*from(a))/abs(way(a))))
      end do
   end function step_share

   !> Largest part of the symmetric deviator of a velocity gradient's increment.
   pure real(wp) function strain_of(increment) result(strain)
      real(wp), intent(in) :: increment(3, 3)
      real(wp) :: c(8)
      c = schmid_columns(increment)
      strain = norm2(c(:5))
   end function strain_of

end module m_crystal_flow
