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
   use m_crystal_lanes, only: crystals_t, deform_elastically, let_slip
   use m_lane_tensors, only: lanes, decompose, find_cofactors, find_determinant, follow, invert, load, &
                             multiply, multiply_transposed, normalise, rotate, set_matrices, &
                             set_quaternions, set_symmetric, take_columns
   use m_lattice, only: tensor_of
   use m_plastic, only: follow_shape
   use m_slip_rates, only: crystal_constants_t, slip_threshold
   use m_slip_systems, only: make_slip_systems, schmid_columns, slip_words
   use m_text, only: to_text
   implicit none
   private
   public :: crystal_t

   character(len=*), parameter :: hardening_words(2) = [character(len=9) :: 'peirce', 'kalidindi']
   real(wp), parameter :: no_more = 1.0e-30_wp !< of the remaining hardening: vectorised powers branch at 0
   real(wp), parameter :: same_plane = 1.0e-9_wp !< one minus the cosine of normals that count as parallel

   type, extends(cubic_t) :: crystal_t
      integer :: slip_systems = 1                !< index in slip_words
      integer :: hardening = 1                   !< index in hardening_words
      real(wp) :: reference_rate = 0.0_wp        !< slip rate where the stress equals the resistance, 1/s
      real(wp) :: rate_sensitivity = 0.0_wp      !< m
      real(wp) :: tau0 = 0.0_wp                  !< initial slip resistance, Pa
      real(wp) :: tau_s = 0.0_wp                 !< resistance at which hardening saturates, Pa
      real(wp) :: h0 = 0.0_wp                    !< initial hardening modulus, Pa
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

   !> As for laws of plastic flow, and the fields of a lattice.
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

   !> Update particles in vectors; those for which Newton's method in lanes fails, one by one.
   pure subroutine update(self, column, layout, gradient, time_step, first, last)
      class(crystal_t), intent(in) :: self
      real(wp), intent(inout), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      real(wp), intent(in), contiguous :: gradient(:, :)
      real(wp), intent(in) :: time_step
      integer, intent(in) :: first, last
      type(crystals_t) :: some
      real(wp) :: q(lanes, 4), threshold
      integer :: count, p, from
      threshold = slip_threshold(self%constants, time_step)
      if (self%shape > 0) call follow_shape(self%shape, column, gradient, time_step, first, last)
      do from = first, last, lanes
         count = min(lanes, last - from + 1)
         call begin_lanes(self, column, gradient, time_step, from, count, q, some)
         call deform_elastically(self%constants, threshold, some)
         if (.not. all(some%found)) then
            call set_moduli(self, column, from, count, some)
            call let_slip(self%constants, time_step, threshold, some)
            do p = 1, count
               if (.not. some%found(p)) call slip_alone(self, time_step, threshold, p, some)
            end do
         end if
         call end_lanes(self, column, layout, from, count, q, some)
      end do
   end subroutine update

   !> Orientations, stretches, resistances, and the increments of the deformation along the lattices' axes.
   pure subroutine begin_lanes(self, column, gradient, time_step, from, count, q, some)
      type(crystal_t), intent(in) :: self
      real(wp), intent(in), contiguous :: column(:, :), gradient(:, :)
      real(wp), intent(in) :: time_step
      integer, intent(in) :: from, count !< first particle, and number of particles
      real(wp), intent(out) :: q(lanes, 4)
      type(crystals_t), intent(inout) :: some
      real(wp), dimension(lanes, 3, 3) :: r, rate, turned
      real(wp) :: values(lanes, 6)
      integer :: i, j
      do i = 1, 4
         call load(column(:, self%orientation + i - 1), from, count, q(:, i))
      end do
      call normalise(q) ! in merged particles it is a mean
      do i = 1, 6
         call load(column(:, self%elastic + i - 1), from, count, values(:, i))
      end do
      do j = 1, 3
         do i = 1, 3
            call load(gradient(:, 3*(j - 1) + i), from, count, rate(:, i, j))
         end do
      end do
      do i = 1, self%constants%systems
         call load(column(:, self%resistance + i - 1), from, count, some%resistance(:, i))
      end do
      call set_symmetric(values, some%stretch)
      call set_matrices(q, r)
      call multiply(rate, r, turned)
      call multiply_transposed(r, turned, rate)
      some%increment = time_step*rate
   end subroutine begin_lanes

   !> Hardening moduli of the systems, Pa: h0 sech^2(h0 gamma/(tau_s - tau0)) by the total slip, the same for
   !> all; or h0 |1 - g/tau_s|^a by the resistance g of each.
   pure subroutine set_moduli(self, column, from, count, some)
      type(crystal_t), intent(in) :: self
      real(wp), intent(in), contiguous :: column(:, :)
      integer, intent(in) :: from, count
      type(crystals_t), intent(inout) :: some
      real(wp) :: slip(lanes), left(lanes)
      integer :: a
      if (.not. self%h0 > 0.0_wp) then
         some%modulus(:, :self%constants%systems) = 0.0_wp
      else if (self%hardening == 1) then
         call load(column(:, self%slip), from, count, slip)
         slip = self%h0/cosh(min(300.0_wp, self%h0*slip/(self%tau_s - self%tau0)))**2
         do a = 1, self%constants%systems
            some%modulus(:, a) = slip
         end do
      else
         do a = 1, self%constants%systems
            left = 1.0_wp - some%resistance(:, a)/self%tau_s
            some%modulus(:, a) = sign(self%h0*max(abs(left), no_more)**self%hardening_exponent, left)
         end do
      end if
   end subroutine set_moduli

   !> One lane by the safeguarded solve; if that fails too the stress is NaN, which the step reports
   !> (fault_text).
   pure subroutine slip_alone(self, time_step, threshold, p, some)
      type(crystal_t), intent(in) :: self
      real(wp), intent(in) :: time_step, threshold
      integer, intent(in) :: p
      type(crystals_t), intent(inout) :: some
      type(slip_t) :: one
      associate (n => self%constants%systems)
         allocate (one%resistance(self%constants%width), source=self%tau0)
         allocate (one%modulus(self%constants%width), source=0.0_wp)
         one%increment = some%increment(p, :, :)
         one%stretch = some%stretch(p, :, :)
         one%resistance(:n) = some%resistance(p, :n)
         one%modulus(:n) = some%modulus(p, :n)
         call flow(self%constants, time_step, threshold, one)
         if (.not. one%found) return
         some%found(p) = .true.
         some%elastic(p, :, :) = one%elastic
         some%resistance(p, :n) = one%resistance(:n)
         some%slip(p) = one%slip
         some%work(p) = one%work
         some%strain(p) = one%strain
      end associate
   end subroutine slip_alone

   !> Store orientation, stretch, stress, and the results of slip.
   pure subroutine end_lanes(self, column, layout, from, count, q, some)
      type(crystal_t), intent(in) :: self
      real(wp), intent(inout), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: from, count
      real(wp), intent(in) :: q(lanes, 4) !< at the step's beginning
      type(crystals_t), intent(in) :: some
      real(wp) :: stress(lanes, 6), stretch(lanes, 6), turned(lanes, 4), angle(lanes), volume(lanes), &
                  cofactors(lanes, 3, 3)
      integer :: i, to
      to = from + count - 1
      call find_stress(self, some%elastic, q, turned, stretch, stress)
      call find_angles(self, column, from, count, turned, angle)
      if (.not. all(some%found)) then
         do i = 1, 6
            where (.not. some%found) stress(:, i) = ieee_value(1.0_wp, ieee_quiet_nan)
         end do
      end if
      do i = 1, 6
         column(from:to, layout%stress + i - 1) = stress(:count, i)
         column(from:to, self%elastic + i - 1) = stretch(:count, i)
      end do
      do i = 1, 4
         column(from:to, self%orientation + i - 1) = turned(:count, i)
      end do
      column(from:to, self%rotation) = angle(:count)
      if (.not. any(some%slip > 0.0_wp)) return
      call find_cofactors(some%stretch, cofactors)
      call find_determinant(some%stretch, cofactors, volume)
      volume(:count) = column(from:to, layout%volume)/volume(:count) ! before elastic deformation
      column(from:to, self%work) = column(from:to, self%work) + volume(:count)*some%work(:count)
      column(from:to, self%strain) = column(from:to, self%strain) + some%strain(:count)
      column(from:to, self%slip) = column(from:to, self%slip) + some%slip(:count)
      do i = 1, self%constants%systems
         column(from:to, self%resistance + i - 1) = some%resistance(:count, i)
      end do
   end subroutine end_lanes

   !> As `settle` of m_lattice, with the cubic moduli.
   pure subroutine find_stress(self, f, q, turned, stretch, stress)
      type(crystal_t), intent(in) :: self
      real(wp), intent(in) :: f(lanes, 3, 3) !< elastic deformation gradients
      real(wp), intent(in) :: q(lanes, 4)
      real(wp), intent(out) :: turned(lanes, 4), stretch(lanes, 6), stress(lanes, 6)
      real(wp), dimension(lanes, 3, 3) :: r, u, inverse, t, a, b
      real(wp) :: turn(lanes, 4), jacobian(lanes)
      integer :: i
      call decompose(f, r, u)
      call set_quaternions(r, turn)
      call follow(turn, q, turned)
      call set_matrices(turned, r)
      call invert(u, inverse, jacobian)
      call multiply(u, u, a)
      call multiply(inverse, inverse, b)
      a = 0.25_wp*(a - b) ! the strain
      t = 2.0_wp*self%c44*a
      do i = 1, 3
         t(:, i, i) = self%c12*(a(:, 1, 1) + a(:, 2, 2) + a(:, 3, 3)) + (self%c11 - self%c12)*a(:, i, i)
      end do
      call multiply(t, u, b)
      call multiply(u, b, a)
      call multiply(t, inverse, b)
      call multiply(inverse, b, t)
      t = 0.5_wp*(a + t)
      call rotate(r, t)
      call take_columns(t, stress)
      do i = 1, 6
         stress(:, i) = stress(:, i)/jacobian
      end do
      call take_columns(u, stretch)
   end subroutine find_stress

   !> Rotation angles of the lattices since the start, degrees.
   pure subroutine find_angles(self, column, from, count, turned, angle)
      type(crystal_t), intent(in) :: self
      real(wp), intent(in), contiguous :: column(:, :)
      integer, intent(in) :: from, count
      real(wp), intent(in) :: turned(lanes, 4)
      real(wp), intent(out) :: angle(lanes)
      real(wp) :: back(lanes, 4), q(lanes, 4)
      integer :: i
      do i = 1, 4
         call load(column(:, self%first_orientation + i - 1), from, count, back(:, i))
      end do
      back(:, 2:) = -back(:, 2:)
      call follow(back, turned, q)
      angle = 360.0_wp/pi*atan2(sqrt(q(:, 2)**2 + q(:, 3)**2 + q(:, 4)**2), abs(q(:, 1)))
   end subroutine find_angles

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

   !> sqrt(n . b . n), as for other laws of plastic flow; huge in scenes without tools.
   pure real(wp) function stretch(self, values, layout, direction)
      class(crystal_t), intent(in) :: self
      real(wp), intent(in) :: values(:)
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: direction(3)
      stretch = huge(1.0_wp)
      if (self%shape > 0) stretch = sqrt(dot_product(direction, matmul( &
                                    tensor_of(values(self%shape:self%shape + 5)), direction)))
   end function stretch

   !> Slip is isochoric.
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
