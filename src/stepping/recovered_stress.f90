!> The recovered stress of particles (theory.md, eq. recovered), each body for itself: of all of a level, and
!> of single ones.
module m_recovered_stress
   use mpi_f08
   use m_kinds, only: wp
   use m_constants, only: block_size
   use m_node_values, only: node_values, tile_last
   use m_model, only: model_t
   use m_level, only: level_t
   use m_block, only: block_t
   use m_cell_list, only: cell_list_t
   use m_stencil, only: bin_place
   use m_migration, only: frame_of
   use m_node_exchange, only: sum_tiles
   use m_boundary, only: fold_symmetry, mirror_means, motion_parity, stress_parity
   use m_stress_recovery, only: give_stress, take_stress
   implicit none
   private
   public :: block_stress_t, recover_stress, recover_stress_at

   !> The recovered stress of the particles of a block.
   type :: block_stress_t
      real(wp), allocatable :: of(:, :) !< (6, particles), Pa; xx yy zz yz xz xy
   end type block_stress_t

contains

   !> Collective: the recovered stress of this rank's particles of a level. The model stays as it is.
   subroutine recover_stress(model, l, recovered)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l
      type(block_stress_t), allocatable, intent(out) :: recovered(:) !< of the level's blocks
      real(wp), allocatable, dimension(:, :, :, :, :) :: places, stresses
      type(cell_list_t) :: members
      integer :: b, body
      associate (level => model%levels(l))
         allocate (recovered(size(level%blocks)))
         do b = 1, size(level%blocks)
            allocate (recovered(b)%of(6, level%blocks(b)%particles%count), source=0.0_wp)
         end do
         allocate (places, stresses, mold=level%nodes)
         do body = 1, size(model%materials%of_body)
            do b = 1, size(level%blocks)
               members = members_of(level%blocks(b), body)
               call give(level, b, members, places(:, :, :, :, b), stresses(:, :, :, :, b))
            end do
            call add_up(places)
            call add_up(stresses)
            do b = 1, size(level%blocks)
               members = members_of(level%blocks(b), body)
               if (members%count == 0) cycle
               call take(level, b, members, places(:, :, :, :, b), stresses(:, :, :, :, b), recovered(b)%of)
            end do
         end do
      end associate
   contains
      !> Sums over blocks and ranks.
      subroutine add_up(tiles)
         real(wp), intent(inout), contiguous, asynchronous :: tiles(:, :, :, :, :)
         call model%exchange(l)%start(tiles)
         call model%exchange(l)%wait(tiles)
         call sum_tiles(model%levels(l)%blocks, model%levels(l)%interior_first, tiles)
      end subroutine add_up
   end subroutine recover_stress

   !> Collective: the recovered stress (Pa) of one particle, on the rank that has it; 0 on the others. Only
   !> its neighbours are asked, which costs a scene of any size the same.
   subroutine recover_stress_at(model, at, stress)
      type(model_t), intent(in) :: model
      integer, intent(in) :: at(3)           !< its level, block and number here; 0 where it is not
      real(wp), intent(out) :: stress(6)
      real(wp) :: patch(node_values, -1:1, -1:1, -1:1, 2, 8) !< of each of the blocks that may have these
                                                             !< nodes: added up in their order on any ranks
      real(wp), dimension(node_values, 0:tile_last, 0:tile_last, 0:tile_last) :: places, stresses
      real(wp), allocatable :: found(:, :)
      type(cell_list_t) :: members
      integer :: b, facts(5), middle(3), slot
      stress = 0.0_wp
      facts = -1
      if (at(3) > 0) then
         associate (block => model%levels(at(1))%blocks(at(2)))
            facts = [at(1), block%particles%body(at(3)), &
                     block_size*block%place + bin_place(int(block%cells%bin(at(3))))]
         end associate
      end if
      call MPI_Allreduce(MPI_IN_PLACE, facts, size(facts), MPI_INTEGER, MPI_MAX, model%communicator%comm)
      if (facts(1) < 1) return ! nothing is left of it
      middle = facts(3:5)
      patch = 0.0_wp
      associate (level => model%levels(facts(1)))
         do b = 1, size(level%blocks)
            associate (first => block_size*level%blocks(b)%place - 1)
               if (any(middle + 1 < first .or. middle - 1 > first + tile_last)) cycle
               members = members_of(level%blocks(b), facts(2), middle)
               if (members%count == 0) cycle
               call give(level, b, members, places, stresses)
               slot = 1 + dot_product(modulo(level%blocks(b)%place, 2), [1, 2, 4])
               call copy_patch(middle - first, patch(:, :, :, :, 1, slot), places, from_tile=.true.)
               call copy_patch(middle - first, patch(:, :, :, :, 2, slot), stresses, from_tile=.true.)
            end associate
         end do
         call MPI_Allreduce(MPI_IN_PLACE, patch, size(patch), MPI_DOUBLE_PRECISION, MPI_SUM, &
                            model%communicator%comm)
         if (at(3) < 1) return
         do slot = 2, 8
            patch(:, :, :, :, :, 1) = patch(:, :, :, :, :, 1) + patch(:, :, :, :, :, slot)
         end do
         associate (block => level%blocks(at(2)))
            places = 0.0_wp
            stresses = 0.0_wp
            call copy_patch(middle - block_size*block%place + 1, patch(:, :, :, :, 1, 1), places, .false.)
            call copy_patch(middle - block_size*block%place + 1, patch(:, :, :, :, 2, 1), stresses, .false.)
            allocate (found(6, block%particles%count))
            members = chosen(block%cells, [at(3)])
            call take(level, at(2), members, places, stresses, found)
            stress = found(:, at(3))
         end associate
      end associate
   end subroutine recover_stress_at

   !> Between the nodes around the one in the middle and a tile, as far as this has them: from the tile or to
   !> it.
   pure subroutine copy_patch(middle, patch, tile, from_tile)
      integer, intent(in) :: middle(3) !< in the tile, from 0; may be just outside
      real(wp), intent(inout) :: patch(node_values, -1:1, -1:1, -1:1)
      real(wp), intent(inout) :: tile(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      logical, intent(in) :: from_tile
      integer :: i, j, k
      do k = -1, 1
         do j = -1, 1
            do i = -1, 1
               associate (at => middle + [i, j, k])
                  if (any(at < 0 .or. at > tile_last)) cycle
                  if (from_tile) then
                     patch(:, i, j, k) = tile(:, at(1), at(2), at(3))
                  else
                     tile(:, at(1), at(2), at(3)) = patch(:, i, j, k)
                  end if
               end associate
            end do
         end do
      end do
   end subroutine copy_patch

   !> What a block's members give to its own tiles, folded back at symmetry planes.
   subroutine give(level, b, members, places, stresses)
      type(level_t), intent(in) :: level
      integer, intent(in) :: b
      type(cell_list_t), intent(in) :: members
      real(wp), intent(inout), contiguous :: places(:, :, :, :), stresses(:, :, :, :)
      associate (block => level%blocks(b))
         call give_stress(members, block%particles%column, level%layout, frame_of(level, block), places, &
                          stresses)
         call fold_symmetry(level%grid, block%place, places, motion_parity)
         call fold_symmetry(level%grid, block%place, stresses, stress_parity)
      end associate
   end subroutine give

   !> What a block's members take from the sums in its tiles.
   subroutine take(level, b, members, places, stresses, stress)
      type(level_t), intent(in) :: level
      integer, intent(in) :: b
      type(cell_list_t), intent(in) :: members
      real(wp), intent(inout), contiguous :: places(:, :, :, :), stresses(:, :, :, :)
      real(wp), intent(inout) :: stress(:, :) !< (6, particles), Pa
      associate (block => level%blocks(b))
         call mirror_means(level%grid, block%place, places, motion_parity)
         call mirror_means(level%grid, block%place, stresses, stress_parity)
         call take_stress(members, block%particles%column, level%layout, frame_of(level, block), places, &
                          stresses, stress)
      end associate
   end subroutine take

   !> The particles of a body in a block; of these, if so asked, those that share nodes with a bin.
   pure function members_of(block, body, middle) result(members)
      type(block_t), intent(in) :: block
      integer, intent(in) :: body
      integer, intent(in), optional :: middle(3) !< node in the middle of that bin, counted over the level
      type(cell_list_t) :: members
      integer :: n, p, found(block%particles%count)
      n = 0
      do p = 1, block%particles%count
         if (block%particles%body(p) /= body) cycle
         if (present(middle)) then
            if (any(abs(block_size*block%place + bin_place(int(block%cells%bin(p))) - middle) > 2)) cycle
         end if
         n = n + 1
         found(n) = p
      end do
      members = chosen(block%cells, found(:n))
   end function members_of

   !> Some particles of a block as a list to go through.
   pure function chosen(cells, numbers) result(members)
      type(cell_list_t), intent(in) :: cells
      integer, intent(in) :: numbers(:)
      type(cell_list_t) :: members
      members%bin = cells%bin
      members%order = numbers
      members%count = size(numbers)
      members%chosen = .true.
   end function chosen

end module m_recovered_stress
