!> Failure detection and recovery: checks the state after a step, keeps a copy of the last good one, and after
!> an error rolls back to it and continues with smaller steps (doc/developer/theory.md, Guard).
!>
!> Each level's step checks by itself (g2p_stage and stress_stage, contact): finite positions and stresses,
!> volumes above 0, displacements of at most half a cell, convergence of contact. Here: the time step after
!> each step, and every `save_every` steps, and before output, all fields of all particles and the balance of
!> energy.
module m_guard
   use m_kinds, only: wp, i8
   use m_constants, only: exit_numerical
   use m_errors, only: error_t, fail
   use m_text, only: to_text, si
   use m_machine, only: free_memory
   use m_scene, only: guard_spec_t
   use m_field_table, only: bytes_per_column
   use m_model, only: model_t
   use m_energy, only: balance_t, sums_t, measure
   use m_complaints, only: check_fields, fastest_text
   use m_saved_state, only: saved_state_t
   use m_particle_store, only: bytes_besides
   implicit none
   private
   public :: guard_t

   integer, parameter, public :: guard_facts = 6 !< values of the guard's state in a checkpoint

   type :: guard_t
      private
      type(guard_spec_t) :: spec
      character(len=:), allocatable :: advice !< what to try when works differ
      type(saved_state_t) :: saved
      logical :: saves = .false.          !< a copy is kept: memory suffices
      real(wp) :: free = 0.0_wp           !< free memory of the machines when the program started, bytes
      integer :: row = 0                  !< of the timers
      real(wp) :: quiet = 0.0_wp          !< energies below this are not checked, J
      real(wp) :: first_step = 0.0_wp     !< the first explicit time step, s; 0: none yet
      integer(i8) :: checked = 0           !< step of the last check of all fields
      logical :: implicit = .false.       !< the next step is implicit: a copy costs little beside such a step
      logical :: clean = .true.           !< no notable spurious energy at that check
      integer(i8) :: apart_since = -1     !< first step at which works differed too much; -1: they do not
      integer :: attempt = 0              !< retries of the present error; 0: none
      logical :: gave_up = .false.        !< the run has ended and the model is restored from the copy
      real(wp) :: until = 0.0_wp          !< time up to which the reduced step is used, s
      integer, public :: retries = 0      !< number of retries of the run
      real(wp) :: last_retry = 0.0_wp     !< time of the last retry, s
   contains
      procedure :: start
      procedure :: facts
      procedure :: remember
      procedure :: sentence
      procedure :: kept_bytes
      procedure :: share
      procedure :: check_step
      procedure :: check_is_due
      procedure :: check
      procedure :: check_energy
      procedure :: check_work
      procedure :: save
      procedure :: can_go_back
      procedure :: go_back
      procedure :: give_up
      procedure :: has_saved
      procedure :: summary
   end type guard_t

   real(wp), parameter :: clean_share = 0.1_wp !< of the energy limit
   real(wp), parameter :: largest_part = 0.5_wp !< of the free memory: limit for the copies
   real(wp), parameter :: quiet_share = 1.0e-10_wp !< of mass times squared wave speed: at the onset of loads
                                                   !< work lags by half a step
   real(wp), parameter :: unsettled = 100.0_wp !< multiple of that: below it works are not compared
   integer, parameter :: settling = 20         !< steps for which works may differ at the onset of a load or
                                               !< contact
   integer, parameter :: max_doublings = 10   !< of the time for which smaller steps are used beyond an error
   integer, parameter :: longest_wait = 10     !< for a clean state, in units of save_every

contains

   !> Collective: initialise when the model is in the run's initial state. All ranks must have room for their
   !> copies.
   subroutine start(self, spec, model, time_step, advice)
      class(guard_t), intent(inout) :: self
      type(guard_spec_t), intent(in) :: spec
      type(model_t), intent(inout) :: model
      real(wp), intent(in) :: time_step !< the first, s
      character(len=*), intent(in) :: advice !< what to try when works differ
      type(sums_t) :: sums
      self%spec = spec
      self%advice = advice
      if (model%has_statics) then ! energies have integration errors of long steps, which are no sign of an
                                  ! error
         self%spec%energy_limit = 0.0_wp
         self%spec%work_limit = 0.0_wp
      end if
      self%row = model%timers%row_of('guard')
      self%first_step = time_step
      self%checked = model%step
      self%free = free_memory(model%communicator)
      self%saves = fits(self, model)
      if (self%saves) self%saves = model%communicator%sum_real(real(copy_bytes(model), wp)) &
                                   <= largest_part*self%free
      sums = measure(model)
      self%quiet = quiet_share*sums%mass*model%bounds%wave_speed**2
   end subroutine start

   !> Collective: true when the copies of all ranks fit within the scene's memory limit.
   logical function fits(self, model)
      class(guard_t), intent(in) :: self
      type(model_t), intent(in) :: model
      fits = model%communicator%maximum(real(copy_bytes(model), wp)) <= self%spec%memory
   end function fits

   !> Collective: memory of the copies of all ranks, bytes.
   real(wp) function kept_bytes(self, model)
      class(guard_t), intent(in) :: self
      type(model_t), intent(in) :: model
      kept_bytes = 0.0_wp
      if (self%saves) kept_bytes = model%communicator%sum_real(real(copy_bytes(model), wp))
   end function kept_bytes

   !> Bytes of the copy of this rank's particles, with room for growth.
   pure integer(i8) function copy_bytes(model)
      type(model_t), intent(in) :: model
      associate (particles => model%particle_count())
         copy_bytes = (particles + particles/16)*(bytes_per_column*model%levels(1)%table%columns &
                                                  + bytes_besides)
      end associate
   end function copy_bytes

   !> The guard's state for a checkpoint.
   pure function facts(self) result(values)
      class(guard_t), intent(in) :: self
      real(wp) :: values(guard_facts)
      values = [real(self%attempt, wp), self%until, real(self%retries, wp), self%last_retry, &
               self%first_step, &
                real(self%apart_since, wp)]
   end function facts

   !> Restore the guard's state from a checkpoint.
   pure subroutine remember(self, values)
      class(guard_t), intent(inout) :: self
      real(wp), intent(in) :: values(guard_facts)
      self%attempt = nint(max(0.0_wp, min(values(1), 100.0_wp)))
      self%until = values(2)
      self%retries = nint(max(0.0_wp, min(values(3), 1.0e9_wp)))
      self%last_retry = values(4)
      self%first_step = values(5)
      self%apart_since = nint(max(-1.0_wp, min(values(6), 1.0e18_wp)), i8)
   end subroutine remember

   !> Collective: a description of the guard's settings, for the introduction of a run.
   function sentence(self, model) result(text)
      class(guard_t), intent(in) :: self
      type(model_t), intent(in) :: model
      character(len=:), allocatable :: text
      real(wp) :: bytes
      bytes = model%communicator%maximum(real(copy_bytes(model), wp))
      if (.not. self%saves) then
         text = 'no copy to roll back to: it would take '//si(bytes, 'B')//' a rank, '
         if (bytes > self%spec%memory) then
            text = text//'&guard memory allows '//si(self%spec%memory, 'B')
         else
            text = text//'only '//si(self%free, 'B')//' are free in all'
         end if
         text = text//'; a fault ends the run'
      else
         text = 'a copy every '//to_text(self%spec%save_every)//' steps, '
         if (model%has_statics) text = text//'and after each implicit one, '
         text = text//si(bytes, 'B')//' a rank; '
         if (self%spec%retries == 0) then
            text = text//'a fault ends the run'
         else
            text = text//'up to '//count_text(self%spec%retries)//' of a fault'
         end if
      end if
   end function sentence

   !> The factor of the given time step to be used now.
   pure real(wp) function share(self)
      class(guard_t), intent(in) :: self
      share = 0.5_wp**self%attempt
   end function share

   !> Collective: after each step. Beyond an error the full step is used again; a time step that has become
   !> very small is an error.
   subroutine check_step(self, model, time_step, implicit, error)
      class(guard_t), intent(inout) :: self
      type(model_t), intent(in) :: model
      real(wp), intent(in) :: time_step !< the next one, without the reduction factor, s
      logical, intent(in) :: implicit   !< the next step is implicit; such steps have a limit of their own
      type(error_t), intent(inout) :: error
      if (self%attempt > 0 .and. model%time >= self%until) then
         self%attempt = 0
         self%checked = model%step - self%spec%save_every ! check now, and save the state
      end if
      self%implicit = implicit
      if (implicit) then ! an implicit step is no reference for explicit ones
         self%first_step = 0.0_wp
      else if (self%first_step <= 0.0_wp) then
         self%first_step = time_step
      end if
      if (time_step >= self%spec%step_limit*self%first_step) return
      call fail(error, exit_numerical, fastest_text(model)//': that makes the time step '// &
                to_text(time_step, 3)//' s, less than '//to_text(self%spec%step_limit)// &
                ' of the first one, '//to_text(self%first_step, 3)// &
                ' s; try a smaller safety, or a smaller &guard step_limit if this is meant', &
                recoverable=.true.)
   end subroutine check_step

   !> True when all fields must be checked after this step.
   pure logical function check_is_due(self, model)
      class(guard_t), intent(in) :: self
      type(model_t), intent(in) :: model
      check_is_due = self%implicit .or. model%step - self%checked >= self%spec%save_every
   end function check_is_due

   !> Collective: check all fields of all particles, and the energy.
   subroutine check(self, model, balance, error)
      class(guard_t), intent(inout) :: self
      type(model_t), intent(inout) :: model
      type(balance_t), intent(in) :: balance
      type(error_t), intent(inout) :: error
      type(balance_t) :: seen
      call model%timers%enter(self%row)
      self%checked = model%step
      self%clean = .true.
      call check_fields(model, error)
      if (.not. error%happened() .and. max(self%spec%energy_limit, self%spec%work_limit) > 0.0_wp) then
         seen = balance%glance(model)
         call self%check_energy(model, seen, error)
         if (.not. error%happened()) call self%check_work(model, seen, .false., error)
         if (self%spec%energy_limit > 0.0_wp) &
            self%clean = seen%excess() <= clean_share*self%spec%energy_limit*max(seen%largest, self%quiet)
      end if
      call model%timers%leave()
   end subroutine check

   !> Collective: check for spurious energy growth. Losses are no error: PIC and contact dissipate.
   subroutine check_energy(self, model, balance, error)
      class(guard_t), intent(in) :: self
      type(model_t), intent(in) :: model
      type(balance_t), intent(in) :: balance !< the same on all ranks, up to round-off
      type(error_t), intent(inout) :: error
      real(wp) :: largest
      largest = max(balance%largest, self%quiet)
      if (self%spec%energy_limit > 0.0_wp &
          .and. .not. balance%excess() <= self%spec%energy_limit*largest &
                                          + model%static_losses%uncertainty) then
         call fail(error, exit_numerical, fastest_text(model)//': '//to_text(balance%excess(), 3)// &
                   ' J of spurious energy growth, more than '//to_text(self%spec%energy_limit)// &
                   ' of the largest energy or work, '//to_text(balance%largest, 3)// &
                   ' J; try a smaller safety', recoverable=.true.)
      end if
   end subroutine check_energy

   !> Collective: check that the work of loads equals their work on the particles, except in the first steps
   !> of a load or contact. Smaller steps would not change a difference.
   subroutine check_work(self, model, balance, ends, error)
      class(guard_t), intent(inout) :: self
      type(model_t), intent(in) :: model
      type(balance_t), intent(in) :: balance !< the same on all ranks, up to round-off
      logical, intent(in) :: ends !< the scene ends with this step: last check
      type(error_t), intent(inout) :: error
      associate (apart => max(abs(balance%effects_apart), merge(0.0_wp, abs(balance%tools_apart), &
                                                                model%has_statics)))
         if (self%spec%work_limit <= 0.0_wp .or. &
             apart <= self%spec%work_limit*max(balance%largest, unsettled*self%quiet)) then
            self%apart_since = -1
         else
            if (self%apart_since < 0) self%apart_since = model%step
            if (model%step - self%apart_since < settling .and. .not. (ends &
                  .and. model%step >= settling)) return
            call fail(error, exit_numerical, 'time '//si(model%time, 's')//': '//work_text(balance)//': '// &
                      to_text(apart, 3)//' J of difference, more than '//to_text(self%spec%work_limit)// &
                      ' of the largest energy or work, '//to_text(balance%largest, 3)// &
                      ' J; '//self%advice)
         end if
      end associate
   end subroutine check_work

   !> Message on the work of the loads whose two values differ more.
   function work_text(balance) result(text)
      type(balance_t), intent(in) :: balance
      character(len=:), allocatable :: text
      if (abs(balance%effects_apart) >= abs(balance%tools_apart)) then
         text = 'the work of &pressure and &gravity at the nodes differs from their work on the particles'
      else
         text = 'the work of the tools differs from the work on the particles that they press'
      end if
   end function work_text

   !> Collective: copy a state that has passed the check, unless the run is still in a retry or has slight
   !> spurious energy; the latter delays a copy only for a limited time. `written`: this state is on the disk
   !> and must not be written again, so the copy is made in any case.
   subroutine save(self, model, balance, written)
      class(guard_t), intent(inout) :: self
      type(model_t), intent(inout) :: model
      type(balance_t), intent(inout) :: balance
      logical, intent(in) :: written
      if (.not. self%saves .or. self%checked /= model%step) return
      if (.not. written) then
         if (self%attempt > 0) return
         if (.not. self%clean .and. model%step - self%saved%step < longest_wait*self%spec%save_every) return
      end if
      call model%timers%enter(self%row)
      self%saves = fits(self, model)
      if (self%saves) then
         call self%saved%take(model, balance)
      else
         call self%saved%forget()
      end if
      call model%timers%leave()
   end subroutine save

   !> True when an error may be overcome by smaller steps from the copy, and retries remain.
   pure logical function can_go_back(self, error)
      class(guard_t), intent(in) :: self
      type(error_t), intent(in) :: error
      can_go_back = error%recoverable .and. self%saved%holds .and. self%attempt < self%spec%retries
   end function can_go_back

   !> Collective: roll back to the copy and halve the steps until as far beyond the error as it is from the
   !> copy, with each further retry of a run twice as far: what is unstable at the full step would fail again.
   !> Clears the error; `report` describes it.
   subroutine go_back(self, model, balance, error, report)
      class(guard_t), intent(inout) :: self
      type(model_t), intent(inout) :: model
      type(balance_t), intent(inout) :: balance
      type(error_t), intent(inout) :: error
      character(len=:), allocatable, intent(out) :: report
      real(wp) :: fault
      call model%timers%enter(self%row)
      self%retries = self%retries + 1
      self%attempt = self%attempt + 1
      fault = model%time
      self%last_retry = fault
      report = 'retry '//to_text(self%retries)//': '//error%message//'; rolls back to step '// &
               to_text(self%saved%step)//', time '// &
               si(self%saved%time, 's')//', continues with 1/'//to_text(2**self%attempt)//' of the time step'
      call self%saved%give_back(model, balance)
      self%until = max(self%until, fault + 2.0_wp**min(self%retries - 1, max_doublings) &
                       *max(fault - model%time, self%spec%save_every*self%first_step))
      self%checked = model%step
      self%apart_since = -1
      error = error_t()
      call model%timers%leave()
   end subroutine go_back

   !> Collective: the run ends; the model is restored from the copy, if there is one, and the message says so.
   subroutine give_up(self, model, balance, error, stands)
      class(guard_t), intent(inout) :: self
      type(model_t), intent(inout) :: model
      type(balance_t), intent(inout) :: balance
      type(error_t), intent(inout) :: error
      logical, intent(out) :: stands !< the model is valid for output
      stands = self%saved%holds
      if (.not. stands) return
      if (self%attempt > 0 .and. error%recoverable) then
         error%message = error%message//'; '//count_text(self%attempt)//' with steps down to 1/'// &
                         to_text(2**self%attempt)//' failed too'
      else if (self%attempt > 0) then
         error%message = error%message//'; steps were 1/'//to_text(2**self%attempt)// &
                         ' of the usual ones after an earlier fault (run.log)'
      end if
      call self%saved%give_back(model, balance)
      self%gave_up = .true.
   end subroutine give_up

   !> True when the copy is of the model's present step.
   pure logical function has_saved(self, model)
      class(guard_t), intent(in) :: self
      type(model_t), intent(in) :: model
      has_saved = self%saved%holds .and. self%saved%step == model%step
   end function has_saved

   !> A summary of the retries, for the closing summary.
   function summary(self) result(text)
      class(guard_t), intent(in) :: self
      character(len=:), allocatable :: text
      text = 'guard: no retries'
      if (self%retries > 0) text = 'guard: '//count_text(self%retries)//', the last at time '// &
                                   si(self%last_retry, 's')// &
                                   ' (run.log has them all)'
      if (self%gave_up) text = text//'; figures of this summary are of the last good state, step '// &
                               to_text(self%saved%step)// &
                               ', time '//si(self%saved%time, 's')
   end function summary

   pure function count_text(retries) result(text)
      integer, intent(in) :: retries
      character(len=:), allocatable :: text
      text = to_text(retries)//' retries'
      if (retries == 1) text = '1 retry'
   end function count_text

end module m_guard
