!> Compressible neo-Hookean solid: U = mu/2 (J^(-2/3) tr b - 3) + K/2 (J - 1)^2 (theory.md, eq. neo-hookean).
module m_neo_hookean
   use m_kinds, only: wp
   use m_field_table, only: layout_t, field_table_t
   use m_isotropic, only: isotropic_t
   implicit none
   private
   public :: neo_hookean_t

   type, extends(isotropic_t) :: neo_hookean_t
   contains
      procedure :: declare
      procedure :: initial
      procedure :: begin_stressed
      procedure :: update
      procedure :: strain_energy
      procedure :: stretch
      procedure :: for_large_strains
   end type neo_hookean_t

contains

   pure logical function for_large_strains(self)
      class(neo_hookean_t), intent(in) :: self
      for_large_strains = .true.
   end function for_large_strains

   !> The deformation gradient.
   pure subroutine declare(self, table, has_tools)
      class(neo_hookean_t), intent(inout) :: self
      type(field_table_t), intent(inout) :: table
      logical, intent(in) :: has_tools
      call table%declare('deformation_gradient', 9, '1', written=.false.)
   end subroutine declare

   !> It begins as the identity.
   pure subroutine initial(self, column, layout, first, last)
      class(neo_hookean_t), intent(in) :: self
      real(wp), intent(inout), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: first, last
      column(first:last, layout%deformation:layout%deformation + 8:4) = 1.0_wp
   end subroutine initial

   !> J = 1 + p/K; b = J^(5/3)/mu dev sigma + m I with the m that makes det b = J^2; F is the lower triangle of
   !> its Cholesky factors (theory.md, eq. first-stress).
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
      if (.not. jacobian > 0.0_wp) return ! no deformation has that stress
      deviator = jacobian**(5.0_wp/3.0_wp)/self%shear*deviator
      ! det(m I + D) rises from where m is large enough for a positive b: Newton's steps come from above
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
         change = (determinant(b) - jacobian**2)/minors(b)
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
      !> Sum of the principal minors: how the determinant grows with what is added to the diagonal.
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
      real(wp) :: f(3, 3), b(3, 3), jacobian, factor, pressure, bulk, mean
      integer :: p, s, d
      s = layout%stress
      d = layout%deformation
      bulk = self%lame + 2.0_wp*self%shear/3.0_wp
      do p = first, last
         f = reshape(column(p, d:d + 8), [3, 3])
         f = f + time_step*matmul(reshape(gradient(p, 1:9), [3, 3]), f)
         column(p, d:d + 8) = reshape(f, [9])
         jacobian = determinant(f)
         b = matmul(f, transpose(f))
         mean = (b(1, 1) + b(2, 2) + b(3, 3))/3.0_wp
         pressure = bulk*(jacobian - 1.0_wp)
         factor = self%shear/max(jacobian, tiny(jacobian))**(5.0_wp/3.0_wp)
         column(p, s) = factor*(b(1, 1) - mean) + pressure
         column(p, s + 1) = factor*(b(2, 2) - mean) + pressure
         column(p, s + 2) = factor*(b(3, 3) - mean) + pressure
         column(p, s + 3) = factor*b(2, 3)
         column(p, s + 4) = factor*b(1, 3)
         column(p, s + 5) = factor*b(1, 2)
      end do
   end subroutine update

   pure real(wp) function determinant(f)
      real(wp), intent(in) :: f(3, 3)
      determinant = f(1, 1)*(f(2, 2)*f(3, 3) - f(2, 3)*f(3, 2)) - f(1, &
         2)*(f(2, 1)*f(3, 3) - f(2, 3)*f(3, 1)) + f(1, 3)*(f(2, 1)*f(3, 2) - f(2, 2)*f(3, 1))
   end function determinant

   !> Sum of V/J U, J.
   pure real(wp) function strain_energy(self, column, layout, first, last) result(energy)
      class(neo_hookean_t), intent(in) :: self
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: first, last
      real(wp) :: f(3, 3), jacobian, bulk, density
      integer :: p
      bulk = self%lame + 2.0_wp*self%shear/3.0_wp
      energy = 0.0_wp
      do p = first, last
         f = reshape(column(p, layout%deformation:layout%deformation + 8), [3, 3])
         jacobian = determinant(f)
         density = 0.5_wp*self%shear*(sum(f**2)*jacobian**(-2.0_wp/3.0_wp) - 3.0_wp) &
                   + 0.5_wp*bulk*(jacobian - 1.0_wp)**2
         energy = energy + column(p, layout%volume)/jacobian*density
      end do
   end function strain_energy

   !> sqrt(n . b . n), b = F F^T.
   pure real(wp) function stretch(self, values, layout, direction)
      class(neo_hookean_t), intent(in) :: self
      real(wp), intent(in) :: values(:)
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: direction(3)
      stretch = norm2(matmul(direction, reshape(values(layout%deformation:layout%deformation + 8), [3, 3])))
   end function stretch

end module m_neo_hookean
