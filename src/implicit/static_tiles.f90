!> Operations of a quasi-static step on whole node tiles: masses, motion and forces of effects, sums over
!> blocks and ranks, and gradients at particles.
module m_static_tiles
   use m_kinds, only: wp
   use m_timers
   use m_node_values, only: tile_last, mass_, v_x, a_x, a_z
   use m_level, only: level_t
   use m_boundary, only: fold_symmetry, motion_parity
   use m_node_exchange, only: sum_tiles
   use m_migration, only: frame_of
   use m_edge, only: clear_covered
   use m_p2g_boxes, only: clear
   use m_g2p_boxes, only: motion_t, fastest_t
   use m_particle_transfer, only: p2g, g2p
   use m_model, only: model_t
   use m_static_nodes, only: static_nodes_t
   implicit none
   private
   public :: put_loads, put_accelerations, read_motion, fold_all, sum_up, take_gradients, stiffest

contains

   !> Collective: masses and momenta of the nodes, and forces on them by effects at a time, and by stress if
   !> wanted; the finest level first, as each restricts the values of constrained nodes to the next.
   subroutine put_loads(model, time, stress)
      type(model_t), intent(inout) :: model
      real(wp), intent(in) :: time !< s
      logical, intent(in) :: stress
      integer :: b, l
      do l = size(model%levels), 1, -1
         call model%timers%enter(phase_p2g)
         associate (level => model%levels(l), effects => model%effect_step(l))
            do b = 1, size(level%blocks)
               call level%update_extents(b, whole=.true.)
               call clear(level%nodes(:, :, :, :, b))
               call p2g(level%blocks(b)%cells, level%blocks(b)%particles%column, level%layout, &
                        frame_of(level, level%blocks(b)), level%nodes(:, :, :, :, b))
               if (.not. stress) level%nodes(a_x:a_z, :, :, :, b) = 0.0_wp
               if (effects%acts_on_nodes) &
                  call effects%add_body_forces(model%effects, level, b, time, 0.0_wp, model%timers)
            end do
            call fold_all(level, motion_parity, level%nodes)
            if (l < size(model%levels)) call model%composite(l + 1)%add_to_parents(level)
            call effects%keep_masses(level)
            call model%timers%enter(phase_exchange)
            call sum_up(model, l, level%nodes)
            if (l < size(model%levels)) call clear_covered(level, model%levels(l + 1))
            if (l > 1) call model%composite(l)%restrict(model%communicator, level, 0.0_wp)
         end associate
      end do
   end subroutine put_loads

   !> Accelerations of nodes by effects, in their components; nodes have masses.
   subroutine put_accelerations(model, time)
      type(model_t), intent(inout) :: model
      real(wp), intent(in) :: time !< s
      integer :: b, c, l
      do l = 1, size(model%levels)
         associate (level => model%levels(l))
            do b = 1, size(level%blocks)
               level%nodes(v_x:a_z, :, :, :, b) = 0.0_wp
               call model%effect_step(l)%change_nodes(model%effects, level, b, time, 0.0_wp, &
                                                      model%composite(l)%constrained(b), model%timers)
               do c = a_x, a_z
                  level%nodes(c, :, :, :, b) = level%nodes(c, :, :, :, b)*level%nodes(mass_, :, :, :, b)
               end do
            end do
         end associate
      end do
   end subroutine put_accelerations

   !> Displacements in a step if nodes continue with the particles' velocities; after put_loads.
   pure subroutine read_motion(unknowns, level, time_step, z)
      type(static_nodes_t), intent(in) :: unknowns
      type(level_t), intent(in) :: level
      real(wp), intent(in) :: time_step !< s
      real(wp), intent(inout) :: z(:)   !< (unknowns of the level), m
      integer :: n
      call unknowns%gather(v_x, level%nodes, z)
      do n = 1, unknowns%count
         associate (at => unknowns%at(:, n))
            z(n) = time_step*z(n)/max(level%nodes(mass_, at(2), at(3), at(4), at(5)), tiny(z))
         end associate
      end do
   end subroutine read_motion

   !> Add values outside symmetry planes to their mirror nodes, in all own tiles.
   subroutine fold_all(level, parity, tiles)
      type(level_t), intent(in) :: level
      real(wp), intent(in) :: parity(:, :)
      real(wp), intent(inout), contiguous :: tiles(:, 0:, 0:, 0:, :)
      integer :: b
      do b = 1, size(level%blocks)
         call fold_symmetry(level%grid, level%blocks(b)%place, tiles(:, :, :, :, b), parity)
      end do
   end subroutine fold_all

   !> Collective: sums over blocks and ranks of tiles of a level.
   subroutine sum_up(model, l, tiles)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l
      real(wp), intent(inout), contiguous :: tiles(:, 0:, 0:, 0:, :)
      integer :: extent(2, 3, size(tiles, 5))
      associate (level => model%levels(l))
         call model%exchange(l)%start(tiles)
         call model%exchange(l)%wait(tiles)
         if (level%grid%section%is_flat()) then
            extent = spread(reshape([0, tile_last, level%grid%rows, 0, tile_last], [2, 3]), 3, size(tiles, 5))
            call sum_tiles(level%blocks, level%interior_first, tiles, extent)
         else
            call sum_tiles(level%blocks, level%interior_first, tiles)
         end if
      end associate
   end subroutine sum_up

   !> Gradients of the nodal displacements at the particles of a block, which do not move.
   pure subroutine take_gradients(level, b, gradient, longest)
      type(level_t), intent(inout) :: level
      integer, intent(in) :: b
      real(wp), intent(inout), contiguous :: gradient(:, :) !< (:, 9)
      type(fastest_t), intent(inout), optional :: longest   !< displacement component of a particle, m
      associate (block => level%blocks(b))
         call g2p(block%cells, level%nodes(:, :, :, :, b), level%layout, frame_of(level, block), &
                  motion_t(0.0_wp, 1.0_wp, level%layout%position), block%particles%column, gradient, longest)
      end associate
   end subroutine take_gradients

   !> The largest of the materials' moduli, Pa.
   real(wp) function stiffest(model)
      type(model_t), intent(in) :: model
      integer :: m
      stiffest = 0.0_wp
      do m = 1, size(model%materials%slots)
         stiffest = max(stiffest, 0.5_wp/model%materials%slots(m)%law%complementary_energy( &
                        [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]))
      end do
   end function stiffest

end module m_static_tiles
