!> Nodes of contact points in a grid of more than 2**31 nodes, some on the 8 nodes of a cell and some on the
!> 27 of a bin: places come back from their numbers, rows that share nodes of far-apart tools find them under
!> one local number, in the order of the grid, forces arrive at the places that were given, and velocities
!> come from there, also between some of the rows.
program node_numbers
   use m_kinds, only: wp, i8
   use m_communicator, only: communicator_t
   use m_near_ranks, only: near_ranks_t
   use m_contact_system, only: contact_system_t
   use m_contact_nodes, only: nodal_forces_t
   use m_assertions, only: assertions_t
   implicit none
   integer, parameter :: cells(3) = [2048, 2000, 2048]
   integer, parameter :: corner(3, 4) = reshape([0, 0, 0, 999, 1000, 1500, 1000, 1000, 1500, 2046, 1998, &
                                                 2047], [3, 4])
   real(wp), parameter :: mobility = 3.0_wp
   integer, parameter :: last(4) = [1, 2, 1, 2] !< nodes of a point along each axis run from its corner to
                                                !< here
   type(communicator_t) :: comm
   type(near_ranks_t) :: alone
   type(assertions_t) :: test
   type(contact_system_t) :: system
   type(nodal_forces_t), allocatable :: parts(:)
   real(wp) :: given(3), sums(3), force(8), speed(8), among_free(9), along
   logical :: free(8)
   integer :: n, order(8), p, q
   call comm%start()
   allocate (alone%ranks(0))
   call test%start(comm, 'node_numbers')

   ! four contact points, one of them in the bin of another
   call fill([1, 2, 3, 4])
   call test%check(system%nodes%count == 8 + 27 + 27, 'nodes that rows share have one number')
   call test%check(all(system%nodes%grid_node(2:) > system%nodes%grid_node(:system%nodes%count - 1)), &
                   'numbers rise')
   call test%check(system%nodes%grid_node(system%nodes%count) > int(huge(1), i8), &
                   'there are numbers above 2**31')
   call test%check(all_come_back(), 'places come back from their numbers')

   ! the order of rows makes no difference to numbers
   call fill([3, 1, 4, 2])
   call test%check(all_come_back(), 'places come back whatever the order of rows')

   ! forces arrive where they were given; some points have several rows
   order = [3, 1, 4, 2, 3, 1, 1, 4]
   call fill(order)
   call test%check(all_come_back(), 'places come back where rows share a cell')
   call system%nodes%connect(comm, alone)
   call system%activate(1, size(order))
   force = [(2.0_wp**p, p=1, size(order))]
   call system%nodal_forces(force, parts)
   sums = 0.0_wp
   do n = 1, size(parts(1)%node)
      sums = sums + parts(1)%force(3, n)*system%nodes%place_of(parts(1)%node(n))
   end do
   given = 0.0_wp
   do n = 1, size(order)
      given = given + force(n)*(corner(:, order(n)) + middle(last(order(n)), n))
   end do
   call test%check_close(sums, given, 1.0e-9_wp, 'first moments of the forces')

   ! what comes of it at the points, by plain sums over the nodes that two of them share
   call system%nodes%connect(comm, alone)
   call system%multiply(force, speed)
   do p = 1, size(order)
      along = 0.0_wp
      do q = 1, size(order)
         along = along + force(q)*system%scale(p)*system%scale(q)*shared(p, q)*mobility
      end do
      call test%check_close(speed(p), along, 1.0e-12_wp*maxval(force), 'speed of a point')
   end do

   ! between some of them: the same as if the others were not there
   do n = 0, 2**size(order) - 1
      free = [(btest(n, p), p=0, size(order) - 1)]
      call system%set_free([free, .false.])
      call system%multiply(merge(force, 0.0_wp, free), speed)
      call system%multiply_free([merge(force, 0.0_wp, free), 0.0_wp], among_free)
      call test%check_close(among_free, [merge(speed, 0.0_wp, free), 0.0_wp], 1.0e-12_wp*maxval(force), &
                            'speeds of free points')
   end do

   ! no rows
   call fill([integer ::])
   call test%check(system%nodes%count == 0 .and. size(system%nodes%grid_node) == 0, 'no nodes')
   call test%finish()

contains

   !> A system of rows at some of the contact points, each with weights of its own.
   subroutine fill(points)
      integer, intent(in) :: points(:)
      integer :: axis, i, p, place(0:2, 3)
      call system%begin(comm, cells, 1, [0], [real(wp) ::])
      do p = 1, size(points)
         place = reshape([((corner(axis, points(p)) + i, i=0, 2), axis=1, 3)], [3, 3])
         call system%add_row(last(points(p)), place, weight_of(last(points(p)), p), &
                             [0.0_wp, 0.0_wp, 1.0_wp], 1, 1)
      end do
      call system%number_nodes(size(points))
      system%mobility(:3, :system%nodes%count) = mobility
      call system%set_scale(spread(0.0_wp, 1, size(points)), spread(0.0_wp, 1, size(points)))
      call system%group_rows()
   end subroutine fill

   !> Weights along an axis, other ones along each and for each row; their sum is 1.
   pure function along_axis(last, row, axis) result(weight)
      integer, intent(in) :: last, row, axis
      real(wp) :: weight(0:2)
      integer :: i
      weight = 0.0_wp
      weight(:last) = [(1.0_wp + i*axis + mod(row*axis, 5), i=0, last)]
      weight = weight/sum(weight)
   end function along_axis

   !> Weights of a row's nodes.
   pure function weight_of(last, row) result(weight)
      integer, intent(in) :: last, row
      real(wp) :: weight(0:2, 0:2, 0:2), x(0:2), y(0:2), z(0:2)
      integer :: j, k
      x = along_axis(last, row, 1)
      y = along_axis(last, row, 2)
      z = along_axis(last, row, 3)
      do k = 0, 2
         do j = 0, 2
            weight(:, j, k) = x*y(j)*z(k)
         end do
      end do
   end function weight_of

   !> Where the middle of a row's weights is, from its first node.
   pure function middle(last, row)
      integer, intent(in) :: last, row
      real(wp) :: middle(3)
      integer :: axis
      middle = [(dot_product(along_axis(last, row, axis), [0.0_wp, 1.0_wp, 2.0_wp]), axis=1, 3)]
   end function middle

   !> Sum over the nodes that two rows share of the products of their weights.
   pure real(wp) function shared(p, q)
      integer, intent(in) :: p, q
      real(wp) :: a(0:2), b(0:2), of_axis
      integer :: axis, i, there
      shared = 1.0_wp
      do axis = 1, 3
         a = along_axis(last(order(p)), p, axis)
         b = along_axis(last(order(q)), q, axis)
         of_axis = 0.0_wp
         do i = 0, 2
            there = corner(axis, order(p)) + i - corner(axis, order(q))
            if (there >= 0 .and. there <= 2) of_axis = of_axis + a(i)*b(there)
         end do
         shared = shared*of_axis
      end do
   end function shared

   !> True when each row's nodes are, by their local numbers, where they were said to be.
   logical function all_come_back()
      integer :: i, j, k, r, s
      all_come_back = system%begins(system%rows + 1) > 1
      s = 0
      do r = 1, system%rows
         associate (at => system%place(:, :, r), &
                   l => merge(1, 2, system%begins(r + 1) - system%begins(r) == 8))
            do k = 1, l + 1
               do j = 1, l + 1
                  do i = 1, l + 1
                     s = s + 1
                     all_come_back = all_come_back .and. &
                                     all(system%nodes%place_of(system%nodes%grid_node(system%node(s))) == &
                                         [at(i, 1), at(j, 2), at(k, 3)])
                  end do
               end do
            end do
         end associate
      end do
   end function all_come_back

end program node_numbers
