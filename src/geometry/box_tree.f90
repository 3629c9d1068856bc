!> Triangles in a tree of bounding boxes, to find the one nearest to a point. A box contains up to eight boxes
!> or up to eight triangles, which are processed together (one to a lane of the vector registers); boxes
!> further away than the nearest triangle so far are skipped.
module m_box_tree
   use m_kinds, only: wp
   use m_vectors, only: cross
   use m_triangles, only: triangles_t
   implicit none
   private
   public :: box_tree_t, foot_t

   integer, parameter :: lanes = 8    !< boxes or triangles in a box
   integer, parameter :: deepest = 80 !< boxes that may wait on the stack: seven a level
   real(wp), parameter :: nowhere = 1.0e100_wp !< m, position of unused boxes
   real(wp), parameter :: slack = 1.0_wp + 1.0e-9_wp !< squared distances computed in two ways differ by less

   !> Contents of a box: for each lane a box within it.
   type :: node_t
      real(wp) :: lower(lanes, 3) = nowhere, upper(lanes, 3) = -nowhere !< m
      integer :: inner(lanes) = 0 !< above 0: number of its node; below 0: minus the number of its leaf; 0:
                                  !< unused
   end type node_t

   !> The nearest point of a triangle.
   type :: foot_t
      real(wp) :: squared = huge(1.0_wp)/slack !< of its distance, m2
      real(wp) :: way(3) = 0.0_wp        !< vector from it to the given point, m
      integer :: place = 0               !< index of the triangle in the tree
      integer :: feature = 0             !< 0: inside the triangle; 1 to 3: on the edge from that corner to
                                         !< the next; 4 to 6: at a corner
   end type foot_t

   !> Leaves have one entry for each lane; an unused one repeats the triangle before it.
   type :: box_tree_t
      type(node_t), allocatable :: nodes(:)
      integer, allocatable :: number(:)       !< (entries): of the triangle
      integer, allocatable :: sheet(:)        !< (entries): of the triangle, for searches of one sheet
      real(wp), allocatable :: shape(:, :, :) !< (lanes, 13, leaves): its first corner, the vectors a and b to
                                              !< the others; inverses of a.a, b.b, (b-a).(b-a), |a x b|^2
   contains
      procedure :: build
      procedure :: nearest
      procedure :: look_at
   end type box_tree_t

contains

   !> Build the tree: halve by number along the longest axis of the midpoints, three times for the eight boxes
   !> of a node, until few triangles are left.
   subroutine build(self, triangles)
      class(box_tree_t), intent(inout) :: self
      type(triangles_t), intent(in) :: triangles
      real(wp), allocatable :: middle(:, :)
      integer, allocatable :: order(:)
      integer :: nodes, leaves, n, t
      n = triangles%count()
      allocate (middle(3, n), self%nodes(1 + n/2))
      allocate (self%shape(lanes, 13, 1 + n/2), self%number(lanes*(1 + n/2)))
      order = [(t, t=1, n)]
      do t = 1, n
         middle(:, t) = sum(triangles%corner(:, triangles%of(:, t)), dim=2)/3.0_wp
      end do
      nodes = 0
      leaves = 0
      call divide(1, n)
      self%nodes = self%nodes(:nodes)
      self%number = self%number(:lanes*leaves)
      self%shape = self%shape(:, :, :leaves)
   contains
      !> Make a node of the triangles order(first:last).
      recursive subroutine divide(first, last)
         integer, intent(in) :: first, last
         integer :: this, range(2, lanes), ranges, round, r
         nodes = nodes + 1
         this = nodes
         ranges = 1
         range(:, 1) = [first, last]
         do round = 1, 3
            do r = ranges, 1, -1
               associate (low => range(1, r), high => range(2, r))
                  if (high - low < lanes) cycle
                  ranges = ranges + 1
                  range(:, ranges) = [(low + high)/2 + 1, high]
                  call part(order, middle, longest_axis(order(low:high)), low, high, (low + high)/2)
                  high = (low + high)/2
               end associate
            end do
         end do
         do r = 1, ranges
            call bound(self%nodes(this), r, triangles, order(range(1, r):range(2, r)))
            if (range(2, r) - range(1, r) < lanes) then
               leaves = leaves + 1
               self%nodes(this)%inner(r) = -leaves
               call fill(self, leaves, triangles, order(range(1, r):range(2, r)))
            else
               self%nodes(this)%inner(r) = nodes + 1
               call divide(range(1, r), range(2, r))
            end if
         end do
      end subroutine divide

      pure integer function longest_axis(among) result(axis)
         integer, intent(in) :: among(:)
         axis = maxloc(maxval(middle(:, among), dim=2) - minval(middle(:, among), dim=2), dim=1)
      end function longest_axis
   end subroutine build

   !> Store the bounding box of some triangles in a lane of a node.
   subroutine bound(node, lane, triangles, among)
      type(node_t), intent(inout) :: node
      integer, intent(in) :: lane, among(:)
      type(triangles_t), intent(in) :: triangles
      integer :: c, k
      do c = 1, size(among)
         do k = 1, 3
            associate (x => triangles%corner(k, triangles%of(:, among(c))))
               node%lower(lane, k) = min(node%lower(lane, k), minval(x))
               node%upper(lane, k) = max(node%upper(lane, k), maxval(x))
            end associate
         end do
      end do
   end subroutine bound

   !> Store up to eight triangles as a leaf.
   subroutine fill(self, leaf, triangles, among)
      class(box_tree_t), intent(inout) :: self
      integer, intent(in) :: leaf, among(:)
      type(triangles_t), intent(in) :: triangles
      real(wp) :: a(3), b(3)
      integer :: lane, number
      do lane = 1, lanes
         number = among(min(lane, size(among)))
         self%number(lanes*(leaf - 1) + lane) = number
         associate (corners => triangles%corner(:, triangles%of(:, number)))
            a = corners(:, 2) - corners(:, 1)
            b = corners(:, 3) - corners(:, 1)
            self%shape(lane, :, leaf) = [corners(:, 1), a, b, inverse(sum(a**2)), inverse(sum(b**2)), &
                                         inverse(sum((b - a)**2)), inverse(sum(cross(a, b)**2))]
         end associate
      end do
   end subroutine fill

   pure real(wp) function inverse(value)
      real(wp), intent(in) :: value
      inverse = 0.0_wp
      if (value > 0.0_wp) inverse = 1.0_wp/value
   end function inverse

   !> Reorder numbers first..last so that those with the lowest keys come first, up to index `half`
   !> (quickselect; ties by number, so that the order is always the same).
   pure subroutine part(number, key, axis, first, last, half)
      integer, intent(inout) :: number(:)
      real(wp), intent(in) :: key(:, :) !< (axes, numbers)
      integer, intent(in) :: axis, first, last, half
      integer :: low, high, i, j, pivot, swapped
      low = first
      high = last
      do while (low < high)
         pivot = number((low + high)/2)
         i = low
         j = high
         do while (i <= j)
            do while (before(number(i), pivot))
               i = i + 1
            end do
            do while (before(pivot, number(j)))
               j = j - 1
            end do
            if (i > j) exit
            swapped = number(i)
            number(i) = number(j)
            number(j) = swapped
            i = i + 1
            j = j - 1
         end do
         if (half <= j) then
            high = j
         else if (half >= i) then
            low = i
         else
            return
         end if
      end do
   contains
      pure logical function before(a, b)
         integer, intent(in) :: a, b
         before = key(axis, a) < key(axis, b) .or. (key(axis, a) <= key(axis, b) .and. a < b)
      end function before
   end subroutine part

   !> The nearest point of all triangles, or of those of a sheet. `foot` may contain a point or a distance as
   !> a start.
   pure subroutine nearest(self, place, foot, sheet)
      class(box_tree_t), intent(in) :: self
      real(wp), intent(in) :: place(3) !< m
      type(foot_t), intent(inout) :: foot
      integer, intent(in), optional :: sheet
      real(wp) :: waits(deepest), ways(lanes)
      integer :: stack(deepest), top, base, lane, at, next
      top = 1
      stack(1) = 1
      waits(1) = 0.0_wp
      do while (top > 0)
         next = stack(top)
         if (waits(top) >= foot%squared) next = 0
         top = top - 1
         if (next == 0) cycle
         if (next < 0) then
            ways = squared_to_triangles(self%shape(:, :, -next), place)
            do lane = 1, lanes
               if (ways(lane) >= slack*foot%squared) cycle
               if (present(sheet)) then
                  if (self%sheet(lanes*(-next - 1) + lane) /= sheet) cycle
               end if
               call self%look_at(lanes*(-next - 1) + lane, place, foot)
            end do
            cycle
         end if
         ways = squared_to_boxes(self%nodes(next)%lower, self%nodes(next)%upper, place)
         base = top
         do lane = 1, lanes ! push the nearest one last, so that it is on top
            if (ways(lane) >= foot%squared) cycle
            top = top + 1
            at = top
            do while (at > base + 1)
               if (waits(at - 1) >= ways(lane)) exit
               waits(at) = waits(at - 1)
               stack(at) = stack(at - 1)
               at = at - 1
            end do
            waits(at) = ways(lane)
            stack(at) = self%nodes(next)%inner(lane)
         end do
      end do
   end subroutine nearest

   !> Squared distances to the boxes of a node, 0 inside, m2.
   pure function squared_to_boxes(lower, upper, place) result(squared)
      real(wp), intent(in) :: lower(lanes, 3), upper(lanes, 3), place(3)
      real(wp) :: squared(lanes)
      integer :: i
      !$omp simd
      do i = 1, lanes
         squared(i) = max(lower(i, 1) - place(1), place(1) - upper(i, 1), 0.0_wp)**2 &
                      + max(lower(i, 2) - place(2), place(2) - upper(i, 2), 0.0_wp)**2 &
                      + max(lower(i, 3) - place(3), place(3) - upper(i, 3), 0.0_wp)**2
      end do
   end function squared_to_boxes

   !> Squared distances to the triangles of a leaf, m2: to the plane where its nearest point is inside, else
   !> to the nearest edge. Equal up to round-off to those of look_at, which also finds point and feature.
   pure function squared_to_triangles(shape, place) result(squared)
      real(wp), intent(in) :: shape(lanes, 13), place(3)
      real(wp) :: squared(lanes)
      real(wp) :: px, py, pz, ap, bp, aa, ab, bb, u, v, t, edge, face
      integer :: i
      !$omp simd private(px, py, pz, ap, bp, aa, ab, bb, u, v, t, edge, face)
      do i = 1, lanes
         px = place(1) - shape(i, 1)
         py = place(2) - shape(i, 2)
         pz = place(3) - shape(i, 3)
         ap = px*shape(i, 4) + py*shape(i, 5) + pz*shape(i, 6)
         bp = px*shape(i, 7) + py*shape(i, 8) + pz*shape(i, 9)
         aa = shape(i, 4)**2 + shape(i, 5)**2 + shape(i, 6)**2
         ab = shape(i, 4)*shape(i, 7) + shape(i, 5)*shape(i, 8) + shape(i, 6)*shape(i, 9)
         bb = shape(i, 7)**2 + shape(i, 8)**2 + shape(i, 9)**2
         t = min(1.0_wp, max(0.0_wp, ap*shape(i, 10)))
         edge = (px - t*shape(i, 4))**2 + (py - t*shape(i, 5))**2 + (pz - t*shape(i, 6))**2
         t = min(1.0_wp, max(0.0_wp, bp*shape(i, 11)))
         edge = min(edge, (px - t*shape(i, 7))**2 + (py - t*shape(i, 8))**2 + (pz - t*shape(i, 9))**2)
         t = min(1.0_wp, max(0.0_wp, (bp - ap + aa - ab)*shape(i, 12))) ! from the second corner to the third
         edge = min(edge, (px - (1.0_wp - t)*shape(i, 4) - t*shape(i, 7))**2 &
                          + (py - (1.0_wp - t)*shape(i, 5) - t*shape(i, 8))**2 &
                          + (pz - (1.0_wp - t)*shape(i, 6) - t*shape(i, 9))**2)
         u = (bb*ap - ab*bp)*shape(i, 13)
         v = (aa*bp - ab*ap)*shape(i, 13)
         face = (px - u*shape(i, 4) - v*shape(i, 7))**2 + (py - u*shape(i, 5) - v*shape(i, 8))**2 &
                + (pz - u*shape(i, 6) - v*shape(i, 9))**2
         squared(i) = merge(face, edge, min(u, v, 1.0_wp - u - v) > 0.0_wp)
      end do
   end function squared_to_triangles

   !> Replace `foot` by the nearest point of one triangle, given by its index in the tree, if that is nearer
   !> (Ericson, Real-Time Collision Detection, 2005, 5.1.5).
   pure subroutine look_at(self, t, place, foot)
      class(box_tree_t), intent(in) :: self
      integer, intent(in) :: t
      real(wp), intent(in) :: place(3)
      type(foot_t), intent(inout) :: foot
      real(wp) :: ab(3), ac(3), ap(3), d1, d2, d3, d4, d5, d6, va, vb, vc, u, v, way(3), squared
      integer :: feature
      associate (leaf => 1 + (t - 1)/lanes, lane => 1 + mod(t - 1, lanes))
         ap = place - self%shape(lane, 1:3, leaf)
         ab = self%shape(lane, 4:6, leaf)
         ac = self%shape(lane, 7:9, leaf)
      end associate
      d1 = dot_product(ab, ap)
      d2 = dot_product(ac, ap)
      d3 = d1 - dot_product(ab, ab)
      d4 = d2 - dot_product(ac, ab)
      d5 = d1 - dot_product(ab, ac)
      d6 = d2 - dot_product(ac, ac)
      vc = d1*d4 - d3*d2
      vb = d5*d2 - d1*d6
      va = d3*d6 - d5*d4
      u = 0.0_wp
      v = 0.0_wp
      if (d1 <= 0.0_wp .and. d2 <= 0.0_wp) then
         feature = 4
      else if (d3 >= 0.0_wp .and. d4 <= d3) then
         feature = 5
         u = 1.0_wp
      else if (vc <= 0.0_wp .and. d1 >= 0.0_wp .and. d3 <= 0.0_wp) then
         feature = 1
         u = d1/(d1 - d3)
      else if (d6 >= 0.0_wp .and. d5 <= d6) then
         feature = 6
         v = 1.0_wp
      else if (vb <= 0.0_wp .and. d2 >= 0.0_wp .and. d6 <= 0.0_wp) then
         feature = 3
         v = d2/(d2 - d6)
      else if (va <= 0.0_wp .and. d4 - d3 >= 0.0_wp .and. d5 - d6 >= 0.0_wp) then
         feature = 2
         v = (d4 - d3)/((d4 - d3) + (d5 - d6))
         u = 1.0_wp - v
      else
         feature = 0
         u = vb/(va + vb + vc)
         v = vc/(va + vb + vc)
      end if
      way = ap - u*ab - v*ac
      squared = dot_product(way, way)
      if (.not. squared < foot%squared) return
      foot = foot_t(squared, way, t, feature)
   end subroutine look_at

end module m_box_tree
