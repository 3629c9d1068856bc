!> What the tests of nested levels share: small scenes, first motions and stresses on all levels, all
!> particles of all ranks, bodies that ring, and a force on one node.
module m_nested
   use mpi_f08
   use m_kinds, only: wp
   use m_constants, only: pi, block_size
   use m_errors, only: error_t
   use m_communicator, only: communicator_t
   use m_box, only: box_t
   use m_scene, only: scene_t, grid_spec_t, body_spec_t, level_spec_t
   use m_side_kinds, only: boundary_symmetry
   use m_materials, only: material_of
   use m_block, only: block_t
   use m_effect, only: effect_t, hooks_t
   use m_field_table, only: field_table_t, layout_t
   use m_grid_level, only: grid_level_t
   use m_group_reader, only: group_reader_t
   use m_model, only: model_t
   use m_advance, only: advance
   use m_energy, only: sums_t, measure
   implicit none
   private
   public :: empty_scene, add_box, add_level, set_motion, all_particles, nearest, worst_difference, &
      run_steps, largest_stress, particles_on, ring, ringing_bar, ringing_block, kick_t

   real(wp), parameter, public :: cell = 0.1_wp, density = 1000.0_wp, young = 1.0e6_wp, poisson = 0.3_wp
   real(wp), parameter, public :: lambda = young*poisson/((1.0_wp + poisson)*(1.0_wp - 2.0_wp*poisson))
   real(wp), parameter, public :: shear = young/(2.0_wp*(1.0_wp + poisson))
   real(wp), parameter, public :: wave = sqrt((lambda + 2.0_wp*shear)/density) !< speed of waves of pressure,
                                                                               !< m/s
   real(wp), parameter, public :: bar_wave = sqrt(young/density)               !< of waves along a thin bar,
                                                                               !< m/s

   real(wp), parameter :: strain = 0.005_wp !< of what rings, about
   integer :: bar_cells = 0                 !< of the bar that is being set in motion

   !> Rows of all_particles.
   integer, parameter, public :: at_x = 1, at_v = 4, at_mass = 7, at_volume = 8, at_stress = 9, &
      at_level = 15, kept = 15

   !> How a scene is stepped.
   type, public :: manner_t
      logical :: affine = .true.
      logical :: subcycle = .true.
      real(wp) :: flip = 1.0_wp
      integer :: levels = 2
   contains
      procedure :: text => manner_text
      procedure :: step_of
   end type manner_t

   abstract interface
      !> Velocity (m/s), its gradient (1/s, d v_i/d x_j) and stress (Pa) of a particle at a place, on a level.
      pure subroutine state_interface(x, level, v, l, s)
         import :: wp
         real(wp), intent(in) :: x(3)
         integer, intent(in) :: level
         real(wp), intent(out) :: v(3), l(3, 3), s(6)
      end subroutine state_interface
   end interface
   public :: state_interface

   !> How a body rang. Energies are means over whole periods, over the energy at the start: within a period
   !> the sum swings by some tenths of a percent, for velocities are known half a step before stresses, on the
   !> finer level half of that.
   type, public :: ringing_t
      real(wp) :: last = 0.0_wp, lowest = huge(1.0_wp), highest = 0.0_wp
      real(wp) :: largest = 0.0_wp  !< not a mean
      integer :: periods = 0
      real(wp) :: momentum = 0.0_wp !< largest change over sqrt(2 m kinetic energy at the start)
      real(wp) :: mass = 0.0_wp     !< change over mass
      real(wp) :: seconds = 0.0_wp
      integer :: particles = 0
      logical :: failed = .false.
      real(wp), allocatable :: all(:, :) !< particles at the end
   end type ringing_t

   !> A constant force on one node of one level.
   type, extends(effect_t) :: kick_t
      real(wp) :: force(3) = 0.0_wp !< N
      real(wp) :: cell = 0.0_wp     !< of the level, m
      integer :: node(3) = 0
   contains
      procedure :: variables => no_variables
      procedure :: hooks => kick_hooks
      procedure :: add_forces => add_kick
   end type kick_t

contains

   function manner_text(self) result(text)
      class(manner_t), intent(in) :: self
      character(len=:), allocatable :: text
      character(len=4) :: flip
      write (flip, '(f4.2)') self%flip
      text = trim(merge('affine', 'plain ', self%affine))//', '// &
             trim(merge('subcycled', 'lockstep ', self%subcycle))//', flip '// &
             flip//', '//achar(iachar('0') + self%levels)//merge(' level ', ' levels', self%levels == 1)
   end function manner_text

   !> Step of the coarsest level (m: s) at a share of its cell over the wave speed; all step with the finest's
   !> where there is no subcycling.
   pure real(wp) function step_of(self, safety)
      class(manner_t), intent(in) :: self
      real(wp), intent(in) :: safety
      step_of = safety*cell/wave
      if (.not. self%subcycle) step_of = step_of/2**(self%levels - 1)
   end function step_of

   !> A scene of soft material without a body, the sides of its grid free.
   function empty_scene(cells, manner) result(scene)
      integer, intent(in) :: cells(3)
      type(manner_t), intent(in) :: manner
      type(scene_t) :: scene
      scene%title = 'nested'
      scene%end_time = 1.0_wp
      scene%grid = grid_spec_t(upper=cell*cells, cell_size=cell, cells=cells)
      scene%time%affine = manner%affine
      scene%time%subcycle = manner%subcycle
      scene%time%flip_fraction = manner%flip
      allocate (scene%materials(1), scene%bodies(0), scene%tools(0), scene%probes(0), scene%levels(0))
      scene%materials(1) = material_of('soft', 'elastic', density, young, poisson)
   end function empty_scene

   !> A box, its corners in coarse cells.
   subroutine add_box(scene, lower, upper, per_cell)
      type(scene_t), intent(inout) :: scene
      real(wp), intent(in) :: lower(3), upper(3)
      integer, intent(in) :: per_cell
      type(body_spec_t) :: body
      body%name = 'box'
      body%material = 1
      body%shape = box_t(lower=cell*lower, upper=cell*upper)
      body%particles_per_cell = per_cell
      scene%bodies = [scene%bodies, body]
   end subroutine add_box

   !> A level, its corners in coarse cells from the grid's lower corner.
   subroutine add_level(scene, lower, upper)
      type(scene_t), intent(inout) :: scene
      integer, intent(in) :: lower(3), upper(3)
      type(level_spec_t) :: level
      level%of = size(scene%levels) + 1
      level%lower = scene%grid%lower + cell*lower
      level%upper = scene%grid%lower + cell*upper
      scene%levels = [scene%levels, level]
   end subroutine add_level

   !> Give all particles a first state.
   subroutine set_motion(model, state)
      type(model_t), intent(inout) :: model
      procedure(state_interface) :: state
      real(wp) :: v(3), l(3, 3), s(6)
      integer :: n, b, p
      do n = 1, size(model%levels)
         do b = 1, size(model%levels(n)%blocks)
            associate (column => model%levels(n)%blocks(b)%particles%column, at => model%levels(n)%layout)
               do p = 1, model%levels(n)%blocks(b)%particles%count
                  call state(column(p, at%position:at%position + 2), n, v, l, s)
                  column(p, at%velocity:at%velocity + 2) = v
                  column(p, at%stress:at%stress + 5) = s
                  if (at%gradient > 0) column(p, at%gradient:at%gradient + 8) = reshape(l, [9])
               end do
            end associate
         end do
      end do
   end subroutine set_motion

   !> Collective: some steps.
   subroutine run_steps(model, steps, time_step, error)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: steps
      real(wp), intent(in) :: time_step
      type(error_t), intent(inout) :: error
      integer :: s
      do s = 1, steps
         if (error%happened()) exit
         call advance(model, time_step, error)
      end do
      if (error%happened() .and. model%communicator%is_root()) print '(3x,2a)', 'stopped: ', error%message
   end subroutine run_steps

   !> Collective: all particles of all ranks and levels, (kept, particles).
   function all_particles(model) result(all)
      type(model_t), intent(in) :: model
      real(wp), allocatable :: all(:, :), own(:, :)
      integer :: n, b, p, q, counts(model%communicator%ranks), offsets(model%communicator%ranks), r
      allocate (own(kept, int(model%particle_count())))
      q = 0
      do n = 1, size(model%levels)
         do b = 1, size(model%levels(n)%blocks)
            associate (column => model%levels(n)%blocks(b)%particles%column, at => model%levels(n)%layout)
               do p = 1, model%levels(n)%blocks(b)%particles%count
                  q = q + 1
                  own(:, q) = [column(p, at%position:at%position + 2), &
                               column(p, at%velocity:at%velocity + 2), column(p, at%mass), &
                               column(p, at%volume), column(p, at%stress:at%stress + 5), real(n, wp)]
               end do
            end associate
         end do
      end do
      call MPI_Allgather(kept*q, 1, MPI_INTEGER, counts, 1, MPI_INTEGER, model%communicator%comm)
      offsets(1) = 0
      do r = 2, size(counts)
         offsets(r) = offsets(r - 1) + counts(r - 1)
      end do
      allocate (all(kept, sum(counts)/kept))
      call MPI_Allgatherv(own, kept*q, MPI_DOUBLE_PRECISION, all, counts, offsets, MPI_DOUBLE_PRECISION, &
                          model%communicator%comm)
   end function all_particles

   !> The particle nearest to a place.
   pure integer function nearest(all, x)
      real(wp), intent(in) :: all(:, :), x(3)
      real(wp) :: least, squared
      integer :: p
      nearest = 0
      least = huge(least)
      do p = 1, size(all, 2)
         squared = (all(1, p) - x(1))**2 + (all(2, p) - x(2))**2 + (all(3, p) - x(3))**2
         if (squared >= least) cycle
         least = squared
         nearest = p
      end do
   end function nearest

   !> Largest differences of the particles of one model from the nearest ones of another: place (m), velocity
   !> (m/s), stress (Pa), mass and volume (relative).
   pure function worst_difference(all, others) result(off)
      real(wp), intent(in) :: all(:, :), others(:, :)
      real(wp) :: off(5)
      integer :: p, q
      off = 0.0_wp
      do p = 1, size(all, 2)
         q = nearest(others, all(1:3, p))
         off = max(off, [maxval(abs(all(1:3, p) - others(1:3, q))), &
                         maxval(abs(all(4:6, p) - others(4:6, q))), &
                         maxval(abs(all(9:14, p) - others(9:14, q))), abs(all(7, p)/others(7, q) - 1.0_wp), &
                         abs(all(8, p)/others(8, q) - 1.0_wp)])
      end do
   end function worst_difference

   !> Collective: largest component of stress, Pa.
   real(wp) function largest_stress(model) result(largest)
      type(model_t), intent(in) :: model
      real(wp), allocatable :: all(:, :)
      all = all_particles(model)
      largest = maxval(abs(all(at_stress:at_stress + 5, :)))
   end function largest_stress

   !> Collective: particles on a level.
   integer function particles_on(model, level)
      type(model_t), intent(in) :: model
      integer, intent(in) :: level
      particles_on = int(model%communicator%sum_count(model%levels(level)%particle_count()))
   end function particles_on

   !> A bar of `long` x 4 x 4 cells, a quarter of it in long x 2 x 2 behind two symmetry planes, with level 2
   !> over its middle third and level 3 over the middle of that. `long`: a multiple of 12.
   function ringing_bar(manner, long) result(scene)
      type(manner_t), intent(in) :: manner
      integer, intent(in) :: long
      type(scene_t) :: scene
      scene = empty_scene([long + 8, 4, 4], manner)
      scene%grid%boundary([3, 5]) = boundary_symmetry
      call add_box(scene, [4.0_wp, 0.0_wp, 0.0_wp], [4.0_wp + long, 2.0_wp, 2.0_wp], 8)
      if (manner%levels > 1) call add_level(scene, [4 + long/3, 0, 0], [4 + 2*(long/3), 4, 4])
      if (manner%levels > 2) call add_level(scene, [4 + 5*(long/12), 0, 0], [4 + 7*(long/12), 4, 4])
   end function ringing_bar

   !> A cube of 12 cells, an eighth of it behind three symmetry planes, with a cube of 8 (and of 4) as level 2
   !> (and 3): edges with corners. Without cross contraction, so that what `ring` sets is a mode of it.
   function ringing_block(manner) result(scene)
      type(manner_t), intent(in) :: manner
      type(scene_t) :: scene
      scene = empty_scene([8, 8, 8], manner)
      scene%grid%boundary([1, 3, 5]) = boundary_symmetry
      scene%materials(1) = material_of('soft', 'elastic', density, young, 0.0_wp)
      call add_box(scene, [0.0_wp, 0.0_wp, 0.0_wp], [6.0_wp, 6.0_wp, 6.0_wp], 8)
      if (manner%levels > 1) call add_level(scene, [0, 0, 0], [4, 4, 4])
      if (manner%levels > 2) call add_level(scene, [0, 0, 0], [2, 2, 2])
   end function ringing_block

   !> Collective: a body rings, its strain about 0.005, for some steps.
   function ring(communicator, scene, manner, safety, steps, long) result(ringing)
      type(communicator_t), intent(in) :: communicator
      type(scene_t), intent(in) :: scene
      type(manner_t), intent(in) :: manner
      real(wp), intent(in) :: safety
      integer, intent(in) :: steps
      integer, intent(in) :: long !< cells of a bar; 0 is a block
      type(ringing_t) :: ringing
      integer, parameter :: every = 4
      type(model_t) :: model
      type(error_t) :: error
      type(sums_t) :: start, now
      real(wp) :: time_step, period, sum_of_period, began
      integer :: s, samples, next_period
      began = MPI_Wtime()
      call model%build(communicator, scene, error)
      time_step = manner%step_of(safety)
      if (long > 0) then
         bar_cells = long
         call set_motion(model, bar_state)
         period = 2.0_wp*long*cell/bar_wave/time_step
      else
         call set_motion(model, block_state)
         time_step = time_step*wave/bar_wave
         period = 24.0_wp*cell/bar_wave/time_step
      end if
      start = measure(model)
      sum_of_period = 0.0_wp
      samples = 0
      next_period = nint(period)
      do s = 1, steps
         call run_steps(model, 1, time_step, error)
         if (error%happened()) exit
         if (mod(s, every) == 0) then
            now = measure(model)
            sum_of_period = sum_of_period + now%energy()/start%energy()
            samples = samples + 1
            ringing%largest = max(ringing%largest, now%energy()/start%energy())
            ringing%momentum = max(ringing%momentum, merge(abs(now%momentum(1) - start%momentum(1)), &
                                                           0.0_wp, long > 0) &
                                   /sqrt(2.0_wp*start%mass*start%kinetic))
            ringing%mass = max(ringing%mass, abs(now%mass/start%mass - 1.0_wp))
            if (ringing%largest > 10.0_wp) exit
         end if
         if (s < next_period) cycle
         ringing%last = sum_of_period/samples
         ringing%lowest = min(ringing%lowest, ringing%last)
         ringing%highest = max(ringing%highest, ringing%last)
         ringing%periods = ringing%periods + 1
         sum_of_period = 0.0_wp
         samples = 0
         next_period = nint(period*(ringing%periods + 1))
      end do
      ringing%failed = error%happened() .or. ringing%largest > 10.0_wp
      ringing%particles = int(communicator%sum_count(model%particle_count()))
      ringing%all = all_particles(model)
      ringing%seconds = MPI_Wtime() - began
      call model%release()
   end function ring

   !> The first mode of a free bar.
   pure subroutine bar_state(x, level, v, l, s)
      real(wp), intent(in) :: x(3)
      integer, intent(in) :: level
      real(wp), intent(out) :: v(3), l(3, 3), s(6)
      real(wp) :: k
      k = pi/(bar_cells*cell)
      v = [strain*bar_wave*cos(k*(x(1) - 4.0_wp*cell)), 0.0_wp, 0.0_wp]
      l = 0.0_wp
      l(1, 1) = -strain*bar_wave*k*sin(k*(x(1) - 4.0_wp*cell))
      s = 0.0_wp
   end subroutine bar_state

   !> It breathes, and is sheared.
   pure subroutine block_state(x, level, v, l, s)
      real(wp), intent(in) :: x(3)
      integer, intent(in) :: level
      real(wp), intent(out) :: v(3), l(3, 3), s(6)
      real(wp), parameter :: k = 0.5_wp*pi/(6.0_wp*cell), factor(3) = [1.0_wp, 1.0_wp, -0.3_wp]
      integer :: axis
      v = strain*wave*factor*sin(k*x)
      l = 0.0_wp
      do axis = 1, 3
         l(axis, axis) = strain*wave*factor(axis)*k*cos(k*x(axis))
      end do
      s = 0.0_wp
   end subroutine block_state

   subroutine no_variables(self, group)
      class(kick_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
   end subroutine no_variables

   pure type(hooks_t) function kick_hooks(self) result(hooks)
      class(kick_t), intent(in) :: self
      hooks = hooks_t(add_forces=.true.)
   end function kick_hooks

   pure subroutine add_kick(self, block, table, layout, grid, time, window, tile)
      class(kick_t), intent(in) :: self
      type(block_t), intent(in) :: block
      type(field_table_t), intent(in) :: table
      type(layout_t), intent(in) :: layout
      type(grid_level_t), intent(in) :: grid
      real(wp), intent(in) :: time, window
      real(wp), intent(inout), contiguous :: tile(:, 0:, 0:, 0:)
      integer :: at(3)
      if (abs(grid%cell - self%cell) > 0.1_wp*self%cell) return
      if (any(self%node/block_size /= block%place)) return
      at = self%node - block_size*block%place + 1
      tile(5:7, at(1), at(2), at(3)) = tile(5:7, at(1), at(2), at(3)) + self%force
   end subroutine add_kick

end module m_nested
