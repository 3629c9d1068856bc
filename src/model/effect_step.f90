!> Calls the effects of a run at their places in the step, and measures the work of their forces on the nodes.
!>
!> An effect's nodal force on a block is the force on the block's own share of each node (theory.md, eq.
!> effect-work): so every part of the work belongs to one block, and sums over blocks by index have the same
!> bits on any number of ranks.
module m_effect_step
   use mpi_f08
   use m_kinds, only: wp
   use m_node_values, only: tile_last, mass_, v_x, v_z, f_x, f_z, a_x, a_z
   use m_communicator, only: communicator_t
   use m_effect, only: effect_slot_t, hooks_t
   use m_level, only: level_t
   use m_migration, only: frame_of
   use m_particle_transfer, only: p2g_body_force
   use m_timers, only: timers_t, phase_p2g, phase_nodes
   implicit none
   private
   public :: effect_step_t

   integer, parameter :: external = 1, dissipated = 2 !< kinds of work on nodes
   integer, parameter, public :: kinds_booked = 3 !< accumulated values of a block: these, and the work by the
                                                  !< particles' motion

   !> Particles of a block on which an effect's forces act, and their centres at the beginning of the step.
   type :: marked_t
      integer, allocatable :: which(:)
      real(wp), allocatable :: from(:, :) !< (3, these particles), m
   end type marked_t

   !> The effects to call at each place (indices of the effects, rising), and their work so far.
   type :: effect_step_t
      integer, allocatable :: acceleration(:), add_forces(:), on_nodes(:), on_cells(:), on_gradient(:), &
                              on_stress(:)
      logical :: adds_forces = .false. !< some effect adds forces before the sum over blocks
      logical :: acts_on_nodes = .false.   !< some effect has forces on nodes
      logical :: erodes = .false.       !< some effect removes failed particles
      logical :: acts_at_rest = .false. !< some effect changes material at rest
      real(wp) :: external_work = 0.0_wp !< done by effects up to the last reduction, J
      real(wp) :: damped = 0.0_wp        !< dissipated by effects up to the last reduction, J
      real(wp) :: particle_work = 0.0_wp !< of forces at points, by the particles' own motion, up to the last
                                         !< reduction, J
      real(wp) :: ahead_work = 0.0_wp !< part of that in the half step by which positions are ahead of
                                      !< velocities, at the last reduction, J
      logical :: leads = .true. !< positions are ahead of velocities by half a step
      logical :: follows_particles = .false. !< all external work is also known from the particles' motion
      integer, allocatable, private :: kind(:) !< of the work of each effect
      real(wp), allocatable, private :: nodal_force(:, :, :, :, :, :)   !< N, (3, 0:9, 0:9, 0:9, kinds,
                                                                        !< own blocks)
      real(wp), allocatable, private :: earlier_force(:, :, :, :, :, :) !< at an earlier time of the step
      real(wp), allocatable, private :: mass(:, :, :, :) !< each block's own share of the mass of its nodes,
                                                         !< where effects change nodes: (0:9, 0:9, 0:9, own
                                                         !< blocks), kg
      real(wp), allocatable, private :: work(:, :) !< (kinds, blocks of the level by index), J, since the last
                                                   !< reduction
      real(wp), allocatable, private :: own_work(:) !< by the particles' motion: (blocks of the level by
                                                    !< index), J, likewise
      real(wp), allocatable, private :: ahead(:) !< part of that in the time by which positions are ahead of
                                                 !< velocities
      type(marked_t), allocatable, private :: marked(:, :) !< for each effect with forces at points, in own
                                                           !< blocks
      logical, allocatable, private :: loaded(:) !< forces act at points of own blocks' particles in this step
   contains
      procedure :: build
      procedure :: add_body_forces
      procedure :: keep_masses
      procedure :: change_nodes
      procedure :: measure
      procedure :: scale_nodal_force
      procedure :: add_nodal_force
      procedure :: keep_nodal_force
      procedure :: mean_nodal_force
      procedure :: is_loaded
      procedure :: mark
      procedure :: follow
      procedure :: change_gradient
      procedure :: change_stress
      procedure :: reduce_accumulated
      procedure :: accumulated
      procedure :: work_ahead
      procedure :: accumulate
   end type effect_step_t

contains

   !> Collect the hooks of the effects, and give each effect a row of the timers.
   subroutine build(self, effects, places, timers)
      class(effect_step_t), intent(inout) :: self
      type(effect_slot_t), intent(inout) :: effects(:)
      integer, intent(in) :: places !< number of block places on the level
      type(timers_t), intent(inout) :: timers
      type(hooks_t) :: hooks(size(effects))
      integer :: e
      do e = 1, size(effects)
         hooks(e) = effects(e)%effect%hooks()
         effects(e)%row = timers%row_of(effects(e)%effect%name)
      end do
      self%acceleration = pack([(e, e=1, size(effects))], hooks%acceleration)
      self%add_forces = pack([(e, e=1, size(effects))], hooks%add_forces)
      self%on_nodes = pack([(e, e=1, size(effects))], hooks%on_nodes)
      self%on_cells = pack([(e, e=1, size(effects))], hooks%on_cells)
      self%on_gradient = pack([(e, e=1, size(effects))], hooks%on_gradient)
      self%on_stress = pack([(e, e=1, size(effects))], hooks%on_stress)
      self%kind = merge(dissipated, external, hooks%dissipates)
      self%adds_forces = any(hooks%acceleration) .or. any(hooks%add_forces)
      self%acts_at_rest = any(hooks%acts_at_rest)
      self%erodes = any(hooks%erodes)
      self%acts_on_nodes = self%adds_forces .or. any(hooks%on_nodes)
      self%follows_particles = all(hooks%follows_particles .or. hooks%dissipates &
                                   .or. .not. (hooks%acceleration .or. hooks%add_forces .or. hooks%on_nodes))
      if (self%acts_on_nodes) allocate (self%work(maxval(self%kind), places), source=0.0_wp)
      if (size(self%add_forces) > 0) allocate (self%own_work(places), self%ahead(places), source=0.0_wp)
   end subroutine build

   !> Add body forces and other forces to the tile with the contributions of a block's particles. Resets the
   !> nodal force of the block.
   subroutine add_body_forces(self, effects, level, b, time, window, timers)
      class(effect_step_t), intent(inout) :: self
      type(effect_slot_t), intent(in) :: effects(:)
      type(level_t), intent(inout) :: level
      integer, intent(in) :: b
      real(wp), intent(in) :: time, window !< s: as in effect_t's add_forces
      type(timers_t), intent(inout) :: timers
      real(wp) :: before(3, 0:tile_last, 0:tile_last, 0:tile_last)
      integer :: i, e
      call fit_push(self, size(level%blocks))
      self%nodal_force(:, :, :, :, :, b) = 0.0_wp
      if (.not. self%adds_forces) return
      before = level%nodes(f_x:f_z, :, :, :, b)
      associate (block => level%blocks(b))
         if (size(self%acceleration) > 0) then
            level%gradient(:, 1:3) = 0.0_wp
            do i = 1, size(self%acceleration)
               e = self%acceleration(i)
               call timers%enter(effects(e)%row)
               call effects(e)%effect%acceleration(block%particles, level%table, level%layout, time, &
                                                   level%gradient(:, 1:3))
            end do
            call timers%enter(phase_p2g)
            call p2g_body_force(block%cells, block%particles%column, level%layout, frame_of(level, block), &
                                     level%gradient(:, 1:3), level%nodes(:, :, :, :, b))
         end if
         do i = 1, size(self%add_forces)
            e = self%add_forces(i)
            call timers%enter(effects(e)%row)
            call effects(e)%effect%add_forces(block, level%table, level%layout, level%grid, time, &
                                              window, level%nodes(:, :, :, :, b))
         end do
      end associate
      call timers%enter(phase_p2g)
      self%nodal_force(:, :, :, :, external, b) = level%nodes(f_x:f_z, :, :, :, b) - before
      if (size(self%add_forces) > 0) self%ahead(level%blocks(b)%index) = 0.0_wp
      self%loaded(b) = size(self%add_forces) > 0 &
                       .and. any(abs(self%nodal_force(:, :, :, :, external, b)) > 0.0_wp)
   end subroutine add_body_forces

   !> Allocate one nodal force field per block of this rank; it is reset every step.
   subroutine fit_push(self, blocks)
      class(effect_step_t), intent(inout) :: self
      integer, intent(in) :: blocks
      if (allocated(self%nodal_force)) then
         if (size(self%nodal_force, 6) == blocks) return
         deallocate (self%nodal_force, self%loaded)
      end if
      allocate (self%nodal_force(3, 0:tile_last, 0:tile_last, 0:tile_last, size(self%work, 1), blocks))
      allocate (self%loaded(blocks), source=.false.)
   end subroutine fit_push

   !> Before the sums over blocks: store each block's own share of the mass of its nodes, if some effect will
   !> change them.
   subroutine keep_masses(self, level)
      class(effect_step_t), intent(inout) :: self
      type(level_t), intent(in) :: level
      integer :: b
      if (size(self%on_nodes) == 0) return
      if (allocated(self%mass)) then
         if (size(self%mass, 4) /= size(level%blocks)) deallocate (self%mass)
      end if
      if (.not. allocated(self%mass)) allocate (self%mass(0:tile_last, 0:tile_last, 0:tile_last, &
                                                          size(level%blocks)))
      do b = 1, size(level%blocks)
         self%mass(:, :, :, b) = level%nodes(mass_, :, :, :, b)
      end do
   end subroutine keep_masses

   !> Apply effects to the solved nodes of a block, before boundary conditions.
   subroutine change_nodes(self, effects, level, b, time, time_step, constrained, timers)
      class(effect_step_t), intent(inout) :: self
      type(effect_slot_t), intent(in) :: effects(:)
      type(level_t), intent(inout) :: level
      integer, intent(in) :: b
      real(wp), intent(in) :: time, time_step !< s
      integer, intent(in) :: constrained(:, :) !< nodes of the tile that are moved by a coarser level: they
                                               !< are not changed
      type(timers_t), intent(inout) :: timers
      real(wp) :: before(6, 0:tile_last, 0:tile_last, 0:tile_last)
      integer :: n, e, i, j, k, s
      do n = 1, size(self%on_nodes)
         e = self%on_nodes(n)
         call timers%enter(effects(e)%row)
         before = level%nodes(v_x:a_z, :, :, :, b)
         call effects(e)%effect%on_nodes(time, time_step, level%nodes(:, :, :, :, b))
         do s = 1, size(constrained, 2)
            associate (at => constrained(:3, s))
               level%nodes(v_x:a_z, at(1), at(2), at(3), b) = before(:, at(1), at(2), at(3))
            end associate
         end do
         do k = 0, tile_last
            do j = 0, tile_last
               do i = 0, tile_last
                  self%nodal_force(:, i, j, k, self%kind(e), b) = &
                     self%nodal_force(:, i, j, k, self%kind(e), b) &
                     + self%mass(i, j, k, b)*(level%nodes(a_x:a_z, i, j, k, b) - before(4:6, i, j, k))
               end do
            end do
         end do
      end do
      call timers%enter(phase_nodes)
   end subroutine change_nodes

   !> Add the work of the step on a block, when its nodes have their final velocity, after boundary conditions
   !> and contact: dt times force times the mean of the velocities at the beginning and at the end.
   subroutine measure(self, level, b, time_step)
      class(effect_step_t), intent(inout) :: self
      type(level_t), intent(in) :: level
      integer, intent(in) :: b
      real(wp), intent(in) :: time_step !< s
      real(wp) :: sum_of_tile
      integer :: kind, i, j, k
      do kind = 1, size(self%work, 1)
         sum_of_tile = 0.0_wp
         do k = 0, tile_last
            do j = 0, tile_last
               do i = 0, tile_last
                  sum_of_tile = sum_of_tile + dot_product(self%nodal_force(:, i, j, k, kind, b), &
                                                          level%nodes(v_x:v_z, i, j, k, b) &
                                                          - 0.5_wp*time_step*level%nodes(a_x:a_z, i, j, k, b))
               end do
            end do
         end do
         associate (work => self%work(kind, level%blocks(b)%index))
            work = work + time_step*sum_of_tile
         end associate
      end do
   end subroutine measure

   !> Scale the nodal force of all effects.
   subroutine scale_nodal_force(self, share)
      class(effect_step_t), intent(inout) :: self
      real(wp), intent(in) :: share
      if (allocated(self%nodal_force)) self%nodal_force = share*self%nodal_force
   end subroutine scale_nodal_force

   !> Add a share of a force to the nodal force of a block.
   subroutine add_nodal_force(self, b, share, force)
      class(effect_step_t), intent(inout) :: self
      integer, intent(in) :: b
      real(wp), intent(in) :: share, force(:, 0:, 0:, 0:) !< tile as nodes, N
      associate (mine => self%nodal_force(:, :, :, :, external, b))
         mine = mine + share*force(f_x:f_z, :, :, :)
      end associate
   end subroutine add_nodal_force

   !> Store the nodal force of the step's beginning, for steps that need both ends.
   subroutine keep_nodal_force(self)
      class(effect_step_t), intent(inout) :: self
      if (allocated(self%nodal_force)) self%earlier_force = self%nodal_force
   end subroutine keep_nodal_force

   !> Replace the nodal force by the mean of the stored and the present one, for the work.
   subroutine mean_nodal_force(self, share)
      class(effect_step_t), intent(inout) :: self
      real(wp), intent(in) :: share !< weight of the present one
      if (.not. (allocated(self%nodal_force) .and. allocated(self%earlier_force))) return
      self%nodal_force = share*self%nodal_force + (1.0_wp - share)*self%earlier_force
   end subroutine mean_nodal_force

   !> True where forces of effects act at points of a block's particles in this step.
   pure logical function is_loaded(self, b)
      class(effect_step_t), intent(in) :: self
      integer, intent(in) :: b
      is_loaded = .false.
      if (allocated(self%loaded)) is_loaded = self%loaded(b)
   end function is_loaded

   !> Before the particles of a block move: store the particles on which effects act, and their positions.
   subroutine mark(self, effects, level, b)
      class(effect_step_t), intent(inout) :: self
      type(effect_slot_t), intent(in) :: effects(:)
      type(level_t), intent(in) :: level
      integer, intent(in) :: b
      integer :: i, n
      if (allocated(self%marked)) then
         if (size(self%marked, 2) /= size(level%blocks)) deallocate (self%marked)
      end if
      if (.not. allocated(self%marked)) allocate (self%marked(size(self%add_forces), size(level%blocks)))
      associate (particles => level%blocks(b)%particles, x => level%layout%position)
         do i = 1, size(self%add_forces)
            associate (marked => self%marked(i, b))
               marked%which = effects(self%add_forces(i))%effect%pushed(particles)
               if (allocated(marked%from)) deallocate (marked%from)
               allocate (marked%from(3, size(marked%which)))
               do n = 1, size(marked%which)
                  marked%from(:, n) = particles%column(marked%which(n), x:x + 2)
               end do
            end associate
         end do
      end associate
   end subroutine mark

   !> Add the work of the forces at points of a block's particles, by the motion of these in the step.
   subroutine follow(self, effects, level, b, gradient, way_to, time, time_step)
      class(effect_step_t), intent(inout) :: self
      type(effect_slot_t), intent(in) :: effects(:)
      type(level_t), intent(in) :: level
      integer, intent(in) :: b
      real(wp), intent(in), contiguous :: gradient(:, :) !< (:, 9), 1/s: L
      integer, intent(in) :: way_to                  !< first column of the centres at its end
      real(wp), intent(in) :: time, time_step        !< s
      real(wp) :: work(2)
      integer :: i
      if (.not. allocated(self%marked)) return
      if (size(self%marked, 2) /= size(level%blocks)) return
      work = 0.0_wp
      associate (block => level%blocks(b))
         do i = 1, size(self%add_forces)
            associate (effect => effects(self%add_forces(i))%effect, marked => self%marked(i, b))
               if (.not. allocated(marked%which)) cycle ! at rest
               work = work + effect%particle_work(block%particles, marked%which, level%layout, gradient, &
                                                  marked%from, way_to, time, time_step, &
                                                  merge(time_step, 0.0_wp, self%leads))
               deallocate (marked%which, marked%from)
            end associate
         end do
         self%own_work(block%index) = self%own_work(block%index) + work(1)
         if (self%leads) self%ahead(block%index) = work(2)
      end associate
   end subroutine follow

   !> Apply effects to the velocity gradients of a block, before its stress. `nodes` holds the sums over
   !> cells, if an effect needs them.
   subroutine change_gradient(self, effects, level, b, time_step, timers)
      class(effect_step_t), intent(in) :: self
      type(effect_slot_t), intent(in) :: effects(:)
      type(level_t), intent(inout) :: level
      integer, intent(in) :: b
      real(wp), intent(in) :: time_step !< s
      type(timers_t), intent(inout) :: timers
      integer :: i
      associate (block => level%blocks(b))
         do i = 1, size(self%on_cells)
            call timers%enter(effects(self%on_cells(i))%row)
            call effects(self%on_cells(i))%effect%on_cells(block%cells, block%particles, level%layout, &
                                                           frame_of(level, block), &
                                                           level%nodes(:, :, :, :, b), level%gradient)
         end do
         do i = 1, size(self%on_gradient)
            call timers%enter(effects(self%on_gradient(i))%row)
            call effects(self%on_gradient(i))%effect%on_gradient(block%cells, block%particles, level%layout, &
               time_step, level%gradient)
         end do
      end associate
   end subroutine change_gradient

   !> Apply effects to the particles of a block after its stress.
   subroutine change_stress(self, effects, level, b, time_step, timers)
      class(effect_step_t), intent(in) :: self
      type(effect_slot_t), intent(in) :: effects(:)
      type(level_t), intent(inout) :: level
      integer, intent(in) :: b
      real(wp), intent(in) :: time_step !< s
      type(timers_t), intent(inout) :: timers
      integer :: i
      do i = 1, size(self%on_stress)
         call timers%enter(effects(self%on_stress(i))%row)
         call effects(self%on_stress(i))%effect%on_stress(level%blocks(b)%particles, level%layout, &
                                                          level%gradient, level%grid%cell, time_step)
      end do
   end subroutine change_stress

   !> Collective: add the work of all blocks to the totals, by their index. To be called before blocks change
   !> rank, so that all of a block's work comes from one rank (adding the zeros of the others changes no bit).
   subroutine reduce_accumulated(self, communicator)
      class(effect_step_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      real(wp) :: total(2)
      real(wp), allocatable :: all_ahead(:)
      integer :: place
      if (.not. self%acts_on_nodes) return
      call MPI_Allreduce(MPI_IN_PLACE, self%work, size(self%work), MPI_DOUBLE_PRECISION, MPI_SUM, &
                         communicator%comm)
      total = 0.0_wp
      do place = 1, size(self%work, 2)
         total(:size(self%work, 1)) = total(:size(self%work, 1)) + self%work(:, place)
      end do
      self%external_work = self%external_work + total(external)
      self%damped = self%damped - total(dissipated)
      self%work = 0.0_wp
      if (.not. allocated(self%own_work)) return
      call MPI_Allreduce(MPI_IN_PLACE, self%own_work, size(self%own_work), MPI_DOUBLE_PRECISION, MPI_SUM, &
                         communicator%comm)
      all_ahead = self%ahead
      call MPI_Allreduce(MPI_IN_PLACE, all_ahead, size(all_ahead), MPI_DOUBLE_PRECISION, MPI_SUM, &
                         communicator%comm)
      self%ahead_work = 0.0_wp
      do place = 1, size(self%own_work)
         self%particle_work = self%particle_work + self%own_work(place)
         self%ahead_work = self%ahead_work + all_ahead(place)
      end do
      self%own_work = 0.0_wp
      self%ahead = 0.0_wp
   end subroutine reduce_accumulated

   !> Work on a block since the last reduction, J: external, dissipated; that of forces at points by the
   !> particles' motion.
   pure function accumulated(self, index) result(work)
      class(effect_step_t), intent(in) :: self
      integer, intent(in) :: index !< of the block
      real(wp) :: work(kinds_booked)
      work = 0.0_wp
      if (self%acts_on_nodes) work(:size(self%work, 1)) = self%work(:, index)
      if (allocated(self%own_work)) work(kinds_booked) = self%own_work(index)
   end function accumulated

   !> Part of the work by the motion of a block's particles in the half step after the time of the velocities,
   !> J.
   pure real(wp) function work_ahead(self, index) result(work)
      class(effect_step_t), intent(in) :: self
      integer, intent(in) :: index !< of the block
      work = 0.0_wp
      if (allocated(self%ahead)) work = self%ahead(index)
   end function work_ahead

   !> Set the values that `accumulated` returns, from a checkpoint.
   pure subroutine accumulate(self, index, work)
      class(effect_step_t), intent(inout) :: self
      integer, intent(in) :: index
      real(wp), intent(in) :: work(kinds_booked) !< J
      if (self%acts_on_nodes) self%work(:, index) = work(:size(self%work, 1))
      if (.not. allocated(self%own_work)) return
      self%own_work(index) = work(kinds_booked)
      self%ahead(index) = 0.0_wp
   end subroutine accumulate

end module m_effect_step
