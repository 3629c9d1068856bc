!> Faces that particles carry: an outward area vector and the arm from the particle's centre to the face's
!> middle follow the deformation (theory.md, eq. carried-face).
module m_carried_face
   use m_kinds, only: wp
   use m_vectors, only: cross
   implicit none
   private
   public :: carry_faces, carried_area, area_before, list_faces

   integer, parameter :: together = 32 !< particles that are looked at in one pass

contains

   !> With F = I + dt L the arm becomes F arm and the area J F^-T area (Nanson). Particles without the face
   !> have zero area and are not changed.
   pure subroutine carry_faces(column, count, area, arm, gradient, time_step)
      real(wp), intent(inout), contiguous :: column(:, :)
      integer, intent(in) :: count     !< particles
      integer, intent(in) :: area, arm !< first of three columns each, m2 and m
      real(wp), intent(in), contiguous :: gradient(:, :) !< (:, 9), 1/s: L
      real(wp), intent(in) :: time_step !< s
      real(wp) :: f(3, 3)
      integer :: faces, n, p, of(count)
      call list_faces(column, count, area, of, faces)
      do n = 1, faces
         p = of(n)
         f = deformation(time_step*gradient(p, :))
         column(p, area:area + 2) = matmul(cofactor(f), column(p, area:area + 2))
         column(p, arm:arm + 2) = matmul(f, column(p, arm:arm + 2))
      end do
   end subroutine carry_faces

   !> The area of a face after displacements with a gradient A: J F^-T area with F = I + A.
   pure function carried_area(area, gradient) result(carried)
      real(wp), intent(in) :: area(3)     !< m2
      real(wp), intent(in) :: gradient(9) !< component ij at 3 (j-1) + i
      real(wp) :: carried(3)
      carried = matmul(cofactor(deformation(gradient)), area)
   end function carried_area

   !> The area that becomes the given one by displacements with a gradient A: F^T area / J.
   pure function area_before(area, gradient) result(before)
      real(wp), intent(in) :: area(3)     !< m2
      real(wp), intent(in) :: gradient(9) !< component ij at 3 (j-1) + i
      real(wp) :: before(3), f(3, 3)
      f = deformation(gradient)
      before = matmul(area, f)/dot_product(f(:, 1), cross(f(:, 2), f(:, 3)))
   end function area_before

   !> F = I + A.
   pure function deformation(gradient) result(f)
      real(wp), intent(in) :: gradient(9)
      real(wp) :: f(3, 3)
      integer :: i
      f = reshape(gradient, [3, 3])
      do i = 1, 3
         f(i, i) = 1.0_wp + f(i, i)
      end do
   end function deformation

   !> J F^-T.
   pure function cofactor(f) result(c)
      real(wp), intent(in) :: f(3, 3)
      real(wp) :: c(3, 3)
      c(:, 1) = cross(f(:, 2), f(:, 3))
      c(:, 2) = cross(f(:, 3), f(:, 1))
      c(:, 3) = cross(f(:, 1), f(:, 2))
   end function cofactor

   !> The particles that have the face. Most are inside a body and have none, so many are passed at once.
   pure subroutine list_faces(column, count, area, of, faces)
      real(wp), intent(in), contiguous :: column(:, :)
      integer, intent(in) :: count, area !< particles; first of three columns
      integer, intent(out) :: of(count)  !< particles, rising; the first `faces` are set
      integer, intent(out) :: faces
      call list_areas(size(column, 1), count, column(:, area:area + 2), of, faces)
   end subroutine list_faces

   !> The same of the columns alone.
   pure subroutine list_areas(rows, count, area, of, faces)
      integer, intent(in) :: rows, count
      real(wp), intent(in) :: area(rows, 3)
      integer, intent(out) :: of(count), faces
      real(wp) :: extent(together), total
      integer :: first, i, n
      faces = 0
      do first = 0, count - 1, together
         n = min(together, count - first)
         total = 0.0_wp
         !$omp simd reduction(+:total)
         do i = 1, n
            extent(i) = abs(area(first + i, 1)) + abs(area(first + i, 2)) + abs(area(first + i, 3))
            total = total + extent(i)
         end do
         if (total <= 0.0_wp) cycle ! false for NaN
         do i = 1, n
            if (.not. extent(i) > 0.0_wp) cycle
            faces = faces + 1
            of(faces) = first + i
         end do
      end do
   end subroutine list_areas

end module m_carried_face
