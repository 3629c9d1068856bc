!> Grains from Neper's files: tessellations (.tess), by their seeds and weights, and raster tessellations
!> (.tesr), by their voxels.
module m_neper
   use m_kinds, only: wp, i4
   use m_filesystem, only: read_file
   use m_grain_list, only: grain_list_t
   use m_number_text, only: read_real, number_good
   use m_orientations, only: neper_form, numbers_of
   use m_text, only: to_text
   use m_text_lines, only: lines_t
   implicit none
   private
   public :: is_neper, read_neper

   integer, parameter :: max_bytes = 1000000000 !< of a file of voxels
   real(wp), parameter :: max_cells = 1.0e7_wp
   character(len=*), parameter :: make_raster = ' (neper -T -loadtess FILE.tess -format tesr)'

   !> A file being read.
   type :: reading_t
      type(lines_t) :: lines
      logical :: raster = .false.
      integer :: dimension = 3, cells = 0, steps(3) = 1
      real(wp) :: voxel(3) = 1.0_wp
      character(len=:), allocatable :: folder !< of the file, including the final /
   contains
      procedure :: word
      procedure :: numbers
      procedure :: number
   end type reading_t

contains

   pure logical function is_neper(bytes)
      character(len=*), intent(in) :: bytes
      is_neper = index(adjustl(bytes(:min(40, len(bytes)))), '***tess') == 1 &
                 .or. index(adjustl(bytes(:min(40, len(bytes)))), '***tesr') == 1
   end function is_neper

   !> `more`: the bytes of a second file that it refers to. `fault` is a message; empty: no error.
   subroutine read_neper(bytes, path, list, more, fault)
      character(len=*), intent(in) :: bytes, path
      type(grain_list_t), intent(inout) :: list
      character(len=:), allocatable, intent(out) :: more
      character(len=:), allocatable, intent(inout) :: fault
      type(reading_t) :: self
      character(len=:), allocatable :: next
      self%folder = path(:index(path, '/', back=.true.))
      self%raster = index(bytes(:min(40, len(bytes))), '***tesr') > 0
      more = ''
      do while (self%word(bytes, next) .and. fault == '')
         select case (next)
         case ('**general'); call read_general(self, bytes, fault)
         case ('**cell'); call read_count(self, bytes, fault)
         case ('*seed'); if (.not. self%raster) call read_seeds(self, bytes, list, fault)
         case ('*ori'); call read_orientations(self, bytes, list, fault)
         case ('**vertex'); if (.not. self%raster) call read_vertices(self, bytes, list, fault)
         case ('**periodic', '**periodicity'); call read_periodicity(self, bytes, fault)
         case ('**scale'); call read_scales(self, bytes, fault)
         case ('**data'); call read_voxels(self, bytes, list, more, fault)
         case ('***end'); exit
         end select
      end do
      if (fault /= '') return
      if (self%raster .and. .not. allocated(list%voxels)) then
         fault = 'is a raster tessellation without **data; allowed: one with the cell of each voxel'
      else if (.not. self%raster .and. .not. allocated(list%positions)) then
         fault = 'is a tessellation without *seed; allowed: one with seeds, or a .tesr'
      else if (.not. self%raster .and. self%dimension /= 3) then
         fault = 'is a tessellation in '//to_text(self%dimension)//'D; allowed: 3D'
      end if
      if (self%raster) list%size = self%steps*self%voxel
   end subroutine read_neper

   !> The next word of the file, across lines.
   logical function word(self, bytes, text)
      class(reading_t), intent(inout) :: self
      character(len=*), intent(in) :: bytes
      character(len=:), allocatable, intent(out) :: text
      integer :: at, to
      text = ''
      do
         word = self%lines%next_word(bytes, at, to)
         if (word) exit
         if (.not. self%lines%next_line(bytes)) return
      end do
      text = bytes(at:to)
   end function word

   !> Read `count` numbers, all or the first ones of their section.
   subroutine numbers(self, bytes, count, values, what, fault)
      class(reading_t), intent(inout) :: self
      character(len=*), intent(in) :: bytes, what
      integer, intent(in) :: count
      real(wp), allocatable, intent(out) :: values(:)
      character(len=:), allocatable, intent(inout) :: fault
      integer :: n, status, at, to
      if (count > len(bytes)) then
         fault = 'says it has '//to_text(count)//' numbers of '//what//', more than its bytes'
         return
      end if
      allocate (values(count))
      do n = 1, count
         status = 1
         do
            if (self%lines%next_word(bytes, at, to)) exit
            if (.not. self%lines%next_line(bytes)) exit
         end do
         if (to >= at) call read_real(bytes(at:to), values(n), status)
         if (status == number_good) cycle
         fault = 'line '//to_text(self%lines%line)//': must have number '//to_text(n)//' of '// &
                 to_text(count)//' of '//what
         return
      end do
   end subroutine numbers

   !> An integer, at least `least`.
   integer function number(self, bytes, least, what, fault)
      class(reading_t), intent(inout) :: self
      character(len=*), intent(in) :: bytes, what
      integer, intent(in) :: least
      character(len=:), allocatable, intent(inout) :: fault
      real(wp), allocatable :: value(:)
      number = least
      if (fault == '') call self%numbers(bytes, 1, value, what, fault)
      if (fault /= '') return
      if (value(1) < least .or. value(1) > max_cells .or. abs(value(1) - anint(value(1))) > 0.0_wp) then
         fault = 'line '//to_text(self%lines%line)//': has '//to_text(value(1))//' as '//what// &
                 '; allowed: '//to_text(least)//' to '//to_text(nint(max_cells))
      else
         number = nint(value(1))
      end if
   end function number

   subroutine read_general(self, bytes, fault)
      type(reading_t), intent(inout) :: self
      character(len=*), intent(in) :: bytes
      character(len=:), allocatable, intent(inout) :: fault
      real(wp), allocatable :: values(:)
      integer :: axis
      self%dimension = self%number(bytes, 1, 'the dimension', fault)
      if (self%dimension > 3) fault = 'has a dimension of '//to_text(self%dimension)//'; allowed: 1 to 3'
      if (.not. self%raster .or. fault /= '') return
      do axis = 1, self%dimension
         self%steps(axis) = self%number(bytes, 1, 'a number of voxels', fault)
      end do
      if (fault == '') call self%numbers(bytes, self%dimension, values, 'the size of a voxel', fault)
      if (fault == '') self%voxel(:self%dimension) = values
      if (fault == '' .and. any(self%voxel <= 0.0_wp)) fault = 'has voxels whose size is not above 0'
      if (self%dimension == 2) self%voxel(3) = 0.0_wp ! any size: one voxel through the box
   end subroutine read_general

   !> Cells: optional in a raster tessellation.
   subroutine read_count(self, bytes, fault)
      type(reading_t), intent(inout) :: self
      character(len=*), intent(in) :: bytes
      character(len=:), allocatable, intent(inout) :: fault
      type(lines_t) :: before
      character(len=:), allocatable :: next
      before = self%lines
      if (.not. self%word(bytes, next)) return
      self%lines = before
      if (scan(next(1:1), '0123456789') == 1) self%cells = self%number(bytes, 1, 'the number of cells', fault)
   end subroutine read_count

   !> id x y z weight of each.
   subroutine read_seeds(self, bytes, list, fault)
      type(reading_t), intent(inout) :: self
      character(len=*), intent(in) :: bytes
      type(grain_list_t), intent(inout) :: list
      character(len=:), allocatable, intent(inout) :: fault
      real(wp), allocatable :: values(:), table(:, :)
      call self%numbers(bytes, 5*self%cells, values, 'the seeds', fault)
      if (fault /= '') return
      table = reshape(values, [5, self%cells])
      list%positions = reshape(table(2:4, :), [3*self%cells])
      list%weights = table(5, :)
   end subroutine read_seeds

   !> A descriptor, and the numbers of each cell. The meaning of `active` and `passive` after it was exchanged
   !> in Neper 4.10, so they are ambiguous.
   subroutine read_orientations(self, bytes, list, fault)
      type(reading_t), intent(inout) :: self
      character(len=*), intent(in) :: bytes
      type(grain_list_t), intent(inout) :: list
      character(len=:), allocatable, intent(inout) :: fault
      character(len=:), allocatable :: descriptor
      integer :: colon
      if (.not. self%word(bytes, descriptor)) return
      colon = index(descriptor//':', ':')
      list%form = neper_form(descriptor(:colon - 1))
      list%numbers = numbers_of(list%form)
      if (list%form == 0) then
         fault = 'line '//to_text(self%lines%line)//': orientations as '''//descriptor// &
                 ''' are not known; allowed: rodrigues, euler-bunge, euler-kocks, euler-roe, rotmat, '// &
                 'axis-angle, quaternion'
         return
      end if
      if (colon <= len(descriptor)) list%unclear = descriptor
      if (self%cells == 0) fault = 'has *ori without a number of cells before it'
      if (fault == '') call self%numbers(bytes, list%numbers*self%cells, list%orientations, &
                                         'the orientations', fault)
   end subroutine read_orientations

   !> id x y z state of each: their bounding box.
   subroutine read_vertices(self, bytes, list, fault)
      type(reading_t), intent(inout) :: self
      character(len=*), intent(in) :: bytes
      type(grain_list_t), intent(inout) :: list
      character(len=:), allocatable, intent(inout) :: fault
      real(wp), allocatable :: values(:), table(:, :)
      integer :: vertices
      vertices = self%number(bytes, 1, 'the number of vertices', fault)
      if (fault == '') call self%numbers(bytes, 5*vertices, values, 'the vertices', fault)
      if (fault /= '') return
      table = reshape(values, [5, vertices])
      list%lower = minval(table(2:4, :), dim=2)
      list%size = maxval(table(2:4, :), dim=2) - list%lower
      if (any(list%size <= 0.0_wp)) fault = 'is a tessellation whose vertices lie in a plane; allowed: 3D'
   end subroutine read_vertices

   subroutine read_periodicity(self, bytes, fault)
      type(reading_t), intent(inout) :: self
      character(len=*), intent(in) :: bytes
      character(len=:), allocatable, intent(inout) :: fault
      character(len=:), allocatable :: next
      real(wp), allocatable :: periodic(:)
      if (self%raster) return
      if (.not. self%word(bytes, next)) return
      if (next /= '*general') return
      call self%numbers(bytes, 3, periodic, 'the periodicity', fault)
      if (fault /= '') return
      if (any(abs(periodic) > 0.0_wp)) fault = 'is a periodic tessellation, whose cells seeds alone do '// &
         'not tell; allowed: its raster tessellation'//make_raster
   end subroutine read_periodicity

   !> A multiscale tessellation has the number of its scales; its seeds are those of several tessellations.
   subroutine read_scales(self, bytes, fault)
      type(reading_t), intent(inout) :: self
      character(len=*), intent(in) :: bytes
      character(len=:), allocatable, intent(inout) :: fault
      character(len=:), allocatable :: next
      integer :: scales
      if (self%raster) return
      if (.not. self%word(bytes, next)) return
      if (next /= '*general') return
      scales = self%number(bytes, 0, 'the number of scales', fault)
      if (fault == '' .and. scales > 1) fault = 'is a tessellation of '//to_text(scales)// &
         ' scales, whose cells seeds alone do not tell; allowed: its raster tessellation'//make_raster
   end subroutine read_scales

   !> The cell of each voxel, x fastest: as text, or binary here or in a second file.
   subroutine read_voxels(self, bytes, list, more, fault)
      type(reading_t), intent(inout) :: self
      character(len=*), intent(in) :: bytes
      type(grain_list_t), intent(inout) :: list
      character(len=:), allocatable, intent(inout) :: more, fault
      character(len=:), allocatable :: kind, next
      type(lines_t) :: before
      real(wp), allocatable :: values(:)
      integer :: count, width
      logical :: ok
      if (.not. self%word(bytes, kind)) return
      if (product(real(self%steps, wp)) > max_bytes) then
         fault = 'says it has more than '//to_text(max_bytes)//' voxels'
         return
      end if
      count = product(self%steps)
      width = merge(1, merge(2, 4, index(kind, 'binary16') == 1), kind == 'binary8')
      before = self%lines
      ok = self%word(bytes, next)
      if (ok .and. next == '*file') then
         ok = self%word(bytes, next)
         call read_file(self%folder//next, max_bytes, more, ok)
         if (.not. ok) fault = 'names a file of voxels, '//next//', that cannot be read beside it'
         if (ok .and. kind /= 'ascii') call take_binary(more)
         if (ok .and. kind == 'ascii') call take_text(more)
      else if (kind == 'ascii') then
         self%lines = before
         call self%numbers(bytes, count, values, 'the voxels', fault)
         if (fault == '') list%voxels = reshape(nint(values, i4), self%steps)
      else
         self%lines = before
         call take_binary(bytes(before%at:))
         self%lines%at = min(len(bytes) + 1, before%at + count*width)
         self%lines%first = 1
         self%lines%last = 0
      end if
   contains
      subroutine take_text(text)
         character(len=*), intent(in) :: text
         type(reading_t) :: other
         call other%numbers(text, count, values, 'the voxels', fault)
         if (fault == '') list%voxels = reshape(nint(values, i4), self%steps)
      end subroutine take_text
      subroutine take_binary(text)
         character(len=*), intent(in) :: text
         integer :: n, b, byte, value
         logical :: big
         big = index(kind, '_big') > 0
         if (.not. any(kind == [character(len=12) :: 'binary8', 'binary16', 'binary16_big', 'binary32', &
                                'binary32_big'])) then
            fault = 'has voxels as '''//kind//'''; allowed: ascii, binary8, binary16 and binary32 (_big)'
         else if (len(text) < count*width) then
            fault = 'has '//to_text(len(text))//' bytes of voxels; it says '//to_text(count*width)
         end if
         if (fault /= '') return
         allocate (list%voxels(self%steps(1), self%steps(2), self%steps(3)), source=0_i4)
         do n = 0, count - 1
            value = 0
            do b = 0, width - 1
               byte = ichar(text(width*n + b + 1:width*n + b + 1))
               value = ior(value, ishft(byte, 8*merge(width - 1 - b, b, big)))
            end do
            list%voxels(1 + mod(n, self%steps(1)), 1 + mod(n/self%steps(1), self%steps(2)), &
                        1 + n/(self%steps(1)*self%steps(2))) = value
         end do
      end subroutine take_binary
   end subroutine read_voxels

end module m_neper
