!> A box of atoms inside the finest level (theory.md, Atoms): within each step of that level the atoms take
!> many of their own. Pads go with the nodes; bonds that cross the interface push them.
module m_coupling
   use mpi_f08
   use m_kinds, only: wp
   use m_constants, only: exit_files, exit_input, exit_numerical
   use m_errors, only: error_t, fail
   use m_atom_fields, only: defects_of, write_dump_of => write_dump
   use m_atoms, only: atoms_t
   use m_atoms_place, only: check_box, find_host, particle_width, refuse_others
   use m_communicator, only: communicator_t
   use m_dynamics, only: dynamics_t
   use m_effect, only: effect_slot_t
   use m_embedded_model, only: embedded_model_t, embedded_reals
   use m_material, only: material_t
   use m_level, only: level_t
   use m_node_patch, only: node_patch_t
   use m_relaxation, only: relaxation_t
   use m_scene, only: scene_t
   use m_shape, only: shape_t
   use m_surface_rest, only: find_surface_rest
   use m_text, only: si, to_text
   use m_tool, only: tool_t
   use m_tool_reactions, only: reaction_t
   use m_tool_repulsion, only: push_reals, tool_push_t
   implicit none
   private
   public :: build_atoms, coupling_of

   real(wp), parameter :: alike = 1.0e-2_wp   !< moduli and densities that are said to be the same
   real(wp), parameter :: edge_margin = 3.0_wp !< cells between pads and the edge of the finest level

   type, public, extends(embedded_model_t) :: coupling_t
      type(atoms_t) :: spec
      type(dynamics_t), pointer :: atoms => null() !< on rank 0
      type(node_patch_t) :: patch
      real(wp) :: behind = 0.0_wp                  !< how far the atoms are behind the particles, s
      type(tool_push_t), allocatable :: pushes(:)  !< (tools) of the last step
      integer :: counts(3) = 0                     !< real atoms, pads, corners of the mesh of the interface
   contains
      procedure :: build
      procedure :: couple
      procedure :: push_tools
      procedure :: follow_contact
      procedure :: accumulate
      procedure :: get_state
      procedure :: set_state
      procedure :: row
      procedure :: write_dump
      procedure :: file
   end type coupling_t

contains

   !> Collective: the box of atoms of a scene that has one; else there is none.
   subroutine build_atoms(embedded, effects, scene, communicator, error)
      class(embedded_model_t), allocatable, intent(out) :: embedded
      type(effect_slot_t), intent(in) :: effects(:)
      type(scene_t), intent(in) :: scene
      type(communicator_t), intent(in) :: communicator
      type(error_t), intent(inout) :: error
      type(coupling_t), allocatable :: coupling
      integer :: e
      do e = 1, size(effects)
         select type (spec => effects(e)%effect)
         type is (atoms_t)
            allocate (coupling)
            coupling%timer = effects(e)%row
            call coupling%build(spec, scene, communicator, error)
            call move_alloc(coupling, embedded)
         end select
      end do
   end subroutine build_atoms

   !> The box of atoms of a model; nowhere if it has none.
   function coupling_of(embedded) result(coupling)
      class(embedded_model_t), allocatable, intent(in), target :: embedded
      type(coupling_t), pointer :: coupling
      coupling => null()
      if (.not. allocated(embedded)) return
      select type (embedded)
      type is (coupling_t)
         coupling => embedded
      end select
   end function coupling_of

   !> Collective: the atoms of a scene that has a group for them.
   subroutine build(self, spec, scene, communicator, error)
      class(coupling_t), intent(inout) :: self
      type(atoms_t), intent(in) :: spec
      type(scene_t), intent(in) :: scene
      type(communicator_t), intent(in) :: communicator
      type(error_t), intent(inout) :: error
      class(shape_t), allocatable :: body
      real(wp) :: lower(3), upper(3)
      character(len=:), allocatable :: complaint
      integer :: host, ignored, k
      self%spec = spec
      call refuse_others(spec, scene, error)
      if (.not. error%happened()) call find_host(spec, scene, host, body, lower, upper, error)
      if (.not. error%happened()) call check_box(spec, scene, lower, upper, host, error)
      if (error%happened()) return
      complaint = ''
      if (communicator%is_root()) then
         allocate (self%atoms)
         call self%atoms%create(spec, body, lower, upper, particle_width(scene, host), complaint)
         if (complaint == '') call find_surface_rest(self%atoms%mesh, spec, body, lower, upper, &
                                                     particle_width(scene, host), complaint)
         if (complaint == '') ignored = defects_of(self%atoms)
         if (complaint /= '') call fail(error, exit_input, spec%group_text()//': '//complaint)
         self%counts = [self%atoms%real_atoms, self%atoms%atoms - self%atoms%real_atoms, &
                        size(self%atoms%mesh%x, 2)]
      end if
      call communicator%agree(error)
      if (error%happened()) return
      if (communicator%is_root()) call self%atoms%set_velocities(scene%bodies(host)%velocity, &
            reshape([(0.0_wp, k=1, 9)], [3, 3]), [0.0_wp, 0.0_wp, 0.0_wp])
      call MPI_Bcast(self%counts, 3, MPI_INTEGER, 0, communicator%comm)
      call share_sums(self, communicator)
      allocate (self%pushes(size(scene%tools)))
      call describe(self, scene, host)
   end subroutine build

   !> What there is, and how well the law of the body goes with the atoms.
   subroutine describe(self, scene, host)
      class(coupling_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: host
      real(wp) :: theirs(3), ours(3), density, apart
      associate (crystal => self%spec%crystal, material => scene%materials(scene%bodies(host)%material))
         ours = [crystal%c11, crystal%c12, crystal%c44]
         theirs = 0.0_wp
         select type (law => material%law)
         class is (material_t)
            theirs = law%cubic_constants()
         end select
         density = self%spec%mass/crystal%volume
         apart = maxval(abs(theirs/ours - 1.0_wp))
         self%note = 'atoms      '//to_text(self%counts(1))//' atoms and '//to_text(self%counts(2))// &
                     ' pads; lattice of '//si(crystal%constant, 'm')//', c11, c12, c44 '// &
                     si(ours(1), 'Pa')//', '//si(ours(2), 'Pa')//', '//si(ours(3), 'Pa')//', '// &
                     si(density, 'kg/m3')
         if (size(scene%tools) > 0) self%note = self%note//'; tools press atoms nearer than '// &
            si(self%spec%tool_distance, 'm')//' by '//si(self%spec%tool_stiffness, 'N/m2')// &
            ' times the square of the rest'
         if (apart > alike) self%note = self%note//'; warning: those of the body are '// &
            si(theirs(1), 'Pa')//', '//si(theirs(2), 'Pa')//', '//si(theirs(3), 'Pa')// &
            ': the interface throws waves back'
         if (abs(material%density/density - 1.0_wp) > alike) &
            self%note = self%note//'; warning: the body has '//si(material%density, 'kg/m3')
      end associate
   end subroutine describe

   !> Collective: the atoms go through a step of the finest level, whose nodes have been solved without them;
   !> the bonds' impulses change the motion of its nodes.
   subroutine couple(self, communicator, level, is_nested, tools, time, time_step, error)
      class(coupling_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(inout) :: level
      logical, intent(in) :: is_nested         !< there is a coarser level
      type(tool_t), intent(in) :: tools(:)     !< as the step before has left them
      real(wp), intent(in) :: time, time_step  !< s
      type(error_t), intent(inout) :: error
      real(wp) :: box(3, 2), sums(3)
      box = 0.0_wp
      if (communicator%is_root()) box = reshape([minval(self%atoms%x, 2), maxval(self%atoms%x, 2)], [3, 2])
      call MPI_Bcast(box, 6, MPI_DOUBLE_PRECISION, 0, communicator%comm)
      call self%patch%cover(level, box(:, 1), box(:, 2))
      call self%patch%gather(communicator, level)
      sums = 0.0_wp
      if (communicator%is_root()) then
         call move_atoms(self, tools, time, time_step, error)
         sums = [self%patch%work(time_step), merge(1.0_wp, 0.0_wp, error%happened()), self%tool_work]
      end if
      if (size(tools) > 0) call MPI_Bcast(self%pushes, push_reals*size(tools), MPI_DOUBLE_PRECISION, 0, &
                                          communicator%comm)
      call MPI_Bcast(self%patch%given, size(self%patch%given), MPI_DOUBLE_PRECISION, 0, communicator%comm)
      call MPI_Bcast(sums, 3, MPI_DOUBLE_PRECISION, 0, communicator%comm)
      if (is_nested) then
         if (.not. level%region%holds_box(box(:, 1), box(:, 2), edge_margin*level%grid%cell)) &
            call fail(error, exit_numerical, self%spec%group_text()//': the pads are within '// &
                      to_text(edge_margin, 2)//' cells of the edge of the finest level; use a larger one')
      end if
      if (sums(2) > 0.0_wp .or. error%happened()) call communicator%agree(error)
      if (error%happened()) return
      self%work = self%work + sums(1)
      self%tool_work = sums(3)
      call share_sums(self, communicator)
      call self%patch%apply(level, time_step)
   end subroutine couple

   !> Collective: the sums of rank 0's atoms as they are now.
   subroutine share_sums(self, communicator)
      class(coupling_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      if (associated(self%atoms)) then
         associate (atoms => self%atoms)
            self%sums%mass = atoms%mass*atoms%real_atoms
            self%sums%kinetic = atoms%kinetic()
            self%sums%potential = atoms%potential_change() + atoms%repulsion%energy
            self%sums%taken = atoms%relaxation%taken + atoms%bath%taken
            call atoms%momentum(self%sums%momentum, self%sums%angular_momentum)
         end associate
      end if
      call MPI_Bcast(self%sums, embedded_reals, MPI_DOUBLE_PRECISION, 0, communicator%comm)
   end subroutine share_sums

   !> Rank 0: the atoms, which are half a step behind the places of particles, as the velocities of these are,
   !> go through the second half of the step before and the first half of this one, for which the pads get the
   !> velocities that the forces of now will give to the nodes (theory.md, eq. atoms-step).
   subroutine move_atoms(self, tools, time, time_step, error)
      class(coupling_t), intent(inout) :: self
      type(tool_t), intent(in) :: tools(:)
      real(wp), intent(in) :: time, time_step
      type(error_t), intent(inout) :: error
      character(len=:), allocatable :: complaint
      real(wp), allocatable :: given(:, :, :, :)
      integer :: lost
      logical :: rests
      complaint = ''
      rests = .not. self%behind > 0.0_wp
      associate (patch => self%patch, atoms => self%atoms)
         atoms%missed = 0
         patch%given = 0.0_wp
         call atoms%bath%begin_round()
         if (size(tools) > 0) call atoms%repulsion%place_tools(tools, -self%behind)
         if (.not. rests) call atoms%advance(self%behind, patch, complaint, anew=.true.)
         if (size(tools) > 0) call atoms%repulsion%begin_step(time, time_step)
         given = patch%given
         patch%given = 0.0_wp
         call atoms%mesh%add(patch, atoms%place, atoms%force, time_step, atoms%missed)
         lost = atoms%pad_velocities(patch, expects=.true.)
         patch%given = given
         self%behind = 0.5_wp*time_step
         if (complaint == '') call atoms%advance(self%behind, patch, complaint, anew=rests)
         if (size(tools) > 0) then
            self%pushes = atoms%repulsion%pushes
            self%tool_work = self%tool_work + sum(self%pushes%work)
            atoms%repulsion%pushes = tool_push_t()
         end if
         lost = lost + atoms%pad_velocities(patch, expects=.false.)
         if (complaint /= '') then
            call fail(error, exit_numerical, self%spec%group_text()//': '//complaint)
         else if (lost > 0 .or. atoms%missed > 0) then
            call fail(error, exit_numerical, self%spec%group_text()//': the material around the box is '// &
                      'missing at '//to_text(lost + atoms%missed)//' pads or bonds; leave more of it '// &
                      'around the box')
         else if (atoms%bonds%is_broken() .and. .not. self%spec%goes_on()) then
            call fail(error, exit_numerical, self%spec%group_text()//': a defect has reached the '// &
                      'interface (bonds there have changed by '// &
                      to_text(100.0_wp*atoms%bonds%worst, 3)//' %); make the box larger, or go on with '// &
                      'at_interface=''go_on''')
         end if
      end associate
   end subroutine move_atoms

   !> Rank 0: what the atoms have done to the tools in the step counts with the reactions of this rank.
   subroutine push_tools(self, reactions, time_step)
      class(coupling_t), intent(in) :: self
      type(reaction_t), intent(inout) :: reactions(:) !< (tools)
      real(wp), intent(in) :: time_step !< s
      integer :: t
      if (.not. associated(self%atoms)) return
      do t = 1, size(reactions)
         reactions(t)%load = reactions(t)%load + self%pushes(t)%impulse/time_step
         reactions(t)%moment = reactions(t)%moment + self%pushes(t)%turn/time_step
      end do
   end subroutine push_tools

   !> Collective: contact has changed the motion of the nodes, or not: the pads go with what came of it, and
   !> expect as much in the next step.
   subroutine follow_contact(self, communicator, level, changed)
      class(coupling_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(in) :: level
      logical, intent(in) :: changed !< the same on all ranks
      integer :: lost
      if (changed) call self%patch%gather(communicator, level)
      if (.not. associated(self%atoms)) return
      associate (atoms => self%atoms)
         atoms%pad_push = 0.0_wp
         if (.not. changed) return
         self%patch%given = 0.0_wp
         atoms%pad_push = -atoms%pad_speed
         lost = atoms%pad_velocities(self%patch, expects=.false.) ! as many as in this step before
         atoms%pad_push = atoms%pad_push + atoms%pad_speed
      end associate
   end subroutine follow_contact

   !> The tools have given way: their work of the step on the atoms as their own balance has it, by one
   !> velocity for the whole step. It is none on the particles.
   subroutine accumulate(self, tools)
      class(coupling_t), intent(inout) :: self
      type(tool_t), intent(in) :: tools(:)
      integer :: t
      do t = 1, size(tools)
         self%tool_work_in_balance = self%tool_work_in_balance &
                                     - dot_product(self%pushes(t)%impulse, tools(t)%velocity) &
                                     - dot_product(self%pushes(t)%turn, tools(t)%spin)
      end do
   end subroutine accumulate

   !> What the next step reads besides particles and tools: places and velocities of all atoms (LAMMPS's
   !> units) and of the mesh of the interface (SI), what contact adds to the speeds of pads and mesh (m/s),
   !> zeros on other ranks than 0; works so far.
   subroutine get_state(self, x, v, pushes, sums)
      class(coupling_t), intent(in) :: self
      real(wp), allocatable, intent(out) :: x(:, :), v(:, :), pushes(:, :), sums(:)
      integer :: k
      allocate (x(3, sum(self%counts)), v(3, sum(self%counts)), pushes(3, sum(self%counts(2:))), &
                source=0.0_wp)
      sums = [self%behind, self%work, self%tool_work, self%tool_work_in_balance, self%sums%taken, &
              self%sums%kinetic, self%sums%potential, self%sums%momentum, self%sums%angular_momentum, &
              [(0.0_wp, k=1, 6)]]
      if (.not. associated(self%atoms)) return
      call self%atoms%get_motion(x, v)
      pushes = self%atoms%pad_push
      associate (relaxation => self%atoms%relaxation, bath => self%atoms%bath)
         sums(14:) = [self%atoms%bonds%stored, relaxation%taken, relaxation%angle, relaxation%downhill, &
                      bath%taken, bath%rounds]
      end associate
   end subroutine get_state

   subroutine set_state(self, x, v, pushes, sums)
      class(coupling_t), intent(inout) :: self
      real(wp), intent(in) :: x(:, :), v(:, :), pushes(:, :), sums(:)
      self%behind = sums(1)
      self%work = sums(2)
      self%tool_work = sums(3)
      self%tool_work_in_balance = sums(4)
      self%sums%taken = sums(5)
      self%sums%kinetic = sums(6)
      self%sums%potential = sums(7)
      self%sums%momentum = sums(8:10)
      self%sums%angular_momentum = sums(11:13)
      if (.not. associated(self%atoms)) return
      call self%atoms%set_motion(x, v)
      self%atoms%pad_push = pushes
      self%atoms%bonds%stored = sums(14)
      self%atoms%relaxation = relaxation_t(sums(16), sums(17), sums(15))
      self%atoms%bath%taken = sums(18)
      self%atoms%bath%rounds = sums(19)
   end subroutine set_state

   !> A row of the history (io/atoms_output.f90 has the columns). Zeros on other ranks than 0.
   function row(self) result(values)
      class(coupling_t), intent(inout) :: self
      real(wp), allocatable :: values(:)
      allocate (values(17), source=0.0_wp)
      if (.not. associated(self%atoms)) return
      associate (atoms => self%atoms)
         values(1) = atoms%kinetic()
         values(2) = atoms%potential_change()
         values(3) = atoms%temperature()
         call atoms%momentum(values(4:6), values(7:9))
         values(10) = self%work
         values(11) = atoms%disorder()
         values(12) = atoms%largest_force()
         values(13) = self%tool_work
         values(14) = atoms%repulsion%energy
         values(15) = self%sums%taken
         values(16) = defects_of(atoms)
         values(17) = atoms%bonds%worst
      end associate
   end function row

   !> Name of a file of theirs.
   pure function file(self, ending) result(name)
      class(coupling_t), intent(in) :: self
      character(len=*), intent(in) :: ending
      character(len=:), allocatable :: name
      name = 'atoms_'//self%spec%label//ending
   end function file

   !> Rank 0 writes a dump of all atoms, with a snapshot.
   subroutine write_dump(self, path, error)
      class(coupling_t), intent(inout) :: self
      character(len=*), intent(in) :: path
      type(error_t), intent(inout) :: error
      if (.not. associated(self%atoms)) return
      call write_dump_of(self%atoms, path)
      if (self%atoms%lammps%fault /= '') call fail(error, exit_files, self%atoms%lammps%fault)
   end subroutine write_dump

end module m_coupling
