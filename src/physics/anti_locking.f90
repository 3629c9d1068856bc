!> Against volumetric locking: all particles of a bin change their volume at one rate (theory.md, eq. anti-locking).
module m_anti_locking
   use m_kinds, only: wp
   use m_group_reader, only: group_reader_t
   use m_cell_list, only: cell_list_t
   use m_field_table, only: layout_t
   use m_particle_store, only: particle_store_t
   use m_effect, only: effect_t, hooks_t
   implicit none
   private
   public :: anti_locking_t

   integer, parameter :: kind_volumetric = 1
   character(len=*), parameter :: kind_words(1) = ['volumetric']

   type, extends(effect_t) :: anti_locking_t
      integer :: kind = kind_volumetric
   contains
      procedure :: variables
      procedure :: hooks
      procedure :: on_gradient
   end type anti_locking_t

contains

   subroutine variables(self, group)
      class(anti_locking_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      call group%get_choice('kind', self%kind, kind_words)
   end subroutine variables

   pure type(hooks_t) function hooks(self)
      class(anti_locking_t), intent(in) :: self
      associate (unused => self%kind); end associate
      hooks = hooks_t(on_gradient=.true.)
   end function hooks

   !> tr L becomes its mean over the bin, weighted by volume: one condition on the volume a node, where there was one a particle.
   pure subroutine on_gradient(self, cells, particles, layout, time_step, gradient)
      class(anti_locking_t), intent(in) :: self
      type(cell_list_t), intent(in) :: cells
      type(particle_store_t), intent(in) :: particles
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: time_step
      real(wp), intent(inout), contiguous :: gradient(:, :)
      real(wp) :: rate, volume, change
      integer :: bin, l, p
      associate (unused => self%kind, unused_too => time_step); end associate
      do bin = 1, size(cells%first) - 1
         rate = 0.0_wp
         volume = 0.0_wp
         do l = cells%first(bin), cells%first(bin + 1) - 1
            p = cells%order(l)
            volume = volume + particles%column(p, layout%volume)
            rate = rate + particles%column(p, layout%volume)*(gradient(p, 1) + gradient(p, 5) + gradient(p, 9))
         end do
         do l = cells%first(bin), cells%first(bin + 1) - 1
            p = cells%order(l)
            change = (rate/volume - (gradient(p, 1) + gradient(p, 5) + gradient(p, 9)))/3.0_wp
            gradient(p, 1) = gradient(p, 1) + change
            gradient(p, 5) = gradient(p, 5) + change
            gradient(p, 9) = gradient(p, 9) + change
         end do
      end do
   end subroutine on_gradient

end module m_anti_locking
