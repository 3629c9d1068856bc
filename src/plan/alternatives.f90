!> Cost of a scene with other settings: the rows `what if` of a plan (theory.md, Forecast).
module m_alternatives
   use mpi_f08
   use m_kinds, only: wp, i8
   use m_text, only: to_text, in_column
   use m_scene, only: largest_safety, scene_t
   use m_level, only: level_t
   use m_model, only: model_t
   use m_forecast, only: rates_t
   use m_calibration, only: calibration_t, sample_cost
   use m_console, only: console_t
   use m_figures, only: figures_t
   implicit none
   private
   public :: price_t, say_alternatives

   !> The cost of a run: the parts of its time, s, and of its memory, B.
   type :: price_t
      real(wp) :: particles = 0.0_wp, blocks = 0.0_wp, contact = 0.0_wp, contact_points = 0.0_wp, &
                  output = 0.0_wp
      real(wp) :: base = 0.0_wp    !< libraries
      real(wp) :: stores = 0.0_wp  !< particles
      real(wp) :: buffers = 0.0_wp !< copies of particles, for the guard and for output
      real(wp) :: tiles = 0.0_wp   !< node tiles
   contains
      procedure :: time
      procedure :: memory
   end type price_t

   !> A box of finer cells, as an additional level.
   type :: finer_t
      real(wp) :: lower(3) = 0.0_wp, upper(3) = 0.0_wp !< m
      real(wp) :: particles = 0.0_wp !< now in the box
      real(wp) :: blocks = 0.0_wp    !< of the additional level
   end type finer_t

   integer, parameter :: offered(3) = [1, 8, 27] !< particles a cell

contains

   pure real(wp) function time(self)
      class(price_t), intent(in) :: self
      time = self%particles + self%blocks + self%contact + self%contact_points + self%output
   end function time

   pure real(wp) function memory(self)
      class(price_t), intent(in) :: self
      memory = self%base + self%stores + self%buffers + self%tiles
   end function memory

   !> Collective: print time and memory of the scene with other settings.
   subroutine say_alternatives(console, scene, model, found, price, figures)
      type(console_t), intent(inout) :: console
      type(scene_t), intent(in) :: scene
      type(model_t), intent(in) :: model
      type(calibration_t), intent(in) :: found
      type(price_t), intent(in) :: price
      type(figures_t), intent(inout) :: figures !< the same for programs
      integer :: n
      call console%line('')
      call console%line('what if                                                  time [s]     x        '// &
                        'memory [MB]   x')
      call say(console, figures, 'as it is', price, price)
      call say(console, figures, 'cells half as large', &
               half_the_cell(price, blocks_at_half_cell(model)), price)
      call say(console, figures, 'one level more, half as wide'// &
               merge(' around the tool', '                ', size(scene%tools) > 0), &
               one_level_more(price, scene, model, found), price)
      do n = 1, size(offered)
         if (all(scene%bodies%particles_per_cell == offered(n))) cycle
         call say(console, figures, to_text(offered(n))//' particles a cell', &
                  with_particles(price, scene, model, offered(n)), price)
      end do
      if (size(scene%tools) > 0) call say(console, figures, 'the tools at a tenth of their speed', &
                                          scaled(price, 10.0_wp*step_by_speed(scene, model)), price)
      call say(console, figures, trim(merge('half the safety   ', 'half the time_step', &
                                            scene%time%time_step <= 0.0_wp)), scaled(price, 2.0_wp), price)
   end subroutine say_alternatives

   subroutine say(console, figures, name, what, price)
      type(console_t), intent(inout) :: console
      type(figures_t), intent(inout) :: figures
      character(len=*), intent(in) :: name
      type(price_t), intent(in) :: what, price !< with other settings, and as it is
      type(figures_t) :: row
      character(len=52) :: label
      label = name
      call row%words('change', trim(name))
      call row%number('time_s', what%time())
      call row%number('memory_B', what%memory())
      call figures%item('alternatives', row)
      call console%line(label//in_column(what%time(), 14, 3)//in_column(what%time()/price%time(), 8, 2) &
                        //in_column(1.0e-6_wp*what%memory(), 15, 1) &
                        //in_column(what%memory()/price%memory(), 8, 2))
   end subroutine say

   !> Eight times as many particles and twice the steps, with `growth` times as many blocks.
   pure type(price_t) function half_the_cell(price, growth) result(other)
      type(price_t), intent(in) :: price
      real(wp), intent(in) :: growth
      other = price
      other%particles = 16.0_wp*price%particles
      other%blocks = 2.0_wp*growth*price%blocks
      other%contact = 2.0_wp*price%contact
      other%contact_points = 8.0_wp*price%contact_points
      other%output = 8.0_wp*price%output
      other%stores = 8.0_wp*price%stores
      other%buffers = 8.0_wp*price%buffers
      other%tiles = growth*price%tiles
   end function half_the_cell

   !> Factor on the time step from a tenth of the tools' speed to the full speed; with a given step 1.
   pure real(wp) function step_by_speed(scene, model) result(factor)
      type(scene_t), intent(in) :: scene
      type(model_t), intent(in) :: model
      real(wp) :: speed, wave
      integer :: t
      factor = 1.0_wp
      if (scene%time%time_step > 0.0_wp) return
      speed = 0.0_wp
      do t = 1, size(scene%tools)
         associate (tool => model%contact%tools(t))
            if (.not. tool%is_pushed()) speed = max(speed, tool%fastest(0.0_wp, scene%end_time))
         end associate
      end do
      wave = model%wave_speed()
      factor = (wave + 0.1_wp*speed)/(wave + speed)
   end function step_by_speed

   !> Collective: `number` particles a cell in all bodies: their number, and the cost of one.
   type(price_t) function with_particles(price, scene, model, number) result(other)
      type(price_t), intent(in) :: price
      type(scene_t), intent(in) :: scene
      type(model_t), intent(in) :: model
      integer, intent(in) :: number
      real(wp) :: mean, ratio
      integer :: like
      mean = mean_particles_per_cell(scene, model)
      like = offered(minloc(abs(offered - nint(mean)), dim=1))
      ratio = number/mean
      other = price
      other%particles = price%particles*ratio*sample_cost(scene, model%communicator, number) &
                        /sample_cost(scene, model%communicator, like)
      other%contact_points = price%contact_points*ratio**(2.0_wp/3.0_wp)
      other%stores = price%stores*ratio
      other%buffers = price%buffers*ratio
      other%output = price%output*ratio
      if (scene%time%time_step <= 0.0_wp) &
         other = scaled(other, max(1.0_wp, scene%time%safety/largest_safety(number)))
   end function with_particles

   !> Collective: cells half as large in a box half as wide as that of the finest level.
   type(price_t) function one_level_more(price, scene, model, found) result(other)
      type(price_t), intent(in) :: price
      type(scene_t), intent(in) :: scene
      type(model_t), intent(in) :: model
      type(calibration_t), intent(in) :: found
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
      ! eight times the particles, twice the steps, minus the present ones
      other%particles = price%particles + steps*finest(size(finest))*share*15.0_wp
      other%blocks = price%blocks + 2.0_wp*blocks*price%blocks*block_share(found%rates)
      if (size(scene%tools) > 0) then
         other%contact = 2.0_wp*price%contact
         other%contact_points = 8.0_wp*price%contact_points
      end if
      share = 1.0_wp &
              + 7.0_wp*box%particles/real(max(1_i8, model%communicator%sum_count(model%particle_count())), wp)
      other%stores = share*price%stores
      other%buffers = share*price%buffers
      other%tiles = price%tiles*(1.0_wp + box%blocks/all_blocks(model)) &
                    + 8.0_wp*model%communicator%sum_count(size(model%levels(size(model%levels))%nodes, &
                          kind=i8)) ! `restricted`
   end function one_level_more

   !> The finest level's share of the work with blocks.
   pure real(wp) function block_share(rates) result(share)
      type(rates_t), intent(in) :: rates
      integer :: n
      n = size(rates%rows, 2)
      share = 1.0_wp/n
      if (sum(rates%rows) > 0.0_wp) share = sum(rates%rows(:, n))/sum(rates%rows)
   end function block_share

   !> Collective: number of blocks of all levels.
   real(wp) function all_blocks(model)
      type(model_t), intent(in) :: model
      integer :: l
      all_blocks = real(model%communicator%sum_count(sum([(int(size(model%levels(l)%blocks), i8), l=1, &
                                                           size(model%levels))])), wp)
   end function all_blocks

   pure type(price_t) function scaled(price, factor)
      type(price_t), intent(in) :: price
      real(wp), intent(in) :: factor !< factor on the number of steps
      scaled = price
      scaled%particles = factor*price%particles
      scaled%blocks = factor*price%blocks
      scaled%contact = factor*price%contact
      scaled%contact_points = factor*price%contact_points
   end function scaled

   !> Collective: particles a cell, averaged over all particles, from the numbers of each body scaled to one a
   !> cell.
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

   !> Collective: growth of the number of blocks with particles if cells are half as large.
   real(wp) function blocks_at_half_cell(model) result(growth)
      type(model_t), intent(in) :: model
      real(wp) :: now, then
      integer :: b, l
      now = 0.0_wp
      then = 0.0_wp
      do l = 1, size(model%levels)
         now = now + real(model%communicator%sum_count(int(count([(model%levels(l)%blocks(b)%particles%count &
            > 0, b=1, size(model%levels(l)%blocks))]), i8)), wp)
         then = then + finer_blocks(model%levels(l), model, model%levels(l)%grid%lower, &
                                    model%levels(l)%grid%upper)
      end do
      growth = max(1.0_wp, then/now)
   end function blocks_at_half_cell

   !> Collective: number of blocks with cells half as large that contain particles of a level inside a box.
   real(wp) function finer_blocks(level, model, lower, upper) result(blocks)
      type(level_t), intent(in) :: level
      type(model_t), intent(in) :: model
      real(wp), intent(in) :: lower(3), upper(3) !< m
      logical :: used(0:1, 0:1, 0:1)
      real(wp) :: middle(3)
      integer(i8) :: found
      integer :: b, half(3), p
      found = 0
      do b = 1, size(level%blocks) ! a block of nodes is as wide as two of half the cell: each particle is in
                                   ! one of eight
         used = .false.
         middle = level%blocks(b)%origin + 3.75_wp*level%grid%cell
         do p = 1, level%blocks(b)%particles%count
            associate (x => level%blocks(b)%particles%column(p, level%layout%position:level%layout%position &
                  + 2))
               if (any(x < lower) .or. any(x > upper)) cycle
               half = merge(1, 0, x > middle)
               used(half(1), half(2), half(3)) = .true.
            end associate
         end do
         found = found + count(used)
      end do
      blocks = real(model%communicator%sum_count(found), wp)
   end function finer_blocks

   !> Collective: a box half as wide as that of the finest level, around the tip of the first tool; without
   !> tools in its middle.
   type(finer_t) function box_of_one_more(scene, model) result(box)
      type(scene_t), intent(in) :: scene
      type(model_t), intent(in) :: model
      real(wp) :: low(3), high(3), centre(3), width(3)
      integer(i8) :: inside
      integer :: b, p
      associate (level => model%levels(size(model%levels)))
         call level%region%bounding_box(low, high)
         centre = 0.5_wp*(low + high)
         if (size(scene%tools) > 0) centre = scene%tools(1)%tip
         width = 0.5_wp*(high - low)
         box%lower = min(max(centre - 0.5_wp*width, low), high - width)
         box%upper = box%lower + width
         inside = 0
         do b = 1, size(level%blocks)
            do p = 1, level%blocks(b)%particles%count
               associate (x => level%blocks(b)%particles%column(p, &
                     level%layout%position:level%layout%position + 2))
                  if (all(x >= box%lower .and. x <= box%upper)) inside = inside + 1
               end associate
            end do
         end do
         box%particles = real(model%communicator%sum_count(inside), wp)
         box%blocks = finer_blocks(level, model, box%lower, box%upper)
      end associate
   end function box_of_one_more

end module m_alternatives
