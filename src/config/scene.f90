!> The contents of a scene, after reading and checking: one type a namelist group, values in SI units (angles
!> in radians). doc/user/input.md is the table of all names.
module m_scene
   use m_kinds, only: wp, i8
   use m_constants, only: pi
   use m_text, only: to_text, si
   use m_polar, only: polar
   use m_rotations, only: no_rotation, from_euler, quaternion_of
   use m_group_reader, only: name_length
   use m_offer, only: offer_t, offer_slot_t
   use m_section, only: section_t
   use m_domain_kinds, only: domain_fixed
   use m_side_kinds, only: boundary_free
   use m_shape, only: shape_t
   use m_friction_law, only: surface_friction_t
   implicit none
   private
   public :: safety_limit, largest_safety

   integer, parameter, public :: update_usl = 1, update_usf = 2, update_musl = 3
   integer, parameter, public :: because_law = 1, because_surface = 2, because_single = 3
   integer, parameter, public :: fill_by_shape = 0, fill_whole = 1, fill_share = 2
   integer, parameter, public :: level_box = 1, level_sphere = 2
   integer, parameter, public :: criterion_none = 0, criterion_stress = 1, criterion_strain = 2, &
                                 criterion_error = 3
   integer, parameter, public :: min_cells = 10**3 !< of a box placed by a criterion: four cells along
                                                      !< each axis, five beside a side
   character(len=*), parameter, public :: rest_group = 'rest' !< the contact group of bodies without one
   integer, parameter, public :: start_apart = 1, start_as_is = 2
   integer, parameter, public :: mode_static = 1, mode_newmark = 2
   integer, parameter, public :: preconditioner_jacobi = 1, preconditioner_gamg = 2, &
                                 preconditioner_bpx = 3

   !> &grid: the background grid. Sides in the order x- x+ y- y+ z- z+.
   type, public :: grid_spec_t
      real(wp) :: lower(3) = 0.0_wp      !< m
      real(wp) :: upper(3) = 0.0_wp      !< m
      real(wp) :: cell_size = 0.0_wp     !< m
      integer :: cells(3) = 0            !< derived from the three above
      integer :: boundary(6) = boundary_free
      type(section_t) :: section         !< section that defines the whole scene, with its bodies and tools
   end type grid_spec_t

   !> The largest safety for particles_per_cell 1, 8 and 27 (doc/user/accuracy.md, stability).
   integer, parameter, public :: safety_particles(3) = [1, 8, 27]
   real(wp), parameter, public :: safety_allowed(3) = [0.4_wp, 0.4_wp, 0.35_wp]

   !> &time: time stepping.
   type, public :: time_spec_t
      real(wp) :: safety = 0.35_wp       !< Courant number: share of cell / (c + |v|)
      real(wp) :: time_step = 0.0_wp     !< s; 0 means automatic
      integer :: stress_update = update_usl
      real(wp) :: flip_fraction = 1.0_wp !< 1 is FLIP, 0 is PIC
      logical :: affine = .true.         !< transfer: affine or plain
      integer :: domain = domain_fixed   !< how the domains of particles deform
      logical :: subcycle = .true. !< each level takes two steps per step of its parent; else all use the
                                   !< finest level's step
   end type time_spec_t

   !> &material
   type, public :: material_spec_t
      character(len=:), allocatable :: name
      real(wp) :: density = 0.0_wp       !< kg/m3
      class(offer_t), allocatable :: law !< the model, with its own variables
   end type material_spec_t

   !> &body
   type, public :: body_spec_t
      character(len=:), allocatable :: name
      integer :: material = 0            !< index into scene_t%materials
      class(shape_t), allocatable :: shape
      integer :: particles_per_cell = 8  !< 1, 8, 27
      real(wp) :: velocity(3) = 0.0_wp   !< m/s
      real(wp) :: angular_velocity(3) = 0.0_wp !< rad/s about the body's own centre
      real(wp), allocatable :: orientation(:) !< of the material's axes: Bunge's phi1 Phi phi2, degrees, or
                                              !< the directions of the axes, nine numbers; absent: as the
                                              !< grid's
      real(wp) :: stress(6) = 0.0_wp     !< at the start: xx yy zz yz xz xy, Pa
      integer :: fill = fill_by_shape    !< whole particles, or parts of them where the surface cuts
      character(len=:), allocatable :: contact_group !< bodies of one group are bonded where they touch;
                                                     !< empty: the group of all bodies without a name
      integer :: field = 1               !< number of the group: its bodies share a velocity field
      type(section_t) :: section         !< section that defines the body, as the grid's
   contains
      procedure :: turned_axes
   end type body_spec_t

   !> &cut: boolean subtraction from a body
   type, public :: cut_spec_t
      integer :: body = 0                !< index into scene_t%bodies
      class(shape_t), allocatable :: shape
   end type cut_spec_t

   !> &motion: a degree of freedom of a tool.
   type, public :: motion_spec_t
      logical :: turns = .false.         !< rotation (kind 'turn'), else translation ('slide')
      real(wp) :: axis(3) = 0.0_wp       !< unit vector
      real(wp) :: point(3) = 0.0_wp      !< of a rotation: on its axis at the start, m
      real(wp), allocatable :: times(:) !< s, rising; speed or load are constant before the first and after
                                        !< the last
      real(wp), allocatable :: speeds(:) !< m/s or rad/s, linear in between; or
      real(wp), allocatable :: loads(:)  !< N or N m on the tool, for the modelled part of the body
      real(wp) :: mass = 0.0_wp          !< with loads: mass (kg) or inertia (kg m2) of the modelled part
      real(wp) :: initial_speed = 0.0_wp !< with loads: m/s or rad/s
      integer :: number = 0              !< of the group in the scene; 0: along the axis, by the &tool itself
   end type motion_spec_t

   !> &tool
   type, public :: tool_spec_t
      character(len=:), allocatable :: name
      class(shape_t), allocatable :: shape
      real(wp) :: tip(3) = 0.0_wp        !< the foremost point at the start, m
      real(wp) :: axis(3) = [0.0_wp, 0.0_wp, -1.0_wp] !< unit vector, the direction in which the tool points
                                                      !< and moves
      real(wp), allocatable :: times(:) !< s, rising; speed or load are constant before the first and after
                                        !< the last
      real(wp), allocatable :: speeds(:) !< m/s along the axis, linear in between; or
      real(wp), allocatable :: loads(:)  !< N along the axis on the tool, for the modelled part of the body
      real(wp) :: mass = 0.0_wp          !< with loads: of the modelled part of the tool, kg
      real(wp) :: initial_speed = 0.0_wp !< with loads: along the axis, m/s
      logical :: stands = .false. !< no motion along its axis is given: it does not move
      type(motion_spec_t), allocatable :: motions(:) !< further freedoms; absent if none
      real(wp) :: penetration_factor = 0.5_wp
      type(surface_friction_t) :: friction
   end type tool_spec_t

   !> &level: a box or a sphere of cells half the size of those of a level before it. Several that refine one
   !> level are parts of the region of the next.
   type, public :: level_spec_t
      integer :: of = 1 !< number of the level that it refines, the grid is 1
      integer :: shape = level_box
      real(wp) :: lower(3) = 0.0_wp      !< m; of a moving box: at the start
      real(wp) :: upper(3) = 0.0_wp      !< m
      real(wp) :: center(3) = 0.0_wp     !< of a sphere, m; likewise
      real(wp) :: radius = 0.0_wp        !< of a sphere, m
      real(wp) :: inner_radius = 0.0_wp  !< of a shell: coarser cells inside it, m; 0: a ball
      integer :: follow = 0 !< number in scene_t%leaders of what the box moves with; 0: it does not move
      integer :: criterion = criterion_none !< places the box by the gradient of von Mises stress or of
                                            !< strain, or cells by the estimated error of the stress
      integer :: max_cells = 1000000     !< with a criterion: of the level's own cells, in its region
      real(wp) :: max_memory = 0.0_wp !< with criterion_error: of the same cells, on all ranks, B; 0: no limit
      real(wp) :: tolerance = 0.05_wp !< with criterion_error: of the stress, relative to the largest
      real(wp) :: bytes_a_cell = 0.0_wp !< where max_memory limits max_cells, B; else 0
      logical :: has_box = .true. !< if not, with criterion_error, it starts around the tools' tips
   contains
      procedure :: budget
      procedure :: in_budget
   end type level_spec_t

   !> &probe
   type, public :: probe_spec_t
      character(len=:), allocatable :: name
      real(wp) :: position(3) = 0.0_wp   !< m
   end type probe_spec_t

   real(wp), parameter, public :: hopeless_residual = 1.0e-3_wp !< relative, of a contact problem: a larger
                                                                !< one is an error

   !> &contact
   type, public :: contact_spec_t
      real(wp) :: tolerance = 1.0e-8_wp  !< residual of the contact problem relative to its right-hand side
      integer :: max_iterations = 200
      real(wp) :: compliance = 0.01_wp   !< of a contact point, in time step over mass of its particle
      real(wp) :: subcell = 0.35_wp      !< compliance of the half-space below a cell, in cells over its
                                         !< modulus; 0: none
   end type contact_spec_t

   !> &body_contact: contact between bodies of two groups.
   type, public :: body_contact_spec_t
      integer :: groups(2) = 0           !< their numbers; 0: all pairs without their own &body_contact
      type(surface_friction_t) :: friction
      real(wp) :: adhesion = 0.0_wp      !< work of separation, J/m2
      real(wp) :: cohesive_range = 0.0_wp !< gap up to which adhesion acts, m
      real(wp) :: bond_strength = 0.0_wp !< of surfaces in contact at the start, Pa; it softens as it opens,
                                         !< with the total work `adhesion`
      integer :: start = start_apart     !< treatment of an overlap at the start
      real(wp) :: press_fit = 0.0_wp     !< time over which the initial interference is ramped to zero, s
   end type body_contact_spec_t

   !> &quasi_static: implicit steps, without inertia or with it.
   type, public :: quasi_static_spec_t
      logical :: present = .false.       !< no &quasi_static group: the explicit scheme
      real(wp) :: step = 0.0_wp          !< length of the first step, s
      real(wp) :: max_step = 0.0_wp      !< s; 0: limited by accuracy alone
      real(wp) :: from = 0.0_wp          !< start time of implicit steps, s: before it the scheme is explicit
      real(wp) :: to = huge(1.0_wp)      !< and their end, s; huge: none
      real(wp) :: ramp = 0.0_wp          !< time over which the loads of effects are ramped up, s
      real(wp) :: tolerance = 1.0e-6_wp  !< residual, relative to the forces in balance
      real(wp) :: creep_limit = 0.1_wp   !< share of the stress that may relax at rest in a step
      real(wp) :: stabilisation = 1.0_wp/30.0_wp !< of the ghost penalty, in Young's modulus; 0: none
      logical :: iterations = .false.    !< print every Newton iteration
      integer :: mode = mode_static
      integer :: preconditioner = preconditioner_bpx
      real(wp) :: theta = 0.5_wp         !< with inertia: weight of the step's end in its mean forces and
                                         !< speeds
   contains
      procedure :: holds_at
      procedure :: has_inertia
   end type quasi_static_spec_t

   !> &guard
   type, public :: guard_spec_t
      integer :: retries = 3             !< after an error, each with half the time step; 0: an error ends the
                                         !< run
      integer :: save_every = 200 !< steps between copies, and between checks of all fields and the energy
      real(wp) :: memory = 1.0e9_wp      !< bytes a rank that the copy may take; 0: no copy
      real(wp) :: energy_limit = 0.5_wp !< spurious energy over the largest energy or work; 0: not checked
      real(wp) :: work_limit = 0.25_wp !< work of loads that particles do not receive, in the same ratio; 0:
                                       !< not checked
      real(wp) :: step_limit = 1.0e-3_wp !< smallest time step over the first one
   end type guard_spec_t

   !> &output
   type, public :: output_spec_t
      logical :: present = .false.       !< no &output group: console output only
      character(len=:), allocatable :: directory
      real(wp) :: every = 0.0_wp         !< s between snapshots of the particles; 0 means first and last only
      real(wp) :: history_every = 0.0_wp !< s between lines of the histories; 0 means end_time/1000
      logical :: displacement = .true.   !< particles store their initial position
      logical :: strain = .false., gradient = .false. !< and their deformation since then
      character(len=name_length), allocatable :: formats(:) !< of snapshots, by name
   contains
      procedure :: writes => writes_format
      procedure :: fields => output_fields
   end type output_spec_t

   !> &checkpoint
   type, public :: checkpoint_spec_t
      logical :: present = .false.       !< no &checkpoint group: checkpoints by signals only
      real(wp) :: every = 0.0_wp         !< s of physical time between checkpoints; 0: off
      real(wp) :: every_wall = 0.0_wp    !< s of wall-clock time; 0: off
      integer :: every_steps = 0         !< 0: off
      real(wp) :: wall_limit = 0.0_wp    !< s of wall-clock time after which the run ends; 0: none
   end type checkpoint_spec_t

   !> The beginning of a message about a value that can only be checked once the model is built: `line 7,
   !> &body shape='sphere'`.
   type, public :: place_t
      character(len=:), allocatable :: variable !< `end_time`, `time_step`, `cell_size`, `body`
      integer :: number = 1                     !< of the group, where there may be several
      character(len=:), allocatable :: text
   end type place_t

   !> A whole scene.
   type, public :: scene_t
      character(len=:), allocatable :: title
      real(wp) :: end_time = 0.0_wp      !< s
      logical :: plans = .false.         !< mode: print a plan instead of running
      character(len=:), allocatable :: restart !< directory of the run to be continued; empty: none
      type(grid_spec_t) :: grid
      type(time_spec_t) :: time
      type(contact_spec_t) :: contact
      character(len=name_length), allocatable :: contact_groups(:) !< names, by number; a single one if all
                                                                   !< bodies are bonded
      type(body_contact_spec_t), allocatable :: body_contacts(:) !< as given in the scene
      type(quasi_static_spec_t) :: quasi_static
      type(guard_spec_t) :: guard
      type(output_spec_t) :: output
      type(checkpoint_spec_t) :: checkpoint
      type(material_spec_t), allocatable :: materials(:)
      type(body_spec_t), allocatable :: bodies(:)
      type(cut_spec_t), allocatable :: cuts(:)
      type(tool_spec_t), allocatable :: tools(:)
      type(level_spec_t), allocatable :: levels(:)  !< from coarse to fine
      type(probe_spec_t), allocatable :: probes(:)
      type(offer_slot_t), allocatable :: effects(:) !< in the order of the catalogue, then of the text
      type(place_t), allocatable :: places(:)       !< positions in the scene's text
      logical :: has_motions = .false.   !< there is a &motion
      integer :: chose_domain = 0 !< domains follow the deformation by the program's choice, for this reason:
                                  !< because_...
      character(len=:), allocatable :: brought !< names of the effects that are on by default for the scene's
                                               !< laws
   contains
      procedure :: place
      procedure :: fields
      procedure :: leaders
      procedure :: depth
      procedure :: group_label
      procedure :: contact_of
   end type scene_t

contains

   !> True when there are snapshots in a format.
   pure logical function writes_format(self, name) result(writes)
      class(output_spec_t), intent(in) :: self
      character(len=*), intent(in) :: name
      writes = .false.
      if (allocated(self%formats)) writes = any(self%formats == name)
   end function writes_format

   !> Flags for writing displacement, strain and deformation gradient.
   pure function output_fields(self) result(fields)
      class(output_spec_t), intent(in) :: self
      logical :: fields(3)
      fields = [self%displacement, self%strain, self%gradient] .and. self%present
   end function output_fields

   !> The limit of the cells of a level placed by the error, as given in the scene.
   pure function budget(self) result(text)
      class(level_spec_t), intent(in) :: self
      character(len=:), allocatable :: text
      text = 'max_cells='//to_text(self%max_cells)
      if (self%bytes_a_cell > 0.0_wp) text = 'max_memory='//to_text(self%max_memory)
   end function budget

   !> A number of cells, in the unit of the scene's limit.
   pure function in_budget(self, cells) result(text)
      class(level_spec_t), intent(in) :: self
      integer(i8), intent(in) :: cells
      character(len=:), allocatable :: text
      text = to_text(cells)//' cells'
      if (self%bytes_a_cell > 0.0_wp) text = si(cells*self%bytes_a_cell, 'B')//' for '//text
   end function in_budget

   !> The rotation that takes the grid's axes to those of a body's material, as a quaternion.
   pure function turned_axes(self) result(q)
      class(body_spec_t), intent(in) :: self
      real(wp) :: q(4), turn(3, 3), stretch(3, 3)
      q = no_rotation
      if (.not. allocated(self%orientation)) return
      if (size(self%orientation) == 9) then
         call polar(reshape(self%orientation, [3, 3]), turn, stretch) ! the nine numbers have limited digits
         q = quaternion_of(turn)
      else
         q = from_euler(pi/180.0_wp*self%orientation)
      end if
   end function turned_axes

   !> Beginning of a message about a variable (or the group of that name); its name where the scene was not
   !> read.
   pure function place(self, variable, number) result(text)
      class(scene_t), intent(in) :: self
      character(len=*), intent(in) :: variable
      integer, intent(in), optional :: number
      character(len=:), allocatable :: text
      integer :: wanted, n
      text = variable
      wanted = 1
      if (present(number)) wanted = number
      if (.not. allocated(self%places)) return
      do n = 1, size(self%places)
         if (self%places(n)%variable == variable &
             .and. self%places(n)%number == wanted) text = self%places(n)%text
      end do
   end function place

   !> True where a step that begins at a time (s) is quasi-static.
   pure logical function holds_at(self, time)
      class(quasi_static_spec_t), intent(in) :: self
      real(wp), intent(in) :: time
      real(wp) :: hair
      hair = 1.0e-9_wp*abs(time)
      holds_at = self%present .and. time >= self%from - hair .and. time < self%to - hair
   end function holds_at

   !> True where implicit steps have inertia.
   pure logical function has_inertia(self)
      class(quasi_static_spec_t), intent(in) :: self
      has_inertia = self%present .and. self%mode == mode_newmark
   end function has_inertia

   !> Number of velocity fields: one for each contact group.
   pure integer function fields(self)
      class(scene_t), intent(in) :: self
      fields = 1
      if (allocated(self%bodies)) fields = max(1, maxval(self%bodies%field))
   end function fields

   !> A contact group's name; 'rest' for bodies without one.
   pure function group_label(self, number) result(label)
      class(scene_t), intent(in) :: self
      integer, intent(in) :: number
      character(len=:), allocatable :: label
      label = trim(self%contact_groups(number))
      if (label == '') label = rest_group
   end function group_label

   !> Number of levels, the grid included.
   pure integer function depth(self)
      class(scene_t), intent(in) :: self
      depth = 1
      if (.not. allocated(self%levels)) return
      if (size(self%levels) > 0) depth = 1 + maxval(self%levels%of)
   end function depth

   !> Names of what levels may follow: the tools, then the contact groups.
   pure function leaders(self) result(names)
      class(scene_t), intent(in) :: self
      character(len=name_length), allocatable :: names(:)
      integer :: t
      allocate (names(size(self%tools)))
      do t = 1, size(self%tools)
         names(t) = self%tools(t)%name
      end do
      if (self%fields() > 1) names = [names, self%contact_groups]
   end function leaders

   !> The contact between bodies of two groups: from the last &body_contact that names both, else the last one
   !> that names none, else the defaults.
   pure type(body_contact_spec_t) function contact_of(self, one, other) result(spec)
      class(scene_t), intent(in) :: self
      integer, intent(in) :: one, other !< numbers of the groups
      integer :: n
      spec = body_contact_spec_t()
      if (allocated(self%body_contacts)) then
         do n = 1, size(self%body_contacts)
            if (all(self%body_contacts(n)%groups == 0)) spec = self%body_contacts(n)
         end do
         do n = 1, size(self%body_contacts)
            associate (groups => self%body_contacts(n)%groups)
               if (all(groups == [one, other]) .or. all(groups == [other, one])) spec = self%body_contacts(n)
            end associate
         end do
      end if
      spec%groups = [one, other]
   end function contact_of

   !> The largest safety factor for a number of particles a cell, 1, 8 or 27.
   pure real(wp) function largest_safety(particles_per_cell)
      integer, intent(in) :: particles_per_cell
      largest_safety = safety_allowed(findloc(safety_particles, particles_per_cell, dim=1))
   end function largest_safety

   !> The largest safety factor that all bodies of a scene allow.
   pure real(wp) function safety_limit(scene)
      class(scene_t), intent(in) :: scene
      integer :: i
      safety_limit = maxval(safety_allowed)
      do i = 1, size(scene%bodies)
         safety_limit = min(safety_limit, largest_safety(scene%bodies(i)%particles_per_cell))
      end do
   end function safety_limit

end module m_scene
