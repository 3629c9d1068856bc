!> The kinds of particle domains (`domain` of &time; theory.md, Domains): their names in a scene, the field
!> with a particle's half edges, and their properties. Another kind is a row here, and code in the files that
!> doc/developer/extending.md lists.
module m_domain_kinds
   implicit none
   private

   type, public :: domain_kind_t
      character(len=7) :: name = ''
      character(len=9) :: field = ''
      integer :: components = 0
      logical :: deforms = .false.  !< it follows the deformation, and is split where it becomes too long
      logical :: turns = .false.    !< its edges rotate away from the axes
   end type domain_kind_t

   type(domain_kind_t), parameter, public :: domain_kinds(3) = &
      [domain_kind_t('fixed', 'half_size', 1), domain_kind_t('stretch', 'half_size', 3, deforms=.true.), &
       domain_kind_t('corners', 'domain', 9, deforms=.true., turns=.true.)]

   !> Index in that table, and the value for a scene without a choice until the choice is made.
   integer, parameter, public :: domain_by_law = 0, domain_fixed = 1, domain_stretch = 2, domain_corners = 3

end module m_domain_kinds
