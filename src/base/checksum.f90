!> Checksums of files and texts: Fletcher's two sums over words of 32 bits, modulo a prime. They detect
!> damage, not forgery.
module m_checksum
   use mpi_f08
   use m_kinds, only: i4, i8
   use m_communicator, only: communicator_t
   implicit none
   private
   public :: text_checksum, file_checksum

   integer, parameter, public :: checksum_digits = 16
   integer, parameter :: piece = 4194304 !< bytes of a file summed at once; a multiple of 4
   integer, parameter :: run = 16384 !< words between reductions of the sums: they stay below 2**63
   integer(i8), parameter :: mask = 4294967295_i8     !< the lowest 32 bits
   integer(i8), parameter :: prime = 4294967291_i8    !< the largest below 2**32

contains

   !> Checksum of a text, in hexadecimal digits.
   pure function text_checksum(text) result(digits)
      character(len=*), intent(in) :: text
      character(len=checksum_digits) :: digits
      integer(i4) :: words((len(text) + 3)/4)
      character(len=4*size(words)) :: padded
      integer(i8) :: sums(2)
      padded = text
      words = transfer(padded, words, size(words))
      sums = [int(len(text), i8), 0_i8]
      call add_words(words, sums)
      digits = written(sums)
   end function text_checksum

   !> Collective: checksum of the bytes of a file from `first` (from 1) to `last`; each rank reads a share.
   !> Every rank returns with the same values; `ok` is false when a rank could not read its share.
   subroutine file_checksum(communicator, path, first, last, digits, ok)
      type(communicator_t), intent(in) :: communicator
      character(len=*), intent(in) :: path
      integer(i8), intent(in) :: first, last
      character(len=checksum_digits), intent(out) :: digits
      logical, intent(out) :: ok
      integer(i8), allocatable :: parts(:, :)
      integer(i4), allocatable :: words(:)
      integer(i8) :: pieces, n, from, sums(2)
      integer :: unit, status, bytes, failures
      pieces = (max(last - first + 1, 0_i8) + piece - 1)/piece
      allocate (parts(2, pieces), source=0_i8)
      allocate (words(piece/4))
      open (newunit=unit, file=path, access='stream', form='unformatted', action='read', status='old', &
            iostat=status)
      failures = merge(0, 1, status == 0)
      do n = 1 + (pieces*communicator%rank)/communicator%ranks, &
             (pieces*(communicator%rank + 1))/communicator%ranks
         if (failures > 0) exit
         from = first + (n - 1)*piece
         bytes = int(min(int(piece, i8), last - from + 1))
         call read_words(unit, from, bytes, words, status)
         failures = merge(0, 1, status == 0)
         parts(:, n) = [int(bytes, i8), 0_i8]
         call add_words(words(:(bytes + 3)/4), parts(:, n))
      end do
      close (unit, iostat=status)
      call MPI_Allreduce(MPI_IN_PLACE, failures, 1, MPI_INTEGER, MPI_MAX, communicator%comm)
      call MPI_Allreduce(MPI_IN_PLACE, parts, size(parts), MPI_INTEGER8, MPI_SUM, communicator%comm)
      ok = failures == 0
      sums = [pieces, 0_i8]
      do n = 1, pieces
         call add_values(parts(:, n), sums)
      end do
      digits = written(sums)
   end subroutine file_checksum

   !> Read some bytes of a file, padded with zeros to the end of the last word.
   subroutine read_words(unit, from, bytes, words, status)
      integer, intent(in) :: unit, bytes
      integer(i8), intent(in) :: from
      integer(i4), intent(out) :: words(:)
      integer, intent(out) :: status
      character(len=4) :: rest
      rest = repeat(achar(0), 4)
      read (unit, pos=from, iostat=status) words(:bytes/4)
      if (modulo(bytes, 4) == 0) return
      if (status == 0) read (unit, iostat=status) rest(:modulo(bytes, 4))
      words(bytes/4 + 1) = transfer(rest, 0_i4)
   end subroutine read_words

   !> Add more words to the sums.
   pure subroutine add_words(words, sums)
      integer(i4), intent(in), contiguous :: words(:)
      integer(i8), intent(inout) :: sums(2)
      integer(i8) :: a, b
      integer :: first, i
      a = sums(1)
      b = sums(2)
      do first = 1, size(words), run
         do i = first, min(first + run - 1, size(words))
            a = a + iand(int(words(i), i8), mask)
            b = b + a
         end do
         a = modulo(a, prime)
         b = modulo(b, prime)
      end do
      sums = [a, b]
   end subroutine add_words

   !> The same for values below 2**32.
   pure subroutine add_values(values, sums)
      integer(i8), intent(in) :: values(:)
      integer(i8), intent(inout) :: sums(2)
      integer :: i
      do i = 1, size(values)
         sums(1) = modulo(sums(1) + values(i), prime)
         sums(2) = modulo(sums(2) + sums(1), prime)
      end do
   end subroutine add_values

   pure function written(sums) result(digits)
      integer(i8), intent(in) :: sums(2)
      character(len=checksum_digits) :: digits
      write (digits, '(2z8.8)') sums(2), sums(1)
   end function written

end module m_checksum
