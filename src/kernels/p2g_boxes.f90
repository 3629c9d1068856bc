!> P2G for boxes: mass, momentum and internal force from particles to nodes (theory.md, eq. to-nodes).
module m_p2g_boxes
   use m_kinds, only: wp
   use m_constants, only: block_size
   use m_node_values, only: node_values, mass_, p_x, p_z, f_x, f_z
   use m_field_table, only: layout_t
   use m_cell_list, only: cell_list_t
   use m_stencil, only: stencil_t, frame_t, batch, chunk, set_stencil
   use m_section_weights, only: take_hoop_force
   implicit none
   private
   public :: p2g_boxes, add_body_force, add_force, load_t, half, clear, set_load

   integer, parameter :: half = 4 !< half of the node values: those that use the weight, and those that use
                                  !< its gradient, one register each

   !> Contributions of the particles of a chunk, one lane a node quantity. Lanes that are never written stay
   !> 0.
   type :: load_t
      real(wp) :: momentum(half, 0:3, chunk) = 0.0_wp !< mass and momentum; then the change of affine momentum
                                                      !< from node to node along each axis, m L h, with none
                                                      !< for the mass
      real(wp) :: force(half, 3, chunk) = 0.0_wp      !< -V sigma, a column an axis; the last lane is unused
   end type load_t

contains

   !> Add the contributions of the listed particles to a block's node tile.
   pure subroutine p2g_boxes(cells, column, layout, frame, tile)
      type(cell_list_t), intent(in) :: cells
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      type(frame_t), intent(in) :: frame
      real(wp), intent(inout) :: tile(node_values, 0:block_size + 1, 0:block_size + 1, 0:block_size + 1)
      type(stencil_t) :: stencil
      type(load_t) :: load
      real(wp) :: face(chunk + batch, -1:1, -1:1)
      integer :: first, r
      do first = 1, cells%count, chunk
         call set_stencil(stencil, cells, first, column, layout, frame)
         call set_load(load, stencil, column, layout, frame%cell)
         call set_face(face, stencil)
         do r = 1, stencil%runs
            associate (from => stencil%run_first(r), to => stencil%run_first(r + 1) - 1, &
                       place => stencil%run_place(:, r))
               call add_momentum(load, stencil, face, from, to, place(1), place(2), place(3), tile)
               call add_force(load, stencil, from, to, place(1), place(2), place(3), tile)
            end associate
         end do
      end do
   end subroutine p2g_boxes

   !> Clear a block's nodes before its first chunk.
   pure subroutine clear(tile, extent)
      real(wp), intent(inout) :: tile(node_values, 0:block_size + 1, 0:block_size + 1, 0:block_size + 1)
      integer, intent(in), optional :: extent(2, 3) !< first and last index along each axis of entries that
                                                    !< may be nonzero
      if (present(extent)) then
         tile(:, extent(1, 1):extent(2, 1), extent(1, 2):extent(2, 2), extent(1, 3):extent(2, 3)) = 0.0_wp
      else
         tile = 0.0_wp
      end if
   end subroutine clear

   !> Values of the particles of a chunk, from columns to lanes, one particle after the other. Affine transfer
   !> is written about the nearest node, so that the term of an axis vanishes there: m S (v - L h offset) + m
   !> S L (x_i - x_nearest), offsets in cells.
   pure subroutine set_load(load, stencil, column, layout, cell)
      type(load_t), intent(inout) :: load
      type(stencil_t), intent(in) :: stencil
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: cell !< m
      integer :: g, i, p, q, s, v
      real(wp) :: mass, volume, momentum(3), carried(3, 3), force(6)
      v = layout%velocity - 1
      s = layout%stress - 1
      g = layout%gradient
      do p = 1, stencil%count
         q = stencil%member(p)
         mass = column(q, layout%mass)
         volume = column(q, layout%volume)
         do i = 1, 6
            force(i) = -volume*column(q, s + i)
         end do
         do i = 1, 3
            momentum(i) = mass*column(q, v + i)
         end do
         carried = 0.0_wp
         if (g > 0) then
            do i = 1, 3
               carried(i, 1) = mass*cell*column(q, g + i - 1)
               carried(i, 2) = mass*cell*column(q, g + i + 2)
               carried(i, 3) = mass*cell*column(q, g + i + 5)
            end do
            momentum = momentum - stencil%offset(p, 1)*carried(:, 1) - stencil%offset(p, 2)*carried(:, 2) &
                       - stencil%offset(p, 3)*carried(:, 3)
         end if
         load%momentum(mass_, 0, p) = mass
         load%momentum(p_x:p_z, 0, p) = momentum
         load%momentum(p_x:p_z, 1:3, p) = carried
         load%force(1:3, 1, p) = [force(1), force(6), force(5)]
         load%force(1:3, 2, p) = [force(6), force(2), force(4)]
         load%force(1:3, 3, p) = [force(5), force(4), force(3)]
      end do
      if (layout%viscous_pressure > 0) &
         call add_pressure(load, stencil, column(:, layout%volume), column(:, layout%viscous_pressure))
      if (layout%pressure_shift > 0) &
         call add_pressure(load, stencil, column(:, layout%volume), column(:, layout%pressure_shift))
      if (layout%section%is_round()) call take_hoop_force(stencil%count, load%force)
   end subroutine set_load

   !> Add a pressure that is not part of the stress.
   pure subroutine add_pressure(load, stencil, volume, pressure)
      type(load_t), intent(inout) :: load
      type(stencil_t), intent(in) :: stencil
      real(wp), intent(in), contiguous :: volume(:), pressure(:) !< of the block's particles, m3 and Pa
      integer :: axis, p, q
      do p = 1, stencil%count
         q = stencil%member(p)
         do axis = 1, 3
            load%force(axis, axis, p) = load%force(axis, axis, p) + volume(q)*pressure(q)
         end do
      end do
   end subroutine add_pressure

   !> Products of the weights along y and z.
   pure subroutine set_face(face, stencil)
      real(wp), intent(inout) :: face(chunk + batch, -1:1, -1:1)
      type(stencil_t), intent(in) :: stencil
      integer :: b, c
      do c = -1, 1
         do b = -1, 1
            face(:, b, c) = stencil%weight(:, b, 2)*stencil%weight(:, c, 3)
         end do
      end do
   end subroutine set_face

   !> Add mass and momentum of a run of particles of one bin to the 27 nodes around it. One lane a node
   !> quantity; plane by plane, with the plane's nine sums in registers over the particles.
   pure subroutine add_momentum(load, stencil, face, first, last, i, j, k, tile)
      type(load_t), intent(in) :: load
      type(stencil_t), intent(in) :: stencil
      real(wp), intent(in) :: face(chunk + batch, -1:1, -1:1)
      integer, intent(in) :: first, last, i, j, k
      real(wp), intent(inout) :: tile(node_values, 0:block_size + 1, 0:block_size + 1, 0:block_size + 1)
      real(wp) :: s11, s21, s31, s12, s22, s32, s13, s23, s33, middle, row, y, z
      integer :: a, p, q
      do a = -1, 1
         !$omp simd private(s11, s21, s31, s12, s22, s32, s13, s23, s33, middle, row, y, z)
         do q = 1, half
            s11 = tile(q, i + 1 + a, j, k)
            s21 = tile(q, i + 1 + a, j + 1, k)
            s31 = tile(q, i + 1 + a, j + 2, k)
            s12 = tile(q, i + 1 + a, j, k + 1)
            s22 = tile(q, i + 1 + a, j + 1, k + 1)
            s32 = tile(q, i + 1 + a, j + 2, k + 1)
            s13 = tile(q, i + 1 + a, j, k + 2)
            s23 = tile(q, i + 1 + a, j + 1, k + 2)
            s33 = tile(q, i + 1 + a, j + 2, k + 2)
            do p = first, max(first, last) ! at least one, so that the loop over lanes is vectorised
               middle = stencil%weight(p, a, 1)*(load%momentum(q, 0, p) + a*load%momentum(q, 1, p))
               y = stencil%weight(p, a, 1)*load%momentum(q, 2, p)
               z = stencil%weight(p, a, 1)*load%momentum(q, 3, p)
               row = middle - y
               s11 = s11 + face(p, -1, -1)*(row - z)
               s12 = s12 + face(p, -1, 0)*row
               s13 = s13 + face(p, -1, 1)*(row + z)
               s21 = s21 + face(p, 0, -1)*(middle - z)
               s22 = s22 + face(p, 0, 0)*middle
               s23 = s23 + face(p, 0, 1)*(middle + z)
               row = middle + y
               s31 = s31 + face(p, 1, -1)*(row - z)
               s32 = s32 + face(p, 1, 0)*row
               s33 = s33 + face(p, 1, 1)*(row + z)
            end do
            tile(q, i + 1 + a, j, k) = s11
            tile(q, i + 1 + a, j + 1, k) = s21
            tile(q, i + 1 + a, j + 2, k) = s31
            tile(q, i + 1 + a, j, k + 1) = s12
            tile(q, i + 1 + a, j + 1, k + 1) = s22
            tile(q, i + 1 + a, j + 2, k + 1) = s32
            tile(q, i + 1 + a, j, k + 2) = s13
            tile(q, i + 1 + a, j + 1, k + 2) = s23
            tile(q, i + 1 + a, j + 2, k + 2) = s33
         end do
      end do
   end subroutine add_momentum

   !> The same for forces. Products are factorised: along x once a plane, along y once a row.
   pure subroutine add_force(load, stencil, first, last, i, j, k, tile)
      type(load_t), intent(in) :: load
      type(stencil_t), intent(in) :: stencil
      integer, intent(in) :: first, last, i, j, k
      real(wp), intent(inout) :: tile(node_values, 0:block_size + 1, 0:block_size + 1, 0:block_size + 1)
      real(wp) :: s11, s21, s31, s12, s22, s32, s13, s23, s33, x, y, z, u, v
      integer :: a, p, q
      do a = -1, 1
         !$omp simd private(s11, s21, s31, s12, s22, s32, s13, s23, s33, x, y, z, u, v)
         do q = 1, half
            s11 = tile(half + q, i + 1 + a, j, k)
            s21 = tile(half + q, i + 1 + a, j + 1, k)
            s31 = tile(half + q, i + 1 + a, j + 2, k)
            s12 = tile(half + q, i + 1 + a, j, k + 1)
            s22 = tile(half + q, i + 1 + a, j + 1, k + 1)
            s32 = tile(half + q, i + 1 + a, j + 2, k + 1)
            s13 = tile(half + q, i + 1 + a, j, k + 2)
            s23 = tile(half + q, i + 1 + a, j + 1, k + 2)
            s33 = tile(half + q, i + 1 + a, j + 2, k + 2)
            do p = first, max(first, last) ! at least one, so that the loop over lanes is vectorised
               x = stencil%slope(p, a, 1)*load%force(q, 1, p)
               y = stencil%weight(p, a, 1)*load%force(q, 2, p)
               z = stencil%weight(p, a, 1)*load%force(q, 3, p)
               u = stencil%weight(p, -1, 2)*x + stencil%slope(p, -1, 2)*y
               v = stencil%weight(p, -1, 2)*z
               s11 = s11 + stencil%weight(p, -1, 3)*u + stencil%slope(p, -1, 3)*v
               s12 = s12 + stencil%weight(p, 0, 3)*u + stencil%slope(p, 0, 3)*v
               s13 = s13 + stencil%weight(p, 1, 3)*u + stencil%slope(p, 1, 3)*v
               u = stencil%weight(p, 0, 2)*x + stencil%slope(p, 0, 2)*y
               v = stencil%weight(p, 0, 2)*z
               s21 = s21 + stencil%weight(p, -1, 3)*u + stencil%slope(p, -1, 3)*v
               s22 = s22 + stencil%weight(p, 0, 3)*u + stencil%slope(p, 0, 3)*v
               s23 = s23 + stencil%weight(p, 1, 3)*u + stencil%slope(p, 1, 3)*v
               u = stencil%weight(p, 1, 2)*x + stencil%slope(p, 1, 2)*y
               v = stencil%weight(p, 1, 2)*z
               s31 = s31 + stencil%weight(p, -1, 3)*u + stencil%slope(p, -1, 3)*v
               s32 = s32 + stencil%weight(p, 0, 3)*u + stencil%slope(p, 0, 3)*v
               s33 = s33 + stencil%weight(p, 1, 3)*u + stencil%slope(p, 1, 3)*v
            end do
            tile(half + q, i + 1 + a, j, k) = s11
            tile(half + q, i + 1 + a, j + 1, k) = s21
            tile(half + q, i + 1 + a, j + 2, k) = s31
            tile(half + q, i + 1 + a, j, k + 1) = s12
            tile(half + q, i + 1 + a, j + 1, k + 1) = s22
            tile(half + q, i + 1 + a, j + 2, k + 1) = s32
            tile(half + q, i + 1 + a, j, k + 2) = s13
            tile(half + q, i + 1 + a, j + 1, k + 2) = s23
            tile(half + q, i + 1 + a, j + 2, k + 2) = s33
         end do
      end do
   end subroutine add_force

   !> Add m S b to the force of a block's node tile, where b is a body force per mass of each particle.
   pure subroutine add_body_force(cells, column, layout, frame, acceleration, tile)
      type(cell_list_t), intent(in) :: cells
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      type(frame_t), intent(in) :: frame
      real(wp), intent(in), contiguous :: acceleration(:, :) !< (:, 3), m/s2
      real(wp), intent(inout) :: tile(node_values, 0:block_size + 1, 0:block_size + 1, 0:block_size + 1)
      type(stencil_t) :: stencil
      real(wp) :: force(3), weight
      integer :: a, b, c, first, m, p, place(3), r
      do first = 1, cells%count, chunk
         call set_stencil(stencil, cells, first, column, layout, frame)
         do r = 1, stencil%runs
            place = stencil%run_place(:, r) + 1
            do m = stencil%run_first(r), stencil%run_first(r + 1) - 1
               p = stencil%member(m)
               force = column(p, layout%mass)*acceleration(p, :)
               do c = -1, 1
                  do b = -1, 1
                     do a = -1, 1
                        weight = stencil%weight(m, a, 1)*stencil%weight(m, b, 2)*stencil%weight(m, c, 3)
                        tile(f_x:f_z, place(1) + a, place(2) + b, place(3) + c) = &
                           tile(f_x:f_z, place(1) + a, place(2) + b, place(3) + c) + weight*force
                     end do
                  end do
               end do
            end do
         end do
      end do
   end subroutine add_body_force

end module m_p2g_boxes
