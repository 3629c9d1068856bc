!> Reads a scene as gimp3d does and says what it found.
!>
!>   read_scene < scene.nml     prints the normalised scene and exits 0, or `gimp3d: <sentence>` on
!>                              stderr and exits 2
!>   read_scene FILE ...        for each file in turn, `== FILE STATUS` and then the sentence or the
!>                              normalised scene; exits 0
!>   read_scene --names         prints `group variable` for all that can be read
!>   read_scene --models        prints the material laws
!test: helper
program read_scene_driver
   use, intrinsic :: iso_fortran_env, only: error_unit
   use m_communicator, only: communicator_t
   use m_errors, only: error_t
   use m_filesystem, only: read_file
   use m_text, only: to_text
   use m_scene, only: scene_t
   use m_offer, only: catalogue_t
   use m_materials, only: known_materials
   use m_effects, only: known_effects
   use m_snapshot_formats, only: known_formats
   use m_scene_groups, only: known_variables
   use m_scene_reader, only: read_scene, interpret_scene, longest_scene
   use m_scene_writer, only: scene_as_namelist
   implicit none
   type(communicator_t) :: communicator
   type(catalogue_t) :: catalogue
   type(scene_t) :: scene
   type(error_t) :: error
   integer :: i, status
   interface
      subroutine c_exit(status) bind(c, name='exit')
         use, intrinsic :: iso_c_binding, only: c_int
         integer(c_int), value :: status
      end subroutine c_exit
   end interface

   call communicator%start()
   call known_materials(catalogue)
   call known_effects(catalogue)
   call known_formats(catalogue)
   status = 0
   if (command_argument_count() == 0) then
      call read_scene(communicator, catalogue, '', scene, error)
      status = error%status
      if (communicator%is_root() .and. error%happened()) write (error_unit, '(a)') 'gimp3d: '//error%message
      if (communicator%is_root() .and. .not. error%happened()) &
         write (*, '(a)', advance='no') scene_as_namelist(scene)
   else if (argument(1) == '--names') then
      if (communicator%is_root()) write (*, '(a)', advance='no') known_variables(catalogue)
   else if (argument(1) == '--models') then
      if (communicator%is_root()) &
         write (*, '(a)') (trim(catalogue%models(i)%it%name), i=1, size(catalogue%models))
   else
      do i = 1, command_argument_count()
         call try_file(argument(i))
      end do
   end if
   flush (error_unit)
   call communicator%finish()
   call c_exit(status)

contains

   function argument(number) result(text)
      integer, intent(in) :: number
      character(len=:), allocatable :: text
      integer :: length
      call get_command_argument(number, length=length)
      allocate (character(len=length) :: text)
      call get_command_argument(number, text)
   end function argument

   !> Every rank says whether it agrees with rank 0 by the line `rank N differs`, which no test expects.
   subroutine try_file(path)
      character(len=*), intent(in) :: path
      type(scene_t) :: found
      type(error_t) :: fault
      character(len=:), allocatable :: text, said, of_root
      logical :: ok
      ok = .true.
      text = ''
      if (communicator%is_root()) call read_file(path, longest_scene, text, ok)
      call interpret_scene(communicator, catalogue, text, found, fault)
      if (fault%happened()) then
         said = fault%message//new_line('a')
      else
         said = scene_as_namelist(found)
      end if
      of_root = said
      call communicator%broadcast_text(of_root, 0)
      if (said /= of_root) write (*, '(a)') 'rank '//to_text(communicator%rank)//' differs: '//said
      if (communicator%is_root()) write (*, '(a)', advance='no') '== '//path//' '//to_text(fault%status)// &
         new_line('a')//said
      if (.not. ok) write (*, '(a)') 'cannot read '//path
   end subroutine try_file

end program read_scene_driver
