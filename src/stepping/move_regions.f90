!> Levels that move: with a tool, with the bodies of a contact group, or to where a criterion wants them; and
!> the particles that change level by that.
module m_move_regions
   use m_kinds, only: wp, i8
   use m_constants, only: exit_numerical
   use m_errors, only: error_t, fail
   use m_text, only: to_text
   use m_scene, only: criterion_none
   use m_region, only: region_t
   use m_model, only: model_t
   use m_residence, only: change_pair
   use m_placing, only: judge_region, smallest_width
   implicit none
   private
   public :: move_regions, settle_particles

   integer, parameter :: judged_every = 50 !< steps of the coarsest level between two looks at a criterion

contains

   !> Collective: at the end of a step of the coarsest level. Regions move by whole cells of the coarsest
   !> level that follow a tool, so that the gaps between nested ones stay.
   subroutine move_regions(model, error)
      type(model_t), intent(inout) :: model
      type(error_t), intent(inout) :: error
      type(region_t) :: region
      real(wp), allocatable :: ways(:, :) ! of the contact groups since the start, m
      integer :: l, low(3), high(3)
      logical :: moved
      moved = .false.
      allocate (ways(3, 0))
      if (model%follows_groups()) ways = model%centres_of_mass() - model%first_centres
      do l = 2, size(model%levels)
         region = region_now(model, l, ways)
         if (region%same_as(model%levels(l)%region)) cycle
         call region%node_box(low, high)
         if (any(high - low < 2*smallest_width)) then
            call fail(error, exit_numerical, 'time '//to_text(model%time)//' s: level '//to_text(l)// &
                      ' has followed its tool or body until its box has less than '//to_text(smallest_width)// &
                      ' cells of the next coarser level in a direction; try a larger box or grid')
            return
         end if
         model%levels(l)%region = region
         moved = .true.
      end do
      if (.not. moved) return
      model%moves = model%moves + 1
      call settle_particles(model, error)
   end subroutine move_regions

   !> Collective: after regions have been set anew, particles go to the levels where they live.
   subroutine settle_particles(model, error)
      type(model_t), intent(inout) :: model
      type(error_t), intent(inout) :: error
      integer :: l
      call model%place_layers()
      call model%prepare_blocks(edges_moved=.true.)
      do l = size(model%levels) - 1, 1, -1 ! out, from the finest
         call change_pair(model, l, error)
         if (error%happened()) return
         call model%prepare_blocks()
      end do
      do l = 1, size(model%levels) - 1     ! in, from the coarsest
         call change_pair(model, l, error)
         if (error%happened()) return
         call model%prepare_blocks()
      end do
      call forget_edge_stress(model)
   end subroutine settle_particles

   !> New edges: nothing is ahead of its time there (theory.md, eq. time-levels).
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

   !> The region that a level should have now.
   type(region_t) function region_now(model, l, ways) result(region)
      type(model_t), intent(in) :: model
      integer, intent(in) :: l
      real(wp), intent(in) :: ways(:, :) !< of the contact groups, m
      type(region_t) :: judged
      real(wp) :: way(3)
      logical :: found
      region = model%levels(l)%region
      associate (spec => model%level_specs(l - 1))
         if (spec%follow > 0) then
            if (spec%follow <= size(model%contact%tools)) then
               way = model%contact%tools(spec%follow)%displacement()
            else
               way = ways(:, spec%follow - size(model%contact%tools))
            end if
            region = model%first_regions(l)%shifted(2**(l - 1)*nint(way*model%levels(1)%grid%per_cell))
         else if (spec%criterion /= criterion_none .and. mod(model%step, int(judged_every, i8)) == 0) then
            call judge_region(model%communicator, model%levels, l, model%materials, spec%criterion, &
                              spec%max_cells, found, judged)
            if (found) region = judged
         end if
      end associate
   end function region_now

end module m_move_regions
