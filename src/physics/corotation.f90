!> The corotational frame of many particles at once: F = R U, and what turns into the frame of R (theory.md,
!> eq. corotational).
module m_corotation
   use m_kinds, only: wp
   implicit none
   private
   public :: split_gradient, into_frame, out_of_frame, relative_spin

   integer, parameter :: most_iterations = 60 !< stretches of 1e6 need 25
   real(wp), parameter :: close_enough = 1.0e-8_wp !< last change of R: what is still missing is of its square

contains

   !> R of F = R U, and U, of n particles; a matrix has component (i, j) at 3 (j-1) + i, U is xx yy zz yz xz
   !> xy. R is the limit of R <- (R + R^-T)/2, begun with F (Higham 1986), taken from each particle until it
   !> stays.
   pure subroutine split_gradient(n, f, r, u)
      integer, intent(in) :: n
      real(wp), intent(in) :: f(n, 9)
      real(wp), intent(out) :: r(n, 9), u(n, 6)
      real(wp) :: change(n)
      integer :: iteration, p
      r = f
      change = 1.0_wp
      do iteration = 1, most_iterations
         !$omp simd
         do p = 1, n
            call come_nearer(r(p, 1), r(p, 2), r(p, 3), r(p, 4), r(p, 5), r(p, 6), r(p, 7), r(p, 8), &
                             r(p, 9), change(p))
         end do
         if (all(change <= close_enough)) exit
      end do
      do p = 1, n
         u(p, 1) = r(p, 1)*f(p, 1) + r(p, 2)*f(p, 2) + r(p, 3)*f(p, 3)
         u(p, 2) = r(p, 4)*f(p, 4) + r(p, 5)*f(p, 5) + r(p, 6)*f(p, 6)
         u(p, 3) = r(p, 7)*f(p, 7) + r(p, 8)*f(p, 8) + r(p, 9)*f(p, 9)
         u(p, 4) = 0.5_wp*(r(p, 4)*f(p, 7) + r(p, 5)*f(p, 8) + r(p, 6)*f(p, 9) &
                           + r(p, 7)*f(p, 4) + r(p, 8)*f(p, 5) + r(p, 9)*f(p, 6))
         u(p, 5) = 0.5_wp*(r(p, 1)*f(p, 7) + r(p, 2)*f(p, 8) + r(p, 3)*f(p, 9) &
                           + r(p, 7)*f(p, 1) + r(p, 8)*f(p, 2) + r(p, 9)*f(p, 3))
         u(p, 6) = 0.5_wp*(r(p, 1)*f(p, 4) + r(p, 2)*f(p, 5) + r(p, 3)*f(p, 6) &
                           + r(p, 4)*f(p, 1) + r(p, 5)*f(p, 2) + r(p, 6)*f(p, 3))
      end do
   end subroutine split_gradient

   !> One iteration of one particle, which stays as it is once `change` is small.
   pure elemental subroutine come_nearer(a11, a21, a31, a12, a22, a32, a13, a23, a33, change)
      real(wp), intent(inout) :: a11, a21, a31, a12, a22, a32, a13, a23, a33, change
      real(wp) :: c11, c21, c31, c12, c22, c32, c13, c23, c33, h, half
      half = merge(0.5_wp, 0.0_wp, change > close_enough)
      ! c is made of the cofactors of a: a^-T = c/det a
      c11 = a22*a33 - a32*a23; c21 = a32*a13 - a12*a33; c31 = a12*a23 - a22*a13
      c12 = a31*a23 - a21*a33; c22 = a11*a33 - a31*a13; c32 = a21*a13 - a11*a23
      c13 = a21*a32 - a31*a22; c23 = a31*a12 - a11*a32; c33 = a11*a22 - a21*a12
      h = 1.0_wp/(a11*c11 + a12*c12 + a13*c13)
      c11 = half*(c11*h - a11); c21 = half*(c21*h - a21); c31 = half*(c31*h - a31)
      c12 = half*(c12*h - a12); c22 = half*(c22*h - a22); c32 = half*(c32*h - a32)
      c13 = half*(c13*h - a13); c23 = half*(c23*h - a23); c33 = half*(c33*h - a33)
      a11 = a11 + c11; a21 = a21 + c21; a31 = a31 + c31
      a12 = a12 + c12; a22 = a22 + c22; a32 = a32 + c32
      a13 = a13 + c13; a23 = a23 + c23; a33 = a33 + c33
      change = max(max(abs(c11), abs(c21), abs(c31)), max(abs(c12), abs(c22), abs(c32)), &
                   max(abs(c13), abs(c23), abs(c33)))
   end subroutine come_nearer

   !> R^T a R of symmetric tensors, xx yy zz yz xz xy.
   pure subroutine into_frame(n, r, a)
      integer, intent(in) :: n
      real(wp), intent(in) :: r(n, 9)
      real(wp), intent(inout) :: a(n, 6)
      integer :: p
      !$omp simd
      do p = 1, n
         call turn(r(p, 1), r(p, 4), r(p, 7), r(p, 2), r(p, 5), r(p, 8), r(p, 3), r(p, 6), r(p, 9), &
                   a(p, 1), a(p, 2), a(p, 3), a(p, 4), a(p, 5), a(p, 6))
      end do
   end subroutine into_frame

   !> R a R^T of symmetric tensors.
   pure subroutine out_of_frame(n, r, a)
      integer, intent(in) :: n
      real(wp), intent(in) :: r(n, 9)
      real(wp), intent(inout) :: a(n, 6)
      integer :: p
      !$omp simd
      do p = 1, n
         call turn(r(p, 1), r(p, 2), r(p, 3), r(p, 4), r(p, 5), r(p, 6), r(p, 7), r(p, 8), r(p, 9), &
                   a(p, 1), a(p, 2), a(p, 3), a(p, 4), a(p, 5), a(p, 6))
      end do
   end subroutine out_of_frame

   !> Q a Q^T.
   pure elemental subroutine turn(q11, q21, q31, q12, q22, q32, q13, q23, q33, xx, yy, zz, yz, xz, xy)
      real(wp), intent(in) :: q11, q21, q31, q12, q22, q32, q13, q23, q33
      real(wp), intent(inout) :: xx, yy, zz, yz, xz, xy
      real(wp) :: t11, t12, t13, t21, t22, t23, t31, t32, t33
      t11 = q11*xx + q12*xy + q13*xz; t12 = q11*xy + q12*yy + q13*yz; t13 = q11*xz + q12*yz + q13*zz
      t21 = q21*xx + q22*xy + q23*xz; t22 = q21*xy + q22*yy + q23*yz; t23 = q21*xz + q22*yz + q23*zz
      t31 = q31*xx + q32*xy + q33*xz; t32 = q31*xy + q32*yy + q33*yz; t33 = q31*xz + q32*yz + q33*zz
      xx = t11*q11 + t12*q12 + t13*q13
      yy = t21*q21 + t22*q22 + t23*q23
      zz = t31*q31 + t32*q32 + t33*q33
      yz = t21*q31 + t22*q32 + t23*q33
      xz = t11*q31 + t12*q32 + t13*q33
      xy = t11*q21 + t12*q22 + t13*q23
   end subroutine turn

   !> The turn of a step beyond that of the frame: the vector w of the Cayley transform of R^T Q R_old, Q the
   !> Cayley transform of the axial vector `spin` of the step.
   pure subroutine relative_spin(n, r_old, r, spin)
      integer, intent(in) :: n
      real(wp), intent(in) :: r_old(n, 9), r(n, 9)
      real(wp), intent(inout) :: spin(n, 3) !< of the step in, beyond the frame's, in the frame, out
      real(wp) :: q(3, 3), w(3), c
      integer :: p
      do p = 1, n
         w = spin(p, :)
         c = 1.0_wp/(1.0_wp + 0.25_wp*(w(1)**2 + w(2)**2 + w(3)**2))
         q(:, 1) = c*[-0.5_wp*(w(2)**2 + w(3)**2), 0.5_wp*w(1)*w(2) + w(3), 0.5_wp*w(1)*w(3) - w(2)]
         q(:, 2) = c*[0.5_wp*w(1)*w(2) - w(3), -0.5_wp*(w(1)**2 + w(3)**2), 0.5_wp*w(2)*w(3) + w(1)]
         q(:, 3) = c*[0.5_wp*w(1)*w(3) + w(2), 0.5_wp*w(2)*w(3) - w(1), -0.5_wp*(w(1)**2 + w(2)**2)]
         q(1, 1) = 1.0_wp + q(1, 1)
         q(2, 2) = 1.0_wp + q(2, 2)
         q(3, 3) = 1.0_wp + q(3, 3)
         q = matmul(reshape([r(p, 1), r(p, 4), r(p, 7), r(p, 2), r(p, 5), r(p, 8), r(p, 3), r(p, 6), r(p, 9)], &
                            [3, 3]), matmul(q, reshape(r_old(p, :), [3, 3])))
         spin(p, :) = 2.0_wp*[q(3, 2) - q(2, 3), q(1, 3) - q(3, 1), q(2, 1) - q(1, 2)] &
                      /(1.0_wp + q(1, 1) + q(2, 2) + q(3, 3))
      end do
   end subroutine relative_spin

end module m_corotation
