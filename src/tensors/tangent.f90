!> A matrix of elastic moduli, of any symmetry: the fastest plane wave, and the strain energy of a stress.
module m_tangent
   use m_kinds, only: wp
   implicit none
   private
   public :: tangent_t

   !> Rows and columns are xx yy zz yz xz xy; shear strains are engineering strains.
   type :: tangent_t
      real(wp) :: stiffness(6, 6) = 0.0_wp  !< Pa
      real(wp) :: compliance(6, 6) = 0.0_wp !< its inverse, 1/Pa, by `invert`
   contains
      procedure :: invert
      procedure :: wave_modulus
   end type tangent_t

   integer, parameter :: places(3, 3) = reshape([1, 6, 5, 6, 2, 4, 5, 4, 3], [3, 3])
   integer, parameter :: turns = 200 !< limit of search iterations: from the nearest of the starts a few dozen
                                     !< suffice

contains

   !> The compliance of the symmetric part by Cholesky factorisation; false if it is not positive definite.
   logical function invert(self) result(good)
      class(tangent_t), intent(inout) :: self
      real(wp) :: l(6, 6), x(6)
      integer :: i, j
      self%stiffness = 0.5_wp*(self%stiffness + transpose(self%stiffness))
      l = 0.0_wp
      good = .false.
      do j = 1, 6
         l(j, j) = self%stiffness(j, j) - sum(l(j, :j - 1)**2)
         if (.not. l(j, j) > 1.0e-12_wp*self%stiffness(j, j)) return
         l(j, j) = sqrt(l(j, j))
         do i = j + 1, 6
            l(i, j) = (self%stiffness(i, j) - dot_product(l(i, :j - 1), l(j, :j - 1)))/l(j, j)
         end do
      end do
      do j = 1, 6
         x = 0.0_wp
         x(j) = 1.0_wp
         do i = 1, 6
            x(i) = (x(i) - dot_product(l(i, :i - 1), x(:i - 1)))/l(i, i)
         end do
         do i = 6, 1, -1
            x(i) = (x(i) - dot_product(l(i + 1:, i), x(i + 1:)))/l(i, i)
         end do
         self%compliance(:, j) = x
      end do
      good = .true.
   end function invert

   !> Largest m.A(n).m over all directions n of propagation and m of motion, A_ik = C_ijkl n_j n_l, Pa. The
   !> two are maximised alternately, which never decreases the value, starting from the axes, the face
   !> diagonals and the space diagonals.
   pure real(wp) function wave_modulus(self)
      class(tangent_t), intent(in) :: self
      real(wp) :: n(3), m(3)
      integer :: i, j, k, turn
      wave_modulus = 0.0_wp
      do k = -1, 1
         do j = -1, 1
            do i = -1, 1
               if (all([i, j, k] == 0)) cycle
               n = [1.0_wp, 0.9_wp, 0.8_wp]*[i, j, k] ! off the axes of symmetry, where the search may stall
               n = n/norm2(n)
               m = n
               do turn = 1, turns
                  m = matmul(acoustic(self%stiffness, n), m)
                  if (.not. norm2(m) > 0.0_wp) exit
                  m = m/norm2(m)
                  n = matmul(acoustic(self%stiffness, m), n)
                  if (.not. norm2(n) > 0.0_wp) exit
                  n = n/norm2(n)
               end do
               wave_modulus = max(wave_modulus, dot_product(m, matmul(acoustic(self%stiffness, n), m)))
            end do
         end do
      end do
   end function wave_modulus

   !> A_ik = C_ijkl n_j n_l.
   pure function acoustic(c, n) result(a)
      real(wp), intent(in) :: c(6, 6), n(3)
      real(wp) :: a(3, 3)
      integer :: i, j, k, l
      a = 0.0_wp
      do l = 1, 3
         do k = 1, 3
            do j = 1, 3
               do i = 1, 3
                  a(i, k) = a(i, k) + c(places(i, j), places(k, l))*n(j)*n(l)
               end do
            end do
         end do
      end do
   end function acoustic

end module m_tangent
