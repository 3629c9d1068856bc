!> Particles give mass, momentum and internal force to their nodes (theory.md, eq. to-nodes).
module m_particle_to_node
   use m_kinds, only: wp
   use m_constants, only: block_size
   use m_field_table, only: layout_t
   use m_cell_list, only: cell_list_t
   use m_prefetch, only: prefetch_columns
   use m_stencil, only: stencil_t, frame_t, chunk, set_stencil, fetch
   implicit none
   private
   public :: gather_to_nodes, gather_body_force, load_t, clear, set_load

   integer, parameter :: lanes = 8 !< values a node: mass, momentum (3), force (3), spare

   !> What the particles of a chunk give, one lane a node quantity. Lanes of `fixed` and `along` that carry nothing are to be 0.
   type :: load_t
      real(wp) :: fixed(lanes, chunk)        !< what goes with the weight
      real(wp) :: along(lanes, 3, chunk)     !< what goes with each axis: momentum m L, force -V sigma
      real(wp) :: arm(lanes, -1:1, 3, chunk) !< what multiplies it on nodes -1, 0, 1 along each axis
   end type load_t

contains

   !> Set a block's node tile to what its own particles give.
   !> Where the layout has a velocity gradient, it is carried along (affine transfer): m S (v + L (x_i - x_p)).
   pure subroutine gather_to_nodes(cells, column, layout, frame, tile, reach)
      type(cell_list_t), intent(in) :: cells
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      type(frame_t), intent(in) :: frame
      real(wp), intent(inout) :: tile(lanes, 0:block_size + 1, 0:block_size + 1, 0:block_size + 1)
      integer, intent(in), optional :: reach(2, 3) !< first and last index along each axis of what can be other than 0
      type(stencil_t) :: stencil
      type(load_t) :: load
      integer :: first, r
      call clear(load, tile, reach)
      do first = 1, cells%first(size(cells%first)) - 1, chunk
         call prefetch_columns(column, first, min(first + chunk, cells%first(size(cells%first))) - 1, stencil%warmth)
         call set_stencil(stencil, cells, first, column, layout, frame)
         call set_load(load, stencil, column, layout)
         call set_arms(load, stencil, frame%cell)
         do r = 1, stencil%runs
            call add(load, stencil, stencil%run_first(r), stencil%run_first(r + 1) - 1, stencil%run_place(1, r), &
                     stencil%run_place(2, r), stencil%run_place(3, r), tile)
         end do
      end do
   end subroutine gather_to_nodes

   !> Before a block's first chunk: nothing on its nodes, and nothing in the lanes that carry nothing.
   pure subroutine clear(load, tile, reach)
      type(load_t), intent(inout) :: load
      real(wp), intent(inout) :: tile(lanes, 0:block_size + 1, 0:block_size + 1, 0:block_size + 1)
      integer, intent(in), optional :: reach(2, 3) !< first and last index along each axis of what can be other than 0
      load%fixed = 0.0_wp
      load%along = 0.0_wp
      if (present(reach)) then
         tile(:, reach(1, 1):reach(2, 1), reach(1, 2):reach(2, 2), reach(1, 3):reach(2, 3)) = 0.0_wp
      else
         tile = 0.0_wp
      end if
   end subroutine clear

   !> What the particles of a chunk carry, from columns to lanes. Affine transfer is written about the nearest node, so that what
   !> goes with an axis is 0 there: m S (v - L offset) + m S L (x_i - x_nearest).
   pure subroutine set_load(load, stencil, column, layout)
      type(load_t), intent(inout) :: load
      type(stencil_t), intent(in) :: stencil
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      integer, parameter :: voigt(3, 3) = reshape([0, 5, 4, 5, 1, 3, 4, 3, 2], [3, 3]) ! stress component, from 0
      real(wp), dimension(chunk) :: mass, volume, added, own
      real(wp) :: momentum(chunk, 3)
      integer :: axis, i, n, p
      logical :: adds
      n = stencil%count
      adds = layout%viscous_pressure > 0 .or. layout%pressure_shift > 0
      call fetch(stencil, column(:, layout%volume), volume)
      if (adds) call fetch_added_pressure(stencil, column, layout, added)
      do axis = 1, 3
         do i = axis, 3
            call fetch(stencil, column(:, layout%stress + voigt(i, axis)), own)
            if (adds .and. i == axis) own(:n) = own(:n) - added(:n)
            !GCC$ novector
            do p = 1, n
               load%along(4 + i, axis, p) = -volume(p)*own(p)
               load%along(4 + axis, i, p) = -volume(p)*own(p)
            end do
         end do
      end do
      call fetch(stencil, column(:, layout%mass), mass)
      do i = 1, 3
         call fetch(stencil, column(:, layout%velocity + i - 1), momentum(:, i))
         momentum(:n, i) = mass(:n)*momentum(:n, i)
      end do
      if (layout%gradient > 0) then
         do axis = 1, 3
            do i = 1, 3
               call fetch(stencil, column(:, layout%gradient + 3*(axis - 1) + i - 1), own)
               own(:n) = mass(:n)*own(:n)
               momentum(:n, i) = momentum(:n, i) - stencil%offset(:n, axis)*own(:n)
               !GCC$ novector
               do p = 1, n
                  load%along(1 + i, axis, p) = own(p)
               end do
            end do
         end do
      end if
      !GCC$ novector
      do p = 1, n
         load%fixed(1, p) = mass(p)
         load%fixed(2, p) = momentum(p, 1)
         load%fixed(3, p) = momentum(p, 2)
         load%fixed(4, p) = momentum(p, 3)
      end do
   end subroutine set_load

   !> What adds to the pressure and is no part of the stress.
   pure subroutine fetch_added_pressure(stencil, column, layout, added)
      type(stencil_t), intent(in) :: stencil
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      real(wp), intent(out) :: added(chunk)
      real(wp) :: shift(chunk)
      added = 0.0_wp
      if (layout%viscous_pressure > 0) call fetch(stencil, column(:, layout%viscous_pressure), added)
      if (layout%pressure_shift == 0) return
      call fetch(stencil, column(:, layout%pressure_shift), shift)
      added(:stencil%count) = added(:stencil%count) + shift(:stencil%count)
   end subroutine fetch_added_pressure

   !> What multiplies `along` at a node: the slope for forces, weight times distance from the nearest node for momenta.
   pure subroutine set_arms(load, stencil, cell)
      type(load_t), intent(inout) :: load
      type(stencil_t), intent(in) :: stencil
      real(wp), intent(in) :: cell
      real(wp), parameter :: momentum(lanes) = [0, 1, 1, 1, 0, 0, 0, 0], force(lanes) = [0, 0, 0, 0, 1, 1, 1, 0]
      integer :: axis, p, q
      do p = 1, stencil%count
         do axis = 1, 3
            !$omp simd
            do q = 1, lanes
               load%arm(q, -1, axis, p) = force(q)*stencil%slope(p, -1, axis) - momentum(q)*(cell*stencil%weight(p, -1, axis))
               load%arm(q, 0, axis, p) = force(q)*stencil%slope(p, 0, axis)
               load%arm(q, 1, axis, p) = force(q)*stencil%slope(p, 1, axis) + momentum(q)*(cell*stencil%weight(p, 1, axis))
            end do
         end do
      end do
   end subroutine set_arms

   !> Add a run of particles of one bin to the 27 nodes around it. One lane a node quantity; plane by plane, with the plane's nine
   !> sums in registers over the particles. Products are factorised: along x once a plane, along y once a row.
   pure subroutine add(load, stencil, first, last, i, j, k, tile)
      type(load_t), intent(in) :: load
      type(stencil_t), intent(in) :: stencil
      integer, intent(in) :: first, last, i, j, k
      real(wp), intent(inout) :: tile(lanes, 0:block_size + 1, 0:block_size + 1, 0:block_size + 1)
      real(wp) :: s11, s21, s31, s12, s22, s32, s13, s23, s33, from_x, from_y, from_z, u, v
      integer :: a, p, q
      do a = -1, 1
         !$omp simd private(s11, s21, s31, s12, s22, s32, s13, s23, s33, from_x, from_y, from_z, u, v)
         do q = 1, lanes
            s11 = tile(q, i + 1 + a, j, k)
            s21 = tile(q, i + 1 + a, j + 1, k)
            s31 = tile(q, i + 1 + a, j + 2, k)
            s12 = tile(q, i + 1 + a, j, k + 1)
            s22 = tile(q, i + 1 + a, j + 1, k + 1)
            s32 = tile(q, i + 1 + a, j + 2, k + 1)
            s13 = tile(q, i + 1 + a, j, k + 2)
            s23 = tile(q, i + 1 + a, j + 1, k + 2)
            s33 = tile(q, i + 1 + a, j + 2, k + 2)
            do p = first, max(first, last) ! at least one, so that the loop over lanes can become vectors
               from_x = stencil%weight(p, a, 1)*load%fixed(q, p) + load%arm(q, a, 1, p)*load%along(q, 1, p)
               from_y = stencil%weight(p, a, 1)*load%along(q, 2, p)
               from_z = stencil%weight(p, a, 1)*load%along(q, 3, p)
               u = stencil%weight(p, -1, 2)*from_x + load%arm(q, -1, 2, p)*from_y
               v = stencil%weight(p, -1, 2)*from_z
               s11 = s11 + stencil%weight(p, -1, 3)*u + load%arm(q, -1, 3, p)*v
               s12 = s12 + stencil%weight(p, 0, 3)*u + load%arm(q, 0, 3, p)*v
               s13 = s13 + stencil%weight(p, 1, 3)*u + load%arm(q, 1, 3, p)*v
               u = stencil%weight(p, 0, 2)*from_x + load%arm(q, 0, 2, p)*from_y
               v = stencil%weight(p, 0, 2)*from_z
               s21 = s21 + stencil%weight(p, -1, 3)*u + load%arm(q, -1, 3, p)*v
               s22 = s22 + stencil%weight(p, 0, 3)*u + load%arm(q, 0, 3, p)*v
               s23 = s23 + stencil%weight(p, 1, 3)*u + load%arm(q, 1, 3, p)*v
               u = stencil%weight(p, 1, 2)*from_x + load%arm(q, 1, 2, p)*from_y
               v = stencil%weight(p, 1, 2)*from_z
               s31 = s31 + stencil%weight(p, -1, 3)*u + load%arm(q, -1, 3, p)*v
               s32 = s32 + stencil%weight(p, 0, 3)*u + load%arm(q, 0, 3, p)*v
               s33 = s33 + stencil%weight(p, 1, 3)*u + load%arm(q, 1, 3, p)*v
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
      integer :: a, b, c, first, m, p, place(3), r
      do first = 1, cells%first(size(cells%first)) - 1, chunk
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
                        tile(5:7, place(1) + a, place(2) + b, place(3) + c) = &
                           tile(5:7, place(1) + a, place(2) + b, place(3) + c) + weight*force
                     end do
                  end do
               end do
            end do
         end do
      end do
   end subroutine gather_body_force

end module m_particle_to_node
