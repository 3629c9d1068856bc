!> Artificial bulk viscosity: a pressure opposed to fast compression, which spreads shocks over a few cells
!> (theory.md, eq. bulk-viscosity).
module m_bulk_viscosity
   use m_kinds, only: wp
   use m_group_reader, only: group_reader_t
   use m_value_range, only: at_least
   use m_grid_level, only: grid_level_t
   use m_field_table, only: field_table_t, layout_t
   use m_particle_store, only: particle_store_t
   use m_scene_materials, only: materials_t
   use m_effect, only: effect_t, hooks_t
   use m_section, only: section_t
   implicit none
   private
   public :: bulk_viscosity_t

   type, extends(effect_t) :: bulk_viscosity_t
      real(wp) :: linear = 0.06_wp, quadratic = 1.2_wp
      real(wp), allocatable :: p_wave_modulus(:) !< of each body's material, Pa
      integer :: pressure = 0, heat = 0      !< columns
   contains
      procedure :: take_section
      procedure :: variables
      procedure :: hooks
      procedure :: declare
      procedure :: prepare
      procedure :: wave_factor
      procedure :: on_stress
      procedure :: dissipated
   end type bulk_viscosity_t

contains

   subroutine variables(self, group)
      class(bulk_viscosity_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      call group%get('linear', self%linear, at_least(0.0_wp, '', at_most=1.0_wp))
      call group%get('quadratic', self%quadratic, at_least(0.0_wp, '', at_most=4.0_wp))
   end subroutine variables

   pure type(hooks_t) function hooks(self)
      class(bulk_viscosity_t), intent(in) :: self
      hooks = hooks_t(on_stress=.true.)
   end function hooks

   subroutine declare(self, table)
      class(bulk_viscosity_t), intent(inout) :: self
      type(field_table_t), intent(inout) :: table
      call table%declare('viscous_pressure', 1, 'Pa', written=.true.)
      call table%declare('viscous_heat', 1, 'J', written=.false., extensive=.true.)
      self%pressure = table%column('viscous_pressure')
      self%heat = table%column('viscous_heat')
   end subroutine declare

   subroutine prepare(self, grid, materials)
      class(bulk_viscosity_t), intent(inout) :: self
      type(grid_level_t), intent(in) :: grid
      type(materials_t), intent(in) :: materials
      integer :: b
      allocate (self%p_wave_modulus(size(materials%of_body)))
      do b = 1, size(self%p_wave_modulus)
         self%p_wave_modulus(b) = materials%slots(materials%of_body(b))%law%p_wave_modulus()
      end do
   end subroutine prepare

   !> Factor on the fastest wave speed of the grid due to the viscosity: xi + sqrt(1 + xi^2), xi its damping
   !> ratio at a compression as fast as the fastest particle over one cell.
   pure real(wp) function wave_factor(self, mach)
      class(bulk_viscosity_t), intent(in) :: self
      real(wp), intent(in) :: mach
      real(wp) :: ratio
      ratio = self%linear + self%quadratic**2*mach
      wave_factor = ratio + sqrt(1.0_wp + ratio**2)
   end function wave_factor

   !> q = rho h (quadratic^2 h d^2 + linear c d) where the volume shrinks at the rate d, else 0. The energy
   !> dissipated in the step is computed with the q in effect, that of the step's beginning.
   pure subroutine on_stress(self, particles, layout, gradient, cell, time_step)
      class(bulk_viscosity_t), intent(in) :: self
      type(particle_store_t), intent(inout) :: particles
      type(layout_t), intent(in) :: layout
      real(wp), intent(in), contiguous :: gradient(:, :)
      real(wp), intent(in) :: cell, time_step
      integer :: first, last
      first = 1
      do while (first <= particles%count)
         last = particles%run_end(first)
         call advance(self, self%p_wave_modulus(particles%body(first)), first, last, cell, time_step, &
                      gradient, particles%column(:, layout%mass), particles%column(:, layout%volume), &
                      particles%column(:, self%pressure), particles%column(:, self%heat))
         first = last + 1
      end do
   end subroutine on_stress

   !> Particles first..last, all of one material.
   pure subroutine advance(self, p_wave_modulus, first, last, cell, time_step, gradient, mass, volume, &
                           pressure, heat)
      class(bulk_viscosity_t), intent(in) :: self
      real(wp), intent(in) :: p_wave_modulus, cell, time_step
      integer, intent(in) :: first, last
      real(wp), intent(in), contiguous :: gradient(:, :), mass(:), volume(:)
      real(wp), intent(inout), contiguous :: pressure(:), heat(:)
      real(wp) :: density, rate
      integer :: p
      !$omp simd private(density, rate)
      do p = first, last
         rate = -(gradient(p, 1) + gradient(p, 5) + gradient(p, 9))
         heat(p) = heat(p) + time_step*pressure(p)*rate*volume(p)
         rate = max(0.0_wp, rate)
         density = mass(p)/volume(p)
         pressure(p) = cell*rate*(density*self%quadratic**2*cell*rate &
                                  + self%linear*sqrt(density*p_wave_modulus))
      end do
   end subroutine advance

   !> Energy dissipated by particles first..last so far, J.
   pure real(wp) function dissipated(self, column, first, last)
      class(bulk_viscosity_t), intent(in) :: self
      real(wp), intent(in), contiguous :: column(:, :)
      integer, intent(in) :: first, last
      dissipated = sum(column(first:last, self%heat))
   end function dissipated

   !> The same in any section.
   subroutine take_section(self, section, why)
      class(bulk_viscosity_t), intent(inout) :: self
      type(section_t), intent(in) :: section
      character(len=:), allocatable, intent(out) :: why
      why = ''
   end subroutine take_section

end module m_bulk_viscosity
