!> What one core of this machine can do at this moment: fused multiply-adds a second and bytes a second.
!> Prints one line: GFLOP/s of the multiply-add probe, GB/s of the copy probe (bytes read and written), the
!> best of several tries each.
program probe
   use m_kinds, only: wp
   use m_timers, only: wall_time
   implicit none
   integer, parameter :: tries = 7
   real(wp) :: flops, bytes
   flops = multiply_adds()
   bytes = copies()
   print '(a,f9.3,a,f9.3)', 'gflops ', flops/1.0e9_wp, ' gbytes ', bytes/1.0e9_wp
contains

   !> Twelve independent chains of vectors, all in registers.
   real(wp) function multiply_adds() result(rate)
      integer, parameter :: lanes = 8, chains = 12, rounds = 4000000
      real(wp) :: a(lanes, chains), factor(lanes), shift(lanes), begun, took
      integer :: t
      rate = 0.0_wp
      factor = 0.999999_wp
      shift = 1.0e-6_wp
      do t = 1, tries
         a = 0.5_wp
         begun = wall_time()
         call run(a, factor, shift, rounds)
         took = wall_time() - begun
         if (any(a < 0.0_wp)) print *, 'never'
         rate = max(rate, 2.0_wp*lanes*chains*rounds/took)
      end do
   end function multiply_adds

   subroutine run(a, factor, shift, rounds)
      integer, parameter :: lanes = 8
      real(wp), intent(inout) :: a(lanes, 12)
      real(wp), intent(in) :: factor(lanes), shift(lanes)
      integer, intent(in) :: rounds
      real(wp), dimension(lanes) :: f, s
      real(wp) :: x1, x2, x3, x4, x5, x6, x7, x8, x9, x10, x11, x12
      integer :: l, r
      f = factor
      s = shift
      !$omp simd private(x1, x2, x3, x4, x5, x6, x7, x8, x9, x10, x11, x12)
      do l = 1, lanes
         x1 = a(l, 1); x2 = a(l, 2); x3 = a(l, 3); x4 = a(l, 4); x5 = a(l, 5); x6 = a(l, 6)
         x7 = a(l, 7); x8 = a(l, 8); x9 = a(l, 9); x10 = a(l, 10); x11 = a(l, 11); x12 = a(l, 12)
         do r = 1, rounds
            x1 = x1*f(l) + s(l); x2 = x2*f(l) + s(l); x3 = x3*f(l) + s(l); x4 = x4*f(l) + s(l)
            x5 = x5*f(l) + s(l); x6 = x6*f(l) + s(l); x7 = x7*f(l) + s(l); x8 = x8*f(l) + s(l)
            x9 = x9*f(l) + s(l); x10 = x10*f(l) + s(l); x11 = x11*f(l) + s(l); x12 = x12*f(l) + s(l)
         end do
         a(l, 1) = x1; a(l, 2) = x2; a(l, 3) = x3; a(l, 4) = x4; a(l, 5) = x5; a(l, 6) = x6
         a(l, 7) = x7; a(l, 8) = x8; a(l, 9) = x9; a(l, 10) = x10; a(l, 11) = x11; a(l, 12) = x12
      end do
   end subroutine run

   !> A copy far larger than the caches.
   real(wp) function copies() result(rate)
      integer, parameter :: n = 16000000
      real(wp), allocatable :: from(:), to(:)
      real(wp) :: begun, took
      integer :: t
      allocate (from(n), source=1.0_wp)
      allocate (to(n), source=0.0_wp)
      rate = 0.0_wp
      do t = 1, tries
         from(t) = real(t, wp)
         begun = wall_time()
         to = from
         took = wall_time() - begun
         if (to(t) < 0.0_wp) print *, 'never'
         rate = max(rate, 16.0_wp*n/took)
      end do
   end function copies

end program probe
