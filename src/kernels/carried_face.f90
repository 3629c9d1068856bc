!> Faces that particles carry: an outward area vector and the arm from the particle's centre to the face's
!> middle follow the deformation (theory.md, eq. carried-face).
module m_carried_face
   use m_kinds, only: wp
   use m_vectors, only: cross
   implicit none
   private
   public :: carry_faces

contains

   !> With F = I + dt L the arm becomes F arm and the area J F^-T area (Nanson). Particles without the face
   !> have zero area and are not changed.
   pure subroutine carry_faces(column, count, area, arm, gradient, time_step)
      real(wp), intent(inout), contiguous :: column(:, :)
      integer, intent(in) :: count     !< particles
      integer, intent(in) :: area, arm !< first of three columns each, m2 and m
      real(wp), intent(in), contiguous :: gradient(:, :) !< (:, 9), 1/s: L
      real(wp), intent(in) :: time_step !< s
      real(wp) :: f(3, 3), cofactor(3, 3)
      integer :: i, p
      do p = 1, count
         if (.not. any(abs(column(p, area:area + 2)) > 0.0_wp)) cycle
         f = time_step*reshape(gradient(p, :), [3, 3])
         do i = 1, 3
            f(i, i) = 1.0_wp + f(i, i)
         end do
         cofactor(:, 1) = cross(f(:, 2), f(:, 3))
         cofactor(:, 2) = cross(f(:, 3), f(:, 1))
         cofactor(:, 3) = cross(f(:, 1), f(:, 2))
         column(p, area:area + 2) = matmul(cofactor, column(p, area:area + 2))
         column(p, arm:arm + 2) = matmul(f, column(p, arm:arm + 2))
      end do
   end subroutine carry_faces

end module m_carried_face
