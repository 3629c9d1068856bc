!> When a run writes a checkpoint, which checkpoints are kept, and whether the run ends with one: by its
!> schedule, by signals, by its wall-clock limit.
module m_keeper
   use m_kinds, only: wp, i8
   use m_errors, only: error_t
   use m_text, only: to_text, si, duration
   use m_timers, only: wall_time, phase_output
   use m_multiples, only: times_passed
   use m_signals, only: signal_caught, forget_checkpoint_signal, signal_user
   use m_called_off, only: called_off_t, asks_checkpoint, asks_end_limit, asks_end_interrupt
   use m_scene, only: scene_t, checkpoint_spec_t
   use m_model, only: model_t
   use m_energy, only: balance_t
   use m_recorder, only: recorder_t
   use m_checkpoint, only: write_checkpoint, particle_bytes, run_facts_t
   use m_checkpoint_file, only: remove_checkpoints, remove_parts
   implicit none
   private
   public :: keeper_t

   real(wp), parameter :: slow_disk = 1.0e8_wp !< bytes a second: assumed until a checkpoint has been timed

   type :: keeper_t
      private
      type(checkpoint_spec_t) :: spec
      logical :: writes = .false.               !< there is an output directory
      logical :: root = .false.
      character(len=:), allocatable :: directory
      character(len=:), allocatable :: last     !< path of the latest complete checkpoint here; empty: none
      integer(i8) :: last_step = -1             !< step of that checkpoint
      real(wp) :: end_time = 0.0_wp
      real(wp) :: made = 0.0_wp                 !< number of multiples of `every` passed
      integer :: row = phase_output             !< of the timers
      real(wp) :: began = 0.0_wp, last_wall = 0.0_wp !< s
      real(wp) :: longest = 0.0_wp !< longest time of a checkpoint, s; before the first an estimate
      logical :: measured = .false.             !< `longest` is measured
      real(wp) :: asked_at = 0.0_wp, step = 0.0_wp !< time of this rank's last request, and the time between
                                                   !< two of them, s
   contains
      procedure :: start
      procedure :: request
      procedure :: end_of_run
      procedure :: keep
      procedure :: is_due
      procedure :: keep_last
      procedure, private :: write => write_one
   end type keeper_t

contains

   !> Collective: at the start of a run, also of one continued from the checkpoint `last` (empty: not from its
   !> own directory). A run that does not continue its directory's run removes the checkpoints there, which
   !> belong to another run.
   subroutine start(self, scene, model, elapsed, last)
      class(keeper_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(model_t), intent(inout) :: model
      real(wp), intent(in) :: elapsed  !< s of wall-clock time since the program started
      character(len=*), intent(in) :: last
      self%spec = scene%checkpoint
      self%writes = scene%output%present
      self%root = model%communicator%is_root()
      self%end_time = scene%end_time
      self%last = last
      if (last /= '') self%last_step = model%step
      self%last_wall = wall_time()
      self%began = self%last_wall - elapsed
      self%asked_at = self%last_wall
      ! half of it, since twice the longest time is kept free
      if (self%writes .and. self%spec%wall_limit > 0.0_wp) &
         self%longest = 0.5_wp*particle_bytes(model, model%communicator%sum_count(model%particle_count())) &
                        /slow_disk
      if (self%spec%every > 0.0_wp) self%made = times_passed(self%spec%every, model%time)
      if (self%spec%present) self%row = model%timers%row_of('checkpoint')
      if (.not. self%writes) return
      self%directory = scene%output%directory
      if (.not. self%root) return
      if (last == '') call remove_checkpoints(self%directory, '', '')
      call remove_parts(self%directory)
   end subroutine start

   !> This rank's request before a step.
   integer function request(self)
      class(keeper_t), intent(inout) :: self
      type(called_off_t) :: by_signals
      real(wp) :: now
      request = by_signals%asks()
      if (signal_caught() == signal_user) request = asks_checkpoint
      if (.not. self%root) return
      now = wall_time()
      if (self%spec%every_wall > 0.0_wp .and. now - self%last_wall >= self%spec%every_wall) &
         request = max(request, asks_checkpoint)
      ! the longest step, with a slowly decaying memory
      self%step = max(now - self%asked_at, 0.9_wp*self%step)
      self%asked_at = now
      if (self%spec%wall_limit > 0.0_wp .and. now - self%began + 2.0_wp*(self%step + self%longest) &
          >= self%spec%wall_limit) &
         request = max(request, asks_end_limit)
   end function request

   !> The condition that may end the run in the middle of a step: a checkpoint must be written before the
   !> wall-clock limit.
   type(called_off_t) function end_of_run(self)
      class(keeper_t), intent(in) :: self
      if (self%root .and. self%spec%wall_limit > 0.0_wp) &
         end_of_run%deadline = self%began + self%spec%wall_limit - 2.0_wp*self%longest
   end function end_of_run

   !> True when a checkpoint must be written after this step.
   pure logical function is_due(self, model)
      class(keeper_t), intent(in) :: self
      type(model_t), intent(in) :: model
      is_due = model%requested_action >= asks_checkpoint
      if (self%spec%every > 0.0_wp) &
         is_due = is_due .or. model%time >= (self%made + 1.0_wp)*self%spec%every*(1.0_wp - 1.0e-12_wp)
      if (self%spec%every_steps > 0) is_due = is_due .or. mod(model%step, int(self%spec%every_steps, i8)) == 0
      if (self%spec%present) is_due = is_due .or. model%time >= self%end_time
      is_due = is_due .and. self%writes .and. model%step /= self%last_step
   end function is_due

   !> Collective: after a step and all its output. `reason`: why the run must end here; empty: it continues.
   subroutine keep(self, scene, model, balance, facts, recorder, reason, error, within)
      class(keeper_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(model_t), intent(inout) :: model
      type(balance_t), intent(inout) :: balance
      type(run_facts_t), intent(inout) :: facts
      type(recorder_t), intent(inout) :: recorder
      character(len=:), allocatable, intent(out) :: reason
      type(error_t), intent(inout) :: error
      logical, intent(in), optional :: within !< the next step was started and abandoned
      reason = ''
      if (error%happened()) return
      if (self%is_due(model)) call self%write(scene, model, balance, facts, recorder, error)
      if (error%happened()) return
      if (model%requested_action < asks_end_limit .or. model%time >= self%end_time) return
      select case (model%requested_action)
      case (asks_end_limit)
         reason = 'stopped at its wall limit of '//duration(self%spec%wall_limit)
      case (asks_end_interrupt)
         reason = 'stopped by SIGINT'
      case default
         reason = 'stopped by SIGTERM'
      end select
      if (present(within)) reason = reason//' within step '//to_text(model%step + 1)//', which begins anew'
      reason = reason//', step '//to_text(model%step)//', time '//si(model%time, 's')
      if (self%writes) then
         reason = reason//'; to go on: gimp3d --restart '//self%directory
      else
         reason = reason//', without a checkpoint: the scene has no &output'
      end if
   end subroutine keep

   !> Collective: if a run with &checkpoint ends by an error, write its last good state, unless there is a
   !> checkpoint of it.
   subroutine keep_last(self, scene, model, balance, facts, recorder, error)
      class(keeper_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(model_t), intent(inout) :: model
      type(balance_t), intent(inout) :: balance
      type(run_facts_t), intent(inout) :: facts
      type(recorder_t), intent(inout) :: recorder
      type(error_t), intent(inout) :: error
      if (.not. (self%spec%present .and. self%writes) .or. model%step == self%last_step) return
      call self%write(scene, model, balance, facts, recorder, error)
   end subroutine keep_last

   !> Collective: write a checkpoint; of the older ones, one is kept.
   subroutine write_one(self, scene, model, balance, facts, recorder, error)
      class(keeper_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(model_t), intent(inout) :: model
      type(balance_t), intent(inout) :: balance
      type(run_facts_t), intent(inout) :: facts
      type(recorder_t), intent(inout) :: recorder
      type(error_t), intent(inout) :: error
      character(len=:), allocatable :: path
      call model%timers%enter(self%row)
      self%last_wall = wall_time()
      call recorder%sync(model%communicator, error)
      if (.not. error%happened()) &
         call write_checkpoint(self%directory, scene, model, balance, facts, path, error)
      call model%timers%leave()
      if (error%happened()) return
      if (self%root) call remove_checkpoints(self%directory, path, self%last)
      self%last = path
      self%last_step = model%step
      if (self%spec%every > 0.0_wp) self%made = times_passed(self%spec%every, model%time)
      if (.not. self%measured) self%longest = 0.0_wp ! it was an estimate
      self%measured = .true.
      self%longest = max(self%longest, wall_time() - self%last_wall)
      self%last_wall = wall_time()
      self%asked_at = self%last_wall
      call forget_checkpoint_signal()
   end subroutine write_one

end module m_keeper
