!> The other bodies of the points between contact groups in a quasi-static step: nodes and weights of the far
!> side, wherever their tiles are; their displacements under a trial displacement, and forces on them.
module m_static_pairs
   use m_kinds, only: wp, i8
   use m_node_values, only: mass_, v_x, v_z, f_x, f_z
   use m_level, only: level_t
   use m_contact_point, only: partner_t
   use m_contact_nodes, only: contact_nodes_t
   use m_contact_rows, only: inside_of
   use m_partner_exchange, only: partner_exchange_t
   implicit none
   private
   public :: static_pairs_t

   type :: static_pairs_t
      logical :: active = .false.              !< the scene has contact groups
      integer :: count = 0                     !< points
      type(partner_t), allocatable :: partners(:)
      integer, allocatable :: begins(:)        !< (count + 1): first entry of each point's nodes, x fastest
      integer, allocatable :: node(:)          !< (entries): numbers of the nodes
      type(contact_nodes_t), private :: nodes
      type(partner_exchange_t), private :: exchange
      real(wp), allocatable, private :: motion(:, :) !< (3, nodes): displacements of the last `look`, m
      real(wp), allocatable, private :: given(:, :)  !< (3, nodes): forces, or other contributions to the
                                                     !< nodes
   contains
      procedure :: connect
      procedure :: read_motion
      procedure :: way
      procedure :: push
      procedure :: give
   end type static_pairs_t

   integer, parameter :: as_motion(3) = [v_x, v_x + 1, v_z], as_force(3) = [f_x, f_x + 1, f_z]

contains

   !> Collective among near ranks: set the partners that are the points' far sides in a step. Partners get the
   !> masses of their nodes, which the level's nodes hold.
   subroutine connect(self, level, partners)
      class(static_pairs_t), intent(inout) :: self
      type(level_t), intent(in) :: level
      type(partner_t), intent(in) :: partners(:)
      integer :: place(0:2, 3, size(partners)), last(size(partners))
      real(wp), allocatable :: mass(:, :)
      integer :: i, j, k, n, s
      self%count = size(partners)
      self%partners = partners
      do n = 1, self%count
         place(:, :, n) = inside_of(level, partners(n)%face%corner)
         last(n) = partners(n)%face%last
      end do
      self%begins = [1, [(1 + sum((last(:n) + 1)**3), n=1, self%count)]]
      if (allocated(self%node)) deallocate (self%node)
      allocate (self%node(self%begins(self%count + 1) - 1))
      self%nodes%extent = [level%grid%cells + 3, level%grid%fields]
      self%nodes%count = 0
      self%nodes%grid_node = [integer(i8) ::]
      if (self%count > 0) call self%nodes%number_all(place, last, partners%field, self%node)
      associate (numbers => self%nodes%grid_node(:self%nodes%count))
         call self%exchange%build(level, reshape([([self%nodes%place_of(numbers(n)), &
            self%nodes%field_of(numbers(n))], n=1, self%nodes%count)], [4, self%nodes%count]))
      end associate
      if (allocated(self%motion)) deallocate (self%motion, self%given)
      allocate (self%motion(3, self%nodes%count), self%given(3, self%nodes%count), source=0.0_wp)
      allocate (mass(1, self%nodes%count))
      call self%exchange%read(level%nodes, [mass_], mass)
      do n = 1, self%count
         s = self%begins(n)
         do k = 0, last(n)
            do j = 0, last(n)
               do i = 0, last(n)
                  self%partners(n)%mass(i, j, k) = mass(1, self%node(s))
                  s = s + 1
               end do
            end do
         end do
      end do
   end subroutine connect

   !> Collective among near ranks: read the displacements of the far sides' nodes from tiles.
   subroutine read_motion(self, tiles)
      class(static_pairs_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: tiles(:, 0:, 0:, 0:, :) !< in v_x to v_z, m
      if (self%active) call self%exchange%read(tiles, as_motion, self%motion)
   end subroutine read_motion

   !> Displacement of the far side of a point by the last `look`, m.
   pure function way(self, n) result(u)
      class(static_pairs_t), intent(in) :: self
      integer, intent(in) :: n
      real(wp) :: u(3)
      integer :: i, j, k, s
      u = 0.0_wp
      s = self%begins(n)
      associate (it => self%partners(n))
         do k = 0, it%face%last
            do j = 0, it%face%last
               do i = 0, it%face%last
                  u = u + it%face%weight(i, j, k)*self%motion(:, self%node(s))
                  s = s + 1
               end do
            end do
         end do
         u = it%reflection*u
      end associate
   end function way

   !> Add a load on a point's far side to its nodes: a force (N) by their weights, or, with power 2, a part of
   !> the stiffness's diagonal (N/m) by their squares.
   pure subroutine push(self, n, value, power)
      class(static_pairs_t), intent(inout) :: self
      integer, intent(in) :: n
      real(wp), intent(in) :: value(3)
      integer, intent(in) :: power
      integer :: i, j, k, s
      s = self%begins(n)
      associate (it => self%partners(n))
         do k = 0, it%face%last
            do j = 0, it%face%last
               do i = 0, it%face%last
                  self%given(:, self%node(s)) = self%given(:, self%node(s)) &
                                                + (it%face%weight(i, j, k)*it%reflection)**power*value
                  s = s + 1
               end do
            end do
         end do
      end associate
   end subroutine push

   !> Collective among near ranks: add the accumulated loads to tiles, each node's to one.
   subroutine give(self, tiles)
      class(static_pairs_t), intent(inout) :: self
      real(wp), intent(inout), contiguous :: tiles(:, 0:, 0:, 0:, :) !< in f_x to f_z
      if (.not. self%active) return
      call self%exchange%add(self%given, as_force, tiles)
      self%given = 0.0_wp
   end subroutine give

end module m_static_pairs
