!test: check
!test: ranks 1 2
!> A small box flies into a long bar at rest: leaving out the blocks that are at rest changes no bit of any
!> particle, and neither does what blocks do ahead, nor of the sums over all. What resting blocks give to
!> their nodes is kept. With anti-locking, too: particles of a block at rest share cells with those of others.
program at_rest
   use m_kinds, only: wp, i8
   use m_errors, only: error_t
   use m_communicator, only: communicator_t
   use m_box, only: box_t
   use m_scene, only: scene_t, grid_spec_t, update_usl, update_usf, update_musl
   use m_materials, only: material_of
   use m_anti_locking, only: anti_locking_t
   use m_model, only: model_t
   use m_advance, only: advance
   use m_energy, only: sums_t, measure
   use m_assertions, only: assertions_t
   implicit none
   real(wp), parameter :: young = 1.0e6_wp, density = 1000.0_wp, cell = 0.125_wp
   real(wp), parameter :: box_share = 27.0_wp/(27.0_wp + 53.0_wp*9.0_wp) ! cells of the box, which never
                                                                         ! rests, of all
   integer, parameter :: codes(3) = [update_usl, update_usf, update_musl], steps = 60
   type(communicator_t) :: comm
   type(assertions_t) :: test
   integer :: u
   call comm%start()
   call test%start(comm, 'at rest')
   do u = 1, 3
      call hit(codes(u), .false.)
      call hit(codes(u), .true.)
   end do
   call work_ahead(2)
   call work_ahead(10)
   call test%finish()

contains

   subroutine hit(update, means)
      integer, intent(in) :: update
      logical, intent(in) :: means !< with anti-locking
      type(model_t) :: skipping, plain
      type(error_t) :: error
      real(wp) :: share
      integer :: b, kept, resting, step
      plain%skip_at_rest = .false.
      call build(skipping, comm, box_and_bar(update, 5.0_wp), means, error)
      call build(plain, comm, box_and_bar(update, 5.0_wp), means, error)
      kept = 0
      resting = 0
      do step = 1, steps
         call advance(skipping, 0.35_wp*cell/sqrt(young/density), error)
         call advance(plain, 0.35_wp*cell/sqrt(young/density), error)
         call test%check(.not. error%happened(), 'both go on')
         call test%check_equal(different_bits(skipping, plain), 0, 'the same bits')
         call test%check(abs(skipping%bounds%wave_speed - plain%bounds%wave_speed) <= 0.0_wp, &
                         'the same time step')
         do b = 1, size(skipping%levels(1)%blocks)
            associate (block => skipping%levels(1)%blocks(b))
               if (block%particles%count == 0 .or. .not. block%rests()) cycle
               resting = resting + 1
               if (block%has_resting_mass()) kept = kept + 1
            end associate
         end do
      end do
      kept = int(comm%sum_count(int(kept, i8)))
      resting = int(comm%sum_count(int(resting, i8)))
      if (comm%is_root()) print '(2(a,i0))', '  masses kept of resting blocks: ', kept, ' of ', resting
      call test%check(kept > 0.8_wp*resting, 'resting blocks keep their masses')
      share = real(comm%sum_count(skipping%particle_steps_at_rest), wp) &
              /comm%sum_count(skipping%particle_steps)
      if (comm%is_root()) print '(a,f5.1,a)', '  left out: ', 100.0_wp*share, ' % of the particle-steps'
      call test%check(share > 0.2_wp, 'some blocks rest')
      call test%check(share < 1.0_wp - 1.2_wp*box_share, 'a fifth more moves than the box: it wakes the bar')
      call test%check_equal(plain%particle_steps_at_rest, 0_i8, 'none is left out when told so')
      call skipping%release()
      call plain%release()
   end subroutine hit

   subroutine build(model, comm, scene, means, error)
      type(model_t), intent(inout) :: model
      type(communicator_t), intent(in) :: comm
      type(scene_t), intent(in) :: scene
      logical, intent(in) :: means
      type(error_t), intent(inout) :: error
      if (means) then
         allocate (model%effects(1))
         allocate (model%effects(1)%effect, source=anti_locking_t())
         model%effects(1)%effect%name = 'anti_locking'
      end if
      call model%build(comm, scene, error)
   end subroutine build

   !> With a short time step nothing leaves its block for long and all is done ahead; with a longer one the
   !> box goes over into the next block and its particles are sorted in between. Sums are taken ahead every
   !> third step.
   subroutine work_ahead(slower)
      integer, intent(in) :: slower
      type(model_t) :: ahead, plain
      type(error_t) :: error
      type(sums_t) :: early, late
      integer :: b, given, step
      plain%works_ahead = .false.
      call ahead%build(comm, box_and_bar(update_usl, 10.0_wp), error)
      call plain%build(comm, box_and_bar(update_usl, 10.0_wp), error)
      given = 0
      do step = 1, steps
         ahead%wants_sums = mod(step, 3) == 0
         call advance(ahead, 0.7_wp/slower*cell/sqrt(young/density), error)
         call advance(plain, 0.7_wp/slower*cell/sqrt(young/density), error)
         call test%check(.not. error%happened(), 'ahead: both go on')
         call test%check_equal(different_bits(ahead, plain), 0, 'ahead: the same bits')
         do b = 1, size(ahead%levels(1)%blocks)
            associate (block => ahead%levels(1)%blocks(b), other => plain%levels(1)%blocks(b))
               if (block%in_tile() > 0) given = given + 1
               call test%check_equal(other%in_tile(), 0, 'ahead: not where it is told not to')
               call test%check(block%rests() .or. ahead%wants_sums .or. .not. block%sums_hold(), &
                               'ahead: sums do not grow old')
            end associate
         end do
         early = measure(ahead)
         late = measure(plain)
         call test%check_equal(count(transfer(early, [0_i8]) /= transfer(late, [0_i8])), 0, &
                               'ahead: the same sums')
      end do
      given = int(comm%sum_count(int(given, i8)))
      if (comm%is_root()) print '(a,i0,a)', '  ahead: ', given, ' tiles'
      call test%check(given > 2*steps, 'ahead: some blocks give ahead')
      call ahead%release()
      call plain%release()
   end subroutine work_ahead

   !> Values of particles, over all blocks of this rank, whose bits differ between two models.
   integer function different_bits(a, b) result(different)
      type(model_t), intent(in) :: a, b
      integer :: i, c, n
      different = abs(size(a%levels(1)%blocks) - size(b%levels(1)%blocks))
      if (different > 0) return
      do i = 1, size(a%levels(1)%blocks)
         n = a%levels(1)%blocks(i)%particles%count
         different = different + abs(n - b%levels(1)%blocks(i)%particles%count)
         if (different > 0) return
         do c = 1, a%levels(1)%table%columns
            different = different + count(transfer(a%levels(1)%blocks(i)%particles%column(:n, c), [0_i8]) &
                                          /= transfer(b%levels(1)%blocks(i)%particles%column(:n, c), [0_i8]))
         end do
      end do
   end function different_bits

   function box_and_bar(update, speed) result(scene)
      integer, intent(in) :: update
      real(wp), intent(in) :: speed !< of the box, m/s
      type(scene_t) :: scene
      scene%title = 'box and bar'
      scene%end_time = 1.0_wp
      scene%grid = grid_spec_t(upper=cell*[64, 16, 16], cell_size=cell, cells=[64, 16, 16])
      scene%time%stress_update = update
      allocate (scene%materials(1), scene%bodies(2), scene%tools(0), scene%probes(0))
      scene%materials(1) = material_of('soft', 'elastic', density, young, 0.3_wp)
      scene%bodies(1)%name = 'box'
      scene%bodies(1)%material = 1
      scene%bodies(1)%shape = box_t(lower=cell*[1, 6, 6], upper=cell*[4, 9, 9])
      scene%bodies(1)%velocity = [speed, 0.3_wp, -0.2_wp]
      scene%bodies(2)%name = 'bar'
      scene%bodies(2)%material = 1
      scene%bodies(2)%shape = box_t(lower=cell*[9, 6, 6], upper=cell*[62, 9, 9])
   end function box_and_bar

end program at_rest
