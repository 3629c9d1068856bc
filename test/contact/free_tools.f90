!test: ranks 1 2
!test: limit 240
!> Tools with several degrees of freedom that loads push, or nothing: what bodies and tools have together of
!> momentum and of angular momentum stays to round-off, a free roller ends up rolling on the block that moves
!> below it, a ball rolls down an incline or slides by the exact law.
program free_tools
   use m_kinds, only: wp
   use m_errors, only: error_t
   use m_communicator, only: communicator_t
   use m_materials, only: material_of
   use m_box, only: box_t
   use m_sphere, only: sphere_t
   use m_roller, only: roller_t
   use m_vectors, only: cross
   use m_scene, only: scene_t, tool_spec_t, motion_spec_t
   use m_side_kinds, only: boundary_free, boundary_symmetry, boundary_fixed
   use m_model, only: model_t
   use m_energy, only: sums_t, measure
   use m_advance, only: advance
   use m_tool, only: tool_t
   use m_assertions, only: assertions_t
   use m_chance, only: keep_worst, say
   use m_coulomb, only: coulomb_friction
   implicit none
   real(wp), parameter :: density = 1000.0_wp, poisson = 0.3_wp
   real(wp), parameter :: cell = 0.125_wp !< m
   type(communicator_t) :: comm
   type(assertions_t) :: test
   call comm%start()
   call test%start(comm, 'free_tools')
   call collide(0.0_wp)
   call collide(0.4_wp)
   call roll_on_a_block()
   call incline(0.4_wp)
   call incline(0.1_wp)
   call test%finish()

contains

   !> A box of so many cells with a margin on its sides; no tools yet.
   function scene_of(cells, margin, young) result(scene)
      integer, intent(in) :: cells(3), margin(6) !< in the order of the sides
      real(wp), intent(in) :: young
      type(scene_t) :: scene
      scene%title = 'free tools'
      scene%end_time = 1.0_wp
      scene%grid%cell_size = cell
      scene%grid%lower = -cell*margin(1:5:2)
      scene%grid%upper = cell*(cells + margin(2:6:2))
      scene%grid%cells = cells + margin(1:5:2) + margin(2:6:2)
      scene%grid%boundary = boundary_free
      allocate (scene%materials(1), scene%bodies(1), scene%tools(1), scene%probes(0))
      scene%materials(1) = material_of('soft', 'elastic', density, young, poisson)
      scene%bodies(1)%name = 'box'
      scene%bodies(1)%material = 1
      scene%bodies(1)%shape = box_t(upper=cell*cells)
      associate (tool => scene%tools(1))
         tool%name = 'tool'
         tool%axis = [0.0_wp, 0.0_wp, -1.0_wp]
         tool%times = [0.0_wp]
         tool%speeds = [0.0_wp]
         tool%penetration_factor = 0.5_wp
      end associate
   end function scene_of

   !> A degree of freedom that nothing pushes.
   function free(turns, along, mass, speed, point) result(motion)
      logical, intent(in) :: turns
      integer, intent(in) :: along !< an axis of the grid
      real(wp), intent(in) :: mass, speed
      real(wp), intent(in), optional :: point(3)
      type(motion_spec_t) :: motion
      motion%turns = turns
      motion%axis = 0.0_wp
      motion%axis(along) = 1.0_wp
      motion%times = [0.0_wp]
      motion%loads = [0.0_wp]
      motion%mass = mass
      motion%initial_speed = speed
      if (present(point)) motion%point = point
   end function free

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
      call model%exchange(1)%release()
      call model%migration(1)%release()
   end subroutine let_go

   !> One step; false when the run cannot go on. What contact gives to the nodes in it: momentum, and angular
   !> momentum about the origin. Stresses give none of either, and what particles then take from the nodes
   !> keeps momentum, but angular momentum only nearly (theory.md, Transfers).
   logical function steps(model, time_step, given)
      type(model_t), intent(inout) :: model
      real(wp), intent(in) :: time_step
      real(wp), intent(out) :: given(3, 2)
      real(wp) :: origin(3, size(model%levels(1)%blocks)), force(3)
      integer :: c, i, j, k
      do c = 1, size(origin, 2)
         origin(:, c) = model%levels(1)%blocks(c)%origin
      end do
      steps = goes_on(model, time_step)
      given = 0.0_wp
      do c = 1, model%contact%candidates%count
         associate (it => model%contact%candidates%list(c))
            force = it%force*it%normal
            if (it%frictional > 0) force = force + matmul(it%tangent, it%tangential_force)
            do k = 0, it%face%last
               do j = 0, it%face%last
                  do i = 0, it%face%last
                     given(:, 1) = given(:, 1) + time_step*it%face%weight(i, j, k)*force
                     given(:, 2) = given(:, 2) + time_step*it%face%weight(i, j, k) &
                                   *cross(origin(:, it%block) + cell*(it%face%corner + [i, j, k]), force)
                  end do
               end do
            end do
         end associate
      end do
      do k = 1, 2
         do i = 1, 3
            given(i, k) = comm%sum_real(given(i, k))
         end do
      end do
   end function steps

   !> Momentum of a tool with one mass and one inertia, and its angular momentum about the origin.
   subroutine of_tool(tool, mass, inertia, momentum, angular)
      type(tool_t), intent(in) :: tool
      real(wp), intent(in) :: mass, inertia
      real(wp), intent(out) :: momentum(3), angular(3)
      momentum = mass*tool%velocity
      angular = mass*cross(tool%point, tool%velocity) + inertia*tool%spin
   end subroutine of_tool

   !> A ball that is free in all six ways, and spins, meets a free block off its middle.
   subroutine collide(friction)
      real(wp), intent(in) :: friction
      type(scene_t) :: scene
      type(model_t) :: model
      real(wp), parameter :: dt = 1.0e-3_wp, mass = 20.0_wp, inertia = 0.8_wp, radius = 2.0_wp*cell
      real(wp) :: centre(3), before(3, 2), now(3, 2), given(3, 2), off(2), spin(3)
      character(len=:), allocatable :: name
      type(sums_t) :: start, ended
      integer :: step
      name = 'smooth ball: '
      if (friction > 0.0_wp) name = 'rough ball: '
      scene = scene_of([6, 4, 4], [4, 4, 4, 4, 4, 6], 1.0e6_wp)
      scene%bodies(1)%velocity = [0.1_wp, 0.2_wp, 0.1_wp]
      centre = cell*[4.3_wp, 2.4_wp, 4.1_wp] + radius*[0.0_wp, 0.0_wp, 1.0_wp]
      scene%tools(1)%shape = sphere_t(radius=radius)
      scene%tools(1)%tip = centre - radius*[0.0_wp, 0.0_wp, 1.0_wp]
      scene%tools(1)%friction = coulomb_friction(friction)
      scene%tools(1)%motions = [free(.false., 1, mass, -0.5_wp), free(.false., 2, mass, 0.2_wp), &
                                free(.false., 3, mass, -1.0_wp), free(.true., 1, inertia, 1.0_wp, centre), &
                                free(.true., 2, inertia, -2.0_wp, centre), &
                                free(.true., 3, inertia, 3.0_wp, centre)]
      model = built(scene)
      call of_tool(model%contact%tools(1), mass, inertia, before(:, 1), before(:, 2))
      start = measure(model)
      spin = model%contact%tools(1)%spin
      given = 0.0_wp
      off = 0.0_wp
      do step = 1, 150
         if (.not. steps(model, dt, now)) return
         given = given + now
         call of_tool(model%contact%tools(1), mass, inertia, now(:, 1), now(:, 2))
         call keep_worst(off(1), norm2(now(:, 1) - before(:, 1) + given(:, 1))/(mass*1.0_wp))
         call keep_worst(off(2), norm2(now(:, 2) - before(:, 2) + given(:, 2))/(mass*1.0_wp*radius))
      end do
      ended = measure(model)
      call keep_worst(off(1), norm2(ended%momentum - start%momentum - given(:, 1))/(mass*1.0_wp))
      call say(name//'momentum of block and ball, of that of the ball', off(1))
      call say(name//'angular momentum', off(2))
      associate (tool => model%contact%tools(1))
         call test%check_close(off(1), 0.0_wp, 1.0e-12_wp, name//'momentum of block and ball')
         call test%check_close(off(2), 0.0_wp, 1.0e-12_wp, name//'angular momentum of block and ball')
         call test%check(tool%velocity(3) > -0.5_wp, name//'the ball has met the block')
         if (friction > 0.0_wp) then
            call test%check(norm2(tool%spin - spin) > 0.5_wp, name//'friction changes its spin')
            call test%check(abs(norm2(tool%rotation(:, 1)) - 1.0_wp) < 1.0e-14_wp, name// &
                            'it stays a rotation')
         else
            call test%check_close(norm2(tool%spin - spin), 0.0_wp, 1.0e-12_wp, name// &
                                  'nothing changes its spin')
         end if
      end associate
      call let_go(model)
   end subroutine collide

   !> A block moves between two rollers that stand still and are squeezed together. Friction takes them along
   !> and makes them spin, until nothing slips: they go with the block then, or roll on it.
   subroutine roll_on_a_block()
      type(scene_t) :: scene
      type(model_t) :: model
      type(tool_spec_t) :: below
      type(motion_spec_t) :: squeeze
      real(wp), parameter :: dt = 1.0e-3_wp, mass = 20.0_wp, radius = 4.0_wp*cell, inertia = 0.5_wp*mass &
         *radius**2, speed = 0.5_wp
      real(wp) :: centre(3), given(3, 2), part(3, 2), before(3, 2), now(3, 2), tools(3, 2), off(2), slip(3), &
         momentum, heat
      type(sums_t) :: ended, start
      integer :: step, t
      scene = scene_of([12, 2, 4], [2, 8, 0, 0, 3, 3], 1.0e6_wp)
      scene%grid%boundary(3:4) = boundary_symmetry
      scene%bodies(1)%velocity = [speed, 0.0_wp, 0.0_wp]
      scene%tools(1)%shape = roller_t(radius=radius, edge=[0.0_wp, 1.0_wp, 0.0_wp])
      scene%tools(1)%friction = coulomb_friction(0.4_wp)
      scene%tools(1)%tip = cell*[6, 1, 4]
      below = scene%tools(1)
      below%name = 'below'
      below%tip = cell*[6, 1, 0]
      below%axis = -below%axis
      scene%tools = [scene%tools(1), below]
      do t = 1, 2
         centre = scene%tools(t)%tip - radius*scene%tools(t)%axis
         squeeze = free(.false., 3, mass, 0.0_wp)
         squeeze%axis = scene%tools(t)%axis
         squeeze%times = [0.0_wp, 0.02_wp]
         squeeze%loads = [0.0_wp, 400.0_wp]
         scene%tools(t)%motions = [free(.false., 1, mass, 0.0_wp), squeeze, &
                                   free(.true., 2, inertia, 0.0_wp, centre)]
      end do
      model = built(scene)
      start = measure(model)
      before = 0.0_wp
      do t = 1, 2
         call of_tool(model%contact%tools(t), mass, inertia, part(:, 1), part(:, 2))
         before = before + part
      end do
      given = 0.0_wp
      off = 0.0_wp
      slip = 0.0_wp
      momentum = start%momentum(1)
      do step = 1, 240
         if (.not. steps(model, dt, part)) return
         given = given + part
         tools = 0.0_wp
         do t = 1, 2
            call of_tool(model%contact%tools(t), mass, inertia, now(:, 1), now(:, 2))
            tools = tools + now
         end do
         call keep_worst(off(1), norm2(tools(1:3:2, 1) - before(1:3:2, 1) + given(1:3:2, 1))/momentum)
         call keep_worst(off(2), abs(tools(2, 2) - before(2, 2) + given(2, 2))/(momentum*radius))
         if (step == 140) heat = sum(model%contact%states%heat)
         if (step > 140) slip = slip + (model%contact%tools(1)%velocity_at(place_of_tip(model)) &
                                        - mean_velocity(model))/100
      end do
      ended = measure(model)
      call keep_worst(off(1), abs(ended%momentum(1) - start%momentum(1) - given(1, 1))/momentum)
      call say('rollers: momentum, of that of the block', off(1))
      call say('rollers: angular momentum', off(2))
      call say('rollers: mean slip at the end, of the speed of the block', slip(1)/speed)
      call say('rollers: heat of friction at the end, of all of it', sum(model%contact%states%heat)/heat &
               - 1.0_wp)
      call test%check_close(off(1), 0.0_wp, 1.0e-12_wp, 'rollers: momentum of block and rollers')
      call test%check_close(off(2), 0.0_wp, 1.0e-12_wp, 'rollers: angular momentum of block and rollers')
      call test%check(heat > 0.05_wp*start%kinetic*mass/start%mass, 'rollers: they slip at first')
      call test%check_close(sum(model%contact%states%heat)/heat, 1.0_wp, 5.0e-3_wp, &
                            'rollers: nothing slips at the end')
      call test%check_close(slip(1)/speed, 0.0_wp, 1.0e-2_wp, 'rollers: their surfaces go with the block')
      associate (upper => model%contact%tools(1), lower => model%contact%tools(2))
         call test%check(upper%spin(2) < -0.1_wp*speed/radius, 'rollers: they turn')
         call test%check_close(upper%spin(2), -lower%spin(2), 1.0e-9_wp*speed/radius, &
                               'rollers: one is the image of the other')
      end associate
      call let_go(model)
   end subroutine roll_on_a_block

   !> A ball on a plate, pulled as a weight is on an incline: with a friction beyond 2/7 of the pull over the
   !> weight it rolls, with 5/7 of the pull, else it slides, by what friction leaves. It starts at rest, with
   !> loads that come in slowly.
   subroutine incline(friction)
      real(wp), intent(in) :: friction
      type(scene_t) :: scene
      type(model_t) :: model
      real(wp), parameter :: mass = 250.0_wp, radius = 1.0_wp, inertia = 0.4_wp*mass*radius**2, &
         weight = 10.0_wp*mass, pull = 0.5_wp*weight, dt = 4.0e-4_wp, rise = 0.2_wp
      real(wp) :: centre(3), velocity(3), spin, off(2), push
      character(len=:), allocatable :: name
      integer :: step, steps_to(2)
      name = 'rolls: '
      if (friction < 2.0_wp/7.0_wp*pull/weight) name = 'slides: '
      scene = scene_of([20, 3, 2], [0, 0, 0, 0, 0, 2], 1.0e7_wp)
      scene%grid%boundary = [boundary_fixed, boundary_fixed, boundary_symmetry, boundary_fixed, &
                             boundary_fixed, boundary_free]
      scene%tools(1)%shape = sphere_t(radius=radius)
      scene%tools(1)%friction = coulomb_friction(friction)
      scene%tools(1)%tip = cell*[4, 0, 2]
      centre = scene%tools(1)%tip + [0.0_wp, 0.0_wp, radius]
      scene%tools(1)%motions = [free(.false., 1, mass, 0.0_wp), free(.false., 3, mass, 0.0_wp), &
                                free(.true., 2, inertia, 0.0_wp, centre)]
      scene%tools(1)%motions(1)%times = [0.0_wp, rise]
      scene%tools(1)%motions(1)%loads = [0.0_wp, pull]
      scene%tools(1)%motions(2)%times = [0.0_wp, rise]
      scene%tools(1)%motions(2)%loads = [0.0_wp, -weight]
      model = built(scene)
      steps_to = [600, 1800]
      do step = 1, steps_to(2)
         if (.not. goes_on(model, dt)) return
         if (step == steps_to(1)) then
            velocity = model%contact%tools(1)%velocity
            spin = model%contact%tools(1)%spin(2)
         end if
      end do
      associate (tool => model%contact%tools(1), time => dt*(steps_to(2) - steps_to(1)))
         push = 2.0_wp/7.0_wp*pull*time ! that of friction, N s
         if (name == 'slides: ') push = friction*(weight*time + mass*(tool%velocity(3) - velocity(3)))
         off = [(tool%velocity(1) - velocity(1))/((pull*time - push)/mass), &
                (tool%spin(2) - spin)/(push*radius/inertia)] - 1.0_wp
         call say(name//'acceleration, relative to the exact one', off(1))
         call say(name//'that of the spin', off(2))
         call say(name//'spin times radius over speed', tool%spin(2)*radius/tool%velocity(1))
         call test%check_close(off(1), 0.0_wp, 0.01_wp, name//'acceleration')
         call test%check_close(off(2), 0.0_wp, 0.01_wp, name//'acceleration of the spin')
         if (name == 'rolls: ') call test%check_close(tool%spin(2)*radius/tool%velocity(1), 1.0_wp, 0.01_wp, &
                                                      name//'without slip')
      end associate
      call let_go(model)
   end subroutine incline

   !> Where the lowest place of the first tool is, m.
   pure function place_of_tip(model) result(place)
      type(model_t), intent(in) :: model
      real(wp) :: place(3)
      associate (tool => model%contact%tools(1))
         place = tool%point + norm2(tool%spec%motions(3)%point - tool%spec%tip)*tool%spec%axis
      end associate
   end function place_of_tip

   function mean_velocity(model) result(velocity)
      type(model_t), intent(in) :: model
      real(wp) :: velocity(3)
      type(sums_t) :: sums
      sums = measure(model)
      velocity = sums%momentum/sums%mass
   end function mean_velocity

end program free_tools
