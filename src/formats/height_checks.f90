!> Plausibility checks of heights: a forgotten unit, a number used for missing values, an outlier.
module m_height_checks
   use m_kinds, only: wp
   use m_text, only: to_text
   implicit none
   private
   public :: doubt_heights

   real(wp), parameter :: steepest = 100.0_wp !< height over width
   real(wp), parameter :: huge_by_any_unit = 1.0e30_wp
   real(wp), parameter :: stand_ins(6) = [-9999.0_wp, -99999.0_wp, -32768.0_wp, -32767.0_wp, 9999.0_wp, &
                                          99999.0_wp]
   real(wp), parameter :: far_off = 50.0_wp !< a spike is this many times further from all others than their
                                            !< range

contains

   !> `fault` is a message that follows the file's name; empty: no error.
   subroutine doubt_heights(height, spacing, scale, fault)
      real(wp), intent(in) :: height(:, :) !< (along x, along y), in the file's unit
      real(wp), intent(in) :: spacing(2)   !< m
      real(wp), intent(in) :: scale        !< m, of the file's unit
      character(len=:), allocatable, intent(inout) :: fault
      real(wp) :: width(2), high
      call look_for_stand_in(height, fault)
      if (fault == '') call look_for_spike(height, fault)
      if (fault /= '') return
      width = spacing*(shape(height) - 1)
      high = scale*(maxval(height) - minval(height))
      if (high > steepest*maxval(width)) &
         fault = 'holds heights from '//to_text(minval(height), 4)//' to '//to_text(maxval(height), 4)// &
                 ', which with scale='//to_text(scale)//' are '//to_text(high, 3)//' m high over '// &
                 to_text(width(1), 3)//' by '//to_text(width(2), 3)//' m; allowed: at most '// &
                 to_text(nint(steepest))//' times as high as wide. scale is the m of the file''s unit'
   end subroutine doubt_heights

   !> Find a usual number for missing values, further from the other heights than their range.
   subroutine look_for_stand_in(height, fault)
      real(wp), intent(in) :: height(:, :)
      character(len=:), allocatable, intent(inout) :: fault
      logical :: odd(size(height, 1), size(height, 2))
      real(wp) :: lowest, highest, off
      integer :: k, at(2)
      do k = 0, size(stand_ins)
         if (k == 0) then
            odd = abs(height) >= huge_by_any_unit
         else
            odd = abs(height - stand_ins(k)) <= 0.0_wp
         end if
         if (.not. any(odd) .or. all(odd)) cycle
         lowest = minval(height, mask=.not. odd)
         highest = maxval(height, mask=.not. odd)
         at = findloc(odd, .true.)
         associate (value => height(at(1), at(2)))
            off = max(lowest - value, value - highest)
            if (.not. off > highest - lowest) cycle
            fault = 'holds '//to_text(value)//' at place '//to_text(at(1))//' of row '//to_text(at(2))// &
                    ' ('//to_text(count(odd))//' in all), which marks a missing value; the others are '// &
                    to_text(lowest, 4)//' to '//to_text(highest, 4)//'. Fill it by its neighbours'
         end associate
         return
      end do
   end subroutine look_for_stand_in

   !> Find one height that is far from all others, up or down.
   subroutine look_for_spike(height, fault)
      real(wp), intent(in) :: height(:, :)
      character(len=:), allocatable, intent(inout) :: fault
      logical :: others(size(height, 1), size(height, 2))
      real(wp) :: lowest, highest, off
      integer :: at(2), side
      if (size(height) < 3) return
      do side = 1, 2
         at = maxloc(merge(1.0_wp, -1.0_wp, side == 1)*height)
         others = .true.
         others(at(1), at(2)) = .false.
         lowest = minval(height, mask=others)
         highest = maxval(height, mask=others)
         off = max(lowest - height(at(1), at(2)), height(at(1), at(2)) - highest)
         if (.not. (highest > lowest .and. off > far_off*(highest - lowest))) cycle
         fault = 'holds '//to_text(height(at(1), at(2)), 4)//' at place '//to_text(at(1))//' of row '// &
                 to_text(at(2))//', an outlier: the others are '//to_text(lowest, 4)//' to '// &
                 to_text(highest, 4)//'. Fill it by its neighbours'
         return
      end do
   end subroutine look_for_spike

end module m_height_checks
