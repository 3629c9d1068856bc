!> Rigid tools: where they are, how they move, and the gap and normal to their surface.
module m_tool
   use m_kinds, only: wp
   use m_piecewise, only: value_at, integral
   use m_scene, only: tool_spec_t
   implicit none
   private
   public :: tool_t, make_tool

   !> A tool that moves along its axis, at given speeds or pushed by given loads. `gap` is the signed distance
   !> to its surface: positive outside, negative inside. At a convex shape a step that keeps the linearised
   !> gap open keeps the gap open.
   type :: tool_t
      type(tool_spec_t) :: spec   !< its shape has been prepared
      real(wp) :: travel = 0.0_wp !< along the axis since the start, m
      real(wp) :: speed = 0.0_wp  !< along the axis, m/s
   contains
      procedure :: is_pushed
      procedure :: begin_step
      procedure :: react
      procedure :: end_step
      procedure :: speed_at
      procedure :: fastest
      procedure :: travel_between
      procedure :: mobility
      procedure :: gap_and_normal
      procedure :: least_gap
      procedure :: velocity
   end type tool_t

contains

   !> A tool at its start.
   type(tool_t) function make_tool(spec) result(tool)
      type(tool_spec_t), intent(in) :: spec
      tool%spec = spec
      call tool%spec%shape%prepare(spec%axis)
      tool%travel = 0.0_wp
      tool%speed = spec%initial_speed
      if (.not. tool%is_pushed()) tool%speed = tool%speed_at(0.0_wp)
   end function make_tool

   !> True when loads push the tool, false when its speed is given.
   pure logical function is_pushed(self)
      class(tool_t), intent(in) :: self
      is_pushed = allocated(self%spec%loads)
   end function is_pushed

   !> Set the speed of a step: the mean of the given one, or the one to which the loads alone would bring the
   !> tool.
   pure subroutine begin_step(self, time, time_step)
      class(tool_t), intent(inout) :: self
      real(wp), intent(in) :: time, time_step !< s
      if (self%is_pushed()) then
         self%speed = self%speed + integral(self%spec%times, self%spec%loads, time, time &
                                            + time_step)/self%spec%mass
      else
         self%speed = self%travel_between(time, time + time_step)/time_step
      end if
   end subroutine begin_step

   !> A pushed tool gives way to the force (N) that the bodies exert on it over a step; after begin_step.
   pure subroutine react(self, force, time_step)
      class(tool_t), intent(inout) :: self
      real(wp), intent(in) :: force(3), time_step
      self%speed = self%speed + self%mobility(time_step)*dot_product(force, self%spec%axis)
   end subroutine react

   !> Move the tool to where it is at a time, the end of the step.
   pure subroutine end_step(self, time, time_step)
      class(tool_t), intent(inout) :: self
      real(wp), intent(in) :: time, time_step !< s
      if (self%is_pushed()) then
         self%travel = self%travel + time_step*self%speed
      else
         self%travel = self%travel_between(0.0_wp, time)
      end if
   end subroutine end_step

   !> Speed (m/s) at a time (s): the given one; that of the last step where loads push.
   pure real(wp) function speed_at(self, time)
      class(tool_t), intent(in) :: self
      real(wp), intent(in) :: time
      if (self%is_pushed()) then
         speed_at = self%speed
      else
         speed_at = value_at(self%spec%times, self%spec%speeds, time)
      end if
   end function speed_at

   !> Largest speed (m/s) that is given between two times (s), or that of now where loads push.
   pure real(wp) function fastest(self, from, to)
      class(tool_t), intent(in) :: self
      real(wp), intent(in) :: from, to
      fastest = max(abs(self%speed_at(from)), abs(self%speed_at(to)))
      if (self%is_pushed()) return
      fastest = max(fastest, maxval(abs(self%spec%speeds), mask=self%spec%times > from &
                                    .and. self%spec%times < to))
   end function fastest

   !> Distance (m) that the given speeds make between two times (s).
   pure real(wp) function travel_between(self, from, to) result(distance)
      class(tool_t), intent(in) :: self
      real(wp), intent(in) :: from, to
      distance = integral(self%spec%times, self%spec%speeds, from, to)
   end function travel_between

   !> Speed that a unit of force along the axis makes in a step, s/kg; 0 for a tool whose speed is given.
   pure real(wp) function mobility(self, time_step)
      class(tool_t), intent(in) :: self
      real(wp), intent(in) :: time_step
      mobility = 0.0_wp
      if (self%is_pushed()) mobility = time_step/self%spec%mass
   end function mobility

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
      call self%spec%shape%distance_and_normal(position - (self%spec%tip + self%travel*self%spec%axis), gap, &
                                               normal)
   end subroutine gap_and_normal

   !> The gap is not less, m; the gap itself where that takes no search.
   pure real(wp) function least_gap(self, position) result(gap)
      class(tool_t), intent(in) :: self
      real(wp), intent(in) :: position(3) !< m
      gap = self%spec%shape%least_distance(position - (self%spec%tip + self%travel*self%spec%axis))
   end function least_gap

end module m_tool
