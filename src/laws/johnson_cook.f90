!> Johnson and Cook's (1983) plasticity: hardening, rate, temperature, and heating by plastic work (theory.md,
!> eqs return, johnson-cook).
module m_johnson_cook
   use m_kinds, only: wp
   use m_value_range, only: above, at_least
   use m_group_reader, only: group_reader_t
   use m_field_table, only: field_table_t, layout_t
   use m_material, only: failure_t
   use m_plastic, only: plastic_t, lane_t, lanes, declare_plastic, initial_plastic
   implicit none
   private
   public :: johnson_cook_t

   integer, parameter :: iteration_limit = 40 !< two to six suffice, at first yield up to 16
   !> Tolerance of the last change of ln d. The remaining error is at most half of its square, n/2 of it:
   !> round-off. Where the rate is within this of the reference rate the error is at most this.
   real(wp), parameter :: close_enough = 3.0e-9_wp

   type, extends(plastic_t) :: johnson_cook_t
      real(wp) :: yield_stress = 0.0_wp         !< A, Pa
      real(wp) :: hardening_modulus = 0.0_wp    !< B, Pa
      real(wp) :: hardening_exponent = 1.0_wp   !< n
      real(wp) :: rate_coefficient = 0.0_wp     !< C
      real(wp) :: reference_rate = 1.0_wp       !< 1/s
      real(wp) :: thermal_exponent = 1.0_wp     !< m
      real(wp) :: room_temperature = 293.15_wp  !< K; also the initial temperature
      real(wp) :: melting_temperature = 0.0_wp  !< K
      real(wp) :: specific_heat = 0.0_wp        !< J/kg/K
      real(wp) :: heat_fraction = 0.9_wp        !< share of the plastic work converted to heat
      integer :: temperature = 0                !< column, K
   contains
      procedure :: variables
      procedure :: declare
      procedure :: initial
      procedure :: flow
      procedure :: take_heat
      procedure :: failure
      procedure, private :: solve
   end type johnson_cook_t

contains

   !> As for any elastic law, with a temperature.
   pure type(failure_t) function failure(self)
      class(johnson_cook_t), intent(in) :: self
      failure = failure_t(acts=.true., warms=.true., lame=self%lame, shear=self%shear, &
                          room=self%room_temperature, melting=self%melting_temperature)
   end function failure

   !> The law's own variables of its &material group.
   subroutine variables(self, group)
      class(johnson_cook_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      call self%elastic_variables(group)
      call group%get('yield_stress', self%yield_stress, above(0.0_wp, 'Pa'), required=.true.)
      call group%get('hardening_modulus', self%hardening_modulus, at_least(0.0_wp, 'Pa'), required=.true.)
      call group%get('hardening_exponent', self%hardening_exponent, above(0.0_wp, ''), required=.true.)
      call group%get('rate_coefficient', self%rate_coefficient, at_least(0.0_wp, ''), required=.true.)
      call group%get('reference_rate', self%reference_rate, above(0.0_wp, '1/s'))
      call group%get('thermal_exponent', self%thermal_exponent, above(0.0_wp, ''), required=.true.)
      call group%get('room_temperature', self%room_temperature, above(0.0_wp, 'K'))
      call group%get('melting_temperature', self%melting_temperature, above(0.0_wp, 'K'), required=.true.)
      call group%get('specific_heat', self%specific_heat, above(0.0_wp, 'J/kg/K'), required=.true.)
      call group%get('heat_fraction', self%heat_fraction, at_least(0.0_wp, '', at_most=1.0_wp))
      if (self%melting_temperature <= self%room_temperature) &
         call group%refuse('melting_temperature', 'must be above room_temperature')
   end subroutine variables

   !> The fields of plastic flow, and the temperature.
   pure subroutine declare(self, table, has_tools)
      class(johnson_cook_t), intent(inout) :: self
      type(field_table_t), intent(inout) :: table
      logical, intent(in) :: has_tools
      call declare_plastic(self, table, has_tools)
      call table%declare('temperature', 1, 'K', written=.true., by_mass=.true.)
      self%temperature = table%column('temperature')
   end subroutine declare

   !> The initial temperature is the room temperature.
   pure subroutine initial(self, column, layout, first, last)
      class(johnson_cook_t), intent(in) :: self
      real(wp), intent(inout), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: first, last
      call initial_plastic(self, column, layout, first, last)
      column(first:last, self%temperature) = self%room_temperature
   end subroutine initial

   !> Flow at the temperature of the step's beginning, then heat. Particles that flow are gathered into lanes
   !> first: few do, and powers are expensive.
   pure subroutine flow(self, column, layout, time_step, first, last, lane)
      class(johnson_cook_t), intent(in) :: self
      real(wp), intent(inout), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: time_step
      integer, intent(in) :: first, last
      type(lane_t), intent(inout) :: lane
      real(wp), dimension(lanes) :: warmth, beyond, trial, before, factor, excess, strain
      integer :: which(lanes), i, n, p
      !$omp simd
      do p = first, last
         i = p - first + 1
         warmth(i) = thermal(self%room_temperature, self%melting_temperature, self%thermal_exponent, &
                             column(p, self%temperature))
         beyond(i) = lane%trial(i) - warmth(i)*(self%yield_stress + self%hardening_modulus &
                                                *power(column(p, self%strain), self%hardening_exponent))
      end do
      n = 0
      do i = 1, last - first + 1
         if (beyond(i) <= 0.0_wp) cycle
         n = n + 1
         which(n) = i
         trial(n) = lane%trial(i)
         before(n) = column(first + i - 1, self%strain)
         factor(n) = warmth(i)
         excess(n) = beyond(i)
      end do
      if (n == 0) return
      call self%solve(time_step, trial(:n), before(:n), factor(:n), excess(:n), strain(:n))
      do i = 1, n
         p = first + which(i) - 1
         lane%strain(which(i)) = strain(i)
         lane%work(which(i)) = max(trial(i) - 3.0_wp*self%shear*strain(i), 0.0_wp)*strain(i)
         column(p, self%temperature) = column(p, self%temperature) + self%heat_fraction/self%specific_heat &
                                       *lane%work(which(i))*column(p, layout%volume)/column(p, layout%mass)
      end do
   end subroutine flow

   pure subroutine take_heat(self, values, layout, heat)
      class(johnson_cook_t), intent(in) :: self
      real(wp), intent(inout) :: values(:)
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: heat
      values(self%temperature) = values(self%temperature) + heat/(self%specific_heat*values(layout%mass))
   end subroutine take_heat

   !> 1 - T*^m, with T* between 0 and 1: cold material has the strength of room temperature, molten material
   !> has none.
   pure elemental real(wp) function thermal(room, melting, exponent, temperature)
      real(wp), intent(in) :: room, melting, exponent, temperature
      thermal = 1.0_wp - power(min(max((temperature - room)/(melting - room), 0.0_wp), 1.0_wp), exponent)
   end function thermal

   !> x^n of a non-negative x, to 1e-14. A vectorised power would branch at each 0.
   pure elemental real(wp) function power(x, n)
      real(wp), intent(in) :: x, n
      real(wp), parameter :: least = 1.0e-300_wp
      power = exp(max(n*log(max(x, least)), -700.0_wp))
      power = merge(power, 0.0_wp, x > least)
   end function power

   !> Solve trial - 3 mu d = yield stress(before + d, d/dt) by Newton's iteration in u = ln d. The yield
   !> function is concave and decreasing in u (each term of the yield stress is convex and rises), and d =
   !> excess/(3 mu) lies to the right of the root: from there the iteration decreases monotonically to the
   !> root, without a safeguard. In d itself it would need one: d^n and ln d are steep at 0.
   pure subroutine solve(self, time_step, trial, before, factor, excess, strain)
      class(johnson_cook_t), intent(in) :: self
      real(wp), intent(in) :: time_step
      real(wp), intent(in), contiguous :: trial(:)   !< von Mises stress, Pa
      real(wp), intent(in), contiguous :: before(:)  !< equivalent plastic strain before the step
      real(wp), intent(in), contiguous :: factor(:)  !< temperature factor
      real(wp), intent(in), contiguous :: excess(:) !< trial stress minus the yield stress at rest, above 0,
                                                    !< Pa
      real(wp), intent(out), contiguous :: strain(:) !< increment of the equivalent plastic strain
      real(wp) :: u(lanes), change(lanes), slowest, worst
      integer :: i, iteration
      slowest = log(max(self%reference_rate*time_step, tiny(time_step)))
      u(:size(trial)) = log(excess/(3.0_wp*self%shear))
      change(:size(trial)) = 1.0_wp
      do iteration = 1, iteration_limit
         worst = 0.0_wp
         !$omp simd reduction(max: worst)
         do i = 1, size(trial)
            call improve(self%yield_stress, self%hardening_modulus, self%hardening_exponent, &
                         self%rate_coefficient, slowest, &
                         3.0_wp*self%shear, trial(i), before(i), factor(i), u(i), change(i))
            worst = max(worst, abs(change(i)))
         end do
         if (worst <= close_enough) exit
      end do
      strain = exp(u(:size(trial)))
   end subroutine solve

   !> One iteration of one particle, without effect if the last change of u was small enough.
   pure elemental subroutine improve(a, b, n, c, slowest, return_slope, trial, before, factor, u, change)
      real(wp), intent(in) :: a, b, n, c, slowest, return_slope, trial, before, factor
      real(wp), intent(inout) :: u, change
      real(wp) :: strain, hardening, rate, beyond, slope
      strain = exp(u)
      hardening = b*exp(n*log(before + strain))
      rate = 1.0_wp + c*max(u - slowest, 0.0_wp)
      beyond = trial - return_slope*strain - (a + hardening)*rate*factor
      slope = return_slope*strain + factor*(n*hardening*strain/(before + strain)*rate &
                                         + merge(c, 0.0_wp, u > slowest)*(a + hardening))
      slope = merge(1.0_wp, 0.0_wp, abs(change) > close_enough)/slope ! no branch: exp stays vectorised
      change = beyond*slope
      u = u + change
   end subroutine improve

end module m_johnson_cook
