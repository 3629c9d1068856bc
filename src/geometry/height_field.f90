!> A measured surface, heights on a grid, closed by walls around it and a floor below.
module m_height_field
   use m_kinds, only: wp
   implicit none
   private
   public :: close_heights

contains

   !> Corners and triangles of the solid below the heights. The floor is below the lowest height by the width
   !> of the grid. The highest point is the origin.
   subroutine close_heights(height, spacing, place, of)
      real(wp), intent(in) :: height(:, :) !< (along x, along y), m; 2 or more each
      real(wp), intent(in) :: spacing(2)   !< along x and y, m
      real(wp), allocatable, intent(out) :: place(:, :) !< (3, corners), m
      integer, allocatable, intent(out) :: of(:, :)     !< (3, triangles), counter-clockwise from outside
      real(wp) :: floor
      integer :: i, j, n, nx, ny, top(2)
      nx = size(height, 1)
      ny = size(height, 2)
      top = maxloc(height)
      floor = minval(height) - maxval(spacing*[nx - 1, ny - 1])
      allocate (place(3, 2*nx*ny), of(3, 4*(nx - 1)*(ny - 1) + 4*(nx - 1) + 4*(ny - 1)))
      do j = 1, ny
         do i = 1, nx
            place(:, upper(i, j)) = [spacing*([i, j] - top), height(i, j) - height(top(1), top(2))]
            place(:, lower(i, j)) = [spacing*([i, j] - top), floor - height(top(1), top(2))]
         end do
      end do
      n = 0
      do j = 1, ny - 1
         do i = 1, nx - 1
            call quad(upper(i, j), upper(i + 1, j), upper(i + 1, j + 1), upper(i, j + 1))
            call quad(lower(i, j), lower(i, j + 1), lower(i + 1, j + 1), lower(i + 1, j))
         end do
      end do
      do i = 1, nx - 1
         call quad(lower(i, 1), lower(i + 1, 1), upper(i + 1, 1), upper(i, 1))
         call quad(lower(i + 1, ny), lower(i, ny), upper(i, ny), upper(i + 1, ny))
      end do
      do j = 1, ny - 1
         call quad(lower(1, j + 1), lower(1, j), upper(1, j), upper(1, j + 1))
         call quad(lower(nx, j), lower(nx, j + 1), upper(nx, j + 1), upper(nx, j))
      end do
   contains
      pure integer function upper(i, j)
         integer, intent(in) :: i, j
         upper = i + nx*(j - 1)
      end function upper
      pure integer function lower(i, j)
         integer, intent(in) :: i, j
         lower = nx*ny + i + nx*(j - 1)
      end function lower
      !> Two triangles, divided along the shorter diagonal where these differ.
      subroutine quad(a, b, c, d)
         integer, intent(in) :: a, b, c, d !< counter-clockwise
         if (sum((place(:, a) - place(:, c))**2) <= sum((place(:, b) - place(:, d))**2)) then
            of(:, n + 1) = [a, b, c]
            of(:, n + 2) = [a, c, d]
         else
            of(:, n + 1) = [a, b, d]
            of(:, n + 2) = [b, c, d]
         end if
         n = n + 2
      end subroutine quad
   end subroutine close_heights

end module m_height_field
