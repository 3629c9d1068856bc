!> Nodal weights of loads on a face of a particle's domain: the mean of the grid's hat functions over the face
!> (theory.md, eqs contact-nodes, face-mean).
module m_face_weights
   use m_kinds, only: wp
   use m_vectors, only: cross
   use m_stencil, only: hat_weights, gimp_weights
   implicit none
   private
   public :: face_weights_t, find_face, fit_share, cube_span, weigh_point, weigh_face, weigh, mix, &
             add_to_nodes, flattening

   real(wp), parameter :: small_domain = 0.3_wp !< half edges of small cubes, in cells
   real(wp), parameter :: hair = 1.0e-9_wp      !< cells: a face beyond a plane of nodes by less counts as on
                                                !< it
   real(wp), parameter :: flattening = 0.15_wp !< compression up to which forces act at the face of a cube
                                               !< (eq. contact-face)

   !> Weights on the 8 nodes of the cell that contains a point, or on the 27 around a particle's bin.
   type :: face_weights_t
      integer :: corner(3) = 0             !< lowest node, in the block, from 0
      integer :: last = 1                  !< node indices along each axis run from 0 to here: 1 or 2
      real(wp) :: weight(0:2, 0:2, 0:2) = 0.0_wp !< set up to index `last`
   end type face_weights_t

contains

   !> Distance and half extents of the face of a domain that lies from its centre against a normal. Neither
   !> exceeds the domain. With a normal along an edge the span is the whole face across it, and zero along it.
   pure subroutine find_face(half_edge, normal, farthest, distance, span)
      real(wp), intent(in) :: half_edge(3, 3) !< columns; as used for the weights, m
      real(wp), intent(in) :: normal(3)       !< unit vector
      real(wp), intent(in) :: farthest        !< upper bound of the distance, m
      real(wp), intent(out) :: distance       !< m
      real(wp), intent(out) :: span(3, 3)     !< columns, along the half edges, m
      real(wp) :: along(3)
      along = abs(coordinates(half_edge, normal))
      distance = min(farthest, 1.0_wp/maxval(along))
      span = span_around(half_edge, distance*along)
   end subroutine find_face

   !> Point of application of the force on a domain's share of a patch. The middle of the share, given by an
   !> arm that follows the deformation, is moved back into the domain where it has left it, so that no node
   !> gets a force without mass of the same domain (theory.md, eq. pressure). A cube does not get shorter
   !> under compression: the force stays at its face, for large cubes up to a limit.
   pure subroutine fit_share(half_edge, arm, outward, cell, cube, middle, span)
      real(wp), intent(in) :: half_edge(3, 3) !< columns; as used for the weights, m
      real(wp), intent(in) :: arm(3)          !< from the domain's centre to the middle of the share, m
      real(wp), intent(in) :: outward(3)      !< normal to the face, of any length
      real(wp), intent(in) :: cell            !< m
      logical, intent(in) :: cube             !< the domain does not shorten with the material
      real(wp), intent(out) :: middle(3)      !< from the centre, not beyond the domain, m
      real(wp), intent(out) :: span(3, 3)     !< as in find_face
      real(wp) :: along(3), to_face, give
      integer :: k
      along = coordinates(half_edge, arm)
      middle = arm
      if (cube) then
         k = maxloc(abs(coordinates(half_edge, outward)), dim=1)
         give = merge(1.0_wp, flattening, norm2(half_edge(:, k)) <= small_domain*cell)
         to_face = sign(max(abs(along(k)), min(1.0_wp, abs(along(k)) + give)), along(k))
         middle = arm + (to_face - along(k))*half_edge(:, k)
         along(k) = to_face
      end if
      middle = middle/max(1.0_wp, maxval(abs(along)))
      span = span_around(half_edge, abs(along)/max(1.0_wp, maxval(abs(along))))
   end subroutine fit_share

   !> Part of a domain around a point: the domain contributes mass and stress to the nodes behind a plane of
   !> nodes as soon as it crosses it, and so must the traction on its face (eq. face-mean).
   pure function span_around(half_edge, along) result(span)
      real(wp), intent(in) :: half_edge(3, 3), along(3)
      real(wp) :: span(3, 3)
      integer :: k
      do k = 1, 3
         span(:, k) = max(0.0_wp, 1.0_wp - along(k))*half_edge(:, k)
      end do
   end function span_around

   !> Coordinates of a vector along the half edges of a domain: +-1 on its faces.
   pure function coordinates(half_edge, vector) result(along)
      real(wp), intent(in) :: half_edge(3, 3), vector(3)
      real(wp) :: along(3)
      integer :: k
      do k = 1, 3
         associate (across => cross(half_edge(:, mod(k, 3) + 1), half_edge(:, mod(k + 1, 3) + 1)))
            along(k) = dot_product(vector, across)/dot_product(half_edge(:, k), across)
         end associate
      end do
   end function coordinates

   !> The span for a cube along the axes, whose face is at most half its edge away.
   pure function cube_span(half_size, normal) result(span)
      real(wp), intent(in) :: half_size, normal(3)
      real(wp) :: span(3, 3)
      integer :: k
      span = 0.0_wp
      do k = 1, 3
         span(k, k) = max(0.0_wp, 1.0_wp - abs(normal(k)))*half_size
      end do
   end function cube_span

   !> Weights of a face with a span; of its middle where that gives the same, since the face lies in one cell.
   pure subroutine weigh(weights, node, place, span, turns)
      type(face_weights_t), intent(inout) :: weights
      integer, intent(in) :: node(3)     !< at the centre of the particle's bin, in the block, from 0
      real(wp), intent(in) :: place(3)   !< of the middle of the face, in cells from the block's first node
      real(wp), intent(in) :: span(3, 3) !< columns, in cells
      logical, intent(in) :: turns       !< the domain's edges rotate
      logical :: in_cell
      in_cell = .not. any(abs(span) > 0.0_wp)
      if (.not. (turns .or. in_cell)) &
         in_cell = all(abs(place - node) >= [span(1, 1), span(2, 2), span(3, 3)] - hair)
      if (.not. in_cell) then
         call weigh_face(weights, node, place, span, turns)
      else
         call weigh_point(weights, node, place)
      end if
   end subroutine weigh

   !> Weights of the nodes around one point of a particle; `node` is the node of the particle's bin.
   pure subroutine weigh_point(weights, node, place)
      type(face_weights_t), intent(inout) :: weights
      integer, intent(in) :: node(3)   !< in the block, from 0
      real(wp), intent(in) :: place(3) !< in cells from the block's first node
      real(wp) :: hat(0:1, 3)
      integer :: j, k
      weights%last = 1
      call hat_weights(node, place, weights%corner, hat)
      do k = 0, 1
         do j = 0, 1
            weights%weight(0:1, j, k) = hat(:, 1)*hat(j, 2)*hat(k, 3)
         end do
      end do
   end subroutine weigh_point

   !> Weights averaged over a face, as the weights of the domain are: over a box, or over corners where edges
   !> rotate.
   pure subroutine weigh_face(weights, node, place, span, turns)
      type(face_weights_t), intent(inout) :: weights
      integer, intent(in) :: node(3)       !< in the block, from 0
      real(wp), intent(in) :: place(3)     !< of the middle of the face, in cells from the block's first node
      real(wp), intent(in) :: span(3, 3)   !< columns, in cells
      logical, intent(in) :: turns
      real(wp) :: hat(0:2, 3), corner(3), extent(3)
      integer :: axis, c, lowest(3)
      if (turns) then
         extent = sum(abs(span), dim=2)
         lowest = node + merge(-1, 0, place - extent < node)
         ! only the nodes of one cell, where the face lies in it
         weights%last = merge(1, 2, all(place + extent <= lowest + 1))
         if (weights%last == 2) lowest = node - 1
         weights%corner = lowest
         weights%weight = 0.0_wp
         do c = 0, 7
            corner = place + matmul(span, real(2*[ibits(c, 0, 1), ibits(c, 1, 1), ibits(c, 2, 1)] - 1, wp)) &
                     - lowest
            do axis = 1, 3
               hat(:, axis) = [max(0.0_wp, 1.0_wp - corner(axis)), max(0.0_wp, &
                  1.0_wp - abs(corner(axis) - 1.0_wp)), max(0.0_wp, corner(axis) - 1.0_wp)]
            end do
            call add_product(weights, 0.125_wp, hat)
         end do
      else
         weights%last = 2
         weights%corner = node - 1
         weights%weight = 0.0_wp
         do axis = 1, 3
            hat(:, axis) = mean_hat(place(axis) - node(axis), span(axis, axis))
         end do
         call add_product(weights, 1.0_wp, hat)
      end if
   end subroutine weigh_face

   !> Mix the weights of two points of a particle; `node` is the node of its bin: a share of the first, the
   !> rest of the second.
   pure subroutine mix(weights, share, second, node)
      type(face_weights_t), intent(inout) :: weights !< of the first; then of both
      real(wp), intent(in) :: share
      type(face_weights_t), intent(in) :: second
      integer, intent(in) :: node(3) !< in the block, from 0
      type(face_weights_t) :: both
      if (all(weights%corner == second%corner) .and. weights%last == second%last) then
         weights%weight = share*weights%weight + (1.0_wp - share)*second%weight
         return
      end if
      both%corner = node - 1
      both%last = 2
      call add_weights(both, share, weights)
      call add_weights(both, 1.0_wp - share, second)
      weights = both
   end subroutine mix

   !> Add a share of other weights, whose nodes are a subset of these.
   pure subroutine add_weights(weights, share, other)
      type(face_weights_t), intent(inout) :: weights
      real(wp), intent(in) :: share
      type(face_weights_t), intent(in) :: other
      integer :: at(3), j, k, n
      n = other%last
      at = other%corner - weights%corner
      do k = 0, n
         do j = 0, n
            associate (row => weights%weight(at(1):at(1) + n, at(2) + j, at(3) + k))
               row = row + share*other%weight(0:n, j, k)
            end associate
         end do
      end do
   end subroutine add_weights

   !> Means of the hat functions of the nodes at -1, 0, +1 over an interval around a place; all in cells.
   pure function mean_hat(place, half) result(hat)
      real(wp), intent(in) :: place, half
      real(wp) :: hat(0:2), slope(2)
      real(wp), parameter :: narrow = 1.0e-6_wp
      if (half > narrow) then
         call gimp_weights(place, half, hat(0), hat(1), hat(2), slope(1), slope(2))
      else ! a node just beyond, with almost no mass, must not get more than its hat function
         hat = hat_of(place)
      end if
   end function mean_hat

   !> Hat functions of the nodes at -1, 0, +1 at a place (cells).
   pure function hat_of(place) result(hat)
      real(wp), intent(in) :: place
      real(wp) :: hat(0:2)
      hat = [max(0.0_wp, -place), max(0.0_wp, 1.0_wp - abs(place)), max(0.0_wp, place)]
   end function hat_of

   !> Add a share of the products of weights along the axes.
   pure subroutine add_product(weights, share, hat)
      type(face_weights_t), intent(inout) :: weights
      real(wp), intent(in) :: share, hat(0:2, 3)
      integer :: j, k
      do k = 0, weights%last
         do j = 0, weights%last
            weights%weight(:, j, k) = weights%weight(:, j, k) + share*hat(j, 2)*hat(k, 3)*hat(:, 1)
         end do
      end do
   end subroutine add_product

   !> Add a force on a face to the nodes, by its weights.
   pure subroutine add_to_nodes(face, force, tile)
      type(face_weights_t), intent(in) :: face
      real(wp), intent(in) :: force(3) !< N
      real(wp), intent(inout) :: tile(:, 0:, 0:, 0:) !< (3, nodes of a block and around it), N
      integer :: i, j, k
      do k = 0, face%last
         do j = 0, face%last
            do i = 0, face%last
               associate (at => tile(:, face%corner(1) + 1 + i, face%corner(2) + 1 + j, &
                                     face%corner(3) + 1 + k))
                  at = at + face%weight(i, j, k)*force
               end associate
            end do
         end do
      end do
   end subroutine add_to_nodes

end module m_face_weights
