!> One degree of freedom of a tool: translation along a direction or rotation about an axis, with given speeds
!> or driven by given loads (theory.md, eq. freedoms).
module m_freedom
   use m_kinds, only: wp
   use m_piecewise, only: value_at, integral
   use m_scene, only: motion_spec_t
   use m_vectors, only: cross
   implicit none
   private
   public :: freedom_t

   !> For a rotation, travel is in rad, speed in rad/s, loads in N m, inertia in kg m2; for a translation m,
   !> m/s, N and kg. The direction or axis is fixed in space. The point of a rotation moves with the
   !> translations of its tool and with the rotations listed before it.
   type :: freedom_t
      type(motion_spec_t) :: spec
      real(wp) :: travel = 0.0_wp    !< since the start
      real(wp) :: speed = 0.0_wp     !< in this step
      real(wp) :: aside(3) = 0.0_wp  !< rotation: displacement of its point by the rotations before it, m
      real(wp) :: point(3) = 0.0_wp  !< rotation: present position of its point, m
      real(wp) :: reach = 1.0_wp     !< largest surface speed per unit of its speed: 1, or m
   contains
      procedure :: is_pushed
      procedure :: begin_step
      procedure :: give_way
      procedure :: advance
      procedure :: speed_at
      procedure :: fastest
      procedure :: travel_between
      procedure :: mobility
      procedure :: velocity_at
   end type freedom_t

contains

   !> True when it is driven by loads, false when its speed is given.
   pure logical function is_pushed(self)
      class(freedom_t), intent(in) :: self
      is_pushed = allocated(self%spec%loads)
   end function is_pushed

   !> Set the speed of a step: the mean of the given one, or the one resulting from the given loads alone.
   pure subroutine begin_step(self, time, time_step)
      class(freedom_t), intent(inout) :: self
      real(wp), intent(in) :: time, time_step !< s
      if (self%is_pushed()) then
         self%speed = self%speed + integral(self%spec%times, self%spec%loads, time, time &
                                            + time_step)/self%spec%mass
      else
         self%speed = self%travel_between(time, time + time_step)/time_step
      end if
   end subroutine begin_step

   !> Update the speed of a load-driven freedom by the force (N) or moment (N m) of the bodies over a step;
   !> after begin_step.
   pure subroutine give_way(self, push, time_step)
      class(freedom_t), intent(inout) :: self
      real(wp), intent(in) :: push, time_step
      self%speed = self%speed + self%mobility(time_step)*push
   end subroutine give_way

   !> Advance to the end of the step, at `time`.
   pure subroutine advance(self, time, time_step)
      class(freedom_t), intent(inout) :: self
      real(wp), intent(in) :: time, time_step !< s
      if (self%is_pushed()) then
         self%travel = self%travel + time_step*self%speed
      else
         self%travel = self%travel_between(0.0_wp, time)
      end if
   end subroutine advance

   !> Speed at a time (s): the given one; that of the last step if driven by loads.
   pure real(wp) function speed_at(self, time)
      class(freedom_t), intent(in) :: self
      real(wp), intent(in) :: time
      if (self%is_pushed()) then
         speed_at = self%speed
      else
         speed_at = value_at(self%spec%times, self%spec%speeds, time)
      end if
   end function speed_at

   !> Largest given speed between two times (s); the present one if driven by loads.
   pure real(wp) function fastest(self, from, to)
      class(freedom_t), intent(in) :: self
      real(wp), intent(in) :: from, to
      fastest = max(abs(self%speed_at(from)), abs(self%speed_at(to)))
      if (self%is_pushed()) return
      fastest = max(fastest, maxval(abs(self%spec%speeds), mask=self%spec%times > from &
                                    .and. self%spec%times < to))
   end function fastest

   !> Travel by the given speeds between two times (s).
   pure real(wp) function travel_between(self, from, to) result(way)
      class(freedom_t), intent(in) :: self
      real(wp), intent(in) :: from, to
      way = integral(self%spec%times, self%spec%speeds, from, to)
   end function travel_between

   !> Change of speed per unit of load over a step, s/kg or s/(kg m2); 0 where the speed is given.
   pure real(wp) function mobility(self, time_step)
      class(freedom_t), intent(in) :: self
      real(wp), intent(in) :: time_step
      mobility = 0.0_wp
      if (self%is_pushed()) mobility = time_step/self%spec%mass
   end function mobility

   !> Velocity of a point (m) of the tool per unit of its speed: 1 or m.
   pure function velocity_at(self, place) result(v)
      class(freedom_t), intent(in) :: self
      real(wp), intent(in) :: place(3)
      real(wp) :: v(3)
      if (self%spec%turns) then
         v = cross(self%spec%axis, place - self%point)
      else
         v = self%spec%axis
      end if
   end function velocity_at

end module m_freedom
