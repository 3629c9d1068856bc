!> The reading of namelists: what the grammar gives, numbers, names, ranges, shapes, and that a scene written
!> reads back the same.
!test: ranks 1 2
program namelist_test
   use m_assertions, only: assertions_t
   use m_communicator, only: communicator_t
   use m_constants, only: pi
   use m_errors, only: error_t
   use m_filesystem, only: make_directory, can_make_directory, is_directory, is_writable
   use m_kinds, only: wp
   use m_namelist_text, only: namelist_text_t
   use m_number_text, only: read_real, read_integer, number_good, number_none, number_infinite, number_size
   use m_scene, only: scene_t, update_musl, criterion_none, criterion_stress, criterion_strain
   use m_side_kinds, only: boundary_free, boundary_fixed
   use m_offer, only: catalogue_t
   use m_materials, only: known_materials
   use m_isotropic, only: isotropic_t
   use m_effects, only: known_effects
   use m_snapshot_formats, only: known_formats
   use m_scene_reader, only: interpret_scene
   use m_shape, only: shape_t
   use m_box, only: box_t
   use m_sphere, only: sphere_t
   use m_cylinder, only: cylinder_t
   use m_cone, only: cone_t
   use m_flat, only: flat_t
   use m_pyramid, only: pyramid_t
   use m_berkovich, only: berkovich_t
   use m_roller, only: roller_t
   use m_wedge, only: wedge_t
   use m_ring, only: ring_t
   use m_overlap, only: overlap
   use m_scene_writer, only: scene_as_namelist
   use m_words, only: edit_distance, nearest_word
   implicit none
   character(len=*), parameter :: new = new_line('a')
   type(communicator_t) :: communicator
   type(catalogue_t) :: catalogue
   type(assertions_t) :: test

   call communicator%start()
   call test%start(communicator, 'namelist')
   call known_materials(catalogue)
   call known_effects(catalogue)
   call known_formats(catalogue)
   call test_grammar()
   call test_numbers()
   call test_words()
   call test_shapes()
   call test_directories()
   call test_scene()
   call test_round_trip()
   call test_levels()
   call test%finish()

contains

   subroutine test_grammar()
      type(namelist_text_t) :: text
      type(error_t) :: error
      call text%parse('! "comment'//new//'&One a=1,2 3,'//new//' b = ''it''''s ! "'', "say ""/"""'//new// &
                      'c=2*1.5d0, 2*''x'' , ! '' / &'//new//' d=.true. F / &two/ &three x=-1 &END'// &
                         char(13)//new, error)
      call test%check(.not. error%happened(), 'grammar: accepted')
      if (error%happened()) return
      call test%check_equal(size(text%groups), 3, 'grammar: groups')
      call test%check_equal(text%groups(1)%line, 2, 'grammar: line of a group')
      call test%check(text%groups(1)%name == 'one', 'grammar: names in lower case')
      call test%check_equal(size(text%groups(2)%entries), 0, 'grammar: empty group')
      call test%check(text%groups(3)%entries(1)%value_text(1) == '-1', 'grammar: &end')
      associate (entries => text%groups(1)%entries)
         call test%check_equal(size(entries), 4, 'grammar: variables')
         call test%check_equal(size(entries(1)%values), 3, 'grammar: commas or blanks')
         call test%check(entries(1)%value_text(3) == '3', 'grammar: third value')
         call test%check(entries(2)%value_text(1) == 'it''s ! "', 'grammar: single quotes')
         call test%check(entries(2)%value_text(2) == 'say "/"', 'grammar: double quotes')
         call test%check(all(entries(2)%values%quoted), 'grammar: quoted')
         call test%check_equal(size(entries(3)%values), 4, 'grammar: repeats')
         call test%check(entries(3)%value_text(2) == '1.5d0' .and. entries(3)%value_text(4) == 'x', &
                         'grammar: repeated values')
         call test%check(entries(3)%values(4)%quoted .and. .not. entries(3)%values(2)%quoted, &
                         'grammar: repeated quotes')
         call test%check_equal(entries(3)%line, 4, 'grammar: line of a variable')
         call test%check_equal(entries(4)%line, 5, 'grammar: line behind a comment')
         call test%check(entries(4)%value_text(1) == '.true.' .and. entries(4)%value_text(2) == 'F', &
                         'grammar: logicals')
      end associate
      call test%check(text%place('one', 1, 'a') == 'line 2, &one a=1,2,3', 'grammar: place of a variable')
      call test%check(text%place('two', 1, 'a') == 'line 5, &two a', 'grammar: place of a missing variable')
      call test%check_equal(text%find_group('three', 2), 0, 'grammar: no second group')
   end subroutine test_grammar

   subroutine test_numbers()
      real(wp) :: value
      integer :: whole, i, fault
      logical :: good
      character(len=12), parameter :: bad(17) = [character(len=12) :: '', '-', '.', 'e5', '1e', '1e+', &
                                                 '1.2.3', '1,5', '0x10', '1_8', '1 2', '--1', '1e5.', '+-1', &
                                                 '1e5e5', 'one', '.true.']
      call read_real('-2.5', value, fault)
      call test%check_close(value, -2.5_wp, 0.0_wp, 'numbers: -2.5')
      call read_real('+.5D+2', value, fault)
      call test%check_close(value, 50.0_wp, 0.0_wp, 'numbers: d exponent')
      call read_real('7.', value, fault)
      call test%check_close(value, 7.0_wp, 0.0_wp, 'numbers: 7.')
      call read_real('0.1', value, fault)
      call test%check_close(value, 0.1_wp, 0.0_wp, 'numbers: 0.1')
      call read_real('0e999', value, fault)
      call test%check(fault == number_good .and. abs(value) <= 0.0_wp, 'numbers: nothing is nothing')
      call read_real('0.'//repeat('0', 150)//'1e151', value, fault)
      call test%check_close(value, 1.0_wp, 1.0e-15_wp, 'numbers: many zeros')
      do i = 1, size(bad)
         call read_real(trim(bad(i)), value, fault)
         call test%check_equal(fault, number_none, 'numbers: refused '//trim(bad(i)))
      end do
      call read_real('-iNf', value, fault)
      call test%check_equal(fault, number_infinite, 'numbers: infinity')
      call read_real('NaN', value, fault)
      call test%check_equal(fault, number_infinite, 'numbers: NaN')
      call read_real('1e101', value, fault)
      call test%check_equal(fault, number_size, 'numbers: too large')
      call read_real('1e-99999999999999999999', value, fault)
      call test%check_equal(fault, number_size, 'numbers: too small')
      call read_integer('-123', whole, good)
      call test%check(good .and. whole == -123, 'numbers: whole')
      call read_integer('1.0', whole, good)
      call test%check(.not. good, 'numbers: whole with a point')
      call read_integer('9999999999', whole, good)
      call test%check(.not. good, 'numbers: whole and too large')
   end subroutine test_numbers

   subroutine test_words()
      character(len=8), parameter :: words(3) = [character(len=8) :: 'young', 'poisson', 'density']
      call test%check_equal(edit_distance('yung', 'young'), 1, 'words: one letter')
      call test%check_equal(edit_distance('kitten', 'sitting'), 3, 'words: three letters')
      call test%check_equal(edit_distance('', 'abc'), 3, 'words: nothing')
      call test%check_equal(edit_distance(repeat('a', 500), repeat('a', 500)), 0, 'words: long')
      call test%check_equal(nearest_word('Posson', words), 2, 'words: nearest')
      call test%check_equal(nearest_word('qqq', words), 0, 'words: none is near')
   end subroutine test_words

   subroutine test_shapes()
      type(box_t) :: box
      type(sphere_t) :: ball
      type(cylinder_t) :: rod
      type(cone_t) :: cone
      type(ring_t) :: ring
      real(wp), parameter :: middle(2) = [1.0_wp, 0.5_wp], angle = 70.3_wp*pi/180.0_wp, &
         down(3) = [0.0_wp, 0.0_wp, -1.0_wp]
      real(wp) :: lower(3), upper(3)
      box = box_t(upper=[2.0_wp, 1.0_wp, 1.0_wp])
      ball = sphere_t(center=[middle, 1.5_wp], radius=0.5_wp)
      rod = cylinder_t(center=[0.0_wp, 0.0_wp, 1.0_wp], axis=[1.0_wp, 0.0_wp, 1.0_wp]/sqrt(2.0_wp), &
                       radius=0.5_wp, height=2.0_wp)
      call test%check_close(box%distance([3.0_wp, 2.0_wp, 0.5_wp]), sqrt(2.0_wp), 1.0e-14_wp, &
                            'shapes: outside a box')
      call test%check_close(box%distance([1.0_wp, 0.9_wp, 0.5_wp]), -0.1_wp, 1.0e-14_wp, &
                            'shapes: inside a box')
      call test%check_close(rod%distance(rod%center - rod%axis), 1.0_wp, 1.0e-14_wp, &
                            'shapes: below a cylinder')
      call test%check_close(rod%distance(rod%center + rod%axis), -0.5_wp, 1.0e-14_wp, &
                            'shapes: inside a cylinder')
      call rod%bounding_box(lower, upper)
      call test%check_close(lower, [-sqrt(0.125_wp), -0.5_wp, 1.0_wp - sqrt(0.125_wp)], 1.0e-14_wp, &
                            'shapes: extent below')
      call test%check_close(upper, [sqrt(2.0_wp) + sqrt(0.125_wp), 0.5_wp, 1.0_wp + sqrt(2.0_wp) &
                                    + sqrt(0.125_wp)], 1.0e-14_wp, 'shapes: extent above')
      call test%check(.not. bodies_overlap(box, ball), 'shapes: a ball on a box')
      ball%center(3) = 1.5_wp - 1.0e-4_wp
      call test%check(bodies_overlap(box, ball), 'shapes: a ball in a box')
      ball%center = [2.0_wp, 1.0_wp, 1.0_wp] + 0.5001_wp/sqrt(3.0_wp)
      call test%check(.not. bodies_overlap(box, ball), 'shapes: a ball beside a corner')
      ball%center = [2.0_wp, 1.0_wp, 1.0_wp] + 0.4999_wp/sqrt(3.0_wp)
      call test%check(bodies_overlap(box, ball), 'shapes: a ball over a corner')
      cone = cone_t(half_angle=angle)
      call cone%prepare(down)
      call test%check_close(cone%distance([0.0_wp, 0.0_wp, 1.0_wp]), -sin(angle), 1.0e-14_wp, &
                            'shapes: within a cone')
      call on_and_in(box, sphere_t(radius=0.3_wp), 'a sphere')
      call on_and_in(box, cone_t(half_angle=angle), 'a cone')
      call on_and_in(box, flat_t(radius=0.3_wp), 'a flat end')
      call on_and_in(box, berkovich_t(half_angle=angle), 'a berkovich')
      call on_and_in(box, roller_t(radius=0.3_wp), 'a cylinder')
      call on_and_in(box, wedge_t(half_angle=angle), 'a wedge')
      call on_and_in(box, ring_t(radius=0.3_wp, tube=0.1_wp), 'a ring')
      ! its ridge lies beside the box, along it or across: its flank is where the ridge is not
      call test%check(.not. tool_overlaps(box, wedge_t(half_angle=0.25_wp*pi), [1.0_wp, 1.2_wp, 0.95_wp]), &
                      'shapes: a wedge beside a box')
      call test%check(tool_overlaps(box, wedge_t(half_angle=0.25_wp*pi, edge=[0.0_wp, 1.0_wp, 0.0_wp]), &
                                    [1.0_wp, 1.2_wp, 0.95_wp]), 'shapes: a wedge with its ridge in a box')
      ! a ball in the hole of a ring, about it and touching it
      ring = ring_t(radius=2.0_wp, tube=0.5_wp, axis=[0.6_wp, 0.0_wp, 0.8_wp])
      ball = sphere_t(radius=1.45_wp)
      call test%check(.not. bodies_overlap(ring, ball), 'shapes: a ball in a ring')
      ball%radius = 1.5_wp
      call test%check(.not. bodies_overlap(ring, ball), 'shapes: a ball that fills a ring')
      ball%radius = 1.53_wp
      call test%check(bodies_overlap(ring, ball), 'shapes: a ball that is too large for a ring')
      ball%radius = 1.45_wp
      ball%center = 0.08_wp*[-0.8_wp, 0.0_wp, 0.6_wp]
      call test%check(bodies_overlap(ring, ball), 'shapes: a ball beside the middle of a ring')
      ball = sphere_t(center=2.0_wp*[-0.8_wp, 0.0_wp, 0.6_wp], radius=1.0e-3_wp)
      call test%check(bodies_overlap(ball, ring), 'shapes: a small ball inside the section of a ring')
   end subroutine test_shapes

   logical function bodies_overlap(one, other)
      class(shape_t), intent(in) :: one, other
      bodies_overlap = overlap(one, other, [0.0_wp, 0.0_wp, 0.0_wp], 1.0e-6_wp, 0.02_wp)
   end function bodies_overlap

   logical function tool_overlaps(body, shape, tip)
      class(shape_t), intent(in) :: body, shape
      real(wp), intent(in) :: tip(3)
      class(shape_t), allocatable :: tool
      allocate (tool, source=shape)
      call tool%prepare([0.0_wp, 0.0_wp, -1.0_wp])
      tool_overlaps = overlap(body, tool, tip, 1.0e-6_wp, 0.02_wp)
   end function tool_overlaps

   !> A tool whose tip stands on the box, and so little in it.
   subroutine on_and_in(box, shape, name)
      type(box_t), intent(in) :: box
      class(shape_t), intent(in) :: shape
      character(len=*), intent(in) :: name
      call test%check(.not. tool_overlaps(box, shape, [1.0_wp, 0.5_wp, 1.0_wp]), 'shapes: '//name// &
                      ' on a box')
      call test%check(tool_overlaps(box, shape, &
                                    [1.0_wp, 0.5_wp, 1.0_wp &
                                     - merge(1.0e-4_wp, 0.02_wp, shape%is_convex())]), &
                      'shapes: '//name//' in a box')
   end subroutine on_and_in

   subroutine test_directories()
      logical :: ok
      call test%check(is_writable('.'), 'directories: what is there')
      call test%check(.not. is_directory('/dev/null'), 'directories: what is there')
      call test%check(.not. can_make_directory('/dev/null/x'), 'directories: below a file')
      call test%check(can_make_directory('.'), 'directories: the current one')
      call make_directory('.', ok)
      call test%check(ok, 'directories: making what is there')
      call make_directory('/dev/null/x', ok)
      call test%check(.not. ok, 'directories: making below a file')
   end subroutine test_directories

   !> A scene of every group, with what is hard to write in decimals.
   function hard_scene() result(text)
      character(len=:), allocatable :: text
      text = '&scene title="it''s", end_time=0.3333333333333333e-5 /'//new// &
             '&grid lower=-0.1,2*0, upper=0.9,1,1, cell_size=0.1d0, boundary=6*''Fixed'' /'//new// &
             '&time safety=0.30000000000000004 stress_update=''musl'' flip_fraction=0.99 '// &
             'transfer=''plain'' /'//new// &
             '&material name=''a-1'' model=''elastic'' density=2710.1234567890123 young=70e9 '// &
             'poisson=0.33 /'//new// &
             '&material name=''B_2'' model=''neo_hookean'' density=1e-20 young=1e20 poisson=-.25 /'//new// &
             '&body material=''b_2'' shape=''box'' lower=-0.1,0,0 upper=0.9,1,0.3 particles_per_cell=27 '// &
             'velocity=3*1e-9 /'//new// &
             '&body material=''a-1'' shape=''cylinder'' center=.4,.5,.5 radius=0.1 height=0.2 '// &
             'axis=1,2,3 angular_velocity=0,0,7/'
      text = text//new//'&body name=''ball'' material=''a-1'' shape=''sphere'' center=0.1,0.1,0.6 '// &
             'radius=0.1'//new//'particles_per_cell=1 /'//new// &
             '&tool shape=''cone'' half_angle=12.345678901234567 tip=0.8,0.1,0.8 axis=0.1,0.1,-1'//new// &
             'times=0,.1,.3 speeds=3*1.1/'// &
             '&tool shape=''flat'' radius=0.01 tip=.1,.8,.9 times=0 speeds=-1 penetration_factor=0/'//new// &
             '&tool shape=''berkovich'' tip=.1,.8,.9 edge=1,2,0 times=0,1 loads=1.1,-3 mass=1e-9 '// &
             'friction=0.3/'//new// &
             '&tool shape=''wedge'' half_angle=30 tip=.1,.8,.9 axis=1,0,0 times=0 loads=0 mass=3 '// &
             'initial_speed=-.1/'//new// &
             '&tool shape=''profile'' radii=0,.01,.015 heights=0,.0033333333333333335,.01 tip=.1,.8,.9 '// &
             'times=0 speeds=1/'//new// &
             '&probe position=0.1,0.1,0.1 /'//new//'&contact tolerance=1e-12 max_iterations=7 /'//new// &
             '&damping kind=''viscous'' coefficient=0.30000000000000004 / &gravity '// &
             'acceleration=0,1e-7,-9.80665 /'//new
   end function hard_scene

   subroutine test_scene()
      type(scene_t) :: scene
      type(error_t) :: error
      character(len=:), allocatable :: text
      text = hard_scene()
      call interpret_scene(communicator, catalogue, text, scene, error)
      call test%check(.not. error%happened(), 'scene: accepted')
      if (error%happened()) print '(a)', error%message
      if (error%happened()) return
      call test%check(scene%title == 'it''s', 'scene: title')
      call test%check(all(scene%grid%cells == 10) .and. all(scene%grid%boundary == boundary_fixed), &
                      'scene: grid')
      call test%check(scene%time%stress_update == update_musl .and. .not. scene%time%affine, 'scene: choices')
      call test%check_close(scene%time%flip_fraction, 0.99_wp, 0.0_wp, 'scene: a number')
      call test%check_close(scene%time%time_step, 0.0_wp, 0.0_wp, 'scene: a default')
      call test%check(scene%bodies(1)%material == 2 .and. scene%bodies(1)%shape%name == 'box', &
                      'scene: material of a body')
      call test%check(scene%bodies(2)%name == 'body2' .and. scene%tools(1)%name == 'tool1', &
                      'scene: names by default')
      call test%check_close(scene%bodies(2)%shape%axis, [1.0_wp, 2.0_wp, 3.0_wp]/sqrt(14.0_wp), 1.0e-15_wp, &
                            'scene: axis of length 1')
      select type (cone => scene%tools(1)%shape)
      type is (cone_t)
         call test%check_close(cone%half_angle, 12.345678901234567_wp*pi/180.0_wp, 1.0e-16_wp, &
                               'scene: radians')
      class default
         call test%check(.false., 'scene: a cone')
      end select
      call test%check_close(scene%tools(1)%times, [0.0_wp, 0.1_wp, 0.3_wp], 0.0_wp, 'scene: a table')
      call test%check_close(scene%tools(2)%penetration_factor, 0.0_wp, 0.0_wp, 'scene: zero is kept')
      select type (pyramid => scene%tools(3)%shape)
      class is (pyramid_t)
         call test%check_close(pyramid%half_angle, 65.27_wp*pi/180.0_wp, 1.0e-15_wp, &
                               'scene: angle of a berkovich')
      class default
         call test%check(.false., 'scene: a berkovich')
      end select
      select type (wedge => scene%tools(4)%shape)
      type is (wedge_t)
         call test%check_close(wedge%edge, [0.0_wp, 1.0_wp, 0.0_wp], 0.0_wp, &
                               'scene: an edge across the axis by default')
      class default
         call test%check(.false., 'scene: a wedge')
      end select
      call test%check(.not. scene%output%present, 'scene: no output')
      call test%check(size(scene%levels) == 0 .and. scene%time%subcycle, 'scene: no levels')
      call test%check_equal(size(scene%effects), 2, 'scene: effects')
      call test%check(scene%effects(1)%it%name == 'gravity' .and. scene%effects(2)%it%name == 'damping', &
                      'scene: effects in the order of the catalogue')
   end subroutine test_scene

   subroutine test_round_trip()
      type(scene_t) :: first, second
      type(error_t) :: error
      character(len=:), allocatable :: text, again
      integer :: i
      text = hard_scene()
      call interpret_scene(communicator, catalogue, text, first, error)
      if (.not. error%happened()) text = scene_as_namelist(first)
      again = text
      if (.not. error%happened()) call interpret_scene(communicator, catalogue, again, second, error)
      call test%check(.not. error%happened(), 'round trip: read again')
      if (error%happened()) print '(a)', error%message
      if (error%happened()) return
      call test%check(scene_as_namelist(second) == text, 'round trip: the same text')
      call test%check(index(text, 'acceleration=0,1e-7,-9.80665'//new) > 0 .and. &
                      index(text, 'kind=''viscous'''//new) > 0 .and. &
                      index(text, 'coefficient=0.30000000000000004'//new) > 0, 'round trip: effects')
      call test%check_close(second%end_time, first%end_time, 0.0_wp, 'round trip: end')
      call test%check_close(second%time%safety, first%time%safety, 0.0_wp, 'round trip: safety')
      call test%check(all(first%grid%cells == second%grid%cells) .and. &
                      all(second%grid%boundary /= boundary_free), 'round trip: grid')
      do i = 1, size(first%materials)
         call test%check(first%materials(i)%name == second%materials(i)%name, 'round trip: names')
         call test%check_close(second%materials(i)%density, first%materials(i)%density, 0.0_wp, &
                               'round trip: density')
         select type (one => first%materials(i)%law)
         class is (isotropic_t)
            select type (other => second%materials(i)%law)
            class is (isotropic_t)
               call test%check_close([other%young, other%poisson], [one%young, one%poisson], 0.0_wp, &
                                     'round trip: moduli')
            end select
         class default
            call test%check(.false., 'round trip: isotropic laws')
         end select
      end do
      do i = 1, size(first%bodies)
         call test%check(same_type_as(second%bodies(i)%shape, first%bodies(i)%shape), 'round trip: shapes')
         call test%check_equal(second%bodies(i)%material, first%bodies(i)%material, 'round trip: materials')
         call test%check_close(second%bodies(i)%shape%axis, first%bodies(i)%shape%axis, 0.0_wp, &
                               'round trip: axes of bodies')
         call test%check_close(second%bodies(i)%velocity, first%bodies(i)%velocity, 0.0_wp, &
                               'round trip: velocities')
      end do
      do i = 1, size(first%tools)
         call test%check(same_type_as(second%tools(i)%shape, first%tools(i)%shape), &
                         'round trip: shapes of tools')
         select type (one => first%tools(i)%shape)
         class is (pyramid_t)
            select type (other => second%tools(i)%shape)
            class is (pyramid_t)
               call test%check_close([other%half_angle, other%edge], [one%half_angle, one%edge], 0.0_wp, &
                                     'round trip: pyramids')
            end select
         type is (cone_t)
            select type (other => second%tools(i)%shape)
            type is (cone_t)
               call test%check_close(other%half_angle, one%half_angle, 0.0_wp, 'round trip: angles')
            end select
         end select
         call test%check_close(second%tools(i)%axis, first%tools(i)%axis, 0.0_wp, 'round trip: axes of tools')
         call test%check_close(second%tools(i)%friction%limit(1.0_wp, 1.0_wp), &
                               first%tools(i)%friction%limit(1.0_wp, 1.0_wp), 0.0_wp, &
                               'round trip: friction')
         call test%check(allocated(second%tools(i)%loads) .eqv. allocated(first%tools(i)%loads), &
                         'round trip: loads or speeds')
         if (allocated(first%tools(i)%loads)) then
            call test%check_close(second%tools(i)%loads, first%tools(i)%loads, 0.0_wp, 'round trip: loads')
            call test%check_close([second%tools(i)%mass, second%tools(i)%initial_speed], &
                                  [first%tools(i)%mass, first%tools(i)%initial_speed], 0.0_wp, &
                                  'round trip: mass and first speed')
         else
            call test%check_close(second%tools(i)%speeds, first%tools(i)%speeds, 0.0_wp, 'round trip: speeds')
         end if
      end do
   end subroutine test_round_trip

   !> Levels with all that they can say, read, written and read again.
   subroutine test_levels()
      character(len=*), parameter :: before = '&scene end_time=1/ &grid lower=-0.1,0,0 upper=.9,1,1 '// &
         'cell_size=.1/'//new//'&material name="a" model="elastic" density=1 young=1 poisson=0/'//new// &
         '&body material="a" shape="box" lower=3*.1 upper=3*.3/'//new// &
         '&tool name="Other" shape="sphere" radius=0.1 tip=0.3,0.3,0.8 times=0 speeds=0/'//new// &
         '&tool name="Ball" shape="sphere" radius=0.1 tip=0.3,0.3,0.8 times=0 speeds=1/'//new
      character(len=*), parameter :: box = '&level lower=0.1,0,0.3, upper=0.7,0.6,1', &
         inner = '&level lower=.2,0,.5 upper=.6,.5,1'
      type(scene_t) :: scene
      call go_round(before//box//'/', scene)
      call test%check(scene%time%subcycle .and. scene%levels(1)%follow == 0 .and. &
                      scene%levels(1)%criterion == criterion_none, 'levels: defaults')
      call test%check_close(scene%levels(1)%lower, [0.1_wp, 0.0_wp, 0.3_wp], 0.0_wp, 'levels: lower')
      call test%check_close(scene%levels(1)%upper, [0.7_wp, 0.6_wp, 1.0_wp], 0.0_wp, 'levels: upper')
      call go_round(before//'&time subcycle=F /'//box//'/'//inner//' follow="ball"/', scene)
      call test%check(.not. scene%time%subcycle, 'levels: no subcycles')
      call test%check_equal(scene%levels(2)%follow, 2, 'levels: the tool that one follows')
      call go_round(before//'&time subcycle=TRUE /'//box//' criterion="stress" max_cells=2000/'// &
                    inner//' criterion="strain"/', scene)
      call test%check(scene%time%subcycle, 'levels: subcycles')
      call test%check(scene%levels(1)%criterion == criterion_stress .and. scene%levels(2)%criterion == &
                      criterion_strain, 'levels: criteria')
      call test%check_equal(scene%levels(1)%max_cells, 2000, 'levels: cells')
      call test%check_equal(scene%levels(2)%max_cells, 1000000, 'levels: cells by default')
   end subroutine test_levels

   !> Read a scene with levels, write it, read that: the same levels and text.
   subroutine go_round(given, scene)
      character(len=*), intent(in) :: given
      type(scene_t), intent(out) :: scene
      type(scene_t) :: second
      type(error_t) :: error
      character(len=:), allocatable :: text, again
      integer :: l
      text = given
      call interpret_scene(communicator, catalogue, text, scene, error)
      if (.not. error%happened()) text = scene_as_namelist(scene)
      again = text
      if (.not. error%happened()) call interpret_scene(communicator, catalogue, again, second, error)
      call test%check(.not. error%happened(), 'levels: read again')
      if (error%happened()) print '(a)', error%message
      if (error%happened()) error stop 'levels: no scene'
      call test%check(scene_as_namelist(second) == text, 'levels: the same text')
      call test%check(scene%time%subcycle .eqv. second%time%subcycle, 'levels: the same subcycles')
      call test%check_equal(size(second%levels), size(scene%levels), 'levels: as many')
      do l = 1, size(scene%levels)
         associate (a => scene%levels(l), b => second%levels(l))
            call test%check_close([b%lower, b%upper], [a%lower, a%upper], 0.0_wp, 'levels: the same boxes')
            call test%check(a%follow == b%follow .and. a%criterion == b%criterion .and. a%max_cells == &
                            b%max_cells, 'levels: the same motion')
         end associate
      end do
   end subroutine go_round

end program namelist_test
