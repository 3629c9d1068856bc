!> Shapes of rigid tools: the signed distance to a shape and the unit outward normal of its surface. The only place that knows
!> what a shape looks like. All shapes are convex, so the distance is a convex function of the place.
!>
!> A shape has its foremost point (the tip) in the origin and points along its axis. `height` is the distance above the tip, into
!> the tool.
module m_tool_shape
   use m_kinds, only: wp
   use m_vectors, only: cross
   use m_scene, only: tool_spec_t, tool_sphere, tool_cone, tool_flat, tool_berkovich, tool_cylinder, tool_wedge
   implicit none
   private
   public :: tool_shape_t, make_tool_shape

   integer, parameter :: most_faces = 3
   real(wp), parameter :: rounding = 1.0e-12_wp !< a foot so little outside a face, relative to its distance from the tip, is on it

   !> A shape with all that its distance needs at hand.
   type :: tool_shape_t
      integer :: kind = tool_sphere
      real(wp) :: radius = 0.0_wp  !< sphere, flat, cylinder, m
      real(wp) :: axis(3) = 0.0_wp
      real(wp) :: edge(3) = 0.0_wp !< unit vector across the axis: the line of a cylinder, the ridge of a wedge
      real(wp) :: cosine = 1.0_wp, sine = 0.0_wp !< of the half angle
      integer :: faces = 0
      real(wp) :: face(3, most_faces) = 0.0_wp   !< outward normals of the faces of a pyramid or wedge, all through the tip
      real(wp) :: ridge(3, most_faces) = 0.0_wp  !< unit vectors from the tip along the edges between them
   contains
      procedure :: gap_and_normal
   end type tool_shape_t

contains

   !> The shape of a tool.
   pure type(tool_shape_t) function make_tool_shape(spec) result(shape)
      type(tool_spec_t), intent(in) :: spec
      real(wp) :: across(3)
      shape%kind = spec%shape
      shape%radius = spec%radius
      shape%axis = spec%axis
      shape%cosine = cos(spec%half_angle)
      shape%sine = sin(spec%half_angle)
      shape%edge = spec%edge - dot_product(spec%edge, spec%axis)*spec%axis
      if (norm2(shape%edge) > 0.0_wp) shape%edge = shape%edge/norm2(shape%edge)
      across = cross(spec%axis, shape%edge)
      select case (spec%shape)
      case (tool_berkovich)
         call set_faces(shape, reshape([shape%edge, -0.5_wp*shape%edge + sqrt(0.75_wp)*across, &
                                        -0.5_wp*shape%edge - sqrt(0.75_wp)*across], [3, 3]))
      case (tool_wedge)
         call set_faces(shape, reshape([across, -across], [3, 2]))
      end select
   end function make_tool_shape

   !> Faces that stand at the half angle to the axis, from the directions across it in which they lie.
   pure subroutine set_faces(shape, outwards)
      type(tool_shape_t), intent(inout) :: shape
      real(wp), intent(in) :: outwards(:, :)
      integer :: k
      shape%faces = size(outwards, 2)
      do k = 1, shape%faces
         shape%face(:, k) = shape%cosine*outwards(:, k) + shape%sine*shape%axis
      end do
      do k = 1, shape%faces ! a wedge has its one ridge in both directions
         shape%ridge(:, k) = cross(shape%face(:, k), shape%face(:, 1 + mod(k, shape%faces)))
         shape%ridge(:, k) = shape%ridge(:, k)/norm2(shape%ridge(:, k))
         if (shape%faces > 2 .and. dot_product(shape%ridge(:, k), shape%axis) > 0.0_wp) shape%ridge(:, k) = -shape%ridge(:, k)
      end do
   end subroutine set_faces

   !> Signed distance (m) of a place from the surface, negative inside, and the outward unit normal of the surface there.
   pure subroutine gap_and_normal(self, from_tip, gap, normal)
      class(tool_shape_t), intent(in) :: self
      real(wp), intent(in) :: from_tip(3) !< the place, from the tip, m
      real(wp), intent(out) :: gap, normal(3)
      real(wp) :: radial(3), height, radius
      height = -dot_product(from_tip, self%axis)
      radial = from_tip + height*self%axis
      radius = sqrt(dot_product(radial, radial)) ! norm2 guards against overflow, at several times the cost
      if (radius > 0.0_wp) radial = (1.0_wp/radius)*radial
      select case (self%kind)
      case (tool_sphere)
         call round(from_tip + self%radius*self%axis, self%radius, self%axis, gap, normal)
      case (tool_cylinder)
         call round(from_tip - dot_product(from_tip, self%edge)*self%edge + self%radius*self%axis, self%radius, self%axis, &
                    gap, normal)
      case (tool_cone)
         call cone(self%cosine, self%sine, height, radius, radial, self%axis, gap, normal)
      case (tool_flat)
         call flat(self%radius, height, radius, radial, self%axis, gap, normal)
      case (tool_berkovich, tool_wedge)
         call pyramid(self, from_tip, gap, normal)
      end select
   end subroutine gap_and_normal

   !> A sphere or a roller, by the way from its centre or centre line.
   pure subroutine round(from_centre, radius, axis, gap, normal)
      real(wp), intent(in) :: from_centre(3), radius, axis(3)
      real(wp), intent(out) :: gap, normal(3)
      normal = from_centre
      gap = norm2(normal)
      if (gap > 0.0_wp) then
         normal = normal/gap
      else
         normal = axis
      end if
      gap = gap - radius
   end subroutine round

   !> Infinite cone, apex at height 0. Below the apex' normal cone the apex itself is nearest.
   pure subroutine cone(cosine, sine, height, radius, radial, axis, gap, normal)
      real(wp), intent(in) :: cosine, sine, height, radius, radial(3), axis(3)
      real(wp), intent(out) :: gap, normal(3)
      real(wp) :: along
      along = height*cosine + radius*sine ! along the generator from the apex
      if (along >= 0.0_wp) then
         normal = cosine*radial + sine*axis
         gap = radius*cosine - height*sine
         if (radius <= 0.0_wp) normal = axis
      else
         gap = norm2([height, radius])
         normal = (radius*radial - height*axis)/gap
      end if
   end subroutine cone

   !> Flat-ended cylinder, open upwards.
   pure subroutine flat(face, height, radius, radial, axis, gap, normal)
      real(wp), intent(in) :: face, height, radius, radial(3), axis(3)
      real(wp), intent(out) :: gap, normal(3)
      real(wp) :: below, beside
      below = -height
      beside = radius - face
      if (below > 0.0_wp .and. beside > 0.0_wp) then
         gap = norm2([below, beside])
         normal = (below*axis + beside*radial)/gap
      else if (below >= beside) then
         gap = below
         normal = axis
      else
         gap = beside
         normal = radial
      end if
   end subroutine flat

   !> Infinite pyramid or wedge. Inside, the nearest face. Outside, the face whose plane is met within the shape; where there is
   !> none, the nearest point of the ridges, which may be the apex.
   pure subroutine pyramid(self, from_tip, gap, normal)
      type(tool_shape_t), intent(in) :: self
      real(wp), intent(in) :: from_tip(3)
      real(wp), intent(out) :: gap, normal(3)
      real(wp) :: beyond(most_faces), off(3), distance
      integer :: k
      do k = 1, self%faces
         beyond(k) = dot_product(self%face(:, k), from_tip)
      end do
      k = maxloc(beyond(:self%faces), dim=1)
      gap = beyond(k)
      normal = self%face(:, k)
      if (all(abs(from_tip) <= 0.0_wp)) normal = self%axis
      if (gap <= 0.0_wp) return
      off = from_tip - gap*normal
      ! the foot on the face that is furthest away; if it lies outside another face, no other face's foot is inside either
      if (all(matmul(off, self%face(:, :self%faces)) <= rounding*norm2(from_tip))) return
      gap = huge(gap)
      do k = 1, self%faces
         off = from_tip - max(0.0_wp, dot_product(from_tip, self%ridge(:, k)))*self%ridge(:, k)
         distance = norm2(off)
         if (distance >= gap) cycle
         gap = distance
         normal = off
      end do
      normal = normal/gap
   end subroutine pyramid

end module m_tool_shape
