!> The conditions on sides of the grid (`boundary` of &grid; theory.md, eq. boundary): their names in a scene,
!> and their properties. Their effect on nodes is in m_boundary.
module m_side_kinds
   implicit none
   private

   type, public :: side_kind_t
      character(len=8) :: name = ''
      logical :: closed = .true.   !< no material can leave the grid there
      logical :: mirrors = .false. !< the body continues beyond it as its mirror image
      logical :: holds_all = .false. !< nodes do not move at all; else, on a closed side, not along its normal
   end type side_kind_t

   integer, parameter, public :: boundary_free = 0, boundary_symmetry = 1, boundary_roller = 2, &
                                 boundary_fixed = 3

   type(side_kind_t), parameter, public :: side_kinds(0:3) = &
      [side_kind_t('free', closed=.false.), side_kind_t('symmetry', mirrors=.true.), &
       side_kind_t('roller'), side_kind_t('fixed', holds_all=.true.)]

end module m_side_kinds
