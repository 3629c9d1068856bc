!> Another model of matter that a scene embeds in its finest level: atoms (coupling.f90). It takes steps of
!> its own within each step of that level, and exchanges impulses with nodes and tools.
module m_embedded_model
   use m_kinds, only: wp
   use m_communicator, only: communicator_t
   use m_errors, only: error_t
   use m_level, only: level_t
   use m_tool, only: tool_t
   use m_tool_reactions, only: reaction_t
   implicit none
   private

   !> Its sums, which count with those of the particles: numbers alone.
   type, public :: embedded_sums_t
      sequence
      real(wp) :: mass = 0.0_wp                !< kg
      real(wp) :: kinetic = 0.0_wp             !< J
      real(wp) :: potential = 0.0_wp           !< since the start, with what the repulsion of tools stores, J
      real(wp) :: taken = 0.0_wp               !< energy taken out (quenching, drag, thermostat), J
      real(wp) :: momentum(3) = 0.0_wp         !< kg m/s
      real(wp) :: angular_momentum(3) = 0.0_wp !< about the origin, kg m2/s
   end type embedded_sums_t

   integer, parameter, public :: embedded_reals = storage_size(embedded_sums_t())/storage_size(1.0_wp)

   type, abstract, public :: embedded_model_t
      type(embedded_sums_t) :: sums                !< at the end of its last step, the same on all ranks
      integer :: timer = 0                         !< row of the timers
      real(wp) :: work = 0.0_wp                    !< that it has done on the continuum, J
      real(wp) :: tool_work = 0.0_wp               !< that tools have done on it, J
      real(wp) :: tool_work_in_balance = 0.0_wp    !< the same as the tools' own balance has it, J
      character(len=:), allocatable :: note        !< for the first lines of a run
   contains
      procedure(couple_interface), deferred :: couple
      procedure(push_interface), deferred :: push_tools
      procedure(contact_interface), deferred :: follow_contact
      procedure(accumulate_interface), deferred :: accumulate
      procedure(get_interface), deferred :: get_state
      procedure(set_interface), deferred :: set_state
      procedure(row_interface), deferred :: row
      procedure(file_interface), deferred :: file
   end type embedded_model_t

   abstract interface
      !> Collective: go through a step of the finest level, whose nodes have been solved without this model;
      !> its impulses change the motion of the nodes.
      subroutine couple_interface(self, communicator, level, is_nested, tools, time, time_step, error)
         import :: embedded_model_t, communicator_t, level_t, tool_t, error_t, wp
         class(embedded_model_t), intent(inout) :: self
         type(communicator_t), intent(in) :: communicator
         type(level_t), intent(inout) :: level
         logical, intent(in) :: is_nested        !< there is a coarser level
         type(tool_t), intent(in) :: tools(:)    !< as the step before has left them
         real(wp), intent(in) :: time, time_step !< s
         type(error_t), intent(inout) :: error
      end subroutine couple_interface

      !> Add the forces and moments of the step on the tools to the reactions of this rank.
      subroutine push_interface(self, reactions, time_step)
         import :: embedded_model_t, reaction_t, wp
         class(embedded_model_t), intent(in) :: self
         type(reaction_t), intent(inout) :: reactions(:) !< (tools)
         real(wp), intent(in) :: time_step               !< s
      end subroutine push_interface

      !> Collective: the contact problem has changed the motion of the nodes, or not.
      subroutine contact_interface(self, communicator, level, changed)
         import :: embedded_model_t, communicator_t, level_t
         class(embedded_model_t), intent(inout) :: self
         type(communicator_t), intent(in) :: communicator
         type(level_t), intent(in) :: level
         logical, intent(in) :: changed !< the same on all ranks
      end subroutine contact_interface

      !> Add the work of the tools in the step, once these have moved.
      subroutine accumulate_interface(self, tools)
         import :: embedded_model_t, tool_t
         class(embedded_model_t), intent(inout) :: self
         type(tool_t), intent(in) :: tools(:)
      end subroutine accumulate_interface

      !> What the next step reads besides particles and tools, for a checkpoint: places and velocities (in
      !> units of the model), what contact adds to speeds (m/s), and sums; zeros on other ranks than 0.
      subroutine get_interface(self, x, v, pushes, sums)
         import :: embedded_model_t, wp
         class(embedded_model_t), intent(in) :: self
         real(wp), allocatable, intent(out) :: x(:, :), v(:, :), pushes(:, :), sums(:)
      end subroutine get_interface

      subroutine set_interface(self, x, v, pushes, sums)
         import :: embedded_model_t, wp
         class(embedded_model_t), intent(inout) :: self
         real(wp), intent(in) :: x(:, :), v(:, :), pushes(:, :), sums(:)
      end subroutine set_interface

      !> A row of its history. Zeros on other ranks than 0.
      function row_interface(self) result(values)
         import :: embedded_model_t, wp
         class(embedded_model_t), intent(inout) :: self
         real(wp), allocatable :: values(:)
      end function row_interface

      !> Name of one of its files.
      pure function file_interface(self, ending) result(name)
         import :: embedded_model_t
         class(embedded_model_t), intent(in) :: self
         character(len=*), intent(in) :: ending
         character(len=:), allocatable :: name
      end function file_interface
   end interface

end module m_embedded_model
