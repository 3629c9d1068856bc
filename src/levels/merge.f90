!> Eight siblings that have all left the finer level are merged into one particle (theory.md, eq.
!> level-merge).
module m_merge
   use m_kinds, only: wp, i4, i8
   use m_sorting, only: sorted_order
   use m_field_table, only: layout_t, shares_t
   use m_level, only: level_t
   use m_block, only: block_t
   use m_polar, only: cofactors, determinant
   use m_half_edges, only: half_edges, set_half_edges, extents
   use m_split, only: stuff_t, edges_to_split, octant_of, octants_of
   use m_locate, only: bin_of
   use m_migration, only: frame_of, take_out
   use m_scene_materials, only: materials_t
   use m_inner_motion, only: inner_motion
   implicit none
   private
   public :: merge_siblings, drop

   real(wp), parameter :: astray = 0.25_wp !< distance of a part from its octant of the whole, in edges of the
                                           !< whole: parts beyond it are not merged
   real(wp), parameter :: distance = 0.5_wp !< of the merged particle from the finer level's region, in cells,
                                            !< so that it does not return soon

contains

   !> Merge particles in block b of a level, which those of the finer level move out to. Mass, momentum and
   !> volume are conserved; `lost` is the energy lost (J).
   subroutine merge_siblings(level, finer, b, materials, stuff, merged, lost)
      type(level_t), intent(inout) :: level
      type(level_t), intent(in) :: finer
      integer, intent(in) :: b
      type(materials_t), intent(in) :: materials
      type(stuff_t), intent(in) :: stuff(:) !< by body
      integer, intent(out) :: merged !< particles created
      real(wp), intent(out) :: lost
      integer(i8), allocatable :: key(:)
      integer(i4), allocatable :: small(:), members(:), gone(:)
      integer :: first, generation, last, n, p, parts
      merged = 0
      lost = 0.0_wp
      parts = size(octants_of(level%layout%section))
      associate (block => level%blocks(b), at => level%layout)
         if (block%particles%count < parts) return
         if (finer%region%clear_of_edge(block%lowest, block%highest, 3.0_wp*level%grid%cell)) return
         n = count(block%particles%column(:block%particles%count, at%refinement) > level%number - 0.5_wp)
         if (n < parts) return
         small = pack([(int(p, i4), p=1, block%particles%count)], &
                      block%particles%column(:block%particles%count, at%refinement) > level%number - 0.5_wp)
         key = [(parent_id(block%particles%id(small(p)), nint(block%particles%column(small(p), &
               at%generation)), at%id_bits), p=1, n)]
         small = small(sorted_order(key, block%particles%id(small)))
         allocate (gone(0))
         first = 1
         do while (first <= n)
            last = first
            do while (last < n)
               if (parent(last + 1) /= parent(first)) exit
               last = last + 1
            end do
            if (last - first >= parts - 1) then
               do generation = 3, at%max_generations() ! parts of parts may have the same parent
                  members = pack(small(first:last), &
                                 nint(block%particles%column(small(first:last), at%generation)) == generation)
                  if (size(members) == parts) &
                     call merge_eight(level, finer, b, members, materials, stuff, merged, lost, gone)
               end do
            end if
            first = last + 1
         end do
         if (merged == 0) return
         gone = gone(sorted_order(int(gone, i8), int(gone, i8)))
         call drop(block, gone)
      end associate
   contains
      !> Id of the parent of the p-th split particle.
      integer(i8) function parent(p)
         integer, intent(in) :: p
         associate (particles => level%blocks(b)%particles)
            parent = parent_id(particles%id(small(p)), nint(particles%column(small(p), &
                  level%layout%generation)), level%layout%id_bits)
         end associate
      end function parent
   end subroutine merge_siblings

   !> The id of the particle that this one is an eighth of: without the bits of its last three generations.
   pure integer(i8) function parent_id(id, generation, id_bits)
      integer(i8), intent(in) :: id
      integer, intent(in) :: generation, id_bits
      integer :: g
      parent_id = id
      do g = generation - 3, generation - 1
         parent_id = ibclr(parent_id, id_bits + g)
      end do
   end function parent_id

   !> Append the particle merged from eight (in a section four) parts, unless it would be near the finer
   !> region; list the parts for removal.
   subroutine merge_eight(level, finer, b, eight, materials, stuff, merged, lost, gone)
      type(level_t), intent(inout) :: level
      type(level_t), intent(in) :: finer
      integer, intent(in) :: b
      integer(i4), intent(in) :: eight(:)
      type(materials_t), intent(in) :: materials
      type(stuff_t), intent(in) :: stuff(:) !< by body
      integer, intent(inout) :: merged
      real(wp), intent(inout) :: lost
      integer(i4), allocatable, intent(inout) :: gone(:)
      real(wp) :: values(size(eight) + 1, level%table%columns), reach(3)
      integer :: generation, n
      logical :: sound
      integer(i4) :: body
      associate (block => level%blocks(b), at => level%layout)
         n = size(eight)
         body = block%particles%body(eight(1))
         generation = nint(block%particles%column(eight(1), at%generation))
         if (at%damage > 0) then ! failed particles are not merged with others
            if (.not. (all(block%particles%column(eight, at%damage) >= 1.0_wp) &
                       .or. all(block%particles%column(eight, at%damage) < 1.0_wp))) return
         end if
         values(:n, :) = block%particles%column(eight, :)
         if (at%grain > 0) then ! parts of several grains are not merged
            if (any(abs(values(:n, at%grain) - values(1, at%grain)) > 0.5_wp)) return
         end if
         call join(values, level%table%shares(), at)
         call join_domains(values, int(ibits(block%particles%id(eight), at%id_bits + generation - 3, 3)), &
                           at, sound)
         if (.not. sound) return
         values(n + 1, at%generation) = generation - 3
         values(n + 1, at%refinement) = values(1, at%refinement) - 1.0_wp
         if (at%follows) then ! it must not need splitting at once
            if (any(edges_to_split(values, n + 1, at, level%grid%cell, stuff(body)))) return
         end if
         reach = extents(values(n + 1, :), at) + distance*level%grid%cell
         if (finer%region%overlaps(values(n + 1, at%position:at%position + 2) - reach, &
                                   values(n + 1, at%position:at%position + 2) + reach)) return
         if (allocated(finer%layer)) then ! it must not return at once
            if (finer%layer%overlaps(values(n + 1, at%position:at%position + 2), &
                                     values(n + 1, at%position:at%position + 2))) return
         end if
         lost = lost + energy(1, n) - energy(n + 1, n + 1)
         call block%reserve(block%particles%count + 1, level%table%columns)
         call block%particles%append(values(n + 1, :), &
                                     parent_id(block%particles%id(eight(1)), generation, at%id_bits), body)
         block%cells%bin(block%particles%count) = bin_of(values(n + 1, at%position:at%position + 2), &
                                                         frame_of(level, block))
         merged = merged + 1
         gone = [gone, eight]
      end associate
   contains
      !> Energy of some of the nine particles, J.
      real(wp) function energy(first, last)
         integer, intent(in) :: first, last
         real(wp) :: inner, angular(3)
         integer :: p
         call inner_motion(values, first, last, level%layout, inner, angular)
         associate (law => materials%slots(materials%of_body(body))%law, v => level%layout%velocity)
            energy = inner + law%strain_energy(values, level%layout, first, last) &
                     + law%plastic_energy(values, first, last)
            do p = first, last
               energy = energy + 0.5_wp*values(p, level%layout%mass)*sum(values(p, v:v + 2)**2)
            end do
         end associate
      end function energy
   end subroutine merge_eight

   !> Merge the domains of eight parts: the faces are at the mean positions of the outer parts' faces
   !> (theory.md, eq. level-merge). `sound`: each part is near its octant.
   pure subroutine join_domains(values, octants, layout, sound)
      real(wp), intent(inout) :: values(:, :) !< (n + 1, columns): parts, then the whole with its position set
      integer, intent(in) :: octants(:)       !< of the parts, 0 to 7
      type(layout_t), intent(in) :: layout
      logical, intent(out) :: sound
      real(wp), dimension(3, 3) :: r, inverse
      real(wp) :: signs(3, size(octants)), place(3)
      integer :: k, n, p
      n = size(octants)
      associate (h => layout%start_edges) ! now the mean of the parts
         if (h > 0) values(n + 1, h:h + 2) = 2.0_wp*values(n + 1, h:h + 2)
      end associate
      associate (x => layout%position)
         if (.not. layout%follows) then
            sound = .true.
            call set_half_edges(values(n + 1, :), layout, 2.0_wp*half_edges(values(1, :), layout))
            return
         end if
         r = 0.0_wp
         do p = 1, n
            signs(:, p) = octant_of(octants(p))
            if (layout%section%is_flat()) signs(2, p) = 0.0_wp
            r = r + half_edges(values(p, :), layout)/n
            do k = 1, 3
               r(:, k) = r(:, k) + signs(k, p)*values(p, x:x + 2)/n
            end do
         end do
         if (layout%section%is_flat()) r(:, 2) = 2.0_wp*r(:, 2)
         call set_half_edges(values(n + 1, :), layout, r)
         r = half_edges(values(n + 1, :), layout)
         sound = determinant(r) > 0.0_wp
         if (.not. sound) return
         inverse = transpose(cofactors(r))/determinant(r)
         do p = 1, n
            place = matmul(inverse, values(p, x:x + 2) - values(n + 1, x:x + 2))
            sound = sound .and. all(abs(place - 0.5_wp*signs(:, p)) < 2.0_wp*astray)
         end do
      end associate
   end subroutine join_domains

   !> Merge the columns of eight parts: sums and means.
   pure subroutine join(values, shares, layout)
      real(wp), intent(inout) :: values(:, :) !< (n + 1, columns): parts and the whole
      type(shares_t), intent(in) :: shares
      type(layout_t), intent(in) :: layout
      integer :: c, n, weight
      n = size(values, 1) - 1
      do c = 1, size(values, 2)
         if (shares%extensive(c)) then
            values(n + 1, c) = sum(values(:n, c))
         else
            weight = merge(layout%mass, layout%volume, shares%by_mass(c))
            values(n + 1, c) = sum(values(:n, weight)*values(:n, c))/sum(values(:n, weight))
         end if
      end do
      if (layout%section%is_round()) then ! where the ring has its volume
         associate (x => layout%position, areas => values(:n, layout%volume)/values(:n, layout%position))
            values(n + 1, x) = values(n + 1, layout%volume)/sum(areas)
            values(n + 1, x + 2) = sum(areas*values(:n, x + 2))/sum(areas)
            do c = layout%start, layout%start + merge(2, -1, layout%start > 0)
               values(n + 1, c) = sum(areas*values(:n, c))/sum(areas)
            end do
         end associate
      end if
      call join_faces(values, shares, layout%position)
   end subroutine join

   !> Merge the faces that parts of a particle carry: the areas are summed already, the middle is the mean by
   !> area.
   pure subroutine join_faces(values, shares, x)
      real(wp), intent(inout) :: values(:, :) !< (n + 1, columns): parts and the whole
      type(shares_t), intent(in) :: shares
      integer, intent(in) :: x                !< first column of the position
      real(wp) :: area(size(values, 1) - 1), middle(3)
      integer :: f, n, p
      n = size(area)
      do f = 1, size(shares%faces, 2)
         associate (a => shares%faces(1, f), arm => shares%faces(2, f))
            area = norm2(values(:n, a:a + 2), dim=2)
            if (.not. any(area > 0.0_wp)) cycle
            middle = 0.0_wp
            do p = 1, n
               middle = middle + area(p)*(values(p, x:x + 2) + values(p, arm:arm + 2))
            end do
            values(n + 1, arm:arm + 2) = middle/sum(area) - values(n + 1, x:x + 2)
         end associate
      end do
   end subroutine join_faces

   !> Remove particles from a block; `gone` is rising.
   subroutine drop(block, gone)
      type(block_t), intent(inout) :: block
      integer(i4), intent(in) :: gone(:)
      block%emigrants = gone
      block%emigrant_count = size(gone)
      call take_out(block)
   end subroutine drop

end module m_merge
