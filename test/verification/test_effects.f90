!> Effects that only the tests know, one a hook.
module m_test_effects
   use m_kinds, only: wp
   use m_block, only: block_t
   use m_cell_list, only: cell_list_t
   use m_effect, only: effect_t, hooks_t
   use m_field_table, only: field_table_t, layout_t
   use m_grid_level, only: grid_level_t
   use m_group_reader, only: group_reader_t
   use m_particle_store, only: particle_store_t
   implicit none
   private
   public :: body_force_t, tile_force_t, rigid_t, counter_t

   !> No scene calls for these by name.
   type, abstract, extends(effect_t) :: unnamed_t
   contains
      procedure :: variables => no_variables
   end type unnamed_t

   !> Gravity as a body force of the particles.
   type, extends(unnamed_t) :: body_force_t
      real(wp) :: field(3) = 0.0_wp !< m/s2
   contains
      procedure :: hooks => body_force_hooks
      procedure :: acceleration => add_field
   end type body_force_t

   !> Gravity as forces on what a block gives to its nodes.
   type, extends(unnamed_t) :: tile_force_t
      real(wp) :: field(3) = 0.0_wp !< m/s2
   contains
      procedure :: hooks => tile_force_hooks
      procedure :: add_forces => add_weight
   end type tile_force_t

   !> Strains nothing.
   type, extends(unnamed_t) :: rigid_t
   contains
      procedure :: hooks => rigid_hooks
      procedure :: on_gradient => make_rigid
   end type rigid_t

   !> Counts the steps of each particle, from 5.
   type, extends(unnamed_t) :: counter_t
      integer :: column = 0
   contains
      procedure :: hooks => counter_hooks
      procedure :: declare => declare_count
      procedure :: initialise => begin_count
      procedure :: on_stress => count_step
   end type counter_t

contains

   subroutine no_variables(self, group)
      class(unnamed_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
   end subroutine no_variables

   pure type(hooks_t) function body_force_hooks(self) result(hooks)
      class(body_force_t), intent(in) :: self
      hooks = hooks_t(acceleration=.true.)
   end function body_force_hooks

   pure subroutine add_field(self, particles, table, layout, time, body_force)
      class(body_force_t), intent(in) :: self
      type(particle_store_t), intent(in) :: particles
      type(field_table_t), intent(in) :: table
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: time
      real(wp), intent(inout) :: body_force(:, :)
      integer :: axis
      do axis = 1, 3
         body_force(:particles%count, axis) = body_force(:particles%count, axis) + self%field(axis)
      end do
   end subroutine add_field

   pure type(hooks_t) function tile_force_hooks(self) result(hooks)
      class(tile_force_t), intent(in) :: self
      hooks = hooks_t(add_forces=.true.)
   end function tile_force_hooks

   pure subroutine add_weight(self, block, table, layout, grid, time, window, tile)
      class(tile_force_t), intent(in) :: self
      type(block_t), intent(in) :: block
      type(field_table_t), intent(in) :: table
      type(layout_t), intent(in) :: layout
      type(grid_level_t), intent(in) :: grid
      real(wp), intent(in) :: time, window
      real(wp), intent(inout), contiguous :: tile(:, 0:, 0:, 0:)
      integer :: axis
      do axis = 1, 3
         tile(4 + axis, :, :, :) = tile(4 + axis, :, :, :) + tile(1, :, :, :)*self%field(axis)
      end do
   end subroutine add_weight

   pure type(hooks_t) function rigid_hooks(self) result(hooks)
      class(rigid_t), intent(in) :: self
      hooks = hooks_t(on_gradient=.true.)
   end function rigid_hooks

   pure subroutine make_rigid(self, cells, particles, layout, time_step, gradient)
      class(rigid_t), intent(in) :: self
      type(cell_list_t), intent(in) :: cells
      type(particle_store_t), intent(in) :: particles
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: time_step
      real(wp), intent(inout), contiguous :: gradient(:, :)
      gradient(:particles%count, :) = 0.0_wp
   end subroutine make_rigid

   pure type(hooks_t) function counter_hooks(self) result(hooks)
      class(counter_t), intent(in) :: self
      hooks = hooks_t(on_stress=.true.)
   end function counter_hooks

   subroutine declare_count(self, table)
      class(counter_t), intent(inout) :: self
      type(field_table_t), intent(inout) :: table
      call table%declare('count_of_the_tests', 1, '1', written=.false.)
      self%column = table%column('count_of_the_tests')
   end subroutine declare_count

   subroutine begin_count(self, particles, table, layout, grid)
      class(counter_t), intent(in) :: self
      type(particle_store_t), intent(inout) :: particles
      type(field_table_t), intent(in) :: table
      type(layout_t), intent(in) :: layout
      type(grid_level_t), intent(in) :: grid
      particles%column(:particles%count, self%column) = 5.0_wp
   end subroutine begin_count

   pure subroutine count_step(self, particles, layout, gradient, cell, time_step)
      class(counter_t), intent(in) :: self
      type(particle_store_t), intent(inout) :: particles
      type(layout_t), intent(in) :: layout
      real(wp), intent(in), contiguous :: gradient(:, :)
      real(wp), intent(in) :: cell, time_step
      particles%column(:particles%count, self%column) = particles%column(:particles%count, self%column) &
         + 1.0_wp
   end subroutine count_step

end module m_test_effects
