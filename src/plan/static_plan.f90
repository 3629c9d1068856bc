!> mode='plan' of a scene with quasi-static steps: its first steps are taken and timed, and the number of the
!> others is found from the limits of tools, pressures and max_step. Only console output.
module m_static_plan
   use m_kinds, only: wp
   use m_text, only: to_text, si, duration
   use m_timers, only: wall_time
   use m_scene, only: scene_t
   use m_model, only: model_t
   use m_forecast, only: model_bytes
   use m_integrator, only: integrator_t
   use m_move_regions, only: move_regions
   use m_figures, only: figures_t
   use m_console, only: console_t
   use m_errors, only: error_t
   implicit none
   private
   public :: print_static_plan

   integer, parameter :: timed = 2, max_timed = 8 !< steps
   real(wp), parameter :: enough = 1.0_wp     !< s: then no more than `timed`
   integer, parameter :: max_steps = 100000  !< limit of the count of implicit steps
   real(wp), parameter :: growth = 1.5_wp
   real(wp), parameter :: tangent_reals = 67.5_wp !< per particle: gradient, stress, its external force;
                                                  !< tangent, in single precision

contains

   !> Collective: measure and print. The model is unusable afterwards. If the first steps have no equilibrium
   !> there is no plan.
   subroutine print_static_plan(console, scene, model, integrator, figures, error)
      type(console_t), intent(inout) :: console
      type(scene_t), intent(in) :: scene
      type(model_t), intent(inout) :: model
      class(integrator_t), intent(inout) :: integrator
      type(figures_t), intent(inout) :: figures
      type(error_t), intent(inout) :: error
      real(wp) :: bytes(2), spent, seconds, first, particles, seconds_in_all
      integer :: taken, to_come(2), creeping
      logical :: starts
      first = console%elapsed()
      bytes = model_bytes(model)
      particles = model%communicator%sum_real(real(model%particle_count(), wp))
      call time_steps(console, scene, model, integrator, taken, spent, seconds, error)
      if (error%happened()) return
      starts = scene%quasi_static%holds_at(0.0_wp)
      call count_to_come(scene, model, integrator, to_come, creeping)
      seconds_in_all = first + spent + merge(to_come(1), to_come(2), starts)*seconds
      to_come(1) = to_come(1) + merge(taken, 0, starts)
      creeping = creeping + merge(taken, 0, starts)
      to_come(2) = to_come(2) + merge(0, taken, starts)
      call console%line('')
      call console%line('plan       by '//to_text(taken)//' steps taken on '// &
                        to_text(model%communicator%ranks)//' rank(s); '//integrator%summary())
      call console%line('steps      about '//to_text(to_come(1))//' implicit'//explicit_text(to_come(2))// &
                        '; more where one has no equilibrium or material creeps')
      if (creeping > to_come(1)) call console%line('creep      '//trim(merge('more than', 'up to    ', &
                        creeping > max_steps))//' '//to_text(min(creeping, max_steps))// &
                        ' implicit steps, if stresses go on to relax at the rate after these')
      call console%line('time       about '//duration(seconds_in_all)//': '//to_text(seconds, 3)// &
                        ' s a step as in these, and the more the more points are pressed'// &
                        untimed(starts, to_come))
      call console%line('memory     '//si(sum(bytes) + 8.0_wp*tangent_reals*particles, 'B')// &
                        ' on all ranks together: particles '//si(bytes(1), 'B')//', node tiles '// &
                        si(bytes(2), 'B')//', tangents '//si(8.0_wp*tangent_reals*particles, 'B')// &
                        '; besides it the program, vectors of PETSc, and the matrix of multigrid')
      call console%line('planned: '//scene%title//'; nothing was run and nothing written')
      call figures%words('title', scene%title)
      call figures%words('kind', 'implicit')
      call figures%number('ranks', real(model%communicator%ranks, wp))
      call figures%number('implicit_steps', real(to_come(1), wp))
      if (creeping > to_come(1)) call figures%number('implicit_steps_if_creeping', real(creeping, wp))
      call figures%number('explicit_steps', real(to_come(2), wp))
      call figures%number('timed_steps', real(taken, wp))
      call figures%number('step_s', seconds)
      call figures%number('time_s', seconds_in_all)
      call figures%number('before_first_step_s', first)
      call figures%number('memory_B', sum(bytes) + 8.0_wp*tangent_reals*particles)
      call figures%number('memory_particles_B', bytes(1))
      call figures%number('memory_node_tiles_B', bytes(2))
   end subroutine print_static_plan

   !> Collective: take the first steps. `spent`: seconds of all of them; `seconds`: of one of the later half,
   !> as steps take longer while tools go in.
   subroutine time_steps(console, scene, model, integrator, taken, spent, seconds, error)
      type(console_t), intent(inout) :: console
      type(scene_t), intent(in) :: scene
      type(model_t), intent(inout) :: model
      class(integrator_t), intent(inout) :: integrator
      integer, intent(out) :: taken
      real(wp), intent(out) :: spent, seconds
      type(error_t), intent(inout) :: error
      real(wp) :: began, took(max_timed)
      integer :: n
      taken = 0
      do n = 1, max_timed
         if (model%time >= scene%end_time) exit
         began = wall_time()
         call integrator%step(model, integrator%next_step(scene, model, 1.0_wp), error)
         call move_regions(model, error)
         call console%lines(integrator%messages())
         if (error%happened()) then
            error%message = 'no plan can be made, because the first steps of the scene fail: '//error%message
            return
         end if
         took(n) = model%communicator%maximum(wall_time() - began)
         taken = n
         if (n >= timed .and. sum(took(:n)) > enough) exit
      end do
      spent = sum(took(:taken))
      seconds = sum(took(taken/2 + 1:taken))/max(1, taken - taken/2)
   end subroutine time_steps

   pure function explicit_text(steps) result(text)
      integer, intent(in) :: steps
      character(len=:), allocatable :: text
      text = ''
      if (steps > 0) text = ', '//to_text(steps)//' explicit'
   end function explicit_text

   !> The note that steps of the other kind than the first ones are not included in the time.
   pure function untimed(starts, to_come) result(text)
      logical, intent(in) :: starts !< the first steps are implicit
      integer, intent(in) :: to_come(2)
      character(len=:), allocatable :: text
      text = ''
      if (minval(to_come) > 0) &
         text = '; the '//trim(merge('explicit', 'implicit', starts))//' ones are not timed, and not in this'
   end function untimed

   !> Collective: the number of remaining steps, implicit and explicit: implicit ones grow as fast as allowed,
   !> explicit ones are all as long as the next one. `creeping`: implicit ones if creep limits them as now.
   subroutine count_to_come(scene, model, integrator, to_come, creeping)
      type(scene_t), intent(in) :: scene
      type(model_t), intent(inout) :: model
      class(integrator_t), intent(inout) :: integrator
      integer, intent(out) :: to_come(2), creeping
      real(wp) :: first, longest, now
      integer :: others(2)
      now = model%time
      first = model%static_step
      call integrator%look_ahead(model, max(tiny(now), scene%end_time - now), longest)
      to_come = steps_from_here(huge(longest))
      model%time = now
      model%static_step = first
      others = steps_from_here(longest)
      creeping = others(1)
   contains
      function steps_from_here(longest) result(steps)
         real(wp), intent(in) :: longest !< of an implicit step, s
         integer :: steps(2)
         real(wp) :: step, until
         steps = 0
         do while (steps(1) < max_steps .and. model%time < scene%end_time)
            step = integrator%next_step(scene, model, 1.0_wp)
            if (scene%quasi_static%holds_at(model%time)) then
               steps(1) = steps(1) + 1
               model%time = model%time + min(step, longest)
               model%static_step = min(growth*model%static_step, longest)
            else
               until = scene%end_time
               if (model%time < scene%quasi_static%from) until = scene%quasi_static%from
               steps(2) = steps(2) + ceiling(min((until - model%time)/step, 1.0e9_wp))
               model%time = until
            end if
         end do
      end function steps_from_here
   end subroutine count_to_come

end module m_static_plan
