!> Names of the particle fields that hold elements of a body's surface (theory.md, eq. surface-element).
module m_surface_fields
   use m_text, only: to_text
   implicit none
   private
   public :: max_elements, area_name, arm_name

   integer, parameter :: max_elements = 6 !< per particle: one a side

contains

   !> Name of the field of an element's area and normal, m2.
   pure function area_name(e) result(name)
      integer, intent(in) :: e !< number of the element
      character(len=:), allocatable :: name
      name = 'surface_area_'//to_text(e)
   end function area_name

   !> Name of the field of the arm from the particle to the middle of an element, m.
   pure function arm_name(e) result(name)
      integer, intent(in) :: e !< number of the element
      character(len=:), allocatable :: name
      name = 'surface_arm_'//to_text(e)
   end function arm_name

end module m_surface_fields
