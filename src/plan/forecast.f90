!> Forecast of a run: contact points as tools move in, blocks that start to move, and the time by measured
!> costs (doc/developer/theory.md, Forecast).
module m_forecast
   use mpi_f08
   use m_kinds, only: wp, i8
   use m_timers, only: phases, phase_lists, phase_p2g, phase_g2p, phase_stress, phase_contact, phase_output, &
                       timers_t
   use m_scene, only: scene_t
   use m_tool, only: tool_t
   use m_model, only: model_t
   use m_flight, only: flight_t, follow_flight
   use m_time_step, only: steps_between
   implicit none
   private
   public :: rates_t, prospect_t, rates_of, predict_costs, contact_points, contact_steps, particle_rows, &
             model_bytes

   integer, parameter :: halvings = 6       !< of a part, to find when tools first touch
   real(wp), parameter :: many = 1.0e15_wp  !< snapshots: an upper limit of the count
   integer, parameter, public :: parts = 20 !< of the remaining time, each with its own number of contact
                                            !< points

   !> Wall-clock time of one step of the coarsest level, with the steps of all finer levels in it. The seconds
   !> of rows are means over the ranks.
   type :: rates_t
      real(wp), allocatable :: rows(:, :)   !< of the timers, by level, s: (rows, levels); without contact
      real(wp) :: step = 0.0_wp             !< total without contact, waiting included, s
      real(wp) :: contact = 0.0_wp          !< search for contact, without any contact point, s
      real(wp) :: contact_point = 0.0_wp !< per contact point, over all steps of the finest level in the
                                         !< coarse step, s
      real(wp) :: history = 0.0_wp          !< per row of the histories, s
      real(wp) :: snapshot = 0.0_wp         !< per snapshot, s
   contains
      procedure :: particles
      procedure :: blocks
   end type rates_t

   !> The amount of work between two times of a scene.
   type :: prospect_t
      real(wp) :: steps = 0.0_wp            !< of the coarsest level
      real(wp) :: touches = 0.0_wp          !< contact points, summed over those steps
      real(wp) :: max_touches = 0.0_wp     !< maximum at one time
      real(wp) :: rest = 0.0_wp !< particle-steps of blocks at rest, over those of all: at most 1
      real(wp) :: rows = 0.0_wp             !< rows of histories
      real(wp) :: snapshots = 0.0_wp
      type(flight_t) :: flight
   contains
      procedure :: seconds
   end type prospect_t

contains

   !> True for the rows whose work is proportional to the particles: four phases, and effects.
   pure function particle_rows(rows, names) result(goes)
      integer, intent(in) :: rows
      character(len=*), intent(in) :: names(:)
      logical :: goes(rows)
      goes = .true.
      goes(:phases) = .false.
      goes([phase_lists, phase_p2g, phase_g2p, phase_stress]) = .true.
      where (names == 'levels' .or. names == 'checkpoint' .or. names == 'indicators' &
             .or. names == 'guard') goes = .false.
   end function particle_rows

   !> Time per step of the work proportional to particles, on each level, s.
   pure function particles(self, names) result(seconds)
      class(rates_t), intent(in) :: self
      character(len=*), intent(in) :: names(:) !< of the rows
      real(wp) :: seconds(size(self%rows, 2))
      integer :: l
      do l = 1, size(seconds)
         seconds(l) = sum(self%rows(:, l), mask=particle_rows(size(names), names))
      end do
   end function particles

   !> Time per step of all other work except contact, s: proportional to blocks.
   pure real(wp) function blocks(self, names)
      class(rates_t), intent(in) :: self
      character(len=*), intent(in) :: names(:)
      blocks = max(0.0_wp, self%step - sum(self%particles(names)))
   end function blocks

   !> Collective: the cost of `steps` steps, from the timers before and after them and the elapsed time.
   !> `awake` is the active share of the particle-steps: the rates are those of active particles.
   subroutine rates_of(rates, model, before, steps, elapsed, awake)
      type(rates_t), intent(inout) :: rates
      type(model_t), intent(in) :: model
      type(timers_t), intent(in) :: before
      real(wp), intent(in) :: steps, elapsed, awake
      real(wp) :: total(size(model%timers%seconds)), waiting
      integer :: rows
      rows = size(total)
      if (allocated(rates%rows)) deallocate (rates%rows)
      allocate (rates%rows(rows, size(model%levels)))
      rates%rows = model%timers%on_levels
      rates%rows(:size(before%seconds), :) = rates%rows(:size(before%seconds), :) - before%on_levels
      total = model%timers%seconds
      total(:size(before%seconds)) = total(:size(before%seconds)) - before%seconds
      call MPI_Allreduce(MPI_IN_PLACE, rates%rows, size(rates%rows), MPI_DOUBLE_PRECISION, MPI_SUM, &
                         model%communicator%comm)
      call MPI_Allreduce(MPI_IN_PLACE, total, rows, MPI_DOUBLE_PRECISION, MPI_SUM, model%communicator%comm)
      rates%rows = rates%rows/(model%communicator%ranks*steps)
      total = total/(model%communicator%ranks*steps)
      waiting = elapsed/steps - total(phase_contact) - total(phase_output) - sum(rates%rows) &
                + sum(rates%rows(phase_contact, :))
      rates%contact = total(phase_contact)
      rates%contact_point = 0.0_wp
      rates%rows(phase_contact, :) = 0.0_wp
      call scale_up(rates%rows, particle_rows(rows, model%timers%names), 1.0_wp/max(awake, 1.0e-3_wp))
      rates%step = sum(rates%rows) + max(0.0_wp, waiting)
   end subroutine rates_of

   pure subroutine scale_up(rows, which, factor)
      real(wp), intent(inout) :: rows(:, :)
      logical, intent(in) :: which(:)
      real(wp), intent(in) :: factor
      integer :: l
      do l = 1, size(rows, 2)
         where (which) rows(:, l) = factor*rows(:, l)
      end do
   end subroutine scale_up

   !> Collective: the work from the model's time to the end of the scene, with tools at their future positions
   !> in the material as it is. Load-driven tools do not move.
   subroutine predict_costs(prospect, scene, model)
      type(prospect_t), intent(out) :: prospect
      type(scene_t), intent(in) :: scene
      type(model_t), intent(in) :: model
      real(wp) :: touches, closest, from, to, every
      integer :: n
      do n = 1, parts
         from = model%time + (n - 1)*(scene%end_time - model%time)/parts
         to = model%time + n*(scene%end_time - model%time)/parts
         call contact_points(model, 0.5_wp*(from + to), touches, closest)
         prospect%touches = prospect%touches + touches*steps_between(scene, model, from, to)
         prospect%max_touches = max(prospect%max_touches, touches)
      end do
      prospect%steps = max(1.0_wp, real(ceiling(steps_between(scene, model, model%time, scene%end_time) &
                                                - 1.0e-6_wp, i8), wp))
      call find_rest(prospect, scene, model)
      prospect%flight = follow_flight(scene, model)
      every = scene%output%history_every
      if (every <= 0.0_wp) every = scene%end_time/1000
      prospect%rows = 0.0_wp
      if (scene%output%present) prospect%rows = min(prospect%steps, 1 + (scene%end_time - model%time)/every)
      if (.not. scene%output%present) return
      if (size(scene%output%formats) == 0) return
      prospect%snapshots = 1.0_wp
      if (.not. scene%output%every > 0.0_wp) return
      every = max(scene%output%every, scene%end_time/many)
      prospect%snapshots = min(prospect%steps, real(ceiling(scene%end_time/every*(1.0_wp - 1.0e-9_wp), i8) &
                                                    - int(model%time/every, i8), wp))
   end subroutine predict_costs

   !> Number of contact solutions in a step of the coarsest level.
   pure real(wp) function contact_steps(model)
      type(model_t), intent(in) :: model
      contact_steps = 1.0_wp
      if (model%method%subcycle) contact_steps = 2.0_wp**(size(model%levels) - 1)
   end function contact_steps

   !> Collective: number of particles of the finest level touched by the tools at a time, with the material as
   !> it is: those whose contact point is within half an edge of a tool's surface; and the distance (m) of the
   !> closest contact point from it.
   subroutine contact_points(model, time, touches, closest, inside)
      type(model_t), intent(in) :: model
      real(wp), intent(in) :: time !< s
      real(wp), intent(out) :: touches, closest
      real(wp), intent(out), optional :: inside !< number including those further in
      type(tool_t) :: tool
      real(wp) :: edge, gap, normal(3), reach
      integer(i8) :: reached, beyond
      integer :: b, p, t
      reached = 0
      beyond = 0
      closest = huge(1.0_wp)
      associate (level => model%levels(size(model%levels)))
         do t = 1, size(model%contact%tools)
            tool = model%contact%tools(t)
            call tool%carry_to(time)
            do b = 1, size(level%blocks)
               if (level%blocks(b)%particles%count == 0) cycle
               call tool%gap_and_normal(0.5_wp*(level%blocks(b)%lowest + level%blocks(b)%highest), gap, &
                                        normal)
               reach = 0.5_wp*norm2(level%blocks(b)%highest - level%blocks(b)%lowest) + level%grid%cell
               if (gap < -reach) then
                  closest = min(closest, gap)
                  beyond = beyond + level%blocks(b)%particles%count
               end if
               if (abs(gap) > reach) cycle
               do p = 1, level%blocks(b)%particles%count
                  associate (column => level%blocks(b)%particles%column, at => level%layout)
                     edge = level%edge(column(p, :))
                     if (tool%min_gap(column(p, at%position:at%position + 2)) &
                         > max(edge, closest + edge)) cycle
                     call tool%gap_and_normal(column(p, at%position:at%position + 2), gap, normal)
                  end associate
                  gap = gap - tool%spec%penetration_factor*edge
                  closest = min(closest, gap)
                  if (abs(gap) <= 0.5_wp*edge) reached = reached + 1
                  if (gap <= 0.0_wp) beyond = beyond + 1
               end do
            end do
         end do
      end associate
      touches = real(model%communicator%sum_count(reached), wp)
      closest = model%communicator%minimum(closest)
      if (present(inside)) inside = real(model%communicator%sum_count(beyond), wp)
   end subroutine contact_points

   !> Collective: the share of the remaining particle-steps spent by blocks at rest. Motion spreads by one
   !> cell a step, from the bounding box of the moving blocks; if there is none, from the point where the
   !> tools will touch.
   subroutine find_rest(prospect, scene, model)
      type(prospect_t), intent(inout) :: prospect
      type(scene_t), intent(in) :: scene
      type(model_t), intent(in) :: model
      real(wp) :: low(3), high(3), start, away, sums(2), particle_steps, touches, closest, early, late
      integer :: b, l, n
      low = huge(1.0_wp)
      high = -huge(1.0_wp)
      do l = 1, size(model%levels)
         do b = 1, size(model%levels(l)%blocks)
            associate (block => model%levels(l)%blocks(b))
               if (block%particles%count == 0 .or. block%rests()) cycle
               low = min(low, block%lowest)
               high = max(high, block%highest)
            end associate
         end do
      end do
      call MPI_Allreduce(MPI_IN_PLACE, low, 3, MPI_DOUBLE_PRECISION, MPI_MIN, model%communicator%comm)
      call MPI_Allreduce(MPI_IN_PLACE, high, 3, MPI_DOUBLE_PRECISION, MPI_MAX, model%communicator%comm)
      start = 0.0_wp
      if (any(low > high)) then
         if (size(model%contact%tools) == 0) then
            prospect%rest = merge(0.0_wp, 1.0_wp, size(model%effects) > 0)
            return
         end if
         low = model%contact%tools(1)%spec%tip
         high = low
         do n = 0, parts ! until the tools touch
            call contact_points(model, model%time + n*(scene%end_time - model%time)/parts, touches, closest)
            if (closest <= 0.0_wp) exit
         end do
         late = model%time + n*(scene%end_time - model%time)/parts
         early = max(model%time, late - (scene%end_time - model%time)/parts)
         do n = 1, halvings
            call contact_points(model, 0.5_wp*(early + late), touches, closest)
            if (closest <= 0.0_wp) late = 0.5_wp*(early + late)
            if (closest > 0.0_wp) early = 0.5_wp*(early + late)
         end do
         start = steps_between(scene, model, model%time, late)
      end if
      sums = 0.0_wp
      do l = 1, size(model%levels)
         particle_steps = 1.0_wp
         if (model%method%subcycle) particle_steps = 2.0_wp**(l - 1)
         do b = 1, size(model%levels(l)%blocks)
            associate (block => model%levels(l)%blocks(b))
               if (block%particles%count == 0) cycle
               away = 0.0_wp
               if (block%rests()) &
                  away = start + maxval(max(0.0_wp, block%lowest - high, &
                                            low - block%highest)) /model%levels(1)%grid%cell
               sums = sums + particle_steps*block%particles%count*[min(away, prospect%steps), prospect%steps]
            end associate
         end do
      end do
      call MPI_Allreduce(MPI_IN_PLACE, sums, 2, MPI_DOUBLE_PRECISION, MPI_SUM, model%communicator%comm)
      prospect%rest = sums(1)/sums(2)
   end subroutine find_rest

   !> Time of that work by the rates: total, particles of all levels, blocks, contact, output (s).
   pure function seconds(self, rates, names) result(spent)
      class(prospect_t), intent(in) :: self
      type(rates_t), intent(in) :: rates
      character(len=*), intent(in) :: names(:) !< of the rows
      real(wp) :: spent(5)
      spent(2) = self%flight%particle_load*self%steps*(1.0_wp - self%rest)*sum(rates%particles(names))
      spent(3) = self%flight%block_load*self%steps*rates%blocks(names)
      spent(4) = self%steps*rates%contact + self%touches*rates%contact_point
      spent(5) = self%rows*rates%history + self%snapshots*rates%snapshot
      spent(1) = sum(spent(2:5))
   end function seconds

   !> Collective: bytes of particles and of the rest of all levels.
   function model_bytes(model) result(bytes)
      type(model_t), intent(in) :: model
      real(wp) :: bytes(2)
      integer(i8) :: stores, all
      integer :: b, l
      stores = 0
      all = 0
      do l = 1, size(model%levels)
         all = all + model%levels(l)%bytes() + model%exchange(l)%held()
         do b = 1, size(model%levels(l)%blocks)
            stores = stores + model%levels(l)%blocks(b)%bytes()
         end do
      end do
      bytes = real([model%communicator%sum_count(stores), model%communicator%sum_count(all - stores)], wp)
   end function model_bytes

end module m_forecast
