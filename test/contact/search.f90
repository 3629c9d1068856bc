!> The search for candidates against every particle asked by itself (theory.md, eqs contact-gap,
!> contact-candidates): random particles in several blocks, node speeds, stresses and tools that move; cubes,
!> some of them thick, boxes that stretch, and domains that turn; convex tools, a ring, and a star of
!> triangles. No candidate is lost, none is added, and the deepest overlap is found, also that of particles on
!> their way out.
program search
   use m_kinds, only: wp
   use m_node_values, only: tile_last
   use m_communicator, only: communicator_t
   use m_scene, only: scene_t, grid_spec_t, tool_spec_t
   use m_side_kinds, only: boundary_free
   use m_sphere, only: sphere_t
   use m_cone, only: cone_t
   use m_flat, only: flat_t
   use m_ring, only: ring_t
   use m_constants, only: pi
   use m_triangles, only: triangles_t, weld
   use m_file_shape, only: file_shape_t
   use m_materials, only: material_of
   use m_scene_materials, only: materials_t, make_materials
   use m_isotropic, only: isotropic_t
   use m_tool, only: tool_t, make_tool
   use m_level, only: level_t
   use m_constants, only: block_size
   use m_half_edges, only: fitted_edges
   use m_face_weights, only: find_face, cube_span
   use m_candidates, only: candidates_t
   use m_made_level, only: make_level
   use m_assertions, only: assertions_t
   use m_chance, only: chance_t
   implicit none
   integer, parameter :: cells = 24, particles = 8000, cubes = 1, stretching = 2, turning = 3
   real(wp), parameter :: cell = 0.5_wp, time_step = 1.0e-3_wp, young = 1.0e6_wp
   real(wp), parameter :: margin = 0.05_wp, flattening = 0.15_wp ! as in theory.md
   real(wp), parameter :: tiny_half = 1.0e-9_wp ! cells: of the half of a face, rounding
   type(communicator_t) :: comm
   type(assertions_t) :: test
   type(chance_t) :: chance
   integer :: found, inside, kind, round
   call comm%start()
   call test%start(comm, 'search')
   found = 0
   inside = 0
   do kind = cubes, turning
      do round = 1, 20
         call look(kind, mod(round, 5))
      end do
   end do
   print '(3x,a,i0,a,i0)', 'candidates: ', found, '; contact points inside a tool: ', inside
   call test%check(found > 2000 .and. inside > 500, 'there was something to find')
   call test%finish()

contains

   !> One level of particles and one tool.
   subroutine look(kind, shape)
      integer, intent(in) :: kind, shape
      type(level_t) :: level
      type(materials_t) :: materials
      type(tool_t) :: tools(1)
      type(candidates_t) :: candidates
      real(wp) :: nodes(3, -1:cells + 1, -1:cells + 1, -1:cells + 1), overlap(1), deepest, gap, approach
      logical, allocatable :: listed(:, :)
      logical :: is_one
      integer :: added, b, c, lost, p
      materials = soft()
      tools(1) = random_tool(shape)
      call fill(level, kind, materials)
      call set_nodes(level, nodes)
      candidates%pressure = level%table%column('contact_pressure')
      candidates%earlier = level%table%column('last_contact_pressure')
      candidates%carried = level%table%column('contact_gap')
      candidates%slots = [0, 1]
      allocate (candidates%list(4))
      call candidates%find(tools, level, materials, time_step, overlap)
      allocate (listed(maxval([(level%blocks(b)%particles%count, b=1, size(level%blocks))]), &
                       size(level%blocks)), source=.false.)
      do c = 1, candidates%count
         listed(candidates%list(c)%particle, candidates%list(c)%block) = .true.
      end do
      call test%check(count(listed) == candidates%count, 'each candidate stands there once')
      lost = 0
      added = 0
      deepest = 0.0_wp
      do b = 1, size(level%blocks)
         do p = 1, level%blocks(b)%particles%count
            call ask(level, materials, tools(1), nodes, level%blocks(b)%particles%column(p, :), gap, &
                     approach, is_one)
            deepest = max(deepest, -gap)
            if (gap < 0.0_wp) inside = inside + 1
            if (is_one .and. .not. listed(p, b)) lost = lost + 1
            if (listed(p, b) .and. .not. is_one) added = added + 1
         end do
      end do
      found = found + candidates%count
      call test%check(lost == 0, 'no candidate is lost')
      call test%check(added == 0, 'no particle is a candidate that is none')
      call test%check_close(overlap(1), deepest, 1.0e-12_wp, 'the deepest overlap, m')
   end subroutine look

   function soft() result(materials)
      type(materials_t) :: materials
      type(scene_t) :: scene
      allocate (scene%materials(1), scene%bodies(1))
      scene%materials(1) = material_of('soft', 'elastic', 1000.0_wp, young, 0.3_wp)
      scene%bodies(1)%material = 1
      materials = make_materials(scene)
   end function soft

   !> A tool somewhere among the particles that moves by up to 0.1 cells in a step, either way.
   type(tool_t) function random_tool(shape) result(tool)
      integer, intent(in) :: shape
      type(tool_spec_t) :: spec
      spec%name = 'tool'
      select case (shape)
      case (0); spec%shape = sphere_t(radius=chance%between(1.0_wp, 4.0_wp))
      case (1); spec%shape = cone_t(half_angle=chance%between(0.5_wp, 1.4_wp))
      case (2); spec%shape = flat_t(radius=chance%between(1.0_wp, 4.0_wp))
      case (3); spec%shape = ring_t(radius=chance%between(1.5_wp, 4.0_wp), &
                                        tube=chance%between(0.5_wp, 1.5_wp))
      case (4); spec%shape = star_of(chance%between(1.5_wp, 3.0_wp))
      end select
      spec%axis = chance%several(3, -1.0_wp, 1.0_wp)
      spec%axis = spec%axis/norm2(spec%axis)
      spec%tip = 0.5_wp*cells*cell + chance%several(3, -2.0_wp, 2.0_wp)
      spec%penetration_factor = chance%between(0.0_wp, 0.5_wp)
      spec%times = [0.0_wp]
      spec%speeds = [0.1_wp*cell/time_step*chance%between(-1.0_wp, 1.0_wp)]
      tool = make_tool(spec)
      call tool%begin_step(0.0_wp, time_step)
   end function random_tool

   !> Triangles about a sphere, with spikes and hollows.
   type(file_shape_t) function star_of(radius) result(star)
      real(wp), intent(in) :: radius
      integer, parameter :: u = 16, v = 8
      type(triangles_t) :: triangles
      real(wp) :: place(3, 4*u*v), around, up, out
      real(wp), allocatable :: corner(:, :)
      integer, allocatable :: of(:, :)
      character(len=:), allocatable :: fault
      integer :: i, j, k, n
      n = 0
      allocate (of(3, 2*u*v))
      do j = 0, v - 1
         do i = 0, u - 1
            do k = 1, 4
               around = mod(i + merge(1, 0, k == 2 .or. k == 3), u)
               up = j + merge(1, 0, k > 2)
               out = radius*(1.0_wp + merge(0.3_wp, -0.3_wp, mod(nint(around + up), 2) == 0))
               if (nint(up) == 0 .or. nint(up) == v) out = radius
               place(:, 4*n + k) = out*[sin(pi*up/v)*cos(2*pi*around/u), sin(pi*up/v)*sin(2*pi*around/u), &
                                        -cos(pi*up/v)]
               if (nint(up) == 0 .or. nint(up) == v) place(1:2, 4*n + k) = 0.0_wp
            end do
            of(:, 2*n + 1) = 4*n + [1, 2, 3]
            of(:, 2*n + 2) = 4*n + [1, 3, 4]
            n = n + 1
         end do
      end do
      corner = place
      call weld(corner, of)
      triangles%corner = corner
      triangles%of = of
      call triangles%close_up(fault)
      call test%check(fault == '', 'the star is closed', fault)
      allocate (star%inside_of)
      call star%inside_of%build(triangles)
   end function star_of

   !> Particles of half the cell's edge or less, everywhere but near the grid's sides; by their stress some
   !> cubes are twice as thick as their edge.
   subroutine fill(level, kind, materials)
      type(level_t), intent(inout) :: level
      integer, intent(in) :: kind
      type(materials_t), intent(in) :: materials
      type(grid_spec_t) :: spec
      real(wp), allocatable :: values(:, :)
      real(wp) :: half(3), strain
      integer :: b, k, p
      call level%table%declare('position', 3, 'm', .true.)
      call level%table%declare('velocity', 3, 'm/s', .true.)
      call level%table%declare('mass', 1, 'kg', .true.)
      call level%table%declare('volume', 1, 'm3', .true.)
      if (kind == turning) call level%table%declare('domain', 9, 'm', .true.)
      if (kind /= turning) call level%table%declare('half_size', merge(3, 1, kind == stretching), 'm', .true.)
      call level%table%declare('stress', 6, 'Pa', .true.)
      call level%table%declare('contact_pressure', 1, 'Pa', .true.)
      call level%table%declare('last_contact_pressure', 1, 'Pa', .false.)
      call level%table%declare('contact_gap', 1, 'm', .false.)
      level%layout = level%table%layout()
      allocate (values(particles, level%table%columns), source=0.0_wp)
      associate (at => level%layout)
         do p = 1, particles
            values(p, at%position:at%position + 2) = cell*chance%several(3, 3.0_wp, cells - 3.0_wp)
            values(p, at%mass) = 1.0_wp
            half = 0.25_wp*cell
            select case (kind)
            case (cubes)
               values(p, at%half_size) = half(1)
               strain = chance%between(-0.5_wp, 0.65_wp) ! logarithmic; up to 1.9 times as thick
               select type (law => materials%slots(1)%law)
               class is (isotropic_t)
                  values(p, at%stress:at%stress + 2) = strain*(3.0_wp*law%lame + 2.0_wp*law%shear)
               end select
            case (stretching)
               half = 0.29_wp*cell*chance%several(3, 0.3_wp, 1.0_wp)
               values(p, at%half_size:at%half_size + 2) = half
            case (turning)
               do k = 1, 3 ! edges that are not across each other
                  half = 0.07_wp*cell*chance%several(3, -1.0_wp, 1.0_wp)
                  half(k) = 0.2_wp*cell*chance%between(0.5_wp, 1.0_wp)
                  values(p, at%domain + 3*k - 3:at%domain + 3*k - 1) = half
               end do
               half = 0.15_wp*cell
            end select
            values(p, at%volume) = 8.0_wp*product(half)
         end do
      end associate
      spec%cell_size = cell
      spec%lower = 0.0_wp
      spec%upper = cells*cell
      spec%cells = cells
      spec%boundary = boundary_free
      call make_level(level, spec, values)
      do b = 1, size(level%blocks)
         call level%blocks(b)%cells%update_statistics(level%blocks(b)%particles%count)
         associate (block => level%blocks(b), x => level%layout%position)
            block%lowest = minval(block%particles%column(:block%particles%count, x:x + 2), dim=1)
            block%highest = maxval(block%particles%column(:block%particles%count, x:x + 2), dim=1)
         end associate
      end do
   end subroutine fill

   !> Nodes with mass and random velocities, up to 0.002 or 0.2 cells in a step, in all tiles that have them.
   subroutine set_nodes(level, nodes)
      type(level_t), intent(inout) :: level
      real(wp), intent(out) :: nodes(3, -1:cells + 1, -1:cells + 1, -1:cells + 1)
      integer :: at(3), b, i, j, k
      real(wp) :: fast
      fast = merge(0.2_wp, 0.002_wp, chance%between(0.0_wp, 1.0_wp) > 0.5_wp)*cell/time_step
      do k = -1, cells + 1
         do j = -1, cells + 1
            do i = -1, cells + 1
               nodes(:, i, j, k) = fast*chance%several(3, -1.0_wp, 1.0_wp)
            end do
         end do
      end do
      level%nodes = 0.0_wp
      do b = 1, size(level%blocks)
         do k = 0, tile_last
            do j = 0, tile_last
               do i = 0, tile_last
                  at = block_size*level%blocks(b)%place + [i, j, k] - 1
                  if (any(at > cells + 1)) cycle
                  level%nodes(1, i, j, k, b) = 1.0_wp
                  level%nodes(2:4, i, j, k, b) = nodes(:, at(1), at(2), at(3))
               end do
            end do
         end do
      end do
   end subroutine set_nodes

   !> One particle: the gap of its contact point (m), what the nodes add to it in a step (m), and whether it
   !> is a candidate.
   subroutine ask(level, materials, tool, nodes, values, gap, approach, is_one)
      type(level_t), intent(in) :: level
      type(materials_t), intent(in) :: materials
      type(tool_t), intent(in) :: tool
      real(wp), intent(in) :: nodes(3, -1:cells + 1, -1:cells + 1, -1:cells + 1)
      real(wp), intent(in) :: values(:)
      real(wp), intent(out) :: gap, approach
      logical, intent(out) :: is_one
      real(wp) :: normal(3), thickness, edge, to_face, span(3, 3), place(3), velocity(3)
      integer :: i, j, k
      associate (at => level%layout)
         call tool%gap_and_normal(values(at%position:at%position + 2), gap, normal)
         if (at%domain > 0 .or. at%half_sizes) then
            edge = values(at%volume)**(1.0_wp/3.0_wp)
            associate (r => fitted_edges(values, at, cell))
               thickness = level%thickness(values, normal)
               call find_face(r, normal, norm2(matmul(normal, r)), to_face, span)
            end associate
         else
            edge = 2.0_wp*values(at%half_size)
            thickness = edge*materials%slots(1)%law%stretch(values, at, normal)
            to_face = 0.5_wp*edge*min(1.0_wp, thickness/edge + flattening)
            span = cube_span(0.5_wp*edge, normal)
         end if
         gap = gap - tool%spec%penetration_factor*thickness
         place = (values(at%position:at%position + 2) - to_face*normal)/cell
      end associate
      velocity = 0.0_wp
      if (level%layout%domain > 0) then ! the mean over the corners of the face
         do k = -1, 1, 2
            do j = -1, 1, 2
               do i = -1, 1, 2
                  velocity = velocity &
                             + 0.125_wp*velocity_at(nodes, place + matmul(span, real([i, j, k], wp))/cell)
               end do
            end do
         end do
      else ! over a box along the axes
         velocity = mean_velocity(nodes, place, [(abs(span(k, k))/cell, k=1, 3)])
      end if
      approach = time_step*dot_product(normal, velocity - tool%velocity)
      is_one = max(0.0_wp, gap) + approach <= margin*edge
   end subroutine ask

   !> Mean velocity of the grid over a box (cells): in each cell that it meets that of the middle.
   pure function mean_velocity(nodes, place, half) result(velocity)
      real(wp), intent(in) :: nodes(3, -1:cells + 1, -1:cells + 1, -1:cells + 1), place(3), half(3)
      real(wp) :: velocity(3), ends(0:2, 3), share(2, 3), middle(2, 3)
      integer :: i, j, k
      ends(0, :) = place - half
      ends(2, :) = place + half
      ends(1, :) = min(ends(2, :), max(ends(0, :), real(nint(place), wp)))
      do k = 1, 3
         middle(:, k) = 0.5_wp*(ends(:1, k) + ends(1:, k))
         share(:, k) = [1.0_wp, 0.0_wp]
         if (half(k) > tiny_half) share(:, k) = 0.5_wp*(ends(1:, k) - ends(:1, k))/half(k)
         if (.not. half(k) > tiny_half) middle(:, k) = place(k)
      end do
      velocity = 0.0_wp
      do k = 1, 2
         do j = 1, 2
            do i = 1, 2
               velocity = velocity + share(i, 1)*share(j, 2)*share(k, 3) &
                          *velocity_at(nodes, [middle(i, 1), middle(j, 2), middle(k, 3)])
            end do
         end do
      end do
   end function mean_velocity

   !> Velocity of the grid at a place in cells.
   pure function velocity_at(nodes, place) result(velocity)
      real(wp), intent(in) :: nodes(3, -1:cells + 1, -1:cells + 1, -1:cells + 1), place(3)
      real(wp) :: velocity(3), share(3)
      integer :: corner(3), i, j, k
      corner = floor(place)
      share = place - corner
      velocity = 0.0_wp
      do k = 0, 1
         do j = 0, 1
            do i = 0, 1
               velocity = velocity + product(merge(share, 1.0_wp - share, [i, j, k] == 1)) &
                          *nodes(:, corner(1) + i, corner(2) + j, corner(3) + k)
            end do
         end do
      end do
   end function velocity_at

end program search
