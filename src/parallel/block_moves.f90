!> Improve a partition of the blocks by moving single blocks, including the cost of moving. METIS balances
!> each constraint separately, up to a tolerance, and numbers its parts arbitrarily; a step takes as long as
!> the slowest rank of each constraint. Where blocks are few, moves of single blocks shorten it by some per
!> cent; where blocks have a rank already, they are often sufficient.
module m_block_moves
   use m_kinds, only: wp, i8
   use m_sorting, only: sorted_order
   implicit none
   private
   public :: block_graph_t, shorten_step, step_length, busiest, evenly_shared, stay_at_home

   real(wp), parameter :: worth_while = 1.0e-4_wp !< of a step

   !> The graph of the blocks for METIS, and the costs that make up a step.
   type :: block_graph_t
      integer, allocatable :: offsets(:), adjacent(:), edge_weights(:) !< CSR, from 0
      integer, allocatable :: weight(:, :) !< (constraints, blocks)
      real(wp), allocatable :: times(:)    !< (constraints): how often a step does this work
      real(wp) :: edge_cost = 0.0_wp       !< cost of a unit of weight of an edge between ranks
      integer, allocatable :: home(:) !< (blocks): ranks on which they are now; not allocated where they have
                                      !< none yet
      real(wp) :: move_cost = 0.0_wp !< cost of a unit of weight that moves to another rank, spread over the
                                     !< steps of the partition
   end type block_graph_t

   !> A block that moves to another rank.
   type :: change_t
      real(wp) :: gain = 0.0_wp
      integer :: block = 0, to = -1
   end type change_t

contains

   !> Move single blocks of the slowest ranks to neighbouring ranks, until no move shortens a step: sum over
   !> constraints of times * slowest rank, plus edge_cost * cut. Each move must also save its two ranks more
   !> than its move_cost: if many ranks are about equally slow, the next slowest would take all but a little
   !> of the gain.
   pure subroutine shorten_step(graph, ranks, part)
      type(block_graph_t), intent(in) :: graph
      integer, intent(in) :: ranks
      integer, intent(inout) :: part(:) !< (blocks): rank of each, from 0
      real(wp) :: load(size(graph%times), 0:ranks - 1), least
      type(change_t) :: best
      integer :: c, e, i, s, slow(size(graph%times))
      integer, allocatable :: mine(:)
      logical :: near(0:ranks - 1)
      load = load_of(graph, ranks, part)
      least = worth_while*evenly_shared(graph, ranks)
      do
         best = change_t(gain=least)
         slow = maxloc(load, dim=2) - 1
         do c = 1, size(slow)
            if (any(slow(:c - 1) == slow(c))) cycle
            mine = blocks_of(slow(c), part)
            near = .false.
            do i = 1, size(mine)
               do e = graph%offsets(mine(i)) + 1, graph%offsets(mine(i) + 1)
                  near(part(1 + graph%adjacent(e))) = .true.
               end do
            end do
            do s = 0, ranks - 1
               if (near(s) .and. s /= slow(c)) call look_between(graph, part, load, slow(c), s, mine, best)
            end do
         end do
         if (best%block == 0) exit
         call give(best%block, best%to, graph%weight(:, best%block), load, part)
      end do
   end subroutine shorten_step

   !> Cost of a step, plus its share of the moves that lead to the partition: sum over constraints of times *
   !> slowest rank, edge_cost * cut, and move_cost times the largest weight that leaves and enters a rank.
   pure real(wp) function step_length(graph, ranks, part) result(length)
      type(block_graph_t), intent(in) :: graph
      integer, intent(in) :: ranks, part(:) !< as in shorten_step
      real(wp) :: moved(0:ranks - 1)
      integer(i8) :: cut
      integer :: e, i
      moved = 0.0_wp
      cut = 0
      do i = 1, size(part)
         do e = graph%offsets(i) + 1, graph%offsets(i + 1)
            if (part(1 + graph%adjacent(e)) > part(i)) cut = cut + graph%edge_weights(e)
         end do
         if (.not. allocated(graph%home)) cycle
         if (graph%home(i) == part(i)) cycle
         moved(part(i)) = moved(part(i)) + sum(graph%weight(:, i))
         moved(graph%home(i)) = moved(graph%home(i)) + sum(graph%weight(:, i))
      end do
      length = busiest(graph, ranks, part) + graph%edge_cost*cut + graph%move_cost*maxval(moved)
   end function step_length

   !> Sum over constraints of times * slowest rank.
   pure real(wp) function busiest(graph, ranks, part)
      type(block_graph_t), intent(in) :: graph
      integer, intent(in) :: ranks, part(:) !< as in shorten_step
      busiest = dot_product(graph%times, maxval(load_of(graph, ranks, part), dim=2))
   end function busiest

   !> The same if the work of each constraint were shared evenly.
   pure real(wp) function evenly_shared(graph, ranks)
      type(block_graph_t), intent(in) :: graph
      integer, intent(in) :: ranks
      evenly_shared = dot_product(graph%times, sum(real(graph%weight, wp), dim=2))/ranks
   end function evenly_shared

   !> Work of the ranks: (constraints, ranks from 0).
   pure function load_of(graph, ranks, part) result(load)
      type(block_graph_t), intent(in) :: graph
      integer, intent(in) :: ranks, part(:) !< as in shorten_step
      real(wp) :: load(size(graph%times), 0:ranks - 1)
      integer :: i
      load = 0.0_wp
      do i = 1, size(part)
         load(:, part(i)) = load(:, part(i)) + graph%weight(:, i)
      end do
   end function load_of

   !> Renumber the parts so that blocks stay on their ranks as far as possible: the largest common weight of a
   !> part and a rank is matched first.
   pure subroutine stay_at_home(graph, ranks, part)
      type(block_graph_t), intent(in) :: graph
      integer, intent(in) :: ranks
      integer, intent(inout) :: part(:)
      integer(i8) :: in_common(size(part))
      integer, dimension(size(part)) :: one, home, order
      integer :: i, k, n, name(0:ranks - 1)
      logical :: taken(0:ranks - 1)
      order = sorted_order(int(part, i8), int(graph%home, i8))
      n = 0
      do k = 1, size(part)
         i = order(k)
         if (n > 0) then
            if (one(n) == part(i) .and. home(n) == graph%home(i)) then
               in_common(n) = in_common(n) + sum(graph%weight(:, i))
               cycle
            end if
         end if
         n = n + 1
         one(n) = part(i)
         home(n) = graph%home(i)
         in_common(n) = sum(graph%weight(:, i))
      end do
      order(:n) = sorted_order(-in_common(:n), int(one(:n), i8))
      name = -1
      taken = .false.
      do k = 1, n
         associate (part_ => one(order(k)), rank => home(order(k)))
            if (name(part_) >= 0 .or. taken(rank)) cycle
            name(part_) = rank
            taken(rank) = .true.
         end associate
      end do
      do k = 0, ranks - 1
         if (name(k) >= 0) cycle
         name(k) = findloc(taken, .false., dim=1) - 1
         taken(name(k)) = .true.
      end do
      part = name(part)
   end subroutine stay_at_home

   !> Move a block to a rank.
   pure subroutine give(block, to, work, load, part)
      integer, intent(in) :: block, to, work(:)
      real(wp), intent(inout) :: load(:, 0:)
      integer, intent(inout) :: part(:)
      load(:, part(block)) = load(:, part(block)) - work
      load(:, to) = load(:, to) + work
      part(block) = to
   end subroutine give

   !> The blocks of a rank.
   pure function blocks_of(rank, part) result(blocks)
      integer, intent(in) :: rank, part(:)
      integer, allocatable :: blocks(:)
      integer :: i
      blocks = pack([(i, i=1, size(part))], part == rank)
   end function blocks_of

   !> Find the single block whose move from rank r to rank s gains most.
   pure subroutine look_between(graph, part, load, r, s, mine, best)
      type(block_graph_t), intent(in) :: graph
      integer, intent(in) :: part(:), r, s, mine(:)
      real(wp), intent(in) :: load(:, 0:)
      type(change_t), intent(inout) :: best
      real(wp), dimension(size(load, 1)) :: others, before, after, work
      real(wp) :: gain
      integer :: cut, i, k
      if (size(mine) == 1) return
      others = 0.0_wp
      do k = 0, size(load, 2) - 1
         if (k /= r .and. k /= s) others = max(others, load(:, k))
      end do
      before = max(load(:, r), load(:, s))
      do i = 1, size(mine)
         work = graph%weight(:, mine(i))
         cut = pull_of(graph, part, mine(i), r, s)
         after = max(load(:, r) - work, load(:, s) + work)
         gain = sum(graph%times*(max(others, before) - max(others, after))) - graph%edge_cost*cut
         if (gain <= best%gain) cycle
         ! the two ranks must gain more than the move costs
         if (graph%move_cost > 0.0_wp .and. &
             sum(graph%times*(before - after)) <= graph%edge_cost*cut + graph%move_cost*sum(work)) cycle
         best = change_t(gain, mine(i), s)
      end do
   end subroutine look_between

   !> Growth of the cut when a block moves from its rank to another.
   pure integer function pull_of(graph, part, block, home, abroad)
      type(block_graph_t), intent(in) :: graph
      integer, intent(in) :: part(:), block, home, abroad
      integer :: e, rank
      pull_of = 0
      do e = graph%offsets(block) + 1, graph%offsets(block + 1)
         rank = part(graph%adjacent(e) + 1)
         if (rank == home) pull_of = pull_of + graph%edge_weights(e)
         if (rank == abroad) pull_of = pull_of - graph%edge_weights(e)
      end do
   end function pull_of

end module m_block_moves
