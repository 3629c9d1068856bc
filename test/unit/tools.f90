!> Tools: the gap is the distance to the surface, found here by searching the surface; the normal is its
!> gradient; the way is the integral of the speed.
program tools
   use m_kinds, only: wp
   use m_constants, only: pi
   use m_communicator, only: communicator_t
   use m_scene, only: tool_spec_t
   use m_vectors, only: cross, part_across
   use m_sphere, only: sphere_t
   use m_cone, only: cone_t
   use m_flat, only: flat_t
   use m_berkovich, only: berkovich_t
   use m_regular_pyramid, only: regular_pyramid_t
   use m_roller, only: roller_t
   use m_wedge, only: wedge_t
   use m_profile, only: profile_t
   use m_tool, only: tool_t, make_tool
   use m_assertions, only: assertions_t
   use m_chance, only: chance_t, keep_worst, say
   implicit none
   character(len=9), parameter :: names(8) = ['sphere   ', 'cone     ', 'flat     ', 'berkovich', &
                                              'cylinder ', 'wedge    ', 'pyramid  ', &
                                              'profile  ']
   !> in this order
   integer, parameter :: sphere = 1, cone = 2, flat = 3, berkovich = 4, cylinder = 5, wedge = 6, &
                         pyramid = 7, profile = 8
   real(wp), parameter :: reach = 6.0_wp !< of what is searched of the infinite tools
   type(communicator_t) :: comm
   type(assertions_t) :: test
   type(chance_t) :: chance
   integer :: shape_number, round
   integer :: kind                       !< of the last tool that was made
   real(wp) :: radius, half_angle, edge(3) !< of it
   integer :: faces = 3
   real(wp) :: radii(3), heights(3) !< of a profile
   call comm%start()
   call test%start(comm, 'tools')
   do shape_number = 1, size(names)
      call distances(shape_number)
      call convexity(shape_number)
   end do
   call special_places()
   do shape_number = 1, 3
      call rounded(shape_number)
   end do
   call hollow_profile()
   do round = 1, 50
      call travel()
   end do
   call test%finish()

contains

   !> Size about 1, any direction, anywhere.
   function some_tool(shape_number) result(tool)
      integer, intent(in) :: shape_number
      type(tool_t) :: tool
      type(tool_spec_t) :: spec
      kind = shape_number
      radius = chance%between(0.5_wp, 1.5_wp)
      half_angle = chance%between(10.0_wp, 80.0_wp)*pi/180.0_wp
      spec%tip = chance%several(3, -2.0_wp, 2.0_wp)
      spec%axis = chance%several(3, -1.0_wp, 1.0_wp)
      if (chance%between(0.0_wp, 1.0_wp) < 0.3_wp) spec%axis = [0.0_wp, 0.0_wp, -1.0_wp]
      spec%axis = spec%axis/norm2(spec%axis)
      edge = chance%several(3, -1.0_wp, 1.0_wp)
      faces = 3
      if (kind == pyramid) faces = 3 + int(chance%between(0.0_wp, 5.9_wp))
      radii = radius*[0.3_wp, 0.8_wp, 1.0_wp]
      heights = [0.0_wp, 0.4_wp, 1.0_wp]
      if (kind == profile .and. radius > 1.0_wp) radii(1) = 0.0_wp
      select case (kind)
      case (profile); spec%shape = profile_t(radii=radii, heights=heights)
      case (sphere); spec%shape = sphere_t(radius=radius)
      case (cone); spec%shape = cone_t(half_angle=half_angle)
      case (flat); spec%shape = flat_t(radius=radius)
      case (berkovich); spec%shape = berkovich_t(half_angle=half_angle, edge=edge)
      case (cylinder); spec%shape = roller_t(radius=radius, edge=edge)
      case (wedge); spec%shape = wedge_t(half_angle=half_angle, edge=edge)
      case (pyramid); spec%shape = regular_pyramid_t(half_angle=half_angle, edge=edge, sides=faces)
      end select
      spec%times = [0.0_wp]
      spec%speeds = [1.0_wp]
      tool = make_tool(spec)
      tool%freedoms(1)%travel = chance%between(-1.0_wp, 1.0_wp)
      call tool%settle()
   end function some_tool

   !> Two unit vectors across the axis.
   subroutine across(axis, u, v)
      real(wp), intent(in) :: axis(3)
      real(wp), intent(out) :: u(3), v(3)
      u = 0.0_wp
      u(minloc(abs(axis), dim=1)) = 1.0_wp
      u = u - dot_product(u, axis)*axis
      u = u/norm2(u)
      v = [axis(2)*u(3) - axis(3)*u(2), axis(3)*u(1) - axis(1)*u(3), axis(1)*u(2) - axis(2)*u(1)]
   end subroutine across

   !> Unit vector across the axis nearest to the edge, and the one across both.
   subroutine across_edge(tool, u, v)
      type(tool_t), intent(in) :: tool
      real(wp), intent(out) :: u(3), v(3)
      associate (axis => tool%spec%axis)
         u = part_across(edge, axis)
         v = [axis(2)*u(3) - axis(3)*u(2), axis(3)*u(1) - axis(1)*u(3), axis(1)*u(2) - axis(2)*u(1)]
      end associate
   end subroutine across_edge

   !> A point of the surface: s in [0, 1] along the profile, angle about the axis; for rollers and wedges s
   !> goes round the profile, and the angle along the line.
   function surface(tool, s, angle) result(x)
      type(tool_t), intent(in) :: tool
      real(wp), intent(in) :: s, angle
      real(wp) :: x(3), u(3), v(3), height, off_axis, turn
      select case (kind)
      case (sphere)
         height = radius*(1.0_wp - cos(pi*s))
         off_axis = radius*sin(pi*s)
      case (cone)
         height = reach*s*cos(half_angle)
         off_axis = reach*s*sin(half_angle)
      case (profile)
         height = reach*s
         off_axis = radius_at(height)
      case default ! half of the parameter for the face, half for the side
         off_axis = radius*min(1.0_wp, 2.0_wp*s)
         height = reach*max(0.0_wp, 2.0_wp*s - 1.0_wp)
      end select
      call across(tool%spec%axis, u, v)
      select case (kind)
      case (berkovich, pyramid) ! as far from the axis as the face is in that direction, whose middle lies in
                                ! the direction of the edge
         call across_edge(tool, u, v)
         height = reach*s
         off_axis = height*tan(half_angle)/cos(modulo(angle + pi/faces, 2.0_wp*pi/faces) - pi/faces)
      case (cylinder)
         call across_edge(tool, u, v)
         turn = 2.0_wp*pi*s
         x = tool%spec%tip + (tool%freedoms(1)%travel - radius*(1.0_wp - cos(turn)))*tool%spec%axis &
             + radius*sin(turn)*v + (angle - pi)*reach*u
         return
      case (wedge)
         call across_edge(tool, u, v)
         x = tool%spec%tip + (tool%freedoms(1)%travel - reach*abs(2.0_wp*s - 1.0_wp)*cos(half_angle)) &
             *tool%spec%axis + reach*(2.0_wp*s - 1.0_wp)*sin(half_angle)*v + (angle - pi)*reach*u
         return
      end select
      x = tool%spec%tip + (tool%freedoms(1)%travel - height)*tool%spec%axis &
          + off_axis*(cos(angle)*u + sin(angle)*v)
   end function surface

   !> Of the profile at a height above 0.
   pure real(wp) function radius_at(height)
      real(wp), intent(in) :: height
      radius_at = min(radii(1) + (radii(2) - radii(1))*height/heights(2), &
                      radii(2) + (radii(3) - radii(2))*(height - heights(2))/(heights(3) - heights(2)))
   end function radius_at

   !> Whether a place is inside, from what the shapes are.
   logical function inside(tool, x)
      type(tool_t), intent(in) :: tool
      real(wp), intent(in) :: x(3)
      real(wp) :: tip(3), height, off_axis, u(3), v(3), off(2)
      integer :: k
      call across_edge(tool, u, v)
      tip = tool%spec%tip + tool%freedoms(1)%travel*tool%spec%axis
      height = dot_product(tip - x, tool%spec%axis)
      off_axis = norm2(tip - x - height*tool%spec%axis)
      select case (kind)
      case (sphere)
         inside = norm2(x - tip + radius*tool%spec%axis) < radius
      case (profile)
         inside = height > 0.0_wp .and. off_axis < radius_at(height)
      case (cone)
         inside = height > 0.0_wp .and. off_axis < height*tan(half_angle)
      case (berkovich, pyramid)
         off = [dot_product(x - tip, u), dot_product(x - tip, v)]
         inside = maxval(off(1)*cos(2.0_wp*pi*[(k, k=1, faces)]/faces) &
                         + off(2)*sin(2.0_wp*pi*[(k, k=1, faces)]/faces)) < height*tan(half_angle)
      case (cylinder)
         inside = (height - radius)**2 + dot_product(x - tip, v)**2 < radius**2
      case (wedge)
         inside = abs(dot_product(x - tip, v)) < height*tan(half_angle)
      case default
         inside = height > 0.0_wp .and. off_axis < radius
      end select
   end function inside

   !> Distance from the surface of a pyramid: inside, of the nearest plane; outside, of the nearest point of
   !> all half spaces, to which projections onto one after the other lead (Dykstra's algorithm).
   real(wp) function projected_distance(tool, x) result(distance)
      type(tool_t), intent(in) :: tool
      real(wp), intent(in) :: x(3)
      integer, parameter :: rounds = 3000
      real(wp) :: face(3, faces), gone(3, faces), place(3), before(3), u(3), v(3), tip(3)
      integer :: k, n
      call across_edge(tool, u, v)
      tip = tool%spec%tip + tool%freedoms(1)%travel*tool%spec%axis
      do k = 1, faces
         face(:, k) = cos(half_angle)*(cos(2.0_wp*pi*k/faces)*u + sin(2.0_wp*pi*k/faces)*v) &
            + sin(half_angle)*tool%spec%axis
      end do
      distance = -maxval(matmul(x - tip, face))
      if (distance >= 0.0_wp) return
      place = x - tip
      gone = 0.0_wp
      do n = 1, rounds
         do k = 1, faces
            before = place + gone(:, k)
            place = before - max(0.0_wp, dot_product(before, face(:, k)))*face(:, k)
            gone(:, k) = before - place
         end do
      end do
      distance = norm2(x - tip - place)
   end function projected_distance

   !> Smallest distance from the surface: a coarse search of each of its quarters, then ever finer ones about
   !> the best places.
   real(wp) function searched_distance(tool, x) result(best)
      type(tool_t), intent(in) :: tool
      real(wp), intent(in) :: x(3)
      integer, parameter :: across_s = 60, around = 24, quarters = 6
      real(wp) :: s, angle, nearest, best_s, best_angle, distance
      integer :: i, j, quarter, wide
      if (kind == profile) then
         best = distance_in_plane(tool, x)
         return
      end if
      best = projected_distance(tool, x)
      if (kind == pyramid) return ! a search sticks at its ridges
      best = huge(best)
      do quarter = 0, quarters - 1
         nearest = huge(nearest)
         best_s = 0.0_wp
         best_angle = 0.0_wp
         do i = 0, across_s
            do j = quarter*(around/quarters), (quarter + 1)*(around/quarters) - 1
               s = real(i, wp)/across_s
               angle = 2.0_wp*pi*j/around
               distance = norm2(x - surface(tool, s, angle))
               if (distance >= nearest) cycle
               nearest = distance
               best_s = s
               best_angle = angle
            end do
         end do
         do wide = 1, 2 ! narrow steps follow a curved valley, wide ones a long one
            s = best_s
            angle = best_angle
            distance = nearest
            call refine(tool, x, merge(0.2_wp, 1.0_wp/across_s, wide == 2), s, angle, distance)
            best = min(best, distance)
         end do
      end do
   end function searched_distance

   !> Smallest distance from the lines of a profile, in the plane of the axis and the place: along each of
   !> them it is convex.
   real(wp) function distance_in_plane(tool, x) result(best)
      type(tool_t), intent(in) :: tool
      real(wp), intent(in) :: x(3)
      real(wp) :: way(3), place(2), lines(2, 0:4), ends(2), thirds(2), distance(2)
      integer :: k, n, side
      way = x - tool%spec%tip - tool%freedoms(1)%travel*tool%spec%axis
      place(2) = -dot_product(way, tool%spec%axis)
      place(1) = norm2(way + place(2)*tool%spec%axis)
      lines(:, 0) = 0.0_wp
      lines(:, 1) = [radii(1), heights(1)]
      lines(:, 2) = [radii(2), heights(2)]
      lines(:, 3) = [radii(3), heights(3)]
      lines(:, 4) = [radius_at(reach), reach]
      best = huge(best)
      do k = 1, 4
         ends = [0.0_wp, 1.0_wp]
         do n = 1, 120
            thirds = ends(1) + (ends(2) - ends(1))*[1.0_wp, 2.0_wp]/3.0_wp
            do side = 1, 2
               distance(side) = norm2(place - lines(:, k - 1) &
                                      - thirds(side)*(lines(:, k) - lines(:, k - 1)))
            end do
            if (distance(1) <= distance(2)) then
               ends(2) = thirds(2)
            else
               ends(1) = thirds(1)
            end if
         end do
         best = min(best, minval(distance))
      end do
   end function distance_in_plane

   !> Follow the distance down from a place of the surface.
   subroutine refine(tool, x, first_width, best_s, best_angle, nearest)
      type(tool_t), intent(in) :: tool
      real(wp), intent(in) :: x(3), first_width
      real(wp), intent(inout) :: best_s, best_angle, nearest
      real(wp) :: s, angle, width_s, width_angle, distance, try_s, try_angle
      integer :: i, j, round
      width_s = first_width
      width_angle = pi ! at the tip all angles are one: start with the whole circle
      do round = 1, 150
         s = best_s
         angle = best_angle
         do i = -2, 2
            do j = -2, 2
               try_s = s + 0.5_wp*i*width_s
               if (kind /= cylinder) try_s = min(max(try_s, 0.0_wp), 1.0_wp) ! a roller goes round
               try_angle = angle + 0.5_wp*j*width_angle
               distance = norm2(x - surface(tool, try_s, try_angle))
               if (distance >= nearest) cycle
               nearest = distance
               best_s = try_s
               best_angle = try_angle
            end do
         end do
         width_s = 0.85_wp*width_s
         width_angle = 0.85_wp*width_angle
      end do
   end subroutine refine

   subroutine distances(shape_number)
      integer, intent(in) :: shape_number
      type(tool_t) :: tool
      real(wp) :: x(3), gap, normal(3), off(3), slope(3), gaps(2), sides(3, 2), unused(3), h, shift
      integer, parameter :: places = 400
      integer :: k, axis, side, inner, kinks
      character(len=:), allocatable :: name
      name = trim(names(shape_number))
      off = 0.0_wp
      inner = 0
      kinks = 0
      h = 1.0e-5_wp
      do k = 1, places
         tool = some_tool(shape_number)
         x = tool%spec%tip + tool%freedoms(1)%travel*tool%spec%axis + chance%several(3, -2.0_wp, 2.0_wp)
         if (mod(k, 3) == 0) x = surface(tool, chance%between(0.05_wp, 0.5_wp), &
                                         chance%between(0.0_wp, 6.0_wp)) + chance%several(3, -0.1_wp, 0.1_wp)
         call tool%gap_and_normal(x, gap, normal)
         if (inside(tool, x)) inner = inner + 1
         call keep_worst(off(1), gap - merge(-1.0_wp, 1.0_wp, inside(tool, x))*searched_distance(tool, x))
         call keep_worst(off(2), norm2(normal) - 1.0_wp)
         do axis = 1, 3
            do side = 1, 2
               unused = x
               unused(axis) = x(axis) + (2*side - 3)*h
               call tool%gap_and_normal(unused, gaps(side), sides(:, side))
            end do
            slope(axis) = (gaps(2) - gaps(1))/(2.0_wp*h)
            if (norm2(sides(:, 2) - sides(:, 1)) > 0.02_wp) exit
         end do
         if (axis <= 3) then
            kinks = kinks + 1 ! two surface points are nearest: no gradient there
         else
            call keep_worst(off(3), maxval(abs(slope - normal)))
         end if
         ! the tool that has moved is the tool at rest seen from a place moved the other way
         shift = chance%between(-1.0_wp, 1.0_wp)
         tool%freedoms(1)%travel = tool%freedoms(1)%travel + shift
         call tool%settle()
         call tool%gap_and_normal(x + shift*tool%spec%axis, gaps(1), sides(:, 1))
         call test%check_close([gaps(1), sides(:, 1)], [gap, normal], 1.0e-12_wp, name// &
                               ': moves along its axis')
      end do
      call say(name//': gap against searched distance (size about 1)', off(1))
      call say(name//': normal against gradient of the gap', off(3))
      print '(3x,a,i0,a,i0,a,i0)', name//': inside ', inner, ' of ', places, ' places, next to a ridge ', &
         kinks
      call test%check_close(off(1), 0.0_wp, 1.0e-9_wp, name//': the gap is the signed distance')
      call test%check_close(off(2), 0.0_wp, 1.0e-14_wp, name//': the normal has length 1')
      call test%check_close(off(3), 0.0_wp, 1.0e-6_wp, name//': the normal is the gradient of the gap')
      call test%check(inner > places/20 .and. inner < places - places/20, name// &
                      ': places inside and outside were tried')
      call test%check(kinks < places/10, name//': few places have no gradient')
   end subroutine distances

   !> Between two places the gap is not above the straight line through theirs.
   subroutine convexity(shape_number)
      integer, intent(in) :: shape_number
      type(tool_t) :: tool
      real(wp) :: a(3), b(3), gap_a, gap_b, gap, share, above, normal(3)
      integer :: k
      above = -huge(above)
      do k = 1, 4000
         tool = some_tool(shape_number)
         a = tool%spec%tip + chance%several(3, -2.0_wp, 2.0_wp)
         b = tool%spec%tip + chance%several(3, -2.0_wp, 2.0_wp)
         share = chance%between(0.0_wp, 1.0_wp)
         call tool%gap_and_normal(a, gap_a, normal)
         call tool%gap_and_normal(b, gap_b, normal)
         call tool%gap_and_normal(share*a + (1.0_wp - share)*b, gap, normal)
         above = max(above, gap - share*gap_a - (1.0_wp - share)*gap_b)
      end do
      call test%check(above < 1.0e-13_wp, trim(names(shape_number))//': the gap is convex')
   end subroutine convexity

   !> Its tip at the origin, pointing down.
   function upright_tool(shape_number) result(tool)
      integer, intent(in) :: shape_number
      type(tool_t) :: tool
      tool = some_tool(shape_number)
      tool%spec%axis = [0.0_wp, 0.0_wp, -1.0_wp]
      tool%spec%tip = 0.0_wp
      tool = make_tool(tool%spec)
   end function upright_tool

   !> On the axis, at the tip, at the centre: a unit normal and the right gap, and no division by zero.
   subroutine special_places()
      type(tool_t) :: tool
      real(wp) :: gap, normal(3)
      integer :: k
      do k = 1, size(names)
         tool = upright_tool(k)
         call tool%gap_and_normal([0.0_wp, 0.0_wp, -0.3_wp], gap, normal)
         call test%check_close([gap, normal], [0.3_wp, 0.0_wp, 0.0_wp, -1.0_wp], 1.0e-14_wp, &
                               trim(names(k))//': below the tip')
         call tool%gap_and_normal([0.0_wp, 0.0_wp, 0.0_wp], gap, normal)
         call test%check_close([gap, normal], [0.0_wp, 0.0_wp, 0.0_wp, -1.0_wp], 1.0e-14_wp, &
                               trim(names(k))//': at the tip')
         call tool%gap_and_normal([0.0_wp, 0.0_wp, radius], gap, normal)
         call test%check(gap < 0.0_wp, trim(names(k))//': on the axis inside')
         call test%check_close(norm2(normal), 1.0_wp, 1.0e-14_wp, trim(names(k))// &
                               ': on the axis inside there is a normal')
      end do
   end subroutine special_places

   !> A rounded tip: the distance is that from a sharp tool within it, by the search of its surface, less the
   !> radius; its tip is where the scene says; a sphere of the radius touches it there, and no other place is
   !> nearer to the middle of that.
   subroutine rounded(number)
      integer, intent(in) :: number
      integer, parameter :: kinds(3) = [cone, berkovich, pyramid]
      type(tool_t) :: sharp, tool
      type(tool_spec_t) :: spec
      real(wp) :: x(3), gap, normal(3), off(2), round, within
      integer :: k
      off = 0.0_wp
      do k = 1, 100
         sharp = some_tool(kinds(number))
         sharp%freedoms(1)%travel = 0.0_wp
         call sharp%settle()
         round = chance%between(0.1_wp, 1.0_wp)
         spec = sharp%spec
         spec%tip = sharp%spec%tip + round*sharp%spec%axis
         deallocate (spec%shape)
         select case (kinds(number))
         case (cone); allocate (spec%shape, source=cone_t(half_angle=half_angle, tip_radius=round))
         case (berkovich); allocate (spec%shape, source=berkovich_t(half_angle=half_angle, edge=edge, &
                                                                    tip_radius=round))
         case (pyramid)
            allocate (spec%shape, source=regular_pyramid_t(half_angle=half_angle, edge=edge, &
                                                           tip_radius=round, sides=faces))
         end select
         tool = make_tool(spec)
         x = spec%tip + chance%several(3, -2.0_wp, 2.0_wp)
         within = merge(-1.0_wp, 1.0_wp, inside(sharp, x))
         call tool%gap_and_normal(x, gap, normal)
         call keep_worst(off(1), gap - (within*searched_distance(sharp, x) - round))
         call tool%gap_and_normal(spec%tip + 0.3_wp*spec%axis, gap, normal)
         call keep_worst(off(2), max(abs(gap - 0.3_wp), maxval(abs(normal - spec%axis))))
      end do
      call say(trim(names(kinds(number)))//', rounded: gap against searched distance', off(1))
      call test%check_close(off(1), 0.0_wp, 1.0e-9_wp, trim(names(kinds(number)))// &
                            ', rounded: the gap is the signed distance')
      call test%check_close(off(2), 0.0_wp, 1.0e-13_wp, trim(names(kinds(number)))// &
                            ', rounded: below the tip')
   end subroutine rounded

   !> A profile that is hollow, a pin of radius 1 below a plate: not convex; distances in the corner between
   !> them, whose lines are nearest by turns, and along the flat end.
   subroutine hollow_profile()
      type(profile_t) :: shape
      real(wp) :: gap, normal(3)
      shape = profile_t(radii=[1.0_wp, 1.0_wp, 4.0_wp], heights=[0.0_wp, 2.0_wp, 5.0_wp])
      call shape%prepare([0.0_wp, 0.0_wp, -1.0_wp])
      call test%check(.not. shape%is_convex(), 'profile: a hollow one is not convex')
      call shape%distance_and_normal([0.0_wp, 1.25_wp, 1.0_wp], gap, normal)
      call test%check_close([gap, normal], [0.25_wp, 0.0_wp, 1.0_wp, 0.0_wp], 1.0e-14_wp, &
                            'profile: beside the pin')
      call shape%distance_and_normal([3.0_wp, 0.0_wp, 3.0_wp], gap, normal)
      call test%check_close([gap, normal], [1.0_wp, 1.0_wp, 0.0_wp, -1.0_wp]/sqrt(2.0_wp), 1.0e-14_wp, &
                            'profile: below the plate')
      call shape%distance_and_normal([9.0_wp, 0.0_wp, 10.5_wp], gap, normal)
      call test%check_close([gap, normal], [-0.5_wp, 1.0_wp, 0.0_wp, -1.0_wp]/sqrt(2.0_wp), 1.0e-14_wp, &
                            'profile: inside, beyond its last point')
      call shape%distance_and_normal([0.5_wp, 0.0_wp, -0.5_wp], gap, normal)
      call test%check_close([gap, normal], [0.5_wp, 0.0_wp, 0.0_wp, -1.0_wp], 1.0e-14_wp, &
                            'profile: below its flat end')
   end subroutine hollow_profile

   !> A random table of speeds; between random times the way is the integral.
   subroutine travel()
      type(tool_spec_t) :: spec
      type(tool_t) :: tool
      integer, parameter :: slices = 4000
      real(wp) :: from, to, whole, time, edges(2), largest
      integer :: k, n
      n = 1 + int(chance%between(0.0_wp, 5.0_wp))
      spec%times = [(real(k, wp) + chance%between(0.0_wp, 0.9_wp), k=1, n)]
      spec%speeds = chance%several(n, -2.0_wp, 2.0_wp)
      spec%shape = sphere_t(radius=1.0_wp)
      tool = make_tool(spec)
      call test%check_close(tool%freedoms(1)%speed, tool%freedoms(1)%speed_at(0.0_wp), 0.0_wp, &
                            'a tool starts with its speed')
      do k = 1, n
         call test%check_close(tool%freedoms(1)%speed_at(spec%times(k)), spec%speeds(k), 1.0e-14_wp, &
                               'speeds at the given times')
      end do
      call test%check_close([tool%freedoms(1)%speed_at(-5.0_wp), tool%freedoms(1)%speed_at(99.0_wp)], &
                            [spec%speeds(1), spec%speeds(n)], 0.0_wp, &
                            'speeds are held outside the given times')
      do k = 1, n - 1
         time = 0.3_wp*spec%times(k) + 0.7_wp*spec%times(k + 1)
         call test%check_close(tool%freedoms(1)%speed_at(time), 0.3_wp*spec%speeds(k) &
                               + 0.7_wp*spec%speeds(k + 1), 1.0e-14_wp, 'speeds are linear in between')
      end do
      from = chance%between(0.0_wp, 4.0_wp)
      to = from + chance%between(0.0_wp, 4.0_wp)
      whole = 0.0_wp
      do k = 1, slices ! the midpoint rule, exact but in the few slices with a kink
         edges = from + (to - from)*[k - 1, k]/real(slices, wp)
         whole = whole + tool%freedoms(1)%speed_at(0.5_wp*sum(edges))*(edges(2) - edges(1))
      end do
      call test%check_close(tool%freedoms(1)%travel_between(from, to), whole, 1.0e-5_wp, &
                            'the way is the integral of the speed')
      time = chance%between(from, to)
      call test%check_close(tool%freedoms(1)%travel_between(from, time) &
                            + tool%freedoms(1)%travel_between(time, to), &
                            tool%freedoms(1)%travel_between(from, to), &
                            1.0e-14_wp, 'ways add up')
      call test%check_close(tool%freedoms(1)%travel_between(from, from), 0.0_wp, 0.0_wp, 'no time, no way')
      tool%freedoms(1)%speed = 3.0_wp
      call tool%settle()
      largest = maxval(abs(tool%velocity - 3.0_wp*tool%spec%axis))
      call test%check_close(largest, 0.0_wp, 0.0_wp, 'the velocity is along the axis')
   end subroutine travel

end program tools
