!> Small files that make an animation of a run: `particles.xdmf`, which lists the times of the HDF5 snapshots
!> and refers to them, `particles.hdf.series`, the same for ParaView's reader of VTKHDF, and `levels.xdmf`,
!> the boxes of the levels. ParaView and VTK open them.
module m_xdmf_index
   use m_errors, only: error_t
   use m_communicator, only: communicator_t
   use m_part_file, only: publish_part
   use m_text_file, only: text_file_t
   use m_snapshot, only: snapshot_file_name
   use m_text, only: to_text
   implicit none
   private

   ! One snapshot: its step and its part of the index.
   type :: entry_t
      integer :: step = 0
      character(len=:), allocatable :: text
   end type entry_t

   !> An index; only rank 0 has its entries.
   type, public :: xdmf_index_t
      character(len=:), allocatable, private :: name, path
      character(len=:), allocatable, private :: series !< path of the list of snapshots, if any
      type(entry_t), allocatable, private :: entries(:)
   contains
      procedure :: start
      procedure :: add
   end type xdmf_index_t

   character(len=1), parameter :: newline = achar(10)
   ! lines within an entry never equal these
   character(len=*), parameter :: begin_entry = '    <Grid Name="step ', end_entry = '    </Grid>'
   character(len=*), parameter :: begin_time = '<Time Value="'

contains

   !> Start the index `<directory>/<name>.xdmf`. With `resume_step` the entries of an existing index are kept
   !> up to that step (a run continued from a checkpoint); without it, or if the old index cannot be read, the
   !> index starts empty. An existing file is rewritten at once, so that snapshots of an older run are not
   !> attributed to this one. With `series` there is a `<name>.hdf.series` too: its entries are snapshots.
   !> (`.hdf` is the extension of VTKHDF known to all releases of ParaView; 5.11 does not know `.vtkhdf`.)
   subroutine start(self, communicator, directory, name, error, resume_step, series)
      class(xdmf_index_t), intent(out) :: self
      type(communicator_t), intent(in) :: communicator
      character(len=*), intent(in) :: directory, name
      type(error_t), intent(inout) :: error
      integer, intent(in), optional :: resume_step
      logical, intent(in), optional :: series
      logical :: there
      self%name = name
      self%path = directory//'/'//name//'.xdmf'
      if (present(series)) then
         if (series) self%series = directory//'/'//name//'.hdf.series'
      end if
      allocate (self%entries(0))
      if (communicator%is_root() .and. .not. error%happened()) then
         if (present(resume_step)) call keep_entries(self, resume_step)
         inquire (file=self%path, exist=there)
         if (there) call write_files(self, error)
      end if
      call communicator%agree(error)
   end subroutine start

   !> Collective: add the output of a step (the attributes and contents of a Grid, lines) and rewrite the
   !> index. Entries of this or later steps are removed: the run was continued from before them.
   subroutine add(self, communicator, step, text, error)
      class(xdmf_index_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      integer, intent(in) :: step
      character(len=*), intent(in) :: text
      type(error_t), intent(inout) :: error
      if (communicator%is_root() .and. .not. error%happened()) then
         call append(self%entries, step, begin_entry//to_text(step)//'" '//text//newline//end_entry)
         call write_files(self, error)
      end if
      call communicator%agree(error)
   end subroutine add

   !> Insert an entry after those of smaller steps.
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

   subroutine write_files(self, error)
      class(xdmf_index_t), intent(in) :: self
      type(error_t), intent(inout) :: error
      call write_index(self, error)
      if (allocated(self%series)) call write_series(self, error)
   end subroutine write_files

   subroutine write_index(self, error)
      class(xdmf_index_t), intent(in) :: self
      type(error_t), intent(inout) :: error
      type(text_file_t) :: file
      integer :: e
      call file%open(self%path, error)
      if (error%happened()) return
      call file%put('<?xml version="1.0" ?>'//newline//'<!DOCTYPE Xdmf SYSTEM "Xdmf.dtd" []>'//newline// &
                    '<Xdmf Version="3.0">'//newline//' <Domain>', error)
      call file%put('  <Grid Name="'//self%name//'" GridType="Collection" CollectionType="Temporal">', error)
      do e = 1, size(self%entries)
         call file%put(self%entries(e)%text, error)
      end do
      call file%put('  </Grid>'//newline//' </Domain>'//newline//'</Xdmf>', error)
      call file%close(error)
      call publish_part(self%path, error)
   end subroutine write_index

   !> The snapshots with their times as a ParaView file series (JSON).
   subroutine write_series(self, error)
      class(xdmf_index_t), intent(in) :: self
      type(error_t), intent(inout) :: error
      type(text_file_t) :: file
      integer :: e
      call file%open(self%series, error)
      if (error%happened()) return
      call file%put('{'//newline//'  "file-series-version": "1.0",'//newline//'  "files": [', error)
      do e = 1, size(self%entries)
         call file%put('    {"name": "'//file_in(self%entries(e))//'", "time": '//time_in( &
                       self%entries(e)%text)//trim(merge('},', '} ', e < size(self%entries))), error)
      end do
      call file%put('  ]'//newline//'}', error)
      call file%close(error)
      call publish_part(self%series, error)
   end subroutine write_series

   !> The snapshot that an entry refers to; `.h5` in continued runs of older versions.
   pure function file_in(entry) result(name)
      type(entry_t), intent(in) :: entry
      character(len=:), allocatable :: name
      name = snapshot_file_name(entry%step, 'hdf')
      if (index(entry%text, '>'//snapshot_file_name(entry%step, 'h5')//':') > 0) &
         name = snapshot_file_name(entry%step, 'h5')
   end function file_in

   !> The time of an entry, as text.
   pure function time_in(text) result(time)
      character(len=*), intent(in) :: text
      character(len=:), allocatable :: time
      integer :: first
      first = index(text, begin_time) + len(begin_time)
      time = text(first:first + index(text(first:), '"') - 2)
   end function time_in

   !> Keep the entries of the index on the disk up to a step.
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
