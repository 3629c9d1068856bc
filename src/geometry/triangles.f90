!> A closed surface of triangles: unique corners, adjacency of triangles, and the normals that distinguish
!> inside from outside (theory.md, eq. pseudonormal).
module m_triangles
   use m_kinds, only: wp, i8
   use m_number_text, only: reals_text
   use m_text, only: to_text
   use m_vectors, only: cross
   implicit none
   private
   public :: triangles_t, weld, weld_near

   integer, parameter, public :: corner_after(3) = [2, 3, 1] !< the next corner of a triangle
   real(wp), parameter :: flat = 1.0e-13_wp !< height over longest edge of a triangle that has no area

   type :: triangles_t
      real(wp), allocatable :: corner(:, :)        !< (3, corners), m
      integer, allocatable :: of(:, :)             !< (3, triangles): their corners, counter-clockwise from
                                                   !< outside
      integer, allocatable :: beside(:, :)         !< (3, triangles): the triangle on the other side of each
                                                   !< edge
      real(wp), allocatable :: face_normal(:, :)   !< (3, triangles), unit vectors outward
      real(wp), allocatable :: edge_normal(:, :, :) !< (3, 3, triangles): of the edge from each corner to the
                                                   !< next, of any length
      real(wp), allocatable :: corner_normal(:, :) !< (3, corners), of any length
   contains
      procedure :: count => triangle_count
      procedure :: close_up
      procedure :: volume
      procedure :: bounds
      procedure, private :: find_normals
   end type triangles_t

contains

   pure integer function triangle_count(self)
      class(triangles_t), intent(in) :: self
      triangle_count = size(self%of, 2)
   end function triangle_count

   !> Merge corners at the same position.
   pure subroutine weld(place, of)
      real(wp), allocatable, intent(inout) :: place(:, :) !< (3, corners)
      integer, allocatable, intent(inout) :: of(:, :)     !< (3, triangles): corners by number
      integer, allocatable :: slot(:), number(:)
      integer(i8) :: mask, key
      integer :: c, kept
      mask = table_mask(size(place, 2))
      allocate (slot(0:mask), source=0)
      allocate (number(size(place, 2)))
      kept = 0
      do c = 1, size(place, 2)
         place(:, c) = place(:, c) + 0.0_wp ! no -0
         key = iand(mixed(transfer(place(:, c), [0_i8])), mask)
         do while (slot(key) > 0)
            if (all(abs(place(:, slot(key)) - place(:, c)) <= 0.0_wp)) exit
            key = iand(key + 1, mask)
         end do
         if (slot(key) == 0) then
            kept = kept + 1
            slot(key) = kept
            place(:, kept) = place(:, c)
         end if
         number(c) = slot(key)
      end do
      place = place(:, :kept)
      call renumber(number, of)
   end subroutine weld

   !> Renumber corners; triangles with two equal corners are removed.
   pure subroutine renumber(number, of)
      integer, intent(in) :: number(:) !< of each corner
      integer, allocatable, intent(inout) :: of(:, :)
      logical, allocatable :: whole(:)
      integer :: t
      allocate (whole(size(of, 2)))
      do t = 1, size(of, 2)
         of(:, t) = number(of(:, t))
         whole(t) = of(1, t) /= of(2, t) .and. of(2, t) /= of(3, t) .and. of(3, t) /= of(1, t)
      end do
      of = of(:, pack([(t, t=1, size(of, 2))], whole))
   end subroutine renumber

   !> Corners no further apart than `near` are merged into the first of them: each is compared with those
   !> before it in its cell of that size and the 26 around.
   pure subroutine weld_near(place, of, near)
      real(wp), allocatable, intent(inout) :: place(:, :)
      integer, allocatable, intent(inout) :: of(:, :)
      real(wp), intent(in) :: near
      integer, allocatable :: slot(:), next(:), number(:)
      integer(i8) :: mask, cell(3)
      integer :: c, kept, other, side
      mask = table_mask(size(place, 2))
      allocate (slot(0:mask), source=0)
      allocate (next(size(place, 2)), source=0)
      allocate (number(size(place, 2)))
      kept = 0
      do c = 1, size(place, 2)
         cell = floor(place(:, c)/near, i8)
         number(c) = 0
         do side = 0, 26
            other = slot(key_of(cell + [mod(side, 3), mod(side/3, 3), side/9] - 1_i8))
            do while (other > 0 .and. number(c) == 0)
               if (norm2(place(:, other) - place(:, c)) <= near) number(c) = other
               other = next(other)
            end do
            if (number(c) > 0) exit
         end do
         if (number(c) > 0) cycle
         kept = kept + 1
         number(c) = kept
         place(:, kept) = place(:, c)
         next(kept) = slot(key_of(cell))
         slot(key_of(cell)) = kept
      end do
      place = place(:, :kept)
      call renumber(number, of)
   contains
      pure integer(i8) function key_of(at)
         integer(i8), intent(in) :: at(3)
         key_of = iand(mixed(at), mask)
      end function key_of
   end subroutine weld_near

   !> Check that every edge has one triangle on each side, that all are oriented outwards and have an area;
   !> then compute the normals. `fault` describes the error; empty: none.
   pure subroutine close_up(self, fault)
      class(triangles_t), intent(inout) :: self
      character(len=:), allocatable, intent(out) :: fault
      integer, allocatable :: slot(:)
      integer(i8) :: mask, key
      integer :: t, k, a, b
      fault = ''
      if (self%count() == 0) then
         fault = 'has no triangles'
         return
      end if
      mask = table_mask(3*self%count())
      allocate (slot(0:mask), source=0) ! of half edges: 3 (triangle - 1) + first corner
      do t = 1, self%count()
         do k = 1, 3
            a = self%of(k, t)
            b = self%of(corner_after(k), t)
            key = found(a, b)
            if (slot(key) > 0) then
               fault = 'is not a closed surface: the edge from '//shown(a)//' to '//shown(b)// &
                       ' has two triangles on one side, numbers '//to_text((slot(key) - 1)/3 + 1)//' and '// &
                       to_text(t)//'; orient all counter-clockwise seen from outside'
               return
            end if
            slot(key) = 3*(t - 1) + k
         end do
      end do
      if (allocated(self%beside)) deallocate (self%beside)
      allocate (self%beside(3, self%count()))
      do t = 1, self%count()
         do k = 1, 3
            key = found(self%of(corner_after(k), t), self%of(k, t))
            if (slot(key) == 0) then
               fault = 'is not closed: the edge from '//shown(self%of(k, t))//' to '// &
                       shown(self%of(corner_after(k), t))//' of triangle '//to_text(t)// &
                       ' has no triangle on its other side'
               return
            end if
            self%beside(k, t) = (slot(key) - 1)/3 + 1
         end do
      end do
      call self%find_normals(fault)
      if (fault /= '') return
      if (.not. self%volume() > 0.0_wp) &
         fault = 'is inside out: its volume is negative; reverse the triangles (counter-clockwise seen '// &
            'from outside)'
   contains
      !> Index in the table of the half edge from corner a to corner b, or of its free entry.
      pure integer(i8) function found(a, b) result(key)
         integer, intent(in) :: a, b
         integer :: triangle, first
         key = iand(mixed([int(a, i8), int(b, i8), 0_i8]), mask)
         do while (slot(key) > 0)
            triangle = (slot(key) - 1)/3 + 1
            first = slot(key) - 3*(triangle - 1)
            if (self%of(first, triangle) == a .and. self%of(corner_after(first), triangle) == b) exit
            key = iand(key + 1, mask)
         end do
      end function found
      pure function shown(c) result(text)
         integer, intent(in) :: c
         character(len=:), allocatable :: text
         text = reals_text(self%corner(:, c), 6)
      end function shown
   end subroutine close_up

   !> Normals of faces; of edges the sum of both faces' normals; of corners the sum over the faces, weighted
   !> by their angles there (Baerentzen and Aanaes 2005).
   pure subroutine find_normals(self, fault)
      class(triangles_t), intent(inout) :: self
      character(len=:), allocatable, intent(inout) :: fault
      real(wp) :: side(3, 3), normal(3), longest
      integer :: t, k
      allocate (self%face_normal(3, self%count()), self%edge_normal(3, 3, self%count()))
      allocate (self%corner_normal(3, size(self%corner, 2)), source=0.0_wp)
      do t = 1, self%count()
         do k = 1, 3
            side(:, k) = self%corner(:, self%of(corner_after(k), t)) - self%corner(:, self%of(k, t))
         end do
         longest = sqrt(maxval(sum(side**2, dim=1)))
         side = side/longest
         normal = cross(side(:, 1), side(:, 2))
         if (.not. norm2(normal) > flat) then
            fault = 'has a degenerate triangle, number '//to_text(t)//', at '// &
                    reals_text(self%corner(:, self%of(1, t)), 6)//': its corners lie on one line'
            return
         end if
         self%face_normal(:, t) = normal/norm2(normal)
         do k = 1, 3
            associate (c => self%of(corner_after(k), t), after => corner_after(k))
               self%corner_normal(:, c) = self%corner_normal(:, c) + self%face_normal(:, t) &
                                          *angle(-side(:, k), side(:, after))
            end associate
         end do
      end do
      do t = 1, self%count()
         do k = 1, 3
            self%edge_normal(:, k, t) = self%face_normal(:, t) + self%face_normal(:, self%beside(k, t))
         end do
      end do
   end subroutine find_normals

   !> Angle between two vectors, rad.
   pure real(wp) function angle(a, b)
      real(wp), intent(in) :: a(3), b(3)
      angle = atan2(norm2(cross(a, b)), dot_product(a, b))
   end function angle

   !> Volume inside, m3: negative where the triangles face inwards.
   pure real(wp) function volume(self)
      class(triangles_t), intent(in) :: self
      real(wp) :: from(3)
      integer :: t
      from = self%corner(:, self%of(1, 1))
      volume = 0.0_wp
      do t = 1, self%count()
         volume = volume + dot_product(self%corner(:, self%of(1, t)) - from, &
                                       cross(self%corner(:, self%of(2, t)) - from, &
                                             self%corner(:, self%of(3, t)) - from))
      end do
      volume = volume/6.0_wp
   end function volume

   !> Axis-aligned bounding box of all corners, m.
   pure subroutine bounds(self, lower, upper)
      class(triangles_t), intent(in) :: self
      real(wp), intent(out) :: lower(3), upper(3)
      lower = minval(self%corner, dim=2)
      upper = maxval(self%corner, dim=2)
   end subroutine bounds

   !> One less than a power of two: size of a table that is at most half full.
   pure integer(i8) function table_mask(entries)
      integer, intent(in) :: entries
      table_mask = 16
      do while (table_mask < 2_i8*entries)
         table_mask = 2*table_mask
      end do
      table_mask = table_mask - 1
   end function table_mask

   !> Hash of three integers, without overflow.
   pure integer(i8) function mixed(keys)
      integer(i8), intent(in) :: keys(3)
      integer(i8), parameter :: low = 2147483647_i8
      integer(i8) :: part
      integer :: k
      mixed = 0
      do k = 1, 3
         part = ieor(iand(keys(k), low), iand(shiftr(keys(k), 31), low))
         mixed = iand(ieor(mixed, part)*1103515245_i8 + 12345_i8, low)
         mixed = ieor(mixed, shiftr(mixed, 15))
      end do
   end function mixed

end module m_triangles
