!> The state of a run in a checkpoint file: tables that rank 0 writes and all ranks read.
module m_file_store
   use, intrinsic :: iso_c_binding, only: c_loc, c_ptr
   use m_kinds, only: wp, i8
   use m_errors, only: error_t
   use m_communicator, only: communicator_t
   use m_state_store, only: state_store_t
   use m_snapshot, only: file_layout_t
   use m_hdf5_file, only: hdf5_file_t, rows_of_real, rows_of_long
   use m_hdf5_reader, only: hdf5_reader_t
   implicit none
   private
   public :: some_rows

   type, extends(state_store_t), public :: file_store_t
      type(communicator_t) :: communicator
      type(hdf5_file_t) :: output
      type(hdf5_reader_t) :: input
   contains
      procedure :: reals_table => move_reals
      procedure :: longs_table => move_longs
      procedure, private :: move
   end type file_store_t

contains

   subroutine move_reals(self, name, values, error)
      class(file_store_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), intent(inout) :: values(:, :)
      type(error_t), intent(inout) :: error
      real(wp), allocatable, target :: numbers(:, :)
      allocate (numbers, source=values)
      call self%move(name, rows_of_real, shape(values), c_loc(numbers), error)
      if (.not. error%happened()) values = numbers
   end subroutine move_reals

   subroutine move_longs(self, name, values, error)
      class(file_store_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer(i8), intent(inout) :: values(:, :)
      type(error_t), intent(inout) :: error
      integer(i8), allocatable, target :: numbers(:, :)
      allocate (numbers, source=values)
      call self%move(name, rows_of_long, shape(values), c_loc(numbers), error)
      if (.not. error%happened()) values = numbers
   end subroutine move_longs

   subroutine move(self, name, kind, extent, numbers, error)
      class(file_store_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: kind, extent(2)
      type(c_ptr), intent(in) :: numbers
      type(error_t), intent(inout) :: error
      if (self%writes) then
         call self%output%put_rows(name, kind, int(extent, i8), some_rows(0_i8, &
            merge(extent(2), 0, self%communicator%is_root())), numbers, error)
      else
         call self%input%get_rows(name, kind, int(extent, i8), some_rows(0_i8, extent(2)), numbers, error)
      end if
   end subroutine move

   !> One range of rows; no range if it is empty.
   pure type(file_layout_t) function some_rows(before, rows) result(layout)
      integer(i8), intent(in) :: before
      integer, intent(in) :: rows
      allocate (layout%offset(merge(1, 0, rows > 0)), source=before)
      allocate (layout%count(merge(1, 0, rows > 0)), source=rows)
   end function some_rows

end module m_file_store
