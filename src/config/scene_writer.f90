!> A scene as the namelist that reads back to the same values: every value used, defaults included.
module m_scene_writer
   use m_kinds, only: wp
   use m_constants, only: pi
   use m_number_text, only: reals_text
   use m_text, only: exact_text, to_text
   use m_scene
   use m_scene_words
   implicit none
   private
   public :: scene_as_namelist

   character(len=*), parameter :: new = new_line('a')

contains

   !> The whole scene, its lines ended by new_line.
   function scene_as_namelist(scene) result(text)
      type(scene_t), intent(in) :: scene
      character(len=:), allocatable :: text
      integer :: i
      text = '&scene'//new//word('title', scene%title)//real_1('end_time', scene%end_time)//'/'//new
      text = text//grid_text(scene%grid)//time_text(scene%time)
      do i = 1, size(scene%materials)
         text = text//material_text(scene%materials(i))
      end do
      do i = 1, size(scene%bodies)
         text = text//body_text(scene%bodies(i), trim(scene%materials(scene%bodies(i)%material)%name))
      end do
      do i = 1, size(scene%tools)
         text = text//tool_text(scene%tools(i))
      end do
      do i = 1, size(scene%probes)
         text = text//'&probe'//new//word('name', scene%probes(i)%name)//reals('position', scene%probes(i)%position)//'/'//new
      end do
      text = text//'&contact'//new//real_1('tolerance', scene%contact%tolerance)// &
             integer_1('max_iterations', scene%contact%max_iterations)// &
             real_1('compliance', scene%contact%compliance)//'/'//new
      if (scene%output%present) text = text//output_text(scene%output)
   end function scene_as_namelist

   function grid_text(grid) result(text)
      type(grid_spec_t), intent(in) :: grid
      character(len=:), allocatable :: text
      integer :: choices(6), side
      do side = 1, 6
         choices(side) = findloc(boundary_codes, grid%boundary(side), dim=1)
      end do
      text = '&grid'//new//reals('lower', grid%lower)//reals('upper', grid%upper)//real_1('cell_size', grid%cell_size)
      text = text//words('boundary', boundary_words(choices))//'/'//new
   end function grid_text

   function time_text(time) result(text)
      type(time_spec_t), intent(in) :: time
      character(len=:), allocatable :: text
      text = '&time'//new//real_1('safety', time%safety)//real_1('time_step', time%time_step)// &
             word('stress_update', stress_update_words(time%stress_update))// &
             word('velocity_update', 'flip')//real_1('flip_fraction', time%flip_fraction)// &
             word('transfer', transfer_words(merge(1, 2, time%affine)))//'/'//new
   end function time_text

   function material_text(material) result(text)
      type(material_spec_t), intent(in) :: material
      character(len=:), allocatable :: text
      text = '&material'//new//word('name', material%name)//word('model', material%model)// &
             real_1('density', material%density)//real_1('young', material%young)//real_1('poisson', material%poisson)//'/'//new
   end function material_text

   function body_text(body, material) result(text)
      type(body_spec_t), intent(in) :: body
      character(len=*), intent(in) :: material
      character(len=:), allocatable :: text
      text = '&body'//new//word('name', body%name)//word('material', material)//word('shape', body_shape_words(body%shape))
      if (body%shape == shape_box) text = text//reals('lower', body%lower)//reals('upper', body%upper)
      if (body%shape /= shape_box) text = text//reals('center', body%center)//real_1('radius', body%radius)
      if (body%shape == shape_cylinder) text = text//real_1('height', body%height)//reals('axis', body%axis)
      text = text//integer_1('particles_per_cell', body%particles_per_cell)//reals('velocity', body%velocity)// &
             reals('angular_velocity', body%angular_velocity)//'/'//new
   end function body_text

   function tool_text(tool) result(text)
      type(tool_spec_t), intent(in) :: tool
      character(len=:), allocatable :: text
      text = '&tool'//new//word('name', tool%name)//word('shape', tool_shape_words(tool%shape))
      if (any(tool%shape == tool_pointed)) text = text//'   half_angle='//degrees_text(tool%half_angle)//new
      if (any(tool%shape == tool_round)) text = text//real_1('radius', tool%radius)
      text = text//reals('tip', tool%tip)//reals('axis', tool%axis)
      if (any(tool%shape == tool_edged)) text = text//reals('edge', tool%edge)
      text = text//reals('times', tool%times)
      if (allocated(tool%loads)) then
         text = text//reals('loads', tool%loads)//real_1('mass', tool%mass)//real_1('initial_speed', tool%initial_speed)
      else
         text = text//reals('speeds', tool%speeds)
      end if
      text = text//real_1('penetration_factor', tool%penetration_factor)//real_1('friction', tool%friction)//'/'//new
   end function tool_text

   function output_text(output) result(text)
      type(output_spec_t), intent(in) :: output
      character(len=:), allocatable :: text
      text = '&output'//new//word('directory', output%directory)//real_1('every', output%every)// &
             real_1('history_every', output%history_every)
      if (output%hdf5 .or. output%tecplot) then
         text = text//words('formats', pack(format_words(1:2), [output%hdf5, output%tecplot]))
      else
         text = text//word('formats', 'none')
      end if
      text = text//'/'//new
   end function output_text

   !> Degrees that read back to exactly this angle in radians: the fewest digits that do, among the neighbours if need be.
   function degrees_text(radians) result(text)
      real(wp), intent(in) :: radians
      character(len=:), allocatable :: text
      real(wp) :: degrees, back
      integer :: digits, step
      degrees = radians*(180.0_wp/pi)
      do digits = 1, 17
         text = to_text(degrees, digits)
         read (text, *) back
         if (abs(back*(pi/180.0_wp) - radians) <= 0.0_wp) return
      end do
      do step = -4, 4
         back = degrees + step*spacing(degrees)
         text = exact_text(back)
         if (abs(back*(pi/180.0_wp) - radians) <= 0.0_wp) return
      end do
      text = exact_text(degrees)
   end function degrees_text

   pure function real_1(name, value) result(line)
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: value
      character(len=:), allocatable :: line
      line = '   '//name//'='//exact_text(value)//new
   end function real_1

   pure function reals(name, values) result(line)
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: values(:)
      character(len=:), allocatable :: line
      line = '   '//name//'='//reals_text(values)//new
   end function reals

   pure function integer_1(name, value) result(line)
      character(len=*), intent(in) :: name
      integer, intent(in) :: value
      character(len=:), allocatable :: line
      line = '   '//name//'='//to_text(value)//new
   end function integer_1

   pure function word(name, value) result(line)
      character(len=*), intent(in) :: name, value
      character(len=:), allocatable :: line
      line = '   '//name//'='//quoted(trim(value))//new
   end function word

   pure function words(name, values) result(line)
      character(len=*), intent(in) :: name
      character(len=*), intent(in) :: values(:)
      character(len=:), allocatable :: line
      integer :: i
      line = '   '//name//'='//quoted(trim(values(1)))
      do i = 2, size(values)
         line = line//','//quoted(trim(values(i)))
      end do
      line = line//new
   end function words

   !> In single quotes, those inside doubled.
   pure function quoted(value) result(text)
      character(len=*), intent(in) :: value
      character(len=:), allocatable :: text
      integer :: i
      text = ''''
      do i = 1, len(value)
         text = text//value(i:i)
         if (value(i:i) == '''') text = text//''''
      end do
      text = text//''''
   end function quoted

end module m_scene_writer
