!test: ranks 1 2
!test: limit 240
!> Tools that loads push, and friction, against exact answers: a tool in the void, a block in a tube under a
!> steady load, momentum of free bodies with their tools, a block that slides on a plate until it sticks, and
!> one that is pushed with less and with more than friction can hold.
program pushed_and_rubbing
   use m_kinds, only: wp
   use m_errors, only: error_t
   use m_communicator, only: communicator_t
   use m_materials, only: material_of
   use m_box, only: box_t
   use m_flat, only: flat_t
   use m_shape, only: shape_t
   use m_sphere, only: sphere_t
   use m_scene, only: scene_t, tool_spec_t
   use m_side_kinds, only: boundary_free, boundary_roller
   use m_model, only: model_t
   use m_energy, only: sums_t, measure
   use m_advance, only: advance
   use m_assertions, only: assertions_t
   use m_chance, only: keep_worst, say
   use m_coulomb, only: coulomb_friction
   implicit none
   real(wp), parameter :: young = 1.0e6_wp, poisson = 0.3_wp, density = 1000.0_wp
   !> modulus, Pa
   real(wp), parameter :: confined = young*(1.0_wp - poisson)/((1.0_wp + poisson)*(1.0_wp - 2.0_wp*poisson))
   real(wp), parameter :: cell = 0.125_wp !< m
   real(wp), parameter :: up(3) = [0.0_wp, 0.0_wp, 1.0_wp]
   type(communicator_t) :: comm
   type(assertions_t) :: test
   call comm%start()
   call test%start(comm, 'pushed_and_rubbing')
   call void()
   call tube()
   call momentum('punch: ', flat_t(radius=2.0_wp*cell), 0.0_wp)
   call momentum('sphere: ', sphere_t(radius=2.0_wp*cell), 0.0_wp)
   call momentum('rough sphere: ', sphere_t(radius=2.0_wp*cell), 0.4_wp)
   call slide(1)
   call slide(2)
   call shove(0.8_wp)
   call shove(1.5_wp)
   call test%finish()

contains

   !> A box of so many cells with a margin on its sides; no tools yet.
   function scene_of(cells, margin, fineness) result(scene)
      integer, intent(in) :: cells(3), margin(6), fineness !< margin in the order of the sides
      type(scene_t) :: scene
      scene%title = 'pushed and rubbing'
      scene%end_time = 1.0_wp
      scene%grid%cell_size = cell/fineness
      scene%grid%lower = -cell*margin(1:5:2)
      scene%grid%upper = cell*(cells + margin(2:6:2))
      scene%grid%cells = (cells + margin(1:5:2) + margin(2:6:2))*fineness
      scene%grid%boundary = boundary_free
      allocate (scene%materials(1), scene%bodies(1), scene%tools(0), scene%probes(0))
      scene%materials(1) = material_of('soft', 'elastic', density, young, poisson)
      scene%bodies(1)%name = 'box'
      scene%bodies(1)%material = 1
      scene%bodies(1)%shape = box_t(upper=cell*cells)
   end function scene_of

   function tool_of(shape, tip, axis, friction) result(tool)
      class(shape_t), intent(in) :: shape
      real(wp), intent(in) :: tip(3), axis(3), friction
      type(tool_spec_t) :: tool
      tool%name = 'tool'
      tool%shape = shape
      tool%tip = tip
      tool%axis = axis
      tool%friction = coulomb_friction(friction)
      tool%penetration_factor = 0.5_wp
   end function tool_of

   subroutine set_velocity(model, velocity)
      type(model_t), intent(inout) :: model
      real(wp), intent(in) :: velocity(3)
      integer :: b, k, n
      do b = 1, size(model%levels(1)%blocks)
         associate (particles => model%levels(1)%blocks(b)%particles, v => model%levels(1)%layout%velocity)
            n = particles%count
            do k = 1, 3
               particles%column(:n, v + k - 1) = velocity(k)
            end do
         end associate
      end do
   end subroutine set_velocity

   !> One step; false when the run cannot go on.
   logical function goes_on(model, time_step)
      type(model_t), intent(inout) :: model
      real(wp), intent(in) :: time_step
      type(error_t) :: error
      call advance(model, time_step, error)
      goes_on = .not. error%happened()
      call test%check(goes_on, 'the run goes on')
      if (.not. goes_on .and. comm%is_root()) print '(3x,a)', error%message
   end function goes_on

   function built(scene) result(model)
      type(scene_t), intent(in) :: scene
      type(model_t) :: model
      type(error_t) :: error
      call model%build(comm, scene, error)
      call test%check(.not. error%happened(), 'the model is built')
   end function built

   !> Free what MPI holds. PETSc stays: it cannot start a second time in one program.
   subroutine let_go(model)
      type(model_t), intent(inout) :: model
      call test%check(model%contact%solver%projected == 0, 'guesses of which points press are enough')
      call model%exchange(1)%release()
      call model%migration(1)%release()
   end subroutine let_go

   !> Nothing in the way: speed is the integral of load over mass; the way is that of a scheme of first order.
   subroutine void()
      type(scene_t) :: scene
      type(model_t) :: model
      real(wp), parameter :: dt = 1.0e-3_wp, mass = 2.0_wp
      real(wp) :: change, way
      integer :: step
      scene = scene_of([2, 2, 2], [0, 0, 0, 0, 0, 8], 1)
      scene%tools = [tool_of(sphere_t(radius=cell), cell*[1, 1, 10], -up, 0.0_wp)]
      scene%tools(1)%times = [0.0_wp, 0.1_wp]
      scene%tools(1)%loads = [10.0_wp, 30.0_wp]
      scene%tools(1)%mass = mass
      scene%tools(1)%initial_speed = 0.5_wp
      model = built(scene)
      do step = 1, 150
         if (.not. goes_on(model, dt)) return
      end do
      change = (0.5_wp*(10.0_wp + 30.0_wp)*0.1_wp + 30.0_wp*0.05_wp)/mass
      associate (tool => model%contact%tools(1))
         call test%check_close(tool%freedoms(1)%speed, 0.5_wp + change, 1.0e-14_wp, &
                               'void: momentum is the integral of the load')
         ! exact way: initial speed, then the double integral of the load
         way = 0.5_wp*0.15_wp + (10.0_wp*0.1_wp**2/2.0_wp + 20.0_wp*0.1_wp**2/6.0_wp & ! in the rise
                                 + 2.0_wp*0.05_wp + 30.0_wp*0.05_wp**2/2.0_wp)/mass     ! after it
         call test%check_close(tool%freedoms(1)%travel - 0.5_wp*dt*change, way, 1.0e-6_wp, &
                               'void: the way runs half a step ahead')
      end associate
      call test%check_close(model%contact%states(1)%work, 0.0_wp, 0.0_wp, 'void: no work')
      call let_go(model)
   end subroutine void

   !> A block that fills a tube, under a lid that covers it: after a slow rise of the load, load and depth are
   !> in balance.
   subroutine tube()
      type(scene_t) :: scene
      type(model_t) :: model
      real(wp), parameter :: load = 500.0_wp, dt = 1.0e-3_wp
      real(wp) :: mean, depth, area, expected
      integer :: step, counted
      integer, parameter :: rise = 1500, hold = 1500
      scene = scene_of([2, 2, 4], [0, 0, 0, 0, 0, 4], 1)
      scene%grid%boundary = boundary_roller
      scene%grid%boundary(6) = boundary_free
      scene%tools = [tool_of(flat_t(radius=4.0_wp*cell), cell*[1, 1, 4], -up, 0.0_wp)]
      scene%tools(1)%times = [0.0_wp, rise*dt]
      scene%tools(1)%loads = [0.0_wp, load]
      scene%tools(1)%mass = 10.0_wp
      model = built(scene)
      mean = 0.0_wp
      depth = 0.0_wp
      counted = 0
      do step = 1, rise + hold
         if (.not. goes_on(model, dt)) return
         if (step <= rise) cycle
         counted = counted + 1
         mean = mean + model%contact%states(1)%load(3)
         depth = depth + model%contact%tools(1)%freedoms(1)%travel
      end do
      mean = mean/counted
      depth = depth/counted
      area = (2.0_wp*cell)**2
      expected = 4.0_wp*cell*(1.0_wp - exp(-load/(area*confined))) ! the law is one of the logarithmic strain
      call say('tube: mean load relative to the prescribed one', mean/load - 1.0_wp)
      call say('tube: mean depth relative to the exact one', depth/expected - 1.0_wp)
      call test%check_close(mean/load, 1.0_wp, 2.0e-3_wp, 'tube: the mean load is the prescribed one')
      call test%check_close(depth/expected, 1.0_wp, 2.0e-2_wp, 'tube: the depth is that of the load')
      call let_go(model)
   end subroutine tube

   !> A free block and a pushed tool: momentum of both is the impulse of the load; that of the block alone is
   !> what the tool felt.
   subroutine momentum(name, shape, friction)
      character(len=*), intent(in) :: name
      class(shape_t), intent(in) :: shape
      real(wp), intent(in) :: friction
      type(scene_t) :: scene
      type(model_t) :: model
      type(sums_t) :: start, now
      real(wp), parameter :: dt = 1.0e-3_wp, load = 3000.0_wp, mass = 20.0_wp
      real(wp) :: impulse(3), off(3), rub, side
      integer :: step
      scene = scene_of([12, 4, 4], [4, 4, 4, 4, 6, 3], 1)
      scene%tools = [tool_of(shape, cell*[7, 2, 4], -up, friction)]
      scene%tools(1)%times = [0.0_wp]
      scene%tools(1)%loads = [load]
      scene%tools(1)%mass = mass
      model = built(scene)
      call set_velocity(model, [0.3_wp, 0.1_wp, 0.0_wp])
      start = measure(model)
      impulse = 0.0_wp
      off = 0.0_wp
      side = 0.0_wp
      do step = 1, 150
         if (.not. goes_on(model, dt)) return
         impulse = impulse - dt*model%contact%states(1)%load
         rub = norm2(model%contact%states(1)%load(1:2))
         side = max(side, rub)
         now = measure(model)
         call keep_worst(off(1), norm2(now%momentum - start%momentum - impulse)/(load*dt*step))
         call keep_worst(off(2), &
                         (now%momentum(3) - mass*model%contact%tools(1)%freedoms(1)%speed)/(load*dt*step) &
                         + 1.0_wp)
      end do
      call say(name//'block and tool against the impulse of the load', off(2))
      call say(name//'the block against what the tool felt', off(1))
      call test%check_close(off(2), 0.0_wp, 1.0e-11_wp, name// &
                            'momentum of block and tool is the impulse of the load')
      call test%check_close(off(1), 0.0_wp, 1.0e-12_wp, name//'the tool feels what the block gets')
      call test%check(now%momentum(3) < -0.2_wp*load*dt*150, name//'the block is pushed along')
      if (friction > 0.0_wp) call test%check(side > 0.01_wp*load, name//'friction acts across')
      call let_go(model)
   end subroutine momentum

   !> Let a plate rise: its acceleration comes within a tenth of a second, slowly for the block, and then
   !> holds.
   pure subroutine lift(plate, acceleration)
      type(tool_spec_t), intent(inout) :: plate
      real(wp), intent(in) :: acceleration
      integer :: k
      plate%times = [(0.01_wp*k, k=0, 10), 10.0_wp]
      plate%speeds = acceleration*[(5.0e-4_wp*k**2, k=0, 10), 9.95_wp]
   end subroutine lift

   !> A block slides on a rising plate: friction takes mu times the speed that the plate gives it, until it
   !> stops and stays. What is left is its ringing in shear, about the deflection that friction has held.
   subroutine slide(fineness)
      integer, intent(in) :: fineness
      type(scene_t) :: scene
      type(model_t) :: model
      type(sums_t) :: now
      real(wp), parameter :: a = 10.0_wp, mu = 0.3_wp, v = 1.0_wp
      real(wp), parameter :: deflection = 0.5_wp*density*mu*a*(3.0_wp*cell)**2*2.0_wp*(1.0_wp + poisson)/young
      real(wp) :: dt, stop_time, expected, way, before, after, ratio(3)
      integer :: step, steps
      stop_time = v/(mu*a) + 0.05_wp
      steps = 350*fineness
      dt = stop_time/steps
      scene = scene_of([6, 2, 3], [1, 3, 1, 1, 1, 9], fineness)
      scene%tools = [tool_of(flat_t(radius=20.0_wp*cell), cell*[4, 1, 0], up, mu)]
      call lift(scene%tools(1), a)
      model = built(scene)
      call set_velocity(model, [v, 0.0_wp, 0.0_wp])
      expected = v*stop_time - mu*model%contact%tools(1)%freedoms(1)%travel_between(0.0_wp, stop_time)
      way = 0.0_wp
      before = 0.0_wp
      ratio = 0.0_wp
      do step = 1, (5*steps)/4
         if (.not. goes_on(model, dt)) return
         now = measure(model)
         way = way + dt*now%momentum(1)/now%mass
         associate (load => model%contact%states(1)%load)
            if (step < steps/2) then
               call keep_worst(ratio(1), (load(1) - mu*abs(load(3)))/(mu*now%mass*a))
               call keep_worst(ratio(3), worst_point(model, mu)/(mu*now%mass*a))
            end if
            call keep_worst(ratio(2), max(0.0_wp, norm2(load(1:2)) - mu*abs(load(3)))/(mu*now%mass*a))
         end associate
         if (step == (11*steps)/10) before = way
      end do
      after = way
      call say('slide: way until it stops, relative to the exact one', before/expected - 1.0_wp)
      call say('slide: creep of the block that has stopped, relative to the way', (after - before)/before)
      call say('slide: all friction against mu times the normal force', ratio(1))
      call say('slide: friction of a point against mu times its normal force', ratio(3))
      if (comm%is_root()) print '(3x,a,f7.3,a,i0)', 'sweeps a step', real(model%contact%friction%sweeps, wp) &
         /model%contact%solves, ', unsolved ', model%contact%unsolved
      call test%check_close(before/expected, 1.0_wp, 0.02_wp, 'slide: the block stops where it should')
      call test%check_close(after - before, 0.0_wp, 2.0_wp*deflection, &
                            'slide: the block that has stopped stays')
      call test%check_close(ratio(1), 0.0_wp, 1.0e-4_wp, &
                            'slide: all friction together is mu times the normal force')
      call test%check_close(ratio(3), 0.0_wp, 1.0e-7_wp, &
                            'slide: friction of every point is mu times its normal force')
      call test%check_close(ratio(2), 0.0_wp, 1.0e-12_wp, 'slide: friction is nowhere more')
      call test%check_close(now%momentum(1)/now%mass, 0.0_wp, 0.03_wp*v, 'slide: the block has come to rest')
      call test%check_close(model%contact%states(1)%heat/(0.5_wp*now%mass*v**2), 1.0_wp, 0.03_wp, &
                            'slide: motion has become heat')
      call let_go(model)
   end subroutine slide

   !> The point whose friction is furthest from mu times its normal force, N.
   real(wp) function worst_point(model, mu) result(off)
      type(model_t), intent(in) :: model
      real(wp), intent(in) :: mu
      integer :: c
      off = 0.0_wp
      associate (candidates => model%contact%candidates)
         do c = 1, candidates%count
            call keep_worst(off, norm2(candidates%list(c)%tangential_force) - mu*candidates%list(c)%force)
         end do
      end associate
   end function worst_point

   !> A block on a rising plate, pushed along it by a tool with a multiple of what friction holds.
   subroutine shove(share)
      real(wp), intent(in) :: share
      type(scene_t) :: scene
      type(model_t) :: model
      type(sums_t) :: now
      real(wp), parameter :: a = 10.0_wp, mu = 0.5_wp, mass = 20.0_wp, dt = 1.0e-3_wp
      real(wp) :: weight, at(2), expected, gain
      integer, parameter :: steps = 420
      integer :: step
      scene = scene_of([6, 4, 3], [2, 5, 1, 1, 1, 9], 1)
      weight = density*72.0_wp*cell**3*a
      scene%tools = [tool_of(flat_t(radius=20.0_wp*cell), cell*[4, 2, 0], up, mu), &
                     tool_of(flat_t(radius=20.0_wp*cell), cell*[0, 2, 2], [1.0_wp, 0.0_wp, 0.0_wp], 0.0_wp)]
      call lift(scene%tools(1), a)
      scene%tools(2)%times = [0.1_wp, 0.2_wp]
      scene%tools(2)%loads = [0.0_wp, share*mu*weight]
      scene%tools(2)%mass = mass
      model = built(scene)
      at = 0.0_wp
      do step = 1, steps
         if (.not. goes_on(model, dt)) return
         now = measure(model)
         if (step == 250) at(1) = now%momentum(1) + mass*model%contact%tools(2)%freedoms(1)%speed
         at(2) = now%momentum(1) + mass*model%contact%tools(2)%freedoms(1)%speed
      end do
      gain = (at(2) - at(1))/((steps - 250)*dt)
      expected = max(0.0_wp, share - 1.0_wp)*mu*weight
      call say('shove: force that moves the block, of what friction holds', gain/(mu*weight))
      call test%check_close(gain/(mu*weight), expected/(mu*weight), 0.02_wp, &
                            'shove: friction holds mu times the weight, no more')
      if (share < 1.0_wp) call test%check_close(now%momentum(1)/now%mass, 0.0_wp, 5.0e-3_wp, &
                                                  'shove: what friction holds does not move')
      call let_go(model)
   end subroutine shove

end program pushed_and_rubbing
