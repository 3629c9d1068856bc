!> A law in a user's library, called for many particles at once, in the corotational frame or in that of the
!> grid (theory.md, eqs corotational, fixed-frame): shared by its interfaces. An interface extends user_law_t
!> and finds and calls the law (vumat.f90, c_law.f90, umat.f90).
module m_user_law
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_value, ieee_quiet_nan
   use m_kinds, only: wp
   use m_constants, only: exit_input, exit_numerical
   use m_foreign_call, only: name_foreign_code, begin_foreign_call, end_foreign_call
   use m_text, only: to_text
   use m_group_reader, only: group_reader_t
   use m_value_range, only: any_value, above, at_least
   use m_field_table, only: field_table_t, layout_t
   use m_material, only: material_t
   use m_user_library, only: points_t, room_for, place_tensor, tensor_place, matrix_place
   use m_corotation, only: split_gradient, into_frame, out_of_frame, relative_spin, &
      advance_gradient, turn_by
   use m_tangent, only: tangent_t
   implicit none
   private
   public :: user_law_t, points_t, room_for, tensor_place, matrix_place

   integer, parameter :: lanes = 128 !< particles per call; laws may have work arrays of maxblk = 136
   integer, parameter :: longest_name = 1024, max_states = 200
   integer, parameter :: spare_states = 8 !< columns after the states, to detect writes beyond them
   real(wp), parameter :: untouched = 8.0e66_wp !< their initial value
   real(wp), parameter :: not_written = -huge(1.0_wp) !< an energy that the law has not set
   real(wp), parameter :: probe_strain = 1.0e-6_wp, probe_step = 1.0e-9_wp !< s: too short for relaxation

   type, abstract, extends(material_t) :: user_law_t
      character(len=:), allocatable :: label    !< name of the material
      character(len=:), allocatable :: library  !< file
      character(len=:), allocatable :: checksum !< of the file
      integer :: called = 0                     !< its number in m_foreign_call
      real(wp), allocatable :: constants(:)
      integer :: states = 0                     !< state variables a particle
      real(wp) :: temperature = 0.0_wp          !< temperature passed to the law, constant
      real(wp) :: wave_modulus = 0.0_wp         !< of the fastest wave, Pa; 0: determined by a probe of the
                                                !< law
      type(tangent_t) :: tangent                !< of the unstrained law
      real(wp) :: modulus = 0.0_wp              !< the one of these in use, Pa
      logical :: turns = .true.                 !< the frame rotates with the material; else it is the grid's,
                                                !< strains are summed, and moduli given
      integer :: mass = 0, energy = 0, inelastic = 0, age = 0, total = 0, share = 0 !< columns
      integer, allocatable :: sdv(:)            !< column of each state variable
   contains
      procedure :: variables
      procedure :: declare
      procedure :: initial
      procedure :: is_at_rest
      procedure :: update
      procedure :: p_wave_modulus
      procedure :: complementary_energy
      procedure :: strain_energy
      procedure :: plastic_energy
      procedure :: may_flow
      procedure :: stretch
      procedure :: fault_text
      procedure :: for_large_strains
      procedure :: tells_temperature
      procedure, private :: probe
      procedure, private :: advance
      procedure, non_overridable :: fill_points
      procedure(load_interface), deferred :: load
      procedure(evaluate_interface), deferred :: evaluate
   end type user_law_t

   abstract interface
      !> Open the library and find the law, or report an error of a variable of the group.
      subroutine load_interface(self, group, found)
         import :: user_law_t, group_reader_t
         class(user_law_t), intent(inout) :: self
         type(group_reader_t), intent(inout) :: group
         logical, intent(out) :: found
      end subroutine load_interface

      !> Call the law. It is assumed to be pure: the same input gives the same output, and nothing is stored.
      pure subroutine evaluate_interface(self, points)
         import :: user_law_t, points_t
         class(user_law_t), intent(in) :: self
         type(points_t), intent(inout) :: points
      end subroutine evaluate_interface
   end interface

contains

   subroutine variables(self, group)
      class(user_law_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      logical :: found
      if (.not. allocated(self%library)) self%library = ''
      call group%get_text('library', self%library, longest_name, required=.true.)
      call group%get_list('constants', self%constants, any_value(''))
      call group%get('states', self%states, 0)
      call group%get('wave_modulus', self%wave_modulus, at_least(0.0_wp, 'Pa'))
      if (self%tells_temperature() .and. (abs(self%temperature) > 0.0_wp .or. .not. group%is_writing())) &
         call group%get('temperature', self%temperature, any_value(''))
      if (.not. allocated(self%checksum)) self%checksum = ''
      if (.not. group%is_writing() .or. self%checksum /= '') &
         call group%get_text('checksum', self%checksum, longest_name)
      if (self%states > max_states) call group%refuse('states', 'must be a whole number from 0 to '// &
                                                       to_text(max_states))
      if (.not. group%is_reading()) return
      if (.not. allocated(self%constants)) allocate (self%constants(0))
      if (.not. allocated(self%label)) self%label = ''
      call group%get_name('name', self%label)
      call group%get('density', self%density, above(0.0_wp, 'kg/m3'))
      if (self%states > max_states .or. .not. self%density > 0.0_wp) return
      call self%load(group, found)
      if (.not. found) return
      self%called = name_foreign_code(self%library)
      call self%probe(group)
   end subroutine variables

   !> True for an interface that has a temperature.
   pure logical function tells_temperature(self)
      class(user_law_t), intent(in) :: self
      tells_temperature = .true.
   end function tells_temperature

   pure logical function for_large_strains(self)
      class(user_law_t), intent(in) :: self
      for_large_strains = .true.
   end function for_large_strains

   !> The deformation gradient, the law's state variables as fields SDV1, SDV2, ..., energies, and the
   !> particle's age.
   pure subroutine declare(self, table, has_tools)
      class(user_law_t), intent(inout) :: self
      type(field_table_t), intent(inout) :: table
      logical, intent(in) :: has_tools
      integer :: k
      call table%declare('deformation_gradient', 9, '1', written=.false., by_mass=.true.)
      call table%declare('law_energy', 1, 'J/kg', written=.false., by_mass=.true.)
      call table%declare('law_dissipation', 1, 'J/kg', written=.false., by_mass=.true.)
      call table%declare('law_time', 1, 's', written=.false.)
      self%mass = table%column('mass')
      self%energy = table%column('law_energy')
      self%inelastic = table%column('law_dissipation')
      self%age = table%column('law_time')
      if (.not. self%turns) then
         call table%declare('law_strain', 6, '1', written=.false.)
         call table%declare('law_step', 1, '1', written=.false.)
         self%total = table%column('law_strain')
         self%share = table%column('law_step')
      end if
      if (allocated(self%sdv)) deallocate (self%sdv)
      allocate (self%sdv(self%states))
      do k = 1, self%states
         call table%declare('SDV'//to_text(k), 1, '1', written=.true.)
         self%sdv(k) = table%column('SDV'//to_text(k))
      end do
   end subroutine declare

   !> The deformation gradient starts as the identity, the state variables as zero.
   pure subroutine initial(self, column, layout, first, last)
      class(user_law_t), intent(in) :: self
      real(wp), intent(inout), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: first, last
      column(first:last, layout%deformation:layout%deformation + 8:4) = 1.0_wp
   end subroutine initial

   !> Always false: the law's dependence on time is unknown.
   pure logical function is_at_rest(self, column, layout, first, last)
      class(user_law_t), intent(in) :: self
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: first, last
      is_at_rest = .false.
   end function is_at_rest

   !> Call the law for groups of at most `lanes` particles.
   pure subroutine update(self, column, layout, gradient, time_step, first, last)
      class(user_law_t), intent(in) :: self
      real(wp), intent(inout), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      real(wp), intent(in), contiguous :: gradient(:, :)
      real(wp), intent(in) :: time_step
      integer, intent(in) :: first, last
      integer :: from
      do from = first, last, lanes
         call self%advance(column, layout, gradient, time_step, from, min(from + lanes - 1, last))
      end do
   end subroutine update

   !> One call of the law, in its frame and back. If the law requests a smaller step the stress is undefined.
   pure subroutine advance(self, column, layout, gradient, time_step, first, last)
      class(user_law_t), intent(in) :: self
      real(wp), intent(inout), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      real(wp), intent(in), contiguous :: gradient(:, :)
      real(wp), intent(in) :: time_step
      integer, intent(in) :: first, last
      real(wp) :: r(last - first + 1, 9), tensor(last - first + 1, 6)
      type(points_t) :: points
      integer :: k
      call self%fill_points(column, layout, gradient, time_step, first, last, points, r)
      call ask(self, points, exit_numerical)
      column(first:last, layout%deformation:layout%deformation + 8) = points%deformation(:, matrix_place)
      tensor = points%stress(:, tensor_place)
      if (self%turns) call out_of_frame(size(r, 1), r, tensor)
      column(first:last, layout%stress:layout%stress + 5) = tensor
      do k = 1, self%states
         column(first:last, self%sdv(k)) = points%state(:, k)
      end do
      column(first:last, self%energy) = points%energy
      column(first:last, self%inelastic) = points%inelastic
      column(first:last, self%age) = column(first:last, self%age) + time_step
      if (self%turns) return
      column(first:last, self%total:self%total + 5) = points%total(:, tensor_place) &
                                                      + points%strain(:, tensor_place)
      column(first:last, self%share) = points%share
      where (points%share < 1.0_wp) column(first:last, layout%stress) = ieee_value(1.0_wp, ieee_quiet_nan)
   end subroutine advance

   !> Set the input of a call for particles first..last, and the frame at the step's end.
   pure subroutine fill_points(self, column, layout, gradient, time_step, first, last, points, r)
      class(user_law_t), intent(in) :: self
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      real(wp), intent(in), contiguous :: gradient(:, :)
      real(wp), intent(in) :: time_step
      integer, intent(in) :: first, last
      type(points_t), intent(out) :: points
      real(wp), intent(out) :: r(last - first + 1, 9)
      real(wp) :: f(last - first + 1, 9), r_old(last - first + 1, 9), tensor(last - first + 1, 6), &
                  half(last - first + 1)
      integer :: k, n
      n = last - first + 1
      points = room_for(n, self%states, .not. self%turns, spare_states)
      points%time = column(first, self%age) + time_step
      points%time_step = time_step
      f = column(first:last, layout%deformation:layout%deformation + 8)
      if (self%turns) then
         call follow(n, time_step, gradient(first:last, :), f, points, r_old, r, half)
      else
         call follow_unturned(n, time_step, gradient(first:last, :), f, points, half)
         tensor = column(first:last, self%total:self%total + 5)
         call turn_by(n, points%spin, tensor)
         call place_tensor(n, tensor, points%total)
      end if
      if (layout%position > 0) points%place = column(first:last, layout%position:layout%position + 2)
      points%size = column(first:last, layout%volume)**(1.0_wp/3.0_wp)
      points%density = column(first:last, layout%mass)/(column(first:last, layout%volume)*half)
      tensor = column(first:last, layout%stress:layout%stress + 5)
      if (self%turns) then
         call into_frame(n, r_old, tensor)
      else
         call turn_by(n, points%spin, tensor)
      end if
      call place_tensor(n, tensor, points%stress_old)
      do k = 1, self%states
         points%state_old(:, k) = column(first:last, self%sdv(k))
      end do
      points%energy_old = column(first:last, self%energy)
      points%inelastic_old = column(first:last, self%inelastic)
   end subroutine fill_points

   !> Call the law. Values that it does not set keep their old ones, except the energy, which then is the work
   !> of the stress. A state that is NaN, or a write beyond the states, sets the stress to NaN, which the step
   !> reports.
   pure subroutine ask(self, points, status)
      class(user_law_t), intent(in) :: self
      type(points_t), intent(inout) :: points
      integer, intent(in) :: status !< exit status of an error: exit_input at the start
      integer :: p
      points%stress = points%stress_old
      points%state(:, :self%states) = points%state_old
      points%state(:, self%states + 1:) = untouched
      points%energy = not_written
      points%inelastic = not_written
      call begin_foreign_call(self%called, status)
      call self%evaluate(points)
      call end_foreign_call()
      do p = 1, points%count
         if (points%energy(p) <= not_written) points%energy(p) = points%energy_old(p) &
            + (0.5_wp*sum((points%stress_old(p, 1:3) + points%stress(p, 1:3))*points%strain(p, 1:3)) &
               + sum((points%stress_old(p, 4:6) + points%stress(p, 4:6))*points%strain(p, 4:6))) &
               /points%density(p)
         if (points%inelastic(p) <= not_written) points%inelastic(p) = points%inelastic_old(p)
         if (.not. (all(ieee_is_finite(points%state(p, :self%states))) &
                    .and. ieee_is_finite(points%energy(p)) .and. ieee_is_finite(points%inelastic(p)) &
                    .and. .not. goes_beyond(self, points, p))) &
            points%stress(p, 1) = ieee_value(1.0_wp, ieee_quiet_nan)
      end do
   end subroutine ask

   !> True if the law has written beyond its states.
   pure logical function goes_beyond(self, points, p)
      class(user_law_t), intent(in) :: self
      type(points_t), intent(in) :: points
      integer, intent(in) :: p
      goes_beyond = any(abs(points%state(p, self%states + 1:) - untouched) > 0.0_wp)
   end function goes_beyond

   pure function fault_text(self) result(text)
      class(user_law_t), intent(in) :: self
      character(len=:), allocatable :: text
      text = ': its law returned NaN in stress or state, or wrote to more state '// &
             'variables than its '//to_text(self%states)//' states'
   end function fault_text

   !> F and its factors before and after the step, and the increments of strain and rotation of eq. elastic in
   !> the frame at the step's end.
   pure subroutine follow(n, dt, gradient, before, points, r_old, r, half)
      integer, intent(in) :: n
      real(wp), intent(in) :: dt, gradient(n, 9), before(n, 9)
      type(points_t), intent(inout) :: points
      real(wp), intent(out) :: r_old(n, 9), r(n, 9)
      real(wp), intent(out) :: half(n) !< det(I + A/2)
      real(wp) :: tensor(n, 6), f(n, 9)
      f = before
      points%deformation_old(:, matrix_place) = f
      call split_gradient(n, f, r_old, tensor)
      call place_tensor(n, tensor, points%stretch_old)
      call advance_gradient(n, dt, gradient, f, tensor, points%spin, half)
      points%deformation(:, matrix_place) = f
      call split_gradient(n, f, r, points%strain) ! it holds the stretch until the next line
      call place_tensor(n, points%strain, points%stretch)
      call into_frame(n, r, tensor)
      call place_tensor(n, tensor, points%strain)
      call relative_spin(n, r_old, r, points%spin)
   end subroutine follow

   !> The same in the frame of the grid, without the factors of F.
   pure subroutine follow_unturned(n, dt, gradient, before, points, half)
      integer, intent(in) :: n
      real(wp), intent(in) :: dt, gradient(n, 9), before(n, 9)
      type(points_t), intent(inout) :: points
      real(wp), intent(out) :: half(n)
      real(wp) :: tensor(n, 6), f(n, 9)
      f = before
      points%deformation_old(:, matrix_place) = f
      call advance_gradient(n, dt, gradient, f, tensor, points%spin, half)
      points%deformation(:, matrix_place) = f
      call place_tensor(n, tensor, points%strain)
   end subroutine follow_unturned

   !> Two calls at time 0, as Abaqus/Explicit makes them before its first increment: one without strain, one
   !> with small fictitious strains, whose results give the moduli and are discarded.
   subroutine probe(self, group)
      class(user_law_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      type(points_t) :: points
      type(tangent_t) :: side
      real(wp) :: answer(6, 12)
      integer :: call_number, k
      do call_number = 1, 2
         points = room_for(12, self%states, .not. self%turns, max_states)
         points%time_step = probe_step
         points%density = self%density
         points%size = 1.0_wp
         points%stretch_old(:, 1:3) = 1.0_wp
         points%deformation_old(:, 1:3) = 1.0_wp
         if (call_number == 2) then
            do k = 1, 6 ! positive and negative; a tensor's shear is half the strain
               points%strain(k, tensor_place(k)) = merge(1.0_wp, 0.5_wp, k <= 3)*probe_strain
               points%strain(6 + k, :) = -points%strain(k, :)
            end do
         end if
         points%stretch = points%stretch_old + points%strain
         points%deformation(:, 1:6) = points%stretch
         points%deformation(:, 7:9) = points%stretch(:, 4:6)
         call ask(self, points, exit_input)
         do k = max_states, 1, -1
            if (all(abs(points%state(:, self%states + k) - untouched) <= 0.0_wp)) cycle
            call group%refuse('states', 'the law writes to state variable '//to_text(self%states + k)// &
                              '; allowed: at least as many states as it has')
            return
         end do
         if (.not. all(ieee_is_finite(points%stress))) then
            call group%refuse('library', 'at the start, under strains of '// &
                              trim(merge('0   ', '1e-6', call_number == 1))// &
                              ', the law returns a stress that is NaN; correct the law')
            return
         end if
      end do
      if (.not. self%turns) then
         if (.not. all(abs(points%moduli(:, 1)) > 0.0_wp)) call group%refuse('library', &
            'the law leaves DDSDDE(1,1) at 0 at the start; it must return its moduli there')
      end if
      answer = transpose(points%stress(:, tensor_place))/probe_strain
      self%modulus = 0.0_wp
      do k = 1, 2 ! a law may be stiffer in one direction of loading
         side%stiffness = merge(1.0_wp, -1.0_wp, k == 1)*answer(:, 6*k - 5:6*k)
         self%modulus = max(self%modulus, side%wave_modulus())
      end do
      self%tangent%stiffness = 0.5_wp*(answer(:, 1:6) - answer(:, 7:12))
      if (.not. self%tangent%invert()) call group%refuse('library', &
         'the law has no stiffness against strains of 1e-6 at the start; allowed: a law that is '// &
         'elastic there')
      if (self%wave_modulus > 0.0_wp) self%modulus = self%wave_modulus
   end subroutine probe

   pure real(wp) function p_wave_modulus(self)
      class(user_law_t), intent(in) :: self
      p_wave_modulus = self%modulus
   end function p_wave_modulus

   !> By the initial moduli.
   pure real(wp) function complementary_energy(self, stress) result(energy)
      class(user_law_t), intent(in) :: self
      real(wp), intent(in) :: stress(6)
      energy = 0.5_wp*dot_product(stress, matmul(self%tangent%compliance, stress))
   end function complementary_energy

   !> Stored energy by the law, J.
   pure real(wp) function strain_energy(self, column, layout, first, last) result(energy)
      class(user_law_t), intent(in) :: self
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: first, last
      integer :: p
      energy = 0.0_wp
      do p = first, last
         energy = energy + column(p, layout%mass)*(column(p, self%energy) - column(p, self%inelastic))
      end do
   end function strain_energy

   !> Dissipated energy by the law, J.
   pure real(wp) function plastic_energy(self, column, first, last) result(energy)
      class(user_law_t), intent(in) :: self
      real(wp), intent(in), contiguous :: column(:, :)
      integer, intent(in) :: first, last
      integer :: p
      energy = 0.0_wp
      do p = first, last
         energy = energy + column(p, self%mass)*column(p, self%inelastic)
      end do
   end function plastic_energy

   !> True, as it is unknown.
   pure logical function may_flow(self)
      class(user_law_t), intent(in) :: self
      may_flow = .true.
   end function may_flow

   !> sqrt(n . F F^T . n).
   pure real(wp) function stretch(self, values, layout, direction)
      class(user_law_t), intent(in) :: self
      real(wp), intent(in) :: values(:)
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: direction(3)
      stretch = norm2(matmul(direction, reshape(values(layout%deformation:layout%deformation + 8), [3, 3])))
   end function stretch

end module m_user_law
