!> The nodes' part of a step of one level, numbered as in theory.md: what particles give them, sums, their motion.
module m_node_step
   use m_kinds, only: wp
   use m_timers
   use m_node_values, only: node_values, tile_last, mass_, a_x, a_z
   use m_block, only: block_t
   use m_model, only: model_t
   use m_migration, only: frame_of
   use m_composite, only: clear_covered
   use m_p2g_boxes, only: clear
   use m_particle_transfer, only: p2g
   use m_node_exchange, only: sum_tiles
   use m_node_solve, only: solve_nodes
   use m_boundary, only: fold_symmetry, apply_boundary, has_boundary, motion_parity
   implicit none
   private
   public :: clock_t, to_nodes, sum_part, solve, solve_block, sum_cells, set_order, p2g_ahead, is_idle

   !> Where a step of one level stands.
   type :: clock_t
      real(wp) :: time = 0.0_wp      !< at its beginning, s
      real(wp) :: step = 0.0_wp      !< its length, s
      real(wp) :: remaining = 0.0_wp !< from where its velocities stand, in its middle, to the middle of the coarser level's step, s
      logical :: ends = .true.       !< when it ends, so does the step of the coarsest level
   end type clock_t

contains

   !> 1. Lists; 2. particles to nodes, blocks with remote neighbours first; 3. sums over blocks and ranks begin, while inner blocks
   !> work. Where there is a finer level, what it restricts is added first. With several levels the sums are there on return, for
   !> levels ask each other for them; else they are made where the nodes are solved.
   subroutine to_nodes(model, l, time)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l
      real(wp), intent(in) :: time !< of the level, s
      logical :: finest
      integer :: b, part
      finest = l == size(model%levels)
      associate (level => model%levels(l))
         do b = 1, size(level%blocks)
            if (level%blocks(b)%shared .or. .not. finest) call gather(model, l, b, time)
         end do
         if (.not. finest) then
            call model%timers%enter(model%levels_row)
            call model%composite(l + 1)%add_to_parents(level)
         end if
         call model%timers%enter(phase_exchange)
         call model%exchange(l)%start(level%nodes)
         do b = 1, size(level%blocks)
            if (.not. finest .or. level%blocks(b)%shared) cycle
            call gather(model, l, b, time)
         end do
         call model%effect_step(l)%keep_masses(level)
         if (size(model%levels) == 1) return
      end associate
      do part = 1, 2
         call sum_part(model, l, part)
      end do
      if (finest) return
      call model%timers%enter(model%levels_row)
      call clear_covered(model%levels(l), model%levels(l + 1))
   end subroutine to_nodes

   !> Where effects want means over the cells, which blocks share: the sums over blocks and ranks, in place of the nodes. The
   !> velocity gradients of all blocks wait for them.
   subroutine sum_cells(model, l)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l
      integer :: b
      call model%timers%enter(phase_exchange)
      associate (level => model%levels(l))
         do b = 1, size(level%blocks) ! parents without particles hold what was restricted up to their nodes
            if (level%blocks(b)%particles%count == 0) call clear(level%nodes(:, :, :, :, b), level%extent(:, :, b))
         end do
         call model%exchange(l)%start(level%nodes)
         call model%exchange(l)%wait(level%nodes)
         call sum_tiles(level%blocks, level%interior_first, level%nodes, level%extent)
      end associate
   end subroutine sum_cells

   !> True when a finer level restricts to a block.
   pure logical function is_parent(model, l, b)
      type(model_t), intent(in) :: model
      integer, intent(in) :: l, b
      is_parent = .false.
      if (l < size(model%levels)) is_parent = model%composite(l + 1)%is_parent(b)
   end function is_parent

   !> True when nobody wants to know of the nodes of a block: it has no particles, is no parent, and hands nothing up.
   pure logical function is_idle(model, l, b)
      type(model_t), intent(in) :: model
      integer, intent(in) :: l, b
      is_idle = model%levels(l)%blocks(b)%particles%count == 0
      if (is_idle) is_idle = .not. is_parent(model, l, b)
      if (is_idle .and. l > 1) is_idle = model%composite(l)%edge_of(b) == 0
   end function is_idle

   !> True when the nodes of a block matter where its particles do not extent: effects and other levels give to them or ask of them,
   !> and a side of the grid sets them where anybody wants to know of them.
   pure logical function takes_more(model, l, b)
      type(model_t), intent(in) :: model
      integer, intent(in) :: l, b
      takes_more = model%effect_step(l)%acts_on_nodes
      if (.not. takes_more .and. .not. is_idle(model, l, b)) &
         takes_more = has_boundary(model%levels(l)%grid, model%levels(l)%blocks(b)%place)
      if (l < size(model%levels)) takes_more = takes_more .or. model%composite(l + 1)%receives(b)
      if (l > 1) takes_more = takes_more .or. model%composite(l)%edge_of(b) > 0
   end function takes_more

   !> Particles of one block, and the forces of effects on it, to its tile: those that have arrived since the others moved come
   !> last, for the others may have given already.
   subroutine gather(model, l, b, time)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b
      real(wp), intent(in) :: time
      logical :: fits
      fits = model%levels(l)%holds_whole(b) .or. .not. takes_more(model, l, b)
      associate (block => model%levels(l)%blocks(b))
         if (fits .and. block%p2g_is_valid) then
            continue
         else if (fits .and. allocated(block%resting_mass)) then
            call model%timers%enter(phase_p2g)
            call model%levels(l)%update_extents(b, takes_more(model, l, b))
            call give_resting(model%levels(l)%nodes(:, :, :, :, b), block%resting_mass, model%levels(l)%extent(:, :, b))
         else
            call set_order(model, l, b)
            call give(model, l, b)
         end if
      end associate
      if (model%levels(l)%blocks(b)%arrived > 0) call give_arrivals(model, l, b)
      associate (level => model%levels(l), block => model%levels(l)%blocks(b))
         call block%take_averages()
         call keep_resting(block, level%nodes(mass_, :, :, :, b), .not. is_parent(model, l, b) &
                           .and. .not. model%effect_step(l)%acts_on_nodes .and. .not. model%effect_step(l)%acts_at_rest)
         if (model%effect_step(l)%acts_on_nodes) call model%effect_step(l)%add_body_forces(model%effects, level, b, time, &
               model%timers)
         call fold_symmetry(level%grid, block%place, level%nodes(:, :, :, :, b), motion_parity)
         block%p2g_is_valid = .false. ! sums will take its place
      end associate
   end subroutine gather

   !> While a block is at rest, what its particles give is kept: their mass.
   pure subroutine keep_resting(block, mass, alone)
      type(block_t), intent(inout) :: block
      real(wp), intent(in) :: mass(0:, 0:, 0:) !< of its tile, kg
      logical, intent(in) :: alone             !< nobody else gives to its tile, and its particles give nothing else
      if (block%at_rest .and. alone .and. block%particles%count > 0) then
         if (.not. allocated(block%resting_mass)) allocate (block%resting_mass(0:tile_last, 0:tile_last, 0:tile_last), source=mass)
      else if (allocated(block%resting_mass)) then
         deallocate (block%resting_mass)
      end if
   end subroutine keep_resting

   !> What the particles of a block at rest give.
   pure subroutine give_resting(tile, mass, extent)
      real(wp), intent(inout) :: tile(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      real(wp), intent(in) :: mass(0:tile_last, 0:tile_last, 0:tile_last) !< kg
      integer, intent(in) :: extent(2, 3)
      call clear(tile, extent)
      tile(mass_, extent(1, 1):extent(2, 1), extent(1, 2):extent(2, 2), extent(1, 3):extent(2, 3)) = &
         mass(extent(1, 1):extent(2, 1), extent(1, 2):extent(2, 2), extent(1, 3):extent(2, 3))
   end subroutine give_resting

   !> At the end of a step: what the particles of a block, which is in order, will give to their nodes at the beginning of the next.
   subroutine p2g_ahead(model, l, b)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b
      if (is_parent(model, l, b) .or. .not. model%works_ahead) return
      call give(model, l, b)
      model%levels(l)%blocks(b)%p2g_is_valid = .true.
   end subroutine p2g_ahead

   !> A look over one block, where particles have changed bin, and the order of its particles, where that has come to differ too
   !> much from that of the bins.
   subroutine set_order(model, l, b)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b
      call model%timers%enter(phase_lists)
      call model%levels(l)%update_extents(b, takes_more(model, l, b))
      associate (block => model%levels(l)%blocks(b))
         if (block%wants_sorting()) call block%sort(model%levels(l)%order, model%levels(l)%gradient)
      end associate
   end subroutine set_order

   !> What the particles of one block give, to its tile; not yet what has arrived.
   subroutine give(model, l, b)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b
      call model%timers%enter(phase_p2g)
      associate (level => model%levels(l), block => model%levels(l)%blocks(b))
         call clear(level%nodes(:, :, :, :, b), level%extent(:, :, b))
         call p2g(block%cells, block%particles%column, level%layout, frame_of(level, block), &
                                 level%nodes(:, :, :, :, b))
      end associate
   end subroutine give

   !> What has arrived in a block gives to its tile after the others.
   subroutine give_arrivals(model, l, b)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b
      associate (level => model%levels(l), block => model%levels(l)%blocks(b))
         call model%timers%enter(phase_lists)
         call level%list_arrivals(b)
         call model%timers%enter(phase_p2g)
         call p2g(level%arrivals, block%particles%column, level%layout, frame_of(level, block), &
                                 level%nodes(:, :, :, :, b))
         if (.not. model%effect_step(l)%acts_on_nodes .and. size(model%levels) == 1) return
         call model%timers%enter(phase_lists)
         call level%join_arrivals(b) ! effects and other levels go through all
      end associate
   end subroutine give_arrivals

   !> 3. ends: sums; velocities at the end of the step and accelerations of the nodes, inside the boundary conditions.
   subroutine solve(model, l, clock)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l
      type(clock_t), intent(in) :: clock
      integer :: n, part
      do part = 1, 2
         if (size(model%levels) == 1) call sum_part(model, l, part)
         do n = model%levels(l)%part_end(part - 1) + 1, model%levels(l)%part_end(part)
            call solve_block(model, l, model%levels(l)%interior_first(n), clock)
         end do
      end do
   end subroutine solve

   !> Sums of the nodes of one part of the blocks. For the second part, that with remote neighbours, messages are waited for. When
   !> all blocks of a part have their sums nobody asks for their tiles any more.
   subroutine sum_part(model, l, part)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, part
      call model%timers%enter(phase_exchange)
      associate (level => model%levels(l), last => model%levels(l)%part_end)
         if (part == 2) call model%exchange(l)%wait(level%nodes)
         call sum_tiles(level%blocks, level%interior_first(last(part - 1) + 1:last(part)), level%nodes, level%extent)
      end associate
   end subroutine sum_part

   !> Velocities at the end of the step and accelerations of the nodes of one block. Slaves follow the nodes of the coarser level.
   subroutine solve_block(model, l, b, clock)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b
      type(clock_t), intent(in) :: clock
      integer :: e
      if (is_idle(model, l, b)) return
      call model%timers%enter(phase_nodes)
      e = 0
      if (l > 1) e = model%composite(l)%edge_of(b)
      call solve_nodes(model%levels(l)%nodes(:, :, :, :, b), clock%step, model%levels(l)%extent(:, :, b))
      if (e > 0) call model%composite(l)%set_constrained(b, clock%remaining, model%levels(l)%nodes(:, :, :, :, b))
      if (size(model%effect_step(l)%on_nodes) > 0 .and. clock%step > 0.0_wp) call push_nodes(model, l, b, clock)
      call apply_boundary(model%levels(l)%grid, model%levels(l)%blocks(b)%place, model%levels(l)%nodes(:, :, :, :, b))
   end subroutine solve_block

   !> Effects on the solved nodes of a block. What they add to the acceleration is kept where a finer level's two steps will ask for
   !> it; also of nodes that have no mass yet, for the finer level's particles may extent them in the second.
   subroutine push_nodes(model, l, b, clock)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b
      type(clock_t), intent(in) :: clock
      integer, allocatable :: constrained(:, :)
      real(wp), allocatable :: before(:, :, :, :)
      logical :: bare(0:tile_last, 0:tile_last, 0:tile_last), kept
      integer :: q
      allocate (constrained(4, 0))
      if (l > 1) then
         if (model%composite(l)%edge_of(b) > 0) constrained = model%composite(l)%edges(model%composite(l)%edge_of(b))%constrained
      end if
      kept = l < size(model%levels)
      if (kept) kept = model%composite(l + 1)%receives(b)
      if (kept) then
         before = model%levels(l)%nodes(a_x:a_z, :, :, :, b)
         bare = .not. model%levels(l)%nodes(mass_, :, :, :, b) > 0.0_wp
         where (bare) model%levels(l)%nodes(mass_, :, :, :, b) = tiny(1.0_wp)
      end if
      call model%effect_step(l)%change_nodes(model%effects, model%levels(l), b, clock%time, clock%step, constrained, model%timers)
      if (.not. kept) return
      associate (composite => model%composite(l + 1))
         if (.not. allocated(composite%pushed)) &
            allocate (composite%pushed(3, 0:tile_last, 0:tile_last, 0:tile_last, size(model%levels(l)%blocks)), source=0.0_wp)
         composite%pushed(:, :, :, :, b) = model%levels(l)%nodes(a_x:a_z, :, :, :, b) - before
         do q = 1, 7
            where (bare) model%levels(l)%nodes(q, :, :, :, b) = 0.0_wp
         end do
      end associate
   end subroutine push_nodes

end module m_node_step
