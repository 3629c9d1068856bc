!> Counting of passed and failed checks for the programs in test/io.
module m_io_checks
   implicit none
   private

   !> Counts on one rank; a failed check prints its name.
   type, public :: checks_t
      integer :: passed = 0
      integer :: failed = 0
   contains
      procedure :: that
      procedure :: same
   end type checks_t

contains

   !> Count a condition.
   subroutine that(self, name, condition)
      class(checks_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      logical, intent(in) :: condition
      if (condition) then
         self%passed = self%passed + 1
      else
         self%failed = self%failed + 1
         print '(2a)', 'FAILED ', name
      end if
   end subroutine that

   !> Count the equality of two texts, their lengths too.
   subroutine same(self, got, expected)
      class(checks_t), intent(inout) :: self
      character(len=*), intent(in) :: got, expected
      call self%that('`'//got//'` should be `'//expected//'`', got == expected .and. len(got) == len(expected))
   end subroutine same

end module m_io_checks
