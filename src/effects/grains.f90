!> A polycrystal: each particle in a box gets the orientation of the nearest seed (Voronoi cells), or of its
!> voxel. The lattice of particles continues across grain boundaries (theory.md, eq. grains). It acts only at
!> the start.
module m_grains
   use m_kinds, only: wp, i4, i8
   use m_constants, only: exit_input, pi
   use m_errors, only: error_t, fail
   use m_communicator, only: communicator_t
   use m_field_table, only: field_table_t, layout_t
   use m_grain_file, only: read_grain_file
   use m_grain_list, only: grain_list_t
   use m_grid_level, only: grid_level_t
   use m_group_reader, only: group_reader_t
   use m_level, only: level_t
   use m_orientations, only: angle_words, numbers_of, same_kind, name_of_kind, forms_of_kind, &
      turn_into_bunge, bunge_degrees
   use m_particle_store, only: particle_store_t
   use m_rotations, only: from_euler
   use m_text, only: to_text
   use m_value_range, only: any_value, at_least
   use m_words, only: joined
   use m_effect, only: effect_t, hooks_t
   implicit none
   private
   public :: grains_t

   integer, parameter :: longest_path = 1000 !< characters
   real(wp), parameter :: alike = 0.01_wp !< relative tolerance of the proportions of file and box
   real(wp), parameter :: min_small = 0.75_wp !< numbers are not in degrees if more than this share is at most
                                              !< 2 pi
   integer, parameter :: enough = 4 !< this many grains would include an angle above 2 pi, if in degrees
   real(wp), parameter :: max_separation = 1000.0_wp !< largest distance between seeds, in widths of the box
   integer(i8), parameter :: prime = 2147483647_i8 !< 2^31 - 1

   type, extends(effect_t) :: grains_t
      real(wp) :: lower(3) = 0.0_wp, upper(3) = 0.0_wp !< the box, m
      integer :: count = 0                             !< number of grains
      integer :: seed = 1                              !< of the random numbers
      real(wp), allocatable :: positions(:)    !< of the seeds, m: x y z of each
      real(wp), allocatable :: weights(:)      !< of the seeds, m: weights of a Laguerre tessellation
      real(wp), allocatable :: orientations(:) !< Euler angles phi1 Phi phi2 of each, degrees
      integer :: angles = 0                    !< form of the orientations, of `angle_words`; 0: not given
      integer(i4), allocatable :: voxels(:, :, :) !< number of the grain, x fastest, over the whole box; 0:
                                                  !< none
      character(len=:), allocatable :: file, checksum !< of the voxels
      integer :: grain = 0                     !< column of the number of the grain
   contains
      procedure :: variables
      procedure :: declare
      procedure :: hooks
      procedure :: initialise
      procedure :: verify
      procedure, private :: take_file
      procedure, private :: fit_into_box
      procedure, private :: take_angles
      procedure, private :: check_distances
      procedure, private :: grain_at
      procedure, private :: draw
   end type grains_t

contains

   !> Data read from a file are written as lists, so that case.nml needs no file; except voxels.
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
         if (allocated(self%weights) .or. .not. group%is_writing()) &
            call group%get_list('weights', self%weights, at_least(0.0_wp, 'm'))
         call group%get_list('orientations', self%orientations, any_value(''))
      end if
      if (.not. group%is_writing() .or. self%angles > 0) &
         call group%get_choice('angles', self%angles, angle_words)
      if (self%file /= '' .and. (group%is_given('positions') .or. group%is_given('orientations'))) then
         call group%refuse('file', 'not together with positions or orientations, which the file gives')
      else if (self%file /= '' .and. group%is_reading()) then
         call self%take_file(group)
      else if (group%is_reading()) then
         call self%take_angles(group, 'orientations', 0)
      end if
      if (group%is_reading()) call self%check_distances(group)
      if (mod(size_of(self%positions), 3) /= 0) &
         call group%refuse('positions', 'must be three numbers a grain')
      if (allocated(self%positions) .and. allocated(self%orientations)) then
         if (size(self%positions) /= size(self%orientations)) &
            call group%refuse('orientations', 'must be as many as positions')
      end if
      if (allocated(self%weights)) then
         if (3*size(self%weights) /= size_of(self%positions)) &
            call group%refuse('weights', 'must be one for each of the positions')
      end if
      grains = max(size_of(self%orientations), size_of(self%positions))/3
      if (grains == 0 .and. allocated(self%voxels)) grains = maxval(self%voxels)
      call group%get('count', self%count, least=1, required=grains == 0)
      if (grains > 0 .and. self%count == 0) self%count = grains
      if (grains > 0 .and. self%count /= grains) &
         call group%refuse('count', 'must be absent, or the number of grains that are given, '// &
                           to_text(grains))
      call group%get('seed', self%seed, least=0)
   end subroutine variables

   !> Read the file; its name is kept if it has voxels only.
   subroutine take_file(self, group)
      class(grains_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      type(grain_list_t) :: found
      character(len=:), allocatable :: fault, checksum
      call read_grain_file(self%file, found, checksum, fault)
      if (fault == '' .and. self%checksum /= '' .and. self%checksum /= checksum) &
         fault = 'has been changed: its checksum is '//checksum//', the scene was made with '//self%checksum
      if (fault == '') call self%fit_into_box(found, fault)
      if (fault == '') call check_form(found, self%angles, fault)
      if (fault == '') call check_names(found, self%angles, fault)
      if (fault /= '') then
         call group%refuse('file', fault)
         return
      end if
      if (allocated(found%orientations)) call move_alloc(found%orientations, self%orientations)
      if (allocated(found%positions)) call move_alloc(found%positions, self%positions)
      if (allocated(found%weights)) call move_alloc(found%weights, self%weights)
      self%checksum = checksum
      call self%take_angles(group, 'file', found%form, found%numbers)
      if (allocated(found%voxels)) then
         call move_alloc(found%voxels, self%voxels)
      else
         self%file = ''
         self%checksum = ''
         if (allocated(self%orientations)) self%angles = bunge_degrees ! as written
      end if
   end subroutine take_file

   !> Scale data in a file's own unit to the box, which must have the same proportions.
   subroutine fit_into_box(self, found, fault)
      class(grains_t), intent(in) :: self
      type(grain_list_t), intent(inout) :: found
      character(len=:), allocatable, intent(inout) :: fault
      real(wp) :: factor(3), middle
      integer :: axis
      if (all(found%size <= 0.0_wp)) return
      factor = -1.0_wp ! undetermined
      where (found%size > 0.0_wp) factor = (self%upper - self%lower)/found%size
      middle = sum(factor, mask=factor > 0.0_wp)/count(factor > 0.0_wp)
      if (any(factor > 0.0_wp .and. abs(factor - middle) > alike*middle)) then
         fault = 'has the extents '//text_of(found%size)//' in its unit, and the box '// &
                 text_of(self%upper - self%lower)//' m; allowed: a box of the same proportions'
      else if (allocated(found%positions)) then
         do axis = 1, 3
            found%positions(axis::3) = self%lower(axis) + (found%positions(axis::3) - found%lower(axis)) &
                                       *factor(axis)
         end do
         if (allocated(found%weights)) found%weights = middle*found%weights
      end if
   contains
      function text_of(x) result(text)
         real(wp), intent(in) :: x(3)
         character(len=:), allocatable :: text
         text = to_text(x(1), 4)//' x '//to_text(x(2), 4)//' x '//to_text(x(3), 4)
      end function text_of
   end subroutine fit_into_box

   !> The form of orientations given in the scene must be that of the file, if the file gives it.
   subroutine check_form(found, form, fault)
      type(grain_list_t), intent(in) :: found
      integer, intent(in) :: form !< as given in the scene; 0: not given
      character(len=:), allocatable, intent(inout) :: fault
      if (.not. allocated(found%orientations)) return
      if (allocated(found%unclear)) then
         if (form > 0 .and. numbers_of(form) == found%numbers) return
         fault = 'has its orientations as '''//found%unclear// &
                 ''', which Neper up to 4.9 and from 4.10 on writes for '// &
                 'opposite rotations; allowed: with angles, such as '''// &
                 trim(angle_words(found%form))//''', which is active up to 4.9'
      else if (found%form > 0 .and. form > 0 .and. form /= found%form .and. form + 2 /= found%form) then
         fault = 'has its orientations as '''//trim(angle_words(found%form))//''', and angles is '''// &
                 trim(angle_words(form))//'''; allowed: without angles' ! degrees are bunge_degrees
      end if
   end subroutine check_form

   !> The form given in the scene must be of the kind that the file's columns are named for. Only for Euler
   !> angles it may be absent: Rodrigues vectors, quaternions and matrices are written for opposite rotations.
   subroutine check_names(found, form, fault)
      type(grain_list_t), intent(in) :: found
      integer, intent(in) :: form !< as given in the scene; 0: not given
      character(len=:), allocatable, intent(inout) :: fault
      if (found%named == 0) return
      if (form == 0 .and. same_kind(found%named, bunge_degrees)) return
      if (form > 0) then
         if (same_kind(found%named, form)) return
         fault = 'names columns of '//name_of_kind(found%named)//', and angles is '''// &
                 trim(angle_words(form))//''', '//name_of_kind(form)
      else
         fault = 'names columns of '//name_of_kind(found%named)//', and not which rotation they describe'
      end if
      fault = fault//'; allowed: with angles, one of '//joined(forms_of_kind(found%named))
   end subroutine check_names

   !> Convert orientations to Bunge's angles in degrees. If their form is not given, and no number is above 2
   !> pi, the form is required.
   subroutine take_angles(self, group, name, form_of_file, numbers)
      class(grains_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      character(len=*), intent(in) :: name         !< of the variable with the orientations
      integer, intent(in) :: form_of_file          !< 0: not given
      integer, intent(in), optional :: numbers     !< per orientation
      character(len=:), allocatable :: fault
      real(wp), allocatable :: angles(:)
      integer :: form, given
      if (size_of(self%orientations) == 0) return
      form = self%angles
      if (form == 0) form = form_of_file
      given = 3
      if (form > 0) given = numbers_of(form)
      if (present(numbers)) given = numbers
      if (form == 0) call doubt_degrees(self%orientations, given, fault)
      if (form == 0 .and. fault /= '') then
         call group%refuse(name, fault//'; allowed: with angles, one of '//joined(angle_words(3:)))
         return
      end if
      if (form == 0) form = bunge_degrees
      if (numbers_of(form) /= given .or. mod(size(self%orientations), given) /= 0) then
         call group%refuse(name, 'must be '//to_text(numbers_of(form))//' numbers a grain with angles='''// &
                           trim(angle_words(form))//'''')
         return
      end if
      call turn_into_bunge(form, self%orientations, angles, fault)
      if (fault /= '') then
         call group%refuse(name, fault)
         return
      end if
      call move_alloc(angles, self%orientations)
      if (self%file == '' .and. self%angles > 0) self%angles = bunge_degrees ! as written
   end subroutine take_angles

   !> Reason why numbers without a given form may not be angles in degrees; empty: plausible.
   subroutine doubt_degrees(numbers, given, why)
      real(wp), intent(in) :: numbers(:)
      integer, intent(in) :: given !< numbers per orientation
      character(len=:), allocatable, intent(out) :: why
      integer :: small, large
      why = ''
      small = count(abs(numbers) > 0.0_wp .and. abs(numbers) <= 2.0_wp*pi)
      large = count(abs(numbers) > 2.0_wp*pi)
      if (given /= 3) then
         why = 'each orientation is '//to_text(given)//' numbers'
      else if (size(numbers) < 3*enough .or. small < min_small*(small + large) .or. small == 0) then
         return
      else if (large == 0) then
         why = 'no angle is above 6.28 in size, which suggests radians or Rodrigues vectors'
      else
         why = 'of '//to_text(small + large)//' angles that are not 0 only '//to_text(large)// &
               ' are above 6.28 in size, which suggests Rodrigues vectors'
      end if
   end subroutine doubt_degrees

   !> Check seeds: if all are far apart compared with the box, or all at one point, they are not positions in
   !> m.
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

   !> Field with the number of the grain, 0 outside the box.
   subroutine declare(self, table)
      class(grains_t), intent(inout) :: self
      type(field_table_t), intent(inout) :: table
      call table%declare('grain', 1, '1', written=.true.)
      self%grain = table%column('grain')
      call self%draw()
   end subroutine declare

   !> No action during steps.
   pure type(hooks_t) function hooks(self)
      class(grains_t), intent(in) :: self
      hooks = hooks_t()
   end function hooks

   !> Random values for what is not given: seeds uniform in the box, orientations uniform (Shoemake 1992: as
   !> Euler angles, phi1 and phi2 uniform and Phi by its cosine).
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

   !> A pseudo-random number in [0, 1), the same with every compiler.
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

   !> Set number and orientation of each particle's grain.
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

   !> Number of the grain at a point in the box (m): of its voxel, or of the nearest seed (of equally near
   !> ones the lower number); with weights the seed of least power (Laguerre cells).
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
         if (allocated(self%weights)) distance = distance - self%weights(g)**2
         if (distance >= nearest) cycle
         nearest = distance
         found = g
      end do
   end function grain_at

   !> At least one material must have axes.
   subroutine verify(self, communicator, levels, tools, error)
      class(grains_t), intent(in) :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(in) :: levels(:)
      integer, intent(in) :: tools
      type(error_t), intent(inout) :: error
      if (levels(1)%layout%orientation == 0) &
         call fail(error, exit_input, self%group_text()//': no material is anisotropic, so orientations '// &
            'have no effect; allowed: with model=''crystal'', ''cubic'' or ''orthotropic''')
   end subroutine verify

end module m_grains
