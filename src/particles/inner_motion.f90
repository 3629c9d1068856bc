!> The motion within particles given by their velocity gradients (theory.md, eq. inner-motion): with affine
!> transfer a particle moves as v + L (x - x_p) over its domain, and this motion contributes to kinetic energy
!> and angular momentum as m v does.
module m_inner_motion
   use m_kinds, only: wp
   use m_field_table, only: layout_t
   implicit none
   private
   public :: inner_motion

contains

   !> Kinetic energy (J) and angular momentum (kg m2/s) of particles about their own centres; 0 where they
   !> carry no gradients.
   pure subroutine inner_motion(column, first, last, layout, kinetic, angular)
      real(wp), intent(in), contiguous :: column(:, :)
      integer, intent(in) :: first, last !< of the particles
      type(layout_t), intent(in) :: layout
      real(wp), intent(out) :: kinetic, angular(3)
      kinetic = 0.0_wp
      angular = 0.0_wp
      if (layout%gradient == 0) return
      if (layout%section%is_flat()) then
         call of_section(column, first, last, layout, kinetic, angular)
         return
      end if
      if (layout%domain > 0) then
         call of_edges(column, first, last, layout%mass, layout%gradient - 1, layout%domain - 1, kinetic, &
                       angular)
      else
         call of_boxes(column, first, last, layout%mass, layout%gradient - 1, &
                       layout%half_size + merge([0, 1, 2], 0, layout%half_sizes), kinetic, angular)
      end if
   end subroutine inner_motion

   !> Of a section: the in-plane parts. Nothing turns or stretches across it, and around the full ring no
   !> angular momentum remains.
   pure subroutine of_section(column, first, last, layout, kinetic, angular)
      real(wp), intent(in), contiguous :: column(:, :)
      integer, intent(in) :: first, last !< of the particles
      type(layout_t), intent(in) :: layout
      real(wp), intent(inout) :: kinetic, angular(3)
      real(wp) :: nothing(last - first + 1)
      nothing = 0.0_wp
      associate (m => column(first:last, layout%mass), d => layout%domain, h => layout%half_size, &
                 l => column(first:last, layout%gradient:layout%gradient + 8))
         if (d > 0) then
            call of_edge(last - first + 1, m, l, column(first:last, d), column(first:last, d + 2), kinetic, &
                         angular(2))
            call of_edge(last - first + 1, m, l, column(first:last, d + 6), column(first:last, d + 8), &
                         kinetic, angular(2))
         else
            call of_edge(last - first + 1, m, l, column(first:last, h), nothing, kinetic, angular(2))
            call of_edge(last - first + 1, m, l, nothing, &
                         column(first:last, h + merge(2, 0, layout%half_sizes)), kinetic, angular(2))
         end if
      end associate
      if (layout%section%is_round()) angular = 0.0_wp
   end subroutine of_section

   !> A half edge x, z (m) in the plane of a section, which turns and stretches as L r.
   pure subroutine of_edge(count, m, l, x, z, kinetic, about_y)
      integer, intent(in) :: count
      real(wp), intent(in) :: m(:), l(:, :), x(:), z(:)
      real(wp), intent(inout) :: kinetic, about_y
      real(wp) :: twice, turning, u, w
      integer :: p
      twice = 0.0_wp; turning = 0.0_wp
      !$omp simd reduction(+: twice, turning) private(u, w)
      do p = 1, count
         u = l(p, 1)*x(p) + l(p, 7)*z(p)
         w = l(p, 3)*x(p) + l(p, 9)*z(p)
         twice = twice + m(p)*(u**2 + w**2)
         turning = turning + m(p)*(z(p)*u - x(p)*w)
      end do
      kinetic = kinetic + twice/6.0_wp
      about_y = about_y + turning/3.0_wp
   end subroutine of_edge

   !> Boxes along the axes. Arguments: column of the mass, column before the gradient, columns of the half
   !> sizes.
   pure subroutine of_boxes(column, first, last, m, l, h, kinetic, angular)
      real(wp), intent(in), contiguous :: column(:, :)
      integer, intent(in) :: first, last, m, l, h(3)
      real(wp), intent(out) :: kinetic, angular(3)
      real(wp) :: twice, about_x, about_y, about_z, w1, w2, w3
      integer :: p
      twice = 0.0_wp; about_x = 0.0_wp; about_y = 0.0_wp; about_z = 0.0_wp
      !$omp simd reduction(+: twice, about_x, about_y, about_z) private(w1, w2, w3)
      do p = first, last
         w1 = column(p, m)*column(p, h(1))**2
         w2 = column(p, m)*column(p, h(2))**2
         w3 = column(p, m)*column(p, h(3))**2
         twice = twice + w1*(column(p, l + 1)**2 + column(p, l + 2)**2 + column(p, l + 3)**2) &
                 + w2*(column(p, l + 4)**2 + column(p, l + 5)**2 + column(p, l + 6)**2) &
                 + w3*(column(p, l + 7)**2 + column(p, l + 8)**2 + column(p, l + 9)**2)
         about_x = about_x + w2*column(p, l + 6) - w3*column(p, l + 8)
         about_y = about_y + w3*column(p, l + 7) - w1*column(p, l + 3)
         about_z = about_z + w1*column(p, l + 2) - w2*column(p, l + 4)
      end do
      kinetic = twice/6.0_wp
      angular = [about_x, about_y, about_z]/3.0_wp
   end subroutine of_boxes

   !> Parallelepipeds: each edge r turns and stretches as L r. Arguments: column of the mass, column before
   !> the gradient, column before the half edges, which are stored one after the other.
   pure subroutine of_edges(column, first, last, m, l, r, kinetic, angular)
      real(wp), intent(in), contiguous :: column(:, :)
      integer, intent(in) :: first, last, m, l, r
      real(wp), intent(out) :: kinetic, angular(3)
      real(wp) :: twice, about_x, about_y, about_z, squares, turn_x, turn_y, turn_z, u1, u2, u3
      integer :: k, p
      twice = 0.0_wp; about_x = 0.0_wp; about_y = 0.0_wp; about_z = 0.0_wp
      !$omp simd reduction(+: twice, about_x, about_y, about_z) &
      !$omp& private(squares, turn_x, turn_y, turn_z, k, u1, u2, u3)
      do p = first, last
         squares = 0.0_wp; turn_x = 0.0_wp; turn_y = 0.0_wp; turn_z = 0.0_wp
         do k = r, r + 6, 3
            u1 = column(p, l + 1)*column(p, k + 1) + column(p, l + 4)*column(p, k + 2) &
                 + column(p, l + 7)*column(p, k + 3)
            u2 = column(p, l + 2)*column(p, k + 1) + column(p, l + 5)*column(p, k + 2) &
                 + column(p, l + 8)*column(p, k + 3)
            u3 = column(p, l + 3)*column(p, k + 1) + column(p, l + 6)*column(p, k + 2) &
                 + column(p, l + 9)*column(p, k + 3)
            squares = squares + u1**2 + u2**2 + u3**2
            turn_x = turn_x + column(p, k + 2)*u3 - column(p, k + 3)*u2
            turn_y = turn_y + column(p, k + 3)*u1 - column(p, k + 1)*u3
            turn_z = turn_z + column(p, k + 1)*u2 - column(p, k + 2)*u1
         end do
         twice = twice + column(p, m)*squares
         about_x = about_x + column(p, m)*turn_x
         about_y = about_y + column(p, m)*turn_y
         about_z = about_z + column(p, m)*turn_z
      end do
      kinetic = twice/6.0_wp
      angular = [about_x, about_y, about_z]/3.0_wp
   end subroutine of_edges

end module m_inner_motion
