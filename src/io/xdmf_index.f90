!> One small file, `particles.xdmf`, that makes an animation of the HDF5 snapshots of a run: it tells their times and points
!> into them. ParaView and VTK open it.
module m_xdmf_index
   use m_kinds, only: wp
   use m_errors, only: error_t
   use m_communicator, only: communicator_t
   use m_part_file, only: open_part, publish_part
   use m_snapshot, only: snapshot_t, snapshot_field_t, snapshot_file_name
   use m_text, only: to_text, exact_text
   implicit none
   private

   ! One snapshot: its step and its part of the index.
   type :: entry_t
      integer :: step = 0
      character(len=:), allocatable :: text
   end type entry_t

   !> The index of one directory; only rank 0 holds its entries.
   type, public :: xdmf_index_t
      character(len=:), allocatable, private :: path
      type(entry_t), allocatable, private :: entries(:)
   contains
      procedure :: start
      procedure :: add
   end type xdmf_index_t

   character(len=1), parameter :: newline = achar(10)
   character(len=*), parameter :: begin_entry = '    <Grid Name="step ', end_entry = '    </Grid>'

contains

   !> Begin the index of a directory. With `resume_step` the entries of an index that is there are kept as far as that step
   !> (a run that goes on from a checkpoint); without it, or if the old index cannot be read, the index begins empty.
   subroutine start(self, communicator, directory, resume_step)
      class(xdmf_index_t), intent(out) :: self
      type(communicator_t), intent(in) :: communicator
      character(len=*), intent(in) :: directory
      integer, intent(in), optional :: resume_step
      self%path = directory//'/particles.xdmf'
      allocate (self%entries(0))
      if (present(resume_step) .and. communicator%is_root()) call keep_entries(self, resume_step)
   end subroutine start

   !> Collective: add a snapshot that has been written and write the index anew. Entries of this step or later ones go: the run
   !> was taken up again before them.
   subroutine add(self, communicator, snapshot, error)
      class(xdmf_index_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      type(snapshot_t), intent(in) :: snapshot
      type(error_t), intent(inout) :: error
      if (communicator%is_root() .and. .not. error%happened()) then
         call append(self%entries, snapshot%step, entry_text(snapshot))
         call write_index(self, error)
      end if
      call communicator%agree(error)
   end subroutine add

   !> Put an entry after those of smaller steps.
   subroutine append(entries, step, text)
      type(entry_t), allocatable, intent(inout) :: entries(:)
      integer, intent(in) :: step
      character(len=*), intent(in) :: text
      type(entry_t), allocatable :: longer(:)
      integer :: e, n
      n = 0
      allocate (longer(size(entries) + 1))
      do e = 1, size(entries)
         if (entries(e)%step >= step) cycle
         n = n + 1
         longer(n) = entries(e)
      end do
      longer(n + 1)%step = step
      longer(n + 1)%text = text
      deallocate (entries)
      allocate (entries(n + 1))
      do e = 1, n + 1
         entries(e) = longer(e)
      end do
   end subroutine append

   subroutine write_index(self, error)
      class(xdmf_index_t), intent(in) :: self
      type(error_t), intent(inout) :: error
      integer :: unit, e
      call open_part(self%path, unit, error)
      if (error%happened()) return
      call put('<?xml version="1.0" ?>')
      call put('<!DOCTYPE Xdmf SYSTEM "Xdmf.dtd" []>')
      call put('<Xdmf Version="2.0">')
      call put(' <Domain>')
      call put('  <Grid Name="particles" GridType="Collection" CollectionType="Temporal">')
      do e = 1, size(self%entries)
         call put(self%entries(e)%text)
      end do
      call put('  </Grid>')
      call put(' </Domain>')
      call put('</Xdmf>')
      call publish_part(self%path, unit, error)

   contains

      subroutine put(line)
         use m_constants, only: exit_files
         use m_errors, only: fail
         character(len=*), intent(in) :: line
         character(len=256) :: reason
         integer :: status
         if (error%happened()) return
         write (unit, '(a)', iostat=status, iomsg=reason) line
         if (status /= 0) call fail(error, exit_files, 'cannot write '//self%path//': '//trim(reason))
      end subroutine put

   end subroutine write_index

   !> The grid of one snapshot: vertices, coordinates, id and fields, all as references into its HDF5 file.
   function entry_text(snapshot) result(text)
      type(snapshot_t), intent(in) :: snapshot
      character(len=:), allocatable :: text
      character(len=:), allocatable :: file, points
      integer :: f
      file = snapshot_file_name(snapshot%step, 'h5')
      points = to_text(snapshot%n_total)
      text = begin_entry//to_text(snapshot%step)//'" GridType="Uniform">'//newline// &
             '     <Time Value="'//exact_text(snapshot%time)//'"/>'//newline// &
             '     <Topology TopologyType="Polyvertex" NodesPerElement="1" NumberOfElements="'//points//'">'//newline// &
             data_item(file, '/VTKHDF/Connectivity', points, 'NumberType="Int" Precision="8"')// &
             '     </Topology>'//newline// &
             '     <Geometry GeometryType="XYZ">'//newline// &
             data_item(file, '/VTKHDF/Points', points//' 3', 'NumberType="Float" Precision="8"')// &
             '     </Geometry>'//newline// &
             attribute('id', 'Scalar', data_item(file, '/VTKHDF/PointData/id', points, 'NumberType="Int" Precision="8"'))
      do f = 1, size(snapshot%fields)
         text = text//field_text(snapshot%fields(f), file, points)
      end do
      text = text//end_entry
   end function entry_text

   !> A field: scalar, vector or tensor as it is. The components of any other one as scalars of their own: readers take a
   !> symmetric tensor for one in another order than VTK's (xx yy zz xy yz xz), and know no other widths.
   function field_text(field, file, points) result(text)
      type(snapshot_field_t), intent(in) :: field
      character(len=*), intent(in) :: file, points
      character(len=:), allocatable :: text
      character(len=:), allocatable :: table, extent
      character(len=*), parameter :: real_type = 'NumberType="Float" Precision="8"'
      integer :: c
      table = '/VTKHDF/PointData/'//field%name
      extent = points//' '//to_text(field%components)
      select case (field%components)
      case (1)
         text = attribute(field%name, 'Scalar', data_item(file, table, points, real_type))
      case (3)
         text = attribute(field%name, 'Vector', data_item(file, table, extent, real_type))
      case (9)
         text = attribute(field%name, 'Tensor', data_item(file, table, extent, real_type))
      case default
         text = ''
         do c = 1, field%components
            text = text//attribute(field%full_name(c), 'Scalar', &
                                   '      <DataItem ItemType="HyperSlab" Dimensions="'//points//' 1">'//newline// &
                                   '      <DataItem Format="XML" NumberType="Int" Dimensions="3 2">0 '//to_text(c - 1)// &
                                   ' 1 1 '//points//' 1</DataItem>'//newline// &
                                   data_item(file, table, extent, real_type)//'      </DataItem>'//newline)
         end do
      end select
   end function field_text

   pure function attribute(name, kind, item) result(text)
      character(len=*), intent(in) :: name, kind, item
      character(len=:), allocatable :: text
      text = '     <Attribute Name="'//escaped(name)//'" AttributeType="'//kind//'" Center="Node">'//newline//item// &
             '     </Attribute>'//newline
   end function attribute

   pure function data_item(file, table, extent, number_type) result(text)
      character(len=*), intent(in) :: file, table, extent, number_type
      character(len=:), allocatable :: text
      text = '      <DataItem Format="HDF" '//number_type//' Dimensions="'//extent//'">'//file//':'//escaped(table)// &
             '</DataItem>'//newline
   end function data_item

   !> Text as XML wants it.
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

   !> Take over the entries of the index on the disk up to a step.
   subroutine keep_entries(self, resume_step)
      type(xdmf_index_t), intent(inout) :: self
      integer, intent(in) :: resume_step
      character(len=1024) :: line
      character(len=:), allocatable :: text
      integer :: unit, status, step
      open (newunit=unit, file=self%path, status='old', action='read', iostat=status)
      if (status /= 0) return
      do
         read (unit, '(a)', iostat=status) line
         if (status /= 0) exit
         if (index(line, begin_entry) == 1) then
            text = trim(line)
            read (line(len(begin_entry) + 1:index(line, '" ') - 1), *, iostat=status) step
            if (status /= 0) exit
         else if (allocated(text)) then
            text = text//newline//trim(line)
            if (line == end_entry) then
               if (step <= resume_step) call append(self%entries, step, text)
               deallocate (text)
            end if
         end if
      end do
      close (unit)
   end subroutine keep_entries

end module m_xdmf_index
