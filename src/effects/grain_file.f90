!> Grains from a file: a text of lines `phi1 Phi phi2` or `x y z phi1 Phi phi2`, a grain each, or HDF5 with
!> the datasets `orientations` and, where they are known, `positions` of seeds or the number `grain` of each
!> voxel.
module m_grain_file
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use hdf5
   use m_kinds, only: wp, i4, i8
   use m_checksum, only: text_checksum
   use m_filesystem, only: read_file, never_ends
   use m_number_text, only: find_decimal_comma
   use m_text, only: to_text
   implicit none
   private

   !> What a file says; lists that it does not have are not allocated.
   type, public :: grain_file_t
      real(wp), allocatable :: orientations(:)    !< Euler angles phi1 Phi phi2 of each grain, degrees
      real(wp), allocatable :: positions(:)       !< x y z of each seed, m
      integer(i4), allocatable :: voxels(:, :, :) !< number of the grain, x fastest; 0: none
      character(len=:), allocatable :: checksum   !< of the file's bytes
   contains
      procedure :: read => read_grain_file
      procedure, private :: read_text
      procedure, private :: read_hdf5
      procedure, private :: check
   end type grain_file_t

   integer, parameter :: longest_text = 64*1024*1024          !< bytes
   integer, parameter :: longest_hdf5 = 2*1024*1024*1024 - 1024 !< bytes
   character(len=*), parameter :: form = &
      'orientations (grains, 3) and positions (grains, 3) or grain (along z, y, x)'
   integer(i8), parameter :: max_values = 2_i8**28           !< of a dataset

contains

   !> Read a file. `fault` says what is wrong, as what follows its name; empty: nothing.
   subroutine read_grain_file(self, path, fault)
      class(grain_file_t), intent(out) :: self
      character(len=*), intent(in) :: path
      character(len=:), allocatable, intent(out) :: fault
      character(len=:), allocatable :: bytes
      logical :: ok
      if (never_ends(path)) then
         fault = 'is a pipe or a device; allowed: a file on the disk'
         return
      end if
      call read_file(path, longest_hdf5, bytes, ok)
      if (.not. ok) then
         fault = 'cannot be read; allowed: HDF5, or a text file of lines phi1 Phi phi2 or x y z phi1 Phi phi2'
         return
      end if
      self%checksum = text_checksum(bytes)
      if (index(bytes, achar(137)//'HDF'//achar(13)//achar(10)) == 1) then
         call self%read_hdf5(path, fault)
         if (fault == '') call self%check(fault)
      else if (len(bytes) > longest_text) then
         fault = 'is a text longer than '//to_text(longest_text)//' bytes'
      else
         call self%read_text(bytes, fault)
      end if
   end subroutine read_grain_file

   !> A line a grain; what follows # or ! is not read.
   subroutine read_text(self, text, fault)
      class(grain_file_t), intent(inout) :: self
      character(len=*), intent(in) :: text
      character(len=:), allocatable, intent(out) :: fault
      character(len=:), allocatable :: line
      real(wp), allocatable :: rows(:), row(:)
      integer :: at, end, number, width, first, last
      logical :: ok
      fault = ''
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
         call find_decimal_comma(line(:scan(line//'#', '#!') - 1), first, last)
         if (first > 0) then
            fault = 'line '//to_text(number)//': '''//line(first:last)// &
                    ''' has a decimal comma; allowed: decimal points'
            return
         end if
         call read_row(line, row, ok)
         if (ok .and. size(row) == 0) cycle
         if (width == 0) width = size(row)
         if (.not. ok .or. size(row) /= width .or. .not. any(width == [3, 6])) then
            fault = 'line '//to_text(number)// &
                    ' of it must be 3 angles, or 3 coordinates and 3 angles, as in all its lines'
            return
         end if
         rows = [rows, row]
      end do
      if (size(rows) == 0) fault = 'has no grains; allowed: a line each'
      if (fault /= '') return
      associate (table => reshape(rows, [width, size(rows)/width]))
         self%orientations = reshape(table(width - 2:, :), [3*size(table, 2)])
         if (width == 6) self%positions = reshape(table(:3, :), [3*size(table, 2)])
      end associate
   end subroutine read_text

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
      ok = verify(content, ' 0123456789+-.eEdD') == 0 ! a list-directed READ takes more
      status = 0
      if (ok .and. n > 0) read (content, *, iostat=status) values(:n)
      ok = ok .and. status == 0
      if (ok) ok = all(abs(values(:n)) <= huge(1.0_wp))
      row = values(:n)
   end subroutine read_row

   !> The datasets of an HDF5 file, as C and Python count: `orientations` (grains, 3), `positions` (grains,
   !> 3), `grain` (along z, y, x).
   subroutine read_hdf5(self, path, fault)
      class(grain_file_t), intent(inout) :: self
      character(len=*), intent(in) :: path
      character(len=:), allocatable, intent(out) :: fault
      integer(hid_t) :: file, data
      integer(hsize_t), allocatable :: extent(:)
      integer :: ignored, status
      fault = 'is an HDF5 file that cannot be read'
      call h5open_f(status)
      call h5eset_auto_f(0, ignored)
      call h5fopen_f(path, H5F_ACC_RDONLY_F, file, status)
      if (status < 0) return
      fault = ''
      if (opened('orientations', 2)) then
         allocate (self%orientations(product(extent)))
         call h5dread_f(data, H5T_NATIVE_DOUBLE, self%orientations, extent, status)
         call done(extent(1) == 3)
      end if
      if (opened('positions', 2)) then
         allocate (self%positions(product(extent)))
         call h5dread_f(data, H5T_NATIVE_DOUBLE, self%positions, extent, status)
         call done(extent(1) == 3)
      end if
      if (opened('grain', 3)) then
         allocate (self%voxels(extent(1), extent(2), extent(3)))
         call h5dread_f(data, H5T_NATIVE_INTEGER, self%voxels, extent, status)
         call done(all(extent > 0))
      end if
      call h5fclose_f(file, ignored)
   contains
      !> Whether a dataset is there, with so many dimensions: `data` and `extent` are its.
      logical function opened(name, dimensions)
         character(len=*), intent(in) :: name
         integer, intent(in) :: dimensions
         integer(hid_t) :: space
         integer(hsize_t) :: most(dimensions)
         integer :: rank
         opened = .false.
         call h5dopen_f(file, name, data, status)
         if (status < 0) return
         call h5dget_space_f(data, space, status)
         call h5sget_simple_extent_ndims_f(space, rank, status)
         if (allocated(extent)) deallocate (extent)
         allocate (extent(dimensions), source=0_hsize_t)
         if (rank == dimensions) call h5sget_simple_extent_dims_f(space, extent, most, status)
         call h5sclose_f(space, ignored)
         opened = rank == dimensions .and. product(real(extent, wp)) <= real(max_values, wp)
         if (.not. opened) fault = 'has a dataset '''//name//''' of another form: '//form
         if (.not. opened) call h5dclose_f(data, ignored)
      end function opened

      subroutine done(good)
         logical, intent(in) :: good
         if (status < 0 .or. .not. good) fault = 'has a dataset of another form: '//form
         call h5dclose_f(data, ignored)
      end subroutine done
   end subroutine read_hdf5

   !> That what an HDF5 file says goes together.
   subroutine check(self, fault)
      class(grain_file_t), intent(in) :: self
      character(len=:), allocatable, intent(out) :: fault
      fault = ''
      if (.not. allocated(self%orientations)) then
         fault = 'has no dataset ''orientations''; allowed: '//form
      else if (size(self%orientations) == 0) then
         fault = 'has no grains; allowed: '//form
      else if (.not. all(ieee_is_finite(self%orientations))) then
         fault = 'holds orientations that are not finite numbers'
      end if
      if (fault /= '') return
      if (allocated(self%positions) .and. allocated(self%voxels)) then
         fault = 'has positions and voxels; allowed: one of both'
      else if (allocated(self%positions)) then
         if (.not. all(ieee_is_finite(self%positions))) fault = 'holds positions that are not finite numbers'
      else if (allocated(self%voxels)) then
         if (minval(self%voxels) < 0 .or. maxval(self%voxels) > size(self%orientations)/3) &
            fault = 'holds grains '//to_text(minval(self%voxels))//' to '//to_text(maxval(self%voxels))// &
                    '; allowed: 0, and 1 to the number of its orientations, '// &
                    to_text(size(self%orientations)/3)
      end if
   end subroutine check

end module m_grain_file
