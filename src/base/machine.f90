!> Resources of a run's machines, memory and cores, the memory used by a rank, and date and time.
module m_machine
   use mpi_f08
   use m_kinds, only: wp, i4, i8
   use m_communicator, only: communicator_t
   use m_filesystem, only: read_file
   implicit none
   private
   public :: free_memory, peak_memory, find_crowd, cores_of, share_of_time, date_text

   integer, parameter :: longest = 65536 !< bytes of a system file
   integer, parameter :: quads = 2048    !< groups of four cores in a mask
   real(wp), parameter :: unknown = huge(1.0_wp)

contains

   !> Collective: memory (bytes) that is free on all machines of the run together, within the limits of a
   !> batch system or of the processes (ulimit -v); huge if unknown.
   real(wp) function free_memory(communicator) result(bytes)
      type(communicator_t), intent(in) :: communicator
      type(MPI_Comm) :: machine
      integer :: neighbours
      call MPI_Comm_split_type(communicator%comm, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, machine)
      call MPI_Comm_size(machine, neighbours)
      call MPI_Comm_free(machine)
      bytes = min(free_here(), allowed_here())
      if (bytes < unknown) bytes = bytes/neighbours
      bytes = min(bytes, allowed_process())
      if (communicator%maximum(bytes) < unknown) then
         bytes = communicator%sum_real(bytes)
      else
         bytes = unknown
      end if
   end function free_memory

   !> Local date and time of this machine: `2026-11-25 16:14:36`.
   function date_text() result(text)
      character(len=:), allocatable :: text
      integer :: now(8)
      character(len=32) :: date
      call date_and_time(values=now)
      write (date, '(i0,"-",i2.2,"-",i2.2," ",i2.2,":",i2.2,":",i2.2)') now(1:3), now(5:7)
      text = trim(date)
   end function date_text

   !> Collective: the machine with the most ranks per core: its ranks, and the cores available to them; as
   !> many as ranks if unknown.
   subroutine find_crowd(communicator, ranks, cores)
      type(communicator_t), intent(in) :: communicator
      integer, intent(out) :: ranks, cores
      type(MPI_Comm) :: machine
      integer(i4) :: allowed(quads)
      real(wp) :: crowd, most, quota
      call MPI_Comm_split_type(communicator%comm, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, machine)
      call MPI_Comm_size(machine, ranks)
      allowed = cores_of(line_after(text_of('/proc/self/status'), 'Cpus_allowed:'))
      call MPI_Allreduce(MPI_IN_PLACE, allowed, quads, MPI_INTEGER, MPI_BOR, machine)
      call MPI_Comm_free(machine)
      cores = sum(popcnt(allowed))
      quota = share_of_time(text_of('/sys/fs/cgroup/cpu.max'))
      if (quota < cores) cores = max(1, int(quota))
      if (cores == 0) cores = ranks
      crowd = real(ranks, wp)/cores
      most = communicator%maximum(crowd)
      ranks = nint(communicator%maximum(merge(real(ranks, wp), 0.0_wp, crowd >= most)))
      cores = nint(communicator%maximum(merge(real(cores, wp), 0.0_wp, crowd >= most)))
   end subroutine find_crowd

   !> The core mask from its hexadecimal digits, four cores a value; commas separate words.
   pure function cores_of(mask) result(cores)
      character(len=*), intent(in) :: mask
      integer(i4) :: cores(quads)
      character(len=*), parameter :: digits = '0123456789abcdef'
      integer :: at, q, value
      cores = 0
      q = 0
      do at = len(mask), 1, -1
         value = index(digits, mask(at:at)) - 1
         if (value < 0 .or. q == quads) cycle
         q = q + 1
         cores(q) = value
      end do
   end function cores_of

   !> Cores' worth of time allowed by a group's quota and period, as in '150000 100000'.
   pure real(wp) function share_of_time(text) result(share)
      character(len=*), intent(in) :: text
      real(wp) :: quota, period
      integer :: status
      share = unknown
      read (text, *, iostat=status) quota, period
      if (status == 0 .and. period > 0.0_wp) share = quota/period
   end function share_of_time

   !> Memory available on this machine, bytes.
   real(wp) function free_here() result(bytes)
      bytes = number(line_after(text_of('/proc/meminfo'), 'MemAvailable:'))
      if (bytes < unknown) bytes = 1024.0_wp*bytes
   end function free_here

   !> Remainder of the limit of this process's group, bytes.
   real(wp) function allowed_here() result(bytes)
      bytes = number(text_of('/sys/fs/cgroup/memory.max'))
      if (bytes < unknown) bytes = max(0.0_wp, bytes - number(text_of('/sys/fs/cgroup/memory.current')))
   end function allowed_here

   !> Remainder of this process's own limits of address space and data, bytes.
   real(wp) function allowed_process() result(bytes)
      character(len=:), allocatable :: limits, status
      limits = text_of('/proc/self/limits')
      status = text_of('/proc/self/status')
      bytes = min(number(line_after(limits, 'Max address space')) - 1024.0_wp*number(line_after(status, &
         'VmSize:')), number(line_after(limits, 'Max data size')) - 1024.0_wp*number(line_after(status, &
         'VmData:')))
      bytes = max(0.0_wp, bytes)
   end function allowed_process

   !> Peak memory of this rank so far, libraries included (bytes); 0 if unknown.
   integer(i8) function peak_memory() result(bytes)
      real(wp) :: kilobytes
      bytes = 0
      kilobytes = number(line_after(text_of('/proc/self/status'), 'VmHWM:'))
      if (kilobytes < unknown) bytes = 1024_i8*nint(kilobytes, i8)
   end function peak_memory

   function text_of(path) result(text)
      character(len=*), intent(in) :: path
      character(len=:), allocatable :: text
      logical :: ok
      call read_file(path, longest, text, ok)
      if (.not. ok) text = ''
   end function text_of

   !> The rest of the line that begins with a word; empty if there is none.
   pure function line_after(text, word) result(rest)
      character(len=*), intent(in) :: text, word
      character(len=:), allocatable :: rest
      integer :: at, length
      rest = ''
      at = index(text, word)
      if (at == 0) return
      at = at + len(word)
      length = index(text(at:), new_line('a')) - 1
      if (length < 0) length = len(text) - at + 1
      rest = text(at:at + length - 1)
   end function line_after

   !> The number at the beginning of a text, or `unknown`.
   pure real(wp) function number(text)
      character(len=*), intent(in) :: text
      integer :: status
      read (text, *, iostat=status) number
      if (status /= 0) number = unknown
   end function number

end module m_machine
