!> Damping of the motion of nodes, and of particle velocities in the null space of the nodes, to bring a body
!> to rest (theory.md, eqs damping, unseen).
module m_damping
   use m_kinds, only: wp
   use m_constants, only: exit_input
   use m_errors, only: error_t, fail
   use m_node_values, only: v_x, v_z, a_x, a_z
   use m_communicator, only: communicator_t
   use m_level, only: level_t
   use m_effect, only: effect_t, hooks_t
   use m_field_table, only: field_table_t
   use m_group_reader, only: group_reader_t
   use m_value_range, only: range_t, at_least
   use m_section, only: section_t
   implicit none
   private
   public :: damping_t

   integer, parameter :: kind_local = 1, kind_viscous = 2
   real(wp), parameter :: at_most = 0.2_wp !< of the velocity per step: stable with waves at any safety
                                           !< (theory.md, Time step)
   character(len=*), parameter :: kind_words(2) = [character(len=7) :: 'local', 'viscous']

   type, extends(effect_t) :: damping_t
      integer :: kind = kind_local
      real(wp) :: coefficient = 0.0_wp !< local: 1; viscous: 1/s
      integer, private :: heat = 0     !< column
   contains
      procedure :: take_section
      procedure :: variables
      procedure :: declare
      procedure :: hooks
      procedure :: verify
      procedure :: longest_step
      procedure :: null_space_damping
      procedure :: dissipated
      procedure :: on_nodes
   end type damping_t

contains

   subroutine variables(self, group)
      class(damping_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      type(range_t) :: range
      call group%get_choice('kind', self%kind, kind_words, required=.true.)
      range = at_least(0.0_wp, '', below=1.0_wp)
      if (self%kind == kind_viscous) range = at_least(0.0_wp, '1/s')
      call group%get('coefficient', self%coefficient, range, required=.true.)
   end subroutine variables

   subroutine declare(self, table)
      class(damping_t), intent(inout) :: self
      type(field_table_t), intent(inout) :: table
      call table%declare('unseen_heat', 1, 'J', written=.false., extensive=.true.)
      self%heat = table%column('unseen_heat')
   end subroutine declare

   pure type(hooks_t) function hooks(self)
      class(damping_t), intent(in) :: self
      hooks = hooks_t(on_nodes=.true., dissipates=.true.)
   end function hooks

   !> Local damping must not be combined with tools: it would act on the contact force as on an unbalanced
   !> force, and increase every load by the damped share. Applied after contact it would undo the contact
   !> solution, and the tool would chatter.
   subroutine verify(self, communicator, levels, tools, error)
      class(damping_t), intent(in) :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(in) :: levels(:)
      integer, intent(in) :: tools
      type(error_t), intent(inout) :: error
      if (self%kind == kind_local .and. tools > 0 .and. self%coefficient > 0.0_wp) &
         call fail(error, exit_input, self%group_text()// &
                   ' kind=''local'': not supported with a &tool, whose load it would change; allowed: '// &
                      'viscous')
   end subroutine verify

   !> The step in which the limit of damped velocity is reached.
   pure real(wp) function longest_step(self)
      class(damping_t), intent(in) :: self
      longest_step = huge(1.0_wp)
      if (self%kind == kind_viscous .and. self%coefficient > 0.0_wp) longest_step = at_most/self%coefficient
   end function longest_step

   !> Local damping reduces each mode by a share per period; null-space modes have the length of a cell.
   pure real(wp) function null_space_damping(self, crossings)
      class(damping_t), intent(in) :: self
      real(wp), intent(in) :: crossings
      null_space_damping = self%coefficient
      if (self%kind == kind_local) null_space_damping = self%coefficient*crossings
   end function null_space_damping

   pure real(wp) function dissipated(self, column, first, last)
      class(damping_t), intent(in) :: self
      real(wp), intent(in), contiguous :: column(:, :)
      integer, intent(in) :: first, last
      dissipated = sum(column(first:last, self%heat))
   end function dissipated

   !> a <- a - c |a| sign(v) for each component, or a <- a - c v; v is the velocity at the beginning of the
   !> step.
   pure subroutine on_nodes(self, time, time_step, tile)
      class(damping_t), intent(in) :: self
      real(wp), intent(in) :: time, time_step
      real(wp), intent(inout), contiguous :: tile(:, 0:, 0:, 0:)
      real(wp) :: before(3), change(3)
      integer :: i, j, k
      do k = 0, ubound(tile, 4)
         do j = 0, ubound(tile, 3)
            do i = 0, ubound(tile, 2)
               before = tile(v_x:v_z, i, j, k) - time_step*tile(a_x:a_z, i, j, k)
               if (self%kind == kind_local) then
                  change = -self%coefficient*sign(abs(tile(a_x:a_z, i, j, k)), before)
                  where (.not. abs(before) > 0.0_wp) change = 0.0_wp ! no direction to oppose at rest
               else
                  change = -self%coefficient*before
               end if
               tile(a_x:a_z, i, j, k) = tile(a_x:a_z, i, j, k) + change
               tile(v_x:v_z, i, j, k) = tile(v_x:v_z, i, j, k) + time_step*change
            end do
         end do
      end do
   end subroutine on_nodes

   !> The same in any section.
   subroutine take_section(self, section, why)
      class(damping_t), intent(inout) :: self
      type(section_t), intent(in) :: section
      character(len=:), allocatable, intent(out) :: why
      why = ''
   end subroutine take_section

end module m_damping
