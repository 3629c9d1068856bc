!> Volume change of particles, and the bounds needed for the next time step and the guards.
module m_deform
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use m_kinds, only: wp
   use m_field_table, only: layout_t
   implicit none
   private
   public :: advance_volume, advance_domain, advance_half_edges, fastest, all_finite, finite_stress

contains

   !> V <- V det(I + dt L) for the first `count` particles; `smallest` is the smallest of the new volumes, m3:
   !> not above 0 if an element was inverted.
   pure subroutine advance_volume(count, gradient, time_step, volume, smallest)
      integer, intent(in) :: count
      real(wp), intent(in), contiguous :: gradient(:, :) !< (:, 9), d v_i / d x_j at 3 (j-1) + i, 1/s
      real(wp), intent(in) :: time_step                  !< s
      real(wp), intent(inout), contiguous :: volume(:)   !< m3
      real(wp), intent(out) :: smallest
      real(wp) :: f11, f22, f33, f12, f21, f13, f31, f23, f32, jacobian
      integer :: p
      smallest = huge(smallest)
      !$omp simd reduction(min: smallest) private(f11, f22, f33, f12, f21, f13, f31, f23, f32, jacobian)
      do p = 1, count
         f11 = 1.0_wp + time_step*gradient(p, 1)
         f21 = time_step*gradient(p, 2)
         f31 = time_step*gradient(p, 3)
         f12 = time_step*gradient(p, 4)
         f22 = 1.0_wp + time_step*gradient(p, 5)
         f32 = time_step*gradient(p, 6)
         f13 = time_step*gradient(p, 7)
         f23 = time_step*gradient(p, 8)
         f33 = 1.0_wp + time_step*gradient(p, 9)
         jacobian = f11*(f22*f33 - f23*f32) - f12*(f21*f33 - f23*f31) + f13*(f21*f32 - f22*f31)
         volume(p) = volume(p)*jacobian
         smallest = min(smallest, volume(p))
      end do
   end subroutine advance_volume

   !> The domains of the first `count` particles follow their velocity gradients; `smallest` is not above 0 if
   !> a domain has a non-positive size.
   pure subroutine advance_domain(count, gradient, time_step, layout, column, smallest)
      integer, intent(in) :: count
      real(wp), intent(in), contiguous :: gradient(:, :)   !< (:, 9), as above, 1/s
      real(wp), intent(in) :: time_step                    !< s
      type(layout_t), intent(in) :: layout
      real(wp), intent(inout), contiguous :: column(:, :)
      real(wp), intent(out) :: smallest
      smallest = huge(smallest)
      if (layout%domain > 0) then
         call advance_half_edges(count, gradient, time_step, layout%section%is_flat(), &
                                 column(:, layout%domain:layout%domain + 8))
      else
         call advance_half_sizes(count, gradient, time_step, layout%section%is_flat(), &
                                 column(:, layout%half_size:layout%half_size + 2), smallest)
      end if
   end subroutine advance_domain

   !> r_i <- r_i (1 + dt L_ii) for the half sizes along the axes (theory.md, eq. stretch); `smallest` is the
   !> smallest of the factors.
   pure subroutine advance_half_sizes(count, gradient, time_step, flat, half_size, smallest)
      integer, intent(in) :: count
      real(wp), intent(in), contiguous :: gradient(:, :)     !< (:, 9), as above, 1/s
      real(wp), intent(in) :: time_step                      !< s
      logical, intent(in) :: flat                            !< of a section: y does not change
      real(wp), intent(inout), contiguous :: half_size(:, :) !< (:, 3), m
      real(wp), intent(out) :: smallest
      integer :: axis, p
      smallest = huge(smallest)
      do axis = 1, 3, merge(2, 1, flat)
         !$omp simd reduction(min: smallest)
         do p = 1, count
            half_size(p, axis) = half_size(p, axis)*(1.0_wp + time_step*gradient(p, 4*axis - 3))
            smallest = min(smallest, 1.0_wp + time_step*gradient(p, 4*axis - 3))
         end do
      end do
   end subroutine advance_half_sizes

   !> r_k <- (I + dt L) r_k for the three half edges of each domain (theory.md, eq. corners).
   pure subroutine advance_half_edges(count, gradient, time_step, flat, half_edge)
      integer, intent(in) :: count
      real(wp), intent(in), contiguous :: gradient(:, :)     !< (:, 9), as above, 1/s
      real(wp), intent(in) :: time_step                      !< s
      logical, intent(in) :: flat                            !< of a section: the edge along y does not change
      real(wp), intent(inout), contiguous :: half_edge(:, :) !< (:, 9), component i of edge k at 3 (k-1) + i,
                                                             !< m
      real(wp) :: x, y, z
      integer :: first, p
      do first = 1, 7, merge(6, 3, flat)
         !$omp simd private(x, y, z)
         do p = 1, count
            x = time_step*half_edge(p, first)
            y = time_step*half_edge(p, first + 1)
            z = time_step*half_edge(p, first + 2)
            half_edge(p, first) = half_edge(p, first) + gradient(p, 1)*x + gradient(p, 4)*y + gradient(p, 7)*z
            half_edge(p, first + 1) = half_edge(p, first + 1) + gradient(p, 2)*x + gradient(p, 5)*y &
                                      + gradient(p, 8)*z
            half_edge(p, first + 2) = half_edge(p, first + 2) + gradient(p, 3)*x + gradient(p, 6)*y &
                                      + gradient(p, 9)*z
         end do
      end do
   end subroutine advance_half_edges

   !> True when no value of the first `count` rows is infinite or NaN: x - x is 0 for all others. The sum is
   !> looked at by ieee_is_finite: an ordered comparison with NaN would trap in the debug build.
   pure logical function all_finite(count, values)
      integer, intent(in) :: count
      real(wp), intent(in), contiguous :: values(:, :)
      real(wp) :: nothing
      integer :: c, p
      nothing = 0.0_wp
      do c = 1, size(values, 2)
         !$omp simd reduction(+: nothing)
         do p = 1, count
            nothing = nothing + (values(p, c) - values(p, c))
         end do
      end do
      all_finite = ieee_is_finite(nothing)
   end function all_finite

   !> The same for six columns at once, at a third of the cost; an infinite sum of finite values counts too.
   pure logical function finite_stress(count, stress)
      integer, intent(in) :: count
      real(wp), intent(in), contiguous :: stress(:, :) !< (:, 6), Pa
      real(wp) :: nothing, together
      integer :: p
      nothing = 0.0_wp
      !$omp simd reduction(+: nothing) private(together)
      do p = 1, count
         together = (stress(p, 1) + stress(p, 2)) + (stress(p, 3) + stress(p, 4)) &
                    + (stress(p, 5) + stress(p, 6))
         nothing = nothing + (together - together)
      end do
      finite_stress = ieee_is_finite(nothing)
   end function finite_stress

   !> Largest squared speed (m2/s2) and largest specific volume (m3/kg) of particles first..last.
   pure subroutine fastest(velocity, mass, volume, first, last, speed_squared, specific_volume)
      real(wp), intent(in), contiguous :: velocity(:, :) !< (:, 3), m/s
      real(wp), intent(in), contiguous :: mass(:), volume(:)
      integer, intent(in) :: first, last
      real(wp), intent(out) :: speed_squared, specific_volume
      integer :: p
      speed_squared = 0.0_wp
      specific_volume = 0.0_wp
      !$omp simd reduction(max: speed_squared, specific_volume)
      do p = first, last
         speed_squared = max(speed_squared, velocity(p, 1)**2 + velocity(p, 2)**2 + velocity(p, 3)**2)
         specific_volume = max(specific_volume, volume(p)/mass(p))
      end do
   end subroutine fastest

end module m_deform
