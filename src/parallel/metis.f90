!> The two METIS routines in use, through C binding.
module m_metis
   use m_kinds, only: wp, i8
   use, intrinsic :: iso_c_binding, only: c_int, c_float, c_ptr, c_null_ptr
   implicit none
   private
   public :: partition_graph

   abstract interface
      integer(c_int) function metis_routine(vertices, constraints, offsets, adjacent, vertex_weights, &
                                            vertex_sizes, edge_weights, parts, shares, imbalance, options, &
                                            cut, part) bind(c)
         import :: c_int, c_float, c_ptr
         integer(c_int), intent(in) :: vertices, constraints, offsets(*), adjacent(*), vertex_weights(*), &
                                       edge_weights(*), parts
         real(c_float), intent(in) :: imbalance(*)
         type(c_ptr), value :: vertex_sizes, shares, options
         integer(c_int), intent(out) :: cut, part(*)
      end function metis_routine
   end interface

   procedure(metis_routine), bind(c, name='METIS_PartGraphKway') :: metis_part_graph_kway
   procedure(metis_routine), bind(c, name='METIS_PartGraphRecursive') :: metis_part_graph_recursive

contains

   !> Part (from 0) of every vertex of a graph; `offsets` and `adjacent` count from 0 (METIS manual, CSR). By
   !> recursive bisection, or all parts at once. `failed` when METIS returns an error. METIS adds up weights
   !> in 32 bits: where their sum is too large, they are scaled down.
   subroutine partition_graph(offsets, adjacent, vertex_weights, edge_weights, parts, by_halves, imbalance, &
                              part, cut, failed)
      integer(c_int), intent(in) :: offsets(:), adjacent(:), edge_weights(:), parts
      integer(c_int), intent(in), contiguous :: vertex_weights(:, :) !< (constraints, vertices): each
                                                                     !< constraint is balanced separately
      logical, intent(in) :: by_halves
      real(wp), intent(in) :: imbalance(:) !< (constraints or more): target ratio of the heaviest part to the
                                           !< mean
      integer(c_int), intent(out) :: part(:)
      integer, intent(out) :: cut       !< weight of the edges between parts
      logical, intent(out) :: failed
      integer(c_int), parameter :: okay = 1
      integer(i8), parameter :: room = 2_i8**30
      integer(c_int), allocatable :: weights(:, :)
      integer(c_int) :: status
      integer :: c
      integer(i8) :: total
      allocate (weights, mold=vertex_weights)
      do c = 1, size(weights, 1)
         total = sum(int(vertex_weights(c, :), i8))
         weights(c, :) = int(vertex_weights(c, :)/(1 + total/room), c_int)
         where (vertex_weights(c, :) > 0) weights(c, :) = max(weights(c, :), 1)
      end do
      if (by_halves) then
         status = metis_part_graph_recursive(size(part, kind=c_int), size(vertex_weights, 1, kind=c_int), &
                                             offsets, adjacent, weights, c_null_ptr, edge_weights, parts, &
                                             c_null_ptr, real(imbalance, c_float), c_null_ptr, cut, part)
      else
         status = metis_part_graph_kway(size(part, kind=c_int), size(vertex_weights, 1, kind=c_int), &
                                        offsets, adjacent, &
                                        weights, c_null_ptr, edge_weights, parts, c_null_ptr, &
                                        real(imbalance, c_float), c_null_ptr, cut, part)
      end if
      failed = status /= okay
   end subroutine partition_graph

end module m_metis
