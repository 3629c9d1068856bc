!> Units of length and of angles, as written by programs.
module m_length_units
   use m_kinds, only: wp
   implicit none
   private
   public :: length_unit

   character(len=*), parameter :: micro = char(194)//char(181), mu = char(206)//char(188), latin = char(181)
   character(len=*), parameter, public :: units_of_length = 'm, mm, um, nm, pm or Angstrom'

contains

   !> A unit of length in m; 0: not a unit.
   pure real(wp) function length_unit(word) result(unit)
      character(len=*), intent(in) :: word
      select case (word)
      case ('m', 'meter', 'metre'); unit = 1.0_wp
      case ('mm'); unit = 1.0e-3_wp
      case ('um', 'micron', 'microns', micro//'m', mu//'m', latin//'m'); unit = 1.0e-6_wp
      case ('nm'); unit = 1.0e-9_wp
      case ('pm'); unit = 1.0e-12_wp
      case ('A', 'Angstrom', char(195)//char(133), char(197)); unit = 1.0e-10_wp
      case default; unit = 0.0_wp
      end select
   end function length_unit

end module m_length_units
