!> Contact with rigid tools in a quasi-static step: points that a tool may press, their gaps under a trial
!> displacement, and what pressing does to the nodes (theory.md, eq. static-contact).
module m_static_contact
   use m_kinds, only: wp
   use m_constants, only: block_size
   use m_node_values, only: v_x, v_z, f_x, f_z
   use m_tool, only: tool_t
   use m_level, only: level_t
   use m_materials, only: materials_t
   use m_split, only: fitted_edges
   use m_stencil, only: bin_place
   use m_face_weights, only: find_face, flattening
   use m_face_gap, only: find_gap, particles_near, deform, thickest
   use m_contact_point, only: candidate_t, no_candidate, set_face
   implicit none
   private
   public :: static_contact_t

   !> A point: who it is and what it is at the step's beginning (`point`), and under the trial displacement.
   type, public :: static_point_t
      type(candidate_t) :: point
      real(wp) :: start(3) = 0.0_wp      !< where it is at the step's beginning, m
      real(wp) :: yielding = 0.0_wp      !< gap that a unit of force closes, m/N
      real(wp) :: gap = 0.0_wp           !< to the tool at the step's end, m
      real(wp) :: normal(3) = 0.0_wp     !< outward from the tool there
      real(wp) :: turning(3, 3) = 0.0_wp !< how the normal turns as the point moves, 1/m
      real(wp) :: force = 0.0_wp         !< N
      logical :: pressed = .false.       !< in the guess that the linear problem is solved with
   end type static_point_t

   type :: static_contact_t
      type(static_point_t), allocatable :: list(:)
      integer :: count = 0
      type(tool_t), allocatable :: tools(:) !< where they are at the step's end
   contains
      procedure :: find
      procedure :: move
      procedure :: curve
      procedure :: add_forces
      procedure :: way
      procedure :: add_force_at
      procedure :: add_diagonal
   end type static_contact_t

   real(wp), parameter :: probe = 1.0e-3_wp !< cells: over which the turning of the normal is looked at

contains

   !> The points within `reach` of the tools as they stand at the step's end; forces begin as they were.
   subroutine find(self, level, materials, reach, compliance, pressure)
      class(static_contact_t), intent(inout) :: self
      type(level_t), intent(inout) :: level
      type(materials_t), intent(in) :: materials
      real(wp), intent(in) :: reach      !< m
      real(wp), intent(in) :: compliance !< of a point: gap over cell under a pressure of Young's modulus
      integer, intent(in) :: pressure    !< column of the last step's contact pressure
      integer :: b, n, t
      self%count = 0
      if (.not. allocated(self%list)) allocate (self%list(64))
      do b = 1, size(level%blocks)
         if (level%blocks(b)%particles%count == 0) cycle
         do t = 1, size(self%tools)
            associate (tool => self%tools(t), block => level%blocks(b))
               if (tool%least_gap(block%origin + 0.5_wp*(block_size - 1)*level%grid%cell) &
                   > 0.5_wp*block_size*sqrt(3.0_wp)*level%grid%cell + reach + thickest(level)) cycle
               call level%blocks(b)%cells%link(level%blocks(b)%particles%count)
               associate (near => particles_near(tool, level, level%blocks(b), thickest(level) + reach))
                  do n = 1, size(near)
                     call consider(self, level, materials, b, near(n), t, reach, compliance, pressure)
                  end do
               end associate
            end associate
         end do
      end do
   end subroutine find

   !> Take a particle's point if it is near enough.
   subroutine consider(self, level, materials, b, p, t, reach, compliance, pressure)
      type(static_contact_t), intent(inout) :: self
      type(level_t), intent(in) :: level
      type(materials_t), intent(in) :: materials
      integer, intent(in) :: b, p, t, pressure
      real(wp), intent(in) :: reach, compliance
      type(static_point_t) :: new
      real(wp) :: gap, normal(3), edge, thickness, to_face, span(3, 3), r(3, 3), centre(3), young
      integer :: k
      call find_gap(self%tools(t), level, materials, b, p, reach, gap, normal, edge, thickness)
      if (.not. gap <= reach) return
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
            r = 0.0_wp
            do k = 1, 3
               r(k, k) = 0.5_wp*edge
            end do
            call find_face(r, normal, level%grid%cell, .true., 0.5_wp*edge*min(1.0_wp, thickness/edge &
                                                                              + flattening), to_face, span)
            c%area = edge**2
         end if
         call set_face(c, level%grid, block%place, bin_place(int(block%cells%bin(p))), at%domain > 0, &
                       (centre - to_face*normal - block%origin)*level%grid%per_cell, span*level%grid%per_cell)
         c%from = centre
         c%arm = -self%tools(t)%spec%penetration_factor*thickness*normal
         new%start = centre + c%arm
         young = 0.5_wp/materials%slots(materials%of_body(block%particles%body(p)))%law%complementary_energy( &
                 [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp])
         new%yielding = compliance*level%grid%cell/(young*c%area)
         new%force = column(p, pressure)*c%area
         new%pressed = new%force > 0.0_wp
      end associate
      call append(self, new)
   end subroutine consider

   subroutine append(self, new)
      type(static_contact_t), intent(inout) :: self
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

   !> Way of a point by the displacements of the nodes, as the tool sees it, m.
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
      end associate
   end function way

   !> Gaps and normals under the displacements of the nodes.
   subroutine move(self, motion)
      class(static_contact_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: motion(:, 0:, 0:, 0:, :)
      integer :: n
      do n = 1, self%count
         associate (it => self%list(n))
            call self%tools(it%point%tool)%gap_and_normal(it%start + self%way(n, motion), it%gap, it%normal)
         end associate
      end do
   end subroutine move

   !> How the normals of pressed points turn, by differences about where they are.
   subroutine curve(self, motion, cell)
      class(static_contact_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: motion(:, 0:, 0:, 0:, :)
      real(wp), intent(in) :: cell !< m
      real(wp) :: place(3), aside(3), gap, ahead(3), behind(3)
      integer :: k, n
      do n = 1, self%count
         associate (it => self%list(n))
            it%turning = 0.0_wp
            if (.not. it%force > 0.0_wp) cycle
            place = it%start + self%way(n, motion)
            do k = 1, 3
               aside = 0.0_wp
               aside(k) = probe*cell
               call self%tools(it%point%tool)%gap_and_normal(place + aside, gap, ahead)
               call self%tools(it%point%tool)%gap_and_normal(place - aside, gap, behind)
               it%turning(:, k) = (ahead - behind)/(2.0_wp*probe*cell)
            end do
            it%turning = 0.5_wp*(it%turning + transpose(it%turning))
            if (norm2(it%turning)*cell > 1.0_wp) it%turning = 0.0_wp ! at an edge of the tool
         end associate
      end do
   end subroutine curve

   !> Add a force on point n to the forces of its block's tile; outside symmetry planes it is folded later.
   pure subroutine add_force_at(self, n, force, tiles)
      class(static_contact_t), intent(in) :: self
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
      end associate
   end subroutine add_force_at

   !> Add what pressed points do by their forces as they stand.
   pure subroutine add_forces(self, tiles)
      class(static_contact_t), intent(in) :: self
      real(wp), intent(inout), contiguous :: tiles(:, 0:, 0:, 0:, :)
      integer :: n
      do n = 1, self%count
         if (self%list(n)%force > 0.0_wp) call self%add_force_at(n, self%list(n)%force*self%list(n)%normal, tiles)
      end do
   end subroutine add_forces

   !> Add the pressed points' part of the diagonal.
   pure subroutine add_diagonal(self, tiles)
      class(static_contact_t), intent(in) :: self
      real(wp), intent(inout), contiguous :: tiles(:, 0:, 0:, 0:, :)
      integer :: i, j, k, n
      do n = 1, self%count
         if (.not. self%list(n)%pressed) cycle
         associate (c => self%list(n)%point, stiffness => self%list(n)%normal**2/self%list(n)%yielding)
            do k = 0, c%face%last
               do j = 0, c%face%last
                  do i = 0, c%face%last
                     associate (at => tiles(f_x:f_z, c%face%corner(1) + 1 + i, c%face%corner(2) + 1 + j, &
                                            c%face%corner(3) + 1 + k, c%block))
                        at = at + c%face%weight(i, j, k)**2*stiffness
                     end associate
                  end do
               end do
            end do
         end associate
      end do
   end subroutine add_diagonal

end module m_static_contact
