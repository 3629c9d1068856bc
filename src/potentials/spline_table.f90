!> A function that a table gives at equal distances, by the cubic pieces that LAMMPS makes of such tables
!> (Hermite's, with slopes of differences over five points), so that both programs have one function.
module m_spline_table
   use m_kinds, only: wp
   implicit none
   private

   type, public :: spline_table_t
      real(wp) :: spacing = 0.0_wp           !< of the table, which begins at 0
      real(wp), allocatable :: piece(:, :)   !< (0:3, pieces): coefficients over the distance in spacings
   contains
      procedure :: set
      procedure :: evaluate
   end type spline_table_t

contains

   !> Values at 0, spacing, 2 spacing ...: five or more.
   pure subroutine set(self, spacing, values)
      class(spline_table_t), intent(inout) :: self
      real(wp), intent(in) :: spacing, values(:)
      real(wp) :: slope(size(values))
      integer :: k, n
      n = size(values)
      slope(1) = values(2) - values(1)
      slope(2) = 0.5_wp*(values(3) - values(1))
      do k = 3, n - 2
         slope(k) = ((values(k - 2) - values(k + 2)) + 8.0_wp*(values(k + 1) - values(k - 1)))/12.0_wp
      end do
      slope(n - 1) = 0.5_wp*(values(n) - values(n - 2))
      slope(n) = values(n) - values(n - 1)
      self%spacing = spacing
      if (allocated(self%piece)) deallocate (self%piece)
      allocate (self%piece(0:3, n - 1))
      do k = 1, n - 1
         associate (rise => values(k + 1) - values(k))
            self%piece(:, k) = [values(k), slope(k), 3.0_wp*rise - 2.0_wp*slope(k) - slope(k + 1), &
                                slope(k) + slope(k + 1) - 2.0_wp*rise]
         end associate
      end do
   end subroutine set

   !> Value and derivative at x, 0 or more; beyond the table the last piece is extended by its tangent.
   pure subroutine evaluate(self, x, value, slope)
      class(spline_table_t), intent(in) :: self
      real(wp), intent(in) :: x
      real(wp), intent(out) :: value, slope
      real(wp) :: p, beyond
      integer :: k
      p = x/self%spacing
      k = max(1, min(int(min(p, real(size(self%piece, 2), wp))) + 1, size(self%piece, 2)))
      p = p - (k - 1)
      beyond = max(p - 1.0_wp, 0.0_wp)
      p = min(p, 1.0_wp)
      associate (c => self%piece(:, k))
         value = ((c(4)*p + c(3))*p + c(2))*p + c(1)
         slope = ((3.0_wp*c(4)*p + 2.0_wp*c(3))*p + c(2))/self%spacing
      end associate
      value = value + slope*beyond*self%spacing
   end subroutine evaluate

end module m_spline_table
