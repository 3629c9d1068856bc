!> Colours of orientations: the inverse pole figure of cubic crystals.
module m_ipf_colour
   use m_kinds, only: wp
   use m_rotations, only: matrix_of
   use m_snapshot, only: snapshot_t, snapshot_field_t, component_name_length
   implicit none
   private
   public :: add_ipf_colour, ipf_colour

contains

   !> If a snapshot has orientations, add the colour of the crystal direction along z: `ipf_colour`, red green
   !> blue from 0 to 1.
   subroutine add_ipf_colour(snapshot)
      type(snapshot_t), intent(inout) :: snapshot
      type(snapshot_field_t), allocatable :: fields(:)
      integer :: f, p, n
      n = size(snapshot%fields)
      do f = 1, n
         if (snapshot%fields(f)%name == 'orientation') exit
      end do
      if (f > n) return
      allocate (fields(n + 1))
      fields(:n) = snapshot%fields
      fields(n + 1)%name = 'ipf_colour'
      fields(n + 1)%unit = ''
      fields(n + 1)%components = 3
      fields(n + 1)%component_names = [character(len=component_name_length) :: 'red', 'green', 'blue']
      allocate (fields(n + 1)%values(snapshot%n_local, 3))
      do p = 1, snapshot%n_local
         fields(n + 1)%values(p, :) = ipf_colour(fields(f)%values(p, :), [0.0_wp, 0.0_wp, 1.0_wp])
      end do
      call move_alloc(fields, snapshot%fields)
   end subroutine add_ipf_colour

   !> [001] is red, [011] green, [111] blue, the brightest of the three 1.
   pure function ipf_colour(orientation, direction) result(colour)
      real(wp), intent(in) :: orientation(4) !< quaternion, m_rotations
      real(wp), intent(in) :: direction(3)   !< of the sample, of length 1
      real(wp) :: colour(3), d(3), low, high, middle
      d = abs(matmul(direction, matrix_of(orientation/norm2(orientation))))
      low = minval(d)
      high = maxval(d)
      middle = sum(d) - low - high
      colour = max(0.0_wp, [high - middle, sqrt(2.0_wp)*(middle - low), sqrt(3.0_wp)*low])
      colour = colour/maxval(colour)
   end function ipf_colour

end module m_ipf_colour
