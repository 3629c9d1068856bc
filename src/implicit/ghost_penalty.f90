!> Ghost penalty: jumps of the displacement's gradient across faces of cells at a body's surface are
!> penalised, so that nodes with little material are supported by their neighbours (theory.md, eq. ghost;
!> Burman 2010; Coombs 2022).
module m_ghost_penalty
   use m_kinds, only: wp
   use m_node_values, only: node_values, tile_last, v_x, v_z, f_x, f_z
   use m_side_kinds, only: side_kinds, boundary_symmetry
   use m_grid_level, only: grid_level_t
   use m_level, only: level_t
   use m_material, only: material_t
   use m_scene_materials, only: materials_t
   use m_field_table, only: layout_t
   use m_plastic, only: von_mises
   use m_half_edges, only: half_edges
   use m_static_nodes, only: is_own_node, tile_node
   use m_static_losses, only: face_reals
   implicit none
   private
   public :: ghost_penalty_t, mark_cells, work_of_faces

   !> Second differences: of the node at(2:4, n) in the tile of own block at(5, n), along axis at(1, n).
   type :: ghost_penalty_t
      integer :: count = 0
      integer, allocatable :: at(:, :)
      real(wp), allocatable :: stiffness(:)      !< N/m
      logical, allocatable :: filled(:, :, :, :) !< cells, by their lowest node in the tiles of own blocks
      real(wp), allocatable :: young(:, :, :, :) !< Young's modulus of the cells, mean over the particles that
                                                 !< reach into them, Pa
      real(wp), allocatable :: secant(:, :, :, :) !< likewise of the secant moduli of moduli_of, Pa
   contains
      procedure :: find_edges
      procedure :: find_faces
      procedure :: add_forces
      procedure :: add_diagonal
      procedure :: forces_of_faces
   end type ghost_penalty_t

   integer, parameter :: reached = 1, sum_of_young = 2, coarse = 3, sum_of_secants = 4, edge = 1 ! places of a
   ! node meanwhile
   real(wp), parameter :: hair = 1.0e-7_wp    !< cells: smaller overlaps of a particle with a cell are
                                              !< ignored;
   real(wp), parameter :: hair_of_groups = 1.0e-12_wp !< and where bodies are in contact: by the cell's nodes
   real(wp), parameter :: one_a_cell = 0.9_wp !< edge of a particle, in cells, from which on it fills its cell
                                              !< alone
   real(wp), parameter :: probed = 0.02_wp    !< equivalent strain up to which the secant modulus of a law is
                                              !< taken
   real(wp), parameter :: faint = 1.0e-9_wp   !< of the elastic stress of that strain: smaller deviators are
                                              !< rounding

contains

   !> First: mark the cells reached by a block's particles in its empty tile. Sums over tiles follow.
   subroutine mark_cells(level, materials, b, time_step, tile)
      type(level_t), intent(in) :: level
      type(materials_t), intent(in) :: materials
      integer, intent(in) :: b
      real(wp), intent(in) :: time_step !< s
      real(wp), intent(inout) :: tile(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      real(wp) :: corner(3), r(3, 3), place(3), reach
      real(wp) :: young(level%blocks(b)%particles%count), secant(level%blocks(b)%particles%count)
      integer :: at(3), c, p, seen(3, 8)
      call moduli_of(level, materials, b, time_step, young, secant)
      reach = 1.0_wp - merge(hair_of_groups, hair, level%grid%fields > 1)
      associate (block => level%blocks(b), column => level%blocks(b)%particles%column, &
                 x => level%layout%position)
         do p = 1, block%particles%count
            r = half_edges(column(p, :), level%layout)*level%grid%per_cell
            r = r*min(1.0_wp, 0.5_wp/maxval(sum(abs(r), dim=2)))*reach
            if (level%grid%section%is_flat()) r(:, 2) = 0.0_wp ! one layer of cells
            place = (column(p, x:x + 2) - block%origin)*level%grid%per_cell
            do c = 0, 7
               corner = place + matmul(r, real(2*[ibits(c, 0, 1), ibits(c, 1, 1), ibits(c, 2, 1)] - 1, wp))
               at = min(max(floor(corner) + 1, 0), tile_last)
               seen(:, c + 1) = at
               if (any(all(seen(:, :c) == spread(at, 2, c), dim=1)) .or. any(is_beyond(level%grid, &
                   tile_node(level, b, at)))) cycle
               associate (node => tile(:, at(1), at(2), at(3)))
                  node(reached) = node(reached) + 1.0_wp
                  node(sum_of_young) = node(sum_of_young) + young(p)
                  node(sum_of_secants) = node(sum_of_secants) + secant(p)
                  if (2.0_wp*maxval(norm2(r, dim=1)) > one_a_cell) node(coarse) = node(coarse) + 1.0_wp
               end associate
            end do
         end do
      end associate
   end subroutine mark_cells

   !> Young's modulus of a block's particles, and its secant value for a strain of `probed` along and against
   !> the deviator of their present stress: for plastic flow about the stress borne over that strain.
   subroutine moduli_of(level, materials, b, time_step, young, secant)
      type(level_t), intent(in) :: level
      type(materials_t), intent(in) :: materials
      integer, intent(in) :: b
      real(wp), intent(in) :: time_step !< s
      real(wp), intent(out) :: young(:), secant(:) !< (particles), Pa
      real(wp), allocatable :: along(:, :)
      integer :: first, last
      associate (particles => level%blocks(b)%particles)
         first = 1
         do while (first <= particles%count)
            last = particles%run_end(first)
            associate (law => materials%slots(materials%of_body(particles%body(first)))%law)
               young(first:last) = 0.5_wp/law%complementary_energy([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, &
                                                                    0.0_wp])
               along = deviators(particles%column(first:last, :), level%layout, &
                                 faint*probed*law%von_mises_modulus())
               secant(first:last) = young(first:last)*min(1.0_wp, max( &
                  strained(law, particles%column(first:last, :), level%layout, along, time_step, probed), &
                  strained(law, particles%column(first:last, :), level%layout, along, time_step, -probed)) &
                  /(probed*law%von_mises_modulus()))
            end associate
            first = last + 1
         end do
      end associate
   end subroutine moduli_of

   !> The directions of particles' stress deviators, as strains of equivalent strain 1; where there is none
   !> the mean of the shears in the planes of the axes, in a section that in its plane.
   pure function deviators(from, layout, least) result(along)
      real(wp), intent(in) :: from(:, :) !< columns
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: least      !< smaller von Mises stresses are none, Pa
      real(wp) :: along(size(from, 1), 6)
      real(wp) :: size_of(size(from, 1)), none(6)
      integer :: i
      none = [0.0_wp, 0.0_wp, 0.0_wp, 0.5_wp, 0.5_wp, 0.5_wp]
      if (layout%section%is_flat()) none = [0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.5_wp*sqrt(3.0_wp), 0.0_wp]
      along = from(:, layout%stress:layout%stress + 5)
      along(:, :3) = along(:, :3) - spread(sum(along(:, :3), dim=2)/3.0_wp, 2, 3)
      size_of = von_mises(along(:, 1), along(:, 2), along(:, 3), along(:, 4), along(:, 5), along(:, 6))
      do i = 1, 6
         along(:, i) = merge(1.5_wp*along(:, i)/max(size_of, tiny(least)), none(i), size_of > least)
      end do
   end function deviators

   !> Von Mises stress of particles after an equivalent strain along given ones, Pa.
   function strained(law, from, layout, along, time_step, strain) result(stress)
      class(material_t), intent(in) :: law
      real(wp), intent(in) :: from(:, :)  !< columns
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: along(:, :) !< of deviators
      real(wp), intent(in) :: time_step, strain !< s; with its sign
      real(wp) :: stress(size(from, 1))
      real(wp), allocatable :: column(:, :), rate(:, :)
      column = from
      rate = strain/time_step*along(:, [1, 6, 5, 6, 2, 4, 5, 4, 3])
      call law%update(column, layout, rate, time_step, 1, size(from, 1))
      associate (s => layout%stress)
         stress = von_mises(column(:, s), column(:, s + 1), column(:, s + 2), column(:, s + 3), &
                            column(:, s + 4), column(:, s + 5))
      end associate
   end function strained

   !> Second: mark the cells at the surface, or with at most one particle, each by one block, in place of the
   !> tiles' contents. Sums over tiles follow.
   subroutine find_edges(self, level, tiles, finer)
      class(ghost_penalty_t), intent(inout) :: self
      type(level_t), intent(in) :: level
      type(level_t), intent(in), optional :: finer !< the next one
      real(wp), intent(inout), contiguous :: tiles(:, 0:, 0:, 0:, :)
      integer :: axis, b, i, j, k, side, next(3)
      logical :: bare
      associate (n => size(level%blocks))
         if (allocated(self%filled)) deallocate (self%filled, self%young, self%secant)
         allocate (self%filled(0:tile_last, 0:tile_last, 0:tile_last, n), &
                   self%young(0:tile_last, 0:tile_last, 0:tile_last, n), &
                   self%secant(0:tile_last, 0:tile_last, 0:tile_last, n))
         self%filled = tiles(reached, :, :, :, :n) > 0.5_wp
         self%young = tiles(sum_of_young, :, :, :, :n)/max(tiles(reached, :, :, :, :n), 1.0_wp)
         self%secant = tiles(sum_of_secants, :, :, :, :n)/max(tiles(reached, :, :, :, :n), 1.0_wp)
      end associate
      do b = 1, size(level%blocks)
         do k = 0, tile_last
            do j = level%grid%rows(1), level%grid%rows(2)
               do i = 0, tile_last
                  bare = .false.
                  if (self%filled(i, j, k, b)) bare = is_own_node(level, b, [i, j, k])
                  if (bare .and. .not. tiles(coarse, i, j, k, b) > 0.5_wp) then
                     bare = .false.
                     do axis = 1, 3, merge(2, 1, level%grid%section%is_flat())
                        do side = -1, 1, 2
                           next = [i, j, k]
                           next(axis) = next(axis) + side
                           if (is_elsewhere(level, tile_node(level, b, next), axis, finer)) cycle
                           if (any(next < 0 .or. next > tile_last)) then
                              bare = .true.
                           else
                              bare = bare .or. .not. self%filled(next(1), next(2), next(3), b)
                           end if
                        end do
                     end do
                  end if
                  tiles(:, i, j, k, b) = 0.0_wp
                  if (bare) tiles(edge, i, j, k, b) = 1.0_wp
               end do
            end do
         end do
      end do
   end subroutine find_edges

   !> True for a cell beyond a closed side of the grid, or one of another level: there is no surface there.
   pure logical function is_elsewhere(level, cell, axis, finer) result(elsewhere)
      type(level_t), intent(in) :: level
      integer, intent(in) :: cell(3), axis !< in the level's grid; beside the cell considered
      type(level_t), intent(in), optional :: finer
      logical :: beyond(3)
      beyond = is_beyond(level%grid, cell)
      elsewhere = beyond(axis)
      associate (home => (cell - modulo(cell, 2))/2) ! in the level above
         if (level%number > 1) elsewhere = elsewhere .or. .not. level%region%has_all(home, home)
         if (present(finer)) elsewhere = elsewhere .or. finer%region%has_all(cell, cell)
      end associate
   end function is_elsewhere

   !> Along which axes a cell is beyond a closed side. No material is there, though domains at the side may
   !> reach beyond it as they strain: what they give to nodes there is folded back.
   pure function is_beyond(grid, cell) result(beyond)
      type(grid_level_t), intent(in) :: grid
      integer, intent(in) :: cell(3)
      logical :: beyond(3)
      beyond = (cell < 0 .and. side_kinds(grid%boundary(1, :))%closed) &
               .or. (cell >= grid%cells .and. side_kinds(grid%boundary(2, :))%closed)
   end function is_beyond

   !> Last: find the faces between filled cells of which one is at the surface, node by node; their stiffness
   !> is `share` of the secant modulus times a third of the cell, with a quarter of each face per node.
   subroutine find_faces(self, level, tiles, share)
      class(ghost_penalty_t), intent(inout) :: self
      type(level_t), intent(in) :: level
      real(wp), intent(in), contiguous :: tiles(:, 0:, 0:, 0:, :)
      real(wp), intent(in) :: share
      real(wp) :: total
      integer :: axis, b, i, j, k, n, pass
      do pass = 1, 2
         n = 0
         do b = 1, size(level%blocks)
            do k = 0, tile_last
               do j = level%grid%rows(1), level%grid%rows(2)
                  do i = 0, tile_last
                     do axis = 1, 3, merge(2, 1, level%grid%section%is_flat())
                        if (.not. is_own_node(level, b, [i, j, k], axis)) cycle
                        total = faces_at(self, tiles(edge, :, :, :, b), b, [i, j, k], axis, &
                                         side_at(level%grid, tile_node(level, b, [i, j, k]), axis))
                        if (.not. total > 0.0_wp) cycle
                        n = n + 1
                        if (pass == 1) cycle
                        self%at(:, n) = [axis, i, j, k, b]
                        self%stiffness(n) = share*level%grid%cell/12.0_wp*total
                        if (level%grid%section%is_flat()) &
                           self%stiffness(n) = share*depth_at(level, b, i)/6.0_wp*total
                     end do
                  end do
               end do
            end do
         end do
         if (pass == 2) exit
         self%count = n
         if (allocated(self%at)) deallocate (self%at, self%stiffness)
         allocate (self%at(5, n), self%stiffness(n))
      end do
   end subroutine find_faces

   !> Extent across a section of the faces at a node, m: there are two of them, not four, each with half its
   !> length.
   pure real(wp) function depth_at(level, b, i) result(depth)
      type(level_t), intent(in) :: level
      integer, intent(in) :: b, i !< of the node in its tile
      integer :: node(3)
      node = tile_node(level, b, [i, 0, 0])
      depth = level%grid%section%depth(level%grid%lower(1) + max(real(node(1), wp), 0.25_wp)*level%grid%cell)
   end function depth_at

   !> Sum of the secant modulus over the relevant faces normal to an axis at a node, Pa. On a symmetry plane
   !> the cell behind it is the mirror image of that before it, and half of the face belongs to either.
   pure real(wp) function faces_at(self, edges, b, node, axis, side) result(total)
      class(ghost_penalty_t), intent(in) :: self
      real(wp), intent(in) :: edges(0:, 0:, 0:)
      integer, intent(in) :: b, node(3), axis
      integer, intent(in) :: side !< as side_at
      integer :: first(3), second(3), u, v
      total = 0.0_wp
      do v = -1, 0
         do u = -1, 0
            second = node
            second(mod(axis, 3) + 1) = second(mod(axis, 3) + 1) + u
            second(mod(axis + 1, 3) + 1) = second(mod(axis + 1, 3) + 1) + v
            first = second
            first(axis) = first(axis) - 1
            if (any(first < 0)) cycle
            if (side == 1) first = second
            if (side == 2) second = first
            associate (a => first, z => second)
               if (.not. (self%filled(a(1), a(2), a(3), b) .and. self%filled(z(1), z(2), z(3), b))) cycle
               if (.not. max(edges(a(1), a(2), a(3)), edges(z(1), z(2), z(3))) > 0.5_wp) cycle
               total = total + 0.5_wp*(self%secant(a(1), a(2), a(3), b) + self%secant(z(1), z(2), z(3), b))
            end associate
         end do
      end do
      if (side > 0) total = 0.5_wp*total
   end function faces_at

   !> 1 for a node on a lower symmetry plane across an axis, 2 on an upper one, else 0. (At the axis of
   !> revolution faces have no area.)
   pure integer function side_at(grid, node, axis) result(side)
      type(grid_level_t), intent(in) :: grid
      integer, intent(in) :: node(3), axis
      side = 0
      if (grid%section%is_round() .and. axis == 1) return
      if (node(axis) == 0 .and. grid%boundary(1, axis) == boundary_symmetry) side = 1
      if (node(axis) == grid%cells(axis) .and. grid%boundary(2, axis) == boundary_symmetry) side = 2
   end function side_at

   !> Add a multiple of the penalty's forces under the displacements of `motion` to the forces of `tiles`.
   pure subroutine add_forces(self, motion, factor, tiles)
      class(ghost_penalty_t), intent(in) :: self
      real(wp), intent(in), contiguous :: motion(:, 0:, 0:, 0:, :) !< displacements in v_x to v_z, m
      real(wp), intent(in) :: factor
      real(wp), intent(inout), contiguous :: tiles(:, 0:, 0:, 0:, :)
      real(wp) :: s(3)
      integer :: n, o(3)
      do n = 1, self%count
         o = 0
         o(self%at(1, n)) = 1
         associate (i => self%at(2, n), j => self%at(3, n), k => self%at(4, n), b => self%at(5, n))
            s = factor*self%stiffness(n)*second_difference(self%at(:, n), motion)
            tiles(f_x:f_z, i + o(1), j + o(2), k + o(3), b) = s &
               + tiles(f_x:f_z, i + o(1), j + o(2), k + o(3), b)
            tiles(f_x:f_z, i, j, k, b) = tiles(f_x:f_z, i, j, k, b) - 2.0_wp*s
            tiles(f_x:f_z, i - o(1), j - o(2), k - o(3), b) = s &
               + tiles(f_x:f_z, i - o(1), j - o(2), k - o(3), b)
         end associate
      end do
   end subroutine add_forces

   !> Add the penalty's part of the diagonal.
   pure subroutine add_diagonal(self, tiles)
      class(ghost_penalty_t), intent(in) :: self
      real(wp), intent(inout), contiguous :: tiles(:, 0:, 0:, 0:, :)
      integer :: n, o(3)
      do n = 1, self%count
         o = 0
         o(self%at(1, n)) = 1
         associate (i => self%at(2, n), j => self%at(3, n), k => self%at(4, n), b => self%at(5, n), &
                    s => self%stiffness(n))
            tiles(f_x:f_z, i + o(1), j + o(2), k + o(3), b) = s &
               + tiles(f_x:f_z, i + o(1), j + o(2), k + o(3), b)
            tiles(f_x:f_z, i, j, k, b) = tiles(f_x:f_z, i, j, k, b) + 4.0_wp*s
            tiles(f_x:f_z, i - o(1), j - o(2), k - o(3), b) = s &
               + tiles(f_x:f_z, i - o(1), j - o(2), k - o(3), b)
         end associate
      end do
   end subroutine add_diagonal

   !> The force of each face of this rank under the displacements of `motion`, a row each, in the format of
   !> static_losses_t.
   pure function forces_of_faces(self, level, motion) result(rows)
      class(ghost_penalty_t), intent(in) :: self
      type(level_t), intent(in) :: level
      real(wp), intent(in), contiguous :: motion(:, 0:, 0:, 0:, :) !< displacements in v_x to v_z, m
      real(wp) :: rows(face_reals, self%count)
      integer :: n
      do n = 1, self%count
         associate (at => self%at(:, n))
            rows(:, n) = [real([level%number, level%blocks(at(5))%index, at(:4)], wp), &
                          self%stiffness(n)*second_difference(at, motion)]
         end associate
      end do
   end function forces_of_faces

   !> Work of such forces along the displacements of `motion`, for the faces of this rank's blocks, J.
   pure real(wp) function work_of_faces(rows, level, motion) result(work)
      real(wp), intent(in) :: rows(:, :) !< of any levels
      type(level_t), intent(in) :: level
      real(wp), intent(in), contiguous :: motion(:, 0:, 0:, 0:, :) !< displacements in v_x to v_z, m
      integer :: at(6), n, slot
      work = 0.0_wp
      do n = 1, size(rows, 2)
         at = nint(rows(:6, n))
         if (at(1) /= level%number) cycle
         slot = level%slot(at(2))
         if (slot < 1 .or. slot > size(level%blocks)) cycle
         work = work + dot_product(rows(7:, n), second_difference([at(3:), slot], motion))
      end do
   end function work_of_faces

   !> Jump of the gradient across a face times the cell size, m.
   pure function second_difference(at, motion) result(jump)
      integer, intent(in) :: at(:) !< axis, node of the tile (3), block
      real(wp), intent(in), contiguous :: motion(:, 0:, 0:, 0:, :)
      real(wp) :: jump(3)
      integer :: o(3)
      o = 0
      o(at(1)) = 1
      associate (i => at(2), j => at(3), k => at(4), b => at(5))
         jump = motion(v_x:v_z, i + o(1), j + o(2), k + o(3), b) - 2.0_wp*motion(v_x:v_z, i, j, k, b) &
                + motion(v_x:v_z, i - o(1), j - o(2), k - o(3), b)
      end associate
   end function second_difference

end module m_ghost_penalty
