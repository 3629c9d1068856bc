!> Surfaces of other bodies as elements meet them (theory.md, eqs partner-gap, partner-foot, partner-normal):
!> gap, normal and place of the force between two spheres, two cylinders and two planes of irregular elements;
!> the corner of a box over a plane.
program partner_surface
   use m_kinds, only: wp
   use m_constants, only: pi
   use m_communicator, only: communicator_t
   use m_vectors, only: cross
   use m_surface_elements, only: element_t, surface_elements_t
   use m_partner_surface, only: meeting_t, find_meetings, reach_of
   use m_assertions, only: assertions_t
   use m_chance, only: chance_t
   implicit none
   real(wp), parameter :: edge = 0.5_wp
   type(communicator_t) :: comm
   type(assertions_t) :: test
   type(chance_t) :: chance
   call comm%start()
   call test%start(comm, 'partner_surface')
   call spheres('spheres', 6.0_wp, 6.0_wp, 0.001_wp)
   call spheres('a small sphere on a large one', 3.0_wp, 12.0_wp, 0.012_wp)
   call spheres('a sphere in a hollow one', 6.0_wp, -9.0_wp, 0.001_wp)
   call cylinder()
   call fit('a ball in a socket', 0.0_wp, 0.0_wp, 1.0e-12_wp)
   call fit('a shaft in a bore', 1.0_wp, 0.0_wp, 1.0e-12_wp)
   call fit('a bent tube in another', 0.7_wp, 0.0_wp, 3.0e-3_wp)
   call fit('control: normals of the lattice, not of the surface', 0.0_wp, 0.1_wp, -2.0e-2_wp)
   call planes()
   call corner()
   call test%finish()

contains

   !> An element of a field at a face with a normal; its force acts `in` below the face.
   pure type(element_t) function element(field, face, normal, in)
      integer, intent(in) :: field
      real(wp), intent(in) :: face(3), normal(3), in
      element%field = field
      element%face = face
      element%normal = normal
      element%point = face - in*normal
      element%area = edge**2
      element%edge = edge
      element%mass = 1.0_wp
   end function element

   !> Meetings of elements that are all this rank's.
   subroutine meet(list, meetings, count)
      type(element_t), intent(in) :: list(:)
      type(meeting_t), allocatable, intent(inout) :: meetings(:)
      integer, intent(out) :: count
      type(surface_elements_t) :: elements
      elements%list = list
      elements%own = size(list)
      elements%count = size(list)
      elements%longest = edge
      call elements%sort(2, reach_of*edge)
      call find_meetings(elements, meetings, count)
   end subroutine meet

   !> Elements about as dense as those of a lattice, at irregular places on the part of a sphere around a
   !> pole.
   function cap(field, centre, radius, pole, outward, in) result(list)
      integer, intent(in) :: field
      real(wp), intent(in) :: centre(3), radius, pole(3), outward, in
      type(element_t), allocatable :: list(:)
      real(wp) :: n(3)
      integer :: k
      allocate (list(0))
      do k = 1, nint(24*radius**2/edge**2) ! half of the places in the cube are not in the ball
         n = chance%several(3, -1.0_wp, 1.0_wp)
         if (norm2(n) > 1.0_wp) cycle
         n = n/norm2(n)
         if (dot_product(n, pole) < 1.0_wp - (3.0_wp/radius)**2) cycle
         list = [list, element(field, centre + radius*n, outward*n, in)]
      end do
   end function cap

   !> Two spheres of radii a and b; b below 0 is a hollow of that radius that holds a. Gaps are right within
   !> so much of an edge, and a hundredth of themselves; those of planes in place of the spheres are 0.03 to
   !> 0.06 edges off.
   subroutine spheres(name, a, b, bound)
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: a, b, bound
      real(wp) :: pole(3), centre(3, 2), n(3), place(3), gap, radius(2)
      type(element_t), allocatable :: list(:)
      type(meeting_t), allocatable :: meetings(:)
      real(wp), parameter :: apart = 0.03_wp, in = 0.01_wp
      integer :: count, m
      pole = chance%several(3, -1.0_wp, 1.0_wp)
      pole = pole/norm2(pole)
      radius = [a, abs(b)]
      centre(:, 1) = 0.0_wp
      centre(:, 2) = (a + b + apart)*pole
      list = [cap(1, centre(:, 1), a, pole, 1.0_wp, in), cap(2, centre(:, 2), abs(b), -sign(1.0_wp, b)*pole, &
             sign(1.0_wp, b), in)]
      call meet(list, meetings, count)
      call test%check(count > 20, name//': elements meet')
      do m = 1, count
         associate (it => list(meetings(m)%element), other => meetings(m)%field)
            n = it%face - centre(:, other)
            gap = norm2(n) - radius(other)
            if (other == 2 .and. b < 0.0_wp) gap = -gap
            call test%check_close(meetings(m)%gap, gap, bound*edge + 0.01_wp*gap, name//': gap')
            place = it%face - (gap + in)*meetings(m)%normal
            call test%check_close(norm2(meetings(m)%point - place), 0.0_wp, bound*edge + 0.01_wp*gap, &
                                  name//': place')
            n = n/norm2(n)*merge(-1, 1, other == 2 .and. b < 0.0_wp)
            n = n - it%normal
            call test%check_close(norm2(cross(meetings(m)%normal, n/norm2(n))), 0.0_wp, 0.03_wp, &
                                  name//': normal')
         end associate
      end do
   end subroutine spheres

   !> A cylinder on a plane: it bends one way only.
   subroutine cylinder()
      type(element_t), allocatable :: list(:)
      type(meeting_t), allocatable :: meetings(:)
      real(wp), parameter :: radius = 6.0_wp, apart = 0.02_wp
      real(wp) :: angle
      integer :: count, i, j, m
      allocate (list(0))
      do j = 1, 16
         do i = 1, 16
            angle = (i - 8.5_wp)*edge/radius
            list = [list, element(1, [(i - 8.5_wp)*edge, j*edge, 0.0_wp], [0.0_wp, 0.0_wp, 1.0_wp], 0.0_wp), &
                    element(2, [radius*sin(angle), (j + 0.3_wp)*edge, apart + radius*(1.0_wp - cos(angle))], &
                            [sin(angle), 0.0_wp, -cos(angle)], 0.0_wp)]
         end do
      end do
      call meet(list, meetings, count)
      do m = 1, count
         associate (it => list(meetings(m)%element))
            if (abs(it%face(1)) > 1.5_wp .or. abs(it%face(2) - 4.0_wp) > 2.0_wp) cycle
            if (nint(it%field) == 2) &
               call test%check_close(meetings(m)%gap, it%face(3), 1.0e-12_wp, 'cylinder over the plane: gap')
            if (nint(it%field) == 1) &
               call test%check_close(meetings(m)%gap, norm2(it%face([1, 3]) - [0.0_wp, apart + radius]) &
                                                           - radius, 2.0e-3_wp*edge, &
                                                           'plane under the cylinder: gap')
         end associate
      end do
   end subroutine cylinder

   !> Two surfaces in one place, seen from both sides: z = R - sqrt(R^2 - x^2 - (1 - slim) y^2), a sphere with
   !> slim=0 and a cylinder with slim=1, of irregular elements whose normals are off by up to so much. Gaps
   !> are 0 within so much of an edge; below 0: the largest is beyond that.
   subroutine fit(name, slim, off, bound)
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: slim, off, bound
      type(element_t), allocatable :: list(:)
      type(meeting_t), allocatable :: meetings(:)
      real(wp), parameter :: radius = 4.0_wp
      real(wp) :: x(3), n(3), largest
      integer :: count, k, side, m
      allocate (list(0))
      do k = 1, 300
         do side = -1, 1, 2
            x(:2) = chance%several(2, -2.0_wp, 2.0_wp)
            x(3) = radius - sqrt(radius**2 - x(1)**2 - (1.0_wp - slim)*x(2)**2)
            n = [x(1), (1.0_wp - slim)*x(2), x(3) - radius]
            n = n/norm2(n) + off*chance%several(3, -1.0_wp, 1.0_wp)
            list = [list, element((3 + side)/2, x, side*n/norm2(n), 0.0_wp)]
         end do
      end do
      call meet(list, meetings, count)
      call test%check(count > 200, name//': elements meet')
      largest = 0.0_wp
      do m = 1, count
         largest = max(largest, abs(meetings(m)%gap))
      end do
      if (bound > 0.0_wp) call test%check_close(largest, 0.0_wp, bound*edge, name//': gap')
      if (bound < 0.0_wp) call test%check(largest > -bound*edge, name)
   end subroutine fit

   !> Planes of irregular elements: gap, normal and place are exact.
   subroutine planes()
      type(element_t), allocatable :: list(:)
      type(meeting_t), allocatable :: meetings(:)
      real(wp) :: n(3), t(3, 2), x(2)
      real(wp), parameter :: apart = -0.02_wp, in = 0.05_wp
      integer :: count, k, m
      n = [2.0_wp, -1.0_wp, 2.0_wp]/3.0_wp
      t(:, 1) = [1.0_wp, 2.0_wp, 0.0_wp]/sqrt(5.0_wp)
      t(:, 2) = cross(n, t(:, 1))
      allocate (list(0))
      do k = 1, 200
         x = chance%several(2, -3.0_wp, 3.0_wp)
         list = [list, element(1, matmul(t, x), n, in), element(2, apart*n + matmul(t, x(2:1:-1)), -n, in)]
      end do
      call meet(list, meetings, count)
      call test%check(count > 100, 'planes: elements meet')
      do m = 1, count
         associate (it => list(meetings(m)%element), &
                    side => merge(1, -1, nint(list(meetings(m)%element)%field) == 1))
            call test%check_close(meetings(m)%gap, apart, 1.0e-14_wp, 'planes: gap')
            call test%check_close(meetings(m)%normal, -side*n, 1.0e-13_wp, 'planes: normal')
            call test%check_close(meetings(m)%point, it%face + side*(apart + in)*n, 1.0e-13_wp, &
                                  'planes: place of the force')
         end associate
      end do
   end subroutine planes

   !> The edge of a box, turned by 45 degrees, over a plane: the plane gives the normal, and the plane's
   !> elements meet the edge about where it is.
   subroutine corner()
      type(element_t), allocatable :: list(:)
      type(meeting_t), allocatable :: meetings(:)
      real(wp), parameter :: s = sqrt(0.5_wp), up = 0.1_wp
      integer :: count, i, j, m, side, met
      allocate (list(0))
      do j = 1, 12
         do i = -6, 6
            list = [list, element(1, [i*edge, j*edge, 0.0_wp], [0.0_wp, 0.0_wp, 1.0_wp], 0.0_wp)]
         end do
         do i = 0, 5
            do side = -1, 1, 2
               list = [list, element(2, [side*s*(i + 0.5_wp)*edge, j*edge, up + s*(i + 0.5_wp)*edge], &
                                     [side*s, 0.0_wp, -s], 0.0_wp)]
            end do
         end do
      end do
      call meet(list, meetings, count)
      met = 0
      do m = 1, count
         associate (it => list(meetings(m)%element))
            if (nint(it%field) /= 1 .or. abs(it%face(1)) > 1.0e-9_wp .or. abs(it%face(2) - 3.0_wp) > 1.0_wp) &
               cycle
            met = met + 1
            call test%check_close(meetings(m)%gap, up, 0.1_wp*edge, 'plane under an edge: gap')
            call test%check_close(meetings(m)%normal, [0.0_wp, 0.0_wp, -1.0_wp], 1.0e-12_wp, &
                                  'plane under an edge: normal')
         end associate
      end do
      call test%check(met > 0, 'the plane meets the edge')
   end subroutine corner

end program partner_surface
