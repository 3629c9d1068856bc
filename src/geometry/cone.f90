!> A cone, open upwards, with its tip in the origin: its apex, or the foremost point of a sphere that touches
!> its surface.
module m_cone
   use m_kinds, only: wp
   use m_group_reader, only: group_reader_t
   use m_section, only: section_t
   use m_shape, only: convex_t, why_not_round
   use m_shape_variables, only: get_half_angle, get_tip_radius
   use m_vectors, only: split_along
   implicit none
   private
   public :: cone_t

   type, extends(convex_t) :: cone_t
      real(wp) :: half_angle = 0.0_wp               !< between axis and surface, rad
      real(wp) :: tip_radius = 0.0_wp               !< m; 0: sharp
      real(wp), private :: cosine = 1.0_wp, sine = 0.0_wp !< of half_angle
   contains
      procedure :: variables
      procedure :: prepare
      procedure :: distance_and_normal
      procedure :: take_section
   end type cone_t

contains

   subroutine variables(self, group)
      class(cone_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      call get_half_angle(group, self%half_angle)
      call get_tip_radius(group, self%tip_radius)
   end subroutine variables

   pure subroutine prepare(self, axis)
      class(cone_t), intent(inout) :: self
      real(wp), intent(in) :: axis(3)
      self%axis = axis
      self%cosine = cos(self%half_angle)
      self%sine = sin(self%half_angle)
   end subroutine prepare

   !> A rounded cone is the set of points closer to a sharp one inside it than its radius. Within the normal
   !> cone of the apex the apex itself is nearest.
   pure subroutine distance_and_normal(self, place, distance, normal)
      class(cone_t), intent(in) :: self
      real(wp), intent(in) :: place(3)
      real(wp), intent(out) :: distance, normal(3)
      real(wp) :: height, radius, radial(3), along
      call split_along(self%axis, place + self%tip_radius*self%axis, height, radius, radial)
      along = height*self%cosine + radius*self%sine ! along the generator from the apex
      if (along >= 0.0_wp) then
         normal = self%cosine*radial + self%sine*self%axis
         distance = radius*self%cosine - height*self%sine
         if (radius <= 0.0_wp) normal = self%axis
      else
         distance = norm2([height, radius])
         normal = (radius*radial - height*self%axis)/distance
      end if
      distance = distance - self%tip_radius
   end subroutine distance_and_normal

   subroutine take_section(self, section, why)
      class(cone_t), intent(inout) :: self
      type(section_t), intent(in) :: section
      character(len=:), allocatable, intent(out) :: why
      why = why_not_round(section, [0.0_wp, 0.0_wp, 0.0_wp], self%axis)
   end subroutine take_section

end module m_cone
