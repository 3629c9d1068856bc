!test: ranks 1 2 4
!> A tool that is pressed into one end of a beam whose blocks are on several ranks gives what one rank gives,
!> though some of them have no contact point; also after the blocks have been placed anew.
program end_of_a_beam
   use m_kinds, only: wp, i8
   use m_errors, only: error_t
   use m_communicator, only: communicator_t
   use m_box, only: box_t
   use m_sphere, only: sphere_t
   use m_scene, only: scene_t, grid_spec_t, tool_spec_t
   use m_materials, only: material_of
   use m_model, only: model_t
   use m_advance, only: advance
   use m_wandering, only: alone
   use m_assertions, only: assertions_t
   implicit none
   type(communicator_t) :: comm
   type(assertions_t) :: test
   call comm%start()
   call test%start(comm, 'end_of_a_beam')
   call press()
   call test%finish()

contains

   !> A beam of 8 x 1 x 1 blocks, its blocks on the ranks in turn along it, and a sphere pressed into one end.
   subroutine press()
      type(scene_t) :: scene
      type(model_t) :: model, single
      type(error_t) :: error
      integer :: step, idle
      real(wp) :: apart
      call make_scene(scene)
      call model%build(comm, scene, error)
      call single%build(alone(), scene, error)
      call test%check(.not. error%happened(), 'the beam is there')
      if (error%happened()) return
      idle = 0
      apart = 0.0_wp
      do step = 1, 40
         call advance(model, 0.5e-12_wp, error)
         call advance(single, 0.5e-12_wp, error)
         if (error%happened()) exit
         idle = max(idle, int(comm%sum_count(merge(1_i8, 0_i8, model%contact%candidates%count == 0))))
         apart = max(apart, norm2(model%contact%states(1)%load - single%contact%states(1)%load))
      end do
      call test%check(.not. error%happened(), 'forty steps')
      if (error%happened()) return
      if (comm%is_root()) print '(3x,a,i0,a,es9.2,a)', 'ranks without contact points: ', idle, &
         '; load on the tool ', model%contact%states(1)%load(3), ' N'
      call test%check(model%contact%states(1)%load(3) > 0.0_wp, 'the tool is pressed')
      call test%check(idle > 0 .or. comm%ranks == 1, 'some ranks have no contact point')
      call test%check(apart <= 1.0e-6_wp*norm2(single%contact%states(1)%load), 'loads are those of one rank')
      call test%check(model%contact%solves == single%contact%solves .and. model%contact%solves > 10, &
                      'every rank knows how many problems there were')
      call test%check(model%contact%handled == single%contact%handled, 'and of how many candidates')
      call model%rebalance(error, 500)
      do step = 1, 5
         call advance(model, 0.5e-12_wp, error)
         call advance(single, 0.5e-12_wp, error)
      end do
      call test%check(.not. error%happened(), 'steps after that')
      call test%check(norm2(model%contact%states(1)%load - single%contact%states(1)%load) <= &
                      1.0e-6_wp*norm2(single%contact%states(1)%load), 'loads are those of one rank again')
      call single%release()
      call model%release()
   end subroutine press

   subroutine make_scene(scene)
      type(scene_t), intent(out) :: scene
      real(wp), parameter :: h = 64.0e-9_wp
      scene%grid = grid_spec_t(upper=[72*h, 16*h, 16*h], cell_size=h, cells=[72, 16, 16])
      scene%end_time = 1.0_wp
      allocate (scene%materials(1), scene%bodies(1), scene%probes(0))
      scene%materials(1) = material_of('aluminium', 'elastic', 2710.0_wp, 70.0e9_wp, 0.33_wp)
      scene%bodies(1)%name = 'beam'
      scene%bodies(1)%material = 1
      scene%bodies(1)%shape = box_t(upper=[64*h, 8*h, 8*h])
      allocate (scene%tools(1))
      scene%tools(1)%name = 'ball'
      allocate (scene%tools(1)%shape, source=sphere_t(radius=6*h))
      scene%tools(1)%tip = [4*h, 4*h, 8*h]
      scene%tools(1)%axis = [0.0_wp, 0.0_wp, -1.0_wp]
      scene%tools(1)%times = [0.0_wp]
      scene%tools(1)%speeds = [500.0_wp]
   end subroutine make_scene

end program end_of_a_beam
