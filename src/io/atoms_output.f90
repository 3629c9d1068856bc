!> Output of a box of atoms: the columns of its history, and files beside snapshots.
module m_atoms_output
   use m_kinds, only: wp, i8
   use m_atom_fields, only: atom_fields_t, fields_of
   use m_coupling, only: coupling_t, coupling_of
   use m_errors, only: error_t
   use m_hdf5_snapshot, only: write_hdf5_snapshot
   use m_history, only: history_header_t, history_text_length
   use m_model, only: model_t
   use m_snapshot, only: component_name_length, snapshot_field_t, snapshot_t, step_digits
   implicit none
   private
   public :: atoms_header, write_atoms

contains

   function atoms_header(title) result(header)
      character(len=*), intent(in) :: title
      type(history_header_t) :: header
      header%title = title
      header%zone = 'atoms'
      header%columns = [character(len=history_text_length) :: 'time [s]', 'kinetic [J]', &
                        'potential_change [J]', 'temperature [K]', 'momentum_x [kg m/s]', &
                        'momentum_y [kg m/s]', 'momentum_z [kg m/s]', 'angular_momentum_x [kg m2/s]', &
                        'angular_momentum_y [kg m2/s]', 'angular_momentum_z [kg m2/s]', &
                        'work_on_continuum [J]', 'largest_centrosymmetry [m2]', &
                        'largest_force [N]', 'work_of_tools [J]', 'tool_repulsion [J]', 'taken_out [J]', &
                        'defects', 'interface_change']
   end function atoms_header

   !> Collective: with the snapshot of a step write the atoms as a dump for LAMMPS and OVITO, and as a file
   !> for VTK.
   subroutine write_atoms(model, directory, snapshot, error)
      type(model_t), intent(inout), target :: model
      character(len=*), intent(in) :: directory
      type(snapshot_t), intent(in) :: snapshot !< of the particles
      type(error_t), intent(inout) :: error
      type(coupling_t), pointer :: coupling
      type(snapshot_t) :: atoms
      atoms%time = snapshot%time
      atoms%step = snapshot%step
      atoms%title = snapshot%title
      coupling => coupling_of(model%atoms)
      call fill(atoms, coupling)
      call write_hdf5_snapshot(model%communicator, atoms, directory, error, &
                               coupling%file('_'//step_digits(atoms%step)//'.hdf'))
      call coupling%write_dump(directory//'/'//coupling%file('_'//step_digits(atoms%step)//'.lammpstrj'), &
                               error)
      call model%communicator%agree(error)
   end subroutine write_atoms

   !> All atoms, which are on rank 0; numbers in the file are those of the atoms.
   subroutine fill(atoms, coupling)
      type(snapshot_t), intent(inout) :: atoms
      type(coupling_t), intent(inout) :: coupling
      type(atom_fields_t) :: fields
      integer :: n
      atoms%n_total = sum(coupling%counts(:2))
      if (associated(coupling%atoms)) then
         call fields_of(coupling%atoms, fields)
         atoms%n_local = coupling%atoms%atoms
         atoms%position = transpose(coupling%atoms%x)
      else
         allocate (fields%velocity(0, 3), fields%energy(0), fields%centrosymmetry(0), fields%stress(0, 6), &
                   fields%structure(0), atoms%position(0, 3))
      end if
      atoms%id = [(int(n, i8), n=1, atoms%n_local)]
      allocate (atoms%run_offset(min(1, atoms%n_local)), source=0_i8)
      allocate (atoms%run_count(min(1, atoms%n_local)), source=atoms%n_local)
      allocate (atoms%fields(6))
      call put(atoms%fields(1), 'velocity', 'm/s', fields%velocity)
      call put(atoms%fields(2), 'type', '', column(merge(1.0_wp, 2.0_wp, [(n, n=1, atoms%n_local)] &
                                                         <= coupling%counts(1))))
      call put(atoms%fields(3), 'potential_energy', 'J', column(fields%energy))
      call put(atoms%fields(4), 'centrosymmetry', 'm2', column(fields%centrosymmetry))
      call put(atoms%fields(5), 'structure', '', column(real(fields%structure, wp)))
      call put(atoms%fields(6), 'stress', 'Pa', fields%stress)
      atoms%fields(6)%component_names = [character(len=component_name_length) :: 'xx', 'yy', 'zz', 'yz', &
                                         'xz', 'xy']
   contains
      pure function column(values)
         real(wp), intent(in) :: values(:)
         real(wp) :: column(size(values), 1)
         column(:, 1) = values
      end function column
   end subroutine fill

   subroutine put(field, name, unit, values)
      type(snapshot_field_t), intent(inout) :: field
      character(len=*), intent(in) :: name, unit
      real(wp), intent(in) :: values(:, :)
      field%name = name
      field%unit = unit
      field%components = size(values, 2)
      field%values = values
   end subroutine put

end module m_atoms_output
