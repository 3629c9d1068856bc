!> How tools have moved, to a checkpoint or from one.
module m_motion_store
   use m_kinds, only: wp
   use m_errors, only: error_t
   use m_tool, only: tool_t
   use m_state_store, only: store_t
   implicit none
   private
   public :: describe_motions

contains

   !> Collective: the degrees of freedom that &motion gives to tools, and where turns have brought them. How
   !> far each has gone along its axis is there. A scene without &motion has no rows of these.
   subroutine describe_motions(store, tools, error)
      type(store_t), intent(inout) :: store
      type(tool_t), intent(inout) :: tools(:)
      type(error_t), intent(inout) :: error
      real(wp), allocatable :: turned(:, :), freedoms(:, :)
      integer :: k, n, t
      n = sum([(size(tools(t)%freedoms) - 1, t=1, size(tools))])
      if (n > 0) then
         allocate (turned(7, size(tools)), freedoms(5, n))
         n = 0
         do t = 1, size(tools)
            turned(:, t) = [tools(t)%aside, tools(t)%orientation]
            do k = 2, size(tools(t)%freedoms)
               n = n + 1
               associate (it => tools(t)%freedoms(k))
                  freedoms(:, n) = [it%travel, it%speed, it%aside]
               end associate
            end do
         end do
         call store%reals('/state/tools_turned', turned, error)
         call store%reals('/state/tools_freedoms', freedoms, error)
         n = 0
         do t = 1, size(tools)
            tools(t)%aside = turned(:3, t)
            tools(t)%orientation = turned(4:, t)
            do k = 2, size(tools(t)%freedoms)
               n = n + 1
               tools(t)%freedoms(k)%travel = freedoms(1, n)
               tools(t)%freedoms(k)%speed = freedoms(2, n)
               tools(t)%freedoms(k)%aside = freedoms(3:, n)
            end do
         end do
      end if
      do t = 1, size(tools)
         call tools(t)%settle()
      end do
   end subroutine describe_motions

end module m_motion_store
