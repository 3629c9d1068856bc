!> Names of the values of a tile's node: kernels, levels, contact and effects address them only by these
!> names.
module m_node_values
   use m_constants, only: block_size
   implicit none
   private

   integer, parameter, public :: node_values = 8 !< values a node; the last is unused, so that a node fills a
                                                 !< cache line
   integer, parameter, public :: mass_ = 1       !< kg
   integer, parameter, public :: p_x = 2, p_z = 4 !< momentum, kg m/s, after P2G, or
   integer, parameter, public :: v_x = 2, v_z = 4 !< velocity, m/s, after the nodal solve
   integer, parameter, public :: f_x = 5, f_z = 7 !< force, N, after P2G, or
   integer, parameter, public :: a_x = 5, a_z = 7 !< acceleration, m/s2, after the nodal solve
   integer, parameter, public :: spare_ = 8      !< at edges of levels: mass of the constrained nodes alone,
                                                 !< kg
   integer, parameter, public :: tile_last = block_size + 1 !< last index of a block's node tile along each
                                                            !< axis, from 0
   integer, parameter, public :: plane_row = 1 !< index along y of a section's plane in a tile

end module m_node_values
