!> The particles' part of a step of one level, numbered as in theory.md: their motion, stress, where they are, and what they do
!> ahead.
module m_particle_step
   use m_kinds, only: wp
   use m_constants, only: exit_numerical
   use m_errors, only: error_t, fail
   use m_text, only: to_text
   use m_timers
   use m_node_values, only: node_values, tile_last, v_x, v_z, a_z
   use m_scene, only: domain_fixed, update_usl
   use m_field_table, only: layout_t
   use m_particle_store, only: particle_store_t
   use m_cell_list, only: cell_list_t, bins_at
   use m_model, only: model_t
   use m_migration, only: frame_of
   use m_complaints, only: particle_text, check_emigrants, report_outside, report_inversion, report_too_fast, report_undefined, &
                           most_cells_a_step
   use m_cell_mean, only: give_to_cells
   use m_g2p_boxes, only: motion_t, fastest_t
   use m_particle_transfer, only: g2p
   use m_split, only: split_long, most_generations
   use m_boundary, only: apply_boundary
   use m_deform, only: advance_volume, advance_half_sizes, advance_half_edges, finite_stress
   use m_locate, only: locate_particles
   use m_energy, only: take_sums
   use m_node_step, only: clock_t, sum_part, solve_block, look_after_messages, sum_cells, set_order, p2g_ahead, is_idle
   use m_speed_bounds, only: include_speeds
   implicit none
   private
   public :: to_particles, strain, take_next_position, pack_emigrants, prepare_next_p2g

contains

   !> 5. Nodes to particles; 6. the stress, when it is its turn; 7. where the particles are now. Block by block, while its
   !> particles and nodes are in the cache: where nobody has asked for the motion of all nodes, those of a block are solved only
   !> now, and while inner blocks do all of this what other ranks send is on its way.
   subroutine to_particles(model, l, clock, with_stress, solved, error)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l
      type(clock_t), intent(in) :: clock
      logical, intent(in) :: with_stress
      logical, intent(in) :: solved !< all nodes are
      type(error_t), intent(inout) :: error
      type(motion_t) :: motion
      integer :: b, n, part
      logical :: shares_cells
      call model%migration(l)%prepare(model%communicator, model%levels(l))
      shares_cells = with_stress .and. size(model%effect_step(l)%on_cells) > 0
      motion = motion_t(clock%step, model%method%flip_fraction, model%levels(l)%layout%position)
      motion%unseen = model%unseen
      motion%heat = model%levels(l)%layout%unseen_heat
      if (model%levels(l)%layout%next_position > 0) motion%position = model%levels(l)%layout%next_position
      do part = 1, 2
         if (.not. solved) call sum_part(model, l, part)
         do n = model%levels(l)%part_end(part - 1) + 1, model%levels(l)%part_end(part)
            b = model%levels(l)%interior_first(n)
            if (.not. solved) call solve_block(model, l, b, clock)
            if (is_idle(model, l, b)) cycle
            if (model%effect_step(l)%acts_on_nodes .and. model%levels(l)%blocks(b)%particles%count == 0) &
               call model%effect_step(l)%measure(model%levels(l), b, clock%step) ! a parent: on what is restricted up
            if (stays_at_rest(model, l, b)) then
               model%particle_steps_at_rest = model%particle_steps_at_rest + model%levels(l)%blocks(b)%particles%count
               cycle
            end if
            if (model%effect_step(l)%acts_on_nodes) then
               call model%timers%enter(phase_nodes)
               call model%effect_step(l)%measure(model%levels(l), b, clock%step)
            end if
            call scatter(model, l, b, motion, clock%time, error)
            if (shares_cells) cycle
            if (with_stress) call update_stress(model, l, b, clock%step, error)
            if (with_stress) call follow_loads(model, l, b, motion, clock%time)
            if (model%levels(l)%layout%next_position == 0) then
               call locate(model, l, b, error)
               call prepare_next_p2g(model, l, b, clock, with_stress, error)
            end if
            if (part == 1 .and. .not. solved) call look_after_messages(model, l)
         end do
      end do
      if (.not. shares_cells) return
      call sum_cells(model, l)
      do b = 1, size(model%levels(l)%blocks)
         call update_stress(model, l, b, clock%step, error)
         call follow_loads(model, l, b, motion, clock%time)
         call locate(model, l, b, error)
         call prepare_next_p2g(model, l, b, clock, with_stress, error)
      end do
   end subroutine to_particles

   !> True when the particles of a block are at rest and their nodes leave them so: nothing of the rest of the step would change
   !> a bit of them.
   logical function stays_at_rest(model, l, b) result(stays)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b
      associate (block => model%levels(l)%blocks(b))
         block%emigrant_count = 0
         stays = block%particles%count == 0
         if (stays) return
         stays = block%at_rest .and. model%skip_at_rest .and. .not. model%effect_step(l)%acts_at_rest
         if (stays) stays = .not. any_moves(model%levels(l)%nodes(:, :, :, :, b), block%cells%extent())
         if (.not. stays) then
            call block%invalidate()
            return
         end if
         model%bounds%wave_speed = max(model%bounds%wave_speed, block%wave_speed)
      end associate
   end function stays_at_rest

   !> True when a node within what the particles of a block extent has a velocity or an acceleration.
   pure logical function any_moves(tile, extent)
      real(wp), intent(in) :: tile(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      integer, intent(in) :: extent(2, 3)
      associate (a => extent(1, :), z => extent(2, :))
         any_moves = any(abs(tile(v_x:a_z, a(1):z(1), a(2):z(2), a(3):z(3))) > 0.0_wp)
      end associate
   end function any_moves

   !> The stress from the velocity of the nodes as they stand: velocity gradient only, no motion.
   subroutine strain(model, l, time_step, error)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l
      real(wp), intent(in) :: time_step
      type(error_t), intent(inout) :: error
      integer :: b
      do b = 1, size(model%levels(l)%blocks)
         if (stays_at_rest(model, l, b)) cycle
         call scatter(model, l, b, motion_t(0.0_wp, 1.0_wp, model%levels(l)%layout%position), model%time, error)
         if (size(model%effect_step(l)%on_cells) == 0) call update_stress(model, l, b, time_step, error)
      end do
      if (size(model%effect_step(l)%on_cells) == 0) return
      call sum_cells(model, l)
      do b = 1, size(model%levels(l)%blocks)
         call update_stress(model, l, b, time_step, error)
      end do
   end subroutine strain

   !> Nodes to the particles of one block. Affine transfer: the velocity gradient stays with them.
   subroutine scatter(model, l, b, motion, time, error)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b
      type(motion_t), intent(in) :: motion
      real(wp), intent(in) :: time !< of the level, s
      type(error_t), intent(inout) :: error
      type(fastest_t) :: fastest
      integer :: kept, n
      logical :: leads
      call model%timers%enter(phase_g2p)
      call find_leads(model, l, b, motion%time_step, leads)
      fastest%speed = huge(1.0_wp)
      if (motion%time_step > 0.0_wp) fastest%speed = most_cells_a_step*model%levels(l)%grid%cell/motion%time_step
      associate (level => model%levels(l), block => model%levels(l)%blocks(b), first => model%levels(l)%layout%gradient)
         if (motion%time_step > 0.0_wp .and. model%effect_step(l)%is_loaded(b)) &
            call model%effect_step(l)%mark(model%effects, level, b)
         call g2p(block%cells, level%nodes(:, :, :, :, b), level%layout, frame_of(level, block), motion, &
                                 block%particles%column, level%gradient, fastest)
         if (block%arrived > 0) then
            call level%list_arrivals(b)
            call g2p(level%arrivals, level%nodes(:, :, :, :, b), level%layout, frame_of(level, block), motion, &
                                    block%particles%column, level%gradient, fastest)
         end if
         if (fastest%particle > 0) call report_too_fast(model, l, b, fastest, motion%time_step, error)
         if (motion%time_step > 0.0_wp .and. model%method%stress_update /= update_usl) call follow_loads(model, l, b, motion, time)
         n = block%particles%count
         if (first > 0) block%particles%column(:n, first:first + 8) = level%gradient(:n, :)
         if (leads) call add_leads(level%at_edge, level%lead, block%particles%column(:, first:first + 8))
         if (size(model%effect_step(l)%on_cells) == 0) return
         call give_to_cells(n, block%cells%bin, block%particles%column, level%layout, frame_of(level, block), level%gradient, &
                            level%nodes(:, :, :, :, b))
         kept = level%layout%kept_gradient
         if (kept > 0) block%particles%column(:n, kept:kept + 8) = level%gradient(:n, :)
      end associate
   end subroutine scatter

   !> The work of loads by the motion that a block's particles have just made (theory.md, eq. particle-work), with the gradient that
   !> their domains follow: that of the work array after the stress; where the stress has a solve of its own, which has not met the
   !> tools, that which is kept of it, and if none is, tools are not followed.
   subroutine follow_loads(model, l, b, motion, time)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b
      type(motion_t), intent(in) :: motion
      real(wp), intent(in) :: time !< of the level, s
      associate (at => model%levels(l)%layout)
         if (model%method%stress_update == update_usl .or. at%gradient == 0) then
            call follow_with(model%levels(l)%gradient)
         else
            call follow_with(model%levels(l)%blocks(b)%particles%column(:, at%gradient:at%gradient + 8))
         end if
      end associate
   contains
      subroutine follow_with(gradient)
         real(wp), intent(in), contiguous :: gradient(:, :)
         if (model%effect_step(l)%is_loaded(b)) call model%effect_step(l)%follow(model%effects, model%levels(l), b, gradient, &
                                                                         motion%position, time, motion%time_step)
         if (model%contact%followed .and. l == size(model%levels)) &
            call model%contact%follow(model%levels(l), b, gradient, motion%position, motion%time_step)
      end subroutine follow_with
   end subroutine follow_loads

   !> At the edge of a level: how far the gradients that particles keep are to be ahead of the motion (theory.md, eq. lead), into
   !> the work array, while particles are where the step began; which particles, into the level's list of those at edges.
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
      if (on_edge) call model%composite(l)%lead_constrained(b, time_step, model%levels(l)%blocks(b)%cells%extent(), tile)
      if (beside_edge) call model%composite(l + 1)%lead_parents(b, tile)
      still = motion_t(0.0_wp, 1.0_wp, model%levels(l)%layout%position)
      associate (level => model%levels(l), block => model%levels(l)%blocks(b))
         call apply_boundary(level%grid, block%place, tile)
         ahead = abs(tile(v_x, :, :, :)) + abs(tile(v_x + 1, :, :, :)) + abs(tile(v_z, :, :, :)) > 0.0_wp
         leads = any(ahead)
         if (.not. leads) return
         call level%at_edge%take_bins(block%cells, bins_at(ahead))
         call g2p(level%at_edge, tile, level%layout, frame_of(level, block), still, &
                                 block%particles%column, level%lead)
      end associate
   end subroutine find_leads

   !> Add the leads of the listed particles to their gradients.
   pure subroutine add_leads(listed, lead, gradient)
      type(cell_list_t), intent(in) :: listed
      real(wp), intent(in), contiguous :: lead(:, :)
      real(wp), intent(inout), contiguous :: gradient(:, :) !< (:, 9), 1/s
      integer :: c, p
      associate (which => listed%order(:listed%count))
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
               ' has a domain that became thinner than nothing; try a smaller safety', recoverable=.true.)
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
         call split_long(level%blocks(b), level%table, level%layout, level%grid%cell, model%stuff, splits, worn_out)
      end associate
      if (worn_out > 0) call fail(error, exit_numerical, particle_text(model, l, b, worn_out)//' has been split '// &
         to_text(most_generations)//' times and its domain is too long again: the motion is without bound; try a smaller safety', &
         recoverable=.true.)
      if (splits == 0) return
      model%splits = model%splits + splits
      call model%levels(l)%size_work()
   end subroutine split

   !> With musl the positions wait until the stress is done.
   subroutine take_next_position(model, l, clock, error)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l
      type(clock_t), intent(in) :: clock
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
         call prepare_next_p2g(model, l, b, clock, .false., error)
      end do
   end subroutine take_next_position

   !> 7. Particles that have become too long are split. Bins of one block's particles where they are now; particles that left the
   !> block, and those that left the grid; the largest speeds. Leavers go on their way.
   subroutine locate(model, l, b, error)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b
      type(error_t), intent(inout) :: error
      logical :: moved
      call model%timers%enter(phase_lists)
      associate (level => model%levels(l), block => model%levels(l)%blocks(b), x => model%levels(l)%layout%position)
         block%emigrant_count = 0
         block%at_rest = block%particles%count == 0
         if (block%at_rest) then
            block%lowest = huge(1.0_wp)
            block%highest = -huge(1.0_wp)
            return
         end if
         if (model%contact%active() .and. l == size(model%levels)) call model%contact%candidates%settle(level, b)
         if (model%method%domain /= domain_fixed) call split(model, l, b, error)
         call locate_particles(block%particles%count, block%particles%column(:, x:x + 2), frame_of(level, block), &
                               block%cells%bin, block%emigrants, block%emigrant_count, moved, block%lowest, block%highest)
         if (moved .or. block%arrived > 0 .or. block%cells%joined) block%cells%current = .false.
         block%arrived = 0
         if (any(block%lowest < level%grid%lower) .or. any(block%highest > level%grid%upper)) &
            call report_outside(model, l, b, error)
         if (block%emigrant_count > 0) call check_emigrants(model, l, b, error)
         if (model%follows_speeds) call include_speeds(model%bounds, model%materials, level%layout, block)
         block%at_rest = block%emigrant_count == 0 .and. .not. moved .and. rests(block%particles, level%layout)
      end associate
      if (.not. error%happened()) call pack_emigrants(model, l, b)
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

   !> At the end of a step: the particles that have left a block go on their way, if there are blocks where they are.
   subroutine pack_emigrants(model, l, b)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b
      if (model%levels(l)%blocks(b)%emigrant_count == 0) return
      call model%timers%enter(phase_migration)
      call model%migration(l)%pack_emigrants(model%communicator, model%levels(l), b)
   end subroutine pack_emigrants

   !> At the end of a step, while the particles of a block that its emigrants have left are in the cache: they are put in order,
   !> whether or not anything is done ahead, for the order decides that of later sums; what the histories will ask of it; and what
   !> it will give to its nodes at the beginning of the next step, but for what will arrive.
   subroutine prepare_next_p2g(model, l, b, clock, with_stress, error)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b
      type(clock_t), intent(in) :: clock
      logical, intent(in) :: with_stress !< they have the stress of the end of the step
      type(error_t), intent(in) :: error
      associate (block => model%levels(l)%blocks(b))
         if (error%happened() .or. block%emigrant_count > 0 .or. block%particles%count == 0) return
      end associate
      call set_order(model, l, b)
      if (.not. with_stress) return
      if (model%wants_sums .and. clock%ends) then
         call model%timers%on_level(0) ! as all output
         call model%timers%enter(phase_output)
         call take_sums(model, l, b)
         call model%timers%on_level(l)
      end if
      call p2g_ahead(model, l, b)
   end subroutine prepare_next_p2g

end module m_particle_step
