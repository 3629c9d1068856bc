!> A checkpoint: everything that a run needs to go on, to the same bits (doc/developer/files.md has the tables
!> of the file).
!>
!> One procedure, `describe`, names all that is not particles: it writes while a checkpoint is written and
!> reads while one is read.
module m_checkpoint
   use, intrinsic :: iso_c_binding, only: c_loc
   use mpi_f08
   use m_kinds, only: wp, i8
   use m_constants, only: exit_files, program_version
   use m_errors, only: error_t, fail
   use m_communicator, only: communicator_t
   use m_checksum, only: text_checksum
   use m_part_file, only: part_name
   use m_scene, only: scene_t
   use m_scene_writer, only: scene_as_namelist, physics_as_namelist
   use m_model, only: model_t
   use m_restore, only: block_table_t, table_width, bounds_width, take_blocks, restore_blocks, check_particles
   use m_energy, only: balance_t, sums_t
   use m_guard, only: guard_facts
   use m_snapshot, only: file_layout_t
   use m_motion_store, only: describe_motions
   use m_pair_store, only: describe_pairs
   use m_state_store, only: store_t, some_rows
   use m_hdf5_file, only: hdf5_file_t, rows_of_byte
   use m_hdf5_reader, only: hdf5_reader_t
   use m_checkpoint_particles, only: put_bounds, put_particles, get_particles, own_columns
   use m_checkpoint_file, only: checkpoint_name, checkpoint_format, seal_checkpoint, seal_length, &
                                find_checkpoint
   implicit none
   private
   public :: write_checkpoint, particle_bytes, run_facts_t

   !> What a run knows besides its model and its balance.
   type :: run_facts_t
      integer(i8) :: particles = 0              !< at the start of the scene
      integer(i8), allocatable :: probes(:)     !< ids of the probed particles
      real(wp) :: guard(guard_facts) = 0.0_wp   !< what the guard remembers
   end type run_facts_t

   !> A checkpoint that is read.
   type, public :: checkpoint_t
      character(len=:), allocatable :: path, directory
      character(len=:), allocatable :: note !< newer ones that are damaged, in a sentence; empty: none
      type(hdf5_reader_t), private :: file
   contains
      procedure :: open => open_checkpoint
      procedure :: scene_text
      procedure :: restore
      procedure :: close => close_checkpoint
   end type checkpoint_t

   integer(i8), parameter :: longest_case = 2_i8**28  !< bytes
   integer(i8), parameter :: most_unknowns = 2_i8**24 !< of the contact solver of a rank
   integer, parameter :: sums = 12

contains

   !> Collective: write `<directory>/checkpoint_<step>.h5`. Once it has its name it is whole and on the disk;
   !> after an error (exit_files) nothing of it is left, and all ranks hold the error.
   subroutine write_checkpoint(directory, scene, model, balance, facts, path, error)
      character(len=*), intent(in) :: directory
      type(scene_t), intent(in) :: scene
      type(model_t), intent(inout) :: model
      type(balance_t), intent(inout) :: balance
      type(run_facts_t), intent(inout) :: facts
      character(len=:), allocatable, intent(out) :: path
      type(error_t), intent(inout) :: error
      type(store_t) :: store
      type(block_table_t) :: blocks
      character(len=:), allocatable :: text
      path = directory//'/'//checkpoint_name(model%step)
      call take_blocks(model, blocks)
      text = scene_as_namelist(scene)
      store%writes = .true.
      store%communicator = model%communicator
      ! HDF5 writes <path>.part.part, which becomes <path>.part, which gets its seal and its name
      call store%output%create(model%communicator, part_name(path), bytes_of(model, blocks) + len(text), &
                               error, front=seal_length)
      if (error%happened()) return
      call store%output%put_integers('/', 'format', [checkpoint_format], error)
      call store%output%put_text('/', 'program', 'gimp3d '//program_version, error)
      call store%output%put_text('/', 'title', scene%title, error)
      call store%output%put_real('/', 'time', model%time, error)
      call store%output%put_text('/', 'time_unit', 's', error)
      call store%output%put_text('/', 'physics', text_checksum(physics_as_namelist(scene)), error)
      call put_scene(store%output, model%communicator, text, error)
      call store%output%make_group('/state', error)
      call describe(store, model, balance, facts, error)
      call store%output%make_group('/blocks', error)
      call store%longs('/blocks/table', blocks%table, error)
      call put_bounds(store%output, blocks, error)
      call store%output%make_group('/particles', error)
      call put_particles(store%output, model, blocks, error)
      call store%output%finish(error)
      call seal_checkpoint(model%communicator, path, error)
   end subroutine write_checkpoint

   !> Bytes of the tables, about.
   integer(i8) function bytes_of(model, blocks) result(bytes)
      type(model_t), intent(in) :: model
      type(block_table_t), intent(in) :: blocks
      bytes = particle_bytes(model, blocks%particles) + 8_i8*(table_width + bounds_width)*size(blocks%table, &
            2)
   end function bytes_of

   !> Bytes of so many particles in a checkpoint.
   pure integer(i8) function particle_bytes(model, particles)
      type(model_t), intent(in) :: model
      integer(i8), intent(in) :: particles
      particle_bytes = 8_i8*particles*(model%levels(1)%table%columns + own_columns)
   end function particle_bytes

   !> Collective: open the newest whole checkpoint of a directory.
   subroutine open_checkpoint(self, communicator, directory, error)
      class(checkpoint_t), intent(out) :: self
      type(communicator_t), intent(in) :: communicator
      character(len=*), intent(in) :: directory
      type(error_t), intent(inout) :: error
      self%directory = directory
      call find_checkpoint(communicator, directory, self%path, self%note, error)
      if (.not. error%happened()) call self%file%open(communicator, self%path, error)
   end subroutine open_checkpoint

   subroutine close_checkpoint(self)
      class(checkpoint_t), intent(inout) :: self
      call self%file%close()
   end subroutine close_checkpoint

   !> Collective: the scene, as the run had it.
   subroutine scene_text(self, text, error)
      class(checkpoint_t), intent(in) :: self
      character(len=:), allocatable, intent(out) :: text
      type(error_t), intent(inout) :: error
      character(len=1), allocatable, target :: letters(:)
      integer(i8) :: extent(2)
      integer :: i
      text = ''
      call self%file%find_extent('/case', extent, error)
      if (error%happened()) return
      if (extent(1) /= 1 .or. extent(2) > longest_case) &
         call fail(error, exit_files, 'cannot go on from '//self%path//': it has no scene')
      if (error%happened()) return
      allocate (letters(extent(2)))
      call self%file%get_rows('/case', rows_of_byte, extent, all_rows(extent(2)), c_loc(letters), error)
      if (error%happened()) return
      deallocate (text)
      allocate (character(len=int(extent(2))) :: text)
      do i = 1, len(text)
         text(i:i) = letters(i)
      end do
   end subroutine scene_text

   !> Collective: a model of the scene that has been built empty, and the rest of the run, as they were.
   subroutine restore(self, model, balance, facts, error)
      class(checkpoint_t), intent(inout) :: self
      type(model_t), intent(inout) :: model
      type(balance_t), intent(inout) :: balance
      type(run_facts_t), intent(inout) :: facts
      type(error_t), intent(inout) :: error
      type(store_t) :: store
      type(error_t) :: fault
      type(block_table_t) :: blocks
      integer(i8) :: extent(2), ranks(1)
      integer(i8), allocatable :: regions(:)
      call self%file%find_extent('/blocks/table', extent, fault)
      if (extent(1) /= table_width .or. extent(2) > 2_i8**31 - 1) extent = 0
      allocate (blocks%table(table_width, extent(2)), blocks%bounds(bounds_width, extent(2)))
      store%communicator = model%communicator
      store%input = self%file
      call store%longs('/blocks/table', blocks%table, fault)
      call store%reals('/blocks/bounds', blocks%bounds, fault)
      call store%longs('/state/ranks', ranks, fault)
      extent = 0
      if (size(model%levels) > 1) call self%file%find_extent('/state/regions', extent, fault)
      allocate (regions(extent(2)))
      if (size(model%levels) > 1) call store%longs('/state/regions', regions, fault)
      call self%file%find_extent('/particles/own', extent, fault)
      blocks%particles = extent(2)
      if (.not. fault%happened()) call restore_blocks(model, regions, ranks(1), blocks, fault)
      if (.not. fault%happened()) call describe(store, model, balance, facts, fault)
      if (.not. fault%happened()) call get_particles(self%file, model, blocks, fault)
      if (.not. fault%happened()) call check_particles(model, fault)
      if (fault%happened()) call fail(error, fault%status, 'cannot go on from '//self%path//': '// &
                                      fault%message)
   end subroutine restore

   !> Collective: all that is not particles, to or from the store.
   subroutine describe(store, model, balance, facts, error)
      type(store_t), intent(inout) :: store
      type(model_t), intent(inout) :: model
      type(balance_t), intent(inout) :: balance
      type(run_facts_t), intent(inout) :: facts
      type(error_t), intent(inout) :: error
      integer(i8) :: counts(5), one(1)
      integer(i8), allocatable :: regions(:)
      real(wp) :: clock(4)
      real(wp), allocatable :: works(:, :)
      integer :: l
      associate (comm => model%communicator)
         counts = [model%step, model%moves, comm%sum_count(model%merges), comm%sum_count(model%splits), &
                  facts%particles]
         call store%longs('/state/counts', counts, error)
         model%step = counts(1)
         model%moves = counts(2)
         model%merges = merge(counts(3), 0_i8, comm%is_root())
         model%splits = merge(counts(4), 0_i8, comm%is_root())
         facts%particles = counts(5)
         one = comm%ranks
         if (store%writes) call store%longs('/state/ranks', one, error)
      end associate
      clock = [model%time, model%bounds%wave_speed, model%bounds%particle_speed, model%lost]
      call store%reals('/state/clock', clock, error)
      model%time = clock(1)
      model%bounds%wave_speed = clock(2)
      model%bounds%particle_speed = clock(3)
      model%lost = clock(4)
      if (model%has_statics) then
         clock(:1) = model%static_step
         call store%reals('/state/static_step', clock(:1), error)
         model%static_step = clock(1)
      end if
      call describe_balance(store, balance, error)
      call describe_guard(store, model, facts, error)
      allocate (works(3, size(model%levels)))
      works(1, :) = model%effect_step%external_work
      works(2, :) = model%effect_step%damped
      works(3, :) = model%effect_step%particle_work
      call store%reals('/state/effects', works, error)
      model%effect_step%external_work = works(1, :)
      model%effect_step%damped = works(2, :)
      model%effect_step%particle_work = works(3, :)
      allocate (regions(0))
      do l = 2, size(model%levels)
         regions = [regions, model%levels(l)%region%packed()]
      end do
      if (store%writes .and. size(regions) > 0) call store%longs('/state/regions', regions, error)
      if (size(facts%probes) > 0) call store%longs('/state/probes', facts%probes, error)
      if (model%follows_groups()) then
         if (.not. allocated(model%first_centres)) &
            allocate (model%first_centres(3, model%levels(1)%grid%fields))
         call store%reals('/state/centres', model%first_centres, error)
      end if
      if (model%contact%active()) call describe_contact(store, model, error)
   end subroutine describe

   !> Collective: the tools, and what contact keeps from step to step.
   subroutine describe_contact(store, model, error)
      type(store_t), intent(inout) :: store
      type(model_t), intent(inout) :: model
      type(error_t), intent(inout) :: error
      integer(i8) :: effort(7)
      real(wp) :: worth(5)
      real(wp), allocatable :: tools(:, :)
      integer :: t
      associate (contact => model%contact)
         allocate (tools(10, max(1, size(contact%tools))), source=0.0_wp) ! a row even where bodies meet alone
         do t = 1, size(contact%tools)
            associate (state => contact%states(t))
               tools(:, t) = [contact%tools(t)%freedoms(1)%travel, contact%tools(t)%freedoms(1)%speed, &
                              state%load, state%overlap, &
                              state%work, state%heat, state%particle_work, &
                              state%constraint_work]
            end associate
         end do
         call store%reals('/state/tools', tools, error)
         do t = 1, size(contact%tools)
            contact%tools(t)%freedoms(1)%travel = tools(1, t)
            contact%tools(t)%freedoms(1)%speed = tools(2, t)
            contact%states(t)%load = tools(3:5, t)
            contact%states(t)%overlap = tools(6, t)
            contact%states(t)%work = tools(7, t)
            contact%states(t)%heat = tools(8, t)
            contact%states(t)%particle_work = tools(9, t)
            contact%states(t)%constraint_work = tools(10, t)
         end do
         call describe_motions(store, contact%tools, error)
         call describe_pairs(store, contact%pairs, error)
         worth = [contact%worst_residual, contact%worst_overlap, &
                  model%communicator%maximum(contact%worst_bridge), contact%friction%steepest, &
                  model%communicator%maximum(contact%candidates%drift)]
         call store%reals('/state/contact', worth, error)
         contact%worst_residual = worth(1)
         contact%worst_overlap = worth(2)
         contact%worst_bridge = worth(3)
         contact%friction%steepest = worth(4)
         contact%candidates%drift = worth(5)
         effort = [contact%solves, contact%iterations, contact%unsolved, contact%largest, &
                   contact%system%products, contact%friction%sweeps, contact%friction%iterations]
         call store%longs('/state/solves', effort, error)
         contact%solves = effort(1)
         contact%iterations = effort(2)
         contact%unsolved = effort(3)
         contact%largest = effort(4)
         contact%system%products = effort(5)
         contact%friction%sweeps = effort(6)
         contact%friction%iterations = effort(7)
      end associate
      call describe_solver(store, model, error)
   end subroutine describe_contact

   !> Collective: unknowns that the contact solver of each rank has room for, below 0 before it is first
   !> needed. Its sums run over all of that room, so that their last bits depend on it. On another number of
   !> ranks it finds its own.
   subroutine describe_solver(store, model, error)
      type(store_t), intent(inout) :: store
      type(model_t), intent(inout) :: model
      type(error_t), intent(inout) :: error
      integer(i8) :: capacity(model%communicator%ranks), extent(2)
      capacity = -1
      if (store%writes) then
         call MPI_Allgather(int(model%contact%solver%capacity, i8), 1, MPI_INTEGER8, capacity, 1, &
                            MPI_INTEGER8, model%communicator%comm)
         call store%longs('/state/solver', capacity, error)
         return
      end if
      call store%input%find_extent('/state/solver', extent, error)
      if (extent(2) /= size(capacity)) return
      call store%longs('/state/solver', capacity, error)
      if (error%happened() .or. any(capacity < 0 .or. capacity > most_unknowns)) return
      call model%contact%solver%fit(model%communicator%comm%MPI_VAL, &
                                    int(capacity(model%communicator%rank + 1)))
   end subroutine describe_solver

   subroutine describe_guard(store, model, facts, error)
      type(store_t), intent(inout) :: store
      type(model_t), intent(inout) :: model
      type(run_facts_t), intent(inout) :: facts
      type(error_t), intent(inout) :: error
      real(wp) :: values(guard_facts + 1)
      values = [facts%guard, real(model%contact%unsolved_in_row, wp)]
      call store%reals('/state/guard', values, error)
      facts%guard = values(:guard_facts)
      model%contact%unsolved_in_row = nint(values(guard_facts + 1), i8)
   end subroutine describe_guard

   subroutine describe_balance(store, balance, error)
      type(store_t), intent(inout) :: store
      type(balance_t), intent(inout) :: balance
      type(error_t), intent(inout) :: error
      real(wp) :: start(sums), now(sums), rest(6)
      start = plain(balance%start)
      now = plain(balance%now)
      rest = [balance%external_work, balance%damped, balance%largest, balance%worst, &
              balance%worst_of_effects, balance%worst_of_tools]
      call store%reals('/state/balance_start', start, error)
      call store%reals('/state/balance_now', now, error)
      call store%reals('/state/balance', rest, error)
      balance%start = sums_t(start(1), start(2), start(3), start(4), start(5:7), start(8:10), start(11), &
                             start(12))
      balance%now = sums_t(now(1), now(2), now(3), now(4), now(5:7), now(8:10), now(11), now(12))
      balance%external_work = rest(1)
      balance%damped = rest(2)
      balance%largest = rest(3)
      balance%worst = rest(4)
      balance%worst_of_effects = rest(5)
      balance%worst_of_tools = rest(6)
   contains
      pure function plain(of) result(values)
         type(sums_t), intent(in) :: of
         real(wp) :: values(sums)
         values = [of%mass, of%kinetic, of%strain, of%plastic, of%momentum, of%angular_momentum, &
                  of%dissipated, of%potential]
      end function plain
   end subroutine describe_balance

   subroutine put_scene(file, communicator, text, error)
      type(hdf5_file_t), intent(in) :: file
      type(communicator_t), intent(in) :: communicator
      character(len=*), intent(in) :: text
      type(error_t), intent(inout) :: error
      character(len=1), allocatable, target :: letters(:)
      letters = transfer(text, letters, len(text))
      call file%put_rows('/case', rows_of_byte, [1_i8, len(text, i8)], &
                         some_rows(0_i8, merge(len(text), 0, communicator%is_root())), c_loc(letters), error)
   end subroutine put_scene

   !> All rows of a table, for every rank.
   pure type(file_layout_t) function all_rows(rows) result(layout)
      integer(i8), intent(in) :: rows
      layout = some_rows(0_i8, int(rows))
   end function all_rows

end module m_checkpoint
