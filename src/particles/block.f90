!> A block: 8 x 8 x 8 bins, their particles and lists. Its node tiles lie in the level's pools, at its slot.
module m_block
   use m_kinds, only: wp, i4, i8
   use m_particle_store, only: particle_store_t
   use m_cell_list, only: cell_list_t
   implicit none
   private
   public :: block_t

   integer, private :: n
   !> Directions -1, 0, 1 along each axis of the 27 blocks around a block; the 14th is that of the block itself.
   integer, parameter, public :: directions(3, 27) = reshape([(mod(n - 1, 3) - 1, mod((n - 1)/3, 3) - 1, (n - 1)/9 - 1, n=1, 27)], &
                                                             [3, 27])

   integer, parameter, public :: sum_count = 12 !< quantities that histories sum over all particles (stepping/energy.f90)

   type :: block_t
      integer :: place(3) = 0            !< which block of the level, from 0
      integer :: index = 0               !< its number in the level (grid_level%block_index)
      real(wp) :: origin(3) = 0.0_wp     !< place of its first node, m
      type(particle_store_t) :: particles
      integer :: arrived = 0             !< the last so many came when the others had given to their nodes, and are not in `cells`
      type(cell_list_t) :: cells
      real(wp) :: disorder = 0.0_wp      !< run_breaks of its particles' order, summed over the steps since they were sorted
      real(wp) :: run_breaks = 0.0_wp         !< the same, on average over the last steps: they cost time
      integer :: neighbour(27) = 0       !< slots of the blocks around, x fastest, 14 is this one; 0 where there is none
      logical :: shared = .false.        !< a neighbour lives on another rank
      logical :: owns_shared_sum(27) = .false. !< it makes the sums of the nodes that it shares with those between it and a
                                               !< direction alone
      integer(i4), allocatable :: emigrants(:) !< particles that left during this step, rising
      integer :: emigrant_count = 0
      logical :: pressed = .true.        !< some particle may carry a contact pressure, of the last step or the one before
      logical :: at_rest = .false.       !< no particle moves, none is under stress
      logical :: p2g_is_valid = .false.    !< its tile is what its particles give as they are now, but for what has arrived
      real(wp), allocatable :: resting_mass(:, :, :) !< (0:9, 0:9, 0:9), while it is at rest, and nobody else gives to its tile:
                                                     !< what its particles give, kg; all else is 0
      logical :: sums_are_valid = .false.     !< `sums` is of its particles as they are now
      real(wp) :: sums(sum_count) = 0.0_wp !< of its particles, as energy.f90 numbers them
      real(wp) :: wave_speed = 0.0_wp    !< largest of its particles, m/s
      real(wp) :: lowest(3) = huge(1.0_wp), highest(3) = -huge(1.0_wp) !< bounds of its particles' centres, m
   contains
      procedure :: reserve
      procedure :: update_extents
      procedure :: wants_sorting
      procedure :: sort
      procedure :: invalidate
      procedure :: take_averages
      procedure :: include_place
      procedure :: bytes
   end type block_t

   real(wp), parameter :: sort_share = 0.45_wp !< sort when so many run_breaks a particle have been paid for: as much as sorting
                                               !< costs
   real(wp), parameter :: averaged = 64.0_wp   !< steps

contains

   !> Make room for a number of particles.
   subroutine reserve(self, capacity, columns)
      class(block_t), intent(inout) :: self
      integer, intent(in) :: capacity, columns
      call self%particles%reserve(capacity, columns)
      call self%cells%reserve(size(self%particles%id))
      if (.not. allocated(self%emigrants)) allocate (self%emigrants(0))
   end subroutine reserve

   !> Once particles have changed bin: what is known of where they are and how far they are out of order, what has arrived left out.
   pure subroutine update_extents(self)
      class(block_t), intent(inout) :: self
      if (.not. self%cells%current) call self%cells%update_statistics(self%particles%count - self%arrived)
   end subroutine update_extents

   !> True when the run_breaks, which are up to date, and those of the steps before have cost as much as sorting does. A block that
   !> comes to rest is sorted then, for while it rests nothing looks at its order: sorting must not depend on how long that was.
   pure logical function wants_sorting(self)
      class(block_t), intent(in) :: self
      wants_sorting = self%disorder + self%cells%run_breaks > sort_share*(self%particles%count - self%arrived)
      if (self%at_rest) wants_sorting = wants_sorting .or. self%cells%run_breaks > 0
   end function wants_sorting

   !> Bring the particles, but for what has arrived, into the order of their bins.
   subroutine sort(self, order, work)
      class(block_t), intent(inout) :: self
      integer(i4), intent(inout), contiguous :: order(:) !< work, as long as there are particles
      real(wp), intent(inout), contiguous :: work(:, :)  !< as in permute
      associate (sorted => order(:self%particles%count - self%arrived))
         call self%cells%sort(sorted)
         call self%particles%permute(sorted, work)
      end associate
      self%disorder = 0.0_wp
   end subroutine sort

   !> Its particles are others from here on, or have moved: nothing holds that has been made of them.
   pure subroutine invalidate(self)
      class(block_t), intent(inout) :: self
      if (allocated(self%resting_mass)) deallocate (self%resting_mass)
      self%at_rest = .false.
      self%p2g_is_valid = .false.
      self%sums_are_valid = .false.
   end subroutine invalidate

   !> Once a step, with its order as it is used: what its run_breaks cost, on average and since the particles were sorted.
   pure subroutine take_averages(self)
      class(block_t), intent(inout) :: self
      self%disorder = self%disorder + self%cells%run_breaks
      self%run_breaks = self%run_breaks + (self%cells%run_breaks - self%run_breaks)/averaged
   end subroutine take_averages

   !> Widen the bounds to a place.
   pure subroutine include_place(self, place)
      class(block_t), intent(inout) :: self
      real(wp), intent(in) :: place(3) !< m
      self%lowest = min(self%lowest, place)
      self%highest = max(self%highest, place)
   end subroutine include_place

   !> Memory held by particles and lists (bytes).
   pure integer(i8) function bytes(self)
      class(block_t), intent(in) :: self
      bytes = self%particles%bytes() + self%cells%bytes()
      if (allocated(self%resting_mass)) bytes = bytes + 8_i8*size(self%resting_mass, kind=i8)
      if (allocated(self%emigrants)) bytes = bytes + 4_i8*size(self%emigrants, kind=i8)
   end function bytes

end module m_block
