!> A contact point of an implicit step: its gap and slip under the trial displacement, the forces that come of
!> them, and its stiffness in the linear problem (theory.md, eqs static-contact, static-friction).
module m_static_point
   use m_kinds, only: wp
   use m_contact_point, only: candidate_t
   implicit none
   private
   public :: across

   !> A point: who it is and what it is at the step's beginning (`point`), and under the trial displacement.
   type, public :: static_point_t
      type(candidate_t) :: point
      real(wp) :: outward(3) = 0.0_wp    !< which way its centre is outside the tool
      real(wp) :: depth = 0.0_wp, natural = 0.0_wp !< of it below the centre; that of the particle's shape, m
      real(wp) :: contact_compliance = 0.0_wp      !< gap that a unit of force closes, m/N:
      real(wp) :: subcell_compliance = 0.0_wp !< of that, below the cell (eq. static-subcell)
      real(wp) :: deflection(3) = 0.0_wp !< by which the forces of all points move its surface below cells,
      real(wp) :: beside(3) = 0.0_wp     !< and that less its own share, of the last iteration, m
      real(wp) :: gap = 0.0_wp           !< to the tool or the other body at the step's end, as it would be
                                         !< without the point's force, m
      real(wp) :: normal(3) = 0.0_wp     !< outward from it there; of tools, where forces act over the step,
                                         !< in the middle of the way over the tool
      real(wp) :: centre(3) = 0.0_wp     !< where that is, of tools, m
      real(wp) :: turning(3, 3) = 0.0_wp !< how the normal turns as the point moves, 1/m
      real(wp) :: place(3) = 0.0_wp      !< where it is there, m
      real(wp) :: force = 0.0_wp, force_before = 0.0_wp !< at the step's end and beginning, N
      real(wp) :: kept(3) = 0.0_wp       !< slip by which friction gives way, from the last step, m
      real(wp) :: slip(3) = 0.0_wp       !< that and the step's slip, at the step's end, m
      real(wp) :: friction_force(3) = 0.0_wp, friction_before(3) = 0.0_wp !< on the body, at both ends, N
      real(wp) :: holds = 0.0_wp         !< stiffness of friction in the linear problem, N/m
      real(wp) :: slides(3) = 0.0_wp     !< where it slides there, a unit vector; else 0
      logical :: barred = .false.        !< its tool is drawn off: it does not press
      logical :: pressed = .false.       !< in the guess that the linear problem is solved with
   contains
      procedure :: node_gap
      procedure :: law
      procedure :: resist
      procedure :: self_stiffness
      procedure :: set_friction
   end type static_point_t

   real(wp), parameter :: along_slip = 1.0e-3_wp  !< of the secant of friction: stiffness along a slip

contains

   !> What a point exerts on its body when it has moved by `ahead` over the tool beyond where it is: a normal
   !> force that does not pull, and friction that is not beyond its bound (theory.md, eqs static-contact,
   !> static-friction).
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

   !> Stiffness of a point in the linear problem, as it acts on a way over the tool, N: of pressed ones, along
   !> the normal, and across it where friction may grow; where it slides, that of the chord, less along the
   !> slip, so that the energy goes down whatever slides.
   pure function resist(self, way) result(force)
      class(static_point_t), intent(in) :: self
      real(wp), intent(in) :: way(3) !< m
      real(wp) :: force(3)
      force = dot_product(self%normal, way)/self%contact_compliance*self%normal
      if (self%holds > 0.0_wp) force = force + self%holds*(across(self%normal, way) &
         - (1.0_wp - along_slip)*dot_product(self%slides, way)*self%slides)
   end function resist

   !> Components of the stiffness of a point on themselves, N/m.
   pure function self_stiffness(self) result(stiffness)
      class(static_point_t), intent(in) :: self
      real(wp) :: stiffness(3)
      stiffness = self%normal**2/self%contact_compliance + self%holds*(1.0_wp - self%normal**2 &
                                                       - (1.0_wp - along_slip)*self%slides**2)
   end function self_stiffness

   !> Friction of the linear problem about where points are by `ahead`: whether they hold, or how they slide.
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

   !> The part of a vector across a normal.
   pure function across(normal, vector) result(part)
      real(wp), intent(in) :: normal(3), vector(3)
      real(wp) :: part(3)
      part = vector - dot_product(normal, vector)*normal
   end function across

end module m_static_point
