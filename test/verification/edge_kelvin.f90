!test: ranks 2
!test: limit 200
!> Stress beside the edge of a level in equilibrium, against an exact solution: Kelvin's point force in an
!> infinite solid, outside of the body, whose nodes near its surface are where Kelvin has them; on the side
!> away from the force they bear what his stress makes of them. The particles' lattice lies aside of the
!> grid's. On both sides of the edge the pressure is as good as that of a grid as coarse everywhere, also
!> where nearly nothing changes its volume; without anti-locking it is not (theory.md, Cells of anti-locking
!> at an edge).
program edge_kelvin
   use m_kinds, only: wp
   use m_constants, only: pi
   use m_errors, only: error_t
   use m_communicator, only: communicator_t
   use m_box, only: box_t
   use m_scene, only: scene_t
   use m_domain_kinds, only: domain_fixed
   use m_boundary, only: motion_parity
   use m_materials, only: material_of
   use m_anti_locking, only: anti_locking_t
   use m_model, only: model_t
   use m_static_system, only: static_system_t
   use m_static_nodes, only: tile_node
   use m_static_levels, only: collect
   use m_static_means, only: push_nodes
   use m_static_motion, only: take_along
   use m_recovered_stress, only: level_stress_t, recover_stress
   use m_trial_state, only: trial_status_t
   use m_assertions, only: assertions_t
   implicit none
   integer, parameter :: cells = 12, offsets = 3
   real(wp), parameter :: young = 1.0_wp, force(3) = [1.0e-5_wp, 0.0_wp, 0.0_wp], &
                          place(3) = [-2.0_wp, 6.0_wp, 6.0_wp] !< Pa, N, m: cells are of 1 m
   real(wp), parameter :: edge(3, 2) = reshape([0.0_wp, 4.0_wp, 4.0_wp, 6.0_wp, 8.0_wp, 8.0_wp], [3, 2])
   real(wp), parameter :: rim = 1.6_wp !< nodes so near to the body's surface are held, m
   !> Of the particles' lattice against the grid, m.
   real(wp), parameter :: shift(3, offsets) = reshape([-0.09_wp, -0.05_wp, 0.12_wp, 0.21_wp, 0.07_wp, &
                                                       -0.16_wp, 0.0_wp, 0.0_wp, 0.0_wp], [3, offsets])

   !> Errors, in the local size of what is looked at: squares times volume, volume, largest.
   type :: errors_t
      real(wp) :: squares = 0.0_wp, volume = 0.0_wp, largest = 0.0_wp
   end type errors_t

   !> Of pressure, recovered pressure and von Mises stress, within two cells of the edge and farther out.
   type :: found_t
      type(errors_t) :: near(3), far(3)
   end type found_t

   type(communicator_t) :: comm
   type(assertions_t) :: test
   type(found_t) :: coarse, composite, locked
   real(wp), parameter :: ratios(2) = [0.33_wp, 0.49_wp]
   character(len=7) :: name
   integer :: n
   call comm%start()
   call test%start(comm, 'edge_kelvin')
   if (comm%is_root()) print '(3x,a)', '%: pressure, recovered, von Mises: rms, largest; within two cells'// &
      ' of the edge | farther out'
   do n = 1, size(ratios)
      write (name, '(a,f4.2)') 'nu ', ratios(n)
      coarse = errors_of(ratios(n), .false., .true., name//', coarse')
      composite = errors_of(ratios(n), .true., .true., name//', a level')
      call test%check(rms(composite%near(1)) < 1.25_wp*rms(coarse%near(1)), name//': pressure, rms')
      call test%check(composite%near(1)%largest < 1.9_wp*coarse%near(1)%largest, name//': pressure, largest')
      call test%check(rms(composite%near(2)) < 0.03_wp, name//': recovered pressure, rms')
      call test%check(rms(composite%near(3)) < 1.25_wp*rms(coarse%near(3)), name//': von Mises, rms')
      call test%check(rms(composite%far(1)) < 1.25_wp*rms(coarse%far(1)), name//': pressure farther out')
   end do
   locked = errors_of(0.49_wp, .true., .false., 'nu 0.49, without anti-locking')
   call test%check(rms(locked%near(1)) > 5.0_wp*rms(composite%near(1)), &
                   'control: without anti-locking the pressure is wrong')
   call test%finish()

contains

   !> Collective: the errors of all offsets together.
   function errors_of(poisson, has_level, means, name) result(found)
      real(wp), intent(in) :: poisson
      logical, intent(in) :: has_level, means !< means: anti-locking
      character(len=*), intent(in) :: name
      type(found_t) :: found
      integer :: n
      do n = 1, offsets
         call solve(poisson, has_level, means, shift(:, n), found)
      end do
      call share(found%near)
      call share(found%far)
      if (comm%is_root()) print '(3x,a30,3(2f8.2),a,3(2f8.2))', name, &
         (100.0_wp*rms(found%near(n)), 100.0_wp*found%near(n)%largest, n=1, 3), ' |', &
         (100.0_wp*rms(found%far(n)), 100.0_wp*found%far(n)%largest, n=1, 3)
   end function errors_of

   !> Collective: sums of all ranks.
   subroutine share(errors)
      type(errors_t), intent(inout) :: errors(:)
      integer :: n
      do n = 1, size(errors)
         errors(n)%squares = comm%sum_real(errors(n)%squares)
         errors(n)%volume = comm%sum_real(errors(n)%volume)
         errors(n)%largest = comm%maximum(errors(n)%largest)
      end do
   end subroutine share

   !> Collective: the equilibrium of one lattice; its errors are added.
   subroutine solve(poisson, has_level, means, shift, found)
      real(wp), intent(in) :: poisson, shift(3)
      logical, intent(in) :: has_level, means
      type(found_t), intent(inout) :: found
      type(model_t), target :: model
      type(static_system_t) :: system
      type(level_stress_t), allocatable :: recovered(:)
      type(scene_t) :: scene
      type(error_t) :: error
      type(trial_status_t) :: verdict
      real(wp), allocatable :: exact(:), z(:), left(:), load(:)
      logical, allocatable :: held(:), bears(:)
      integer :: l
      call describe(scene, poisson, has_level, shift)
      allocate (model%effects(merge(1, 0, means)))
      if (means) then
         allocate (model%effects(1)%effect, source=anti_locking_t())
         model%effects(1)%effect%name = 'anti_locking'
      end if
      call model%build(comm, scene, error)
      call test%check(.not. error%happened(), 'built')
      call system%begin(model, 0.0_wp, 1.0_wp, scene%quasi_static%stabilisation)
      call know(system, model, poisson, shift, exact, held, bears)
      allocate (z(system%size()), left(system%size()), source=0.0_wp)
      call system%evaluate(z, left, verdict)
      call system%linearise(with_loads=.true.)
      load = merge(-forces_of_exact(system, model, poisson), 0.0_wp, bears)
      call conjugate_gradients(system, merge(exact, 0.0_wp, held), held, load, z)
      call system%evaluate(z, left, verdict)
      do l = size(model%levels), 1, -1
         call take_along(model, l, 1.0_wp, 1, system%levels(l), error)
      end do
      call test%check(.not. error%happened(), 'solved')
      call recover_stress(model, recovered)
      call compare(model, recovered, poisson, shift, found)
      call model%release()
   end subroutine solve

   subroutine describe(scene, poisson, has_level, shift)
      type(scene_t), intent(out) :: scene
      real(wp), intent(in) :: poisson, shift(3)
      logical, intent(in) :: has_level
      scene%title = 'Kelvin'
      scene%end_time = 1.0_wp
      scene%grid%upper = real(cells, wp)
      scene%grid%cell_size = 1.0_wp
      scene%grid%cells = cells
      scene%time%domain = domain_fixed
      scene%quasi_static%present = .true.
      scene%quasi_static%step = 1.0_wp
      allocate (scene%materials(1), scene%bodies(1), scene%tools(0), scene%probes(0))
      scene%materials(1) = material_of('m', 'elastic', 1.0_wp, young, poisson)
      scene%bodies(1)%name = 'block'
      scene%bodies(1)%material = 1
      scene%bodies(1)%shape = box_t(lower=1.0_wp + shift, upper=cells - 1.0_wp + shift)
      scene%bodies(1)%particles_per_cell = 8
      allocate (scene%levels(merge(1, 0, has_level)))
      if (.not. has_level) return
      scene%levels(1)%lower = edge(:, 1)
      scene%levels(1)%upper = edge(:, 2)
   end subroutine describe

   !> Kelvin's displacements of all unknowns, m, which of them are held, and which bear forces.
   subroutine know(system, model, poisson, shift, exact, held, bears)
      type(static_system_t), intent(in) :: system
      type(model_t), intent(in) :: model
      real(wp), intent(in) :: poisson, shift(3)
      real(wp), allocatable, intent(out) :: exact(:)
      logical, allocatable, intent(out) :: held(:), bears(:)
      real(wp) :: x(3), u(3)
      integer :: l, n
      allocate (exact(system%size()), source=0.0_wp)
      allocate (held(system%size()), bears(system%size()), source=.false.)
      do l = 1, size(model%levels)
         associate (level => model%levels(l), mine => system%levels(l))
            do n = 1, mine%unknowns%count
               associate (at => mine%unknowns%at(:, n))
                  x = level%grid%lower + level%grid%cell*tile_node(level, at(5), at(2:4))
                  u = displacement(x - place, poisson)
                  exact(mine%before + n) = u(at(1))
                  held(mine%before + n) = any(x < 1.0_wp + shift + rim) .or. &
                                          any(x(2:) > cells - 1.0_wp + shift(2:) - rim)
                  bears(mine%before + n) = x(1) > cells - 1.0_wp + shift(1) - rim
               end associate
            end do
         end associate
      end do
   end subroutine know

   !> Collective: what Kelvin's stress does to all unknowns, N.
   function forces_of_exact(system, model, poisson) result(forces)
      type(static_system_t), intent(inout) :: system
      type(model_t), intent(inout) :: model
      real(wp), intent(in) :: poisson
      real(wp) :: forces(system%size()), x(3), s(6)
      integer :: b, l, p
      do l = 1, size(model%levels)
         call system%levels(l)%clear_forces()
         do b = 1, size(model%levels(l)%blocks)
            associate (at => model%levels(l)%layout, particles => model%levels(l)%blocks(b)%particles, &
                       acting => system%levels(l)%trial(b)%acting)
               do p = 1, particles%count
                  x = particles%column(p, at%position:at%position + 2)
                  s = stress(x - place, poisson)
                  acting(p, :9) = -particles%column(p, at%volume)*s([1, 6, 5, 6, 2, 4, 5, 4, 3])
               end do
            end associate
         end do
         call push_nodes(system%levels(l), model, l)
      end do
      call collect(system%levels, model, motion_parity, forces)
   end function forces_of_exact

   !> Collective: the displacements z that balance all unknowns but those that are held, where `given` has
   !> them.
   subroutine conjugate_gradients(system, given, held, load, z)
      type(static_system_t), intent(inout) :: system
      real(wp), intent(in) :: given(:), load(:)
      logical, intent(in) :: held(:)
      real(wp), intent(out) :: z(:)
      real(wp) :: left(size(z)), way(size(z)), product(size(z)), better(size(z)), before, now, first
      integer :: step
      z = given
      call system%multiply(z, product)
      left = merge(0.0_wp, load - product, held)
      better = left/system%bare
      way = better
      now = system%dot(left, better)
      first = now
      do step = 1, 3000
         call system%multiply(way, product)
         product = merge(0.0_wp, product, held)
         z = z + now/system%dot(way, product)*way
         left = left - now/system%dot(way, product)*product
         better = left/system%bare
         before = now
         now = system%dot(left, better)
         if (now < 1.0e-20_wp*first) exit
         way = better + now/before*way
      end do
      call test%check(now < 1.0e-20_wp*first, 'balanced')
   end subroutine conjugate_gradients

   !> Add the errors of the particles that are not near what is held.
   subroutine compare(model, recovered, poisson, shift, found)
      type(model_t), intent(in) :: model
      type(level_stress_t), intent(in) :: recovered(:)
      real(wp), intent(in) :: poisson, shift(3)
      type(found_t), intent(inout) :: found
      real(wp) :: x(3), own(6), exact(6), volume, off(3)
      integer :: b, l, p
      do l = 1, size(model%levels)
         do b = 1, size(model%levels(l)%blocks)
            associate (at => model%levels(l)%layout, particles => model%levels(l)%blocks(b)%particles)
               do p = 1, particles%count
                  x = particles%column(p, at%position:at%position + 2)
                  if (any(x < 2.0_wp + rim + shift .or. x > cells - 2.0_wp - rim + shift)) cycle
                  own = particles%column(p, at%stress:at%stress + 5)
                  exact = stress(x - place, poisson)
                  volume = particles%column(p, at%volume)
                  off = [pressure(own)/pressure(exact), pressure(recovered(l)%blocks(b)%of(:, p)) &
                         /pressure(exact), mises(own)/mises(exact)] - 1.0_wp
                  if (from_edge(x) < 2.0_wp) then
                     call add(found%near, off, volume)
                  else if (any(x < edge(:, 1) .or. x > edge(:, 2))) then
                     call add(found%far, off, volume)
                  end if
               end do
            end associate
         end do
      end do
   end subroutine compare

   elemental subroutine add(self, off, volume)
      type(errors_t), intent(inout) :: self
      real(wp), intent(in) :: off, volume
      self%squares = self%squares + volume*off**2
      self%volume = self%volume + volume
      self%largest = max(self%largest, abs(off))
   end subroutine add

   elemental real(wp) function rms(self)
      type(errors_t), intent(in) :: self
      rms = sqrt(self%squares/self%volume)
   end function rms

   !> Distance from the faces of the region that lie in the body, along the axes, m.
   pure real(wp) function from_edge(x) result(distance)
      real(wp), intent(in) :: x(3)
      real(wp) :: out(3)
      out = max(edge(:, 1) - x, x - edge(:, 2), 0.0_wp)
      out(1) = max(x(1) - edge(1, 2), 0.0_wp)
      distance = maxval(out)
      if (distance > 0.0_wp) return
      distance = min(minval(abs(x(2:) - edge(2:, 1))), minval(abs(x - edge(:, 2))))
   end function from_edge

   !> Kelvin's displacement, m.
   pure function displacement(r, poisson) result(u)
      real(wp), intent(in) :: r(3), poisson
      real(wp) :: u(3), far
      far = norm2(r)
      u = (1.0_wp + poisson)/(8.0_wp*pi*young*(1.0_wp - poisson)*far) &
          *((3.0_wp - 4.0_wp*poisson)*force + r*dot_product(r, force)/far**2)
   end function displacement

   !> His stress: xx yy zz yz xz xy, Pa.
   pure function stress(r, poisson) result(s)
      real(wp), intent(in) :: r(3), poisson
      integer, parameter :: first(6) = [1, 2, 3, 2, 1, 1], second(6) = [1, 2, 3, 3, 3, 2]
      real(wp) :: s(6), n(3), along, far
      far = norm2(r)
      n = r/far
      along = dot_product(n, force)
      s = (1.0_wp - 2.0_wp*poisson)*(n(first)*force(second) + n(second)*force(first) &
                                     - merge(along, 0.0_wp, first == second)) &
          + 3.0_wp*along*n(first)*n(second)
      s = -s/(8.0_wp*pi*(1.0_wp - poisson)*far**2)
   end function stress

   pure real(wp) function pressure(s)
      real(wp), intent(in) :: s(6)
      pressure = -sum(s(:3))/3.0_wp
   end function pressure

   pure real(wp) function mises(s)
      real(wp), intent(in) :: s(6)
      mises = sqrt(1.5_wp*(sum((s(:3) - sum(s(:3))/3.0_wp)**2) + 2.0_wp*sum(s(4:)**2)))
   end function mises

end program edge_kelvin
