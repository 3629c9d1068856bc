!test: ranks 1 2 4
!> The field table, and what a particle carries through sorting, removal, a change of owners and rebalancing:
!> every bit of every column, of a field that only this test knows too.
program fields
   use m_kinds, only: wp, i4, i8
   use m_constants, only: block_size
   use m_errors, only: error_t
   use m_communicator, only: communicator_t
   use m_model, only: model_t
   use m_field_table, only: field_table_t, layout_t
   use m_particle_store, only: particle_store_t
   use m_cell_list, only: cell_list_t, bins_at, bins
   use m_stencil, only: bin_place
   use m_assertions, only: assertions_t
   use m_chance, only: chance_t, say
   use m_wandering, only: build_wandering, wander, wrong_values, wrong_bins, all_ids, ordered_ids
   implicit none
   type(communicator_t) :: comm
   type(assertions_t) :: test
   type(chance_t) :: chance
   call comm%start()
   call test%start(comm, 'fields')
   call table()
   call store()
   call runs_of_bodies()
   call part_of_lists()
   call into_order()
   call change_of_owners()
   call test%finish()

contains

   subroutine table()
      type(field_table_t) :: fields
      type(layout_t) :: layout
      call test%check_equal(fields%column('mass'), 0, 'an empty table has no column')
      call fields%declare('mass', 1, 'kg', .true.)
      call fields%declare('stress', 6, 'Pa', .true.)
      call fields%declare('mass', 1, 'kg', .true.)
      call fields%declare('position', 3, 'm', .true.)
      call test%check_equal(fields%columns, 10, 'columns of a table')
      call test%check_equal(size(fields%fields), 3, 'a field declared twice is there once')
      call test%check_equal(fields%column('mass'), 1, 'first column of the first field')
      call test%check_equal(fields%column('stress'), 2, 'first column of the second field')
      call test%check_equal(fields%column('position'), 8, 'first column of the third field')
      call test%check_equal(fields%column('pos'), 0, 'a part of a name is not a name')
      layout = fields%layout()
      call test%check(layout%mass == 1 .and. layout%stress == 2 .and. layout%position == 8 .and. &
                      layout%gradient == 0, 'layout')
   end subroutine table

   !> Append, permute, remove against the same done to plain arrays.
   subroutine store()
      type(particle_store_t) :: particles
      real(wp) :: rows(7, 300), work(300, 4)
      integer(i8) :: ids(300)
      integer(i4) :: order(300), gone(40), swap
      integer :: p, q, n, left
      logical :: good
      n = 300
      do p = 1, n
         rows(:, p) = chance%several(7, -1.0_wp, 1.0_wp)
         ids(p) = int(p, i8)*1000000000000_i8 + 7_i8
         order(p) = p
         call particles%append(rows(:, p), ids(p), int(mod(p, 3), i4))
      end do
      call test%check_equal(particles%count, n, 'appended particles')
      do p = n, 2, -1
         q = 1 + int(chance%between(0.0_wp, real(p, wp)))
         swap = order(p); order(p) = order(q); order(q) = swap
      end do
      call particles%permute(order, work)
      good = .true.
      do p = 1, n
         good = good .and. all(abs(particles%column(p, :) - rows(:, order(p))) <= 0.0_wp) .and. &
                particles%id(p) == ids(order(p)) .and. particles%body(p) == mod(order(p), 3)
      end do
      call test%check(good, 'another order takes all columns, ids and bodies along')
      do p = 1, 40
         gone(p) = int(7*p + merge(20, 0, p == 40), i4) ! among them the last one
      end do
      call particles%remove(gone)
      left = n - size(gone)
      call test%check_equal(particles%count, left, 'removed particles')
      good = .true.
      do p = 1, left
         q = int(particles%id(p)/1000000000000_i8)
         good = good .and. all(abs(particles%column(p, :) - rows(:, q)) <= 0.0_wp) .and. &
                particles%body(p) == mod(q, 3)
         good = good .and. all(order(gone) /= q) .and. count(particles%id(:left) == particles%id(p)) == 1
      end do
      call test%check(good, 'removal takes the right ones and leaves the others whole')
   end subroutine store

   !> Runs of particles of one body, beside looking at every particle, in stores that get, lose and sort
   !> particles of one body and of several.
   subroutine runs_of_bodies()
      type(particle_store_t) :: particles
      real(wp) :: work(400, 4)
      integer(i4) :: order(400)
      integer :: first, last, p, round, wrong
      logical :: known, mixed
      wrong = 0
      known = .false.
      mixed = .false.
      do round = 1, 200
         if (mod(round, 5) == 0) call particles%remove([(int(p, i4), p=1, particles%count)])
         do p = 1, mod(37*round, 90)
            call particles%append([real(wp) :: p, 1, 2, 3, 4], int(p, i8), &
                                  int(merge(2, 1 + mod(round, 4), mod(round, 3) > 0 .or. p < 40), i4))
         end do
         if (mod(round, 7) == 0 .and. particles%count > 3) &
            call particles%remove([2_i4, int(particles%count, i4)])
         if (mod(round, 11) == 0) &
            particles%body(:particles%count) = [(int(1 + p/50, i4), p=1, particles%count)]
         if (mod(round, 13) == 0) particles%body(:particles%count) = 3
         order(:particles%count) = [(int(particles%count + 1 - p, i4), p=1, particles%count)]
         call particles%permute(order(:particles%count), work)
         first = 1
         do while (first <= particles%count)
            do last = first, particles%count - 1
               if (particles%body(last + 1) /= particles%body(first)) exit
            end do
            if (particles%run_end(first) /= last) wrong = wrong + 1
            mixed = mixed .or. last < particles%count
            first = last + 1
         end do
         known = known .or. (particles%count > 0 .and. particles%run_end(1) == particles%count)
      end do
      call test%check_equal(wrong, 0, 'runs of bodies that end elsewhere')
      call test%check(known .and. mixed, 'stores of one body and of several were among them')
   end subroutine runs_of_bodies

   !> The bins whose 27 nodes hold one of some nodes, and the particles of these bins alone, against the same
   !> by looking at every particle.
   subroutine part_of_lists()
      integer, parameter :: n = 700, rounds = 20
      type(cell_list_t) :: whole, part
      logical :: nodes(0:9, 0:9, 0:9), wanted(bins), right
      integer :: b, c, p, place(3), round
      call whole%reserve(n)
      call part%reserve(n, choosing=.true.)
      do round = 1, rounds
         do p = 1, n
            whole%bin(p) = 1 + int(chance%between(0.0_wp, real(bins, wp)))
         end do
         call whole%go_through(1, n)
         nodes = .false.
         do c = 1, round - 1 ! none at first
            place = int(chance%several(3, 0.0_wp, 10.0_wp))
            nodes(place(1), place(2), place(3)) = .true.
         end do
         do b = 1, bins
            place = bin_place(b)
            wanted(b) = any(nodes(place(1):place(1) + 2, place(2):place(2) + 2, place(3):place(3) + 2))
         end do
         call test%check(all(bins_at(nodes, [0, block_size + 1]) .eqv. wanted), 'bins at nodes')
         call part%take_bins(whole, wanted)
         c = part%count
         right = c == count(wanted(whole%bin(:n)))
         if (right) right = all(part%order(:c) == pack([(p, p=1, n)], wanted(whole%bin(:n))))
         if (right) right = all(part%bin(part%order(:c)) == whole%bin(part%order(:c)))
         call test%check(right, 'particles of some bins')
      end do
   end subroutine part_of_lists

   !> Particles into the order of their bins: all of them, those of one bin as they were stored, and nothing
   !> is out of order then.
   subroutine into_order()
      integer, parameter :: most = 701
      type(cell_list_t) :: cells
      integer(i4) :: order(most), before(most)
      logical :: disordered, once(most), right
      integer :: b, n, p, round
      call cells%reserve(most)
      disordered = .true.
      right = .true.
      do round = 1, 60
         n = merge(mod(round, 3), most - mod(round, 2), round < 4) ! 1, 2, none; then odd and even numbers
         do p = 1, n
            cells%bin(p) = 1 + int(chance%between(0.0_wp, merge(2.0_wp, real(bins, wp), mod(round, 4) == 0)))
         end do
         before = cells%bin
         call cells%update_statistics(n)
         if (n > 2) disordered = disordered .and. cells%run_breaks > n/8
         associate (here => cells%bin(:n - 1), next => cells%bin(2:n))
            right = right .and. cells%occupied == count([(any(cells%bin(:n) == b), b=1, bins)])
            right = right .and. cells%run_breaks == min(n, 1) + count(next /= here) - cells%occupied &
                    + 2*count(next < here)
         end associate
         call cells%sort(order(:n))
         once = .false.
         once(order(:n)) = .true.
         right = right .and. count(once) == n .and. cells%run_breaks == 0 .and. &
                 all(cells%bin(:n) == before(order(:n)))
         do p = 2, n
            right = right .and. cells%bin(p) >= cells%bin(p - 1)
            if (cells%bin(p) == cells%bin(p - 1)) right = right .and. order(p) > order(p - 1)
         end do
         call cells%update_statistics(n)
         right = right .and. cells%run_breaks == 0
      end do
      call test%check(right, 'sorted by bins, nothing is out of order')
      call test%check(disordered, 'before it was')
   end subroutine into_order

   !> Blocks change rank: all to the next rank, all to rank 0, then balanced again.
   subroutine change_of_owners()
      type(model_t) :: model
      type(error_t) :: error
      integer(i8), allocatable :: ids(:), before(:, :), after(:, :)
      integer, allocatable :: owner(:)
      real(wp), allocatable :: weighed(:)
      real(wp) :: share, largest
      integer :: b, round
      call build_wandering(model, comm, error)
      call test%check(model%levels(1)%table%column('mark_of_the_tests') > 0, &
                      'an effect''s field is in the table')
      ids = all_ids(model)
      do round = 1, 10
         call wander(model, round)
      end do
      do b = 1, size(model%levels(1)%blocks)
         model%levels(1)%blocks(b)%mean_breaks = b + 0.5_wp ! those that have just been sorted have none
      end do
      weighed = what_placement_weighs(model)
      call test%check(comm%maximum(maxval([0, (model%levels(1)%blocks(b)%cells%occupied, b=1, &
                                               size(model%levels(1)%blocks))])*1.0_wp) > 0.0_wp, &
                                               'some bins are occupied')
      call model%connect() ! all blocks are made anew, and stay here
      call test%check(all(abs(what_placement_weighs(model) - weighed) <= 0.0_wp), &
                      'blocks that stay keep what placement weighs')
      do round = 1, 3
         before = ordered_ids(model)
         owner = model%levels(1)%owner
         where (owner >= 0) owner = mod(owner + 1, comm%ranks)
         if (round == 2) where (owner >= 0) owner = 0
         if (round < 3) then
            call model%migration(1)%move_blocks(comm, model%levels(1), owner)
            model%levels(1)%owner = owner
            call model%connect()
            call model%migration(1)%unpack_blocks(model%levels(1))
         else
            call model%rebalance(error, 500)
            call test%check(.not. error%happened(), 'rebalancing goes well')
            share = comm%maximum(real(model%levels(1)%particle_count(), wp))*comm%ranks/size(ids)
            largest = comm%maximum(real(maxval([0, (model%levels(1)%blocks(b)%particles%count, b=1, &
                                                    size(model%levels(1)%blocks))]), wp))*comm%ranks/size(ids)
            if (comm%is_root()) call say('most loaded rank over the mean, rebalanced', share)
            if (comm%is_root()) call say('the largest block in the same measure', largest)
            call test%check(share < 1.15_wp + largest, &
                            'rebalancing evens the particles out as well as whole blocks can')
         end if
         after = ordered_ids(model)
         call test%check(size(after) == size(before), 'as many particles after a change of owners')
         if (size(after) == size(before)) &
            call test%check(all(after == before), 'blocks keep the order of their particles')
         call test%check_equal(wrong_values(model), 0, 'every particle keeps what it carries')
         call wander(model, 100 + round)
         call test%check_equal(wrong_bins(model), 0, 'bins after a change of owners')
         call test%check_equal(wrong_values(model), 0, &
                               'every particle keeps what it carries when it moves on')
      end do
      after = ordered_ids(model)
      call test%check(all(all_ids(model) == ids), 'the same particles as at the start')
      call model%release()
   end subroutine change_of_owners

   !> Of this rank's blocks: occupied bins, run_breaks on average.
   function what_placement_weighs(model) result(values)
      type(model_t), intent(in) :: model
      real(wp), allocatable :: values(:)
      integer :: b
      associate (blocks => model%levels(1)%blocks)
         values = [(real(blocks(b)%cells%occupied, wp), b=1, size(blocks)), &
                   (blocks(b)%mean_breaks, b=1, size(blocks))]
      end associate
   end function what_placement_weighs

end program fields
