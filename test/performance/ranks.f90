!> What each of many ranks would hold and send, for the scene on standard input: the program's own placement of blocks and its own
!> message lists, made for any number of ranks by one process. Counts, not times; bench.py turns them into a model and checks them
!> against runs.
!> usage: ranks P [P ...] < scene
program ranks
   use m_kinds, only: i8
   use m_errors, only: error_t
   use m_communicator, only: communicator_t
   use m_scene, only: scene_t
   use m_offer, only: catalogue_t
   use m_materials, only: known_materials
   use m_effects, only: known_effects
   use m_scene_reader, only: read_scene
   use m_grid_level, only: make_grid_level
   use m_level, only: level_t
   use m_body, only: count_in_block
   use m_decomposition, only: choose_owners, set_owners, settle_blocks
   use m_node_exchange, only: node_exchange_t
   implicit none
   type(communicator_t) :: communicator
   type(catalogue_t) :: catalogue
   type(scene_t) :: scene
   type(level_t), target :: levels(1)
   type(level_t), pointer :: level
   type(error_t) :: error
   integer, allocatable :: counts(:), owner(:)
   integer :: a, b, index, number
   character(len=12) :: word
   call communicator%start()
   call known_materials(catalogue)
   call known_effects(catalogue)
   call read_scene(communicator, catalogue, scene, error)
   if (error%happened()) error stop 'the scene is not valid'
   level => levels(1)
   level%grid = make_grid_level(scene%grid)
   allocate (counts(product(level%grid%blocks)), source=0)
   do index = 1, size(counts)
      do b = 1, size(scene%bodies)
         counts(index) = counts(index) + count_in_block(levels, 1, level%grid%block_place(index), scene%bodies(b))
      end do
   end do
   allocate (owner(size(counts)))
   print '(a)', 'ranks blocks_most particles_mean particles_most neighbours_most messages_all bytes_most bytes_all'
   do a = 1, command_argument_count()
      call get_command_argument(a, word)
      read (word, *) number
      call place(number)
   end do
   call communicator%finish()
contains

   !> One line: the blocks placed on a number of ranks. Bytes and messages are those of one exchange of node sums.
   subroutine place(number)
      integer, intent(in) :: number
      type(communicator_t) :: one
      type(node_exchange_t) :: exchange
      integer :: rank, blocks, neighbours
      integer(i8) :: particles, most, messages, bytes, bytes_all
      one = communicator
      one%ranks = number
      call choose_owners(one, levels, merge(counts, -1, counts > 0), owner, error)
      if (error%happened()) error stop 'METIS could not place the blocks'
      call set_owners(levels, owner)
      blocks = 0
      neighbours = 0
      most = 0
      messages = 0
      bytes = 0
      bytes_all = 0
      do rank = 0, number - 1
         one%rank = rank
         if (allocated(level%blocks)) deallocate (level%blocks)
         call settle_blocks(level, rank)
         call exchange%build(one, level)
         particles = sum(int(counts(level%blocks%index), i8))
         blocks = max(blocks, size(level%blocks))
         neighbours = max(neighbours, size(exchange%ranks))
         messages = messages + size(exchange%ranks)
         most = max(most, particles)
         bytes = max(bytes, exchange%bytes_each)
         bytes_all = bytes_all + exchange%bytes_each
      end do
      call exchange%release()
      print '(i0,1x,i0,1x,i0,1x,i0,1x,i0,1x,i0,1x,i0,1x,i0)', number, blocks, sum(int(counts, i8), counts > 0)/number, most, &
         neighbours, messages, bytes, bytes_all
   end subroutine place

end program ranks
