!> The stages of a step that act on the nodes of one level: P2G, the sums over nodes that blocks share, the
!> nodal solve (theory.md).
module m_grid_stages
   use m_kinds, only: wp
   use m_timers
   use m_node_values, only: tile_last, mass_, a_x, a_z
   use m_clock, only: clock_t
   use m_model, only: model_t
   use m_migration, only: frame_of
   use m_edge, only: clear_covered
   use m_p2g_boxes, only: clear
   use m_particle_transfer, only: p2g
   use m_node_exchange, only: sum_tiles
   use m_node_solve, only: solve_nodes
   use m_boundary, only: fold_symmetry, apply_boundary, has_boundary, motion_parity
   implicit none
   private
   public :: particles_to_grid, p2g_block, sum_shared_nodes, end_sums, solve_block, sum_cells, is_idle

contains

   !> P2G of all blocks of a level, those with remote neighbours first, so that the halo exchange overlaps
   !> with the others. If there is a finer level, its restricted values are added.
   subroutine particles_to_grid(model, l, time, time_step)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l
      real(wp), intent(in) :: time, time_step !< of the level, s
      logical :: finest
      integer :: b
      finest = l == size(model%levels)
      associate (level => model%levels(l))
         do b = 1, size(level%blocks)
            if (level%blocks(b)%shared .or. .not. finest) call begin_tile(model, l, b, time, time_step)
         end do
         if (.not. finest) then
            call model%timers%enter(model%levels_row)
            call model%composite(l + 1)%add_to_parents(level)
         end if
         call model%timers%enter(phase_exchange)
         call model%exchange(l)%start(level%nodes)
         level%sums_wait = .true.
         do b = 1, size(level%blocks)
            if (finest .and. .not. level%blocks(b)%shared) call begin_tile(model, l, b, time, time_step)
         end do
         call model%effect_step(l)%keep_masses(level)
      end associate
   end subroutine particles_to_grid

   !> Contributions of a block's particles and of effects to its nodes at the beginning of a step, to be
   !> replaced by sums.
   subroutine begin_tile(model, l, b, time, time_step)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b
      real(wp), intent(in) :: time, time_step !< of the level, s
      call p2g_block(model, l, b)
      associate (level => model%levels(l), block => model%levels(l)%blocks(b))
         call block%count_disorder()
         if (model%effect_step(l)%acts_on_nodes) &
            call model%effect_step(l)%add_body_forces(model%effects, level, b, time, time_step, &
                                                      model%timers)
         call fold_symmetry(level%grid, block%place, level%nodes(:, :, :, :, b), motion_parity)
         block%deposited = 0
      end associate
   end subroutine begin_tile

   !> P2G of one block: all particles that are not in its tile yet, in storage order.
   subroutine p2g_block(model, l, b)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b
      logical :: whole
      call model%timers%enter(phase_p2g)
      whole = needs_whole_tile(model, l, b)
      associate (level => model%levels(l), block => model%levels(l)%blocks(b), &
                 n => model%levels(l)%blocks(b)%particles%count)
         if (block%in_tile() == 0) then
            block%deposited = 0
            call level%update_extents(b, whole)
            call clear(level%nodes(:, :, :, :, b), level%extent(:, :, b))
         else
            call level%widen_extent(b, whole)
         end if
         if (block%has_resting_mass()) then
            call block%lay_resting_mass(level%grid%rows, level%nodes(:, :, :, :, b))
         else if (block%deposited < n) then
            call block%cells%go_through(block%deposited + 1, n)
            call p2g(block%cells, block%particles%column, level%layout, frame_of(level, block), &
                     level%nodes(:, :, :, :, b))
            call block%cells%go_through(1, n)
         end if
         block%deposited = n
         block%deposit_of = block%particles%generation
         call block%keep_resting_mass(level%nodes(:, :, :, :, b))
      end associate
   end subroutine p2g_block

   !> True when nodes of a block beyond the reach of its particles are needed: effects and other levels use
   !> them, and boundary conditions set them.
   pure logical function needs_whole_tile(model, l, b) result(whole)
      type(model_t), intent(in) :: model
      integer, intent(in) :: l, b
      whole = model%effect_step(l)%acts_on_nodes
      if (.not. whole .and. .not. is_idle(model, l, b)) whole = has_boundary(model%levels(l)%grid, &
            model%levels(l)%blocks(b)%place)
      whole = whole .or. model%composite(l + 1)%receives(b) .or. model%composite(l)%has_edge(b)
   end function needs_whole_tile

   !> True when the nodes of a block are not needed: it has no particles, is no parent, and restricts nothing.
   pure logical function is_idle(model, l, b)
      type(model_t), intent(in) :: model
      integer, intent(in) :: l, b
      is_idle = model%levels(l)%blocks(b)%particles%count == 0
      if (is_idle) is_idle = .not. (model%composite(l + 1)%is_parent(b) .or. model%composite(l)%has_edge(b))
   end function is_idle

   !> Sums over blocks and ranks of the nodes of one part of a level's blocks: 1, those without remote
   !> neighbours; 2, the others, after waiting for messages. The other part does not read the tiles of a part
   !> after its sums.
   subroutine sum_shared_nodes(model, l, part)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, part
      if (.not. model%levels(l)%sums_wait) return
      call model%timers%enter(phase_exchange)
      associate (level => model%levels(l), last => model%levels(l)%part_end)
         if (part == 2) call model%exchange(l)%wait(level%nodes)
         call sum_tiles(level%blocks, level%interior_first(last(part - 1) + 1:last(part)), level%nodes, &
                        level%extent)
      end associate
   end subroutine sum_shared_nodes

   !> Finish when both parts have their sums.
   subroutine end_sums(model, l)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l
      if (.not. model%levels(l)%sums_wait) return
      model%levels(l)%sums_wait = .false.
      if (l == size(model%levels)) return
      call model%timers%enter(model%levels_row)
      call clear_covered(model%levels(l), model%levels(l + 1))
   end subroutine end_sums

   !> Nodal solve of one block: velocities at the end of the step and accelerations, with boundary conditions.
   !> Constrained nodes follow those of the coarser level.
   subroutine solve_block(model, l, b, clock)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b
      type(clock_t), intent(in) :: clock
      if (is_idle(model, l, b)) return
      call model%timers%enter(phase_nodes)
      call solve_nodes(model%levels(l)%nodes(:, :, :, :, b), clock%step, model%levels(l)%extent(:, :, b))
      call model%composite(l)%set_constrained(b, clock%remaining, model%levels(l)%nodes(:, :, :, :, b))
      if (size(model%effect_step(l)%on_nodes) > 0 .and. clock%step > 0.0_wp) &
         call change_nodes(model, l, b, clock)
      call apply_boundary(model%levels(l)%grid, model%levels(l)%blocks(b)%place, &
                          model%levels(l)%nodes(:, :, :, :, b))
   end subroutine solve_block

   !> Apply effects to the solved nodes of a block. Their acceleration is stored if a finer level's two steps
   !> need it; also for nodes without mass, as the finer level's particles may reach them in the second step.
   subroutine change_nodes(model, l, b, clock)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b
      type(clock_t), intent(in) :: clock
      real(wp), allocatable :: before(:, :, :, :)
      logical :: bare(0:tile_last, 0:tile_last, 0:tile_last), kept
      integer :: q
      kept = model%composite(l + 1)%receives(b)
      associate (nodes => model%levels(l)%nodes(:, :, :, :, b))
         if (kept) then
            before = nodes(a_x:a_z, :, :, :)
            bare = .not. nodes(mass_, :, :, :) > 0.0_wp
            where (bare) nodes(mass_, :, :, :) = tiny(1.0_wp)
         end if
         call model%effect_step(l)%change_nodes(model%effects, model%levels(l), b, clock%time, clock%step, &
                                                model%composite(l)%constrained(b), model%timers)
         if (.not. kept) return
         call model%composite(l + 1)%keep_nodal_force(b, nodes(a_x:a_z, :, :, :) - before)
         do q = mass_, a_z
            where (bare) nodes(q, :, :, :) = 0.0_wp
         end do
      end associate
   end subroutine change_nodes

   !> For effects that need means over the cells, which blocks share: the sums over blocks and ranks, stored
   !> in place of the nodes.
   subroutine sum_cells(model, l)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l
      integer :: b
      call model%timers%enter(phase_exchange)
      associate (level => model%levels(l))
         do b = 1, size(level%blocks) ! parents without particles still hold restricted values of nodes
            if (level%blocks(b)%particles%count == 0) &
               call clear(level%nodes(:, :, :, :, b), level%extent(:, :, b))
         end do
         call model%exchange(l)%start(level%nodes)
         call model%exchange(l)%wait(level%nodes)
         call sum_tiles(level%blocks, level%interior_first, level%nodes, level%extent)
      end associate
   end subroutine sum_cells

end module m_grid_stages
