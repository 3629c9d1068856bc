!> Creation of the blocks that the bodies of a scene need, and of the particles in them.
submodule (m_model) m_model_filling
   use m_number_text, only: reals_text
   use m_text, only: si, to_text
   use m_constants, only: block_size, exit_input
   use m_errors, only: fail
   use m_coupling, only: build_atoms
   use m_machine, only: free_memory
   use m_level, only: tile_bytes
   use m_particle_store, only: bytes_besides
   use m_field_table, only: bytes_per_column
   use m_body, only: first_id, fill_block, count_in_block, expected_count
   use m_placement, only: work_of, choose_owners
   use m_decomposition, only: set_owners, bytes_of_blocks
   use m_large_pages, only: hold_large_pages
   use m_block, only: block_t
   use m_locate, only: bin_of
   use m_migration, only: frame_of
   implicit none

contains

   module procedure populate
      integer, allocatable :: counts(:), owner(:)
      integer :: e, finest, l
      logical :: fills
      fills = .true.
      if (present(empty)) fills = .not. empty
      if (.not. fills) call build_atoms(self%atoms, self%effects, scene, self%communicator, error)
      if (.not. fills) return
      call require_memory(self, scene%place('cell_size'), sum(expected_count(scene%bodies, &
            self%levels(1)%grid)), 0.0_wp, error)
      if (error%happened()) return
      call check_stresses(self, scene, error)
      call require_tables(self, scene%place('cell_size'), error)
      if (error%happened()) return
      call count_particles(self, scene, counts, error)
      if (error%happened()) return
      finest = blocks_before(self%levels, size(self%levels)) + 1 ! blocks of the other levels have two tiles
      call require_memory(self, scene%place('cell_size'), sum(real(max(counts, 0), wp)), &
                          real(count(counts >= 0) + count(counts(:finest - 1) >= 0), wp), error)
      if (error%happened()) return
      allocate (owner(size(counts)))
      call choose_owners(self%communicator, self%levels, work_of(self%levels, counts, &
            self%steps_of_levels()), owner, error)
      if (error%happened()) return
      call set_owners(self%levels, owner)
      call hold_large_pages(bytes_of_blocks(self%levels, counts, owner, self%communicator%rank))
      call self%connect()
      do l = 1, size(self%levels)
         call fill(self, scene, l)
      end do
      call self%communicator%agree(error)
      if (error%happened()) return
      if (self%contact%pairs%active()) &
         call self%contact%pairs%begin(self%communicator, scene, self%levels(size(self%levels)), error)
      call self%communicator%agree(error)
      if (error%happened()) return
      if (self%follows_groups()) self%first_centres = self%centres_of_mass()
      call self%prepare_blocks()
      if (size(self%levels) > 1) call self%rebalance(error) ! now that all blocks exist
      do e = 1, size(self%effects)
         call self%effects(e)%effect%verify(self%communicator, self%levels, size(scene%tools), error)
      end do
      call self%communicator%agree(error)
      if (.not. error%happened()) call build_atoms(self%atoms, self%effects, scene, self%communicator, error)
   end procedure populate

   !> A body's initial stress must be admissible: its law must not change it without motion.
   subroutine check_stresses(self, scene, error)
      class(model_t), intent(in) :: self
      type(scene_t), intent(in) :: scene
      type(error_t), intent(inout) :: error
      real(wp), parameter :: same = 1.0e-9_wp !< relative
      real(wp) :: column(1, self%levels(1)%table%columns), gradient(1, 9), time_step
      integer :: body
      do body = 1, size(scene%bodies)
         associate (spec => scene%bodies(body), at => self%levels(1)%layout, &
                    law => self%materials%slots(self%materials%of_body(body))%law)
            if (.not. any(abs(spec%stress) > 0.0_wp)) cycle
            column = 0.0_wp
            column(1, at%volume) = scene%grid%cell_size**3
            column(1, at%mass) = law%density*column(1, at%volume)
            column(1, at%stress:at%stress + 5) = spec%stress
            if (at%orientation > 0) column(1, at%orientation:at%orientation + 3) = spec%turned_axes()
            call law%initial(column, at, 1, 1)
            call law%begin_stressed(spec%stress, column, at, 1, 1)
            gradient = 0.0_wp
            time_step = 1.0e-3_wp*scene%grid%cell_size/sqrt(law%p_wave_modulus()/law%density)
            call law%update(column, at, gradient, time_step, 1, 1)
            if (maxval(abs(column(1, at%stress:at%stress + 5) - spec%stress)) &
                <= same*maxval(abs(spec%stress))) cycle
            call fail(error, exit_input, scene%place('body', body)//': the law does not admit the '// &
               'initial stress='// &
                      reals_text(spec%stress, 6)//' Pa; it would become '// &
                      reals_text(column(1, at%stress:at%stress + 5), 6)//' Pa')
         end associate
      end do
   end subroutine check_stresses

   !> Create the particles of one level.
   subroutine fill(self, scene, l)
      class(model_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: l
      real(wp), allocatable :: cells(:, :)
      integer :: b, body, e, filled
      do b = 1, size(self%levels(l)%blocks)
         associate (block => self%levels(l)%blocks(b))
            do body = 1, size(scene%bodies)
               if (self%levels(l)%field_of_body(body) /= block%field) cycle
               filled = block%particles%count
               call fill_block(self%levels, l, block, scene%bodies(body), body, &
                               scene%materials(scene%bodies(body)%material)%density, &
                               first_id(body, self%levels(l)%layout), cells)
               if (block%particles%count == filled) cycle
               associate (law => self%materials%slots(self%materials%of_body(body))%law)
                  call law%initial(block%particles%column, self%levels(l)%layout, filled + 1, &
                                   block%particles%count)
                  if (any(abs(scene%bodies(body)%stress) > 0.0_wp)) &
                     call law%begin_stressed(scene%bodies(body)%stress, block%particles%column, &
                                             self%levels(l)%layout, filled + 1, block%particles%count)
               end associate
               do e = 1, size(self%effects)
                  call self%effects(e)%effect%cover(block%particles, filled + 1, scene%bodies, body, &
                                                    cells, self%levels(l)%layout, self%levels(l)%grid)
               end do
            end do
            call set_bins(self%levels(l), block)
            do e = 1, size(self%effects)
               call self%effects(e)%effect%initialise(block%particles, self%levels(l)%table, &
                                                      self%levels(l)%layout, self%levels(l)%grid)
            end do
         end associate
      end do
      call self%levels(l)%size_work()
      do b = 1, size(self%levels(l)%blocks)
         call self%levels(l)%keep_order(b)
      end do
   end subroutine fill

   !> Set bins and bounds of the particles of a block that has just been filled.
   subroutine set_bins(level, block)
      type(level_t), intent(in) :: level
      type(block_t), intent(inout) :: block
      integer :: p
      associate (x => level%layout%position)
         do p = 1, block%particles%count
            block%cells%bin(p) = bin_of(block%particles%column(p, x:x + 2), frame_of(level, block))
            call block%include_place(block%particles%column(p, x:x + 2))
         end do
      end associate
      call block%cells%outdate()
      call block%particles%changed()
   end subroutine set_bins

   !> Collective: an error if the model does not fit into the memory of the machines.
   subroutine require_memory(self, place, particles, tiles, error)
      class(model_t), intent(in) :: self
      character(len=*), intent(in) :: place    !< beginning of the message
      real(wp), intent(in) :: particles, tiles !< numbers of them
      type(error_t), intent(inout) :: error
      real(wp) :: needed, free
      free = free_memory(self%communicator)
      needed = particles*(bytes_per_column*self%levels(1)%table%columns + bytes_besides) + tiles*tile_bytes
      if (needed > free) &
         call fail(error, exit_input, place//': the scene makes about '//to_text(particles, 3)// &
                   ' particles, which need '//si(needed, 'B')//' of memory; '//si(free, 'B')// &
                   ' are free; use larger cells, fewer particles_per_cell or more machines')
   end subroutine require_memory

   !> Collective: an error if tables with a row for each possible block would not fit into the free memory.
   subroutine require_tables(self, place, error)
      class(model_t), intent(in) :: self
      character(len=*), intent(in) :: place    !< beginning of the message
      type(error_t), intent(inout) :: error
      real(wp), parameter :: bytes_a_place = 48.0_wp !< of all tables that exist at one time: measured
      real(wp) :: free, needed, places
      integer :: l
      places = 0.0_wp
      do l = 1, size(self%levels)
         places = places + product(real(self%levels(l)%grid%blocks, wp))*self%levels(l)%grid%fields
      end do
      free = free_memory(self%communicator)
      needed = bytes_a_place*places*self%communicator%ranks
      if (needed > free) &
         call fail(error, exit_input, place//': '//to_text(size(self%levels) - 1)// &
                   ' levels over the grid have '//to_text(places, 3)//' places for blocks of '// &
                   to_text(block_size)//' nodes along each axis, whose tables need '// &
                   si(needed, 'B')//' of memory; '//si(free, 'B')// &
                   ' are free: take fewer levels, larger cells or a smaller grid')
   end subroutine require_tables

   !> Collective: number of particles of each block of each level by index, -1 where there are none; each rank
   !> counts a share of the blocks.
   subroutine count_particles(self, scene, counts, error)
      class(model_t), intent(in) :: self
      type(scene_t), intent(in) :: scene
      integer, allocatable, intent(out) :: counts(:)
      type(error_t), intent(inout) :: error !< set for a body without particles
      integer(i8) :: of_body(size(scene%bodies))
      integer :: before, body, found, index, l
      of_body = 0
      allocate (counts(blocks_before(self%levels, size(self%levels) + 1)), source=0)
      do l = 1, size(self%levels)
         before = blocks_before(self%levels, l)
         do index = 1 + self%communicator%rank, self%levels(l)%grid%block_count(), self%communicator%ranks
            do body = 1, size(scene%bodies)
               if (self%levels(l)%field_of_body(body) /= self%levels(l)%grid%block_field(index)) cycle
               found = count_in_block(self%levels, l, self%levels(l)%grid%block_place(index), &
                                      scene%bodies(body))
               counts(before + index) = counts(before + index) + found
               of_body(body) = of_body(body) + found
            end do
         end do
      end do
      call MPI_Allreduce(MPI_IN_PLACE, counts, size(counts), MPI_INTEGER, MPI_SUM, self%communicator%comm)
      where (counts == 0) counts = -1
      call add_parents(self%levels, counts)
      call MPI_Allreduce(MPI_IN_PLACE, of_body, size(of_body), MPI_INTEGER8, MPI_SUM, self%communicator%comm)
      do body = 1, size(of_body)
         if (of_body(body) == 0) call fail(error, exit_input, scene%place('body', body)// &
            ': the body contains no particle centre; allowed: a larger body, or a '// &
            'smaller cell_size')
      end do
   end subroutine count_particles

end submodule m_model_filling
