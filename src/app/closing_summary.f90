!> The closing summary of a run: its cost and its accuracy. Also written to cost.dat.
module m_closing_summary
   use m_kinds, only: wp, i8
   use m_errors, only: error_t, fail
   use m_constants, only: program_version
   use m_text, only: to_text, exact_text, si, duration
   use m_domain_kinds, only: domain_kinds
   use m_scene, only: scene_t, update_usf
   use m_side_kinds, only: side_kinds
   use m_decomposition, only: all_owners
   use m_remedies, only: remedy
   use m_model, only: model_t
   use m_energy, only: balance_t, sums_t, measure
   use m_machine, only: peak_memory
   use m_expectation, only: expectation_t
   use m_indicators, only: stress_error_t, estimate_stress_error
   use m_figures, only: figures_t
   use m_console, only: console_t
   use m_cost_report, only: cost_t, write_cost_report, cost_line_length
   use m_facts, only: facts_t, course_t, percent
   use m_contact_summary, only: say_contact
   implicit none
   private
   public :: summarise

   real(wp), parameter :: round_off = 1.0e-20_wp !< of mass times squared wave speed: strains of 1e-10
   real(wp), parameter :: notable = 0.05_wp !< of the largest energy or work: larger differences are reported
   real(wp), parameter :: notable_at_rest = 0.02_wp !< the same without inertia, where all terms of a step are
                                                    !< booked;
   real(wp), parameter :: works_at_rest = 0.03_wp !< and that of two figures of a work

contains

   !> Collective: print the closing summary and write cost.dat.
   subroutine summarise(console, scene, model, balance, course, expectation, guarded, retries, ranged, &
                        stepped, implicit_counts, figures, error)
      type(console_t), intent(inout) :: console
      type(scene_t), intent(in) :: scene
      type(model_t), intent(inout) :: model
      type(balance_t), intent(in) :: balance
      type(course_t), intent(in) :: course
      type(expectation_t), intent(in) :: expectation
      character(len=*), intent(in) :: guarded !< the guard's summary
      integer, intent(in) :: retries          !< after faults
      character(len=*), intent(in) :: stepped !< the integrator's summary of its steps; empty: nothing special
      integer(i8), intent(in) :: implicit_counts(5) !< as in m_integrator
      character(len=*), intent(in) :: ranged  !< warning of domains out of their range; empty: none
      type(figures_t), intent(inout) :: figures !< the same for programs
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
      call note_course(facts, console, scene, model, course, retries, implicit_counts, error)
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
      ! an earlier error is kept
      if (trouble%happened()) call fail(error, trouble%status, trouble%message)
      outcome = 'finished: '//scene%title
      if (course%stop_reason /= '') outcome = course%stop_reason
      if (error%happened()) outcome = 'stopped: '//error%message
      call take_figures(figures, facts, cost, outcome)
      call console%summary(outcome, int(model%step), model%time, [facts%lines, table])
   end subroutine summarise

   !> The numbers of the summary for programs.
   subroutine take_figures(figures, facts, cost, outcome)
      type(figures_t), intent(inout) :: figures
      type(facts_t), intent(in) :: facts
      type(cost_t), intent(in) :: cost
      character(len=*), intent(in) :: outcome !< how the run ended, a sentence
      integer :: l
      call figures%words('outcome_text', outcome)
      do l = 1, size(facts%notes)
         call figures%fact(trim(facts%notes(l)))
      end do
      call figures%number('particle_steps', real(cost%particle_steps, wp))
      do l = 1, size(cost%level_steps)
         call figures%number('particle_steps_level_'//to_text(l), real(cost%level_steps(l), wp))
      end do
   end subroutine take_figures

   !> How the run ended, and the number of steps of each kind, for programs.
   subroutine note_course(facts, console, scene, model, course, retries, implicit_counts, error)
      type(facts_t), intent(inout) :: facts
      type(console_t), intent(in) :: console
      type(scene_t), intent(in) :: scene
      type(model_t), intent(in) :: model
      type(course_t), intent(in) :: course
      integer, intent(in) :: retries
      integer(i8), intent(in) :: implicit_counts(5)
      type(error_t), intent(in) :: error
      character(len=:), allocatable :: outcome
      outcome = 'finished'
      if (course%stop_reason /= '') outcome = 'stopped'
      if (error%happened()) outcome = 'fault'
      call facts%note('outcome', outcome)
      call facts%note('title', trim(scene%title))
      call facts%note('program', program_version)
      call facts%note('simulated_s', exact_text(model%time))
      call facts%note('wall_s', to_text(console%elapsed()))
      call facts%note('retries', to_text(retries))
      if (implicit_counts(1) == 0) return
      call facts%note('implicit_steps', to_text(implicit_counts(1)))
      call facts%note('newton_iterations', to_text(implicit_counts(2)))
      call facts%note('linear_solves', to_text(implicit_counts(3)))
      call facts%note('linear_products', to_text(implicit_counts(4)))
      call facts%note('steps_halved', to_text(implicit_counts(5)))
   end subroutine note_course

   !> Collective: the summary lines of effects.
   subroutine say_effects(facts, model, balance)
      type(facts_t), intent(inout) :: facts
      type(model_t), intent(in) :: model
      type(balance_t), intent(in) :: balance
      character(len=:), allocatable :: text
      integer :: e
      if (any(model%effect_step%erodes)) &
         call facts%say('eroded: '//si(1000.0_wp*(balance%start%mass - balance%now%mass), 'g')// &
                        ' of failed material removed')
      do e = 1, size(model%effects)
         text = model%effects(e)%effect%summary(model%communicator, model%levels)
         if (text /= '') call facts%say(text)
      end do
   end subroutine say_effects

   !> Collective: memory used, and the expected cost beside the actual one. A run that ended early cost less.
   subroutine say_expectation(facts, console, model, expectation, whole)
      type(facts_t), intent(inout) :: facts
      type(console_t), intent(in) :: console
      type(model_t), intent(in) :: model
      type(expectation_t), intent(in) :: expectation
      logical, intent(in) :: whole !< the scene was completed
      real(wp) :: memory, took
      integer :: blocks
      memory = model%communicator%sum_real(real(peak_memory(), wp))
      took = model%communicator%maximum(console%elapsed())
      blocks = count(all_owners(model%levels) >= 0)
      call facts%say('memory: '//si(memory, 'B')//' on all ranks together, '//to_text(blocks)//' node blocks')
      call facts%note('node_blocks', to_text(blocks))
      call facts%note('memory_B', to_text(memory))
      if (.not. (expectation%made .and. whole)) return
      call facts%say('estimate at step '//to_text(expectation%step)//': '//duration(expectation%total)// &
                     ' and '//si(expectation%memory, 'B')//' in total; the run took '// &
                     off_by(took, expectation%total)//' time and '//off_by(memory, expectation%memory)// &
                     ' memory')
      call facts%note('expected_at_step', to_text(expectation%step))
      call facts%note('expected_elapsed_s', to_text(expectation%total))
      call facts%note('expected_memory_B', to_text(expectation%memory))
   end subroutine say_expectation

   !> Deviation from an expected value, as text.
   function off_by(value, expected) result(text)
      real(wp), intent(in) :: value, expected
      character(len=:), allocatable :: text
      text = to_text(100.0_wp*abs(value - expected)/expected, 2)//' % '// &
             trim(merge('more', 'less', value > expected))
   end function off_by

   !> Collective: the work of the ranks.
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
                                      ' % of the particle-steps were skipped')
      call facts%note('particle_steps_at_rest', to_text(resting))
      call facts%note('particles_at_start', to_text(course%particles))
      call facts%note('memory_at_start_B', to_text(course%memory))
      call facts%note('steps', to_text(model%step))
      call facts%note('particles_at_end', to_text(at_end))
      call facts%note('splits', to_text(splits))
      call facts%note('merges', to_text(merges))
      if (domain_kinds(scene%time%domain)%deforms .or. size(model%levels) > 1) &
         call facts%say('domains: '//to_text(splits)//' particles made by splitting, '//to_text(merges)// &
                        ' by merging eight, '//to_text(at_end)//' at the end')
      call say_placings(facts, model)
      if (model%communicator%ranks > 1) call facts%note('messages_a_step', to_text(messages))
      if (model%communicator%ranks > 1) call facts%note('bytes_sent_a_step', to_text(bytes))
      if (model%communicator%ranks > 1) &
         call facts%say('node sums: at most '//to_text(messages, 4)//' messages and '//to_text(bytes, 9)// &
                        ' B sent by a rank in a step')
   end subroutine say_work

   !> The placement of levels by the error.
   subroutine say_placings(facts, model)
      type(facts_t), intent(inout) :: facts
      type(model_t), intent(in) :: model
      character(len=:), allocatable :: text
      integer :: l
      do l = 2, size(model%levels)
         call facts%note('cells_level_'//to_text(l), to_text(model%levels(l)%region%cells()))
      end do
      if (model%placings == 0) return
      text = 'levels by the error: evaluated '//to_text(model%placings)//' times'
      do l = 2, size(model%levels)
         text = text//', level '//to_text(l)//' has '//to_text(model%levels(l)%region%cells())//' cells'
      end do
      if (model%bound_placings > 0) &
         text = text//'; the budget left out cells with an error above the tolerance at '// &
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
      if (all(.not. side_kinds(scene%grid%boundary)%closed) .and. size(model%effects) == 0) then
         scale = norm2(impulse)
         if (scale <= 0.0_wp) scale = sqrt(2.0_wp*sums%mass*balance%largest)
         text = text//', off by '//to_text(norm2(change - impulse), 3)//' kg m/s'// &
                percent(norm2(change - impulse), scale)
         if (norm2(impulse) > 0.0_wp) text = text//' of the impulse given'
         if (.not. norm2(impulse) > 0.0_wp) text = text//' of sqrt(2 mass x largest energy)'
         call facts%note('momentum_error_kg_m_s', to_text(norm2(change - impulse)))
      else
         text = text//'; held sides and effects account for the rest'
         if (any(model%effect_step%erodes)) text = text//', with the momentum of what was eroded'
      end if
      call facts%say(text)
      call facts%note('momentum_change_kg_m_s', to_text(norm2(change)))
      call facts%note('tool_impulse_kg_m_s', to_text(norm2(impulse)))
      mass = abs(sums%mass - balance%start%mass)
      call facts%say('mass: changed by '//to_text(mass, 3)//' of '//to_text(sums%mass, 3)//' kg')
      call facts%note('mass_error_kg', to_text(mass))
   end subroutine say_conservation

   !> The difference between the accumulated work of loads and their work by the motion of the particles; and
   !> its meaning if it is large.
   subroutine say_work_done(facts, scene, model, balance)
      type(facts_t), intent(inout) :: facts
      type(scene_t), intent(in) :: scene
      type(model_t), intent(in) :: model
      type(balance_t), intent(in) :: balance
      real(wp) :: limit
      limit = merge(notable, works_at_rest, model%has_inertia)*balance%largest
      if (any(model%effect_step%acts_on_nodes) .and. all(model%effect_step%follows_particles)) then
         call facts%note('work_apart_of_effects_J', to_text(balance%worst_of_effects))
         call facts%say(apart_text('effects: work', balance%worst_of_effects, balance%largest))
         if (balance%worst_of_effects > max(limit, quiet(model, balance))) then
            if (model%has_inertia) then
               call facts%say('WARNING: work of effects does not reach the particles they act on: their '// &
                              'forces act on nodes with almost no mass, and motion and stress there are '// &
                              'inaccurate by as much; '//remedy(scene, model))
            else
               call facts%say('WARNING: work of effects differs from that on the particles they act on: '// &
                              'faces turn or stretch much within a step, or nodes with almost no mass '// &
                              'move apart; motion and stress are inaccurate by as much; try a smaller '// &
                              'step and max_step; '// &
                              remedy(scene, model))
            end if
         end if
      end if
      if (size(scene%tools) == 0) return
      call facts%note('work_apart_of_tools_J', to_text(balance%worst_of_tools))
      call facts%say(apart_text('tools: work', balance%worst_of_tools, balance%largest))
      if (balance%worst_of_tools > max(limit, quiet(model, balance))) &
         call facts%say('WARNING: work of tools differs from the work on the particles they press: '// &
                        'the surface in contact does not move with the grid, and loads may be '// &
                        'inaccurate, by less or by more than this share; '//remedy(scene, model))
   end subroutine say_work_done

   !> Message with the two values of a work.
   function apart_text(what, apart, largest) result(text)
      character(len=*), intent(in) :: what
      real(wp), intent(in) :: apart, largest !< J
      character(len=:), allocatable :: text
      text = what//' at nodes or tools and work on particles differ by at most '// &
             si(apart, 'J')//percent(apart, largest)//' of the largest energy or work'
   end function apart_text

   !> Limit of energies that are round-off and not checked: nothing has moved, J.
   pure real(wp) function quiet(model, balance)
      type(model_t), intent(in) :: model
      type(balance_t), intent(in) :: balance
      quiet = round_off*balance%now%mass*model%bounds%wave_speed**2
   end function quiet

   !> Warn of notable spurious growth or loss of energy.
   subroutine warn_of_balance(facts, scene, model, balance)
      type(facts_t), intent(inout) :: facts
      type(scene_t), intent(in) :: scene
      type(model_t), intent(in) :: model
      type(balance_t), intent(in) :: balance
      character(len=:), allocatable :: text
      real(wp) :: limit
      limit = merge(notable, notable_at_rest, model%has_inertia)*balance%largest
      associate (at_once => model%static_losses%uncertainty)
         if (.not. balance%worst > max(limit, quiet(model, balance)) + at_once) return
         text = 'WARNING: '//trim(merge('spurious energy growth', 'energy loss           ', &
                                        balance%excess() > 0.0_wp))//': up to '// &
                si(balance%worst, 'J')//percent(balance%worst, balance%largest)//' of the largest'
         if (.not. model%has_inertia) then
            if (at_once > 0.0_wp) text = text//', of which '//si(at_once, 'J')// &
                                         ' may come of loads that act at once in the first step'
            text = text//'; where particles have moved far in a step, their forces are out of balance at '// &
                   'the new places'//hardest_worked(model)//'; '//remedy(scene, model)//', a smaller step'
         else if (balance%excess() > 0.0_wp) then
            text = text//'; '//remedy(scene, model)//', a smaller safety'
            if (scene%time%stress_update == update_usf) text = text//', stress_update=''usl'''
         else
            text = text//', in transfer or contact, where material tears, or in the energy that a law of '// &
                   'small strain has at large strain; '//remedy(scene, model)
            if (scene%time%flip_fraction < 1.0_wp) text = text//', flip_fraction=1'
            if (.not. scene%time%affine) text = text//', transfer=''affine'''
         end if
      end associate
      call facts%say(text)
   end subroutine warn_of_balance

   !> The tool with the largest work.
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

   !> Collective: the estimate of the discretisation error of the stress at the end, timed in a row of its
   !> own.
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
