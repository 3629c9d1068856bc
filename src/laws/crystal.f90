!> Crystal plasticity at finite strain: cubic elasticity, rate-dependent slip with self and latent hardening
!> (Peirce, Asaro and Needleman 1982; Kalidindi, Bronkhorst and Anand 1992; theory.md, Crystals).
module m_crystal
   use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan
   use m_kinds, only: wp
   use m_constants, only: pi
   use m_group_reader, only: group_reader_t
   use m_value_range, only: above, at_least
   use m_field_table, only: field_table_t, layout_t
   use m_cubic, only: cubic_t
   use m_crystal_flow, only: slip_t, flow, iteration_limit, max_parts
   use m_lattice, only: gradient_of, tensor_of
   use m_plastic, only: follow_shape
   use m_polar, only: determinant
   use m_rotations, only: angle_between, matrix_of
   use m_slip_rates, only: crystal_constants_t, slip_threshold
   use m_slip_systems, only: make_slip_systems, schmid_columns, slip_words
   use m_text, only: to_text
   implicit none
   private
   public :: crystal_t

   character(len=*), parameter :: hardening_words(2) = [character(len=9) :: 'peirce', 'kalidindi']
   real(wp), parameter :: same_plane = 1.0e-9_wp !< one minus the cosine of planes that are one

   type, extends(cubic_t) :: crystal_t
      integer :: slip_systems = 1                !< of slip_words
      integer :: hardening = 1                   !< of hardening_words
      real(wp) :: reference_rate = 0.0_wp        !< of slip where the stress is the resistance, 1/s
      real(wp) :: rate_sensitivity = 0.0_wp      !< m
      real(wp) :: tau0 = 0.0_wp                  !< slip resistance at the start, Pa
      real(wp) :: tau_s = 0.0_wp                 !< where hardening saturates, Pa
      real(wp) :: h0 = 0.0_wp                    !< hardening modulus at the start, Pa
      real(wp) :: q = 0.0_wp                     !< latent over self hardening
      real(wp) :: hardening_exponent = 0.0_wp    !< a
      type(crystal_constants_t) :: constants
      integer :: first_orientation = 0, rotation = 0, resistance = 0, slip = 0, strain = 0, work = 0, &
                 shape = 0                       !< first columns of the law's own fields
   contains
      procedure :: variables
      procedure :: declare
      procedure :: initial
      procedure :: update
      procedure :: plastic_energy
      procedure :: equivalent_plastic_strain
      procedure :: may_flow
      procedure :: stretch
      procedure :: default_effect
      procedure :: fault_text
      procedure, private :: prepare
      procedure, private :: modulus
   end type crystal_t

contains

   subroutine variables(self, group)
      class(crystal_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      logical :: saturates
      call self%cubic_variables(group)
      call group%get_choice('slip_systems', self%slip_systems, slip_words)
      call group%get_choice('hardening', self%hardening, hardening_words)
      saturates = self%hardening == 2
      call group%get('reference_rate', self%reference_rate, above(0.0_wp, '1/s'), required=.true.)
      call group%get('rate_sensitivity', self%rate_sensitivity, above(0.0_wp, '', at_most=1.0_wp), &
                     required=.true.)
      call group%get('tau0', self%tau0, above(0.0_wp, 'Pa'), required=.true.)
      call group%get('tau_s', self%tau_s, above(0.0_wp, 'Pa'), required=.true.)
      call group%get('h0', self%h0, at_least(0.0_wp, 'Pa'), required=.true.)
      call group%get('q', self%q, at_least(0.0_wp, ''), required=.true.)
      call group%get('hardening_exponent', self%hardening_exponent, above(0.0_wp, ''), required=saturates, &
                     used=saturates)
      if (self%tau_s < self%tau0) call group%refuse('tau_s', 'must be at least tau0')
      if (self%h0 > 0.0_wp .and. .not. self%tau_s > self%tau0) &
         call group%refuse('tau_s', 'must be above tau0, or h0 must be 0')
      call self%prepare()
   end subroutine variables

   !> The constants of the flow.
   subroutine prepare(self)
      class(crystal_t), intent(inout) :: self
      real(wp), allocatable :: normals(:, :), directions(:, :), schmid(:, :), latent(:, :)
      integer :: a, b, n
      call make_slip_systems(max(self%slip_systems, 1), normals, directions)
      n = size(normals, 2)
      associate (c => self%constants)
         c%c11 = self%c11
         c%c12 = self%c12
         c%c44 = self%c44
         c%reference_rate = self%reference_rate
         c%sensitivity = self%rate_sensitivity
         c%power = 0
         if (c%sensitivity > 0.0_wp) then
            if (abs(1.0_wp/c%sensitivity - anint(1.0_wp/c%sensitivity)) < 1.0e-9_wp/c%sensitivity) &
               c%power = nint(1.0_wp/c%sensitivity)
         end if
         c%compliance(:2) = 1.0_wp/max(self%c11 - self%c12, tiny(1.0_wp))
         c%compliance(3:) = 0.5_wp/max(self%c44, tiny(1.0_wp))
         allocate (schmid(n, 8), latent(n, n))
         do a = 1, n
            schmid(a, :) = schmid_columns(spread(directions(:, a), 2, 3)*spread(normals(:, a), 1, 3))
            do b = 1, n
               latent(a, b) = self%q
               if (a == b .or. (self%hardening == 2 .and. abs(dot_product(normals(:, a), normals(:, b))) &
                                > 1.0_wp - same_plane)) latent(a, b) = 1.0_wp
            end do
         end do
         call c%set_systems(schmid, latent)
      end associate
   end subroutine prepare

   !> As the laws of plastic flow, and what belongs to a lattice.
   pure subroutine declare(self, table, has_tools)
      class(crystal_t), intent(inout) :: self
      type(field_table_t), intent(inout) :: table
      logical, intent(in) :: has_tools
      character(len=:), allocatable :: name
      call self%cubic_t%declare(table, has_tools)
      name = 'slip_resistance'
      if (self%constants%systems /= 12) name = name//'_'//to_text(self%constants%systems)
      call table%declare('first_orientation', 4, '1', written=.false.)
      call table%declare('lattice_rotation', 1, 'degrees', written=.true.)
      call table%declare('slip', 1, '1', written=.true.)
      call table%declare(name, self%constants%systems, 'Pa', written=.true.)
      call table%declare('plastic_strain', 1, '1', written=.true.)
      call table%declare('plastic_work', 1, 'J', written=.false., extensive=.true.)
      if (has_tools) call table%declare('left_cauchy_green', 6, '1', written=.false.)
      self%first_orientation = table%column('first_orientation')
      self%rotation = table%column('lattice_rotation')
      self%slip = table%column('slip')
      self%resistance = table%column(name)
      self%strain = table%column('plastic_strain')
      self%work = table%column('plastic_work')
      self%shape = 0
      if (has_tools) self%shape = table%column('left_cauchy_green')
   end subroutine declare

   pure subroutine initial(self, column, layout, first, last)
      class(crystal_t), intent(in) :: self
      real(wp), intent(inout), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: first, last
      call self%cubic_t%initial(column, layout, first, last)
      column(first:last, self%first_orientation:self%first_orientation + 3) &
         = column(first:last, self%orientation:self%orientation + 3)
      column(first:last, self%resistance:self%resistance + self%constants%systems - 1) = self%tau0
      if (self%shape > 0) column(first:last, self%shape:self%shape + 2) = 1.0_wp
   end subroutine initial

   pure subroutine update(self, column, layout, gradient, time_step, first, last)
      class(crystal_t), intent(in) :: self
      real(wp), intent(inout), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      real(wp), intent(in), contiguous :: gradient(:, :)
      real(wp), intent(in) :: time_step
      integer, intent(in) :: first, last
      type(slip_t) :: one
      real(wp) :: q(4), r(3, 3), threshold
      integer :: n, p
      n = self%constants%systems
      allocate (one%resistance(self%constants%width), source=self%tau0)
      allocate (one%modulus(self%constants%width), source=0.0_wp)
      threshold = slip_threshold(self%constants, time_step)
      if (self%shape > 0) call follow_shape(self%shape, column, gradient, time_step, first, last)
      do p = first, last
         q = column(p, self%orientation:self%orientation + 3)
         q = q/norm2(q) ! of merged particles it is a mean
         r = matrix_of(q)
         one%increment = time_step*matmul(transpose(r), matmul(gradient_of(gradient, p), r))
         one%stretch = tensor_of(column(p, self%elastic:self%elastic + 5))
         one%resistance(:n) = column(p, self%resistance:self%resistance + n - 1)
         call self%modulus(column(p, self%slip), one%resistance(:n), one%modulus(:n))
         call flow(self%constants, time_step, threshold, one)
         if (.not. one%found) then ! the step reports what is not a number (fault_text)
            column(p, layout%stress:layout%stress + 5) = ieee_value(1.0_wp, ieee_quiet_nan)
            cycle
         end if
         column(p, self%work) = column(p, self%work) + column(p, layout%volume)/determinant(one%stretch) &
                                *one%work
         column(p, self%strain) = column(p, self%strain) + one%strain
         column(p, self%slip) = column(p, self%slip) + one%slip
         column(p, self%resistance:self%resistance + n - 1) = one%resistance(:n)
         call self%settle(column, layout, p, q, one%elastic)
         column(p, self%rotation) = 180.0_wp/pi*angle_between( &
                                    column(p, self%orientation:self%orientation + 3), &
                                    column(p, self%first_orientation:self%first_orientation + 3))
      end do
   end subroutine update

   !> Hardening moduli of the systems, Pa: h0 sech^2(h0 gamma/(tau_s - tau0)) by the total slip, the same for
   !> all; or h0 |1 - g/tau_s|^a by the resistance g of each.
   pure subroutine modulus(self, slip, resistance, moduli)
      class(crystal_t), intent(in) :: self
      real(wp), intent(in) :: slip
      real(wp), intent(in) :: resistance(:) !< Pa
      real(wp), intent(out) :: moduli(:)
      real(wp) :: left
      integer :: a
      if (.not. self%h0 > 0.0_wp) then
         moduli = 0.0_wp
      else if (self%hardening == 1) then
         moduli = self%h0/cosh(min(300.0_wp, self%h0*slip/(self%tau_s - self%tau0)))**2
      else
         do a = 1, size(moduli)
            left = 1.0_wp - resistance(a)/self%tau_s
            moduli(a) = 0.0_wp
            if (abs(left) > 0.0_wp) moduli(a) = sign(self%h0*abs(left)**self%hardening_exponent, left)
         end do
      end if
   end subroutine modulus

   pure real(wp) function plastic_energy(self, column, first, last)
      class(crystal_t), intent(in) :: self
      real(wp), intent(in), contiguous :: column(:, :)
      integer, intent(in) :: first, last
      plastic_energy = sum(column(first:last, self%work))
   end function plastic_energy

   pure real(wp) function equivalent_plastic_strain(self, values) result(strain)
      class(crystal_t), intent(in) :: self
      real(wp), intent(in) :: values(:)
      strain = values(self%strain)
   end function equivalent_plastic_strain

   !> sqrt(n . b . n), as of other laws of plastic flow; without end where the scene has no tools.
   pure real(wp) function stretch(self, values, layout, direction)
      class(crystal_t), intent(in) :: self
      real(wp), intent(in) :: values(:)
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: direction(3)
      stretch = huge(1.0_wp)
      if (self%shape > 0) stretch = sqrt(dot_product(direction, matmul( &
                                    tensor_of(values(self%shape:self%shape + 5)), direction)))
   end function stretch

   !> Slip keeps the volume.
   pure function default_effect(self) result(name)
      class(crystal_t), intent(in) :: self
      character(len=:), allocatable :: name
      name = 'anti_locking'
   end function default_effect

   pure function fault_text(self) result(text)
      class(crystal_t), intent(in) :: self
      character(len=:), allocatable :: text
      text = ': the local solve for the slip rates did not converge within '//to_text(iteration_limit)// &
             ' iterations and in '//to_text(max_parts)//' parts of the step; try a smaller safety'
   end function fault_text

   pure logical function may_flow(self)
      class(crystal_t), intent(in) :: self
      may_flow = .true.
   end function may_flow

end module m_crystal
