!> Conversion of a scene in three dimensions to the equivalent section (theory.md, Sections), where possible:
!> data of the modelled part become data of the whole body.
module m_scene_to_section
   use m_side_kinds, only: boundary_symmetry, side_kinds
   use m_kinds, only: wp
   use m_constants, only: exit_input
   use m_errors, only: error_t, fail
   use m_namelist_text, only: namelist_text_t
   use m_scene
   use m_section, only: geometry_axisymmetric, geometry_plane_strain
   implicit none
   private
   public :: make_section

   real(wp), parameter :: near = 1.0e-9_wp !< cells: a side so near to a position counts as on it

contains

   !> Between two symmetry sides in y the scene is a slice, plane strain; else a part of a body of revolution
   !> about x = y = 0. Bodies, tools and effects are checked by `take_sections`.
   subroutine make_section(text, scene, error)
      type(namelist_text_t), intent(in) :: text
      type(scene_t), intent(inout) :: scene
      type(error_t), intent(inout) :: error
      real(wp) :: whole
      if (scene%grid%section%is_flat()) then
         call fail(error, exit_input, text%place('grid', 1, 'geometry')//': the scene is already given '// &
            'by its section')
         return
      end if
      if (all(side_kinds(scene%grid%boundary(3:4))%mirrors)) then
         scene%grid%section%geometry = geometry_plane_strain
         whole = 1.0_wp/(scene%grid%upper(2) - scene%grid%lower(2))
         call refuse_short(text, scene, error)
      else
         scene%grid%section%geometry = geometry_axisymmetric
         call find_axis(text, scene%grid, whole, error)
         if (.not. error%happened()) call refuse_boxes(text, scene, error)
         if (.not. error%happened()) call refuse_lateral(text, scene, error)
      end if
      call refuse_effects(scene, error)
      if (error%happened()) return
      scene%grid%lower(2) = 0.0_wp
      scene%grid%upper(2) = scene%grid%cell_size
      scene%grid%boundary(3:4) = boundary_symmetry
      call raise_loads(scene, whole)
      call turn_probes(scene)
   end subroutine make_section

   !> Move probes into the section, around the axis or along y.
   subroutine turn_probes(scene)
      type(scene_t), intent(inout) :: scene
      integer :: i
      do i = 1, size(scene%probes)
         associate (place => scene%probes(i)%position)
            if (scene%grid%section%is_round()) place(1) = hypot(place(1), place(2))
            place(2) = 0.0_wp
         end associate
      end do
   end subroutine turn_probes

   !> Ratio of the whole body to the modelled part: by the symmetry sides through the axis. Where all of it is
   !> modelled, half of it is removed.
   subroutine find_axis(text, grid, whole, error)
      type(namelist_text_t), intent(in) :: text
      type(grid_spec_t), intent(inout) :: grid
      real(wp), intent(out) :: whole
      type(error_t), intent(inout) :: error
      character(len=1), parameter :: names(2) = ['x', 'y']
      integer :: axis
      whole = 1.0_wp
      do axis = 1, 2
         if (side_kinds(grid%boundary(2*axis))%mirrors) then
            call fail(error, exit_input, text%place('grid', 1, 'boundary')//': a body of revolution has '// &
                      'no symmetry on the upper side in '//names(axis)//'; allowed: free, roller, fixed')
         else if (side_kinds(grid%boundary(2*axis - 1))%mirrors) then
            whole = 2.0_wp*whole
            if (abs(grid%lower(axis)) > near*grid%cell_size) &
               call fail(error, exit_input, text%place('grid', 1, 'lower')//': a body of revolution '// &
                         'about z has its symmetry in '//names(axis)//' at 0')
         else if (grid%lower(axis) >= 0.0_wp .or. grid%upper(axis) <= 0.0_wp) then
            call fail(error, exit_input, text%place('grid', 1, 'lower')//': a body of revolution about z '// &
                      'lies on both sides of '//names(axis)//'=0, or on a side of symmetry there')
         end if
      end do
      grid%lower(1) = 0.0_wp
      grid%boundary(1) = boundary_symmetry
   end subroutine find_axis

   !> A box is no body of revolution; in a section it would be a ring.
   subroutine refuse_boxes(text, scene, error)
      type(namelist_text_t), intent(in) :: text
      type(scene_t), intent(in) :: scene
      type(error_t), intent(inout) :: error
      integer :: i
      do i = 1, size(scene%bodies)
         if (scene%bodies(i)%shape%name == 'box') &
            call fail(error, exit_input, text%place('body', i, 'shape')//': a box is no body of '// &
                      'revolution; allowed: cylinder, sphere, cone about x=y=0')
      end do
      do i = 1, size(scene%cuts)
         if (scene%cuts(i)%shape%name == 'box') &
            call fail(error, exit_input, text%place('cut', i, 'shape')//': a box is no body of '// &
                      'revolution; allowed: cylinder, sphere, cone about x=y=0')
      end do
   end subroutine refuse_boxes

   !> A motion or stress with a direction across the axis; in a section it would be radial.
   subroutine refuse_lateral(text, scene, error)
      type(namelist_text_t), intent(in) :: text
      type(scene_t), intent(in) :: scene
      type(error_t), intent(inout) :: error
      integer :: i
      do i = 1, size(scene%bodies)
         associate (body => scene%bodies(i))
            if (any(abs(body%velocity(1:2)) > 0.0_wp)) &
               call fail(error, exit_input, text%place('body', i, 'velocity')//': has a direction across '// &
                         'the axis; allowed for a section: along z')
            if (abs(body%stress(1) - body%stress(2)) > 0.0_wp .or. any(abs(body%stress(4:6)) > 0.0_wp)) &
               call fail(error, exit_input, text%place('body', i, 'stress')//': has a direction across '// &
                         'the axis; allowed for a section: equal xx and yy, no shear')
         end associate
      end do
   end subroutine refuse_lateral

   !> Effects that are not the same in the section.
   subroutine refuse_effects(scene, error)
      type(scene_t), intent(in) :: scene
      type(error_t), intent(inout) :: error
      character(len=:), allocatable :: why
      integer :: i
      if (error%happened()) return
      do i = 1, size(scene%effects)
         associate (it => scene%effects(i)%it)
            why = it%against_section(scene%grid%lower, scene%grid%upper, scene%grid%section%is_round())
            if (why /= '') call fail(error, exit_input, it%group_text()//': '//why)
         end associate
      end do
   end subroutine refuse_effects

   !> Plane strain requires bodies that extend from one side of the slice to the other.
   subroutine refuse_short(text, scene, error)
      type(namelist_text_t), intent(in) :: text
      type(scene_t), intent(in) :: scene
      type(error_t), intent(inout) :: error
      real(wp) :: lower(3), upper(3)
      integer :: i
      do i = 1, size(scene%bodies)
         call scene%bodies(i)%shape%bounding_box(lower, upper)
         associate (grid => scene%grid)
            if (lower(2) - grid%lower(2) > near*grid%cell_size .or. &
                grid%upper(2) - upper(2) > near*grid%cell_size) &
               call fail(error, exit_input, text%place('body', i, 'shape')//': between two sides of '// &
                         'symmetry in y the body '//scene%bodies(i)%name//' must go from side to side')
         end associate
      end do
   end subroutine refuse_short

   !> Scale loads on tools, their masses and inertia to the whole body.
   subroutine raise_loads(scene, whole)
      type(scene_t), intent(inout) :: scene
      real(wp), intent(in) :: whole
      integer :: i, m
      do i = 1, size(scene%tools)
         associate (tool => scene%tools(i))
            if (allocated(tool%loads)) tool%loads = whole*tool%loads
            tool%mass = whole*tool%mass
            if (.not. allocated(tool%motions)) cycle
            do m = 1, size(tool%motions)
               if (allocated(tool%motions(m)%loads)) tool%motions(m)%loads = whole*tool%motions(m)%loads
               tool%motions(m)%mass = whole*tool%motions(m)%mass
            end do
         end associate
      end do
   end subroutine raise_loads

end module m_scene_to_section
