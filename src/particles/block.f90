!> A block: 8 x 8 x 8 bins, their particles and lists. Its node tiles are in the level's pools, at its slot.
module m_block
   use m_kinds, only: wp, i4, i8
   use m_node_values, only: mass_, p_x, tile_last
   use m_particle_store, only: particle_store_t
   use m_cell_list, only: cell_list_t
   implicit none
   private
   public :: block_t

   integer, private :: n
   !> Directions -1, 0, 1 along each axis of the 27 blocks around a block; the 14th is the block itself.
   integer, parameter, public :: directions(3, 27) = &
      reshape([(mod(n - 1, 3) - 1, mod((n - 1)/3, 3) - 1, (n - 1)/9 - 1, n=1, 27)], [3, 27])

   integer, parameter, public :: sum_count = 12 !< quantities that histories sum over all particles
                                                !< (model/energy.f90)

   !> Contents of a block and data derived from them: moved as a whole when blocks are renumbered.
   type :: contents_t
      type(particle_store_t), allocatable :: particles
      type(cell_list_t), allocatable :: cells
      integer(i4), allocatable :: emigrants(:) !< particles that left during this step, in rising order
      integer :: emigrant_count = 0
      integer :: run_breaks = 0          !< run breaks in its particles' order, as last counted
                                         !< (cell_list.f90)
      real(wp) :: disorder = 0.0_wp      !< sum of run_breaks over the steps since the last sort
      real(wp) :: mean_breaks = 0.0_wp   !< mean of run_breaks over the last steps, a measure of their cost
      logical :: pressed = .true. !< some particle may carry a contact pressure, of the last step or the one
                                  !< before
      integer :: deposited = 0           !< number of its first particles whose P2G its tile holds, and their
                                         !< generation
      integer(i8) :: deposit_of = -1
      real(wp) :: sums(sum_count) = 0.0_wp !< sums over its particles, numbered as in energy.f90, and the
                                           !< state of the particles they belong to
      integer(i8) :: sums_of(2) = -1
      logical :: at_rest = .false.       !< no particle moves or is under stress, and the state of the
                                         !< particles this belongs to
      real(wp) :: wave_speed = 0.0_wp    !< largest of its particles, m/s
      integer(i8) :: located(2) = -1     !< the state this belongs to
      real(wp), allocatable :: resting_mass(:, :, :) !< mass of its tile, kg: all that particles at rest
                                                     !< contribute, and the state it belongs to
      integer(i8) :: resting_of(2) = -1
      real(wp), allocatable :: resting_volume(:, :, :) !< volume of the cells of its tile, m3: all that
                                                       !< particles at rest contribute, and the state it
                                                       !< belongs to
      integer(i8) :: volume_of(2) = -1
      logical :: left_out = .false.      !< the current step does not change its particles
      real(wp) :: lowest(3) = huge(1.0_wp), highest(3) = -huge(1.0_wp) !< bounds of its particles' centres, m
   end type contents_t

   type, extends(contents_t) :: block_t
      integer :: place(3) = 0            !< block coordinates in the level, from 0
      integer :: field = 1               !< velocity field of its particles and nodes
      integer :: index = 0               !< its number in the level (grid_level%block_index)
      real(wp) :: origin(3) = 0.0_wp     !< position of its first node, m
      integer :: neighbour(27) = 0 !< slots of the blocks around, x fastest, 14 is this one; 0 where there is
                                   !< none
      logical :: shared = .false.        !< a neighbour lives on another rank
      logical :: owns_shared_sum(27) = .false. !< by direction: it computes the sums of the nodes that it
                                               !< shares only with the blocks between it and that direction
   contains
      procedure :: reserve
      procedure :: take_contents
      procedure :: in_tile
      procedure :: sums_hold
      procedure :: rests
      procedure :: has_resting_mass
      procedure :: keep_resting_mass
      procedure :: has_resting_volume
      procedure :: keep_resting_volume
      procedure :: lay_resting_mass
      procedure :: wants_sorting
      procedure :: sort
      procedure :: count_disorder
      procedure :: include_place
      procedure :: bytes
   end type block_t

   real(wp), parameter :: sort_share = 0.45_wp !< sort when so many run breaks a particle have accumulated:
                                               !< their cost then equals that of sorting
   real(wp), parameter :: averaged = 64.0_wp   !< steps

contains

   !> Make room for a number of particles.
   subroutine reserve(self, capacity, columns)
      class(block_t), intent(inout) :: self
      integer, intent(in) :: capacity, columns
      if (.not. allocated(self%particles)) allocate (self%particles, self%cells)
      call self%particles%reserve(capacity, columns)
      call self%cells%reserve(size(self%particles%id))
      if (.not. allocated(self%emigrants)) allocate (self%emigrants(0))
   end subroutine reserve

   !> Move all contents of another block here; the other is left empty.
   subroutine take_contents(self, other)
      class(block_t), intent(inout) :: self
      type(block_t), intent(inout) :: other
      type(particle_store_t), allocatable :: particles
      type(cell_list_t), allocatable :: cells
      call move_alloc(other%particles, particles) ! keeps these arrays from being copied
      call move_alloc(other%cells, cells)
      self%contents_t = other%contents_t
      call move_alloc(particles, self%particles)
      call move_alloc(cells, self%cells)
   end subroutine take_contents

   !> Number of its first particles whose P2G is in its tile already.
   pure integer function in_tile(self)
      class(block_t), intent(in) :: self
      in_tile = merge(self%deposited, 0, self%deposit_of == self%particles%generation)
   end function in_tile

   !> True when `sums` belongs to the present state of its particles.
   pure logical function sums_hold(self)
      class(block_t), intent(in) :: self
      sums_hold = all(self%sums_of == self%particles%state())
   end function sums_hold

   !> True when its particles are known to be at rest in their present state.
   pure logical function rests(self)
      class(block_t), intent(in) :: self
      rests = self%at_rest .and. all(self%located == self%particles%state())
   end function rests

   !> True when `resting_mass` is all that its particles contribute to its tile.
   pure logical function has_resting_mass(self)
      class(block_t), intent(in) :: self
      has_resting_mass = self%rests() .and. all(self%resting_of == self%particles%state())
   end function has_resting_mass

   !> While its particles rest, store their contribution to its tile, if that is mass only.
   pure subroutine keep_resting_mass(self, tile)
      class(block_t), intent(inout) :: self
      real(wp), intent(in) :: tile(:, 0:, 0:, 0:) !< P2G of its particles
      if (self%has_resting_mass()) return
      if (allocated(self%resting_mass)) deallocate (self%resting_mass)
      self%resting_of = -1
      if (.not. self%rests()) return
      if (any(abs(tile(p_x:, :, :, :)) > 0.0_wp)) return
      self%resting_mass = tile(mass_, :, :, :)
      self%resting_of = self%particles%state()
   end subroutine keep_resting_mass

   !> True when `resting_volume` is all that its particles contribute to the cells of its tile. It is not
   !> stored at an edge of levels: cells are joined there as the level moves.
   pure logical function has_resting_volume(self)
      class(block_t), intent(in) :: self
      has_resting_volume = .not. allocated(self%cells%standing) .and. self%rests() &
                           .and. all(self%volume_of == self%particles%state())
   end function has_resting_volume

   !> While its particles rest, store the volumes that they contribute to the cells of its tile.
   pure subroutine keep_resting_volume(self, rows, tile)
      class(block_t), intent(inout) :: self
      integer, intent(in) :: rows(2)              !< first and last index along y in use
      real(wp), intent(in) :: tile(:, 0:, 0:, 0:) !< cell sums of its particles, volume first
      if (allocated(self%cells%standing)) return
      if (.not. allocated(self%resting_volume)) &
         allocate (self%resting_volume(0:tile_last, 0:tile_last, 0:tile_last), source=0.0_wp)
      self%resting_volume(:, rows(1):rows(2), :) = tile(1, :, rows(1):rows(2), :)
      self%volume_of = self%particles%state()
   end subroutine keep_resting_volume

   !> Add the contribution of its resting particles to its cleared tile.
   pure subroutine lay_resting_mass(self, rows, tile)
      class(block_t), intent(in) :: self
      integer, intent(in) :: rows(2) !< first and last index along y in use
      real(wp), intent(inout) :: tile(:, 0:, 0:, 0:)
      tile(mass_, :, rows(1):rows(2), :) = self%resting_mass(:, rows(1) + 1:rows(2) + 1, :)
   end subroutine lay_resting_mass

   !> True when the run breaks, now (up to date) and over past steps, have cost as much as sorting. A block
   !> that comes to rest is sorted then: while it rests its order is not counted, and sorting must not depend
   !> on how long it rested.
   pure logical function wants_sorting(self)
      class(block_t), intent(in) :: self
      wants_sorting = self%disorder + self%cells%run_breaks > sort_share*self%particles%count
      if (self%at_rest) wants_sorting = wants_sorting .or. self%cells%run_breaks > 0
   end function wants_sorting

   !> Sort the particles by bin.
   subroutine sort(self, order, work)
      class(block_t), intent(inout) :: self
      integer(i4), intent(inout), contiguous :: order(:) !< work, as long as there are particles
      real(wp), intent(inout), contiguous :: work(:, :)  !< as in permute
      associate (sorted => order(:self%particles%count))
         call self%cells%sort(sorted)
         call self%particles%permute(sorted, work)
      end associate
      self%disorder = 0.0_wp
   end subroutine sort

   !> Once a step, with the order as used: update the sum and the mean of run breaks since the last sort.
   !> Particles that arrived since then do not count: sorting changes the last digits of sums, and must not
   !> depend on ranks.
   pure subroutine count_disorder(self)
      class(block_t), intent(inout) :: self
      self%disorder = self%disorder + self%run_breaks
      self%mean_breaks = self%mean_breaks + (self%run_breaks - self%mean_breaks)/averaged
   end subroutine count_disorder

   !> Extend the bounds to include a position.
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
      if (allocated(self%emigrants)) bytes = bytes + 4_i8*size(self%emigrants, kind=i8)
      if (allocated(self%resting_mass)) bytes = bytes + 8_i8*size(self%resting_mass, kind=i8)
      if (allocated(self%resting_volume)) bytes = bytes + 8_i8*size(self%resting_volume, kind=i8)
   end function bytes

end module m_block
