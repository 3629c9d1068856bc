!> Rigid tools: their position and motion, and the gap and normal to their surface.
module m_tool
   use m_kinds, only: wp
   use m_rotations, only: no_rotation, turn_by, followed_by, matrix_of
   use m_scene, only: tool_spec_t, motion_spec_t
   use m_freedom, only: freedom_t
   use m_vectors, only: cross
   implicit none
   private
   public :: tool_t, make_tool

   real(wp), parameter :: far = 1.0e30_wp !< m

   !> A tool moves along its axis, and by its motions: each is a degree of freedom, the axis is the first.
   !> `gap` is the signed distance to its surface: positive outside, negative inside. For a convex shape a
   !> step that keeps the linearised gap open keeps the gap open.
   !>
   !> Its reference point is that of its first rotation, or else its tip.
   type :: tool_t
      type(tool_spec_t) :: spec   !< with prepared shape
      type(freedom_t), allocatable :: freedoms(:)
      integer, allocatable :: pushed(:) !< freedoms driven by loads
      integer :: pivot = 0              !< the first rotation; 0: none
      real(wp) :: aside(3) = 0.0_wp     !< displacement of the tip by rotations, m
      real(wp) :: orientation(4) = no_rotation !< a unit quaternion
      real(wp) :: limits(3, 2) = reshape([-far, -far, -far, far, far, far], [3, 2]) !< no contact
                                                                                   !< outside, m
      ! derived from these by settle:
      real(wp) :: tip(3) = 0.0_wp       !< position of the tip, m
      real(wp) :: point(3) = 0.0_wp     !< position of its reference point, m
      real(wp) :: rotation(3, 3) = 0.0_wp !< columns: the rotated axes of the grid
      real(wp) :: velocity(3) = 0.0_wp  !< of its reference point, m/s
      real(wp) :: spin(3) = 0.0_wp      !< rad/s
   contains
      procedure :: is_pushed
      procedure :: begin_step
      procedure :: react
      procedure :: end_step
      procedure :: carry_to
      procedure :: carry_by
      procedure :: settle
      procedure :: depth
      procedure :: displacement
      procedure :: speed_at
      procedure :: fastest
      procedure :: surface_speed
      procedure :: mobilities
      procedure :: along
      procedure :: gap_and_normal
      procedure :: gap_within
      procedure :: gap_of_sheet
      procedure :: sheet_within
      procedure :: min_gap
      procedure :: max_gap
      procedure :: velocity_at
      procedure, private :: set_velocity
      procedure, private :: turn
   end type tool_t

contains

   !> A tool at its start.
   type(tool_t) function make_tool(spec, limits) result(tool)
      type(tool_spec_t), intent(in) :: spec
      real(wp), intent(in), optional :: limits(3, 2) !< bounds of the domain of contact, m
      integer :: k, n
      tool%spec = spec
      call tool%spec%shape%prepare(spec%axis)
      if (present(limits)) tool%limits = limits
      n = 0
      if (allocated(spec%motions)) n = size(spec%motions)
      allocate (tool%freedoms(1 + n))
      tool%freedoms(1)%spec = axial(spec)
      do k = 1, n
         tool%freedoms(1 + k)%spec = spec%motions(k)
      end do
      do k = 1, 1 + n
         tool%freedoms(k)%speed = tool%freedoms(k)%spec%initial_speed
         if (.not. tool%freedoms(k)%is_pushed()) tool%freedoms(k)%speed = tool%freedoms(k)%speed_at(0.0_wp)
         if (tool%pivot == 0 .and. tool%freedoms(k)%spec%turns) tool%pivot = k
      end do
      tool%pushed = pack([(k, k=1, 1 + n)], [(tool%freedoms(k)%is_pushed(), k=1, 1 + n)])
      call tool%settle()
   end function make_tool

   !> The motion along the axis of the tool.
   pure type(motion_spec_t) function axial(spec) result(motion)
      type(tool_spec_t), intent(in) :: spec
      motion%axis = spec%axis
      motion%times = spec%times
      if (allocated(spec%loads)) then
         motion%loads = spec%loads
      else
         motion%speeds = spec%speeds
      end if
      motion%mass = spec%mass
      motion%initial_speed = spec%initial_speed
   end function axial

   !> True when at least one freedom is driven by loads, false when all speeds are given.
   pure logical function is_pushed(self)
      class(tool_t), intent(in) :: self
      is_pushed = size(self%pushed) > 0
   end function is_pushed

   !> Set the speeds of a step: the means of the given ones, and those resulting from the given loads alone;
   !> `have_pushed`: these loads have been applied in this step already.
   pure subroutine begin_step(self, time, time_step, have_pushed)
      class(tool_t), intent(inout) :: self
      real(wp), intent(in) :: time, time_step !< s
      logical, intent(in), optional :: have_pushed
      logical :: push
      integer :: k
      push = .true.
      if (present(have_pushed)) push = .not. have_pushed
      do k = 1, size(self%freedoms)
         if (push .or. .not. self%freedoms(k)%is_pushed()) call self%freedoms(k)%begin_step(time, time_step)
      end do
      call self%set_velocity()
   end subroutine begin_step

   !> Update the speeds of a load-driven tool by the forces of the bodies on it over a step; after begin_step.
   pure subroutine react(self, force, moment, time_step)
      class(tool_t), intent(inout) :: self
      real(wp), intent(in) :: force(3)  !< N
      real(wp), intent(in) :: moment(3) !< about its reference point, N m
      real(wp), intent(in) :: time_step !< s
      real(wp) :: push
      integer :: n
      if (.not. self%is_pushed()) return
      do n = 1, size(self%pushed)
         associate (freedom => self%freedoms(self%pushed(n)))
            if (freedom%spec%turns) then
               push = dot_product(moment + cross(self%point - freedom%point, force), freedom%spec%axis)
            else
               push = dot_product(force, freedom%spec%axis)
            end if
            call freedom%give_way(push, time_step)
         end associate
      end do
      call self%set_velocity()
   end subroutine react

   !> Move the tool to its position at the end of the step, at `time`.
   pure subroutine end_step(self, time, time_step)
      class(tool_t), intent(inout) :: self
      real(wp), intent(in) :: time, time_step !< s
      real(wp) :: before(size(self%freedoms))
      integer :: k
      before = self%freedoms%travel
      do k = 1, size(self%freedoms)
         call self%freedoms(k)%advance(time, time_step)
      end do
      call self%settle()
      if (self%pivot == 0) return
      do k = self%pivot, size(self%freedoms)
         if (self%freedoms(k)%spec%turns) call self%turn(k, self%freedoms(k)%travel - before(k))
      end do
      call self%settle()
   end subroutine end_step

   !> Move the tool by its given speeds until a time (s); load-driven freedoms do not move.
   pure subroutine carry_to(self, time)
      class(tool_t), intent(inout) :: self
      real(wp), intent(in) :: time
      call self%end_step(time, 0.0_wp)
   end subroutine carry_to

   !> Move the tool through a step with given increments (m or rad) of its load-driven freedoms.
   pure subroutine carry_by(self, time, time_step, ways)
      class(tool_t), intent(inout) :: self
      real(wp), intent(in) :: time, time_step !< start of the step and its length; s
      real(wp), intent(in) :: ways(:)         !< (pushed)
      call self%begin_step(time, time_step, have_pushed=.true.)
      self%freedoms(self%pushed)%speed = ways/time_step
      call self%end_step(time + time_step, time_step)
   end subroutine carry_by

   !> Rotate the tool and the points of later rotations about the axis of a freedom, by an angle (rad).
   pure subroutine turn(self, k, angle)
      class(tool_t), intent(inout) :: self
      integer, intent(in) :: k
      real(wp), intent(in) :: angle
      real(wp) :: q(4), move(3, 3)
      integer :: j
      q = turn_by(self%freedoms(k)%spec%axis, angle)
      move = matrix_of(q)
      do j = 1, 3
         move(j, j) = move(j, j) - 1.0_wp
      end do
      associate (centre => self%freedoms(k)%point)
         self%aside = self%aside + matmul(move, self%tip - centre)
         do j = k + 1, size(self%freedoms)
            associate (later => self%freedoms(j))
               if (later%spec%turns) later%aside = later%aside + matmul(move, later%point - centre)
            end associate
         end do
      end associate
      self%orientation = followed_by(self%orientation, q)
      call self%settle()
   end subroutine turn

   !> Update the values derived from the tool's travel and speeds.
   pure subroutine settle(self)
      class(tool_t), intent(inout) :: self
      integer :: k
      self%tip = self%spec%tip
      call slide(self, self%tip)
      self%tip = self%tip + self%aside
      self%point = self%tip
      if (self%pivot > 0) then
         self%rotation = matrix_of(self%orientation)
         do k = self%pivot, size(self%freedoms)
            associate (it => self%freedoms(k))
               if (.not. it%spec%turns) cycle
               it%point = it%spec%point
               call slide(self, it%point)
               it%point = it%point + it%aside
            end associate
         end do
         do k = self%pivot, size(self%freedoms)
            if (self%freedoms(k)%spec%turns) self%freedoms(k)%reach = lever(self, k)
         end do
         self%point = self%freedoms(self%pivot)%point
      end if
      call self%set_velocity()
   end subroutine settle

   !> Move a point by all translations.
   pure subroutine slide(self, place)
      class(tool_t), intent(in) :: self
      real(wp), intent(inout) :: place(3) !< m
      integer :: k
      do k = 1, size(self%freedoms)
         associate (it => self%freedoms(k))
            if (.not. it%spec%turns) place = place + it%travel*it%spec%axis
         end associate
      end do
   end subroutine slide

   !> Largest distance of the tool's surface, within the limits, from the axis of a rotation, m.
   pure real(wp) function lever(self, k)
      type(tool_t), intent(in) :: self
      integer, intent(in) :: k
      real(wp) :: corner(3), farthest
      integer :: i
      associate (it => self%freedoms(k))
         if (count(self%freedoms%spec%turns) == 1) then
            lever = self%spec%shape%reach(it%spec%point - self%spec%tip, it%spec%axis)
         else ! other rotations may turn any side away from the axis
            lever = norm2(it%point - self%tip) + self%spec%shape%reach([0.0_wp, 0.0_wp, 0.0_wp])
         end if
         farthest = 0.0_wp
         do i = 0, 7
            corner = merge(self%limits(:, 2), self%limits(:, 1), [btest(i, 0), btest(i, 1), btest(i, 2)])
            farthest = max(farthest, norm2(cross(it%spec%axis, corner - it%point)))
         end do
         lever = min(lever, farthest)
      end associate
   end function lever

   !> Set the velocity of the tool's reference point and its angular velocity from the speeds of its freedoms.
   pure subroutine set_velocity(self)
      class(tool_t), intent(inout) :: self
      integer :: k
      self%velocity = self%freedoms(1)%speed*self%freedoms(1)%spec%axis
      self%spin = 0.0_wp
      do k = 2, size(self%freedoms)
         associate (it => self%freedoms(k))
            self%velocity = self%velocity + it%speed*it%velocity_at(self%point)
            if (it%spec%turns) self%spin = self%spin + it%speed*it%spec%axis
         end associate
      end do
   end subroutine set_velocity

   !> Travel along its axis since the start, m.
   pure real(wp) function depth(self)
      class(tool_t), intent(in) :: self
      depth = self%freedoms(1)%travel
      if (size(self%freedoms) > 1) depth = dot_product(self%displacement(), self%spec%axis)
   end function depth

   !> Displacement of its reference point since the start, m.
   pure function displacement(self) result(way)
      class(tool_t), intent(in) :: self
      real(wp) :: way(3)
      way = self%freedoms(1)%travel*self%spec%axis
      if (size(self%freedoms) == 1) return
      way = self%aside
      if (self%pivot > 0) way = 0.0_wp ! the reference point of the first rotation is not moved by rotations
      call slide(self, way)
   end function displacement

   !> Upper bound of the surface speed at a time (s), m/s: from the given speeds, and the present ones where
   !> driven by loads.
   pure real(wp) function speed_at(self, time) result(speed)
      class(tool_t), intent(in) :: self
      real(wp), intent(in) :: time
      integer :: k
      speed = 0.0_wp
      do k = 1, size(self%freedoms)
         speed = speed + abs(self%freedoms(k)%speed_at(time))*self%freedoms(k)%reach
      end do
   end function speed_at

   !> The same for all times between two, s; of the given speeds alone if `given`.
   pure real(wp) function fastest(self, from, to, given)
      class(tool_t), intent(in) :: self
      real(wp), intent(in) :: from, to
      logical, intent(in), optional :: given
      integer :: k
      fastest = 0.0_wp
      do k = 1, size(self%freedoms)
         if (present(given)) then
            if (given .and. self%freedoms(k)%is_pushed()) cycle
         end if
         fastest = fastest + self%freedoms(k)%fastest(from, to)*self%freedoms(k)%reach
      end do
   end function fastest

   !> The same for the present step.
   pure real(wp) function surface_speed(self) result(speed)
      class(tool_t), intent(in) :: self
      integer :: k
      speed = norm2(self%velocity)
      if (self%pivot == 0) return
      speed = 0.0_wp
      do k = 1, size(self%freedoms)
         speed = speed + abs(self%freedoms(k)%speed)*self%freedoms(k)%reach
      end do
   end function surface_speed

   !> Changes of speed per unit of load over a step (s), for each load-driven freedom: s/kg or s/(kg m2).
   pure function mobilities(self, time_step)
      class(tool_t), intent(in) :: self
      real(wp), intent(in) :: time_step
      real(wp) :: mobilities(size(self%pushed))
      integer :: n
      do n = 1, size(self%pushed)
         mobilities(n) = self%freedoms(self%pushed(n))%mobility(time_step)
      end do
   end function mobilities

   !> Generalised load on each load-driven freedom per unit of force at a point of the tool, along a
   !> direction: 1 or m.
   pure function along(self, place, direction)
      class(tool_t), intent(in) :: self
      real(wp), intent(in) :: place(3), direction(3)
      real(wp) :: along(size(self%pushed))
      integer :: n
      do n = 1, size(self%pushed)
         along(n) = dot_product(direction, self%freedoms(self%pushed(n))%velocity_at(place))
      end do
   end function along

   !> Velocity (m/s) of the tool at a point.
   pure function velocity_at(self, place) result(v)
      class(tool_t), intent(in) :: self
      real(wp), intent(in) :: place(3) !< m
      real(wp) :: v(3)
      v = self%velocity
      if (self%pivot > 0) v = v + cross(self%spin, place - self%point)
   end function velocity_at

   !> Gap (m) from a point to the tool's surface, and the outward unit normal of the surface there.
   pure subroutine gap_and_normal(self, position, gap, normal)
      class(tool_t), intent(in) :: self
      real(wp), intent(in) :: position(3) !< m
      real(wp), intent(out) :: gap, normal(3)
      call self%spec%shape%distance_and_normal(seen(self, position), gap, normal)
      if (self%pivot > 0) normal = matmul(self%rotation, normal)
   end subroutine gap_and_normal

   !> The same to a sheet of the surface, whose faces go on beside their ends.
   pure subroutine gap_of_sheet(self, position, sheet, gap, normal)
      class(tool_t), intent(in) :: self
      real(wp), intent(in) :: position(3) !< m
      integer, intent(in) :: sheet
      real(wp), intent(out) :: gap, normal(3)
      call self%spec%shape%distance_of_sheet(seen(self, position), sheet, gap, normal)
      if (self%pivot > 0) normal = matmul(self%rotation, normal)
   end subroutine gap_of_sheet

   !> As gap_within, to a face of a sheet that a point is in front of; at least `limit` if there is none.
   pure subroutine sheet_within(self, position, limit, sheet, gap, normal)
      class(tool_t), intent(in) :: self
      real(wp), intent(in) :: position(3), limit !< m
      integer, intent(in) :: sheet
      real(wp), intent(out) :: gap, normal(3)
      call self%spec%shape%sheet_within(seen(self, position), limit, sheet, gap, normal)
      if (self%pivot > 0) normal = matmul(self%rotation, normal)
   end subroutine sheet_within

   !> A place as the tool's shape sees it.
   pure function seen(self, position) result(place)
      class(tool_t), intent(in) :: self
      real(wp), intent(in) :: position(3) !< m
      real(wp) :: place(3)
      place = position - self%tip
      if (self%pivot > 0) place = matmul(place, self%rotation)
   end function seen

   !> The same for a point with a gap (inwards too) below `limit`; else the gap may be a bound of the same
   !> sign, not below the limit in size, and the normal is undefined: this shortens a search.
   pure subroutine gap_within(self, position, limit, gap, normal)
      class(tool_t), intent(in) :: self
      real(wp), intent(in) :: position(3), limit !< m
      real(wp), intent(out) :: gap, normal(3)
      call self%spec%shape%distance_within(seen(self, position), limit, gap, normal)
      if (self%pivot > 0) normal = matmul(self%rotation, normal)
   end subroutine gap_within

   !> Lower bound of the gap, m; the gap itself where that needs no search.
   pure real(wp) function min_gap(self, position) result(gap)
      class(tool_t), intent(in) :: self
      real(wp), intent(in) :: position(3) !< m
      gap = self%spec%shape%min_distance(seen(self, position))
   end function min_gap

   !> Upper bound of the gap, m; as min_gap.
   pure real(wp) function max_gap(self, position) result(gap)
      class(tool_t), intent(in) :: self
      real(wp), intent(in) :: position(3) !< m
      gap = self%spec%shape%max_distance(seen(self, position))
   end function max_gap

end module m_tool
