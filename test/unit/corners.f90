!> Particles whose domains are parallelepipeds: weights and slopes, to the nodes and back on one block,
!> against plain loops.
program corners
   use m_kinds, only: wp
   use m_constants, only: block_size
   use m_communicator, only: communicator_t
   use m_field_table, only: field_table_t, layout_t
   use m_cell_list, only: cell_list_t
   use m_stencil, only: frame_t, batch, chunk, gimp_weights
   use m_locate, only: bin_of
   use m_corner_stencil, only: corner_stencil_t, corner_weights_t, set_corners, set_corner_weights, &
                               corner_slopes
   use m_half_edges, only: fitted_edges
   use m_face_weights, only: find_face
   use m_p2g_corners, only: p2g_corners, add_corners_body_force
   use m_g2p_corners, only: g2p_corners
   use m_g2p_boxes, only: motion_t
   use m_node_solve, only: solve_nodes
   use m_assertions, only: assertions_t
   use m_chance, only: chance_t, keep_worst, say
   implicit none
   integer, parameter :: last = block_size + 1, lanes = 8, n = 500
   real(wp), parameter :: zero(3) = 0.0_wp
   type(communicator_t) :: comm
   type(assertions_t) :: test
   type(chance_t) :: chance
   type(layout_t) :: layout
   type(frame_t) :: frame
   type(cell_list_t) :: cells
   real(wp), allocatable :: column(:, :), gradient(:, :)
   real(wp), dimension(lanes, 0:last, 0:last, 0:last) :: tile, plain
   real(wp) :: body_force(n, 3)
   call comm%start()
   call test%start(comm, 'corners')
   call make_particles()
   call weights()
   call cubes()
   call faces()
   call to_nodes()
   call to_particles()
   call adjoint()
   call linear_field()
   call test%finish()

contains

   !> Random parallelepipeds, slender and stout, every fifth too large for the nodes; some bins are crowded.
   subroutine make_particles()
      type(field_table_t) :: table
      real(wp) :: r(3, 3), spot(3)
      integer :: c, p
      call table%declare('stress', 6, 'Pa', .true.)
      call table%declare('mass', 1, 'kg', .true.)
      call table%declare('domain', 9, 'm', .true.)
      call table%declare('velocity_gradient', 9, '1/s', .false.)
      call table%declare('position', 3, 'm', .true.)
      call table%declare('velocity', 3, 'm/s', .true.)
      call table%declare('volume', 1, 'm3', .true.)
      call table%declare('next_position', 3, 'm', .false.)
      layout = table%layout()
      frame = frame_t([0.3_wp, -1.1_wp, 2.7_wp], 0.37_wp, 1.0_wp/0.37_wp)
      allocate (column(n + 5, table%columns), gradient(n + 5, 9), source=0.0_wp)
      call cells%reserve(n + 5)
      do c = 1, table%columns
         column(:, c) = chance%several(n + 5, -1.0_wp, 1.0_wp)
      end do
      do p = 1, n
         spot = chance%several(3, -0.5_wp, block_size - 0.5_wp)
         if (mod(p, 3) == 0) spot = [3.0_wp, 0.0_wp, 7.0_wp] + chance%several(3, -0.49_wp, 0.49_wp)
         do
            r = reshape(chance%several(9, -1.0_wp, 1.0_wp), [3, 3])
            if (determinant(r) > 0.05_wp) exit
         end do
         r = r*merge(chance%between(0.5_wp, 1.0_wp), chance%between(0.1_wp, 0.5_wp), mod(p, 5) == 0) &
             /maxval(sum(abs(r), dim=2))
         column(p, layout%domain:layout%domain + 8) = reshape(r, [9])*frame%cell
         column(p, layout%position:layout%position + 2) = frame%origin + spot*frame%cell
         column(p, layout%mass) = chance%between(0.5_wp, 2.0_wp)
         column(p, layout%volume) = chance%between(0.5_wp, 2.0_wp)
         cells%bin(p) = bin_of(column(p, layout%position:layout%position + 2), frame)
         body_force(p, :) = chance%several(3, -1.0_wp, 1.0_wp)
      end do
      call cells%update_statistics(n)
   end subroutine make_particles

   pure real(wp) function determinant(r)
      real(wp), intent(in) :: r(3, 3)
      determinant = r(1, 1)*(r(2, 2)*r(3, 3) - r(2, 3)*r(3, 2)) &
                    - r(1, 2)*(r(2, 1)*r(3, 3) - r(2, 3)*r(3, 1)) &
                    + r(1, 3)*(r(2, 1)*r(3, 2) - r(2, 2)*r(3, 1))
   end function determinant

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

   !> Half edges as they count: scaled down where the domain reaches further than half a cell.
   pure function fitted(p) result(r)
      integer, intent(in) :: p
      real(wp) :: r(3, 3)
      r = reshape(of(p, layout%domain, 9), [3, 3])
      if (maxval(sum(abs(r), dim=2)) > 0.5_wp*frame%cell) r = r*(0.5_wp*frame%cell/maxval(sum(abs(r), dim=2)))
   end function fitted

   !> Weight and slope on a node, plainly: hat functions at the corners, interpolated between them; mean and
   !> mean gradient of that by Gauss's two-point rules, which are exact for it, gradients by Cramer's rule.
   pure subroutine plain_corner_weights(p, node, weight, slope)
      integer, intent(in) :: p
      real(wp), intent(in) :: node(3)
      real(wp), intent(out) :: weight, slope(3)
      real(wp) :: r(3, 3), at_corner(0:1, 0:1, 0:1), xi(3), along(3), swapped(3, 3), share(0:1, 3), corner(3)
      integer :: a, b, c, g, k
      r = fitted(p)
      do c = 0, 1
         do b = 0, 1
            do a = 0, 1
               corner = of(p, layout%position, 3) + matmul(r, real([2*a - 1, 2*b - 1, 2*c - 1], wp))
               at_corner(a, b, c) = product(max(0.0_wp, 1.0_wp - abs(corner - node)/frame%cell))
            end do
         end do
      end do
      weight = 0.0_wp
      slope = 0.0_wp
      do g = 0, 7
         xi = (2*[mod(g, 2), mod(g/2, 2), g/4] - 1)/sqrt(3.0_wp)
         share(0, :) = 0.5_wp*(1.0_wp - xi)
         share(1, :) = 0.5_wp*(1.0_wp + xi)
         along = 0.0_wp
         do c = 0, 1
            do b = 0, 1
               do a = 0, 1
                  weight = weight + 0.125_wp*at_corner(a, b, c)*share(a, 1)*share(b, 2)*share(c, 3)
                  along = along + at_corner(a, b, c)*[(a - 0.5_wp)*share(b, 2)*share(c, 3), &
                                                      share(a, 1)*(b - 0.5_wp)*share(c, 3), &
                                                      share(a, 1)*share(b, 2)*(c - 0.5_wp)]
               end do
            end do
         end do
         do k = 1, 3 ! transpose(r) gradient = along
            swapped = transpose(r)
            swapped(:, k) = along
            slope(k) = slope(k) + 0.125_wp*determinant(swapped)/determinant(r)
         end do
      end do
   end subroutine plain_corner_weights

   !> Weights of all particles against the plain ones, and what they must sum up to.
   subroutine weights()
      type(corner_stencil_t) :: domains
      type(corner_weights_t) :: own
      real(wp) :: weight, slope(3), slopes(27, 3), x(3), off(6), sums(3, 3), unit(3, 3), total, center(3), &
                  turn(3)
      integer :: first, m, p, particle, place(3), node
      off = 0.0_wp
      unit = reshape([1, 0, 0, 0, 1, 0, 0, 0, 1], [3, 3])
      do first = 1, n, chunk
         call set_corners(domains, cells, first, column, layout, frame)
         do m = 1, domains%list%count
            p = 1 + mod(m - 1, batch)
            if (p == 1) call set_corner_weights(own, domains, m)
            slopes = corner_slopes(own, domains, m, frame%per_cell)
            particle = domains%list%member(m)
            place = nint((of(particle, layout%position, 3) - frame%origin)*frame%per_cell) ! the nearest node
            total = 0.0_wp
            center = 0.0_wp
            turn = 0.0_wp
            sums = 0.0_wp
            do node = 1, 27
               x = frame%origin + (place + [mod(node - 1, 3), mod((node - 1)/3, 3), (node - 1)/9] - 1) &
                   *frame%cell
               call plain_corner_weights(particle, x, weight, slope)
               call keep_worst(off(1), own%weight(p, node) - weight)
               call keep_worst(off(2), maxval(abs(slopes(node, :) - slope))*frame%cell)
               total = total + own%weight(p, node)
               center = center + own%weight(p, node)*(x - of(particle, layout%position, 3))
               turn = turn + slopes(node, :)
               sums = sums + spread(slopes(node, :), 2, 3) &
                      *spread(x - of(particle, layout%position, 3), 1, 3)
               call keep_worst(off(6), min(0.0_wp, own%weight(p, node)))
            end do
            call keep_worst(off(3), total - 1.0_wp)
            call keep_worst(off(4), maxval(abs(center))*frame%per_cell)
            call keep_worst(off(5), max(maxval(abs(turn))*frame%cell, maxval(abs(sums - unit))))
         end do
      end do
      call say('weights off the plain ones', off(1))
      call say('slopes off the plain ones', off(2))
      call say('sum of weights off 1', off(3))
      call say('sum of weight times place off the centre, in cells', off(4))
      call say('sums of slopes and of slope times place off 0 and 1', off(5))
      call test%check_close(off, [0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp], 2.0e-13_wp, &
                            'weights: as the plain ones; partition of unity, linear fields and their '// &
                            'gradients; none negative')
   end subroutine weights

   !> A cube along the axes: the slope along an axis is that of GIMP, exact for both; the weight is the mean
   !> at the two ends.
   subroutine cubes()
      type(corner_stencil_t) :: domains
      type(corner_weights_t) :: own
      type(cell_list_t) :: one
      real(wp) :: line(1, size(column, 2)), r(3), l, gimp(-1:1), ends(-1:1, 3), slope(-1:1, 3), off(3), &
                  differ, slopes(27, 3)
      integer :: a, axis, i, j, k, round, node
      off = 0.0_wp
      differ = 0.0_wp
      call one%reserve(1)
      do round = 1, 300
         r = chance%several(3, -0.5_wp, 0.5_wp)
         l = chance%between(0.05_wp, 0.5_wp)
         line = 0.0_wp
         line(1, layout%position:layout%position + 2) = frame%origin + (4 + r)*frame%cell
         line(1, layout%domain:layout%domain + 8:4) = l*frame%cell
         one%bin(1) = bin_of(line(1, layout%position:layout%position + 2), frame)
         call one%update_statistics(1)
         call set_corners(domains, one, 1, line, layout, frame)
         call set_corner_weights(own, domains, 1)
         slopes = corner_slopes(own, domains, 1, frame%per_cell)
         do axis = 1, 3
            call gimp_weights(r(axis), l, gimp(-1), gimp(0), gimp(1), slope(-1, axis), slope(1, axis))
            slope(0, axis) = -slope(-1, axis) - slope(1, axis)
            ends(:, axis) = [(0.5_wp*(hat(r(axis) - l - a) + hat(r(axis) + l - a)), a=-1, 1)]
            differ = max(differ, maxval(abs(ends(:, axis) - gimp)))
         end do
         do node = 1, 27
            i = mod(node - 1, 3) - 1
            j = mod((node - 1)/3, 3) - 1
            k = (node - 1)/9 - 1
            call keep_worst(off(1), own%weight(1, node) - ends(i, 1)*ends(j, 2)*ends(k, 3))
            call keep_worst(off(2), slopes(node, 1)*frame%cell - slope(i, 1)*ends(j, 2)*ends(k, 3))
            call keep_worst(off(3), slopes(node, 3)*frame%cell - ends(i, 1)*ends(j, 2)*slope(k, 3))
         end do
      end do
      call test%check_close(off, zero, 1.0e-13_wp, &
                            'a cube along the axes: slopes of GIMP, weights of its ends')
      call test%check(differ > 0.05_wp, 'and these weights are not those of GIMP')
   end subroutine cubes

   !> Where contact forces act (theory.md, eq. contact-face): half the thickness from the centre, or on a face
   !> of the domain that the weights see, never outside it; exactly on the face along an edge of a box.
   subroutine faces()
      type(corner_stencil_t) :: domains
      real(wp) :: values(size(column, 2)), normal(3), r(3, 3), span(3, 3), along(3), off(3), distance
      integer :: clipped, first, k, m
      off = 0.0_wp
      clipped = 0
      do first = 1, n, chunk
         call set_corners(domains, cells, first, column, layout, frame)
         do m = 1, domains%list%count
            values = column(domains%list%member(m), :)
            r = frame%cell*reshape(domains%half_edge(m, :), [3, 3])
            call keep_worst(off(1), maxval(abs(fitted_edges(values, layout, frame%cell) - r))*frame%per_cell)
            normal = chance%several(3, -1.0_wp, 1.0_wp)
            normal = normal/norm2(normal)
            call find_face(r, normal, norm2(matmul(normal, r)), distance, span)
            ! 1 is a face
            along = [(distance*dot_product(normal, domains%inverse(m, 3*k - 2:3*k))*frame%per_cell, k=1, 3)]
            call keep_worst(off(2), max(0.0_wp, maxval(abs(along)) - 1.0_wp))
            if (distance < norm2(matmul(normal, r))*(1.0_wp - 1.0e-12_wp)) then
               clipped = clipped + 1
               call keep_worst(off(3), maxval(abs(along)) - 1.0_wp)
            end if
         end do
      end do
      call test%check_close(off, zero, 1.0e-12_wp, &
                            'faces: edges as the weights see them, never outside, on a face where nearer')
      call test%check(clipped > n/10 .and. clipped < n, 'faces: some are nearer than half the thickness')
      values = column(1, :)
      values(layout%domain:layout%domain + 8) = frame%cell*[0.4_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.1_wp, 0.0_wp, &
                                                            0.0_wp, 0.0_wp, 0.25_wp]
      do k = 1, 3
         normal = 0.0_wp
         normal(k) = -1.0_wp
         r = fitted_edges(values, layout, frame%cell)
         call find_face(r, normal, norm2(matmul(normal, r)), distance, span)
         call test%check_close(distance, values(layout%domain + 4*(k - 1)), 1.0e-14_wp*frame%cell, &
                               'faces: a box along its edges')
      end do
   end subroutine faces

   pure real(wp) function hat(distance)
      real(wp), intent(in) :: distance !< in cells
      hat = max(0.0_wp, 1.0_wp - abs(distance))
   end function hat

   !> Mass, momentum, force with body forces, by plain sums.
   subroutine plain_to_nodes(with_body_force)
      logical, intent(in) :: with_body_force
      real(wp) :: weight, slope(3), s(6), sigma(3, 3), velocity(3)
      integer :: i, j, k, p
      plain = 0.0_wp
      do p = 1, n
         s = of(p, layout%stress, 6)
         sigma = reshape([s(1), s(6), s(5), s(6), s(2), s(4), s(5), s(4), s(3)], [3, 3])
         do k = 0, last
            do j = 0, last
               do i = 0, last
                  if (any(abs(of(p, layout%position, 3) - node_place(i, j, k)) > 1.5_wp*frame%cell)) cycle
                  call plain_corner_weights(p, node_place(i, j, k), weight, slope)
                  velocity = of(p, layout%velocity, 3) + matmul(reshape(of(p, layout%gradient, 9), [3, 3]), &
                                                                node_place(i, j, k) &
                                                                - of(p, layout%position, 3))
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

   subroutine to_nodes()
      real(wp) :: off(3), scale(3)
      integer :: q
      tile = 0.0_wp
      call p2g_corners(cells, column, layout, frame, tile)
      call plain_to_nodes(.false.)
      scale = [maxval(plain(1, :, :, :)), maxval(abs(plain(2:4, :, :, :))), maxval(abs(plain(5:7, :, :, :)))]
      off = [maxval(abs(tile(1, :, :, :) - plain(1, :, :, :))), &
             maxval(abs(tile(2:4, :, :, :) - plain(2:4, :, :, :))), &
             maxval(abs(tile(5:7, :, :, :) - plain(5:7, :, :, :)))]/scale
      call test%check_close(off, zero, 1.0e-13_wp, 'to nodes: as the plain sums')
      call test%check_close(sum(abs(tile(8, :, :, :))), 0.0_wp, 0.0_wp, 'the spare lane stays 0')
      call test%check_close(sum(tile(1, :, :, :)), sum(column(:n, layout%mass)), 1.0e-13_wp*n, 'total mass')
      do q = 1, 3
         off(q) = sum(tile(1 + q, :, :, :)) - sum(column(:n, layout%mass)*column(:n, layout%velocity + q - 1))
      end do
      call test%check_close(off, zero, 1.0e-13_wp*n, 'total momentum')
      call add_corners_body_force(cells, column, layout, frame, body_force, tile)
      call plain_to_nodes(.true.)
      call test%check_close(maxval(abs(tile(5:7, :, :, :) - plain(5:7, :, :, :)))/scale(3), 0.0_wp, &
                            1.0e-13_wp, 'body forces as the plain sums')
   end subroutine to_nodes

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

   subroutine to_particles()
      real(wp), parameter :: dt = 0.013_wp, flip = 0.7_wp
      real(wp), allocatable :: before(:, :)
      real(wp) :: off(3), velocity(3), acceleration(3), slopes(3, 3), weight, slope(3)
      integer :: a, i, j, k, p
      call fill_tile()
      before = column
      call g2p_corners(cells, tile, layout, frame, motion_t(dt, flip, layout%next_position), column, gradient)
      off = 0.0_wp
      do p = 1, n
         velocity = 0.0_wp
         acceleration = 0.0_wp
         slopes = 0.0_wp
         do k = 0, last
            do j = 0, last
               do i = 0, last
                  if (any(abs(of(p, layout%position, 3) - node_place(i, j, k)) > 1.5_wp*frame%cell)) cycle
                  call plain_corner_weights(p, node_place(i, j, k), weight, slope)
                  velocity = velocity + weight*tile(2:4, i, j, k)
                  acceleration = acceleration + weight*tile(5:7, i, j, k)
                  do a = 1, 3
                     slopes(:, a) = slopes(:, a) + slope(a)*tile(2:4, i, j, k)
                  end do
               end do
            end do
         end do
         call keep_worst(off(1), &
                         maxval(abs(of(p, layout%next_position, 3) &
                                    - (of(p, layout%position, 3) + dt*velocity))))
         call keep_worst(off(2), maxval(abs(of(p, layout%velocity, 3) - (1.0_wp - flip)*velocity &
                                           - flip*(before(p, layout%velocity:layout%velocity + 2) &
                                                   + dt*acceleration))))
         call keep_worst(off(3), maxval(abs(gradient(p, :) - reshape(slopes, [9])))*frame%cell)
      end do
      call test%check_close(off, zero, 2.0e-13_wp, 'to particles: as the plain sums')
      column(:, layout%velocity:layout%velocity + 2) = before(:, layout%velocity:layout%velocity + 2)
      column(:, layout%next_position:layout%next_position + 2) = before(:, &
         layout%next_position:layout%next_position + 2)
      call test%check(all(abs(column - before) <= 0.0_wp), &
                      'to particles: touches nothing else, nor what is beyond the count')
   end subroutine to_particles

   !> Power of the internal forces on any node velocities is minus that of the stresses on the gradients that
   !> particles take.
   subroutine adjoint()
      real(wp), allocatable :: forces(:, :, :, :)
      real(wp) :: nodes, particles, s(6)
      integer :: p
      tile = 0.0_wp
      call p2g_corners(cells, column, layout, frame, tile)
      forces = tile(5:7, :, :, :)
      call fill_tile()
      nodes = sum(forces*tile(2:4, :, :, :))
      call g2p_corners(cells, tile, layout, frame, motion_t(0.0_wp, 1.0_wp, layout%position), &
                       column, gradient)
      particles = 0.0_wp
      do p = 1, n
         s = of(p, layout%stress, 6)
         particles = particles + column(p, layout%volume) &
                     *sum(gradient(p, :)*[s(1), s(6), s(5), s(6), s(2), s(4), s(5), s(4), s(3)])
      end do
      call test%check_close(nodes + particles, 0.0_wp, 1.0e-12_wp*abs(particles), &
                            'to nodes and to particles are adjoint: the power balances')
   end subroutine adjoint

   !> v = a + B x, carried to the nodes and back, with affine transfer: nothing is lost.
   subroutine linear_field()
      real(wp) :: a(3), b(3, 3), off(3)
      integer :: i, j, k, p
      a = chance%several(3, -1.0_wp, 1.0_wp)
      b = reshape(chance%several(9, -1.0_wp, 1.0_wp), [3, 3])
      column(:, layout%stress:layout%stress + 5) = 0.0_wp
      do p = 1, n
         column(p, layout%velocity:layout%velocity + 2) = a + matmul(b, of(p, layout%position, 3))
         column(p, layout%gradient:layout%gradient + 8) = reshape(b, [9])
      end do
      tile = 0.0_wp
      call p2g_corners(cells, column, layout, frame, tile)
      call solve_nodes(tile, 0.1_wp)
      off = 0.0_wp
      do k = 0, last
         do j = 0, last
            do i = 0, last
               if (tile(1, i, j, k) <= 0.0_wp) cycle
               call keep_worst(off(1), maxval(abs(tile(2:4, i, j, k) - a - matmul(b, node_place(i, j, k)))))
            end do
         end do
      end do
      call g2p_corners(cells, tile, layout, frame, motion_t(0.0_wp, 0.0_wp, layout%next_position), &
                       column, gradient)
      do p = 1, n
         call keep_worst(off(2), &
                         maxval(abs(of(p, layout%velocity, 3) - a - matmul(b, of(p, layout%position, 3)))))
         call keep_worst(off(3), maxval(abs(gradient(p, :) - reshape(b, [9]))))
      end do
      call test%check_close(off, zero, 1.0e-12_wp, 'affine transfer keeps a linear velocity field')
   end subroutine linear_field

end program corners
