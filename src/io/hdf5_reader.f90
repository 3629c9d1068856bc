!> One HDF5 file read by all ranks together: the tables that m_hdf5_file writes. Every procedure is
!> collective, does nothing after an error, and returns with the same error on all ranks.
module m_hdf5_reader
   use, intrinsic :: iso_c_binding, only: c_ptr
   use mpi_f08
   use hdf5
   use m_kinds, only: i8
   use m_constants, only: exit_files
   use m_errors, only: error_t, fail
   use m_communicator, only: communicator_t
   use m_hdf5_file, only: make_spaces, number_type
   use m_snapshot, only: file_layout_t
   use m_part_file, only: lock_hint
   implicit none
   private

   type, public :: hdf5_reader_t
      character(len=:), allocatable :: path
      type(communicator_t), private :: communicator
      integer(hid_t), private :: file = -1_hid_t, transfer = -1_hid_t
   contains
      procedure :: open => open_file
      procedure :: find_extent
      procedure :: get_rows
      procedure :: close => close_file
      procedure, private :: settle
   end type hdf5_reader_t

contains

   !> Open a file. After an error there is nothing to close.
   subroutine open_file(self, communicator, path, error)
      class(hdf5_reader_t), intent(out) :: self
      type(communicator_t), intent(in) :: communicator
      character(len=*), intent(in) :: path
      type(error_t), intent(inout) :: error
      integer(hid_t) :: access
      integer :: status, ignored
      self%path = path
      self%communicator = communicator
      if (error%happened()) return
      call h5open_f(status)
      call h5eset_auto_f(0, ignored)
      if (status >= 0) call h5pcreate_f(H5P_FILE_ACCESS_F, access, status)
      if (status >= 0) then
         call h5pset_fapl_mpio_f(access, communicator%comm%MPI_VAL, MPI_INFO_NULL%MPI_VAL, status)
         if (status >= 0) call h5fopen_f(path, H5F_ACC_RDONLY_F, self%file, status, access_prp=access)
         call h5pclose_f(access, ignored)
      end if
      if (status >= 0) call h5pcreate_f(H5P_DATASET_XFER_F, self%transfer, status)
      if (status >= 0) call h5pset_dxpl_mpio_f(self%transfer, H5FD_MPIO_COLLECTIVE_F, status)
      call self%settle(status, 'the file cannot be opened', error)
      if (error%happened()) call self%close()
   end subroutine open_file

   !> Width and rows of a table; zeros if there is none of that name.
   subroutine find_extent(self, name, extent, error)
      class(hdf5_reader_t), intent(in) :: self
      character(len=*), intent(in) :: name
      integer(i8), intent(out) :: extent(2)
      type(error_t), intent(inout) :: error
      integer(hid_t) :: data, space
      integer(hsize_t) :: dims(2), most(2)
      integer :: status, ignored, rank
      logical :: there
      extent = 0
      if (error%happened()) return
      call h5lexists_f(self%file, name, there, status)
      if (status >= 0 .and. there) then
         call h5dopen_f(self%file, name, data, status)
         if (status >= 0) then
            call h5dget_space_f(data, space, status)
            if (status >= 0) call h5sget_simple_extent_ndims_f(space, rank, status)
            if (status >= 0 .and. (rank < 1 .or. rank > 2)) status = -1
            if (status >= 0) then
               dims = 1
               call h5sget_simple_extent_dims_f(space, dims(3 - rank:), most(3 - rank:), status)
               extent = int(dims, i8)
            end if
            call h5sclose_f(space, ignored)
            call h5dclose_f(data, ignored)
         end if
      end if
      call self%settle(status, 'table '//name, error)
   end subroutine find_extent

   !> Read the rows in `where_to` of a table with this extent (width, rows) into `numbers`, (width, local
   !> rows).
   subroutine get_rows(self, name, kind, extent, where_to, numbers, error)
      class(hdf5_reader_t), intent(in) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: kind
      integer(i8), intent(in) :: extent(2)
      type(file_layout_t), intent(in) :: where_to
      type(c_ptr), intent(in) :: numbers
      type(error_t), intent(inout) :: error
      integer(hid_t) :: data, file_space, memory_space
      type(c_ptr) :: place
      integer(i8) :: found(2)
      integer :: status, ignored
      place = numbers
      data = -1_hid_t
      if (error%happened()) return
      call self%find_extent(name, found, error)
      if (error%happened()) return
      if (any(found /= extent)) call fail(error, exit_files, 'cannot read '//self%path//': table '//name// &
                                          ' has another size')
      if (error%happened() .or. extent(2) == 0) return
      call make_spaces(extent, where_to, file_space, memory_space, status)
      if (status >= 0) call h5dopen_f(self%file, name, data, status)
      call self%settle(status, 'table '//name, error) ! a rank alone in a collective read would wait forever
      if (.not. error%happened()) &
         call h5dread_f(data, number_type(kind), place, status, memory_space, file_space, self%transfer)
      if (data >= 0) call h5dclose_f(data, ignored)
      if (file_space >= 0) call h5sclose_f(file_space, ignored)
      if (memory_space >= 0) call h5sclose_f(memory_space, ignored)
      call self%settle(status, 'table '//name, error)
   end subroutine get_rows

   subroutine close_file(self)
      class(hdf5_reader_t), intent(inout) :: self
      integer :: ignored
      if (self%transfer >= 0) call h5pclose_f(self%transfer, ignored)
      if (self%file >= 0) call h5fclose_f(self%file, ignored)
      self%transfer = -1_hid_t
      self%file = -1_hid_t
   end subroutine close_file

   !> Collective: turn a negative HDF5 status on any rank into one error on all of them.
   subroutine settle(self, status, what, error)
      class(hdf5_reader_t), intent(in) :: self
      integer, intent(in) :: status
      character(len=*), intent(in) :: what
      type(error_t), intent(inout) :: error
      if (status < 0) call fail(error, exit_files, 'cannot read '//self%path//': HDF5 failed at '//what// &
                                lock_hint(self%path))
      call self%communicator%agree(error)
   end subroutine settle

end module m_hdf5_reader
