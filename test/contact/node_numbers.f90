!> Nodes of contact points in a grid of more than 2**31 nodes, some on the 8 nodes of a cell and some on the 27 of a bin: places
!> come back from their numbers, rows that share nodes of far-apart tools find them under one local number, in the order of the
!> grid, forces arrive at the places that were given, and velocities come from there.
program node_numbers
   use m_kinds, only: wp, i8
   use m_communicator, only: communicator_t
   use m_contact_system, only: contact_system_t, nodal_forces_t
   use m_assertions, only: assertions_t
   implicit none
   integer, parameter :: cells(3) = [2048, 2000, 2048]
   integer, parameter :: corner(3, 4) = reshape([0, 0, 0, 999, 1000, 1500, 1000, 1000, 1500, 2046, 1998, 2047], [3, 4])
   real(wp), parameter :: mobility = 3.0_wp
   integer, parameter :: last(4) = [1, 2, 1, 2] !< nodes of a point along each axis run from its corner to here
   type(communicator_t) :: comm
   type(assertions_t) :: test
   type(contact_system_t) :: system
   type(nodal_forces_t), allocatable :: parts(:)
   real(wp) :: given(3), sums(3), force(4), speed(4), among_free(5), along
   logical :: free(4)
   integer :: n, order(4), p, q
   call comm%start()
   call test%start(comm, 'node_numbers')

   ! four contact points, one of them in the bin of another
   call fill([1, 2, 3, 4])
   call test%check(system%nodes == 8 + 27 + 27, 'nodes that rows share have one number')
   call test%check(all(system%grid_node(2:) > system%grid_node(:system%nodes - 1)), 'numbers rise')
   call test%check(system%grid_node(system%nodes) > int(huge(1), i8), 'there are numbers above 2**31')
   call test%check(all_come_back(), 'places come back from their numbers')

   ! the order of rows makes no difference to numbers
   call fill([3, 1, 4, 2])
   call test%check(all_come_back(), 'places come back whatever the order of rows')

   ! forces arrive where they were given
   call system%connect([integer ::])
   call system%activate(1, 4)
   call system%nodal_forces([1.0_wp, 2.0_wp, 4.0_wp, 8.0_wp], parts)
   sums = 0.0_wp
   do n = 1, size(parts(1)%node)
      sums = sums + parts(1)%force(3, n)*system%place_of(parts(1)%node(n))
   end do
   ! row r is point order(r)
   order = [3, 1, 4, 2]
   force = [1.0_wp, 2.0_wp, 4.0_wp, 8.0_wp]
   given = 0.0_wp
   do n = 1, 4
      given = given + force(n)*(corner(:, order(n)) + 0.5_wp*last(order(n)))
   end do
   call test%check_close(sums, given, 1.0e-9_wp, 'first moments of the forces')

   ! what comes of it at the points, by plain sums over the nodes that two of them share
   call system%connect([integer ::])
   call system%multiply(force, speed)
   do p = 1, 4
      along = 0.0_wp
      do q = 1, 4
         along = along + force(q)*system%scale(p)*system%scale(q)*shared(order(p), order(q))*mobility
      end do
      call test%check_close(speed(p), along, 1.0e-12_wp, 'speed of a point')
   end do

   ! between some of them: the same as if the others were not there
   do n = 0, 15
      free = [(btest(n, p), p=0, 3)]
      call system%set_free([free, .false.])
      call system%multiply(merge(force, 0.0_wp, free), speed)
      call system%multiply_free([merge(force, 0.0_wp, free), 0.0_wp], among_free)
      call test%check_close(among_free, [merge(speed, 0.0_wp, free), 0.0_wp], 1.0e-12_wp, 'speeds of free points')
   end do

   ! no rows
   call fill([integer ::])
   call test%check(system%nodes == 0 .and. size(system%grid_node) == 0, 'no nodes')
   call test%finish()

contains

   !> A system of some of the contact points, each in the middle of its nodes.
   subroutine fill(points)
      integer, intent(in) :: points(:)
      integer :: axis, i, p, place(0:2, 3)
      real(wp) :: weight(0:2, 0:2, 0:2)
      call system%begin(comm, cells, [0.0_wp])
      do p = 1, size(points)
         associate (c => corner(:, points(p)), l => last(points(p)))
            place = reshape([((c(axis) + i, i=0, 2), axis=1, 3)], [3, 3])
            weight = 1.0_wp/(l + 1)**3
            call system%add_row(l, place, weight, [0.0_wp, 0.0_wp, 1.0_wp], 1, 0.0_wp)
         end associate
      end do
      call system%number_nodes(size(points))
      system%mobility(:3, :system%nodes) = mobility
      call system%set_scale(spread(0.0_wp, 1, size(points)))
      call system%group_rows()
   end subroutine fill

   !> Sum over the nodes that two points share of the products of their weights.
   pure real(wp) function shared(p, q)
      integer, intent(in) :: p, q
      integer :: along(3)
      along = min(corner(:, p) + last(p), corner(:, q) + last(q)) - max(corner(:, p), corner(:, q)) + 1
      shared = real(product(max(0, along)), wp)/((last(p) + 1)*(last(q) + 1))**3
   end function shared

   !> True when each row's nodes are, by their local numbers, where they were said to be.
   logical function all_come_back()
      integer :: i, j, k, r, s
      all_come_back = system%begins(system%rows + 1) > 1
      s = 0
      do r = 1, system%rows
         associate (at => system%place(:, :, r), l => merge(1, 2, system%begins(r + 1) - system%begins(r) == 8))
            do k = 1, l + 1
               do j = 1, l + 1
                  do i = 1, l + 1
                     s = s + 1
                     all_come_back = all_come_back .and. &
                                     all(system%place_of(system%grid_node(system%node(s))) == [at(i, 1), at(j, 2), at(k, 3)])
                  end do
               end do
            end do
         end associate
      end do
   end function all_come_back

end program node_numbers
