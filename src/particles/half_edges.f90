!> The domains of particles: half edges of a cube, of a box along the axes, or of a parallelepiped, by the
!> scene's `domain` (theory.md, Domains).
module m_half_edges
   use m_kinds, only: wp
   use m_constants, only: short_of
   use m_particle_store, only: particle_store_t
   use m_field_table, only: layout_t
   implicit none
   private
   public :: half_edges, set_half_edges, set_half_edge, first_half_edges, fitted_edges, extents, &
             longest_half_edge, domain_sizes, lengths_squared, longest_squared, thinnest

contains

   !> The half edges of a particle's domain as columns of a matrix, m.
   pure function half_edges(values, layout) result(r)
      real(wp), intent(in) :: values(:) !< the particle's columns
      type(layout_t), intent(in) :: layout
      real(wp) :: r(3, 3)
      integer :: k
      r = 0.0_wp
      if (layout%domain > 0) then
         do k = 1, 3
            r(:, k) = values(layout%domain + 3*k - 3:layout%domain + 3*k - 1)
         end do
      else
         do k = 1, 3
            r(k, k) = values(layout%half_size + merge(k - 1, 0, layout%half_sizes))
         end do
      end if
   end function half_edges

   !> Set the half edges of a particle's domain; a box along the axes keeps only their components along the
   !> axes.
   pure subroutine set_half_edges(values, layout, r)
      real(wp), intent(inout) :: values(:) !< the particle's columns
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: r(3, 3) !< columns, m
      if (layout%domain > 0) then
         values(layout%domain:layout%domain + 8) = reshape(r, [9])
      else if (layout%half_sizes) then
         values(layout%half_size:layout%half_size + 2) = [r(1, 1), r(2, 2), r(3, 3)]
      else
         values(layout%half_size) = r(1, 1)
      end if
   end subroutine set_half_edges

   !> Set one half edge of a particle's domain that follows the deformation.
   pure subroutine set_half_edge(values, layout, k, edge)
      real(wp), intent(inout) :: values(:) !< the particle's columns
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: k
      real(wp), intent(in) :: edge(3) !< m
      if (layout%domain > 0) then
         values(layout%domain + 3*(k - 1):layout%domain + 3*k - 1) = edge
      else
         values(layout%half_size + k - 1) = edge(k)
      end if
   end subroutine set_half_edge

   !> The domain of a new particle: a box along the axes, or the cube of its volume.
   pure subroutine first_half_edges(values, layout, halves, half)
      real(wp), intent(inout) :: values(:) !< the particle's columns
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: halves(3) !< half edges of the box, m
      real(wp), intent(in) :: half      !< of the whole cube that the box is a part of, m
      if (layout%domain > 0) then
         values(layout%domain:layout%domain + 8:4) = halves
      else if (layout%half_sizes) then
         values(layout%half_size:layout%half_size + 2) = halves
      else if (layout%half_size > 0) then
         values(layout%half_size) = product(halves)**(1.0_wp/3.0_wp)
         if (layout%section%is_flat()) values(layout%half_size) = sqrt(halves(1)*halves(3))
         if (all(abs(halves - half) <= 0.0_wp)) values(layout%half_size) = half
      end if
   end subroutine first_half_edges

   !> The half edges used for the weights: limited to the reach of the nodes (theory.md, eq. fit).
   pure function fitted_edges(values, layout, cell) result(r)
      real(wp), intent(in) :: values(:) !< the particle's columns
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: cell !< m
      real(wp) :: r(3, 3)
      r = half_edges(values, layout)
      if (layout%domain > 0) then
         r = r*min(1.0_wp, 0.5_wp*cell/maxval(sum(abs(r), dim=2)))
      else if (layout%half_sizes) then
         r = min(short_of*r, 0.5_wp*cell)
      else
         r = short_of*r
      end if
   end function fitted_edges

   !> Half the size, along the axes, of the bounding box of a particle's domain, m.
   pure function extents(values, layout) result(e)
      real(wp), intent(in) :: values(:) !< the particle's columns
      type(layout_t), intent(in) :: layout
      real(wp) :: e(3)
      if (layout%domain > 0) then
         e = sum(abs(half_edges(values, layout)), dim=2)
      else if (layout%half_sizes) then
         e = values(layout%half_size:layout%half_size + 2)
      else
         e = values(layout%half_size)
      end if
   end function extents

   !> Longest half edge of a particle's domain, m. A sheared domain's bounding box may be longer.
   pure real(wp) function longest_half_edge(values, layout) result(length)
      real(wp), intent(in) :: values(:) !< the particle's columns
      type(layout_t), intent(in) :: layout
      length = maxval(norm2(half_edges(values, layout), dim=1))
   end function longest_half_edge

   !> `extents` and `longest_half_edge` of a block's particles, in storage order, m.
   pure subroutine domain_sizes(particles, layout, e, length)
      type(particle_store_t), intent(in) :: particles
      type(layout_t), intent(in) :: layout
      real(wp), intent(out) :: e(particles%count, 3) !< as `extents`
      real(wp), intent(out) :: length(particles%count) !< as `longest_half_edge`
      integer :: axis, p
      associate (column => particles%column, n => particles%count)
         if (layout%domain > 0) then
            do axis = 1, 3
               associate (d => layout%domain + axis - 1)
                  e(:, axis) = abs(column(:n, d)) + abs(column(:n, d + 3)) + abs(column(:n, d + 6))
               end associate
            end do
            do p = 1, n
               length(p) = sqrt(maxval(lengths_squared(column, p, layout)))
            end do
         else
            do axis = 1, 3
               e(:, axis) = column(:n, layout%half_size + merge(axis - 1, 0, layout%half_sizes))
            end do
            length = maxval(e, dim=2)
         end if
      end associate
   end subroutine domain_sizes

   !> Squared lengths of a particle's half edges, m2.
   pure function lengths_squared(column, p, layout) result(squares)
      real(wp), intent(in), contiguous :: column(:, :)
      integer, intent(in) :: p
      type(layout_t), intent(in) :: layout
      real(wp) :: squares(3)
      integer :: k
      if (layout%domain > 0) then
         do k = 1, 3
            associate (first => layout%domain + 3*(k - 1))
               squares(k) = column(p, first)**2 + column(p, first + 1)**2 + column(p, first + 2)**2
            end associate
         end do
      else
         do k = 1, 3
            squares(k) = column(p, layout%half_size + k - 1)**2
         end do
      end if
   end function lengths_squared

   !> Square of the longest half edge of each of the first n particles whose domains follow the deformation,
   !> m2.
   pure subroutine longest_squared(n, column, layout, square)
      integer, intent(in) :: n
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      real(wp), intent(out) :: square(n)
      integer :: p
      associate (d => layout%domain, h => layout%half_size)
         if (d > 0) then
            !$omp simd
            do p = 1, n
               square(p) = max(column(p, d)**2 + column(p, d + 1)**2 + column(p, d + 2)**2, &
                               column(p, d + 3)**2 + column(p, d + 4)**2 + column(p, d + 5)**2, &
                               column(p, d + 6)**2 + column(p, d + 7)**2 + column(p, d + 8)**2)
            end do
         else
            !$omp simd
            do p = 1, n
               square(p) = max(column(p, h)**2, column(p, h + 1)**2, column(p, h + 2)**2)
            end do
         end if
      end associate
   end subroutine longest_squared

   !> The particle with the smallest half size, for boxes.
   pure integer function thinnest(particles, layout)
      type(particle_store_t), intent(in) :: particles
      type(layout_t), intent(in) :: layout
      associate (n => particles%count, h => layout%half_size)
         thinnest = max(1, minloc(minval(particles%column(:n, h:h + 2), dim=2), dim=1))
      end associate
   end function thinnest

end module m_half_edges
