!> Conversion of crystal orientations from several conventions to Bunge's Euler angles. All but those named
!> inverse describe the rotation of the sample's axes to the crystal's (theory.md, Crystals).
module m_orientations
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use m_kinds, only: wp
   use m_constants, only: pi
   use m_rotations, only: quaternion_of, turn_by
   use m_text, only: to_text
   use m_vectors, only: cross
   implicit none
   private
   public :: angle_words, numbers_of, same_kind, name_of_kind, forms_of_kind, turn_into_bunge, neper_form

   character(len=*), parameter :: angle_words(14) = [character(len=18) :: 'degrees', 'radians', &
      'bunge_degrees', 'bunge_radians', 'kocks_degrees', 'roe_degrees', 'rodrigues', 'rodrigues_inverse', &
      'axis_angle', 'axis_angle_radians', 'quaternion', 'quaternion_inverse', 'matrix', 'matrix_inverse']
   integer, parameter, public :: bunge_degrees = 3, bunge_radians = 4, rodrigues = 7, quaternion = 11, &
                                 matrix = 13
   integer, parameter :: kocks_degrees = 5, roe_degrees = 6, rodrigues_inverse = 8, axis_angle = 9, &
                         axis_angle_radians = 10, quaternion_inverse = 12, matrix_inverse = 14
   integer, parameter :: numbers(14) = [3, 3, 3, 3, 3, 3, 3, 3, 4, 4, 4, 4, 9, 9]
   integer, parameter :: kind_of(14) = [1, 1, 1, 1, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5]
   character(len=17), parameter :: kinds(5) = [character(len=17) :: 'Euler angles', 'Rodrigues vectors', &
      'axes and angles', 'quaternions', 'matrices']
   real(wp), parameter :: of_length_1 = 1.0e-2_wp, square = 1.0e-2_wp
   real(wp), parameter :: max_radians = 7.0_wp !< 2 pi with round-off

contains

   !> Numbers of an orientation in a form; 0: unknown form.
   pure integer function numbers_of(form)
      integer, intent(in) :: form
      numbers_of = 0
      if (form > 0) numbers_of = numbers(form)
   end function numbers_of

   !> True for two forms of the same kind of numbers: Euler angles, Rodrigues vectors, quaternions, ...
   pure logical function same_kind(form, other)
      integer, intent(in) :: form, other
      same_kind = kind_of(form) == kind_of(other)
   end function same_kind

   pure function name_of_kind(form) result(name)
      integer, intent(in) :: form
      character(len=:), allocatable :: name
      name = trim(kinds(kind_of(form)))
   end function name_of_kind

   !> The words of all forms of the same kind, without the short ones of Bunge's angles.
   pure function forms_of_kind(form) result(words)
      integer, intent(in) :: form
      character(len=len(angle_words)), allocatable :: words(:)
      integer :: n
      words = pack(angle_words, [(same_kind(n, form) .and. n >= bunge_degrees, n=1, size(angle_words))])
   end function forms_of_kind

   !> The form of a Neper descriptor, ignoring the part after its colon; 0: unknown.
   pure integer function neper_form(descriptor) result(form)
      character(len=*), intent(in) :: descriptor
      select case (descriptor)
      case ('rodrigues'); form = rodrigues
      case ('euler-bunge'); form = bunge_degrees
      case ('euler-kocks'); form = kocks_degrees
      case ('euler-roe'); form = roe_degrees
      case ('rotmat'); form = matrix_inverse ! Bunge's g
      case ('axis-angle'); form = axis_angle
      case ('quaternion'); form = quaternion
      case default; form = 0
      end select
   end function neper_form

   !> phi1 Phi phi2 in degrees of each orientation. `fault` is a message on the first wrong one; empty: no
   !> error.
   subroutine turn_into_bunge(form, given, angles, fault)
      integer, intent(in) :: form                !< of angle_words
      real(wp), intent(in) :: given(:)           !< numbers_of(form) of each
      real(wp), allocatable, intent(out) :: angles(:)
      character(len=:), allocatable, intent(out) :: fault
      real(wp) :: q(4)
      integer :: n, k
      logical :: good
      fault = ''
      k = numbers(form)
      allocate (angles(3*(size(given)/k)))
      do n = 1, size(given)/k
         associate (x => given(k*(n - 1) + 1:k*n), bunge => angles(3*n - 2:3*n))
            good = .true.
            select case (form)
            case (1, bunge_degrees)
               bunge = x
            case (2, bunge_radians)
               bunge = 180.0_wp/pi*x
               good = all(abs(x) <= max_radians)
            case (roe_degrees)
               bunge = [x(1) + 90.0_wp, x(2), x(3) - 90.0_wp]
            case (kocks_degrees)
               bunge = [x(1) + 90.0_wp, x(2), 90.0_wp - x(3)]
            case default
               call find_quaternion(form, x, q, good)
               bunge = bunge_of(q)
            end select
            if (good .and. all(ieee_is_finite(bunge))) cycle
            fault = 'orientation '//to_text(n)//' is none as angles='''//trim(angle_words(form))// &
                    ''' has them ('//need(form)//'); allowed: another angles'
            return
         end associate
      end do
   end subroutine turn_into_bunge

   pure function need(form) result(text)
      integer, intent(in) :: form
      character(len=:), allocatable :: text
      select case (form)
      case (2, bunge_radians); text = 'at most 2 pi in size'
      case (axis_angle, axis_angle_radians); text = 'an axis of length 1, then the angle'
      case (quaternion, quaternion_inverse); text = 'w x y z of length 1'
      case (matrix, matrix_inverse); text = 'three rows at right angles, of length 1, right-handed'
      case default; text = 'finite numbers'
      end select
   end function need

   !> The rotation from the sample's axes to the crystal's.
   pure subroutine find_quaternion(form, x, q, good)
      integer, intent(in) :: form
      real(wp), intent(in) :: x(:)
      real(wp), intent(out) :: q(4)
      logical, intent(out) :: good
      real(wp) :: r(3, 3), off(3, 3), angle
      integer :: i
      good = .true.
      q = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
      select case (form)
      case (rodrigues, rodrigues_inverse)
         q = [1.0_wp, x(1:3)]/sqrt(1.0_wp + sum(x(1:3)**2))
      case (axis_angle, axis_angle_radians)
         angle = x(4)
         if (form == axis_angle) angle = pi/180.0_wp*angle
         good = abs(norm2(x(1:3)) - 1.0_wp) <= of_length_1 .or. .not. abs(angle) > 0.0_wp
         if (form == axis_angle_radians) good = good .and. abs(angle) <= max_radians
         if (norm2(x(1:3)) > 0.0_wp) q = turn_by(x(1:3)/norm2(x(1:3)), angle)
      case (quaternion, quaternion_inverse)
         good = abs(norm2(x(1:4)) - 1.0_wp) <= of_length_1
         if (good) q = x(1:4)/norm2(x(1:4))
      case default
         r = transpose(reshape(x, [3, 3])) ! given row by row
         off = matmul(r, transpose(r))
         do i = 1, 3
            off(i, i) = off(i, i) - 1.0_wp
         end do
         good = maxval(abs(off)) <= square .and. dot_product(cross(r(:, 1), r(:, 2)), r(:, 3)) > 0.0_wp
         if (good) q = quaternion_of(r)
      end select
      if (any(form == [rodrigues_inverse, quaternion_inverse, matrix_inverse])) q(2:4) = -q(2:4)
   end subroutine find_quaternion

   !> Bunge's angles of a rotation, degrees: phi1 and phi2 from 0 to 360, Phi from 0 to 180.
   pure function bunge_of(q) result(angles)
      real(wp), intent(in) :: q(4)
      real(wp) :: angles(3)
      real(wp) :: half_sum, half_difference
      half_sum = 0.0_wp
      half_difference = 0.0_wp
      if (norm2(q([1, 4])) > 0.0_wp) half_sum = atan2(q(4), q(1))
      if (norm2(q([2, 3])) > 0.0_wp) half_difference = atan2(q(3), q(2))
      angles = [half_sum + half_difference, 2.0_wp*atan2(norm2(q([2, 3])), norm2(q([1, 4]))), &
                half_sum - half_difference]
      angles = 180.0_wp/pi*angles
      angles([1, 3]) = modulo(angles([1, 3]), 360.0_wp)
   end function bunge_of

end module m_orientations
