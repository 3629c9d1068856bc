!> Reads one scene from standard input as gimp3d does, without MPI, for a fuzzer that starts it a thousand
!> times a second.
!>
!> Exits 0 where the scene is refused, and where it is accepted and says itself again: written as a namelist
!> and read back it must be accepted and write the same text. Anything else stops it with a signal.
!test: helper
program read_quickly
   use, intrinsic :: iso_fortran_env, only: error_unit
   use m_constants, only: exit_input
   use m_errors, only: error_t, fail
   use m_filesystem, only: read_standard_input
   use m_namelist_text, only: namelist_text_t
   use m_scene, only: scene_t
   use m_scene_checks, only: check_scene
   use m_scene_groups, only: read_groups
   use m_scene_reader, only: longest_scene
   use m_scene_writer, only: scene_as_namelist
   use m_offer, only: catalogue_t
   use m_materials, only: known_materials
   use m_effects, only: known_effects
   use m_snapshot_formats, only: known_formats
   implicit none
   type(catalogue_t) :: catalogue
   type(scene_t) :: scene, again
   type(error_t) :: error
   character(len=:), allocatable :: text, said, repeated
   logical :: ok
   interface
      subroutine abort_program() bind(c, name='abort')
      end subroutine abort_program
   end interface

   call known_materials(catalogue)
   call known_effects(catalogue)
   call known_formats(catalogue)
   ok = .true.
   call read_standard_input(longest_scene, text, ok)
   if (.not. ok) stop
   call interpret(text, scene, error)
   if (error%happened()) then
      if (len_trim(error%message) == 0 .or. index(error%message, new_line('a')) > 0) &
         call complain('no sentence: '//error%message)
      stop
   end if
   said = scene_as_namelist(scene)
   call interpret(said, again, error)
   if (error%happened()) call complain('what it wrote itself is refused: '//error%message)
   repeated = scene_as_namelist(again)
   if (repeated /= said) call complain('it writes another text the second time')

contains

   subroutine interpret(text, scene, error)
      character(len=*), intent(in) :: text
      type(scene_t), intent(out) :: scene
      type(error_t), intent(inout) :: error
      type(namelist_text_t) :: parsed
      if (len(text) > longest_scene) return
      call parsed%parse(text, error)
      if (error%happened()) return
      if (size(parsed%groups) == 0) call fail(error, exit_input, 'the scene is empty')
      if (.not. error%happened()) call read_groups(parsed, catalogue, scene, error)
      if (.not. error%happened()) call check_scene(parsed, scene, error)
   end subroutine interpret

   subroutine complain(what)
      character(len=*), intent(in) :: what
      write (error_unit, '(a)') what
      call abort_program()
   end subroutine complain

end program read_quickly
