!test: ranks 2
!test: limit 3600
!test: long
!> The long version of axis_aligned: all updates of the stress, up to 64 cells an edge (2 million particles),
!> the effect of the amplitude, of the particles a cell, and of the first velocity. The bands are those of
!> axis_aligned, with its reasons.
program axis_aligned_long
   use m_kinds, only: wp
   use m_communicator, only: communicator_t
   use m_assertions, only: assertions_t
   use m_text, only: to_text
   use m_scene, only: update_usl, update_usf, update_musl
   use m_manufactured, only: run_t, series_t, outcome_t, run, run_series
   implicit none
   real(wp), parameter :: small = 0.001_wp, large = 0.05_wp !< m
   type(communicator_t) :: comm
   type(assertions_t) :: test
   call comm%start()
   call test%start(comm, 'axis_aligned_long')
   call first_velocity()
   call updates()
   call amplitudes()
   call particles()
   call fine_grids()
   call test%finish()

contains

   !> Velocities of the same instant as the positions start a leapfrog half a step wrong: first order in time.
   subroutine first_velocity()
      type(series_t) :: series
      series = run_series(comm, run_t(amplitude=small, staggered=.false.), [8, 16, 24, 32], &
                          'A = 0.001 m, affine, usl, first velocity that of the first positions')
      call in_band(series%last_order_l2, 0.8_wp, 1.7_wp, &
                   'velocity not staggered: order in L2 between the finest grids')
   end subroutine first_velocity

   subroutine updates()
      character(len=4), parameter :: names(3) = ['usl ', 'usf ', 'musl']
      character(len=6), parameter :: transfers(2) = ['plain ', 'affine']
      integer, parameter :: kinds(3) = [update_usl, update_usf, update_musl]
      type(series_t) :: series
      character(len=:), allocatable :: name
      integer :: t, u
      do u = 1, 3
         do t = 1, 2
            name = trim(names(u))//', '//trim(transfers(t))
            series = run_series(comm, run_t(amplitude=small, affine=t == 2, stress_update=kinds(u)), &
                                [8, 12, 16, 24], 'A = 0.001 m, '//name)
            call in_band(series%order_l2, 1.85_wp, 2.3_wp, name//', small: order in L2')
            series = run_series(comm, run_t(amplitude=large, affine=t == 2, stress_update=kinds(u)), &
                                [8, 12, 16, 24], 'A = 0.05 m, '//name)
            call in_band(series%order_l2, 0.9_wp, 1.9_wp, name//', large: order in L2')
         end do
      end do
   end subroutine updates

   !> How the error over A grows with A on one grid: what is of second order in space does not, what comes
   !> from the fixed domains goes as the strain.
   subroutine amplitudes()
      real(wp), parameter :: sizes(5) = [0.001_wp, 0.01_wp, 0.02_wp, 0.03_wp, 0.05_wp]
      type(outcome_t) :: outcome(2)
      integer :: a
      if (comm%is_root()) print '(/,a,/,a)', '24 cells, usl', &
         '   A / m   strain   plain L2 / A   affine L2 / A'
      do a = 1, size(sizes)
         outcome(1) = run(comm, run_t(cells=24, amplitude=sizes(a), affine=.false.))
         outcome(2) = run(comm, run_t(cells=24, amplitude=sizes(a), affine=.true.))
         if (comm%is_root()) print '(f8.3,f9.3,2f15.5)', sizes(a), 6.2831853_wp*sizes(a), outcome%l2/sizes(a)
         call test%check(.not. any(outcome%failed), 'amplitudes: runs')
      end do
   end subroutine amplitudes

   !> One particle a cell does not bear the large amplitude: at safety 0.1 as at 0.4, so the fault is one of
   !> space, not of time. Its lines are printed and not judged.
   subroutine particles()
      integer, parameter :: numbers(3) = [1, 8, 27]
      real(wp), parameter :: sizes(2) = [small, large]
      type(series_t) :: series
      integer :: a, n
      do a = 1, 2
         do n = 1, 3
            series = run_series(comm, run_t(amplitude=sizes(a), particles_per_cell=numbers(n)), &
                                [8, 12, 16, 24], 'A = '//to_text(sizes(a))// &
                                ' m, affine, usl, particles_per_cell='//to_text(numbers(n)))
            call test%check(.not. any(series%outcomes%failed), 'particles a cell: runs')
            if (a == 1) call in_band(series%order_l2, 1.8_wp, 2.3_wp, 'particles a cell, small: order in L2')
         end do
      end do
   end subroutine particles

   !> The small amplitude goes on converging. The large one stops, at an error a little under 1 % of A: that
   !> is what the fixed domains of uniform GIMP leave, and is held here so that it grows no worse; a better
   !> order is entry_margin.
   subroutine fine_grids()
      type(series_t) :: series
      series = run_series(comm, run_t(amplitude=small), [16, 32, 64], 'A = 0.001 m, affine, usl')
      call in_band(series%order_l2, 1.85_wp, 2.3_wp, 'to 64 cells, small: order in L2')
      series = run_series(comm, run_t(amplitude=large), [16, 32, 64], 'A = 0.05 m, affine, usl')
      call in_band(series%outcomes(2)%l2/large, 1.0e-4_wp, 0.0115_wp, '32 cells, large: error over A')
      call in_band(series%outcomes(3)%l2/large, 1.0e-4_wp, 0.0110_wp, '64 cells, large: error over A')
      call in_band(series%outcomes(3)%largest/large, 1.0e-4_wp, 0.04_wp, &
                   '64 cells, large: largest error over A')
   end subroutine fine_grids

   subroutine in_band(value, lowest, highest, name)
      real(wp), intent(in) :: value, lowest, highest
      character(len=*), intent(in) :: name
      call test%check_close(value, 0.5_wp*(lowest + highest), 0.5_wp*(highest - lowest), name)
   end subroutine in_band

end program axis_aligned_long
