!> The parts of one step on one level, numbered as in theory.md.
module m_level_step
   use mpi_f08
   use m_kinds, only: wp
   use m_constants, only: exit_numerical
   use m_errors, only: error_t, fail
   use m_text, only: to_text
   use m_timers
   use m_scene, only: domain_fixed
   use m_field_table, only: layout_t
   use m_particle_store, only: particle_store_t
   use m_block, only: block_t
   use m_cell_list, only: cell_list_t, bins_at
   use m_materials, only: materials_t
   use m_level, only: tile_last, node_values
   use m_model, only: model_t, bounds_t
   use m_migration, only: frame_of
   use m_composite, only: clear_covered
   use m_complaints, only: particle_text, check_leavers, report_outside, report_inversion, report_long_way, report_undefined, &
                           furthest_way
   use m_particle_to_node, only: gather_to_nodes
   use m_cell_mean, only: give_to_cells
   use m_node_to_particle, only: scatter_to_particles, motion_t, longest_t
   use m_corner_to_node, only: gather_corners_to_nodes
   use m_corner_to_particle, only: scatter_to_corners
   use m_split, only: split_long, most_generations
   use m_node_exchange, only: sum_tiles
   use m_node_solve, only: solve_nodes
   use m_boundary, only: fold_symmetry, constrain_nodes, motion_parity
   use m_deform, only: advance_volume, advance_half_sizes, advance_half_edges, fastest, finite_stress
   use m_locate, only: locate_particles
   use m_energy, only: take_sums
   implicit none
   private
   public :: clock_t, to_nodes, solve, to_particles, strain, take_next_position, bound_speeds

   !> Where a step of one level stands.
   type :: clock_t
      real(wp) :: time = 0.0_wp      !< at its beginning, s
      real(wp) :: step = 0.0_wp      !< its length, s
      real(wp) :: remaining = 0.0_wp !< from where its velocities stand, in its middle, to the middle of the coarser level's step, s
      logical :: ends = .true.       !< when it ends, so does the step of the coarsest level
   end type clock_t

   real(wp), parameter :: seldom = 0.1_wp !< share of the steps: particles that come into a block more often undo what was done ahead

contains

   !> 1. Lists; 2. particles to nodes, blocks with remote neighbours first; 3. sums over blocks and ranks begin, while inner blocks
   !> work. Where there is a finer level, what it hands up is added first. Sums that other levels ask for are there on return, others
   !> are made where the nodes are solved.
   subroutine to_nodes(model, l, time)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l
      real(wp), intent(in) :: time !< of the level, s
      logical :: finest
      integer :: b
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
         call model%exchange(l)%start(model%communicator, level%gathered)
         do b = 1, size(level%blocks)
            if (.not. finest .or. level%blocks(b)%shared) cycle
            call gather(model, l, b, time)
            if (size(model%exchange(l)%ranks) == 0) cycle ! nothing is on its way
            call model%timers%enter(phase_exchange)
            call model%exchange(l)%progress(level%gathered)
         end do
         call model%timers%enter(phase_exchange)
         if (size(model%levels) > 1) call model%exchange(l)%wait(level%gathered)
         do b = 1, size(level%blocks)
            if (goes_to_levels(model, l, b)) call sum_nodes(model, l, b)
         end do
      end associate
      if (finest) return
      call model%timers%enter(model%levels_row)
      call clear_covered(model%levels(l), model%levels(l + 1))
   end subroutine to_nodes

   !> True when another level asks for the sums of the nodes of a block, or changes them, before they are solved.
   pure logical function goes_to_levels(model, l, b)
      type(model_t), intent(in) :: model
      integer, intent(in) :: l, b
      goes_to_levels = l < size(model%levels)
      if (l > 1) goes_to_levels = goes_to_levels .or. model%composite(l)%edge_of(b) > 0
   end function goes_to_levels

   !> The sums of all tiles that hold the nodes of a block, which are here.
   subroutine sum_nodes(model, l, b)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b
      if (is_idle(model, l, b)) return
      associate (level => model%levels(l))
         call level%fit_solved(b)
         call sum_tiles(level%blocks(b)%neighbour, level%gathered, level%solved(:, :, :, :, b), level%reach)
      end associate
   end subroutine sum_nodes

   !> True when a finer level hands up to a block.
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

   !> True when the nodes of a block matter where its particles do not reach: effects and other levels give to them or ask of them.
   pure logical function takes_more(model, l, b)
      type(model_t), intent(in) :: model
      integer, intent(in) :: l, b
      takes_more = model%effect_step(l)%works
      if (l < size(model%levels)) takes_more = takes_more .or. model%composite(l + 1)%receives(b)
      if (l > 1) takes_more = takes_more .or. model%composite(l)%edge_of(b) > 0
   end function takes_more

   !> Particles of one block, and the forces of effects on it, to its tile; before that its lists, where particles have changed bin,
   !> and the order of its particles, where that has come to differ from the lists'.
   subroutine gather(model, l, b, time)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b
      real(wp), intent(in) :: time
      logical :: given
      given = model%levels(l)%blocks(b)%tile_holds
      if (given) given = model%levels(l)%holds_whole(b) .or. .not. takes_more(model, l, b)
      if (.not. given) then
         call refresh_lists(model, l, b)
         associate (block => model%levels(l)%blocks(b))
            if (block%wants_sorting()) call block%sort(model%levels(l)%gradient)
         end associate
         call give(model, l, b)
      end if
      associate (level => model%levels(l), block => model%levels(l)%blocks(b), effects => model%effect_step(l))
         call block%take_averages()
         if (effects%works) call effects%give_forces(model%effects, level, b, time, model%timers)
         call fold_symmetry(level%grid, block%place, level%gathered(:, :, :, :, b), motion_parity)
         block%tile_holds = block%at_rest .and. .not. (effects%works .or. is_parent(model, l, b)) ! to whose tile a finer level adds
      end associate
   end subroutine gather

   !> At the end of a step, while the particles of a block are in the cache, and if it keeps them: what the histories will ask of it,
   !> its lists, and what it will give to its nodes at the beginning of the next step. The last not where others often come, nor where
   !> particles are about to be sorted: when that is done must not depend on what is done ahead.
   subroutine work_ahead(model, l, b, clock, error)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b
      type(clock_t), intent(in) :: clock
      type(error_t), intent(in) :: error
      associate (block => model%levels(l)%blocks(b))
         if (error%happened() .or. block%leaver_count > 0 .or. block%particles%count == 0) return
         if (model%wants_sums .and. clock%ends) then
            call model%timers%on_level(0) ! as all output
            call model%timers%enter(phase_output)
            call take_sums(model, l, b)
            call model%timers%on_level(l)
         end if
         if (block%visited > seldom .or. is_parent(model, l, b) .or. .not. model%works_ahead) return
         call refresh_lists(model, l, b)
         if (block%wants_sorting()) return
         call give(model, l, b)
         block%tile_holds = .true.
      end associate
   end subroutine work_ahead

   !> Lists and tiles of one block.
   subroutine refresh_lists(model, l, b)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b
      call model%timers%enter(phase_lists)
      call model%levels(l)%refresh_lists(b, takes_more(model, l, b))
   end subroutine refresh_lists

   !> What the particles of one block give, to its tile.
   subroutine give(model, l, b)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b
      call model%timers%enter(phase_to_nodes)
      associate (level => model%levels(l), block => model%levels(l)%blocks(b))
         if (level%layout%domain > 0) then
            call gather_corners_to_nodes(block%cells, block%particles%column, level%layout, frame_of(level, block), &
                                         level%gathered(:, :, :, :, b), level%reach(:, :, b))
         else
            call gather_to_nodes(block%cells, block%particles%column, level%layout, frame_of(level, block), &
                                 level%gathered(:, :, :, :, b), level%reach(:, :, b))
         end if
      end associate
   end subroutine give

   !> 3. ends: sums; velocities at the end of the step and accelerations of the nodes, inside the boundary conditions. Slaves follow
   !> the nodes of the coarser level. Blocks with remote neighbours come last: what these send may still be on its way.
   subroutine solve(model, l, clock)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l
      type(clock_t), intent(in) :: clock
      integer :: b
      do b = 1, size(model%levels(l)%blocks)
         if (.not. model%levels(l)%blocks(b)%shared) call solve_block(model, l, b, clock)
      end do
      call model%timers%enter(phase_exchange)
      call model%exchange(l)%wait(model%levels(l)%gathered)
      do b = 1, size(model%levels(l)%blocks)
         if (model%levels(l)%blocks(b)%shared) call solve_block(model, l, b, clock)
      end do
   end subroutine solve

   !> The nodes of one block.
   subroutine solve_block(model, l, b, clock)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b
      type(clock_t), intent(in) :: clock
      integer :: e
      if (is_idle(model, l, b)) return
      if (.not. goes_to_levels(model, l, b)) then
         call model%timers%enter(phase_exchange)
         call sum_nodes(model, l, b)
      end if
      call model%timers%enter(phase_nodes)
      e = 0
      if (l > 1) e = model%composite(l)%edge_of(b)
      call solve_nodes(model%levels(l)%solved(:, :, :, :, b), clock%step, model%levels(l)%reach(:, :, b))
      if (e > 0) call model%composite(l)%set_slaves(b, clock%remaining, model%levels(l)%solved(:, :, :, :, b))
      if (size(model%effect_step(l)%on_nodes) > 0 .and. clock%step > 0.0_wp) call push_nodes(model, l, b, clock)
      call constrain_nodes(model%levels(l)%grid, model%levels(l)%blocks(b)%place, model%levels(l)%solved(:, :, :, :, b))
   end subroutine solve_block

   !> Effects on the solved nodes of a block. What they add to the acceleration is kept where a finer level's two steps will ask for
   !> it.
   subroutine push_nodes(model, l, b, clock)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b
      type(clock_t), intent(in) :: clock
      integer, allocatable :: slave(:, :)
      real(wp), allocatable :: before(:, :, :, :)
      logical :: kept
      allocate (slave(4, 0))
      if (l > 1) then
         if (model%composite(l)%edge_of(b) > 0) slave = model%composite(l)%edges(model%composite(l)%edge_of(b))%slave
      end if
      kept = l < size(model%levels)
      if (kept) kept = model%composite(l + 1)%receives(b)
      if (kept) before = model%levels(l)%solved(5:7, :, :, :, b)
      call model%effect_step(l)%change_nodes(model%effects, model%levels(l), b, clock%time, clock%step, slave, model%timers)
      if (.not. kept) return
      associate (composite => model%composite(l + 1))
         if (.not. allocated(composite%pushed)) &
            allocate (composite%pushed(3, 0:tile_last, 0:tile_last, 0:tile_last, size(model%levels(l)%blocks)), source=0.0_wp)
         composite%pushed(:, :, :, :, b) = model%levels(l)%solved(5:7, :, :, :, b) - before
      end associate
   end subroutine push_nodes

   !> 5. Nodes to particles; 6. the stress, when it is its turn; 7. where the particles are now. Block by block, while its
   !> particles are in the cache.
   subroutine to_particles(model, l, clock, with_stress, error)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l
      type(clock_t), intent(in) :: clock
      logical, intent(in) :: with_stress
      type(error_t), intent(inout) :: error
      type(motion_t) :: motion
      integer :: b
      logical :: shares_cells
      shares_cells = with_stress .and. size(model%effect_step(l)%on_cells) > 0
      motion = motion_t(clock%step, model%method%flip_fraction, model%levels(l)%layout%position)
      if (model%levels(l)%layout%next_position > 0) motion%position = model%levels(l)%layout%next_position
      do b = 1, size(model%levels(l)%blocks)
         if (is_idle(model, l, b)) cycle
         if (model%effect_step(l)%works .and. model%levels(l)%blocks(b)%particles%count == 0) &
            call model%effect_step(l)%measure(model%levels(l), b, clock%step) ! a parent: on what is handed up
         if (stays_at_rest(model, l, b)) then
            model%particle_steps_at_rest = model%particle_steps_at_rest + model%levels(l)%blocks(b)%particles%count
            cycle
         end if
         if (model%effect_step(l)%works) then
            call model%timers%enter(phase_nodes)
            call model%effect_step(l)%measure(model%levels(l), b, clock%step)
         end if
         call scatter(model, l, b, motion, error)
         if (shares_cells) cycle
         if (with_stress) call update_stress(model, l, b, clock%step, error)
         if (model%levels(l)%layout%next_position == 0) call locate(model, l, b, error)
         if (with_stress) call work_ahead(model, l, b, clock, error)
      end do
      if (.not. shares_cells) return
      call sum_cells(model, l)
      do b = 1, size(model%levels(l)%blocks)
         call update_stress(model, l, b, clock%step, error)
         call locate(model, l, b, error)
         call work_ahead(model, l, b, clock, error)
      end do
   end subroutine to_particles

   !> True when the particles of a block are at rest and their nodes leave them so: nothing of the rest of the step would change
   !> a bit of them.
   logical function stays_at_rest(model, l, b) result(stays)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b
      associate (block => model%levels(l)%blocks(b))
         block%leaver_count = 0
         stays = block%particles%count == 0
         if (stays) return
         stays = block%at_rest .and. model%skip_at_rest .and. .not. model%effect_step(l)%acts_at_rest
         if (stays) stays = .not. any(abs(model%levels(l)%solved(2:7, :, :, :, b)) > 0.0_wp)
         if (.not. stays) then
            call block%stir()
            return
         end if
         model%bounds%wave_speed = max(model%bounds%wave_speed, block%wave_speed)
      end associate
   end function stays_at_rest

   !> The stress from the velocity of the nodes as they stand: velocity gradient only, no motion.
   subroutine strain(model, l, time_step, error)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l
      real(wp), intent(in) :: time_step
      type(error_t), intent(inout) :: error
      integer :: b
      do b = 1, size(model%levels(l)%blocks)
         if (stays_at_rest(model, l, b)) cycle
         call scatter(model, l, b, motion_t(0.0_wp, 1.0_wp, model%levels(l)%layout%position), error)
         if (size(model%effect_step(l)%on_cells) == 0) call update_stress(model, l, b, time_step, error)
      end do
      if (size(model%effect_step(l)%on_cells) == 0) return
      call sum_cells(model, l)
      do b = 1, size(model%levels(l)%blocks)
         call update_stress(model, l, b, time_step, error)
      end do
   end subroutine strain

   !> Where effects want means over the cells, which blocks share: the sums over blocks and ranks, in place of the nodes. The
   !> velocity gradients of all blocks wait for them.
   subroutine sum_cells(model, l)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l
      integer :: b
      call model%timers%enter(phase_exchange)
      call model%exchange(l)%start(model%communicator, model%levels(l)%gathered)
      call model%exchange(l)%wait(model%levels(l)%gathered)
      do b = 1, size(model%levels(l)%blocks)
         call sum_nodes(model, l, b)
      end do
   end subroutine sum_cells

   !> Nodes to the particles of one block. Affine transfer: the velocity gradient stays with them.
   subroutine scatter(model, l, b, motion, error)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b
      type(motion_t), intent(in) :: motion
      type(error_t), intent(inout) :: error
      type(longest_t) :: longest
      integer :: kept, n
      logical :: leads
      call model%timers%enter(phase_to_particles)
      call find_leads(model, l, b, motion%time_step, leads)
      longest%speed = huge(1.0_wp)
      if (motion%time_step > 0.0_wp) longest%speed = furthest_way*model%levels(l)%grid%cell/motion%time_step
      associate (level => model%levels(l), block => model%levels(l)%blocks(b), first => model%levels(l)%layout%gradient)
         if (level%layout%domain > 0) then
            call scatter_to_corners(block%cells, level%solved(:, :, :, :, b), level%layout, frame_of(level, block), motion, &
                                    block%particles%column, level%gradient, longest)
         else
            call scatter_to_particles(block%cells, level%solved(:, :, :, :, b), level%layout, frame_of(level, block), motion, &
                                      block%particles%column, level%gradient, longest)
         end if
         if (longest%particle > 0) call report_long_way(model, l, b, longest, motion%time_step, error)
         n = block%particles%count
         if (first > 0) block%particles%column(:n, first:first + 8) = level%gradient(:n, :)
         if (leads) call add_leads(level%at_edge, level%lead, block%particles%column(:, first:first + 8))
         if (size(model%effect_step(l)%on_cells) == 0) return
         call give_to_cells(n, block%cells%bin, block%particles%column, level%layout, frame_of(level, block), level%gradient, &
                            level%gathered(:, :, :, :, b))
         kept = level%layout%kept_gradient
         if (kept > 0) block%particles%column(:n, kept:kept + 8) = level%gradient(:n, :)
      end associate
   end subroutine scatter

   !> At the edge of a level: how far the gradients that particles keep are to be ahead of the motion (theory.md, eq. lead), into the
   !> work array, while particles are where the step began; which particles, into the level's list of those at edges.
   subroutine find_leads(model, l, b, time_step, leads)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b
      real(wp), intent(in) :: time_step
      logical, intent(out) :: leads
      real(wp) :: tile(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      type(motion_t) :: still
      logical :: on_edge, beside_edge, ahead(0:tile_last, 0:tile_last, 0:tile_last)
      leads = .false.
      if (.not. model%levels(l)%layout%labels_gradients() .or. model%levels(l)%blocks(b)%particles%count == 0) return
      on_edge = l > 1
      if (on_edge) on_edge = model%composite(l)%edge_of(b) > 0
      beside_edge = l < size(model%levels)
      if (beside_edge) beside_edge = model%composite(l + 1)%receives(b)
      if (.not. (on_edge .or. beside_edge)) return
      tile = 0.0_wp
      if (on_edge) call model%composite(l)%lead_slaves(b, time_step, model%levels(l)%blocks(b)%cells%reach(), tile)
      if (beside_edge) call model%composite(l + 1)%lead_masters(b, tile)
      still = motion_t(0.0_wp, 1.0_wp, model%levels(l)%layout%position)
      associate (level => model%levels(l), block => model%levels(l)%blocks(b))
         call constrain_nodes(level%grid, block%place, tile)
         ahead = abs(tile(2, :, :, :)) + abs(tile(3, :, :, :)) + abs(tile(4, :, :, :)) > 0.0_wp
         leads = any(ahead)
         if (.not. leads) return
         call level%at_edge%take_bins(block%cells, bins_at(ahead))
         if (level%layout%domain > 0) then
            call scatter_to_corners(level%at_edge, tile, level%layout, frame_of(level, block), still, &
                                    block%particles%column, level%lead)
         else
            call scatter_to_particles(level%at_edge, tile, level%layout, frame_of(level, block), still, &
                                      block%particles%column, level%lead)
         end if
      end associate
   end subroutine find_leads

   !> Add the leads of the listed particles to their gradients.
   pure subroutine add_leads(listed, lead, gradient)
      type(cell_list_t), intent(in) :: listed
      real(wp), intent(in), contiguous :: lead(:, :)
      real(wp), intent(inout), contiguous :: gradient(:, :) !< (:, 9), 1/s
      integer :: c, p
      associate (which => listed%order(:listed%first(size(listed%first)) - 1))
         do c = 1, 9
            do p = 1, size(which)
               gradient(which(p), c) = gradient(which(p), c) + lead(which(p), c)
            end do
         end do
      end associate
   end subroutine add_leads

   !> The velocity gradients of one block, which waited for the sums over cells, into the work array again.
   subroutine take_back(model, l, b)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b
      integer :: first, n
      first = model%levels(l)%layout%kept_gradient
      if (first == 0) first = model%levels(l)%layout%gradient
      n = model%levels(l)%blocks(b)%particles%count
      model%levels(l)%gradient(:n, :) = model%levels(l)%blocks(b)%particles%column(:n, first:first + 8)
   end subroutine take_back

   !> 6. Material law and volume of one block, with the velocity gradient that its particles have just been given.
   subroutine update_stress(model, l, b, time_step, error)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b
      real(wp), intent(in) :: time_step
      type(error_t), intent(inout) :: error
      real(wp) :: smallest
      integer :: first, last
      logical :: follows
      if (size(model%effect_step(l)%on_cells) > 0) call take_back(model, l, b)
      if (size(model%effect_step(l)%on_cells) + size(model%effect_step(l)%on_gradient) > 0) &
         call model%effect_step(l)%change_gradient(model%effects, model%levels(l), b, time_step, model%timers)
      call model%timers%enter(phase_stress)
      follows = l > 1 .and. model%levels(l)%layout%edge_stress > 0
      if (follows) call add_stress(model%levels(l)%blocks(b)%particles, model%levels(l)%layout, -1.0_wp)
      associate (level => model%levels(l), particles => model%levels(l)%blocks(b)%particles)
         first = 1
         do while (first <= particles%count)
            last = particles%run_end(first)
            call model%materials%slots(model%materials%of_body(particles%body(first)))%law%update(particles%column, &
                                                                     level%layout, level%gradient, time_step, first, last)
            first = last + 1
         end do
         if (follows) call add_stress(particles, level%layout, 1.0_wp)
         call advance_volume(particles%count, level%gradient, time_step, particles%column(:, level%layout%volume), smallest)
         if (.not. smallest > 0.0_wp) call report_inversion(model, l, b, error)
         if (.not. finite_stress(particles%count, particles%column(:, level%layout%stress:level%layout%stress + 5))) &
            call report_undefined(model, l, b, error)
         if (model%method%domain /= domain_fixed) call advance_domains(model, l, b, time_step, error)
      end associate
      if (size(model%effect_step(l)%on_stress) > 0) &
         call model%effect_step(l)%change_stress(model%effects, model%levels(l), b, time_step, model%timers)
   end subroutine update_stress

   !> Add a multiple of the stress to edge_stress: taken away before a step's law and added after it, this adds the change.
   pure subroutine add_stress(particles, at, factor)
      type(particle_store_t), intent(inout) :: particles
      type(layout_t), intent(in) :: at
      real(wp), intent(in) :: factor
      integer :: c, n
      n = particles%count
      do c = 0, 5
         particles%column(:n, at%edge_stress + c) = particles%column(:n, at%edge_stress + c) &
                                                    + factor*particles%column(:n, at%stress + c)
      end do
   end subroutine add_stress

   !> The domains of one block's particles follow their velocity gradients.
   subroutine advance_domains(model, l, b, time_step, error)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b
      real(wp), intent(in) :: time_step
      type(error_t), intent(inout) :: error
      real(wp) :: smallest
      associate (level => model%levels(l), particles => model%levels(l)%blocks(b)%particles, at => model%levels(l)%layout)
         if (at%domain > 0) then
            call advance_half_edges(particles%count, level%gradient, time_step, particles%column(:, at%domain:at%domain + 8))
         else
            call advance_half_sizes(particles%count, level%gradient, time_step, &
                                    particles%column(:, at%half_size:at%half_size + 2), smallest)
            if (.not. smallest > 0.0_wp) call fail(error, exit_numerical, particle_text(model, l, b, thinnest(particles, at))// &
               ' has a domain that became thinner than nothing; try a smaller safety', may_heal=.true.)
         end if
      end associate
   end subroutine advance_domains

   !> The particle with the smallest half size.
   pure integer function thinnest(particles, at)
      type(particle_store_t), intent(in) :: particles
      type(layout_t), intent(in) :: at
      associate (n => particles%count)
         thinnest = minloc(minval(particles%column(:n, at%half_size:at%half_size + 2), dim=2), dim=1)
         thinnest = max(thinnest, 1)
      end associate
   end function thinnest

   !> Particles of one block whose domains have become too long are split.
   subroutine split(model, l, b, error)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b
      type(error_t), intent(inout) :: error
      integer :: splits, worn_out
      associate (level => model%levels(l))
         call split_long(level%blocks(b), level%table, level%layout, level%grid%cell, splits, worn_out)
      end associate
      if (worn_out > 0) call fail(error, exit_numerical, particle_text(model, l, b, worn_out)//' has been split '// &
         to_text(most_generations)//' times and its domain is too long again: the motion is without bound; try a smaller safety', &
         may_heal=.true.)
      if (splits == 0) return
      model%splits = model%splits + splits
      call model%levels(l)%size_work()
   end subroutine split

   !> With musl the positions wait until the stress is done.
   subroutine take_next_position(model, l, error)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l
      type(error_t), intent(inout) :: error
      integer :: b, n, x, y
      x = model%levels(l)%layout%position
      y = model%levels(l)%layout%next_position
      do b = 1, size(model%levels(l)%blocks)
         associate (particles => model%levels(l)%blocks(b)%particles)
            n = particles%count
            particles%column(:n, x:x + 2) = particles%column(:n, y:y + 2)
         end associate
         call locate(model, l, b, error)
      end do
   end subroutine take_next_position

   !> 7. Particles that have become too long are split. Bins of one block's particles where they are now; particles that left the
   !> block, and those that left the grid; the largest speeds.
   subroutine locate(model, l, b, error)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b
      type(error_t), intent(inout) :: error
      logical :: moved
      call model%timers%enter(phase_lists)
      associate (level => model%levels(l), block => model%levels(l)%blocks(b), x => model%levels(l)%layout%position)
         block%leaver_count = 0
         block%at_rest = block%particles%count == 0
         if (block%at_rest) then
            block%lowest = huge(1.0_wp)
            block%highest = -huge(1.0_wp)
            return
         end if
         if (model%method%domain /= domain_fixed) call split(model, l, b, error)
         call locate_particles(block%particles%count, block%particles%column(:, x:x + 2), frame_of(level, block), &
                               block%cells%bin, block%leavers, block%leaver_count, moved, block%lowest, block%highest)
         if (moved) block%cells%current = .false.
         if (any(block%lowest < level%grid%lower) .or. any(block%highest > level%grid%upper)) &
            call report_outside(model, l, b, error)
         if (block%leaver_count > 0) call check_leavers(model, l, b, error)
         call include_speeds(model%bounds, model%materials, level%layout, block)
         block%at_rest = block%leaver_count == 0 .and. .not. moved .and. rests(block%particles, level%layout)
      end associate
   end subroutine locate

   !> True when no particle has a velocity, a velocity gradient or a stress.
   pure logical function rests(particles, at)
      type(particle_store_t), intent(in) :: particles
      type(layout_t), intent(in) :: at
      integer :: c, n
      rests = .false.
      n = particles%count
      do c = at%velocity, at%velocity + 2
         if (any(abs(particles%column(:n, c)) > 0.0_wp)) return
      end do
      do c = at%stress, at%stress + 5
         if (any(abs(particles%column(:n, c)) > 0.0_wp)) return
      end do
      if (at%viscous_pressure > 0) then
         if (any(abs(particles%column(:n, at%viscous_pressure)) > 0.0_wp)) return
      end if
      if (at%gradient > 0) then
         do c = at%gradient, at%gradient + 8
            if (any(abs(particles%column(:n, c)) > 0.0_wp)) return
         end do
      end if
      rests = .true.
   end function rests

   !> Collective: the largest speeds of the model as it stands.
   subroutine bound_speeds(model)
      type(model_t), intent(inout) :: model
      real(wp) :: bounds(2)
      integer :: b, l
      model%bounds = bounds_t()
      do l = 1, size(model%levels)
         do b = 1, size(model%levels(l)%blocks)
            call include_speeds(model%bounds, model%materials, model%levels(l)%layout, model%levels(l)%blocks(b))
         end do
      end do
      bounds = [model%bounds%wave_speed, model%bounds%particle_speed]
      call MPI_Allreduce(MPI_IN_PLACE, bounds, 2, MPI_DOUBLE_PRECISION, MPI_MAX, model%communicator%comm)
      model%bounds%wave_speed = bounds(1)
      model%bounds%particle_speed = bounds(2)
   end subroutine bound_speeds

   !> Wave speed of a block; raise the bounds to it and to the speed of its fastest particle.
   subroutine include_speeds(bounds, materials, at, block)
      type(bounds_t), intent(inout) :: bounds
      type(materials_t), intent(in) :: materials
      type(layout_t), intent(in) :: at
      type(block_t), intent(inout) :: block
      real(wp) :: speed_squared, specific_volume
      integer :: first, last, m
      block%wave_speed = 0.0_wp
      first = 1
      associate (particles => block%particles)
         do while (first <= particles%count)
            last = particles%run_end(first)
            call fastest(particles%column(:, at%velocity:at%velocity + 2), particles%column(:, at%mass), &
                         particles%column(:, at%volume), first, last, speed_squared, specific_volume)
            m = materials%of_body(particles%body(first))
            block%wave_speed = max(block%wave_speed, sqrt(materials%slots(m)%law%stiffest()*specific_volume))
            bounds%particle_speed = max(bounds%particle_speed, sqrt(speed_squared))
            first = last + 1
         end do
      end associate
      bounds%wave_speed = max(bounds%wave_speed, block%wave_speed)
   end subroutine include_speeds

end module m_level_step
