!> Closed surfaces of triangles (theory.md, eq. pseudonormal): the signed distance against every triangle
!> asked by itself, and its side against the winding number, for a star with sharp spikes and hollows, a torus
!> and a blade; a cube against the exact distance; that the bound is one; that surfaces which are not closed,
!> twisted, inside out or flat are refused.
program surfaces
   use m_kinds, only: wp
   use m_constants, only: pi
   use m_communicator, only: communicator_t
   use m_vectors, only: cross
   use m_box, only: box_t
   use m_triangles, only: triangles_t, weld
   use m_closed_surface, only: closed_surface_t
   use m_height_field, only: close_heights
   use m_polygons, only: cut_ears
   use m_assertions, only: assertions_t
   use m_chance, only: chance_t
   implicit none
   type(communicator_t) :: comm
   type(assertions_t) :: test
   type(chance_t) :: chance
   call comm%start()
   call test%start(comm, 'surfaces')
   call compare('star', bent(36, 24, star))
   call compare('torus', bent(40, 24, ring))
   call compare('blade', blade())
   call cube()
   call heights()
   call polygons()
   call faults()
   call test%finish()

contains

   !> A grid of u by v patches over a surface that is a function of two angles, welded and closed up.
   type(triangles_t) function bent(u, v, at) result(made)
      integer, intent(in) :: u, v
      interface
         pure function at(a, b) result(x)
            import :: wp
            real(wp), intent(in) :: a, b !< 0 to 1
            real(wp) :: x(3)
         end function at
      end interface
      real(wp), allocatable :: place(:, :)
      integer, allocatable :: of(:, :)
      integer :: i, j, n
      character(len=:), allocatable :: fault
      allocate (place(3, 4*u*v), of(3, 2*u*v))
      n = 0
      do j = 0, v - 1
         do i = 0, u - 1
            place(:, 4*n + 1) = at(real(i, wp)/u, real(j, wp)/v)
            place(:, 4*n + 2) = at(real(mod(i + 1, u), wp)/u, real(j, wp)/v)
            place(:, 4*n + 3) = at(real(mod(i + 1, u), wp)/u, real(j + 1, wp)/v)
            place(:, 4*n + 4) = at(real(i, wp)/u, real(j + 1, wp)/v)
            of(:, 2*n + 1) = 4*n + [1, 2, 3]
            of(:, 2*n + 2) = 4*n + [1, 3, 4]
            n = n + 1
         end do
      end do
      call weld(place, of)
      made%corner = place
      made%of = of
      call made%close_up(fault)
      call test%check(fault == '', 'a made surface is closed', fault)
   end function bent

   !> About a sphere, with spikes and hollows.
   pure function star(a, b) result(x)
      real(wp), intent(in) :: a, b
      real(wp) :: x(3), radius
      radius = 1.0_wp + 0.6_wp*merge(1.0_wp, -1.0_wp, mod(nint(36*a) + nint(24*b), 2) == 0)
      if (b <= 0.0_wp .or. b >= 1.0_wp) then
         x = [0.0_wp, 0.0_wp, -cos(pi*nint(b))]
      else
         x = radius*[sin(pi*b)*cos(2*pi*a), sin(pi*b)*sin(2*pi*a), -cos(pi*b)]
      end if
   end function star

   pure function ring(a, b) result(x)
      real(wp), intent(in) :: a, b
      real(wp) :: x(3), c
      c = merge(0.0_wp, b, b >= 1.0_wp)
      x = [(1.0_wp + 0.4_wp*cos(2*pi*c))*cos(2*pi*a), (1.0_wp + 0.4_wp*cos(2*pi*c))*sin(2*pi*a), &
           0.4_wp*sin(2*pi*c)]
   end function ring

   !> Two long faces that meet at a tenth of a degree.
   type(triangles_t) function blade() result(made)
      character(len=:), allocatable :: fault
      real(wp) :: t
      t = 0.5_wp*tan(0.1_wp*pi/180.0_wp)
      made%corner = reshape([0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, t, 1.0_wp, &
                             1.0_wp, t, 1.0_wp, 0.0_wp, -t, 1.0_wp, 1.0_wp, -t], [3, 6])
      made%of = reshape([1, 3, 4, 1, 4, 2, 1, 2, 6, 1, 6, 5, 3, 5, 6, 3, 6, 4, 1, 5, 3, 2, 4, 6], [3, 8])
      call made%close_up(fault)
      call test%check(fault == '', 'the blade is closed', fault)
   end function blade

   subroutine compare(name, triangles)
      character(len=*), intent(in) :: name
      type(triangles_t), intent(in) :: triangles
      type(closed_surface_t) :: surface
      real(wp) :: x(3), distance, normal(3), expected, lower(3), upper(3), width, turns, ahead, unused(3), &
         limit, short
      integer :: n, t
      call surface%build(triangles)
      call triangles%bounds(lower, upper)
      width = maxval(upper - lower)
      do n = 1, 1500
         x = lower - 0.3_wp*width + (upper - lower + 0.6_wp*width)*chance%several(3, 0.0_wp, 1.0_wp)
         if (mod(n, 3) == 0) then ! near a corner
            t = 1 + int(size(triangles%corner, 2)*chance%between(0.0_wp, 1.0_wp))
            x = triangles%corner(:, t) + 0.02_wp*width*(chance%several(3, 0.0_wp, 1.0_wp) - 0.5_wp)
         end if
         call surface%distance_and_normal(x, distance, normal)
         expected = by_all(triangles, x)
         turns = winding(triangles, x)
         call test%check_close(abs(distance), expected, 1.0e-13_wp*width, name//': distance')
         if (expected > 1.0e-6_wp*width) &
            call test%check((distance < 0.0_wp) .eqv. turns > 0.5_wp, name// &
                            ': the side is that of the winding number')
         call test%check_close(norm2(normal), 1.0_wp, 1.0e-12_wp, name//': the normal has the length 1')
         call test%check(surface%min_distance(x) <= distance + 1.0e-12_wp*width, name//': the bound is one')
         limit = chance%between(0.0_wp, 2.0_wp)*expected
         call surface%distance_within(x, limit, short, unused)
         if (abs(distance) < limit) then
            call test%check_close([short, unused], [distance, normal], 1.0e-13_wp*width, name// &
                                  ': within a limit it is the same')
         else
            call test%check(abs(short) >= limit .and. short*distance >= 0.0_wp, name// &
                            ': beyond a limit it is beyond, on its side')
         end if
         if (expected > 1.0e-3_wp*width) then ! along the normal the distance grows as the way
            call surface%distance_and_normal(x - 0.5_wp*distance*normal, ahead, unused)
            call test%check_close(ahead, 0.5_wp*distance, 1.0e-12_wp*width, name// &
                                  ': half way back it is half')
         end if
      end do
      do t = 1, size(triangles%corner, 2)
         call surface%distance_and_normal(triangles%corner(:, t), distance, normal)
         call test%check_close(distance, 0.0_wp, 1.0e-13_wp*width, name//': corners lie on it')
      end do
   end subroutine compare

   !> Distance from all triangles: of the foot in the plane where it lies inside, else of the three edges.
   pure real(wp) function by_all(triangles, x) result(distance)
      type(triangles_t), intent(in) :: triangles
      real(wp), intent(in) :: x(3)
      real(wp) :: c(3, 3), n(3), off, foot(3), along
      integer :: t, k
      distance = huge(distance)
      do t = 1, triangles%count()
         c = triangles%corner(:, triangles%of(:, t))
         n = triangles%face_normal(:, t)
         off = dot_product(x - c(:, 1), n)
         foot = x - off*n
         if (all([(dot_product(cross(c(:, 1 + mod(k, 3)) - c(:, k), foot - c(:, k)), n) >= 0.0_wp, &
                   k=1, 3)])) distance = min(distance, abs(off))
         do k = 1, 3
            associate (e => c(:, 1 + mod(k, 3)) - c(:, k))
               along = min(1.0_wp, max(0.0_wp, dot_product(x - c(:, k), e)/dot_product(e, e)))
               distance = min(distance, norm2(x - c(:, k) - along*e))
            end associate
         end do
      end do
   end function by_all

   !> Solid angle of all triangles over that of a sphere: 1 inside, 0 outside (van Oosterom and Strackee
   !> 1983).
   pure real(wp) function winding(triangles, x) result(turns)
      type(triangles_t), intent(in) :: triangles
      real(wp), intent(in) :: x(3)
      real(wp) :: a(3), b(3), c(3)
      integer :: t
      turns = 0.0_wp
      do t = 1, triangles%count()
         a = triangles%corner(:, triangles%of(1, t)) - x
         b = triangles%corner(:, triangles%of(2, t)) - x
         c = triangles%corner(:, triangles%of(3, t)) - x
         turns = turns + 2.0_wp*atan2(dot_product(a, cross(b, c)), norm2(a)*norm2(b)*norm2(c) &
                 + dot_product(a, b)*norm2(c) + dot_product(b, c)*norm2(a) + dot_product(c, a)*norm2(b))
      end do
      turns = turns/(4.0_wp*pi)
   end function winding

   !> Corners of the unit cube and its triangles.
   type(triangles_t) function made_cube() result(made)
      integer :: i
      made%corner = reshape([(real([mod(i, 2), mod(i/2, 2), i/4], wp), i=0, 7)], [3, 8])
      made%of = reshape([1, 3, 4, 1, 4, 2, 5, 6, 8, 5, 8, 7, 1, 2, 6, 1, 6, 5, 3, 7, 8, 3, 8, 4, 1, 5, &
                         7, 1, 7, 3, 2, 4, 8, 2, 8, 6], [3, 12])
   end function made_cube

   subroutine cube()
      type(triangles_t) :: triangles
      type(closed_surface_t) :: surface
      type(box_t) :: box
      character(len=:), allocatable :: fault
      real(wp) :: x(3), distance, expected, normal(3), exact(3)
      integer :: n
      triangles = made_cube()
      call triangles%close_up(fault)
      call test%check(fault == '', 'the cube is closed', fault)
      call test%check_close(triangles%volume(), 1.0_wp, 1.0e-15_wp, 'volume of the cube')
      call surface%build(triangles)
      box%upper = 1.0_wp
      do n = 1, 2000
         x = 4.0_wp*chance%several(3, 0.0_wp, 1.0_wp) - 1.5_wp
         call surface%distance_and_normal(x, distance, normal)
         call box%distance_and_normal(x, expected, exact)
         call test%check_close(distance, expected, 1.0e-14_wp, 'distance from the cube')
         call test%check_close(normal, exact, 1.0e-11_wp, 'normal of the cube')
      end do
   end subroutine cube

   !> A roof of heights: closed, its volume exact, the highest place the origin.
   subroutine heights()
      type(triangles_t) :: triangles
      type(closed_surface_t) :: surface
      real(wp), allocatable :: place(:, :)
      integer, allocatable :: of(:, :)
      character(len=:), allocatable :: fault
      real(wp) :: height(5, 3), distance, normal(3)
      integer :: i
      height = spread([(2.0_wp - abs(i - 3), i=1, 5)], 2, 3)
      call close_heights(height, [1.0_wp, 0.5_wp], place, of)
      call move_alloc(place, triangles%corner)
      call move_alloc(of, triangles%of)
      call triangles%close_up(fault)
      call test%check(fault == '', 'heights are closed', fault)
      call test%check_close(triangles%volume(), 4.0_wp*(4.0_wp + 1.0_wp), 1.0e-13_wp, 'volume below a roof')
      call surface%build(triangles)
      call surface%distance_and_normal([0.0_wp, 0.2_wp, 0.3_wp], distance, normal)
      call test%check_close(distance, 0.3_wp, 1.0e-14_wp, 'above the ridge')
      call surface%distance_and_normal([1.0_wp, 0.3_wp, 0.0_wp], distance, normal)
      call test%check_close(distance, sqrt(0.5_wp), 1.0e-14_wp, 'above the slope')
   end subroutine heights

   !> Stars with hollows, turned in space and begun at any corner, cut into triangles: all of them look the
   !> star's way, and together they have its area.
   subroutine polygons()
      integer, parameter :: corners = 14
      real(wp) :: corner(3, corners), frame(3, 3), area(3), part(3), radius, whole
      integer :: triangle(3, corners - 2), begin, k, round, t
      logical :: good
      do round = 1, 40
         frame(:, 3) = chance%several(3, -1.0_wp, 1.0_wp)
         frame(:, 3) = frame(:, 3)/norm2(frame(:, 3))
         frame(:, 1) = cross(frame(:, 3), chance%several(3, -1.0_wp, 1.0_wp))
         frame(:, 1) = frame(:, 1)/norm2(frame(:, 1))
         frame(:, 2) = cross(frame(:, 3), frame(:, 1))
         begin = int(chance%between(0.0_wp, real(corners, wp)))
         do k = 1, corners
            radius = merge(1.0_wp, chance%between(0.1_wp, 0.5_wp), mod(k + begin, 2) == 0)
            corner(:, k) = 3.0_wp + radius*(cos(2*pi*(k + begin)/corners)*frame(:, 1) &
                                            + sin(2*pi*(k + begin)/corners)*frame(:, 2))
         end do
         call cut_ears(corner, triangle, good)
         call test%check(good, 'a star is cut')
         area = 0.0_wp
         whole = 0.0_wp
         do t = 1, corners - 2
            part = 0.5_wp*cross(corner(:, triangle(2, t)) - corner(:, triangle(1, t)), &
                                corner(:, triangle(3, t)) - corner(:, triangle(1, t)))
            area = area + part
            whole = whole + norm2(part)
         end do
         call test%check_close(dot_product(area, frame(:, 3)), whole, 1.0e-13_wp, &
                               'triangles of a star all look its way')
         area = 0.0_wp
         do k = 1, corners
            area = area + 0.5_wp*cross(corner(:, k) - 3.0_wp, corner(:, 1 + mod(k, corners)) - 3.0_wp)
         end do
         call test%check_close(whole, norm2(area), 1.0e-13_wp, 'their area is that of the star')
      end do
   end subroutine polygons

   !> Each must be refused, with what is wrong first.
   subroutine faults()
      type(triangles_t) :: triangles
      triangles = made_cube()
      triangles%of = triangles%of(:, 2:)
      call refused(triangles, 'is not closed: the edge from ', 'a triangle is missing')
      triangles = made_cube()
      triangles%of(:, 5) = triangles%of([1, 3, 2], 5)
      call refused(triangles, 'is not a closed surface: the edge from ', 'a triangle is turned over')
      triangles = made_cube()
      triangles%of = triangles%of([1, 3, 2], :)
      call refused(triangles, 'is inside out', 'all triangles are turned over')
      triangles = made_cube()
      triangles%corner(:, 2) = 0.5_wp*(triangles%corner(:, 1) + triangles%corner(:, 4))
      call refused(triangles, 'has a degenerate triangle', 'three corners on a line')
      triangles%of = triangles%of(:, :0)
      call refused(triangles, 'has no triangles', 'no triangles')
   end subroutine faults

   subroutine refused(triangles, expected, name)
      type(triangles_t), intent(inout) :: triangles
      character(len=*), intent(in) :: expected, name
      character(len=:), allocatable :: fault
      call triangles%close_up(fault)
      call test%check(index(fault, expected) == 1, 'refused: '//name, fault)
   end subroutine refused

end program surfaces
