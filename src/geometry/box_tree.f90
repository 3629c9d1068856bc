!> Triangles in a tree of boxes: which of them is nearest to a place. A box holds all triangles below it; what
!> is further away than the nearest triangle yet is not looked into.
module m_box_tree
   use m_kinds, only: wp
   use m_triangles, only: triangles_t
   implicit none
   private
   public :: box_tree_t, foot_t

   integer, parameter :: in_leaf = 4  !< triangles of a box that is not divided further
   integer, parameter :: deepest = 64 !< boxes that wait while others are looked into

   !> A box: divided in two, of which the first is the next one; or with triangles, places first to last.
   type :: box_t
      real(wp) :: lower(3), upper(3) !< m
      integer :: second = 0          !< number of the second half; 0: not divided
      integer :: first = 0, last = 0
   end type box_t

   !> The nearest point of a triangle.
   type :: foot_t
      real(wp) :: squared = huge(1.0_wp) !< of its distance, m2
      real(wp) :: way(3) = 0.0_wp        !< from it to the place, m
      integer :: place = 0               !< of the triangle in the tree
      integer :: feature = 0             !< 0: inside the triangle; 1 to 3: on the edge from that corner to the
                                         !< next; 4 to 6: at a corner
   end type foot_t

   type :: box_tree_t
      type(box_t), allocatable :: boxes(:)
      integer, allocatable :: number(:)     !< (places): of the triangle
      real(wp), allocatable :: shape(:, :)  !< (9, places): its first corner and the ways to the two others
   contains
      procedure :: build
      procedure :: nearest
      procedure :: look_at
      procedure :: bytes
   end type box_tree_t

contains

   !> Halve by number along the longest axis of the middles, until few are left.
   subroutine build(self, triangles)
      class(box_tree_t), intent(inout) :: self
      type(triangles_t), intent(in) :: triangles
      real(wp), allocatable :: middle(:, :)
      integer :: boxes, n, t
      n = triangles%count()
      allocate (middle(3, n), self%boxes(2*n), self%shape(9, n))
      self%number = [(t, t=1, n)]
      do t = 1, n
         middle(:, t) = sum(triangles%corner(:, triangles%of(:, t)), dim=2)/3.0_wp
      end do
      boxes = 0
      call divide(1, n)
      self%boxes = self%boxes(:boxes)
      do t = 1, n
         associate (corners => triangles%corner(:, triangles%of(:, self%number(t))))
            self%shape(:, t) = [corners(:, 1), corners(:, 2) - corners(:, 1), corners(:, 3) - corners(:, 1)]
         end associate
      end do
   contains
      recursive subroutine divide(first, last)
         integer, intent(in) :: first, last
         real(wp) :: low(3), high(3)
         integer :: this, axis, half, c
         boxes = boxes + 1
         this = boxes
         low = huge(low)
         high = -huge(high)
         do c = first, last
            low = min(low, minval(triangles%corner(:, triangles%of(:, self%number(c))), dim=2))
            high = max(high, maxval(triangles%corner(:, triangles%of(:, self%number(c))), dim=2))
         end do
         self%boxes(this)%lower = low
         self%boxes(this)%upper = high
         if (last - first < in_leaf) then
            self%boxes(this)%first = first
            self%boxes(this)%last = last
            return
         end if
         low = huge(low)
         high = -huge(high)
         do c = first, last
            low = min(low, middle(:, self%number(c)))
            high = max(high, middle(:, self%number(c)))
         end do
         axis = maxloc(high - low, dim=1)
         half = (first + last)/2
         call part(self%number, middle, axis, first, last, half)
         call divide(first, half)
         self%boxes(this)%second = boxes + 1
         call divide(half + 1, last)
      end subroutine divide
   end subroutine build

   !> Reorder numbers first..last so that those with the lowest keys come first, up to place `half`
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

   !> The nearest point of all triangles. `foot` may hold one already, as a start.
   pure subroutine nearest(self, place, foot)
      class(box_tree_t), intent(in) :: self
      real(wp), intent(in) :: place(3) !< m
      type(foot_t), intent(inout) :: foot
      real(wp) :: waits(deepest), way, ways(2)
      integer :: box, halves(2), stack(deepest), top, h, t
      top = 1
      stack(1) = 1
      waits(1) = squared_to(self%boxes(1), place)
      do while (top > 0)
         box = stack(top)
         way = waits(top)
         top = top - 1
         if (way >= foot%squared) cycle
         if (self%boxes(box)%second == 0) then
            do t = self%boxes(box)%first, self%boxes(box)%last
               call self%look_at(t, place, foot)
            end do
            cycle
         end if
         halves = [box + 1, self%boxes(box)%second]
         ways = [squared_to(self%boxes(halves(1)), place), squared_to(self%boxes(halves(2)), place)]
         if (ways(1) < ways(2)) then ! the nearer one on top
            halves = halves([2, 1])
            ways = ways([2, 1])
         end if
         do h = 1, 2
            if (ways(h) >= foot%squared) cycle
            top = top + 1
            stack(top) = halves(h)
            waits(top) = ways(h)
         end do
      end do
   end subroutine nearest

   !> Squared distance to a box, 0 inside, m2.
   pure real(wp) function squared_to(box, place)
      type(box_t), intent(in) :: box
      real(wp), intent(in) :: place(3)
      squared_to = max(box%lower(1) - place(1), place(1) - box%upper(1), 0.0_wp)**2 &
                   + max(box%lower(2) - place(2), place(2) - box%upper(2), 0.0_wp)**2 &
                   + max(box%lower(3) - place(3), place(3) - box%upper(3), 0.0_wp)**2
   end function squared_to

   !> Take the nearest point of one triangle, by its place in the tree, if it is nearer than `foot` (Ericson,
   !> Real-Time Collision Detection, 2005, 5.1.5).
   pure subroutine look_at(self, t, place, foot)
      class(box_tree_t), intent(in) :: self
      integer, intent(in) :: t
      real(wp), intent(in) :: place(3)
      type(foot_t), intent(inout) :: foot
      real(wp) :: ab(3), ac(3), ap(3), d1, d2, d3, d4, d5, d6, va, vb, vc, u, v, way(3), squared
      integer :: feature
      ab = self%shape(4:6, t)
      ac = self%shape(7:9, t)
      ap = place - self%shape(1:3, t)
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

   !> Memory, bytes.
   pure integer function bytes(self)
      class(box_tree_t), intent(in) :: self
      bytes = 64*size(self%boxes) + 76*size(self%number)
   end function bytes

end module m_box_tree
