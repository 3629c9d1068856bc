!test: ranks 1 2 4
!> Blocks on ranks: each owned once and known alike everywhere, evenly, with more ranks than blocks too; a
!> step with empty ranks.
program decomposition
   use mpi_f08
   use m_kinds, only: wp, i8
   use m_errors, only: error_t
   use m_communicator, only: communicator_t
   use m_box, only: box_t
   use m_sphere, only: sphere_t
   use m_scene, only: scene_t, grid_spec_t, body_spec_t, tool_spec_t
   use m_grid_level, only: make_grid_level
   use m_level, only: level_t
   use m_placement, only: work_t, work_of, order_work, choose_owners
   use m_block_moves, only: block_graph_t, shorten_step, step_length, stay_at_home
   use m_materials, only: material_of
   use m_model, only: model_t
   use m_advance, only: advance
   use m_assertions, only: assertions_t
   use m_wandering, only: alone
   implicit none
   type(communicator_t) :: comm
   type(assertions_t) :: test
   integer :: parts
   call comm%start()
   call test%start(comm, 'decomposition')
   do parts = 1, 16
      call large_body(parts)
      call few_blocks(parts)
      call very_many_particles(parts)
   end do
   call pressed_corner()
   call pressed_block()
   call disordered_corner()
   call single_moves()
   call numbers_of_parts()
   call work_that_drifts()
   call one_block()
   call holes()
   call tool_on_a_corner()
   call test%finish()

contains

   !> As a communicator of `parts` ranks sees it; METIS needs no ranks.
   type(communicator_t) function as_of(parts)
      integer, intent(in) :: parts
      as_of = alone()
      as_of%ranks = parts
   end function as_of

   !> One level, as far as METIS wants to know.
   function levels_of(cells) result(levels)
      integer, intent(in) :: cells(3)
      type(level_t) :: levels(1)
      levels(1)%grid = make_grid_level(grid_spec_t(upper=real(cells, wp), cell_size=1.0_wp, cells=cells))
   end function levels_of

   !> Particles of each part.
   function loads(counts, owner, parts) result(load)
      integer, intent(in) :: counts(:), owner(:), parts
      integer :: load(0:parts - 1), index, rank
      load = 0
      do index = 1, size(counts)
         rank = owner(index)
         if (counts(index) < 0) then
            call test%check_equal(rank, -1, 'no rank owns a block that is not there')
         else
            call test%check(rank >= 0 .and. rank < parts, 'a rank owns every block that is there')
            if (rank >= 0 .and. rank < parts) load(rank) = load(rank) + counts(index)
         end if
      end do
   end function loads

   !> A box of 96 x 88 x 80 cells, 8 particles a cell, among empty places.
   subroutine large_body(parts)
      integer, intent(in) :: parts
      type(level_t) :: levels(1)
      type(error_t) :: error
      integer, allocatable :: counts(:), owner(:), load(:)
      integer :: index, place(3)
      real(wp) :: share
      levels = levels_of([120, 100, 90])
      allocate (counts(product(levels(1)%grid%blocks)), source=-1)
      do index = 1, size(counts)
         place = levels(1)%grid%block_place(index)
         if (all(place >= 1 .and. place <= [12, 11, 10])) counts(index) = 8*8**3
      end do
      allocate (owner(size(counts)))
      call choose_owners(as_of(parts), levels, work_of(levels, counts), owner, error)
      call test%check(.not. error%happened(), 'METIS places the blocks')
      load = loads(counts, owner, parts)
      share = real(maxval(load), wp)*parts/sum(load)
      if (comm%is_root() .and. mod(parts, 4) == 0) print '(3x,a,i3,a,f7.3)', 'most loaded of', parts, &
         ' parts over the mean:', share
      call test%check(share <= 1.15_wp, 'a large body is balanced within 15 %')
      call test%check(minval(load) > 0, 'no part of a large body is empty')
   end subroutine large_body

   !> A tool in the corner of a body of 4 x 4 x 2 blocks (E2): two ranks share particles and contact points;
   !> without a word about the points, one of them has most.
   subroutine pressed_corner()
      type(level_t) :: levels(1)
      type(error_t) :: error
      integer, allocatable :: counts(:), points(:), owner(:), load(:)
      type(work_t) :: work
      real(wp) :: told, untold
      integer :: i, index, j, place(3), wide(3)
      levels = levels_of([32, 32, 16])
      allocate (counts(product(levels(1)%grid%blocks)), source=-1)
      allocate (points(size(counts)), owner(size(counts)))
      points = 0
      do index = 1, size(counts)
         place = levels(1)%grid%block_place(index)
         if (any(place > [3, 3, 1])) cycle
         wide = min(8, [30, 30, 15] - 8*place)
         counts(index) = 8*product(wide)
         if (place(3) /= 1) cycle
         do j = 8*place(2), 8*place(2) + wide(2) - 1
            do i = 8*place(1), 8*place(1) + wide(1) - 1
               if (norm2([i, j] + 0.5_wp) < 25.0_wp) points(index) = points(index) + 3
            end do
         end do
      end do
      work = work_of(levels, counts, points=points)
      call choose_owners(as_of(2), levels, work_of(levels, counts), owner, error)
      untold = slowest(work, owner, 2)
      call choose_owners(as_of(2), levels, work, owner, error)
      call test%check(.not. error%happened(), 'METIS places the blocks under a tool')
      told = slowest(work, owner, 2)
      load = loads(counts, owner, 2)
      if (comm%is_root()) print '(3x,a,3f7.3)', &
         'under a tool: particles, contact points, step over the mean:', 2.0_wp*maxval(load)/sum(load), &
         2.0_wp*maxval(loads(merge(points, -1, counts >= 0), owner, 2))/sum(points), &
         told/shared_out(work, 2)
      call test%check(2.0_wp*maxval(load) <= 1.03_wp*sum(load), 'two ranks share the particles within 3 %')
      call test%check(2.0_wp*maxval(loads(merge(points, -1, counts >= 0), owner, 2)) <= 1.15_wp*sum(points), &
                      'two ranks share the contact points within 15 %')
      call test%check(told <= 0.97_wp*untold, 'a step is shorter than with particles alone shared')
   end subroutine pressed_corner

   !> The same body with all contact points in one block of its top: they cannot be shared out, and the
   !> particles are, as without them. As many points in four blocks are shared out.
   subroutine pressed_block()
      type(level_t) :: levels(1)
      type(error_t) :: error
      integer, allocatable :: counts(:), points(:), owner(:)
      type(work_t) :: work
      real(wp) :: load(0:1)
      integer :: index, place(3)
      levels = levels_of([32, 32, 16])
      allocate (counts(product(levels(1)%grid%blocks)), source=-1)
      allocate (points(size(counts)), owner(size(counts)))
      do index = 1, size(counts)
         place = levels(1)%grid%block_place(index)
         if (all(place <= [3, 3, 1])) counts(index) = 8*product(min(8, [30, 30, 15] - 8*place))
      end do
      points = 0
      points(levels(1)%grid%block_index([1, 0, 1], 1)) = 300
      work = work_of(levels, counts, points=points)
      call test%check_equal(size(work%times), 1, 'points of one block are no constraint')
      call choose_owners(as_of(2), levels, work, owner, error)
      call test%check(.not. error%happened(), 'METIS places the blocks around contact')
      load = loads(counts, owner, 2)
      call test%check(2.0_wp*maxval(load) <= 1.03_wp*sum(load), 'two ranks share the particles within 3 %')
      points = 0
      do index = 1, size(counts)
         place = levels(1)%grid%block_place(index)
         if (all(place(:2) <= 1) .and. place(3) == 1) points(index) = 75
      end do
      work = work_of(levels, counts, points=points)
      call test%check_equal(size(work%times), 2, 'points of four blocks are a constraint of their own')
      call choose_owners(as_of(2), levels, work, owner, error)
      call test%check_equal(sum(points, mask=owner == 0), 150, 'which two ranks share')
   end subroutine pressed_block

   !> 4 x 4 x 2 blocks alike but for the particles of a corner, out of order: two ranks share what that costs
   !> too; without a word about them one has most of that.
   subroutine disordered_corner()
      type(level_t) :: levels(1)
      type(error_t) :: error
      integer, allocatable :: counts(:), order(:), owner(:)
      type(work_t) :: work
      real(wp) :: told, untold
      integer :: index, place(3)
      levels = levels_of([32, 32, 16])
      allocate (counts(product(levels(1)%grid%blocks)), source=-1)
      allocate (order(size(counts)), source=0)
      allocate (owner(size(counts)))
      do index = 1, size(counts)
         place = levels(1)%grid%block_place(index)
         if (any(place > [3, 3, 1])) cycle
         counts(index) = 8*8**3
         order(index) = order_work(8**3, merge(0.2_wp, 0.0_wp, all(place(:2) < 2))*counts(index))
      end do
      work = work_of(levels, counts, order=order)
      call test%check_equal(maxval(work%weight) - minval(work%weight, mask=work%weight > 0), &
                            nint(1.75_wp*0.2_wp*8*8**3), &
                            'a jump of the order costs as much as one and three quarters of a particle')
      call choose_owners(as_of(2), levels, work_of(levels, counts), owner, error)
      untold = slowest(work, owner, 2)
      call choose_owners(as_of(2), levels, work, owner, error)
      call test%check(.not. error%happened(), 'METIS places blocks whose particles are out of order')
      told = slowest(work, owner, 2)
      if (comm%is_root()) print '(3x,a,2f7.3)', &
         'out of order in a corner: step over the mean, told and not:', told/shared_out(work, 2), &
         untold/shared_out(work, 2)
      call test%check(told <= 1.02_wp*shared_out(work, 2), 'two ranks share within 2 % what that costs')
      call test%check(untold >= 1.05_wp*shared_out(work, 2), 'of which one has most when it is not said')
   end subroutine disordered_corner

   !> Twelve blocks in a row, some of them with work of a second kind, in three partitions: in the end no move
   !> of a block of the slowest ranks to a rank next to theirs makes the step shorter, by an evaluation from
   !> nothing.
   subroutine single_moves()
      integer, parameter :: n = 12, ranks = 3
      type(block_graph_t) :: graph
      integer :: part(n), start, i, j, moved(n)
      real(wp) :: before, after, least
      graph%offsets = [0, 1, (2*i - 1, i=2, n - 1), 2*n - 2]
      graph%adjacent = [1, (i - 2, i, i=2, n - 1), n - 2]
      graph%edge_weights = [(20, i=1, 2*n - 2)]
      graph%weight = reshape([(300 + modulo(97*i, 71), merge(40*i, 0, i < 5), i=1, n)], [2, n])
      graph%times = [1.0_wp, 2.0_wp]
      graph%edge_cost = 0.1_wp
      do start = 1, 3
         part = [((i - 1)/4, i=1, n)]
         if (start == 2) part = [(merge(0, 1 + modulo(i, 2), i <= 8), i=1, n)]
         if (start == 3) part = [(modulo(i, 3), i=1, n)]
         before = length_of(graph, part, ranks)
         call shorten_step(graph, ranks, part)
         after = length_of(graph, part, ranks)
         call test%check_close(step_length(graph, ranks, part), after, 1.0e-9_wp, &
                               'the length of a step is that of its definition')
         if (comm%is_root()) print '(3x,a,2f9.1)', 'single moves: a step before and after, in particles:', &
            before, after
         call test%check(all(part >= 0 .and. part < ranks), 'every block still has a rank')
         call test%check(after <= before, 'moves of blocks never make a step longer')
         if (start == 2) call test%check(after < 0.7_wp*before, &
                                         'moves take most of what a bad partition loses')
         least = after
         do i = 1, n
            do j = 1, n
               if (part(i) == part(j) .or. .not. is_slowest(graph, part, part(i), ranks)) cycle
               if (.not. meets(part, part(i), part(j))) cycle
               moved = part
               moved(i) = part(j)
               least = min(least, length_of(graph, moved, ranks))
            end do
         end do
         call test%check(least >= after*(1.0_wp - 2.0e-4_wp), &
                         'no single move is left that makes the step shorter')
      end do
   end subroutine single_moves

   !> Parts are numbered by where their blocks are: as before when nothing but the numbers has changed; and
   !> each number once whatever they have in common with the ranks.
   subroutine numbers_of_parts()
      integer, parameter :: n = 60, ranks = 6
      type(block_graph_t) :: graph
      integer :: before(n), i, part(n), r
      graph%weight = reshape([(100 + modulo(37*i, 41), i=1, n)], [1, n])
      before = [((i - 1)/10, i=1, n)]
      graph%home = before
      part = modulo(5*before + 2, ranks)
      call stay_at_home(graph, ranks, part)
      call test%check(all(part == before), 'parts that are those of before keep their ranks')
      part = modulo(5*before + 2, ranks)
      part(::7) = modulo(part(::7) + 1, ranks)
      call stay_at_home(graph, ranks, part)
      call test%check_equal(count(part /= before), size(part(::7)), &
                            'nor do others move than those that have changed part')
      part = modulo([(i*i, i=1, n)], ranks)
      before = part
      graph%home = 0*part + 3
      call stay_at_home(graph, ranks, part)
      call test%check(all(part >= 0 .and. part < ranks), 'a number of a rank for each part')
      do r = 0, ranks - 1
         if (count(before == r) == 0) cycle
         call test%check(all(pack(part, before == r) == part(findloc(before, r, dim=1))), &
                         'a part keeps together')
         call test%check_equal(count(part == part(findloc(before, r, dim=1))), count(before == r), &
                               'by itself')
      end do
   end subroutine numbers_of_parts

   !> The blocks of a body on 2, 8, 16 and 64 ranks become up to 1.6 times as dear towards one edge: few of
   !> them move, and a step is almost as short as with all of them placed anew; in one step no move pays, and
   !> work that stays moves hardly a block.
   subroutine work_that_drifts()
      type(level_t) :: levels(1)
      type(error_t) :: error
      type(work_t) :: work
      integer, allocatable :: before(:), counts(:), order(:), now(:)
      integer :: index, parts, place(3)
      real(wp) :: anew, moved, much, stayed
      levels = levels_of([96, 96, 64])
      allocate (counts(product(levels(1)%grid%blocks)), source=-1)
      allocate (order(size(counts)), source=0)
      do index = 1, size(counts)
         place = levels(1)%grid%block_place(index)
         if (any(place > [11, 11, 7])) cycle
         counts(index) = 8*8**3
         order(index) = nint(0.6_wp*counts(index)*(place(1) + place(2))/22.0_wp)
      end do
      do parts = 2, 64
         if (all(parts /= [2, 8, 16, 64])) cycle
         before = 0*counts
         call choose_owners(as_of(parts), levels, work_of(levels, counts), before, error)
         now = before
         call choose_owners(as_of(parts), levels, work_of(levels, counts), now, error, steps=500)
         moved = share_of(now /= before, counts)
         call test%check(moved < 0.1_wp, 'hardly a block moves where the work has not changed')
         work = work_of(levels, counts, order=order)
         stayed = slowest(work, before, parts)/shared_out(work, parts)
         now = before
         call choose_owners(as_of(parts), levels, work, now, error, steps=1)
         call test%check(all(now == before), 'no move pays in one step')
         call choose_owners(as_of(parts), levels, work, now, error, steps=500)
         call test%check(.not. error%happened(), 'blocks move where the work has changed')
         moved = share_of(now /= before, counts)
         much = slowest(work, now, parts)/shared_out(work, parts)
         now = before
         call choose_owners(as_of(parts), levels, work, now, error)
         anew = slowest(work, now, parts)/shared_out(work, parts)
         if (comm%is_root()) print '(3x,a,i3,a,3f7.3,a,2f7.3)', 'drifting work on', parts, &
            ' ranks: step over the mean if all stay, some move, all are placed anew:', stayed, much, anew, &
            '; moved:', moved, share_of(now /= before, counts)
         call test%check(much <= 1.05_wp .and. much < stayed, 'a step is as short as it should be')
         call test%check(much <= anew + 0.02_wp, 'almost as short as with all blocks placed anew')
         call test%check(moved <= 0.35_wp, 'most blocks stay')
      end do
   end subroutine work_that_drifts

   !> Time of a step, in particles: of each level and of contact, that of the slowest rank.
   pure real(wp) function slowest(work, owner, ranks)
      type(work_t), intent(in) :: work
      integer, intent(in) :: owner(:), ranks !< as from choose_owners
      integer :: c, r
      slowest = 0.0_wp
      do c = 1, size(work%times)
         slowest = slowest + work%times(c)*maxval([(sum(work%weight(c, :), mask=owner == r), r=0, ranks - 1)])
      end do
   end function slowest

   !> Time of a step if all ranks had the same share of everything, in particles.
   pure real(wp) function shared_out(work, ranks)
      type(work_t), intent(in) :: work
      integer, intent(in) :: ranks
      shared_out = dot_product(work%times, sum(real(work%weight, wp), dim=2))/ranks
   end function shared_out

   !> Share of the blocks that are there.
   pure real(wp) function share_of(these, counts)
      logical, intent(in) :: these(:)
      integer, intent(in) :: counts(:)
      share_of = real(count(these), wp)/count(counts >= 0)
   end function share_of

   !> Length of a step from nothing but its definition.
   pure real(wp) function length_of(graph, part, ranks) result(length)
      type(block_graph_t), intent(in) :: graph
      integer, intent(in) :: part(:), ranks
      integer :: c, e, i, r
      length = 0.0_wp
      do c = 1, size(graph%times)
         length = length + graph%times(c)*maxval([(sum(graph%weight(c, :), mask=part == r), r=0, ranks - 1)])
      end do
      do i = 1, size(part)
         do e = graph%offsets(i) + 1, graph%offsets(i + 1)
            if (part(1 + graph%adjacent(e)) /= part(i)) &
               length = length + 0.5_wp*graph%edge_cost*graph%edge_weights(e)
         end do
      end do
   end function length_of

   !> True when no rank has more of some kind of work.
   pure logical function is_slowest(graph, part, rank, ranks)
      type(block_graph_t), intent(in) :: graph
      integer, intent(in) :: part(:), rank, ranks
      integer :: c, r
      is_slowest = .false.
      do c = 1, size(graph%times)
         if (rank == maxloc([(sum(graph%weight(c, :), mask=part == r), r=0, ranks - 1)], dim=1) - 1) &
            is_slowest = .true.
      end do
   end function is_slowest

   !> True when blocks of two ranks are next to each other in the row.
   pure logical function meets(part, one, other)
      integer, intent(in) :: part(:), one, other
      integer :: i
      meets = any([((part(i) == one .and. part(i + 1) == other) .or. &
                    (part(i) == other .and. part(i + 1) == one), i=1, size(part) - 1)])
   end function meets

   !> Five thousand million particles: their number, which METIS would add up, is more than 32 bits hold.
   subroutine very_many_particles(parts)
      integer, intent(in) :: parts
      type(level_t) :: levels(1)
      type(error_t) :: error
      integer, allocatable :: counts(:), owner(:)
      integer :: held(0:parts - 1), r
      levels = levels_of([78, 78, 78])
      allocate (counts(product(levels(1)%grid%blocks)), source=5000000)
      allocate (owner(size(counts)))
      call choose_owners(as_of(parts), levels, work_of(levels, counts), owner, error)
      call test%check(.not. error%happened(), 'METIS places very many particles')
      held = [(count(owner == r), r=0, parts - 1)]
      call test%check(minval(held) > 0 .and. maxval(held)*parts <= 1.15_wp*size(counts), &
                      'very many particles are balanced within 15 %')
   end subroutine very_many_particles

   !> Up to five blocks, for more ranks than blocks or fewer.
   subroutine few_blocks(parts)
      integer, intent(in) :: parts
      type(level_t) :: levels(1)
      type(error_t) :: error
      integer, allocatable :: counts(:), owner(:), load(:)
      integer :: blocks
      levels = levels_of([50, 10, 10])
      do blocks = 1, 5
         allocate (counts(product(levels(1)%grid%blocks)), source=-1)
         counts(:blocks) = 100
         allocate (owner(size(counts)))
         call choose_owners(as_of(parts), levels, work_of(levels, counts), owner, error)
         call test%check(.not. error%happened(), 'few blocks are placed')
         load = loads(counts, owner, parts)
         if (parts >= blocks) call test%check_equal(maxval(load), 100, &
                                                    'with no more blocks than ranks, one block a rank')
         deallocate (counts, owner)
      end do
   end subroutine few_blocks

   !> A scene of one moving box.
   function box_scene(lower, upper, velocity) result(scene)
      real(wp), intent(in) :: lower(3), upper(3), velocity(3)
      type(scene_t) :: scene
      scene%title = 'box'
      scene%end_time = 1.0_wp
      scene%grid = grid_spec_t(upper=[40.0_wp, 40.0_wp, 40.0_wp], cell_size=1.0_wp, cells=[40, 40, 40])
      allocate (scene%materials(1), scene%bodies(1), scene%tools(0), scene%probes(0))
      scene%materials(1) = material_of('soft', 'elastic', 1.0_wp, 1.0_wp, 0.3_wp)
      scene%bodies(1)%name = 'box'
      scene%bodies(1)%material = 1
      scene%bodies(1)%shape = box_t(lower=lower, upper=upper)
      scene%bodies(1)%velocity = velocity
   end function box_scene

   !> One block on 1, 2, 4 ranks: the others are empty; the box moves on, from block to block.
   subroutine one_block()
      type(model_t) :: model
      type(error_t) :: error
      integer :: step
      integer(i8) :: particles
      call model%build(comm, box_scene([1.0_wp, 1.0_wp, 1.0_wp], [5.0_wp, 5.0_wp, 5.0_wp], &
                                       [8.0_wp, 6.0_wp, 7.0_wp]), error)
      call test%check(.not. error%happened(), 'a model of one block is built on any number of ranks')
      call test%check_equal(count(model%levels(1)%owner >= 0), 1, 'one block')
      call owned_once(model)
      do step = 1, 60
         call advance(model, 0.05_wp, error)
         call test%check(.not. error%happened(), 'steps with empty ranks')
      end do
      call owned_once(model)
      particles = comm%sum_count(model%levels(1)%particle_count())
      call test%check(particles == 512_i8, 'steps with empty ranks keep all particles')
      call model%rebalance(error, 500)
      call owned_once(model)
      particles = comm%sum_count(model%levels(1)%particle_count())
      call test%check(particles == 512_i8, 'rebalancing few blocks keeps all particles')
      do step = 1, 20
         call advance(model, 0.05_wp, error)
         call test%check(.not. error%happened(), 'steps after rebalancing')
      end do
      call model%release()
   end subroutine one_block

   !> A box of 27 blocks, some only touched.
   subroutine holes()
      type(model_t) :: model
      type(error_t) :: error
      integer(i8) :: particles
      call model%build(comm, box_scene([6.0_wp, 6.0_wp, 6.0_wp], [18.0_wp, 17.0_wp, 16.0_wp], &
                                       [0.0_wp, 0.0_wp, 0.0_wp]), error)
      call test%check(.not. error%happened(), 'a model is built')
      call owned_once(model)
      particles = comm%sum_count(model%levels(1)%particle_count())
      call test%check(particles == 8_i8*12*11*10, 'every particle is made once')
      call model%release()
   end subroutine holes

   !> A tool presses a quarter of a body's upper side: rebalancing gives every rank its share of what is
   !> pressed.
   subroutine tool_on_a_corner()
      type(scene_t) :: scene
      type(model_t) :: model
      type(error_t) :: error
      real(wp) :: before, after
      scene = box_scene([0.0_wp, 0.0_wp, 0.0_wp], [64.0_wp, 64.0_wp, 16.0_wp], [0.0_wp, 0.0_wp, 0.0_wp])
      scene%grid = grid_spec_t(upper=[64.0_wp, 64.0_wp, 32.0_wp], cell_size=1.0_wp, cells=[64, 64, 32])
      scene%bodies(1)%particles_per_cell = 1
      scene%tools = [tool_spec_t(name='tool', tip=[16.0_wp, 16.0_wp, 24.0_wp], times=[0.0_wp], &
                                 speeds=[1.0_wp])]
      scene%tools(1)%shape = sphere_t(radius=4.0_wp)
      call model%build(comm, scene, error)
      call test%check(.not. error%happened(), 'a model with a tool is built')
      call press(model, below=32.0_wp, above=15.0_wp)
      before = most_over_mean(model)
      call model%rebalance(error, 500)
      call test%check(.not. error%happened(), 'blocks are placed anew')
      call owned_once(model)
      after = most_over_mean(model)
      if (comm%is_root()) print '(3x,a,2f7.3)', &
         'pressed particles, most over mean, before and after rebalancing:', before, after
      if (comm%ranks > 1) call test%check(before > 1.5_wp, &
                                          'placed for the particles alone, some ranks have the contact')
      call test%check(after < 1.3_wp, 'all ranks have their share of what is pressed')
      call model%release()
   end subroutine tool_on_a_corner

   !> As if a tool had pressed the particles of an upper corner.
   subroutine press(model, below, above)
      type(model_t), intent(inout) :: model
      real(wp), intent(in) :: below, above
      integer :: b, p
      do b = 1, size(model%levels(1)%blocks)
         associate (particles => model%levels(1)%blocks(b)%particles, x => model%levels(1)%layout%position, &
                    pressure => model%contact%candidates%pressure)
            do p = 1, particles%count
               if (all(particles%column(p, x:x + 1) < below) .and. particles%column(p, x + 2) > above) &
                  particles%column(p, pressure) = 1.0_wp
            end do
         end associate
      end do
   end subroutine press

   !> Pressed particles of the rank with most of them over the mean.
   real(wp) function most_over_mean(model)
      type(model_t), intent(in) :: model
      integer :: all_of_them, b, most, own
      own = 0
      do b = 1, size(model%levels(1)%blocks)
         own = own + model%contact%candidates%pressed(model%levels(1)%blocks(b))
      end do
      call MPI_Allreduce(own, most, 1, MPI_INTEGER, MPI_MAX, comm%comm)
      call MPI_Allreduce(own, all_of_them, 1, MPI_INTEGER, MPI_SUM, comm%comm)
      call test%check_equal(all_of_them, 32*32, 'what is pressed stays so')
      most_over_mean = real(most, wp)*comm%ranks/all_of_them
   end function most_over_mean

   !> All ranks know the same owners, and each block that is there lives on its owner alone.
   subroutine owned_once(model)
      type(model_t), intent(in) :: model
      integer, allocatable :: lowest(:), highest(:), homes(:)
      integer :: b, index
      allocate (lowest, source=model%levels(1)%owner)
      allocate (highest, source=model%levels(1)%owner)
      call MPI_Allreduce(MPI_IN_PLACE, lowest, size(lowest), MPI_INTEGER, MPI_MIN, comm%comm)
      call MPI_Allreduce(MPI_IN_PLACE, highest, size(highest), MPI_INTEGER, MPI_MAX, comm%comm)
      call test%check(all(lowest == highest), 'owners are the same on every rank')
      allocate (homes(size(lowest)), source=0)
      do b = 1, size(model%levels(1)%blocks)
         homes(model%levels(1)%blocks(b)%index) = homes(model%levels(1)%blocks(b)%index) + 1
      end do
      call MPI_Allreduce(MPI_IN_PLACE, homes, size(homes), MPI_INTEGER, MPI_SUM, comm%comm)
      do index = 1, size(homes)
         associate (place => model%levels(1)%grid%block_place(index))
            call test%check_equal(homes(index), merge(1, 0, model%levels(1)%owner_at(place, 1) >= 0), &
                                  'every block lives on one rank')
         end associate
      end do
   end subroutine owned_once

end program decomposition
