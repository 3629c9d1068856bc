!test: helper
!> The map of stability, as rows: map STEPS PLACES
!>
!> A free block rings from random motion (test/verification/ringing.f90), at PLACES on the grid, at rest and
!> in flight, for STEPS steps: safety x particles a cell x domain x Poisson's ratio x transfer. Prints, for
!> each, the largest energy over the first (10: beyond, or the step failed); the first is the largest of the
!> first quarter, for random velocities without gradients are no motion that affine transfer keeps: with
!> corners and Poisson 0 the reported energy rises by a third within 60 steps, and stays there. Young's
!> modulus and density alone only change the unit of time: the step follows the wave speed. Ranks share the
!> rows.
program map
   use mpi_f08, only: MPI_COMM_SELF
   use m_kinds, only: wp
   use m_communicator, only: communicator_t
   use m_domain_kinds, only: domain_fixed, domain_stretch, domain_corners
   use m_ringing, only: setting_t, largest_growth, hopeless
   implicit none
   integer, parameter :: particle_numbers(3) = [1, 8, 27], domains(3) = [domain_fixed, domain_stretch, &
      domain_corners]
   character(len=7), parameter :: domain_names(3) = ['fixed  ', 'stretch', 'corners']
   character(len=6), parameter :: transfers(2) = ['plain ', 'affine']
   real(wp), parameter :: poissons(3) = [0.0_wp, 0.3_wp, 0.49_wp]
   real(wp), parameter :: safeties(9) = [0.2_wp, 0.3_wp, 0.35_wp, 0.4_wp, 0.45_wp, 0.5_wp, 0.6_wp, &
                                         0.7_wp, 0.8_wp]
   type(communicator_t) :: comm, alone
   type(setting_t) :: setting
   character(len=16) :: words(2)
   integer :: d, n, nu, r, row, s, t, many
   real(wp) :: growth
   call get_command_argument(1, words(1))
   call get_command_argument(2, words(2))
   read (words(1), *) setting%steps
   read (words(2), *) many
   setting%settle = max(60, setting%steps/4)
   call comm%start()
   alone%comm = MPI_COMM_SELF
   row = 0
   do n = 1, 3
      do d = 1, 3
         do t = 1, 2
            do nu = 1, 3
               row = row + 1
               if (mod(row, comm%ranks) /= comm%rank) cycle
               setting%particles_per_cell = particle_numbers(n)
               setting%domain = domains(d)
               setting%affine = t == 2
               setting%poisson = poissons(nu)
               growth = 0.0_wp
               do s = 1, size(safeties)
                  if (growth <= hopeless) growth = 0.0_wp ! beyond the first failure all fail
                  do r = 1, 2*many
                     if (growth > hopeless) exit
                     setting%place = (r + 1)/2
                     setting%travelling = mod(r, 2) == 0
                     growth = max(growth, largest_growth(alone, setting, safeties(s)))
                  end do
                  print '(a,i3,3(1x,a),2f6.2,es12.4)', 'row', particle_numbers(n), trim(domain_names(d)), &
                     trim(transfers(t)), '', poissons(nu), safeties(s), min(growth, hopeless)
               end do
            end do
         end do
      end do
   end do
   call comm%finish()
end program map
