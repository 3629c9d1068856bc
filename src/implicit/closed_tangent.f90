!> Tangents of particles from their laws' closed-form derivatives (theory.md, eq. closed-tangent).
module m_closed_tangent
   use m_kinds, only: wp
   use m_field_table, only: layout_t
   use m_particle_store, only: particle_store_t
   use m_scene_materials, only: materials_t
   use m_stress_slopes, only: add_deformation, component
   implicit none
   private
   public :: closed_tangent, pull_back

contains

   !> V d(sigma cof F)/dA of `count` particles of one body from `first` on, if their law provides d sigma/dA.
   subroutine closed_tangent(parts, particles, materials, layout, time_step, first, count, gradient, force, &
                             tangent, known)
      integer, intent(in) :: parts
      type(particle_store_t), intent(in) :: particles
      type(materials_t), intent(in) :: materials
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: time_step
      integer, intent(in) :: first, count
      real(wp), intent(in) :: gradient(count, 9)
      real(wp), intent(in) :: force(count, 9)  !< - V sigma cof F
      real(wp), intent(inout) :: tangent(:, :) !< (count, 81)
      logical, intent(out) :: known
      real(wp) :: slope(count, 54), column(count, size(particles%column, 2))
      column = particles%column(first:first + count - 1, :)
      associate (law => materials%slots(materials%of_body(particles%body(first)))%law)
         call law%stress_tangent(column, layout, gradient, parts, time_step, count, slope, known)
      end associate
      if (.not. known) return
      call pull_back_slopes(count, column(:, layout%volume), gradient, force, slope, tangent)
   end subroutine closed_tangent

   !> force = - V sigma cof(I + A).
   pure subroutine pull_back(n, a, volume, s, force, determinant)
      integer, intent(in) :: n
      real(wp), intent(in) :: a(n, 9), volume(n), s(n, 6)
      real(wp), intent(out) :: force(n, 9), determinant(*)
      real(wp) :: f11, f21, f31, f12, f22, f32, f13, f23, f33, c11, c21, c31, c12, c22, c32, c13, c23, c33
      integer :: p
      !$omp simd private(f11, f21, f31, f12, f22, f32, f13, f23, f33, c11, c21, c31, c12, c22, c32, c13, &
      !$omp& c23, c33)
      do p = 1, n
         f11 = 1.0_wp + a(p, 1); f21 = a(p, 2); f31 = a(p, 3)
         f12 = a(p, 4); f22 = 1.0_wp + a(p, 5); f32 = a(p, 6)
         f13 = a(p, 7); f23 = a(p, 8); f33 = 1.0_wp + a(p, 9)
         c11 = f22*f33 - f23*f32; c12 = f23*f31 - f21*f33; c13 = f21*f32 - f22*f31
         c21 = f13*f32 - f12*f33; c22 = f11*f33 - f13*f31; c23 = f12*f31 - f11*f32
         c31 = f12*f23 - f13*f22; c32 = f13*f21 - f11*f23; c33 = f11*f22 - f12*f21
         determinant(p) = f11*c11 + f12*c12 + f13*c13
         force(p, 1) = -volume(p)*(s(p, 1)*c11 + s(p, 6)*c21 + s(p, 5)*c31)
         force(p, 2) = -volume(p)*(s(p, 6)*c11 + s(p, 2)*c21 + s(p, 4)*c31)
         force(p, 3) = -volume(p)*(s(p, 5)*c11 + s(p, 4)*c21 + s(p, 3)*c31)
         force(p, 4) = -volume(p)*(s(p, 1)*c12 + s(p, 6)*c22 + s(p, 5)*c32)
         force(p, 5) = -volume(p)*(s(p, 6)*c12 + s(p, 2)*c22 + s(p, 4)*c32)
         force(p, 6) = -volume(p)*(s(p, 5)*c12 + s(p, 4)*c22 + s(p, 3)*c32)
         force(p, 7) = -volume(p)*(s(p, 1)*c13 + s(p, 6)*c23 + s(p, 5)*c33)
         force(p, 8) = -volume(p)*(s(p, 6)*c13 + s(p, 2)*c23 + s(p, 4)*c33)
         force(p, 9) = -volume(p)*(s(p, 5)*c13 + s(p, 4)*c23 + s(p, 3)*c33)
      end do
   end subroutine pull_back

   !> With l = dA F^-1: d(sigma cof F) = (d sigma + sigma tr l - sigma l^T) cof F.
   pure subroutine pull_back_slopes(n, volume, gradient, force, slope, tangent)
      integer, intent(in) :: n
      real(wp), intent(in) :: volume(n), gradient(n, 9), force(n, 9), slope(n, 54)
      real(wp), intent(inout) :: tangent(:, :) !< (n, 81)
      real(wp) :: f(n, 9), inverse(n, 9), cofactor(n, 9), s(n, 9), t(n, 9), size_of(n)
      integer :: i, j, k, l
      f = 0.0_wp
      f(:, 1:9:4) = 1.0_wp
      call add_deformation(n, gradient, f, inverse)
      size_of = f(:, 1)*(f(:, 5)*f(:, 9) - f(:, 6)*f(:, 8)) - f(:, 4)*(f(:, 2)*f(:, 9) - f(:, 3)*f(:, 8)) &
                + f(:, 7)*(f(:, 2)*f(:, 6) - f(:, 3)*f(:, 5))
      do j = 1, 3
         do i = 1, 3
            cofactor(:, 3*j - 3 + i) = volume*size_of*inverse(:, 3*i - 3 + j)
            s(:, 3*j - 3 + i) = -(force(:, i)*f(:, j) + force(:, i + 3)*f(:, j + 3) &
                                  + force(:, i + 6)*f(:, j + 6))/(size_of*volume) ! sigma
         end do
      end do
      do l = 1, 3
         do k = 1, 3
            do j = 1, 3
               do i = 1, 3
                  t(:, 3*j - 3 + i) = slope(:, 6*(3*l - 3 + k) - 6 + component(i, j)) &
                                      + inverse(:, 3*k - 3 + l)*s(:, 3*j - 3 + i)
               end do
            end do
            do i = 1, 3 ! l has one row, k: row number l of the inverse; so sigma l^T has one column
               t(:, 3*k - 3 + i) = t(:, 3*k - 3 + i) - s(:, i)*inverse(:, l) &
                                   - s(:, i + 3)*inverse(:, l + 3) - s(:, i + 6)*inverse(:, l + 6)
            end do
            do j = 1, 3
               do i = 1, 3
                  tangent(:n, 9*(3*l - 3 + k) - 12 + 3*j + i) = t(:, i)*cofactor(:, 3*j - 2) &
                     + t(:, i + 3)*cofactor(:, 3*j - 1) + t(:, i + 6)*cofactor(:, 3*j)
               end do
            end do
         end do
      end do
   end subroutine pull_back_slopes

end module m_closed_tangent
