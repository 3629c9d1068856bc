!> Weights of the particles of a section on the nine nodes of its plane around their bins (theory.md,
!> Sections), for boxes and parallelograms.
module m_plane_weights
   use m_kinds, only: wp
   use m_field_table, only: layout_t
   use m_cell_list, only: cell_list_t
   use m_stencil, only: stencil_t, frame_t, batch, chunk, list_chunk, fetch, set_section_axes
   implicit none
   private
   public :: plane_weights_t, set_plane_weights

   integer, parameter, public :: plane_nodes = 9

   !> Weights of a chunk of particles; node n is at (a, 0, c) cells from the nearest, n = 5 + a + 3 c. Vectors
   !> may read up to `batch` - 1 entries beyond the last, which hold old values.
   type :: plane_weights_t
      type(stencil_t) :: list !< the particles and their offsets; its own weights are not set
      real(wp) :: weight(chunk + batch, plane_nodes)
      real(wp) :: slope(chunk + batch, plane_nodes, 2) !< along x and along z, 1/m
      real(wp) :: per_radius(chunk + batch) !< of a body of revolution, 1/m; in plane strain 0
   end type plane_weights_t

   !> Parallelograms of a chunk's particles: x and z of their half edges (cells), and of the rows of the
   !> inverse of the matrix of half edges.
   type :: parallelograms_t
      real(wp) :: edge(chunk + batch, 4)
      real(wp) :: inverse(chunk + batch, 4)
   end type parallelograms_t

contains

   !> Set the weights of the traversed particles from the `first` on.
   pure subroutine set_plane_weights(weights, cells, first, column, layout, frame)
      type(plane_weights_t), intent(inout) :: weights
      type(cell_list_t), intent(in) :: cells
      integer, intent(in) :: first
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      type(frame_t), intent(in) :: frame
      real(wp) :: node(chunk, 3), radius(chunk)
      type(parallelograms_t) :: domains
      associate (list => weights%list, n => weights%list%count)
         call list_chunk(list, cells, first, node)
         if (layout%section%is_round()) then
            call fetch(list, column(:, layout%position), radius)
            weights%per_radius(:n) = 1.0_wp/radius(:n)
         else
            radius(:n) = huge(1.0_wp)
            weights%per_radius(:n) = 0.0_wp
         end if
         list%offset(:n, 2) = 0.0_wp
         if (layout%domain > 0) then
            call set_offsets(list, column, layout, frame, node)
            call set_edges(domains, list, column, layout, frame%per_cell, radius)
            call take_corners(weights, domains, frame%per_cell)
         else
            call set_section_axes(list, column, layout, frame, node)
            call take_products(list, weights%weight, weights%slope)
         end if
      end associate
   end subroutine set_plane_weights

   !> Offsets from the nearest node, in the plane.
   pure subroutine set_offsets(list, column, layout, frame, node)
      type(stencil_t), intent(inout) :: list
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      type(frame_t), intent(in) :: frame
      real(wp), intent(in) :: node(chunk, 3)
      real(wp) :: place(chunk)
      integer :: axis
      associate (n => list%count)
         do axis = 1, 3, 2
            call fetch(list, column(:, layout%position + axis - 1), place)
            list%offset(:n, axis) = (place(:n) - frame%origin(axis))*frame%per_cell - node(:n, axis)
            list%offset(n + 1:, axis) = 0.0_wp
         end do
      end associate
   end subroutine set_offsets

   !> Weights of boxes: products of the weights along x and z.
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

   !> Half edges of parallelograms, not beyond the axis and scaled down until they reach no further than half
   !> a cell along either axis, as in m_corner_stencil.
   pure subroutine set_edges(domains, list, column, layout, per_cell, radius)
      type(parallelograms_t), intent(inout) :: domains
      type(stencil_t), intent(in) :: list
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: per_cell      !< 1/m
      real(wp), intent(in) :: radius(chunk) !< m; huge if there is no axis
      real(wp) :: ax(chunk), az(chunk), cx(chunk), cz(chunk), fit, inward, turn
      integer :: n, p
      n = list%count
      call fetch(list, column(:, layout%domain), ax)
      call fetch(list, column(:, layout%domain + 2), az)
      call fetch(list, column(:, layout%domain + 6), cx)
      call fetch(list, column(:, layout%domain + 8), cz)
      associate (r => domains%edge, q => domains%inverse)
         !$omp simd private(fit, inward, turn)
         do p = 1, n
            inward = radius(p)/max(radius(p), abs(ax(p)) + abs(cx(p)))
            fit = inward*per_cell*max(abs(ax(p)) + abs(cx(p)), abs(az(p)) + abs(cz(p)))
            fit = inward*per_cell*min(1.0_wp, 0.5_wp/fit)
            r(p, 1) = fit*ax(p)
            r(p, 2) = fit*az(p)
            r(p, 3) = fit*cx(p)
            r(p, 4) = fit*cz(p)
            turn = 1.0_wp/(r(p, 1)*r(p, 4) - r(p, 2)*r(p, 3))
            q(p, 1) = turn*r(p, 4)
            q(p, 2) = -turn*r(p, 3)
            q(p, 3) = -turn*r(p, 2)
            q(p, 4) = turn*r(p, 1)
         end do
         r(n + 1:n + batch, :) = 0.0_wp
         q(n + 1:n + batch, :) = 0.0_wp
      end associate
   end subroutine set_edges

   !> Weights of parallelograms: the mean over the four corners of the grid's hat functions, and the mean
   !> gradient of their interpolant between the corners (theory.md, eq. corners).
   pure subroutine take_corners(weights, domains, per_cell)
      type(plane_weights_t), intent(inout) :: weights
      type(parallelograms_t), intent(in) :: domains
      real(wp), intent(in) :: per_cell !< 1/m
      real(wp) :: x(batch, -1:1, 4), z(batch, -1:1, 4), q(batch, 4)
      integer :: a, c, corner, first, n, p
      do first = 1, weights%list%count, batch
         do corner = 1, 4
            call hats(weights%list%offset(first, 1), domains%edge(first, 1), domains%edge(first, 3), corner, &
                      x(:, :, corner))
            call hats(weights%list%offset(first, 3), domains%edge(first, 2), domains%edge(first, 4), corner, &
                      z(:, :, corner))
         end do
         q = 0.25_wp*per_cell*domains%inverse(first:first + batch - 1, :)
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
   pure subroutine hats(offset, along, across, corner, hat)
      real(wp), intent(in) :: offset(batch) !< from the nearest node, cells
      real(wp), intent(in) :: along(batch), across(batch) !< components of the first and third half edge
      integer, intent(in) :: corner
      real(wp), intent(out) :: hat(batch, -1:1)
      real(wp) :: place, side, other
      integer :: p
      side = merge(1.0_wp, -1.0_wp, mod(corner, 2) == 0)
      other = merge(1.0_wp, -1.0_wp, corner > 2)
      !$omp simd private(place)
      do p = 1, batch
         place = offset(p) + side*along(p) + other*across(p)
         hat(p, -1) = max(0.0_wp, -place)
         hat(p, 0) = max(0.0_wp, 1.0_wp - abs(place)) ! round-off may put corners just beyond the next node
         hat(p, 1) = max(0.0_wp, place)
      end do
   end subroutine hats

   !> Weight and gradient from the hat function of a node at the corners; u and w: rows of the inverse of the
   !> matrix of the edges, divided by 4 and in 1/m.
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
