!> Which rank owns which block: METIS on the graph of the blocks of all levels, weighted by particles and contact points, one
!> constraint a level and one for contact, for ranks wait for each other after each of them; and by the nodes that neighbours, parents
!> and children share.
module m_placement
   use mpi_f08
   use m_kinds, only: wp
   use m_constants, only: exit_numerical
   use m_errors, only: error_t, fail
   use m_communicator, only: communicator_t
   use m_level, only: level_t, tile_last
   use m_decomposition, only: blocks_before
   use m_metis, only: partition_graph
   use m_block_moves, only: block_graph_t, shorten_step, step_length, stay_at_home
   implicit none
   private
   public :: work_t, work_of, lists_work, choose_owners, slowest, shared_out

   !> What there is to do in the blocks of all levels, by number, as if in so many particles.
   type :: work_t
      logical, allocatable :: exists(:)     !< (blocks)
      integer, allocatable :: weight(:, :)  !< (levels, and contact where there is any; blocks): in one step of the level
      real(wp), allocatable :: times(:)     !< how often that is done in a step of the coarsest level
   end type work_t

   integer, parameter :: block_cost = 64 !< of a block's node tile, in particles
   real(wp), parameter :: bin_cost = 0.75_wp !< of a bin that has particles, in particles
   real(wp), parameter :: jump_cost = 16.0_wp !< of a place where the next particle of the list is not the next in memory, in particles;
                                              !< with it goes how uneven the bins are, and how often the particles are sorted
   integer, parameter :: point_cost = 16 !< of a contact point, in particles
   real(wp), parameter :: shared_cost = 0.1_wp !< of a node shared with another rank, in particles
   real(wp), parameter :: move_cost = 6.0_wp    !< of a particle that leaves or enters a rank, in its steps
   real(wp), parameter :: well_shared = 1.01_wp !< a step over one of evenly shared work that need not be shorter
   integer, parameter :: shared_with_parent = 6**3 !< nodes of the level above that a block exchanges with its parent

contains

   !> The work of the blocks from what they hold. Contact is on the finest level.
   pure function work_of(levels, particles, steps, points, lists) result(work)
      type(level_t), intent(in) :: levels(:)     !< only their grids matter
      integer, intent(in) :: particles(:)        !< of each block of each level, by number; -1 where there is no block
      integer, intent(in), optional :: steps(:)  !< of each level in one of the coarsest; 1 where not given
      integer, intent(in), optional :: points(:) !< contact points of each block; none where not given
      integer, intent(in), optional :: lists(:)  !< what the lists of each block cost, from lists_work; nothing where not given
      type(work_t) :: work
      integer :: first, l, last, constraints
      constraints = size(levels)
      if (present(points)) constraints = constraints + merge(1, 0, any(points > 0))
      work%exists = particles >= 0
      allocate (work%weight(constraints, size(particles)), source=0)
      allocate (work%times(constraints), source=1.0_wp)
      do l = 1, size(levels)
         first = blocks_before(levels, l) + 1
         last = blocks_before(levels, l + 1)
         work%weight(l, first:last) = particles(first:last) + block_cost
         if (present(lists)) work%weight(l, first:last) = work%weight(l, first:last) + lists(first:last)
         where (.not. work%exists(first:last)) work%weight(l, first:last) = 0
         if (present(steps)) work%times(l) = steps(l)
      end do
      if (constraints == size(levels)) return
      work%weight(constraints, :) = merge(point_cost*points, 0, work%exists)
      work%times(constraints) = work%times(size(levels))
   end function work_of

   !> What a block's lists cost in a step, as if it had so many particles more (performance.md, 'Which block costs what').
   pure integer function lists_work(bins, jumps)
      integer, intent(in) :: bins   !< that have particles
      real(wp), intent(in) :: jumps !< of the lists, on average
      lists_work = nint(bin_cost*bins + jump_cost*jumps)
   end function lists_work

   !> Time of a step, in particles: of each level and of contact, that of the slowest rank.
   pure real(wp) function slowest(work, owner, ranks)
      type(work_t), intent(in) :: work
      integer, intent(in) :: owner(:), ranks !< as from choose_owners
      real(wp) :: load(size(work%times), 0:ranks - 1)
      integer :: n
      load = 0.0_wp
      do n = 1, size(owner)
         if (work%exists(n)) load(:, owner(n)) = load(:, owner(n)) + work%weight(:, n)
      end do
      slowest = dot_product(work%times, maxval(load, dim=2))
   end function slowest

   !> Time of a step if all ranks had the same share of everything, in particles.
   pure real(wp) function shared_out(work, ranks)
      type(work_t), intent(in) :: work
      integer, intent(in) :: ranks
      shared_out = dot_product(work%times, sum(real(work%weight, wp), dim=2))/ranks
   end function shared_out

   !> Collective: an owner for every block that exists, the same on every rank; -1 elsewhere. Where blocks have owners already, `steps`
   !> says for how many steps the new ones are to stand: what they save in so many must be worth the move.
   subroutine choose_owners(communicator, levels, work, owner, error, steps)
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(in) :: levels(:)     !< only their grids matter
      type(work_t), intent(in) :: work
      integer, intent(inout) :: owner(:)         !< by number; on entry it only matters with `steps`
      type(error_t), intent(inout) :: error
      integer, intent(in), optional :: steps
      logical :: failed
      failed = .false.
      if (communicator%is_root()) call place(levels, work, communicator%ranks, owner, failed, steps)
      call MPI_Bcast(failed, 1, MPI_LOGICAL, 0, communicator%comm)
      if (failed) then
         call fail(error, exit_numerical, 'METIS could not place the blocks on the ranks; try another number of ranks')
         return
      end if
      call MPI_Bcast(owner, size(owner), MPI_INTEGER, 0, communicator%comm)
   end subroutine choose_owners

   !> An owner of every block, each level and contact balanced in themselves. Blocks that have owners stay, but for single ones that move,
   !> unless that leaves too much to be gained and METIS has something better, moves included.
   subroutine place(levels, work, ranks, owner, failed, steps)
      type(level_t), intent(in) :: levels(:)
      type(work_t), intent(in) :: work
      integer, intent(in) :: ranks
      integer, intent(inout) :: owner(:)
      logical, intent(out) :: failed
      integer, intent(in), optional :: steps
      integer, allocatable :: best(:), offered(:), there(:), vertex(:)
      type(block_graph_t) :: graph
      integer :: n
      failed = .false.
      there = pack([(n, n=1, size(owner))], work%exists)
      allocate (vertex(size(owner)), source=0)
      vertex(there) = [(n, n=1, size(there))]
      call make_graph(levels, vertex, there, graph%offsets, graph%adjacent, graph%edge_weights)
      graph%weight = work%weight(:, there)
      graph%times = work%times
      graph%edge_cost = shared_cost*2.0_wp/ranks
      if (present(steps)) then
         graph%home = owner(there)
         graph%move_cost = move_cost/steps
         best = graph%home
         call shorten_step(graph, ranks, best)
         if (step_length(graph, ranks, best) > step_length(graph, ranks, graph%home)) best = graph%home
         owner = -1
         owner(there) = best
         if (slowest(work, owner, ranks) <= well_shared*shared_out(work, ranks)) return ! METIS need not be asked
      end if
      call ask_metis(graph, ranks, size(levels), offered, failed)
      if (present(steps)) then
         if (failed) offered = best ! which stands
         failed = .false.
         call stay_at_home(graph, ranks, offered)
         if (step_length(graph, ranks, offered) >= step_length(graph, ranks, best)) return
      end if
      if (failed) return
      owner = -1
      owner(there) = offered
   end subroutine place

   !> Of what METIS offers for two ways and several tolerances, what makes the shortest step, which moves of single blocks then make shorter.
   !> With no more blocks than ranks, one block a rank.
   subroutine ask_metis(graph, ranks, levels, best, failed)
      type(block_graph_t), intent(in) :: graph
      integer, intent(in) :: ranks, levels !< of its constraints, the first ones
      integer, allocatable, intent(out) :: best(:)
      logical, intent(out) :: failed
      real(wp), parameter :: tolerances(2, 3) = reshape([1.01_wp, 1.2_wp, 1.03_wp, 1.2_wp, 1.2_wp, 1.03_wp], [2, 3]) !< heaviest
                                                                                    ! part over the mean: of levels, of contact
      type(block_graph_t) :: anywhere
      integer :: part(size(graph%weight, 2)), cut, n, t, way
      real(wp) :: length, shortest
      logical :: refused
      failed = .false.
      if (ranks == 1 .or. size(part) <= ranks) then
         best = [(merge(0, n - 1, ranks == 1), n=1, size(part))]
         return
      end if
      anywhere = graph
      anywhere%move_cost = 0.0_wp
      shortest = huge(shortest)
      do way = 1, 2
         do t = 1, size(tolerances, 2)
            call partition_graph(graph%offsets, graph%adjacent, graph%weight, graph%edge_weights, ranks, way == 1, &
                                 [spread(tolerances(1, t), 1, levels), tolerances(2, t)], part, cut, refused)
            if (refused) cycle
            length = step_length(anywhere, ranks, part)
            if (length >= shortest) cycle
            shortest = length
            best = part
         end do
      end do
      failed = .not. allocated(best)
      if (.not. failed) call shorten_step(anywhere, ranks, best)
   end subroutine ask_metis

   !> The graph of the blocks that exist, by their vertices, which count as their numbers do: edges to neighbours, parents and children,
   !> weighted by the nodes that two blocks share (METIS manual, CSR; vertices from 0).
   subroutine make_graph(levels, vertex, there, offsets, adjacent, edge_weights)
      type(level_t), intent(in) :: levels(:)
      integer, intent(in) :: vertex(:) !< of each block, from 1; 0 where there is none
      integer, intent(in) :: there(:)  !< numbers of the blocks that exist
      integer, allocatable, intent(out) :: offsets(:), adjacent(:), edge_weights(:)
      integer :: edges, l, n, v, d(3), position(3)
      allocate (offsets(size(there) + 1), adjacent(35*size(there)), edge_weights(35*size(there)))
      edges = 0
      offsets(1) = 0
      l = 1
      do v = 1, size(there)
         do while (there(v) > blocks_before(levels, l + 1))
            l = l + 1
         end do
         position = levels(l)%grid%block_place(there(v) - blocks_before(levels, l))
         do n = 1, 27
            if (n == 14) cycle
            d = [mod(n - 1, 3), mod((n - 1)/3, 3), (n - 1)/9] - 1
            call connect(l, position + d, product(merge(2, tile_last + 1, d /= 0)))
         end do
         if (l > 1) call connect(l - 1, position/2, shared_with_parent)
         do n = 0, 7
            if (l < size(levels)) call connect(l + 1, 2*position + [ibits(n, 0, 1), ibits(n, 1, 1), ibits(n, 2, 1)], &
                                               shared_with_parent)
         end do
         offsets(v + 1) = edges
      end do
      adjacent = adjacent(:edges)
      edge_weights = edge_weights(:edges)
   contains
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
   end subroutine make_graph

end module m_placement
