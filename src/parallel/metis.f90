!> The one routine of METIS that is used, through C binding.
module m_metis
   use, intrinsic :: iso_c_binding, only: c_int, c_ptr, c_null_ptr
   implicit none
   private
   public :: partition_graph

   interface
      integer(c_int) function metis_part_graph_kway(vertices, constraints, offsets, adjacent, vertex_weights, vertex_sizes, &
                              edge_weights, parts, shares, imbalance, options, cut, part) bind(c, name='METIS_PartGraphKway')
         import :: c_int, c_ptr
         integer(c_int), intent(in) :: vertices, constraints, offsets(*), adjacent(*), vertex_weights(*), edge_weights(*), parts
         type(c_ptr), value :: vertex_sizes, shares, imbalance, options
         integer(c_int), intent(out) :: cut, part(*)
      end function metis_part_graph_kway
   end interface

contains

   !> Part (from 0) of every vertex of a graph; `offsets` and `adjacent` count from 0 (METIS manual, CSR).
   !> `failed` when METIS refuses.
   subroutine partition_graph(offsets, adjacent, vertex_weights, edge_weights, parts, part, failed)
      integer(c_int), intent(in) :: offsets(:), adjacent(:), edge_weights(:), parts
      integer(c_int), intent(in), contiguous :: vertex_weights(:, :) !< (constraints, vertices): each is balanced in itself
      integer(c_int), intent(out) :: part(:)
      logical, intent(out) :: failed
      integer(c_int) :: cut
      integer(c_int), parameter :: okay = 1
      failed = okay /= metis_part_graph_kway(size(part, kind=c_int), size(vertex_weights, 1, kind=c_int), offsets, adjacent, &
                                             vertex_weights, c_null_ptr, edge_weights, parts, c_null_ptr, c_null_ptr, &
                                             c_null_ptr, cut, part)
   end subroutine partition_graph

end module m_metis
