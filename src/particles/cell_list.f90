!> Linked lists of the particles of a block in each of its 8 x 8 x 8 cells (those of the dual grid, centred on
!> its nodes), and the order in which particles are traversed.
module m_cell_list
   use m_kinds, only: i4, i8
   use m_constants, only: block_size
   implicit none
   private
   public :: cell_list_t, bins_at

   integer, parameter, public :: bins = block_size**3

   !> The cells (1 to 512, x fastest) of a block's particles, in three forms: the cell of each particle; a
   !> linked list of the particles of each cell, rising, updated by `link`; and statistics of all of them.
   !> Kernels traverse `count` particles, in storage order from `start` on, or the chosen ones.
   type :: cell_list_t
      integer(i4), allocatable :: bin(:)   !< cell of each particle; set by the procedure that locates the
                                           !< particles
      integer(i4), allocatable :: first(:) !< first particle of each cell, 0 where it has none
      integer(i4), allocatable :: next(:)  !< the next particle of the same cell, 0 behind the last
      integer :: linked = -1               !< particles in the lists; -1: bins have changed since
      integer :: start = 1
      integer :: count = 0
      logical :: chosen = .false.          !< only the particles in `order` are traversed
      integer(i4), allocatable :: order(:) !< numbers of particles, where subsets are chosen
      integer :: counted = 0 !< number of particles in the statistics below; -1: bins have changed since
      integer :: low(3) = block_size, high(3) = -1 !< the first and the last index along each axis, from 0, of
                                                   !< bins with particles, including those that were added
                                                   !< later
      integer :: occupied = 0              !< bins that have particles
      integer :: run_breaks = 0 !< runs of particles of one bin beyond one for each bin, plus twice the number
                                !< of places where the next particle has a lower bin: 0 where particles are in
                                !< order
      integer(i4), allocatable :: standing(:) !< at an edge of levels, where means over cells are taken:
                                              !< index, in the tile of sums, of the grid cell at each place of
                                              !< a tile (levels/joined_cells.f90)
   contains
      procedure :: reserve
      procedure :: link
      procedure :: link_in
      procedure :: outdate
      procedure :: update_statistics
      procedure :: go_through
      procedure :: take_bins
      procedure :: sort
      procedure :: extent
      procedure :: bytes
   end type cell_list_t

contains

   !> Make room for a number of particles, and for choosing subsets of them where wanted; keeps bins.
   subroutine reserve(self, capacity, choosing)
      class(cell_list_t), intent(inout) :: self
      integer, intent(in) :: capacity
      logical, intent(in), optional :: choosing
      integer(i4), allocatable :: longer(:)
      if (allocated(self%bin)) then
         if (size(self%bin) >= capacity) return
      end if
      allocate (longer(capacity), source=0_i4)
      if (allocated(self%bin)) longer(:size(self%bin)) = self%bin
      call move_alloc(longer, self%bin)
      if (allocated(self%next)) then
         allocate (longer(capacity), source=0_i4)
         longer(:size(self%next)) = self%next
         call move_alloc(longer, self%next)
      end if
      if (.not. present(choosing)) return
      if (.not. choosing) return
      if (allocated(self%order)) deallocate (self%order)
      allocate (self%order(capacity))
   end subroutine reserve

   !> Update the lists: the cells of the first `count` particles have been set.
   pure subroutine link(self, count)
      class(cell_list_t), intent(inout) :: self
      integer, intent(in) :: count
      integer :: p
      if (self%linked == count) return
      if (.not. allocated(self%first)) allocate (self%first(bins), self%next(size(self%bin)))
      self%first = 0
      do p = count, 1, -1
         self%next(p) = self%first(self%bin(p))
         self%first(self%bin(p)) = p
      end do
      self%linked = count
   end subroutine link

   !> Particle p was added behind all others and its cell set: append it to its cell's list, if lists are up
   !> to date.
   pure subroutine link_in(self, p)
      class(cell_list_t), intent(inout) :: self
      integer, intent(in) :: p
      integer :: last
      associate (place => [mod(self%bin(p) - 1, block_size), mod((self%bin(p) - 1)/block_size, block_size), &
                           (self%bin(p) - 1)/block_size**2])
         self%low = min(self%low, place)
         self%high = max(self%high, place)
      end associate
      if (self%linked /= p - 1) return
      self%linked = p
      self%next(p) = 0
      last = self%first(self%bin(p))
      if (last == 0) then
         self%first(self%bin(p)) = p
         return
      end if
      do while (self%next(last) > 0)
         last = self%next(last)
      end do
      self%next(last) = p
   end subroutine link_in

   !> Particles have changed cell, or their position in the store: only `bin` is still valid.
   pure subroutine outdate(self)
      class(cell_list_t), intent(inout) :: self
      self%linked = -1
      self%counted = -1
   end subroutine outdate

   !> Count the extent and the disorder of the first `count` particles. From here on all of them are
   !> traversed.
   pure subroutine update_statistics(self, count)
      class(cell_list_t), intent(inout) :: self
      integer, intent(in) :: count
      integer(i4) :: seen(bins)
      integer :: p
      call self%go_through(1, count)
      seen = 0
      do p = 1, count
         seen(self%bin(p)) = 1
      end do
      call find_extent(seen, self%low, self%high)
      self%occupied = sum(seen)
      self%run_breaks = run_breaks_in(self%bin(:count)) - self%occupied
      self%counted = count
   end subroutine update_statistics

   !> From here on the particles stored from `start` to `last` are traversed.
   pure subroutine go_through(self, start, last)
      class(cell_list_t), intent(inout) :: self
      integer, intent(in) :: start, last
      self%start = start
      self%count = max(0, last - start + 1)
      self%chosen = .false.
   end subroutine go_through

   !> Number of runs of one bin, plus twice the number of places where the next bin is lower. A separate
   !> procedure, so that it vectorises.
   pure integer function run_breaks_in(bin) result(run_breaks)
      integer(i4), intent(in), contiguous :: bin(:)
      integer :: p
      run_breaks = min(1, size(bin))
      !$omp simd reduction(+: run_breaks)
      do p = 2, size(bin)
         run_breaks = run_breaks + merge(1, 0, bin(p) /= bin(p - 1)) + merge(2, 0, bin(p) < bin(p - 1))
      end do
   end function run_breaks_in

   !> The first and the last index along each axis, from 0, that has particles; if there are none the first is
   !> behind the last.
   pure subroutine find_extent(held, low, high)
      integer(i4), intent(in) :: held(0:block_size - 1, 0:block_size - 1, 0:block_size - 1)
                                                        !< above 0 where a bin has particles
      integer, intent(out) :: low(3), high(3)
      integer :: along_x(0:block_size - 1), along_y(0:block_size - 1), along_z(0:block_size - 1), j, k
      along_x = 0
      along_y = 0
      along_z = 0
      do k = 0, block_size - 1
         do j = 0, block_size - 1
            along_x = along_x + held(:, j, k)
            along_y(j) = along_y(j) + sum(held(:, j, k))
         end do
         along_z(k) = sum(held(:, :, k))
      end do
      call ends(along_x, low(1), high(1))
      call ends(along_y, low(2), high(2))
      call ends(along_z, low(3), high(3))
   contains
      pure subroutine ends(along, low, high)
         integer, intent(in) :: along(0:block_size - 1)
         integer, intent(out) :: low, high
         low = 0
         do while (low < block_size)
            if (along(low) > 0) exit
            low = low + 1
         end do
         high = block_size - 1
         do while (high >= 0)
            if (along(high) > 0) exit
            high = high - 1
         end do
      end subroutine ends
   end subroutine find_extent

   !> Choose the particles of some cells among those that another list traverses, in its order: sums over them
   !> keep their bits. Bins are set only for particles that are chosen.
   pure subroutine take_bins(self, whole, wanted)
      class(cell_list_t), intent(inout) :: self
      type(cell_list_t), intent(in) :: whole
      logical, intent(in) :: wanted(bins)
      integer :: p
      self%count = 0
      self%chosen = .true.
      do p = whole%start, whole%start + whole%count - 1
         if (.not. wanted(whole%bin(p))) cycle
         self%count = self%count + 1
         self%order(self%count) = p
         self%bin(p) = whole%bin(p)
      end do
   end subroutine take_bins

   !> The bins whose particles reach at least one of some nodes of a block's tile.
   pure function bins_at(nodes, rows) result(at)
      logical, intent(in) :: nodes(0:block_size + 1, 0:block_size + 1, 0:block_size + 1)
      integer, intent(in) :: rows(2) !< first and last index along y in use
      logical :: at(bins)
      logical :: x(block_size, 0:block_size + 1, 0:block_size + 1), &
                 y(block_size, block_size, 0:block_size + 1), z(block_size, block_size, block_size)
      integer :: n
      if (rows(1) == rows(2)) then
         at = bins_of_row(nodes(:, rows(1), :), rows(1) - 1)
         return
      end if
      x = .false.
      y = .false.
      z = .false.
      do n = 0, 2
         where (nodes(n:n + block_size - 1, :, :)) x = .true.
      end do
      do n = 0, 2
         where (x(:, n:n + block_size - 1, :)) y = .true.
      end do
      do n = 0, 2
         where (y(:, :, n:n + block_size - 1)) z = .true.
      end do
      at = reshape(z, [bins])
   end function bins_at

   !> The same for a section: the nodes of one row along y, all particles in the bins around them.
   pure function bins_of_row(nodes, row) result(at)
      logical, intent(in) :: nodes(0:block_size + 1, 0:block_size + 1)
      integer, intent(in) :: row !< of the bins, from 0
      logical :: at(bins)
      integer :: i, k
      at = .false.
      do k = 0, block_size - 1
         do i = 0, block_size - 1
            at(1 + i + block_size*(row + block_size*k)) = any(nodes(i:i + 2, k:k + 2))
         end do
      end do
   end function bins_of_row

   !> The permutation that sorts the traversed particles, all of them: bin by bin, and within a bin in storage
   !> order. The list assumes the new order from here on; the caller permutes the store. Two halves are
   !> counted and placed side by side: consecutive particles of one bin would wait for each other's sums.
   pure subroutine sort(self, order)
      class(cell_list_t), intent(inout) :: self
      integer(i4), intent(out), contiguous :: order(:) !< (count): the new p-th is the old order(p)-th
      ! for the first half of the particles, the second, all
      integer(i4) :: next(bins), later(bins), held(bins)
      integer :: b, half, p
      half = self%count/2
      next = 0
      later = 0
      do p = 1, half
         next(self%bin(p)) = next(self%bin(p)) + 1
         later(self%bin(p + half)) = later(self%bin(p + half)) + 1
      end do
      do p = 2*half + 1, self%count
         later(self%bin(p)) = later(self%bin(p)) + 1
      end do
      held = next + later
      p = 1
      do b = 1, bins
         later(b) = p + next(b)
         next(b) = p
         p = p + held(b)
      end do
      do p = 1, half
         b = self%bin(p)
         order(next(b)) = p
         next(b) = next(b) + 1
         b = self%bin(p + half)
         order(later(b)) = p + half
         later(b) = later(b) + 1
      end do
      do p = 2*half + 1, self%count
         b = self%bin(p)
         order(later(b)) = p
         later(b) = later(b) + 1
      end do
      p = 1
      do b = 1, bins
         self%bin(p:p + held(b) - 1) = b
         p = p + held(b)
      end do
      self%run_breaks = 0
      self%linked = -1
   end subroutine sort

   !> First and last index along each axis of the part of the block's tile that its particles reach.
   pure function extent(self)
      class(cell_list_t), intent(in) :: self
      integer :: extent(2, 3)
      extent(1, :) = self%low
      extent(2, :) = self%high + 2
   end function extent

   !> Memory held (bytes).
   pure integer(i8) function bytes(self)
      class(cell_list_t), intent(in) :: self
      bytes = 0
      if (allocated(self%bin)) bytes = 4_i8*size(self%bin, kind=i8)
      if (allocated(self%order)) bytes = bytes + 4_i8*size(self%order, kind=i8)
      if (allocated(self%first)) bytes = bytes + 4_i8*(size(self%first, kind=i8) + size(self%next, kind=i8))
   end function bytes

end module m_cell_list
