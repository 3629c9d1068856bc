!test: ranks 1 2 4
!> Sums over blocks and ranks: the same bits as on one rank, the same bits in all tiles that hold a node, the
!> same where tiles are summed only as far as particles reach and inner blocks go on before messages are sent,
!> and what a plain sum over all particles gives; and what a slow rank takes from one that has gone on.
program exchange
   use mpi_f08
   use m_kinds, only: wp, i8
   use m_constants, only: block_size, short_of
   use m_errors, only: error_t
   use m_node_values, only: node_values, tile_last
   use m_communicator, only: communicator_t
   use m_model, only: model_t
   use m_node_exchange, only: sum_tiles
   use m_p2g_boxes, only: clear, p2g_boxes
   use m_migration, only: frame_of
   use m_assertions, only: assertions_t
   use m_chance, only: keep_worst, say
   use m_plain_weight, only: plain_weights
   use m_wandering, only: build_wandering, wander, alone
   implicit none
   type(communicator_t) :: comm
   type(assertions_t) :: test
   type(model_t), allocatable :: model, single, reached
   type(error_t) :: error
   integer :: messages, step
   integer :: inner_seen = 0 !< inner blocks of ranks that have others too, over the steps
   real(wp) :: smallest_part = 1.0_wp
   call comm%start()
   call test%start(comm, 'exchange')
   call try()
   call test%finish()

contains

   !> Twelve steps of a wandering block.
   subroutine try()
      allocate (model, single, reached)
      call build_wandering(model, comm, error)
      call build_wandering(single, alone(), error)
      call build_wandering(reached, comm, error)
      messages = 0
      do step = 1, 12
         call wander(model, step)
         call wander(single, step)
         call wander(reached, step)
         call sums(model)
         call sums(single)
         call reached_sums()
         messages = messages + size(model%exchange(1)%ranks)
         call test%check_equal(different_bits(), 0, 'the bits of one rank')
         call test%check_equal(disagreements(), 0, 'tiles that hold a node agree to the bit')
         call test%check_equal(different_in_reach(), 0, 'the same bits where particles reach')
         call test%check_equal(beyond_reach(), 0, 'nothing stands where none reach')
      end do
      call test%check(model%exchange(1)%messages == messages, 'one message a neighbour rank and sum')
      if (comm%ranks > 1) call test%check(model%exchange(1)%bytes_each > &
                                          0 .eqv. size(model%exchange(1)%ranks) > 0, 'bytes are counted')
      call test%check_equal(wrong_when_late(), 0, 'slow ranks take what was given then')
      call against_plain_sum()
      call test%check(-comm%maximum(-smallest_part) < 0.5_wp, 'some tiles are reached in part')
      if (comm%ranks > 1) call test%check(comm%sum_count(int(inner_seen, i8)) > 0, 'there are inner blocks')
      call single%release()
      call reached%release()
      call model%release()
      deallocate (model, single, reached)
   end subroutine try

   !> Exchanges in a row, before which ranks fill their tiles with one number; before they take, every other
   !> rank sleeps, in turn.
   integer function wrong_when_late() result(wrong)
      real(wp), parameter :: nothing = -1.0_wp, pause = 0.02_wp !< s
      real(wp), allocatable :: before(:, :, :, :, :)
      real(wp) :: begun
      integer :: m, place(3), turn
      wrong = 0
      associate (level => model%levels(1), own => size(model%levels(1)%blocks))
         before = level%nodes
         do turn = 1, 5
            level%nodes(:, :, :, :, :own) = 100*turn + comm%rank
            level%nodes(:, :, :, :, own + 1:) = nothing
            call model%exchange(1)%start(level%nodes)
            begun = real(MPI_Wtime(), wp)
            do while (MPI_Wtime() < begun + merge(pause, 0.0_wp, modulo(comm%rank + turn, 2) == 0))
            end do
            call model%exchange(1)%wait(level%nodes)
            do m = 1, size(level%ghost_index)
               place = level%grid%block_place(level%ghost_index(m))
               associate (taken => level%nodes(:, :, :, :, own + m))
                  wrong = wrong + count(abs(taken - nothing) > 0.0_wp &
                                        .and. abs(taken - 100*turn - level%owner_at(place, 1)) > 0.0_wp)
                  if (all(taken < 0.0_wp)) wrong = wrong + 1
               end associate
            end do
         end do
         level%nodes = before
      end associate
   end function wrong_when_late

   !> Every tile filled with what its block's particles give, then summed.
   subroutine sums(model)
      type(model_t), intent(inout) :: model
      integer :: b
      associate (level => model%levels(1))
         level%nodes = -1.0e30_wp ! mirrors and tiles must be written anew
         do b = 1, size(level%blocks)
            level%nodes(:, :, :, :, b) = 0.0_wp
            call p2g_boxes(level%blocks(b)%cells, level%blocks(b)%particles%column, level%layout, &
                              frame_of(level, level%blocks(b)), level%nodes(:, :, :, :, b))
         end do
         call model%exchange(1)%start(level%nodes)
         call model%exchange(1)%wait(level%nodes)
         call sum_tiles(level%blocks, level%interior_first, level%nodes)
      end associate
   end subroutine sums

   !> The same, each tile only as far as its particles reach, and in two parts, as a step does it. Sums of the
   !> first part change nothing that is sent, and those of the second ask for no tile of the first, nor for
   !> how far it reaches: both are other by then.
   subroutine reached_sums()
      real(wp), allocatable :: inner(:, :, :, :, :)
      integer, allocatable :: reach(:, :, :)
      integer :: b
      associate (level => reached%levels(1), &
                 first => reached%levels(1)%interior_first(:reached%levels(1)%part_end(1)), &
                 second => reached%levels(1)%interior_first(reached%levels(1)%part_end(1) + 1:))
         do b = 1, size(level%blocks)
            call level%update_extents(b, whole=.false.)
            call clear(level%nodes(:, :, :, :, b), level%extent(:, :, b))
            call p2g_boxes(level%blocks(b)%cells, level%blocks(b)%particles%column, level%layout, &
                              frame_of(level, level%blocks(b)), level%nodes(:, :, :, :, b))
         end do
         call sum_tiles(level%blocks, first, level%nodes, level%extent)
         inner = level%nodes(:, :, :, :, first)
         reach = level%extent(:, :, first)
         level%nodes(:, :, :, :, first) = -1.0e30_wp
         level%extent(1, :, first) = 0
         level%extent(2, :, first) = merge(-1, tile_last, modulo(step, 2) == 0)
         call reached%exchange(1)%start(level%nodes)
         call reached%exchange(1)%wait(level%nodes)
         call sum_tiles(level%blocks, second, level%nodes, level%extent)
         level%nodes(:, :, :, :, first) = inner
         level%extent(:, :, first) = reach
         inner_seen = inner_seen + merge(size(first), 0, size(second) > 0)
      end associate
   end subroutine reached_sums

   integer function different_in_reach() result(wrong)
      integer :: b
      wrong = 0
      do b = 1, size(reached%levels(1)%blocks)
         associate (low => reached%levels(1)%extent(1, :, b), high => reached%levels(1)%extent(2, :, b), &
                    part => reached%levels(1)%nodes(:, :, :, :, b), &
                    all => model%levels(1)%nodes(:, :, :, :, b))
            wrong = wrong + count(abs(part(:, low(1) + 1:high(1) + 1, low(2) + 1:high(2) + 1, low(3) &
                                           + 1:high(3) + 1) &
                                      - all(:, low(1) + 1:high(1) + 1, low(2) + 1:high(2) + 1, low(3) &
                                            + 1:high(3) + 1)) > 0.0_wp)
            if (high(1) >= low(1)) &
               smallest_part = min(smallest_part, product(high - low + 1)/real((tile_last + 1)**3, wp))
         end associate
      end do
   end function different_in_reach

   !> Values other than 0 in the pool, outside of what own tiles reach.
   integer function beyond_reach() result(wrong)
      integer :: b, i, j, k
      wrong = 0
      associate (level => reached%levels(1))
         do b = 1, size(level%blocks)
            do k = 0, tile_last
               do j = 0, tile_last
                  do i = 0, tile_last
                     if (all([i, j, k] >= level%extent(1, :, b)) .and. &
                         all([i, j, k] <= level%extent(2, :, b))) cycle
                     wrong = wrong + count(abs(level%nodes(:, i, j, k, b)) > 0.0_wp)
                  end do
               end do
            end do
         end do
      end associate
   end function beyond_reach

   integer function different_bits() result(wrong)
      integer :: b, s
      wrong = 0
      do b = 1, size(model%levels(1)%blocks)
         associate (place => model%levels(1)%blocks(b)%place)
            s = single%levels(1)%slot_at(place, 1)
            wrong = wrong + count(abs(model%levels(1)%nodes(:, :, :, :, b) &
                                      - single%levels(1)%nodes(:, :, :, :, s)) > 0.0_wp)
         end associate
      end do
   end function different_bits

   !> Among the tiles of the model of one rank, which has them all.
   integer function disagreements() result(wrong)
      real(wp), allocatable :: nodes(:, :, :, :)
      logical, allocatable :: held(:, :, :)
      integer :: b, i, j, k, at(3)
      associate (n => block_size*single%levels(1)%grid%blocks)
         allocate (nodes(node_values, -1:n(1), -1:n(2), -1:n(3)))
         allocate (held(-1:n(1), -1:n(2), -1:n(3)), source=.false.)
      end associate
      wrong = 0
      do b = 1, size(single%levels(1)%blocks)
         do k = 0, tile_last
            do j = 0, tile_last
               do i = 0, tile_last
                  at = block_size*single%levels(1)%blocks(b)%place + [i, j, k] - 1
                  associate (value => single%levels(1)%nodes(:, i, j, k, b), &
                             node => nodes(:, at(1), at(2), at(3)))
                     if (.not. held(at(1), at(2), at(3))) node = value
                     if (any(abs(node - value) > 0.0_wp)) wrong = wrong + 1
                  end associate
                  held(at(1), at(2), at(3)) = .true.
               end do
            end do
         end do
      end do
   end function disagreements

   !> Mass, momentum and force at every node of this rank's blocks from all particles, one after the other.
   subroutine against_plain_sum()
      real(wp), allocatable :: plain(:, :, :, :)
      real(wp) :: off(3), scale(3), weight, slope(3), s(6), x(3), v(3), node(3)
      integer :: b, i, j, k, p, at(3), near(3)
      associate (level => single%levels(1), grid => single%levels(1)%grid, of => single%levels(1)%layout)
         associate (n => block_size*grid%blocks)
            allocate (plain(7, -1:n(1), -1:n(2), -1:n(3)), source=0.0_wp)
         end associate
         do b = 1, size(level%blocks)
            do p = 1, level%blocks(b)%particles%count
               associate (c => level%blocks(b)%particles%column(p, :))
                  x = c(of%position:of%position + 2)
                  s = c(of%stress:of%stress + 5)
                  near = nint((x - grid%lower)/grid%cell)
                  do k = -2, 2
                     do j = -2, 2
                        do i = -2, 2
                           at = near + [i, j, k]
                           if (any(at < -1) .or. any(at > block_size*grid%blocks)) cycle
                           node = grid%lower + grid%cell*at
                           call plain_weights(x, node, short_of*c(of%half_size), grid%cell, weight, slope)
                           v = c(of%velocity:of%velocity + 2) &
                               + matmul(reshape(c(of%gradient:of%gradient + 8), [3, 3]), node - x)
                           associate (to => plain(:, at(1), at(2), at(3)))
                              to(1) = to(1) + c(of%mass)*weight
                              to(2:4) = to(2:4) + c(of%mass)*weight*v
                              to(5:7) = to(5:7) - c(of%volume)*[s(1)*slope(1) + s(6)*slope(2) &
                                 + s(5)*slope(3), &
                                               s(6)*slope(1) + s(2)*slope(2) + s(4)*slope(3), s(5)*slope(1) &
                                               + s(4)*slope(2) + s(3)*slope(3)]
                           end associate
                        end do
                     end do
                  end do
               end associate
            end do
         end do
      end associate
      scale = [maxval(plain(1, :, :, :)), maxval(abs(plain(2:4, :, :, :))), maxval(abs(plain(5:7, :, :, :)))]
      off = 0.0_wp
      do b = 1, size(model%levels(1)%blocks)
         do k = 0, tile_last
            do j = 0, tile_last
               do i = 0, tile_last
                  at = block_size*model%levels(1)%blocks(b)%place + [i, j, k] - 1
                  associate (value => model%levels(1)%nodes(:, i, j, k, b), &
                             to => plain(:, at(1), at(2), at(3)))
                     call keep_worst(off(1), (value(1) - to(1))/scale(1))
                     call keep_worst(off(2), maxval(abs(value(2:4) - to(2:4)))/scale(2))
                     call keep_worst(off(3), maxval(abs(value(5:7) - to(5:7)))/scale(3))
                  end associate
               end do
            end do
         end do
      end do
      off = [comm%maximum(off(1)), comm%maximum(off(2)), comm%maximum(off(3))]
      if (comm%is_root()) then
         call say('node mass against the plain sum, relative', off(1))
         call say('node momentum, relative', off(2))
         call say('node force, relative', off(3))
      end if
      call test%check_close(off, [0.0_wp, 0.0_wp, 0.0_wp], 1.0e-13_wp, 'as the plain sum over all particles')
   end subroutine against_plain_sum

end program exchange
