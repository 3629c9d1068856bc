!> Removal of failed particles from the model (theory.md, eq. failed).
module m_erosion
   use m_kinds, only: wp, i4
   use m_decomposition, only: blocks_before
   use m_inner_motion, only: inner_motion
   use m_merge, only: drop
   use m_model, only: model_t
   implicit none
   private
   public :: erode

contains

   !> Remove failed particles from one block. Their energy is recorded as lost, with the block; their mass and
   !> momentum are missing in the sums from now on.
   subroutine erode(model, l, b)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b
      integer(i4), allocatable :: gone(:)
      integer :: i, p
      associate (level => model%levels(l), block => model%levels(l)%blocks(b))
         associate (damage => level%layout%damage, count => block%particles%count)
            if (.not. any(block%particles%column(:count, damage) >= 1.0_wp)) return
            gone = pack([(int(p, i4), p=1, count)], block%particles%column(:count, damage) >= 1.0_wp)
         end associate
         associate (lost => model%lost_in_merging(blocks_before(model%levels, l) + block%index))
            do i = 1, size(gone)
               lost = lost + energy_of(model, l, b, int(gone(i)))
               if (model%contact%pairs%active()) call model%uncovered%add(level, b, int(gone(i)))
            end do
         end associate
         call drop(block, gone)
         call block%particles%changed()
      end associate
   end subroutine erode

   !> The energy of a particle in the balance, J.
   real(wp) function energy_of(model, l, b, p) result(energy)
      type(model_t), intent(in) :: model
      integer, intent(in) :: l, b, p
      real(wp) :: angular(3)
      integer :: e
      associate (particles => model%levels(l)%blocks(b)%particles, at => model%levels(l)%layout)
         call inner_motion(particles%column, p, p, at, energy, angular)
         associate (law => model%materials%slots(model%materials%of_body(particles%body(p)))%law)
            energy = energy + 0.5_wp*particles%column(p, at%mass) &
                     *sum(particles%column(p, at%velocity:at%velocity + 2)**2) &
                     + law%strain_energy(particles%column, at, p, p) &
                     + law%plastic_energy(particles%column, p, p)
         end associate
         do e = 1, size(model%effects)
            energy = energy + model%effects(e)%effect%dissipated(particles%column, p, p)
         end do
      end associate
   end function energy_of

end module m_erosion
