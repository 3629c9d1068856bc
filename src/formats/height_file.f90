!> Heights on a grid from an HDF5 file, by one rank alone.
module m_height_file
   use hdf5
   use m_hdf5_tables, only: is_of_matlab, of_matlab
   use m_kinds, only: wp
   use m_height_map, only: height_map_t, row_at_bottom
   implicit none
   private
   public :: is_hdf5, read_height_file

   character(len=*), parameter :: dataset = 'height'
   character(len=*), parameter :: signature = achar(137)//'HDF'//achar(13)//achar(10)
   integer, parameter :: max_steps_along = 20000 !< heights along an axis

contains

   !> True if the bytes have the signature of HDF5 at the start, or after a user block of 512, 1024, 2048, ...
   !> bytes.
   pure logical function is_hdf5(bytes)
      character(len=*), intent(in) :: bytes
      integer :: block
      block = 0
      do
         is_hdf5 = index(bytes(block + 1:min(len(bytes), block + len(signature))), signature) == 1
         if (is_hdf5 .or. block >= len(bytes)/2) return
         block = max(512, 2*block)
      end do
   end function is_hdf5

   !> The dataset `height` of a file, (along y, along x) in the order of C and Python; its optional attribute
   !> `spacing` has the distances along x and y in m. `fault` is a message; empty: no error.
   subroutine read_height_file(path, bytes, map, fault)
      character(len=*), intent(in) :: path
      integer, intent(in) :: bytes !< of the file: a damaged one may declare much more than it contains
      type(height_map_t), intent(out) :: map
      character(len=:), allocatable, intent(out) :: fault
      integer(hid_t) :: file, data, space
      integer(hsize_t) :: dims(2), most(2)
      integer :: status, ignored, rank
      fault = 'is an HDF5 file without a readable dataset '''//dataset//''' of two dimensions'
      allocate (map%height(0, 0))
      call h5open_f(status)
      call h5eset_auto_f(0, ignored)
      call h5fopen_f(path, H5F_ACC_RDONLY_F, file, status)
      if (status < 0) return
      call h5dopen_f(file, dataset, data, status)
      if (status >= 0 .and. is_of_matlab(file, dataset)) then
         fault = of_matlab//'height'' (along x, along y)'
         call h5dclose_f(data, ignored)
      else if (status >= 0) then
         call h5dget_space_f(data, space, status)
         rank = 0
         if (status >= 0) call h5sget_simple_extent_ndims_f(space, rank, status)
         if (rank == 2) then
            call h5sget_simple_extent_dims_f(space, dims, most, status)
            if (status >= 0 .and. all(dims <= max_steps_along) &
                .and. product(real(dims, wp)) <= 1000.0_wp*bytes) then
               deallocate (map%height)
               allocate (map%height(dims(1), dims(2)))
               call h5dread_f(data, H5T_NATIVE_DOUBLE, map%height, dims, status)
               if (status >= 0) fault = ''
               if (status >= 0) call read_spacing(data, map)
            end if
         end if
         call h5sclose_f(space, ignored)
         call h5dclose_f(data, ignored)
      end if
      call h5fclose_f(file, ignored)
   end subroutine read_height_file

   !> Read the spacing; with it the rows are along y from the bottom.
   subroutine read_spacing(data, map)
      integer(hid_t), intent(in) :: data
      type(height_map_t), intent(inout) :: map
      integer(hid_t) :: attribute, space
      integer(hsize_t) :: points
      real(wp) :: spacing(2)
      integer :: status, ignored
      logical :: there
      call h5aexists_f(data, 'spacing', there, status)
      if (status < 0 .or. .not. there) return
      call h5aopen_f(data, 'spacing', attribute, status)
      if (status < 0) return
      call h5aget_space_f(attribute, space, status)
      points = 0
      if (status >= 0) call h5sget_simple_extent_npoints_f(space, points, status)
      if (status >= 0 .and. points == 2) then
         call h5aread_f(attribute, H5T_NATIVE_DOUBLE, spacing, [2_hsize_t], status)
         if (status >= 0) then
            map%spacing = spacing
            map%spacing_in_m = .true.
            map%scale = 1.0_wp
            map%first_row = row_at_bottom
         end if
      end if
      call h5sclose_f(space, ignored)
      call h5aclose_f(attribute, ignored)
   end subroutine read_spacing

end module m_height_file
