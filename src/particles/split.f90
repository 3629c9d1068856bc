!> Particles whose domains have become too long are split in two (doc/developer/theory.md, eq. split). Ids of
!> halves: see doc/developer/design.md.
module m_split
   use m_kinds, only: wp, i8
   use m_block, only: block_t
   use m_particle_store, only: particle_store_t
   use m_field_table, only: field_table_t, layout_t, shares_t
   use m_half_edges, only: half_edges, set_half_edges, set_half_edge, lengths_squared, longest_squared
   use m_grid_level, only: grid_level_t
   use m_region, only: region_t
   use m_section_parts, only: octant_of, octants_of, split_in_four, share_of_ring, beside_axis, &
                              carried, share_faces, share_start
   implicit none
   private
   public :: stuff_t, split_long, split_in_eight, octants_of, must_split, edges_to_split, is_whole, &
             largest_tension, octant_of, child_id, longest

   !> Longest half edge, in cells. One particle a cell begins with 0.5: a slightly strained body must not be
   !> split.
   real(wp), parameter :: longest = 0.525_wp

   ! Under tension nodes must resolve more of the motion within a cell (theory.md, eq. pulled).
   real(wp), parameter :: longest_pulled = 0.35_wp !< half edge of a particle under tension, in cells; shorter
                                                   !< where the tension approaches the plane-wave modulus:
   real(wp), parameter :: longest_at_modulus = 0.28_wp !< this where it equals the modulus, and inversely
                                                       !< proportional to it,
   real(wp), parameter :: shortest_pulled = 0.2_wp  !< but never shorter than this
   real(wp), parameter :: longest_whole = 0.505_wp !< for one particle that fills a cell: limit of the edge
                                                   !< under tension,
   real(wp), parameter :: longest_box = 0.50005_wp  !< and the same for a box along the axes
   real(wp), parameter :: whole = 0.75_wp !< a particle with more than this of the mass of a cell was never
                                          !< split
   real(wp), parameter :: min_tension = 0.01_wp !< of the modulus: smaller tensions do not shorten the limit,
                                                !< which spares metals
   real(wp), parameter :: pulls = 0.1_wp !< a normal stress of at least this share of the largest component
                                         !< counts as tension

   !> Material data of a body that splitting needs.
   type :: stuff_t
      real(wp) :: density = 0.0_wp !< undeformed, kg/m3
      real(wp) :: modulus = 0.0_wp !< of a plane wave, Pa
   end type stuff_t

contains

   !> Split the particles of a block whose half edges are too long (theory.md, eqs too-long, pulled), each
   !> across all of these, in storage order. The lower part keeps position and id, the others are appended.
   !> `worn_out`: a particle that has reached the limit of splits and is too long, 0 if there is none.
   subroutine split_long(block, table, layout, cell, stuff, splits, worn_out, parent)
      type(block_t), intent(inout) :: block
      type(field_table_t), intent(in) :: table
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: cell          !< m
      type(stuff_t), intent(in) :: stuff(:) !< by body
      integer, intent(out) :: splits        !< particles added
      integer, intent(out) :: worn_out
      integer, allocatable, intent(out), optional :: parent(:) !< for each new particle, the one it was part
                                                               !< of
      type(shares_t) :: shares
      logical :: across(3)
      integer :: suspect(block%particles%count) !< 0 where nothing is too long
      integer :: before, n, p, parts
      splits = 0
      worn_out = 0
      if (present(parent)) allocate (parent(0))
      n = block%particles%count
      parts = 0
      call find_suspects(n, block%particles%column, layout, cell, minval(stuff%modulus), suspect)
      if (all(suspect == 0)) return
      do p = 1, n
         if (suspect(p) == 0) cycle
         across = edges_to_split(block%particles%column, p, layout, cell, stuff(block%particles%body(p)))
         if (any(across)) parts = parts + 2**count(across) - 1
      end do
      if (parts == 0) return
      if (present(parent)) then
         deallocate (parent)
         allocate (parent(parts), source=0)
      end if
      shares = table%shares()
      call block%reserve(n + parts, table%columns)
      do p = 1, n
         if (suspect(p) == 0) cycle
         across = edges_to_split(block%particles%column, p, layout, cell, stuff(block%particles%body(p)))
         if (.not. any(across)) cycle
         if (nint(block%particles%column(p, layout%generation)) + count(across) &
             > layout%max_generations()) then
            worn_out = p
            if (present(parent)) parent = parent(:block%particles%count - n)
            return
         end if
         before = block%particles%count
         call split_across(block%particles, p, across, layout, shares)
         splits = splits + 2**count(across) - 1
         if (present(parent)) parent(before - n + 1:block%particles%count - n) = p
      end do
      block%cells%bin(n + 1:block%particles%count) = 0
      call block%cells%outdate()
   end subroutine split_long

   !> Find, in vectors, the particles that may have to be split: all others are short enough at any stress, or
   !> have no stress component large enough to split the longest edge.
   pure subroutine find_suspects(n, column, layout, cell, modulus, suspect)
      integer, intent(in) :: n
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: cell     !< m
      real(wp), intent(in) :: modulus  !< least of all bodies, Pa
      integer, intent(out) :: suspect(n)
      real(wp), parameter :: less = 1.0_wp - 1.0e-9_wp !< guards against round-off
      real(wp) :: length(n), stress, least, pulls_at
      integer :: p
      least = less*(min_tension*modulus)**2
      pulls_at = less*(longest_at_modulus*modulus*cell)**2
      call longest_squared(n, column, layout, length)
      associate (s => layout%stress)
         !$omp simd private(stress)
         do p = 1, n
            stress = column(p, s)**2 + column(p, s + 1)**2 + column(p, s + 2)**2 &
                     + 2.0_wp*(column(p, s + 3)**2 + column(p, s + 4)**2 + column(p, s + 5)**2)
            suspect(p) = merge(1, 0, length(p) > less*(longest_box*cell)**2 &
                               .or. (length(p) > less*(shortest_pulled*cell)**2 .and. stress > least &
                                     .and. (length(p) > less*(longest_pulled*cell)**2 &
                                            .or. stress*length(p) > pulls_at)))
         end do
      end associate
   end subroutine find_suspects

   !> The half edges across which a particle must be split: those that are too long for the weights; under
   !> tension, those that are too long for the tension.
   pure function edges_to_split(column, p, layout, cell, stuff) result(across)
      real(wp), intent(in), contiguous :: column(:, :) !< (particles, columns)
      integer, intent(in) :: p
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: cell       !< m
      type(stuff_t), intent(in) :: stuff !< of the particle's body
      logical :: across(3)
      real(wp) :: squares(3), tension, limit
      across = .false.
      squares = lengths_squared(column, p, layout)
      if (layout%section%is_flat()) squares(2) = 0.0_wp ! the edge normal to a section does not count
      if (.not. maxval(squares) > (shortest_pulled*cell)**2) return ! also if a length is NaN
      if (is_whole(column(p, :), layout, cell, stuff)) then
         limit = cell*merge(longest_whole, longest_box, layout%domain > 0)
         if (maxval(squares) > limit**2) then
            tension = largest_tension(column(p, :), layout, limit)
            if (tension > 0.0_wp) across = squares > (longest_pulled*cell)**2
         end if
      else
         tension = largest_tension(column(p, :), layout, 0.0_wp)
         if (tension > min_tension*stuff%modulus) then
            limit = cell*max(shortest_pulled, min(longest_pulled, longest_at_modulus*stuff%modulus/tension))
            across = squares > limit**2
         end if
      end if
      where (squares > (longest*cell)**2) across = .true. ! where two are as long, neither axis comes first
   end function edges_to_split

   !> True for a particle that fills a cell.
   pure logical function is_whole(values, layout, cell, stuff)
      real(wp), intent(in) :: values(:)  !< the particle's columns
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: cell       !< m
      type(stuff_t), intent(in) :: stuff !< of its body
      if (layout%section%is_flat()) then
         is_whole = values(layout%mass) &
                    > whole*stuff%density*cell**2*layout%section%depth(values(layout%position))
      else
         is_whole = values(layout%mass) > whole*stuff%density*cell**3
      end if
   end function is_whole

   !> The largest normal stress (Pa) along a half edge of more than the given length, 0 if none counts as
   !> tension.
   pure real(wp) function largest_tension(values, layout, length) result(tension)
      real(wp), intent(in) :: values(:) !< the particle's columns
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: length    !< m
      real(wp) :: r(3, 3), s(3, 3), along, square
      integer :: k
      r = half_edges(values, layout)
      associate (at => layout%stress)
         s(:, 1) = values([at, at + 5, at + 4])
         s(:, 2) = values([at + 5, at + 1, at + 3])
         s(:, 3) = values([at + 4, at + 3, at + 2])
      end associate
      tension = 0.0_wp
      do k = 1, 3
         if (k == 2 .and. layout%section%is_flat()) cycle
         square = dot_product(r(:, k), r(:, k))
         if (.not. square > length**2) cycle
         along = dot_product(r(:, k), matmul(s, r(:, k)))/square
         if (along > pulls*maxval(abs(s))) tension = max(tension, along)
      end do
   end function largest_tension

   !> True when a particle that moves to a finer level, or lives there, must be split into eight: its centre
   !> is inside and it is larger than the particles of that level, or it is too large for the weights there
   !> (theory.md, eq. level-split).
   pure logical function must_split(grid, region, number, refinement, x, half)
      type(grid_level_t), intent(in) :: grid
      type(region_t), intent(in) :: region
      integer, intent(in) :: number     !< of the level, from 1
      integer, intent(in) :: refinement !< number of splits into eight of the particle
      real(wp), intent(in) :: x(3)      !< its centre, m
      real(wp), intent(in) :: half      !< its longest half edge, m
      must_split = half > longest*grid%cell
      if (refinement < number - 1 .and. .not. must_split) must_split = region%holds(x)
   end function must_split

   !> Id of a part of a particle: three bits for each split into eight, as if it had been halved along x, y,
   !> z.
   pure integer(i8) function child_id(id, octants, splits, id_bits)
      integer(i8), intent(in) :: id, octants !< the last split in the lowest three bits
      integer, intent(in) :: splits
      integer, intent(in) :: id_bits !< of the layout
      integer :: s
      child_id = id
      do s = 1, splits
         child_id = ior(child_id, ishft(ibits(octants, 3*(splits - s), 3), id_bits + 3*(s - 1)))
      end do
   end function child_id

   !> The columns of the eight parts of a particle, halved along all its edges. With the velocity gradient
   !> each part has the velocity at its own centre. The bits of its id that distinguish the parts are those of
   !> `generation` to `generation` + 2.
   pure subroutine split_in_eight(values, layout, shares, parts)
      real(wp), intent(in) :: values(:)
      type(layout_t), intent(in) :: layout
      type(shares_t), intent(in) :: shares
      real(wp), intent(out) :: parts(:, 0:) !< (columns, 0:7); absent parts, on a section, are 0
      real(wp) :: r(3, 3), shift(3), l(3, 3), side(3)
      integer :: octant, k
      if (layout%section%is_flat()) then
         call split_in_four(values, layout, shares, parts)
         return
      end if
      r = 0.5_wp*half_edges(values, layout)
      l = 0.0_wp
      if (layout%gradient > 0) l = reshape(values(layout%gradient:layout%gradient + 8), [3, 3])
      do octant = 0, 7
         shift = matmul(r, octant_of(octant))
         associate (part => parts(:, octant))
            part = merge(0.125_wp*values, values, shares%extensive)
            part(carried(shares)) = values(carried(shares))
            side = octant_of(octant)
            do k = 1, 3
               call share_faces(part, shares, layout, values(layout%position), 2.0_wp*r, k, side(k))
            end do
            part(layout%position:layout%position + 2) = values(layout%position:layout%position + 2) + shift
            part(layout%velocity:layout%velocity + 2) = values(layout%velocity:layout%velocity + 2) &
                                                        + matmul(l, shift)
            call set_half_edges(part, layout, r)
            call share_start(part, values, layout, 0.5_wp*octant_of(octant), shift)
            part(layout%generation) = values(layout%generation) + 3.0_wp
            part(layout%refinement) = values(layout%refinement) + 1.0_wp
         end associate
      end do
   end subroutine split_in_eight

   !> Split particle p across some of its half edges: 1, 3 or 7 particles are appended.
   subroutine split_across(particles, p, across, layout, shares)
      type(particle_store_t), intent(inout) :: particles
      integer, intent(in) :: p
      logical, intent(in) :: across(3)
      type(layout_t), intent(in) :: layout
      type(shares_t), intent(in) :: shares
      integer :: first, k, last, q
      first = particles%count + 1
      do k = 1, 3
         if (.not. across(k)) cycle
         last = particles%count
         call halve(particles, p, k, layout, shares)
         do q = first, last
            call halve(particles, q, k, layout, shares)
         end do
      end do
   end subroutine split_across

   !> Split particle p across half edge k. With the velocity gradient L each half has the velocity at its own
   !> centre.
   subroutine halve(particles, p, k, layout, shares)
      type(particle_store_t), intent(inout) :: particles
      integer, intent(in) :: p, k
      type(layout_t), intent(in) :: layout
      type(shares_t), intent(in) :: shares
      real(wp), dimension(size(shares%extensive)) :: values, upper
      real(wp) :: r(3, 3), shift(3), faster(3), low, way(3), radius
      real(wp) :: along(3)
      integer(i8) :: new_id
      integer :: generation
      values = particles%column(p, :)
      r = half_edges(values, layout)
      shift = 0.5_wp*r(:, k)
      faster = 0.0_wp
      if (layout%gradient > 0) faster = matmul(reshape(values(layout%gradient:layout%gradient + 8), [3, 3]), &
                                               shift)
      radius = values(layout%position)
      way = shift
      low = 0.5_wp
      if (layout%section%is_round()) then
         way = beside_axis(values, layout, shift)
         low = 0.5_wp*share_of_ring(values, layout, -way)
      end if
      generation = nint(values(layout%generation))
      new_id = ibset(particles%id(p), layout%id_bits + generation)
      upper = values
      where (shares%extensive) values = low*values
      call set_half_edge(values, layout, k, shift)
      values(layout%generation) = generation + 1
      values(carried(shares)) = upper(carried(shares)) ! the unshared values: each half takes its own part
      upper = values
      if (layout%section%is_round()) then
         where (shares%extensive) upper = (1.0_wp - low)/low*upper
         upper(carried(shares)) = values(carried(shares))
         values(layout%velocity + 2) = values(layout%velocity + 2) - (1.0_wp - 2.0_wp*low)*faster(3)
         upper(layout%velocity + 2) = values(layout%velocity + 2)
      end if
      associate (x => layout%position, v => layout%velocity)
         values(x:x + 2) = values(x:x + 2) - way
         values(v:v + 2) = values(v:v + 2) - faster
         upper(x:x + 2) = upper(x:x + 2) + way
         upper(v:v + 2) = upper(v:v + 2) + faster
      end associate
      along = 0.0_wp
      along(k) = 0.5_wp
      call share_start(upper, particles%column(p, :), layout, along, way)
      call share_start(values, particles%column(p, :), layout, -along, -way)
      call share_faces(values, shares, layout, radius, r, k, -1.0_wp)
      call share_faces(upper, shares, layout, radius, r, k, 1.0_wp)
      particles%column(p, :) = values
      call particles%append(upper, new_id, particles%body(p))
   end subroutine halve

end module m_split
