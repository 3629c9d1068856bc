!> One HDF5 file written by all ranks together: tables of rows distributed over the ranks, and attributes.
!> Every procedure is collective, does nothing after an error, and returns with the same error on all ranks.
module m_hdf5_file
   use, intrinsic :: iso_c_binding, only: c_ptr
   use mpi_f08
   use hdf5
   use m_kinds, only: wp, i8
   use m_constants, only: exit_files
   use m_errors, only: error_t, fail
   use m_communicator, only: communicator_t
   use m_part_file, only: lock_hint, part_name, begin_shared_part, finish_shared_part, empty_part
   use m_snapshot, only: file_layout_t
   implicit none
   private
   public :: rows_of_real, rows_of_long, rows_of_byte, make_spaces, number_type

   integer, parameter :: rows_of_real = 1, rows_of_long = 2, rows_of_byte = 3 !< number types of a table:
                                                                              !< double, int64, uint8

   ! upper bound of HDF5's own data: names, attributes, groups
   integer(i8), parameter, public :: own_bytes = 65536_i8

   !> A file being written, named `<path>.part` until `finish`.
   type, public :: hdf5_file_t
      character(len=:), allocatable, private :: path
      type(communicator_t), private :: communicator
      integer(hid_t), private :: file = -1_hid_t, transfer = -1_hid_t
   contains
      procedure :: create
      procedure :: make_group
      procedure :: put_rows
      procedure :: put_real
      procedure :: put_integers
      procedure :: put_text
      procedure :: finish
      procedure, private :: settle
   end type hdf5_file_t

contains

   !> Create the file at `path`, whose tables will hold `bytes` (this disk space is reserved at once). After
   !> an error there is nothing to finish. `front` bytes at its beginning are left to the caller.
   subroutine create(self, communicator, path, bytes, error, front)
      class(hdf5_file_t), intent(out) :: self
      type(communicator_t), intent(in) :: communicator
      character(len=*), intent(in) :: path
      integer(i8), intent(in) :: bytes
      type(error_t), intent(inout) :: error
      integer, intent(in), optional :: front !< a power of two, from 512
      integer(hid_t) :: access, creation
      integer :: status, ignored
      self%path = path
      self%communicator = communicator
      call begin_shared_part(communicator, path, bytes + own_bytes, error)
      if (error%happened()) return
      call h5open_f(status)
      call h5eset_auto_f(0, ignored)
      if (status >= 0) call h5pcreate_f(H5P_FILE_ACCESS_F, access, status)
      if (status >= 0) then
         call h5pset_fapl_mpio_f(access, communicator%comm%MPI_VAL, MPI_INFO_NULL%MPI_VAL, status)
         if (status >= 0) call h5pcreate_f(H5P_FILE_CREATE_F, creation, status)
         if (present(front) .and. status >= 0) call h5pset_userblock_f(creation, int(front, hsize_t), status)
         if (status >= 0) &
            call h5fcreate_f(part_name(path), H5F_ACC_TRUNC_F, self%file, status, creation, access)
         call h5pclose_f(creation, ignored)
         call h5pclose_f(access, ignored)
      end if
      if (status >= 0) call h5pcreate_f(H5P_DATASET_XFER_F, self%transfer, status)
      if (status >= 0) call h5pset_dxpl_mpio_f(self%transfer, H5FD_MPIO_COLLECTIVE_F, status)
      call self%settle(status, 'the file cannot be created', error)
      if (error%happened()) call self%finish(error)
   end subroutine create

   !> Create a group, for instance `/VTKHDF/PointData`.
   subroutine make_group(self, name, error)
      class(hdf5_file_t), intent(in) :: self
      character(len=*), intent(in) :: name
      type(error_t), intent(inout) :: error
      integer(hid_t) :: group
      integer :: status
      if (error%happened()) return
      call h5gcreate_f(self%file, name, group, status)
      if (status >= 0) call h5gclose_f(group, status)
      call self%settle(status, 'group '//name, error)
   end subroutine make_group

   !> Write a table: `total` rows of `width` numbers, of which this rank writes those in `where_to`. `numbers`
   !> is the address of (width, local rows), contiguous, in file order.
   subroutine put_rows(self, name, kind, extent, where_to, numbers, error)
      class(hdf5_file_t), intent(in) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: kind         !< rows_of_real, rows_of_long or rows_of_byte
      integer(i8), intent(in) :: extent(2) !< width and total rows; a width of 1 gives a one-dimensional table
      type(file_layout_t), intent(in) :: where_to
      type(c_ptr), intent(in) :: numbers
      type(error_t), intent(inout) :: error
      integer(hid_t) :: data, file_space, memory_space
      integer :: status, ignored
      if (error%happened()) return
      data = -1_hid_t
      call make_spaces(extent, where_to, file_space, memory_space, status)
      ! before each of HDF5's collective calls: a rank alone in one would wait forever
      call self%settle(status, 'table '//name, error)
      if (.not. error%happened()) then
         call h5dcreate_f(self%file, name, number_type(kind), file_space, data, status)
         call self%settle(status, 'table '//name, error)
      end if
      if (extent(2) > 0 .and. .not. error%happened()) then
         call h5dwrite_f(data, number_type(kind), numbers, status, memory_space, file_space, self%transfer)
         call self%settle(status, 'table '//name, error)
      end if
      status = 0
      if (data >= 0) call h5dclose_f(data, status)
      if (file_space >= 0) call h5sclose_f(file_space, ignored)
      if (memory_space >= 0) call h5sclose_f(memory_space, ignored)
      call self%settle(status, 'table '//name, error)
   end subroutine put_rows

   !> A real attribute of an object (`/` for the file itself).
   subroutine put_real(self, object, name, value, error)
      class(hdf5_file_t), intent(in) :: self
      character(len=*), intent(in) :: object, name
      real(wp), intent(in) :: value
      type(error_t), intent(inout) :: error
      integer(hid_t) :: space, attribute
      integer :: status, ignored
      if (error%happened()) return
      call h5screate_f(H5S_SCALAR_F, space, status)
      if (status >= 0) then
         call h5acreate_by_name_f(self%file, object, name, H5T_NATIVE_DOUBLE, space, attribute, status)
         if (status >= 0) then
            call h5awrite_f(attribute, H5T_NATIVE_DOUBLE, value, [1_hsize_t], status)
            call h5aclose_f(attribute, ignored)
         end if
         call h5sclose_f(space, ignored)
      end if
      call self%settle(status, 'attribute '//name, error)
   end subroutine put_real

   !> An attribute of one or more integers.
   subroutine put_integers(self, object, name, values, error)
      class(hdf5_file_t), intent(in) :: self
      character(len=*), intent(in) :: object, name
      integer, intent(in) :: values(:)
      type(error_t), intent(inout) :: error
      integer(hid_t) :: space, attribute
      integer(hsize_t) :: extent(1)
      integer :: status, ignored
      if (error%happened()) return
      extent = size(values)
      if (size(values) == 1) then
         call h5screate_f(H5S_SCALAR_F, space, status)
      else
         call h5screate_simple_f(1, extent, space, status)
      end if
      if (status >= 0) then
         call h5acreate_by_name_f(self%file, object, name, H5T_NATIVE_INTEGER, space, attribute, status)
         if (status >= 0) then
            call h5awrite_f(attribute, H5T_NATIVE_INTEGER, values, extent, status)
            call h5aclose_f(attribute, ignored)
         end if
         call h5sclose_f(space, ignored)
      end if
      call self%settle(status, 'attribute '//name, error)
   end subroutine put_integers

   !> An attribute of text (fixed length; an empty one is written as a blank).
   subroutine put_text(self, object, name, text, error)
      class(hdf5_file_t), intent(in) :: self
      character(len=*), intent(in) :: object, name, text
      type(error_t), intent(inout) :: error
      integer(hid_t) :: space, attribute, string
      character(len=max(1, len(text))) :: padded
      integer :: status, ignored
      if (error%happened()) return
      padded = text
      call h5tcopy_f(H5T_C_S1, string, status)
      if (status >= 0) then
         call h5tset_size_f(string, int(len(padded), size_t), status)
         if (status >= 0) call h5tset_strpad_f(string, H5T_STR_NULLPAD_F, status)
         if (status >= 0) call h5screate_f(H5S_SCALAR_F, space, status)
         if (status >= 0) then
            call h5acreate_by_name_f(self%file, object, name, string, space, attribute, status)
            if (status >= 0) then
               call h5awrite_f(attribute, string, padded, [1_hsize_t], status)
               call h5aclose_f(attribute, ignored)
            end if
            call h5sclose_f(space, ignored)
         end if
         call h5tclose_f(string, ignored)
      end if
      call self%settle(status, 'attribute '//name, error)
   end subroutine put_text

   !> Close the file and rename it; after an error, remove it. All ranks must call this after a successful
   !> `create`.
   subroutine finish(self, error)
      class(hdf5_file_t), intent(inout) :: self
      type(error_t), intent(inout) :: error
      character(len=:), allocatable :: hint
      integer(hid_t) :: file
      integer :: status, ignored
      status = 0
      ! closing needs space on a full disk
      if (error%happened() .and. self%communicator%is_root()) call empty_part(self%path)
      if (self%transfer >= 0) call h5pclose_f(self%transfer, ignored)
      if (self%file >= 0) call h5fclose_f(self%file, status)
      if (.not. error%happened()) then
         call self%settle(status, 'the file cannot be closed', error)
         if (self%communicator%is_root() .and. .not. error%happened()) then
            ! detects a file truncated by a full disk
            call h5fopen_f(part_name(self%path), H5F_ACC_RDONLY_F, file, status)
            if (status >= 0) call h5fclose_f(file, status)
            hint = ''
            if (status < 0) hint = lock_hint(part_name(self%path))
            if (hint /= '') call fail(error, exit_files, 'cannot write '//self%path// &
                                      ': it cannot be opened again'//hint)
            if (status < 0) call fail(error, exit_files, 'cannot write '//self%path// &
                                      ': it is not whole on the disk')
         end if
      end if
      call h5close_f(ignored)
      self%transfer = -1_hid_t
      self%file = -1_hid_t
      call finish_shared_part(self%communicator, self%path, -1_i8, error)
   end subroutine finish

   !> Collective: turn a negative HDF5 status on any rank into one error on all of them.
   subroutine settle(self, status, what, error)
      class(hdf5_file_t), intent(in) :: self
      integer, intent(in) :: status
      character(len=*), intent(in) :: what
      type(error_t), intent(inout) :: error
      if (status < 0) call fail(error, exit_files, 'cannot write '//self%path//': HDF5 failed at '//what// &
                                    lock_hint(part_name(self%path)))
      call self%communicator%agree(error)
   end subroutine settle

   !> The selection of this rank's rows in the file, and the space of its numbers in memory. Unused spaces are
   !> negative.
   subroutine make_spaces(extent, where_to, file_space, memory_space, status)
      integer(i8), intent(in) :: extent(2)
      type(file_layout_t), intent(in) :: where_to
      integer(hid_t), intent(out) :: file_space, memory_space
      integer, intent(out) :: status
      integer(hsize_t) :: total(2), local(2), start(2), count(2)
      integer :: r, rank, first, operation
      file_space = -1_hid_t
      memory_space = -1_hid_t
      rank = merge(1, 2, extent(1) == 1)
      first = 3 - rank ! of the two extents, the first one in use
      total = int(extent, hsize_t)
      local = int([extent(1), sum(int(where_to%count, i8))], hsize_t)
      call h5screate_simple_f(rank, total(first:), file_space, status)
      if (status >= 0) call h5screate_simple_f(rank, local(first:), memory_space, status)
      if (status >= 0 .and. size(where_to%count) == 0) then
         call h5sselect_none_f(file_space, status)
         if (status >= 0) call h5sselect_none_f(memory_space, status)
      end if
      operation = H5S_SELECT_SET_F
      do r = 1, size(where_to%count)
         if (status < 0) return
         start = int([0_i8, where_to%offset(r)], hsize_t)
         count = int([extent(1), int(where_to%count(r), i8)], hsize_t)
         call h5sselect_hyperslab_f(file_space, operation, start(first:), count(first:), status)
         operation = H5S_SELECT_OR_F
      end do
   end subroutine make_spaces

   !> The HDF5 type of the numbers of a table, in memory and in the file.
   integer(hid_t) function number_type(kind)
      integer, intent(in) :: kind
      select case (kind)
      case (rows_of_real)
         number_type = H5T_NATIVE_DOUBLE
      case (rows_of_long)
         number_type = H5T_STD_I64LE
      case default
         number_type = H5T_STD_U8LE
      end select
   end function number_type

end module m_hdf5_file
