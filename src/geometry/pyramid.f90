!> Pyramids and wedges, open upwards: faces at one angle to the axis, sharp or rounded.
module m_pyramid
   use m_kinds, only: wp
   use m_vectors, only: cross, part_across
   use m_shape, only: convex_t
   implicit none
   private
   public :: pyramid_t, max_faces

   integer, parameter :: max_faces = 12
   real(wp), parameter :: rounding = 1.0e-12_wp !< a foot point outside a face by less, relative to its
                                                !< distance from the tip, is on it

   type, abstract, extends(convex_t) :: pyramid_t
      real(wp) :: half_angle = 0.0_wp                !< between axis and faces, rad
      real(wp) :: tip_radius = 0.0_wp                !< of the tip and of the ridges, m; 0: sharp
      real(wp) :: edge(3) = [1.0_wp, 0.0_wp, 0.0_wp] !< its component normal to the axis sets the rotation of
                                                     !< the faces about the axis
      integer, private :: faces = 0
      real(wp), private :: face(3, max_faces) = 0.0_wp  !< outward normals
      real(wp), private :: ridge(3, max_faces) = 0.0_wp !< unit vectors from the tip along the ridges
   contains
      procedure :: prepare
      procedure :: distance_and_normal
      procedure(outwards_interface), deferred :: outwards
   end type pyramid_t

   abstract interface
      !> Unit vectors normal to the axis, a column a face: the direction in which the face's normal leans.
      pure function outwards_interface(self, edge, across) result(ways)
         import :: pyramid_t, wp
         class(pyramid_t), intent(in) :: self
         real(wp), intent(in) :: edge(3), across(3) !< unit vectors normal to the axis and to each other
         real(wp), allocatable :: ways(:, :)
      end function outwards_interface
   end interface

contains

   !> Set the faces at the half angle to the axis.
   pure subroutine prepare(self, axis)
      class(pyramid_t), intent(inout) :: self
      real(wp), intent(in) :: axis(3)
      real(wp) :: edge(3)
      integer :: k
      self%axis = axis
      edge = part_across(self%edge, axis)
      associate (ways => self%outwards(edge, cross(axis, edge)))
         self%faces = size(ways, 2)
         do k = 1, self%faces
            self%face(:, k) = cos(self%half_angle)*ways(:, k) + sin(self%half_angle)*axis
         end do
      end associate
      do k = 1, self%faces ! the one ridge of a wedge extends in both directions
         self%ridge(:, k) = cross(self%face(:, k), self%face(:, 1 + mod(k, self%faces)))
         self%ridge(:, k) = self%ridge(:, k)/norm2(self%ridge(:, k))
         if (self%faces > 2 .and. dot_product(self%ridge(:, k), axis) > 0.0_wp) self%ridge(:, &
               k) = -self%ridge(:, k)
      end do
   end subroutine prepare

   !> A rounded pyramid is the set of points closer to a sharp one inside it than its radius.
   pure subroutine distance_and_normal(self, place, distance, normal)
      class(pyramid_t), intent(in) :: self
      real(wp), intent(in) :: place(3)
      real(wp), intent(out) :: distance, normal(3)
      call find_sharp(self, place + self%tip_radius*self%axis, distance, normal)
      distance = distance - self%tip_radius
   end subroutine distance_and_normal

   !> Inside, the nearest face. Outside, the face whose foot point is within the shape; if there is none, the
   !> nearest point of the ridges, which may be the apex.
   pure subroutine find_sharp(self, place, distance, normal)
      class(pyramid_t), intent(in) :: self
      real(wp), intent(in) :: place(3) !< from the apex, m
      real(wp), intent(out) :: distance, normal(3)
      real(wp) :: beyond(max_faces), off(3), way
      integer :: k
      do k = 1, self%faces
         beyond(k) = dot_product(self%face(:, k), place)
      end do
      k = maxloc(beyond(:self%faces), dim=1)
      distance = beyond(k)
      normal = self%face(:, k)
      if (all(abs(place) <= 0.0_wp)) normal = self%axis
      if (distance <= 0.0_wp) return
      off = place - distance*normal
      ! foot point on the face that is furthest away; if it lies outside another face, no other face's foot
      ! point is inside either
      if (all(matmul(off, self%face(:, :self%faces)) <= rounding*norm2(place))) return
      distance = huge(distance)
      do k = 1, self%faces
         off = place - max(0.0_wp, dot_product(place, self%ridge(:, k)))*self%ridge(:, k)
         way = norm2(off)
         if (way >= distance) cycle
         distance = way
         normal = off
      end do
      normal = normal/distance
   end subroutine find_sharp

end module m_pyramid
