!> Existence and ownership of blocks: creation of new ones, and redistribution.
submodule (m_model) m_model_blocks
   use m_membership, only: may_live_on, clip_to_home
   use m_timers, only: phase_balance
   use m_placement, only: work_t, work_of, order_work, choose_owners
   use m_decomposition, only: set_owners, all_owners
   implicit none

   real(wp), parameter :: largest_move = 0.45_wp !< cells of the coarsest level per step: above the largest
                                                 !< safety factor

contains

   module procedure create_blocks
      logical, allocatable :: wanted(:)
      allocate (wanted(size(self%levels(1)%owner)), source=.false.)
      wanted(self%migration(1)%missing(self%levels(1))) = .true.
      call make_wanted(self, wanted)
   end procedure create_blocks

   module procedure prepare_blocks
      logical, allocatable :: wanted(:)
      if (size(self%levels) == 1) return
      call mark_wanted(self, wanted)
      call make_wanted(self, wanted, edges_moved)
   end procedure prepare_blocks

   !> The blocks that this rank's particles may enter, by number.
   subroutine mark_wanted(self, wanted)
      class(model_t), intent(in) :: self
      logical, allocatable, intent(out) :: wanted(:)
      integer :: b, l
      allocate (wanted(blocks_before(self%levels, size(self%levels) + 1)), source=.false.)
      do l = 1, size(self%levels)
         do b = 1, size(self%levels(l)%blocks)
            associate (block => self%levels(l)%blocks(b))
               if (block%particles%count > 0) &
                  call self%mark_around(l, block%field, block%lowest, block%highest, wanted)
            end associate
         end do
      end do
   end subroutine mark_wanted

   module procedure mark_around
      real(wp) :: low(3), high(3), low_there(3), high_there(3), reach
      reach = merge(largest_move, 0.0_wp, size(self%levels) > 1)*self%levels(1)%grid%cell
      low = lowest - reach
      high = highest + reach
      low_there = low
      high_there = high
      if (l > 1) call clip_to_home(self%levels(l), self%levels(l - 1)%grid%cell, low_there, high_there)
      call mark_box(l, low_there, high_there)
      associate (level => self%levels(l))
         if (l < size(self%levels)) then
            associate (finer => self%levels(l + 1))
               if (may_live_on(finer, low - level%grid%cell, high + level%grid%cell)) then
                  low_there = low
                  high_there = high
                  call clip_to_home(finer, level%grid%cell, low_there, high_there)
                  call mark_box(l + 1, low_there, high_there)
               end if
            end associate
         end if
         if (l > 1) then
            if (.not. level%region%holds_box(low, high, 2.0_wp*level%grid%cell)) then
               low_there = low
               high_there = high
               if (l > 2) call clip_to_home(self%levels(l - 1), self%levels(l - 2)%grid%cell, low_there, &
                                            high_there)
               call mark_box(l - 1, low_there, high_there)
            end if
         end if
      end associate
   contains
      subroutine mark_box(l, low, high)
         integer, intent(in) :: l
         real(wp), intent(in) :: low(3), high(3)
         integer :: a(3), z(3), i, j, k
         a = self%levels(l)%grid%block_of(low)
         z = self%levels(l)%grid%block_of(high)
         do k = a(3), z(3)
            do j = a(2), z(2)
               do i = a(1), z(1)
                  wanted(blocks_before(self%levels, l) + self%levels(l)%grid%block_index([i, j, k], field)) &
                     = .true.
               end do
            end do
         end do
      end subroutine mark_box
   end procedure mark_around

   !> Collective: create the missing blocks that some rank wants. A new block belongs to the lowest rank that
   !> wants it.
   subroutine make_wanted(self, wanted, edges_moved)
      class(model_t), intent(inout) :: self
      logical, intent(in) :: wanted(:) !< one per block of each level
      logical, intent(in), optional :: edges_moved
      integer, allocatable :: asked(:), owner(:)
      integer :: missing
      owner = all_owners(self%levels)
      missing = merge(1, 0, any(wanted .and. owner < 0))
      if (present(edges_moved)) missing = max(missing, merge(1, 0, edges_moved))
      call MPI_Allreduce(MPI_IN_PLACE, missing, 1, MPI_INTEGER, MPI_MAX, self%communicator%comm)
      if (missing == 0) return
      asked = merge(self%communicator%rank, self%communicator%ranks, wanted)
      call MPI_Allreduce(MPI_IN_PLACE, asked, size(asked), MPI_INTEGER, MPI_MIN, self%communicator%comm)
      where (owner < 0 .and. asked < self%communicator%ranks) owner = asked
      call add_parents(self%levels, owner)
      call set_owners(self%levels, owner)
      call self%connect()
   end subroutine make_wanted

   module procedure rebalance
      type(work_t) :: work
      integer, allocatable :: now(:), owner(:)
      if (self%communicator%ranks == 1) return
      call self%timers%enter(phase_balance)
      work = count_work(self)
      now = all_owners(self%levels)
      owner = now
      call choose_owners(self%communicator, self%levels, work, owner, error, steps)
      if (.not. error%happened() .and. any(work%exists .and. owner /= now)) call place_anew(self, owner)
      call self%timers%leave()
   end procedure rebalance

   !> Collective: the work of all blocks: their particles, the particles pressed by tools, and the particles'
   !> order.
   type(work_t) function count_work(self) result(work)
      class(model_t), intent(in) :: self
      integer, allocatable :: counts(:), points(:), order(:)
      integer :: b, before, l
      counts = merge(0, -1, all_owners(self%levels) >= 0)
      allocate (points(size(counts)), order(size(counts)), source=0)
      do l = 1, size(self%levels)
         before = blocks_before(self%levels, l)
         do b = 1, size(self%levels(l)%blocks)
            associate (block => self%levels(l)%blocks(b))
               counts(before + block%index) = block%particles%count
               order(before + block%index) = order_work(block%cells%occupied, block%mean_breaks)
               if (self%contact%active()) points(before &
                                                 + block%index) = self%contact%candidates%pressed(block)
            end associate
         end do
      end do
      call MPI_Allreduce(MPI_IN_PLACE, counts, size(counts), MPI_INTEGER, MPI_MAX, self%communicator%comm)
      call MPI_Allreduce(MPI_IN_PLACE, points, size(points), MPI_INTEGER, MPI_MAX, self%communicator%comm)
      call MPI_Allreduce(MPI_IN_PLACE, order, size(order), MPI_INTEGER, MPI_MAX, self%communicator%comm)
      if (size(self%levels) == 1) where (counts == 0) counts = -1
      work = work_of(self%levels, counts, self%steps_of_levels(), points, order)
   end function count_work

   !> Collective: move blocks to other owners.
   subroutine place_anew(self, owner)
      class(model_t), intent(inout) :: self
      integer, intent(in) :: owner(:) !< as from choose_owners
      integer :: l
      do l = 1, size(self%levels)
         call self%migration(l)%move_blocks(self%communicator, self%levels(l), &
            owner(blocks_before(self%levels, l) + 1:blocks_before(self%levels, l + 1)))
      end do
      call set_owners(self%levels, owner)
      call self%connect()
      if (self%has_statics) call self%static_losses%follow_blocks(self%levels, self%communicator)
      do l = 1, size(self%levels)
         call self%migration(l)%unpack_blocks(self%levels(l))
      end do
   end subroutine place_anew

end submodule m_model_blocks
