!> The unknowns of an equilibrium: displacements of the free nodes of one level, each on one rank, and their
!> transfer to and from node tiles.
module m_static_nodes
   use m_kinds, only: wp
   use m_constants, only: block_size
   use m_node_values, only: tile_last, mass_
   use m_block, only: directions
   use m_level, only: level_t
   use m_boundary, only: held_components, inside
   implicit none
   private
   public :: static_nodes_t, is_own_node, tile_node

   !> Unknown n is component at(1, n) of the node at(2:4, n) of the tile of own block at(5, n).
   type :: static_nodes_t
      integer :: count = 0
      integer, allocatable :: at(:, :)
   contains
      procedure :: number
      procedure :: scatter
      procedure :: gather
   end type static_nodes_t

   real(wp), parameter :: light = 1.0e-6_wp !< of the largest mass: nodes with more mass are unknowns in any
                                            !< case

contains

   !> Number the free components of all nodes with mass that are not constrained by a coarser level: `nodes`
   !> of the level hold the sums of P2G. Light nodes without a filled cell are fixed: only the ghost penalty
   !> would support them. All nodes of a filled cell are unknowns, also where weights vanish by round-off: the
   !> ghost penalty would hold a body to a fixed one. Near the next finer level's edge all with mass are: what
   !> its constrained nodes restrict is as large as the stress of its particles, however light they are.
   subroutine number(self, level, filled, heaviest, finer)
      class(static_nodes_t), intent(inout) :: self
      type(level_t), intent(in) :: level
      logical, intent(in) :: filled(0:, 0:, 0:, :) !< the filled cells of the ghost penalty
      real(wp), intent(in) :: heaviest             !< largest mass of a node of the level, kg
      type(level_t), intent(in), optional :: finer !< the next one
      integer :: pass, b, i, j, k, axis, n, node(3)
      logical :: has_mass, held(3)
      do pass = 1, 2
         n = 0
         do b = 1, size(level%blocks)
            do k = 0, tile_last
               do j = level%grid%rows(1), level%grid%rows(2)
                  do i = 0, tile_last
                     has_mass = level%nodes(mass_, i, j, k, b) > 0.0_wp
                     if (.not. (has_mass .or. all([i, j, k] > 0))) cycle
                     if (.not. is_own_node(level, b, [i, j, k])) cycle
                     node = tile_node(level, b, [i, j, k])
                     if (any([(inside(level%grid, axis, node(axis)) /= node(axis), axis=1, 3)])) cycle
                     if (level%number > 1) then
                        if (.not. level%region%is_inner(node)) cycle
                     end if
                     if (level%nodes(mass_, i, j, k, b) <= light*heaviest) then
                        if (.not. (any_filled(filled(:, :, :, b), [i, j, k]) &
                                   .or. (has_mass .and. is_beside(node, finer)))) cycle
                     end if
                     held = held_components(level%grid, node)
                     do axis = 1, 3
                        if (held(axis)) cycle
                        n = n + 1
                        if (pass == 2) self%at(:, n) = [axis, i, j, k, b]
                     end do
                  end do
               end do
            end do
         end do
         if (pass == 2) return
         self%count = n
         if (allocated(self%at)) deallocate (self%at)
         allocate (self%at(5, n))
      end do
   end subroutine number

   !> True for a node that may get restricted forces from the edge of the next finer level: within a cell of
   !> it.
   pure logical function is_beside(node, finer)
      integer, intent(in) :: node(3)
      type(level_t), intent(in), optional :: finer
      is_beside = .false.
      if (present(finer)) is_beside = finer%region%has_some(node - 2, node + 1)
   end function is_beside

   !> True where a cell around a node of a tile is filled, or lies outside the tile.
   pure logical function any_filled(filled, node)
      logical, intent(in) :: filled(0:, 0:, 0:)
      integer, intent(in) :: node(3)
      any_filled = any(node == 0)
      if (any_filled) return
      associate (low => node - 1, high => node)
         any_filled = any(filled(low(1):high(1), low(2):high(2), low(3):high(3)))
      end associate
   end function any_filled

   !> Grid coordinates of a node of a block's tile.
   pure function tile_node(level, b, at) result(node)
      type(level_t), intent(in) :: level
      integer, intent(in) :: b, at(3)
      integer :: node(3)
      node = block_size*level%blocks(b)%place + at - 1
   end function tile_node

   !> True when a block owns a node of its tile: it is its own or, if the block that owns it does not exist,
   !> this is the lowest block whose tile has it. With an axis: of those that have its neighbours along that
   !> axis too.
   pure logical function is_own_node(level, b, at, axis) result(own)
      type(level_t), intent(in) :: level
      integer, intent(in) :: b, at(3)
      integer, intent(in), optional :: axis
      integer :: d, home(3), other(3)
      own = all(at >= 1 .and. at <= block_size)
      if (own) return
      if (present(axis)) then
         if (at(axis) < 1 .or. at(axis) > block_size) return
      end if
      associate (block => level%blocks(b))
         home = block%place + merge(1, 0, at > block_size) - merge(1, 0, at < 1)
         if (level%owner_at(home, block%field) >= 0) return
         do d = 1, 27
            other = at - block_size*directions(:, d)
            if (any(other < 0 .or. other > tile_last)) cycle
            if (present(axis)) then
               if (directions(axis, d) /= 0) cycle
            end if
            if (level%owner_at(block%place + directions(:, d), block%field) < 0) cycle
            if (level%grid%block_index(block%place + directions(:, d), block%field) < block%index) return
         end do
      end associate
      own = .true.
   end function is_own_node

   !> Copy values of the unknowns to own tiles, to components first to first + 2 of their nodes; the tiles of
   !> other blocks get them by the sum over tiles.
   pure subroutine scatter(self, values, first, tiles)
      class(static_nodes_t), intent(in) :: self
      real(wp), intent(in) :: values(:)
      integer, intent(in) :: first
      real(wp), intent(inout), contiguous :: tiles(:, 0:, 0:, 0:, :)
      integer :: n
      do n = 1, self%count
         associate (at => self%at(:, n))
            tiles(first + at(1) - 1, at(2), at(3), at(4), at(5)) = values(n)
         end associate
      end do
   end subroutine scatter

   !> The inverse of scatter.
   pure subroutine gather(self, first, tiles, values)
      class(static_nodes_t), intent(in) :: self
      integer, intent(in) :: first
      real(wp), intent(in), contiguous :: tiles(:, 0:, 0:, 0:, :)
      real(wp), intent(inout) :: values(:) !< (count or more)
      integer :: n
      do n = 1, self%count
         associate (at => self%at(:, n))
            values(n) = tiles(first + at(1) - 1, at(2), at(3), at(4), at(5))
         end associate
      end do
   end subroutine gather

end module m_static_nodes
