!> Recovered stress (theory.md, eq. recovered): particles give their stress, weighed by volume, to their
!> nodes, and take back what the nodes' means make at their places, with the weights of the step.
module m_stress_average
   use m_kinds, only: wp
   use m_constants, only: block_size
   use m_field_table, only: layout_t
   use m_cell_list, only: cell_list_t
   use m_stencil, only: stencil_t, frame_t, batch, chunk, set_stencil
   use m_corner_stencil, only: corner_stencil_t, corner_weights_t, set_corners, set_corner_weights
   implicit none
   private
   public :: give_stress, take_stress

   integer, parameter :: values = 8 !< of a node; here 1 volume, m3, 2 to 7 volume times stress, J, then the
                                    !< mean stress, Pa
   integer, parameter :: last = block_size + 1

   !> The weights of a chunk of particles on the 27 nodes around each of them, whatever their domains are.
   type :: shares_t
      type(stencil_t) :: stencil
      type(corner_stencil_t) :: corners
      type(corner_weights_t) :: weights
      integer :: count = 0, member(chunk) = 0
      integer :: place(3, chunk) = 0     !< lowest of the 27 nodes in the tile
      real(wp) :: share(27, chunk) = 0.0_wp !< x fastest
   end type shares_t

contains

   !> Set a block's node tile to what its own particles give.
   subroutine give_stress(cells, column, layout, frame, tile)
      type(cell_list_t), intent(in) :: cells
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      type(frame_t), intent(in) :: frame
      real(wp), intent(out) :: tile(values, 0:last, 0:last, 0:last)
      type(shares_t) :: shares
      real(wp) :: given(7)
      integer :: a, b, c, first, m, p
      tile = 0.0_wp
      do first = 1, cells%count, chunk
         call set_shares(shares, cells, first, column, layout, frame)
         do m = 1, shares%count
            p = shares%member(m)
            given(1) = column(p, layout%volume)
            given(2:7) = given(1)*column(p, layout%stress:layout%stress + 5)
            do c = 0, 2
               do b = 0, 2
                  do a = 0, 2
                     associate (node => tile(1:7, shares%place(1, m) + a, shares%place(2, m) + b, &
                                             shares%place(3, m) + c))
                        node = node + shares%share(1 + a + 3*(b + 3*c), m)*given
                     end associate
                  end do
               end do
            end do
         end do
      end do
   end subroutine give_stress

   !> The recovered stress (Pa) of each particle of a block, from the sums over all blocks.
   subroutine take_stress(cells, column, layout, frame, tile, stress)
      type(cell_list_t), intent(in) :: cells
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      type(frame_t), intent(in) :: frame
      real(wp), intent(inout) :: tile(values, 0:last, 0:last, 0:last) !< sums; on return means
      real(wp), intent(out) :: stress(:, :) !< (6, particles), in their order of storage
      type(shares_t) :: shares
      integer :: a, b, c, first, i, j, k, m
      do k = 0, last
         do j = 0, last
            do i = 0, last
               if (tile(1, i, j, k) > 0.0_wp) tile(2:7, i, j, k) = tile(2:7, i, j, k)/tile(1, i, j, k)
            end do
         end do
      end do
      stress = 0.0_wp
      do first = 1, cells%count, chunk
         call set_shares(shares, cells, first, column, layout, frame)
         do m = 1, shares%count
            associate (own => stress(:, shares%member(m)))
               do c = 0, 2
                  do b = 0, 2
                     do a = 0, 2
                        own = own + shares%share(1 + a + 3*(b + 3*c), m) *tile(2:7, shares%place(1, m) + a, &
                           shares%place(2, m) + b, shares%place(3, m) + c)
                     end do
                  end do
               end do
            end associate
         end do
      end do
   end subroutine take_stress

   !> Weights of the particles from place `first` of the list on.
   subroutine set_shares(shares, cells, first, column, layout, frame)
      type(shares_t), intent(inout) :: shares
      type(cell_list_t), intent(in) :: cells
      integer, intent(in) :: first
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      type(frame_t), intent(in) :: frame
      integer :: a, b, c, m, r
      if (layout%domain > 0) then
         call set_corners(shares%corners, cells, first, column, layout, frame)
         shares%count = shares%corners%list%count
         shares%member = shares%corners%list%member
         shares%place = shares%corners%place
         do m = 1, shares%count
            if (mod(m - 1, batch) == 0) &
               call set_corner_weights(shares%weights, shares%corners, m, frame%per_cell)
            shares%share(:, m) = shares%weights%weight(1 + mod(m - 1, batch), :)
         end do
         return
      end if
      call set_stencil(shares%stencil, cells, first, column, layout, frame)
      associate (stencil => shares%stencil)
         shares%count = stencil%count
         shares%member = stencil%member
         do r = 1, stencil%runs
            do m = stencil%run_first(r), stencil%run_first(r + 1) - 1
               shares%place(:, m) = stencil%run_place(:, r)
               do c = -1, 1
                  do b = -1, 1
                     do a = -1, 1
                        shares%share(14 + a + 3*(b + 3*c), m) = stencil%weight(m, a, 1)*stencil%weight(m, b, &
                           2) *stencil%weight(m, c, 3)
                     end do
                  end do
               end do
            end do
         end do
      end associate
   end subroutine set_shares

end module m_stress_average
