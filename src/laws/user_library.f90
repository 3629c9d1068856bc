!> The procedure of a user's law in its shared library, and the names that it is called with.
module m_user_library
   use, intrinsic :: iso_c_binding, only: c_char, c_funptr
   use m_dynamic_library, only: find_procedure
   use m_group_reader, only: group_reader_t
   implicit none
   private
   public :: find_law, law_name, name_size

   integer, parameter :: name_size = 80 !< characters of CMNAME, the material's name for Abaqus's subroutines

contains

   !> Where the law's procedure stands in its library, as compilers call it; refused where it is not there.
   subroutine find_law(library, group, name, source, what, address, found)
      character(len=*), intent(in) :: library
      type(group_reader_t), intent(inout) :: group
      character(len=*), intent(in) :: name, source !< `vumat_`; the file that libraries are made of: `mylaw.f`
      character(len=*), intent(in) :: what         !< is to be in it: `SUBROUTINE VUMAT`
      type(c_funptr), intent(out) :: address
      logical, intent(out) :: found
      character(len=:), allocatable :: complaint, allowed
      logical :: opened
      call find_procedure(library, name, address, opened, complaint)
      found = complaint == ''
      if (found) return
      allowed = 'allowed: a library made by `make vumat FILE='//source//'`'
      if (opened) then
         call group%refuse('library', 'has no '//name//'; '//allowed//', of a file with a '//what)
      else
         call group%refuse('library', 'cannot be opened ('//complaint//'); '//allowed)
      end if
   end subroutine find_law

   !> The name of a material as Abaqus's subroutines get it, in capitals.
   pure function law_name(label) result(name)
      character(len=*), intent(in) :: label
      character(kind=c_char) :: name(name_size)
      integer :: i
      name = ' '
      do i = 1, min(len(label), name_size)
         name(i) = label(i:i)
         if (llt('`', name(i)) .and. llt(name(i), '{')) name(i) = achar(iachar(name(i)) - 32)
      end do
   end function law_name

end module m_user_library
