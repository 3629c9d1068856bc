!> Slip rates of a crystal's systems under a stress: resolved shear stresses, the power law, sums over the
!> systems (theory.md, eqs schmid, crystal-flow).
module m_slip_rates
   use m_kinds, only: wp
   implicit none
   private
   public :: crystal_constants_t, rates_t, slip_threshold, find_rates, harden, resolve, fastest

   integer, parameter, public :: max_systems = 48
   real(wp), parameter :: negligible = 1.0e-18_wp !< slip of a step that counts as none

   !> Constants of all particles. Arrays over systems are padded to whole vectors, with inactive systems.
   type :: crystal_constants_t
      integer :: systems = 0
      integer :: width = 0                    !< number of systems, padded
      real(wp), allocatable :: schmid(:, :)   !< (width, 8), m_slip_systems
      real(wp), allocatable :: by_system(:, :) !< (8, width): the same
      real(wp), allocatable :: squares(:, :)  !< (16, width): of the first five components, the lower triangle
                                              !< by columns
      real(wp), allocatable :: latent(:, :)   !< (width, width): hardening of a system by slip on another
      real(wp) :: c11 = 0.0_wp, c12 = 0.0_wp, c44 = 0.0_wp !< Pa
      real(wp) :: compliance(5) = 0.0_wp      !< of the deviators, 1/Pa
      real(wp) :: reference_rate = 0.0_wp     !< 1/s
      real(wp) :: sensitivity = 0.0_wp        !< m
      integer :: power = 0                    !< 1/m if that is an integer, else 0
   contains
      procedure :: set_systems
   end type crystal_constants_t

   !> Slip under a stress, and its derivatives.
   type :: rates_t
      real(wp) :: together(8)  !< sum of slip P
      real(wp) :: squares(16)  !< sum of (d slip/d tau) P P, the lower triangle by columns, 1/Pa
      real(wp) :: fastest      !< largest ratio of resolved shear stress to resistance
      real(wp) :: work         !< sum of tau times slip, J/m3
      real(wp) :: slip         !< sum of magnitudes
      real(wp) :: slips(max_systems) !< of the systems
      real(wp) :: rises(max_systems) !< d slip/d tau, 1/Pa
   end type rates_t

contains

   !> Set the slip systems.
   pure subroutine set_systems(self, schmid, latent)
      class(crystal_constants_t), intent(inout) :: self
      real(wp), intent(in) :: schmid(:, :) !< (systems, 8)
      real(wp), intent(in) :: latent(:, :) !< (systems, systems)
      integer :: i, j, k, n
      n = size(schmid, 1)
      self%systems = n
      self%width = 8*((n + 7)/8)
      if (allocated(self%schmid)) deallocate (self%schmid, self%by_system, self%squares, self%latent)
      allocate (self%schmid(self%width, 8), self%by_system(8, self%width), self%squares(16, self%width), &
                self%latent(self%width, self%width), source=0.0_wp)
      self%schmid(:n, :) = schmid
      self%latent(:n, :n) = latent
      self%by_system = transpose(self%schmid)
      k = 0
      do j = 1, 5
         do i = j, 5
            k = k + 1
            self%squares(k, :) = self%schmid(:, i)*self%schmid(:, j)
         end do
      end do
   end subroutine set_systems

   !> Resolved shear stress over resistance below which a step of dt has no slip.
   pure real(wp) function slip_threshold(constants, time_step) result(threshold)
      type(crystal_constants_t), intent(in) :: constants
      real(wp), intent(in) :: time_step !< s
      threshold = (negligible/(time_step*constants%reference_rate))**constants%sensitivity
   end function slip_threshold

   !> The slip of a step by the power law, and its derivative.
   pure subroutine find_rates(constants, width, time_step, threshold, stress, resistance, rates)
      type(crystal_constants_t), intent(in) :: constants
      integer, intent(in) :: width
      real(wp), intent(in) :: time_step, threshold
      real(wp), intent(in) :: stress(8), resistance(width) !< Pa
      type(rates_t), intent(out) :: rates
      real(wp), dimension(max_systems) :: tau, ratio, slip
      call resolve(width, constants%schmid, stress, tau)
      ratio(:width) = max(abs(tau(:width))/resistance, threshold)
      call raise(width, constants%sensitivity, constants%power, ratio, slip)
      call sum_systems(constants%systems, width, constants%by_system, constants%squares, &
                       time_step*constants%reference_rate, 1.0_wp/constants%sensitivity, threshold, &
                       tau, ratio, slip, rates)
   end subroutine find_rates

   !> From powers of ratios to slips and their sums over the systems.
   pure subroutine sum_systems(systems, width, by_system, squares, most, exponent, threshold, tau, &
                               ratio, raised, rates)
      integer, intent(in) :: systems, width
      real(wp), intent(in) :: by_system(8, width), squares(16, width)
      real(wp), intent(in) :: most      !< slip of the step where the stress equals the resistance
      real(wp), intent(in) :: exponent, threshold
      real(wp), intent(in) :: tau(width), ratio(width), raised(width)
      type(rates_t), intent(out) :: rates
      real(wp) :: together(8), square(16), slip, rise
      integer :: a
      together = 0.0_wp
      square = 0.0_wp
      rates%work = 0.0_wp
      rates%slip = 0.0_wp
      rates%fastest = 0.0_wp
      do a = 1, systems
         rates%slips(a) = 0.0_wp
         rates%rises(a) = 0.0_wp
         rates%fastest = max(rates%fastest, ratio(a))
         if (.not. ratio(a) > threshold) cycle
         slip = most*raised(a)
         rise = exponent*slip/abs(tau(a))
         rates%slip = rates%slip + slip
         rates%work = rates%work + abs(tau(a))*slip
         slip = sign(slip, tau(a))
         rates%slips(a) = slip
         rates%rises(a) = rise
         together = together + slip*by_system(:, a)
         square = square + rise*squares(:, a)
      end do
      rates%together = together
      rates%squares = square
   end subroutine sum_systems

   !> Growth of the resistances by slip, Pa.
   pure subroutine harden(systems, width, latent, modulus, slips, growth)
      integer, intent(in) :: systems, width
      real(wp), intent(in) :: latent(width, width), modulus(width), slips(width)
      real(wp), intent(out) :: growth(width)
      integer :: a
      growth = 0.0_wp
      do a = 1, systems
         if (abs(slips(a)) > 0.0_wp) growth = growth + (modulus(a)*abs(slips(a)))*latent(:, a)
      end do
   end subroutine harden

   !> Resolved shear stresses.
   pure subroutine resolve(width, schmid, stress, tau)
      integer, intent(in) :: width
      real(wp), intent(in) :: schmid(width, 8), stress(8)
      real(wp), intent(out) :: tau(width)
      integer :: a
      !$omp simd
      do a = 1, width
         tau(a) = (schmid(a, 1)*stress(1) + schmid(a, 2)*stress(2)) + (schmid(a, 3)*stress(3) &
                  + schmid(a, 4)*stress(4)) + (schmid(a, 5)*stress(5) + schmid(a, 6)*stress(6)) &
                  + (schmid(a, 7)*stress(7) + schmid(a, 8)*stress(8))
      end do
   end subroutine resolve

   !> Ratios to the power 1/m.
   pure subroutine raise(width, sensitivity, power, ratio, raised)
      integer, intent(in) :: width, power !< power: 1/m as an integer, 0: it is none
      real(wp), intent(in) :: sensitivity, ratio(width)
      real(wp), intent(out) :: raised(width)
      real(wp) :: base(max_systems)
      integer :: left
      if (power == 0) then
         raised = ratio**(1.0_wp/sensitivity)
         return
      end if
      raised = 1.0_wp
      base(:width) = ratio
      left = power
      do
         if (mod(left, 2) == 1) raised = raised*base(:width)
         left = left/2
         if (left == 0) exit
         base(:width) = base(:width)*base(:width)
      end do
   end subroutine raise

   !> The largest ratio of resolved shear stress to resistance.
   pure real(wp) function fastest(width, schmid, stress, resistance) result(largest)
      integer, intent(in) :: width
      real(wp), intent(in) :: schmid(width, 8), stress(8), resistance(width)
      real(wp) :: tau(max_systems)
      call resolve(width, schmid, stress, tau)
      largest = maxval(abs(tau(:width))/resistance)
   end function fastest

end module m_slip_rates
