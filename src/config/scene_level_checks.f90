!> Checks of the levels of a scene against each other, the grid and the time stepping.
module m_scene_level_checks
   use m_kinds, only: wp
   use m_constants, only: block_size, exit_input
   use m_errors, only: error_t, fail
   use m_group_reader, only: name_length
   use m_namelist_text, only: namelist_text_t
   use m_number_text, only: reals_text
   use m_scene
   use m_scene_words, only: stress_update_words, criterion_words
   use m_text, only: exact_text, to_text
   implicit none
   private
   public :: check_levels

   integer, parameter, public :: max_levels = 8 !< nested levels; ids have room for as many splits into
                                                 !< eight (m_body, number_ids)
   real(wp), parameter :: min_gap = 2.0_wp      !< between the sides of nested boxes, in cells of the outer
                                                !< one
   real(wp), parameter :: min_width = 4.0_wp    !< of a box, in cells of the level above
   real(wp), parameter :: max_blocks = 2.0e9_wp !< of the finest cells, over the whole grid: they are
                                                 !< numbered by integers
   real(wp), parameter :: near_node = 1.0e-6_wp !< a face is on a node if nearer than this share of a cell,
   real(wp), parameter :: whole = 1.0e-9_wp       !< or this share of its distance from the grid's lower
                                                  !< corner
   integer, parameter :: shown_digits = 12
   character(len=1), parameter :: axes(3) = ['x', 'y', 'z']

   !> One level and its parent. Positions are in cells of the level above, from the grid's lower corner.
   type :: nest_t
      character(len=:), allocatable :: parent    !< name of the parent: `the grid` or `the level on line 4`
      real(wp) :: origin(3)                      !< m
      real(wp) :: cell                           !< cell size of the level above, m
      real(wp) :: grid_size(3)
      real(wp) :: parent_lower(3), parent_upper(3)
      logical :: alone = .true. !< the parent is the grid or one box
      logical :: flat = .false. !< of a section: all boxes extend across it
      real(wp) :: lower(3), upper(3)
   contains
      procedure :: metres
   end type nest_t

contains

   !> All checks. `text` is the source of the scene, for the position in messages.
   subroutine check_levels(text, scene, error)
      type(namelist_text_t), intent(in) :: text
      type(scene_t), intent(in) :: scene
      type(error_t), intent(inout) :: error
      type(nest_t) :: nest
      integer :: l
      if (size(scene%levels) == 0) return
      call check_number(text, scene, error)
      if (scene%time%stress_update /= update_usl) &
         call fail(error, exit_input, text%place('time', 1, 'stress_update')//': must be '// &
                   trim(stress_update_words(update_usl))//' with the &level on '//text%line_of('level', 1)// &
                   ', because levels exchange nodal values once a step')
      do l = 1, size(scene%levels)
         call check_parent(text, scene, l, error)
         if (error%happened()) return
         call set_nest(text, scene, scene%levels(l)%of, nest)
         if (.not. scene%levels(l)%has_box .and. scene%levels(l)%shape == level_box) then
            nest%lower = nest%parent_lower ! it starts around the tools
         else if (scene%levels(l)%shape == level_box) then
            call check_box(text, scene%levels(l), l, nest, error)
         else
            call check_sphere(text, scene%levels(l), l, nest, error)
         end if
         call check_motion(text, scene, l, error)
         if (error%happened()) return
      end do
   end subroutine check_levels

   !> A level refines an existing one. One that a criterion places has no other parts.
   subroutine check_parent(text, scene, l, error)
      type(namelist_text_t), intent(in) :: text
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: l
      type(error_t), intent(inout) :: error
      integer :: other, there
      associate (levels => scene%levels)
         there = 1
         if (l > 1) there = 1 + maxval(levels(:l - 1)%of)
         if (levels(l)%of > there) then
            call fail(error, exit_input, text%place('level', l, 'of')//': there is no level '// &
                      to_text(levels(l)%of)//' before it; allowed: 1 to '//to_text(there))
            return
         end if
         if (levels(l)%criterion == criterion_none) return
         if (levels(l)%shape /= level_box) &
            call fail(error, exit_input, text%place('level', l, 'criterion')// &
                      ": must be none with shape='sphere'; a criterion places a box")
         do other = 1, size(levels)
            if (other == l .or. levels(other)%of /= levels(l)%of) cycle
            call fail(error, exit_input, text%place('level', l, 'criterion')// &
                      ': must be none, for the level on '//text%line_of('level', other)//' refines level '// &
                      to_text(levels(l)%of)//' too; a criterion places a single box')
            return
         end do
      end associate
   end subroutine check_parent

   !> Set the parent of the parts of the next level after `of`: the grid, or a box of level `of`. Where that
   !> is not one box, the model checks the cells themselves, and only the grid counts here.
   subroutine set_nest(text, scene, of, nest)
      type(namelist_text_t), intent(in) :: text
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: of
      type(nest_t), intent(out) :: nest
      integer :: parent
      nest%origin = scene%grid%lower
      nest%flat = scene%grid%section%is_flat()
      nest%cell = scene%grid%cell_size/2**(of - 1)
      nest%grid_size = real(scene%grid%cells, wp)*2**(of - 1)
      nest%parent = 'the grid'
      nest%parent_lower = 0.0_wp
      nest%parent_upper = nest%grid_size
      nest%alone = of == 1
      if (count(scene%levels%of == of - 1) /= 1) return
      parent = findloc(scene%levels%of, of - 1, dim=1)
      associate (box => scene%levels(parent))
         if (box%shape /= level_box .or. .not. box%has_box) return
         nest%alone = .true.
         nest%parent = 'the level on '//text%line_of('level', parent)
         nest%parent_lower = anint((box%lower - nest%origin)/nest%cell)
         nest%parent_upper = anint((box%upper - nest%origin)/nest%cell)
      end associate
   end subroutine set_nest

   !> A sphere must contain cells, and reach into the grid.
   subroutine check_sphere(text, level, l, nest, error)
      type(namelist_text_t), intent(in) :: text
      type(level_spec_t), intent(in) :: level
      integer, intent(in) :: l
      type(nest_t), intent(in) :: nest
      type(error_t), intent(inout) :: error
      real(wp) :: center(3), reach, width
      if (level%radius < 0.5_wp*min_width*nest%cell) &
         call fail(error, exit_input, text%place('level', l, 'radius')//': allowed: at least '// &
                   to_text(0.5_wp*min_width)//' cells of what it refines, '// &
                   to_text(0.5_wp*min_width*nest%cell, 6)//' m')
      center = (level%center - nest%origin)/nest%cell
      if (any(center < 0.0_wp) .or. any(center > nest%grid_size)) then
         call fail(error, exit_input, text%place('level', l, 'center')//': lies outside the grid')
         return
      end if
      if (level%follow == 0) return
      reach = level%radius/nest%cell
      width = minval(min(center + reach, nest%grid_size) - max(center - reach, 0.0_wp), &
                     mask=.not. [.false., nest%flat, .false.])
      if (width < min_width) &
         call fail(error, exit_input, text%place('level', l, 'radius')//': with follow, '// &
                   to_text(width, 3)//' cells of what it refines are inside the grid in one direction; '// &
                   'allowed: at least '//to_text(min_width))
   end subroutine check_sphere

   !> Limit the number of levels, and of blocks.
   subroutine check_number(text, scene, error)
      type(namelist_text_t), intent(in) :: text
      type(scene_t), intent(in) :: scene
      type(error_t), intent(inout) :: error
      real(wp) :: blocks
      character(len=:), allocatable :: edge
      integer :: depth, l
      edge = to_text(block_size)
      depth = maxval(scene%levels%of)
      if (depth > max_levels) then
         call fail(error, exit_input, text%line_of('level', findloc(scene%levels%of > max_levels, .true., &
                   dim=1))//', &level: there are '//to_text(depth)//' levels; allowed: at most '// &
                   to_text(max_levels))
         return
      end if
      do l = 1, size(scene%levels)
         depth = scene%levels(l)%of
         blocks = product(real(scene%grid%cells, wp)*2.0_wp**depth/block_size + 1.0_wp)
         if (blocks < max_blocks) cycle
         call fail(error, exit_input, text%line_of('level', l)//', &level: its cells, '// &
                   to_text(scene%grid%cell_size/2.0_wp**depth, 6)//' m, would fill the grid with '// &
                   to_text(blocks, 3)//' blocks of '//edge//' x '//edge//' x '//edge//'; allowed: below '// &
                   exact_text(max_blocks))
         return
      end do
   end subroutine check_number

   !> The box of a level has a size, lies inside its parent on the nodes there, and keeps its distance. Sets
   !> its position in the nest.
   subroutine check_box(text, level, l, nest, error)
      type(namelist_text_t), intent(in) :: text
      type(level_spec_t), intent(in) :: level
      integer, intent(in) :: l
      type(nest_t), intent(inout) :: nest
      type(error_t), intent(inout) :: error
      character(len=:), allocatable :: variable
      integer :: axis
      if (any(level%upper <= level%lower)) then
         call fail(error, exit_input, text%place('level', l, 'upper')//': must be above lower='// &
                   reals_text(level%lower)//' in every direction')
         return
      end if
      nest%lower = (level%lower - nest%origin)/nest%cell
      nest%upper = (level%upper - nest%origin)/nest%cell
      variable = ''
      if (any(nest%upper > nest%parent_upper + slack(nest%parent_upper))) variable = 'upper'
      if (any(nest%lower < nest%parent_lower - slack(nest%parent_lower))) variable = 'lower'
      if (variable /= '') then
         call fail(error, exit_input, text%place('level', l, variable)//': the box spans '// &
                   reals_text(level%lower, 6)//' to '//reals_text(level%upper, 6)//' m; allowed: inside '// &
                   nest%parent//', '//reals_text([(nest%metres(nest%parent_lower(axis), axis), axis=1, 3)], &
                   6)//' to '//reals_text([(nest%metres(nest%parent_upper(axis), axis), axis=1, 3)], 6)//' m')
         return
      end if
      call move_to_nodes(text%place('level', l, 'lower'), nest, nest%lower, error)
      call move_to_nodes(text%place('level', l, 'upper'), nest, nest%upper, error)
      call check_width(text%place('level', l, 'upper'), nest, error)
      if (.not. nest%alone) return
      call check_gaps(text%place('level', l, 'lower'), nest, nest%lower, nest%parent_lower, 1, error)
      call check_gaps(text%place('level', l, 'upper'), nest, nest%upper, nest%parent_upper, -1, error)
   end subroutine check_box

   !> Tolerance for a coordinate, in cells.
   elemental real(wp) function slack(place)
      real(wp), intent(in) :: place
      slack = max(near_node, whole*abs(place))
   end function slack

   !> Coordinate of a point in the nest, m; round-off about zero becomes zero.
   pure real(wp) function metres(self, place, axis)
      class(nest_t), intent(in) :: self
      real(wp), intent(in) :: place
      integer, intent(in) :: axis
      metres = self%origin(axis) + place*self%cell
      if (abs(metres) < whole*self%cell) metres = 0.0_wp
   end function metres

   !> Move a corner of a box to the node of the refined grid that it must be on.
   subroutine move_to_nodes(at, nest, corner, error)
      character(len=*), intent(in) :: at !< line, group and variable
      type(nest_t), intent(in) :: nest
      real(wp), intent(inout) :: corner(3)
      type(error_t), intent(inout) :: error
      integer :: axis
      do axis = 1, 3
         if (abs(corner(axis) - anint(corner(axis))) > slack(corner(axis))) then
            call fail(error, exit_input, at//': '//axes(axis)//' lies between nodes of '//nest%parent// &
                      ', whose cells are '//to_text(nest%cell, 6)//' m; allowed: on a node, nearest '// &
                      axes(axis)//'='//to_text(nest%metres(anint(corner(axis)), axis), shown_digits))
            return
         end if
         corner(axis) = anint(corner(axis))
      end do
   end subroutine move_to_nodes

   !> Check the width of a box.
   subroutine check_width(at, nest, error)
      character(len=*), intent(in) :: at
      type(nest_t), intent(in) :: nest
      type(error_t), intent(inout) :: error
      real(wp) :: width
      integer :: axis
      do axis = 1, 3
         width = nest%upper(axis) - nest%lower(axis)
         if (width >= min_width .or. (nest%flat .and. axis == 2)) cycle
         call fail(error, exit_input, at//': the box is '//cells(width)//' of '//nest%parent//' wide in '// &
                   axes(axis)// &
                   '; allowed: at least '//to_text(min_width)//' of '//to_text(nest%cell, 6)//' m')
         return
      end do
   end subroutine check_width

   !> Each side of a box, the lower three or the upper three, is a side of the grid or lies well inside the
   !> parent.
   subroutine check_gaps(at, nest, corner, parent, inward, error)
      character(len=*), intent(in) :: at
      type(nest_t), intent(in) :: nest
      real(wp), intent(in) :: corner(3), parent(3)
      integer, intent(in) :: inward !< 1: the lower sides, -1: the upper
      type(error_t), intent(inout) :: error
      real(wp) :: gap, side(3)
      character(len=:), allocatable :: also
      integer :: axis
      side = merge(0.0_wp, nest%grid_size, inward > 0)
      do axis = 1, 3
         gap = inward*(corner(axis) - parent(axis))
         if (gap >= min_gap .or. abs(corner(axis) - side(axis)) < 0.5_wp) cycle
         also = ''
         if (abs(parent(axis) - side(axis)) < 0.5_wp) &
            also = ', or '//to_text(nest%metres(side(axis), axis), shown_digits)//', the side of the grid'
         call fail(error, exit_input, at//': lies '//cells(gap)//' of '//to_text(nest%cell, 6)// &
                   ' m inside '//nest%parent// &
                   ' in '//axes(axis)//'; allowed: at least '//to_text(min_gap)//', '//axes(axis)// &
                   trim(merge(' at least ', ' at most  ', inward > 0))//' '// &
                   to_text(nest%metres(parent(axis) + inward*min_gap, axis), shown_digits)//also)
         return
      end do
   end subroutine check_gaps

   !> `1 cell`, `3 cells`.
   function cells(count) result(text)
      real(wp), intent(in) :: count
      character(len=:), allocatable :: text
      text = to_text(count)//' cells'
      if (nint(count) == 1) text = to_text(count)//' cell'
   end function cells

   !> A level must move like its parent, so that the gap between them does not close: if the parent follows
   !> something, with something that a part of the parent follows.
   subroutine check_motion(text, scene, l, error)
      type(namelist_text_t), intent(in) :: text
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: l
      type(error_t), intent(inout) :: error
      character(len=name_length), allocatable :: leaders(:)
      integer :: parent
      leaders = scene%leaders()
      associate (level => scene%levels(l), above => scene%levels%of == scene%levels(l)%of - 1)
         parent = findloc(above .and. scene%levels%follow > 0, .true., dim=1)
         if (parent > 0) then
            if (level%follow == 0) then
               call fail(error, exit_input, text%place('level', l, 'follow')//': missing; must be '// &
                         trim(leaders(scene%levels(parent)%follow))//', which the level around it on '// &
                         text%line_of('level', parent)//' follows')
            else if (.not. any(above .and. scene%levels%follow == level%follow)) then
               call fail(error, exit_input, text%place('level', l, 'follow')//': must be '// &
                         trim(leaders(scene%levels(parent)%follow))//', which the level on '// &
                         text%line_of('level', parent)//' follows; levels follow one tool or group')
            end if
         end if
         parent = findloc(above .and. scene%levels%criterion == criterion_error, .true., dim=1)
         if (parent > 0 .and. level%criterion /= criterion_error) then
            call fail(error, exit_input, text%place('level', l, 'criterion')// &
                      ': must be error, for the level around it on '//text%line_of('level', parent)// &
                      ' is placed by the error')
            return
         end if
         parent = findloc(above .and. scene%levels%criterion /= criterion_none, .true., dim=1)
         if (parent > 0 .and. level%criterion == criterion_error) then
            if (scene%levels(parent)%criterion /= criterion_error .or. scene%levels(parent)%follow > 0) &
               call fail(error, exit_input, text%place('level', l, 'criterion')//': must be '// &
                         trim(criterion_words(scene%levels(parent)%criterion + 1))// &
                         ', as that of the level around it on '//text%line_of('level', parent))
         end if
         if (parent > 0 .and. level%criterion == criterion_none) &
            call fail(error, exit_input, text%place('level', l, 'criterion')// &
                      ': must be stress or strain, for the level '//'around it on '// &
                      text%line_of('level', parent)//' is placed by a criterion')
      end associate
   end subroutine check_motion

end module m_scene_level_checks
