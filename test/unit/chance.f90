!> Chance that is the same on every rank and with every compiler, the worst of many errors, and lines of
!> measured figures.
module m_chance
   use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
   use m_kinds, only: wp, i8
   implicit none
   private
   public :: chance_t, chance_of, keep_worst, say

   integer(i8), parameter :: prime = 2147483647_i8 !< 2^31 - 1: products of two numbers below it fit

   !> A row of random numbers.
   type :: chance_t
      integer(i8) :: state = 12345_i8
   contains
      procedure :: between
      procedure :: several
   end type chance_t

contains

   !> A number in [low, high).
   real(wp) function between(self, low, high)
      class(chance_t), intent(inout) :: self
      real(wp), intent(in) :: low, high
      self%state = stirred(self%state + 1_i8)
      between = low + (high - low)*real(self%state, wp)/real(prime, wp)
   end function between

   !> n numbers in [low, high).
   function several(self, n, low, high) result(values)
      class(chance_t), intent(inout) :: self
      integer, intent(in) :: n
      real(wp), intent(in) :: low, high
      real(wp) :: values(n)
      integer :: i
      do i = 1, n
         values(i) = self%between(low, high)
      end do
   end function several

   !> A number in [0, 1) that belongs to an id and a key.
   pure real(wp) function chance_of(id, key)
      integer(i8), intent(in) :: id
      integer, intent(in) :: key
      chance_of = real(stirred(stirred(mod(id, prime)) + 7919_i8*key), wp)/real(prime, wp)
   end function chance_of

   pure integer(i8) function stirred(state)
      integer(i8), intent(in) :: state
      integer :: turn
      stirred = mod(state + 362437_i8, prime)
      do turn = 1, 3
         stirred = mod(stirred*48271_i8 + 11_i8, prime)
         stirred = mod(ieor(stirred, ishft(stirred, -13)), prime)
      end do
   end function stirred

   !> The larger of the worst so far and the magnitude of a new error; a NaN stays.
   elemental subroutine keep_worst(worst, error)
      real(wp), intent(inout) :: worst
      real(wp), intent(in) :: error
      if (ieee_is_nan(error)) then
         worst = error
      else if (.not. ieee_is_nan(worst)) then
         worst = max(worst, abs(error))
      end if
   end subroutine keep_worst

   !> A measured figure, on one line.
   subroutine say(what, value)
      character(len=*), intent(in) :: what
      real(wp), intent(in) :: value
      print '(3x,a,t72,es10.2)', what, value
   end subroutine say

end module m_chance
