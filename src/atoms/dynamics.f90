!> The atoms of a box, which LAMMPS moves: real atoms in the box, and pads in the continuum around it, which
!> go with that. One rank has them. Places and forces are in SI units, LAMMPS's in its `metal` units.
module m_dynamics
   use, intrinsic :: iso_c_binding, only: c_double, c_f_pointer, c_funloc, c_funptr, c_int, c_int64_t, &
      c_loc, c_ptr
   use mpi_f08, only: MPI_COMM_SELF
   use m_kinds, only: wp
   use m_atoms, only: atoms_t
   use m_bonds, only: bonds_t
   use m_bravais, only: basis_of
   use m_lammps, only: lammps_t
   use m_node_patch, only: node_patch_t
   use m_potential, only: pair_styles, potential_t
   use m_potential_file, only: joule_per_ev
   use m_shape, only: shape_t
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
      integer :: real_atoms = 0, atoms = 0
      real(wp) :: mass = 0.0_wp                      !< of an atom, kg, as LAMMPS moves it
      real(wp), allocatable :: x(:, :)               !< (3, atoms), m: real ones first
      real(wp), allocatable :: force(:, :), place(:, :) !< of the bonds now: on the continuum, N; where, m
      real(wp) :: first_potential = 0.0_wp           !< J
      type(atoms_t) :: spec
      type(node_patch_t), pointer :: patch => null() !< that takes the impulses of the steps that go on
      integer :: steps = 0, done = 0                 !< of them
      integer :: missed = 0                          !< bonds that no node with mass is near to
      real(wp) :: time_step = 0.0_wp                 !< of atoms, s
   contains
      procedure :: create
      procedure :: advance
      procedure :: pad_velocities
      procedure :: set_velocities
      procedure :: kinetic
      procedure :: potential
      procedure :: disorder
      procedure :: temperature
      procedure :: momentum
      procedure :: write_dump
      procedure :: place_all
      procedure :: largest_force
   end type dynamics_t

contains

   !> All atoms of the lattice within a body. `complaint`: what is wrong; empty: nothing.
   subroutine create(self, spec, body, lower, upper, complaint)
      class(dynamics_t), intent(inout) :: self
      type(atoms_t), intent(in) :: spec
      class(shape_t), intent(in) :: body         !< with nothing cut out of it
      real(wp), intent(in) :: lower(3), upper(3) !< of the box, within the body, m
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
      call begin(self, complaint)
   contains
      pure real(wp) function nearest(vectors)
         real(wp), intent(in) :: vectors(:, :)
         nearest = sqrt(minval(sum(vectors**2, 1)))
      end function nearest
   end subroutine create

   !> Real atoms inside the box, then pads outside it as far as real atoms' neighbours have neighbours.
   subroutine fill_lattice(spec, body, lower, upper, places, real_atoms)
      type(atoms_t), intent(in) :: spec
      class(shape_t), intent(in) :: body
      real(wp), intent(in) :: lower(3), upper(3)
      real(wp), allocatable, intent(out) :: places(:, :)
      integer, intent(out) :: real_atoms
      real(wp), allocatable :: points(:, :)
      real(wp) :: a, x(3), pad, gap, normal(3), shift
      integer :: low(3), high(3), i, j, k, b, n, pass, kind
      points = basis_of(spec%crystal%lattice)
      a = spec%crystal%constant
      pad = spec%pad_width()
      shift = merge(0.5_wp, 0.25_wp, size(points, 2) == 1) ! planes of atoms stand midway between the faces
      low = floor(-pad*[1, 1, 1]/a) - 1
      high = ceiling((upper - lower + pad)/a) + 1
      do pass = 1, 2
         n = 0
         do kind = 1, 2
            do k = low(3), high(3)
               do j = low(2), high(2)
                  do i = low(1), high(1)
                     do b = 1, size(points, 2)
                        x = lower + a*(points(:, b) + shift + real([i, j, k], wp))
                        if (any(x < lower - pad) .or. any(x > upper + pad)) cycle
                        if (all(x > lower .and. x < upper) .neqv. kind == 1) cycle
                        if (kind == 1 .and. norm2(x - spec%void) < spec%void_radius) cycle
                        call body%distance_and_normal(x, gap, normal)
                        if (gap >= 0.0_wp) cycle
                        n = n + 1
                        if (pass == 2) places(:, n) = x
                     end do
                  end do
               end do
            end do
            if (kind == 1) real_atoms = n
         end do
         if (pass == 1) allocate (places(3, n))
      end do
   end subroutine fill_lattice

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
            if (lmp%create(types, self%x/angstrom) /= self%atoms) lmp%fault = 'LAMMPS does not take all atoms'
         end if
         call set_potential(lmp, potential)
         call lmp%command('mass * '//exact_text(self%mass/kg_of_mass))
         call lmp%command('neighbor '//exact_text(skin)//' bin')
         call lmp%command('neigh_modify every 1 delay 0 check yes')
         call lmp%command('group atoms type 1')
         call lmp%command('group pads type 2')
         call lmp%command('compute pe all pe/atom')
         call lmp%command('compute csp all centro/atom '//merge('12', '8 ', self%spec%crystal%lattice == 1))
         call lmp%command('compute sum atoms reduce sum c_pe')
         call lmp%command('compute disorder atoms reduce max c_csp')
         call lmp%command('fix bonds all external pf/callback 1 1')
         if (lmp%fault == '') call lmp%call_back('bonds', at, c_loc(self))
         call lmp%command('fix pads pads setforce 0 0 0')
         if (self%spec%drag > 0.0_wp) call lmp%command('fix drag atoms viscous '// &
                          exact_text(self%mass/kg_of_mass*mvv2e*self%spec%drag*1.0e-12_wp))
         call lmp%command('fix move all nve')
         call lmp%command('thermo_style custom step c_sum c_disorder')
         call lmp%command('run 0 post no')
         if (lmp%fault /= '') complaint = lmp%fault
      end associate
      if (complaint == '') self%first_potential = self%potential()
   end subroutine begin

   subroutine set_potential(lmp, potential)
      type(lammps_t), intent(inout) :: lmp
      type(potential_t), intent(in) :: potential
      character(len=:), allocatable :: style
      style = 'pair_style '//trim(pair_styles(potential%style))
      if (.not. potential%embeds) then
         call lmp%command(style//' '//exact_text(potential%cutoff/angstrom))
         call lmp%command('pair_coeff * * '//exact_text(potential%epsilon/joule_per_ev)//' '// &
                          exact_text(potential%sigma/angstrom))
      else if (potential%element == '') then
         call lmp%command(style)
         call lmp%command('pair_coeff * * '//potential%path)
      else
         call lmp%command(style)
         call lmp%command('pair_coeff * * '//potential%path//' '//potential%element//' '//potential%element)
      end if
   end subroutine set_potential

   !> What LAMMPS calls when it knows the forces of a step: the places of all atoms, and the forces of bonds.
   subroutine forces_known(context, step, count, ids, x, f) bind(c, name='gimp3d_forces_of_atoms_known')
      type(c_ptr), value :: context, x, f
      integer(c_int64_t), value :: step
      integer(c_int), value :: count
      integer(c_int), intent(in) :: ids(*)
      type(dynamics_t), pointer :: self
      type(c_ptr), pointer :: rows(:)
      real(c_double), pointer :: places(:, :)
      real(wp) :: factor
      integer :: n
      call c_f_pointer(context, self)
      call c_f_pointer(x, rows, [1])
      call c_f_pointer(rows(1), places, [3, int(count)])
      do n = 1, int(count)
         self%x(:, ids(n)) = angstrom*places(:, n)
      end do
      call c_f_pointer(f, rows, [1])
      call c_f_pointer(rows(1), places, [3, int(count)])
      places = 0.0_wp ! nothing but the potential acts on them
      call self%bonds%forces(self%spec%crystal%potential, self%x, self%force, self%place)
      if (.not. associated(self%patch)) return
      self%done = self%done + 1
      factor = self%time_step
      if (self%done == self%steps) factor = 0.5_wp*factor
      call self%patch%add(self%place, self%force, factor, self%missed)
   end subroutine forces_known

   !> Move the atoms through a time in equal steps; the impulses of the bonds go to the nodes of the patch.
   subroutine advance(self, time, patch, complaint)
      class(dynamics_t), intent(inout), target :: self
      real(wp), intent(in) :: time !< s
      type(node_patch_t), intent(inout), target :: patch
      character(len=:), allocatable, intent(out) :: complaint
      character(len=16) :: steps
      real(wp) :: before
      before = self%time_step
      self%steps = max(1, ceiling(time/self%spec%step*(1.0_wp - 1.0e-12_wp)))
      self%time_step = time/self%steps
      if (abs(self%time_step - before) > 0.0_wp) then ! LAMMPS takes it where a run begins anew
         call self%lammps%command('timestep '//exact_text(self%time_step*1.0e12_wp))
         call self%lammps%command('run 0 post no')
      end if
      self%done = 0
      self%patch => patch
      call patch%add(self%place, self%force, 0.5_wp*self%time_step, self%missed)
      write (steps, '(i0)') self%steps
      call self%lammps%command('run '//trim(steps)//' pre no post no')
      self%patch => null()
      complaint = self%lammps%fault
   end subroutine advance

   !> The pads go with the nodes of the patch; how many none with mass is near to.
   integer function pad_velocities(self, patch) result(lost)
      class(dynamics_t), intent(inout) :: self
      type(node_patch_t), intent(in) :: patch
      real(c_double), pointer :: v(:, :)
      integer(c_int), pointer :: ids(:)
      real(wp) :: velocity(3)
      logical :: reached
      integer :: n
      call self%lammps%vectors('v', v)
      call self%lammps%numbers('id', ids)
      lost = 0
      do n = 1, size(ids)
         if (ids(n) <= self%real_atoms) cycle
         call patch%velocity_at(self%x(:, ids(n)), velocity, reached)
         if (.not. reached) lost = lost + 1
         v(:, n) = metre_a_second*velocity
      end do
   end function pad_velocities

   !> Give all real atoms the velocity v + L (x - about).
   subroutine set_velocities(self, v, gradient, about)
      class(dynamics_t), intent(inout) :: self
      real(wp), intent(in) :: v(3), gradient(3, 3), about(3) !< m/s, 1/s, m
      real(c_double), pointer :: velocity(:, :)
      integer(c_int), pointer :: ids(:)
      integer :: n
      call self%lammps%vectors('v', velocity)
      call self%lammps%numbers('id', ids)
      do n = 1, size(ids)
         if (ids(n) > self%real_atoms) cycle
         velocity(:, n) = metre_a_second*(v + matmul(gradient, self%x(:, ids(n)) - about))
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

   !> A dump that OVITO and LAMMPS read: types 1 (atoms) and 2 (pads), in LAMMPS's metal units.
   subroutine write_dump(self, path)
      class(dynamics_t), intent(inout) :: self
      character(len=*), intent(in) :: path
      call self%lammps%command('write_dump all custom '//path//' id type x y z vx vy vz c_pe c_csp '// &
                               'modify sort id format float %.10g')
   end subroutine write_dump

end module m_dynamics
