!> Levels made of given particles, without a scene: one rank, a block wherever there is a particle.
module m_made_level
   use m_kinds, only: wp, i4, i8
   use m_constants, only: block_size
   use m_node_values, only: node_values, tile_last
   use m_scene, only: grid_spec_t
   use m_grid_level, only: make_grid_level
   use m_level, only: level_t
   use m_decomposition, only: settle_blocks
   use m_node_exchange, only: sum_tiles
   use m_p2g_boxes, only: p2g_boxes
   use m_node_solve, only: solve_nodes
   use m_boundary, only: fold_symmetry, apply_boundary, motion_parity
   use m_migration, only: frame_of
   use m_locate, only: bin_of
   implicit none
   private
   public :: declare_usual_fields, make_level, node_state_t, all_nodes

   !> Values at all nodes of a grid, from -1 to cells + 1 along each axis.
   type :: node_state_t
      real(wp), allocatable :: sums(:, :, :, :)   !< what particles gave, after folding
      real(wp), allocatable :: solved(:, :, :, :) !< inside the boundary conditions
      logical, allocatable :: held(:, :, :)       !< some block has the node
      integer :: disagreements = 0                !< tiles that hold other bits than another tile of the same
                                                  !< node
   end type node_state_t

contains

   subroutine declare_usual_fields(level, affine)
      type(level_t), intent(inout) :: level
      logical, intent(in) :: affine
      call level%table%declare('position', 3, 'm', .true.)
      call level%table%declare('velocity', 3, 'm/s', .true.)
      call level%table%declare('mass', 1, 'kg', .true.)
      call level%table%declare('volume', 1, 'm3', .true.)
      call level%table%declare('half_size', 1, 'm', .true.)
      call level%table%declare('stress', 6, 'Pa', .true.)
      if (affine) call level%table%declare('velocity_gradient', 9, '1/s', .false.)
      level%layout = level%table%layout()
   end subroutine declare_usual_fields

   !> A level with these particles; its fields have been declared.
   subroutine make_level(level, spec, values)
      type(level_t), intent(inout) :: level
      type(grid_spec_t), intent(in) :: spec
      real(wp), intent(in) :: values(:, :) !< (particles, columns)
      integer :: p, slot
      level%grid = make_grid_level(spec)
      allocate (level%owner(level%grid%block_count()), source=-1)
      do p = 1, size(values, 1)
         level%owner(level%grid%block_index(place_of(p), 1)) = 0
      end do
      call settle_blocks(level, 0)
      do p = 1, size(values, 1)
         slot = level%slot_at(place_of(p), 1)
         associate (block => level%blocks(slot), x => level%layout%position)
            call block%reserve(block%particles%count + 1, level%table%columns)
            call block%particles%append(values(p, :), int(p, i8), 1_i4)
            block%cells%bin(block%particles%count) = bin_of(values(p, x:x + 2), frame_of(level, block))
         end associate
      end do
      call level%size_work()
   contains
      function place_of(p) result(place)
         integer, intent(in) :: p
         integer :: place(3)
         associate (x => level%layout%position)
            place = level%grid%nearest_node(values(p, x:x + 2))/block_size
         end associate
      end function place_of
   end subroutine make_level

   !> Particles to nodes, folded, summed, solved and constrained, as one step does it.
   subroutine all_nodes(level, time_step, state)
      type(level_t), intent(inout) :: level
      real(wp), intent(in) :: time_step
      type(node_state_t), intent(out) :: state
      logical, allocatable :: held(:, :, :)
      integer :: b
      associate (n => level%grid%cells)
         allocate (state%sums(node_values, -1:n(1) + 1, -1:n(2) + 1, -1:n(3) + 1), source=0.0_wp)
         allocate (state%solved(node_values, -1:n(1) + 1, -1:n(2) + 1, -1:n(3) + 1), source=0.0_wp)
         allocate (state%held(-1:n(1) + 1, -1:n(2) + 1, -1:n(3) + 1), &
                   held(-1:n(1) + 1, -1:n(2) + 1, -1:n(3) + 1), source=.false.)
      end associate
      do b = 1, size(level%blocks)
         associate (block => level%blocks(b))
            call block%cells%update_statistics(block%particles%count)
            level%nodes(:, :, :, :, b) = 0.0_wp
            call p2g_boxes(block%cells, block%particles%column, level%layout, frame_of(level, block), &
                              level%nodes(:, :, :, :, b))
            call fold_symmetry(level%grid, block%place, level%nodes(:, :, :, :, b), motion_parity)
         end associate
      end do
      call sum_tiles(level%blocks, level%interior_first, level%nodes)
      do b = 1, size(level%blocks)
         call collect(level, b, state%sums, held, state%disagreements)
      end do
      do b = 1, size(level%blocks)
         call solve_nodes(level%nodes(:, :, :, :, b), time_step)
         call apply_boundary(level%grid, level%blocks(b)%place, level%nodes(:, :, :, :, b))
         call collect(level, b, state%solved, state%held, state%disagreements)
      end do
   end subroutine all_nodes

   !> The nodes of one tile into those of the whole grid; the first tile that has a node gives its value, the
   !> others must agree.
   subroutine collect(level, b, nodes, held, disagreements)
      type(level_t), intent(in) :: level
      integer, intent(in) :: b
      real(wp), intent(inout) :: nodes(:, -1:, -1:, -1:)
      logical, intent(inout) :: held(-1:, -1:, -1:)
      integer, intent(inout) :: disagreements
      integer :: i, j, k, at(3)
      do k = 0, tile_last
         do j = 0, tile_last
            do i = 0, tile_last
               at = block_size*level%blocks(b)%place + [i, j, k] - 1
               if (any(at > level%grid%cells + 1)) cycle
               associate (value => level%nodes(:, i, j, k, b), node => nodes(:, at(1), at(2), at(3)))
                  if (.not. held(at(1), at(2), at(3))) node = value
                  if (any(abs(node - value) > 0.0_wp)) disagreements = disagreements + 1
               end associate
               held(at(1), at(2), at(3)) = .true.
            end do
         end do
      end do
   end subroutine collect

end module m_made_level
