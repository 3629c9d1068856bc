!> A shape from a file: a closed surface of triangles (STL, OBJ), or heights on a grid.
module m_file_shape
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use mpi_f08
   use m_kinds, only: wp
   use m_constants, only: pi
   use m_checksum, only: text_checksum
   use m_communicator, only: communicator_t
   use m_filesystem, only: read_file, is_directory, never_ends, system_reason
   use m_group_reader, only: group_reader_t
   use m_text, only: to_text
   use m_value_range, only: any_value, above
   use m_shape, only: shape_t
   use m_triangles, only: triangles_t, weld, weld_near
   use m_surface_file, only: read_surface
   use m_height_field, only: close_heights
   use m_height_checks, only: doubt_heights
   use m_height_file, only: is_hdf5, read_height_file
   use m_height_map, only: height_map_t, agree_on, first_row_words
   use m_self_overlap, only: look_for_overlap
   use m_closed_surface, only: closed_surface_t
   implicit none
   private
   public :: file_shape_t

   integer, parameter :: longest_path = 1000
   integer, parameter :: max_bytes = 1000000000
   real(wp), parameter :: max_overlap = 1.0e-3_wp !< tolerated share of the volume inside: scans have overlaps
   real(wp), parameter :: round_off = 1.0e-6_wp !< of the largest extent: six digits of a text, or single
                                                !< precision away from the origin
   integer, parameter :: piece = 1048576 !< bytes of a file per partial checksum

   type, extends(shape_t) :: file_shape_t
      character(len=:), allocatable :: file
      real(wp) :: scale = 1.0_wp              !< m, unit of the file
      real(wp) :: rotation(3) = 0.0_wp        !< about x, then y, then z, degrees
      real(wp) :: origin(3) = 0.0_wp          !< for a body: position of the file's origin, m
      real(wp) :: spacing(2) = 0.0_wp         !< of heights along x and y, m; 0: not given, or triangles
      integer :: first_row = 0                !< position of the first row of heights; 0: not given
      logical :: is_map = .false.             !< heights, not triangles
      logical :: scale_is_given = .false.
      real(wp) :: joined = 0.0_wp             !< corners so near to each other were joined, m
      character(len=:), allocatable :: checksum !< of the file; empty: unknown
      type(closed_surface_t), pointer :: inside_of => null() !< rotated and scaled; shared by copies and never
                                                             !< changed
   contains
      procedure :: variables
      procedure :: load
      procedure :: file_name
      procedure :: distance_and_normal
      procedure :: distance_within
      procedure :: sheets
      procedure :: sheet_within
      procedure :: distance_of_sheet
      procedure :: min_distance
      procedure :: max_distance
      procedure :: is_searched
      procedure :: bounding_box
      procedure :: reach
      procedure :: volume
      procedure :: lattice_origin
      procedure :: place_name
   end type file_shape_t

contains

   subroutine variables(self, group)
      class(file_shape_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      if (.not. allocated(self%file)) self%file = ''
      if (.not. allocated(self%checksum)) self%checksum = ''
      call group%get_text('file', self%file, longest_path, required=.true.)
      call group%get('scale', self%scale, above(0.0_wp, 'm'))
      call group%get('rotation', self%rotation, any_value('degrees'))
      if (.not. self%of_tool) call group%get('origin', self%origin, any_value('m'))
      if (.not. group%is_writing() .or. any(self%spacing > 0.0_wp)) &
         call group%get('spacing', self%spacing, above(0.0_wp, 'm'))
      if (.not. group%is_writing() .or. self%first_row > 0) &
         call group%get_choice('first_row', self%first_row, first_row_words)
      if (group%is_reading()) self%scale_is_given = group%is_given('scale')
      if (.not. group%is_writing() .or. self%checksum /= '') &
         call group%get_text('checksum', self%checksum, longest_path)
   end subroutine variables

   !> Collective: rank 0 reads the file, all ranks build its surface. An error if the file's checksum is not
   !> the one in the scene: the file was changed.
   subroutine load(self, communicator, fault)
      class(file_shape_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      character(len=:), allocatable, intent(inout) :: fault
      character(len=:), allocatable :: bytes, digits
      real(wp), allocatable :: place(:, :)
      integer, allocatable :: of(:, :)
      type(height_map_t) :: map
      type(triangles_t) :: triangles
      fault = ''
      bytes = ''
      if (communicator%is_root()) call read_bytes(self%file, bytes, fault)
      call communicator%broadcast_text(fault, 0)
      if (fault /= '') return
      call communicator%broadcast_text(bytes, 0)
      digits = checksum_of(bytes)
      if (self%checksum /= '' .and. self%checksum /= digits) then
         fault = 'has been changed: its checksum is '//digits//', the scene was made with '//self%checksum
         return
      end if
      self%checksum = digits
      if (is_hdf5(bytes)) then
         self%is_map = .true.
         call share_heights(communicator, self%file, len(bytes), map, fault)
      else
         call read_surface(bytes, self%is_map, place, of, map, fault)
      end if
      if (fault == '' .and. self%is_map) then
         call agree_on(map, self%spacing, self%scale, self%scale_is_given, self%first_row, fault)
         if (fault == '') call close_up_heights(map%height, self%spacing, self%scale, place, of, fault)
      else if (fault == '' .and. any(self%spacing > 0.0_wp)) then
         fault = 'holds triangles, for which spacing is not used; leave it out'
      else if (fault == '' .and. self%first_row > 0) then
         fault = 'holds triangles, for which first_row is not used; leave it out'
      end if
      if (fault /= '') return
      deallocate (bytes)
      call weld(place, of)
      call close_up_corners(self, place, of, triangles, fault)
      if (fault == '' .and. .not. self%is_map) call check_overlap(triangles, fault)
      if (fault /= '') return
      allocate (self%inside_of) ! the old target belongs to copies
      call self%inside_of%build(triangles)
      if (self%of_tool) call self%inside_of%divide()
   end subroutine load

   !> A closed surface of welded corners. Corners whose round-off leaves gaps are joined.
   subroutine close_up_corners(self, place, of, triangles, fault)
      class(file_shape_t), intent(inout) :: self
      real(wp), allocatable, intent(inout) :: place(:, :)
      integer, allocatable, intent(inout) :: of(:, :)
      type(triangles_t), intent(out) :: triangles
      character(len=:), allocatable, intent(inout) :: fault
      type(triangles_t) :: joined
      character(len=:), allocatable :: still
      integer :: before
      triangles%of = of
      triangles%corner = placed(self, place)
      call triangles%close_up(fault)
      self%joined = 0.0_wp
      if (fault == '' .or. self%is_map .or. size(of) == 0) return
      before = size(place, 2)
      self%joined = self%scale*round_off*max(maxval(maxval(place, dim=2) - minval(place, dim=2)), &
                                             maxval(abs(place)))
      call weld_near(place, of, self%joined/self%scale)
      if (size(place, 2) == before) return
      joined%of = of
      joined%corner = placed(self, place)
      call joined%close_up(still)
      if (still /= '') return
      fault = ''
      triangles = joined
   end subroutine close_up_corners

   !> All bytes of a file.
   subroutine read_bytes(path, bytes, fault)
      character(len=*), intent(in) :: path
      character(len=:), allocatable, intent(out) :: bytes
      character(len=:), allocatable, intent(inout) :: fault
      logical :: good
      bytes = ''
      if (is_directory(path)) then
         fault = 'is a directory; allowed: an STL or OBJ file, or heights'
      else if (never_ends(path)) then
         fault = 'is a pipe or a device; allowed: a file on the disk'
      end if
      if (fault /= '') return
      call read_file(path, max_bytes, bytes, good)
      if (.not. good) then
         fault = 'cannot be read: '//system_reason()
      else if (len(bytes) > max_bytes) then
         fault = 'is longer than '//to_text(max_bytes)//' bytes'
      else if (len(bytes) == 0) then
         fault = 'is empty'
      end if
   end subroutine read_bytes

   !> Checksum of the checksums of the pieces: the bytes summed at once are copied.
   pure function checksum_of(bytes) result(digits)
      character(len=*), intent(in) :: bytes
      character(len=:), allocatable :: digits
      integer :: first
      digits = ''
      do first = 1, len(bytes), piece
         digits = digits//text_checksum(bytes(first:min(len(bytes), first + piece - 1)))
      end do
      digits = text_checksum(digits)
   end function checksum_of

   !> Collective: heights read by rank 0 from an HDF5 file.
   subroutine share_heights(communicator, path, bytes, map, fault)
      type(communicator_t), intent(in) :: communicator
      character(len=*), intent(in) :: path
      integer, intent(in) :: bytes !< of the file
      type(height_map_t), intent(out) :: map
      character(len=:), allocatable, intent(inout) :: fault
      integer :: extent(2), first_row
      real(wp) :: said(3)
      if (communicator%is_root()) call read_height_file(path, bytes, map, fault)
      call communicator%broadcast_text(fault, 0)
      if (fault /= '') return
      said = [map%spacing, map%scale]
      first_row = map%first_row
      if (communicator%is_root()) extent = shape(map%height)
      call MPI_Bcast(extent, 2, MPI_INTEGER, 0, communicator%comm)
      call MPI_Bcast(first_row, 1, MPI_INTEGER, 0, communicator%comm)
      call MPI_Bcast(said, 3, MPI_DOUBLE_PRECISION, 0, communicator%comm)
      if (.not. communicator%is_root()) allocate (map%height(extent(1), extent(2)))
      call MPI_Bcast(map%height, size(map%height), MPI_DOUBLE_PRECISION, 0, communicator%comm)
      map%spacing = said(1:2)
      map%spacing_in_m = said(1) > 0.0_wp
      map%scale = said(3)
      map%first_row = first_row
   end subroutine share_heights

   !> Corners and triangles from heights, in m. Heights must be finite, and their spacing known.
   subroutine close_up_heights(height, spacing, scale, place, of, fault)
      real(wp), intent(in) :: height(:, :), spacing(2), scale
      real(wp), allocatable, intent(out) :: place(:, :)
      integer, allocatable, intent(out) :: of(:, :)
      character(len=:), allocatable, intent(inout) :: fault
      if (.not. all(ieee_is_finite(height))) then
         fault = 'holds heights that are not finite numbers'
      else if (.not. all(spacing > 0.0_wp)) then
         fault = 'holds heights; spacing must be given with them, along x and y in m'
      else if (any(shape(height) < 2)) then
         fault = 'holds '//to_text(size(height, 1))//' by '//to_text(size(height, 2))// &
                 ' heights; allowed: at least 2 by 2'
      else
         call doubt_heights(height, spacing, scale, fault)
         if (fault == '') call close_heights(scale*height, spacing, place, of)
      end if
   end subroutine close_up_heights

   !> Check that no part of a surface lies inside another one, except as a hollow.
   subroutine check_overlap(triangles, fault)
      type(triangles_t), intent(in) :: triangles
      character(len=:), allocatable, intent(inout) :: fault
      real(wp) :: inside, wrong
      call look_for_overlap(triangles, inside, wrong)
      if (wrong <= max_overlap*inside) return
      fault = 'overlaps itself: of the '//to_text(inside, 3)//' m3 inside it '//to_text(wrong, 3)// &
              ' m3 are inside twice or in a part that is inside out; allowed: parts that do not cut each '// &
              'other, and one in another only as a hollow, whose triangles look inwards; '// &
              'make the union of the parts'
   end subroutine check_overlap

   !> Positions of the file's corners in the scene: scaled (heights already are), rotated about x, then y,
   !> then z, and moved.
   pure function placed(self, place) result(there)
      class(file_shape_t), intent(in) :: self
      real(wp), intent(in) :: place(:, :)
      real(wp) :: there(3, size(place, 2))
      real(wp) :: turn(3, 3), c, s, factor
      integer :: axis, n, before, after
      factor = self%scale
      if (self%is_map) factor = 1.0_wp ! in m already
      turn = reshape([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [3, 3])
      do axis = 1, 3
         c = cosine(self%rotation(axis))
         s = cosine(self%rotation(axis) - 90.0_wp)
         before = 1 + mod(axis, 3)
         after = 1 + mod(axis + 1, 3)
         turn([before, after], :) = matmul(reshape([c, s, -s, c], [2, 2]), turn([before, after], :))
      end do
      do n = 1, size(place, 2)
         there(:, n) = self%origin + matmul(turn, factor*place(:, n))
      end do
   end function placed

   !> Cosine of an angle in degrees; exact at right angles, so that faces along the grid stay there.
   pure real(wp) function cosine(degrees)
      real(wp), intent(in) :: degrees
      real(wp) :: quarters
      quarters = degrees/90.0_wp
      cosine = cos(degrees*(pi/180.0_wp))
      if (abs(quarters - anint(quarters)) <= 0.0_wp) cosine = real(nint(cosine), wp)
   end function cosine

   !> The file name, as in the scene.
   pure function file_name(self) result(name)
      class(file_shape_t), intent(in) :: self
      character(len=:), allocatable :: name
      name = self%file
   end function file_name

   pure subroutine distance_and_normal(self, place, distance, normal)
      class(file_shape_t), intent(in) :: self
      real(wp), intent(in) :: place(3)
      real(wp), intent(out) :: distance, normal(3)
      call self%inside_of%distance_and_normal(place, distance, normal)
   end subroutine distance_and_normal

   pure subroutine distance_within(self, place, limit, distance, normal)
      class(file_shape_t), intent(in) :: self
      real(wp), intent(in) :: place(3), limit
      real(wp), intent(out) :: distance, normal(3)
      call self%inside_of%distance_within(place, limit, distance, normal)
   end subroutine distance_within

   pure integer function sheets(self)
      class(file_shape_t), intent(in) :: self
      sheets = self%inside_of%sheets%count
   end function sheets

   pure subroutine sheet_within(self, place, limit, sheet, distance, normal)
      class(file_shape_t), intent(in) :: self
      real(wp), intent(in) :: place(3), limit
      integer, intent(in) :: sheet
      real(wp), intent(out) :: distance, normal(3)
      call self%inside_of%sheet_within(place, limit, sheet, distance, normal)
   end subroutine sheet_within

   pure subroutine distance_of_sheet(self, place, sheet, distance, normal)
      class(file_shape_t), intent(in) :: self
      real(wp), intent(in) :: place(3)
      integer, intent(in) :: sheet
      real(wp), intent(out) :: distance, normal(3)
      call self%inside_of%distance_of_sheet(place, sheet, distance, normal)
   end subroutine distance_of_sheet

   pure real(wp) function min_distance(self, place)
      class(file_shape_t), intent(in) :: self
      real(wp), intent(in) :: place(3)
      min_distance = self%inside_of%min_distance(place)
   end function min_distance

   pure real(wp) function max_distance(self, place)
      class(file_shape_t), intent(in) :: self
      real(wp), intent(in) :: place(3)
      max_distance = self%inside_of%max_distance(place)
   end function max_distance

   pure logical function is_searched(self)
      class(file_shape_t), intent(in) :: self
      is_searched = .true.
   end function is_searched

   pure subroutine bounding_box(self, lower, upper)
      class(file_shape_t), intent(in) :: self
      real(wp), intent(out) :: lower(3), upper(3)
      lower = self%inside_of%lower
      upper = self%inside_of%upper
   end subroutine bounding_box

   !> From its corners: no point of a triangle is further away.
   pure real(wp) function reach(self, place, axis)
      class(file_shape_t), intent(in) :: self
      real(wp), intent(in) :: place(3)
      real(wp), intent(in), optional :: axis(3)
      real(wp) :: way(3)
      integer :: c
      reach = 0.0_wp
      do c = 1, size(self%inside_of%triangles%corner, 2)
         way = self%inside_of%triangles%corner(:, c) - place
         if (present(axis)) way = way - dot_product(way, axis)*axis
         reach = max(reach, norm2(way))
      end do
   end function reach

   pure real(wp) function volume(self)
      class(file_shape_t), intent(in) :: self
      volume = self%inside_of%triangles%volume()
   end function volume

   pure function lattice_origin(self) result(origin)
      class(file_shape_t), intent(in) :: self
      real(wp) :: origin(3)
      origin = self%origin
   end function lattice_origin

   pure function place_name(self, down) result(name)
      class(file_shape_t), intent(in) :: self
      logical, intent(in) :: down
      character(len=:), allocatable :: name
      name = 'origin'
   end function place_name

end module m_file_shape
