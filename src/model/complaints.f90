!> Error messages about a particle: which, where, on which level, what was found, what is allowed, what to
!> try.
module m_complaints
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use mpi_f08
   use m_kinds, only: wp, i8
   use m_constants, only: block_size, exit_numerical
   use m_errors, only: error_t, fail
   use m_text, only: to_text
   use m_deform, only: all_finite
   use m_field_table, only: field_t
   use m_side_kinds, only: side_kinds
   use m_g2p_boxes, only: fastest_t
   use m_model, only: model_t
   implicit none
   private
   public :: particle_text, check_emigrants, report_homeless, report_outside, report_inversion, &
             report_too_fast, report_undefined, check_fields, fastest_text

   character(len=*), parameter :: unstable = ': the motion is unstable; try a smaller safety'

   real(wp), parameter, public :: max_cells_a_step = 0.5_wp !< of a particle in a step of its level along an
                                                             !< axis, in cells of the level

contains

   !> Check that emigrants have a finite position, within the next block.
   subroutine check_emigrants(model, l, b, error)
      type(model_t), intent(in) :: model
      integer, intent(in) :: l, b
      type(error_t), intent(inout) :: error
      real(wp) :: position(3), place(3) !< m; cells from the block's first node
      integer :: m, p
      associate (level => model%levels(l), block => model%levels(l)%blocks(b), &
                 x => model%levels(l)%layout%position)
         do m = 1, block%emigrant_count
            p = block%emigrants(m)
            position = block%particles%column(p, x:x + 2)
            ! avoid overflow below
            if (all(abs(position - block%origin) <= 2*block_size*level%grid%cell)) then
               place = (position - block%origin)*level%grid%per_cell
               if (all(abs(place - 0.5_wp*(block_size - 1)) <= 1.5_wp*block_size - 0.5_wp)) cycle
            end if
            if (.not. all(ieee_is_finite(position))) then
               call fail(error, exit_numerical, particle_text(model, l, b, p)// &
                         ' has a position that is not a number'//unstable, recoverable=.true.)
            else
               call fail(error, exit_numerical, particle_text(model, l, b, p)// &
                         ' moved beyond the neighbouring block, at most '//to_text(max_cells_a_step)// &
                         ' cells a step are allowed'//unstable, recoverable=.true.)
            end if
         end do
      end associate
   end subroutine check_emigrants

   !> With several levels blocks are created before a particle can reach them: one that enters a missing block
   !> has moved too far.
   subroutine report_homeless(model, l, error)
      type(model_t), intent(in) :: model
      integer, intent(in) :: l
      type(error_t), intent(inout) :: error
      integer(i8) :: id
      integer :: body, r
      real(wp) :: place(3)
      do r = 1, model%migration(l)%unassigned%count
         call model%migration(l)%identify(model%levels(l), r, id, body, place)
         call fail(error, exit_numerical, when(model)//'particle '//to_text(id)//' of body '// &
                   to_text(body)//' at '// &
                   place_text(place)//' m on level '//to_text(l)// &
                      ' moved farther than a step of the coarsest level allows'// &
                   unstable, recoverable=.true.)
      end do
   end subroutine report_homeless

   !> Name the particle that left the grid. Beyond a closed side there are only particles that have been moved
   !> by more than the grid's width: from near the side they are mirrored back.
   subroutine report_outside(model, l, b, error)
      type(model_t), intent(in) :: model
      integer, intent(in) :: l, b
      type(error_t), intent(inout) :: error
      character(len=2), parameter :: sides(2, 3) = reshape(['x-', 'x+', 'y-', 'y+', 'z-', 'z+'], [2, 3])
      real(wp) :: place
      integer :: axis, p
      associate (grid => model%levels(l)%grid, block => model%levels(l)%blocks(b), &
                 x => model%levels(l)%layout%position)
         do p = 1, block%particles%count
            do axis = 1, 3
               place = block%particles%column(p, x + axis - 1)
               if (place < grid%lower(axis)) call complain(1, (grid%lower(axis) - place)*grid%per_cell)
               if (place > grid%upper(axis)) call complain(2, (place - grid%upper(axis))*grid%per_cell)
            end do
         end do
      end associate
   contains
      subroutine complain(side, beyond)
         integer, intent(in) :: side
         real(wp), intent(in) :: beyond !< cells
         associate (kind => side_kinds(model%levels(l)%grid%boundary(side, axis)))
            if (kind%closed) then
               call fail(error, exit_numerical, particle_text(model, l, b, p)//' is '//to_text(beyond, 3)// &
                         ' cells beyond the '//trim(kind%name)//' side '//sides(side, axis)// &
                         ', which material cannot pass: the motion is unstable or the particle''s '// &
                         'domain is distorted; try a smaller safety, smaller cells, or rounded edges of '// &
                         'tools', recoverable=.true.)
            else
               call fail(error, exit_numerical, particle_text(model, l, b, p)// &
                         ' left the grid through its side '//sides(side, axis)// &
                         '; try a larger grid, or another boundary there')
            end if
         end associate
      end subroutine complain
   end subroutine report_outside

   !> Name a particle that has inverted.
   subroutine report_inversion(model, l, b, error)
      type(model_t), intent(in) :: model
      integer, intent(in) :: l, b
      type(error_t), intent(inout) :: error
      integer :: p
      associate (block => model%levels(l)%blocks(b))
         do p = 1, block%particles%count
            if (block%particles%column(p, model%levels(l)%layout%volume) > 0.0_wp) cycle
            call fail(error, exit_numerical, particle_text(model, l, b, p)// &
                      ' has inverted: det F <= 0 (volume '// &
                      to_text(block%particles%column(p, model%levels(l)%layout%volume))// &
                      ' m3, must be above 0); try a smaller safety', recoverable=.true.)
            return
         end do
      end associate
      call fail(error, exit_numerical, 'step '//to_text(model%step + 1)//', time '//to_text(model%time)// &
                ' s: a velocity gradient on level '//to_text(l)//' is not a number'//unstable, &
                recoverable=.true.)
   end subroutine report_inversion

   !> Report a particle that the grid moved too far in a step.
   subroutine report_too_fast(model, l, b, fastest, time_step, error)
      type(model_t), intent(in) :: model
      integer, intent(in) :: l, b
      type(fastest_t), intent(in) :: fastest
      real(wp), intent(in) :: time_step !< of the level, s
      type(error_t), intent(inout) :: error
      call fail(error, exit_numerical, particle_text(model, l, b, fastest%particle)//' moved '// &
                to_text(fastest%speed*time_step*model%levels(l)%grid%per_cell, 3)//' cells in a step, at '// &
                to_text(fastest%speed, 3)//' m/s; at most '//to_text(max_cells_a_step)// &
                ' cells are allowed'//unstable, recoverable=.true.)
   end subroutine report_too_fast

   !> Report a particle with a stress that is infinite or NaN.
   subroutine report_undefined(model, l, b, error)
      type(model_t), intent(in) :: model
      integer, intent(in) :: l, b
      type(error_t), intent(inout) :: error
      integer :: f
      associate (table => model%levels(l)%table)
         do f = 1, size(table%fields)
            if (table%fields(f)%first == model%levels(l)%layout%stress) &
               call name_undefined(model, l, b, table%fields(f), error)
         end do
      end associate
   end subroutine report_undefined

   !> A law that set the stress of a particle to NaN gives the reason (material_t%fault_text).
   subroutine report_by_law(model, l, b, p, error)
      type(model_t), intent(in) :: model
      integer, intent(in) :: l, b, p
      type(error_t), intent(inout) :: error
      associate (at => model%levels(l)%layout, particles => model%levels(l)%blocks(b)%particles)
         associate (law => model%materials%slots(model%materials%of_body(particles%body(p)))%law)
            if (law%fault_text() == '') return
            ! only if the velocities are finite: else the motion is the cause, not the law
            if (.not. all(ieee_is_finite(particles%column(p, at%velocity:at%velocity + 2)))) return
            call fail(error, exit_numerical, particle_text(model, l, b, p)//law%fault_text(), &
                      recoverable=.true.)
         end associate
      end associate
   end subroutine report_by_law

   !> Collective: check that no particle has a field that is infinite or NaN.
   subroutine check_fields(model, error)
      type(model_t), intent(in) :: model
      type(error_t), intent(inout) :: error
      integer :: b, f, l
      do l = 1, size(model%levels)
         associate (level => model%levels(l))
            do b = 1, size(level%blocks)
               associate (particles => level%blocks(b)%particles)
                  if (particles%count == 0) cycle
                  if (all_finite(particles%count, particles%column(:, :level%table%columns))) cycle
                  do f = 1, size(level%table%fields)
                     call name_undefined(model, l, b, level%table%fields(f), error)
                  end do
               end associate
            end do
         end associate
      end do
      call model%communicator%agree(error)
   end subroutine check_fields

   !> Report the first particle of a block with an infinite or NaN value in a field, if any.
   subroutine name_undefined(model, l, b, field, error)
      type(model_t), intent(in) :: model
      integer, intent(in) :: l, b
      type(field_t), intent(in) :: field
      type(error_t), intent(inout) :: error
      integer :: c, p
      associate (particles => model%levels(l)%blocks(b)%particles)
         do c = field%first, field%first + field%components - 1
            do p = 1, particles%count
               if (ieee_is_finite(particles%column(p, c))) cycle
               if (field%first == model%levels(l)%layout%stress) call report_by_law(model, l, b, p, error)
               call fail(error, exit_numerical, particle_text(model, l, b, p)//' has '//field%name//' '// &
                         to_text(particles%column(p, c))//' '//field%unit//', which is not finite'// &
                         unstable, recoverable=.true.)
               return
            end do
         end do
      end associate
   end subroutine name_undefined

   !> Collective: the particle with the largest sum of its own and wave speed, and both, as text for a
   !> message. The same on all ranks.
   function fastest_text(model) result(text)
      type(model_t), intent(in) :: model
      character(len=:), allocatable :: text
      real(wp) :: largest, sound, speed
      integer :: at(3), b, l, owner, p
      largest = -1.0_wp
      at = 0
      do l = 1, size(model%levels)
         do b = 1, size(model%levels(l)%blocks)
            do p = 1, model%levels(l)%blocks(b)%particles%count
               call speeds_of(l, b, p, sound, speed)
               if (.not. sound + speed > largest) cycle
               largest = sound + speed
               at = [l, b, p]
            end do
         end do
      end do
      text = ''
      owner = model%communicator%ranks
      if (largest >= model%communicator%maximum(largest)) owner = model%communicator%rank
      call MPI_Allreduce(MPI_IN_PLACE, owner, 1, MPI_INTEGER, MPI_MIN, model%communicator%comm)
      if (owner == model%communicator%rank .and. at(1) > 0) then
         call speeds_of(at(1), at(2), at(3), sound, speed)
         text = particle_text(model, at(1), at(2), at(3))//' moves at '//to_text(speed, 3)// &
                ' m/s, sound in it at '//to_text(sound, 3)//' m/s'
      end if
      call model%communicator%broadcast_text(text, min(owner, model%communicator%ranks - 1))
   contains
      subroutine speeds_of(l, b, p, sound, speed)
         integer, intent(in) :: l, b, p
         real(wp), intent(out) :: sound, speed
         associate (particles => model%levels(l)%blocks(b)%particles, at => model%levels(l)%layout, &
                    materials => model%materials)
            speed = norm2(particles%column(p, at%velocity:at%velocity + 2))
            sound = sqrt(materials%slots(materials%of_body(particles%body(p)))%law%p_wave_modulus()* &
                         particles%column(p, at%volume)/particles%column(p, at%mass))
         end associate
      end subroutine speeds_of
   end function fastest_text

   !> Identity, position, level and time of a particle, as text for a message.
   function particle_text(model, l, b, p) result(text)
      type(model_t), intent(in) :: model
      integer, intent(in) :: l, b, p
      character(len=:), allocatable :: text
      real(wp) :: place(3), low(3), high(3)
      associate (level => model%levels(l), block => model%levels(l)%blocks(b), &
                 x => model%levels(l)%layout%position)
         text = when(model)//'particle '//to_text(block%particles%id(p))//' of body '// &
                to_text(int(block%particles%body(p)))
         place = block%particles%column(p, x:x + 2)
         low = block%origin - 0.5_wp*level%grid%cell
         high = block%origin + 7.5_wp*level%grid%cell
         if (all(ieee_is_finite(place))) then
            text = text//' at '//place_text(place)
         else
            text = text//' between '//place_text(low)//' and '//place_text(high)
         end if
         text = text//' m on level '//to_text(l)
      end associate
   end function particle_text

   function when(model) result(text)
      type(model_t), intent(in) :: model
      character(len=:), allocatable :: text
      text = 'step '//to_text(model%step + 1)//', time '//to_text(model%time)//' s: '
   end function when

   function place_text(place) result(text)
      real(wp), intent(in) :: place(3) !< m
      character(len=:), allocatable :: text
      text = '('//to_text(place(1))//', '//to_text(place(2))//', '//to_text(place(3))//')'
   end function place_text

end module m_complaints
