!> Compressible neo-Hookean solid: U = mu/2 (J^(-2/3) tr b - 3) + K/2 (J - 1)^2 (theory.md, eq. neo-hookean).
module m_neo_hookean
   use m_kinds, only: wp
   use m_vectors, only: cross
   use m_field_table, only: layout_t, field_table_t
   use m_isotropic, only: isotropic_t
   use m_stress_slopes, only: add_deformation, component
   implicit none
   private
   public :: neo_hookean_t

   type, extends(isotropic_t) :: neo_hookean_t
   contains
      procedure :: declare
      procedure :: initial
      procedure :: begin_stressed
      procedure :: update
      procedure :: stress_tangent
      procedure :: strain_energy
      procedure :: stretch
      procedure :: max_stretch
      procedure :: for_large_strains
   end type neo_hookean_t

contains

   pure logical function for_large_strains(self)
      class(neo_hookean_t), intent(in) :: self
      for_large_strains = .true.
   end function for_large_strains

   !> Declare the deformation gradient.
   pure subroutine declare(self, table, has_tools)
      class(neo_hookean_t), intent(inout) :: self
      type(field_table_t), intent(inout) :: table
      logical, intent(in) :: has_tools
      call table%declare('deformation_gradient', 9, '1', written=.false., by_mass=.true.)
   end subroutine declare

   !> Its initial value is the identity.
   pure subroutine initial(self, column, layout, first, last)
      class(neo_hookean_t), intent(in) :: self
      real(wp), intent(inout), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: first, last
      column(first:last, layout%deformation:layout%deformation + 8:4) = 1.0_wp
   end subroutine initial

   !> J = 1 + p/K; b = J^(5/3)/mu dev sigma + m I with the m for which det b = J^2; F is the lower triangular
   !> Cholesky factor (theory.md, eq. first-stress).
   pure subroutine begin_stressed(self, stress, column, layout, first, last)
      class(neo_hookean_t), intent(in) :: self
      real(wp), intent(in) :: stress(6)
      real(wp), intent(inout), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: first, last
      real(wp) :: b(3, 3), deviator(3, 3), f(3, 3), jacobian, lowest, m, change
      integer :: i, k
      deviator = reshape([stress(1), stress(6), stress(5), stress(6), stress(2), stress(4), stress(5), &
                          stress(4), stress(3)], [3, 3])
      associate (p => sum(stress(1:3))/3.0_wp)
         jacobian = 1.0_wp + p/(self%lame + 2.0_wp*self%shear/3.0_wp)
         do i = 1, 3
            deviator(i, i) = deviator(i, i) - p
         end do
      end associate
      if (.not. jacobian > 0.0_wp) return ! no deformation has this stress
      deviator = jacobian**(5.0_wp/3.0_wp)/self%shear*deviator
      ! det(m I + D) rises for all m with positive definite b: Newton's iteration decreases monotonically
      lowest = 0.0_wp
      do i = 1, 3
         lowest = max(lowest, sum(abs(deviator(:, i))))
      end do
      m = lowest + jacobian**(2.0_wp/3.0_wp)
      do k = 1, 100
         b = deviator
         do i = 1, 3
            b(i, i) = b(i, i) + m
         end do
         change = (dot_product(b(:, 1), cross(b(:, 2), b(:, 3))) - jacobian**2)/minors(b)
         m = m - change
         if (abs(change) <= 4.0_wp*epsilon(m)*m) exit
      end do
      f = 0.0_wp
      do k = 1, 3
         f(k, k) = sqrt(max(b(k, k) - sum(f(k, :k - 1)**2), 0.0_wp))
         do i = k + 1, 3
            f(i, k) = (b(i, k) - sum(f(i, :k - 1)*f(k, :k - 1)))/max(f(k, k), tiny(m))
         end do
      end do
      column(first:last, layout%deformation:layout%deformation + 8) = spread(reshape(f, [9]), 1, &
                                                                             last - first + 1)
   contains
      !> Sum of the principal minors: derivative of the determinant by an addition to the diagonal.
      pure real(wp) function minors(b)
         real(wp), intent(in) :: b(3, 3)
         minors = b(1, 1)*b(2, 2) - b(1, 2)**2 + b(2, 2)*b(3, 3) - b(2, 3)**2 + b(1, 1)*b(3, 3) - b(1, 3)**2
      end function minors
   end subroutine begin_stressed

   !> F <- (I + dt L) F; sigma = mu J^(-5/3) dev b + K (J - 1) I.
   pure subroutine update(self, column, layout, gradient, time_step, first, last)
      class(neo_hookean_t), intent(in) :: self
      real(wp), intent(inout), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      real(wp), intent(in), contiguous :: gradient(:, :)
      real(wp), intent(in) :: time_step
      integer, intent(in) :: first, last
      integer :: p, s, d, k
      s = layout%stress
      d = layout%deformation
      do k = d, d + 6, 3
         !$omp simd
         do p = first, last
            call push(time_step, gradient(p, 1), gradient(p, 2), gradient(p, 3), gradient(p, 4), &
                      gradient(p, 5), gradient(p, 6), gradient(p, 7), gradient(p, 8), gradient(p, 9), &
                      column(p, k), column(p, k + 1), column(p, k + 2))
         end do
      end do
      !$omp simd
      do p = first, last
         call stress_of(self%shear, self%lame + 2.0_wp*self%shear/3.0_wp, column(p, d), column(p, d + 1), &
                        column(p, d + 2), column(p, d + 3), column(p, d + 4), column(p, d + 5), &
                        column(p, d + 6), column(p, d + 7), column(p, d + 8), column(p, s), &
                        column(p, s + 1), column(p, s + 2), column(p, s + 3), column(p, s + 4), &
                        column(p, s + 5))
      end do
   end subroutine update

   !> With l = dA (I + A)^-1, which does not depend on the division into parts: db = l b + b l^T, dJ = J tr l.
   pure subroutine stress_tangent(self, column, layout, gradient, parts, time_step, count, slope, known)
      class(neo_hookean_t), intent(in) :: self
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      real(wp), intent(in), contiguous :: gradient(:, :)
      integer, intent(in) :: parts, count
      real(wp), intent(in) :: time_step
      real(wp), intent(inout), contiguous :: slope(:, :)
      logical, intent(out) :: known
      real(wp), dimension(count, 9) :: f, inverse
      real(wp) :: s(count, 6), b(count, 6), v(count, 3), factor(count), bulk(count), mean(count), both(count)
      integer :: c, j, k, l
      known = .true.
      f = column(:count, layout%deformation:layout%deformation + 8)
      call add_deformation(count, gradient, f, inverse)
      factor = determinant(f(:, 1), f(:, 2), f(:, 3), f(:, 4), f(:, 5), f(:, 6), f(:, 7), f(:, 8), f(:, 9))
      bulk = (self%lame + 2.0_wp*self%shear/3.0_wp)*factor
      factor = self%shear*factor**(-5.0_wp/3.0_wp)
      do j = 1, 3
         do k = j, 3
            b(:, component(j, k)) = f(:, j)*f(:, k) + f(:, j + 3)*f(:, k + 3) + f(:, j + 6)*f(:, k + 6)
         end do
      end do
      mean = (b(:, 1) + b(:, 2) + b(:, 3))/3.0_wp
      do l = 1, 3
         do j = 1, 3 ! v = b . (row l of the inverse)
            v(:, j) = b(:, component(j, 1))*inverse(:, l) + b(:, component(j, 2))*inverse(:, l + 3) &
                      + b(:, component(j, 3))*inverse(:, l + 6)
         end do
         do k = 1, 3
            associate (of_l => inverse(:, 3*k - 3 + l))
               do c = 1, 6
                  s(:, c) = -5.0_wp/3.0_wp*of_l*b(:, c)
               end do
               do j = 1, 3
                  s(:, component(k, j)) = s(:, component(k, j)) + v(:, j)
               end do
               s(:, k) = s(:, k) + v(:, k)
               both = factor*(5.0_wp/3.0_wp*of_l*mean - 2.0_wp/3.0_wp*v(:, k)) + bulk*of_l
            end associate
            do c = 1, 6
               slope(:, 6*(3*l - 3 + k) - 6 + c) = factor*s(:, c)
               if (c <= 3) slope(:, 6*(3*l - 3 + k) - 6 + c) = slope(:, 6*(3*l - 3 + k) - 6 + c) + both
            end do
         end do
      end do
   end subroutine stress_tangent

   !> v <- v + dt L v. Local to this module so that it is inlined in the loop.
   pure elemental subroutine push(dt, l11, l21, l31, l12, l22, l32, l13, l23, l33, x, y, z)
      real(wp), intent(in) :: dt, l11, l21, l31, l12, l22, l32, l13, l23, l33
      real(wp), intent(inout) :: x, y, z
      real(wp) :: u, v, w
      u = x; v = y; w = z
      x = u + dt*(l11*u + l12*v + l13*w)
      y = v + dt*(l21*u + l22*v + l23*w)
      z = w + dt*(l31*u + l32*v + l33*w)
   end subroutine push

   !> The stress of F. Scalars, so that the loop above is vectorised.
   pure elemental subroutine stress_of(shear, bulk, f11, f21, f31, f12, f22, f32, f13, f23, f33, xx, yy, &
                                       zz, yz, xz, xy)
      real(wp), intent(in) :: shear, bulk, f11, f21, f31, f12, f22, f32, f13, f23, f33
      real(wp), intent(out) :: xx, yy, zz, yz, xz, xy
      real(wp) :: jacobian, b11, b22, b33, mean, pressure, factor
      jacobian = determinant(f11, f21, f31, f12, f22, f32, f13, f23, f33)
      b11 = f11*f11 + f12*f12 + f13*f13
      b22 = f21*f21 + f22*f22 + f23*f23
      b33 = f31*f31 + f32*f32 + f33*f33
      mean = (b11 + b22 + b33)/3.0_wp
      pressure = bulk*(jacobian - 1.0_wp)
      factor = shear*max(jacobian, tiny(jacobian))**(-5.0_wp/3.0_wp)
      xx = factor*(b11 - mean) + pressure
      yy = factor*(b22 - mean) + pressure
      zz = factor*(b33 - mean) + pressure
      yz = factor*(f21*f31 + f22*f32 + f23*f33)
      xz = factor*(f11*f31 + f12*f32 + f13*f33)
      xy = factor*(f11*f21 + f12*f22 + f13*f23)
   end subroutine stress_of

   pure elemental real(wp) function determinant(f11, f21, f31, f12, f22, f32, f13, f23, f33)
      real(wp), intent(in) :: f11, f21, f31, f12, f22, f32, f13, f23, f33
      determinant = f11*(f22*f33 - f23*f32) - f12*(f21*f33 - f23*f31) + f13*(f21*f32 - f22*f31)
   end function determinant

   !> Sum of V/J U, J.
   pure real(wp) function strain_energy(self, column, layout, first, last) result(energy)
      class(neo_hookean_t), intent(in) :: self
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: first, last
      real(wp) :: bulk
      integer :: p, d
      bulk = self%lame + 2.0_wp*self%shear/3.0_wp
      d = layout%deformation
      energy = 0.0_wp
      !$omp simd reduction(+: energy)
      do p = first, last
         energy = energy + column(p, layout%volume) &
                  *density_of(self%shear, bulk, column(p, d), column(p, d + 1), column(p, d + 2), &
                              column(p, d + 3), column(p, d + 4), column(p, d + 5), column(p, d + 6), &
                              column(p, d + 7), column(p, d + 8))
      end do
   end function strain_energy

   !> U/J, per present volume, J/m3.
   pure elemental real(wp) function density_of(shear, bulk, f11, f21, f31, f12, f22, f32, f13, f23, &
                                               f33) result(density)
      real(wp), intent(in) :: shear, bulk, f11, f21, f31, f12, f22, f32, f13, f23, f33
      real(wp) :: jacobian, trace
      jacobian = determinant(f11, f21, f31, f12, f22, f32, f13, f23, f33)
      trace = f11*f11 + f21*f21 + f31*f31 + f12*f12 + f22*f22 + f32*f32 + f13*f13 + f23*f23 + f33*f33
      density = (0.5_wp*shear*(trace*jacobian**(-2.0_wp/3.0_wp) - 3.0_wp) &
                 + 0.5_wp*bulk*(jacobian - 1.0_wp)**2)/jacobian
   end function density_of

   !> sqrt(n . b . n), b = F F^T.
   pure real(wp) function stretch(self, values, layout, direction)
      class(neo_hookean_t), intent(in) :: self
      real(wp), intent(in) :: values(:)
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: direction(3)
      stretch = norm2(matmul(direction, reshape(values(layout%deformation:layout%deformation + 8), [3, 3])))
   end function stretch

   !> The largest eigenvalue of F F^T does not exceed its largest row sum (Gershgorin).
   pure real(wp) function max_stretch(self, values, layout)
      class(neo_hookean_t), intent(in) :: self
      real(wp), intent(in) :: values(:)
      type(layout_t), intent(in) :: layout
      real(wp) :: f(3, 3)
      f = reshape(values(layout%deformation:layout%deformation + 8), [3, 3])
      max_stretch = sqrt(maxval(sum(abs(matmul(f, transpose(f))), dim=1)))
   end function max_stretch

end module m_neo_hookean
