!> The edge of an elastic contact, from the pressures inside and the gaps outside together (theory.md, eq.
!> edge-field): on both sides of an edge they follow one function, the square root of the distance, so the
!> edge lies between the points on either side.
module m_edge_field
   use m_kinds, only: wp
   implicit none
   private
   public :: fit_field, inside

   real(wp), parameter :: inside = 1.5_wp  !< cells: points up to this distance inside the edge are used,
   real(wp), parameter :: outside = 2.0_wp !< and up to this distance outside,
   real(wp), parameter :: fades = 0.3_wp   !< cells: width over which their weight decreases to 0
   real(wp), parameter :: widest = 0.6_wp  !< cells: range of the search for the edge about the last one,
   real(wp), parameter :: step = 0.1_wp    !< in steps of this,
   real(wp), parameter :: near = 0.005_wp  !< until the change is smaller,
   integer, parameter :: max_tries = 10    !< or this number of times
   real(wp), parameter :: farthest = 1.5_wp !< cells: an edge is not further from between pressed and open
                                            !< points

contains

   !> The edge of the field that best fits pressures and gaps of points along a line, by least squares.
   pure subroutine fit_field(along, gap, pressure, face, pressed, edge, known)
      real(wp), intent(in) :: along(:)    !< places, growing towards the open side, cells
      real(wp), intent(in) :: gap(:)      !< cells; 0 for points in contact
      real(wp), intent(in) :: pressure(:) !< over the modulus of the half-space
      real(wp), intent(in) :: face(:)     !< widths of faces, over which pressures are means, cells
      logical, intent(in) :: pressed(:)   !< points in contact
      real(wp), intent(out) :: edge       !< along the line, cells
      logical, intent(out) :: known       !< an edge was found
      real(wp) :: left, least, middle, right, start, weight(size(along)), last
      integer :: half, i, n
      integer, parameter :: max_half = nint(widest/step)
      real(wp) :: misfits(-max_half:max_half)
      known = .false.
      edge = 0.0_wp
      if (.not. any(pressed) .or. all(pressed)) return
      start = 0.5_wp*(maxval(along, mask=pressed) + minval(along, mask=.not. pressed))
      edge = start
      half = max_half
      do n = 1, max_tries
         weight = share(inside + along - edge)*share(outside + edge - along)
         do i = -half, half
            misfits(i) = misfit(edge + i*step, along, gap, pressure, face, weight)
         end do
         i = minloc(misfits(-half:half), dim=1) - half - 1
         last = edge
         edge = edge + i*step
         if (abs(i) < half) then
            left = misfits(i - 1)
            middle = misfits(i)
            right = misfits(i + 1)
            least = left - 2.0_wp*middle + right
            if (least > 0.0_wp) edge = edge + 0.5_wp*step*(left - right)/least
         end if
         known = abs(edge - last) < near
         if (known .or. abs(edge - start) > farthest) exit
         half = 1 ! the weights change with the edge; it hardly moves
      end do
      known = abs(edge - start) < farthest .and. minval(misfits(-half:half)) < huge(1.0_wp)
   end subroutine fit_field

   !> Weight of a point by its distance within the range, cells.
   pure elemental real(wp) function share(within)
      real(wp), intent(in) :: within
      share = min(1.0_wp, max(0.0_wp, within/fades + 0.5_wp))
   end function share

   !> Sum of the squared residuals of pressures and gaps for the best field with an edge: the first two terms
   !> of sqrt(distance) times a power series.
   pure real(wp) function misfit(edge, along, gap, pressure, face, weight)
      real(wp), intent(in) :: edge, along(:), gap(:), pressure(:), face(:), weight(:)
      real(wp) :: a, b, c, d, s, t, g(2), p(2), total
      integer :: n
      a = 0.0_wp
      b = 0.0_wp
      c = 0.0_wp
      s = 0.0_wp
      t = 0.0_wp
      total = 0.0_wp
      do n = 1, size(along)
         if (.not. weight(n) > 0.0_wp) cycle
         d = along(n) - edge
         ! a face of any direction has the variance of a hat function whose half width is its own over sqrt 2
         p = weight(n)*smoothed(-d, sqrt(0.5_wp)*face(n), 0.5_wp)
         g = weight(n)*smoothed(d, 1.0_wp, 1.5_wp)*[4.0_wp/3.0_wp, -0.8_wp]
         a = a + p(1)**2 + g(1)**2
         b = b + p(1)*p(2) + g(1)*g(2)
         c = c + p(2)**2 + g(2)**2
         s = s + weight(n)*(p(1)*pressure(n) + g(1)*gap(n))
         t = t + weight(n)*(p(2)*pressure(n) + g(2)*gap(n))
         total = total + weight(n)**2*(pressure(n)**2 + gap(n)**2)
      end do
      misfit = huge(misfit)
      if (.not. a*c - b**2 > epsilon(1.0_wp)*a*c) return
      if (.not. s*c - t*b > 0.0_wp) return ! no tension, no negative gap
      misfit = total - (c*s**2 - 2.0_wp*b*s*t + a*t**2)/(a*c - b**2)
   end function misfit

   !> A power of the distance and the next one, 0 before it, averaged with a hat function of a half width.
   pure function smoothed(x, width, power) result(mean)
      real(wp), intent(in) :: x, width
      real(wp), intent(in) :: power !< 1/2 or 3/2
      real(wp) :: mean(2), place(3), root(3)
      mean = 0.0_wp
      if (x <= -width) return
      place = max(0.0_wp, [x + width, x, x - width])
      root = place**2*sqrt(place)
      if (power > 1.0_wp) root = root*place
      mean(1) = (root(1) - 2.0_wp*root(2) + root(3))/((power + 1.0_wp)*(power + 2.0_wp))
      root = root*place
      mean(2) = (root(1) - 2.0_wp*root(2) + root(3))/((power + 2.0_wp)*(power + 3.0_wp))
      mean = mean/width**2
   end function smoothed

end module m_edge_field
