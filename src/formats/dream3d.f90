!> Grains from a file of DREAM.3D or DREAM3D-NX: FeatureIds of the voxels, 0 for none, and the angles of the
!> features in radians, where row 0 is unused.
module m_dream3d
   use m_kinds, only: wp, i4
   use m_grain_list, only: grain_list_t
   use m_hdf5_tables, only: tables_t, table_name_t, extent_of, read_reals, read_integers, find_tables, &
      read_attribute
   use m_orientations, only: bunge_radians
   implicit none
   private
   public :: read_dream3d

   character(len=14), parameter :: ids(1) = ['FeatureIds    '], angles(2) = ['EulerAngles   ', &
                                                                             'AvgEulerAngles']

contains

   !> `is_one`: the file has FeatureIds.
   subroutine read_dream3d(tables, list, is_one, fault)
      type(tables_t), intent(in) :: tables
      type(grain_list_t), intent(inout) :: list
      logical, intent(out) :: is_one
      character(len=:), allocatable, intent(inout) :: fault
      type(table_name_t), allocatable :: voxels(:), lists(:)
      character(len=:), allocatable :: container, path
      integer(i4), allocatable :: numbers(:)
      real(wp), allocatable :: rows(:)
      integer, allocatable :: extent(:)
      call find_tables(tables, ids, voxels)
      is_one = size(voxels) > 0
      if (.not. is_one) return
      if (size(voxels) > 1) then
         fault = 'has FeatureIds in several places, '//voxels(1)%path//' and '//voxels(2)%path// &
                 '; allowed: one container of grains'
         return
      end if
      container = above(above(voxels(1)%path))
      call find_tables(tables, angles, lists)
      call choose_list(tables, container, lists, path, fault)
      if (fault /= '') return
      extent = extent_of(tables, voxels(1)%path)
      if (size(extent) == 4) then
         if (extent(1) == 1) extent = extent(2:)
      end if
      if (size(extent) == 3) then
         if (all(extent > 0)) call read_integers(tables, voxels(1)%path, numbers)
      end if
      call read_reals(tables, path, rows)
      if (.not. (allocated(numbers) .and. allocated(rows))) then
         fault = 'has '//voxels(1)%path//' or '//path//' in a form that cannot be read; allowed: '// &
                 '(z, y, x, 1) and (features, 3)'
         return
      end if
      list%voxels = reshape(numbers, [extent(1), extent(2), extent(3)])
      list%orientations = rows(4:) ! without row 0
      list%numbers = 3
      list%form = bunge_radians
      call find_size(tables, container, [extent(1), extent(2), extent(3)], list%size)
   end subroutine read_dream3d

   !> The angles of features in the container of the voxels: preferably the average ones.
   subroutine choose_list(tables, container, lists, path, fault)
      type(tables_t), intent(in) :: tables
      character(len=*), intent(in) :: container
      type(table_name_t), intent(in) :: lists(:)
      character(len=:), allocatable, intent(out) :: path
      character(len=:), allocatable, intent(inout) :: fault
      integer, allocatable :: extent(:)
      integer :: n
      path = ''
      do n = 1, size(lists)
         if (above(above(lists(n)%path)) /= container) cycle
         extent = extent_of(tables, lists(n)%path)
         if (size(extent) /= 2) cycle
         if (extent(1) /= 3 .or. extent(2) < 2) cycle
         if (path == '' .or. index(lists(n)%path, 'AvgEulerAngles') > 0) path = lists(n)%path
      end do
      if (path /= '') return
      fault = 'has FeatureIds, and no EulerAngles or AvgEulerAngles of features (features, 3) beside them'
      if (size(lists) > 0) fault = fault//', but '//lists(1)%path// &
         '; make the average orientations of the features first (Find Feature Average Orientations)'
   end subroutine choose_list

   !> Total extents of the voxels, in the unit of the file; zeros if not given.
   subroutine find_size(tables, container, extent, size_of)
      type(tables_t), intent(in) :: tables
      character(len=*), intent(in) :: container
      integer, intent(in) :: extent(3)
      real(wp), intent(out) :: size_of(3)
      real(wp), allocatable :: spacing(:)
      size_of = read_attribute(tables, container, '_SPACING')
      call read_reals(tables, container//'/_SIMPL_GEOMETRY/SPACING', spacing)
      if (allocated(spacing)) then
         if (size(spacing) == 3) size_of = spacing
      end if
      size_of = size_of*extent
   end subroutine find_size

   pure function above(path)
      character(len=*), intent(in) :: path
      character(len=:), allocatable :: above
      above = path(:max(0, index(path, '/', back=.true.) - 1))
   end function above

end module m_dream3d
