!> Damage and failure: Johnson and Cook's criterion (1985), and a maximum tension. Failed material bears
!> neither tension nor shear (theory.md, eqs damage, failed).
module m_damage
   use m_kinds, only: wp, i8
   use m_constants, only: exit_input
   use m_errors, only: error_t, fail
   use m_text, only: to_text, si
   use m_group_reader, only: group_reader_t
   use m_value_range, only: above, any_value, at_least
   use m_communicator, only: communicator_t
   use m_kinematic, only: max_back
   use m_field_table, only: field_table_t, layout_t
   use m_grid_level, only: grid_level_t
   use m_particle_store, only: particle_store_t
   use m_elastic, only: elastic_t
   use m_material, only: failure_t
   use m_scene_materials, only: materials_t
   use m_level, only: level_t
   use m_effect, only: effect_t, hooks_t
   use m_section, only: section_t
   implicit none
   private
   public :: damage_t

   real(wp), parameter :: max_triaxiality = 1.0e3_wp !< mean over von Mises stress: limit above which shear is
                                                     !< negligible

   !> Data of a body's material.
   type :: stuff_t
      type(failure_t) :: failure
      type(elastic_t) :: elastic     !< its moduli, for the energy of a stress
   end type stuff_t

   type, extends(effect_t) :: damage_t
      real(wp) :: constants(5) = 0.0_wp         !< D1 to D5
      real(wp) :: reference_rate = 1.0_wp       !< 1/s
      real(wp) :: tension_limit = 0.0_wp        !< of the mean stress, Pa; 0: none
      logical :: erode = .false.                !< failed particles are removed
      type(stuff_t), allocatable :: stuff(:)    !< of each body
      integer :: damage = 0, strain = 0, tension = 0, lost = 0, worked = 0 !< columns
      integer :: plastic = 0, work = 0, temperature = 0 !< columns of the laws; 0 if absent
      integer :: back(max_back) = 0 !< first columns of back stresses; likewise
   contains
      procedure :: take_section
      procedure :: variables
      procedure :: hooks
      procedure :: declare
      procedure :: prepare
      procedure :: verify
      procedure :: on_stress
      procedure :: dissipated
      procedure :: summary
      procedure, private :: grow
      procedure, private :: relieve
      procedure, private :: give_up
      procedure, private :: has_strain_to_failure
   end type damage_t

contains

   subroutine variables(self, group)
      class(damage_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      call group%get('constants', self%constants, any_value(''))
      call group%get('reference_rate', self%reference_rate, above(0.0_wp, '1/s'))
      call group%get('tension_limit', self%tension_limit, at_least(0.0_wp, 'Pa'))
      call group%get('erode', self%erode)
      if (.not. (self%has_strain_to_failure() .or. self%tension_limit > 0.0_wp)) &
         call group%refuse('constants', 'missing; one of constants and tension_limit must be there')
   end subroutine variables

   pure type(hooks_t) function hooks(self)
      class(damage_t), intent(in) :: self
      hooks = hooks_t(on_stress=.true., erodes=self%erode)
   end function hooks

   pure logical function has_strain_to_failure(self)
      class(damage_t), intent(in) :: self
      has_strain_to_failure = any(abs(self%constants(:3)) > 0.0_wp)
   end function has_strain_to_failure

   !> The damage, 1 for a failed particle; the plastic strain up to which it has been counted; the tension
   !> still to be recovered, Pa; the energy of the stress that was lost, and the plastic work at failure, J.
   subroutine declare(self, table)
      class(damage_t), intent(inout) :: self
      type(field_table_t), intent(inout) :: table
      integer :: k
      self%plastic = table%column('plastic_strain')
      self%temperature = table%column('temperature')
      self%work = table%column('plastic_work')
      call table%declare('damage', 1, '1', written=.true.)
      call table%declare('damage_strain', 1, '1', written=.false.)
      call table%declare('lost_tension', 1, 'Pa', written=.false.)
      call table%declare('failure_energy', 1, 'J', written=.false., extensive=.true.)
      if (self%work > 0) call table%declare('work_before_failure', 1, 'J', written=.false., extensive=.true.)
      self%worked = table%column('work_before_failure')
      self%damage = table%column('damage')
      self%strain = table%column('damage_strain')
      self%tension = table%column('lost_tension')
      self%lost = table%column('failure_energy')
      do k = 1, size(self%back)
         self%back(k) = table%column('back_stress_'//to_text(k))
      end do
   end subroutine declare

   !> Collect the laws' data on failure.
   subroutine prepare(self, grid, materials)
      class(damage_t), intent(inout) :: self
      type(grid_level_t), intent(in) :: grid
      type(materials_t), intent(in) :: materials
      integer :: b
      allocate (self%stuff(size(materials%of_body)))
      do b = 1, size(self%stuff)
         associate (stuff => self%stuff(b))
            stuff%failure = materials%slots(materials%of_body(b))%law%failure()
            stuff%elastic%lame = stuff%failure%lame
            stuff%elastic%shear = stuff%failure%shear
         end associate
      end do
   end subroutine prepare

   !> At least one body's law must support failure.
   subroutine verify(self, communicator, levels, tools, error)
      class(damage_t), intent(in) :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(in) :: levels(:)
      integer, intent(in) :: tools
      type(error_t), intent(inout) :: error
      if (.not. any(self%stuff%failure%acts)) &
         call fail(error, exit_input, self%group_text()// &
                   ': no body has a law that supports failure; allowed: elastic, '// &
                   'j2, johnson_cook, norton, drucker_prager, mie_grueneisen')
      if (self%has_strain_to_failure() .and. self%plastic == 0) &
         call fail(error, exit_input, self%group_text()// &
                   ' constants: no body has a law of plastic flow; allowed: with one that has')
   end subroutine verify

   !> Damage grows by the stress just computed by the law; failed particles lose tension and shear.
   pure subroutine on_stress(self, particles, layout, gradient, cell, time_step)
      class(damage_t), intent(in) :: self
      type(particle_store_t), intent(inout) :: particles
      type(layout_t), intent(in) :: layout
      real(wp), intent(in), contiguous :: gradient(:, :)
      real(wp), intent(in) :: cell, time_step
      integer :: p
      do p = 1, particles%count
         if (.not. self%stuff(particles%body(p))%failure%acts) cycle
         associate (stuff => self%stuff(particles%body(p)), column => particles%column)
            if (column(p, self%damage) >= 1.0_wp) then
               call self%relieve(stuff, column, p, layout)
               ! plastic flow of a deviator that was removed: no work
               if (self%plastic > 0) column(p, self%plastic) = column(p, self%strain)
               if (self%work > 0) column(p, self%work) = column(p, self%worked)
            else
               call self%grow(stuff, column, p, layout, time_step)
               if (column(p, self%damage) >= 1.0_wp) call self%give_up(stuff, column, p, layout)
            end if
         end associate
      end do
   end subroutine on_stress

   !> D <- D + d/e_f with the increment d of plastic strain; 1 at once where the mean stress reaches the
   !> maximum tension. With &anti_locking the mean stress is that of the cell.
   pure subroutine grow(self, stuff, column, p, layout, time_step)
      class(damage_t), intent(in) :: self
      type(stuff_t), intent(in) :: stuff
      real(wp), intent(inout), contiguous :: column(:, :)
      integer, intent(in) :: p
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: time_step
      real(wp) :: mean, acting, mises, triaxiality, grown, warmth, ductility
      integer :: s
      s = layout%stress
      mean = (column(p, s) + column(p, s + 1) + column(p, s + 2))/3.0_wp
      acting = mean
      if (layout%pressure_shift > 0) acting = mean - column(p, layout%pressure_shift)
      if (self%tension_limit > 0.0_wp .and. acting >= self%tension_limit) column(p, self%damage) = 1.0_wp
      if (self%plastic == 0 .or. .not. self%has_strain_to_failure()) return
      grown = column(p, self%plastic) - column(p, self%strain)
      column(p, self%strain) = column(p, self%plastic)
      if (.not. grown > 0.0_wp) return
      mises = sqrt(1.5_wp*((column(p, s) - mean)**2 + (column(p, s + 1) - mean)**2 &
                           + (column(p, s + 2) - mean)**2) &
                   + 3.0_wp*(column(p, s + 3)**2 + column(p, s + 4)**2 + column(p, s + 5)**2))
      associate (d => self%constants)
         triaxiality = acting/max(mises, abs(acting)/max_triaxiality, tiny(mises))
         ductility = d(1) + d(2)*exp(min(d(3)*triaxiality, 300.0_wp))
         ductility = ductility*(1.0_wp + d(4)*log(max(1.0_wp, grown/(time_step*self%reference_rate))))
         warmth = 0.0_wp
         if (stuff%failure%warms) &
            warmth = min(max((column(p, self%temperature) - stuff%failure%room) &
                             /(stuff%failure%melting - stuff%failure%room), 0.0_wp), 1.0_wp)
         ductility = ductility*(1.0_wp + d(5)*warmth)
      end associate
      if (ductility <= grown) then ! also where the failure strain is not positive
         column(p, self%damage) = 1.0_wp
      else
         column(p, self%damage) = min(1.0_wp, column(p, self%damage) + grown/ductility)
      end if
   end subroutine grow

   !> A particle fails: the energy of the lost stress is recorded, plastic strain and work are kept.
   pure subroutine give_up(self, stuff, column, p, layout)
      class(damage_t), intent(in) :: self
      type(stuff_t), intent(in) :: stuff
      real(wp), intent(inout), contiguous :: column(:, :)
      integer, intent(in) :: p
      type(layout_t), intent(in) :: layout
      real(wp) :: before
      before = energy_of(self, stuff, column, p, layout)
      call self%relieve(stuff, column, p, layout)
      column(p, self%lost) = column(p, self%lost) + before - energy_of(self, stuff, column, p, layout)
      if (self%plastic > 0) column(p, self%strain) = column(p, self%plastic)
      if (self%work > 0) column(p, self%worked) = column(p, self%work)
   end subroutine give_up

   !> Remove the deviator, back stresses and any tension. Where a law integrates the pressure from rates,
   !> removed tension is remembered: it must be recovered before pressure returns, so that opened cracks must
   !> close first.
   pure subroutine relieve(self, stuff, column, p, layout)
      class(damage_t), intent(in) :: self
      type(stuff_t), intent(in) :: stuff
      real(wp), intent(inout), contiguous :: column(:, :)
      integer, intent(in) :: p
      type(layout_t), intent(in) :: layout
      real(wp) :: mean
      integer :: k, s
      s = layout%stress
      mean = (column(p, s) + column(p, s + 1) + column(p, s + 2))/3.0_wp
      if (stuff%failure%by_volume) then
         mean = min(mean, 0.0_wp)
      else
         mean = mean + column(p, self%tension)
         column(p, self%tension) = max(mean, 0.0_wp)
         mean = min(mean, 0.0_wp)
      end if
      column(p, s:s + 2) = mean
      column(p, s + 3:s + 5) = 0.0_wp
      if (allocated(stuff%failure%back)) then
         do k = 1, size(stuff%failure%back)
            column(p, self%back(k):self%back(k) + 5) = 0.0_wp
         end do
      end if
      ! the cell's mean must not be tensile either
      if (layout%pressure_shift > 0) &
         column(p, layout%pressure_shift) = max(column(p, layout%pressure_shift), mean)
   end subroutine relieve

   !> Energy of the present stress and back stresses by the law's moduli, J.
   pure real(wp) function energy_of(self, stuff, column, p, layout) result(energy)
      class(damage_t), intent(in) :: self
      type(stuff_t), intent(in) :: stuff
      real(wp), intent(in), contiguous :: column(:, :)
      integer, intent(in) :: p
      type(layout_t), intent(in) :: layout
      real(wp) :: mean
      integer :: k, s
      s = layout%stress
      if (.not. stuff%failure%by_volume) then
         energy = stuff%elastic%strain_energy(column, layout, p, p)
      else if (stuff%elastic%shear > 0.0_wp) then ! only that of the deviator is lost
         mean = (column(p, s) + column(p, s + 1) + column(p, s + 2))/3.0_wp
         energy = column(p, layout%volume)/(4.0_wp*stuff%elastic%shear) &
                  *((column(p, s) - mean)**2 + (column(p, s + 1) - mean)**2 + (column(p, s + 2) - mean)**2 &
                    + 2.0_wp*(column(p, s + 3)**2 + column(p, s + 4)**2 + column(p, s + 5)**2))
      else
         energy = 0.0_wp
      end if
      if (.not. allocated(stuff%failure%back)) return
      do k = 1, size(stuff%failure%back)
         associate (back => column(p, self%back(k):self%back(k) + 5))
            energy = energy + 0.75_wp*column(p, layout%volume)/stuff%failure%back(k) &
                     *(sum(back(:3)**2) + 2.0_wp*sum(back(4:)**2))
         end associate
      end do
   end function energy_of

   !> Energy of the stresses lost so far, J.
   pure real(wp) function dissipated(self, column, first, last)
      class(damage_t), intent(in) :: self
      real(wp), intent(in), contiguous :: column(:, :)
      integer, intent(in) :: first, last
      dissipated = sum(column(first:last, self%lost))
   end function dissipated

   !> Collective: number and mass of failed particles.
   function summary(self, communicator, levels) result(text)
      class(damage_t), intent(in) :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(in) :: levels(:)
      character(len=:), allocatable :: text
      real(wp) :: mass
      integer(i8) :: failed
      integer :: b, l
      failed = 0
      mass = 0.0_wp
      do l = 1, size(levels)
         do b = 1, size(levels(l)%blocks)
            associate (particles => levels(l)%blocks(b)%particles)
               failed = failed + count(particles%column(:particles%count, self%damage) >= 1.0_wp)
               mass = mass + sum(particles%column(:particles%count, levels(l)%layout%mass), &
                                 mask=particles%column(:particles%count, self%damage) >= 1.0_wp)
            end associate
         end do
      end do
      text = ''
      if (self%erode) return ! they have been removed
      text = 'damage: '//to_text(communicator%sum_count(failed))//' particles have failed, '// &
             si(1000.0_wp*communicator%sum_real(mass), 'g')
   end function summary

   !> The same in any section.
   subroutine take_section(self, section, why)
      class(damage_t), intent(inout) :: self
      type(section_t), intent(in) :: section
      character(len=:), allocatable, intent(out) :: why
      why = ''
   end subroutine take_section

end module m_damage
