!> Tools press atoms by their signed distance: a stiff repulsion (theory.md, eq. tool-repulsion). SI units.
module m_tool_repulsion
   use m_kinds, only: wp
   use m_tool, only: tool_t
   use m_vectors, only: cross
   implicit none
   private

   real(wp), parameter :: margin = 3.0e-10_wp !< m: no atom comes nearer to a tool than this between searches,
                                              !< which are half a step of the grid apart

   !> What the atoms have done to one tool since it was last asked for: numbers alone.
   type, public :: tool_push_t
      sequence
      real(wp) :: impulse(3) = 0.0_wp !< on the tool, N s
      real(wp) :: turn(3) = 0.0_wp    !< on the tool about its point, N m s
      real(wp) :: work = 0.0_wp       !< of the tool on the atoms, J
   end type tool_push_t

   integer, parameter, public :: push_reals = storage_size(tool_push_t())/storage_size(1.0_wp)

   !> Energy of an atom that is nearer to a tool than `distance`: stiffness/3 (distance - gap)^3.
   type, public :: tool_repulsion_t
      real(wp) :: stiffness = 0.0_wp            !< N/m2
      real(wp) :: distance = 0.0_wp             !< m
      type(tool_t), allocatable :: tools(:)     !< where they are at a time, and how they move then
      real(wp) :: ahead = 0.0_wp                !< of that time the atoms are by this, s
      real(wp) :: energy = 0.0_wp               !< of all atoms now, J
      type(tool_push_t), allocatable :: pushes(:) !< (tools)
      integer, allocatable :: pairs(:, :)       !< (2, n): atom and tool that may meet
      real(wp), allocatable :: force(:, :)      !< (3, n) on the atom now, N
   contains
      procedure :: place_tools
      procedure :: begin_step
      procedure :: search
      procedure :: find_forces
      procedure :: accumulate
   end type tool_repulsion_t

contains

   !> Tools as they stand and move; the atoms are `ahead` (s) of that.
   subroutine place_tools(self, tools, ahead)
      class(tool_repulsion_t), intent(inout) :: self
      type(tool_t), intent(in) :: tools(:)
      real(wp), intent(in) :: ahead
      integer :: t
      if (.not. allocated(self%tools)) self%tools = tools
      self%ahead = ahead
      do t = 1, size(tools) ! shapes stay as they are, and may be large
         associate (to => self%tools(t), from => tools(t))
            to%freedoms = from%freedoms
            to%aside = from%aside
            to%orientation = from%orientation
            call to%settle()
         end associate
      end do
      if (.not. allocated(self%pushes)) allocate (self%pushes(size(tools)))
      if (.not. allocated(self%pairs)) allocate (self%pairs(2, 0), self%force(3, 0))
   end subroutine place_tools

   !> Tools begin a step: the atoms are where these stand, and they get the speeds of the step.
   subroutine begin_step(self, time, time_step)
      class(tool_repulsion_t), intent(inout) :: self
      real(wp), intent(in) :: time, time_step !< s
      integer :: t
      self%ahead = 0.0_wp
      do t = 1, size(self%tools)
         call self%tools(t)%begin_step(time, time_step)
      end do
   end subroutine begin_step

   !> The atoms, of the first `count`, that tools may press until the next search.
   subroutine search(self, x, count)
      class(tool_repulsion_t), intent(inout) :: self
      real(wp), intent(in) :: x(:, :) !< (3, atoms), m
      integer, intent(in) :: count
      integer, allocatable :: found(:, :)
      integer :: n, t, pairs
      allocate (found(2, count*size(self%tools)))
      pairs = 0
      do t = 1, size(self%tools)
         do n = 1, count
            if (self%tools(t)%min_gap(seen(self, t, x(:, n))) >= self%distance + margin) cycle
            pairs = pairs + 1
            found(:, pairs) = [n, t]
         end do
      end do
      self%pairs = found(:, :pairs)
      deallocate (self%force)
      allocate (self%force(3, pairs), source=0.0_wp)
   end subroutine search

   !> A place as it is relative to a tool that has not moved on by `ahead`.
   pure function seen(self, t, place)
      type(tool_repulsion_t), intent(in) :: self
      integer, intent(in) :: t
      real(wp), intent(in) :: place(3)
      real(wp) :: seen(3)
      seen = place - self%ahead*self%tools(t)%velocity_at(place)
   end function seen

   !> Forces on atoms at places (3, atoms), m, and the energy.
   pure subroutine find_forces(self, x)
      class(tool_repulsion_t), intent(inout) :: self
      real(wp), intent(in) :: x(:, :)
      real(wp) :: gap, normal(3), overlap
      integer :: k
      self%energy = 0.0_wp
      self%force = 0.0_wp
      do k = 1, size(self%pairs, 2)
         associate (n => self%pairs(1, k), t => self%pairs(2, k))
            call self%tools(t)%gap_within(seen(self, t, x(:, n)), self%distance, gap, normal)
            overlap = self%distance - gap
            if (overlap <= 0.0_wp) cycle
            normal = normal + self%ahead*cross(self%tools(t)%spin, normal) ! as `seen` turns
            self%force(:, k) = self%stiffness*overlap**2*normal
            self%energy = self%energy + self%stiffness/3.0_wp*overlap**3
         end associate
      end do
   end subroutine find_forces

   !> The forces of now last for a time (s): what that does to the tools.
   pure subroutine accumulate(self, x, time)
      class(tool_repulsion_t), intent(inout) :: self
      real(wp), intent(in) :: x(:, :), time
      real(wp) :: given(3)
      integer :: k
      do k = 1, size(self%pairs, 2)
         if (.not. any(abs(self%force(:, k)) > 0.0_wp)) cycle
         associate (n => self%pairs(1, k), tool => self%tools(self%pairs(2, k)), &
                    push => self%pushes(self%pairs(2, k)))
            given = time*self%force(:, k)
            push%impulse = push%impulse - given
            push%turn = push%turn - cross(seen(self, self%pairs(2, k), x(:, n)) - tool%point, given)
            push%work = push%work + dot_product(given, tool%velocity_at(x(:, n)))
         end associate
      end do
   end subroutine accumulate

end module m_tool_repulsion
