!> Checkpoint files: their names, the seal that distinguishes a complete one from a damaged one, and the
!> search for the latest in a directory.
!>
!> A checkpoint is an HDF5 file with 512 bytes of plain text in front: format, program, length and checksum of
!> the rest, and a checksum of this text. The text is written last, so that a valid seal implies a complete
!> file.
module m_checkpoint_file
   use m_kinds, only: i8
   use m_constants, only: exit_files, exit_input, program_version
   use m_errors, only: error_t, fail
   use m_communicator, only: communicator_t
   use m_checksum, only: text_checksum, file_checksum, checksum_digits
   use m_filesystem, only: path_t, list_files, is_directory, rename_file, remove_file, sync_file
   use m_part_file, only: part_name
   use m_text, only: to_text
   use m_state, only: state_format
   implicit none
   private
   public :: checkpoint_name, seal_checkpoint, find_checkpoint, remove_checkpoints, remove_parts

   integer, parameter, public :: seal_length = 512

   integer, parameter :: digits_of_step = 12
   character(len=*), parameter :: any_checkpoint = 'checkpoint_'//repeat('[0-9]', digits_of_step)//'.h5'
   character(len=*), parameter :: magic = 'gimp3d checkpoint'
   character(len=1), parameter :: newline = achar(10)

contains

   !> `checkpoint_<step>.h5` with the step in 12 digits, so that names sort in the order of steps.
   pure function checkpoint_name(step) result(name)
      integer(i8), intent(in) :: step
      character(len=:), allocatable :: name
      character(len=24) :: digits
      write (digits, '(i0.12)') step ! digits_of_step
      name = 'checkpoint_'//trim(digits)//'.h5'
   end function checkpoint_name

   !> The seal in front of a checkpoint.
   pure function seal_text(format, program, bytes, digits) result(text)
      character(len=*), intent(in) :: format, program, digits
      integer(i8), intent(in) :: bytes
      character(len=seal_length) :: text
      integer, parameter :: last = seal_length - checksum_digits - 1
      text = magic//newline//'format '//format//newline//'program '//program//newline//'bytes '// &
             to_text(bytes)//newline//'checksum '//digits//newline
      text(last + 1:) = text_checksum(text(:last))//newline
   end function seal_text

   !> Collective: write the seal of `<path>.part`, an HDF5 file with room in front, and once all of it is on
   !> the disk give it its final name.
   subroutine seal_checkpoint(communicator, path, error)
      type(communicator_t), intent(in) :: communicator
      character(len=*), intent(in) :: path
      type(error_t), intent(inout) :: error
      character(len=checksum_digits) :: digits
      character(len=256) :: reason
      integer(i8) :: bytes
      integer :: unit, status
      logical :: ok
      if (error%happened()) return
      bytes = size_of(communicator, part_name(path))
      call file_checksum(communicator, part_name(path), seal_length + 1_i8, bytes, digits, ok)
      if (.not. ok) call fail(error, exit_files, 'cannot write '//path//': it cannot be read back')
      if (communicator%is_root() .and. ok) then
         open (newunit=unit, file=part_name(path), access='stream', form='unformatted', action='readwrite', &
               status='old', iostat=status, iomsg=reason)
         if (status == 0) write (unit, pos=1, iostat=status, iomsg=reason) &
            seal_text(to_text(state_format), program_version, bytes - seal_length, digits)
         if (status == 0) close (unit, iostat=status, iomsg=reason)
         if (status /= 0) call fail(error, exit_files, 'cannot write '//path//': '//trim(reason))
         if (status == 0) then
            call sync_file(part_name(path), ok)
            if (ok) call rename_file(part_name(path), path, ok)
            if (ok) call sync_file(path(:index(path, '/', back=.true.)), ok)
            if (.not. ok) call fail(error, exit_files, 'cannot write '//path//': fsync failed; check the '// &
               'disk or file system')
         end if
      end if
      if (communicator%is_root() .and. error%happened()) call remove_file(part_name(path), ok)
      call communicator%agree(error)
   end subroutine seal_checkpoint

   !> Collective: find the latest complete checkpoint of a directory. Newer ones that are damaged are skipped;
   !> `note` lists them (empty: none). No checkpoint, or one of another format, is an input error; only
   !> damaged ones are a file error.
   subroutine find_checkpoint(communicator, directory, path, note, error)
      type(communicator_t), intent(in) :: communicator
      character(len=*), intent(in) :: directory
      character(len=:), allocatable, intent(out) :: path, note
      type(error_t), intent(inout) :: error
      type(path_t), allocatable :: paths(:)
      character(len=:), allocatable :: fault, newest
      integer :: n, count
      path = ''
      note = ''
      newest = ''
      if (error%happened()) return
      if (communicator%is_root()) call list_files(directory, any_checkpoint, paths)
      if (.not. allocated(paths)) allocate (paths(0))
      count = int(communicator%sum_count(size(paths, kind=i8)))
      if (count == 0) then
         if (communicator%is_root()) then
            fault = directory//' holds no checkpoint'
            if (.not. is_directory(directory)) fault = directory//' is not there, or is no directory'
            call fail(error, exit_input, 'cannot restart from '//directory//': '//fault)
         end if
         call communicator%agree(error)
         return
      end if
      do n = count, 1, -1
         if (communicator%is_root()) path = paths(n)%text
         call communicator%broadcast_text(path, 0)
         call judge(communicator, path, fault, error)
         if (error%happened()) return
         if (fault == '') exit
         if (note == '') newest = path//' '//fault
         if (note == '') note = path//' '//fault
      end do
      if (fault == '' .and. note /= '') note = note//': going on from '//path
      if (fault /= '') call fail(error, exit_files, 'cannot restart from '//directory// &
                                 ': it holds no complete checkpoint; '//newest)
   end subroutine find_checkpoint

   !> Collective: the fault of a file, in words that follow its name; empty if it is complete.
   subroutine judge(communicator, path, fault, error)
      type(communicator_t), intent(in) :: communicator
      character(len=*), intent(in) :: path
      character(len=:), allocatable, intent(out) :: fault
      type(error_t), intent(inout) :: error
      character(len=:), allocatable :: seal, digits
      character(len=checksum_digits) :: found
      character(len=seal_length) :: expected
      character(len=18) :: length_text
      integer(i8) :: bytes, length
      integer :: unit, status
      logical :: ok
      fault = ''
      seal = ''
      if (communicator%is_root()) then
         seal = repeat(' ', seal_length)
         open (newunit=unit, file=path, access='stream', form='unformatted', action='read', status='old', &
               iostat=status)
         if (status == 0) read (unit, iostat=status) seal
         if (status /= 0) seal = ''
         close (unit, iostat=status)
      end if
      call communicator%broadcast_text(seal, 0)
      if (len(seal) < seal_length) then
         fault = 'is cut short or cannot be read'
         return
      end if
      digits = value_of(seal, 'checksum')
      length_text = value_of(seal, 'bytes')
      length = -1
      if (verify(trim(length_text), '0123456789') == 0 .and. length_text /= '') read (length_text, *, &
            iostat=status) length
      expected = seal_text(value_of(seal, 'format'), value_of(seal, 'program'), length, digits)
      if (expected /= seal) then
         fault = 'is damaged'
         return
      end if
      if (value_of(seal, 'format') /= to_text(state_format)) then
         call fail(error, exit_input, 'cannot restart from '//path//': it has the format '// &
                   value_of(seal, 'format')//' of gimp3d '//value_of(seal, 'program')//'; this is gimp3d '// &
                   program_version//', which reads format '//to_text(state_format))
         return
      end if
      bytes = size_of(communicator, path)
      if (bytes /= length + seal_length) then
         fault = 'is '//to_text(bytes)//' bytes long, not '//to_text(length + seal_length)
      else
         call file_checksum(communicator, path, seal_length + 1_i8, bytes, found, ok)
         if (.not. ok .or. found /= digits) fault = 'is damaged'
      end if
   end subroutine judge

   !> The text after a word at the beginning of a line; empty if no line begins with it.
   pure function value_of(seal, word) result(value)
      character(len=*), intent(in) :: seal, word
      character(len=:), allocatable :: value
      integer :: first, last
      value = ''
      first = index(seal, newline//word//' ')
      if (first == 0) return
      first = first + len(word) + 2
      last = index(seal(first:), newline)
      if (last > 1) value = seal(first:first + last - 2)
   end function value_of

   !> Collective: the length of a file as seen by rank 0; -1 if it does not exist.
   integer(i8) function size_of(communicator, path) result(bytes)
      type(communicator_t), intent(in) :: communicator
      character(len=*), intent(in) :: path
      bytes = 0
      if (communicator%is_root()) inquire (file=path, size=bytes)
      bytes = communicator%sum_count(bytes)
   end function size_of

   !> One rank: remove incomplete files from a directory, with MPI's auxiliary files, and the remains of stale
   !> locks; complete files stay.
   subroutine remove_parts(directory)
      character(len=*), intent(in) :: directory
      character(len=100), parameter :: begun(*) = [character(len=100) :: any_checkpoint//'.part*', &
                                                   'particles_[0-9]*.part*', '*.dat.part', '*.xdmf.part', &
                                                   'case.nml.part', 'run.lock.*.part', 'run.lock.*.part.old']
      type(path_t), allocatable :: paths(:)
      integer :: k, n
      logical :: ignored
      do k = 1, size(begun)
         call list_files(directory, trim(begun(k)), paths)
         do n = 1, size(paths)
            call remove_file(paths(n)%text, ignored)
         end do
      end do
   end subroutine remove_parts

   !> One rank: remove the checkpoints of a directory except those to be kept (paths; may be empty).
   subroutine remove_checkpoints(directory, keep, keep_too)
      character(len=*), intent(in) :: directory, keep, keep_too
      type(path_t), allocatable :: paths(:)
      integer :: n
      logical :: ignored
      call list_files(directory, any_checkpoint, paths)
      do n = 1, size(paths)
         if (paths(n)%text == keep .or. paths(n)%text == keep_too) cycle
         call remove_file(paths(n)%text, ignored)
      end do
   end subroutine remove_checkpoints

end module m_checkpoint_file
