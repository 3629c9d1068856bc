!> Large pages of memory for the particles of a rank. A step reads them as some fifty streams: with pages of 4
!> kB the processor must look up the place of a page for every 512 values. Linux gives large pages
!> (transparent huge pages) to memory for which a program asks before it is touched.
module m_large_pages
   use, intrinsic :: iso_c_binding, only: c_int, c_intptr_t, c_size_t, c_funptr, c_loc, c_associated, &
      c_f_procpointer
   use m_kinds, only: wp, i8
   use m_dynamic_library, only: find_procedure
   implicit none
   private
   public :: hold_large_pages

   integer(i8), parameter :: page = 2_i8**21        !< bytes of a large page, on most processors
   integer(i8), parameter :: piece = 12*page        !< bytes that are asked for at once
   integer(i8), parameter :: least = 2_i8**25 !< bytes below which the processor finds small pages fast enough
   integer(c_int), parameter :: trim_threshold = -1, mmap_threshold = -3 !< M_... of glibc's mallopt
   integer(c_int), parameter :: never = -1, largest_in_heap = 2**25      !< bytes: the most that it allows
   integer(c_int), parameter :: huge_page = 14      !< MADV_HUGEPAGE of Linux

   type :: piece_t
      real(wp), allocatable :: values(:)
   end type piece_t

   abstract interface
      integer(c_int) function mallopt_interface(what, value) bind(c)
         import :: c_int
         integer(c_int), value :: what, value
      end function mallopt_interface
   end interface

   interface
      integer(c_int) function c_madvise(address, length, advice) bind(c, name='madvise')
         import :: c_int, c_intptr_t, c_size_t
         integer(c_intptr_t), value :: address
         integer(c_size_t), value :: length
         integer(c_int), value :: advice
      end function c_madvise
   end interface

contains

   !> To be called before so many bytes are allocated for particles: arrays of up to 32 MB that follow come
   !> from the heap of the C library (glibc), which grows by the bytes now, untouched and with large pages
   !> asked for. Few bytes, and other C libraries and systems, are left as they are.
   subroutine hold_large_pages(bytes)
      integer(i8), intent(in) :: bytes
      type(piece_t), allocatable :: pieces(:)
      procedure(mallopt_interface), pointer :: mallopt
      type(c_funptr) :: address
      character(len=:), allocatable :: complaint
      integer(c_int) :: done
      integer :: n, status
      logical :: opened
      if (bytes < least) return
      call find_procedure('libc.so.6', 'mallopt', address, opened, complaint)
      if (.not. c_associated(address)) return
      call c_f_procpointer(address, mallopt)
      done = mallopt(mmap_threshold, largest_in_heap)
      done = mallopt(trim_threshold, never)
      allocate (pieces((bytes + piece - 1)/piece))
      do n = 1, size(pieces)
         allocate (pieces(n)%values(piece/8), stat=status)
         if (status /= 0) exit ! a limit of memory: what follows will say so
         call ask_for(pieces(n)%values)
      end do
   end subroutine hold_large_pages

   !> Ask for large pages for an array, up to the borders of such pages. The system leaves out addresses that
   !> are not memory of this process; one without such pages refuses, which changes nothing.
   subroutine ask_for(values)
      real(wp), intent(in), contiguous, target :: values(:)
      integer(i8) :: first, last
      integer(c_int) :: status
      first = transfer(c_loc(values), 0_c_intptr_t)
      last = first + 8*size(values, kind=i8) + page
      first = first - modulo(first, page)
      status = c_madvise(int(first, c_intptr_t), int(last - modulo(last, page) - first, c_size_t), huge_page)
   end subroutine ask_for

end module m_large_pages
