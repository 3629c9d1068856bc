!> The recovered stress of single particles (theory.md, eq. recovered). Only what is around them is asked,
!> which costs a scene of any size the same.
module m_recovered_at
   use mpi_f08
   use m_kinds, only: wp
   use m_constants, only: block_size
   use m_node_values, only: node_values, tile_last
   use m_model, only: model_t
   use m_cell_list, only: cell_list_t
   use m_stencil, only: bin_place
   use m_edge, only: edge_t, take_means, patch_last
   use m_boundary, only: mirror_means, motion_parity, stress_parity
   use m_stress_recovery, only: make_means
   use m_recovered_stress, only: give, take, members_of, chosen, own_stress, passes
   implicit none
   private
   public :: recover_stress_at

   !> Values of the nodes of a box: volume and volume times place from the node; volume and volume times
   !> stress. Nodes are counted over their level.
   type :: box_t
      integer :: level = 0, low(3) = 0, high(3) = 0
      real(wp), allocatable :: places(:, :, :, :), stresses(:, :, :, :)
   end type box_t

   !> What is given to the nodes of a box, and to those of the next coarser level that its constrained nodes
   !> depend on.
   type :: around_t
      type(box_t) :: own, coarser !< of the latter none where its level is 0
   end type around_t

   !> The same, or means of it, as tiles of a block.
   type :: tiles_t
      real(wp), dimension(node_values, 0:tile_last, 0:tile_last, 0:tile_last) :: places, stresses
   end type tiles_t

   integer, parameter :: near = 2 !< nodes apart: particles that are looked for together

contains

   !> Collective: the recovered stress (Pa) of particles, each on the rank that has it; 0 on the others. Those
   !> near each other are looked for together.
   subroutine recover_stress_at(model, at, stress)
      type(model_t), intent(in) :: model
      integer, intent(in) :: at(:, :)       !< (3, particles): level, block and number here; 0 where not here
      real(wp), intent(out) :: stress(:, :) !< (6, particles)
      integer :: facts(5, size(at, 2)) ! level, body, the node in the middle of its bin
      logical :: group(size(at, 2)), open(size(at, 2))
      integer :: n
      stress = 0.0_wp
      facts = -1
      do n = 1, size(at, 2)
         if (at(3, n) < 1) cycle
         associate (block => model%levels(at(1, n))%blocks(at(2, n)))
            facts(:, n) = [at(1, n), block%particles%body(at(3, n)), &
                           block_size*block%place + bin_place(int(block%cells%bin(at(3, n))))]
         end associate
      end do
      call MPI_Allreduce(MPI_IN_PLACE, facts, size(facts), MPI_INTEGER, MPI_MAX, model%communicator%comm)
      open = facts(1, :) > 0 ! of others nothing is left
      do n = 1, size(at, 2)
         if (.not. open(n)) cycle
         group = open .and. facts(1, :) == facts(1, n) .and. facts(2, :) == facts(2, n) &
                 .and. maxval(abs(facts(3:, :) - spread(facts(3:, n), 2, size(at, 2))), dim=1) <= near
         open = open .and. .not. group
         call recover_group(model, facts, group, at, stress)
      end do
   end subroutine recover_stress_at

   !> Collective: the same of some that are of one level and body.
   subroutine recover_group(model, facts, group, at, stress)
      type(model_t), intent(in) :: model
      integer, intent(in) :: facts(:, :)
      logical, intent(in) :: group(:)
      integer, intent(in) :: at(:, :)
      real(wp), intent(inout) :: stress(:, :)
      type(around_t) :: around
      real(wp), allocatable :: found(:, :)
      integer :: first, low(3), high(3), n, pass
      first = findloc(group, .true., dim=1)
      low = minval(facts(3:, :), dim=2, mask=spread(group, 1, 3)) - 1
      high = maxval(facts(3:, :), dim=2, mask=spread(group, 1, 3)) + 1
      associate (l => facts(1, first), body => facts(2, first))
         do pass = 1, passes
            call look_around(model, body, l, low, high, pass, around)
            do n = 1, size(group)
               if (.not. group(n) .or. at(3, n) < 1) cycle
               found = taken(model, around, at(2, n), chosen(model%levels(l)%blocks(at(2, n))%cells, &
                                                             [at(3, n)]))
               stress(:, n) = stress(:, n) + found(:, at(3, n))
            end do
         end do
      end associate
   end subroutine recover_group

   !> Collective: what the particles of a body give in a pass to the nodes of a box, and to the coarser ones
   !> that they depend on.
   recursive subroutine look_around(model, body, l, low, high, pass, around)
      type(model_t), intent(in) :: model
      integer, intent(in) :: body, l, low(3), high(3), pass
      type(around_t), intent(out) :: around
      integer :: i, j, k
      call sum_up(model, body, l, low, high, pass, around%own)
      if (l == 1) return
      do k = low(3), high(3)
         do j = low(2), high(2)
            do i = low(1), high(1)
               if (model%levels(l)%region%is_inner([i, j, k])) cycle
               call sum_up(model, body, l - 1, (low - modulo(low, 2))/2, (high + modulo(high, 2))/2, pass, &
                           around%coarser)
               return
            end do
         end do
      end do
   end subroutine look_around

   !> What a block's members take from the nodes around them, (6, particles), Pa; 0 for the others.
   function taken(model, around, b, members) result(found)
      type(model_t), intent(in) :: model
      type(around_t), intent(in) :: around
      integer, intent(in) :: b
      type(cell_list_t), intent(in) :: members
      real(wp), allocatable :: found(:, :)
      type(tiles_t) :: tiles
      associate (level => model%levels(around%own%level))
         allocate (found(6, level%blocks(b)%particles%count), source=0.0_wp)
         if (members%count == 0) return
         call set_means(around%own, level%blocks(b)%place, tiles)
         call follow_coarser(model, around, level%blocks(b)%place, tiles)
         call mirror(model, around%own%level, level%blocks(b)%place, tiles)
         call take(level, b, members, tiles%places, tiles%stresses, found)
      end associate
   end function taken

   !> Collective: what the particles of a body give to the nodes of a box, those of the next finer level too.
   recursive subroutine sum_up(model, body, l, low, high, pass, box)
      type(model_t), intent(in) :: model
      integer, intent(in) :: body, l, low(3), high(3), pass
      type(box_t), intent(out) :: box
      type(box_t) :: finer
      call sum_own(model, body, l, low, high, pass, box)
      if (l == size(model%levels)) return
      associate (grid => model%levels(l)%grid)
         if (.not. model%levels(l + 1)%region%overlaps(grid%lower + (low - 2)*grid%cell, &
                                                       grid%lower + (high + 2)*grid%cell)) return
      end associate
      call sum_own(model, body, l + 1, 2*low - 1, 2*high + 1, pass, finer)
      call hand_up(model, finer, box)
   end subroutine sum_up

   !> Collective: what the particles of a body that live on a level give to the nodes of a box there: in the
   !> first pass their stress, in the second what the first has left of it.
   recursive subroutine sum_own(model, body, l, low, high, pass, box)
      type(model_t), intent(in) :: model
      integer, intent(in) :: body, l, low(3), high(3), pass
      type(box_t), intent(out) :: box
      type(around_t) :: before
      type(tiles_t) :: tiles
      type(cell_list_t) :: members
      real(wp), allocatable :: parts(:, :, :, :, :, :) !< of each of the blocks that may have these nodes:
                                                       !< added up in their order on any ranks
      real(wp), allocatable :: stress(:, :)
      integer :: b, first(3), slot, a(3), z(3)
      box%level = l
      box%low = low
      box%high = high
      if (pass > 1) call look_around(model, body, l, low - 2, high + 2, pass - 1, before)
      allocate (parts(node_values, low(1):high(1), low(2):high(2), low(3):high(3), 2, 8), source=0.0_wp)
      associate (level => model%levels(l))
         do b = 1, size(level%blocks)
            first = block_size*level%blocks(b)%place - 1
            a = max(low, first)
            z = min(high, first + tile_last)
            if (any(a > z)) cycle
            members = members_of(level%blocks(b), body, low, high)
            if (members%count == 0) cycle
            stress = own_stress(level, level%blocks(b))
            if (pass > 1) stress = stress - taken(model, before, b, members)
            call give(level, b, members, stress, tiles%places, tiles%stresses)
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

   !> Add to the nodes of a box what constrained nodes of the next finer level hold (m_edge: hand_up).
   subroutine hand_up(model, finer, box)
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
   end subroutine hand_up

   !> The means of the nodes of a box in the tiles of a block; other nodes have none.
   subroutine set_means(box, place, tiles)
      type(box_t), intent(in) :: box
      integer, intent(in) :: place(3) !< of the block
      type(tiles_t), intent(out) :: tiles
      integer :: a(3), z(3), first(3)
      tiles%places = 0.0_wp
      tiles%stresses = 0.0_wp
      first = block_size*place - 1
      a = max(box%low, first)
      z = min(box%high, first + tile_last)
      associate (f => a - first, t => z - first)
         tiles%places(:, f(1):t(1), f(2):t(2), f(3):t(3)) = box%places(:, a(1):z(1), a(2):z(2), a(3):z(3))
         tiles%stresses(:, f(1):t(1), f(2):t(2), f(3):t(3)) &
            = box%stresses(:, a(1):z(1), a(2):z(2), a(3):z(3))
      end associate
      call make_means(tiles%places)
      call make_means(tiles%stresses)
   end subroutine set_means

   !> Those of the nodes of a block's tiles that are constrained have the means of the nodes that they depend
   !> on.
   subroutine follow_coarser(model, around, place, tiles)
      type(model_t), intent(in) :: model
      type(around_t), intent(in) :: around
      integer, intent(in) :: place(3) !< of the block
      type(tiles_t), intent(inout) :: tiles
      type(tiles_t) :: coarser
      type(edge_t) :: edge
      integer :: found(4, (tile_last + 1)**3), i, j, k, n, a(3), z(3), first(3)
      if (around%coarser%level == 0) return
      first = block_size*place - 1
      a = max(around%own%low, first)
      z = min(around%own%high, first + tile_last)
      n = 0
      do k = a(3), z(3)
         do j = a(2), z(2)
            do i = a(1), z(1)
               if (model%levels(around%own%level)%region%is_inner([i, j, k])) cycle
               n = n + 1
               found(:, n) = [[i, j, k] - first, 1]
            end do
         end do
      end do
      if (n == 0) return
      edge%constrained = found(:, :n)
      edge%corner = block_size/2*modulo(place, 2)
      associate (parent => (place - modulo(place, 2))/2, c => edge%corner, d => edge%corner + patch_last)
         call set_means(around%coarser, parent, coarser)
         call mirror(model, around%coarser%level, parent, coarser)
         call take_means(edge, coarser%places(:, c(1):d(1), c(2):d(2), c(3):d(3)), tiles%places)
         call take_means(edge, coarser%stresses(:, c(1):d(1), c(2):d(2), c(3):d(3)), tiles%stresses)
      end associate
   end subroutine follow_coarser

   !> Means beyond planes of symmetry.
   subroutine mirror(model, l, place, tiles)
      type(model_t), intent(in) :: model
      integer, intent(in) :: l, place(3)
      type(tiles_t), intent(inout) :: tiles
      call mirror_means(model%levels(l)%grid, place, tiles%places, motion_parity)
      call mirror_means(model%levels(l)%grid, place, tiles%stresses, stress_parity)
   end subroutine mirror

end module m_recovered_at
