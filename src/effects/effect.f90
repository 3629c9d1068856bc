!> Interface of an optional effect. An effect is one file that extends effect_t, and one line in effects.f90;
!> a scene without it has no cost.
module m_effect
   use m_kinds, only: wp
   use m_block, only: block_t
   use m_face_weights, only: face_weights_t
   use m_cell_list, only: cell_list_t
   use m_communicator, only: communicator_t
   use m_errors, only: error_t
   use m_field_table, only: field_table_t, layout_t
   use m_grid_level, only: grid_level_t
   use m_level, only: level_t
   use m_scene_materials, only: materials_t
   use m_scene, only: body_spec_t
   use m_offer, only: offer_t
   use m_particle_store, only: particle_store_t
   use m_section, only: section_t
   use m_stencil, only: frame_t
   implicit none
   private
   public :: effect_t, effect_slot_t, hooks_t

   !> The procedures of an effect to be called during a step.
   type :: hooks_t
      logical :: acceleration = .false.
      logical :: add_forces = .false.
      logical :: on_nodes = .false.
      logical :: on_cells = .false.
      logical :: on_gradient = .false.
      logical :: on_stress = .false.
      logical :: acts_at_rest = .false. !< changes material that is at rest and free of stress: no block may
                                        !< be skipped
      logical :: erodes = .false.     !< particles with damage 1 (layout_t) are removed from the model
      logical :: dissipates = .false. !< its work on nodes counts as damped energy, not as external work
      logical :: follows_particles = .false. !< particle_work and potential give all of its external work by
                                             !< the motion of particles
   end type hooks_t

   type, abstract, extends(offer_t) :: effect_t
   contains
      procedure(hooks_interface), deferred :: hooks
      procedure :: take_section
      procedure :: declare
      procedure :: prepare
      procedure :: initialise
      procedure :: cover
      procedure :: verify
      procedure :: wave_factor
      procedure :: longest_step
      procedure :: null_space_damping
      procedure :: turning_times
      procedure :: dissipated
      procedure :: summary
      procedure :: pushed
      procedure :: particle_work
      procedure :: potential
      procedure :: acceleration
      procedure :: uniform_acceleration
      procedure :: add_forces
      procedure :: face_of
      procedure :: force_after
      procedure :: on_nodes
      procedure :: on_cells
      procedure :: on_gradient
      procedure :: on_stress
   end type effect_t

   !> One effect of a scene; an array of effects of different type.
   type :: effect_slot_t
      class(effect_t), allocatable :: effect
      integer :: columns = 0 !< number of columns of the field table that it was the first to declare
      integer :: row = 0     !< of the timers
   end type effect_slot_t

   abstract interface
      !> Called once, when the model is built.
      pure type(hooks_t) function hooks_interface(self)
         import :: effect_t, hooks_t
         class(effect_t), intent(in) :: self
      end function hooks_interface
   end interface

   ! By default all other procedures do nothing.

contains

   !> Overridden by effects that support sections.
   subroutine take_section(self, section, why)
      class(effect_t), intent(inout) :: self
      type(section_t), intent(in) :: section
      character(len=:), allocatable, intent(out) :: why
      why = 'not with geometry='''//section%word()//''' yet; allowed in 3D'
   end subroutine take_section

   !> Declare the particle fields that the effect needs. Their columns do not change afterwards: the effect
   !> may store `table%column(name)`.
   subroutine declare(self, table)
      class(effect_t), intent(inout) :: self
      type(field_table_t), intent(inout) :: table
   end subroutine declare

   !> Read data of grid and materials; called once, before bodies are filled.
   subroutine prepare(self, grid, materials)
      class(effect_t), intent(inout) :: self
      type(grid_level_t), intent(in) :: grid
      type(materials_t), intent(in) :: materials
   end subroutine prepare

   !> Set initial values of its fields in a block that has just been filled; they are zero before.
   subroutine initialise(self, particles, table, layout, grid)
      class(effect_t), intent(in) :: self
      type(particle_store_t), intent(inout) :: particles
      type(field_table_t), intent(in) :: table
      type(layout_t), intent(in) :: layout
      type(grid_level_t), intent(in) :: grid
   end subroutine initialise

   !> Read data from the shape of a body that has just been filled in a block, and of those beside it.
   subroutine cover(self, particles, first, bodies, body, cells, layout, grid)
      class(effect_t), intent(in) :: self
      type(particle_store_t), intent(inout) :: particles
      integer, intent(in) :: first !< first of the body's particles, which are the last ones
      type(body_spec_t), intent(in) :: bodies(:) !< all of the scene
      integer, intent(in) :: body !< number of this one
      real(wp), intent(in) :: cells(:, :) !< (4, the body's particles): middle and half edge of their lattice
                                          !< sites, m
      type(layout_t), intent(in) :: layout
      type(grid_level_t), intent(in) :: grid
   end subroutine cover

   !> Collective, when all bodies are filled: an error if the effect cannot act on this model as its group
   !> requires.
   subroutine verify(self, communicator, levels, tools, error)
      class(effect_t), intent(in) :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(in) :: levels(:)
      integer, intent(in) :: tools !< number of tools in the scene
      type(error_t), intent(inout) :: error
   end subroutine verify

   !> Factor on the speed of the fastest wave of the grid due to the effect, at least 1: it shortens the time
   !> step.
   pure real(wp) function wave_factor(self, mach)
      class(effect_t), intent(in) :: self
      real(wp), intent(in) :: mach !< speed of the fastest particle over that of the fastest wave
      wave_factor = 1.0_wp
   end function wave_factor

   !> Largest time step (s) for the effect, independent of waves.
   pure real(wp) function longest_step(self)
      class(effect_t), intent(in) :: self
      longest_step = huge(1.0_wp)
   end function longest_step

   !> Times (s) at which the loading of the effect changes: quasi-static steps end there.
   pure function turning_times(self) result(times)
      class(effect_t), intent(in) :: self
      real(wp), allocatable :: times(:)
      allocate (times(0))
   end function turning_times

   !> Damping rate (1/s) of the null-space part of the particles' velocities, 0 for none. Such an effect must
   !> declare the field unseen_heat, in which the step stores the dissipated energy.
   pure real(wp) function null_space_damping(self, crossings)
      class(effect_t), intent(in) :: self
      real(wp), intent(in) :: crossings !< cells of the finest level crossed by the fastest wave per second,
                                        !< 1/s
      null_space_damping = 0.0_wp
   end function null_space_damping

   !> Energy (J) dissipated by the effect in particles first..last so far, except through nodes (the model
   !> measures that).
   pure real(wp) function dissipated(self, column, first, last)
      class(effect_t), intent(in) :: self
      real(wp), intent(in), contiguous :: column(:, :)
      integer, intent(in) :: first, last
      dissipated = 0.0_wp
   end function dissipated

   !> Collective: a line for the closing summary; empty for none.
   function summary(self, communicator, levels) result(text)
      class(effect_t), intent(in) :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(in) :: levels(:)
      character(len=:), allocatable :: text
      text = ''
   end function summary

   !> Numbers of a block's particles on which add_forces acts.
   pure function pushed(self, particles) result(which)
      class(effect_t), intent(in) :: self
      type(particle_store_t), intent(in) :: particles
      integer, allocatable :: which(:)
      allocate (which(0))
   end function pushed

   !> Work (J) of the forces of add_forces on a block's particles in a step, by the particles' own motion: it
   !> must equal the work on the nodes (theory.md, Work).
   pure function particle_work(self, particles, which, layout, gradient, from, way_to, time, time_step, &
                               window) result(work)
      class(effect_t), intent(in) :: self
      type(particle_store_t), intent(in) :: particles
      integer, intent(in) :: which(:) !< particles on which the forces act
      type(layout_t), intent(in) :: layout
      real(wp), intent(in), contiguous :: gradient(:, :) !< (:, 9), 1/s
      real(wp), intent(in), contiguous :: from(:, :) !< (3, those particles), centres at the beginning of the
                                                     !< step, m
      integer, intent(in) :: way_to                      !< first column of the centres at the end of the step
      real(wp), intent(in) :: time                       !< s, of the beginning of the step
      real(wp), intent(in) :: time_step                  !< s
      real(wp), intent(in) :: window                     !< s, as in add_forces
      real(wp) :: work(2) !< with the mean of the forces at the step's beginning and end; part of it due to
                          !< half the force at its end
      work = 0.0_wp
   end function particle_work

   !> Potential energy (J) of particles first..last in a constant field of an effect, at their positions at
   !> the time of their velocities: its decrease is external work.
   pure real(wp) function potential(self, column, layout, first, last, lead) result(energy)
      class(effect_t), intent(in) :: self
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: first, last
      real(wp), intent(in) :: lead !< from the time of the velocities to that of the positions, s: half a step
      energy = 0.0_wp
   end function potential

   !> Uniform and constant acceleration (m/s2) of all material.
   pure function uniform_acceleration(self) result(field)
      class(effect_t), intent(in) :: self
      real(wp) :: field(3)
      field = 0.0_wp
   end function uniform_acceleration

   !> Add to the body force per mass (m/s2) of the block's particles at a time (s). Its work counts as
   !> external.
   pure subroutine acceleration(self, particles, table, layout, time, body_force)
      class(effect_t), intent(in) :: self
      type(particle_store_t), intent(in) :: particles
      type(field_table_t), intent(in) :: table
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: time
      real(wp), intent(inout) :: body_force(:, :) !< (:, 3)
   end subroutine acceleration

   !> Add forces (N, components 5 to 7 of a node) to the tile with the contributions of a block's own
   !> particles, before the sum over blocks; a force outside a symmetry plane is mirrored afterwards. Their
   !> work counts as external.
   pure subroutine add_forces(self, block, table, layout, grid, time, window, tile)
      class(effect_t), intent(in) :: self
      type(block_t), intent(in) :: block
      type(field_table_t), intent(in) :: table
      type(layout_t), intent(in) :: layout
      type(grid_level_t), intent(in) :: grid
      real(wp), intent(in) :: time   !< s, of the beginning of the step
      real(wp), intent(in) :: window !< s: the force is the mean of a given load from `time` on; the
                                     !< step in an explicit step, 0 (the load at `time`) in an implicit one
      real(wp), intent(inout), contiguous :: tile(:, 0:, 0:, 0:)
   end subroutine add_forces

   !> Weights of the nodes by which the force of add_forces on particle p of a block, one of `pushed`, acts.
   pure type(face_weights_t) function face_of(self, block, p, layout, grid) result(face)
      class(effect_t), intent(in) :: self
      type(block_t), intent(in) :: block
      integer, intent(in) :: p
      type(layout_t), intent(in) :: layout
      type(grid_level_t), intent(in) :: grid
   end function face_of

   !> That force at a time, after displacements of the particle with a gradient, N: loads on surfaces follow
   !> them within an implicit step.
   pure function force_after(self, column, gradient, time) result(force)
      class(effect_t), intent(in) :: self
      real(wp), intent(in) :: column(:)   !< of the particle at the step's beginning
      real(wp), intent(in) :: gradient(9) !< du/dX, component ij at 3 (j-1) + i
      real(wp), intent(in) :: time        !< s
      real(wp) :: force(3)
      force = 0.0_wp
   end function force_after

   !> Change the velocity at the end of the step (2 to 4) and the acceleration (5 to 7) of the solved nodes of
   !> a block, before boundary conditions. Change the whole tile, from a node's own values only: a node is in
   !> the tiles of several blocks, which must all get the same bits. Component 1 is the mass, which may be
   !> zero. The model measures the work.
   pure subroutine on_nodes(self, time, time_step, tile)
      class(effect_t), intent(in) :: self
      real(wp), intent(in) :: time      !< s, of the beginning of the step
      real(wp), intent(in) :: time_step !< s
      real(wp), intent(inout), contiguous :: tile(:, 0:, 0:, 0:)
   end subroutine on_nodes

   !> As on_gradient, and before it, with the sums over the particles of all blocks in the cells of the grid;
   !> costs an exchange per step. The effect must declare the field kept_gradient (9) if there is no
   !> velocity_gradient, or if there is an edge_stress: the step stores the gradients there.
   pure subroutine on_cells(self, cells, particles, layout, frame, sums, gradient)
      class(effect_t), intent(in) :: self
      type(cell_list_t), intent(in) :: cells
      type(particle_store_t), intent(inout) :: particles
      type(layout_t), intent(in) :: layout
      type(frame_t), intent(in) :: frame
      real(wp), intent(in), contiguous :: sums(:, 0:, 0:, 0:) !< at the cell's lowest node: volume, m3; volume
                                                              !< times tr L, m3/s; volume times p, J
      real(wp), intent(inout), contiguous :: gradient(:, :) !< (:, 9), 1/s
   end subroutine on_cells

   !> Change the velocity gradients (1/s, d v_i/d x_j at 3 (j-1) + i) that strain the particles of a block.
   !> Affine transfer keeps the unchanged ones.
   pure subroutine on_gradient(self, cells, particles, layout, time_step, gradient)
      class(effect_t), intent(in) :: self
      type(cell_list_t), intent(in) :: cells
      type(particle_store_t), intent(in) :: particles
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: time_step !< s
      real(wp), intent(inout), contiguous :: gradient(:, :) !< (:, 9)
   end subroutine on_gradient

   !> Change stress or own fields of the particles of a block, whose stress and volume have just been updated
   !> with `gradient`.
   pure subroutine on_stress(self, particles, layout, gradient, cell, time_step)
      class(effect_t), intent(in) :: self
      type(particle_store_t), intent(inout) :: particles
      type(layout_t), intent(in) :: layout
      real(wp), intent(in), contiguous :: gradient(:, :) !< (:, 9), 1/s
      real(wp), intent(in) :: cell      !< size of the cells of the particles' level, m
      real(wp), intent(in) :: time_step !< s
   end subroutine on_stress

end module m_effect
