!> Measurement of the cost of a step of a model on the available ranks. The model is unusable afterwards: its
!> tools have been moved to fictitious positions.
module m_calibration
   use mpi_f08, only: MPI_COMM_SELF
   use m_box, only: box_t
   use m_kinds, only: wp, i8
   use m_errors, only: error_t
   use m_communicator, only: communicator_t
   use m_timers, only: timers_t, wall_time, processor_time, phase_contact
   use m_scene, only: scene_t
   use m_model, only: model_t
   use m_advance, only: advance
   use m_move_regions, only: move_regions
   use m_speed_bounds, only: bound_speeds
   use m_time_step, only: longest_step
   use m_energy, only: balance_t
   use m_forecast, only: rates_t, prospect_t, rates_of, predict_costs, contact_points, contact_steps, &
                         particle_rows
   use m_snapshot, only: snapshot_t
   use m_snapshot_formats, only: format_slot_t, choose_formats
   use m_probe, only: probe_t, choose_particle, read_probe
   use m_particle_snapshot, only: take_snapshot
   use m_contact_area, only: projected_area
   implicit none
   private
   public :: calibrate, calibration_t, sample_cost

   !> The measured costs, and the sample they are from.
   type :: calibration_t
      type(rates_t) :: rates
      type(prospect_t) :: prospect             !< of the whole scene
      integer :: steps = 0                     !< timed with the tools at their start
      integer :: pressed_steps = 0             !< timed with the tools pressed in
      real(wp) :: pressed_time = 0.0_wp        !< time of the scene at which tools had that position, s
      real(wp) :: pressed_points = 0.0_wp      !< contact points in each of those steps
      real(wp) :: seconds = 0.0_wp             !< duration of the calibration, s
      real(wp) :: processor = 0.0_wp           !< processor time of that: mean of the ranks
      real(wp) :: snapshot_bytes = 0.0_wp      !< of the numbers of one snapshot, of all ranks
      real(wp) :: file_bytes = 0.0_wp          !< of its files, all formats together
      real(wp) :: writing_bytes = 0.0_wp       !< additional memory for writing it, of all ranks
      real(wp) :: library_bytes = 0.0_wp       !< and of the libraries for it
      character(len=:), allocatable :: trouble !< why contact was not measured with tools pressed in; empty:
                                               !< measured, or not needed
   end type calibration_t

   real(wp), parameter :: enough = 1.0_wp      !< s: duration of the timed steps, up to a maximum number
   real(wp), parameter :: library = 5.0e6_wp !< bytes of HDF5 with MPI's files, a rank, when a file is written
                                             !< (performance.md)
   real(wp), parameter :: few = 20.0_wp        !< too few contact points to determine the cost of one
   real(wp), parameter :: short = 0.3_wp       !< s: what takes less is timed again
   real(wp), parameter :: little = 1.0e-6_wp   !< cells
   real(wp), parameter :: more = 1.5_wp        !< ratio of contact points that suffices to determine the cost
                                               !< of one
   real(wp), parameter :: at_most = 0.1_wp     !< of the steps of the scene
   integer, parameter :: max_steps = 300, min_steps = 4, warm_steps = 3, pressed = 8

contains

   !> Collective: cost of a step of the model at the start of the scene, with all particles moving; then with
   !> the tools pressed in. Steps that fail are an error, except those with the tools pressed in, which are
   !> left out.
   subroutine calibrate(found, scene, model, error)
      type(calibration_t), intent(out) :: found
      type(scene_t), intent(in) :: scene
      type(model_t), intent(inout) :: model
      type(error_t), intent(inout) :: error
      real(wp) :: began, resting_points, time, worked
      began = wall_time()
      worked = processor_time()
      found%trouble = ''
      call warm_up(scene, model, error)
      if (.not. error%happened()) then
         time = model%time
         model%time = 0.0_wp
         call predict_costs(found%prospect, scene, model) ! blocks at rest are known only after some steps
         ! add the first
         if (found%prospect%snapshots > 0.0_wp) found%prospect%snapshots = found%prospect%snapshots + 1.0_wp
         model%time = time
         model%skip_at_rest = .false.
         call nudge(model)
         call warm_up(scene, model, error)
      end if
      if (.not. error%happened()) call time_steps(found, scene, model, resting_points, error)
      if (error%happened()) then
         error%message = 'no plan can be made, because the first steps of the scene fail: '//error%message
         return
      end if
      call time_output(found, scene, model)
      if (size(model%contact%tools) > 0) call press(found, scene, model, resting_points)
      found%seconds = model%communicator%maximum(wall_time() - began)
      found%processor = model%communicator%sum_real(processor_time() - worked)/model%communicator%ranks
   end subroutine calibrate

   !> Shift all material slightly: particles exactly half-way between nodes of two blocks may change block by
   !> round-off in every step.
   subroutine nudge(model)
      type(model_t), intent(inout) :: model
      integer :: b, l, n, x
      do l = 1, size(model%levels)
         x = model%levels(l)%layout%position
         do b = 1, size(model%levels(l)%blocks)
            associate (particles => model%levels(l)%blocks(b)%particles)
               n = particles%count
               if (n > 0) particles%column(:n, x:x + 2) = particles%column(:n, x:x + 2) &
                                                          + little*model%levels(1)%grid%cell
            end associate
            call model%levels(l)%blocks(b)%particles%changed()
         end do
      end do
   end subroutine nudge

   !> Collective: one step as in a run.
   subroutine take_step(model, time_step, error)
      type(model_t), intent(inout) :: model
      real(wp), intent(in) :: time_step !< s
      type(error_t), intent(inout) :: error
      call advance(model, time_step, error)
      call move_regions(model, error)
   end subroutine take_step

   !> A few steps that are not timed.
   subroutine warm_up(scene, model, error)
      type(scene_t), intent(in) :: scene
      type(model_t), intent(inout) :: model
      type(error_t), intent(inout) :: error
      integer :: n
      do n = 1, warm_steps
         if (.not. error%happened()) call take_step(model, timed_step(scene, model), error)
      end do
   end subroutine warm_up

   !> A step (s) for timing only: so short that the scene does not end before all have been timed.
   pure real(wp) function timed_step(scene, model)
      type(scene_t), intent(in) :: scene
      type(model_t), intent(in) :: model
      timed_step = min(longest_step(scene, model, model%time), scene%end_time/(2*(warm_steps &
            + 2*min_steps)))
   end function timed_step

   !> Collective: steps until the duration suffices, then as many again, which are timed. `points`: contact
   !> points in a step.
   subroutine time_steps(found, scene, model, points, error)
      type(calibration_t), intent(inout) :: found
      type(scene_t), intent(in) :: scene
      type(model_t), intent(inout) :: model
      real(wp), intent(out) :: points
      type(error_t), intent(inout) :: error
      type(timers_t) :: before
      real(wp) :: began, elapsed
      integer(i8) :: handled
      integer :: most, n
      ! the scene must not end before
      most = max(min_steps, min(max_steps, nint(at_most*found%prospect%steps)))
      began = wall_time()
      do
         call take_step(model, timed_step(scene, model), error)
         if (error%happened()) return
         found%steps = found%steps + 1
         elapsed = model%communicator%maximum(wall_time() - began)
         if (found%steps >= min_steps .and. (elapsed >= enough .or. found%steps >= most)) exit
      end do
      before = model%timers
      handled = model%contact%handled
      began = wall_time()
      do n = 1, found%steps
         call take_step(model, timed_step(scene, model), error)
         if (error%happened()) return
      end do
      elapsed = model%communicator%maximum(wall_time() - began)
      call rates_of(found%rates, model, before, real(found%steps, wp), elapsed, 1.0_wp)
      points = real(model%contact%handled - handled, wp)/(found%steps*contact_steps(model))
   end subroutine time_steps

   !> Collective: cost of the sums and the text of a row of the histories, and of the arrays of a snapshot and
   !> their text. Nothing is written: the time of files and disks is not included.
   subroutine time_output(found, scene, model)
      type(calibration_t), intent(inout) :: found
      type(scene_t), intent(in) :: scene
      type(model_t), intent(inout) :: model
      type(snapshot_t) :: snapshot
      type(format_slot_t), allocatable :: formats(:)
      real(wp) :: bytes, largest, value
      integer :: f
      ! what is done for the first time touches new memory
      found%rates%history = median([(row_cost(scene, model), f=1, 3)])
      value = text_cost()
      if (scene%output%present) &
         found%rates%history = found%rates%history + value*(14 + 23*size(scene%tools) + 19*size(scene%probes))
      if (.not. found%prospect%snapshots > 0.0_wp) return
      snapshot%title = ''
      found%rates%snapshot = snapshot_cost(model, snapshot)
      if (found%rates%snapshot < short) found%rates%snapshot = snapshot_cost(model, snapshot)
      bytes = 8.0_wp*(size(snapshot%position) + size(snapshot%id))
      largest = 0.0_wp
      do f = 1, size(snapshot%fields)
         bytes = bytes + 8.0_wp*size(snapshot%fields(f)%values)
         ! each is copied into file order
         largest = max(largest, 8.0_wp*size(snapshot%fields(f)%values))
      end do
      call choose_formats(scene%output%formats, formats)
      found%file_bytes = 0.0_wp
      do f = 1, size(formats)
         found%file_bytes = found%file_bytes + formats(f)%it%bytes(snapshot)
         if (formats(f)%it%is_text) found%rates%snapshot = found%rates%snapshot &
                                                           + model%communicator%maximum(value*bytes/8.0_wp)
      end do
      found%snapshot_bytes = model%communicator%sum_real(bytes)
      largest = largest + 12.0_wp*size(snapshot%id) ! their order
      found%writing_bytes = model%communicator%sum_real(largest)
      found%library_bytes = model%communicator%ranks*library
   end subroutine time_output

   !> Collective: time (s) of the sums of one row of the histories.
   real(wp) function row_cost(scene, model)
      type(scene_t), intent(in) :: scene
      type(model_t), intent(inout) :: model
      type(balance_t) :: balance
      type(probe_t), allocatable :: probes(:)
      real(wp) :: area, began, position(3), stress(6), strain, recovered(6)
      integer :: f
      probes = [(choose_particle(model, scene%probes(f)%position), f=1, size(scene%probes))]
      began = wall_time()
      call balance%follow(model)
      do f = 1, size(scene%tools)
         if (scene%output%present) &
            area = projected_area(model%communicator, model%contact%tools(f), &
                                  model%levels(size(model%levels)), model%materials, &
                                  model%contact%candidates, f)
      end do
      do f = 1, size(probes)
         if (scene%output%present) call read_probe(model, probes(f), position, stress, strain, recovered)
      end do
      row_cost = model%communicator%maximum(wall_time() - began)
   end function row_cost

   !> Collective: time (s) of the arrays of one snapshot.
   real(wp) function snapshot_cost(model, snapshot)
      type(model_t), intent(inout) :: model
      type(snapshot_t), intent(inout) :: snapshot
      real(wp) :: began
      began = wall_time()
      call take_snapshot(model, snapshot)
      snapshot_cost = model%communicator%maximum(wall_time() - began)
   end function snapshot_cost

   !> Time (s) to convert one number to text.
   real(wp) function text_cost()
      integer, parameter :: numbers = 20000
      character(len=25) :: text
      real(wp) :: began
      integer :: n, length
      began = wall_time()
      length = 0
      do n = 1, numbers
         write (text, '(es24.16e3)') sqrt(real(n, wp))
         length = length + len_trim(text)
      end do
      ! use the result, so that the loop is not optimised away
      text_cost = (wall_time() - began)/max(numbers, min(length, numbers))
   end function text_cost

   !> Collective: cost of contact with the tools so far in that there are as many contact points as the scene
   !> will have at most. The material is not displaced: the points inside the tools count.
   subroutine press(found, scene, model, points_before)
      type(calibration_t), intent(inout) :: found
      type(scene_t), intent(in) :: scene
      type(model_t), intent(inout) :: model
      real(wp), intent(in) :: points_before !< contact points in a step with the tools at their start
      type(error_t) :: error
      type(timers_t) :: before
      real(wp) :: total, closest, time, touches, took(pressed)
      integer(i8) :: handled
      integer :: n
      associate (rates => found%rates)
         ! as much contact as there will be: divide it by the points
         if (found%prospect%max_touches <= more*points_before) then
            ! points between bodies are counted already and not foreseen: with them a step costs the same on
            if (points_before > 0.0_wp .and. .not. model%contact%pairs%active()) then
               rates%contact_point = rates%contact/points_before
               rates%contact = 0.0_wp
            end if
            return
         end if
         if (follows(model)) then
            found%trouble = 'levels follow a tool, which is not pressed in then: what contact will cost '// &
               'is not in this'
            return
         end if
         do n = 1, 40 ! until enough contact points are inside
            time = scene%end_time*n/40
            call contact_points(model, time, touches, closest, total)
            if (total >= found%prospect%max_touches) exit
         end do
         model%time = time
         found%pressed_time = time
         handled = 0
         do n = 1, 2 + pressed
            if (n == 3) handled = model%contact%handled
            before = model%timers
            call take_step(model, longest_step(scene, model, time), error)
            if (error%happened()) exit
            model%time = time
            if (n > 2) took(n - 2) = model%timers%seconds(phase_contact) - before%seconds(phase_contact)
         end do
         if (error%happened()) then
            found%trouble = 'contact could not be measured with the tools pressed in ('//error%message//')'
            return
         end if
         found%pressed_steps = pressed
         found%pressed_points = real(model%contact%handled - handled, wp)/(pressed*contact_steps(model))
         ! the median, as one step may be delayed
         total = model%communicator%sum_real(median(took))/model%communicator%ranks
         if (found%pressed_points < few) then
            rates%contact = max(rates%contact, total)
         else if (found%pressed_points > more*points_before) then ! slope of a line through two distinct
                                                                  ! points
            rates%contact_point = max(0.0_wp, (total - rates%contact)/(found%pressed_points - points_before))
            rates%contact = max(0.0_wp, rates%contact - points_before*rates%contact_point)
         end if
      end associate
   end subroutine press

   !> The median of several values.
   pure real(wp) function median(values)
      real(wp), intent(in) :: values(:)
      integer :: v
      median = values(1)
      do v = 1, size(values)
         if (count(values <= values(v)) >= (size(values) + 1)/2 .and. count(values < values(v)) &
             <= size(values)/2) &
            median = values(v)
      end do
   end function median

   !> True when levels follow a tool.
   pure logical function follows(model)
      type(model_t), intent(in) :: model
      follows = .false.
      if (allocated(model%level_specs)) follows = any(model%level_specs%follow > 0)
   end function follows

   !> Time (s) per particle and step, in a block of 16 x 16 x 16 cells of the scene's first material, alone on
   !> each rank; the largest of all ranks.
   real(wp) function sample_cost(scene, communicator, particles_per_cell) result(each)
      type(scene_t), intent(in) :: scene
      type(communicator_t), intent(in) :: communicator
      integer, intent(in) :: particles_per_cell
      type(scene_t) :: sample
      type(model_t) :: model
      type(communicator_t) :: own
      type(error_t) :: error
      type(timers_t) :: before
      integer :: n
      integer, parameter :: cells = 16, steps = 8
      sample%title = 'sample'
      sample%end_time = huge(1.0_wp)
      sample%time = scene%time
      sample%time%time_step = 0.0_wp
      sample%time%safety = min(scene%time%safety, 0.3_wp)
      sample%grid%cell_size = scene%grid%cell_size
      sample%grid%cells = cells + 8
      sample%grid%upper = (cells + 8)*scene%grid%cell_size
      sample%materials = scene%materials(1:1)
      allocate (sample%bodies(1), sample%tools(0), sample%probes(0), sample%levels(0), sample%effects(0))
      sample%bodies(1)%name = 'sample'
      sample%bodies(1)%material = 1
      sample%bodies(1)%shape = box_t(lower=4*scene%grid%cell_size*[1, 1, 1], &
                                     upper=(4 + cells)*scene%grid%cell_size*[1, 1, 1])
      sample%bodies(1)%particles_per_cell = particles_per_cell
      own%comm = MPI_COMM_SELF
      call model%build(own, sample, error)
      model%skip_at_rest = .false.
      each = 0.0_wp
      if (.not. error%happened()) then
         call bound_speeds(model)
         call warm_up(sample, model, error)
         before = model%timers
         do n = 1, steps
            if (.not. error%happened()) call take_step(model, longest_step(sample, model, model%time), error)
         end do
         each = sum(model%timers%seconds - before%seconds, mask=particle_rows(size(before%seconds), &
            before%names)) /(steps*real(model%particle_count(), wp))
      end if
      each = communicator%maximum(each)
      call model%release()
   end function sample_cost

end module m_calibration
