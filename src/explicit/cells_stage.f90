!> The stage of a step that locates the particles of a block: splitting, cell lists, emigrants, order.
module m_cells_stage
   use m_kinds, only: wp
   use m_errors, only: error_t
   use m_timers
   use m_domain_kinds, only: domain_kinds
   use m_field_table, only: layout_t, shares_t
   use m_block, only: block_t
   use m_level, only: level_t
   use m_walls, only: keep_inside
   use m_particle_store, only: particle_store_t
   use m_model, only: model_t
   use m_erosion, only: erode
   use m_migration, only: frame_of
   use m_complaints, only: check_emigrants, report_outside
   use m_splitting, only: split
   use m_locate, only: locate_particles
   use m_speed_bounds, only: include_speeds
   implicit none
   private
   public :: cells_block

contains

   !> Split particles whose domains are too long; locate all; update bounds, largest speeds, and whether they
   !> rest. Emigrants are sent off, and the others sorted, before any arrive.
   subroutine cells_block(model, l, b, error)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b
      type(error_t), intent(inout) :: error
      logical :: moved
      call model%timers%enter(phase_lists)
      associate (level => model%levels(l), block => model%levels(l)%blocks(b), &
                 x => model%levels(l)%layout%position)
         call block%particles%changed()
         if (level%layout%next_position > 0) call take_next_position(block%particles, level%layout)
         if (model%effect_step(l)%erodes) call erode(model, l, b)
         if (block%particles%count == 0) then
            block%lowest = huge(1.0_wp)
            block%highest = -huge(1.0_wp)
            call level%keep_order(b)
            return
         end if
         if (domain_kinds(model%method%domain)%deforms) call split(model, l, b, error)
         call locate_particles(block%particles%count, block%particles%column(:, x:x + 2), &
                               frame_of(level, block), block%cells%bin, block%emigrants, &
                               block%emigrant_count, moved, block%lowest, block%highest)
         if (any(block%lowest < level%grid%lower) .or. any(block%highest > level%grid%upper)) then
            call put_back(level, block)
            call locate_particles(block%particles%count, block%particles%column(:, x:x + 2), &
                                  frame_of(level, block), block%cells%bin, block%emigrants, &
                                  block%emigrant_count, moved, block%lowest, block%highest)
            moved = .true.
            if (any(block%lowest < level%grid%lower) .or. any(block%highest > level%grid%upper)) &
               call report_outside(model, l, b, error)
         end if
         if (moved) call block%cells%outdate()
         if (block%emigrant_count > 0) call check_emigrants(model, l, b, error)
         call include_speeds(model%bounds, model%materials, level%layout, block)
         block%at_rest = block%emigrant_count == 0 .and. .not. moved &
                         .and. rests(block%particles, level%layout)
         if (block%at_rest) block%at_rest = model%materials%are_at_rest(block%particles, level%layout)
         if (error%happened()) return
         if (block%emigrant_count > 0) then
            call model%timers%enter(phase_migration)
            call model%migration(l)%emigrate(model%communicator, level, b)
            call model%timers%enter(phase_lists)
         end if
         call level%keep_order(b)
         block%located = block%particles%state()
      end associate
   end subroutine cells_block

   !> Particles beyond a closed side, by round-off or pushed by contact, are replaced by their mirror image,
   !> as at a symmetry side.
   pure subroutine put_back(level, block)
      type(level_t), intent(in) :: level
      type(block_t), intent(inout) :: block
      type(shares_t) :: shares
      integer :: p
      shares = level%table%shares()
      associate (particles => block%particles, x => level%layout%position)
         do p = 1, particles%count
            if (any(particles%column(p, x:x + 2) < level%grid%lower &
                    .or. particles%column(p, x:x + 2) > level%grid%upper)) &
               call keep_inside(particles%column(p, :), level%layout, shares, level%grid)
         end do
      end associate
   end subroutine put_back

   !> With musl the new positions are set after the stress.
   pure subroutine take_next_position(particles, at)
      type(particle_store_t), intent(inout) :: particles
      type(layout_t), intent(in) :: at
      associate (n => particles%count, x => at%position, y => at%next_position)
         particles%column(:n, x:x + 2) = particles%column(:n, y:y + 2)
      end associate
   end subroutine take_next_position

   !> True when no particle has a velocity, a velocity gradient, a stress or an additional pressure.
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
      if (at%pressure_shift > 0) then
         if (any(abs(particles%column(:n, at%pressure_shift)) > 0.0_wp)) return
      end if
      if (at%gradient > 0) then
         do c = at%gradient, at%gradient + 8
            if (any(abs(particles%column(:n, c)) > 0.0_wp)) return
         end do
      end if
      if (at%kept_gradient > 0) then
         do c = at%kept_gradient, at%kept_gradient + 8
            if (any(abs(particles%column(:n, c)) > 0.0_wp)) return
         end do
      end if
      rests = .true.
   end function rests

end module m_cells_stage
