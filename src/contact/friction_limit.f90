!> The largest friction of a contact point, by the law of its tool or of its pair of bodies.
module m_friction_limit
   use m_kinds, only: wp
   use m_scene, only: body_contact_spec_t
   use m_tool, only: tool_t
   use m_contact_point, only: candidate_t
   implicit none
   private
   public :: friction_limit

contains

   !> Largest tangential force (N) of a point at a pressing force; the strength of a bond is added.
   pure real(wp) function friction_limit(c, tools, pairs, pressing) result(limit)
      type(candidate_t), intent(in) :: c
      type(tool_t), intent(in) :: tools(:)
      type(body_contact_spec_t), intent(in) :: pairs(:)
      real(wp), intent(in) :: pressing !< N, without the adhesive tension
      if (c%tool > 0) then
         limit = tools(c%tool)%spec%friction%limit(pressing, c%area)
      else ! both sides of the contact have points: each bears half
         limit = pairs(c%pair)%friction%limit(pressing, 0.5_wp*c%area) + c%shear_strength
      end if
   end function friction_limit

end module m_friction_limit
