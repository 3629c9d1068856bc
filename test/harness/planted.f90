!test: helper
!> A test program with planted failures; selftest.sh runs it and looks for them. Its argument says which to
!> plant.
program planted
   use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan
   use m_kinds, only: wp
   use m_communicator, only: communicator_t
   use m_assertions, only: assertions_t
   implicit none
   type(communicator_t) :: comm
   type(assertions_t) :: test
   character(len=20) :: plant
   real(wp) :: nan
   call get_command_argument(1, plant)
   nan = ieee_value(nan, ieee_quiet_nan)
   call comm%start()
   call test%start(comm, 'planted')
   if (plant /= 'nothing') then
      call test%check(.true., 'a condition that holds')
      call test%check_close(1.0_wp + 1.0e-15_wp, 1.0_wp, 1.0e-14_wp, 'a value within its tolerance')
      call test%check_close([1.0_wp, 2.0_wp], [1.0_wp, 2.0_wp], 0.0_wp, 'an array that is exact')
      call test%check_equal(3, 3, 'two equal counts')
   end if
   select case (plant)
   case ('condition')
      call test%check(.false., 'planted')
   case ('value')
      call test%check_close(1.1_wp, 1.0_wp, 1.0e-3_wp, 'planted')
   case ('nan')
      call test%check_close(nan, 1.0_wp, huge(1.0_wp), 'planted')
   case ('nan-expected')
      call test%check_close(1.0_wp, nan, 1.0_wp, 'planted')
   case ('array')
      call test%check_close([1.0_wp, nan], [1.0_wp, 2.0_wp], 1.0_wp, 'planted')
   case ('length')
      call test%check_close([1.0_wp], [1.0_wp, 2.0_wp], 1.0_wp, 'planted')
   case ('count')
      call test%check_equal(3, 4, 'planted')
   case ('last-rank')
      call test%check(comm%rank /= comm%ranks - 1, 'planted')
   end select
   call test%finish()
end program planted
