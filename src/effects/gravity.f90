!> Uniform acceleration of all material (theory.md, eq. gravity).
module m_gravity
   use m_kinds, only: wp
   use m_effect, only: effect_t, hooks_t
   use m_node_values, only: mass_, v_x, v_z, a_x, a_z
   use m_field_table, only: layout_t
   use m_group_reader, only: group_reader_t
   use m_value_range, only: any_value
   use m_section, only: section_t
   implicit none
   private
   public :: gravity_t

   type, extends(effect_t) :: gravity_t
      real(wp) :: field(3) = 0.0_wp !< m/s2
   contains
      procedure :: take_section
      procedure :: variables
      procedure :: hooks
      procedure :: uniform_acceleration
      procedure :: on_nodes
      procedure :: potential
   end type gravity_t

contains

   subroutine variables(self, group)
      class(gravity_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      call group%get('acceleration', self%field, any_value('m/s2'), required=.true.)
   end subroutine variables

   pure type(hooks_t) function hooks(self)
      class(gravity_t), intent(in) :: self
      hooks = hooks_t(on_nodes=.true., follows_particles=.true.)
   end function hooks

   pure function uniform_acceleration(self) result(field)
      class(gravity_t), intent(in) :: self
      real(wp) :: field(3)
      field = self%field
   end function uniform_acceleration

   !> a <- a + g, with the velocity updated. Nodes without mass are not changed.
   pure subroutine on_nodes(self, time, time_step, tile)
      class(gravity_t), intent(in) :: self
      real(wp), intent(in) :: time, time_step
      real(wp), intent(inout), contiguous :: tile(:, 0:, 0:, 0:)
      integer :: i, j, k
      do k = 0, ubound(tile, 4)
         do j = 0, ubound(tile, 3)
            do i = 0, ubound(tile, 2)
               if (.not. tile(mass_, i, j, k) > 0.0_wp) cycle
               tile(a_x:a_z, i, j, k) = tile(a_x:a_z, i, j, k) + self%field
               tile(v_x:v_z, i, j, k) = tile(v_x:v_z, i, j, k) + time_step*self%field
            end do
         end do
      end do
   end subroutine on_nodes

   !> -sum of m g . (x - lead v).
   pure real(wp) function potential(self, column, layout, first, last, lead) result(energy)
      class(gravity_t), intent(in) :: self
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: first, last
      real(wp), intent(in) :: lead
      integer :: p
      energy = 0.0_wp
      associate (x => layout%position, v => layout%velocity, g => self%field)
         !$omp simd reduction(-: energy)
         do p = first, last
            energy = energy - column(p, layout%mass)*(g(1)*(column(p, x) - lead*column(p, v)) &
                                                      + g(2)*(column(p, x + 1) - lead*column(p, v + 1)) &
                                                      + g(3)*(column(p, x + 2) - lead*column(p, v + 2)))
         end do
      end associate
   end function potential

   !> In the section; along the axis for a body of revolution.
   subroutine take_section(self, section, why)
      class(gravity_t), intent(inout) :: self
      type(section_t), intent(in) :: section
      character(len=:), allocatable, intent(out) :: why
      why = ''
      if (section%is_round() .and. any(abs(self%field(1:2)) > 0.0_wp)) then
         why = 'acceleration must be along z, the axis, with geometry='''//section%word()//''''
      else if (abs(self%field(2)) > 0.0_wp) then
         why = 'acceleration must have y=0 with geometry='''//section%word()//''''
      end if
   end subroutine take_section

end module m_gravity
