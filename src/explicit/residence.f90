!> Moves particles to their level, and merges those that have left a finer one.
module m_residence
   use mpi_f08
   use m_kinds, only: wp
   use m_errors, only: error_t
   use m_decomposition, only: blocks_before
   use m_transfer, only: find_changes, change_levels
   use m_merge, only: merge_siblings
   use m_model, only: model_t
   implicit none
   private
   public :: change_pair

contains

   !> Collective: particles of level l and the next change level; siblings that have all left the finer level
   !> merge.
   subroutine change_pair(model, l, error)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l
      type(error_t), intent(inout) :: error
      integer :: b, changes, merged
      real(wp) :: lost
      call model%timers%enter(model%levels_row)
      changes = find_changes(model%levels(l), model%levels(l + 1))
      call MPI_Allreduce(MPI_IN_PLACE, changes, 1, MPI_INTEGER, MPI_MAX, model%communicator%comm)
      if (changes == 0) return
      call change_levels(model%communicator, model%levels(l), model%levels(l + 1), model%migration(l), &
                         model%migration(l + 1), model%splits, error)
      if (error%happened()) return
      do b = 1, size(model%levels(l)%blocks)
         call merge_siblings(model%levels(l), model%levels(l + 1), b, model%materials, model%stuff, merged, &
                             lost)
         model%merges = model%merges + merged
         associate (accumulated => model%lost_in_merging(blocks_before(model%levels, l) &
                                                    + model%levels(l)%blocks(b)%index))
            accumulated = accumulated + lost
         end associate
      end do
      call model%levels(l)%size_work()
      do b = 1, size(model%levels(l)%blocks)
         if (model%levels(l)%blocks(b)%cells%counted < 0) call model%levels(l)%keep_order(b)
      end do
   end subroutine change_pair

end module m_residence
