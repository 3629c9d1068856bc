!> Made-up particles for the tests of output: what a particle carries follows from its place in the file, so
!> that a reader can work it out too (made_up.py does).
module m_made_up
   use m_kinds, only: wp, i8
   use m_communicator, only: communicator_t
   use m_snapshot, only: snapshot_t, snapshot_level_t
   use m_grid_level, only: grid_level_t
   use m_region, only: make_region
   implicit none
   private
   public :: made_up_snapshot, add_levels

   integer, parameter :: blocks = 41

contains

   !> Blocks of 0 to 60 particles, dealt to the ranks out of order; `spare` ranks at the end get none. No
   !> blocks: no particles.
   function made_up_snapshot(communicator, step, spare, with_particles) result(snapshot)
      type(communicator_t), intent(in) :: communicator
      integer, intent(in) :: step, spare
      logical, intent(in) :: with_particles
      type(snapshot_t) :: snapshot
      integer :: b, n, p, r, i
      integer :: sizes(blocks)
      logical :: mine(blocks)
      do b = 1, blocks
         sizes(b) = merge(modulo(b*b*7 + step, 61), 0, with_particles)
         mine(b) = modulo(b*5/3, max(1, communicator%ranks - spare)) == communicator%rank
      end do
      snapshot%step = step
      snapshot%time = step*1.25e-12_wp
      snapshot%title = 'made-up <particles> & "quotes"'
      snapshot%n_total = sum(sizes)
      snapshot%n_local = sum(sizes, mask=mine)
      n = snapshot%n_local
      allocate (snapshot%position(n, 3), snapshot%id(n), snapshot%fields(6), &
                snapshot%run_offset(count(mine)), snapshot%run_count(count(mine)))
      call declare(snapshot)
      p = 0
      r = 0
      do b = blocks, 1, -1 ! out of file order
         if (.not. mine(b)) cycle
         r = r + 1
         snapshot%run_offset(r) = sum(sizes(1:b - 1))
         snapshot%run_count(r) = sizes(b)
         do i = 1, sizes(b)
            p = p + 1
            call fill(snapshot, p, snapshot%run_offset(r) + i - 1)
         end do
      end do
      call snapshot%add_von_mises()
   end function made_up_snapshot

   subroutine declare(snapshot)
      type(snapshot_t), intent(inout) :: snapshot
      integer :: f, n
      integer, parameter :: components(6) = [3, 6, 1, 2, 9, 6]
      character(len=16), parameter :: names(6) = [character(len=16) :: 'velocity', 'stress', 'density', &
                                                  'pair', 'domain', 'stress_recovered']
      character(len=8), parameter :: units(6) = [character(len=8) :: 'm/s', 'Pa', 'kg/m3', '', 'm', 'Pa']
      n = snapshot%n_local
      do f = 1, 6
         snapshot%fields(f)%name = trim(names(f))
         snapshot%fields(f)%unit = trim(units(f))
         snapshot%fields(f)%components = components(f)
         allocate (snapshot%fields(f)%values(n, components(f)))
      end do
      snapshot%fields(2)%component_names = ['xx', 'yy', 'zz', 'yz', 'xz', 'xy']
      snapshot%fields(6)%component_names = ['xy', 'xx', 'zz', 'yz', 'xz', 'yy']
   end subroutine declare

   !> What the particle at a place (0-based) of the file carries. The ids need all 64 bits.
   subroutine fill(snapshot, p, place)
      type(snapshot_t), intent(inout) :: snapshot
      integer, intent(in) :: p
      integer(i8), intent(in) :: place
      real(wp) :: k
      integer :: f, c
      k = real(place, wp)
      snapshot%id(p) = 2_i8**54 + 3*place + 1
      snapshot%position(p, :) = [k*1.0e-9_wp, 1.0_wp/(k + 3.0_wp), snapshot%step - k]
      do f = 1, size(snapshot%fields)
         do c = 1, snapshot%fields(f)%components
            snapshot%fields(f)%values(p, c) = (k + 0.1_wp)/(10.0_wp*f + c) - snapshot%step
         end do
      end do
   end subroutine fill

   !> Three levels, whose boxes move: a third of the particles on the coarsest (so that it ends within a run),
   !> none on the second.
   subroutine add_levels(snapshot)
      type(snapshot_t), intent(inout) :: snapshot
      type(grid_level_t) :: grid
      integer :: l
      allocate (snapshot%levels(3))
      do l = 1, 3
         grid%lower = [0.1_wp, 0.2_wp, 0.3_wp]*l + snapshot%step*(l - 1)
         grid%upper = [10.0_wp, 11.0_wp, 12.0_wp] + snapshot%step*(l - 1)
         grid%cell = 2.0_wp**(1 - l)/3.0_wp
         grid%cells = 2
         snapshot%levels(l) = snapshot_level_t(make_region(grid, [0, 0, 0], [2, 2, 2]), grid%cell, 0_i8)
      end do
      snapshot%levels(1)%particles = snapshot%n_total/3
      snapshot%levels(3)%particles = snapshot%n_total - snapshot%n_total/3
   end subroutine add_levels

end module m_made_up
