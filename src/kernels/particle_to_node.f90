!> Particles give mass, momentum and internal force to their nodes (theory.md, eq. to-nodes).
module m_particle_to_node
   use m_kinds, only: wp, i4
   use m_constants, only: block_size
   use m_field_table, only: layout_t
   use m_cell_list, only: cell_list_t
   use m_stencil, only: stencil_t, frame_t, batch, set_stencil
   implicit none
   private
   public :: gather_to_nodes, gather_body_force

   integer, parameter :: lanes = 8 !< values a node: mass, momentum (3), force (3), spare

contains

   !> Set a block's node tile to what its own particles give. One lane a node quantity; the 27 nodes of a bin are summed in
   !> registers over the bin's particles and added to the tile once.
   !> Where the layout has a velocity gradient, it is carried along (affine transfer): m S (v + L (x_i - x_p)).
   pure subroutine gather_to_nodes(cells, column, layout, frame, tile)
      type(cell_list_t), intent(in) :: cells
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      type(frame_t), intent(in) :: frame
      real(wp), intent(out) :: tile(lanes, 0:block_size + 1, 0:block_size + 1, 0:block_size + 1)
      type(stencil_t) :: stencil
      real(wp) :: constant(lanes, batch), along(lanes, 3, batch)
      integer :: i, j, k, bin, first, last, n
      tile = 0.0_wp
      bin = 0
      do k = 0, block_size - 1
         do j = 0, block_size - 1
            do i = 0, block_size - 1
               bin = bin + 1
               do first = cells%first(bin), cells%first(bin + 1) - 1, batch
                  last = min(first + batch, cells%first(bin + 1)) - 1
                  n = last - first + 1
                  call set_stencil(stencil, cells%order(first:last), column(:, layout%position:layout%position + 2), &
                                   column(:, layout%half_size), frame, [i, j, k])
                  call load(cells%order(first:last), column, layout, constant, along)
                  call add(n, stencil, constant, along, frame%cell, tile(:, i:i + 2, j:j + 2, k:k + 2))
               end do
            end do
         end do
      end do
   end subroutine gather_to_nodes

   !> Per particle: the part that goes with the weight, and the parts that go with each axis (momentum: m L; force: -V sigma).
   pure subroutine load(members, column, layout, constant, along)
      integer(i4), intent(in) :: members(:)
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      real(wp), intent(out) :: constant(lanes, batch), along(lanes, 3, batch)
      real(wp) :: mass, volume, s(6)
      integer :: axis, m, p
      do m = 1, size(members)
         p = members(m)
         mass = column(p, layout%mass)
         volume = -column(p, layout%volume)
         constant(1, m) = mass
         constant(2:4, m) = mass*column(p, layout%velocity:layout%velocity + 2)
         constant(5:8, m) = 0.0_wp
         s = volume*column(p, layout%stress:layout%stress + 5)
         along(:, :, m) = 0.0_wp
         if (layout%gradient > 0) then
            do axis = 1, 3
               along(2:4, axis, m) = mass*column(p, layout%gradient + 3*axis - 3:layout%gradient + 3*axis - 1)
            end do
         end if
         along(5:7, 1, m) = [s(1), s(6), s(5)]
         along(5:7, 2, m) = [s(6), s(2), s(4)]
         along(5:7, 3, m) = [s(5), s(4), s(3)]
      end do
   end subroutine load

   !> Add n particles of one bin to the 27 nodes around it: for each row of three nodes one pass over the particles, with the
   !> sums of the row in registers (the loop over lanes is outermost, the loop over particles runs at least once).
   pure subroutine add(n, stencil, constant, along, cell, nodes)
      integer, intent(in) :: n !< at least 1
      type(stencil_t), intent(in) :: stencil
      real(wp), intent(in) :: constant(lanes, batch), along(lanes, 3, batch), cell
      real(wp), intent(inout) :: nodes(lanes, -1:1, -1:1, -1:1)
      real(wp) :: arm(lanes, -1:1, 3, batch) ! momentum lanes: weight times distance; force lanes: slope
      real(wp) :: lower, middle, upper, even, odd
      integer :: a, axis, j, k, p, q
      do p = 1, n
         do axis = 1, 3
            do a = -1, 1
               arm(1, a, axis, p) = 0.0_wp
               arm(2:4, a, axis, p) = stencil%weight(p, a, axis)*(real(a, wp)*cell - stencil%offset(p, axis))
               arm(5:7, a, axis, p) = stencil%slope(p, a, axis)
               arm(8, a, axis, p) = 0.0_wp
            end do
         end do
      end do
      do k = -1, 1
         do j = -1, 1
            !$omp simd private(lower, middle, upper, even, odd)
            do q = 1, lanes
               lower = 0.0_wp
               middle = 0.0_wp
               upper = 0.0_wp
               do p = 1, max(n, 1)
                  even = stencil%weight(p, j, 2)*(stencil%weight(p, k, 3)*constant(q, p) + arm(q, k, 3, p)*along(q, 3, p)) &
                         + stencil%weight(p, k, 3)*arm(q, j, 2, p)*along(q, 2, p)
                  odd = stencil%weight(p, j, 2)*stencil%weight(p, k, 3)*along(q, 1, p)
                  lower = lower + stencil%weight(p, -1, 1)*even + arm(q, -1, 1, p)*odd
                  middle = middle + stencil%weight(p, 0, 1)*even + arm(q, 0, 1, p)*odd
                  upper = upper + stencil%weight(p, 1, 1)*even + arm(q, 1, 1, p)*odd
               end do
               nodes(q, -1, j, k) = nodes(q, -1, j, k) + lower
               nodes(q, 0, j, k) = nodes(q, 0, j, k) + middle
               nodes(q, 1, j, k) = nodes(q, 1, j, k) + upper
            end do
         end do
      end do
   end subroutine add

   !> Add m S b to the force of a block's node tile, b a body force per mass of each particle.
   pure subroutine gather_body_force(cells, column, layout, frame, acceleration, tile)
      type(cell_list_t), intent(in) :: cells
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      type(frame_t), intent(in) :: frame
      real(wp), intent(in), contiguous :: acceleration(:, :) !< (:, 3), m/s2
      real(wp), intent(inout) :: tile(lanes, 0:block_size + 1, 0:block_size + 1, 0:block_size + 1)
      type(stencil_t) :: stencil
      real(wp) :: force(3), weight
      integer :: a, b, c, i, j, k, bin, first, last, p
      do bin = 1, block_size**3
         i = mod(bin - 1, block_size)
         j = mod((bin - 1)/block_size, block_size)
         k = (bin - 1)/block_size**2
         do first = cells%first(bin), cells%first(bin + 1) - 1, batch
            last = min(first + batch, cells%first(bin + 1)) - 1
            call set_stencil(stencil, cells%order(first:last), column(:, layout%position:layout%position + 2), &
                             column(:, layout%half_size), frame, [i, j, k])
            do p = first, last
               force = column(cells%order(p), layout%mass)*acceleration(cells%order(p), :)
               do c = -1, 1
                  do b = -1, 1
                     do a = -1, 1
                        weight = stencil%weight(p - first + 1, a, 1)*stencil%weight(p - first + 1, b, 2) &
                                 *stencil%weight(p - first + 1, c, 3)
                        tile(5:7, i + 1 + a, j + 1 + b, k + 1 + c) = tile(5:7, i + 1 + a, j + 1 + b, k + 1 + c) + weight*force
                     end do
                  end do
               end do
            end do
         end do
      end do
   end subroutine gather_body_force

end module m_particle_to_node
