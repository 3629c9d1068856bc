!> Weights of parallelepipeds on the 27 nodes around the bins of their particles (theory.md, eq. corners).
module m_corner_stencil
   use m_kinds, only: wp
   use m_field_table, only: layout_t
   use m_cell_list, only: cell_list_t
   use m_stencil, only: stencil_t, frame_t, batch, chunk, list_chunk, fetch
   use m_section_weights, only: within_axis
   implicit none
   private
   public :: corner_stencil_t, corner_weights_t, set_corners, set_corner_weights, corner_slopes, batch_end

   !> The domains of a chunk of particles, one lane a particle, in cells. Vectors may read up to `batch` - 1
   !> entries beyond the last.
   type :: corner_stencil_t
      type(stencil_t) :: list !< the particles and their runs; its offsets are set, its weights are not
      real(wp) :: half_edge(chunk + batch, 9) !< component i of edge k at 3 (k-1) + i, limited to the reach of
                                              !< the nodes
      real(wp) :: inverse(chunk + batch, 9)   !< inverse of the matrix of half edges: component i of row k at
                                              !< 3 (k-1) + i
      logical :: flat, round                  !< the particles are on a section, of a body of revolution
      real(wp) :: hoop(chunk + batch)         !< for a body of revolution: factor from the weight to the
                                              !< difference along the edge across the section
   end type corner_stencil_t

   !> Weights of `batch` particles, and the mean differences of the hat functions along each half edge:
   !> multiplied by the inverse they are gradients. Node n is at (a, b, c) cells from the nearest, n = 14 + a
   !> + 3 (b + 3 c).
   type :: corner_weights_t
      real(wp) :: weight(batch, 27)
      real(wp) :: along(batch, 27, 3)
   end type corner_weights_t

   real(wp), parameter :: sign_of(8, 3) = reshape([-1, 1, -1, 1, -1, 1, -1, 1, -1, -1, 1, 1, -1, -1, 1, 1, &
                                                   -1, -1, -1, -1, 1, 1, 1, 1], [8, 3])
                                                        !< sign of edge k in each corner

contains

   !> Set the domains of the particles from position `first` of the list on, scaled to fit.
   pure subroutine set_corners(corners, cells, first, column, layout, frame)
      type(corner_stencil_t), intent(inout) :: corners
      type(cell_list_t), intent(in) :: cells
      integer, intent(in) :: first
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      type(frame_t), intent(in) :: frame
      real(wp) :: node(chunk, 3), place(chunk), edge(chunk, 9)
      integer :: axis, c, n
      call list_chunk(corners%list, cells, first, node)
      n = corners%list%count
      do axis = 1, 3
         call fetch(corners%list, column(:, layout%position + axis - 1), place)
         corners%list%offset(:n, axis) = (place(:n) - frame%origin(axis))*frame%per_cell - node(:n, axis)
         corners%list%offset(n + 1:, axis) = 0.0_wp
      end do
      corners%flat = layout%section%is_flat()
      corners%round = layout%section%is_round()
      if (corners%list%in_order .and. .not. layout%section%is_flat()) then
         call set_edges(corners, column(:, layout%domain:layout%domain + 8), corners%list%member(1) - 1, &
                        frame%per_cell)
         return
      end if
      do c = 1, 9
         call fetch(corners%list, column(:, layout%domain + c - 1), edge(:, c))
      end do
      if (layout%section%is_flat()) call set_section(corners, column, layout, edge)
      call set_edges(corners, edge, 0, frame%per_cell)
   end subroutine set_corners

   !> Store the half edges a, b, c (m) of the chunk's particles in rows `before` + 1 and on: scaled down until
   !> the domain reaches no further than half a cell along any axis (Homel, Brannon and Guilkey 2016); then
   !> its corners lie among the 27 nodes. u, v, w: the rows of the inverse of the matrix with columns a, b, c.
   pure subroutine set_edges(corners, edge, before, per_cell)
      type(corner_stencil_t), intent(inout) :: corners
      real(wp), intent(in), contiguous :: edge(:, :)
      integer, intent(in) :: before
      real(wp), intent(in) :: per_cell !< 1/m
      real(wp) :: ax, ay, az, bx, by, bz, cx, cy, cz, ux, uy, uz, vx, vy, vz, wx, wy, wz, extent, fit, turn
      integer :: n, p
      n = corners%list%count
      associate (r => corners%half_edge, q => corners%inverse)
         !$omp simd private(ax, ay, az, bx, by, bz, cx, cy, cz, ux, uy, uz, vx, vy, vz, wx, wy, wz, extent, &
         !$omp& fit, turn)
         do p = 1, n
            ax = edge(before + p, 1); ay = edge(before + p, 2); az = edge(before + p, 3)
            bx = edge(before + p, 4); by = edge(before + p, 5); bz = edge(before + p, 6)
            cx = edge(before + p, 7); cy = edge(before + p, 8); cz = edge(before + p, 9)
            extent = per_cell*max(abs(ax) + abs(bx) + abs(cx), abs(ay) + abs(by) + abs(cy), &
                                  abs(az) + abs(bz) + abs(cz))
            fit = per_cell*min(1.0_wp, 0.5_wp/extent)
            ax = fit*ax; ay = fit*ay; az = fit*az
            bx = fit*bx; by = fit*by; bz = fit*bz
            cx = fit*cx; cy = fit*cy; cz = fit*cz
            ux = by*cz - bz*cy; uy = bz*cx - bx*cz; uz = bx*cy - by*cx
            vx = cy*az - cz*ay; vy = cz*ax - cx*az; vz = cx*ay - cy*ax
            wx = ay*bz - az*by; wy = az*bx - ax*bz; wz = ax*by - ay*bx
            turn = 1.0_wp/(ax*ux + ay*uy + az*uz)
            r(p, 1) = ax; r(p, 2) = ay; r(p, 3) = az
            r(p, 4) = bx; r(p, 5) = by; r(p, 6) = bz
            r(p, 7) = cx; r(p, 8) = cy; r(p, 9) = cz
            q(p, 1) = turn*ux; q(p, 2) = turn*uy; q(p, 3) = turn*uz
            q(p, 4) = turn*vx; q(p, 5) = turn*vy; q(p, 6) = turn*vz
            q(p, 7) = turn*wx; q(p, 8) = turn*wy; q(p, 9) = turn*wz
         end do
         r(n + 1:, :) = 0.0_wp
         q(n + 1:, :) = 0.0_wp
      end associate
   end subroutine set_edges

   !> The same for a section: parallelograms in its plane, not beyond the axis. The edge along y is kept, so
   !> that the matrix is invertible; on a ring the difference along it represents the hoop gradient, weight
   !> over radius.
   pure subroutine set_section(corners, column, layout, edge)
      type(corner_stencil_t), intent(inout) :: corners
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      real(wp), intent(inout) :: edge(:, :) !< m
      real(wp) :: radius(chunk), factor
      integer :: n, p
      n = corners%list%count
      corners%list%offset(:, 2) = 0.0_wp
      if (.not. layout%section%is_round()) return
      call fetch(corners%list, column(:, layout%position), radius)
      corners%hoop(n + 1:) = 0.0_wp
      do p = 1, n
         factor = within_axis(radius(p), abs(edge(p, 1)) + abs(edge(p, 7)))
         edge(p, 1:3) = factor*edge(p, 1:3)
         edge(p, 7:9) = factor*edge(p, 7:9)
         corners%hoop(p) = edge(p, 5)/radius(p)
      end do
   end subroutine set_section

   !> Weights of particle `first` of the chunk and the `batch` - 1 behind it: the mean over the corners of the
   !> grid's hat functions, and the mean differences of these along the half edges.
   pure subroutine set_corner_weights(weights, corners, first)
      type(corner_weights_t), intent(inout) :: weights
      type(corner_stencil_t), intent(in) :: corners
      integer, intent(in) :: first
      real(wp) :: hat(batch, -1:1, 3, 8), plane(batch, 8)
      integer :: a, b, c, corner, n, p
      call set_hats(corners, first, hat)
      do b = -1, 1
         do a = -1, 1
            do corner = 1, 8
               plane(:, corner) = hat(:, a, 1, corner)*hat(:, b, 2, corner)
            end do
            do c = -1, 1
               n = 14 + a + 3*(b + 3*c)
               !$omp simd
               do p = 1, batch
                  call mean_of_corners(plane(p, 1)*hat(p, c, 3, 1), plane(p, 2)*hat(p, c, 3, 2), &
                                       plane(p, 3)*hat(p, c, 3, 3), plane(p, 4)*hat(p, c, 3, 4), &
                                       plane(p, 5)*hat(p, c, 3, 5), plane(p, 6)*hat(p, c, 3, 6), &
                                       plane(p, 7)*hat(p, c, 3, 7), plane(p, 8)*hat(p, c, 3, 8), &
                                       weights%weight(p, n), weights%along(p, n, 1), &
                                       weights%along(p, n, 2), weights%along(p, n, 3))
               end do
            end do
         end do
      end do
      if (.not. corners%round) return
      do n = 1, 27
         weights%along(:, n, 2) = weights%weight(:, n)*corners%hoop(first:first + batch - 1)
      end do
   end subroutine set_corner_weights

   !> Hat functions along each axis of the nodes at -1, 0, 1 at the corners of a batch; those along z divided
   !> by 8.
   pure subroutine set_hats(corners, first, hat)
      type(corner_stencil_t), intent(in) :: corners
      integer, intent(in) :: first
      real(wp), intent(out) :: hat(batch, -1:1, 3, 8)
      real(wp) :: place, share
      integer :: axis, corner, p
      do axis = 1, 3
         share = merge(0.125_wp, 1.0_wp, axis == 3)
         do corner = 1, 8
            !$omp simd private(place)
            do p = 1, batch
               place = share*(corners%list%offset(first + p - 1, axis) &
                              + sign_of(corner, 1)*corners%half_edge(first + p - 1, axis) &
                              + sign_of(corner, 2)*corners%half_edge(first + p - 1, 3 + axis) &
                              + sign_of(corner, 3)*corners%half_edge(first + p - 1, 6 + axis))
               hat(p, -1, axis, corner) = max(0.0_wp, -place)
               ! round-off may put corners just beyond the next node
               hat(p, 0, axis, corner) = max(0.0_wp, share - abs(place))
               hat(p, 1, axis, corner) = max(0.0_wp, place)
            end do
         end do
      end do
      if (.not. corners%flat) return
      hat(:, -1, 2, :) = 0.0_wp
      hat(:, 0, 2, :) = 1.0_wp
      hat(:, 1, 2, :) = 0.0_wp
   end subroutine set_hats

   !> Mean and differences from the hat function of a node at the corners, divided by 8, the sign of the first
   !> edge changing fastest.
   pure elemental subroutine mean_of_corners(h1, h2, h3, h4, h5, h6, h7, h8, weight, along_1, along_2, &
                                             along_3)
      real(wp), intent(in) :: h1, h2, h3, h4, h5, h6, h7, h8
      real(wp), intent(out) :: weight, along_1, along_2, along_3
      real(wp) :: low, high
      along_1 = (h2 - h1) + (h4 - h3) + (h6 - h5) + (h8 - h7)
      along_2 = ((h3 + h4) - (h1 + h2)) + ((h7 + h8) - (h5 + h6))
      low = (h1 + h2) + (h3 + h4)
      high = (h5 + h6) + (h7 + h8)
      along_3 = high - low
      weight = low + high
   end subroutine mean_of_corners

   !> Gradients (1/m) of the weights of particle m of the chunk on its 27 nodes.
   pure function corner_slopes(weights, corners, m, per_cell) result(slope)
      type(corner_weights_t), intent(in) :: weights !< of the particle's batch
      type(corner_stencil_t), intent(in) :: corners
      integer, intent(in) :: m
      real(wp), intent(in) :: per_cell !< 1/m
      real(wp) :: slope(27, 3)
      slope = per_cell*matmul(weights%along(1 + mod(m - 1, batch), :, :), &
                              transpose(reshape(corners%inverse(m, :), [3, 3])))
   end function corner_slopes

   !> The last particle of run r of the chunk that is in the batch of particle m.
   pure integer function batch_end(list, r, m)
      type(stencil_t), intent(in) :: list
      integer, intent(in) :: r, m
      batch_end = min(list%run_first(r + 1) - 1, m + batch - 1 - mod(m - 1, batch))
   end function batch_end

end module m_corner_stencil
