!> Heights on a grid from an HDF5 file, by one rank alone.
module m_height_file
   use hdf5
   use m_kinds, only: wp
   implicit none
   private
   public :: is_hdf5, read_height_file

   character(len=*), parameter :: dataset = 'height'
   integer, parameter :: max_steps_along = 20000 !< heights along an axis

contains

   !> True of bytes that begin as those of an HDF5 file.
   pure logical function is_hdf5(bytes)
      character(len=*), intent(in) :: bytes
      is_hdf5 = index(bytes, achar(137)//'HDF'//achar(13)//achar(10)) == 1
   end function is_hdf5

   !> The dataset `height` of a file, (along y, along x) as C and Python count. `fault` says what is wrong;
   !> empty: nothing.
   subroutine read_height_file(path, height, fault)
      character(len=*), intent(in) :: path
      real(wp), allocatable, intent(out) :: height(:, :) !< (along x, along y)
      character(len=:), allocatable, intent(out) :: fault
      integer(hid_t) :: file, data, space
      integer(hsize_t) :: dims(2), most(2)
      integer :: status, ignored, rank
      fault = 'is an HDF5 file without a readable dataset '''//dataset//''' of two dimensions'
      allocate (height(0, 0))
      call h5open_f(status)
      call h5eset_auto_f(0, ignored)
      call h5fopen_f(path, H5F_ACC_RDONLY_F, file, status)
      if (status < 0) return
      call h5dopen_f(file, dataset, data, status)
      if (status >= 0) then
         call h5dget_space_f(data, space, status)
         rank = 0
         if (status >= 0) call h5sget_simple_extent_ndims_f(space, rank, status)
         if (rank == 2) then
            call h5sget_simple_extent_dims_f(space, dims, most, status)
            if (status >= 0 .and. all(dims <= max_steps_along)) then
               deallocate (height)
               allocate (height(dims(1), dims(2)))
               call h5dread_f(data, H5T_NATIVE_DOUBLE, height, dims, status)
               if (status >= 0) fault = ''
            end if
         end if
         call h5sclose_f(space, ignored)
         call h5dclose_f(data, ignored)
      end if
      call h5fclose_f(file, ignored)
   end subroutine read_height_file

end module m_height_file
