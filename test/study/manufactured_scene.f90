!test: helper
!> The manufactured solution as a program of its own, for gimp3d-post study: reads a scene of groups &grid,
!> &level, &body, &time and &manufactured on standard input (input/studies/manufactured.nml) and prints what
!> it found as lines `study: name value`. The error is the root mean square of the positions' errors over all
!> particles and steps, over the amplitude.
program manufactured_scene
   use, intrinsic :: iso_fortran_env, only: input_unit, error_unit
   use m_kinds, only: wp
   use m_communicator, only: communicator_t
   use m_domain_kinds, only: domain_fixed, domain_stretch, domain_corners
   use m_manufactured, only: run_t, outcome_t, run
   implicit none
   type(communicator_t) :: comm
   type(run_t) :: setting
   type(outcome_t) :: outcome
   character(len=:), allocatable :: text
   call comm%start()
   text = ''
   if (comm%is_root()) text = all_input()
   call comm%broadcast_text(text, 0)
   call read_scene(text, setting)
   outcome = run(comm, setting)
   if (comm%is_root()) then
      if (outcome%failed) error stop 3
      print '(a,es24.16)', ' study: error ', outcome%l2/setting%amplitude, ' study: largest ', &
         outcome%largest/setting%amplitude, ' study: seconds ', outcome%seconds
      print '(a,i0)', ' study: particles ', outcome%particles, ' study: steps ', &
         int(outcome%steps, kind(outcome%particles))
   end if
   call comm%finish()

contains

   !> Standard input, its lines ended.
   function all_input() result(text)
      character(len=:), allocatable :: text
      character(len=1000) :: line
      integer :: status
      text = ''
      do
         read (input_unit, '(a)', iostat=status) line
         if (status /= 0) exit
         text = text//trim(line)//new_line('a')
      end do
   end function all_input

   !> What the groups say; a group that is absent leaves the defaults.
   subroutine read_scene(text, setting)
      character(len=*), intent(in) :: text
      type(run_t), intent(out) :: setting
      real(wp) :: lower(3), upper(3), cell_size, safety, amplitude, periods
      integer :: particles_per_cell
      character(len=20) :: transfer, domain
      namelist /grid/ lower, upper, cell_size
      namelist /body/ particles_per_cell
      namelist /time/ safety, transfer, domain
      namelist /manufactured/ amplitude, periods
      integer :: status(4)
      character(len=200), allocatable :: line(:)
      allocate (line(line_count(text)))
      call split(text, line)
      lower = 0.0_wp
      upper = 1.0_wp
      cell_size = 0.125_wp
      particles_per_cell = setting%particles_per_cell
      safety = setting%safety
      amplitude = setting%amplitude
      periods = setting%duration
      transfer = 'affine'
      domain = 'fixed'
      read (line, nml=grid, iostat=status(1))
      read (line, nml=body, iostat=status(2))
      read (line, nml=time, iostat=status(3))
      read (line, nml=manufactured, iostat=status(4))
      if (any(status > 0)) call refuse('a group of the scene is not understood')
      if (any(abs(lower) > 0.0_wp) .or. any(abs(upper - 1.0_wp) > 1.0e-9_wp)) &
         call refuse('the cube goes from 0,0,0 to 1,1,1')
      setting%cells = nint(1.0_wp/cell_size)
      if (abs(setting%cells*cell_size - 1.0_wp) > 1.0e-6_wp) call refuse('cell_size must divide 1 m')
      setting%particles_per_cell = particles_per_cell
      setting%safety = safety
      setting%amplitude = amplitude
      setting%duration = periods
      select case (transfer)
      case ('affine', 'plain')
         setting%affine = transfer == 'affine'
      case default
         call refuse('transfer must be affine or plain')
      end select
      select case (domain)
      case ('fixed')
         setting%domain = domain_fixed
      case ('stretch')
         setting%domain = domain_stretch
      case ('corners')
         setting%domain = domain_corners
      case default
         call refuse('domain must be fixed, stretch or corners')
      end select
      if (index(text, '&level') > 0) call refuse('levels are not for this scene')
   end subroutine read_scene

   pure integer function line_count(text)
      character(len=*), intent(in) :: text
      integer :: i
      line_count = count([(text(i:i) == new_line('a'), i=1, len(text))])
   end function line_count

   !> A text in lines.
   subroutine split(text, line)
      character(len=*), intent(in) :: text
      character(len=*), intent(out) :: line(:)
      integer :: l, start, length
      start = 1
      do l = 1, size(line)
         length = index(text(start:), new_line('a')) - 1
         line(l) = text(start:start + length - 1)
         start = start + length + 1
      end do
   end subroutine split

   subroutine refuse(sentence)
      character(len=*), intent(in) :: sentence
      if (comm%is_root()) write (error_unit, '(2a)') 'gimp3d: the manufactured scene: ', sentence
      error stop 2
   end subroutine refuse

end program manufactured_scene
