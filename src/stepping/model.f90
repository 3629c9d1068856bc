!> The discretised scene: level, materials, tools, and what the ranks exchange. Everything that a step changes.
module m_model
   use mpi_f08
   use m_kinds, only: wp, i8
   use m_constants, only: exit_input
   use m_errors, only: error_t, fail
   use m_text, only: to_text
   use m_communicator, only: communicator_t
   use m_timers, only: timers_t, phase_balance
   use m_scene, only: scene_t, time_spec_t, update_musl, domain_fixed, domain_stretch, domain_corners
   use m_grid_level, only: make_grid_level
   use m_level, only: level_t
   use m_body, only: fill_block, count_in_block
   use m_decomposition, only: choose_owners, settle_blocks
   use m_node_exchange, only: node_exchange_t
   use m_block, only: block_t
   use m_locate, only: bin_of
   use m_migration, only: migration_t, entered, frame_of
   use m_split, only: id_bits
   use m_materials, only: materials_t, make_materials
   use m_effect, only: effect_slot_t
   use m_effects, only: make_effects
   use m_effect_step, only: effect_step_t
   use m_contact, only: contact_t
   implicit none
   private
   public :: model_t

   !> Bounds over all ranks at the end of a step.
   type, public :: bounds_t
      real(wp) :: wave_speed = 0.0_wp     !< m/s
      real(wp) :: particle_speed = 0.0_wp !< m/s
   end type bounds_t

   type :: model_t
      type(communicator_t) :: communicator
      type(time_spec_t) :: method
      type(level_t) :: level
      type(materials_t) :: materials
      type(effect_slot_t), allocatable :: effects(:)
      type(effect_step_t) :: effect_step
      type(contact_t) :: contact
      type(node_exchange_t) :: exchange
      type(migration_t) :: migration
      type(timers_t) :: timers
      type(bounds_t) :: bounds
      real(wp) :: time = 0.0_wp                       !< s
      integer(i8) :: step = 0
      integer(i8) :: particle_steps = 0               !< particle updates on this rank so far
      integer(i8) :: splits = 0                       !< particles that this rank has split
      integer(i8) :: particle_steps_at_rest = 0       !< of these, how many had nothing to do
      logical :: skip_at_rest = .true.                !< leave out blocks that are at rest: the same bits, less time
   contains
      procedure :: build
      procedure :: connect
      procedure :: create_blocks
      procedure :: rebalance
      procedure :: wave_speed
      procedure :: release
   end type model_t

   real(wp), parameter :: tolerated_imbalance = 1.15_wp !< most loaded rank over the mean

contains

   !> Collective: make the model of a checked scene. Effects that the caller has set are kept, and those of the scene then left out.
   subroutine build(self, communicator, scene, error)
      class(model_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      type(scene_t), intent(in) :: scene
      type(error_t), intent(inout) :: error
      integer, allocatable :: counts(:)
      integer :: b, body, e, filled
      self%communicator = communicator
      self%method = scene%time
      self%materials = make_materials(scene)
      if (self%method%domain /= domain_fixed .and. first_id(size(scene%bodies) + 1) > 2_i8**id_bits) then
         call fail(error, exit_input, "with domains other than 'fixed' a scene has at most "// &
                   to_text(2_i8**id_bits/first_id(2))//' bodies')
         return
      end if
      if (.not. allocated(self%effects)) call make_effects(scene, self%effects)
      self%level%grid = make_grid_level(scene%grid)
      call self%timers%start()
      do e = 1, size(self%effects)
         call self%effects(e)%effect%prepare(self%level%grid, self%materials)
      end do
      call self%effect_step%build(self%effects, product(self%level%grid%blocks), self%timers)
      call self%contact%build(scene%tools, scene%contact)
      call declare_fields(self)
      associate (n => self%level%grid%blocks)
         allocate (self%level%owner(0:n(1) - 1, 0:n(2) - 1, 0:n(3) - 1), source=-1)
      end associate
      call count_particles(self, scene, counts)
      call choose_owners(communicator, self%level%grid, counts, self%level%owner, error)
      if (error%happened()) return
      call self%connect()
      do b = 1, size(self%level%blocks)
         do body = 1, size(scene%bodies)
            filled = self%level%blocks(b)%particles%count
            call fill_block(self%level, self%level%blocks(b), scene%bodies(body), body, &
                            scene%materials(scene%bodies(body)%material)%density, first_id(body))
            associate (particles => self%level%blocks(b)%particles, law => self%materials%slots(self%materials%of_body(body))%law)
               if (particles%count > filled) &
                  call law%initial(particles%column, self%level%layout, filled + 1, particles%count)
            end associate
         end do
         call set_bins(self%level, self%level%blocks(b))
         do e = 1, size(self%effects)
            call self%effects(e)%effect%initialise(self%level%blocks(b)%particles, self%level%table, self%level%layout, &
                                                   self%level%grid)
         end do
      end do
      call self%level%size_work()
      do e = 1, size(self%effects)
         call self%effects(e)%effect%verify(communicator, self%level, size(scene%tools), error)
      end do
      call communicator%agree(error)
   contains
      !> Ids of different bodies do not meet.
      pure integer(i8) function first_id(body)
         integer, intent(in) :: body
         first_id = int(body - 1, i8)*10_i8**12
      end function first_id
   end subroutine build

   !> Bins of the particles of a block that has just been filled.
   subroutine set_bins(level, block)
      type(level_t), intent(in) :: level
      type(block_t), intent(inout) :: block
      integer :: p
      associate (x => level%layout%position)
         do p = 1, block%particles%count
            block%cells%bin(p) = bin_of(block%particles%column(p, x:x + 2), frame_of(level, block))
         end do
      end associate
      block%cells%current = .false.
   end subroutine set_bins

   !> The fields that every scene has, and those that materials, effects and choices of the method ask for.
   subroutine declare_fields(self)
      class(model_t), intent(inout) :: self
      integer :: m
      associate (table => self%level%table)
         call table%declare('position', 3, 'm', written=.true.)
         call table%declare('velocity', 3, 'm/s', written=.true.)
         call table%declare('mass', 1, 'kg', written=.true., extensive=.true.)
         call table%declare('volume', 1, 'm3', written=.true., extensive=.true.)
         select case (self%method%domain)
         case (domain_corners); call table%declare('domain', 9, 'm', written=.true.)
         case (domain_stretch); call table%declare('half_size', 3, 'm', written=.true.)
         case default; call table%declare('half_size', 1, 'm', written=.true.)
         end select
         if (self%method%domain /= domain_fixed) call table%declare('generation', 1, '1', written=.false.)
         call table%declare('stress', 6, 'Pa', written=.true.)
         if (self%method%affine) call table%declare('velocity_gradient', 9, '1/s', written=.false.)
         if (self%method%stress_update == update_musl) call table%declare('next_position', 3, 'm', written=.false.)
         if (self%contact%active()) call self%contact%declare(table) ! before the laws: some carry more where there are tools
         do m = 1, size(self%materials%slots)
            call self%materials%slots(m)%law%declare(table)
         end do
         do m = 1, size(self%effects)
            self%effects(m)%columns = table%columns
            call self%effects(m)%effect%declare(table)
            self%effects(m)%columns = table%columns - self%effects(m)%columns
         end do
         self%level%layout = table%layout()
      end associate
   end subroutine declare_fields

   !> Collective: particles of each block by index, -1 where there are none; each rank counts a share of the blocks.
   subroutine count_particles(self, scene, counts)
      class(model_t), intent(in) :: self
      type(scene_t), intent(in) :: scene
      integer, allocatable, intent(out) :: counts(:)
      integer :: index, body
      allocate (counts(product(self%level%grid%blocks)), source=0)
      do index = 1 + self%communicator%rank, size(counts), self%communicator%ranks
         do body = 1, size(scene%bodies)
            counts(index) = counts(index) + count_in_block(self%level, self%level%grid%block_place(index), scene%bodies(body))
         end do
      end do
      call MPI_Allreduce(MPI_IN_PLACE, counts, size(counts), MPI_INTEGER, MPI_SUM, self%communicator%comm)
      where (counts == 0) counts = -1
   end subroutine count_particles

   !> Fit blocks, mirrors, pools and messages to the owners.
   subroutine connect(self)
      class(model_t), intent(inout) :: self
      call settle_blocks(self%level, self%communicator%rank)
      call self%exchange%build(self%communicator, self%level)
   end subroutine connect

   !> Collective: make the blocks that leavers have entered and that do not exist yet. A new block belongs to the lowest rank
   !> that asks for it.
   subroutine create_blocks(self)
      class(model_t), intent(inout) :: self
      integer, allocatable :: asked(:)
      integer :: b, index, l, place(3)
      allocate (asked(size(self%level%owner)), source=self%communicator%ranks)
      do b = 1, size(self%level%blocks)
         associate (block => self%level%blocks(b))
            do l = 1, block%leaver_count
               place = entered(self%level, block, int(block%leavers(l)))
               if (self%level%owner_at(place) < 0) asked(self%level%grid%block_index(place)) = self%communicator%rank
            end do
         end associate
      end do
      call MPI_Allreduce(MPI_IN_PLACE, asked, size(asked), MPI_INTEGER, MPI_MIN, self%communicator%comm)
      do index = 1, size(asked)
         if (asked(index) == self%communicator%ranks) cycle
         place = self%level%grid%block_place(index)
         self%level%owner(place(1), place(2), place(3)) = asked(index)
      end do
      call self%connect()
   end subroutine create_blocks

   !> Collective: place the blocks anew, without the empty ones, when the ranks' shares of the particles have drifted apart.
   subroutine rebalance(self, error)
      class(model_t), intent(inout) :: self
      type(error_t), intent(inout) :: error
      integer, allocatable :: counts(:), owner(:, :, :)
      integer(i8) :: own, total
      real(wp) :: heaviest
      integer :: b
      if (self%communicator%ranks == 1) return
      call self%timers%enter(phase_balance)
      own = self%level%particle_count()
      total = self%communicator%sum_count(own)
      heaviest = self%communicator%maximum(real(own, wp))
      if (heaviest*self%communicator%ranks > tolerated_imbalance*total) then
         allocate (counts(size(self%level%owner)), source=0)
         do b = 1, size(self%level%blocks)
            counts(self%level%blocks(b)%index) = self%level%blocks(b)%particles%count
         end do
         call MPI_Allreduce(MPI_IN_PLACE, counts, size(counts), MPI_INTEGER, MPI_SUM, self%communicator%comm)
         where (counts == 0) counts = -1
         allocate (owner, mold=self%level%owner)
         call choose_owners(self%communicator, self%level%grid, counts, owner, error)
         if (.not. error%happened()) then
            call self%migration%move_blocks(self%communicator, self%level, owner)
            self%level%owner(:, :, :) = owner
            call self%connect()
            call self%migration%unload(self%level)
         end if
      end if
      call self%timers%leave()
   end subroutine rebalance

   !> Speed (m/s) of the fastest wave of the grid: that of the material, faster by what effects make of it.
   pure real(wp) function wave_speed(self)
      class(model_t), intent(in) :: self
      integer :: e
      wave_speed = self%bounds%wave_speed
      do e = 1, size(self%effects)
         wave_speed = wave_speed*self%effects(e)%effect%wave_factor(self%bounds%particle_speed/self%bounds%wave_speed)
      end do
   end function wave_speed

   !> Free what MPI and PETSc hold.
   subroutine release(self)
      class(model_t), intent(inout) :: self
      call self%exchange%release()
      call self%migration%release()
      call self%contact%release()
   end subroutine release

end module m_model
