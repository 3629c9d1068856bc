!> Strict reading of a scene: from text to a checked scene_t, the same on every rank, or one message.
module m_scene_reader
   use m_kinds, only: wp
   use m_constants, only: exit_input
   use m_communicator, only: communicator_t
   use m_errors, only: error_t, fail
   use m_filesystem, only: read_file, read_standard_input, can_make_directory
   use m_namelist_text, only: namelist_text_t
   use m_offer, only: catalogue_t
   use m_box, only: box_t
   use m_carved, only: carve
   use m_overlap, only: overlap
   use m_scene, only: scene_t, place_t
   use m_scene_checks, only: check_scene
   use m_scene_groups, only: read_groups
   use m_scene_particles, only: choose_fill, choose_domain
   use m_scene_section, only: take_sections
   use m_scene_to_section, only: make_section
   implicit none
   private
   public :: read_scene, interpret_scene

   integer, parameter, public :: longest_scene = 16*1024*1024 !< bytes

contains

   !> Collective: read the scene from a file or, if `file` is empty, from all of rank 0's standard input.
   !> Every rank gets the same scene or error. Nothing is written.
   subroutine read_scene(communicator, catalogue, file, scene, error, as_section)
      type(communicator_t), intent(in) :: communicator
      type(catalogue_t), intent(in) :: catalogue !< of laws and effects
      character(len=*), intent(in) :: file
      type(scene_t), intent(out) :: scene
      type(error_t), intent(inout) :: error
      logical, intent(in), optional :: as_section !< convert the scene to its section
      character(len=:), allocatable :: text
      logical :: ok
      ok = .true.
      text = ''
      if (communicator%is_root() .and. file /= '') then
         call read_file(file, longest_scene, text, ok)
         if (.not. ok) call fail(error, exit_input, 'the scene '//file//' cannot be read')
      else if (communicator%is_root()) then
         call read_standard_input(longest_scene, text, ok)
         if (.not. ok) &
            call fail(error, exit_input, 'standard input cannot be read; give a scene: gimp3d < scene.nml')
      end if
      call communicator%agree(error)
      if (error%happened()) return
      call interpret_scene(communicator, catalogue, text, scene, error, as_section=as_section)
   end subroutine read_scene

   !> Collective: as read_scene, from a text that rank 0 holds.
   subroutine interpret_scene(communicator, catalogue, text, scene, error, kept, as_section)
      type(communicator_t), intent(in) :: communicator
      type(catalogue_t), intent(in) :: catalogue
      character(len=:), allocatable, intent(inout) :: text
      type(scene_t), intent(out) :: scene
      type(error_t), intent(inout) :: error
      logical, intent(in), optional :: kept !< the text is from a checkpoint: its output has been written
                                            !< before
      logical, intent(in), optional :: as_section !< as in read_scene
      type(namelist_text_t) :: parsed
      logical :: looks
      looks = .true.
      if (present(kept)) looks = .not. kept
      call communicator%broadcast_text(text, 0)
      if (len(text) > longest_scene) call fail(error, exit_input, 'the scene is longer than 16 MB')
      if (.not. error%happened()) call parsed%parse(text, error)
      if (.not. error%happened()) then
         if (size(parsed%groups) == 0) &
            call fail(error, exit_input, 'the scene is empty; give one: gimp3d < scene.nml')
      end if
      if (.not. error%happened()) call read_groups(parsed, catalogue, scene, error)
      if (.not. error%happened()) call load_shapes(communicator, parsed, scene, error)
      if (present(as_section) .and. .not. error%happened()) call make_section(parsed, scene, error)
      if (.not. error%happened()) call take_sections(parsed, scene, error)
      if (.not. error%happened()) call carve_bodies(parsed, scene, error)
      if (.not. error%happened()) then
         call choose_fill(scene)
         call choose_domain(scene)
      end if
      if (.not. error%happened()) call check_scene(parsed, scene, error)
      if (.not. error%happened()) call note_places(parsed, scene)
      if (looks .and. .not. error%happened()) call check_directory(communicator, parsed, scene, error)
      call communicator%agree(error)
   end subroutine interpret_scene

   !> Collective: read the files of shapes.
   subroutine load_shapes(communicator, parsed, scene, error)
      type(communicator_t), intent(in) :: communicator
      type(namelist_text_t), intent(in) :: parsed
      type(scene_t), intent(inout) :: scene
      type(error_t), intent(inout) :: error
      character(len=:), allocatable :: fault
      integer :: i
      do i = 1, size(scene%bodies)
         call scene%bodies(i)%shape%load(communicator, fault)
         if (fault /= '') call fail(error, exit_input, parsed%place('body', i, 'file')//': '//fault)
      end do
      do i = 1, size(scene%cuts)
         call scene%cuts(i)%shape%load(communicator, fault)
         if (fault /= '') call fail(error, exit_input, parsed%place('cut', i, 'file')//': '//fault)
      end do
      do i = 1, size(scene%tools)
         call scene%tools(i)%shape%load(communicator, fault)
         if (fault /= '') call fail(error, exit_input, parsed%place('tool', i, 'file')//': '//fault)
      end do
   end subroutine load_shapes

   !> Subtract the cuts from the bodies.
   subroutine carve_bodies(parsed, scene, error)
      type(namelist_text_t), intent(in) :: parsed
      type(scene_t), intent(inout) :: scene
      type(error_t), intent(inout) :: error
      real(wp), parameter :: least = 1.0e-2_wp !< cells
      integer :: i
      do i = 1, size(scene%cuts)
         associate (cut => scene%cuts(i), body => scene%bodies(scene%cuts(i)%body))
            if (.not. overlap(body%shape, cut%shape, [0.0_wp, 0.0_wp, 0.0_wp], least*scene%grid%cell_size, &
                              least*scene%grid%cell_size)) &
               call fail(error, exit_input, parsed%place('cut', i, 'shape')// &
                         ': removes nothing from the body '// &
                         body%name//' on '//parsed%line_of('body', cut%body)//'; the cut must overlap '// &
                            'the body')
            if (error%happened()) return
            call carve(body%shape, cut%shape)
         end associate
      end do
      call carve_hollows(scene)
   end subroutine carve_bodies

   !> Subtract from the bodies the boxes that effects occupy.
   subroutine carve_hollows(scene)
      type(scene_t), intent(inout) :: scene
      type(box_t) :: hollow
      real(wp) :: least
      logical :: there_is
      integer :: e, b
      least = 1.0e-2_wp*scene%grid%cell_size
      do e = 1, size(scene%effects)
         call scene%effects(e)%it%hollow(hollow%lower, hollow%upper, there_is)
         if (.not. there_is) cycle
         do b = 1, size(scene%bodies)
            if (overlap(scene%bodies(b)%shape, hollow, [0.0_wp, 0.0_wp, 0.0_wp], least, least)) &
               call carve(scene%bodies(b)%shape, hollow)
         end do
      end do
   end subroutine carve_hollows

   !> Note the positions in the text of values that only the model can check.
   subroutine note_places(parsed, scene)
      type(namelist_text_t), intent(in) :: parsed
      type(scene_t), intent(inout) :: scene
      integer :: i
      allocate (scene%places(3 + size(scene%bodies) + size(scene%levels)))
      call note(scene%places(1), 'scene', 'end_time', 1, 'end_time')
      call note(scene%places(2), 'grid', 'cell_size', 1, 'cell_size')
      call note(scene%places(3), 'time', 'time_step', 1, 'time_step')
      do i = 1, size(scene%bodies)
         call note(scene%places(3 + i), 'body', 'shape', i, 'body')
      end do
      do i = 1, size(scene%levels)
         associate (place => scene%places(3 + size(scene%bodies) + i))
            place%variable = 'level'
            place%number = i
            place%text = parsed%line_of('level', i)//', &level'
         end associate
      end do
   contains
      subroutine note(place, group, variable, number, name)
         type(place_t), intent(inout) :: place
         character(len=*), intent(in) :: group, variable, name
         integer, intent(in) :: number
         place%variable = name
         place%number = number
         place%text = '&'//group//' '//variable
         if (parsed%count_groups(group) >= number) place%text = parsed%place(group, number, variable)
      end subroutine note
   end subroutine note_places

   !> The output can be written, as seen by rank 0.
   subroutine check_directory(communicator, parsed, scene, error)
      type(communicator_t), intent(in) :: communicator
      type(namelist_text_t), intent(in) :: parsed
      type(scene_t), intent(in) :: scene
      type(error_t), intent(inout) :: error
      if (.not. scene%output%present .or. .not. communicator%is_root()) return
      if (can_make_directory(scene%output%directory)) return
      call fail(error, exit_input, parsed%place('output', 1, 'directory')// &
                ': cannot be made or written to; allowed: a directory that can')
   end subroutine check_directory

end module m_scene_reader
