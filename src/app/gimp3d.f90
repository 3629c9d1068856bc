!> gimp3d: solid mechanics with the generalized interpolation material point method.
!> usage: mpirun -n RANKS ./gimp3d < scene.nml
program gimp3d
   use, intrinsic :: iso_fortran_env, only: output_unit, error_unit
   use, intrinsic :: ieee_arithmetic, only: ieee_set_underflow_mode
   use m_simulation, only: simulation_t
   implicit none
   type(simulation_t) :: simulation
   integer :: status

   ! Weights of nodes that particles barely touch make numbers too small for full precision, which cost a hundredfold: zero them.
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

contains

   !> End with an exit status, without words of the runtime's own, and without the clean-up of libraries that MPI has already
   !> unloaded (in a run without mpirun that is a race which can end in a crash).
   subroutine leave(status)
      use, intrinsic :: iso_c_binding, only: c_int
      integer, intent(in) :: status
      interface
         subroutine c_exit(status) bind(c, name='_exit')
            import :: c_int
            integer(c_int), value :: status
         end subroutine c_exit
      end interface
      flush (output_unit)
      flush (error_unit)
      call c_exit(int(status, c_int))
   end subroutine leave

end program gimp3d
