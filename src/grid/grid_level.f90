!> One uniform grid: cubic cells, nodes at their corners, nodes grouped into blocks.
!>
!> Node (i,j,k), counted from 0, is at lower + (i,j,k) cell. A particle belongs to the bin of its nearest
!> node, so its weights are nonzero on the 27 nodes around that one only. Block (a,b,c) holds the nodes and
!> bins 8a..8a+7, 8b..8b+7, 8c..8c+7.
!>
!> Bodies that interact only by contact have separate velocity fields: each field has its own blocks at the
!> same places.
module m_grid_level
   use m_kinds, only: wp
   use m_constants, only: block_size
   use m_scene, only: grid_spec_t
   use m_side_kinds, only: boundary_free, side_kinds
   use m_section, only: section_t
   use m_node_values, only: tile_last, plane_row
   implicit none
   private
   public :: grid_level_t, make_grid_level

   type :: grid_level_t
      real(wp) :: lower(3)        !< position of node (0,0,0), m
      real(wp) :: upper(3)        !< m
      real(wp) :: cell            !< cell size, m
      real(wp) :: per_cell        !< 1/cell, 1/m
      integer :: cells(3)         !< cells along each axis
      integer :: blocks(3)        !< blocks along each axis, numbered from 0
      integer :: fields = 1       !< velocity fields, numbered from 1
      integer :: boundary(2, 3)   !< condition on the lower and upper side of each axis
      type(section_t) :: section  !< section of the scene: no motion along y, no boundary conditions on the
                                  !< sides there
      integer :: rows(2) = [0, tile_last] !< first and last index along y in a node tile that is in use
   contains
      procedure :: nearest_node
      procedure :: cells_of_box
      procedure :: block_of
      procedure :: block_origin
      procedure :: block_count
      procedure :: block_index
      procedure :: block_place
      procedure :: block_field
      procedure :: plane
   end type grid_level_t

   real(wp), parameter :: hair = 1.0e-6_wp !< cells: a face so near to a plane of nodes is on it

contains

   !> The grid of a scene, or one of the finer ones over it: level 1 is the scene's, each further one has
   !> cells half as large.
   pure function make_grid_level(spec, level) result(grid)
      type(grid_spec_t), intent(in) :: spec
      integer, intent(in), optional :: level !< 1 if absent
      type(grid_level_t) :: grid
      integer :: refinement
      refinement = 1
      if (present(level)) refinement = 2**(level - 1)
      grid%lower = spec%lower
      grid%upper = spec%upper
      grid%cell = spec%cell_size/refinement
      grid%per_cell = refinement/spec%cell_size
      grid%cells = refinement*spec%cells
      grid%blocks = grid%cells/block_size + 1
      grid%boundary = reshape(spec%boundary, [2, 3])
      grid%section = spec%section
      if (.not. grid%section%is_flat()) return
      grid%boundary(:, 2) = boundary_free
      grid%rows = plane_row
   end function make_grid_level

   !> Index of the node nearest to a position, which must be finite and near the grid.
   pure function nearest_node(self, position) result(node)
      class(grid_level_t), intent(in) :: self
      real(wp), intent(in) :: position(3) !< m
      integer :: node(3)
      node = floor((position - self%lower)*self%per_cell + 0.5_wp)
   end function nearest_node

   !> First and last cells, from 0, that a box reaches. A face on a plane of nodes reaches the cells on both
   !> sides of it, so that neither round-off nor the direction of an axis decides.
   pure subroutine cells_of_box(self, low, high, first, last)
      class(grid_level_t), intent(in) :: self
      real(wp), intent(in) :: low(3), high(3) !< m
      integer, intent(out) :: first(3), last(3)
      first = min(max(floor((low - self%lower)*self%per_cell - hair), 0), self%cells - 1)
      last = min(max(floor((high - self%lower)*self%per_cell + hair), 0), self%cells - 1)
   end subroutine cells_of_box

   !> Coordinates of the block whose bins contain a position; on or beyond the sides of the grid the nearest
   !> block.
   pure function block_of(self, position) result(place)
      class(grid_level_t), intent(in) :: self
      real(wp), intent(in) :: position(3) !< m
      integer :: place(3)
      place = min(max(self%nearest_node(position), 0)/block_size, self%blocks - 1)
   end function block_of

   !> Position (m) of the first node of a block.
   pure function block_origin(self, place) result(origin)
      class(grid_level_t), intent(in) :: self
      integer, intent(in) :: place(3)
      real(wp) :: origin(3)
      origin = self%lower + real(block_size*place, wp)*self%cell
   end function block_origin

   !> Number of blocks that the level can have, of all fields.
   pure integer function block_count(self)
      class(grid_level_t), intent(in) :: self
      block_count = product(self%blocks)*self%fields
   end function block_count

   !> Number of a block, from 1, x running fastest, field by field: sums over blocks run in this order.
   pure integer function block_index(self, place, field)
      class(grid_level_t), intent(in) :: self
      integer, intent(in) :: place(3), field
      block_index = 1 + place(1) + self%blocks(1)*(place(2) + self%blocks(2)*(place(3) &
         + self%blocks(3)*(field - 1)))
   end function block_index

   !> Coordinates of the block with a number.
   pure function block_place(self, index) result(place)
      class(grid_level_t), intent(in) :: self
      integer, intent(in) :: index
      integer :: place(3)
      place(1) = mod(index - 1, self%blocks(1))
      place(2) = mod((index - 1)/self%blocks(1), self%blocks(2))
      place(3) = mod((index - 1)/(self%blocks(1)*self%blocks(2)), self%blocks(3))
   end function block_place

   !> The velocity field of the block with a number.
   pure integer function block_field(self, index)
      class(grid_level_t), intent(in) :: self
      integer, intent(in) :: index
      block_field = 1 + (index - 1)/product(self%blocks)
   end function block_field

   !> Node tile index (0 to 9) of the lower (side 1) or upper (side 2) boundary plane of an axis in a block,
   !> or -1 where the plane does not cross the tile or the side is free.
   pure integer function plane(self, place, side, axis)
      class(grid_level_t), intent(in) :: self
      integer, intent(in) :: place(3), side, axis
      integer :: node
      plane = -1
      if (.not. side_kinds(self%boundary(side, axis))%closed) return
      node = 0
      if (side == 2) node = self%cells(axis)
      node = node - block_size*place(axis) + 1
      if (node >= 0 .and. node <= block_size + 1) plane = node
   end function plane

end module m_grid_level
