!> Kinematic hardening: back stresses that move the yield surface, linear or with dynamic recovery (Armstrong
!> and Frederick 1966; Chaboche 1986; theory.md, eq. kinematic).
module m_kinematic
   use m_kinds, only: wp
   use m_text, only: to_text
   use m_group_reader, only: group_reader_t
   use m_value_range, only: above, at_least
   use m_field_table, only: field_table_t, layout_t
   use m_elastic, only: elastic_t
   implicit none
   private
   public :: kinematic_t, trial_t, few

   integer, parameter, public :: max_back = 8 !< back stresses of a law
   integer, parameter :: few = 64  !< maximum number of particles solved together
   integer, parameter :: whole = 8 !< the number is rounded up to a multiple of this, to fill vectors

   !> Each back stress grows at 2/3 C times the rate of plastic strain and recovers at gamma times itself
   !> times the rate of equivalent plastic strain.
   type :: kinematic_t
      real(wp), allocatable :: modulus(:)  !< C, Pa
      real(wp), allocatable :: recovery(:) !< gamma; 0: linear
      integer, allocatable :: back(:)      !< first column of each
   contains
      procedure :: variables
      procedure :: is_used
      procedure :: declare
      procedure :: turn
      procedure :: relative
      procedure :: prepare
      procedure :: evaluate_trial
      procedure :: advance
      procedure :: stored
   end type kinematic_t

   !> Particles solved together: x = s - sum of exp(-gamma d) alpha, which is x(0) + sum of m alpha, m = 1 -
   !> exp(-gamma d). Its square needs products of x(0) and alpha only.
   type :: trial_t
      integer :: n = 0                   !< entries in use; those beyond the particles copy the first one
      real(wp) :: x(few, 6)              !< Pa; without flow, then after the flow found
      real(wp) :: back(few, 6, max_back)     !< alpha at the step's beginning, rotated
      real(wp) :: square(few)            !< x : x without flow, Pa2
      real(wp) :: mixed(few, max_back)       !< x : alpha without flow
      real(wp) :: backs(few, max_back, max_back) !< alpha : alpha
      real(wp) :: left(few, max_back)        !< exp(-gamma d): the remaining share of alpha
      real(wp) :: grown(few, max_back)       !< (1 - exp(-gamma d))/gamma
      real(wp) :: size(few)              !< von Mises measure of x, Pa
      real(wp) :: drop(few)              !< reduction of `size` by growing back stresses, Pa
      real(wp) :: slope(few)             !< d (size - drop)/d d, Pa
   end type trial_t

contains

   !> The two lists of the group; without them there are no back stresses.
   subroutine variables(self, group)
      class(kinematic_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      logical :: given
      given = group%is_given('kinematic_modulus') .or. group%is_given('kinematic_recovery') &
              .or. allocated(self%modulus)
      call group%get_list('kinematic_modulus', self%modulus, above(0.0_wp, 'Pa'), required=given, used=given)
      call group%get_list('kinematic_recovery', self%recovery, at_least(0.0_wp, ''), used=given)
      if (.not. allocated(self%modulus)) return
      if (.not. allocated(self%recovery)) self%recovery = 0.0_wp*self%modulus
      if (size(self%modulus) > max_back) &
         call group%refuse('kinematic_modulus', 'must be at most '//to_text(max_back)//' numbers')
      if (size(self%recovery) /= size(self%modulus)) &
         call group%refuse('kinematic_recovery', 'must have as many numbers as kinematic_modulus')
   end subroutine variables

   pure logical function is_used(self)
      class(kinematic_t), intent(in) :: self
      is_used = allocated(self%modulus)
   end function is_used

   !> One deviatoric tensor each.
   pure subroutine declare(self, table)
      class(kinematic_t), intent(inout) :: self
      type(field_table_t), intent(inout) :: table
      integer :: k
      if (.not. self%is_used()) return
      if (allocated(self%back)) deallocate (self%back)
      allocate (self%back(size(self%modulus)))
      do k = 1, size(self%back)
         call table%declare('back_stress_'//to_text(k), 6, 'Pa', written=.true.)
         self%back(k) = table%column('back_stress_'//to_text(k))
      end do
   end subroutine declare

   !> Rotate back stresses as the stress: by the elastic law with zero stiffness.
   pure subroutine turn(self, column, layout, gradient, time_step, first, last)
      class(kinematic_t), intent(in) :: self
      real(wp), intent(inout), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      real(wp), intent(in), contiguous :: gradient(:, :)
      real(wp), intent(in) :: time_step
      integer, intent(in) :: first, last
      type(elastic_t) :: turner
      type(layout_t) :: seen
      integer :: k
      seen = layout
      do k = 1, size(self%back)
         seen%stress = self%back(k)
         call turner%update(column, seen, gradient, time_step, first, last)
      end do
   end subroutine turn

   !> x of n particles from p on without flow, and its size.
   pure subroutine relative(self, column, p, n, s, trial)
      class(kinematic_t), intent(in) :: self
      real(wp), intent(in), contiguous :: column(:, :)
      integer, intent(in) :: p, n, s !< first particle, number, first column of the stress
      type(trial_t), intent(inout) :: trial
      real(wp) :: mean
      integer :: c, i, k
      trial%n = whole*((n + whole - 1)/whole)
      associate (x => trial%x)
         do c = 1, 6
            x(n + 1:trial%n, c) = column(p, s + c - 1)
            x(:n, c) = column(p:p + n - 1, s + c - 1)
            do k = 1, size(self%back)
               associate (b => self%back(k) + c - 1)
                  x(n + 1:trial%n, c) = x(n + 1:trial%n, c) - column(p, b)
                  x(:n, c) = x(:n, c) - column(p:p + n - 1, b)
               end associate
            end do
         end do
         !$omp simd private(mean)
         do i = 1, trial%n
            mean = (x(i, 1) + x(i, 2) + x(i, 3))/3.0_wp
            x(i, 1) = x(i, 1) - mean
            x(i, 2) = x(i, 2) - mean
            x(i, 3) = x(i, 3) - mean
            trial%square(i) = product_of(x(i, 1), x(i, 2), x(i, 3), x(i, 4), x(i, 5), x(i, 6), x(i, 1), &
                                         x(i, 2), x(i, 3), x(i, 4), x(i, 5), x(i, 6))
            trial%size(i) = sqrt(1.5_wp*trial%square(i))
         end do
      end associate
   end subroutine relative

   !> The other products that `evaluate_trial` needs for these particles, and its result without flow.
   pure subroutine prepare(self, column, p, n, trial)
      class(kinematic_t), intent(in) :: self
      real(wp), intent(in), contiguous :: column(:, :)
      integer, intent(in) :: p, n
      type(trial_t), intent(inout) :: trial
      integer :: c, i, k, l
      do k = 1, size(self%back)
         do c = 1, 6
            trial%back(n + 1:trial%n, c, k) = column(p, self%back(k) + c - 1)
            trial%back(:n, c, k) = column(p:p + n - 1, self%back(k) + c - 1)
         end do
         call products(trial%n, trial%x, trial%back(:, :, k), trial%mixed(:, k))
         do l = 1, k
            call products(trial%n, trial%back(:, :, l), trial%back(:, :, k), trial%backs(:, l, k))
            if (l < k) trial%backs(:, k, l) = trial%backs(:, l, k)
         end do
      end do
      trial%slope(:trial%n) = 0.0_wp
      do k = 1, size(self%back)
         !$omp simd
         do i = 1, trial%n
            trial%slope(i) = trial%slope(i) - self%modulus(k) &
                             + 1.5_wp*self%recovery(k)*trial%mixed(i, k)/max(trial%size(i), tiny(1.0_wp))
         end do
      end do
   end subroutine prepare

   !> The state of the trials after flow by d (equivalent plastic strain). For flow in a fixed direction the
   !> law is integrated exactly.
   pure subroutine evaluate_trial(self, d, trial)
      class(kinematic_t), intent(in) :: self
      real(wp), intent(in) :: d(few)
      type(trial_t), intent(inout) :: trial
      real(wp) :: square(few), along(few), with_all(few)
      integer :: i, k, l, n
      n = trial%n
      square(:n) = trial%square(:n)
      along(:n) = 0.0_wp
      trial%drop(:n) = 0.0_wp
      do k = 1, size(self%back)
         call shares(n, self%recovery(k), d, trial%left(:, k), trial%grown(:, k))
         trial%drop(:n) = trial%drop(:n) + self%modulus(k)*trial%grown(:n, k)
      end do
      do k = 1, size(self%back)
         if (.not. self%recovery(k) > 0.0_wp) cycle
         with_all(:n) = trial%mixed(:n, k) ! x : alpha
         do l = 1, size(self%back)
            with_all(:n) = with_all(:n) + self%recovery(l)*trial%grown(:n, l)*trial%backs(:n, l, k)
         end do
         !$omp simd
         do i = 1, n
            square(i) = square(i) + self%recovery(k)*trial%grown(i, k)*(trial%mixed(i, k) + with_all(i))
            along(i) = along(i) + self%recovery(k)*trial%left(i, k)*with_all(i)
         end do
      end do
      !$omp simd
      do i = 1, n
         trial%size(i) = sqrt(1.5_wp*max(square(i), 0.0_wp))
         trial%slope(i) = 1.5_wp*along(i)/max(trial%size(i), tiny(1.0_wp))
      end do
      do k = 1, size(self%back)
         trial%slope(:n) = trial%slope(:n) - self%modulus(k)*trial%left(:n, k)
      end do
   end subroutine evaluate_trial

   !> a : b of the symmetric tensors of n particles.
   pure subroutine products(n, a, b, found)
      integer, intent(in) :: n
      real(wp), intent(in) :: a(few, 6), b(few, 6)
      real(wp), intent(inout) :: found(few)
      integer :: i
      !$omp simd
      do i = 1, n
         found(i) = product_of(a(i, 1), a(i, 2), a(i, 3), a(i, 4), a(i, 5), a(i, 6), b(i, 1), b(i, 2), &
                               b(i, 3), b(i, 4), b(i, 5), b(i, 6))
      end do
   end subroutine products

   !> exp(-gamma d), and (1 - exp(-gamma d))/gamma to full precision: by its series where gamma d is small.
   !> Linear without recovery.
   pure subroutine shares(n, gamma, d, left, grown)
      integer, intent(in) :: n
      real(wp), intent(in) :: gamma, d(few)
      real(wp), intent(inout) :: left(few), grown(few)
      real(wp), parameter :: small = 0.05_wp !< the series' next term is below round-off there
      real(wp), parameter :: third = 1.0_wp/3.0_wp, fifth = 0.2_wp, sixth = 1.0_wp/6.0_wp, &
                             seventh = 1.0_wp/7.0_wp
      real(wp) :: t, series, far, per_gamma
      integer :: i
      left(:n) = 1.0_wp
      grown(:n) = d(:n)
      if (.not. gamma > 0.0_wp) return
      per_gamma = 1.0_wp/gamma
      !$omp simd private(t, series, far)
      do i = 1, n
         t = gamma*d(i)
         left(i) = exp(-t)
         series = d(i)*(1.0_wp - t*0.5_wp*(1.0_wp - t*third*(1.0_wp - t*0.25_wp*(1.0_wp - t*fifth*(1.0_wp &
                  - t*sixth*(1.0_wp - t*seventh*(1.0_wp - t*0.125_wp)))))))
         far = (1.0_wp - left(i))*per_gamma
         grown(i) = merge(series, far, t < small)
      end do
   end subroutine shares

   !> a : b of symmetric tensors, xx yy zz yz xz xy. Scalars, so that loops around it are vectorised.
   pure elemental real(wp) function product_of(a1, a2, a3, a4, a5, a6, b1, b2, b3, b4, b5, b6)
      real(wp), intent(in) :: a1, a2, a3, a4, a5, a6, b1, b2, b3, b4, b5, b6
      product_of = a1*b1 + a2*b2 + a3*b3 + 2.0_wp*(a4*b4 + a5*b5 + a6*b6)
   end function product_of

   !> Update the back stresses of n particles from p on after flow by d along x, as computed by
   !> `evaluate_trial`, and their dissipation per volume: their work minus the energy stored (J/m3). x becomes
   !> that after the flow. Those with d = 0 are not changed.
   pure subroutine advance(self, d, trial, column, p, n, dissipated)
      class(kinematic_t), intent(in) :: self
      real(wp), intent(in) :: d(few)
      type(trial_t), intent(inout) :: trial
      real(wp), intent(inout), contiguous :: column(:, :)
      integer, intent(in) :: p, n
      real(wp), intent(out) :: dissipated(few)
      real(wp) :: flow, old, new, twice, stores, along(few)
      integer :: c, i, k
      do k = 1, size(self%back)
         do c = 1, 6
            trial%x(:n, c) = trial%x(:n, c) + self%recovery(k)*trial%grown(:n, k)*trial%back(:n, c, k)
         end do
      end do
      along(:n) = 1.5_wp/max(trial%size(:n), tiny(flow))
      dissipated(:n) = 0.0_wp
      do k = 1, size(self%back)
         stores = 0.75_wp/self%modulus(k)
         do c = 1, 6
            twice = merge(1.0_wp, 2.0_wp, c <= 3)
            !$omp simd private(flow, old, new)
            do i = 1, n
               flow = along(i)*trial%x(i, c)
               old = trial%back(i, c, k)
               new = trial%left(i, k)*old + 2.0_wp/3.0_wp*self%modulus(k)*trial%grown(i, k)*flow
               dissipated(i) = dissipated(i) + twice*(old + new)*(0.5_wp*d(i)*flow - stores*(new - old))
               column(p + i - 1, self%back(k) + c - 1) = new
            end do
         end do
      end do
   end subroutine advance

   !> Energy in the back stresses of particles first..last, V 3/4 alpha : alpha/C each, J.
   pure real(wp) function stored(self, column, volume, first, last)
      class(kinematic_t), intent(in) :: self
      real(wp), intent(in), contiguous :: column(:, :)
      integer, intent(in) :: volume, first, last !< volume: its column
      integer :: k, p
      stored = 0.0_wp
      do k = 1, size(self%back)
         associate (b => self%back(k))
            !$omp simd reduction(+: stored)
            do p = first, last
               stored = stored + column(p, volume)*0.75_wp/self%modulus(k) &
                        *product_of(column(p, b), column(p, b + 1), column(p, b + 2), column(p, b + 3), &
                                    column(p, b + 4), column(p, b + 5), column(p, b), column(p, b + 1), &
                                    column(p, b + 2), column(p, b + 3), column(p, b + 4), column(p, b + 5))
            end do
         end associate
      end do
   end function stored

end module m_kinematic
