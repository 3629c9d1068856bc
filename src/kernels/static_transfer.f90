!> Nodal forces of a stress that is not symmetric, and the diagonal of its stiffness (theory.md, eqs
!> static-residual, static-diagonal).
module m_static_transfer
   use m_kinds, only: wp
   use m_node_values, only: node_values, tile_last, f_x
   use m_field_table, only: layout_t
   use m_cell_list, only: cell_list_t
   use m_stencil, only: stencil_t, frame_t, batch, chunk, set_stencil, set_places
   use m_corner_stencil, only: corner_stencil_t, corner_weights_t, set_corners, set_corner_weights, &
                               corner_slopes, batch_end
   use m_p2g_boxes, only: load_t, add_force
   use m_p2g_corners, only: add_corners_force, turn_force
   use m_section_weights, only: take_hoop_force, take_hoop_modulus
   use m_plane_weights, only: plane_weights_t, set_plane_weights
   use m_plane_transfer, only: add_plane_force
   implicit none
   private
   public :: p2g_stress, p2g_diagonal

contains

   !> Add the forces of the listed particles to a block's node tile: sum over b of force(ab) dS/dx_b, `force`
   !> at 3 (b-1) + a, minus volume times stress, N m.
   pure subroutine p2g_stress(cells, column, layout, frame, force, tile)
      type(cell_list_t), intent(in) :: cells
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      type(frame_t), intent(in) :: frame
      real(wp), intent(in), contiguous :: force(:, :) !< (:, 9)
      real(wp), intent(inout) :: tile(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      type(stencil_t) :: stencil
      type(corner_stencil_t) :: corners
      type(corner_weights_t) :: weights
      type(load_t) :: load
      integer :: first, last, m, r
      if (layout%section%is_flat()) then
         call p2g_plane_stress(cells, column, layout, frame, force, tile)
         return
      end if
      do first = 1, cells%count, chunk
         if (layout%domain > 0) then
            call set_corners(corners, cells, first, column, layout, frame)
            call set_stress(load, corners%list, force)
            call turn_force(load, corners, frame%per_cell)
            do r = 1, corners%list%runs
               m = corners%list%run_first(r)
               do while (m < corners%list%run_first(r + 1))
                  if (mod(m, batch) == 1) call set_corner_weights(weights, corners, m)
                  last = batch_end(corners%list, r, m)
                  associate (place => corners%list%run_place(:, r))
                     call add_corners_force(load, weights, m, last, place(1), place(2), place(3), tile)
                  end associate
                  m = last + 1
               end do
            end do
         else
            call set_stencil(stencil, cells, first, column, layout, frame)
            call set_stress(load, stencil, force)
            do r = 1, stencil%runs
               associate (place => stencil%run_place(:, r))
                  call add_force(load, stencil, stencil%run_first(r), stencil%run_first(r + 1) - 1, &
                                 place(1), place(2), place(3), tile)
               end associate
            end do
         end if
      end do
   end subroutine p2g_stress

   !> The same for a section.
   pure subroutine p2g_plane_stress(cells, column, layout, frame, force, tile)
      type(cell_list_t), intent(in) :: cells
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      type(frame_t), intent(in) :: frame
      real(wp), intent(in), contiguous :: force(:, :) !< (:, 9)
      real(wp), intent(inout) :: tile(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      type(plane_weights_t) :: weights
      type(load_t) :: load
      integer :: first
      do first = 1, cells%count, chunk
         call set_plane_weights(weights, cells, first, column, layout, frame)
         associate (list => weights%list)
            call set_stress(load, list, force)
            if (layout%section%is_round()) call take_hoop_force(list%count, load%force)
         end associate
         call add_plane_force(load, weights, tile)
      end do
   end subroutine p2g_plane_stress

   !> From columns to lanes.
   pure subroutine set_stress(load, stencil, force)
      type(load_t), intent(inout) :: load
      type(stencil_t), intent(in) :: stencil
      real(wp), intent(in), contiguous :: force(:, :)
      integer :: b, p
      do p = 1, stencil%count
         do b = 1, 3
            load%force(1:3, b, p) = force(stencil%member(p), 3*b - 2:3*b)
         end do
      end do
   end subroutine set_stress

   !> Add to the forces of a tile the diagonal of the stiffness: component a of each node gets the sum of
   !> modulus(b, d, a) dS/dx_b dS/dx_d, `modulus` volume times the derivative of stress ab by gradient ad, at
   !> 9 (a-1) + 3 (d-1) + b, J.
   pure subroutine p2g_diagonal(cells, column, layout, frame, modulus, tile)
      type(cell_list_t), intent(in) :: cells
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      type(frame_t), intent(in) :: frame
      real(wp), intent(in), contiguous :: modulus(:, :) !< (:, 27)
      real(wp), intent(inout) :: tile(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      type(stencil_t) :: stencil
      type(corner_stencil_t) :: corners
      type(corner_weights_t) :: weights
      real(wp) :: slope(27, 3), own(27)
      integer :: first, m, place(3, chunk), r
      do first = 1, cells%count, chunk
         if (layout%domain > 0) then
            call set_corners(corners, cells, first, column, layout, frame)
            call set_places(corners%list, place)
            do m = 1, corners%list%count
               if (mod(m, batch) == 1) call set_corner_weights(weights, corners, m)
               slope = corner_slopes(weights, corners, m, frame%per_cell)
               own = modulus(corners%list%member(m), :)
               if (layout%section%is_round()) call take_hoop_modulus(own)
               call add_diagonal(slope, own, place(:, m), tile)
            end do
         else
            call set_stencil(stencil, cells, first, column, layout, frame)
            do r = 1, stencil%runs
               do m = stencil%run_first(r), stencil%run_first(r + 1) - 1
                  call slopes_of_box(stencil, m, slope)
                  own = modulus(stencil%member(m), :)
                  if (layout%section%is_round()) call take_hoop_modulus(own)
                  call add_diagonal(slope, own, stencil%run_place(:, r), tile)
               end do
            end do
         end if
      end do
   end subroutine p2g_diagonal

   !> Gradients of the weights of particle m of a chunk on its 27 nodes, x fastest, 1/m.
   pure subroutine slopes_of_box(stencil, m, slope)
      type(stencil_t), intent(in) :: stencil
      integer, intent(in) :: m
      real(wp), intent(out) :: slope(27, 3)
      integer :: a, b, c, n
      n = 0
      do c = -1, 1
         do b = -1, 1
            do a = -1, 1
               n = n + 1
               slope(n, 1) = stencil%slope(m, a, 1)*stencil%weight(m, b, 2)*stencil%weight(m, c, 3)
               slope(n, 2) = stencil%weight(m, a, 1)*stencil%slope(m, b, 2)*stencil%weight(m, c, 3)
               slope(n, 3) = stencil%weight(m, a, 1)*stencil%weight(m, b, 2)*stencil%slope(m, c, 3)
            end do
         end do
      end do
   end subroutine slopes_of_box

   pure subroutine add_diagonal(slope, modulus, place, tile)
      real(wp), intent(in) :: slope(27, 3), modulus(27)
      integer, intent(in) :: place(3)
      real(wp), intent(inout) :: tile(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      integer :: a, i, j, k, n
      n = 0
      do k = place(3), place(3) + 2
         do j = place(2), place(2) + 2
            do i = place(1), place(1) + 2
               n = n + 1
               do a = 1, 3
                  associate (c => modulus(9*a - 8:9*a), x => slope(n, 1), y => slope(n, 2), z => slope(n, 3))
                     tile(f_x + a - 1, i, j, k) = tile(f_x + a - 1, i, j, k) &
                        + c(1)*x*x + c(5)*y*y + c(9)*z*z + (c(2) + c(4))*x*y + (c(3) + c(7))*x*z &
                        + (c(6) + c(8))*y*z
                  end associate
               end do
            end do
         end do
      end do
   end subroutine add_diagonal

end module m_static_transfer
