!> How much memory the machines of a run can give, and how much a rank has had.
module m_memory
   use mpi_f08
   use m_kinds, only: wp, i8
   use m_communicator, only: communicator_t
   use m_filesystem, only: read_file
   implicit none
   private
   public :: free_memory, peak_memory

   integer, parameter :: longest = 65536 !< bytes of a file that the system shows
   real(wp), parameter :: unknown = huge(1.0_wp)

contains

   !> Collective: memory (bytes) that is free on all machines of the run together, within what a batch system allows; huge where
   !> the system does not say.
   real(wp) function free_memory(communicator) result(bytes)
      type(communicator_t), intent(in) :: communicator
      type(MPI_Comm) :: machine
      integer :: neighbours
      call MPI_Comm_split_type(communicator%comm, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, machine)
      call MPI_Comm_size(machine, neighbours)
      call MPI_Comm_free(machine)
      bytes = min(free_here(), allowed_here())
      if (communicator%maximum(bytes) < unknown) then
         bytes = communicator%sum_real(bytes/neighbours)
      else
         bytes = unknown
      end if
   end function free_memory

   !> What the system could give away on this machine, bytes.
   real(wp) function free_here() result(bytes)
      character(len=:), allocatable :: text
      integer :: at
      bytes = unknown
      text = text_of('/proc/meminfo')
      at = index(text, 'MemAvailable:')
      if (at > 0) bytes = 1024.0_wp*number(text(at + len('MemAvailable:'):))
   end function free_here

   !> What is left of the limit of this process's group, bytes.
   real(wp) function allowed_here() result(bytes)
      bytes = number(text_of('/sys/fs/cgroup/memory.max'))
      if (bytes < unknown) bytes = max(0.0_wp, bytes - number(text_of('/sys/fs/cgroup/memory.current')))
   end function allowed_here

   !> Most memory that this rank has held at once so far, libraries included (bytes); 0 where the system does not tell.
   integer(i8) function peak_memory() result(bytes)
      character(len=:), allocatable :: text
      real(wp) :: kilobytes
      integer :: at
      bytes = 0
      text = text_of('/proc/self/status')
      at = index(text, 'VmHWM:')
      if (at == 0) return
      kilobytes = number(text(at + len('VmHWM:'):))
      if (kilobytes < unknown) bytes = 1024_i8*nint(kilobytes, i8)
   end function peak_memory

   function text_of(path) result(text)
      character(len=*), intent(in) :: path
      character(len=:), allocatable :: text
      logical :: ok
      call read_file(path, longest, text, ok)
      if (.not. ok) text = ''
   end function text_of

   !> The number that a text begins with, or `unknown`.
   pure real(wp) function number(text)
      character(len=*), intent(in) :: text
      integer :: status
      read (text, *, iostat=status) number
      if (status /= 0) number = unknown
   end function number

end module m_memory
