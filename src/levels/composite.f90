!> One composite space of two levels: the nodes of the finer one that are not inside its region are
!> constrained nodes, which depend on nodes of the coarser one (theory.md, eqs constrained, restriction,
!> half-steps).
!>
!> An edge block (m_edge) and its parent exchange one patch of nodes each way: up the restricted values of the
!> constrained nodes, down the motion of the nodes that these depend on.
module m_composite
   use m_kinds, only: wp, i8
   use m_node_values, only: node_values, tile_last, mass_, p_x, p_z, v_x, v_z, f_x, f_z, a_x, a_z, spare_
   use m_sorting, only: sorted_order
   use m_communicator, only: communicator_t
   use m_level, only: level_t, fit_pool
   use m_boundary, only: apply_boundary
   use m_edge_nodes, only: edge_nodes_t, list_edge_nodes, find_change
   use m_edge, only: edge_t, has_constrained, make_edge, restrict_sums, restrict_lag, prolong_motion, &
                     prolong_lag, interpolate_motion, interpolate_lag, add_patches, patch_last, lag_first, &
                     lag_last
   use m_patch_exchange, only: patch_exchange_t
   implicit none
   private
   public :: composite_t

   !> Without edges, as beyond the finest and the coarsest level, it is empty: queries return false.
   type :: composite_t
      type(patch_exchange_t) :: exchange
      logical :: corrects_lag = .false. !< velocities at the edge are at several times, and particles carry
                                        !< gradients (eq. lag)
      logical, allocatable :: receiving(:)    !< of this rank's blocks of the coarser level: receives(b)
      type(edge_t), allocatable :: edges(:)   !< of this rank's blocks by rising index, then those of other
                                              !< ranks with their parent here
      integer :: own = 0                      !< number of edges of this rank's blocks
      integer, allocatable :: by_index(:)     !< edges with their parent here, by rising index of the block:
                                              !< order of addition at a parent
      integer, allocatable :: edge_of(:)      !< of each of this rank's finer blocks, 0 if none
      logical, allocatable, private :: parents(:) !< of this rank's blocks of the coarser level
      integer :: rows(2) = [0, tile_last]     !< as of the levels' grids
      integer :: values = node_values         !< of a node of a patch; 3 more where the lag is corrected
      real(wp), dimension(:, :, :, :, :), allocatable :: up, down ! (values, 0:5, rows, 0:5, edges)
      real(wp), dimension(:, :, :, :, :), allocatable, private :: first !< force of `up` in the first of two
                                                                        !< steps, own edges
      type(edge_nodes_t) :: depended !< nodes of the coarser level on which constrained nodes depend
      ! by these nodes:
      real(wp), allocatable, private :: pushed(:, :)       !< acceleration by effects on nodes, m/s2
      real(wp), allocatable, private :: lag_force(:, :)    !< of the stress accumulated on the finer level, N
      real(wp), allocatable :: lag_velocity(:, :)          !< lead of the gradients of coarser particles, m/s
      real(wp), allocatable, private :: own_mass(:)        !< without the restricted mass, kg
   contains
      procedure :: build
      procedure :: is_parent, receives, has_edge, constrained
      procedure :: restrict, restrict_change, add_to_parents, collect_change
      procedure :: collect_lag_force, keep_lag_force, set_constrained_lag, add_parent_lag
      procedure :: prolong, correct, set_constrained, keep_nodal_force
      procedure :: release
   end type composite_t

contains

   !> Set up edges, patches and messages for the present blocks.
   subroutine build(self, communicator, coarse, fine)
      class(composite_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(inout) :: coarse !< gets tiles for restricted values
      type(level_t), intent(in) :: fine
      integer, allocatable :: own(:), others(:), numbers(:), indices(:) ! own blocks' numbers, others' indices
      integer :: b, field, index, n, place(3)
      call self%release()
      self%corrects_lag = fine%layout%corrects_lag()
      self%values = merge(lag_last, node_values, self%corrects_lag)
      self%rows = fine%grid%rows
      n = size(coarse%blocks)
      allocate (self%parents(n), self%receiving(n), source=.false.)
      own = pack([(b, b=1, size(fine%blocks))], &
                 [(has_constrained(fine%region, fine%blocks(b)%place), b=1, size(fine%blocks))])
      allocate (others(0))
      do index = 1, size(fine%owner)
         if (fine%owner(index) < 0) cycle
         place = fine%grid%block_place(index)
         field = fine%grid%block_field(index)
         if (.not. has_constrained(fine%region, place)) cycle
         do b = 1, size(coarse%blocks)
            if (coarse%blocks(b)%field /= field) cycle
            associate (distance => maxval(abs(coarse%blocks(b)%place - place/2)))
               self%parents(b) = self%parents(b) .or. distance == 0
               self%receiving(b) = self%receiving(b) .or. distance <= 1
            end associate
         end do
         associate (here => communicator%rank)
            if (fine%owner(index) /= here .and. coarse%owner_at(place/2, field) == here) &
               others = [others, index]
         end associate
      end do
      self%own = size(own)
      allocate (self%edge_of(size(fine%blocks)), source=0)
      allocate (self%edges(size(own) + size(others)))
      self%edge_of(own) = [(n, n=1, size(own))]
      numbers = [own, 0*others]
      indices = [fine%blocks(own)%index, others]
      do n = 1, size(self%edges)
         self%edges(n) = make_edge(coarse, fine, communicator%rank, indices(n), numbers(n))
      end do
      self%by_index = pack([(n, n=1, size(self%edges))], self%edges%parent > 0)
      self%by_index = self%by_index(sorted_order(int(self%edges(self%by_index)%index, i8), &
                                                 int(self%by_index, i8)))
      n = size(self%edges)
      allocate (self%up(self%values, 0:patch_last, self%rows(1):min(self%rows(2), patch_last), &
                        0:patch_last, n), source=0.0_wp)
      allocate (self%down, source=self%up)
      allocate (self%first, source=self%up(f_x:f_z, :, :, :, :self%own))
      call list_edge_nodes(coarse, fine, self%depended)
      n = size(self%depended%at, 2)
      allocate (self%own_mass(n), self%pushed(3, n), source=0.0_wp)
      n = merge(n, 0, self%corrects_lag)
      allocate (self%lag_force(3, n), self%lag_velocity(3, n), source=0.0_wp)
      call fit_pool(coarse%restricted, size(coarse%blocks) + size(coarse%ghost_index))
      coarse%restricted(:, :, self%rows(1):self%rows(2), :, :) = 0.0_wp ! and stays so at other nodes
      call self%exchange%build(self%edges%rank_beyond, self%own, communicator, &
                               self%values*(patch_last + 1)**2*size(self%up, 3))
   end subroutine build

   !> True when the finer level restricts to a block of the coarser one.
   pure logical function is_parent(self, b)
      class(composite_t), intent(in) :: self
      integer, intent(in) :: b
      is_parent = .false.
      if (allocated(self%parents)) is_parent = self%parents(b)
   end function is_parent

   !> True when a block of the coarser level holds nodes on which constrained nodes depend: parents and the
   !> blocks next to them.
   pure logical function receives(self, b)
      class(composite_t), intent(in) :: self
      integer, intent(in) :: b
      receives = .false.
      if (allocated(self%receiving)) receives = self%receiving(b)
   end function receives

   !> True when the tile of a block of the finer level holds constrained nodes.
   pure logical function has_edge(self, b)
      class(composite_t), intent(in) :: self
      integer, intent(in) :: b
      has_edge = .false.
      if (allocated(self%edge_of)) has_edge = self%edge_of(b) > 0
   end function has_edge

   !> The constrained nodes of a block of the finer level: (4, nodes), as in an edge.
   pure function constrained(self, b) result(nodes)
      class(composite_t), intent(in) :: self
      integer, intent(in) :: b
      integer, allocatable :: nodes(:, :)
      allocate (nodes(4, 0))
      if (self%has_edge(b)) nodes = self%edges(self%edge_of(b))%constrained
   end function constrained

   !> Restrict mass, momentum (less the lag), and force of the constrained nodes to the patches, with the
   !> weights of eq. constrained. `nodes` of the finer level holds sums. The patches are stored as those of a
   !> first step.
   subroutine restrict(self, communicator, fine, half)
      class(composite_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(inout) :: fine !< one of its work lists is used
      real(wp), intent(in) :: half !< the finer step, s
      integer :: e
      call restrict_own(self, fine)
      self%first = self%up(f_x:f_z, :, :, :, :self%own)
      if (fine%layout%edge_stress > 0) then
         do e = 1, self%own
            call restrict_lag(self%edges(e), fine, half, self%up(:, :, :, :, e))
         end do
      end if
      call self%exchange%exchange(communicator, self%up, upwards=.true.)
   end subroutine restrict

   !> The same in the second of two steps: mass (also as `spare`), momentum, and the change of force since the
   !> first.
   subroutine restrict_change(self, communicator, fine)
      class(composite_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(in) :: fine
      call restrict_own(self, fine)
      associate (up => self%up(:, :, :, :, :self%own))
         up(spare_, :, :, :, :) = up(mass_, :, :, :, :)
         up(f_x:f_z, :, :, :, :) = up(f_x:f_z, :, :, :, :) - self%first
      end associate
      call self%exchange%exchange(communicator, self%up, upwards=.true.)
   end subroutine restrict_change

   subroutine restrict_own(self, fine)
      class(composite_t), intent(inout) :: self
      type(level_t), intent(in) :: fine
      integer :: e
      do e = 1, self%own
         associate (b => self%edges(e)%block)
            call restrict_sums(self%edges(e), fine%grid, fine%blocks(b)%place, fine%nodes(:, :, :, :, b), &
                               fine%layout%gradient > 0, self%up(:, :, :, :, e))
         end associate
      end do
   end subroutine restrict_own

   !> Before the sum over blocks of the coarser level: add the patches to the contributions of its own
   !> particles.
   subroutine add_to_parents(self, coarse)
      class(composite_t), intent(inout) :: self
      type(level_t), intent(inout) :: coarse
      integer :: n
      do n = 1, size(self%own_mass)
         associate (at => self%depended%at(:, n))
            self%own_mass(n) = coarse%nodes(mass_, at(1), at(2), at(3), at(4))
         end associate
      end do
      call add_patches(self%edges, self%by_index, self%up, coarse%nodes, 1, 1, node_values)
   end subroutine add_to_parents

   !> In the second of two finer steps: store the mass of the coarser level's particles, and the patches, in
   !> `restricted`.
   subroutine collect_change(self, coarse)
      class(composite_t), intent(in) :: self
      type(level_t), intent(inout) :: coarse
      integer :: n
      do n = 1, size(self%own_mass)
         associate (at => self%depended%at(:, n))
            coarse%restricted(mass_, at(1), at(2), at(3), at(4)) = self%own_mass(n)
            coarse%restricted(p_x:, at(1), at(2), at(3), at(4)) = 0.0_wp
         end associate
      end do
      call add_patches(self%edges, self%by_index, self%up, coarse%restricted, 1, 1, node_values)
   end subroutine collect_change

   !> Between the two sums of a coarser step a third, where the lag is corrected: store the forces of the
   !> accumulated stress in `restricted`, in place of momenta.
   subroutine collect_lag_force(self, coarse)
      class(composite_t), intent(in) :: self
      type(level_t), intent(inout) :: coarse
      integer :: n
      do n = 1, size(self%depended%at, 2)
         associate (at => self%depended%at(:, n))
            coarse%restricted(:, at(1), at(2), at(3), at(4)) = 0.0_wp
         end associate
      end do
      call add_patches(self%edges, self%by_index, self%up, coarse%restricted, p_x, lag_first, 3)
   end subroutine collect_lag_force

   !> Store the sum of these forces over blocks and ranks.
   subroutine keep_lag_force(self, coarse)
      class(composite_t), intent(inout) :: self
      type(level_t), intent(in) :: coarse
      integer :: n
      do n = 1, size(self%depended%at, 2)
         associate (at => self%depended%at(:, n))
            self%lag_force(:, n) = coarse%restricted(p_x:p_z, at(1), at(2), at(3), at(4))
         end associate
      end do
   end subroutine keep_lag_force

   !> Store the acceleration by effects on the nodes of block b of the coarser level, m/s2.
   subroutine keep_nodal_force(self, b, push)
      class(composite_t), intent(inout) :: self
      integer, intent(in) :: b
      real(wp), intent(in) :: push(3, 0:tile_last, 0:tile_last, 0:tile_last)
      integer :: n
      do n = self%depended%first(b), self%depended%last(b)
         associate (at => self%depended%at(:, n))
            self%pushed(:, n) = push(:, at(1), at(2), at(3))
         end associate
      end do
   end subroutine keep_nodal_force

   !> Acceleration of a parent's nodes for the velocity gradients of constrained nodes (eq. lag), stored in
   !> place of a velocity, with boundary conditions applied: the finer level's force of the accumulated
   !> stress, and the effects on nodes. In the second half step that force is extrapolated to the time at
   !> which it is removed again.
   pure subroutine gradient_acceleration(self, coarse, b, tile, sums)
      class(composite_t), intent(in) :: self
      type(level_t), intent(in) :: coarse
      integer, intent(in) :: b
      real(wp), intent(out) :: tile(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      real(wp), intent(in), optional :: sums(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
                                                        !< of the second half step, as in `correct`
      real(wp) :: force(3), mass
      integer :: n
      tile(:, :, self%rows(1):self%rows(2), :) = 0.0_wp
      do n = self%depended%first(b), self%depended%last(b)
         associate (i => self%depended%at(1, n), j => self%depended%at(2, n), k => self%depended%at(3, n))
            force = self%lag_force(:, n)
            mass = coarse%nodes(mass_, i, j, k, b)
            if (present(sums)) force = force + 2.0_wp*sums(f_x:f_z, i, j, k)
            if (present(sums)) mass = sums(mass_, i, j, k)
            if (mass > 0.0_wp) tile(v_x:v_z, i, j, k) = force/mass + self%pushed(:, n)
         end associate
      end do
      call apply_boundary(coarse%grid, coarse%blocks(b)%place, tile)
   end subroutine gradient_acceleration

   !> Set the velocity by which gradients are ahead of the motion (eq. lag) on the constrained nodes of block
   !> b of the finer level.
   pure subroutine set_constrained_lag(self, b, time_step, asked, tile)
      class(composite_t), intent(in) :: self
      integer, intent(in) :: b
      real(wp), intent(in) :: time_step  !< of the finer level, s
      integer, intent(in) :: asked(2, 3) !< first and last index along each axis of the requested nodes
      real(wp), intent(inout) :: tile(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
                                                        !< stored in place of the velocity
      if (.not. self%has_edge(b)) return
      call interpolate_lag(self%edges(self%edge_of(b)), self%down(:, :, :, :, self%edge_of(b)), time_step, &
                           asked, tile)
   end subroutine set_constrained_lag

   !> Add the same on the nodes of block b of the coarser level.
   pure subroutine add_parent_lag(self, b, tile)
      class(composite_t), intent(in) :: self
      integer, intent(in) :: b
      real(wp), intent(inout) :: tile(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
                                                        !< stored in place of the velocity
      integer :: n
      if (.not. self%receives(b)) return
      do n = self%depended%first(b), self%depended%last(b)
         associate (i => self%depended%at(1, n), j => self%depended%at(2, n), k => self%depended%at(3, n))
            tile(v_x:v_z, i, j, k) = tile(v_x:v_z, i, j, k) + self%lag_velocity(:, n)
         end associate
      end do
   end subroutine add_parent_lag

   !> Velocity lag for the gradients of the coarser particles of block b: half a finer step of the finer
   !> level's extrapolated force.
   pure subroutine set_parent_lag(self, b, half, sums)
      class(composite_t), intent(inout) :: self
      integer, intent(in) :: b
      real(wp), intent(in) :: half !< the finer step, s
      real(wp), intent(in) :: sums(node_values, 0:tile_last, 0:tile_last, 0:tile_last) !< as in `correct`
      integer :: n
      do n = self%depended%first(b), self%depended%last(b)
         associate (at => self%depended%at(:, n), lead => self%lag_velocity(:, n))
            associate (node => sums(:, at(1), at(2), at(3)))
               lead = 0.0_wp
               if (node(mass_) > 0.0_wp) &
                  lead = 0.5_wp*half*(self%lag_force(:, n) + node(f_x:f_z))/node(mass_)
            end associate
         end associate
      end do
   end subroutine set_parent_lag

   !> Copy the motion of the coarser nodes to the patches: velocity at the end of their step, acceleration.
   subroutine prolong(self, communicator, coarse)
      class(composite_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(in) :: coarse
      integer :: b
      do b = 1, size(coarse%blocks)
         if (self%parents(b)) call prolong_block(self, coarse, b, coarse%nodes(:, :, :, :, b))
      end do
      call self%exchange%exchange(communicator, self%down, upwards=.false.)
   end subroutine prolong

   !> Set the patches of all children of block b.
   pure subroutine prolong_block(self, coarse, b, motion, sums)
      class(composite_t), intent(inout) :: self
      type(level_t), intent(in) :: coarse
      integer, intent(in) :: b
      real(wp), intent(in) :: motion(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      real(wp), intent(in), optional :: sums(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
                                                        !< for gradient_acceleration
      real(wp) :: known(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      integer :: e
      if (self%corrects_lag) call gradient_acceleration(self, coarse, b, known, sums)
      do e = 1, size(self%edges)
         if (self%edges(e)%parent /= b) cycle
         call prolong_motion(self%edges(e), motion, self%down(:, :, :, :, e))
         if (self%corrects_lag) call prolong_lag(self%edges(e), known, self%down(:, :, :, :, e))
      end do
   end subroutine prolong_block

   !> Correct the motion of the coarser level's nodes by the actual contributions of the constrained nodes
   !> over the two finer steps, and prolong it (theory.md, eq. half-steps). `restricted` holds the sums of
   !> collect_change over blocks: the mass of coarser particles and constrained nodes, and of constrained
   !> nodes alone the momentum, the change of force, and the mass (as `spare`). A node whose mass has more
   !> than doubled starts the second half step with its momentum at that time.
   subroutine correct(self, communicator, coarse, time_step, flip_fraction)
      class(composite_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(inout) :: coarse
      real(wp), intent(in) :: time_step !< of the coarser level, s
      real(wp), intent(in) :: flip_fraction
      real(wp), dimension(node_values, 0:tile_last, 0:tile_last, 0:tile_last) :: change, motion
      integer :: b
      do b = 1, size(coarse%blocks)
         if (.not. self%receiving(b)) cycle
         call find_change(self%depended, coarse, b, self%pushed, time_step, flip_fraction, change)
         call apply_change(self, coarse, b, change, motion)
         associate (sums => coarse%restricted(:, :, :, :, b))
            if (self%parents(b)) call prolong_block(self, coarse, b, motion, sums)
            if (self%corrects_lag) call set_parent_lag(self, b, 0.5_wp*time_step, sums)
         end associate
      end do
      call self%exchange%exchange(communicator, self%down, upwards=.false.)
   end subroutine correct

   !> Add changes to the motion of a block's nodes. `motion`: that motion in the second half step.
   pure subroutine apply_change(self, coarse, b, change, motion)
      class(composite_t), intent(in) :: self
      type(level_t), intent(inout) :: coarse
      integer, intent(in) :: b
      real(wp), dimension(node_values, 0:tile_last, 0:tile_last, 0:tile_last), intent(in) :: change
      real(wp), dimension(node_values, 0:tile_last, 0:tile_last, 0:tile_last), intent(out) :: motion
      integer :: n
      if (self%parents(b)) motion(:, :, self%rows(1):self%rows(2), :) = &
         coarse%nodes(:, :, self%rows(1):self%rows(2), :, b)
      do n = self%depended%first(b), self%depended%last(b)
         associate (i => self%depended%at(1, n), j => self%depended%at(2, n), k => self%depended%at(3, n))
            associate (node => coarse%nodes(:, i, j, k, b), more => change(:, i, j, k))
               node(v_x:a_z) = node(v_x:a_z) + more(v_x:a_z)
               motion(:, i, j, k) = node
               motion(a_x:a_z, i, j, k) = node(a_x:a_z) + more(a_x:a_z)
            end associate
         end associate
      end do
   end subroutine apply_change

   !> Move the constrained nodes of a block with the nodes that they depend on, linearly in time (theory.md,
   !> eq. half-steps).
   pure subroutine set_constrained(self, b, remaining, tile)
      class(composite_t), intent(in) :: self
      integer, intent(in) :: b          !< the block's number here
      real(wp), intent(in) :: remaining !< time from the velocities of this step to those of the coarser one,
                                        !< s
      real(wp), intent(inout) :: tile(node_values, 0:tile_last, 0:tile_last, 0:tile_last)
      if (.not. self%has_edge(b)) return
      call interpolate_motion(self%edges(self%edge_of(b)), self%down(:, :, :, :, self%edge_of(b)), &
                              remaining, tile)
   end subroutine set_constrained

   !> Free the datatypes, and the edges.
   subroutine release(self)
      class(composite_t), intent(inout) :: self
      if (.not. allocated(self%edges)) return
      call self%exchange%release()
      deallocate (self%edges, self%edge_of, self%parents, self%receiving, self%up, self%down, &
                  self%first, self%pushed, self%lag_force, self%lag_velocity, self%own_mass)
   end subroutine release

end module m_composite
