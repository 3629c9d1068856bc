!> Nodes of contact points in a grid of more than 2**31 nodes: places come back from their numbers, rows that share nodes of
!> far-apart tools find them under one local number, in the order of the grid, and forces arrive at the places that were given.
program node_numbers
   use m_kinds, only: wp, i8
   use m_communicator, only: communicator_t
   use m_contact_system, only: contact_system_t, nodal_forces_t, cell_nodes
   use m_assertions, only: assertions_t
   implicit none
   integer, parameter :: cells(3) = [2048, 2000, 2048]
   integer, parameter :: corner(3, 4) = reshape([0, 0, 0, 999, 1000, 1500, 1000, 1000, 1500, 2046, 1998, 2047], [3, 4])
   type(communicator_t) :: comm
   type(assertions_t) :: test
   type(contact_system_t) :: system
   type(nodal_forces_t), allocatable :: parts(:)
   real(wp) :: given(3), sums(3)
   integer :: n
   call comm%start()
   call test%start(comm, 'node_numbers')

   ! four contact points, two of them in cells that share a face
   call fill([1, 2, 3, 4])
   call test%check(system%nodes == 3*8 + 4, 'nodes that rows share have one number')
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
   ! row r is point order(r): forces 1, 2, 4, 8 act on points 3, 1, 4, 2
   given = 1.0_wp*(corner(:, 3) + 0.5_wp) + 2.0_wp*(corner(:, 1) + 0.5_wp) + 4.0_wp*(corner(:, 4) + 0.5_wp) &
           + 8.0_wp*(corner(:, 2) + 0.5_wp)
   call test%check_close(sums, given, 1.0e-12_wp, 'first moments of the forces')

   ! no rows
   call fill([integer ::])
   call test%check(system%nodes == 0 .and. size(system%grid_node) == 0, 'no nodes')
   call test%finish()

contains

   !> A system of some of the contact points, each in the middle of its cell.
   subroutine fill(points)
      integer, intent(in) :: points(:)
      integer :: place(3, cell_nodes), p, s
      call system%begin(comm, cells, [0.0_wp])
      do p = 1, size(points)
         do s = 1, cell_nodes
            place(:, s) = corner(:, points(p)) + [mod(s - 1, 2), mod((s - 1)/2, 2), (s - 1)/4]
         end do
         call system%add_row(place, spread(0.125_wp, 1, cell_nodes), [0.0_wp, 0.0_wp, 1.0_wp], 1, 0.0_wp)
      end do
      call system%number_nodes(size(points))
   end subroutine fill

   !> True when each row's nodes are, by their local numbers, where they were said to be.
   logical function all_come_back()
      integer :: r, s
      all_come_back = .true.
      do r = 1, system%rows
         do s = 1, cell_nodes
            all_come_back = all_come_back .and. all(system%place_of(system%grid_node(system%node(s, r))) == system%place(:, s, r))
         end do
      end do
   end function all_come_back

end program node_numbers
