!> A checkpoint: everything needed to continue a run with the same bits (doc/developer/files.md has the tables
!> of the file).
!>
!> The state of the model is listed in state.f90; here are the other data of a run.
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
   use m_energy, only: balance_t
   use m_state, only: describe_state, regions_of, state_format
   use m_guard, only: guard_facts
   use m_snapshot, only: file_layout_t
   use m_file_store, only: file_store_t, some_rows
   use m_hdf5_file, only: hdf5_file_t, rows_of_byte
   use m_hdf5_reader, only: hdf5_reader_t
   use m_checkpoint_particles, only: put_bounds, put_particles, get_particles, own_columns
   use m_checkpoint_file, only: checkpoint_name, seal_checkpoint, seal_length, find_checkpoint
   implicit none
   private
   public :: write_checkpoint, particle_bytes, run_facts_t

   !> Data of a run other than its model and its balance.
   type :: run_facts_t
      integer(i8) :: particles = 0              !< at the start of the scene
      integer(i8), allocatable :: probes(:)     !< ids of the probed particles
      real(wp) :: guard(guard_facts) = 0.0_wp   !< the guard's state
   end type run_facts_t

   !> A checkpoint being read.
   type, public :: checkpoint_t
      character(len=:), allocatable :: path, directory
      character(len=:), allocatable :: note !< newer checkpoints that are damaged, as a message; empty: none
      type(hdf5_reader_t), private :: file
   contains
      procedure :: open => open_checkpoint
      procedure :: scene_text
      procedure :: restore
      procedure :: close => close_checkpoint
   end type checkpoint_t

   integer(i8), parameter :: longest_case = 2_i8**28  !< bytes
   integer(i8), parameter :: max_unknowns = 2_i8**24 !< of the contact solver on a rank

contains

   !> Collective: write `<directory>/checkpoint_<step>.h5`. Once it has this name it is complete and on the
   !> disk; after an error (exit_files) nothing of it is left, and all ranks hold the error.
   subroutine write_checkpoint(directory, scene, model, balance, facts, path, error)
      character(len=*), intent(in) :: directory
      type(scene_t), intent(in) :: scene
      type(model_t), intent(inout) :: model
      type(balance_t), intent(inout) :: balance
      type(run_facts_t), intent(inout) :: facts
      character(len=:), allocatable, intent(out) :: path
      type(error_t), intent(inout) :: error
      type(file_store_t) :: store
      type(block_table_t) :: blocks
      character(len=:), allocatable :: text
      path = directory//'/'//checkpoint_name(model%step)
      call take_blocks(model, blocks)
      text = scene_as_namelist(scene)
      store%writes = .true.
      store%communicator = model%communicator
      ! HDF5 writes <path>.part.part, which is renamed <path>.part, which gets its seal and final name
      call store%output%create(model%communicator, part_name(path), bytes_of(model, blocks) + len(text), &
                               error, front=seal_length)
      if (error%happened()) return
      call store%output%put_integers('/', 'format', [state_format], error)
      call store%output%put_text('/', 'program', 'gimp3d '//program_version, error)
      call store%output%put_text('/', 'title', scene%title, error)
      call store%output%put_real('/', 'time', model%time, error)
      call store%output%put_text('/', 'time_unit', 's', error)
      call store%output%put_text('/', 'physics', text_checksum(physics_as_namelist(scene)), error)
      call put_scene(store%output, model%communicator, text, error)
      call store%output%make_group('/state', error)
      call describe_state(store, model, balance, error)
      call describe_run(store, model, facts, error)
      call put_regions(store, model, error)
      call store%output%make_group('/blocks', error)
      call store%longs('/blocks/table', blocks%table, error)
      call put_bounds(store%output, blocks, error)
      call store%output%make_group('/particles', error)
      call put_particles(store%output, model, blocks, error)
      call store%output%finish(error)
      call seal_checkpoint(model%communicator, path, error)
   end subroutine write_checkpoint

   !> Estimated size of the tables, bytes.
   integer(i8) function bytes_of(model, blocks) result(bytes)
      type(model_t), intent(in) :: model
      type(block_table_t), intent(in) :: blocks
      bytes = particle_bytes(model, blocks%particles) &
              + 8_i8*(table_width + bounds_width)*size(blocks%table, 2)
   end function bytes_of

   !> Bytes of a number of particles in a checkpoint.
   pure integer(i8) function particle_bytes(model, particles)
      type(model_t), intent(in) :: model
      integer(i8), intent(in) :: particles
      particle_bytes = 8_i8*particles*(model%levels(1)%table%columns + own_columns)
   end function particle_bytes

   !> Collective: open the latest complete checkpoint of a directory.
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

   !> Collective: the scene as the run used it.
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
         call fail(error, exit_files, 'cannot restart from '//self%path//': it has no scene')
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

   !> Collective: restore the state into a model of the scene built without particles, and the other data of
   !> the run.
   subroutine restore(self, model, balance, facts, error)
      class(checkpoint_t), intent(inout) :: self
      type(model_t), intent(inout) :: model
      type(balance_t), intent(inout) :: balance
      type(run_facts_t), intent(inout) :: facts
      type(error_t), intent(inout) :: error
      type(file_store_t) :: store
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
      if (.not. fault%happened()) call describe_state(store, model, balance, fault)
      if (.not. fault%happened()) call describe_run(store, model, facts, fault)
      if (.not. fault%happened()) call get_particles(self%file, model, blocks, fault)
      if (.not. fault%happened()) call check_particles(model, fault)
      if (fault%happened()) call fail(error, fault%status, 'cannot restart from '//self%path//': '// &
                                      fault%message)
   end subroutine restore

   !> Collective: transfer the run's counters to or from the store. A roll-back does not reset them.
   subroutine describe_run(store, model, facts, error)
      type(file_store_t), intent(inout) :: store
      type(model_t), intent(inout) :: model
      type(run_facts_t), intent(inout) :: facts
      type(error_t), intent(inout) :: error
      integer(i8) :: ranks(1), particles(1), effort(7)
      ranks = model%communicator%ranks
      if (store%writes) call store%longs('/state/ranks', ranks, error)
      particles = facts%particles
      call store%longs('/state/particles', particles, error)
      facts%particles = particles(1)
      call store%reals('/state/guard', facts%guard, error)
      if (size(facts%probes) > 0) call store%longs('/state/probes', facts%probes, error)
      if (.not. model%contact%active()) return
      associate (contact => model%contact)
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
   end subroutine describe_run

   !> Collective: write the regions of the levels; `restore` reads them before it creates the blocks.
   subroutine put_regions(store, model, error)
      type(file_store_t), intent(inout) :: store
      type(model_t), intent(in) :: model
      type(error_t), intent(inout) :: error
      integer(i8), allocatable :: regions(:)
      regions = regions_of(model)
      if (size(regions) > 0) call store%longs('/state/regions', regions, error)
   end subroutine put_regions

   !> Collective: capacity in unknowns of each rank's contact solver, below 0 before its first use. Its sums
   !> run over the whole capacity, so their last bits depend on it. On another number of ranks it is chosen
   !> anew.
   subroutine describe_solver(store, model, error)
      type(file_store_t), intent(inout) :: store
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
      if (error%happened() .or. any(capacity < 0 .or. capacity > max_unknowns)) return
      call model%contact%solver%fit(model%communicator%comm%MPI_VAL, &
                                    int(capacity(model%communicator%rank + 1)))
   end subroutine describe_solver

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

   !> Layout of all rows of a table, for every rank.
   pure type(file_layout_t) function all_rows(rows) result(layout)
      integer(i8), intent(in) :: rows
      layout = some_rows(0_i8, int(rows))
   end function all_rows

end module m_checkpoint
