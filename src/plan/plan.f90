!> mode='plan': the expected cost of a run of the scene on these ranks, and with other settings. Only console
!> output.
module m_plan
   use m_kinds, only: wp, i8
   use m_text, only: to_text, si, duration
   use m_machine, only: peak_memory
   use m_timers, only: phase_contact, phase_output
   use m_scene, only: scene_t
   use m_model, only: model_t
   use m_particle_store, only: spare_room
   use m_forecast, only: particle_rows, model_bytes
   use m_calibration, only: calibrate, calibration_t
   use m_alternatives, only: price_t, say_alternatives
   use m_console, only: console_t
   use m_figures, only: figures_t
   use m_cost_report, only: cost_t, write_cost_report, cost_line_length
   use m_errors, only: error_t
   implicit none
   private
   public :: print_plan

contains

   !> Collective: measure and print. The model is unusable afterwards. If the first steps of a scene fail
   !> there is no plan.
   subroutine print_plan(console, scene, model, kept, figures, error)
      type(console_t), intent(inout) :: console
      type(scene_t), intent(in) :: scene
      type(model_t), intent(inout) :: model
      real(wp), intent(in) :: kept !< memory of the guard's copies on all ranks, bytes
      type(figures_t), intent(inout) :: figures
      type(error_t), intent(inout) :: error
      type(calibration_t) :: found
      type(price_t) :: price
      real(wp) :: seconds(5), first, bytes(2)
      first = console%elapsed() ! reading and building
      bytes = model_bytes(model)
      bytes(1) = (1.0_wp + spare_room)*bytes(1)
      call calibrate(found, scene, model, error)
      if (error%happened()) return
      seconds = found%prospect%seconds(found%rates, model%timers%names)
      price = price_t(particles=seconds(2), blocks=seconds(3), &
                      contact=found%prospect%steps*found%rates%contact, &
                      contact_points=found%prospect%touches*found%rates%contact_point, output=seconds(5))
      price%stores = bytes(1)
      price%tiles = bytes(2)
      price%buffers = found%snapshot_bytes + kept
      price%base = model%communicator%sum_real(real(peak_memory(), wp)) - price%stores/(1.0_wp + spare_room) &
                   - price%tiles - price%buffers
      if (found%prospect%snapshots > 0.0_wp .and. scene%output%writes('hdf5')) then
         price%buffers = price%buffers + found%writing_bytes
         price%base = price%base + found%library_bytes
      end if
      associate (flight => found%prospect%flight)
         price%stores = price%stores*flight%max_particles/flight%particles
         price%buffers = price%buffers*flight%max_particles/flight%particles
         price%tiles = price%tiles*flight%max_blocks/flight%blocks
      end associate
      call say_plan(console, scene, model, found, price, first)
      call take_figures(figures, scene, model, found, price, first)
      call say_table(console, model, found, price)
      call say_alternatives(console, scene, model, found, price, figures)
      call console%line('planned: '//scene%title//'; nothing was run and nothing written')
   end subroutine print_plan

   !> Collective: print the figures of the scene as it is.
   subroutine say_plan(console, scene, model, found, price, first)
      type(console_t), intent(inout) :: console
      type(scene_t), intent(in) :: scene
      type(model_t), intent(in) :: model
      type(calibration_t), intent(in) :: found
      type(price_t), intent(in) :: price
      real(wp), intent(in) :: first !< s until the first step
      character(len=:), allocatable :: text
      associate (prospect => found%prospect, flight => found%prospect%flight)
         call console%line('')
         call console%line('plan       by '//to_text(found%steps)//' steps timed on '// &
                           to_text(model%communicator%ranks)//' rank(s) in '//duration(found%seconds)// &
                           ', processors at '//to_text(100.0_wp*found%processor/found%seconds, 3)//' %')
         call console%line('steps      '//to_text(nint(prospect%steps, i8))//' of the coarsest level')
         call console%line('time       '//duration(price%time() + first)//' ('// &
                           to_text(price%time() + first, 4)// &
                           ' s), of that '//to_text(first, 3)//' s until the first step')
         call console%line('memory     '//si(price%memory(), 'B')//' on all ranks together: particles '// &
                           si(price%stores, 'B')//', node tiles '//si(price%tiles, 'B')// &
                           ', copies and buffers of output '//si(price%buffers, 'B')//', all else '// &
                           si(price%base, 'B'))
         call console%line('output     '//to_text(nint(prospect%snapshots, i8))//' snapshots of '// &
                           si(found%file_bytes, 'B')//', '//to_text(nint(prospect%rows, i8))// &
                           ' rows of histories, '//to_text(price%output, 3)// &
                           ' s without the disk''s own time')
         if (prospect%rest > 0.0_wp) call console%line('at rest    '//to_text(100.0_wp*prospect%rest, 3)// &
                                                       ' % of the particle-steps')
         if (flight%changes()) call console%line('flight     at most '//to_text(nint(flight%max_blocks))// &
                                                 ' node blocks and '// &
                                                 to_text(nint(flight%max_particles, i8))// &
                                                    ' particles, now '// &
                                                 to_text(nint(flight%blocks))//' and '// &
                                                    to_text(nint(flight%particles, i8)))
         if (size(scene%tools) > 0) then
            text = 'contact    at most '//to_text(nint(prospect%max_touches))//' contact points; '// &
                   si(found%rates%contact_point, 's')//' each in a step'
            if (found%pressed_steps > 0) &
               text = text//', measured with the tools where they are at '//si(found%pressed_time, 's')// &
                      ', '//to_text(nint(found%pressed_points))//' points'
            call console%line(text)
         end if
         if (found%trouble /= '') call console%line('note       '//found%trouble)
      end associate
   end subroutine say_plan

   !> The same figures for programs.
   subroutine take_figures(figures, scene, model, found, price, first)
      type(figures_t), intent(inout) :: figures
      type(scene_t), intent(in) :: scene
      type(model_t), intent(in) :: model
      type(calibration_t), intent(in) :: found
      type(price_t), intent(in) :: price
      real(wp), intent(in) :: first !< s until the first step
      associate (prospect => found%prospect, flight => found%prospect%flight)
         call figures%words('title', scene%title)
         call figures%words('kind', 'explicit')
         call figures%number('ranks', real(model%communicator%ranks, wp))
         call figures%number('steps', real(nint(prospect%steps, i8), wp))
         call figures%number('particle_steps', real(nint(prospect%steps*flight%particle_steps, i8), wp))
         call figures%number('time_s', price%time() + first)
         call figures%number('before_first_step_s', first)
         call figures%number('output_s', price%output)
         call figures%number('contact_s', price%contact + price%contact_points)
         call figures%number('memory_B', price%memory())
         call figures%number('memory_particles_B', price%stores)
         call figures%number('memory_node_tiles_B', price%tiles)
         call figures%number('memory_output_B', price%buffers)
         call figures%number('memory_rest_B', price%base)
         call figures%number('snapshots', real(nint(prospect%snapshots, i8), wp))
         call figures%number('snapshot_B', found%file_bytes)
         call figures%number('history_rows', real(nint(prospect%rows, i8), wp))
         call figures%number('at_rest_share', prospect%rest)
         call figures%number('max_node_blocks', flight%max_blocks)
         call figures%number('max_particles', flight%max_particles)
         call figures%number('max_contact_points', prospect%max_touches)
         call figures%number('timed_steps', real(found%steps, wp))
         call figures%number('processor_share', found%processor/found%seconds)
         call figures%words('note', found%trouble)
      end associate
   end subroutine take_figures

   !> Collective: print predicted seconds by phase, effect and level, as the closing summary of a run does for
   !> the measured ones.
   subroutine say_table(console, model, found, price)
      type(console_t), intent(inout) :: console
      type(model_t), intent(in) :: model
      type(calibration_t), intent(in) :: found
      type(price_t), intent(in) :: price
      type(cost_t) :: cost
      type(error_t) :: error
      character(len=cost_line_length), allocatable :: lines(:)
      real(wp) :: steps, particle_load, block_load, held(size(model%levels))
      integer :: l, n
      cost%timers = model%timers
      cost%timers%calls = 0
      steps = found%prospect%steps
      particle_load = found%prospect%flight%particle_load
      block_load = found%prospect%flight%block_load
      do l = 1, size(model%levels)
         where (particle_rows(size(cost%timers%names), cost%timers%names))
            cost%timers%on_levels(:, l) = particle_load*(1.0_wp &
                                                         - found%prospect%rest)*steps*found%rates%rows(:, l)
         elsewhere
            cost%timers%on_levels(:, l) = block_load*steps*found%rates%rows(:, l)
         end where
      end do
      n = size(model%levels)
      cost%timers%on_levels(phase_contact, n) = price%contact + price%contact_points
      cost%timers%seconds = sum(cost%timers%on_levels, dim=2)
      cost%timers%seconds(phase_output) = price%output
      held = [(real(model%communicator%sum_count(model%levels(l)%particle_count()), wp), l=1, &
               n)]*model%steps_of_levels()
      cost%level_steps = nint(steps*found%prospect%flight%particle_steps*held/sum(held), i8)
      cost%particle_steps = sum(cost%level_steps)
      cost%elapsed = price%time()
      call write_cost_report(model%communicator, cost, '', lines, error)
      call console%line('')
      do l = 1, size(lines)
         call console%line(trim(lines(l)))
      end do
   end subroutine say_table

end module m_plan
