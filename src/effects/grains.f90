!> A polycrystal: each particle in a box takes the orientation of the nearest seed (Voronoi's cells), or of
!> the voxel that it is in. The lattice of particles goes through the boundaries of grains, so that there is
!> no seam (theory.md, eq. grains). It acts at the start only.
module m_grains
   use m_kinds, only: wp, i4, i8
   use m_constants, only: exit_input, pi
   use m_errors, only: error_t, fail
   use m_communicator, only: communicator_t
   use m_field_table, only: field_table_t, layout_t
   use m_grain_file, only: grain_file_t
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

   integer, parameter :: longest_path = 1000 !< characters
   character(len=7), parameter :: angle_words(2) = ['degrees', 'radians']
   integer, parameter :: in_degrees = 1, in_radians = 2
   integer, parameter :: enough = 4 !< grains of which one has an angle above 2 pi, were they in degrees
   real(wp), parameter :: max_separation = 1000.0_wp !< seeds from each other, in widths of the box
   integer(i8), parameter :: prime = 2147483647_i8 !< 2^31 - 1

   type, extends(effect_t) :: grains_t
      real(wp) :: lower(3) = 0.0_wp, upper(3) = 0.0_wp !< the box, m
      integer :: count = 0                             !< of grains
      integer :: seed = 1                              !< of chance
      real(wp), allocatable :: positions(:)    !< of the seeds, m: x y z of each
      real(wp), allocatable :: orientations(:) !< Euler angles phi1 Phi phi2 of each, degrees
      integer :: angles = 0                    !< how they are given, of `angle_words`; 0: not said
      integer(i4), allocatable :: voxels(:, :, :) !< number of the grain, x fastest, all over the box; 0: none
      character(len=:), allocatable :: file, checksum !< of the voxels
      integer :: grain = 0                     !< column of the number of the grain
   contains
      procedure :: variables
      procedure :: declare
      procedure :: hooks
      procedure :: initialise
      procedure :: verify
      procedure, private :: take_file
      procedure, private :: take_angles
      procedure, private :: check_distances
      procedure, private :: grain_at
      procedure, private :: draw
   end type grains_t

contains

   !> What is read from a file is written as lists, so that case.nml needs no file; but voxels are not.
   subroutine variables(self, group)
      class(grains_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      integer :: grains
      if (.not. allocated(self%file)) self%file = ''
      if (.not. allocated(self%checksum)) self%checksum = ''
      call group%get('lower', self%lower, any_value('m'), required=.true.)
      call group%get('upper', self%upper, any_value('m'), required=.true.)
      if (any(self%upper <= self%lower)) call group%refuse('upper', 'must be above lower in every direction')
      if (self%file /= '' .or. .not. group%is_writing()) then
         call group%get_text('file', self%file, longest_path)
         call group%get_text('checksum', self%checksum, longest_path)
      end if
      if (self%file == '' .or. .not. group%is_writing()) then
         call group%get_list('positions', self%positions, any_value('m'))
         call group%get_list('orientations', self%orientations, any_value('degrees'))
      end if
      if (self%file /= '' .and. (group%is_given('positions') .or. group%is_given('orientations'))) then
         call group%refuse('file', 'not together with positions or orientations, which the file gives')
      else if (self%file /= '' .and. group%is_reading()) then
         call self%take_file(group)
      end if
      if (.not. group%is_writing() .or. self%angles > 0) &
         call group%get_choice('angles', self%angles, angle_words)
      if (group%is_reading()) call self%check_distances(group)
      if (group%is_reading()) call self%take_angles(group)
      if (mod(size_of(self%orientations), 3) /= 0) &
         call group%refuse('orientations', 'must be three angles a grain')
      if (mod(size_of(self%positions), 3) /= 0) &
         call group%refuse('positions', 'must be three numbers a grain')
      if (allocated(self%positions) .and. allocated(self%orientations)) then
         if (size(self%positions) /= size(self%orientations)) &
            call group%refuse('orientations', 'must be as many as positions')
      end if
      grains = max(size_of(self%orientations), size_of(self%positions))/3
      call group%get('count', self%count, least=1, required=grains == 0)
      if (grains > 0 .and. self%count == 0) self%count = grains
      if (grains > 0 .and. self%count /= grains) &
         call group%refuse('count', 'must be absent, or the number of grains that are given, '// &
                           to_text(grains))
      call group%get('seed', self%seed, least=0)
   end subroutine variables

   !> What the file says; its name is kept where it has voxels alone.
   subroutine take_file(self, group)
      class(grains_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      type(grain_file_t) :: found
      character(len=:), allocatable :: fault
      call found%read(self%file, fault)
      if (fault == '' .and. self%checksum /= '' .and. self%checksum /= found%checksum) &
         fault = 'has been changed: its checksum is '//found%checksum//', the scene was made with '// &
                 self%checksum
      if (fault /= '') then
         call group%refuse('file', fault)
         return
      end if
      call move_alloc(found%orientations, self%orientations)
      if (allocated(found%positions)) call move_alloc(found%positions, self%positions)
      self%checksum = found%checksum
      if (allocated(found%voxels)) then
         call move_alloc(found%voxels, self%voxels)
      else
         self%file = ''
         self%checksum = ''
      end if
   end subroutine take_file

   !> Angles become degrees. Where nothing says what they are in, and none is above 2 pi, that is asked for.
   subroutine take_angles(self, group)
      class(grains_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      real(wp) :: largest
      if (size_of(self%orientations) == 0) return
      largest = maxval(abs(self%orientations))
      if (self%angles == 0 .and. size(self%orientations) >= 3*enough .and. largest > 0.0_wp &
          .and. largest <= 2.0_wp*pi) then
         call group%refuse(trim(merge('file        ', 'orientations', group%is_given('file'))), &
                           'no angle is above 6.28 in size, as if they were in radians; allowed: '// &
                           'angles=''radians'', or ''degrees'' if that is what they are in (Rodrigues'' '// &
                           'vectors are not read)')
      else if (self%angles == in_radians) then
         self%orientations = 180.0_wp/pi*self%orientations
         if (self%file == '') self%angles = in_degrees ! as they are written
      end if
   end subroutine take_angles

   !> Seeds that all are far from each other, seen from the box, or all at one of its places, are not in m, or
   !> no places.
   subroutine check_distances(self, group)
      class(grains_t), intent(in) :: self
      type(group_reader_t), intent(inout) :: group
      real(wp) :: low(3), high(3), apart, width
      integer :: axis, count
      count = size_of(self%positions)/3
      if (count < 2) return
      do axis = 1, 3
         low(axis) = minval(self%positions(axis:3*count:3))
         high(axis) = maxval(self%positions(axis:3*count:3))
      end do
      apart = maxval(high - low)/real(count, wp)**(1.0_wp/3.0_wp)
      width = maxval(self%upper - self%lower)
      if (apart <= max_separation*width .and. maxval(high - low)*max_separation >= width) return
      call group%refuse(trim(merge('file     ', 'positions', group%is_given('file'))), &
                        'the seeds lie from '//place(low)//' to '//place(high)//' m, the box from '// &
                        place(self%lower)//' to '//place(self%upper)//' m; allowed: seeds in m, before '// &
                        'the angles')
   contains
      function place(x) result(text)
         real(wp), intent(in) :: x(3)
         character(len=:), allocatable :: text
         text = '('//to_text(x(1), 3)//', '//to_text(x(2), 3)//', '//to_text(x(3), 3)//')'
      end function place
   end subroutine check_distances

   pure integer function size_of(list)
      real(wp), allocatable, intent(in) :: list(:)
      size_of = 0
      if (allocated(list)) size_of = size(list)
   end function size_of

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

   !> What is not given is left to chance: seeds all over the box, orientations all alike likely (Shoemake
   !> 1992: here as Euler angles, phi1 and phi2 uniform and Phi by its cosine).
   subroutine draw(self)
      class(grains_t), intent(inout) :: self
      integer(i8) :: state
      integer :: i
      state = stirred(int(self%seed, i8))
      if (.not. (allocated(self%positions) .or. allocated(self%voxels))) then
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

   !> Number and orientation of the grain that each particle is in.
   subroutine initialise(self, particles, table, layout, grid)
      class(grains_t), intent(in) :: self
      type(particle_store_t), intent(inout) :: particles
      type(field_table_t), intent(in) :: table
      type(layout_t), intent(in) :: layout
      type(grid_level_t), intent(in) :: grid
      real(wp) :: x(3), q(4)
      integer :: first, found, p
      if (layout%orientation == 0) return
      first = table%column('first_orientation')
      do p = 1, particles%count
         x = particles%column(p, layout%position:layout%position + 2)
         if (any(x < self%lower .or. x > self%upper)) cycle
         found = self%grain_at(x)
         if (found == 0) cycle
         q = from_euler(pi/180.0_wp*self%orientations(3*found - 2:3*found))
         particles%column(p, layout%orientation:layout%orientation + 3) = q
         if (first > 0) particles%column(p, first:first + 3) = q
         particles%column(p, self%grain) = found
      end do
   end subroutine initialise

   !> Number of the grain at a place in the box (m): of the voxel, or of the nearest seed, of two as near that
   !> with the lower number.
   pure integer function grain_at(self, x) result(found)
      class(grains_t), intent(in) :: self
      real(wp), intent(in) :: x(3)
      real(wp) :: nearest, distance
      integer :: at(3), g
      if (allocated(self%voxels)) then
         at = 1 + int((x - self%lower)/(self%upper - self%lower)*shape(self%voxels))
         at = min(at, shape(self%voxels))
         found = self%voxels(at(1), at(2), at(3))
         return
      end if
      nearest = huge(nearest)
      found = 0
      do g = 1, self%count
         distance = sum((x - self%positions(3*g - 2:3*g))**2)
         if (distance >= nearest) cycle
         nearest = distance
         found = g
      end do
   end function grain_at

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
