!> Splitting of a block's particles whose domains have become too long; parts are kept out of tools and within
!> the grid (theory.md, Splitting).
module m_splitting
   use m_kinds, only: wp
   use m_constants, only: exit_numerical
   use m_errors, only: error_t, fail
   use m_text, only: to_text
   use m_field_table, only: layout_t, shares_t
   use m_particle_store, only: particle_store_t
   use m_tool, only: tool_t
   use m_model, only: model_t
   use m_complaints, only: particle_text
   use m_split, only: split_long
   use m_walls, only: keep_inside
   implicit none
   private
   public :: split

   real(wp), parameter :: clear = 0.05_wp !< cells: a part nearer to a tool, which has not moved in this step
                                          !< yet, may get inside it

contains

   subroutine split(model, l, b, error)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b
      type(error_t), intent(inout) :: error
      type(shares_t) :: shares
      integer, allocatable :: parent(:) !< parent of each new particle, which follow the old ones
      integer :: before, first, last, n, splits, worn_out
      associate (level => model%levels(l), particles => model%levels(l)%blocks(b)%particles)
         before = particles%count
         call split_long(level%blocks(b), level%table, level%layout, level%grid%cell, model%stuff, splits, &
                         worn_out, parent)
         if (worn_out > 0) call fail(error, exit_numerical, particle_text(model, l, b, worn_out)// &
                                     ' has been split '//to_text(level%layout%max_generations())// &
            ' times and its domain is still too long: the motion is unstable; try a smaller safety', &
            recoverable=.true.)
         if (splits == 0) return
         shares = level%table%shares()
         first = 1
         do while (first <= size(parent))
            last = first
            do while (last < size(parent))
               if (parent(last + 1) /= parent(first)) exit
               last = last + 1
            end do
            associate (parts => [parent(first), (before + n, n=first, last)])
               if (model%contact%active() .and. l == size(model%levels)) &
                  call keep_outside(model%contact%tools, particles, level%layout, parts, &
                                    clear*level%grid%cell)
               do n = 1, size(parts)
                  call keep_inside(particles%column(parts(n), :), level%layout, shares, level%grid)
               end do
            end associate
            first = last + 1
         end do
      end associate
      model%splits = model%splits + splits
      call model%levels(l)%size_work()
   end subroutine split

   !> If a part of one particle would reach into a tool, move all parts along the normal to the gap of the
   !> whole, which conserves centre of mass and momentum.
   pure subroutine keep_outside(tools, particles, layout, parts, clear)
      type(tool_t), intent(in) :: tools(:)
      type(particle_store_t), intent(inout) :: particles
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: parts(:) !< numbers of the particles
      real(wp), intent(in) :: clear   !< margin, m
      real(wp) :: middle(3), gap, normal(3), unused(3), way(3), l(3, 3)
      integer :: n, t
      logical :: reaches
      associate (column => particles%column, x => layout%position, v => layout%velocity)
         do t = 1, size(tools)
            middle = sum(column(parts, x:x + 2), dim=1)/size(parts)
            reaches = .false.
            do n = 1, size(parts)
               call tools(t)%gap_within(column(parts(n), x:x + 2), clear, gap, unused)
               reaches = reaches .or. gap < clear
            end do
            if (.not. reaches) cycle
            call tools(t)%gap_and_normal(middle, gap, normal)
            do n = 1, size(parts)
               way = -dot_product(column(parts(n), x:x + 2) - middle, normal)*normal
               column(parts(n), x:x + 2) = column(parts(n), x:x + 2) + way
               if (layout%gradient == 0) cycle
               l = reshape(column(parts(n), layout%gradient:layout%gradient + 8), [3, 3])
               column(parts(n), v:v + 2) = column(parts(n), v:v + 2) + matmul(l, way)
            end do
         end do
      end associate
   end subroutine keep_outside

end module m_splitting
