!> Atoms inside a grid. At rest, bonds across the interface, which pull and push each other, leave no force on
!> any node. A body and its box of atoms are set in a motion that strains both alike, by 1 % in six
!> components: no atom may feel a force, and no node of the grid, for the bonds balance the stress of the
!> continuum but for what comes of their coming to the strain in few steps. And a disturbed body that flies
!> keeps its momentum. `patch styles`: the strain with LAMMPS's files, and a thermostat; `patch 1050`: a
!> flight of so many steps.
!test: ranks 1 2
!test: limit 120
program patch
   use mpi_f08, only: MPI_Barrier
   use m_kinds, only: wp
   use m_advance, only: advance
   use m_communicator, only: communicator_t
   use m_coupling, only: coupling_t, coupling_of
   use m_energy, only: measure, sums_t
   use m_effects, only: known_effects
   use m_snapshot_formats, only: known_formats
   use m_errors, only: error_t
   use m_lammps, only: lammps_t, usual_library
   use m_lattice, only: lattice_t
   use m_materials, only: known_materials
   use m_model, only: model_t
   use m_offer, only: catalogue_t
   use m_polar, only: determinant
   use m_scene, only: scene_t
   use m_scene_reader, only: interpret_scene
   use m_speed_bounds, only: bound_speeds
   use m_text, only: exact_text
   use m_vectors, only: cross
   use m_assertions, only: assertions_t
   use m_chance, only: say
   use m_metal, only: write_metal
   implicit none
   character(len=*), parameter :: metal = 'build/test_patch.eam.alloy'
   character(len=*), parameter :: of_metal = 'potential='''//metal//''', element=''Xx'''
   character(len=*), parameter :: of_argon = &
      'style=''lj/smooth/linear'', epsilon=1.65e-21, sigma=3.405e-10, cutoff=8.5e-10'
   real(wp), parameter :: identity(3, 3) = reshape([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, &
                                                    0.0_wp, 1.0_wp], [3, 3])
   real(wp), parameter :: constant = 3.6044071e-10_wp !< of the metal, m, near it
   type(communicator_t) :: comm
   type(assertions_t) :: test
   type(lammps_t) :: lammps
   type(coupling_t), pointer :: box !< the atoms of the model of now
   character(len=:), allocatable :: complaint
   character(len=16) :: argument
   call comm%start()
   call test%start(comm, 'patch')
   call lammps%load(usual_library, complaint)
   if (complaint == '') then
      if (comm%is_root()) call write_metal(metal)
      call MPI_Barrier(comm%comm)
      call get_command_argument(1, argument)
      select case (argument)
      case ('styles') ! files of LAMMPS
         call strain_both('style=''eam'', potential=''Cu_u3.eam''', 8900.0_wp, 3.615e-10_wp)
         call strain_both('style=''eam/fs'', potential=''Al_mm.eam.fs'', element=''Al''', 2700.0_wp, &
                          4.05e-10_wp)
         call strain_both('potential=''Cu_mishin1.eam.alloy'', element=''Cu''', 8936.0_wp, &
                          3.615e-10_wp)
         call strain_both(of_argon//', lattice=''fcc'', constant=5.27e-10', 1777.0_wp, 5.27e-10_wp, &
                          ', mass=6.6335e-26')
         call strain_both('style=''lj/cut'', epsilon=1.65e-21, sigma=3.405e-10, cutoff=8.5e-10, '// &
                          'lattice=''fcc'', constant=5.27e-10', 1777.0_wp, 5.27e-10_wp, ', mass=6.6335e-26')
         call keep_warm()
      case default
         call rest()
         call rest_at_surface()
         call strain_both(of_metal, 8500.0_wp, constant)
         call fly()
      end select
   else
      if (comm%is_root()) print '(a)', '  left out, LAMMPS is not there: a box of atoms inside a grid'
      call test%check(index(complaint, 'LAMMPS cannot be opened') == 1, 'what is missing is said')
   end if
   call test%finish()

contains

   !> A cube of 12 cells of 4 constants, in the middle of which 2 x 2 x 2 cells are atoms.
   subroutine build(potential, density, a, model, more, up)
      character(len=*), intent(in) :: potential !< variables of law and atoms
      real(wp), intent(in) :: density, a        !< of the lattice
      type(model_t), intent(out), target :: model
      character(len=*), intent(in), optional :: more !< variables of the atoms alone
      real(wp), intent(in), optional :: up           !< how much higher the box is, m
      type(catalogue_t) :: catalogue
      type(scene_t) :: scene
      type(error_t) :: error
      character(len=:), allocatable :: text
      call known_materials(catalogue)
      call known_effects(catalogue)
      call known_formats(catalogue)
      text = '&scene title=''patch'', end_time=1 /'//new_line('a')// &
             '&grid lower='//three(0.0_wp)//', upper='//three(56*a)//', cell_size='//exact_text(4*a)//' /'// &
             '&material name=''m'', model=''cauchy_born'', density='//exact_text(density)//', '//potential// &
             ' /'//new_line('a')// &
             '&body material=''m'', shape=''box'', lower='//three(4*a)//', upper='//three(52*a)//' /'// &
             '&atoms lower='//three(24*a, up)//', upper='//three(32*a, up)//', step=1e-14, '//potential
      if (present(more)) text = text//more
      text = text//' /'
      call interpret_scene(comm, catalogue, text, scene, error)
      if (.not. error%happened()) call model%build(comm, scene, error)
      if (.not. error%happened()) call bound_speeds(model)
      model%works_ahead = .false.
      call test%check(.not. error%happened(), 'the scene is built', error%message)
      box => coupling_of(model%atoms)
   end subroutine build

   function three(x, up) result(text)
      real(wp), intent(in) :: x
      real(wp), intent(in), optional :: up
      character(len=:), allocatable :: text
      text = exact_text(x)//','//exact_text(x)//','//exact_text(x)
      if (present(up)) text = exact_text(x)//','//exact_text(x)//','//exact_text(x + up)
   end function three

   !> Particles are at the strain f and move as L (x - middle).
   subroutine strain_particles(model, f, l, middle)
      type(model_t), intent(inout) :: model
      real(wp), intent(in) :: f(3, 3), l(3, 3), middle(3)
      integer :: b, p, k
      associate (at => model%levels(1)%layout)
         do b = 1, size(model%levels(1)%blocks)
            associate (particles => model%levels(1)%blocks(b)%particles, column => &
                       model%levels(1)%blocks(b)%particles%column)
               do p = 1, particles%count
                  associate (x => column(p, at%position:at%position + 2))
                     x = middle + matmul(f, x - middle)
                     column(p, at%velocity:at%velocity + 2) = matmul(l, x - middle)
                  end associate
                  column(p, at%gradient:at%gradient + 8) = reshape(l, [9])
                  do k = at%domain, at%domain + 6, 3
                     column(p, k:k + 2) = matmul(f, column(p, k:k + 2))
                  end do
                  column(p, at%volume) = determinant(f)*column(p, at%volume)
                  select type (law => model%materials%slots(1)%law)
                  class is (lattice_t)
                     call law%settle(column, at, p, [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp], f)
                  end select
               end do
               call particles%changed()
            end associate
         end do
      end associate
   end subroutine strain_particles

   !> Nothing moves. Near neighbours press, others pull: only all bonds together, with those between two pads
   !> that cut an edge of the box, leave nodes in balance. The control leaves these out.
   subroutine rest()
      type(model_t), target :: model
      type(error_t) :: error
      real(wp), parameter :: c = sqrt(0.75_wp), turn(3, 3) = &
         reshape([c, 0.5_wp, 0.0_wp, -0.5_wp*c, c*c, 0.5_wp, 0.25_wp, -0.5_wp*c, c], [3, 3])
      real(wp) :: a, left(2)
      integer :: n, missed
      a = constant_of(of_argon, 5.27e-10_wp)
      call build(of_argon//', lattice=''fcc'', constant=5.27e-10', 1777.0_wp, a, model, ', mass=6.6335e-26')
      if (.not. allocated(model%atoms)) return
      do n = 1, 2
         call advance(model, 1.0e-13_wp, error)
         call test%check(.not. error%happened(), 'steps', error%message)
         if (error%happened()) return
      end do
      if (.not. comm%is_root()) return
      missed = 0
      do n = 1, 2
         associate (atoms => box%atoms)
            if (n == 2) then
               where (spread(atoms%bonds%across(1, :) > atoms%real_atoms, 1, 3)) atoms%force = 0.0_wp
            end if
            box%patch%given = 0.0_wp
            call atoms%mesh%add(box%patch, atoms%place, atoms%force, 1.0_wp, missed)
            left(n) = maxval(abs(box%patch%given))/(0.01_wp*atoms%spec%crystal%c11*(4*a)**2)
         end associate
      end do
      call say('at rest, force on a node, of the traction of a strain of 1 % on a cell', left(1))
      call say('control, without the bonds between two pads', left(2))
      call test%check(left(1) < 1.0e-9_wp, 'nothing pushes at rest')
      call test%check(left(2) > 1.0e-3_wp, 'bonds that cut edges count')
      associate (atoms => box%atoms)
         atoms%mesh%x = strained(atoms%mesh%x, turn, [28*a, 28*a, 28*a])
         call atoms%place_all(strained(atoms%x, turn, [28*a, 28*a, 28*a]))
         box%patch%motion(1, :, :, :) = 1.0_wp ! all nodes are there
         do n = 1, 2
            box%patch%given = 0.0_wp
            if (n == 1) call atoms%mesh%add(box%patch, atoms%place, atoms%force, 1.0_wp, missed)
            if (n == 2) call box%patch%add(atoms%place, atoms%force, 1.0_wp, missed)
            left(n) = maxval(abs(box%patch%given))/(atoms%spec%crystal%c44*(4*a)**2)
         end do
         call say('turned by 30 degrees, force on an atom, of c44 on a cell', &
                  atoms%largest_force()/(atoms%spec%crystal%c44*(4*a)**2))
         call say('force on a node, the same', left(1))
         call say('control, hat functions where bonds cross', left(2))
         call test%check(atoms%largest_force() < 1.0e-9_wp*atoms%spec%crystal%c44*(4*a)**2, 'atoms rest')
         call test%check(left(1) < 1.0e-9_wp .and. missed == 0, 'nothing pushes when all is turned')
      end associate
   end subroutine rest

   !> A box that reaches out of its body: the atoms of its surface relax, and nothing pushes the continuum but
   !> what its own surface, which is not modelled, would bear. The control pushes it by that.
   subroutine rest_at_surface()
      type(model_t), target :: model
      type(error_t) :: error
      real(wp) :: a, left(2), sums(3, 2)
      integer :: n, missed
      a = constant_of(of_metal, constant)
      call build(of_metal, 8500.0_wp, a, model, up=20*a)
      if (.not. allocated(model%atoms)) return
      call advance(model, 2.0e-14_wp, error)
      call test%check(.not. error%happened(), 'a step', error%message)
      if (error%happened() .or. .not. comm%is_root()) return
      associate (atoms => box%atoms)
         call atoms%lammps%command('minimize 0 1e-7 1000 3000')
         call atoms%lammps%command('run 0 post no')
         missed = 0
         do n = 1, 2
            if (n == 2) atoms%mesh%rest_load = 0.0_wp
            if (n == 2) atoms%mesh%rest_moment = 0.0_wp
            box%patch%given = 0.0_wp
            call atoms%mesh%add(box%patch, atoms%place, atoms%force, 1.0_wp, missed)
            left(n) = maxval(abs(box%patch%given))/(0.01_wp*atoms%spec%crystal%c11*(4*a)**2)
            sums(:, n) = sum(sum(sum(box%patch%given, 4), 3), 2)/(0.01_wp*atoms%spec%crystal%c11*(4*a)**2)
         end do
         call say('beside a surface at rest, force on a node, of the same', left(1))
         call say('control, with what the surface around bears', left(2))
         call test%check(left(1) < 1.0e-2_wp*left(2) .and. missed == 0, 'a surface at rest pushes nothing')
         call test%check(maxval(abs(sums)) < 1.0e-6_wp*left(2), 'and has no resultant')
      end associate
   end subroutine rest_at_surface

   !> Six strains of 1 % in eight steps, before the surface of the body is heard of: mesh and particles come
   !> to the strain alike. Then all are put to a strain, and to one with a turn: nothing is left on any node.
   !> With the reaction of bonds at the pads in place of where they cross, or where they cross by the hat
   !> functions themselves, nodes are pushed: the controls.
   subroutine strain_both(potential, density, near, more)
      character(len=*), intent(in) :: potential
      real(wp), intent(in) :: density, near !< kg/m3; a constant near the lattice's, m
      character(len=*), intent(in), optional :: more
      integer, parameter :: steps = 8
      type(model_t), target :: model
      type(error_t) :: error
      real(wp) :: l(3, 3), f(3, 3), a, step, middle(3)
      real(wp), allocatable :: first(:, :), mesh(:, :), x(:, :)
      integer :: n
      call build(potential, density, constant_of(potential, near), model, more)
      if (.not. allocated(model%atoms)) return
      a = box%spec%crystal%constant
      middle = 28*a
      step = 0.3_wp*4*a/sqrt(model%materials%slots(1)%law%p_wave_modulus()/density)
      l = 0.01_wp/(steps*step)*reshape([1.0_wp, 0.3_wp, -0.4_wp, 0.3_wp, -0.6_wp, 0.5_wp, -0.4_wp, 0.5_wp, &
                                        0.8_wp], [3, 3])
      if (associated(box%atoms)) then
         first = box%atoms%x
         mesh = box%atoms%mesh%x
      end if
      call strain_particles(model, identity, l, middle)
      if (associated(box%atoms)) call box%atoms%set_velocities([0.0_wp, 0.0_wp, 0.0_wp], l, middle)
      do n = 1, steps
         call advance(model, step, error)
         call test%check(.not. error%happened(), 'steps', error%message)
         if (error%happened()) return
      end do
      if (associated(box%atoms)) then ! which are half a step behind
         x = strained(mesh, identity + (steps - 0.5_wp)*step*l, middle)
         call say('in motion, the mesh of the interface is apart from the strained one, of the way', &
                  maxval(norm2(x - box%atoms%mesh%x, 1))/maxval(norm2(x - mesh, 1)))
         call test%check(maxval(norm2(x - box%atoms%mesh%x, 1)) < 2.0e-2_wp*maxval(norm2(x - mesh, 1)), &
                         'the mesh goes with the material')
         x = strained(first, identity + (steps - 0.5_wp)*step*l, middle)
         call test%check(maxval(norm2(x - box%atoms%x, 1)) < 2.0e-2_wp*maxval(norm2(x - first, 1)), &
                         'the atoms do')
      end if
      f = identity
      do n = 1, 3
         f(n, n) = 1.0_wp + 0.01_wp*(1.2_wp - 0.2_wp*n)
      end do
      call find_left(potential, density, near, f, step, 1.0e-10_wp, more)
      f = identity + steps*step*l
      f = matmul(f, reshape([1.0_wp, 0.01_wp, 0.0_wp, -0.01_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], &
                            [3, 3]))
      call find_left(potential, density, near, f, step, 1.0e-4_wp, more)
   end subroutine strain_both

   !> What is left on nodes once all are at the places of the strain f, at rest.
   subroutine find_left(potential, density, near, f, step, bound, more)
      character(len=*), intent(in) :: potential
      real(wp), intent(in) :: density, near, f(3, 3), step, bound !< kg/m3, m; the strain; s
      character(len=*), intent(in), optional :: more
      type(model_t), target :: anew
      type(error_t) :: error
      real(wp), allocatable :: places(:, :), forces(:, :), at_pads(:, :), first(:, :), mesh(:, :)
      real(wp) :: left(3), pull, traction, a, middle(3)
      integer :: k, missed
      call build(potential, density, constant_of(potential, near), anew, more)
      if (.not. allocated(anew%atoms)) return
      a = box%spec%crystal%constant
      middle = 28*a
      call strain_particles(anew, f, 0.0_wp*f, middle)
      if (associated(box%atoms)) then
         first = box%atoms%x
         mesh = box%atoms%mesh%x
         call box%atoms%place_all(strained(first, f, middle))
         mesh = strained(mesh, f, middle)
         box%atoms%mesh%x = mesh
         places = box%atoms%place
         forces = box%atoms%force
         at_pads = strained(first(:, box%atoms%bonds%across(2, :)), f, middle)
         pull = maxval(norm2(forces, 1))
         call say('force on an atom, of a bond''s', box%atoms%largest_force()/pull)
         call test%check(box%atoms%largest_force() < 1.0e-9_wp*pull, 'no atom is pushed')
      end if
      call advance(anew, step, error) ! what the nodes have of the continuum alone is known then
      call test%check(.not. error%happened(), 'steps', error%message)
      if (error%happened() .or. .not. comm%is_root()) return
      traction = maxval(abs(box%spec%crystal%stress(f)))*(4*a)**2
      missed = 0
      box%atoms%mesh%x = mesh
      do k = 1, 3
         box%patch%given = 0.0_wp
         if (k == 1) call box%atoms%mesh%add(box%patch, places, forces, 1.0_wp, missed)
         if (k == 2) call box%patch%add(places, forces, 1.0_wp, missed)
         if (k == 3) call box%patch%add(at_pads, forces, 1.0_wp, missed)
         left(k) = largest_left(anew)/traction
      end do
      call say('force left on a node, of the traction on a cell', left(1))
      call say('control, hat functions where bonds cross', left(2))
      call say('control, reactions at the pads', left(3))
      call test%check(left(1) < bound, 'no node is pushed')
      call test%check(left(2) > 1.0e-4_wp, 'hat functions alone push nodes')
      call test%check(left(3) > 2.0e-2_wp, 'reactions at the pads push nodes')
   end subroutine find_left

   !> Places (3, n) of a strain about the middle, m.
   pure function strained(x, f, middle) result(y)
      real(wp), intent(in) :: x(:, :), f(3, 3), middle(3)
      real(wp) :: y(3, size(x, 2))
      integer :: n
      do n = 1, size(x, 2)
         y(:, n) = middle + matmul(f, x(:, n) - middle)
      end do
   end function strained

   !> The constant by the potential, near one: scenes must have whole numbers of it.
   real(wp) function constant_of(potential, near) result(a)
      use m_bravais, only: bravais_t
      use m_group_reader, only: group_reader_t
      use m_namelist_text, only: namelist_text_t
      character(len=*), intent(in) :: potential
      real(wp), intent(in) :: near
      type(bravais_t) :: crystal
      type(namelist_text_t) :: text
      type(group_reader_t) :: group
      type(error_t) :: error
      logical :: found
      call text%parse('&m '//potential//' /', error)
      call group%begin(text%groups(1))
      call crystal%potential%variables(group)
      call crystal%find_rest(near, found)
      a = crystal%constant
   end function constant_of

   !> Largest sum of what the continuum and the bonds give to a node at the box, N.
   real(wp) function largest_left(model) result(largest)
      type(model_t), intent(in) :: model
      integer :: i, j, k
      largest = 0.0_wp
      associate (patch => box%patch)
         do k = 5, 9
            do j = 5, 9
               do i = 5, 9
                  associate (node => patch%motion(:, i, j, k))
                     largest = max(largest, maxval(abs(node(1)*node(5:7) + patch%given(:, i, j, k))))
                  end associate
               end do
            end do
         end do
      end associate
   end function largest_left

   !> Body and atoms turn, and are strained so fast that waves run: nothing pushes them from outside. What
   !> bonds give to the nodes in a step, atoms lose; the energy of both together stays.
   subroutine fly()
      integer :: steps
      type(model_t), target :: model
      type(error_t) :: error
      type(sums_t) :: sums
      real(wp) :: l(3, 3), step, a, p(3), q(3), start(6), now(6), scale(2), before(6), apart(6), drift
      real(wp), allocatable :: kept(:), moved(:), halves(:)
      integer :: n, total
      steps = 6
      total = 0
      apart = 0.0_wp
      if (argument /= '') read (argument, *) steps
      allocate (kept(steps), moved(steps), halves(steps))
      a = constant_of(of_argon, 5.27e-10_wp)
      call build(of_argon//', lattice=''fcc'', constant=5.27e-10', 1777.0_wp, a, model, ', mass=6.6335e-26')
      if (.not. allocated(model%atoms)) return
      step = 0.3_wp*4*a/sqrt(model%materials%slots(1)%law%p_wave_modulus()/1777.0_wp)
      l = 0.002_wp*min(1.0_wp, 20.0_wp/steps)/step &
          *reshape([0.1_wp, 0.4_wp, -0.3_wp, -0.2_wp, -0.2_wp, 0.4_wp, 0.3_wp, -0.1_wp, 0.2_wp], [3, 3])
      call strain_particles(model, identity, l, [26*a, 27*a, 29*a])
      if (associated(box%atoms)) &
         call box%atoms%set_velocities([0.0_wp, 0.0_wp, 0.0_wp], l, [26*a, 27*a, 29*a])
      do n = 0, steps
         if (n > 0) call advance(model, step, error)
         call test%check(.not. error%happened(), 'steps', error%message)
         if (error%happened()) return
         sums = measure(model)
         p = 0.0_wp ! the sums have the atoms as the last step left them: none yet in the first round
         q = 0.0_wp
         if (n == 0 .and. associated(box%atoms)) call box%atoms%momentum(p, q)
         now = [sums%momentum + p, sums%angular_momentum + q]
         if (n == 0) start = now
         if (.not. associated(box%atoms)) cycle
         call box%atoms%momentum(p, q)
         if (n == 0) cycle
         if (n > 1) apart = apart + [p, q] - before + given_to_nodes(model)
         total = total + box%atoms%steps
         before = [p, q]
         associate (atoms => box)
            kept(n) = atoms%sums%kinetic + atoms%sums%potential + atoms%work
            moved(n) = atoms%work
            halves(n) = kept(n) - atoms%atoms%bonds%stored
         end associate
      end do
      if (.not. comm%is_root()) return
      scale = [sums%mass*maxval(abs(l))*16*a, sums%mass*maxval(abs(l))*(16*a)**2]
      call say('momentum, change of the largest there could be', maxval(abs(now(:3) - start(:3)))/scale(1))
      call say('angular momentum, the same', maxval(abs(now(4:) - start(4:)))/scale(2))
      call test%check(maxval(abs(now(:3) - start(:3))) < 1.0e-12_wp*scale(1), 'momentum')
      call say('steps of the atoms', real(total, wp))
      call say('nodes get less than atoms lose by: momentum', maxval(abs(apart(:3)))/scale(1))
      call say('the same: angular momentum', maxval(abs(apart(4:)))/scale(2))
      call test%check(all(abs(apart) < 1.0e-12_wp*scale([1, 1, 1, 2, 2, 2])), 'what nodes get, atoms lose')
      call say('energy of atoms with what they gave, change, of that', range_of(kept)/range_of(moved))
      call say('control: with halves of the bonds that cross', range_of(halves)/range_of(moved))
      if (steps < 10) then
         call test%check(range_of(kept) < 0.01_wp*range_of(moved), 'energy')
      else
         ! the sum swings: bonds push the grid where they cross, and while waves run that point does not move
         ! quite as their lines do
         n = steps/4
         drift = (sum(kept(steps - n + 1:)) - sum(kept(:n)))/n
         call say('its drift: mean of the last quarter less that of the first', drift/range_of(moved))
         call test%check(abs(drift) < 0.05_wp*range_of(moved), 'drift of the energy')
      end if
   end subroutine fly

   pure real(wp) function range_of(values)
      real(wp), intent(in) :: values(:)
      range_of = maxval(values) - minval(values)
   end function range_of

   !> Atoms that begin at rest come to the temperature of the thermostat and keep it.
   subroutine keep_warm()
      integer, parameter :: steps = 50
      type(model_t), target :: model
      type(error_t) :: error
      real(wp), allocatable :: x(:, :), v(:, :)
      real(wp) :: a, mean
      integer :: n
      a = constant_of(of_argon, 5.27e-10_wp)
      call build(of_argon//', lattice=''fcc'', constant=5.27e-10', 1777.0_wp, a, model, &
                 ', mass=6.6335e-26, temperature=20, thermostat_rate=2e12')
      if (.not. allocated(model%atoms)) return
      if (associated(box%atoms)) then
         allocate (x(3, sum(box%counts)), v(3, sum(box%counts)))
         call box%atoms%get_motion(x, v)
         v = 0.0_wp
         call box%atoms%set_motion(x, v)
      end if
      mean = 0.0_wp
      do n = 1, steps
         call advance(model, 3.0e-13_wp, error)
         call test%check(.not. error%happened(), 'steps', error%message)
         if (error%happened()) return
         if (n > steps/2 .and. associated(box%atoms)) mean = mean + box%atoms%temperature()
      end do
      if (.not. comm%is_root()) return
      mean = mean/(steps - steps/2)
      call say('thermostat of 20 K: temperature of all atoms', mean)
      call test%check(abs(mean - 20.0_wp) < 1.5_wp, 'the temperature is kept')
   end subroutine keep_warm

   !> Impulse and angular impulse of the step on the nodes of the patch, N s, N m s.
   function given_to_nodes(model) result(given)
      type(model_t), intent(in) :: model
      real(wp) :: given(6), x(3)
      integer :: i, j, k
      given = 0.0_wp
      associate (patch => box%patch)
         do k = patch%low(3), patch%high(3)
            do j = patch%low(2), patch%high(2)
               do i = patch%low(1), patch%high(1)
                  x = patch%origin + patch%cell*([i, j, k] - patch%low)
                  given(:3) = given(:3) + patch%given(:, i, j, k)
                  given(4:) = given(4:) + cross(x, patch%given(:, i, j, k))
               end do
            end do
         end do
      end associate
   end function given_to_nodes

end program patch
