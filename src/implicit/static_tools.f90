!> Tools in a quasi-static step: their positions at its end, by given speeds and by displacements of
!> load-driven freedoms, which are unknowns of the step's equilibrium (theory.md, eq. static-tools).
module m_static_tools
   use m_kinds, only: wp
   use m_vectors, only: cross
   use m_piecewise, only: value_at
   use m_tool, only: tool_t
   implicit none
   private
   public :: static_tools_t

   !> Freedom k of the load-driven ones is freedom(k) of tool(k). The same on all ranks.
   type :: static_tools_t
      type(tool_t), allocatable :: before(:) !< at the step's beginning
      type(tool_t), allocatable :: now(:)    !< at its end, by the last displacements
      integer :: count = 0                   !< number of load-driven freedoms
      integer, allocatable :: tool(:), freedom(:)
      real(wp), allocatable :: load(:)       !< at the step's end, over the reach; N
      real(wp), allocatable :: reach(:)      !< 1, or for a rotation: the tool's largest lever, m
      real(wp), allocatable :: way(:)        !< displacement of the surface at that distance, m
      logical, allocatable :: away(:)        !< (tools): retracted by the load along its axis; without contact
      real(wp) :: time = 0.0_wp, time_step = 0.0_wp !< of the beginning; s
   contains
      procedure :: begin
      procedure :: place
      procedure :: shift
      procedure :: gap_and_normal
      procedure :: gap_before
      procedure :: depth_of
      procedure :: outward_at
      procedure :: turning_at
      procedure :: material_way
      procedure :: way_at
      procedure :: slides_at
      procedure :: push
      procedure :: is_driven
      procedure :: ways_before
      procedure :: name_of
   end type static_tools_t

   real(wp), parameter :: widest_drift = 0.5_wp !< of half a thickness, as in explicit steps
   integer, parameter :: max_attempts = 4 !< displacements tried to find a point outside for one inside a tool

contains

   !> Start a step; loads are ramped up until `ramp` (s).
   subroutine begin(self, tools, time, time_step, ramp)
      class(static_tools_t), intent(inout) :: self
      type(tool_t), intent(in) :: tools(:)
      real(wp), intent(in) :: time, time_step, ramp
      real(wp) :: share
      integer :: k, t
      if (allocated(self%before)) deallocate (self%before, self%now, self%away)
      self%before = tools
      self%now = tools
      self%time = time
      self%time_step = time_step
      self%tool = [((t, k=1, size(tools(t)%pushed)), t=1, size(tools))]
      self%freedom = [(tools(t)%pushed, t=1, size(tools))]
      self%count = size(self%tool)
      if (allocated(self%load)) deallocate (self%load, self%reach, self%way)
      allocate (self%load(self%count), self%reach(self%count), self%way(self%count), source=0.0_wp)
      allocate (self%away(size(tools)), source=.false.)
      share = 1.0_wp
      if (time + time_step < ramp) share = (time + time_step)/ramp
      do k = 1, self%count
         associate (it => tools(self%tool(k))%freedoms(self%freedom(k)))
            self%reach(k) = merge(it%reach, 1.0_wp, it%spec%turns)
            self%load(k) = share*value_at(it%spec%times, it%spec%loads, time + time_step)/self%reach(k)
            if (self%freedom(k) == 1 .and. .not. self%load(k) > 0.0_wp) self%away(self%tool(k)) = .true.
         end associate
      end do
      call self%place(self%way)
   end subroutine begin

   !> Move the tools by displacements of the load-driven freedoms.
   subroutine place(self, way)
      class(static_tools_t), intent(inout) :: self
      real(wp), intent(in) :: way(:)
      integer :: t
      self%way = way
      do t = 1, size(self%before)
         associate (now => self%now(t), before => self%before(t)) ! not the shape, which may be large
            now%freedoms = before%freedoms
            now%aside = before%aside
            now%orientation = before%orientation
         end associate
         call self%now(t)%carry_by(self%time, self%time_step, pack(way/self%reach, self%tool == t))
      end do
   end subroutine place

   !> Shift a tool along its axis, from the step's beginning on.
   subroutine shift(self, t, way)
      class(static_tools_t), intent(inout) :: self
      integer, intent(in) :: t
      real(wp), intent(in) :: way !< m
      self%before(t)%freedoms(1)%travel = self%before(t)%freedoms(1)%travel + way
      call self%before(t)%settle()
      call self%place(self%way)
   end subroutine shift

   !> The gap (m) of a point at the step's end, and the outward unit normal. Inside a tool the nearest face
   !> changes from one side of a ridge to the other, and its normal does not tell where the point came from:
   !> the gap is that of the point moved out along `outward`, minus that displacement.
   pure subroutine gap_and_normal(self, t, sheet, place, outward, gap, normal)
      class(static_tools_t), intent(in) :: self
      integer, intent(in) :: t
      integer, intent(in) :: sheet !< of the tool's surface; 0: there is one alone
      real(wp), intent(in) :: place(3), outward(3) !< m; a unit vector
      real(wp), intent(out) :: gap, normal(3)
      real(wp) :: aside(3), beyond, way
      integer :: try
      call look(self%now(t), sheet, place, gap, normal)
      if (.not. gap < 0.0_wp) return
      way = -gap
      do try = 1, max_attempts
         way = 2.0_wp*way
         call look(self%now(t), sheet, place + way*outward, beyond, aside)
         if (beyond < 0.0_wp) cycle
         gap = beyond - way
         normal = aside
         return
      end do
   end subroutine gap_and_normal

   !> The gap (m) and the normal at the step's beginning.
   pure subroutine gap_before(self, t, sheet, place, gap, normal)
      class(static_tools_t), intent(in) :: self
      integer, intent(in) :: t, sheet
      real(wp), intent(in) :: place(3)
      real(wp), intent(out) :: gap, normal(3)
      call look(self%before(t), sheet, place, gap, normal)
   end subroutine gap_before

   !> Gap and normal to a sheet of a tool, or to its surface if there is one alone.
   pure subroutine look(tool, sheet, place, gap, normal)
      type(tool_t), intent(in) :: tool
      integer, intent(in) :: sheet
      real(wp), intent(in) :: place(3)
      real(wp), intent(out) :: gap, normal(3)
      if (sheet > 0) then
         call tool%gap_of_sheet(place, sheet, gap, normal)
      else
         call tool%gap_and_normal(place, gap, normal)
      end if
   end subroutine look

   !> Depth of a particle's face below its centre, m: by its shape or, if the tool has pressed it, as left by
   !> the nodes after the last step, with this gap (theory.md, eq. carried-gap).
   pure real(wp) function depth_of(self, t, sheet, centre, natural, left) result(depth)
      class(static_tools_t), intent(in) :: self
      integer, intent(in) :: t, sheet
      real(wp), intent(in) :: centre(3), natural !< m
      real(wp), intent(in) :: left               !< m; 0: none
      real(wp) :: gap, normal(3)
      depth = natural
      if (.not. abs(left) > 0.0_wp) return
      call look(self%before(t), sheet, centre, gap, normal)
      depth = natural + max(-widest_drift*natural, min(widest_drift*natural, gap - left - natural))
   end function depth_of

   !> The direction in which a point (m) is outside a tool that may have passed over it in the step.
   pure function outward_at(self, t, sheet, place) result(outward)
      class(static_tools_t), intent(in) :: self
      integer, intent(in) :: t, sheet
      real(wp), intent(in) :: place(3)
      real(wp) :: outward(3), gap
      call look(self%now(t), sheet, place, gap, outward)
      if (gap < 0.0_wp) call look(self%before(t), sheet, place, gap, outward)
   end function outward_at

   !> Rotation of the normal as a point moves, by finite differences over a span (m), 1/m.
   pure function turning_at(self, t, sheet, place, outward, span) result(turning)
      class(static_tools_t), intent(in) :: self
      integer, intent(in) :: t, sheet
      real(wp), intent(in) :: place(3), outward(3), span
      real(wp) :: turning(3, 3), aside(3), gap, ahead(3), behind(3)
      integer :: k
      do k = 1, 3
         aside = 0.0_wp
         aside(k) = span
         call self%gap_and_normal(t, sheet, place + aside, outward, gap, ahead)
         call self%gap_and_normal(t, sheet, place - aside, outward, gap, behind)
         turning(:, k) = (ahead - behind)/(2.0_wp*span)
      end do
      turning = 0.5_wp*(turning + transpose(turning))
   end function turning_at

   !> True when a load drives a tool along its axis.
   pure logical function is_driven(self, t)
      class(static_tools_t), intent(in) :: self
      integer, intent(in) :: t
      is_driven = self%before(t)%freedoms(1)%is_pushed()
   end function is_driven

   !> Displacement in the step of the tool's material point at a position at the end, m.
   pure function material_way(self, t, at) result(way)
      class(static_tools_t), intent(in) :: self
      integer, intent(in) :: t
      real(wp), intent(in) :: at(3)
      real(wp) :: way(3)
      associate (before => self%before(t), now => self%now(t))
         way = now%tip - before%tip
         if (now%pivot == 0) return
         way = at - before%tip - matmul(before%rotation, matmul(at - now%tip, now%rotation))
      end associate
   end function material_way

   !> Name of the tool of a freedom.
   pure function name_of(self, k) result(name)
      class(static_tools_t), intent(in) :: self
      integer, intent(in) :: k
      character(len=:), allocatable :: name
      name = trim(self%before(self%tool(k))%spec%name)
   end function name_of

   !> The displacements if all continues as in the last step, m.
   pure function ways_before(self) result(ways)
      class(static_tools_t), intent(in) :: self
      real(wp) :: ways(self%count)
      integer :: k
      do k = 1, self%count
         ways(k) = self%time_step*self%reach(k)*self%before(self%tool(k))%freedoms(self%freedom(k))%speed
         if (self%away(self%tool(k))) ways(k) = 0.0_wp
      end do
   end function ways_before

   !> Displacement of the tool's material point at a position by small displacements of the load-driven
   !> freedoms.
   pure function way_at(self, t, at, way) result(moved)
      class(static_tools_t), intent(in) :: self
      integer, intent(in) :: t
      real(wp), intent(in) :: at(3), way(:)
      real(wp) :: moved(3)
      integer :: k
      moved = 0.0_wp
      do k = 1, self%count
         if (self%tool(k) == t) moved = moved + way(k)/self%reach(k) &
                                        *self%now(t)%freedoms(self%freedom(k))%velocity_at(at)
      end do
   end function way_at

   !> The same by translations alone: a rotation does not move the surface of a body of revolution about its
   !> axis.
   pure function slides_at(self, t, way) result(moved)
      class(static_tools_t), intent(in) :: self
      integer, intent(in) :: t
      real(wp), intent(in) :: way(:)
      real(wp) :: moved(3)
      integer :: k
      moved = 0.0_wp
      do k = 1, self%count
         associate (it => self%now(self%tool(k))%freedoms(self%freedom(k)))
            if (self%tool(k) == t .and. .not. it%spec%turns) moved = moved + way(k)*it%spec%axis
         end associate
      end do
   end function slides_at

   !> Add the generalised loads of a force (N) at a point of a tool; `slides_only`: on translations only.
   pure subroutine push(self, t, at, force, sums, slides_only)
      class(static_tools_t), intent(in) :: self
      integer, intent(in) :: t
      real(wp), intent(in) :: at(3), force(3)
      real(wp), intent(inout) :: sums(:)
      logical, intent(in), optional :: slides_only
      integer :: k
      do k = 1, self%count
         if (self%tool(k) /= t) cycle
         associate (it => self%now(t)%freedoms(self%freedom(k)))
            if (it%spec%turns) then
               if (present(slides_only)) cycle
               sums(k) = sums(k) + dot_product(force, cross(it%spec%axis, at - it%point))/self%reach(k)
            else
               sums(k) = sums(k) + dot_product(force, it%spec%axis)
            end if
         end associate
      end do
   end subroutine push

end module m_static_tools
