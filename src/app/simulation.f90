!> A run: the scene, its model, and everything around the steps.
module m_simulation
   use m_kinds, only: wp, i8
   use m_constants, only: exit_input, exit_numerical, exit_stopped
   use m_errors, only: error_t, fail
   use m_communicator, only: communicator_t
   use m_text, only: to_text, si
   use m_timers, only: phase_output, phase_contact
   use m_scene, only: scene_t, domain_fixed
   use m_scene_reader, only: read_scene
   use m_scene_checks, only: safety_limit
   use m_offer, only: catalogue_t
   use m_field_table, only: field_table_t, bytes_per_column
   use m_materials, only: known_materials
   use m_effects, only: known_effects
   use m_level, only: level_t
   use m_model, only: model_t
   use m_level_step, only: bound_speeds
   use m_advance, only: advance
   use m_energy, only: balance_t
   use m_guard, only: guard_t
   use m_recorder, only: recorder_t
   use m_checkpoint, only: run_facts_t
   use m_keeper, only: keeper_t
   use m_signals, only: catch_signals
   use m_resume, only: read_run, resume_run, resumed_t
   use m_console, only: console_t
   use m_cost_report, only: cost_t, write_cost_report, cost_line_length
   implicit none
   private
   public :: simulation_t

   type :: simulation_t
      type(communicator_t) :: communicator
      type(catalogue_t) :: catalogue
      type(scene_t) :: scene
      type(model_t) :: model
      type(balance_t) :: balance
      type(recorder_t) :: recorder
      type(console_t) :: console
      type(error_t) :: error
      type(keeper_t) :: keeper
      type(guard_t) :: guard
      type(run_facts_t) :: facts
      integer(i8) :: particles = 0       !< when the program began
      integer(i8) :: steps = 0           !< that the program has taken, repeated ones too
      character(len=:), allocatable :: stop_reason !< why the run ends before the scene does; empty: it does not
      real(wp) :: early_elapsed = 0.0_wp !< wall-clock time when the last tenth of the scene began, s; 0 before that
      real(wp) :: early_contact = 0.0_wp !< of that, in contact, s
   contains
      procedure :: initialise
      procedure :: done
      procedure :: step
      procedure :: finalise
      procedure, private :: next_time_step
      procedure, private :: given_time_step
      procedure, private :: record
      procedure, private :: look
      procedure, private :: meet_fault
      procedure, private :: introduce
      procedure, private :: summarise
   end type simulation_t

   integer, parameter :: rebalance_every = 200        !< steps

contains

   !> Collective: read the scene, build the model, write its first state; or go on from a checkpoint.
   subroutine initialise(self)
      class(simulation_t), intent(inout) :: self
      type(resumed_t) :: before
      self%stop_reason = ''
      call self%communicator%start()
      call self%console%start(self%communicator)
      call catch_signals()
      call known_materials(self%catalogue)
      call known_effects(self%catalogue)
      call read_run(self%communicator, self%catalogue, self%scene, before, self%error)
      if (self%error%happened()) return
      call self%model%build(self%communicator, self%scene, self%error, empty=before%happened)
      if (self%error%happened()) return
      if (before%happened) then
         call resume_run(before, self%scene, self%model, self%balance, self%facts, self%recorder, self%error)
      else
         call bound_speeds(self%model)
      end if
      if (self%error%happened()) return
      self%particles = self%communicator%sum_count(self%model%particle_count())
      call check_time_step(self)
      if (self%error%happened()) return
      if (.not. before%happened) then
         self%facts%particles = self%particles
         call self%balance%begin(self%model)
         call self%recorder%start(self%scene, self%model, self%error)
         if (self%error%happened()) return
         self%facts%probes = self%recorder%probe_ids()
      end if
      if (self%scene%output%present) call self%console%open_log(self%communicator, self%scene%output%directory//'/run.log', &
                                                                self%error, resume=before%in_place)
      call self%keeper%start(self%scene, self%model, self%console%elapsed(), before%newest_here())
      call self%guard%start(self%scene%guard, self%model, self%given_time_step())
      if (before%happened) call self%guard%remember(self%facts%guard)
      call self%introduce()
      if (before%happened) call self%console%line(before%sentence(self%model%step, self%model%time))
      if (.not. before%happened) call self%record()
      call save(self, written=.true.)
   end subroutine initialise

   !> A given time step must be one with which the explicit scheme can be stable.
   subroutine check_time_step(self)
      class(simulation_t), intent(inout) :: self
      real(wp) :: limit
      limit = safety_limit(self%scene)*self%model%stepped_cell()/(self%model%wave_speed() + self%model%bounds%particle_speed)
      if (self%scene%time%time_step > limit) call fail(self%error, exit_input, '&time time_step='// &
          to_text(self%scene%time%time_step)//': must be at most '//to_text(limit)//' s, '// &
          to_text(safety_limit(self%scene))//' cells over the speed of sound')
   end subroutine check_time_step

   !> True when the scene has ended or the run cannot go on.
   pure logical function done(self)
      class(simulation_t), intent(in) :: self
      done = self%error%happened() .or. self%stop_reason /= ''
      if (.not. done) done = self%model%time >= self%scene%end_time
   end function done

   !> Collective: one step, and what is to be written after it.
   subroutine step(self)
      class(simulation_t), intent(inout) :: self
      logical :: written
      self%model%asked = self%keeper%request()
      call advance(self%model, self%next_time_step(), self%error)
      self%steps = self%steps + 1
      written = self%recorder%snapshot_is_due(self%model%time) .or. self%keeper%is_due(self%model)
      call self%look(written)
      if (.not. self%error%happened()) call self%record()
      if (self%error%happened()) then
         call self%meet_fault()
         return
      end if
      if (self%early_elapsed <= 0.0_wp .and. self%model%time >= 0.9_wp*self%scene%end_time) then
         self%early_contact = self%model%timers%seconds(phase_contact)
         self%early_elapsed = self%console%elapsed()
      end if
      if (mod(self%model%step, int(rebalance_every, i8)) == 0) then
         call self%model%fold()
         call self%model%rebalance(self%error)
      end if
      self%facts%guard = self%guard%facts()
      call self%keeper%keep(self%scene, self%model, self%balance, self%facts, self%recorder, self%stop_reason, self%error)
      call save(self, written)
      call self%console%progress(int(self%model%step), self%model%time, self%scene%end_time, self%balance%error())
   end subroutine step

   !> Collective: whether the state after a step can be trusted, all of it when it is `written` or the guard's turn has come.
   subroutine look(self, written)
      class(simulation_t), intent(inout) :: self
      logical, intent(in) :: written
      if (.not. self%error%happened()) call self%guard%look_at_step(self%model, self%given_time_step(), self%error)
      if (self%error%happened() .or. .not. (written .or. self%guard%look_is_due(self%model))) return
      call self%guard%look(self%model, self%balance, self%error)
   end subroutine look

   !> Collective: let the guard keep this state, from which the histories would go on.
   subroutine save(self, written)
      class(simulation_t), intent(inout) :: self
      logical, intent(in) :: written
      if (self%done()) return
      call self%guard%save(self%model, self%balance, written)
      if (self%guard%has_saved(self%model)) call self%recorder%mark()
   end subroutine save

   !> Collective: after a fault, back to the last good state and on with smaller steps; or the end, with that state on the disk.
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
      call self%guard%give_up(self%model, self%balance, self%error, stands)
      if (.not. stands .or. .not. self%scene%output%present) return
      call self%recorder%record_snapshot(self%model, closing, now=.true.)
      self%facts%guard = self%guard%facts()
      if (.not. closing%happened()) &
         call self%keeper%keep_last(self%scene, self%model, self%balance, self%facts, self%recorder, closing)
      if (closing%happened()) then
         self%error%message = self%error%message//'; the last good state could not be written: '//closing%message
      else
         self%error%message = self%error%message//'; the last good state, of step '//to_text(self%model%step)//', stands in '// &
                              self%scene%output%directory
      end if
   end subroutine meet_fault

   !> safety cell / (c + |v|), c and |v| as they are now; or the given one.
   pure real(wp) function given_time_step(self) result(time_step)
      class(simulation_t), intent(in) :: self
      real(wp) :: speed
      integer :: t
      time_step = self%scene%time%time_step
      if (time_step > 0.0_wp) return
      speed = self%model%bounds%particle_speed
      do t = 1, size(self%model%contact%tools)
         speed = max(speed, abs(self%model%contact%tools(t)%speed_at(self%model%time)))
      end do
      time_step = self%scene%time%safety*self%model%stepped_cell()/(self%model%wave_speed() + speed)
   end function given_time_step

   !> The given time step, or a share of it after a fault. Shortened a little, so that a whole number of such steps ends at the
   !> end time: a short last step would show in the contact load.
   pure real(wp) function next_time_step(self) result(time_step)
      class(simulation_t), intent(in) :: self
      real(wp) :: remaining
      time_step = self%guard%share()*self%given_time_step()
      remaining = self%scene%end_time - self%model%time
      time_step = remaining/max(1_i8, ceiling(remaining/time_step - 1.0e-6_wp, i8))
   end function next_time_step

   !> Collective: write what is due.
   subroutine record(self)
      class(simulation_t), intent(inout) :: self
      call self%model%timers%enter(phase_output)
      if (self%recorder%history_is_due(self%model%time)) then
         call self%balance%follow(self%model)
         call self%guard%look_at_energy(self%model, self%balance%excess(), self%balance%largest, self%error)
         if (.not. self%error%happened()) call self%recorder%record_history(self%model, self%balance, self%error)
      end if
      if (.not. self%error%happened()) call self%recorder%record_snapshot(self%model, self%error)
      call self%model%timers%leave()
   end subroutine record

   !> Memory (bytes) and blocks of a level on this rank.
   elemental integer(i8) function own_bytes(level)
      type(level_t), intent(in) :: level
      own_bytes = level%bytes()
   end function own_bytes

   elemental integer function own_blocks(level)
      type(level_t), intent(in) :: level
      own_blocks = size(level%blocks)
   end function own_blocks

   !> Collective: say what will be run.
   subroutine introduce(self)
      class(simulation_t), intent(inout) :: self
      integer(i8) :: bytes, blocks
      real(wp) :: time_step
      bytes = self%communicator%sum_count(sum(own_bytes(self%model%levels)))
      blocks = self%communicator%sum_count(int(sum(own_blocks(self%model%levels)), i8))
      time_step = self%next_time_step()
      associate (grid => self%model%levels(1)%grid)
         call self%console%line('gimp3d: '//self%scene%title)
         call self%console%line('grid       '//to_text(grid%cells(1))//' x '//to_text(grid%cells(2))//' x '// &
                                to_text(grid%cells(3))//' cells of '//si(grid%cell, 'm')//', '// &
                                to_text(blocks)//' blocks with material')
         if (size(self%model%levels) > 1) call introduce_levels(self, time_step)
         call self%console%line('particles  '//to_text(self%particles)//' on '//to_text(self%communicator%ranks)//' rank(s), '// &
                                si(real(bytes, wp), 'B')//' in all, '//to_text(real(bytes, wp)/self%particles, 3)//' B a particle')
         call self%console%line('time       '//si(self%scene%end_time, 's')//' in steps of '//si(time_step, 's')//', about '// &
                                to_text(ceiling(self%scene%end_time/time_step, i8))//' steps')
         call self%console%line('fields     '//fields_text(self%model%levels(1)%table))
         call self%console%line('effects    '//effects_text(self))
         call self%console%line('guard      '//self%guard%sentence(self%model))
      end associate
   end subroutine introduce

   !> Collective: a line a level, and the cells of all of them beside those of a grid as fine everywhere.
   subroutine introduce_levels(self, time_step)
      class(simulation_t), intent(inout) :: self
      real(wp), intent(in) :: time_step !< of the coarsest level, s
      real(wp) :: lower(3), upper(3), step
      integer(i8) :: blocks, cells, finest, own(size(self%model%levels)), particles
      integer :: l, n
      n = size(self%model%levels)
      step = time_step
      do l = 1, n
         associate (level => self%model%levels(l), grid => self%model%levels(l)%grid)
            lower = grid%lower
            upper = grid%upper
            if (l > 1) then
               lower = grid%lower + level%region%low*grid%cell
               upper = grid%lower + level%region%high*grid%cell
               if (self%model%method%subcycle) step = 0.5_wp*step
            end if
            own(l) = cells_in_box(level)
            if (l < n) own(l) = own(l) - cells_in_box(self%model%levels(l + 1))/8
            blocks = self%communicator%sum_count(int(size(level%blocks), i8))
            particles = self%communicator%sum_count(level%particle_count())
            call self%console%line('level '//to_text(l)//'    '//place_text(lower)//' to '//place_text(upper)//', '// &
                                   to_text(cells_in_box(level))//' cells of '//si(grid%cell, 'm')//', '//to_text(blocks)// &
                                   ' blocks, '//to_text(particles)//' particles, steps of '//si(step, 's'))
         end associate
      end do
      cells = sum(own)
      finest = product(int(self%model%levels(n)%grid%cells, i8))
      call self%console%line('cells      '//to_text(cells)//' on all levels, '//to_text(100.0_wp*cells/finest, 3)//' % of the '// &
                             to_text(finest)//' of a grid as fine as level '//to_text(n)//' everywhere')
   end subroutine introduce_levels

   !> Cells in the box of a level, those that a finer one covers too.
   pure integer(i8) function cells_in_box(level) result(cells)
      type(level_t), intent(in) :: level
      if (level%number == 1) then
         cells = product(int(level%grid%cells, i8))
      else
         cells = product(int(level%region%high - level%region%low, i8))
      end if
   end function cells_in_box

   function place_text(place) result(text)
      real(wp), intent(in) :: place(3) !< m
      character(len=:), allocatable :: text
      text = '('//to_text(place(1))//', '//to_text(place(2))//', '//to_text(place(3))//')'
   end function place_text

   !> What a particle carries: each field with its number of columns.
   function fields_text(table) result(text)
      type(field_table_t), intent(in) :: table
      character(len=:), allocatable :: text
      integer :: f
      text = ''
      do f = 1, size(table%fields)
         text = text//table%fields(f)%name//' '//to_text(table%fields(f)%components)//', '
      end do
      text = text//'together '//to_text(bytes_per_column*table%columns)//' B a particle'
   end function fields_text

   !> What the scene calls for, with the bytes a particle that it adds, and what it could have called for.
   function effects_text(self) result(text)
      class(simulation_t), intent(in) :: self
      character(len=:), allocatable :: text, off
      integer :: e, k
      text = ''
      off = ''
      associate (table => self%model%levels(1)%table, effects => self%model%effects)
         call add(self%scene%time%affine, 'affine transfer', table%bytes_of('velocity_gradient'))
         call add(self%scene%time%domain /= domain_fixed, 'deforming domains', &
                  table%bytes_of('domain') + table%bytes_of('half_size') + table%bytes_of('generation') - bytes_per_column)
         call add(size(self%scene%tools) > 0, 'tool contact', table%bytes_of('contact_pressure'))
         call add(self%model%contact%friction%present, 'friction', table%bytes_of('contact_friction'))
         call add(size(self%scene%probes) > 0, 'probes', 0)
         do k = 1, size(self%catalogue%effects)
            associate (name => self%catalogue%effects(k)%it%name)
               if (all([(effects(e)%effect%name /= name, e=1, size(effects))])) call add(.false., name, 0)
               do e = 1, size(effects)
                  if (effects(e)%effect%name == name) call add(.true., name, bytes_per_column*effects(e)%columns)
               end do
            end associate
         end do
      end associate
      if (text == '') text = 'none'
      if (off /= '') text = text//'; left out: '//off
   contains
      subroutine add(on, name, bytes)
         logical, intent(in) :: on
         character(len=*), intent(in) :: name
         integer, intent(in) :: bytes !< a particle
         if (on) then
            if (text /= '') text = text//', '
            text = text//name//' ('//to_text(bytes)//' B a particle)'
         else
            if (off /= '') off = off//', '
            off = off//name
         end if
      end subroutine add
   end function effects_text

   !> Collective: close everything; returns the exit status.
   integer function finalise(self) result(status)
      class(simulation_t), intent(inout) :: self
      call self%recorder%finish(self%error)
      call self%communicator%agree(self%error)
      if (self%steps > 0) call self%summarise()
      if (.not. self%error%happened() .and. self%stop_reason /= '') call fail(self%error, exit_stopped, self%stop_reason)
      status = self%error%status
      call self%console%finish()
      call self%model%release()
   end function finalise

   !> Collective: the closing summary and cost.dat.
   subroutine summarise(self)
      class(simulation_t), intent(inout) :: self
      type(cost_t) :: cost
      character(len=cost_line_length), allocatable :: table(:)
      character(len=cost_line_length) :: facts(12)
      character(len=:), allocatable :: verdict, path
      real(wp) :: bridge, messages, bytes, late(2)
      integer(i8) :: at_end, resting, splits
      integer :: l, n
      resting = self%communicator%sum_count(self%model%particle_steps_at_rest)
      splits = self%communicator%sum_count(self%model%splits)
      at_end = self%communicator%sum_count(self%model%particle_count())
      messages = self%communicator%maximum(real(sum(self%model%exchange%messages) + sum(self%model%composite%messages), wp) &
                                           /self%steps)
      bytes = self%communicator%maximum(real(sum(self%model%exchange%bytes) + sum(self%model%composite%bytes), wp) &
                                        /self%steps)
      bridge = self%communicator%maximum(self%model%contact%worst_bridge)
      late = contact_share(self)
      cost%timers = self%model%timers
      cost%particle_steps = self%communicator%sum_count(self%model%particle_steps)
      allocate (cost%level_steps(size(self%model%level_steps)))
      do l = 1, size(cost%level_steps)
         cost%level_steps(l) = self%communicator%sum_count(self%model%level_steps(l))
      end do
      cost%elapsed = self%console%elapsed()
      cost%time = self%model%time
      path = ''
      if (self%scene%output%present) path = self%scene%output%directory//'/cost.dat'
      call write_cost_report(self%communicator, cost, path, table, self%error)
      verdict = 'finished: '//self%scene%title
      if (self%stop_reason /= '') verdict = self%stop_reason
      if (self%error%happened()) verdict = 'stopped: '//self%error%message
      n = 2
      facts(1) = 'energy balance error: at most '//si(self%balance%worst, 'J')//' of '//si(self%balance%largest, 'J')
      facts(2) = 'momentum: changed by '//to_text(norm2(self%balance%now%momentum - self%balance%start%momentum), 3)//' kg m/s'
      associate (contact => self%model%contact)
         if (contact%active() .and. contact%solves > 0) then
            n = 7
            facts(3) = 'contact: '//to_text(contact%solves)//' solves, '// &
                       to_text(real(contact%iterations, wp)/contact%solves, 3)//' iterations and '// &
                       to_text(real(contact%system%products, wp)/contact%solves, 3)//' products each, at most '// &
                       to_text(contact%largest)//' candidates'
            facts(4) = 'contact: largest residual '//to_text(contact%worst_residual, 3)//' (relative), '// &
                       to_text(contact%unsolved)//' steps above the tolerance'
            facts(5) = 'contact: largest overlap '//to_text(contact%worst_overlap/ &
                                                            self%model%levels(size(self%model%levels))%grid%cell, 3)//' cells'
            facts(6) = 'contact: no tension; force times gap at most '//to_text(bridge, 3)//' of largest force times cell'
            facts(7) = 'contact: '//to_text(late(1), 3)//' % of the elapsed time'
            if (self%early_elapsed > 0.0_wp) facts(7) = trim(facts(7))//', '//to_text(late(2), 3)// &
                                                        ' % over the last tenth of the scene'
            if (contact%friction%present) then
               n = 8
               facts(8) = 'friction: '//to_text(real(contact%friction%sweeps, wp)/contact%solves, 3)//' sweeps and '// &
                          to_text(real(contact%friction%iterations, wp)/contact%solves, 3)//' iterations a solve, heat '// &
                          si(sum(contact%states%heat), 'J')
            end if
         end if
      end associate
      if (resting > 0) then
         n = n + 1
         facts(n) = 'at rest: '//to_text(100.0_wp*resting/cost%particle_steps, 3)//' % of the particle-steps had nothing to do'
      end if
      if (self%scene%time%domain /= domain_fixed .or. size(self%model%levels) > 1) then
         n = n + 1
         facts(n) = 'domains: '//to_text(splits)//' particles made by splitting, '//to_text(at_end)//' at the end'
      end if
      if (self%communicator%ranks > 1) then
         n = n + 1
         facts(n) = 'node sums: at most '//to_text(messages, 4)//' messages and '//to_text(bytes, 9)//' B sent by a rank in a step'
      end if
      n = n + 1
      facts(n) = self%guard%summary()
      call self%console%summary(verdict, int(self%model%step), self%model%time, [facts(:n), table])
   end subroutine summarise

   !> Collective: what share of the time contact took, per cent: over the run, and over the last tenth of the scene.
   function contact_share(self) result(share)
      class(simulation_t), intent(in) :: self
      real(wp) :: share(2)
      real(wp) :: elapsed, seconds
      integer :: i
      elapsed = self%console%elapsed()
      seconds = self%model%timers%seconds(phase_contact)
      share(1) = seconds/elapsed
      share(2) = (seconds - self%early_contact)/(elapsed - self%early_elapsed)
      do i = 1, 2
         share(i) = 100.0_wp*self%communicator%maximum(share(i))
      end do
   end function contact_share

end module m_simulation
