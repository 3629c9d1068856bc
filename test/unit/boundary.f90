!> Sides of the grid: a part of a mirrored set of particles on a grid that ends at symmetry planes gives the
!> node values of the whole set; rollers and fixed sides hold; what a node is said to hold is what it holds.
program boundary
   use m_kinds, only: wp
   use m_constants, only: block_size
   use m_node_values, only: node_values, tile_last
   use m_communicator, only: communicator_t
   use m_scene, only: grid_spec_t
   use m_side_kinds, only: boundary_free, boundary_symmetry, boundary_roller, boundary_fixed
   use m_grid_level, only: grid_level_t, make_grid_level
   use m_level, only: level_t
   use m_boundary, only: apply_boundary, held_components, inside
   use m_assertions, only: assertions_t
   use m_chance, only: chance_t, keep_worst, say
   use m_made_level, only: declare_usual_fields, make_level, node_state_t, all_nodes
   implicit none
   integer, parameter :: along(6) = [7, 8, 9, 15, 16, 17] !< cells: 8 k - 1, 8 k, 8 k + 1
   type(communicator_t) :: comm
   type(assertions_t) :: test
   type(chance_t) :: chance
   real(wp) :: worst(3)
   integer :: axis, side, n, cells(3), sides(3)
   call comm%start()
   call test%start(comm, 'boundary')
   worst = 0.0_wp
   do axis = 1, 3
      do side = 1, 2
         do n = 1, size(along)
            cells = 5
            cells(axis) = along(n)
            sides = 0
            sides(axis) = side
            call mirrored(cells, sides, 150)
         end do
      end do
   end do
   do n = 1, size(along) ! edges and corners of two and three planes
      cells = along([n, 1 + mod(n, 6), 1 + mod(n + 1, 6)])
      sides = 1 + [mod(n, 2), mod(n/2, 2), mod(n/4, 2)]
      call mirrored(cells, sides, 400)
      sides(1 + mod(n, 3)) = 0
      call mirrored(cells, sides, 400)
   end do
   call say('part against whole: mass and momentum, relative', worst(1))
   call say('part against whole: force, relative', worst(2))
   call say('part against whole: velocity, relative', worst(3))
   do n = 1, 200
      call held_as_said(n)
   end do
   call test%finish()

contains

   !> sides: 0 free, 1 lower, 2 upper is a symmetry plane, for each axis.
   subroutine mirrored(cells, sides, particles)
      integer, intent(in) :: cells(3), sides(3), particles
      type(level_t) :: part, whole
      type(node_state_t) :: of_part, of_whole
      type(grid_spec_t) :: spec, whole_spec
      real(wp), allocatable :: some(:, :), all(:, :)
      real(wp) :: plane(3), scale(3), share, off(3)
      integer :: images, image, p, i, j, k, a, at(3), shift(3)
      logical :: turned(3)
      spec%cell_size = 0.25_wp
      spec%lower = [1.0_wp, -3.0_wp, 0.5_wp]
      spec%cells = cells
      spec%upper = spec%lower + spec%cell_size*cells
      plane = merge(spec%upper, spec%lower, sides == 2)
      spec%boundary = boundary_free
      do a = 1, 3
         if (sides(a) > 0) spec%boundary(2*a - 2 + sides(a)) = boundary_symmetry
      end do
      whole_spec = spec
      whole_spec%boundary = boundary_free
      where (sides > 0) whole_spec%cells = 2*cells
      where (sides == 1) whole_spec%lower = spec%lower - spec%cell_size*cells
      where (sides == 2) whole_spec%upper = spec%upper + spec%cell_size*cells
      shift = merge(cells, 0, sides == 1)
      call declare_usual_fields(part, affine=.true.)
      call declare_usual_fields(whole, affine=.true.)
      images = 2**count(sides > 0)
      allocate (some(particles, part%table%columns), all(images*particles, part%table%columns))
      do p = 1, particles
         call random_particle(part, spec, plane, mod(p, 2) == 0, sides > 0, some(p, :))
      end do
      do image = 0, images - 1
         turned = which_turned(image, sides > 0)
         do p = 1, particles
            all(image*particles + p, :) = image_of(part, some(p, :), plane, turned)
         end do
      end do
      call make_level(part, spec, some)
      call make_level(whole, whole_spec, all)
      call all_nodes(part, 0.01_wp, of_part)
      call all_nodes(whole, 0.01_wp, of_whole)
      call test%check_equal(of_part%disagreements, 0, 'tiles of the part agree to the bit')
      call test%check_equal(of_whole%disagreements, 0, 'tiles of the whole agree to the bit')
      scale = [maxval(of_whole%sums(1:4, :, :, :)), maxval(abs(of_whole%sums(5:7, :, :, :))), 10.0_wp]
      off = 0.0_wp
      do k = -1, cells(3) + 1
         do j = -1, cells(2) + 1
            do i = -1, cells(1) + 1
               at = [i, j, k]
               if (.not. of_part%held(i, j, k)) cycle
               if (beyond(at, cells, sides)) cycle
               associate (here => of_part%sums(:, i, j, k), there => of_whole%sums(:, at(1) + shift(1), &
                  at(2) + shift(2), at(3) + shift(3)), v => of_part%solved(:, i, j, k), &
                          w => of_whole%solved(:, at(1) + shift(1), at(2) + shift(2), at(3) + shift(3)))
                  ! a node on a plane has half of its body on this side
                  share = 0.5_wp**count(sides > 0 .and. at == merge(cells, 0, sides == 2))
                  call keep_worst(off(1), (here(1) - share*there(1))/scale(1))
                  do a = 1, 3
                     if (sides(a) > 0 .and. at(a) == merge(cells(a), 0, sides(a) == 2)) then
                        call keep_worst(off(3), v(1 + a))
                        call keep_worst(off(3), v(4 + a))
                     else
                        call keep_worst(off(1), (here(1 + a) - share*there(1 + a))/scale(1))
                        call keep_worst(off(2), (here(4 + a) - share*there(4 + a))/scale(2))
                     end if
                     ! round-off of a sum is relative to its terms: weighed with the node's mass
                     if (there(1) > 1.0e-6_wp*scale(1)) &
                        call keep_worst(off(3), (v(1 + a) - w(1 + a))*there(1)/scale(1)/scale(3))
                  end do
               end associate
            end do
         end do
      end do
      call keep_worst(worst, off)
      call test%check_close(off, [0.0_wp, 0.0_wp, 0.0_wp], 1.0e-13_wp, &
                            'a part inside symmetry planes gives what the whole gives')
      call outside_is_image(of_part, cells, sides)
   end subroutine mirrored

   !> True for nodes outside a symmetry plane, which have nothing of their own.
   pure logical function beyond(node, cells, sides)
      integer, intent(in) :: node(3), cells(3), sides(3)
      beyond = any((sides == 1 .and. node < 0) .or. (sides == 2 .and. node > cells))
   end function beyond

   !> After the solution, the row outside holds the image of the row inside.
   subroutine outside_is_image(state, cells, sides)
      type(node_state_t), intent(in) :: state
      integer, intent(in) :: cells(3), sides(3)
      integer :: i, j, k, at(3), in(3), a
      real(wp) :: expected(7), off
      off = 0.0_wp
      do k = -1, cells(3) + 1
         do j = -1, cells(2) + 1
            do i = -1, cells(1) + 1
               at = [i, j, k]
               if (.not. beyond(at, cells, sides) .or. .not. state%held(i, j, k)) cycle
               in = at
               where (sides == 1 .and. at < 0) in = -at
               where (sides == 2 .and. at > cells) in = 2*cells - at
               if (.not. state%held(in(1), in(2), in(3))) cycle
               expected = state%solved(:7, in(1), in(2), in(3))
               do a = 1, 3
                  if (in(a) == at(a)) cycle
                  expected(1 + a) = -expected(1 + a)
                  expected(4 + a) = -expected(4 + a)
               end do
               call keep_worst(off, maxval(abs(state%solved(:7, i, j, k) - expected)))
            end do
         end do
      end do
      call test%check_close(off, 0.0_wp, 0.0_wp, &
                            'the row outside a symmetry plane is the image of the row inside')
   end subroutine outside_is_image

   !> Inside the grid; `near`: within a cell of the planes.
   subroutine random_particle(level, spec, plane, near, has_plane, values)
      type(level_t), intent(in) :: level
      type(grid_spec_t), intent(in) :: spec
      real(wp), intent(in) :: plane(3)
      logical, intent(in) :: near, has_plane(3)
      real(wp), intent(out) :: values(:)
      real(wp), parameter :: sizes(3) = [1.0_wp/6.0_wp, 0.25_wp, 0.5_wp]
      real(wp) :: x(3)
      values = chance%several(size(values), -1.0_wp, 1.0_wp)
      x = spec%lower + chance%several(3, 0.001_wp, 0.999_wp)*(spec%upper - spec%lower)
      if (near) then
         where (has_plane) x = plane + (x - plane)*(spec%cell_size/(spec%upper - spec%lower))
      end if
      associate (at => level%layout)
         values(at%position:at%position + 2) = x
         values(at%mass) = chance%between(0.5_wp, 1.0_wp)
         values(at%volume) = chance%between(0.5_wp, 1.0_wp)
         values(at%half_size) = sizes(1 + int(chance%between(0.0_wp, 3.0_wp)))*spec%cell_size
      end associate
   end subroutine random_particle

   !> Image number 0, 1, ... is turned round along these of the axes that have a plane.
   pure function which_turned(image, has_plane) result(turned)
      integer, intent(in) :: image
      logical, intent(in) :: has_plane(3)
      logical :: turned(3)
      integer :: a, bit
      turned = .false.
      bit = 0
      do a = 1, 3
         if (.not. has_plane(a)) cycle
         turned(a) = btest(image, bit)
         bit = bit + 1
      end do
   end function which_turned

   pure function image_of(level, values, plane, turned) result(image)
      type(level_t), intent(in) :: level
      real(wp), intent(in) :: values(:), plane(3)
      logical, intent(in) :: turned(3)
      real(wp) :: image(size(values)), sign(3)
      integer :: a, b
      integer, parameter :: pairs(2, 6) = reshape([1, 1, 2, 2, 3, 3, 2, 3, 1, 3, 1, 2], [2, 6])
      sign = merge(-1.0_wp, 1.0_wp, turned)
      image = values
      associate (at => level%layout)
         where (turned) image(at%position:at%position + 2) = 2.0_wp*plane &
            - values(at%position:at%position + 2)
         image(at%velocity:at%velocity + 2) = sign*values(at%velocity:at%velocity + 2)
         do a = 1, 6
            image(at%stress + a - 1) = sign(pairs(1, a))*sign(pairs(2, a))*values(at%stress + a - 1)
         end do
         do b = 1, 3
            do a = 1, 3
               image(at%gradient + 3*(b - 1) + a - 1) = sign(a)*sign(b) &
                  *values(at%gradient + 3*(b - 1) + a - 1)
            end do
         end do
      end associate
   end function image_of

   !> Random sides, a random tile: apply_boundary against held_components, and the meaning of the sides.
   subroutine held_as_said(round)
      integer, intent(in) :: round
      type(grid_spec_t) :: spec
      type(grid_level_t) :: grid
      real(wp), dimension(node_values, 0:tile_last, 0:tile_last, 0:tile_last) :: before, after
      real(wp) :: expected(node_values)
      logical :: held(3), turned(3), fixed
      integer :: place(3), i, j, k, a, node(3), image(3), at(3), wrong
      spec%lower = 0.0_wp
      spec%cell_size = 1.0_wp
      spec%cells = along([1 + mod(round, 6), 1 + mod(round/6, 6), 1 + mod(round/36 + round, 6)])
      spec%upper = spec%cells
      spec%boundary = int(chance%several(6, 0.0_wp, 4.0_wp))
      grid = make_grid_level(spec)
      place = int(chance%several(3, 0.0_wp, 1.0_wp)*grid%blocks)
      do k = 0, tile_last
         do j = 0, tile_last
            do i = 0, tile_last
               before(:, i, j, k) = chance%several(node_values, 0.5_wp, 1.0_wp)
            end do
         end do
      end do
      after = before
      call apply_boundary(grid, place, after)
      wrong = 0
      do k = 0, tile_last
         do j = 0, tile_last
            do i = 0, tile_last
               node = block_size*place + [i, j, k] - 1
               if (any(node < -1) .or. any(node > spec%cells + 1)) cycle
               held = held_components(grid, node)
               image = [(inside(grid, a, node(a)), a=1, 3)]
               turned = image /= node
               fixed = .false.
               do a = 1, 3
                  fixed = fixed .or. (spec%boundary(2*a - 1) == boundary_fixed .and. node(a) <= 0)
                  fixed = fixed .or. (spec%boundary(2*a) == boundary_fixed .and. node(a) >= spec%cells(a))
               end do
               if (fixed .and. .not. all(held)) wrong = wrong + 1
               do a = 1, 3
                  if (spec%boundary(2*a - 1) == boundary_roller .and. node(a) <= 0 .and. .not. held(a)) &
                     wrong = wrong + 1
                  if (spec%boundary(2*a) == boundary_roller .and. node(a) >= spec%cells(a) .and. &
                      .not. held(a)) wrong = wrong + 1
                  if (spec%boundary(2*a - 1) == boundary_symmetry .and. node(a) == 0 .and. .not. held(a)) &
                     wrong = wrong + 1
                  if (spec%boundary(2*a) == boundary_symmetry .and. node(a) == spec%cells(a) .and. &
                      .not. held(a)) wrong = wrong + 1
               end do
               at = image - block_size*place + 1
               if (any(at < 0) .or. any(at > tile_last)) cycle
               expected = before(:, at(1), at(2), at(3))
               do a = 1, 3
                  if (turned(a)) expected(1 + a) = -expected(1 + a)
                  if (turned(a)) expected(4 + a) = -expected(4 + a)
                  if (held(a)) expected(1 + a) = 0.0_wp
                  if (held(a)) expected(4 + a) = 0.0_wp
               end do
               if (any(abs(after(:, i, j, k) - expected) > 0.0_wp)) wrong = wrong + 1
            end do
         end do
      end do
      call test%check_equal(wrong, 0, 'nodes at the sides hold what they are said to hold')
   end subroutine held_as_said

end program boundary
