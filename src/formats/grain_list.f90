!> Grains as given in a file, with the file's metadata.
module m_grain_list
   use m_kinds, only: wp, i4
   implicit none
   private

   !> Lists that a file does not contain are not allocated.
   type, public :: grain_list_t
      real(wp), allocatable :: orientations(:)    !< `numbers` of each grain
      integer :: numbers = 0                      !< per orientation
      integer :: form = 0                         !< one of angle_words, as given by the file; 0: not given
      integer :: named = 0                        !< a form of the kind that the file's names of columns say;
                                                  !< 0: they are not there
      character(len=:), allocatable :: unclear    !< the file's name of the form, where that is ambiguous
      real(wp), allocatable :: positions(:)       !< x y z of each seed, m, or in the unit of `size`
      real(wp), allocatable :: weights(:)         !< of each seed, a length
      integer(i4), allocatable :: voxels(:, :, :) !< number of the grain, x fastest; 0: none
      real(wp) :: lower(3) = 0.0_wp, size(3) = 0.0_wp !< of the described box, in its own unit; size 0:
                                                  !< not given, seeds are then in m
   end type grain_list_t

end module m_grain_list
