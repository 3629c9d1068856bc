!> A metal that is invented: an embedded-atom potential of closed formulas, and its file.
module m_metal
   use m_kinds, only: wp
   implicit none
   private
   public :: phi, rho, write_metal

   real(wp), parameter, public :: cut = 5.0_wp !< angstrom
   real(wp), parameter :: near = 2.55_wp

contains

   pure real(wp) function fade(r)
      real(wp), intent(in) :: r
      fade = max(0.0_wp, 1.0_wp - r/cut)**4
   end function fade

   pure real(wp) function fade_slope(r)
      real(wp), intent(in) :: r
      fade_slope = -4.0_wp/cut*max(0.0_wp, 1.0_wp - r/cut)**3
   end function fade_slope

   pure real(wp) function fade_bend(r)
      real(wp), intent(in) :: r
      fade_bend = 12.0_wp/cut**2*max(0.0_wp, 1.0_wp - r/cut)**2
   end function fade_bend

   !> A exp(-k (r - near)) fade(r) and its first two derivatives.
   pure function decaying(a, k, r) result(d)
      real(wp), intent(in) :: a, k, r
      real(wp) :: d(0:2)
      d = a*exp(-k*(r - near))*[fade(r), fade_slope(r) - k*fade(r), &
                                fade_bend(r) - 2.0_wp*k*fade_slope(r) + k*k*fade(r)]
   end function decaying

   pure function phi(r) result(d)
      real(wp), intent(in) :: r
      real(wp) :: d(0:2)
      d = decaying(2.1_wp, 3.0_wp, r)
   end function phi

   pure function rho(r) result(d)
      real(wp), intent(in) :: r
      real(wp) :: d(0:2)
      d = decaying(1.0_wp, 1.0_wp, r)
   end function rho

   !> Its tables, as setfl, with another element before it.
   subroutine write_metal(file)
      character(len=*), intent(in) :: file
      integer, parameter :: n = 20001
      real(wp), parameter :: dr = 2.5e-4_wp, dq = 1.0e-4_wp
      real(wp) :: table(n), d(0:2)
      integer :: unit, k, e
      open (newunit=unit, file=file, action='write', status='replace')
      write (unit, '(a)') 'an invented metal', 'closed formulas', 'none', '2 Yy Xx'
      write (unit, '(2(i0,1x,es24.16,1x),es24.16)') n, dq, n, dr, cut
      do e = 1, 2
         write (unit, '(a)') merge('28 58.0 3.5 fcc', '29 60.0 3.6 fcc', e == 1)
         table = [(-3.0_wp*sqrt(k*dq), k=0, n - 1)]
         write (unit, '(5es25.16)') table*merge(0.5_wp, 1.0_wp, e == 1)
         do k = 1, n
            d = rho((k - 1)*dr)
            table(k) = d(0)
         end do
         write (unit, '(5es25.16)') table
      end do
      do e = 1, 3
         do k = 1, n
            d = phi((k - 1)*dr)
            table(k) = (k - 1)*dr*d(0)
         end do
         write (unit, '(5es25.16)') table*merge(1.0_wp, 0.7_wp, e == 3)
      end do
      close (unit)
   end subroutine write_metal

end module m_metal
