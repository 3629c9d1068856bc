!test: helper
!> A stressed bar carried through the grid: crossing SPEED ANGLE WEIGHTS [PERIODS [LEVELS [PARTICLES
!> [CELLS]]]]
!>
!> A free bar, 2 x 2 cells thick and 16 CELLS long if nothing else is said, Poisson 0, with 8 PARTICLES a cell
!> if nothing else is said, rings in its first mode (amplitude of the velocity 1e-4 c) while it flies at SPEED
!> (over c) in a direction ANGLE degrees off its axis, half of the way across in y, half in z. Exactly,
!>
!>    sigma_xx = -E a sin(pi X/L) sin(pi c t/L),   a = 1e-4,   all other components 0.
!>
!> WEIGHTS is fixed, stretch, corners (the domains of a scene) or linear: domains a thousandth as large, which
!> makes the weights those of the plain material point method. PERIODS is 3 when not given. With 2 LEVELS the
!> cells are half as large in the middle of the grid. Prints the rms error of all stress components over the
!> amplitude, of all particles, and of the mean of the particles that began in the same cell along the bar;
!> the largest change of momentum over mass times amplitude of the velocity, how many steps there were, and
!> the largest energy about the mean motion in the last period over that in the first. (Within a period
!> kinetic and strain energy, taken half a step apart, swing by half the step times the frequency.)
program crossing
   use mpi_f08, only: MPI_Allreduce, MPI_IN_PLACE, MPI_DOUBLE_PRECISION, MPI_SUM
   use m_kinds, only: wp
   use m_constants, only: pi
   use m_errors, only: error_t
   use m_communicator, only: communicator_t
   use m_box, only: box_t
   use m_scene, only: scene_t
   use m_domain_kinds, only: domain_fixed, domain_stretch, domain_corners
   use m_materials, only: material_of
   use m_model, only: model_t
   use m_advance, only: advance
   use m_speed_bounds, only: bound_speeds
   use m_energy, only: sums_t, measure
   implicit none
   !> m, Pa, kg/m3, m/s
   real(wp), parameter :: cell = 1.0_wp, young = 1.0_wp, density = 1.0_wp, wave_speed = 1.0_wp
   real(wp), parameter :: strain = 1.0e-4_wp, safety = 0.3_wp
   real(wp), parameter :: shrink = 1.0e-3_wp !< of the domains, for linear weights
   type(communicator_t) :: comm
   type(model_t) :: model
   type(error_t) :: error
   type(sums_t) :: start
   character(len=16) :: words(7)
   real(wp) :: length, speed, angle, direction(3), time_step, sums(2), mean_sums(2), pushed
   real(wp), allocatable :: largest(:)
   integer :: i, period, periods, levels, per_cell, slices, step, steps
   words(4:) = ['3 ', '1 ', '8 ', '16']
   do i = 1, command_argument_count()
      call get_command_argument(i, words(i))
   end do
   read (words(4), *) periods
   read (words(5), *) levels
   read (words(6), *) per_cell
   read (words(7), *) slices
   length = slices*cell
   read (words(1), *) speed
   read (words(2), *) angle
   angle = angle*pi/180.0_wp
   direction = [cos(angle), sin(angle)/sqrt(2.0_wp), sin(angle)/sqrt(2.0_wp)]
   call comm%start()
   call model%build(comm, make_scene(), error)
   if (error%happened()) error stop 'the scene is not built'
   call set_motion()
   call bound_speeds(model)
   start = measure(model)
   pushed = 0.0_wp
   allocate (largest(periods), source=0.0_wp)
   steps = ceiling(periods*2.0_wp*length/wave_speed/(safety*cell/(wave_speed + speed)))
   time_step = periods*2.0_wp*length/wave_speed/steps
   sums = 0.0_wp
   mean_sums = 0.0_wp
   do step = 1, steps
      call advance(model, time_step, error)
      if (error%happened()) exit
      if (mod(step, look_every(periods)) /= 0) cycle
      call add_errors(time_step*step)
      period = min(size(largest), 1 + periods*(step - 1)/steps)
      call look(largest(period))
   end do
   call MPI_Allreduce(MPI_IN_PLACE, sums, 2, MPI_DOUBLE_PRECISION, MPI_SUM, comm%comm)
   if (error%happened()) then ! it flew apart
      sums = [huge(1.0_wp), 1.0_wp]
      mean_sums = sums
      largest = [(1.0_wp, i=1, periods - 1), huge(1.0_wp)]
   end if
   if (comm%is_root()) then
      print '(a,es14.6e3)', 'figure noise ', sqrt(sums(1)/sums(2))
      print '(a,es14.6e3)', 'figure mean ', sqrt(mean_sums(1)/mean_sums(2))
      print '(a,es14.6e3)', 'figure energy ', largest(periods)/largest(1)
      print '(a,es14.6e3)', 'figure momentum ', pushed
      print '(a,i0)', 'figure steps ', merge(step, steps, error%happened())
   end if
   call model%release()
   call comm%finish()

contains

   !> The bar at the lower end of a grid that it does not leave.
   type(scene_t) function make_scene() result(scene)
      real(wp) :: way(3)
      way = speed*direction*periods*2.0_wp*length/wave_speed
      scene%title = 'bar that flies and rings'
      scene%grid%cells = ceiling([slices + 6.0_wp, 8.0_wp, 8.0_wp] + way/cell)
      scene%grid%upper = scene%grid%cells*cell
      scene%grid%cell_size = cell
      scene%time%domain = domain_fixed
      if (words(3) == 'stretch' .or. words(3) == 'linear') scene%time%domain = domain_stretch
      if (words(3) == 'corners') scene%time%domain = domain_corners
      allocate (scene%materials(1), scene%bodies(1), scene%tools(0), scene%probes(0))
      scene%materials(1) = material_of('bar', 'elastic', density, young, 0.0_wp)
      scene%bodies(1)%name = 'bar'
      scene%bodies(1)%material = 1
      scene%bodies(1)%shape = box_t(lower=3.0_wp*cell, upper=3.0_wp*cell + [length, 2.0_wp*cell, 2.0_wp*cell])
      scene%bodies(1)%particles_per_cell = per_cell
      scene%bodies(1)%velocity = speed*direction
      if (levels == 1) return
      allocate (scene%levels(1))
      scene%levels(1)%lower = cell*[8.0_wp, 0.0_wp, 0.0_wp]
      scene%levels(1)%upper = cell*[14.0_wp, real(scene%grid%cells(2), wp), real(scene%grid%cells(3), wp)]
   end function make_scene

   !> The first mode, on top of the flight; domains as the weights want them.
   subroutine set_motion()
      integer :: b, l, p
      do l = 1, levels
         do b = 1, size(model%levels(l)%blocks)
            associate (particles => model%levels(l)%blocks(b)%particles, at => model%levels(l)%layout)
               do p = 1, particles%count
                  particles%column(p, at%velocity) = particles%column(p, at%velocity) &
                     + strain*wave_speed*cos(pi*(particles%column(p, at%position) - 3.0_wp*cell)/length)
                  if (at%gradient > 0) particles%column(p, at%gradient) = &
                     -strain*wave_speed*pi/length &
                     *sin(pi*(particles%column(p, at%position) - 3.0_wp*cell)/length)
                  if (words(3) == 'linear') particles%column(p, at%half_size:at%half_size + 2) = &
                     shrink*particles%column(p, at%half_size:at%half_size + 2)
               end do
            end associate
         end do
      end do
   end subroutine set_motion

   !> Collective: add the squared errors of this rank's particles over the amplitude, and their number; the
   !> same of the slices of the bar that were a cell thick.
   subroutine add_errors(time)
      real(wp), intent(in) :: time !< s
      real(wp) :: off(6), along, means(7, slices)
      integer :: b, l, p, slice
      means = 0.0_wp
      do l = 1, levels
         do b = 1, size(model%levels(l)%blocks)
            associate (particles => model%levels(l)%blocks(b)%particles, at => model%levels(l)%layout)
               do p = 1, particles%count
                  along = particles%column(p, at%position) - 3.0_wp*cell - speed*direction(1)*time
                  off = particles%column(p, at%stress:at%stress + 5)/(young*strain)
                  off(1) = off(1) + sin(pi*along/length)*sin(pi*wave_speed*time/length)
                  sums = sums + [sum(off**2), 1.0_wp]
                  slice = min(max(1 + floor(along/cell), 1), slices)
                  means(:, slice) = means(:, slice) + [off, 1.0_wp]
               end do
            end associate
         end do
      end do
      call MPI_Allreduce(MPI_IN_PLACE, means, size(means), MPI_DOUBLE_PRECISION, MPI_SUM, comm%comm)
      do slice = 1, slices
         mean_sums = mean_sums + [sum((means(1:6, slice)/means(7, slice))**2), 1.0_wp]
      end do
   end subroutine add_errors

   !> Raise the largest energy about the centre of mass (J) of a period, and the largest change of momentum.
   subroutine look(largest_energy)
      real(wp), intent(inout) :: largest_energy
      type(sums_t) :: now
      now = measure(model)
      largest_energy = max(largest_energy, now%kinetic - 0.5_wp*sum(now%momentum**2)/now%mass + now%strain)
      pushed = max(pushed, maxval(abs(now%momentum - start%momentum))/(start%mass*strain*wave_speed))
   end subroutine look

   !> Steps between two looks: each in a short run, some hundred in a long one's period.
   pure integer function look_every(periods)
      integer, intent(in) :: periods
      look_every = merge(1, 3, periods < 10)
   end function look_every

end program crossing
