!> What LAMMPS says of single atoms: for snapshots, and how many are where no lattice has them.
module m_atom_fields
   use, intrinsic :: iso_c_binding, only: c_double, c_int
   use m_kinds, only: wp
   use m_dynamics, only: dynamics_t
   use m_potential_file, only: joule_per_ev
   implicit none
   private
   public :: atom_fields_t, fields_of, structure_of, defects_of, write_dump

   real(wp), parameter :: angstrom = 1.0e-10_wp, metre_a_second = 1.0e-2_wp !< in m; in angstrom/ps
   real(wp), parameter :: bar = 1.0e5_wp !< Pa

   !> Of all atoms by number, pads last. SI units.
   type :: atom_fields_t
      real(wp), allocatable :: velocity(:, :)      !< (atoms, 3), m/s
      real(wp), allocatable :: energy(:)           !< potential energy, J
      real(wp), allocatable :: centrosymmetry(:)   !< m2
      real(wp), allocatable :: stress(:, :)        !< (atoms, 6) xx yy zz yz xz xy, over the rest's volume, Pa
      integer, allocatable :: structure(:)         !< class by common neighbours: 1 fcc, 2 hcp, 3 bcc, 4
                                                   !< icosahedral, 5 another
   end type atom_fields_t

contains

   !> All fields now.
   subroutine fields_of(dynamics, fields)
      type(dynamics_t), intent(in) :: dynamics
      type(atom_fields_t), intent(out) :: fields
      integer, parameter :: order(6) = [1, 2, 3, 6, 5, 4] !< LAMMPS has xx yy zz xy xz yz
      real(c_double), pointer :: rows(:, :), values(:)
      integer(c_int), pointer :: ids(:)
      associate (lmp => dynamics%lammps, n => dynamics%atoms)
         allocate (fields%velocity(n, 3), fields%energy(n), fields%centrosymmetry(n), fields%stress(n, 6))
         call lmp%numbers('id', ids)
         call lmp%vectors('v', rows)
         fields%velocity(ids, :) = transpose(rows)/metre_a_second
         call lmp%of_atoms('pe', values)
         fields%energy(ids) = values*joule_per_ev
         call lmp%of_atoms('csp', values)
         fields%centrosymmetry(ids) = values*angstrom**2
         call lmp%rows_of_atoms('stress', 6, rows)
         fields%stress(ids, :) = transpose(rows(order, :))*(bar*angstrom**3/dynamics%spec%crystal%volume)
      end associate
      call structure_of(dynamics, fields%structure)
   end subroutine fields_of

   !> The class of each atom.
   subroutine structure_of(dynamics, structure)
      type(dynamics_t), intent(in) :: dynamics
      integer, allocatable, intent(out) :: structure(:)
      real(c_double), pointer :: values(:)
      integer(c_int), pointer :: ids(:)
      allocate (structure(dynamics%atoms), source=0)
      call dynamics%lammps%of_atoms('cna', values)
      call dynamics%lammps%numbers('id', ids)
      structure(ids) = nint(values)
   end subroutine structure_of

   !> How many real atoms that had the class of the lattice when this was first asked have another one.
   integer function defects_of(dynamics) result(defects)
      type(dynamics_t), intent(inout) :: dynamics
      integer, allocatable :: structure(:)
      call structure_of(dynamics, structure)
      associate (real_ones => structure(:dynamics%real_atoms), own => dynamics%spec%crystal%structure())
         if (.not. allocated(dynamics%sound)) dynamics%sound = real_ones == own
         defects = count(dynamics%sound .and. real_ones /= own)
      end associate
   end function defects_of

   !> A dump that OVITO and LAMMPS read: types 1 (atoms) and 2 (pads), in LAMMPS's metal units.
   subroutine write_dump(dynamics, path)
      type(dynamics_t), intent(inout) :: dynamics
      character(len=*), intent(in) :: path
      call dynamics%lammps%command('write_dump all custom '//path//' id type x y z vx vy vz c_pe c_csp '// &
                                   'c_cna modify sort id format float %.10g')
   end subroutine write_dump

end module m_atom_fields
