!test: ranks 1 2
!> A quarter inside two symmetry planes against the whole of the same symmetric problem: the same particles,
!> place by place.
program quarter
   use mpi_f08
   use m_kinds, only: wp
   use m_errors, only: error_t
   use m_communicator, only: communicator_t
   use m_box, only: box_t
   use m_scene, only: scene_t, grid_spec_t, update_usl, update_musl
   use m_side_kinds, only: boundary_free, boundary_symmetry, boundary_roller
   use m_domain_kinds, only: domain_fixed, domain_stretch, domain_corners
   use m_materials, only: material_of
   use m_model, only: model_t
   use m_advance, only: advance
   use m_assertions, only: assertions_t
   use m_chance, only: keep_worst
   implicit none
   real(wp), parameter :: cell = 0.125_wp
   integer, parameter :: half = 4, high = 6, steps = 80, kept = 13
   type(communicator_t) :: comm
   type(assertions_t) :: test
   integer :: domain
   call comm%start()
   call test%start(comm, 'quarter')
   domain = domain_fixed
   call compare('elastic', affine=.true., update=update_usl, n=10, lower_side=.true.)
   call compare('neo_hookean', affine=.true., update=update_usl, n=8, lower_side=.true.)
   call compare('elastic', affine=.false., update=update_usl, n=8, lower_side=.false.)
   call compare('neo_hookean', affine=.true., update=update_musl, n=7, lower_side=.false.)
   call compare('neo_hookean', affine=.false., update=update_usl, n=9, lower_side=.false.)
   domain = domain_stretch
   call compare('elastic', affine=.true., update=update_usl, n=10, lower_side=.true.)
   call compare('neo_hookean', affine=.false., update=update_usl, n=8, lower_side=.false.)
   call compare('neo_hookean', affine=.true., update=update_musl, n=9, lower_side=.true.)
   domain = domain_corners
   call compare('elastic', affine=.true., update=update_usl, n=10, lower_side=.true.)
   call compare('neo_hookean', affine=.false., update=update_usl, n=8, lower_side=.false.)
   call compare('neo_hookean', affine=.true., update=update_musl, n=9, lower_side=.true.)
   call test%finish()

contains

   !> n: cells of the quarter's grid along x and y; the planes are its lower or its upper sides.
   subroutine compare(law, affine, update, n, lower_side)
      character(len=*), intent(in) :: law
      logical, intent(in) :: affine, lower_side
      integer, intent(in) :: update, n
      real(wp), allocatable :: whole(:, :), part(:, :)
      real(wp) :: off(4)
      integer :: p, found
      whole = run(scene_of(law, affine, update, n, whole=.true., lower_side=lower_side), n)
      part = run(scene_of(law, affine, update, n, whole=.false., lower_side=lower_side), n)
      off = 0.0_wp
      found = 0
      do p = 1, size(part, 2)
         if (part(1, p) <= 0.0_wp) cycle
         found = found + 1
         call keep_worst(off(1), maxval(abs(part(2:4, p) - whole(2:4, p)))/(2*half*cell))
         call keep_worst(off(2), maxval(abs(part(5:7, p) - whole(5:7, p)))/maxval(abs(whole(5:7, :))))
         call keep_worst(off(3), maxval(abs(part(8:13, p) - whole(8:13, p)))/maxval(abs(whole(8:13, :))))
         call keep_worst(off(4), (part(1, p) - whole(1, p))/whole(1, p))
      end do
      if (comm%is_root()) print '(3x,a12,a,i3,4(a,es8.1))', law, ' cells', n, '  place', off(1), &
         '  velocity', off(2), '  stress', off(3), '  volume', off(4)
      call test%check_equal(found, 2*half*2*half*2*high, 'particles of the quarter')
      call test%check_equal(count(whole(1, :) > 0.0_wp), 4*found, 'particles of the whole')
      call test%check_close(off, [0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp], 1.0e-12_wp, &
                            'a quarter moves as the whole does')
      call test%check(maxval(abs(whole(8:13, :))) > 1.0e4_wp, 'there is stress')
   end subroutine compare

   !> A box of 8 x 8 x 6 cells about the z axis, or its quarter; the planes stand at x = 0 and y = 0.
   function scene_of(law, affine, update, n, whole, lower_side) result(scene)
      character(len=*), intent(in) :: law
      logical, intent(in) :: affine, whole, lower_side
      integer, intent(in) :: update, n
      type(scene_t) :: scene
      integer :: low, up
      scene%title = law
      scene%end_time = 1.0_wp
      scene%time%affine = affine
      scene%time%domain = domain
      scene%time%stress_update = update
      low = merge(-1, 0, whole .or. .not. lower_side)
      up = merge(1, 0, whole .or. lower_side)
      scene%grid%cell_size = cell
      scene%grid%lower = cell*[low*n, low*n, 0]
      scene%grid%upper = cell*[up*n, up*n, 12]
      scene%grid%cells = [(up - low)*n, (up - low)*n, 12]
      scene%grid%boundary = boundary_free
      scene%grid%boundary(5) = boundary_roller
      if (low == 0) scene%grid%boundary([1, 3]) = boundary_symmetry
      if (up == 0) scene%grid%boundary([2, 4]) = boundary_symmetry
      allocate (scene%materials(1), scene%bodies(1), scene%tools(0), scene%probes(0))
      scene%materials(1) = material_of('soft', law, 1000.0_wp, 1.0e6_wp, 0.3_wp)
      scene%bodies(1)%name = 'box'
      scene%bodies(1)%material = 1
      scene%bodies(1)%shape = box_t(lower=cell*[low*half, low*half, 0], upper=cell*[up*half, up*half, high])
   end function scene_of

   !> After some steps: volume, place, velocity, stress of every particle in the column of the place where it
   !> began, turned into the quarter with x, y of either sign left as they are.
   function run(scene, n) result(values)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: n
      real(wp), allocatable :: values(:, :)
      type(model_t) :: model
      type(error_t) :: error
      real(wp), allocatable :: key_of(:)
      real(wp) :: x(3)
      integer :: b, p, step, per_row
      per_row = 4*n
      call model%build(comm, scene, error)
      call test%check(.not. error%happened(), 'the box is built')
      allocate (key_of(16*half*half*high*2), source=0.0_wp)
      do b = 1, size(model%levels(1)%blocks)
         associate (particles => model%levels(1)%blocks(b)%particles, at => model%levels(1)%layout)
            do p = 1, particles%count
               x = particles%column(p, at%position:at%position + 2)
               key_of(int(particles%id(p))) = 1 + floor(x(1)/(0.5_wp*cell)) + 2*n &
                  + per_row*(floor(x(2)/(0.5_wp*cell)) + 2*n + per_row*floor(x(3)/(0.5_wp*cell)))
               particles%column(p, at%velocity:at%velocity + 2) = thrown(x)
            end do
         end associate
      end do
      call MPI_Allreduce(MPI_IN_PLACE, key_of, size(key_of), MPI_DOUBLE_PRECISION, MPI_SUM, comm%comm)
      do step = 1, steps
         call advance(model, 0.4_wp*cell/37.0_wp, error)
         call test%check(.not. error%happened(), 'the box goes on')
         if (error%happened()) exit
      end do
      if (error%happened() .and. comm%is_root()) print '(3x,a)', error%message
      allocate (values(kept, per_row*per_row*2*high), source=0.0_wp)
      do b = 1, size(model%levels(1)%blocks)
         associate (particles => model%levels(1)%blocks(b)%particles, at => model%levels(1)%layout)
            do p = 1, particles%count
               values(:, nint(key_of(int(particles%id(p))))) = [particles%column(p, at%volume), &
                  particles%column(p, at%position:at%position + 2), &
                  particles%column(p, at%velocity:at%velocity + 2), &
                  particles%column(p, at%stress:at%stress + 5)]
            end do
         end associate
      end do
      call MPI_Allreduce(MPI_IN_PLACE, values, size(values), MPI_DOUBLE_PRECISION, MPI_SUM, comm%comm)
      call model%release()
   end function run

   !> Even in x and y: the box is blown up, and its top thrown higher in the middle.
   pure function thrown(x) result(velocity)
      real(wp), intent(in) :: x(3)
      real(wp) :: velocity(3)
      velocity(1:2) = 4.0_wp*x(1:2)*(1.0_wp + x(3) - 2.0_wp*(x(1)**2 + 0.5_wp*x(2)**2))
      velocity(3) = 3.0_wp*x(3)*(1.0_wp - 3.0_wp*x(1)**2 - x(2)**2)
   end function thrown

end program quarter
