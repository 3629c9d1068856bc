!> The discretised scene: levels, materials, tools, and communication. Contains all that a step changes.
module m_model
   use mpi_f08
   use m_kinds, only: wp, i8
   use m_errors, only: error_t
   use m_communicator, only: communicator_t
   use m_timers, only: timers_t
   use m_scene, only: scene_t, time_spec_t, level_spec_t
   use m_static_losses, only: static_losses_t
   use m_level, only: level_t
   use m_decomposition, only: settle_blocks, blocks_before
   use m_region, only: region_t
   use m_composite, only: composite_t
   use m_membership, only: set_layers
   use m_joined_cells, only: join_cells
   use m_edge, only: has_constrained
   use m_node_exchange, only: node_exchange_t
   use m_migration, only: migration_t
   use m_split, only: stuff_t
   use m_scene_materials, only: materials_t
   use m_effect, only: effect_slot_t
   use m_effect_step, only: effect_step_t
   use m_contact, only: contact_t
   use m_uncovered, only: uncovered_t
   use m_embedded_model, only: embedded_model_t
   implicit none
   private
   public :: model_t, add_parents

   !> Bounds over all ranks at the end of a step.
   type, public :: bounds_t
      real(wp) :: wave_speed = 0.0_wp     !< m/s
      real(wp) :: particle_speed = 0.0_wp !< m/s
   end type bounds_t

   type :: model_t
      type(communicator_t) :: communicator
      type(time_spec_t) :: method
      type(level_t), allocatable :: levels(:)           !< the coarsest first
      type(materials_t) :: materials
      type(stuff_t), allocatable :: stuff(:)            !< material data of bodies for splitting
      type(effect_slot_t), allocatable :: effects(:)
      type(effect_step_t), allocatable :: effect_step(:) !< one a level
      type(contact_t) :: contact
      class(embedded_model_t), allocatable :: atoms     !< where the scene has some
      type(node_exchange_t), allocatable :: exchange(:) !< one a level
      type(migration_t), allocatable :: migration(:)    !< one a level
      type(composite_t), allocatable :: composite(:) !< with the level above; first and one more: empty
      type(timers_t) :: timers
      integer :: levels_row = 0                       !< row of the timers, for several levels
      type(bounds_t) :: bounds
      real(wp) :: null_space_share = 1.0_wp !< share of the null-space velocity that remains after a step
      type(level_spec_t), allocatable :: level_specs(:) !< the parts of levels 2 and on, as given in the scene
      type(region_t), allocatable :: first_parts(:)     !< their regions at the start
      real(wp), allocatable :: first_centres(:, :)      !< (3, fields): centres of mass at the start, m; where
                                                        !< a level follows a contact group
      integer(i8) :: moves = 0                        !< number of moves of the levels' boxes
      integer(i8) :: placings = 0, bound_placings = 0 !< updates by the error, since the start or the last
                                                      !< checkpoint, and those in which a budget was exceeded
      real(wp) :: time = 0.0_wp                       !< s
      real(wp) :: last_step = 0.0_wp                  !< of the coarsest level, s
      integer(i8) :: step = 0
      integer :: requested_action = 0 !< this rank's request to the run; after a step the largest of all ranks
      logical :: has_inertia = .true. !< if false, velocities are displacements over steps, without kinetic
                                      !< energy
      logical :: has_statics = .false. !< some steps have no inertia
      real(wp) :: static_step = 0.0_wp !< length of the next quasi-static step, s; 0: not known yet
      type(static_losses_t) :: static_losses
      type(uncovered_t) :: uncovered !< faces beside the particles that the present step has eroded
      logical :: wants_sums = .false. !< histories need sums over all particles after the step
      integer(i8) :: particle_steps = 0               !< particle updates on this rank so far
      integer(i8) :: merges = 0                       !< particles that this rank has merged from eight others
      real(wp), allocatable :: lost_in_merging(:) !< energy, by block of all levels, since the last reduction,
                                                  !< J
      real(wp) :: lost = 0.0_wp                       !< energy lost in merging up to the last reduction, J
      integer(i8), allocatable :: level_steps(:)      !< particle steps by level
      integer(i8) :: splits = 0                       !< particles that this rank has created by splitting
                                                      !< others
      integer(i8) :: particle_steps_at_rest = 0       !< particle steps of particles at rest
      logical :: works_ahead = .true. !< P2G of the next step while blocks are in the cache: the same bits in
                                      !< less time
      logical :: skip_at_rest = .true. !< skip blocks that are at rest: the same bits in less time
   contains
      procedure :: build
      procedure :: connect
      procedure :: place_layers
      procedure :: create_blocks
      procedure :: prepare_blocks
      procedure :: mark_around
      procedure :: centres_of_mass
      procedure :: follows_groups
      procedure :: rebalance
      procedure :: steps_of_levels
      procedure :: particle_count
      procedure :: reduce_accumulated
      procedure :: stepped_cell
      procedure :: wave_speed
      procedure :: mixes
      procedure :: share_of_unseen
      procedure :: release
   end type model_t

   interface
      !> Collective: build the model of a checked scene. Effects set by the caller are kept, and those of the
      !> scene then ignored. `empty`: without blocks and particles (restore.f90 reads those of a checkpoint).
      module subroutine build(self, communicator, scene, error, empty)
         class(model_t), intent(inout) :: self
         type(communicator_t), intent(in) :: communicator
         type(scene_t), intent(in) :: scene
         type(error_t), intent(inout) :: error
         logical, intent(in), optional :: empty
      end subroutine build
      !> The grids of all levels and the regions that they refine.
      module subroutine make_levels(self, scene)
         class(model_t), intent(inout) :: self
         type(scene_t), intent(in) :: scene
      end subroutine make_levels
      !> Check that the regions of all levels keep their distance from the edges of those that they refine.
      !> (For single boxes the reader has checked it.)
      module subroutine check_nests(self, scene, error)
         class(model_t), intent(in) :: self
         type(scene_t), intent(in) :: scene
         type(error_t), intent(inout) :: error
      end subroutine check_nests
      !> Set the budgets of levels placed by the error: `max_memory` is converted to cells. Levels that start
      !> around the contact zone must be within their budgets.
      module subroutine set_budgets(self, scene, error)
         class(model_t), intent(inout) :: self
         type(scene_t), intent(in) :: scene
         type(error_t), intent(inout) :: error
      end subroutine set_budgets
      !> Collective: create the blocks that the bodies need, each on its rank, and the particles in them; none
      !> if `empty`. A box of atoms is built in any case.
      module subroutine populate(self, scene, error, empty)
         class(model_t), intent(inout) :: self
         type(scene_t), intent(in) :: scene
         type(error_t), intent(inout) :: error
         logical, intent(in), optional :: empty
      end subroutine populate
      !> Collective: create the missing blocks that emigrants of the only level have entered.
      module subroutine create_blocks(self)
         class(model_t), intent(inout) :: self
      end subroutine create_blocks
      !> Collective: with several levels, create the blocks that particles may enter before the end of the
      !> next step, on their own level, in the finer one's region or out of their own, and the parents of
      !> blocks with constrained nodes. No blocks are removed here: within a step of the coarsest level all
      !> stay.
      module subroutine prepare_blocks(self, edges_moved)
         class(model_t), intent(inout) :: self
         logical, intent(in), optional :: edges_moved !< the blocks with constrained nodes have changed: all
                                                      !< parents are searched again
      end subroutine prepare_blocks
      !> Mark the blocks that contain particles of a level within a box or, with several levels, that these
      !> may enter before the end of the next step.
      module subroutine mark_around(self, l, field, lowest, highest, wanted)
         class(model_t), intent(in) :: self
         integer, intent(in) :: l, field
         real(wp), intent(in) :: lowest(3), highest(3) !< m
         logical, intent(inout) :: wanted(:) !< by number
      end subroutine mark_around
      !> Collective: redistribute the blocks by their present contents, if that pays within `steps` steps of
      !> the coarsest level; without `steps`, as if no block had an owner. A single level loses its empty
      !> blocks; with several levels all stay: the set of blocks determines the order in which constrained
      !> nodes are restricted, and must not depend on the number of ranks.
      module subroutine rebalance(self, error, steps)
         class(model_t), intent(inout) :: self
         type(error_t), intent(inout) :: error
         integer, intent(in), optional :: steps
      end subroutine rebalance
   end interface

contains

   !> True when particles' velocities are mixed with the grid's (PIC): edges of levels have no time labels
   !> then (theory.md, eq. half-steps-pic).
   pure logical function mixes(self)
      class(model_t), intent(in) :: self
      integer :: e
      mixes = self%method%flip_fraction < 1.0_wp
      do e = 1, size(self%effects)
         mixes = mixes .or. self%effects(e)%effect%null_space_damping(1.0_wp) > 0.0_wp
      end do
   end function mixes

   !> Share of the null-space velocity that remains after a step (theory.md, eq. unseen): the same on all
   !> levels, as their exchange requires one share.
   pure real(wp) function share_of_unseen(self, time_step) result(share)
      class(model_t), intent(in) :: self
      real(wp), intent(in) :: time_step !< of the coarsest level, s
      real(wp) :: crossings, step
      integer :: e
      step = time_step/maxval(self%steps_of_levels())
      crossings = self%bounds%wave_speed/self%levels(size(self%levels))%grid%cell
      share = 1.0_wp
      do e = 1, size(self%effects)
         share = share*max(0.0_wp, 1.0_wp - step*self%effects(e)%effect%null_space_damping(crossings))
      end do
   end function share_of_unseen

   !> Blocks with constrained nodes (values of at least 0) need their parents too: missing ones get 0, no
   !> particles or rank 0.
   subroutine add_parents(levels, values)
      type(level_t), intent(in) :: levels(:)
      integer, intent(inout) :: values(:) !< one per block of each level, as from count_particles or
                                          !< all_owners
      integer :: field, index, l, parent, place(3)
      do l = size(levels), 2, -1
         do index = 1, levels(l)%grid%block_count()
            if (values(blocks_before(levels, l) + index) < 0) cycle
            place = levels(l)%grid%block_place(index)
            if (.not. has_constrained(levels(l)%region, place)) cycle
            field = levels(l)%grid%block_field(index)
            parent = blocks_before(levels, l - 1) + levels(l - 1)%grid%block_index(place/2, field)
            if (values(parent) < 0) values(parent) = 0
         end do
      end do
   end subroutine add_parents

   !> Collective: adapt blocks, ghosts, pools and messages to the owners.
   subroutine connect(self)
      class(model_t), intent(inout) :: self
      integer :: l
      do l = 1, size(self%levels)
         call settle_blocks(self%levels(l), self%communicator%rank)
         call self%exchange(l)%build(self%communicator, self%levels(l))
         if (self%contact%active()) call self%levels(l)%near%connect(self%communicator)
      end do
      do l = 2, size(self%levels)
         call self%composite(l)%build(self%communicator, self%levels(l - 1), self%levels(l))
         if (allocated(self%levels(l)%layer)) call join_cells(self%levels(l))
      end do
   end subroutine connect

   !> After regions have been set: set the layers around them, where means over cells are taken.
   subroutine place_layers(self)
      class(model_t), intent(inout) :: self
      call set_layers(self%levels, size(self%effect_step(1)%on_cells) > 0)
   end subroutine place_layers

   !> Number of steps of each level in one of the coarsest.
   pure function steps_of_levels(self) result(steps)
      class(model_t), intent(in) :: self
      integer :: steps(size(self%levels)), l
      steps = [(2**merge(l - 1, 0, self%method%subcycle), l=1, size(self%levels))]
   end function steps_of_levels

   !> Collective: add the accumulated values of blocks to the totals, by their numbers. To be called before
   !> blocks change rank.
   subroutine reduce_accumulated(self)
      class(model_t), intent(inout) :: self
      integer :: b, l
      do l = 1, size(self%levels)
         call self%effect_step(l)%reduce_accumulated(self%communicator)
      end do
      if (size(self%levels) == 1 .and. .not. any(self%effect_step%erodes)) return
      call MPI_Allreduce(MPI_IN_PLACE, self%lost_in_merging, size(self%lost_in_merging), &
                         MPI_DOUBLE_PRECISION, MPI_SUM, self%communicator%comm)
      do b = 1, size(self%lost_in_merging)
         self%lost = self%lost + self%lost_in_merging(b)
      end do
      self%lost_in_merging = 0.0_wp
   end subroutine reduce_accumulated

   !> True when a level follows a contact group.
   pure logical function follows_groups(self)
      class(model_t), intent(in) :: self
      follows_groups = .false.
      if (allocated(self%level_specs)) &
         follows_groups = any(self%level_specs%follow > size(self%contact%tools))
   end function follows_groups

   !> Collective: centres of mass of the contact groups, m: (3, fields). Summed block by block, by the blocks'
   !> numbers: the same bits on any number of ranks.
   function centres_of_mass(self) result(centres)
      class(model_t), intent(in) :: self
      real(wp) :: centres(3, self%levels(1)%grid%fields)
      real(wp) :: parts(4, blocks_before(self%levels, size(self%levels) + 1))
      real(wp) :: total(4, size(centres, 2))
      integer :: axis, b, field, l
      parts = 0.0_wp
      do l = 1, size(self%levels)
         do b = 1, size(self%levels(l)%blocks)
            associate (block => self%levels(l)%blocks(b), at => self%levels(l)%layout, &
                       n => self%levels(l)%blocks(b)%particles%count)
               associate (part => parts(:, blocks_before(self%levels, l) + block%index), &
                          column => block%particles%column)
                  part(4) = sum(column(:n, at%mass))
                  do axis = 1, 3
                     part(axis) = dot_product(column(:n, at%mass), column(:n, at%position + axis - 1))
                  end do
               end associate
            end associate
         end do
      end do
      call MPI_Allreduce(MPI_IN_PLACE, parts, size(parts), MPI_DOUBLE_PRECISION, MPI_SUM, &
                         self%communicator%comm)
      total = 0.0_wp
      do l = 1, size(self%levels)
         do b = 1, self%levels(l)%grid%block_count()
            field = self%levels(l)%grid%block_field(b)
            total(:, field) = total(:, field) + parts(:, blocks_before(self%levels, l) + b)
         end do
      end do
      centres = total(:3, :)/spread(max(total(4, :), tiny(1.0_wp)), 1, 3)
   end function centres_of_mass

   !> Particles on this rank.
   pure integer(i8) function particle_count(self)
      class(model_t), intent(in) :: self
      integer :: l
      particle_count = 0
      do l = 1, size(self%levels)
         particle_count = particle_count + self%levels(l)%particle_count()
      end do
   end function particle_count

   !> The cell size (m) that limits the time step of the coarsest level: its own with subcycling; else that of
   !> the finest.
   pure real(wp) function stepped_cell(self)
      class(model_t), intent(in) :: self
      stepped_cell = self%levels(merge(1, size(self%levels), self%method%subcycle))%grid%cell
   end function stepped_cell

   !> Speed (m/s) of the fastest wave of the grid: that of the material, times the factors of effects.
   pure real(wp) function wave_speed(self)
      class(model_t), intent(in) :: self
      integer :: e
      wave_speed = self%bounds%wave_speed
      do e = 1, size(self%effects)
         wave_speed = wave_speed &
                      *self%effects(e)%effect%wave_factor(self%bounds%particle_speed/self%bounds%wave_speed)
      end do
   end function wave_speed

   !> Free MPI and PETSc objects.
   subroutine release(self)
      class(model_t), intent(inout) :: self
      integer :: l
      if (.not. allocated(self%levels)) return
      do l = 1, size(self%levels)
         call self%exchange(l)%release()
         call self%migration(l)%release()
      end do
      do l = 1, size(self%composite)
         call self%composite(l)%release()
      end do
      call self%contact%release()
   end subroutine release

end module m_model
