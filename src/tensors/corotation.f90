!> The corotational frame of many particles at once: F = R U, and rotation of tensors into the frame of R
!> (theory.md, eq. corotational).
module m_corotation
   use m_kinds, only: wp
   implicit none
   private
   public :: split_gradient, into_frame, out_of_frame, relative_spin, advance_gradient, &
      strain_and_spin, turn_by

   integer, parameter :: iteration_limit = 60 !< stretches of 1e6 need 25
   real(wp), parameter :: close_enough = 1.0e-8_wp !< limit of the last change of R: the remaining error is of
                                                   !< its square

contains

   !> R of F = R U, and U, of n particles; a matrix has component (i, j) at 3 (j-1) + i, U is xx yy zz yz xz
   !> xy. R is the limit of R <- (R + R^-T)/2, started with F (Higham 1986), iterated for each particle until
   !> converged.
   pure subroutine split_gradient(n, f, r, u)
      integer, intent(in) :: n
      real(wp), intent(in) :: f(n, 9)
      real(wp), intent(out) :: r(n, 9), u(n, 6)
      real(wp) :: change(n)
      integer :: iteration, p
      r = f
      change = 1.0_wp
      do iteration = 1, iteration_limit
         !$omp simd
         do p = 1, n
            call come_nearer(r(p, 1), r(p, 2), r(p, 3), r(p, 4), r(p, 5), r(p, 6), r(p, 7), r(p, 8), &
                             r(p, 9), change(p))
         end do
         if (all(change <= close_enough)) exit
      end do
      !$omp simd
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

   !> One iteration for one particle, which is skipped once `change` is small.
   pure elemental subroutine come_nearer(a11, a21, a31, a12, a22, a32, a13, a23, a33, change)
      real(wp), intent(inout) :: a11, a21, a31, a12, a22, a32, a13, a23, a33, change
      real(wp) :: c11, c21, c31, c12, c22, c32, c13, c23, c33, h, half
      half = merge(0.5_wp, 0.0_wp, change > close_enough)
      ! c holds the cofactors of a: a^-T = c/det a
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

   !> Advance n particles by a step: F <- (I + A) F with A = dt L; returns the symmetric part of G = A - A^2/2
   !> (eq. elastic) and the axial vector of its skew part.
   pure subroutine advance_gradient(n, time_step, gradient, f, strain, spin, half)
      integer, intent(in) :: n
      real(wp), intent(in) :: time_step, gradient(n, 9) !< s; 1/s
      real(wp), intent(inout) :: f(n, 9)
      real(wp), intent(out) :: strain(n, 6), spin(n, 3)
      real(wp), intent(out) :: half(n) !< det(I + A/2)
      integer :: p
      !$omp simd
      do p = 1, n
         call increments(time_step, gradient(p, 1), gradient(p, 2), gradient(p, 3), gradient(p, 4), &
                         gradient(p, 5), gradient(p, 6), gradient(p, 7), gradient(p, 8), gradient(p, 9), &
                         strain(p, 1), strain(p, 2), strain(p, 3), strain(p, 4), strain(p, 5), strain(p, 6), &
                         spin(p, 1), spin(p, 2), spin(p, 3), half(p))
         call push(time_step, gradient(p, 1), gradient(p, 2), gradient(p, 3), gradient(p, 4), &
                   gradient(p, 5), gradient(p, 6), gradient(p, 7), gradient(p, 8), gradient(p, 9), f(p, 1), &
                   f(p, 2), f(p, 3))
         call push(time_step, gradient(p, 1), gradient(p, 2), gradient(p, 3), gradient(p, 4), &
                   gradient(p, 5), gradient(p, 6), gradient(p, 7), gradient(p, 8), gradient(p, 9), f(p, 4), &
                   f(p, 5), f(p, 6))
         call push(time_step, gradient(p, 1), gradient(p, 2), gradient(p, 3), gradient(p, 4), &
                   gradient(p, 5), gradient(p, 6), gradient(p, 7), gradient(p, 8), gradient(p, 9), f(p, 7), &
                   f(p, 8), f(p, 9))
      end do
   end subroutine advance_gradient

   !> The symmetric part, xx yy zz yz xz xy, of G = A - A^2/2, A = dt L (eq. elastic), and the axial vector of
   !> its skew part.
   pure subroutine strain_and_spin(n, time_step, gradient, strain, spin)
      integer, intent(in) :: n
      real(wp), intent(in) :: time_step, gradient(n, 9) !< s; 1/s
      real(wp), intent(out) :: strain(n, 6), spin(n, 3)
      real(wp) :: half
      integer :: p
      !$omp simd private(half)
      do p = 1, n
         call increments(time_step, gradient(p, 1), gradient(p, 2), gradient(p, 3), gradient(p, 4), &
                         gradient(p, 5), gradient(p, 6), gradient(p, 7), gradient(p, 8), gradient(p, 9), &
                         strain(p, 1), strain(p, 2), strain(p, 3), strain(p, 4), strain(p, 5), strain(p, 6), &
                         spin(p, 1), spin(p, 2), spin(p, 3), half)
      end do
   end subroutine strain_and_spin

   !> Q a Q^T of symmetric tensors, Q the Cayley transform of `spin`.
   pure subroutine turn_by(n, spin, a)
      integer, intent(in) :: n
      real(wp), intent(in) :: spin(n, 3)
      real(wp), intent(inout) :: a(n, 6)
      real(wp) :: c, wx, wy, wz
      integer :: p
      !$omp simd private(c, wx, wy, wz)
      do p = 1, n
         wx = spin(p, 1); wy = spin(p, 2); wz = spin(p, 3)
         c = 1.0_wp/(1.0_wp + 0.25_wp*(wx*wx + wy*wy + wz*wz))
         call turn(1.0_wp - 0.5_wp*c*(wy*wy + wz*wz), c*(0.5_wp*wx*wy + wz), c*(0.5_wp*wx*wz - wy), &
                   c*(0.5_wp*wx*wy - wz), 1.0_wp - 0.5_wp*c*(wx*wx + wz*wz), c*(0.5_wp*wy*wz + wx), &
                   c*(0.5_wp*wx*wz + wy), c*(0.5_wp*wy*wz - wx), 1.0_wp - 0.5_wp*c*(wx*wx + wy*wy), &
                   a(p, 1), a(p, 2), a(p, 3), a(p, 4), a(p, 5), a(p, 6))
      end do
   end subroutine turn_by

   !> v <- v + dt L v.
   pure elemental subroutine push(dt, l11, l21, l31, l12, l22, l32, l13, l23, l33, x, y, z)
      real(wp), intent(in) :: dt, l11, l21, l31, l12, l22, l32, l13, l23, l33
      real(wp), intent(inout) :: x, y, z
      real(wp) :: u, v, w
      u = x; v = y; w = z
      x = u + dt*(l11*u + l12*v + l13*w)
      y = v + dt*(l21*u + l22*v + l23*w)
      z = w + dt*(l31*u + l32*v + l33*w)
   end subroutine push

   pure elemental subroutine increments(dt, l11, l21, l31, l12, l22, l32, l13, l23, l33, xx, yy, zz, &
                                        yz, xz, xy, wx, wy, wz, half)
      real(wp), intent(in) :: dt, l11, l21, l31, l12, l22, l32, l13, l23, l33
      real(wp), intent(out) :: xx, yy, zz, yz, xz, xy, wx, wy, wz, half
      real(wp) :: a11, a21, a31, a12, a22, a32, a13, a23, a33, g21, g31, g12, g32, g13, g23
      a11 = dt*l11; a21 = dt*l21; a31 = dt*l31
      a12 = dt*l12; a22 = dt*l22; a32 = dt*l32
      a13 = dt*l13; a23 = dt*l23; a33 = dt*l33
      xx = a11 - 0.5_wp*(a11*a11 + a12*a21 + a13*a31)
      yy = a22 - 0.5_wp*(a21*a12 + a22*a22 + a23*a32)
      zz = a33 - 0.5_wp*(a31*a13 + a32*a23 + a33*a33)
      g21 = a21 - 0.5_wp*(a21*a11 + a22*a21 + a23*a31)
      g31 = a31 - 0.5_wp*(a31*a11 + a32*a21 + a33*a31)
      g12 = a12 - 0.5_wp*(a11*a12 + a12*a22 + a13*a32)
      g32 = a32 - 0.5_wp*(a31*a12 + a32*a22 + a33*a32)
      g13 = a13 - 0.5_wp*(a11*a13 + a12*a23 + a13*a33)
      g23 = a23 - 0.5_wp*(a21*a13 + a22*a23 + a23*a33)
      yz = 0.5_wp*(g23 + g32)
      xz = 0.5_wp*(g13 + g31)
      xy = 0.5_wp*(g12 + g21)
      wx = 0.5_wp*(g32 - g23)
      wy = 0.5_wp*(g13 - g31)
      wz = 0.5_wp*(g21 - g12)
      half = (1.0_wp + 0.5_wp*a11)*((1.0_wp + 0.5_wp*a22)*(1.0_wp + 0.5_wp*a33) - 0.25_wp*a23*a32) &
             - 0.25_wp*a12*(a21*(1.0_wp + 0.5_wp*a33) - 0.5_wp*a23*a31) &
             + 0.25_wp*a13*(0.5_wp*a21*a32 - (1.0_wp + 0.5_wp*a22)*a31)
   end subroutine increments

   !> The rotation of a step relative to the frame: the vector w of the Cayley transform of R^T Q R_old, Q the
   !> Cayley transform of the axial vector `spin` of the step.
   pure subroutine relative_spin(n, r_old, r, spin)
      integer, intent(in) :: n
      real(wp), intent(in) :: r_old(n, 9), r(n, 9)
      real(wp), intent(inout) :: spin(n, 3) !< in: of the step; out: relative to the frame, in the frame
      integer :: p
      !$omp simd
      do p = 1, n
         call take_off(r_old(p, 1), r_old(p, 2), r_old(p, 3), r_old(p, 4), r_old(p, 5), r_old(p, 6), &
                       r_old(p, 7), r_old(p, 8), r_old(p, 9), r(p, 1), r(p, 2), r(p, 3), r(p, 4), r(p, 5), &
                       r(p, 6), r(p, 7), r(p, 8), r(p, 9), spin(p, 1), spin(p, 2), spin(p, 3))
      end do
   end subroutine relative_spin

   !> One particle; o is R_old.
   pure elemental subroutine take_off(o11, o21, o31, o12, o22, o32, o13, o23, o33, r11, r21, r31, &
                                      r12, r22, r32, r13, r23, r33, wx, wy, wz)
      real(wp), intent(in) :: o11, o21, o31, o12, o22, o32, o13, o23, o33
      real(wp), intent(in) :: r11, r21, r31, r12, r22, r32, r13, r23, r33
      real(wp), intent(inout) :: wx, wy, wz
      real(wp) :: c, q11, q21, q31, q12, q22, q32, q13, q23, q33, t11, t21, t31, t12, t22, t32, t13, &
         t23, t33, turned
      c = 1.0_wp/(1.0_wp + 0.25_wp*(wx*wx + wy*wy + wz*wz))
      q11 = 1.0_wp - 0.5_wp*c*(wy*wy + wz*wz)
      q22 = 1.0_wp - 0.5_wp*c*(wx*wx + wz*wz)
      q33 = 1.0_wp - 0.5_wp*c*(wx*wx + wy*wy)
      q12 = c*(0.5_wp*wx*wy - wz); q21 = c*(0.5_wp*wx*wy + wz)
      q13 = c*(0.5_wp*wx*wz + wy); q31 = c*(0.5_wp*wx*wz - wy)
      q23 = c*(0.5_wp*wy*wz - wx); q32 = c*(0.5_wp*wy*wz + wx)
      t11 = q11*o11 + q12*o21 + q13*o31; t12 = q11*o12 + q12*o22 + q13*o32; t13 = q11*o13 + q12*o23 + q13*o33
      t21 = q21*o11 + q22*o21 + q23*o31; t22 = q21*o12 + q22*o22 + q23*o32; t23 = q21*o13 + q22*o23 + q23*o33
      t31 = q31*o11 + q32*o21 + q33*o31; t32 = q31*o12 + q32*o22 + q33*o32; t33 = q31*o13 + q32*o23 + q33*o33
      q11 = r11*t11 + r21*t21 + r31*t31
      q22 = r12*t12 + r22*t22 + r32*t32
      q33 = r13*t13 + r23*t23 + r33*t33
      turned = 2.0_wp/(1.0_wp + q11 + q22 + q33)
      wx = turned*(r13*t12 + r23*t22 + r33*t32 - r12*t13 - r22*t23 - r32*t33)
      wy = turned*(r11*t13 + r21*t23 + r31*t33 - r13*t11 - r23*t21 - r33*t31)
      wz = turned*(r12*t11 + r22*t21 + r32*t31 - r11*t12 - r21*t22 - r31*t32)
   end subroutine take_off

end module m_corotation
