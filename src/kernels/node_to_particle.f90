!> Particles take velocity, acceleration and velocity gradient from their nodes (theory.md, eq. to-particles).
module m_node_to_particle
   use m_kinds, only: wp
   use m_constants, only: block_size
   use m_field_table, only: layout_t
   use m_cell_list, only: cell_list_t
   use m_stencil, only: stencil_t, frame_t, batch, chunk, set_stencil, fetch, put_back
   implicit none
   private
   public :: scatter_to_particles, motion_t, longest_t, taken_t, move, find_longest

   integer, parameter :: lanes = 8 !< values a node: mass, velocity (3), acceleration (3), spare

   !> How the particles move: x += dt v_grid, v = flip (v + dt a) + (1 - flip) v_grid.
   type :: motion_t
      real(wp) :: time_step     !< s; with 0 and flip 1 only the velocity gradient is taken
      real(wp) :: flip_fraction
      integer :: position       !< first column of where the new position goes
   end type motion_t

   !> The particle of a block that the grid carries fastest along an axis, if faster than allowed: an undefined speed is none.
   type :: longest_t
      real(wp) :: speed        !< allowed at first, then that of the particle, m/s
      integer :: particle = 0  !< 0: none is too fast
   end type longest_t

   !> What the particles of a chunk take. Vectors may write `batch` - 1 beyond the last.
   type :: taken_t
      real(wp) :: motion(chunk + batch, 6)   !< velocity of the grid, acceleration
      real(wp) :: gradient(chunk + batch, 9) !< d v_i / d x_j at 3 (j-1) + i
   end type taken_t

   integer, parameter :: few = 3 !< up to so many particles of a bin are done one by one

contains

   !> Move a block's particles with its node tile and store their velocity gradients, d v_i / d x_j at 3 (j-1) + i.
   pure subroutine scatter_to_particles(cells, tile, layout, frame, motion, column, gradient, longest)
      type(cell_list_t), intent(in) :: cells
      real(wp), intent(in) :: tile(lanes, 0:block_size + 1, 0:block_size + 1, 0:block_size + 1)
      type(layout_t), intent(in) :: layout
      type(frame_t), intent(in) :: frame
      type(motion_t), intent(in) :: motion
      real(wp), intent(inout), contiguous :: column(:, :)
      real(wp), intent(inout), contiguous :: gradient(:, :) !< (:, 9), 1/s
      type(longest_t), intent(inout), optional :: longest
      type(stencil_t) :: stencil
      type(taken_t) :: taken
      integer :: first, last, p, r
      do first = 1, cells%first(size(cells%first)) - 1, chunk
         call set_stencil(stencil, cells, first, column, layout, frame)
         do r = 1, stencil%runs
            associate (i => stencil%run_place(1, r), j => stencil%run_place(2, r), k => stencil%run_place(3, r))
               p = stencil%run_first(r)
               last = stencil%run_first(r + 1) - 1
               do while (last - p >= few)
                  call take_batch(stencil, p, i, j, k, tile, taken)
                  p = p + batch
               end do
               do p = p, last
                  call take_one(stencil, p, i, j, k, tile, taken)
               end do
            end associate
         end do
         call move(stencil, taken, layout, motion, column, gradient)
         if (present(longest)) call find_longest(stencil, taken, longest)
      end do
   end subroutine scatter_to_particles

   !> Raise `longest` to the fastest of a chunk, if that is faster.
   pure subroutine find_longest(stencil, taken, longest)
      type(stencil_t), intent(in) :: stencil
      type(taken_t), intent(in) :: taken
      type(longest_t), intent(inout) :: longest
      real(wp) :: speed
      integer :: m
      speed = 0.0_wp
      !$omp simd reduction(max: speed)
      do m = 1, stencil%count
         speed = max(speed, abs(taken%motion(m, 1)), abs(taken%motion(m, 2)), abs(taken%motion(m, 3)))
      end do
      if (.not. speed > longest%speed) return
      do m = 1, stencil%count
         if (maxval(abs(taken%motion(m, 1:3))) >= speed) longest = longest_t(speed, stencil%member(m))
      end do
   end subroutine find_longest

   !> The particle `first` and those behind it together: one lane a particle. What is taken by those that are not of the same bin
   !> is nonsense, and overwritten when their turn comes.
   pure subroutine take_batch(stencil, first, i, j, k, tile, taken)
      type(stencil_t), intent(in) :: stencil
      integer, intent(in) :: first, i, j, k
      real(wp), intent(in) :: tile(lanes, 0:block_size + 1, 0:block_size + 1, 0:block_size + 1)
      type(taken_t), intent(inout) :: taken
      real(wp), dimension(batch) :: wx1, wx2, wx3, sx1, sx2, sx3, wy, sy, wz, sz, odd
      real(wp), dimension(batch, 6) :: even, plane, motion
      real(wp), dimension(batch, 3) :: plane_x, plane_y, slope_x, slope_y, slope_z
      integer :: b, c, p, q
      wx1 = stencil%weight(first:first + batch - 1, -1, 1)
      wx2 = stencil%weight(first:first + batch - 1, 0, 1)
      wx3 = stencil%weight(first:first + batch - 1, 1, 1)
      sx1 = stencil%slope(first:first + batch - 1, -1, 1)
      sx2 = stencil%slope(first:first + batch - 1, 0, 1)
      sx3 = stencil%slope(first:first + batch - 1, 1, 1)
      motion = 0.0_wp
      slope_x = 0.0_wp
      slope_y = 0.0_wp
      slope_z = 0.0_wp
      do c = -1, 1
         plane = 0.0_wp
         plane_x = 0.0_wp
         plane_y = 0.0_wp
         do b = -1, 1
            wy = stencil%weight(first:first + batch - 1, b, 2)
            sy = stencil%slope(first:first + batch - 1, b, 2)
            do q = 1, 6
               !$omp simd
               do p = 1, batch
                  even(p, q) = wx1(p)*tile(1 + q, i, j + 1 + b, k + 1 + c) + wx2(p)*tile(1 + q, i + 1, j + 1 + b, k + 1 + c) &
                               + wx3(p)*tile(1 + q, i + 2, j + 1 + b, k + 1 + c)
                  plane(p, q) = plane(p, q) + wy(p)*even(p, q)
               end do
            end do
            do q = 1, 3
               !$omp simd
               do p = 1, batch
                  odd(p) = sx1(p)*tile(1 + q, i, j + 1 + b, k + 1 + c) + sx2(p)*tile(1 + q, i + 1, j + 1 + b, k + 1 + c) &
                           + sx3(p)*tile(1 + q, i + 2, j + 1 + b, k + 1 + c)
                  plane_x(p, q) = plane_x(p, q) + wy(p)*odd(p)
                  plane_y(p, q) = plane_y(p, q) + sy(p)*even(p, q)
               end do
            end do
         end do
         wz = stencil%weight(first:first + batch - 1, c, 3)
         sz = stencil%slope(first:first + batch - 1, c, 3)
         do q = 1, 6
            !$omp simd
            do p = 1, batch
               motion(p, q) = motion(p, q) + wz(p)*plane(p, q)
            end do
         end do
         do q = 1, 3
            !$omp simd
            do p = 1, batch
               slope_x(p, q) = slope_x(p, q) + wz(p)*plane_x(p, q)
               slope_y(p, q) = slope_y(p, q) + wz(p)*plane_y(p, q)
               slope_z(p, q) = slope_z(p, q) + sz(p)*plane(p, q)
            end do
         end do
      end do
      do q = 1, 6
         taken%motion(first:first + batch - 1, q) = motion(:, q)
      end do
      do q = 1, 3
         taken%gradient(first:first + batch - 1, q) = slope_x(:, q)
         taken%gradient(first:first + batch - 1, 3 + q) = slope_y(:, q)
         taken%gradient(first:first + batch - 1, 6 + q) = slope_z(:, q)
      end do
   end subroutine take_batch

   !> One particle: one lane a node quantity, so that a bin with one particle costs no more a particle than a full one.
   pure subroutine take_one(stencil, m, i, j, k, tile, taken)
      type(stencil_t), intent(in) :: stencil
      integer, intent(in) :: m, i, j, k
      real(wp), intent(in) :: tile(lanes, 0:block_size + 1, 0:block_size + 1, 0:block_size + 1)
      type(taken_t), intent(inout) :: taken
      real(wp), dimension(lanes) :: motion, slope_x, slope_y, slope_z
      real(wp) :: even, odd, plane, plane_x, plane_y, value, x, y, z
      integer :: b, c, q
      !$omp simd private(even, odd, plane, plane_x, plane_y, value, x, y, z)
      do q = 1, lanes
         value = 0.0_wp
         x = 0.0_wp
         y = 0.0_wp
         z = 0.0_wp
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
         motion(q) = value
         slope_x(q) = x
         slope_y(q) = y
         slope_z(q) = z
      end do
      do q = 1, 3
         taken%motion(m, q) = motion(1 + q)
         taken%motion(m, 3 + q) = motion(4 + q)
         taken%gradient(m, q) = slope_x(1 + q)
         taken%gradient(m, 3 + q) = slope_y(1 + q)
         taken%gradient(m, 6 + q) = slope_z(1 + q)
      end do
   end subroutine take_one

   !> New positions, velocities and velocity gradients of a chunk.
   pure subroutine move(stencil, taken, layout, motion, column, gradient)
      type(stencil_t), intent(in) :: stencil
      type(taken_t), intent(in) :: taken
      type(layout_t), intent(in) :: layout
      type(motion_t), intent(in) :: motion
      real(wp), intent(inout), contiguous :: column(:, :), gradient(:, :)
      real(wp) :: own(chunk)
      integer :: axis, n, q
      n = stencil%count
      do axis = 1, 3
         call fetch(stencil, column(:, layout%position + axis - 1), own)
         own(:n) = own(:n) + motion%time_step*taken%motion(:n, axis)
         call put_back(stencil, own, column(:, motion%position + axis - 1))
         call fetch(stencil, column(:, layout%velocity + axis - 1), own)
         own(:n) = motion%flip_fraction*(own(:n) + motion%time_step*taken%motion(:n, 3 + axis)) &
                   + (1.0_wp - motion%flip_fraction)*taken%motion(:n, axis)
         call put_back(stencil, own, column(:, layout%velocity + axis - 1))
      end do
      do q = 1, 9
         call put_back(stencil, taken%gradient(:n, q), gradient(:, q))
      end do
   end subroutine move

end module m_node_to_particle
