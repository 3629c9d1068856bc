!> A run: the scene, its model, and the time loop with output.
module m_simulation
   use m_kinds, only: wp, i8
   use m_constants, only: exit_files, exit_numerical, exit_stopped
   use m_errors, only: error_t, fail
   use m_filesystem, only: remove_file
   use m_communicator, only: communicator_t
   use m_launcher, only: check_launch
   use m_text, only: to_text, si
   use m_timers, only: phase_output, phase_contact
   use m_scene_schema, only: scene_schema
   use m_scene, only: scene_t
   use m_offer, only: catalogue_t
   use m_materials, only: known_materials
   use m_effects, only: known_effects
   use m_snapshot_formats, only: known_formats
   use m_model, only: model_t
   use m_speed_bounds, only: bound_speeds
   use m_integrator, only: integrator_t
   use m_advance, only: explicit_t
   use m_move_regions, only: move_regions
   use m_changing, only: changing_t
   use m_time_step, only: longest_step, check_time_step
   use m_guard, only: guard_t
   use m_remedies, only: remedy
   use m_domain_range, only: domain_range_t
   use m_energy, only: balance_t
   use m_recorder, only: recorder_t
   use m_checkpoint, only: run_facts_t
   use m_called_off, only: asks_end_lost
   use m_keeper, only: keeper_t
   use m_output_lock, only: output_lock_t
   use m_signals, only: catch_signals
   use m_arguments, only: arguments_t, read_arguments
   use m_resume, only: read_run, resume_run, resumed_t
   use m_scene_reader, only: read_scene
   use m_scene_writer, only: scene_as_namelist
   use m_console, only: console_t
   use m_introduction, only: introduce
   use m_plan, only: print_plan
   use m_figures, only: figures_t
   use m_static_plan, only: print_static_plan
   use m_expectation, only: expectation_t
   use m_facts, only: course_t
   use m_closing_summary, only: summarise
   implicit none
   private
   public :: simulation_t

   type :: simulation_t
      type(communicator_t) :: communicator
      type(arguments_t) :: arguments
      type(catalogue_t) :: catalogue
      type(scene_t) :: scene
      type(model_t) :: model
      class(integrator_t), allocatable :: integrator
      type(balance_t) :: balance
      type(recorder_t) :: recorder
      type(console_t) :: console
      type(error_t) :: error
      type(keeper_t) :: keeper
      type(output_lock_t) :: lock
      type(guard_t) :: guard
      type(domain_range_t) :: range
      type(run_facts_t) :: facts
      type(course_t) :: course
      type(expectation_t) :: expectation
   contains
      procedure :: initialise
      procedure :: done
      procedure :: step
      procedure :: finalise
      procedure, private :: record
      procedure, private :: check_state
      procedure, private :: meet_fault
      procedure, private :: leave_directory
   end type simulation_t

   integer, parameter :: rebalance_every = 100        !< steps
   integer, parameter :: placement_lasts = 500 !< steps over which moves of blocks must pay, as work changes
                                               !< slowly

contains

   !> Collective: read the scene, build the model, write its first state; or continue from a checkpoint.
   subroutine initialise(self)
      class(simulation_t), intent(inout) :: self
      type(resumed_t) :: before
      self%course%stop_reason = ''
      call self%communicator%start()
      call self%console%start(self%communicator)
      call read_command(self)
      if (self%error%happened() .or. self%arguments%answer /= '') return
      call check_launch(self%communicator, self%error)
      if (self%error%happened()) return
      call take_scene(self, before)
      if (self%error%happened() .or. self%arguments%answer /= '') return
      if (.not. self%scene%plans) call catch_signals() ! a plan has nothing to save
      call self%model%build(self%communicator, self%scene, self%error, empty=before%happened)
      if (self%error%happened()) return
      if (before%happened) then
         call resume_run(before, self%scene, self%model, self%balance, self%facts, self%recorder, self%lock, &
                         self%error)
      else
         call bound_speeds(self%model)
      end if
      if (self%error%happened()) return
      if (self%scene%quasi_static%present) then
         allocate (changing_t :: self%integrator)
      else
         allocate (explicit_t :: self%integrator)
      end if
      call self%integrator%start(self%scene, self%model)
      call self%range%start(self%scene)
      self%course%particles = self%communicator%sum_count(self%model%particle_count())
      ! for a new run only, as particles may be faster later
      if (.not. before%happened) call check_time_step(self%scene, self%model, self%error)
      if (self%error%happened()) return
      if (self%scene%plans) call make_plan(self)
      if (self%scene%plans) return
      if (.not. before%happened) then
         call begin_records(self)
         if (self%error%happened()) return
      end if
      if (self%scene%output%present .and. .not. before%ended) &
         call self%console%open_log(self%communicator, self%scene%output%directory//'/run.log', self%error, &
                                    resume=before%in_place)
      if (self%error%happened()) return ! the checkpoints of an older run still exist
      if (.not. before%ended) &
         call self%keeper%start(self%scene, self%model, self%console%elapsed(), before%newest_here())
      call start_guard(self)
      if (before%happened) call self%guard%remember(self%facts%guard)
      call introduce(self%console, self%scene, self%catalogue, self%model, self%course%particles, &
                     self%course%memory)
      call self%console%line('guard      '//self%guard%sentence(self%model))
      if (before%happened) call self%console%line(before%sentence(self%model%step, self%model%time))
      if (allocated(self%lock%note)) call self%console%line('run.lock   '//self%lock%note)
      if (.not. before%happened) call self%record()
      call save(self, written=.true.)
      call self%expectation%start(self%model, self%console%elapsed())
   end subroutine initialise

   !> Read the command line; answer options that only print.
   subroutine read_command(self)
      class(simulation_t), intent(inout) :: self
      call known_materials(self%catalogue)
      call known_effects(self%catalogue)
      call known_formats(self%catalogue)
      call read_arguments(self%arguments, self%error)
      if (self%arguments%schema) self%arguments%answer = scene_schema(self%catalogue)
      if (self%arguments%answer /= '') call self%console%line(self%arguments%answer)
   end subroutine read_command

   !> Collective: start the output of a new run, from its first state on.
   subroutine begin_records(self)
      class(simulation_t), intent(inout) :: self
      self%facts%particles = self%course%particles
      call self%balance%begin(self%model)
      if (self%scene%output%present) &
         call self%lock%take(self%communicator, self%scene%output%directory, self%error)
      if (self%error%happened()) return
      call self%recorder%start(self%scene, self%model, self%error)
      if (self%error%happened()) return
      self%facts%probes = self%recorder%probe_ids()
   end subroutine begin_records

   subroutine start_guard(self)
      class(simulation_t), intent(inout) :: self
      call self%guard%start(self%scene%guard, self%model, longest_step(self%scene, self%model, &
            self%model%time), remedy(self%scene, self%model))
   end subroutine start_guard

   !> Collective: print the plan instead of running.
   subroutine make_plan(self)
      class(simulation_t), intent(inout) :: self
      type(figures_t) :: figures
      call introduce(self%console, self%scene, self%catalogue, self%model, self%course%particles, &
                     self%course%memory)
      call start_guard(self)
      call self%console%line('guard      '//self%guard%sentence(self%model))
      call self%balance%begin(self%model)
      call self%guard%save(self%model, self%balance, written=.true.)
      if (self%scene%quasi_static%present) then
         call print_static_plan(self%console, self%scene, self%model, self%integrator, figures, self%error)
      else
         call print_plan(self%console, self%scene, self%model, self%guard%kept_bytes(self%model), figures, &
                         self%error)
      end if
      if (self%arguments%json /= '' .and. .not. self%error%happened()) &
         call figures%write(self%communicator, self%arguments%json, self%error)
   end subroutine make_plan

   !> Collective: read the scene and the checkpoint to continue from; or print the scene as its section.
   subroutine take_scene(self, before)
      class(simulation_t), intent(inout) :: self
      type(resumed_t), intent(out) :: before
      if (.not. self%arguments%sections) then
         call read_run(self%communicator, self%arguments, self%catalogue, self%scene, before, self%lock, &
                       self%error)
         return
      end if
      call read_scene(self%communicator, self%catalogue, self%arguments%scene, self%scene, self%error, &
                      as_section=.true.)
      if (self%error%happened()) return
      self%arguments%answer = scene_as_namelist(self%scene)
      call self%console%line(self%arguments%answer(:len(self%arguments%answer) - 1))
   end subroutine take_scene

   !> True when the scene has ended or the run cannot continue.
   pure logical function done(self)
      class(simulation_t), intent(in) :: self
      done = self%error%happened() .or. self%course%stop_reason /= '' .or. self%scene%plans &
             .or. self%arguments%answer /= ''
      if (.not. done) done = self%model%time >= self%scene%end_time
   end function done

   !> Collective: one step and its output.
   subroutine step(self)
      class(simulation_t), intent(inout) :: self
      real(wp) :: time_step
      logical :: written
      time_step = self%integrator%next_step(self%scene, self%model, self%guard%share())
      self%model%requested_action = self%keeper%request()
      if (self%lock%is_lost()) self%model%requested_action = asks_end_lost
      self%model%wants_sums = self%recorder%history_is_due(self%model%time + time_step)
      call self%integrator%end_by(self%keeper%end_of_run())
      call self%integrator%step(self%model, time_step, self%error)
      call self%console%lines(self%integrator%messages())
      if (self%integrator%was_called_off()) then
         call self%keeper%keep(self%scene, self%model, self%balance, self%facts, self%recorder, &
                               self%course%stop_reason, self%error, within=.true.)
         return
      end if
      call move_regions(self%model, self%error)
      self%course%steps = self%course%steps + 1
      if (self%course%steps == 1) call forget_end(self) ! of the run that this one continues
      if (self%model%requested_action == asks_end_lost) call self%leave_directory()
      written = self%recorder%snapshot_is_due(self%model%time) .or. self%keeper%is_due(self%model)
      call self%check_state(written)
      if (.not. self%error%happened()) call self%record()
      if (self%error%happened()) then
         call self%meet_fault()
         return
      end if
      call self%expectation%update(self%scene, self%model, self%guard, self%console%elapsed())
      if (self%course%early_elapsed <= 0.0_wp .and. self%model%time >= 0.9_wp*self%scene%end_time) then
         self%course%early_contact = self%model%timers%seconds(phase_contact)
         self%course%early_elapsed = self%console%elapsed()
      end if
      if (mod(self%model%step, int(rebalance_every, i8)) == 0) then
         call self%model%reduce_accumulated()
         call self%model%rebalance(self%error, placement_lasts)
      end if
      self%facts%guard = self%guard%facts()
      call self%keeper%keep(self%scene, self%model, self%balance, self%facts, self%recorder, &
                            self%course%stop_reason, self%error)
      call save(self, written)
      call self%recorder%show_rows()
      call self%console%progress(int(self%model%step), self%model%time, self%scene%end_time, &
                                 self%balance%error())
   end subroutine step

   !> Collective: check the state after a step, all of it when it is `written` or a check of the guard is due.
   subroutine check_state(self, written)
      class(simulation_t), intent(inout) :: self
      logical, intent(in) :: written
      character(len=:), allocatable :: messages
      if (.not. self%error%happened()) &
         call self%guard%check_step(self%model, longest_step(self%scene, self%model, self%model%time), &
                                      self%scene%quasi_static%holds_at(self%model%time), self%error)
      if (self%error%happened()) return
      call self%range%check(self%model, self%model%time >= self%scene%end_time, messages, self%error)
      if (messages /= '') call self%console%line(messages)
      if (self%error%happened() .or. .not. (written .or. self%guard%check_is_due(self%model))) return
      call self%guard%check(self%model, self%balance, self%error)
   end subroutine check_state

   !> Collective: let the guard copy this state, and mark the histories.
   subroutine save(self, written)
      class(simulation_t), intent(inout) :: self
      logical, intent(in) :: written
      if (self%done()) return
      call self%guard%save(self%model, self%balance, written)
      if (self%guard%has_saved(self%model)) call self%recorder%mark()
   end subroutine save

   !> Remove cost.dat of an earlier end, which is no longer valid.
   subroutine forget_end(self)
      class(simulation_t), intent(in) :: self
      logical :: gone
      if (self%scene%output%present .and. self%communicator%is_root()) &
         call remove_file(self%scene%output%directory//'/cost.dat', gone)
   end subroutine forget_end

   !> Collective: after an error, roll back to the last good state and continue with smaller steps; or end the
   !> run, and write that state to the disk.
   subroutine meet_fault(self)
      class(simulation_t), intent(inout) :: self
      character(len=:), allocatable :: report
      type(error_t) :: closing
      logical :: stands
      if (self%guard%can_go_back(self%error)) then
         call self%guard%go_back(self%model, self%balance, self%error, report)
         call self%recorder%go_back(self%model, self%error)
         call self%console%line(report)
         return
      end if
      if (self%error%status /= exit_numerical) return
      stands = self%integrator%keeps_state()
      if (.not. stands) call self%guard%give_up(self%model, self%balance, self%error, stands)
      if (.not. stands .or. .not. self%scene%output%present) return
      call self%recorder%record_snapshot(self%model, closing, now=.true.)
      self%facts%guard = self%guard%facts()
      if (.not. closing%happened()) &
         call self%keeper%keep_last(self%scene, self%model, self%balance, self%facts, self%recorder, closing)
      if (closing%happened()) then
         self%error%message = self%error%message//'; the last good state could not be saved: '// &
                              closing%message
      else
         self%error%message = self%error%message//'; the last good state, of step '// &
                              to_text(self%model%step)//', stands in '//self%scene%output%directory
      end if
   end subroutine meet_fault

   !> All ranks: another run has taken over the output directory; this one ends and writes nothing there any
   !> more.
   subroutine leave_directory(self)
      class(simulation_t), intent(inout) :: self
      call fail(self%error, exit_files, 'another run has taken over '//self%scene%output%directory// &
                ' while this one was suspended (run.lock there names another process); this one ends at '// &
                'time '//si(self%model%time, 's')//' and writes nothing more')
      call self%console%finish()
      self%course%steps = 0
   end subroutine leave_directory

   !> Collective: write the output that is due.
   subroutine record(self)
      class(simulation_t), intent(inout) :: self
      call self%model%timers%enter(phase_output)
      if (self%recorder%history_is_due(self%model%time)) then
         call self%balance%follow(self%model)
         call self%guard%check_energy(self%model, self%balance, self%error)
         if (.not. self%error%happened()) &
            call self%guard%check_work(self%model, self%balance, self%model%time >= self%scene%end_time, &
                                         self%error)
         if (.not. self%error%happened()) &
            call self%recorder%record_history(self%model, self%balance, self%error)
      end if
      if (.not. self%error%happened()) call self%recorder%record_snapshot(self%model, self%error)
      call self%model%timers%leave()
   end subroutine record

   !> Collective: close everything; returns the exit status.
   integer function finalise(self) result(status)
      class(simulation_t), intent(inout) :: self
      type(figures_t) :: figures
      type(error_t) :: closing
      call self%recorder%finish(self%error)
      call self%communicator%agree(self%error)
      if (self%course%steps > 0) &
         call summarise(self%console, self%scene, self%model, self%balance, self%course, self%expectation, &
                        self%guard%summary(), self%guard%retries, self%range%said, &
                        self%integrator%summary(), self%integrator%counts(), figures, self%error)
      if (self%course%steps > 0 .and. self%arguments%json /= '') &
         call figures%write(self%communicator, self%arguments%json, closing)
      if (closing%happened()) call fail(self%error, closing%status, closing%message)
      if (.not. self%error%happened() .and. self%course%stop_reason /= '') &
         call fail(self%error, exit_stopped, self%course%stop_reason)
      status = self%error%status
      call self%console%finish()
      call self%lock%release()
      if (allocated(self%integrator)) call self%integrator%release()
      call self%model%release()
      if (allocated(self%integrator)) call self%integrator%finish()
   end function finalise

end module m_simulation
