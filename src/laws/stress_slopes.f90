!> Consistent tangents in closed form: derivatives of stresses by the displacement gradient A of a step
!> (theory.md, eq. closed-tangent), shared by laws. Component c of the stress by kl of A is at 6 (kl-1) + c.
module m_stress_slopes
   use m_kinds, only: wp
   use m_corotation, only: strain_and_spin, turn_by
   implicit none
   private
   public :: elastic_slopes, return_slopes, add_deformation, component

   integer, parameter :: component(3, 3) = reshape([1, 6, 5, 6, 2, 4, 5, 4, 3], [3, 3])

contains

   !> The stress of eq. elastic after a step, and its derivative: through G = A - A^2/2, and through the
   !> rotation by the Cayley transform of its axial vector w, whose change is (dw + w x dw/2)/(1 + w^2/4).
   pure subroutine elastic_slopes(n, lame, shear, a, before, stress, slope)
      integer, intent(in) :: n
      real(wp), intent(in) :: lame, shear, a(n, 9), before(n, 6)
      real(wp), intent(out) :: stress(n, 6) !< at the step's end
      real(wp), intent(out) :: slope(n, 54)
      real(wp) :: w(n, 3), dg(n, 9), strain(n, 6)
      integer :: i, k, l
      call strain_and_spin(n, 1.0_wp, a, strain, w)
      stress = before
      call turn_by(n, w, stress)
      do l = 1, 3
         do k = 1, 3
            ! dA has a 1 at kl: A dA has one column, dA A one row
            dg = 0.0_wp
            dg(:, 3*l - 3 + k) = 1.0_wp
            do i = 1, 3
               dg(:, 3*l - 3 + i) = dg(:, 3*l - 3 + i) - 0.5_wp*a(:, 3*k - 3 + i)
               dg(:, 3*i - 3 + k) = dg(:, 3*i - 3 + k) - 0.5_wp*a(:, 3*i - 3 + l)
            end do
            associate (at => 6*(3*l - 3 + k) - 5)
               call turn_and_strain(n, lame, shear, w, stress, dg, slope(:, at:at + 5))
            end associate
         end do
      end do
      call add_strain(n, lame, shear, strain, stress)
   end subroutine elastic_slopes

   !> Change of a stress rotated by w due to a change of G.
   pure subroutine turn_and_strain(n, lame, shear, w, s, dg, slope)
      integer, intent(in) :: n
      real(wp), intent(in) :: lame, shear, w(n, 3), s(n, 6), dg(n, 9)
      real(wp), intent(inout) :: slope(n, 6)
      real(wp) :: c, dx, dy, dz, x, y, z, volume
      integer :: p
      !$omp simd private(c, dx, dy, dz, x, y, z, volume)
      do p = 1, n
         dx = 0.5_wp*(dg(p, 6) - dg(p, 8))
         dy = 0.5_wp*(dg(p, 7) - dg(p, 3))
         dz = 0.5_wp*(dg(p, 2) - dg(p, 4))
         c = 1.0_wp/(1.0_wp + 0.25_wp*(w(p, 1)**2 + w(p, 2)**2 + w(p, 3)**2))
         x = c*(dx + 0.5_wp*(w(p, 2)*dz - w(p, 3)*dy))
         y = c*(dy + 0.5_wp*(w(p, 3)*dx - w(p, 1)*dz))
         z = c*(dz + 0.5_wp*(w(p, 1)*dy - w(p, 2)*dx))
         volume = lame*(dg(p, 1) + dg(p, 5) + dg(p, 9))
         slope(p, 1) = 2.0_wp*(y*s(p, 5) - z*s(p, 6) + shear*dg(p, 1)) + volume
         slope(p, 2) = 2.0_wp*(z*s(p, 6) - x*s(p, 4) + shear*dg(p, 5)) + volume
         slope(p, 3) = 2.0_wp*(x*s(p, 4) - y*s(p, 5) + shear*dg(p, 9)) + volume
         slope(p, 4) = z*s(p, 5) - y*s(p, 6) + x*(s(p, 2) - s(p, 3)) + shear*(dg(p, 6) + dg(p, 8))
         slope(p, 5) = x*s(p, 6) - z*s(p, 4) + y*(s(p, 3) - s(p, 1)) + shear*(dg(p, 3) + dg(p, 7))
         slope(p, 6) = y*s(p, 4) - x*s(p, 5) + z*(s(p, 1) - s(p, 2)) + shear*(dg(p, 2) + dg(p, 4))
      end do
   end subroutine turn_and_strain

   !> stress + C : strain.
   pure subroutine add_strain(n, lame, shear, strain, stress)
      integer, intent(in) :: n
      real(wp), intent(in) :: lame, shear, strain(n, 6)
      real(wp), intent(inout) :: stress(n, 6)
      integer :: c
      do c = 1, 6
         stress(:, c) = stress(:, c) + 2.0_wp*shear*strain(:, c)
         if (c <= 3) stress(:, c) = stress(:, c) + lame*(strain(:, 1) + strain(:, 2) + strain(:, 3))
      end do
   end subroutine add_strain

   !> Derivative after a return along the deviator, from that of the trial stress: the von Mises stress q is
   !> reduced by `drop`, whose derivative is `drop_slope` dq. A particle at yield that has not flowed flows
   !> only for changes that increase q.
   pure subroutine return_slopes(n, trial, drop, drop_slope, slope)
      integer, intent(in) :: n
      real(wp), intent(in) :: trial(n, 6), drop(n), drop_slope(n)
      real(wp), intent(inout) :: slope(n, 54)
      real(wp) :: mean, q, dq, share, d, factor
      integer :: at, kl, p
      do kl = 1, 9
         at = 6*kl - 5
         !$omp simd private(mean, q, dq, share, d, factor)
         do p = 1, n
            mean = (trial(p, 1) + trial(p, 2) + trial(p, 3))/3.0_wp
            q = max(tiny(q), sqrt(1.5_wp*((trial(p, 1) - mean)**2 + (trial(p, 2) - mean)**2 &
                + (trial(p, 3) - mean)**2 + 2.0_wp*(trial(p, 4)**2 + trial(p, 5)**2 + trial(p, 6)**2))))
            share = drop(p)/q
            d = (slope(p, at) + slope(p, at + 1) + slope(p, at + 2))/3.0_wp
            dq = 1.5_wp*((trial(p, 1) - mean)*slope(p, at) + (trial(p, 2) - mean)*slope(p, at + 1) &
                         + (trial(p, 3) - mean)*slope(p, at + 2) + 2.0_wp*(trial(p, 4)*slope(p, at + 3) &
                         + trial(p, 5)*slope(p, at + 4) + trial(p, 6)*slope(p, at + 5)))/q
            factor = (drop_slope(p) - share)*dq/q
            if (.not. (drop(p) > 0.0_wp .or. dq > 0.0_wp)) factor = 0.0_wp
            slope(p, at) = slope(p, at) - share*(slope(p, at) - d) - factor*(trial(p, 1) - mean)
            slope(p, at + 1) = slope(p, at + 1) - share*(slope(p, at + 1) - d) - factor*(trial(p, 2) - mean)
            slope(p, at + 2) = slope(p, at + 2) - share*(slope(p, at + 2) - d) - factor*(trial(p, 3) - mean)
            slope(p, at + 3) = (1.0_wp - share)*slope(p, at + 3) - factor*trial(p, 4)
            slope(p, at + 4) = (1.0_wp - share)*slope(p, at + 4) - factor*trial(p, 5)
            slope(p, at + 5) = (1.0_wp - share)*slope(p, at + 5) - factor*trial(p, 6)
         end do
      end do
   end subroutine return_slopes

   !> F <- (I + A) F, and (I + A)^-1.
   pure subroutine add_deformation(n, a, f, inverse)
      integer, intent(in) :: n
      real(wp), intent(in) :: a(n, 9)
      real(wp), intent(inout) :: f(n, 9)
      real(wp), intent(out) :: inverse(n, 9)
      real(wp) :: g(n, 9), h, x, y, z
      integer :: c, p
      g = a
      g(:, 1:9:4) = g(:, 1:9:4) + 1.0_wp
      !$omp simd private(h)
      do p = 1, n
         inverse(p, 1) = g(p, 5)*g(p, 9) - g(p, 6)*g(p, 8)
         inverse(p, 2) = g(p, 3)*g(p, 8) - g(p, 2)*g(p, 9)
         inverse(p, 3) = g(p, 2)*g(p, 6) - g(p, 3)*g(p, 5)
         h = 1.0_wp/(g(p, 1)*inverse(p, 1) + g(p, 4)*inverse(p, 2) + g(p, 7)*inverse(p, 3))
         inverse(p, 1) = h*inverse(p, 1)
         inverse(p, 2) = h*inverse(p, 2)
         inverse(p, 3) = h*inverse(p, 3)
         inverse(p, 4) = h*(g(p, 6)*g(p, 7) - g(p, 4)*g(p, 9))
         inverse(p, 5) = h*(g(p, 1)*g(p, 9) - g(p, 3)*g(p, 7))
         inverse(p, 6) = h*(g(p, 3)*g(p, 4) - g(p, 1)*g(p, 6))
         inverse(p, 7) = h*(g(p, 4)*g(p, 8) - g(p, 5)*g(p, 7))
         inverse(p, 8) = h*(g(p, 2)*g(p, 7) - g(p, 1)*g(p, 8))
         inverse(p, 9) = h*(g(p, 1)*g(p, 5) - g(p, 2)*g(p, 4))
      end do
      do c = 1, 7, 3
         !$omp simd private(x, y, z)
         do p = 1, n
            x = f(p, c); y = f(p, c + 1); z = f(p, c + 2)
            f(p, c) = g(p, 1)*x + g(p, 4)*y + g(p, 7)*z
            f(p, c + 1) = g(p, 2)*x + g(p, 5)*y + g(p, 8)*z
            f(p, c + 2) = g(p, 3)*x + g(p, 6)*y + g(p, 9)*z
         end do
      end do
   end subroutine add_deformation

end module m_stress_slopes
