!> Contents of the animation files of a run (xdmf_index) at one step.
module m_xdmf_entry
   use m_kinds, only: wp
   use m_snapshot, only: snapshot_t, snapshot_field_t, snapshot_level_t, snapshot_file_name
   use m_text, only: to_text, exact_text
   implicit none
   private
   public :: particles_entry, levels_entry

   character(len=1), parameter :: newline = achar(10)

contains

   !> The regions of the levels as the straight edges of their surfaces, twelve for a box: one grid a level,
   !> with its number and cell size (m). Lines of text are short, so that xdmf_index can read them again.
   function levels_entry(snapshot) result(text)
      type(snapshot_t), intent(in) :: snapshot
      character(len=:), allocatable :: text
      integer :: l
      text = 'GridType="Collection" CollectionType="Spatial">'//newline// &
             '     <Time Value="'//exact_text(snapshot%time)//'"/>'
      do l = 1, size(snapshot%levels)
         text = text//newline//outline(snapshot%levels(l), l)
      end do
   end function levels_entry

   function outline(level, number) result(text)
      type(snapshot_level_t), intent(in) :: level
      integer, intent(in) :: number
      character(len=:), allocatable :: text, lines, pairs, places
      real(wp), allocatable :: ends(:, :, :)
      integer :: e, n
      ends = level%region%outline()
      lines = to_text(size(ends, 3))
      pairs = ''
      places = ''
      do n = 1, size(ends, 3)
         pairs = pairs//to_text(2*n - 2)//' '//to_text(2*n - 1)//newline
         do e = 1, 2
            places = places//exact_text(ends(1, e, n))//' '//exact_text(ends(2, e, n))//' '// &
                     exact_text(ends(3, e, n))//newline
         end do
      end do
      text = '     <Grid Name="level '//to_text(number)//'" GridType="Uniform">'//newline// &
             '     <Topology TopologyType="Polyline" NodesPerElement="2" NumberOfElements="'//lines//'">'// &
             newline//'      <DataItem Format="XML" NumberType="Int" Dimensions="'//lines//' 2">'//newline// &
             pairs//'      </DataItem>'//newline//'     </Topology>'//newline// &
             '     <Geometry GeometryType="XYZ">'//newline// &
             '      <DataItem Format="XML" NumberType="Float" Precision="8" Dimensions="'// &
             to_text(2*size(ends, 3))//' 3">'//newline//places//'      </DataItem>'//newline// &
             '     </Geometry>'//newline//attribute('level', 'Scalar', &
             repeated(size(ends, 3), to_text(number), 'NumberType="Int"'), 'Cell')// &
             attribute('cell_size', 'Scalar', repeated(size(ends, 3), exact_text(level%cell), &
             'NumberType="Float" Precision="8"'), 'Cell')//'     </Grid>'
   end function outline

   !> The same value for all edges.
   pure function repeated(times, value, number_type) result(item)
      integer, intent(in) :: times
      character(len=*), intent(in) :: value, number_type
      character(len=:), allocatable :: item
      item = '      <DataItem Format="XML" '//number_type//' Dimensions="'//to_text(times)//'">'//newline// &
             repeat(value//newline, times)//'      </DataItem>'//newline
   end function repeated

   !> The grid of one snapshot: vertices, coordinates, id and fields, all as references into its HDF5 file.
   function particles_entry(snapshot) result(text)
      type(snapshot_t), intent(in) :: snapshot
      character(len=:), allocatable :: text
      character(len=:), allocatable :: file, points
      integer :: f
      file = snapshot_file_name(snapshot%step, 'hdf')
      points = to_text(snapshot%n_total)
      text = 'GridType="Uniform">'//newline// &
             '     <Time Value="'//exact_text(snapshot%time)//'"/>'//newline// &
             '     <Topology TopologyType="Polyvertex" NodesPerElement="1" NumberOfElements="'//points// &
                '">'//newline// &
             data_item(file, '/VTKHDF/Connectivity', points, 'NumberType="Int" Precision="8"')// &
             '     </Topology>'//newline// &
             '     <Geometry GeometryType="XYZ">'//newline// &
             data_item(file, '/VTKHDF/Points', points//' 3', 'NumberType="Float" Precision="8"')// &
             '     </Geometry>'//newline// &
             attribute('id', 'Scalar', data_item(file, '/VTKHDF/PointData/id', points, &
                                                 'NumberType="Int" Precision="8"'))
      do f = 1, size(snapshot%fields)
         text = text//field_text(snapshot%fields(f), file, points)
      end do
      text = text(:len(text) - 1) ! without the last newline
   end function particles_entry

   !> A field: scalar, vector or full tensor by their names, others as a matrix of one row a particle. A
   !> symmetric tensor is written so too, which readers take as six columns in file order; for XDMF's own type
   !> (Tensor6) readers assume different orders.
   function field_text(field, file, points) result(text)
      type(snapshot_field_t), intent(in) :: field
      character(len=*), intent(in) :: file, points
      character(len=:), allocatable :: text
      character(len=*), parameter :: real_type = 'NumberType="Float" Precision="8"'
      character(len=:), allocatable :: kind, extent
      select case (field%components)
      case (1)
         kind = 'Scalar'
         extent = points
      case (3)
         kind = 'Vector'
         extent = points//' 3'
      case (9)
         kind = 'Tensor'
         extent = points//' 9'
      case default
         kind = 'Matrix'
         extent = points//' 1 '//to_text(field%components)
      end select
      text = attribute(field%name, kind, data_item(file, '/VTKHDF/PointData/'//field%name, extent, real_type))
   end function field_text

   pure function attribute(name, kind, item, center) result(text)
      character(len=*), intent(in) :: name, kind, item
      character(len=*), intent(in), optional :: center !< Node if absent
      character(len=:), allocatable :: text
      text = 'Node'
      if (present(center)) text = center
      text = '     <Attribute Name="'//escaped(name)//'" AttributeType="'//kind//'" Center="'//text//'">'// &
             newline//item//'     </Attribute>'//newline
   end function attribute

   pure function data_item(file, table, extent, number_type) result(text)
      character(len=*), intent(in) :: file, table, extent, number_type
      character(len=:), allocatable :: text
      text = '      <DataItem Format="HDF" '//number_type//' Dimensions="'//extent//'">'//file//':'// &
             escaped(table)//'</DataItem>'//newline
   end function data_item

   !> Escaped for XML.
   pure function escaped(text) result(safe)
      character(len=*), intent(in) :: text
      character(len=:), allocatable :: safe
      integer :: i
      safe = ''
      do i = 1, len(text)
         select case (text(i:i))
         case ('&')
            safe = safe//'&amp;'
         case ('<')
            safe = safe//'&lt;'
         case ('>')
            safe = safe//'&gt;'
         case ('"')
            safe = safe//'&quot;'
         case default
            safe = safe//text(i:i)
         end select
      end do
   end function escaped

end module m_xdmf_entry
