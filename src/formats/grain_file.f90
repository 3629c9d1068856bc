!> Grains from a file, whose kind is detected from its content: lines of text, HDF5 of the program's own form
!> or of DREAM.3D, tessellations of Neper. A further format is a file of its own, and a line here.
module m_grain_file
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use m_kinds, only: wp
   use m_checksum, only: text_checksum
   use m_dream3d, only: read_dream3d
   use m_filesystem, only: read_file, never_ends
   use m_foreign_files, only: foreign_grains
   use m_grain_lines, only: read_grain_lines
   use m_grain_list, only: grain_list_t
   use m_grain_tables, only: has_grain_tables, read_grain_tables, own_form
   use m_hdf5_tables, only: tables_t, open_tables, close_tables
   use m_height_file, only: is_hdf5
   use m_neper, only: is_neper, read_neper
   use m_text, only: to_text
   implicit none
   private
   public :: read_grain_file

   integer, parameter :: longest_text = 64*1024*1024          !< bytes
   integer, parameter :: longest_hdf5 = 2*1024*1024*1024 - 1024 !< bytes

contains

   !> Read a file. `fault` is a message that follows the file name; empty: no error.
   subroutine read_grain_file(path, list, checksum, fault)
      character(len=*), intent(in) :: path
      type(grain_list_t), intent(out) :: list
      character(len=:), allocatable, intent(out) :: checksum !< of the file's bytes
      character(len=:), allocatable, intent(out) :: fault
      character(len=:), allocatable :: bytes, more
      logical :: ok
      fault = ''
      checksum = ''
      if (never_ends(path)) then
         fault = 'is a pipe or a device; allowed: a file on the disk'
         return
      end if
      call read_file(path, longest_hdf5, bytes, ok)
      if (.not. ok) then
         fault = 'cannot be read; allowed: HDF5 (also of DREAM.3D), .tess or .tesr of Neper, or a text '// &
                 'file of lines phi1 Phi phi2 or x y z phi1 Phi phi2'
         return
      end if
      more = ''
      checksum = text_checksum(bytes)
      if (is_hdf5(bytes)) then
         call read_tables(path, len(bytes), list, fault)
      else if (is_neper(bytes)) then
         call read_neper(bytes, path, list, more, fault)
         if (more /= '') checksum = text_checksum(bytes//more)
      else if (len(bytes) > longest_text) then
         fault = 'is a text longer than '//to_text(longest_text)//' bytes'
      else
         fault = foreign_grains(bytes)
         if (fault == '') call read_grain_lines(bytes, list, fault)
      end if
      if (fault == '') call check(list, fault)
      if (allocated(list%voxels)) then ! one layer fills the box, whatever its thickness
         where (shape(list%voxels) == 1) list%size = 0.0_wp
      end if
   end subroutine read_grain_file

   subroutine read_tables(path, bytes, list, fault)
      character(len=*), intent(in) :: path
      integer, intent(in) :: bytes
      type(grain_list_t), intent(inout) :: list
      character(len=:), allocatable, intent(inout) :: fault
      type(tables_t) :: tables
      logical :: ok, is_one
      call open_tables(path, bytes, tables, ok)
      if (.not. ok) then
         fault = 'is an HDF5 file that cannot be read'
         return
      end if
      if (has_grain_tables(tables)) then
         call read_grain_tables(tables, list, fault)
      else
         call read_dream3d(tables, list, is_one, fault)
         if (.not. is_one) fault = 'has no dataset ''orientations'', and no FeatureIds of DREAM.3D; '// &
                                   'allowed: '//own_form
      end if
      call close_tables(tables)
   end subroutine read_tables

   !> Check that the contents of a file are consistent.
   subroutine check(list, fault)
      type(grain_list_t), intent(in) :: list
      character(len=:), allocatable, intent(inout) :: fault
      integer :: grains
      grains = 0
      if (allocated(list%orientations)) then
         grains = size(list%orientations)/list%numbers
         if (grains == 0) fault = 'has no grains; allowed: '//own_form
         if (.not. all(ieee_is_finite(list%orientations))) &
            fault = 'holds orientations that are not finite numbers'
      end if
      if (fault /= '') return
      if (allocated(list%positions) .and. allocated(list%voxels)) then
         fault = 'has positions and voxels; allowed: one of both'
      else if (allocated(list%positions)) then
         if (.not. all(ieee_is_finite(list%positions))) fault = 'holds positions that are not finite numbers'
      else if (allocated(list%voxels)) then
         if (minval(list%voxels) < 0 .or. (grains > 0 .and. maxval(list%voxels) > grains)) then
            fault = 'holds grains '//to_text(minval(list%voxels))//' to '//to_text(maxval(list%voxels))// &
                    '; allowed: 0, and 1 to the number of its orientations, '//to_text(grains)
         else if (maxval(list%voxels) == 0) then
            fault = 'holds only voxels without a grain'
         end if
      end if
   end subroutine check

end module m_grain_file
