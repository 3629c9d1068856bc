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
   public :: kinematic_t, trial_t

   integer, parameter :: most = 8 !< back stresses

   !> Each grows at 2/3 C times the rate of plastic strain and is recalled at gamma times itself times the rate
   !> of equivalent plastic strain.
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

   !> One particle while its flow is sought: x = s - sum of exp(-gamma d) alpha.
   type :: trial_t
      real(wp) :: stress(6)         !< deviator after the elastic step, Pa
      real(wp) :: back(6, most)     !< alpha at the step's beginning, turned
      real(wp) :: x(6)              !< Pa
      real(wp) :: size              !< von Mises measure of x
      real(wp) :: drop, slope       !< how much of `size` flow takes by the back stresses, Pa, and d (size - drop)/d d
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

   !> The deviator of a particle's stress, its back stresses, and what is between them.
   pure type(trial_t) function relative(self, column, p, s) result(trial)
      class(kinematic_t), intent(in) :: self
      real(wp), intent(in), contiguous :: column(:, :)
      integer, intent(in) :: p, s !< particle, first column of the stress
      integer :: c, k
      do c = 1, 6
         trial%stress(c) = column(p, s + c - 1)
      end do
      trial%stress(1:3) = trial%stress(1:3) - (trial%stress(1) + trial%stress(2) + trial%stress(3))/3.0_wp
      do k = 1, size(self%back)
         do c = 1, 6
            trial%back(c, k) = column(p, self%back(k) + c - 1)
         end do
      end do
      call self%look(0.0_wp, trial)
   end function relative

   !> What the trial is like after flow by d (equivalent plastic strain). For flow in one direction the law is
   !> integrated exactly.
   pure subroutine look(self, d, trial)
      class(kinematic_t), intent(in) :: self
      real(wp), intent(in) :: d
      type(trial_t), intent(inout) :: trial
      real(wp) :: e, rate(6)
      integer :: k
      trial%x = trial%stress
      trial%drop = 0.0_wp
      trial%slope = 0.0_wp
      rate = 0.0_wp
      do k = 1, size(self%back)
         e = exp(-self%recovery(k)*d)
         trial%x = trial%x - e*trial%back(:, k)
         rate = rate + self%recovery(k)*e*trial%back(:, k)
         trial%drop = trial%drop + self%modulus(k)*grown(self%recovery(k), d)
         trial%slope = trial%slope - self%modulus(k)*e
      end do
      trial%size = sqrt(1.5_wp*product_of(trial%x, trial%x))
      trial%slope = trial%slope + 1.5_wp*product_of(trial%x, rate)/max(trial%size, tiny(trial%size))
   end subroutine look

   !> (1 - exp(-gamma d))/gamma, d without recovery; to all digits where gamma d is small.
   pure real(wp) function grown(gamma, d)
      real(wp), intent(in) :: gamma, d
      real(wp) :: t
      grown = d
      if (.not. gamma > 0.0_wp) return
      t = tanh(0.5_wp*gamma*d)
      grown = 2.0_wp*t/(1.0_wp + t)/gamma
   end function grown

   !> a : b of symmetric tensors, xx yy zz yz xz xy.
   pure real(wp) function product_of(a, b)
      real(wp), intent(in) :: a(6), b(6)
      product_of = a(1)*b(1) + a(2)*b(2) + a(3)*b(3) + 2.0_wp*(a(4)*b(4) + a(5)*b(5) + a(6)*b(6))
   end function product_of

   !> Back stresses of a particle after flow by d along x, as `look` has left it, and what they dissipate
   !> meanwhile per volume: their work less what they store (J/m3).
   pure subroutine advance(self, d, trial, column, p, dissipated)
      class(kinematic_t), intent(in) :: self
      real(wp), intent(in) :: d
      type(trial_t), intent(in) :: trial
      real(wp), intent(inout), contiguous :: column(:, :)
      integer, intent(in) :: p
      real(wp), intent(out) :: dissipated
      real(wp) :: flow(6), new(6)
      integer :: c, k
      flow = 1.5_wp*trial%x/trial%size
      dissipated = 0.0_wp
      do k = 1, size(self%back)
         new = exp(-self%recovery(k)*d)*trial%back(:, k) &
               + 2.0_wp/3.0_wp*self%modulus(k)*grown(self%recovery(k), d)*flow
         dissipated = dissipated + 0.5_wp*d*product_of(flow, trial%back(:, k) + new) &
                      - 0.75_wp/self%modulus(k)*product_of(new - trial%back(:, k), new + trial%back(:, k))
         do c = 1, 6
            column(p, self%back(k) + c - 1) = new(c)
         end do
      end do
   end subroutine advance

   !> Energy in the back stresses of a particle, 3/4 alpha : alpha/C each, J/m3.
   pure real(wp) function stored(self, column, p)
      class(kinematic_t), intent(in) :: self
      real(wp), intent(in), contiguous :: column(:, :)
      integer, intent(in) :: p
      real(wp) :: alpha(6)
      integer :: c, k
      stored = 0.0_wp
      do k = 1, size(self%back)
         do c = 1, 6
            alpha(c) = column(p, self%back(k) + c - 1)
         end do
         stored = stored + 0.75_wp/self%modulus(k)*product_of(alpha, alpha)
      end do
   end function stored

end module m_kinematic
