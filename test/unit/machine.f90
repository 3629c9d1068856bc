!> What systems say of cores, in their own words.
program machine
   use m_kinds, only: wp
   use m_communicator, only: communicator_t
   use m_assertions, only: assertions_t
   use m_machine, only: cores_of, share_of_time
   implicit none
   type(communicator_t) :: comm
   type(assertions_t) :: test
   call comm%start()
   call test%start(comm, 'machine')
   call test%check_equal(sum(popcnt(cores_of('	3'))), 2, 'cores of a short mask')
   call test%check_equal(sum(popcnt(cores_of(' ff,ffffffff,00000001'))), 41, 'cores of a mask of three words')
   call test%check_equal(sum(popcnt(cores_of('00000000,0000a000'))), 2, 'cores that are not the first')
   call test%check_equal(sum(popcnt(cores_of(''))), 0, 'no mask')
   call test%check_close(share_of_time('150000 100000'), 1.5_wp, 1.0e-15_wp, 'a quota of one core and a half')
   call test%check(share_of_time('max 100000') > 1.0e300_wp, 'no quota')
   call test%check(share_of_time('') > 1.0e300_wp, 'no word of a quota')
   call test%finish()
end program machine
