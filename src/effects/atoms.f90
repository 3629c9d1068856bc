!> A box in which a body is modelled by atoms (theory.md, Atoms): the variables of its group. The step itself
!> is in m_coupling.
module m_atoms
   use m_kinds, only: wp
   use m_bravais, only: bravais_t, lattices
   use m_effect, only: effect_t, hooks_t
   use m_group_reader, only: group_reader_t
   use m_number_text, only: reals_text
   use m_text, only: si
   use m_value_range, only: above, any_value, at_least
   implicit none
   private
   public :: atoms_t

   integer, parameter :: longest_path = 1000
   real(wp), parameter :: usual_stiffness = 100.0_wp !< of the repulsion by tools, in c11
   character(len=6), parameter :: relaxations(2) = ['none  ', 'quench']
   character(len=5), parameter :: meetings(2) = ['stop ', 'go_on']

   type, extends(effect_t) :: atoms_t
      character(len=:), allocatable :: label   !< name of the group, for names of files
      character(len=:), allocatable :: library !< LAMMPS
      type(bravais_t) :: crystal
      real(wp) :: lower(3) = 0.0_wp, upper(3) = 0.0_wp !< m
      real(wp) :: constant = 0.0_wp    !< start value for the lattice constant at rest, m; 0: that of the
                                       !< potential
      real(wp) :: mass = 0.0_wp        !< of an atom, kg; 0: that of the potential
      real(wp) :: step = 2.0e-15_wp    !< longest of the atoms, s
      real(wp) :: drag = 0.0_wp        !< rate at which the atoms' velocities decay, 1/s
      real(wp) :: temperature = 0.0_wp !< K; above 0: maintained by a thermostat
      real(wp) :: thermostat_rate = 1.0e12_wp  !< rate of decay of velocities in its layer, 1/s
      real(wp) :: thermostat_width = -1.0_wp   !< of its layer, m; below 0: two constants
      integer :: seed = 1              !< of random numbers
      integer :: relaxation = 1        !< index in `relaxations`
      integer :: meeting = 1           !< index in `meetings`: the action when a defect reaches the interface
      real(wp) :: tool_stiffness = 0.0_wp !< of the repulsion by tools, N/m2; 0: the usual one
      real(wp) :: tool_distance = -1.0_wp !< distance from a tool at which that begins, m; below 0: the usual
                                          !< one
      real(wp) :: void(3) = 0.0_wp     !< centre of a ball without atoms, m
      real(wp) :: void_radius = 0.0_wp !< m
   contains
      procedure :: variables
      procedure :: hooks
      procedure :: hollow
      procedure :: pad_width
      procedure :: quenches
      procedure :: goes_on
   end type atoms_t

contains

   subroutine variables(self, group)
      class(atoms_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      real(wp) :: near
      logical :: found
      if (.not. allocated(self%label)) self%label = 'atoms'
      if (.not. allocated(self%library)) self%library = 'liblammps.so.0'
      call group%get_name('name', self%label)
      call group%get_text('library', self%library, longest_path)
      call group%get('lower', self%lower, any_value('m'), required=.true.)
      call group%get('upper', self%upper, any_value('m'), required=.true.)
      if (any(self%upper <= self%lower)) &
         call group%refuse('upper', 'must be above lower='//reals_text(self%lower)//' in every direction')
      call self%crystal%potential%variables(group)
      call group%get_choice('lattice', self%crystal%lattice, lattices)
      call group%get('constant', self%constant, above(0.0_wp, 'm'), used=self%constant > 0.0_wp .or. &
                     .not. group%is_writing())
      call group%get('mass', self%mass, above(0.0_wp, 'kg'), used=self%mass > 0.0_wp .or. &
                     .not. group%is_writing())
      call group%get('step', self%step, above(0.0_wp, 's', at_most=1.0e-14_wp))
      call group%get('drag', self%drag, at_least(0.0_wp, '1/s'))
      call group%get('temperature', self%temperature, at_least(0.0_wp, 'K'))
      call group%get('thermostat_rate', self%thermostat_rate, above(0.0_wp, '1/s'))
      call group%get('thermostat_width', self%thermostat_width, above(0.0_wp, 'm'), &
                     used=self%thermostat_width > 0.0_wp .or. .not. group%is_writing())
      call group%get('seed', self%seed, 0)
      call group%get_choice('relaxation', self%relaxation, relaxations)
      if (self%quenches() .and. self%temperature > 0.0_wp) &
         call group%refuse('temperature', 'does not go with relaxation=''quench''; allowed with it: 0')
      call group%get_choice('at_interface', self%meeting, meetings)
      call group%get('tool_stiffness', self%tool_stiffness, above(0.0_wp, 'N/m2'), &
                     used=self%tool_stiffness > 0.0_wp .or. .not. group%is_writing())
      call group%get('tool_distance', self%tool_distance, at_least(0.0_wp, 'm'), &
                     used=self%tool_distance >= 0.0_wp .or. .not. group%is_writing())
      call group%get('void_center', self%void, any_value('m'), used=self%void_radius > 0.0_wp .or. &
                     .not. group%is_writing())
      call group%get('void_radius', self%void_radius, at_least(0.0_wp, 'm'))
      if (.not. group%is_reading() .or. .not. self%crystal%potential%good) return
      if (self%crystal%lattice < 1) return
      if (.not. self%mass > 0.0_wp) self%mass = self%crystal%potential%mass
      if (.not. self%mass > 0.0_wp) &
         call group%refuse('mass', 'missing: the potential does not give it; allowed: a number above '// &
                           '0, in kg')
      near = self%constant
      if (.not. near > 0.0_wp) near = self%crystal%potential%nominal
      found = near > 0.0_wp
      if (found) call self%crystal%find_rest(near, found)
      if (.not. found) call group%refuse('constant', 'has no stable stress-free lattice within 15 % of '// &
                                         si(near, 'm')//'; allowed: a constant near one at which '// &
                                         trim(lattices(self%crystal%lattice))//' is free of stress')
      if (.not. found) return
      if (.not. self%tool_stiffness > 0.0_wp) self%tool_stiffness = usual_stiffness*self%crystal%c11
      if (self%thermostat_width < 0.0_wp) self%thermostat_width = 2.0_wp*self%crystal%constant
      if (self%tool_distance < 0.0_wp) self%tool_distance = self%crystal%surface_depth()
   end subroutine variables

   !> True when the atoms' motion is damped so that they follow loads quasi-statically.
   pure logical function quenches(self)
      class(atoms_t), intent(in) :: self
      quenches = self%relaxation == 2
   end function quenches

   !> True when the run continues after a defect has reached the interface.
   pure logical function goes_on(self)
      class(atoms_t), intent(in) :: self
      goes_on = self%meeting == 2
   end function goes_on

   pure type(hooks_t) function hooks(self)
      class(atoms_t), intent(in) :: self
      hooks = hooks_t()
   end function hooks

   !> Width of the pads around the box, m: a bond's length, and another one where the electron density needs
   !> it.
   pure real(wp) function pad_width(self)
      class(atoms_t), intent(in) :: self
      pad_width = merge(2.2_wp, 1.15_wp, self%crystal%potential%embeds)*self%crystal%potential%cutoff
   end function pad_width

   !> The box is not part of the continuum.
   pure subroutine hollow(self, lower, upper, there_is)
      class(atoms_t), intent(in) :: self
      real(wp), intent(out) :: lower(3), upper(3) !< m
      logical, intent(out) :: there_is
      there_is = .true.
      lower = self%lower
      upper = self%upper
   end subroutine hollow

end module m_atoms
