!> Remedy against volumetric locking: all particles of a cell change their volume at the same rate (theory.md,
!> eq. anti-locking).
module m_anti_locking
   use m_kinds, only: wp
   use m_group_reader, only: group_reader_t
   use m_cell_list, only: cell_list_t
   use m_cell_mean, only: take_means
   use m_field_table, only: field_table_t, layout_t
   use m_particle_store, only: particle_store_t
   use m_stencil, only: frame_t
   use m_effect, only: effect_t, hooks_t
   use m_section, only: section_t
   use m_grid_level, only: grid_level_t
   use m_scene_materials, only: materials_t
   implicit none
   private
   public :: anti_locking_t

   integer, parameter :: kind_volumetric = 1, kind_none = 2
   character(len=*), parameter :: kind_words(2) = [character(len=10) :: 'volumetric', 'none']

   type, extends(effect_t) :: anti_locking_t
      integer :: kind = kind_volumetric
      logical, allocatable, private :: is_fluid(:) !< (bodies): without shear stress, which alone resists what
                                                   !< keeps a cell's mean
   contains
      procedure :: take_section
      procedure :: variables
      procedure :: declined
      procedure :: declare
      procedure :: prepare
      procedure :: hooks
      procedure :: on_cells
   end type anti_locking_t

contains

   subroutine variables(self, group)
      class(anti_locking_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      call group%get_choice('kind', self%kind, kind_words)
   end subroutine variables

   pure logical function declined(self)
      class(anti_locking_t), intent(in) :: self
      declined = self%kind == kind_none
   end function declined

   !> The velocity gradients of all blocks are stored until the sums over cells are known: in a field of their
   !> own, where affine transfer has none or its gradient is ahead of the motion (levels, eq. lag).
   subroutine declare(self, table)
      class(anti_locking_t), intent(inout) :: self
      type(field_table_t), intent(inout) :: table
      call table%declare('pressure_shift', 1, 'Pa', written=.false.)
      if (table%column('velocity_gradient') == 0 .or. table%column('edge_stress') > 0) &
         call table%declare('kept_gradient', 9, '1/s', written=.false.)
   end subroutine declare

   pure type(hooks_t) function hooks(self)
      class(anti_locking_t), intent(in) :: self
      hooks = hooks_t(on_cells=.true.)
   end function hooks

   !> Find the bodies without shear stress.
   subroutine prepare(self, grid, materials)
      class(anti_locking_t), intent(inout) :: self
      type(grid_level_t), intent(in) :: grid
      type(materials_t), intent(in) :: materials
      integer :: b
      self%is_fluid = [(.not. materials%slots(materials%of_body(b))%law%von_mises_modulus() > 0.0_wp, &
                        b=1, size(materials%of_body))]
   end subroutine prepare

   !> Replace tr L by its mean over the cell, weighted by volume: one condition on the volume per cell instead
   !> of one per particle. Fluids keep theirs.
   pure subroutine on_cells(self, cells, particles, layout, frame, sums, gradient)
      class(anti_locking_t), intent(in) :: self
      type(cell_list_t), intent(in) :: cells
      type(particle_store_t), intent(inout) :: particles
      type(layout_t), intent(in) :: layout
      type(frame_t), intent(in) :: frame
      real(wp), intent(in), contiguous :: sums(:, 0:, 0:, 0:)
      real(wp), intent(inout), contiguous :: gradient(:, :)
      integer, allocatable :: fluid(:)
      real(wp), allocatable :: kept(:, :)
      integer :: p
      if (any(self%is_fluid)) then
         fluid = pack([(p, p=1, particles%count)], self%is_fluid(particles%body(:particles%count)))
         kept = gradient(fluid, :)
      end if
      call take_means(particles%count, cells%bin, layout, frame, sums, particles%column, gradient, &
                      cells%standing)
      if (.not. allocated(fluid)) return
      gradient(fluid, :) = kept
      particles%column(fluid, layout%pressure_shift) = 0.0_wp
   end subroutine on_cells

   !> The same in any section.
   subroutine take_section(self, section, why)
      class(anti_locking_t), intent(inout) :: self
      type(section_t), intent(in) :: section
      character(len=:), allocatable, intent(out) :: why
      why = ''
   end subroutine take_section

end module m_anti_locking
