!test: ranks 2
!test: limit 300
!> The recovered-stress estimate (theory.md, eq. recovered) against the true error of the particles' stress,
!> on the axis-aligned manufactured solution (m_manufactured). A particle's stress is that of its half cell,
!> so its error is of first order; the estimate must fall with it, and stay within 15 % of it. A uniform
!> stress has none, whatever the domains are, at free surfaces too.
program stress_error
   use m_kinds, only: wp
   use m_errors, only: error_t
   use m_communicator, only: communicator_t
   use m_box, only: box_t
   use m_scene, only: scene_t
   use m_domain_kinds, only: domain_fixed, domain_stretch, domain_corners
   use m_materials, only: material_of
   use m_model, only: model_t
   use m_indicators, only: stress_error_t, estimate_stress_error
   use m_assertions, only: assertions_t
   use m_manufactured, only: run_t, outcome_t, run
   implicit none
   integer, parameter :: grids(3) = [8, 12, 16]
   type(communicator_t) :: comm
   type(assertions_t) :: test
   call comm%start()
   call test%start(comm, 'stress_error')
   call converge(8, 1, domain_fixed, '8 particles a cell')
   call converge(27, 1, domain_fixed, '27 particles a cell')
   call converge(8, 1, domain_corners, 'corners')
   call converge(8, 2, domain_fixed, 'two levels')
   call uniform(domain_fixed, 'uniform')
   call uniform(domain_stretch, 'uniform, stretch')
   call uniform(domain_corners, 'uniform, corners')
   call test%finish()

contains

   !> Estimate over true error, and the orders of both, on three grids.
   subroutine converge(particles, levels, domain, name)
      integer, intent(in) :: particles, levels, domain
      character(len=*), intent(in) :: name
      real(wp), parameter :: band = 0.15_wp
      type(run_t) :: setting
      type(outcome_t) :: outcomes(size(grids))
      real(wp) :: order, ratio
      integer :: g
      do g = 1, size(grids)
         setting%cells = grids(g)
         setting%particles_per_cell = particles
         setting%levels = levels
         setting%domain = domain
         if (particles == 27) setting%safety = 0.35_wp
         setting%duration = 0.3_wp
         outcomes(g) = run(comm, setting)
         ratio = outcomes(g)%stress_estimate/outcomes(g)%stress_error
         if (comm%is_root()) print '(3x,a,i3,a,f8.5,a,f8.5,a,f6.3)', name//', ', grids(g), ' cells: true ', &
            outcomes(g)%stress_error, ', estimated ', outcomes(g)%stress_estimate, ', ratio ', ratio
         call test%check(.not. outcomes(g)%failed, name//': goes on')
         call test%check(abs(ratio - 1.0_wp) < band, name//': the estimate is near the error')
      end do
      order = log(outcomes(1)%stress_estimate/outcomes(3)%stress_estimate)/log(real(grids(3), wp)/grids(1))
      if (comm%is_root()) print '(3x,a,2f6.2)', name//': orders of the estimate and of the error ', order, &
         log(outcomes(1)%stress_error/outcomes(3)%stress_error)/log(real(grids(3), wp)/grids(1))
      call test%check(order > 0.85_wp .and. order < 1.3_wp, name//': the estimate is of first order')
   end subroutine converge

   !> A body that fills its cells only in part, free all round, and the edge of a level through it.
   subroutine uniform(domain, name)
      integer, intent(in) :: domain
      character(len=*), intent(in) :: name
      type(model_t) :: model
      type(scene_t) :: scene
      type(error_t) :: error
      type(stress_error_t) :: estimate
      integer :: b, l, p
      real(wp) :: highest
      scene%title = name
      scene%grid%upper = 2.0_wp
      scene%grid%cell_size = 0.125_wp
      scene%grid%cells = 16
      scene%time%domain = domain
      allocate (scene%materials(1), scene%bodies(1), scene%tools(0), scene%probes(0), scene%levels(1))
      scene%materials(1) = material_of('rubber', 'elastic', 1000.0_wp, 1.0e6_wp, 0.3_wp)
      scene%bodies(1)%name = 'box'
      scene%bodies(1)%material = 1
      scene%bodies(1)%shape = box_t(lower=[0.29_wp, 0.31_wp, 0.33_wp], &
                                    upper=[0.29_wp, 0.31_wp, 0.33_wp] + [1.0_wp, 1.25_wp, 1.125_wp])
      scene%levels(1)%lower = 0.25_wp
      scene%levels(1)%upper = [1.0_wp, 1.75_wp, 1.75_wp]
      call model%build(comm, scene, error)
      call test%check(.not. error%happened(), name//': built')
      highest = 0.0_wp
      do l = 1, size(model%levels)
         do b = 1, size(model%levels(l)%blocks)
            associate (s => model%levels(l)%layout%stress, particles => model%levels(l)%blocks(b)%particles)
               do p = 1, particles%count
                  particles%column(p, s:s + 5) = [1.0e4_wp, -2.0e4_wp, 3.0e3_wp, 5.0e3_wp, &
                                                  -7.0e3_wp, 1.0e3_wp]
               end do
            end associate
         end do
      end do
      call estimate_stress_error(model, estimate)
      highest = estimate%share()
      if (comm%is_root()) print '(3x,a,es9.2,a,es9.2,a)', name//' stress: estimated error ', highest, &
         ', beside edges ', estimate%beside, ' J'
      call test%check(highest < 1.0e-13_wp, name//' stress has no error')
      call test%check(estimate%beside <= estimate%squares .and. estimate%energy > 0.0_wp, name// &
                      ': edges of levels are counted')
      call test%check(abs(estimate%energy - 1.40625_wp*density_of_energy()) &
                      < 1.0e-9_wp*density_of_energy(), name//': energy')
      ! a jump of stress in the middle of the body must show
      do l = 1, size(model%levels)
         do b = 1, size(model%levels(l)%blocks)
            associate (at => model%levels(l)%layout, particles => model%levels(l)%blocks(b)%particles)
               do p = 1, particles%count
                  if (particles%column(p, at%position + 1) > 0.9_wp) &
                     particles%column(p, at%stress:at%stress + 5) = 0.0_wp
               end do
            end associate
         end do
      end do
      call estimate_stress_error(model, estimate)
      call test%check(estimate%share() > 0.05_wp, name//': a jump shows')
      call test%check(abs(estimate%place(2) - 0.9_wp) < 0.125_wp, name//': where it is')
      call model%release()
   end subroutine uniform

   !> sigma : C^-1 : sigma / 2 of the uniform stress from Young's modulus and Poisson's ratio, J/m3.
   pure real(wp) function density_of_energy()
      real(wp), parameter :: s(6) = [1.0e4_wp, -2.0e4_wp, 3.0e3_wp, 5.0e3_wp, -7.0e3_wp, 1.0e3_wp]
      density_of_energy = (1.3_wp*(sum(s(:3)**2) + 2.0_wp*sum(s(4:)**2)) - 0.3_wp*sum(s(:3))**2) &
                          /(2.0_wp*1.0e6_wp)
   end function density_of_energy

end program stress_error
