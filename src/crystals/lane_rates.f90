!> Slip rates of the systems of several crystals under their stresses, one vector lane a crystal: m_slip_rates
!> in lanes.
module m_lane_rates
   use m_kinds, only: wp
   use m_lane_tensors, only: lanes
   use m_slip_rates, only: crystal_constants_t, max_systems
   implicit none
   private
   public :: lane_rates_t, find_fastest, find_lane_rates, find_share, harden_lanes, resolve_lanes

   !> Slip under a stress, as in m_slip_rates.
   type :: lane_rates_t
      real(wp) :: together(lanes, 8), squares(lanes, 15)
      real(wp) :: work(lanes), slip(lanes)
      real(wp) :: slips(lanes, max_systems), rises(lanes, max_systems)
   end type lane_rates_t

   real(wp), parameter :: no_way = 1.0e-100_wp !< Pa: a smaller change moves no stress; quotients stay finite

contains

   !> Resolved shear stresses.
   pure subroutine resolve_lanes(systems, width, by_system, stress, tau)
      integer, intent(in) :: systems, width
      real(wp), intent(in) :: by_system(8, width), stress(lanes, 8)
      real(wp), intent(inout) :: tau(lanes, max_systems)
      integer :: a, p
      do a = 1, systems
         !$omp simd
         do p = 1, lanes
            tau(p, a) = (by_system(1, a)*stress(p, 1) + by_system(2, a)*stress(p, 2)) &
                        + (by_system(3, a)*stress(p, 3) + by_system(4, a)*stress(p, 4)) &
                        + (by_system(5, a)*stress(p, 5) + by_system(6, a)*stress(p, 6)) &
                        + (by_system(7, a)*stress(p, 7) + by_system(8, a)*stress(p, 8))
         end do
      end do
   end subroutine resolve_lanes

   !> The largest ratio of resolved shear stress to resistance.
   pure subroutine find_fastest(systems, tau, resistance, fastest)
      integer, intent(in) :: systems
      real(wp), intent(in), dimension(lanes, max_systems) :: tau, resistance
      real(wp), intent(out) :: fastest(lanes)
      integer :: a, p
      fastest = 0.0_wp
      do a = 1, systems
         !$omp simd
         do p = 1, lanes
            fastest(p) = max(fastest(p), abs(tau(p, a))/resistance(p, a))
         end do
      end do
   end subroutine find_fastest

   !> The largest share, at most 1, of a change for which no resolved shear stress exceeds `ratio` times the
   !> resistance, or none that does grows.
   pure subroutine find_share(systems, tau, way, ratio, resistance, share)
      integer, intent(in) :: systems
      real(wp), intent(in), dimension(lanes, max_systems) :: tau, way, resistance
      real(wp), intent(in) :: ratio(lanes)
      real(wp), intent(out) :: share(lanes)
      real(wp) :: most, room, beyond(lanes)
      integer :: a, p
      share = 1.0_wp
      beyond = 0.0_wp
      do a = 1, systems
         !$omp simd
         do p = 1, lanes
            beyond(p) = max(beyond(p), abs(tau(p, a) + way(p, a)) - ratio(p)*resistance(p, a))
         end do
      end do
      if (.not. any(beyond > 0.0_wp)) return
      do a = 1, systems
         !$omp simd private(most, room)
         do p = 1, lanes
            most = ratio(p)*resistance(p, a)
            room = (most - sign(1.0_wp, way(p, a))*tau(p, a))/max(abs(way(p, a)), no_way)
            share(p) = merge(min(share(p), max(0.0_wp, room)), share(p), abs(tau(p, a) + way(p, a)) > most)
         end do
      end do
   end subroutine find_share

   !> The slip of a step by the power law, its derivative, and their sums over the systems.
   pure subroutine find_lane_rates(constants, width, by_system, squares, time_step, threshold, tau, &
                                   resistance, rates)
      type(crystal_constants_t), intent(in) :: constants
      integer, intent(in) :: width
      real(wp), intent(in) :: by_system(8, width), squares(16, width)
      real(wp), intent(in) :: time_step, threshold
      real(wp), intent(in), dimension(lanes, max_systems) :: tau, resistance
      type(lane_rates_t), intent(out) :: rates
      real(wp) :: ratio(lanes), raised(lanes), most, slip
      integer :: a, i, p
      rates%together = 0.0_wp
      rates%squares = 0.0_wp
      rates%work = 0.0_wp
      rates%slip = 0.0_wp
      most = time_step*constants%reference_rate
      do a = 1, constants%systems
         !$omp simd
         do p = 1, lanes
            ratio(p) = max(abs(tau(p, a))/resistance(p, a), threshold)
            rates%slips(p, a) = 0.0_wp
            rates%rises(p, a) = 0.0_wp
         end do
         if (.not. any(ratio > threshold)) cycle
         call raise_lanes(constants%sensitivity, constants%power, ratio, raised)
         !$omp simd private(slip)
         do p = 1, lanes
            slip = merge(most*raised(p), 0.0_wp, ratio(p) > threshold)
            rates%rises(p, a) = slip/(constants%sensitivity*max(abs(tau(p, a)), tiny(1.0_wp)))
            rates%slip(p) = rates%slip(p) + slip
            rates%work(p) = rates%work(p) + abs(tau(p, a))*slip
            rates%slips(p, a) = sign(slip, tau(p, a))
         end do
         do i = 1, 8
            !$omp simd
            do p = 1, lanes
               rates%together(p, i) = rates%together(p, i) + rates%slips(p, a)*by_system(i, a)
            end do
         end do
         do i = 1, 15
            !$omp simd
            do p = 1, lanes
               rates%squares(p, i) = rates%squares(p, i) + rates%rises(p, a)*squares(i, a)
            end do
         end do
      end do
   end subroutine find_lane_rates

   !> Ratios to the power 1/m.
   pure subroutine raise_lanes(sensitivity, power, ratio, raised)
      real(wp), intent(in) :: sensitivity
      integer, intent(in) :: power !< 1/m as an integer, 0: it is none
      real(wp), intent(in) :: ratio(lanes)
      real(wp), intent(out) :: raised(lanes)
      real(wp) :: base(lanes)
      integer :: left, p
      if (power == 0) then
         !$omp simd
         do p = 1, lanes
            raised(p) = ratio(p)**(1.0_wp/sensitivity)
         end do
         return
      end if
      raised = 1.0_wp
      base = ratio
      left = power
      do
         if (mod(left, 2) == 1) then
            !$omp simd
            do p = 1, lanes
               raised(p) = raised(p)*base(p)
            end do
         end if
         left = left/2
         if (left == 0) exit
         !$omp simd
         do p = 1, lanes
            base(p) = base(p)*base(p)
         end do
      end do
   end subroutine raise_lanes

   !> Resistances at the step's end, Pa.
   pure subroutine harden_lanes(systems, width, latent, resistance, modulus, slips, harder)
      integer, intent(in) :: systems, width
      real(wp), intent(in) :: latent(width, width)
      real(wp), intent(in), dimension(lanes, max_systems) :: resistance, modulus !< at the step's beginning,
                                                                                 !< Pa
      real(wp), intent(in) :: slips(lanes, max_systems)
      real(wp), intent(inout) :: harder(lanes, max_systems)
      real(wp) :: more(lanes)
      integer :: a, b, p
      harder(:, :systems) = resistance(:, :systems)
      do b = 1, systems
         !$omp simd
         do p = 1, lanes
            more(p) = modulus(p, b)*abs(slips(p, b))
         end do
         if (.not. any(more > 0.0_wp)) cycle
         do a = 1, systems
            !$omp simd
            do p = 1, lanes
               harder(p, a) = harder(p, a) + latent(a, b)*more(p)
            end do
         end do
      end do
   end subroutine harden_lanes

end module m_lane_rates
