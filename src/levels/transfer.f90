!> Transfer of particles between two levels: to the finer one when their domains reach into its region, to the
!> coarser one when they have left it (theory.md, Where a particle lives).
module m_transfer
   use m_kinds, only: wp, i4, i8
   use m_constants, only: exit_numerical
   use m_errors, only: error_t, fail
   use m_text, only: to_text
   use m_communicator, only: communicator_t
   use m_field_table, only: layout_t, shares_t
   use m_level, only: level_t
   use m_block, only: block_t
   use m_membership, only: lives_on, may_live_on
   use m_migration, only: migration_t, take_out
   use m_walls, only: keep_inside
   use m_half_edges, only: extents, longest_half_edge, domain_sizes
   use m_split, only: split_in_eight, octants_of, must_split
   implicit none
   private
   public :: find_changes, change_levels

   real(wp), parameter :: exit_margin = 0.25_wp !< margin by which particles must be further outside to leave
                                                !< than to enter, in cells of the finer level

contains

   !> List as emigrants of their blocks the particles that must leave a level or be split on it; returns their
   !> number. Of the coarser level those that reach into the finer one's region; of the finer level those that
   !> no longer do, and those whose centres have come inside before they were split.
   integer function find_changes(coarse, fine) result(changes)
      type(level_t), intent(inout) :: coarse, fine
      integer :: b
      changes = 0
      do b = 1, size(coarse%blocks)
         coarse%blocks(b)%emigrant_count = 0
         if (coarse%blocks(b)%particles%count == 0) cycle
         associate (block => coarse%blocks(b))
            if (may_live_on(fine, block%lowest - coarse%grid%cell, block%highest + coarse%grid%cell)) &
               call list_changes(fine, block, on_fine=.false.)
            changes = changes + block%emigrant_count
         end associate
      end do
      do b = 1, size(fine%blocks)
         fine%blocks(b)%emigrant_count = 0
         if (fine%blocks(b)%particles%count == 0) cycle
         associate (block => fine%blocks(b))
            if (.not. fine%region%holds_box(block%lowest, block%highest, 3.0_wp*fine%grid%cell)) &
               call list_changes(fine, block, on_fine=.true.)
            changes = changes + block%emigrant_count
         end associate
      end do
   end function find_changes

   !> List as emigrants the particles of a block that must change level: on the coarser level those that reach
   !> into the finer one's region, on the finer level those that no longer do or must be split.
   subroutine list_changes(fine, block, on_fine)
      type(level_t), intent(in) :: fine
      type(block_t), intent(inout) :: block
      logical, intent(in) :: on_fine !< the block is on the finer level
      integer(i4) :: found(block%particles%count)
      real(wp) :: half(block%particles%count), e(block%particles%count, 3), x(3), margin
      integer :: n, p
      logical :: changes
      n = 0
      margin = 0.0_wp
      if (on_fine) margin = exit_margin*fine%grid%cell
      call domain_sizes(block%particles, fine%layout, e, half)
      associate (column => block%particles%column, at => fine%layout)
         do p = 1, block%particles%count
            x = column(p, at%position:at%position + 2)
            changes = lives_on(fine, x, e(p, :), half(p), margin) .neqv. on_fine
            if (on_fine .and. .not. changes) &
               changes = must_split(fine%grid, fine%region, fine%number, nint(column(p, at%refinement)), x, &
                                    half(p))
            if (.not. changes) cycle
            n = n + 1
            found(n) = p
         end do
      end associate
      block%emigrant_count = n
      if (n > size(block%emigrants)) block%emigrants = found(:n)
      block%emigrants(:n) = found(:n)
   end subroutine list_changes

   !> Collective: move the particles listed by find_changes to their new level, split where necessary. The
   !> blocks there must exist. Fails when an id has no room for another split.
   subroutine change_levels(communicator, coarse, fine, coarse_migration, fine_migration, splits, error)
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(inout) :: coarse, fine
      type(migration_t), intent(inout) :: coarse_migration, fine_migration
      integer(i8), intent(inout) :: splits
      type(error_t), intent(inout) :: error
      type(shares_t) :: shares
      integer :: b
      shares = fine%table%shares()
      do b = 1, size(coarse%blocks)
         if (fine%layout%edge_stress > 0) call set_edge_stress(coarse%blocks(b), fine%layout)
         call send_off(coarse%blocks(b), 0.0_wp)
      end do
      do b = 1, size(fine%blocks)
         call send_off(fine%blocks(b), exit_margin*fine%grid%cell)
      end do
      do b = 1, size(coarse%blocks)
         if (coarse%blocks(b)%cells%counted < 0) call coarse%keep_order(b)
      end do
      do b = 1, size(fine%blocks)
         if (fine%blocks(b)%cells%counted < 0) call fine%keep_order(b)
      end do
      call coarse_migration%exchange_levels(communicator, coarse)
      call fine_migration%exchange_levels(communicator, fine)
      call communicator%agree(error)
   contains
      subroutine send_off(block, margin)
         type(block_t), intent(inout) :: block
         real(wp), intent(in) :: margin !< m
         real(wp), allocatable :: parts(:, :)
         integer(i8), allocatable :: ids(:)
         integer :: c, n
         if (block%emigrant_count == 0) return
         do n = 1, block%emigrant_count
            associate (p => block%emigrants(n))
               call split_to_live(fine, shares, margin, block%particles%column(p, :), block%particles%id(p), &
                                  block%particles%body(p), parts, ids, error)
               splits = splits + size(ids) - 1
               do c = 1, size(ids)
                  if (lives_in(fine, parts(:, c), margin)) then
                     call fine_migration%send_to_level(communicator, fine, parts(:, c), ids(c), &
                                                       block%particles%body(p))
                  else
                     call coarse_migration%send_to_level(communicator, coarse, parts(:, c), ids(c), &
                                                         block%particles%body(p))
                  end if
               end do
            end associate
         end do
         call take_out(block)
      end subroutine send_off
   end subroutine change_levels

   !> Entering particles start with all their stress as edge stress; where the region itself moved,
   !> move_regions resets it.
   subroutine set_edge_stress(block, at)
      type(block_t), intent(inout) :: block
      type(layout_t), intent(in) :: at
      integer :: n
      associate (column => block%particles%column, s => at%stress, e => at%edge_stress)
         do n = 1, block%emigrant_count
            column(block%emigrants(n), e:e + 5) = column(block%emigrants(n), s:s + 5)
         end do
      end associate
   end subroutine set_edge_stress

   !> True when a particle reaches into a level's region grown by a margin (m).
   pure logical function lives_in(level, values, margin)
      type(level_t), intent(in) :: level
      real(wp), intent(in) :: values(:), margin
      associate (x => values(level%layout%position:level%layout%position + 2), &
                 e => extents(values, level%layout))
         lives_in = lives_on(level, x, e, longest_half_edge(values, level%layout), margin)
      end associate
   end function lives_in

   !> Split a particle that changes level into parts that can live there: itself, or where the finer level
   !> requires it its eighths, or eighths of those.
   subroutine split_to_live(fine, shares, margin, values, id, body, parts, ids, error)
      type(level_t), intent(in) :: fine
      type(shares_t), intent(in) :: shares
      real(wp), intent(in) :: margin, values(:)
      integer(i8), intent(in) :: id
      integer(i4), intent(in) :: body
      real(wp), allocatable, intent(out) :: parts(:, :) !< (columns, parts)
      integer(i8), allocatable, intent(out) :: ids(:)
      type(error_t), intent(inout) :: error
      real(wp) :: eighths(size(values), 0:7)
      integer, allocatable :: octants(:)
      integer :: generation, n, o
      octants = octants_of(fine%layout%section)
      parts = reshape(values, [size(values), 1])
      ids = [id]
      n = 1
      do while (n <= size(ids))
         if (.not. splits_here(parts(:, n))) then
            n = n + 1
            cycle
         end if
         generation = nint(parts(fine%layout%generation, n))
         if (generation + 3 > fine%layout%max_generations()) then
            associate (x => parts(fine%layout%position:fine%layout%position + 2, n))
               call fail(error, exit_numerical, 'particle '//to_text(ids(n))//' of body '// &
                         to_text(int(body))//' at ('//to_text(x(1))//', '//to_text(x(2))//', '// &
                         to_text(x(3))//') m has been split '//to_text(generation)// &
                         ' times and cannot be split for level '//to_text(fine%number)// &
                         "; try fewer levels, or domain='fixed'")
            end associate
            return
         end if
         call split_in_eight(parts(:, n), fine%layout, shares, eighths)
         do o = 1, size(octants)
            call keep_inside(eighths(:, octants(o)), fine%layout, shares, fine%grid)
         end do
         parts = reshape([parts(:, :n - 1), eighths(:, octants), parts(:, n + 1:)], &
                         [size(values), size(ids) + size(octants) - 1])
         ids = [ids(:n - 1), [(ior(ids(n), ishft(int(octants(o), i8), fine%layout%id_bits + generation)), &
                o=1, size(octants))], ids(n + 1:)]
      end do
   contains
      pure logical function splits_here(part)
         real(wp), intent(in) :: part(:)
         splits_here = lives_in(fine, part, margin)
         associate (at => fine%layout)
            if (splits_here) &
               splits_here = must_split(fine%grid, fine%region, fine%number, nint(part(at%refinement)), &
                                        part(at%position:at%position + 2), longest_half_edge(part, at))
         end associate
      end function splits_here
   end subroutine split_to_live

end module m_transfer
