!> The particles of a level as the plain arrays that snapshots are written from.
module m_particle_snapshot
   use mpi_f08
   use m_kinds, only: wp, i8
   use m_communicator, only: communicator_t
   use m_level, only: level_t
   use m_field_table, only: field_t
   use m_snapshot, only: snapshot_t, snapshot_field_t, component_name_length
   implicit none
   private
   public :: take_snapshot

   character(len=*), parameter :: axes(3) = ['x', 'y', 'z']
   character(len=*), parameter :: tensor(6) = ['xx', 'yy', 'zz', 'yz', 'xz', 'xy']

contains

   !> Collective: all written fields, and the number of the body. Particles stand in the order of their blocks' indices, so
   !> that the file is the same on any number of ranks.
   subroutine take_snapshot(communicator, level, snapshot)
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(in) :: level
      type(snapshot_t), intent(inout) :: snapshot
      integer :: b, f, first, last, n, written
      call place_runs(communicator, level, snapshot)
      n = snapshot%n_local
      if (allocated(snapshot%position)) deallocate (snapshot%position, snapshot%id, snapshot%fields)
      written = count(level%table%fields%written) - 1 ! the position stands apart
      allocate (snapshot%position(n, 3), snapshot%id(n), snapshot%fields(written + 1))
      call collect(level, level%layout%position, snapshot%position)
      written = 0
      do f = 1, size(level%table%fields)
         if (.not. level%table%fields(f)%written .or. level%table%fields(f)%name == 'position') cycle
         written = written + 1
         snapshot%fields(written) = empty_field(level%table%fields(f), n)
         call collect(level, level%table%fields(f)%first, snapshot%fields(written)%values)
      end do
      snapshot%fields(written + 1) = empty_field(field_t('body', '', 1), n)
      last = 0
      do b = 1, size(level%blocks)
         first = last + 1
         last = last + level%blocks(b)%particles%count
         if (last < first) cycle
         snapshot%id(first:last) = level%blocks(b)%particles%id(:last - first + 1)
         snapshot%fields(written + 1)%values(first:last, 1) = real(level%blocks(b)%particles%body(:last - first + 1), wp)
      end do
   end subroutine take_snapshot

   !> Where the particles of each block go in the file.
   subroutine place_runs(communicator, level, snapshot)
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(in) :: level
      type(snapshot_t), intent(inout) :: snapshot
      integer, allocatable :: counts(:)
      integer(i8) :: before
      integer :: b, index
      allocate (counts(size(level%owner)), source=0)
      do b = 1, size(level%blocks)
         counts(level%blocks(b)%index) = level%blocks(b)%particles%count
      end do
      snapshot%n_local = sum(counts)
      call MPI_Allreduce(MPI_IN_PLACE, counts, size(counts), MPI_INTEGER, MPI_SUM, communicator%comm)
      snapshot%n_total = sum(int(counts, i8))
      if (allocated(snapshot%run_offset)) deallocate (snapshot%run_offset, snapshot%run_count)
      allocate (snapshot%run_offset(size(level%blocks)), snapshot%run_count(size(level%blocks)))
      before = 0
      b = 1
      do index = 1, size(counts)
         if (b > size(level%blocks)) exit
         if (level%blocks(b)%index == index) then
            snapshot%run_offset(b) = before
            snapshot%run_count(b) = counts(index)
            b = b + 1
         end if
         before = before + counts(index)
      end do
   end subroutine place_runs

   !> A field of a snapshot, not filled.
   function empty_field(field, n) result(snapshot_field)
      type(field_t), intent(in) :: field
      integer, intent(in) :: n
      type(snapshot_field_t) :: snapshot_field
      snapshot_field%name = field%name
      snapshot_field%unit = field%unit
      snapshot_field%components = field%components
      if (field%components == 3) snapshot_field%component_names = [character(len=component_name_length) :: axes]
      if (field%components == 6) snapshot_field%component_names = [character(len=component_name_length) :: tensor]
      allocate (snapshot_field%values(n, field%components))
   end function empty_field

   !> Columns from `first` of all blocks, one block after the other.
   subroutine collect(level, first, values)
      type(level_t), intent(in) :: level
      integer, intent(in) :: first
      real(wp), intent(out) :: values(:, :)
      integer :: b, n, begun
      begun = 0
      do b = 1, size(level%blocks)
         n = level%blocks(b)%particles%count
         values(begun + 1:begun + n, :) = level%blocks(b)%particles%column(:n, first:first + size(values, 2) - 1)
         begun = begun + n
      end do
   end subroutine collect

end module m_particle_snapshot
