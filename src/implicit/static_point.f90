!> A contact point of an implicit step: its gap and slip under the trial displacement, the resulting forces,
!> and its stiffness in the linear problem (theory.md, eqs static-contact, static-friction).
module m_static_point
   use m_kinds, only: wp
   use m_contact_point, only: candidate_t
   implicit none
   private
   public :: across

   !> A point: its identity and state at the step's beginning (`point`), and under the trial displacement.
   type, public :: static_point_t
      type(candidate_t) :: point
      real(wp) :: outward(3) = 0.0_wp    !< direction in which its centre is outside the tool
      real(wp) :: depth = 0.0_wp, natural = 0.0_wp !< depth of the point below the centre; that by the
                                                   !< particle's shape, m
      real(wp) :: contact_compliance = 0.0_wp      !< contact compliance, m/N:
      real(wp) :: subcell_compliance = 0.0_wp !< its part below the cell (eq. static-subcell)
      real(wp) :: deflection(3) = 0.0_wp !< deflection of its surface below cells by the forces of all points,
      real(wp) :: beside(3) = 0.0_wp     !< and that minus its own contribution, of the last iteration, m
      real(wp) :: gap = 0.0_wp           !< gap to the tool or the other body at the step's end, without the
                                         !< point's force, m
      real(wp) :: normal(3) = 0.0_wp     !< outward normal there; for tools, if forces act over the step, at
                                         !< the middle of the relative displacement
      real(wp) :: centre(3) = 0.0_wp     !< position of that, for tools, m
      real(wp) :: turning(3, 3) = 0.0_wp !< rotation of the normal with the point's position, 1/m
      real(wp) :: place(3) = 0.0_wp      !< position at the step's end, m
      real(wp) :: force = 0.0_wp, force_before = 0.0_wp !< at the step's end and beginning, N
      real(wp) :: kept(3) = 0.0_wp       !< elastic slip of friction, from the last step, m
      real(wp) :: slip(3) = 0.0_wp       !< that plus the step's slip, at the step's end, m
      real(wp) :: friction_force(3) = 0.0_wp, friction_before(3) = 0.0_wp !< on the body, at both ends, N
      real(wp) :: holds = 0.0_wp         !< stiffness of friction in the linear problem, N/m
      real(wp) :: slides(3) = 0.0_wp     !< direction of sliding there, a unit vector; else 0
      logical :: barred = .false.        !< its tool is retracted: it is not pressed
      logical :: pressed = .false.       !< pressed, in the active set of the linear problem
   contains
      procedure :: node_gap
      procedure :: relaxed
      procedure :: law
      procedure :: resist
      procedure :: self_stiffness
      procedure :: set_friction
   end type static_point_t

   real(wp), parameter :: along_slip = 1.0e-3_wp  !< of the secant of friction: stiffness along the slip

contains

   !> Forces of a point on its body after a relative displacement by `ahead` from its position: a normal force
   !> without tension, and friction within its bound (theory.md, eqs static-contact, static-friction).
   pure subroutine law(self, ahead, bound, pressing, friction_force)
      class(static_point_t), intent(in) :: self
      real(wp), intent(in) :: ahead(3) !< m
      real(wp), intent(in) :: bound    !< of friction, N
      real(wp), intent(out) :: pressing, friction_force(3) !< N
      real(wp) :: length
      pressing = max(0.0_wp, -(self%gap + dot_product(self%normal, ahead))/self%contact_compliance)
      friction_force = 0.0_wp
      if (.not. (bound > 0.0_wp .and. self%point%has_friction)) return
      friction_force = self%slip + across(self%normal, ahead)
      length = norm2(friction_force)
      if (length <= bound*self%contact_compliance) then
         friction_force = -friction_force/self%contact_compliance
      else
         friction_force = -friction_force*bound/length
      end if
   end subroutine law

   !> Force by the stiffness of a point in the linear problem for a relative displacement, N: for pressed ones
   !> along the normal, and tangentially where friction may grow; for sliding ones that of the chord, reduced
   !> along the slip, so that the energy decreases for any slip.
   pure function resist(self, way) result(force)
      class(static_point_t), intent(in) :: self
      real(wp), intent(in) :: way(3) !< m
      real(wp) :: force(3)
      force = dot_product(self%normal, way)/self%contact_compliance*self%normal
      if (self%holds > 0.0_wp) force = force + self%holds*(across(self%normal, way) &
         - (1.0_wp - along_slip)*dot_product(self%slides, way)*self%slides)
   end function resist

   !> Diagonal components of the stiffness of a point, N/m.
   pure function self_stiffness(self) result(stiffness)
      class(static_point_t), intent(in) :: self
      real(wp) :: stiffness(3)
      stiffness = self%normal**2/self%contact_compliance + self%holds*(1.0_wp - self%normal**2 &
                                                       - (1.0_wp - along_slip)*self%slides**2)
   end function self_stiffness

   !> Linearise friction at positions shifted by `ahead`: sticking, or the direction of sliding.
   pure subroutine set_friction(self, ahead, bound)
      class(static_point_t), intent(inout) :: self
      real(wp), intent(in) :: ahead(3) !< m
      real(wp), intent(in) :: bound    !< N
      real(wp) :: length, slip(3)
      self%holds = 0.0_wp
      self%slides = 0.0_wp
      if (.not. (self%pressed .and. self%point%has_friction)) return
      slip = self%slip + across(self%normal, ahead)
      length = norm2(slip)
      self%holds = 1.0_wp/self%contact_compliance
      if (length <= bound*self%contact_compliance) return
      self%holds = bound/length
      self%slides = slip/length
   end subroutine set_friction

   !> Gap by the nodes alone, m.
   pure real(wp) function node_gap(self)
      class(static_point_t), intent(in) :: self
      node_gap = self%gap - dot_product(self%normal, self%beside)
   end function node_gap

   !> Dissipated below the cells in the step as the material relaxed, of the solver's forces, J: work is by
   !> the mean of the forces at both ends (theory.md, eq. relaxed-below).
   pure real(wp) function relaxed(self)
      class(static_point_t), intent(in) :: self
      relaxed = 0.5_wp*self%point%relaxing*dot_product(self%force_before*self%normal + self%friction_before, &
                                                       self%deflection)
   end function relaxed

   !> The component of a vector orthogonal to a normal.
   pure function across(normal, vector) result(part)
      real(wp), intent(in) :: normal(3), vector(3)
      real(wp) :: part(3)
      part = vector - dot_product(normal, vector)*normal
   end function across

end module m_static_point
