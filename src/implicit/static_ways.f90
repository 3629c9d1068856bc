!> Motion of particles by the nodal displacements of all levels: largest displacement and gradient, and rigid
!> motion of bodies.
module m_static_ways
   use m_kinds, only: wp
   use m_node_values, only: v_x, v_z
   use m_g2p_boxes, only: fastest_t
   use m_model, only: model_t
   use m_static_tiles, only: take_gradients
   use m_static_levels, only: longest_way
   use m_static_contact, only: static_contact_t
   implicit none
   private
   public :: steepest, farthest, motion_of_body, may_hold

   !> A body that moves without strain. The same on all ranks.
   type, public :: rigid_motion_t
      integer :: body = 0             !< 0: none
      real(wp) :: way = 0.0_wp        !< largest component, m
      real(wp) :: along(3) = 0.0_wp   !< of the point with the largest displacement, a unit vector
      real(wp) :: about(3) = 0.0_wp   !< axis of rotation, a unit vector; 0: no rotation
   end type rigid_motion_t

   real(wp), parameter :: stiff = 1.0e-4_wp !< strain times cell over displacement: smaller counts as rigid
   real(wp), parameter :: against = 1.0e-6_wp !< of the largest displacement: smaller does not count as
                                              !< towards a point
   real(wp), parameter :: even = 1.0e-3_wp  !< likewise for a rotation

contains

   !> Collective: largest component of the gradients at all particles.
   real(wp) function steepest(model, work)
      type(model_t), intent(inout) :: model
      real(wp), intent(inout), contiguous :: work(:, :) !< (particles of the largest block, 9 or more)
      integer :: b, l
      steepest = 0.0_wp
      do l = 1, size(model%levels)
         associate (level => model%levels(l))
            do b = 1, size(level%blocks)
               associate (n => level%blocks(b)%particles%count)
                  if (n == 0) cycle
                  call take_gradients(level, b, work(:, :9))
                  steepest = max(steepest, maxval(abs(work(:n, :9))))
               end associate
            end do
         end associate
      end do
      steepest = model%communicator%maximum(steepest)
   end function steepest

   !> Collective: the largest displacement component of a particle, relative to the allowed one; and the
   !> particle of this rank with the largest one (level, block, particle; 0: none) and its displacement.
   real(wp) function farthest(model, work, at, own)
      type(model_t), intent(inout) :: model
      real(wp), intent(inout), contiguous :: work(:, :)
      integer, intent(out) :: at(3)
      real(wp), intent(out) :: own
      type(fastest_t) :: longest
      integer :: b, l
      at = 0
      own = 0.0_wp
      do l = 1, size(model%levels)
         associate (level => model%levels(l), most => longest_way(model, l))
            do b = 1, size(level%blocks)
               if (level%blocks(b)%particles%count == 0) cycle
               longest = fastest_t(own*most)
               call take_gradients(level, b, work(:, :9), longest)
               if (longest%particle > 0) at = [l, b, longest%particle]
               own = longest%speed/most
            end do
         end associate
      end do
      farthest = model%communicator%maximum(own)
   end function farthest

   !> Collective: the body of the particle with the largest displacement, if the nodal displacements cause no
   !> strain.
   function motion_of_body(model, work) result(motion)
      type(model_t), intent(inout) :: model
      real(wp), intent(inout), contiguous :: work(:, :)
      type(rigid_motion_t) :: motion
      type(fastest_t) :: longest
      real(wp) :: way, strain, most, first, sums(7)
      integer :: b, c, l
      way = 0.0_wp
      strain = 0.0_wp
      sums = 0.0_wp
      do l = 1, size(model%levels)
         associate (level => model%levels(l))
            do b = 1, size(level%blocks)
               associate (n => level%blocks(b)%particles%count)
                  if (n == 0) cycle
                  longest = fastest_t(way)
                  call take_gradients(level, b, work(:, :9), longest)
                  strain = max(strain, level%grid%cell*max_strain(work(:n, :9)))
                  if (longest%particle == 0) cycle
                  way = longest%speed
                  sums = [real(level%blocks(b)%particles%body(longest%particle), wp), &
                          displacement(model, l, b, longest%particle), &
                          level%grid%cell*turn(work(longest%particle, :9))]
               end associate
            end do
         end associate
      end do
      most = model%communicator%maximum(way)
      if (model%communicator%maximum(strain) > stiff*most) return
      first = model%communicator%minimum(merge(real(model%communicator%rank, wp), huge(1.0_wp), way >= most))
      if (abs(first - model%communicator%rank) > 0.5_wp) sums = 0.0_wp ! those of one rank
      do c = 1, 7
         sums(c) = model%communicator%sum_real(sums(c))
      end do
      motion%body = nint(sums(1))
      motion%way = most
      motion%along = sums(2:4)/max(norm2(sums(2:4)), tiny(1.0_wp))
      if (norm2(sums(5:7)) > even*most) motion%about = sums(5:7)/norm2(sums(5:7))
   end function motion_of_body

   !> Collective: true when points within reach, pressed or not, would resist displacements of the nodes.
   logical function may_hold(contact, model, most)
      type(static_contact_t), intent(in) :: contact
      type(model_t), intent(in) :: model
      real(wp), intent(in) :: most !< largest displacement of particles on all ranks, m
      real(wp) :: u(3), closing
      integer :: n
      closing = 0.0_wp
      associate (finest => model%levels(size(model%levels)))
         do n = 1, contact%count
            associate (it => contact%list(n))
               if (it%barred) cycle
               u = contact%way(n, finest%nodes)
               closing = max(closing, merge(norm2(u), -dot_product(it%normal, u), it%point%has_friction))
            end associate
         end do
      end associate
      may_hold = model%communicator%maximum(closing) > against*most
   end function may_hold

   !> Largest component of strains.
   pure real(wp) function max_strain(gradient) result(most)
      real(wp), intent(in) :: gradient(:, :) !< (particles, 9)
      integer, parameter :: ij(6) = [1, 5, 9, 2, 3, 6], ji(6) = [1, 5, 9, 4, 7, 8]
      integer :: c
      most = 0.0_wp
      do c = 1, 6
         most = max(most, maxval(abs(gradient(:, ij(c)) + gradient(:, ji(c)))))
      end do
   end function max_strain

   !> Rotation vector of a gradient, rad.
   pure function turn(gradient) result(vector)
      real(wp), intent(in) :: gradient(9) !< component ij at 3 (j-1) + i
      real(wp) :: vector(3)
      vector = 0.5_wp*[gradient(6) - gradient(8), gradient(7) - gradient(3), gradient(2) - gradient(4)]
   end function turn

   !> Displacement of the node nearest to a particle, m.
   pure function displacement(model, l, b, p) result(u)
      type(model_t), intent(in) :: model
      integer, intent(in) :: l, b, p
      real(wp) :: u(3)
      integer :: at(3)
      associate (level => model%levels(l), block => model%levels(l)%blocks(b), &
                 x => model%levels(l)%layout%position)
         at = nint((block%particles%column(p, x:x + 2) - block%origin)*level%grid%per_cell) + 1
         u = level%nodes(v_x:v_z, at(1), at(2), at(3), b)
      end associate
   end function displacement

end module m_static_ways
