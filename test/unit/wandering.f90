!> Models whose particles wander at random, the same way on any number of ranks, and what is known of them all
!> the while: every rank can tell where each particle must be and what it must carry.
module m_wandering
   use mpi_f08
   use m_kinds, only: wp, i4, i8
   use m_constants, only: block_size
   use m_errors, only: error_t
   use m_communicator, only: communicator_t
   use m_box, only: box_t
   use m_sphere, only: sphere_t
   use m_scene, only: scene_t, grid_spec_t, body_spec_t, tool_spec_t, probe_spec_t
   use m_materials, only: material_of
   use m_model, only: model_t
   use m_effect, only: effect_t, hooks_t
   use m_group_reader, only: group_reader_t
   use m_field_table, only: field_table_t, layout_t
   use m_particle_store, only: particle_store_t
   use m_migration, only: frame_of
   use m_locate, only: locate_particles
   use m_sorting, only: sorted_order
   use m_chance, only: chance_of
   implicit none
   private
   public :: wandering_scene, build_wandering, mark, wander, wrong_values, wrong_bins, wrong_lists, all_ids, &
      alone, ordered_ids

   integer, protected, public :: came = 0 !< blocks into which something had come, in all steps, on this rank

   !> Adds a field that nothing but the tests knows.
   type, extends(effect_t) :: marker_t
   contains
      procedure :: variables => no_variables
      procedure :: hooks
      procedure :: declare
   end type marker_t

   real(wp), parameter :: longest_step = 0.9_wp !< of a cell

contains

   !> No scene calls for it by name.
   subroutine no_variables(self, group)
      class(marker_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
   end subroutine no_variables

   pure type(hooks_t) function hooks(self)
      class(marker_t), intent(in) :: self
      hooks = hooks_t()
   end function hooks

   subroutine declare(self, table)
      class(marker_t), intent(inout) :: self
      type(field_table_t), intent(inout) :: table
      call table%declare('mark_of_the_tests', 5, '1', written=.true.)
   end subroutine declare

   !> Two boxes and a sphere in a grid whose cell counts are a multiple of 8, one above and one below.
   function wandering_scene() result(scene)
      type(scene_t) :: scene
      integer :: b
      scene%title = 'wandering particles'
      scene%end_time = 1.0_wp
      scene%grid = grid_spec_t(lower=[0.5_wp, -1.0_wp, 2.0_wp], upper=[0.5_wp, -1.0_wp, 2.0_wp] &
                               + 0.1_wp*[33, 24, 23], cell_size=0.1_wp, cells=[33, 24, 23])
      scene%time%affine = .true.
      allocate (scene%materials(2), scene%bodies(3), scene%tools(0), scene%probes(0))
      scene%materials(1) = material_of('soft', 'elastic', 1000.0_wp, 1.0e6_wp, 0.3_wp)
      scene%materials(2) = material_of('rubber', 'neo_hookean', 1000.0_wp, 1.0e6_wp, 0.3_wp)
      scene%bodies%material = [2, 1, 2]
      do b = 1, 2
         scene%bodies(b)%name = 'body'
         scene%bodies(b)%shape = box_t(lower=scene%grid%lower + 0.1_wp*merge(2, 12, b == 1), &
                                       upper=scene%grid%lower + 0.1_wp*(merge(2, 12, b == 1) + [7, 6, 5]))
         scene%bodies(b)%particles_per_cell = merge(8, 1, b == 1)
      end do
      scene%bodies(3)%name = 'body'
      scene%bodies(3)%shape = sphere_t(center=scene%grid%lower + [2.6_wp, 1.0_wp, 1.5_wp], radius=0.4_wp)
      scene%bodies(3)%particles_per_cell = 27
   end function wandering_scene

   !> A communicator of this rank alone.
   type(communicator_t) function alone()
      alone%comm = MPI_COMM_SELF
      alone%rank = 0
      alone%ranks = 1
   end function alone

   subroutine build_wandering(model, comm, error)
      type(model_t), intent(inout) :: model
      type(communicator_t), intent(in) :: comm
      type(error_t), intent(inout) :: error
      allocate (model%effects(1))
      allocate (model%effects(1)%effect, source=marker_t(name='marker'))
      call model%build(comm, wandering_scene(), error)
      if (.not. error%happened()) call mark(model)
   end subroutine build_wandering

   !> What column c of a particle must hold: distinct, and with bits in all places; places are not touched.
   pure real(wp) function marked(id, c)
      integer(i8), intent(in) :: id
      integer, intent(in) :: c
      marked = 1.0_wp + chance_of(id, c)/3.0_wp
   end function marked

   !> Give every column but the place and the size its mark.
   subroutine mark(model)
      type(model_t), intent(inout) :: model
      integer :: b, c, p
      do b = 1, size(model%levels(1)%blocks)
         associate (particles => model%levels(1)%blocks(b)%particles)
            do c = 1, model%levels(1)%table%columns
               if (is_place(model%levels(1)%layout, c)) cycle
               do p = 1, particles%count
                  particles%column(p, c) = marked(particles%id(p), c)
               end do
            end do
         end associate
      end do
   end subroutine mark

   pure logical function is_place(layout, c)
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: c
      is_place = (c >= layout%position .and. c < layout%position + 3) .or. c == layout%half_size
   end function is_place

   !> Collective: every particle makes a random step of less than a cell along each axis, inside the grid;
   !> then what a step does with particles that moved.
   subroutine wander(model, step)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: step
      real(wp) :: lowest(3), highest(3)
      integer :: b, p
      logical :: moved
      do b = 1, size(model%levels(1)%blocks)
         associate (level => model%levels(1), block => model%levels(1)%blocks(b), &
                    x => model%levels(1)%layout%position)
            call block%cells%link(block%particles%count)
            if (block%particles%count == 0) cycle
            do p = 1, block%particles%count
               block%particles%column(p, x:x + 2) = next_place(model, block%particles%id(p), &
                                                               block%particles%column(p, x:x + 2), step)
            end do
            call locate_particles(block%particles%count, block%particles%column(:, x:x + 2), &
                                  frame_of(level, block), block%cells%bin, block%emigrants, &
                                  block%emigrant_count, moved, lowest, highest)
            call block%particles%changed()
            if (moved) call block%cells%outdate()
            call model%migration(1)%emigrate(model%communicator, level, b)
            call level%keep_order(b)
            call block%cells%link(block%particles%count)
         end associate
      end do
      call model%create_blocks()
      call model%migration(1)%assign_to_blocks(model%communicator, model%levels(1))
      call model%migration(1)%exchange(model%communicator, model%levels(1), model%exchange(1)%ranks)
      do b = 1, size(model%levels(1)%blocks)
         associate (block => model%levels(1)%blocks(b))
            if (block%particles%count > block%cells%counted) came = came + 1
            call block%cells%go_through(1, block%particles%count)
         end associate
      end do
   end subroutine wander

   !> Drifting along x with the step, reflected at the sides.
   pure function next_place(model, id, place, step) result(next)
      type(model_t), intent(in) :: model
      integer(i8), intent(in) :: id
      real(wp), intent(in) :: place(3)
      integer, intent(in) :: step
      real(wp) :: next(3)
      integer :: axis
      associate (grid => model%levels(1)%grid)
         do axis = 1, 3
            next(axis) = place(axis) + longest_step*grid%cell*(2.0_wp*chance_of(id, 1000 + 3*step + axis) &
                         - 1.0_wp)
            if (next(axis) < grid%lower(axis)) next(axis) = 2.0_wp*grid%lower(axis) - next(axis)
            if (next(axis) > grid%upper(axis)) next(axis) = 2.0_wp*grid%upper(axis) - next(axis)
         end do
      end associate
   end function next_place

   !> Values on this rank that are not what the id says.
   integer function wrong_values(model) result(wrong)
      type(model_t), intent(in) :: model
      integer :: b, c, p
      wrong = 0
      do b = 1, size(model%levels(1)%blocks)
         associate (particles => model%levels(1)%blocks(b)%particles)
            do p = 1, particles%count
               if (particles%body(p) /= 1 + int(particles%id(p)/model%levels(1)%layout%ids_of_body)) &
                  wrong = wrong + 1
               do c = 1, model%levels(1)%table%columns
                  if (is_place(model%levels(1)%layout, c)) cycle
                  if (abs(particles%column(p, c) - marked(particles%id(p), c)) > 0.0_wp) wrong = wrong + 1
               end do
            end do
         end associate
      end do
   end function wrong_values

   !> Particles on this rank that are not in the list of their cell, once and behind those stored before, over
   !> all blocks.
   integer function wrong_lists(model, afresh) result(wrong)
      type(model_t), intent(inout) :: model
      logical, intent(in) :: afresh !< lists are made now; else those are asked that arrivals have been linked
                                    !< into
      logical, allocatable :: seen(:)
      integer :: b, bin, p
      wrong = 0
      do b = 1, size(model%levels(1)%blocks)
         associate (block => model%levels(1)%blocks(b), n => model%levels(1)%blocks(b)%particles%count)
            if (.not. afresh .and. block%cells%linked /= n .and. block%cells%counted > 0) wrong = wrong + 1
            call block%cells%link(n)
            allocate (seen(n), source=.false.)
            do bin = 1, size(block%cells%first)
               p = block%cells%first(bin)
               do while (p > 0)
                  if (seen(p) .or. block%cells%bin(p) /= bin) wrong = wrong + 1
                  seen(p) = .true.
                  if (block%cells%next(p) > 0 .and. block%cells%next(p) <= p) wrong = wrong + 1
                  p = block%cells%next(p)
               end do
            end do
            wrong = wrong + count(.not. seen)
            deallocate (seen)
         end associate
      end do
   end function wrong_lists

   !> Particles on this rank that are not in the bin of a node nearest to them.
   integer function wrong_bins(model) result(wrong)
      type(model_t), intent(in) :: model
      integer :: b, p
      real(wp) :: node(3)
      wrong = 0
      associate (grid => model%levels(1)%grid, x => model%levels(1)%layout%position)
         do b = 1, size(model%levels(1)%blocks)
            associate (block => model%levels(1)%blocks(b))
               do p = 1, block%particles%count
                  associate (bin => block%cells%bin(p) - 1)
                     node = grid%lower + grid%cell*(block_size*block%place + [mod(bin, block_size), &
                                                                              mod(bin/block_size, &
                                                                              block_size), bin/block_size**2])
                  end associate
                  if (any(abs(block%particles%column(p, x:x + 2) - node) > &
                          0.5_wp*grid%cell*(1.0_wp + 1.0e-12_wp))) wrong = wrong + 1
               end do
            end associate
         end do
      end associate
   end function wrong_bins

   !> Collective: ids of all ranks with the blocks and places in memory: rows block index, place, id, sorted
   !> by the first two.
   function ordered_ids(model) result(rows)
      type(model_t), intent(in) :: model
      integer(i8), allocatable :: rows(:, :)
      integer(i8), allocatable :: mine(:, :), all(:, :)
      integer, allocatable :: counts(:), offsets(:)
      integer :: b, n, p, r
      n = int(model%levels(1)%particle_count())
      allocate (mine(3, n), counts(model%communicator%ranks), offsets(model%communicator%ranks))
      n = 0
      do b = 1, size(model%levels(1)%blocks)
         do p = 1, model%levels(1)%blocks(b)%particles%count
            n = n + 1
            mine(:, n) = [int(model%levels(1)%blocks(b)%index, i8), int(p, i8), &
                          model%levels(1)%blocks(b)%particles%id(p)]
         end do
      end do
      call MPI_Allgather(3*n, 1, MPI_INTEGER, counts, 1, MPI_INTEGER, model%communicator%comm)
      offsets(1) = 0
      do r = 2, size(counts)
         offsets(r) = offsets(r - 1) + counts(r - 1)
      end do
      allocate (all(3, sum(counts)/3))
      call MPI_Allgatherv(mine, 3*n, MPI_INTEGER8, all, counts, offsets, MPI_INTEGER8, &
                          model%communicator%comm)
      rows = all(:, sorted_order(all(1, :), all(2, :)))
   end function ordered_ids

   !> Collective: the ids of all particles of all ranks, rising.
   function all_ids(model) result(ids)
      type(model_t), intent(in) :: model
      integer(i8), allocatable :: ids(:), rows(:, :)
      rows = ordered_ids(model)
      ids = rows(3, sorted_order(rows(3, :), rows(3, :)))
   end function all_ids

end module m_wandering
