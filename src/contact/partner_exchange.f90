!> Nodes on which forces on other bodies act, in tiles of this rank or of near ones: their values are read,
!> and forces are added to them, as often as a solver needs, by lists built once.
module m_partner_exchange
   use m_kinds, only: wp
   use m_constants, only: block_size
   use m_node_values, only: mass_
   use m_near_ranks, only: near_ranks_t
   use m_level, only: level_t
   implicit none
   private
   public :: partner_exchange_t, numbers_each

   integer, parameter :: numbers_each = 4 !< per node: its coordinates in the grid and its velocity field

   type :: partner_exchange_t
      private
      integer, public :: count = 0
      integer, allocatable :: tile(:, :) !< (4, count): indices in a local tile, and block; 0: on another rank
      type(near_ranks_t) :: near
      integer, allocatable :: mine(:)       !< numbers of nodes in a tile of a near rank, by ranks
      integer, allocatable :: mine_count(:) !< (near ranks)
      integer, allocatable :: their_tile(:, :) !< (4, nodes of near ranks): indices in a local tile, and block
      integer, allocatable :: their_count(:)   !< (near ranks)
   contains
      procedure :: build
      procedure :: read => read_values
      procedure :: add
      procedure, private :: agree
   end type partner_exchange_t

contains

   !> Collective among near ranks: find the rank that has each node in a tile. The level's nodes must have
   !> their masses. A node on several near ranks is read from the lowest; the values of a missing one are 0.
   subroutine build(self, level, node)
      class(partner_exchange_t), intent(inout) :: self
      type(level_t), intent(in) :: level
      integer, intent(in) :: node(:, :) !< (4, nodes): place in the grid, from -1; velocity field
      integer :: n
      self%count = size(node, 2)
      self%near = level%near
      if (allocated(self%tile)) deallocate (self%tile)
      allocate (self%tile(4, self%count))
      do n = 1, self%count
         self%tile(:, n) = tile_here(level, node(:, n))
      end do
      call self%agree(level, node)
   end subroutine build

   !> Request from every near rank the nodes that are in no local tile and may be in one there; then tell it
   !> which of those it has will be read.
   subroutine agree(self, level, node)
      class(partner_exchange_t), intent(inout) :: self
      type(level_t), intent(in) :: level
      integer, intent(in) :: node(:, :)
      integer, dimension(size(level%near%ranks)) :: asked_count, wanted_count
      integer, allocatable :: asked(:), wanted(:, :), tile(:, :), found(:), there(:), chosen(:)
      logical :: had(self%count)
      integer :: k, n, r
      asked = [integer ::]
      do r = 1, size(asked_count)
         associate (some => pack([(n, n=1, self%count)], [(self%tile(4, n) == 0 .and. &
                                 may_hold(level, level%near%ranks(r), node(:, n)), n=1, self%count)]))
            asked = [asked, some]
            asked_count(r) = size(some)
         end associate
      end do
      call self%near%swap_counts(asked_count, wanted_count)
      allocate (wanted(numbers_each, sum(wanted_count)), tile(4, sum(wanted_count)), there(size(asked)))
      allocate (chosen(sum(wanted_count)))
      call self%near%swap_integers(node(:, asked), numbers_each*asked_count, wanted, &
                                   numbers_each*wanted_count)
      do k = 1, size(tile, 2)
         tile(:, k) = tile_here(level, wanted(:, k))
      end do
      found = merge(1, 0, tile(4, :) > 0)
      call self%near%swap_integers(found, wanted_count, there, asked_count)
      had = .false.
      do k = 1, size(asked) ! rank by rank
         if (had(asked(k))) there(k) = 0
         if (there(k) > 0) had(asked(k)) = .true.
      end do
      call self%near%swap_integers(there, asked_count, chosen, wanted_count)
      self%mine = pack(asked, there > 0)
      self%mine_count = parts(there, asked_count)
      self%their_tile = tile(:, pack([(k, k=1, size(chosen))], chosen > 0))
      self%their_count = parts(chosen, wanted_count)
   end subroutine agree

   !> Number of positive flags in each rank's part.
   pure function parts(flags, counts) result(positive)
      integer, intent(in) :: flags(:)  !< rank by rank
      integer, intent(in) :: counts(:) !< (ranks)
      integer :: positive(size(counts)), r
      do r = 1, size(counts)
         associate (last => sum(counts(:r)))
            positive(r) = count(flags(last - counts(r) + 1:last) > 0)
         end associate
      end do
   end function parts

   !> Collective among near ranks: values of the nodes.
   subroutine read_values(self, tiles, place, values)
      class(partner_exchange_t), intent(in) :: self
      real(wp), intent(in), contiguous :: tiles(:, 0:, 0:, 0:, :)
      integer, intent(in) :: place(:)       !< of the values in a tile's node
      real(wp), intent(out) :: values(:, :) !< (size of place, count)
      real(wp) :: given(size(place), size(self%their_tile, 2)), taken(size(place), size(self%mine))
      integer :: n
      values = 0.0_wp
      do n = 1, self%count
         if (self%tile(4, n) > 0) values(:, n) = at(self%tile(:, n))
      end do
      do n = 1, size(given, 2)
         given(:, n) = at(self%their_tile(:, n))
      end do
      call self%near%swap_reals(given, size(place)*self%their_count, taken, size(place)*self%mine_count)
      values(:, self%mine) = taken
   contains
      pure function at(tile)
         integer, intent(in) :: tile(4)
         real(wp) :: at(size(place))
         at = tiles(place, tile(1), tile(2), tile(3), tile(4))
      end function at
   end subroutine read_values

   !> Collective among near ranks: add values of the nodes to one tile that has them.
   subroutine add(self, values, place, tiles)
      class(partner_exchange_t), intent(in) :: self
      real(wp), intent(in) :: values(:, :) !< (size of place, count)
      integer, intent(in) :: place(:)      !< of the values in a tile's node
      real(wp), intent(inout), contiguous :: tiles(:, 0:, 0:, 0:, :)
      real(wp) :: taken(size(place), size(self%their_tile, 2))
      integer :: n
      call self%near%swap_reals(values(:, self%mine), size(place)*self%mine_count, taken, &
                          size(place)*self%their_count)
      do n = 1, self%count
         if (self%tile(4, n) > 0) call add_to(self%tile(:, n), values(:, n))
      end do
      do n = 1, size(taken, 2)
         call add_to(self%their_tile(:, n), taken(:, n))
      end do
   contains
      subroutine add_to(at, more)
         integer, intent(in) :: at(4)
         real(wp), intent(in) :: more(:)
         tiles(place, at(1), at(2), at(3), at(4)) = tiles(place, at(1), at(2), at(3), at(4)) + more
      end subroutine add_to
   end subroutine add

   !> True when a rank has a block whose tile may contain a node.
   pure logical function may_hold(level, rank, node)
      type(level_t), intent(in) :: level
      integer, intent(in) :: rank, node(numbers_each)
      integer :: low(3), high(3), x, y, z
      call blocks_around(node(:3), low, high)
      may_hold = .false.
      do z = low(3), high(3)
         do y = low(2), high(2)
            do x = low(1), high(1)
               may_hold = may_hold .or. level%owner_at([x, y, z], node(4)) == rank
            end do
         end do
      end do
   end function may_hold

   !> Range of the blocks whose tiles contain a node.
   pure subroutine blocks_around(node, low, high)
      integer, intent(in) :: node(3)
      integer, intent(out) :: low(3), high(3)
      integer :: home(3)
      home = (node - modulo(node, block_size))/block_size
      low = home - merge(1, 0, modulo(node, block_size) == 0)
      high = home + merge(1, 0, modulo(node, block_size) == block_size - 1)
   end subroutine blocks_around

   !> Indices of a node with mass in a local tile, and the block; 0: none. Only blocks with particles, as the
   !> nodes of others are not solved.
   pure function tile_here(level, node) result(tile)
      type(level_t), intent(in) :: level
      integer, intent(in) :: node(numbers_each)
      integer :: tile(4)
      integer :: low(3), high(3), x, y, z, slot, at(3)
      call blocks_around(node(:3), low, high)
      do z = low(3), high(3)
         do y = low(2), high(2)
            do x = low(1), high(1)
               slot = level%slot_at([x, y, z], node(4))
               if (slot == 0 .or. slot > size(level%blocks)) cycle
               if (level%blocks(slot)%particles%count == 0) cycle
               at = node(:3) - block_size*[x, y, z] + 1
               tile = [at, slot]
               if (level%nodes(mass_, at(1), at(2), at(3), slot) > 0.0_wp) return
            end do
         end do
      end do
      tile = 0
   end function tile_here

end module m_partner_exchange
