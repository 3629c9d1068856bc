!> One-dimensional uGIMP weights of a particle on the three nodes around its nearest node (theory.md, eq. weights).
module m_gimp_weight
   use m_kinds, only: wp
   implicit none
   private
   public :: gimp_weights

contains

   !> Weights and slopes on the nodes at -1, 0, +1 cells from the nearest node, without branches.
   !> Bardenhagen and Kober (2004), integrated for a hat function and a particle of half size not above half a cell.
   pure elemental subroutine gimp_weights(offset, half_size, lower, middle, upper, slope_lower, slope_upper)
      real(wp), intent(in) :: offset    !< place relative to the nearest node, in cells, |offset| <= 1/2
      real(wp), intent(in) :: half_size !< half the particle's edge, in cells, above 0 and at most 1/2
      real(wp), intent(out) :: lower, middle, upper     !< weights
      real(wp), intent(out) :: slope_lower, slope_upper !< d weight / d place, 1/cell; the middle one is minus their sum
      real(wp) :: reach, overlap, per_edge
      per_edge = 0.5_wp/half_size
      reach = max(0.0_wp, half_size - offset)
      overlap = min(reach, 2.0_wp*half_size)
      lower = 0.5_wp*per_edge*overlap*overlap + (reach - overlap)
      slope_lower = -overlap*per_edge
      reach = max(0.0_wp, half_size + offset)
      overlap = min(reach, 2.0_wp*half_size)
      upper = 0.5_wp*per_edge*overlap*overlap + (reach - overlap)
      slope_upper = overlap*per_edge
      middle = 1.0_wp - lower - upper
   end subroutine gimp_weights

end module m_gimp_weight
