!> What particles remember of their contact from step to step: the columns of their fields (theory.md, eq.
!> carried-gap).
module m_contact_columns
   use m_kinds, only: wp
   use m_field_table, only: field_table_t
   use m_friction_law, only: has_friction
   use m_tool, only: tool_t
   use m_contact_point, only: candidate_t
   implicit none
   private
   public :: contact_columns_t

   type :: contact_columns_t
      integer :: pressure = 0  !< column of the contact pressure
      integer :: earlier = 0   !< column of what it was a step before
      integer :: traction = 0  !< first column of the friction; 0 where no tool has any
      integer :: carried = 0   !< first column of the gaps that are carried on, one for each tool's sheets
      integer :: deflected = 0 !< first column of deflections below the cells, likewise; 0: none
      integer, allocatable :: slots(:) !< (tools + 1): columns of the tools before it
      integer :: own = 0       !< first column of each point's own pressure, and friction if there is any: a
                               !< particle may have several points; 0: without implicit steps
      integer :: own_width = 1 !< columns of a point there
      integer :: dragged = 0   !< first column of those by friction
      integer :: left = 0      !< first column of the velocities that pressed points are left with, less those
                               !< that the tool is given; 0: none
   contains
      procedure :: declare_sheets
      procedure :: set_slot
      procedure :: before_of
      procedure :: keep_own
   end type contact_columns_t

contains

   !> Fields of gaps and deflections: a column for each sheet of each tool.
   pure subroutine declare_sheets(self, tools, table, is_implicit, subcell)
      class(contact_columns_t), intent(inout) :: self
      type(tool_t), intent(in) :: tools(:)
      type(field_table_t), intent(inout) :: table
      logical, intent(in) :: is_implicit !< some steps are
      logical, intent(in) :: subcell !< surfaces are deflected below the cells
      integer :: sheets(size(tools)), t
      sheets = [(tools(t)%spec%shape%sheets(), t=1, size(tools))]
      self%slots = [(sum(sheets(:t)), t=0, size(sheets))]
      call table%declare('contact_gap', sum(sheets), 'm', written=.false.)
      self%carried = table%column('contact_gap')
      if (is_implicit) then
         self%own_width = merge(4, 1, any(has_friction(tools%spec%friction)))
         call table%declare('own_contact_pressure', self%own_width*sum(sheets), 'Pa', written=.false.)
         self%own = table%column('own_contact_pressure')
      end if
      if (.not. subcell) return
      call table%declare('contact_deflection', sum(sheets), 'm', written=.false.)
      self%deflected = table%column('contact_deflection')
   end subroutine declare_sheets

   !> Pressure (1) and friction (2 to 4) of a point in the last step, Pa; where some steps are implicit.
   pure function before_of(self, column, c) result(before)
      class(contact_columns_t), intent(in) :: self
      real(wp), intent(in) :: column(:) !< of the particle
      type(candidate_t), intent(in) :: c
      real(wp) :: before(4)
      before = 0.0_wp
      associate (first => self%own + self%own_width*c%slot)
         before(:self%own_width) = column(first:first + self%own_width - 1)
      end associate
   end function before_of

   !> Keep pressure and friction of a point, where points have their own.
   pure subroutine keep_own(self, column, c, pressure, traction)
      class(contact_columns_t), intent(in) :: self
      real(wp), intent(inout) :: column(:) !< of the particle
      type(candidate_t), intent(in) :: c
      real(wp), intent(in) :: pressure, traction(3) !< Pa
      if (self%own == 0) return
      associate (first => self%own + self%own_width*c%slot)
         column(first) = pressure
         if (self%own_width > 1) column(first + 1:first + 3) = traction
      end associate
   end subroutine keep_own

   !> Set the sheet of a tool that a point meets, and its place among the columns of all.
   pure subroutine set_slot(self, t, sheet, c)
      class(contact_columns_t), intent(in) :: self
      integer, intent(in) :: t, sheet !< numbers of the tool and of its sheet, from 1
      type(candidate_t), intent(inout) :: c
      c%slot = self%slots(t) + sheet - 1
      c%sheet = merge(sheet, 0, self%slots(t + 1) - self%slots(t) > 1)
   end subroutine set_slot

end module m_contact_columns
