!> A potential, as LAMMPS is told it.
module m_lammps_potential
   use m_kinds, only: wp
   use m_lammps, only: lammps_t
   use m_potential, only: pair_styles, potential_t
   use m_potential_file, only: joule_per_ev
   use m_text, only: exact_text
   implicit none
   private
   public :: set_potential

   real(wp), parameter :: angstrom = 1.0e-10_wp !< m

contains

   !> Both types of atoms have the same potential.
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

end module m_lammps_potential
