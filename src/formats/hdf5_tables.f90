!> Datasets of users' HDF5 files, read by one rank alone. A damaged file may declare much more than it
!> contains: extents are checked against its size.
module m_hdf5_tables
   use hdf5
   use m_kinds, only: wp, i4
   implicit none
   private
   public :: open_tables, close_tables, extent_of, read_reals, read_integers, find_tables, read_attribute
   public :: is_of_matlab

   character(len=*), parameter, public :: of_matlab = 'is a file of MATLAB (save -v7.3), which stores '// &
      'arrays with their extents in reverse; allowed: HDF5 by h5create and h5write of '
   integer, parameter :: deepest = 8, longest_name = 512, max_found = 64, max_visits = 20000
   real(wp), parameter :: max_compression = 4000.0_wp !< values per byte

   type, public :: tables_t
      integer(hid_t) :: file = -1_hid_t
      real(wp) :: max_values = 0.0_wp !< limit per dataset
   end type tables_t

   !> The path of a dataset that was found.
   type, public :: table_name_t
      character(len=:), allocatable :: path
   end type table_name_t

contains

   subroutine open_tables(path, bytes, tables, ok)
      character(len=*), intent(in) :: path
      integer, intent(in) :: bytes !< of the file
      type(tables_t), intent(out) :: tables
      logical, intent(out) :: ok
      integer :: status, ignored
      call h5open_f(status)
      call h5eset_auto_f(0, ignored)
      call h5fopen_f(path, H5F_ACC_RDONLY_F, tables%file, status)
      tables%max_values = min(1.0e8_wp, max_compression*bytes)
      ok = status >= 0
   end subroutine open_tables

   subroutine close_tables(tables)
      type(tables_t), intent(in) :: tables
      integer :: ignored
      call h5fclose_f(tables%file, ignored)
   end subroutine close_tables

   !> True for a dataset that MATLAB saved: its extents are the reverse of those of the array.
   logical function is_of_matlab(file, name)
      integer(hid_t), intent(in) :: file
      character(len=*), intent(in) :: name
      integer :: status
      call h5aexists_by_name_f(file, name, 'MATLAB_class', is_of_matlab, status)
      is_of_matlab = is_of_matlab .and. status >= 0
   end function is_of_matlab

   !> The extents of a dataset, the fastest one first; none if it does not exist or is too large.
   function extent_of(tables, name) result(extent)
      type(tables_t), intent(in) :: tables
      character(len=*), intent(in) :: name
      integer, allocatable :: extent(:)
      integer(hid_t) :: data, space
      integer(hsize_t) :: dims(8), most(8)
      integer :: status, ignored, rank
      allocate (extent(0))
      call h5dopen_f(tables%file, name, data, status)
      if (status < 0) return
      call h5dget_space_f(data, space, status)
      rank = 0
      if (status >= 0) call h5sget_simple_extent_ndims_f(space, rank, status)
      if (rank >= 1 .and. rank <= 8) then
         call h5sget_simple_extent_dims_f(space, dims(:rank), most(:rank), status)
         if (product(real(dims(:rank), wp)) <= tables%max_values) extent = int(dims(:rank))
      end if
      call h5sclose_f(space, ignored)
      call h5dclose_f(data, ignored)
   end function extent_of

   !> All values of a dataset, the fastest extent first; not allocated if it cannot be read.
   subroutine read_reals(tables, name, values)
      type(tables_t), intent(in) :: tables
      character(len=*), intent(in) :: name
      real(wp), allocatable, intent(out) :: values(:)
      integer(hid_t) :: data
      integer, allocatable :: extent(:)
      integer :: status, ignored
      extent = extent_of(tables, name)
      if (size(extent) == 0) return
      allocate (values(product(extent)))
      call h5dopen_f(tables%file, name, data, status)
      call h5dread_f(data, H5T_NATIVE_DOUBLE, values, int(extent, hsize_t), status)
      call h5dclose_f(data, ignored)
      if (status < 0) deallocate (values)
   end subroutine read_reals

   subroutine read_integers(tables, name, values)
      type(tables_t), intent(in) :: tables
      character(len=*), intent(in) :: name
      integer(i4), allocatable, intent(out) :: values(:)
      integer(hid_t) :: data
      integer, allocatable :: extent(:)
      integer :: status, ignored
      extent = extent_of(tables, name)
      if (size(extent) == 0) return
      allocate (values(product(extent)))
      call h5dopen_f(tables%file, name, data, status)
      call h5dread_f(data, H5T_NATIVE_INTEGER, values, int(extent, hsize_t), status)
      call h5dclose_f(data, ignored)
      if (status < 0) deallocate (values)
   end subroutine read_integers

   !> Three numbers of an attribute of a group; zeros if there are none.
   function read_attribute(tables, group, name) result(values)
      type(tables_t), intent(in) :: tables
      character(len=*), intent(in) :: group, name
      real(wp) :: values(3)
      integer(hid_t) :: attribute, space
      integer(hsize_t) :: points
      integer :: status, ignored
      logical :: there
      values = 0.0_wp
      call h5aexists_by_name_f(tables%file, group, name, there, status)
      if (status < 0 .or. .not. there) return
      call h5aopen_by_name_f(tables%file, group, name, attribute, status)
      if (status < 0) return
      call h5aget_space_f(attribute, space, status)
      points = 0
      if (status >= 0) call h5sget_simple_extent_npoints_f(space, points, status)
      if (points == 3) call h5aread_f(attribute, H5T_NATIVE_DOUBLE, values, [3_hsize_t], status)
      if (status < 0) values = 0.0_wp
      call h5sclose_f(space, ignored)
      call h5aclose_f(attribute, ignored)
   end function read_attribute

   !> Find all datasets with one of some names.
   subroutine find_tables(tables, names, found)
      type(tables_t), intent(in) :: tables
      character(len=*), intent(in) :: names(:)
      type(table_name_t), allocatable, intent(out) :: found(:)
      integer :: visits
      allocate (found(0))
      visits = 0
      call look_into('/', 0)
   contains
      recursive subroutine look_into(group, depth)
         character(len=*), intent(in) :: group
         integer, intent(in) :: depth
         character(len=longest_name) :: name
         character(len=:), allocatable :: path
         integer :: members, status, m, kind
         if (depth > deepest) return
         call h5gn_members_f(tables%file, group, members, status)
         if (status < 0) return
         do m = 0, members - 1
            visits = visits + 1
            if (visits > max_visits .or. size(found) >= max_found) return
            name = ''
            call h5gget_obj_info_idx_f(tables%file, group, m, name, kind, status)
            if (status < 0) cycle
            path = group//trim(name)
            if (kind == H5G_GROUP_F) call look_into(path//'/', depth + 1)
            if (kind == H5G_DATASET_F .and. any(names == name)) found = [found, table_name_t(path)]
         end do
      end subroutine look_into
   end subroutine find_tables

end module m_hdf5_tables
