!> A growing list of corners and triangles.
module m_triangle_list
   use m_kinds, only: wp
   implicit none
   private

   integer, parameter, public :: max_triangles = 20000000 !< per file

   type, public :: triangle_list_t
      integer :: corners = 0, triangles = 0
      real(wp), allocatable :: place(:, :) !< (3, corners with spare room), in the unit of the file
      integer, allocatable :: of(:, :)     !< (3, triangles with spare room)
   contains
      procedure :: begin
      procedure :: add_corner
      procedure :: add_triangle
   end type triangle_list_t

contains

   pure subroutine begin(self)
      class(triangle_list_t), intent(inout) :: self
      allocate (self%place(3, 1024), self%of(3, 1024))
   end subroutine begin

   pure subroutine add_corner(self, place)
      class(triangle_list_t), intent(inout) :: self
      real(wp), intent(in) :: place(3)
      real(wp), allocatable :: more(:, :)
      if (self%corners == size(self%place, 2)) then
         allocate (more(3, 2*self%corners))
         more(:, :self%corners) = self%place
         call move_alloc(more, self%place)
      end if
      self%corners = self%corners + 1
      self%place(:, self%corners) = place
   end subroutine add_corner

   pure subroutine add_triangle(self, corners)
      class(triangle_list_t), intent(inout) :: self
      integer, intent(in) :: corners(3)
      integer, allocatable :: more(:, :)
      if (self%triangles == size(self%of, 2)) then
         allocate (more(3, 2*self%triangles))
         more(:, :self%triangles) = self%of
         call move_alloc(more, self%of)
      end if
      self%triangles = self%triangles + 1
      self%of(:, self%triangles) = corners
   end subroutine add_triangle

end module m_triangle_list
