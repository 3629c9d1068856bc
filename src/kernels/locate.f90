!> The bin of each particle of a block after its motion, and the particles that left the block.
module m_locate
   use m_kinds, only: wp, i4
   use m_constants, only: block_size
   use m_stencil, only: frame_t
   implicit none
   private
   public :: locate_particles, find_bounds, bin_of

   integer, parameter :: stretch = 128 !< particles that are searched for emigrants together

contains

   !> Set the bins of the first `count` particles; those outside the block are listed, rising, and get bin 0.
   !> `lowest` and `highest` bound the centres, to detect particles outside the grid.
   pure subroutine locate_particles(count, position, frame, bin, emigrants, emigrant_count, moved, lowest, &
                                    highest)
      integer, intent(in) :: count
      real(wp), intent(in), contiguous :: position(:, :)   !< (:, 3), m
      type(frame_t), intent(in) :: frame
      integer(i4), intent(inout), contiguous :: bin(:)
      integer(i4), allocatable, intent(inout) :: emigrants(:)
      integer, intent(out) :: emigrant_count
      logical, intent(out) :: moved                        !< at least one particle has changed bin
      real(wp), intent(out) :: lowest(3), highest(3)       !< m
      real(wp) :: x, y, z, low_x, low_y, low_z, high_x, high_y, high_z
      integer :: changes, outside, p
      integer(i4) :: i, j, k, below, now
      changes = 0
      outside = 0
      low_x = huge(low_x)
      low_y = low_x
      low_z = low_x
      high_x = -low_x
      high_y = -low_x
      high_z = -low_x
      !$omp simd reduction(+: changes, outside) reduction(min: low_x, low_y, low_z) &
      !$omp reduction(max: high_x, high_y, high_z) &
      !$omp private(i, j, k, below, now, x, y, z)
      do p = 1, count
         x = (position(p, 1) - frame%origin(1))*frame%per_cell + 0.5_wp
         y = (position(p, 2) - frame%origin(2))*frame%per_cell + 0.5_wp
         z = (position(p, 3) - frame%origin(3))*frame%per_cell + 0.5_wp
         i = int(x, i4) ! equals floor, above 0
         j = int(y, i4)
         k = int(z, i4)
         low_x = min(low_x, position(p, 1))
         low_y = min(low_y, position(p, 2))
         low_z = min(low_z, position(p, 3))
         high_x = max(high_x, position(p, 1))
         high_y = max(high_y, position(p, 2))
         high_z = max(high_z, position(p, 3))
         below = merge(-1, 0, min(x, y, z) < 0.0_wp)
         now = merge(1 + i + block_size*(j + block_size*k), 0, iand(ior(ior(i, j), ior(k, below)), &
               not(block_size - 1)) == 0)
         changes = changes + merge(1, 0, now /= bin(p))
         outside = outside + merge(1, 0, now == 0)
         bin(p) = now
      end do
      lowest = [low_x, low_y, low_z]
      highest = [high_x, high_y, high_z]
      moved = changes > 0
      emigrant_count = outside
      if (outside > 0) call list_emigrants(count, bin, outside, emigrants)
   end subroutine locate_particles

   !> The particles that are in none of the block's bins, `wanted` of them, in memory order.
   pure subroutine list_emigrants(count, bin, wanted, emigrants)
      integer, intent(in) :: count, wanted
      integer(i4), intent(in), contiguous :: bin(:)
      integer(i4), allocatable, intent(inout) :: emigrants(:)
      integer :: first, last, outside, p
      if (size(emigrants) < wanted) then
         deallocate (emigrants)
         allocate (emigrants(2*wanted))
      end if
      outside = 0
      first = 1
      do while (outside < wanted)
         last = min(first + stretch - 1, count)
         if (zeros(bin(first:last)) > 0) then
            do p = first, last
               if (bin(p) /= 0) cycle
               outside = outside + 1
               emigrants(outside) = p
            end do
         end if
         first = last + 1
      end do
   end subroutine list_emigrants

   !> Number of zeros.
   pure integer function zeros(bin)
      integer(i4), intent(in), contiguous :: bin(:)
      integer :: p
      zeros = 0
      do p = 1, size(bin)
         zeros = zeros + merge(1, 0, bin(p) == 0)
      end do
   end function zeros

   !> Smallest and largest of the first `count` values, vectorised, which minval and maxval are not.
   pure subroutine find_bounds(count, values, lowest, highest)
      integer, intent(in) :: count
      real(wp), intent(in), contiguous :: values(:)
      real(wp), intent(out) :: lowest, highest
      integer :: p
      lowest = huge(lowest)
      highest = -huge(highest)
      !$omp simd reduction(min: lowest) reduction(max: highest)
      do p = 1, count
         lowest = min(lowest, values(p))
         highest = max(highest, values(p))
      end do
   end subroutine find_bounds

   !> Bin of a position in the block that it is known to belong to; round-off at the block's faces is
   !> corrected.
   pure integer(i4) function bin_of(position, frame)
      real(wp), intent(in) :: position(3) !< m
      type(frame_t), intent(in) :: frame
      integer :: node(3)
      node = floor((position - frame%origin)*frame%per_cell + 0.5_wp)
      node = min(max(node, 0), block_size - 1)
      bin_of = 1 + node(1) + block_size*(node(2) + block_size*node(3))
   end function bin_of

end module m_locate
