!> Prediction of bodies in free flight: the blocks that they enter and the particles that they split into
!> (doc/developer/theory.md, Forecast). Each body is assumed to keep its shape and the velocity given in the
!> scene.
module m_flight
   use mpi_f08
   use m_kinds, only: wp
   use m_scene, only: scene_t
   use m_membership, only: may_live_on, clip_to_home
   use m_decomposition, only: all_owners
   use m_model, only: model_t, add_parents
   implicit none
   private
   public :: follow_flight, flight_t

   !> Sums over all ranks: present numbers, and the maximum until the scene ends; and the ratio of the average
   !> work of a step of the coarsest level until then to the present one.
   type :: flight_t
      real(wp) :: blocks = 1.0_wp, max_blocks = 1.0_wp
      real(wp) :: particles = 1.0_wp, max_particles = 1.0_wp
      real(wp) :: block_load = 1.0_wp    !< of work proportional to blocks
      real(wp) :: particle_load = 1.0_wp !< of work proportional to particles
      real(wp) :: particle_steps = 0.0_wp !< in a step of the coarsest level, on average
   contains
      procedure :: changes
   end type flight_t

   !> The part of one body in a block.
   type :: flyer_t
      real(wp) :: low(3) = huge(1.0_wp), high(3) = -huge(1.0_wp) !< bounds of the particles' centres, m
      real(wp) :: velocity(3) = 0.0_wp !< m/s
      real(wp) :: particles = 0.0_wp
      integer :: level = 1 !< level of the particles now
      integer :: field = 1 !< their velocity field
   end type flyer_t

   real(wp), parameter :: stride = 2.0_wp !< travel of the fastest body between two samples, in cells of the
                                          !< finest level: a quarter of a block
   integer, parameter :: max_moments = 1000
   integer, parameter :: max_counts = 20   !< samples for which visited blocks are counted together, over all
                                           !< ranks

contains

   !> True when either number will grow.
   pure logical function changes(self)
      class(flight_t), intent(in) :: self
      changes = self%max_blocks > self%blocks .or. self%max_particles > self%particles
   end function changes

   !> Collective: follow all bodies from their present positions to the end of the scene.
   type(flight_t) function follow_flight(scene, model) result(flight)
      type(scene_t), intent(in) :: scene
      type(model_t), intent(in) :: model
      type(flyer_t), allocatable :: flyers(:)
      real(wp), allocatable :: held(:), steps(:), block_steps(:)
      logical, allocatable :: entered(:), here(:)
      integer, allocatable :: there(:)
      real(wp) :: ahead, fastest, particles, visited(0:max_counts)
      integer :: b, counts, f, home, l, level_steps(size(model%levels)), moment, moments, n
      level_steps = model%steps_of_levels()
      there = all_owners(model%levels)
      flight%blocks = count(there >= 0)
      flight%max_blocks = flight%blocks
      flight%particles = real(model%communicator%sum_count(model%particle_count()), wp)
      flight%max_particles = flight%particles
      flight%particle_steps = model%communicator%sum_real(sum([( &
         real(level_steps(l), wp)*model%levels(l)%particle_count(), l=1, size(level_steps))]))
      fastest = maxval([(norm2(scene%bodies(b)%velocity), b=1, size(scene%bodies))])
      ahead = scene%end_time - model%time
      moments = ceiling(min(fastest*ahead/(stride*model%levels(size(model%levels))%grid%cell), &
                            real(max_moments, wp)))
      if (moments <= 0) return
      flyers = all_flyers(scene, model)
      allocate (held(0:moments), steps(0:moments), source=0.0_wp)
      allocate (entered(size(there)), here(size(there)), source=.false.)
      block_steps = [(spread(real(level_steps(l), wp), 1, model%levels(l)%grid%block_count()), l=1, &
                      size(model%levels))]
      counts = min(moments, max_counts)
      n = 0
      do moment = 0, moments
         here = .false.
         do f = 1, size(flyers)
            call mark_blocks(model, flyers(f), (moment*ahead/moments)*flyers(f)%velocity, here, particles, &
                             home)
            held(moment) = held(moment) + particles
            steps(moment) = steps(moment) + particles*level_steps(home)
         end do
         where (here) entered = .true.
         if (moment*counts < n*moments) cycle
         call MPI_Allreduce(MPI_IN_PLACE, here, size(here), MPI_LOGICAL, MPI_LOR, model%communicator%comm)
         visited(n) = sum(block_steps, mask=here)
         n = n + 1
      end do
      call MPI_Allreduce(MPI_IN_PLACE, entered, size(entered), MPI_LOGICAL, MPI_LOR, model%communicator%comm)
      call MPI_Allreduce(MPI_IN_PLACE, held, size(held), MPI_DOUBLE_PRECISION, MPI_SUM, &
                         model%communicator%comm)
      call MPI_Allreduce(MPI_IN_PLACE, steps, size(steps), MPI_DOUBLE_PRECISION, MPI_SUM, &
                         model%communicator%comm)
      there = merge(0, -1, there >= 0 .or. entered)
      call add_parents(model%levels, there)
      flight%max_blocks = count(there >= 0)
      flight%max_particles = max(flight%particles, maxval(held))
      ! bodies in contact do not share their blocks
      flight%block_load = max(1.0_wp, sum(visited(:n - 1))/(n*max(1.0_wp, visited(0))))
      flight%particle_load = sum(steps)/(size(steps)*max(1.0_wp, steps(0)))
      flight%particle_steps = flight%particle_load*flight%particle_steps
   end function follow_flight

   !> The parts of bodies in this rank's blocks.
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
                  associate (part => parts(blocks(b)%particles%body(p)), &
                             position => blocks(b)%particles%column(p, x:x + 2))
                     part%low = min(part%low, position)
                     part%high = max(part%high, position)
                     part%particles = part%particles + 1.0_wp
                  end associate
               end do
               do p = 1, size(parts)
                  parts(p)%velocity = scene%bodies(p)%velocity
               end do
               parts%level = l
               parts%field = model%levels(l)%field_of_body
               flyers = [flyers, pack(parts, parts%particles > 0.0_wp)]
            end do
         end associate
      end do
   end function all_flyers

   !> Mark the blocks that a part of a body occupies after a displacement; also the level where it lives then,
   !> and its number of particles there: eight times as many per level.
   subroutine mark_blocks(model, flyer, way, entered, particles, home)
      type(model_t), intent(in) :: model
      type(flyer_t), intent(in) :: flyer
      real(wp), intent(in) :: way(3) !< m
      logical, intent(inout) :: entered(:)
      real(wp), intent(out) :: particles
      integer, intent(out) :: home
      real(wp) :: low(3), high(3), low_there(3), high_there(3)
      integer :: l
      associate (grid => model%levels(1)%grid) ! at its sides a body is stopped, or the run ends
         low = min(max(flyer%low + way, grid%lower), grid%upper - (flyer%high - flyer%low))
      end associate
      high = low + (flyer%high - flyer%low)
      home = 1
      do l = 1, size(model%levels)
         if (.not. may_live_on(model%levels(l), low, high)) exit
         if (model%levels(l)%region%holds(0.5_wp*(low + high))) home = l
         if (l < size(model%levels)) then
            if (model%levels(l + 1)%region%holds_box(low, high, 2.0_wp*model%levels(l + 1)%grid%cell)) cycle
         end if
         low_there = low
         high_there = high
         call clip_to_home(model%levels(l), 0.0_wp, low_there, high_there)
         call model%mark_around(l, flyer%field, low_there, high_there, entered)
      end do
      particles = flyer%particles*8.0_wp**(home - flyer%level)
   end subroutine mark_blocks

end module m_flight
