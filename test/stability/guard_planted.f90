!test: helper
!> gimp3d with a fault planted between two steps, for guard.sh. PLANT in the environment: what, after which
!> step, how many times (a run that goes back passes the step again), on which level, by how much. What: none;
!> stress: that of one particle is not a number; contact_pressure: that of all is not; throw: one particle at
!> `much` times the speed of sound; swell: the volume of one particle times `much`; crush: the particles of
!> one cell; heat: all velocities times `much`; safety: `much`, from the start on.
program guard_planted
   use, intrinsic :: iso_fortran_env, only: error_unit
   use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan, ieee_set_underflow_mode
   use m_kinds, only: wp, i8
   use m_leaving, only: leave
   use m_simulation, only: simulation_t
   implicit none
   type(simulation_t) :: simulation
   character(len=100) :: plant
   character(len=20) :: what
   integer :: level, status, step, times
   real(wp) :: much
   call get_environment_variable('PLANT', plant)
   read (plant, *) what, step, times, level, much
   call ieee_set_underflow_mode(gradual=.false.)
   call simulation%initialise()
   if (what == 'safety') simulation%scene%time%safety = much
   do while (.not. simulation%done())
      if (simulation%model%step == step .and. times > 0) then
         times = times - 1
         call do_plant()
      end if
      call simulation%step()
   end do
   status = simulation%finalise()
   if (simulation%error%happened() .and. simulation%communicator%is_root()) &
      write (error_unit, '(a)') 'gimp3d: '//simulation%error%message
   call simulation%communicator%finish()
   call leave(status)

contains

   subroutine do_plant()
      integer(i8) :: first
      integer :: b, l, p
      first = first_id()
      do l = 1, size(simulation%model%levels)
         do b = 1, size(simulation%model%levels(l)%blocks)
            associate (block => simulation%model%levels(l)%blocks(b))
               if (what == 'heat' .or. what == 'contact_pressure') then
                  call change(l, b, 1, block%particles%count)
                  cycle
               end if
               if (l /= level) cycle
               p = findloc(block%particles%id(:block%particles%count), first, dim=1)
               if (p > 0) call change(l, b, p, p)
            end associate
         end do
      end do
   end subroutine do_plant

   !> Smallest id of the particles on the level.
   integer(i8) function first_id()
      integer :: b
      first_id = huge(first_id)
      do b = 1, size(simulation%model%levels(level)%blocks)
         associate (particles => simulation%model%levels(level)%blocks(b)%particles)
            first_id = min(first_id, minval(particles%id(:particles%count)))
         end associate
      end do
      first_id = -nint(simulation%communicator%maximum(-real(first_id, wp)), i8)
   end function first_id

   subroutine change(l, b, first, last)
      integer, intent(in) :: l, b, first, last
      real(wp) :: nan
      integer :: pressure
      nan = ieee_value(nan, ieee_quiet_nan)
      associate (column => simulation%model%levels(l)%blocks(b)%particles%column, &
                 at => simulation%model%levels(l)%layout)
         select case (what)
         case ('stress'); column(first:last, at%stress) = nan
         case ('contact_pressure') ! of all particles: who is at the tool counts
            pressure = simulation%model%levels(l)%table%column('contact_pressure')
            column(first:last, pressure) = nan
         case ('throw'); column(first:last, at%velocity) = much*simulation%model%bounds%wave_speed
         case ('swell'); column(first:last, at%volume) = much*column(first:last, at%volume)
         case ('crush') ! towards the middle of the particles' cell, `much` times as fast as would bring them
                        ! there in a step
            call crush(column(:simulation%model%levels(l)%blocks(b)%particles%count, :), &
                       column(first, at%position:at%position + 2))
         case ('heat')
            column(first:last, at%velocity:at%velocity + 2) = &
               much*column(first:last, at%velocity:at%velocity + 2)
         end select
      end associate
      call simulation%model%levels(l)%blocks(b)%particles%changed()
   end subroutine change

   !> The particles in the cell of a place move to its middle.
   subroutine crush(column, place)
      real(wp), intent(inout) :: column(:, :)
      real(wp), intent(in) :: place(3)
      real(wp) :: middle(3), time_step
      integer :: p
      associate (grid => simulation%model%levels(level)%grid, at => simulation%model%levels(level)%layout)
         middle = grid%lower + (floor((place - grid%lower)/grid%cell) + 0.5_wp)*grid%cell
         time_step = 0.35_wp*grid%cell/simulation%model%bounds%wave_speed
         do p = 1, size(column, 1)
            associate (x => column(p, at%position:at%position + 2))
               if (any(abs(x - middle) > 0.5_wp*grid%cell)) cycle
               column(p, at%velocity:at%velocity + 2) = much*(middle - x)/time_step
            end associate
         end do
      end associate
   end subroutine crush

end program guard_planted
