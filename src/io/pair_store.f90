!> What pairs of contact groups have met, to a checkpoint or from one.
module m_pair_store
   use m_kinds, only: wp
   use m_errors, only: error_t
   use m_body_pairs, only: body_pairs_t
   use m_pair_reactions, only: state_reals
   use m_state_store, only: store_t
   implicit none
   private
   public :: describe_pairs

contains

   !> Collective: the sums of each pair, and its largest overlap. A scene without groups has no rows of these.
   subroutine describe_pairs(store, pairs, error)
      type(store_t), intent(inout) :: store
      type(body_pairs_t), intent(inout) :: pairs
      type(error_t), intent(inout) :: error
      real(wp) :: values(state_reals + 1, size(pairs%states))
      if (.not. pairs%active()) return
      values(:state_reals, :) = reshape(transfer(pairs%states, [0.0_wp]), [state_reals, size(pairs%states)])
      values(state_reals + 1, :) = pairs%overlap
      call store%reals('/state/pairs', values, error)
      pairs%states = transfer(values(:state_reals, :), pairs%states)
      pairs%overlap = values(state_reals + 1, :)
   end subroutine describe_pairs

end module m_pair_store
