!> The one table of particle fields. A field declared here is allocated, sorted, migrated and written by the
!> table.
module m_field_table
   use m_kinds, only: i8
   use m_section, only: section_t
   use m_domain_kinds, only: domain_kinds
   implicit none
   private
   public :: field_t, field_table_t, layout_t, shares_t

   integer, parameter, public :: bytes_per_column = 8 !< per particle

   !> One field: `components` columns of the particle store, beginning at column `first`.
   type :: field_t
      character(len=:), allocatable :: name
      character(len=:), allocatable :: unit
      integer :: components = 0
      integer :: first = 0
      logical :: written = .false. !< written to snapshots
      logical :: extensive = .false. !< the halves of a split particle get half of the value each, and a
                                     !< merged particle the sum; if false halves keep the value, and a merged
                                     !< particle gets the mean by volume
      logical :: by_mass = .false.   !< or, if true, the mean by mass
      integer :: arm_to = 0 !< of an arm to a carried face: first column of the face's area, which is split
                            !< and merged with it
   end type field_t

   !> How the columns of a particle are divided when it is split and combined when parts merge.
   type :: shares_t
      logical, allocatable :: extensive(:), by_mass(:) !< by column
      integer, allocatable :: faces(:, :) !< (2, faces): first columns of area and arm of the faces that
                                          !< particles carry
   end type shares_t

   !> First columns of the fields that the kernels know; 0 where the scene does not use the field.
   type :: layout_t
      integer :: position = 0, velocity = 0, mass = 0, volume = 0, stress = 0
      integer :: half_size = 0     !< of the domain: one for all axes, or (half_sizes) 3 columns, one an axis
      logical :: half_sizes = .false.
      integer :: domain = 0 !< half edges that are not along the axes, used instead of half_size: of `corners`
                            !< 9 columns, component i of edge k at 3 (k-1) + i
      logical :: follows = .false. !< domains follow the deformation
      integer :: generation = 0    !< number of times the particle has been split
      integer :: refinement = 0    !< number of those splits that were into eight, towards a finer level
      integer :: gradient = 0 !< velocity gradient of the last step, 9 columns, d v_i / d x_j at 3 (j-1) + i
      integer :: kept_gradient = 0 !< the same, where only the step needs it, between nodes and stress
      integer :: orientation = 0   !< orientation of the material's axes, a quaternion of 4 columns
      integer :: grain = 0         !< number of the grain of a polycrystal
      integer :: deformation = 0   !< deformation gradient, 9 columns, the same order
      integer :: edge_stress = 0   !< stress accumulated since the level's region last moved, 6 columns
      integer :: viscous_pressure = 0 !< added to the pressure in the nodal forces, not part of the stress
      integer :: pressure_shift = 0   !< likewise, from the pressure of the stress to the mean of the cell
      integer :: damage = 0           !< 1 where a particle has failed: its law bears no tension
      integer :: unseen_heat = 0      !< energy dissipated from motion in the null space of the nodes
      integer :: start = 0         !< position at the start of the run, reference of the displacement
      integer :: start_edges = 0   !< half edges of the domain at the start, along the axes, where domains
                                   !< follow the deformation: 3 columns
      integer :: motion = 0        !< deformation gradient from the start of the run, for any law, 9 columns
      logical :: shows_strain = .false., shows_gradient = .false. !< snapshots contain these, derived from it
      integer :: next_position = 0 !< position at the end of the step, while the step still needs the old one
      type(section_t) :: section   !< section of the scene, if it has one: all particles are in one layer on
                                   !< it
      integer(i8) :: ids_of_body = 10_i8**12 !< ids of body b follow (b - 1) times this
      integer :: id_bits = 50 !< ids of particles that were never split are below 2^id_bits; the bits above
                              !< encode the path through the splits
   contains
      procedure :: corrects_lag
      procedure :: max_generations
   end type layout_t

   type :: field_table_t
      type(field_t), allocatable :: fields(:)
      integer :: columns = 0
      logical :: shows_strain = .false., shows_gradient = .false. !< snapshots contain these, derived from the
                                                                  !< motion
   contains
      procedure :: declare
      procedure :: column
      procedure :: bytes_of
      procedure :: bytes_with
      procedure :: shares
      procedure :: layout
   end type field_table_t

contains

   !> Add a field; declaring the same name again changes nothing (two effects may need the same field).
   pure subroutine declare(self, name, components, unit, written, extensive, by_mass, arm_to)
      class(field_table_t), intent(inout) :: self
      character(len=*), intent(in) :: name, unit
      integer, intent(in) :: components
      logical, intent(in) :: written
      logical, intent(in), optional :: extensive, by_mass !< false if absent
      integer, intent(in), optional :: arm_to    !< the field is the arm to a face: first column of its area
      type(field_t) :: field
      if (.not. allocated(self%fields)) allocate (self%fields(0))
      if (self%column(name) > 0) return
      field = field_t(name, unit, components, self%columns + 1, written)
      if (present(extensive)) field%extensive = extensive
      if (present(by_mass)) field%by_mass = by_mass
      if (present(arm_to)) field%arm_to = arm_to
      self%fields = [self%fields, field]
      self%columns = self%columns + components
   end subroutine declare

   !> First column of a field, or 0 if it is not declared.
   pure integer function column(self, name)
      class(field_table_t), intent(in) :: self
      character(len=*), intent(in) :: name
      integer :: f
      column = 0
      if (.not. allocated(self%fields)) return
      do f = 1, size(self%fields)
         if (self%fields(f)%name == name) column = self%fields(f)%first
      end do
   end function column

   !> Bytes a particle of a field, 0 if it is not declared.
   pure integer function bytes_of(self, name)
      class(field_table_t), intent(in) :: self
      character(len=*), intent(in) :: name
      integer :: f
      bytes_of = 0
      do f = 1, size(self%fields)
         if (self%fields(f)%name == name) bytes_of = bytes_per_column*self%fields(f)%components
      end do
   end function bytes_of

   !> Bytes a particle of all fields whose names begin with `beginning`.
   pure integer function bytes_with(self, beginning)
      class(field_table_t), intent(in) :: self
      character(len=*), intent(in) :: beginning
      integer :: f
      bytes_with = 0
      do f = 1, size(self%fields)
         if (index(self%fields(f)%name, beginning) == 1) &
            bytes_with = bytes_with + bytes_per_column*self%fields(f)%components
      end do
   end function bytes_with

   !> How columns are divided when a particle is split.
   pure type(shares_t) function shares(self)
      class(field_table_t), intent(in) :: self
      integer :: f
      allocate (shares%extensive(self%columns), shares%by_mass(self%columns), shares%faces(2, 0))
      do f = 1, size(self%fields)
         associate (field => self%fields(f))
            shares%extensive(field%first:field%first + field%components - 1) = field%extensive
            shares%by_mass(field%first:field%first + field%components - 1) = field%by_mass
            if (field%arm_to > 0) shares%faces = reshape([shares%faces, field%arm_to, field%first], [2, &
                                                         size(shares%faces, 2) + 1])
         end associate
      end do
   end function shares

   !> First columns of the fields that the kernels use.
   pure type(layout_t) function layout(self, section)
      class(field_table_t), intent(in) :: self
      type(section_t), intent(in), optional :: section !< section of the scene, if it has one
      integer :: f, k
      if (present(section)) layout%section = section
      layout%position = self%column('position')
      layout%velocity = self%column('velocity')
      layout%mass = self%column('mass')
      layout%volume = self%column('volume')
      do f = 1, size(self%fields)
         do k = 1, size(domain_kinds)
            associate (kind => domain_kinds(k), field => self%fields(f))
               if (field%name /= kind%field .or. field%components /= kind%components) cycle
               if (kind%turns) layout%domain = field%first
               if (.not. kind%turns) layout%half_size = field%first
               layout%half_sizes = kind%deforms .and. .not. kind%turns
               layout%follows = kind%deforms
            end associate
         end do
      end do
      layout%generation = self%column('generation')
      layout%refinement = self%column('refinement')
      layout%stress = self%column('stress')
      layout%gradient = self%column('velocity_gradient')
      layout%kept_gradient = self%column('kept_gradient')
      layout%orientation = self%column('orientation')
      layout%grain = self%column('grain')
      layout%deformation = self%column('deformation_gradient')
      layout%edge_stress = self%column('edge_stress')
      layout%viscous_pressure = self%column('viscous_pressure')
      layout%pressure_shift = self%column('pressure_shift')
      layout%damage = self%column('damage')
      layout%unseen_heat = self%column('unseen_heat')
      layout%next_position = self%column('next_position')
      layout%start = self%column('start')
      layout%start_edges = self%column('start_edges')
      layout%motion = self%column('motion_gradient')
      layout%shows_strain = self%shows_strain
      layout%shows_gradient = self%shows_gradient
   end function layout

   !> Number of splits that fit in an id, which stays below 2^62.
   pure integer function max_generations(self)
      class(layout_t), intent(in) :: self
      max_generations = 62 - self%id_bits
   end function max_generations

   !> True when, at edges of levels, momenta of particles are at several times (theory.md, eq. time-levels)
   !> and the particles carry gradients, which must be at the same time as the momenta (eq. lag).
   pure logical function corrects_lag(self)
      class(layout_t), intent(in) :: self
      corrects_lag = self%edge_stress > 0 .and. self%gradient > 0
   end function corrects_lag

end module m_field_table
