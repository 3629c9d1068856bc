!> Regions of nested levels, the split of a particle into eight, and the particles that bodies begin with on
!> several levels.
program regions
   use m_kinds, only: wp, i8
   use m_constants, only: block_size
   use m_communicator, only: communicator_t
   use m_box, only: box_t
   use m_cylinder, only: cylinder_t
   use m_sphere, only: sphere_t
   use m_scene, only: grid_spec_t, body_spec_t
   use m_grid_level, only: grid_level_t, make_grid_level
   use m_region, only: region_t, make_region
   use m_region_forms, only: check_forms, check_outlines
   use m_block, only: block_t
   use m_level, only: level_t
   use m_body, only: fill_block, count_in_block
   use m_field_table, only: field_table_t, layout_t, shares_t
   use m_half_edges, only: half_edges, extents
   use m_split, only: split_in_eight, must_split
   use m_sorting, only: sorted_order
   use m_assertions, only: assertions_t
   use m_chance, only: chance_t, keep_worst
   implicit none
   real(wp), parameter :: cell = 0.1_wp, density = 7.0_wp
   type(communicator_t) :: comm
   type(assertions_t) :: test
   type(chance_t) :: chance
   integer :: n, shape, per_edge
   call comm%start()
   call test%start(comm, 'regions')
   do n = 1, 40
      call one_region()
   end do
   call open_sides()
   call check_forms(test, chance)
   call check_outlines(test)
   do n = 1, 50
      call eight('corners', affine=.true.)
      call eight('stretch', affine=.true.)
      call eight('fixed', affine=.false.)
   end do
   do shape = 1, 3
      do per_edge = 1, 3
         do n = 1, 3 ! levels
            call births(shape, per_edge**3, n)
         end do
      end do
   end do
   call test%finish()

contains

   integer function dice(low, high)
      integer, intent(in) :: low, high
      dice = min(high, low + int(chance%between(0.0_wp, real(high - low + 1, wp))))
   end function dice

   !> Inner nodes, places inside, and boxes that reach in or keep clear, against their definitions.
   subroutine one_region()
      type(grid_level_t) :: grid
      type(region_t) :: region
      integer :: low(3), high(3), node(3), axis, trial
      real(wp) :: a(3), z(3), x(3), edge(2, 3), width
      real(wp) :: near
      logical :: inner, reaches, inside, clear
      grid = make_grid_level(grid_spec_t(lower=[-0.3_wp, 0.2_wp, 0.0_wp], upper=[1.7_wp, 2.2_wp, 2.0_wp], &
                                         cell_size=cell, cells=[20, 20, 20]), 2)
      do axis = 1, 3
         low(axis) = 2*dice(0, 8)
         high(axis) = low(axis) + 2*dice(4, 12)
         if (high(axis) > 40) high(axis) = 40
      end do
      region = make_region(grid, low, high)
      edge(1, :) = grid%lower + low*grid%cell
      edge(2, :) = grid%lower + high*grid%cell
      where (low == 0) edge(1, :) = -1.0e9_wp
      where (high == 40) edge(2, :) = 1.0e9_wp
      do trial = 1, 200
         do axis = 1, 3
            node(axis) = dice(-1, 41)
            x(axis) = chance%between(-0.4_wp, 2.3_wp)
         end do
         inner = .true.
         do axis = 1, 3
            if (low(axis) > 0 .and. node(axis) <= low(axis)) inner = .false.
            if (high(axis) < 40 .and. node(axis) >= high(axis)) inner = .false.
         end do
         call test%check(region%is_inner(node) .eqv. inner, 'inner nodes')
         inside = all(x > edge(1, :) .and. x < edge(2, :))
         call test%check(region%holds(x) .eqv. inside, 'places inside')
         a = x - chance%several(3, 0.0_wp, 0.3_wp)
         z = x + chance%several(3, 0.0_wp, 0.3_wp)
         near = 0.25_wp*grid%cell ! what comes nearer than a quarter of a cell reaches in
         reaches = all(z > edge(1, :) - near .and. a < edge(2, :) + near)
         call test%check(region%overlaps(a, z) .eqv. reaches, 'boxes that reach in')
         width = chance%between(0.0_wp, 0.2_wp)
         clear = any(z <= edge(1, :) - width .or. a >= edge(2, :) + width) .or. &
                 all(a >= edge(1, :) + width .and. z <= edge(2, :) - width)
         call test%check(region%clear_of_edge(a, z, width) .eqv. clear, 'boxes clear of the edge')
         if (clear .and. width > near) &
            call test%check(region%overlaps(a, z) .eqv. region%holds(0.5_wp*(a + z)), &
                                                            'a box that is clear is all inside or all '// &
                                                            'outside')
      end do
      x = 0.5_wp*(edge(1, :) + edge(2, :))
      do axis = 1, 3
         if (low(axis) == 0) cycle
         a = x
         z = x
         a(axis) = edge(1, axis) - 0.05_wp
         z(axis) = edge(1, axis)
         z(axis) = edge(1, axis) - 0.24_wp*grid%cell
         call test%check(region%overlaps(a, z), 'a box near the edge reaches in')
         z(axis) = edge(1, axis) - 0.26_wp*grid%cell
         call test%check(.not. region%overlaps(a, z), 'a box further away does not')
      end do
   end subroutine one_region

   !> A region that fills the grid has no edge: all nodes are inner, those beyond the sides too.
   subroutine open_sides()
      type(grid_level_t) :: grid
      type(region_t) :: region, everything
      integer :: node(3), trial, axis
      grid = make_grid_level(grid_spec_t(upper=cell*[8, 8, 8], cell_size=cell, cells=[8, 8, 8]), 2)
      region = make_region(grid, [0, 0, 0], [16, 16, 16])
      do trial = 1, 100
         do axis = 1, 3
            node(axis) = dice(-2, 18)
         end do
         call test%check(region%is_inner(node) .and. everything%is_inner(node), &
                         'without edges all nodes are inner')
         call test%check(region%holds(node*grid%cell) .and. everything%holds(node*grid%cell), &
                         'without edges all places are inside')
      end do
      region = make_region(grid, [0, 4, 4], [8, 12, 16])
      call test%check(region%is_inner([-1, 5, 17]), 'open sides: beyond the grid')
      call test%check(region%is_inner([0, 5, 16]), 'open sides: on the side of the grid')
      call test%check(.not. region%is_inner([8, 5, 16]), 'open sides: an edge across')
      call test%check(.not. region%is_inner([0, 4, 16]), 'open sides: an edge along')
   end subroutine open_sides

   pure function cross(a, b) result(c)
      real(wp), intent(in) :: a(3), b(3)
      real(wp) :: c(3)
      c = [a(2)*b(3) - a(3)*b(2), a(3)*b(1) - a(1)*b(3), a(1)*b(2) - a(2)*b(1)]
   end function cross

   subroutine declare(table, domain, affine)
      type(field_table_t), intent(inout) :: table
      character(len=*), intent(in) :: domain
      logical, intent(in) :: affine
      call table%declare('position', 3, 'm', .true.)
      call table%declare('velocity', 3, 'm/s', .true.)
      call table%declare('mass', 1, 'kg', .true., extensive=.true.)
      call table%declare('volume', 1, 'm3', .true., extensive=.true.)
      call table%declare('energy', 1, 'J', .true., extensive=.true.)
      select case (domain)
      case ('corners'); call table%declare('domain', 9, 'm', .true.)
      case ('stretch'); call table%declare('half_size', 3, 'm', .true.)
      case default; call table%declare('half_size', 1, 'm', .true.)
      end select
      call table%declare('generation', 1, '1', .false.)
      call table%declare('refinement', 1, '1', .false.)
      call table%declare('stress', 6, 'Pa', .true.)
      call table%declare('strain', 1, '1', .true.)
      if (affine) call table%declare('velocity_gradient', 9, '1/s', .false.)
   end subroutine declare

   !> What the eight parts of any particle have together, and where they are.
   subroutine eight(domain, affine)
      character(len=*), intent(in) :: domain
      logical, intent(in) :: affine
      type(field_table_t) :: table
      type(layout_t) :: at
      real(wp), allocatable :: values(:), parts(:, :)
      type(shares_t) :: shares
      real(wp) :: l(3, 3), r(3, 3), part(3, 3), sums(9), momentum(3), center(3), turn(3), off(3), m
      integer :: p, k, seen(0:7), octant
      call declare(table, domain, affine)
      at = table%layout()
      shares = table%shares()
      values = chance%several(table%columns, 0.1_wp, 1.0_wp)
      if (domain == 'corners') values(at%domain:at%domain + 8) = chance%several(9, -0.1_wp, 0.1_wp) &
                                                                 + reshape([1, 0, 0, 0, 1, 0, 0, 0, 1], [9]) &
                                                                 *0.4_wp
      values(at%generation) = 3.0_wp
      values(at%refinement) = 1.0_wp
      l = 0.0_wp
      if (affine) l = reshape(values(at%gradient:at%gradient + 8), [3, 3])
      r = half_edges(values, at)
      allocate (parts(table%columns, 8))
      call split_in_eight(values, at, shares, parts)
      sums = 0.0_wp
      momentum = 0.0_wp
      center = 0.0_wp
      turn = 0.0_wp
      seen = 0
      do p = 1, 8
         associate (x => parts(at%position:at%position + 2, p), v => parts(at%velocity:at%velocity + 2, p))
            m = parts(at%mass, p)
            sums(1:2) = sums(1:2) + [m, parts(at%volume, p)]
            sums(3) = sums(3) + parts(table%column('energy'), p)
            call test%check_close(m, 0.125_wp*values(at%mass), 0.0_wp, &
                                  'eight: an eighth of the mass, to the bit')
            momentum = momentum + m*v
            center = center + m*x
            turn = turn + m*cross(x, v)
            part = half_edges(parts(:, p), at)
            do k = 1, 3
               turn = turn + m/3.0_wp*cross(part(:, k), matmul(l, part(:, k)))
            end do
            call test%check_close(reshape(part, [9]), reshape(0.5_wp*r, [9]), 1.0e-15_wp, 'eight: half edges')
            call test%check_close(v, values(at%velocity:at%velocity + 2) &
                                  + matmul(l, x - values(at%position:at%position + 2)), &
                                  1.0e-14_wp, 'eight: the linear field of velocities')
            off = solve(part, x - values(at%position:at%position + 2))
            call test%check_close(abs(off), [1.0_wp, 1.0_wp, 1.0_wp], 1.0e-12_wp, &
                                  'eight: centres in the middle of their parts')
            octant = sum(merge([1, 2, 4], 0, off > 0.0_wp))
            seen(octant) = seen(octant) + 1
            call test%check_close(parts(at%stress:at%stress + 5, p), values(at%stress:at%stress + 5), &
                                  0.0_wp, 'eight: stress')
            call test%check_close(parts(table%column('strain'), p), values(table%column('strain')), 0.0_wp, &
                                  'eight: strain')
            call test%check_close(parts(at%generation, p), 6.0_wp, 0.0_wp, 'eight: generation')
            call test%check_close(parts(at%refinement, p), 2.0_wp, 0.0_wp, 'eight: refinement')
            if (affine) &
               call test%check_close(parts(at%gradient:at%gradient + 8, p), &
                                     values(at%gradient:at%gradient + 8), 0.0_wp, 'eight: gradient')
         end associate
      end do
      call test%check(all(seen == 1), 'eight: one part in every octant')
      call test%check_close(sums(1:3), [values(at%mass), values(at%volume), values(table%column('energy'))], &
                            1.0e-15_wp, 'eight: mass, volume and what is extensive')
      call test%check_close(momentum, values(at%mass)*values(at%velocity:at%velocity + 2), 1.0e-15_wp, &
                            'eight: momentum')
      call test%check_close(center, values(at%mass)*values(at%position:at%position + 2), 1.0e-15_wp, &
                            'eight: centre of mass')
      m = values(at%mass)
      turn = turn - m*cross(values(at%position:at%position + 2), values(at%velocity:at%velocity + 2))
      do k = 1, 3
         turn = turn - m/3.0_wp*cross(r(:, k), matmul(l, r(:, k)))
      end do
      call test%check_close(turn, [0.0_wp, 0.0_wp, 0.0_wp], 1.0e-14_wp, &
                            'eight: angular momentum with that within domains')
   end subroutine eight

   !> a^-1 b
   pure function solve(a, b) result(x)
      real(wp), intent(in) :: a(3, 3), b(3)
      real(wp) :: x(3), d
      d = dot_product(a(:, 1), cross(a(:, 2), a(:, 3)))
      x = [dot_product(b, cross(a(:, 2), a(:, 3))), dot_product(a(:, 1), cross(b, a(:, 3))), &
           dot_product(a(:, 1), cross(a(:, 2), b))]/d
   end function solve

   !> Every place of a body's lattice is there once: on one level whole, on several as far as the centres of
   !> its parts are inside.
   subroutine births(shape, per_cell, levels_wanted)
      integer, intent(in) :: shape, per_cell, levels_wanted
      type(level_t) :: levels(levels_wanted), one(1)
      type(grid_spec_t) :: spec
      type(body_spec_t) :: body
      real(wp), allocatable :: volume(:)
      integer(i8), allocatable :: id(:)
      real(wp) :: spacing, lower(3), centre(3)
      integer :: l, split, wrong(4), n
      spec = grid_spec_t(lower=[0.0_wp, -0.3_wp, 0.1_wp], upper=[2.0_wp, 1.7_wp, 2.1_wp], cell_size=cell, &
                         cells=[20, 20, 20])
      body%name = 'body'
      body%material = 1
      centre = spec%lower + chance%several(3, 0.9_wp, 1.1_wp)
      lower = spec%lower + chance%several(3, 0.1_wp, 0.6_wp)
      if (chance%between(0.0_wp, 1.0_wp) < 0.4_wp) lower = spec%lower + 0.4_wp ! on the lattice of the grid
      select case (shape)
      case (1); body%shape = box_t(lower=lower, upper=spec%lower + chance%several(3, 1.2_wp, 1.9_wp))
      case (2); body%shape = sphere_t(center=centre, radius=chance%between(0.3_wp, 0.7_wp))
      case (3); body%shape = cylinder_t(center=centre, radius=chance%between(0.3_wp, 0.7_wp), &
                                        height=chance%between(0.3_wp, 0.7_wp), axis=[0.6_wp, 0.0_wp, 0.8_wp])
      end select
      body%particles_per_cell = per_cell
      do l = 1, levels_wanted
         levels(l)%number = l
         levels(l)%grid = make_grid_level(spec, l)
         call declare_all(levels(l))
      end do
      one(1) = levels(1)
      if (levels_wanted > 1) levels(2)%region = make_region(levels(2)%grid, 2*[4, 6, 0], 2*[16, 14, 12])
      if (levels_wanted > 2) levels(3)%region = make_region(levels(3)%grid, 4*[6, 8, 0], 4*[12, 12, 8])
      spacing = cell/nint(real(per_cell, wp)**(1.0_wp/3.0_wp))
      call collect(one, body, id, volume, wrong, split)
      n = size(id)
      call test%check(n > 30, 'births: particles')
      call test%check_equal(count(wrong /= 0), 0, 'births: one level')
      call test%check(all(abs(volume - spacing**3) < 1.0e-12_wp*spacing**3), 'births: volumes on one level')
      call collect(levels, body, id, volume, wrong, split)
      call test%check_equal(wrong(1), 0, &
                            'births: every particle lives on the finest level that its domain reaches')
      call test%check_equal(wrong(2), 0, &
                            'births: what lives on a level has been split, where its centre is inside')
      call test%check_equal(wrong(3), 0, &
                            'births: every particle is inside the shape, in the block of its nearest node')
      call test%check_equal(wrong(4), 0, 'births: as many are counted as are made')
      if (levels_wanted > 1) call test%check(split > 0, 'births: some are split')
      call once(id, volume, n, spacing, levels_wanted == 1)
      call test%check(abs(sum(volume)/body%shape%volume() - 1.0_wp) < 0.08_wp, 'births: volume of the shape')
   end subroutine births

   subroutine declare_all(level)
      type(level_t), intent(inout) :: level
      call declare(level%table, 'fixed', .true.)
      level%layout = level%table%layout()
   end subroutine declare_all

   !> All particles that a body has on all levels, and those that are not as they should be.
   subroutine collect(levels, body, id, volume, wrong, split)
      type(level_t), intent(in) :: levels(:)
      type(body_spec_t), intent(in) :: body
      integer(i8), allocatable, intent(out) :: id(:)
      real(wp), allocatable, intent(out) :: volume(:)
      integer, intent(out) :: wrong(4), split
      integer(i8), parameter :: base = 3000000000000_i8
      real(wp) :: x(3), half
      integer :: l, f, b, p, finest, place(3), n, deep
      allocate (id(0), volume(0))
      wrong = 0
      split = 0
      do l = 1, size(levels)
         do b = 1, product(levels(l)%grid%blocks)
            place = levels(l)%grid%block_place(b)
            block
               type(block_t) :: one
               one%place = place
               call one%reserve(1, levels(l)%table%columns)
               call fill_block(levels, l, one, body, 4, density, base)
               n = one%particles%count
               if (count_in_block(levels, l, place, body) /= n) wrong(4) = wrong(4) + 1
               if (n > 0) then
                  id = [id, one%particles%id(:n) - base]
                  volume = [volume, one%particles%column(:n, levels(l)%layout%volume)]
               end if
               do p = 1, n
                  associate (at => levels(l)%layout, column => one%particles%column)
                     x = column(p, at%position:at%position + 2)
                     half = column(p, at%half_size)
                     if (abs(column(p, at%mass) - density*column(p, at%volume)) > 1.0e-15_wp) &
                        wrong(3) = wrong(3) + 1
                     if (abs((2.0_wp*half)**3 - column(p, at%volume)) > 1.0e-15_wp) wrong(3) = wrong(3) + 1
                     if (any(levels(l)%grid%nearest_node(x)/block_size /= place)) wrong(3) = wrong(3) + 1
                     if (.not. body%shape%inside(x)) wrong(3) = wrong(3) + 1
                     finest = 1
                     do f = 2, size(levels)
                        if (levels(f)%region%overlaps(x - half, x + half)) finest = f
                     end do
                     if (finest /= l) wrong(1) = wrong(1) + 1
                     if (half > 0.525_wp*levels(l)%grid%cell) wrong(2) = wrong(2) + 1
                     deep = 0
                     do f = 2, size(levels)
                        if (levels(f)%region%holds(x)) deep = deep + 1
                     end do
                     if (nint(column(p, at%refinement)) < deep) wrong(2) = wrong(2) + 1
                     if (nint(column(p, at%generation)) /= 3*nint(column(p, at%refinement))) &
                        wrong(2) = wrong(2) + 1
                     if (nint(column(p, at%refinement)) > 0) split = split + 1
                  end associate
               end do
            end block
         end do
      end do
   end subroutine collect

   !> Ids are unique, and the parts of each of n places of the lattice are together one place's volume.
   subroutine once(id, volume, n, spacing, whole)
      integer(i8), intent(in) :: id(:)
      real(wp), intent(in) :: volume(:), spacing
      integer, intent(in) :: n
      logical, intent(in) :: whole !< no place has parts
      type(layout_t) :: no_layout
      integer, allocatable :: order(:)
      integer(i8), allocatable :: root(:)
      integer(i8) :: last
      integer :: p, places
      real(wp) :: most, sum_here, worst
      order = sorted_order(id, id)
      call test%check(all(id(order(2:)) > id(order(:size(id) - 1))), 'births: no id twice')
      root = iand(id, ishft(1_i8, no_layout%id_bits) - 1)
      order = sorted_order(root, id)
      places = 0
      worst = 0.0_wp
      most = 0.0_wp
      sum_here = 0.0_wp
      last = -1
      do p = 1, size(id)
         if (root(order(p)) /= last) then
            if (places > 0) call keep_worst(worst, sum_here/spacing**3 - 1.0_wp)
            places = places + 1
            sum_here = 0.0_wp
            last = root(order(p))
         end if
         sum_here = sum_here + volume(order(p))
         most = max(most, sum_here/spacing**3)
      end do
      call keep_worst(worst, sum_here/spacing**3 - 1.0_wp)
      if (.not. whole) then
         call test%check(most < 1.0_wp + 1.0e-12_wp, 'births: no place has more than its volume')
         return
      end if
      call test%check_equal(places, n, 'births: as many places of the lattice as on one level')
      call test%check_close(worst, 0.0_wp, 1.0e-12_wp, 'births: each of them is there once')
      call test%check_close(sum(volume)*density, n*density*spacing**3, 1.0e-11_wp*n*density*spacing**3, &
                            'births: mass')
   end subroutine once

end program regions
