!> Where bodies in flight will be: the blocks that they enter and the particles that they split into (doc/theory.md, Forecast). Each is
!> taken to keep its shape and the velocity that its scene gives it.
module m_flight
   use mpi_f08
   use m_kinds, only: wp
   use m_scene, only: scene_t
   use m_decomposition, only: all_owners
   use m_model, only: model_t, add_parents
   implicit none
   private
   public :: follow_flight, flight_t

   !> Of all ranks: how many there are now, and at most during the scene.
   type :: flight_t
      real(wp) :: blocks = 1.0_wp, most_blocks = 1.0_wp
      real(wp) :: particles = 1.0_wp, most_particles = 1.0_wp
   contains
      procedure :: changes
   end type flight_t

   !> What a block holds of one body.
   type :: flyer_t
      real(wp) :: low(3) = huge(1.0_wp), high(3) = -huge(1.0_wp) !< bounds of the particles' centres, m
      real(wp) :: velocity(3) = 0.0_wp !< m/s
      real(wp) :: particles = 0.0_wp
      integer :: level = 1 !< where they live now
   end type flyer_t

   real(wp), parameter :: stride = 2.0_wp   !< of the fastest body from one moment to the next, in cells of the finest level: a quarter
                                            !< of a block
   integer, parameter :: most_moments = 1000

contains

   !> True when there will be more of either.
   pure logical function changes(self)
      class(flight_t), intent(in) :: self
      changes = self%most_blocks > self%blocks .or. self%most_particles > self%particles
   end function changes

   !> Collective: follow all bodies to the end of the scene.
   type(flight_t) function follow_flight(scene, model) result(flight)
      type(scene_t), intent(in) :: scene
      type(model_t), intent(in) :: model
      type(flyer_t), allocatable :: flyers(:)
      real(wp), allocatable :: held(:)
      logical, allocatable :: entered(:)
      integer, allocatable :: there(:)
      real(wp) :: fastest, time
      integer :: b, f, moment, moments
      there = all_owners(model%levels)
      flight%blocks = count(there >= 0)
      flight%most_blocks = flight%blocks
      flight%particles = real(model%communicator%sum_count(model%particle_count()), wp)
      flight%most_particles = flight%particles
      fastest = maxval([(norm2(scene%bodies(b)%velocity), b=1, size(scene%bodies))])
      moments = ceiling(min(fastest*scene%end_time/(stride*model%levels(size(model%levels))%grid%cell), real(most_moments, wp)))
      if (moments == 0) return
      flyers = all_flyers(scene, model)
      allocate (held(moments), source=0.0_wp)
      allocate (entered(size(there)), source=.false.)
      do moment = 1, moments
         time = moment*scene%end_time/moments
         do f = 1, size(flyers)
            call look(model, flyers(f), time*flyers(f)%velocity, entered, held(moment))
         end do
      end do
      call MPI_Allreduce(MPI_IN_PLACE, held, size(held), MPI_DOUBLE_PRECISION, MPI_SUM, model%communicator%comm)
      call MPI_Allreduce(MPI_IN_PLACE, entered, size(entered), MPI_LOGICAL, MPI_LOR, model%communicator%comm)
      there = merge(0, -1, there >= 0 .or. entered)
      call add_parents(model%levels, there)
      flight%most_blocks = count(there >= 0)
      flight%most_particles = max(flight%particles, maxval(held))
   end function follow_flight

   !> What this rank's blocks hold, body by body.
   function all_flyers(scene, model) result(flyers)
      type(scene_t), intent(in) :: scene
      type(model_t), intent(in) :: model
      type(flyer_t), allocatable :: flyers(:)
      type(flyer_t) :: parts(size(scene%bodies))
      integer :: b, l, p
      allocate (flyers(0))
      do l = 1, size(model%levels)
         associate (blocks => model%levels(l)%blocks, x => model%levels(l)%layout%position)
            do b = 1, size(blocks)
               parts = flyer_t()
               do p = 1, blocks(b)%particles%count
                  associate (part => parts(blocks(b)%particles%body(p)), position => blocks(b)%particles%column(p, x:x + 2))
                     part%low = min(part%low, position)
                     part%high = max(part%high, position)
                     part%particles = part%particles + 1.0_wp
                  end associate
               end do
               do p = 1, size(parts)
                  parts(p)%velocity = scene%bodies(p)%velocity
               end do
               parts%level = l
               flyers = [flyers, pack(parts, parts%particles > 0.0_wp)]
            end do
         end associate
      end do
   end function all_flyers

   !> Mark the blocks that a part of a body is in when it has gone so far, and count its particles: eight for one, level by level.
   subroutine look(model, flyer, way, entered, held)
      type(model_t), intent(in) :: model
      type(flyer_t), intent(in) :: flyer
      real(wp), intent(in) :: way(3) !< m
      logical, intent(inout) :: entered(:)
      real(wp), intent(inout) :: held
      real(wp) :: low(3), high(3)
      integer :: l, home
      low = flyer%low + way
      high = flyer%high + way
      if (any(high < model%levels(1)%grid%lower .or. low > model%levels(1)%grid%upper)) return
      home = 1
      do l = 1, size(model%levels)
         if (.not. model%levels(l)%region%overlaps(low, high)) exit
         if (model%levels(l)%region%holds(0.5_wp*(low + high))) home = l
         if (l < size(model%levels)) then
            if (model%levels(l + 1)%region%holds_box(low, high, 2.0_wp*model%levels(l + 1)%grid%cell)) cycle
         end if
         call model%mark_around(l, max(low, model%levels(l)%region%lower), min(high, model%levels(l)%region%upper), entered)
      end do
      held = held + flyer%particles*8.0_wp**(home - flyer%level)
   end subroutine look

end module m_flight
