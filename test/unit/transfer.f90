!> Particles to nodes and back on one block, against plain loops over all particles and all nodes; what must
!> be conserved.
program transfer
   use m_kinds, only: wp, i4
   use m_constants, only: short_of, block_size
   use m_communicator, only: communicator_t
   use m_field_table, only: field_table_t, layout_t
   use m_cell_list, only: cell_list_t
   use m_stencil, only: frame_t
   use m_locate, only: locate_particles
   use m_p2g_boxes, only: p2g_boxes, add_body_force
   use m_g2p_boxes, only: g2p_boxes, motion_t
   use m_node_solve, only: solve_nodes
   use m_assertions, only: assertions_t
   use m_chance, only: chance_t, keep_worst, say
   use m_plain_weight, only: plain_weights
   implicit none
   integer, parameter :: last = block_size + 1, lanes = 8
   type(communicator_t) :: comm
   type(assertions_t) :: test
   type(chance_t) :: chance
   type(layout_t) :: layout
   type(frame_t) :: frame
   type(cell_list_t) :: cells
   real(wp), allocatable :: column(:, :), gradient(:, :)
   real(wp), dimension(lanes, 0:last, 0:last, 0:last) :: tile, plain, followed
   real(wp) :: body_force(2000, 3)
   !> Ways to go through the particles: as they are stored, at first with hardly two of a bin beside each
   !> other, then bin by bin.
   character(len=9), parameter :: ways(4) = ['as made  ', 'chosen   ', 'sorted   ', 'from 101 ']
   integer :: n, way
   call comm%start()
   call test%start(comm, 'transfer')
   call make_particles(1500)
   do way = 1, size(ways)
      call arrange(way)
      call follow(way)
      call to_nodes(affine=.true.)
      call to_nodes(affine=.false.)
      call to_particles(1.0_wp)
      call to_particles(0.7_wp)
      call to_particles(0.0_wp)
      call gradient_only()
   end do
   call linear_field()
   call rigid_stress_free()
   call test%finish()

contains

   !> Random particles of three sizes, unevenly spread over the block's bins: some empty, some with dozens.
   subroutine make_particles(count)
      integer, intent(in) :: count
      type(field_table_t) :: table
      real(wp), parameter :: sizes(3) = [1.0_wp/6.0_wp, 0.25_wp, 0.5_wp]
      integer(i4), allocatable :: emigrants(:)
      real(wp) :: lowest(3), highest(3), spot(3)
      integer :: p, c, emigrant_count
      logical :: moved
      call table%declare('mass', 1, 'kg', .true.) ! not the program's order: nothing may rest on it
      call table%declare('stress', 6, 'Pa', .true.)
      call table%declare('velocity_gradient', 9, '1/s', .false.)
      call table%declare('position', 3, 'm', .true.)
      call table%declare('half_size', 1, 'm', .true.)
      call table%declare('velocity', 3, 'm/s', .true.)
      call table%declare('volume', 1, 'm3', .true.)
      call table%declare('next_position', 3, 'm', .false.)
      layout = table%layout()
      frame = frame_t([0.3_wp, -1.1_wp, 2.7_wp], 0.37_wp, 1.0_wp/0.37_wp)
      n = count
      allocate (column(n + 5, table%columns), gradient(n + 5, 9), emigrants(0))
      do c = 1, table%columns
         column(:, c) = chance%several(n + 5, -1.0_wp, 1.0_wp)
      end do
      gradient = 0.0_wp
      do p = 1, n
         spot = chance%several(3, -0.5_wp, block_size - 0.5_wp)
         ! a crowded bin
         if (mod(p, 4) == 0) spot = [3.0_wp, 3.0_wp, 7.0_wp] + chance%several(3, -0.49_wp, 0.49_wp)
         if (mod(p, 4) == 1) spot(1) = min(spot(1), 2.0_wp)
         column(p, layout%position:layout%position + 2) = frame%origin + spot*frame%cell
         column(p, layout%half_size) = sizes(1 + mod(p, 3))*frame%cell
         column(p, layout%mass) = chance%between(0.5_wp, 2.0_wp)
         column(p, layout%volume) = chance%between(0.5_wp, 2.0_wp)
      end do
      call cells%reserve(n + 5, choosing=.true.)
      call locate_particles(n, column(:, layout%position:layout%position + 2), frame, cells%bin, emigrants, &
                            emigrant_count, moved, lowest, highest)
      call test%check_equal(emigrant_count, 0, 'particles made inside the block do not leave it')
      call test%check_close([lowest, highest], &
                            [minval(column(:n, layout%position:layout%position + 2), dim=1), &
                            maxval(column(:n, layout%position:layout%position + 2), dim=1)], 0.0_wp, &
                            'bounds of the centres')
      body_force(:n, 1) = chance%several(n, -1.0_wp, 1.0_wp)
      body_force(:n, 2) = chance%several(n, -1.0_wp, 1.0_wp)
      body_force(:n, 3) = chance%several(n, -1.0_wp, 1.0_wp)
   end subroutine make_particles

   !> Runs of particles of one bin: hardly any as they were made, of dozens when they are chosen bin by bin or
   !> sorted.
   subroutine arrange(way)
      integer, intent(in) :: way
      integer(i4) :: order(n)
      call cells%update_statistics(n)
      select case (ways(way))
      case ('chosen')
         cells%order(:n) = in_lists()
         cells%chosen = .true.
      case ('sorted')
         call test%check(cells%run_breaks > n, 'the particles were out of order')
         call cells%sort(order)
         column(:n, :) = column(order, :)
         body_force(:n, :) = body_force(order, :)
         call cells%update_statistics(n)
         call test%check_equal(cells%run_breaks, 0, 'sorted, they are in order')
      case ('from 101')
         call cells%go_through(101, n)
      end select
   end subroutine arrange

   !> The particles cell by cell, as the linked lists have them.
   function in_lists() result(order)
      integer(i4) :: order(n)
      integer :: cell, p, m
      call cells%outdate()
      call cells%link(n)
      m = 0
      do cell = 1, size(cells%first)
         p = cells%first(cell)
         do while (p > 0)
            m = m + 1
            order(m) = p
            p = cells%next(p)
         end do
      end do
      call test%check_equal(m, n, 'the lists have every particle')
   end function in_lists

   !> P2G along the linked lists, while particles are out of order in memory, and along memory once they are
   !> sorted: the same bits.
   subroutine follow(way)
      integer, intent(in) :: way
      tile = 0.0_wp
      call p2g_boxes(cells, column, layout, frame, tile)
      if (ways(way) == 'chosen') followed = tile
      if (ways(way) == 'sorted') &
         call test%check(all(abs(tile - followed) <= 0.0_wp), &
                         'P2G along the lists and along memory: the same bits')
   end subroutine follow

   pure function node_place(i, j, k) result(place)
      integer, intent(in) :: i, j, k !< in the tile
      real(wp) :: place(3)
      place = frame%origin + real([i, j, k] - 1, wp)*frame%cell
   end function node_place

   !> A component group of a particle.
   pure function of(p, first, components) result(values)
      integer, intent(in) :: p, first, components
      real(wp) :: values(components)
      values = column(p, first:first + components - 1)
   end function of

   !> Equations 3, 4, 8 of the thesis, with the affine term m S L (x_i - x_p), and m S b.
   subroutine plain_to_nodes(affine, with_body_force)
      logical, intent(in) :: affine, with_body_force
      real(wp) :: weight, slope(3), s(6), sigma(3, 3), velocity(3)
      integer :: i, j, k, p
      plain = 0.0_wp
      do p = cells%start, n
         s = of(p, layout%stress, 6)
         sigma = reshape([s(1), s(6), s(5), s(6), s(2), s(4), s(5), s(4), s(3)], [3, 3])
         do k = 0, last
            do j = 0, last
               do i = 0, last
                  if (any(abs(of(p, layout%position, 3) - node_place(i, j, k)) > 1.5_wp*frame%cell)) cycle
                  call plain_weights(of(p, layout%position, 3), node_place(i, j, k), &
                                     short_of*column(p, layout%half_size), frame%cell, weight, slope)
                  velocity = of(p, layout%velocity, 3)
                  if (affine) velocity = velocity + matmul(reshape(of(p, layout%gradient, 9), [3, 3]), &
                                                           node_place(i, j, k) - of(p, layout%position, 3))
                  plain(1, i, j, k) = plain(1, i, j, k) + column(p, layout%mass)*weight
                  plain(2:4, i, j, k) = plain(2:4, i, j, k) + column(p, layout%mass)*weight*velocity
                  plain(5:7, i, j, k) = plain(5:7, i, j, k) - column(p, layout%volume)*matmul(sigma, slope)
                  if (with_body_force) plain(5:7, i, j, k) = plain(5:7, i, j, k) + column(p, layout%mass) &
                     *weight*body_force(p, :)
               end do
            end do
         end do
      end do
   end subroutine plain_to_nodes

   subroutine to_nodes(affine)
      logical, intent(in) :: affine
      type(layout_t) :: at
      real(wp) :: momentum(3), angular(3), force(3), off(3), scale(3), x(3)
      integer :: i, j, k, p, q
      character(len=:), allocatable :: kind
      kind = trim(merge('affine', 'plain ', affine))//', '//trim(ways(way))
      at = layout
      if (.not. affine) at%gradient = 0
      tile = 0.0_wp
      call p2g_boxes(cells, column, at, frame, tile)
      call plain_to_nodes(affine, with_body_force=.false.)
      off = 0.0_wp
      call keep_worst(off(1), maxval(abs(tile(1, :, :, :) - plain(1, :, :, :))))
      call keep_worst(off(2), maxval(abs(tile(2:4, :, :, :) - plain(2:4, :, :, :))))
      call keep_worst(off(3), maxval(abs(tile(5:7, :, :, :) - plain(5:7, :, :, :))))
      scale = [maxval(plain(1, :, :, :)), maxval(abs(plain(2:4, :, :, :))), maxval(abs(plain(5:7, :, :, :)))]
      call say(kind//' to nodes: mass, relative', off(1)/scale(1))
      call say(kind//' to nodes: momentum, relative', off(2)/scale(2))
      call say(kind//' to nodes: internal force, relative', off(3)/scale(3))
      call test%check_close(off/scale, [0.0_wp, 0.0_wp, 0.0_wp], 1.0e-13_wp, kind// &
                            ' to nodes: as the plain sums')
      call test%check_close(sum(abs(tile(8, :, :, :))), 0.0_wp, 0.0_wp, 'the spare lane stays 0')
      call test%check_close(sum(tile(1, :, :, :)), sum(column(cells%start:n, layout%mass)), 1.0e-13_wp*n, &
                            kind//': total mass')
      momentum = 0.0_wp
      angular = 0.0_wp
      force = 0.0_wp
      do q = 1, 3
         momentum(q) = sum(tile(1 + q, :, :, :)) &
                       - sum(column(cells%start:n, layout%mass)*column(cells%start:n, layout%velocity + q &
                       - 1))
         force(q) = sum(tile(4 + q, :, :, :))
      end do
      call test%check_close(momentum, [0.0_wp, 0.0_wp, 0.0_wp], 1.0e-13_wp*n, kind//': total momentum')
      call test%check_close(force/scale(3), [0.0_wp, 0.0_wp, 0.0_wp], 1.0e-13_wp*n, kind// &
                            ': internal forces sum to zero')
      do k = 0, last ! the stress is symmetric: no torque either
         do j = 0, last
            do i = 0, last
               x = node_place(i, j, k)
               angular = angular + [x(2)*tile(7, i, j, k) - x(3)*tile(6, i, j, k), x(3)*tile(5, i, j, k) &
                                    - x(1)*tile(7, i, j, k), x(1)*tile(6, i, j, k) - x(2)*tile(5, i, j, k)]
            end do
         end do
      end do
      call test%check_close(angular/scale(3), [0.0_wp, 0.0_wp, 0.0_wp], 1.0e-12_wp*n, kind// &
                            ': internal forces have no torque')
      call add_body_force(cells, column, at, frame, body_force, tile)
      call plain_to_nodes(affine, with_body_force=.true.)
      call test%check_close(reshape(tile(5:7, :, :, :) - plain(5:7, :, :, :), [3*(last + 1)**3])/scale(3), &
                            [(0.0_wp, p=1, 3*(last + 1)**3)], 1.0e-13_wp, 'body forces as the plain sums')
   end subroutine to_nodes

   !> Velocity, velocity gradient and place from the nodes by plain sums.
   subroutine from_nodes(p, velocity, acceleration, slopes)
      integer, intent(in) :: p
      real(wp), intent(out) :: velocity(3), acceleration(3), slopes(3, 3)
      real(wp) :: weight, slope(3)
      integer :: i, j, k, a
      velocity = 0.0_wp
      acceleration = 0.0_wp
      slopes = 0.0_wp
      do k = 0, last
         do j = 0, last
            do i = 0, last
               if (any(abs(of(p, layout%position, 3) - node_place(i, j, k)) > 1.5_wp*frame%cell)) cycle
               call plain_weights(of(p, layout%position, 3), node_place(i, j, k), &
                                  short_of*column(p, layout%half_size), frame%cell, weight, slope)
               velocity = velocity + weight*tile(2:4, i, j, k)
               acceleration = acceleration + weight*tile(5:7, i, j, k)
               do a = 1, 3
                  slopes(:, a) = slopes(:, a) + slope(a)*tile(2:4, i, j, k)
               end do
            end do
         end do
      end do
   end subroutine from_nodes

   subroutine fill_tile()
      integer :: i, j, k
      do k = 0, last
         do j = 0, last
            do i = 0, last
               tile(:, i, j, k) = chance%several(lanes, -1.0_wp, 1.0_wp)
            end do
         end do
      end do
   end subroutine fill_tile

   subroutine to_particles(flip)
      real(wp), intent(in) :: flip
      real(wp), allocatable :: before(:, :)
      real(wp) :: off(3), velocity(3), acceleration(3), slopes(3, 3)
      real(wp), parameter :: dt = 0.013_wp
      integer :: p
      call fill_tile()
      before = column
      call g2p_boxes(cells, tile, layout, frame, motion_t(dt, flip, layout%next_position), column, gradient)
      off = 0.0_wp
      call test%check(all(abs(column(:cells%start - 1, :) - before(:cells%start - 1, :)) <= 0.0_wp), &
                      'those before the first keep their bits')
      do p = cells%start, n
         call from_nodes(p, velocity, acceleration, slopes)
         call keep_worst(off(1), &
                         maxval(abs(of(p, layout%next_position, 3) &
                                    - (of(p, layout%position, 3) + dt*velocity))))
         call keep_worst(off(2), maxval(abs(of(p, layout%velocity, 3) - (1.0_wp - flip)*velocity &
                                           - flip*(before(p, layout%velocity:layout%velocity + 2) &
                                                   + dt*acceleration))))
         call keep_worst(off(3), maxval(abs(gradient(p, :) - reshape(slopes, [9])))*frame%cell)
      end do
      call say(trim(ways(way))//', to particles: place (m)', off(1))
      call say('to particles: velocity (m/s)', off(2))
      call say('to particles: velocity gradient, relative', off(3))
      call test%check_close(off, [0.0_wp, 0.0_wp, 0.0_wp], 2.0e-14_wp, trim(ways(way))// &
                            ', to particles: as the plain sums')
      column(:, layout%velocity:layout%velocity + 2) = before(:, layout%velocity:layout%velocity + 2)
      column(:, layout%next_position:layout%next_position + 2) = before(:, &
         layout%next_position:layout%next_position + 2)
      call test%check(all(abs(column - before) <= 0.0_wp), &
                      'to particles: touches nothing else, nor what is beyond the count')
   end subroutine to_particles

   !> With time step 0 and flip 1 only the velocity gradient is taken.
   subroutine gradient_only()
      real(wp), allocatable :: before(:, :)
      call fill_tile()
      before = column
      call g2p_boxes(cells, tile, layout, frame, motion_t(0.0_wp, 1.0_wp, layout%position), column, gradient)
      call test%check(all(abs(column - before) <= 0.0_wp), &
                      'gradient only: places and velocities keep their bits')
   end subroutine gradient_only

   !> v = a + B x, carried to the nodes and back, with affine transfer: nothing is lost.
   subroutine linear_field()
      real(wp) :: a(3), b(3, 3), off(3), expected(3)
      integer :: i, j, k, p
      a = chance%several(3, -1.0_wp, 1.0_wp)
      b = reshape(chance%several(9, -1.0_wp, 1.0_wp), [3, 3])
      column(:, layout%stress:layout%stress + 5) = 0.0_wp
      do p = 1, n
         column(p, layout%velocity:layout%velocity + 2) = a + matmul(b, of(p, layout%position, 3))
         column(p, layout%gradient:layout%gradient + 8) = reshape(b, [9])
      end do
      call cells%update_statistics(n)
      tile = 0.0_wp
      call p2g_boxes(cells, column, layout, frame, tile)
      call solve_nodes(tile, 0.1_wp)
      off = 0.0_wp
      do k = 0, last
         do j = 0, last
            do i = 0, last
               if (tile(1, i, j, k) <= 0.0_wp) then
                  call keep_worst(off(1), maxval(abs(tile(:, i, j, k))))
               else
                  call keep_worst(off(1), &
                                  maxval(abs(tile(2:4, i, j, k) - a - matmul(b, node_place(i, j, k)))))
               end if
            end do
         end do
      end do
      call g2p_boxes(cells, tile, layout, frame, motion_t(0.0_wp, 0.0_wp, layout%next_position), &
                     column, gradient)
      do p = 1, n
         expected = a + matmul(b, of(p, layout%position, 3))
         call keep_worst(off(2), maxval(abs(of(p, layout%velocity, 3) - expected)))
         call keep_worst(off(3), maxval(abs(gradient(p, :) - reshape(b, [9]))))
      end do
      call say('linear velocity field at the nodes (m/s, field of about 5)', off(1))
      call say('back at the particles (m/s)', off(2))
      call say('its gradient (1/s)', off(3))
      call test%check_close(off, [0.0_wp, 0.0_wp, 0.0_wp], 1.0e-12_wp, &
                            'affine transfer keeps a linear velocity field')
   end subroutine linear_field

   !> A uniform stress makes no force on a node whose surroundings are full: 8 particles in every cell.
   subroutine rigid_stress_free()
      integer :: i, j, k, p
      real(wp) :: inner
      p = 0
      do k = 0, 11
         do j = 0, 11
            do i = 0, 11
               p = p + 1
               if (p > n) exit
               column(p, layout%position:layout%position + 2) = frame%origin &
                  + (0.25_wp + 0.5_wp*real([i, j, k], wp))*frame%cell
            end do
         end do
      end do
      n = min(p, n)
      column(:n, layout%half_size) = 0.25_wp*frame%cell
      column(:n, layout%volume) = (0.5_wp*frame%cell)**3
      do p = 1, 6
         column(:n, layout%stress + p - 1) = 1.0e9_wp*p
      end do
      do p = 1, n
         associate (at => nint((of(p, layout%position, 3) - frame%origin)*frame%per_cell - 1.0e-9_wp))
            cells%bin(p) = 1 + at(1) + block_size*(at(2) + block_size*at(3))
         end associate
      end do
      call cells%update_statistics(n)
      tile = 0.0_wp
      call p2g_boxes(cells, column, layout, frame, tile)
      inner = maxval(abs(tile(5:7, 3:5, 3:5, 3:4)))/(6.0e9_wp*frame%cell**2)
      call say('uniform stress: force on inner nodes, relative', inner)
      call test%check_close(inner, 0.0_wp, 1.0e-13_wp, 'a uniform stress makes no force on inner nodes')
   end subroutine rigid_stress_free

end program transfer
