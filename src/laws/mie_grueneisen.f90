!> Pressure by the equation of state of Mie and Grueneisen about a linear Hugoniot curve, combined with the
!> strength of another law (theory.md, eqs mie-grueneisen, shock-energy).
module m_mie_grueneisen
   use m_kinds, only: wp, i8
   use m_group_reader, only: group_reader_t
   use m_value_range, only: above, at_least
   use m_field_table, only: field_table_t, layout_t
   use m_material, only: material_t, failure_t
   use m_j2, only: j2_t
   use m_johnson_cook, only: johnson_cook_t
   implicit none
   private
   public :: mie_grueneisen_t

   character(len=*), parameter :: strengths(3) = [character(len=12) :: 'none', 'j2', 'johnson_cook']
   integer, parameter :: of_none = 1, of_j2 = 2
   real(wp), parameter :: not_a_number = transfer(-2251799813685248_i8, 1.0_wp) !< quiet, as a bit pattern

   !> A strength law gives the deviator, this one the pressure.
   type, extends(material_t) :: mie_grueneisen_t
      integer :: strength = of_none        !< index in `strengths`
      type(j2_t) :: j2                     !< the possible ones
      type(johnson_cook_t) :: johnson_cook
      real(wp) :: sound_speed = 0.0_wp     !< c0: shock speed for vanishing particle speed, m/s
      real(wp) :: hugoniot_slope = 0.0_wp  !< s: Us = c0 + s up
      real(wp) :: grueneisen = 0.0_wp      !< Gamma0, and Gamma rho = Gamma0 rho0
      integer :: energy = 0                !< column: internal energy per mass without that of shear, J/kg
      integer :: heat = 0                  !< column: part of it due to bulk viscosity and friction, J
      integer :: work = 0                  !< column: plastic work, J; 0 without strength
      integer :: mass = 0                  !< column
   contains
      procedure :: variables
      procedure :: declare
      procedure :: initial
      procedure :: update
      procedure :: p_wave_modulus
      procedure :: squared_speed
      procedure :: complementary_energy
      procedure :: von_mises_modulus
      procedure :: strain_energy
      procedure :: plastic_energy
      procedure :: equivalent_plastic_strain
      procedure :: may_flow
      procedure :: stretch
      procedure :: for_large_strains
      procedure :: default_effect
      procedure :: failure
      procedure :: take_heat
      procedure :: takes_heat
      procedure, private :: shear
      procedure, private :: apply_pressure
      procedure, private :: warm
   end type mie_grueneisen_t

contains

   !> Its pressure follows from its volume; failure removes the energy of the deviator only.
   pure type(failure_t) function failure(self)
      class(mie_grueneisen_t), intent(in) :: self
      failure = failure_t(acts=.true., by_volume=.true., shear=self%von_mises_modulus()/3.0_wp)
      if (self%strength == of_j2 .and. self%j2%kinematic%is_used()) failure%back = self%j2%kinematic%modulus
      if (.not. self%takes_heat()) return
      failure%warms = .true.
      failure%room = self%johnson_cook%room_temperature
      failure%melting = self%johnson_cook%melting_temperature
   end function failure

   subroutine variables(self, group)
      class(mie_grueneisen_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      call group%get('sound_speed', self%sound_speed, above(0.0_wp, 'm/s'), required=.true.)
      call group%get('hugoniot_slope', self%hugoniot_slope, at_least(0.0_wp, ''), required=.true.)
      call group%get('grueneisen', self%grueneisen, at_least(0.0_wp, ''), required=.true.)
      call group%get_choice('strength', self%strength, strengths)
      select case (self%strength)
      case (of_none)
      case (of_j2)
         call self%j2%variables(group)
      case default
         call self%johnson_cook%variables(group)
      end select
   end subroutine variables

   pure logical function for_large_strains(self)
      class(mie_grueneisen_t), intent(in) :: self
      for_large_strains = .true.
   end function for_large_strains

   !> None without strength: the motions that anti-locking leaves to the shear stress then meet no resistance.
   pure function default_effect(self) result(name)
      class(mie_grueneisen_t), intent(in) :: self
      character(len=:), allocatable :: name
      name = ''
      if (self%strength /= of_none) name = 'anti_locking'
   end function default_effect

   !> The fields of strength, the internal energy and the heat of shocks.
   pure subroutine declare(self, table, has_tools)
      class(mie_grueneisen_t), intent(inout) :: self
      type(field_table_t), intent(inout) :: table
      logical, intent(in) :: has_tools
      self%j2%density = self%density
      self%johnson_cook%density = self%density
      if (self%strength == of_j2) then
         call self%j2%declare(table, has_tools)
         self%work = self%j2%work
      else if (self%strength /= of_none) then
         call self%johnson_cook%declare(table, has_tools)
         self%work = self%johnson_cook%work
      end if
      call table%declare('internal_energy', 1, 'J/kg', written=.true., by_mass=.true.)
      call table%declare('shock_heat', 1, 'J', written=.false., extensive=.true.)
      self%energy = table%column('internal_energy')
      self%heat = table%column('shock_heat')
      self%mass = table%column('mass')
   end subroutine declare

   pure subroutine initial(self, column, layout, first, last)
      class(mie_grueneisen_t), intent(in) :: self
      real(wp), intent(inout), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: first, last
      if (self%strength == of_j2) then
         call self%j2%initial(column, layout, first, last)
      else if (self%strength /= of_none) then
         call self%johnson_cook%initial(column, layout, first, last)
      end if
   end subroutine initial

   !> Update by the strength law, of which the deviator is kept; then the pressure.
   pure subroutine update(self, column, layout, gradient, time_step, first, last)
      class(mie_grueneisen_t), intent(in) :: self
      real(wp), intent(inout), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      real(wp), intent(in), contiguous :: gradient(:, :)
      real(wp), intent(in) :: time_step
      integer, intent(in) :: first, last
      real(wp) :: pressure(last - first + 1), plastic(last - first + 1)
      integer :: p, s
      s = layout%stress
      !$omp simd
      do p = first, last
         pressure(p - first + 1) = -(column(p, s) + column(p, s + 1) + column(p, s + 2))/3.0_wp
      end do
      plastic = 0.0_wp
      if (self%work > 0) plastic = column(first:last, self%work)
      if (self%strength == of_j2) then
         call self%j2%update(column, layout, gradient, time_step, first, last)
      else if (self%strength /= of_none) then
         call self%johnson_cook%update(column, layout, gradient, time_step, first, last)
      end if
      if (self%work > 0) plastic = column(first:last, self%work) - plastic
      call self%apply_pressure(column, layout, gradient, time_step, first, last, pressure, plastic)
   end subroutine update

   !> p and the energy at the step's end: de = -(p + q) dv + plastic work, with the mean of the pressures of
   !> both ends and the viscous pressure q of the step; linear in e (theory.md, eq. shock-energy).
   pure subroutine apply_pressure(self, column, layout, gradient, time_step, first, last, before, plastic)
      class(mie_grueneisen_t), intent(in) :: self
      real(wp), intent(inout), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      real(wp), intent(in), contiguous :: gradient(:, :)
      real(wp), intent(in) :: time_step
      integer, intent(in) :: first, last
      real(wp), intent(in) :: before(:)  !< pressure of the step's beginning, Pa
      real(wp), intent(in) :: plastic(:) !< plastic work of the step, J
      real(wp), dimension(last - first + 1) :: viscous, failed, change
      real(wp) :: volume, pressure, mean, gain, bears_shear
      integer :: i, p, s
      s = layout%stress
      gain = self%grueneisen*self%density
      bears_shear = merge(1.0_wp, 0.0_wp, self%strength /= of_none)
      associate (q => layout%viscous_pressure, d => layout%damage, e => self%energy)
         viscous = 0.0_wp
         failed = 0.0_wp
         if (d > 0) failed = merge(1.0_wp, 0.0_wp, column(first:last, d) >= 1.0_wp)
         if (q > 0) then
            ! the work of the viscosity, as recorded by that effect
            do p = first, last
               viscous(p - first + 1) = -time_step*column(p, q)*&
                                        (gradient(p, 1) + gradient(p, 5) + gradient(p, 9)) &
                                        *column(p, layout%volume) &
                                        *stretched(time_step, gradient(p, 1), gradient(p, 2), &
                                                   gradient(p, 3), gradient(p, 4), gradient(p, 5), &
                                                   gradient(p, 6), gradient(p, 7), &
                                                   gradient(p, 8), gradient(p, 9))
            end do
            column(first:last, self%heat) = column(first:last, self%heat) + viscous
         end if
         !$omp simd private(i, volume, pressure, mean)
         do p = first, last
            i = p - first + 1
            volume = column(p, layout%volume)*stretched(time_step, gradient(p, 1), gradient(p, 2), &
                                                        gradient(p, 3), gradient(p, 4), gradient(p, 5), &
                                                        gradient(p, 6), gradient(p, 7), gradient(p, 8), &
                                                        gradient(p, 9))
            change(i) = (volume - column(p, layout%volume))/column(p, layout%mass)
            ! failed material has no plastic work
            column(p, e) = column(p, e) + (viscous(i) + (1.0_wp - failed(i))*plastic(i)) &
                           /column(p, layout%mass) - 0.5_wp*before(i)*change(i)
            pressure = (cold(self%density*self%sound_speed**2, self%grueneisen, self%hugoniot_slope, &
                             1.0_wp - volume*self%density/column(p, layout%mass)) + gain*column(p, e)) &
                       /(1.0_wp + 0.5_wp*gain*change(i))
            ! failed material has no tension: it expands without work
            pressure = merge(max(pressure, 0.0_wp), pressure, failed(i) > 0.0_wp)
            column(p, e) = column(p, e) - 0.5_wp*pressure*change(i)
            mean = (column(p, s) + column(p, s + 1) + column(p, s + 2))/3.0_wp
            column(p, s) = bears_shear*(column(p, s) - mean) - pressure
            column(p, s + 1) = bears_shear*(column(p, s + 1) - mean) - pressure
            column(p, s + 2) = bears_shear*(column(p, s + 2) - mean) - pressure
            change(i) = merge(0.0_wp, change(i), failed(i) > 0.0_wp .and. pressure <= 0.0_wp) ! of a void
         end do
      end associate
      if (self%takes_heat()) call self%warm(column(:, self%johnson_cook%temperature), &
                                            column(:, layout%mass), first, last, change, viscous)
   end subroutine apply_pressure

   !> The temperature after a change of volume and the heat of the viscous pressure: T ds = c dT + Gamma0 rho0
   !> c T dv (theory.md, eq. shock-temperature). That of plastic work has been added.
   pure subroutine warm(self, temperature, mass, first, last, change, heat)
      class(mie_grueneisen_t), intent(in) :: self
      real(wp), intent(inout) :: temperature(:) !< K
      real(wp), intent(in) :: mass(:)           !< kg
      integer, intent(in) :: first, last
      real(wp), intent(in) :: change(:) !< of the volume per mass, m3/kg; from `first` on
      real(wp), intent(in) :: heat(:)   !< J; likewise
      real(wp) :: half
      integer :: p
      do p = first, last
         half = 0.5_wp*self%grueneisen*self%density*change(p - first + 1)
         temperature(p) = temperature(p)*(1.0_wp - half)/(1.0_wp + half) &
                          + heat(p - first + 1)/(self%johnson_cook%specific_heat*mass(p))
      end do
   end subroutine warm

   !> det(I + dt L).
   pure elemental real(wp) function stretched(dt, l11, l21, l31, l12, l22, l32, l13, l23, l33)
      real(wp), intent(in) :: dt, l11, l21, l31, l12, l22, l32, l13, l23, l33
      stretched = (1.0_wp + dt*l11)*((1.0_wp + dt*l22)*(1.0_wp + dt*l33) - dt*l23*dt*l32) &
                  - dt*l12*(dt*l21*(1.0_wp + dt*l33) - dt*l23*dt*l31) &
                  + dt*l13*(dt*l21*dt*l32 - (1.0_wp + dt*l22)*dt*l31)
   end function stretched

   !> Pressure (Pa) without internal energy at eta = 1 - rho0/rho; extended linearly in tension. NaN beyond
   !> the end of the Hugoniot curve (s eta = 1).
   pure elemental real(wp) function cold(stiffness, grueneisen, slope, eta)
      real(wp), intent(in) :: stiffness !< rho0 c0^2, Pa
      real(wp), intent(in) :: grueneisen, slope, eta
      real(wp) :: squeezed, rest
      squeezed = max(eta, 0.0_wp)
      rest = 1.0_wp - slope*squeezed
      rest = merge(rest, not_a_number, rest > 0.0_wp)
      cold = stiffness*eta*(1.0_wp - 0.5_wp*grueneisen*squeezed)/(rest*rest)
   end function cold

   !> Add to the internal energy, also to the heat of shocks, and to the temperature if there is one.
   pure subroutine take_heat(self, values, layout, heat)
      class(mie_grueneisen_t), intent(in) :: self
      real(wp), intent(inout) :: values(:)
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: heat
      values(self%energy) = values(self%energy) + heat/values(layout%mass)
      values(self%heat) = values(self%heat) + heat
      if (self%takes_heat()) call self%johnson_cook%take_heat(values, layout, heat)
   end subroutine take_heat

   !> True with a strength law that has a temperature.
   pure logical function takes_heat(self)
      class(mie_grueneisen_t), intent(in) :: self
      takes_heat = self%strength > of_j2
   end function takes_heat

   !> Shear modulus of the strength law, Pa.
   pure real(wp) function shear(self)
      class(mie_grueneisen_t), intent(in) :: self
      select case (self%strength)
      case (of_none); shear = 0.0_wp
      case (of_j2); shear = self%j2%shear
      case default; shear = self%johnson_cook%shear
      end select
   end function shear

   !> Of the undeformed material.
   pure real(wp) function p_wave_modulus(self)
      class(mie_grueneisen_t), intent(in) :: self
      p_wave_modulus = self%density*self%sound_speed**2 + 4.0_wp/3.0_wp*self%shear()
   end function p_wave_modulus

   !> Of the fastest of the particles in their present state: rho c^2 = (1 - eta)(dp/d eta + Gamma0 p) + 4/3
   !> mu.
   pure real(wp) function squared_speed(self, column, layout, first, last, specific_volume) result(squared)
      class(mie_grueneisen_t), intent(in) :: self
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: first, last
      real(wp), intent(in) :: specific_volume
      real(wp) :: eta, modulus, slope, pressure, rest, rigid
      integer :: p, s
      s = layout%stress
      rigid = 4.0_wp/3.0_wp*self%shear()
      squared = 0.0_wp
      do p = first, last
         eta = 1.0_wp - column(p, layout%volume)*self%density/column(p, layout%mass)
         pressure = -(column(p, s) + column(p, s + 1) + column(p, s + 2))/3.0_wp
         slope = 1.0_wp
         rest = 1.0_wp - self%hugoniot_slope*eta
         if (eta > 0.0_wp) slope = (1.0_wp - self%grueneisen*eta)/rest**2 &
                                   + 2.0_wp*self%hugoniot_slope*eta*(1.0_wp - 0.5_wp*self%grueneisen*eta) &
                                   /rest**3
         modulus = (1.0_wp - eta)*(self%density*self%sound_speed**2*slope + self%grueneisen*pressure)
         squared = max(squared, (max(modulus, 0.0_wp) + rigid)*column(p, layout%volume) &
                                /column(p, layout%mass))
      end do
   end function squared_speed

   !> By the moduli of the undeformed material; without strength of the pressure alone.
   pure real(wp) function complementary_energy(self, stress) result(energy)
      class(mie_grueneisen_t), intent(in) :: self
      real(wp), intent(in) :: stress(6)
      real(wp) :: mean
      mean = (stress(1) + stress(2) + stress(3))/3.0_wp
      energy = 0.5_wp*mean**2/(self%density*self%sound_speed**2)
      if (self%shear() > 0.0_wp) &
         energy = energy + (sum((stress(1:3) - mean)**2) + 2.0_wp*sum(stress(4:6)**2))/(4.0_wp*self%shear())
   end function complementary_energy

   pure real(wp) function von_mises_modulus(self) result(modulus)
      class(mie_grueneisen_t), intent(in) :: self
      modulus = 3.0_wp*self%shear()
   end function von_mises_modulus

   !> Work of the pressure, without the heat of plastic work and shocks, and the energy of the deviator and of
   !> back stresses, J.
   pure real(wp) function strain_energy(self, column, layout, first, last) result(energy)
      class(mie_grueneisen_t), intent(in) :: self
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: first, last
      real(wp) :: mean, squares
      integer :: p, s
      s = layout%stress
      energy = 0.0_wp
      do p = first, last
         energy = energy + column(p, layout%mass)*column(p, self%energy) - column(p, self%heat)
         if (self%strength == of_none) cycle
         energy = energy - column(p, self%work)
         mean = (column(p, s) + column(p, s + 1) + column(p, s + 2))/3.0_wp
         squares = (column(p, s) - mean)**2 + (column(p, s + 1) - mean)**2 + (column(p, s + 2) - mean)**2 &
                   + 2.0_wp*(column(p, s + 3)**2 + column(p, s + 4)**2 + column(p, s + 5)**2)
         energy = energy + column(p, layout%volume)*squares/(4.0_wp*self%shear())
      end do
      if (self%strength == of_j2 .and. self%j2%kinematic%is_used()) &
         energy = energy + self%j2%kinematic%stored(column, layout%volume, first, last)
   end function strain_energy

   pure real(wp) function plastic_energy(self, column, first, last)
      class(mie_grueneisen_t), intent(in) :: self
      real(wp), intent(in), contiguous :: column(:, :)
      integer, intent(in) :: first, last
      plastic_energy = 0.0_wp
      if (self%work > 0) plastic_energy = sum(column(first:last, self%work))
   end function plastic_energy

   pure real(wp) function equivalent_plastic_strain(self, values) result(strain)
      class(mie_grueneisen_t), intent(in) :: self
      real(wp), intent(in) :: values(:)
      strain = 0.0_wp
      if (self%strength == of_j2) strain = self%j2%equivalent_plastic_strain(values)
      if (self%strength > of_j2) strain = self%johnson_cook%equivalent_plastic_strain(values)
   end function equivalent_plastic_strain

   !> By the strength law, huge without tools; without strength the same in all directions.
   pure real(wp) function stretch(self, values, layout, direction)
      class(mie_grueneisen_t), intent(in) :: self
      real(wp), intent(in) :: values(:)
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: direction(3)
      stretch = huge(1.0_wp)
      if (self%strength < of_j2) then
         stretch = (values(layout%volume)*self%density/values(layout%mass))**(1.0_wp/3.0_wp)
      else if (self%strength == of_j2) then
         if (self%j2%shape > 0) stretch = self%j2%stretch(values, layout, direction)
      else
         if (self%johnson_cook%shape > 0) stretch = self%johnson_cook%stretch(values, layout, direction)
      end if
   end function stretch

   pure logical function may_flow(self)
      class(mie_grueneisen_t), intent(in) :: self
      may_flow = .true.
   end function may_flow

end module m_mie_grueneisen
