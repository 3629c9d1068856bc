!> Drucker and Prager's plasticity for granular and brittle bodies: friction, cohesion, dilation, and a cap
!> against crushing (theory.md, eqs drucker-prager, cap).
module m_drucker_prager
   use m_kinds, only: wp
   use m_constants, only: pi
   use m_text, only: to_text
   use m_group_reader, only: group_reader_t
   use m_value_range, only: above, at_least
   use m_field_table, only: field_table_t, layout_t
   use m_elastic, only: elastic_t
   use m_plastic, only: follow_shape, shape_stretch, von_mises
   implicit none
   private
   public :: drucker_prager_t

   !> In p (pressure) and q (von Mises stress): q <= a + b p on the cone, which is that of Mohr and Coulomb in
   !> triaxial compression; an ellipse beyond the pressure at which the cap begins.
   type, extends(elastic_t) :: drucker_prager_t
      real(wp) :: friction_angle = 0.0_wp  !< degrees
      real(wp) :: cohesion = 0.0_wp        !< Pa
      real(wp) :: dilation_angle = 0.0_wp  !< degrees
      real(wp) :: cap_pressure = 0.0_wp    !< initial yield pressure in isotropic compression, Pa; 0: no cap
      real(wp) :: cap_ratio = 1.0_wp       !< axis of the ellipse along p over that along q
      real(wp) :: cap_hardening = 0.0_wp   !< increase of cap_pressure over compaction, Pa
      real(wp) :: a = 0.0_wp, b = 0.0_wp   !< of the cone, Pa; 1
      real(wp) :: dilation = 0.0_wp        !< b of the potential
      integer :: strain = 0     !< column of the equivalent plastic strain of the deviator
      integer :: work = 0       !< column of the plastic work, J
      integer :: compaction = 0 !< column of the compaction of the cap, logarithm of volume
      integer :: opening = 0    !< column of the opening between separated grains, likewise
      integer :: shape = 0      !< first column of the left Cauchy-Green tensor; 0 without tools
   contains
      procedure :: variables
      procedure :: declare
      procedure :: initial
      procedure :: update
      procedure :: plastic_energy
      procedure :: equivalent_plastic_strain
      procedure :: may_flow
      procedure :: stretch
      procedure :: for_large_strains
      procedure :: default_effect
      procedure, private :: return_one
      procedure, private :: return_to_cone
      procedure, private :: return_to_cap
      procedure, private :: cap_begins
   end type drucker_prager_t

contains

   subroutine variables(self, group)
      class(drucker_prager_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      logical :: caps
      call self%elastic_variables(group)
      call group%get('friction_angle', self%friction_angle, at_least(0.0_wp, 'degrees', below=90.0_wp), &
                     required=.true.)
      call group%get('cohesion', self%cohesion, at_least(0.0_wp, 'Pa'), required=.true.)
      call group%get('dilation_angle', self%dilation_angle, at_least(0.0_wp, 'degrees', below=90.0_wp))
      call group%get('cap_pressure', self%cap_pressure, at_least(0.0_wp, 'Pa'))
      caps = self%cap_pressure > 0.0_wp
      call group%get('cap_ratio', self%cap_ratio, above(0.0_wp, ''), used=caps)
      call group%get('cap_hardening', self%cap_hardening, at_least(0.0_wp, 'Pa'), used=caps)
      if (self%dilation_angle > self%friction_angle) &
         call group%refuse('dilation_angle', 'must be at most friction_angle')
      if (.not. (self%friction_angle > 0.0_wp .or. self%cohesion > 0.0_wp)) &
         call group%refuse('cohesion', 'must be above 0 where friction_angle is 0')
      self%b = slope(self%friction_angle)
      self%a = self%cohesion*self%b/max(tan(self%friction_angle*pi/180.0_wp), tiny(1.0_wp))
      if (.not. self%friction_angle > 0.0_wp) self%a = 2.0_wp*self%cohesion
      self%dilation = slope(self%dilation_angle)
      if (caps .and. self%cap_pressure <= self%cap_ratio*self%a) &
         call group%refuse('cap_pressure', 'must be 0, or above cap_ratio times the von Mises stress '// &
                           'that cohesion alone bears, '// &
                           to_text(self%cap_ratio*self%a, 4)//' Pa')
   contains
      !> 6 sin/(3 - sin).
      real(wp) function slope(angle)
         real(wp), intent(in) :: angle
         slope = 6.0_wp*sin(angle*pi/180.0_wp)/(3.0_wp - sin(angle*pi/180.0_wp))
      end function slope
   end subroutine variables

   pure logical function for_large_strains(self)
      class(drucker_prager_t), intent(in) :: self
      for_large_strains = .true.
   end function for_large_strains

   pure function default_effect(self) result(name)
      class(drucker_prager_t), intent(in) :: self
      character(len=:), allocatable :: name
      name = 'anti_locking'
   end function default_effect

   pure subroutine declare(self, table, has_tools)
      class(drucker_prager_t), intent(inout) :: self
      type(field_table_t), intent(inout) :: table
      logical, intent(in) :: has_tools
      call table%declare('plastic_strain', 1, '1', written=.true.)
      call table%declare('plastic_work', 1, 'J', written=.false., extensive=.true.)
      call table%declare('compaction', 1, '1', written=.true.)
      call table%declare('opening', 1, '1', written=.true.)
      self%strain = table%column('plastic_strain')
      self%work = table%column('plastic_work')
      self%compaction = table%column('compaction')
      self%opening = table%column('opening')
      if (.not. has_tools) return
      call table%declare('left_cauchy_green', 6, '1', written=.false.)
      self%shape = table%column('left_cauchy_green')
   end subroutine declare

   pure subroutine initial(self, column, layout, first, last)
      class(drucker_prager_t), intent(in) :: self
      real(wp), intent(inout), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: first, last
      if (self%shape > 0) column(first:last, self%shape:self%shape + 2) = 1.0_wp
   end subroutine initial

   !> Elastic trial step, then the return of stresses outside the yield surface.
   pure subroutine update(self, column, layout, gradient, time_step, first, last)
      class(drucker_prager_t), intent(in) :: self
      real(wp), intent(inout), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      real(wp), intent(in), contiguous :: gradient(:, :)
      real(wp), intent(in) :: time_step
      integer, intent(in) :: first, last
      integer :: p
      call self%elastic_t%update(column, layout, gradient, time_step, first, last)
      if (self%shape > 0) call follow_shape(self%shape, column, gradient, time_step, first, last)
      do p = first, last
         call self%return_one(column, layout, p)
      end do
   end subroutine update

   !> Return of one particle: p and q to the yield surface, along the deviator.
   pure subroutine return_one(self, column, layout, p)
      class(drucker_prager_t), intent(in) :: self
      real(wp), intent(inout), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: p
      real(wp) :: pressure, trial(2), ends(2), bulk, squeezed, sheared, share
      integer :: s
      s = layout%stress
      bulk = self%lame + 2.0_wp*self%shear/3.0_wp
      pressure = -(column(p, s) + column(p, s + 1) + column(p, s + 2))/3.0_wp
      trial = [pressure, von_mises(column(p, s), column(p, s + 1), column(p, s + 2), column(p, s + 3), &
                                   column(p, s + 4), column(p, s + 5))]
      ! separated grains without cohesion bear no stress until they touch again
      if (.not. self%cohesion > 0.0_wp) trial(1) = trial(1) - bulk*column(p, self%opening)
      ends = trial
      if (self%cap_pressure > 0.0_wp .and. trial(1) > self%cap_begins(column(p, self%compaction))) then
         call self%return_to_cap(column(p, self%compaction), ends)
      else
         call self%return_to_cone(column(p, self%compaction), ends)
      end if
      squeezed = (trial(1) - ends(1))/bulk
      sheared = (trial(2) - ends(2))/(3.0_wp*self%shear)
      if (.not. self%cohesion > 0.0_wp) then
         column(p, self%opening) = 0.0_wp
         if (ends(1) <= 0.0_wp) column(p, self%opening) = max(0.0_wp, -squeezed)
      end if
      if (abs(ends(1) - pressure) <= 0.0_wp .and. .not. sheared > 0.0_wp) return
      if (trial(1) > ends(1)) column(p, self%compaction) = column(p, self%compaction) + squeezed
      column(p, self%strain) = column(p, self%strain) + sheared
      column(p, self%work) = column(p, self%work) + column(p, layout%volume) &
                             *(ends(1)*squeezed + ends(2)*sheared)
      share = 0.0_wp
      if (trial(2) > 0.0_wp) share = ends(2)/trial(2)
      column(p, s:s + 2) = share*(column(p, s:s + 2) + pressure) - ends(1)
      column(p, s + 3:s + 5) = share*column(p, s + 3:s + 5)
      ! correct for stored energy that grows with the volume without work
      column(p, self%work) = column(p, self%work) + squeezed*self%strain_energy(column, layout, p, p)
   end subroutine return_one

   !> Return to the cone along its potential, q - dilation p; to its apex where q would be negative; not
   !> beyond the corner with the cap.
   pure subroutine return_to_cone(self, compaction, ends)
      class(drucker_prager_t), intent(in) :: self
      real(wp), intent(in) :: compaction
      real(wp), intent(inout) :: ends(2) !< p, q (Pa): trial, returned
      real(wp) :: beyond, flow, bulk, corner
      bulk = self%lame + 2.0_wp*self%shear/3.0_wp
      beyond = ends(2) - self%a - self%b*ends(1)
      if (.not. beyond > 0.0_wp) return
      flow = beyond/(3.0_wp*self%shear + bulk*self%b*self%dilation)
      if (ends(2) - 3.0_wp*self%shear*flow < 0.0_wp) then
         ends = [-self%a/self%b, 0.0_wp]
         return
      end if
      ends = ends + flow*[bulk*self%dilation, -3.0_wp*self%shear]
      if (.not. self%cap_pressure > 0.0_wp) return
      corner = self%cap_begins(compaction)
      if (ends(1) > corner) ends = [corner, self%a + self%b*corner]
   end subroutine return_to_cone

   !> Return to the cap along its normal. The distance to the ellipse decreases with the step's compaction e,
   !> between 0 and the value at which p reaches the beginning of the cap; its zero is found by false position
   !> (Illinois).
   pure subroutine return_to_cap(self, compaction, ends)
      class(drucker_prager_t), intent(in) :: self
      real(wp), intent(in) :: compaction
      real(wp), intent(inout) :: ends(2) !< p, q (Pa): trial, returned
      real(wp), parameter :: close_enough = 1.0e-13_wp
      integer, parameter :: iteration_limit = 200
      real(wp) :: trial(2), e(2), off(2), middle, now, bulk
      integer :: iteration, side, last
      bulk = self%lame + 2.0_wp*self%shear/3.0_wp
      trial = ends
      call find_distance(0.0_wp, ends, off(1))
      if (.not. off(1) > 0.0_wp) then
         ends = trial
         return
      end if
      e = [0.0_wp, (trial(1) - self%cap_begins(compaction))/bulk]
      ! there q = 0 and p is at most the beginning of the cap: inside
      off(2) = -1.0_wp
      last = 0
      do iteration = 1, iteration_limit
         middle = (e(1)*off(2) - e(2)*off(1))/(off(2) - off(1))
         call find_distance(middle, ends, now)
         if (abs(now) <= close_enough .or. e(2) - e(1) <= close_enough*e(2)) exit
         side = merge(1, 2, now > 0.0_wp)
         if (side == last) off(3 - side) = 0.5_wp*off(3 - side)
         e(side) = middle
         off(side) = now
         last = side
      end do
   contains
      !> Distance from the ellipse, relative to its size, after compaction by `grown`, with p and q there.
      pure subroutine find_distance(grown, at, distance)
         real(wp), intent(in) :: grown
         real(wp), intent(out) :: at(2), distance
         real(wp) :: begin, axis, x
         begin = self%cap_begins(compaction + grown)
         axis = self%cap_ratio*(self%a + self%b*begin)
         at(1) = trial(1) - bulk*grown
         x = grown/max(at(1) - begin, 1.0e-14_wp*axis)
         at(2) = trial(2)/(1.0_wp + 3.0_wp*self%shear*self%cap_ratio**2*x)
         distance = sqrt(max(at(1) - begin, 0.0_wp)**2 + (self%cap_ratio*at(2))**2)/axis - 1.0_wp
      end subroutine find_distance
   end subroutine return_to_cap

   !> Pressure at which cone and cap meet, Pa.
   pure real(wp) function cap_begins(self, compaction) result(begin)
      class(drucker_prager_t), intent(in) :: self
      real(wp), intent(in) :: compaction
      begin = (self%cap_pressure + self%cap_hardening*compaction - self%cap_ratio*self%a) &
              /(1.0_wp + self%cap_ratio*self%b)
   end function cap_begins

   pure real(wp) function plastic_energy(self, column, first, last)
      class(drucker_prager_t), intent(in) :: self
      real(wp), intent(in), contiguous :: column(:, :)
      integer, intent(in) :: first, last
      plastic_energy = sum(column(first:last, self%work))
   end function plastic_energy

   pure real(wp) function equivalent_plastic_strain(self, values) result(strain)
      class(drucker_prager_t), intent(in) :: self
      real(wp), intent(in) :: values(:)
      strain = values(self%strain)
   end function equivalent_plastic_strain

   !> sqrt(n . b . n); huge without tools.
   pure real(wp) function stretch(self, values, layout, direction)
      class(drucker_prager_t), intent(in) :: self
      real(wp), intent(in) :: values(:)
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: direction(3)
      stretch = huge(1.0_wp)
      if (self%shape > 0) stretch = shape_stretch(values(self%shape:self%shape + 5), direction)
   end function stretch

   pure logical function may_flow(self)
      class(drucker_prager_t), intent(in) :: self
      may_flow = .true.
   end function may_flow

end module m_drucker_prager
