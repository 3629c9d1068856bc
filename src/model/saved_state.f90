!> A copy in memory of all that a step changes: a model that has met a fault goes back to it. What
!> doc/developer/files.md says of a checkpoint holds here too, but the particles stay with the rank that had
!> them, and nothing is written.
module m_saved_state
   use mpi_f08
   use m_kinds, only: wp, i4, i8
   use m_decomposition, only: set_owners, all_owners
   use m_region, only: region_t
   use m_tool, only: tool_t
   use m_pair_reactions, only: pair_state_t
   use m_tool_reactions, only: tool_state_t
   use m_effect_step, only: kinds_booked
   use m_model, only: model_t, bounds_t
   use m_energy, only: balance_t
   implicit none
   private
   public :: saved_state_t

   !> What is booked on one level.
   type :: saved_level_t
      type(region_t) :: region
      real(wp) :: external_work = 0.0_wp, damped = 0.0_wp, particle_work = 0.0_wp !< by effects, J
      real(wp), allocatable :: booked(:, :)         !< by kinds and block, since the last fold, J
   end type saved_level_t

   !> What contact keeps from step to step.
   type :: saved_contact_t
      type(tool_t), allocatable :: tools(:)
      type(tool_state_t), allocatable :: states(:)
      type(pair_state_t), allocatable :: pairs(:)
      integer(i8) :: unsolved_in_row = 0
      real(wp) :: steepest = 0.0_wp, worst_residual = 0.0_wp, worst_overlap = 0.0_wp, worst_bridge = 0.0_wp, &
                  drift = 0.0_wp
   end type saved_contact_t

   type :: saved_state_t
      logical :: holds = .false.                    !< there is a copy
      real(wp) :: time = 0.0_wp                     !< s
      integer(i8) :: step = 0
      type(balance_t) :: balance
      integer(i8), private :: moves = 0, merges = 0, splits = 0
      real(wp), private :: lost = 0.0_wp
      type(bounds_t), private :: bounds
      type(saved_level_t), allocatable, private :: levels(:)
      type(saved_contact_t), private :: contact
      integer, allocatable, private :: owner(:)     !< of the blocks of all levels
      real(wp), allocatable, private :: lost_in_merging(:)
      integer, allocatable, private :: count(:)     !< particles of this rank's blocks, level by level
      integer, allocatable, private :: run_breaks(:) !< of the order of their particles, as they were counted
      real(wp), allocatable, private :: disorder(:) !< of the blocks
      real(wp), allocatable, private :: extent(:, :) !< lowest and highest place of their centres, m: (6,
                                                     !< blocks)
      real(wp), allocatable, private :: column(:)   !< block by block, and there column by column
      integer(i8), allocatable, private :: id(:)
      integer(i4), allocatable, private :: body(:), bin(:)
   contains
      procedure :: take
      procedure :: give_back
      procedure :: forget
   end type saved_state_t

contains

   !> Copy a model and its balance as they stand after a step.
   subroutine take(self, model, balance)
      class(saved_state_t), intent(inout) :: self
      type(model_t), intent(in) :: model
      type(balance_t), intent(in) :: balance
      integer :: l, place
      self%holds = .true.
      self%time = model%time
      self%step = model%step
      self%balance = balance
      self%moves = model%moves
      self%merges = model%merges
      self%splits = model%splits
      self%lost = model%lost
      self%bounds = model%bounds
      self%owner = all_owners(model%levels)
      self%lost_in_merging = model%lost_in_merging
      self%contact%tools = model%contact%tools
      self%contact%states = model%contact%states
      self%contact%pairs = model%contact%pairs%states
      self%contact%unsolved_in_row = model%contact%unsolved_in_row
      self%contact%steepest = model%contact%friction%steepest
      self%contact%worst_residual = model%contact%worst_residual
      self%contact%worst_overlap = model%contact%worst_overlap
      self%contact%worst_bridge = model%contact%worst_bridge
      self%contact%drift = model%contact%candidates%drift
      if (.not. allocated(self%levels)) allocate (self%levels(size(model%levels)))
      do l = 1, size(model%levels)
         associate (saved => self%levels(l), step => model%effect_step(l), &
                    places => model%levels(l)%grid%block_count())
            saved%region = model%levels(l)%region
            saved%external_work = step%external_work
            saved%damped = step%damped
            saved%particle_work = step%particle_work
            if (.not. step%acts_on_nodes) cycle
            if (.not. allocated(saved%booked)) allocate (saved%booked(kinds_booked, places))
            do place = 1, places
               saved%booked(:, place) = step%booked(place)
            end do
         end associate
      end do
      call take_particles(self, model)
   end subroutine take

   !> The particles of this rank. Room is kept from copy to copy.
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
               self%run_breaks(blocks) = block%run_breaks
               self%disorder(blocks) = block%disorder
               self%extent(:, blocks) = [block%lowest, block%highest]
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

   !> Arrays for so many blocks and particles; those of particles grow with a sixteenth to spare.
   subroutine make_room(self, blocks, particles, columns)
      type(saved_state_t), intent(inout) :: self
      integer, intent(in) :: blocks, columns
      integer(i8), intent(in) :: particles
      integer(i8) :: room
      if (allocated(self%count)) then
         if (size(self%count) /= blocks) deallocate (self%count, self%run_breaks, self%disorder, self%extent)
      end if
      if (.not. allocated(self%count)) &
         allocate (self%count(blocks), self%run_breaks(blocks), self%disorder(blocks), self%extent(6, blocks))
      if (allocated(self%id)) then
         if (size(self%id, kind=i8) >= particles) return
         deallocate (self%column, self%id, self%body, self%bin)
      end if
      room = particles + particles/16
      allocate (self%column(columns*room), self%id(room), self%body(room), self%bin(room))
   end subroutine make_room

   !> Collective: everything as it was, in whatever state the model is; what was counted and timed since stays
   !> counted.
   subroutine give_back(self, model, balance)
      class(saved_state_t), intent(in) :: self
      type(model_t), intent(inout) :: model
      type(balance_t), intent(inout) :: balance
      integer :: b, l, place
      model%time = self%time
      model%step = self%step
      model%moves = self%moves
      model%merges = self%merges
      model%splits = self%splits
      model%lost = self%lost
      model%bounds = self%bounds
      balance = self%balance
      do l = 1, size(model%levels)
         call model%migration(l)%clear()
         do b = 1, size(model%levels(l)%blocks)
            model%levels(l)%blocks(b)%particles%count = 0
            model%levels(l)%blocks(b)%emigrant_count = 0
         end do
         associate (saved => self%levels(l))
            model%levels(l)%region = saved%region
            model%effect_step(l)%external_work = saved%external_work
            model%effect_step(l)%damped = saved%damped
            model%effect_step(l)%particle_work = saved%particle_work
            if (.not. model%effect_step(l)%acts_on_nodes) cycle
            do place = 1, model%levels(l)%grid%block_count()
               call model%effect_step(l)%book(place, saved%booked(:, place))
            end do
         end associate
      end do
      call model%place_layers()
      call set_owners(model%levels, self%owner)
      call model%connect()
      model%lost_in_merging = self%lost_in_merging
      model%contact%tools = self%contact%tools
      model%contact%states = self%contact%states
      model%contact%pairs%states = self%contact%pairs
      model%contact%unsolved_in_row = self%contact%unsolved_in_row
      model%contact%friction%steepest = self%contact%steepest
      model%contact%worst_residual = self%contact%worst_residual
      model%contact%worst_overlap = self%contact%worst_overlap
      model%contact%worst_bridge = self%contact%worst_bridge
      model%contact%candidates%drift = self%contact%drift
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
               block%disorder = self%disorder(blocks)
               do c = 1, columns
                  at = columns*done + int(n, i8)*(c - 1)
                  block%particles%column(:n, c) = self%column(at + 1:at + n)
               end do
               block%particles%id(:n) = self%id(done + 1:done + n)
               block%particles%body(:n) = self%body(done + 1:done + n)
               call block%particles%changed()
               block%cells%bin(:n) = self%bin(done + 1:done + n)
               block%run_breaks = self%run_breaks(blocks)
               call block%cells%outdate()
               block%pressed = .true.
               block%lowest = self%extent(1:3, blocks)
               block%highest = self%extent(4:6, blocks)
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
