!> Which rank owns which block: METIS on the graph of the blocks of all levels, weighted by particles and contact points, one
!> constraint a level and one for contact, for ranks wait for each other after each of them; and by the nodes that neighbours, parents
!> and children share.
module m_decomposition
   use mpi_f08
   use m_kinds, only: wp
   use m_constants, only: exit_numerical
   use m_errors, only: error_t, fail
   use m_communicator, only: communicator_t
   use m_level, only: level_t, tile_last, node_values
   use m_block, only: block_t
   use m_metis, only: partition_graph
   implicit none
   private
   public :: choose_owners, slowest, shared_out, set_owners, all_owners, settle_blocks, blocks_before

   integer, parameter :: block_cost = 64 !< cost of a block's node tile, in particles
   integer, parameter :: point_cost = 16 !< of a contact point in a step, in particles
   real(wp), parameter :: shared_cost = 0.1_wp !< of a node shared with another rank
   integer, parameter :: shared_with_parent = 6**3 !< nodes of the level above that a block exchanges with its parent

contains

   !> Number of the block of level l with index 1 among the blocks of all levels, minus 1: levels one after the other.
   pure integer function blocks_before(levels, l) result(before)
      type(level_t), intent(in) :: levels(:)
      integer, intent(in) :: l
      integer :: m
      before = 0
      do m = 1, l - 1
         before = before + product(levels(m)%grid%blocks)
      end do
   end function blocks_before

   !> Collective: an owner for every block that exists (counts >= 0), the same on every rank; -1 elsewhere.
   subroutine choose_owners(communicator, levels, counts, owner, error, steps, points)
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(in) :: levels(:) !< only their grids matter
      integer, intent(in) :: counts(:)       !< particles of each block of each level, by index; -1 where there is no block
      integer, intent(out) :: owner(:)       !< in the same order
      type(error_t), intent(inout) :: error
      integer, intent(in), optional :: steps(:)  !< of each level in one of the coarsest; 1 where not given
      integer, intent(in), optional :: points(:) !< contact points of each block; none where not given
      integer, allocatable :: vertex(:), part(:)
      integer :: index, n
      logical :: failed
      allocate (vertex(size(counts)), source=0)
      n = 0
      do index = 1, size(counts)
         if (counts(index) < 0) cycle
         n = n + 1
         vertex(index) = n
      end do
      allocate (part(n))
      failed = .false.
      if (communicator%is_root()) call partition(levels, counts, vertex, communicator%ranks, part, failed, steps, points)
      call MPI_Bcast(failed, 1, MPI_LOGICAL, 0, communicator%comm)
      if (failed) then
         call fail(error, exit_numerical, 'METIS could not place the blocks on the ranks; try another number of ranks')
         return
      end if
      call MPI_Bcast(part, n, MPI_INTEGER, 0, communicator%comm)
      owner = -1
      do index = 1, size(counts)
         if (vertex(index) > 0) owner(index) = part(vertex(index))
      end do
   end subroutine choose_owners

   !> The owners of the blocks of every level from those of all.
   subroutine set_owners(levels, owner)
      type(level_t), intent(inout) :: levels(:)
      integer, intent(in) :: owner(:) !< as from choose_owners
      integer :: before, l, n(3)
      do l = 1, size(levels)
         before = blocks_before(levels, l)
         n = levels(l)%grid%blocks
         if (.not. allocated(levels(l)%owner)) allocate (levels(l)%owner(0:n(1) - 1, 0:n(2) - 1, 0:n(3) - 1))
         levels(l)%owner(:, :, :) = reshape(owner(before + 1:before + product(n)), n)
      end do
   end subroutine set_owners

   !> The owners of the blocks of all levels.
   pure function all_owners(levels) result(owner)
      type(level_t), intent(in) :: levels(:)
      integer :: owner(blocks_before(levels, size(levels) + 1)), before, l
      do l = 1, size(levels)
         before = blocks_before(levels, l)
         owner(before + 1:before + size(levels(l)%owner)) = reshape(levels(l)%owner, [size(levels(l)%owner)])
      end do
   end function all_owners

   !> Time of a step by an owner of each block, in particles: of each level and of contact, that of the slowest rank.
   pure real(wp) function slowest(levels, counts, owner, ranks, steps, points)
      type(level_t), intent(in) :: levels(:)
      integer, intent(in) :: counts(:), owner(:), ranks !< as for choose_owners
      integer, intent(in), optional :: steps(:), points(:)
      integer, allocatable :: weights(:, :), there(:)
      integer :: index
      there = pack([(index, index=1, size(counts))], counts >= 0)
      weights = work(levels, counts, there, points)
      slowest = heaviest_parts(weights, times(size(levels), steps), owner(there), ranks)
   end function slowest

   !> Time of a step if all ranks had the same share of everything, in particles.
   pure real(wp) function shared_out(levels, counts, ranks, steps, points)
      type(level_t), intent(in) :: levels(:)
      integer, intent(in) :: counts(:), ranks !< as for choose_owners
      integer, intent(in), optional :: steps(:), points(:)
      integer, allocatable :: weights(:, :)
      real(wp) :: often(size(levels) + 1)
      integer :: index
      weights = work(levels, counts, pack([(index, index=1, size(counts))], counts >= 0), points)
      often = times(size(levels), steps)
      shared_out = dot_product(often(:size(weights, 1)), sum(real(weights, wp), dim=2))/ranks
   end function shared_out

   !> Work of blocks in one step, in particles, by level, and of contact where there is any.
   pure function work(levels, counts, blocks, points) result(weights)
      type(level_t), intent(in) :: levels(:)
      integer, intent(in) :: counts(:), blocks(:) !< particles of each block of each level; the blocks that are asked for, rising
      integer, intent(in), optional :: points(:)
      integer, allocatable :: weights(:, :)       !< (levels or one more, blocks)
      integer :: l, v
      logical :: touched
      touched = .false.
      if (present(points)) touched = any(points > 0)
      allocate (weights(size(levels) + merge(1, 0, touched), size(blocks)), source=0)
      l = 1
      do v = 1, size(blocks)
         do while (blocks(v) > blocks_before(levels, l + 1))
            l = l + 1
         end do
         weights(l, v) = counts(blocks(v)) + block_cost
      end do
      if (touched) weights(size(levels) + 1, :) = point_cost*points(blocks)
   end function work

   !> How often the work of each constraint is done in a step of the coarsest level: of the levels, and of contact, on the finest.
   pure function times(levels, steps)
      integer, intent(in) :: levels
      integer, intent(in), optional :: steps(:)
      real(wp) :: times(levels + 1)
      times = 1.0_wp
      if (present(steps)) times = [steps, steps(levels)]
   end function times

   !> The sum, over the constraints, of the heaviest part's weight, each so many times.
   pure real(wp) function heaviest_parts(weights, times, part, parts) result(heaviest)
      integer, intent(in) :: weights(:, :), part(:), parts !< parts from 0
      real(wp), intent(in) :: times(:) !< at least one a constraint
      real(wp) :: load(size(weights, 1), 0:parts - 1)
      integer :: v
      load = 0.0_wp
      do v = 1, size(part)
         load(:, part(v)) = load(:, part(v)) + weights(:, v)
      end do
      heaviest = dot_product(times(:size(load, 1)), maxval(load, dim=2))
   end function heaviest_parts

   !> Part of every block, each level and contact balanced in themselves: of what METIS offers for several ways and tolerances, what
   !> makes the shortest step. With no more blocks than ranks, one block a rank.
   subroutine partition(levels, counts, vertex, ranks, part, failed, steps, points)
      type(level_t), intent(in) :: levels(:)
      integer, intent(in) :: counts(:), vertex(:), ranks
      integer, intent(out) :: part(:)
      logical, intent(out) :: failed
      integer, intent(in), optional :: steps(:), points(:)
      real, parameter :: tight = 1.01, usual = 1.03, loose = 1.2 !< heaviest part over the mean
      integer, allocatable :: offsets(:), adjacent(:), edge_weights(:), weights(:, :)
      real(wp) :: shortest
      integer :: before, index, l, n, v, edges, place(3), d(3)
      failed = .false.
      part = 0
      if (ranks == 1) return
      if (size(part) <= ranks) then
         part = [(v - 1, v=1, size(part))]
         return
      end if
      allocate (offsets(size(part) + 1), adjacent(35*size(part)), edge_weights(35*size(part)))
      weights = work(levels, counts, pack([(index, index=1, size(counts))], vertex > 0), points)
      edges = 0
      offsets(1) = 0
      do l = 1, size(levels)
         before = blocks_before(levels, l)
         do index = 1, product(levels(l)%grid%blocks)
            v = vertex(before + index)
            if (v == 0) cycle
            place = levels(l)%grid%block_place(index)
            do n = 1, 27
               if (n == 14) cycle
               d = [mod(n - 1, 3), mod((n - 1)/3, 3), (n - 1)/9] - 1
               call connect(l, place + d, product(merge(2, tile_last + 1, d /= 0)))
            end do
            if (l > 1) call connect(l - 1, place/2, shared_with_parent)
            do n = 0, 7
               if (l < size(levels)) call connect(l + 1, 2*place + [ibits(n, 0, 1), ibits(n, 1, 1), ibits(n, 2, 1)], &
                                                  shared_with_parent)
            end do
            offsets(v + 1) = edges
         end do
      end do
      shortest = huge(shortest)
      do n = 1, 2
         call try(n == 1, [spread(tight, 1, size(levels)), loose])
         call try(n == 1, [spread(usual, 1, size(levels)), loose])
         call try(n == 1, [spread(loose, 1, size(levels)), usual])
      end do
      failed = shortest >= huge(shortest)
   contains
      !> Keep what METIS offers if it makes a shorter step.
      subroutine try(by_halves, imbalance)
         logical, intent(in) :: by_halves
         real, intent(in) :: imbalance(:)
         integer :: cut, offered(size(part))
         logical :: refused
         real(wp) :: length
         call partition_graph(offsets, adjacent(:edges), weights, edge_weights(:edges), ranks, by_halves, &
                              imbalance(:size(weights, 1)), offered, cut, refused)
         if (refused) return
         length = heaviest_parts(weights, times(size(levels), steps), offered, ranks) + shared_cost*2.0_wp*cut/ranks
         if (length >= shortest) return
         shortest = length
         part = offered
      end subroutine try

      !> An edge from block v to a block of a level, if that exists.
      subroutine connect(to_level, to, weight)
         integer, intent(in) :: to_level, to(3), weight
         integer :: other
         if (any(to < 0) .or. any(to >= levels(to_level)%grid%blocks)) return
         other = vertex(blocks_before(levels, to_level) + levels(to_level)%grid%block_index(to))
         if (other == 0) return
         edges = edges + 1
         adjacent(edges) = other - 1
         edge_weights(edges) = weight
      end subroutine connect
   end subroutine partition

   !> Make this rank's blocks, mirrors, slots and pools fit the owners. Blocks that stay keep their particles; blocks that
   !> are new here are empty; the particles of blocks that went elsewhere must have been taken out before.
   subroutine settle_blocks(level, rank)
      type(level_t), intent(inout) :: level
      integer, intent(in) :: rank
      type(block_t), allocatable :: blocks(:)
      integer :: b, old, slots
      call find_own(level, rank, blocks)
      if (allocated(level%blocks)) then
         old = 1
         do b = 1, size(blocks)
            do while (old <= size(level%blocks))
               if (level%blocks(old)%index >= blocks(b)%index) exit
               old = old + 1
            end do
            if (old > size(level%blocks)) exit
            if (level%blocks(old)%index == blocks(b)%index) call take_over(level%blocks(old), blocks(b))
         end do
      end if
      call move_alloc(blocks, level%blocks)
      call find_mirrors(level, rank)
      slots = size(level%blocks) + size(level%mirror_index)
      if (allocated(level%gathered)) deallocate (level%gathered, level%solved, level%reach)
      allocate (level%gathered(node_values, 0:tile_last, 0:tile_last, 0:tile_last, slots), source=0.0_wp)
      allocate (level%solved(node_values, 0:tile_last, 0:tile_last, 0:tile_last, size(level%blocks)), source=0.0_wp)
      allocate (level%reach(2, 3, slots))
      level%reach(1, :, :) = 0
      level%reach(2, :, :) = tile_last
      do b = 1, size(level%blocks)
         call level%blocks(b)%reserve(1, level%table%columns)
      end do
      call level%size_work()
   end subroutine settle_blocks

   !> The blocks that this rank owns, by rising index.
   subroutine find_own(level, rank, blocks)
      type(level_t), intent(in) :: level
      integer, intent(in) :: rank
      type(block_t), allocatable, intent(out) :: blocks(:)
      integer :: b, index, place(3)
      allocate (blocks(count(level%owner == rank)))
      b = 0
      do index = 1, size(level%owner)
         place = level%grid%block_place(index)
         if (level%owner_at(place) /= rank) cycle
         b = b + 1
         blocks(b)%place = place
         blocks(b)%index = index
         blocks(b)%origin = level%grid%block_origin(place)
      end do
   end subroutine find_own

   !> Move particles and lists from a block to its successor.
   subroutine take_over(old, new)
      type(block_t), intent(inout) :: old, new
      new%particles%count = old%particles%count
      call move_alloc(old%particles%column, new%particles%column)
      call move_alloc(old%particles%id, new%particles%id)
      call move_alloc(old%particles%body, new%particles%body)
      new%cells%first = old%cells%first
      call move_alloc(old%cells%order, new%cells%order)
      call move_alloc(old%cells%bin, new%cells%bin)
      new%cells%low = old%cells%low
      new%cells%high = old%cells%high
      new%cells%current = old%cells%current
      new%cells%jumps = old%cells%jumps
      call move_alloc(old%leavers, new%leavers)
      new%leaver_count = old%leaver_count
      new%lowest = old%lowest
      new%highest = old%highest
   end subroutine take_over

   !> Mirrors of the remote neighbours, slots of all, and each block's table of neighbours.
   subroutine find_mirrors(level, rank)
      type(level_t), intent(inout) :: level
      integer, intent(in) :: rank
      integer :: b, index, m, n, place(3), other(3)
      if (.not. allocated(level%slot)) allocate (level%slot(0:level%grid%blocks(1) - 1, 0:level%grid%blocks(2) - 1, &
                                                      0:level%grid%blocks(3) - 1))
      level%slot = 0
      do b = 1, size(level%blocks)
         place = level%blocks(b)%place
         level%slot(place(1), place(2), place(3)) = b
      end do
      if (allocated(level%mirror_index)) deallocate (level%mirror_index)
      allocate (level%mirror_index(0))
      m = size(level%blocks)
      do index = 1, size(level%owner)
         place = level%grid%block_place(index)
         if (level%owner_at(place) < 0 .or. level%owner_at(place) == rank) cycle
         if (.not. touches(place)) cycle
         m = m + 1
         level%slot(place(1), place(2), place(3)) = m
         level%mirror_index = [level%mirror_index, index]
      end do
      do b = 1, size(level%blocks)
         level%blocks(b)%shared = .false.
         do n = 1, 27
            other = level%blocks(b)%place + [mod(n - 1, 3), mod((n - 1)/3, 3), (n - 1)/9] - 1
            level%blocks(b)%neighbour(n) = 0
            if (level%owner_at(other) < 0) cycle
            level%blocks(b)%neighbour(n) = level%slot(other(1), other(2), other(3))
            if (level%owner_at(other) /= rank) level%blocks(b)%shared = .true.
         end do
      end do
   contains
      !> True when one of this rank's blocks is next to a place.
      pure logical function touches(place)
         integer, intent(in) :: place(3)
         integer :: a(3), z(3)
         a = max(place - 1, 0)
         z = min(place + 1, level%grid%blocks - 1)
         touches = any(level%owner(a(1):z(1), a(2):z(2), a(3):z(3)) == rank)
      end function touches
   end subroutine find_mirrors

end module m_decomposition
