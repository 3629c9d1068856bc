!> The stage of a step that updates the particles of a block from the nodes: G2P (theory.md, eq.
!> to-particles).
module m_g2p_stage
   use m_kinds, only: wp
   use m_errors, only: error_t
   use m_timers
   use m_scene, only: update_usl
   use m_node_values, only: node_values, tile_last, v_x, v_z, a_z
   use m_cell_list, only: cell_list_t, bins_at
   use m_model, only: model_t
   use m_migration, only: frame_of
   use m_complaints, only: report_too_fast, max_cells_a_step
   use m_cell_mean, only: give_to_cells
   use m_p2g_boxes, only: clear
   use m_g2p_boxes, only: motion_t, fastest_t
   use m_particle_transfer, only: g2p
   use m_boundary, only: apply_boundary
   implicit none
   private
   public :: motion_of, still, g2p_block, follow_loads, stays_at_rest, give_at_rest, is_woken

contains

   !> The motion parameters of a level's particles in a step.
   pure type(motion_t) function motion_of(model, l, time_step) result(motion)
      type(model_t), intent(in) :: model
      integer, intent(in) :: l
      real(wp), intent(in) :: time_step !< s
      associate (at => model%levels(l)%layout)
         motion = motion_t(time_step, model%method%flip_fraction, &
                           merge(at%next_position, at%position, at%next_position > 0))
         motion%null_space_share = model%null_space_share
         motion%heat = at%unseen_heat
      end associate
   end function motion_of

   !> Particles do not move: only their velocity gradients are computed.
   pure type(motion_t) function still(model, l)
      type(model_t), intent(in) :: model
      integer, intent(in) :: l
      still = motion_t(0.0_wp, 1.0_wp, model%levels(l)%layout%position)
   end function still

   !> True when the particles of a block are at rest and their nodes keep them so: the rest of the step would
   !> not change a bit of them, except by means over cells that they share with others.
   pure logical function stays_at_rest(model, l, b) result(stays)
      type(model_t), intent(in) :: model
      integer, intent(in) :: l, b
      associate (block => model%levels(l)%blocks(b))
         stays = block%particles%count == 0
         if (stays) return
         stays = block%rests() .and. model%skip_at_rest .and. .not. model%effect_step(l)%acts_at_rest
         ! positions of loaded particles are stored before they move
         if (stays .and. size(model%effect_step(l)%on_cells) > 0) stays = .not. is_loaded(model, l, b)
         if (stays) stays = .not. any_moves(model%levels(l)%nodes(:, :, :, :, b), block%cells%extent())
      end associate
   end function stays_at_rest

   !> Add the contributions of the particles of a block at rest to the shared cells: only volume.
   subroutine give_at_rest(model, l, b)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b
      integer :: r(2)
      associate (level => model%levels(l), block => model%levels(l)%blocks(b))
         r = level%grid%rows
         if (block%has_resting_volume()) then
            if (level%grid%section%is_flat()) then
               call clear(level%nodes(:, :, :, :, b), reshape([0, tile_last, r, 0, tile_last], [2, 3]))
            else
               call clear(level%nodes(:, :, :, :, b))
            end if
            level%nodes(1, :, r(1):r(2), :, b) = block%resting_volume(:, r(1):r(2), :)
            return
         end if
         level%gradient(:block%particles%count, :) = 0.0_wp
         call give_to_cells(block%particles%count, block%cells%bin, block%particles%column, level%layout, &
                            frame_of(level, block), level%gradient, level%nodes(:, :, :, :, b), &
                            block%cells%standing)
         call block%keep_resting_volume(r, level%nodes(:, :, :, :, b))
      end associate
   end subroutine give_at_rest

   !> True when the sums of a cell that a block at rest may have particles in include moving or pressed
   !> material: then the block must use the means.
   pure logical function is_woken(model, l, b)
      type(model_t), intent(in) :: model
      integer, intent(in) :: l, b
      integer :: extent(2, 3)
      extent = model%levels(l)%blocks(b)%cells%extent()
      if (allocated(model%levels(l)%blocks(b)%cells%standing)) &
         extent = reshape([0, tile_last, model%levels(l)%grid%rows, 0, tile_last], [2, 3])
      associate (a => extent(1, :), z => extent(2, :))
         is_woken = any(abs(model%levels(l)%nodes(2:3, a(1):z(1), a(2):z(2), a(3):z(3), b)) > 0.0_wp)
      end associate
   end function is_woken

   pure logical function is_loaded(model, l, b)
      type(model_t), intent(in) :: model
      integer, intent(in) :: l, b
      is_loaded = model%effect_step(l)%is_loaded(b)
   end function is_loaded

   !> True when a node within the reach of a block's particles has a velocity or an acceleration.
   pure logical function any_moves(tile, extent)
      real(wp), intent(in) :: tile(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      integer, intent(in) :: extent(2, 3)
      associate (a => extent(1, :), z => extent(2, :))
         any_moves = any(abs(tile(v_x:a_z, a(1):z(1), a(2):z(2), a(3):z(3))) > 0.0_wp)
      end associate
   end function any_moves

   !> G2P of one block: velocities, positions and velocity gradients of its particles. With affine transfer
   !> the particles keep the gradient. `motion` with zero time step: the velocity gradient only, no motion.
   subroutine g2p_block(model, l, b, motion, time, error)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b
      type(motion_t), intent(in) :: motion
      real(wp), intent(in) :: time !< of the level, s
      type(error_t), intent(inout) :: error
      type(fastest_t) :: fastest
      integer :: kept, n
      logical :: lags, moves
      call model%timers%enter(phase_g2p)
      call find_lag(model, l, b, motion%time_step, lags)
      moves = motion%time_step > 0.0_wp
      fastest%speed = huge(1.0_wp)
      if (moves) fastest%speed = max_cells_a_step*model%levels(l)%grid%cell/motion%time_step
      associate (level => model%levels(l), block => model%levels(l)%blocks(b), &
                 first => model%levels(l)%layout%gradient)
         if (moves .and. model%effect_step(l)%is_loaded(b)) &
            call model%effect_step(l)%mark(model%effects, level, b)
         call g2p(block%cells, level%nodes(:, :, :, :, b), level%layout, frame_of(level, block), motion, &
                  block%particles%column, level%gradient, fastest)
         if (fastest%particle > 0) call report_too_fast(model, l, b, fastest, motion%time_step, error)
         if (moves .and. model%method%stress_update /= update_usl) &
            call follow_loads(model, l, b, motion, time, .true.)
         call block%particles%changed()
         n = block%particles%count
         if (first > 0) block%particles%column(:n, first:first + 8) = level%gradient(:n, :)
         if (lags) call add_lags(level%at_edge, level%lag, block%particles%column(:, first:first + 8))
         if (size(model%effect_step(l)%on_cells) == 0) return
         call give_to_cells(n, block%cells%bin, block%particles%column, level%layout, &
                            frame_of(level, block), level%gradient, &
                            level%nodes(:, :, :, :, b), block%cells%standing)
         kept = level%layout%kept_gradient
         if (kept > 0) block%particles%column(:n, kept:kept + 8) = level%gradient(:n, :)
      end associate
   end subroutine g2p_block

   !> Work of loads by the motion just made by a block's particles (theory.md, eq. particle-work), with the
   !> gradient that their domains follow: after the stress that of the work array; with a separate solution
   !> for the stress, which lacks contact, the kept one. `tools`: also for tools, whose candidates are those
   !> of the step.
   subroutine follow_loads(model, l, b, motion, time, tools)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b
      type(motion_t), intent(in) :: motion
      real(wp), intent(in) :: time !< of the level, s
      logical, intent(in) :: tools
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
         if (model%effect_step(l)%is_loaded(b)) &
            call model%effect_step(l)%follow(model%effects, model%levels(l), b, gradient, motion%position, &
                                             time, motion%time_step)
         if (tools .and. model%contact%followed .and. l == size(model%levels)) &
            call model%contact%follow(model%levels(l), b, gradient, motion%position, motion%time_step)
      end subroutine follow_with
   end subroutine follow_loads

   !> At the edge of a level: compute the lead of the particles' gradients over the motion (theory.md, eq.
   !> lag) into the work array, while particles are at the step's start; the particles concerned are in the
   !> level's list of those at edges.
   subroutine find_lag(model, l, b, time_step, lags)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b
      real(wp), intent(in) :: time_step
      logical, intent(out) :: lags
      real(wp) :: tile(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      logical :: ahead(0:tile_last, 0:tile_last, 0:tile_last)
      integer :: r(2)
      lags = .false.
      if (.not. model%levels(l)%layout%corrects_lag() &
          .or. model%levels(l)%blocks(b)%particles%count == 0) return
      if (.not. (model%composite(l)%has_edge(b) .or. model%composite(l + 1)%receives(b))) return
      r = model%levels(l)%grid%rows
      tile(:, :, r(1):r(2), :) = 0.0_wp
      call model%composite(l)%set_constrained_lag(b, time_step, model%levels(l)%blocks(b)%cells%extent(), &
                                                  tile)
      call model%composite(l + 1)%add_parent_lag(b, tile)
      associate (level => model%levels(l), block => model%levels(l)%blocks(b))
         call apply_boundary(level%grid, block%place, tile)
         ahead(:, r(1):r(2), :) = abs(tile(v_x, :, r(1):r(2), :)) + abs(tile(v_x + 1, :, r(1):r(2), :)) &
                                  + abs(tile(v_z, :, r(1):r(2), :)) > 0.0_wp
         lags = any(ahead(:, r(1):r(2), :))
         if (.not. lags) return
         call level%at_edge%take_bins(block%cells, bins_at(ahead, r))
         call g2p(level%at_edge, tile, level%layout, frame_of(level, block), still(model, l), &
                                 block%particles%column, level%lag)
      end associate
   end subroutine find_lag

   !> Add the lead of the listed particles to their gradients.
   pure subroutine add_lags(listed, lag, gradient)
      type(cell_list_t), intent(in) :: listed
      real(wp), intent(in), contiguous :: lag(:, :)
      real(wp), intent(inout), contiguous :: gradient(:, :) !< (:, 9), 1/s
      integer :: c, p
      associate (which => listed%order(:listed%count))
         do c = 1, 9
            do p = 1, size(which)
               gradient(which(p), c) = gradient(which(p), c) + lag(which(p), c)
            end do
         end do
      end associate
   end subroutine add_lags

end module m_g2p_stage
