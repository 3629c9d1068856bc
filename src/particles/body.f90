!> Filling bodies with particles: a cubic lattice, of which the particles with their centre in the shape are
!> kept.
module m_body
   use m_kinds, only: wp, i4, i8
   use m_constants, only: block_size, exit_input
   use m_errors, only: error_t, fail
   use m_text, only: to_text
   use m_scene, only: body_spec_t, fill_share
   use m_grid_level, only: grid_level_t
   use m_level, only: level_t
   use m_block, only: block_t
   use m_field_table, only: layout_t
   use m_half_edges, only: first_half_edges
   use m_split, only: must_split, octant_of, child_id
   use m_membership, only: lives_on, may_live_on
   use m_cut_cell, only: part_t, may_reach, find_part, cells_of_particle, cell_limit
   implicit none
   private
   public :: first_id, number_ids, lattice_extent, fill_block, count_in_block, expected_count, holds_place

   real(wp), parameter :: whole = 1.0e-9_wp !< a cube that lacks no more than this share counts as whole

   !> The lattice of a body: particle (i,j,k) has its centre at anchor + (i + 1/2, ...) spacing, first <= i <=
   !> last.
   type :: lattice_t
      real(wp) :: anchor(3)
      real(wp) :: spacing
      integer(i8) :: first(3)
      integer(i8) :: last(3)
   end type lattice_t

   !> A particle before its creation.
   type :: birth_t
      real(wp) :: x(3) = 0.0_wp    !< m
      real(wp) :: half = 0.0_wp    !< half its edge, m
      real(wp) :: volume = 0.0_wp  !< m3
      real(wp) :: cell(3) = 0.0_wp !< middle of its lattice site, m: x where it is whole
      real(wp) :: halves(3) = 0.0_wp !< half the edges of its domain, m: all `half` where it is whole
      integer(i8) :: id = 0        !< number of its lattice site, from 1
      integer(i8) :: octants = 0   !< which part of which part it is, three bits a split, the last one lowest
      integer :: refinement = 0    !< number of splits into eight
   end type birth_t

   type :: births_t
      integer :: count = 0
      type(birth_t), allocatable :: list(:)
   contains
      procedure :: add
   end type births_t

contains

   !> Add the particles of a body that live in a block of level l. The id is id_base + the number of the
   !> lattice site, so it does not depend on the blocks.
   subroutine fill_block(levels, l, block, spec, body, density, id_base, cells)
      type(level_t), intent(in) :: levels(:)
      integer, intent(in) :: l
      type(block_t), intent(inout) :: block
      type(body_spec_t), intent(in) :: spec
      integer, intent(in) :: body         !< number of the body
      real(wp), intent(in) :: density     !< kg/m3
      integer(i8), intent(in) :: id_base
      real(wp), allocatable, intent(out), optional :: cells(:, :) !< (4, particles added): middle and half
                                                                  !< edge of their lattice sites, m
      type(births_t) :: births
      real(wp) :: values(levels(l)%table%columns)
      integer :: p
      call find_births(levels, l, block%place, spec, births)
      call block%reserve(block%particles%count + births%count, size(values))
      do p = 1, births%count
         associate (birth => births%list(p))
            call initial_values(levels(l), spec, density, birth, values)
            call block%particles%append(values, child_id(id_base + birth%id, birth%octants, &
                                        birth%refinement, levels(l)%layout%id_bits), int(body, i4))
         end associate
      end do
      if (.not. present(cells)) return
      allocate (cells(4, births%count))
      do p = 1, births%count
         cells(:, p) = [births%list(p)%cell, births%list(p)%half]
      end do
   end subroutine fill_block

   !> Number of particles of a body that live in the block of level l at `place`.
   pure integer function count_in_block(levels, l, place, spec) result(n)
      type(level_t), intent(in) :: levels(:)
      integer, intent(in) :: l, place(3)
      type(body_spec_t), intent(in) :: spec
      type(births_t) :: births
      n = 0
      if (.not. may_hold(levels(l), place)) return
      call find_births(levels, l, place, spec, births)
      n = births%count
   end function count_in_block

   !> Estimated number of particles of a body on the coarsest level, without counting; finer levels add to it.
   elemental real(wp) function expected_count(spec, grid) result(n)
      type(body_spec_t), intent(in) :: spec
      type(grid_level_t), intent(in) :: grid
      real(wp) :: lower(3), upper(3), share
      call spec%shape%bounding_box(lower, upper)
      if (spec%section%is_flat()) then
         n = real(spec%particles_per_cell, wp)**(2.0_wp/3.0_wp)*product(max(0.0_wp, min(upper([1, 3]), &
               grid%upper([1, 3])) - max(lower([1, 3]), grid%lower([1, 3])))/grid%cell)
         return
      end if
      share = spec%shape%volume()/product(upper - lower)
      n = share*spec%particles_per_cell*product(max(0.0_wp, min(upper, grid%upper) &
                                                    - max(lower, grid%lower))/grid%cell)
   end function expected_count

   !> False for blocks that lie well outside the region of their level.
   pure logical function may_hold(level, place)
      type(level_t), intent(in) :: level
      integer, intent(in) :: place(3)
      real(wp) :: origin(3)
      origin = level%grid%block_origin(place)
      may_hold = may_live_on(level, origin - 3.0_wp*level%grid%cell, &
                             origin + (block_size + 2)*level%grid%cell)
   end function may_hold

   !> The particles of a body that live in the block of level l at `place`: the sites of the coarsest level's
   !> lattice that lie in the body and, where finer regions begin, the parts of their particles.
   pure subroutine find_births(levels, l, place, spec, births)
      type(level_t), intent(in) :: levels(:)
      integer, intent(in) :: l, place(3)
      type(body_spec_t), intent(in) :: spec
      type(births_t), intent(inout) :: births
      type(lattice_t) :: lattice
      type(birth_t) :: root
      integer(i8) :: i, j, k, low(3), high(3), extent(3)
      lattice = body_lattice(spec, levels(1)%grid%cell)
      call range_in_block(levels(l), place, lattice, spec%fill == fill_share, low, high)
      extent = lattice%last - lattice%first + 1
      allocate (births%list(max(1, product(int(max(0_i8, high - low + 1))))))
      root%half = 0.5_wp*lattice%spacing
      do k = low(3), high(3)
         do j = low(2), high(2)
            do i = low(1), high(1)
               root%x = lattice%anchor + (real([i, j, k], wp) + 0.5_wp)*lattice%spacing
               ! cut by a symmetry plane
               if (any(root%x < levels(1)%grid%lower) .or. any(root%x > levels(1)%grid%upper)) cycle
               if (.not. may_hold_any(spec, root%x, root%half, size(levels) > 1)) cycle
               root%id = 1 + (i - lattice%first(1)) + extent(1)*((j - lattice%first(2)) &
                     + extent(2)*(k - lattice%first(3)))
               call settle_down(levels, 1, l, place, spec, root, births)
            end do
         end do
      end do
   end subroutine find_births

   !> Assign a particle on level `now`, or its parts, to the level where they live (theory.md, Levels). Those
   !> that live in the block are appended to the list.
   pure recursive subroutine settle_down(levels, now, l, place, spec, birth, births)
      type(level_t), intent(in) :: levels(:)
      integer, intent(in) :: now, l, place(3)
      type(body_spec_t), intent(in) :: spec
      type(birth_t), intent(in) :: birth
      type(births_t), intent(inout) :: births
      type(birth_t) :: part
      integer :: octant
      logical :: refined
      refined = now < size(levels)
      if (refined) refined = lives_on(levels(now + 1), birth%x, spread(birth%half, 1, 3), birth%half, 0.0_wp)
      if (.not. refined) then
         if (now /= l) return
         part = birth
         call find_shape(spec, levels(l)%grid%cell, part)
         if (.not. part%volume > 0.0_wp) return
         if (any(levels(l)%grid%nearest_node(part%x)/block_size /= place)) return
         call births%add(part)
      else if (must_split(levels(now + 1)%grid, levels(now + 1)%region, now + 1, birth%refinement, birth%x, &
                          birth%half)) then
         do octant = 0, 7
            if (spec%section%is_flat() .and. btest(octant, 1)) cycle
            part = birth
            part%half = 0.5_wp*birth%half
            part%x = birth%x + octant_of(octant)*part%half
            if (spec%section%is_flat()) part%x(2) = birth%x(2)
            part%octants = 8_i8*birth%octants + octant
            part%refinement = birth%refinement + 1
            call settle_down(levels, now, l, place, spec, part, births)
         end do
      else
         call settle_down(levels, now + 1, l, place, spec, birth, births)
      end if
   end subroutine settle_down

   !> False if a lattice site has no particle of a body, and no part of one where particles may be split.
   pure logical function may_hold_any(spec, middle, half, splits)
      type(body_spec_t), intent(in) :: spec
      real(wp), intent(in) :: middle(3), half !< m
      logical, intent(in) :: splits
      if (spec%fill == fill_share .or. splits) then
         may_hold_any = may_reach(spec%shape, middle, half)
      else
         may_hold_any = spec%shape%inside(middle)
      end if
   end function may_hold_any

   !> Position and size of a particle: its lattice site, or the part of it inside the shape (theory.md, eq.
   !> cut-cell); volume 0 where that part is too small for a particle.
   pure subroutine find_shape(spec, cell, birth)
      type(body_spec_t), intent(in) :: spec
      real(wp), intent(in) :: cell !< cell size of its level, m
      type(birth_t), intent(inout) :: birth
      type(part_t) :: part
      real(wp) :: cells(3, cell_limit)
      integer :: count, n
      birth%cell = birth%x
      birth%volume = (2.0_wp*birth%half)**3
      birth%halves = birth%half
      if (spec%fill /= fill_share) then
         if (.not. spec%shape%inside(birth%x)) birth%volume = 0.0_wp
         return
      end if
      call cells_of_particle(spec%shape, birth%x, birth%half, spec%section%is_flat(), cells, count)
      do n = 1, count
         call find_part(spec%shape, cells(:, n), birth%half, part, spec%section%is_flat())
      end do
      if (part%volume >= birth%volume*(1.0_wp - whole) .and. count == 1) return
      birth%volume = part%volume
      if (count == 0) return
      birth%x = part%middle()
      if (spec%section%is_flat()) then
         birth%halves = part%half_edges_of_section(0.5_wp*cell, birth%half)
      else
         birth%halves = part%half_edges(0.5_wp*cell)
      end if
   end subroutine find_shape

   !> Append to a list.
   pure subroutine add(self, birth)
      class(births_t), intent(inout) :: self
      type(birth_t), intent(in) :: birth
      type(birth_t), allocatable :: more(:)
      if (self%count == size(self%list)) then
         allocate (more(2*self%count))
         more(:self%count) = self%list
         call move_alloc(more, self%list)
      end if
      self%count = self%count + 1
      self%list(self%count) = birth
   end subroutine add

   !> Initial columns of a new particle; fields of its law follow (material_t%initial).
   pure subroutine initial_values(level, spec, density, birth, values)
      type(level_t), intent(in) :: level
      type(body_spec_t), intent(in) :: spec
      real(wp), intent(in) :: density
      type(birth_t), intent(in) :: birth
      real(wp), intent(out) :: values(:)
      real(wp) :: arm(3)
      values = 0.0_wp
      arm = birth%x - spec%shape%centre()
      associate (at => level%layout, w => spec%angular_velocity)
         values(at%position:at%position + 2) = birth%x
         values(at%velocity:at%velocity + 2) = spec%velocity &
                          + [w(2)*arm(3) - w(3)*arm(2), w(3)*arm(1) - w(1)*arm(3), w(1)*arm(2) - w(2)*arm(1)]
         values(at%volume) = birth%volume
         if (spec%section%is_flat()) & ! the whole extent of its part of the section
            values(at%volume) = birth%volume/(2.0_wp*birth%half)*spec%section%depth(birth%x(1))
         values(at%mass) = density*values(at%volume)
         call first_half_edges(values, at, birth%halves, birth%half)
         values(at%stress:at%stress + 5) = spec%stress
         if (at%start > 0) values(at%start:at%start + 2) = birth%x
         if (at%start_edges > 0) values(at%start_edges:at%start_edges + 2) = birth%halves
         if (at%motion > 0) values(at%motion:at%motion + 8:4) = 1.0_wp
         if (at%orientation > 0) values(at%orientation:at%orientation + 3) = spec%turned_axes()
         if (at%refinement > 0) values(at%refinement) = birth%refinement
         if (at%generation > 0) values(at%generation) = 3*birth%refinement
         if (at%gradient > 0) values(at%gradient:at%gradient + 8) = [0.0_wp, w(3), -w(2), -w(3), 0.0_wp, &
               w(1), w(2), -w(1), 0.0_wp]
      end associate
   end subroutine initial_values

   !> The lattice of a body: n particles along a cell; the shape sets its anchor.
   pure type(lattice_t) function body_lattice(spec, cell) result(lattice)
      type(body_spec_t), intent(in) :: spec
      real(wp), intent(in) :: cell !< m
      real(wp) :: lower(3), upper(3)
      integer :: per_edge
      per_edge = nint(real(spec%particles_per_cell, wp)**(1.0_wp/3.0_wp))
      lattice%spacing = cell/per_edge
      call spec%shape%bounding_box(lower, upper)
      lattice%anchor = spec%shape%lattice_origin()
      lattice%first = floor((lower - lattice%anchor)/lattice%spacing + 1.0e-6_wp, i8)
      lattice%last = ceiling((upper - lattice%anchor)/lattice%spacing - 1.0e-6_wp, i8) - 1
      if (.not. spec%section%is_flat()) return
      lattice%anchor(2) = -0.5_wp*lattice%spacing ! one layer, on the plane y = 0
      lattice%first(2) = 0
      lattice%last(2) = 0
   end function body_lattice

   !> True when a body has a particle at a lattice site.
   pure logical function holds_place(spec, cell, middle, half)
      type(body_spec_t), intent(in) :: spec
      real(wp), intent(in) :: cell            !< cell size of the particle's level, m
      real(wp), intent(in) :: middle(3), half !< of the site, m
      type(birth_t) :: birth
      birth%x = middle
      birth%half = half
      call find_shape(spec, cell, birth)
      holds_place = birth%volume > 0.0_wp
   end function holds_place

   !> The id before the first one of a body's particles.
   pure integer(i8) function first_id(body, layout)
      integer, intent(in) :: body
      type(layout_t), intent(in) :: layout
      first_id = (body - 1)*layout%ids_of_body
   end function first_id

   !> Number the ids: a range for each body, a power of ten so that ranges of different bodies do not overlap;
   !> the bits above the last range number the splits. An error where these bits are too few.
   subroutine number_ids(layout, bodies, cell, splits, error)
      type(layout_t), intent(inout) :: layout
      type(body_spec_t), intent(in) :: bodies(:)
      real(wp), intent(in) :: cell   !< cell size of the coarsest level, m
      integer, intent(in) :: splits  !< number of splits that the bits must allow
      type(error_t), intent(inout) :: error
      integer :: body
      layout%ids_of_body = 1000_i8
      do body = 1, size(bodies)
         do while (layout%ids_of_body <= product(lattice_extent(bodies(body), cell)))
            layout%ids_of_body = 10*layout%ids_of_body
         end do
      end do
      layout%id_bits = bit_size(1_i8) - leadz(size(bodies)*layout%ids_of_body)
      if (splits > 0 .and. layout%max_generations() < splits) &
         call fail(error, exit_input, 'the ids of '//to_text(size(bodies))//' bodies of up to '// &
                   to_text(layout%ids_of_body)//' particles leave room for '// &
                   to_text(layout%max_generations())//' splits, and levels and domains may need '// &
                   to_text(splits)//'; try fewer bodies or levels, or larger cells')
   end subroutine number_ids

   !> Lattice sites of a body along each axis. Ids of its particles, from 1, count them along x first, then y,
   !> then z.
   pure function lattice_extent(spec, cell) result(extent)
      type(body_spec_t), intent(in) :: spec
      real(wp), intent(in) :: cell !< cell size of the coarsest level, m
      integer(i8) :: extent(3)
      type(lattice_t) :: lattice
      lattice = body_lattice(spec, cell)
      extent = lattice%last - lattice%first + 1
   end function lattice_extent

   !> The part of a lattice whose centres may lie in a block.
   pure subroutine range_in_block(level, place, lattice, moved, low, high)
      type(level_t), intent(in) :: level
      integer, intent(in) :: place(3)
      type(lattice_t), intent(in) :: lattice
      logical, intent(in) :: moved !< particles need not lie in the middle of their sites
      integer(i8), intent(out) :: low(3), high(3)
      real(wp) :: from(3), to(3)
      from = level%grid%block_origin(place) - 0.5_wp*level%grid%cell
      to = from + block_size*level%grid%cell
      if (level%number > 1 .or. moved) then ! a particle here may be part of a larger one
         from = from - lattice%spacing
         to = to + lattice%spacing
      end if
      low = max(lattice%first, floor((from - lattice%anchor)/lattice%spacing - 0.5_wp, i8))
      high = min(lattice%last, ceiling((to - lattice%anchor)/lattice%spacing - 0.5_wp, i8))
   end subroutine range_in_block

end module m_body
