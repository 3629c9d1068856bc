!> Tensors and rotations of `lanes` particles at once, one vector lane a particle: the components of particle
!> p are a(p, i, j).
module m_lane_tensors
   use m_kinds, only: wp
   implicit none
   private
   public :: load, set_unit, set_symmetric, take_columns, multiply, multiply_transposed, rotate, &
             find_cofactors, find_determinant, invert, decompose, set_matrices, set_quaternions, follow, &
             normalise

   integer, parameter, public :: lanes = 8
   integer, parameter :: iteration_limit = 60 !< as in m_polar
   real(wp), parameter :: settled = 4.0_wp*epsilon(1.0_wp)

contains

   !> A column's `count` values from index `first` on; further lanes repeat the last.
   pure subroutine load(column, first, count, values)
      real(wp), intent(in), contiguous :: column(:)
      integer, intent(in) :: first, count
      real(wp), intent(out) :: values(lanes)
      if (count == lanes) then
         values = column(first:first + lanes - 1)
      else
         values(:count) = column(first:first + count - 1)
         values(count + 1:) = column(first + count - 1)
      end if
   end subroutine load

   pure subroutine set_unit(a)
      real(wp), intent(out) :: a(lanes, 3, 3)
      integer :: p
      a = 0.0_wp
      !$omp simd
      do p = 1, lanes
         a(p, 1, 1) = 1.0_wp
         a(p, 2, 2) = 1.0_wp
         a(p, 3, 3) = 1.0_wp
      end do
   end subroutine set_unit

   !> Symmetric tensors from their columns xx yy zz yz xz xy.
   pure subroutine set_symmetric(s, a)
      real(wp), intent(in) :: s(lanes, 6)
      real(wp), intent(out) :: a(lanes, 3, 3)
      integer :: p
      !$omp simd
      do p = 1, lanes
         a(p, 1, 1) = s(p, 1)
         a(p, 2, 1) = s(p, 6)
         a(p, 3, 1) = s(p, 5)
         a(p, 1, 2) = s(p, 6)
         a(p, 2, 2) = s(p, 2)
         a(p, 3, 2) = s(p, 4)
         a(p, 1, 3) = s(p, 5)
         a(p, 2, 3) = s(p, 4)
         a(p, 3, 3) = s(p, 3)
      end do
   end subroutine set_symmetric

   !> The columns of symmetric tensors.
   pure subroutine take_columns(a, s)
      real(wp), intent(in) :: a(lanes, 3, 3)
      real(wp), intent(out) :: s(lanes, 6)
      integer :: p
      !$omp simd
      do p = 1, lanes
         s(p, 1) = a(p, 1, 1)
         s(p, 2) = a(p, 2, 2)
         s(p, 3) = a(p, 3, 3)
         s(p, 4) = a(p, 2, 3)
         s(p, 5) = a(p, 1, 3)
         s(p, 6) = a(p, 1, 2)
      end do
   end subroutine take_columns

   !> A B.
   pure subroutine multiply(a, b, product)
      real(wp), intent(in) :: a(lanes, 3, 3), b(lanes, 3, 3)
      real(wp), intent(out) :: product(lanes, 3, 3)
      integer :: i, j, p
      do j = 1, 3
         do i = 1, 3
            !$omp simd
            do p = 1, lanes
               product(p, i, j) = a(p, i, 1)*b(p, 1, j) + a(p, i, 2)*b(p, 2, j) + a(p, i, 3)*b(p, 3, j)
            end do
         end do
      end do
   end subroutine multiply

   !> A^T B.
   pure subroutine multiply_transposed(a, b, product)
      real(wp), intent(in) :: a(lanes, 3, 3), b(lanes, 3, 3)
      real(wp), intent(out) :: product(lanes, 3, 3)
      integer :: i, j, p
      do j = 1, 3
         do i = 1, 3
            !$omp simd
            do p = 1, lanes
               product(p, i, j) = a(p, 1, i)*b(p, 1, j) + a(p, 2, i)*b(p, 2, j) + a(p, 3, i)*b(p, 3, j)
            end do
         end do
      end do
   end subroutine multiply_transposed

   !> R A R^T of symmetric tensors.
   pure subroutine rotate(r, a)
      real(wp), intent(in) :: r(lanes, 3, 3)
      real(wp), intent(inout) :: a(lanes, 3, 3)
      real(wp) :: half(lanes, 3, 3)
      integer :: i, j, p
      call multiply(r, a, half)
      do j = 1, 3
         do i = 1, j
            !$omp simd
            do p = 1, lanes
               a(p, i, j) = half(p, i, 1)*r(p, j, 1) + half(p, i, 2)*r(p, j, 2) + half(p, i, 3)*r(p, j, 3)
               a(p, j, i) = a(p, i, j)
            end do
         end do
      end do
   end subroutine rotate

   !> Cofactors: divided by the determinant they are the transpose of the inverse.
   pure subroutine find_cofactors(a, c)
      real(wp), intent(in) :: a(lanes, 3, 3)
      real(wp), intent(out) :: c(lanes, 3, 3)
      integer :: p
      !$omp simd
      do p = 1, lanes
         c(p, 1, 1) = a(p, 2, 2)*a(p, 3, 3) - a(p, 2, 3)*a(p, 3, 2)
         c(p, 1, 2) = a(p, 2, 3)*a(p, 3, 1) - a(p, 2, 1)*a(p, 3, 3)
         c(p, 1, 3) = a(p, 2, 1)*a(p, 3, 2) - a(p, 2, 2)*a(p, 3, 1)
         c(p, 2, 1) = a(p, 3, 2)*a(p, 1, 3) - a(p, 3, 3)*a(p, 1, 2)
         c(p, 2, 2) = a(p, 3, 3)*a(p, 1, 1) - a(p, 3, 1)*a(p, 1, 3)
         c(p, 2, 3) = a(p, 3, 1)*a(p, 1, 2) - a(p, 3, 2)*a(p, 1, 1)
         c(p, 3, 1) = a(p, 1, 2)*a(p, 2, 3) - a(p, 1, 3)*a(p, 2, 2)
         c(p, 3, 2) = a(p, 1, 3)*a(p, 2, 1) - a(p, 1, 1)*a(p, 2, 3)
         c(p, 3, 3) = a(p, 1, 1)*a(p, 2, 2) - a(p, 1, 2)*a(p, 2, 1)
      end do
   end subroutine find_cofactors

   !> Determinant from a matrix and its cofactors.
   pure subroutine find_determinant(a, cofactors, determinant)
      real(wp), intent(in) :: a(lanes, 3, 3), cofactors(lanes, 3, 3)
      real(wp), intent(out) :: determinant(lanes)
      integer :: p
      !$omp simd
      do p = 1, lanes
         determinant(p) = a(p, 1, 1)*cofactors(p, 1, 1) + a(p, 1, 2)*cofactors(p, 1, 2) &
                          + a(p, 1, 3)*cofactors(p, 1, 3)
      end do
   end subroutine find_determinant

   !> Inverses of symmetric tensors, and their determinants.
   pure subroutine invert(a, inverse, determinant)
      real(wp), intent(in) :: a(lanes, 3, 3)
      real(wp), intent(out) :: inverse(lanes, 3, 3), determinant(lanes)
      integer :: i, j, p
      call find_cofactors(a, inverse)
      call find_determinant(a, inverse, determinant)
      do j = 1, 3
         do i = 1, 3
            !$omp simd
            do p = 1, lanes
               inverse(p, i, j) = inverse(p, i, j)/determinant(p)
            end do
         end do
      end do
   end subroutine invert

   !> F = R U, as in m_polar; converged lanes are not changed, so that none depends on the others. F = I gives
   !> R = U = I to the bit.
   pure subroutine decompose(f, r, u)
      real(wp), intent(in) :: f(lanes, 3, 3) !< determinants above 0
      real(wp), intent(out) :: r(lanes, 3, 3), u(lanes, 3, 3)
      real(wp) :: c(lanes, 3, 3), next(lanes, 3, 3), determinant(lanes), change(lanes), before(lanes)
      integer :: i, j, n, p
      r = f
      before = huge(1.0_wp)
      do n = 1, iteration_limit
         call find_cofactors(r, c)
         call find_determinant(r, c, determinant)
         change = 0.0_wp
         do j = 1, 3
            do i = 1, 3
               !$omp simd
               do p = 1, lanes
                  next(p, i, j) = 0.5_wp*(r(p, i, j) + c(p, i, j)/determinant(p))
                  change(p) = max(change(p), abs(next(p, i, j) - r(p, i, j)))
                  r(p, i, j) = merge(next(p, i, j), r(p, i, j), before(p) > settled)
               end do
            end do
         end do
         before = merge(change, 0.0_wp, before > settled)
         if (.not. any(before > settled)) exit
      end do
      call multiply_transposed(r, f, next)
      do j = 1, 3
         do i = 1, 3
            !$omp simd
            do p = 1, lanes
               u(p, i, j) = 0.5_wp*(next(p, i, j) + next(p, j, i))
            end do
         end do
      end do
   end subroutine decompose

   !> Matrices of unit quaternions: their columns are the rotated axes.
   pure subroutine set_matrices(q, r)
      real(wp), intent(in) :: q(lanes, 4)
      real(wp), intent(out) :: r(lanes, 3, 3)
      real(wp) :: w, x, y, z
      integer :: p
      !$omp simd private(w, x, y, z)
      do p = 1, lanes
         w = q(p, 1)
         x = q(p, 2)
         y = q(p, 3)
         z = q(p, 4)
         r(p, 1, 1) = 1.0_wp - 2.0_wp*(y**2 + z**2)
         r(p, 2, 1) = 2.0_wp*(x*y + w*z)
         r(p, 3, 1) = 2.0_wp*(x*z - w*y)
         r(p, 1, 2) = 2.0_wp*(x*y - w*z)
         r(p, 2, 2) = 1.0_wp - 2.0_wp*(x**2 + z**2)
         r(p, 3, 2) = 2.0_wp*(y*z + w*x)
         r(p, 1, 3) = 2.0_wp*(x*z + w*y)
         r(p, 2, 3) = 2.0_wp*(y*z - w*x)
         r(p, 3, 3) = 1.0_wp - 2.0_wp*(x**2 + y**2)
      end do
   end subroutine set_matrices

   !> Unit quaternions of rotations by less than 90 degrees, for which w stays well away from 0.
   pure subroutine set_quaternions(r, q)
      real(wp), intent(in) :: r(lanes, 3, 3)
      real(wp), intent(out) :: q(lanes, 4)
      integer :: p
      !$omp simd
      do p = 1, lanes
         q(p, 1) = 1.0_wp + r(p, 1, 1) + r(p, 2, 2) + r(p, 3, 3)
         q(p, 2) = r(p, 3, 2) - r(p, 2, 3)
         q(p, 3) = r(p, 1, 3) - r(p, 3, 1)
         q(p, 4) = r(p, 2, 1) - r(p, 1, 2)
      end do
      call normalise(q)
   end subroutine set_quaternions

   !> The rotation `first` followed by `second`; normalised.
   pure subroutine follow(first, second, q)
      real(wp), intent(in) :: first(lanes, 4), second(lanes, 4)
      real(wp), intent(out) :: q(lanes, 4)
      integer :: p
      associate (a => first, b => second)
         !$omp simd
         do p = 1, lanes
            q(p, 1) = b(p, 1)*a(p, 1) - (b(p, 2)*a(p, 2) + b(p, 3)*a(p, 3) + b(p, 4)*a(p, 4))
            q(p, 2) = b(p, 1)*a(p, 2) + a(p, 1)*b(p, 2) + (b(p, 3)*a(p, 4) - b(p, 4)*a(p, 3))
            q(p, 3) = b(p, 1)*a(p, 3) + a(p, 1)*b(p, 3) + (b(p, 4)*a(p, 2) - b(p, 2)*a(p, 4))
            q(p, 4) = b(p, 1)*a(p, 4) + a(p, 1)*b(p, 4) + (b(p, 2)*a(p, 3) - b(p, 3)*a(p, 2))
         end do
      end associate
      call normalise(q)
   end subroutine follow

   pure subroutine normalise(q)
      real(wp), intent(inout) :: q(lanes, 4)
      real(wp) :: length
      integer :: p
      !$omp simd private(length)
      do p = 1, lanes
         length = sqrt(q(p, 1)**2 + q(p, 2)**2 + q(p, 3)**2 + q(p, 4)**2)
         q(p, 1) = q(p, 1)/length
         q(p, 2) = q(p, 2)/length
         q(p, 3) = q(p, 3)/length
         q(p, 4) = q(p, 4)/length
      end do
   end subroutine normalise

end module m_lane_tensors
