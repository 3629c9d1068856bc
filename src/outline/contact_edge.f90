!> The edge of a contact, from the gap that opens beyond it (theory.md, eq. contact-edge), and from single
!> pressures too where these are accurate (eq. edge-field). A grid cannot curve within a cell as sharply as
!> the surface beside a lip, so the gap is fitted as the grid represents it.
module m_contact_edge
   use m_kinds, only: wp
   use m_surface_points, only: surface_point_t, squares_t, find_neighbours
   use m_edge_field, only: fit_field, inside
   implicit none
   private
   public :: edges_t, find_edges, ahead

   !> The edge of the contact as found from each point beside it.
   type :: edges_t
      logical, allocatable :: known(:)      !< (points): an edge was found
      real(wp), allocatable :: outwards(:, :) !< (2, points): unit vectors along the growing gap
      real(wp), allocatable :: back(:)      !< distance from the point against them to the edge, m; below 0:
                                            !< beyond it
      real(wp), allocatable :: sight(:)     !< distance from a point within which its edge is valid, m
      real(wp) :: farthest = 0.0_wp         !< largest sight of all points, m
   end type edges_t

   real(wp), parameter :: ahead = 2.0_wp   !< cells: gaps are considered up to this distance outwards,
   real(wp), parameter :: behind = 1.0_wp  !< inwards to the contact,
   real(wp), parameter :: aside = 0.75_wp  !< and sideways
   real(wp), parameter :: strip = 0.5_wp   !< cells: sideways limit for pressures
   real(wp), parameter :: beside = 1.2_wp  !< cells: a point within this distance of a contact is beside it
   real(wp), parameter :: rounded = 0.5_wp !< cells: half width of the hat function for smoothing a gap
   real(wp), parameter :: sees = 1.2_wp    !< edges: a point outside gives the edge within this distance
   real(wp), parameter :: next = 1.5_wp    !< edges: points within this distance are neighbours,
   real(wp), parameter :: ends = 0.25_wp   !< edges: and the surface ends where none is further outwards
   integer, parameter :: fewest = 3        !< points with gaps needed to find the edge
   integer, parameter :: powers = 5        !< number of exponents of the distance, between 1 (a wedge, after
                                           !< plastic flow) and 3/2 (an elastic surface), with which gaps open
   real(wp), parameter :: fine = 0.05_wp   !< cells: step of the search for the edge, after steps of four
                                           !< times this
   integer, parameter :: per_cell = 50     !< entries of the table of gaps

contains

   !> For each point beside a contact, the edge of the contact as found from it.
   function find_edges(points, squares, in_contact, cell) result(edges)
      type(surface_point_t), intent(in) :: points(:)
      type(squares_t), intent(in) :: squares
      logical, intent(in) :: in_contact(:)
      real(wp), intent(in) :: cell         !< m
      type(edges_t) :: edges
      real(wp), allocatable :: opening(:, :)
      integer :: near(size(points)), n, p
      allocate (edges%known(size(points)), source=.false.)
      allocate (edges%back(size(points)), source=0.0_wp)
      allocate (edges%outwards(2, size(points)), source=0.0_wp)
      allocate (edges%sight(size(points)), source=sees*sum(points%edge, mask=in_contact)/count(in_contact))
      opening = openings()
      do p = 1, size(points)
         if (in_contact(p)) then
            call find_rim(points, squares, p, edges%known(p), edges%outwards(:, p), edges%back(p))
            cycle
         end if
         if (points(p)%beside > 0.0_wp) then ! the tool itself ends there
            edges%outwards(:, p) = points(p)%outwards
            edges%back(p) = points(p)%beside
            edges%known(p) = .true.
            cycle
         end if
         call find_neighbours(squares, points(p)%place, beside*cell, near, n)
         if (.not. any(in_contact(near(:n)))) cycle
         edges%outwards(:, p) = up_the_gap(points, near(:n), p)
         if (.not. norm2(edges%outwards(:, p)) > 0.0_wp) cycle
         call find_neighbours(squares, points(p)%place, norm2([beside + inside, strip])*cell, near, n)
         if (all(points(near(:n))%modulus > 0.0_wp)) then
            call fit_pressures(points(near(:n)), in_contact(near(:n)), points(p)%place, &
                               edges%outwards(:, p), cell, edges%known(p), edges%back(p))
            ! points may be pressed beyond the edge, across gaps
            edges%sight(p) = edges%sight(p) + max(0.0_wp, edges%back(p))
            if (edges%known(p)) cycle
         end if
         call find_neighbours(squares, points(p)%place, norm2([ahead, aside])*cell, near, n)
         call fit(points(near(:n)), in_contact(near(:n)), points(p)%place, edges%outwards(:, p), cell, &
                  opening, edges%known(p), edges%back(p))
      end do
      edges%farthest = maxval([0.0_wp, edges%sight], mask=[.true., edges%known])
   end function find_edges

   !> The edge of a contact where the body itself ends: half a domain beyond the last point.
   subroutine find_rim(points, squares, p, known, outwards, back)
      type(surface_point_t), intent(in) :: points(:)
      type(squares_t), intent(in) :: squares
      integer, intent(in) :: p !< number of a point in contact
      logical, intent(out) :: known
      real(wp), intent(out) :: outwards(2), back !< back: m, below 0
      integer :: near(size(points)), m, n
      associate (place => points(p)%place, edge => points(p)%edge)
         call find_neighbours(squares, place, next*edge, near, n)
         outwards = [(sum(place(m) - points(near(:n))%place(m)), m=1, 2)]
         outwards = outwards/max(norm2(outwards), tiny(edge))
         back = -norm2(points(p)%half*outwards)
         known = norm2(outwards) > 0.0_wp &
            .and. all([(dot_product(points(near(m))%place - place, outwards) < ends*edge, m=1, n)])
      end associate
   end subroutine find_rim

   !> Unit vector along which the gap grows, from those of a point and its neighbours; 0 if it does not grow.
   pure function up_the_gap(points, near, p) result(direction)
      type(surface_point_t), intent(in) :: points(:)
      integer, intent(in) :: near(:), p
      real(wp) :: direction(2), way(2)
      integer :: m
      direction = 0.0_wp
      do m = 1, size(near)
         if (near(m) == p) cycle
         way = points(near(m))%place - points(p)%place
         direction = direction + way*(points(near(m))%gap - points(p)%gap)/sum(way**2)
      end do
      direction = direction/max(norm2(direction), tiny(1.0_wp))
   end function up_the_gap

   !> The edge whose field best fits the pressures and gaps on both sides of a position.
   subroutine fit_pressures(points, in_contact, place, outwards, cell, known, back)
      type(surface_point_t), intent(in) :: points(:)
      logical, intent(in) :: in_contact(:)
      real(wp), intent(in) :: place(2), outwards(2), cell !< m
      logical, intent(out) :: known
      real(wp), intent(out) :: back !< m
      real(wp), dimension(size(points)) :: along, face, gap, pressure
      real(wp) :: edge, middle, way(2)
      logical, dimension(size(points)) :: pressed, used
      integer :: m, n
      n = 0
      do m = 1, size(points)
         if (points(m)%beside > 0.0_wp) cycle
         way = (points(m)%place - place)/cell
         if (abs(way(1)*outwards(2) - way(2)*outwards(1)) > strip) cycle
         if (dot_product(way, outwards) > ahead) cycle
         n = n + 1
         along(n) = dot_product(way, outwards)
         pressed(n) = in_contact(m)
         gap(n) = merge(0.0_wp, points(m)%gap/cell, pressed(n))
         pressure(n) = points(m)%traction/points(m)%modulus
         face(n) = points(m)%edge/cell
      end do
      ! a contact that is narrow here, as in the corner of a pyramid: the field has one edge, so points of the
      ! far side do not count
      middle = sum(along(:n), mask=pressed(:n))/max(1, count(pressed(:n)))
      used(:n) = along(:n) > middle - strip
      if (.not. any(.not. pressed(:n) .and. along(:n) < middle)) used(:n) = .true.
      call fit_field(pack(along(:n), used(:n)), pack(gap(:n), used(:n)), pack(pressure(:n), used(:n)), &
                     pack(face(:n), used(:n)), pack(pressed(:n), used(:n)), edge, known)
      back = merge(-edge*cell, 0.0_wp, known)
   end subroutine fit_pressures

   !> The edge from which the opening gap best fits the gaps on both sides of a position, by least squares.
   subroutine fit(points, in_contact, place, outwards, cell, opening, known, back)
      type(surface_point_t), intent(in) :: points(:)
      logical, intent(in) :: in_contact(:)
      real(wp), intent(in) :: place(2), outwards(2), cell !< m
      real(wp), intent(in) :: opening(0:, :)
      logical, intent(out) :: known
      real(wp), intent(out) :: back !< m
      real(wp) :: along(size(points)), gap(size(points)), best, way(2)
      integer :: count, m, open, power, steps
      count = 0
      open = 0
      do m = 1, size(points)
         if (points(m)%beside > 0.0_wp) cycle
         way = (points(m)%place - place)/cell
         if (abs(way(1)*outwards(2) - way(2)*outwards(1)) > aside) cycle
         if (dot_product(way, outwards) < -behind .or. dot_product(way, outwards) > ahead) cycle
         count = count + 1
         along(count) = dot_product(way, outwards)
         gap(count) = merge(0.0_wp, points(m)%gap, in_contact(m))
         if (gap(count) > 0.0_wp) open = open + 1
      end do
      known = .false.
      back = 0.0_wp
      if (open < fewest) return
      best = 0.0_wp
      associate (half => nint(behind/fine))
         do power = 1, powers, 2
            do steps = -half, half, 4
               call try(power, steps*fine)
            end do
         end do
         do power = 1, powers
            do steps = nint(-back/fine) - 3, nint(-back/fine) + 3
               if (abs(steps) <= half) call try(power, steps*fine)
            end do
         end do
      end associate
      back = back*cell
   contains
      !> Accept an edge at a distance (cells) if its gap explains more of the squared gaps.
      subroutine try(power, edge)
         integer, intent(in) :: power
         real(wp), intent(in) :: edge
         real(wp) :: mixed, shape, squared
         integer :: n
         mixed = 0.0_wp
         squared = 0.0_wp
         do n = 1, count
            shape = gap_at(opening, power, along(n) - edge)
            mixed = mixed + shape*gap(n)
            squared = squared + shape**2
         end do
         if (.not. (mixed > 0.0_wp .and. mixed**2 > best*squared)) return
         best = mixed**2/squared
         back = -edge
         known = .true.
      end subroutine try
   end subroutine fit

   !> The gap (up to its factor) at a distance from the edge (cells).
   pure real(wp) function gap_at(opening, power, distance)
      real(wp), intent(in) :: opening(0:, :) !< of openings
      integer, intent(in) :: power
      real(wp), intent(in) :: distance
      real(wp) :: at
      integer :: i
      at = (distance + rounded)*per_cell
      gap_at = 0.0_wp
      if (at <= 0.0_wp) return
      i = min(int(at), ubound(opening, 1) - 1)
      gap_at = opening(i, power) + (at - i)*(opening(i + 1, power) - opening(i, power))
   end function gap_at

   !> Gaps at distances from the edge, up to a factor: powers of the distance, smoothed with a hat function,
   !> in closed form. From `rounded` before the edge on, `per_cell` a cell; by powers.
   pure function openings() result(opening)
      real(wp), allocatable :: opening(:, :)
      real(wp) :: q, x
      integer :: i, power
      allocate (opening(0:ceiling(per_cell*(rounded + behind + ahead)) + 1, powers))
      do power = 1, powers
         q = 1.0_wp + 0.5_wp*(power - 1)/(powers - 1)
         do i = 0, ubound(opening, 1)
            x = real(i, wp)/per_cell - rounded
            opening(i, power) = ((x + rounded)**(q + 2.0_wp) - 2.0_wp*max(0.0_wp, x)**(q + 2.0_wp) &
                                     + max(0.0_wp, x - rounded)**(q + 2.0_wp)) &
                                    /(rounded**2*(q + 1.0_wp)*(q + 2.0_wp))
         end do
      end do
   end function openings

end module m_contact_edge
