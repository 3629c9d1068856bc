!test: ranks 1 2 4
!> Recovered stress (theory.md, eq. recovered) of made-up fields. A stress that is linear in space comes back
!> as it is: inside, at free surfaces, edges and corners, at a symmetry plane, at the edge of a level, on
!> either side of where two bodies touch, for all kinds of domains; what alternates from layer to layer is
!> gone; a single particle gets what it gets among all. In a sheet of one particle no slope is known across
!> it: there it is the mean. A linear stress that all particles of a cell have as it is in the middle of what
!> is in the cell, as steps make it, comes back within a thousandth of the largest, at free surfaces of whole
!> and of cut cells, level ones and (three thousandths) oblique ones.
program recovered_stress
   use mpi_f08
   use m_kinds, only: wp
   use m_errors, only: error_t
   use m_communicator, only: communicator_t
   use m_box, only: box_t
   use m_cylinder, only: cylinder_t
   use m_scene, only: scene_t
   use m_side_kinds, only: boundary_symmetry
   use m_domain_kinds, only: domain_fixed, domain_stretch, domain_corners
   use m_materials, only: material_of
   use m_model, only: model_t
   use m_recovered_stress, only: level_stress_t, recover_stress
   use m_recovered_at, only: recover_stress_at
   use m_assertions, only: assertions_t
   implicit none
   real(wp), parameter :: cell = 0.125_wp, low(3) = [0.0_wp, 0.31_wp, 0.33_wp], &
      length(3) = [1.0_wp, 1.25_wp, 1.125_wp]
   type(communicator_t) :: comm
   type(assertions_t) :: test
   call comm%start()
   call test%start(comm, 'recovered_stress')
   call look(domain_fixed, 8, 'cubes')
   call look(domain_fixed, 1, 'one a cell')
   call look(domain_fixed, 27, '27 a cell')
   call look(domain_stretch, 8, 'stretch')
   call look(domain_corners, 8, 'corners')
   call sheet()
   call by_cells(domain_fixed, 8, 0.0_wp, 'box of whole cells', 0.001_wp)
   call by_cells(domain_fixed, 8, 0.5_wp, 'box that ends within cells', 0.001_wp)
   call by_cells(domain_fixed, 27, 0.0_wp, '27 a cell, box of whole cells', 0.001_wp)
   call by_cells(domain_corners, 8, 0.5_wp, 'corners, box that ends within cells', 0.001_wp)
   call by_cells(domain_corners, 8, 0.0_wp, 'corners, oblique cylinder', 0.003_wp, oblique=.true.)
   call by_cells(domain_fixed, 1, 0.0_wp, 'one a cell, box', 0.001_wp)
   call test%finish()

contains

   subroutine look(domain, particles, name)
      integer, intent(in) :: domain, particles
      character(len=*), intent(in) :: name
      type(model_t) :: model, uniform
      type(scene_t) :: scene
      type(error_t) :: error
      call set_scene(scene, domain, particles)
      call model%build(comm, scene, error)
      call test%check(.not. error%happened(), name//': built')
      call give(model, linear=.true., alternate=.false.)
      call compare(model, name//', linear', .true., 1.0e-3_wp)
      call one_by_one(model, name)
      call model%release()
      if (particles /= 8) return
      scene%levels = scene%levels(:0) ! beside the edge of a level its own particles and larger ones are mixed
      call uniform%build(comm, scene, error)
      call give(uniform, linear=.false., alternate=.true.)
      call compare(uniform, name//', alternating', .false., 0.02_wp)
      call uniform%release()
   end subroutine look

   !> Two bodies, one on the other, from a symmetry plane on; a level around a part of both.
   subroutine set_scene(scene, domain, particles)
      type(scene_t), intent(out) :: scene
      integer, intent(in) :: domain, particles
      real(wp) :: middle(3)
      scene%title = 'made up'
      scene%grid%upper = 2.0_wp
      scene%grid%cell_size = cell
      scene%grid%cells = 16
      scene%grid%boundary(1) = boundary_symmetry
      scene%time%domain = domain
      allocate (scene%materials(1), scene%bodies(2), scene%tools(0), scene%probes(0), scene%levels(1))
      scene%materials(1) = material_of('rubber', 'elastic', 1000.0_wp, 1.0e6_wp, 0.3_wp)
      scene%bodies%material = 1
      scene%bodies%particles_per_cell = particles
      middle = low + length
      middle(3) = low(3) + 0.625_wp
      scene%bodies(1)%name = 'below'
      scene%bodies(1)%shape = box_t(lower=low, upper=middle)
      scene%bodies(2)%name = 'above'
      middle(1:2) = low(1:2)
      scene%bodies(2)%shape = box_t(lower=middle, upper=low + length)
      scene%levels(1)%lower = 0.0_wp
      scene%levels(1)%upper = [0.75_wp, 1.75_wp, 1.75_wp]
   end subroutine set_scene

   !> What the stress of a body is at a place, Pa; across the symmetry plane as a mirror image has it.
   pure function stress_at(body, x) result(s)
      integer, intent(in) :: body
      real(wp), intent(in) :: x(3)
      real(wp) :: s(6)
      s = [1 + 2*x(2) - 3*x(3), 4 - x(2) + 2*x(3), -2 + 3*x(2) + x(3), 2 - x(2) + x(3), 5*x(1), -4*x(1)]
      if (body == 2) s = [-7.0_wp, 2.0_wp, 5.0_wp, 1.0_wp, 0.0_wp, 0.0_wp] - 2.0_wp*s
      s = 1.0e4_wp*s
   end function stress_at

   !> Set the stress of all particles; `alternate`: of either sign from layer to layer of particles along z.
   subroutine give(model, linear, alternate)
      type(model_t), intent(inout) :: model
      logical, intent(in) :: linear, alternate
      real(wp) :: s(6), x(3)
      integer :: b, l, p
      do l = 1, size(model%levels)
         do b = 1, size(model%levels(l)%blocks)
            associate (at => model%levels(l)%layout, particles => model%levels(l)%blocks(b)%particles)
               do p = 1, particles%count
                  x = particles%column(p, at%position:at%position + 2)
                  s = 0.0_wp
                  if (linear) s = stress_at(particles%body(p), x)
                  if (alternate) &
                     s(1:3) = 1.0e4_wp*(-1)**floor((x(3) - low(3))/(0.5_wp*model%levels(l)%grid%cell))
                  particles%column(p, at%stress:at%stress + 5) = s
               end do
            end associate
         end do
      end do
   end subroutine give

   !> The largest difference from the linear field; or from 0 for the alternating one, more than a cell below
   !> the surfaces that cut its layers; over the largest stress.
   subroutine compare(model, name, linear, bound)
      type(model_t), intent(inout) :: model
      character(len=*), intent(in) :: name
      logical, intent(in) :: linear
      real(wp), intent(in) :: bound
      type(level_stress_t), allocatable :: recovered(:)
      real(wp) :: off, largest, at_surface
      integer :: b, l, p
      off = 0.0_wp
      at_surface = 0.0_wp
      largest = 0.0_wp
      call recover_stress(model, recovered)
      do l = 1, size(model%levels)
         do b = 1, size(model%levels(l)%blocks)
            associate (at => model%levels(l)%layout, particles => model%levels(l)%blocks(b)%particles)
               do p = 1, particles%count
                  associate (own => particles%column(p, at%stress:at%stress + 5))
                     largest = max(largest, maxval(abs(own)))
                     if (linear) off = max(off, maxval(abs(recovered(l)%blocks(b)%of(:, p) - own)))
                     if (linear) cycle
                     at_surface = max(at_surface, maxval(abs(recovered(l)%blocks(b)%of(:, p))))
                     if (.not. near_surface(particles%column(p, at%position + 2))) &
                        off = max(off, maxval(abs(recovered(l)%blocks(b)%of(:, p))))
                  end associate
               end do
            end associate
         end do
      end do
      largest = comm%maximum(largest)
      off = comm%maximum(off)/largest
      at_surface = comm%maximum(at_surface)/largest
      if (comm%is_root() .and. .not. linear) print '(3x,a,f5.2)', name//': at the surfaces ', at_surface
      call test%check(at_surface < 1.1_wp, name//': at surfaces no larger than it was')
      if (comm%is_root()) print '(3x,a,es9.2)', name//': off by ', off
      call test%check(off < bound, name)
   end subroutine compare

   !> True within a cell and a half of a body's ends along z.
   pure logical function near_surface(z)
      real(wp), intent(in) :: z !< m
      near_surface = any(abs(z - low(3) - [0.0_wp, 0.625_wp, length(3)]) < 1.5_wp*cell)
   end function near_surface

   !> Every 37th particle asked for alone, of each rank in turn.
   subroutine one_by_one(model, name)
      type(model_t), intent(inout) :: model
      character(len=*), intent(in) :: name
      type(level_stress_t), allocatable :: recovered(:)
      real(wp) :: off, stress(6)
      integer :: at(3), asked, b, l, most, n, r
      off = 0.0_wp
      asked = 0
      call recover_stress(model, recovered)
      do l = 1, size(model%levels)
         do r = 0, comm%ranks - 1
            most = nint(comm%maximum(merge(real(size(recovered(l)%blocks), wp), 0.0_wp, r == comm%rank)))
            do b = 1, most
               n = 0
               if (r == comm%rank) n = size(recovered(l)%blocks(b)%of, 2)
               n = nint(comm%maximum(real(n, wp)))
               at = 0
               if (n > 0 .and. r == comm%rank) at = [l, b, 1 + mod(37*b, n)]
               call recover_stress_at(model, at, stress)
               if (n > 0) asked = asked + 1
               if (at(3) > 0) off = max(off, maxval(abs(stress - recovered(l)%blocks(b)%of(:, at(3)))))
            end do
         end do
      end do
      call test%check(asked >= 8, name//': several were asked')
      call test%check(comm%maximum(off) < 1.0e-7_wp, name//': single particles as all of them')
   end subroutine one_by_one

   !> A free body whose particles have the linear stress in the middle of what is in their cell; `ends`: part
   !> of the cells at its upper ends that it fills.
   subroutine by_cells(domain, particles, ends, name, bound, oblique)
      integer, intent(in) :: domain, particles
      real(wp), intent(in) :: ends, bound
      character(len=*), intent(in) :: name
      logical, intent(in), optional :: oblique !< a cylinder whose axis is along no axis of the grid
      type(model_t) :: model
      type(scene_t) :: scene
      type(error_t) :: error
      type(level_stress_t), allocatable :: recovered(:)
      real(wp), allocatable :: middle(:, :, :, :) !< volume and volume times position
      real(wp) :: off, largest, x(3)
      integer :: b, c(3), p, pass
      call set_scene(scene, domain, particles)
      deallocate (scene%levels)
      allocate (scene%levels(0))
      scene%grid%boundary(1) = scene%grid%boundary(2)
      scene%bodies = scene%bodies(1:1)
      scene%bodies(1)%shape = box_t(lower=[3, 3, 3]*cell, upper=([9, 10, 11] + ends)*cell)
      if (present(oblique)) &
         scene%bodies(1)%shape = cylinder_t(center=[6.0_wp, 6.0_wp, 5.0_wp]*cell, radius=4.3_wp*cell, &
                                            height=7.7_wp*cell, axis=[0.36_wp, 0.48_wp, 0.8_wp])
      call model%build(comm, scene, error)
      call test%check(.not. error%happened(), name//': built')
      allocate (middle(0:3, 0:15, 0:15, 0:15), source=0.0_wp)
      off = 0.0_wp
      largest = 0.0_wp
      do pass = 1, 3
         if (pass == 2) call add_up(middle)
         if (pass == 3) call recover_stress(model, recovered)
         do b = 1, size(model%levels(1)%blocks)
            associate (at => model%levels(1)%layout, particles => model%levels(1)%blocks(b)%particles)
               do p = 1, particles%count
                  x = particles%column(p, at%position:at%position + 2)
                  c = int(x/cell)
                  if (pass == 1) middle(:, c(1), c(2), c(3)) = middle(:, c(1), c(2), c(3)) &
                                                               + particles%column(p, at%volume)*[1.0_wp, x]
                  if (pass == 2) particles%column(p, at%stress:at%stress + 5) = &
                     stress_at(1, middle(1:, c(1), c(2), c(3))/middle(0, c(1), c(2), c(3)))
                  if (pass < 3) cycle
                  largest = max(largest, maxval(abs(stress_at(1, x))))
                  off = max(off, maxval(abs(recovered(1)%blocks(b)%of(:, p) - stress_at(1, x))))
               end do
            end associate
         end do
      end do
      off = comm%maximum(off)/comm%maximum(largest)
      if (comm%is_root()) print '(3x,a,es9.2)', name//', cell by cell: off by ', off
      call test%check(off < bound, name//', cell by cell')
      call model%release()
   end subroutine by_cells

   !> Collective: sum over all ranks.
   subroutine add_up(values)
      real(wp), intent(inout), contiguous :: values(:, :, :, :)
      call MPI_Allreduce(MPI_IN_PLACE, values, size(values), MPI_DOUBLE_PRECISION, MPI_SUM, comm%comm)
   end subroutine add_up

   !> One particle thick: along the sheet linear, across it nothing is known.
   subroutine sheet()
      type(model_t) :: model
      type(scene_t) :: scene
      type(error_t) :: error
      call set_scene(scene, domain_fixed, 1)
      deallocate (scene%levels)
      allocate (scene%levels(0))
      scene%bodies = scene%bodies(1:1)
      scene%bodies(1)%shape = box_t(lower=[0.0_wp, 0.25_wp, 0.25_wp], upper=[1.0_wp, 1.5_wp, 0.375_wp])
      call model%build(comm, scene, error)
      call test%check(.not. error%happened(), 'sheet: built')
      call give(model, linear=.true., alternate=.false.)
      call compare(model, 'sheet', .true., 1.0e-3_wp)
      call model%release()
   end subroutine sheet

end program recovered_stress
