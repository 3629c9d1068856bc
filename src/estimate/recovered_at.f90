!> The recovered stress of single particles (theory.md, eq. recovered). Only their surroundings are used, so
!> the cost does not depend on the size of the scene.
module m_recovered_at
   use mpi_f08
   use m_kinds, only: wp
   use m_constants, only: block_size
   use m_node_values, only: node_values, tile_last
   use m_grid_level, only: grid_level_t
   use m_model, only: model_t
   use m_cell_list, only: cell_list_t
   use m_stencil, only: bin_place
   use m_edge, only: edge_t, prolong, patch_last
   use m_boundary, only: mirror_means, motion_parity, stress_parity
   use m_node_filling, only: even_share
   use m_recovered_stress, only: give, take, members_of, chosen, mirrors_of, make_mixed_means
   implicit none
   private
   public :: recover_stress_at

   !> Values of the nodes of a box: volume and volume times position relative to the node; volume and volume
   !> times stress. Node indices are those of the level.
   type :: box_t
      integer :: level = 0, low(3) = 0, high(3) = 0
      real(wp), allocatable :: places(:, :, :, :), stresses(:, :, :, :)
   end type box_t

   !> The same values, or their means, as tiles of a block.
   type :: tiles_t
      real(wp), dimension(node_values, 0:tile_last, 0:tile_last, 0:tile_last) :: places, stresses
   end type tiles_t

contains

   !> Collective: the recovered stress (Pa) of one particle, on the rank that owns it; 0 on the others.
   subroutine recover_stress_at(model, at, stress)
      type(model_t), intent(in) :: model
      integer, intent(in) :: at(3) !< its level, block and number here; 0 on other ranks
      real(wp), intent(out) :: stress(6)
      type(box_t) :: around, even !< the latter with even weights
      type(tiles_t) :: tiles
      real(wp), allocatable :: found(:, :)
      integer :: facts(5) ! its level, its body, the node of its bin
      stress = 0.0_wp
      facts = -1
      if (at(3) > 0) then
         associate (block => model%levels(at(1))%blocks(at(2)))
            facts = [at(1), block%particles%body(at(3)), &
                     block_size*block%place + bin_place(int(block%cells%bin(at(3))))]
         end associate
      end if
      call MPI_Allreduce(MPI_IN_PLACE, facts, size(facts), MPI_INTEGER, MPI_MAX, model%communicator%comm)
      if (facts(1) < 1) return ! the particle no longer exists
      associate (l => facts(1), body => facts(2), middle => facts(3:5))
         call sum_both(model, body, middle/block_size, l, middle - 1, middle + 1, around, even)
         call set_means(model, around, even, middle/block_size, tiles)
         call follow_coarser(model, body, around, middle/block_size, tiles)
         if (at(3) < 1) return
         associate (level => model%levels(l), block => model%levels(l)%blocks(at(2)))
            call mirror(model, l, block%place, tiles)
            allocate (found(6, block%particles%count))
            call take(level, at(2), chosen(block%cells, [at(3)]), tiles%places, tiles%stresses, found)
            stress = found(:, at(3))
         end associate
      end associate
   end subroutine recover_stress_at

   !> Collective: sums over the particles of a body on the nodes of a box, with the weights of the step, and
   !> with even ones if a node needs them (else these are the same).
   subroutine sum_both(model, body, place, l, low, high, box, even)
      type(model_t), intent(in) :: model
      integer, intent(in) :: body, place(3), l, low(3), high(3) !< place: of the block that has the nodes
      type(box_t), intent(out) :: box, even
      type(tiles_t) :: tiles
      call sum_up(model, body, l, low, high, .false., box)
      call set_sums(box, place, tiles)
      even = box
      if (any(even_share(mirrors_of(model, l), place, tiles%places(1, :, :, :)) > 0.0_wp)) &
         call sum_up(model, body, l, low, high, .true., even)
   end subroutine sum_both

   !> Collective: sums over the particles of a body on the nodes of a box, including those of the next finer
   !> level.
   subroutine sum_up(model, body, l, low, high, even, box)
      type(model_t), intent(in) :: model
      integer, intent(in) :: body, l, low(3), high(3)
      logical, intent(in) :: even !< with even weights in place of those of the step
      type(box_t), intent(out) :: box
      type(box_t) :: finer
      call sum_own(model, body, l, low, high, even, box)
      if (l == size(model%levels)) return
      associate (grid => model%levels(l)%grid)
         if (.not. model%levels(l + 1)%region%overlaps(grid%lower + (low - 2)*grid%cell, &
                                                       grid%lower + (high + 2)*grid%cell)) return
      end associate
      call sum_own(model, body, l + 1, 2*low - 1, 2*high + 1, even, finer)
      call restrict_to(model, finer, box)
   end subroutine sum_up

   !> Collective: sums over the particles of a body that live on a level on the nodes of a box there.
   subroutine sum_own(model, body, l, low, high, even, box)
      type(model_t), intent(in) :: model
      integer, intent(in) :: body, l, low(3), high(3)
      logical, intent(in) :: even !< with even weights in place of those of the step
      type(box_t), intent(out) :: box
      type(tiles_t) :: tiles
      type(cell_list_t) :: members
      real(wp), allocatable :: parts(:, :, :, :, :, :) !< of each of the blocks that may have these nodes:
                                                       !< added in their order on any number of ranks
      integer :: b, first(3), slot, a(3), z(3)
      box%level = l
      box%low = low
      box%high = high
      allocate (parts(node_values, low(1):high(1), low(2):high(2), low(3):high(3), 2, 8), source=0.0_wp)
      associate (level => model%levels(l))
         do b = 1, size(level%blocks)
            first = block_size*level%blocks(b)%place - 1
            a = max(low, first)
            z = min(high, first + tile_last)
            if (any(a > z)) cycle
            members = members_of(level%blocks(b), body, low, high)
            if (members%count == 0) cycle
            call give(level, mirrors_of(model, l), b, members, even, tiles%places, tiles%stresses)
            slot = 1 + dot_product(modulo(level%blocks(b)%place, 2), [1, 2, 4])
            associate (part => parts(:, a(1):z(1), a(2):z(2), a(3):z(3), :, slot), f => a - first, &
                       t => z - first)
               part(:, :, :, :, 1) = tiles%places(:, f(1):t(1), f(2):t(2), f(3):t(3))
               part(:, :, :, :, 2) = tiles%stresses(:, f(1):t(1), f(2):t(2), f(3):t(3))
            end associate
         end do
      end associate
      call MPI_Allreduce(MPI_IN_PLACE, parts, size(parts), MPI_DOUBLE_PRECISION, MPI_SUM, &
                         model%communicator%comm)
      do slot = 2, 8
         parts(:, :, :, :, :, 1) = parts(:, :, :, :, :, 1) + parts(:, :, :, :, :, slot)
      end do
      allocate (box%places(node_values, low(1):high(1), low(2):high(2), low(3):high(3)))
      allocate (box%stresses, mold=box%places)
      box%places = parts(:, :, :, :, 1, 1)
      box%stresses = parts(:, :, :, :, 2, 1)
   end subroutine sum_own

   !> Add to the nodes of a box the restricted values of constrained nodes of the next finer level (m_edge:
   !> restrict).
   subroutine restrict_to(model, finer, box)
      type(model_t), intent(in) :: model
      type(box_t), intent(in) :: finer
      type(box_t), intent(inout) :: box
      real(wp) :: share, arm(3)
      integer :: i, j, k, a, b, c, low(3), high(3), node(3)
      associate (level => model%levels(finer%level))
         do k = finer%low(3), finer%high(3)
            do j = finer%low(2), finer%high(2)
               do i = finer%low(1), finer%high(1)
                  node = [i, j, k]
                  if (level%region%is_inner(node)) cycle
                  low = (node - modulo(node, 2))/2
                  high = (node + modulo(node, 2))/2
                  share = 0.5_wp**sum(high - low)
                  do c = max(low(3), box%low(3)), min(high(3), box%high(3))
                     do b = max(low(2), box%low(2)), min(high(2), box%high(2))
                        do a = max(low(1), box%low(1)), min(high(1), box%high(1))
                           arm = level%grid%cell*(node - 2*[a, b, c])
                           associate (place => box%places(:, a, b, c), stress => box%stresses(:, a, b, c))
                              place = place + share*finer%places(:, i, j, k)
                              place(2:4) = place(2:4) + share*finer%places(1, i, j, k)*arm
                              stress = stress + share*finer%stresses(:, i, j, k)
                           end associate
                        end do
                     end do
                  end do
               end do
            end do
         end do
      end associate
   end subroutine restrict_to

   !> Set the means of the nodes of a box in the tiles of a block; other nodes get none.
   subroutine set_means(model, box, even, place, tiles)
      type(model_t), intent(in) :: model
      type(box_t), intent(in) :: box, even !< sums with the weights of the step, and with even ones
      integer, intent(in) :: place(3) !< of the block
      type(tiles_t), intent(out) :: tiles
      type(tiles_t) :: evens
      type(grid_level_t) :: mirrors
      call set_sums(box, place, tiles)
      call set_sums(even, place, evens)
      mirrors = mirrors_of(model, box%level)
      call make_mixed_means(mirrors, place, evens%places, tiles%places)
      call make_mixed_means(mirrors, place, evens%stresses, tiles%stresses)
   end subroutine set_means

   !> Set the sums of the nodes of a box in the tiles of a block; other nodes get none.
   pure subroutine set_sums(box, place, tiles)
      type(box_t), intent(in) :: box
      integer, intent(in) :: place(3) !< of the block
      type(tiles_t), intent(out) :: tiles
      integer :: a(3), z(3)
      tiles%places = 0.0_wp
      tiles%stresses = 0.0_wp
      a = box%low - (block_size*place - 1)
      z = box%high - (block_size*place - 1)
      tiles%places(:, a(1):z(1), a(2):z(2), a(3):z(3)) = box%places
      tiles%stresses(:, a(1):z(1), a(2):z(2), a(3):z(3)) = box%stresses
   end subroutine set_sums

   !> Collective: set the means of constrained nodes of a box from those of the nodes that they depend on.
   subroutine follow_coarser(model, body, around, place, tiles)
      type(model_t), intent(in) :: model
      integer, intent(in) :: body
      type(box_t), intent(in) :: around
      integer, intent(in) :: place(3) !< of the block of the tiles
      type(tiles_t), intent(inout) :: tiles
      type(box_t) :: box, even
      type(tiles_t) :: coarser
      type(edge_t) :: edge
      integer :: found(4, 27), i, j, k, n, a(3), z(3)
      if (around%level == 1) return
      n = 0
      do k = around%low(3), around%high(3)
         do j = around%low(2), around%high(2)
            do i = around%low(1), around%high(1)
               if (model%levels(around%level)%region%is_inner([i, j, k])) cycle
               n = n + 1
               found(:, n) = [[i, j, k] - (block_size*place - 1), 1]
            end do
         end do
      end do
      if (n == 0) return
      edge%constrained = found(:, :n)
      edge%corner = block_size/2*modulo(place, 2)
      call sum_both(model, body, place/2, around%level - 1, (around%low - modulo(around%low, 2))/2, &
                    (around%high + modulo(around%high, 2))/2, box, even)
      call set_means(model, box, even, place/2, coarser)
      call mirror(model, around%level - 1, place/2, coarser)
      a = edge%corner
      z = edge%corner + patch_last
      call prolong(edge, coarser%places(:, a(1):z(1), a(2):z(2), a(3):z(3)), 2, node_values, tiles%places)
      call prolong(edge, coarser%stresses(:, a(1):z(1), a(2):z(2), a(3):z(3)), 2, node_values, tiles%stresses)
   end subroutine follow_coarser

   !> Mirror means beyond planes of symmetry.
   subroutine mirror(model, l, place, tiles)
      type(model_t), intent(in) :: model
      integer, intent(in) :: l, place(3)
      type(tiles_t), intent(inout) :: tiles
      call mirror_means(mirrors_of(model, l), place, tiles%places, motion_parity)
      call mirror_means(mirrors_of(model, l), place, tiles%stresses, stress_parity)
   end subroutine mirror

end module m_recovered_at
