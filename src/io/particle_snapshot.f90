!> The particles of all levels as plain arrays for snapshots.
module m_particle_snapshot
   use mpi_f08
   use m_kinds, only: wp, i8
   use m_communicator, only: communicator_t
   use m_level, only: level_t
   use m_model, only: model_t
   use m_recovered_stress, only: level_stress_t, recover_stress
   use m_decomposition, only: blocks_before
   use m_field_table, only: field_t
   use m_ipf_colour, only: add_ipf_colour
   use m_motion_fields, only: motion_field_t, motion_fields, motion_columns, motion_of
   use m_snapshot, only: snapshot_t, snapshot_level_t, snapshot_field_t, component_name_length
   implicit none
   private
   public :: take_snapshot

   character(len=*), parameter :: axes(3) = ['x', 'y', 'z']
   character(len=*), parameter :: tensor(6) = ['xx', 'yy', 'zz', 'yz', 'xz', 'xy']

contains

   !> Collective: all written fields, the recovered stress, the numbers of body and level, the levels' boxes.
   !> Particles are ordered by level and by block index, so that the file is the same on any number of ranks.
   subroutine take_snapshot(model, snapshot)
      type(model_t), intent(inout) :: model !< unchanged
      type(snapshot_t), intent(inout) :: snapshot
      integer :: b, f, first, group, l, last, n, written
      associate (levels => model%levels, table => model%levels(1)%table)
         call place_runs(model%communicator, levels, snapshot)
         n = snapshot%n_local
         written = count(table%fields%written) - 1 ! the position is separate
         if (allocated(snapshot%position)) deallocate (snapshot%position, snapshot%id, snapshot%fields)
         group = written + merge(4, 3, size(levels) > 1)
         allocate (snapshot%fields(merge(group, group - 1, levels(1)%grid%fields > 1)))
         snapshot%fields(written + 1) = empty_field(field_t('stress_recovered', 'Pa', 6), n)
         call collect_recovered(model, snapshot%fields(written + 1)%values)
         allocate (snapshot%position(n, 3), snapshot%id(n))
         snapshot%id_bits = levels(1)%layout%id_bits
         call collect(levels, levels(1)%layout%position, snapshot%position)
         written = 0
         do f = 1, size(table%fields)
            if (.not. table%fields(f)%written .or. table%fields(f)%name == 'position') cycle
            written = written + 1
            snapshot%fields(written) = empty_field(table%fields(f), n)
            call collect(levels, table%fields(f)%first, snapshot%fields(written)%values)
         end do
         snapshot%fields(written + 2) = empty_field(field_t('body', '', 1), n)
         if (size(levels) > 1) snapshot%fields(written + 3) = empty_field(field_t('level', '', 1), n)
         if (levels(1)%grid%fields > 1) &
            snapshot%fields(group) = empty_field(field_t('contact_group', '', 1), n)
         last = 0
         do l = 1, size(levels)
            do b = 1, size(levels(l)%blocks)
               associate (particles => levels(l)%blocks(b)%particles)
                  first = last + 1
                  last = last + particles%count
                  if (last < first) cycle
                  snapshot%id(first:last) = particles%id(:particles%count)
                  snapshot%fields(written + 2)%values(first:last, 1) &
                     = real(particles%body(:particles%count), wp)
                  if (size(levels) > 1) snapshot%fields(written + 3)%values(first:last, 1) = real(l, wp)
                  if (levels(1)%grid%fields > 1) snapshot%fields(group)%values(first:last, 1) &
                     = real(levels(l)%blocks(b)%field, wp)
               end associate
            end do
         end do
      end associate
      call snapshot%add_von_mises()
      call add_ipf_colour(snapshot)
      call add_motion(snapshot, model%levels)
   end subroutine take_snapshot

   !> Collective: the recovered stress of all blocks of all levels, one block after the other.
   subroutine collect_recovered(model, values)
      type(model_t), intent(inout) :: model
      real(wp), intent(out) :: values(:, :) !< (local particles, 6), Pa
      type(level_stress_t), allocatable :: recovered(:)
      integer :: b, l, n, begun
      begun = 0
      call recover_stress(model, recovered)
      do l = 1, size(recovered)
         do b = 1, size(recovered(l)%blocks)
            n = size(recovered(l)%blocks(b)%of, 2)
            values(begun + 1:begun + n, :) = transpose(recovered(l)%blocks(b)%of)
            begun = begun + n
         end do
      end do
   end subroutine collect_recovered

   !> File positions of the particles of each block.
   subroutine place_runs(communicator, levels, snapshot)
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(in) :: levels(:)
      type(snapshot_t), intent(inout) :: snapshot
      integer, allocatable :: counts(:)
      integer(i8) :: before(blocks_before(levels, size(levels) + 1))
      integer :: b, index, l, r
      allocate (counts(size(before)), source=0)
      do l = 1, size(levels)
         do b = 1, size(levels(l)%blocks)
            counts(blocks_before(levels, l) + levels(l)%blocks(b)%index) = levels(l)%blocks(b)%particles%count
         end do
      end do
      snapshot%n_local = sum(counts)
      call MPI_Allreduce(MPI_IN_PLACE, counts, size(counts), MPI_INTEGER, MPI_SUM, communicator%comm)
      snapshot%n_total = sum(int(counts, i8))
      call describe_levels(levels, counts, snapshot)
      before(1) = 0
      do index = 2, size(counts)
         before(index) = before(index - 1) + counts(index - 1)
      end do
      if (allocated(snapshot%run_offset)) deallocate (snapshot%run_offset, snapshot%run_count)
      allocate (snapshot%run_offset(sum(own_blocks(levels))), snapshot%run_count(sum(own_blocks(levels))))
      r = 0
      do l = 1, size(levels)
         do b = 1, size(levels(l)%blocks)
            r = r + 1
            snapshot%run_offset(r) = before(blocks_before(levels, l) + levels(l)%blocks(b)%index)
            snapshot%run_count(r) = levels(l)%blocks(b)%particles%count
         end do
      end do
   end subroutine place_runs

   !> Regions, cells and particles of the levels, if there are several. `counts`: particles of the blocks of
   !> all levels.
   pure subroutine describe_levels(levels, counts, snapshot)
      type(level_t), intent(in) :: levels(:)
      integer, intent(in) :: counts(:)
      type(snapshot_t), intent(inout) :: snapshot
      integer :: l
      if (allocated(snapshot%levels)) deallocate (snapshot%levels)
      if (size(levels) == 1) return
      allocate (snapshot%levels(size(levels)))
      do l = 1, size(levels)
         snapshot%levels(l) = snapshot_level_t(levels(l)%region, levels(l)%grid%cell, &
                                               sum(int(counts(blocks_before(levels, l) &
                                               + 1:blocks_before(levels, l + 1)), i8)))
      end do
   end subroutine describe_levels

   !> Number of this rank's blocks of a level.
   pure elemental integer function own_blocks(level)
      type(level_t), intent(in) :: level
      own_blocks = size(level%blocks)
   end function own_blocks

   !> A field of a snapshot, not yet filled.
   function empty_field(field, n) result(snapshot_field)
      type(field_t), intent(in) :: field
      integer, intent(in) :: n
      type(snapshot_field_t) :: snapshot_field
      snapshot_field%name = field%name
      snapshot_field%unit = field%unit
      snapshot_field%components = field%components
      if (field%components == 3) &
         snapshot_field%component_names = [character(len=component_name_length) :: axes]
      if (field%components == 6) &
         snapshot_field%component_names = [character(len=component_name_length) :: tensor]
      allocate (snapshot_field%values(n, field%components))
   end function empty_field

   !> Columns from `first` of all blocks of all levels, one block after the other.
   subroutine collect(levels, first, values)
      type(level_t), intent(in) :: levels(:)
      integer, intent(in) :: first
      real(wp), intent(out) :: values(:, :)
      integer :: b, l, n, begun
      begun = 0
      do l = 1, size(levels)
         do b = 1, size(levels(l)%blocks)
            n = levels(l)%blocks(b)%particles%count
            values(begun + 1:begun + n, :) = levels(l)%blocks(b)%particles%column(:n, first:first &
                  + size(values, 2) - 1)
            begun = begun + n
         end do
      end do
   end subroutine collect

   !> Add the displacement, strain and deformation gradient requested by the scene.
   subroutine add_motion(snapshot, levels)
      type(snapshot_t), intent(inout) :: snapshot
      type(level_t), intent(in) :: levels(:)
      type(motion_field_t), allocatable :: new(:)
      type(snapshot_field_t), allocatable :: fields(:)
      real(wp), allocatable :: values(:, :)
      integer :: b, c, f, first, l, n, p
      new = motion_fields(levels(1)%layout)
      if (size(new) == 0) return
      allocate (values(snapshot%n_local, size(motion_columns(levels(1)%layout))))
      n = 0
      do l = 1, size(levels)
         do b = 1, size(levels(l)%blocks)
            associate (particles => levels(l)%blocks(b)%particles)
               do p = 1, particles%count
                  values(n + p, :) = motion_of(particles%column(p, :), levels(l)%layout)
               end do
               n = n + particles%count
            end associate
         end do
      end do
      n = size(snapshot%fields)
      allocate (fields(n + size(new)))
      fields(:n) = snapshot%fields
      first = 1
      do f = 1, size(new)
         c = size(new(f)%components)
         fields(n + f)%name = trim(new(f)%name)
         fields(n + f)%unit = trim(new(f)%unit)
         fields(n + f)%components = c
         fields(n + f)%component_names = [character(len=component_name_length) :: new(f)%components]
         fields(n + f)%values = values(:, first:first + c - 1)
         first = first + c
      end do
      call move_alloc(fields, snapshot%fields)
   end subroutine add_motion

end module m_particle_snapshot
