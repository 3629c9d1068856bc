!> Target or source of a run's state: one description of the state (state.f90) writes and reads it by the same
!> calls. A store is a file (io/file_store.f90) or memory.
module m_state_store
   use m_kinds, only: wp, i8
   use m_errors, only: error_t
   implicit none
   private

   type, abstract, public :: state_store_t
      logical :: writes = .false. !< if false it reads
   contains
      generic :: reals => reals_list, reals_table
      generic :: longs => longs_list, longs_table
      procedure(move_reals), deferred :: reals_table
      procedure(move_longs), deferred :: longs_table
      procedure :: reals_list
      procedure :: longs_list
   end type state_store_t

   abstract interface
      !> Collective: transfer a table that all ranks have, to or from the store.
      subroutine move_reals(self, name, values, error)
         import :: state_store_t, wp, error_t
         class(state_store_t), intent(inout) :: self
         character(len=*), intent(in) :: name
         real(wp), intent(inout) :: values(:, :)
         type(error_t), intent(inout) :: error
      end subroutine move_reals
      subroutine move_longs(self, name, values, error)
         import :: state_store_t, i8, error_t
         class(state_store_t), intent(inout) :: self
         character(len=*), intent(in) :: name
         integer(i8), intent(inout) :: values(:, :)
         type(error_t), intent(inout) :: error
      end subroutine move_longs
   end interface

contains

   !> A table with one number per row.
   subroutine reals_list(self, name, values, error)
      class(state_store_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), intent(inout) :: values(:)
      type(error_t), intent(inout) :: error
      real(wp) :: rows(1, size(values))
      rows(1, :) = values
      call self%reals_table(name, rows, error)
      values = rows(1, :)
   end subroutine reals_list

   subroutine longs_list(self, name, values, error)
      class(state_store_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer(i8), intent(inout) :: values(:)
      type(error_t), intent(inout) :: error
      integer(i8) :: rows(1, size(values))
      rows(1, :) = values
      call self%longs_table(name, rows, error)
      values = rows(1, :)
   end subroutine longs_list

end module m_state_store
