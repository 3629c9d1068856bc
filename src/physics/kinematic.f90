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

   integer, parameter :: most = 8 !< back stresses
   integer, parameter :: few = 16 !< particles solved for side by side: whole vectors, whatever their width

   !> Each grows at 2/3 C times the rate of plastic strain and is recalled at gamma times itself times the
   !> rate of equivalent plastic strain.
   type :: kinematic_t
      real(wp), allocatable :: modulus(:)  !< C, Pa
      real(wp), allocatable :: recovery(:) !< gamma; 0: linear
      integer, allocatable :: back(:)      !< first column of each
   contains
      procedure :: variables
      procedure :: is_used
      procedure :: declare
      procedure :: turn
      procedure :: measure
      procedure :: relative
      procedure :: look
      procedure :: advance
      procedure :: stored
   end type kinematic_t

   !> Some particles side by side while their flow is sought: x = s - sum of exp(-gamma d) alpha.
   type :: trial_t
      real(wp) :: stress(few, 6)         !< deviator after the elastic step, Pa
      real(wp) :: back(few, 6, most)     !< alpha at the step's beginning, turned
      real(wp) :: x(few, 6)              !< Pa
      real(wp) :: left(few, most)        !< exp(-gamma d): the share of alpha that is left
      real(wp) :: grown(few, most)       !< (1 - exp(-gamma d))/gamma
      real(wp) :: size(few)              !< von Mises measure of x
      real(wp) :: drop(few)              !< what flow takes of `size` by growing back stresses, Pa
      real(wp) :: slope(few)             !< d (size - drop)/d d, Pa
   end type trial_t

contains

   !> The two lists of the group; without them there is none.
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
      if (size(self%modulus) > most) &
         call group%refuse('kinematic_modulus', 'must be at most '//to_text(most)//' numbers')
      if (size(self%recovery) /= size(self%modulus)) &
         call group%refuse('kinematic_recovery', 'must have as many numbers as kinematic_modulus')
   end subroutine variables

   pure logical function is_used(self)
      class(kinematic_t), intent(in) :: self
      is_used = allocated(self%modulus)
   end function is_used

   !> One tensor each, a deviator.
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

   !> Back stresses turn as the stress does: by the elastic law without stiffness.
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

   !> Von Mises measure (Pa) of what is between stress and back stresses of particles first..last.
   pure subroutine measure(self, column, s, first, last, apart)
      class(kinematic_t), intent(in) :: self
      real(wp), intent(in), contiguous :: column(:, :)
      integer, intent(in) :: s, first, last !< s: first column of the stress
      real(wp), intent(out) :: apart(:)
      real(wp) :: x(last - first + 1, 6)
      integer :: c, k, n
      n = last - first + 1
      do c = 1, 6
         x(:, c) = column(first:last, s + c - 1)
         do k = 1, size(self%back)
            x(:, c) = x(:, c) - column(first:last, self%back(k) + c - 1)
         end do
      end do
      apart(:n) = sqrt(0.5_wp*((x(:, 1) - x(:, 2))**2 + (x(:, 2) - x(:, 3))**2 + (x(:, 3) - x(:, 1))**2) &
                       + 3.0_wp*(x(:, 4)**2 + x(:, 5)**2 + x(:, 6)**2))
   end subroutine measure

   !> The deviators of n particles' stresses from p on, their back stresses, and what is between them. Places
   !> beyond n are those of the first, so that vectors are full.
   pure subroutine relative(self, column, p, n, s, trial)
      class(kinematic_t), intent(in) :: self
      real(wp), intent(in), contiguous :: column(:, :)
      integer, intent(in) :: p, n, s !< first particle, number, first column of the stress
      type(trial_t), intent(out) :: trial
      real(wp) :: mean
      integer :: c, i, k
      do c = 1, 6
         trial%stress(:, c) = column(p, s + c - 1)
         trial%stress(:n, c) = column(p:p + n - 1, s + c - 1)
      end do
      !$omp simd private(mean)
      do i = 1, few
         mean = (trial%stress(i, 1) + trial%stress(i, 2) + trial%stress(i, 3))/3.0_wp
         trial%stress(i, 1) = trial%stress(i, 1) - mean
         trial%stress(i, 2) = trial%stress(i, 2) - mean
         trial%stress(i, 3) = trial%stress(i, 3) - mean
      end do
      do k = 1, size(self%back)
         do c = 1, 6
            trial%back(:, c, k) = column(p, self%back(k) + c - 1)
            trial%back(:n, c, k) = column(p:p + n - 1, self%back(k) + c - 1)
         end do
      end do
      trial%left = 1.0_wp
      trial%grown = 0.0_wp
      call weigh(self, trial)
   end subroutine relative

   !> What the trials are like after flow by d (equivalent plastic strain). For flow in one direction the law
   !> is integrated exactly.
   pure subroutine look(self, d, trial)
      class(kinematic_t), intent(in) :: self
      real(wp), intent(in) :: d(few)
      type(trial_t), intent(inout) :: trial
      integer :: k
      do k = 1, size(self%back)
         call shares(self%recovery(k), d, trial%left(:, k), trial%grown(:, k))
      end do
      call weigh(self, trial)
   end subroutine look

   !> What follows from the shares of the back stresses that are left and grown.
   pure subroutine weigh(self, trial)
      class(kinematic_t), intent(in) :: self
      type(trial_t), intent(inout) :: trial
      real(wp) :: along(few)
      integer :: c, i, k
      trial%drop = 0.0_wp
      trial%slope = 0.0_wp
      do k = 1, size(self%back)
         trial%drop = trial%drop + self%modulus(k)*trial%grown(:, k)
         trial%slope = trial%slope - self%modulus(k)*trial%left(:, k)
      end do
      do c = 1, 6
         trial%x(:, c) = trial%stress(:, c)
         do k = 1, size(self%back)
            trial%x(:, c) = trial%x(:, c) - trial%left(:, k)*trial%back(:, c, k)
         end do
      end do
      associate (x => trial%x, b => trial%back)
         !$omp simd
         do i = 1, few
            trial%size(i) = sqrt(1.5_wp*product_of(x(i, 1), x(i, 2), x(i, 3), x(i, 4), x(i, 5), x(i, 6), &
                                                   x(i, 1), x(i, 2), x(i, 3), x(i, 4), x(i, 5), x(i, 6)))
         end do
         along = 0.0_wp
         do k = 1, size(self%back)
            if (.not. self%recovery(k) > 0.0_wp) cycle
            !$omp simd
            do i = 1, few
               along(i) = along(i) + self%recovery(k)*trial%left(i, k) &
                          *product_of(x(i, 1), x(i, 2), x(i, 3), x(i, 4), x(i, 5), x(i, 6), b(i, 1, k), &
                                      b(i, 2, k), b(i, 3, k), b(i, 4, k), b(i, 5, k), b(i, 6, k))
            end do
         end do
      end associate
      trial%slope = trial%slope + 1.5_wp*along/max(trial%size, tiny(along))
   end subroutine weigh

   !> exp(-gamma d), and (1 - exp(-gamma d))/gamma to all digits: by its series where gamma d is small. Linear
   !> without recovery.
   pure subroutine shares(gamma, d, left, grown)
      real(wp), intent(in) :: gamma, d(few)
      real(wp), intent(out) :: left(few), grown(few)
      real(wp), parameter :: small = 0.05_wp !< the series' next term is below round-off there
      real(wp) :: t, series
      integer :: i
      left = 1.0_wp
      grown = d
      if (.not. gamma > 0.0_wp) return
      !$omp simd private(t, series)
      do i = 1, few
         t = gamma*d(i)
         left(i) = exp(-t)
         series = 1.0_wp - t/2.0_wp*(1.0_wp - t/3.0_wp*(1.0_wp - t/4.0_wp*(1.0_wp - t/5.0_wp*(1.0_wp &
                  - t/6.0_wp*(1.0_wp - t/7.0_wp*(1.0_wp - t/8.0_wp))))))
         grown(i) = merge(d(i)*series, (1.0_wp - left(i))/gamma, t < small)
      end do
   end subroutine shares

   !> a : b of symmetric tensors, xx yy zz yz xz xy. Scalars, so that loops around it become those of vectors.
   pure elemental real(wp) function product_of(a1, a2, a3, a4, a5, a6, b1, b2, b3, b4, b5, b6)
      real(wp), intent(in) :: a1, a2, a3, a4, a5, a6, b1, b2, b3, b4, b5, b6
      product_of = a1*b1 + a2*b2 + a3*b3 + 2.0_wp*(a4*b4 + a5*b5 + a6*b6)
   end function product_of

   !> Back stresses of n particles from p on after flow by d along x, as `look` has left them, and what they
   !> dissipate meanwhile per volume: their work less what they store (J/m3). Those with d = 0 stay.
   pure subroutine advance(self, d, trial, column, p, n, dissipated)
      class(kinematic_t), intent(in) :: self
      real(wp), intent(in) :: d(few)
      type(trial_t), intent(in) :: trial
      real(wp), intent(inout), contiguous :: column(:, :)
      integer, intent(in) :: p, n
      real(wp), intent(out) :: dissipated(few)
      real(wp) :: flow, old, new, twice
      integer :: c, i, k
      dissipated = 0.0_wp
      do k = 1, size(self%back)
         do c = 1, 6
            twice = merge(1.0_wp, 2.0_wp, c <= 3)
            !$omp simd private(flow, old, new)
            do i = 1, n
               flow = 1.5_wp*trial%x(i, c)/max(trial%size(i), tiny(flow))
               old = trial%back(i, c, k)
               new = trial%left(i, k)*old + 2.0_wp/3.0_wp*self%modulus(k)*trial%grown(i, k)*flow
               dissipated(i) = dissipated(i) + twice*(0.5_wp*d(i)*flow*(old + new) &
                               - 0.75_wp/self%modulus(k)*(new - old)*(new + old))
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
