!> Continuation of a run from a checkpoint: which one, with what scene, and what may have changed.
module m_resume
   use m_kinds, only: wp, i8
   use m_constants, only: exit_input
   use m_errors, only: error_t, fail
   use m_communicator, only: communicator_t
   use m_filesystem, only: same_file, is_directory
   use m_text, only: to_text, si
   use m_offer, only: catalogue_t
   use m_scene, only: scene_t
   use m_scene_words, only: field_words
   use m_scene_reader, only: read_scene, interpret_scene
   use m_scene_writer, only: physics_as_namelist
   use m_arguments, only: arguments_t
   use m_model, only: model_t
   use m_energy, only: balance_t
   use m_recorder, only: recorder_t, resumption_t
   use m_output_lock, only: output_lock_t
   use m_checkpoint, only: checkpoint_t, run_facts_t
   implicit none
   private
   public :: read_run, resume_run, resumed_t

   !> The state of a continued run.
   type :: resumed_t
      logical :: happened = .false. !< the run is continued
      logical :: in_place = .false. !< output goes to the directory of the previous run
      logical :: ended = .false.    !< and that run has completed the scene: nothing is to be done or written
      type(checkpoint_t) :: checkpoint
   contains
      procedure :: newest_here
      procedure :: sentence
   end type resumed_t

   character(len=*), &
      parameter :: may_differ = 'only end_time, &guard, &output and &checkpoint may be other than they were'

contains

   !> Collective: read the scene, from a file, from standard input, or from the checkpoint named on the
   !> command line. A run continued in its directory holds the lock from here on, so that no other run changes
   !> the checkpoints that it reads.
   subroutine read_run(communicator, arguments, catalogue, scene, before, lock, error)
      type(communicator_t), intent(in) :: communicator
      type(arguments_t), intent(in) :: arguments
      type(catalogue_t), intent(in) :: catalogue
      type(scene_t), intent(out) :: scene
      type(resumed_t), intent(out) :: before
      type(output_lock_t), intent(inout) :: lock
      type(error_t), intent(inout) :: error
      type(scene_t) :: earlier
      character(len=:), allocatable :: directory, text
      logical :: named
      directory = arguments%restart
      named = directory /= ''
      if (.not. named) then
         call read_scene(communicator, catalogue, arguments%scene, scene, error)
         if (arguments%plans .and. scene%restart /= '') call fail(error, exit_input, &
            '--plan: a plan needs a whole run and cannot start from a checkpoint; allowed without restart')
         if (error%happened()) return
         scene%plans = scene%plans .or. arguments%plans
         directory = scene%restart
         if (directory == '') return
         before%in_place = goes_on_in(communicator, scene, directory)
      else
         before%in_place = communicator%sum_count(merge(1_i8, 0_i8, is_directory(directory))) > 0
      end if
      before%happened = .true.
      if (before%in_place) call lock%take(communicator, directory, error)
      call before%checkpoint%open(communicator, directory, error)
      call before%checkpoint%scene_text(text, error)
      if (error%happened()) return
      call interpret_scene(communicator, catalogue, text, earlier, error, kept=.true.)
      if (error%happened()) then
         error%message = 'cannot restart from '//before%checkpoint%path//', its scene: '//error%message
         return
      end if
      if (named) then
         scene = earlier
         scene%output%directory = directory ! it may have been renamed
         return
      end if
      if (any(scene%output%fields() .neqv. earlier%output%fields())) then
         call fail(error, exit_input, '&output fields='//words_of(scene)//' was '//words_of(earlier)// &
                   ' in '//before%checkpoint%path//'; particles carry what these need from the start, so '// &
                   'fields must be as they were')
         return
      end if
      call check_physics(before%checkpoint%path, physics_as_namelist(earlier), physics_as_namelist(scene), &
                         error)
   end subroutine read_run

   !> The fields requested by a scene, in its words.
   function words_of(scene) result(text)
      type(scene_t), intent(in) :: scene
      character(len=:), allocatable :: text
      logical :: asked(3)
      integer :: f
      asked = scene%output%fields()
      text = ''
      do f = 1, 3
         if (asked(f)) text = text//','''//trim(field_words(f))//''''
      end do
      text = text(min(2, len(text) + 1):)
      if (text == '') text = '''none'''
   end function words_of

   !> Collective: true when a scene writes to the directory of the run that it continues.
   logical function goes_on_in(communicator, scene, directory)
      type(communicator_t), intent(in) :: communicator
      type(scene_t), intent(in) :: scene
      character(len=*), intent(in) :: directory
      goes_on_in = .false.
      if (.not. scene%output%present) return
      goes_on_in = scene%output%directory == directory
      if (communicator%is_root() .and. .not. goes_on_in) goes_on_in = same_file(scene%output%directory, &
            directory)
      goes_on_in = communicator%sum_count(merge(1_i8, 0_i8, goes_on_in)) > 0
   end function goes_on_in

   !> Collective: restore everything from the checkpoint into a model built without particles. If the previous
   !> run has completed the scene in this directory, its output is not changed.
   subroutine resume_run(before, scene, model, balance, facts, recorder, lock, error)
      type(resumed_t), intent(inout) :: before
      type(scene_t), intent(in) :: scene
      type(model_t), intent(inout) :: model
      type(balance_t), intent(inout) :: balance
      type(run_facts_t), intent(inout) :: facts
      type(recorder_t), intent(inout) :: recorder
      type(output_lock_t), intent(inout) :: lock
      type(error_t), intent(inout) :: error
      type(resumption_t) :: resumption
      allocate (facts%probes(size(scene%probes)), source=0_i8)
      call before%checkpoint%restore(model, balance, facts, error)
      call before%checkpoint%close()
      if (error%happened()) return
      if (scene%end_time < model%time*(1.0_wp - 1.0e-12_wp)) then
         call fail(error, exit_input, scene%place('end_time')//': must be at least '//to_text(model%time)// &
                   ' s, where the run stands in '//before%checkpoint%path)
         return
      end if
      before%ended = before%in_place .and. model%time >= scene%end_time
      if (before%ended) return
      if (scene%output%present) call lock%take(model%communicator, scene%output%directory, error)
      if (error%happened()) return
      resumption%directory = before%checkpoint%directory
      resumption%in_place = before%in_place
      resumption%probes = facts%probes
      call recorder%start(scene, model, error, resumption)
   end subroutine resume_run

   !> Path of the checkpoint, if the run continues in its directory; else empty.
   function newest_here(self) result(path)
      class(resumed_t), intent(in) :: self
      character(len=:), allocatable :: path
      path = ''
      if (self%in_place) path = self%checkpoint%path
   end function newest_here

   !> Message on the continuation, and on damaged checkpoints.
   function sentence(self, step, time) result(text)
      class(resumed_t), intent(in) :: self
      integer(i8), intent(in) :: step
      real(wp), intent(in) :: time
      character(len=:), allocatable :: text
      text = 'goes on    from '//self%checkpoint%path//', step '//to_text(step)//', time '//si(time, 's')
      if (self%checkpoint%note /= '') text = text//' ('//self%checkpoint%note//')'
   end function sentence

   !> Check that the groups that must not change are the same: if not, a message with the first difference.
   subroutine check_physics(path, before, now, error)
      character(len=*), intent(in) :: path, before, now
      type(error_t), intent(inout) :: error
      character(len=:), allocatable :: group, old, new
      integer :: at_old, at_new
      if (before == now) return
      at_old = 1
      at_new = 1
      group = ''
      do
         old = next_line(before, at_old)
         new = next_line(now, at_new)
         if (old /= new) exit
         if (index(old, '&') == 1) group = old
      end do
      if (is_variable(old) .and. is_variable(new)) then
         call fail(error, exit_input, group//' '//new//' was '//old//' in '//path//'; '//may_differ)
      else if (is_variable(new)) then
         call fail(error, exit_input, group//' '//new//' was not there in '//path//'; '//may_differ)
      else if (is_variable(old)) then
         call fail(error, exit_input, group//' '//old//' is missing, it was there in '//path//'; '// &
                   may_differ)
      else if (old /= '' .and. (new == '' .or. index(before(min(at_old, len(before)):), new) > 0)) then
         call fail(error, exit_input, 'a group '//old//' is missing, it was there in '//path//'; '// &
                   may_differ)
      else
         call fail(error, exit_input, 'the group '//new//' was not there in '//path//'; '//may_differ)
      end if
   end subroutine check_physics

   pure logical function is_variable(line)
      character(len=*), intent(in) :: line
      is_variable = index(line, '=') > 0
   end function is_variable

   !> A line without surrounding blanks; empty at the end of the text.
   function next_line(text, at) result(line)
      character(len=*), intent(in) :: text
      integer, intent(inout) :: at
      character(len=:), allocatable :: line
      integer :: length
      line = ''
      if (at > len(text)) return
      length = index(text(at:)//new_line('a'), new_line('a')) - 1
      line = trim(adjustl(text(at:at + length - 1)))
      at = at + length + 1
   end function next_line

end module m_resume
