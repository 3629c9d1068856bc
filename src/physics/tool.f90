!> Rigid tools: where they are, and the gap and normal to their surface.
module m_tool
   use m_kinds, only: wp
   use m_scene, only: tool_spec_t, tool_sphere, tool_cone, tool_flat
   implicit none
   private
   public :: tool_t, make_tool

   !> A tool that moves along its axis. `gap` is the signed distance to its surface: positive outside, negative inside.
   !> The shapes are convex, so a step that keeps the linearised gap open keeps the gap open.
   type :: tool_t
      type(tool_spec_t) :: spec
      real(wp) :: travel = 0.0_wp !< along the axis since the start, m
      real(wp) :: speed = 0.0_wp  !< along the axis, m/s
      real(wp) :: cosine = 1.0_wp, sine = 0.0_wp !< of a cone's half angle
   contains
      procedure :: speed_at
      procedure :: travel_between
      procedure :: gap_and_normal
      procedure :: velocity
   end type tool_t

contains

   !> A tool at its start.
   pure type(tool_t) function make_tool(spec) result(tool)
      type(tool_spec_t), intent(in) :: spec
      tool%spec = spec
      tool%travel = 0.0_wp
      tool%speed = tool%speed_at(0.0_wp)
      tool%cosine = cos(spec%half_angle)
      tool%sine = sin(spec%half_angle)
   end function make_tool

   !> Speed (m/s) at a time (s): linear in between the given times, held outside them.
   pure real(wp) function speed_at(self, time)
      class(tool_t), intent(in) :: self
      real(wp), intent(in) :: time
      integer :: i, n
      associate (times => self%spec%times, speeds => self%spec%speeds)
         n = size(times)
         if (time <= times(1)) then
            speed_at = speeds(1)
         else if (time >= times(n)) then
            speed_at = speeds(n)
         else
            i = count(times <= time)
            speed_at = speeds(i) + (speeds(i + 1) - speeds(i))*(time - times(i))/(times(i + 1) - times(i))
         end if
      end associate
   end function speed_at

   !> Distance (m) travelled between two times (s): the integral of the speed, exact for its pieces.
   pure real(wp) function travel_between(self, from, to) result(distance)
      class(tool_t), intent(in) :: self
      real(wp), intent(in) :: from, to
      real(wp) :: begun, ended
      integer :: i
      distance = 0.0_wp
      begun = from
      do i = 1, size(self%spec%times) + 1
         ended = to
         if (i <= size(self%spec%times)) ended = min(to, self%spec%times(i))
         if (ended <= begun) cycle
         distance = distance + 0.5_wp*(self%speed_at(begun) + self%speed_at(ended))*(ended - begun)
         begun = ended
      end do
   end function travel_between

   !> Velocity (m/s).
   pure function velocity(self) result(v)
      class(tool_t), intent(in) :: self
      real(wp) :: v(3)
      v = self%speed*self%spec%axis
   end function velocity

   !> Gap (m) from a place to the tool's surface, and the outward unit normal of the surface there.
   pure subroutine gap_and_normal(self, position, gap, normal)
      class(tool_t), intent(in) :: self
      real(wp), intent(in) :: position(3) !< m
      real(wp), intent(out) :: gap, normal(3)
      real(wp) :: from_tip(3), radial(3), height, radius
      from_tip = position - (self%spec%tip + self%travel*self%spec%axis)
      height = -dot_product(from_tip, self%spec%axis) ! above the tip, into the tool
      radial = from_tip + height*self%spec%axis
      radius = norm2(radial)
      if (radius > 0.0_wp) radial = radial/radius
      select case (self%spec%shape)
      case (tool_sphere)
         normal = from_tip + self%spec%radius*self%spec%axis
         gap = norm2(normal)
         if (gap > 0.0_wp) then
            normal = normal/gap
         else
            normal = self%spec%axis
         end if
         gap = gap - self%spec%radius
      case (tool_cone)
         call cone(self%cosine, self%sine, height, radius, radial, self%spec%axis, gap, normal)
      case (tool_flat)
         call flat(self%spec%radius, height, radius, radial, self%spec%axis, gap, normal)
      end select
   end subroutine gap_and_normal

   !> Infinite cone, apex at height 0. Below the apex' normal cone the apex itself is nearest.
   pure subroutine cone(cosine, sine, height, radius, radial, axis, gap, normal)
      real(wp), intent(in) :: cosine, sine, height, radius, radial(3), axis(3)
      real(wp), intent(out) :: gap, normal(3)
      real(wp) :: along
      along = height*cosine + radius*sine ! along the generator from the apex
      if (along >= 0.0_wp) then
         normal = cosine*radial + sine*axis
         gap = radius*cosine - height*sine
         if (radius <= 0.0_wp) normal = axis
      else
         gap = norm2([height, radius])
         normal = (radius*radial - height*axis)/gap
      end if
   end subroutine cone

   !> Flat-ended cylinder, open upwards.
   pure subroutine flat(face, height, radius, radial, axis, gap, normal)
      real(wp), intent(in) :: face, height, radius, radial(3), axis(3)
      real(wp), intent(out) :: gap, normal(3)
      real(wp) :: below, beside
      below = -height
      beside = radius - face
      if (below > 0.0_wp .and. beside > 0.0_wp) then
         gap = norm2([below, beside])
         normal = (below*axis + beside*radial)/gap
      else if (below >= beside) then
         gap = below
         normal = axis
      else
         gap = beside
         normal = radial
      end if
   end subroutine flat

end module m_tool
