!> Tools that slide and turn: rotations, places and gaps of points that go with a tool, velocities against the
!> motion itself, turns one after another, points between the given times, levers; series of times.
program tool_motions
   use m_kinds, only: wp
   use m_communicator, only: communicator_t
   use m_cone, only: cone_t
   use m_sphere, only: sphere_t
   use m_roller, only: roller_t
   use m_multiples, only: times_passed
   use m_rotations, only: turn_by, followed_by, matrix_of, no_rotation
   use m_scene, only: tool_spec_t, motion_spec_t
   use m_tool, only: tool_t, make_tool
   use m_vectors, only: cross, tangents
   use m_assertions, only: assertions_t
   use m_chance, only: chance_t, keep_worst
   implicit none
   type(communicator_t) :: comm
   type(assertions_t) :: test
   type(chance_t) :: chance
   call comm%start()
   call test%start(comm, 'tool_motions')
   call rotations()
   call one_turn()
   call planet()
   call several()
   call pushes()
   call levers()
   call series()
   call test%finish()

contains

   !> Times 0.1, 0.2, ... within rounding; as many as no integer holds, and so dense that their ratio to the
   !> time has no number.
   subroutine series()
      real(wp) :: dense
      integer :: n
      logical :: right
      right = .true.
      do n = 1, 1000
         if (abs(times_passed(0.1_wp, n*0.1_wp) - n) > 0.5_wp) right = .false.
         if (abs(times_passed(0.1_wp, n*0.1_wp - 1.0e-3_wp) - (n - 1)) > 0.5_wp) right = .false.
      end do
      call test%check(right, 'each of the times comes when it is there')
      call test%check(abs(times_passed(1.0e-12_wp, 1.5_wp) - 1.5e12_wp) < 1.0e3_wp, 'more than 2**31 of them')
      dense = times_passed(1.0e-300_wp, 1.0e20_wp)
      call test%check(dense > 1.0e14_wp .and. dense < 1.0e16_wp, 'denser than numbers: a number still')
   end subroutine series

   function unit_vector() result(u)
      real(wp) :: u(3)
      u = chance%several(3, -1.0_wp, 1.0_wp)
      u = u/norm2(u)
   end function unit_vector

   !> A place turned about an axis through a point, as Rodrigues has it.
   pure function turned(place, axis, point, angle) result(to)
      real(wp), intent(in) :: place(3), axis(3), point(3), angle
      real(wp) :: to(3), arm(3)
      arm = place - point
      to = point + cos(angle)*arm + sin(angle)*cross(axis, arm) + (1.0_wp - cos(angle)) &
           *dot_product(axis, arm)*axis
   end function turned

   subroutine rotations()
      real(wp) :: a(4), b(4), x(3), axis(3), angle, worst(3)
      integer :: n
      worst = 0.0_wp
      do n = 1, 100
         axis = unit_vector()
         angle = chance%between(-10.0_wp, 10.0_wp)
         x = chance%several(3, -1.0_wp, 1.0_wp)
         a = turn_by(axis, angle)
         call keep_worst(worst(1), &
                         norm2(matmul(matrix_of(a), x) - turned(x, axis, [0.0_wp, 0.0_wp, 0.0_wp], angle)))
         b = turn_by(unit_vector(), chance%between(-10.0_wp, 10.0_wp))
         call keep_worst(worst(2), norm2(matmul(matrix_of(followed_by(a, b)), x) &
                                         - matmul(matrix_of(b), matmul(matrix_of(a), x))))
         call keep_worst(worst(3), &
                         maxval(abs(matmul(transpose(matrix_of(b)), matrix_of(b)) - matrix_of(no_rotation))))
      end do
      call test%check_close(worst(1), 0.0_wp, 1.0e-14_wp, 'a turn is that of Rodrigues')
      call test%check_close(worst(2), 0.0_wp, 1.0e-14_wp, 'one rotation after another')
      ! nine roundings; 1.1e-15 where the compiler does not fuse products and sums
      call test%check_close(worst(3), 0.0_wp, 9*epsilon(1.0_wp), 'a rotation keeps lengths')
   end subroutine rotations

   !> Given speeds: times, and speeds at them.
   function given(turns, axis, times, speeds, point) result(motion)
      logical, intent(in) :: turns
      real(wp), intent(in) :: axis(3), times(:), speeds(:)
      real(wp), intent(in), optional :: point(3)
      type(motion_spec_t) :: motion
      motion%turns = turns
      motion%axis = axis
      motion%times = times
      motion%speeds = speeds
      if (present(point)) motion%point = point
   end function given

   type(tool_spec_t) function cone_at(tip, axis) result(spec)
      real(wp), intent(in) :: tip(3), axis(3)
      spec%name = 'cone'
      spec%shape = cone_t(half_angle=1.0_wp)
      spec%tip = tip
      spec%axis = axis
      spec%times = [0.0_wp, 1.0_wp]
      spec%speeds = [0.0_wp, 0.7_wp]
   end function cone_at

   !> A cone slides along its axis and along another direction, and turns about an axis beside it: in many
   !> steps, and at once.
   subroutine one_turn()
      type(tool_t) :: tool, start, at_once
      type(tool_spec_t) :: spec
      real(wp) :: axis(3), side(3), point(3), place(3), now(3), gap(2), normal(3, 2), worst(4), &
         time, before(3)
      real(wp), parameter :: dt = 0.01_wp, small = 1.0e-6_wp
      integer :: n, p, step
      do n = 1, 10
         spec = cone_at(chance%several(3, -1.0_wp, 1.0_wp), unit_vector())
         axis = unit_vector()
         side = unit_vector()
         point = chance%several(3, -1.0_wp, 1.0_wp)
         spec%motions = [given(.true., axis, [0.0_wp, 2.0_wp], [1.0_wp, 5.0_wp], point), &
                         given(.false., side, [0.0_wp, 1.0_wp], [-1.0_wp, 2.0_wp])]
         tool = make_tool(spec)
         start = tool
         at_once = tool
         do step = 1, 150
            time = step*dt
            call tool%begin_step(time - dt, dt)
            call tool%end_step(time, dt)
         end do
         call at_once%carry_to(time)
         worst = 0.0_wp
         do p = 1, 20
            place = chance%several(3, -2.0_wp, 2.0_wp)
            now = with_tool(spec, place, time)
            call start%gap_and_normal(place, gap(1), normal(:, 1))
            call tool%gap_and_normal(now, gap(2), normal(:, 2))
            call keep_worst(worst(1), gap(2) - gap(1))
            normal(:, 1) = turned(normal(:, 1), axis, [0.0_wp, 0.0_wp, 0.0_wp], time + time**2)
            call keep_worst(worst(2), norm2(normal(:, 2) - normal(:, 1)))
            ! the speeds of a step that is short: those of now
            call tool%begin_step(time, small)
            before = (with_tool(spec, place, time + small) - with_tool(spec, place, time - small)) &
                     /(2.0_wp*small)
            call keep_worst(worst(3), norm2(tool%velocity_at(now) - before))
            call at_once%gap_and_normal(now, gap(2), normal(:, 2))
            call keep_worst(worst(4), gap(2) - gap(1))
         end do
         call test%check_close(worst(1), 0.0_wp, 1.0e-12_wp, 'what goes with a tool keeps its gap')
         call test%check_close(worst(2), 0.0_wp, 1.0e-12_wp, 'normals turn with the tool')
         call test%check_close(worst(3), 0.0_wp, 1.0e-5_wp, &
                               'the velocity of a place is that of what goes with the tool')
         call test%check_close(worst(4), 0.0_wp, 1.0e-12_wp, 'many steps are one')
         call test%check_close(tool%point, point + slid(spec, time), 1.0e-12_wp, &
                               'the point goes with the slides')
         call test%check_close(tool%depth(), dot_product(slid(spec, time), spec%axis), 1.0e-12_wp, &
                               'depth is along the axis')
      end do
   end subroutine one_turn

   !> How far the slides of one_turn have gone, m.
   function slid(spec, time) result(way)
      type(tool_spec_t), intent(in) :: spec
      real(wp), intent(in) :: time
      real(wp) :: way(3)
      way = integral_of(0.0_wp, 0.7_wp, time)*spec%axis + integral_of(-1.0_wp, 2.0_wp, time) &
            *spec%motions(2)%axis
   end function slid

   !> Of a speed that rises from a to b until 1 s.
   pure real(wp) function integral_of(a, b, time) result(way)
      real(wp), intent(in) :: a, b, time
      way = a*min(time, 1.0_wp) + 0.5_wp*(b - a)*min(time, 1.0_wp)**2 + b*max(0.0_wp, time - 1.0_wp)
   end function integral_of

   !> Where what goes with the tool of one_turn is at a time.
   function with_tool(spec, first, time) result(place)
      type(tool_spec_t), intent(in) :: spec
      real(wp), intent(in) :: first(3), time
      real(wp) :: place(3)
      place = turned(first, spec%motions(1)%axis, spec%motions(1)%point, time + time**2) + slid(spec, time)
   end function with_tool

   !> A second turn about an axis that the first carries round: what is on it goes round with it.
   subroutine planet()
      type(tool_t) :: tool, start
      type(tool_spec_t) :: spec
      real(wp), parameter :: y(3) = [0.0_wp, 1.0_wp, 0.0_wp], dt = 1.0e-2_wp, &
         sun(3) = [0.0_wp, 0.0_wp, 2.0_wp]
      real(wp) :: own(3), place(3), gap(2), normal(3)
      integer :: step
      spec = cone_at([1.0_wp, 0.0_wp, 2.0_wp], [0.0_wp, 0.0_wp, -1.0_wp])
      spec%speeds = [0.0_wp, 0.0_wp]
      own = [1.2_wp, 0.0_wp, 2.3_wp]
      spec%motions = [given(.true., y, [0.0_wp], [2.0_wp], sun), given(.true., y, [0.0_wp], [-5.0_wp], own)]
      tool = make_tool(spec)
      start = tool
      do step = 1, 100
         call tool%begin_step((step - 1)*dt, dt)
         call tool%end_step(step*dt, dt)
      end do
      place = [1.5_wp, 0.3_wp, 1.7_wp]
      call start%gap_and_normal(place, gap(1), normal)
      ! its own turn first, then both go round the sun
      call tool%gap_and_normal(turned(turned(place, y, own, -5.0_wp), y, sun, 2.0_wp), gap(2), normal)
      call test%check_close(gap(2), gap(1), 1.0e-12_wp, 'planet: what goes with it keeps its gap')
      call test%check_close(tool%freedoms(3)%point, turned(own, y, sun, 2.0_wp), 1.0e-12_wp, &
                            'planet: its axis goes round')
      call test%check_close(tool%spin, -3.0_wp*y, 1.0e-14_wp, 'planet: spins add up')
      call test%check_close(tool%velocity_at(tool%freedoms(3)%point), &
                            2.0_wp*cross(y, tool%freedoms(3)%point - sun), 1.0e-12_wp, &
                            'planet: its axis has the velocity of the first turn')
   end subroutine planet

   !> Turns about three axes through a point keep it, and the distance of all places from it.
   subroutine several()
      type(tool_t) :: tool
      type(tool_spec_t) :: spec
      real(wp) :: point(3), axes(3, 3), gap(2), normal(3), far(3)
      integer :: k, step
      point = [0.3_wp, -0.2_wp, 0.9_wp]
      spec = cone_at([0.0_wp, 0.0_wp, 0.0_wp], [0.0_wp, 0.0_wp, -1.0_wp])
      spec%speeds = [0.0_wp, 0.0_wp]
      axes(:, 1) = unit_vector()
      axes(:, 2:) = tangents(axes(:, 1))
      spec%motions = [(given(.true., axes(:, k), [0.0_wp], [1.0_wp*k], point), k=1, 3)]
      tool = make_tool(spec)
      call tool%gap_and_normal(point, gap(1), normal)
      do step = 1, 1000
         call tool%begin_step((step - 1)*1.0e-3_wp, 1.0e-3_wp)
         call tool%end_step(step*1.0e-3_wp, 1.0e-3_wp)
      end do
      call tool%gap_and_normal(point, gap(2), normal)
      call test%check_close(gap(2), gap(1), 1.0e-13_wp, 'three turns: the point stays')
      call test%check_close(norm2(tool%tip - point), norm2(spec%tip - point), 1.0e-13_wp, &
                            'three turns: distances stay')
      far = turned(spec%tip, (axes(:, 1) + 2.0_wp*axes(:, 2) + 3.0_wp*axes(:, 3))/sqrt(14.0_wp), point, &
                   sqrt(14.0_wp))
      call test%check_close(norm2(tool%tip - far), 0.0_wp, 5.0e-3_wp, &
                            'three turns are nearly that about their sum')
   end subroutine several

   !> Loads: their integrals, and what a force at a place does.
   subroutine pushes()
      type(tool_t) :: tool
      type(tool_spec_t) :: spec
      real(wp) :: point(3), axis(3), side(3), place(3), force(3), moment(3), dt, mobility(2), along(2)
      spec = cone_at([0.0_wp, 0.0_wp, 0.0_wp], [0.0_wp, 0.0_wp, -1.0_wp])
      spec%speeds = [0.0_wp, 0.0_wp]
      point = chance%several(3, -1.0_wp, 1.0_wp)
      axis = unit_vector()
      side = [0.6_wp, 0.8_wp, 0.0_wp]
      spec%motions = [given(.true., axis, [0.0_wp, 1.0_wp], [0.0_wp, 0.0_wp], point), &
                      given(.false., side, [0.0_wp, 1.0_wp], [0.0_wp, 0.0_wp])]
      spec%motions(1)%loads = [2.0_wp, 6.0_wp]
      spec%motions(2)%loads = [-1.0_wp, 3.0_wp]
      spec%motions(1)%mass = 0.5_wp
      spec%motions(2)%mass = 4.0_wp
      spec%motions(1)%initial_speed = -1.0_wp
      tool = make_tool(spec)
      dt = 0.25_wp
      call tool%begin_step(0.5_wp, dt)
      call test%check_close(tool%spin, (-1.0_wp + (4.0_wp*0.25_wp + 0.5_wp*4.0_wp*0.25_wp**2)/0.5_wp)*axis, &
                            1.0e-14_wp, 'a moment makes a spin')
      call test%check_close(tool%velocity, (1.0_wp*0.25_wp + 0.5_wp*4.0_wp*0.25_wp**2)/4.0_wp*side, &
                            1.0e-14_wp, 'a load makes a speed')
      place = chance%several(3, -1.0_wp, 1.0_wp)
      force = chance%several(3, -1.0_wp, 1.0_wp)
      mobility = tool%mobilities(dt)
      along = tool%along(place, force)
      call test%check_close(mobility, [dt/0.5_wp, dt/4.0_wp], 1.0e-15_wp, 'mobilities')
      moment = cross(place - tool%point, force)
      call test%check_close(along, [dot_product(moment, axis), dot_product(force, side)], 1.0e-14_wp, &
                            'what a force pushes')
      point = tool%velocity
      axis = tool%spin
      call tool%react(force, moment, dt)
      call test%check_close(tool%spin - axis, along(1)*mobility(1)*spec%motions(1)%axis, 1.0e-14_wp, &
                            'it spins by that')
      call test%check_close(tool%velocity - point, along(2)*mobility(2)*side, 1.0e-14_wp, 'it moves by that')
   end subroutine pushes

   !> No point of the surface is faster than the tool says.
   subroutine levers()
      type(tool_t) :: tool
      type(tool_spec_t) :: spec
      real(wp), parameter :: y(3) = [0.0_wp, 1.0_wp, 0.0_wp]
      spec = cone_at([0.0_wp, 0.0_wp, 0.0_wp], [0.0_wp, 0.0_wp, -1.0_wp])
      spec%speeds = [0.0_wp, 0.0_wp]
      spec%motions = [given(.true., y, [0.0_wp], [-3.0_wp], [0.0_wp, 0.0_wp, 2.0_wp])]
      deallocate (spec%shape)
      spec%shape = sphere_t(radius=2.0_wp)
      tool = make_tool(spec)
      call test%check_close(tool%speed_at(0.0_wp), 6.0_wp, 1.0e-14_wp, 'lever of a ball about its middle')
      spec%motions(1)%point = [1.0_wp, 7.0_wp, 2.0_wp]
      tool = make_tool(spec)
      call test%check_close(tool%speed_at(0.0_wp), 9.0_wp, 1.0e-14_wp, 'lever of a ball off its middle')
      deallocate (spec%shape)
      spec%shape = roller_t(radius=2.0_wp, edge=y)
      tool = make_tool(spec)
      call test%check_close(tool%surface_speed(), 9.0_wp, 1.0e-14_wp, 'lever of a cylinder off its middle')
      deallocate (spec%shape)
      spec%shape = cone_t(half_angle=1.0_wp)
      tool = make_tool(spec, reshape([-1.0_wp, -1.0_wp, -1.0_wp, 2.0_wp, 1.0_wp, 1.0_wp], [3, 2]))
      call test%check_close(tool%fastest(0.0_wp, 1.0_wp), 3.0_wp*sqrt(13.0_wp), 1.0e-14_wp, &
                            'a cone without an end reaches to the corners of the grid')
   end subroutine levers

end program tool_motions
