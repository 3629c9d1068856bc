!> The axis-aligned manufactured solution (m_manufactured) with a level over half of the cube: its order of
!> convergence is not below that of the uniform grid, in lockstep, subcycled with small steps, and subcycled.
!test: ranks 2
!test: limit 120
program levels_manufactured
   use m_kinds, only: wp
   use m_communicator, only: communicator_t
   use m_assertions, only: assertions_t
   use m_manufactured, only: run_t, series_t, run_series
   implicit none
   integer, parameter :: grids(2) = [8, 12]
   real(wp), parameter :: below = 0.1_wp !< of the order, at most
   type(communicator_t) :: comm
   type(assertions_t) :: test
   type(series_t) :: uniform
   call comm%start()
   call test%start(comm, 'levels_manufactured')
   uniform = run_series(comm, run_t(), grids, 'one level')
   call compare(run_t(levels=2, subcycle=.false.), grids, 'lockstep')
   call compare(run_t(levels=2, safety=0.1_wp), grids, 'subcycled, small steps')
   call compare(run_t(levels=2), grids, 'subcycled')
   call test%finish()

contains

   subroutine compare(setting, cells, name)
      type(run_t), intent(in) :: setting
      integer, intent(in) :: cells(:)
      character(len=*), intent(in) :: name
      type(series_t) :: nested
      integer :: g
      nested = run_series(comm, setting, cells, 'a level over half of the cube, '//name)
      call test%check(.not. any(nested%outcomes%failed), name//': goes on')
      call test%check(nested%order_l2 > uniform%order_l2 - below, name//': order, L2')
      call test%check(nested%order_largest > uniform%order_largest - below, name//': order, Linf')
      do g = 1, size(cells)
         call test%check(nested%outcomes(g)%l2 < uniform%outcomes(g)%l2, name//': a smaller error')
         call test%check(nested%outcomes(g)%particles > 4*uniform%outcomes(g)%particles, name// &
                         ': particles of the level')
      end do
   end subroutine compare

end program levels_manufactured
