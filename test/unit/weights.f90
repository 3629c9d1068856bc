!> Weights and slopes against their definition; what follows from it; the stencil made of them.
program weights
   use m_kinds, only: wp, i4
   use m_communicator, only: communicator_t
   use m_field_table, only: layout_t
   use m_cell_list, only: cell_list_t
   use m_stencil, only: stencil_t, frame_t, set_stencil, gimp_weights, chunk
   use m_assertions, only: assertions_t
   use m_chance, only: chance_t, keep_worst, say
   use m_plain_weight, only: plain_weight
   implicit none
   type(communicator_t) :: comm
   type(assertions_t) :: test
   type(chance_t) :: chance
   real(wp), parameter :: sizes(3) = [1.0_wp/6.0_wp, 0.25_wp, 0.5_wp]
   integer, parameter :: tries = 20000
   real(wp) :: off_weight, off_slope, off_unity, off_slopes, off_linear, least, offset, half
   integer :: n, k
   call comm%start()
   call test%start(comm, 'weights')
   off_weight = 0.0_wp; off_slope = 0.0_wp; off_unity = 0.0_wp; off_slopes = 0.0_wp; off_linear = 0.0_wp
   least = 1.0_wp
   do n = 1, 4
      do k = 1, tries
         half = chance%between(0.005_wp, 0.5_wp)
         if (n <= 3) half = sizes(min(n, 3))
         offset = chance%between(-0.5_wp, 0.5_wp)
         if (k == 1) offset = 0.0_wp
         if (k == 2) offset = 0.5_wp
         if (k == 3) offset = -0.5_wp
         call one(offset, half)
      end do
   end do
   call say('weight off its definition', off_weight)
   call say('slope off its definition (1/cell)', off_slope)
   call say('partition of unity', off_unity)
   call say('sum of slopes (1/cell)', off_slopes)
   call say('linear completeness (cells)', off_linear)
   call test%check_close(off_weight, 0.0_wp, 1.0e-13_wp, 'weights are the mean of the hat function')
   call test%check_close(off_slope, 0.0_wp, 1.0e-13_wp, 'slopes are the derivative of the weights')
   call test%check_close(off_unity, 0.0_wp, 1.0e-15_wp, 'partition of unity')
   call test%check_close(off_slopes, 0.0_wp, 1.0e-13_wp, 'slopes sum to zero')
   call test%check_close(off_linear, 0.0_wp, 1.0e-15_wp, &
                         'the weighted mean of the nodes is the particle''s place')
   call test%check(least >= 0.0_wp, 'no weight below zero')
   call continuity()
   call stencils()
   call test%finish()

contains

   subroutine one(offset, half)
      real(wp), intent(in) :: offset, half
      real(wp) :: weight(-1:1), slope(-1:1)
      complex(wp) :: along
      real(wp), parameter :: tiny_step = 1.0e-30_wp
      integer :: a
      call gimp_weights(offset, half, weight(-1), weight(0), weight(1), slope(-1), slope(1))
      slope(0) = -(slope(-1) + slope(1))
      do a = -1, 1
         call keep_worst(off_weight, weight(a) - plain_weight(offset - a, half))
         along = plain_weight(cmplx(offset - a, tiny_step, wp), half)
         call keep_worst(off_slope, slope(a) - aimag(along)/tiny_step)
      end do
      call keep_worst(off_unity, sum(weight) - 1.0_wp)
      call keep_worst(off_slopes, slope(-1) + slope(0) + slope(1))
      call keep_worst(off_linear, weight(1) - weight(-1) - offset)
      least = min(least, minval(weight))
   end subroutine one

   !> Half-way between two nodes either may be the nearest: both views give the same weights and slopes.
   subroutine continuity()
      real(wp) :: left(3), right(3), slope_left(3), slope_right(3)
      integer :: n
      do n = 1, 3
         call gimp_weights(0.5_wp, sizes(n), left(1), left(2), left(3), slope_left(1), slope_left(3))
         call gimp_weights(-0.5_wp, sizes(n), right(1), right(2), right(3), slope_right(1), slope_right(3))
         slope_left(2) = -(slope_left(1) + slope_left(3))
         slope_right(2) = -(slope_right(1) + slope_right(3))
         call test%check_close(left(2:3), right(1:2), 1.0e-15_wp, &
                               'the same weights from either of two nearest nodes')
         call test%check_close(slope_left(2:3), slope_right(1:2), 1.0e-14_wp, &
                               'the same slopes from either of two nearest nodes')
         call test%check_close([left(1), right(3), slope_left(1), slope_right(3)], &
                               [0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp], 1.0e-15_wp, 'no weight beyond')
      end do
   end subroutine continuity

   !> set_stencil in metres, for blocks far from the origin: chunks of lists whose bins hold none, one or many
   !> particles, in the order of memory or not.
   subroutine stencils()
      integer, parameter :: most = 3*chunk
      type(stencil_t) :: stencil
      type(frame_t) :: frame
      type(cell_list_t) :: cells
      type(layout_t) :: layout
      real(wp) :: column(most, 6), node, off(3), half
      integer(i4) :: order(most)
      integer :: place(3), round, p, m, axis, a, r, count, first, seen, misplaced, in_order, shuffled
      layout%position = 1
      layout%half_size = 4
      off = 0.0_wp
      misplaced = 0
      in_order = 0
      shuffled = 0
      call cells%reserve(most, choosing=.true.)
      do round = 1, 300
         layout%half_sizes = mod(round, 3) == 0 ! then one an axis; above half a cell they count as half a
                                                ! cell
         frame%cell = 10.0_wp**chance%between(-8.0_wp, 2.0_wp)
         frame%per_cell = 1.0_wp/frame%cell
         frame%origin = chance%several(3, -50.0_wp, 50.0_wp)*frame%cell
         count = int(chance%between(1.0_wp, real(most + 1, wp)))
         do p = 1, count
            place = int(chance%several(3, 0.0_wp, merge(8.0_wp, 2.0_wp, mod(round, 2) == 0)))
            cells%bin(p) = int(1 + place(1) + 8*(place(2) + 8*place(3)), i4)
            if (mod(round, 5) == 0) cells%bin(p) = 77_i4 ! one full bin
            place = bin_place(int(cells%bin(p)))
            column(p, 1:3) = frame%origin + (place + chance%several(3, -0.5_wp, 0.5_wp))*frame%cell
            column(p, 4) = sizes(1 + mod(p, 3))*frame%cell
            column(p, 5:6) = chance%several(2, 0.05_wp, 0.6_wp)*frame%cell
         end do
         call cells%update_statistics(count)
         order(:count) = [(p, p=1, count)]
         if (mod(round, 4) < 2) then ! as they are stored, or chosen and shuffled
            do p = count, 2, -1
               m = 1 + int(chance%between(0.0_wp, real(p, wp)))
               order([m, p]) = order([p, m])
            end do
            cells%chosen = .true.
            cells%order(:count) = order(:count)
         end if
         seen = 0
         do first = 1, count, chunk
            call set_stencil(stencil, cells, first, column, layout, frame)
            if (stencil%in_order) in_order = in_order + 1
            if (.not. stencil%in_order) shuffled = shuffled + 1
            if (stencil%in_order .and. &
                any(stencil%member(:stencil%count) /= [(stencil%member(1) + p, p=0, stencil%count - 1)])) &
               misplaced = misplaced + 1
            do r = 1, stencil%runs
               place = stencil%run_place(:, r)
               do m = stencil%run_first(r), stencil%run_first(r + 1) - 1
                  seen = seen + 1
                  p = stencil%member(m)
                  if (p /= order(seen) .or. any(place /= bin_place(int(cells%bin(p))))) &
                     misplaced = misplaced + 1
                  do axis = 1, 3
                     node = frame%origin(axis) + place(axis)*frame%cell
                     half = (1.0_wp - 1.0e-9_wp)*column(p, 4)*frame%per_cell
                     if (layout%half_sizes) &
                        half = min(0.5_wp, (1.0_wp - 1.0e-9_wp)*column(p, 3 + axis)*frame%per_cell)
                     call keep_worst(off(3), stencil%offset(m, axis) &
                                     - (column(p, axis) - node)*frame%per_cell)
                     do a = -1, 1
                        call keep_worst(off(1), stencil%weight(m, a, axis) &
                                        - plain_weight((column(p, axis) - node)*frame%per_cell - a, half))
                        call keep_worst(off(2), stencil%slope(m, a, axis)*frame%cell - &
                                        aimag(plain_weight(cmplx((column(p, axis) - node)*frame%per_cell &
                                        - a, 1.0e-30_wp, wp), half))/1.0e-30_wp)
                     end do
                  end do
               end do
            end do
         end do
         if (seen /= count) misplaced = misplaced + 1
      end do
      call test%check_equal(misplaced, 0, 'every particle once, in the order of the list, with its bin')
      call test%check(in_order > 10, 'some chunks were in the order of memory')
      call test%check(shuffled > 10, 'and some were not')
      call test%check_close(off(1), 0.0_wp, 1.0e-13_wp, 'weights of a stencil')
      call test%check_close(off(2), 0.0_wp, 2.0e-13_wp, 'slopes of a stencil')
      call test%check_close(off(3), 0.0_wp, 1.0e-13_wp, 'offsets of a stencil')
   end subroutine stencils

   !> Place of a bin in its block, from 0.
   pure function bin_place(bin) result(place)
      integer, intent(in) :: bin
      integer :: place(3)
      place = [mod(bin - 1, 8), mod((bin - 1)/8, 8), (bin - 1)/64]
   end function bin_place

end program weights
