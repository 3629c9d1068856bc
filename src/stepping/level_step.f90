!> One step on one level, numbered as in theory.md.
module m_level_step
   use mpi_f08
   use m_kinds, only: wp
   use m_constants, only: exit_numerical
   use m_errors, only: error_t, fail
   use m_text, only: to_text
   use m_timers
   use m_scene, only: update_usl, update_usf, update_musl, domain_fixed
   use m_field_table, only: layout_t
   use m_particle_store, only: particle_store_t
   use m_block, only: block_t
   use m_materials, only: materials_t
   use m_model, only: model_t, bounds_t
   use m_migration, only: frame_of, entered
   use m_particle_to_node, only: gather_to_nodes
   use m_cell_mean, only: give_to_cells
   use m_node_to_particle, only: scatter_to_particles, motion_t
   use m_corner_to_node, only: gather_corners_to_nodes
   use m_corner_to_particle, only: scatter_to_corners
   use m_split, only: split_long, most_generations
   use m_node_exchange, only: sum_tiles
   use m_node_solve, only: solve_nodes
   use m_boundary, only: fold_symmetry, constrain_nodes
   use m_deform, only: advance_volume, advance_half_sizes, advance_half_edges, fastest
   use m_locate, only: locate_particles
   implicit none
   private
   public :: advance, bound_speeds

contains

   !> Collective: advance the model by one step.
   subroutine advance(model, time_step, error)
      type(model_t), intent(inout) :: model
      real(wp), intent(in) :: time_step !< s
      type(error_t), intent(inout) :: error
      integer :: update
      logical :: new_blocks
      update = model%method%stress_update
      model%bounds = bounds_t()
      if (update == update_usf) then
         call to_nodes(model)
         call solve(model, 0.0_wp)
         call strain(model, time_step, error)                          ! 6, first
      end if
      call to_nodes(model)                                             ! 1, 2, 3
      call solve(model, time_step)
      if (model%contact%active()) then                                 ! 4
         call model%timers%enter(phase_contact)
         call model%contact%push(model%communicator, model%level, model%materials, model%exchange%ranks, model%time, &
                                 time_step, error)
      end if
      call to_particles(model, time_step, with_stress=update == update_usl, error=error) ! 5, 6, 7
      if (update == update_musl) then
         call to_nodes(model)
         call solve(model, 0.0_wp)
         call strain(model, time_step, error)                          ! 6, last
         call take_next_position(model, error)                         ! 7, late
      end if
      call agree(model, new_blocks, error)
      if (error%happened()) return
      call model%timers%enter(phase_migration)
      if (new_blocks) call model%create_blocks()
      call model%migration%move_leavers(model%communicator, model%level, model%exchange%ranks)
      call model%timers%leave()
      model%time = model%time + time_step
      model%step = model%step + 1
      model%particle_steps = model%particle_steps + model%level%particle_count()
   end subroutine advance

   !> 1. Lists; 2. particles to nodes, blocks with remote neighbours first; 3. sums over blocks and ranks, while inner blocks work.
   subroutine to_nodes(model)
      type(model_t), intent(inout) :: model
      integer :: b
      do b = 1, size(model%level%blocks)
         if (model%level%blocks(b)%shared) call gather(model, b)
      end do
      call model%timers%enter(phase_exchange)
      call model%exchange%start(model%communicator, model%level%gathered)
      do b = 1, size(model%level%blocks)
         if (.not. model%level%blocks(b)%shared) call gather(model, b)
      end do
      call model%timers%enter(phase_exchange)
      call model%exchange%wait(model%level%gathered)
      do b = 1, size(model%level%blocks)
         call sum_tiles(model%level%blocks(b)%neighbour, model%level%gathered, model%level%solved(:, :, :, :, b))
      end do
   end subroutine to_nodes

   !> Particles of one block to its tile; before that its lists, where particles have changed bin.
   subroutine gather(model, b)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: b
      if (model%level%blocks(b)%tile_holds .and. .not. model%effect_step%works) return
      call model%timers%enter(phase_lists)
      call model%level%blocks(b)%refresh_lists(model%level%work)
      call model%timers%enter(phase_to_nodes)
      associate (level => model%level, block => model%level%blocks(b))
         if (level%layout%domain > 0) then
            call gather_corners_to_nodes(block%cells, block%particles%column, level%layout, frame_of(level, block), &
                                         level%gathered(:, :, :, :, b))
         else
            call gather_to_nodes(block%cells, block%particles%column, level%layout, frame_of(level, block), &
                                 level%gathered(:, :, :, :, b))
         end if
         if (model%effect_step%works) call model%effect_step%give_forces(model%effects, level, b, model%time, model%timers)
         call fold_symmetry(level%grid, block%place, level%gathered(:, :, :, :, b))
         block%tile_holds = block%at_rest
      end associate
   end subroutine gather

   !> Velocities at the end of the step and accelerations of the nodes, inside the boundary conditions.
   subroutine solve(model, time_step)
      type(model_t), intent(inout) :: model
      real(wp), intent(in) :: time_step
      integer :: b
      call model%timers%enter(phase_nodes)
      do b = 1, size(model%level%blocks)
         call solve_nodes(model%level%solved(:, :, :, :, b), time_step)
         if (size(model%effect_step%on_nodes) > 0 .and. time_step > 0.0_wp) &
            call model%effect_step%change_nodes(model%effects, model%level, b, model%time, time_step, model%timers)
         call constrain_nodes(model%level%grid, model%level%blocks(b)%place, model%level%solved(:, :, :, :, b))
      end do
   end subroutine solve

   !> 5. Nodes to particles; 6. the stress, when it is its turn; 7. where the particles are now. Block by block, while its
   !> particles are in the cache.
   subroutine to_particles(model, time_step, with_stress, error)
      type(model_t), intent(inout) :: model
      real(wp), intent(in) :: time_step
      logical, intent(in) :: with_stress
      type(error_t), intent(inout) :: error
      type(motion_t) :: motion
      integer :: b
      logical :: shares_cells
      shares_cells = with_stress .and. size(model%effect_step%on_cells) > 0
      motion = motion_t(time_step, model%method%flip_fraction, model%level%layout%position)
      if (model%level%layout%next_position > 0) motion%position = model%level%layout%next_position
      do b = 1, size(model%level%blocks)
         if (stays_at_rest(model, b)) then
            model%particle_steps_at_rest = model%particle_steps_at_rest + model%level%blocks(b)%particles%count
            cycle
         end if
         if (model%effect_step%works) then
            call model%timers%enter(phase_nodes)
            call model%effect_step%measure(model%level, b, time_step)
         end if
         call scatter(model, b, motion)
         if (shares_cells) cycle
         if (with_stress) call update_stress(model, b, time_step, error)
         if (model%level%layout%next_position == 0) call locate(model, b, error)
      end do
      if (.not. shares_cells) return
      call sum_cells(model)
      do b = 1, size(model%level%blocks)
         call update_stress(model, b, time_step, error)
         call locate(model, b, error)
      end do
   end subroutine to_particles

   !> True when the particles of a block are at rest and their nodes leave them so: nothing of the rest of the step would change
   !> a bit of them.
   logical function stays_at_rest(model, b) result(stays)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: b
      associate (block => model%level%blocks(b))
         stays = block%at_rest .and. model%skip_at_rest .and. .not. model%effect_step%acts_at_rest
         if (stays) stays = .not. any(abs(model%level%solved(2:7, :, :, :, b)) > 0.0_wp)
         if (.not. stays) then
            block%at_rest = .false.
            block%tile_holds = .false.
            return
         end if
         block%leaver_count = 0
         model%bounds%wave_speed = max(model%bounds%wave_speed, block%wave_speed)
      end associate
   end function stays_at_rest

   !> The stress from the velocity of the nodes as they stand: velocity gradient only, no motion.
   subroutine strain(model, time_step, error)
      type(model_t), intent(inout) :: model
      real(wp), intent(in) :: time_step
      type(error_t), intent(inout) :: error
      integer :: b
      do b = 1, size(model%level%blocks)
         if (stays_at_rest(model, b)) cycle
         call scatter(model, b, motion_t(0.0_wp, 1.0_wp, model%level%layout%position))
         if (size(model%effect_step%on_cells) == 0) call update_stress(model, b, time_step, error)
      end do
      if (size(model%effect_step%on_cells) == 0) return
      call sum_cells(model)
      do b = 1, size(model%level%blocks)
         call update_stress(model, b, time_step, error)
      end do
   end subroutine strain

   !> Where effects want means over the cells, which blocks share: the sums over blocks and ranks, in place of the nodes. The
   !> velocity gradients of all blocks wait for them.
   subroutine sum_cells(model)
      type(model_t), intent(inout) :: model
      integer :: b
      call model%timers%enter(phase_exchange)
      call model%exchange%start(model%communicator, model%level%gathered)
      call model%exchange%wait(model%level%gathered)
      do b = 1, size(model%level%blocks)
         call sum_tiles(model%level%blocks(b)%neighbour, model%level%gathered, model%level%solved(:, :, :, :, b))
      end do
   end subroutine sum_cells

   !> Nodes to the particles of one block. Affine transfer: the velocity gradient stays with them.
   subroutine scatter(model, b, motion)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: b
      type(motion_t), intent(in) :: motion
      integer :: n
      call model%timers%enter(phase_to_particles)
      associate (level => model%level, block => model%level%blocks(b), first => model%level%layout%gradient)
         if (level%layout%domain > 0) then
            call scatter_to_corners(block%cells, level%solved(:, :, :, :, b), level%layout, frame_of(level, block), motion, &
                                    block%particles%column, level%gradient)
         else
            call scatter_to_particles(block%cells, level%solved(:, :, :, :, b), level%layout, frame_of(level, block), motion, &
                                      block%particles%column, level%gradient)
         end if
         n = block%particles%count
         if (first > 0) block%particles%column(:n, first:first + 8) = level%gradient(:n, :)
         if (size(model%effect_step%on_cells) == 0) return
         call give_to_cells(n, block%cells%bin, block%particles%column, level%layout, frame_of(level, block), level%gradient, &
                            level%gathered(:, :, :, :, b))
         if (first == 0) block%particles%column(:n, level%layout%kept_gradient:level%layout%kept_gradient + 8) = &
            level%gradient(:n, :)
      end associate
   end subroutine scatter

   !> The velocity gradients of one block, which waited for the sums over cells, into the work array again.
   subroutine take_back(model, b)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: b
      integer :: first, n
      first = max(model%level%layout%gradient, model%level%layout%kept_gradient)
      n = model%level%blocks(b)%particles%count
      model%level%gradient(:n, :) = model%level%blocks(b)%particles%column(:n, first:first + 8)
   end subroutine take_back

   !> 6. Material law and volume of one block, with the velocity gradient that its particles have just been given.
   subroutine update_stress(model, b, time_step, error)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: b
      real(wp), intent(in) :: time_step
      type(error_t), intent(inout) :: error
      real(wp) :: smallest
      integer :: first, last
      if (size(model%effect_step%on_cells) > 0) call take_back(model, b)
      if (size(model%effect_step%on_cells) + size(model%effect_step%on_gradient) > 0) &
         call model%effect_step%change_gradient(model%effects, model%level, b, time_step, model%timers)
      call model%timers%enter(phase_stress)
      associate (level => model%level, particles => model%level%blocks(b)%particles)
         first = 1
         do while (first <= particles%count)
            last = particles%run_end(first)
            call model%materials%slots(model%materials%of_body(particles%body(first)))%law%update(particles%column, &
                                                                     level%layout, level%gradient, time_step, first, last)
            first = last + 1
         end do
         call advance_volume(particles%count, level%gradient, time_step, particles%column(:, level%layout%volume), smallest)
         if (.not. smallest > 0.0_wp) call report_inversion(model, b, error)
         if (model%method%domain /= domain_fixed) call advance_domains(model, b, time_step, error)
      end associate
      if (size(model%effect_step%on_stress) > 0) &
         call model%effect_step%change_stress(model%effects, model%level, b, time_step, model%timers)
   end subroutine update_stress

   !> The domains of one block's particles follow their velocity gradients.
   subroutine advance_domains(model, b, time_step, error)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: b
      real(wp), intent(in) :: time_step
      type(error_t), intent(inout) :: error
      real(wp) :: smallest
      associate (level => model%level, particles => model%level%blocks(b)%particles, at => model%level%layout)
         if (at%domain > 0) then
            call advance_half_edges(particles%count, level%gradient, time_step, particles%column(:, at%domain:at%domain + 8))
         else
            call advance_half_sizes(particles%count, level%gradient, time_step, &
                                    particles%column(:, at%half_size:at%half_size + 2), smallest)
            if (.not. smallest > 0.0_wp) call fail(error, exit_numerical, 'step '//to_text(model%step + 1)//', time '// &
               to_text(model%time)//' s: the domain of a particle became thinner than nothing; try a smaller safety')
         end if
      end associate
   end subroutine advance_domains

   !> Particles of one block whose domains have become too long are split.
   subroutine split(model, b, error)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: b
      type(error_t), intent(inout) :: error
      integer :: splits, worn_out
      call split_long(model%level%blocks(b), model%level%table, model%level%layout, model%level%grid%cell, splits, worn_out)
      if (worn_out > 0) call fail(error, exit_numerical, particle_text(model, b, worn_out)//' has been split '// &
         to_text(most_generations)//' times and its domain is too long again: the motion is without bound; try a smaller safety')
      if (splits == 0) return
      model%splits = model%splits + splits
      call model%level%size_work()
   end subroutine split

   !> With musl the positions wait until the stress is done.
   subroutine take_next_position(model, error)
      type(model_t), intent(inout) :: model
      type(error_t), intent(inout) :: error
      integer :: b, n, x, y
      x = model%level%layout%position
      y = model%level%layout%next_position
      do b = 1, size(model%level%blocks)
         associate (particles => model%level%blocks(b)%particles)
            n = particles%count
            particles%column(:n, x:x + 2) = particles%column(:n, y:y + 2)
         end associate
         call locate(model, b, error)
      end do
   end subroutine take_next_position

   !> 7. Particles that have become too long are split. Bins of one block's particles where they are now; particles that left the
   !> block, and those that left the grid; the largest speeds.
   subroutine locate(model, b, error)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: b
      type(error_t), intent(inout) :: error
      real(wp) :: lowest(3), highest(3)
      logical :: moved
      call model%timers%enter(phase_lists)
      associate (level => model%level, block => model%level%blocks(b), x => model%level%layout%position)
         block%leaver_count = 0
         block%at_rest = block%particles%count == 0
         if (block%at_rest) return
         if (model%method%domain /= domain_fixed) call split(model, b, error)
         call locate_particles(block%particles%count, block%particles%column(:, x:x + 2), frame_of(level, block), &
                               block%cells%bin, block%leavers, block%leaver_count, moved, lowest, highest)
         if (moved) block%cells%current = .false.
         if (any(lowest < level%grid%lower) .or. any(highest > level%grid%upper)) call report_outside(model, b, error)
         if (block%leaver_count > 0) call check_leavers(model, b, error)
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

   !> Leavers must be finite, and not further than the next block.
   subroutine check_leavers(model, b, error)
      type(model_t), intent(in) :: model
      integer, intent(in) :: b
      type(error_t), intent(inout) :: error
      real(wp) :: position(3)
      integer :: l, p
      associate (level => model%level, block => model%level%blocks(b), x => model%level%layout%position)
         do l = 1, block%leaver_count
            p = block%leavers(l)
            position = block%particles%column(p, x:x + 2)
            if (all(abs(position - block%origin) <= 16.0_wp*level%grid%cell)) then
               if (all(abs((position - block%origin)*level%grid%per_cell - 3.5_wp) <= 11.5_wp)) cycle
            end if
            call fail(error, exit_numerical, particle_text(model, b, p)//' moved more than a cell in one step or is not a '// &
                      'number: the motion is unstable; try a smaller safety')
         end do
      end associate
   end subroutine check_leavers

   !> Name the particle that left the grid.
   subroutine report_outside(model, b, error)
      type(model_t), intent(in) :: model
      integer, intent(in) :: b
      type(error_t), intent(inout) :: error
      character(len=2), parameter :: sides(2, 3) = reshape(['x-', 'x+', 'y-', 'y+', 'z-', 'z+'], [2, 3])
      integer :: axis, p
      associate (grid => model%level%grid, block => model%level%blocks(b), x => model%level%layout%position)
         do p = 1, block%particles%count
            do axis = 1, 3
               if (block%particles%column(p, x + axis - 1) < grid%lower(axis)) call complain(sides(1, axis))
               if (block%particles%column(p, x + axis - 1) > grid%upper(axis)) call complain(sides(2, axis))
            end do
         end do
      end associate
   contains
      subroutine complain(side)
         character(len=*), intent(in) :: side
         call fail(error, exit_numerical, particle_text(model, b, p)//' left the grid through its side '//side// &
                   '; try a larger grid, or a boundary there that holds it')
      end subroutine complain
   end subroutine report_outside

   !> Name a particle that was turned inside out.
   subroutine report_inversion(model, b, error)
      type(model_t), intent(in) :: model
      integer, intent(in) :: b
      type(error_t), intent(inout) :: error
      integer :: p
      associate (block => model%level%blocks(b))
         do p = 1, block%particles%count
            if (block%particles%column(p, model%level%layout%volume) > 0.0_wp) cycle
            call fail(error, exit_numerical, particle_text(model, b, p)//' was turned inside out (volume '// &
                      to_text(block%particles%column(p, model%level%layout%volume))//' m3, must be above 0); try a smaller safety')
            return
         end do
      end associate
      call fail(error, exit_numerical, 'a velocity gradient is not a number at time '//to_text(model%time)//' s')
   end subroutine report_inversion

   !> Who, where and when, for a sentence.
   function particle_text(model, b, p) result(text)
      type(model_t), intent(in) :: model
      integer, intent(in) :: b, p
      character(len=:), allocatable :: text
      associate (particles => model%level%blocks(b)%particles, x => model%level%layout%position)
         text = 'step '//to_text(model%step + 1)//', time '//to_text(model%time)//' s: particle '//to_text(particles%id(p))// &
                ' of body '//to_text(int(particles%body(p)))//' at ('//to_text(particles%column(p, x))//', '// &
                to_text(particles%column(p, x + 1))//', '//to_text(particles%column(p, x + 2))//') m'
      end associate
   end function particle_text

   !> Collective, one reduction: largest speeds for the next time step, whether blocks are missing, whether a rank failed.
   subroutine agree(model, new_blocks, error)
      type(model_t), intent(inout) :: model
      logical, intent(out) :: new_blocks
      type(error_t), intent(inout) :: error
      real(wp) :: bounds(4)
      integer :: b, l
      call model%timers%enter(phase_control)
      bounds = [model%bounds%wave_speed, model%bounds%particle_speed, 0.0_wp, 0.0_wp]
      if (.not. error%happened()) then
         do b = 1, size(model%level%blocks)
            do l = 1, model%level%blocks(b)%leaver_count
               if (model%level%owner_at(entered(model%level, model%level%blocks(b), int(model%level%blocks(b)%leavers(l)))) < 0) &
                  bounds(3) = 1.0_wp
            end do
         end do
      else
         bounds(4) = 1.0_wp
      end if
      call MPI_Allreduce(MPI_IN_PLACE, bounds, 4, MPI_DOUBLE_PRECISION, MPI_MAX, model%communicator%comm)
      model%bounds%wave_speed = bounds(1)
      model%bounds%particle_speed = bounds(2)
      new_blocks = bounds(3) > 0.0_wp
      if (bounds(4) > 0.0_wp) call model%communicator%agree(error)
   end subroutine agree

   !> Collective: the largest speeds of the model as it stands.
   subroutine bound_speeds(model)
      type(model_t), intent(inout) :: model
      real(wp) :: bounds(2)
      integer :: b
      model%bounds = bounds_t()
      do b = 1, size(model%level%blocks)
         call include_speeds(model%bounds, model%materials, model%level%layout, model%level%blocks(b))
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
