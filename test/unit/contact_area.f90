!test: ranks 1 2 4
!> Area of contact of made-up points, whose edge is known: a disc in a surface that leaves the tool like an
!> elastic body (gap as the distance to the power 3/2) or at an angle, points on lattices at many places and
!> angles, the whole and a quarter of it between two mirrors, on all ranks the same; surfaces as they are, and
!> between nodes that have their gaps: what a grid holds lies between the two. Points that hover inside count,
!> buried ones do not; a ring has a hole; what hovers and bears pressure beside the ridges of a pyramid
!> counts; turned by 90 degrees and mirrored the area is the same; nothing pressed is no area. Under a sphere
!> and a cone whose pressures are known as well (Hertz, Sneddon) the area is within 4 % on three cells and
!> within 2 % on five and eight; with a modulus that is wrong by a factor of two it is not. A narrow contact
!> (a cylinder's) has its width though both of its edges are near, and known pressures overrule stresses
!> beside ridges. The outline of a disc is a circle, of a quarter its part between the mirrors from one to the
!> other.
program contact_area
   use m_kinds, only: wp
   use m_communicator, only: communicator_t
   use m_surface_points, only: surface_point_t
   use m_contact_area, only: area_of_patch => area_of, mirror_t, patch_of, patch_t
   use m_contact_outline, only: outline_of
   use m_assertions, only: assertions_t
   implicit none
   real(wp), parameter :: pi = acos(-1.0_wp), cell = 1.0_wp, edge = 0.5_wp
   type(communicator_t) :: comm
   type(assertions_t) :: test
   call comm%start()
   call test%start(comm, 'contact_area')
   call discs(5.0_wp, .false., [0.025_wp, 0.01_wp])
   call discs(8.0_wp, .false., [0.02_wp, 0.01_wp])
   call discs(5.0_wp, .true., [0.05_wp, 0.03_wp])
   call discs(8.0_wp, .true., [0.035_wp, 0.03_wp])
   call elastic(3.0_wp, 0.04_wp)
   call elastic(5.0_wp, 0.02_wp)
   call elastic(8.0_wp, 0.02_wp)
   call narrow(0.3_wp, 0.1_wp, 0.3_wp)
   call narrow(0.6_wp, 0.02_wp, 0.1_wp)
   call outlines()
   call ring()
   call ridges()
   call turns()
   call test%check(.not. area_of([surface_point_t([0.0_wp, 0.0_wp], 0.1_wp, edge, 0.0_wp)], whole()) > &
                   0.0_wp, 'nothing pressed')
   call test%finish()

contains

   pure function whole() result(mirrors)
      type(mirror_t) :: mirrors(0)
   end function whole

   pure function quarter() result(mirrors)
      type(mirror_t) :: mirrors(2)
      mirrors = [mirror_t([1.0_wp, 0.0_wp], 0.0_wp), mirror_t([0.0_wp, 1.0_wp], 0.0_wp)]
   end function quarter

   real(wp) function area_of(points, mirrors)
      type(surface_point_t), intent(in) :: points(:)
      type(mirror_t), intent(in) :: mirrors(:)
      area_of = area_of_patch(comm, patch_of(points, mirrors, cell), cell)
   end function area_of

   !> Outlines of discs of five cells: mean radius, scatter, and order.
   subroutine outlines()
      type(surface_point_t), allocatable :: full(:), part(:)
      real(wp), allocatable :: edge(:, :), radius(:), angle(:)
      integer :: law, n
      do law = 1, 2
         full = disc(5.0_wp, law, [0.25_wp, 0.25_wp], 0.0_wp, .true.)
         edge = outline_of(patch_of(full, whole(), cell), cell)
         radius = norm2(edge, 1)
         n = size(radius)
         if (comm%is_root()) print '(3x,a,i0,a,i0,a,f6.3,a,f6.3,a)', 'outline, law ', law, ': ', n, &
            ' points, mean radius ', sum(radius)/n, ', scatter ', &
            norm2(radius - sum(radius)/n)/sqrt(real(n, wp)), ' cells'
         call test%check(n > 30, 'outline: points')
         call test%check_close(sum(radius)/n, 5.0_wp, 0.125_wp, 'outline: radius')
         call test%check(norm2(radius - sum(radius)/n) < 0.1_wp*sqrt(real(n, wp)), 'outline: scatter')
         part = pack(full, full%place(1) > 0.0_wp .and. full%place(2) > 0.0_wp)
         edge = outline_of(patch_of(part, quarter(), cell), cell)
         angle = atan2(edge(2, :), edge(1, :))
         call test%check(all(edge > 0.0_wp), 'outline: between mirrors')
         call test%check(size(angle) > 8 .and. (increases(angle) .or. increases(-angle)), 'outline: order')
      end do
      call test%check(size(outline_of(patch_of(full(:0), whole(), cell), cell)) == 0, 'outline of nothing')
   end subroutine outlines

   !> True where numbers grow, but for a hair: points may look at the same place.
   pure logical function increases(values)
      real(wp), intent(in) :: values(:)
      increases = all(values(2:) - values(:size(values) - 1) > -0.05_wp)
   end function increases

   !> Error of the area of discs of a radius (cells): in the mean over many lattices and at most, both laws of
   !> the gap.
   subroutine discs(radius, on_nodes, bounds)
      real(wp), intent(in) :: radius, bounds(2) !< of the mean, by law
      logical, intent(in) :: on_nodes
      real(wp) :: error, exact, largest, mean, place(2)
      type(surface_point_t), allocatable :: full(:)
      integer :: law, n, tries
      tries = merge(24, 4, comm%ranks == 1) ! the same on all ranks
      exact = pi*radius**2
      do law = 1, 2
         mean = 0.0_wp
         largest = 0.0_wp
         do n = 1, tries
            place = [mod(0.381966_wp*n, 1.0_wp), mod(0.7548777_wp*n, 1.0_wp)]*edge
            error = area_of(disc(radius, law, place, 0.1_wp*n, on_nodes), whole())/exact - 1.0_wp
            mean = mean + error/tries
            largest = max(largest, abs(error))
         end do
         if (comm%is_root()) print '(3x,a,f4.1,a,i0,a,l1,a,2f8.2,a)', 'radius ', radius, ' cells, law ', &
            law, ', on nodes ', on_nodes, ': mean and largest error ', 100*mean, 100*largest, ' %'
         call test%check(abs(mean) < bounds(law), 'disc: mean')
         call test%check(largest < 2.0_wp*bounds(law), 'disc: largest')
         ! a quarter between two mirrors has a quarter of the area of the whole lattice, which is its own
         ! image; wherever the mirrors cut the squares that are counted
         do n = 0, 3
            place = 0.25_wp
            full = disc(radius, law, place, 0.0_wp, on_nodes)
            full%place(1) = (1.0_wp + 0.005_wp*n)*full%place(1)
            full%place(2) = (1.0_wp - 0.004_wp*n)*full%place(2)
            call test%check_close(area_of(pack(full, full%place(1) > 0.0_wp .and. full%place(2) > 0.0_wp), &
                                          quarter()), 0.25_wp*area_of(full, whole()), 0.0015_wp*exact, &
                                          'disc: a quarter')
         end do
      end do
   end subroutine discs

   !> Largest error of the area under a sphere and a cone of an elastic half-space, over many lattices,
   !> between nodes that have the gaps; and with a wrong modulus.
   subroutine elastic(radius, bound)
      real(wp), intent(in) :: radius, bound
      real(wp) :: error, largest(2), place(2)
      integer :: law, m, n
      integer, parameter :: sphere = 1, cone = 2
      do law = sphere, cone
         largest = 0.0_wp
         do n = 1, merge(24, 4, comm%ranks == 1)
            place = [mod(0.381966_wp*n, 1.0_wp), mod(0.7548777_wp*n, 1.0_wp)]*edge
            do m = 1, 2
               error = area_of(half_space(radius, law, place, 0.1_wp*n, real(m, wp)), whole()) &
                       /(pi*radius**2) - 1.0_wp
               largest(m) = max(largest(m), abs(error))
            end do
         end do
         if (comm%is_root()) print '(3x,a,i0,a,f4.1,a,2f7.2,a)', 'elastic, law ', law, ', ', radius, &
            ' cells: largest error ', 100*largest, ' % (the latter with a wrong modulus)'
         call test%check(largest(1) < bound, 'elastic: largest error')
         call test%check(largest(2) > bound, 'elastic: a wrong modulus is seen')
      end do
   end subroutine elastic

   !> Width of contacts of a half width (cells) with a cylinder, at any angle to the lattice: area over
   !> length, by pieces of two lengths.
   subroutine narrow(half_width, of_mean, of_all)
      real(wp), intent(in) :: half_width, of_mean, of_all !< the latter: bounds
      type(surface_point_t), allocatable :: points(:)
      real(wp) :: angle, error, largest, mean, place(2), along(41*41)
      integer :: n
      integer, parameter :: cylinder = 3, tries = 12
      largest = 0.0_wp
      mean = 0.0_wp
      do n = 1, tries
         place = [mod(0.381966_wp*n, 1.0_wp), mod(0.7548777_wp*n, 1.0_wp)]*edge
         angle = 0.26_wp*n
         points = half_space(half_width, cylinder, place, 0.0_wp, 1.0_wp, angle)
         along(:size(points)) = cos(angle)*points%place(2) - sin(angle)*points%place(1)
         associate (far => abs(along(:size(points))))
            error = (area_of(pack(points, far < 9.0_wp), whole()) &
                     - area_of(pack(points, far < 3.0_wp), whole()))/(24.0_wp*half_width) - 1.0_wp
         end associate
         mean = mean + error/tries
         largest = max(largest, abs(error))
      end do
      if (comm%is_root()) print '(3x,a,f4.1,a,2f7.2,a)', 'narrow, half width ', half_width, &
         ' cells: mean and largest error ', 100*mean, 100*largest, ' %'
      call test%check(abs(mean) < of_mean, 'narrow: mean error')
      call test%check(largest < of_all, 'narrow: largest error')
   end subroutine narrow

   !> Points of a half-space (modulus 1) under a sphere, a cone or a cylinder, whose normal is at an angle
   !> `across` to the lattice; with `modulus` they say they are of another.
   function half_space(radius, law, place, angle, modulus, across) result(points)
      real(wp), intent(in) :: radius, place(2), angle, modulus
      real(wp), intent(in), optional :: across
      integer, intent(in) :: law
      type(surface_point_t), allocatable :: points(:)
      type(surface_point_t) :: found(41*41)
      real(wp) :: at(2), gap, share(2)
      integer :: a, b, i, j, n, node(2)
      n = 0
      do j = -20, 20
         do i = -20, 20
            at = edge*[i, j] + place
            n = n + 1
            found(n) = surface_point_t(turned(at, angle), 0.0_wp, edge, 1.0_wp)
            found(n)%modulus = modulus
            do b = -2, 2
               do a = -2, 2
                  associate (r => away(at + 0.2_wp*edge*[a, b], across))
                     found(n)%traction = found(n)%traction + pressure_at(r, radius, law)/25.0_wp
                  end associate
               end do
            end do
            if (away(at, across) < radius) cycle
            node = floor(at/cell)
            gap = 0.0_wp
            do b = 0, 1
               do a = 0, 1
                  share = 1.0_wp - abs(at/cell - (node + [a, b]))
                  gap = gap + product(share)*opening_at(away(cell*(node + [a, b]), across), radius, law)
               end do
            end do
            found(n)%gap = gap
            if (.not. found(n)%traction > 0.0_wp) found(n)%pressed = 0.0_wp
         end do
      end do
      points = pack(found(:n), found(:n)%gap < cell)
   end function half_space

   !> Distance from the middle, or from the middle line of a cylinder's contact.
   pure real(wp) function away(x, across)
      real(wp), intent(in) :: x(2)
      real(wp), intent(in), optional :: across
      away = norm2(x)
      if (present(across)) away = abs(cos(across)*x(1) + sin(across)*x(2))
   end function away

   !> Pressure under a sphere, a cone and a cylinder (Johnson 1985, eqs 3.39, 5.8,
   !> 4.45), over the modulus.
   pure real(wp) function pressure_at(r, a, law) result(pressure)
      real(wp), intent(in) :: r, a
      integer, intent(in) :: law
      pressure = 0.0_wp
      if (r >= a) return
      pressure = 0.1_wp*merge(acosh(a/max(r, 0.01_wp)), sqrt(1.0_wp - (r/a)**2), law == 2)
   end function pressure_at

   !> The gap beside it.
   pure real(wp) function opening_at(r, a, law) result(gap)
      real(wp), intent(in) :: r, a
      integer, intent(in) :: law
      gap = 0.0_wp
      if (r <= a) return
      if (law == 1) then
         gap = 0.1_wp/(2*a)*((2*a**2 - r**2)*asin(a/r) + a*sqrt(r**2 - a**2)) &
               + 0.05_wp*pi*(0.5_wp*r**2 - a**2)/a
      else if (law == 3) then
         gap = 0.1_wp*a*(r/a*sqrt((r/a)**2 - 1.0_wp) - acosh(r/a))
      else
         gap = 0.2_wp*a*(asin(a/r) + sqrt((r/a)**2 - 1.0_wp) - 0.5_wp*pi)
      end if
   end function opening_at

   !> A lattice of points, turned and shifted: pressed within a radius, but for every third, which hovers by
   !> up to 0.02 cells; outside with gaps by one of two laws; and a second layer half an edge below.
   function disc(radius, law, place, angle, on_nodes) result(points)
      real(wp), intent(in) :: radius, place(2), angle
      integer, intent(in) :: law
      logical, intent(in) :: on_nodes
      type(surface_point_t), allocatable :: points(:)
      real(wp) :: gap, x(2), out
      integer :: i, j, n
      type(surface_point_t) :: found(2*81*81)
      n = 0
      do j = -40, 40
         do i = -40, 40
            x = turned(edge*[i, j] + place, angle)
            out = norm2(x) - radius
            gap = gap_of(out, law)
            if (on_nodes) gap = interpolated(edge*[i, j] + place, radius, law, angle)
            n = n + 1
            found(n) = surface_point_t(x, 0.0_wp, edge, 1.0_wp)
            if (out < 0.0_wp .and. mod(i + 2*j, 3) == 0) &
               found(n) = surface_point_t(x, 0.02_wp*abs(sin(7.0_wp*i + j)), edge, 0.0_wp)
            if (out > 0.0_wp) found(n) = surface_point_t(x, gap, edge, 0.0_wp)
            n = n + 1
            found(n) = surface_point_t(x + 0.05_wp, found(n - 1)%gap + 0.45_wp, edge, 0.0_wp)
         end do
      end do
      points = pack(found(:n), found(:n)%gap < cell)
   end function disc

   !> The gap as a grid shows it, whose nodes have what one of the laws says: linear between them.
   pure real(wp) function interpolated(x, radius, law, angle) result(gap)
      real(wp), intent(in) :: x(2), radius, angle !< in the frame of the grid
      integer, intent(in) :: law
      real(wp) :: share(2)
      integer :: a, b, node(2)
      node = floor(x/cell)
      gap = 0.0_wp
      do b = 0, 1
         do a = 0, 1
            share = 1.0_wp - abs(x/cell - (node + [a, b]))
            gap = gap + product(share)*gap_of(norm2(turned(cell*(node + [a, b]), angle)) - radius, law)
         end do
      end do
   end function interpolated

   pure real(wp) function gap_of(out, law)
      real(wp), intent(in) :: out
      integer, intent(in) :: law
      gap_of = merge(0.1_wp*max(out, 0.0_wp)**1.5_wp, 0.36_wp*max(out, 0.0_wp), law == 1)
   end function gap_of

   pure function turned(x, angle) result(y)
      real(wp), intent(in) :: x(2), angle
      real(wp) :: y(2)
      y = [cos(angle)*x(1) - sin(angle)*x(2), sin(angle)*x(1) + cos(angle)*x(2)]
   end function turned

   !> A small contact has the same area after a turn by 90 degrees and in a mirror: squares turn with it.
   subroutine turns()
      type(surface_point_t), allocatable :: points(:), seen(:)
      real(wp) :: area, off
      integer :: n
      off = 0.0_wp
      do n = 1, 8
         points = disc(0.9_wp + 0.11_wp*n, 2, [0.11_wp, 0.2_wp]*edge, 0.1_wp*n, .false.)
         points%edge = 0.97_wp*edge ! no whole number of squares between the points
         area = area_of(points, whole())
         seen = points
         seen%place(1) = -points%place(2)
         seen%place(2) = points%place(1)
         off = max(off, abs(area_of(seen, whole())/area - 1.0_wp))
         seen = points
         seen%place(1) = -points%place(1)
         off = max(off, abs(area_of(seen, whole())/area - 1.0_wp))
      end do
      call test%check_close(off, 0.0_wp, 1.0e-6_wp, 'turned and mirrored')
   end subroutine turns

   !> Contact between two radii.
   subroutine ring()
      type(surface_point_t), allocatable :: points(:)
      real(wp) :: r
      integer :: p
      points = disc(8.0_wp, 2, [0.1_wp, 0.2_wp], 0.3_wp, .false.)
      do p = 1, size(points)
         r = norm2(points(p)%place)
         if (r < 4.0_wp .and. points(p)%gap < 0.4_wp) &
            points(p) = surface_point_t(points(p)%place, 0.36_wp*(4.0_wp - r), edge, 0.0_wp)
      end do
      points = pack(points, points%gap < cell)
      call test%check_close(area_of(points, whole()), 48.0_wp*pi, 0.04_wp*48.0_wp*pi, 'ring')
   end subroutine ring

   !> A square under the four faces of a pyramid; beside its ridges, away from the tip, points hover. A
   !> control: without pressure the corners are missing.
   subroutine ridges()
      type(surface_point_t) :: points(40*40)
      real(wp) :: x(2), out
      integer :: i, j, n
      n = 0
      do j = -20, 19
         do i = -20, 19
            x = edge*[i, j] + 0.25_wp
            out = maxval(abs(x)) - 4.0_wp
            n = n + 1
            points(n) = surface_point_t(x, max(0.0_wp, 0.36_wp*out), edge, 1.0_wp)
            if (out > 0.0_wp) points(n)%pressed = 0.0_wp
            points(n)%slope = merge([sign(1.0_wp, x(1)), 0.0_wp], [0.0_wp, sign(1.0_wp, x(2))], &
                                    abs(x(1)) > abs(x(2)))
            if (i == j .or. i == -1 - j) points(n)%slope = sign(sqrt(0.5_wp), x) ! on the ridge itself
            points(n)%pressure = merge(-0.1_wp, 1.0_wp, out > 0.0_wp)
            if (out < 0.0_wp .and. norm2(x) > 3.0_wp .and. abs(abs(x(1)) - abs(x(2))) < 1.1_wp) then
               points(n)%gap = 0.1_wp
               points(n)%pressed = 0.0_wp
            end if
         end do
      end do
      call test%check_close(area_of(points, whole()), 64.0_wp, 1.3_wp, 'ridges')
      ! metal beside the contact keeps stresses, but leaves the tool
      where (points%gap > 0.125_wp) points%pressure = 0.3_wp
      call test%check_close(area_of(points, whole()), 64.0_wp, 2.0_wp, 'ridges, stresses beside them')
      ! the tool's own pressures are known: stresses do not count
      points%pressure = 1.0_wp
      n = contacts(points)
      points%modulus = 1.0_wp
      call test%check(contacts(points) < n, 'ridges, pressures known')
      points%modulus = 0.0_wp
      points%pressure = 0.0_wp
      call test%check(area_of(points, whole()) < 60.0_wp, 'ridges that bear nothing')
   end subroutine ridges

   !> Number of points in contact.
   integer function contacts(points)
      type(surface_point_t), intent(in) :: points(:)
      type(patch_t) :: patch
      patch = patch_of(points, whole(), cell)
      contacts = count(patch%in_contact)
   end function contacts

end program contact_area
