!> Tangents of particles by their laws' own derivatives (theory.md, eq. closed-tangent).
module m_closed_tangent
   use m_kinds, only: wp
   use m_field_table, only: layout_t
   use m_particle_store, only: particle_store_t
   use m_materials, only: materials_t
   use m_stress_slopes, only: add_deformation, component
   implicit none
   private
   public :: closed_tangent

contains

   !> V d(sigma cof F)/dA of `count` particles of one body from `first` on, where their law knows d sigma/dA.
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
            do i = 1, 3 ! l has one row, k: that of number l of the inverse; so sigma l^T has one column
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
