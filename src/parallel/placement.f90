!> Assignment of blocks to ranks: METIS on the graph of the blocks of all levels, weighted by particles and
!> contact points. Each level and contact are a constraint of their own, for ranks synchronise after each of
!> them. Edges are weighted by the nodes that neighbours, parents and children share.
module m_placement
   use mpi_f08
   use m_kinds, only: wp
   use m_constants, only: exit_numerical
   use m_errors, only: error_t, fail
   use m_node_values, only: tile_last
   use m_communicator, only: communicator_t
   use m_level, only: level_t
   use m_decomposition, only: blocks_before
   use m_metis, only: partition_graph
   use m_block, only: directions
   use m_block_moves, only: block_graph_t, shorten_step, step_length, busiest, evenly_shared, stay_at_home
   implicit none
   private
   public :: work_t, work_of, order_work, choose_owners

   !> The work in the blocks of all levels, by block number, in units of the work of a particle.
   type :: work_t
      logical, allocatable :: exists(:)     !< (blocks)
      integer, allocatable :: weight(:, :) !< (levels, and contact where it is a constraint; blocks): in one
                                           !< step of the level
      real(wp), allocatable :: times(:)     !< how often each is done in a step of the coarsest level
   end type work_t

   integer, parameter :: block_cost = 64 !< of a block's node tile, in particles
   real(wp), parameter :: bin_cost = 0.75_wp !< of a bin with particles, in particles
   real(wp), parameter :: run_break_cost = 1.75_wp !< of a run break of the particles' order (cell_list.f90),
                                                   !< in particles; includes uneven bins and sorting, which go
                                                   !< along with run breaks
   integer, parameter :: point_cost = 48 !< of a contact point, in particles: measured in E2, as the
                                         !< difference in contact time between its two ranks
   real(wp), parameter :: shared_cost = 0.1_wp !< of a node shared with another rank, in particles
   real(wp), parameter :: move_cost = 6.0_wp    !< of a particle that leaves or enters a rank, in steps of a
                                                !< particle
   real(wp), parameter :: well_shared = 1.01_wp !< acceptable ratio of the step time to that of evenly shared
                                                !< work
   integer, parameter :: asking_cost = 30 !< of a METIS call, for a block, in steps of a particle; and one
                                          !< more for each rank
   integer, parameter :: ways = 6 !< of calling METIS: by recursive bisection or all parts at once, and three
                                  !< sets of tolerances
   integer, parameter :: shared_with_parent = 6**3 !< nodes of the level above that a block exchanges with its
                                                   !< parent

contains

   !> The work of the blocks from their contents. Contact is on the finest level. Ranks synchronise there, so
   !> contact points are a constraint of their own, except where one block has most of them: then no placement
   !> shortens the wait.
   pure function work_of(levels, particles, steps, points, order) result(work)
      type(level_t), intent(in) :: levels(:)     !< only their grids are used
      integer, intent(in) :: particles(:) !< of each block of each level, by number; -1 where there is no
                                          !< block
      integer, intent(in), optional :: steps(:)  !< of each level in one of the coarsest; 1 if absent
      integer, intent(in), optional :: points(:) !< contact points of each block; none if absent
      integer, intent(in), optional :: order(:)  !< from order_work, of each block; 0 if absent
      type(work_t) :: work
      integer :: first, l, last, constraints
      logical :: shared
      constraints = size(levels)
      shared = .false.
      if (present(points)) shared = any(points > 0) .and. 2*maxval(points) <= sum(points)
      if (shared) constraints = constraints + 1
      work%exists = particles >= 0
      allocate (work%weight(constraints, size(particles)), source=0)
      allocate (work%times(constraints), source=1.0_wp)
      do l = 1, size(levels)
         first = blocks_before(levels, l) + 1
         last = blocks_before(levels, l + 1)
         work%weight(l, first:last) = particles(first:last) + block_cost
         if (present(order)) work%weight(l, first:last) = work%weight(l, first:last) + order(first:last)
         where (.not. work%exists(first:last)) work%weight(l, first:last) = 0
         if (present(steps)) work%times(l) = steps(l)
      end do
      if (.not. shared) return
      work%weight(constraints, :) = merge(point_cost*points, 0, work%exists)
      work%times(constraints) = work%times(size(levels))
   end function work_of

   !> The cost per step of particles in many bins and out of order, as a number of particles (performance.md,
   !> 'Which block costs what').
   pure integer function order_work(bins, run_breaks)
      integer, intent(in) :: bins   !< bins with particles
      real(wp), intent(in) :: run_breaks !< of the particles' order, on average
      order_work = nint(bin_cost*bins + run_break_cost*run_breaks)
   end function order_work

   !> Collective: an owner for every block that exists, the same on every rank; -1 elsewhere. Where blocks
   !> have owners already, `steps` is the number of steps that the new ones will be in use, in which they must
   !> save more than the move costs. Then only single blocks move, unless that leaves too large an imbalance
   !> and METIS has something better, moves included.
   subroutine choose_owners(communicator, levels, work, owner, error, steps)
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(in) :: levels(:)     !< only their grids are used
      type(work_t), intent(in) :: work
      integer, intent(inout) :: owner(:)         !< by number; on entry it is only used with `steps`
      type(error_t), intent(inout) :: error
      integer, intent(in), optional :: steps
      type(block_graph_t) :: graph
      integer, allocatable :: offered(:), part(:), there(:)
      integer :: n
      logical :: content, refused
      there = pack([(n, n=1, size(owner))], work%exists)
      graph = graph_of(levels, work, there, communicator%ranks)
      content = .false.
      if (present(steps)) then
         graph%home = owner(there)
         graph%move_cost = move_cost/steps
         part = graph%home
         if (communicator%is_root()) call move_single(graph, communicator, steps, part, content)
         call MPI_Bcast(content, 1, MPI_LOGICAL, 0, communicator%comm)
      end if
      if (.not. content) then
         call ask_metis(communicator, graph, size(levels), offered, refused)
         if (.not. present(steps)) then
            if (refused) then
               call fail(error, exit_numerical, &
                         'METIS could not partition the blocks; try another number of ranks')
               return
            end if
            part = offered
         else if (communicator%is_root() .and. .not. refused) then
            call stay_at_home(graph, communicator%ranks, offered)
            if (step_length(graph, communicator%ranks, offered) < step_length(graph, communicator%ranks, &
                  part)) part = offered
         end if
      end if
      call MPI_Bcast(part, size(part), MPI_INTEGER, 0, communicator%comm)
      owner = -1
      owner(there) = part
   end subroutine choose_owners

   !> Move single blocks where that pays. `content` when the possible gain of a step is not worth a call of
   !> METIS.
   subroutine move_single(graph, communicator, steps, part, content)
      type(block_graph_t), intent(in) :: graph
      type(communicator_t), intent(in) :: communicator
      integer, intent(in) :: steps
      integer, intent(inout) :: part(:)
      logical, intent(out) :: content
      real(wp) :: asking, even
      associate (ranks => communicator%ranks, home => graph%home)
         call shorten_step(graph, ranks, part)
         if (step_length(graph, ranks, part) > step_length(graph, ranks, home)) part = home
         even = evenly_shared(graph, ranks)
         asking = real(asking_cost + ranks, wp)*size(part)*turns(communicator)
         content = busiest(graph, ranks, part) - even <= max((well_shared - 1.0_wp)*even, asking/steps)
      end associate
   end subroutine move_single

   !> Number of METIS calls of a rank when all ranks share the ways.
   integer function turns(communicator)
      type(communicator_t), intent(in) :: communicator
      integer :: sharing ! differs in tests, and in the model of many ranks, from the ranks that blocks are
                         ! assigned to
      call MPI_Comm_size(communicator%comm, sharing)
      turns = (ways + sharing - 1)/sharing
   end function turns

   !> Collective: of METIS's partitions for two methods and several tolerances, computed by the ranks in
   !> parallel, take the one with the shortest step; moves of single blocks then shorten it further. With no
   !> more blocks than ranks, one block a rank.
   subroutine ask_metis(communicator, graph, levels, best, refused)
      type(communicator_t), intent(in) :: communicator
      type(block_graph_t), intent(in) :: graph
      integer, intent(in) :: levels !< number of level constraints, the first ones
      integer, allocatable, intent(out) :: best(:)
      logical, intent(out) :: refused
      ! heaviest part over the mean: for levels, for contact
      real(wp), parameter :: tolerances(2, ways/2) = reshape([1.01_wp, 1.2_wp, 1.03_wp, 1.2_wp, &
                                                              1.2_wp, 1.03_wp], [2, ways/2])
      type(block_graph_t) :: anywhere
      integer :: part(size(graph%weight, 2)), cut, n, ranks, sharing, way
      real(wp) :: shortest(2), length
      logical :: unable
      ranks = communicator%ranks
      allocate (best(size(part)), source=-1)
      refused = .false.
      if (ranks == 1 .or. size(part) <= ranks) then
         best = [(merge(0, n - 1, ranks == 1), n=1, size(part))]
         return
      end if
      anywhere = graph
      anywhere%move_cost = 0.0_wp
      shortest = [huge(shortest), real(communicator%rank, wp)]
      call MPI_Comm_size(communicator%comm, sharing)
      do way = 1 + communicator%rank, ways, sharing
         call partition_graph(graph%offsets, graph%adjacent, graph%weight, graph%edge_weights, ranks, &
                              way <= ways/2, [spread(tolerances(1, 1 + mod(way, ways/2)), 1, levels), &
                              tolerances(2, 1 + mod(way, ways/2))], part, cut, unable)
         if (unable) cycle
         length = step_length(anywhere, ranks, part)
         if (length >= shortest(1)) cycle
         shortest(1) = length
         best = part
      end do
      call MPI_Allreduce(MPI_IN_PLACE, shortest, 1, MPI_2DOUBLE_PRECISION, MPI_MINLOC, communicator%comm)
      refused = shortest(1) >= huge(shortest)
      if (refused) return
      if (communicator%rank == nint(shortest(2))) call shorten_step(anywhere, ranks, best)
      call MPI_Bcast(best, size(best), MPI_INTEGER, nint(shortest(2)), communicator%comm)
   end subroutine ask_metis

   !> The graph of the existing blocks, with their weights.
   type(block_graph_t) function graph_of(levels, work, there, ranks) result(graph)
      type(level_t), intent(in) :: levels(:)
      type(work_t), intent(in) :: work
      integer, intent(in) :: there(:) !< numbers of the blocks
      integer, intent(in) :: ranks
      integer :: n, vertex(size(work%exists))
      vertex = 0
      vertex(there) = [(n, n=1, size(there))]
      graph%weight = work%weight(:, there)
      graph%times = work%times
      graph%edge_cost = shared_cost*2.0_wp/ranks
      call make_graph(levels, vertex, there, graph%offsets, graph%adjacent, graph%edge_weights)
   end function graph_of

   !> The graph of the existing blocks; vertices are in the order of block numbers: edges to neighbours,
   !> parents and children, weighted by the nodes that two blocks share (METIS manual, CSR; vertices from 0).
   subroutine make_graph(levels, vertex, there, offsets, adjacent, edge_weights)
      type(level_t), intent(in) :: levels(:)
      integer, intent(in) :: vertex(:) !< of each block, from 1; 0 where there is none
      integer, intent(in) :: there(:)  !< numbers of the blocks that exist
      integer, allocatable, intent(out) :: offsets(:), adjacent(:), edge_weights(:)
      integer :: edges, field, l, n, v, d(3), position(3)
      allocate (offsets(size(there) + 1), adjacent(35*size(there)), edge_weights(35*size(there)))
      edges = 0
      offsets(1) = 0
      l = 1
      do v = 1, size(there)
         do while (there(v) > blocks_before(levels, l + 1))
            l = l + 1
         end do
         associate (index => there(v) - blocks_before(levels, l))
            position = levels(l)%grid%block_place(index)
            field = levels(l)%grid%block_field(index)
         end associate
         do n = 1, 27
            if (n == 14) cycle
            d = directions(:, n)
            call connect(l, position + d, product(merge(2, tile_last + 1, d /= 0)))
         end do
         if (l > 1) call connect(l - 1, position/2, shared_with_parent)
         do n = 0, 7
            if (l < size(levels)) &
               call connect(l + 1, 2*position + [ibits(n, 0, 1), ibits(n, 1, 1), ibits(n, 2, 1)], &
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
         other = vertex(blocks_before(levels, to_level) + levels(to_level)%grid%block_index(to, field))
         if (other == 0) return
         edges = edges + 1
         adjacent(edges) = other - 1
         edge_weights(edges) = weight
      end subroutine connect
   end subroutine make_graph

end module m_placement
