!> A regular pyramid, open upwards: Vickers with four faces, cube corner with three, or any other.
module m_regular_pyramid
   use m_kinds, only: wp
   use m_constants, only: pi
   use m_group_reader, only: group_reader_t
   use m_text, only: to_text
   use m_pyramid, only: pyramid_t, max_faces
   use m_shape_variables, only: get_half_angle, get_edge, get_tip_radius
   implicit none
   private
   public :: regular_pyramid_t

   !> The normal of the first face leans towards `edge`.
   type, extends(pyramid_t) :: regular_pyramid_t
      integer :: sides = 0 !< faces
   contains
      procedure :: variables
      procedure :: outwards
   end type regular_pyramid_t

contains

   subroutine variables(self, group)
      class(regular_pyramid_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      call group%get('faces', self%sides, least=3, required=.true.)
      if (self%sides > max_faces) then
         call group%refuse('faces', 'must be at most '//to_text(max_faces))
         self%sides = max_faces
      end if
      call get_half_angle(group, self%half_angle)
      call get_edge(group, self%axis, self%edge)
      call get_tip_radius(group, self%tip_radius)
   end subroutine variables

   pure function outwards(self, edge, across) result(ways)
      class(regular_pyramid_t), intent(in) :: self
      real(wp), intent(in) :: edge(3), across(3)
      real(wp), allocatable :: ways(:, :)
      integer :: k
      allocate (ways(3, self%sides))
      do k = 1, self%sides
         associate (turn => 2.0_wp*pi*(k - 1)/self%sides)
            ways(:, k) = cos(turn)*edge + sin(turn)*across
         end associate
      end do
   end function outwards

end module m_regular_pyramid
