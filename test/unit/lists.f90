!test: ranks 1 2 4
!> Lists, migration and new blocks under random motion: every particle is in one bin, that of its nearest
!> node, and none is lost, doubled or changed; the order in memory is that of one rank.
program lists
   use m_kinds, only: wp, i8
   use m_errors, only: error_t
   use m_communicator, only: communicator_t
   use m_cell_list, only: bins
   use m_model, only: model_t
   use m_assertions, only: assertions_t
   use m_wandering, only: build_wandering, wander, wrong_values, wrong_bins, all_ids, alone, ordered_ids, &
      wrong_lists, came
   implicit none
   integer, parameter :: steps = 60
   type(communicator_t) :: comm
   type(assertions_t) :: test
   type(model_t) :: model, single
   type(error_t) :: error
   integer(i8), allocatable :: ids(:), at_start(:)
   integer(i8) :: moved, sent, blocks
   integer :: step
   call comm%start()
   call test%start(comm, 'lists')
   call build_wandering(model, comm, error)
   call test%check(.not. error%happened(), 'the model is built')
   call build_wandering(single, alone(), error)
   at_start = all_ids(model)
   blocks = count(model%levels(1)%owner >= 0)
   call test%check(size(at_start) > 4000, 'thousands of particles')
   call test%check(all(at_start(2:) > at_start(:size(at_start) - 1)), 'no id twice')
   do step = 1, steps
      call wander(model, step)
      call wander(single, step)
      call test%check_equal(wrong_bins(model), 0, 'every particle is in the bin of its nearest node')
      call test%check_equal(wrong_lists(model, .false.), 0, &
                            'every particle is in the list of its cell once: what came is linked in')
      call test%check_equal(joined_otherwise(), 0, &
                            'with what has arrived, lists are as if all had been there at once')
      call test%check_equal(wrong_values(model), 0, 'every particle keeps what it carries')
      call test%check_equal(outside_block(), 0, 'every block holds what its rank owns')
      if (mod(step, 5) /= 0) cycle
      ids = all_ids(model)
      call test%check(size(ids) == size(at_start), 'as many particles as at the start')
      if (size(ids) == size(at_start)) &
         call test%check(all(ids == at_start), 'the same particles as at the start')
      call test%check(same_order(), 'in every block the order in memory that one rank has')
      call test%check(same_places(), 'places to the bit those of one rank')
   end do
   moved = comm%sum_count(model%migration(1)%moved)
   sent = comm%sum_count(model%migration(1)%sent)
   if (comm%is_root()) print '(5(a,i0))', '   particles ', size(at_start), ', steps ', steps, &
      ', blocks ', blocks
   blocks = count(model%levels(1)%owner >= 0) - blocks
   if (comm%is_root()) print '(3(a,i0))', '   new blocks ', blocks, ', changes of block ', moved, &
      ', of rank ', sent
   call test%check(blocks > 10, 'blocks were created')
   call test%check(came > 100, 'particles arrived in many')
   call test%check(moved > 10000, 'many particles changed block')
   if (comm%ranks > 1) call test%check(sent > 1000, 'many particles changed rank')
   call single%release()
   call model%release()
   call test%finish()

contains

   integer function outside_block() result(wrong)
      integer :: b
      wrong = 0
      do b = 1, size(model%levels(1)%blocks)
         associate (block => model%levels(1)%blocks(b))
            if (model%levels(1)%owner_at(block%place, 1) /= comm%rank) wrong = wrong + 1
            if (model%levels(1)%grid%block_index(block%place, 1) /= block%index) wrong = wrong + 1
            if (model%levels(1)%slot(block%index) /= b) wrong = wrong + 1
         end associate
      end do
      if (size(model%levels(1)%blocks) /= count(model%levels(1)%owner == comm%rank)) wrong = wrong + 1
   end function outside_block

   !> Blocks of this rank of which something else is known than their bins tell, counted in another way.
   integer function joined_otherwise() result(wrong)
      integer :: b, bin
      wrong = 0
      do b = 1, size(model%levels(1)%blocks)
         associate (cells => model%levels(1)%blocks(b)%cells, n => model%levels(1)%blocks(b)%particles%count)
            if (n == 0) cycle
            associate (x => mod(cells%bin(:n) - 1, 8), y => mod((cells%bin(:n) - 1)/8, 8), &
                       z => (cells%bin(:n) - 1)/64, here => cells%bin(:n - 1), next => cells%bin(2:n))
               if (any(cells%low /= [minval(x), minval(y), minval(z)]) .or. &
                   any(cells%high /= [maxval(x), maxval(y), maxval(z)]) &
                   .or. (cells%counted == n .and. cells%occupied /= &
                         count([(any(cells%bin(:n) == bin), bin=1, bins)])) .or. (cells%counted == n .and. &
                         cells%run_breaks /= 1 + count(next /= here) - cells%occupied &
                         + 2*count(next < here))) wrong = wrong + 1
            end associate
         end associate
      end do
   end function joined_otherwise

   logical function same_order()
      integer(i8), allocatable :: here(:, :), there(:, :)
      here = ordered_ids(model)
      there = ordered_ids(single)
      same_order = size(here) == size(there)
      if (same_order) same_order = all(here == there)
   end function same_order

   !> This rank's blocks against the same blocks of the model of one rank.
   logical function same_places()
      integer :: b, s, x
      x = model%levels(1)%layout%position
      same_places = .true.
      do b = 1, size(model%levels(1)%blocks)
         associate (block => model%levels(1)%blocks(b))
            s = single%levels(1)%slot(block%index)
            if (s == 0) then
               same_places = .false.
            else
               associate (n => block%particles%count, other => single%levels(1)%blocks(s)%particles)
                  same_places = same_places .and. n == other%count
                  if (same_places) &
                     same_places = all(abs(block%particles%column(:n, x:x + 2) &
                                           - other%column(:n, x:x + 2)) <= 0.0_wp)
               end associate
            end if
         end associate
      end do
   end function same_places

end program lists
