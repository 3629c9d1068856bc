!> The surface of bodies in contact with each other: elements carried by particles, each an area and the arm
!> to its middle (theory.md, eqs surface-element, carried-face). Created for scenes with contact groups,
!> without a group of its own.
module m_surface
   use m_kinds, only: wp
   use m_scene, only: scene_t, body_spec_t, fill_share
   use m_group_reader, only: group_reader_t
   use m_grid_level, only: grid_level_t
   use m_field_table, only: field_table_t, layout_t
   use m_particle_store, only: particle_store_t
   use m_body, only: holds_place
   use m_shape, only: shape_t
   use m_carried_face, only: carry_faces
   use m_effect, only: effect_t, hooks_t
   use m_surface_fields, only: max_elements, area_name, arm_name
   implicit none
   private
   public :: surface_t, make_surface

   integer, parameter :: few_elements = 3 !< enough for the corner of a box, a sphere or a cylinder at least
                                          !< two particles thick
   real(wp), parameter :: one_element = 0.7_wp !< cosine: two sides of a particle share an element if the
                                               !< normal rotates by less
   real(wp), parameter :: farthest = 1.5_wp !< search distance for the surface from a particle, in its edges
   integer, parameter :: steps = 24 !< along a direction, until a point is outside
   real(wp), parameter :: near = 1.0e-9_wp !< tolerance of the distance to the surface, in particle edges
   integer, parameter :: max_rotations = 20 !< iterations of a normal towards that at the foot point
   real(wp), parameter :: smooth = 0.2_wp   !< rotation of the normal up to which a surface is smooth
   real(wp), parameter :: same = 1.0e-14_wp !< rotation of a normal at convergence
   real(wp), parameter :: just_inside = 1.0e-4_wp !< in particle edges: depth at which the nearest face is the
                                                  !< one above
   real(wp), parameter :: one_face = 0.99_wp !< cosine between the normals on both sides of a surface where it
                                             !< is smooth

   type, extends(effect_t) :: surface_t
      type(body_spec_t), allocatable :: bodies(:)
      integer :: elements = max_elements !< maximum number per particle
      integer, allocatable :: area(:), arm(:) !< (elements): first columns, m2 and m
   contains
      procedure :: variables
      procedure :: hooks
      procedure :: declare
      procedure :: cover
      procedure :: on_stress
      procedure, private :: elements_of
   end type surface_t

contains

   !> The surface of the bodies of a scene.
   type(surface_t) function make_surface(scene, erodes) result(surface)
      type(scene_t), intent(in) :: scene
      logical, intent(in) :: erodes !< particles are removed, and those beside them get further elements
      character(len=:), allocatable :: variable
      real(wp) :: thickness, edge
      integer :: b
      surface%name = 'surface'
      surface%bodies = scene%bodies
      surface%elements = merge(max_elements, few_elements, erodes)
      do b = 1, size(scene%bodies)
         call scene%bodies(b)%shape%thinnest(thickness, variable)
         edge = scene%grid%cell_size/nint(real(scene%bodies(b)%particles_per_cell, wp)**(1.0_wp/3.0_wp))
         if (thickness < 1.99_wp*edge .or. scene%bodies(b)%fill == fill_share) &
            surface%elements = max_elements
      end do
   end function make_surface

   !> It has no group.
   subroutine variables(self, group)
      class(surface_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
   end subroutine variables

   pure type(hooks_t) function hooks(self)
      class(surface_t), intent(in) :: self
      hooks = hooks_t(on_stress=.true.)
   end function hooks

   !> Declare two vectors for each possible element of a particle.
   subroutine declare(self, table)
      class(surface_t), intent(inout) :: self
      type(field_table_t), intent(inout) :: table
      integer :: e
      allocate (self%area(self%elements), self%arm(self%elements))
      do e = 1, self%elements
         call table%declare(area_name(e), 3, 'm2', written=.false., extensive=.true.)
         self%area(e) = table%column(area_name(e))
         call table%declare(arm_name(e), 3, 'm', written=.false., arm_to=self%area(e))
         self%arm(e) = table%column(arm_name(e))
      end do
   end subroutine declare

   !> Set the elements of a body's particles that have just been put into a block.
   subroutine cover(self, particles, first, bodies, body, cells, layout, grid)
      class(surface_t), intent(in) :: self
      type(particle_store_t), intent(inout) :: particles
      integer, intent(in) :: first
      type(body_spec_t), intent(in) :: bodies(:)
      integer, intent(in) :: body
      real(wp), intent(in) :: cells(:, :)
      type(layout_t), intent(in) :: layout
      type(grid_level_t), intent(in) :: grid
      real(wp) :: area(3, max_elements), arm(3, max_elements)
      integer :: e, found, p
      do p = first, particles%count
         associate (column => particles%column, x => layout%position, cell => cells(:, p - first + 1))
            call self%elements_of(int(particles%body(p)), column(p, x:x + 2), cell(1:3), 2.0_wp*cell(4), &
                                  grid, found, area, arm)
            do e = 1, min(found, self%elements)
               column(p, self%area(e):self%area(e) + 2) = area(:, e)
               column(p, self%arm(e):self%arm(e) + 2) = arm(:, e)
            end do
         end associate
      end do
   end subroutine cover

   !> The elements of a particle, by its lattice site: on sides without a neighbour of its contact group, the
   !> side's area projected on the shape's surface, and the vector along the surface's normal to it. Sides
   !> between which the surface is nearly flat share one element: a body filled by a lattice has no staircase.
   !> For a section, the sides that lie in it, with their whole extent.
   subroutine elements_of(self, body, centre, place, edge, grid, found, area, arm)
      class(surface_t), intent(in) :: self
      integer, intent(in) :: body
      real(wp), intent(in) :: centre(3)      !< of the particle, m
      real(wp), intent(in) :: place(3), edge !< of its lattice site, m
      type(grid_level_t), intent(in) :: grid
      integer, intent(out) :: found
      real(wp), intent(out) :: area(3, max_elements), arm(3, max_elements) !< the largest first
      real(wp) :: out(3), normal(3), size_of(max_elements), swap(3)
      integer :: axis, e, k, side
      found = 0
      area = 0.0_wp
      arm = 0.0_wp
      do axis = 1, 3, merge(2, 1, grid%section%is_flat())
         do side = -1, 1, 2
            out = 0.0_wp
            out(axis) = side*edge
            if (is_held(place + out)) cycle
            normal = face_normal(self%bodies(body)%shape, centre, place + 0.5_wp*out, out/edge, edge)
            do e = 1, found
               if (dot_product(area(:, e), normal) > one_element*norm2(area(:, e))) exit
            end do
            found = max(found, e)
            area(:, e) = area(:, e) + edge*dot_product(normal, out)*normal
         end do
      end do
      do e = 1, found
         normal = area(:, e)/norm2(area(:, e))
         size_of(e) = norm2(area(:, e))
         call find_foot(self%bodies(body)%shape, centre, normal, edge, arm(:, e))
         if (grid%section%is_flat()) &
            size_of(e) = size_of(e)/edge*grid%section%depth(centre(1) + arm(1, e))
         area(:, e) = size_of(e)*normal
      end do
      do e = 1, found - 1
         k = e - 1 + maxloc(size_of(e:found), dim=1)
         swap = area(:, e); area(:, e) = area(:, k); area(:, k) = swap
         swap = arm(:, e); arm(:, e) = arm(:, k); arm(:, k) = swap
         size_of(k) = size_of(e)
      end do
   contains
      !> True when a point is in a particle of the same contact group, or beyond the sides of the grid.
      logical function is_held(there)
         real(wp), intent(in) :: there(3)
         integer :: b
         is_held = any(there < grid%lower) .or. any(there > grid%upper) ! a section's plane is a side
         do b = 1, size(self%bodies)
            if (is_held) return
            if (self%bodies(b)%field /= self%bodies(body)%field) cycle
            is_held = holds_place(self%bodies(b), grid%cell, there, 0.5_wp*edge)
         end do
      end function is_held
   end subroutine elements_of

   !> Normal of the surface that a side of a particle's site represents: that nearest to the side's middle.
   !> Beside an edge of the shape, where that is a mean of two faces, it is the normal of the face through
   !> which the outward line from the side leaves the shape.
   function face_normal(shape, centre, side, out, edge) result(normal)
      class(shape_t), intent(in) :: shape
      real(wp), intent(in) :: centre(3), side(3) !< of the particle, and middle of the side, m
      real(wp), intent(in) :: out(3)             !< outward normal of the side, a unit vector
      real(wp), intent(in) :: edge               !< of the particle's site, m
      real(wp) :: normal(3), inside(3), distance, way
      call shape%distance_and_normal(side, distance, normal)
      call shape%distance_and_normal(side - (distance + just_inside*edge)*normal, way, inside)
      if (dot_product(normal, inside) < one_face .or. .not. dot_product(normal, out) > 0.0_wp) then
         way = way_out(shape, centre, out, edge)
         if (way > 0.0_wp) &
            call shape%distance_and_normal(centre + (way - just_inside*edge)*out, distance, normal)
      end if
      if (.not. dot_product(normal, out) > 0.0_wp) normal = out
   end function face_normal

   !> The vector from a particle's centre to the surface that an element represents, m, and the normal there.
   !> Where the surface is smooth it is the shortest one, so that both are exact: iterated with the normal of
   !> the surface at the last foot point.
   subroutine find_foot(shape, centre, normal, edge, arm)
      class(shape_t), intent(in) :: shape
      real(wp), intent(in) :: centre(3)
      real(wp), intent(inout) :: normal(3)
      real(wp), intent(in) :: edge !< of the particle's site, m
      real(wp), intent(out) :: arm(3)
      real(wp) :: there(3), last(3), inside(3), distance, way
      integer :: t
      way = max(way_out(shape, centre, normal, edge), 0.01_wp*edge)
      arm = way*normal
      if (way >= farthest*edge) return
      last = normal
      do t = 1, max_rotations
         inside = centre + (way - just_inside*edge)*last
         call shape%distance_and_normal(inside, distance, there)
         if (norm2(there - normal) > smooth .or. norm2(there - last) <= same) exit
         way = dot_product(inside - distance*there - centre, there)
         last = there
      end do
      if (norm2(there - last) > near .or. way < 0.01_wp*edge) return
      normal = last
      arm = way*normal
   end subroutine find_foot

   !> Distance from a particle's centre along a unit vector to the point where it leaves the shape, m; 0 if
   !> the centre is outside, at most 1.5 edges of its site.
   real(wp) function way_out(shape, centre, direction, edge)
      class(shape_t), intent(in) :: shape
      real(wp), intent(in) :: centre(3), direction(3), edge
      real(wp) :: beyond, middle
      integer :: s
      way_out = 0.0_wp
      if (shape%distance(centre) > 0.0_wp) return
      do s = 1, steps
         beyond = farthest*edge*s/steps
         if (shape%distance(centre + beyond*direction) > 0.0_wp) exit
         way_out = beyond
      end do
      if (s > steps) return
      do while (beyond - way_out > near*edge)
         middle = 0.5_wp*(way_out + beyond)
         if (shape%distance(centre + middle*direction) > 0.0_wp) then
            beyond = middle
         else
            way_out = middle
         end if
      end do
   end function way_out

   pure subroutine on_stress(self, particles, layout, gradient, cell, time_step)
      class(surface_t), intent(in) :: self
      type(particle_store_t), intent(inout) :: particles
      type(layout_t), intent(in) :: layout
      real(wp), intent(in), contiguous :: gradient(:, :)
      real(wp), intent(in) :: cell, time_step
      integer :: e
      do e = 1, self%elements
         call carry_faces(particles%column, particles%count, self%area(e), self%arm(e), gradient, time_step)
      end do
   end subroutine on_stress

end module m_surface
