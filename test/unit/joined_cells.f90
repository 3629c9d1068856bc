!> The cells of anti-locking at an edge of levels, and on which of two levels a particle lives where they are
!> there.
program joined_cells
   use m_kinds, only: wp
   use m_constants, only: block_size
   use m_communicator, only: communicator_t
   use m_scene, only: grid_spec_t
   use m_grid_level, only: grid_level_t, make_grid_level
   use m_region, only: region_t, make_region
   use m_level, only: level_t
   use m_joined_cells, only: join_cells
   use m_membership, only: set_layers, lives_on
   use m_assertions, only: assertions_t
   use m_chance, only: chance_t
   implicit none
   integer, parameter :: n = 12, width = block_size + 2, none = -7 !< cells of the coarser grid; of a tile
   real(wp), parameter :: cell = 0.1_wp
   type(communicator_t) :: comm
   type(assertions_t) :: test
   type(chance_t) :: chance
   integer :: trial
   call comm%start()
   call test%start(comm, 'joined_cells')
   do trial = 1, 8
      call one_box()
      call any_form()
      call homes()
   end do
   call test%finish()

contains

   integer function dice(low, high)
      integer, intent(in) :: low, high
      dice = min(high, low + int(chance%between(0.0_wp, real(high - low + 1, wp))))
   end function dice

   !> Two levels, with blocks everywhere on the finer one.
   subroutine build(levels, low, chosen)
      type(level_t), allocatable, intent(out) :: levels(:)
      integer, intent(in) :: low(3)
      logical, intent(in) :: chosen(:, :, :)
      type(grid_spec_t) :: spec
      integer :: b, l
      spec = grid_spec_t(lower=[-0.3_wp, 0.2_wp, 0.0_wp], upper=[-0.3_wp, 0.2_wp, 0.0_wp] + n*cell, &
                         cell_size=cell, cells=[n, n, n])
      allocate (levels(2))
      do l = 1, 2
         levels(l)%number = l
         levels(l)%grid = make_grid_level(spec, l)
      end do
      levels(2)%region = make_region(levels(2)%grid, 2*low, chosen)
      allocate (levels(2)%blocks(levels(2)%grid%block_count()))
      do b = 1, size(levels(2)%blocks)
         levels(2)%blocks(b)%index = b
         levels(2)%blocks(b)%place = levels(2)%grid%block_place(b)
         allocate (levels(2)%blocks(b)%cells)
      end do
      call set_layers(levels, .true.)
      call join_cells(levels(2))
   end subroutine build

   !> Where the cells of the finer level stand, by the node of its grid; the same from all blocks that reach a
   !> cell, at nodes of their tiles.
   subroutine collect(levels, name, node)
      type(level_t), intent(in) :: levels(:)
      character(len=*), intent(in) :: name
      integer, intent(out) :: node(3, 0:2*n - 1, 0:2*n - 1, 0:2*n - 1)
      integer :: at(3), b, c(3), i, j, k, place
      logical :: same
      node = none
      same = .true.
      do b = 1, size(levels(2)%blocks)
         associate (block => levels(2)%blocks(b))
            do k = 0, width - 2
               do j = 0, width - 2
                  do i = 0, width - 2
                     c = block_size*block%place + [i, j, k] - 1
                     if (any(c < 0 .or. c >= 2*n)) cycle
                     place = i + width*(j + width*k)
                     if (allocated(block%cells%standing)) place = block%cells%standing(place)
                     at = -1
                     if (place >= 0) at = block_size*block%place - 1 &
                                          + [mod(place, width), mod(place/width, width), place/width**2]
                     if (node(1, c(1), c(2), c(3)) == none) then
                        node(:, c(1), c(2), c(3)) = at
                     else
                        same = same .and. all(node(:, c(1), c(2), c(3)) == at)
                     end if
                  end do
               end do
            end do
         end associate
      end do
      call test%check(same, name//': all blocks say the same of a cell')
      call test%check(all(node > none), name//': all cells')
   end subroutine collect

   !> A box, at sides of the grid or not: the cells that stand together are those that the rule by distances
   !> makes one (theory.md), and no others; those far outside stand nowhere.
   subroutine one_box()
      type(level_t), allocatable :: levels(:)
      integer :: node(3, 0:2*n - 1, 0:2*n - 1, 0:2*n - 1)
      integer :: low(3), high(3), axis, i, j, k, wrong
      logical, allocatable :: chosen(:, :, :)
      do axis = 1, 3
         low(axis) = dice(0, 6)
         high(axis) = min(n, low(axis) + dice(2, 6))
      end do
      allocate (chosen(high(1) - low(1), high(2) - low(2), high(3) - low(3)), source=.true.)
      call build(levels, low, chosen)
      call collect(levels, 'box', node)
      wrong = 0
      do k = 0, 2*n - 1
         do j = 0, 2*n - 1
            do i = 0, 2*n - 1
               if (.not. all(node(:, i, j, k) == standing_of([i, j, k], low, high))) wrong = wrong + 1
            end do
         end do
      end do
      call test%check(wrong == 0, 'box: the cells of the rule by distances')
   end subroutine one_box

   !> By the distances (in fine cells) of the middle of a cell from the faces of a box that are edges.
   pure function standing_of(c, low, high) result(node)
      integer, intent(in) :: c(3), low(3), high(3) !< the box in coarser cells
      integer :: node(3), axis
      real(wp) :: x(3), d(3), outside(3)
      logical :: along(3)
      x = c + 0.5_wp
      d = huge(1.0_wp)
      outside = 0.0_wp
      do axis = 1, 3
         if (low(axis) > 0) d(axis) = x(axis) - 2*low(axis)
         if (high(axis) < n) d(axis) = min(d(axis), 2*high(axis) - x(axis))
         outside(axis) = max(0.0_wp, -d(axis))
      end do
      node = -1
      if (any(outside > 2.0_wp)) return
      do axis = 1, 3
         along(axis) = any(outside > 0.0_wp) .or. count(d < 2.0_wp) >= 2 &
                       .or. any(d < 1.0_wp .and. [1, 2, 3] /= axis)
      end do
      node = merge(2*(c/2) + 1, c, along)
   end function standing_of

   !> Cells chosen at random: none stands with one of another coarser cell, those outside with all of theirs,
   !> and each of the places is that of one cell or a block of joined ones.
   subroutine any_form()
      type(level_t), allocatable :: levels(:)
      integer :: node(3, 0:2*n - 1, 0:2*n - 1, 0:2*n - 1)
      integer :: owner(3, 0:2*n, 0:2*n, 0:2*n), first(3, 0:2*n, 0:2*n, 0:2*n), last(3, 0:2*n, 0:2*n, 0:2*n)
      integer :: members(0:2*n, 0:2*n, 0:2*n)
      logical :: chosen(n, n, n), apart, whole, filled
      integer :: i, j, k, c(3)
      do k = 1, n
         do j = 1, n
            do i = 1, n
               chosen(i, j, k) = chance%between(0.0_wp, 1.0_wp) < 0.7_wp
            end do
         end do
      end do
      call build(levels, [0, 0, 0], chosen)
      call collect(levels, 'any form', node)
      owner = -1
      first = huge(1)
      last = -1
      members = 0
      apart = .true.
      whole = .true.
      do k = 0, 2*n - 1
         do j = 0, 2*n - 1
            do i = 0, 2*n - 1
               associate (at => node(:, i, j, k))
                  c = [i, j, k]
                  if (at(1) < 0) then
                     apart = apart .and. &
                             .not. any(chosen(max(1, i/2):min(n, i/2 + 2), max(1, j/2):min(n, j/2 &
                                                          + 2), max(1, k/2):min(n, k/2 + 2)))
                     cycle
                  end if
                  if (owner(1, at(1), at(2), at(3)) < 0) owner(:, at(1), at(2), at(3)) = c/2
                  apart = apart .and. all(owner(:, at(1), at(2), at(3)) == c/2)
                  if (.not. chosen(i/2 + 1, j/2 + 1, k/2 + 1)) whole = whole .and. all(at == 2*(c/2) + 1)
                  first(:, at(1), at(2), at(3)) = min(first(:, at(1), at(2), at(3)), c)
                  last(:, at(1), at(2), at(3)) = max(last(:, at(1), at(2), at(3)), c)
                  members(at(1), at(2), at(3)) = members(at(1), at(2), at(3)) + 1
               end associate
            end do
         end do
      end do
      filled = .true.
      do k = 0, 2*n
         do j = 0, 2*n
            do i = 0, 2*n
               if (members(i, j, k) > 0) filled = filled .and. &
                  members(i, j, k) == product(last(:, i, j, k) - first(:, i, j, k) + 1)
            end do
         end do
      end do
      call test%check(apart, 'any form: no cell stands with one of another coarser cell')
      call test%check(whole, 'any form: outside, whole coarser cells')
      call test%check(filled, 'any form: what stands together is a box')
   end subroutine any_form

   !> Small particles in the layer of coarser cells around a region live on the finer level, those beyond do
   !> not, nor do large ones that do not reach the region.
   subroutine homes()
      type(level_t), allocatable :: levels(:)
      real(wp) :: x(3), off, half
      integer :: t
      logical :: lives
      call build(levels, [4, 4, 4], reshape([(.true., t=1, 64)], [4, 4, 4]))
      do t = 1, 100
         x = chance%several(3, 0.0_wp, 1.2_wp)
         off = maxval(max(0.0_wp, 0.4_wp - x, x - 0.8_wp))/cell
         half = 0.25_wp*cell
         lives = lives_on(levels(2), levels(1)%grid%lower + x, spread(half, 1, 3), half, 0.0_wp)
         if (abs(off - 1.125_wp) > 1.0e-6_wp) call test%check(lives .eqv. off < 1.125_wp, 'small: the layer')
         half = 0.4_wp*cell
         lives = lives_on(levels(2), levels(1)%grid%lower + x, spread(half, 1, 3), half, 0.0_wp)
         if (abs(off - 0.525_wp) > 1.0e-6_wp) &
            call test%check(lives .eqv. off < 0.525_wp, 'large: what reaches in')
      end do
   end subroutine homes

end program joined_cells
