!> Processes of the machine: the identity of this one, and whether another one still runs.
module m_process
   use, intrinsic :: iso_c_binding, only: c_char, c_int, c_size_t, c_intptr_t, c_null_char
   use m_filesystem, only: read_file, system_error
   use m_text, only: to_text
   implicit none
   private
   public :: process_t, this_process

   !> A process, identified uniquely among all before and after it.
   type :: process_t
      character(len=:), allocatable :: host   !< name of the machine
      character(len=:), allocatable :: system !< its start, and the namespace of its process ids (a container
                                              !< has its own)
      integer :: id = 0
      character(len=:), allocatable :: start !< of the process, in ticks of the machine's clock; '0' if
                                             !< unknown
   contains
      procedure :: neighbours
      procedure :: runs
   end type process_t

   integer, parameter :: longest = 4096, name_length = 256
   integer(c_int), parameter :: no_such_process = 3
   integer, parameter :: start_field = 20 !< of /proc/PID/stat, counted after the name in brackets

   interface
      integer(c_int) function c_getpid() bind(c, name='getpid')
         import :: c_int
      end function c_getpid
      integer(c_int) function c_kill(id, number) bind(c, name='kill')
         import :: c_int
         integer(c_int), value :: id, number
      end function c_kill
      integer(c_int) function c_gethostname(name, length) bind(c, name='gethostname')
         import :: c_char, c_int, c_size_t
         character(kind=c_char), intent(out) :: name(*)
         integer(c_size_t), value :: length
      end function c_gethostname
      integer(c_intptr_t) function c_readlink(path, target, length) bind(c, name='readlink')
         import :: c_char, c_size_t, c_intptr_t
         character(kind=c_char), intent(in) :: path(*)
         character(kind=c_char), intent(out) :: target(*)
         integer(c_size_t), value :: length
      end function c_readlink
   end interface

contains

   type(process_t) function this_process() result(own)
      character(kind=c_char) :: letters(name_length)
      character(len=:), allocatable :: boot
      integer :: length, status
      logical :: ok
      letters = c_null_char
      status = c_gethostname(letters, int(name_length - 1, c_size_t))
      own%host = text_of(letters, findloc(letters, c_null_char, dim=1) - 1)
      if (status /= 0 .or. own%host == '') own%host = 'unknown'
      own%id = int(c_getpid())
      own%start = start_of(own%id)
      call read_file('/proc/sys/kernel/random/boot_id', longest, boot, ok)
      if (.not. ok) boot = 'unknown'
      length = int(c_readlink('/proc/self/ns/pid'//c_null_char, letters, int(name_length, c_size_t)))
      own%system = boot(:scan(boot//new_line('a'), new_line('a')) - 1)//' '//text_of(letters, max(0, length))
   end function this_process

   !> True when `other` belongs to the same start of the same machine, so that this process can check it.
   pure logical function neighbours(self, other)
      class(process_t), intent(in) :: self, other
      neighbours = self%host == other%host .and. self%system == other%system
   end function neighbours

   !> True when a process of this machine still runs: its id may have been reused since.
   logical function runs(self)
      class(process_t), intent(in) :: self
      character(len=:), allocatable :: start
      runs = .true.
      if (c_kill(int(self%id, c_int), 0_c_int) /= 0) runs = system_error() /= no_such_process
      if (.not. runs) return
      start = start_of(self%id)
      if (start /= '0' .and. self%start /= '0') runs = start == self%start
   end function runs

   !> Start of a process; '0' if unknown, 'ended' if it has ended but its parent has not collected it.
   function start_of(id) result(start)
      integer, intent(in) :: id
      character(len=:), allocatable :: start
      character(len=:), allocatable :: text
      character(len=24) :: fields(start_field)
      integer :: status
      logical :: ok
      start = '0'
      call read_file('/proc/'//to_text(id)//'/stat', longest, text, ok)
      if (.not. ok) return
      read (text(index(text, ')', back=.true.) + 1:), *, iostat=status) fields
      if (status /= 0) return
      start = trim(fields(start_field))
      if (scan(fields(1), 'ZX') == 1) start = 'ended'
   end function start_of

   pure function text_of(letters, length) result(text)
      character(kind=c_char), intent(in) :: letters(:)
      integer, intent(in) :: length
      character(len=length) :: text
      integer :: i
      do i = 1, length
         text(i:i) = letters(i)
      end do
   end function text_of

end module m_process
