!> Strict reading of numbers, and the text that reads back to the same bits.
module m_number_text
   use m_kinds, only: wp
   use m_text, only: exact_text, to_text
   use m_words, only: lower_case
   implicit none
   private
   public :: read_real, read_integer, reals_text, find_decimal_comma

   integer, parameter, public :: number_good = 0     !< a number
   integer, parameter, public :: number_none = 1     !< not a number
   integer, parameter, public :: number_infinite = 2 !< NaN or infinity
   integer, parameter, public :: number_size = 3     !< too large or too small in magnitude (see
                                                     !< largest_exponent)

   integer, parameter :: largest_exponent = 100 !< magnitudes from 1e-100 to 1e100: squares and cubes stay
                                                !< finite
   character(len=*), parameter :: parts = ' ;'//achar(9)//achar(13) !< characters between numbers, except
                                                                    !< commas
   integer, parameter :: longest_number = 400        !< characters

contains

   !> Read a number as Fortran writes it (1, -2.5, .5, 1e-3, 1.5d9), and nothing else.
   pure subroutine read_real(text, value, fault)
      character(len=*), intent(in) :: text
      real(wp), intent(out) :: value
      integer, intent(out) :: fault !< number_good or the kind of error
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

   !> Find a word such as 1,5 in a line whose numbers are separated by other characters (blanks, tabs,
   !> semicolons): there a comma is a decimal one. `at`, `to`: its position in the line; 0 and -1 if there is
   !> none.
   pure subroutine find_decimal_comma(line, at, to)
      character(len=*), intent(in) :: line
      integer, intent(out) :: at, to
      character(len=*), parameter :: digits = '0123456789'
      integer :: first, length, comma, words
      at = 0
      to = -1
      words = 0
      if (index(line, ',') == 0) return
      first = 1
      do
         length = verify(line(first:), parts) - 1
         if (length < 0) exit
         first = first + length
         length = scan(line(first:), parts) - 1
         if (length < 0) length = len(line) - first + 1
         words = words + 1
         comma = index(line(first:first + length - 1), ',')
         if (comma > 0) then
            comma = first + comma - 1
            if (comma == first .or. comma >= first + length - 1 &
                .or. index(line(comma + 1:first + length - 1), ',') > 0) then
               at = 0 ! a list with commas
               return
            end if
            if (at == 0 .and. scan(line(comma - 1:comma - 1), digits)*scan(line(comma + 1:comma + 1), &
                                                                         digits) > 0) then
               at = first
               to = first + length - 1
            end if
         end if
         first = first + length
         if (first > len(line)) exit
      end do
      if (words > 1) return
      at = 0
      to = -1
   end subroutine find_decimal_comma

   !> Skip digits and count them.
   pure subroutine read_digits(text, at, count)
      character(len=*), intent(in) :: text
      integer, intent(inout) :: at
      integer, intent(out) :: count
      count = verify(text(at:), '0123456789') - 1
      if (count < 0) count = len(text) - at + 1
      at = at + count
   end subroutine read_digits

   !> The exponent after a mantissa, up to the end of the text; `status` is not 0 if there is anything else.
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

   !> Several values, as `1,2,3`: exact, or to a number of digits.
   pure function reals_text(values, digits) result(text)
      real(wp), intent(in) :: values(:)
      integer, intent(in), optional :: digits !< significant digits
      character(len=:), allocatable :: text
      character(len=:), allocatable :: number, larger
      integer :: i, used
      allocate (character(len=64) :: text)
      used = 0
      do i = 1, size(values)
         if (present(digits)) then
            number = to_text(values(i), digits)
         else
            number = exact_text(values(i))
         end if
         if (i > 1) number = ','//number
         if (used + len(number) > len(text)) then ! double the room: a list may be long
            allocate (character(len=2*(used + len(number))) :: larger)
            larger(:used) = text(:used)
            call move_alloc(larger, text)
         end if
         text(used + 1:used + len(number)) = number
         used = used + len(number)
      end do
      text = text(:used)
   end function reals_text

end module m_number_text
