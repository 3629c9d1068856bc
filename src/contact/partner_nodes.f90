!> Masses and velocities of the nodes on which forces on other bodies act, wherever their tiles are.
module m_partner_nodes
   use m_kinds, only: wp
   use m_node_values, only: mass_, v_x, v_z
   use m_level, only: level_t
   use m_partner_exchange, only: partner_exchange_t, numbers_each
   implicit none
   private
   public :: wanted_nodes_t

   integer, parameter :: values_each = 4  !< mass (kg), velocity (m/s)

   !> Requested nodes, in any order, with repetitions.
   type :: wanted_nodes_t
      integer :: count = 0
      integer, allocatable :: node(:, :)    !< (4, nodes): place from -1 on, field
      real(wp), allocatable :: values(:, :) !< (4, nodes); 0 for a node without block
      type(partner_exchange_t), private :: exchange
   contains
      procedure :: clear
      procedure :: want
      procedure :: fetch
   end type wanted_nodes_t

contains

   subroutine clear(self)
      class(wanted_nodes_t), intent(inout) :: self
      self%count = 0
      if (.not. allocated(self%node)) allocate (self%node(numbers_each, 256))
   end subroutine clear

   !> Request one more node; its number is `count` then.
   subroutine want(self, place, field)
      class(wanted_nodes_t), intent(inout) :: self
      integer, intent(in) :: place(3), field
      integer, allocatable :: more(:, :)
      if (self%count == size(self%node, 2)) then
         allocate (more(numbers_each, 2*self%count))
         more(:, :self%count) = self%node
         call move_alloc(more, self%node)
      end if
      self%count = self%count + 1
      self%node(:, self%count) = [place, field]
   end subroutine want

   !> Collective among near ranks: read the values of all nodes.
   subroutine fetch(self, level)
      class(wanted_nodes_t), intent(inout) :: self
      type(level_t), intent(in) :: level
      if (allocated(self%values)) deallocate (self%values)
      allocate (self%values(values_each, self%count))
      call self%exchange%build(level, self%node(:, :self%count))
      call self%exchange%read(level%nodes, [mass_, v_x, v_x + 1, v_z], self%values)
   end subroutine fetch

end module m_partner_nodes
