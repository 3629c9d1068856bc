!> Weights of parallelepipeds on the 27 nodes around the bins of their particles (theory.md, eq. corners).
module m_corner_stencil
   use m_kinds, only: wp
   use m_field_table, only: layout_t
   use m_cell_list, only: cell_list_t
   use m_stencil, only: stencil_t, frame_t, batch, chunk, list_chunk, fetch
   use m_section, only: section_t
   use m_section_weights, only: within_axis
   implicit none
   private
   public :: corner_stencil_t, corner_weights_t, set_corners, set_corner_weights

   !> The domains of a chunk of particles, one lane a particle, in cells. Vectors may read `batch` - 1 beyond
   !> the last.
   type :: corner_stencil_t
      type(stencil_t) :: list                  !< which particles; its offsets are set, its weights are not
      integer :: place(3, chunk) !< of their bins in the block, from 0: also the lowest of the 27 nodes in the
                                 !< tile
      real(wp) :: half_edge(chunk + batch, 9) !< component i of edge k at 3 (k-1) + i, no longer than the
                                              !< nodes extent
      real(wp) :: inverse(chunk + batch, 9)    !< inverse of their matrix: component i of row k at 3 (k-1) + i
      type(section_t) :: section               !< that they stand on
      real(wp) :: per_radius(chunk + batch)    !< of one of revolution, 1/m
   end type corner_stencil_t

   !> Weights and slopes (1/m) of `batch` particles; node n stands at (a, b, c) cells from the nearest, n = 14
   !> + a + 3 (b + 3 c).
   type :: corner_weights_t
      real(wp) :: weight(batch, 27)
      real(wp) :: slope(batch, 27, 3)
   end type corner_weights_t

   real(wp), parameter :: sign_of(8, 3) = reshape([-1, 1, -1, 1, -1, 1, -1, 1, -1, -1, 1, 1, -1, -1, 1, 1, &
                                                   -1, -1, -1, -1, 1, 1, 1, 1], [8, 3])
                                                        !< which way edge k leads to a corner

contains

   !> The domains of the particles from place `first` of the list on, scaled to fit.
   pure subroutine set_corners(corners, cells, first, column, layout, frame)
      type(corner_stencil_t), intent(inout) :: corners
      type(cell_list_t), intent(in) :: cells
      integer, intent(in) :: first
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      type(frame_t), intent(in) :: frame
      real(wp) :: node(chunk, 3), own(chunk)
      integer :: axis, c, n, p
      call list_chunk(corners%list, cells, first, node)
      n = corners%list%count
      corners%place(:, :n) = int(transpose(node(:n, :)))
      do axis = 1, 3
         call fetch(corners%list, column(:, layout%position + axis - 1), own)
         corners%list%offset(:n, axis) = (own(:n) - frame%origin(axis))*frame%per_cell - node(:n, axis)
         corners%list%offset(n + 1:, axis) = 0.0_wp
      end do
      do c = 1, 9
         call fetch(corners%list, column(:, layout%domain + c - 1), own)
         corners%half_edge(:n, c) = own(:n)*frame%per_cell
         ! what stands behind the last must have an inverse
         corners%half_edge(n + 1:, c) = merge(0.25_wp, 0.0_wp, mod(c, 4) == 1)
      end do
      corners%section = layout%section
      if (layout%section%is_flat()) call set_section(corners, column, layout, frame)
      associate (r => corners%half_edge, q => corners%inverse)
         !$omp simd
         do p = 1, chunk + batch
            call fit_and_invert(r(p, 1), r(p, 2), r(p, 3), r(p, 4), r(p, 5), r(p, 6), r(p, 7), r(p, 8), &
                                r(p, 9), q(p, 1), q(p, 2), q(p, 3), q(p, 4), q(p, 5), q(p, 6), q(p, 7), &
                                q(p, 8), q(p, 9))
         end do
      end associate
   end subroutine set_corners

   !> The same of a section: parallelograms in its plane, not beyond the axis. The edge along y stays, so that
   !> there is an inverse.
   pure subroutine set_section(corners, column, layout, frame)
      type(corner_stencil_t), intent(inout) :: corners
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      type(frame_t), intent(in) :: frame
      real(wp) :: radius(chunk), factor
      integer :: n, p
      n = corners%list%count
      corners%list%offset(:, 2) = 0.0_wp
      if (.not. layout%section%is_round()) return
      call fetch(corners%list, column(:, layout%position), radius)
      corners%per_radius(:n) = 1.0_wp/radius(:n)
      corners%per_radius(n + 1:) = 0.0_wp
      do p = 1, n
         associate (r => corners%half_edge(p, :))
            factor = within_axis(radius(p)*frame%per_cell, abs(r(1)) + abs(r(7)))
            r(1:3) = factor*r(1:3)
            r(7:9) = factor*r(7:9)
         end associate
      end do
   end subroutine set_section

   !> Scale the half edges a, b, c down until the domain reaches no further than half a cell along any axis
   !> (Homel, Brannon and Guilkey 2016); then its corners lie among the 27 nodes. u, v, w: the rows of the
   !> inverse of the matrix with columns a, b, c.
   pure elemental subroutine fit_and_invert(ax, ay, az, bx, by, bz, cx, cy, cz, ux, uy, uz, vx, vy, vz, wx, &
                                            wy, wz)
      real(wp), intent(inout) :: ax, ay, az, bx, by, bz, cx, cy, cz
      real(wp), intent(out) :: ux, uy, uz, vx, vy, vz, wx, wy, wz
      real(wp) :: extent, fit, per_volume
      extent = max(abs(ax) + abs(bx) + abs(cx), abs(ay) + abs(by) + abs(cy), abs(az) + abs(bz) + abs(cz))
      fit = min(1.0_wp, 0.5_wp/extent)
      ax = fit*ax; ay = fit*ay; az = fit*az
      bx = fit*bx; by = fit*by; bz = fit*bz
      cx = fit*cx; cy = fit*cy; cz = fit*cz
      ux = by*cz - bz*cy; uy = bz*cx - bx*cz; uz = bx*cy - by*cx
      vx = cy*az - cz*ay; vy = cz*ax - cx*az; vz = cx*ay - cy*ax
      wx = ay*bz - az*by; wy = az*bx - ax*bz; wz = ax*by - ay*bx
      per_volume = 1.0_wp/(ax*ux + ay*uy + az*uz)
      ux = per_volume*ux; uy = per_volume*uy; uz = per_volume*uz
      vx = per_volume*vx; vy = per_volume*vy; vz = per_volume*vz
      wx = per_volume*wx; wy = per_volume*wy; wz = per_volume*wz
   end subroutine fit_and_invert

   !> Weights of particle `first` of the chunk and the `batch` - 1 behind it: the mean over the corners of the
   !> grid's hat functions, and the mean slope of what interpolates them between the corners.
   pure subroutine set_corner_weights(weights, corners, first, per_cell)
      type(corner_weights_t), intent(inout) :: weights
      type(corner_stencil_t), intent(in) :: corners
      integer, intent(in) :: first
      real(wp), intent(in) :: per_cell !< 1/m
      real(wp) :: hat(batch, -1:1, 3, 8), plane(batch, 8), q(batch, 9), place
      integer :: a, b, c, axis, corner, n, p
      do corner = 1, 8
         do axis = 1, 3
            !$omp simd private(place)
            do p = 1, batch
               place = corners%list%offset(first + p - 1, axis) &
                       + sign_of(corner, 1)*corners%half_edge(first + p - 1, axis) &
                       + sign_of(corner, 2)*corners%half_edge(first + p - 1, 3 + axis) &
                       + sign_of(corner, 3)*corners%half_edge(first + p - 1, 6 + axis)
               hat(p, -1, axis, corner) = max(0.0_wp, -place)
               ! corners may lie a rounding beyond the next node
               hat(p, 0, axis, corner) = max(0.0_wp, 1.0_wp - abs(place))
               hat(p, 1, axis, corner) = max(0.0_wp, place)
            end do
         end do
      end do
      if (corners%section%is_flat()) then
         hat(:, -1, 2, :) = 0.0_wp
         hat(:, 0, 2, :) = 1.0_wp
         hat(:, 1, 2, :) = 0.0_wp
      end if
      q = 0.125_wp*per_cell*corners%inverse(first:first + batch - 1, :)
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
                                       plane(p, 7)*hat(p, c, 3, 7), plane(p, 8)*hat(p, c, 3, 8), q(p, 1), &
                                       q(p, 2), q(p, 3), q(p, 4), q(p, 5), q(p, 6), q(p, 7), q(p, 8), &
                                       q(p, 9), weights%weight(p, n), weights%slope(p, n, 1), &
                                       weights%slope(p, n, 2), weights%slope(p, n, 3))
               end do
            end do
         end do
      end do
      if (.not. corners%section%is_round()) return
      do n = 1, 27
         weights%slope(:, n, 2) = weights%weight(:, n)*corners%per_radius(first:first + batch - 1)
      end do
   end subroutine set_corner_weights

   !> From the hat function of a node at the corners, first edge's sign changing fastest; u, v, w as above,
   !> over 8 and in 1/m.
   pure elemental subroutine mean_of_corners(h1, h2, h3, h4, h5, h6, h7, h8, ux, uy, uz, vx, vy, vz, wx, wy, &
                                             wz, weight, x, y, z)
      real(wp), intent(in) :: h1, h2, h3, h4, h5, h6, h7, h8, ux, uy, uz, vx, vy, vz, wx, wy, wz
      real(wp), intent(out) :: weight, x, y, z
      real(wp) :: along_1, along_2, along_3, low, high
      along_1 = (h2 - h1) + (h4 - h3) + (h6 - h5) + (h8 - h7)
      along_2 = ((h3 + h4) - (h1 + h2)) + ((h7 + h8) - (h5 + h6))
      low = (h1 + h2) + (h3 + h4)
      high = (h5 + h6) + (h7 + h8)
      along_3 = high - low
      weight = 0.125_wp*(low + high)
      x = ux*along_1 + vx*along_2 + wx*along_3
      y = uy*along_1 + vy*along_2 + wy*along_3
      z = uz*along_1 + vz*along_2 + wz*along_3
   end subroutine mean_of_corners

end module m_corner_stencil
