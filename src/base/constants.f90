!> Global constants: mathematical constants, block geometry, exit statuses.
module m_constants
   use m_kinds, only: wp
   implicit none
   private
   real(wp), parameter, public :: pi = 3.14159265358979323846_wp

   character(len=*), parameter, public :: program_version = '0.3.0'

   integer, parameter, public :: exit_finished = 0  !< the scene was completed
   integer, parameter, public :: exit_input = 2     !< the scene is not valid; nothing was written
   integer, parameter, public :: exit_numerical = 3 !< the run cannot continue
   integer, parameter, public :: exit_files = 4     !< a file cannot be read or written
   integer, parameter, public :: exit_stopped = 5   !< wall limit or signal, after a checkpoint

   integer, parameter, public :: block_size = 8 !< nodes (and node-centred bins) of a block along each axis

   !> Half sizes of boxes are reduced by this factor: a face on a node plane, as at a side of the grid, must
   !> not reach the next node by round-off (theory.md, eq. fit).
   real(wp), parameter, public :: short_of = 1.0_wp - 1.0e-9_wp
end module m_constants
