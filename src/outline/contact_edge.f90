!> Where a contact ends, from the gap that opens beyond it (theory.md, eq. contact-edge), and where single
!> pressures are right from these too (eq. edge-field). A grid does not bend within a cell as sharply as the
!> surface beside a lip, so that the gap is sought as the grid shows it.
module m_contact_edge
   use m_kinds, only: wp
   use m_surface_points, only: surface_point_t, squares_t, find_neighbours
   use m_edge_field, only: fit_field, inside
   implicit none
   private
   public :: edges_t, find_edges, ahead

   !> Where the contact ends as each point beside it sees it.
   type :: edges_t
      logical, allocatable :: known(:)      !< (points): where something is known
      real(wp), allocatable :: outwards(:, :) !< (2, points): unit vectors up the gap
      real(wp), allocatable :: back(:)      !< from the point against them to the edge, m; below 0: beyond it
      real(wp), allocatable :: sight(:)     !< so far a point says where the edge is, m
      real(wp) :: farthest = 0.0_wp         !< no known point's sight is longer
   end type edges_t

   real(wp), parameter :: ahead = 2.0_wp   !< cells: so far beyond a point its gap is looked at,
   real(wp), parameter :: behind = 1.0_wp  !< so far towards the contact,
   real(wp), parameter :: aside = 0.75_wp  !< and so far across
   real(wp), parameter :: strip = 0.5_wp   !< cells: so far across where pressures count
   real(wp), parameter :: beside = 1.2_wp  !< cells: a point is beside a contact from which it is so far
   real(wp), parameter :: rounded = 0.5_wp !< cells: half width of the hat with which a gap is smoothed
   real(wp), parameter :: sees = 1.2_wp    !< edges: so far a point outside says where the edge is
   integer, parameter :: fewest = 3        !< points with gaps that say where the edge is
   integer, parameter :: powers = 5        !< of the distance, between 1 (a wedge, of what has flowed) and 3/2
                                           !< (an elastic surface) with which gaps open
   real(wp), parameter :: fine = 0.05_wp   !< cells: the edge is sought in steps of this, first of four times
                                           !< this
   integer, parameter :: per_cell = 50     !< of the table of gaps

contains

   !> For each point beside a contact, where the contact ends as seen from it.
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
         if (in_contact(p)) cycle
         if (points(p)%beside > 0.0_wp) then ! the tool itself ends there
            edges%outwards(:, p) = points(p)%outwards
            edges%back(p) = points(p)%beside
            edges%known(p) = .true.
            cycle
         end if
         call find_neighbours(points, squares, points(p)%place, beside*cell, near, n)
         if (.not. any(in_contact(near(:n)))) cycle
         edges%outwards(:, p) = up_the_gap(points, near(:n), p)
         if (.not. norm2(edges%outwards(:, p)) > 0.0_wp) cycle
         call find_neighbours(points, squares, points(p)%place, norm2([beside + inside, strip])*cell, near, n)
         if (all(points(near(:n))%modulus > 0.0_wp)) then
            call fit_pressures(points(near(:n)), in_contact(near(:n)), points(p)%place, &
                               edges%outwards(:, p), cell, edges%known(p), edges%back(p))
            ! points may press beyond the edge, across gaps
            edges%sight(p) = edges%sight(p) + max(0.0_wp, edges%back(p))
            if (edges%known(p)) cycle
         end if
         call find_neighbours(points, squares, points(p)%place, norm2([ahead, aside])*cell, near, n)
         call fit(points(near(:n)), in_contact(near(:n)), points(p)%place, edges%outwards(:, p), cell, &
                  opening, edges%known(p), edges%back(p))
      end do
      edges%farthest = maxval([0.0_wp, edges%sight], mask=[.true., edges%known])
   end function find_edges

   !> Unit vector along which the gap grows, from those of a point and its neighbours; 0 where it does not.
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

   !> The edge whose field fits the pressures and gaps before and behind a place best.
   subroutine fit_pressures(points, in_contact, place, outwards, cell, known, back)
      type(surface_point_t), intent(in) :: points(:)
      logical, intent(in) :: in_contact(:)
      real(wp), intent(in) :: place(2), outwards(2), cell !< m
      logical, intent(out) :: known
      real(wp), intent(out) :: back !< m
      real(wp), dimension(size(points)) :: along, face, gap, pressure
      real(wp) :: edge, way(2)
      logical :: pressed(size(points))
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
      call fit_field(along(:n), gap(:n), pressure(:n), face(:n), pressed(:n), edge, known)
      back = merge(-edge*cell, 0.0_wp, known)
   end subroutine fit_pressures

   !> The edge from which a gap opens that fits the gaps before and behind a place best, by least squares.
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
      !> Take an edge at a distance (cells) if its gap explains more of the squares of the gaps.
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

   !> The gap (but for its factor) at a distance from the edge (cells).
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

   !> Gaps at distances from the edge, but for a factor: powers of the distance, smoothed with a hat, in
   !> closed form. From `rounded` before the edge on, `per_cell` a cell; by powers.
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
