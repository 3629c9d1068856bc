!> The stage of a step that updates the stress of a block's particles by their velocity gradients: laws,
!> volumes, domains.
module m_stress_stage
   use m_kinds, only: wp
   use m_constants, only: exit_numerical
   use m_errors, only: error_t, fail
   use m_timers
   use m_domain_kinds, only: domain_kinds
   use m_half_edges, only: thinnest
   use m_field_table, only: layout_t
   use m_particle_store, only: particle_store_t
   use m_model, only: model_t
   use m_complaints, only: particle_text, report_inversion, report_undefined
   use m_deform, only: advance_volume, advance_domain, advance_half_edges, finite_stress
   implicit none
   private
   public :: stress_block, update_stress

contains

   !> Update stress and volume of one block, with the new velocity gradients of its particles.
   subroutine stress_block(model, l, b, time_step, error)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b
      real(wp), intent(in) :: time_step
      type(error_t), intent(inout) :: error
      if (size(model%effect_step(l)%on_cells) > 0) call take_back(model, l, b)
      if (size(model%effect_step(l)%on_cells) + size(model%effect_step(l)%on_gradient) > 0) &
         call model%effect_step(l)%change_gradient(model%effects, model%levels(l), b, time_step, model%timers)
      call update_stress(model, l, b, time_step, error)
   end subroutine stress_block

   !> The same with the gradients in the work array unchanged.
   subroutine update_stress(model, l, b, time_step, error)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b
      real(wp), intent(in) :: time_step !< s
      type(error_t), intent(inout) :: error
      real(wp) :: smallest
      integer :: first, last
      logical :: follows
      call model%timers%enter(phase_stress)
      follows = l > 1 .and. model%levels(l)%layout%edge_stress > 0
      if (follows) call add_stress(model%levels(l)%blocks(b)%particles, model%levels(l)%layout, -1.0_wp)
      associate (level => model%levels(l), particles => model%levels(l)%blocks(b)%particles)
         first = 1
         do while (first <= particles%count)
            last = particles%run_end(first)
            associate (law => model%materials%slots(model%materials%of_body(particles%body(first)))%law)
               call law%update(particles%column, level%layout, level%gradient, time_step, first, last)
            end associate
            first = last + 1
         end do
         call particles%changed()
         if (follows) call add_stress(particles, level%layout, 1.0_wp)
         call advance_volume(particles%count, level%gradient, time_step, &
                             particles%column(:, level%layout%volume), smallest)
         if (.not. smallest > 0.0_wp) call report_inversion(model, l, b, error)
         if (.not. finite_stress(particles%count, particles%column(:, &
            level%layout%stress:level%layout%stress + 5))) &
            call report_undefined(model, l, b, error)
         if (level%layout%motion > 0) &
            call advance_half_edges(particles%count, level%gradient, time_step, .false., &
                                    particles%column(:, level%layout%motion:level%layout%motion + 8))
         if (domain_kinds(model%method%domain)%deforms) call advance_domains(model, l, b, time_step, error)
      end associate
      if (size(model%effect_step(l)%on_stress) > 0) &
         call model%effect_step(l)%change_stress(model%effects, model%levels(l), b, time_step, model%timers)
   end subroutine update_stress

   !> Add a multiple of the stress to edge_stress: subtracted before a step's law and added after it, this
   !> adds the change.
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

   !> Update the domains of one block's particles by their velocity gradients.
   subroutine advance_domains(model, l, b, time_step, error)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b
      real(wp), intent(in) :: time_step
      type(error_t), intent(inout) :: error
      real(wp) :: smallest
      associate (level => model%levels(l), particles => model%levels(l)%blocks(b)%particles, &
                 at => model%levels(l)%layout)
         call advance_domain(particles%count, level%gradient, time_step, at, particles%column, smallest)
         if (.not. smallest > 0.0_wp) call fail(error, exit_numerical, &
                                                particle_text(model, l, b, thinnest(particles, at))// &
            's domain has a non-positive size; try a smaller safety', recoverable=.true.)
      end associate
   end subroutine advance_domains

   !> Copy the velocity gradients of one block, stored during the sums over cells, back to the work array.
   subroutine take_back(model, l, b)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b
      integer :: first, n
      first = model%levels(l)%layout%kept_gradient
      if (first == 0) first = model%levels(l)%layout%gradient
      n = model%levels(l)%blocks(b)%particles%count
      model%levels(l)%gradient(:n, :) = model%levels(l)%blocks(b)%particles%column(:n, first:first + 8)
   end subroutine take_back

end module m_stress_stage
