!> The nodes of a level around a box of atoms, the same on all ranks: their masses, their motion, and what
!> bonds give to them.
module m_node_patch
   use mpi_f08
   use m_kinds, only: wp
   use m_constants, only: block_size
   use m_communicator, only: communicator_t
   use m_level, only: level_t
   use m_node_values, only: mass_, v_x, v_z, a_x, a_z, tile_last
   implicit none
   private

   integer, parameter :: mass = 1, velocity = 2, acceleration = 5 !< first of each in `motion`
   real(wp), parameter :: nothing = 1.0e-8_wp !< mass, of the largest, of nodes that rounding reaches

   type, public :: node_patch_t
      integer :: low(3) = 0, high(3) = -1          !< nodes of the level's grid
      real(wp) :: origin(3) = 0.0_wp, cell = 0.0_wp !< place of node `low`, m
      real(wp), allocatable :: motion(:, :, :, :)  !< (7, nodes): mass, velocity, acceleration
      real(wp), allocatable :: given(:, :, :, :)   !< (3, nodes): forces or impulses
   contains
      procedure :: cover
      procedure :: gather
      procedure :: velocity_at
      procedure :: add
      procedure :: apply
      procedure :: work
   end type node_patch_t

contains

   !> The nodes around the box from `lower` to `upper` (m), and one more on each side.
   subroutine cover(self, level, lower, upper)
      class(node_patch_t), intent(inout) :: self
      type(level_t), intent(in) :: level
      real(wp), intent(in) :: lower(3), upper(3)
      integer :: low(3), high(3)
      low = floor((lower - level%grid%lower)*level%grid%per_cell) - 1
      high = ceiling((upper - level%grid%lower)*level%grid%per_cell) + 1
      self%low = low
      self%high = high
      self%cell = level%grid%cell
      self%origin = level%grid%lower + low*level%grid%cell
      if (allocated(self%motion)) deallocate (self%motion, self%given)
      allocate (self%motion(7, low(1):high(1), low(2):high(2), low(3):high(3)), source=0.0_wp)
      allocate (self%given(3, low(1):high(1), low(2):high(2), low(3):high(3)), source=0.0_wp)
   end subroutine cover

   !> Collective: the motion of the nodes, from whichever blocks have particles there: all of these have the
   !> same bits, and that of lowest number gives them. Nodes that particles reach by rounding alone count as
   !> without mass.
   subroutine gather(self, communicator, level)
      class(node_patch_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(in) :: level
      integer, allocatable :: giver(:, :, :)
      real(wp) :: least
      integer :: b, i, j, k, n(3)
      allocate (giver(self%low(1):self%high(1), self%low(2):self%high(2), self%low(3):self%high(3)), &
                source=huge(1))
      self%motion = 0.0_wp
      do b = 1, size(level%blocks)
         if (level%blocks(b)%particles%count == 0) cycle
         do k = 0, tile_last
            do j = 0, tile_last
               do i = 0, tile_last
                  n = block_size*level%blocks(b)%place + [i, j, k] - 1
                  if (any(n < self%low) .or. any(n > self%high)) cycle
                  if (level%blocks(b)%index > giver(n(1), n(2), n(3))) cycle
                  if (.not. level%nodes(mass_, i, j, k, b) > 0.0_wp) cycle
                  giver(n(1), n(2), n(3)) = level%blocks(b)%index
                  self%motion(mass, n(1), n(2), n(3)) = level%nodes(mass_, i, j, k, b)
                  self%motion(velocity:velocity + 2, n(1), n(2), n(3)) = level%nodes(v_x:v_z, i, j, k, b)
                  self%motion(acceleration:, n(1), n(2), n(3)) = level%nodes(a_x:a_z, i, j, k, b)
               end do
            end do
         end do
      end do
      if (communicator%ranks > 1) call take_from_lowest(self, communicator, giver)
      least = maxval(self%motion(mass, :, :, :))*nothing
      where (self%motion(mass, :, :, :) < least) self%motion(mass, :, :, :) = 0.0_wp
   end subroutine gather

   !> Collective: of each node the motion that the block of the lowest number has.
   subroutine take_from_lowest(self, communicator, giver)
      class(node_patch_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      integer, allocatable, intent(in) :: giver(:, :, :)
      integer, allocatable :: least(:, :, :)
      integer :: i, j, k
      least = giver
      call MPI_Allreduce(MPI_IN_PLACE, least, size(least), MPI_INTEGER, MPI_MIN, communicator%comm)
      do k = self%low(3), self%high(3)
         do j = self%low(2), self%high(2)
            do i = self%low(1), self%high(1)
               if (giver(i, j, k) /= least(i, j, k)) self%motion(:, i, j, k) = 0.0_wp
            end do
         end do
      end do
      call MPI_Allreduce(MPI_IN_PLACE, self%motion, size(self%motion), MPI_DOUBLE_PRECISION, MPI_SUM, &
                         communicator%comm)
   end subroutine take_from_lowest

   !> Velocity at a place by the hat functions of the nodes that have mass, with the impulses that they have
   !> been given; `reached` is false where none has, or the place is outside.
   pure subroutine velocity_at(self, place, v, reached)
      class(node_patch_t), intent(in) :: self
      real(wp), intent(in) :: place(3) !< m
      real(wp), intent(out) :: v(3)
      logical, intent(out) :: reached
      real(wp) :: weight(0:1, 0:1, 0:1)
      integer :: at(3), i, j, k
      v = 0.0_wp
      call weights(self, place, at, weight, reached)
      if (.not. reached) return
      do k = 0, 1
         do j = 0, 1
            do i = 0, 1
               if (.not. weight(i, j, k) > 0.0_wp) cycle
               associate (node => self%motion(:, at(1) + i, at(2) + j, at(3) + k), &
                          push => self%given(:, at(1) + i, at(2) + j, at(3) + k))
                  v = v + weight(i, j, k)*(node(velocity:velocity + 2) + push/node(mass))
               end associate
            end do
         end do
      end do
   end subroutine velocity_at

   !> The hat functions of the eight nodes around a place; those without mass leave theirs to the others.
   pure subroutine weights(self, place, at, weight, reached)
      class(node_patch_t), intent(in) :: self
      real(wp), intent(in) :: place(3)
      integer, intent(out) :: at(3)
      real(wp), intent(out) :: weight(0:1, 0:1, 0:1)
      logical, intent(out) :: reached
      real(wp) :: t(3), sum_of_weights
      integer :: i, j, k
      t = (place - self%origin)/self%cell
      reached = all(t >= 0.0_wp .and. t < real(self%high - self%low, wp))
      at = self%low
      weight = 0.0_wp
      if (.not. reached) return
      at = floor(t)
      t = t - at
      at = at + self%low
      sum_of_weights = 0.0_wp
      do k = 0, 1
         do j = 0, 1
            do i = 0, 1
               if (.not. self%motion(mass, at(1) + i, at(2) + j, at(3) + k) > 0.0_wp) cycle
               weight(i, j, k) = product(merge(t, 1.0_wp - t, [i, j, k] == 1))
               sum_of_weights = sum_of_weights + weight(i, j, k)
            end do
         end do
      end do
      reached = sum_of_weights > 0.0_wp
      if (reached .and. sum_of_weights < 1.0_wp - 1.0e-12_wp) weight = weight/sum_of_weights
   end subroutine weights

   !> Give forces or impulses at places to the nodes; `missed` counts those that no node with mass is near to.
   pure subroutine add(self, places, values, factor, missed)
      class(node_patch_t), intent(inout) :: self
      real(wp), intent(in) :: places(:, :), values(:, :), factor
      integer, intent(inout) :: missed
      real(wp) :: weight(0:1, 0:1, 0:1)
      logical :: reached
      integer :: n, at(3), i, j, k
      do n = 1, size(places, 2)
         call weights(self, places(:, n), at, weight, reached)
         if (.not. reached) missed = missed + 1
         if (.not. reached) cycle
         do k = 0, 1
            do j = 0, 1
               do i = 0, 1
                  associate (node => self%given(:, at(1) + i, at(2) + j, at(3) + k))
                     node = node + factor*weight(i, j, k)*values(:, n)
                  end associate
               end do
            end do
         end do
      end do
   end subroutine add

   !> The impulses (N s) that stand in `given` change the motion of the nodes in all tiles. What no more than
   !> rounding reaches stays without acceleration.
   subroutine apply(self, level, time_step)
      class(node_patch_t), intent(in) :: self
      type(level_t), intent(inout) :: level
      real(wp), intent(in) :: time_step !< s
      integer :: b, i, j, k, n(3)
      do b = 1, size(level%blocks)
         if (level%blocks(b)%particles%count == 0) cycle
         do k = 0, tile_last
            do j = 0, tile_last
               do i = 0, tile_last
                  n = block_size*level%blocks(b)%place + [i, j, k] - 1
                  if (any(n < self%low) .or. any(n > self%high)) cycle
                  associate (node => level%nodes(:, i, j, k, b), push => self%given(:, n(1), n(2), n(3)))
                     if (.not. node(mass_) > 0.0_wp) cycle
                     if (.not. self%motion(mass, n(1), n(2), n(3)) > 0.0_wp) then
                        node(v_x:v_z) = node(v_x:v_z) - time_step*node(a_x:a_z)
                        node(a_x:a_z) = 0.0_wp
                        cycle
                     end if
                     node(v_x:v_z) = node(v_x:v_z) + push/node(mass_)
                     node(a_x:a_z) = node(a_x:a_z) + push/(node(mass_)*time_step)
                  end associate
               end do
            end do
         end do
      end do
   end subroutine apply

   !> Work of the impulses by the mean of the nodes' velocities before and after them and all else (theory.md,
   !> eq. effect-work), J.
   pure real(wp) function work(self, time_step)
      class(node_patch_t), intent(in) :: self
      real(wp), intent(in) :: time_step !< s
      real(wp) :: v(3)
      integer :: i, j, k
      work = 0.0_wp
      do k = self%low(3), self%high(3)
         do j = self%low(2), self%high(2)
            do i = self%low(1), self%high(1)
               associate (m => self%motion(:, i, j, k), push => self%given(:, i, j, k))
                  if (.not. m(mass) > 0.0_wp) cycle
                  v = m(velocity:velocity + 2) - 0.5_wp*time_step*m(acceleration:) + 0.5_wp*push/m(mass)
                  work = work + dot_product(push, v)
               end associate
            end do
         end do
      end do
   end function work

end module m_node_patch
