!> Contact at the start, estimated from the shapes and positions of bodies and tools alone (theory.md, eq.
!> level-error).
module m_first_touch
   use m_kinds, only: wp
   use m_grid_level, only: grid_level_t
   use m_scene, only: scene_t
   use m_tool, only: tool_t, make_tool
   use m_marking, only: touch
   implicit none
   private
   public :: touched_at_start, near_tool, mark_neighbours

   real(wp), parameter, public :: reach = 1.5_wp !< material nearer to a tool than this, in cells to be
                                                 !< refined, counts as touched

contains

   !> Cells of the level above that contain material near tools or near bodies of another contact group; with
   !> the cells around them.
   function touched_at_start(scene, grid) result(touched)
      type(scene_t), intent(in) :: scene
      type(grid_level_t), intent(in) :: grid !< of the level above
      logical, allocatable :: touched(:, :, :)
      integer, allocatable, dimension(:, :, :) :: lowest, highest
      type(tool_t), allocatable :: tools(:)
      real(wp) :: half, middle(3)
      integer :: e, i, j, k, t
      tools = [(make_tool(scene%tools(t), reshape([scene%grid%lower, scene%grid%upper], [3, 2])), &
                t=1, size(scene%tools))]
      half = 0.5_wp*sqrt(3.0_wp)*grid%cell
      associate (n => grid%cells)
         allocate (lowest(0:n(1) - 1, 0:n(2) - 1, 0:n(3) - 1), source=huge(1))
         allocate (highest(0:n(1) - 1, 0:n(2) - 1, 0:n(3) - 1), source=0)
         allocate (touched(0:n(1) - 1, 0:n(2) - 1, 0:n(3) - 1), source=.false.)
         do k = 0, n(3) - 1
            do j = 0, n(2) - 1
               do i = 0, n(1) - 1
                  middle = grid%lower + ([i, j, k] + 0.5_wp)*grid%cell
                  if (grid%section%is_flat()) middle(2) = 0.0_wp ! the plane
                  do e = 1, size(scene%bodies)
                     if (.not. scene%bodies(e)%shape%min_distance(middle) < half) cycle
                     lowest(i, j, k) = min(lowest(i, j, k), scene%bodies(e)%field)
                     highest(i, j, k) = max(highest(i, j, k), scene%bodies(e)%field)
                  end do
                  if (highest(i, j, k) == 0) cycle
                  if (near_tool(tools, middle, half + reach*grid%cell)) &
                     call touch(grid, middle, middle, touched)
               end do
            end do
         end do
      end associate
      call mark_neighbours(lowest, highest, touched)
   end function touched_at_start

   !> True when a point is less than `width` (m) away from a tool.
   pure logical function near_tool(tools, place, width)
      type(tool_t), intent(in) :: tools(:)
      real(wp), intent(in) :: place(3), width
      real(wp) :: gap, normal(3)
      integer :: t
      near_tool = .false.
      do t = 1, size(tools)
         call tools(t)%gap_within(place, width, gap, normal)
         near_tool = near_tool .or. gap < width
      end do
   end function near_tool

   !> Cells with another contact group in them or beside them, and those around, are touched.
   pure subroutine mark_neighbours(lowest, highest, touched)
      integer, intent(in) :: lowest(0:, 0:, 0:)  !< smallest number of a group with material in a cell,
      integer, intent(in) :: highest(0:, 0:, 0:) !< and the largest; 0: none
      logical, intent(inout) :: touched(0:, 0:, 0:)
      integer :: a(3), z(3), i, j, k
      if (maxval(highest) <= minval(lowest)) return
      do k = 0, ubound(touched, 3)
         do j = 0, ubound(touched, 2)
            do i = 0, ubound(touched, 1)
               if (highest(i, j, k) == 0) cycle
               a = max([i, j, k] - 1, 0)
               z = min([i, j, k] + 1, ubound(touched))
               if (maxval(highest(a(1):z(1), a(2):z(2), a(3):z(3))) > &
                   minval(lowest(a(1):z(1), a(2):z(2), a(3):z(3)))) &
                  touched(a(1):z(1), a(2):z(2), a(3):z(3)) = .true.
            end do
         end do
      end do
   end subroutine mark_neighbours

end module m_first_touch
