!> Interface of a format of snapshots (`formats` of &output).
module m_snapshot_format
   use m_kinds, only: i8
   use m_errors, only: error_t
   use m_communicator, only: communicator_t
   use m_snapshot, only: snapshot_t
   implicit none
   private

   type, abstract, public :: snapshot_format_t
      logical :: is_text = .false. !< a text format, which takes time to convert
      logical :: indexed = .false. !< its files are listed in the animation index
   contains
      procedure(write_interface), deferred :: write
      procedure(bytes_interface), deferred :: bytes
   end type snapshot_format_t

   abstract interface
      !> Collective: write a file of the snapshot into the directory. On an error (exit_files) all ranks hold
      !> it and no file is left.
      subroutine write_interface(self, communicator, snapshot, directory, error)
         import :: snapshot_format_t, communicator_t, snapshot_t, error_t
         class(snapshot_format_t), intent(in) :: self
         type(communicator_t), intent(in) :: communicator
         type(snapshot_t), intent(in) :: snapshot
         character(len=*), intent(in) :: directory
         type(error_t), intent(inout) :: error
      end subroutine write_interface

      !> Estimated size of that file, bytes.
      integer(i8) function bytes_interface(self, snapshot)
         import :: snapshot_format_t, snapshot_t, i8
         class(snapshot_format_t), intent(in) :: self
         type(snapshot_t), intent(in) :: snapshot
      end function bytes_interface
   end interface

end module m_snapshot_format
