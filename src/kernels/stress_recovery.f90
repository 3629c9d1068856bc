!> Recovered stress (theory.md, eq. recovered): stresses of particles, weighted by volume, are averaged at
!> their nodes; at a particle a linear function fitted to the nodes' means is evaluated, with the weights of
!> the step. A node's mean is placed at the mean position of its contributions, not at the node: next to a
!> free surface that is half a cell away. Nodes there use even weights (eq. even): the same for all that is in
!> a cell.
module m_stress_recovery
   use m_kinds, only: wp
   use m_vectors, only: cross
   use m_node_values, only: node_values, tile_last
   use m_field_table, only: layout_t
   use m_cell_list, only: cell_list_t
   use m_stencil, only: stencil_t, frame_t, batch, chunk, set_stencil, set_places
   use m_corner_stencil, only: corner_stencil_t, corner_weights_t, set_corners, set_corner_weights
   implicit none
   private
   public :: give_stress, take_stress, make_means, mix_means

   real(wp), parameter :: damping = 1.0e-3_wp !< square of the spread of a body along an axis, in cells, below
                                              !< which its gradient along it does not count: zero in a sheet
                                              !< of one particle

   !> The weights of a chunk of particles on the 27 nodes around each of them, for any kind of domain.
   type :: shares_t
      type(stencil_t) :: stencil
      type(corner_stencil_t) :: corners
      type(corner_weights_t) :: weights
      integer :: count = 0, member(chunk) = 0
      integer :: place(3, chunk) = 0     !< lowest of the 27 nodes in the tile
      real(wp) :: offset(3, chunk) = 0.0_wp !< of the particle from the nearest node, cells
      real(wp) :: share(27, chunk) = 0.0_wp !< x fastest
      real(wp) :: slope(3, 27, chunk) = 0.0_wp !< derivatives of the weights: along the axes, 1/m; of
                                               !< parallelepipeds the differences along the half edges
      logical :: turns = .false.               !< the second: `turn` converts them to derivatives along axes
      real(wp) :: turn(3, 3, chunk) = 0.0_wp   !< 1/m, by half edge and axis
   end type shares_t

contains

   !> Set a block's tiles to the contributions of its own particles: volume (m3) and volume times their
   !> position from the node (m4); volume and volume times stress (J).
   subroutine give_stress(cells, column, layout, frame, sides, even, places, stresses)
      type(cell_list_t), intent(in) :: cells !< lists the particles to traverse
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      type(frame_t), intent(in) :: frame
      integer, intent(in) :: sides(2, 3) !< planes of nodes at sides of the grid, in the tile; -1: none
      logical, intent(in) :: even        !< with even weights in place of those of the step
      real(wp), intent(out), dimension(node_values, 0:tile_last, 0:tile_last, 0:tile_last) :: places, stresses
      type(shares_t) :: shares
      real(wp) :: from(node_values), given(node_values) !< all values of a node, which is one vector
      real(wp) :: node(node_values, 27), volume
      integer :: first, m, p
      node = places_of_nodes(frame%cell)
      places = 0.0_wp
      stresses = 0.0_wp
      from = 0.0_wp
      given = 0.0_wp
      do first = 1, cells%count, chunk
         call set_shares(shares, cells, first, column, layout, frame, .false.)
         do m = 1, shares%count
            p = shares%member(m)
            volume = column(p, layout%volume)
            if (even) shares%share(:, m) = &
               even_weights(shares%offset(:, m), frame%per_cell*extent_of(column, p, layout), &
                            layout%section%is_flat())
            call even_out(sides, shares%place(:, m), shares%offset(:, m), shares%share(:, m))
            from(1) = 1.0_wp
            from(2:4) = frame%cell*shares%offset(:, m)
            given(1) = 1.0_wp
            given(2:7) = column(p, layout%stress:layout%stress + 5)
            call give_to_nodes(volume, from, node, given, shares%share(:, m), shares%place(:, m), places, &
                               stresses)
         end do
      end do
   end subroutine give_stress

   !> Add the contributions of one particle to its 27 nodes, one lane a node value.
   pure subroutine give_to_nodes(volume, from, node, given, share, place, places, stresses)
      real(wp), intent(in) :: volume                              !< m3
      real(wp), intent(in), dimension(node_values) :: from, given !< 1 and position, m; 1 and stress, Pa
      real(wp), intent(in) :: node(node_values, 27)               !< 0 and positions of the nodes, m
      real(wp), intent(in) :: share(27)
      integer, intent(in) :: place(3)                             !< lowest of the nodes
      real(wp), intent(inout), dimension(node_values, 0:tile_last, 0:tile_last, 0:tile_last) :: places, &
         stresses
      real(wp) :: part
      integer :: i, j, k, n, q
      n = 0
      do k = place(3), place(3) + 2
         do j = place(2), place(2) + 2
            do i = place(1), place(1) + 2
               n = n + 1
               part = volume*share(n)
               !$omp simd
               do q = 1, node_values
                  places(q, i, j, k) = places(q, i, j, k) + part*(from(q) - node(q, n))
                  stresses(q, i, j, k) = stresses(q, i, j, k) + part*given(q)
               end do
            end do
         end do
      end do
   end subroutine give_to_nodes

   !> The positions of the 27 nodes relative to the nearest node, m, stored in the components of a node's
   !> position.
   pure function places_of_nodes(cell) result(node)
      real(wp), intent(in) :: cell !< m
      real(wp) :: node(node_values, 27)
      integer :: n
      node = 0.0_wp
      do n = 0, 26
         node(2:4, n + 1) = cell*([mod(n, 3), mod(n/3, 3), n/9] - 1)
      end do
   end function places_of_nodes

   !> Nodes on a side of the grid get the full weight of particles in the cell beside it: a pattern that
   !> alternates within a cell has no other cell there to average it out.
   pure subroutine even_out(sides, place, offset, share)
      integer, intent(in) :: sides(2, 3), place(3) !< planes; lowest of the 27 nodes
      real(wp), intent(in) :: offset(3)            !< cells from the nearest node
      real(wp), intent(inout) :: share(0:26)       !< x fastest
      integer, parameter :: stride(3) = [1, 3, 9]
      integer :: axis, b, c, first, layer, side
      do axis = 1, 3
         do side = 1, 2
            layer = sides(side, axis) - place(axis)
            if (sides(side, axis) < 0 .or. layer < 0 .or. layer > 2) cycle
            if ((3 - 2*side)*(1.0_wp + offset(axis) - layer) >= 1.0_wp) cycle ! in another cell
            do c = 0, 2
               do b = 0, 2
                  first = b*stride(1 + mod(axis, 3)) + c*stride(1 + mod(axis + 1, 3))
                  share(first + layer*stride(axis)) = sum(share(first:first + 2*stride(axis):stride(axis)))
               end do
            end do
         end do
      end do
   end subroutine even_out

   !> Half size of the box around a particle's domain, m: `extents` of m_half_edges, which reads all columns.
   pure function extent_of(column, p, layout) result(extent)
      real(wp), intent(in), contiguous :: column(:, :)
      integer, intent(in) :: p
      type(layout_t), intent(in) :: layout
      real(wp) :: extent(3)
      if (layout%domain > 0) then
         associate (d => layout%domain)
            extent = abs(column(p, d:d + 2)) + abs(column(p, d + 3:d + 5)) + abs(column(p, d + 6:d + 8))
         end associate
      else if (layout%half_sizes) then
         extent = column(p, layout%half_size:layout%half_size + 2)
      else
         extent = column(p, layout%half_size)
      end if
   end function extent_of

   !> Weights that are the same for all parts of a cell (theory.md, eq. even): of the part of a particle in a
   !> cell every node of that cell gets as much. What alternates between the particles of a cell thus has no
   !> part in a mean over it.
   pure function even_weights(offset, extent, flat) result(share)
      real(wp), intent(in) :: offset(3) !< of the particle from the nearest node, cells
      real(wp), intent(in) :: extent(3) !< half size of the box around its domain, cells
      logical, intent(in) :: flat       !< of a section: all on its plane
      real(wp) :: share(0:26)           !< x fastest
      real(wp) :: along(-1:1, 3), above(3)
      integer :: n
      above = min(max((offset + extent)/(2.0_wp*extent), 0.0_wp), 1.0_wp) ! part in the cells above the node
      along(-1, :) = 0.5_wp*(1.0_wp - above)
      along(0, :) = 0.5_wp
      along(1, :) = 0.5_wp*above
      if (flat) along(:, 2) = [0.0_wp, 1.0_wp, 0.0_wp]
      do n = 0, 26
         share(n) = along(mod(n, 3) - 1, 1)*along(mod(n/3, 3) - 1, 2)*along(n/9 - 1, 3)
      end do
   end function even_weights

   !> The recovered stress (Pa) of the traversed particles, from the nodes' means.
   subroutine take_stress(cells, column, layout, frame, places, stresses, stress)
      type(cell_list_t), intent(in) :: cells
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      type(frame_t), intent(in) :: frame
      real(wp), intent(in), dimension(node_values, 0:tile_last, 0:tile_last, 0:tile_last) :: places, stresses
      real(wp), intent(inout) :: stress(:, :) !< (6, particles), in storage order
      type(shares_t) :: shares
      real(wp), dimension(node_values, 0:3) :: mean, from
      integer :: first, m
      do first = 1, cells%count, chunk
         call set_shares(shares, cells, first, column, layout, frame, .true.)
         do m = 1, shares%count
            associate (share => shares%share(:, m), slope => shares%slope(:, :, m), &
                       place => shares%place(:, m))
               call take_from_nodes(share, slope, place, stresses, mean)
               call take_from_nodes(share, slope, place, places, from)
            end associate
            if (shares%turns) call turn_slopes(shares%turn(:, :, m), mean)
            if (shares%turns) call turn_slopes(shares%turn(:, :, m), from)
            from(2, 1) = from(2, 1) + 1.0_wp
            from(3, 2) = from(3, 2) + 1.0_wp
            from(4, 3) = from(4, 3) + 1.0_wp
            stress(:, shares%member(m)) = mean(2:7, 0) - matmul(mean(2:7, 1:), &
                                                               least_squares(from(2:4, 1:), from(2:4, 0)))
         end do
      end do
   end subroutine take_stress

   !> Convert differences along the half edges of a particle's domain to derivatives along the axes.
   pure subroutine turn_slopes(turn, taken)
      real(wp), intent(in) :: turn(3, 3)
      real(wp), intent(inout) :: taken(node_values, 0:3)
      real(wp) :: x, y, z
      integer :: q
      !$omp simd private(x, y, z)
      do q = 1, node_values
         x = taken(q, 1)
         y = taken(q, 2)
         z = taken(q, 3)
         taken(q, 1) = turn(1, 1)*x + turn(2, 1)*y + turn(3, 1)*z
         taken(q, 2) = turn(1, 2)*x + turn(2, 2)*y + turn(3, 2)*z
         taken(q, 3) = turn(1, 3)*x + turn(2, 3)*y + turn(3, 3)*z
      end do
   end subroutine turn_slopes

   !> Sum the values of the 27 nodes at one particle, one lane a value, with the weights and their
   !> derivatives.
   pure subroutine take_from_nodes(share, slope, place, tile, taken)
      real(wp), intent(in) :: share(27), slope(3, 27)
      integer, intent(in) :: place(3) !< lowest of the nodes
      real(wp), intent(in) :: tile(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      real(wp), intent(out) :: taken(node_values, 0:3)
      real(wp) :: value, x, y, z, node
      integer :: b, c, n, q
      !$omp simd private(value, x, y, z, node, b, c, n)
      do q = 1, node_values
         value = 0.0_wp
         x = 0.0_wp
         y = 0.0_wp
         z = 0.0_wp
         !GCC$ unroll 1
         do c = 0, 2
            do b = 0, 2
               do n = 1, 3
                  node = tile(q, place(1) + n - 1, place(2) + b, place(3) + c)
                  value = value + share(n + 3*(b + 3*c))*node
                  x = x + slope(1, n + 3*(b + 3*c))*node
                  y = y + slope(2, n + 3*(b + 3*c))*node
                  z = z + slope(3, n + 3*(b + 3*c))*node
               end do
            end do
         end do
         taken(q, 0) = value
         taken(q, 1) = x
         taken(q, 2) = y
         taken(q, 3) = z
      end do
   end subroutine take_from_nodes

   !> Convert sums over all contributions to a node to means; the volume is kept.
   pure subroutine make_means(tile)
      real(wp), intent(inout) :: tile(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      integer :: i, j, k
      do k = 0, tile_last
         do j = 0, tile_last
            do i = 0, tile_last
               if (tile(1, i, j, k) > 0.0_wp) tile(2:7, i, j, k) = tile(2:7, i, j, k)/tile(1, i, j, k)
            end do
         end do
      end do
   end subroutine make_means

   !> Add to means the part `share` of those with even weights, and take as much of the others.
   pure subroutine mix_means(share, even, tile)
      real(wp), intent(in) :: share(0:tile_last, 0:tile_last, 0:tile_last)
      real(wp), intent(in) :: even(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      real(wp), intent(inout) :: tile(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      integer :: i, j, k
      do k = 0, tile_last
         do j = 0, tile_last
            do i = 0, tile_last
               if (.not. (share(i, j, k) > 0.0_wp .and. even(1, i, j, k) > 0.0_wp)) cycle
               tile(2:7, i, j, k) = tile(2:7, i, j, k) &
                                    + share(i, j, k)*(even(2:7, i, j, k) - tile(2:7, i, j, k))
            end do
         end do
      end do
   end subroutine mix_means

   !> x that minimises |A x - b|^2 + damping |x|^2.
   pure function least_squares(a, b) result(x)
      real(wp), intent(in) :: a(3, 3), b(3)
      real(wp) :: x(3), normal(3, 3), right(3)
      normal = matmul(transpose(a), a)
      normal = normal + damping*reshape([1, 0, 0, 0, 1, 0, 0, 0, 1], [3, 3])
      right = matmul(transpose(a), b)
      x = [dot_product(right, cross(normal(:, 2), normal(:, 3))), &
           dot_product(normal(:, 1), cross(right, normal(:, 3))), &
           dot_product(normal(:, 1), cross(normal(:, 2), right))]
      x = x/dot_product(normal(:, 1), cross(normal(:, 2), normal(:, 3)))
   end function least_squares

   !> Weights of the particles from position `first` of the list on, and their derivatives where wanted.
   subroutine set_shares(shares, cells, first, column, layout, frame, slopes)
      type(shares_t), intent(inout) :: shares
      type(cell_list_t), intent(in) :: cells
      integer, intent(in) :: first
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      type(frame_t), intent(in) :: frame
      logical, intent(in) :: slopes
      shares%turns = layout%domain > 0
      if (shares%turns) then
         call set_corner_shares(shares, cells, first, column, layout, frame, slopes)
      else
         call set_box_shares(shares, cells, first, column, layout, frame)
      end if
   end subroutine set_shares

   !> The same for parallelepipeds.
   subroutine set_corner_shares(shares, cells, first, column, layout, frame, slopes)
      type(shares_t), intent(inout) :: shares
      type(cell_list_t), intent(in) :: cells
      integer, intent(in) :: first
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      type(frame_t), intent(in) :: frame
      logical, intent(in) :: slopes
      integer :: axis, k, m, n, p
      call set_corners(shares%corners, cells, first, column, layout, frame)
      shares%count = shares%corners%list%count
      shares%member = shares%corners%list%member
      call set_places(shares%corners%list, shares%place)
      do m = 1, shares%count
         p = 1 + mod(m - 1, batch)
         if (p == 1) call set_corner_weights(shares%weights, shares%corners, m)
         shares%offset(:, m) = shares%corners%list%offset(m, :)
         shares%share(:, m) = shares%weights%weight(p, :)
         if (.not. slopes) cycle
         do n = 1, 27
            do k = 1, 3
               shares%slope(k, n, m) = shares%weights%along(p, n, k)
            end do
         end do
         do axis = 1, 3
            do k = 1, 3
               shares%turn(k, axis, m) = frame%per_cell*shares%corners%inverse(m, 3*(k - 1) + axis)
            end do
         end do
      end do
      if (layout%section%is_flat()) shares%turn(:, 2, :) = 0.0_wp ! no gradient across it
   end subroutine set_corner_shares

   !> The same for boxes along the axes.
   subroutine set_box_shares(shares, cells, first, column, layout, frame)
      type(shares_t), intent(inout) :: shares
      type(cell_list_t), intent(in) :: cells
      integer, intent(in) :: first
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      type(frame_t), intent(in) :: frame
      integer :: a, b, c, m, n, r
      call set_stencil(shares%stencil, cells, first, column, layout, frame)
      associate (w => shares%stencil%weight, s => shares%stencil%slope, stencil => shares%stencil)
         shares%count = stencil%count
         shares%member = stencil%member
         do r = 1, stencil%runs
            do m = stencil%run_first(r), stencil%run_first(r + 1) - 1
               shares%place(:, m) = stencil%run_place(:, r)
               shares%offset(:, m) = stencil%offset(m, :)
               do c = -1, 1
                  do b = -1, 1
                     do a = -1, 1
                        n = 14 + a + 3*(b + 3*c)
                        shares%share(n, m) = w(m, a, 1)*w(m, b, 2)*w(m, c, 3)
                        shares%slope(:, n, m) = [s(m, a, 1)*w(m, b, 2)*w(m, c, 3), &
                                                 w(m, a, 1)*s(m, b, 2)*w(m, c, 3), &
                                                 w(m, a, 1)*w(m, b, 2)*s(m, c, 3)]
                     end do
                  end do
               end do
            end do
         end do
      end associate
      if (layout%section%is_flat()) shares%slope(2, :, :shares%count) = 0.0_wp
   end subroutine set_box_shares

end module m_stress_recovery
