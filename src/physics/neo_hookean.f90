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
