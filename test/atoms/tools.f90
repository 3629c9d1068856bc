!> Tools press atoms: the force on each is the derivative of the energy, for every shape of tool; what atoms
!> get the tool gives; quenched atoms come to rest; and a flat punch that presses a body and its box of atoms
!> bears the load of the elastic column.
!test: ranks 1 2
!test: limit 120
!test: long
program tools
   use mpi_f08, only: MPI_Bcast, MPI_DOUBLE_PRECISION
   use m_kinds, only: wp
   use m_advance, only: advance
   use m_atom_fields, only: atom_fields_t, fields_of
   use m_communicator, only: communicator_t
   use m_coupling, only: coupling_t, coupling_of
   use m_effects, only: known_effects
   use m_snapshot_formats, only: known_formats
   use m_bravais, only: bravais_t
   use m_group_reader, only: group_reader_t
   use m_namelist_text, only: namelist_text_t
   use m_energy, only: balance_t
   use m_errors, only: error_t
   use m_lammps, only: lammps_t, usual_library
   use m_materials, only: known_materials
   use m_model, only: model_t
   use m_offer, only: catalogue_t
   use m_saved_state, only: saved_state_t
   use m_scene, only: scene_t
   use m_scene_reader, only: interpret_scene
   use m_speed_bounds, only: bound_speeds
   use m_text, only: exact_text
   use m_tool, only: make_tool
   use m_tool_repulsion, only: tool_repulsion_t
   use m_assertions, only: assertions_t
   use m_chance, only: say
   implicit none
   real(wp), parameter :: density = 1814.0_wp !< kg/m3
   real(wp), parameter :: gap = 0.03_wp, depth = 0.16_wp !< of the punch at the start, at the end, constants
   integer, parameter :: resting = 10, moving = 20, holding = 20 !< steps
   character(len=*), parameter :: argon = &
      "style='lj/smooth/linear', epsilon=1.65e-21, sigma=3.405e-10, cutoff=8.5e-10"
   type(communicator_t) :: comm
   type(assertions_t) :: test
   type(lammps_t) :: lammps
   type(coupling_t), pointer :: box !< the atoms of the model of now
   type(bravais_t) :: crystal
   character(len=:), allocatable :: complaint
   call comm%start()
   call test%start(comm, 'tools')
   call derive('sphere', "shape='sphere', radius=2e-9")
   call derive('cone', "shape='cone', half_angle=70.3")
   call derive('flat', "shape='flat', radius=1.5e-9")
   call derive('berkovich', "shape='berkovich'")
   call derive('turning', "shape='wedge', half_angle=60", turns=.true.)
   call lammps%load(usual_library, complaint)
   if (complaint == '') then
      call find_crystal()
      call press_flat()
   else
      if (comm%is_root()) print '(a)', '  left out, LAMMPS is not there: a punch on a box of atoms'
   end if
   call test%finish()

contains

   subroutine read_scene(text, scene)
      character(len=*), intent(in) :: text
      type(scene_t), intent(out) :: scene
      type(catalogue_t) :: catalogue
      type(error_t) :: error
      character(len=:), allocatable :: given
      given = text
      call known_materials(catalogue)
      call known_effects(catalogue)
      call known_formats(catalogue)
      call interpret_scene(comm, catalogue, given, scene, error)
      call test%check(.not. error%happened(), 'the scene is read', error%message)
   end subroutine read_scene

   !> Forces on atoms around a tool by differences of the energy; their sum and moment are the tool's.
   subroutine derive(label, shape, turns)
      character(len=*), intent(in) :: label, shape
      logical, intent(in), optional :: turns
      real(wp), parameter :: h = 1.0e-14_wp
      type(scene_t) :: scene
      type(tool_repulsion_t) :: repulsion
      character(len=:), allocatable :: text
      real(wp) :: x(3, 200), moved(3, 200), energy(2), slope, worst, sums(3), turn(3), largest, work
      integer :: i, k, n
      text = '&scene title=''t'', end_time=1 /'//new_line('a')// &
             '&grid lower=-1e-8,-1e-8,-1e-8, upper=1e-8,1e-8,1e-8, cell_size=1e-9 /'//new_line('a')// &
             '&material name=''m'', model=''elastic'', density=1000, young=1e9, poisson=0.3 /'// &
             new_line('a')// &
             '&body material=''m'', shape=''box'', lower=-2e-9,-2e-9,-6e-9, upper=2e-9,2e-9,-4e-9 /'// &
             new_line('a')//'&tool name=''t'', '//shape//', tip=0,0,0, axis=0,0,-1, times=0, speeds=30 /'
      if (present(turns)) &
         text = text//new_line('a')//'&motion tool=''t'', kind=''turn'', axis=0,1,0, point=0,0,0, '// &
                'times=0, speeds=1e10 /'
      call read_scene(text, scene)
      if (size(scene%tools) /= 1) return
      repulsion%stiffness = 3.0e12_wp
      repulsion%distance = 4.0e-10_wp
      call repulsion%place_tools([make_tool(scene%tools(1))], -1.0e-13_wp)
      call random_seed(put=[(7*k, k=1, 40)])
      call random_number(x)
      x = 4.0e-9_wp*(x - 0.5_wp)
      call repulsion%search(x, size(x, 2))
      call repulsion%find_forces(x)
      call repulsion%accumulate(x, 2.0e-15_wp)
      worst = 0.0_wp
      largest = maxval(norm2(repulsion%force, 1))
      sums = 0.0_wp
      turn = 0.0_wp
      work = 0.0_wp
      do k = 1, size(repulsion%pairs, 2)
         n = repulsion%pairs(1, k)
         associate (f => repulsion%force(:, k), tool => repulsion%tools(1))
            sums = sums + 2.0e-15_wp*f
            work = work + 2.0e-15_wp*dot_product(f, tool%velocity_at(x(:, n)))
         end associate
      end do
      do n = 1, size(x, 2), 7
         do i = 1, 3
            do k = 1, 2
               moved = x
               moved(i, n) = moved(i, n) + merge(h, -h, k == 1)
               call repulsion%find_forces(moved)
               energy(k) = repulsion%energy
            end do
            slope = (energy(2) - energy(1))/(2.0_wp*h)
            call repulsion%find_forces(x)
            turn(i) = sum(repulsion%force(i, :), mask=repulsion%pairs(1, :) == n)
            worst = max(worst, abs(slope - turn(i)))
         end do
      end do
      call say(label//': force less the slope of the energy, of the largest force', worst/largest)
      call test%check(largest > 0.0_wp .and. worst < 2.0e-5_wp*largest, label//': force and energy')
      call test%check(maxval(abs(sums + repulsion%pushes(1)%impulse)) <= 1.0e-12_wp*norm2(sums), &
                      label//': action and reaction')
      call test%check(abs(work - repulsion%pushes(1)%work) <= 1.0e-12_wp*abs(work), label//': work')
   end subroutine derive

   !> A body of 4 x 4 x 4 cells of 4 constants that is 2 x 2 x 2 cells of atoms at its top, between slip
   !> walls, under a flat punch that does not touch it yet, moves in some steps and stops.
   subroutine build(model)
      type(model_t), intent(out), target :: model
      type(scene_t) :: scene
      type(error_t) :: error
      real(wp) :: a, t, speed
      character(len=:), allocatable :: text
      a = crystal%constant
      t = step_of()
      speed = (gap + depth)*a/(moving*t)
      text = '&scene title=''t'', end_time=1 /'//new_line('a')// &
             '&grid lower=0,0,0, upper='//three(16*a, 16*a, 24*a)//', cell_size='//exact_text(4*a)// &
             ', boundary=''roller'',''roller'',''roller'',''roller'',''roller'',''free'' /'//new_line('a')// &
             '&material name=''m'', model=''cauchy_born'', density='//exact_text(density)//', '//argon// &
             ', lattice=''fcc'', constant=5.27e-10 /'//new_line('a')// &
             '&body material=''m'', shape=''box'', lower=0,0,0, upper='//three(16*a, 16*a, 16*a)//' /'// &
             new_line('a')//'&contact subcell=0 /'//new_line('a')// &
             '&damping kind=''viscous'', coefficient='//exact_text(0.225_wp/t)//' /'//new_line('a')// &
             '&tool name=''punch'', shape=''flat'', radius=1e-6, tip='//three(8*a, 8*a, (16.0_wp + gap)*a)// &
             ', axis=0,0,-1, times=0,'//exact_text(resting*t)//','// &
             exact_text((resting + 0.001_wp)*t)//','// &
             exact_text((resting + moving)*t)//','//exact_text((resting + moving + 0.001_wp)*t)// &
             ', speeds=0,0,'//exact_text(speed)//','//exact_text(speed)//',0 /'//new_line('a')// &
             '&atoms lower='//three(4*a, 4*a, 8*a)//', upper='//three(12*a, 12*a, 16*a)//', step=1e-14'// &
             ', mass=6.6335e-26, relaxation=''quench'', lattice=''fcc'', constant=5.27e-10, '//argon//' /'
      call read_scene(text, scene)
      if (.not. allocated(scene%bodies)) return
      call model%build(comm, scene, error)
      if (.not. error%happened()) call bound_speeds(model)
      call test%check(.not. error%happened(), 'the scene is built', error%message)
      box => coupling_of(model%atoms)
   end subroutine build

   real(wp) function step_of() result(step)
      step = 0.3_wp*4*crystal%constant/sqrt(crystal%c11/density)
   end function step_of

   function three(x, y, z) result(text)
      real(wp), intent(in) :: x, y, z
      character(len=:), allocatable :: text
      text = exact_text(x)//','//exact_text(y)//','//exact_text(z)
   end function three

   !> The crystal by its potential: scenes must have whole numbers of its constant.
   subroutine find_crystal()
      type(namelist_text_t) :: text
      type(group_reader_t) :: group
      type(error_t) :: error
      logical :: found
      call text%parse('&m '//argon//' /', error)
      call group%begin(text%groups(1))
      call crystal%potential%variables(group)
      call crystal%find_rest(5.27e-10_wp, found)
      call test%check(found, 'a crystal')
   end subroutine find_crystal

   !> Atoms that are thrown about come to rest; then the punch comes. The column under it is strained alike
   !> all over, but for the overlap with atoms.
   subroutine press_flat()
      type(model_t), target :: model
      type(balance_t) :: balance
      type(error_t) :: error
      real(wp) :: before, top, all, energy, load
      integer :: n
      call build(model)
      if (.not. allocated(model%atoms)) return
      call come_to_rest(model, resting)
      top = top_plane(model)
      energy = energy_of(model)
      call balance%begin(model)
      call balance%follow(model)
      before = balance%excess()
      do n = 1, moving + holding
         call advance(model, step_of(), error)
         call balance%follow(model)
         call test%check(.not. error%happened(), 'steps', error%message)
         if (error%happened()) return
      end do
      load = box%pushes(1)%impulse(3)/step_of()
      all = model%contact%states(1)%load(3)/(pressure(depth/16.0_wp)*(16*crystal%constant)**2)
      load = load/(pressure((top - top_plane(model))/(16*crystal%constant))*(8*crystal%constant)**2)
      energy = (energy_of(model) - energy)/box%tool_work
      call say('flat punch: load on all, of the elastic column''s', all)
      call say('flat punch: load on the atoms, of their column''s', load)
      before = (balance%excess() - before)/sum(model%contact%states%work)
      call say('flat punch: energy of all that is missing, of the work of the tool', -before)
      call test%check(abs(before) < 0.05_wp, 'balance of energy')
      call say('flat punch: energy of atoms with what they gave, of the tool''s work', energy)
      call test%check(abs(all - 1.0_wp) < 0.03_wp, 'load on all')
      ! the cell of the continuum that is pressed gives a tenth more; the sides of the few atoms bear that
      call test%check(abs(load - 1.0_wp) < 0.15_wp, 'load on the atoms')
      if (comm%is_root()) call test%check(abs(energy - 1.0_wp) < 0.05_wp, 'energy of the atoms')
      ! these are half a step of `moving` apart when the tool stops
      call test%check(abs(box%tool_work/box%tool_work_in_balance - 1.0_wp) < 1.2_wp/moving, &
                      'work of the tool on atoms, by steps of atoms and in the tool''s books')
      call go_back(model)
   end subroutine press_flat

   !> Steps that are taken once more, from the guard's copy, have the same bits.
   subroutine go_back(model)
      type(model_t), intent(inout), target :: model
      type(saved_state_t) :: saved
      type(balance_t) :: balance
      type(error_t) :: error
      real(wp), allocatable :: x(:, :)
      real(wp) :: load(3)
      integer :: n, round
      call balance%begin(model)
      call saved%take(model, balance)
      do round = 1, 2
         do n = 1, 2
            call advance(model, step_of(), error)
         end do
         if (round == 1) then
            load = model%contact%states(1)%load
            if (associated(box%atoms)) x = box%atoms%x
            call saved%give_back(model, balance)
         else
            call test%check(all(abs(load - model%contact%states(1)%load) <= 0.0_wp), 'load, once more')
            if (allocated(x)) &
               call test%check(all(abs(x - box%atoms%x) <= 0.0_wp), 'places of atoms, once more')
         end if
      end do
      call test%check(.not. error%happened(), 'steps', error%message)
   end subroutine go_back

   !> Of the lattice, strained along z alone, Pa.
   real(wp) function pressure(strain)
      real(wp), intent(in) :: strain
      real(wp) :: f(3, 3), s(3, 3)
      f = reshape([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp - strain], [3, 3])
      s = crystal%stress(f)
      pressure = -s(3, 3)
   end function pressure

   !> Mean height of the highest plane of atoms, m, on all ranks.
   real(wp) function top_plane(model)
      type(model_t), intent(in) :: model
      top_plane = 0.0_wp
      if (associated(box%atoms)) then
         associate (z => box%atoms%x(3, :box%atoms%real_atoms))
            top_plane = sum(z, mask=z > maxval(z) - 0.25_wp*crystal%constant) &
                        /count(z > maxval(z) - 0.25_wp*crystal%constant)
         end associate
      end if
      call MPI_Bcast(top_plane, 1, MPI_DOUBLE_PRECISION, 0, comm%comm)
   end function top_plane

   !> Of the atoms, with what they have given to the continuum and to quenching, J.
   real(wp) function energy_of(model) result(energy)
      type(model_t), intent(in) :: model
      energy = 0.0_wp
      if (.not. associated(box%atoms)) return
      associate (atoms => box%atoms)
         energy = atoms%potential_change() + atoms%kinetic() + atoms%repulsion%energy &
                  + atoms%relaxation%taken + box%work
      end associate
   end function energy_of

   !> What was taken from them is booked.
   subroutine come_to_rest(model, steps)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: steps
      type(error_t) :: error
      type(atom_fields_t) :: fields
      real(wp), allocatable :: x(:, :)
      real(wp) :: first(3), last(3)
      integer :: n
      if (associated(box%atoms)) then
         associate (atoms => box%atoms)
            allocate (x, mold=atoms%x)
            call random_number(x)
            x(:, atoms%real_atoms + 1:) = 0.5_wp
            call atoms%place_all(atoms%x + 0.05_wp*crystal%constant*(x - 0.5_wp))
            call fields_of(atoms, fields)
            first = [sum(fields%energy), atoms%kinetic(), atoms%largest_force()]
         end associate
      end if
      do n = 1, steps
         call advance(model, step_of(), error)
         call test%check(.not. error%happened(), 'steps', error%message)
         if (error%happened()) return
      end do
      if (.not. associated(box%atoms)) return
      associate (atoms => box%atoms)
         call fields_of(atoms, fields)
         last = [sum(fields%energy), atoms%kinetic(), atoms%largest_force()]
         associate (lost => first(1) - last(1) - last(2) - box%work)
            call say('quenched: largest force left, of the first', last(3)/first(3))
            call say('quenched: heat, of the energy lost', atoms%relaxation%taken/lost)
            call test%check(last(3) < 0.02_wp*first(3), 'forces vanish')
            call test%check(last(2) < 0.01_wp*(first(1) - last(1)), 'atoms rest')
            call test%check(abs(atoms%relaxation%taken/lost - 1.0_wp) < 0.05_wp, 'heat is booked')
         end associate
      end associate
   end subroutine come_to_rest

end program tools
