!test: ranks 1 2
!> Mixed iterates of a fixed point: of a linear map from which plain iteration departs, spread over the ranks.
program mixing
   use m_kinds, only: wp
   use m_communicator, only: communicator_t
   use m_mixing, only: mixing_t
   use m_assertions, only: assertions_t
   implicit none
   real(wp), parameter :: factors(4) = [-3.0_wp, 0.9_wp, 0.2_wp, 0.2_wp] !< of plain iteration: each
                                                                        !< component's error
   type(communicator_t) :: comm
   type(assertions_t) :: test
   call comm%start()
   call test%start(comm, 'mixing')
   call iterate(plain=.false.)
   call iterate(plain=.true.)
   call test%finish()

contains

   !> Each rank has the four components with a fixed point of its own.
   subroutine iterate(plain)
      logical, intent(in) :: plain
      type(mixing_t) :: mixed
      real(wp) :: x(4), step(4), fixed(4)
      integer :: n
      fixed = [1.0_wp, -2.0_wp, 0.5_wp, 4.0_wp]*(1 + comm%rank)
      x = 0.0_wp
      call mixed%begin(size(x))
      do n = 1, 8
         step = (factors - 1.0_wp)*(x - fixed)
         if (.not. plain) call mixed%mix(comm, size(x), x, step)
         x = x + step
      end do
      if (plain) then
         call test%check(any(abs(x - fixed) > 100.0_wp), 'plain iteration departs')
      else
         call test%check(all(abs(x - fixed) < 1.0e-9_wp*(1 + comm%rank)), 'mixed iterates end')
      end if
   end subroutine iterate

end program mixing
