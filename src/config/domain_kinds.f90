!> The kinds of domains that particles may have (`domain` of &time; theory.md, Domains): how a scene names
!> them, in which field a particle carries its half edges, and what the step asks about them. Another kind is
!> a row here, and code in the files that doc/developer/extending.md lists.
module m_domain_kinds
   implicit none
   private

   type, public :: domain_kind_t
      character(len=7) :: name = ''
      character(len=9) :: field = ''
      integer :: components = 0
      logical :: deforms = .false.  !< it follows the material, and is split where it becomes too long
      logical :: turns = .false.    !< its edges leave the axes
   end type domain_kind_t

   type(domain_kind_t), parameter, public :: domain_kinds(3) = &
      [domain_kind_t('fixed', 'half_size', 1), domain_kind_t('stretch', 'half_size', 3, deforms=.true.), &
       domain_kind_t('corners', 'domain', 9, deforms=.true., turns=.true.)]

   !> Places in that table, and what a scene that names none has until the choice is made.
   integer, parameter, public :: domain_by_law = 0, domain_fixed = 1, domain_stretch = 2, domain_corners = 3

end module m_domain_kinds
