!> Where a tool meets the bodies: the first surface on the straight line from its tip along its axis, at the
!> start, of bodies of any shape and with their cuts.
module m_first_surface
   use m_kinds, only: wp
   use m_scene, only: scene_t
   use m_shape, only: shape_t
   use m_vectors, only: cross
   implicit none
   private
   public :: find_first_surface

   real(wp), parameter :: aside = 1.0e-4_wp  !< of a cell: distance of the lines from the axis, which may lie
                                             !< on a symmetry side, in an edge of a body
   real(wp), parameter :: stride = 1.0e-2_wp !< of a cell: least step along a line
   real(wp), parameter :: rounding = 1.0e-9_wp !< of a cell: a smaller gap is 0
   integer, parameter :: halvings = 60       !< of the step in which a line enters a body

contains

   !> The body that the line meets first, and the distance of its surface from the tip (m), below 0 where the
   !> tip is inside; 0 and 0 where it meets none. The lines are four beside the axis.
   subroutine find_first_surface(scene, n, body, gap)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: n !< of the tool
      integer, intent(out) :: body
      real(wp), intent(out) :: gap
      real(wp) :: across(3, 2), start(3), way
      integer :: b, line
      logical :: met
      body = 0
      gap = 0.0_wp
      associate (tool => scene%tools(n), cell => scene%grid%cell_size)
         across(:, 1) = cross(tool%axis, unit(minloc(abs(tool%axis), 1)))
         across(:, 1) = across(:, 1)/norm2(across(:, 1))
         across(:, 2) = cross(tool%axis, across(:, 1))
         do b = 1, size(scene%bodies)
            do line = 0, 3
               start = tool%tip + aside*cell*(across(:, 1)*merge(1, -1, btest(line, 0)) &
                                              + across(:, 2)*merge(1, -1, btest(line, 1)))
               call entry(scene%bodies(b)%shape, start, tool%axis, stride*cell, met, way)
               if (.not. met) cycle
               if (body > 0 .and. way >= gap) cycle
               body = b
               gap = way
            end do
         end do
         if (abs(gap) < rounding*cell) gap = 0.0_wp
      end associate
   end subroutine find_first_surface

   pure function unit(i)
      integer, intent(in) :: i
      real(wp) :: unit(3)
      unit = 0.0_wp
      unit(i) = 1.0_wp
   end function unit

   !> Where a line enters a shape: forwards from its start, or backwards where that is inside.
   subroutine entry(shape, start, axis, least, met, way)
      class(shape_t), intent(in) :: shape
      real(wp), intent(in) :: start(3), axis(3)
      real(wp), intent(in) :: least !< least step, m
      logical, intent(out) :: met
      real(wp), intent(out) :: way  !< from the start, m
      real(wp) :: outer, distance, reach
      logical :: backwards
      met = .false.
      way = 0.0_wp
      reach = shape%reach(start)
      distance = shape%distance(start)
      backwards = distance < 0.0_wp
      do ! steps of at most the distance pass no surface
         outer = way
         way = way + merge(-1.0_wp, 1.0_wp, backwards)*max(abs(distance), least)
         if (abs(outer) > reach) return
         distance = shape%distance(start + way*axis)
         met = (distance < 0.0_wp) .neqv. backwards
         if (met) exit
      end do
      if (backwards) call swap(outer, way)
      call bisect(shape, start, axis, outer, way)
   end subroutine entry

   pure subroutine swap(a, b)
      real(wp), intent(inout) :: a, b
      real(wp) :: kept
      kept = a
      a = b
      b = kept
   end subroutine swap

   !> The surface between a point outside and one inside.
   subroutine bisect(shape, start, axis, outer, inner)
      class(shape_t), intent(in) :: shape
      real(wp), intent(in) :: start(3), axis(3)
      real(wp), intent(in) :: outer
      real(wp), intent(inout) :: inner
      real(wp) :: outside, middle
      integer :: i
      outside = outer
      do i = 1, halvings
         middle = 0.5_wp*(outside + inner)
         if (shape%distance(start + middle*axis) < 0.0_wp) then
            inner = middle
         else
            outside = middle
         end if
      end do
   end subroutine bisect

end module m_first_surface
