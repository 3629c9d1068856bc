!> A copy in memory of the state of a run (state.f90), for roll-back after an error. Particles stay on their
!> rank.
module m_saved_state
   use m_kinds, only: wp, i4, i8
   use m_decomposition, only: set_owners, all_owners
   use m_errors, only: error_t
   use m_effect_step, only: kinds_booked
   use m_model, only: model_t
   use m_energy, only: balance_t
   use m_state, only: describe_state, block_reals, block_state, set_block_state, regions_of, set_regions
   use m_memory_store, only: memory_store_t
   implicit none
   private
   public :: saved_state_t

   type :: saved_state_t
      logical :: holds = .false.                    !< a copy exists
      real(wp) :: time = 0.0_wp                     !< s
      integer(i8) :: step = 0
      type(memory_store_t), private :: store
      integer(i8), allocatable, private :: regions(:) !< of the levels, packed
      integer, allocatable, private :: owner(:)     !< of the blocks of all levels
      integer, allocatable, private :: count(:)     !< particles of this rank's blocks, level by level
      real(wp), allocatable, private :: block(:, :) !< data of these blocks: (block_reals, blocks)
      real(wp), allocatable, private :: column(:)   !< block by block, within a block column by column
      integer(i8), allocatable, private :: id(:)
      integer(i4), allocatable, private :: body(:), bin(:)
   contains
      procedure :: take
      procedure :: give_back
      procedure :: forget
   end type saved_state_t

contains

   !> Collective: copy a model and its balance after a step.
   subroutine take(self, model, balance)
      class(saved_state_t), intent(inout) :: self
      type(model_t), intent(inout) :: model
      type(balance_t), intent(inout) :: balance
      type(error_t) :: none ! memory has no errors
      self%holds = .true.
      self%time = model%time
      self%step = model%step
      self%regions = regions_of(model)
      self%owner = all_owners(model%levels)
      call self%store%open(writes=.true.)
      call describe_state(self%store, model, balance, none)
      call take_particles(self, model)
   end subroutine take

   !> Copy the particles of this rank. Arrays are kept from copy to copy.
   subroutine take_particles(self, model)
      type(saved_state_t), intent(inout) :: self
      type(model_t), intent(in) :: model
      integer(i8) :: at, done
      integer :: b, blocks, c, columns, l, n
      columns = model%levels(1)%table%columns
      blocks = 0
      do l = 1, size(model%levels)
         blocks = blocks + size(model%levels(l)%blocks)
      end do
      call make_room(self, blocks, model%particle_count(), columns)
      done = 0
      blocks = 0
      do l = 1, size(model%levels)
         do b = 1, size(model%levels(l)%blocks)
            associate (block => model%levels(l)%blocks(b))
               blocks = blocks + 1
               n = block%particles%count
               self%count(blocks) = n
               self%block(:, blocks) = block_state(model, l, b)
               do c = 1, columns
                  at = columns*done + int(n, i8)*(c - 1)
                  self%column(at + 1:at + n) = block%particles%column(:n, c)
               end do
               self%id(done + 1:done + n) = block%particles%id(:n)
               self%body(done + 1:done + n) = block%particles%body(:n)
               self%bin(done + 1:done + n) = block%cells%bin(:n)
               done = done + n
            end associate
         end do
      end do
   end subroutine take_particles

   !> Allocate arrays for a number of blocks and particles; those of particles grow with a sixteenth to spare.
   subroutine make_room(self, blocks, particles, columns)
      type(saved_state_t), intent(inout) :: self
      integer, intent(in) :: blocks, columns
      integer(i8), intent(in) :: particles
      integer(i8) :: room
      if (allocated(self%count)) then
         if (size(self%count) /= blocks) deallocate (self%count, self%block)
      end if
      if (.not. allocated(self%count)) allocate (self%count(blocks), self%block(block_reals, blocks))
      if (allocated(self%id)) then
         if (size(self%id, kind=i8) >= particles) return
         deallocate (self%column, self%id, self%body, self%bin)
      end if
      room = particles + particles/16
      allocate (self%column(columns*room), self%id(room), self%body(room), self%bin(room))
   end subroutine make_room

   !> Collective: restore everything, whatever the state of the model; counters and timers are not reset.
   subroutine give_back(self, model, balance)
      class(saved_state_t), intent(inout) :: self
      type(model_t), intent(inout) :: model
      type(balance_t), intent(inout) :: balance
      type(error_t) :: none
      integer :: b, l, place
      logical :: good
      do l = 1, size(model%levels)
         call model%migration(l)%clear()
         do b = 1, size(model%levels(l)%blocks)
            model%levels(l)%blocks(b)%particles%count = 0
            model%levels(l)%blocks(b)%emigrant_count = 0
         end do
         do place = 1, model%levels(l)%grid%block_count() ! those of local blocks are set with the particles
            call model%effect_step(l)%accumulate(place, spread(0.0_wp, 1, kinds_booked))
         end do
      end do
      model%lost_in_merging = 0.0_wp
      call set_regions(model, self%regions, good)
      call model%place_layers()
      call set_owners(model%levels, self%owner)
      call model%connect()
      call self%store%open(writes=.false.)
      call describe_state(self%store, model, balance, none)
      call give_back_particles(self, model)
   end subroutine give_back

   subroutine give_back_particles(self, model)
      type(saved_state_t), intent(in) :: self
      type(model_t), intent(inout) :: model
      integer(i8) :: at, done
      integer :: b, blocks, c, columns, l, n
      columns = model%levels(1)%table%columns
      done = 0
      blocks = 0
      do l = 1, size(model%levels)
         do b = 1, size(model%levels(l)%blocks)
            associate (block => model%levels(l)%blocks(b))
               blocks = blocks + 1
               n = self%count(blocks)
               call block%reserve(max(1, n), columns)
               block%particles%count = n
               do c = 1, columns
                  at = columns*done + int(n, i8)*(c - 1)
                  block%particles%column(:n, c) = self%column(at + 1:at + n)
               end do
               block%particles%id(:n) = self%id(done + 1:done + n)
               block%particles%body(:n) = self%body(done + 1:done + n)
               call block%particles%changed()
               block%cells%bin(:n) = self%bin(done + 1:done + n)
               call block%cells%outdate()
               block%pressed = .true.
               call set_block_state(model, l, b, self%block(:, blocks))
               done = done + n
            end associate
         end do
         call model%levels(l)%size_work()
      end do
   end subroutine give_back_particles

   !> Free its memory.
   subroutine forget(self)
      class(saved_state_t), intent(inout) :: self
      self%holds = .false.
      if (allocated(self%id)) deallocate (self%column, self%id, self%body, self%bin)
   end subroutine forget

end module m_saved_state
