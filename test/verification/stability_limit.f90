!test: ranks 2
!test: limit 3600
!test: long
!> Largest stable `safety` (time step = safety cell/(c + |v|)) in three dimensions, by particles a cell, transfer and stress update.
!>
!> A free block of neo-Hookean material rings for 2000 steps: a smooth mode of 1e-4 c, and on it a random velocity of 1e-4 c for
!> every particle, so that each mode of the grid is there from the start. The block lies at several places of the grid, whose
!> nodes at its surface so get anything from a full share of mass to next to none; in half of the runs it also travels obliquely,
!> at 0.02 c, so that its particles cross cells. A run is unstable when the energy about its centre of mass exceeds twice the
!> first; that energy stays within a few per cent below the limit and multiplies above it.
!>
!> What to expect, roughly: an outer node that one particle of half size l just touches has the mass m S and the stiffness
!> c^2 m (dS/dx)^2 a direction, so that its frequency is c/sqrt(l h) however little it has; three such directions at a corner
!> give c sqrt(3/(l h)), and a leapfrog 2/frequency: safety 2 sqrt(l/(3 h)) = 0.82, 0.58, 0.47 for 1, 8, 27 particles a cell;
!> inside the body 1/sqrt(3) = 0.58. Measured at Poisson 0.3: 0.55, 0.50, 0.45. Nearly incompressible material bears
!> less: 0.45, 0.42, 0.37 at Poisson 0.49. Affine transfer damps the shortest waves and bears a little more.
!>
!> Asserted: every line is stable up to the largest safety that the code should allow for its particles a cell (`allowed`), and the
!> sweep does find instability with usl, at 1.0. With usf and musl, whose stresses and velocities belong to other instants than
!> those of usl, the energy rises a little with the step without growing on; only the wide bound is asserted there.
program stability_limit
   use mpi_f08, only: MPI_Allreduce, MPI_IN_PLACE, MPI_DOUBLE_PRECISION, MPI_MAX, MPI_COMM_SELF
   use m_kinds, only: wp
   use m_constants, only: pi
   use m_errors, only: error_t
   use m_text, only: to_text
   use m_communicator, only: communicator_t
   use m_assertions, only: assertions_t
   use m_scene, only: scene_t, update_usl, update_usf, update_musl
   use m_materials, only: material_of
   use m_model, only: model_t
   use m_advance, only: advance
   use m_level_step, only: bound_speeds
   use m_energy, only: sums_t, measure
   implicit none

   !> One block of one kind.
   type :: setting_t
      integer :: particles_per_cell = 8
      logical :: affine = .true.
      integer :: stress_update = update_usl
      integer :: place = 1        !< which place on the grid
      logical :: travelling = .false.
      real(wp) :: poisson = 0.3_wp
   end type setting_t

   integer, parameter :: steps = 2000, look_every = 20
   integer, parameter :: block_cells = 4                    !< edge of the block
   real(wp), parameter :: grown = 2.0_wp                    !< energy over the first one from which a run counts as unstable
   real(wp), parameter :: density = 1.0_wp, young = 1.0_wp, cell = 1.0_wp !< kg/m3, Pa, m
   real(wp), parameter :: travel = 0.02_wp                  !< c
   real(wp), parameter :: kept = 1.05_wp                    !< energy over the first one that is still as it should be
   integer, parameter :: particle_numbers(3) = [1, 8, 27]
   real(wp), parameter :: allowed(3) = [0.4_wp, 0.4_wp, 0.35_wp]
   integer, parameter :: places = 8
   real(wp), parameter :: diagonal(6) = [0.0_wp, 0.03_wp, 0.1_wp, 0.2_wp, 0.35_wp, 0.5_wp] !< cells; the others by chance
   real(wp), parameter :: hopeless = 10.0_wp                !< a run is stopped there
   real(wp), parameter :: safeties(11) = [0.3_wp, 0.35_wp, 0.4_wp, 0.45_wp, 0.5_wp, 0.55_wp, 0.6_wp, 0.65_wp, 0.7_wp, &
                                          0.8_wp, 1.0_wp]
   type(communicator_t) :: comm, alone
   type(assertions_t) :: test
   call comm%start()
   alone%comm = MPI_COMM_SELF
   call test%start(comm, 'stability_limit')
   call sweep()
   call test%finish()

contains

   subroutine sweep()
      character(len=6), parameter :: transfers(2) = ['plain ', 'affine']
      integer :: n, t
      if (comm%is_root()) then
         print '(a,i0,a,i0,a)', 'largest energy over the first in ', steps, ' steps, worst of ', 2*places, ' runs (-: above 10)'
         print '(a,11f7.2)', ' particles  transfer  update  poisson   safety', safeties
      end if
      do n = 1, 3
         do t = 1, 2
            call row(setting_t(particles_per_cell=particle_numbers(n), affine=t == 2), transfers(t), 'usl ')
            call row(setting_t(particles_per_cell=particle_numbers(n), affine=t == 2, poisson=0.49_wp), transfers(t), 'usl ')
         end do
      end do
      do t = 1, 2
         call row(setting_t(affine=t == 2, stress_update=update_usf), transfers(t), 'usf ')
         call row(setting_t(affine=t == 2, stress_update=update_musl), transfers(t), 'musl')
         call row(setting_t(affine=t == 2, poisson=0.0_wp), transfers(t), 'usl ')
      end do
   end subroutine sweep

   !> One line of the table.
   subroutine row(setting, transfer, update)
      type(setting_t), intent(in) :: setting
      character(len=*), intent(in) :: transfer, update
      type(setting_t) :: one
      character(len=7) :: words(size(safeties))
      real(wp) :: growth(size(safeties)), limit
      character(len=:), allocatable :: name
      integer :: r, s
      name = to_text(setting%particles_per_cell)//' a cell, '//trim(transfer)//', '//trim(update)//', Poisson '// &
             to_text(setting%poisson)
      growth = 0.0_wp
      one = setting
      do s = 1, size(safeties)
         do r = 1 + comm%rank, 2*places, comm%ranks ! each rank runs by itself
            one%place = (r + 1)/2
            one%travelling = mod(r, 2) == 0
            growth(s) = max(growth(s), largest_growth(one, safeties(s)))
            if (growth(s) > hopeless) exit
         end do
      end do
      call MPI_Allreduce(MPI_IN_PLACE, growth, size(growth), MPI_DOUBLE_PRECISION, MPI_MAX, comm%comm)
      do s = 1, size(safeties)
         write (words(s), '(f7.2)') min(growth(s), hopeless)
         if (growth(s) > hopeless) words(s) = '      -'
      end do
      s = findloc(growth > grown, .true., dim=1)
      if (s == 0) s = size(safeties) + 1
      limit = 0.0_wp
      if (s > 1) limit = safeties(s - 1)
      if (comm%is_root()) print '(i10,2x,a,4x,a,f9.2,9x,11a,a,f5.2)', setting%particles_per_cell, transfer, update, &
         setting%poisson, words, '   stable to', limit
      limit = allowed(findloc(particle_numbers, setting%particles_per_cell, dim=1))
      call test%check(maxval(growth, mask=safeties <= limit) <= merge(kept, grown, setting%stress_update == update_usl), &
                      name//': stable up to the allowed safety')
      if (setting%stress_update == update_usl) call test%check(growth(size(safeties)) > grown, name//': unstable at 1.0')
   end subroutine row

   !> Largest energy about the centre of mass over that at the start.
   function largest_growth(setting, safety) result(growth)
      type(setting_t), intent(in) :: setting
      real(wp), intent(in) :: safety
      real(wp) :: growth, first, time_step
      type(model_t) :: model
      type(error_t) :: error
      integer :: step
      call model%build(alone, make_scene(setting, safety), error)
      if (error%happened()) error stop 'the scene is not built'
      call add_motion(model, 1.0e-4_wp*wave_speed(setting))
      call bound_speeds(model)
      first = inner_energy(model)
      growth = 1.0_wp
      do step = 1, steps
         time_step = safety*cell/(model%bounds%wave_speed + model%bounds%particle_speed)
         call advance(model, time_step, error)
         if (error%happened()) exit
         if (mod(step, look_every) /= 0) cycle
         growth = max(growth, inner_energy(model)/first)
         if (.not. growth <= hopeless) exit
      end do
      if (error%happened()) growth = huge(growth)
      call model%release()
   end function largest_growth

   !> A block somewhere in a grid that it does not leave.
   type(scene_t) function make_scene(setting, safety) result(scene)
      type(setting_t), intent(in) :: setting
      real(wp), intent(in) :: safety
      real(wp) :: offset(3), far
      far = 4.0_wp
      if (setting%travelling) far = far + steps*safety*cell*0.03_wp
      offset = [chance(3*setting%place), chance(3*setting%place + 1), chance(3*setting%place + 2)]
      if (setting%place <= size(diagonal)) offset = diagonal(setting%place)
      scene%title = 'ringing block'
      scene%grid%cells = block_cells + 8
      if (setting%travelling) scene%grid%cells = block_cells + 8 + ceiling(far*[1.0_wp, 0.7_wp, 0.4_wp])
      scene%grid%upper = scene%grid%cells*cell
      scene%grid%cell_size = cell
      scene%time%affine = setting%affine
      scene%time%stress_update = setting%stress_update
      allocate (scene%materials(1), scene%bodies(1), scene%tools(0), scene%probes(0))
      scene%materials(1) = material_of('rubber', 'neo_hookean', density, young, setting%poisson)
      scene%bodies(1)%name = 'block'
      scene%bodies(1)%material = 1
      scene%bodies(1)%lower = (4.0_wp + offset)*cell
      scene%bodies(1)%upper = scene%bodies(1)%lower + block_cells*cell
      scene%bodies(1)%particles_per_cell = setting%particles_per_cell
      if (setting%travelling) scene%bodies(1)%velocity = travel*wave_speed(setting)*[1.0_wp, 0.7_wp, 0.4_wp]
   end function make_scene

   !> c, m/s.
   pure real(wp) function wave_speed(setting)
      type(setting_t), intent(in) :: setting
      associate (nu => setting%poisson)
         wave_speed = sqrt(young/density*(1.0_wp - nu)/((1.0_wp + nu)*(1.0_wp - 2.0_wp*nu)))
      end associate
   end function wave_speed

   !> A smooth mode and noise, the same on any number of ranks.
   subroutine add_motion(model, small)
      type(model_t), intent(inout) :: model
      real(wp), intent(in) :: small !< m/s
      real(wp) :: wave(3)
      integer :: b, p, axis
      do b = 1, size(model%levels(1)%blocks)
         associate (particles => model%levels(1)%blocks(b)%particles, at => model%levels(1)%layout)
            do p = 1, particles%count
               wave = particles%column(p, at%position:at%position + 2)/(block_cells*cell)
               do axis = 1, 3
                  particles%column(p, at%velocity + axis - 1) = particles%column(p, at%velocity + axis - 1) &
                     + small*cos(2.0_wp*pi*wave(axis)) + small*(2.0_wp*chance(100 + 3*int(particles%id(p)) + axis) - 1.0_wp)
               end do
            end do
         end associate
      end do
   end subroutine add_motion

   !> Energy about the centre of mass, J.
   real(wp) function inner_energy(model)
      type(model_t), intent(in) :: model
      type(sums_t) :: sums
      sums = measure(model)
      inner_energy = sums%kinetic - 0.5_wp*sum(sums%momentum**2)/sums%mass + sums%strain
   end function inner_energy

   !> A number from 0 to 1 that looks like chance and is the same everywhere.
   pure real(wp) function chance(seed)
      integer, intent(in) :: seed
      chance = modulo(sin(12.9898_wp*seed + 4.1414_wp)*43758.5453_wp, 1.0_wp)
   end function chance

end program stability_limit
