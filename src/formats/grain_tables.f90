!> Grains from an HDF5 file of the program's own form: `orientations` (grains, 3, 4 or 9), and optionally
!> `positions` (grains, 3) of the seeds or `grain` (along z, y, x), the number of each voxel.
module m_grain_tables
   use m_kinds, only: i4
   use m_grain_list, only: grain_list_t
   use m_hdf5_tables, only: tables_t, extent_of, read_reals, read_integers, is_of_matlab, of_matlab
   implicit none
   private
   public :: has_grain_tables, read_grain_tables, own_form

   character(len=*), parameter :: own_form = 'orientations (grains, 3) and positions (grains, 3) or '// &
      'grain (along z, y, x), in the order of C and Python'

contains

   logical function has_grain_tables(tables)
      type(tables_t), intent(in) :: tables
      has_grain_tables = size(extent_of(tables, 'orientations')) > 0
   end function has_grain_tables

   subroutine read_grain_tables(tables, list, fault)
      type(tables_t), intent(in) :: tables
      type(grain_list_t), intent(inout) :: list
      character(len=:), allocatable, intent(inout) :: fault
      integer, allocatable :: extent(:)
      integer(i4), allocatable :: voxels(:)
      if (any([is_of_matlab(tables%file, 'orientations'), is_of_matlab(tables%file, 'positions'), &
               is_of_matlab(tables%file, 'grain')])) then
         fault = of_matlab//'orientations'' and positions'' (3, grains), or grain (x, y, z)'
         return
      end if
      extent = extent_of(tables, 'orientations')
      if (size(extent) /= 2) then
         fault = 'has a dataset ''orientations'' of another form: '//own_form
      else if (.not. any(extent(1) == [3, 4, 9])) then
         fault = 'has a dataset ''orientations'' of another form: '//own_form
      else
         list%numbers = extent(1)
         call read_reals(tables, 'orientations', list%orientations)
         if (.not. allocated(list%orientations)) fault = 'has a dataset ''orientations'' that cannot be read'
      end if
      if (fault /= '') return
      extent = extent_of(tables, 'positions')
      if (size(extent) == 2) then
         if (extent(1) == 3) call read_reals(tables, 'positions', list%positions)
      end if
      if (size(extent) > 0 .and. .not. allocated(list%positions)) &
         fault = 'has a dataset ''positions'' of another form: '//own_form
      extent = extent_of(tables, 'grain')
      if (size(extent) == 0 .or. fault /= '') return
      if (size(extent) == 3) then
         if (all(extent > 0)) call read_integers(tables, 'grain', voxels)
      end if
      if (allocated(voxels)) then
         list%voxels = reshape(voxels, [extent(1), extent(2), extent(3)])
      else
         fault = 'has a dataset ''grain'' of another form: '//own_form
      end if
   end subroutine read_grain_tables

end module m_grain_tables
