!> The properties of a JSON Schema that describe a variable.
module m_schema_text
   use m_text, only: to_text
   use m_value_range, only: range_t
   implicit none
   private
   public :: number_property, integer_property, words_property, plain_property, json_text

contains

   !> One number, `count` of them, or (0) any number; above 0: `fewer` are allowed too.
   function number_property(range, count, fewer) result(text)
      type(range_t), intent(in) :: range
      integer, intent(in) :: count, fewer
      character(len=:), allocatable :: text
      text = '"type":"number"'//range%as_json()
      if (count > 1) text = lists_of(text, count, fewer)
      if (count == 0) text = '"anyOf":[{'//text//'},{"type":"array","items":{'//text//'}}]'
      if (range%unit /= '') text = text//',"description":'//json_text(trim(range%unit))
   end function number_property

   function integer_property(least) result(text)
      integer, intent(in) :: least
      character(len=:), allocatable :: text
      text = '"type":"integer","minimum":'//to_text(least)
   end function integer_property

   !> One of some words, `count` of them, or (0) any number, each once; above 0: `fewer` are allowed too.
   function words_property(words, count, fewer) result(text)
      character(len=*), intent(in) :: words(:)
      integer, intent(in) :: count, fewer
      character(len=:), allocatable :: text
      integer :: i
      text = '"type":"string"'
      do i = 1, size(words)
         if (i == 1) text = '"enum":['
         if (i > 1) text = text//','
         text = text//json_text(trim(words(i)))
      end do
      if (size(words) > 0) text = text//']'
      if (count > 1) text = lists_of(text, count, fewer)
      if (count == 0) text = '"anyOf":[{'//text//'},{"type":"array","uniqueItems":true,"items":{'//text//'}}]'
   end function words_property

   !> Lists of `count` items, or of fewer.
   pure function lists_of(items, count, fewer) result(text)
      character(len=*), intent(in) :: items
      integer, intent(in) :: count, fewer
      character(len=:), allocatable :: text
      text = list_of(count)
      if (fewer > 0) text = '"anyOf":[{'//list_of(fewer)//'},{'//text//'}]'
   contains
      pure function list_of(n) result(list)
         integer, intent(in) :: n
         character(len=:), allocatable :: list
         list = '"type":"array","items":{'//items//'},"minItems":'//to_text(n)//',"maxItems":'//to_text(n)
      end function list_of
   end function lists_of

   !> `string` or `boolean`.
   pure function plain_property(kind) result(text)
      character(len=*), intent(in) :: kind
      character(len=:), allocatable :: text
      text = '"type":"'//kind//'"'
   end function plain_property

   pure function json_text(text) result(quoted)
      character(len=*), intent(in) :: text
      character(len=:), allocatable :: quoted
      integer :: i
      quoted = '"'
      do i = 1, len(text)
         if (scan(text(i:i), '"\') > 0) quoted = quoted//'\'
         quoted = quoted//text(i:i)
      end do
      quoted = quoted//'"'
   end function json_text

end module m_schema_text
