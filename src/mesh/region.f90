!> The box that a nested level refines (theory.md, Levels).
!>
!> Its sides lie on nodes of the level above. A side on a side of the grid is open: there is no edge, the level goes on beyond it.
module m_region
   use m_kinds, only: wp
   use m_grid_level, only: grid_level_t
   implicit none
   private
   public :: region_t, make_region

   real(wp), parameter :: entry_margin = 0.25_wp !< what comes so near to a region, in its cells, reaches in: a lattice that ends at
                                                 !< an edge is not to change level with the first movement, or by rounding

   type :: region_t
      real(wp) :: lower(3) = -huge(1.0_wp) !< m; far away where a side is open
      real(wp) :: upper(3) = huge(1.0_wp)  !< m
      real(wp) :: near = 0.0_wp            !< what comes nearer reaches in, m
      integer :: first(3) = -huge(1)       !< nodes of the level's grid that are strictly inside: first to last
      integer :: last(3) = huge(1)
      integer :: low(3) = 0, high(3) = 0   !< its sides in nodes of the level's grid, open or not
   contains
      procedure :: overlaps
      procedure :: holds
      procedure :: is_inner
      procedure :: clear_of_edge
      procedure :: holds_box
   end type region_t

contains

   !> The region between two nodes of a level's grid.
   pure type(region_t) function make_region(grid, low, high) result(region)
      type(grid_level_t), intent(in) :: grid
      integer, intent(in) :: low(3), high(3) !< even: nodes of the level above
      integer :: axis
      region%near = entry_margin*grid%cell
      region%low = low
      region%high = high
      do axis = 1, 3
         if (low(axis) > 0) then
            region%lower(axis) = grid%lower(axis) + low(axis)*grid%cell
            region%first(axis) = low(axis) + 1
         end if
         if (high(axis) < grid%cells(axis)) then
            region%upper(axis) = grid%lower(axis) + high(axis)*grid%cell
            region%last(axis) = high(axis) - 1
         end if
      end do
   end function make_region

   !> True when a box reaches into the region, or comes near it.
   pure logical function overlaps(self, low, high)
      class(region_t), intent(in) :: self
      real(wp), intent(in) :: low(3), high(3) !< m
      overlaps = all(high > self%lower - self%near .and. low < self%upper + self%near)
   end function overlaps

   !> True when a place lies inside.
   pure logical function holds(self, place)
      class(region_t), intent(in) :: self
      real(wp), intent(in) :: place(3) !< m
      holds = all(place > self%lower .and. place < self%upper)
   end function holds

   !> True when a node (indices in the level's grid) is an unknown of the level; all others are constrained nodes of the level
   !> above.
   pure logical function is_inner(self, node)
      class(region_t), intent(in) :: self
      integer, intent(in) :: node(3)
      is_inner = all(node >= self%first .and. node <= self%last)
   end function is_inner

   !> True when no place of a box is less than `width` away from an edge.
   pure logical function clear_of_edge(self, low, high, width)
      class(region_t), intent(in) :: self
      real(wp), intent(in) :: low(3), high(3), width !< m
      clear_of_edge = any(high <= self%lower - width .or. low >= self%upper + width) .or. self%holds_box(low, high, width)
   end function clear_of_edge

   !> True when a box lies inside, at least `width` away from all edges.
   pure logical function holds_box(self, low, high, width)
      class(region_t), intent(in) :: self
      real(wp), intent(in) :: low(3), high(3), width !< m
      holds_box = all(low >= self%lower + width .and. high <= self%upper - width)
   end function holds_box

end module m_region
