!> Interface of a friction law: the largest tangential force of a contact point. Below it the point sticks; at
!> it the point slides, with the force against its slip (theory.md, eq. friction). A law is one file that
!> extends friction_law_t, and one line in friction_laws.f90.
module m_friction_law
   use m_kinds, only: wp
   use m_offer, only: offer_t
   implicit none
   private
   public :: has_friction

   type, abstract, extends(offer_t), public :: friction_law_t
   contains
      procedure(limit_interface), deferred :: limit
      procedure(acts_interface), deferred :: acts
      procedure(text_interface), deferred :: text
   end type friction_law_t

   !> The law of a tool's surface, or of a pair of contact groups; not allocated: no friction.
   type, public :: surface_friction_t
      class(friction_law_t), allocatable :: law
   contains
      procedure :: limit => limit_of_surface
      procedure :: text => text_of_surface
   end type surface_friction_t

   abstract interface
      !> Largest tangential force, N. Not below 0, and 0 without normal force.
      pure real(wp) function limit_interface(self, pressing, area) result(limit)
         import :: friction_law_t, wp
         class(friction_law_t), intent(in) :: self
         real(wp), intent(in) :: pressing !< normal force, N
         real(wp), intent(in) :: area     !< m2
      end function limit_interface
      !> False if the law's values mean no friction.
      pure logical function acts_interface(self) result(acts)
         import :: friction_law_t
         class(friction_law_t), intent(in) :: self
      end function acts_interface
      !> Description with its values: `friction 0.3`.
      pure function text_interface(self) result(text)
         import :: friction_law_t
         class(friction_law_t), intent(in) :: self
         character(len=:), allocatable :: text
      end function text_interface
   end interface

contains

   elemental logical function has_friction(surface)
      type(surface_friction_t), intent(in) :: surface
      has_friction = .false.
      if (allocated(surface%law)) has_friction = surface%law%acts()
   end function has_friction

   !> The limit of the surface's law.
   pure real(wp) function limit_of_surface(self, pressing, area) result(limit)
      class(surface_friction_t), intent(in) :: self
      real(wp), intent(in) :: pressing, area !< N, m2
      limit = 0.0_wp
      if (allocated(self%law)) limit = self%law%limit(pressing, area)
   end function limit_of_surface

   pure function text_of_surface(self) result(text)
      class(surface_friction_t), intent(in) :: self
      character(len=:), allocatable :: text
      text = 'friction 0'
      if (allocated(self%law)) text = self%law%text()
   end function text_of_surface

end module m_friction_law
