!> Viscoelasticity as a Prony series: an elastic spring in parallel with branches of a spring and a dashpot,
!> in shear and in bulk (generalised Maxwell model; theory.md, eq. maxwell).
module m_maxwell
   use m_kinds, only: wp
   use m_text, only: to_text
   use m_group_reader, only: group_reader_t
   use m_value_range, only: above, at_least
   use m_field_table, only: field_table_t, layout_t
   use m_isotropic, only: isotropic_t
   use m_corotation, only: strain_and_spin, turn_by
   use m_plastic, only: follow_shape, shape_stretch
   implicit none
   private
   public :: maxwell_t

   integer, parameter :: lanes = 128, max_branches = 16
   real(wp), parameter :: short = 0.1_wp !< of a relaxation time: the work of shorter steps is computed by
                                         !< Simpson's rule
   real(wp), parameter :: least_spring = 1.0e-3_wp !< least share whose stress tells the strain

   !> `young` and `poisson` are the instantaneous moduli. A branch has the share shear_ratios of the shear
   !> modulus and bulk_ratios of the bulk modulus; the remainder is the long-term modulus.
   type, extends(isotropic_t) :: maxwell_t
      real(wp), allocatable :: relaxation_times(:) !< s
      real(wp), allocatable :: shear_ratios(:), bulk_ratios(:)
      integer :: spring = 0              !< first column of the stress of the single spring
      integer, allocatable :: branch(:)  !< first column of each branch's stress
      integer :: work = 0                !< column of the energy dissipated by the dashpots, J
      integer :: shape = 0               !< first column of the left Cauchy-Green tensor; 0 without tools
   contains
      procedure :: variables
      procedure :: declare
      procedure :: initial
      procedure :: begin_stressed
      procedure :: is_at_rest
      procedure :: update
      procedure :: strain_energy
      procedure :: plastic_energy
      procedure :: stretch
      procedure :: is_time_dependent
      procedure :: unrelaxed_parts
      procedure :: long_term_share
      procedure, private :: moduli
      procedure, private :: advance
   end type maxwell_t

contains

   subroutine variables(self, group)
      class(maxwell_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      call self%elastic_variables(group)
      call group%get_list('relaxation_times', self%relaxation_times, above(0.0_wp, 's'), required=.true.)
      call group%get_list('shear_ratios', self%shear_ratios, at_least(0.0_wp, '', at_most=1.0_wp))
      call group%get_list('bulk_ratios', self%bulk_ratios, at_least(0.0_wp, '', at_most=1.0_wp))
      if (.not. allocated(self%relaxation_times)) return
      if (.not. (allocated(self%shear_ratios) .or. allocated(self%bulk_ratios))) &
         call group%refuse('shear_ratios', 'missing; one of shear_ratios and bulk_ratios must be there')
      if (.not. allocated(self%shear_ratios)) self%shear_ratios = 0.0_wp*self%relaxation_times
      if (.not. allocated(self%bulk_ratios)) self%bulk_ratios = 0.0_wp*self%relaxation_times
      if (size(self%relaxation_times) > max_branches) &
         call group%refuse('relaxation_times', 'must be at most '//to_text(max_branches)//' numbers')
      call check('shear_ratios', self%shear_ratios)
      call check('bulk_ratios', self%bulk_ratios)
   contains
      subroutine check(name, ratios)
         character(len=*), intent(in) :: name
         real(wp), intent(in) :: ratios(:)
         if (size(ratios) /= size(self%relaxation_times)) &
            call group%refuse(name, 'must have as many numbers as relaxation_times')
         if (sum(ratios) > 1.0_wp + 1.0e-12_wp) call group%refuse(name, 'must be at most 1 together')
      end subroutine check
   end subroutine variables

   !> A stress for the single spring and one for each branch.
   pure subroutine declare(self, table, has_tools)
      class(maxwell_t), intent(inout) :: self
      type(field_table_t), intent(inout) :: table
      logical, intent(in) :: has_tools
      integer :: k
      call table%declare('spring_stress', 6, 'Pa', written=.false.)
      self%spring = table%column('spring_stress')
      if (allocated(self%branch)) deallocate (self%branch)
      allocate (self%branch(size(self%relaxation_times)))
      do k = 1, size(self%branch)
         call table%declare('branch_stress_'//to_text(k), 6, 'Pa', written=.false.)
         self%branch(k) = table%column('branch_stress_'//to_text(k))
      end do
      call table%declare('viscous_work', 1, 'J', written=.false., extensive=.true.)
      self%work = table%column('viscous_work')
      if (.not. has_tools) return
      call table%declare('left_cauchy_green', 6, '1', written=.false.)
      self%shape = table%column('left_cauchy_green')
   end subroutine declare

   pure subroutine initial(self, column, layout, first, last)
      class(maxwell_t), intent(in) :: self
      real(wp), intent(inout), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: first, last
      if (self%shape > 0) column(first:last, self%shape:self%shape + 2) = 1.0_wp
   end subroutine initial

   pure logical function is_time_dependent(self)
      class(maxwell_t), intent(in) :: self
      is_time_dependent = .true.
   end function is_time_dependent

   !> The stress at once follows from that of the single spring, whose strains are all elastic.
   pure function unrelaxed_parts(self, column, layout, p) result(parts)
      class(maxwell_t), intent(in) :: self
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: p
      real(wp) :: parts(2), mean, at_once(6)
      at_once = column(p, self%spring:self%spring + 5)
      mean = sum(at_once(:3))/3.0_wp
      at_once(:3) = (at_once(:3) - mean)/(1.0_wp - sum(self%shear_ratios)) &
                    + mean/(1.0_wp - sum(self%bulk_ratios))
      at_once(4:) = at_once(4:)/(1.0_wp - sum(self%shear_ratios))
      associate (stress => column(p, layout%stress:layout%stress + 5))
         parts = [dot_product(stress(:3), at_once(:3)) + 2.0_wp*dot_product(stress(4:), at_once(4:)), &
                  sum(at_once(:3)**2) + 2.0_wp*sum(at_once(4:)**2)]*column(p, layout%volume)
      end associate
   end function unrelaxed_parts

   !> That of the single spring, where it has one in shear and in bulk; else what is relaxed is not known: 1.
   pure real(wp) function long_term_share(self) result(share)
      class(maxwell_t), intent(in) :: self
      share = 1.0_wp - max(sum(self%shear_ratios), sum(self%bulk_ratios))
      if (share < least_spring) share = 1.0_wp
   end function long_term_share

   !> All branches have relaxed: the single spring bears the stress.
   pure subroutine begin_stressed(self, stress, column, layout, first, last)
      class(maxwell_t), intent(in) :: self
      real(wp), intent(in) :: stress(6)
      real(wp), intent(inout), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: first, last
      column(first:last, self%spring:self%spring + 5) = spread(stress, 1, last - first + 1)
   end subroutine begin_stressed

   !> False as long as a branch bears stress: it relaxes, even where the total stress is zero.
   pure logical function is_at_rest(self, column, layout, first, last)
      class(maxwell_t), intent(in) :: self
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: first, last
      integer :: c, k
      is_at_rest = .true.
      do k = 1, size(self%branch)
         do c = self%branch(k), self%branch(k) + 5
            is_at_rest = is_at_rest .and. all(abs(column(first:last, c)) <= 0.0_wp)
         end do
      end do
   end function is_at_rest

   !> Shear and bulk modulus (Pa) of a branch, of the single spring for 0.
   pure subroutine moduli(self, k, shear, bulk)
      class(maxwell_t), intent(in) :: self
      integer, intent(in) :: k
      real(wp), intent(out) :: shear, bulk
      real(wp) :: shares(2)
      shares = max(0.0_wp, 1.0_wp - [sum(self%shear_ratios), sum(self%bulk_ratios)])
      if (k > 0) shares = [self%shear_ratios(k), self%bulk_ratios(k)]
      shear = shares(1)*self%shear
      bulk = shares(2)*(self%lame + 2.0_wp*self%shear/3.0_wp)
   end subroutine moduli

   pure subroutine update(self, column, layout, gradient, time_step, first, last)
      class(maxwell_t), intent(in) :: self
      real(wp), intent(inout), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      real(wp), intent(in), contiguous :: gradient(:, :)
      real(wp), intent(in) :: time_step
      integer, intent(in) :: first, last
      integer :: from
      if (self%shape > 0) call follow_shape(self%shape, column, gradient, time_step, first, last)
      do from = first, last, lanes
         call self%advance(column, layout, gradient, time_step, from, min(from + lanes - 1, last))
      end do
   end subroutine update

   !> The stress of each branch is rotated as that of eq. elastic, and integrated exactly for a constant
   !> strain rate over the step.
   pure subroutine advance(self, column, layout, gradient, time_step, first, last)
      class(maxwell_t), intent(in) :: self
      real(wp), intent(inout), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      real(wp), intent(in), contiguous :: gradient(:, :)
      real(wp), intent(in) :: time_step
      integer, intent(in) :: first, last
      real(wp), dimension(last - first + 1, 6) :: strain, force, total, stress
      real(wp) :: spin(last - first + 1, 3), work(last - first + 1), shear, bulk, x
      integer :: k, n
      n = last - first + 1
      call strain_and_spin(n, time_step, gradient(first:last, :), strain, spin)
      call self%moduli(0, shear, bulk)
      total = column(first:last, self%spring:self%spring + 5)
      call turn_by(n, spin, total)
      call elastic_stress(n, shear, bulk, strain, force)
      total = total + force
      column(first:last, self%spring:self%spring + 5) = total
      work = 0.0_wp
      do k = 1, size(self%branch)
         x = time_step/self%relaxation_times(k)
         call self%moduli(k, shear, bulk)
         stress = column(first:last, self%branch(k):self%branch(k) + 5)
         call turn_by(n, spin, stress)
         call elastic_stress(n, shear, bulk, strain, force)
         call relax(n, x, shear, bulk, force, stress, work)
         column(first:last, self%branch(k):self%branch(k) + 5) = stress
         total = total + stress
      end do
      column(first:last, layout%stress:layout%stress + 5) = total
      column(first:last, self%work) = column(first:last, self%work) + column(first:last, layout%volume)*work
   end subroutine advance

   !> K tr(e) I + 2 mu dev(e).
   pure subroutine elastic_stress(n, shear, bulk, strain, stress)
      integer, intent(in) :: n
      real(wp), intent(in) :: shear, bulk, strain(n, 6)
      real(wp), intent(out) :: stress(n, 6)
      integer :: c
      do c = 1, 3
         stress(:, c) = (bulk - 2.0_wp*shear/3.0_wp)*(strain(:, 1) + strain(:, 2) + strain(:, 3)) &
                        + 2.0_wp*shear*strain(:, c)
         stress(:, 3 + c) = 2.0_wp*shear*strain(:, 3 + c)
      end do
   end subroutine elastic_stress

   !> A branch over x relaxation times: h <- exp(-x) h + (1 - exp(-x))/x C : de, and the work of its dashpots,
   !> the integral of h : C^-1 : h dt/tau.
   pure subroutine relax(n, x, shear, bulk, force, stress, work)
      integer, intent(in) :: n
      real(wp), intent(in) :: x, shear, bulk
      real(wp), intent(in) :: force(n, 6)     !< C : de, Pa
      real(wp), intent(inout) :: stress(n, 6) !< Pa
      real(wp), intent(inout) :: work(n)      !< per volume, J/m3
      real(wp) :: half(n, 6), after(n, 6), fall, fall_half, e, e_half
      integer :: p
      e = exp(-x)
      e_half = exp(-0.5_wp*x)
      fall = decayed(x)
      fall_half = 0.5_wp*decayed(0.5_wp*x)
      after = e*stress + fall*force
      if (x < short) then
         half = e_half*stress + fall_half*force
         call add_stored(n, shear, bulk, stress, x/3.0_wp, work)
         call add_stored(n, shear, bulk, half, 4.0_wp*x/3.0_wp, work)
         call add_stored(n, shear, bulk, after, x/3.0_wp, work)
      else ! h = steady + (before - steady) exp(-t/tau), steady = force/x
         call add_stored(n, shear, bulk, force, &
                         2.0_wp*(x - 2.0_wp*(1.0_wp - e) + 0.5_wp*(1.0_wp - e**2))/x**2, work)
         call add_stored(n, shear, bulk, stress, 1.0_wp - e**2, work)
         do p = 1, n
            work(p) = work(p) + (1.0_wp - e - 0.5_wp*(1.0_wp - e**2))/x*mixed(shear, bulk, force(p, :), &
                      stress(p, :))
         end do
      end if
      stress = after
   end subroutine relax

   !> Add a multiple of h : C^-1 : h/2, J/m3; a modulus of 0 stores nothing.
   pure subroutine add_stored(n, shear, bulk, h, factor, energy)
      integer, intent(in) :: n
      real(wp), intent(in) :: shear, bulk, h(n, 6), factor
      real(wp), intent(inout) :: energy(n)
      real(wp) :: mean, squares, by_shear, by_bulk
      integer :: p
      by_shear = 0.0_wp
      by_bulk = 0.0_wp
      if (shear > 0.0_wp) by_shear = 0.25_wp*factor/shear
      if (bulk > 0.0_wp) by_bulk = 0.5_wp*factor/bulk
      !$omp simd private(mean, squares)
      do p = 1, n
         mean = (h(p, 1) + h(p, 2) + h(p, 3))/3.0_wp
         squares = (h(p, 1) - mean)**2 + (h(p, 2) - mean)**2 + (h(p, 3) - mean)**2 &
                   + 2.0_wp*(h(p, 4)**2 + h(p, 5)**2 + h(p, 6)**2)
         energy(p) = energy(p) + by_shear*squares + by_bulk*mean**2
      end do
   end subroutine add_stored

   !> (1 - exp(-x))/x, to full precision where x is small.
   pure real(wp) function decayed(x)
      real(wp), intent(in) :: x
      real(wp) :: t
      decayed = 1.0_wp - 0.5_wp*x
      if (x < 1.0e-8_wp) return
      t = tanh(0.5_wp*x)
      decayed = 2.0_wp*t/(1.0_wp + t)/x
   end function decayed

   !> 2 a : C^-1 : b.
   pure real(wp) function mixed(shear, bulk, a, b)
      real(wp), intent(in) :: shear, bulk, a(6), b(6)
      real(wp) :: p, q
      p = (a(1) + a(2) + a(3))/3.0_wp
      q = (b(1) + b(2) + b(3))/3.0_wp
      mixed = 0.0_wp
      if (shear > 0.0_wp) mixed = (sum((a(1:3) - p)*(b(1:3) - q)) + 2.0_wp*sum(a(4:6)*b(4:6)))/shear
      if (bulk > 0.0_wp) mixed = mixed + 2.0_wp*p*q/bulk
   end function mixed

   !> Energy stored in the springs, J.
   pure real(wp) function strain_energy(self, column, layout, first, last) result(energy)
      class(maxwell_t), intent(in) :: self
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: first, last
      real(wp) :: shear, bulk, by_shear, by_bulk, mean, squares
      integer :: f, k, p
      energy = 0.0_wp
      do k = 0, size(self%branch)
         call self%moduli(k, shear, bulk)
         by_shear = 0.0_wp
         by_bulk = 0.0_wp
         if (shear > 0.0_wp) by_shear = 0.25_wp/shear
         if (bulk > 0.0_wp) by_bulk = 0.5_wp/bulk
         f = self%spring
         if (k > 0) f = self%branch(k)
         !$omp simd private(mean, squares) reduction(+: energy)
         do p = first, last
            mean = (column(p, f) + column(p, f + 1) + column(p, f + 2))/3.0_wp
            squares = (column(p, f) - mean)**2 + (column(p, f + 1) - mean)**2 + (column(p, f + 2) - mean)**2 &
                      + 2.0_wp*(column(p, f + 3)**2 + column(p, f + 4)**2 + column(p, f + 5)**2)
            energy = energy + column(p, layout%volume)*(by_shear*squares + by_bulk*mean**2)
         end do
      end do
   end function strain_energy

   !> Energy dissipated by the dashpots, J.
   pure real(wp) function plastic_energy(self, column, first, last)
      class(maxwell_t), intent(in) :: self
      real(wp), intent(in), contiguous :: column(:, :)
      integer, intent(in) :: first, last
      plastic_energy = sum(column(first:last, self%work))
   end function plastic_energy

   !> sqrt(n . b . n); huge without tools.
   pure real(wp) function stretch(self, values, layout, direction)
      class(maxwell_t), intent(in) :: self
      real(wp), intent(in) :: values(:)
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: direction(3)
      stretch = huge(1.0_wp)
      if (self%shape > 0) stretch = shape_stretch(values(self%shape:self%shape + 5), direction)
   end function stretch

end module m_maxwell
