!> Newton's method for the equilibrium at the end of a quasi-static step. In each iteration the linear problem
!> with contact is solved by active sets and an exact line search (theory.md, eqs static-newton,
!> static-contact).
module m_equilibrium
   use mpi_f08
   use m_kinds, only: wp
   use m_text, only: to_text
   use m_krylov, only: krylov_t
   use m_static_system, only: static_system_t
   use m_trial_state, only: verdict_t
   implicit none
   private
   public :: equilibrium_t

   integer, parameter, public :: found = 0, no_convergence = 1, turned = 2, no_contact_set = 3, &
                                 too_far = 4

   !> How an equilibrium was looked for, and what became of it.
   type :: equilibrium_t
      type(static_system_t) :: system
      type(krylov_t) :: krylov
      real(wp), allocatable :: z(:)     !< displacements of the unknowns, m
      real(wp), allocatable :: left(:)  !< forces on them that nothing balances, N
      type(verdict_t) :: verdict        !< of the last trial, of this rank
      integer :: outcome = no_convergence
      integer :: newton = 0, solves = 0, products = 0 !< of this step
      integer :: unsolved = 0           !< linear problems of this step that were not
      character(len=:), allocatable :: log !< a line an iteration, where wanted
      logical :: wants_log = .false.
   contains
      procedure :: solve
      procedure, private :: improve
      procedure, private :: guess_contact
      procedure, private :: step_along
      procedure, private :: is_sound
      procedure, private :: worst_gap
      procedure, private :: say
   end type equilibrium_t

   integer, parameter :: most_iterations = 25, most_guesses = 20, most_halvings = 6
   integer, parameter :: most_unsolved = 3 !< linear problems of a step: then nothing holds the body
   integer, parameter :: patience = 8      !< iterations without a smaller residual
   real(wp), parameter :: rough = 1.0e-3_wp  !< linear problems are solved to this, of the forces left over
   real(wp), parameter :: closed = 1.0e-6_wp !< cells: what gaps may be off by
   real(wp), parameter :: longest = 0.5_wp   !< component of the gradient of a change in one iteration
   real(wp), parameter :: least_determinant = 0.05_wp, largest_gradient = 0.95_wp
   real(wp), parameter :: overshoot = 0.8_wp !< of the slope at the start, at the end of a Newton step

contains

   !> Collective: find the equilibrium of a system that has begun, from no displacement, and the points that
   !> press. Particles stay as they are.
   subroutine solve(self, tolerance)
      class(equilibrium_t), intent(inout) :: self
      real(wp), intent(in) :: tolerance
      real(wp), allocatable :: force(:), change(:), pressing(:)
      real(wp) :: residual, gap, cell, best
      integer :: best_at, n
      logical :: there
      associate (system => self%system, unknowns => self%system%unknowns%count)
         cell = system%model%levels(1)%grid%cell
         if (allocated(self%z)) deallocate (self%z, self%left)
         allocate (self%z(unknowns), self%left(unknowns), source=0.0_wp)
         allocate (force(unknowns), change(unknowns), pressing(system%contact%count))
         there = system%model%communicator%minimum(merge(1.0_wp, 0.0_wp, size(self%z) &
            == self%krylov%size())) > 0.5_wp
         call self%krylov%fit(system%model%communicator%comm%MPI_VAL, unknowns, there)
         self%newton = 0
         self%solves = 0
         self%products = 0
         self%unsolved = 0
         best = huge(best)
         best_at = 0
         self%log = ''
         self%outcome = no_convergence
         call system%evaluate(self%z, force, self%verdict)
         do
            pressing = system%contact%list(:system%contact%count)%force
            call system%contact_forces(pressing, self%left)
            self%left = self%left + force
            residual = sqrt(system%dot(self%left, self%left))
            gap = self%worst_gap()/cell
            if (self%wants_log) call self%say(residual, gap)
            if (.not. self%is_sound()) then
               self%outcome = turned
               return
            end if
            if (residual <= tolerance*system%scale .and. gap <= closed .and. self%newton > 0) then
               self%outcome = found
               return
            end if
            if (residual < 0.9_wp*best) then
               best = residual
               best_at = self%newton
            end if
            if (self%newton >= most_iterations .or. self%unsolved >= most_unsolved &
                .or. self%newton - best_at >= patience) return
            self%newton = self%newton + 1
            call system%linearise()
            call self%improve(force, change, there)
            if (.not. there) then
               self%outcome = no_contact_set
               return
            end if
            call self%step_along(change, force)
            do n = 1, system%contact%count
               if (system%contact%list(n)%force < 0.0_wp) system%contact%list(n)%force = 0.0_wp
            end do
         end do
      end associate
   end subroutine solve

   !> Collective: largest distance from what contact asks for: no gap beyond the yielding of pressed points,
   !> none below 0, m.
   real(wp) function worst_gap(self)
      class(equilibrium_t), intent(in) :: self
      integer :: n
      worst_gap = 0.0_wp
      do n = 1, self%system%contact%count
         associate (it => self%system%contact%list(n))
            if (it%force > 0.0_wp) then
               worst_gap = max(worst_gap, abs(it%gap + it%yielding*it%force))
            else
               worst_gap = max(worst_gap, -it%gap)
            end if
         end associate
      end do
      worst_gap = self%system%model%communicator%maximum(worst_gap)
   end function worst_gap

   !> Collective: no particle is turned inside out or nearly, and all stresses are numbers.
   logical function is_sound(self)
      class(equilibrium_t), intent(in) :: self
      logical :: sound
      sound = self%verdict%smallest > least_determinant .and. self%verdict%finite &
              .and. self%verdict%largest <= largest_gradient
      is_sound = self%system%model%communicator%minimum(merge(1.0_wp, 0.0_wp, sound)) > 0.5_wp
   end function is_sound

   !> Collective: the change of the displacements that solves the linear problem with contact: of the convex
   !> energy of the linearised step, whose points press where their gaps would close. Forces of the points
   !> become those of the linear problem.
   subroutine improve(self, force, change, there)
      class(equilibrium_t), intent(inout) :: self
      real(wp), intent(in) :: force(:) !< without contact, N
      real(wp), intent(out) :: change(:)
      logical, intent(out) :: there
      real(wp), dimension(size(change)) :: direction, right, stiff, moved
      real(wp), dimension(self%system%contact%count) :: ahead, along, pressing
      real(wp) :: aim, length
      integer :: guess, n
      logical :: same, symmetric, touches
      associate (system => self%system, list => self%system%contact%list, points => self%system%contact%count)
         touches = system%model%communicator%sum_real(real(points, wp)) > 0.5_wp
         change = 0.0_wp
         moved = 0.0_wp ! K change, without the stiffness of points
         ahead = 0.0_wp ! way of the points by the change, along their normals
         pressing = max(0.0_wp, -list(:points)%gap/list(:points)%yielding)
         call system%contact_forces(pressing, right)
         right = right + force
         aim = max(rough*sqrt(system%dot(right, right)), tiny(aim))
         if (system%dot(self%left, self%left) > 0.0_wp .and. .not. touches) &
            aim = max(rough*sqrt(system%dot(self%left, self%left)), tiny(aim))
         symmetric = .true.
         there = .true.
         do guess = 1, most_guesses
            do n = 1, points
               pressing(n) = 0.0_wp
               if (list(n)%pressed) pressing(n) = -(list(n)%gap + ahead(n))/list(n)%yielding
            end do
            call system%contact_forces(pressing, right)
            right = right + force - moved
            call solve_linear(self, right, direction, aim, symmetric)
            call system%set_motion(direction)
            do n = 1, points
               along(n) = dot_product(list(n)%normal, system%contact%way(n, system%model%levels(1)%nodes))
            end do
            same = .true.
            do n = 1, points
               same = same .and. (list(n)%pressed .eqv. list(n)%gap + ahead(n) + along(n) < 0.0_wp)
            end do
            same = system%model%communicator%minimum(merge(1.0_wp, 0.0_wp, same)) > 0.5_wp
            if (self%unsolved >= most_unsolved) exit
            if (same) then
               change = change + direction
               ahead = ahead + along
               exit
            end if
            system%presses = .false.
            call system%multiply(direction, stiff)
            self%products = self%products + 1
            call self%guess_contact(force - moved, direction, stiff, ahead, along, length)
            change = change + length*direction
            moved = moved + length*stiff
            ahead = ahead + length*along
            list(:points)%pressed = list(:points)%gap + ahead < 0.0_wp
         end do
         there = same .or. self%unsolved >= most_unsolved ! the caller sees these
         do n = 1, points
            list(n)%force = max(0.0_wp, -(list(n)%gap + ahead(n))/list(n)%yielding)
         end do
      end associate
   end subroutine improve

   !> Collective: K direction = right to `aim`, with pressed points; another method where conjugate gradients
   !> meet a direction of negative stiffness, or go on too long.
   subroutine solve_linear(self, right, direction, aim, symmetric)
      type(equilibrium_t), intent(inout) :: self
      real(wp), intent(in) :: right(:), aim
      real(wp), intent(out) :: direction(:)
      logical, intent(inout) :: symmetric
      real(wp), allocatable :: diagonal(:)
      integer :: products
      logical :: solved
      diagonal = self%system%diagonal
      self%system%presses = .true.
      call self%krylov%solve(self%system, diagonal, right, direction, aim, symmetric, products, solved)
      self%products = self%products + products
      self%solves = self%solves + 1
      if (solved .or. .not. symmetric) return
      symmetric = .false.
      call self%krylov%solve(self%system, diagonal, right, direction, aim, symmetric, products, solved)
      self%products = self%products + products
      if (.not. solved) self%unsolved = self%unsolved + 1
   end subroutine solve_linear

   !> Collective: how far to go along a direction, at most all of it: to where the energy of the linear
   !> problem is least.
   subroutine guess_contact(self, force, direction, stiff, ahead, along, length)
      class(equilibrium_t), intent(in) :: self
      real(wp), intent(in) :: force(:), direction(:), stiff(:), ahead(:), along(:)
      real(wp), intent(out) :: length
      real(wp) :: low, constant, linear
      integer :: halving
      constant = -self%system%dot(direction, force)
      linear = self%system%dot(direction, stiff)
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
         integer :: n
         slope = 0.0_wp
         do n = 1, size(along)
            associate (it => self%system%contact%list(n))
               slope = slope - along(n)*max(0.0_wp, -(it%gap + ahead(n) + s*along(n))/it%yielding)
            end associate
         end do
         slope = constant + s*linear + self%system%model%communicator%sum_real(slope)
      end function slope
   end subroutine guess_contact

   !> Collective: go along a change: not so far that a gradient grows too much, nor beyond where the energy of
   !> the step is least, where a full step overshoots. `force` becomes that of the new displacements.
   subroutine step_along(self, change, force)
      class(equilibrium_t), intent(inout) :: self
      real(wp), intent(in) :: change(:)
      real(wp), intent(inout) :: force(:)
      real(wp), allocatable :: from(:), at_points(:), all_forces(:), predicted(:)
      real(wp) :: length, slope_before, slope_here, low, slope_low
      integer :: n, try
      associate (system => self%system, list => self%system%contact%list, points => self%system%contact%count)
         allocate (all_forces(size(change)))
         from = self%z
         predicted = list(:points)%force
         slope_before = slope_of(force)
         length = min(1.0_wp, longest/max(self%system%steepest(change), tiny(1.0_wp)))
         low = 0.0_wp
         slope_low = slope_before
         do try = 1, most_halvings
            self%z = from + length*change
            call system%evaluate(self%z, force, self%verdict)
            if (.not. self%is_sound()) then
               length = 0.5_wp*(low + length)
               cycle
            end if
            slope_here = slope_of(force)
            if (.not. slope_here < -overshoot*abs(slope_before)) exit
            ! the slope, force times change, has fallen through 0: back to where it is 0 on the secant
            length = low + (length - low)*max(0.1_wp, slope_low/(slope_low - slope_here))
         end do
         if (length < 1.0_wp) then ! forces of the points as the gaps have it
            at_points = max(0.0_wp, -list(:points)%gap/list(:points)%yielding)
            list(:points)%force = at_points
         else
            list(:points)%force = predicted
         end if
         do n = 1, points
            list(n)%pressed = list(n)%force > 0.0_wp
         end do
      end associate
   contains
      !> Force along the change, with points that press as their gaps have it, J.
      real(wp) function slope_of(force)
         real(wp), intent(in) :: force(:)
         associate (list => self%system%contact%list(:self%system%contact%count))
            call self%system%contact_forces(max(0.0_wp, -list%gap/list%yielding), all_forces)
         end associate
         slope_of = self%system%dot(force + all_forces, change)
      end function slope_of
   end subroutine step_along

   !> A line about an iteration.
   subroutine say(self, residual, gap)
      class(equilibrium_t), intent(inout) :: self
      real(wp), intent(in) :: residual, gap !< N; cells
      self%log = self%log//'newton     '//to_text(self%newton)//': residual '// &
                 to_text(residual/max(self%system%scale, tiny(1.0_wp)), 3)//', gaps off by '//to_text(gap, 3)// &
                 ' cells, '//to_text(self%solves)//' solves, '//to_text(self%products)//' products'//new_line('a')
   end subroutine say

end module m_equilibrium
