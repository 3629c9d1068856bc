!> Text files through the C library. The Fortran library reports success when a full disk has stored nothing
!> (libgfortran 12: write, flush and close alike), which would truncate files silently; here every failure is
!> an error. The file on the disk always ends with a whole line, so that it can be read while it grows.
module m_text_file
   use, intrinsic :: iso_c_binding, only: c_char, c_int, c_long, c_size_t, c_null_char
   use m_kinds, only: i8
   use m_constants, only: exit_files
   use m_errors, only: error_t, fail
   use m_filesystem, only: system_reason
   use m_part_file, only: part_name
   implicit none
   private

   integer, parameter :: room = 16384 !< characters of the buffer

   !> A text file being written under the name of its part. Errors give `path` and the system's reason.
   type, public :: text_file_t
      private
      character(len=:), allocatable :: path
      character(len=:), allocatable :: waiting !< buffer, `used` characters in use: whole lines
      integer :: used = 0
      integer(i8) :: written = 0               !< bytes passed to the system
      integer(c_int) :: descriptor = -1
   contains
      procedure :: open => open_file
      procedure :: put
      procedure :: flush => flush_file
      procedure :: take_back
      procedure :: overwrite
      procedure :: bytes
      procedure :: close => close_file
      procedure, private :: hand_over
      procedure, private :: cut
      procedure, private :: complain
   end type text_file_t

   character(len=1), parameter :: newline = achar(10)
   integer(c_int), parameter :: permissions = 438 ! rw-rw-rw-, less the umask
   integer(c_int), parameter :: from_start = 0

   interface
      integer(c_int) function c_creat(path, mode) bind(c, name='creat')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: path(*)
         integer(c_int), value :: mode
      end function c_creat
      integer(c_size_t) function c_write(descriptor, bytes, count) bind(c, name='write')
         import :: c_char, c_int, c_size_t
         integer(c_int), value :: descriptor
         character(kind=c_char), intent(in) :: bytes(*)
         integer(c_size_t), value :: count
      end function c_write
      integer(c_size_t) function c_pwrite(descriptor, bytes, count, offset) bind(c, name='pwrite')
         import :: c_char, c_int, c_size_t, c_long
         integer(c_int), value :: descriptor
         character(kind=c_char), intent(in) :: bytes(*)
         integer(c_size_t), value :: count
         integer(c_long), value :: offset
      end function c_pwrite
      integer(c_long) function c_lseek(descriptor, offset, whence) bind(c, name='lseek')
         import :: c_int, c_long
         integer(c_int), value :: descriptor, whence
         integer(c_long), value :: offset
      end function c_lseek
      integer(c_int) function c_ftruncate(descriptor, length) bind(c, name='ftruncate')
         import :: c_int, c_long
         integer(c_int), value :: descriptor
         integer(c_long), value :: length
      end function c_ftruncate
      integer(c_int) function c_close(descriptor) bind(c, name='close')
         import :: c_int
         integer(c_int), value :: descriptor
      end function c_close
   end interface

contains

   !> Create the part of `path`, empty.
   subroutine open_file(self, path, error)
      class(text_file_t), intent(out) :: self
      character(len=*), intent(in) :: path
      type(error_t), intent(inout) :: error
      self%path = path
      allocate (character(len=room) :: self%waiting)
      self%descriptor = c_creat(part_name(path)//c_null_char, permissions)
      if (self%descriptor < 0) call self%complain(error)
   end subroutine open_file

   !> Append a line, or several. It may be written to the disk later.
   subroutine put(self, line, error)
      class(text_file_t), intent(inout) :: self
      character(len=*), intent(in) :: line
      type(error_t), intent(inout) :: error
      integer :: length
      length = len(line) + 1
      if (self%used + length > room) call self%flush(error)
      if (length > room) then
         call self%hand_over(line//newline, error)
      else
         self%waiting(self%used + 1:self%used + length) = line//newline
         self%used = self%used + length
      end if
   end subroutine put

   !> Write the buffer to the file.
   subroutine flush_file(self, error)
      class(text_file_t), intent(inout) :: self
      type(error_t), intent(inout) :: error
      if (self%used > 0) call self%hand_over(self%waiting(:self%used), error)
      self%used = 0
   end subroutine flush_file

   !> Pass whole lines to the system: all of them, or none and an error.
   subroutine hand_over(self, text, error)
      class(text_file_t), intent(inout) :: self
      character(len=*), intent(in) :: text
      type(error_t), intent(inout) :: error
      integer(c_size_t) :: taken, count
      taken = 0
      do while (taken < len(text))
         count = c_write(self%descriptor, text(taken + 1:), len(text, c_size_t) - taken)
         if (count <= 0) then
            call self%complain(error)
            call self%cut(self%written, error)
            return
         end if
         taken = taken + count
      end do
      self%written = self%written + taken
   end subroutine hand_over

   !> Remove a number of bytes from the end.
   subroutine take_back(self, bytes, error)
      class(text_file_t), intent(inout) :: self
      integer(i8), intent(in) :: bytes
      type(error_t), intent(inout) :: error
      call self%flush(error)
      call self%cut(self%written - bytes, error)
   end subroutine take_back

   !> Overwrite text that was already written to the file, from byte `at` (0-based) on.
   subroutine overwrite(self, at, text, error)
      class(text_file_t), intent(inout) :: self
      integer(i8), intent(in) :: at
      character(len=*), intent(in) :: text
      type(error_t), intent(inout) :: error
      integer(c_size_t) :: count
      count = c_pwrite(self%descriptor, text, len(text, c_size_t), int(at, c_long))
      if (count /= len(text)) call self%complain(error)
   end subroutine overwrite

   !> Length of the file including the buffer, bytes.
   pure integer(i8) function bytes(self)
      class(text_file_t), intent(in) :: self
      bytes = self%written + self%used
   end function bytes

   !> Truncate the file to a number of bytes.
   subroutine cut(self, bytes, error)
      class(text_file_t), intent(inout) :: self
      integer(i8), intent(in) :: bytes
      type(error_t), intent(inout) :: error
      logical :: ok
      ok = c_ftruncate(self%descriptor, int(bytes, c_long)) == 0
      if (ok) ok = c_lseek(self%descriptor, int(bytes, c_long), from_start) == bytes
      if (.not. ok) call self%complain(error)
      if (ok) self%written = bytes
   end subroutine cut

   !> Close the file, which keeps its name.
   subroutine close_file(self, error)
      class(text_file_t), intent(inout) :: self
      type(error_t), intent(inout) :: error
      integer(c_int) :: status
      call self%flush(error)
      status = c_close(self%descriptor)
      self%descriptor = -1
      if (status /= 0) call self%complain(error)
   end subroutine close_file

   !> Error with the system's message on the last call.
   subroutine complain(self, error)
      class(text_file_t), intent(in) :: self
      type(error_t), intent(inout) :: error
      call fail(error, exit_files, 'cannot write '//self%path//': '//system_reason())
   end subroutine complain

end module m_text_file
