!> What each of many ranks would hold and send, for the scene on standard input: the program's own placement
!> of blocks and its own message lists, made for any number of ranks by one process. Counts, not times;
!> bench.py turns them into a model and checks them against runs. usage: ranks P [P ...] < scene
program ranks
   use m_kinds, only: wp, i8
   use m_errors, only: error_t
   use m_communicator, only: communicator_t
   use m_scene, only: scene_t
   use m_offer, only: catalogue_t
   use m_materials, only: known_materials
   use m_effects, only: known_effects
   use m_snapshot_formats, only: known_formats
   use m_scene_reader, only: read_scene
   use m_model, only: model_t
   use m_grid_level, only: make_grid_level
   use m_level, only: level_t
   use m_body, only: count_in_block
   use m_placement, only: work_of, order_work, choose_owners
   use m_decomposition, only: set_owners, settle_blocks, blocks_before
   use m_halo_runs, only: runs_t, find_neighbours, find_shared
   use m_composite, only: composite_t
   use mpi_f08, only: MPI_COMM_SELF
   implicit none
   type(communicator_t) :: communicator
   type(catalogue_t) :: catalogue
   type(scene_t) :: scene
   type(level_t), allocatable :: levels(:)
   type(error_t) :: error
   integer, allocatable :: counts(:), owner(:) !< of the blocks of all levels
   integer, allocatable :: order(:)            !< what it costs in a step how their particles lie, as in the
                                               !< placement
   integer, allocatable :: steps_of_levels(:)  !< in a step of the coarsest
   integer :: a, number
   character(len=12) :: word
   call communicator%start()
   call known_materials(catalogue)
   call known_effects(catalogue)
   call known_formats(catalogue)
   call read_scene(communicator, catalogue, '', scene, error)
   if (error%happened()) error stop 'the scene is not valid'
   if (size(scene%levels) == 0) then
      call count_one_level()
   else
      call count_levels()
   end if
   steps_of_levels = [(2**merge(a - 1, 0, scene%time%subcycle), a=1, size(levels))]
   allocate (owner(size(counts)))
   print '(a)', 'ranks blocks_most particles_mean work_mean work_most neighbours_most messages_most '// &
      'messages_all bytes_most bytes_all'
   do a = 1, command_argument_count()
      call get_command_argument(a, word)
      read (word, *) number
      call place(number)
   end do
   call communicator%finish()
contains

   !> One level: its blocks with their particles, none of which is made.
   subroutine count_one_level()
      integer :: index, b
      allocate (levels(1))
      levels(1)%grid = make_grid_level(scene%grid)
      allocate (counts(product(levels(1)%grid%blocks)), source=0)
      do index = 1, size(counts)
         do b = 1, size(scene%bodies)
            counts(index) = counts(index) + count_in_block(levels, 1, levels(1)%grid%block_place(index), &
                                                           scene%bodies(b))
         end do
      end do
      where (counts == 0) counts = -1
      allocate (order(size(counts)), source=0) ! a level alone is placed before its particles are made
   end subroutine count_one_level

   !> Several levels: the blocks that a run makes.
   subroutine count_levels()
      type(model_t) :: model
      type(communicator_t) :: alone
      integer :: b, l
      alone%comm = MPI_COMM_SELF
      alone%rank = 0
      alone%ranks = 1
      call model%build(alone, scene, error)
      if (error%happened()) error stop 'the model cannot be built'
      allocate (counts(blocks_before(model%levels, size(model%levels) + 1)), source=-1)
      allocate (order(size(counts)), source=0)
      do l = 1, size(model%levels)
         do b = 1, size(model%levels(l)%blocks)
            associate (block => model%levels(l)%blocks(b))
               counts(blocks_before(model%levels, l) + block%index) = block%particles%count
               order(blocks_before(model%levels, l) + block%index) = order_work(block%cells%occupied, &
                  block%mean_breaks)
            end associate
         end do
      end do
      levels = model%levels
      call model%release()
   end subroutine count_levels

   !> One line: the blocks placed on a number of ranks. Work is particles times steps, messages and bytes
   !> those of node sums and between levels, all in one step of the coarsest level.
   subroutine place(number)
      integer, intent(in) :: number
      type(communicator_t) :: one
      integer, allocatable :: around(:)
      type(runs_t) :: sent
      type(composite_t) :: composite
      integer :: blocks, blocks_most, l, n, neighbours, rank, sums
      integer(i8) :: bytes, bytes_all, bytes_most, messages, messages_all, messages_most, steps, work, &
         work_all, work_most
      one = communicator
      one%ranks = number
      call choose_owners(one, levels, work_of(levels, counts, steps_of_levels, order=order), owner, error)
      if (error%happened()) error stop 'METIS could not place the blocks'
      call set_owners(levels, owner)
      blocks_most = 0; neighbours = 0; work_most = 0; work_all = 0
      messages_most = 0; messages_all = 0; bytes_most = 0; bytes_all = 0
      do rank = 0, number - 1
         one%rank = rank
         blocks = 0; work = 0; messages = 0; bytes = 0
         do l = 1, size(levels)
            if (allocated(levels(l)%blocks)) deallocate (levels(l)%blocks)
            call settle_blocks(levels(l), rank)
            around = find_neighbours(levels(l), number)
            steps = steps_of_levels(l)
            sums = 1 ! node sums of a step: one more where a finer level takes two steps, and one where their
                     ! time lag is corrected
            if (l < size(levels) .and. scene%time%subcycle) &
               sums = merge(3, 2, levels(l)%layout%corrects_lag())
            associate (before => blocks_before(levels, l))
               work = work + steps*sum(int(max(0, counts(before + levels(l)%blocks%index)), i8))
            end associate
            blocks = blocks + size(levels(l)%blocks)
            neighbours = max(neighbours, size(around))
            messages = messages + steps*sums*size(around)
            do n = 1, size(around)
               call find_shared(levels(l), rank, around(n), sent)
               bytes = bytes + steps*sums*sent%values*(storage_size(1.0_wp)/8)
            end do
         end do
         do l = 2, size(levels)
            call composite%build(one, levels(l - 1), levels(l))
            steps = steps_of_levels(l) ! up and down as often as the finer level steps
            messages = messages + steps*sum(composite%exchange%messages_each)
            bytes = bytes + steps*sum(composite%exchange%bytes_each)
         end do
         blocks_most = max(blocks_most, blocks)
         work_most = max(work_most, work)
         work_all = work_all + work
         messages_most = max(messages_most, messages)
         messages_all = messages_all + messages
         bytes_most = max(bytes_most, bytes)
         bytes_all = bytes_all + bytes
      end do
      call composite%release()
      print '(*(i0,1x))', number, blocks_most, sum(int(counts, i8), counts > 0)/number, work_all/number, &
         work_most, neighbours, messages_most, messages_all, bytes_most, bytes_all
   end subroutine place

end program ranks
