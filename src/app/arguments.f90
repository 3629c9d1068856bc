!> The command-line arguments.
module m_arguments
   use m_constants, only: exit_input, program_version
   use m_errors, only: error_t, fail
   implicit none
   private
   public :: read_arguments

   type, public :: arguments_t
      character(len=:), allocatable :: scene   !< file of the scene; empty: standard input
      character(len=:), allocatable :: restart !< directory of the run to be continued; empty: none
      character(len=:), allocatable :: json    !< file for the figures of the plan or run; empty: none
      character(len=:), allocatable :: answer  !< print this text only; empty: a run
      logical :: plans = .false.               !< as mode='plan' of &scene
      logical :: schema = .false.              !< print the schema of scenes only
      logical :: sections = .false.            !< print the scene converted to its section
   end type arguments_t

   character(len=*), parameter :: newline = new_line('a'), usage = &
      'usage: gimp3d [--plan | --section] [--json FILE] [SCENE.nml], gimp3d < SCENE.nml, or '// &
      'gimp3d --restart DIRECTORY'
   character(len=*), parameter :: help = usage//newline//newline// &
      '  SCENE.nml            the scene, a namelist file (doc/user/input.md); without: standard input'// &
      newline// &
      '  --plan               say what the run would take, in time, memory and output; run nothing'// &
      newline// &
      '  --section            write the scene as one that is given by its section, axisymmetric or plane'// &
      newline// &
      '                       strain, or say what stands against it; run nothing'//newline// &
      '  --json FILE          write the figures of the plan or run to FILE too'//newline// &
      '  --restart DIRECTORY  continue the run of DIRECTORY from its newest complete checkpoint'//newline// &
      '  --schema             what a scene may say, as a JSON Schema for editors'//newline// &
      '  --version            the version of the program'//newline// &
      '  --help               this text'//newline//newline// &
      'On several ranks: mpirun -n RANKS gimp3d SCENE.nml'//newline// &
      'Exit status: 0 finished, 2 bad input, 3 numerical failure, 4 files, 5 stopped after a checkpoint'

contains

   !> Read the arguments, the same on all ranks.
   subroutine read_arguments(arguments, error)
      type(arguments_t), intent(out) :: arguments
      type(error_t), intent(inout) :: error
      character(len=:), allocatable :: word
      integer :: n
      arguments = arguments_t('', '', '', '')
      n = 1
      do while (n <= command_argument_count() .and. .not. error%happened())
         word = argument(n)
         n = n + 1
         select case (word)
         case ('--help', '-h'); arguments%answer = help
         case ('--version'); arguments%answer = 'gimp3d '//program_version
         case ('--plan'); arguments%plans = .true.
         case ('--schema'); arguments%schema = .true.
         case ('--section'); arguments%sections = .true.
         case ('--json'); call take(arguments%json, 'file')
         case ('--restart'); call take(arguments%restart, 'directory')
         case default
            if (index(word, '-') == 1 .or. word == '' .or. arguments%scene /= '') then
               call fail(error, exit_input, 'unknown argument '//word//'; '//usage)
            else
               arguments%scene = word
            end if
         end select
      end do
      if (arguments%sections .and. (arguments%plans .or. arguments%restart /= '')) call fail(error, &
         exit_input, '--section goes with a scene alone, not with --plan or --restart; '//usage)
      n = max(1, verify(arguments%restart, '/', back=.true.)) ! trailing slashes are not part of the name
      if (arguments%restart /= '') arguments%restart = arguments%restart(:n)
      if (arguments%restart /= '' .and. (arguments%scene /= '' .or. arguments%plans)) &
         call fail(error, exit_input, &
         '--restart goes with no scene and no --plan: the checkpoint has its scene; '//usage)
   contains
      !> Take the value after an option.
      subroutine take(value, what)
         character(len=:), allocatable, intent(out) :: value
         character(len=*), intent(in) :: what
         value = ''
         if (n <= command_argument_count()) value = argument(n)
         n = n + 1
         if (value == '') call fail(error, exit_input, word//' needs one '//what//'; '//usage)
      end subroutine take
   end subroutine read_arguments

   function argument(number) result(text)
      integer, intent(in) :: number
      character(len=:), allocatable :: text
      integer :: length
      call get_command_argument(number, length=length)
      allocate (character(len=length) :: text)
      call get_command_argument(number, text)
   end function argument

end module m_arguments
