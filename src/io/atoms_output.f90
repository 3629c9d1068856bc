!> What is written of a box of atoms: the columns of its history, dumps.
module m_atoms_output
   use m_errors, only: error_t
   use m_history, only: history_header_t, history_text_length
   use m_model, only: model_t
   use m_text, only: to_text
   implicit none
   private
   public :: atoms_header, dump_atoms

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
                        'work_on_continuum [J]', 'largest_centrosymmetry [m2]']
   end function atoms_header

   !> Collective: a dump with the snapshot of a step.
   subroutine dump_atoms(model, directory, step, error)
      type(model_t), intent(inout) :: model
      character(len=*), intent(in) :: directory
      integer, intent(in) :: step
      type(error_t), intent(inout) :: error
      call model%atoms%write_dump(directory//'/'//model%atoms%file('_'//to_text(step)//'.lammpstrj'), error)
      call model%communicator%agree(error)
   end subroutine dump_atoms

end module m_atoms_output
