!> Triangulation of polygons.
module m_polygons
   use m_kinds, only: wp
   use m_vectors, only: cross
   implicit none
   private
   public :: cut_ears

contains

   !> Cut a polygon, plane or nearly so, convex or not, into two triangles less than it has corners, by ear
   !> clipping (Meisters 1975): first the earliest corner that has no other corner in its triangle. A convex
   !> one is cut from its first corner. `good` is false if there is no such corner: the polygon crosses
   !> itself.
   pure subroutine cut_ears(corner, triangle, good)
      real(wp), intent(in) :: corner(:, :)       !< (3, corners)
      integer, intent(out) :: triangle(:, :)     !< (3, corners - 2): numbers of corners
      logical, intent(out) :: good
      real(wp) :: normal(3), flat(2, size(corner, 2))
      integer :: left(size(corner, 2)), axis, k, n, t, u, v
      normal = 0.0_wp ! twice the area (Newell)
      n = size(corner, 2)
      do k = 1, n
         normal = normal + cross(corner(:, k) - corner(:, 1), corner(:, 1 + mod(k, n)) - corner(:, 1))
      end do
      axis = maxloc(abs(normal), dim=1)
      u = 1 + mod(axis, 3)
      v = 1 + mod(axis + 1, 3)
      flat(1, :) = corner(u, :) - corner(u, 1)
      flat(2, :) = (corner(v, :) - corner(v, 1))*sign(1.0_wp, normal(axis)) ! counter-clockwise
      left = [(k, k=1, n)]
      good = .true.
      do t = 1, size(triangle, 2)
         good = .false.
         do k = 2, n + 1
            associate (ear => left([k - 1, 1 + mod(k - 1, n), 1 + mod(k, n)]))
               good = is_ear(flat, left(:n), ear)
               if (good) triangle(:, t) = ear
            end associate
            if (good) exit
         end do
         if (.not. good) return
         k = 1 + mod(k - 1, n)
         left(k:n - 1) = left(k + 1:n)
         n = n - 1
      end do
   end subroutine cut_ears

   !> True when three corners turn left, or are collinear, and contain no other corner.
   pure logical function is_ear(flat, left, ear)
      real(wp), intent(in), contiguous :: flat(:, :) !< (2, corners)
      integer, intent(in) :: left(:)     !< remaining corners
      integer, intent(in) :: ear(3)
      integer :: k
      is_ear = turn(flat(:, ear(1)), flat(:, ear(2)), flat(:, ear(3))) >= 0.0_wp
      do k = 1, size(left)
         if (.not. is_ear) return
         if (any(left(k) == ear)) cycle
         associate (p => flat(:, left(k)))
            is_ear = min(turn(flat(:, ear(1)), flat(:, ear(2)), p), &
                         turn(flat(:, ear(2)), flat(:, ear(3)), p), &
                         turn(flat(:, ear(3)), flat(:, ear(1)), p)) <= 0.0_wp
         end associate
      end do
   end function is_ear

   !> Twice the area of a triangle, above 0 if its corners turn left.
   pure real(wp) function turn(a, b, c)
      real(wp), intent(in) :: a(2), b(2), c(2)
      turn = (b(1) - a(1))*(c(2) - a(2)) - (b(2) - a(2))*(c(1) - a(1))
   end function turn

end module m_polygons
