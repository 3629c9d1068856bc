!> The linear problem of a Newton iteration, with contact and friction: active sets and an exact line search
!> (theory.md, eqs static-contact, static-friction).
module m_static_linear
   use m_kinds, only: wp, i8
   use m_krylov, only: krylov_t
   use m_static_system, only: static_system_t
   use m_static_elements, only: static_elements_t
   use m_coarse_grids, only: coarse_grids_t
   implicit none
   private
   public :: static_linear_t

   type :: static_linear_t
      type(krylov_t) :: krylov
      type(static_elements_t) :: elements
      type(coarse_grids_t) :: grids
      logical :: is_fitted = .false.      !< elements or grids have been built in this step
      integer :: solves = 0, products = 0 !< of this step
      integer :: unsolved = 0             !< unsolved linear problems of this step
      logical :: stopped = .false.        !< the system has requested to stop
      integer :: unsettled = 0            !< iterations of this step whose contact status did not converge
      integer(i8) :: cg_solved = 0        !< problems of this step solved by conjugate gradients,
      integer(i8) :: cg_iterations = 0    !< and their iterations
      logical :: gmres_leads = .false.    !< in this step GMRES has solved a problem that conjugate gradients
                                          !< did not
   contains
      procedure :: begin
      procedure :: improve
      procedure, private :: set_points
      procedure, private :: solve_linear
   end type static_linear_t

   integer, parameter, public :: max_unsolved = 3 !< unsolved linear problems of a step, after which the body
                                                  !< counts as unconstrained
   integer, parameter, public :: max_unsettled = 3 !< unsettled iterations of a step, after which it counts as
                                                   !< too long
   integer, parameter :: max_guesses = 20, max_with_friction = 60
   integer, parameter :: swift = 6 !< active-set iterations after which the bounds of friction change less and
                                   !< less
   integer, parameter :: max_products = 4000 !< limit for one problem, by conjugate gradients
   integer, parameter :: max_gmres = 600     !< by GMRES
   integer, parameter :: first_patience = 1000 !< limit for conjugate gradients in the first problem of a
                                               !< step;
   integer, parameter :: patience = 5         !< for later ones a multiple of the mean iterations of solved
                                              !< problems,
   integer, parameter :: min_patience = 300 !< but at least this
   real(wp), parameter :: unheld = 1.0e6_wp !< cells: larger displacements mean that the body is unconstrained
   real(wp), parameter :: unknown = sqrt(huge(1.0_wp)) !< N: finite when multiplied by a length

contains

   !> Start a step: reset the counters.
   pure subroutine begin(self)
      class(static_linear_t), intent(inout) :: self
      self%solves = 0
      self%products = 0
      self%unsolved = 0
      self%unsettled = 0
      self%stopped = .false.
      self%gmres_leads = .false.
      self%cg_solved = 0 ! counters of other steps would not be known after a restart
      self%cg_iterations = 0
      self%is_fitted = .false.
   end subroutine begin

   !> Collective: the change of the displacements that solves the linear problem with contact: it minimises
   !> the convex energy of the linearised step, with points pressed where their gaps would close, and friction
   !> bounded by their pressing forces. Forces of the points become those of the linear problem. `left`:
   !> residual forces; of the residual with the points' present forces, `share` may remain, and `least` in any
   !> case.
   subroutine improve(self, system, force, left, share, least, change)
      class(static_linear_t), intent(inout) :: self
      type(static_system_t), intent(inout) :: system
      real(wp), intent(in) :: force(:) !< without contact, N
      real(wp), intent(in) :: left(:)  !< N
      real(wp), intent(in) :: share, least !< 1; N
      real(wp), intent(out) :: change(:)
      real(wp), dimension(size(change)) :: direction, right, stiff, moved
      real(wp), dimension(3, system%contact%count) :: ahead, along
      real(wp) :: bound(system%contact%count), aim, length
      integer :: guess
      logical :: done
      associate (contact => system%contact)
         change = 0.0_wp
         moved = 0.0_wp ! K change, without the stiffness of points
         ahead = 0.0_wp ! displacement of the points relative to their tools by the change
         call start_bounds(system, bound)
         aim = max(share*what_is_left(system, force, left, bound), least, tiny(aim))
         do guess = 1, merge(max_with_friction, max_guesses, contact%is_frictional)
            done = .false.
            call self%set_points(system, ahead, bound, force - moved, right)
            call self%solve_linear(system, right, direction, aim)
            if (self%stopped) return
            call move_points(system, direction, along)
            if (self%unsolved >= max_unsolved) exit
            if (.not. contact%is_frictional .and. fits(system, ahead + along)) then
               change = change + direction
               ahead = ahead + along
               done = .true.
               exit
            end if
            system%presses = .false.
            call system%multiply(direction, stiff)
            self%products = self%products + 1
            length = 1.0_wp ! close a first contact, as the body is unconstrained without it
            if (.not. contact%meets_first) &
               length = way_to_least(system, force - moved, direction, stiff, ahead, along, bound)
            contact%meets_first = .false.
            change = change + length*direction
            moved = moved + length*stiff
            ahead = ahead + length*along
            call press_by_gaps(system, ahead, bound, min(1.0_wp, real(swift, wp)/guess))
            if (.not. contact%is_frictional) cycle
            call self%set_points(system, ahead, bound, force - moved, right)
            done = sqrt(system%dot(right, right)) <= 2.0_wp*aim
            if (done) exit
         end do
         if (.not. done) self%unsettled = self%unsettled + 1
         call take_forces(system, ahead, bound)
      end associate
   end subroutine improve

   !> Initial bounds of friction: for points that have not been pressed they are unknown, and the point
   !> sticks.
   subroutine start_bounds(system, bound)
      type(static_system_t), intent(in) :: system
      real(wp), intent(out) :: bound(:)
      integer :: n
      do n = 1, size(bound)
         associate (it => system%contact%list(n))
            bound(n) = system%contact%limit(n, it%force)
            if (.not. it%force > 0.0_wp) bound(n) = unknown
         end associate
      end do
   end subroutine start_bounds

   !> Collective: size of the residual forces with points pressed by their gaps, which the linear problem must
   !> reduce, N.
   real(wp) function what_is_left(system, force, left, bound) result(most)
      type(static_system_t), intent(inout) :: system
      real(wp), intent(in) :: force(:), left(:), bound(:)
      real(wp) :: pressing(size(bound)), friction_force(3, size(bound)), right(size(force))
      integer :: n
      do n = 1, size(bound)
         call system%contact%list(n)%law([0.0_wp, 0.0_wp, 0.0_wp], merge(0.0_wp, bound(n), &
            bound(n) >= unknown), pressing(n), friction_force(:, n))
      end do
      call system%contact_forces(pressing, friction_force, right)
      right = right + force
      most = sqrt(system%dot(right, right))
      if (system%model%communicator%sum_real(real(size(bound), wp)) < 0.5_wp) &
         most = max(most, sqrt(system%dot(left, left)))
   end function what_is_left

   !> Collective: set the points of the linear problem about their positions shifted by `ahead`, and its
   !> right-hand side.
   subroutine set_points(self, system, ahead, bound, force, right)
      class(static_linear_t), intent(inout) :: self
      type(static_system_t), intent(inout) :: system
      real(wp), intent(in) :: ahead(:, :), bound(:), force(:)
      real(wp), intent(out) :: right(:)
      real(wp) :: pressing(size(bound)), friction_force(3, size(bound))
      integer :: n
      do n = 1, size(bound)
         associate (it => system%contact%list(n))
            call it%set_friction(ahead(:, n), bound(n))
            pressing(n) = 0.0_wp
            friction_force(:, n) = 0.0_wp
            if (.not. it%pressed) cycle
            call it%law(ahead(:, n), bound(n), pressing(n), friction_force(:, n))
            pressing(n) = -(it%gap + dot_product(it%normal, ahead(:, n)))/it%contact_compliance
         end associate
      end do
      call system%contact_forces(pressing, friction_force, right)
      right = right + force
      self%products = self%products + 1
   end subroutine set_points

   !> Collective: displacements of the points relative to their tools.
   subroutine move_points(system, z, along)
      type(static_system_t), intent(inout) :: system
      real(wp), intent(in) :: z(:)
      real(wp), intent(out) :: along(:, :)
      real(wp) :: ways(system%contact%tools%count)
      integer :: n
      call system%set_motion(z)
      ways = system%ways_of(z)
      do n = 1, system%contact%count
         associate (it => system%contact%list(n))
            along(:, n) = system%contact%way(n, system%model%levels(size(system%levels))%nodes) &
                          - system%contact%tools%way_at(it%point%tool, it%place, ways)
         end associate
      end do
   end subroutine move_points

   !> Collective: true when exactly the points with closed gaps are pressed.
   logical function fits(system, ahead)
      type(static_system_t), intent(in) :: system
      real(wp), intent(in) :: ahead(:, :)
      integer :: n
      fits = .true.
      do n = 1, system%contact%count
         associate (it => system%contact%list(n))
            fits = fits .and. (it%pressed .eqv. it%gap + dot_product(it%normal, ahead(:, n)) < 0.0_wp)
         end associate
      end do
      fits = system%model%communicator%minimum(merge(1.0_wp, 0.0_wp, fits)) > 0.5_wp
   end function fits

   !> Press the points with closed gaps; friction is bounded by their pressing force, to which the bounds move
   !> by a share.
   subroutine press_by_gaps(system, ahead, bound, share)
      type(static_system_t), intent(inout) :: system
      real(wp), intent(in) :: ahead(:, :)
      real(wp), intent(inout) :: bound(:)
      real(wp), intent(in) :: share
      real(wp) :: pressing, friction_force(3)
      integer :: n
      do n = 1, system%contact%count
         associate (it => system%contact%list(n))
            call it%law(ahead(:, n), 0.0_wp, pressing, friction_force)
            it%pressed = pressing > 0.0_wp
            if (bound(n) >= unknown .or. share >= 1.0_wp) then
               bound(n) = system%contact%limit(n, pressing)
            else
               bound(n) = bound(n) + share*(system%contact%limit(n, pressing) - bound(n))
            end if
         end associate
      end do
   end subroutine press_by_gaps

   !> Set the forces of the points from the linear problem.
   subroutine take_forces(system, ahead, bound)
      type(static_system_t), intent(inout) :: system
      real(wp), intent(in) :: ahead(:, :), bound(:)
      real(wp) :: pressing, friction_force(3)
      integer :: n
      do n = 1, system%contact%count
         associate (it => system%contact%list(n))
            call it%law(ahead(:, n), bound(n), pressing, friction_force)
            it%force = pressing
            it%friction_force = friction_force
         end associate
      end do
   end subroutine take_forces

   !> Collective: solve K direction = right to `aim`, with pressed points. Conjugate gradients first, unless
   !> loads that follow surfaces make K far from symmetric. Where
   !> they find a direction of negative curvature or take much longer than before, as K is not quite
   !> symmetric, GMRES follows, and is used first for the rest of the step if it succeeds. If it fails,
   !> conjugate gradients that were cut short, or not tried, continue with a higher limit: large problems need
   !> many iterations. If nothing solves the problem the direction is that of GMRES, which stays bounded.
   subroutine solve_linear(self, system, right, direction, aim)
      class(static_linear_t), intent(inout) :: self
      type(static_system_t), intent(inout) :: system
      real(wp), intent(in) :: right(:), aim
      real(wp), intent(out) :: direction(:)
      real(wp), allocatable :: diagonal(:), by_gmres(:)
      integer :: patient, products
      logical :: solved, cg_may_solve
      call system%renew_diagonal()
      diagonal = system%diagonal
      if (.not. self%is_fitted) then
         if (self%elements%wanted) call self%elements%make(system)
         if (self%grids%wanted) call self%grids%begin(system)
         self%is_fitted = .true.
      end if
      if (self%grids%wanted) call self%grids%renew(system)
      system%presses = .true.
      self%solves = self%solves + 1
      if (.not. system%is_symmetric) self%gmres_leads = .true.
      patient = first_patience
      if (self%cg_solved > 0) patient = min(max_products, max(min_patience, &
                                                           int(patience*self%cg_iterations/self%cg_solved)))
      solved = .false.
      cg_may_solve = self%gmres_leads
      if (.not. self%gmres_leads) then
         call try_conjugate_gradients(patient)
         cg_may_solve = products >= patient .and. patient < max_products
         if (.not. (solved .or. self%stopped)) solved = falls(system, direction)
      end if
      if (self%stopped) return
      if (.not. solved) then
         call try(.false., max_gmres)
         self%gmres_leads = solved
      end if
      if (solved .or. self%stopped) return
      if (cg_may_solve) then
         by_gmres = direction
         call try_conjugate_gradients(max_products)
         if (.not. solved) direction = by_gmres
      end if
      if (.not. solved) self%unsolved = self%unsolved + 1
   contains
      !> If a body is unconstrained, the direction found by conjugate gradients depends on the preconditioner.
      !> The one with the diagonal is used: it follows the loads. This is so as long as no point is pressed:
      !> bodies fall until they meet a support.
      subroutine try_conjugate_gradients(most)
         integer, intent(in) :: most
         call try(.true., most)
         if (solved .or. .not. self%grids%wanted .or. system%asked > 0) return
         if (products >= most .and. any_presses(system)) return
         self%grids%diagonal_alone = .true.
         call try(.true., most)
         self%grids%diagonal_alone = .false.
      end subroutine try_conjugate_gradients

      subroutine try(symmetric, most)
         logical, intent(in) :: symmetric
         integer, intent(in) :: most
         if (self%grids%wanted) then
            call self%krylov%solve(system, diagonal, self%grids, right, direction, aim, symmetric, most, &
                                   products, solved)
         else
            call self%krylov%solve(system, diagonal, self%elements, right, direction, aim, symmetric, most, &
                                   products, solved)
         end if
         self%products = self%products + products
         self%stopped = self%krylov%stopped
         if (.not. (symmetric .and. solved) .or. products > patient) return ! a solution after many products
                                                                            ! is no reference
         self%cg_solved = self%cg_solved + 1
         self%cg_iterations = self%cg_iterations + products
      end subroutine try
   end subroutine solve_linear

   !> Collective: true when the direction of conjugate gradients without a solution is a motion of an
   !> unconstrained body along which the loads push: bodies fall until they meet a tool or each other. It is
   !> scaled to one cell.
   logical function falls(system, direction)
      type(static_system_t), intent(in) :: system
      real(wp), intent(inout) :: direction(:)
      real(wp) :: way, cell
      falls = .false.
      if (system%inertia%acts .or. any_presses(system)) return
      cell = system%model%levels(size(system%levels))%grid%cell
      way = system%model%communicator%maximum(maxval([0.0_wp, abs(direction)]))
      falls = way > unheld*cell
      if (falls) direction = cell/way*direction
   end function falls

   !> Collective: true when any point is pressed.
   logical function any_presses(system)
      type(static_system_t), intent(in) :: system
      associate (points => system%contact%list(:system%contact%count))
         any_presses = system%model%communicator%maximum(merge(1.0_wp, 0.0_wp, any(points%pressed))) > 0.5_wp
      end associate
   end function any_presses

   !> Collective: length along a direction, at most 1, that minimises the energy of the linear problem with
   !> fixed bounds of friction.
   real(wp) function way_to_least(system, force, direction, stiff, ahead, along, bound) result(length)
      type(static_system_t), intent(in) :: system
      real(wp), intent(in) :: force(:), direction(:), stiff(:), ahead(:, :), along(:, :), bound(:)
      real(wp) :: low, constant, linear
      integer :: halving
      constant = -system%dot(direction, force)
      linear = system%dot(direction, stiff)
      length = 1.0_wp
      if (slope(1.0_wp) <= 0.0_wp) return
      low = 0.0_wp
      do halving = 1, 30
         associate (middle => 0.5_wp*(low + length))
            if (slope(middle) > 0.0_wp) then
               length = middle
            else
               low = middle
            end if
         end associate
      end do
   contains
      real(wp) function slope(s)
         real(wp), intent(in) :: s
         real(wp) :: pressing, friction_force(3)
         integer :: n
         slope = 0.0_wp
         do n = 1, size(bound)
            associate (it => system%contact%list(n))
               call it%law(ahead(:, n) + s*along(:, n), bound(n), pressing, friction_force)
               slope = slope - dot_product(along(:, n), pressing*it%normal + friction_force)
            end associate
         end do
         slope = constant + s*linear + system%model%communicator%sum_real(slope)
      end function slope
   end function way_to_least

end module m_static_linear
