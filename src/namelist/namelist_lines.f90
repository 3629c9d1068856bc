!> Lines `   name=value` of a namelist, ended by new_line; numbers in the fewest digits that read back to the
!> same bits.
module m_namelist_lines
   use m_kinds, only: wp
   use m_number_text, only: reals_text
   use m_text, only: to_text
   implicit none
   private
   public :: reals_line, integer_line, logical_line, text_line, words_line

contains

   pure function reals_line(name, values) result(line)
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: values(:)
      character(len=:), allocatable :: line
      line = '   '//name//'='//reals_text(values)//new_line('a')
   end function reals_line

   pure function integer_line(name, value) result(line)
      character(len=*), intent(in) :: name
      integer, intent(in) :: value
      character(len=:), allocatable :: line
      line = '   '//name//'='//to_text(value)//new_line('a')
   end function integer_line

   pure function logical_line(name, value) result(line)
      character(len=*), intent(in) :: name
      logical, intent(in) :: value
      character(len=:), allocatable :: line
      line = '   '//name//'='//trim(merge('.true. ', '.false.', value))//new_line('a')
   end function logical_line

   pure function text_line(name, value) result(line)
      character(len=*), intent(in) :: name, value
      character(len=:), allocatable :: line
      line = words_line(name, [value])
   end function text_line

   pure function words_line(name, values) result(line)
      character(len=*), intent(in) :: name
      character(len=*), intent(in) :: values(:)
      character(len=:), allocatable :: line
      integer :: i
      line = '   '//name//'='//quoted(trim(values(1)))
      do i = 2, size(values)
         line = line//','//quoted(trim(values(i)))
      end do
      line = line//new_line('a')
   end function words_line

   !> In single quotes, quotes inside doubled.
   pure function quoted(value) result(text)
      character(len=*), intent(in) :: value
      character(len=:), allocatable :: text
      integer :: i
      text = ''''
      do i = 1, len(value)
         text = text//value(i:i)
         if (value(i:i) == '''') text = text//''''
      end do
      text = text//''''
   end function quoted

end module m_namelist_lines
