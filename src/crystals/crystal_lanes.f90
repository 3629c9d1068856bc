!> The slip of `lanes` crystals in one step, one vector lane a crystal: the equations of m_crystal_flow,
!> solved by Newton's method for stress and resistances together; slip rates are limited to a factor above
!> those of the step. Lanes without convergence are left to m_crystal_flow, which is safeguarded.
module m_crystal_lanes
   use, intrinsic :: ieee_exceptions, only: ieee_get_halting_mode, ieee_set_halting_mode, ieee_usual
   use m_kinds, only: wp
   use m_crystal_flow, only: growth, tiny_slip, tolerance
   use m_lane_rates, only: lane_rates_t, find_fastest, find_lane_rates, find_share, harden_lanes, &
                           resolve_lanes
   use m_lane_tensors, only: lanes, find_cofactors, find_determinant, invert, multiply, multiply_transposed
   use m_slip_rates, only: crystal_constants_t, max_systems
   implicit none
   private
   public :: crystals_t, deform_elastically, let_slip

   integer, parameter :: max_rounds = 16 !< three to six suffice for short steps
   real(wp), parameter :: max_slip = 1.0_wp !< in a step
   real(wp), parameter :: root_two = sqrt(2.0_wp), root_six = sqrt(6.0_wp)

   !> Input and result of a step, along the axes of the lattices.
   type :: crystals_t
      real(wp) :: stretch(lanes, 3, 3)   !< elastic, at the step's beginning
      real(wp) :: increment(lanes, 3, 3) !< dt L
      real(wp) :: resistance(lanes, max_systems) !< Pa; updated
      real(wp) :: modulus(lanes, max_systems)    !< hardening moduli of this step, Pa
      real(wp) :: trial(lanes, 3, 3)     !< elastic deformation gradient for zero slip
      real(wp) :: square(lanes, 3, 3)    !< trial^T trial
      real(wp) :: stress(lanes, 8)       !< Mandel stress of the trial, Pa
      real(wp) :: slip(lanes), work(lanes), strain(lanes), elastic(lanes, 3, 3) !< as of a slip_t
      logical :: found(lanes)
   end type crystals_t

contains

   !> The step without slip; `found` where no system is fast enough to slip.
   pure subroutine deform_elastically(constants, threshold, one)
      type(crystal_constants_t), intent(in) :: constants
      real(wp), intent(in) :: threshold
      type(crystals_t), intent(inout) :: one
      real(wp) :: tau(lanes, max_systems), fastest(lanes)
      call multiply(one%increment, one%stretch, one%trial)
      one%trial = one%stretch + one%trial
      call multiply_transposed(one%trial, one%trial, one%square)
      call find_mandel(constants, one%square, one%stress)
      call resolve_lanes(constants%systems, constants%width, constants%by_system, one%stress, tau)
      call find_fastest(constants%systems, tau, one%resistance, fastest)
      one%found = fastest <= threshold
      one%slip = 0.0_wp
      one%work = 0.0_wp
      one%strain = 0.0_wp
      one%elastic = one%trial
   end subroutine deform_elastically

   !> The slip of the crystals that do not stay elastic.
   !> Lanes whose iterations diverge overflow, and are left as they are: no trap, where the build sets traps.
   pure subroutine let_slip(constants, time_step, threshold, one)
      type(crystal_constants_t), intent(in) :: constants
      real(wp), intent(in) :: time_step !< s
      real(wp), intent(in) :: threshold
      type(crystals_t), intent(inout) :: one
      logical :: traps(size(ieee_usual))
      call ieee_get_halting_mode(ieee_usual, traps)
      if (any(traps)) call ieee_set_halting_mode(ieee_usual, .false.)
      call solve_lanes(constants, time_step, threshold, one)
      if (any(traps)) call ieee_set_halting_mode(ieee_usual, traps)
   end subroutine let_slip

   !> Newton's method on stress and resistances, eight crystals at a time.
   pure subroutine solve_lanes(constants, time_step, threshold, one)
      type(crystal_constants_t), intent(in) :: constants
      real(wp), intent(in) :: time_step !< s
      real(wp), intent(in) :: threshold
      type(crystals_t), intent(inout) :: one
      real(wp), dimension(lanes, max_systems) :: resistance, harder, tau, way
      real(wp), dimension(lanes, 3, 3) :: flown, square, product
      real(wp), dimension(lanes, 8) :: stress, now, change
      real(wp), dimension(lanes) :: reach, wrong, off, smallest, share
      type(lane_rates_t) :: rates
      logical :: finished(lanes)
      integer :: a, n, round
      n = constants%systems
      associate (width => constants%width)
         call multiply(one%stretch, one%stretch, square)
         call find_mandel(constants, square, stress)
         call resolve_lanes(n, width, constants%by_system, stress, tau)
         call find_fastest(n, tau, one%resistance, reach)
         call raise_reach(constants, time_step, threshold, one%increment, reach)
         change = one%stress - stress
         call resolve_lanes(n, width, constants%by_system, change, way)
         call find_share(n, tau, way, reach, one%resistance, share)
         call go_on(n, share, change, way, stress, tau)
         smallest = one%resistance(:, 1)
         resistance(:, 1) = one%resistance(:, 1)
         do a = 2, n
            resistance(:, a) = one%resistance(:, a)
            smallest = min(smallest, resistance(:, a))
         end do
         do round = 1, max_rounds
            call find_lane_rates(constants, width, constants%by_system, constants%squares, time_step, &
                                 threshold, tau, resistance, rates)
            call find_flown(rates%together, flown)
            call multiply(one%square, flown, product)
            call multiply_transposed(flown, product, square)
            call find_mandel(constants, square, now)
            call harden_lanes(n, width, constants%latent, one%resistance, one%modulus, &
                              rates%slips, harder)
            wrong = 0.0_wp
            off = 0.0_wp
            call compare(8, stress, now, wrong, off)
            call compare(n, resistance, harder, wrong, off)
            ! the maximum of NaN may be a number, a sum is not
            finished = wrong <= tolerance*smallest .and. off <= huge(off) .and. rates%slip <= max_slip &
                       .and. .not. one%found
            if (any(finished)) call take(n, finished, flown, harder, rates, one)
            if (all(one%found .or. .not. off <= huge(off))) return
            call find_change(constants%systems, width, constants%by_system, constants%compliance, &
                             1.0_wp/constants%sensitivity, rates, resistance, harder, stress, now, change)
            call resolve_lanes(n, width, constants%by_system, change, way)
            call find_share(n, tau, way, reach*growth**constants%sensitivity, harder, share)
            call go_on(n, share, change, way, stress, tau)
            resistance(:, :n) = harder(:, :n)
         end do
      end associate
   end subroutine solve_lanes

   !> Raise the largest difference, and sum all differences.
   pure subroutine compare(count, a, b, largest, together)
      integer, intent(in) :: count
      real(wp), intent(in), dimension(lanes, *) :: a, b
      real(wp), intent(inout), dimension(lanes) :: largest, together
      integer :: i, p
      do i = 1, count
         !$omp simd
         do p = 1, lanes
            largest(p) = max(largest(p), abs(a(p, i) - b(p, i)))
            together(p) = together(p) + abs(a(p, i) - b(p, i))
         end do
      end do
   end subroutine compare

   !> Store the results of finished crystals; their resistances at the step's beginning are no longer needed.
   pure subroutine take(systems, finished, flown, harder, rates, one)
      integer, intent(in) :: systems
      logical, intent(in) :: finished(lanes)
      real(wp), intent(in) :: flown(lanes, 3, 3), harder(lanes, max_systems)
      type(lane_rates_t), intent(in) :: rates
      type(crystals_t), intent(inout) :: one
      real(wp) :: elastic(lanes, 3, 3)
      integer :: a, i, j
      call multiply(one%trial, flown, elastic)
      do j = 1, 3
         do i = 1, 3
            one%elastic(:, i, j) = merge(elastic(:, i, j), one%elastic(:, i, j), finished)
         end do
      end do
      do a = 1, systems
         one%resistance(:, a) = merge(harder(:, a), one%resistance(:, a), finished)
         one%modulus(:, a) = merge(0.0_wp, one%modulus(:, a), finished) ! no further change
      end do
      one%slip = merge(rates%slip, one%slip, finished)
      one%work = merge(rates%work, one%work, finished)
      one%strain = merge(sqrt(2.0_wp/3.0_wp)*sqrt(rates%together(:, 1)**2 + rates%together(:, 2)**2 &
                         + rates%together(:, 3)**2 + rates%together(:, 4)**2 + rates%together(:, 5)**2), &
                         one%strain, finished)
      where (finished) one%found = .true.
   end subroutine take

   !> Raise the reach to at least the value for the rate of the step.
   pure subroutine raise_reach(constants, time_step, threshold, increment, reach)
      type(crystal_constants_t), intent(in) :: constants
      real(wp), intent(in) :: time_step, threshold, increment(lanes, 3, 3)
      real(wp), intent(inout) :: reach(lanes)
      real(wp) :: c(lanes, 8), norm
      integer :: p
      call set_columns(increment, c)
      do p = 1, lanes
         norm = sqrt(c(p, 1)**2 + c(p, 2)**2 + c(p, 3)**2 + c(p, 4)**2 + c(p, 5)**2)
         norm = (norm/(time_step*constants%reference_rate))**constants%sensitivity
         reach(p) = max(threshold, reach(p), norm)
      end do
   end subroutine raise_reach

   !> Add a share of a change to the stress and to the resolved shear stresses.
   pure subroutine go_on(systems, share, change, way, stress, tau)
      integer, intent(in) :: systems
      real(wp), intent(in) :: share(lanes), change(lanes, 8), way(lanes, max_systems)
      real(wp), intent(inout) :: stress(lanes, 8), tau(lanes, max_systems)
      integer :: a, p
      do a = 1, 8
         !$omp simd
         do p = 1, lanes
            stress(p, a) = stress(p, a) + share(p)*change(p, a)
         end do
      end do
      do a = 1, systems
         !$omp simd
         do p = 1, lanes
            tau(p, a) = tau(p, a) + share(p)*way(p, a)
         end do
      end do
   end subroutine go_on

   !> Newton step of the stress: for the deviators (K^-1 + sum of rise P P) change = -off, with the
   !> first-order effect of grown resistances and of the change of the skew part on the slip; L D L^T.
   pure subroutine find_change(systems, width, by_system, compliance, exponent, rates, resistance, harder, &
                               stress, now, change)
      integer, intent(in) :: systems, width
      real(wp), intent(in) :: by_system(8, width), compliance(5), exponent
      type(lane_rates_t), intent(in) :: rates
      real(wp), intent(in), dimension(lanes, max_systems) :: resistance, harder
      real(wp), intent(in), dimension(lanes, 8) :: stress, now
      real(wp), intent(out) :: change(lanes, 8)
      real(wp) :: m(lanes, 5, 5), more(lanes)
      integer :: a, i, j, k, p
      do i = 1, 8
         !$omp simd
         do p = 1, lanes
            change(p, i) = now(p, i) - stress(p, i)
         end do
      end do
      do i = 1, 5
         !$omp simd
         do p = 1, lanes
            change(p, i) = compliance(i)*change(p, i)
         end do
      end do
      do a = 1, systems
         !$omp simd
         do p = 1, lanes
            more(p) = rates%rises(p, a)*(by_system(6, a)*change(p, 6) + by_system(7, a)*change(p, 7) &
                                         + by_system(8, a)*change(p, 8)) &
                      - exponent*rates%slips(p, a)*(harder(p, a)/resistance(p, a) - 1.0_wp)
         end do
         do i = 1, 5
            !$omp simd
            do p = 1, lanes
               change(p, i) = change(p, i) - more(p)*by_system(i, a)
            end do
         end do
      end do
      k = 0
      do j = 1, 5
         do i = j, 5
            k = k + 1
            !$omp simd
            do p = 1, lanes
               m(p, i, j) = rates%squares(p, k) + merge(compliance(j), 0.0_wp, i == j)
            end do
         end do
      end do
      call solve_definite(m, change)
   end subroutine find_change

   !> Solve five equations by L D L^T: the lower triangles of symmetric positive definite matrices, which are
   !> overwritten, and the right side, which becomes the solution.
   pure subroutine solve_definite(m, change)
      real(wp), intent(inout) :: m(lanes, 5, 5), change(lanes, 8)
      real(wp) :: inverse(lanes, 5), factor(lanes)
      integer :: i, j, k, p
      do j = 1, 5
         !$omp simd
         do p = 1, lanes
            inverse(p, j) = 1.0_wp/m(p, j, j)
         end do
         do i = j + 1, 5
            !$omp simd
            do p = 1, lanes
               factor(p) = m(p, i, j)*inverse(p, j)
               change(p, i) = change(p, i) - factor(p)*change(p, j)
            end do
            do k = i, 5
               !$omp simd
               do p = 1, lanes
                  m(p, k, i) = m(p, k, i) - factor(p)*m(p, k, j)
               end do
            end do
         end do
      end do
      do j = 5, 1, -1
         do i = j + 1, 5
            !$omp simd
            do p = 1, lanes
               change(p, j) = change(p, j) - m(p, i, j)*change(p, i)
            end do
         end do
         !$omp simd
         do p = 1, lanes
            change(p, j) = change(p, j)*inverse(p, j)
         end do
      end do
   end subroutine solve_definite

   !> Mandel stress, as in m_crystal_flow.
   pure subroutine find_mandel(constants, c, stress)
      type(crystal_constants_t), intent(in) :: constants
      real(wp), intent(in) :: c(lanes, 3, 3)
      real(wp), intent(out) :: stress(lanes, 8)
      real(wp), dimension(lanes, 3, 3) :: inverse, t, left, right
      real(wp) :: determinant(lanes), volume(lanes)
      integer :: i, j, p
      call invert(c, inverse, determinant)
      do j = 1, 3
         do i = 1, 3
            !$omp simd
            do p = 1, lanes
               t(p, i, j) = (0.5_wp*constants%c44)*(c(p, i, j) - inverse(p, i, j))
            end do
         end do
      end do
      !$omp simd
      do p = 1, lanes
         volume(p) = 0.25_wp*constants%c12*(c(p, 1, 1) - inverse(p, 1, 1) + c(p, 2, 2) - inverse(p, 2, 2) &
                                            + c(p, 3, 3) - inverse(p, 3, 3))
      end do
      do i = 1, 3
         !$omp simd
         do p = 1, lanes
            t(p, i, i) = volume(p) + 0.25_wp*(constants%c11 - constants%c12)*(c(p, i, i) - inverse(p, i, i))
         end do
      end do
      call multiply(c, t, left)
      call multiply(t, inverse, right)
      do j = 1, 3
         do i = 1, 3
            !$omp simd
            do p = 1, lanes
               left(p, i, j) = 0.5_wp*(left(p, i, j) + right(p, i, j))
            end do
         end do
      end do
      call set_columns(left, stress)
   end subroutine find_mandel

   !> The eight components of tensors, as in m_slip_systems.
   pure subroutine set_columns(a, c)
      real(wp), intent(in) :: a(lanes, 3, 3)
      real(wp), intent(out) :: c(lanes, 8)
      integer :: p
      !$omp simd
      do p = 1, lanes
         c(p, 1) = (a(p, 1, 1) - a(p, 2, 2))/root_two
         c(p, 2) = (2.0_wp*a(p, 3, 3) - a(p, 1, 1) - a(p, 2, 2))/root_six
         c(p, 3) = (a(p, 2, 3) + a(p, 3, 2))/root_two
         c(p, 4) = (a(p, 1, 3) + a(p, 3, 1))/root_two
         c(p, 5) = (a(p, 1, 2) + a(p, 2, 1))/root_two
         c(p, 6) = (a(p, 3, 2) - a(p, 2, 3))/root_two
         c(p, 7) = (a(p, 1, 3) - a(p, 3, 1))/root_two
         c(p, 8) = (a(p, 2, 1) - a(p, 1, 2))/root_two
      end do
   end subroutine set_columns

   !> exp(-X) of a traceless slip X, with determinant 1, as in m_crystal_flow. Values beyond the limit of a
   !> step, during the iteration, are cut off.
   pure subroutine find_flown(slips, flown)
      real(wp), intent(in) :: slips(lanes, 8)
      real(wp), intent(out) :: flown(lanes, 3, 3)
      real(wp), dimension(lanes, 3, 3) :: x, square, cube
      real(wp) :: together(lanes, 8), rest(lanes), largest(lanes), first, second
      integer :: i, j, p
      largest = 0.0_wp
      do i = 1, 8
         !$omp simd
         do p = 1, lanes
            together(p, i) = min(max_slip, max(-max_slip, slips(p, i)))
            largest(p) = max(largest(p), abs(together(p, i)))
         end do
      end do
      !$omp simd private(first, second)
      do p = 1, lanes
         first = together(p, 1)/root_two
         second = together(p, 2)/root_six
         x(p, 1, 1) = first - second
         x(p, 2, 2) = -first - second
         x(p, 3, 3) = 2.0_wp*second
         x(p, 2, 3) = (together(p, 3) - together(p, 6))/root_two
         x(p, 3, 2) = (together(p, 3) + together(p, 6))/root_two
         x(p, 1, 3) = (together(p, 4) + together(p, 7))/root_two
         x(p, 3, 1) = (together(p, 4) - together(p, 7))/root_two
         x(p, 1, 2) = (together(p, 5) - together(p, 8))/root_two
         x(p, 2, 1) = (together(p, 5) + together(p, 8))/root_two
      end do
      call multiply(x, x, square)
      call multiply(square, x, cube)
      do j = 1, 3
         do i = 1, 3
            !$omp simd
            do p = 1, lanes
               flown(p, i, j) = merge(1.0_wp, 0.0_wp, i == j) - x(p, i, j) + 0.5_wp*square(p, i, j) &
                                - cube(p, i, j)/6.0_wp
            end do
         end do
      end do
      call find_cofactors(flown, cube)
      call find_determinant(flown, cube, rest)
      !$omp simd
      do p = 1, lanes
         rest(p) = merge(0.0_wp, rest(p) - 1.0_wp, largest(p) < tiny_slip)
         rest(p) = 1.0_wp - rest(p)/3.0_wp*(1.0_wp - 2.0_wp*rest(p)/3.0_wp)
      end do
      do j = 1, 3
         do i = 1, 3
            !$omp simd
            do p = 1, lanes
               flown(p, i, j) = flown(p, i, j)*rest(p)
            end do
         end do
      end do
   end subroutine find_flown

end module m_crystal_lanes
