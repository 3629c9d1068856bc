!> The allowed numbers of a variable, and their description in messages.
module m_value_range
   use m_kinds, only: wp
   use m_text, only: exact_text
   implicit none
   private
   public :: above, at_least, any_value

   !> An interval with open or closed ends, and its unit.
   type, public :: range_t
      private
      logical :: has_lower = .false., has_upper = .false.
      logical :: lower_open = .false., upper_open = .false.
      real(wp) :: lower = 0.0_wp, upper = 0.0_wp
      character(len=16), public :: unit = ''
   contains
      procedure :: holds
      procedure :: limits
      procedure :: as_json
   end type range_t

contains

   !> Every finite number.
   pure type(range_t) function any_value(unit) result(range)
      character(len=*), intent(in) :: unit
      range%unit = unit
   end function any_value

   !> Greater than `limit`; less than `below` or at most `at_most` where given.
   pure type(range_t) function above(limit, unit, below, at_most) result(range)
      real(wp), intent(in) :: limit
      character(len=*), intent(in) :: unit
      real(wp), intent(in), optional :: below, at_most
      range = at_least(limit, unit, below, at_most)
      range%lower_open = .true.
   end function above

   !> Not less than `limit`; less than `below` or at most `at_most` where given.
   pure type(range_t) function at_least(limit, unit, below, at_most) result(range)
      real(wp), intent(in) :: limit
      character(len=*), intent(in) :: unit
      real(wp), intent(in), optional :: below, at_most
      range%unit = unit
      range%has_lower = .true.
      range%lower = limit
      range%has_upper = present(at_most) .or. present(below)
      range%upper_open = present(below)
      if (present(at_most)) range%upper = at_most
      if (present(below)) range%upper = below
   end function at_least

   elemental logical function holds(self, value)
      class(range_t), intent(in) :: self
      real(wp), intent(in) :: value
      holds = .true.
      if (self%has_lower) holds = value > self%lower .or. (value >= self%lower .and. .not. self%lower_open)
      if (holds .and. self%has_upper) holds = value < self%upper &
                                              .or. (value <= self%upper .and. .not. self%upper_open)
   end function holds

   !> `above -1 and below 0.5`, `at least 0 s`, `in m`; empty if there are no limits and no unit.
   pure function limits(self) result(text)
      class(range_t), intent(in) :: self
      character(len=:), allocatable :: text
      text = ''
      if (self%has_lower) then
         text = 'at least '
         if (self%lower_open) text = 'above '
         text = text//exact_text(self%lower)
         if (self%has_upper .and. self%upper_open) text = text//' and below '//exact_text(self%upper)
         if (self%has_upper .and. .not. self%upper_open) text = text//' and at most '//exact_text(self%upper)
         if (self%unit /= '') text = text//' '//trim(self%unit)
      else if (self%unit /= '') then
         text = 'in '//trim(self%unit)
      end if
   end function limits

   !> The limits in a JSON Schema, each with a comma before it.
   pure function as_json(self) result(text)
      class(range_t), intent(in) :: self
      character(len=:), allocatable :: text
      text = ''
      if (self%has_lower .and. self%lower_open) text = ',"exclusiveMinimum":'//json_number(self%lower)
      if (self%has_lower .and. .not. self%lower_open) text = ',"minimum":'//json_number(self%lower)
      if (self%has_upper .and. self%upper_open) text = text//',"exclusiveMaximum":'//json_number(self%upper)
      if (self%has_upper .and. .not. self%upper_open) text = text//',"maximum":'//json_number(self%upper)
   end function as_json

   !> A number in JSON: with a digit before and after its point.
   pure function json_number(value) result(text)
      real(wp), intent(in) :: value
      character(len=:), allocatable :: text
      text = exact_text(value)
      if (text(1:1) == '.') text = '0'//text
      if (index(text, '-.') == 1) text = '-0'//text(2:)
      if (text(len(text):) == '.') text = text//'0'
   end function json_number

end module m_value_range
