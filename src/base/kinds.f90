!> Working kinds of the whole code.
module m_kinds
   use, intrinsic :: iso_fortran_env, only: real64, int32, int64
   implicit none
   private
   integer, parameter, public :: wp = real64 !< all physical quantities
   integer, parameter, public :: i4 = int32  !< counts and indices inside one rank
   integer, parameter, public :: i8 = int64  !< particle ids, sums over all ranks
end module m_kinds
