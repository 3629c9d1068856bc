!> Axis-aligned manufactured solution in a unit cube, after Wallstedt and Guilkey (2008), An evaluation of
!> explicit time integration schemes for use with the generalized interpolation material point method, J.
!> Comput. Phys. 227, 9628-9642:
!>
!>    u_i = A sin(2 pi X_i) sin(phase_i + pi c t),   phases 0, 2 pi/3, 4 pi/3,   c = sqrt(E/density)
!>
!> Theirs is for another neo-Hookean law; the body force here is that of ours. With F diagonal, I = sum F_k^2
!> and J = F1 F2 F3,
!>
!>    P_i = mu J^(-2/3) (F_i - I/(3 F_i)) + K (J - 1) J/F_i
!>    d P_i/d X_i = M_i d F_i/d X_i,   M_i = mu J^(-2/3) (5 I/(9 F_i^2) - 1/3) + K (J/F_i)^2
!>    b_i = d2 u_i/dt2 - M_i (d F_i/d X_i)/density
!>
!> since F_i depends on X_i only. The cube fills the grid; u_i vanishes on the faces across i and goes on
!> beyond them as its mirror image, so that these are symmetry planes.
module m_manufactured
   use mpi_f08, only: MPI_Allreduce, MPI_IN_PLACE, MPI_DOUBLE_PRECISION, MPI_SUM, MPI_MAX, MPI_Wtime
   use m_kinds, only: wp, i8
   use m_constants, only: pi
   use m_errors, only: error_t
   use m_communicator, only: communicator_t
   use m_box, only: box_t
   use m_scene, only: scene_t, update_usl, update_usf
   use m_side_kinds, only: boundary_symmetry
   use m_domain_kinds, only: domain_fixed
   use m_field_table, only: field_table_t, layout_t
   use m_particle_store, only: particle_store_t
   use m_effect, only: effect_t, hooks_t
   use m_group_reader, only: group_reader_t
   use m_materials, only: material_of
   use m_model, only: model_t
   use m_advance, only: advance
   use m_indicators, only: stress_error_t, estimate_stress_error
   use m_speed_bounds, only: bound_speeds
   use m_migration, only: frame_of
   use m_residence, only: change_pair
   use m_locate, only: locate_particles
   implicit none
   private
   public :: solution_t, run_t, series_t, outcome_t, run, run_series

   real(wp), parameter, public :: reference_density = 1.0_wp !< kg/m3
   real(wp), parameter :: young = 1.0e4_wp     !< Pa
   real(wp), parameter :: poisson = 0.3_wp
   real(wp), parameter :: phase(3) = [0.0_wp, 2.0_wp*pi/3.0_wp, 4.0_wp*pi/3.0_wp]
   real(wp), parameter, public :: wave_speed = sqrt(young/reference_density) !< c, m/s

   !> Which body force: the right one, and two wrong ones to see that the test would notice.
   integer, parameter, public :: force_right = 0, force_without_shear = 1, force_linear = 2

   !> The solution of one amplitude.
   type :: solution_t
      real(wp) :: amplitude = 0.0_wp !< m
      real(wp) :: shear = young/(2.0_wp*(1.0_wp + poisson))          !< Pa
      real(wp) :: bulk = young/(3.0_wp*(1.0_wp - 2.0_wp*poisson))    !< Pa
      integer :: force = force_right
   contains
      procedure :: displacement
      procedure :: velocity
      procedure :: stretch
      procedure :: stretch_rate
      procedure :: piola
      procedure :: body_force
      procedure :: forces
   end type solution_t

   !> Gives the particles the body force; they remember where they started, and the sine and cosine of 2 pi X.
   type, extends(effect_t) :: manufactured_t
      type(solution_t) :: solution
   contains
      procedure :: variables => no_variables
      procedure :: hooks
      procedure :: declare
      procedure :: acceleration => add_body_force
   end type manufactured_t

   !> One run.
   type :: run_t
      integer :: cells = 8                 !< along an edge
      integer :: particles_per_cell = 8
      real(wp) :: amplitude = 0.001_wp     !< m
      logical :: affine = .true.
      integer :: stress_update = update_usl
      integer :: force = force_right
      integer :: domain = domain_fixed
      real(wp) :: safety = 0.4_wp
      real(wp) :: duration = 0.5_wp        !< periods of 2/c
      integer :: levels = 1                !< 2: cells half as large for x < 1/2
      logical :: subcycle = .true.
      logical :: staggered = .true.        !< first velocity that of half a step before the start, as leapfrog
                                           !< wants it
   end type run_t

   !> Errors of the positions over all particles and steps of one run.
   type :: outcome_t
      real(wp) :: l2 = 0.0_wp, largest = 0.0_wp !< m
      real(wp) :: seconds = 0.0_wp
      real(wp) :: stress_error = 0.0_wp     !< of the stress at the end, in its energy norm
      real(wp) :: stress_estimate = 0.0_wp  !< the same as the program estimates it
      integer(i8) :: particles = 0
      integer :: steps = 0
      logical :: failed = .false.
   end type outcome_t

   !> Runs on several grids, and the orders fitted to all of them.
   type :: series_t
      type(outcome_t), allocatable :: outcomes(:)
      real(wp) :: order_l2 = 0.0_wp, order_largest = 0.0_wp
      real(wp) :: last_order_l2 = 0.0_wp !< between the two finest grids
   end type series_t

contains

   !> u (m) of the particle that started at x0.
   pure function displacement(self, x0, time) result(u)
      class(solution_t), intent(in) :: self
      real(wp), intent(in) :: x0(3), time
      real(wp) :: u(3)
      u = self%amplitude*sin(2.0_wp*pi*x0)*sin(phase + pi*wave_speed*time)
   end function displacement

   !> du/dt, m/s.
   pure function velocity(self, x0, time) result(v)
      class(solution_t), intent(in) :: self
      real(wp), intent(in) :: x0(3), time
      real(wp) :: v(3)
      v = self%amplitude*pi*wave_speed*sin(2.0_wp*pi*x0)*cos(phase + pi*wave_speed*time)
   end function velocity

   !> The diagonal of F.
   pure function stretch(self, x0, time) result(f)
      class(solution_t), intent(in) :: self
      real(wp), intent(in) :: x0(3), time
      real(wp) :: f(3)
      f = 1.0_wp + 2.0_wp*pi*self%amplitude*cos(2.0_wp*pi*x0)*sin(phase + pi*wave_speed*time)
   end function stretch

   !> dF/dt, 1/s.
   pure function stretch_rate(self, x0, time) result(rate)
      class(solution_t), intent(in) :: self
      real(wp), intent(in) :: x0(3), time
      real(wp) :: rate(3)
      rate = 2.0_wp*pi*self%amplitude*pi*wave_speed*cos(2.0_wp*pi*x0)*cos(phase + pi*wave_speed*time)
   end function stretch_rate

   !> The diagonal of the first Piola-Kirchhoff stress, Pa.
   pure function piola(self, x0, time) result(p)
      class(solution_t), intent(in) :: self
      real(wp), intent(in) :: x0(3), time
      real(wp) :: p(3), f(3), j
      f = self%stretch(x0, time)
      j = product(f)
      p = self%shear*j**(-2.0_wp/3.0_wp)*(f - sum(f**2)/(3.0_wp*f)) + self%bulk*(j - 1.0_wp)*j/f
   end function piola

   !> b, m/s2.
   pure function body_force(self, x0, time) result(b)
      class(solution_t), intent(in) :: self
      real(wp), intent(in) :: x0(3), time
      real(wp) :: b(3), all(1, 3)
      call self%forces(1, reshape(sin(2.0_wp*pi*x0), [1, 3]), reshape(cos(2.0_wp*pi*x0), [1, 3]), time, all)
      b = all(1, :)
   end function body_force

   !> b (m/s2) of the first n particles from the sine and cosine of 2 pi X.
   pure subroutine forces(self, n, sine, cosine, time, b)
      class(solution_t), intent(in) :: self
      integer, intent(in) :: n
      real(wp), intent(in) :: sine(:, :), cosine(:, :) !< (:, 3)
      real(wp), intent(in) :: time
      real(wp), intent(out) :: b(:, :)                 !< (:, 3)
      real(wp) :: beat(3), f(3), j, factor, squares, shear, modulus(3)
      integer :: p
      beat = self%amplitude*sin(phase + pi*wave_speed*time)
      shear = self%shear
      if (self%force == force_without_shear) shear = 0.0_wp
      do p = 1, n
         f = 1.0_wp + 2.0_wp*pi*beat*cosine(p, :)
         if (self%force == force_linear) f = 1.0_wp
         j = f(1)*f(2)*f(3)
         squares = sum(f**2)
         factor = shear*j**(-2.0_wp/3.0_wp)
         modulus = factor*(5.0_wp*squares/(9.0_wp*f**2) - 1.0_wp/3.0_wp) + self%bulk*(j/f)**2
         b(p, :) = beat*sine(p, :)*(4.0_wp*pi**2*modulus/reference_density - (pi*wave_speed)**2)
      end do
   end subroutine forces

   !> No scene calls for it by name.
   subroutine no_variables(self, group)
      class(manufactured_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
   end subroutine no_variables

   pure type(hooks_t) function hooks(self)
      class(manufactured_t), intent(in) :: self
      hooks = hooks_t(acceleration=.true.)
   end function hooks

   subroutine declare(self, table)
      class(manufactured_t), intent(inout) :: self
      type(field_table_t), intent(inout) :: table
      call table%declare('initial_position', 3, 'm', written=.false.)
      call table%declare('initial_sine', 3, '1', written=.false.)
      call table%declare('initial_cosine', 3, '1', written=.false.)
   end subroutine declare

   pure subroutine add_body_force(self, particles, table, layout, time, body_force)
      class(manufactured_t), intent(in) :: self
      type(particle_store_t), intent(in) :: particles
      type(field_table_t), intent(in) :: table
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: time
      real(wp), intent(inout) :: body_force(:, :)
      real(wp) :: b(particles%count, 3)
      integer :: n, s, c
      n = particles%count
      s = table%column('initial_sine')
      c = table%column('initial_cosine')
      if (n == 0) return
      call self%solution%forces(n, particles%column(:, s:s + 2), particles%column(:, c:c + 2), time, b)
      body_force(:n, :) = body_force(:n, :) + b
   end subroutine add_body_force

   !> Collective: one run.
   function run(communicator, setting) result(outcome)
      type(communicator_t), intent(in) :: communicator
      type(run_t), intent(in) :: setting
      type(outcome_t) :: outcome
      type(model_t) :: model
      type(solution_t) :: solution
      type(error_t) :: error
      real(wp) :: time_step, span, start, sums(1), largest(1)
      integer :: step
      solution%amplitude = setting%amplitude
      solution%force = setting%force
      start = MPI_Wtime()
      allocate (model%effects(1))
      allocate (model%effects(1)%effect, source=manufactured_t(name='manufactured', solution=solution))
      call model%build(communicator, make_scene(setting), error)
      if (.not. error%happened()) then
         outcome%particles = communicator%sum_count(model%particle_count())
         span = setting%duration*2.0_wp/wave_speed
         ! the fastest wave is where the body is stretched most; the same step all along, for its order to be
         ! seen
         time_step = setting%safety*model%stepped_cell() &
                     /(sqrt((solution%bulk + 4.0_wp*solution%shear/3.0_wp)/reference_density &
                     *(1.0_wp + 2.0_wp*pi*setting%amplitude)**3) + sqrt(3.0_wp)*pi*wave_speed &
                     *setting%amplitude)
         outcome%steps = ceiling(span/time_step)
         time_step = span/outcome%steps
         call set_particles(model, solution, setting, time_step)
         call bound_speeds(model)
         do step = 1, outcome%steps
            call advance(model, time_step, error)
            if (error%happened()) exit
            call add_errors(model, solution, outcome%l2, outcome%largest)
         end do
         if (.not. error%happened()) call judge_stress(model, solution, outcome)
      end if
      sums = outcome%l2
      largest = outcome%largest
      call MPI_Allreduce(MPI_IN_PLACE, sums, 1, MPI_DOUBLE_PRECISION, MPI_SUM, communicator%comm)
      call MPI_Allreduce(MPI_IN_PLACE, largest, 1, MPI_DOUBLE_PRECISION, MPI_MAX, communicator%comm)
      outcome%l2 = sqrt(sums(1)/(real(outcome%particles, wp)*max(1, outcome%steps)))
      outcome%largest = largest(1)
      outcome%failed = error%happened()
      if (outcome%failed .and. communicator%is_root()) print '(2a)', '   stopped: ', error%message
      outcome%seconds = MPI_Wtime() - start
      call model%release()
   end function run

   !> Collective: error of the particles' stress where they are, true and estimated, over the norm of the
   !> stress.
   subroutine judge_stress(model, solution, outcome)
      type(model_t), intent(inout) :: model
      type(solution_t), intent(in) :: solution
      type(outcome_t), intent(inout) :: outcome
      type(stress_error_t) :: estimate
      real(wp) :: exact(6), f(3), sums(2), x0(3)
      integer :: b, l, p, first
      sums = 0.0_wp
      first = model%levels(1)%table%column('initial_position')
      do l = 1, size(model%levels)
         do b = 1, size(model%levels(l)%blocks)
            associate (at => model%levels(l)%layout, column => model%levels(l)%blocks(b)%particles%column, &
                       law => model%materials%slots(1)%law)
               do p = 1, model%levels(l)%blocks(b)%particles%count
                  x0 = column(p, first:first + 2)
                  f = solution%stretch(x0, model%time)
                  exact = 0.0_wp
                  exact(:3) = solution%piola(x0, model%time)*f/product(f)
                  sums = sums + column(p, at%volume) &
                         *[law%complementary_energy(column(p, at%stress:at%stress + 5) - exact), &
                                                      law%complementary_energy(exact)]
               end do
            end associate
         end do
      end do
      call MPI_Allreduce(MPI_IN_PLACE, sums, 2, MPI_DOUBLE_PRECISION, MPI_SUM, model%communicator%comm)
      outcome%stress_error = sqrt(sums(1)/sums(2))
      call estimate_stress_error(model, estimate)
      outcome%stress_estimate = estimate%share()
   end subroutine judge_stress

   !> A unit cube of one body between symmetry planes.
   type(scene_t) function make_scene(setting) result(scene)
      type(run_t), intent(in) :: setting
      scene%title = 'manufactured'
      scene%grid%upper = 1.0_wp
      scene%grid%cell_size = 1.0_wp/setting%cells
      scene%grid%cells = setting%cells
      scene%grid%boundary = boundary_symmetry
      scene%time%affine = setting%affine
      scene%time%stress_update = setting%stress_update
      scene%time%domain = setting%domain
      allocate (scene%materials(1), scene%bodies(1), scene%tools(0), scene%probes(0))
      scene%materials(1) = material_of('rubber', 'neo_hookean', reference_density, young, poisson)
      scene%bodies(1)%name = 'cube'
      scene%bodies(1)%material = 1
      scene%bodies(1)%shape = box_t(upper=1.0_wp)
      scene%bodies(1)%particles_per_cell = setting%particles_per_cell
      scene%time%subcycle = setting%subcycle
      if (setting%levels == 1) return
      allocate (scene%levels(1))
      scene%levels(1)%upper = [0.5_wp, 1.0_wp, 1.0_wp]
   end function make_scene

   !> Collective: the state of the solution at time 0. The velocity is that of half a step before, for a
   !> leapfrog; a law that is called first in a step (usf) then finds the deformation of one step before.
   subroutine set_particles(model, solution, setting, time_step)
      type(model_t), intent(inout) :: model
      type(solution_t), intent(in) :: solution
      type(run_t), intent(in) :: setting
      real(wp), intent(in) :: time_step
      real(wp) :: x0(3), f(3), early, lag
      integer :: b, l, p, first, s, c
      early = merge(-0.5_wp*time_step, 0.0_wp, setting%staggered)
      lag = merge(2.0_wp*early, 0.0_wp, setting%stress_update == update_usf)
      first = model%levels(1)%table%column('initial_position')
      s = model%levels(1)%table%column('initial_sine')
      c = model%levels(1)%table%column('initial_cosine')
      do l = 1, size(model%levels)
         if (l > 1 .and. setting%subcycle) early = 0.5_wp*early ! its steps are half as long
         do b = 1, size(model%levels(l)%blocks)
            associate (block => model%levels(l)%blocks(b), at => model%levels(l)%layout, &
                       column => model%levels(l)%blocks(b)%particles%column)
               do p = 1, block%particles%count
                  x0 = column(p, at%position:at%position + 2)
                  f = solution%stretch(x0, lag)
                  column(p, first:first + 2) = x0
                  column(p, s:s + 2) = sin(2.0_wp*pi*x0)
                  column(p, c:c + 2) = cos(2.0_wp*pi*x0)
                  column(p, at%position:at%position + 2) = x0 + solution%displacement(x0, 0.0_wp)
                  column(p, at%velocity:at%velocity + 2) = solution%velocity(x0, early)
                  column(p, at%volume) = column(p, at%volume)*product(f)
                  if (at%half_sizes) &
                     column(p, at%half_size:at%half_size + 2) = column(p, at%half_size:at%half_size + 2)*f
                  if (at%domain > 0) &
                     column(p, at%domain:at%domain + 8:4) = column(p, at%domain:at%domain + 8:4)*f
                  column(p, at%deformation:at%deformation + 8:4) = f
                  column(p, at%stress:at%stress + 5) = 0.0_wp
                  column(p, at%stress:at%stress + 2) = solution%piola(x0, lag)*f/product(f)
                  if (at%gradient > 0) &
                     column(p, at%gradient:at%gradient + 8:4) = solution%stretch_rate(x0, early)/f
               end do
            end associate
         end do
      end do
      call settle(model)
   end subroutine set_particles

   !> Collective: particles that have been moved by hand get their bins, and their blocks and levels where
   !> they left them.
   subroutine settle(model)
      type(model_t), intent(inout) :: model
      type(error_t) :: error
      integer :: b, l
      logical :: moved
      do l = 1, size(model%levels)
         associate (level => model%levels(l), x => model%levels(l)%layout%position)
            do b = 1, size(level%blocks)
               associate (block => level%blocks(b))
                  block%emigrant_count = 0
                  call block%particles%changed()
                  if (block%particles%count == 0) cycle
                  call locate_particles(block%particles%count, block%particles%column(:, x:x + 2), &
                                        frame_of(level, block), block%cells%bin, block%emigrants, &
                                        block%emigrant_count, moved, block%lowest, block%highest)
                  call block%cells%outdate()
               end associate
            end do
         end associate
      end do
      do l = 1, size(model%levels)
         do b = 1, size(model%levels(l)%blocks)
            call model%migration(l)%emigrate(model%communicator, model%levels(l), b)
            call model%levels(l)%keep_order(b)
         end do
      end do
      if (size(model%levels) == 1) call model%create_blocks()
      do l = 1, size(model%levels)
         call model%migration(l)%assign_to_blocks(model%communicator, model%levels(l))
         call model%migration(l)%exchange(model%communicator, model%levels(l), model%exchange(l)%ranks)
      end do
      if (size(model%levels) == 1) return
      call change_pair(model, 1, error) ! a particle at the edge may reach over it now
      if (error%happened()) error stop 'particles do not find their level'
   end subroutine settle

   !> Add the squared position errors of this rank's particles; raise the largest.
   subroutine add_errors(model, solution, squares, largest)
      type(model_t), intent(in) :: model
      type(solution_t), intent(in) :: solution
      real(wp), intent(inout) :: squares, largest
      real(wp) :: beat(3), off(3)
      integer :: b, l, p, first, s
      first = model%levels(1)%table%column('initial_position')
      s = model%levels(1)%table%column('initial_sine')
      beat = solution%amplitude*sin(phase + pi*wave_speed*model%time)
      do l = 1, size(model%levels)
         do b = 1, size(model%levels(l)%blocks)
            associate (particles => model%levels(l)%blocks(b)%particles, x => model%levels(l)%layout%position)
               do p = 1, particles%count
                  off = particles%column(p, x:x + 2) - particles%column(p, first:first + 2) &
                        - beat*particles%column(p, s:s + 2)
                  squares = squares + sum(off**2)
                  largest = max(largest, norm2(off))
               end do
            end associate
         end do
      end do
   end subroutine add_errors

   !> Collective: the same run on several grids; prints its table.
   function run_series(communicator, setting, cells, title) result(series)
      type(communicator_t), intent(in) :: communicator
      type(run_t), intent(in) :: setting
      integer, intent(in) :: cells(:)
      character(len=*), intent(in) :: title
      type(series_t) :: series
      type(run_t) :: one
      type(outcome_t) :: coarser
      real(wp) :: orders(2)
      integer :: coarser_cells, g
      allocate (series%outcomes(size(cells)))
      if (communicator%is_root()) then
         print '(/,a)', title
         print '(a)', '   cells  particles  steps    L2 / m      Linf / m    L2 / A   order   Linf / A  '// &
            ' order    time'
      end if
      one = setting
      coarser_cells = 0
      do g = 1, size(cells)
         one%cells = cells(g)
         series%outcomes(g) = run(communicator, one)
         orders = 0.0_wp
         associate (now => series%outcomes(g))
            if (g > 1) orders = log([coarser%l2/now%l2, coarser%largest/now%largest]) &
               /log(real(cells(g), wp)/coarser_cells)
            if (communicator%is_root()) print '(i8,i11,i7,2es12.3,2(f10.5,f8.2),f8.1,a)', cells(g), &
               now%particles, now%steps, now%l2, now%largest, now%l2/setting%amplitude, orders(1), &
               now%largest/setting%amplitude, orders(2), now%seconds, ' s'
            coarser = now
            coarser_cells = cells(g)
         end associate
      end do
      series%last_order_l2 = orders(1)
      series%order_l2 = fitted_order(real(cells, wp), series%outcomes%l2)
      series%order_largest = fitted_order(real(cells, wp), series%outcomes%largest)
      if (communicator%is_root()) print '(2(a,f6.2))', '   fitted order: L2 ', series%order_l2, ', Linf ', &
         series%order_largest
   end function run_series

   !> Slope of the line through log(error) over log(cell).
   pure real(wp) function fitted_order(cells, errors) result(order)
      real(wp), intent(in) :: cells(:), errors(:)
      real(wp) :: x(size(cells)), y(size(cells))
      x = -log(cells)
      y = log(errors)
      x = x - sum(x)/size(x)
      order = sum(x*y)/sum(x**2)
   end function fitted_order

end module m_manufactured
