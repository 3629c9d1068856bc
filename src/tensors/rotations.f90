!> Rotations as unit quaternions and as matrices.
module m_rotations
   use m_kinds, only: wp
   use m_vectors, only: cross
   implicit none
   private
   public :: no_rotation, turn_by, followed_by, matrix_of, quaternion_of, from_euler, angle_between

   real(wp), parameter :: no_rotation(4) = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]

contains

   !> The rotation by an angle (rad) about a unit vector.
   pure function turn_by(axis, angle) result(q)
      real(wp), intent(in) :: axis(3), angle
      real(wp) :: q(4) !< cosine and vector
      q = [cos(0.5_wp*angle), sin(0.5_wp*angle)*axis]
   end function turn_by

   !> The rotation `first` followed by `second`; normalised.
   pure function followed_by(first, second) result(q)
      real(wp), intent(in) :: first(4), second(4)
      real(wp) :: q(4)
      q = [second(1)*first(1) - dot_product(second(2:), first(2:)), &
           second(1)*first(2:) + first(1)*second(2:) + cross(second(2:), first(2:))]
      q = q/norm2(q)
   end function followed_by

   !> The rotation matrix: its columns are the rotated axes.
   pure function matrix_of(q) result(r)
      real(wp), intent(in) :: q(4)
      real(wp) :: r(3, 3)
      associate (w => q(1), x => q(2), y => q(3), z => q(4))
         r(:, 1) = [1.0_wp - 2.0_wp*(y**2 + z**2), 2.0_wp*(x*y + w*z), 2.0_wp*(x*z - w*y)]
         r(:, 2) = [2.0_wp*(x*y - w*z), 1.0_wp - 2.0_wp*(x**2 + z**2), 2.0_wp*(y*z + w*x)]
         r(:, 3) = [2.0_wp*(x*z + w*y), 2.0_wp*(y*z - w*x), 1.0_wp - 2.0_wp*(x**2 + y**2)]
      end associate
   end function matrix_of

   !> The quaternion of a rotation matrix, with w not below 0 where the angle is below 120 degrees (Shepperd
   !> 1978: from the largest of the four components).
   pure function quaternion_of(r) result(q)
      real(wp), intent(in) :: r(3, 3)
      real(wp) :: q(4), trace
      integer :: i, j, k
      trace = r(1, 1) + r(2, 2) + r(3, 3)
      if (trace > 0.0_wp) then
         q(1) = 1.0_wp + trace
         q(2:4) = [r(3, 2) - r(2, 3), r(1, 3) - r(3, 1), r(2, 1) - r(1, 2)]
      else
         i = maxloc([r(1, 1), r(2, 2), r(3, 3)], dim=1)
         j = 1 + mod(i, 3)
         k = 1 + mod(j, 3)
         q(1) = r(k, j) - r(j, k)
         q(1 + i) = 1.0_wp + r(i, i) - r(j, j) - r(k, k)
         q(1 + j) = r(j, i) + r(i, j)
         q(1 + k) = r(k, i) + r(i, k)
      end if
      q = q/norm2(q)
   end function quaternion_of

   !> The quaternion of Bunge's Euler angles (phi1, Phi, phi2; radians): it rotates the crystal's axes,
   !> initially along the sample's, about z, then the rotated x, then the rotated z. Its matrix transforms
   !> components along the crystal's axes to components along the sample's: the transpose of Bunge's g.
   pure function from_euler(angles) result(q)
      real(wp), intent(in) :: angles(3)
      real(wp) :: q(4)
      real(wp), parameter :: x(3) = [1.0_wp, 0.0_wp, 0.0_wp], z(3) = [0.0_wp, 0.0_wp, 1.0_wp]
      q = followed_by(followed_by(turn_by(z, angles(3)), turn_by(x, angles(2))), turn_by(z, angles(1)))
   end function from_euler

   !> The angle of the rotation between two orientations, radians, 0 to pi.
   pure real(wp) function angle_between(a, b) result(angle)
      real(wp), intent(in) :: a(4), b(4)
      real(wp) :: q(4)
      q = followed_by([b(1), -b(2:)], a)
      angle = 2.0_wp*atan2(norm2(q(2:4)), abs(q(1)))
   end function angle_between

end module m_rotations
