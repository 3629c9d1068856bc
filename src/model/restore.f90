!> The state of a model without its particles as tables, and the reconstruction of a model from such tables:
!> its blocks, and their accumulated values.
module m_restore
   use mpi_f08
   use m_kinds, only: wp, i8
   use m_constants, only: exit_files
   use m_errors, only: error_t, fail
   use m_cell_list, only: bins
   use m_placement, only: work_of, choose_owners
   use m_decomposition, only: set_owners, all_owners, bytes_of_blocks, blocks_before
   use m_large_pages, only: hold_large_pages
   use m_model, only: model_t
   use m_state, only: block_reals, block_state, set_block_state, set_regions
   implicit none
   private
   public :: take_blocks, restore_blocks, check_particles

   integer, parameter, public :: table_width = 5, bounds_width = block_reals

   !> All existing blocks of all levels, a row each: ordered by rank, level and index, as the particles in a
   !> file.
   type, public :: block_table_t
      integer(i8), allocatable :: table(:, :) !< level, index, particles, rank, rows of particles before:
                                              !< (table_width, blocks)
      real(wp), allocatable :: bounds(:, :)   !< as returned by block_state: (bounds_width, blocks)
      integer :: first = 0                    !< row of this rank's first block
      integer :: own = 0                      !< number of this rank's rows
      integer(i8) :: particles = 0            !< of all ranks
   end type block_table_t

contains

   !> Collective: the table of a model's blocks. Every rank has all of `table`, and the bounds of its own
   !> blocks (others: zero).
   subroutine take_blocks(model, blocks)
      type(model_t), intent(in) :: model
      type(block_table_t), intent(out) :: blocks
      integer, allocatable :: owner(:), counts(:)
      integer(i8) :: before
      integer :: b, index, l, n, rank
      owner = all_owners(model%levels)
      allocate (counts(size(owner)), source=0)
      do l = 1, size(model%levels)
         do b = 1, size(model%levels(l)%blocks)
            counts(blocks_before(model%levels, l) &
                   + model%levels(l)%blocks(b)%index) = model%levels(l)%blocks(b)%particles%count
         end do
      end do
      call MPI_Allreduce(MPI_IN_PLACE, counts, size(counts), MPI_INTEGER, MPI_SUM, model%communicator%comm)
      allocate (blocks%table(table_width, count(owner >= 0)))
      allocate (blocks%bounds(bounds_width, size(blocks%table, 2)), source=0.0_wp)
      n = 0
      before = 0
      do rank = 0, model%communicator%ranks - 1
         if (rank == model%communicator%rank) blocks%first = n + 1
         do l = 1, size(model%levels)
            associate (first => blocks_before(model%levels, l))
               do index = 1, model%levels(l)%grid%block_count()
                  if (owner(first + index) /= rank) cycle
                  n = n + 1
                  blocks%table(:, n) = [int(l, i8), int(index, i8), int(counts(first + index), i8), &
                                       int(rank, i8), before]
                  before = before + counts(first + index)
               end do
            end associate
         end do
         if (rank == model%communicator%rank) blocks%own = n + 1 - blocks%first
      end do
      blocks%particles = before
      n = blocks%first - 1
      do l = 1, size(model%levels)
         do b = 1, size(model%levels(l)%blocks)
            n = n + 1
            blocks%bounds(:, n) = block_state(model, l, b)
         end do
      end do
   end subroutine take_blocks

   !> Collective: create the regions and blocks of an empty model, with room for their particles. On the same
   !> number of ranks as before, blocks go to the rank that owned them; else they are redistributed. All ranks
   !> have the whole table.
   subroutine restore_blocks(model, regions, ranks, blocks, error)
      type(model_t), intent(inout) :: model
      integer(i8), intent(in) :: regions(:) !< of levels 2 and on, packed, one after the other
      integer(i8), intent(in) :: ranks      !< number of ranks of the table
      type(block_table_t), intent(inout) :: blocks
      type(error_t), intent(inout) :: error
      integer, allocatable :: counts(:), owner(:)
      integer :: b, l, n
      call check_table(model, ranks, blocks, error)
      call restore_regions(model, regions, error)
      if (error%happened()) return
      call model%place_layers()
      allocate (counts(blocks_before(model%levels, size(model%levels) + 1)), source=-1)
      allocate (owner(size(counts)), source=-1)
      do n = 1, size(blocks%table, 2)
         associate (number => blocks_before(model%levels, int(blocks%table(1, n))) + int(blocks%table(2, n)))
            counts(number) = int(blocks%table(3, n))
            owner(number) = int(blocks%table(4, n))
         end associate
      end do
      if (ranks /= model%communicator%ranks) then
         call choose_owners(model%communicator, model%levels, work_of(model%levels, counts, &
               model%steps_of_levels()), owner, error)
         if (error%happened()) return
      end if
      call set_owners(model%levels, owner)
      call hold_large_pages(bytes_of_blocks(model%levels, counts, owner, model%communicator%rank))
      call model%connect()
      do n = 1, size(blocks%table, 2)
         l = int(blocks%table(1, n))
         b = own_block(model, l, int(blocks%table(2, n)))
         if (b == 0) cycle
         associate (block => model%levels(l)%blocks(b))
            call block%reserve(max(1, int(blocks%table(3, n))), model%levels(l)%table%columns)
            block%particles%count = int(blocks%table(3, n))
         end associate
         call set_block_state(model, l, b, blocks%bounds(:, n))
      end do
      do l = 1, size(model%levels)
         call model%levels(l)%size_work()
      end do
   end subroutine restore_blocks

   !> Local number of the block of a level with an index; 0 if it is on another rank.
   pure integer function own_block(model, l, index) result(b)
      type(model_t), intent(in) :: model
      integer, intent(in) :: l, index
      b = 0
      if (model%levels(l)%owner(index) == model%communicator%rank) b = model%levels(l)%slot(index)
   end function own_block

   !> Check that rows of the table are unique blocks of this grid, and that their particles are consecutive.
   subroutine check_table(model, ranks, blocks, error)
      type(model_t), intent(in) :: model
      integer(i8), intent(in) :: ranks
      type(block_table_t), intent(in) :: blocks
      type(error_t), intent(inout) :: error
      logical, allocatable :: seen(:)
      integer(i8) :: before
      integer :: n
      logical :: good
      allocate (seen(blocks_before(model%levels, size(model%levels) + 1)), source=.false.)
      before = 0
      good = size(blocks%table, 2) > 0 .and. ranks > 0
      do n = 1, size(blocks%table, 2)
         if (good) good = blocks%table(1, n) >= 1 .and. blocks%table(1, n) <= size(model%levels)
         if (good) good = blocks%table(2, n) >= 1 .and. &
                          blocks%table(2, n) <= model%levels(int(blocks%table(1, n)))%grid%block_count()
         if (good) &
            good = blocks%table(3, n) >= 0 .and. blocks%table(4, n) >= 0 .and. blocks%table(4, n) < ranks &
                   .and. blocks%table(5, n) == before .and. blocks%table(3, n) <= blocks%particles - before
         if (.not. good) exit
         before = before + blocks%table(3, n)
         associate (number => blocks_before(model%levels, int(blocks%table(1, n))) + int(blocks%table(2, n)))
            good = .not. seen(number)
            seen(number) = .true.
         end associate
      end do
      if (good) good = before == blocks%particles
      if (.not. good) call fail(error, exit_files, 'its blocks do not match its scene')
   end subroutine check_table

   subroutine restore_regions(model, regions, error)
      type(model_t), intent(inout) :: model
      integer(i8), intent(in) :: regions(:)
      type(error_t), intent(inout) :: error
      logical :: good
      call set_regions(model, regions, good)
      if (.not. good) call fail(error, exit_files, 'its levels do not match its scene')
   end subroutine restore_regions

   !> Collective: check that the particles read are valid: bins, bodies, positions.
   subroutine check_particles(model, error)
      type(model_t), intent(inout) :: model
      type(error_t), intent(inout) :: error
      integer :: b, l, n
      logical :: good
      good = .true.
      do l = 1, size(model%levels)
         do b = 1, size(model%levels(l)%blocks)
            associate (block => model%levels(l)%blocks(b), x => model%levels(l)%layout%position, &
                       cell => model%levels(l)%grid%cell)
               n = block%particles%count
               good = good .and. block%run_breaks >= 0 .and. all(block%cells%bin(:n) >= 1 &
                  .and. block%cells%bin(:n) <= bins) .and. all(block%particles%body(:n) >= 1 &
                  .and. block%particles%body(:n) <= size(model%materials%of_body)) &
                  .and. all(block%particles%id(:n) > 0)
               if (n > 0 .and. good) &
                  good = all(minval(block%particles%column(:n, x:x + 2), dim=1) >= block%origin - cell) &
                         .and. all(maxval(block%particles%column(:n, x:x + 2), dim=1) <= block%origin &
                         + 9*cell)
            end associate
         end do
      end do
      if (.not. good) call fail(error, exit_files, 'its particles do not match its scene')
      call model%communicator%agree(error)
      if (error%happened()) return
      do l = 1, size(model%levels)
         do b = 1, size(model%levels(l)%blocks)
            associate (block => model%levels(l)%blocks(b))
               call block%particles%changed()
               call block%cells%outdate()
            end associate
         end do
      end do
   end subroutine check_particles

end module m_restore
