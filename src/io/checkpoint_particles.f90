!> The particles in a checkpoint: a table for each field, and the bounds of the blocks that contain them
!> (doc/developer/files.md).
module m_checkpoint_particles
   use, intrinsic :: iso_c_binding, only: c_loc
   use m_kinds, only: wp, i4, i8
   use m_errors, only: error_t
   use m_field_table, only: field_t
   use m_model, only: model_t
   use m_restore, only: block_table_t, bounds_width
   use m_snapshot, only: file_layout_t
   use m_file_store, only: some_rows
   use m_hdf5_file, only: hdf5_file_t, rows_of_real, rows_of_long
   use m_hdf5_reader, only: hdf5_reader_t
   implicit none
   private
   public :: put_bounds, put_particles, get_particles

   integer, parameter, public :: own_columns = 3 !< of a particle, in addition to its fields: id, body, bin

contains

   !> Each rank writes the bounds of its own blocks.
   subroutine put_bounds(file, blocks, error)
      type(hdf5_file_t), intent(in) :: file
      type(block_table_t), intent(in), target :: blocks
      type(error_t), intent(inout) :: error
      real(wp), allocatable, target :: values(:, :)
      values = blocks%bounds(:, blocks%first:blocks%first + blocks%own - 1)
      call file%put_rows('/blocks/bounds', rows_of_real, [int(bounds_width, i8), size(blocks%table, 2, i8)], &
                         some_rows(int(blocks%first - 1, i8), blocks%own), c_loc(values), error)
   end subroutine put_bounds

   !> Collective: write a table for each field, and one for id, body and bin; each rank writes one range of
   !> rows.
   subroutine put_particles(file, model, blocks, error)
      type(hdf5_file_t), intent(in) :: file
      type(model_t), intent(in) :: model
      type(block_table_t), intent(in) :: blocks
      type(error_t), intent(inout) :: error
      type(file_layout_t) :: where_to
      real(wp), allocatable, target :: values(:, :)
      integer(i8), allocatable, target :: own(:, :)
      integer :: b, f, l, n, done
      n = int(model%particle_count())
      where_to = some_rows(0_i8, n)
      if (n > 0) where_to%offset = blocks%table(5, blocks%first)
      allocate (own(own_columns, n))
      done = 0
      do l = 1, size(model%levels)
         do b = 1, size(model%levels(l)%blocks)
            associate (block => model%levels(l)%blocks(b), m => model%levels(l)%blocks(b)%particles%count)
               own(1, done + 1:done + m) = block%particles%id(:m)
               own(2, done + 1:done + m) = block%particles%body(:m)
               own(3, done + 1:done + m) = block%cells%bin(:m)
               done = done + m
            end associate
         end do
      end do
      call file%put_rows('/particles/own', rows_of_long, [int(own_columns, i8), blocks%particles], where_to, &
                         c_loc(own), error)
      do f = 1, size(model%levels(1)%table%fields)
         associate (field => model%levels(1)%table%fields(f))
            if (allocated(values)) deallocate (values)
            allocate (values(field%components, n))
            call pack_field(model, field, values)
            call file%put_rows('/particles/'//field%name, rows_of_real, &
                               [int(field%components, i8), blocks%particles], where_to, c_loc(values), error)
            call file%put_text('/particles/'//field%name, 'unit', field%unit, error)
         end associate
      end do
   end subroutine put_particles

   !> The columns of a field of this rank's particles, as rows.
   subroutine pack_field(model, field, values)
      type(model_t), intent(in) :: model
      type(field_t), intent(in) :: field
      real(wp), intent(out) :: values(:, :)
      integer :: b, c, done, l, p
      done = 0
      do l = 1, size(model%levels)
         do b = 1, size(model%levels(l)%blocks)
            associate (particles => model%levels(l)%blocks(b)%particles)
               do c = 1, field%components
                  do p = 1, particles%count
                     values(c, done + p) = particles%column(p, field%first + c - 1)
                  end do
               end do
               done = done + particles%count
            end associate
         end do
      end do
   end subroutine pack_field

   !> Collective: read the particles of this rank's blocks, wherever they are in the file, in their order.
   subroutine get_particles(file, model, blocks, error)
      type(hdf5_reader_t), intent(in) :: file
      type(model_t), intent(inout) :: model
      type(block_table_t), intent(in) :: blocks
      type(error_t), intent(inout) :: error
      type(file_layout_t) :: where_from
      real(wp), allocatable, target :: values(:, :)
      integer(i8), allocatable, target :: own(:, :)
      integer, allocatable :: level(:), number(:)
      integer :: c, done, f, n, p
      call list_own(model, blocks, level, number, where_from)
      n = sum(where_from%count)
      allocate (own(own_columns, n))
      call file%get_rows('/particles/own', rows_of_long, [int(own_columns, i8), blocks%particles], &
                         where_from, c_loc(own), error)
      if (error%happened()) return
      done = 0
      do n = 1, size(level)
         associate (block => model%levels(level(n))%blocks(number(n)))
            block%particles%body(:block%particles%count) = int(max(-1_i8, &
               min(own(2, done + 1:done + block%particles%count), 2_i8**30)), i4)
            do p = 1, block%particles%count
               block%particles%id(p) = own(1, done + p)
               block%cells%bin(p) = int(max(-1_i8, min(own(3, done + p), 2_i8**30)), i4)
            end do
            done = done + block%particles%count
         end associate
      end do
      do f = 1, size(model%levels(1)%table%fields)
         associate (field => model%levels(1)%table%fields(f))
            if (allocated(values)) deallocate (values)
            allocate (values(field%components, sum(where_from%count)))
            call file%get_rows('/particles/'//field%name, rows_of_real, [int(field%components, i8), &
                               blocks%particles], where_from, &
                               c_loc(values), error)
            if (error%happened()) return
            done = 0
            do n = 1, size(level)
               associate (particles => model%levels(level(n))%blocks(number(n))%particles)
                  do c = 1, field%components
                     do p = 1, particles%count
                        particles%column(p, field%first + c - 1) = values(c, done + p)
                     end do
                  end do
                  done = done + particles%count
               end associate
            end do
         end associate
      end do
   end subroutine get_particles

   !> This rank's blocks in the order of the file, and the row ranges of their particles.
   subroutine list_own(model, blocks, level, number, where_from)
      type(model_t), intent(in) :: model
      type(block_table_t), intent(in) :: blocks
      integer, allocatable, intent(out) :: level(:), number(:)
      type(file_layout_t), intent(out) :: where_from
      integer :: index, l, m, n, rows, runs
      m = 0
      do l = 1, size(model%levels)
         m = m + size(model%levels(l)%blocks)
      end do
      allocate (level(m), number(m), where_from%offset(m), where_from%count(m))
      m = 0
      runs = 0
      do n = 1, size(blocks%table, 2)
         l = int(blocks%table(1, n))
         index = int(blocks%table(2, n))
         if (model%levels(l)%owner(index) /= model%communicator%rank) cycle
         m = m + 1
         level(m) = l
         number(m) = model%levels(l)%slot(index)
         rows = int(blocks%table(3, n))
         if (rows == 0) cycle
         if (runs > 0) then
            if (where_from%offset(runs) + where_from%count(runs) == blocks%table(5, n)) then
               where_from%count(runs) = where_from%count(runs) + rows
               cycle
            end if
         end if
         runs = runs + 1
         where_from%offset(runs) = blocks%table(5, n)
         where_from%count(runs) = rows
      end do
      where_from%offset = where_from%offset(:runs)
      where_from%count = where_from%count(:runs)
   end subroutine list_own

end module m_checkpoint_particles
