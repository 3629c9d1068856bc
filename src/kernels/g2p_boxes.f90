!> G2P for boxes: velocity, acceleration and velocity gradient from nodes to particles (theory.md, eq.
!> to-particles).
module m_g2p_boxes
   use m_kinds, only: wp
   use m_constants, only: block_size
   use m_node_values, only: node_values
   use m_field_table, only: layout_t
   use m_cell_list, only: cell_list_t
   use m_stencil, only: stencil_t, frame_t, batch, chunk, set_stencil
   use m_section_weights, only: take_hoop_rate
   implicit none
   private
   public :: g2p_boxes, motion_t, fastest_t, taken_t, move, find_fastest

   integer, parameter :: half = 4 !< half of the node values: those whose gradient is needed, and the others

   !> How the particles move: x += dt v_grid, v = flip (v + dt a) + (1 - flip) v_grid; then v - v_grid <-
   !> null_space_share (v - v_grid).
   type :: motion_t
      real(wp) :: time_step     !< s; with 0 and flip 1 only the velocity gradient is computed
      real(wp) :: flip_fraction
      integer :: position       !< first column of the new position
      real(wp) :: null_space_share = 1.0_wp !< remaining share of the null-space velocity
      integer :: heat = 0       !< column of the energy that the filter dissipates; 0: not stored
   end type motion_t

   !> The particle of a block with the largest grid velocity along an axis, if above the limit; NaN does not
   !> count.
   type :: fastest_t
      real(wp) :: speed        !< first the limit, then that of the particle, m/s
      integer :: particle = 0  !< 0: none is too fast
   end type fastest_t

   !> Interpolated values at the particles of a chunk. Vectors may write up to `batch` - 1 entries beyond the
   !> last.
   type :: taken_t
      real(wp) :: motion(chunk + batch, 6)   !< velocity of the grid, acceleration
      real(wp) :: gradient(chunk + batch, 9) !< d v_i / d x_j at 3 (j-1) + i
   end type taken_t

   integer, parameter :: group = 4 !< particles of a bin processed together; a single or remaining one is
                                   !< processed alone

contains

   !> Move a block's particles with its node tile and store their velocity gradients, d v_i / d x_j at 3 (j-1)
   !> + i.
   pure subroutine g2p_boxes(cells, tile, layout, frame, motion, column, gradient, fastest)
      type(cell_list_t), intent(in) :: cells
      real(wp), intent(in) :: tile(node_values, 0:block_size + 1, 0:block_size + 1, 0:block_size + 1)
      type(layout_t), intent(in) :: layout
      type(frame_t), intent(in) :: frame
      type(motion_t), intent(in) :: motion
      real(wp), intent(inout), contiguous :: column(:, :)
      real(wp), intent(inout), contiguous :: gradient(:, :) !< (:, 9), 1/s
      type(fastest_t), intent(inout), optional :: fastest
      type(stencil_t) :: stencil
      type(taken_t) :: taken
      integer :: first, last, p, r
      do first = 1, cells%count, chunk
         call set_stencil(stencil, cells, first, column, layout, frame)
         do r = 1, stencil%runs
            associate (i => stencil%run_place(1, r), j => stencil%run_place(2, r), &
                       k => stencil%run_place(3, r))
               p = stencil%run_first(r)
               last = stencil%run_first(r + 1) - 1
               do while (last > p)
                  call take_group(stencil, p, i, j, k, tile, taken)
                  p = p + group
               end do
               do p = p, last
                  call take_one(stencil, p, i, j, k, tile, taken)
               end do
            end associate
         end do
         call move(stencil, taken, layout, motion, column, gradient)
         if (present(fastest)) call find_fastest(stencil, taken, fastest)
      end do
   end subroutine g2p_boxes

   !> Raise `fastest` to the fastest particle of a chunk, if that is faster.
   pure subroutine find_fastest(stencil, taken, fastest)
      type(stencil_t), intent(in) :: stencil
      type(taken_t), intent(in) :: taken
      type(fastest_t), intent(inout) :: fastest
      real(wp) :: speed
      integer :: m
      speed = 0.0_wp
      !$omp simd reduction(max: speed)
      do m = 1, stencil%count
         speed = max(speed, abs(taken%motion(m, 1)), abs(taken%motion(m, 2)), abs(taken%motion(m, 3)))
      end do
      if (.not. speed > fastest%speed) return
      do m = 1, stencil%count
         if (maxval(abs(taken%motion(m, 1:3))) >= speed) fastest = fastest_t(speed, stencil%member(m))
      end do
   end subroutine find_fastest

   !> Interpolate for particle `first` and the next ones together: one lane a particle, one quantity after the
   !> other, so that its seven sums and the weights along x fit into sixteen registers. Planes stay a loop
   !> (`unroll 1`): unrolled, all loads of the nodes come first and are spilled. Lanes of particles of another
   !> bin get meaningless values, which are overwritten later.
   pure subroutine take_group(stencil, first, i, j, k, tile, taken)
      type(stencil_t), intent(in) :: stencil
      integer, intent(in) :: first, i, j, k
      real(wp), intent(in) :: tile(node_values, 0:block_size + 1, 0:block_size + 1, 0:block_size + 1)
      type(taken_t), intent(inout) :: taken
      real(wp) :: even, odd, plane, plane_x, plane_y, value, x, y, z
      integer :: b, c, m, q
      do q = 1, 3
         !$omp simd private(even, odd, plane, plane_x, plane_y, value, x, y, z)
         do m = first, first + group - 1
            value = 0.0_wp
            x = 0.0_wp
            y = 0.0_wp
            z = 0.0_wp
            !GCC$ unroll 1
            do c = -1, 1
               plane = 0.0_wp
               plane_x = 0.0_wp
               plane_y = 0.0_wp
               do b = -1, 1
                  even = stencil%weight(m, -1, 1)*tile(1 + q, i, j + 1 + b, k + 1 + c) &
                         + stencil%weight(m, 0, 1)*tile(1 + q, i + 1, j + 1 + b, k + 1 + c) &
                         + stencil%weight(m, 1, 1)*tile(1 + q, i + 2, j + 1 + b, k + 1 + c)
                  odd = stencil%slope(m, -1, 1)*tile(1 + q, i, j + 1 + b, k + 1 + c) &
                        + stencil%slope(m, 0, 1)*tile(1 + q, i + 1, j + 1 + b, k + 1 + c) &
                        + stencil%slope(m, 1, 1)*tile(1 + q, i + 2, j + 1 + b, k + 1 + c)
                  plane = plane + stencil%weight(m, b, 2)*even
                  plane_x = plane_x + stencil%weight(m, b, 2)*odd
                  plane_y = plane_y + stencil%slope(m, b, 2)*even
               end do
               value = value + stencil%weight(m, c, 3)*plane
               x = x + stencil%weight(m, c, 3)*plane_x
               y = y + stencil%weight(m, c, 3)*plane_y
               z = z + stencil%slope(m, c, 3)*plane
            end do
            taken%motion(m, q) = value
            taken%gradient(m, q) = x
            taken%gradient(m, 3 + q) = y
            taken%gradient(m, 6 + q) = z
         end do
      end do
      do q = 4, 6
         !$omp simd private(even, plane, value)
         do m = first, first + group - 1
            value = 0.0_wp
            !GCC$ unroll 1
            do c = -1, 1
               plane = 0.0_wp
               do b = -1, 1
                  even = stencil%weight(m, -1, 1)*tile(1 + q, i, j + 1 + b, k + 1 + c) &
                         + stencil%weight(m, 0, 1)*tile(1 + q, i + 1, j + 1 + b, k + 1 + c) &
                         + stencil%weight(m, 1, 1)*tile(1 + q, i + 2, j + 1 + b, k + 1 + c)
                  plane = plane + stencil%weight(m, b, 2)*even
               end do
               value = value + stencil%weight(m, c, 3)*plane
            end do
            taken%motion(m, q) = value
         end do
      end do
   end subroutine take_group

   !> One particle: one lane a node quantity.
   pure subroutine take_one(stencil, m, i, j, k, tile, taken)
      type(stencil_t), intent(in) :: stencil
      integer, intent(in) :: m, i, j, k
      real(wp), intent(in) :: tile(node_values, 0:block_size + 1, 0:block_size + 1, 0:block_size + 1)
      type(taken_t), intent(inout) :: taken
      real(wp), dimension(half) :: velocity, slope_x, slope_y, slope_z
      real(wp) :: even, odd, plane, plane_x, plane_y, value, x, y, z
      integer :: b, c, q
      !$omp simd private(even, odd, plane, plane_x, plane_y, value, x, y, z)
      do q = 1, half
         value = 0.0_wp
         x = 0.0_wp
         y = 0.0_wp
         z = 0.0_wp
         !GCC$ unroll 1
         do c = -1, 1
            plane = 0.0_wp
            plane_x = 0.0_wp
            plane_y = 0.0_wp
            do b = -1, 1
               even = stencil%weight(m, -1, 1)*tile(q, i, j + 1 + b, k + 1 + c) &
                      + stencil%weight(m, 0, 1)*tile(q, i + 1, j + 1 + b, k + 1 + c) &
                      + stencil%weight(m, 1, 1)*tile(q, i + 2, j + 1 + b, k + 1 + c)
               odd = stencil%slope(m, -1, 1)*tile(q, i, j + 1 + b, k + 1 + c) &
                     + stencil%slope(m, 0, 1)*tile(q, i + 1, j + 1 + b, k + 1 + c) &
                     + stencil%slope(m, 1, 1)*tile(q, i + 2, j + 1 + b, k + 1 + c)
               plane = plane + stencil%weight(m, b, 2)*even
               plane_x = plane_x + stencil%weight(m, b, 2)*odd
               plane_y = plane_y + stencil%slope(m, b, 2)*even
            end do
            value = value + stencil%weight(m, c, 3)*plane
            x = x + stencil%weight(m, c, 3)*plane_x
            y = y + stencil%weight(m, c, 3)*plane_y
            z = z + stencil%slope(m, c, 3)*plane
         end do
         velocity(q) = value
         slope_x(q) = x
         slope_y(q) = y
         slope_z(q) = z
      end do
      do q = 1, 3
         taken%motion(m, q) = velocity(1 + q)
         taken%gradient(m, q) = slope_x(1 + q)
         taken%gradient(m, 3 + q) = slope_y(1 + q)
         taken%gradient(m, 6 + q) = slope_z(1 + q)
      end do
      call take_acceleration(stencil, m, i, j, k, tile, taken)
   end subroutine take_one

   !> As take_one, for the second half of the node values: the acceleration.
   pure subroutine take_acceleration(stencil, m, i, j, k, tile, taken)
      type(stencil_t), intent(in) :: stencil
      integer, intent(in) :: m, i, j, k
      real(wp), intent(in) :: tile(node_values, 0:block_size + 1, 0:block_size + 1, 0:block_size + 1)
      type(taken_t), intent(inout) :: taken
      real(wp) :: acceleration(half), even, plane, value
      integer :: b, c, q
      !$omp simd private(even, plane, value)
      do q = 1, half
         value = 0.0_wp
         !GCC$ unroll 1
         do c = -1, 1
            plane = 0.0_wp
            do b = -1, 1
               even = stencil%weight(m, -1, 1)*tile(half + q, i, j + 1 + b, k + 1 + c) &
                      + stencil%weight(m, 0, 1)*tile(half + q, i + 1, j + 1 + b, k + 1 + c) &
                      + stencil%weight(m, 1, 1)*tile(half + q, i + 2, j + 1 + b, k + 1 + c)
               plane = plane + stencil%weight(m, b, 2)*even
            end do
            value = value + stencil%weight(m, c, 3)*plane
         end do
         acceleration(q) = value
      end do
      do q = 1, 3
         taken%motion(m, 3 + q) = acceleration(q)
      end do
   end subroutine take_acceleration

   !> New positions, velocities and velocity gradients of a chunk; one by one where particles were chosen.
   pure subroutine move(stencil, taken, layout, motion, column, gradient)
      type(stencil_t), intent(in) :: stencil
      type(taken_t), intent(inout) :: taken
      type(layout_t), intent(in) :: layout
      type(motion_t), intent(in) :: motion
      real(wp), intent(inout), contiguous :: column(:, :), gradient(:, :)
      integer :: axis, first, p
      if (layout%section%is_round()) call take_hoop_rate(stencil%count, taken%gradient)
      if (stencil%in_order) then
         first = stencil%member(1) - 1
         do axis = 1, 3
            call move_along(axis, first, 0, stencil%count, taken, layout, motion, column)
         end do
         gradient(first + 1:first + stencil%count, :) = taken%gradient(:stencil%count, :)
      else
         do p = 1, stencil%count
            do axis = 1, 3
               call move_along(axis, stencil%member(p) - 1, p - 1, 1, taken, layout, motion, column)
            end do
            gradient(stencil%member(p), :) = taken%gradient(p, :)
         end do
      end if
   end subroutine move

   !> Consecutive particles, along one axis.
   pure subroutine move_along(axis, before, before_in_chunk, count, taken, layout, motion, column)
      integer, intent(in) :: axis, before, before_in_chunk, count !< particles before them in the block and in
                                                                  !< the chunk; and their number
      type(taken_t), intent(in) :: taken
      type(layout_t), intent(in) :: layout
      type(motion_t), intent(in) :: motion
      real(wp), intent(inout), contiguous :: column(:, :)
      integer :: m, p, q, v, x, y
      x = layout%position + axis - 1
      y = motion%position + axis - 1
      v = layout%velocity + axis - 1
      !$omp simd private(p, q)
      do m = 1, count
         p = before + m
         q = before_in_chunk + m
         column(p, y) = column(p, x) + motion%time_step*taken%motion(q, axis)
         column(p, v) = motion%flip_fraction*(column(p, v) + motion%time_step*taken%motion(q, 3 + axis)) &
                        + (1.0_wp - motion%flip_fraction)*taken%motion(q, axis)
      end do
      if (motion%heat > 0) &
         call rest_along(axis, before, before_in_chunk, count, taken, layout, motion, column)
   end subroutine move_along

   !> Damp the null-space part of the velocities of consecutive particles along one axis (theory.md, eq.
   !> unseen).
   pure subroutine rest_along(axis, before, before_in_chunk, count, taken, layout, motion, column)
      integer, intent(in) :: axis, before, before_in_chunk, count !< as above
      type(taken_t), intent(in) :: taken
      type(layout_t), intent(in) :: layout
      type(motion_t), intent(in) :: motion
      real(wp), intent(inout), contiguous :: column(:, :)
      real(wp) :: rest
      integer :: m, p, v
      v = layout%velocity + axis - 1
      !$omp simd private(p, rest)
      do m = 1, count
         p = before + m
         rest = taken%motion(before_in_chunk + m, axis) + motion%null_space_share*(column(p, v) &
               - taken%motion(before_in_chunk + m, axis))
         column(p, motion%heat) = column(p, motion%heat) &
                                  + 0.5_wp*column(p, layout%mass)*(column(p, v) - rest)*(column(p, v) + rest)
         column(p, v) = rest
      end do
   end subroutine rest_along

end module m_g2p_boxes
