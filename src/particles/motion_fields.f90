!> Displacement and deformation of particles since the start of the run, for snapshots and probes: the fields
!> that `fields` of &output requests.
module m_motion_fields
   use m_kinds, only: wp
   use m_scene, only: output_spec_t
   use m_field_table, only: field_table_t, layout_t
   use m_polar, only: logarithm
   implicit none
   private
   public :: motion_field_t, declare_motion, motion_fields, motion_columns, motion_of

   !> A field: its name, unit and components.
   type :: motion_field_t
      character(len=20) :: name = ''
      character(len=1) :: unit = ''
      character(len=2), allocatable :: components(:)
   end type motion_field_t

contains

   !> Declare the columns that the fields need. Where domains follow the deformation (`follows`), the initial
   !> domain gives the initial position of a split particle's parts.
   pure subroutine declare_motion(table, output, follows)
      type(field_table_t), intent(inout) :: table
      type(output_spec_t), intent(in) :: output
      logical, intent(in) :: follows
      if (.not. output%present) return
      if (output%displacement) call table%declare('start', 3, 'm', written=.false., by_mass=.true.)
      if (output%displacement .and. follows) call table%declare('start_edges', 3, 'm', written=.false.)
      table%shows_strain = output%strain
      table%shows_gradient = output%gradient
      if (output%strain .or. output%gradient) &
         call table%declare('motion_gradient', 9, '1', written=.false., by_mass=.true.)
   end subroutine declare_motion

   !> The fields written, in this order.
   pure function motion_fields(layout) result(fields)
      type(layout_t), intent(in) :: layout
      type(motion_field_t), allocatable :: fields(:)
      allocate (fields(0))
      if (layout%start > 0) fields = [fields, motion_field_t('displacement', 'm', ['x ', 'y ', 'z '])]
      if (layout%motion == 0) return
      if (layout%shows_strain) &
         fields = [fields, motion_field_t('strain', '1', ['xx', 'yy', 'zz', 'yz', 'xz', 'xy'])]
      if (layout%shows_gradient) fields = [fields, motion_field_t('deformation_gradient', '1', &
                                     ['xx', 'xy', 'xz', 'yx', 'yy', 'yz', 'zx', 'zy', 'zz'])]
   end function motion_fields

   !> Names of all their components, with units: `displacement_x [m]`.
   pure function motion_columns(layout) result(names)
      type(layout_t), intent(in) :: layout
      character(len=30), allocatable :: names(:)
      character(len=30) :: name
      type(motion_field_t), allocatable :: fields(:)
      integer :: c, f
      fields = motion_fields(layout)
      allocate (names(0))
      do f = 1, size(fields)
         do c = 1, size(fields(f)%components)
            name = trim(fields(f)%name)//'_'//trim(fields(f)%components(c))//' ['//fields(f)%unit//']'
            names = [names, name]
         end do
      end do
   end function motion_columns

   !> Their values for one particle.
   pure function motion_of(values, layout) result(motion)
      real(wp), intent(in) :: values(:) !< its columns
      type(layout_t), intent(in) :: layout
      real(wp), allocatable :: motion(:)
      real(wp) :: f(3, 3), e(3, 3)
      allocate (motion(0))
      associate (x => layout%position, s => layout%start, m => layout%motion)
         if (s > 0) motion = values(x:x + 2) - values(s:s + 2)
         if (m == 0) return
         f = reshape(values(m:m + 8), [3, 3])
         if (layout%shows_strain) then
            e = 0.5_wp*logarithm(matmul(f, transpose(f)))
            motion = [motion, e(1, 1), e(2, 2), e(3, 3), e(2, 3), e(1, 3), e(1, 2)]
         end if
         if (layout%shows_gradient) motion = [motion, reshape(transpose(f), [9])]
      end associate
   end function motion_of

end module m_motion_fields
