!> Contact in the closing summary: accuracy of its solution, and its time.
module m_contact_summary
   use m_kinds, only: wp
   use m_text, only: to_text, si
   use m_timers, only: phase_contact
   use m_model, only: model_t
   use m_energy, only: balance_t
   use m_console, only: console_t
   use m_facts, only: facts_t, course_t, percent
   implicit none
   private
   public :: say_contact

contains

   !> Collective: accuracy of the contact solution, and its time.
   subroutine say_contact(facts, console, model, balance, course)
      type(facts_t), intent(inout) :: facts
      type(console_t), intent(in) :: console
      type(model_t), intent(in) :: model
      type(course_t), intent(in) :: course
      type(balance_t), intent(in) :: balance
      real(wp) :: bridge, drift, largest, late(2)
      character(len=:), allocatable :: text
      bridge = model%communicator%maximum(model%contact%worst_bridge)
      drift = model%communicator%maximum(model%contact%candidates%drift)
      largest = max(balance%largest, sum(abs(model%contact%states%work)))
      late = contact_share(console, model, course)
      if (abs(model%contact%relaxed()) > 0.0_wp) &
         call facts%note('relaxed_below_cells_J', to_text(model%contact%relaxed()))
      associate (contact => model%contact, cell => model%levels(size(model%levels))%grid%cell)
         if (.not. (contact%active() .and. contact%solves > 0)) return
         call facts%say('contact: '//to_text(contact%solves)//' solves, '// &
                        to_text(real(contact%iterations, wp)/contact%solves, 3)//' iterations and '// &
                        to_text(real(contact%system%products, wp)/contact%solves, 3)// &
                        ' products each, at most '//to_text(contact%largest)//' candidates')
         call facts%say('contact: largest residual '//to_text(contact%worst_residual, 3)//' (relative), '// &
                        to_text(contact%unsolved)//' steps above the tolerance')
         call facts%say('contact: largest overlap '//si(contact%worst_overlap, 'm')//', '// &
                        to_text(contact%worst_overlap/cell, 3)//' cells')
         call facts%note('contact_solves', to_text(contact%solves))
         call facts%note('contact_iterations', to_text(contact%iterations))
         call facts%note('contact_products', to_text(contact%system%products))
         call facts%note('contact_max_candidates', to_text(contact%largest))
         call facts%note('contact_largest_residual', to_text(contact%worst_residual))
         call facts%note('contact_steps_above_tolerance', to_text(contact%unsolved))
         call facts%note('largest_overlap_m', to_text(contact%worst_overlap))
         call facts%note('largest_overlap_cells', to_text(contact%worst_overlap/cell))
         associate (work => sum(contact%states%constraint_work) + sum(contact%pairs%states%work))
            call facts%say('contact: the constraint itself did '//si(work, 'J')//' of work'// &
                           percent(work, largest)//' of the largest energy; gaps carried at most '// &
                           to_text(drift/cell, 3)//' cells off those of the particles')
         end associate
         call facts%note('subcell_energy_J', &
                         to_text(sum(contact%states%stored + contact%states%stored_shear) &
                                 + sum(contact%pairs%states%stored + contact%pairs%states%stored_shear)))
         call facts%note('constraint_work_J', to_text(sum(contact%states%constraint_work)))
         call facts%note('largest_drift_cells', to_text(drift/cell))
         text = merge('tension by adhesion only', 'no tension              ', contact%pairs%adheres())
         call facts%say('contact: '//trim(text)//'; force times gap at most '//to_text(bridge, 3)// &
                        ' of largest force times cell')
         call facts%note('complementarity', to_text(bridge))
         text = 'contact: '//to_text(late(1), 3)//' % of the elapsed time'
         if (course%early_elapsed > 0.0_wp) &
            text = text//', '//to_text(late(2), 3)//' % over the last tenth of the scene'
         call facts%say(text)
         call facts%note('contact_share_percent', to_text(late(1)))
         if (course%early_elapsed > 0.0_wp) call facts%note('contact_share_at_end_percent', to_text(late(2)))
         if (contact%friction%present) call facts%note('friction_heat_J', &
            to_text(sum(contact%states%heat) + sum(contact%pairs%states%heat)))
         if (contact%friction%present) call facts%say('friction: '// &
             to_text(real(contact%friction%sweeps, wp)/contact%solves, 3)//' sweeps and '// &
             to_text(real(contact%friction%iterations, wp)/contact%solves, 3)// &
             ' iterations a solve, heat '//si(sum(contact%states%heat) + sum(contact%pairs%states%heat), 'J'))
      end associate
   end subroutine say_contact

   !> Collective: contact's share of the time, per cent: over the run, and over the last tenth of the scene.
   function contact_share(console, model, course) result(share)
      type(console_t), intent(in) :: console
      type(model_t), intent(in) :: model
      type(course_t), intent(in) :: course
      real(wp) :: share(2)
      real(wp) :: elapsed, seconds
      integer :: i
      elapsed = console%elapsed()
      seconds = model%timers%seconds(phase_contact)
      share(1) = seconds/elapsed
      share(2) = (seconds - course%early_contact)/(elapsed - course%early_elapsed)
      do i = 1, 2
         share(i) = 100.0_wp*model%communicator%maximum(share(i))
      end do
   end function contact_share

end module m_contact_summary
