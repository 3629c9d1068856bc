!> Contact between the bodies of two contact groups apart from friction: initial overlaps, adhesion and bonds
!> (theory.md, eqs adhesion, bond).
module m_pair_law
   use m_kinds, only: wp
   use m_scene, only: body_contact_spec_t, start_as_is
   implicit none
   private
   public :: range_of, overlap_left, pressed_out, find_adhesion, weaken

contains

   !> Gap (m) up to which a pair adheres.
   pure elemental real(wp) function range_of(spec)
      type(body_contact_spec_t), intent(in) :: spec
      range_of = spec%cohesive_range
      if (spec%bond_strength > 0.0_wp) range_of = 2.0_wp*spec%adhesion/spec%bond_strength
   end function range_of

   !> Remaining share of an initial overlap that the gap excludes at a time (s).
   pure real(wp) function overlap_left(spec, time) result(left)
      type(body_contact_spec_t), intent(in) :: spec
      real(wp), intent(in) :: time
      left = 1.0_wp
      if (spec%press_fit > 0.0_wp) left = max(0.0_wp, 1.0_wp - time/spec%press_fit)
   end function overlap_left

   !> Decrease of that share in a step that begins at a time (s).
   pure real(wp) function pressed_out(spec, time, time_step) result(share)
      type(body_contact_spec_t), intent(in) :: spec
      real(wp), intent(in) :: time, time_step
      share = 0.0_wp
      if (spec%start == start_as_is) share = overlap_left(spec, time) - overlap_left(spec, time + time_step)
   end function pressed_out

   !> Adhesive tension and shear strength of a point. Both sides of the contact have points: each bears half.
   pure subroutine find_adhesion(spec, gap, area, left, adhesive_tension, shear_strength)
      type(body_contact_spec_t), intent(in) :: spec
      real(wp), intent(in) :: gap, area  !< m, m2
      real(wp), intent(in) :: left       !< remaining share of the bond's strength
      real(wp), intent(out) :: adhesive_tension, shear_strength !< N
      adhesive_tension = 0.0_wp
      shear_strength = 0.0_wp
      if (spec%bond_strength > 0.0_wp) then
         adhesive_tension = 0.5_wp*left*spec%bond_strength*area
         shear_strength = adhesive_tension
      else if (spec%adhesion > 0.0_wp .and. gap < spec%cohesive_range) then
         adhesive_tension = 0.5_wp*spec%adhesion/spec%cohesive_range*area
      end if
   end subroutine find_adhesion

   !> Weaken a bond by its opening and slip: linearly, to zero at its range.
   pure subroutine weaken(bond, spec, gap, slip)
      real(wp), intent(inout) :: bond(4) !< remaining share of its strength; its slip so far, m
      type(body_contact_spec_t), intent(in) :: spec
      real(wp), intent(in) :: gap, slip(3) !< m, at the end of the step; within the step
      if (.not. bond(1) > 0.0_wp) return
      bond(2:4) = bond(2:4) + slip
      bond(1) = max(0.0_wp, min(bond(1), 1.0_wp - hypot(max(0.0_wp, gap), norm2(bond(2:4)))/range_of(spec)))
   end subroutine weaken

end module m_pair_law
