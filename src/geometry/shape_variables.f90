!> Variables shared by several shapes: directions and angles, read and written.
module m_shape_variables
   use m_kinds, only: wp
   use m_constants, only: pi
   use m_group_reader, only: group_reader_t
   use m_text, only: to_text
   use m_value_range, only: above, at_least, any_value
   implicit none
   private
   public :: make_unit, get_half_angle, get_edge, get_tip_radius

   real(wp), parameter :: parallel = 1.0e-12_wp !< one minus the cosine of directions that count as parallel

contains

   !> Normalise an axis. A unit vector keeps its bits, so that what is written reads back the same.
   subroutine make_unit(group, axis)
      type(group_reader_t), intent(inout) :: group
      real(wp), intent(inout) :: axis(3)
      if (maxval(abs(axis)) <= 0.0_wp) then
         call group%refuse('axis', 'must not be 0,0,0')
      else if (abs(sum(axis**2) - 1.0_wp) > 8.0_wp*epsilon(1.0_wp)) then
         axis = axis/maxval(abs(axis))
         axis = axis/norm2(axis)
      end if
   end subroutine make_unit

   !> `half_angle`, between axis and surface: degrees in the scene, radians in the shape. 0: no default.
   subroutine get_half_angle(group, radians)
      type(group_reader_t), intent(inout) :: group
      real(wp), intent(inout) :: radians
      real(wp) :: degrees
      degrees = degrees_of(radians)
      call group%get('half_angle', degrees, above(0.0_wp, 'degrees', below=90.0_wp), &
                     required=.not. radians > 0.0_wp)
      radians = degrees*(pi/180.0_wp)
   end subroutine get_half_angle

   !> `tip_radius`, of the sphere that rounds a tip and touches its faces, m; 0 by default: sharp.
   subroutine get_tip_radius(group, radius)
      type(group_reader_t), intent(inout) :: group
      real(wp), intent(inout) :: radius
      call group%get('tip_radius', radius, at_least(0.0_wp, 'm'))
   end subroutine get_tip_radius

   !> Degrees that read back to exactly this angle in radians: with the fewest digits, trying neighbouring
   !> values if needed.
   function degrees_of(radians) result(degrees)
      real(wp), intent(in) :: radians
      real(wp) :: degrees, nearest
      character(len=:), allocatable :: text
      integer :: digits, step
      nearest = radians*(180.0_wp/pi)
      do digits = 1, 17
         text = to_text(nearest, digits)
         read (text, *) degrees
         if (abs(degrees*(pi/180.0_wp) - radians) <= 0.0_wp) return
      end do
      do step = -4, 4
         degrees = nearest + step*spacing(nearest)
         if (abs(degrees*(pi/180.0_wp) - radians) <= 0.0_wp) return
      end do
      degrees = nearest
   end function degrees_of

   !> `edge`, a direction of which the component normal to a tool's axis is used; by default x, or y where the
   !> axis is x.
   subroutine get_edge(group, axis, edge)
      type(group_reader_t), intent(inout) :: group
      real(wp), intent(in) :: axis(3)
      real(wp), intent(inout) :: edge(3)
      if (along_axis()) edge = [0.0_wp, 1.0_wp, 0.0_wp]
      call group%get('edge', edge, any_value(''))
      if (along_axis()) call group%refuse('edge', 'must not be 0,0,0 or parallel to the axis')
   contains
      logical function along_axis()
         along_axis = norm2(edge - dot_product(edge, axis)*axis) <= sqrt(2.0_wp*parallel)*norm2(edge)
      end function along_axis
   end subroutine get_edge

end module m_shape_variables
