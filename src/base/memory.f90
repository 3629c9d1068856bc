!> What the operating system says of this rank's memory.
module m_memory
   use m_kinds, only: i8
   implicit none
   private
   public :: peak_memory

contains

   !> Most memory that this rank has held at once so far, libraries included (bytes): VmHWM of /proc/self/status. 0 where the
   !> system does not tell.
   integer(i8) function peak_memory() result(bytes)
      character(len=256) :: line
      integer :: unit, status
      bytes = 0
      open (newunit=unit, file='/proc/self/status', action='read', status='old', iostat=status)
      if (status /= 0) return
      do
         read (unit, '(a)', iostat=status) line
         if (status /= 0) exit
         if (index(line, 'VmHWM:') /= 1) cycle
         read (line(7:index(line, 'kB') - 1), *, iostat=status) bytes
         bytes = merge(1024*bytes, 0_i8, status == 0)
         exit
      end do
      close (unit)
   end function peak_memory

end module m_memory
