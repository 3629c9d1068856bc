!> Numbers, durations and physical values as short text for people.
module m_text
   use, intrinsic :: ieee_arithmetic, only: ieee_is_nan, ieee_is_finite
   use m_kinds, only: wp, i4, i8
   implicit none
   private
   public :: to_text, exact_text, in_column, si, duration

   !> The shortest text of a number: no blanks, reals to 6 significant digits (or to `digits`, up to 17).
   interface to_text
      module procedure integer_to_text, long_to_text, real_to_text
   end interface to_text

contains

   !> An integer without blanks.
   pure function integer_to_text(value) result(text)
      integer(i4), intent(in) :: value
      character(len=:), allocatable :: text
      text = long_to_text(int(value, i8))
   end function integer_to_text

   !> A long integer without blanks.
   pure function long_to_text(value) result(text)
      integer(i8), intent(in) :: value
      character(len=:), allocatable :: text
      character(len=24) :: buffer
      write (buffer, '(i0)') value
      text = trim(buffer)
   end function long_to_text

   !> A real without blanks and without trailing zeros: `0.33`, `2710`, `1.5e-9`, `NaN`.
   pure function real_to_text(value, digits) result(text)
      real(wp), intent(in) :: value
      integer, intent(in), optional :: digits !< significant digits, 1 to 17; 6 when absent
      character(len=:), allocatable :: text, mantissa
      integer :: significant, exponent
      logical :: negative
      significant = 6
      if (present(digits)) significant = max(1, min(17, digits))
      if (.not. ieee_is_finite(value)) then
         text = non_finite(value)
         return
      end if
      call split(value, significant, negative, mantissa, exponent)
      if (exponent >= -4 .and. exponent < max(significant, 6)) then
         text = with_point(mantissa, exponent)
      else
         text = with_point(mantissa, 0)//'e'//integer_to_text(int(exponent, i4))
      end if
      if (negative) text = '-'//text
   end function real_to_text

   !> The shortest text that reads back as the same number, bit by bit.
   pure function exact_text(value) result(text)
      real(wp), intent(in) :: value
      character(len=:), allocatable :: text
      real(wp) :: again
      integer :: digits, status
      do digits = 6, 17
         text = real_to_text(value, digits)
         if (.not. ieee_is_finite(value)) return
         read (text, *, iostat=status) again
         if (status == 0 .and. again >= value .and. again <= value) return
      end do
   end function exact_text

   !> A real, right-aligned in a column of a table, with a blank before it; if too large, in fewer digits and
   !> with an exponent.
   pure function in_column(value, width, decimals) result(text)
      real(wp), intent(in) :: value
      integer, intent(in) :: width !< characters, 8 or more
      integer, intent(in) :: decimals
      character(len=width) :: text
      character(len=16) :: layout
      write (layout, '(a,i0,a,i0,a)') '(f', width, '.', decimals, ')'
      write (text, layout) value
      if (text(1:1) == ' ') return
      text = real_to_text(value, 2)
      text = adjustr(text)
   end function in_column

   !> A value with a suitable SI prefix, to 4 significant digits: `1.034 ps`, `64 nm`, `70 GPa`.
   pure function si(value, unit) result(text)
      real(wp), intent(in) :: value
      character(len=*), intent(in) :: unit !< the unit without prefix, for instance `Pa`
      character(len=:), allocatable :: text, mantissa
      character(len=1), parameter :: prefixes(-6:6) = ['a', 'f', 'p', 'n', 'u', 'm', ' ', 'k', 'M', 'G', &
                                     'T', 'P', 'E']
      integer, parameter :: significant = 4
      integer :: exponent, thousands
      logical :: negative
      if (.not. ieee_is_finite(value)) then
         text = non_finite(value)//' '//unit
         return
      end if
      call split(value, significant, negative, mantissa, exponent)
      thousands = floor(real(exponent, wp)/3.0_wp)
      if (abs(thousands) > 6) then
         text = real_to_text(value, significant)//' '//unit
         return
      end if
      text = with_point(mantissa, exponent - 3*thousands)//' '//trim(adjustl(prefixes(thousands)//unit))
      if (negative) text = '-'//text
   end function si

   !> A span of wall-clock time: `0.35 s`, `13.2 s`, `2 min 13 s`, `3 h 05 min`, `2 d 03 h`.
   pure function duration(seconds) result(text)
      real(wp), intent(in) :: seconds !< s
      character(len=:), allocatable :: text
      integer(i8) :: whole
      if (.not. ieee_is_finite(seconds)) then
         text = 'unknown'
      else if (seconds < 0.0095_wp) then
         text = si(max(seconds, 0.0_wp), 's')
      else if (seconds < 59.95_wp) then
         text = real_to_text(seconds, merge(2, 3, seconds < 1.0_wp))//' s'
      else if (seconds < 3599.5_wp) then
         whole = nint(seconds, i8)
         text = long_to_text(whole/60)//' min '//two_digits(modulo(whole, 60_i8))//' s'
      else if (seconds < 86370.0_wp) then
         whole = nint(seconds/60.0_wp, i8)
         text = long_to_text(whole/60)//' h '//two_digits(modulo(whole, 60_i8))//' min'
      else if (seconds < 3.0e13_wp) then
         whole = nint(seconds/3600.0_wp, i8)
         text = long_to_text(whole/24)//' d '//two_digits(modulo(whole, 24_i8))//' h'
      else
         text = 'more than a million years'
      end if
   end function duration

   !> Decimal digits of a finite value (first digit not zero, unless the value is) and the power of ten of the
   !> first one.
   pure subroutine split(value, significant, negative, mantissa, exponent)
      real(wp), intent(in) :: value
      integer, intent(in) :: significant
      logical, intent(out) :: negative
      character(len=:), allocatable, intent(out) :: mantissa !< without trailing zeros, at least one digit
      integer, intent(out) :: exponent
      character(len=40) :: buffer, layout
      integer :: mark, last
      write (layout, '(a,i0,a)') '(es40.', significant - 1, 'e4)'
      write (buffer, layout) abs(value)
      buffer = adjustl(buffer)
      mark = index(buffer, 'E')
      read (buffer(mark + 1:), *) exponent
      mantissa = buffer(1:1)//buffer(3:mark - 1)
      last = max(1, verify(mantissa, '0', back=.true.))
      mantissa = mantissa(1:last)
      negative = value < 0.0_wp
   end subroutine split

   !> Insert the point into digits whose first one has the weight 10**exponent.
   pure function with_point(mantissa, exponent) result(text)
      character(len=*), intent(in) :: mantissa
      integer, intent(in) :: exponent
      character(len=:), allocatable :: text
      if (exponent < 0) then
         text = '0.'//repeat('0', -exponent - 1)//mantissa
      else if (len(mantissa) <= exponent + 1) then
         text = mantissa//repeat('0', exponent + 1 - len(mantissa))
      else
         text = mantissa(1:exponent + 1)//'.'//mantissa(exponent + 2:)
      end if
   end function with_point

   pure function non_finite(value) result(text)
      real(wp), intent(in) :: value
      character(len=:), allocatable :: text
      if (ieee_is_nan(value)) then
         text = 'NaN'
      else if (value > 0.0_wp) then
         text = 'Infinity'
      else
         text = '-Infinity'
      end if
   end function non_finite

   pure function two_digits(value) result(text)
      integer(i8), intent(in) :: value
      character(len=2) :: text
      write (text, '(i2.2)') value
   end function two_digits

end module m_text
