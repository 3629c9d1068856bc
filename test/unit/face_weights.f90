!> Weights of a face of a particle's domain against their definitions: sums by hand, the domain's own weights,
!> and the nodes that these reach (theory.md, eqs contact-nodes, face-mean).
program face_weights
   use m_kinds, only: wp
   use m_communicator, only: communicator_t
   use m_stencil, only: gimp_weights
   use m_face_weights, only: face_weights_t, find_face, fit_share, cube_span, weigh, weigh_point, &
                             weigh_face, mix
   use m_assertions, only: assertions_t
   use m_chance, only: chance_t, keep_worst, say
   use m_plain_weight, only: plain_weight
   implicit none
   integer, parameter :: tries = 5000, node(3) = [2, 5, 0]
   real(wp), parameter :: cell = 0.25_wp
   type(communicator_t) :: comm
   type(assertions_t) :: test
   type(chance_t) :: chance
   type(face_weights_t) :: weights, second
   real(wp) :: off_box, off_corners, off_point, off_unity, off_place, outside, beyond, r(3, 3), span(3, 3), &
      place(3), normal(3)
   real(wp) :: distance, half, off_span, off_mix
   integer :: axis, k, n
   call comm%start()
   call test%start(comm, 'face_weights')
   off_box = 0.0_wp; off_corners = 0.0_wp; off_point = 0.0_wp; off_unity = 0.0_wp; off_place = 0.0_wp
   outside = 0.0_wp; beyond = 0.0_wp; off_span = 0.0_wp; off_mix = 0.0_wp
   do n = 1, tries
      call any_normal()
      r = 0.0_wp
      do k = 1, 3
         r(k, k) = chance%between(0.1_wp, 0.5_wp)*cell
      end do
      place = chance%several(3, -0.5_wp, 0.5_wp)*cell
      call find_face(r, normal, chance%between(0.1_wp, 0.6_wp)*cell, distance, span)
      call check_span()
      place = (place - distance*normal)/cell
      call weigh_face(weights, node, node + place, span/cell, turns=.false.)
      call plain_sums(off_box, of_box)
      call keep_worst(outside, mass_less(of_domain))
      call weigh_point(weights, node, node + place)
      call plain_sums(off_point, of_point)
      call mix_in(chance%between(0.0_wp, 1.0_wp), chance%several(3, -1.0_wp, 1.0_wp))
      ! edges that turn, which the bin's nodes just hold
      r = reshape(chance%several(9, -1.0_wp, 1.0_wp), [3, 3])
      do k = 1, 3
         r(k, k) = sign(1.0_wp, r(k, k)) + r(k, k)
      end do
      r = r*chance%between(0.3_wp, 0.5_wp)*cell/maxval(sum(abs(r), dim=2))
      place = chance%several(3, -0.5_wp, 0.5_wp)*cell
      call find_face(r, normal, norm2(matmul(normal, r)), distance, span)
      call check_span()
      place = (place - distance*normal)/cell
      call weigh_face(weights, node, node + place, span/cell, turns=.true.)
      call plain_sums(off_corners, of_corners)
   end do
   call say('mean over a box off its definition', off_box)
   call say('mean over corners off its definition', off_corners)
   call say('hat functions of a point off theirs', off_point)
   call say('sum of the weights', off_unity)
   call say('weighted mean of the nodes (cells)', off_place)
   ! which may be narrow
   call test%check_close(off_box, 0.0_wp, 1.0e-11_wp, 'weights are means of the hat functions over a box')
   call test%check_close([off_corners, off_point, off_unity, off_place], spread(0.0_wp, 1, 4), 1.0e-13_wp, &
                         'and over corners')
   call test%check_close(off_mix, 0.0_wp, 1.0e-13_wp, 'two places: sum and middle are those of their shares')
   call test%check(beyond <= 1.0e-12_wp, 'no face reaches beyond its domain')
   call test%check_close(off_span, 0.0_wp, 1.0e-12_wp*cell, 'and each spans what it should')
   call test%check(outside <= 1.0e-14_wp, 'no node has weight that the domain gives no mass')
   call sides()
   call patch_shares()
   call test%finish()

contains

   !> A share of the weights of `place`, the rest at another one: their sum and their middle.
   subroutine mix_in(share, other)
      real(wp), intent(in) :: share, other(3)
      type(face_weights_t) :: both
      real(wp) :: middle(3)
      integer :: i, j, k
      both = weights
      call weigh_point(second, node, node + other)
      call mix(both, share, second, node)
      middle = 0.0_wp
      do k = 0, both%last
         do j = 0, both%last
            do i = 0, both%last
               middle = middle + both%weight(i, j, k)*(both%corner + [i, j, k] - node)
            end do
         end do
      end do
      call keep_worst(off_mix, maxval(abs(middle - share*place - (1.0_wp - share)*other)))
      call keep_worst(off_mix, abs(sum(both%weight(:both%last, :both%last, :both%last)) - 1.0_wp))
   end subroutine mix_in

   !> The span by Cramer's rule: along each edge what is left of the way to the domain's end; its corners.
   subroutine check_span()
      real(wp) :: along(3), corner(3)
      integer :: c, k
      along = in_domain(-distance*normal)
      do k = 1, 3
         call keep_worst(off_span, maxval(abs(span(:, k) - (1.0_wp - abs(along(k)))*r(:, k))))
      end do
      do c = 0, 7
         corner = -distance*normal &
                  + matmul(span, real(2*[ibits(c, 0, 1), ibits(c, 1, 1), ibits(c, 2, 1)] - 1, wp))
         beyond = max(beyond, maxval(abs(in_domain(corner))) - 1.0_wp)
      end do
   end subroutine check_span

   !> The share of a patch: an arm within the domain stays, one that has left it ends on its face in the same
   !> direction, and neither its middle nor its span gives weight to a node that gets no mass from the domain.
   subroutine patch_shares()
      real(wp) :: arm(3), middle(3), off_kept, off_face, reach
      integer :: n
      off_kept = 0.0_wp; off_face = 0.0_wp; beyond = 0.0_wp
      do n = 1, tries
         r = reshape(chance%several(9, -0.3_wp, 0.3_wp), [3, 3])
         do k = 1, 3
            r(k, k) = 1.0_wp + r(k, k)
         end do
         r = r*chance%between(0.1_wp, 0.3_wp)*cell
         arm = matmul(r, chance%several(3, -1.5_wp, 1.5_wp))
         reach = maxval(abs(in_domain(arm)))
         call fit_share(r, arm, arm, cell, .false., middle, span)
         if (reach <= 1.0_wp) then
            call keep_worst(off_kept, norm2(middle - arm)/cell)
         else
            call keep_worst(off_face, max(abs(maxval(abs(in_domain(middle))) - 1.0_wp), &
                                          norm2(middle*reach - arm)/cell))
         end if
         distance = 1.0_wp
         normal = -middle
         call check_span()
      end do
      call test%check_close([off_kept, off_face], [0.0_wp, 0.0_wp], 1.0e-12_wp, 'arms end in their domain')
      call test%check(beyond <= 1.0e-12_wp, 'and what lies about their ends too')
   end subroutine patch_shares

   !> Where a point stands in the domain, in half edges.
   function in_domain(point) result(along)
      real(wp), intent(in) :: point(3)
      real(wp) :: along(3), other(3, 3)
      integer :: k
      do k = 1, 3
         other = r
         other(:, k) = point
         along(k) = determinant(other)/determinant(r)
      end do
   end function in_domain

   pure real(wp) function determinant(m)
      real(wp), intent(in) :: m(3, 3)
      determinant = m(1, 1)*(m(2, 2)*m(3, 3) - m(2, 3)*m(3, 2)) &
                    - m(1, 2)*(m(2, 1)*m(3, 3) - m(2, 3)*m(3, 1)) &
                    + m(1, 3)*(m(2, 1)*m(3, 2) - m(2, 2)*m(3, 1))
   end function determinant

   subroutine any_normal()
      normal = chance%several(3, -1.0_wp, 1.0_wp)
      normal = normal/norm2(normal)
   end subroutine any_normal

   !> Sums over the nodes against a weight by definition, against 1 and against the place.
   subroutine plain_sums(off, definition)
      real(wp), intent(inout) :: off
      interface
         real(wp) function definition(at)
            import :: wp
            integer, intent(in) :: at(3) !< from the node in the middle
         end function definition
      end interface
      real(wp) :: weight, total, mean(3)
      integer :: a, b, c, i(3)
      total = 0.0_wp
      mean = 0.0_wp
      do c = -1, 1
         do b = -1, 1
            do a = -1, 1
               i = node + [a, b, c] - weights%corner
               weight = 0.0_wp
               if (all(i >= 0 .and. i <= weights%last)) weight = weights%weight(i(1), i(2), i(3))
               call keep_worst(off, weight - definition([a, b, c]))
               total = total + weight
               mean = mean + weight*[a, b, c]
            end do
         end do
      end do
      call keep_worst(off_unity, total - 1.0_wp)
      call keep_worst(off_place, norm2(mean - place))
   end subroutine plain_sums

   real(wp) function of_box(at)
      integer, intent(in) :: at(3)
      integer :: axis
      of_box = 1.0_wp
      do axis = 1, 3
         if (span(axis, axis) > 1.0e-6_wp*cell) then
            of_box = of_box*plain_weight(place(axis) - at(axis), span(axis, axis)/cell)
         else
            of_box = of_box*max(0.0_wp, 1.0_wp - abs(place(axis) - at(axis)))
         end if
      end do
   end function of_box

   real(wp) function of_point(at)
      integer, intent(in) :: at(3)
      of_point = product(max(0.0_wp, 1.0_wp - abs(place - at)))
   end function of_point

   real(wp) function of_corners(at)
      integer, intent(in) :: at(3)
      integer :: a, b, c
      of_corners = 0.0_wp
      do c = -1, 1, 2
         do b = -1, 1, 2
            do a = -1, 1, 2
               of_corners = of_corners + 0.125_wp*product(max(0.0_wp, 1.0_wp - abs(place - at &
                                                          + (a*span(:, 1) + b*span(:, 2) + c*span(:, 3)) &
                                                          /cell)))
            end do
         end do
      end do
   end function of_corners

   !> The weight that the whole box gives a node.
   real(wp) function of_domain(at)
      integer, intent(in) :: at(3)
      integer :: axis
      of_domain = 1.0_wp
      do axis = 1, 3
         of_domain = of_domain*plain_weight(place(axis) + distance*normal(axis)/cell - at(axis), &
                                            r(axis, axis)/cell)
      end do
   end function of_domain

   !> Largest weight of the face on nodes to which the domain gives none.
   real(wp) function mass_less(domain)
      interface
         real(wp) function domain(at)
            import :: wp
            integer, intent(in) :: at(3)
         end function domain
      end interface
      integer :: a, b, c
      mass_less = 0.0_wp
      do c = -1, 1
         do b = -1, 1
            do a = -1, 1
               if (domain([a, b, c]) <= 0.0_wp) &
                  mass_less = max(mass_less, weights%weight(a + 1, b + 1, c + 1))
            end do
         end do
      end do
   end function mass_less

   !> A side of a cube of a cell's size: across the normal the weights are those of its volume, along it those
   !> of the side. A side in one cell has the weights of its middle.
   subroutine sides()
      real(wp) :: volume(-1:1), slopes(2), side(-1:1), across(-1:1)
      do axis = 1, 3
         normal = 0.0_wp
         normal(axis) = -1.0_wp
         place = [0.3_wp, -0.2_wp, 0.45_wp]
         call find_face(0.5_wp*cell*reshape([1, 0, 0, 0, 1, 0, 0, 0, 1], [3, 3]), normal, cell, distance, &
                        span)
         call test%check_close(pack(span, .true.), pack(cube_span(0.5_wp*cell, normal), .true.), &
                               1.0e-15_wp, 'a cube is a box')
         call test%check_close(distance, 0.5_wp*cell, 1.0e-15_wp, 'whose side is half an edge away')
         call weigh_face(weights, node, node + place - 0.5_wp*normal, span/cell, turns=.false.)
         do k = 1, 3
            side = sum(sum(weights%weight, merge(1, 2, k > 1)), merge(1, 2, k == 3))
            if (k == 2) side = sum(sum(weights%weight, 3), 1)
            call gimp_weights(place(k), 0.5_wp, volume(-1), volume(0), volume(1), slopes(1), slopes(2))
            across = volume
            if (k == axis) across = max(0.0_wp, 1.0_wp - abs(place(k) + 0.5_wp - [-1, 0, 1]))
            call test%check_close(side, across, 1.0e-14_wp, 'a side of a cube')
         end do
         call in_one_cell()
         call beside_nodes()
      end do
   end subroutine sides

   !> A cube that reaches past a node by next to nothing: the node beyond has hardly any mass, and no more
   !> weight than it can bear.
   subroutine beside_nodes()
      real(wp) :: reach, mass(-1:1), slopes(2), weight
      integer :: e
      do e = 0, 18
         reach = 10.0_wp**(-e)/3.0_wp
         place = 0.0_wp
         place(axis) = 0.5_wp - reach
         normal = 0.0_wp
         normal(axis) = 1.0_wp
         call weigh_face(weights, node, node + place - 0.5_wp*normal, &
                         cube_span(0.5_wp*cell, normal)/cell, turns=.false.)
         call gimp_weights(place(axis), 0.5_wp, mass(-1), mass(0), mass(1), slopes(1), slopes(2))
         weight = sum(weights%weight(merge(0, 1, axis == 1):merge(0, 1, axis == 1), &
                                     merge(0, 1, axis == 2):merge(0, 1, axis == 2), &
                                     merge(0, 1, axis == 3):merge(0, 1, axis == 3)))
         call test%check(weight**2 <= 2.5_wp*mass(-1), 'weight of a node of hardly any mass')
      end do
   end subroutine beside_nodes

   !> Eight nodes where a small cube's side lies in one cell, with the weights of the mean; more where it does
   !> not.
   subroutine in_one_cell()
      real(wp) :: reach
      integer :: i, j, k
      span = cube_span(0.25_wp*cell, normal)/cell
      do n = 1, 20
         place = chance%several(3, -0.45_wp, 0.45_wp)
         reach = maxval([(span(k, k) - abs(place(k)), k=1, 3)])
         call weigh(second, node, node + place, span, turns=.false.)
         call weigh_face(weights, node, node + place, span, turns=.false.)
         call test%check(second%last == merge(1, 2, reach <= 0.0_wp), 'as few nodes as the side meets')
         do k = 0, second%last
            do j = 0, second%last
               do i = 0, second%last
                  associate (at => second%corner + [i, j, k] - weights%corner)
                     weights%weight(at(1), at(2), at(3)) = weights%weight(at(1), at(2), at(3)) &
                                                           - second%weight(i, j, k)
                  end associate
               end do
            end do
         end do
         call test%check_close(maxval(abs(weights%weight)), 0.0_wp, 1.0e-14_wp, 'the mean is the middle''s')
      end do
   end subroutine in_one_cell

end program face_weights
