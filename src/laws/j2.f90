!> Von Mises plasticity with isotropic hardening: none, linear, or by a table (theory.md, eqs return, j2),
!> optionally with kinematic hardening (kinematic.f90).
module m_j2
   use m_kinds, only: wp
   use m_value_range, only: above, at_least
   use m_group_reader, only: group_reader_t
   use m_field_table, only: field_table_t, layout_t
   use m_stress_slopes, only: elastic_slopes, return_slopes
   use m_kinematic, only: kinematic_t, trial_t, few
   use m_material, only: failure_t
   use m_plastic, only: plastic_t, lane_t, lanes, declare_plastic, update_plastic, follow_shape, &
                        von_mises
   implicit none
   private
   public :: j2_t

   real(wp), parameter :: at_yield = 1.0_wp - 1.0e-8_wp !< of the yield stress: a stress above it is at yield
                                                        !< and flows if it grows

   !> The yield stress is yield_stress + hardening_modulus times the equivalent plastic strain or, with a
   !> table, linear between its points and constant after the last.
   type, extends(plastic_t) :: j2_t
      real(wp) :: yield_stress = 0.0_wp             !< initial, Pa
      real(wp) :: hardening_modulus = 0.0_wp !< slope of yield stress over equivalent plastic strain, Pa
      real(wp), allocatable :: hardening_strain(:)  !< equivalent plastic strain, rising from 0
      real(wp), allocatable :: hardening_stress(:)  !< yield stress there, Pa
      type(kinematic_t) :: kinematic                !< back stresses, if given
   contains
      procedure :: variables
      procedure :: declare
      procedure :: update
      procedure :: stress_tangent
      procedure :: flow
      procedure :: strain_energy
      procedure :: failure
      procedure, non_overridable :: isotropic_variables
      procedure, private :: segment
      procedure, private :: curve
      procedure, private :: find_flow
   end type j2_t

contains

   !> The law's own variables of its &material group.
   subroutine variables(self, group)
      class(j2_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      call self%isotropic_variables(group, must_yield=.true.)
      call self%kinematic%variables(group)
   end subroutine variables

   !> The variables of elasticity and of the yield stress.
   subroutine isotropic_variables(self, group, must_yield)
      class(j2_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      logical, intent(in) :: must_yield !< if false, a law without yield stress stays elastic
      logical :: by_table
      call self%elastic_variables(group)
      by_table = group%is_given('hardening_strain') .or. group%is_given('hardening_stress') &
                 .or. allocated(self%hardening_strain)
      call group%get_list('hardening_strain', self%hardening_strain, at_least(0.0_wp, ''), &
                          required=by_table, used=by_table)
      call group%get_list('hardening_stress', self%hardening_stress, above(0.0_wp, 'Pa'), required=by_table, &
                          used=by_table)
      call group%get('yield_stress', self%yield_stress, above(0.0_wp, 'Pa'), &
                     required=must_yield .and. .not. by_table)
      call group%get('hardening_modulus', self%hardening_modulus, at_least(0.0_wp, 'Pa'))
      if (.not. (allocated(self%hardening_strain) .and. allocated(self%hardening_stress))) return
      associate (strain => self%hardening_strain, stress => self%hardening_stress)
         if (size(strain) /= size(stress)) then
            call group%refuse('hardening_stress', 'must have as many numbers as hardening_strain')
            return
         end if
         if (strain(1) > 0.0_wp) call group%refuse('hardening_strain', 'must begin with 0')
         if (any(strain(2:) <= strain(:size(strain) - 1))) call group%refuse('hardening_strain', 'must rise')
         if (any(stress(2:) < stress(:size(stress) - 1))) &
            call group%refuse('hardening_stress', 'must not fall')
         if (group%is_given('yield_stress') .and. abs(self%yield_stress - stress(1)) > 0.0_wp) &
            call group%refuse('yield_stress', 'must be the first of hardening_stress, or absent')
         if (self%hardening_modulus > 0.0_wp) &
            call group%refuse('hardening_modulus', 'must be 0 or absent with hardening_strain')
         self%yield_stress = stress(1)
      end associate
   end subroutine isotropic_variables

   !> The fields of plastic flow, and the back stresses.
   pure subroutine declare(self, table, has_tools)
      class(j2_t), intent(inout) :: self
      type(field_table_t), intent(inout) :: table
      logical, intent(in) :: has_tools
      call declare_plastic(self, table, has_tools)
      call self%kinematic%declare(table)
   end subroutine declare

   !> As for all laws of plastic flow; with back stresses particles are solved in groups, unless none of a
   !> group flows.
   pure subroutine update(self, column, layout, gradient, time_step, first, last)
      class(j2_t), intent(in) :: self
      real(wp), intent(inout), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      real(wp), intent(in), contiguous :: gradient(:, :)
      real(wp), intent(in) :: time_step
      integer, intent(in) :: first, last
      type(trial_t) :: trial
      integer :: p
      if (.not. self%kinematic%is_used()) then
         call update_plastic(self, column, layout, gradient, time_step, first, last)
         return
      end if
      call self%elastic_t%update(column, layout, gradient, time_step, first, last)
      call self%kinematic%turn(column, layout, gradient, time_step, first, last)
      if (self%shape > 0) call follow_shape(self%shape, column, gradient, time_step, first, last)
      do p = first, last, few
         call return_to_moved(self, column, layout, p, min(few, last - p + 1), trial)
      end do
   end subroutine update

   !> For this law itself, without back stresses: with d the increment of plastic strain and H the slope of
   !> the yield stress, 3 mu d falls by 3 mu/(3 mu + H) of what is added to the trial stress.
   pure subroutine stress_tangent(self, column, layout, gradient, parts, time_step, count, slope, known)
      class(j2_t), intent(in) :: self
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      real(wp), intent(in), contiguous :: gradient(:, :)
      integer, intent(in) :: parts, count
      real(wp), intent(in) :: time_step
      real(wp), intent(inout), contiguous :: slope(:, :)
      logical, intent(out) :: known
      real(wp) :: moved(count, size(column, 2)), trial(count, 6)
      real(wp), dimension(count) :: strength, rise, drop, drop_slope
      integer :: p
      known = .false.
      select type (self)
      type is (j2_t)
         known = parts == 1 .and. .not. self%kinematic%is_used()
      end select
      if (.not. known) return
      moved = column
      call self%update(moved, layout, gradient/time_step, time_step, 1, count)
      call elastic_slopes(count, self%lame, self%shear, gradient, &
                          column(:count, layout%stress:layout%stress + 5), trial, slope)
      call self%curve(moved(:, self%strain), strength, rise)
      do p = 1, count
         drop(p) = 3.0_wp*self%shear*(moved(p, self%strain) - column(p, self%strain))
         drop_slope(p) = 0.0_wp
         if (drop(p) > 0.0_wp .or. von_mises(trial(p, 1), trial(p, 2), trial(p, 3), trial(p, 4), &
                                             trial(p, 5), trial(p, 6)) >= at_yield*strength(p)) &
            drop_slope(p) = 3.0_wp*self%shear/(3.0_wp*self%shear + rise(p))
      end do
      if (any(drop_slope > 0.0_wp)) call return_slopes(count, trial, drop, drop_slope, slope)
   end subroutine stress_tangent

   !> Return of n particles from p on to the yield surface about their back stresses (theory.md, eq.
   !> kinematic). The stress of particles that do not flow keeps its bits.
   pure subroutine return_to_moved(self, column, layout, p, n, trial)
      class(j2_t), intent(in) :: self
      real(wp), intent(inout), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: p, n
      type(trial_t), intent(inout) :: trial
      real(wp), dimension(few) :: strain, strength, slope, d, dissipated, new_strength, excess, share
      integer :: c, i, m
      call self%kinematic%relative(column, p, n, layout%stress, trial)
      m = trial%n
      strain(n + 1:m) = column(p, self%strain)
      strain(:n) = column(p:p + n - 1, self%strain)
      call self%curve(strain(:m), strength(:m), slope(:m))
      excess(:m) = trial%size(:m) - strength(:m)
      if (layout%damage > 0) & ! the stress was removed; back stresses must not cause flow
         excess(:n) = merge(excess(:n), -1.0_wp, column(p:p + n - 1, layout%damage) < 1.0_wp)
      excess(n + 1:m) = -1.0_wp
      if (.not. any(excess(:n) > 0.0_wp)) return
      call self%kinematic%prepare(column, p, n, trial)
      call self%find_flow(strain, excess, slope, trial, d)
      share(:m) = strain(:m) + d(:m)
      call self%curve(share(:m), new_strength(:m), slope(:m))
      call self%kinematic%advance(d, trial, column, p, n, dissipated)
      share(:n) = 3.0_wp*self%shear*d(:n)/max(trial%size(:n), tiny(share))
      do c = 1, 6
         !$omp simd
         do i = 1, n
            column(p + i - 1, layout%stress + c - 1) = column(p + i - 1, layout%stress + c - 1) &
                                                       - share(i)*trial%x(i, c)
         end do
      end do
      !$omp simd
      do i = 1, n
         column(p + i - 1, self%strain) = strain(i) + d(i)
         column(p + i - 1, self%work) = column(p + i - 1, self%work) + column(p + i - 1, layout%volume) &
                                        *(0.5_wp*(strength(i) + new_strength(i))*d(i) + dissipated(i))
      end do
   end subroutine return_to_moved

   !> As for any elastic law, with back stresses.
   pure type(failure_t) function failure(self)
      class(j2_t), intent(in) :: self
      failure = self%elastic_t%failure()
      if (self%kinematic%is_used()) failure%back = self%kinematic%modulus
   end function failure

   !> The elastic energy, and that stored in back stresses.
   pure real(wp) function strain_energy(self, column, layout, first, last) result(energy)
      class(j2_t), intent(in) :: self
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: first, last
      energy = self%elastic_t%strain_energy(column, layout, first, last)
      if (self%kinematic%is_used()) &
         energy = energy + self%kinematic%stored(column, layout%volume, first, last)
   end function strain_energy

   !> The increments d of equivalent plastic strain with
   !> size(d) - drop(d) - 3 mu d = yield stress(strain + d), by a safeguarded Newton iteration: the left side
   !> minus the right decreases (by 3 mu at least) in d. Particles converge independently of each other; those
   !> that do not flow have d = 0.
   pure subroutine find_flow(self, strain, excess, slope, trial, d)
      class(j2_t), intent(in) :: self
      real(wp), intent(in) :: strain(few) !< before the step
      real(wp), intent(in) :: excess(few) !< of `size` over the yield stress, without flow; above 0: flows
      real(wp), intent(inout) :: slope(few) !< of the yield stress, before the step
      type(trial_t), intent(inout) :: trial
      real(wp), intent(out) :: d(few)
      integer, parameter :: iteration_limit = 100
      real(wp), parameter :: residual_allowed = 1.0e-14_wp
      real(wp) :: return_slope, worst
      real(wp), dimension(few) :: low, high, now, at, allowed, left_over
      integer :: i, iteration
      return_slope = 3.0_wp*self%shear
      !$omp simd
      do i = 1, trial%n
         allowed(i) = merge(residual_allowed*trial%size(i), huge(1.0_wp), excess(i) > 0.0_wp)
         low(i) = 0.0_wp
         high(i) = max(excess(i), 0.0_wp)/return_slope
         d(i) = min(max(excess(i)/(return_slope + slope(i) - trial%slope(i)), 0.0_wp), high(i))
      end do
      do iteration = 1, iteration_limit
         call self%kinematic%evaluate_trial(d, trial)
         at(:trial%n) = strain(:trial%n) + d(:trial%n)
         call self%curve(at(:trial%n), now(:trial%n), slope(:trial%n))
         worst = 0.0_wp
         !$omp simd reduction(max: worst)
         do i = 1, trial%n
            call improve(trial%size(i) - trial%drop(i) - return_slope*d(i) - now(i), &
                         return_slope + slope(i) - trial%slope(i), allowed(i), low(i), high(i), d(i), &
                         left_over(i))
            worst = max(worst, left_over(i))
         end do
         if (worst <= 0.0_wp) exit
      end do
   end subroutine find_flow

   !> One iteration of one particle. `left_over` is the residual beyond the tolerance; at 0 d is not changed.
   pure elemental subroutine improve(residual, slope, allowed, low, high, d, left_over)
      real(wp), intent(in) :: residual, slope, allowed
      real(wp), intent(inout) :: low, high, d
      real(wp), intent(out) :: left_over
      real(wp) :: next, middle
      left_over = max(abs(residual) - allowed, 0.0_wp)
      low = merge(d, low, residual > 0.0_wp)
      high = merge(d, high, residual < 0.0_wp)
      middle = 0.5_wp*(low + high)
      next = d + residual/slope
      next = merge(next, middle, next >= low)
      next = merge(next, middle, next <= high)
      d = merge(next, d, left_over > 0.0_wp)
   end subroutine improve

   !> Yield stresses (Pa) at equivalent plastic strains, and their slopes there.
   pure subroutine curve(self, at, stress, slope)
      class(j2_t), intent(in) :: self
      real(wp), intent(in), contiguous :: at(:)
      real(wp), intent(out), contiguous :: stress(:), slope(:)
      real(wp) :: begin, end, rise
      logical :: is_last
      integer :: i, k
      stress = self%yield_stress
      slope = 0.0_wp
      k = 0
      is_last = .false.
      do while (.not. is_last)
         k = k + 1
         call self%segment(k, begin, end, rise, is_last)
         !$omp simd
         do i = 1, size(at)
            stress(i) = stress(i) + rise*min(max(at(i) - begin, 0.0_wp), end - begin)
            slope(i) = merge(rise, slope(i), at(i) >= begin)
         end do
      end do
   end subroutine curve

   !> Segment k of the hardening curve: plastic strain at its two ends, and its slope (Pa). `is_last` has no
   !> upper end.
   pure subroutine segment(self, k, begin, end, slope, is_last)
      class(j2_t), intent(in) :: self
      integer, intent(in) :: k
      real(wp), intent(out) :: begin, end, slope
      logical, intent(out) :: is_last
      begin = 0.0_wp
      end = huge(end)
      slope = self%hardening_modulus
      is_last = .true.
      if (.not. allocated(self%hardening_strain)) return
      associate (strain => self%hardening_strain, stress => self%hardening_stress)
         begin = strain(k)
         slope = 0.0_wp
         is_last = k == size(strain)
         if (is_last) return
         end = strain(k + 1)
         slope = (stress(k + 1) - stress(k))/(end - begin)
      end associate
   end subroutine segment

   !> Follow the segments of the curve from each particle's plastic strain: exact for any number of kinks in a
   !> step.
   pure subroutine flow(self, column, layout, time_step, first, last, lane)
      class(j2_t), intent(in) :: self
      real(wp), intent(inout), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: time_step
      integer, intent(in) :: first, last
      type(lane_t), intent(inout) :: lane
      real(wp) :: strength(lanes), beyond(lanes), begin, end, slope, largest
      logical :: is_last
      integer :: i, k, n
      n = last - first + 1
      strength(:n) = self%yield_stress
      k = 0
      is_last = .false.
      do while (.not. is_last)
         k = k + 1
         call self%segment(k, begin, end, slope, is_last)
         !$omp simd
         do i = 1, n
            strength(i) = strength(i) + slope*min(max(column(first + i - 1, self%strain) - begin, 0.0_wp), &
                                                  end - begin)
         end do
      end do
      largest = 0.0_wp
      !$omp simd reduction(max: largest)
      do i = 1, n
         beyond(i) = max(lane%trial(i) - strength(i), 0.0_wp)
         largest = max(largest, beyond(i))
      end do
      if (largest <= 0.0_wp) return
      k = 0
      is_last = .false.
      do while (.not. is_last)
         k = k + 1
         call self%segment(k, begin, end, slope, is_last)
         !$omp simd
         do i = 1, n
            call walk(column(first + i - 1, self%strain), end, slope, 3.0_wp*self%shear, beyond(i), &
                      strength(i), lane%strain(i), lane%work(i))
         end do
      end do
   end subroutine flow

   !> Flow within one segment until the trial stress is reached or the segment ends; none where the strain is
   !> beyond the segment.
   pure elemental subroutine walk(before, end, slope, return_slope, beyond, strength, strain, work)
      real(wp), intent(in) :: before    !< plastic strain before the step
      real(wp), intent(in) :: end       !< of the segment
      real(wp), intent(in) :: slope     !< Pa
      real(wp), intent(in) :: return_slope !< decrease of the trial stress per plastic strain, 3 times the
                                           !< shear
                                        !< modulus, Pa
      real(wp), intent(inout) :: beyond, strength, strain, work
      real(wp) :: part
      part = min(max(end - (before + strain), 0.0_wp), beyond/(return_slope + slope))
      beyond = max(beyond - part*(return_slope + slope), 0.0_wp)
      work = work + part*(strength + 0.5_wp*slope*part)
      strength = strength + slope*part
      strain = strain + part
   end subroutine walk

end module m_j2
