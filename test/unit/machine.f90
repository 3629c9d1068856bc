!> What systems say of cores, in their own words; memory in large pages.
program machine
   use m_kinds, only: wp, i8
   use m_communicator, only: communicator_t
   use m_assertions, only: assertions_t
   use m_large_pages, only: hold_large_pages
   use m_machine, only: cores_of, share_of_time
   implicit none
   type(communicator_t) :: comm
   type(assertions_t) :: test
   call comm%start()
   call test%start(comm, 'machine')
   call test%check_equal(sum(popcnt(cores_of('	3'))), 2, 'cores of a short mask')
   call test%check_equal(sum(popcnt(cores_of(' ff,ffffffff,00000001'))), 41, 'cores of a mask of three words')
   call test%check_equal(sum(popcnt(cores_of('00000000,0000a000'))), 2, 'cores that are not the first')
   call test%check_equal(sum(popcnt(cores_of(''))), 0, 'no mask')
   call test%check_close(share_of_time('150000 100000'), 1.5_wp, 1.0e-15_wp, 'a quota of one core and a half')
   call test%check(share_of_time('max 100000') > 1.0e300_wp, 'no quota')
   call test%check(share_of_time('') > 1.0e300_wp, 'no word of a quota')
   call large_pages()
   call test%finish()

contains

   !> Linux says which parts of the memory large pages were asked for. Other systems say nothing.
   subroutine large_pages()
      real(wp), allocatable :: large(:)
      logical :: known
      inquire (file='/sys/kernel/mm/transparent_hugepage/enabled', exist=known)
      known = known .and. parts_with('') > 0
      call hold_large_pages(2_i8**20)
      if (known) call test%check_equal(parts_with(' hg'), 0, 'nothing is asked for a few bytes')
      call hold_large_pages(2_i8**26)
      if (known) call test%check(parts_with(' hg') > 0, 'many bytes get large pages')
      allocate (large(2**20))
      large = 1.0_wp
      call test%check_close(sum(large), real(size(large), wp), 0.0_wp, 'which are memory as any')
   end subroutine large_pages

   !> Number of parts of this process's memory that have a flag.
   integer function parts_with(flag) result(parts)
      character(len=*), intent(in) :: flag
      character(len=200) :: text
      integer :: status, unit
      parts = 0
      open (newunit=unit, file='/proc/self/smaps', action='read', iostat=status)
      if (status /= 0) return
      do
         read (unit, '(a)', iostat=status) text
         if (status /= 0) exit
         if (index(text, 'VmFlags:') == 1 .and. index(text, flag) > 0) parts = parts + 1
      end do
      close (unit)
   end function parts_with

end program machine
