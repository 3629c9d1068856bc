!test: ranks 1 2
!> Motion within particles (theory.md, eq. inner-motion): a block that turns has exactly the kinetic energy
!> and the angular momentum of a rigid one, however few particles it is made of, and keeps them when its
!> particles are split, change level or merge. The control, plain transfer, lacks what turns within particles:
!> with n of them along an edge of a cube, 1/n^2.
program inner_motion_test
   use m_kinds, only: wp
   use m_errors, only: error_t
   use m_communicator, only: communicator_t
   use m_box, only: box_t
   use m_scene, only: scene_t, grid_spec_t
   use m_domain_kinds, only: domain_fixed, domain_stretch, domain_corners
   use m_materials, only: material_of
   use m_region, only: make_region
   use m_split, only: split_long, stuff_t
   use m_model, only: model_t
   use m_residence, only: change_pair
   use m_energy, only: sums_t, measure
   use m_assertions, only: assertions_t
   implicit none
   integer, parameter :: kinds(3) = [domain_fixed, domain_stretch, domain_corners], counts(3) = [1, 8, 27]
   character(len=7), parameter :: names(3) = ['fixed  ', 'stretch', 'corners']
   real(wp), parameter :: cell = 0.5_wp, density = 1000.0_wp
   !> 1/s, m/s
   real(wp), parameter :: spin(3) = [0.3_wp, -0.7_wp, 1.1_wp], speed(3) = [2.0_wp, 1.0_wp, -3.0_wp]
   type(communicator_t) :: comm
   type(assertions_t) :: test
   integer :: d, n
   call comm%start()
   call test%start(comm, 'inner_motion')
   do d = 1, 3
      do n = 1, 3
         call rigid(d, counts(n))
      end do
      call pieces(d)
   end do
   call plain()
   do d = 1, 3
      call levels(d)
   end do
   call test%finish()

contains

   !> A block of 2 x 3 x 4 cells that flies and turns about a skew axis.
   function block(d, particles_per_cell, low, high) result(scene)
      integer, intent(in) :: d, particles_per_cell, low(3), high(3) !< in cells
      type(scene_t) :: scene
      scene%title = 'block'
      scene%end_time = 1.0_wp
      scene%grid = grid_spec_t(upper=16.0_wp*cell*[1, 1, 1], cell_size=cell, cells=[16, 16, 16])
      scene%time%domain = kinds(d)
      allocate (scene%materials(1), scene%bodies(1), scene%tools(0), scene%probes(0))
      scene%materials(1) = material_of('soft', 'elastic', density, 1.0e5_wp, 0.0_wp)
      scene%bodies(1)%name = 'block'
      scene%bodies(1)%material = 1
      scene%bodies(1)%shape = box_t(lower=cell*low, upper=cell*high)
      scene%bodies(1)%particles_per_cell = particles_per_cell
      scene%bodies(1)%velocity = speed
      scene%bodies(1)%angular_velocity = spin
   end function block

   !> Kinetic energy and angular momentum about the origin of a rigid block between two corners (in cells),
   !> turning about its middle.
   subroutine exact(low, high, kinetic, angular)
      integer, intent(in) :: low(3), high(3)
      real(wp), intent(out) :: kinetic, angular(3)
      real(wp) :: mass, edge(3), own(3), middle(3)
      edge = cell*(high - low)
      middle = 0.5_wp*cell*(high + low)
      mass = density*product(edge)
      own = mass/12.0_wp*(sum(edge**2) - edge**2)*spin
      kinetic = 0.5_wp*mass*sum(speed**2) + 0.5_wp*dot_product(own, spin)
      angular = own + mass*[middle(2)*speed(3) - middle(3)*speed(2), middle(3)*speed(1) &
                            - middle(1)*speed(3), middle(1)*speed(2) - middle(2)*speed(1)]
   end subroutine exact

   subroutine check_rigid(sums, low, high, name)
      type(sums_t), intent(in) :: sums
      integer, intent(in) :: low(3), high(3)
      character(len=*), intent(in) :: name
      real(wp) :: kinetic, angular(3)
      call exact(low, high, kinetic, angular)
      call test%check_close(sums%kinetic, kinetic, 1.0e-13_wp*kinetic, name//', kinetic energy')
      call test%check_close(sums%angular_momentum, angular, 1.0e-13_wp*norm2(angular), name// &
                            ', angular momentum')
   end subroutine check_rigid

   subroutine rigid(d, particles_per_cell)
      integer, intent(in) :: d, particles_per_cell
      integer, parameter :: low(3) = [5, 6, 7], high(3) = [7, 9, 11]
      type(model_t) :: model
      type(error_t) :: error
      call model%build(comm, block(d, particles_per_cell, low, high), error)
      call check_rigid(measure(model), low, high, trim(names(d))//', as it stands')
      call model%release()
   end subroutine rigid

   !> Particles that have become too long are split.
   subroutine pieces(d)
      integer, intent(in) :: d
      integer, parameter :: low(3) = [5, 6, 7], high(3) = [7, 9, 11]
      type(model_t) :: model
      type(error_t) :: error
      type(sums_t) :: before, after
      real(wp) :: turn(3, 3)
      integer :: b, p, k, round, splits, worn_out, all
      if (kinds(d) == domain_fixed) return ! these are never split
      turn = 1.9_wp*reshape([0.6_wp, 0.8_wp, 0.3_wp, -0.8_wp, 0.6_wp, 0.0_wp, -0.2_wp, 0.0_wp, 1.0_wp], &
                            [3, 3])
      call model%build(comm, block(d, 1, low, high), error)
      associate (level => model%levels(1))
         do b = 1, size(level%blocks)
            associate (column => level%blocks(b)%particles%column, at => level%layout)
               do p = 1, level%blocks(b)%particles%count
                  if (at%domain > 0) then
                     column(p, at%domain:at%domain + 8) = &
                        reshape(matmul(turn, reshape(column(p, at%domain:at%domain + 8), [3, 3])), [9])
                  else
                     column(p, at%half_size:at%half_size + 2) = [1.3_wp, 2.9_wp, 0.7_wp] &
                        *column(p, at%half_size:at%half_size + 2)
                  end if
                  do k = 0, 8
                     column(p, at%gradient + k) = sin(real(p + 3*k, wp))
                  end do
               end do
            end associate
         end do
         before = measure(model)
         all = 0
         do round = 1, 9
            do b = 1, size(level%blocks)
               call split_long(level%blocks(b), level%table, level%layout, level%grid%cell, &
                               [stuff_t(density=1000.0_wp, modulus=1.0e6_wp)], splits, worn_out)
               all = all + splits
            end do
         end do
         after = measure(model)
      end associate
      call test%check(comm%maximum(real(all, wp)) > 20.0_wp, trim(names(d))//': particles are split')
      call test%check_close(after%kinetic, before%kinetic, 1.0e-13_wp*before%kinetic, trim(names(d))// &
                            ': split, kinetic energy')
      call test%check_close(after%angular_momentum, before%angular_momentum, &
                            1.0e-13_wp*norm2(before%angular_momentum), trim(names(d))// &
                            ': split, angular momentum')
      call model%release()
   end subroutine pieces

   !> Control: without gradients a cube that turns about its middle lacks exactly what turns within its
   !> particles.
   subroutine plain()
      integer, parameter :: low(3) = 6, high(3) = 9
      type(model_t) :: model
      type(error_t) :: error
      type(scene_t) :: scene
      type(sums_t) :: sums
      real(wp) :: kinetic, angular(3), flight
      scene = block(1, 1, low, high)
      scene%time%affine = .false.
      call model%build(comm, scene, error)
      sums = measure(model)
      call exact(low, high, kinetic, angular)
      flight = 0.5_wp*sums%mass*sum(speed**2)
      call test%check_close((kinetic - sums%kinetic)/(kinetic - flight), 1.0_wp/9.0_wp, 1.0e-12_wp, &
                            'plain transfer: lacks a ninth')
      call model%release()
   end subroutine plain

   !> A block inside a level, whose particles are small; the level goes elsewhere, and they merge; it comes
   !> back, and they are split.
   subroutine levels(d)
      integer, intent(in) :: d
      integer, parameter :: low(3) = [5, 5, 5], high(3) = [7, 8, 9]
      type(model_t) :: model
      type(error_t) :: error
      type(scene_t) :: scene
      integer :: first
      scene = block(d, 8, low, high)
      allocate (scene%levels(1))
      scene%levels(1)%lower = 3.0_wp*cell
      scene%levels(1)%upper = 11.0_wp*cell
      call model%build(comm, scene, error)
      first = int(comm%sum_count(model%particle_count()))
      call check_rigid(measure(model), low, high, 'inside a level')
      call place(model, [18, 18, 18], [30, 30, 30], error)
      call test%check(8*int(comm%sum_count(model%particle_count())) == first, 'all merge')
      call check_rigid(measure(model), low, high, 'merged')
      call test%check_close(comm%sum_real(sum(model%lost_in_merging)), 0.0_wp, 1.0e-13_wp*density, &
                            'merged: nothing is lost')
      call place(model, [6, 6, 6], [22, 22, 22], error)
      call test%check(int(comm%sum_count(model%particle_count())) == first, 'all are split again')
      call check_rigid(measure(model), low, high, 'split again')
      call model%release()
   end subroutine levels

   !> Move the box of level 2 to between two of its own nodes.
   subroutine place(model, from, to, error)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: from(3), to(3)
      type(error_t), intent(inout) :: error
      model%levels(2)%region = make_region(model%levels(2)%grid, from, to)
      call model%prepare_blocks(edges_moved=.true.)
      call change_pair(model, 1, error)
      call model%prepare_blocks()
      call test%check(.not. error%happened(), 'levels: the box is moved')
   end subroutine place

end program inner_motion_test
