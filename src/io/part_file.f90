!> Files that are either complete or absent: they are written as `<path>.part` and renamed when complete.
module m_part_file
   use, intrinsic :: iso_c_binding, only: c_char, c_int, c_long, c_null_char
   use m_kinds, only: i8
   use m_constants, only: exit_files
   use m_errors, only: error_t, fail
   use m_communicator, only: communicator_t
   use m_filesystem, only: rename_file, remove_file, system_reason, locks_are_refused
   use m_text, only: to_text
   implicit none
   private
   public :: lock_hint
   public :: part_name, publish_part, discard_part, empty_part, begin_shared_part, finish_shared_part

   integer(c_int), parameter :: permissions = 438 ! rw-rw-rw-, less the umask
   integer(c_int), parameter :: input_output_error = 5, too_large = 27, no_space = 28, over_quota = 122

   interface
      integer(c_int) function c_creat(path, mode) bind(c, name='creat')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: path(*)
         integer(c_int), value :: mode
      end function c_creat
      integer(c_int) function c_reserve(descriptor, offset, length) bind(c, name='posix_fallocate')
         import :: c_int, c_long
         integer(c_int), value :: descriptor
         integer(c_long), value :: offset, length
      end function c_reserve
      integer(c_int) function c_close(descriptor) bind(c, name='close')
         import :: c_int
         integer(c_int), value :: descriptor
      end function c_close
      integer(c_int) function c_truncate(path, length) bind(c, name='truncate')
         import :: c_char, c_int, c_long
         character(kind=c_char), intent(in) :: path(*)
         integer(c_long), value :: length
      end function c_truncate
   end interface

contains

   !> The temporary name of a file being written.
   pure function part_name(path) result(name)
      character(len=*), intent(in) :: path
      character(len=:), allocatable :: name
      name = path//'.part'
   end function part_name

   !> Hint for a message about a file that a library could not open, write or read: whether missing file locks
   !> may be the cause. HDF5 locks the files it opens unless told otherwise.
   function lock_hint(path) result(words)
      character(len=*), intent(in) :: path
      character(len=:), allocatable :: words
      words = ''
      if (locks_are_refused(path)) &
         words = '; its file system refuses to lock files (as NFS and Lustre may): '// &
                 'set HDF5_USE_FILE_LOCKING=FALSE in the environment, or have locking turned on there'
   end function lock_hint

   !> One rank: remove the part of a file that will not be finished.
   subroutine discard_part(path)
      character(len=*), intent(in) :: path
      logical :: ignored
      call remove_file(part_name(path), ignored)
   end subroutine discard_part

   !> One rank: rename `<path>.part`, closed, to its final name, or remove it after an error.
   subroutine publish_part(path, error)
      character(len=*), intent(in) :: path
      type(error_t), intent(inout) :: error
      logical :: ok
      if (.not. error%happened()) then
         call rename_file(part_name(path), path, ok)
         if (.not. ok) call fail(error, exit_files, 'cannot write '//path//': '//part_name(path)// &
                                 ' cannot be renamed to it')
      end if
      if (error%happened()) call discard_part(path)
   end subroutine publish_part

   !> Free the disk space of `<path>.part` while it may still be open.
   subroutine empty_part(path)
      character(len=*), intent(in) :: path
      integer(c_int) :: ignored
      ignored = c_truncate(part_name(path)//c_null_char, 0_c_long)
   end subroutine empty_part

   !> Collective: create `<path>.part`, so that all ranks can open it, and check that the disk has room for
   !> `bytes`: libraries that meet a full disk in the middle of a shared file do not recover on all ranks. The
   !> error gives the reason.
   subroutine begin_shared_part(communicator, path, bytes, error)
      type(communicator_t), intent(in) :: communicator
      character(len=*), intent(in) :: path
      integer(i8), intent(in) :: bytes
      type(error_t), intent(inout) :: error
      if (communicator%is_root() .and. .not. error%happened()) call reserve(path, bytes, error)
      call communicator%agree(error)
   end subroutine begin_shared_part

   !> Create the part, empty, and reserve disk space for it. File systems that cannot reserve are trusted.
   subroutine reserve(path, bytes, error)
      character(len=*), intent(in) :: path
      integer(i8), intent(in) :: bytes
      type(error_t), intent(inout) :: error
      integer(c_int) :: descriptor, status, ignored
      character(len=:), allocatable :: reason
      descriptor = c_creat(part_name(path)//c_null_char, permissions)
      if (descriptor < 0) then
         call fail(error, exit_files, 'cannot write '//path//': '//system_reason())
         return
      end if
      status = c_reserve(descriptor, 0_c_long, int(max(1_i8, bytes), c_long))
      ignored = c_close(descriptor)
      select case (status)
      case (no_space)
         reason = 'the disk is full'
      case (over_quota)
         reason = 'the quota of the disk is used up'
      case (too_large)
         reason = 'the file would be larger than is allowed'
      case (input_output_error)
         reason = 'the disk reports an input/output error'
      case default
         return
      end select
      call fail(error, exit_files, 'cannot write '//path//', '//to_text(bytes)//' bytes: '//reason)
      call discard_part(path)
   end subroutine reserve

   !> Collective: all ranks have closed `<path>.part`, which must be `bytes` long (any length if negative). If
   !> no rank holds an error it gets its final name, else it is removed. All ranks return with the same error.
   subroutine finish_shared_part(communicator, path, bytes, error)
      type(communicator_t), intent(in) :: communicator
      character(len=*), intent(in) :: path
      integer(i8), intent(in) :: bytes
      type(error_t), intent(inout) :: error
      integer(i8) :: found
      call communicator%agree(error)
      if (communicator%is_root()) then
         inquire (file=part_name(path), size=found)
         if (bytes >= 0 .and. found /= bytes) then
            call fail(error, exit_files, 'cannot write '//path//': '//to_text(found)//' of '// &
                      to_text(bytes)// &
                      ' bytes are on the disk')
         end if
         call publish_part(path, error)
      end if
      call communicator%agree(error)
   end subroutine finish_shared_part

end module m_part_file
