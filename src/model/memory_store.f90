!> A state in memory: numbers are stored one after the other and read in the same order.
module m_memory_store
   use m_kinds, only: wp, i8
   use m_errors, only: error_t
   use m_state_store, only: state_store_t
   implicit none
   private

   type, extends(state_store_t), public :: memory_store_t
      private
      real(wp), allocatable :: all_reals(:)
      integer(i8), allocatable :: all_longs(:)
      integer :: next_real = 1, next_long = 1
   contains
      procedure :: open => open_memory
      procedure :: reals_table => move_reals
      procedure :: longs_table => move_longs
   end type memory_store_t

contains

   !> Start writing, or reading, from the first number.
   subroutine open_memory(self, writes)
      class(memory_store_t), intent(inout) :: self
      logical, intent(in) :: writes
      self%writes = writes
      self%next_real = 1
      self%next_long = 1
      if (.not. writes) return
      self%all_reals = [real(wp) ::]
      self%all_longs = [integer(i8) ::]
   end subroutine open_memory

   subroutine move_reals(self, name, values, error)
      class(memory_store_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), intent(inout) :: values(:, :)
      type(error_t), intent(inout) :: error
      if (self%writes) then
         self%all_reals = [self%all_reals, reshape(values, [size(values)])]
      else
         values = reshape(self%all_reals(self%next_real:self%next_real + size(values) - 1), shape(values))
         self%next_real = self%next_real + size(values)
      end if
   end subroutine move_reals

   subroutine move_longs(self, name, values, error)
      class(memory_store_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer(i8), intent(inout) :: values(:, :)
      type(error_t), intent(inout) :: error
      if (self%writes) then
         self%all_longs = [self%all_longs, reshape(values, [size(values)])]
      else
         values = reshape(self%all_longs(self%next_long:self%next_long + size(values) - 1), shape(values))
         self%next_long = self%next_long + size(values)
      end if
   end subroutine move_longs

end module m_memory_store
