!> The part of a cube inside a shape whose surface may cut it: its volume and moments, and the surface in the
!> cube (theory.md, eq. cut-cell).
module m_cut_cell
   use m_kinds, only: wp
   use m_shape, only: shape_t
   use m_scene, only: body_spec_t
   implicit none
   private
   public :: part_t, may_reach, find_part, find_surface, cells_of_particle

   integer, parameter :: halvings = 2  !< halvings of a cube cut by the surface before the surface is taken as
                                       !< plane
   integer, parameter :: samples = 2**halvings
   real(wp), parameter :: one_face = 0.98_wp !< cosine: places whose normals differ by less are of one face
   real(wp), parameter :: just = 0.1_wp !< halves of a cube: how far just below or beyond a surface is
   real(wp), parameter :: hair = 1.0e-6_wp !< edges: a surface so near to a side of a cube lies on it
   real(wp), parameter :: tie = 1.0e-6_wp !< places that differ by less, in half edges, and normals whose
                                          !< components do, count as equal: the first is taken
   real(wp), parameter :: first_wins(3) = [1.0_wp + 2.0_wp*tie, 1.0_wp + tie, 1.0_wp]
   real(wp), parameter :: aligned = 1.0e-6_wp !< a squared correlation so small is of a cut along an axis
   real(wp), parameter :: nothing = 1.0e-9_wp !< of a cube: so small a part is round-off
   real(wp), parameter, public :: min_share = 0.2_wp !< smaller parts of a cube are added to the next cube
                                                     !< inwards
   integer, parameter, public :: cell_limit = 7 !< cubes that may form one particle: its own and six beside it

   !> A part of a body, and the moments of its volume.
   type :: part_t
      real(wp) :: volume = 0.0_wp       !< m3
      real(wp) :: from(3) = 0.0_wp      !< place within it that moments are taken about, m
      real(wp) :: first(3) = 0.0_wp     !< m4
      real(wp) :: second(3, 3) = 0.0_wp !< m5
   contains
      procedure :: middle
      procedure :: spread_of
      procedure :: half_edges
      procedure :: half_edges_of_section
   end type part_t

contains

   !> False if a cube certainly has no part of the shape.
   pure logical function may_reach(shape, middle, half)
      class(shape_t), intent(in) :: shape
      real(wp), intent(in) :: middle(3), half !< of the cube: its middle and half its edge, m
      may_reach = shape%min_distance(middle) < sqrt(3.0_wp)*half
      if (.not. may_reach .or. .not. shape%is_searched()) return
      may_reach = shape%max_distance(middle) < sqrt(3.0_wp)*half
      if (.not. may_reach) may_reach = shape%distance(middle) < sqrt(3.0_wp)*half
   end function may_reach

   !> Centre of the volume, m.
   pure function middle(self)
      class(part_t), intent(in) :: self
      real(wp) :: middle(3)
      middle = self%from + self%first/self%volume
   end function middle

   !> Second moments about the centre over the volume, m2.
   pure function spread_of(self) result(spread)
      class(part_t), intent(in) :: self
      real(wp) :: spread(3, 3), centre(3)
      integer :: i
      centre = self%first/self%volume
      do i = 1, 3
         spread(:, i) = self%second(:, i)/self%volume - centre*centre(i)
      end do
   end function spread_of

   !> Half the edges (m) of the axis-aligned box with the same volume and the same moments of inertia as the
   !> part, where there is one: of a part that is cut obliquely they are changed along the directions that the
   !> cut is oblique to. None is longer than `longest`.
   pure function half_edges(self, longest) result(half)
      class(part_t), intent(in) :: self
      real(wp), intent(in) :: longest !< m
      real(wp) :: half(3), oblique(3), spread(3, 3)
      integer :: i
      spread = self%spread_of()
      half = [(sqrt(3.0_wp*max(spread(i, i), 0.0_wp)), i=1, 3)]
      oblique = [(sum((3.0_wp*spread(:, i)/(half*half(i)))**2) - 1.0_wp, i=1, 3)]
      oblique = merge(oblique, 0.0_wp, oblique > aligned)
      if (.not. any(oblique > 0.0_wp)) oblique = 1.0_wp
      half = min(half*(self%volume/(8.0_wp*product(half)))**(oblique/sum(oblique)), longest)
   end function half_edges

   !> The same for the part of the square in which a section cuts the cube; its thickness is that of the cube.
   pure function half_edges_of_section(self, longest, across) result(half)
      class(part_t), intent(in) :: self
      real(wp), intent(in) :: longest, across !< m; half the cube's edge
      real(wp) :: half(3), spread(3, 3)
      integer :: i
      spread = self%spread_of()
      half = [(sqrt(3.0_wp*max(spread(i, i), 0.0_wp)), i=1, 3)]
      half(2) = across
      half([1, 3]) = min(half([1, 3])*sqrt(self%volume/(8.0_wp*product(half))), longest)
   end function half_edges_of_section

   !> Add the part of a shape in a cube; the whole cube where the surface does not reach it. Of a section: the
   !> part of the square in the plane of the middle, as thick as the cube.
   pure recursive subroutine find_part(shape, middle, half, part, flat, depth)
      class(shape_t), intent(in) :: shape
      real(wp), intent(in) :: middle(3), half
      type(part_t), intent(inout) :: part
      logical, intent(in) :: flat            !< of a section
      integer, intent(in), optional :: depth !< remaining halvings
      real(wp) :: distance, normal(3, 2), share(2), centre(3), parts(3)
      integer :: i, left, octant
      left = halvings
      if (present(depth)) left = depth
      normal = 0.0_wp ! unused where the cube is inside
      distance = 0.0_wp
      if (shape%is_searched()) distance = shape%max_distance(middle)
      if (.not. shape%is_searched() .or. distance > -sqrt(3.0_wp)*half) &
         call shape%distance_and_normal(middle, distance, normal(:, 1))
      if (distance >= sqrt(3.0_wp)*half) return
      if (left > 0 .and. distance > -sqrt(3.0_wp)*half) then
         do octant = 0, 7
            parts = real(2*ibits(octant, [0, 1, 2], 1) - 1, wp)
            if (flat .and. parts(2) > 0.0_wp) cycle
            if (flat) parts(2) = 0.0_wp
            call find_part(shape, middle + 0.5_wp*half*parts, 0.5_wp*half, part, flat, left - 1)
         end do
         return
      end if
      share = 1.0_wp
      if (distance > -sqrt(3.0_wp)*half) call find_faces(shape, middle, half, distance, normal, share)
      if (product(share) <= 0.0_wp) return
      associate (volume => product(share)*(2.0_wp*half)**3*merge(2**(halvings - left), 1, flat))
         ! the remainder of a box after cuts across its shortest direction
         if (.not. part%volume > 0.0_wp) part%from = middle
         centre = middle - part%from - half*matmul(normal, 1.0_wp - share)
         part%volume = part%volume + volume
         part%first = part%first + volume*centre
         do i = 1, 3
            part%second(:, i) = part%second(:, i) + volume*centre*centre(i)
            part%second(i, i) = part%second(i, i) &
               + volume*half**2/3.0_wp*(1.0_wp - dot_product(normal(i, :)**2, 1.0_wp - share**2))
         end do
      end associate
   end subroutine find_part

   !> Shares of a cube below the faces of a shape that it reaches, and their normals: one face, or two that
   !> meet at an edge. A distance knows the nearest face alone, and outside of an edge neither. Faces are
   !> looked for within the shape: below the nearest point, and from an edge of the cube below the first face.
   pure subroutine find_faces(shape, middle, half, distance, normal, share)
      class(shape_t), intent(in) :: shape
      real(wp), intent(in) :: middle(3), half
      real(wp), intent(in) :: distance        !< of the middle, m
      real(wp), intent(inout) :: normal(3, 2) !< the first: of the middle; the second: 0, if there is none
      real(wp), intent(out) :: share(2)
      real(wp) :: face(3), to_face, to_first
      to_first = distance
      call find_face(shape, middle, normal(:, 1), max(distance, 0.0_wp) + 2.0_wp*half, face, to_face)
      if (distance > 0.0_wp .and. dot_product(normal(:, 1), face) < one_face) then
         call find_face(shape, middle, normal(:, 1), distance + just*half, face, to_face)
         if (dot_product(normal(:, 1), face) < one_face) then ! the middle is outside of an edge
            normal(:, 1) = face
            to_first = to_face
         end if
         call find_face(shape, middle, normal(:, 1), max(to_first, 0.0_wp) + 2.0_wp*half, face, to_face)
      end if
      share = [share_below(to_first, half, normal(:, 1)), 1.0_wp]
      normal(:, 2) = 0.0_wp
      if (dot_product(normal(:, 1), face) > one_face) return
      normal(:, 2) = face
      share(2) = share_below(to_face, half, face)
   end subroutine find_faces

   !> The face that is nearest from a place below another face, and how far a point is from its plane.
   pure subroutine find_face(shape, point, normal, depth, face, distance)
      class(shape_t), intent(in) :: shape
      real(wp), intent(in) :: point(3), normal(3), depth !< of the place: from the point against the normal, m
      real(wp), intent(out) :: face(3), distance         !< normal; m
      call shape%distance_and_normal(point - depth*normal, distance, face)
      distance = distance + depth*dot_product(face, normal)
   end subroutine find_face

   !> Share of a cube below a plane at a distance from its middle: exact for planes along the grid, right on
   !> average over all distances for others.
   pure real(wp) function share_below(distance, half, normal) result(share)
      real(wp), intent(in) :: distance, half, normal(3)
      share = min(1.0_wp, max(0.0_wp, 0.5_wp - 0.5_wp*distance/(half*sum(abs(normal)))))
   end function share_below

   !> The cubes that form a particle: that of its site, and those next to it, outwards, whose own part is too
   !> small for a particle. None where its own part is too small.
   pure subroutine cells_of_particle(shape, middle, half, flat, cells, count)
      class(shape_t), intent(in) :: shape
      real(wp), intent(in) :: middle(3), half
      logical, intent(in) :: flat !< of a section
      real(wp), intent(out) :: cells(3, cell_limit) !< their middles, m
      integer, intent(out) :: count
      real(wp) :: distance, normal(3), beside(3)
      integer :: axis, side
      cells(:, 1) = middle
      count = 0
      distance = shape%max_distance(middle)
      if (shape%is_searched() .and. distance > -(2.0_wp + sqrt(3.0_wp))*half) &
         distance = shape%distance(middle)
      if (distance >= sqrt(3.0_wp)*half) return
      if (distance > -sqrt(3.0_wp)*half) then
         if (volume_of(middle) < min_share*(2.0_wp*half)**3) return
      end if
      count = 1
      if (distance <= -(2.0_wp + sqrt(3.0_wp))*half) return ! no cut cube beside it
      do axis = 1, 3, merge(2, 1, flat)
         do side = -1, 1, 2
            beside = middle
            beside(axis) = middle(axis) + 2*side*half
            ! all neighbours must get the same normal, also where two faces are equally near
            call shape%distance_and_normal(tie*half*anint(beside/(tie*half)), distance, normal)
            if (abs(distance) >= sqrt(3.0_wp)*half) cycle
            if (maxloc(abs(normal)*first_wins, dim=1) /= axis .or. normal(axis)*side <= 0.0_wp) cycle
            associate (volume => volume_of(beside))
               if (volume <= nothing*(2.0_wp*half)**3 .or. volume >= min_share*(2.0_wp*half)**3) cycle
            end associate
            count = count + 1
            cells(:, count) = beside
         end do
      end do
   contains
      !> The same from all sites beside a cube, whose middles are rounded differently.
      pure real(wp) function volume_of(place)
         real(wp), intent(in) :: place(3)
         type(part_t) :: part
         call find_part(shape, tie*half*anint(place/(tie*half)), half, part, flat)
         volume_of = part%volume
      end function volume_of
   end subroutine cells_of_particle

   !> Add the surface of a shape in a cube that lies within a box: its outward area vector, its area, and its
   !> area times its middle; not what touches one of `bodies` other than the shape's own, `body`. Where all of
   !> it counts, the area vector closes the cube's sides, so that neighbouring cubes give a surface without
   !> gaps. A side of the cube on a side of the grid is no surface.
   pure subroutine find_surface(shape, middle, half, grid_lower, grid_upper, lower, upper, area, size_of, &
                                weighted, bodies, body)
      class(shape_t), intent(in) :: shape
      real(wp), intent(in) :: middle(3), half
      real(wp), intent(in) :: grid_lower(3), grid_upper(3), lower(3), upper(3) !< m
      real(wp), intent(inout) :: area(3)     !< m2
      real(wp), intent(inout) :: size_of     !< m2
      real(wp), intent(inout) :: weighted(3) !< m3
      type(body_spec_t), intent(in), optional :: bodies(:)
      integer, intent(in), optional :: body
      real(wp) :: place(3), foot(3), distance, normal(3), within(3), part, size_within, foot_within(3), small
      integer :: i, j, k
      logical :: all_within, counts
      small = half/samples
      within = 0.0_wp
      foot_within = 0.0_wp
      size_within = 0.0_wp
      all_within = .true.
      do k = 1, samples
         do j = 1, samples
            do i = 1, samples
               place = middle + (2*[i, j, k] - 1 - samples)*small
               call shape%distance_and_normal(place, distance, normal)
               distance = distance + hair*half ! a surface on a side belongs to the cube inside
               if (abs(distance) >= small*sum(abs(normal))) cycle
               foot = place - distance*normal
               if (any(foot <= grid_lower + 2.0_wp*hair*half) .or. &
                   any(foot >= grid_upper - 2.0_wp*hair*half)) cycle
               counts = all(foot >= lower) .and. all(foot <= upper)
               if (counts .and. present(bodies)) &
                  counts = .not. is_touched(bodies, body, foot + just*half*normal)
               if (.not. counts) then
                  all_within = .false.
                  cycle
               end if
               part = (2.0_wp*small)**2/sum(abs(normal))
               size_within = size_within + part
               foot_within = foot_within + part*foot
               within = within + closing_area(shape, place, small, 1, grid_lower, grid_upper)
            end do
         end do
      end do
      if (.not. size_within > 0.0_wp) return
      if (all_within) within = closing_area(shape, middle, half, samples, grid_lower, grid_upper)
      area = area + within
      size_of = size_of + size_within
      weighted = weighted + foot_within
   end subroutine find_surface

   !> True where a place just beyond the surface of a body is within another one.
   pure logical function is_touched(bodies, body, place)
      type(body_spec_t), intent(in) :: bodies(:)
      integer, intent(in) :: body
      real(wp), intent(in) :: place(3) !< m
      integer :: b
      is_touched = .false.
      do b = 1, size(bodies)
         if (b /= body) is_touched = is_touched .or. bodies(b)%shape%inside(place)
      end do
   end function is_touched

   !> The outward area vector (m2) of the surface in a cube: it closes the parts of the cube's six sides
   !> inside the shape, each sampled at `places` points along each edge.
   pure function closing_area(shape, middle, half, places, grid_lower, grid_upper) result(closing)
      class(shape_t), intent(in) :: shape
      real(wp), intent(in) :: middle(3), half
      integer, intent(in) :: places
      real(wp), intent(in) :: grid_lower(3), grid_upper(3)
      real(wp) :: closing(3), on_side(3), gap, across(3), share, small
      integer :: axis, side, a, b, u, v
      closing = 0.0_wp
      small = half/places
      do axis = 1, 3
         u = 1 + mod(axis, 3)
         v = 1 + mod(axis + 1, 3)
         do side = -1, 1, 2
            do b = 1, places
               do a = 1, places
                  on_side(axis) = middle(axis) + side*half
                  on_side(u) = middle(u) + (2*a - 1 - places)*small
                  on_side(v) = middle(v) + (2*b - 1 - places)*small
                  ! from inside the grid
                  on_side = min(max(on_side, grid_lower + 4.0_wp*hair*half), grid_upper - 4.0_wp*hair*half)
                  call shape%distance_and_normal(on_side, gap, across)
                  gap = gap + hair*half
                  across(axis) = 0.0_wp
                  share = merge(1.0_wp, 0.0_wp, gap < 0.0_wp)
                  if (abs(gap) < small*sum(abs(across))) share = 0.5_wp - 0.5_wp*gap/(small*sum(abs(across)))
                  closing(axis) = closing(axis) - side*share*(2.0_wp*small)**2
               end do
            end do
         end do
      end do
   end function closing_area

end module m_cut_cell
