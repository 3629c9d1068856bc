!test: helper
!> The generalized vortex, named after Kamojjala et al. (2015): vortex AMPLITUDE CELLS DOMAIN [FORCE
!> [PARTICLES]]
!>
!> Material turns about the z axis by an angle that depends on its radius R and the time t alone, in plane
!> strain:
!>
!>    alpha = A g(t) h(R),   g = (1 - cos(2 pi t/T))/2,   h = (1 - 4 s^2)^2,
!>    s = (R - 1)/(1/2) for |s| < 1/2, 0 beyond,
!>
!> so that at t = T/2 the middle of the ring 0.75 < R < 1.25 has turned by A, shear is R alpha' (7.1 at most
!> for A = 1), and at t = T all is back where it was. Volume is kept. With G = R alpha' our neo-Hookean law
!> (theory.md, eq. neo-hookean) has in the turned polar axes
!>
!>    sigma_rr = -mu G^2/3,   sigma_tt = 2 mu G^2/3,   sigma_rt = mu G,
!>
!> and momentum along r and theta gives the body force
!>
!>    b_r = -R alpha_t^2 + (mu/rho)(2/3 G G' + G^2/R),   b_t = R alpha_tt - (mu/rho)(G' + 2 G/R).
!>
!> E = 1000 Pa, nu = 0.3, 1000 kg/m3, T = 1 s. CELLS are those along 1 m. FORCE is right, or wrong: without
!> the shear stress. There are 8 PARTICLES a cell if nothing else is said. Prints the largest and the rms
!> error of the places over the cell at T/2 and at T, the number of splits, and whether the run stopped.
module m_vortex
   use m_kinds, only: wp
   use m_constants, only: pi
   use m_field_table, only: field_table_t, layout_t
   use m_particle_store, only: particle_store_t
   use m_effect, only: effect_t, hooks_t
   use m_group_reader, only: group_reader_t
   implicit none
   private
   public :: vortex_t, turn

   real(wp), parameter, public :: young = 1000.0_wp, poisson = 0.3_wp, density = 1000.0_wp, period = 1.0_wp
   real(wp), parameter, public :: shear = young/(2.0_wp*(1.0_wp + poisson)) !< Pa

   !> Gives the particles the body force; they remember where they started.
   type, extends(effect_t) :: vortex_t
      real(wp) :: amplitude = 0.0_wp !< rad
      real(wp) :: shear = shear      !< of the body force, Pa
   contains
      procedure :: variables => no_variables
      procedure :: hooks
      procedure :: declare
      procedure :: acceleration => add_body_force
   end type vortex_t

contains

   !> h(R) and its first two derivatives.
   pure function profile(radius) result(h)
      real(wp), intent(in) :: radius !< m
      real(wp) :: h(0:2), s
      h = 0.0_wp
      s = (radius - 1.0_wp)/0.5_wp
      if (abs(s) >= 0.5_wp) return
      h(0) = (1.0_wp - 4.0_wp*s**2)**2
      h(1) = -16.0_wp*s*(1.0_wp - 4.0_wp*s**2)/0.5_wp
      h(2) = (-16.0_wp + 192.0_wp*s**2)/0.25_wp
   end function profile

   !> The angle by which the material at a first radius has turned.
   pure real(wp) function turn(amplitude, radius, time)
      real(wp), intent(in) :: amplitude, radius, time !< rad, m, s
      real(wp) :: h(0:2)
      h = profile(radius)
      turn = amplitude*0.5_wp*(1.0_wp - cos(2.0_wp*pi*time/period))*h(0)
   end function turn

   !> No scene calls for it by name.
   subroutine no_variables(self, group)
      class(vortex_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
   end subroutine no_variables

   pure type(hooks_t) function hooks(self)
      class(vortex_t), intent(in) :: self
      hooks = hooks_t(acceleration=.true.)
   end function hooks

   subroutine declare(self, table)
      class(vortex_t), intent(inout) :: self
      type(field_table_t), intent(inout) :: table
      call table%declare('initial_position', 3, 'm', written=.false.)
   end subroutine declare

   pure subroutine add_body_force(self, particles, table, layout, time, body_force)
      class(vortex_t), intent(in) :: self
      type(particle_store_t), intent(in) :: particles
      type(field_table_t), intent(in) :: table
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: time
      real(wp), intent(inout) :: body_force(:, :)
      real(wp) :: x0(2), radius, h(0:2), g(0:2), strain(0:1), radial, around, angle
      integer :: p, first
      first = table%column('initial_position')
      g = self%amplitude*[0.5_wp*(1.0_wp - cos(2.0_wp*pi*time/period)), &
                          pi/period*sin(2.0_wp*pi*time/period), 2.0_wp*(pi/period)**2 &
                          *cos(2.0_wp*pi*time/period)]
      do p = 1, particles%count
         x0 = particles%column(p, first:first + 1)
         radius = norm2(x0)
         h = profile(radius)
         if (.not. any(abs(h) > 0.0_wp)) cycle
         strain = g(0)*[radius*h(1), h(1) + radius*h(2)] ! G, G'
         radial = -radius*(g(1)*h(0))**2 + self%shear/density*(2.0_wp/3.0_wp*strain(0)*strain(1) &
                  + strain(0)**2/radius)
         around = radius*g(2)*h(0) - self%shear/density*(strain(1) + 2.0_wp*strain(0)/radius)
         angle = atan2(x0(2), x0(1)) + g(0)*h(0)
         body_force(p, 1) = body_force(p, 1) + radial*cos(angle) - around*sin(angle)
         body_force(p, 2) = body_force(p, 2) + radial*sin(angle) + around*cos(angle)
      end do
   end subroutine add_body_force

end module m_vortex

program vortex
   use mpi_f08, only: MPI_Allreduce, MPI_IN_PLACE, MPI_DOUBLE_PRECISION, MPI_SUM, MPI_MAX
   use m_kinds, only: wp
   use m_constants, only: pi
   use m_errors, only: error_t
   use m_communicator, only: communicator_t
   use m_cylinder, only: cylinder_t
   use m_scene, only: scene_t
   use m_side_kinds, only: boundary_free, boundary_symmetry
   use m_domain_kinds, only: domain_fixed, domain_stretch, domain_corners
   use m_materials, only: material_of
   use m_model, only: model_t
   use m_advance, only: advance
   use m_speed_bounds, only: bound_speeds
   use m_vortex, only: vortex_t, turn, young, poisson, density, period
   implicit none
   real(wp), parameter :: safety = 0.3_wp, disc = 1.35_wp !< m: radius of the disc, whose rim stays at rest
   type(communicator_t) :: comm
   type(model_t) :: model
   type(error_t) :: error
   type(vortex_t) :: effect
   character(len=16) :: words(5)
   real(wp) :: amplitude, cell, time_step, half(2), whole(2)
   integer :: i, cells, per_cell, step, steps
   words = ''
   words(5) = '8'
   do i = 1, command_argument_count()
      call get_command_argument(i, words(i))
   end do
   read (words(1), *) amplitude
   read (words(2), *) cells
   read (words(5), *) per_cell
   cell = 1.0_wp/cells
   call comm%start()
   effect%name = 'vortex'
   effect%amplitude = amplitude
   if (words(4) == 'wrong') effect%shear = 0.0_wp
   allocate (model%effects(1))
   allocate (model%effects(1)%effect, source=effect)
   call model%build(comm, make_scene(), error)
   if (error%happened()) error stop 'the scene is not built'
   call remember_places()
   call bound_speeds(model)
   ! The fastest wave runs where the material is stretched most, about G-fold.
   steps = ceiling(period/(safety*cell/(model%bounds%wave_speed*max(1.0_wp, 7.1_wp*amplitude) &
                                        + 1.0_wp*pi*amplitude)))
   steps = 2*ceiling(0.5_wp*steps)
   time_step = period/steps
   half = 0.0_wp
   do step = 1, steps
      call advance(model, time_step, error)
      if (error%happened()) exit
      if (step == steps/2) half = errors()
   end do
   whole = errors()
   if (comm%is_root()) then
      if (error%happened()) print '(2a)', 'stopped: ', error%message
      print '(a,i0)', 'figure stopped ', merge(1, 0, error%happened())
      print '(a,es14.6e3)', 'figure stopped_at ', merge(step, steps, error%happened())*time_step/period
      print '(a,es14.6e3)', 'figure half_largest ', half(1)
      print '(a,es14.6e3)', 'figure half_rms ', half(2)
      print '(a,es14.6e3)', 'figure whole_largest ', whole(1)
      print '(a,es14.6e3)', 'figure whole_rms ', whole(2)
      print '(a,i0)', 'figure splits ', model%splits
   end if
   call model%release()
   call comm%finish()

contains

   !> A disc, one cell thick, between symmetry planes.
   type(scene_t) function make_scene() result(scene)
      integer :: n
      n = ceiling(disc*cells) + 2
      scene%title = 'vortex'
      scene%grid%cells = [2*n, 2*n, 1]
      scene%grid%lower = cell*[-n, -n, 0]
      scene%grid%upper = cell*[n, n, 1]
      scene%grid%cell_size = cell
      scene%grid%boundary = [boundary_free, boundary_free, boundary_free, boundary_free, boundary_symmetry, &
                             boundary_symmetry]
      select case (words(3))
      case ('fixed')
         scene%time%domain = domain_fixed
      case ('stretch')
         scene%time%domain = domain_stretch
      case default
         scene%time%domain = domain_corners
      end select
      allocate (scene%materials(1), scene%bodies(1), scene%tools(0), scene%probes(0))
      scene%materials(1) = material_of('rubber', 'neo_hookean', density, young, poisson)
      scene%bodies(1)%name = 'disc'
      scene%bodies(1)%material = 1
      scene%bodies(1)%shape = cylinder_t(radius=disc, height=cell)
      scene%bodies(1)%particles_per_cell = per_cell
   end function make_scene

   subroutine remember_places()
      integer :: b, first, n
      first = model%levels(1)%table%column('initial_position')
      do b = 1, size(model%levels(1)%blocks)
         associate (particles => model%levels(1)%blocks(b)%particles, at => model%levels(1)%layout)
            n = particles%count
            particles%column(:n, first:first + 2) = particles%column(:n, at%position:at%position + 2)
         end associate
      end do
   end subroutine remember_places

   !> Collective: largest and rms error of the places of the particles that were never split, over the cell.
   function errors() result(off)
      real(wp) :: off(2), sums(2), largest(1), x0(2), angle, x(2)
      integer :: b, first, p
      sums = 0.0_wp
      largest = 0.0_wp
      first = model%levels(1)%table%column('initial_position')
      do b = 1, size(model%levels(1)%blocks)
         associate (particles => model%levels(1)%blocks(b)%particles, at => model%levels(1)%layout)
            do p = 1, particles%count
               if (at%generation > 0) then
                  if (particles%column(p, at%generation) > 0.0_wp) cycle
               end if
               x0 = particles%column(p, first:first + 1)
               angle = turn(amplitude, norm2(x0), model%time)
               x = [cos(angle)*x0(1) - sin(angle)*x0(2), sin(angle)*x0(1) + cos(angle)*x0(2)]
               x = (particles%column(p, at%position:at%position + 1) - x)/cell
               sums = sums + [sum(x**2), 1.0_wp]
               largest = max(largest, norm2(x))
            end do
         end associate
      end do
      call MPI_Allreduce(MPI_IN_PLACE, sums, 2, MPI_DOUBLE_PRECISION, MPI_SUM, comm%comm)
      call MPI_Allreduce(MPI_IN_PLACE, largest, 1, MPI_DOUBLE_PRECISION, MPI_MAX, comm%comm)
      off = [largest(1), sqrt(sums(1)/max(1.0_wp, sums(2)))]
   end function errors

end program vortex
