!test: ranks 2
!test: limit 3600
!test: long
!> Largest stable `safety` (time step = safety cell/(c + |v|)) in three dimensions, by particles a cell,
!> transfer and stress update.
!>
!> A free block of neo-Hookean material rings for 2000 steps: a smooth mode of 1e-4 c, and on it a random
!> velocity of 1e-4 c for every particle, so that each mode of the grid is there from the start. The block
!> lies at several places of the grid, whose nodes at its surface so get anything from a full share of mass to
!> next to none; in half of the runs it also travels obliquely, at 0.02 c, so that its particles cross cells.
!> A run is unstable when the energy about its centre of mass exceeds twice the first; that energy stays
!> within a few per cent below the limit and multiplies above it. With affine transfer the first is the
!> largest of the first 60 steps, up to twice that at the start, much as in the map of test/stability: the
!> noise has gradients, which particles of affine transfer do not carry before the first step and which are no
!> part of the energy (`beginning`).
!>
!> What to expect, roughly: an outer node that one particle of half size l just touches has the mass m S and
!> the stiffness c^2 m (dS/dx)^2 a direction, so that its frequency is c/sqrt(l h) however little it has;
!> three such directions at a corner give c sqrt(3/(l h)), and a leapfrog 2/frequency: safety 2 sqrt(l/(3 h))
!> = 0.82, 0.58, 0.47 for 1, 8, 27 particles a cell; inside the body 1/sqrt(3) = 0.58. Measured at Poisson
!> 0.3: 0.55, 0.50, 0.45. Nearly incompressible material bears less: 0.45, 0.42, 0.37 at Poisson 0.49. Affine
!> transfer damps the shortest waves and bears a little more.
!>
!> Asserted: every line is stable up to the largest safety that the code should allow for its particles a cell
!> (`allowed`), and the sweep does find instability with usl, at 1.0. With usf and musl, whose stresses and
!> velocities belong to other instants than those of usl, the energy rises a little with the step without
!> growing on; only the wide bound is asserted there.
program stability_limit
   use mpi_f08, only: MPI_Allreduce, MPI_IN_PLACE, MPI_DOUBLE_PRECISION, MPI_MAX, MPI_COMM_SELF
   use m_kinds, only: wp
   use m_text, only: to_text
   use m_communicator, only: communicator_t
   use m_assertions, only: assertions_t
   use m_scene, only: update_usl, update_usf, update_musl
   use m_ringing, only: setting_t, largest_growth, places, hopeless
   implicit none

   integer, parameter :: steps = 2000
   integer, parameter :: settle = 60                        !< steps of which the largest energy counts as the
                                                            !< first, affine
   real(wp), parameter :: grown = 2.0_wp                    !< energy over the first one from which a run
                                                            !< counts as unstable
   real(wp), parameter :: kept = 1.05_wp                    !< energy over the first one that is still as it
                                                            !< should be
   integer, parameter :: particle_numbers(3) = [1, 8, 27]
   real(wp), parameter :: allowed(3) = [0.4_wp, 0.4_wp, 0.35_wp]
   real(wp), parameter :: safeties(11) = [0.3_wp, 0.35_wp, 0.4_wp, 0.45_wp, 0.5_wp, 0.55_wp, 0.6_wp, &
                                          0.65_wp, 0.7_wp, 0.8_wp, 1.0_wp]
   type(communicator_t) :: comm, alone
   type(assertions_t) :: test
   call comm%start()
   alone%comm = MPI_COMM_SELF
   call test%start(comm, 'stability_limit')
   call beginning()
   call sweep()
   call test%finish()

contains

   !> With a tenth of the step, too, the energy of a block with affine transfer rises at first: that is no
   !> instability. With plain it does not.
   subroutine beginning()
      real(wp) :: growth(2)
      integer :: t
      do t = 1, 2
         growth(t) = largest_growth(alone, setting_t(affine=t == 2, poisson=0.0_wp, place=6, steps=100), &
                                    0.03_wp)
      end do
      if (comm%is_root()) print '(a,2f8.4)', &
         'largest energy over the first in 100 steps of safety 0.03, plain and affine:', growth
      call test%check(growth(1) < 1.02_wp, 'plain transfer keeps the energy of noise')
      call test%check(growth(2) > 1.2_wp .and. growth(2) < 2.0_wp, 'affine transfer takes up its gradients')
   end subroutine beginning

   subroutine sweep()
      character(len=6), parameter :: transfers(2) = ['plain ', 'affine']
      integer :: n, t
      if (comm%is_root()) then
         print '(a,i0,a,i0,a)', 'largest energy over the first in ', steps, ' steps, worst of ', 2*places, &
            ' runs (-: above 10)'
         print '(a,11f7.2)', ' particles  transfer  update  poisson   safety', safeties
      end if
      do n = 1, 3
         do t = 1, 2
            call row(setting_t(particles_per_cell=particle_numbers(n), affine=t == 2), transfers(t), 'usl ')
            call row(setting_t(particles_per_cell=particle_numbers(n), affine=t == 2, poisson=0.49_wp), &
                     transfers(t), 'usl ')
         end do
      end do
      do t = 1, 2
         call row(setting_t(affine=t == 2, stress_update=update_usf), transfers(t), 'usf ')
         call row(setting_t(affine=t == 2, stress_update=update_musl), transfers(t), 'musl')
         call row(setting_t(affine=t == 2, poisson=0.0_wp), transfers(t), 'usl ')
      end do
   end subroutine sweep

   !> One line of the table.
   subroutine row(setting, transfer, update)
      type(setting_t), intent(in) :: setting
      character(len=*), intent(in) :: transfer, update
      type(setting_t) :: one
      character(len=7) :: words(size(safeties))
      real(wp) :: growth(size(safeties)), limit
      character(len=:), allocatable :: name
      integer :: r, s
      name = to_text(setting%particles_per_cell)//' a cell, '//trim(transfer)//', '//trim(update)// &
             ', Poisson '//to_text(setting%poisson)
      growth = 0.0_wp
      one = setting
      if (setting%affine) one%settle = settle
      do s = 1, size(safeties)
         do r = 1 + comm%rank, 2*places, comm%ranks ! each rank runs by itself
            one%place = (r + 1)/2
            one%travelling = mod(r, 2) == 0
            growth(s) = max(growth(s), largest_growth(alone, one, safeties(s)))
            if (growth(s) > hopeless) exit
         end do
      end do
      call MPI_Allreduce(MPI_IN_PLACE, growth, size(growth), MPI_DOUBLE_PRECISION, MPI_MAX, comm%comm)
      do s = 1, size(safeties)
         write (words(s), '(f7.2)') min(growth(s), hopeless)
         if (growth(s) > hopeless) words(s) = '      -'
      end do
      s = findloc(growth > grown, .true., dim=1)
      if (s == 0) s = size(safeties) + 1
      limit = 0.0_wp
      if (s > 1) limit = safeties(s - 1)
      if (comm%is_root()) print '(i10,2x,a,4x,a,f9.2,9x,11a,a,f5.2)', setting%particles_per_cell, &
         transfer, update, setting%poisson, words, '   stable to', limit
      limit = allowed(findloc(particle_numbers, setting%particles_per_cell, dim=1))
      call test%check(maxval(growth, mask=safeties <= limit) <= merge(kept, grown, setting%stress_update == &
         update_usl), name//': stable up to the allowed safety')
      if (setting%stress_update == update_usl) &
         call test%check(growth(size(safeties)) > grown, name//': unstable at 1.0')
   end subroutine row

end program stability_limit
