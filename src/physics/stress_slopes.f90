!> Derivatives of stresses by the gradient A of a step's displacement, in closed form (theory.md, eq.
!> closed-tangent): what laws share. Component c of the stress by kl of A stands at 6 (kl-1) + c.
module m_stress_slopes
   use m_kinds, only: wp
   use m_vectors, only: cross
   implicit none
   private
   public :: elastic_slopes, return_slopes, matrix_of, tensor_of

contains

   !> xx yy zz yz xz xy as a matrix.
   pure function matrix_of(s) result(m)
      real(wp), intent(in) :: s(6)
      real(wp) :: m(3, 3)
      m = reshape([s(1), s(6), s(5), s(6), s(2), s(4), s(5), s(4), s(3)], [3, 3])
   end function matrix_of

   !> The other way round.
   pure function tensor_of(m) result(s)
      real(wp), intent(in) :: m(3, 3)
      real(wp) :: s(6)
      s = [m(1, 1), m(2, 2), m(3, 3), m(2, 3), m(1, 3), m(1, 2)]
   end function tensor_of

   !> The stress of eq. elastic after a step, and its derivative: that of G = A - A^2/2, and of the turn by
   !> the Cayley transform of its axial vector w, whose change is (dw + w x dw/2)/(1 + w^2/4).
   pure subroutine elastic_slopes(lame, shear, gradient, before, stress, slope)
      real(wp), intent(in) :: lame, shear, gradient(9), before(6)
      real(wp), intent(out) :: stress(6) !< at the step's end
      real(wp), intent(out) :: slope(54)
      real(wp) :: a(3, 3), g(3, 3), dg(3, 3), r(3, 3), turned(3, 3), w(3), dw(3), c
      integer :: k, l
      a = reshape(gradient, [3, 3])
      g = a - 0.5_wp*matmul(a, a)
      w = axial(g)
      c = 1.0_wp/(1.0_wp + 0.25_wp*dot_product(w, w))
      r = skew(w)
      r = c*(r + 0.5_wp*matmul(r, r))
      do k = 1, 3
         r(k, k) = r(k, k) + 1.0_wp
      end do
      turned = matmul(matmul(r, matrix_of(before)), transpose(r))
      stress = tensor_of(turned + strained(lame, shear, g))
      do l = 1, 3
         do k = 1, 3
            ! dA has a 1 at kl: A dA has one column, dA A one row
            dg = 0.0_wp
            dg(:, l) = -0.5_wp*a(:, k)
            dg(k, :) = dg(k, :) - 0.5_wp*a(l, :)
            dg(k, l) = dg(k, l) + 1.0_wp
            dw = axial(dg)
            r = matmul(skew(c*(dw + 0.5_wp*cross(w, dw))), turned)
            slope(6*(3*l - 3 + k) - 5:6*(3*l - 3 + k)) = tensor_of(r + transpose(r) &
                                                                   + strained(lame, shear, dg))
         end do
      end do
   end subroutine elastic_slopes

   !> C : sym G.
   pure function strained(lame, shear, g) result(stress)
      real(wp), intent(in) :: lame, shear, g(3, 3)
      real(wp) :: stress(3, 3)
      integer :: k
      stress = shear*(g + transpose(g))
      do k = 1, 3
         stress(k, k) = stress(k, k) + lame*(g(1, 1) + g(2, 2) + g(3, 3))
      end do
   end function strained

   !> Of the skew part.
   pure function axial(g) result(w)
      real(wp), intent(in) :: g(3, 3)
      real(wp) :: w(3)
      w = 0.5_wp*[g(3, 2) - g(2, 3), g(1, 3) - g(3, 1), g(2, 1) - g(1, 2)]
   end function axial

   pure function skew(w) result(m)
      real(wp), intent(in) :: w(3)
      real(wp) :: m(3, 3)
      m = reshape([0.0_wp, w(3), -w(2), -w(3), 0.0_wp, w(1), w(2), -w(1), 0.0_wp], [3, 3])
   end function skew

   !> What a return along the deviator makes of the derivative of the trial stress: von Mises' stress q falls
   !> by `drop`, and that by `drop_slope` dq.
   pure subroutine return_slopes(trial, drop, drop_slope, slope)
      real(wp), intent(in) :: trial(6), drop, drop_slope
      real(wp), intent(inout) :: slope(54)
      real(wp) :: s(6), d(6), mean, q, dq, share
      integer :: kl
      s = trial
      s(1:3) = s(1:3) - sum(trial(1:3))/3.0_wp
      q = sqrt(1.5_wp*(sum(s(1:3)**2) + 2.0_wp*sum(s(4:6)**2)))
      share = drop/q
      do kl = 1, 9
         d = slope(6*kl - 5:6*kl)
         mean = sum(d(1:3))/3.0_wp
         d(1:3) = d(1:3) - mean
         dq = 1.5_wp*(dot_product(s(1:3), d(1:3)) + 2.0_wp*dot_product(s(4:6), d(4:6)))/q
         d = (1.0_wp - share)*d - (drop_slope - share)*dq/q*s
         d(1:3) = d(1:3) + mean
         slope(6*kl - 5:6*kl) = d
      end do
   end subroutine return_slopes

end module m_stress_slopes
