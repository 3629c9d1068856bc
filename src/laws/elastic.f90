!> Isotropic linear elasticity in rate form: objective rate of the Cauchy stress = C : rate of deformation
!> (theory.md, eq. elastic).
module m_elastic
   use m_kinds, only: wp
   use m_field_table, only: layout_t
   use m_isotropic, only: isotropic_t
   use m_material, only: failure_t
   use m_stress_slopes, only: elastic_slopes
   implicit none
   private
   public :: elastic_t

   type, extends(isotropic_t) :: elastic_t
   contains
      procedure :: update
      procedure :: stress_tangent
      procedure :: strain_energy
      procedure :: stretch
      procedure :: max_stretch
      procedure :: failure
   end type elastic_t

contains

   !> A law in rate form retains a modified stress.
   pure type(failure_t) function failure(self)
      class(elastic_t), intent(in) :: self
      failure = failure_t(acts=.true., lame=self%lame, shear=self%shear)
   end function failure

   !> Hughes and Winget (1980): with the increment G = A - A^2/2, A = dt L (midpoint, second order), the
   !> stress is rotated by the Cayley transform of the skew part, then C : sym G is added. The rotation alone
   !> changes no invariant.
   pure subroutine update(self, column, layout, gradient, time_step, first, last)
      class(elastic_t), intent(in) :: self
      real(wp), intent(inout), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      real(wp), intent(in), contiguous :: gradient(:, :)
      real(wp), intent(in) :: time_step
      integer, intent(in) :: first, last
      integer :: p, s
      s = layout%stress
      !$omp simd
      do p = first, last
         call turn_and_strain(self%lame, self%shear, time_step, gradient(p, 1), gradient(p, 2), &
                              gradient(p, 3), gradient(p, 4), &
                              gradient(p, 5), gradient(p, 6), gradient(p, 7), gradient(p, 8), &
                                 gradient(p, 9), column(p, s), &
                              column(p, s + 1), column(p, s + 2), column(p, s + 3), column(p, s + 4), &
                                 column(p, s + 5))
      end do
   end subroutine update

   !> One particle; scalars, so that the loop above is vectorised.
   pure elemental subroutine turn_and_strain(lame, shear, dt, l11, l21, l31, l12, l22, l32, l13, l23, l33, &
                                             xx, yy, zz, yz, xz, xy)
      real(wp), intent(in) :: lame, shear, dt, l11, l21, l31, l12, l22, l32, l13, l23, l33
      real(wp), intent(inout) :: xx, yy, zz, yz, xz, xy
      real(wp) :: a11, a21, a31, a12, a22, a32, a13, a23, a33, g11, g21, g31, g12, g22, g32, g13, g23, g33
      real(wp) :: wx, wy, wz, c, r11, r21, r31, r12, r22, r32, r13, r23, r33, t11, t21, t31, t12, t22, t32, &
                  t13, t23, t33, volume
      a11 = dt*l11; a21 = dt*l21; a31 = dt*l31
      a12 = dt*l12; a22 = dt*l22; a32 = dt*l32
      a13 = dt*l13; a23 = dt*l23; a33 = dt*l33
      g11 = a11 - 0.5_wp*(a11*a11 + a12*a21 + a13*a31)
      g21 = a21 - 0.5_wp*(a21*a11 + a22*a21 + a23*a31)
      g31 = a31 - 0.5_wp*(a31*a11 + a32*a21 + a33*a31)
      g12 = a12 - 0.5_wp*(a11*a12 + a12*a22 + a13*a32)
      g22 = a22 - 0.5_wp*(a21*a12 + a22*a22 + a23*a32)
      g32 = a32 - 0.5_wp*(a31*a12 + a32*a22 + a33*a32)
      g13 = a13 - 0.5_wp*(a11*a13 + a12*a23 + a13*a33)
      g23 = a23 - 0.5_wp*(a21*a13 + a22*a23 + a23*a33)
      g33 = a33 - 0.5_wp*(a31*a13 + a32*a23 + a33*a33)
      ! rotation: R = I + (W + W^2/2)/(1 + w^2/4), W the skew part of G, w its axial vector
      wx = 0.5_wp*(g32 - g23)
      wy = 0.5_wp*(g13 - g31)
      wz = 0.5_wp*(g21 - g12)
      c = 1.0_wp/(1.0_wp + 0.25_wp*(wx*wx + wy*wy + wz*wz))
      r11 = 1.0_wp - 0.5_wp*c*(wy*wy + wz*wz)
      r22 = 1.0_wp - 0.5_wp*c*(wx*wx + wz*wz)
      r33 = 1.0_wp - 0.5_wp*c*(wx*wx + wy*wy)
      r12 = c*(0.5_wp*wx*wy - wz); r21 = c*(0.5_wp*wx*wy + wz)
      r13 = c*(0.5_wp*wx*wz + wy); r31 = c*(0.5_wp*wx*wz - wy)
      r23 = c*(0.5_wp*wy*wz - wx); r32 = c*(0.5_wp*wy*wz + wx)
      t11 = r11*xx + r12*xy + r13*xz; t12 = r11*xy + r12*yy + r13*yz; t13 = r11*xz + r12*yz + r13*zz
      t21 = r21*xx + r22*xy + r23*xz; t22 = r21*xy + r22*yy + r23*yz; t23 = r21*xz + r22*yz + r23*zz
      t31 = r31*xx + r32*xy + r33*xz; t32 = r31*xy + r32*yy + r33*yz; t33 = r31*xz + r32*yz + r33*zz
      volume = lame*(g11 + g22 + g33)
      xx = t11*r11 + t12*r12 + t13*r13 + volume + 2.0_wp*shear*g11
      yy = t21*r21 + t22*r22 + t23*r23 + volume + 2.0_wp*shear*g22
      zz = t31*r31 + t32*r32 + t33*r33 + volume + 2.0_wp*shear*g33
      yz = t21*r31 + t22*r32 + t23*r33 + shear*(g23 + g32)
      xz = t11*r31 + t12*r32 + t13*r33 + shear*(g13 + g31)
      xy = t11*r21 + t12*r22 + t13*r23 + shear*(g12 + g21)
   end subroutine turn_and_strain

   !> For this law itself, not for those that extend it.
   pure subroutine stress_tangent(self, column, layout, gradient, parts, time_step, count, slope, known)
      class(elastic_t), intent(in) :: self
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      real(wp), intent(in), contiguous :: gradient(:, :)
      integer, intent(in) :: parts, count
      real(wp), intent(in) :: time_step
      real(wp), intent(inout), contiguous :: slope(:, :)
      logical, intent(out) :: known
      real(wp) :: stress(count, 6)
      known = .false.
      select type (self)
      type is (elastic_t)
         known = parts == 1
      end select
      if (known) call elastic_slopes(count, self%lame, self%shear, gradient, &
                                     column(:count, layout%stress:layout%stress + 5), stress, slope)
   end subroutine stress_tangent

   !> Sum of the strain energy, J: V sigma : C^-1 : sigma / 2, with a correction for the change of volume
   !> (theory.md, eq. elastic-energy).
   pure real(wp) function strain_energy(self, column, layout, first, last) result(energy)
      class(elastic_t), intent(in) :: self
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: first, last
      real(wp) :: trace, squares, share, per_volume, v
      integer :: p, s
      s = layout%stress
      share = self%lame/(3.0_wp*self%lame + 2.0_wp*self%shear)
      per_volume = 1.0_wp/(3.0_wp*self%lame + 2.0_wp*self%shear)
      energy = 0.0_wp
      !$omp simd reduction(+: energy) private(trace, squares, v)
      do p = first, last
         trace = column(p, s) + column(p, s + 1) + column(p, s + 2)
         squares = column(p, s)**2 + column(p, s + 1)**2 + column(p, s + 2)**2 &
                   + 2.0_wp*(column(p, s + 3)**2 + column(p, s + 4)**2 + column(p, s + 5)**2)
         v = per_volume*trace ! logarithm of the volume ratio
         energy = energy + column(p, layout%volume)*(squares - share*trace**2) *(1.0_wp &
            - v*(1.0_wp/3.0_wp - v*(1.0_wp/12.0_wp - v*(1.0_wp/60.0_wp - v/360.0_wp))))
      end do
      energy = energy/(4.0_wp*self%shear)
   end function strain_energy

   !> exp(n . C^-1 sigma . n): the stress of this law is that of the logarithmic strain, as long as axes do
   !> not rotate much.
   pure real(wp) function stretch(self, values, layout, direction)
      class(elastic_t), intent(in) :: self
      real(wp), intent(in) :: values(:)
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: direction(3)
      real(wp) :: s(6), trace, along
      s = values(layout%stress:layout%stress + 5)
      trace = s(1) + s(2) + s(3)
      along = sum(s(1:3)*direction**2) + 2.0_wp*(s(4)*direction(2)*direction(3) &
                                                 + s(5)*direction(1)*direction(3) &
                                                 + s(6)*direction(1)*direction(2))
      stretch = exp((along - self%lame*trace/(3.0_wp*self%lame + 2.0_wp*self%shear))/(2.0_wp*self%shear))
   end function stretch

   !> The largest principal stress does not exceed the largest row sum of the tensor (Gershgorin).
   pure real(wp) function max_stretch(self, values, layout)
      class(elastic_t), intent(in) :: self
      real(wp), intent(in) :: values(:)
      type(layout_t), intent(in) :: layout
      real(wp) :: s(6), most
      s = values(layout%stress:layout%stress + 5)
      most = max(s(1) + abs(s(5)) + abs(s(6)), s(2) + abs(s(4)) + abs(s(6)), s(3) + abs(s(4)) + abs(s(5)))
      max_stretch = exp((most - self%lame*sum(s(1:3))/(3.0_wp*self%lame + 2.0_wp*self%shear)) &
                         /(2.0_wp*self%shear))
   end function max_stretch

end module m_elastic
