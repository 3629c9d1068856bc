!> Tangents of particles by their laws' own derivatives (theory.md, eq. closed-tangent).
module m_closed_tangent
   use m_kinds, only: wp
   use m_vectors, only: cross
   use m_field_table, only: layout_t
   use m_particle_store, only: particle_store_t
   use m_materials, only: materials_t
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
      integer :: p
      column = particles%column(first:first + count - 1, :)
      associate (law => materials%slots(materials%of_body(particles%body(first)))%law)
         call law%slopes(column, layout, gradient, parts, time_step, count, slope, known)
      end associate
      if (.not. known) return
      do p = 1, count
         call pull_back_slopes(column(p, layout%volume), gradient(p, :), force(p, :), slope(p, :), &
                               tangent(p, :))
      end do
   end subroutine closed_tangent

   !> With l = dA F^-1: d(sigma cof F) = (d sigma + sigma tr l - sigma l^T) cof F.
   pure subroutine pull_back_slopes(volume, gradient, force, slope, tangent)
      real(wp), intent(in) :: volume, gradient(9), force(9), slope(54)
      real(wp), intent(out) :: tangent(81)
      real(wp) :: f(3, 3), cofactor(3, 3), inverse(3, 3), s(3, 3), t(3, 3), determinant
      integer :: i, k, l
      f = reshape(gradient, [3, 3])
      do i = 1, 3
         f(i, i) = f(i, i) + 1.0_wp
      end do
      cofactor(:, 1) = cross(f(:, 2), f(:, 3))
      cofactor(:, 2) = cross(f(:, 3), f(:, 1))
      cofactor(:, 3) = cross(f(:, 1), f(:, 2))
      determinant = dot_product(f(:, 1), cofactor(:, 1))
      inverse = transpose(cofactor)/determinant
      s = -matmul(reshape(force, [3, 3]), transpose(f))/(determinant*volume) ! sigma
      cofactor = volume*cofactor
      do l = 1, 3
         do k = 1, 3
            associate (kl => 3*(l - 1) + k)
               associate (d => slope(6*kl - 5:6*kl))
                  t = reshape([d(1), d(6), d(5), d(6), d(2), d(4), d(5), d(4), d(3)], [3, 3]) &
                      + inverse(l, k)*s
               end associate
               ! l has one row, k: that of number l of the inverse; so sigma l^T has one column
               t(:, k) = t(:, k) - matmul(s, inverse(l, :))
               tangent(9*kl - 8:9*kl) = reshape(matmul(t, cofactor), [9])
            end associate
         end do
      end do
   end subroutine pull_back_slopes

end module m_closed_tangent
