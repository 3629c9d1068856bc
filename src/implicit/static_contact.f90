!> Contact in a quasi-static step: points that a tool or another body may press, their gaps under a trial
!> displacement, and what pressing does to the nodes (theory.md, eqs static-contact, static-pairs).
module m_static_contact
   use m_kinds, only: wp
   use m_constants, only: block_size
   use m_node_values, only: v_x, v_z, f_x, f_z
   use m_level, only: level_t
   use m_materials, only: materials_t
   use m_half_edges, only: fitted_edges
   use m_stencil, only: bin_place
   use m_face_weights, only: find_face, flattening
   use m_face_gap, only: find_gap, find_thickness, particles_near, deform, thickest
   use m_static_tools, only: static_tools_t
   use m_static_pairs, only: static_pairs_t
   use m_scene, only: body_contact_spec_t
   use m_friction_law, only: has_friction
   use m_friction_limit, only: friction_limit
   use m_contact_point, only: candidate_t, no_candidate, set_face
   implicit none
   private
   public :: static_contact_t, touches

   !> A point: who it is and what it is at the step's beginning (`point`), and under the trial displacement.
   type, public :: static_point_t
      type(candidate_t) :: point
      real(wp) :: start(3) = 0.0_wp      !< where it is at the step's beginning, between bodies, m
      real(wp) :: outward(3) = 0.0_wp    !< which way its centre is outside the tool
      real(wp) :: depth = 0.0_wp, natural = 0.0_wp !< of it below the centre; that of the particle's shape, m
      real(wp) :: contact_compliance = 0.0_wp      !< gap that a unit of force closes, m/N
      real(wp) :: gap = 0.0_wp           !< to the tool or the other body at the step's end, m
      real(wp) :: normal(3) = 0.0_wp     !< outward from it there; of tools, where forces act over the step,
                                         !< in the middle of the way over the tool
      real(wp) :: centre(3) = 0.0_wp     !< where that is, of tools, m
      real(wp) :: turning(3, 3) = 0.0_wp !< how the normal turns as the point moves, 1/m
      real(wp) :: place(3) = 0.0_wp      !< where it is there, m
      real(wp) :: force = 0.0_wp, force_before = 0.0_wp !< at the step's end and beginning, N
      real(wp) :: kept(3) = 0.0_wp       !< slip by which friction gives way, from the last step, m
      real(wp) :: slip(3) = 0.0_wp       !< that and the step's slip, at the step's end, m
      real(wp) :: friction_force(3) = 0.0_wp        !< friction on the body, N
      real(wp) :: holds = 0.0_wp         !< stiffness of friction in the linear problem, N/m
      real(wp) :: slides(3) = 0.0_wp     !< where it slides there, a unit vector; else 0
      logical :: barred = .false.        !< its tool is drawn off: it does not press
      logical :: pressed = .false.       !< in the guess that the linear problem is solved with
   end type static_point_t

   type :: static_contact_t
      type(static_point_t), allocatable :: list(:)
      integer :: count = 0
      type(static_tools_t) :: tools
      type(static_pairs_t) :: pairs         !< far sides of the points between bodies
      type(body_contact_spec_t), allocatable :: pair_specs(:) !< what holds between these
      logical :: is_frictional = .false.             !< some tool or pair has friction
      logical :: meets_first = .false. !< bodies that did not press are thought to: where they almost touch
      real(wp) :: share = 1.0_wp !< of forces here, what acts in the mean of a step: theta where there is
                                 !< inertia,
      logical :: over_step = .false. !< and they act over the whole step
   contains
      procedure :: find
      procedure :: add => append
      procedure :: move
      procedure :: curve
      procedure :: way
      procedure :: law
      procedure :: limit
      procedure :: misfit
      procedure :: resist
      procedure :: self_stiffness
      procedure :: set_friction
      procedure :: stiffness_of_ways
      procedure :: add_force_at
      procedure :: add_diagonal
   end type static_contact_t

   real(wp), parameter :: far = 1.0e30_wp       !< m: gap of a point that does not press
   real(wp), parameter :: touches = 1.0e-6_wp   !< cells: points so near a tool are thought to press at first
   real(wp), parameter :: along_slip = 1.0e-3_wp  !< of the secant of friction: stiffness along a slip
   real(wp), parameter :: sharpest = 1.5_wp !< turning of the normal times the distance, of what is convex
   real(wp), parameter :: probe = 1.0e-3_wp !< cells: over which the turning of the normal is looked at

contains

   !> The points within `reach` of the tools as they stand at the step's end; forces begin as they were.
   subroutine find(self, level, materials, reach, compliance, columns)
      class(static_contact_t), intent(inout) :: self
      type(level_t), intent(inout) :: level
      type(materials_t), intent(in) :: materials
      real(wp), intent(in) :: reach      !< m
      real(wp), intent(in) :: compliance !< of a point: gap over cell under a pressure of Young's modulus
      integer, intent(in) :: columns(3) !< of pressure, friction (0: none), and first of which tool pressed
      integer :: b, n, t
      self%count = 0
      if (.not. allocated(self%list)) allocate (self%list(64))
      do b = 1, size(level%blocks)
         if (level%blocks(b)%particles%count == 0) cycle
         do t = 1, size(self%tools%now)
            associate (tool => self%tools%now(t), block => level%blocks(b))
               if (tool%min_gap(block%origin + 0.5_wp*(block_size - 1)*level%grid%cell) &
                   > 0.5_wp*block_size*sqrt(3.0_wp)*level%grid%cell + reach + thickest(level)) cycle
               call level%blocks(b)%cells%link(level%blocks(b)%particles%count)
               associate (near => particles_near(tool, level, level%blocks(b), thickest(level) + reach))
                  do n = 1, size(near)
                     call consider(self, level, materials, [b, near(n), t], reach, compliance, &
                                   columns)
                  end do
               end associate
            end associate
         end do
      end do
   end subroutine find

   !> Take a particle's point if it is near enough.
   subroutine consider(self, level, materials, number, reach, compliance, columns)
      type(static_contact_t), intent(inout) :: self
      type(level_t), intent(in) :: level
      type(materials_t), intent(in) :: materials
      integer, intent(in) :: number(3), columns(3) !< of the block, the particle, the tool; as of find
      real(wp), intent(in) :: reach, compliance
      type(static_point_t) :: new
      real(wp) :: gap, normal(3), edge, thickness, to_face, span(3, 3), r(3, 3), centre(3), young
      integer :: b, k, p, t
      b = number(1)
      p = number(2)
      t = number(3)
      call find_gap(self%tools%now(t), level, materials, b, p, reach, gap, normal, edge, thickness)
      if (.not. gap <= reach) return
      call out_of_tool()
      new%point = no_candidate
      associate (c => new%point, block => level%blocks(b), column => level%blocks(b)%particles%column, &
                 at => level%layout)
         c%block = b
         c%particle = p
         c%tool = t
         c%normal = normal
         centre = column(p, at%position:at%position + 2)
         if (deform(level)) then
            r = fitted_edges(column(p, :), at, level%grid%cell)
            call find_face(r, normal, level%grid%cell, .true., norm2(matmul(normal, r)), to_face, span)
            c%area = column(p, at%volume)/thickness
         else
            r = 0.5_wp*edge*reshape([1, 0, 0, 0, 1, 0, 0, 0, 1], [3, 3])
            call find_face(r, normal, level%grid%cell, .true., 0.5_wp*edge*min(1.0_wp, thickness/edge &
                                                                              + flattening), to_face, span)
            c%area = edge*merge(at%section%depth(centre(1)), edge, at%section%is_flat())
         end if
         call set_face(c, level%grid, block%place, bin_place(int(block%cells%bin(p))), at%domain > 0, &
                       (centre - to_face*normal - block%origin)*level%grid%per_cell, span*level%grid%per_cell)
         c%from = centre
         k = materials%of_body(block%particles%body(p))
         young = 0.5_wp/materials%slots(k)%law%complementary_energy( &
                 [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp])
         new%contact_compliance = self%share*compliance*level%grid%cell/(young*c%area)
         new%barred = self%tools%away(t)
         if (.not. new%barred) new%force = column(p, columns(1))*c%area/self%share
         if (abs(column(p, columns(3) + t - 1)) > 0.0_wp) new%force_before = new%force
         new%natural = self%tools%now(t)%spec%penetration_factor*thickness
         new%depth = self%tools%depth_of(t, centre, new%natural, merge(-new%contact_compliance &
            *new%force_before, column(p, columns(3) + t - 1), new%force_before > 0.0_wp))
         new%pressed = (new%force > 0.0_wp .or. gap <= touches*level%grid%cell) .and. .not. new%barred
         c%has_friction = has_friction(self%tools%now(t)%spec%friction)
         if (c%has_friction) then
            new%friction_force = column(p, columns(2):columns(2) + 2)*c%area/self%share
            new%kept = -new%contact_compliance*new%friction_force
         end if
      end associate
      call append(self, new)
   contains
      !> Of a centre that the tool has come over in the step, the gap and the face as they are from outside.
      subroutine out_of_tool()
         associate (factor => self%tools%now(t)%spec%penetration_factor, at => level%layout%position)
            centre = level%blocks(b)%particles%column(p, at:at + 2)
            new%outward = normal
            if (.not. gap + factor*thickness < 0.0_wp) return
            new%outward = self%tools%outward_at(t, centre)
            call self%tools%gap_and_normal(t, centre, new%outward, gap, normal)
            call find_thickness(level, materials, b, p, normal, edge, thickness)
            gap = gap - factor*thickness
         end associate
      end subroutine out_of_tool
   end subroutine consider

   !> One point more.
   subroutine append(self, new)
      class(static_contact_t), intent(inout) :: self
      type(static_point_t), intent(in) :: new
      type(static_point_t), allocatable :: more(:)
      if (self%count == size(self%list)) then
         allocate (more(2*self%count))
         more(:self%count) = self%list
         call move_alloc(more, self%list)
      end if
      self%count = self%count + 1
      self%list(self%count) = new
   end subroutine append

   !> Way of a point by the displacements of the nodes, as the tool sees it, or over the other body, m.
   pure function way(self, n, motion) result(u)
      class(static_contact_t), intent(in) :: self
      integer, intent(in) :: n
      real(wp), intent(in), contiguous :: motion(:, 0:, 0:, 0:, :) !< in v_x to v_z, m
      real(wp) :: u(3)
      integer :: i, j, k
      u = 0.0_wp
      associate (c => self%list(n)%point)
         do k = 0, c%face%last
            do j = 0, c%face%last
               do i = 0, c%face%last
                  u = u + c%face%weight(i, j, k)*motion(v_x:v_z, c%face%corner(1) + 1 + i, &
                                                        c%face%corner(2) + 1 + j, c%face%corner(3) + 1 + k, &
                                                        c%block)
               end do
            end do
         end do
         u = c%reflection*u
         if (c%partner > 0) u = u - self%pairs%way(c%partner)
      end associate
   end function way

   !> Gaps, normals and slips under the displacements of the nodes, with the tools as they stand.
   subroutine move(self, motion)
      class(static_contact_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: motion(:, 0:, 0:, 0:, :)
      real(wp) :: u(3), gap
      integer :: n
      do n = 1, self%count
         associate (it => self%list(n), t => self%list(n)%point%tool)
            u = self%way(n, motion)
            if (t == 0) then ! the surface of the other body as it was at the step's beginning
               it%place = it%start + u
               it%normal = it%point%normal
               it%gap = it%point%gap + dot_product(it%normal, u)
               it%slip = across(it%normal, it%kept + u)
               cycle
            end if
            call self%tools%gap_and_normal(t, it%point%from + u, it%outward, it%gap, it%normal)
            it%gap = it%gap - it%depth
            it%place = it%point%from + u - it%depth*it%normal
            it%centre = it%point%from + u
            if (self%over_step) then ! what the force does is what the gap changes by (eq. middle-normal)
               it%centre = it%centre - 0.5_wp*(u - self%tools%material_way(t, it%place))
               call self%tools%gap_and_normal(t, it%centre, it%outward, gap, it%normal)
            end if
            if (it%barred) it%gap = far
            if (.not. it%point%has_friction) cycle
            it%slip = across(it%normal, it%kept + u - self%tools%material_way(t, it%place))
         end associate
      end do
   end subroutine move

   !> The part of a vector across a normal.
   pure function across(normal, vector) result(part)
      real(wp), intent(in) :: normal(3), vector(3)
      real(wp) :: part(3)
      part = vector - dot_product(normal, vector)*normal
   end function across

   !> What a point exerts on its body when it has moved by `ahead` over the tool beyond where it is: a normal
   !> force that does not pull, and friction that is not beyond its bound (theory.md, eqs static-contact,
   !> static-friction).
   pure subroutine law(self, n, ahead, bound, pressing, friction_force)
      class(static_contact_t), intent(in) :: self
      integer, intent(in) :: n
      real(wp), intent(in) :: ahead(3) !< m
      real(wp), intent(in) :: bound    !< of friction, N
      real(wp), intent(out) :: pressing, friction_force(3) !< N
      real(wp) :: length
      associate (it => self%list(n))
         pressing = max(0.0_wp, -(it%gap + dot_product(it%normal, ahead))/it%contact_compliance)
         friction_force = 0.0_wp
         if (.not. (bound > 0.0_wp .and. it%point%has_friction)) return
         friction_force = it%slip + across(it%normal, ahead)
         length = norm2(friction_force)
         if (length <= bound*it%contact_compliance) then
            friction_force = -friction_force/it%contact_compliance
         else
            friction_force = -friction_force*bound/length
         end if
      end associate
   end subroutine law

   !> Largest friction of a point that presses with so much, N.
   pure real(wp) function limit(self, n, pressing)
      class(static_contact_t), intent(in) :: self
      integer, intent(in) :: n
      real(wp), intent(in) :: pressing !< N
      limit = friction_limit(self%list(n)%point, self%tools%now, self%pair_specs, self%share*pressing) &
              /self%share
   end function limit

   !> By how much a point's forces and its place do not belong together: gaps and slips, m.
   pure real(wp) function misfit(self, n)
      class(static_contact_t), intent(in) :: self
      integer, intent(in) :: n
      real(wp) :: pressing, friction_force(3)
      associate (it => self%list(n))
         if (it%force > 0.0_wp) then
            misfit = abs(it%gap + it%contact_compliance*it%force)
         else
            misfit = max(0.0_wp, -it%gap)
         end if
         if (.not. it%point%has_friction) return
         call self%law(n, [0.0_wp, 0.0_wp, 0.0_wp], self%limit(n, it%force), pressing, friction_force)
         misfit = max(misfit, it%contact_compliance*norm2(friction_force - it%friction_force))
      end associate
   end function misfit

   !> How the normals of pressed points turn, by differences about where they are.
   subroutine curve(self, cell)
      class(static_contact_t), intent(inout) :: self
      real(wp), intent(in) :: cell !< m
      real(wp) :: most
      integer :: n
      do n = 1, self%count
         associate (it => self%list(n))
            it%turning = 0.0_wp
            if (.not. it%force > 0.0_wp .or. it%point%tool == 0) cycle
            it%turning = self%tools%turning_at(it%point%tool, it%centre, it%outward, probe*cell)
            if (self%over_step) it%turning = 0.5_wp*it%turning
            most = 1.0_wp/cell
            if (it%depth > 0.0_wp .and. it%gap > -0.5_wp*it%depth) &
               most = max(most, sharpest/(it%gap + it%depth))
            if (norm2(it%turning) > most) it%turning = 0.0_wp ! at an edge that it has come over
         end associate
      end do
   end subroutine curve

   !> Add a force on point n to the forces of its block's tile; outside symmetry planes it is folded later.
   !> What it exerts on another body waits for `give`.
   pure subroutine add_force_at(self, n, force, tiles)
      class(static_contact_t), intent(inout) :: self
      integer, intent(in) :: n
      real(wp), intent(in) :: force(3) !< as the tool sees it, N
      real(wp), intent(inout), contiguous :: tiles(:, 0:, 0:, 0:, :)
      real(wp) :: own(3)
      integer :: i, j, k
      associate (c => self%list(n)%point)
         own = c%reflection*force
         do k = 0, c%face%last
            do j = 0, c%face%last
               do i = 0, c%face%last
                  associate (at => tiles(f_x:f_z, c%face%corner(1) + 1 + i, c%face%corner(2) + 1 + j, &
                                         c%face%corner(3) + 1 + k, c%block))
                     at = at + c%face%weight(i, j, k)*own
                  end associate
               end do
            end do
         end do
         if (c%partner > 0) call self%pairs%push(c%partner, -force, 1)
      end associate
   end subroutine add_force_at

   !> Add the pressed points' part of the diagonal, with the weights to the power of 2; as add_force_at.
   pure subroutine add_diagonal(self, tiles, power)
      class(static_contact_t), intent(inout) :: self
      real(wp), intent(inout), contiguous :: tiles(:, 0:, 0:, 0:, :)
      integer, intent(in) :: power !< 1: what resists even motion
      integer :: i, j, k, n
      do n = 1, self%count
         if (.not. self%list(n)%pressed) cycle
         associate (c => self%list(n)%point, stiffness => self%self_stiffness(n))
            do k = 0, c%face%last
               do j = 0, c%face%last
                  do i = 0, c%face%last
                     associate (at => tiles(f_x:f_z, c%face%corner(1) + 1 + i, c%face%corner(2) + 1 + j, &
                                            c%face%corner(3) + 1 + k, c%block))
                        at = at + c%face%weight(i, j, k)**power*stiffness
                     end associate
                  end do
               end do
            end do
            if (c%partner > 0) call self%pairs%push(c%partner, stiffness, power)
         end associate
      end do
   end subroutine add_diagonal

   !> Stiffness of a point in the linear problem, as it acts on a way over the tool, N: of pressed ones, along
   !> the normal, and across it where friction may grow; where it slides, that of the chord, less along the
   !> slip, so that the energy goes down whatever slides.
   pure function resist(self, n, way) result(force)
      class(static_contact_t), intent(in) :: self
      integer, intent(in) :: n
      real(wp), intent(in) :: way(3) !< m
      real(wp) :: force(3)
      associate (it => self%list(n))
         force = dot_product(it%normal, way)/it%contact_compliance*it%normal
         if (it%holds > 0.0_wp) force = force + it%holds*(across(it%normal, way) &
            - (1.0_wp - along_slip)*dot_product(it%slides, way)*it%slides)
      end associate
   end function resist

   !> Stiffness of pressed points against ways of what loads push, and what it would be if they held every
   !> way, N/m.
   pure subroutine stiffness_of_ways(self, sums, most)
      class(static_contact_t), intent(in) :: self
      real(wp), intent(out) :: sums(:), most(:)
      real(wp) :: one(3)
      integer :: k, n
      sums = 0.0_wp
      most = 0.0_wp
      do k = 1, self%tools%count
         do n = 1, self%count
            associate (it => self%list(n), freedom => self%tools%freedom(k))
               if (it%point%tool /= self%tools%tool(k) .or. .not. it%pressed) cycle
               one = self%tools%now(it%point%tool)%freedoms(freedom)%velocity_at(it%place)/self%tools%reach(k)
               sums(k) = sums(k) + dot_product(one, self%resist(n, one))
               most(k) = most(k) + dot_product(one, one)/it%contact_compliance
            end associate
         end do
      end do
   end subroutine stiffness_of_ways

   !> Components of the stiffness of a point on themselves, N/m.
   pure function self_stiffness(self, n) result(stiffness)
      class(static_contact_t), intent(in) :: self
      integer, intent(in) :: n
      real(wp) :: stiffness(3)
      associate (it => self%list(n))
         stiffness = it%normal**2/it%contact_compliance + it%holds*(1.0_wp - it%normal**2 &
                                                          - (1.0_wp - along_slip)*it%slides**2)
      end associate
   end function self_stiffness

   !> Friction of the linear problem about where points are by `ahead`: whether they hold, or how they slide.
   pure subroutine set_friction(self, n, ahead, bound)
      class(static_contact_t), intent(inout) :: self
      integer, intent(in) :: n
      real(wp), intent(in) :: ahead(3) !< m
      real(wp), intent(in) :: bound    !< N
      real(wp) :: length, slip(3)
      associate (it => self%list(n))
         it%holds = 0.0_wp
         it%slides = 0.0_wp
         if (.not. (it%pressed .and. it%point%has_friction)) return
         slip = it%slip + across(it%normal, ahead)
         length = norm2(slip)
         it%holds = 1.0_wp/it%contact_compliance
         if (length <= bound*it%contact_compliance) return
         it%holds = bound/length
         it%slides = slip/length
      end associate
   end subroutine set_friction

end module m_static_contact
