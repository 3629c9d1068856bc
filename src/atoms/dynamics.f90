!> The atoms of a box, which LAMMPS moves: real atoms in the box, and pads in the continuum around it, which
!> go with that. One rank has them. Places and forces are in SI units, LAMMPS's in its `metal` units.
module m_dynamics
   use, intrinsic :: iso_c_binding, only: c_double, c_f_pointer, c_funloc, c_funptr, c_int, c_int64_t, &
      c_loc, c_ptr
   use mpi_f08, only: MPI_COMM_SELF
   use m_kinds, only: wp
   use m_atoms, only: atoms_t
   use m_bath, only: bath_t, thermal_speeds
   use m_bonds, only: bonds_t
   use m_interface_mesh, only: interface_mesh_t
   use m_lammps, only: lammps_t
   use m_lammps_potential, only: set_potential
   use m_lattice_sites, only: fill_lattice
   use m_node_patch, only: node_patch_t
   use m_potential_file, only: joule_per_ev
   use m_relaxation, only: relaxation_t
   use m_shape, only: shape_t
   use m_tool_repulsion, only: tool_repulsion_t
   use m_text, only: exact_text
   implicit none
   private

   real(wp), parameter :: angstrom = 1.0e-10_wp, metre_a_second = 1.0e-2_wp !< in m; in angstrom/ps
   real(wp), parameter :: mvv2e = 1.0364269e-4_wp !< LAMMPS's: eV of 1 g/mol (angstrom/ps)^2
   real(wp), parameter :: kg_of_mass = mvv2e*joule_per_ev*1.0e-4_wp !< of 1 g/mol, as LAMMPS moves it
   real(wp), parameter :: skin = 1.0_wp  !< of neighbour lists, angstrom
   real(wp), parameter :: margin = 30.0_wp !< angstrom, in which atoms may leave the first box around all
   real(wp), parameter :: boltzmann = 1.380649e-23_wp !< J/K

   type, public :: dynamics_t
      type(lammps_t) :: lammps
      type(bonds_t) :: bonds
      type(interface_mesh_t) :: mesh                 !< that bonds push
      integer :: real_atoms = 0, atoms = 0
      real(wp) :: mass = 0.0_wp                      !< of an atom, kg, as LAMMPS moves it
      real(wp), allocatable :: x(:, :)               !< (3, atoms), m: real ones first
      real(wp), allocatable :: force(:, :), place(:, :) !< of the bonds now: on the continuum, N; where, m
      real(wp) :: first_potential = 0.0_wp           !< J
      real(wp), allocatable :: pad_speed(:, :)       !< (3, pads and corners of the mesh) as nodes
                                                     !< without contact have it, m/s
      real(wp), allocatable :: pad_push(:, :)        !< (the same) what contact added in the last step, m/s
      type(atoms_t) :: spec
      type(node_patch_t), pointer :: patch => null() !< that takes the impulses of the steps that go on
      type(tool_repulsion_t) :: repulsion            !< of tools
      integer :: steps = 0, done = 0                 !< of them
      logical :: anew = .false.                      !< the forces at the start of these are found anew
      type(relaxation_t) :: relaxation
      type(bath_t) :: bath                           !< drag and thermostat
      logical, allocatable :: sound(:)               !< (real atoms) those that had the lattice's neighbours
      integer :: missed = 0                          !< bonds that no node with mass is near to
      real(wp) :: time_step = 0.0_wp                 !< of atoms, s
   contains
      procedure :: create
      procedure :: advance
      procedure :: pad_velocities
      procedure :: set_velocities
      procedure :: kinetic
      procedure :: potential
      procedure :: potential_change
      procedure :: disorder
      procedure :: temperature
      procedure :: momentum
      procedure :: place_all
      procedure :: largest_force
      procedure :: get_motion
      procedure :: set_motion
   end type dynamics_t

contains

   !> All atoms of the lattice within a body. `complaint`: what is wrong; empty: nothing.
   subroutine create(self, spec, body, lower, upper, width, complaint)
      class(dynamics_t), intent(inout) :: self
      type(atoms_t), intent(in) :: spec
      class(shape_t), intent(in) :: body         !< with nothing cut out of it
      real(wp), intent(in) :: lower(3), upper(3) !< of the box, within the body, m
      real(wp), intent(in) :: width              !< of the particles around it, m
      character(len=:), allocatable, intent(out) :: complaint
      real(wp), allocatable :: places(:, :)
      self%spec = spec
      call self%lammps%load(spec%library, complaint)
      if (complaint /= '') return
      call fill_lattice(spec, body, lower, upper, places, self%real_atoms)
      self%atoms = size(places, 2)
      self%x = places
      self%mass = spec%mass
      call self%bonds%build(places, self%real_atoms, spec%crystal%potential, lower, upper, &
                            nearest(spec%crystal%neighbours))
      allocate (self%force(3, size(self%bonds%share)), self%place(3, size(self%bonds%share)), source=0.0_wp)
      call self%mesh%build(lower, upper, width)
      call self%mesh%settle(self%bonds%crossings(places), lower, upper)
      associate (followers => self%atoms - self%real_atoms + size(self%mesh%x, 2))
         allocate (self%pad_speed(3, followers), self%pad_push(3, followers), source=0.0_wp)
      end associate
      call self%bath%build(spec, body, places(:, :self%real_atoms), lower, upper)
      call begin(self, complaint)
   contains
      pure real(wp) function nearest(vectors)
         real(wp), intent(in) :: vectors(:, :)
         nearest = sqrt(minval(sum(vectors**2, 1)))
      end function nearest
   end subroutine create

   !> LAMMPS with these atoms, at rest, and the forces.
   subroutine begin(self, complaint)
      type(dynamics_t), intent(inout), target :: self
      character(len=:), allocatable, intent(out) :: complaint
      real(wp) :: low(3), high(3)
      integer, allocatable :: types(:)
      type(c_funptr) :: at
      complaint = ''
      at = c_funloc(forces_known)
      low = minval(self%x, 2)/angstrom - margin
      high = maxval(self%x, 2)/angstrom + margin
      associate (lmp => self%lammps, potential => self%spec%crystal%potential)
         call lmp%start(MPI_COMM_SELF)
         call lmp%command('units metal')
         call lmp%command('atom_style atomic')
         call lmp%command('atom_modify map array sort 0 0.0')
         call lmp%command('boundary f f f')
         call lmp%command('region all block '//exact_text(low(1))//' '//exact_text(high(1))//' '// &
                          exact_text(low(2))//' '//exact_text(high(2))//' '//exact_text(low(3))//' '// &
                          exact_text(high(3))//' units box')
         call lmp%command('create_box 2 all')
         if (lmp%fault == '') then
            allocate (types(self%atoms), source=2)
            types(:self%real_atoms) = 1
            if (lmp%create(types, self%x/angstrom) /= self%atoms) lmp%fault = 'LAMMPS did not create all '// &
               'atoms'
         end if
         call set_potential(lmp, potential)
         call lmp%command('mass * '//exact_text(self%mass/kg_of_mass))
         call lmp%command('neighbor '//exact_text(skin)//' bin')
         call lmp%command('neigh_modify every 1 delay 0 check yes')
         call lmp%command('group atoms type 1')
         call lmp%command('group pads type 2')
         call lmp%command('compute pe all pe/atom')
         call lmp%command('compute csp all centro/atom '//merge('12', '8 ', self%spec%crystal%lattice == 1))
         call lmp%command('compute stress all stress/atom NULL')
         call lmp%command('compute cna all cna/atom '//exact_text(between_neighbours(self)/angstrom))
         call lmp%command('compute sum atoms reduce sum c_pe')
         call lmp%command('compute pull atoms reduce sum c_stress[1]')
         call lmp%command('compute disorder atoms reduce max c_csp')
         call lmp%command('fix bonds all external pf/callback 1 1')
         if (lmp%fault == '') call lmp%call_back('bonds', at, c_loc(self))
         call lmp%command('fix pads pads setforce 0 0 0')
         call lmp%command('fix move all nve')
         call lmp%command('thermo_style custom step c_sum c_pull') ! asks for energies, stresses of atoms
         call lmp%command('run 0 post no')
         if (lmp%fault /= '') complaint = lmp%fault
      end associate
      if (complaint /= '') return
      self%repulsion%stiffness = self%spec%tool_stiffness
      self%repulsion%distance = self%spec%tool_distance
      self%first_potential = self%potential()
   end subroutine begin

   !> Midway between the distances of nearest neighbours that count for the class of an atom and those that do
   !> not, m (LAMMPS, compute cna/atom).
   pure real(wp) function between_neighbours(self) result(r)
      type(dynamics_t), intent(in) :: self
      r = self%spec%crystal%constant*merge(0.25_wp*sqrt(2.0_wp) + 0.5_wp, 0.5_wp*(1.0_wp + sqrt(2.0_wp)), &
                                           self%spec%crystal%lattice == 1)
   end function between_neighbours

   !> What LAMMPS calls when it knows the forces of a step: the places of all atoms, and the forces of bonds.
   subroutine forces_known(context, step, count, ids, x, f) bind(c, name='gimp3d_forces_of_atoms_known')
      type(c_ptr), value :: context, x, f
      integer(c_int64_t), value :: step
      integer(c_int), value :: count
      integer(c_int), intent(in) :: ids(*)
      type(dynamics_t), pointer :: self
      type(c_ptr), pointer :: rows(:)
      real(c_double), pointer :: places(:, :), v(:, :), forces(:, :)
      integer :: n
      call c_f_pointer(context, self)
      call c_f_pointer(x, rows, [1])
      call c_f_pointer(rows(1), places, [3, int(count)])
      do n = 1, int(count)
         self%x(:, ids(n)) = angstrom*places(:, n)
      end do
      call c_f_pointer(f, rows, [1])
      call c_f_pointer(rows(1), places, [3, int(count)])
      places = 0.0_wp ! what acts on them besides the potential
      if (associated(self%patch) .and. .not. self%anew) self%mesh%x = self%mesh%x + self%time_step*self%mesh%v
      call self%bonds%forces(self%spec%crystal%potential, self%x, associated(self%patch), self%force, &
                             self%place)
      if (allocated(self%repulsion%pairs)) then
         if (associated(self%patch) .and. .not. self%anew) &
            self%repulsion%ahead = self%repulsion%ahead + self%time_step
         call self%repulsion%find_forces(self%x)
         call add_repulsion(self, ids(:count), places)
      end if
      if (.not. associated(self%patch)) return
      if (self%bath%acts()) then
         call self%lammps%vectors('v', v)
         call self%bath%push(self%x, ids(:count), v, self%mass, self%time_step, .not. self%anew, places)
      end if
      if (self%anew) then
         call accumulate(self, 0.5_wp)
      else
         if (self%spec%quenches()) then
            call self%lammps%vectors('v', v)
            call self%lammps%vectors('f', forces)
            call self%relaxation%turn(self%real_atoms, ids(:count), self%mass, self%time_step, v, forces, &
                                      places)
         end if
         self%done = self%done + 1
         call accumulate(self, merge(0.5_wp, 1.0_wp, self%done == self%steps))
      end if
      self%anew = .false.
   end subroutine forces_known

   !> The forces of tools, in LAMMPS's units and order.
   subroutine add_repulsion(self, ids, forces)
      type(dynamics_t), intent(in) :: self
      integer(c_int), intent(in) :: ids(:)
      real(c_double), intent(inout) :: forces(:, :)
      integer, allocatable :: row(:)
      integer :: k
      allocate (row(self%atoms))
      row(ids) = [(k, k=1, size(ids))]
      do k = 1, size(self%repulsion%pairs, 2)
         associate (f => forces(:, row(self%repulsion%pairs(1, k))))
            f = f + self%repulsion%force(:, k)*(angstrom/joule_per_ev)
         end associate
      end do
   end subroutine add_repulsion

   !> What the forces of now do to nodes and tools, for a share of an atoms' step.
   subroutine accumulate(self, share)
      type(dynamics_t), intent(inout) :: self
      real(wp), intent(in) :: share
      call self%mesh%add(self%patch, self%place, self%force, share*self%time_step, self%missed)
      if (allocated(self%repulsion%pairs)) call self%repulsion%accumulate(self%x, share*self%time_step)
   end subroutine accumulate

   !> Move the atoms through a time in equal steps; the impulses of the bonds go to the nodes of the patch.
   !> `anew`: neighbours and forces are found from places alone, so that going on from these gives the same.
   subroutine advance(self, time, patch, complaint, anew)
      class(dynamics_t), intent(inout), target :: self
      real(wp), intent(in) :: time !< s
      type(node_patch_t), intent(inout), target :: patch
      character(len=:), allocatable, intent(out) :: complaint
      logical, intent(in) :: anew
      character(len=16) :: steps
      real(wp) :: before
      before = self%time_step
      self%steps = max(1, ceiling(time/self%spec%step*(1.0_wp - 1.0e-12_wp)))
      self%time_step = time/self%steps
      self%anew = anew .or. abs(self%time_step - before) > 0.0_wp ! LAMMPS takes it where a run begins anew
      if (self%anew) call self%lammps%command('timestep '//exact_text(self%time_step*1.0e12_wp))
      if (allocated(self%repulsion%pairs)) call self%repulsion%search(self%x, self%real_atoms)
      self%done = 0
      self%patch => patch
      write (steps, '(i0)') self%steps
      if (self%anew) then
         call self%lammps%command('run '//trim(steps)//' post no')
      else
         if (allocated(self%repulsion%pairs)) call self%repulsion%find_forces(self%x) ! of the pairs of now
         call accumulate(self, 0.5_wp)
         call self%lammps%command('run '//trim(steps)//' pre no post no')
      end if
      self%patch => null()
      complaint = self%lammps%fault
   end subroutine advance

   !> Pads and mesh go with the nodes of the patch, and with `expects` as contact has changed their speeds in
   !> the step before; how many none with mass is near to.
   integer function pad_velocities(self, patch, expects) result(lost)
      class(dynamics_t), intent(inout) :: self
      type(node_patch_t), intent(in) :: patch
      logical, intent(in) :: expects
      real(c_double), pointer :: v(:, :)
      integer(c_int), pointer :: ids(:)
      real(wp) :: velocity(3)
      logical :: reached
      integer :: n, pad
      lost = 0
      call self%lammps%vectors('v', v)
      call self%lammps%numbers('id', ids)
      do n = 1, size(ids)
         pad = ids(n) - self%real_atoms
         if (pad < 1) cycle
         call patch%velocity_at(self%x(:, ids(n)), velocity, reached)
         if (.not. reached) lost = lost + 1
         self%pad_speed(:, pad) = velocity
         if (expects) velocity = velocity + self%pad_push(:, pad)
         v(:, n) = metre_a_second*velocity
      end do
      do n = 1, size(self%mesh%x, 2)
         pad = self%atoms - self%real_atoms + n
         call patch%velocity_at(self%mesh%x(:, n), self%mesh%v(:, n), reached)
         if (.not. reached) lost = lost + 1
         self%pad_speed(:, pad) = self%mesh%v(:, n)
         if (expects) self%mesh%v(:, n) = self%mesh%v(:, n) + self%pad_push(:, pad)
      end do
   end function pad_velocities

   !> Give all real atoms the velocity v + L (x - about), and one by chance where they have a temperature.
   subroutine set_velocities(self, v, gradient, about)
      class(dynamics_t), intent(inout) :: self
      real(wp), intent(in) :: v(3), gradient(3, 3), about(3) !< m/s, 1/s, m
      real(c_double), pointer :: velocity(:, :)
      integer(c_int), pointer :: ids(:)
      real(wp), allocatable :: thermal(:, :)
      integer :: n
      ! half of what is given goes to the potential energy of an undisturbed lattice
      thermal = thermal_speeds(self%real_atoms, self%mass, 2.0_wp*self%spec%temperature, self%spec%seed)
      call self%lammps%vectors('v', velocity)
      call self%lammps%numbers('id', ids)
      do n = 1, size(ids)
         if (ids(n) > self%real_atoms) cycle
         velocity(:, n) = metre_a_second*(v + thermal(:, ids(n)) &
                                          + matmul(gradient, self%x(:, ids(n)) - about))
      end do
   end subroutine set_velocities

   !> Put all atoms to places (3, atoms), m, at rest, and find the forces anew.
   subroutine place_all(self, places)
      class(dynamics_t), intent(inout) :: self
      real(wp), intent(in) :: places(:, :)
      real(c_double), pointer :: x(:, :), v(:, :)
      integer(c_int), pointer :: ids(:)
      integer :: n
      call self%lammps%vectors('x', x)
      call self%lammps%vectors('v', v)
      call self%lammps%numbers('id', ids)
      do n = 1, size(ids)
         x(:, n) = places(:, ids(n))/angstrom
      end do
      v = 0.0_wp
      call self%lammps%command('run 0 post no')
   end subroutine place_all

   !> On a real atom, N.
   real(wp) function largest_force(self) result(largest)
      class(dynamics_t), intent(in) :: self
      real(c_double), pointer :: f(:, :)
      integer(c_int), pointer :: ids(:)
      integer :: n
      call self%lammps%vectors('f', f)
      call self%lammps%numbers('id', ids)
      largest = 0.0_wp
      do n = 1, size(ids)
         if (ids(n) <= self%real_atoms) largest = max(largest, norm2(f(:, n))*joule_per_ev/angstrom)
      end do
   end function largest_force

   !> Kinetic energy of the real atoms, J.
   real(wp) function kinetic(self)
      class(dynamics_t), intent(in) :: self
      real(c_double), pointer :: v(:, :)
      integer(c_int), pointer :: ids(:)
      integer :: n
      call self%lammps%vectors('v', v)
      call self%lammps%numbers('id', ids)
      kinetic = 0.0_wp
      do n = 1, size(ids)
         if (ids(n) <= self%real_atoms) kinetic = kinetic + 0.5_wp*self%mass*sum((v(:, n)/metre_a_second)**2)
      end do
   end function kinetic

   !> Potential energy of the real atoms, with half of each bond to a pad, J.
   real(wp) function potential(self)
      class(dynamics_t), intent(in) :: self
      potential = self%lammps%scalar('sum')*joule_per_ev
   end function potential

   !> Since the start, with the parts in the box of the bonds that cross its faces (theory.md, eq.
   !> bond-energy), J.
   real(wp) function potential_change(self)
      class(dynamics_t), intent(in) :: self
      potential_change = self%potential() - self%first_potential + self%bonds%stored + self%mesh%rest_energy()
   end function potential_change

   !> Largest centro-symmetry parameter of the real atoms, m2: 0 in a perfect lattice.
   real(wp) function disorder(self)
      class(dynamics_t), intent(in) :: self
      disorder = self%lammps%scalar('disorder')*angstrom**2
   end function disorder

   !> Of the atoms' motion about the mean, K.
   real(wp) function temperature(self)
      class(dynamics_t), intent(in) :: self
      real(wp) :: p(3), l(3)
      temperature = 0.0_wp
      if (self%real_atoms < 2) return
      call self%momentum(p, l)
      temperature = 2.0_wp/3.0_wp*(self%kinetic() - 0.5_wp*sum(p**2)/(self%mass*self%real_atoms)) &
                    /(boltzmann*(self%real_atoms - 1))
   end function temperature

   !> Momentum and angular momentum about the origin of the real atoms.
   subroutine momentum(self, p, l)
      class(dynamics_t), intent(in) :: self
      real(wp), intent(out) :: p(3), l(3) !< kg m/s, kg m2/s
      real(c_double), pointer :: v(:, :)
      integer(c_int), pointer :: ids(:)
      real(wp) :: one(3), r(3)
      integer :: n
      call self%lammps%vectors('v', v)
      call self%lammps%numbers('id', ids)
      p = 0.0_wp
      l = 0.0_wp
      do n = 1, size(ids)
         if (ids(n) > self%real_atoms) cycle
         one = self%mass*v(:, n)/metre_a_second
         r = self%x(:, ids(n))
         p = p + one
         l = l + [r(2)*one(3) - r(3)*one(2), r(3)*one(1) - r(1)*one(3), r(1)*one(2) - r(2)*one(1)]
      end do
   end subroutine momentum

   !> Places and velocities of all atoms as LAMMPS has them (angstrom, angstrom/ps), (3, atoms) by number, and
   !> after them those of the mesh (m, m/s).
   subroutine get_motion(self, x, v)
      class(dynamics_t), intent(in) :: self
      real(wp), intent(out) :: x(:, :), v(:, :)
      real(c_double), pointer :: values(:, :)
      integer(c_int), pointer :: ids(:)
      call self%lammps%numbers('id', ids)
      call self%lammps%vectors('x', values)
      x(:, ids) = values
      call self%lammps%vectors('v', values)
      v(:, ids) = values
      x(:, self%atoms + 1:) = self%mesh%x
      v(:, self%atoms + 1:) = self%mesh%v
   end subroutine get_motion

   !> Put all atoms and the mesh to such places with such velocities.
   subroutine set_motion(self, x, v)
      class(dynamics_t), intent(inout) :: self
      real(wp), intent(in) :: x(:, :), v(:, :)
      real(c_double), pointer :: values(:, :)
      integer(c_int), pointer :: ids(:)
      call self%lammps%numbers('id', ids)
      call self%lammps%vectors('x', values)
      values = x(:, ids)
      call self%lammps%vectors('v', values)
      values = v(:, ids)
      self%x = angstrom*x(:, :self%atoms)
      self%mesh%x = x(:, self%atoms + 1:)
      self%mesh%v = v(:, self%atoms + 1:)
      call self%lammps%command('run 0 post no')
   end subroutine set_motion

end module m_dynamics
