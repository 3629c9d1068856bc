!> Creep combined with the plasticity of j2: secondary by Norton's power law or a table, primary by Bailey's
!> power of time with strain hardening (theory.md, eqs creep, primary-creep).
module m_norton
   use m_kinds, only: wp
   use m_group_reader, only: group_reader_t
   use m_value_range, only: above, at_least
   use m_field_table, only: field_table_t, layout_t
   use m_plastic, only: lane_t, lanes, return_along_deviator
   use m_j2, only: j2_t
   implicit none
   private
   public :: norton_t

   real(wp), parameter :: never = 1.0e30_wp        !< Pa, yield stress of a material that does not yield
   real(wp), parameter :: close_enough = 3.0e-14_wp !< tolerance of the logarithm of the von Mises stress
   real(wp), parameter :: negligible = 1.0e-17_wp  !< relative drop of stress in a step that counts as none
   real(wp), parameter :: min_stress = 1.0e-100_wp !< Pa, in place of zero
   integer, parameter :: iteration_limit = 60      !< three to eight suffice

   !> The creep rate at the von Mises stress q: creep_rate (q/creep_stress)^creep_exponent, or by the points
   !> of a table, linear between them on logarithmic axes, and extrapolated by the last interval.
   type, extends(j2_t) :: norton_t
      real(wp), allocatable :: creep_stress(:)      !< Pa, rising
      real(wp), allocatable :: creep_rate(:)        !< 1/s
      real(wp) :: creep_exponent = 1.0_wp
      real(wp) :: primary_strain = 0.0_wp           !< at creep_stress after primary_time; 0: none
      real(wp) :: primary_time = 1.0_wp             !< s
      real(wp) :: primary_exponent = 1.0_wp/3.0_wp  !< of time
      integer :: creep = 0, primary = 0             !< columns: equivalent creep strain, the primary part of
                                                    !< it
   contains
      procedure :: variables
      procedure :: declare
      procedure :: flow
      procedure :: is_time_dependent
      procedure :: static_parts
      procedure, private :: relax
      procedure, private :: relax_all
      procedure, private :: rate_of
   end type norton_t

contains

   subroutine variables(self, group)
      class(norton_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      logical :: has_primary
      if (.not. self%yield_stress > 0.0_wp) self%yield_stress = never
      call self%isotropic_variables(group, must_yield=.false.)
      call group%get_list('creep_stress', self%creep_stress, above(0.0_wp, 'Pa'), required=.true.)
      call group%get_list('creep_rate', self%creep_rate, above(0.0_wp, '1/s'), required=.true.)
      has_primary = group%is_given('primary_strain') .or. self%primary_strain > 0.0_wp
      call group%get('creep_exponent', self%creep_exponent, at_least(1.0_wp, ''), required=needs_exponent())
      call group%get('primary_strain', self%primary_strain, at_least(0.0_wp, ''))
      call group%get('primary_time', self%primary_time, above(0.0_wp, 's'), used=has_primary)
      call group%get('primary_exponent', self%primary_exponent, above(0.0_wp, '', at_most=1.0_wp), &
                     used=has_primary)
      if (.not. (allocated(self%creep_stress) .and. allocated(self%creep_rate))) return
      associate (stress => self%creep_stress, rate => self%creep_rate)
         if (size(stress) /= size(rate)) then
            call group%refuse('creep_rate', 'must have as many numbers as creep_stress')
         else if (any(stress(2:) <= stress(:size(stress) - 1))) then
            call group%refuse('creep_stress', 'must rise')
         else if (any(rate(2:) < rate(:size(rate) - 1))) then
            call group%refuse('creep_rate', 'must not fall')
         end if
      end associate
   contains
      !> False with a table, which has its own slopes.
      logical function needs_exponent()
         needs_exponent = has_primary
         if (allocated(self%creep_stress)) needs_exponent = has_primary .or. size(self%creep_stress) == 1
      end function needs_exponent
   end subroutine variables

   pure subroutine declare(self, table, has_tools)
      class(norton_t), intent(inout) :: self
      type(field_table_t), intent(inout) :: table
      logical, intent(in) :: has_tools
      call self%j2_t%declare(table, has_tools)
      call table%declare('creep_strain', 1, '1', written=.true.)
      self%creep = table%column('creep_strain')
      self%primary = 0
      self%asks_begun = .true.
      if (.not. self%primary_strain > 0.0_wp) return
      call table%declare('primary_creep_strain', 1, '1', written=.false.)
      self%primary = table%column('primary_creep_strain')
   end subroutine declare

   pure integer function static_parts(self)
      class(norton_t), intent(in) :: self
      static_parts = 4
   end function static_parts

   pure logical function is_time_dependent(self)
      class(norton_t), intent(in) :: self
      is_time_dependent = .true.
   end function is_time_dependent

   !> Creep reduces the deviator first; the stress above the yield stress then flows as in j2. The work of
   !> creep is that of the mean of the stresses before and after the step (theory.md, eq. creep-work).
   pure subroutine flow(self, column, layout, time_step, first, last, lane)
      class(norton_t), intent(in) :: self
      real(wp), intent(inout), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: time_step
      integer, intent(in) :: first, last
      type(lane_t), intent(inout) :: lane
      real(wp) :: q(lanes), crept(lanes), primary
      integer :: i, p
      associate (s => layout%stress)
         if (size(self%creep_stress) == 1 .and. self%primary == 0) then
            call self%relax_all(time_step, lane%trial(:last - first + 1), q(:last - first + 1))
         else
            do p = first, last
               i = p - first + 1
               q(i) = lane%trial(i)
               if (.not. q(i) > 0.0_wp) cycle
               primary = 0.0_wp
               if (self%primary > 0) primary = column(p, self%primary)
               call self%relax(lane%trial(i), time_step, primary, q(i))
               if (self%primary > 0) column(p, self%primary) = primary
            end do
         end if
         !$omp simd private(i)
         do p = first, last
            i = p - first + 1
            if (.not. lane%trial(i) - q(i) > negligible*lane%trial(i)) q(i) = lane%trial(i)
            call return_along_deviator(lane%trial(i) - q(i), lane%trial(i), column(p, s), column(p, s + 1), &
                                       column(p, s + 2), column(p, s + 3), column(p, s + 4), column(p, s + 5))
            crept(i) = (lane%trial(i) - q(i))/(3.0_wp*self%shear)
            column(p, self%creep) = column(p, self%creep) + crept(i)
            lane%trial(i) = q(i)
         end do
      end associate
      call self%j2_t%flow(column, layout, time_step, first, last, lane)
      !$omp simd private(i)
      do p = first, last
         i = p - first + 1
         column(p, self%work) = column(p, self%work) + 0.5_wp*column(p, layout%volume)*crept(i) &
                                *(lane%begun(i) + max(q(i) - 3.0_wp*self%shear*lane%strain(i), 0.0_wp))
      end do
   end subroutine flow

   !> As `relax`, for many particles at once, with a single power law. Each is iterated until converged: after
   !> an iteration the error of the logarithm is at most (n - 1)^2/8 of the square of its change.
   pure subroutine relax_all(self, dt, trial, q)
      class(norton_t), intent(in) :: self
      real(wp), intent(in) :: dt                     !< s
      real(wp), intent(in), contiguous :: trial(:)   !< Pa
      real(wp), intent(out), contiguous :: q(:)      !< Pa
      real(wp), dimension(size(trial)) :: u, aim, last
      real(wp) :: crept, side, now, change, worst, factor, shift, enough
      integer :: i, iteration
      factor = 3.0_wp*self%shear*dt*self%creep_rate(1)
      shift = log(self%creep_stress(1))
      enough = sqrt(close_enough/max(1.0_wp, 0.125_wp*(self%creep_exponent - 1.0_wp)**2))
      aim = log(max(trial, min_stress))
      u = aim
      last = 1.0_wp
      do iteration = 1, iteration_limit
         worst = 0.0_wp
         !$omp simd private(crept, side, now, change) reduction(max: worst)
         do i = 1, size(trial)
            now = exp(u(i))
            crept = factor*exp(self%creep_exponent*(u(i) - shift))
            side = now + crept
            change = merge(1.0_wp, 0.0_wp, last(i) > enough) & ! so that exp stays vectorised
                     *((log(side) - aim(i))*side/(now + self%creep_exponent*crept))
            u(i) = u(i) - change
            last(i) = abs(change)
            worst = max(worst, last(i))
         end do
         if (worst <= enough) exit
      end do
      q = min(exp(u), trial)
   end subroutine relax_all

   !> The von Mises stress q after a step that begins with `trial`:
   !>    q + 3 mu (dt rate(q) + primary creep at q) = trial
   !> (backward Euler: stable for any step), by Newton's iteration on the logarithms of both sides, for which
   !> a power law is nearly linear: it decreases monotonically from the trial stress to the root.
   pure subroutine relax(self, trial, dt, primary, q)
      class(norton_t), intent(in) :: self
      real(wp), intent(in) :: trial, dt   !< Pa; s
      real(wp), intent(inout) :: primary  !< primary creep strain before and after
      real(wp), intent(out) :: q          !< Pa
      real(wp) :: u, side, slope, rate, rate_slope, grown, grown_slope, change
      integer :: iteration
      u = log(trial)
      q = trial
      grown = 0.0_wp
      do iteration = 1, iteration_limit
         call self%rate_of(q, rate, rate_slope)
         call grow(self, q, dt, primary, grown, grown_slope)
         side = q + 3.0_wp*self%shear*(dt*rate + grown)
         slope = (q + 3.0_wp*self%shear*(dt*rate*rate_slope + grown_slope))/side
         change = log(side/trial)/slope
         u = u - change
         if (abs(change) <= close_enough) exit
         q = exp(u)
      end do
      q = min(q, trial)
      primary = primary + grown
   end subroutine relax

   !> Secondary creep rate (1/s) at a von Mises stress, and d ln rate/d ln q.
   pure subroutine rate_of(self, q, rate, slope)
      class(norton_t), intent(in) :: self
      real(wp), intent(in) :: q
      real(wp), intent(out) :: rate, slope
      integer :: k, n
      associate (stress => self%creep_stress, rates => self%creep_rate)
         n = size(stress)
         k = 1
         slope = self%creep_exponent
         if (n > 1) then
            k = min(max(count(stress <= q), 1), n - 1)
            slope = log(rates(k + 1)/rates(k))/log(stress(k + 1)/stress(k))
         end if
         rate = rates(k)*(q/stress(k))**slope
      end associate
   end subroutine rate_of

   !> Growth of the primary creep strain y in a step at the stress q: y^(1/m) grows at a constant rate, so
   !> that at constant stress y = primary_strain (q/creep_stress)^n (t/primary_time)^m. The slope is d/d ln q.
   pure subroutine grow(self, q, dt, before, grown, slope)
      class(norton_t), intent(in) :: self
      real(wp), intent(in) :: q, dt, before
      real(wp), intent(out) :: grown, slope
      real(wp) :: clock, added, m
      grown = 0.0_wp
      slope = 0.0_wp
      if (.not. self%primary_strain > 0.0_wp) return
      m = self%primary_exponent
      clock = before**(1.0_wp/m)
      added = (self%primary_strain*(q/self%creep_stress(1))**self%creep_exponent)**(1.0_wp/m)*dt &
              /self%primary_time
      grown = (clock + added)**m - before
      if (clock > 1.0e6_wp*added) grown = m*added/clock*before ! to full precision
      slope = self%creep_exponent*added*(clock + added)**(m - 1.0_wp)
   end subroutine grow

end module m_norton
