!> gimp3d: solid mechanics with the generalized interpolation material point method.
!> usage: mpirun -n RANKS ./gimp3d < scene.nml
program gimp3d
   use, intrinsic :: iso_fortran_env, only: error_unit
   use, intrinsic :: ieee_arithmetic, only: ieee_set_underflow_mode
   use m_leaving, only: leave
   use m_simulation, only: simulation_t
   implicit none
   type(simulation_t) :: simulation
   integer :: status

   ! Nodes with tiny weights produce subnormal numbers, which cost a hundredfold: flush them to zero.
   call ieee_set_underflow_mode(gradual=.false.)
   call simulation%initialise()
   do while (.not. simulation%done())
      call simulation%step()
   end do
   status = simulation%finalise()

   if (simulation%error%happened() .and. simulation%communicator%is_root()) &
      write (error_unit, '(a)') 'gimp3d: '//simulation%error%message
   call simulation%communicator%finish()
   call leave(status)

end program gimp3d
