!> The weight of a particle on a node, plainly: the mean of the hat function over the particle's domain,
!> integrated piece by piece between the kinks; its slope by a complex step. Shares nothing with the code
!> under test.
module m_plain_weight
   use m_kinds, only: wp
   implicit none
   private
   public :: plain_weight, plain_weights

   interface plain_weight
      procedure :: weight_real, weight_complex
   end interface plain_weight

contains

   pure real(wp) function weight_real(distance, half_size)
      real(wp), intent(in) :: distance, half_size
      weight_real = real(weight_complex(cmplx(distance, 0.0_wp, wp), half_size), wp)
   end function weight_real

   !> Mean of max(0, 1 - |s|) over distance - half_size < s < distance + half_size, all in cells.
   pure complex(wp) function weight_complex(distance, half_size) result(weight)
      complex(wp), intent(in) :: distance !< from the node to the particle
      real(wp), intent(in) :: half_size
      complex(wp) :: from, to
      real(wp), parameter :: kinks(2, 2) = reshape([-1.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [2, 2]), &
         rise(2) = [1.0_wp, -1.0_wp]
      integer :: piece
      weight = 0.0_wp
      do piece = 1, 2
         from = distance - half_size
         to = distance + half_size
         if (real(from, wp) < kinks(1, piece)) from = kinks(1, piece)
         if (real(to, wp) > kinks(2, piece)) to = kinks(2, piece)
         if (real(to, wp) <= real(from, wp)) cycle
         weight = weight + (to - from)*(1.0_wp + 0.5_wp*rise(piece)*(from + to)) ! exact: the hat is linear
                                                                                 ! there
      end do
      weight = weight/(2.0_wp*half_size)
   end function weight_complex

   !> Weight of a box-shaped particle at `place` on the node at `node`, and its gradient (1/m).
   pure subroutine plain_weights(place, node, half_size, cell, weight, slope)
      real(wp), intent(in) :: place(3), node(3), half_size, cell !< m
      real(wp), intent(out) :: weight, slope(3)
      real(wp), parameter :: tiny_step = 1.0e-30_wp
      complex(wp) :: along
      real(wp) :: w(3), s(3)
      integer :: axis
      do axis = 1, 3
         along = plain_weight(cmplx((place(axis) - node(axis))/cell, tiny_step, wp), half_size/cell)
         w(axis) = real(along, wp)
         s(axis) = aimag(along)/tiny_step/cell
      end do
      weight = product(w)
      slope = [s(1)*w(2)*w(3), w(1)*s(2)*w(3), w(1)*w(2)*s(3)]
   end subroutine plain_weights

end module m_plain_weight
