!> A snapshot as plain arrays: the state of all particles at one time, distributed over the ranks.
module m_snapshot
   use m_kinds, only: wp, i8
   use m_constants, only: exit_numerical
   use m_errors, only: error_t, fail
   use m_communicator, only: communicator_t
   use m_sorting, only: sorted_order
   use m_region, only: region_t
   use m_plastic, only: von_mises
   use m_text, only: to_text
   implicit none
   private
   public :: snapshot_file_name, step_digits

   integer, parameter, public :: component_name_length = 16
   character(len=2), parameter :: symmetric(6) = ['xx', 'yy', 'zz', 'xy', 'yz', 'xz'] ! in the order of VTK

   !> One field of the particles. Every rank has the same fields in the same order, also a rank without
   !> particles.
   type, public :: snapshot_field_t
      character(len=:), allocatable :: name !< for instance `stress`
      character(len=:), allocatable :: unit !< for instance `Pa`; empty for a pure number
      integer :: components = 1
      character(len=component_name_length), allocatable :: component_names(:) !< for instance xx yy zz xy yz
                                                                              !< xz
      real(wp), allocatable :: values(:, :) !< (n_local, components)
   contains
      procedure :: full_name
      procedure :: is_symmetric_tensor
      procedure :: file_order
   end type snapshot_field_t

   !> File layout of this rank's particles: file positions `offset(r)` to `offset(r) + count(r) - 1`
   !> (0-based), ascending and disjoint, take the local particles `order(1), order(2), ...` one after the
   !> other.
   type, public :: file_layout_t
      integer(i8), allocatable :: offset(:)
      integer, allocatable :: count(:)
      integer, allocatable :: order(:)
   contains
      procedure :: position_sum
      procedure :: part
   end type file_layout_t

   !> A grid level of a scene with several.
   type, public :: snapshot_level_t
      type(region_t) :: region
      real(wp) :: cell = 0.0_wp       !< m
      integer(i8) :: particles = 0_i8 !< of all ranks
   end type snapshot_level_t

   !> The particles at one time. Run r consists of `run_count(r)` local particles, consecutive in memory, at
   !> file position `run_offset(r)` (0-based), so that a file is in the same order on any number of ranks.
   type, public :: snapshot_t
      real(wp) :: time = 0.0_wp             !< physical time, s
      integer :: step = 0                   !< steps of the coarsest level taken
      character(len=:), allocatable :: title
      integer :: n_local = 0                !< particles of this rank; may be 0
      integer(i8) :: n_total = 0_i8         !< particles of all ranks; may be 0
      real(wp), allocatable :: position(:, :) !< (n_local, 3), m
      integer(i8), allocatable :: id(:)     !< (n_local)
      integer :: id_bits = 0 !< lowest bits of an id, shared by the parts of a particle
      type(snapshot_field_t), allocatable :: fields(:)
      integer(i8), allocatable :: run_offset(:) !< (runs)
      integer, allocatable :: run_count(:)  !< (runs)
      type(snapshot_level_t), allocatable :: levels(:) !< the coarsest first, as the particles in the file;
                                                       !< not allocated for a single level
   contains
      procedure :: check
      procedure :: layout
      procedure :: add_von_mises
   end type snapshot_t

contains

   !> `particles_<step>` with the step in 8 digits (more if necessary).
   pure function snapshot_file_name(step, extension) result(name)
      integer, intent(in) :: step
      character(len=*), intent(in) :: extension !< without the dot
      character(len=:), allocatable :: name
      name = 'particles_'//step_digits(step)//'.'//extension
   end function snapshot_file_name

   !> The number of a step as in file names.
   pure function step_digits(step) result(text)
      integer, intent(in) :: step
      character(len=:), allocatable :: text
      character(len=16) :: digits
      write (digits, '(i0.8)') step
      text = trim(digits)
   end function step_digits

   !> Name of one component: `stress_xx`; the field's own name when it has only one.
   pure function full_name(self, component) result(name)
      class(snapshot_field_t), intent(in) :: self
      integer, intent(in) :: component
      character(len=:), allocatable :: name
      character(len=1), parameter :: axes(3) = ['x', 'y', 'z']
      name = self%name
      if (self%components == 1) return
      if (allocated(self%component_names)) then
         name = name//'_'//trim(self%component_names(component))
      else if (self%components == 3) then
         name = name//'_'//axes(component)
      else
         name = name//'_'//to_text(component)
      end if
   end function full_name

   !> True when its components are xx, yy, zz, yz, xz, xy, in any order.
   pure logical function is_symmetric_tensor(self)
      class(snapshot_field_t), intent(in) :: self
      integer :: c
      is_symmetric_tensor = self%components == size(symmetric) .and. allocated(self%component_names)
      if (is_symmetric_tensor) &
         is_symmetric_tensor = all([(any(self%component_names == symmetric(c)), c=1, size(symmetric))])
   end function is_symmetric_tensor

   !> Its components in the order of VTK files: those of a symmetric tensor as xx yy zz xy yz xz, VTK's and
   !> ParaView's meaning of six components; others unchanged.
   pure function file_order(self) result(columns)
      class(snapshot_field_t), intent(in) :: self
      integer :: columns(self%components)
      integer :: c
      columns = [(c, c=1, self%components)]
      if (self%is_symmetric_tensor()) &
         columns = [(findloc(self%component_names == symmetric(c), .true., dim=1), c=1, size(symmetric))]
   end function file_order

   !> Add the von Mises stress of each stress tensor: `von_mises` of `stress`, `von_mises_x` of `stress_x`.
   subroutine add_von_mises(self)
      class(snapshot_t), intent(inout) :: self
      type(snapshot_field_t), allocatable :: fields(:)
      integer :: f, n
      logical :: is_stress(size(self%fields))
      do f = 1, size(is_stress)
         is_stress(f) = index(self%fields(f)%name, 'stress') == 1 .and. self%fields(f)%is_symmetric_tensor()
      end do
      allocate (fields(size(is_stress) + count(is_stress)))
      n = 0
      do f = 1, size(is_stress)
         n = n + 1
         call move_field(self%fields(f), fields(n))
         if (.not. is_stress(f)) cycle
         n = n + 1
         call make_von_mises(fields(n - 1), fields(n))
      end do
      call move_alloc(fields, self%fields)
   end subroutine add_von_mises

   subroutine move_field(from, to)
      type(snapshot_field_t), intent(inout) :: from, to
      to%components = from%components
      call move_alloc(from%name, to%name)
      call move_alloc(from%unit, to%unit)
      call move_alloc(from%component_names, to%component_names)
      call move_alloc(from%values, to%values)
   end subroutine move_field

   pure subroutine make_von_mises(stress, mises)
      type(snapshot_field_t), intent(in) :: stress
      type(snapshot_field_t), intent(inout) :: mises
      integer :: at(6)
      mises%name = 'von_mises'//stress%name(len('stress') + 1:)
      mises%unit = stress%unit
      mises%components = 1
      allocate (mises%values(size(stress%values, 1), 1))
      at = stress%file_order()
      associate (s => stress%values)
         mises%values(:, 1) = von_mises(s(:, at(1)), s(:, at(2)), s(:, at(3)), s(:, at(5)), s(:, at(6)), &
                                        s(:, at(4)))
      end associate
   end subroutine make_von_mises

   !> Collective: fail when the arrays do not match or the runs do not cover the file exactly.
   subroutine check(self, communicator, error)
      class(snapshot_t), intent(in) :: self
      type(communicator_t), intent(in) :: communicator
      type(error_t), intent(inout) :: error
      type(file_layout_t) :: where_to
      integer(i8) :: given, positions
      call check_arrays(self, error)
      call communicator%agree(error)
      if (error%happened()) return
      where_to = self%layout()
      given = communicator%sum_count(int(self%n_local, i8))
      positions = communicator%sum_count(where_to%position_sum())
      if (given /= self%n_total) then
         call fail(error, exit_numerical, 'snapshot of step '//to_text(self%step)//': the ranks hold '// &
                   to_text(given)//' particles and not '//to_text(self%n_total))
      else if (overlaps(where_to) .or. positions /= triangle(self%n_total)) then
         call fail(error, exit_numerical, 'snapshot of step '//to_text(self%step)// &
                   ': the runs of particles overlap')
      end if
      call communicator%agree(error)
   end subroutine check

   !> Sum of 0 to n - 1; the factors are halved first to avoid overflow.
   pure integer(i8) function triangle(n)
      integer(i8), intent(in) :: n
      triangle = merge((n/2)*(n - 1), n*((n - 1)/2), mod(n, 2_i8) == 0)
   end function triangle

   !> Check the array shapes on this rank.
   subroutine check_arrays(self, error)
      class(snapshot_t), intent(in) :: self
      type(error_t), intent(inout) :: error
      logical :: good
      integer :: f
      good = allocated(self%position) .and. allocated(self%id) .and. allocated(self%fields) &
             .and. allocated(self%title) .and. allocated(self%run_offset) .and. allocated(self%run_count)
      if (good) good = size(self%position, 1) == self%n_local .and. size(self%position, 2) == 3 &
                       .and. size(self%id) == self%n_local .and. size(self%run_offset) == size(self%run_count)
      if (good) good = sum(self%run_count) == self%n_local .and. all(self%run_count >= 0)
      if (good) good = all(self%run_offset >= 0 .and. self%run_offset + self%run_count <= self%n_total)
      if (good) then
         do f = 1, size(self%fields)
            good = good .and. good_field(self%fields(f), self%n_local)
         end do
      end if
      if (good .and. allocated(self%levels)) good = sum(self%levels%particles) == self%n_total
      if (.not. good) call fail(error, exit_numerical, 'snapshot of step '//to_text(self%step)// &
                                ': its arrays do not fit each other')
   end subroutine check_arrays

   logical function good_field(field, n_local) result(good)
      type(snapshot_field_t), intent(in) :: field
      integer, intent(in) :: n_local
      good = allocated(field%name) .and. allocated(field%unit) .and. allocated(field%values)
      if (good) good = all(shape(field%values) == [n_local, field%components]) .and. field%components > 0
      if (good .and. allocated(field%component_names)) good = size(field%component_names) == field%components
   end function good_field

   !> The runs in file order, without empty ones and with adjacent ones joined.
   function layout(self) result(where_to)
      class(snapshot_t), intent(in) :: self
      type(file_layout_t) :: where_to
      integer, allocatable :: by_offset(:), first(:)
      integer :: r, s, n, p, runs
      runs = size(self%run_offset)
      allocate (by_offset(runs), first(runs), where_to%offset(runs), where_to%count(runs), &
                where_to%order(self%n_local))
      p = 1
      do r = 1, runs
         first(r) = p
         p = p + self%run_count(r)
      end do
      by_offset(:) = sorted_order(self%run_offset, self%run_offset)
      n = 0
      p = 0
      do s = 1, runs
         r = by_offset(s)
         if (self%run_count(r) == 0) cycle
         if (follows(where_to, n, self%run_offset(r))) then
            where_to%count(n) = where_to%count(n) + self%run_count(r)
         else
            n = n + 1
            where_to%offset(n) = self%run_offset(r)
            where_to%count(n) = self%run_count(r)
         end if
         call take(where_to%order, p, first(r), self%run_count(r))
      end do
      where_to%offset = where_to%offset(1:n)
      where_to%count = where_to%count(1:n)
   end function layout

   !> Append local particles first, first + 1, ... to an order that holds p.
   pure subroutine take(order, p, first, count)
      integer, intent(inout) :: order(:), p
      integer, intent(in) :: first, count
      integer :: i
      do i = 0, count - 1
         order(p + 1 + i) = first + i
      end do
      p = p + count
   end subroutine take

   !> True when a run at this offset begins where the n-th ends.
   pure logical function follows(where_to, n, offset)
      type(file_layout_t), intent(in) :: where_to
      integer, intent(in) :: n
      integer(i8), intent(in) :: offset
      follows = .false.
      if (n > 0) follows = where_to%offset(n) + where_to%count(n) == offset
   end function follows

   pure logical function overlaps(where_to)
      type(file_layout_t), intent(in) :: where_to
      integer :: n
      n = size(where_to%offset)
      overlaps = .false.
      if (n > 1) overlaps = any(where_to%offset(1:n - 1) + where_to%count(1:n - 1) > where_to%offset(2:n))
   end function overlaps

   !> Sum of the file positions of this rank: over all ranks n (n - 1) / 2 if each position is used once.
   pure integer(i8) function position_sum(self)
      class(file_layout_t), intent(in) :: self
      position_sum = sum(self%count*self%offset + (int(self%count, i8)*(self%count - 1_i8))/2)
   end function position_sum

   !> The part of a layout at file positions `first` (0-based) to `first + length - 1`; its positions count
   !> from `first`.
   pure function part(self, first, length) result(piece)
      class(file_layout_t), intent(in) :: self
      integer(i8), intent(in) :: first, length
      type(file_layout_t) :: piece
      integer(i8) :: low, high
      integer :: r, n, passed, start
      allocate (piece%offset(size(self%offset)), piece%count(size(self%offset)))
      n = 0
      passed = 0
      start = 0
      do r = 1, size(self%offset)
         low = max(first, self%offset(r))
         high = min(first + length, self%offset(r) + self%count(r))
         if (high > low) then
            if (n == 0) start = passed + int(low - self%offset(r))
            n = n + 1
            piece%offset(n) = low - first
            piece%count(n) = int(high - low)
         end if
         passed = passed + self%count(r)
      end do
      piece%offset = piece%offset(1:n)
      piece%count = piece%count(1:n)
      piece%order = self%order(start + 1:start + sum(piece%count))
   end function part

end module m_snapshot
