!> The last words of a run: what it cost, and what it is worth. The same stands in cost.dat.
module m_closing_summary
   use m_kinds, only: wp, i8
   use m_errors, only: error_t, fail
   use m_text, only: to_text, si, duration
   use m_timers, only: phase_contact
   use m_scene, only: scene_t, domain_fixed, domain_corners, boundary_free, update_usf
   use m_decomposition, only: all_owners
   use m_model, only: model_t
   use m_energy, only: balance_t, sums_t, measure
   use m_machine, only: peak_memory
   use m_expectation, only: expectation_t
   use m_indicators, only: stress_error_t, estimate_stress_error
   use m_history, only: history_text_length
   use m_console, only: console_t
   use m_cost_report, only: cost_t, write_cost_report, cost_line_length
   implicit none
   private
   public :: summarise, course_t

   !> What a run remembers of its course for its last words.
   type :: course_t
      integer(i8) :: particles = 0       !< when the program began
      real(wp) :: memory = 0.0_wp        !< of these and of node tiles then, bytes
      integer(i8) :: steps = 0           !< that the program has taken, repeated ones too
      character(len=:), allocatable :: stop_reason !< why the run ends before the scene does; empty: it does
                                                   !< not
      real(wp) :: early_elapsed = 0.0_wp !< wall-clock time when the last tenth of the scene began, s; 0
                                         !< before that
      real(wp) :: early_contact = 0.0_wp !< of that, in contact, s
   end type course_t

   !> Lines for people, and the same as `name=value` for the head of cost.dat.
   type :: facts_t
      character(len=cost_line_length), allocatable :: lines(:)
      character(len=history_text_length), allocatable :: notes(:)
   contains
      procedure :: say
      procedure :: note
   end type facts_t

   real(wp), parameter :: round_off = 1.0e-20_wp !< of mass times squared wave speed: strains of 1e-10
   real(wp), parameter :: notable = 0.05_wp !< of the largest energy or work: what is apart or missing is said

contains

   !> Collective: the closing summary and cost.dat.
   subroutine summarise(console, scene, model, balance, course, expectation, guarded, ranged, stepped, error)
      type(console_t), intent(inout) :: console
      type(scene_t), intent(in) :: scene
      type(model_t), intent(inout) :: model
      type(balance_t), intent(in) :: balance
      type(course_t), intent(in) :: course
      type(expectation_t), intent(in) :: expectation
      character(len=*), intent(in) :: guarded !< what the guard says of the run
      character(len=*), intent(in) :: stepped !< how steps went; empty: as always
      character(len=*), intent(in) :: ranged  !< where domains left their range; empty: nowhere
      type(error_t), intent(inout) :: error
      type(cost_t) :: cost
      type(facts_t) :: facts
      type(error_t) :: trouble
      character(len=cost_line_length), allocatable :: table(:)
      character(len=:), allocatable :: outcome, path
      integer :: l
      allocate (facts%lines(0), facts%notes(0))
      cost%particle_steps = model%communicator%sum_count(model%particle_steps)
      allocate (cost%level_steps(size(model%level_steps)))
      do l = 1, size(cost%level_steps)
         cost%level_steps(l) = model%communicator%sum_count(model%level_steps(l))
      end do
      call say_expectation(facts, console, model, expectation, model%time >= scene%end_time &
                           .and. .not. error%happened())
      call say_work(facts, scene, model, course, cost%particle_steps)
      call say_conservation(facts, scene, model, balance)
      call say_work_done(facts, scene, model, balance)
      call warn_of_balance(facts, scene, model, balance)
      call say_effects(facts, model, balance)
      call say_contact(facts, console, model, balance, course)
      if (.not. error%happened()) call say_stress_error(facts, model)
      if (stepped /= '') call facts%say(stepped)
      call facts%say(guarded)
      if (ranged /= '') call facts%say(ranged)
      call facts%note('processor_share', to_text(model%communicator%sum_real(console%processor()) &
                                                 /model%communicator%sum_real(console%elapsed())))
      cost%timers = model%timers; cost%notes = facts%notes
      cost%elapsed = console%elapsed(); cost%processor = console%processor(); cost%time = model%time
      path = ''
      if (scene%output%present) path = scene%output%directory//'/cost.dat'
      call write_cost_report(model%communicator, cost, path, table, trouble)
      ! after a fault it is that which counts
      if (trouble%happened()) call fail(error, trouble%status, trouble%message)
      outcome = 'finished: '//scene%title
      if (course%stop_reason /= '') outcome = course%stop_reason
      if (error%happened()) outcome = 'stopped: '//error%message
      call console%summary(outcome, int(model%step), model%time, [facts%lines, table])
   end subroutine summarise

   !> Collective: what effects have to say.
   subroutine say_effects(facts, model, balance)
      type(facts_t), intent(inout) :: facts
      type(model_t), intent(in) :: model
      type(balance_t), intent(in) :: balance
      character(len=:), allocatable :: text
      integer :: e
      if (any(model%effect_step%erodes)) &
         call facts%say('eroded: '//si(1000.0_wp*(balance%start%mass - balance%now%mass), 'g')// &
                        ' of what has failed, taken out')
      do e = 1, size(model%effects)
         text = model%effects(e)%effect%summary(model%communicator, model%levels)
         if (text /= '') call facts%say(text)
      end do
   end subroutine say_effects

   !> A line of the summary.
   subroutine say(self, text)
      class(facts_t), intent(inout) :: self
      character(len=*), intent(in) :: text
      character(len=cost_line_length) :: line
      line = text
      self%lines = [self%lines, line]
   end subroutine say

   !> A line of the head of cost.dat.
   subroutine note(self, name, text)
      class(facts_t), intent(inout) :: self
      character(len=*), intent(in) :: name, text
      character(len=history_text_length) :: line
      line = name//'='//text
      self%notes = [self%notes, line]
   end subroutine note

   !> Collective: memory held, and what was expected of the run beside what it took. A run that ended early
   !> took less.
   subroutine say_expectation(facts, console, model, expectation, whole)
      type(facts_t), intent(inout) :: facts
      type(console_t), intent(in) :: console
      type(model_t), intent(in) :: model
      type(expectation_t), intent(in) :: expectation
      logical, intent(in) :: whole !< the scene has come to its end
      real(wp) :: memory, took
      integer :: blocks
      memory = model%communicator%sum_real(real(peak_memory(), wp))
      took = model%communicator%maximum(console%elapsed())
      blocks = count(all_owners(model%levels) >= 0)
      call facts%say('memory: '//si(memory, 'B')//' on all ranks together, '//to_text(blocks)//' node blocks')
      call facts%note('node_blocks', to_text(blocks))
      call facts%note('memory_B', to_text(memory))
      if (.not. (expectation%made .and. whole)) return
      call facts%say('expected at step '//to_text(expectation%step)//': '//duration(expectation%total)// &
                     ' and '//si(expectation%memory, 'B')//' in all; it took '// &
                     off_by(took, expectation%total)//' and '//off_by(memory, expectation%memory)// &
                     ' than that')
      call facts%note('expected_at_step', to_text(expectation%step))
      call facts%note('expected_elapsed_s', to_text(expectation%total))
      call facts%note('expected_memory_B', to_text(expectation%memory))
   end subroutine say_expectation

   !> How much more or less something is than was expected.
   function off_by(value, expected) result(text)
      real(wp), intent(in) :: value, expected
      character(len=:), allocatable :: text
      text = to_text(100.0_wp*abs(value - expected)/expected, 2)//' % '// &
             trim(merge('more', 'less', value > expected))
   end function off_by

   !> Collective: what the ranks did.
   subroutine say_work(facts, scene, model, course, particle_steps)
      type(facts_t), intent(inout) :: facts
      type(scene_t), intent(in) :: scene
      type(model_t), intent(in) :: model
      type(course_t), intent(in) :: course
      integer(i8), intent(in) :: particle_steps !< of all ranks
      real(wp) :: bytes, messages
      integer(i8) :: at_end, merges, resting, splits
      resting = model%communicator%sum_count(model%particle_steps_at_rest)
      splits = model%communicator%sum_count(model%splits)
      merges = model%communicator%sum_count(model%merges)
      at_end = model%communicator%sum_count(model%particle_count())
      messages = model%communicator%maximum(real(sum(model%exchange%messages) &
                                                 + sum(model%composite%exchange%messages), wp) /course%steps)
      bytes = model%communicator%maximum(real(sum(model%exchange%bytes) &
                                              + sum(model%composite%exchange%bytes), wp) /course%steps)
      if (resting > 0) call facts%say('at rest: '//to_text(100.0_wp*resting/particle_steps, 3)// &
                                      ' % of the particle-steps had nothing to do')
      call facts%note('particle_steps_at_rest', to_text(resting))
      call facts%note('particles_at_start', to_text(course%particles))
      call facts%note('memory_at_start_B', to_text(course%memory))
      call facts%note('steps', to_text(model%step))
      if (scene%time%domain /= domain_fixed .or. size(model%levels) > 1) &
         call facts%say('domains: '//to_text(splits)//' particles made by splitting, '//to_text(merges)// &
                        ' by merging eight, '//to_text(at_end)//' at the end')
      call say_placings(facts, model)
      if (model%communicator%ranks > 1) &
         call facts%say('node sums: at most '//to_text(messages, 4)//' messages and '//to_text(bytes, 9)// &
                        ' B sent by a rank in a step')
   end subroutine say_work

   !> What the error has made of the levels that it places.
   subroutine say_placings(facts, model)
      type(facts_t), intent(inout) :: facts
      type(model_t), intent(in) :: model
      character(len=:), allocatable :: text
      integer :: l
      if (model%placings == 0) return
      text = 'levels by the error: looked at '//to_text(model%placings)//' times'
      do l = 2, size(model%levels)
         text = text//', level '//to_text(l)//' has '//to_text(model%levels(l)%region%cells())//' cells'
      end do
      if (model%bound_placings > 0) &
         text = text//'; the budget kept out cells whose error is above the tolerance at '// &
                                           to_text(model%bound_placings)//' of these times'
      call facts%say(text)
      call facts%note('placings', to_text(model%placings))
      call facts%note('placings_at_budget', to_text(model%bound_placings))
   end subroutine say_placings

   !> Collective: energy, momentum, mass.
   subroutine say_conservation(facts, scene, model, balance)
      type(facts_t), intent(inout) :: facts
      type(scene_t), intent(in) :: scene
      type(model_t), intent(in) :: model
      type(balance_t), intent(in) :: balance
      type(sums_t) :: sums
      character(len=:), allocatable :: text
      real(wp) :: change(3), impulse(3), mass, scale
      integer :: t
      sums = measure(model)
      call facts%say('energy balance error: at most '//si(balance%worst, 'J')//' of '// &
                     si(balance%largest, 'J')//percent(balance%worst, balance%largest))
      call facts%note('energy_balance_error_J', to_text(balance%worst))
      call facts%note('largest_energy_J', to_text(balance%largest))
      change = sums%momentum - balance%start%momentum
      impulse = 0.0_wp
      do t = 1, size(model%contact%states)
         impulse = impulse + model%contact%states(t)%impulse
      end do
      text = 'momentum: changed by '//to_text(norm2(change), 3)//' kg m/s, tools gave '// &
             to_text(norm2(impulse), 3)//' kg m/s'
      if (all(scene%grid%boundary == boundary_free) .and. size(model%effects) == 0) then
         scale = norm2(impulse)
         if (scale <= 0.0_wp) scale = sqrt(2.0_wp*sums%mass*balance%largest)
         text = text//', off by '//to_text(norm2(change - impulse), 3)//' kg m/s'// &
                percent(norm2(change - impulse), scale)
         if (norm2(impulse) > 0.0_wp) text = text//' of the impulse given'
         if (.not. norm2(impulse) > 0.0_wp) text = text//' of sqrt(2 mass x largest energy)'
         call facts%note('momentum_error_kg_m_s', to_text(norm2(change - impulse)))
      else
         text = text//'; held sides and effects account for the rest'
      end if
      call facts%say(text)
      call facts%note('momentum_change_kg_m_s', to_text(norm2(change)))
      call facts%note('tool_impulse_kg_m_s', to_text(norm2(impulse)))
      mass = abs(sums%mass - balance%start%mass)
      call facts%say('mass: changed by '//to_text(mass, 3)//' of '//to_text(sums%mass, 3)//' kg')
      call facts%note('mass_error_kg', to_text(mass))
   end subroutine say_conservation

   !> How far the work of loads that is booked is from what they do by the motion of the particles that they
   !> act on; and what it means where that is much.
   subroutine say_work_done(facts, scene, model, balance)
      type(facts_t), intent(inout) :: facts
      type(scene_t), intent(in) :: scene
      type(model_t), intent(in) :: model
      type(balance_t), intent(in) :: balance
      if (any(model%effect_step%acts_on_nodes) .and. all(model%effect_step%follows_particles)) then
         call facts%note('work_apart_of_effects_J', to_text(balance%worst_of_effects))
         call facts%say(apart_text('effects: work', balance%worst_of_effects, balance%largest))
         if (balance%worst_of_effects > max(notable*balance%largest, quiet(model, balance))) &
            call facts%say('WARNING: effects do work that the particles they act on do not get: their '// &
                           'forces lie on nodes with hardly any material, and motion and stress there '// &
                           'are as wrong; '//remedy(scene))
      end if
      if (size(scene%tools) == 0) return
      call facts%note('work_apart_of_tools_J', to_text(balance%worst_of_tools))
      call facts%say(apart_text('tools: work', balance%worst_of_tools, balance%largest))
      if (balance%worst_of_tools > max(notable*balance%largest, quiet(model, balance))) &
         call facts%say('WARNING: tools do work that the particles they press do not get, or the '// &
                        'reverse: loads are as wrong; '//remedy(scene))
   end subroutine say_work_done

   !> The two figures of a work side by side.
   function apart_text(what, apart, largest) result(text)
      character(len=*), intent(in) :: what
      real(wp), intent(in) :: apart, largest !< J
      character(len=:), allocatable :: text
      text = what//' by the motion of nodes and tools and by that of the particles they act on differs '// &
             'by at most '//si(apart, 'J')//percent(apart, largest)//' of the largest energy or work'
   end function apart_text

   !> What to take where loads and particles do not agree, of what the scene has not taken.
   function remedy(scene) result(text)
      type(scene_t), intent(in) :: scene
      character(len=:), allocatable :: text
      text = 'try smaller cells there'
      if (any(scene%bodies%particles_per_cell == 1)) text = text//', particles_per_cell=8'
      if (scene%time%domain == domain_fixed .or. (scene%time%domain /= domain_corners &
                                                  .and. size(scene%tools) > 0)) &
         text = text//', domain=''corners'''
   end function remedy

   !> Energies that are round-off, which are not judged: nothing has moved, J.
   pure real(wp) function quiet(model, balance)
      type(model_t), intent(in) :: model
      type(balance_t), intent(in) :: balance
      quiet = round_off*balance%now%mass*model%bounds%wave_speed**2
   end function quiet

   !> Energy that has come from nowhere, or gone, to an extent that matters.
   subroutine warn_of_balance(facts, scene, model, balance)
      type(facts_t), intent(inout) :: facts
      type(scene_t), intent(in) :: scene
      type(model_t), intent(in) :: model
      type(balance_t), intent(in) :: balance
      character(len=:), allocatable :: text
      if (.not. balance%worst > max(notable*balance%largest, quiet(model, balance)) &
          + model%static_doubt) return
      text = 'WARNING: energy '//trim(merge('from nowhere', 'lost        ', balance%excess() > 0.0_wp))// &
             ': up to '//si(balance%worst, 'J')//percent(balance%worst, balance%largest)//' of the largest'
      if (model%static_doubt > 0.0_wp) then
         text = text//', of which '//si(model%static_doubt, 'J')//' may come of the length of the steps'// &
                hardest_worked(model)//'; '//remedy(scene)//', a smaller step'
      else if (balance%excess() > 0.0_wp) then
         text = text//'; '//remedy(scene)//', a smaller safety'
         if (scene%time%stress_update == update_usf) text = text//', stress_update=''usl'''
      else
         text = text//', in transfer or contact, where material tears, or in the energy that a law of '// &
                'small strain has at large strain; '//remedy(scene)
         if (scene%time%flip_fraction < 1.0_wp) text = text//', flip_fraction=1'
         if (.not. scene%time%affine) text = text//', transfer=''affine'''
      end if
      call facts%say(text)
   end subroutine warn_of_balance

   !> Which tool has done most of the work.
   function hardest_worked(model) result(text)
      type(model_t), intent(in) :: model
      character(len=:), allocatable :: text
      integer :: t
      text = ''
      if (size(model%contact%states) == 0) return
      t = maxloc(abs(model%contact%states%work), dim=1)
      text = '; the contact with most work, '//si(model%contact%states(t)%work, 'J')//', is that of tool '// &
             trim(model%contact%tools(t)%spec%name)
   end function hardest_worked

   !> A share in words; nothing where there is nothing to share.
   function percent(part, whole) result(text)
      real(wp), intent(in) :: part, whole
      character(len=:), allocatable :: text
      text = ''
      if (whole > 0.0_wp) text = ', '//to_text(100.0_wp*part/whole, 3)//' %'
   end function percent

   !> Collective: how well contact was solved, and its time.
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
         call facts%note('largest_overlap_m', to_text(contact%worst_overlap))
         call facts%note('largest_overlap_cells', to_text(contact%worst_overlap/cell))
         associate (work => sum(contact%states%constraint_work) + sum(contact%pairs%states%work))
            call facts%say('contact: the condition itself did '//si(work, 'J')//' of work'// &
                           percent(work, largest)//' of the largest energy; gaps carried at most '// &
                           to_text(drift/cell, 3)//' cells off those of the particles')
         end associate
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
         if (contact%friction%present) call facts%say('friction: '// &
             to_text(real(contact%friction%sweeps, wp)/contact%solves, 3)//' sweeps and '// &
             to_text(real(contact%friction%iterations, wp)/contact%solves, 3)// &
             ' iterations a solve, heat '//si(sum(contact%states%heat) + sum(contact%pairs%states%heat), 'J'))
      end associate
   end subroutine say_contact

   !> Collective: what share of the time contact took, per cent: over the run, and over the last tenth of the
   !> scene.
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

   !> Collective: the estimate of the discretisation error of the stress at the end, in a row of the timers of
   !> its own.
   subroutine say_stress_error(facts, model)
      type(facts_t), intent(inout) :: facts
      type(model_t), intent(inout) :: model
      type(stress_error_t) :: error
      character(len=:), allocatable :: text
      call model%timers%enter(model%timers%row_of('indicators'))
      call estimate_stress_error(model, error)
      call model%timers%leave()
      if (.not. error%energy > 0.0_wp) return
      text = 'stress: estimated error '//to_text(100.0_wp*error%share(), 3)// &
             ' % of its energy norm, sqrt('//si(error%squares, 'J')//' of '//si(error%energy, 'J')//')'
      if (error%beside > 0.0_wp) &
         text = text//', '//si(error%beside, 'J')//' of that beside edges of levels'
      call facts%say(text)
      call facts%say('stress: largest estimated error '//si(error%largest, 'Pa')//' of '// &
                     si(error%stress, 'Pa')//', particle '//to_text(error%id)//' at ('// &
                     to_text(error%place(1))//', '//to_text(error%place(2))//', '//to_text(error%place(3))// &
                     ') m, level '//to_text(error%level))
      call facts%note('stress_error_share', to_text(error%share()))
      call facts%note('stress_error_energy_J', to_text(error%squares))
      call facts%note('strain_energy_J', to_text(error%energy))
      call facts%note('stress_error_energy_beside_edges_J', to_text(error%beside))
      call facts%note('largest_stress_error_Pa', to_text(error%largest))
      call facts%note('largest_stress_Pa', to_text(error%stress))
      call facts%note('largest_stress_error_particle', to_text(error%id))
      call facts%note('largest_stress_error_at_m', to_text(error%place(1))//' '//to_text(error%place(2))// &
                      ' '//to_text(error%place(3)))
   end subroutine say_stress_error

end module m_closing_summary
