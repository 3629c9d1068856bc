!> Weights of the particles of a section on the nine nodes around their bins that stand on its plane
!> (theory.md, Sections), for boxes and parallelograms alike.
module m_plane_weights
   use m_kinds, only: wp
   use m_field_table, only: layout_t
   use m_cell_list, only: cell_list_t
   use m_stencil, only: stencil_t, frame_t, batch, chunk, set_stencil, fetch
   use m_corner_stencil, only: corner_stencil_t, set_corners
   implicit none
   private
   public :: plane_weights_t, set_plane_weights

   integer, parameter, public :: plane_nodes = 9

   !> Of a chunk of particles; node n stands at (a, 0, c) cells from the nearest, n = 5 + a + 3 c. Vectors may
   !> read `batch` - 1 beyond the last, where something stands from before.
   type :: plane_weights_t
      type(corner_stencil_t) :: corners !< `corners%list` says which particles; offsets are set
      real(wp) :: weight(chunk + batch, plane_nodes)
      real(wp) :: slope(chunk + batch, plane_nodes, 2) !< along x and along z, 1/m
      real(wp) :: per_radius(chunk + batch) !< of a body of revolution, 1/m; in plane strain 0
   end type plane_weights_t

contains

   !> Fill in the particles from the `first` on of those that are gone through.
   pure subroutine set_plane_weights(weights, cells, first, column, layout, frame)
      type(plane_weights_t), intent(inout) :: weights
      type(cell_list_t), intent(in) :: cells
      integer, intent(in) :: first
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      type(frame_t), intent(in) :: frame
      real(wp) :: radius(chunk)
      associate (list => weights%corners%list, n => weights%corners%list%count)
         if (layout%domain > 0) then
            call set_corners(weights%corners, cells, first, column, layout, frame)
            call take_corners(weights, frame%per_cell)
         else
            call set_stencil(list, cells, first, column, layout, frame)
            call take_products(list, weights%weight, weights%slope)
         end if
         weights%per_radius(:n) = 0.0_wp
         if (.not. layout%section%is_round()) return
         call fetch(list, column(:, layout%position), radius)
         weights%per_radius(:n) = 1.0_wp/radius(:n)
      end associate
   end subroutine set_plane_weights

   !> Of boxes: products of the weights along x and z.
   pure subroutine take_products(stencil, weight, slope)
      type(stencil_t), intent(in) :: stencil
      real(wp), intent(inout) :: weight(chunk + batch, plane_nodes), slope(chunk + batch, plane_nodes, 2)
      integer :: a, c, n, p
      do c = -1, 1
         do a = -1, 1
            n = 5 + a + 3*c
            !$omp simd
            do p = 1, stencil%count
               weight(p, n) = stencil%weight(p, a, 1)*stencil%weight(p, c, 3)
               slope(p, n, 1) = stencil%slope(p, a, 1)*stencil%weight(p, c, 3)
               slope(p, n, 2) = stencil%weight(p, a, 1)*stencil%slope(p, c, 3)
            end do
         end do
      end do
   end subroutine take_products

   !> Of parallelograms: the mean over the four corners of the grid's hat functions, and the mean slope of
   !> what interpolates them between the corners (theory.md, eq. corners).
   pure subroutine take_corners(weights, per_cell)
      type(plane_weights_t), intent(inout) :: weights
      real(wp), intent(in) :: per_cell !< 1/m
      real(wp) :: x(batch, -1:1, 4), z(batch, -1:1, 4), q(batch, 4)
      integer :: a, c, corner, first, n, p
      do first = 1, weights%corners%list%count, batch
         do corner = 1, 4
            call hats(weights%corners, first, 1, corner, x(:, :, corner))
            call hats(weights%corners, first, 3, corner, z(:, :, corner))
         end do
         q = 0.25_wp*per_cell*weights%corners%inverse(first:first + batch - 1, [1, 3, 7, 9])
         do c = -1, 1
            do a = -1, 1
               n = 5 + a + 3*c
               !$omp simd
               do p = 1, batch
                  call mean_of_four(x(p, a, 1)*z(p, c, 1), x(p, a, 2)*z(p, c, 2), x(p, a, 3)*z(p, c, 3), &
                                    x(p, a, 4)*z(p, c, 4), q(p, 1), q(p, 2), q(p, 3), q(p, 4), &
                                    weights%weight(first + p - 1, n), weights%slope(first + p - 1, n, 1), &
                                    weights%slope(first + p - 1, n, 2))
               end do
            end do
         end do
      end do
   end subroutine take_corners

   !> The hat functions along an axis of the nodes at -1, 0, 1 at one corner of `batch` particles; corner 1 is
   !> against both edges, 2 along the first, 3 along the third, 4 along both.
   pure subroutine hats(corners, first, axis, corner, hat)
      type(corner_stencil_t), intent(in) :: corners
      integer, intent(in) :: first, axis, corner
      real(wp), intent(out) :: hat(batch, -1:1)
      real(wp) :: place, side, other
      integer :: p
      side = merge(1.0_wp, -1.0_wp, mod(corner, 2) == 0)
      other = merge(1.0_wp, -1.0_wp, corner > 2)
      !$omp simd private(place)
      do p = 1, batch
         place = corners%list%offset(first + p - 1, axis) + side*corners%half_edge(first + p - 1, axis) &
                 + other*corners%half_edge(first + p - 1, 6 + axis)
         hat(p, -1) = max(0.0_wp, -place)
         hat(p, 0) = max(0.0_wp, 1.0_wp - abs(place)) ! corners may lie a rounding beyond the next node
         hat(p, 1) = max(0.0_wp, place)
      end do
   end subroutine hats

   !> From the hat function of a node at the corners; u and w: rows of the inverse of the matrix of the edges,
   !> over 4 and in 1/m.
   pure elemental subroutine mean_of_four(h1, h2, h3, h4, ux, uz, wx, wz, weight, x, z)
      real(wp), intent(in) :: h1, h2, h3, h4, ux, uz, wx, wz
      real(wp), intent(out) :: weight, x, z
      real(wp) :: along_1, along_3
      along_1 = (h2 - h1) + (h4 - h3)
      along_3 = (h3 + h4) - (h1 + h2)
      weight = 0.25_wp*((h1 + h2) + (h3 + h4))
      x = ux*along_1 + wx*along_3
      z = uz*along_1 + wz*along_3
   end subroutine mean_of_four

end module m_plane_weights
