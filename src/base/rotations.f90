!> Rotations as unit quaternions and as matrices.
module m_rotations
   use m_kinds, only: wp
   use m_vectors, only: cross
   implicit none
   private
   public :: no_rotation, turn_by, followed_by, matrix_of

   real(wp), parameter :: no_rotation(4) = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]

contains

   !> The turn by an angle (rad) about a unit vector.
   pure function turn_by(axis, angle) result(q)
      real(wp), intent(in) :: axis(3), angle
      real(wp) :: q(4) !< cosine and vector
      q = [cos(0.5_wp*angle), sin(0.5_wp*angle)*axis]
   end function turn_by

   !> One rotation and then another one; of length 1 again.
   pure function followed_by(first, second) result(q)
      real(wp), intent(in) :: first(4), second(4)
      real(wp) :: q(4)
      q = [second(1)*first(1) - dot_product(second(2:), first(2:)), &
           second(1)*first(2:) + first(1)*second(2:) + cross(second(2:), first(2:))]
      q = q/norm2(q)
   end function followed_by

   !> Its columns are where the axes go.
   pure function matrix_of(q) result(r)
      real(wp), intent(in) :: q(4)
      real(wp) :: r(3, 3)
      associate (w => q(1), x => q(2), y => q(3), z => q(4))
         r(:, 1) = [1.0_wp - 2.0_wp*(y**2 + z**2), 2.0_wp*(x*y + w*z), 2.0_wp*(x*z - w*y)]
         r(:, 2) = [2.0_wp*(x*y - w*z), 1.0_wp - 2.0_wp*(x**2 + z**2), 2.0_wp*(y*z + w*x)]
         r(:, 3) = [2.0_wp*(x*z + w*y), 2.0_wp*(y*z - w*x), 1.0_wp - 2.0_wp*(x**2 + y**2)]
      end associate
   end function matrix_of

end module m_rotations
