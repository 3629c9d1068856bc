!> Grains as a file has them, and what the file says of itself.
module m_grain_list
   use m_kinds, only: wp, i4
   implicit none
   private

   !> Lists that a file does not have are not allocated.
   type, public :: grain_list_t
      real(wp), allocatable :: orientations(:)    !< `numbers` of each grain
      integer :: numbers = 0                      !< of an orientation
      integer :: form = 0                         !< of angle_words, as the file says; 0: it does not
      character(len=:), allocatable :: unclear    !< what it says of it, where that may mean two things
      real(wp), allocatable :: positions(:)       !< x y z of each seed, m, or in the unit of `size`
      real(wp), allocatable :: weights(:)         !< of each seed, a length
      integer(i4), allocatable :: voxels(:, :, :) !< number of the grain, x fastest; 0: none
      real(wp) :: lower(3) = 0.0_wp, size(3) = 0.0_wp !< of what the file describes, in its own unit; size 0:
                                                  !< not said, seeds are in m then
   end type grain_list_t

end module m_grain_list
