!> Newton's method for the equilibrium at the end of a quasi-static step. In each iteration the linear problem
!> with contact is solved by active sets and an exact line search (theory.md, eqs static-newton,
!> static-contact).
module m_equilibrium
   use mpi_f08
   use m_kinds, only: wp
   use m_text, only: to_text
   use m_node_values, only: node_values, tile_last
   use m_static_system, only: static_system_t
   use m_static_linear, only: static_linear_t, max_unsolved, max_unsettled
   use m_static_ways, only: steepest
   use m_static_subcell, only: renew_deflections
   use m_trial_state, only: trial_status_t
   implicit none
   private
   public :: equilibrium_t

   integer, parameter, public :: found = 0, no_convergence = 1, turned = 2, too_far = 3, too_long = 4, &
                                 called_off = 5, not_held = 6

   !> The search for an equilibrium, and its result.
   type :: equilibrium_t
      type(static_system_t) :: system
      type(static_linear_t) :: linear
      real(wp), allocatable :: z(:)     !< displacements of the unknowns, m
      real(wp), allocatable :: left(:)  !< residual forces on them, N
      type(trial_status_t) :: trial_status        !< of the last trial, of this rank
      integer :: outcome = no_convergence
      logical :: too_long = .false.     !< a law requests a smaller step, in the last trial on any rank
      integer :: newton = 0             !< iterations of this step
      character(len=:), allocatable :: log !< a line per iteration, if wanted
      logical :: wants_log = .false.
   contains
      procedure :: solve
      procedure, private :: prepare
      procedure, private :: settle
      procedure, private :: step_along
      procedure, private :: is_sound
      procedure, private :: worst_gap
      procedure, private :: say
   end type equilibrium_t

   integer, parameter :: iteration_limit = 25, max_halvings = 6
   integer, parameter :: patience = 8      !< iterations without a smaller residual
   real(wp), parameter :: rough = 1.0e-3_wp, roughest = 1.0e-2_wp !< linear problems are solved to this,
                                                                  !< relative to
                                                                 !< the residual forces,
   real(wp), parameter :: of_first = 1.0e-5_wp !< the first problem of a step, which determines the contact
                                               !< status: coarse grids are not symmetric, and a ridge would
                                               !< slip off a symmetric body
   real(wp), parameter :: enough = 0.03_wp !< but not beyond this share of the tolerance
   real(wp), parameter :: closed = 1.0e-6_wp !< cells: tolerance of gaps
   real(wp), parameter :: max_lag = 100.0_wp !< multiple of the tolerance, relative to the largest deflection
                                             !< below the cells: tolerance of their change
   real(wp), parameter :: longest = 0.5_wp   !< limit of a gradient component of the change in one iteration
   real(wp), parameter :: min_determinant = 0.05_wp, largest_gradient = 0.95_wp
   real(wp), parameter :: overshoot = 0.4_wp !< relative to the initial slope, at the end of a Newton step

contains

   !> Collective: find the equilibrium and the contact status of a system after `begin`, from its guess.
   !> Particles are not changed.
   subroutine solve(self, tolerance)
      class(equilibrium_t), intent(inout) :: self
      real(wp), intent(in) :: tolerance
      real(wp), allocatable :: force(:), change(:), friction_force(:, :), pressing(:)
      real(wp) :: residual, before, share, gap, cell, best
      integer :: best_at, n
      associate (system => self%system, unknowns => self%system%size())
         cell = system%model%levels(size(system%levels))%grid%cell
         allocate (force(unknowns), change(unknowns), pressing(system%contact%count), &
                   friction_force(3, system%contact%count))
         call self%prepare()
         best = huge(best)
         best_at = 0
         residual = huge(residual)
         call system%evaluate(self%z, force, self%trial_status)
         if (.not. self%is_sound()) then
            self%z = 0.0_wp
            call system%evaluate(self%z, force, self%trial_status)
         end if
         do
            call renew_deflections(system%contact, system%model, self%newton <= 1)
            do n = 1, system%contact%count
               pressing(n) = system%contact%list(n)%force
               friction_force(:, n) = system%contact%list(n)%friction_force
            end do
            call system%contact_forces(pressing, friction_force, self%left)
            self%left = self%left + force
            before = residual
            residual = sqrt(system%dot(self%left, self%left))
            gap = self%worst_gap()/cell
            if (self%wants_log) call self%say(residual, gap)
            if (.not. self%is_sound()) then
               self%outcome = merge(too_long, turned, self%too_long)
               return
            end if
            if (gap <= closed .and. self%newton > 0 .and. system%contact%lag <= max_lag*tolerance .and. &
                residual <= tolerance*system%scale) call self%settle()
            if (self%outcome == found) return
            if (residual < 0.9_wp*best .and. self%newton > 0) then ! initially the stress may be zero
               best = residual
               best_at = self%newton
            end if
            if (self%newton >= iteration_limit .or. self%linear%unsolved >= max_unsolved &
                .or. self%linear%unsettled >= max_unsettled .or. self%newton - best_at >= patience) return
            self%newton = self%newton + 1
            share = of_first
            if (self%newton > 1) share = roughest ! less accuracy is enough where the law is nonlinear
                                                  ! (Eisenstat and Walker)
            if (self%newton > 1 .and. residual < before) &
               share = max(rough, min(roughest, 0.9_wp*(residual/before)**2))
            call system%linearise(with_loads=system%model%step > 0)
            call self%linear%improve(system, force, self%left, share, enough*tolerance*system%scale, change)
            if (self%linear%stopped .or. system%is_called_off()) then
               self%outcome = merge(called_off, not_held, system%asked > 0)
               return
            end if
            call self%step_along(change, force)
         end do
      end associate
   end subroutine solve

   !> Collective: the equilibrium is found. Work of the effects is that of the forces which have followed.
   subroutine settle(self)
      class(equilibrium_t), intent(inout) :: self
      real(wp) :: changes(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      integer :: b, l
      self%outcome = found
      associate (model => self%system%model, inertia => self%system%inertia)
         do l = 1, size(model%levels)
            do b = 1, size(model%levels(l)%blocks)
               if (.not. model%effect_step(l)%is_loaded(b)) cycle
               changes = 0.0_wp
               associate (mine => self%system%levels(l), particles => model%levels(l)%blocks(b)%particles)
                  call mine%followers(b)%add_changes(model%effects, particles%column, &
                                                     mine%trial(b)%gradient, changes)
               end associate
               call model%effect_step(l)%add_nodal_force(b, merge(inertia%share, 0.5_wp, inertia%acts), &
                                                         changes)
            end do
         end do
      end associate
   end subroutine settle

   !> Collective: allocate the unknowns, which start from the guess, and reset the counters.
   subroutine prepare(self)
      class(equilibrium_t), intent(inout) :: self
      logical :: there
      associate (system => self%system, unknowns => self%system%size())
         if (allocated(self%z)) deallocate (self%z, self%left)
         allocate (self%z(unknowns), self%left(unknowns), source=0.0_wp)
         there = system%model%communicator%minimum(merge(1.0_wp, 0.0_wp, size(self%z) &
            == self%linear%krylov%size())) > 0.5_wp
         call self%linear%krylov%fit(system%model%communicator%comm%MPI_VAL, unknowns, there, &
                                     self%linear%elements%wanted .or. self%linear%grids%wanted)
         call self%linear%begin()
         self%newton = 0
         self%log = ''
         self%outcome = no_convergence
         self%z = system%guess
      end associate
   end subroutine prepare

   !> Collective: largest violation of the contact conditions: gaps beyond the compliance of pressed points,
   !> negative gaps, slip beyond the elastic slip of friction, m.
   real(wp) function worst_gap(self)
      class(equilibrium_t), intent(in) :: self
      integer :: n
      worst_gap = 0.0_wp
      do n = 1, self%system%contact%count
         worst_gap = max(worst_gap, self%system%contact%misfit(n))
      end do
      worst_gap = self%system%model%communicator%maximum(worst_gap)
   end function worst_gap

   !> Collective: true when no particle is inverted or nearly so, all stresses are finite, and no law requests
   !> a smaller step.
   logical function is_sound(self)
      class(equilibrium_t), intent(inout) :: self
      real(wp) :: worst
      logical :: sound
      sound = self%trial_status%smallest > min_determinant .and. self%trial_status%finite &
              .and. self%trial_status%largest <= largest_gradient
      worst = merge(1.0_wp, 0.0_wp, sound)
      if (self%trial_status%too_long) worst = -1.0_wp
      worst = self%system%model%communicator%minimum(worst)
      is_sound = worst > 0.5_wp
      self%too_long = worst < -0.5_wp
   end function is_sound

   !> Collective: move along a change, limited so that gradients do not grow too much, and, if a full step
   !> overshoots, to the minimum of the step's energy. `force` becomes that of the new displacements.
   subroutine step_along(self, change, force)
      class(equilibrium_t), intent(inout) :: self
      real(wp), intent(in) :: change(:)
      real(wp), intent(inout) :: force(:)
      real(wp), allocatable :: from(:), all_forces(:), pressing(:), friction_force(:, :)
      real(wp) :: length, slope_before, slope_here, low, slope_low
      integer :: n, try
      associate (system => self%system, points => self%system%contact%count)
         allocate (all_forces(size(change)), pressing(points), friction_force(3, points))
         from = self%z
         slope_before = slope_of(force)
         call system%set_motion(change)
         length = min(1.0_wp, longest/max(steepest(system%model, system%work), tiny(1.0_wp)))
         low = 0.0_wp
         slope_low = slope_before
         do try = 1, max_halvings
            self%z = from + length*change
            call system%evaluate(self%z, force, self%trial_status)
            if (.not. self%is_sound()) then
               if (self%too_long) exit
               length = 0.5_wp*(low + length)
               cycle
            end if
            slope_here = slope_of(force)
            if (.not. slope_here < -overshoot*abs(slope_before)) exit
            ! the slope, force times change, has become negative: go back to its zero on the secant
            length = low + (length - low)*max(0.1_wp, slope_low/(slope_low - slope_here))
         end do
         do n = 1, points ! forces of the points by their gaps, where they differ from those of the change
            associate (it => system%contact%list(n))
               if (length < 1.0_wp) it%force = pressing(n)
               if (length < 1.0_wp) it%friction_force = friction_force(:, n)
               it%pressed = it%force > 0.0_wp
            end associate
         end do
      end associate
   contains
      !> Force along the change, with points pressed by their gaps, J.
      real(wp) function slope_of(force)
         real(wp), intent(in) :: force(:)
         real(wp) :: none(3)
         integer :: n
         do n = 1, size(pressing)
            associate (contact => self%system%contact, it => self%system%contact%list(n))
               call it%law([0.0_wp, 0.0_wp, 0.0_wp], 0.0_wp, pressing(n), none)
               call it%law([0.0_wp, 0.0_wp, 0.0_wp], contact%limit(n, pressing(n)), pressing(n), &
                                friction_force(:, n))
            end associate
         end do
         call self%system%contact_forces(pressing, friction_force, all_forces)
         slope_of = self%system%dot(force + all_forces, change)
      end function slope_of
   end subroutine step_along

   !> Append a line about an iteration to the log.
   subroutine say(self, residual, gap)
      class(equilibrium_t), intent(inout) :: self
      real(wp), intent(in) :: residual, gap !< N; cells
      real(wp) :: share
      share = merge(1.0_wp, 0.0_wp, residual > 0.0_wp) ! zero stress at first
      if (self%system%scale > 0.0_wp) share = residual/self%system%scale
      self%log = self%log//'newton     '//to_text(self%newton)//': residual '//to_text(share, 3)// &
                 ', gaps off by '//to_text(gap, 3)//' cells, '//to_text(self%linear%solves)//' solves, '// &
                 to_text(self%linear%products)//' products'//new_line('a')
   end subroutine say

end module m_equilibrium
