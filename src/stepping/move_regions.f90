!> Levels that move: with a tool, or to where a criterion wants them; and the particles that change level by that.
module m_move_regions
   use m_kinds, only: wp, i8
   use m_constants, only: exit_numerical
   use m_errors, only: error_t, fail
   use m_text, only: to_text
   use m_scene, only: criterion_none
   use m_region, only: make_region
   use m_model, only: model_t
   use m_residence, only: change_pair
   use m_placing, only: followed_box, judged_box, smallest_width
   implicit none
   private
   public :: move_regions

   integer, parameter :: judged_every = 50 !< steps of the coarsest level between two looks at a criterion

contains

   !> Collective: at the end of a step of the coarsest level. Regions move by whole cells of the coarsest level that follow a tool,
   !> so that the gaps between nested ones stay.
   subroutine move_regions(model, error)
      type(model_t), intent(inout) :: model
      type(error_t), intent(inout) :: error
      integer :: l, low(3), high(3)
      logical :: moved
      moved = .false.
      do l = 2, size(model%levels)
         call new_box(model, l, low, high)
         associate (region => model%levels(l)%region)
            if (all(low == region%low) .and. all(high == region%high)) cycle
            if (any(high - low < 2*smallest_width)) then
               call fail(error, exit_numerical, 'time '//to_text(model%time)//' s: level '//to_text(l)// &
                         ' has followed its tool until its box has less than '//to_text(smallest_width)// &
                         ' cells of the next coarser level in a direction; try a larger box or grid')
               return
            end if
            region = make_region(model%levels(l)%grid, low, high)
            moved = .true.
         end associate
      end do
      if (.not. moved) return
      model%moves = model%moves + 1
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
   end subroutine move_regions

   !> New edges: nothing is ahead of its time there (theory.md, eq. labels).
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

   !> The sides that a level's box should have now, in nodes of its grid.
   subroutine new_box(model, l, low, high)
      type(model_t), intent(in) :: model
      integer, intent(in) :: l
      integer, intent(out) :: low(3), high(3)
      logical :: found
      associate (level => model%levels(l), spec => model%level_specs(l - 1))
         low = level%region%low
         high = level%region%high
         if (spec%follow > 0) then
            associate (tool => model%contact%tools(spec%follow))
               call followed_box(level%grid, model%first_low(:, l), model%first_high(:, l), &
                                 2**(l - 1)*nint(tool%travel*tool%spec%axis*model%levels(1)%grid%per_cell), low, high)
            end associate
         else if (spec%criterion /= criterion_none .and. mod(model%step, int(judged_every, i8)) == 0) then
            call judged_box(model%communicator, model%levels, l, model%materials, spec%criterion, spec%max_cells, found, low, high)
            if (.not. found) low = level%region%low
            if (.not. found) high = level%region%high
         end if
      end associate
   end subroutine new_box

end module m_move_regions
