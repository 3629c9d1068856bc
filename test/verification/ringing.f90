!> A free block that rings from random motion, for the limits of stability: what the sweep of stability_limit
!> and the map of test/stability share.
module m_ringing
   use m_kinds, only: wp
   use m_constants, only: pi
   use m_errors, only: error_t
   use m_communicator, only: communicator_t
   use m_box, only: box_t
   use m_scene, only: scene_t, update_usl
   use m_domain_kinds, only: domain_fixed
   use m_materials, only: material_of
   use m_model, only: model_t
   use m_advance, only: advance
   use m_speed_bounds, only: bound_speeds
   use m_energy, only: sums_t, measure
   implicit none
   private
   public :: setting_t, largest_growth, places, hopeless

   integer, parameter :: look_every = 20
   integer, parameter :: block_cells = 4                    !< edge of the block
   real(wp), parameter :: density = 1.0_wp, young = 1.0_wp, cell = 1.0_wp !< kg/m3, Pa, m
   real(wp), parameter :: travel = 0.02_wp                  !< c
   integer, parameter :: places = 8
   !> cells; the others by chance
   real(wp), parameter :: diagonal(6) = [0.0_wp, 0.03_wp, 0.1_wp, 0.2_wp, 0.35_wp, 0.5_wp]
   real(wp), parameter :: hopeless = 10.0_wp                !< a run is stopped there

   !> One block of one kind.
   type :: setting_t
      integer :: particles_per_cell = 8
      logical :: affine = .true.
      integer :: stress_update = update_usl
      integer :: place = 1        !< which place on the grid
      logical :: travelling = .false.
      real(wp) :: poisson = 0.3_wp
      integer :: domain = domain_fixed
      integer :: steps = 2000
      integer :: settle = 0 !< steps during which a larger energy, up to twice that at the start, counts as
                            !< the first
   end type setting_t

contains

   !> Largest energy about the centre of mass over the first.
   function largest_growth(alone, setting, safety) result(growth)
      type(communicator_t), intent(in) :: alone !< this rank by itself
      type(setting_t), intent(in) :: setting
      real(wp), intent(in) :: safety
      real(wp) :: growth, start, first, time_step
      type(model_t) :: model
      type(error_t) :: error
      integer :: step
      call model%build(alone, make_scene(setting, safety), error)
      if (error%happened()) error stop 'the scene is not built'
      call add_motion(model, 1.0e-4_wp*wave_speed(setting))
      call bound_speeds(model)
      start = inner_energy(model)
      first = start
      growth = 1.0_wp
      do step = 1, setting%steps
         time_step = safety*cell/(model%bounds%wave_speed + model%bounds%particle_speed)
         call advance(model, time_step, error)
         if (error%happened()) exit
         if (mod(step, look_every) /= 0) cycle
         if (step <= setting%settle) first = min(max(first, inner_energy(model)), 2.0_wp*start)
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
      if (setting%travelling) far = far + setting%steps*safety*cell*0.03_wp
      offset = [chance(3*setting%place), chance(3*setting%place + 1), chance(3*setting%place + 2)]
      if (setting%place <= size(diagonal)) offset = diagonal(setting%place)
      scene%title = 'ringing block'
      scene%grid%cells = block_cells + 8
      if (setting%travelling) scene%grid%cells = block_cells + 8 + ceiling(far*[1.0_wp, 0.7_wp, 0.4_wp])
      scene%grid%upper = scene%grid%cells*cell
      scene%grid%cell_size = cell
      scene%time%affine = setting%affine
      scene%time%domain = setting%domain
      scene%time%stress_update = setting%stress_update
      allocate (scene%materials(1), scene%bodies(1), scene%tools(0), scene%probes(0))
      scene%materials(1) = material_of('rubber', 'neo_hookean', density, young, setting%poisson)
      scene%bodies(1)%name = 'block'
      scene%bodies(1)%material = 1
      scene%bodies(1)%shape = box_t(lower=(4.0_wp + offset)*cell, upper=(4.0_wp + offset + block_cells)*cell)
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
                     + small*cos(2.0_wp*pi*wave(axis)) &
                     + small*(2.0_wp*chance(100 + 3*int(particles%id(p)) + axis) - 1.0_wp)
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

end module m_ringing
