!> Weights and slopes against their definition; what follows from it; the stencil made of them.
program weights
   use m_kinds, only: wp, i4
   use m_communicator, only: communicator_t
   use m_gimp_weight, only: gimp_weights
   use m_stencil, only: stencil_t, frame_t, set_stencil, batch
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
   call test%check_close(off_linear, 0.0_wp, 1.0e-15_wp, 'the weighted mean of the nodes is the particle''s place')
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
         call test%check_close(left(2:3), right(1:2), 1.0e-15_wp, 'the same weights from either of two nearest nodes')
         call test%check_close(slope_left(2:3), slope_right(1:2), 1.0e-14_wp, 'the same slopes from either of two nearest nodes')
         call test%check_close([left(1), right(3), slope_left(1), slope_right(3)], [0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp], 1.0e-15_wp, &
                               'no weight beyond')
      end do
   end subroutine continuity

   !> set_stencil in metres, for blocks far from the origin.
   subroutine stencils()
      type(stencil_t) :: stencil
      type(frame_t) :: frame
      real(wp) :: position(20, 3), half(20), node, off(3)
      integer :: bin(3), round, p, m, axis, a
      integer(i4) :: members(batch)
      off = 0.0_wp
      do round = 1, 500
         frame%cell = 10.0_wp**chance%between(-8.0_wp, 2.0_wp)
         frame%per_cell = 1.0_wp/frame%cell
         frame%origin = chance%several(3, -50.0_wp, 50.0_wp)*frame%cell
         bin = int(chance%several(3, 0.0_wp, 8.0_wp))
         do p = 1, 20
            position(p, :) = frame%origin + (bin + chance%several(3, -0.5_wp, 0.5_wp))*frame%cell
            half(p) = sizes(1 + mod(p, 3))*frame%cell
         end do
         members = int(chance%several(batch, 1.0_wp, 21.0_wp), i4)
         call set_stencil(stencil, members(:1 + mod(round, batch)), position, half, frame, bin)
         do m = 1, 1 + mod(round, batch)
            p = members(m)
            do axis = 1, 3
               node = frame%origin(axis) + bin(axis)*frame%cell
               call keep_worst(off(3), (stencil%offset(m, axis) - (position(p, axis) - node))*frame%per_cell)
               do a = -1, 1
                  call keep_worst(off(1), stencil%weight(m, a, axis) &
                                  - plain_weight((position(p, axis) - node)*frame%per_cell - a, half(p)*frame%per_cell))
                  call keep_worst(off(2), stencil%slope(m, a, axis)*frame%cell &
                                  - aimag(plain_weight(cmplx((position(p, axis) - node)*frame%per_cell - a, 1.0e-30_wp, wp), &
                                                       half(p)*frame%per_cell))/1.0e-30_wp)
               end do
            end do
         end do
      end do
      call test%check_close(off(1), 0.0_wp, 1.0e-13_wp, 'weights of a stencil')
      call test%check_close(off(2), 0.0_wp, 2.0e-13_wp, 'slopes of a stencil')
      call test%check_close(off(3), 0.0_wp, 1.0e-13_wp, 'offsets of a stencil')
   end subroutine stencils

end program weights
