!> Snapshots in HDF5, laid out as VTKHDF (version 1.0, unstructured grid of one vertex cell a particle), which
!> ParaView and VTK open directly. Doubles and 64-bit ids; every table has its unit in an attribute `unit`.
module m_hdf5_snapshot
   use, intrinsic :: iso_c_binding, only: c_loc, c_null_ptr, c_ptr
   use, intrinsic :: iso_fortran_env, only: int8
   use m_kinds, only: wp, i8
   use m_errors, only: error_t
   use m_communicator, only: communicator_t
   use m_hdf5_file, only: hdf5_file_t, rows_of_real, rows_of_long, rows_of_byte, own_bytes
   use m_snapshot, only: snapshot_t, snapshot_field_t, file_layout_t, snapshot_file_name
   use m_snapshot_format, only: snapshot_format_t
   implicit none
   private
   public :: write_hdf5_snapshot

   integer(int8), parameter :: vertex_cell = 1_int8 ! VTK_VERTEX
   character(len=*), parameter :: top = '/VTKHDF', pure_number = '1' ! unit of dimensionless tables

   type, extends(snapshot_format_t), public :: hdf5_snapshot_t
   contains
      procedure :: write => write_file
      procedure :: bytes => file_bytes
   end type hdf5_snapshot_t

   interface hdf5_snapshot_t
      module procedure new_format
   end interface

contains

   pure type(hdf5_snapshot_t) function new_format()
      new_format%indexed = .true.
   end function new_format

   subroutine write_file(self, communicator, snapshot, directory, error)
      class(hdf5_snapshot_t), intent(in) :: self
      type(communicator_t), intent(in) :: communicator
      type(snapshot_t), intent(in) :: snapshot
      character(len=*), intent(in) :: directory
      type(error_t), intent(inout) :: error
      call write_hdf5_snapshot(communicator, snapshot, directory, error)
   end subroutine write_file

   !> Collective: write `<directory>/particles_<step>.hdf`, or a file of another name. On an error
   !> (exit_files) all ranks hold it and no file is left.
   subroutine write_hdf5_snapshot(communicator, snapshot, directory, error, name)
      type(communicator_t), intent(in) :: communicator
      type(snapshot_t), intent(in) :: snapshot
      character(len=*), intent(in) :: directory
      type(error_t), intent(inout) :: error
      character(len=*), intent(in), optional :: name
      type(hdf5_file_t) :: file
      type(file_layout_t) :: where_to
      character(len=:), allocatable :: file_name
      integer :: f
      file_name = snapshot_file_name(snapshot%step, 'hdf')
      if (present(name)) file_name = name
      call snapshot%check(communicator, error)
      if (error%happened()) return
      where_to = snapshot%layout()
      call file%create(communicator, directory//'/'//file_name, table_bytes(snapshot), error)
      if (error%happened()) return
      call put_header(file, snapshot, error)
      call put_cells(file, communicator, snapshot%n_total, error)
      call put_time(file, communicator, snapshot%time, error)
      if (allocated(snapshot%levels)) call put_levels(file, communicator, snapshot, error)
      call put_table(file, top//'/Points', where_to, snapshot%position, [1, 2, 3], snapshot%n_total, error)
      call file%put_text(top//'/Points', 'unit', 'm', error)
      call put_ids(file, where_to, snapshot, error)
      do f = 1, size(snapshot%fields)
         call put_field(file, where_to, snapshot%fields(f), snapshot%n_total, error)
      end do
      call file%finish(error)
   end subroutine write_hdf5_snapshot

   !> Estimated size of the file, bytes.
   integer(i8) function file_bytes(self, snapshot) result(bytes)
      class(hdf5_snapshot_t), intent(in) :: self
      type(snapshot_t), intent(in) :: snapshot
      bytes = own_bytes + table_bytes(snapshot)
   end function file_bytes

   !> Bytes of all tables: coordinates, id, fields; connectivity, offset and type of the cells. Tables of
   !> levels are small.
   pure integer(i8) function table_bytes(snapshot)
      type(snapshot_t), intent(in) :: snapshot
      table_bytes = snapshot%n_total*(8*(3 + 1 + sum(snapshot%fields(:)%components)) + 8 + 8 + 1)
   end function table_bytes

   !> Write attributes of the file, and the groups.
   subroutine put_header(file, snapshot, error)
      type(hdf5_file_t), intent(in) :: file
      type(snapshot_t), intent(in) :: snapshot
      type(error_t), intent(inout) :: error
      call file%put_real('/', 'time', snapshot%time, error)
      call file%put_text('/', 'time_unit', 's', error)
      call file%put_integers('/', 'step', [snapshot%step], error)
      call file%put_text('/', 'title', snapshot%title, error)
      call file%make_group(top, error)
      call file%put_integers(top, 'Version', [1, 0], error)
      call file%put_text(top, 'Type', 'UnstructuredGrid', error)
      call file%make_group(top//'/PointData', error)
      call file%make_group(top//'/CellData', error)
      call file%make_group(top//'/FieldData', error)
   end subroutine put_header

   !> Cells of the grid and the time: independent of the particles' owners, so each rank writes an even share.
   subroutine put_cells(file, communicator, n_total, error)
      type(hdf5_file_t), intent(in) :: file
      type(communicator_t), intent(in) :: communicator
      integer(i8), intent(in) :: n_total
      type(error_t), intent(inout) :: error
      type(file_layout_t) :: share
      integer(i8), allocatable, target :: index(:)
      integer(int8), allocatable, target :: kind(:)
      integer(i8) :: p, first, last
      first = (n_total*communicator%rank)/communicator%ranks
      last = (n_total*(communicator%rank + 1))/communicator%ranks
      allocate (index(last - first + 1), kind(last - first + 1))
      do p = 0, last - first
         index(p + 1) = first + p
      end do
      kind = vertex_cell
      share = one_run(first, last - first)
      call file%put_rows(top//'/Connectivity', rows_of_long, [1_i8, n_total], share, c_loc(index), error)
      call file%put_rows(top//'/Types', rows_of_byte, [1_i8, n_total], share, c_loc(kind), error)
      if (communicator%rank == communicator%ranks - 1) share = one_run(first, last - first + 1)
      call file%put_rows(top//'/Offsets', rows_of_long, [1_i8, n_total + 1], share, c_loc(index), error)
      call put_single(file, communicator, 'NumberOfPoints', n_total, error)
      call put_single(file, communicator, 'NumberOfCells', n_total, error)
      call put_single(file, communicator, 'NumberOfConnectivityIds', n_total, error)
   end subroutine put_cells

   !> A table of one integer, from rank 0.
   subroutine put_single(file, communicator, name, value, error)
      type(hdf5_file_t), intent(in) :: file
      type(communicator_t), intent(in) :: communicator
      character(len=*), intent(in) :: name
      integer(i8), intent(in) :: value
      type(error_t), intent(inout) :: error
      integer(i8), target :: numbers(1)
      numbers = value
      call file%put_rows(top//'/'//name, rows_of_long, [1_i8, 1_i8], one_run(0_i8, &
         merge(1_i8, 0_i8, communicator%is_root())), c_loc(numbers), error)
   end subroutine put_single

   !> The time as field data, which ParaView shows.
   subroutine put_time(file, communicator, time, error)
      type(hdf5_file_t), intent(in) :: file
      type(communicator_t), intent(in) :: communicator
      real(wp), intent(in) :: time
      type(error_t), intent(inout) :: error
      real(wp), target :: numbers(1)
      character(len=*), parameter :: name = top//'/FieldData/TimeValue'
      numbers = time
      call file%put_rows(name, rows_of_real, [1_i8, 1_i8], one_run(0_i8, &
         merge(1_i8, 0_i8, communicator%is_root())), c_loc(numbers), error)
      call file%put_text(name, 'unit', 's', error)
   end subroutine put_time

   !> The boxes of the levels (corners and cell size, m; the coarsest first), as field data.
   subroutine put_levels(file, communicator, snapshot, error)
      type(hdf5_file_t), intent(in) :: file
      type(communicator_t), intent(in) :: communicator
      type(snapshot_t), intent(in) :: snapshot
      type(error_t), intent(inout) :: error
      real(wp), allocatable, target :: lower(:, :), upper(:, :), cells(:)
      type(file_layout_t) :: rows
      integer(i8) :: n
      integer :: l
      n = size(snapshot%levels)
      rows = one_run(0_i8, merge(n, 0_i8, communicator%is_root()))
      allocate (lower(3, n), upper(3, n), cells(n))
      do l = 1, int(n)
         call snapshot%levels(l)%region%bounding_box(lower(:, l), upper(:, l))
         cells(l) = snapshot%levels(l)%cell
      end do
      call file%put_rows(top//'/FieldData/level_lower', rows_of_real, [3_i8, n], rows, c_loc(lower), error)
      call file%put_rows(top//'/FieldData/level_upper', rows_of_real, [3_i8, n], rows, c_loc(upper), error)
      call file%put_rows(top//'/FieldData/level_cell', rows_of_real, [1_i8, n], rows, c_loc(cells), error)
      call file%put_text(top//'/FieldData/level_lower', 'unit', 'm', error)
      call file%put_text(top//'/FieldData/level_upper', 'unit', 'm', error)
      call file%put_text(top//'/FieldData/level_cell', 'unit', 'm', error)
   end subroutine put_levels

   subroutine put_ids(file, where_to, snapshot, error)
      type(hdf5_file_t), intent(in) :: file
      type(file_layout_t), intent(in) :: where_to
      type(snapshot_t), intent(in) :: snapshot
      type(error_t), intent(inout) :: error
      integer(i8), allocatable, target :: numbers(:)
      type(c_ptr) :: address
      integer :: p
      allocate (numbers(snapshot%n_local))
      do p = 1, snapshot%n_local
         numbers(p) = snapshot%id(where_to%order(p))
      end do
      address = c_null_ptr
      if (snapshot%n_local > 0) address = c_loc(numbers)
      call file%put_rows(top//'/PointData/id', rows_of_long, [1_i8, snapshot%n_total], where_to, address, &
                         error)
      call file%put_text(top//'/PointData/id', 'unit', pure_number, error)
      call file%put_integers(top//'/PointData/id', 'first_bits', [snapshot%id_bits], error)
   end subroutine put_ids

   !> A field as one table with the names of its components.
   subroutine put_field(file, where_to, field, n_total, error)
      type(hdf5_file_t), intent(in) :: file
      type(file_layout_t), intent(in) :: where_to
      type(snapshot_field_t), intent(in) :: field
      integer(i8), intent(in) :: n_total
      type(error_t), intent(inout) :: error
      character(len=:), allocatable :: name, components
      integer :: columns(field%components), c
      columns = field%file_order()
      name = top//'/PointData/'//field%name
      call put_table(file, name, where_to, field%values, columns, n_total, error)
      if (len_trim(field%unit) > 0) then
         call file%put_text(name, 'unit', field%unit, error)
      else
         call file%put_text(name, 'unit', pure_number, error)
      end if
      components = field%full_name(columns(1))
      do c = 2, field%components
         components = components//' '//field%full_name(columns(c))
      end do
      call file%put_text(name, 'components', components, error)
   end subroutine put_field

   !> A table of reals from (n_local, components) in memory order: the given columns, in the given order.
   subroutine put_table(file, name, where_to, values, columns, n_total, error)
      type(hdf5_file_t), intent(in) :: file
      character(len=*), intent(in) :: name
      type(file_layout_t), intent(in) :: where_to
      real(wp), intent(in) :: values(:, :)
      integer, intent(in) :: columns(:)
      integer(i8), intent(in) :: n_total
      type(error_t), intent(inout) :: error
      integer, parameter :: at_once = 512 ! their rows stay in the first-level cache
      real(wp), allocatable, target :: rows(:, :)
      type(c_ptr) :: address
      integer :: c, first, last, p
      allocate (rows(size(columns), size(values, 1)))
      do first = 1, size(values, 1), at_once
         last = min(first + at_once - 1, size(values, 1))
         do c = 1, size(columns)
            do p = first, last
               rows(c, p) = values(where_to%order(p), columns(c))
            end do
         end do
      end do
      address = c_null_ptr
      if (size(rows) > 0) address = c_loc(rows)
      call file%put_rows(name, rows_of_real, [int(size(columns), i8), n_total], where_to, address, error)
   end subroutine put_table

   !> Rows `first` (0-based) to `first + count - 1`, as one range.
   pure function one_run(first, count) result(where_to)
      integer(i8), intent(in) :: first, count
      type(file_layout_t) :: where_to
      integer :: runs
      runs = merge(1, 0, count > 0)
      allocate (where_to%order(0), where_to%offset(runs), where_to%count(runs))
      where_to%offset(:) = first
      where_to%count(:) = int(count)
   end function one_run

end module m_hdf5_snapshot
