!> Changes to P2G and G2P for sections (theory.md, Sections). The plane j of the section has all of a
!> particle's weight along y. For a body of revolution the gradient along y of that weight is 1/r: kernels
!> thus compute the hoop part of forces and of the velocity gradient.
module m_section_weights
   use m_kinds, only: wp
   implicit none
   private
   public :: set_plane, add_ring_slopes, take_hoop_force, take_hoop_rate, take_hoop_modulus, within_axis

contains

   !> Weights and gradients (1/m) along y of one layer of particles on a node plane: full weight on that
   !> plane, with the gradient 1/r of a ring of radius r, or 0 without `radius`.
   pure subroutine set_plane(count, weight, slope, radius)
      integer, intent(in) :: count
      real(wp), intent(inout) :: weight(:, -1:), slope(:, -1:) !< (:, -1:1), by particle and node
      real(wp), intent(in), optional :: radius(:) !< m
      integer :: p
      !$omp simd
      do p = 1, count
         weight(p, -1) = 0.0_wp
         weight(p, 0) = 1.0_wp
         weight(p, 1) = 0.0_wp
         slope(p, -1) = 0.0_wp
         slope(p, 0) = 0.0_wp
         slope(p, 1) = 0.0_wp
      end do
      if (present(radius)) slope(:count, 0) = 1.0_wp/radius(:count)
   end subroutine set_plane

   !> Radial gradients of the weights of boxes that represent rings: mean of N' over the ring, equal to that
   !> over the box plus mean((r - r_p) N')/r_p. With the weights over r_p for the hoop, a uniform pressure
   !> then gives forces at the surface only.
   pure subroutine add_ring_slopes(count, offset, half, radius, per_cell, slope)
      integer, intent(in) :: count
      real(wp), intent(in), contiguous :: offset(:) !< from the nearest node, cells
      real(wp), intent(in), contiguous :: half(:)   !< half sizes along the radius, m
      real(wp), intent(in), contiguous :: radius(:) !< m
      real(wp), intent(in) :: per_cell              !< 1/m
      real(wp), intent(inout), contiguous :: slope(:, -1:) !< (:, -1:1), 1/m
      real(wp) :: reach, from, to, lower, upper, per_edge
      integer :: p
      !$omp simd private(reach, from, to, lower, upper, per_edge)
      do p = 1, count
         reach = half(p)*per_cell
         per_edge = 0.5_wp/(reach*radius(p))
         from = min(offset(p) - reach, 0.0_wp)
         to = min(offset(p) + reach, 0.0_wp)
         lower = -(to - from)*(0.5_wp*(from + to) - offset(p))*per_edge
         from = max(offset(p) - reach, 0.0_wp)
         to = max(offset(p) + reach, 0.0_wp)
         upper = (to - from)*(0.5_wp*(from + to) - offset(p))*per_edge
         slope(p, -1) = slope(p, -1) + lower
         slope(p, 1) = slope(p, 1) + upper
         slope(p, 0) = slope(p, 0) - (lower + upper)
      end do
   end subroutine add_ring_slopes

   !> Factor by which a box or a parallelogram of half size `reach` along the radius is shrunk so that it does
   !> not extend beyond the axis.
   pure elemental real(wp) function within_axis(radius, reach) result(factor)
      real(wp), intent(in) :: radius, reach !< in the same unit; reach above 0
      factor = min(1.0_wp, radius/reach)
   end function within_axis

   !> The force with the gradient along y is that of the hoop stress, against the radius.
   pure subroutine take_hoop_force(count, force)
      integer, intent(in) :: count
      real(wp), intent(inout) :: force(:, :, :) !< (components, axes, particles), N m
      integer :: p
      do p = 1, count
         force(:, 2, p) = [force(2, 2, p), 0.0_wp, 0.0_wp, 0.0_wp]
      end do
   end subroutine take_hoop_force

   !> The component with the gradient along y is v_r/r, the rate of the hoop strain; v_z/r is not a strain
   !> rate.
   pure subroutine take_hoop_rate(count, gradient)
      integer, intent(in) :: count
      real(wp), intent(inout) :: gradient(:, :) !< (:, 9), d v_i / d x_j at 3 (j-1) + i, 1/s
      integer :: p
      do p = 1, count
         gradient(p, 5) = gradient(p, 4)
         gradient(p, 4) = 0.0_wp
         gradient(p, 6) = 0.0_wp
      end do
   end subroutine take_hoop_rate

   !> The same for the diagonal of a stiffness with the moduli of m_static_transfer: the term with the square
   !> of the gradient along y is the hoop's own modulus. Products with other gradients are left out: the
   !> diagonal is only a preconditioner.
   pure subroutine take_hoop_modulus(modulus)
      real(wp), intent(inout) :: modulus(27) !< of component a: b and d at 9 (a-1) + 3 (d-1) + b, J
      modulus(5) = modulus(14)
      modulus([2, 4, 6, 8]) = 0.0_wp
      modulus(10:18) = 0.0_wp            ! no motion along y
      modulus([20, 22, 23, 24, 26]) = 0.0_wp ! v_z/r is no strain
   end subroutine take_hoop_modulus

end module m_section_weights
