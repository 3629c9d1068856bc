!test: ranks 1
!> Which particle a probe follows when the one it chose was split or merged.
program probes
   use m_kinds, only: i8
   use m_communicator, only: communicator_t
   use m_assertions, only: assertions_t
   use m_probe, only: kinship
   use m_split, only: child_id
   implicit none
   type(communicator_t) :: comm
   type(assertions_t) :: test
   integer(i8), parameter :: parent = 3000000000042_i8
   integer, parameter :: id_bits = 50
   integer(i8) :: probed
   call comm%start()
   call test%start(comm, 'probes')
   probed = child_id(parent, 8_i8*5_i8 + 6_i8, 2, id_bits) ! octant 5, of it octant 6
   call test%check(kinship(parent + 1, parent, id_bits) == -1, 'another parent is no relative')
   call test%check(kinship(child_id(parent + 1, 5_i8, 1, id_bits), probed, id_bits) == -1, &
                   'nor are its parts')
   call nearer(probed, child_id(parent, 8_i8*5_i8 + 7_i8, 2, id_bits), &
               'the particle itself before its sisters')
   call nearer(child_id(parent, 5_i8, 1, id_bits), child_id(parent, 4_i8, 1, id_bits), &
               'what it was merged into before its other octants')
   call nearer(child_id(parent, 5_i8, 1, id_bits), child_id(parent, 8_i8*4_i8 + 6_i8, 2, id_bits), &
               'or before their parts')
   call nearer(child_id(parent, 8_i8*5_i8 + 2_i8, 2, id_bits), &
               child_id(parent, 8_i8*5_i8 + 5_i8, 2, id_bits), 'the sister of the longer way')
   call nearer(parent, child_id(parent, 4_i8, 1, id_bits), 'of equally near ones the one with the smaller id')
   call test%check(kinship(parent, probed, id_bits) >= 0, 'the first parent, merged again')
   call nearer(parent + ishft(4095_i8, 50), parent + ishft(2047_i8, 50), 'all twelve splits', of=parent &
               + ishft(4095_i8, 50))
   call test%finish()

contains

   subroutine nearer(one, other, name, of)
      integer(i8), intent(in) :: one, other
      character(len=*), intent(in) :: name
      integer(i8), intent(in), optional :: of !< `probed` where it is not given
      integer(i8) :: to
      to = probed
      if (present(of)) to = of
      call test%check(kinship(one, to, id_bits) > kinship(other, to, id_bits), name)
   end subroutine nearer

end program probes
