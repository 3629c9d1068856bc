!> Slip systems of cubic crystals: plane normals, directions, and the Schmid tensors as eight components for
!> resolved shear stresses (theory.md, eq. schmid).
module m_slip_systems
   use m_kinds, only: wp
   implicit none
   private
   public :: make_slip_systems, schmid_columns, schmid_tensor

   character(len=*), parameter, public :: slip_words(3) = [character(len=5) :: 'fcc', 'bcc24', 'bcc48']
   real(wp), parameter :: root_two = sqrt(2.0_wp), root_six = sqrt(6.0_wp)

contains

   !> fcc: {111}<110>, 12 systems. bcc24: {110}<111> and {112}<111>. bcc48: those and {123}<111>. One of each
   !> pair that differs in sign.
   pure subroutine make_slip_systems(kind, normals, directions)
      integer, intent(in) :: kind !< index in slip_words
      real(wp), allocatable, intent(out) :: normals(:, :)    !< (3, systems), of length 1
      real(wp), allocatable, intent(out) :: directions(:, :) !< (3, systems), of length 1
      allocate (normals(3, 0), directions(3, 0))
      if (kind == 1) then
         call add([1, 1, 1], [1, 1, 0], normals, directions)
      else
         call add([1, 1, 0], [1, 1, 1], normals, directions)
         call add([1, 1, 2], [1, 1, 1], normals, directions)
         if (kind == 3) call add([1, 2, 3], [1, 1, 1], normals, directions)
      end if
   end subroutine make_slip_systems

   !> All planes of a family with all directions of another that lie in them.
   pure subroutine add(planes, lines, normals, directions)
      integer, intent(in) :: planes(3), lines(3)
      real(wp), allocatable, intent(inout) :: normals(:, :), directions(:, :)
      integer, allocatable :: n(:, :), d(:, :)
      integer :: i, j
      allocate (n, source=family(planes))
      allocate (d, source=family(lines))
      do i = 1, size(n, 2)
         do j = 1, size(d, 2)
            if (dot_product(n(:, i), d(:, j)) /= 0) cycle
            normals = reshape([normals, n(:, i)/norm2(real(n(:, i), wp))], [3, size(normals, 2) + 1])
            directions = reshape([directions, d(:, j)/norm2(real(d(:, j), wp))], [3, size(directions, 2) + 1])
         end do
      end do
   end subroutine add

   !> All vectors by permutations and signs of one, one of each pair of opposite ones.
   pure function family(indices) result(members)
      integer, intent(in) :: indices(3)
      integer, allocatable :: members(:, :)
      integer, parameter :: orders(3, 6) = reshape([1, 2, 3, 2, 3, 1, 3, 1, 2, 1, 3, 2, 3, 2, 1, 2, 1, 3], &
                                                   [3, 6])
      integer :: o, s, k, vector(3)
      logical :: known
      allocate (members(3, 0))
      do o = 1, 6
         do s = 0, 7
            vector = indices(orders(:, o))*(1 - 2*[ibits(s, 0, 1), ibits(s, 1, 1), ibits(s, 2, 1)])
            known = .false.
            do k = 1, size(members, 2)
               known = known .or. all(members(:, k) == vector) .or. all(members(:, k) == -vector)
            end do
            if (.not. known) members = reshape([members, vector], [3, size(members, 2) + 1])
         end do
      end do
   end function family

   !> The eight components of a tensor: five of its deviator, in an orthonormal basis of traceless symmetric
   !> tensors, three of its skew part. The scalar product of two such is the double contraction of the
   !> tensors, if one of them is traceless.
   pure function schmid_columns(a) result(c)
      real(wp), intent(in) :: a(3, 3)
      real(wp) :: c(8)
      c(1) = (a(1, 1) - a(2, 2))/root_two
      c(2) = (2.0_wp*a(3, 3) - a(1, 1) - a(2, 2))/root_six
      c(3) = (a(2, 3) + a(3, 2))/root_two
      c(4) = (a(1, 3) + a(3, 1))/root_two
      c(5) = (a(1, 2) + a(2, 1))/root_two
      c(6) = (a(3, 2) - a(2, 3))/root_two
      c(7) = (a(1, 3) - a(3, 1))/root_two
      c(8) = (a(2, 1) - a(1, 2))/root_two
   end function schmid_columns

   !> The traceless tensor with these components.
   pure function schmid_tensor(c) result(a)
      real(wp), intent(in) :: c(8)
      real(wp) :: a(3, 3), d(8)
      d = c/root_two
      a(1, 1) = d(1) - c(2)/root_six
      a(2, 2) = -d(1) - c(2)/root_six
      a(3, 3) = 2.0_wp*c(2)/root_six
      a(2, 3) = d(3) - d(6); a(3, 2) = d(3) + d(6)
      a(1, 3) = d(4) + d(7); a(3, 1) = d(4) - d(7)
      a(1, 2) = d(5) - d(8); a(2, 1) = d(5) + d(8)
   end function schmid_tensor

end module m_slip_systems
