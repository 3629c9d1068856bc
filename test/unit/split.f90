!> Splitting of particles: what is kept, ids, and where it ends.
program split
   use m_kinds, only: wp, i8
   use m_communicator, only: communicator_t
   use m_block, only: block_t
   use m_level, only: level_t
   use m_half_edges, only: half_edges
   use m_split, only: stuff_t, split_long
   use m_walls, only: keep_inside
   use m_field_table, only: layout_t, shares_t
   use m_grid_level, only: grid_level_t, make_grid_level
   use m_scene, only: body_spec_t, grid_spec_t
   use m_side_kinds, only: boundary_free, boundary_symmetry
   use m_sorting, only: sorted_order
   use m_assertions, only: assertions_t
   use m_chance, only: chance_t
   use m_body, only: first_id, number_ids
   use m_box, only: box_t
   use m_constants, only: exit_input, pi
   use m_section, only: geometry_axisymmetric
   use m_errors, only: error_t
   implicit none
   real(wp), parameter :: cell = 0.3_wp
   type(stuff_t), parameter :: soft(2) = stuff_t(density=1000.0_wp, modulus=1.0e6_wp)
   type(communicator_t) :: comm
   type(assertions_t) :: test
   type(chance_t) :: chance
   call comm%start()
   call test%start(comm, 'split')
   call pieces(corners=.true., affine=.true.)
   call pieces(corners=.true., affine=.false.)
   call pieces(corners=.false., affine=.true.)
   call beginnings(corners=.true.)
   call beginnings(corners=.false.)
   call pulled(corners=.true.)
   call pulled(corners=.false.)
   call rings()
   call too_often()
   call room_of_ids()
   call thickness()
   call beyond_sides()
   call test%finish()

contains

   !> What a block's particles amount to: mass, volume, energy, volume of the domains, momentum, angular
   !> momentum with what turns within the domains, their first and second moments; area and first moment of
   !> the faces that they carry.
   function sums(block, level) result(total)
      type(block_t), intent(in) :: block
      type(level_t), intent(in) :: level
      real(wp) :: total(28), r(3, 3), l(3, 3), x(3), v(3), m, turn(3), second(3, 3)
      integer :: p, k
      total = 0.0_wp
      do p = 1, block%particles%count
         associate (values => block%particles%column(p, :), at => level%layout)
            x = values(at%position:at%position + 2)
            v = values(at%velocity:at%velocity + 2)
            m = values(at%mass)
            r = half_edges(values, at)
            l = 0.0_wp
            if (at%gradient > 0) l = reshape(values(at%gradient:at%gradient + 8), [3, 3])
            turn = m*cross(x, v)
            second = m*spread(x, 2, 3)*spread(x, 1, 3)
            do k = 1, 3
               turn = turn + m/3.0_wp*cross(r(:, k), matmul(l, r(:, k)))
               second = second + m/3.0_wp*spread(r(:, k), 2, 3)*spread(r(:, k), 1, 3)
            end do
            total = total + [m, values(at%volume), values(level%table%column('energy')), &
                             8.0_wp*dot_product(r(:, 1), cross(r(:, 2), r(:, 3))), m*v, turn, m*x, &
                             reshape(second, [9]), face_of(values, level), norm2(face_of(values, level)) &
                             *(x + arm_of(values, level))]
         end associate
      end do
   end function sums

   !> The area that a particle carries, m2.
   function face_of(values, level) result(area)
      real(wp), intent(in) :: values(:)
      type(level_t), intent(in) :: level
      real(wp) :: area(3)
      associate (first => level%table%column('face_area'))
         area = values(first:first + 2)
      end associate
   end function face_of

   !> The way from its centre to the middle of that, m.
   function arm_of(values, level) result(arm)
      real(wp), intent(in) :: values(:)
      type(level_t), intent(in) :: level
      real(wp) :: arm(3)
      associate (first => level%table%column('face_arm'))
         arm = values(first:first + 2)
      end associate
   end function arm_of

   pure function cross(a, b) result(c)
      real(wp), intent(in) :: a(3), b(3)
      real(wp) :: c(3)
      c = [a(2)*b(3) - a(3)*b(2), a(3)*b(1) - a(1)*b(3), a(1)*b(2) - a(2)*b(1)]
   end function cross

   subroutine declare(level, corners, affine)
      type(level_t), intent(inout) :: level
      logical, intent(in) :: corners, affine
      call level%table%declare('stress', 6, 'Pa', .true.)
      call level%table%declare('energy', 1, 'J', .true., extensive=.true.)
      call level%table%declare('position', 3, 'm', .true.)
      call level%table%declare('velocity', 3, 'm/s', .true.)
      call level%table%declare('mass', 1, 'kg', .true., extensive=.true.)
      call level%table%declare('volume', 1, 'm3', .true., extensive=.true.)
      if (corners) then
         call level%table%declare('domain', 9, 'm', .true.)
      else
         call level%table%declare('half_size', 3, 'm', .true.)
      end if
      if (affine) call level%table%declare('velocity_gradient', 9, '1/s', .false.)
      call level%table%declare('face_area', 3, 'm2', .false., extensive=.true.)
      call level%table%declare('face_arm', 3, 'm', .false., arm_to=level%table%column('face_area'))
      call level%table%declare('generation', 1, '1', .false.)
      level%layout = level%table%layout()
   end subroutine declare

   !> Parts that lie beyond symmetry sides become their mirror images, by a reflection of all that has a
   !> direction; others and those beyond a free side stay as they are.
   subroutine beyond_sides()
      type(level_t) :: level
      type(grid_spec_t) :: spec
      type(grid_level_t) :: grid
      type(shares_t) :: shares
      real(wp), allocatable :: values(:), was(:)
      real(wp) :: mirror(3, 3), side(3), r(3, 3), s(3, 3)
      integer :: axis, n
      call declare(level, corners=.true., affine=.true.)
      spec%lower = 0.0_wp
      spec%upper = 3.0_wp
      spec%cell_size = cell
      spec%cells = 10
      spec%boundary = boundary_symmetry
      spec%boundary(6) = boundary_free
      grid = make_grid_level(spec)
      shares = level%table%shares()
      associate (at => level%layout)
         do n = 1, 200
            values = chance%several(level%table%columns, -1.0_wp, 1.0_wp)
            values(at%position:at%position + 2) = chance%several(3, -0.5_wp, 3.5_wp)
            was = values
            call keep_inside(values, at, shares, grid)
            mirror = 0.0_wp
            side = 0.0_wp
            do axis = 1, 3
               associate (x => was(at%position + axis - 1))
                  mirror(axis, axis) = merge(-1.0_wp, 1.0_wp, x < 0.0_wp .or. (x > 3.0_wp .and. axis < 3))
                  if (mirror(axis, axis) < 0.0_wp) side(axis) = merge(0.0_wp, 6.0_wp, x < 0.0_wp)
               end associate
            end do
            if (all(side <= 0.0_wp) .and. all([(mirror(axis, axis) > 0.0_wp, axis=1, 3)])) &
               call test%check(all(abs(values - was) <= 0.0_wp), &
                               'sides: what is inside, or beyond a free side, stays')
            call test%check_close(values(at%position:at%position + 2), side &
                                  + matmul(mirror, was(at%position:at%position + 2)), &
                                  1.0e-15_wp, 'sides: the place of the image')
            call test%check_close(values(at%velocity:at%velocity + 2), &
                                  matmul(mirror, was(at%velocity:at%velocity + 2)), 0.0_wp, &
                                  'sides: its velocity')
            call test%check_close(reshape(values(at%gradient:at%gradient + 8), [9]), &
               reshape(matmul(mirror, matmul(reshape(was(at%gradient:at%gradient + 8), [3, 3]), mirror)), &
                       [9]), 0.0_wp, 'sides: its velocity gradient')
            s = matmul(mirror, matmul(stress_of(was, at%stress), mirror))
            call test%check_close(values(at%stress:at%stress + 5), &
                                  [s(1, 1), s(2, 2), s(3, 3), s(2, 3), s(1, 3), s(1, 2)], 0.0_wp, &
                                  'sides: its stress')
            r = matmul(mirror, half_edges(was, at))
            call test%check_close(reshape(abs(half_edges(values, at)), [9]), reshape(abs(r), [9]), 0.0_wp, &
                                  'sides: its domain')
            call test%check_close(abs(sum(half_edges(values, at)*r, dim=1)), sum(r**2, dim=1), 1.0e-14_wp, &
                                  'sides: whose edges may point either way')
            call test%check_close(dot_product(r(:, 1), cross(r(:, 2), r(:, 3)))*mirror(1, 1)*mirror(2, &
               2)*mirror(3, 3), triple(half_edges(values, at)), 1.0e-14_wp, 'sides: its handedness stays')
         end do
      end associate
   end subroutine beyond_sides

   pure real(wp) function triple(r)
      real(wp), intent(in) :: r(3, 3)
      triple = dot_product(r(:, 1), cross(r(:, 2), r(:, 3)))
   end function triple

   pure function stress_of(values, first) result(s)
      real(wp), intent(in) :: values(:)
      integer, intent(in) :: first
      real(wp) :: s(3, 3)
      s(:, 1) = values([first, first + 5, first + 4])
      s(:, 2) = values([first + 5, first + 1, first + 3])
      s(:, 3) = values([first + 4, first + 3, first + 2])
   end function stress_of

   !> Parts of a particle that was deformed by F know where they began: x = F X for each.
   subroutine beginnings(corners)
      logical, intent(in) :: corners
      type(level_t) :: level
      type(block_t) :: block
      real(wp), allocatable :: values(:)
      real(wp) :: f(3, 3), start(3), halves(3)
      integer :: k, n, p, splits, worn_out
      do n = 1, 50
         level = level_t()
         block = block_t()
         call declare(level, corners, affine=.true.)
         call level%table%declare('start', 3, 'm', .false.)
         call level%table%declare('start_edges', 3, 'm', .false.)
         level%layout = level%table%layout()
         f = reshape(chance%several(9, -0.5_wp, 0.5_wp), [3, 3])
         if (.not. corners) f = 0.0_wp
         do k = 1, 3
            f(k, k) = chance%between(2.0_wp, 4.0_wp)
         end do
         start = chance%several(3, 0.5_wp, 1.0_wp)
         halves = chance%several(3, 0.1_wp, 0.2_wp)
         values = chance%several(level%table%columns, 0.5_wp, 1.0_wp)
         associate (at => level%layout)
            values(at%position:at%position + 2) = matmul(f, start)
            values(at%start:at%start + 2) = start
            values(at%start_edges:at%start_edges + 2) = halves
            values(at%generation) = 0.0_wp
            values(at%stress:at%stress + 5) = 0.0_wp
            if (corners) then
               values(at%domain:at%domain + 8) = reshape(f*spread(halves, 1, 3), [9])
            else
               values(at%half_size:at%half_size + 2) = [(f(k, k)*halves(k), k=1, 3)]
            end if
            call block%reserve(1, level%table%columns)
            call block%particles%append(values, 1_i8, 1)
            do k = 1, 4
               call split_long(block, level%table, at, cell, soft, splits, worn_out)
            end do
            call test%check(block%particles%count > 1, 'beginnings: it was split')
            do p = 1, block%particles%count
               associate (part => block%particles%column(p, :))
                  call test%check_close(part(at%position:at%position + 2), &
                                        matmul(f, part(at%start:at%start + 2)), 1.0e-14_wp, &
                                        'beginnings: x = F X')
               end associate
            end do
         end associate
      end do
   end subroutine beginnings

   !> Rings of a section that are too wide: their halves have what they carry of a face on top, each the ring
   !> of its own middle.
   subroutine rings()
      type(level_t) :: level
      type(block_t) :: block
      real(wp), allocatable :: values(:)
      real(wp) :: before(3), after(3), width
      integer :: p, splits, worn_out
      call declare(level, corners=.true., affine=.true.)
      level%layout%section%geometry = geometry_axisymmetric
      allocate (values(level%table%columns))
      before = 0.0_wp
      do p = 1, 3
         width = 0.45_wp*(1 + p)*cell
         values = 0.0_wp
         associate (at => level%layout, area => level%table%column('face_area'), &
                    arm => level%table%column('face_arm'))
            values(at%position) = (1 + p)*cell
            values(at%volume) = 8.0_wp*pi*values(at%position)*width*0.3_wp*cell
            values(at%mass) = soft(1)%density*values(at%volume)
            values(at%domain:at%domain + 8:4) = [width, 0.1_wp*cell, 0.3_wp*cell]
            values(area + 2) = 4.0_wp*pi*values(at%position)*width
            values(arm + 2) = 0.3_wp*cell
            before = before + [values(at%mass), values(area + 2), 2.0_wp*width]
         end associate
         call block%reserve(p, level%table%columns)
         call block%particles%append(values, int(p, i8), 1)
      end do
      call split_long(block, level%table, level%layout, cell, soft, splits, worn_out)
      call test%check(splits >= 3, 'rings: they are split')
      after = 0.0_wp
      do p = 1, block%particles%count
         associate (column => block%particles%column, x => level%layout%position, &
                    area => level%table%column('face_area'))
            after = after + [column(p, level%layout%mass), column(p, area + 2), &
                             column(p, area + 2)/(2.0_wp*pi*column(p, x))]
         end associate
      end do
      call test%check_close(after/before, [1.0_wp, 1.0_wp, 1.0_wp], 1.0e-12_wp, &
                            'rings: mass, area and width of the faces carried')
   end subroutine rings

   !> Particles up to 4 cells long, split until none is too long.
   subroutine pieces(corners, affine)
      logical, intent(in) :: corners, affine
      type(level_t) :: level
      type(block_t) :: block
      real(wp), allocatable :: values(:)
      real(wp) :: r(3, 3), before(28), after(28), longest, place(3)
      integer(i8), allocatable :: ids(:)
      integer :: p, round, splits, total, worn_out
      character(len=:), allocatable :: name
      name = trim(merge('corners', 'stretch', corners))//trim(merge(', affine', ', plain ', affine))//': '
      call declare(level, corners, affine)
      do p = 1, 100
         values = chance%several(level%table%columns, -1.0_wp, 1.0_wp)
         do
            r = reshape(chance%several(9, -1.2_wp, 1.2_wp), [3, 3])*cell
            if (dot_product(r(:, 1), cross(r(:, 2), r(:, 3))) > 0.0_wp) exit
         end do
         associate (at => level%layout)
            if (corners) then
               values(at%domain:at%domain + 8) = reshape(r, [9])
            else
               values(at%half_size:at%half_size + 2) = abs(r(:, 1))
            end if
            values(at%mass) = chance%between(0.5_wp, 2.0_wp)
            values(at%generation) = 0.0_wp
            place = chance%several(3, -1.0_wp, 1.0_wp) ! of the face's middle, on a side of the domain
            place(1 + mod(p, 3)) = sign(1.0_wp, place(1 + mod(p, 3)))
            associate (arm => level%table%column('face_arm'))
               values(arm:arm + 2) = matmul(half_edges(values, at), place)
            end associate
         end associate
         call block%reserve(p, level%table%columns)
         call block%particles%append(values, int(p, i8), int(1 + mod(p, 2)))
      end do
      before = sums(block, level)
      total = 0
      do round = 1, 20
         p = block%particles%count
         call split_long(block, level%table, level%layout, cell, soft, splits, worn_out)
         call test%check_equal(worn_out, 0, name//'none has been split too often')
         call test%check_equal(block%particles%count, p + splits, name//'a split makes one particle more')
         total = total + splits
         if (splits == 0) exit
      end do
      call test%check(total > 200 .and. splits == 0, name//'splitting comes to an end')
      after = sums(block, level)
      call test%check_close(after(1:4)/before(1:4), [1.0_wp, 1.0_wp, 1.0_wp, 1.0_wp], 1.0e-12_wp, &
                            name//'mass, volume, energy, volume of the domains')
      call test%check_close(after(5:22), before(5:22), 1.0e-12_wp*after(1), &
                            name//'momentum, angular momentum, centre, moments of inertia')
      call test%check_close(after(23:), before(23:), 1.0e-11_wp, name// &
                            'area and first moment of the faces carried')
      call test%check_close(inward(block, level), 0.0_wp, 1.0e-9_wp, name// &
                            'which all lie on sides of their domains')
      longest = 0.0_wp
      do p = 1, block%particles%count
         longest = max(longest, maxval(norm2(half_edges(block%particles%column(p, :), level%layout), dim=1)))
      end do
      call test%check(longest > 0.3_wp*cell .and. longest <= 0.525_wp*cell, name// &
                      'no half edge is longer than 0.525 cells')
      ids = block%particles%id(:block%particles%count)
      ids = ids(sorted_order(ids, ids))
      call test%check(all(ids(2:) > ids(:size(ids) - 1)) .and. ids(1) > 0, name//'ids are unique')
      call test%check(all(iand(ids, 2_i8**level%layout%id_bits - 1) <= 100), name// &
                      'ids tell the first parent')
      associate (particles => block%particles, s => level%layout%stress)
         do p = 101, particles%count
            round = int(iand(particles%id(p), 2_i8**level%layout%id_bits - 1))
            call test%check(all(abs(particles%column(p, s:s + 5) - particles%column(round, s:s + 5)) <= &
                                0.0_wp) &
                            .and. particles%body(p) == particles%body(round), name// &
                            'stress and body are the parent''s')
         end do
      end associate
   end subroutine pieces

   !> How far the middle of any face is from the side of its domain, in half edges.
   real(wp) function inward(block, level)
      type(block_t), intent(in) :: block
      type(level_t), intent(in) :: level
      real(wp) :: r(3, 3), along(3)
      integer :: k, p
      inward = 0.0_wp
      do p = 1, block%particles%count
         associate (values => block%particles%column(p, :))
            if (.not. norm2(face_of(values, level)) > 0.0_wp) cycle
            r = half_edges(values, level%layout)
            do k = 1, 3
               associate (across => cross(r(:, mod(k, 3) + 1), r(:, mod(k + 1, 3) + 1)))
                  along(k) = abs(dot_product(arm_of(values, level), across)/dot_product(r(:, k), across))
               end associate
            end do
            inward = max(inward, abs(maxval(along) - 1.0_wp))
         end associate
      end do
   end function inward

   !> Under tension particles are split that else would not be, and across all edges that are too long for it:
   !> into how many.
   subroutine pulled(corners)
      logical, intent(in) :: corners
      real(wp), parameter :: eighth(3) = [0.25_wp, 0.25_wp, 0.36_wp], cube(3) = [0.45_wp, 0.5_wp, 0.51_wp], &
         small(3) = 0.19_wp
      real(wp), parameter :: along_z(6) = [0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
      real(wp), parameter :: along_x(6) = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
      character(len=:), allocatable :: name
      name = trim(merge('corners', 'stretch', corners))//': '
      call test%check_equal(parts_of(corners, eighth, 0.0_wp*along_z, 0.2_wp), 1, name//'no stress')
      call test%check_equal(parts_of(corners, eighth, -along_z, 0.2_wp), 1, name//'compression')
      call test%check_equal(parts_of(corners, eighth, 2.0e4_wp*along_z, 0.2_wp), 2, name//'tension')
      call test%check_equal(parts_of(corners, eighth, 8.0e3_wp*along_z, 0.2_wp), 1, name// &
                            'tension as in metals')
      call test%check_equal(parts_of(corners, eighth, 2.0e4_wp*along_x, 0.2_wp), 2, name// &
                            'tension across the long edge')
      call test%check_equal(parts_of(corners, eighth - 0.02_wp, 2.0e4_wp*along_z, 0.2_wp), 1, name// &
                            'tension, short')
      call test%check_equal(parts_of(corners, eighth, 1.05e6_wp*along_z, 0.2_wp), 2, name// &
                            'tension of 1.05 moduli')
      call test%check_equal(parts_of(corners, eighth, 1.2e6_wp*along_z, 0.2_wp), 8, name// &
                            'tension of 1.2 moduli')
      call test%check_equal(parts_of(corners, small, 9.0e6_wp*along_z, 0.2_wp), 1, name// &
                            'tension of 9 moduli, small')
      call test%check_equal(parts_of(corners, cube, along_z, 1.0_wp), 8, name// &
                            'all of a cell, tension along the longest')
      call test%check_equal(parts_of(corners, cube, along_x, 1.0_wp), 1, name// &
                            'all of a cell, tension along another')
      call test%check_equal(parts_of(corners, cube - 0.01_wp, along_z, 1.0_wp), 1, name// &
                            'all of a cell, hardly strained')
      call test%check_equal(parts_of(corners, cube + 0.02_wp, -along_z, 1.0_wp), 2, name// &
                            'all of a cell, compression')
      call test%check_equal(parts_of(corners, [0.53_wp, 0.53_wp*(1.0_wp + epsilon(1.0_wp)), 0.3_wp], &
                                     -along_z, 0.2_wp), 4, name// &
                            'two edges too long, equal but for round-off')
   end subroutine pulled

   !> Into how many parts a particle is split.
   integer function parts_of(corners, half, stress, mass) result(parts)
      logical, intent(in) :: corners
      real(wp), intent(in) :: half(3)   !< half edges, cells
      real(wp), intent(in) :: stress(6) !< Pa
      real(wp), intent(in) :: mass      !< of that of a cell
      type(level_t) :: level
      type(block_t) :: block
      real(wp), allocatable :: values(:)
      integer :: splits, worn_out
      call declare(level, corners, affine=.true.)
      allocate (values(level%table%columns), source=0.0_wp)
      associate (at => level%layout)
         if (corners) then
            values(at%domain:at%domain + 8:4) = half*cell
         else
            values(at%half_size:at%half_size + 2) = half*cell
         end if
         values(at%mass) = mass*soft(1)%density*cell**3
         values(at%stress:at%stress + 5) = stress
      end associate
      call block%reserve(1, level%table%columns)
      call block%particles%append(values, 1_i8, 1)
      call split_long(block, level%table, level%layout, cell, soft, splits, worn_out)
      parts = block%particles%count
      call test%check_equal(splits, parts - 1, 'all parts are counted')
   end function parts_of

   !> A particle that has no generation left is named, not split.
   subroutine too_often()
      type(level_t) :: level
      type(block_t) :: block
      real(wp), allocatable :: values(:)
      integer :: g, splits, worn_out
      call declare(level, corners=.true., affine=.true.)
      allocate (values(level%table%columns), source=1.0_wp)
      values(level%layout%domain:level%layout%domain + 8) = reshape([1, 0, 0, 0, 1, 0, 0, 0, 1], [9]) &
         *0.1_wp*cell
      values(level%layout%domain) = 0.9_wp*cell
      values(level%layout%generation) = 0.0_wp
      call block%reserve(1, level%table%columns)
      call block%particles%append(values, 7_i8, 1)
      do g = 1, level%layout%max_generations()
         block%particles%count = 1
         block%particles%column(1, level%layout%domain) = 0.9_wp*cell
         call split_long(block, level%table, level%layout, cell, soft, splits, worn_out)
         call test%check_equal(splits, 1, 'it is split')
      end do
      call test%check(block%particles%id(2) == 7_i8 + 2_i8**61, 'the last id')
      block%particles%count = 1
      block%particles%column(1, level%layout%domain) = 0.9_wp*cell
      call split_long(block, level%table, level%layout, cell, soft, splits, worn_out)
      call test%check(worn_out == 1 .and. splits == 0 .and. block%particles%count == 1, 'not once more')
   end subroutine too_often

   !> Ids of bodies do not meet, small scenes have most room for splits, and too little room is a fault.
   subroutine room_of_ids()
      type(layout_t) :: layout
      type(body_spec_t) :: bodies(2)
      type(box_t) :: box
      type(error_t) :: error
      box = box_t(lower=[0.0_wp, 0.0_wp, 0.0_wp], upper=[10.0_wp, 10.0_wp, 10.0_wp])
      allocate (bodies(1)%shape, source=box)
      allocate (bodies(2)%shape, source=box)
      call number_ids(layout, bodies, 1.0_wp, 30, error) ! 8000 places each
      call test%check(.not. error%happened() .and. layout%ids_of_body == 10000, 'ids of a body')
      call test%check(layout%id_bits == 15 .and. layout%max_generations() == 47, 'room for splits')
      call test%check(first_id(2, layout) == 10000, 'ids of the second body')
      box%upper = 1.0e5_wp
      deallocate (bodies(1)%shape)
      allocate (bodies(1)%shape, source=box)
      call number_ids(layout, bodies, 1.0_wp, 0, error) ! 8e15 places: 55 bits
      call test%check(.not. error%happened(), 'no splits, no room needed')
      call number_ids(layout, bodies, 1.0_wp, 12, error)
      call test%check(error%happened() .and. error%status == exit_input, 'too many ids')
   end subroutine room_of_ids

   !> The edge of a cube from any side; twice the half edge of a box along it.
   subroutine thickness()
      type(level_t) :: level
      real(wp), allocatable :: values(:)
      real(wp) :: n(3)
      call declare(level, corners=.true., affine=.false.)
      allocate (values(level%table%columns), source=0.0_wp)
      values(level%layout%domain:level%layout%domain + 8:4) = 0.2_wp
      n = [2.0_wp, -1.0_wp, 2.0_wp]/3.0_wp
      call test%check_close(level%thickness(values, n), 0.4_wp, 1.0e-15_wp, 'thickness of a cube')
      values(level%layout%domain:level%layout%domain + 8) = 0.3_wp*reshape([0, 1, 0, -2, 0, 0, 0, 0, 3], [9])
      call test%check_close(level%thickness(values, [1.0_wp, 0.0_wp, 0.0_wp]), 1.2_wp, 1.0e-15_wp, &
                            'thickness of a turned box')
   end subroutine thickness

end program split
