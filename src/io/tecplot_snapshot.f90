!> Snapshots in Tecplot ASCII, for Tecplot, ParaView and VTK: one zone a level, block packing, the zone record
!> on one line. The id is written in full, and as three numbers of 24 bits, which are exact in single
!> precision. Every value takes one line of fixed width, so that each rank knows the position of its values
!> and writes them itself.
module m_tecplot_snapshot
   use mpi_f08
   use m_kinds, only: wp, i8
   use m_constants, only: exit_files
   use m_errors, only: error_t, fail
   use m_communicator, only: communicator_t
   use m_part_file, only: part_name, begin_shared_part, finish_shared_part
   use m_snapshot, only: snapshot_t, file_layout_t, snapshot_file_name
   use m_text, only: to_text, exact_text
   use m_snapshot_format, only: snapshot_format_t
   implicit none
   private
   public :: write_tecplot_snapshot, quoted

   integer, parameter :: width = 25            ! characters of a value, including the end of line
   integer, parameter :: chunk = 65536         ! values that a rank converts to text at a time
   integer, parameter :: single_bits = 24      ! mantissa bits in single precision, in which VTK reads the
                                               ! file
   character(len=*), parameter :: real_format = '(es24.16e3)', integer_format = '(i24)'

   ! The file being written: the current zone, and the MPI types that map a rank's lines to their file
   ! positions.
   type :: table_t
      type(MPI_File) :: file
      type(MPI_Datatype) :: line             ! one value as text
      type(MPI_Datatype) :: lines ! lines of this rank in a block of the values of all particles of the zone
      type(file_layout_t) :: where_to        ! the particles of this rank in the zone
      integer(MPI_OFFSET_KIND) :: start = 0  ! byte at which the next block begins
      integer(i8) :: block_bytes = 0_i8
      integer :: chunks = 0                  ! collective writes per block
   end type table_t

   type, extends(snapshot_format_t), public :: tecplot_snapshot_t
   contains
      procedure :: write => write_file
      procedure :: bytes => file_bytes
   end type tecplot_snapshot_t

   interface tecplot_snapshot_t
      module procedure new_format
   end interface

contains

   pure type(tecplot_snapshot_t) function new_format()
      new_format%is_text = .true.
   end function new_format

   subroutine write_file(self, communicator, snapshot, directory, error)
      class(tecplot_snapshot_t), intent(in) :: self
      type(communicator_t), intent(in) :: communicator
      type(snapshot_t), intent(in) :: snapshot
      character(len=*), intent(in) :: directory
      type(error_t), intent(inout) :: error
      call write_tecplot_snapshot(communicator, snapshot, directory, error)
   end subroutine write_file

   !> Collective: write `<directory>/particles_<step>.dat`. On an error (exit_files) all ranks hold it and no
   !> file is left.
   subroutine write_tecplot_snapshot(communicator, snapshot, directory, error)
      type(communicator_t), intent(in) :: communicator
      type(snapshot_t), intent(in) :: snapshot
      character(len=*), intent(in) :: directory
      type(error_t), intent(inout) :: error
      type(file_layout_t) :: where_to
      type(table_t) :: table
      character(len=:), allocatable :: path, header
      integer(i8), allocatable :: particles(:)
      integer(i8) :: bytes, first
      integer :: z
      call snapshot%check(communicator, error)
      if (error%happened()) return
      where_to = snapshot%layout()
      path = directory//'/'//snapshot_file_name(snapshot%step, 'dat')
      header = header_text(snapshot)
      particles = zone_particles(snapshot)
      bytes = length_of(snapshot)
      call begin_shared_part(communicator, path, bytes, error)
      if (error%happened()) return
      call open_table(table, communicator, path, error)
      if (.not. error%happened()) then
         call put_text(table, communicator, header, path, error)
         first = 0
         do z = 1, size(particles)
            if (particles(z) == 0) cycle
            call put_text(table, communicator, zone_text(snapshot, z, particles(z)), path, error)
            call begin_zone(table, communicator, where_to%part(first, particles(z)), particles(z))
            call put_values(table, snapshot, path, error)
            call MPI_Type_free(table%lines)
            first = first + particles(z)
         end do
         call close_table(table, path, error)
      end if
      call finish_shared_part(communicator, path, bytes, error)
   end subroutine write_tecplot_snapshot

   !> Bytes of the file.
   integer(i8) function file_bytes(self, snapshot)
      class(tecplot_snapshot_t), intent(in) :: self
      type(snapshot_t), intent(in) :: snapshot
      file_bytes = length_of(snapshot)
   end function file_bytes

   integer(i8) function length_of(snapshot) result(bytes)
      type(snapshot_t), intent(in) :: snapshot
      integer(i8), allocatable :: particles(:)
      integer :: z
      particles = zone_particles(snapshot)
      bytes = len(header_text(snapshot), i8) + blocks(snapshot)*width*snapshot%n_total
      do z = 1, size(particles)
         bytes = bytes + len(zone_text(snapshot, z, particles(z)), i8)
      end do
   end function length_of

   !> Text that is allowed between the quotes of a Tecplot record.
   pure function quoted(text) result(safe)
      character(len=*), intent(in) :: text
      character(len=:), allocatable :: safe
      integer :: i
      safe = '"'//text//'"'
      do i = 2, len(safe) - 1
         if (safe(i:i) == '"') safe(i:i) = ''''
         if (iachar(safe(i:i)) < 32) safe(i:i) = ' '
      end do
   end function quoted

   !> Particles of each zone, in the order of the file.
   pure function zone_particles(snapshot) result(particles)
      type(snapshot_t), intent(in) :: snapshot
      integer(i8), allocatable :: particles(:)
      if (allocated(snapshot%levels)) then
         particles = snapshot%levels%particles
      else
         particles = [snapshot%n_total]
      end if
   end function zone_particles

   !> Title and variables.
   function header_text(snapshot) result(header)
      type(snapshot_t), intent(in) :: snapshot
      character(len=:), allocatable :: header
      character(len=:), allocatable :: unit
      character(len=1), parameter :: newline = achar(10)
      integer :: f, c
      header = 'TITLE='//quoted(snapshot%title//', step '//to_text(snapshot%step)//', time '// &
                                exact_text(snapshot%time)//' s')//newline
      header = header//'VARIABLES="X(m)", "Y(m)", "Z(m)", "id [-]", "id_high [-]", "id_middle [-]", '// &
               '"id_low [-]"'
      do f = 1, size(snapshot%fields)
         unit = snapshot%fields(f)%unit
         if (len_trim(unit) == 0) unit = '-'
         do c = 1, snapshot%fields(f)%components
            header = header//', '//quoted(snapshot%fields(f)%full_name(c)//' ['//unit//']')
         end do
      end do
      header = header//newline
   end function header_text

   !> The record of a zone. Without particles there is none: some readers fail on an empty zone. The particles
   !> are counted along J: ParaView 5.11 returns nothing for a zone that is long in I alone.
   pure function zone_text(snapshot, zone, particles) result(text)
      type(snapshot_t), intent(in) :: snapshot
      integer, intent(in) :: zone          !< from 1, also its strand
      integer(i8), intent(in) :: particles !< of the zone
      character(len=:), allocatable :: text
      text = ''
      if (particles == 0) return
      text = 'ZONE T="level '//to_text(merge(zone, 0, allocated(snapshot%levels)))//'", STRANDID='// &
             to_text(zone)//', SOLUTIONTIME='//exact_text(snapshot%time)//', I=1, J='//to_text(particles)// &
             ', K=1, DATAPACKING=BLOCK'//achar(10)
   end function zone_text

   !> Number of values per particle in the file.
   pure integer(i8) function blocks(snapshot)
      type(snapshot_t), intent(in) :: snapshot
      blocks = 7_i8 + sum(snapshot%fields(:)%components)
   end function blocks

   subroutine open_table(table, communicator, path, error)
      type(table_t), intent(out) :: table
      type(communicator_t), intent(in) :: communicator
      character(len=*), intent(in) :: path
      type(error_t), intent(inout) :: error
      integer :: status
      if (error%happened()) return
      call MPI_File_open(communicator%comm, part_name(path), MPI_MODE_WRONLY, MPI_INFO_NULL, table%file, &
                         status)
      call note(status, path, error)
      call communicator%agree(error)
      if (error%happened()) return
      call MPI_Type_contiguous(width, MPI_CHARACTER, table%line)
      call MPI_Type_commit(table%line)
   end subroutine open_table

   !> Rank 0 writes the header text.
   subroutine put_text(table, communicator, text, path, error)
      type(table_t), intent(inout) :: table
      type(communicator_t), intent(in) :: communicator
      character(len=*), intent(in) :: text, path
      type(error_t), intent(inout) :: error
      type(MPI_Status) :: written
      integer :: status
      call MPI_File_set_view(table%file, table%start, MPI_CHARACTER, MPI_CHARACTER, 'native', MPI_INFO_NULL, &
                             status)
      call note(status, path, error)
      if (communicator%is_root()) then
         call MPI_File_write_at(table%file, 0_MPI_OFFSET_KIND, text, len(text), MPI_CHARACTER, written, &
                                status)
         call note(status, path, error)
      end if
      table%start = table%start + len(text)
   end subroutine put_text

   !> Set the positions of this rank's lines in the blocks of a zone.
   subroutine begin_zone(table, communicator, where_to, particles)
      type(table_t), intent(inout) :: table
      type(communicator_t), intent(in) :: communicator
      type(file_layout_t), intent(in) :: where_to
      integer(i8), intent(in) :: particles !< of all ranks in the zone
      integer(MPI_ADDRESS_KIND), allocatable :: displacement(:)
      table%where_to = where_to
      table%block_bytes = width*particles
      table%chunks = (size(where_to%order) + chunk - 1)/chunk
      call MPI_Allreduce(MPI_IN_PLACE, table%chunks, 1, MPI_INTEGER, MPI_MAX, communicator%comm)
      allocate (displacement(size(where_to%offset)))
      displacement(:) = int(where_to%offset*width, MPI_ADDRESS_KIND)
      if (size(displacement) > 0) then
         call MPI_Type_create_hindexed(size(displacement), where_to%count, displacement, table%line, &
                                       table%lines)
      else
         call MPI_Type_dup(table%line, table%lines) ! a view must not be empty; nothing is written through it
      end if
      call MPI_Type_commit(table%lines)
   end subroutine begin_zone

   !> Write all blocks of a zone: coordinates, ids, then the components of the fields.
   subroutine put_values(table, snapshot, path, error)
      type(table_t), intent(inout) :: table
      type(snapshot_t), intent(in) :: snapshot
      character(len=*), intent(in) :: path
      type(error_t), intent(inout) :: error
      integer :: f, c
      do c = 1, 3
         call put_block(table, path, error, reals=snapshot%position(:, c))
      end do
      call put_block(table, path, error, ids=snapshot%id)
      call put_block(table, path, error, ids=shiftr(snapshot%id, 2*single_bits))
      call put_block(table, path, error, ids=iand(shiftr(snapshot%id, single_bits), 2_i8**single_bits - 1))
      call put_block(table, path, error, ids=iand(snapshot%id, 2_i8**single_bits - 1))
      do f = 1, size(snapshot%fields)
         do c = 1, snapshot%fields(f)%components
            call put_block(table, path, error, reals=snapshot%fields(f)%values(:, c))
         end do
      end do
   end subroutine put_values

   !> Write one value of every particle of the zone. All ranks take part in every write, also after an error
   !> and when they have no values left.
   subroutine put_block(table, path, error, reals, ids)
      type(table_t), intent(inout) :: table
      character(len=*), intent(in) :: path
      type(error_t), intent(inout) :: error
      real(wp), intent(in), optional :: reals(:)
      integer(i8), intent(in), optional :: ids(:)
      character(len=width), allocatable :: lines(:)
      type(MPI_Status) :: written
      integer :: n, k, done, status
      call MPI_File_set_view(table%file, table%start, table%line, table%lines, 'native', MPI_INFO_NULL, &
                             status)
      call note(status, path, error)
      allocate (lines(min(chunk, size(table%where_to%order))))
      done = 0
      do n = 1, table%chunks
         do k = 1, min(chunk, size(table%where_to%order) - done)
            if (present(reals)) write (lines(k), real_format) reals(table%where_to%order(done + k))
            if (present(ids)) write (lines(k), integer_format) ids(table%where_to%order(done + k))
            lines(k) (width:width) = achar(10)
         end do
         k = min(chunk, size(table%where_to%order) - done)
         call MPI_File_write_at_all(table%file, int(done, MPI_OFFSET_KIND), lines, k, table%line, written, &
                                    status)
         call note(status, path, error)
         done = done + k
      end do
      table%start = table%start + table%block_bytes
   end subroutine put_block

   subroutine close_table(table, path, error)
      type(table_t), intent(inout) :: table
      character(len=*), intent(in) :: path
      type(error_t), intent(inout) :: error
      integer :: status
      call MPI_File_close(table%file, status)
      call note(status, path, error)
      call MPI_Type_free(table%line)
   end subroutine close_table

   !> Turn an MPI file status into an error of this rank.
   subroutine note(status, path, error)
      integer, intent(in) :: status
      character(len=*), intent(in) :: path
      type(error_t), intent(inout) :: error
      character(len=MPI_MAX_ERROR_STRING) :: reason
      integer :: length
      if (status == MPI_SUCCESS) return
      call MPI_Error_string(status, reason, length)
      call fail(error, exit_files, 'cannot write '//path//': '//reason(1:length))
   end subroutine note

end module m_tecplot_snapshot
