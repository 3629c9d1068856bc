!> What is wrong with a particle, in a sentence.
module m_complaints
   use m_kinds, only: wp
   use m_constants, only: exit_numerical
   use m_errors, only: error_t, fail
   use m_text, only: to_text
   use m_model, only: model_t
   implicit none
   private
   public :: particle_text, check_leavers, report_outside, report_inversion

contains

   !> Leavers must be finite, and not further than the next block.
   subroutine check_leavers(model, l, b, error)
      type(model_t), intent(in) :: model
      integer, intent(in) :: l, b
      type(error_t), intent(inout) :: error
      real(wp) :: position(3)
      integer :: m, p
      associate (level => model%levels(l), block => model%levels(l)%blocks(b), x => model%levels(l)%layout%position)
         do m = 1, block%leaver_count
            p = block%leavers(m)
            position = block%particles%column(p, x:x + 2)
            if (all(abs(position - block%origin) <= 16.0_wp*level%grid%cell)) then
               if (all(abs((position - block%origin)*level%grid%per_cell - 3.5_wp) <= 11.5_wp)) cycle
            end if
            call fail(error, exit_numerical, particle_text(model, l, b, p)//' moved more than a cell in one step or is not a '// &
                      'number: the motion is unstable; try a smaller safety')
         end do
      end associate
   end subroutine check_leavers

   !> Name the particle that left the grid.
   subroutine report_outside(model, l, b, error)
      type(model_t), intent(in) :: model
      integer, intent(in) :: l, b
      type(error_t), intent(inout) :: error
      character(len=2), parameter :: sides(2, 3) = reshape(['x-', 'x+', 'y-', 'y+', 'z-', 'z+'], [2, 3])
      integer :: axis, p
      associate (grid => model%levels(l)%grid, block => model%levels(l)%blocks(b), x => model%levels(l)%layout%position)
         do p = 1, block%particles%count
            do axis = 1, 3
               if (block%particles%column(p, x + axis - 1) < grid%lower(axis)) call complain(sides(1, axis))
               if (block%particles%column(p, x + axis - 1) > grid%upper(axis)) call complain(sides(2, axis))
            end do
         end do
      end associate
   contains
      subroutine complain(side)
         character(len=*), intent(in) :: side
         call fail(error, exit_numerical, particle_text(model, l, b, p)//' left the grid through its side '//side// &
                   '; try a larger grid, or a boundary there that holds it')
      end subroutine complain
   end subroutine report_outside

   !> Name a particle that was turned inside out.
   subroutine report_inversion(model, l, b, error)
      type(model_t), intent(in) :: model
      integer, intent(in) :: l, b
      type(error_t), intent(inout) :: error
      integer :: p
      associate (block => model%levels(l)%blocks(b))
         do p = 1, block%particles%count
            if (block%particles%column(p, model%levels(l)%layout%volume) > 0.0_wp) cycle
            call fail(error, exit_numerical, particle_text(model, l, b, p)//' was turned inside out (volume '// &
                      to_text(block%particles%column(p, model%levels(l)%layout%volume))// &
                      ' m3, must be above 0); try a smaller safety')
            return
         end do
      end associate
      call fail(error, exit_numerical, 'a velocity gradient is not a number at time '//to_text(model%time)//' s')
   end subroutine report_inversion

   !> Who, where and when, for a sentence.
   function particle_text(model, l, b, p) result(text)
      type(model_t), intent(in) :: model
      integer, intent(in) :: l, b, p
      character(len=:), allocatable :: text
      associate (particles => model%levels(l)%blocks(b)%particles, x => model%levels(l)%layout%position)
         text = 'step '//to_text(model%step + 1)//', time '//to_text(model%time)//' s: particle '//to_text(particles%id(p))// &
                ' of body '//to_text(int(particles%body(p)))//' at ('//to_text(particles%column(p, x))//', '// &
                to_text(particles%column(p, x + 1))//', '//to_text(particles%column(p, x + 2))//') m'
      end associate
   end function particle_text

end module m_complaints
