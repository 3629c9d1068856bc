!> The forces of a quasi-static step under a trial displacement, and the consistent stiffness, by P2G, G2P and
!> sums over blocks and ranks of the explicit step (theory.md, eqs static-residual, static-tangent).
module m_static_system
   use mpi_f08
   use m_kinds, only: wp
   use m_timers
   use m_node_values, only: a_x, f_x
   use m_boundary, only: motion_parity
   use m_migration, only: frame_of
   use m_static_transfer, only: p2g_diagonal
   use m_krylov, only: krylov_operator_t
   use m_static_contact, only: static_contact_t
   use m_model, only: model_t
   use m_static_tiles, only: put_loads, put_accelerations, read_motion, stiffest
   use m_static_inertia, only: static_inertia_t
   use m_static_levels, only: static_level_t, fit_levels, number_levels, spread, collect, gather_all, &
                              find_ghost, find_followers
   use m_static_means, only: take_trial_gradients, push_nodes, multiply_tangents
   use m_static_ways, only: rigid_motion_t, motion_of_body, may_hold
   use m_called_off, only: called_off_t
   use m_trial_state, only: trial_status_t, sum_of_squares, squares_of_section
   implicit none
   private
   public :: static_system_t

   !> The levels' `nodes` hold the last displacements, in place of velocities. Tools act on nodes of the
   !> finest level.
   type, extends(krylov_operator_t) :: static_system_t
      type(model_t), pointer :: model => null()
      type(static_level_t), allocatable :: levels(:)
      type(static_contact_t) :: contact
      type(static_inertia_t) :: inertia
      real(wp), allocatable :: load(:)               !< (unknowns): of effects at the step's end, N
      real(wp), allocatable :: load_before(:)        !< likewise at its beginning, in equilibrium
      real(wp), allocatable :: diagonal(:)           !< (unknowns): of the stiffness, N/m
      real(wp), allocatable :: bare(:)               !< the same without pressed points
      real(wp), allocatable :: guess(:)              !< (unknowns): start of Newton's method, m
      logical :: is_time_dependent = .false.                   !< the guess continues the last step instead of
                                                               !< rest
      integer :: nodal = 0 !< unknowns of nodes, on this rank
      integer :: extra = 0 !< further unknowns: displacements of load-driven freedoms, on the first rank
      real(wp), allocatable :: work(:, :)            !< (particles of the largest block, 27)
      real(wp) :: time_step = 0.0_wp                 !< s
      integer :: parts = 1                           !< as of trial_block_t
      real(wp) :: ramp = 0.0_wp                      !< ramp time of loads from time 0, s
      real(wp) :: scale = 0.0_wp !< size of the forces in equilibrium, N
      logical :: presses = .false.                   !< products include pressed points
      logical :: is_symmetric = .true.               !< nearly, in spite of loads that follow surfaces
      type(called_off_t) :: called_off
      integer :: asked = 0                           !< the request that has called it off
      type(rigid_motion_t) :: unheld                 !< unconstrained motion in this step
      integer :: product_row = 0, residual_row = 0   !< of the timers
   contains
      procedure :: begin
      procedure :: hold_loads
      procedure :: set_motion
      procedure :: evaluate
      procedure :: linearise
      procedure :: multiply
      procedure :: contact_forces
      procedure :: renew_diagonal
      procedure :: ways_of
      procedure :: size => size_of
      procedure, private :: resist
      procedure, private :: give_ways
      procedure, private :: total
      procedure :: dot
      procedure :: is_to_stop
      procedure :: is_called_off
      procedure :: clear_forces
   end type static_system_t

   real(wp), parameter :: soft = 0.005_wp !< relative to a modulus on the face of a cell: a smaller stiffness
                                          !< of loads leaves conjugate gradients as they are
   real(wp), parameter :: no_force = 1.0e-6_wp !< relative to a modulus on the face of a cell: smaller loads
                                               !< count as zero
   real(wp), parameter :: loose = 1.0e-10_wp !< relative to a stiffness: smaller ones count as zero
   real(wp), parameter :: no_hold = 1.0e-12_wp !< of the diagonal's stiffness: a direction without support
   real(wp), parameter :: even(8, 3) = 1.0_wp !< parity of a diagonal under reflection

contains

   !> Collective: set up the unknowns and the constant data of a step: loads at its end, ghost penalty.
   !> Contact is found by the caller.
   subroutine begin(self, model, time, time_step, stabilisation)
      class(static_system_t), intent(inout) :: self
      type(model_t), intent(inout), target :: model
      real(wp), intent(in) :: time, time_step, stabilisation
      integer :: l, largest
      self%model => model
      self%time_step = time_step
      self%unheld = rigid_motion_t()
      self%product_row = model%timers%row_of('static products')
      self%residual_row = model%timers%row_of('static forces')
      call fit_levels(self%levels, model, self%parts, largest)
      do l = 1, size(self%levels)
         self%levels(l)%trial%mean = self%inertia%acts .and. .not. abs(self%inertia%share - 0.5_wp) > 0.0_wp
      end do
      if (allocated(self%work)) then
         if (size(self%work, 1) < largest) deallocate (self%work)
      end if
      if (.not. allocated(self%work)) allocate (self%work(largest, 27))
      call model%timers%enter(self%residual_row)
      call find_ghost(self%levels, model, stabilisation, time_step)
      if (any(model%effect_step%adds_forces) .or. time < self%ramp .or. self%inertia%acts) then
         call self%hold_loads(time, number=.true., stress=self%inertia%acts)
         self%load_before = self%load
         if (self%inertia%acts) call self%inertia%begin(self%levels, model, time_step, &
                                                        self%guess/time_step, self%load)
         do l = 1, size(model%effect_step)
            call model%effect_step(l)%keep_nodal_force()
         end do
         call self%hold_loads(time + time_step, number=.true., stress=.false.)
         do l = 1, size(model%effect_step)
            call model%effect_step(l)%mean_nodal_force(merge(self%inertia%share, 0.5_wp, self%inertia%acts))
         end do
      else
         call self%hold_loads(time + time_step, number=.true., stress=.false.)
         self%load_before = self%load
      end if
      if (model%step == 0) self%load_before = 0.0_wp ! the full load is applied at once
      associate (tools => self%contact%tools)
         if (self%extra > 0) self%load(self%nodal + 1:) = &
            merge(0.0_wp, tools%load, tools%away(tools%tool))
      end associate
      call find_followers(self%levels, model, time + time_step, ramp_share(time + time_step, self%ramp))
   end subroutine begin

   !> Collective: forces of effects on the nodes at a time.
   subroutine hold_loads(self, time, number, stress)
      class(static_system_t), intent(inout) :: self
      real(wp), intent(in) :: time
      logical, intent(in) :: number !< number the unknowns, and store the loads
      logical, intent(in) :: stress !< include those of the particles' stress
      real(wp), allocatable :: more(:)
      integer :: l
      if (.not. allocated(self%load)) allocate (self%load(0))
      associate (model => self%model)
         call put_loads(model, time, stress)
         if (number) then
            self%nodal = number_levels(self%levels, model)
            self%extra = 0
            if (model%communicator%is_root()) self%extra = self%contact%tools%count
            call fit(self%load)
            call fit(self%diagonal)
            call fit(self%bare)
            call fit(self%guess)
            call gather_all(self%levels, model, f_x, self%load)
            do l = 1, size(self%levels)
               associate (mine => self%levels(l))
                  if (self%is_time_dependent) &
                     call read_motion(mine%unknowns, model%levels(l), self%time_step, &
                                     self%guess(mine%first():mine%last()))
               end associate
            end do
            if (self%is_time_dependent .and. self%extra > 0) &
               self%guess(self%nodal + 1:) = self%contact%tools%ways_before()
         end if
         if (size(model%effect_step(1)%on_nodes) > 0) then
            call put_accelerations(model, time)
            call fit(more)
            call gather_all(self%levels, model, a_x, more)
            if (number) self%load = self%load + more
         end if
         if (.not. time < self%ramp) return
         do l = 1, size(model%effect_step)
            call model%effect_step(l)%scale_nodal_force(ramp_share(time, self%ramp))
         end do
         self%load = ramp_share(time, self%ramp)*self%load ! for tools m_static_tools applies the ramp
      end associate
   contains
      subroutine fit(values)
         real(wp), allocatable, intent(inout) :: values(:)
         if (allocated(values)) deallocate (values)
         allocate (values(self%size()), source=0.0_wp)
      end subroutine fit
   end subroutine hold_loads

   !> Share of the loads that acts at a time.
   pure real(wp) function ramp_share(time, ramp) result(share)
      real(wp), intent(in) :: time, ramp !< s
      share = 1.0_wp
      if (time < ramp) share = max(0.0_wp, time/ramp)
   end function ramp_share

   !> Collective: set the displacements of all nodes from the unknowns, fixed, mirrored and constrained ones
   !> included.
   subroutine set_motion(self, z)
      class(static_system_t), intent(inout) :: self
      real(wp), intent(in) :: z(:) !< m
      call spread(self%levels, self%model, z)
      call self%contact%pairs%read_motion(self%model%levels(size(self%levels))%nodes)
   end subroutine set_motion

   !> Collective: the forces on the unknowns under displacements, without contact, N; gaps of the points; the
   !> size of the forces.
   subroutine evaluate(self, z, force, status)
      class(static_system_t), intent(inout) :: self
      real(wp), intent(in) :: z(:)
      real(wp), intent(out) :: force(:)
      type(trial_status_t), intent(out) :: status !< of this rank
      integer :: b, l
      real(wp) :: squares
      call self%model%timers%enter(self%residual_row)
      call self%set_motion(z)
      if (self%contact%tools%count > 0) call self%contact%tools%place(self%ways_of(z))
      call self%clear_forces()
      squares = 0.0_wp
      do l = 1, size(self%levels)
         associate (model => self%model, level => self%model%levels(l), forces => self%levels(l)%forces)
            call take_trial_gradients(self%levels(l), self%model, l)
            do b = 1, size(level%blocks)
               associate (block => level%blocks(b), trial => self%levels(l)%trial(b), &
                          n => level%blocks(b)%particles%count)
                  if (n == 0) cycle
                  call trial%update(block%particles, model%materials, level%layout, self%time_step, status, b)
                  if (status%level == 0) status%level = l
                  trial%acting(:n, :) = trial%force(:n, :)
                  if (level%grid%section%is_flat()) then
                     squares = squares + squares_of_section(trial%force(:n, :), level, b)
                  else
                     squares = squares + level%grid%cell*sum_of_squares(trial%force(:n, :), &
                                                             block%particles%column(:n, level%layout%volume))
                  end if
                  call self%levels(l)%followers(b)%add_changes(model%effects, block%particles%column, &
                                                               trial%gradient, forces(:, :, :, :, b))
               end associate
            end do
            call push_nodes(self%levels(l), self%model, l)
            call self%levels(l)%ghost%add_forces(level%nodes, -1.0_wp, forces)
         end associate
      end do
      associate (model => self%model, finest => self%model%levels(size(self%levels)))
         call self%contact%move(finest%nodes)
         call collect(self%levels, model, motion_parity, force)
         if (self%extra > 0) force(self%nodal + 1:) = 0.0_wp
         force = force + self%load
         if (self%inertia%acts) force = force + self%inertia%steady - self%inertia%stiffness*z
         self%scale = max(2.0_wp*sqrt(model%communicator%sum_real(squares)), &
                          no_force*stiffest(model)*finest%grid%cell**2)
      end associate
   end subroutine evaluate

   !> Collective: tangents and diagonal at the last evaluated displacements. Without the stiffness of loads K
   !> is symmetric, and conjugate gradients find out whether bodies are held: in the first step of a run.
   subroutine linearise(self, with_loads)
      class(static_system_t), intent(inout) :: self
      logical, intent(in) :: with_loads
      real(wp) :: most !< of the loads' stiffness, relative to that of a cell
      integer :: b, l
      call self%model%timers%enter(self%residual_row)
      call self%clear_forces()
      most = 0.0_wp
      do l = 1, size(self%levels)
         associate (model => self%model, level => self%model%levels(l), forces => self%levels(l)%forces)
            do b = 1, size(level%blocks)
               associate (block => level%blocks(b), trial => self%levels(l)%trial(b), &
                          n => level%blocks(b)%particles%count)
                  if (n == 0) cycle
                  call trial%linearise(block%particles, model%materials, level%layout, self%time_step)
                  call trial%diagonal(n, self%work)
                  if (with_loads) call self%levels(l)%followers(b)%linearise( &
                     model%effects, block%particles%column, trial%gradient)
                  most = max(most, self%levels(l)%followers(b)%stiffness()/level%grid%cell**2)
                  call p2g_diagonal(block%cells, block%particles%column, level%layout, &
                                    frame_of(level, block), self%work, forces(:, :, :, :, b))
               end associate
            end do
            call self%levels(l)%ghost%add_diagonal(forces)
         end associate
      end do
      call self%contact%curve(self%model%levels(size(self%levels))%grid%cell)
      call collect(self%levels, self%model, even, self%bare, diagonal=.true.)
      if (self%extra > 0) self%bare(self%nodal + 1:) = 0.0_wp
      if (self%inertia%acts) self%bare = self%bare + self%inertia%stiffness
      self%is_symmetric = self%model%communicator%maximum(most) <= soft*stiffest(self%model)
   end subroutine linearise

   !> Collective: the diagonal with the points pressed at present.
   subroutine renew_diagonal(self)
      class(static_system_t), intent(inout) :: self
      real(wp), dimension(self%contact%tools%count) :: sums, most
      integer :: k
      call self%clear_forces()
      call self%contact%add_diagonal(self%levels(size(self%levels))%forces, 2)
      call self%contact%pairs%give(self%levels(size(self%levels))%forces)
      call collect(self%levels, self%model, even, self%diagonal, diagonal=.true.)
      call self%contact%stiffness_of_ways(sums, most)
      call self%give_ways(sums, self%diagonal)
      self%diagonal = self%diagonal + self%bare
      most = self%total(most)
      do k = 1, self%extra ! components supported only by round-off are fixed
         associate (own => self%diagonal(self%nodal + k))
            if (own <= loose*most(k)) own = most(k)
         end associate
      end do
      where (.not. self%diagonal > 0.0_wp) self%diagonal = 1.0_wp
   end subroutine renew_diagonal

   !> Unknowns of this rank.
   pure integer function size_of(self)
      class(static_system_t), intent(in) :: self
      size_of = self%nodal + self%extra
   end function size_of

   !> Collective: the values of load-driven freedoms among those of the unknowns.
   function ways_of(self, values) result(ways)
      class(static_system_t), intent(in) :: self
      real(wp), intent(in) :: values(:)
      real(wp) :: ways(self%contact%tools%count)
      if (size(ways) == 0) return
      ways = 0.0_wp
      if (self%extra > 0) ways = values(self%nodal + 1:)
      call MPI_Bcast(ways, size(ways), MPI_DOUBLE_PRECISION, 0, self%model%communicator%comm)
   end function ways_of

   !> Collective: store sums over all ranks at the load-driven freedoms.
   subroutine give_ways(self, sums, values)
      class(static_system_t), intent(in) :: self
      real(wp), intent(in) :: sums(:)
      real(wp), intent(inout) :: values(:)
      real(wp) :: all_sums(size(sums))
      if (size(sums) == 0) return
      all_sums = self%total(sums)
      if (self%extra > 0) values(self%nodal + 1:) = all_sums
   end subroutine give_ways

   !> Collective: sums over the ranks.
   function total(self, sums)
      class(static_system_t), intent(in) :: self
      real(wp), intent(in) :: sums(:)
      real(wp) :: total(size(sums))
      total = sums
      if (size(sums) > 0) call MPI_Allreduce(MPI_IN_PLACE, total, size(total), MPI_DOUBLE_PRECISION, &
                                             MPI_SUM, self%model%communicator%comm)
   end function total

   !> Collective: to = K from, with the stiffness of pressed points if `presses`; the nodes hold `from`
   !> afterwards.
   subroutine multiply(self, from, to)
      class(static_system_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: from(:)
      real(wp), intent(out), contiguous :: to(:)
      real(wp) :: sums(self%contact%tools%count)
      integer :: l
      call self%model%timers%enter(self%product_row)
      call self%set_motion(from)
      call self%clear_forces()
      do l = 1, size(self%levels)
         associate (level => self%model%levels(l), forces => self%levels(l)%forces)
            call multiply_tangents(self%levels(l), self%model, l)
            call self%levels(l)%ghost%add_forces(level%nodes, 1.0_wp, forces)
         end associate
      end do
      call self%resist(from, sums)
      call collect(self%levels, self%model, motion_parity, to)
      call self%give_ways(sums, to)
      if (self%inertia%acts) to = to + self%inertia%stiffness*from
   end subroutine multiply

   !> Collective: add the points' part of a product to the forces, and to the generalised loads of tools.
   subroutine resist(self, from, sums)
      class(static_system_t), intent(inout) :: self
      real(wp), intent(in) :: from(:)
      real(wp), intent(out) :: sums(:)
      real(wp) :: u(3), f(3), g(3), ways(size(sums))
      integer :: n
      ways = self%ways_of(from)
      sums = 0.0_wp
      associate (finest => self%model%levels(size(self%levels)), tools => self%contact%tools)
         do n = 1, self%contact%count
            associate (it => self%contact%list(n))
               if (.not. ((self%presses .and. it%pressed) .or. it%force > 0.0_wp)) cycle
               u = self%contact%way(n, finest%nodes)
               f = 0.0_wp
               g = 0.0_wp
               if (it%force > 0.0_wp) &
                  f = -it%force*matmul(it%turning, u - tools%slides_at(it%point%tool, ways))
               if (self%presses .and. it%pressed) &
                  g = it%resist(u - tools%way_at(it%point%tool, it%place, ways))
               call tools%push(it%point%tool, it%place, -f, sums, slides_only=.true.)
               call tools%push(it%point%tool, it%place, -g, sums)
               f = f + g
               call self%contact%add_force_at(n, f, self%levels(size(self%levels))%forces)
            end associate
         end do
      end associate
      call self%contact%pairs%give(self%levels(size(self%levels))%forces)
   end subroutine resist

   !> Collective: forces of the points on the unknowns, N.
   subroutine contact_forces(self, pressing, friction_force, force)
      class(static_system_t), intent(inout) :: self
      real(wp), intent(in) :: pressing(:) !< (points): along their normals, N
      real(wp), intent(in) :: friction_force(:, :)   !< (3, points): friction on the body, N
      real(wp), intent(out) :: force(:)
      real(wp) :: vector(3), sums(self%contact%tools%count)
      integer :: n
      call self%clear_forces()
      sums = 0.0_wp
      do n = 1, self%contact%count
         associate (it => self%contact%list(n))
            vector = pressing(n)*it%normal + friction_force(:, n)
            if (.not. any(abs(vector) > 0.0_wp)) cycle
            call self%contact%add_force_at(n, vector, self%levels(size(self%levels))%forces)
            call self%contact%tools%push(it%point%tool, it%place, -vector, sums)
         end associate
      end do
      call self%contact%pairs%give(self%levels(size(self%levels))%forces)
      call collect(self%levels, self%model, motion_parity, force)
      call self%give_ways(sums, force)
   end subroutine contact_forces

   !> Collective: whether to stop a linear solve: the run ends, or the residual pushes a body along an
   !> unconstrained direction. The nodes hold `from`.
   logical function is_to_stop(self, from, to, diagonal, descent)
      class(static_system_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: from(:), to(:), diagonal(:)
      logical, intent(in) :: descent
      is_to_stop = self%is_called_off()
      if (is_to_stop .or. .not. descent .or. self%inertia%acts) return
      if (self%dot(from, to) > no_hold*self%dot(from, diagonal*from)) return
      self%unheld = motion_of_body(self%model, self%work)
      is_to_stop = self%unheld%body > 0
      if (is_to_stop) is_to_stop = .not. may_hold(self%contact, self%model, self%unheld%way)
   end function is_to_stop

   !> Collective: true when the run must end.
   logical function is_called_off(self)
      class(static_system_t), intent(inout) :: self
      self%asked = nint(self%model%communicator%maximum(real(self%called_off%asks(), wp)))
      is_called_off = self%asked > 0
   end function is_called_off

   !> Collective: product of two vectors of unknowns.
   real(wp) function dot(self, a, b)
      class(static_system_t), intent(in) :: self
      real(wp), intent(in) :: a(:), b(:)
      dot = self%model%communicator%sum_real(dot_product(a, b))
   end function dot

   subroutine clear_forces(self)
      class(static_system_t), intent(inout) :: self
      integer :: l
      do l = 1, size(self%levels)
         call self%levels(l)%clear_forces()
      end do
   end subroutine clear_forces

end module m_static_system
