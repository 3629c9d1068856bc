!> The inside of a closed surface of triangles: signed distance and normal at any point (theory.md, eq.
!> pseudonormal).
module m_closed_surface
   use m_kinds, only: wp
   use m_triangles, only: triangles_t
   use m_box_tree, only: box_tree_t, foot_t
   use m_surface_sheets, only: sheets_t, find_sheets
   implicit none
   private
   public :: closed_surface_t

   integer, parameter :: min_cells = 8**3, cell_limit = 96**3, cells_a_triangle = 8 !< numbers of cells over
                                                                                    !< its bounding box
   real(wp), parameter :: max_total = 8.0e6_wp !< cells, including the rim: limits them for needles and plates
   real(wp), parameter :: known = 0.5_wp !< cells whose distance is known to exceed this share of the last one
                                         !< searched for are not searched
   integer, parameter :: rim = 8 !< cells around the bounding box: points near a tool are most often outside
                                 !< it

   !> Cached data of a cell, for its midpoint.
   type :: cell_t
      real(wp) :: least = 0.0_wp, most = 0.0_wp !< bounds of its signed distance, m
      integer :: guess = 0 !< index of the nearest triangle in the tree
   end type cell_t

   !> Cubic cells over the surface's bounding box cache the distance of their midpoint and the nearest
   !> triangle: points far away need no search, and a search starts with a good guess.
   type :: closed_surface_t
      type(triangles_t) :: triangles
      type(box_tree_t) :: tree
      type(sheets_t) :: sheets
      real(wp) :: lower(3) = 0.0_wp, upper(3) = 0.0_wp !< bounding box of the surface, m
      real(wp), private :: from(3) = 0.0_wp, edge = 0.0_wp !< corner of the cells and their edge, m
      real(wp), private :: per_edge = 0.0_wp               !< 1/m
      integer, private :: cells(3) = 0
      type(cell_t), allocatable, private :: cell(:, :, :)
   contains
      procedure :: build
      procedure :: divide
      procedure :: distance_and_normal
      procedure :: distance_within
      procedure :: sheet_within
      procedure :: distance_of_sheet
      procedure :: min_distance
      procedure :: max_distance
      procedure, private :: bound
      procedure, private :: cell_of
      procedure, private :: judge
      procedure, private :: sheet_at
      procedure, private :: is_inner
   end type closed_surface_t

contains

   !> Build from triangles after `close_up`.
   subroutine build(self, triangles)
      class(closed_surface_t), intent(inout) :: self
      type(triangles_t), intent(in) :: triangles
      real(wp) :: middle(3), distance, normal(3), wanted
      type(foot_t) :: foot
      integer :: i, j, k
      self%triangles = triangles
      call self%tree%build(triangles)
      call triangles%bounds(self%lower, self%upper)
      wanted = min(cell_limit, max(min_cells, cells_a_triangle*triangles%count()))
      self%edge = (product(self%upper - self%lower)/wanted)**(1.0_wp/3.0_wp)
      do while (product((self%upper - self%lower)/self%edge + 1.0_wp + 2*rim) > max_total)
         self%edge = 1.25_wp*self%edge
      end do
      self%cells = ceiling((self%upper - self%lower)/self%edge) + 2*rim
      self%from = 0.5_wp*(self%lower + self%upper) - 0.5_wp*self%cells*self%edge
      self%per_edge = 1.0_wp/self%edge
      allocate (self%cell(self%cells(1), self%cells(2), self%cells(3)))
      do k = 1, self%cells(3)
         do j = 1, self%cells(2)
            distance = 0.0_wp
            do i = 1, self%cells(1)
               if (i > 1) then ! the distance changes by no more than the distance between points
                  associate (it => self%cell(i, j, k), last => self%cell(i - 1, j, k))
                     it = cell_t(last%least - self%edge, last%most + self%edge, last%guess)
                     if (max(it%least, -it%most) > known*abs(distance)) cycle
                  end associate
               end if
               middle = self%from + ([i, j, k] - 0.5_wp)*self%edge
               foot = foot_t()
               if (i > 1) call self%tree%look_at(self%cell(i, j, k)%guess, middle, foot)
               call self%tree%nearest(middle, foot)
               call self%judge(foot, distance, normal)
               self%cell(i, j, k) = cell_t(distance, distance, foot%place)
            end do
         end do
      end do
   end subroutine build

   !> Find the sheets of a tool's surface.
   subroutine divide(self)
      class(closed_surface_t), intent(inout) :: self
      self%sheets = find_sheets(self%triangles)
      if (self%sheets%count > 1) self%tree%sheet = self%sheets%of(self%tree%number)
   end subroutine divide

   !> Signed distance (m), and the outward unit normal of the surface at its nearest point: at edges and
   !> corners the direction from there to the point, reversed if inside.
   pure subroutine distance_and_normal(self, place, distance, normal)
      class(closed_surface_t), intent(in) :: self
      real(wp), intent(in) :: place(3) !< m
      real(wp), intent(out) :: distance, normal(3)
      type(foot_t) :: foot
      integer :: cell(3)
      cell = self%cell_of(place)
      call self%tree%look_at(self%cell(cell(1), cell(2), cell(3))%guess, place, foot)
      call self%tree%nearest(place, foot)
      call self%judge(foot, distance, normal)
   end subroutine distance_and_normal

   !> The same for a point nearer to the surface than `limit`; else a bound of the distance, of the same sign
   !> and not below the limit in size, without a normal. This takes no search or a short one.
   pure subroutine distance_within(self, place, limit, distance, normal, nearest)
      class(closed_surface_t), intent(in) :: self
      real(wp), intent(in) :: place(3), limit !< m
      real(wp), intent(out) :: distance, normal(3)
      type(foot_t), intent(out), optional :: nearest !< without a place where the distance is a bound
      type(foot_t) :: foot
      real(wp) :: least, most
      integer :: at(3)
      normal = 0.0_wp
      call self%bound(place, least, most)
      if (least >= limit) then
         distance = least
      else if (most <= -limit) then
         distance = most
      else
         at = self%cell_of(place)
         foot%squared = limit**2
         call self%tree%look_at(self%cell(at(1), at(2), at(3))%guess, place, foot)
         call self%tree%nearest(place, foot)
         if (foot%place > 0) then
            call self%judge(foot, distance, normal)
         else if (least > -limit) then ! at least `limit` away and not that far inside: outside
            distance = limit
         else if (most < limit) then
            distance = -limit
         else
            foot = foot_t()
            call self%tree%nearest(place, foot)
            call self%judge(foot, distance, normal)
         end if
      end if
      if (present(nearest)) nearest = foot
   end subroutine distance_within

   !> The distance below `limit` and the normal of a face of a sheet that a point is in front of; at least
   !> `limit` if there is none. The nearest place of the whole surface counts for the sheet that it is on; on
   !> others the foot of the point must be on a face, not at its end: there the nearest place is elsewhere.
   pure subroutine sheet_within(self, place, limit, sheet, distance, normal)
      class(closed_surface_t), intent(in) :: self
      real(wp), intent(in) :: place(3), limit !< m
      integer, intent(in) :: sheet
      real(wp), intent(out) :: distance, normal(3)
      type(foot_t) :: foot
      call self%distance_within(place, limit, distance, normal, foot)
      if (distance >= limit) return
      if (foot%place == 0) then ! far inside
         foot = foot_t()
         call self%tree%nearest(place, foot)
         call self%judge(foot, distance, normal)
      end if
      if (self%sheet_at(foot) == sheet) return
      if (distance >= 0.0_wp) then
         foot = foot_t(squared=limit**2)
         call self%tree%nearest(place, foot, sheet)
         if (foot%place > 0) then
            call self%judge(foot, distance, normal)
            if (distance >= 0.0_wp .and. self%is_inner(foot)) return
         end if
      end if
      distance = limit
   end subroutine sheet_within

   !> Signed distance and normal of the nearest face of a sheet, also beside it: there its plane goes on.
   pure subroutine distance_of_sheet(self, place, sheet, distance, normal)
      class(closed_surface_t), intent(in) :: self
      real(wp), intent(in) :: place(3)
      integer, intent(in) :: sheet
      real(wp), intent(out) :: distance, normal(3)
      type(foot_t) :: foot, all
      call self%tree%nearest(place, foot, sheet)
      call self%judge(foot, distance, normal)
      if (self%is_inner(foot)) return
      call self%tree%nearest(place, all)
      if (self%sheet_at(all) == sheet) return ! at a convex edge
      normal = self%triangles%face_normal(:, self%tree%number(foot%place))
      distance = dot_product(foot%way, normal)
   end subroutine distance_of_sheet

   !> The sheet of a place on the surface: the lowest where several meet.
   pure integer function sheet_at(self, foot) result(sheet)
      class(closed_surface_t), intent(in) :: self
      type(foot_t), intent(in) :: foot
      associate (t => self%tree%number(foot%place))
         sheet = self%sheets%of(t)
         if (foot%feature >= 4) sheet = self%sheets%of_corner(self%triangles%of(foot%feature - 3, t))
         if (foot%feature >= 1 .and. foot%feature <= 3) &
            sheet = min(sheet, self%sheets%of(self%triangles%beside(foot%feature, t)))
      end associate
   end function sheet_at

   !> True when only triangles of one sheet meet at a place.
   pure logical function is_inner(self, foot)
      class(closed_surface_t), intent(in) :: self
      type(foot_t), intent(in) :: foot
      associate (t => self%tree%number(foot%place))
         select case (foot%feature)
         case (0)
            is_inner = .true.
         case (1:3)
            is_inner = self%sheets%of(self%triangles%beside(foot%feature, t)) == self%sheets%of(t)
         case default
            is_inner = self%sheets%inner_corner(self%triangles%of(foot%feature - 3, t))
         end select
      end associate
   end function is_inner

   !> Bounds of the signed distance of a point, m, without a search: from the midpoints of the eight cells
   !> around, as it changes by no more than the distance to them.
   pure subroutine bound(self, place, least, most)
      class(closed_surface_t), intent(in) :: self
      real(wp), intent(in) :: place(3)
      real(wp), intent(out) :: least, most
      real(wp) :: low(3), off(3), way(0:1, 3)
      integer :: at(3), i, j, k
      at = int(max(1.0_wp, min((place - self%from)*self%per_edge + 0.5_wp, self%cells - 0.5_wp)))
      low = place - (self%from + (at - 0.5_wp)*self%edge)
      way(0, :) = low**2
      way(1, :) = (low - self%edge)**2
      least = -huge(least)
      most = huge(most)
      do k = 0, 1
         do j = 0, 1
            do i = 0, 1
               associate (cell => self%cell(at(1) + i, at(2) + j, at(3) + k), &
                          to_middle => sqrt(way(i, 1) + way(j, 2) + way(k, 3)))
                  least = max(least, cell%least - to_middle)
                  most = min(most, cell%most + to_middle)
               end associate
            end do
         end do
      end do
      off = max(self%lower - place, place - self%upper, 0.0_wp)
      if (any(off > 0.0_wp)) least = max(least, sqrt(dot_product(off, off)))
   end subroutine bound

   !> Side and normal of the nearest point: by the normal of the face, edge or corner that it lies on.
   pure subroutine judge(self, foot, distance, normal)
      class(closed_surface_t), intent(in) :: self
      type(foot_t), intent(in) :: foot
      real(wp), intent(out) :: distance, normal(3)
      integer :: t
      t = self%tree%number(foot%place)
      select case (foot%feature)
      case (0)
         normal = self%triangles%face_normal(:, t)
      case (1:3)
         normal = self%triangles%edge_normal(:, foot%feature, t)
      case default
         normal = self%triangles%corner_normal(:, self%triangles%of(foot%feature - 3, t))
      end select
      distance = sqrt(foot%squared)
      if (distance > 0.0_wp .and. foot%feature > 0) then
         if (dot_product(foot%way, normal) < 0.0_wp) distance = -distance
         normal = foot%way/distance
      else if (foot%feature > 0) then
         normal = normal/sqrt(dot_product(normal, normal))
      else ! distance to the plane: more accurate than the vector, which may be short
         distance = sign(distance, dot_product(foot%way, normal))
      end if
   end subroutine judge

   !> The cell of a point, or the nearest one.
   pure function cell_of(self, place) result(cell)
      class(closed_surface_t), intent(in) :: self
      real(wp), intent(in) :: place(3)
      integer :: cell(3)
      ! clipped as reals: far points overflow integers
      cell = 1 + int(max(0.0_wp, min((place - self%from)*self%per_edge, self%cells - 0.5_wp)))
   end function cell_of

   !> Lower bound of the signed distance, m, without a search.
   pure real(wp) function min_distance(self, place)
      class(closed_surface_t), intent(in) :: self
      real(wp), intent(in) :: place(3)
      real(wp) :: most
      call self%bound(place, min_distance, most)
   end function min_distance

   !> Upper bound of the signed distance, m, without a search.
   pure real(wp) function max_distance(self, place)
      class(closed_surface_t), intent(in) :: self
      real(wp), intent(in) :: place(3)
      real(wp) :: least
      call self%bound(place, least, max_distance)
   end function max_distance

end module m_closed_surface
