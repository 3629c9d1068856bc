!> One grid level: its grid, the owner rank of each block, this rank's blocks, and the pools of their node
!> tiles.
module m_level
   use m_near_ranks, only: near_ranks_t
   use m_kinds, only: wp, i4, i8
   use m_constants, only: block_size
   use m_node_values, only: node_values, tile_last
   use m_grid_level, only: grid_level_t
   use m_region, only: region_t
   use m_block, only: block_t
   use m_cell_list, only: cell_list_t
   use m_field_table, only: field_table_t, layout_t
   use m_half_edges, only: half_edges
   implicit none
   private
   public :: level_t, fit_pool, tile_bytes

   !> Of a block's nodes.
   integer(i8), parameter :: tile_bytes = node_values*(tile_last + 1_i8)**3*storage_size(1.0_wp)/8

   type :: level_t
      integer :: number = 1                  !< 1 is the coarsest
      type(grid_level_t) :: grid
      type(region_t) :: region               !< the region that it refines; the whole grid on the coarsest
                                             !< level
      type(region_t), allocatable :: layer   !< where means over cells are taken: the region and the cells of
                                             !< the level above around it (membership.f90)
      type(field_table_t) :: table
      type(layout_t) :: layout
      integer, allocatable :: owner(:) !< (blocks, by number): rank that owns it, -1 where there is none; the
                                       !< same on every rank
      integer, allocatable :: slot(:) !< (blocks, by number): slot here (own blocks first, then ghosts), 0 if
                                      !< not here
      integer, allocatable :: field_of_body(:) !< velocity field of each body's particles
      type(near_ranks_t) :: near !< ranks that own blocks of any field at the same places as local blocks or
                                 !< next to them
      type(block_t), allocatable :: blocks(:) !< own blocks, by rising index; block b has slot b
      integer, allocatable :: ghost_index(:) !< block indices of the neighbours on other ranks; ghost m has
                                             !< slot size(blocks) + m
      integer, allocatable :: interior_first(:) !< own blocks in two parts: those without remote neighbours,
                                                !< and the others, each by rising index
      integer :: part_end(0:2) = 0           !< part p of interior_first is part_end(p - 1) + 1 to part_end(p)
      real(wp), allocatable :: nodes(:, :, :, :, :) !< (node_values, 0:9, 0:9, 0:9, slots): first the
                                                    !< contributions of a block's particles, then sums over
                                                    !< all blocks and ranks, then the motion
      logical :: sums_wait = .false. !< tiles hold the contributions of their own blocks' particles; sums over
                                     !< blocks are still to be made
      real(wp), allocatable :: restricted(:, :, :, :, :) !< the same shape, where there is a finer level: its
                                                         !< restricted values, while `nodes` holds the motion
      integer, allocatable :: extent(:, :, :) !< (2, 3, slots): first and last index along each axis of the
                                              !< part of a tile that may be nonzero: the part its particles
                                              !< reach; of ghosts, all
      real(wp), allocatable :: gradient(:, :) !< work for one block: columns while being sorted; then body
                                              !< forces; then velocity gradients, from nodes to stress
      integer(i4), allocatable :: order(:) !< work for one block: permutation that sorts its particles
      real(wp), allocatable :: lag(:, :) !< work: amount by which the kept gradients are ahead in time
                                         !< (theory.md, eq. lag)
      type(cell_list_t) :: at_edge !< work: those of a block's particles that reach an edge of levels
   contains
      procedure :: particle_count
      procedure :: size_work
      procedure :: update_extents
      procedure :: widen_extent
      procedure :: keep_order
      procedure :: bytes
      procedure :: owner_at
      procedure :: slot_at
      procedure :: thickness
      procedure :: max_thickness
      procedure :: edge
   end type level_t

contains

   !> Particles on this rank.
   pure integer(i8) function particle_count(self)
      class(level_t), intent(in) :: self
      integer :: b
      particle_count = 0
      do b = 1, size(self%blocks)
         particle_count = particle_count + self%blocks(b)%particles%count
      end do
   end function particle_count

   !> Owner of a field's block at a place, -1 where there is none or the place is outside the level.
   pure integer function owner_at(self, place, field)
      class(level_t), intent(in) :: self
      integer, intent(in) :: place(3), field
      owner_at = -1
      if (any(place < 0) .or. any(place >= self%grid%blocks)) return
      owner_at = self%owner(self%grid%block_index(place, field))
   end function owner_at

   !> Slot here of a field's block at a place, 0 where it is not here.
   pure integer function slot_at(self, place, field)
      class(level_t), intent(in) :: self
      integer, intent(in) :: place(3), field
      slot_at = 0
      if (any(place < 0) .or. any(place >= self%grid%blocks)) return
      slot_at = self%slot(self%grid%block_index(place, field))
   end function slot_at

   !> Thickness of a particle's domain across a normal, 2 sqrt(sum (r_k . n)^2), m: exact along its edges; for
   !> a cube its edge length in every direction (theory.md, eq. thickness).
   pure real(wp) function thickness(self, values, normal)
      class(level_t), intent(in) :: self
      real(wp), intent(in) :: values(:) !< the particle's columns
      real(wp), intent(in) :: normal(3) !< unit vector
      thickness = 2.0_wp*norm2(matmul(normal, half_edges(values, self%layout)))
   end function thickness

   !> Edge of a particle whose domain deforms, m: of the cube of equal volume, or the square of equal area of
   !> a section.
   pure real(wp) function edge(self, values)
      class(level_t), intent(in) :: self
      real(wp), intent(in) :: values(:) !< the particle's columns
      associate (at => self%layout)
         if (at%section%is_flat()) then
            edge = sqrt(values(at%volume)/at%section%depth(values(at%position)))
         else
            edge = values(at%volume)**(1.0_wp/3.0_wp)
         end if
      end associate
   end function edge

   !> Upper bound of the thickness of a particle's domain, m: the eigenvalues of sum r_k r_k^T do not exceed
   !> the largest of its row sums (Gershgorin). The bound is attained for a cube and a box along the axes.
   pure real(wp) function max_thickness(self, values)
      class(level_t), intent(in) :: self
      real(wp), intent(in) :: values(:) !< the particle's columns
      real(wp) :: r(3, 3)
      r = half_edges(values, self%layout)
      max_thickness = 2.0_wp*sqrt(maxval(sum(abs(matmul(r, transpose(r))), dim=1)))
   end function max_thickness

   !> The nodes that a block's particles reach, or all where other blocks add to the block's nodes or read
   !> them; nodes beside the plane of a section get no contributions.
   pure function range_of(block, whole, grid) result(extent)
      type(block_t), intent(in) :: block
      logical, intent(in) :: whole
      type(grid_level_t), intent(in) :: grid
      integer :: extent(2, 3)
      extent = block%cells%extent()
      if (whole) extent(1, :) = 0
      if (whole) extent(2, :) = tile_last
      if (grid%section%is_flat()) extent(:, 2) = grid%rows
   end function range_of

   !> Set the extent of a block's tile before new contributions: the nodes its particles reach, or all; the
   !> tile is zero beyond.
   subroutine update_extents(self, b, whole)
      class(level_t), intent(inout) :: self
      integer, intent(in) :: b
      logical, intent(in) :: whole
      integer :: extent(2, 3)
      associate (block => self%blocks(b))
         if (block%cells%counted < 0) call block%cells%update_statistics(block%particles%count)
         call block%cells%go_through(1, block%particles%count)
         extent = range_of(block, whole, self%grid)
      end associate
      associate (old => self%extent(:, :, b))
         if (any(old(1, :) < extent(1, :)) .or. any(old(2, :) > extent(2, :))) &
            self%nodes(:, old(1, 1):old(2, 1), old(1, 2):old(2, 2), old(1, 3):old(2, 3), b) = 0.0_wp
         old = extent
      end associate
   end subroutine update_extents

   !> Widen the extent of a block's tile, which is zero beyond, to the reach of added particles, or to all.
   pure subroutine widen_extent(self, b, whole)
      class(level_t), intent(inout) :: self
      integer, intent(in) :: b
      logical, intent(in) :: whole
      integer :: extent(2, 3)
      extent = range_of(self%blocks(b), whole, self%grid)
      self%extent(1, :, b) = min(self%extent(1, :, b), extent(1, :))
      self%extent(2, :, b) = max(self%extent(2, :, b), extent(2, :))
   end subroutine widen_extent

   !> Count how far a block's particles are out of the order of their cells, and sort them where that costs
   !> too much. To be called when particles have changed cell or have left, before others arrive: the order
   !> decides the last digits of sums.
   subroutine keep_order(self, b)
      class(level_t), intent(inout) :: self
      integer, intent(in) :: b
      associate (block => self%blocks(b))
         if (block%cells%counted /= block%particles%count) &
            call block%cells%update_statistics(block%particles%count)
         if (block%wants_sorting()) call block%sort(self%order, self%gradient)
         block%run_breaks = block%cells%run_breaks
      end associate
   end subroutine keep_order

   !> Size the work arrays for the largest block.
   subroutine size_work(self)
      class(level_t), intent(inout) :: self
      integer :: b, largest
      largest = block_size
      do b = 1, size(self%blocks)
         largest = max(largest, size(self%blocks(b)%particles%id))
      end do
      if (allocated(self%gradient)) then
         if (size(self%gradient, 1) >= largest) return
         deallocate (self%gradient, self%order, self%lag)
      end if
      allocate (self%gradient(largest, 9), self%order(largest))
      allocate (self%lag(merge(largest, 0, self%layout%corrects_lag()), 9))
      if (self%layout%edge_stress > 0) call self%at_edge%reserve(largest, choosing=.true.)
   end subroutine size_work

   !> Provide room in a pool for so many tiles; its contents stay. The spare room takes no memory until it is
   !> touched. Pools do not shrink.
   subroutine fit_pool(pool, tiles)
      real(wp), allocatable, intent(inout) :: pool(:, :, :, :, :)
      integer, intent(in) :: tiles
      real(wp), allocatable :: larger(:, :, :, :, :)
      integer :: before
      before = 0
      if (allocated(pool)) before = size(pool, 5)
      if (allocated(pool) .and. before >= tiles) return
      allocate (larger(node_values, 0:tile_last, 0:tile_last, 0:tile_last, tiles + tiles/2))
      if (before > 0) larger(:, :, :, :, :before) = pool
      larger(:, :, :, :, before + 1:tiles) = 0.0_wp
      call move_alloc(larger, pool)
   end subroutine fit_pool

   !> Memory held on this rank (bytes).
   pure integer(i8) function bytes(self) result(held)
      class(level_t), intent(in) :: self
      integer :: b
      ! the part of the pools in use
      held = tile_bytes*size(self%extent, 3)*merge(2, 1, allocated(self%restricted))
      held = held + 8_i8*(size(self%gradient, kind=i8) + size(self%lag, kind=i8))
      held = held + 4_i8*size(self%order, kind=i8)
      held = held + self%at_edge%bytes()
      held = held + 4_i8*(size(self%owner, kind=i8) + size(self%slot, kind=i8))
      do b = 1, size(self%blocks)
         held = held + self%blocks(b)%bytes()
      end do
   end function bytes

end module m_level
