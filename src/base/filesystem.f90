!> Directories and files, through the C library: create, test, rename, remove, list, synchronise to the disk,
!> and read.
module m_filesystem
   use, intrinsic :: iso_c_binding, only: c_char, c_int, c_int64_t, c_size_t, c_intptr_t, c_ptr, &
                     c_null_char, &
                                          c_null_ptr, c_associated, c_f_pointer
   implicit none
   private
   public :: make_directory, can_make_directory, is_directory, is_writable, rename_file, remove_file
   public :: read_file, read_standard_input, sync_file, list_files, same_file, system_reason, system_error
   public :: link_file, create_file, touch_file, time_of_file, locks_are_refused, never_ends

   integer(c_int), parameter :: no_such_file = 2 ! errno
   integer(c_int), parameter :: may_search = 1, may_write = 2, permissions = 511 ! rwxrwxrwx, less the umask
   integer, parameter :: piece = 65536
   integer, parameter :: longest_path = 4096     ! PATH_MAX of Linux

   !> A path in a list.
   type, public :: path_t
      character(len=:), allocatable :: text
   end type path_t

   interface
      integer(c_int) function c_access(path, mode) bind(c, name='access')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: path(*)
         integer(c_int), value :: mode
      end function c_access
      integer(c_int) function c_mkdir(path, mode) bind(c, name='mkdir')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: path(*)
         integer(c_int), value :: mode
      end function c_mkdir
      type(c_ptr) function c_mkdtemp(template) bind(c, name='mkdtemp')
         import :: c_ptr, c_char
         character(kind=c_char), intent(inout) :: template(*) !< ends with XXXXXX, which is replaced
      end function c_mkdtemp
      integer(c_int) function c_rmdir(path) bind(c, name='rmdir')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: path(*)
      end function c_rmdir
      integer(c_int) function c_unlink(path) bind(c, name='unlink')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: path(*)
      end function c_unlink
      integer(c_int) function c_rename(old, new) bind(c, name='rename')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: old(*), new(*)
      end function c_rename
      integer(c_int) function c_link(old, new) bind(c, name='link')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: old(*), new(*)
      end function c_link
      integer(c_int) function c_utimes(path, times) bind(c, name='utimes')
         import :: c_char, c_int, c_ptr
         character(kind=c_char), intent(in) :: path(*)
         type(c_ptr), value :: times
      end function c_utimes
      integer(c_int) function c_statx(directory, path, flags, mask, found) bind(c, name='statx')
         import :: c_char, c_int, c_int64_t
         integer(c_int), value :: directory, flags, mask
         character(kind=c_char), intent(in) :: path(*)
         integer(c_int64_t), intent(out) :: found(*)
      end function c_statx
      integer(c_int) function c_flock(descriptor, operation) bind(c, name='flock')
         import :: c_int
         integer(c_int), value :: descriptor, operation
      end function c_flock
      integer(c_int) function c_open(path, flags) bind(c, name='open')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: path(*)
         integer(c_int), value :: flags
      end function c_open
      integer(c_int) function c_fsync(descriptor) bind(c, name='fsync')
         import :: c_int
         integer(c_int), value :: descriptor
      end function c_fsync
      integer(c_int) function c_close(descriptor) bind(c, name='close')
         import :: c_int
         integer(c_int), value :: descriptor
      end function c_close
      integer(c_int) function c_glob(pattern, flags, on_error, found) bind(c, name='glob')
         import :: c_char, c_int, c_ptr, c_intptr_t
         character(kind=c_char), intent(in) :: pattern(*)
         integer(c_int), value :: flags
         type(c_ptr), value :: on_error
         integer(c_intptr_t), intent(inout) :: found(*)
      end function c_glob
      subroutine c_globfree(found) bind(c, name='globfree')
         import :: c_intptr_t
         integer(c_intptr_t), intent(inout) :: found(*)
      end subroutine c_globfree
      integer(c_size_t) function c_strlen(text) bind(c, name='strlen')
         import :: c_ptr, c_size_t
         type(c_ptr), value :: text
      end function c_strlen
      type(c_ptr) function c_realpath(path, resolved) bind(c, name='realpath')
         import :: c_char, c_ptr
         character(kind=c_char), intent(in) :: path(*)
         character(kind=c_char), intent(out) :: resolved(*)
      end function c_realpath
      integer(c_int) function c_isatty(descriptor) bind(c, name='isatty')
         import :: c_int
         integer(c_int), value :: descriptor
      end function c_isatty
      type(c_ptr) function c_fopen(path, mode) bind(c, name='fopen')
         import :: c_char, c_ptr
         character(kind=c_char), intent(in) :: path(*), mode(*)
      end function c_fopen
      type(c_ptr) function c_fdopen(descriptor, mode) bind(c, name='fdopen')
         import :: c_char, c_int, c_ptr
         integer(c_int), value :: descriptor
         character(kind=c_char), intent(in) :: mode(*)
      end function c_fdopen
      integer(c_size_t) function c_fread(buffer, size, count, stream) bind(c, name='fread')
         import :: c_char, c_size_t, c_ptr
         character(kind=c_char), intent(out) :: buffer(*)
         integer(c_size_t), value :: size, count
         type(c_ptr), value :: stream
      end function c_fread
      integer(c_size_t) function c_fwrite(buffer, size, count, stream) bind(c, name='fwrite')
         import :: c_char, c_size_t, c_ptr
         character(kind=c_char), intent(in) :: buffer(*)
         integer(c_size_t), value :: size, count
         type(c_ptr), value :: stream
      end function c_fwrite
      integer(c_int) function c_ferror(stream) bind(c, name='ferror')
         import :: c_int, c_ptr
         type(c_ptr), value :: stream
      end function c_ferror
      integer(c_int) function c_fclose(stream) bind(c, name='fclose')
         import :: c_int, c_ptr
         type(c_ptr), value :: stream
      end function c_fclose
      type(c_ptr) function c_errno_location() bind(c, name='__errno_location')
         import :: c_ptr
      end function c_errno_location
      type(c_ptr) function c_strerror(number) bind(c, name='strerror')
         import :: c_ptr, c_int
         integer(c_int), value :: number
      end function c_strerror
   end interface

contains

   !> Create a directory and missing ones above it. `ok` is false if it does not exist afterwards.
   recursive subroutine make_directory(path, ok)
      character(len=*), intent(in) :: path
      logical, intent(out) :: ok
      character(len=:), allocatable :: above
      ok = is_directory(path)
      if (ok) return
      above = parent(path)
      if (above == path) return
      call make_directory(above, ok)
      if (.not. ok) return
      if (c_mkdir(path//c_null_char, permissions) /= 0) ok = is_directory(path)
   end subroutine make_directory

   !> True when a directory exists and is writable, or could be created: a directory is created below a unique
   !> name, and removed again, as another run may start to use the directory itself at any time.
   logical function can_make_directory(path) result(ok)
      character(len=*), intent(in) :: path
      character(len=:), allocatable :: first, own
      if (is_directory(path)) then
         ok = is_writable(path)
         return
      end if
      first = first_missing(path)
      ok = c_access(first//c_null_char, 0_c_int) /= 0 ! else it is the name of a file
      if (ok) ok = system_error() == no_such_file     ! else the name is invalid
      if (.not. ok) return
      own = parent(first)//'/.gimp3d_XXXXXX'//c_null_char
      ok = c_associated(c_mkdtemp(own))
      if (.not. ok) return
      own = own(:len(own) - 1)
      associate (like => own//path(len(first) + 1:))
         call make_directory(like, ok)
         if (ok) ok = is_writable(like)
         call remove_empty(like, own)
      end associate
   end function can_make_directory

   !> Remove the empty directories from `path` up to `first`.
   recursive subroutine remove_empty(path, first)
      character(len=*), intent(in) :: path, first
      integer :: status
      status = c_rmdir(path//c_null_char)
      if (path /= first) call remove_empty(parent(path), first)
   end subroutine remove_empty

   !> The topmost directory of `path` that does not exist.
   recursive function first_missing(path) result(first)
      character(len=*), intent(in) :: path
      character(len=:), allocatable :: first
      character(len=:), allocatable :: above
      above = parent(path)
      first = path
      if (above == path) return
      if (.not. is_directory(above)) first = first_missing(above)
   end function first_missing

   !> The part before the last / of a path; '.' if there is none.
   pure function parent(path) result(above)
      character(len=*), intent(in) :: path
      character(len=:), allocatable :: above
      integer :: last
      last = len(path)
      do while (last > 1)
         if (path(last:last) /= '/') exit
         last = last - 1
      end do
      last = index(path(:last), '/', back=.true.)
      do while (last > 1)
         if (path(last:last) /= '/') exit
         last = last - 1
      end do
      if (last == 0) then
         above = '.'
      else if (last == 1) then
         above = '/'
      else
         above = path(:last)
      end if
   end function parent

   logical function is_directory(path)
      character(len=*), intent(in) :: path
      is_directory = c_access(path//'/.'//c_null_char, 0_c_int) == 0
   end function is_directory

   !> True when new files can be created in this directory.
   logical function is_writable(path)
      character(len=*), intent(in) :: path
      is_writable = c_access(path//'/.'//c_null_char, may_write + may_search) == 0
   end function is_writable

   !> Rename a file, atomically replacing a file with the new name.
   subroutine rename_file(old, new, ok)
      character(len=*), intent(in) :: old, new
      logical, intent(out) :: ok
      ok = c_rename(old//c_null_char, new//c_null_char) == 0
   end subroutine rename_file

   subroutine remove_file(path, ok)
      character(len=*), intent(in) :: path
      logical, intent(out) :: ok
      ok = c_unlink(path//c_null_char) == 0
   end subroutine remove_file

   !> Create a hard link, unless a file of the new name exists: of several concurrent attempts, also on
   !> several machines, one succeeds.
   subroutine link_file(old, new, ok)
      character(len=*), intent(in) :: old, new
      logical, intent(out) :: ok
      ok = c_link(old//c_null_char, new//c_null_char) == 0
   end subroutine link_file

   !> Create a new file with a text in it; for file systems without hard links.
   subroutine create_file(path, text, ok)
      character(len=*), intent(in) :: path, text
      logical, intent(out) :: ok
      type(c_ptr) :: stream
      stream = c_fopen(path//c_null_char, 'wx'//c_null_char)
      ok = c_associated(stream)
      if (.not. ok) return
      ok = c_fwrite(text, 1_c_size_t, len(text, c_size_t), stream) == len(text)
      ok = c_fclose(stream) == 0 .and. ok
   end subroutine create_file

   !> Set the modification time of a file to now, by the clock of its file system.
   subroutine touch_file(path, ok)
      character(len=*), intent(in) :: path
      logical, intent(out) :: ok
      ok = c_utimes(path//c_null_char, c_null_ptr) == 0
   end subroutine touch_file

   !> Modification time of a file, s by the clock of its file system; -1 if it does not exist.
   integer(c_int64_t) function time_of_file(path) result(seconds)
      character(len=*), intent(in) :: path
      integer(c_int), parameter :: here = -100, modified = 64
      integer, parameter :: at = 15 ! stx_mtime.tv_sec, in words of 8 bytes
      integer(c_int64_t) :: found(32)
      seconds = -1
      if (c_statx(here, path//c_null_char, 0_c_int, modified, found) == 0) seconds = found(at)
   end function time_of_file

   !> True when a path is a file without a fixed end: a pipe, a socket, a device. False if it does not exist.
   logical function never_ends(path)
      character(len=*), intent(in) :: path
      integer(c_int), parameter :: here = -100, kind_of_file = 1
      integer, parameter :: at = 4 ! stx_mode is in the upper half of this word of 8 bytes
      integer(c_int64_t), parameter :: kinds = 61440, regular = 32768, directory = 16384
      integer(c_int64_t) :: found(32), kind
      never_ends = .false.
      if (c_statx(here, path//c_null_char, 0_c_int, kind_of_file, found) /= 0) return
      kind = iand(shiftr(found(at), 32), kinds)
      never_ends = kind /= regular .and. kind /= directory
   end function never_ends

   !> True when the file system of a file does not support locks, which differs from a file locked by another
   !> process.
   logical function locks_are_refused(path) result(refused)
      character(len=*), intent(in) :: path
      integer(c_int), parameter :: shared_at_once = 5, would_block = 11
      integer(c_int) :: descriptor, ignored
      refused = .false.
      descriptor = c_open(path//c_null_char, 0_c_int)
      if (descriptor < 0) return
      if (c_flock(descriptor, shared_at_once) /= 0) refused = system_error() /= would_block
      ignored = c_close(descriptor)
   end function locks_are_refused

   !> Wait until a file (or the entries of a directory) is on the disk.
   subroutine sync_file(path, ok)
      character(len=*), intent(in) :: path
      logical, intent(out) :: ok
      integer(c_int) :: descriptor, ignored
      descriptor = c_open(path//c_null_char, 0_c_int) ! read only: 0 on every Unix
      ok = descriptor >= 0
      if (.not. ok) return
      ok = c_fsync(descriptor) == 0
      ignored = c_close(descriptor)
   end subroutine sync_file

   !> The paths of the files in a directory whose names match a shell pattern, in alphabetical order.
   subroutine list_files(directory, pattern, paths)
      character(len=*), intent(in) :: directory, pattern
      type(path_t), allocatable, intent(out) :: paths(:)
      integer(c_intptr_t) :: found(64) ! a glob_t: number of paths, the array of texts, then unused members
      type(c_ptr), pointer :: texts(:)
      character(kind=c_char), pointer :: text(:)
      character(len=:), allocatable :: plain
      integer :: i, n
      plain = ''
      do i = 1, len(directory)
         if (index('*?[]\', directory(i:i)) > 0) plain = plain//'\'
         plain = plain//directory(i:i)
      end do
      found = 0
      if (c_glob(plain//'/'//pattern//c_null_char, 0_c_int, c_null_ptr, found) /= 0) then
         allocate (paths(0))
         return
      end if
      allocate (paths(found(1)))
      call c_f_pointer(transfer(found(2), c_null_ptr), texts, [size(paths)])
      do n = 1, size(paths)
         call c_f_pointer(texts(n), text, [int(c_strlen(texts(n)))])
         allocate (character(len=size(text)) :: paths(n)%text)
         do i = 1, size(text)
            paths(n)%text(i:i) = text(i)
         end do
      end do
      call c_globfree(found)
   end subroutine list_files

   !> True when two paths are the same existing file or directory.
   logical function same_file(one, other)
      character(len=*), intent(in) :: one, other
      character(kind=c_char) :: first(longest_path), second(longest_path)
      integer :: i
      same_file = .false.
      if (.not. c_associated(c_realpath(one//c_null_char, first))) return
      if (.not. c_associated(c_realpath(other//c_null_char, second))) return
      do i = 1, longest_path
         if (first(i) /= second(i)) return
         if (first(i) == c_null_char) exit
      end do
      same_file = .true.
   end function same_file

   !> All bytes of a file, or its first `limit` + 1 when it is longer than that.
   subroutine read_file(path, limit, text, ok)
      character(len=*), intent(in) :: path
      integer, intent(in) :: limit
      character(len=:), allocatable, intent(out) :: text
      logical, intent(out) :: ok
      call read_stream(c_fopen(path//c_null_char, 'rb'//c_null_char), limit, text, ok)
   end subroutine read_file

   !> All bytes of standard input, as read_file. A terminal counts as empty, since nobody types a scene.
   subroutine read_standard_input(limit, text, ok)
      integer, intent(in) :: limit
      character(len=:), allocatable, intent(out) :: text
      logical, intent(out) :: ok
      ok = .true.
      text = ''
      if (c_isatty(0_c_int) == 1) return
      call read_stream(c_fdopen(0_c_int, 'rb'//c_null_char), limit, text, ok)
   end subroutine read_standard_input

   subroutine read_stream(stream, limit, text, ok)
      type(c_ptr), intent(in) :: stream
      integer, intent(in) :: limit
      character(len=:), allocatable, intent(out) :: text
      logical, intent(out) :: ok
      character(len=:), allocatable :: buffer, larger
      integer :: length, count, status
      text = ''
      ok = c_associated(stream)
      if (.not. ok) return
      allocate (character(len=piece) :: buffer)
      length = 0
      do
         if (length + piece > len(buffer)) then
            allocate (character(len=2*len(buffer) + piece) :: larger)
            larger(:length) = buffer(:length)
            call move_alloc(larger, buffer)
         end if
         count = int(c_fread(buffer(length + 1:length + piece), 1_c_size_t, int(piece, c_size_t), stream))
         length = length + count
         if (count < piece .or. length > limit) exit
      end do
      ok = c_ferror(stream) == 0
      status = c_fclose(stream)
      text = buffer(:min(length, limit + 1))
   end subroutine read_stream

   !> The error number (errno) of the last failed call of the C library.
   integer(c_int) function system_error()
      integer(c_int), pointer :: number
      call c_f_pointer(c_errno_location(), number)
      system_error = number
   end function system_error

   !> The system's message on the last failed call of the C library.
   function system_reason() result(reason)
      character(len=:), allocatable :: reason
      character(kind=c_char), pointer :: letters(:)
      type(c_ptr) :: text
      integer :: i
      text = c_strerror(system_error())
      call c_f_pointer(text, letters, [c_strlen(text)])
      allocate (character(len=size(letters)) :: reason)
      do i = 1, size(letters)
         reason(i:i) = letters(i)
      end do
   end function system_reason

end module m_filesystem
