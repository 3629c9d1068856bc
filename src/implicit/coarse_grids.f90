!> The preconditioner of Bramble, Pasciak and Xu (1990) for the stiffness of implicit steps: its diagonal, and
!> corrections on successively coarser grids, each with its own diagonal (theory.md, eq. coarse-grids). It
!> needs no matrix, and supports levels, contact groups and sections.
module m_coarse_grids
   use mpi_f08
   use m_kinds, only: wp
   use m_side_kinds, only: boundary_free, boundary_fixed
   use m_grid_level, only: grid_level_t
   use m_boundary, only: held_components
   use m_krylov, only: krylov_preconditioner_t
   use m_grid_transfer, only: lattice_t, restrict_to, prolong_from
   use m_model, only: model_t
   use m_static_nodes, only: tile_node
   use m_static_levels, only: collect
   use m_static_system, only: static_system_t
   implicit none
   private
   public :: coarse_grids_t

   !> Grid 0 has the cells of the finest level and extends over this rank's nodes of it. All ranks have all of
   !> the coarser grids; a coarser level's nodes are nodes of the grid with its cells.
   type, extends(krylov_preconditioner_t) :: coarse_grids_t
      private
      type(model_t), pointer :: model => null()
      integer :: row = 0                      !< of the timers
      logical, public :: wanted = .false.
      logical, public :: diagonal_alone = .false. !< at present
      type(lattice_t), allocatable :: grids(:) !< from 0
      integer, allocatable :: slot(:)         !< of the nodal unknowns among the values of all grids
      real(wp), allocatable :: values(:)      !< three a node
      real(wp), allocatable :: inverse(:)     !< likewise: inverse diagonals; 0 for fixed components
      real(wp), allocatable :: share(:)       !< likewise: one over the sum of the weights of the existing
                                              !< nodes of the next grid; 0 where this grid has no node
      real(wp), allocatable :: diagonal(:)    !< of the stiffness
   contains
      procedure :: begin
      procedure :: renew
      procedure :: apply
      procedure, private :: fit_grids
      procedure, private :: find_shares
      procedure, private :: pass_on
      procedure, private :: first_shared
   end type coarse_grids_t

   integer, parameter :: max_grids = 40
   real(wp), parameter :: half = 0.5_wp      !< weight of a neighbour of a node of the next grid
   real(wp), parameter :: thinner = 0.25_wp  !< stiffness of a node over the weighted sum of the stiffnesses
                                             !< it represents
   real(wp), parameter :: even(8, 3) = 1.0_wp !< parity of a stiffness under reflection

contains

   !> Collective: prepare for a step after its unknowns are numbered.
   subroutine begin(self, system)
      class(coarse_grids_t), intent(inout) :: self
      type(static_system_t), intent(in) :: system
      integer :: l, m, n
      self%model => system%model
      self%row = self%model%timers%row_of('coarse grids')
      call self%model%timers%enter(self%row)
      call self%fit_grids(system)
      if (allocated(self%slot)) deallocate (self%slot)
      allocate (self%slot(system%nodal))
      do l = 1, size(system%levels)
         associate (mine => system%levels(l), level => self%model%levels(l), &
                    grid => self%grids(size(system%levels) - l))
            do n = 1, mine%unknowns%count
               associate (at => mine%unknowns%at(:, n))
                  m = grid%place(tile_node(level, at(5), at(2:4)), level%blocks(at(5))%field)
                  self%slot(mine%before + n) = 3*(m - 1) + at(1)
               end associate
            end do
         end associate
      end do
      call self%find_shares()
   end subroutine begin

   !> Collective: set up successively coarser grids, up to one cell around all.
   subroutine fit_grids(self, system)
      class(coarse_grids_t), intent(inout) :: self
      type(static_system_t), intent(in) :: system
      integer :: own(6, size(system%levels)), all_ranks(6, 0:size(system%levels) - 1), box(6), k, n, levels
      logical :: halves(3)
      type(lattice_t), allocatable :: kept(:)
      levels = size(system%levels)
      halves = .true.
      if (self%model%levels(1)%grid%section%is_flat()) halves(2) = .false.
      do k = 0, levels - 1
         own(:, levels - k) = box_of(system, levels - k)
         all_ranks(:, k) = own(:, levels - k)
      end do
      call MPI_Allreduce(MPI_IN_PLACE, all_ranks, size(all_ranks), MPI_INTEGER, MPI_MIN, &
                         self%model%communicator%comm)
      if (any(own(:3, levels) > -own(4:, levels))) & ! this rank has none: use one node that all ranks have
         own(:, levels) = [all_ranks(:3, 0), -all_ranks(:3, 0)]
      if (allocated(self%grids)) deallocate (self%grids)
      allocate (self%grids(0:max_grids))
      n = 0
      call self%grids(0)%fit(own(:, levels), self%model%levels(1)%grid%fields, halves, n)
      box = all_ranks(:, 0)
      do k = 1, max_grids
         where (halves)
            box(:3) = box(:3)/2
            box(4:) = -((1 - box(4:))/2)
         end where
         if (k < levels) box = min(box, all_ranks(:, k))
         call self%grids(k)%fit(box, self%model%levels(1)%grid%fields, halves, n)
         if (k >= levels - 1 .and. all(-box(4:) - box(:3) <= 1 .or. .not. halves)) exit
      end do
      k = min(k, max_grids)
      allocate (kept(0:k), source=self%grids(:k))
      call move_alloc(kept, self%grids)
      if (allocated(self%values)) deallocate (self%values, self%inverse, self%share)
      allocate (self%values(3*n), self%inverse(3*n), self%share(3*n))
   end subroutine fit_grids

   !> Lowest nodes of this rank's unknowns of a level, and minus the highest.
   pure function box_of(system, l) result(box)
      type(static_system_t), intent(in) :: system
      integer, intent(in) :: l
      integer :: box(6), n, node(3)
      box = huge(box)
      associate (mine => system%levels(l)%unknowns)
         do n = 1, mine%count
            node = tile_node(system%model%levels(l), mine%at(5, n), mine%at(2:4, n))
            box = min(box, [node, -node])
         end do
      end associate
   end function box_of

   !> Collective: find the existing nodes of the grids: those with unknowns, fixed ones, and every other one
   !> of the next finer grid.
   subroutine find_shares(self)
      class(coarse_grids_t), intent(inout) :: self
      integer :: k
      self%values = 0.0_wp
      self%values(3*((self%slot - 1)/3) + 1) = 1.0_wp
      associate (grid => self%model%levels(size(self%model%levels))%grid)
         do k = 0, ubound(self%grids, 1)
            call mark_held(grid, self%grids(k), 2**k, self%values)
            if (k > 0) call self%grids(k)%take_even(self%grids(k - 1), self%values)
         end do
         call combine(self%model, self%values(self%first_shared():), MPI_MAX)
         self%values(2::3) = self%values(1::3)
         self%values(3::3) = self%values(1::3)
         self%inverse = self%values
         self%share = 0.0_wp
         do k = 0, ubound(self%grids, 1) - 1
            associate (a => self%grids(k)%from, z => self%grids(k)%to)
               call prolong_from(self%grids(k + 1), self%grids(k), &
                                 self%values(self%grids(k + 1)%from:self%grids(k + 1)%to), self%share(a:z))
            end associate
         end do
         where (self%share > 0.0_wp .and. self%inverse > 0.0_wp)
            self%share = 1.0_wp/self%share
         elsewhere
            self%share = 0.0_wp
         end where
      end associate
   end subroutine find_shares

   !> Nodes of a grid with all components fixed exist.
   pure subroutine mark_held(finest, grid, stride, values)
      type(grid_level_t), intent(in) :: finest
      type(lattice_t), intent(in) :: grid
      integer, intent(in) :: stride !< nodes of the finest level from one of the grid to the next
      real(wp), intent(inout) :: values(:)
      integer :: n
      do n = grid%first, grid%last
         if (all(held_components(finest, stride_to(grid, n, stride)))) values(3*n - 2) = 1.0_wp
      end do
   end subroutine mark_held

   !> Coordinates on the finest level of a node of a grid.
   pure function stride_to(grid, n, stride) result(node)
      type(lattice_t), intent(in) :: grid
      integer, intent(in) :: n, stride
      integer :: node(3)
      node = grid%node(n)
      where (grid%halves) node = stride*node
   end function stride_to

   !> Collective: compute the diagonals, including the points pressed at present: K of a node of the next grid
   !> is a quarter of the sum it represents, as the stiffness of hat functions grows with their width, not
   !> with their volume. Masses and points resist uniform motion, and count fully.
   subroutine renew(self, system)
      class(coarse_grids_t), intent(inout) :: self
      type(static_system_t), intent(inout) :: system
      real(wp), dimension(size(self%values)) :: soft, stiff, more
      real(wp) :: soft_own(system%nodal), stiff_own(system%size())
      integer :: k, n
      call self%model%timers%enter(self%row)
      self%diagonal = system%diagonal
      call resist_even(system, stiff_own)
      soft_own = system%bare(:system%nodal)
      if (system%inertia%acts) then
         soft_own = max(0.0_wp, soft_own - system%inertia%stiffness(:system%nodal))
         stiff_own = stiff_own + system%inertia%stiffness
      end if
      soft = 0.0_wp
      stiff = 0.0_wp
      more = 0.0_wp
      do n = 1, system%nodal
         soft(self%slot(n)) = soft_own(n)
         stiff(self%slot(n)) = stiff_own(n)
         more(self%slot(n)) = max(0.0_wp, system%diagonal(n) - soft_own(n))
      end do
      do k = 1, ubound(self%grids, 1)
         associate (a => self%grids(k)%from, z => self%grids(k)%to)
            call self%pass_on(k, half, thinner, soft(:a - 1), soft(a:z))
            call self%pass_on(k, half**2, 1.0_wp, stiff, more(a:z))
            call self%pass_on(k, half, 1.0_wp, stiff(:a - 1), stiff(a:z))
         end associate
      end do
      self%inverse = more + soft
      call combine(self%model, self%inverse(self%first_shared():), MPI_SUM)
      do k = 1, ubound(self%grids, 1)
         associate (grid => self%grids(k))
            do n = grid%first, grid%last
               associate (own => self%inverse(3*n - 2:3*n))
                  where (.not. own > 0.0_wp .or. held_near(self%model%levels(size(self%model%levels))%grid, &
                                                           stride_to(grid, n, 2**k), 2**k))
                     own = 0.0_wp
                  elsewhere
                     own = 1.0_wp/own
                  end where
               end associate
            end do
         end associate
      end do
   end subroutine renew

   !> Collective: resistance of pressed points to uniform motion, by node, N/m.
   subroutine resist_even(system, values)
      type(static_system_t), intent(inout) :: system
      real(wp), intent(out) :: values(:)
      integer :: n
      associate (finest => system%levels(size(system%levels)))
         do n = 1, size(system%levels)
            call system%levels(n)%clear_forces()
         end do
         call system%contact%add_diagonal(finest%forces, 1)
         call system%contact%pairs%give(finest%forces)
         values = 0.0_wp
         call collect(system%levels, system%model, even, values)
      end associate
   end subroutine resist_even

   !> Fixed components of a grid's node: nearer than its stride to a side that fixes them.
   pure function held_near(finest, node, stride) result(held)
      type(grid_level_t), intent(in) :: finest
      integer, intent(in) :: node(3), stride
      logical :: held(3)
      integer :: axis, beyond, side
      held = .false.
      held(2) = finest%section%is_flat()
      do axis = 1, 3
         do side = 1, 2
            if (finest%boundary(side, axis) == boundary_free) cycle
            beyond = merge(-node(axis), node(axis) - finest%cells(axis), side == 1)
            if (beyond <= -stride) cycle
            held(axis) = .true.
            if (finest%boundary(side, axis) == boundary_fixed) held = .true.
         end do
      end do
   end function held_near

   !> Add the restricted values of the finer grids to grid k, from this rank's part.
   subroutine pass_on(self, k, beside, factor, from, to)
      class(coarse_grids_t), intent(in) :: self
      integer, intent(in) :: k
      real(wp), intent(in) :: beside, factor
      real(wp), intent(in), contiguous :: from(:)  !< of the finer grids
      real(wp), intent(inout), contiguous :: to(:) !< of grid k
      real(wp), allocatable :: shares(:)
      associate (finer => self%grids(k - 1))
         shares = self%share(finer%from:finer%to)
         if (beside < half) shares = shares**2
         shares = factor*shares*from(finer%from:finer%to)
         call restrict_to(self%grids(k), finer, beside, shares, to)
      end associate
   end subroutine pass_on

   !> Collective: reduce the values of the shared grids over the ranks.
   subroutine combine(model, values, how)
      type(model_t), intent(in) :: model
      real(wp), intent(inout), contiguous :: values(:)
      type(MPI_Op), intent(in) :: how
      if (model%communicator%ranks == 1) return
      call MPI_Allreduce(MPI_IN_PLACE, values, size(values), MPI_DOUBLE_PRECISION, how, &
                         model%communicator%comm)
   end subroutine combine

   !> Index of the first value shared by all ranks.
   pure integer function first_shared(self)
      class(coarse_grids_t), intent(in) :: self
      first_shared = self%grids(0)%to + 1
   end function first_shared

   !> Collective: the sum of all grids' corrections.
   subroutine apply(self, from, to)
      class(coarse_grids_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: from(:)
      real(wp), intent(out), contiguous :: to(:)
      integer :: k, n
      to = from/self%diagonal
      if (self%diagonal_alone) return
      call self%model%timers%enter(self%row)
      self%values = 0.0_wp
      do n = 1, size(self%slot)
         self%values(self%slot(n)) = from(n)
      end do
      do k = 1, ubound(self%grids, 1)
         associate (a => self%grids(k)%from, z => self%grids(k)%to)
            call self%pass_on(k, half, 1.0_wp, self%values(:a - 1), self%values(a:z))
         end associate
      end do
      associate (first => self%first_shared())
         call combine(self%model, self%values(first:), MPI_SUM)
         self%values(:first - 1) = 0.0_wp
         self%values(first:) = self%inverse(first:)*self%values(first:)
      end associate
      do k = ubound(self%grids, 1) - 1, 0, -1
         associate (a => self%grids(k)%from, z => self%grids(k)%to)
            call prolong_from(self%grids(k + 1), self%grids(k), &
                              self%values(self%grids(k + 1)%from:self%grids(k + 1)%to), self%values(a:z), &
                              self%share(a:z))
         end associate
      end do
      do n = 1, size(self%slot)
         to(n) = to(n) + self%values(self%slot(n))
      end do
   end subroutine apply

end module m_coarse_grids
