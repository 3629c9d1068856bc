!> Numbers as text, both ways: the strict reading, and the shortest text that reads back to the same bits.
module m_number_text
   use m_kinds, only: wp
   use m_words, only: lower_case
   implicit none
   private
   public :: read_real, read_integer, real_text, reals_text, rounded_text, integer_text

   integer, parameter, public :: number_good = 0     !< it is a number
   integer, parameter, public :: number_none = 1     !< it is something else
   integer, parameter, public :: number_infinite = 2 !< NaN or infinity
   integer, parameter, public :: number_size = 3     !< too large or too small in size (see largest_exponent)

   integer, parameter :: largest_exponent = 100      !< sizes from 1e-100 to 1e100: squares and cubes stay finite
   integer, parameter :: longest_number = 400        !< characters

contains

   !> Read a number as Fortran writes it (1, -2.5, .5, 1e-3, 1.5d9), and nothing else.
   pure subroutine read_real(text, value, fault)
      character(len=*), intent(in) :: text
      real(wp), intent(out) :: value
      integer, intent(out) :: fault !< number_good or what is wrong
      character(len=:), allocatable :: digits
      integer :: at, first, before, after, zeros, exponent, status
      value = 0.0_wp
      fault = number_none
      if (len(text) == 0 .or. len(text) > longest_number) return
      first = 1
      if (scan(text(1:1), '+-') == 1) first = 2
      if (any(lower_case(text(first:)) == ['nan     ', 'inf     ', 'infinity'])) fault = number_infinite
      at = first
      after = 0
      call read_digits(text, at, before)
      digits = text(first:at - 1)
      if (index(text(at:), '.') == 1) then
         at = at + 1
         call read_digits(text, at, after)
         digits = digits//text(at - after:at - 1)
      end if
      if (before + after == 0) return
      call read_exponent(text, at, exponent, status)
      if (status /= 0) return
      fault = number_good
      zeros = verify(digits, '0') - 1
      if (zeros < 0) return
      fault = number_size
      if (abs(before - 1 - zeros + exponent) > largest_exponent) return
      read (text, *, iostat=status) value
      fault = merge(number_good, number_none, status == 0)
   end subroutine read_real

   !> Step over digits; how many there were.
   pure subroutine read_digits(text, at, count)
      character(len=*), intent(in) :: text
      integer, intent(inout) :: at
      integer, intent(out) :: count
      count = verify(text(at:), '0123456789') - 1
      if (count < 0) count = len(text) - at + 1
      at = at + count
   end subroutine read_digits

   !> The exponent that follows a mantissa, up to the end of the text; `status` is not 0 when something else does.
   pure subroutine read_exponent(text, at, exponent, status)
      character(len=*), intent(in) :: text
      integer, intent(inout) :: at
      integer, intent(out) :: exponent, status
      integer :: sign_of, count, i
      exponent = 0
      status = 0
      if (at > len(text)) return
      status = 1
      if (scan(text(at:at), 'eEdD') == 0) return
      at = at + 1
      if (at > len(text)) return
      sign_of = merge(-1, 1, text(at:at) == '-')
      if (scan(text(at:at), '+-') == 1) at = at + 1
      call read_digits(text, at, count)
      if (count == 0 .or. at <= len(text)) return
      do i = at - count, at - 1
         exponent = min(10*exponent + iachar(text(i:i)) - iachar('0'), 100000)
      end do
      exponent = sign_of*exponent
      status = 0
   end subroutine read_exponent

   !> Read a whole number of at most 9 digits.
   pure subroutine read_integer(text, value, good)
      character(len=*), intent(in) :: text
      integer, intent(out) :: value
      logical, intent(out) :: good
      integer :: at, count, status
      value = 0
      good = .false.
      if (len(text) == 0) return
      at = 1
      if (scan(text(1:1), '+-') == 1) at = 2
      call read_digits(text, at, count)
      if (count < 1 .or. count > 9 .or. at <= len(text)) return
      read (text, *, iostat=status) value
      good = status == 0
   end subroutine read_integer

   !> The shortest text that reads back to exactly this value.
   pure function real_text(value) result(text)
      real(wp), intent(in) :: value
      character(len=:), allocatable :: text
      character(len=32) :: buffer
      real(wp) :: back
      integer :: digits
      do digits = 1, 17
         call write_digits(value, digits, buffer)
         read (buffer, *) back
         if (abs(back - value) <= 0.0_wp) exit
      end do
      text = tidy(trim(adjustl(buffer)))
   end function real_text

   !> Several values, as `1,2,3`.
   pure function reals_text(values) result(text)
      real(wp), intent(in) :: values(:)
      character(len=:), allocatable :: text
      integer :: i
      text = ''
      do i = 1, size(values)
         if (i > 1) text = text//','
         text = text//real_text(values(i))
      end do
   end function reals_text

   !> A value rounded to so many significant digits, without trailing zeros.
   pure function rounded_text(value, digits) result(text)
      real(wp), intent(in) :: value
      integer, intent(in) :: digits
      character(len=:), allocatable :: text
      character(len=32) :: buffer
      real(wp) :: back
      call write_digits(value, digits, buffer)
      read (buffer, *) back
      text = real_text(back)
   end function rounded_text

   pure function integer_text(value) result(text)
      integer, intent(in) :: value
      character(len=:), allocatable :: text
      character(len=16) :: buffer
      write (buffer, '(i0)') value
      text = trim(buffer)
   end function integer_text

   pure subroutine write_digits(value, digits, buffer)
      real(wp), intent(in) :: value
      integer, intent(in) :: digits
      character(len=32), intent(out) :: buffer
      character(len=12) :: form
      write (form, '(a,i0,a)') '(es32.', digits - 1, 'e3)'
      write (buffer, form) value
   end subroutine write_digits

   !> 7.E+010 as 7e10, 2.71E+003 as 2710, 5.E-001 as 0.5.
   pure function tidy(scientific) result(text)
      character(len=*), intent(in) :: scientific
      character(len=:), allocatable :: text
      character(len=:), allocatable :: minus, digits
      integer :: first, letter, exponent, last
      first = verify(scientific, '-')
      minus = scientific(:first - 1)
      letter = index(scientific, 'E')
      read (scientific(letter + 1:), *) exponent
      digits = scientific(first:first)//scientific(first + 2:letter - 1)
      last = verify(digits, '0', back=.true.)
      if (last == 0) then
         text = '0'
         return
      end if
      digits = digits(:last)
      if (exponent >= 0 .and. exponent <= 5) then
         if (last <= exponent + 1) then
            text = digits//repeat('0', exponent + 1 - last)
         else
            text = digits(:exponent + 1)//'.'//digits(exponent + 2:)
         end if
      else if (exponent < 0 .and. exponent >= -3) then
         text = '0.'//repeat('0', -exponent - 1)//digits
      else
         text = digits(1:1)
         if (last > 1) text = text//'.'//digits(2:)
         text = text//'e'//integer_text(exponent)
      end if
      text = minus//text
   end function tidy

end module m_number_text
