!> Which particles of a block lie in which of its 8 x 8 x 8 node-centred bins.
module m_cell_list
   use m_kinds, only: i4, i8
   use m_constants, only: block_size
   implicit none
   private
   public :: cell_list_t, bins_at

   integer, parameter, public :: bins = block_size**3

   !> The particles of bin b (1 to 512, x fastest) are order(first(b):first(b+1)-1), in the order in which they are stored.
   type :: cell_list_t
      integer(i4) :: first(bins + 1) = 1
      integer(i4), allocatable :: order(:)
      integer(i4), allocatable :: bin(:) !< bin of each particle; set by whoever locates the particles
      logical :: current = .false.       !< the lists match `bin`
      integer :: low(3) = block_size, high(3) = -1 !< the first and the last place along each axis, from 0, that has particles
      integer :: occupied = 0            !< bins that have particles
      integer :: jumps = 0               !< places where the next particle in order is not the next one in memory
   contains
      procedure :: reserve
      procedure :: hand_over
      procedure :: build
      procedure :: take_bins
      procedure :: take_last
      procedure :: join
      procedure :: set_in_order
      procedure :: reach
      procedure :: bytes
   end type cell_list_t

contains

   !> Make room for a number of particles; keeps lists and bins.
   subroutine reserve(self, capacity)
      class(cell_list_t), intent(inout) :: self
      integer, intent(in) :: capacity
      if (allocated(self%bin)) then
         if (size(self%bin) >= capacity) return
      end if
      call lengthen(self%bin)
      call lengthen(self%order)
   contains
      subroutine lengthen(values)
         integer(i4), allocatable, intent(inout) :: values(:)
         integer(i4), allocatable :: longer(:)
         allocate (longer(capacity), source=0_i4)
         if (allocated(values)) longer(:size(values)) = values
         call move_alloc(longer, values)
      end subroutine lengthen
   end subroutine reserve

   !> Give all to another, which had nothing.
   pure subroutine hand_over(self, other)
      class(cell_list_t), intent(inout) :: self
      type(cell_list_t), intent(inout) :: other
      other%first = self%first
      call move_alloc(self%order, other%order)
      call move_alloc(self%bin, other%bin)
      other%current = self%current
      other%low = self%low
      other%high = self%high
      other%occupied = self%occupied
      other%jumps = self%jumps
   end subroutine hand_over

   !> Build the lists of the particles from `from`, or the first, to `count` from `bin`. Two halves are counted and placed side by
   !> side: particles of one bin, which follow each other, would wait for each other's sums.
   pure subroutine build(self, count, from)
      class(cell_list_t), intent(inout) :: self
      integer, intent(in) :: count
      integer, intent(in), optional :: from
      integer(i4) :: next(bins), later(bins), held(bins) ! of the first half of the particles, of the second, of all
      integer :: b, begin, half, p
      begin = 1
      if (present(from)) begin = from
      half = max(0, (count - begin + 1)/2)
      next = 0
      later = 0
      do p = begin, begin + half - 1
         next(self%bin(p)) = next(self%bin(p)) + 1
         later(self%bin(p + half)) = later(self%bin(p + half)) + 1
      end do
      do p = begin + 2*half, count
         later(self%bin(p)) = later(self%bin(p)) + 1
      end do
      held = next + later
      call find_extent(held, self%low, self%high)
      self%occupied = sum(min(held, 1_i4))
      self%first(1) = 1
      do b = 1, bins
         self%first(b + 1) = self%first(b) + held(b)
      end do
      later = self%first(:bins) + next
      next = self%first(:bins)
      do p = begin, begin + half - 1
         b = self%bin(p)
         self%order(next(b)) = p
         next(b) = next(b) + 1
         b = self%bin(p + half)
         self%order(later(b)) = p + half
         later(b) = later(b) + 1
      end do
      do p = begin + 2*half, count
         b = self%bin(p)
         self%order(later(b)) = p
         later(b) = later(b) + 1
      end do
      self%jumps = jumps_in(self%order(:self%first(bins + 1) - 1))
      self%current = .true.
   end subroutine build

   !> Places of a list where the next particle is not the next one in memory.
   pure integer function jumps_in(order) result(jumps)
      integer(i4), intent(in), contiguous :: order(:)
      integer :: p
      jumps = 0
      !$omp simd reduction(+: jumps)
      do p = 2, size(order)
         jumps = jumps + merge(1, 0, order(p) /= order(p - 1) + 1)
      end do
   end function jumps_in

   !> The first and the last place along each axis, from 0, that has particles; none: the first behind the last.
   pure subroutine find_extent(held, low, high)
      integer(i4), intent(in) :: held(0:block_size - 1, 0:block_size - 1, 0:block_size - 1) !< particles of each bin
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

   !> The lists of some bins of another, with room for them; of other bins, none. Bins stand only for particles that are listed.
   pure subroutine take_bins(self, whole, wanted)
      class(cell_list_t), intent(inout) :: self
      type(cell_list_t), intent(in) :: whole
      logical, intent(in) :: wanted(bins)
      integer :: b, n, p
      n = 0
      do b = 1, bins
         if (wanted(b)) then
            do p = whole%first(b), whole%first(b + 1) - 1
               n = n + 1
               self%order(n) = whole%order(p)
               self%bin(whole%order(p)) = b
            end do
         end if
         self%first(b + 1) = n + 1
      end do
   end subroutine take_bins

   !> The lists of the last particles of another's block, with room for them.
   pure subroutine take_last(self, whole, from, count)
      class(cell_list_t), intent(inout) :: self
      type(cell_list_t), intent(in) :: whole
      integer, intent(in) :: from, count !< the first of them, and the last
      self%bin(from:count) = whole%bin(from:count)
      call self%build(count, from)
   end subroutine take_last

   !> Add the lists of particles that are stored behind all of these: as if both had been listed at once.
   pure subroutine join(self, later)
      class(cell_list_t), intent(inout) :: self
      type(cell_list_t), intent(in) :: later
      integer :: ahead, b, behind, m, place
      ahead = later%first(bins + 1) - 1 ! places by which what stands in the present bin moves up
      do b = bins, 1, -1
         behind = later%first(b + 1) - later%first(b)
         if (self%first(b + 1) == self%first(b) .and. behind > 0) self%occupied = self%occupied + 1
         place = self%first(b + 1) + ahead
         self%first(b + 1) = place
         do m = later%first(b + 1) - 1, later%first(b), -1
            place = place - 1
            self%order(place) = later%order(m)
         end do
         ahead = ahead - behind
         if (ahead == 0) exit
         do m = place - 1, self%first(b) + ahead, -1
            self%order(m) = self%order(m - ahead)
         end do
      end do
      self%low = min(self%low, later%low)
      self%high = max(self%high, later%high)
      self%jumps = jumps_in(self%order(:self%first(bins + 1) - 1))
   end subroutine join

   !> The bins whose particles reach one of some nodes of a block's tile.
   pure function bins_at(nodes) result(at)
      logical, intent(in) :: nodes(0:block_size + 1, 0:block_size + 1, 0:block_size + 1)
      logical :: at(bins)
      logical :: x(block_size, 0:block_size + 1, 0:block_size + 1), y(block_size, block_size, 0:block_size + 1)
      associate (n => block_size)
         x = nodes(:n - 1, :, :) .or. nodes(1:n, :, :) .or. nodes(2:, :, :)
         y = x(:, :n - 1, :) .or. x(:, 1:n, :) .or. x(:, 2:, :)
         at = reshape(y(:, :, :n - 1) .or. y(:, :, 1:n) .or. y(:, :, 2:), [bins])
      end associate
   end function bins_at

   !> After the particles were put into list order: the lists are runs.
   pure subroutine set_in_order(self, count)
      class(cell_list_t), intent(inout) :: self
      integer, intent(in) :: count
      integer :: b, p
      do b = 1, bins
         self%bin(self%first(b):self%first(b + 1) - 1) = b
      end do
      do p = 1, count
         self%order(p) = p
      end do
      self%jumps = 0
   end subroutine set_in_order

   !> First and last index along each axis of the part of the block's tile that its particles reach.
   pure function reach(self)
      class(cell_list_t), intent(in) :: self
      integer :: reach(2, 3)
      reach(1, :) = self%low
      reach(2, :) = self%high + 2
   end function reach

   !> Memory held (bytes).
   pure integer(i8) function bytes(self)
      class(cell_list_t), intent(in) :: self
      bytes = 4_i8*(bins + 1)
      if (allocated(self%bin)) bytes = bytes + 8_i8*size(self%bin, kind=i8)
   end function bytes

end module m_cell_list
