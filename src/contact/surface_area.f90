!> The surface of the bodies at nodes, from all particles around them (theory.md, eq. node-area): the sum of V
!> grad S is the integral of the node's weight times the outward normal over the surface, so surface particles
!> need not be identified.
module m_surface_area
   use m_kinds, only: wp
   use m_constants, only: block_size
   use m_node_values, only: node_values, tile_last, f_x, f_z
   use m_level, only: level_t
   use m_boundary, only: fold_symmetry, motion_parity
   use m_migration, only: frame_of
   use m_cell_list, only: cell_list_t, bins_at
   use m_static_transfer, only: p2g_stress
   use m_contact_nodes, only: contact_nodes_t, nodal_forces_t
   implicit none
   private
   public :: find_surface_area

   !> Requested nodes of a block's tile.
   type :: asked_t
      integer :: block = 0
      logical :: wanted(0:tile_last, 0:tile_last, 0:tile_last) = .false.
      real(wp) :: area(3, 0:tile_last, 0:tile_last, 0:tile_last) = 0.0_wp !< m2
   end type asked_t

contains

   !> Collective among neighbours: the area vectors of the nodes of a contact problem.
   subroutine find_surface_area(level, nodes, area)
      type(level_t), intent(in) :: level
      type(contact_nodes_t), intent(inout) :: nodes
      real(wp), intent(out) :: area(:, :) !< (3, nodes), outward, m2
      type(nodal_forces_t), allocatable :: lists(:)
      type(asked_t), allocatable :: asked(:)
      integer :: asked_of(size(level%blocks)), count, n, r
      call nodes%list_all(lists)
      asked_of = 0
      count = 0
      do r = 1, size(lists)
         do n = 1, size(lists(r)%node)
            call ask(level, nodes%place_of(lists(r)%node(n)), nodes%field_of(lists(r)%node(n)), asked_of, &
                     count)
         end do
      end do
      allocate (asked(count))
      do r = 1, size(lists)
         do n = 1, size(lists(r)%node)
            call mark(level, nodes%place_of(lists(r)%node(n)), nodes%field_of(lists(r)%node(n)), asked_of, &
                      asked)
         end do
      end do
      call fill(level, asked)
      do r = 1, size(lists)
         allocate (lists(r)%force(3, size(lists(r)%node)))
         do n = 1, size(lists(r)%node)
            lists(r)%force(:, n) = found_at(level, nodes%place_of(lists(r)%node(n)), &
                                            nodes%field_of(lists(r)%node(n)), asked_of, asked)
         end do
      end do
      call nodes%give_back(lists, area)
   end subroutine find_surface_area

   !> Local blocks whose tiles have a node: its own, and neighbouring ones if it is on their rim.
   pure subroutine blocks_at(level, place, field, slots, at, count)
      type(level_t), intent(in) :: level
      integer, intent(in) :: place(3), field
      integer, intent(out) :: slots(8), at(3, 8) !< the node's indices in their tiles
      integer, intent(out) :: count
      integer :: home(3), i, j, k, low(3), high(3), slot
      home = (place - modulo(place, block_size))/block_size
      low = home - merge(1, 0, modulo(place, block_size) == 0)
      high = home + merge(1, 0, modulo(place, block_size) == block_size - 1)
      count = 0
      do k = low(3), high(3)
         do j = low(2), high(2)
            do i = low(1), high(1)
               slot = level%slot_at([i, j, k], field)
               if (slot == 0 .or. slot > size(level%blocks)) cycle
               if (level%blocks(slot)%particles%count == 0) cycle
               count = count + 1
               slots(count) = slot
               at(:, count) = place - block_size*[i, j, k] + 1
            end do
         end do
      end do
   end subroutine blocks_at

   !> Number the blocks that have a node, if not numbered yet.
   pure subroutine ask(level, place, field, asked_of, count)
      type(level_t), intent(in) :: level
      integer, intent(in) :: place(3), field
      integer, intent(inout) :: asked_of(:) !< (blocks)
      integer, intent(inout) :: count
      integer :: at(3, 8), n, number, slots(8)
      call blocks_at(level, place, field, slots, at, number)
      do n = 1, number
         if (asked_of(slots(n)) > 0) cycle
         count = count + 1
         asked_of(slots(n)) = count
      end do
   end subroutine ask

   pure subroutine mark(level, place, field, asked_of, asked)
      type(level_t), intent(in) :: level
      integer, intent(in) :: place(3), field, asked_of(:)
      type(asked_t), intent(inout) :: asked(:)
      integer :: at(3, 8), n, number, slots(8)
      call blocks_at(level, place, field, slots, at, number)
      do n = 1, number
         associate (it => asked(asked_of(slots(n))))
            it%block = slots(n)
            it%wanted(at(1, n), at(2, n), at(3, n)) = .true.
         end associate
      end do
   end subroutine mark

   !> Sum the contributions of the particles of each block to the requested nodes of its tile, mirror images
   !> included.
   subroutine fill(level, asked)
      type(level_t), intent(in) :: level
      type(asked_t), intent(inout) :: asked(:)
      type(cell_list_t) :: chosen
      real(wp), allocatable :: force(:, :), tile(:, :, :, :)
      integer :: b, k, m, p, room
      if (size(asked) == 0) return
      room = maxval([(level%blocks(asked(k)%block)%particles%count, k=1, size(asked))])
      allocate (force(room, 9), tile(node_values, 0:tile_last, 0:tile_last, 0:tile_last))
      force = 0.0_wp
      call chosen%reserve(room, choosing=.true.)
      do k = 1, size(asked)
         b = asked(k)%block
         associate (block => level%blocks(b))
            call chosen%take_bins(block%cells, bins_at(asked(k)%wanted, level%grid%rows))
            do m = 1, chosen%count
               p = chosen%order(m)
               force(p, [1, 5, 9]) = block%particles%column(p, level%layout%volume)
            end do
            tile = 0.0_wp
            call p2g_stress(chosen, block%particles%column, level%layout, frame_of(level, block), force, tile)
            call fold_symmetry(level%grid, block%place, tile, motion_parity)
            asked(k)%area = tile(f_x:f_z, :, :, :)
         end associate
      end do
   end subroutine fill

   !> Sum over the local blocks that have a node, m2.
   pure function found_at(level, place, field, asked_of, asked) result(area)
      type(level_t), intent(in) :: level
      integer, intent(in) :: place(3), field, asked_of(:)
      type(asked_t), intent(in) :: asked(:)
      real(wp) :: area(3)
      integer :: at(3, 8), n, number, slots(8)
      call blocks_at(level, place, field, slots, at, number)
      area = 0.0_wp
      do n = 1, number
         area = area + asked(asked_of(slots(n)))%area(:, at(1, n), at(2, n), at(3, n))
      end do
   end function found_at

end module m_surface_area
