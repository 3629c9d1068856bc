!> mode='plan': what a run of the scene will take on these ranks, and what it would take if it were set up otherwise. Nothing is
!> written but to the console.
module m_plan
   use mpi_f08
   use m_kinds, only: wp, i8
   use m_text, only: to_text, si, duration
   use m_memory, only: peak_memory
   use m_timers, only: phase_contact, phase_output
   use m_scene, only: scene_t
   use m_scene_checks, only: safety_limit
   use m_level, only: level_t
   use m_model, only: model_t
   use m_particle_store, only: spare_room
   use m_forecast, only: rates_t, prospect_t, particle_rows
   use m_calibration, only: calibrate, calibration_t, sample_cost
   use m_console, only: console_t
   use m_cost_report, only: cost_t, write_cost_report, cost_line_length
   use m_errors, only: error_t
   implicit none
   private
   public :: print_plan

   !> What a run takes, and what it would take otherwise: the parts of its time, s, and of its memory, B.
   type :: price_t
      real(wp) :: particles = 0.0_wp, blocks = 0.0_wp, contact = 0.0_wp, contact_points = 0.0_wp, output = 0.0_wp
      real(wp) :: base = 0.0_wp    !< libraries
      real(wp) :: stores = 0.0_wp  !< particles
      real(wp) :: buffers = 0.0_wp !< copies of them, for the guard and to write them
      real(wp) :: tiles = 0.0_wp   !< node tiles
   contains
      procedure :: time
      procedure :: memory
   end type price_t

   !> A box of finer cells, as one level more would have it.
   type :: finer_t
      real(wp) :: lower(3) = 0.0_wp, upper(3) = 0.0_wp !< m
      real(wp) :: particles = 0.0_wp !< that live in it now
      real(wp) :: blocks = 0.0_wp    !< that it would have
   end type finer_t

contains

   !> Collective: measure, and say. The model is spent afterwards.
   subroutine print_plan(console, scene, model, kept)
      type(console_t), intent(inout) :: console
      type(scene_t), intent(in) :: scene
      type(model_t), intent(inout) :: model
      real(wp), intent(in) :: kept !< memory of the guard's copies on all ranks, bytes
      type(calibration_t) :: found
      type(price_t) :: price
      real(wp) :: seconds(5), first, bytes(2)
      bytes = model_bytes(model)
      bytes(1) = (1.0_wp + spare_room)*bytes(1)
      call calibrate(found, scene, model)
      seconds = found%prospect%seconds(found%rates, model%timers%names)
      price = price_t(particles=seconds(2), blocks=seconds(3), contact=found%prospect%steps*found%rates%contact, &
                      contact_points=found%prospect%touches*found%rates%contact_point, output=seconds(5))
      first = console%elapsed() - found%seconds ! reading and building
      price%stores = bytes(1)
      price%tiles = bytes(2)
      price%buffers = found%snapshot_bytes + kept
      price%base = model%communicator%sum_real(real(peak_memory(), wp)) - price%stores/(1.0_wp + spare_room) - price%tiles &
                   - price%buffers
      if (found%prospect%snapshots > 0.0_wp .and. scene%output%hdf5) then
         price%buffers = price%buffers + found%writing_bytes
         price%base = price%base + found%library_bytes
      end if
      call say_plan(console, scene, model, found, price, first)
      call say_table(console, model, found, price)
      call say_alternatives(console, scene, model, found, price)
      call console%line('planned: '//scene%title//'; nothing was run and nothing written')
   end subroutine print_plan

   pure real(wp) function time(self)
      class(price_t), intent(in) :: self
      time = self%particles + self%blocks + self%contact + self%contact_points + self%output
   end function time

   pure real(wp) function memory(self)
      class(price_t), intent(in) :: self
      memory = self%base + self%stores + self%buffers + self%tiles
   end function memory

   !> Collective: bytes of particles and of the rest of all levels.
   function model_bytes(model) result(bytes)
      type(model_t), intent(in) :: model
      real(wp) :: bytes(2)
      integer(i8) :: stores, all
      integer :: b, l
      stores = 0
      all = 0
      do l = 1, size(model%levels)
         all = all + model%levels(l)%bytes()
         do b = 1, size(model%levels(l)%blocks)
            stores = stores + model%levels(l)%blocks(b)%bytes()
         end do
      end do
      bytes = real([model%communicator%sum_count(stores), model%communicator%sum_count(all - stores)], wp)
   end function model_bytes

   !> Collective: the figures of the scene as it is.
   subroutine say_plan(console, scene, model, found, price, first)
      type(console_t), intent(inout) :: console
      type(scene_t), intent(in) :: scene
      type(model_t), intent(in) :: model
      type(calibration_t), intent(in) :: found
      type(price_t), intent(in) :: price
      real(wp), intent(in) :: first !< s until the first step
      character(len=:), allocatable :: text
      associate (prospect => found%prospect)
         call console%line('')
         call console%line('plan       by '//to_text(found%steps)//' steps timed on '//to_text(model%communicator%ranks)// &
                           ' rank(s) in '//duration(found%seconds))
         call console%line('steps      '//to_text(nint(prospect%steps, i8))//' of the coarsest level')
         call console%line('time       '//duration(price%time() + first)//' ('//to_text(price%time() + first, 4)// &
                           ' s), of that '//to_text(first, 3)//' s until the first step')
         call console%line('memory     '//si(price%memory(), 'B')//' on all ranks together: particles '//si(price%stores, 'B')// &
                           ', node tiles '//si(price%tiles, 'B')//', copies and buffers of output '//si(price%buffers, 'B')// &
                           ', all else '//si(price%base, 'B'))
         call console%line('output     '//to_text(nint(prospect%snapshots))//' snapshots of '//si(found%snapshot_bytes, 'B')// &
                           ', '//to_text(nint(prospect%rows))//' rows of histories, '//to_text(price%output, 3)// &
                           ' s without the disk''s own time')
         if (prospect%rest > 0.0_wp) call console%line('at rest    '//to_text(100.0_wp*prospect%rest, 3)// &
                                                       ' % of the particle-steps')
         if (size(scene%tools) > 0) then
            text = 'contact    at most '//to_text(nint(prospect%most_touches))//' contact points; '// &
                   si(found%rates%contact_point, 's')//' each in a step'
            if (found%pressed_steps > 0) text = text//', measured with the tools where they are at '// &
                                                si(found%pressed_time, 's')//', '//to_text(nint(found%pressed_points))//' points'
            call console%line(text)
         end if
         if (found%trouble /= '') call console%line('note       '//found%trouble)
      end associate
   end subroutine say_plan

   !> Collective: predicted seconds by phase, effect and level, as the closing summary of a run has the real ones.
   subroutine say_table(console, model, found, price)
      type(console_t), intent(inout) :: console
      type(model_t), intent(in) :: model
      type(calibration_t), intent(in) :: found
      type(price_t), intent(in) :: price
      type(cost_t) :: cost
      type(error_t) :: error
      character(len=cost_line_length), allocatable :: lines(:)
      real(wp) :: steps
      integer :: l, n
      cost%timers = model%timers
      cost%timers%calls = 0
      steps = found%prospect%steps
      do l = 1, size(model%levels)
         where (particle_rows(size(cost%timers%names), cost%timers%names))
            cost%timers%on_levels(:, l) = steps*(1.0_wp - found%prospect%rest)*found%rates%rows(:, l)
         elsewhere
            cost%timers%on_levels(:, l) = steps*found%rates%rows(:, l)
         end where
      end do
      n = size(model%levels)
      cost%timers%on_levels(phase_contact, n) = price%contact + price%contact_points
      cost%timers%seconds = sum(cost%timers%on_levels, dim=2)
      cost%timers%seconds(phase_output) = price%output
      allocate (cost%level_steps(n))
      do l = 1, n
         cost%level_steps(l) = nint(steps*merge(2.0_wp**(l - 1), 1.0_wp, model%method%subcycle) &
                                    *real(model%communicator%sum_count(model%levels(l)%particle_count()), wp), i8)
      end do
      cost%particle_steps = sum(cost%level_steps)
      cost%elapsed = price%time()
      call write_cost_report(model%communicator, cost, '', lines, error)
      call console%line('')
      do l = 1, size(lines)
         call console%line(trim(lines(l)))
      end do
   end subroutine say_table

   !> Collective: time and memory of the scene set up otherwise.
   subroutine say_alternatives(console, scene, model, found, price)
      type(console_t), intent(inout) :: console
      type(scene_t), intent(in) :: scene
      type(model_t), intent(in) :: model
      type(calibration_t), intent(in) :: found
      type(price_t), intent(in) :: price
      type(price_t) :: other
      real(wp) :: growth
      integer, parameter :: offered(3) = [1, 8, 27]
      integer :: n
      call console%line('')
      call console%line('what if                                                  time [s]     x        memory [MB]   x')
      call say(price, 'as it is')
      growth = blocks_at_half_cell(model)
      other = price
      other%particles = 16.0_wp*price%particles ! eight times as many particles, twice the steps
      other%blocks = 2.0_wp*growth*price%blocks
      other%contact = 2.0_wp*price%contact
      other%contact_points = 8.0_wp*price%contact_points
      other%output = 8.0_wp*price%output
      other%stores = 8.0_wp*price%stores
      other%buffers = 8.0_wp*price%buffers
      other%tiles = growth*price%tiles
      call say(other, 'cells half as large')
      call one_level_more()
      do n = 1, size(offered)
         if (all(scene%bodies%particles_per_cell == offered(n))) cycle
         call with_particles(offered(n))
         call say(other, to_text(offered(n))//' particles a cell')
      end do
      if (size(scene%tools) > 0) then
         other = scaled(price, 10.0_wp*slower())
         other%output = price%output
         call say(other, 'the tools at a tenth of their speed')
      end if
      other = scaled(price, 2.0_wp)
      other%output = price%output
      call say(other, 'half the safety')
   contains
      subroutine say(what, name)
         type(price_t), intent(in) :: what
         character(len=*), intent(in) :: name
         character(len=120) :: line
         write (line, '(a52,f14.3,f8.2,f15.1,f8.2)') name//repeat(' ', 52), what%time(), what%time()/price%time(), &
            1.0e-6_wp*what%memory(), what%memory()/price%memory()
         call console%line(trim(line))
      end subroutine say

      !> How much less a step gets by the tools' speed: with a given step not at all.
      real(wp) function slower() result(factor)
         real(wp) :: speed, wave
         integer :: t
         factor = 1.0_wp
         if (scene%time%time_step > 0.0_wp) return
         speed = 0.0_wp
         do t = 1, size(scene%tools)
            if (allocated(scene%tools(t)%speeds)) speed = max(speed, maxval(abs(scene%tools(t)%speeds)))
         end do
         wave = model%wave_speed()
         factor = (wave + 0.1_wp*speed)/(wave + speed)
      end function slower

      !> So many particles a cell in all bodies: their number, and what one costs where so many share a cell.
      subroutine with_particles(number)
         integer, intent(in) :: number
         real(wp) :: mean, most, ratio
         integer :: b
         mean = mean_particles_per_cell(scene, model)
         b = nint(mean)
         b = offered(minloc(abs(offered - b), dim=1))
         ratio = number/mean
         other = price
         other%particles = price%particles*ratio*sample_cost(scene, model%communicator, number) &
                           /sample_cost(scene, model%communicator, b)
         other%contact_points = price%contact_points*ratio**(2.0_wp/3.0_wp)
         other%stores = price%stores*ratio
         other%buffers = price%buffers*ratio
         other%output = price%output*ratio
         most = 1.0_wp
         if (number == 27 .and. scene%time%time_step <= 0.0_wp) most = max(1.0_wp, scene%time%safety/0.35_wp)
         other = scaled(other, most)
         other%output = price%output*ratio
      end subroutine with_particles

      !> Cells half as large in a box half as wide as that of the finest level.
      subroutine one_level_more()
         type(finer_t) :: box
         real(wp) :: share, finest(size(model%levels)), blocks, steps
         box = box_of_one_more(scene, model)
         finest = found%rates%particles(model%timers%names)
         associate (level => model%levels(size(model%levels)))
            steps = found%prospect%steps
            share = box%particles/real(max(1_i8, model%communicator%sum_count(level%particle_count())), wp)
            blocks = box%blocks/real(max(1_i8, model%communicator%sum_count(int(size(level%blocks), i8))), wp)
         end associate
         other = price
         other%particles = price%particles + steps*finest(size(finest))*share*15.0_wp ! 8 for 1, twice the steps, less themselves
         other%blocks = price%blocks + 2.0_wp*blocks*price%blocks*block_share(found%rates)
         if (size(scene%tools) > 0) then
            other%contact = 2.0_wp*price%contact
            other%contact_points = 8.0_wp*price%contact_points
         end if
         share = 1.0_wp + 7.0_wp*box%particles/real(max(1_i8, model%communicator%sum_count(model%particle_count())), wp)
         other%stores = share*price%stores
         other%buffers = share*price%buffers
         other%tiles = price%tiles*(1.0_wp + box%blocks/all_blocks(model))
         call say(other, 'one level more, half as wide'//merge(' around the tool', '                ', size(scene%tools) > 0))
      end subroutine one_level_more
   end subroutine say_alternatives

   !> Share of the work with blocks that the finest level has.
   pure real(wp) function block_share(rates) result(share)
      type(rates_t), intent(in) :: rates
      integer :: n
      n = size(rates%rows, 2)
      share = 1.0_wp/n
      if (sum(rates%rows) > 0.0_wp) share = sum(rates%rows(:, n))/sum(rates%rows)
   end function block_share

   !> Collective: blocks of all levels.
   real(wp) function all_blocks(model)
      type(model_t), intent(in) :: model
      integer :: l
      all_blocks = real(model%communicator%sum_count(sum([(int(size(model%levels(l)%blocks), i8), l=1, size(model%levels))])), wp)
   end function all_blocks

   pure type(price_t) function scaled(price, factor)
      type(price_t), intent(in) :: price
      real(wp), intent(in) :: factor !< more steps
      scaled = price
      scaled%particles = factor*price%particles
      scaled%blocks = factor*price%blocks
      scaled%contact = factor*price%contact
      scaled%contact_points = factor*price%contact_points
   end function scaled

   !> Collective: particles a cell, over all particles: what their numbers would be with one a cell, from those of each body.
   real(wp) function mean_particles_per_cell(scene, model) result(mean)
      type(scene_t), intent(in) :: scene
      type(model_t), intent(in) :: model
      real(wp) :: cells
      integer(i8) :: of_body(size(scene%bodies))
      integer :: b, l, p
      of_body = 0
      do l = 1, size(model%levels)
         do b = 1, size(model%levels(l)%blocks)
            associate (particles => model%levels(l)%blocks(b)%particles)
               do p = 1, particles%count
                  of_body(particles%body(p)) = of_body(particles%body(p)) + 1
               end do
            end associate
         end do
      end do
      call MPI_Allreduce(MPI_IN_PLACE, of_body, size(of_body), MPI_INTEGER8, MPI_SUM, model%communicator%comm)
      cells = sum(real(of_body, wp)/scene%bodies%particles_per_cell)
      mean = real(sum(of_body), wp)/cells
   end function mean_particles_per_cell

   !> Collective: how many times as many blocks with particles there would be with cells half as large.
   real(wp) function blocks_at_half_cell(model) result(growth)
      type(model_t), intent(in) :: model
      real(wp) :: now, then
      integer :: b, l
      now = 0.0_wp
      then = 0.0_wp
      do l = 1, size(model%levels)
         now = now + real(model%communicator%sum_count(int(count([(model%levels(l)%blocks(b)%particles%count > 0, &
                                                               b=1, size(model%levels(l)%blocks))]), i8)), wp)
         then = then + finer_blocks(model%levels(l), model, model%levels(l)%grid%lower, model%levels(l)%grid%upper)
      end do
      growth = max(1.0_wp, then/now)
   end function blocks_at_half_cell

   !> Collective: blocks of cells half as large that the particles of a level inside a box would be in.
   real(wp) function finer_blocks(level, model, lower, upper) result(blocks)
      type(level_t), intent(in) :: level
      type(model_t), intent(in) :: model
      real(wp), intent(in) :: lower(3), upper(3) !< m
      logical :: used(0:1, 0:1, 0:1)
      real(wp) :: middle(3)
      integer(i8) :: found
      integer :: b, half(3), p
      found = 0
      do b = 1, size(level%blocks) ! a block of nodes is as wide as two of half the cell: each particle is in one of eight
         used = .false.
         middle = level%blocks(b)%origin + 3.75_wp*level%grid%cell
         do p = 1, level%blocks(b)%particles%count
            associate (x => level%blocks(b)%particles%column(p, level%layout%position:level%layout%position + 2))
               if (any(x < lower) .or. any(x > upper)) cycle
               half = merge(1, 0, x > middle)
               used(half(1), half(2), half(3)) = .true.
            end associate
         end do
         found = found + count(used)
      end do
      blocks = real(model%communicator%sum_count(found), wp)
   end function finer_blocks

   !> Collective: a box half as wide as that of the finest level, around the tip of the first tool; without tools in its middle.
   type(finer_t) function box_of_one_more(scene, model) result(box)
      type(scene_t), intent(in) :: scene
      type(model_t), intent(in) :: model
      real(wp) :: low(3), high(3), centre(3), width(3)
      integer(i8) :: inside
      integer :: b, p
      associate (level => model%levels(size(model%levels)))
         low = max(level%region%lower, level%grid%lower)
         high = min(level%region%upper, level%grid%upper)
         centre = 0.5_wp*(low + high)
         if (size(scene%tools) > 0) centre = scene%tools(1)%tip
         width = 0.5_wp*(high - low)
         box%lower = min(max(centre - 0.5_wp*width, low), high - width)
         box%upper = box%lower + width
         inside = 0
         do b = 1, size(level%blocks)
            do p = 1, level%blocks(b)%particles%count
               associate (x => level%blocks(b)%particles%column(p, level%layout%position:level%layout%position + 2))
                  if (all(x >= box%lower .and. x <= box%upper)) inside = inside + 1
               end associate
            end do
         end do
         box%particles = real(model%communicator%sum_count(inside), wp)
         box%blocks = finer_blocks(level, model, box%lower, box%upper)
      end associate
   end function box_of_one_more

end module m_plan
