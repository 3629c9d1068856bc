!> Particle domains fixed, stretching and with corners: free flight, a block that turns, and a bar pulled to
!> four times its length, which fixed domains break.
program domains
   use m_kinds, only: wp
   use m_constants, only: pi
   use m_errors, only: error_t
   use m_text, only: to_text
   use m_communicator, only: communicator_t
   use m_materials, only: material_of
   use m_box, only: box_t
   use m_scene, only: scene_t, grid_spec_t
   use m_side_kinds, only: boundary_free, boundary_symmetry
   use m_domain_kinds, only: domain_fixed, domain_stretch, domain_corners
   use m_model, only: model_t
   use m_advance, only: advance
   use m_clock, only: clock_t
   use m_complaints, only: report_outside
   use m_grid_stages, only: particles_to_grid
   use m_schedule, only: by_blocks, shared_sums, nodal_solve
   use m_half_edges, only: half_edges
   use m_energy, only: sums_t, measure
   use m_assertions, only: assertions_t
   implicit none
   character(len=7), parameter :: names(3) = ['fixed  ', 'stretch', 'corners']
   integer, parameter :: kinds(3) = [domain_fixed, domain_stretch, domain_corners]
   real(wp), parameter :: cell = 0.5_wp, density = 1000.0_wp
   !> Bands of the density. Half edges up to 0.525 cells count as 0.5: 5 %. The mean over corners is a
   !> trapezoidal rule: 15 %.
   real(wp), parameter :: bands(3) = [0.15_wp, 0.05_wp, 0.15_wp]
   type(communicator_t) :: comm
   type(assertions_t) :: test
   integer :: d
   call comm%start()
   call test%start(comm, 'domains')
   do d = 1, 3
      call free_flight(d)
      call turn(d)
   end do
   call pushed(boundary_symmetry)
   call pushed(boundary_free)
   call thrown(boundary_symmetry)
   call thrown(boundary_free)
   print '(3x,a)', 'pulled to 4 lengths       pieces  density at inner nodes     splits  velocity off'
   do d = 1, 3
      call pull(d, 1)
      call pull(d, 8)
      call pull(d, 27)
   end do
   call test%finish()

contains

   !> A box of one material, from and to in cells.
   function box(d, cells, from, to, young, particles_per_cell) result(scene)
      integer, intent(in) :: d, cells(3), from(3), to(3), particles_per_cell
      real(wp), intent(in) :: young
      type(scene_t) :: scene
      scene%title = 'box'
      scene%end_time = 1.0_wp
      scene%grid = grid_spec_t(upper=cell*cells, cell_size=cell, cells=cells)
      scene%time%domain = kinds(d)
      allocate (scene%materials(1), scene%bodies(1), scene%tools(0), scene%probes(0))
      scene%materials(1) = material_of('soft', 'elastic', density, young, 0.0_wp)
      scene%bodies(1)%name = 'box'
      scene%bodies(1)%material = 1
      scene%bodies(1)%shape = box_t(lower=cell*from, upper=cell*to)
      scene%bodies(1)%particles_per_cell = particles_per_cell
   end function box

   !> A particle that has been pushed over a side: at a symmetry side its mirror image comes in; through a
   !> free side it leaves.
   subroutine pushed(boundary)
      integer, intent(in) :: boundary
      real(wp), parameter :: off = 1.0e-5_wp*cell, speed = 0.1_wp
      type(model_t) :: model
      type(scene_t) :: scene
      type(error_t) :: error
      type(sums_t) :: start, now
      integer :: p
      if (comm%ranks > 1) return ! the block is one rank's
      scene = box(2, [8, 8, 8], [0, 2, 2], [3, 5, 5], 1000.0_wp, 8)
      scene%grid%boundary(1) = boundary
      call model%build(comm, scene, error)
      associate (particles => model%levels(1)%blocks(1)%particles, at => model%levels(1)%layout)
         p = minloc(particles%column(:particles%count, at%position), dim=1)
         particles%column(p, at%position) = -off
         particles%column(p, at%velocity) = -speed
         particles%column(p, at%stress + 5) = 1.0_wp
         call particles%changed()
         start = measure(model)
         call advance(model, 1.0e-9_wp, error)
         call test%check(error%happened() .eqv. boundary == boundary_free, &
                         'a particle leaves through a free side alone')
         if (error%happened()) return
         p = maxloc(abs(particles%column(:particles%count, at%stress + 5)), dim=1)
         call test%check_close(particles%column(p, at%position)/off, 1.0_wp, 1.0e-3_wp, 'mirrored: place')
         call test%check_close(particles%column(p, at%velocity)/speed, 1.0_wp, 1.0e-3_wp, 'velocity')
         call test%check_close(particles%column(p, at%stress + 5), -1.0_wp, 1.0e-3_wp, 'shear stress')
         now = measure(model)
         call test%check_close(now%mass/start%mass, 1.0_wp, 1.0e-15_wp, 'and its mass is kept')
         call test%check_close(now%kinetic/start%kinetic, 1.0_wp, 1.0e-3_wp, 'and its energy')
      end associate
   end subroutine pushed

   !> A particle far beyond a side: material cannot leave through a symmetry side, so the message does not ask
   !> for a larger grid, and smaller steps are tried.
   subroutine thrown(boundary)
      integer, intent(in) :: boundary
      type(model_t) :: model
      type(scene_t) :: scene
      type(error_t) :: error
      logical :: free
      if (comm%ranks > 1) return
      scene = box(2, [8, 8, 8], [0, 2, 2], [3, 5, 5], 1000.0_wp, 8)
      scene%grid%boundary(1) = boundary
      call model%build(comm, scene, error)
      model%levels(1)%blocks(1)%particles%column(1, model%levels(1)%layout%position) = -15.0_wp*cell
      call report_outside(model, 1, 1, error)
      free = boundary == boundary_free
      call test%check(index(error%message, 'left the grid through its side x-; try a larger grid') > 0 &
                      .eqv. free, 'thrown: the grid is too small at a free side alone')
      call test%check(index(error%message, 'is 15 cells beyond the symmetry side x-, which material cannot') &
                      > 0 .neqv. free, 'thrown: beyond a symmetry side')
      call test%check(error%recoverable .neqv. free, 'thrown: smaller steps are tried')
   end subroutine thrown

   !> Without stress every particle goes straight on.
   subroutine free_flight(d)
      integer, intent(in) :: d
      real(wp), parameter :: velocity(3) = [1.0_wp, -0.7_wp, 0.4_wp], step = 0.11_wp
      integer, parameter :: steps = 100
      type(model_t) :: model
      type(scene_t) :: scene
      type(error_t) :: error
      type(sums_t) :: start, now
      real(wp) :: off(2), x(3)
      integer :: b, s
      scene = box(d, [40, 24, 16], [3, 18, 3], [7, 22, 6], 1000.0_wp, 8)
      scene%bodies(1)%velocity = velocity
      call model%build(comm, scene, error)
      start = measure(model)
      do s = 1, steps
         call advance(model, step, error)
      end do
      call test%check(.not. error%happened(), trim(names(d))//': free flight ends')
      now = measure(model)
      off = 0.0_wp
      do b = 1, size(model%levels(1)%blocks)
         associate (particles => model%levels(1)%blocks(b)%particles, at => model%levels(1)%layout)
            do s = 1, particles%count
               x = (particles%column(s, at%position:at%position + 2) - velocity*step*steps)/cell
               off(1) = max(off(1), maxval(abs(modulo(x, 0.5_wp) - 0.25_wp))) ! it started a quarter of a cell
                                                                              ! from a half cell
               off(2) = max(off(2), maxval(abs(half_edges(particles%column(s, :), at) - 0.25_wp*cell &
                                               *reshape([1, 0, 0, 0, 1, 0, 0, 0, 1], [3, 3]))))
            end do
         end associate
      end do
      call test%check_close(off, [0.0_wp, 0.0_wp], 1.0e-11_wp, trim(names(d))// &
                            ': free flight, places and domains')
      call test%check_close(now%momentum, start%momentum, 1.0e-12_wp*norm2(start%momentum), &
                            trim(names(d))//': free flight, momentum')
      call test%check(model%splits == 0, trim(names(d))//': free flight splits nothing')
      call model%release()
   end subroutine free_flight

   !> A block that makes a quarter of a turn about a skew axis: its angular momentum.
   subroutine turn(d)
      integer, intent(in) :: d
      type(model_t) :: model
      type(scene_t) :: scene
      type(error_t) :: error
      type(sums_t) :: start, now
      real(wp) :: drift
      integer :: s
      integer, parameter :: steps = 300
      scene = box(d, [16, 16, 16], [5, 5, 6], [11, 11, 10], 3.0e5_wp, 8)
      scene%bodies(1)%angular_velocity = 2.0_wp*pi*[0.6_wp, 0.0_wp, 0.8_wp]/10.0_wp
      call model%build(comm, scene, error)
      start = measure(model)
      do s = 1, steps
         call advance(model, 2.5_wp/steps, error)
      end do
      call test%check(.not. error%happened(), trim(names(d))//': the turn ends')
      now = measure(model)
      drift = norm2(now%angular_momentum - start%angular_momentum)/norm2(start%angular_momentum)
      print '(3x,2a,es10.2)', names(d), ': a quarter of a turn, angular momentum changed by', drift
      call test%check(drift < 0.025_wp, trim(names(d))// &
                      ': angular momentum within 2.5 % in a quarter of a turn')
      call test%check_close(now%mass, start%mass, 1.0e-13_wp*start%mass, trim(names(d))// &
                            ': mass of a block that turns')
      if (kinds(d) == domain_corners) call test%check_close(worst_volume(model), 0.0_wp, 1.0e-12_wp, &
                                                            'the volume of a domain is that of its particle')
      call model%release()
   end subroutine turn

   !> Largest difference between a particle's volume and that of its domain, relative.
   real(wp) function worst_volume(model)
      type(model_t), intent(in) :: model
      real(wp) :: r(3, 3), volume
      integer :: b, p
      worst_volume = 0.0_wp
      do b = 1, size(model%levels(1)%blocks)
         associate (particles => model%levels(1)%blocks(b)%particles, at => model%levels(1)%layout)
            do p = 1, particles%count
               r = half_edges(particles%column(p, :), at)
               volume = 8.0_wp*(r(1, 1)*(r(2, 2)*r(3, 3) - r(2, 3)*r(3, 2)) &
                                - r(1, 2)*(r(2, 1)*r(3, 3) - r(2, 3)*r(3, 1)) &
                                + r(1, 3)*(r(2, 1)*r(3, 2) - r(2, 2)*r(3, 1)))
               worst_volume = max(worst_volume, abs(volume/particles%column(p, at%volume) - 1.0_wp))
            end do
         end associate
      end do
   end function worst_volume

   !> v = a x from the middle of a bar too weak to resist: all speeds stay, the bar grows to 1 + a t lengths.
   subroutine pull(d, particles_per_cell)
      integer, intent(in) :: d, particles_per_cell
      integer, parameter :: middle = 20, steps = 60
      real(wp), parameter :: rate = 1.0_wp, step = 3.0_wp/steps
      type(model_t) :: model
      type(error_t) :: error
      type(sums_t) :: start, now
      real(wp) :: lowest, highest, off
      integer :: parts, s
      logical :: whole
      character(len=:), allocatable :: name
      call model%build(comm, box(d, [40, 8, 8], [middle - 4, 3, 3], [middle + 4, 5, 5], 1.0e-4_wp, &
                                 particles_per_cell), error)
      call set_pull(model, cell*middle, rate)
      start = measure(model)
      lowest = huge(lowest)
      highest = 0.0_wp
      do s = 1, steps
         call advance(model, step, error)
         call particles_to_grid(model, 1, model%time, 0.0_wp)
         call by_blocks(model, 1, clock_t(model%time), [shared_sums, nodal_solve], error)
         call inner_densities(model, middle, 1.0_wp + s*step*rate, lowest, highest)
      end do
      name = trim(names(d))//', '//to_text(particles_per_cell)//' a cell: '
      call test%check(.not. error%happened(), name//'the pull ends')
      now = measure(model)
      parts = pieces(model)
      off = velocity_off(model, cell*middle, rate/(1.0_wp + 3.0_wp*rate))
      print '(3x,a,i4,a,i8,2f10.4,i12,es13.2)', names(d), particles_per_cell, ' a cell ', parts, lowest, &
         highest, model%splits, off
      call test%check_close(now%mass, start%mass, 1.0e-13_wp*start%mass, name//'mass')
      call test%check_close(now%momentum, start%momentum, 1.0e-12_wp*sqrt(start%mass*start%kinetic), &
                            name//'momentum')
      whole = parts == 1 .and. lowest > 1.0_wp - bands(d) .and. highest < 1.0_wp + bands(d)
      if (kinds(d) == domain_fixed) then
         call test%check(.not. whole, name//'fixed domains do not hold the bar together')
         call test%check(parts > 1 .or. particles_per_cell > 1, name//'fixed domains come apart')
         call test%check(model%splits == 0, name//'fixed domains are not split')
      else
         call test%check(whole, name//'the bar stays one piece, its density within the band')
         call test%check(model%splits > 0, name//'particles were split')
      end if
      call test%check(off < 0.01_wp, name//'velocities stay linear within 1 %') ! the gradient that is carried
                                                                                ! is one step old
      call model%release()
   end subroutine pull

   subroutine set_pull(model, middle, rate)
      type(model_t), intent(inout) :: model
      real(wp), intent(in) :: middle, rate
      integer :: b, n
      do b = 1, size(model%levels(1)%blocks)
         associate (particles => model%levels(1)%blocks(b)%particles, at => model%levels(1)%layout)
            n = particles%count
            particles%column(:n, at%velocity) = rate*(particles%column(:n, at%position) - middle)
            particles%column(:n, at%gradient) = rate
         end associate
      end do
   end subroutine set_pull

   !> Bounds of the density at the nodes on the axis of the bar, two cells and more from its ends, over the
   !> exact one, of the bar that is `stretch` times as long as it was.
   subroutine inner_densities(model, middle, stretch, lowest, highest)
      type(model_t), intent(in) :: model
      integer, intent(in) :: middle
      real(wp), intent(in) :: stretch
      real(wp), intent(inout) :: lowest, highest
      real(wp) :: relative
      integer :: i, slot
      do i = middle - 20, middle + 20
         if (abs(i - middle) > 4.0_wp*stretch - 2.0_wp) cycle
         slot = model%levels(1)%slot_at([i/8, 0, 0], 1)
         relative = 0.0_wp
         if (slot > 0) relative = model%levels(1)%nodes(1, mod(i, 8) + 1, 5, 5, slot)*stretch &
            /(density*cell**3)
         lowest = min(lowest, relative)
         highest = max(highest, relative)
      end do
   end subroutine inner_densities

   !> Into how many pieces the bar has come apart: runs of node planes across it that particles touch, and no
   !> particle touches both the last plane of a run and the first of the next.
   integer function pieces(model)
      type(model_t), intent(in) :: model
      logical :: touched(0:40), tied(-1:40)
      real(wp) :: along, reach, place
      integer :: b, i, p, first, last
      touched = .false.
      tied = .false. ! plane i with plane i + 1
      do b = 1, size(model%levels(1)%blocks)
         associate (particles => model%levels(1)%blocks(b)%particles, at => model%levels(1)%layout)
            do p = 1, particles%count
               along = sum(abs(matmul([1.0_wp, 0.0_wp, 0.0_wp], half_edges(particles%column(p, :), at))))
               reach = 1.0_wp + min(0.5_wp, along/cell)
               place = particles%column(p, at%position)/cell
               first = ceiling(place - reach)
               last = floor(place + reach)
               touched(first:last) = .true.
               tied(first:last - 1) = .true.
            end do
         end associate
      end do
      pieces = 0
      do i = 0, 40
         if (.not. touched(i)) cycle
         if (tied(i - 1)) cycle
         pieces = pieces + 1
      end do
   end function pieces

   !> Largest error of the particles' velocities over the speed of the ends.
   real(wp) function velocity_off(model, middle, rate) result(off)
      type(model_t), intent(in) :: model
      real(wp), intent(in) :: middle, rate
      integer :: b, p
      off = 0.0_wp
      do b = 1, size(model%levels(1)%blocks)
         associate (particles => model%levels(1)%blocks(b)%particles, at => model%levels(1)%layout)
            do p = 1, particles%count
               off = max(off, abs(particles%column(p, at%velocity) &
                                  - rate*(particles%column(p, at%position) - middle)))
            end do
         end associate
      end do
      off = off/(16.0_wp*cell*rate)
   end function velocity_off

end program domains
