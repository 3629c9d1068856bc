!> Area over which a tool and the bodies are in contact, seen along the tool's axis (theory.md, eq.
!> contact-edge): from the gaps of the points at the surface on both sides of the contact's edge, and from
!> which of them are pressed.
module m_contact_area
   use mpi_f08
   use m_kinds, only: wp
   use m_communicator, only: communicator_t
   use m_vectors, only: tangents
   use m_field_table, only: layout_t
   use m_side_kinds, only: side_kinds
   use m_section, only: section_t
   use m_tool, only: tool_t
   use m_material, only: material_t
   use m_scene_materials, only: materials_t
   use m_level, only: level_t
   use m_half_edges, only: extents
   use m_surface_points, only: surface_point_t, squares_t, sorted_in_squares, find_neighbours
   use m_contact_edge, only: edges_t, find_edges, ahead
   use m_contact_cover, only: mirror_t, beside, share_inside, find_inside, find_covered, between, &
                              area_of_section
   use m_face_gap, only: find_gap, list_near
   use m_candidates, only: candidates_t
   implicit none
   private
   public :: projected_area, area_of, mirror_t, patch_t, patch_under, patch_of

   !> A tool's contact as its axis sees it: the points at the surface, images in mirrors among them.
   type :: patch_t
      type(surface_point_t), allocatable :: points(:)
      type(squares_t) :: squares
      logical, allocatable :: in_contact(:)
      type(mirror_t), allocatable :: mirrors(:)
      type(section_t) :: section !< that the points are of: all on one line then
   end type patch_t

   real(wp), parameter :: farthest = 1.5_wp !< cells: gaps that are looked at
   real(wp), parameter :: buried = 0.4_wp !< a point is not at the surface if another one beside it is nearer
                                          !< to the tool by so many edges
   real(wp), parameter :: closed = 0.03_wp  !< of the largest gap within a cell: a smaller gap is none
   real(wp), parameter :: around = 1.5_wp   !< cells: a point is in contact that points in contact so near
                                            !< surround
   real(wp), parameter :: turned = 0.75_wp !< cosine: at a ridge the slope of the tool's face turns by more
                                           !< within a cell; by 45 degrees from a face to the ridge of four
   real(wp), parameter :: bears = 0.1_wp   !< of the mean pressure in contact: a point at a ridge that bears
                                           !< more,
   real(wp), parameter :: hovers = 0.25_wp !< edges: and whose gap is smaller, is in contact
   real(wp), parameter :: stride = 1.0_wp/64.0_wp !< of the line back from a point: least step along it
   integer, parameter :: per_edge = 4       !< the area is counted in squares of 1/4 edge
   real(wp), parameter :: max_square = 4.0e6_wp
   real(wp), parameter :: rounding = 1.0e-6_wp !< squares
   integer, parameter :: point_reals = storage_size(surface_point_t())/storage_size(1.0_wp)

contains

   !> Collective: the area (m2) of a tool's contact across its axis, of the modelled part.
   real(wp) function projected_area(communicator, tool, level, materials, candidates, number) result(area)
      type(communicator_t), intent(in) :: communicator
      type(tool_t), intent(in) :: tool
      type(level_t), intent(inout) :: level !< the finest; its lists of cells are brought up to date
      type(materials_t), intent(in) :: materials
      type(candidates_t), intent(in) :: candidates !< of contact: columns of gaps and pressures, moduli
      integer, intent(in) :: number                !< of the tool
      area = area_of(communicator, patch_under(communicator, tool, level, materials, candidates, number), &
                     level%grid%cell)
   end function projected_area

   !> Collective: the contact of a tool; arguments as of projected_area.
   type(patch_t) function patch_under(communicator, tool, level, materials, candidates, number) result(patch)
      type(communicator_t), intent(in) :: communicator
      type(tool_t), intent(in) :: tool
      type(level_t), intent(inout) :: level
      type(materials_t), intent(in) :: materials
      type(candidates_t), intent(in) :: candidates
      integer, intent(in) :: number
      type(surface_point_t), allocatable :: points(:)
      real(wp) :: across(3, 2)
      across = tangents(tool%spec%axis)
      call gather(communicator, points_near(tool, level, materials, candidates, number, across), points)
      patch = patch_of(points, mirrors_of(level, tool, across), level%grid%cell)
      patch%section = level%grid%section
      if (.not. patch%section%is_flat()) return
      ! not patch%in_contact .or. between(...), of which gfortran 14.2 makes wrong code with AVX-512
      where (between(patch%points, patch%in_contact, around*level%grid%cell)) patch%in_contact = .true.
   end function patch_under

   !> Collective: the area (m2) of a patch.
   real(wp) function area_of(communicator, patch, cell) result(area)
      type(communicator_t), intent(in) :: communicator
      type(patch_t), intent(in) :: patch
      real(wp), intent(in) :: cell !< m
      area = 0.0_wp
      if (.not. any(patch%in_contact)) return
      if (patch%section%is_flat()) then
         area = area_of_section(patch%points, patch%squares, patch%in_contact, patch%mirrors, patch%section, &
                                cell)
         return
      end if
      area = communicator%sum_real(counted(patch%points, patch%squares, patch%in_contact, cell, &
                                           patch%mirrors, communicator%rank, communicator%ranks))
   end function area_of

   !> Which of the points that all ranks know are in contact. None where nothing is pressed, or all that is
   !> lies below something.
   type(patch_t) function patch_of(given, mirrors, cell) result(patch)
      type(surface_point_t), intent(in) :: given(:)
      type(mirror_t), intent(in) :: mirrors(:)
      real(wp), intent(in) :: cell !< m
      allocate (patch%points(0), patch%in_contact(0))
      patch%mirrors = mirrors
      if (.not. any(given%pressed > 0.0_wp)) return
      patch%points = with_images(pack(given, at_surface(given, mirrors, cell)), mirrors, 2.0_wp*ahead*cell)
      patch%squares = sorted_in_squares(patch%points, cell)
      associate (points => patch%points, squares => patch%squares)
         patch%in_contact = closed_points(points, squares, cell)
         where (bearing_at_ridge(points, squares, patch%in_contact, cell)) patch%in_contact = .true.
         where (surrounded(points, squares, patch%in_contact, around*cell)) patch%in_contact = .true.
      end associate
   end function patch_of

   !> This rank's particles whose faces are near a tool.
   function points_near(tool, level, materials, candidates, number, across) result(points)
      type(tool_t), intent(in) :: tool
      type(level_t), intent(inout) :: level
      type(materials_t), intent(in) :: materials
      type(candidates_t), intent(in) :: candidates
      integer, intent(in) :: number
      real(wp), intent(in) :: across(3, 2)
      type(surface_point_t), allocatable :: points(:), found(:), more(:)
      real(wp) :: gap, edge, normal(3), thickness, place(3), modulus, lies
      integer, allocatable :: near(:)
      integer :: b, count, n
      allocate (found(0))
      count = 0
      associate (reach => farthest*level%grid%cell, x => level%layout%position)
         do b = 1, size(level%blocks)
            associate (block => level%blocks(b), column => level%blocks(b)%particles%column)
               call list_near(tool, level, b, reach, near)
               if (size(found) < count + size(near)) then
                  allocate (more(2*(count + size(near))))
                  more(:count) = found(:count)
                  call move_alloc(more, found)
               end if
               do n = 1, size(near)
                  call find_gap(tool, level, materials, b, near(n), reach, gap, normal, edge, thickness)
                  if (gap > reach) cycle
                  ! without the particle's own stress: points that the nodes hold off the tool are not
                  ! pressed, but their particles have the pressure in their stress
                  associate (law => materials%slots(materials%of_body(block%particles%body(near(n))))%law)
                     gap = gap + tool%spec%penetration_factor*thickness &
                           *(1.0_wp - exp(-elastic_strain(law, column(near(n), :), level%layout, normal)))
                  end associate
                  count = count + 1
                  modulus = candidates%half_spaces%modulus_of(level, materials, b, near(n))
                  ! the gap is that of a ball: a surface across the axis on top of the ball has it here; an
                  ! elastic surface leaves the tool along its face, where the contact point is
                  lies = merge(0.0_wp, abs(dot_product(normal, tool%spec%axis)), modulus > 0.0_wp)
                  place = column(near(n), x:x + 2) - tool%spec%penetration_factor*thickness*normal &
                          /(1.0_wp + lies)
                  found(count) = surface_point_t(matmul(place, across), gap, edge, modulus=modulus)
                  found(count)%half = matmul(extents(column(near(n), :), level%layout), abs(across))
                  ! a gap that is carried on: it is pressed, or has just been
                  if (any(abs(column(near(n), candidates%carried + candidates%slots(number): &
                                     candidates%carried + candidates%slots(number + 1) - 1)) > 0.0_wp)) then
                     found(count)%pressed = 1.0_wp
                     found(count)%traction = column(near(n), candidates%pressure)
                  end if
                  found(count)%slope = matmul(normal, across)
                  found(count)%slope = found(count)%slope/max(norm2(found(count)%slope), tiny(1.0_wp))
                  associate (s => column(near(n), level%layout%stress:level%layout%stress + 5))
                     found(count)%pressure = -sum(s(:3)*normal**2) - 2.0_wp*(s(4)*normal(2)*normal(3) &
                        + s(5)*normal(1)*normal(3) + s(6)*normal(1)*normal(2))
                  end associate
                  call look_beside(tool, column(near(n), x:x + 2), 2.0_wp*reach, across, normal, &
                                   found(count))
               end do
            end associate
         end do
      end associate
      points = found(:count)
   end function points_near

   !> Whether a particle is beside the tool, so that none of the tool is above it. It counts by `beside` alone
   !> then, though part of its face may be pressed (eq. rim-cut).
   subroutine look_beside(tool, centre, far, across, facing, point)
      type(tool_t), intent(in) :: tool
      real(wp), intent(in) :: centre(3)
      real(wp), intent(in) :: far !< back along the axis from there, beyond all gaps that are looked at, m
      real(wp), intent(in) :: across(3, 2)
      real(wp), intent(in) :: facing(3) !< the tool's normal at the particle
      type(surface_point_t), intent(inout) :: point
      real(wp) :: back(3), normal(3)
      back = -far*tool%spec%axis
      ! the axis of a tool from a file may point away from what the tool presses
      if (tool%spec%shape%is_searched() .and. dot_product(facing, back) > 0.0_wp) back = -back
      point%beside = tool%max_gap(centre + back)
      if (.not. point%beside > 0.0_wp) return ! inside; the gap itself may still be below 0
      call tool%gap_and_normal(centre + back, point%beside, normal)
      if (tool%spec%shape%is_searched()) call look_along(tool, centre, back, point%beside, normal)
      if (.not. point%beside > 0.0_wp) return
      point%place = matmul(centre, across)
      point%pressed = 0.0_wp
      point%outwards = matmul(normal, across)
   end subroutine look_beside

   !> The least gap on a line and the normal there: a tool from a file may end before the line does. The first
   !> gap that is not above 0 is enough.
   subroutine look_along(tool, start, way, least, normal)
      type(tool_t), intent(in) :: tool
      real(wp), intent(in) :: start(3), way(3) !< m
      real(wp), intent(inout) :: least, normal(3) !< those at the end of the line; gap in m
      real(wp) :: gap, gone, here(3) !< part of the line
      gone = 0.0_wp
      do while (gone < 1.0_wp .and. least > 0.0_wp)
         call tool%gap_and_normal(start + gone*way, gap, here)
         if (gap < least) then
            least = gap
            normal = here
         end if
         gone = gone + max(stride, gap/norm2(way)) ! steps of at most the gap pass no surface
      end do
   end subroutine look_along

   !> Elastic strain of a particle along a direction: the slope of the energy of stresses.
   pure real(wp) function elastic_strain(law, values, layout, direction) result(strain)
      class(material_t), intent(in) :: law
      real(wp), intent(in) :: values(:)    !< the particle's columns
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: direction(3) !< unit vector
      real(wp) :: along(6)
      associate (d => direction, unit => law%p_wave_modulus(), &
                 stress => values(layout%stress:layout%stress + 5))
         along = unit*[d**2, d(2)*d(3), d(1)*d(3), d(1)*d(2)]
         strain = (law%energy_of_stress(values, layout, stress + along) &
                   - law%energy_of_stress(values, layout, stress - along))/(2.0_wp*unit)
      end associate
   end function elastic_strain

   !> Collective: the points of all ranks, by rank.
   subroutine gather(communicator, own, points)
      type(communicator_t), intent(in) :: communicator
      type(surface_point_t), intent(in) :: own(:)
      type(surface_point_t), allocatable, intent(out) :: points(:)
      integer :: counts(communicator%ranks), before(communicator%ranks), r
      counts = 0
      counts(communicator%rank + 1) = point_reals*size(own)
      call MPI_Allgather(MPI_IN_PLACE, 0, MPI_DATATYPE_NULL, counts, 1, MPI_INTEGER, communicator%comm)
      before = [(sum(counts(:r - 1)), r=1, size(counts))]
      allocate (points(sum(counts)/point_reals))
      call MPI_Allgatherv(own, point_reals*size(own), MPI_DOUBLE_PRECISION, points, counts, before, &
                          MPI_DOUBLE_PRECISION, communicator%comm)
   end subroutine gather

   !> The planes of symmetry that a tool's axis is parallel to, as lines across the axis.
   pure function mirrors_of(level, tool, across) result(mirrors)
      type(level_t), intent(in) :: level
      type(tool_t), intent(in) :: tool
      real(wp), intent(in) :: across(3, 2)
      type(mirror_t), allocatable :: mirrors(:)
      real(wp) :: plane
      integer :: axis, inwards, side
      allocate (mirrors(0))
      associate (grid => level%grid)
         do axis = 1, 3
            if (abs(tool%spec%axis(axis)) > 1.0e-9_wp) cycle
            do side = 1, 2
               if (.not. side_kinds(grid%boundary(side, axis))%mirrors) cycle
               inwards = 3 - 2*side
               plane = grid%lower(axis) + merge(0, grid%cells(axis), side == 1)*grid%cell
               mirrors = [mirrors, mirror_t(inwards*across(axis, :), inwards*plane)]
            end do
         end do
      end associate
   end function mirrors_of

   !> The points and the images of those within a distance of a mirror.
   pure function with_images(given, mirrors, reach) result(points)
      type(surface_point_t), intent(in) :: given(:)
      type(mirror_t), intent(in) :: mirrors(:)
      real(wp), intent(in) :: reach !< m
      type(surface_point_t), allocatable :: points(:), images(:)
      integer :: m
      images = given(:0)
      do m = 1, size(mirrors)
         images = [images, images_in(mirrors(m), given, reach), images_in(mirrors(m), images, reach)]
      end do
      points = [given, images]
   end function with_images

   !> The images in one mirror.
   pure function images_in(mirror, points, reach) result(images)
      type(mirror_t), intent(in) :: mirror
      type(surface_point_t), intent(in) :: points(:)
      real(wp), intent(in) :: reach !< m
      type(surface_point_t), allocatable :: images(:)
      real(wp) :: beyond(size(points))
      integer :: n, p
      beyond = mirror%normal(1)*points%place(1) + mirror%normal(2)*points%place(2) - mirror%from
      images = points(pack([(p, p=1, size(points))], beyond <= reach))
      beyond(:size(images)) = pack(beyond, beyond <= reach)
      do n = 1, size(images)
         images(n)%place = images(n)%place - 2.0_wp*beyond(n)*mirror%normal
         images(n)%outwards = mirrored(images(n)%outwards, mirror)
         images(n)%slope = mirrored(images(n)%slope, mirror)
      end do
   end function images_in

   !> The image of a vector.
   pure function mirrored(vector, mirror) result(image)
      real(wp), intent(in) :: vector(2)
      type(mirror_t), intent(in) :: mirror
      real(wp) :: image(2)
      image = vector - 2.0_wp*dot_product(mirror%normal, vector)*mirror%normal
   end function mirrored

   !> Points that no other one lies on top of, as the tool sees them.
   pure function at_surface(given, mirrors, cell) result(surface)
      type(surface_point_t), intent(in) :: given(:)
      type(mirror_t), intent(in) :: mirrors(:)
      real(wp), intent(in) :: cell !< m
      logical :: surface(size(given))
      type(surface_point_t), allocatable :: points(:)
      type(squares_t) :: squares
      integer, allocatable :: near(:)
      integer :: n, p
      points = with_images(given, mirrors, beside*maxval(given%edge))
      squares = sorted_in_squares(points, cell)
      allocate (near(size(points)))
      do p = 1, size(given)
         call find_neighbours(squares, points(p)%place, beside*points(p)%edge, near, n)
         surface(p) = .not. any(points(near(:n))%gap < points(p)%gap - buried*points(p)%edge)
      end do
   end function at_surface

   !> Points that the tool presses, or whose gap is none beside that which opens within a cell.
   pure function closed_points(points, squares, cell) result(in_contact)
      type(surface_point_t), intent(in) :: points(:)
      type(squares_t), intent(in) :: squares
      real(wp), intent(in) :: cell !< m
      logical :: in_contact(size(points))
      integer :: near(size(points)), n, p
      in_contact = points%pressed > 0.0_wp
      do p = 1, size(points)
         if (in_contact(p)) cycle
         call find_neighbours(squares, points(p)%place, cell, near, n)
         in_contact(p) = points(p)%gap < closed*maxval(points(near(:n))%gap)
      end do
   end function closed_points

   !> Points at a ridge of the tool that bear pressure: nodes do not follow the ridge, so that points beside
   !> it hover within the contact. Points with the compliance below a cell are pressed there themselves.
   pure function bearing_at_ridge(points, squares, in_contact, cell) result(bearing)
      type(surface_point_t), intent(in) :: points(:)
      type(squares_t), intent(in) :: squares
      logical, intent(in) :: in_contact(:)
      real(wp), intent(in) :: cell !< m
      logical :: bearing(size(points))
      real(wp) :: least
      integer :: near(size(points)), m, n, p
      least = max(0.0_wp, bears*sum(points%pressure, mask=in_contact)/max(1, count(in_contact)))
      bearing = .not. (in_contact .or. points%beside > 0.0_wp .or. points%modulus > 0.0_wp) &
                .and. points%pressure > least &
                .and. points%gap < hovers*points%edge
      do p = 1, size(points)
         if (.not. bearing(p)) cycle
         call find_neighbours(squares, points(p)%place, cell, near, n)
         bearing(p) = any([(dot_product(points(near(m))%slope, points(p)%slope) &
                            < turned*norm2(points(near(m))%slope)*norm2(points(p)%slope), m=1, n)])
      end do
   end function bearing_at_ridge

   !> Points with others in contact on all sides: no half plane from them is free of these. A surface that
   !> nodes carry hovers there, by less than they can follow.
   pure function surrounded(points, squares, in_contact, distance) result(inside)
      type(surface_point_t), intent(in) :: points(:)
      type(squares_t), intent(in) :: squares
      logical, intent(in) :: in_contact(:)
      real(wp), intent(in) :: distance !< m
      logical :: inside(size(points))
      integer :: near(size(points)), n, p
      inside = .false.
      do p = 1, size(points)
         if (in_contact(p) .or. points(p)%gap > points(p)%edge) cycle
         call find_neighbours(squares, points(p)%place, distance, near, n)
         inside(p) = on_all_sides(points, p, pack(near(:n), in_contact(near(:n))))
      end do
   end function surrounded

   !> True where no half plane through a point is free of others.
   pure logical function on_all_sides(points, p, others)
      type(surface_point_t), intent(in) :: points(:)
      integer, intent(in) :: p, others(:) !< numbers of the point and of others
      real(wp), dimension(size(others)) :: side, x, y
      real(wp) :: none
      integer :: n
      x = points(others)%place(1) - points(p)%place(1)
      y = points(others)%place(2) - points(p)%place(2)
      none = 1.0e-6_wp*points(p)%edge**2 ! on the line itself, by rounding
      on_all_sides = size(others) > 2
      do n = 1, size(others)
         if (.not. on_all_sides) return
         side = x(n)*y - y(n)*x
         on_all_sides = any(side > none) .and. any(side < -none)
      end do
   end function on_all_sides

   !> This rank's share of the area: small squares on the near side of the edge that the next point beside the
   !> contact sees, or, away from the edge, whose nearest point is in contact; inside the mirrors.
   real(wp) function counted(points, squares, in_contact, cell, mirrors, rank, ranks)
      type(surface_point_t), intent(in) :: points(:)
      type(squares_t), intent(in) :: squares
      logical, intent(in) :: in_contact(:)
      real(wp), intent(in) :: cell !< m
      type(mirror_t), intent(in) :: mirrors(:)
      integer, intent(in) :: rank, ranks
      real(wp) :: low(2), high(2), edge, start(2), width
      type(edges_t) :: edges
      integer :: first, i, j, last, squares_along(2)
      logical, allocatable :: covered(:)
      edges = find_edges(points, squares, in_contact, cell)
      edge = sum(points%edge, mask=in_contact)/count(in_contact)
      low = [minval(points%place(1), mask=in_contact), minval(points%place(2), mask=in_contact)] - edge
      high = [maxval(points%place(1), mask=in_contact), maxval(points%place(2), mask=in_contact)] + edge
      width = max(edge/per_edge, sqrt(product(high - low)/max_square))
      squares_along = nint((high - low)/width - rounding) ! beyond the faces there is half an edge to spare
      low = 0.5_wp*(low + high - width*squares_along) ! centred: they turn with the points
      allocate (covered(0:squares_along(1) - 1))
      counted = 0.0_wp
      do j = rank, squares_along(2) - 1, ranks
         start = [low(1), low(2) + width*(j + 0.5_wp)]
         call find_inside(mirrors, start, width, squares_along(1), first, last)
         if (first > last) cycle
         call find_covered(points, squares, in_contact, edges, edge, [1.0_wp, 0.0_wp], start, width, first, &
                           covered(first:last))
         do i = first, last
            if (covered(i)) counted = counted &
               + share_inside(mirrors, start + [width*(i + 0.5_wp), 0.0_wp], width)
         end do
      end do
      counted = counted*width**2
   end function counted

end module m_contact_area
