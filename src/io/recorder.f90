!> All output of a run to its directory, and its schedule.
module m_recorder
   use m_kinds, only: wp, i8
   use m_errors, only: error_t, fail
   use m_filesystem, only: remove_file
   use m_communicator, only: communicator_t
   use m_timers, only: wall_time
   use m_multiples, only: times_passed
   use m_scene, only: scene_t
   use m_scene_writer, only: scene_as_namelist
   use m_part_file, only: publish_part
   use m_text_file, only: text_file_t
   use m_plastic, only: von_mises
   use m_contact_area, only: projected_area
   use m_contact_outline, only: outline_under
   use m_outline_file, only: write_outline
   use m_tool_header, only: tool_header
   use m_model, only: model_t
   use m_energy, only: balance_t
   use m_motion_fields, only: motion_columns
   use m_probe, only: probe_t, choose_particle, read_probe
   use m_atoms_output, only: atoms_header, write_atoms
   use m_history, only: history_t, history_header_t, history_text_length
   use m_snapshot, only: snapshot_t
   use m_particle_snapshot, only: take_snapshot
   use m_snapshot_formats, only: format_slot_t, choose_formats
   use m_xdmf_index, only: xdmf_index_t
   use m_xdmf_entry, only: particles_entry, levels_entry
   implicit none
   private
   public :: recorder_t

   integer, parameter :: default_rows = 1000   !< rows of a history if the scene does not set them
   real(wp), parameter :: show_every = 1.0_wp  !< s of wall-clock time

   !> The run that this one continues.
   type, public :: resumption_t
      character(len=:), allocatable :: directory !< output directory of that run
      logical :: in_place = .false.              !< this run writes there too
      integer(i8), allocatable :: probes(:)      !< ids of the particles that the probes follow
   end type resumption_t

   type :: recorder_t
      private
      logical :: writes = .false.
      character(len=:), allocatable :: title, directory
      type(format_slot_t), allocatable :: formats(:) !< of snapshots
      real(wp) :: end_time = 0.0_wp, snapshot_every = 0.0_wp, history_every = 0.0_wp
      real(wp) :: snapshots = 0.0_wp, rows = 0.0_wp !< multiples of each interval reached, with 0
      integer(i8) :: last_snapshot = -1 !< step of the last snapshot
      real(wp) :: shown = 0.0_wp        !< wall time of the last flush of rows, s
      type(error_t) :: late             !< error of rank 0 at that flush: made common with the next row
      type(history_t), allocatable :: histories(:) !< energy; tools; probes; pairs of contact groups
      integer :: tools = 0, probes = 0, pairs = 0  !< numbers of these
      integer :: atoms = 0                         !< index of the history of atoms, 0: none
      type(probe_t), allocatable :: probed(:)
      type(xdmf_index_t) :: particles_index, levels_index
   contains
      procedure :: start
      procedure :: history_is_due
      procedure :: record_history
      procedure :: snapshot_is_due
      procedure :: record_snapshot
      procedure :: mark
      procedure :: go_back
      procedure :: show_rows
      procedure :: sync
      procedure :: probe_ids
      procedure :: finish
      procedure, private :: resume
   end type recorder_t

contains

   !> Collective: write case.nml and open the histories, or continue those of the previous run.
   subroutine start(self, scene, model, error, resumption)
      class(recorder_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(model_t), intent(in) :: model
      type(error_t), intent(inout) :: error
      type(resumption_t), intent(in), optional :: resumption
      integer, allocatable :: step !< last step kept in the index files; not allocated: new index files
      integer :: n
      logical :: ok
      self%writes = scene%output%present
      self%end_time = scene%end_time
      self%title = scene%title
      self%history_every = scene%output%history_every
      if (self%history_every <= 0.0_wp) self%history_every = scene%end_time/default_rows
      call make_room(self, scene, model)
      if (present(resumption)) call self%resume(model%time, scene%output%every)
      if (.not. self%writes) return
      self%directory = scene%output%directory
      call choose_formats(scene%output%formats, self%formats)
      self%snapshot_every = scene%output%every
      if (model%communicator%is_root()) then
         call write_case(self%directory//'/case.nml', scene, error)
         if (.not. present(resumption)) call remove_file(self%directory//'/cost.dat', ok) ! of an earlier run
      end if
      call model%communicator%agree(error)
      if (error%happened()) return
      call begin(self%histories(1), 'energy.dat', energy_header(self%title))
      do n = 1, size(scene%tools)
         call begin(self%histories(1 + n), 'tool_'//scene%tools(n)%name//'.dat', tool_header(scene, n))
      end do
      do n = 1, size(scene%probes)
         if (present(resumption)) then
            self%probed(n)%id = resumption%probes(n)
         else
            self%probed(n) = choose_particle(model, scene%probes(n)%position)
         end if
         call begin(self%histories(1 + self%tools + n), 'probe_'//scene%probes(n)%name//'.dat', &
                    probe_header(self%title, scene%probes(n)%name, motion_columns(model%levels(1)%layout)))
      end do
      do n = 1, self%pairs
         associate (groups => model%contact%pairs%specs(n)%groups)
            call begin(self%histories(1 + self%tools + self%probes + n), &
                       'contact_'//scene%group_label(groups(1))//'_'//scene%group_label(groups(2))//'.dat', &
                       pair_header(self%title, scene%group_label(groups(1)), scene%group_label(groups(2))))
         end associate
      end do
      if (self%atoms > 0) &
         call begin(self%histories(self%atoms), model%atoms%file('.dat'), atoms_header(self%title))
      if (present(resumption)) then
         if (resumption%in_place) step = int(model%step)
      end if
      call self%particles_index%start(model%communicator, self%directory, 'particles', error, step, &
                                      series=.true.)
      call self%levels_index%start(model%communicator, self%directory, 'levels', error, step)
   contains
      subroutine begin(history, name, header)
         type(history_t), intent(inout) :: history
         character(len=*), intent(in) :: name
         type(history_header_t), intent(in) :: header
         if (present(resumption)) then
            call history%open(model%communicator, self%directory//'/'//name, header, error, &
                              keep_until=model%time, from=resumption%directory//'/'//name)
         else
            call history%open(model%communicator, self%directory//'/'//name, header, error)
         end if
      end subroutine begin
   end subroutine start

   !> Allocate the histories of a run.
   subroutine make_room(self, scene, model)
      class(recorder_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(model_t), intent(in) :: model
      integer :: count
      self%tools = size(scene%tools)
      self%probes = size(scene%probes)
      self%pairs = size(model%contact%pairs%specs)
      count = 1 + self%tools + self%probes + self%pairs
      if (allocated(model%atoms)) self%atoms = count + 1
      allocate (self%histories(max(count, self%atoms)), self%probed(self%probes))
   end subroutine make_room

   !> Set the counters of output from the time of a checkpoint (s).
   pure subroutine resume(self, time, every)
      class(recorder_t), intent(inout) :: self
      real(wp), intent(in) :: time, every
      self%rows = 1.0_wp + times_passed(self%history_every, time)
      self%snapshots = 1.0_wp
      if (every > 0.0_wp) self%snapshots = 1.0_wp + times_passed(every, time)
   end subroutine resume

   !> Ids of the particles that the probes follow.
   pure function probe_ids(self) result(ids)
      class(recorder_t), intent(in) :: self
      integer(i8), allocatable :: ids(:)
      ids = self%probed%id
   end function probe_ids

   !> After a step: flush rows that are older than a second, for other readers.
   subroutine show_rows(self)
      class(recorder_t), intent(inout) :: self
      integer :: n
      if (.not. self%writes) return
      if (wall_time() - self%shown < show_every) return
      self%shown = wall_time()
      do n = 1, size(self%histories)
         call self%histories(n)%flush(self%late)
      end do
   end subroutine show_rows

   !> Collective: on return all rows of the histories are on the disk.
   subroutine sync(self, communicator, error)
      class(recorder_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      type(error_t), intent(inout) :: error
      integer :: n
      if (.not. self%writes) return
      do n = 1, size(self%histories)
         call self%histories(n)%sync(error)
      end do
      call communicator%agree(error)
   end subroutine sync

   !> Write case.nml: the scene with every value used.
   subroutine write_case(path, scene, error)
      character(len=*), intent(in) :: path
      type(scene_t), intent(in) :: scene
      type(error_t), intent(inout) :: error
      type(text_file_t) :: file
      call file%open(path, error)
      if (error%happened()) return
      call file%put(scene_as_namelist(scene), error)
      call file%close(error)
      call publish_part(path, error)
   end subroutine write_case

   !> True at the start, at the end, and when the next row is due.
   pure logical function history_is_due(self, time)
      class(recorder_t), intent(in) :: self
      real(wp), intent(in) :: time
      history_is_due = due(self%rows, self%history_every, time, self%end_time)
   end function history_is_due

   !> True when the `done`-th output at multiples of `every` is due (0: only first and last).
   pure logical function due(done, every, time, end_time)
      real(wp), intent(in) :: done, every, time, end_time
      due = done < 1.0_wp .or. time >= end_time
      if (every > 0.0_wp) due = due .or. time >= done*every*(1.0_wp - 1.0e-12_wp)
   end function due

   !> Collective: append a row to every history.
   subroutine record_history(self, model, balance, error)
      class(recorder_t), intent(inout) :: self
      type(model_t), intent(inout) :: model
      type(balance_t), intent(in) :: balance
      type(error_t), intent(inout) :: error
      real(wp) :: area, position(3), stress(6), plastic_strain, recovered(6)
      real(wp), allocatable :: motion(:)
      logical :: exists
      integer :: n
      self%rows = 1.0_wp + times_passed(self%history_every, model%time)
      if (.not. self%writes) return
      if (self%late%happened()) error = self%late
      call self%histories(1)%append([model%time, balance%now%kinetic, balance%now%strain, &
                                     balance%now%plastic, &
                               balance%damped, balance%external_work, balance%error(), balance%now%momentum, &
                               balance%now%angular_momentum, balance%now%mass, balance%particle_work()], &
                               error)
      do n = 1, self%tools
         associate (tool => model%contact%tools(n), state => model%contact%states(n))
            area = 0.0_wp
            if (any(abs(state%load) > 0.0_wp)) &
               area = projected_area(model%communicator, tool, model%levels(size(model%levels)), &
                                     model%materials, model%contact%candidates, n)
            call self%histories(1 + n)%append([model%time, tool%depth(), state%load, area, state%overlap, &
                                               tool%point, tool%orientation, tool%velocity, tool%spin, &
                                               state%moment, model%contact%candidates%deepest(n)], error)
         end associate
      end do
      do n = 1, self%probes
         call read_probe(model, self%probed(n), position, stress, plastic_strain, recovered, motion, exists)
         if (.not. exists) cycle ! it has been eroded
         call self%histories(1 + self%tools + n)%append([model%time, position, stress, mises(stress), &
                                                         plastic_strain, recovered, mises(recovered), &
                                                         motion], error)
      end do
      do n = 1, self%pairs
         associate (pair => model%contact%pairs%states(n))
            call self%histories(1 + self%tools + self%probes + n)%append( &
               [model%time, pair%force, pair%moment, pair%area, model%contact%pairs%overlap(n), pair%heat, &
                pair%parting, model%contact%pairs%deflection(n)], error)
         end associate
      end do
      if (self%atoms > 0) call self%histories(self%atoms)%append([model%time, model%atoms%row()], error)
      call model%communicator%agree(error)
   end subroutine record_history

   !> Von Mises stress of a stress (Pa).
   pure real(wp) function mises(stress)
      real(wp), intent(in) :: stress(6) !< xx yy zz yz xz xy
      mises = von_mises(stress(1), stress(2), stress(3), stress(4), stress(5), stress(6))
   end function mises

   !> Mark the position to which `go_back` returns.
   subroutine mark(self)
      class(recorder_t), intent(inout) :: self
      if (self%writes) call self%histories%mark()
   end subroutine mark

   !> Collective: remove the rows since the mark. The model must be back at the mark, with no other output
   !> since.
   subroutine go_back(self, model, error)
      class(recorder_t), intent(inout) :: self
      type(model_t), intent(in) :: model
      type(error_t), intent(inout) :: error
      integer :: n
      call self%resume(model%time, self%snapshot_every)
      if (.not. self%writes) return
      do n = 1, size(self%histories)
         call self%histories(n)%take_back(error)
      end do
      call model%communicator%agree(error)
   end subroutine go_back

   !> True when a snapshot of the particles is due.
   pure logical function snapshot_is_due(self, time)
      class(recorder_t), intent(in) :: self
      real(wp), intent(in) :: time
      snapshot_is_due = self%writes
      if (snapshot_is_due) snapshot_is_due = size(self%formats) > 0
      if (snapshot_is_due) snapshot_is_due = due(self%snapshots, self%snapshot_every, time, self%end_time)
   end function snapshot_is_due

   !> Collective: write a snapshot of the particles, if one is due, or `now` unless there is one of this step.
   subroutine record_snapshot(self, model, error, now)
      class(recorder_t), intent(inout) :: self
      type(model_t), intent(inout) :: model
      type(error_t), intent(inout) :: error
      logical, intent(in), optional :: now
      type(snapshot_t) :: snapshot
      logical :: wanted
      integer :: f
      wanted = self%snapshot_is_due(model%time)
      if (present(now)) wanted = now .and. self%writes .and. model%step /= self%last_snapshot
      if (wanted) wanted = size(self%formats) > 0
      if (.not. wanted) return
      self%last_snapshot = model%step
      self%snapshots = 1.0_wp
      if (self%snapshot_every > 0.0_wp) &
         self%snapshots = 1.0_wp + times_passed(self%snapshot_every, model%time)
      snapshot%time = model%time
      snapshot%step = int(model%step)
      snapshot%title = self%title
      call take_snapshot(model, snapshot)
      do f = 1, size(self%formats)
         if (error%happened()) exit
         call self%formats(f)%it%write(model%communicator, snapshot, self%directory, error)
      end do
      do f = 1, size(self%formats)
         if (.not. self%formats(f)%it%indexed) cycle
         call self%particles_index%add(model%communicator, snapshot%step, particles_entry(snapshot), error)
         if (allocated(snapshot%levels)) &
            call self%levels_index%add(model%communicator, snapshot%step, levels_entry(snapshot), error)
      end do
      if (.not. error%happened()) call record_outlines(self, model, error)
      if (self%atoms > 0) call write_atoms(model, self%directory, snapshot, error)
   end subroutine record_snapshot

   !> Collective: with a snapshot, write the edge of contact of each tool.
   subroutine record_outlines(self, model, error)
      class(recorder_t), intent(in) :: self
      type(model_t), intent(inout) :: model
      type(error_t), intent(inout) :: error
      integer :: n
      do n = 1, self%tools
         associate (tool => model%contact%tools(n))
            if (.not. any(abs(model%contact%states(n)%load) > 0.0_wp)) cycle
            call write_outline(model%communicator, self%directory, tool%spec%name, self%title, model%time, &
                               int(model%step), outline_under(model%communicator, tool, &
                               model%levels(size(model%levels)), model%materials, &
                               model%contact%candidates, n), error)
         end associate
      end do
   end subroutine record_outlines

   !> Close the histories, also when the run ends with an error.
   subroutine finish(self, error)
      class(recorder_t), intent(inout) :: self
      type(error_t), intent(inout) :: error
      integer :: n
      if (.not. self%writes .or. .not. allocated(self%histories)) return
      if (self%late%happened()) call fail(error, self%late%status, self%late%message)
      do n = 1, size(self%histories)
         call self%histories(n)%close(error)
      end do
   end subroutine finish

   function energy_header(title) result(header)
      character(len=*), intent(in) :: title
      type(history_header_t) :: header
      header%title = title
      header%zone = 'energy'
      header%columns = [character(len=history_text_length) :: 'time [s]', 'kinetic [J]', 'strain [J]', &
                        'plastic [J]', 'damped [J]', 'external_work [J]', 'balance_error [1]', &
                        'momentum_x [kg m/s]', 'momentum_y [kg m/s]', 'momentum_z [kg m/s]', &
                        'angular_momentum_x [kg m2/s]', 'angular_momentum_y [kg m2/s]', &
                        'angular_momentum_z [kg m2/s]', 'mass [kg]', 'particle_work [J]']
   end function energy_header

   function pair_header(title, one, other) result(header)
      character(len=*), intent(in) :: title, one, other
      type(history_header_t) :: header
      header%title = title
      header%zone = 'contact of '//one//' and '//other
      header%columns = [character(len=history_text_length) :: 'time [s]', 'force_x [N]', 'force_y [N]', &
                        'force_z [N]', 'moment_x [N m]', 'moment_y [N m]', 'moment_z [N m]', &
                        'contact_area [m2]', 'max_gap_violation [m]', 'friction_heat [J]', &
                        'adhesion_work [J]', 'max_deflection [m]']
   end function pair_header

   function probe_header(title, name, motion) result(header)
      character(len=*), intent(in) :: title, name, motion(:)
      type(history_header_t) :: header
      header%title = title
      header%zone = 'probe '//name
      header%columns = [character(len=history_text_length) :: 'time [s]', 'x [m]', 'y [m]', 'z [m]', &
                        'stress_xx [Pa]', 'stress_yy [Pa]', 'stress_zz [Pa]', 'stress_yz [Pa]', &
                        'stress_xz [Pa]', 'stress_xy [Pa]', 'von_mises [Pa]', &
                        'equivalent_plastic_strain [1]', 'stress_recovered_xx [Pa]', &
                        'stress_recovered_yy [Pa]', 'stress_recovered_zz [Pa]', &
                        'stress_recovered_yz [Pa]', 'stress_recovered_xz [Pa]', &
                        'stress_recovered_xy [Pa]', 'von_mises_recovered [Pa]', motion]
   end function probe_header

end module m_recorder
