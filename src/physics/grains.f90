!> A polycrystal: each particle in a box takes the orientation of the nearest seed (Voronoi's cells). The lattice
!> of particles goes through the boundaries of grains, so that there is no seam (theory.md, eq. grains). It acts
!> at the start only.
module m_grains
   use m_kinds, only: wp, i8
   use m_constants, only: exit_input, pi
   use m_errors, only: error_t, fail
   use m_communicator, only: communicator_t
   use m_field_table, only: field_table_t, layout_t
   use m_filesystem, only: read_file
   use m_grid_level, only: grid_level_t
   use m_group_reader, only: group_reader_t
   use m_level, only: level_t
   use m_particle_store, only: particle_store_t
   use m_rotations, only: from_euler
   use m_text, only: to_text
   use m_value_range, only: any_value
   use m_effect, only: effect_t, hooks_t
   implicit none
   private
   public :: grains_t

   integer, parameter :: longest_path = 1000, longest_file = 64*1024*1024 !< characters, bytes
   integer(i8), parameter :: prime = 2147483647_i8 !< 2^31 - 1

   type, extends(effect_t) :: grains_t
      real(wp) :: lower(3) = 0.0_wp, upper(3) = 0.0_wp !< the box, m
      integer :: count = 0                             !< of grains
      integer :: seed = 1                              !< of chance
      real(wp), allocatable :: positions(:)    !< of the seeds, m: x y z of each
      real(wp), allocatable :: orientations(:) !< Euler angles phi1 Phi phi2 of each, degrees
      integer :: grain = 0                     !< column of the number of the grain
   contains
      procedure :: variables
      procedure :: declare
      procedure :: hooks
      procedure :: initialise
      procedure :: verify
      procedure, private :: read_grains
      procedure, private :: draw
   end type grains_t

contains

   !> What is read from a file is written as lists, so that case.nml needs no file.
   subroutine variables(self, group)
      class(grains_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      character(len=:), allocatable :: file
      integer :: grains
      file = ''
      call group%get('lower', self%lower, any_value('m'), required=.true.)
      call group%get('upper', self%upper, any_value('m'), required=.true.)
      if (any(self%upper <= self%lower)) call group%refuse('upper', 'must be above lower in every direction')
      if (.not. group%is_writing()) call group%get_text('file', file, longest_path)
      call group%get_list('positions', self%positions, any_value('m'))
      call group%get_list('orientations', self%orientations, any_value('degrees'))
      if (file /= '' .and. (group%is_given('positions') .or. group%is_given('orientations'))) then
         call group%refuse('file', 'not together with positions or orientations, which the file gives')
      else if (file /= '') then
         call self%read_grains(group, file)
      end if
      grains = 0
      if (allocated(self%orientations)) grains = size(self%orientations)/3
      if (allocated(self%positions)) grains = max(grains, size(self%positions)/3)
      if (mod(size_of(self%orientations), 3) /= 0) &
         call group%refuse('orientations', 'must be three angles a grain')
      if (mod(size_of(self%positions), 3) /= 0) call group%refuse('positions', 'must be three numbers a grain')
      if (allocated(self%positions) .and. allocated(self%orientations)) then
         if (size(self%positions) /= size(self%orientations)) &
            call group%refuse('orientations', 'must be as many as positions')
      end if
      call group%get('count', self%count, least=1, required=grains == 0)
      if (grains > 0 .and. self%count == 0) self%count = grains
      if (grains > 0 .and. self%count /= grains) &
         call group%refuse('count', 'must be absent, or the number of grains that are given, '//to_text(grains))
      call group%get('seed', self%seed, least=0)
   end subroutine variables

   pure integer function size_of(list)
      real(wp), allocatable, intent(in) :: list(:)
      size_of = 0
      if (allocated(list)) size_of = size(list)
   end function size_of

   !> Lines `phi1 Phi phi2` or `x y z phi1 Phi phi2`, a grain each; what follows # or ! is not read.
   subroutine read_grains(self, group, file)
      class(grains_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      character(len=*), intent(in) :: file
      character(len=:), allocatable :: text, line
      real(wp), allocatable :: rows(:), row(:)
      integer :: at, end, number, width
      logical :: ok
      call read_file(file, longest_file, text, ok)
      if (.not. ok) then
         call group%refuse('file', 'cannot be read; allowed: a text file of lines phi1 Phi phi2 or '// &
                           'x y z phi1 Phi phi2')
         return
      end if
      allocate (rows(0))
      width = 0
      at = 1
      number = 0
      do while (at <= len(text))
         number = number + 1
         end = index(text(at:), new_line('a'))
         if (end == 0) end = len(text) - at + 2
         line = text(at:at + end - 2)
         at = at + end
         call read_row(line, row, ok)
         if (ok .and. size(row) == 0) cycle
         if (width == 0) width = size(row)
         if (.not. ok .or. size(row) /= width .or. .not. any(width == [3, 6])) then
            call group%refuse('file', 'line '//to_text(number)//' of it must be 3 angles, or 3 coordinates and '// &
                              '3 angles, as in all its lines')
            return
         end if
         rows = [rows, row]
      end do
      if (size(rows) == 0) then
         call group%refuse('file', 'has no grains; allowed: a line each')
         return
      end if
      associate (table => reshape(rows, [width, size(rows)/width]))
         self%orientations = reshape(table(width - 2:, :), [3*size(table, 2)])
         if (width == 6) self%positions = reshape(table(:3, :), [3*size(table, 2)])
      end associate
   end subroutine read_grains

   !> The numbers of a line, none where it is empty.
   subroutine read_row(line, row, ok)
      character(len=*), intent(in) :: line
      real(wp), allocatable, intent(out) :: row(:)
      logical, intent(out) :: ok
      real(wp) :: values(7)
      character(len=:), allocatable :: content
      integer :: n, status, words, i
      logical :: inside
      content = line
      i = scan(content, '#!')
      if (i > 0) content = content(:i - 1)
      do i = 1, len(content)
         if (ichar(content(i:i)) < 32 .or. content(i:i) == ',') content(i:i) = ' '
      end do
      words = 0
      inside = .false.
      do i = 1, len(content)
         if (content(i:i) /= ' ' .and. .not. inside) words = words + 1
         inside = content(i:i) /= ' '
      end do
      n = min(words, size(values))
      ok = only_numbers(content)
      status = 0
      if (ok .and. n > 0) read (content, *, iostat=status) values(:n)
      ok = ok .and. status == 0
      if (ok) ok = all(abs(values(:n)) <= huge(1.0_wp))
      row = values(:n)
   end subroutine read_row

   !> Only what numbers are made of: a list-directed READ takes more.
   pure logical function only_numbers(text)
      character(len=*), intent(in) :: text
      integer :: i
      only_numbers = all([(index(' 0123456789+-.eEdD', text(i:i)) > 0, i=1, len(text))])
   end function only_numbers

   !> The number of the grain, 0 outside the box.
   subroutine declare(self, table)
      class(grains_t), intent(inout) :: self
      type(field_table_t), intent(inout) :: table
      call table%declare('grain', 1, '1', written=.true.)
      self%grain = table%column('grain')
      call self%draw()
   end subroutine declare

   !> It does nothing in a step.
   pure type(hooks_t) function hooks(self)
      class(grains_t), intent(in) :: self
      hooks = hooks_t()
   end function hooks

   !> What is not given is left to chance: seeds all over the box, orientations all alike likely (Shoemake 1992:
   !> here as Euler angles, phi1 and phi2 uniform and Phi by its cosine).
   subroutine draw(self)
      class(grains_t), intent(inout) :: self
      integer(i8) :: state
      integer :: i
      state = stirred(int(self%seed, i8))
      if (.not. allocated(self%positions)) then
         allocate (self%positions(3*self%count))
         do i = 1, 3*self%count
            associate (axis => 1 + mod(i - 1, 3))
               self%positions(i) = self%lower(axis) + (self%upper(axis) - self%lower(axis))*chance(state)
            end associate
         end do
      end if
      if (.not. allocated(self%orientations)) then
         allocate (self%orientations(3*self%count))
         do i = 1, self%count
            self%orientations(3*i - 2) = 360.0_wp*chance(state)
            self%orientations(3*i - 1) = 180.0_wp/pi*acos(1.0_wp - 2.0_wp*chance(state))
            self%orientations(3*i) = 360.0_wp*chance(state)
         end do
      end if
   end subroutine draw

   !> A number in [0, 1), the next of a row that is the same with every compiler.
   real(wp) function chance(state)
      integer(i8), intent(inout) :: state
      state = stirred(state + 1_i8)
      chance = real(state, wp)/real(prime, wp)
   end function chance

   pure integer(i8) function stirred(state)
      integer(i8), intent(in) :: state
      integer :: turn
      stirred = mod(state + 362437_i8, prime)
      do turn = 1, 3
         stirred = mod(stirred*48271_i8 + 11_i8, prime)
         stirred = mod(ieor(stirred, ishft(stirred, -13)), prime)
      end do
   end function stirred

   !> Number and orientation of the nearest seed, of two as near that with the lower number.
   subroutine initialise(self, particles, table, layout, grid)
      class(grains_t), intent(in) :: self
      type(particle_store_t), intent(inout) :: particles
      type(field_table_t), intent(in) :: table
      type(layout_t), intent(in) :: layout
      type(grid_level_t), intent(in) :: grid
      real(wp) :: x(3), q(4), nearest, distance
      integer :: first, g, p, found
      if (layout%orientation == 0) return
      first = table%column('first_orientation')
      do p = 1, particles%count
         x = particles%column(p, layout%position:layout%position + 2)
         if (any(x < self%lower .or. x > self%upper)) cycle
         nearest = huge(nearest)
         found = 0
         do g = 1, self%count
            distance = sum((x - self%positions(3*g - 2:3*g))**2)
            if (distance >= nearest) cycle
            nearest = distance
            found = g
         end do
         q = from_euler(pi/180.0_wp*self%orientations(3*found - 2:3*found))
         particles%column(p, layout%orientation:layout%orientation + 3) = q
         if (first > 0) particles%column(p, first:first + 3) = q
         particles%column(p, self%grain) = found
      end do
   end subroutine initialise

   !> Some material must have axes that grains can turn.
   subroutine verify(self, communicator, levels, tools, error)
      class(grains_t), intent(in) :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(in) :: levels(:)
      integer, intent(in) :: tools
      type(error_t), intent(inout) :: error
      if (levels(1)%layout%orientation == 0) &
         call fail(error, exit_input, self%group_text()//': no material has axes that grains could turn; '// &
                   'allowed: with model=''crystal'', ''cubic'' or ''orthotropic''')
   end subroutine verify

end module m_grains
