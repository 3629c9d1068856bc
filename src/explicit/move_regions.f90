!> Levels that move with a tool, with the bodies of a contact group, or by a criterion; and the particles that
!> change level.
module m_move_regions
   use m_kinds, only: wp, i8
   use m_constants, only: exit_numerical
   use m_errors, only: error_t, fail
   use m_text, only: to_text
   use m_scene, only: criterion_none, criterion_error
   use m_error_placing, only: place_by_error, is_due
   use m_region, only: region_t
   use m_region_parts, only: unite, first_too_near, smallest_gap
   use m_model, only: model_t
   use m_residence, only: change_pair
   use m_placing, only: judge_region, smallest_width
   implicit none
   private
   public :: move_regions, settle_particles, forget_edge_stress

   integer, parameter :: judged_every = 50 !< steps of the coarsest level between two evaluations of a
                                           !< criterion

contains

   !> Collective: between two steps of the coarsest level, explicit or implicit. Nothing is done on one level
   !> or after an error.
   subroutine move_regions(model, error)
      type(model_t), intent(inout) :: model
      type(error_t), intent(inout) :: error
      if (size(model%levels) == 1 .or. error%happened()) return
      call model%timers%enter(model%levels_row)
      call set_regions(model, error)
      call model%timers%leave()
   end subroutine move_regions

   !> Collective: regions that follow a tool move by whole cells of the coarsest level, so that the gaps
   !> between nested ones do not change.
   subroutine set_regions(model, error)
      type(model_t), intent(inout) :: model
      type(error_t), intent(inout) :: error
      type(region_t) :: region
      type(region_t), allocatable :: by_error(:)
      real(wp), allocatable :: ways(:, :) ! displacements of the contact groups since the start, m
      integer :: l
      logical :: moved
      moved = .false.
      allocate (ways(3, 0))
      if (model%follows_groups()) ways = model%centres_of_mass() - model%first_centres
      by_error = model%levels%region
      if (is_due(model)) call place_by_error(model, by_error, error)
      do l = 2, size(model%levels)
         region = by_error(l)
         call place_region(model, l, ways, region, error)
         if (error%happened()) return
         if (region%same_as(model%levels(l)%region)) cycle
         model%levels(l)%region = region
         moved = .true.
      end do
      if (.not. moved) return
      model%moves = model%moves + 1
      call settle_particles(model, error)
   end subroutine set_regions

   !> Collective: after regions have been set, move particles to their levels.
   subroutine settle_particles(model, error)
      type(model_t), intent(inout) :: model
      type(error_t), intent(inout) :: error
      integer :: l
      call model%place_layers()
      call model%prepare_blocks(edges_moved=.true.)
      do l = size(model%levels) - 1, 1, -1 ! outwards, from the finest
         call change_pair(model, l, error)
         if (error%happened()) return
         call model%prepare_blocks()
      end do
      do l = 1, size(model%levels) - 1     ! inwards, from the coarsest
         call change_pair(model, l, error)
         if (error%happened()) return
         call model%prepare_blocks()
      end do
      call forget_edge_stress(model)
   end subroutine settle_particles

   !> New edges: no stress is ahead of its time there (theory.md, eq. time-levels).
   subroutine forget_edge_stress(model)
      type(model_t), intent(inout) :: model
      integer :: b, e, l
      e = model%levels(1)%layout%edge_stress
      if (e == 0) return
      do l = 2, size(model%levels)
         do b = 1, size(model%levels(l)%blocks)
            associate (particles => model%levels(l)%blocks(b)%particles)
               particles%column(:particles%count, e:e + 5) = 0.0_wp
            end associate
         end do
      end do
   end subroutine forget_edge_stress

   !> The present region of a level: the union of its parts at their present positions.
   subroutine place_region(model, l, ways, region, error)
      type(model_t), intent(in) :: model
      integer, intent(in) :: l
      real(wp), intent(in) :: ways(:, :) !< of the contact groups, m
      type(region_t), intent(inout) :: region !< on entry as it is, or as placed by the error
      type(error_t), intent(inout) :: error
      type(region_t), allocatable :: parts(:)
      integer :: low(3), high(3), part
      logical :: found
      associate (specs => model%level_specs)
         part = findloc(specs%of == l - 1 .and. specs%criterion /= criterion_none, .true., dim=1)
         if (part > 0) then
            if (specs(part)%criterion == criterion_error) return
            if (mod(model%step, int(judged_every, i8)) /= 0) return
            allocate (parts(1))
            call judge_region(model%communicator, model%levels, l, model%materials, specs(part)%criterion, &
                              specs(part)%max_cells, found, parts(1))
            if (found) region = parts(1)
            return
         end if
         if (.not. any(specs%of == l - 1 .and. specs%follow > 0)) return
         allocate (parts(0))
         do part = 1, size(specs)
            if (specs(part)%of /= l - 1) cycle
            parts = [parts, part_now(model, part, ways)]
            call parts(size(parts))%node_box(low, high)
            if (specs(part)%follow == 0 .or. all(high - low >= 2*smallest_width .or. [.false., &
                model%levels(l)%grid%section%is_flat(), .false.])) cycle
            call fail(error, exit_numerical, 'time '//to_text(model%time)//' s: level '//to_text(l)// &
                      ' has moved with its tool or body until its box has less than '// &
                      to_text(smallest_width)// &
                      ' cells of the next coarser level in a direction; try a larger box or grid')
            return
         end do
      end associate
      region = unite(model%levels(l)%grid, parts)
      if (l == 2 .or. region%same_as(model%levels(l)%region)) return
      if (all(first_too_near(model%levels(l - 1)%region, region) < 0)) return
      call fail(error, exit_numerical, 'time '//to_text(model%time)//' s: level '//to_text(l)// &
                ' has moved with its tool or body to less than '//to_text(smallest_gap)// &
                ' cells from the edge of level '//to_text(l - 1)//'; try a larger level there')
   end subroutine place_region

   !> A part of a level at its present position: shifted by whole cells of the coarsest level.
   type(region_t) function part_now(model, part, ways) result(region)
      type(model_t), intent(in) :: model
      integer, intent(in) :: part
      real(wp), intent(in) :: ways(:, :)
      real(wp) :: way(3)
      region = model%first_parts(part)
      associate (spec => model%level_specs(part))
         if (spec%follow == 0) return
         if (spec%follow <= size(model%contact%tools)) then
            way = model%contact%tools(spec%follow)%displacement()
         else
            way = ways(:, spec%follow - size(model%contact%tools))
         end if
         region = region%shifted(2**spec%of*nint(way*model%levels(1)%grid%per_cell))
      end associate
   end function part_now

end module m_move_regions
