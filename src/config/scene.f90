!> What a scene says, after reading and checking: one type a namelist group, values in SI units (angles in
!> radians). doc/user/input.md is the table of all names.
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
   integer, parameter, public :: min_cells = 10**3 !< of a box that a criterion places: four cells along
                                                      !< each axis, five beside a side
   character(len=*), parameter, public :: rest_group = 'rest' !< the contact group of bodies that name none
   integer, parameter, public :: start_apart = 1, start_as_is = 2
   integer, parameter, public :: mode_static = 1, mode_newmark = 2
   integer, parameter, public :: preconditioner_jacobi = 1, preconditioner_gamg = 2, &
                                 preconditioner_bpx = 3

   !> &grid: the background grid. Sides in the order x- x+ y- y+ z- z+.
   type, public :: grid_spec_t
      real(wp) :: lower(3) = 0.0_wp      !< m
      real(wp) :: upper(3) = 0.0_wp      !< m
      real(wp) :: cell_size = 0.0_wp     !< m
      integer :: cells(3) = 0            !< from the three above
      integer :: boundary(6) = boundary_free
      type(section_t) :: section         !< of the whole scene: what its bodies and tools are given by
   end type grid_spec_t

   !> The largest safety for particles_per_cell 1, 8 and 27 (doc/user/accuracy.md, stability).
   integer, parameter, public :: safety_particles(3) = [1, 8, 27]
   real(wp), parameter, public :: safety_allowed(3) = [0.4_wp, 0.4_wp, 0.35_wp]

   !> &time: how the scene is stepped.
   type, public :: time_spec_t
      real(wp) :: safety = 0.35_wp       !< share of cell / (c + |v|)
      real(wp) :: time_step = 0.0_wp     !< s; 0 means automatic
      integer :: stress_update = update_usl
      real(wp) :: flip_fraction = 1.0_wp !< 1 is FLIP, 0 is PIC
      logical :: affine = .true.         !< transfer: affine or plain
      integer :: domain = domain_fixed   !< how the domains of particles deform
      logical :: subcycle = .true. !< a level takes two steps to its parent's one; else all step with the
                                   !< finest's
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
                                              !< where the three point, nine numbers; not there: as the grid's
      real(wp) :: stress(6) = 0.0_wp     !< at the start: xx yy zz yz xz xy, Pa
      integer :: fill = fill_by_shape    !< whole particles, or shares of them where the surface cuts
      character(len=:), allocatable :: contact_group !< bodies of one are bonded where they touch; empty: that
                                                     !< of all bodies that name none
      integer :: field = 1               !< the group's number: bodies of one share a velocity field
      type(section_t) :: section         !< that it is given by, as the grid's
   contains
      procedure :: turned_axes
   end type body_spec_t

   !> &cut: what is taken away from a body
   type, public :: cut_spec_t
      integer :: body = 0                !< index into scene_t%bodies
      class(shape_t), allocatable :: shape
   end type cut_spec_t

   !> &motion: a degree of freedom of a tool.
   type, public :: motion_spec_t
      logical :: turns = .false.         !< kind: 'turn', else 'slide'
      real(wp) :: axis(3) = 0.0_wp       !< unit vector
      real(wp) :: point(3) = 0.0_wp      !< of a turn: on its axis at the start, m
      real(wp), allocatable :: times(:) !< s, rising; before the first and after the last the speed or load is
                                        !< held
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
      real(wp), allocatable :: times(:) !< s, rising; before the first and after the last the speed or load is
                                        !< held
      real(wp), allocatable :: speeds(:) !< m/s along the axis, linear in between; or
      real(wp), allocatable :: loads(:)  !< N along the axis on the tool, for the modelled part of the body
      real(wp) :: mass = 0.0_wp          !< with loads: of the modelled part of the tool, kg
      real(wp) :: initial_speed = 0.0_wp !< with loads: along the axis, m/s
      logical :: stands = .false. !< nothing is said of how it moves along its axis: it does not
      type(motion_spec_t), allocatable :: motions(:) !< how else it moves; absent where it does not
      real(wp) :: penetration_factor = 0.5_wp
      type(surface_friction_t) :: friction
   end type tool_spec_t

   !> &level: a box or a sphere of cells half the size of those of a level before it. Several that refine one
   !> level are parts of the region of the next.
   type, public :: level_spec_t
      integer :: of = 1 !< number of the level that it refines, the grid is 1
      integer :: shape = level_box
      real(wp) :: lower(3) = 0.0_wp      !< m; where the box moves, at the start
      real(wp) :: upper(3) = 0.0_wp      !< m
      real(wp) :: center(3) = 0.0_wp     !< of a sphere, m; the same
      real(wp) :: radius = 0.0_wp        !< of a sphere, m
      real(wp) :: inner_radius = 0.0_wp  !< of a shell: coarser cells inside it, m; 0: a ball
      integer :: follow = 0 !< what the box moves with, by its number in scene_t%leaders; 0: nothing
      integer :: criterion = criterion_none !< places the box by the gradient of von Mises stress or of
                                            !< strain, or cells by the estimated error of the stress
      integer :: max_cells = 1000000     !< with a criterion: of the level's own cells, in its region
      real(wp) :: max_memory = 0.0_wp !< with criterion_error: of the same cells, on all ranks, B; 0: no bound
      real(wp) :: tolerance = 0.05_wp !< with criterion_error: of the stress, relative to the largest
      real(wp) :: bytes_a_cell = 0.0_wp !< where max_memory is what bounds max_cells, B; else 0
      logical :: has_box = .true. !< else, with criterion_error, it begins around the tools' tips
   contains
      procedure :: budget
      procedure :: in_budget
   end type level_spec_t

   !> &probe
   type, public :: probe_spec_t
      character(len=:), allocatable :: name
      real(wp) :: position(3) = 0.0_wp   !< m
   end type probe_spec_t

   real(wp), parameter, public :: hopeless_residual = 1.0e-3_wp !< relative, of a contact problem: above this
                                                                !< it is a fault

   !> &contact
   type, public :: contact_spec_t
      real(wp) :: tolerance = 1.0e-8_wp  !< residual of the contact problem relative to its right-hand side
      integer :: max_iterations = 200
      real(wp) :: compliance = 0.01_wp   !< of a contact point, in time step over mass of its particle
      real(wp) :: subcell = 0.35_wp      !< of the half-space below a cell, in cells over its modulus; 0: none
   end type contact_spec_t

   !> &body_contact: what holds between bodies of two groups.
   type, public :: body_contact_spec_t
      integer :: groups(2) = 0           !< their numbers; 0: all pairs that no other one names
      type(surface_friction_t) :: friction
      real(wp) :: adhesion = 0.0_wp      !< work of separation, J/m2
      real(wp) :: cohesive_range = 0.0_wp !< gap up to which adhesion pulls, m
      real(wp) :: bond_strength = 0.0_wp !< of what touches at the start, Pa; it softens as it opens, by
                                         !< `adhesion` in all
      integer :: start = start_apart     !< what becomes of an overlap at the start
      real(wp) :: press_fit = 0.0_wp     !< time over which it is pressed out, s
   end type body_contact_spec_t

   !> &quasi_static: implicit steps, without inertia or with it.
   type, public :: quasi_static_spec_t
      logical :: present = .false.       !< no &quasi_static group: the explicit scheme
      real(wp) :: step = 0.0_wp          !< the first, s
      real(wp) :: max_step = 0.0_wp      !< none is longer, s; 0: as long as accuracy lets it
      real(wp) :: from = 0.0_wp          !< time at which it begins, s: before it the scheme is explicit
      real(wp) :: to = huge(1.0_wp)      !< and ends, s; not said: never
      real(wp) :: ramp = 0.0_wp          !< over which the loads of effects come on from the start, s
      real(wp) :: tolerance = 1.0e-6_wp  !< residual, relative to the forces that are in balance
      real(wp) :: creep_limit = 0.1_wp   !< of all stress, by which it may relax at rest in a step
      real(wp) :: stabilisation = 1.0_wp/30.0_wp !< of the ghost penalty, in Young's modulus; 0: none
      logical :: iterations = .false.    !< every Newton iteration is told
      integer :: mode = mode_static
      integer :: preconditioner = preconditioner_bpx
      real(wp) :: theta = 0.5_wp         !< with inertia: share of a step's end in its mean forces and speeds
   contains
      procedure :: holds_at
      procedure :: has_inertia
   end type quasi_static_spec_t

   !> &guard
   type, public :: guard_spec_t
      integer :: retries = 3             !< of a fault, each with steps half as long; 0: a fault ends the run
      integer :: save_every = 200 !< steps between copies, and between looks at all fields and the energy
      real(wp) :: memory = 1.0e9_wp      !< bytes a rank that the copy may take; 0: no copy
      real(wp) :: energy_limit = 0.5_wp !< energy from nowhere in the largest energy or work; 0: not looked at
      real(wp) :: work_limit = 0.25_wp !< work of loads that particles do not get, in the same; 0: not looked
                                       !< at
      real(wp) :: step_limit = 1.0e-3_wp !< smallest time step in the first one
   end type guard_spec_t

   !> &output
   type, public :: output_spec_t
      logical :: present = .false.       !< no &output group: nothing is written but the console
      character(len=:), allocatable :: directory
      real(wp) :: every = 0.0_wp         !< s between snapshots of the particles; 0 means first and last only
      real(wp) :: history_every = 0.0_wp !< s between lines of the histories; 0 means end_time/1000
      logical :: displacement = .true.   !< particles know where they began
      logical :: strain = .false., gradient = .false. !< and how they have been deformed since
      character(len=name_length), allocatable :: formats(:) !< of snapshots, by name
   contains
      procedure :: writes => writes_format
      procedure :: fields => output_fields
   end type output_spec_t

   !> &checkpoint
   type, public :: checkpoint_spec_t
      logical :: present = .false.       !< no &checkpoint group: only signals make one
      real(wp) :: every = 0.0_wp         !< s of the scene between checkpoints; 0: not by that
      real(wp) :: every_wall = 0.0_wp    !< s of the clock on the wall; 0: not by that
      integer :: every_steps = 0         !< 0: not by that
      real(wp) :: wall_limit = 0.0_wp    !< s of the clock on the wall after which the run ends; 0: none
   end type checkpoint_spec_t

   !> How a sentence begins about a value that can only be judged when the model stands: `line 7, &body
   !> shape='sphere'`.
   type, public :: place_t
      character(len=:), allocatable :: variable !< `end_time`, `time_step`, `cell_size`, `body`
      integer :: number = 1                     !< of the group, where there may be several
      character(len=:), allocatable :: text
   end type place_t

   !> A whole scene.
   type, public :: scene_t
      character(len=:), allocatable :: title
      real(wp) :: end_time = 0.0_wp      !< s
      logical :: plans = .false.         !< mode: say what the run will take instead of running
      character(len=:), allocatable :: restart !< directory of the run that this one goes on from; empty: none
      type(grid_spec_t) :: grid
      type(time_spec_t) :: time
      type(contact_spec_t) :: contact
      character(len=name_length), allocatable :: contact_groups(:) !< names, by number; one where all bodies
                                                                   !< are bonded
      type(body_contact_spec_t), allocatable :: body_contacts(:) !< as they are given
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
      type(place_t), allocatable :: places(:)       !< in the text that it was read from
      logical :: has_motions = .false.   !< there is a &motion
      integer :: chose_domain = 0 !< domains follow the material though the scene did not say, because_...
      character(len=:), allocatable :: brought !< names of the effects that laws have brought since the scene
                                               !< did not say
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

   !> Which of displacement, strain and deformation gradient are written.
   pure function output_fields(self) result(fields)
      class(output_spec_t), intent(in) :: self
      logical :: fields(3)
      fields = [self%displacement, self%strain, self%gradient] .and. self%present
   end function output_fields

   !> What bounds the cells of a level that the error places, as it is in the scene.
   pure function budget(self) result(text)
      class(level_spec_t), intent(in) :: self
      character(len=:), allocatable :: text
      text = 'max_cells='//to_text(self%max_cells)
      if (self%bytes_a_cell > 0.0_wp) text = 'max_memory='//to_text(self%max_memory)
   end function budget

   !> So many cells, as the scene has its budget.
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
         call polar(reshape(self%orientation, [3, 3]), turn, stretch) ! they are given with so many digits
         q = quaternion_of(turn)
      else
         q = from_euler(pi/180.0_wp*self%orientation)
      end if
   end function turned_axes

   !> How a sentence about a variable (or the group of that name) begins; where the scene was not read, its
   !> name.
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

   !> Number of the velocity fields: one for each contact group.
   pure integer function fields(self)
      class(scene_t), intent(in) :: self
      fields = 1
      if (allocated(self%bodies)) fields = max(1, maxval(self%bodies%field))
   end function fields

   !> A contact group's name; that of the bodies that name none is 'rest'.
   pure function group_label(self, number) result(label)
      class(scene_t), intent(in) :: self
      integer, intent(in) :: number
      character(len=:), allocatable :: label
      label = trim(self%contact_groups(number))
      if (label == '') label = rest_group
   end function group_label

   !> Number of levels, the grid among them.
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

   !> What holds between bodies of two groups: what the last &body_contact that names both says, else the last
   !> one that names none, else what holds where nothing is said.
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

   !> The largest safety factor with so many particles a cell, 1, 8 or 27.
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
